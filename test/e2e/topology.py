#!/usr/bin/env python3
"""Connections that open and close while the robot runs: the modules find out, and take and leave their roles."""
import unittest

from control_live import Live
from support import MODEL, PROGRAM, as_json, decode, morphbus, read_events

# Of the quadruped: from foot to foot of two legs. Then ticks until what is known counts as settled, and until a
# pose without news is stale.
DIAMETER = 4
SETTLE = 10
STALE = 10


class Topology(Live):
    def run_script(self, script, *options, seconds=5):
        file = self.folder / 'script'
        file.write_text(script)
        self.path = self.folder / 'scripted.log'
        self.summary = as_json('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', seconds, '--commands', file,
                               '--log', self.path, '--force', *options)
        return self.summary

    def role_changes(self, module):
        """(tick, role) whenever a module's STATUS has another role than before."""
        changes = []
        for _, _, channel, data in read_events(self.path):
            if channel.endswith(f'/{module}/STATUS'):
                status = decode(data)
                if not changes or changes[-1][1] != status.role_name:
                    changes.append((status.header.tick, status.role_name))
        return changes

    def assert_changes_at(self, module, tick, role, after=DIAMETER + 1):
        """The module goes over to the role once it has heard of what happened at `tick`, and that has settled."""
        found = [when for when, other in self.role_changes(module) if when >= tick and other == role]
        self.assertTrue(found, (module, role, self.role_changes(module)))
        self.assertLessEqual(found[0] - tick, after + SETTLE, (module, role))

    def test_only_its_labels_keep_the_junction_from_being_an_upper_half(self):
        summary = self.run_script('150 disconnect m2.c3\n', '--inproc', seconds=4)
        self.assert_changes_at('m5', 150, '')
        self.assert_changes_at('m2', 150, '')
        self.assertIsNone(summary['roles']['m5'])
        # The other side of the robot is what it was.
        for module in ('m6', 'm7', 'm8', 'm9'):
            self.assertEqual(len([role for _, role in self.role_changes(module) if role]), 1, module)
        why = [problem for problem in summary['problems'] if 'm5' in problem and 'FrontRightUpperHalf' in problem]
        self.assertEqual(len(why), 1, summary['problems'])
        self.assertIn('label', why[0])
        self.assertNotIn('require', why[0])

    def test_joined_again_all_roles_are_back(self):
        script = '150 disconnect m2.c3\n190 connect m2.c3 m5.c4\n'
        for where in ('--inproc', '--isolate'):
            summary = self.run_script(script, '--still', where)
            self.assert_changes_at('m5', 150, '')
            self.assert_changes_at('m5', 190, 'Junction')
            self.assert_changes_at('m2', 190, 'FrontLeftUpperHalf')
            self.assertEqual(summary['roles']['m1'], 'FrontLeftLowerHalf')
            self.assertEqual(summary['problems'], [])
            hashes = getattr(self, 'hashes', []) + [summary['hash']]
            self.hashes = hashes
        self.assertEqual(self.hashes[0], self.hashes[1])

    def test_a_leg_cut_off_from_the_root_goes_stale_and_comes_back(self):
        # m1 hangs on m2, and m2 on m3 and m5.
        script = '150 disconnect m1.c5\n200 connect m1.c5 {}\n'
        mate = self.mate_of('m1')
        summary = self.run_script(script.replace('m1.c5', mate[0]).format(mate[1]), '--inproc', '--still')
        stale = []
        for _, _, channel, data in read_events(self.path):
            if channel.endswith('/m1/STATUS'):
                status = decode(data)
                if not stale or stale[-1][1] != bool(status.pose_stale):
                    stale.append((status.header.tick, bool(status.pose_stale)))
        self.assertEqual([is_stale for _, is_stale in stale], [False, True, False])
        self.assertIn(stale[1][0], range(150 + 10, 150 + 13))
        self.assertIn(stale[2][0], range(200, 200 + DIAMETER + 2))
        # Without its upper half it is no lower half, and while it does not know where it is it is nothing.
        # That its pose goes stale is one more change that has to settle.
        self.assert_changes_at('m1', 150, '', after=STALE + 2)
        self.assertEqual([role for tick, role in self.role_changes('m1') if 150 <= tick < 200], [''])
        # Its role rests on that of the upper half, which has to settle first.
        self.assert_changes_at('m1', 200, 'FrontLeftLowerHalf', after=DIAMETER + 2 + SETTLE)
        self.assertEqual(summary['problems'], [])

    def mate_of(self, module):
        """A module's only connector that is connected, and its mate, as the log of a short run has them."""
        self.run_script('', '--inproc', '--still', seconds=1)
        names, docked = {}, None
        for _, _, channel, data in read_events(self.path):
            if channel.endswith('/SIM/SENSORS'):
                for reading in decode(data).modules:
                    names[reading.module_id] = reading.name
                    if reading.name == module:
                        docked = reading.docked[0]
        return (f'{module}.c{docked.connector + 1}', f'{names[docked.mate_module]}.c{docked.mate_connector + 1}')

    def test_a_person_does_it_to_the_standing_robot(self):
        self.start()
        self.reach(160)
        self.control('pause')
        opened = self.control('disconnect', 'm2.c3')['tick']
        self.control('step', 20)
        self.await_held(opened + 19)
        closed = self.control('connect', 'm2.c3', 'm5.c4')['tick']
        self.control('resume')
        self.reach(closed + 40)
        self.control('stop')
        self.end()
        self.assert_changes_at('m5', opened, '')
        self.assert_changes_at('m5', closed, 'Junction')
        self.assert_changes_at('m2', closed, 'FrontLeftUpperHalf')
        self.assertIn('END verified, clean', morphbus('info', self.path).stdout)
        self.assert_repeats()


if __name__ == '__main__':
    unittest.main()
