#!/usr/bin/env python3
"""The same inputs give the same run, however it is run."""
import math
import unittest

from support import MODEL, PROGRAM, Case, as_json, morphbus

SECONDS = 8


class Determinism(Case):
    def run_once(self, *options, robot='quadruped', seconds=SECONDS):
        summary = as_json('run', MODEL, PROGRAM, '--robot', robot, '--seconds', seconds, '--log',
                          self.folder / 'x.log', *options)
        self.assertRegex(summary['hash'], '^[0-9a-f]{32}$')
        return summary

    def test_two_runs_of_processes_have_one_hash(self):
        result = as_json('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', SECONDS, '--isolate',
                         '--repeat', 2, '--log', self.folder / 'x.log')
        self.assertTrue(result['hashes_agree'])
        self.assertNotEqual(result['runs'][0]['run'], result['runs'][1]['run'])
        self.assertTrue((self.folder / 'x-1.log').exists() and (self.folder / 'x-2.log').exists())

    def test_a_fifth_of_all_datagrams_lost_changes_no_payload(self):
        plain = self.run_once('--isolate')
        lossy = self.run_once('--isolate', '--loss', 0.2, '--seed', 5)
        self.assertEqual(lossy['hash'], plain['hash'])
        # What others lost they tell in HEALTH, which may be lost as anything else: not every process is heard of.
        discarded = {name: process['discarded'] for name, process in lossy['processes'].items()}
        self.assertGreater(discarded.pop('LOG'), 0)
        self.assertGreaterEqual(sum(count > 0 for count in discarded.values()), 3, discarded)
        self.assertGreater(lossy['resent'], 0)
        self.assertEqual(morphbus('verify', self.folder / 'x.log').returncode, 0)

    def test_one_process_gives_the_hash_of_many(self):
        self.assertEqual(self.run_once('--inproc')['hash'], self.run_once('--isolate')['hash'])

    def test_loss_in_one_process_changes_no_payload(self):
        self.assertEqual(self.run_once('--inproc', '--loss', 0.2)['hash'], self.run_once('--inproc')['hash'])

    def test_another_robot_has_another_hash(self):
        self.assertNotEqual(self.run_once('--inproc')['hash'],
                            self.run_once('--inproc', robot='equivalent_quadruped')['hash'])

    def test_with_any_module_as_root_roles_and_walk_are_the_same(self):
        # How far a module is from the root decides when it first knows where it is, and so the tick at
        # which it takes its role; by that alone the walks differ in a bit.
        walks = {f'm{i}': self.run_once('--inproc', '--root', f'm{i}', seconds=20) for i in range(1, 10)}
        usual = walks['m5']
        self.assertEqual(len(usual['walk']['cycle_north_m']), 2)
        for root, summary in walks.items():
            self.assertEqual(summary['roles'], usual['roles'], root)
            self.assertEqual(summary['faults'], [], root)
            self.assertEqual(summary['walk']['cycle_s'], usual['walk']['cycle_s'], root)
            for a, b in zip(summary['walk']['cycle_north_m'], usual['walk']['cycle_north_m'], strict=True):
                self.assertAlmostEqual(a, b, delta=0.010, msg=root)
            self.assertLess(abs(math.degrees(sum(summary['walk']['cycle_turn_rad']))), 10, root)
            self.assertLess(math.degrees(summary['walk']['max_tilt_rad']), 10, root)


if __name__ == '__main__':
    unittest.main()
