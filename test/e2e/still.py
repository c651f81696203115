#!/usr/bin/env python3
"""`run --still` and `--processes`: without physics, in any number of processes, roles and motions are the same."""
import unittest

from support import MODEL, PROGRAM, ROBOTS, Case, as_json, decode, morphbus, read_events


class Still(Case):
    def run_still(self, *options, robot='quadruped', log='x.log', seconds=6):
        return as_json('run', MODEL, PROGRAM, '--robot', robot, '--seconds', seconds, '--still', '--log',
                       self.folder / log, '--force', *options)

    def test_roles_are_those_of_the_robot_with_physics_and_nothing_has_a_place(self):
        still = self.run_still('--inproc')
        self.assertEqual(still['faults'], [])
        self.assertIsNone(still['displacement'])
        moving = as_json('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 6, '--inproc', '--log',
                         self.folder / 'moving.log')
        self.assertEqual(still['roles'], moving['roles'])
        self.assertFalse([e for e in read_events(self.folder / 'x.log') if e[2].endswith('/WORLD')])
        info = as_json('info', self.folder / 'x.log')
        self.assertTrue(info['description']['still'])
        self.assertTrue(info['clean'])
        self.assertFalse(as_json('info', self.folder / 'moving.log')['description']['still'])

    def test_joints_stand_where_they_were_sent(self):
        self.run_still('--inproc')
        # At the end every joint has been at its target: the last sensors agree with the last commands.
        sensed, commanded = {}, {}
        for _, _, channel, data in read_events(self.folder / 'x.log'):
            if channel.endswith('/SENSORS'):
                for module in decode(data).modules:
                    sensed[module.module_id] = list(module.joint_position_si)
            elif channel.endswith('/ACTUATOR'):
                message = decode(data)
                for j, joint in enumerate(message.joints):
                    if joint.mode == 1:
                        commanded[message.module_id, j] = joint.target_si
        self.assertGreaterEqual(len(commanded), 12)
        moved = [abs(sensed[m][j]) > 0.1 for m, j in commanded]
        self.assertGreaterEqual(sum(moved), 4)

    def test_processes_one_process_and_loss_give_one_hash(self):
        hashes = {self.run_still(*options)['hash'] for options in (['--inproc'], ['--isolate'], ['--isolate', '--loss', 0.2])}
        self.assertEqual(len(hashes), 1)

    def test_any_number_of_processes_gives_one_hash(self):
        reference = self.run_still('--inproc', seconds=4)['hash']
        for count in (1, 2, 4, 20):
            shared = self.run_still('--isolate', '--processes', count, seconds=4)
            self.assertEqual(shared['hash'], reference, count)
            self.assertEqual(len(shared['roles']), 9)
        self.assertEqual(self.run_still('--isolate', '--processes', 3, '--loss', 0.2, seconds=4)['hash'], reference)
        morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 1, '--inproc', '--processes', 2, status=2)
        morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 1, '--processes', 0, status=2)

    def test_equivalent_robots_are_compared_without_poses(self):
        for robot in ROBOTS:
            self.run_still('--inproc', robot=robot, log=f'{robot}.log')
        logs = [self.folder / f'{robot}.log' for robot in ROBOTS]
        self.assertEqual(as_json('compare', *logs, status=2)['verdict'], 'unusable')
        self.assertEqual(as_json('compare', *logs, '--without', 'simulated')['verdict'], 'equivalent')

    def test_nothing_can_be_pushed_but_connections_come_apart(self):
        script = self.folder / 'script'
        script.write_text('100 push m5 NORTH 5\n')
        run = morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 4, '--still', '--inproc', '--log',
                       self.folder / 'x.log', '--commands', script)
        self.assertIn('push m5 NORTH 5: this run is without physics', run.stderr)
        script.write_text('100 disconnect m2.c3\n')
        self.assertEqual(self.run_still('--inproc', '--commands', script)['hash'],
                         self.run_still('--isolate', '--commands', script)['hash'])


if __name__ == '__main__':
    unittest.main()
