#!/usr/bin/env python3
"""`morphbus sweep`: the same rows whoever runs them, however often they are disturbed; and what cannot be used is said."""
import csv
import json
import os
import pathlib
import random
import re
import resource
import shlex
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
import unittest

from support import BIN, LIMIT, SOURCE, as_json, await_condition, command, morphbus
from sweep_case import SweepCase

MODEL = SOURCE / 'models' / 'molecube.m3l'
PROGRAMS = SOURCE / 'models' / 'programs'
ARM = f'model = "{MODEL}"\nprogram = "{PROGRAMS}/arm.dyn"\nrobot = "arm"\n'
SMALL = ARM + 'seconds = 0.2\nfriction = [0.4, 0.8]\nloss = [0, 0.2]\nseeds = [1, 2]\n'
# A run of this length ends on no machine while a test waits.
ENDLESS = 1000000


def children_of(pid):
    """None of a process that has ended."""
    try:
        return [int(child) for task in pathlib.Path(f'/proc/{pid}/task').iterdir() for child in (task / 'children').read_text().split()]
    except OSError:
        return []


def cpu_ticks(pid):
    """Of the processor's time that a process has had, in hundredths of a second."""
    return int(pathlib.Path(f'/proc/{pid}/stat').read_text().rsplit(')', 1)[1].split()[11])


class Rows(SweepCase):
    def test_any_number_of_processes_and_any_interruption_give_the_same_rows(self):
        file = self.sweep_file(SMALL)
        morphbus('sweep', file, '--jobs', 1, '-o', self.database('one'))
        expected = self.rows(self.database('one'))
        self.assertEqual([row['row'] for row in expected], [str(i + 1) for i in range(8)])
        self.assertEqual({row['status'] for row in expected}, {'done'})
        # Of what is lost on the way nothing shows but how much it was.
        self.assertEqual(len({row['hash'] for row in expected}), 2)
        morphbus('sweep', file, '--jobs', 2, '-o', self.database('two'))
        self.assertEqual(self.rows(self.database('two')), expected)
        # Killed at random, ten times over: what is there is whole, and the rest follows.
        moment = random.Random(7)
        for _ in range(10):
            process = self.start(file, '--jobs', '2', '-o', self.database('killed'))
            time.sleep(moment.uniform(0, 0.5))
            process.kill()
            process.communicate()
            if self.database('killed').exists():
                self.assertIn(morphbus('sweep', 'status', self.database('killed'), status=None).returncode, (0, 2))
        morphbus('sweep', file, '--jobs', 2, '-o', self.database('killed'))
        self.assertEqual(self.rows(self.database('killed')), expected)

    def test_nothing_is_run_twice(self):
        file = self.sweep_file(SMALL)
        morphbus('sweep', file, 'seed=1')
        first = {row['key']: row for row in json.loads(morphbus('sweep', 'export', file, '--to', 'json').stdout)}
        self.assertEqual(len(first), 4)
        # Other rows join them, in other places; wall times tell which were run.
        morphbus('sweep', file)
        rows = json.loads(morphbus('sweep', 'export', file, '--to', 'json').stdout)
        self.assertEqual(len(rows), 8)
        self.assertEqual({key for key in first if first[key]['wall_seconds'] == next(r for r in rows if r['key'] == key)['wall_seconds']},
                         set(first))

    def test_a_row_is_a_run(self):
        file = self.sweep_file(SMALL.replace('0.2\n', '1\n', 1))
        morphbus('sweep', file, 'friction=0.4', 'loss=0.2', 'seed=2')
        row, = json.loads(morphbus('sweep', 'export', file, '--to', 'json').stdout)
        again = as_json('sweep', 'rerun', file, 1, '--log', self.folder / 'x.log')
        self.assertTrue(again['same'])
        self.assertEqual(as_json('info', self.folder / 'x.log')['hash'], row['hash'])
        program, *words = shlex.split(again['command'])
        self.assertEqual(program, 'morphbus')
        alone = as_json(*words)
        self.assertEqual(alone['hash'], row['hash'])
        figures = row['figures']
        self.assertEqual([figures[f'displacement.{way}'] for way in ('north', 'up', 'east')], alone['displacement'])
        self.assertEqual(figures['energy'], alone['energy'])
        self.assertEqual(figures['walk.max_tilt_rad'], alone['walk']['max_tilt_rad'])
        self.assertEqual(figures['messages'], alone['messages'])

    def test_variants_run_as_their_file_does(self):
        quadruped = f'model = "{SOURCE}/models/mtran.m3l"\nprogram = "{PROGRAMS}/quadruped.dyn"\nrobot = "quadruped"\nseconds = 0.2\nvariants = 1\n'
        file = self.sweep_file(quadruped)
        morphbus('sweep', file)
        self.assertEqual([row['variant'] for row in self.rows(self.database())], ['quadruped', 'quadruped_variant_1'])
        again = as_json('sweep', 'rerun', file, 2)
        # In so short a time no module takes a role, which is status 1.
        done = subprocess.run(['sh', '-ec', again['command'] + ' --json'], cwd=self.folder, capture_output=True, text=True, check=False,
                              env={**os.environ, 'PATH': f'{BIN}:{os.environ["PATH"]}'})
        self.assertEqual(json.loads(done.stdout)['hash'], again['before'])

    def test_parameters_of_programs_are_axes(self):
        program = self.folder / 'p.dyn'
        program.write_text('param n = 5 in [1, 9];\nrole A extends Module { behavior b() { self.sleepcs(n); } }\n')
        text = f'model = "{MODEL}"\nprogram = "{program}"\nrobot = "arm"\nseconds = 0.2\n[set]\nn = '
        file = self.sweep_file(text + '[3, 5]\n')
        morphbus('sweep', file)
        rows = self.rows(self.database())
        self.assertEqual([row['n'] for row in rows], ['3', '5'])
        self.assertEqual(len({row['hash'] for row in rows}), 2)
        # The same run, alone: its value is that of the source.
        alone = as_json('run', MODEL, program, '--robot', 'arm', '--seconds', 0.2, '--inproc', '--no-log', status=1)
        self.assertEqual(rows[1]['hash'], alone['hash'])
        # A range of whole numbers is one of an int's values, and what the command line says takes the place of the file's.
        morphbus('sweep', self.sweep_file(text + '{from = 1, to = 9, step = 4}\n', 'steps'))
        self.assertEqual([row['n'] for row in self.rows(self.database('steps'))], ['1', '5', '9'])
        morphbus('sweep', self.sweep_file(text + '2\n[[run]]\nset.n = 4\n', 'runs'), 'n=3,5', '-o', self.database('words'))
        self.assertEqual([row['hash'] for row in self.rows(self.database('words'))], [row['hash'] for row in rows])
        for values, words in (('[3, 10]', 'parameter n: 10 is out of its range, 1 to 9'), ('0.5', 'expected an int, 1 to 9')):
            done = morphbus('sweep', self.sweep_file(text + values + '\n', 'bad'), status=2)
            self.assertIn(words, done.stderr)
            self.assertIn(' cannot run: ', done.stderr)
        done = morphbus('sweep', self.sweep_file(SMALL + '[set]\nn = 3\n', 'none'), status=2)
        self.assertIn('the program has none', done.stderr)

    def test_samples_and_lists(self):
        text = ARM + 'seconds = 0.02\nmethod = "latin"\nsamples = 4\nfriction = {from = 0, to = 1}\nseed = {among = [3, 4]}\n' \
            '[[run]]\nloss = 0.1\n[[run]]\nfriction = 0.5\n'
        file = self.sweep_file(text)
        morphbus('sweep', file)
        rows = self.rows(self.database())
        self.assertEqual(len(rows), 8)
        # Each quarter has one sample.
        self.assertEqual(sorted(int(float(row['friction']) * 4) for row in rows[:4]), [0, 1, 2, 3])
        self.assertEqual([(row['friction'], row['loss']) for row in rows[4:]], [('0.5', '')] * 4)
        self.assertLessEqual({row['seed'] for row in rows}, {'3', '4'})
        self.assertEqual(as_json('sweep', file, '--dry-run')['rows'], 8)


class Page(SweepCase):
    def test_it_has_the_best_rows_with_pictures_and_all_rows(self):
        # In a second and with these the arm has gone different ways; of three values of the loss nothing shows.
        file = self.sweep_file(SMALL.replace('0.2\n', '1\n', 1) + '[[expect]]\nsame = "hash"\nover = ["loss", "seed"]\n'
                               '[[expect]]\nthat = "path_length > 1 km"\n')
        morphbus('sweep', file, status=1)
        page = self.folder / 'page.html'
        morphbus('sweep', 'report', file, '-o', page, '--by', 'path_length', '--best', 1)
        text = page.read_text()
        best = max(self.rows(self.database()), key=lambda row: float(row['path_length']))
        self.assertIn(f'<h3>Row {best["row"]}: ', text)
        self.assertEqual(text.count('<img '), 5)
        self.assertIn(f'morphbus sweep rerun {self.database()} {best["row"]} --log', text)
        self.assertRegex(text, r"same hash over loss, seed</td><td class='holds'>")
        self.assertRegex(text, r"path_length &gt; 1 km</td><td class='fails'>")
        data = self.rows_of(page)
        self.assertEqual([column['name'] for column in data['columns'] if column['kind'] == 'input'], ['friction', 'loss', 'seed'])
        self.assertEqual([row['row'] for row in data['rows']], list(range(1, 9)))
        self.assertEqual([row['values'][:3] for row in data['rows'][:2]], [[0.4, 0, 1], [0.4, 0, 2]])
        self.assertAlmostEqual(max(row['goal'] for row in data['rows']), float(best['path_length']), places=6)
        # Without --by the page goes by what the file keeps.
        self.sweep_file(file.read_text() + '[keep]\nbest = 1\nby = "path_length"\nsmallest = true\n')
        morphbus('sweep', file, status=1)
        morphbus('sweep', 'report', file, '-o', page, '--best', 0)
        self.assertEqual((self.rows_of(page)['goal'], self.rows_of(page)['smallest']), ('path_length', True))
        self.assertNotIn('<img ', page.read_text())

    def test_texts_of_a_database_are_no_markup(self):
        program = self.folder / 'a<b>&.dyn'
        program.write_text((PROGRAMS / 'arm.dyn').read_text())
        file = self.sweep_file(f'model = "{MODEL}"\nprogram = ["{program}", "{PROGRAMS}/arm.dyn"]\nrobot = "arm"\nseconds = 0.02\n')
        morphbus('sweep', file)
        page = self.folder / 'page.html'
        morphbus('sweep', 'report', file, '-o', page)
        self.assertNotIn('<b>', page.read_text().replace(re.search(r'<script>.*</script>', page.read_text(), re.S).group(), ''))
        self.assertIn(str(program), [row['values'][0] for row in self.rows_of(page)['rows']])

    def test_without_its_script_it_says_so(self):
        file = self.sweep_file(ARM + 'seconds = [0.02, 0.04]\n')
        morphbus('sweep', file)
        program = self.folder / 'bin' / 'morphbus'
        program.parent.mkdir()
        shutil.copy(BIN / 'morphbus', program)
        page = self.folder / 'page.html'
        subprocess.run([program, 'sweep', 'report', file, '-o', page], check=True, timeout=LIMIT)
        self.assertIn('built without Node.js', page.read_text())
        self.assertIn('<h3>Row ', page.read_text())

    def test_pictures_of_another_run_are_not_shown(self):
        file = self.sweep_file(ARM + 'seconds = 0.02\n')
        morphbus('sweep', file)
        self.alter("UPDATE results SET hash = 'of a run that went another way'")
        page = self.folder / 'page.html'
        morphbus('sweep', 'report', file, '-o', page)
        self.assertIn('no pictures: it goes another way here', page.read_text())
        self.assertNotIn('<img ', page.read_text())

    def test_of_very_many_rows_a_part_is_shown_with_the_best(self):
        file = self.sweep_file(ARM + 'seconds = [0.02, 0.06]\n')
        morphbus('sweep', file)
        # 45,002 rows, as a sweep of that many would have them; of the last one there is more than of the others.
        self.alter('''WITH RECURSIVE n(i) AS (SELECT 3 UNION ALL SELECT i + 1 FROM n WHERE i < 45001)
                      INSERT INTO plan SELECT i, key, json_set(point, '$.seed', i) FROM n, plan WHERE place = 1;
                      INSERT INTO plan SELECT 45002, key, json_set(point, '$.seed', 0) FROM plan WHERE place = 2;
                      DELETE FROM plan WHERE place = 2''')
        page = self.folder / 'page.html'
        morphbus('sweep', 'report', file, '-o', page, '--by', 'ticks', '--best', 1)
        shown = [row['row'] for row in self.rows_of(page)['rows']]
        self.assertEqual(shown, [*range(3, 45002, 3), 45002])
        self.assertIn('one in 3 is shown', page.read_text())
        self.assertIn('<h3>Row 45002: 3</h3>', page.read_text())

    def test_a_database_of_the_version_before_is_read(self):
        file = self.sweep_file(ARM + 'seconds = 0.02\n')
        morphbus('sweep', file)
        self.alter("DELETE FROM meta WHERE name = 'words'")
        self.assertTrue(as_json('sweep', 'rerun', file, 1)['same'])
        morphbus('sweep', 'report', file, '-o', self.folder / 'page.html', '--best', 0)

    def test_what_cannot_be_shown_is_said(self):
        file = self.sweep_file(ARM + 'seconds = 0.02\n')
        page = self.folder / 'page.html'
        self.assertIn('there is no ', morphbus('sweep', 'report', file, '-o', page, status=2).stderr)
        morphbus('sweep', file)
        for words, expected in ((('--by', 'path_lenth'), "there is no figure 'path_lenth'.*did you mean 'path_length'"),
                                (('--by', 'hash'), 'hash is no number'), (('--by', '1 +'), '--by: a value is missing'),
                                (('--smallest',), '--smallest belongs to --by')):
            self.assertRegex(morphbus('sweep', 'report', file, '-o', page, *words, status=2).stderr, expected)
        self.assertFalse(page.exists())
        page.write_text('of somebody else')
        self.assertIn('--force', morphbus('sweep', 'report', file, '-o', page, status=2).stderr)


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


class Binary(SweepCase):
    def program(self, text, name='old'):
        path = self.folder / name
        path.write_text(text)
        path.chmod(0o755)
        return path

    def test_what_is_no_program_for_these_rows_runs_none_of_them(self):
        file = self.sweep_file(SMALL)
        hello = {'hello': 1, 'version': 'another', 'arithmetic': 'x', 'jobs': 1, 'host': 'h'}
        for name, text, expected in (('nothing', None, 'nothing'), ('mute', '#!/bin/sh\necho oh dear >&2\nexit 3\n', r'is no morphbus that runs rows \(oh dear\)'),
                                     ('other', f"#!/bin/sh\necho '{json.dumps(hello)}'\n", 'another')):
            with self.subTest(name):
                path = self.program(text, name) if text else self.folder / name
                self.assertRegex(morphbus('sweep', file, '--binary', path, status=2).stderr, expected)
                self.assertEqual(as_json('sweep', 'status', file)['done'], 0)
        # Its own program by another name runs them, as does the file's.
        own = self.program(f'#!/bin/sh\nexec {shlex.join(map(str, command()))} "$@"\n', 'own')
        self.assertEqual(as_json('sweep', file, '--binary', own)['done'], as_json('sweep', 'status', file)['rows'])
        named = self.sweep_file(f'{SMALL}\n[engine]\nbinary = "{self.folder}/mute"\n', 'named')
        self.assertIn('oh dear', morphbus('sweep', named, status=2).stderr)


class Processor(SweepCase):
    def test_an_old_processor_agrees(self):
        file = self.sweep_file(SMALL)
        morphbus('sweep', file)
        page = (SOURCE / 'docs' / 'sweep.md').read_text(encoding='utf-8')
        script = self.folder / 'old'
        script.write_text(re.search(r'```bash\n(.*?)```', page, re.S)[1])
        script.chmod(0o755)
        # The emulator runs the processes of the sweep and not this machine: there they are, beside the test.
        trace = self.folder / 'trace'
        script.write_text(script.read_text().replace('exec ', f'echo "$@" >>{trace}\nexec ').replace(' morphbus ', f' {shlex.join(map(str, command()))} '))
        agreed = as_json('sweep', 'verify', file, '--sample', 1, '--binary', script)
        self.assertEqual((agreed['agree'], agreed['differ']), (len(self.rows(self.database())), []))
        self.assertIn('sweep worker --fd', trace.read_text())


class Document(SweepCase):
    def test_the_commands_of_the_page_work(self):
        page = (SOURCE / 'docs' / 'sweep.md').read_text(encoding='utf-8')
        (self.folder / 'creep.toml').write_text(re.findall(r'```toml\n(.*?)```', page, re.S)[0])
        (self.folder / 'models').symlink_to(SOURCE / 'models')
        commands, = re.findall(r'```sh\n(.*?)```', page, re.S)
        for line in commands.splitlines():
            morphbus(*shlex.split(line)[1:], cwd=self.folder)
        self.assertEqual(len(list(csv.DictReader((self.folder / 'creep.csv').read_text().splitlines()))), 8)
        query = re.search(r'`sqlite3 creep.sweep.db "(.*?)"`', page).group(1).replace('\\"', '"')
        with sqlite3.connect(self.folder / 'creep.sweep.db') as base:
            self.assertEqual(len(base.execute(query).fetchall()), 8)


if __name__ == '__main__':
    unittest.main()
