#!/usr/bin/env python3
"""`morphbus sweep`: the same rows whoever runs them, however often they are disturbed; and what cannot be used is said."""
import csv
import json
import os
import random
import re
import shlex
import shutil
import sqlite3
import subprocess
import time
import unittest

from support import BIN, LIMIT, SOURCE, as_json, command, end_of, morphbus
from sweep_case import ARM, MODEL, PROGRAMS, SMALL, SweepCase


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
            end_of(process)
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
        # Paths of a file are relative to it, and a name alone is looked for in the PATH.
        named = self.sweep_file(f'{SMALL}\n[engine]\nbinary = "./mute"\n', 'named')
        self.assertIn('oh dear', morphbus('sweep', named, cwd='/', status=2).stderr)
        self.assertIn('oh dear', morphbus('sweep', file, '--binary', './mute', cwd=self.folder, status=2).stderr)
        environment = {**os.environ, 'PATH': f'{self.folder}:{os.environ["PATH"]}'}
        self.assertIn('oh dear', morphbus('sweep', file, '--binary', 'mute', env=environment, status=2).stderr)
        self.assertEqual(as_json('sweep', file, '--binary', 'own', '-o', self.folder / 'own.db', env=environment)['done'], 8)


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
