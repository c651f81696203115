#!/usr/bin/env python3
"""`compare` says equivalent where it must and different where it must, naming role, quantity and time."""
import math
import re
import unittest

from support import MODEL, PROGRAM, Case, as_json, decode, encode, morphbus, read_events, write_events

QUADRUPED, EQUIVALENT = 'quadruped.log', 'equivalent_quadruped.log'


class Comparison(Case):
    def assert_different(self, a, b):
        """Different, and the first divergence has role, quantity and time."""
        result = as_json('compare', a, b, status=1)
        self.assertEqual(result['verdict'], 'different')
        first = result['first_divergence']
        self.assertIsNotNone(first)
        self.assertTrue(first['role'])
        self.assertTrue(first['quantity'])
        return first

    def run_changed(self, text):
        """A run of the quadruped under a changed program; its log."""
        program = self.folder / 'changed.dyn'
        program.write_text(text)
        log = self.folder / 'changed.log'
        morphbus('run', MODEL, program, '--robot', 'quadruped', '--seconds', 20, '--inproc', '--log', log)
        return log

    def test_the_two_robots_walk_alike(self):
        result = as_json('compare', self.log(QUADRUPED), self.log(EQUIVALENT))
        self.assertEqual(result['verdict'], 'equivalent')
        self.assertIsNone(result['first_divergence'])
        self.assertEqual(len([role for role in result['roles'] if not role.startswith('(')]), 9)
        self.assertLessEqual(result['max_position_m'], 1e-3)

    def test_a_run_compared_with_itself_is_equivalent(self):
        # Alone it proves little: the tests below show that compare can also say no.
        result = as_json('compare', self.log(QUADRUPED), self.log(QUADRUPED))
        self.assertEqual((result['verdict'], result['max_position_m']), ('equivalent', 0))

    def test_without_setJointAxis_it_is_different(self):
        text = re.sub(r'.*setJointAxis.*\n', '', PROGRAM.read_text())
        self.assertNotIn('setJointAxis', text)
        program = self.folder / 'raw.dyn'
        program.write_text(text)
        logs = []
        for robot in ('quadruped', 'equivalent_quadruped'):
            logs.append(self.folder / f'{robot}.log')
            morphbus('run', MODEL, program, '--robot', robot, '--seconds', 20, '--inproc', '--log', logs[-1])
        self.assert_different(*logs)

    def test_one_changed_angle_is_different(self):
        changed = PROGRAM.read_text().replace('jointRotateDegreesNonBlocking(knee, 90)',
                                              'jointRotateDegreesNonBlocking(knee, 89)')
        self.assertNotEqual(changed, PROGRAM.read_text())
        first = self.assert_different(self.log(QUADRUPED), self.run_changed(changed))
        self.assertIn('LowerHalf', first['role'])

    def test_one_angle_in_one_payload_altered_by_one_degree_is_different(self):
        events = read_events(self.log(QUADRUPED))
        at_tick = 600
        for i, (number, timestamp, channel, data) in enumerate(events):
            if not channel.endswith('/SIM/SENSORS'):
                continue
            message = decode(data)
            named = [m for m in message.modules if m.name == 'm1']
            if message.header.tick != at_tick or not named:
                continue
            angles = list(named[0].joint_position_si)
            angles[1] += math.radians(1)
            named[0].joint_position_si = angles
            events[i] = (number, timestamp, channel, encode(message))
            break
        else:
            self.fail('no such message')
        altered = self.folder / 'altered.log'
        write_events(altered, events)
        first = self.assert_different(self.log(QUADRUPED), altered)
        self.assertEqual(first['role'], 'FrontLeftLowerHalf')
        self.assertIn('joint angle', first['quantity'])
        self.assertAlmostEqual(first['time'], at_tick * 0.02, delta=0.001)

    def test_a_log_cut_anywhere_is_read_to_the_cut_and_never_equivalent(self):
        whole = self.log(QUADRUPED).read_bytes()
        cut = self.folder / 'cut.log'
        for size in (0, 1, 27, 28, 1000, len(whole) // 3, len(whole) // 2 + 13, len(whole) - 1000, len(whole) - 1):
            cut.write_bytes(whole[:size])
            done = morphbus('compare', self.log(QUADRUPED), cut, status=2)
            self.assertNotIn('equivalent', done.stdout.splitlines()[0] if done.stdout else '', size)
            if size > len(whole) // 3:
                morphbus('info', cut)
                morphbus('verify', cut, status=1)

    def test_the_report_stands_alone(self):
        page = self.folder / 'report.html'
        morphbus('compare', self.log(QUADRUPED), self.log(EQUIVALENT), '--report', page)
        text = page.read_text()
        self.assertIn('<svg', text)
        self.assertNotRegex(text, r'(src|href)="http')

    def test_tolerances_are_options(self):
        done = morphbus('compare', self.log(QUADRUPED), self.log(EQUIVALENT), '--tolerance', 'speed=1', status=2)
        self.assertIn('simulated_m', done.stderr)


if __name__ == '__main__':
    unittest.main()
