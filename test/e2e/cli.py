#!/usr/bin/env python3
"""The command line as docs/cli.md writes it: forms of the JSON, known answers, exit statuses."""
import json
import math
import pathlib
import re
import subprocess
import unittest

from support import LIMIT, MODEL, PROGRAM, SOURCE, UNIT, Case, as_json, command, morphbus


class Cli(Case):
    def test_connections_are_the_papers(self):
        answer = as_json('connections', MODEL)
        self.assertEqual(list(answer), ['connection', 'candidates', 'count', 'connections'])
        self.assertEqual((answer['candidates'], answer['count'], len(answer['connections'])), (144, 72, 72))
        self.assertEqual([c['number'] for c in answer['connections']], list(range(1, 73)))
        first = answer['connections'][0]
        self.assertEqual(list(first), ['number', 'a', 'b', 'pose', 'state'])
        self.assertEqual((first['a'], first['b']), ('c6', 'c3'))
        self.assertEqual(first['state'], {'b.c3.extended': True})

    def test_a_pair_of_connectors_has_four_connections(self):
        for pair, numbers in (('c6,c3', [1, 2, 3, 4]), ('c5,c2', [17, 18, 19, 20]), ('c2,c5', [53, 54, 55, 56])):
            listed = as_json('connections', MODEL, '--pair', pair)['connections']
            self.assertEqual([c['number'] for c in listed], numbers)
        morphbus('connections', MODEL, '--pair', 'c1,c77', status=2)

    def test_a_pair_is_found_in_either_order(self):
        model = MODEL.parent / 'mixed.m3l'
        ways = [as_json('connections', model, '--connection', 'MTRAN_to_TELESCOPE', '--pair', pair)
                for pair in ('c2,head', 'head,c2')]
        self.assertGreater(ways[0]['count'], 0)
        self.assertEqual(ways[0], ways[1])

    def test_the_reference_has_every_command(self):
        # test/docs/links_test.py compares its contents with its headings.
        listed = morphbus('--help').stdout.split('\nSubcommands:\n')[1].split('\n\n')[0]
        there = {line.split()[0] for line in listed.splitlines()}
        headings = re.findall(r'^### (.*)$', (SOURCE / 'docs' / 'cli.md').read_text(encoding='utf-8'), re.M)
        self.assertEqual({name for heading in headings for name in re.findall(r'`(\w+)', heading)}, there)

    def test_an_option_is_meant_by_some_of_its_letters(self):
        done = morphbus('run', MODEL, 'x.dyn', '--robot', 'quadruped', '--secs', 3, status=2)
        self.assertIn("there is no option '--secs' (did you mean '--seconds'?)", done.stderr)

    def test_a_program_for_a_model_is_one_error(self):
        robot = ('--robot', 'quadruped')
        for words in (('run', PROGRAM, MODEL, *robot, '--seconds', 1), ('roles', PROGRAM, MODEL, *robot), ('check', PROGRAM)):
            done = morphbus(*words, status=2)
            self.assertEqual(re.findall('error: (.*)', done.stderr), ['this is a DynaRole program, not a model'])

    def test_a_model_for_a_program_is_one_error(self):
        for words in (('roles', MODEL, MODEL, '--robot', 'quadruped'), ('compile', MODEL, '--model', MODEL, '-o', 'x.img')):
            done = morphbus(*words, status=2, cwd=self.folder)
            self.assertEqual(re.findall('error: (.*)', done.stderr), ['this is an M3L model, not a program'])

    def test_times_may_have_their_unit(self):
        robot = ('run', MODEL, PROGRAM, '--robot', 'quadruped', '--inproc', '--no-log', '--json')
        hashes = {json.loads(morphbus(*robot, '--seconds', text, '--lose', f'm3@{lost}', status=1).stdout)['hash']
                  for text, lost in (('0.2', '0.1'), ('0.2s', '0.1s'), ('200ms', '100ms'))}
        self.assertEqual(len(hashes), 1)
        done = morphbus(*robot, '--seconds', '2 sec', status=2)
        self.assertIn("--seconds: expected seconds, such as 2.5, 2.5s or 200ms, not '2 sec'", done.stderr)

    def test_what_is_no_number_is_told_what_was_expected(self):
        for option, text, expected in (('--friction', 'x', 'a number'), ('--repeat', '2.5', 'a whole number below 2^31'),
                                       ('--repeat', '99999999999', 'a whole number below 2^31'), ('--processes', 'x', 'a whole number below 2^31'),
                                       ('--random-seed', '-1', 'a whole number, 0 or more and below 2^64')):
            done = morphbus('run', MODEL, PROGRAM, f'{option}={text}', status=2)
            self.assertIn(f"{option}: expected {expected}, not '{text}' (see morphbus run --help)", done.stderr)

    def test_raw_joint_values_may_have_their_unit(self):
        links = [as_json('fk', MODEL, '--robot', 'quadruped', '--set', f'm1.joint_1={value}')['links']
                 for value in ('0.5', '0.5rad')]
        self.assertEqual(links[0], links[1])

    def test_fractions_may_be_percentages(self):
        robot = ('run', MODEL, PROGRAM, '--robot', 'quadruped', '--inproc', '--no-log', '--json', '--seconds', 0.2)
        lost = [json.loads(morphbus(*robot, '--loss', loss, status=1).stdout)['lost'] for loss in ('0.2', '20%')]
        self.assertGreater(lost[0], 0)
        self.assertEqual(lost[0], lost[1])
        # A bare 20 may be meant as either.
        done = morphbus(*robot, '--loss', 20, status=2)
        self.assertIn("--loss: expected a fraction, 0 to 1, such as 0.2 or 20%, not '20'", done.stderr)

    def test_angles_that_a_program_is_told_are_in_degrees(self):
        program = self.folder / 'turn.dyn'
        program.write_text(PROGRAM.read_text().replace(
            'behavior gait() {', 'command turn(float angle) { print("turn", angle); }\n\n  behavior gait() {', 1))
        script = self.folder / 'script'
        script.write_text('100 invoke Junction.turn 30deg\n110 invoke Junction.turn 0.5235987755982988rad\n120 invoke Junction.turn 30\n')
        log = self.folder / 'turn.log'
        morphbus('run', MODEL, program, '--robot', 'quadruped', '--seconds', 3, '--inproc', '--commands', script, '--log', log)
        self.assertEqual([line['text'] for line in as_json('info', log)['prints']], ['turn 30'] * 3)

    def test_angles_and_times_have_their_units_everywhere(self):
        # What is wrong with the options is said before what is wrong with the logs, which are not there.
        for name, good, bad in (('angle_rad', '0.5deg', '100ms'), ('cycle_s', '100ms', '5deg'), ('duty', '5%', '5s'),
                                ('velocity_rad_s', '0.1', '0.1s')):
            said = morphbus('compare', 'a', 'b', '--tolerance', f'{name}={good}', status=2).stderr
            self.assertNotIn('--tolerance', said)
            said = morphbus('compare', 'a', 'b', '--tolerance', f'{name}={bad}', status=2).stderr
            self.assertIn(f'--tolerance {name}={bad}: expected', said)
        robot = ('run', MODEL, PROGRAM, '--robot', 'quadruped', '--inproc', '--no-log', '--json', '--seconds', 0.2, '--root-sensor')
        hashes = {json.loads(morphbus(*robot, '--root-noise', noise, status=1).stdout)['hash']
                  for noise in ('0.002,0.017453292519943295', '0.002,1deg')}
        self.assertEqual(len(hashes), 1)
        self.assertIn('--give-up: expected 1 to', morphbus('sim', '--give-up', '500ms', status=2).stderr)

    def test_a_log_cannot_go_to_the_output(self):
        done = morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 0.1, '--inproc', '--log', '-',
                        status=2, cwd=self.folder)
        self.assertIn('a log is a file, which is read again when the run ends: give it a name', done.stderr)
        self.assertEqual(list(self.folder.glob('-*')), [])

    def test_check_tells_of_what_it_does_not_look_at(self):
        self.assertIn('morphbus check --motion', morphbus('check', MODEL).stdout)

    def test_fk_places_modules_where_the_paper_does(self):
        answer = as_json('fk', MODEL, '--robot', 'quadruped')
        self.assertEqual(list(answer), ['robot', 'links', 'closure_m', 'closure_rad'])
        self.assertEqual(len(answer['links']), 27)
        for link in ('active_block', 'passive_block', 'connecting_bar'):
            p = answer['links'][f'm1.{link}']['p']
            for got, want in zip(p, (5 * UNIT, 0, -2 * UNIT)):
                self.assertAlmostEqual(got, want, delta=1e-9)
        self.assertLess(answer['closure_m'], 1e-9)

    def test_fk_takes_raw_joint_values(self):
        links = as_json('fk', MODEL, '--robot', 'quadruped', '--set', 'm1.joint_2=0.3')['links']
        degrees = as_json('fk', MODEL, '--robot', 'quadruped', '--set', f'm1.joint_2={math.degrees(0.3)!r}deg')['links']
        self.assertAlmostEqual(abs(links['m1.passive_block']['q'][0]), math.cos(0.15), delta=1e-9)
        for name, pose in links.items():
            for a, b in zip(pose['p'] + pose['q'], degrees[name]['p'] + degrees[name]['q']):
                self.assertAlmostEqual(a, b, delta=1e-12)
        slide = MODEL.parent / 'mixed.m3l'
        morphbus('fk', slide, '--robot', 'inchworm', '--set', 'body.slide=0.01')
        said = morphbus('fk', slide, '--robot', 'inchworm', '--set', 'body.slide=45deg', status=2).stderr
        self.assertIn('metres', said)
        for bad in ('m1.joint_1=1e300', 'm1.joint_2', 'm99.joint_1=0', 'm1.joint_9=0', 'm1.joint_1=x', 'm1.joint_1=nan'):
            morphbus('fk', MODEL, '--robot', 'quadruped', '--set', bad, status=2)

    def test_fk_tells_how_fast_a_link_moves(self):
        pose = lambda value: as_json('fk', MODEL, '--robot', 'quadruped', '--set', f'm1.joint_1={value}')['links']['m1.active_block']['p']
        jacobian = as_json('fk', MODEL, '--robot', 'quadruped', '--set', 'm1.joint_1=0.3', '--jacobian', 'm1.active_block')['jacobian']
        self.assertEqual(jacobian['link'], 'm1.active_block')
        self.assertEqual(len(jacobian['joints']), 18)
        for got, before, after in zip(jacobian['joints']['m1.joint_1'], pose(0.3), pose(0.300001)):
            self.assertAlmostEqual(got, (after - before) / 1e-6, delta=1e-4)
        # A joint of another leg does not move it.
        self.assertEqual(jacobian['joints']['m3.joint_1'], [0] * 6)
        said = morphbus('fk', MODEL, '--robot', 'quadruped', '--jacobian', 'm1.active_block').stdout
        self.assertIn('angular velocity (rad/s)', said)
        for bad, why in (('m1', 'expected module.link'), ('m99.x', "no module 'm99'"), ('m1.active_blok', "did you mean 'active_block'")):
            self.assertIn(why, morphbus('fk', MODEL, '--robot', 'quadruped', '--jacobian', bad, status=2).stderr)

    def test_the_graph_is_that_of_the_paper(self):
        answer = as_json('graph', MODEL, '--robot', 'quadruped')
        self.assertEqual(list(answer), ['bodies', 'joints', 'mobility', 'congruence_hash'])
        hashes = {robot: as_json('graph', SOURCE / 'models' / model, '--robot', robot)['congruence_hash']
                  for model, robot in (('mtran.m3l', 'equivalent_quadruped'), ('ckbot.m3l', 'loop'))}
        self.assertEqual(hashes['equivalent_quadruped'], answer['congruence_hash'])
        self.assertNotEqual(hashes['loop'], answer['congruence_hash'])
        self.assertEqual(answer['mobility'], 16)
        joints = {j['name']: j for j in answer['joints']}
        self.assertEqual(sorted(n for n, j in joints.items() if j['locked']), ['m5.joint_1', 'm5.joint_2'])
        self.assertEqual(max(b['degree'] for b in answer['bodies']), 6)
        dot = morphbus('graph', MODEL, '--robot', 'quadruped', '--dot', '-').stdout
        self.assertTrue(dot.startswith(('graph', 'digraph')))

    def test_the_quadrupeds_are_congruent_in_four_ways(self):
        answer = as_json('equivalent', MODEL, 'quadruped', 'equivalent_quadruped')
        self.assertEqual(list(answer)[:4], ['congruent', 'mappings', 'modules', 'joints'])
        self.assertEqual((answer['congruent'], answer['mappings']), (True, 4))
        self.assertEqual(answer['modules'], dict(zip((f'm{i}' for i in range(1, 10)),
                                                     ('m6', 'm7', 'm8', 'm9', 'm5', 'm1', 'm2', 'm3', 'm4'))))
        self.assertEqual(answer['joints']['m1.joint_1'], {'to': 'm6.joint_1', 'sign': -1, 'offset': 0})
        self.assertEqual({name for name, joint in answer['joints'].items() if joint['sign'] < 0},
                         {'m1.joint_1', 'm1.joint_2', 'm9.joint_1', 'm9.joint_2'})
        self.assertIn('4 ways', morphbus('equivalent', MODEL, 'quadruped', 'quadruped').stdout)

    def test_a_changed_quadruped_is_not_congruent_and_the_reason_is_said(self):
        text = MODEL.read_text()
        robot = text[text.index('robot quadruped:'):text.index('// The sides are swapped')]
        changed = robot.replace('robot quadruped:', 'robot changed:').replace('(m1.c2, m2.c5)', '(m1.c2, m2.c5, rot=90)')
        longer = robot.replace('robot quadruped:', 'robot longer:').replace('MTRAN m1,', 'MTRAN m1, MTRAN m10,') \
            .replace('(m1.c2, m2.c5)', '(m1.c2, m2.c5), (m10.c2, m1.c5)')
        module = text[text.index('module MTRAN:'):text.index('// Centres meet')]
        short = module.replace('module MTRAN:', 'module SHORT:').replace('value=[-pi/2, pi/2]', 'value=[-pi/4, pi/4]')
        other = text[text.index('connection MTRAN_to_MTRAN'):text.index('// m5 is the junction')] \
            .replace('MTRAN_to_MTRAN', 'SHORT_to_MTRAN').replace('(MTRAN a', '(SHORT a')
        short += other + robot.replace('robot quadruped:', 'robot stiff:').replace('MTRAN m1,', 'SHORT m1,')
        model = self.folder / 'changed.m3l'
        model.write_text('\n'.join([text, changed, longer, short]))
        for robot, reason in (('changed', r'm1\.joint_\d.* off by 90 degrees'), ('longer', '10 modules'),
                              ('stiff', r'joint m1\.joint_1 of stiff turns from -45 to 45 degrees')):
            answer = as_json('equivalent', model, 'quadruped', robot, status=1)
            self.assertEqual((answer['congruent'], answer['mappings']), (False, 0))
            self.assertRegex(answer['reason'], reason)
        morphbus('equivalent', model, 'quadruped', 'nobody', status=2)

    def test_equivalent_says_what_the_figures_are(self):
        said = morphbus('equivalent', MODEL, 'quadruped', 'equivalent_quadruped').stdout
        self.assertRegex(said, r'm1\.joint_1 +m6\.joint_1 +- +0 rad\n')
        self.assertRegex(said, r'm5\.joint_1 +m5\.joint_1 +\+ +0 rad  locked\n')
        self.assertIn('Of 4 ways, masses are alike in 4, hulls in 4.', said)
        answer = as_json('equivalent', MODEL, 'quadruped', 'quadruped')
        self.assertEqual((answer['looked_at'], answer['masses_equal_in'], answer['locked_computed']), (4, 4, True))
        self.assertNotIn('mappings_complete', answer)
        mixed = MODEL.parent / 'mixed.m3l'
        self.assertRegex(morphbus('equivalent', mixed, 'inchworm', 'inchworm').stdout, r'slide .* [+-] +\S+ m\n')

    def test_equivalent_says_whether_a_program_binds_the_same_on_both(self):
        quadruped = PROGRAM.parent / 'quadruped.dyn'
        said = morphbus('equivalent', MODEL, 'quadruped', 'equivalent_quadruped', '--program', quadruped).stdout
        self.assertTrue(said.endswith(f'\n{quadruped} binds the same roles and labels on both.\n'), said)
        answer = as_json('equivalent', MODEL, 'quadruped', 'equivalent_quadruped', '--program', quadruped)
        self.assertEqual((answer['program']['bound_alike'], answer['program']['differences']), (True, []))
        self.assertEqual(answer['program']['modules'], answer['modules'])
        # In this variant some modules are turned round, so that a joint's number no longer says which joint it is.
        variants = self.folder / 'variants.m3l'
        morphbus('variants', MODEL, '--robot', 'quadruped', '--max', 3, '--seed', 1, '-o', variants)
        by_number = self.folder / 'by_number.dyn'
        by_number.write_text(quadruped.read_text().replace('label upper_joint = self.joints($ANY, 6);', 'label upper_joint = self.JOINT_1;'))
        said = morphbus('equivalent', variants, 'quadruped', 'quadruped_variant_2', '--program', by_number, status=1).stdout
        self.assertIn(f'{by_number} does not bind the same roles and labels on both:\n'
                      '  m2 and m2, FrontLeftUpperHalf: label upper_joint is joint_1 here and joint_1 there, not m2.joint_2\n', said)
        answer = as_json('equivalent', variants, 'quadruped', 'quadruped_variant_2', '--program', by_number, status=1)
        self.assertEqual((answer['congruent'], answer['program']['bound_alike']), (True, False))
        self.assertEqual(sum('label upper_joint' in said for said in answer['program']['differences']), 4)
        # A convention for a joint by its number turns another one there; one that its connectors decide turns it the other way.
        for convention, difference in (
                ('self.setJointAxis(self.JOINT_1, bar, $EAST_WEST);',
                 'of joint_1 and its counterpart joint_2 only one has a convention (setJointAxis)'),
                ('if (self.C2.CONNECTED) self.setJointAxis(ankle, bar, $EAST_WEST);'
                 ' else self.setJointAxis(ankle, foot, $EAST_WEST);', 'joint_1 and its counterpart joint_2 turn opposite ways')):
            program = self.folder / 'convention.dyn'
            program.write_text('role Only extends Module { require self.connected($NORTH) >= 1; label ankle = self.joints($ANY, 1);'
                               ' label foot = self.links(1); label bar = $LINK_CONNECTING_BAR; startup s() { ' + convention + ' } }')
            said = morphbus('equivalent', variants, 'quadruped', 'quadruped_variant_2', '--program', program, status=1).stdout
            self.assertIn(f'Only: {difference}\n', said)
        # And here it is a module's role that its connectors decide.
        by_connector = self.folder / 'by_connector.dyn'
        by_connector.write_text('role Only extends Module { require self.connected($NORTH) >= 1 && self.C2.CONNECTED; }')
        said = morphbus('equivalent', variants, 'quadruped', 'quadruped_variant_2', '--program', by_connector, status=1).stdout
        self.assertIn('  m4 plays no role, its counterpart m4 plays Only\n', said)
        morphbus('equivalent', MODEL, 'quadruped', 'equivalent_quadruped', '--program', self.folder / 'nothing.dyn', status=2)

    def test_equivalent_marks_a_count_that_is_not_complete(self):
        # Each car can be joined in several ways, its wheels turned in more: together over 2^53 ways.
        names = [f'{part}{car}' for car in range(30) for part in ('b', 'f', 'r', 'w', 'x', 'y', 'z')]
        joints = []
        for car in range(30):
            joints += [f'(b{car}.c3, f{car}.c0)', f'(b{car}.c7, r{car}.c0)', f'(f{car}.c5, w{car}.c0)',
                       f'(f{car}.c7, x{car}.c0)', f'(r{car}.c5, y{car}.c0)', f'(r{car}.c7, z{car}.c0)']
            joints += [f'(b{car - 1}.c1, b{car}.c4)'] if car else []
        model = self.folder / 'train.m3l'
        model.write_text(f'import "{MODEL.parent / "atron.m3l"}"\nrobot train: '
                         f'modules=({", ".join("ATRON " + n for n in names)}), connections=({", ".join(joints)})\n')
        answer = as_json('equivalent', model, 'train', 'train')
        self.assertEqual((answer['mappings'], answer['mappings_complete']), (1000, False))
        self.assertIn('in over 1,000 ways.', morphbus('equivalent', model, 'train', 'train').stdout)

    def test_variants_are_m3l_that_other_commands_take(self):
        variants = self.folder / 'variants.m3l'
        morphbus('variants', MODEL, '--robot', 'quadruped', '--max', 3, '--seed', 1, '-o', variants)
        again = self.folder / 'again.m3l'
        morphbus('variants', MODEL, '--robot', 'quadruped', '--max', 3, '--seed', 1, '-o', again)
        self.assertEqual(variants.read_text(), again.read_text())
        for i in (1, 2, 3):
            answer = as_json('equivalent', variants, 'quadruped', f'quadruped_variant_{i}')
            self.assertEqual((answer['mappings'], answer['keeps_frame']), (4, True))
            self.assertEqual(answer['modules']['m1'], 'm1')
        self.assertEqual(morphbus('variants', MODEL, '--robot', 'quadruped', '--max', 1).stdout.count('robot '), 1)
        morphbus('variants', MODEL, status=2)

    def test_variants_spare_the_files_and_names_there_are(self):
        model = self.folder / 'model.m3l'
        model.write_bytes(MODEL.read_bytes())
        user = self.folder / 'user.m3l'
        user.write_text('import "model.m3l"\n')
        for output in (model, user, self.folder / '.' / 'model.m3l'):
            said = morphbus('variants', user, '--robot', 'quadruped', '--max', 1, '-o', output, status=2).stderr
            self.assertIn('this command reads that file; name another', said)
        self.assertEqual(model.read_bytes(), MODEL.read_bytes())
        first = self.folder / 'first.m3l'
        morphbus('variants', user, '--robot', 'quadruped', '--max', 2, '-o', first)
        text = morphbus('variants', first, '--robot', 'quadruped', '--max', 1).stdout
        self.assertIn('robot quadruped_variant_3:', text)
        self.assertNotIn('robot quadruped_variant_1:', text)
        morphbus('format', '--check', first)
        heavy = self.folder / 'heavy.m3l'
        heavy.write_text(MODEL.read_text().replace('mass=0.18', 'mass=0.36', 1))
        done = morphbus('variants', heavy, '--robot', 'quadruped', '--max', 10, '--seed', 1)
        self.assertRegex(done.stdout, r'// Does not run quite as quadruped: the centres of mass of .* m apart\.\nrobot quadruped_variant_')
        self.assertIn('will not run alike', done.stderr)
        for seed in ('-1', '18446744073709551616', '1.5'):
            said = morphbus('variants', MODEL, '--robot', 'quadruped', f'--seed={seed}', status=2).stderr
            self.assertIn('expected a whole number, 0 or more', said)
            said = morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--inproc', f'--seed={seed}', status=2).stderr
            self.assertIn('expected a whole number, 0 or more', said)

    def test_roles_settle_without_moving(self):
        answer = as_json('roles', MODEL, PROGRAM, '--robot', 'quadruped')
        self.assertEqual(list(answer), ['modules', 'problems', 'unplayed', 'id_lines', 'id_places'])
        self.assertEqual(answer['modules']['m5']['role'], 'Junction')
        m1 = answer['modules']['m1']
        self.assertEqual(m1['role'], 'FrontLeftLowerHalf')
        self.assertEqual(sorted(m1['labels']), ['ankle', 'bar', 'foot', 'knee'])
        self.assertEqual(answer['problems'], [])

    def test_signs_differ_only_where_the_modules_are_turned(self):
        by_role = []
        for robot in ('quadruped', 'equivalent_quadruped'):
            modules = as_json('roles', MODEL, PROGRAM, '--robot', robot)['modules']
            by_role.append({m['role']: m['signs'] for m in modules.values()})
        different = {(role, label) for role, signs in by_role[0].items() for label in signs
                     if signs[label] != by_role[1][role][label]}
        self.assertEqual(different, {(role, label) for role in ('FrontLeftLowerHalf', 'BackRightLowerHalf')
                                     for label in ('knee', 'ankle')})

    def test_a_program_compiles_alike_from_model_and_from_xml(self):
        xml = self.folder / 'mtran.xml'
        morphbus('export', MODEL, '--module', 'MTRAN', '--to', 'xml', '-o', xml)
        morphbus('compile', PROGRAM, '--keywords', xml, '-o', self.folder / 'a')
        answer = as_json('compile', PROGRAM, '--model', MODEL, '-o', self.folder / 'b')
        image = (self.folder / 'b').read_bytes()
        self.assertEqual((answer['output'], answer['bytes']), (str(self.folder / 'b'), len(image)))
        self.assertRegex(answer['hash'], '^[0-9a-f]{16}$')
        self.assertEqual(answer['large_profile'], [])
        large = self.folder / 'large.dyn'
        large.write_text('role R extends Module {\n  kept n = 1;\n  trace n;\n  startup s() {\n    n += 1;\n    print(self.place($UP_DOWN), exp(self.time), int(self.time));\n  }\n}\n')
        self.assertEqual(as_json('compile', large, '--model', MODEL, '-o', self.folder / 'c')['large_profile'],
                         ['exp', 'place', 'kept fields', 'traced fields'])
        self.assertIn('not for the small profile of microcontrollers: exp, place, kept fields, traced fields\n',
                      morphbus('compile', large, '--model', MODEL, '-o', self.folder / 'c', '--force').stdout)
        morphbus('compile', PROGRAM, '--model', MODEL, '-o', '-', '--json', status=2)
        self.assertEqual((self.folder / 'a').read_bytes(), (self.folder / 'b').read_bytes())
        self.assertIn('Junction', morphbus('disasm', self.folder / 'a').stdout)

    def test_back_ends_write_their_files(self):
        for target, of in (('model', ()), ('kinematics', ('--module', 'MTRAN')), ('xml', ('--module', 'MTRAN')),
                           ('dot', ('--robot', 'quadruped'))):
            path = self.folder / target
            morphbus('export', MODEL, *of, '--to', target, '-o', path)
            self.assertGreater(path.stat().st_size, 100)
        morphbus('export', MODEL, '--module', 'MTRAN', '--to', 'nonsense', '-o', self.folder / 'x', status=2)

    def test_a_model_is_drawn_in_both_formats(self):
        for name, start in (('x.svg', b'<'), ('x.png', b'\x89PNG')):
            morphbus('draw', MODEL, '--robot', 'quadruped', '-o', self.folder / name)
            self.assertTrue((self.folder / name).read_bytes().startswith(start))

    def test_module_types_connections_and_roles_are_drawn(self):
        picture = self.folder / 'x.svg'

        def drawn(*arguments):
            morphbus('draw', MODEL, *arguments, '-o', picture)
            return picture.read_text(encoding='utf-8')

        # A dot for each connector, and no line leads from one to the next.
        dots = [path for path in re.findall(r'stroke:rgb\(100%,100%,100%\)[^>]* d="([^"]*)"', drawn('--module', 'MTRAN')) if 'C' in path]
        self.assertEqual([' L ' in path for path in dots], [False] * 6)

        def faces(svg):
            return re.findall(r'fill:(rgb\([^)]*\));[^>]* d="([^"]*)"', svg)

        # Two modules of one shape, which lie otherwise in another way of connecting them.
        first, other = drawn('--number', 1), drawn('--connection', 'MTRAN_to_MTRAN', '--number', 72)
        self.assertNotEqual(faces(first), faces(other))
        # A module of one quadruped and that which has its role in the other one lie in one place and have one colour; by module they have
        # other colours, for they have other names.
        by_role, by_module = ([faces(drawn('--robot', robot, '--view', 'top', *options)) for robot in ('quadruped', 'equivalent_quadruped')]
                              for options in (('--program', PROGRAM), ()))

        def places(of_robot):
            # Letters have curves. Where a face begins does not matter.
            return {(frozenset(tuple(round(float(number), 1) for number in point) for point in re.findall(r'([\d.]+) ([\d.]+)', path)), color)
                    for color, path in of_robot if 'C' not in path}

        self.assertEqual(places(by_role[0]), places(by_role[1]))
        self.assertNotEqual(places(by_module[0]), places(by_module[1]))
        self.assertEqual({place for place, _ in places(by_module[0])}, {place for place, _ in places(by_module[1])})
        widths = [float(re.search(r'width="([\d.]+)', drawn('--module', 'MTRAN', '--width', width))[1]) for width in (200, 400)]
        self.assertEqual(widths[1] - widths[0], 200)
        for arguments, why in ((('--number', 73), 'has 72 ways'), (('--module', 'MTRAM'), "did you mean 'MTRAN'"),
                               (('--module', 'MTRAN', '--number', 1), 'three pictures'), (('--connection', 'MTRAN_to_MTRAN'), '--number'),
                               (('--robot', 'quadruped', '--program', MODEL), 'error')):
            self.assertIn(why, morphbus('draw', MODEL, *arguments, '-o', picture, status=2).stderr)

    def test_check_prints_a_summary(self):
        text = morphbus('check', MODEL).stdout
        for part in ('module MTRAN', '72 of 144', 'robot quadruped: 9 modules', 'mobility 16'):
            self.assertIn(part, text)

    def test_check_and_variants_answer_in_json(self):
        answer = as_json('check', MODEL)
        self.assertEqual(list(answer), ['modules', 'connections', 'robots'])
        self.assertEqual([m['name'] for m in answer['modules']], ['MTRAN'])
        self.assertEqual(answer['connections'][0], {'name': 'MTRAN_to_MTRAN', 'a': 'MTRAN', 'b': 'MTRAN', 'count': 72,
                                                    'candidates': 144})
        robot = answer['robots'][0]
        self.assertEqual((robot['name'], robot['modules'], robot['mobility'], robot['locked']),
                         ('quadruped', 9, 16, ['m5.joint_1', 'm5.joint_2']))
        variants = self.folder / 'v.m3l'
        answer = as_json('variants', MODEL, '--robot', 'quadruped', '--max', 2, '-o', variants)
        self.assertEqual([v['robot'] for v in answer['variants']], ['quadruped_variant_1', 'quadruped_variant_2'])
        self.assertNotIn('m3l', answer)
        printed = as_json('variants', MODEL, '--robot', 'quadruped', '--max', 2)['m3l']
        self.assertEqual(printed.split('import')[1].split('\n', 1)[1], variants.read_text().split('import')[1].split('\n', 1)[1])

    def test_the_help_of_compare_names_the_tolerances(self):
        for name in ('propagated_m', 'role_s'):
            self.assertIn(name, morphbus('compare', '--help').stdout)
        said = morphbus('compare', 'a', 'b', '--tolerance', 'simulated=3', status=2).stderr
        self.assertIn("did you mean 'simulated_m'?", said)

    def test_json_is_all_that_stands_on_stdout(self):
        done = morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 1, '--inproc', '--json', '--log',
                        self.folder / 'x.log')
        summary = json.loads(done.stdout)
        for key in ('run', 'hash', 'seconds', 'wall_seconds', 'ticks', 'messages', 'lost', 'resent', 'roles',
                    'displacement', 'faults'):
            self.assertIn(key, summary)
        self.assertEqual(summary['ticks'], 50)

    def test_every_command_has_help_with_an_example(self):
        names = ['check', 'connections', 'fk', 'graph', 'equivalent', 'variants', 'roles',
                 'compile', 'disasm', 'format', 'export', 'draw', 'build', 'new', 'lsp', 'run', 'sweep', 'optimise', 'benchmark', 'sim',
                 'log', 'replay', 'spy', 'monitor', 'control', 'runs', 'doctor', 'compare', 'info', 'verify', 'repair', 'reproduce',
                 'report', 'convert', 'completion', 'man']
        for name in names:
            self.assertIn('xample', morphbus(name, '--help').stdout, name)
        listed = re.findall(r'^  (\w+) {2,}', morphbus('--help').stdout, re.M)
        self.assertEqual(sorted(names + ['module']), sorted(listed))
        morphbus('module', '--help')

    def test_a_hidden_command_is_suggested_to_nobody(self):
        self.assertIn("(did you mean 'completion'?)", morphbus('completi', status=2).stderr)
        self.assertNotIn("'worker'", morphbus('sweep', 'worke', status=2).stderr)

    def test_version_and_misuse(self):
        self.assertRegex(morphbus('--version').stdout, r'^morphbus \d+\.\d+\.\d+(-[0-9a-f]{8}\+?)?, arithmetic [0-9a-f]{16}$')
        morphbus(status=2)
        morphbus('nonsense', status=2)
        morphbus('fk', status=2)

    @unittest.skipUnless(pathlib.Path('/dev/full').exists(), 'no /dev/full')
    def test_a_full_disk_behind_stdout_is_no_success(self):
        for args in (('fk', MODEL, '--robot', 'quadruped', '--json'), ('check', MODEL),
                     ('export', MODEL, '--robot', 'quadruped', '--to', 'mjcf', '-o', '-')):
            with open('/dev/full', 'w') as full:
                done = subprocess.run(command(*args), stdout=full, stderr=subprocess.PIPE, text=True)
            self.assertEqual(done.returncode, 2, args)
            self.assertRegex(done.stderr, 'cannot write.*: No space left', args)

    def test_a_reader_that_goes_away_is_no_crash(self):
        process = subprocess.Popen(command('connections', MODEL, '--json'), stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE)
        process.stdout.close()
        _, err = process.communicate(timeout=LIMIT)
        self.assertEqual(process.returncode, 2)
        self.assertEqual(err, b'')


if __name__ == '__main__':
    unittest.main()
