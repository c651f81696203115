#!/usr/bin/env python3
"""What may go wrong with a sweep: runs that fail, crash or hang, disks that are full, expectations that do not hold, files that
say what cannot be."""
import json
import os
import pathlib
import re
import resource
import shlex
import signal
import sqlite3
import subprocess
import sys
import unittest

from support import LIMIT, as_json, await_condition, command, morphbus
from sweep_case import ARM, ENDLESS, SMALL, SweepCase, children_of, cpu_ticks


class Failures(SweepCase):
    def test_a_run_that_crashes_or_hangs_is_its_rows_failure(self):
        file = self.sweep_file(ARM + f'seconds = [0.1, {ENDLESS}, 0.2]\n')
        process = self.start(file, '--jobs', '1')
        self.await_done(self.database(), 1)
        worker, = children_of(process.pid)
        os.kill(worker, signal.SIGKILL)
        _, errors = process.communicate(timeout=LIMIT)
        self.assertEqual(process.returncode, 3, errors)
        self.assertEqual([row['status'] for row in self.rows(self.database())], ['done', 'crashed', 'done'])
        self.assertIn('killed by signal 9', self.rows(self.database())[1]['error'])
        # The others are done, so that the limit meets this one alone.
        morphbus('sweep', file, '--retry', '--timeout', '1', status=3)
        rows = as_json('sweep', 'missing', file, status=1)['missing']
        self.assertEqual([(row['row'], row['status'], row['error']) for row in rows], [(2, 'timeout', 'it was not done after 1 s')])
        # Without --retry it stays so.
        morphbus('sweep', file, status=3)

    def test_ctrl_c_leaves_whole_rows(self):
        file = self.sweep_file(ARM + f'seconds = [0.1, {ENDLESS}]\n')
        process = self.start(file, '--jobs', '1', start_new_session=True)
        self.await_done(self.database(), 1)
        workers = children_of(process.pid)
        # Who stops a job may tell its processes one after the other: a run goes on until the sweep itself ends it.
        worker, = workers
        before = cpu_ticks(worker)
        os.kill(worker, signal.SIGTERM)
        os.kill(worker, signal.SIGINT)
        await_condition(lambda: process.poll() is not None or children_of(process.pid) != workers or cpu_ticks(worker) > before + 20,
                        'the run goes on, or not')
        self.assertIsNone(process.poll(), 'a process ended its run')
        self.assertEqual(children_of(process.pid), workers)
        # As a terminal does it: all processes of the sweep get it.
        os.killpg(process.pid, signal.SIGINT)
        output, errors = process.communicate(timeout=LIMIT)
        self.assertEqual((process.returncode, 'the same command goes on' in errors), (1, True), output + errors)
        self.assertEqual([row['status'] for row in self.rows(self.database())], ['done', 'missing'])
        self.assertFalse([worker for worker in workers if pathlib.Path(f'/proc/{worker}').exists()])

    def test_it_waits_for_whoever_reads(self):
        file = self.sweep_file(ARM + 'seconds = 0.02\n')
        morphbus('sweep', file)
        reader = sqlite3.connect(self.database(), isolation_level=None)
        self.addCleanup(reader.close)
        reader.execute('BEGIN')
        self.assertEqual(reader.execute('SELECT count(*) FROM plan').fetchone(), (1,))
        process = self.start(file, 'seeds=1,2,3')

        # Who waits for readers to end lets no new one begin. Within this process, which reads already, one could.
        read = f'import sqlite3; sqlite3.connect({str(self.database())!r}, timeout=0).execute("SELECT count(*) FROM plan").fetchone()'

        def waits():
            done = subprocess.run([sys.executable, '-c', read], capture_output=True, text=True, timeout=LIMIT, check=False)
            return process.poll() is not None or 'database is locked' in done.stderr
        await_condition(waits, 'it waits')
        self.assertIsNone(process.poll(), 'it did not wait')
        reader.execute('COMMIT')
        output, errors = process.communicate(timeout=LIMIT)
        self.assertEqual(process.returncode, 0, output + errors)
        self.assertEqual([row['status'] for row in self.rows(self.database())], ['done'] * 3)

    def test_only_one_writes(self):
        file = self.sweep_file(ARM + f'seconds = [0.1, {ENDLESS}]\n')
        self.start(file, '--jobs', '1')
        self.await_done(self.database(), 1)
        self.assertIn('another sweep is writing', morphbus('sweep', file, status=2).stderr)

    def test_a_full_disk_loses_nothing(self):
        # Many rows, whose figures need more room than what it takes to run them.
        file = self.sweep_file(ARM + f'seconds = 0.02\nfriction = [0.4, 0.8]\nseeds = {list(range(1, 17))}\n')
        morphbus('sweep', file)
        expected = self.rows(self.database())
        room = self.database().stat().st_size - 12288

        def little_room():
            # Beyond the limit writing fails as on a full disk. That the signal does not kill is morphbus' own doing.
            signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
            resource.setrlimit(resource.RLIMIT_FSIZE, (room, room))

        # Also for what runs keep in memory, which is less here.
        full = self.database('full')
        done = subprocess.run(command('sweep', file, '--jobs', '1', '-o', full), capture_output=True, text=True, timeout=LIMIT,
                              preexec_fn=little_room, check=False)
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertRegex(done.stderr, f'cannot write {full}: .*what was written before is whole')
        morphbus('sweep', file, '-o', full)
        self.assertEqual(self.rows(full), expected)

    def test_a_database_that_is_none_is_named(self):
        file = self.sweep_file(ARM + 'seconds = 0.02\n')
        morphbus('sweep', file)
        whole = self.database().read_bytes()
        def fails(content, expected):
            self.database().write_bytes(content)
            for words in (('status', file), ('export', file, '--to', 'csv'), (file,)):
                self.assertRegex(morphbus('sweep', *words, status=2).stderr, expected)
        fails(whole[:len(whole) // 2], r'cut or damaged.*\.recover')
        fails(whole[:50], r'cut or damaged')
        fails(b'no database, but a text of some length\n' * 10, r'cut or damaged|something else')
        # The version of the tables is at 60, the application at 68 (SQLite's file format).
        fails(whole[:60] + (99).to_bytes(4, 'big') + whole[64:], r'newer morphbus \(its tables are of version 99')
        fails(whole[:68] + bytes(4) + whole[72:], r'a database of something else')
        self.database().unlink()
        self.assertIn('there is no ', morphbus('sweep', 'status', file, status=2).stderr)

    def test_verify_finds_a_row_that_differs(self):
        file = self.sweep_file(ARM + 'seconds = 0.02\nseeds = [1, 2, 3]\n')
        morphbus('sweep', file)
        self.assertEqual(as_json('sweep', 'verify', file, '--sample', 1)['agree'], 3)
        with sqlite3.connect(self.database()) as base:
            base.execute("UPDATE results SET hash = 'f' WHERE key = (SELECT key FROM plan WHERE place = 2)")
        verdict = as_json('sweep', 'verify', file, '--sample', 1, status=1)
        self.assertEqual([row['row'] for row in verdict['differ']], [2])
        morphbus('sweep', 'rerun', file, 2, status=1)
        morphbus('sweep', 'rerun', file, 1)


class Expectations(SweepCase):
    def test_what_does_not_hold_is_status_1_with_the_commands(self):
        good = '[[expect]]\nthat = "num_faults == 0 and status == \'done\'"\n[[expect]]\nsame = "hash"\nover = ["loss", "seeds"]\n'
        file = self.sweep_file(SMALL + good)
        self.assertTrue(all(one['holds'] for one in as_json('sweep', file)['expectations']))
        bad = '[[expect]]\nsame = "hash"\nover = ["friction"]\n[[expect]]\nthat = "gait.forward_m > 1 mm"\nwhere = "seed == 2"\n'
        self.sweep_file(SMALL + bad)
        friction, gait = as_json('sweep', file, status=1)['expectations']
        self.assertEqual([one['row'] for one in friction['failures']], [5, 6, 7, 8])
        # There is no gait in so short a time.
        self.assertEqual([(one['row'], one['why']) for one in gait['failures']],
                         [(row, 'it is not known: gait.forward_m is not known') for row in (2, 4, 6, 8)])
        first = friction['failures'][0]
        # In so short a time no module takes a role, which is status 1.
        alone = as_json(*shlex.split(first['command'])[1:], status=1)
        self.assertEqual(alone['hash'], self.rows(self.database())[4]['hash'])
        self.assertIn(first['command'], morphbus('sweep', file, status=1).stdout)

    def test_one_that_is_about_no_row_fails(self):
        file = self.sweep_file(ARM + 'seconds = 0.02\n[[expect]]\nthat = "num_faults == 0"\nwhere = "friction > 0.5"\n')
        # Of the run's own friction nothing is said.
        self.assertIn("there is no figure 'friction'", morphbus('sweep', file, status=2).stderr)
        self.sweep_file(ARM + 'seconds = 0.02\nfriction = 0.5\n[[expect]]\nthat = "num_faults == 0"\nwhere = "friction > 0.5"\n')
        done = morphbus('sweep', file, status=1)
        self.assertIn('FAILS: num_faults == 0 (where friction > 0.5) (it is about no row)', done.stdout)

    def test_one_that_cannot_be_computed_loses_no_rows(self):
        file = self.sweep_file(ARM + 'seconds = 0.02\n[[expect]]\nthat = "displacement.nrth > 0"\n')
        done = morphbus('sweep', file, status=2)
        self.assertIn('1 of 1 row done', done.stderr)
        self.assertRegex(done.stderr, r"expect: .*there is no figure 'displacement.nrth'")
        self.assertEqual([row['status'] for row in self.rows(self.database())], ['done'])

    def test_logs_are_kept_of_the_best(self):
        file = self.sweep_file(SMALL.replace('0.2\n', '1\n', 1).replace('loss = [0, 0.2]\nseeds = [1, 2]\n', '')
                               + 'keep = {best = 1, by = "path_length"}\n')
        log, = as_json('sweep', file)['logs']
        best = max(self.rows(self.database()), key=lambda row: float(row['path_length']))
        self.assertEqual(as_json('info', log)['hash'], best['hash'])
        # It is kept once.
        self.assertEqual(as_json('sweep', file)['logs'], [])

    def test_logs_are_kept_of_the_smallest_and_of_what_failed(self):
        file = self.sweep_file(ARM + f'seconds = [0.1, 0.2, {ENDLESS}]\nkeep = {{best = 1, by = "seconds", smallest = true, failed = true}}\n')
        process = self.start(file, '--jobs', '1', '--json')
        self.await_done(self.database(), 2)
        worker, = children_of(process.pid)
        os.kill(worker, signal.SIGKILL)
        # It is run again for its log, and has none if it is killed again.
        await_condition(lambda: list(self.database().with_suffix('.logs').glob('row-3-*.partial')), 'the log is begun')
        worker, = children_of(process.pid)
        os.kill(worker, signal.SIGKILL)
        output, errors = process.communicate(timeout=LIMIT)
        self.assertEqual(process.returncode, 3, errors)
        logs = json.loads(output)['logs']
        self.assertEqual([as_json('info', log)['hash'] for log in logs], [self.rows(self.database())[0]['hash']])

    def test_by_what_is_no_number_none_is_best(self):
        file = self.sweep_file(ARM + 'seconds = 0.02\nkeep = {best = 1, by = "hash"}\n')
        self.assertIn('keep: hash is no number', morphbus('sweep', file, status=2).stderr)


class WrongFiles(SweepCase):
    def test_what_is_wrong_has_its_place(self):
        for line, text, expected in (
                (5, 'frction = 0.8', "a sweep has no 'frction'.*did you mean 'friction'"),
                (5, 'friction = []', 'the list is empty'),
                (5, 'friction = [0.1, 0.1]', '0.1 stands in the list twice'),
                (5, 'friction = "high"', 'expected a number'),
                (5, 'friction = {from = 1, to = 0, step = 1}', 'expected more than 1'),
                (5, 'friction = {from = 0, to = 1}', 'of this samples are drawn'),
                (5, 'friction = {frm = 0, to = 1}', "did you mean 'from'"),
                (5, 'friction = {from = 0, to = 1, step = 1e-9}', 'more than 1000000 values'),
                (5, 'friction = {from = 0, to = 1, count = 3, log = true}', 'no logarithm'),
                (5, 'loss = 20', 'expected a fraction'),
                (5, 'seed = -1', 'expected a whole number'),
                (5, 'method = "latn"', "did you mean 'latin'"),
                (5, 'method = "latin"', 'nothing to draw'),
                (5, 'seed = 1\nseeds = [2]', "'seed' was said already"),
                (5, 'keep = {best = 3}', "'best' and 'by' belong together"),
                (6, '[[expect]]\nthat = "gait.forward_m >= 3 furlongs"', "no unit 'furlongs'"),
                (6, '[[expect]]\nthat = "abs(gait.forward_m) >= 3 deg"', 'values in m and in rad cannot be compared'),
                (6, '[[expect]]\nthat = "gaits.forward_m >= 3"', "there is no figure 'gaits.forward_m'.*did you mean 'gait'"),
                (7, '[[expect]]\nsame = "hash"\nover = ["sed"]', "no axis 'sed'"),
                (5, '[[run]]\nfriction = [1, 2]', 'one value of each'),
                (5, 'friction = 0.8 0.9', ''),
                (5, 'friction = 1979-05-27', 'expected a number, a text')):
            with self.subTest(text):
                done = morphbus('sweep', self.sweep_file(ARM + 'seconds = 1\n' + text + '\n'), status=2)
                self.assertRegex(done.stderr, re.compile(rf'^{self.folder}/s\.toml:\d+:\d+: error: ', re.M))
                self.assertRegex(done.stderr, re.compile(expected, re.S))
                if not text.startswith(('[[run', 'seed = 1')):
                    self.assertIn(f's.toml:{line}:', done.stderr)
        self.assertFalse(self.database().exists())

    def test_what_no_run_can_be_told_is_refused_with_its_row(self):
        for text, expected in (('friction = [0.5, 11]', '--friction: expected 0 to 10'), ('root = "m99"', "no module 'm99'"),
                               ('world = "nowhere.sdf"', 'nowhere.sdf')):
            done = morphbus('sweep', self.sweep_file(ARM + 'seconds = 1\n' + text), status=2)
            self.assertIn(expected, done.stderr)
            self.assertRegex(done.stderr, r'row \d of \d cannot run: .*' + re.escape(text.split()[0]))
        self.assertFalse(self.database().exists())
        done = morphbus('sweep', self.sweep_file(ARM.replace('arm.dyn', 'nothing.dyn') + 'seconds = 1\n'), status=2)
        self.assertIn('nothing.dyn', done.stderr)

    def test_words_of_the_command_line_have_their_place_too(self):
        file = self.sweep_file(ARM + 'seconds = 1\n')
        for word, expected in (('frction=', 'expected NAME=VALUES'), ('friction=a', 'command line:1:10: error: expected a number'),
                               ('friction=1..0:1', 'expected more than 1'), ('seed=1..9', 'of this samples are drawn')):
            self.assertIn(expected, morphbus('sweep', file, word, status=2).stderr)
        self.assertIn('the variants of a robot run all', morphbus('sweep', file, 'variant=3', status=2).stderr)
        self.assertIn("there is no engine 'slrm'", morphbus('sweep', file, '--engine', 'slrm', status=2).stderr)
        self.assertIn("there is no command 'statsu' (did you mean 'status'?)", morphbus('sweep', 'statsu', file, status=2).stderr)
        self.assertEqual(as_json('sweep', file, 'friction=0.1..0.3:0.1', 'seed=1,2', '--dry-run')['axes'], {'friction': 3, 'seed': 2})
        # What the processes of a sweep are started with is nobody else's business.
        self.assertNotIn('worker', morphbus('sweep', '--help').stdout)
        # Options may stand first.
        self.assertEqual(as_json('sweep', '--dry-run', file, 'seed=1,2')['rows'], 2)

    def test_a_database_is_no_file_of_a_sweep(self):
        file = self.sweep_file(ARM + 'seconds = 0.02\n')
        morphbus('sweep', file)
        self.assertRegex(morphbus('sweep', self.database(), status=2).stderr, 'is the database of a sweep.*morphbus sweep status ')


if __name__ == '__main__':
    unittest.main()
