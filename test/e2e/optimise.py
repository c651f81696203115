#!/usr/bin/env python3
"""`morphbus optimise`: the same settings whoever runs the candidates and however often that is disturbed, better than those
that there were, and as good as the rows say."""
import json
import math
import random
import re
import shlex
import subprocess
import time
import tomllib
import unittest

from support import LIMIT, SOURCE, Case, as_json, command, end_of, morphbus
from sweep_case import SweepCase

MODELS = SOURCE / 'models'
MODEL = MODELS / 'molecube.m3l'
PROGRAMS = MODELS / 'programs'
# How far the arm's middle goes by how strong and how quick its motors are.
ARM = f'model = "{MODEL}"\nprogram = "{PROGRAMS}/arm.dyn"\nrobot = "arm"\nseconds = 2\n'
FASTER = ARM + 'maximise = "path_length"\npopulation = 6\ngenerations = 4\n[search.MOLECUBE.swivel]\nspeed = {from = 0.2, to = 6}\n' \
    'torque = {from = 0.5, to = 20, log = true}\n'


class Optimise(SweepCase):
    def best(self, name='s'):
        return self.folder / f'{name}.best.toml'

    def by_number(self, file):
        rows = json.loads(morphbus('sweep', 'export', file, '--to', 'json').stdout)
        return {row['row']: row for row in rows}

    def test_it_finds_what_is_better_and_the_file_is_that_run(self):
        file = self.sweep_file(FASTER)
        found = as_json('optimise', file)
        self.assertEqual((found['candidates'], found['generations'], found['stopped']), (24, 4, False))
        best, = found['best']
        self.assertGreater(best['goals'][0], found['shipped']['goals'][0])
        rows = self.by_number(file)
        # Row 1 is as program and model are, 2 the first candidate, which has the same to six digits.
        self.assertEqual(rows[2]['inputs']['MOLECUBE.swivel.speed'], float(f'{math.pi / 3:.6g}'))
        self.assertEqual(rows[2]['inputs']['MOLECUBE.swivel.torque'], 2.9)
        for row in rows.values():
            for name in ('speed', 'torque'):
                value = row['inputs'].get(f'MOLECUBE.swivel.{name}', 1)
                self.assertEqual(value, float(f'{value:.6g}'))
        self.assertEqual(max(row['figures']['path_length'] for row in rows.values()), best['goals'][0])
        alone = as_json('run', MODEL, PROGRAMS / 'arm.dyn', '--robot', 'arm', '--seconds', 2, '--inproc', '--no-log',
                        '--params', self.best())
        self.assertEqual(alone['hash'], rows[best['row']]['hash'])
        self.assertIn('# most path_length: ', self.best().read_text())
        said = morphbus('optimise', file).stdout
        self.assertIn(f'--params {self.best()}', said)
        # The page of a sweep knows what was sought.
        page = self.folder / 'page.html'
        morphbus('sweep', 'report', file, '-o', page, '--best', 1)
        self.assertIn(f'<h3>Row {best["row"]}: ', page.read_text())

    def test_processes_interruptions_and_another_beginning_change_nothing(self):
        one = self.sweep_file(FASTER, 'one')
        morphbus('optimise', one, '--jobs', 1)
        three = self.sweep_file(FASTER, 'three')
        morphbus('optimise', three, '--jobs', 3)
        self.assertEqual(self.best('one').read_bytes(), self.best('three').read_bytes())
        killed = self.sweep_file(FASTER, 'killed')
        moment = random.Random(3)
        for _ in range(3):
            process = subprocess.Popen(command('optimise', killed), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            time.sleep(moment.uniform(0, 0.6))
            end_of(process)
        morphbus('optimise', killed)
        self.assertEqual(self.best('one').read_bytes(), self.best('killed').read_bytes())
        other = self.folder / 'other.db'
        found = as_json('optimise', one, 'search_seed=2', '-o', self.folder / 'other.toml', '--database', other)
        self.assertEqual(found['database'], str(other))
        self.assertNotEqual(self.best('one').read_bytes(), (self.folder / 'other.toml').read_bytes())

    def test_conditions_rule_out(self):
        # The farthest that a limit allows is less than the farthest.
        free = as_json('optimise', self.sweep_file(FASTER, 'free'))['best'][0]['goals'][0]
        bound = self.sweep_file(FASTER.replace('[search', f'subject_to = ["path_length < {free * 0.9}", "num_faults == 0"]\n[search'), 'bound')
        best, = as_json('optimise', bound)['best']
        self.assertEqual(best['broken'], 0)
        self.assertLess(best['goals'][0], free * 0.9)
        # The page tells apart what was allowed.
        page = self.folder / 'page.html'
        morphbus('sweep', 'report', bound, '-o', page, '--best', 0)
        shown = self.rows_of(page)
        self.assertEqual(shown['search'], [{'text': 'path_length', 'smallest': False}])
        rows = self.by_number(bound)
        for row in shown['rows']:
            length = rows[row['row']]['figures']['path_length']
            self.assertEqual(row['allowed'], length < free * 0.9)
            self.assertAlmostEqual(row['goals'][0], length, places=5)
        never = self.sweep_file(FASTER.replace('[search', 'subject_to = "num_faults < 0"\n[search'), 'never')
        done = morphbus('optimise', never, status=1)
        self.assertIn('no candidate fulfils all conditions', done.stderr)
        self.assertFalse(self.best('never').exists())

    def test_two_goals_have_a_front(self):
        text = FASTER.replace('maximise = "path_length"', 'maximise = "path_length"\nminimise = "energy"').replace('population = 6', 'population = 8')
        file = self.sweep_file(text)
        found = as_json('optimise', file)
        goals = sorted(one['goals'] for one in found['best'])
        self.assertGreater(len(goals), 1)
        # Who goes farther needs more.
        self.assertEqual(sorted(energy for _, energy in goals), [energy for _, energy in goals])
        chosen = self.best().read_bytes()
        # The one nearest to the best of both, in parts of what lies between the best and the worst.
        (least, most), (low, high) = ((min(values), max(values)) for values in zip(*goals))
        behind = {one['row']: ((most - one['goals'][0]) / (most - least)) ** 2 + ((one['goals'][1] - low) / (high - low)) ** 2
                  for one in found['best']}
        self.assertEqual(found['picked'], min(behind, key=behind.get))
        self.assertIn(f'row {found["picked"]}', morphbus('optimise', file).stdout.split('(chosen)')[1].splitlines()[0])
        others = {index: as_json('optimise', file, '--pick', index)['picked'] for index in range(1, len(goals) + 1)}
        self.assertEqual(sorted(others.values()), sorted(one['row'] for one in found['best']))
        self.assertTrue(chosen.startswith(b'# Found by morphbus optimise.\n# most path_length: '))
        self.assertIn('--pick: there are', morphbus('optimise', file, '--pick', 1000, status=2).stderr)

    def test_several_runs_of_a_candidate_count_together(self):
        file = self.sweep_file(FASTER.replace('maximise', 'friction = [0.2, 0.9]\nmaximise', 1).replace('generations = 4', 'generations = 1'))
        for of_runs, together in (('mean', lambda values: sum(values) / 2), ('worst', min)):
            best, = as_json('optimise', file, f'of_runs={of_runs}')['best']
            rows = self.by_number(file)
            self.assertEqual(len(rows), 2 * 7)
            of_all = {row: together([rows[row + i]['figures']['path_length'] for i in (0, 1)]) for row in range(3, 15, 2)}
            self.assertEqual(best['goals'][0], max(of_all.values()))
            self.assertEqual(best['row'], max(of_all, key=of_all.get))

    def test_a_restart_begins_elsewhere(self):
        file = self.sweep_file(FASTER)
        found = as_json('optimise', file, 'restarts=1', 'generations=1')
        self.assertEqual((found['candidates'], found['generations']), (12, 2))
        tried = [tuple(row['inputs'][f'MOLECUBE.swivel.{name}'] for name in ('speed', 'torque'))
                 for number, row in self.by_number(file).items() if number > 1]
        self.assertEqual(len(set(tried)), 12)

    def test_settings_of_roles_begin_where_the_program_has_them(self):
        snake = f'model = "{SOURCE}/models/snakes.m3l"\nprogram = "{PROGRAMS}/snake.dyn"\nrobot = "ckbot_snake4"\nseconds = 0.04\n' \
            'maximise = "path_length"\npopulation = 5\ngenerations = 1\n[search]\nlag = {from = 10, to = 170, whole = true}\n' \
            '[search.CkbotUpDown]\nheight_deg = {from = 5, to = 70}\nperiod_s = {from = 0.5, to = 8, log = true}\n'
        file = self.sweep_file(snake)
        morphbus('optimise', file)
        first = self.by_number(file)[2]['inputs']
        self.assertEqual([first[name] for name in ('lag', 'CkbotUpDown.height_deg', 'CkbotUpDown.period_s')], [60, 40, 2])
        self.assertIsInstance(first['lag'], int)

    def test_a_run_that_failed_is_given_up_until_retry(self):
        file = self.sweep_file(FASTER)
        best, = as_json('optimise', file)['best']
        self.alter(f"UPDATE results SET status = 'crashed' WHERE key = (SELECT key FROM plan WHERE place = {best['row']})")
        # What was tried after it follows from it.
        self.assertNotEqual(as_json('optimise', file)['best'][0]['row'], best['row'])
        self.assertEqual(as_json('optimise', file, '--retry')['best'], [best])

    def test_ctrl_c_keeps_what_was_found(self):
        self.assertEqual(as_json('optimise', self.sweep_file(FASTER), '--dry-run')['rows'], 25)
        long = self.sweep_file(FASTER.replace('generations = 4', 'generations = 10000'), 'long')
        process = subprocess.Popen(command('optimise', long, '--json'), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.kill_at_the_end(process)
        limit = time.monotonic() + LIMIT
        done = 0
        while done < 20 and time.monotonic() < limit:
            status = morphbus('sweep', 'status', long, '--json', status=None)
            done = json.loads(status.stdout)['done'] if status.returncode == 0 else 0
        process.terminate()
        out, err = process.communicate(timeout=LIMIT)
        self.assertEqual(process.returncode, 1, err)
        self.assertIn('the same command goes on', err)
        self.assertTrue(json.loads(out)['stopped'])
        self.assertTrue(self.best('long').exists())

    def test_what_is_wrong_is_said(self):
        for old, new, expected in (
                ('path_length', 'path_lenth', r"wrong\d+\.toml:5:13: error: there is no figure 'path_lenth'.*did you mean 'path_length'"),
                ('path_length', 'walk.speed', "there is no figure 'walk.speed'"),
                ('path_length', 'hash', 'hash is no number'),
                ('speed = {', 'sped = {', "has no attribute 'sped'.*did you mean 'speed'"),
                ('to = 20', 'to = 1e12', 'expected 1e-9 to 1e9'),
                ('arm.dyn', 'nothing.dyn', 'nothing.dyn'),
                ('population = 6', 'population = 4', 'expected a whole number, 5 to')):
            with self.subTest(new):
                done = morphbus('optimise', self.sweep_file(FASTER.replace(old, new), f'wrong{abs(hash(new))}'), status=2)
                self.assertRegex(done.stderr.replace('\n', ' '), expected)
        # Ranges are compared with those of the program before anything runs, and so are folders with what there is.
        crawl = f'model = "{MODELS}/mtran_robots.m3l"\nprogram = "{PROGRAMS}/crawler.dyn"\nrobot = "crawler"\nseconds = 1\n' \
            'maximise = "path_length"\ngenerations = 1\n[search]\n'
        for sought, expected in (('swing = {from = 10, to = 170, whole = true}', 'swing: 170 is out of its range, 0 to 60'),
                                 ('period = {from = 0.1, to = 6}', 'period: 0.1 is out of its range, 0.5 to 6'),
                                 ('swing = {from = 10, to = 50}', '(?s)expected an int.*whole = true')):
            with self.subTest(sought):
                file = self.sweep_file(crawl + sought, f'range{abs(hash(sought))}')
                for words in ((), ('--dry-run',)):
                    self.assertRegex(morphbus('optimise', file, *words, status=2).stderr, expected)
                self.assertFalse(file.with_suffix('.sweep.db').exists())
        file = self.sweep_file(FASTER, 'nowhere')
        for folder in ('nowhere', 'x' * 300):
            self.assertRegex(morphbus('optimise', file, '-o', self.folder / folder / 'x.toml', status=2).stderr, 'cannot write .*there is no folder')
        self.assertFalse(file.with_suffix('.sweep.db').exists())
        # Files of the other kind, and what only looks like a file.
        file = self.sweep_file(FASTER)
        self.assertIn('morphbus optimise runs it', morphbus('sweep', file, status=2).stderr)
        self.assertIn('there is nothing to be sought', morphbus('optimise', self.sweep_file(ARM, 'sweep'), status=2).stderr)
        morphbus('optimise', file, 'generations=1')
        self.assertIn('is the database of a sweep', morphbus('optimise', self.database(), status=2).stderr)
        whole = self.database().read_bytes()
        self.database().write_bytes(whole[:len(whole) // 2])
        self.assertRegex(morphbus('optimise', file, status=2).stderr, 'is cut or damaged.*.recover')
        self.database().write_bytes(whole)
        self.alter('PRAGMA user_version = 99')
        self.assertIn('was written by a newer morphbus', morphbus('optimise', file, status=2).stderr)
        taken = self.folder / 'taken.toml'
        taken.write_text('x = 3\n')
        self.assertIn('--force', morphbus('optimise', self.sweep_file(FASTER), '-o', taken, status=2).stderr)
        self.assertEqual(taken.read_text(), 'x = 3\n')


class Shipped(Case):
    """models/tuned: with the settings that were found a robot is quicker than without them, and fulfils what its search demands."""

    def test_settings_are_better_than_none(self):
        tuned = SOURCE / 'models' / 'tuned'
        found = sorted(tuned.glob('*.best.toml'))
        self.assertGreater(len(found), 10)
        for path in found:
            name = path.name.removesuffix('.best.toml')
            # One search is for snakes of all lengths.
            search = tomllib.loads((tuned / f'{name.rstrip("0123456789")}.toml').read_text())
            robot = name if '_snake' in name else search['robot']
            with self.subTest(name):
                run = ('run', tuned / search['model'], tuned / search['program'], '--robot', robot, '--seconds', search['seconds'],
                       '--inproc', '--no-log')
                before, after = as_json(*run), as_json(*run, '--params', path)
                self.assertEqual(after['num_faults'], 0)
                self.assertGreater(self.speed(search, after), 1.15 * self.speed(search, before))
                if name == 'quadruped':
                    self.assertLess(after['walk']['max_tilt_rad'], math.radians(20))

    @staticmethod
    def speed(search, summary):
        north, _, east = summary['displacement']
        return math.hypot(north, east) if search['maximise'].startswith('hypot') else north


class Document(Case):
    def test_the_commands_of_the_page_work(self):
        page = (SOURCE / 'docs' / 'optimise.md').read_text(encoding='utf-8')
        (self.folder / 'faster.toml').write_text(re.findall(r'```toml\n(.*?)```', page, re.S)[0])
        (self.folder / 'models').symlink_to(SOURCE / 'models')
        commands, = re.findall(r'```sh\n(.*?)```', page, re.S)
        for line in commands.splitlines():
            morphbus(*shlex.split(line)[1:], cwd=self.folder)
        self.assertIn('MOLECUBE.swivel.speed', (self.folder / 'faster.best.toml').read_text())


if __name__ == '__main__':
    unittest.main()
