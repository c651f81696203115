#!/usr/bin/env python3
"""`check --attributes` lists the numbers of a model, `run --set` changes them for a run, which repeats to the bit."""
import unittest

from support import MODEL, PROGRAM, Case, as_json, morphbus


class Attributes(Case):
    def run_with(self, *settings, options=()):
        words = [word for setting in settings for word in ('--set', setting)]
        return as_json('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 0.1, '--inproc', '--force', '--log',
                       self.folder / 'x.log', *words, *options, status=1)  # Nobody has a role so soon.

    def description(self):
        return as_json('info', self.folder / 'x.log')['description']

    def test_check_lists_what_can_be_set(self):
        listed = {entry['name']: entry for entry in as_json('check', MODEL, '--attributes')['attributes']}
        self.assertEqual(listed['MTRAN.joint_1.torque'],
                         {'name': 'MTRAN.joint_1.torque', 'value': 1.9, 'unit': 'N·m', 'least': 1e-9, 'most': 1e9})
        self.assertIsNone(listed['MTRAN.connecting_bar.friction']['value'])
        table = morphbus('check', MODEL, '--attributes').stdout
        row = next(line.split() for line in table.splitlines() if line.startswith('MTRAN.joint_1.torque'))
        self.assertEqual(row, ['MTRAN.joint_1.torque', '1.9', '1e-09', '1e+09', 'N·m'])
        self.assertNotIn('attributes', as_json('check', MODEL))

    def test_a_run_with_settings_is_another_one_and_repeats(self):
        plain = self.run_with()
        self.assertEqual(self.description()['attributes'], [])
        for setting in ('MTRAN.connecting_bar.friction=0.3', 'MTRAN.joint_1.backlash=2deg', 'MTRAN.joint_2.delay=20ms', 'MTRAN.connecting_bar.mass_spread=5%'):
            varied = self.run_with(setting)
            self.assertEqual(self.description()['attributes'], [setting])
            self.assertNotEqual((varied['world_hash'], varied['hash']), (plain['world_hash'], plain['hash']), setting)
            self.assertNotEqual(varied['world_hash'], plain['world_hash'], setting)
            again = self.run_with(setting)
            self.assertEqual((varied['world_hash'], varied['hash']), (again['world_hash'], again['hash']), setting)
        morphbus('reproduce', self.folder / 'x.log')
        self.assertIn('of the model was set MTRAN.connecting_bar.mass_spread=5%', morphbus('info', self.folder / 'x.log').stdout)

    def test_masses_follow_the_noise_seed(self):
        hashes = {seed: self.run_with('MTRAN.connecting_bar.mass_spread=0.05', options=('--noise-seed', seed))['world_hash'] for seed in (1, 2)}
        self.assertEqual(len(set(hashes.values())), 2)
        self.assertEqual(self.description()['noise_seed'], 2)

    def test_what_cannot_be_set_is_said_before_anything_starts(self):
        for setting, why in (('MTRAN.joint_3.torque=1', "MTRAN has no link, joint or sensor 'joint_3' (did you mean 'joint_"),
                             ('MTRAN.joint_1.torque=0', "--set MTRAN.joint_1.torque=0: MTRAN.joint_1.torque: expected 1e-9 to 1e9 N·m, not '0'"),
                             ('MTRA.joint_1.torque=1', "the model has no module type 'MTRA' (did you mean 'MTRAN'?)"),
                             ('MTRAN.joint_1.torgue=1', "has no attribute 'torgue' that can be set (did you mean 'torque'?)")):
            done = morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 1, '--inproc', '--set', setting, status=2)
            self.assertIn(why, done.stderr)


if __name__ == '__main__':
    unittest.main()
