"""An editor for tests of `morphbus lsp`: it speaks the Language Server Protocol over the program's standard streams."""
import json
import pathlib
import select
import shutil
import subprocess
import urllib.parse

from support import LIMIT, SOURCE, Case, command


def uri_of(path):
    return 'file://' + urllib.parse.quote(str(path))


class Editor:
    """A session. Positions are those of UTF-16 unless `encodings` says otherwise."""

    def __init__(self, *folders, encodings=None, options=None, environment=None):
        self.process = subprocess.Popen(command('lsp'), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                        env=environment)
        self.bytes = b''
        self.notes = []
        self.next_id = 0
        self.texts = {}
        general = {'positionEncodings': encodings} if encodings else {}
        self.answer = self.ask('initialize', {
            'processId': None, 'capabilities': {'general': general}, 'initializationOptions': options,
            'workspaceFolders': [{'uri': uri_of(folder), 'name': 'folder'} for folder in folders]})
        self.tell('initialized', {})

    def send_text(self, text):
        data = text.encode() if isinstance(text, str) else text
        self.process.stdin.write(b'Content-Length: %d\r\n\r\n' % len(data) + data)
        self.process.stdin.flush()

    def send(self, message):
        self.send_text(json.dumps({'jsonrpc': '2.0', **message}))

    def tell(self, method, parameters):
        self.send({'method': method, 'params': parameters})

    def read(self):
        """The next message of the server."""
        while True:
            end = self.bytes.find(b'\r\n\r\n')
            if end >= 0:
                length = int(self.bytes[:end].split(b'Content-Length: ')[1].split(b'\r\n')[0])
                if len(self.bytes) >= end + 4 + length:
                    message = json.loads(self.bytes[end + 4:end + 4 + length])
                    self.bytes = self.bytes[end + 4 + length:]
                    return message
            ready, _, _ = select.select([self.process.stdout], [], [], LIMIT)
            if not ready:
                raise AssertionError('the server says nothing')
            more = self.process.stdout.read1(1 << 16)
            if not more:
                raise AssertionError(f'the server ended: {self.process.wait()}, {self.process.stderr.read().decode()}')
            self.bytes += more

    def read_answer(self, wanted):
        while True:
            message = self.read()
            if 'id' in message and message['id'] == wanted:
                return message
            self.notes.append(message)

    def ask(self, method, parameters, error=False):
        """The result of a request; with `error`, the error that it must end in."""
        self.next_id += 1
        self.send({'id': self.next_id, 'method': method, 'params': parameters})
        answer = self.read_answer(self.next_id)
        if error != ('error' in answer):
            raise AssertionError(f'{method}: {answer}')
        return answer['error'] if error else answer['result']

    def await_note(self, method, accept=lambda parameters: True):
        """The first note of this kind, of those that came already or will, that is accepted."""
        while True:
            for i, note in enumerate(self.notes):
                if note.get('method') == method and accept(note['params']):
                    del self.notes[i]
                    return note['params']
            self.notes.append(self.read())

    # --- Documents

    def open(self, path, text=None, version=1):
        path = pathlib.Path(path)
        text = path.read_text() if text is None else text
        uri = uri_of(path)
        self.texts[uri] = text
        language = 'm3l' if path.suffix == '.m3l' else 'dynarole'
        self.tell('textDocument/didOpen',
                  {'textDocument': {'uri': uri, 'languageId': language, 'version': version, 'text': text}})
        return uri

    def diagnostics(self, uri, version=1):
        return self.await_note('textDocument/publishDiagnostics',
                               lambda note: note['uri'] == uri and note.get('version') == version)['diagnostics']

    def replace(self, uri, text, version):
        self.texts[uri] = text
        self.tell('textDocument/didChange', {'textDocument': {'uri': uri, 'version': version}, 'contentChanges': [{'text': text}]})

    def position(self, uri, place, offset=0):
        """The position of the character that '|' stands before in `place`, a piece of the document's text."""
        before, _, after = place.partition('|')
        at = self.texts[uri].index(before + after) + len(before) + offset
        text = self.texts[uri][:at]
        return {'line': text.count('\n'), 'character': len(text.rpartition('\n')[2].encode('utf-16-le')) // 2}

    def at(self, uri, place):
        return {'textDocument': {'uri': uri}, 'position': self.position(uri, place)}

    def whole(self, uri):
        return {'start': {'line': 0, 'character': 0}, 'end': {'line': 1000000, 'character': 0}}

    def hover(self, uri, place):
        answer = self.ask('textDocument/hover', self.at(uri, place))
        return answer and answer['contents']['value']

    def labels(self, uri, place):
        return [item['label'] for item in self.ask('textDocument/completion', self.at(uri, place))]

    def text_at(self, location):
        """What stands at a location, in a document that is open or a file."""
        uri = location['uri']
        text = self.texts.get(uri)
        if text is None:
            text = pathlib.Path(urllib.parse.unquote(uri[len('file://'):])).read_text()
        start, end = location['range']['start'], location['range']['end']
        line = text.split('\n')[start['line']].encode('utf-16-le')
        return line[2 * start['character']:2 * end['character']].decode('utf-16-le')

    def apply(self, edit):
        """The texts of all documents with an edit carried out; files are not written."""
        texts = {}
        for uri, edits in edit['changes'].items():
            lines = self.texts.get(uri) or pathlib.Path(urllib.parse.unquote(uri[len('file://'):])).read_text()
            starts = [0]
            for line in lines.split('\n'):
                starts.append(starts[-1] + len(line) + 1)
            for change in sorted(edits, key=lambda e: (e['range']['start']['line'], e['range']['start']['character']),
                                 reverse=True):
                begin = starts[change['range']['start']['line']] + change['range']['start']['character']
                end = starts[min(change['range']['end']['line'], len(starts) - 1)] + change['range']['end']['character']
                lines = lines[:begin] + change['newText'] + lines[end:]
            texts[uri] = lines
        return texts

    def close(self):
        """Ends the session as the protocol has it; returns the exit status."""
        self.ask('shutdown', None)
        self.tell('exit', None)
        self.process.stdin.close()
        status = self.process.wait(LIMIT)
        self.process.stdout.close()
        self.process.stderr.close()
        return status


MODELS = SOURCE / 'models'


class Session(Case):
    """A workspace with copies of models and a program, and an editor on it. Two of the models import the first."""

    def setUp(self):
        super().setUp()
        for name in ('mtran.m3l', 'mtran_robots.m3l', 'mixed.m3l'):
            shutil.copy(MODELS / name, self.folder / name)
        shutil.copy(MODELS / 'programs' / 'quadruped.dyn', self.folder / 'quadruped.dyn')
        self.editor = Editor(self.folder)
        self.model = self.editor.open(self.folder / 'mtran.m3l')
        self.program = self.editor.open(self.folder / 'quadruped.dyn')

    def tearDown(self):
        self.assertEqual(self.editor.close(), 0)
        super().tearDown()
