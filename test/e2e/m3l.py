#!/usr/bin/env python3
"""What the commands on models say where the answer is unusual: nothing computed, errors, odd bytes, odd options."""
import json
import math
import os
import re
import subprocess
import unittest

from support import LIMIT, SOURCE, Case, as_json, command, morphbus

MTRAN = SOURCE / 'models' / 'mtran.m3l'


def ring(modules):
    """A ring of M-TRAN modules, each bent a little, that closes at its start values."""
    names = [f'm{i}' for i in range(modules)]
    docked = ', '.join(f'({a}.c2, {b}.c5, rot=180)' for a, b in zip(names, names[1:] + names[:1]))
    bend = math.pi / modules
    joints = ', '.join(f'{m}.joint_1={bend!r}, {m}.joint_2={-bend!r}' for m in names)
    return (f'import "{MTRAN}"\nrobot ring: modules=({", ".join("MTRAN " + m for m in names)}),\n'
            f'connections=({docked}), joints=({joints})\n')


def blocks(document, language):
    """The blocks of a page that are fenced as `language`."""
    text = (SOURCE / 'docs' / document).read_text()
    fenced = re.findall(r'^```(\w*)\n(.*?)^```$', text, re.S | re.M)
    return [block for name, block in fenced if name == language]


class Docs(Case):
    """Output that the documentation shows is the program's; a line `...` stands for any number of lines."""

    def compare(self, shown, printed):
        at = 0
        lines = printed.splitlines()
        free = False
        for line in shown.splitlines():
            if line == '...':
                free = True
                continue
            if free:
                self.assertIn(line, lines[at:])
                at = lines.index(line, at)
            self.assertEqual(line, lines[at])
            at, free = at + 1, False
        self.assertTrue(free or at == len(lines), f'not shown: {lines[at:]}')

    def test_the_explanation_of_the_hinge_is_printed_so(self):
        (self.folder / 'hinge.m3l').write_text(blocks('m3l.md', 'm3l')[0])
        shown, = [b for b in blocks('m3l.md', '') if b.startswith('connection SNAP')]
        self.compare(shown, morphbus('connections', 'hinge.m3l', '--why', 'plug,socket', cwd=self.folder).stdout)

    def test_the_explanation_of_two_males_is_printed_so(self):
        shown, = [b for b in blocks('cli.md', '') if b.startswith('connection MTRAN')]
        self.compare(shown, morphbus('connections', 'models/mtran.m3l', '--why', 'c1,c2', cwd=SOURCE).stdout)

    def test_the_json_of_connections_has_the_name_that_the_page_shows(self):
        shown, = [b for b in blocks('cli.md', 'json') if b.startswith('{"connection":')]
        name = re.search(r'"connection":"(\w+)"', shown).group(1)
        self.assertEqual(as_json('connections', MTRAN)['connection'], name)


STATION = """
module TOWER: unit=0.1
point top: coords=(0,0,1), connector, normal=(0,0,1), grip=["open","shut","oiled","tight"], lid=[bool]
link foot: grouping=(top), mass=1
axis front: origin=(0,0,0), direction=(1,0,0)
module TOOL: unit=0.1
point base: coords=(0,0,0), connector, normal=(0,0,-1)
link body: grouping=(base), mass=0.2
axis front: origin=(0,0,0), direction=(1,0,0)
connection GRIP: members=(TOWER a, TOOL b), conditions=(
  a.point p coincident b.point q and p antiparallel q and a.front parallel b.front
  and (p.grip=="shut" and not p.lid or p.grip=="tight"))
"""


class States(Case):
    def test_connections_lists_every_setting_in_which_one_holds(self):
        (self.folder / 'station.m3l').write_text(STATION)
        listed, = as_json('connections', self.folder / 'station.m3l')['connections']
        self.assertEqual(listed['state'], {'a.top.grip': 'tight'})
        self.assertEqual(listed['other_states'], [{'a.top.grip': 'shut', 'a.top.lid': False}])
        line = morphbus('connections', self.folder / 'station.m3l').stdout.splitlines()[-1]
        self.assertIn('{"a.top.grip":"tight"} or {"a.top.grip":"shut","a.top.lid":false}', line)


class OddBytes(Case):
    def latin(self, name, text):
        path = self.folder / name
        path.write_bytes(text.encode('latin-1'))
        return path

    def test_bytes_that_are_not_utf8_are_errors_of_the_file(self):
        string = self.latin('string.m3l', 'module A:\npoint p: coords=(0,0,0), connector, kind="T\xfcr"\nlink l: grouping=(p)\n')
        comment = self.latin('comment.m3l', 'module A: // T\xfcr\nlink l: mass=1\n')
        program = self.latin('comment.dyn', '// T\xfcr\nrole A extends Module { }\n')
        for arguments in (('check', string), ('check', comment), ('format', comment), ('format', program),
                          ('connections', string, '--json'), ('graph', comment, '--json'),
                          ('compile', program, '--model', MTRAN, '-o', self.folder / 'x.image')):
            done = morphbus(*arguments, status=2)
            self.assertIn('byte \\xfc is not UTF-8', done.stderr)
            self.assertEqual(done.stdout, '')

    def test_file_names_with_such_bytes_are_no_crash(self):
        folder = os.fsencode(self.folder)
        path = os.path.join(folder, b'T\xfcr.m3l')
        with open(path, 'wb') as file:
            file.write(MTRAN.read_bytes())
        for arguments in (['connections', '--why', 'c1,c2', '--json'], ['graph', '--robot', 'quadruped', '--json'],
                          ['fk', '--robot', 'quadruped', '--json'], ['check']):
            done = subprocess.run([*command(*arguments), path], capture_output=True, timeout=LIMIT)
            self.assertEqual(done.returncode, 0, done.stderr)
            if '--json' in arguments:
                json.loads(done.stdout.decode())
        done = subprocess.run(command('connections', '--why', 'c1,c2', '--json') + [path], capture_output=True, timeout=LIMIT)
        self.assertTrue(json.loads(done.stdout.decode())['failures'][0]['file'].endswith('T\ufffdr.m3l'))


PLUGS = '''
module PLUG: // Two plugs, one socket.
point left: (point _1: coords=(0,1,0)) (point _2: coords=(0,0,1)) coords=(0,0,0), connector, kind="plug"
point right: (point _1: coords=(2,1,0)) (point _2: coords=(2,0,1)) coords=(2,0,0), connector, kind="socket"
link l: grouping=(left, right), mass=1
connection SNAP: members=(PLUG a, PLUG b), conditions=(a.point p coincident b.point q and p._1 coincident q._1
  and p._2 coincident q._2 and p.kind=="plug" and q.kind=="socket")
'''


class Explained(Case):
    def model(self, text):
        path = self.folder / 'model.m3l'
        path.write_text(text)
        return path

    def test_a_robot_that_cannot_be_connected_is_explained(self):
        robot = f'import "{MTRAN}"\nrobot r: modules=(MTRAN m1, MTRAN m2), connections=((m1.c1,m2.c2))\n'
        done = morphbus('connections', self.model(robot), '--why', 'c1,c2', status=2)
        self.assertIn('cannot be connected: c1 and c2 are both male', done.stderr)
        self.assertIn('hint: see: morphbus connections FILE --why c1,c2', done.stderr)
        self.assertRegex(done.stderr, r"mtran.m3l:\d+:\d+: note: by connection 'MTRAN_to_MTRAN'")
        self.assertIn('does not hold: c1.gender is "male"', done.stdout)
        answer = json.loads(morphbus('connections', self.model(robot), '--why', 'c1,c2', '--json', status=2).stdout)
        self.assertEqual(len(answer['failures']), 2)
        # Without --why an error is an error.
        self.assertEqual(morphbus('connections', self.model(robot), status=2).stdout, '')

    def test_a_connection_with_no_way_left_is_explained(self):
        path = self.model(PLUGS.replace('p._2 coincident q._2', 'p._2 coincident q._1'))
        done = morphbus('connections', path, '--why', 'left,right', status=2)
        self.assertIn("connection 'SNAP' leaves no way to join", done.stderr)
        self.assertIn('hint: see: morphbus connections FILE --why left,right', done.stderr)
        self.assertIn('0 of them kept', done.stdout)

    def test_a_motion_that_is_left_free_is_named(self):
        path = self.model(PLUGS.replace('and p._1 coincident q._1\n  and p._2 coincident q._2', ''))
        done = morphbus('connections', path, '--why', 'left,right', status=2)
        self.assertIn('is left free', done.stderr)
        self.assertIn('the conditions fix no motion: turning', done.stdout)
        answer = json.loads(morphbus('connections', path, '--why', 'left,right', '--json', status=2).stdout)
        self.assertIn('turning', answer['free'])

    def test_a_connection_of_broken_modules_is_not(self):
        path = self.model(PLUGS.replace('mass=1', 'mass=-1'))
        done = morphbus('connections', path, '--why', 'left,right', status=2)
        self.assertIn('SNAP has errors in its conditions or its modules', done.stderr)
        self.assertEqual(done.stdout, '')

    def test_a_connection_without_members_is_not(self):
        path = self.model('connection A:\n')
        for pair in (['--why', 'c1,c4'], ['--pair', 'c1,c4', '--why']):
            done = morphbus('connections', path, *pair, status=2)
            self.assertIn("connection 'A' has no 'members'", done.stderr)
            self.assertEqual(done.stdout, '')

    def test_a_connection_of_unknown_types_does_not_hide_the_others(self):
        path = self.model(PLUGS + 'connection LOST: members=(PLUG a, PLAG b), conditions=(a.point p coincident b.point q)\n')
        self.assertIn('1 of them kept', morphbus('connections', path, '--why', 'left,right', status=2).stdout)
        done = morphbus('connections', path, '--connection', 'LOST', '--why', 'left,right', status=2)
        self.assertIn("there is no module type 'PLAG'", done.stderr)
        self.assertIn("no connection 'LOST'; it has SNAP; connections with errors in their members are left out", done.stderr)


class PairOptions(Case):
    def said(self, *arguments):
        return morphbus('connections', *arguments, status=2).stderr

    def test_messages_name_the_option_and_the_slip(self):
        self.assertIn("--why: module MTRAN has no connector 'c77'", self.said(MTRAN, '--why', 'c77,c1'))
        self.assertIn("--pair: module MTRAN has no connector 'c77'", self.said(MTRAN, '--pair', 'c1,c77'))
        for text in ('c1,c2,c3', 'c1,', ',c1'):
            self.assertIn(f'--why {text}: expected two connectors', self.said(MTRAN, '--why', text))
            self.assertIn(f'--pair {text}: expected two connectors', self.said(MTRAN, '--pair', text))
        self.assertIn('write it once', self.said(MTRAN, '--pair', 'c1,c4', '--why', 'c1,c4'))
        self.assertIn("(did you mean 'quadruped'?)", morphbus('graph', MTRAN, '--robot', 'quadrupde', status=2).stderr)

    def test_white_space_round_names_does_not_matter(self):
        self.assertEqual(as_json('connections', MTRAN, '--pair', 'c6, c3')['count'], 4)

    def test_a_pair_that_cannot_be_mated_is_said_to_be_explained_elsewhere(self):
        text = morphbus('connections', MTRAN, '--pair', 'c4,c4').stdout
        self.assertIn('c4 of a and c4 of b cannot be mated; see: morphbus connections FILE --why c4,c4', text)
        self.assertEqual(as_json('connections', MTRAN, '--pair', 'c4,c4')['count'], 0)

    def test_settings_of_joints_have_suggestions(self):
        for wrong, right in (('m1.joint1=0', 'joint_1'), ('head_1.joint_1=0', None)):
            error = morphbus('fk', MTRAN, '--robot', 'quadruped', '--set', wrong, status=2).stderr
            self.assertIn(f"did you mean '{right}'?" if right else 'has no module', error)

    def test_the_pair_decides_among_connections(self):
        path = self.folder / 'two.m3l'
        path.write_text(f'import "{MTRAN}"\n' + PLUGS.replace('0,1,0', '0,2,0').replace('2,1,0', '2,2,0') +
                        'module ARM:\npoint tip: (point _1: coords=(0,2,0)) (point _2: coords=(0,0,1)) coords=(0,0,0), '
                        'connector\nlink l: grouping=(tip), mass=1\n'
                        'connection HOLD: members=(ARM a, PLUG b), conditions=(a.point p coincident b.point q\n'
                        '  and p._1 coincident q._1 and p._2 coincident q._2)\n')
        self.assertEqual(as_json('connections', path, '--pair', 'c6,c3')['connection'], 'MTRAN_to_MTRAN')
        self.assertEqual(as_json('connections', path, '--pair', 'tip,left')['connection'], 'HOLD')
        # The order of the two does not matter.
        for pair in ('tip,left', 'left,tip'):
            self.assertIn('connection HOLD, tip of a (ARM) on left of b (PLUG)',
                          morphbus('connections', path, '--why', pair).stdout)
        self.assertIn('choose one with --connection', self.said(path))
        self.assertIn("no module has a connector 'tpi' (did you mean 'tip'?)", self.said(path, '--why', 'tpi,c1'))


class Motion(Case):
    """check --motion: links of neighbouring modules that meet as their joints move."""
    # A flap on a hinge, 3 long and 0.4 thick, and a wall at x = 2: the flap's corner (0.2, 3) reaches it at some 38 degrees.
    GATE = """
module FLAP:
point foot: coords=(2,-.5,0), connector, normal=(1,0,0)
link base: grouping=(foot), hull=box(size=(3,1,1), at=(.5,-.5,0))
link flap: hull=box(size=(.4,2.8,1), at=(0,1.6,0))
axis out: origin=(0,0,0), direction=(0,0,1)
axis in: origin=(0,0,0), direction=(0,0,-1)
joint hinge: type=revolute, value=[-1,UPPER], pair=((flap,in),(base,out))
module WALL:
point foot: coords=(0,0,0), connector, normal=(-1,0,0)
link wall: grouping=(foot), hull=box(size=(1,5,1), at=(.5,2,0))
axis out: origin=(0,0,0), direction=(0,0,1)
connection HOLD: members=(FLAP a, WALL b), conditions=(
  a.point p coincident b.point q and p antiparallel q and a.out parallel b.out)
"""
    ROBOT = 'robot NAME: modules=(FLAP f, WALL w), connections=((f.foot,w.foot))\n'
    # 0.2 cos t + 3 sin t = 2.
    CONTACT = math.asin(2 / math.hypot(0.2, 3)) - math.atan2(0.2, 3)

    def gate(self, upper, robots=('gate',)):
        path = self.folder / 'gate.m3l'
        path.write_text(self.GATE.replace('UPPER', repr(upper)) + ''.join(self.ROBOT.replace('NAME', r) for r in robots))
        return path

    def test_links_that_meet_are_told_with_angles_and_depth(self):
        path = self.gate(math.pi / 3)
        done = morphbus('check', path, '--motion', status=1)
        self.assertEqual(done.stderr, '')
        said = re.search(r'motion of gate: links of neighbours meet; tried 1000 postures of each of 1 connection '
                         r'\(1 pair of links, seed 1\)\n'
                         r'  f\.flap and w\.wall in (\d+) of 1000 postures, up to ([\d.]+) m deep\n'
                         r'    deepest: f\.hinge=60deg\n'
                         r'    first:   f\.hinge=([\d.]+)deg \(([\d.]+) m\)\n$', done.stdout)
        self.assertTrue(said, done.stdout)
        # The flap's corner at the upper limit, behind the wall's face.
        self.assertAlmostEqual(float(said.group(2)), 0.2 * 0.5 + 3 * math.sqrt(0.75) - 2, delta=1e-9)
        self.assertGreater(math.radians(float(said.group(3))), self.CONTACT)
        # The posture is what `fk --set` takes.
        pose = as_json('fk', path, '--robot', 'gate', '--set', f'f.hinge={said.group(3)}deg')['links']['f.flap']
        self.assertAlmostEqual(2 * math.asin(abs(pose['q'][3])), math.radians(float(said.group(3))), delta=1e-9)

    def test_the_json_says_the_same(self):
        path = self.gate(math.pi / 3)
        answer = as_json('check', path, '--motion', status=1)
        self.assertEqual(list(answer), ['modules', 'connections', 'robots', 'motion'])
        motion = answer['motion']
        self.assertEqual((motion['seed'], motion['meet']), (1, True))
        robot, = motion['robots']
        meeting, = robot.pop('meetings')
        self.assertEqual(robot, {'name': 'gate', 'connections': 1, 'kinds': 1, 'link_pairs': 1, 'postures': 1000, 'loops': 0})
        self.assertEqual((meeting['modules'], meeting['links']), (['f', 'w'], ['flap', 'wall']))
        self.assertEqual(meeting['deepest']['joints'], {'f.hinge': math.pi / 3})
        self.assertAlmostEqual(meeting['deepest']['depth_m'], 0.2 * 0.5 + 3 * math.sqrt(0.75) - 2, delta=1e-9)
        # The upper limit is the first posture beyond the contact, too.
        self.assertEqual(meeting['first'], meeting['deepest'])
        self.assertIn(f'in {meeting["postures"]} of 1000 postures', morphbus('check', path, '--motion', status=1).stdout)

    def test_links_that_cannot_meet_are_said_not_to(self):
        path = self.gate(self.CONTACT - 1e-3)
        self.assertIn('motion of gate: no links of neighbours meet; tried 25 postures',
                      morphbus('check', path, '--motion', '--postures', 25).stdout)
        motion = as_json('check', path, '--motion', '--postures', 25)['motion']
        self.assertFalse(motion['meet'])
        self.assertEqual((motion['robots'][0]['postures'], motion['robots'][0]['meetings']), (25, []))
        # Without --motion nothing is tried, whatever there is to find.
        self.assertNotIn('motion of gate', morphbus('check', self.gate(1.5)).stdout)

    def test_a_seed_gives_the_same_postures(self):
        path = self.gate(math.pi / 3)

        def meetings(*options):
            answer = as_json('check', path, '--motion', *options, status=1)['motion']
            return answer['robots'][0]['meetings']
        self.assertEqual(meetings(), meetings('--seed', 1))
        self.assertEqual(meetings('--seed', 7), meetings('--seed', 7))
        self.assertNotEqual(meetings('--seed', 7), meetings('--seed', 8))

    def test_one_robot_or_all(self):
        path = self.gate(math.pi / 3, robots=('gate', 'other'))
        names = [r['name'] for r in as_json('check', path, '--motion', status=1)['motion']['robots']]
        self.assertEqual(names, ['gate', 'other'])
        names = [r['name'] for r in as_json('check', path, '--motion', '--robot', 'other', status=1)['motion']['robots']]
        self.assertEqual(names, ['other'])

    def test_options_that_cannot_be_used(self):
        path = self.gate(1.0)
        for options, said in ((('--motion', '--robot', 'gaet'), "did you mean 'gate'?"),
                              (('--motion', '--postures', 0), '--postures'), (('--motion', '--seed', -1), '--seed'),
                              (('--postures', 5), '--postures goes with --motion'), (('--seed', 5), '--seed goes with --motion'),
                              (('--robot', 'gate'), '--robot goes with --motion'),
                              (('--motion', '--dump', 'ast'), '--dump')):
            done = morphbus('check', path, *options, status=2)
            self.assertIn(said, done.stderr)
            self.assertEqual(done.stdout, '')
        # A robot without neighbours is no mistake.
        alone = self.gate(1.0, robots=())
        alone.write_text(alone.read_text() + 'robot alone: modules=(FLAP f)\n')
        self.assertIn('motion of alone: nothing to compare', morphbus('check', alone, '--motion').stdout)
        bare = self.gate(1.0, robots=())
        self.assertIn('the model has no robot', morphbus('check', bare, '--motion', status=2).stderr)

    def test_the_manual_shows_what_is_printed(self):
        shown, = [b for b in blocks('cli.md', '') if '\nmotion of ' in b]
        typed, shown = shown.split('\n', 1)
        arguments = typed.removeprefix('$ morphbus ').split()
        printed = morphbus(*arguments, cwd=SOURCE, status=1).stdout
        Docs.compare(self, shown, printed)
        shown, = [json.loads(b.replace('…', '0')) for b in blocks('cli.md', 'json') if '"motion"' in b]
        answer = as_json(*arguments, cwd=SOURCE, status=1)
        meeting = answer['motion']['robots'][0]['meetings'][0]
        shown_meeting, = shown['motion']['robots'][0]['meetings']
        self.assertEqual(list(answer), ['modules', 'connections', 'robots', 'motion'])
        self.assertEqual(list(shown['motion']), list(answer['motion']))
        self.assertEqual(list(shown['motion']['robots'][0]), list(answer['motion']['robots'][0]))
        for key in ('modules', 'links', 'postures'):
            self.assertEqual(shown_meeting[key], meeting[key])
        self.assertEqual(list(shown_meeting['deepest']['joints']), list(meeting['deepest']['joints']))

    def test_links_that_joints_of_loops_would_bring_together_are_marked(self):
        text = morphbus('check', MTRAN, '--motion', '--robot', 'quadruped', '--postures', 20).stdout
        self.assertIn('closed loops do not allow each of these postures', text)
        self.assertIn('2 joints that loops lock stayed at the start', text)


class NotComputed(Case):
    def test_the_mobility_of_a_large_ring_is_not_claimed(self):
        path = self.folder / 'ring.m3l'
        path.write_text(ring(260))
        text = morphbus('check', path).stdout
        self.assertIn('mobility not computed (over 500 joints in one system of loops)', text)
        self.assertNotRegex(text, r'robot ring.*mobility \d')
        self.assertIn('mobility not computed', morphbus('graph', path, '--robot', 'ring').stdout)
        answer = as_json('graph', path, '--robot', 'ring')
        self.assertIsNone(answer['mobility'])
        self.assertEqual({joint['locked'] for joint in answer['joints']}, {None})

    def test_a_ring_that_is_small_enough_is_computed(self):
        path = self.folder / 'ring.m3l'
        path.write_text(ring(20))
        # 40 parallel joints: a planar loop leaves all but three.
        self.assertEqual(as_json('graph', path, '--robot', 'ring')['mobility'], 37)

    def test_lists_of_adjacent_axes_that_are_too_long_are_not_listed(self):
        # 1500 joints on one body: over two million pairs.
        sides = ''.join(f'link l{i}: mass=1\naxis a{i}: origin=(0,0,0), direction=(0,0,1)\n'
                        f'axis b{i}: origin=(0,0,0), direction=(0,0,-1)\n'
                        f'joint j{i}: type=continuous, pair=((l{i},a{i}),(hub,b{i}))\n' for i in range(99))
        path = self.folder / 'hub.m3l'
        path.write_text(
            'module STAR:\npoint c: coords=(0,0,0), connector, side=1, normal=(0,0,1)\n'
            'point d: coords=(0,0,0), connector, side=2, normal=(0,0,1)\n'
            'axis x: origin=(0,0,0), direction=(1,0,0)\n'
            f'link hub: grouping=(c,d), mass=1\n{sides}'
            'connection C: members=(STAR a, STAR b), conditions=(a.point p coincident b.point q and p parallel q\n'
            'and a.x parallel b.x and p.side==1 and q.side==2)\n'
            f'robot star: modules=({", ".join(f"STAR m{i}" for i in range(16))}),\n'
            f'connections=({", ".join(f"(m{i}.c,m{i + 1}.d)" for i in range(15))})\n')
        answer = as_json('graph', path, '--robot', 'star')
        self.assertEqual(len(answer['joints']), 16 * 99)
        self.assertEqual({joint['adjacent'] for joint in answer['joints']}, {16 * 99 - 1})
        self.assertEqual({joint['adjacent_axes'] for joint in answer['joints']}, {None})
        self.assertIn('not listed (over 2000000 pairs)', morphbus('graph', path, '--robot', 'star').stdout)


if __name__ == '__main__':
    unittest.main()
