#!/usr/bin/env python3
"""`compare` by event, by lag and by gait, with tolerances from a file and against baselines: runs that are not
tick for tick the same are told from runs that are not the same, and the line that parts two runs is named."""
import json
import re
import resource
import unittest

from support import MODEL, PROGRAM, Case, as_json, morphbus

SECONDS = 20  # standing up and two gait cycles
KNEE = 'jointRotateDegreesNonBlocking(knee, 90)'


class Alignment(Case):
    def walk(self, name, *options, program=PROGRAM, seconds=SECONDS):
        """The log of a run of the quadruped."""
        log = self.folder / f'{name}.log'
        morphbus('run', MODEL, program, '--robot', 'quadruped', '--seconds', seconds, '--log', log, *options)
        return log

    def changed(self, old, new):
        """A program with one line changed, and that line's number."""
        text = PROGRAM.read_text()
        self.assertEqual(text.count(old), 1)
        program = self.folder / 'changed.dyn'
        program.write_text(text.replace(old, new))
        return program, text[:text.index(old)].count('\n') + 1

    def verdict(self, a, b, *options, status=0):
        return as_json('compare', a, b, *options, status=status)


class Inproc(Alignment):
    def test_another_root_is_the_same_walk_by_event_by_lag_and_by_gait(self):
        a, b = self.walk('m5', '--inproc', '--root', 'm5'), self.walk('m1', '--inproc', '--root', 'm1')
        self.assertEqual(self.verdict(a, b, status=1)['verdict'], 'different')
        event = self.verdict(a, b, '--align', 'event')
        self.assertEqual(event['verdict'], 'equivalent')
        self.assertEqual(event['align']['by'], 'event')
        self.assertFalse(event['align']['by_ticks'])
        # Commands, angles and poses were compared and not left out.
        compared = {item['quantity'] for item in event['items'] if item['samples'] > 0}
        self.assertLessEqual({'role', 'command', 'event', 'joint angle', 'propagated position', 'simulated position',
                              'drift in position', 'docking'}, compared)
        lag = self.verdict(a, b, '--align', 'lag')
        self.assertEqual(lag['verdict'], 'equivalent')
        self.assertNotEqual(lag['align']['lag'], 0)
        gait = self.verdict(a, b, '--level', 'gait')
        self.assertEqual(gait['verdict'], 'equivalent')
        self.assertAlmostEqual(gait['gait']['a']['cycle_s'], 7.02, delta=0.05)
        self.assertGreater(gait['gait']['b']['forward_m'], 0.05)
        duties = [item for item in gait['items'] if item['quantity'] == 'duty']
        self.assertEqual(len(duties), 4)

    def test_what_is_the_same_tick_for_tick_is_compared_tick_for_tick(self):
        a = self.walk('a', '--inproc', seconds=4)
        b = self.walk('b', '--inproc', seconds=4)
        for align in ('event', 'lag'):
            result = self.verdict(a, b, '--align', align)
            self.assertEqual((result['verdict'], result['max_position_m']), ('equivalent', 0))
            self.assertTrue(result['align']['by_ticks'])

    def test_a_changed_angle_is_different_in_every_way_and_its_line_is_named(self):
        program, line = self.changed(KNEE, KNEE.replace('90', '89'))
        a, b = self.walk('a', '--inproc'), self.walk('b', '--inproc', program=program)
        for options in ((), ('--align', 'event'), ('--align', 'lag'), ('--level', 'gait')):
            result = self.verdict(a, b, *options, status=1)
            self.assertEqual(result['verdict'], 'different', options)
            # The gaits take the same time, but the knee comes less far.
            if 'gait' in options:
                beyond = {item['quantity'] for item in result['items'] if item['first_over'] is not None}
                self.assertIn('joint range', beyond)
                self.assertNotIn('gait cycle', beyond)
                continue
            self.assertIn('LowerHalf', result['first_divergence']['role'])
            for message, file in ((result['trace']['message_a'], PROGRAM), (result['trace']['message_b'], program)):
                self.assertEqual((message['file'], message['line']), (str(file), line), options)
                self.assertEqual(message['function'], 'LegLowerHalf.move_foot')
                self.assertTrue(message['channel'].endswith('/ACTUATOR'))
        done = morphbus('compare', a, b, status=1)
        self.assertIn(f'{program}:{line} in LegLowerHalf.move_foot', done.stdout)

    def test_without_setJointAxis_it_is_different_in_every_way(self):
        program = self.folder / 'raw.dyn'
        program.write_text(re.sub(r'.*setJointAxis.*\n', '', PROGRAM.read_text()))
        logs = []
        for robot in ('quadruped', 'equivalent_quadruped'):
            logs.append(self.folder / f'{robot}.log')
            morphbus('run', MODEL, program, '--robot', robot, '--seconds', SECONDS, '--inproc', '--log', logs[-1])
        for options in (('--align', 'event'), ('--align', 'lag'), ('--level', 'gait')):
            self.assertEqual(self.verdict(*logs, *options, status=1)['verdict'], 'different')

    def test_a_later_walk_is_found_by_its_lag(self):
        late, _ = self.changed('  behavior gait() {', '  startup wait() {\n    self.sleepds(20);\n  }\n  behavior gait() {')
        a, b = self.walk('a', '--inproc'), self.walk('b', '--inproc', program=late)
        # It stands up at the same time, so that one lag is not that of all.
        lag = self.verdict(a, b, '--align', 'lag', status=1)['align']['lag']
        self.assertAlmostEqual(lag, -2.0, delta=0.2)

    def test_a_longer_pause_in_every_cycle_is_another_gait(self):
        late, _ = self.changed('behavior gait() {\n    self.sleepds(20);', 'behavior gait() {\n    self.sleepds(40);')
        # Two whole cycles of the longer gait, too.
        a, b = self.walk('a', '--inproc', seconds=24), self.walk('b', '--inproc', program=late, seconds=24)
        gait = self.verdict(a, b, '--level', 'gait', status=1)
        cycle = [item for item in gait['items'] if item['quantity'] == 'gait cycle'][0]
        self.assertAlmostEqual(cycle['max'], 2.0, delta=0.1)

    def test_tolerances_come_from_a_file_by_role(self):
        program, _ = self.changed(KNEE, KNEE.replace('90', '89'))
        a, b = self.walk('a', '--inproc', seconds=6), self.walk('b', '--inproc', program=program, seconds=6)
        tolerances = self.folder / 'tolerances.toml'
        loose = '\n'.join(f'{name} = 1.0' for name in (
            'command_rad', 'angle_rad', 'propagated_m', 'propagated_rad', 'simulated_m', 'simulated_rad'))
        loose += '\nvelocity_rad_s = 100\neffort_n_m = 100\n'
        tolerances.write_text(loose)
        self.assertEqual(self.verdict(a, b, '--tolerances', tolerances)['verdict'], 'equivalent')
        tolerances.write_text(f'{loose}\n[role."*LowerHalf".label.knee]\ncommand_rad = 0.01\n')
        first = self.verdict(a, b, '--tolerances', tolerances, status=1)['first_divergence']
        self.assertEqual((first['label'], first['quantity'], first['tolerance']), ('knee', 'command', 0.01))
        # What stands on the command line counts.
        self.verdict(a, b, '--tolerances', tolerances, '--tolerance', 'command_rad=1')
        for text, place, reason in (
                ('angle_rad = 1\nangel_rad = 2\n', '2:1', "did you mean 'angle_rad'"),
                ('angle_rad = -1\n', '1:13', '0 or more'), ('angle_rad = "x"\n', '1:13', '0 or more'),
                ('[roles.x]\n', '1:2', 'role.PATTERN'), ('angle_rad = \n', '1:', 'error')):
            tolerances.write_text(text)
            done = morphbus('compare', a, b, '--tolerances', tolerances, status=2)
            self.assertIn(f'{tolerances}:{place}', done.stderr)
            self.assertIn(reason, done.stderr)

    def test_a_baseline_that_has_no_room_is_not_kept_and_the_reason_is_told(self):
        def little_room():
            resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 16, 1 << 16))

        log = self.walk('walk', '--inproc', seconds=4)
        kept = self.folder / 'no_room'
        done = morphbus('compare', log, '--baseline', kept, status=2, preexec_fn=little_room)
        self.assertIn('File too large', done.stderr)
        self.assertEqual(list(kept.iterdir()), [])

    def test_a_baseline_is_kept_and_compared_with(self):
        baselines = self.folder / 'kept'
        log = self.walk('walk', '--inproc', seconds=4)
        # A file of somebody else beside the baseline is not taken for a temporary one.
        baselines.mkdir(exist_ok=True)
        (baselines / 'walk.log.new').write_text('mine')
        stored = as_json('compare', log, '--baseline', baselines)['baseline'][0]
        self.assertEqual((baselines / 'walk.log.new').read_text(), 'mine')
        (baselines / 'walk.log.new').unlink()
        self.assertTrue(stored['stored'])
        self.assertEqual((baselines / 'walk.log').read_bytes(), log.read_bytes())
        same = as_json('compare', log, '--baseline', baselines)
        self.assertEqual((same['verdict'], same['baseline'][0]['stored']), ('equivalent', False))
        program, _ = self.changed('stand_hip_deg = 45', 'stand_hip_deg = 40')
        log.unlink()
        self.walk('walk', '--inproc', seconds=4, program=program)
        self.assertEqual(as_json('compare', log, '--baseline', baselines, status=1)['verdict'], 'different')
        self.assertTrue(as_json('compare', log, '--baseline', baselines, '--update')['baseline'][0]['stored'])
        self.assertEqual(as_json('compare', log, '--baseline', baselines)['verdict'], 'equivalent')
        # What is damaged cannot be a baseline, and the old one stays.
        kept = (baselines / 'walk.log').read_bytes()
        log.write_bytes(log.read_bytes()[:100_000])
        morphbus('compare', log, '--baseline', baselines, '--update', status=2)
        self.assertEqual((baselines / 'walk.log').read_bytes(), kept)
        self.assertEqual([path.name for path in baselines.iterdir()], ['walk.log'])
        morphbus('compare', log, status=2)
        morphbus('compare', baselines / 'walk.log', '--baseline', baselines, status=2)

    def test_options_that_do_not_fit_are_refused(self):
        for options in (('--align', 'evnt'), ('--level', 'feet'), ('--update',), ('--tolerances', 'nowhere.toml')):
            done = morphbus('compare', 'a.log', 'b.log', *options, status=2)
            self.assertNotIn('a.log', done.stderr)


class Realtime(Alignment):
    def test_a_run_in_real_time_is_the_lockstep_walk_by_event_and_by_gait(self):
        # What modules tell one another is late within a tick, and of their commands some come after it, too late.
        rules = self.folder / 'late.faults'
        rules.write_text('fault channel=*/TRANSFORM late=0.5 by=0.019s\nfault process=SIM channel=*/ACTUATOR late=0.02 by=0.03s\n')
        a = self.walk('lockstep', '--inproc')
        b = self.walk('realtime', '--realtime', '--inproc', '--faults', rules)
        self.assertGreater(sum(of['missed'] for of in as_json('info', b)['lateness'].values()), 10)
        for options in (('--align', 'event'), ('--level', 'gait')):
            result = self.verdict(a, b, *options)
            self.assertEqual(result['verdict'], 'equivalent', json.dumps(result['reason']))
        program, line = self.changed(KNEE, KNEE.replace('90', '89'))
        c = self.walk('changed', '--inproc', program=program)
        result = self.verdict(c, b, '--align', 'event', status=1)
        self.assertEqual(result['trace']['message_a']['line'], line)


if __name__ == '__main__':
    unittest.main()
