#!/usr/bin/env python3
"""morphbus lsp: each feature on both languages, as an editor asks for it."""
import json
import os
import pty
import random
import shutil
import subprocess
import unittest

from lsp_client import MODELS, Editor, Session, uri_of
from support import LIMIT, Case, command, morphbus


class Features(Session):
    def test_says_what_it_can(self):
        capabilities = self.editor.answer['capabilities']
        self.assertEqual(capabilities['positionEncoding'], 'utf-16')
        self.assertEqual(self.editor.answer['serverInfo']['name'], 'morphbus')
        for provider in ('hover', 'completion', 'signatureHelp', 'definition', 'references', 'documentHighlight', 'documentSymbol',
                         'workspaceSymbol', 'documentFormatting', 'rename', 'codeAction', 'inlayHint'):
            self.assertIn(provider + 'Provider', capabilities)

    def test_errors_appear_as_one_types_and_go_when_they_are_mended(self):
        self.assertEqual(self.editor.diagnostics(self.model), [])
        self.assertEqual(self.editor.diagnostics(self.program), [])
        whole = self.editor.texts[self.model]
        broken = whole.replace('m2.c5), (m2.c2', 'm2.c55), (m2.c2', 1)
        at = broken.index('c55')
        line, column = broken[:at].count('\n'), at - broken.rindex('\n', 0, at) - 1
        # One key is pressed, as editors tell it.
        self.editor.tell('textDocument/didChange', {
            'textDocument': {'uri': self.model, 'version': 2},
            'contentChanges': [{'range': {'start': {'line': line, 'character': column + 2},
                                          'end': {'line': line, 'character': column + 2}}, 'text': '5'}]})
        found = self.editor.diagnostics(self.model, 2)
        self.assertEqual(len(found), 1, found)
        self.assertIn("has no connector 'c55'", found[0]['message'])
        self.assertEqual(found[0]['severity'], 1)
        self.assertEqual(found[0]['range']['start'], {'line': line, 'character': column})
        self.editor.replace(self.model, whole, 3)
        self.assertEqual(self.editor.diagnostics(self.model, 3), [])

    def test_a_program_knows_the_model_that_is_being_typed(self):
        self.editor.diagnostics(self.program)
        renamed = self.editor.texts[self.model].replace('connecting_bar', 'bar')
        self.editor.replace(self.model, renamed, 2)
        found = self.editor.await_note('textDocument/publishDiagnostics',
                                       lambda note: note['uri'] == self.program and note['diagnostics'])['diagnostics']
        # mtran_robots.m3l imports the model, so that no file on disk knows the old name either.
        self.assertTrue(any('LINK_CONNECTING_BAR' in one['message'] for one in found), found)

    def test_errors_in_an_import_stand_at_the_import(self):
        robots = self.editor.open(self.folder / 'mtran_robots.m3l')
        self.assertEqual(self.editor.diagnostics(robots), [])
        self.editor.replace(self.model, self.editor.texts[self.model].replace('value=[-pi/2, pi/2]', 'value=[1, -1]', 1), 2)
        found = self.editor.await_note('textDocument/publishDiagnostics',
                                       lambda note: note['uri'] == robots and note['diagnostics'])['diagnostics']
        self.assertIn('mtran.m3l:', found[0]['message'])
        self.assertEqual(self.editor.text_at({'uri': robots, 'range': found[0]['range']}), '"mtran.m3l"')

    def test_hover_in_a_model(self):
        docking = self.editor.hover(self.model, '(m3.c6, m5.c3, |3)')
        self.assertIn('connection MTRAN_to_MTRAN:3, c6 of MTRAN on c3 of MTRAN', docking)
        self.assertIn('turned (w x y z)', docking)
        self.assertRegex(docking, r'data:image/(svg\+xml|png);base64,[\w+/]{1000}')
        shown = json.loads(morphbus('connections', self.folder / 'mtran.m3l', '--pair', 'c6,c3', '--json').stdout)
        pose = next(one['pose'] for one in shown['connections'] if one['number'] == 3)
        self.assertIn('({})'.format(', '.join(f'{x:.5f}' for x in pose['p'])), docking)
        self.assertIn('1.9 N·m', self.editor.hover(self.model, 'joint |joint_1: type'))
        self.assertIn('-90° to 90°', self.editor.hover(self.model, 'joint |joint_1: type'))
        self.assertIn('here: -0.0325 m, 0 m, 0.0325 m', self.editor.hover(self.model, 'coords=(-1, |0, 1), connector'))
        self.assertIn('metres per model unit', self.editor.hover(self.model, '|unit=0.0325'))
        self.assertIn('3 links, 2 joints, 6 connectors, 0.42 kg', self.editor.hover(self.model, 'module |MTRAN'))
        self.assertIn('9 modules, 18 joints, 10 connections', self.editor.hover(self.model, 'robot |quadruped'))
        # So many faces are told by pixels, and a single module by lines.
        self.assertIn('data:image/png;base64,', self.editor.hover(self.model, 'robot |quadruped'))
        self.assertRegex(self.editor.hover(self.model, 'module |MTRAN'), r'data:image/(svg\+xml|png);base64,[\w+/]{1000}')
        place = self.editor.hover(self.model, 'frame=(|m5')
        self.assertIn('module m5 of type MTRAN', place)
        self.assertIn("m of the robot's frame", place)
        self.assertIsNone(self.editor.hover(self.model, '// m5 is| the junction'))

    def test_hover_in_a_program(self):
        self.editor.await_note('morphbus/rolesKnown', lambda note: note['uri'] == self.program)
        role = self.editor.hover(self.program, 'role |FrontLeftUpperHalf')
        self.assertIn('extends', role)
        self.assertIn('require ', role)
        # Who takes it is what `morphbus roles` says.
        for robot in ('quadruped', 'equivalent_quadruped'):
            roles = json.loads(morphbus('roles', self.folder / 'mtran.m3l', self.folder / 'quadruped.dyn', '--robot', robot,
                                        '--json').stdout)
            module = next(name for name, one in roles['modules'].items() if one['role'] == 'FrontLeftUpperHalf')
            self.assertIn(f'- {robot} of mtran.m3l: {module}\n', role)
        keyword = self.editor.hover(self.program, '$|LINK_CONNECTING_BAR')
        self.assertIn('MTRAN: link connecting_bar: 0.06 kg', keyword)
        self.assertIn('turns by so many degrees', self.editor.hover(self.program, 'self.|jointRotateDegrees('))
        # A comment above a declaration is shown with it.
        self.editor.replace(self.program, '// Walks on.\n// Slowly.\nrole R extends Module {\n}\n', 2)
        self.assertIn('Walks on.\nSlowly.', self.editor.hover(self.program, 'role |R'))

    def test_definitions_in_and_across_both_languages(self):
        def definitions(uri, place):
            return self.editor.ask('textDocument/definition', self.editor.at(uri, place))
        found = definitions(self.model, '(m1.|c2, m2.c5)')
        self.assertEqual([self.editor.text_at(one) for one in found], ['c2'])
        self.assertEqual(found[0]['range']['start']['line'], self.editor.position(self.model, 'point |c2:')['line'])
        self.assertEqual(self.editor.text_at(definitions(self.model, '(|m1.c2, m2.c5)')[0]), 'm1')
        self.assertEqual(self.editor.text_at(definitions(self.model, 'members=(|MTRAN a')[0]), 'MTRAN')
        # All sub-points of the name that conditions speak of.
        self.assertEqual(len(definitions(self.model, '(p_a.|_1 coincident')), 6)
        link = definitions(self.program, '$|LINK_CONNECTING_BAR')
        self.assertEqual([(one['uri'], self.editor.text_at(one)) for one in link], [(self.model, 'connecting_bar')])
        base = definitions(self.program, 'FrontLeftUpperHalf extends |')
        self.assertEqual(len(base), 1)

    def test_references_and_highlights(self):
        robots = self.editor.open(self.folder / 'mtran_robots.m3l')
        where = {'context': {'includeDeclaration': True}, **self.editor.at(self.model, 'module |MTRAN')}
        found = self.editor.ask('textDocument/references', where)
        self.assertTrue(all(self.editor.text_at(one) == 'MTRAN' for one in found))
        self.assertEqual({one['uri'] for one in found}, {self.model, robots, uri_of(self.folder / 'mixed.m3l')})
        where['context']['includeDeclaration'] = False
        self.assertEqual(len(self.editor.ask('textDocument/references', where)), len(found) - 1)
        link = {'context': {'includeDeclaration': True}, **self.editor.at(self.model, 'link |connecting_bar')}
        self.assertIn(self.program, {one['uri'] for one in self.editor.ask('textDocument/references', link)})
        marks = self.editor.ask('textDocument/documentHighlight', self.editor.at(self.program, 'role |FrontLeftUpperHalf'))
        self.assertEqual([mark['kind'] for mark in marks].count(3), 1)

    def test_rename_keeps_models_and_programs_whole(self):
        edit = self.editor.ask('textDocument/rename', {**self.editor.at(self.model, 'link |connecting_bar'), 'newName': 'strut'})
        texts = self.editor.apply(edit)
        self.assertEqual(set(texts), {self.model, self.program, uri_of(self.folder / 'mtran_robots.m3l')})
        for uri, text in texts.items():
            (self.folder / uri.rpartition('/')[2]).write_text(text)
        self.assertIn('$LINK_STRUT', texts[self.program])
        morphbus('roles', self.folder / 'mtran.m3l', self.folder / 'quadruped.dyn', '--robot', 'quadruped')
        role = self.editor.ask('textDocument/rename', {**self.editor.at(self.program, 'role |FrontLeftUpperHalf'), 'newName': 'Paw'})
        (self.folder / 'quadruped.dyn').write_text(self.editor.apply(role)[self.program].replace('CONNECTING_BAR', 'STRUT'))
        self.assertIn('Paw', morphbus('roles', self.folder / 'mtran.m3l', self.folder / 'quadruped.dyn', '--robot',
                                      'quadruped').stdout)

    def test_enumerations_switches_and_functions_outside_roles(self):
        text = ('enum Phase { LIFT, SWING }\nfunction shown(x) {\n  return x + 1;\n}\nrole R extends Module {\n  phase = LIFT;\n'
                '  behavior b() {\n    switch (phase) {\n      case LIFT:\n        phase = Phase.SWING;\n      default:\n'
                '        phase = phase == SWING ? LIFT : shown(0);\n        self.sleepds(1);\n    }\n  }\n}\n')
        self.editor.replace(self.program, text, 2)
        self.assertEqual(self.editor.diagnostics(self.program, 2), [])
        self.assertIn('Phase.SWING = 1', self.editor.hover(self.program, 'phase = Phase.|SWING'))
        self.assertIn('enum Phase', self.editor.hover(self.program, 'phase = |Phase.SWING'))
        self.assertIn('function shown(x: int): int', self.editor.hover(self.program, ': |shown(0)'))
        self.assertIn('the number of the module', self.labels_at(text.replace('phase = Phase.SWING', 'phase = self.'), 'phase = self.|')['id'])
        self.assertEqual(list(self.labels_at(text.replace('Phase.SWING', 'Phase.'), 'phase = Phase.|')), ['LIFT', 'SWING'])
        self.assertIn('switch', self.labels_at(text.replace('        self.sleepds', '        s\n        self.sleepds'), '        s|\n'))
        self.assertIn('x', self.labels_at(text.replace('return x + 1', 'return '), 'return |'))
        self.editor.replace(self.program, text, 99)
        renamed = self.editor.apply(self.editor.ask('textDocument/rename', {**self.editor.at(self.program, 'Phase.|SWING'), 'newName': 'DOWN'}))
        self.assertEqual(renamed[self.program].count('DOWN'), 3)
        renamed = self.editor.apply(self.editor.ask('textDocument/rename', {**self.editor.at(self.program, 'enum |Phase'), 'newName': 'Step'}))
        self.assertIn('phase = Step.SWING;', renamed[self.program])
        outline = self.editor.ask('textDocument/documentSymbol', {'textDocument': {'uri': self.program}})
        # Half of a choice is none, and typing goes on.
        for half in ('x > 1 ?', 'x > 1 ? 2', 'x > 1 ? 2 :'):
            self.editor.replace(self.program, text.replace('x + 1', half), 60)
            self.assertTrue(self.editor.diagnostics(self.program, 60))
        self.assertEqual({one['name'] for one in outline}, {'Phase', 'LIFT', 'SWING', 'shown', 'R'})

    def labels_at(self, text, place):
        """What is offered in this text: labels and their details."""
        self.editor.replace(self.program, text, 50)
        found = self.editor.ask('textDocument/completion', self.editor.at(self.program, place))
        items = found['items'] if isinstance(found, dict) else found
        return {one['label']: one.get('detail', '') for one in items}

    def test_rename_refuses_what_cannot_be(self):
        def refused(uri, place, name):
            return self.editor.ask('textDocument/rename', {**self.editor.at(uri, place), 'newName': name}, error=True)['message']
        self.assertIn('is no name', refused(self.model, 'link |connecting_bar', '1st'))
        self.assertIn('word of the language', refused(self.model, 'link |connecting_bar', 'robot'))
        self.assertIn("there is another 'active_block'", refused(self.model, 'link |connecting_bar', 'active_block'))
        self.assertIn('belongs to the language', refused(self.program, 'self.|jointRotateDegrees(', 'turn'))
        self.assertIn('in its model', refused(self.program, '$|LINK_CONNECTING_BAR', 'BAR'))
        where = self.editor.ask('textDocument/prepareRename', self.editor.at(self.model, 'link |connecting_bar'))
        self.assertEqual(where['placeholder'], 'connecting_bar')

    def test_rename_keeps_what_every_name_means(self):
        text = ('const top = 1;\nabstract role Base extends Module {\n  shade = 2;\n}\nrole R extends Base {\n  own = 3;\n  trace own;\n'
                '  function give(x) { return x + own; }\n'
                '  behavior b() {\n    var outer = give(top);\n    if (outer > 2) { var inner = outer; print("i", inner + shade + outer); }\n'
                '    self.sleepds(top);\n  }\n}\n')
        self.editor.replace(self.program, text, 2)
        self.assertEqual(self.editor.diagnostics(self.program, 2), [])

        def rename(place, name, error=False):
            return self.editor.ask('textDocument/rename', {**self.editor.at(self.program, place), 'newName': name}, error=error)

        def refused(place, name, line):
            message = rename(place, name, error=True)['message']
            self.assertIn(f'quadruped.dyn:{line}: ', message)
            self.assertIn('would mean something else', message)
        # An outer variable, a field, an inherited one and a constant that an inner name would hide, and the other way round.
        refused('var |outer', 'inner', 11)
        refused('  |own = 3', 'x', 8)
        refused('var |outer', 'shade', 11)
        refused('  |shade = 2', 'inner', 11)
        refused('const |top', 'outer', 12)
        refused('var |inner', 'outer', 11)
        # A name of another scope that nobody there misses is free.
        self.assertIn('var x = give(top)', self.editor.apply(rename('var |outer', 'x'))[self.program])
        self.assertIn('const inner = 1;', self.editor.apply(rename('const |top', 'inner'))[self.program])
        # A field that is traced is renamed there, too.
        self.assertIn('trace mine;', self.editor.apply(rename('  |own = 3', 'mine'))[self.program])

    def test_outlines_and_symbols_of_the_workspace(self):
        outline = self.editor.ask('textDocument/documentSymbol', {'textDocument': {'uri': self.model}})
        self.assertEqual([one['name'] for one in outline], ['MTRAN', 'MTRAN_to_MTRAN', 'quadruped', 'equivalent_quadruped'])
        self.assertIn('joint_1', [one['name'] for one in outline[0]['children']])
        roles = self.editor.ask('textDocument/documentSymbol', {'textDocument': {'uri': self.program}})
        self.assertIn('FrontLeftUpperHalf', [one['name'] for one in roles])
        found = self.editor.ask('workspace/symbol', {'query': 'upperhalf'})
        self.assertIn('FrontLeftUpperHalf', [one['name'] for one in found])

    def test_formatting(self):
        for uri in (self.model, self.program):
            self.assertEqual(self.editor.ask('textDocument/formatting', {'textDocument': {'uri': uri}, 'options': {}}), [])
            text = self.editor.texts[uri]
            self.editor.replace(uri, text.replace('coords=', 'coords = ').replace('  self.', '      self.').replace('\n\n', '\n\n\n\n'), 2)
            edits = self.editor.ask('textDocument/formatting', {'textDocument': {'uri': uri}, 'options': {}})
            self.assertEqual(self.editor.apply({'changes': {uri: edits}})[uri], text)

    def test_inlay_hints(self):
        hints = self.editor.ask('textDocument/inlayHint', {'textDocument': {'uri': self.model}, 'range': self.editor.whole(self.model)})
        graph = json.loads(morphbus('connections', self.folder / 'mtran.m3l', '--pair', 'c2,c5', '--json').stdout)
        default = graph['connections'][0]['number']
        self.assertIn(f' :{default}', [hint['label'] for hint in hints])
        # A docking that says its number has none.
        said = self.editor.position(self.model, '(m3.c6, m5.c3, 3|)')
        self.assertNotIn(said, [hint['position'] for hint in hints])
        text = 'role R extends Module {\n  function f(x) {\n    var y = x * 1.5;\n    return y;\n  }\n  startup s() {\n    self.sleepcs(f(2.0));\n  }\n}\n'
        other = self.editor.open(self.folder / 'other.dyn', text)
        hints = self.editor.ask('textDocument/inlayHint', {'textDocument': {'uri': other}, 'range': self.editor.whole(other)})
        self.assertEqual([hint['label'] for hint in hints], [': float', ': float'])

    def test_preview(self):
        model = self.editor.ask('morphbus/preview', {'textDocument': {'uri': self.model}, 'robot': 'equivalent_quadruped'})
        self.assertEqual(model['robots'], ['quadruped', 'equivalent_quadruped'])
        self.assertEqual(model['robot'], 'equivalent_quadruped')
        self.assertIn('<svg', model['svg'])
        self.editor.await_note('morphbus/rolesKnown', lambda note: note['uri'] == self.program)
        program = self.editor.ask('morphbus/preview', {'textDocument': {'uri': self.program}})
        self.assertTrue(program['complete'])
        self.assertEqual(len(program['modules']), 9)
        self.assertTrue(all(one['role'] for one in program['modules']))


class Settings(Case):
    PROGRAM = 'role R extends Module {\n  startup s() {\n    self.jointSetDegrees(self.JOINT_1, 5);\n  }\n}\n'

    def test_models_are_those_that_the_user_chooses(self):
        """The program lies where no model is; one is named at the beginning, and later another."""
        other = self.folder / 'other.m3l'
        for options in ({'models': [str(MODELS / 'mtran.m3l')]}, {'morphbus': {'models': [str(MODELS / 'mtran.m3l')]}}):
            with self.subTest(options):
                programs = self.folder / 'programs'
                programs.mkdir(exist_ok=True)
                editor = Editor(programs, options=options)
                uri = editor.open(programs / 'p.dyn', self.PROGRAM)
                self.assertEqual(editor.diagnostics(uri), [])
                other.write_text('module M: unit=1\nlink l: hull=box(size=(1, 1, 1))\n')
                editor.tell('workspace/didChangeConfiguration', {'settings': {'morphbus': {'models': [str(other)]}}})
                self.assertIn("'self' has no 'JOINT_1'", editor.diagnostics(uri)[0]['message'])
                editor.close()
        editor = Editor(programs)
        self.assertIn("'self' has no 'JOINT_1'", editor.diagnostics(editor.open(programs / 'p.dyn', self.PROGRAM))[0]['message'])
        editor.close()

    def test_texts_that_were_never_saved(self):
        editor = Editor(self.folder)
        for language, text, place, said in (('m3l', 'module M: unit=1\nlink body: mass=2\n', (1, 6), '2 kg'),
                                            ('dynarole', 'role R extends Module {\n  speed = 5;\n}\n', (1, 3), 'speed: int = 5')):
            uri = f'untitled:Untitled-{language}'
            editor.tell('textDocument/didOpen', {'textDocument': {'uri': uri, 'languageId': language, 'version': 1, 'text': text}})
            at = {'textDocument': {'uri': uri}, 'position': {'line': place[0], 'character': place[1]}}
            self.assertIn(said, editor.ask('textDocument/hover', at)['contents']['value'])
            found = editor.ask('textDocument/references', {**at, 'context': {'includeDeclaration': True}})
            self.assertEqual([one['uri'] for one in found], [uri])
        editor.close()

    def test_of_two_imports_the_one_with_the_error_is_marked(self):
        (self.folder / 'good.m3l').write_text('module G: unit=1\nlink l: mass=1\n')
        (self.folder / 'bad.m3l').write_text('module B: unit=1\nlink l: mas=1\n')
        editor = Editor(self.folder)
        uri = editor.open(self.folder / 'all.m3l', 'import "good.m3l"\nimport "bad.m3l"\n')
        found = editor.diagnostics(uri)
        self.assertEqual([editor.text_at({'uri': uri, 'range': one['range']}) for one in found], ['"bad.m3l"'])
        editor.close()

    def test_many_modules_have_no_picture(self):
        module = 'module M: unit=1\npoint a: coords=(0, 0, 1), connector, normal=(0, 0, 1)\npoint b: coords=(0, 0, -1), connector, ' \
                 'normal=(0, 0, -1)\nlink l: grouping=(a, b), hull=box(size=(1, 1, 2))\naxis x: origin=(0, 0, 0), direction=(1, 0, 0)\n' \
                 'connection C: members=(M m, M n), conditions=(m.point p coincident n.point q and p antiparallel q and m.x parallel n.x)\n'
        editor = Editor(self.folder)
        for number, drawn in ((3, True), (201, False)):
            names = [f'm{i}' for i in range(number)]
            text = module + 'robot r: modules=({}), connections=({})\n'.format(
                ', '.join('M ' + name for name in names), ', '.join(f'({x}.a, {y}.b)' for x, y in zip(names, names[1:])))
            uri = editor.open(self.folder / f'{number}.m3l', text)
            self.assertEqual(editor.diagnostics(uri), [])
            hover = editor.hover(uri, 'robot |r:')
            self.assertIn(f'{number} modules', hover)
            self.assertEqual('data:image' in hover, drawn)
        editor.close()


class Positions(Case):
    TEXT = '// 🤖 ü\n/* 🤖 */ module M: unt=1\n'

    def test_characters_beyond_the_first_plane_count_two_or_four(self):
        for encodings, column in ((None, 19), (['utf-8', 'utf-16'], 21), (['utf-32'], 19)):
            with self.subTest(encodings):
                editor = Editor(self.folder, encodings=encodings)
                self.assertEqual(editor.answer['capabilities']['positionEncoding'],
                                 'utf-8' if encodings and 'utf-8' in encodings else 'utf-16')
                uri = editor.open(self.folder / 'm.m3l', self.TEXT)
                starts = [one['range']['start'] for one in editor.diagnostics(uri) if 'unt' in one['message']]
                self.assertEqual(starts, [{'line': 1, 'character': column}])
                editor.close()

    def test_names_of_files_with_blanks_and_signs(self):
        folder = self.folder / 'a b%20ü#?'
        folder.mkdir()
        shutil.copy(MODELS / 'mtran.m3l', folder / 'mtran.m3l')
        (folder / 'r.m3l').write_text('import "mtran.m3l"\nrobot r: modules=(MTRAN m)\n')
        editor = Editor(folder)
        uri = editor.open(folder / 'r.m3l')
        self.assertEqual(editor.diagnostics(uri), [])
        found = editor.ask('textDocument/definition', editor.at(uri, 'modules=(|MTRAN'))
        self.assertEqual(found[0]['uri'], uri_of(folder / 'mtran.m3l'))
        self.assertEqual(editor.text_at(found[0]), 'MTRAN')
        editor.close()


class Hostile(Case):
    def test_messages_that_are_none(self):
        editor = Editor(self.folder)
        uri = editor.open(self.folder / 'm.m3l', 'module M: unit=1\n')
        editor.diagnostics(uri)
        for text in ('{', '[]', '17', '"x"', '{"jsonrpc":"2.0","id":7}', b'\xff\xfe', '{"id":8,"method":5}', '{"id":[[]],"method":"shutdown"}'):
            editor.send_text(text)
            self.assertIn('error', editor.read())
        for method, parameters in (('textDocument/hover', None), ('textDocument/hover', {'textDocument': {'uri': 'file:///none.m3l'}}),
                                   ('textDocument/hover', {'textDocument': {'uri': uri}, 'position': {'line': -1, 'character': 'x'}}),
                                   ('textDocument/completion', {'textDocument': {'uri': uri}, 'position': {}}),
                                   ('textDocument/codeAction', {'textDocument': {'uri': uri}}), ('no/such', {}), ('initialize', {})):
            self.assertIn('code', editor.ask(method, parameters, error=True))
        for method, parameters in (('textDocument/didOpen', None), ('textDocument/didChange', {'textDocument': uri}),
                                   ('textDocument/didChange', {'textDocument': {'uri': uri}, 'contentChanges': [
                                       5, {'range': {}}, {'text': 6}, {'range': {'start': 1}, 'text': 'x'}]}),
                                   ('textDocument/didClose', {'textDocument': {'uri': 'file:///none'}}), ('$/none', {})):
            editor.tell(method, parameters)
        # Places beyond all text are its end.
        far = {'textDocument': {'uri': uri}, 'position': {'line': 10**12, 'character': 10**12}}
        editor.ask('textDocument/hover', far)
        editor.ask('textDocument/completion', far)
        self.assertEqual(editor.close(), 0)

    def test_input_that_is_no_message(self):
        for data, status, words in ((b'', 1, ''), (b'hello\r\n\r\n', 2, 'Content-Length'),
                                    (b'Content-Length: 99999999999\r\n\r\n', 2, 'the most is'),
                                    (b'x' * 100000, 2, 'no message'), (b'Content-Length: 5\r\n\r\n{', 1, '')):
            with self.subTest(data[:20]):
                done = subprocess.run(command('lsp', '--stdio'), input=data, capture_output=True, timeout=LIMIT)
                self.assertEqual(done.returncode, status, done.stderr)
                self.assertIn(words, done.stderr.decode())

    def test_a_person_at_a_terminal_is_told_what_it_is(self):
        typed, terminal = pty.openpty()
        server = subprocess.Popen(command('lsp'), stdin=terminal, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        os.close(terminal)
        self.assertIn('waits for an editor', server.stderr.readline())
        os.write(typed, b'\x04')
        self.assertEqual(server.wait(LIMIT), 1)
        os.close(typed)
        server.stdout.close()
        server.stderr.close()

    def test_an_editor_that_goes_without_a_word(self):
        exit_only = b'{"jsonrpc":"2.0","method":"exit"}'
        done = subprocess.run(command('lsp'), input=b'Content-Length: %d\r\n\r\n' % len(exit_only) + exit_only, capture_output=True,
                              timeout=LIMIT)
        self.assertEqual(done.returncode, 1)

    def test_edits_at_random_places(self):
        """Hundreds of edits of both languages; the server answers after each, and at the end as if nothing had been."""
        rng = random.Random(24)
        editor = Editor(MODELS)
        names = ('mtran.m3l', 'programs/quadruped.dyn', 'atron.m3l', 'programs/car_evade.dyn')
        pieces = ('(', ')', ',', '.', '"', '$', '{', '}', ':', 'x', '1e9', 'self.', 'robot r: ', 'role R extends ', '/*', '\n', 'ü', '🤖')
        for name in names:
            path = MODELS / name
            uri, whole = editor.open(path), path.read_text()
            text, version = whole, 1
            for _ in range(60):
                begin = rng.randrange(len(text) + 1)
                end = min(len(text), begin + rng.choice((0, 0, 1, 3, 30)))
                text = text[:begin] + rng.choice(pieces + ('',)) + text[end:]
                version += 1
                editor.replace(uri, text, version)
                at = rng.randrange(len(text) + 1)
                place = {'textDocument': {'uri': uri}, 'position': {'line': text[:at].count('\n'), 'character': at - (text.rfind('\n', 0, at) + 1)}}
                for method in ('hover', 'completion', 'signatureHelp', 'definition'):
                    editor.ask('textDocument/' + method, place)
                editor.ask('textDocument/documentSymbol', {'textDocument': {'uri': uri}})
            editor.replace(uri, whole, version + 1)
            self.assertEqual([one for one in editor.diagnostics(uri, version + 1) if one['severity'] == 1], [], name)
        self.assertEqual(editor.close(), 0)


if __name__ == '__main__':
    unittest.main()
