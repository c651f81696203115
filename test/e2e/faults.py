#!/usr/bin/env python3
"""`run --faults`: whatever befalls messages on their way, the run is the same one, and what befell them is counted."""
import subprocess
import unittest

from gait import STEP, north
from support import BIN, LIMIT, MODEL, PROGRAM, SOURCE, Case, as_json, command, morphbus, new_key

EXAMPLE = SOURCE / 'models' / 'rough.faults'
ALL_KINDS = 'fault loss=0.3 duplicate=0.1 reorder=0.2 delay=8 corrupt=0.05\n'
KINDS = ('discarded', 'doubled', 'delayed', 'corrupted')


class FaultsCase(Case):
    def run_once(self, *options, seconds=2):
        return as_json('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', seconds, '--force', '--log',
                       self.folder / 'x.log', *options)

    def rules(self, text):
        path = self.folder / 'x.faults'
        path.write_text(text)
        return path

    def assert_suffered(self, summary, processes):
        """Every process that told got its share of every kind, and messages were sent again. Returns who told."""
        self.assertLessEqual(set(summary['processes']), set(processes))
        self.assertGreater(summary['resent'], 0)
        return self.assert_shared(summary['processes'])

    def assert_shared(self, ledgers):
        """Each process's ledger has every kind of fault, and every damaged message was found by its CRC. Returns the
        processes whose ledgers tell of the run."""
        # HEALTH may be lost, for nobody asks for it again, and of a short run all that a process sent; the logger's own
        # is there.
        self.assertIn('LOG', ledgers)
        for process, ledger in ledgers.items():
            self.assertEqual(ledger['bad'], ledger['corrupted'], process)
        # Where all but the first HEALTH were lost, nothing had happened yet.
        told = {process: ledger for process, ledger in ledgers.items() if ledger['received'] > 100}
        for process, ledger in told.items():
            for kind in KINDS:
                self.assertGreater(ledger[kind], 0, (process, kind))
        return set(told)


    def walk_smoothly(self):
        """The hash of WALK seconds in which nothing befalls anybody: the robot has got up by then and walks."""
        smooth = self.run_once('--inproc', seconds=WALK)
        way = north(self.folder / 'x.log')
        self.assertGreater(way[max(way)] - way[STANDING], STEP)
        return smooth['hash']


PROCESSES = ('SIM', 'LOG', *(f'm{i}' for i in range(1, 10)))
WALK = 8  # s, of which the robot needs some three to get up.
STANDING = 165  # tick at which it has got up


class Fast(FaultsCase):
    def test_all_kinds_change_no_payload_however_the_run_is_spread(self):
        smooth = self.walk_smoothly()
        rules = self.rules(ALL_KINDS)
        told = set()
        for seed, where in ((1, ['--isolate']), (2, ['--isolate', '--processes', 2]), (3, ['--inproc'])):
            with self.subTest(seed=seed, where=where):
                rough = self.run_once(*where, '--faults', rules, '--seed', seed, seconds=WALK)
                self.assertIsNone(rough['error'])
                self.assertEqual(rough['hash'], smooth)
                told |= self.assert_suffered(rough, PROCESSES)
                self.assertEqual(morphbus('verify', self.folder / 'x.log').returncode, 0)
        self.assertGreater(len(told), 6)

    def test_damaged_messages_are_bad_and_no_others(self):
        # Long enough that of each process's reports, of which some are damaged, too, a late one comes through.
        rough = self.run_once('--inproc', '--faults', self.rules('fault corrupt=0.2\n'), seconds=6)
        for process, ledger in rough['processes'].items():
            self.assertEqual(ledger['bad'], ledger['corrupted'], process)
            self.assertGreater(ledger['bad'], 50, process)

    def test_one_seed_is_one_run_of_faults_and_another_is_another(self):
        rules = self.rules(ALL_KINDS)
        one, again, other = (self.run_once('--inproc', '--still', '--faults', rules, '--seed', seed, seconds=1)
                             for seed in (1, 1, 2))
        self.assertEqual(one['processes'], again['processes'])
        self.assertNotEqual(one['processes'], other['processes'])
        # A seed in the file goes before --seed.
        rules = self.rules('seed 1\n' + ALL_KINDS)
        self.assertEqual(self.run_once('--inproc', '--still', '--faults', rules, '--seed', 5, seconds=1)['processes'],
                         one['processes'])

    def test_rules_hold_for_their_process_channel_and_time(self):
        summary = self.run_once('--inproc', '--faults', self.rules(
            'fault process=m3 channel=*/TRANSFORM from=0.5s until=0.7s loss=0.9 # ten ticks\n'), seconds=1)
        for process, ledger in summary['processes'].items():
            if process == 'm3':
                self.assertGreater(ledger['discarded'], 9)
            else:
                self.assertEqual(ledger['discarded'], 0, process)

    def test_the_log_says_what_was_done_on_purpose(self):
        self.run_once('--inproc', '--faults', EXAMPLE)
        info = as_json('info', self.folder / 'x.log')
        self.assertEqual(info['description']['fault_rules'], EXAMPLE.read_text())
        self.assertEqual(info['description']['faults_file'], str(EXAMPLE))
        for kind in KINDS:
            self.assertGreater(info['health']['LOG'][kind], 0)
        text = morphbus('info', self.folder / 'x.log').stdout
        self.assertIn(f'faults of the bus on purpose by {EXAMPLE}', text)
        self.assertRegex(text, r'LOG: on purpose: \d+ doubled, \d+ delayed, \d+ corrupted')

    def test_mistakes_are_shown_where_they_are(self):
        def said(text):
            path = self.rules(text)
            done = morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--faults', path, status=2, cwd=self.folder)
            self.assertEqual(done.stdout, '')
            return done.stderr.replace(str(path), 'x.faults')
        self.assertIn('x.faults:2:12: error: expected a probability, 0 to 1\n  fault loss=30\n             ^~\n  hint: such as 0.2 or 20%',
                      said('# thirty in a hundred\nfault loss=30\n'))
        self.assertIn("x.faults:1:24: error: nothing in this run is called 'm33'", said('fault loss=0.1 process=m33\n'))
        self.assertIn("did you mean 'duplicate'?", said('fault duplicat=0.1\n'))
        done = morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--faults', self.folder / 'none', status=2)
        self.assertIn('--faults: cannot', done.stderr)
        # A module is told of them the same way.
        done = subprocess.run([str(BIN / 'morphbus-module'), '--run', 'x', '--module', 'm1', '--id', '0', '--kinematics', 'x',
                               '--program', 'x', '--open', '--faults', self.rules('fault corrupt=2')], capture_output=True, text=True)
        self.assertEqual(done.returncode, 2)
        self.assertIn('x.faults:1:15: error: expected a probability', done.stderr)

    def test_processes_started_by_hand(self):
        if not self.in_private_network():
            return
        # Long enough for several HEALTH of every process, most of which come through.
        seconds = 6
        smooth = self.run_once('--inproc', seconds=seconds)['hash']
        rules = self.rules('seed 3\n' + ALL_KINDS)
        image, kinematics = self.folder / 'q.image', self.folder / 'q.kinematics'
        morphbus('compile', PROGRAM, '--model', MODEL, '-o', image)
        morphbus('export', MODEL, '--module', 'MTRAN', '--to', 'kinematics', '-o', kinematics)
        key = new_key(self.folder)
        common = ('--robot', 'quadruped', '--run', 'hand', '--seconds', seconds, '--faults', rules, '--key', key)
        names = [f'm{i}' for i in range(1, 10)]
        started = [
            command('log', MODEL, PROGRAM, *common, '-o', self.folder / 'hand.log'),
            command('module', '--run', 'hand', '--modules', ','.join(names), '--id', ','.join(map(str, range(9))),
                    '--kinematics', kinematics, '--program', image, '--faults', rules, '--root-module', 'm5',
                    '--root-link', 1, '--root-pose=-0.0325,0,0,1,0,0,0', '--key', key),
            command('sim', MODEL, PROGRAM, *common)]
        processes = [subprocess.Popen(argv, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) for argv in started]
        for process in processes:
            self.kill_at_the_end(process)
        said = [process.communicate(timeout=LIMIT) for process in processes]
        self.assertEqual([process.returncode for process in processes], [0, 0, 0], said)
        info = as_json('info', self.folder / 'hand.log')
        self.assertTrue(info['clean'])
        self.assertEqual(info['hash'], smooth)
        # A module's first HEALTH may tell of the time before the sim came.
        self.assertGreater(len(self.assert_shared(info['health'])), 4)


class TwentySeeds(FaultsCase):
    def test_processes_with_all_kinds_of_faults(self):
        smooth = self.walk_smoothly()
        rules = self.rules(ALL_KINDS)
        told = set()
        for seed in range(1, 21):
            with self.subTest(seed=seed):
                rough = self.run_once('--isolate', '--faults', rules, '--seed', seed, seconds=WALK)
                self.assertEqual(rough['hash'], smooth)
                told |= self.assert_suffered(rough, PROCESSES)
        self.assertEqual(told, set(PROCESSES))


if __name__ == '__main__':
    unittest.main()
