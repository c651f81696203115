"""What tests of the monitor talk to it with: the process itself, a WebSocket client of our own, and Foxglove's.

Nothing here knows more of the monitor than docs/monitor-protocol.md and RFC 6455 say.
"""
import base64
import json
import os
import socket
import struct
import subprocess

from support import LIMIT, SCRATCH, command

TOKEN = 'token-of-the-tests'
CLIENT = SCRATCH / 'outward_client'


class Monitor:
    """A monitor under way; `arguments` are its own."""

    def __init__(self, case, *arguments, token=TOKEN):
        self.process = subprocess.Popen(command('monitor', '--port', '0', '--token', token, '--json', *arguments),
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        case.kill_at_the_end(self.process)
        line = self.process.stdout.readline()
        if not line:
            raise AssertionError(self.process.communicate()[1])
        self.said = json.loads(line)
        self.port = self.said['port']

    def connect(self):
        return socket.create_connection(('127.0.0.1', self.port), timeout=LIMIT)

    def request(self, text):
        """The answer to a request, sent as it is; '' if the server only closed the connection."""
        with self.connect() as s:
            s.sendall(text.encode('latin-1'))
            return read_all(s)

    def get(self, target, host='localhost', method='GET', headers=''):
        return self.request(f'{method} {target} HTTP/1.1\r\nHost: {host}\r\n{headers}\r\n')

    def refused(self):
        """What it counts as refused now, as it tells a new client."""
        client = WebSocket(self).greet()
        client.close()
        return json.loads(client.info['metadata']['refused'])

    def stop(self):
        """Ends it and returns what it counted as refused, by kind."""
        self.process.send_signal(2)
        _, errors = self.process.communicate(timeout=LIMIT)
        if self.process.returncode != 0:
            raise AssertionError(errors)
        for line in errors.splitlines():
            if 'refused: ' in line:
                pairs = line.split('refused: ')[1].split(', ')
                return {kind: int(count) for kind, count in (pair.split() for pair in pairs)}
        return {}


def read_all(s):
    data = b''
    try:
        while chunk := s.recv(65536):
            data += chunk
    except (ConnectionResetError, socket.timeout):
        pass
    return data.decode('latin-1')


class WebSocket:
    """A client by the letter of RFC 6455, as small as can be."""

    def __init__(self, monitor, query=f'?token={TOKEN}', protocols='foxglove.websocket.v1', headers='', expect=101,
                 receive_buffer=None):
        self.socket = socket.socket()
        if receive_buffer:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        self.socket.settimeout(60)
        self.socket.connect(('127.0.0.1', monitor.port))
        key = base64.b64encode(os.urandom(16)).decode()
        offer = f'Sec-WebSocket-Protocol: {protocols}\r\n' if protocols else ''
        self.socket.sendall((f'GET /{query} HTTP/1.1\r\nHost: 127.0.0.1:{monitor.port}\r\nConnection: Upgrade\r\n'
                             f'Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n'
                             f'{offer}{headers}\r\n').encode())
        head = b''
        while b'\r\n\r\n' not in head:
            chunk = self.socket.recv(1)
            if not chunk:
                break
            head += chunk
        self.head = head.decode('latin-1')
        self.status = int(self.head.split()[1]) if self.head else 0
        if self.status != expect:
            raise AssertionError(f'status {self.status}, expected {expect}: {self.head}')

    def close(self):
        self.socket.close()

    def send(self, payload, opcode=1):
        if isinstance(payload, dict):
            payload = json.dumps(payload)
        data = payload.encode() if isinstance(payload, str) else payload
        mask = os.urandom(4)
        size = len(data)
        head = bytes([0x80 | opcode])
        head += (bytes([0x80 | size]) if size < 126 else bytes([0xFE]) + struct.pack('>H', size) if size < 65536
                 else bytes([0xFF]) + struct.pack('>Q', size))
        masked = bytes(b ^ mask[i % 4] for i, b in enumerate(data)) if size < 10000 else data
        if size >= 10000:
            mask = b'\0\0\0\0'
        self.socket.sendall(head + mask + masked)

    def exactly(self, size):
        data = b''
        while len(data) < size:
            chunk = self.socket.recv(size - len(data))
            if not chunk:
                raise EOFError
            data += chunk
        return data

    def receive(self):
        """The next message: a dict for a text, bytes for a binary one."""
        while True:
            head = self.exactly(2)
            size = head[1] & 0x7F
            if size == 126:
                size, = struct.unpack('>H', self.exactly(2))
            elif size == 127:
                size, = struct.unpack('>Q', self.exactly(8))
            data = self.exactly(size)
            if head[0] & 0x0F == 8:
                raise EOFError
            if head[0] & 0x0F == 1:
                return json.loads(data)
            if head[0] & 0x0F == 2:
                return data

    def until(self, wanted):
        """The first message of which `wanted` is true."""
        while True:
            message = self.receive()
            if wanted(message):
                return message

    def op(self, name):
        return self.until(lambda m: isinstance(m, dict) and m['op'] == name)

    def greet(self):
        """Reads the greeting: serverInfo, channels by topic, services by name."""
        self.info = self.op('serverInfo')
        self.channels = {c['topic']: c['id'] for c in self.op('advertise')['channels']}
        self.services = {s['name']: s['id'] for s in self.op('advertiseServices')['services']}
        return self

    def call(self, name, request, call=1):
        """The answer of a service, or the text of its failure."""
        self.send(struct.pack('<BIII', 2, self.services[name], call, 4) + b'json' + json.dumps(request).encode(), 2)
        answer = self.until(lambda m: (isinstance(m, bytes) and m[0] == 3) or
                            (isinstance(m, dict) and m['op'] == 'serviceCallFailure'))
        if isinstance(answer, dict):
            return answer['message']
        return json.loads(answer[13 + struct.unpack_from('<I', answer, 9)[0]:])

    def play(self, command, speed, seek_ns=None, request='1'):
        """Asks for a playback as Foxglove's app does (PlaybackControlRequest of its SDK): 0 plays, 1 pauses. The answer."""
        self.send(struct.pack('<BBfBQI', 3, command, speed, seek_ns is not None, seek_ns or 0, len(request)) + request.encode(), 2)
        return self.playback(lambda state: state['request'] == request)

    def playback(self, wanted=lambda state: True):
        """The first PlaybackState of which `wanted` is true."""
        while True:
            frame = self.until(lambda m: isinstance(m, bytes) and m[0] == 5)
            status, time_ns, speed, did_seek, size = struct.unpack_from('<BQfBI', frame, 1)
            state = {'status': ('playing', 'paused', 'buffering', 'ended')[status], 'time_ns': time_ns, 'speed': speed,
                     'did_seek': bool(did_seek), 'request': frame[19:19 + size].decode()}
            if wanted(state):
                return state

    def subscribe(self, *topics):
        self.send({'op': 'subscribe', 'subscriptions':
                   [{'id': self.channels[t], 'channelId': self.channels[t]} for t in topics]})


def run_client(url, *arguments):
    done = subprocess.run(['node', str(CLIENT / 'client.mjs'), url, *arguments], capture_output=True, text=True,
                          timeout=LIMIT)
    if done.returncode != 0:
        raise AssertionError(done.stderr)
    return json.loads(done.stdout)
