#!/usr/bin/env python3
"""morphbus lsp: what it offers to somebody who types, and to mend what is wrong."""
import json
import unittest

from lsp_client import Session
from support import morphbus


class Completion(Session):
    def type(self, uri, text):
        """Replaces the document by `text`; '|' says where the cursor is. Returns the labels there."""
        whole = text.replace('|', '', 1)
        self.editor.replace(uri, whole, 2)
        at = text.index('|')
        position = {'line': text[:at].count('\n'), 'character': at - (text.rfind('\n', 0, at) + 1)}
        return self.editor.ask('textDocument/completion', {'textDocument': {'uri': uri}, 'position': position})

    def labels_of(self, uri, text):
        return [item['label'] for item in self.type(uri, text)]

    def test_of_models(self):
        model = self.editor.texts[self.model]
        def labels(more):
            return self.labels_of(self.model, model + more)
        self.assertIn('module', self.labels_of(self.model, '|'))
        self.assertIn('hull', labels('module M: unit=1\nlink l: |'))
        self.assertEqual(labels('module M: unit=1\njoint j: type=|')[:4], ['revolute', 'continuous', 'prismatic', 'fixed'])
        self.assertIn('box', labels('module M: unit=1\nlink l: hull=|'))
        self.assertIn('size', labels('module M: unit=1\nlink l: hull=box(|'))
        self.assertIn('MTRAN', labels('robot r: modules=(|'))
        robot = 'robot r: modules=(MTRAN x, MTRAN y), '
        self.assertEqual(labels(robot + 'connections=((x.|')[:6], ['c1', 'c2', 'c3', 'c4', 'c5', 'c6'])
        self.assertEqual(labels(robot + 'connections=((|'), ['x', 'y'])
        self.assertEqual(labels(robot + 'joints=(x.|'), ['joint_1', 'joint_2'])
        self.assertIn('active_block', labels(robot + 'frame=(x.|'))
        # Which numbers join the two, as `connections` lists them.
        shown = json.loads(morphbus('connections', self.folder / 'mtran.m3l', '--pair', 'c2,c5', '--json').stdout)
        numbers = [str(one['number']) for one in shown['connections']]
        offered = labels(robot + 'connections=((x.c2, y.c5, |')
        self.assertEqual([label for label in numbers if label in offered], numbers)
        condition = 'connection C: members=(MTRAN a, MTRAN b), conditions=(a.point p coincident b.point q and p.|'
        self.assertIn('_1', labels(condition))
        self.assertIn('gender', labels(condition))
        self.assertIn('mtran_robots.m3l', self.labels_of(self.model, 'import "|"\n'))
        # A look may be a mesh of any kind; a hull is that of an STL.
        meshes = [f'block.{ending}' for ending in ('glb', 'obj', 'stl')]
        for name in (*meshes, 'block.png'):
            (self.folder / name).touch()
        self.assertEqual(sorted(labels('module M: unit=1\nlink l: visual=mesh("|')), meshes)
        self.assertEqual(labels('module M: unit=1\nlink l: hull=mesh("|'), ['block.stl'])

    def test_of_programs(self):
        def labels(text):
            return self.labels_of(self.program, text)
        self.assertIn('role', labels('|'))
        self.assertIn('require', labels('role R extends Module {\n  |\n}\n'))
        self.assertIn('Module', labels('role R extends |'))
        inside = 'const lift = 10;\nrole R extends Module {\n  speed = 60;\n  label knee = self.joints($UP_DOWN, 2);\n' \
                 '  function twice(x) { return 2.0 * x; }\n  command halt() { speed = 0; }\n  startup s() {\n    var angle = 1.0;\n    '
        end = '\n  }\n}\n'
        found = labels(inside + '|' + end)
        for label in ('if', 'angle', 'speed', 'knee', 'twice', 'lift', 'self', 'sin(degrees)', '$NORTH', 'R'):
            self.assertIn(label, found)
        behind_self = labels(inside + 'self.|' + end)
        for label in ('JOINT_1', 'C1', 'connected', 'jointSetDegrees(joint, degrees)'):
            self.assertIn(label, behind_self)
        self.assertIn('$LINK_CONNECTING_BAR', labels(inside + 'print($|' + end))
        self.assertEqual(labels(inside + 'R.|' + end), ['halt'])
        self.assertIn('SET_EXTENDED', labels(inside + 'self.C1.|' + end))
        self.assertIn('AXIS', labels(inside + 'knee.|' + end))
        self.assertEqual(labels(inside + 'print("a |b");' + end), [])

    def test_signatures(self):
        help_of = lambda uri, place: self.editor.ask('textDocument/signatureHelp', self.editor.at(uri, place))
        found = help_of(self.program, 'self.jointRotateDegrees(|')
        self.assertEqual(found['signatures'][0]['label'], 'self.jointRotateDegrees(joint, degrees)')
        self.assertEqual(found['activeParameter'], 0)
        docking = help_of(self.model, '(m3.c6, m5.c3, |3)')
        self.assertEqual(docking['activeParameter'], 2)
        self.editor.replace(self.model, 'module M: unit=1\nlink l: hull=box(size=(1, 1, 1), ', 2)
        box = help_of(self.model, 'hull=box(size=(1, 1, 1), |')
        self.assertEqual((box['signatures'][0]['label'], box['activeParameter']), ('box(size=, colour=, at=)', 1))
        self.editor.replace(self.program, 'role R extends Module { command go(float degrees, n) { print(n + 1); } startup s() { R.go(1.0, ', 2)
        command_help = help_of(self.program, 'R.go(1.0, |')
        self.assertEqual(command_help['signatures'][0]['label'], 'command go(degrees: float, n: int)')
        self.assertEqual(command_help['activeParameter'], 1)


class Fixes(Session):
    SLIPS = (
        ('mtran.m3l', 'grouping=(c1', 'groupng=(c1'), ('mtran.m3l', 'frame=(m5.passive_block', 'frame=(m5.pasive_block'),
        ('mtran.m3l', 'active_block, j1_ab_rot_axis', 'active_block, j1_ab_rot_axi'), ('mtran.m3l', 'type=revolute', 'type=revolut'),
        ('quadruped.dyn', 'self.jointRotateDegrees(', 'self.jointRotateDegree('),
        ('quadruped.dyn', '$LINK_CONNECTING_BAR', '$LINK_CONECTING_BAR'), ('quadruped.dyn', 'extends LegUpperHalf', 'extends LegUperHalf'),
    )

    def test_what_a_hint_proposes_mends_the_error(self):
        version = 1
        for name, good, bad in self.SLIPS:
            with self.subTest(bad):
                uri = self.model if name == 'mtran.m3l' else self.program
                whole = (self.folder / name).read_text()
                self.assertIn(good, whole)
                version += 1
                self.editor.replace(uri, whole.replace(good, bad, 1), version)
                self.assertNotEqual(self.editor.diagnostics(uri, version), [])
                actions = self.editor.ask('textDocument/codeAction', {
                    'textDocument': {'uri': uri}, 'range': self.editor.whole(uri), 'context': {'diagnostics': []}})
                self.assertNotEqual(actions, [])
                self.assertEqual(self.editor.apply(actions[0]['edit'])[uri], whole)
        self.editor.replace(self.model, (self.folder / 'mtran.m3l').read_text(), version + 1)
        self.assertEqual(self.editor.ask('textDocument/codeAction', {
            'textDocument': {'uri': self.model}, 'range': self.editor.whole(self.model), 'context': {'diagnostics': []}}), [])


if __name__ == '__main__':
    unittest.main()
