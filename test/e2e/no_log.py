#!/usr/bin/env python3
"""`run --no-log`: nothing is left of a run but its summary, which says to the digit what it says beside a log."""
import json
import os
import re
import signal
import subprocess
import unittest

from support import LIMIT, MODEL, PROGRAM, SOURCE, Case, as_json, await_condition, command, morphbus, processes_of

# What depends on the wall clock, and where the log is.
OWN = ('wall_seconds', 'log')
# In processes also what was counted depends on it.
COUNTED = (*OWN, 'processes', 'lost', 'resent', 'refused', 'lateness', 'missed_deadlines')
# A walk with a push, a lost module and another program.
COMMANDS = '10 push m5 EAST 20 0.2\n20 pause\n21 resume\n30 lose m3\n40 deploy {}\n'


class NoLog(Case):
    def setUp(self):
        super().setUp()
        # What a run would write without being told where.
        self.home = self.folder / 'home'
        self.home.mkdir()

    def run_in_home(self, *arguments, **options):
        return morphbus('run', *arguments, '--run', 'x', cwd=self.home, **options)

    def assert_the_same(self, *arguments, robot='quadruped', model=MODEL, program=PROGRAM, but=OWN, status=0):
        """The run with a log and without says the same, in JSON and in words. Returns its summary."""
        run = (model, program, '--robot', robot, *arguments)
        kept = json.loads(self.run_in_home(*run, '--log', self.folder / 'x.log', '--force', '--json', status=status).stdout)
        self.assertEqual(kept['log'], str(self.folder / 'x.log'))
        free = json.loads(self.run_in_home(*run, '--no-log', '--json', status=status).stdout)
        self.assertIsNone(free['log'])
        self.assertEqual({key: value for key, value in free.items() if key not in but},
                         {key: value for key, value in kept.items() if key not in but})
        self.assertEqual(os.listdir(self.home), [])
        self.assertEqual(os.listdir(self.folder / 'runtime' / 'morphbus'), [])
        return free

    def shipped(self, model, program):
        return {'model': SOURCE / 'models' / f'{model}.m3l', 'program': SOURCE / 'models' / 'programs' / f'{program}.dyn'}

    def test_a_walk_has_its_hash_and_its_gait(self):
        found = self.assert_the_same('--inproc', '--seconds', 18)
        self.assertIsNotNone(found['gait'])
        self.assertGreater(found['displacement'][0], 0.05)

    def test_other_robots_with_worlds_noise_and_sensors(self):
        self.assert_the_same('--inproc', '--seconds', 4, '--world', SOURCE / 'models' / 'yard.sdf', robot='car',
                             **self.shipped('atron', 'car_evade'))
        self.assert_the_same('--inproc', '--seconds', 3, '--still', robot='caterpillar', **self.shipped('mtran_robots', 'caterpillar'))
        self.assert_the_same('--inproc', '--seconds', 2, '--root-sensor', '--root-noise', '0.002,0.01')

    def test_what_people_do_to_it_shows(self):
        careful = SOURCE / 'models' / 'programs' / 'quadruped_careful.dyn'
        (self.folder / 'commands').write_text(COMMANDS.format(careful))
        found = self.assert_the_same('--inproc', '--seconds', 3, '--commands', self.folder / 'commands', status=None)
        self.assertEqual(list(found['lost_modules']), ['m3'])

    def test_losses_on_purpose(self):
        self.assert_the_same('--inproc', '--seconds', 1, '--loss', 0.2, '--faults', SOURCE / 'models' / 'rough.faults')

    def test_real_time(self):
        done = self.run_in_home(MODEL, PROGRAM, '--robot', 'quadruped', '--isolate', '--realtime', '--seconds', 0.5, '--no-log',
                                '--json', status=None)
        self.assertIn(done.returncode, (0, 1), done.stderr)
        found = json.loads(done.stdout)
        self.assertEqual((found['ticks'], found['log'], len(found['displacement'])), (25, None, 3))
        self.assertEqual(os.listdir(self.home), [])

    def test_processes(self):
        one = self.assert_the_same('--inproc', '--seconds', 1)
        for options in (['--isolate'], ['--isolate', '--processes', 2, '--loss', 0.1]):
            self.assertEqual(self.assert_the_same(*options, '--seconds', 1, but=COUNTED)['hash'], one['hash'])

    def test_in_words_too(self):
        with_log = self.run_in_home(MODEL, PROGRAM, '--robot', 'quadruped', '--inproc', '--seconds', 2, '--log', self.folder / 'x.log')
        without = self.run_in_home(MODEL, PROGRAM, '--robot', 'quadruped', '--inproc', '--seconds', 2, '--no-log')
        lines = [re.sub(r'in \S+ s of wall time \(\S+ x real time\)', '', text) for text in (with_log.stdout, without.stdout)]
        self.assertEqual(lines[0], f'{lines[1]}  log {self.folder}/x.log\n')

    def test_repeated_runs_agree(self):
        found = json.loads(self.run_in_home(MODEL, PROGRAM, '--robot', 'quadruped', '--inproc', '--seconds', 1, '--no-log',
                                            '--repeat', 3, '--json').stdout)
        self.assertTrue(found['hashes_agree'])
        self.assertEqual(os.listdir(self.home), [])

    def start(self, mode):
        """A run until it is stopped."""
        return subprocess.Popen(command('run', MODEL, PROGRAM, '--robot', 'quadruped', mode, '--no-log', '--run', 'stopped', '--json'),
                                cwd=self.home, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def test_one_that_is_interrupted_tells_how_far_it_came(self):
        for mode in ('--inproc', '--isolate'):
            running = self.start(mode)
            listed = await_condition(lambda: as_json('runs')['runs'], 'the run is listed')
            self.assertEqual((listed[0]['run'], listed[0]['log']), ('stopped', None))
            self.assertRegex(morphbus('runs').stdout, r'(?m)^stopped .* none$')
            running.send_signal(signal.SIGINT)
            out, said = running.communicate(timeout=LIMIT)
            self.assertIn(running.returncode, (0, 1), said)
            summary = json.loads(out)
            self.assertIn('interrupted', summary['ended'])
            self.assertAlmostEqual(summary['seconds'], summary['ticks'] * 0.02)
            self.assertRegex(summary['hash'], '^[0-9a-f]{32}$')
            self.assertEqual(os.listdir(self.home), [])

    def test_one_that_fails_names_no_log(self):
        running = self.start('--isolate')
        sim = await_condition(lambda: [pid for pid, text in processes_of('stopped').items() if ' sim ' in text], 'a simulator')
        os.kill(sim[0], signal.SIGKILL)
        out, said = running.communicate(timeout=LIMIT)
        self.assertEqual(running.returncode, 3, said)
        self.assertIn('sim was killed', said)
        self.assertNotRegex(said, '/proc|the log')
        self.assertIsNone(json.loads(out)['log'])
        self.assertEqual(os.listdir(self.home), [])

    def test_where_there_is_no_room_it_says_so(self):
        # The limit of a file's size is that of memory files as well.
        limited = f'ulimit -f 200; exec {" ".join(command("run", MODEL, PROGRAM))} --robot quadruped --seconds 20 --no-log'
        for mode in ('--inproc', '--isolate'):
            done = subprocess.run(['bash', '-c', f'{limited} {mode}'], cwd=self.home, capture_output=True, text=True, timeout=LIMIT)
            self.assertEqual(done.returncode, 3, done.stderr)
            self.assertRegex(done.stderr, r'the run in memory: File too large')
            self.assertNotIn('/proc/', done.stderr)

    def test_options_of_logs_are_refused(self):
        for option, *value in (('--log', 'x.log'), ('--force',)):
            done = self.run_in_home(MODEL, PROGRAM, '--robot', 'quadruped', '--no-log', option, *value, status=2)
            self.assertIn(f'--no-log writes no log: leave out {option}', done.stderr)


if __name__ == '__main__':
    unittest.main()
