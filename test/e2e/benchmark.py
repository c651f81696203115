#!/usr/bin/env python3
"""`morphbus benchmark`: tasks as data, robots at them, and the results that ship.

`Some` does few short rows and what is refused; `All` every row of models/benchmark, which takes many minutes.
"""
import json
import re
import shutil
import tomllib
import subprocess
import unittest

from support import SOURCE, Case, as_json, morphbus

FOLDER = SOURCE / 'models' / 'benchmark'
RESULTS = json.loads((FOLDER / 'results.json').read_text(encoding='utf-8'))
ROBOTS = tomllib.loads((FOLDER / 'robots.toml').read_text(encoding='utf-8'))['robot']
# Rows of a few seconds each; the car is looked at, but not meant to turn on the spot.
SHORT = (('straight', 'train'), ('turn', 'car'), ('lift', 'arm'), ('metre', 'spider'))


def result(task, robot):
    return next(row for row in RESULTS if row['task'] == task and row['robot'] == robot)


class Some(Case):
    def benchmark(self, *arguments, **options):
        return morphbus('benchmark', *arguments, **options)

    def own(self, **files):
        """A folder with tasks of one's own, by name."""
        folder = self.folder / 'tasks'
        folder.mkdir()
        for name, text in files.items():
            (folder / f'{name}.toml').write_text(text, encoding='utf-8')
        return folder

    def test_short_rows_are_as_they_ship(self):
        for task, robot in SHORT:
            rows = as_json('benchmark', FOLDER, '--task', task, '--robot', robot)['rows']
            self.assertEqual(rows, [row for row in RESULTS if row['task'] == task and row['robot'] == robot])

    def test_another_result_than_the_one_that_ships_is_told(self):
        folder = self.folder / 'models'
        shutil.copytree(FOLDER.parent, folder)
        path = folder / 'benchmark' / 'results.json'
        text = path.read_text(encoding='utf-8')
        task, robot = SHORT[0]
        hash_now = result(task, robot)['hash']
        path.write_text(text.replace(hash_now, '0' * 32), encoding='utf-8')
        where = ('benchmark', folder / 'benchmark', '--task', task, '--robot', robot)
        done = morphbus(*where, status=1)
        self.assertIn(f'hash {hash_now}, in results.json', done.stderr)
        self.assertIn('none of another model', morphbus(*where, '--dry-run').stdout)
        # --write puts that right, and nothing else.
        morphbus(*where, '--write')
        self.assertEqual(path.read_text(encoding='utf-8'), text)

    def test_results_of_what_is_another_now_are_told_without_a_run(self):
        folder = self.folder / 'models'
        shutil.copytree(FOLDER.parent, folder)

        def dry(*more, status=0):
            return self.benchmark(folder / 'benchmark', '--robot', 'car', '--dry-run', *more, status=status)

        tasks = [row['task'] for row in RESULTS if row['robot'] == 'car']
        self.assertIn(f'{len(tasks)} runs, none of another', dry().stdout)
        # A comment moves the lines that the program's image names.
        changes = (('programs/car.dyn', '', '// One more line.\n', dict.fromkeys(tasks, ['program'])),
                   ('atron.m3l', 'mass=0.425', 'mass=0.426', dict.fromkeys(tasks, ['model', 'world'])),
                   ('benchmark/slope.sdf', '0.4717', '0.4722', {'slope': ['world']}))
        for name, old, new, expected in changes:
            with self.subTest(changed=name):
                path = folder / name
                text = path.read_text(encoding='utf-8')
                path.write_text(text.replace(old, new, 1), encoding='utf-8')
                others = {row['task']: row['others'] for row in json.loads(dry('--json', status=1).stdout)['rows']}
                self.assertEqual(others, dict.fromkeys(tasks, []) | expected)
                told = dry(status=1)
                path.write_text(text, encoding='utf-8')
                self.assertIn(f'{len(tasks)} runs, {len(expected)} of another', told.stdout)
                for task, inputs in expected.items():
                    self.assertIn(f'{task} of car, car: the {", ".join(inputs)} of results.json ', told.stderr)
        results = folder / 'benchmark' / 'results.json'
        for without in (lambda: results.write_text('[]', encoding='utf-8'), results.unlink):
            without()
            told = dry(status=1)
            self.assertEqual(told.stdout, f'{len(tasks)} runs, none of another model, program or world than in results.json, {len(tasks)} not in it\n')
            self.assertEqual(told.stderr.count('it is not in results.json; --write adds it'), len(tasks))
        self.assertIn('--dry-run runs nothing', dry('--write', status=2).stderr)
        # Of a robot of one's own no results are kept; what cannot run is told as it is before a run.
        own = (folder / 'atron.m3l', folder / 'programs' / 'car.dyn', '--robot')
        self.assertEqual(self.benchmark(FOLDER, *own, 'car', '--task', 'turn', '--dry-run').stdout, '1 run\n')
        self.assertIn("no robot", self.benchmark(FOLDER, *own, 'cra', '--dry-run', status=2).stderr)

    def test_a_robot_of_ones_own_stands_beside_those_that_ship(self):
        model, program = SOURCE / 'models' / 'atron.m3l', SOURCE / 'models' / 'programs' / 'car.dyn'
        done = self.benchmark(FOLDER, model, program, '--robot', 'car', '--task', 'turn', status=1)
        lines = [line for line in done.stdout.splitlines() if line.startswith('  atron: car, car ')]
        self.assertEqual(len(lines), 2, done.stdout)
        # The same program gets the same; who brings a robot means it to meet the task.
        self.assertRegex(lines[0], r'car +no ')
        self.assertRegex(lines[1], r'car +\(no\) ')
        self.assertEqual(lines[0].split()[4:], lines[1].split()[4:])
        for row in RESULTS:
            if row['task'] == 'turn':
                self.assertIn(row['hash'], done.stdout)
        self.assertNotIn('10 m straight', done.stdout)

    def test_a_task_is_a_file(self):
        folder = self.own(creep='title = "a little way"\nseconds = 5\nuntil = "distance >= 5 cm"\n'
                                'met = "distance >= 5 cm and num_faults == 0"\n')
        model, program = SOURCE / 'models' / 'atron.m3l', SOURCE / 'models' / 'programs' / 'car.dyn'
        own = ('benchmark', folder, model, program, '--robot', 'car')
        row = as_json(*own)['rows'][0]
        self.assertTrue(row['met'])
        figures = row['figures']
        self.assertGreaterEqual(figures['distance'], 0.05)
        self.assertLess(figures['seconds'], 5)
        self.assertAlmostEqual(figures['speed'], figures['distance'] / figures['seconds'])
        # The figures are those of the run, which anybody can do: it was told to stop at that tick.
        stop = self.folder / 'stop.commands'
        stop.write_text(f'{round(figures["seconds"] / 0.02) + 1} stop\n', encoding='utf-8')
        run = as_json('run', model, program, '--robot', 'car', '--inproc', '--no-log', '--seconds', 5, '--commands', stop)
        self.assertEqual(run['hash'], row['hash'])
        self.assertAlmostEqual(run['energy'], figures['energy'])
        north, _, east = run['displacement']
        self.assertLess(abs((north * north + east * east) ** 0.5 - figures['distance']), 0.01)
        # What it cannot do is said, with status 1.
        (folder / 'creep.toml').write_text('title = "far"\nseconds = 2\nmet = "distance >= 5 m"\n', encoding='utf-8')
        self.assertIn(' no ', morphbus(*own, status=1).stdout)

    def test_a_push_is_a_share_of_the_weight(self):
        folder = self.own(push='title = "pushed"\nseconds = 4\nmet = "speed_before >= 0"\n[push]\nafter = 1\nseconds = 0.5\n'
                               'direction = "EAST"\nweights = 2\nsettle = 0.5\n')
        model, program = SOURCE / 'models' / 'atron.m3l', SOURCE / 'models' / 'programs' / 'car.dyn'
        figures = as_json('benchmark', folder, model, program, '--robot', 'car')['rows'][0]['figures']
        (folder / 'push.toml').write_text((folder / 'push.toml').read_text().replace('weights = 2', 'weights = 0.001'))
        little = as_json('benchmark', folder, model, program, '--robot', 'car')['rows'][0]['figures']
        self.assertGreater(figures['east'] - little['east'], 0.05, (figures, little))
        self.assertEqual(figures['speed_before'], little['speed_before'])

    def test_mistakes_have_their_place(self):
        car = (SOURCE / 'models' / 'atron.m3l', SOURCE / 'models' / 'programs' / 'car.dyn', '--robot', 'car')
        for text, message in (
                ('title = "a"\nseconds = 5\nmet = "distnace >= 1"\n', "task.toml:3:8: error: there is no figure 'distnace' here"),
                ('title = "a"\nseconds = 5\nuntil = "drift > 1"\nmet = "up > 1"\n', "'drift' is known once the run is over"),
                ('title = "a"\nseconds = 5\nuntil = "drifts > 1"\nmet = "up > 1"\n', "there is no figure 'drifts' here"),
                ('title = "a"\nseconds = 5\nmet = "up > 1"\nworld = "no.sdf"\n', 'task.toml:4:9: error: cannot read '),
                ('title = "a"\nseconds = 0\nmet = "up > 1"\n', 'task.toml:2:11: error: expected a number above 0'),
                ('title = "a"\nseconds = 5\nmet = "up >"\n', 'task.toml:3:'),
                ('title = "a"\nsecond = 5\nmet = "up > 1"\n', "did you mean 'seconds'?"),
                ('title = "a"\nseconds = 5\n', 'a task says when it is met'),
                ('title = "a"\nseconds = 5\nmet = "up > 1"\n[push]\nafter = 1\n', 'a push has after, seconds'),
                ('title = "a"\nseconds = 5\nmet = "up"\n', 'task.toml:3:7: error: expected what is true or false'),
                ('title = "a"\nseconds = 5\nmet = "up + \'a\' > 1"\n', 'task.toml:3:'),
                ('title = "a"\nseconds = 50\nmet = "up > 1"\n[push]\nafter = 1\nseconds = 1\nsettle = 1\nweights = 1\n'
                 'direction = "SIDEWAYS"\n', 'task.toml:9:13: error: direction: expected one of NORTH'),
                ('title = "a', 'task.toml:1:')):
            with self.subTest(text=text):
                shutil.rmtree(self.folder / 'tasks', ignore_errors=True)
                self.assertIn(message, self.benchmark(self.own(task=text), *car, status=2).stderr)
        # A key that is there is not also missed, nor is anything made of its default.
        push = '[push]\nafter = 1\nseconds = 1\nsettle = 1\nweights = 1\ndirection = "UP"\n'
        for old, new in (('title = "a"', 'title = 3'), ('seconds = 50', 'seconds = -5'), ('met = "up > 1"', 'met = true'),
                         ('up > 1', 'up >'), ('weights = 1', 'weights = -1')):
            with self.subTest(now=new):
                shutil.rmtree(self.folder / 'tasks', ignore_errors=True)
                folder = self.own(task=('title = "a"\nseconds = 50\nmet = "up > 1"\n' + push).replace(old, new))
                self.assertEqual(self.benchmark(folder, *car, status=2).stderr.count('error:'), 1)
        # Results that somebody has damaged are refused before anything runs.
        shutil.rmtree(self.folder / 'tasks')
        folder = self.own(task='title = "a"\nseconds = 1\nmet = "up > 1"\n')
        for key, value in (('robot', 5), ('hash', None), ('figures', []), ('meant', 'yes'), ('world_hash', None)):
            (folder / 'results.json').write_text(json.dumps([{**RESULTS[0], key: value}]), encoding='utf-8')
            told = self.benchmark(folder, *car, status=2).stderr
            self.assertIn('a result lacks its task', told)
            self.assertIn('--write makes it anew', told)
        self.assertIn('no task is in it', self.benchmark(self.folder, *car, status=2).stderr)
        self.assertIn("did you mean 'straight'?", self.benchmark(FOLDER, *car, '--task', 'strait', status=2).stderr)
        self.assertIn('a model and a program, or neither', self.benchmark(FOLDER, car[0], status=2).stderr)
        nobody = self.benchmark(FOLDER, '--robot', 'nobody', status=2).stderr
        self.assertIn("no robot of this folder is called 'nobody'", nobody)
        for robot in ROBOTS:
            self.assertIn(robot['robot'], nobody.partition('there are ')[2])
        self.assertIn("did you mean 'crane'?", self.benchmark(FOLDER, '--robot', 'cran', status=2).stderr)
        self.assertIn('its tasks are lift', self.benchmark(FOLDER, '--robot', 'arm', '--task', 'turn', status=2).stderr)
        self.assertIn('of your own', self.benchmark(FOLDER, '--set', 'swing=1', status=2).stderr)

    def test_values_of_two_units_are_not_compared(self):
        car = (SOURCE / 'models' / 'atron.m3l', SOURCE / 'models' / 'programs' / 'car.dyn', '--robot', 'car', '--dry-run')
        for key, expression, column, units in (
                ('met', 'distance > 1 deg', 17, 'in m and in rad'), ('met', 'energy > 3 s', 15, 'in J and in s'),
                ('met', 'abs(turned) > 5 mm', 20, 'in rad and in m'), ('met', 'up > 0 and speed - drift > 0', 25, 'in m/s and in m'),
                ('met', 'num_faults < 3 s', 19, 'without a unit and in s'), ('until', 'distance > 1 deg', 19, 'in m and in rad')):
            with self.subTest(expression=expression):
                folder = self.own(task=f'title = "a"\nseconds = 5\n{key} = "{expression}"\n' + ('met = "up > 1"\n' if key == 'until' else ''))
                self.assertIn(f'task.toml:3:{column}: error: values {units} cannot be compared or added',
                              self.benchmark(folder, *car, status=2).stderr)
                shutil.rmtree(folder)
        self.benchmark(self.own(task='title = "a"\nseconds = 5\nmet = "distance > 2 * spot - 20 mm and speed > distance / seconds"\n'), *car)

    def test_a_setting_of_robots_toml_has_its_place(self):
        folder = self.own(near='title = "near"\nseconds = 1\nmet = "distance >= 0"\n')
        path = folder / 'robots.toml'
        robot = f'\n[[robot]]\nmodel = "{SOURCE}/models/atron.m3l"\nrobot = "car"\nprogram = "{SOURCE}/models/programs/car.dyn"\n'
        for more, message in (('set = ["wsing=1"]', 'set wsing=1: '), ('set = ["swing"]', 'set swing: expected NAME=VALUE'),
                              ('params = "no.toml"', 'params: cannot read ')):
            path.write_text(robot + more, encoding='utf-8')
            self.assertIn(f'error: {path}:2: {message}', self.benchmark(folder, '--dry-run', status=2).stderr)

    def test_rows_are_written_in_one_order_whichever_came_first(self):
        folder = self.own(**{name: f'title = "{name}"\nseconds = 1\nmet = "distance >= 0"\n' for name in ('first', 'second')})
        (folder / 'robots.toml').write_text(
            f'[[robot]]\nmodel = "{SOURCE}/models/atron.m3l"\nrobot = "car"\nprogram = "{SOURCE}/models/programs/car.dyn"\n', encoding='utf-8')
        for task in ('second', 'first'):
            self.benchmark(folder, '--task', task, '--write')
        self.assertEqual([row['task'] for row in json.loads((folder / 'results.json').read_text(encoding='utf-8'))], ['first', 'second'])
        self.benchmark(folder)
        own = (SOURCE / 'models' / 'atron.m3l', SOURCE / 'models' / 'programs' / 'car.dyn', '--robot', 'car', '--write')
        self.assertIn('add your own there', self.benchmark(folder, *own, status=2).stderr)

    def test_what_a_robot_is_meant_to_meet_is_demanded(self):
        folder = self.own(creep='title = "far"\nseconds = 2\nmet = "distance >= 5 m"\n')
        robot = f'[[robot]]\nmodel = "{SOURCE}/models/atron.m3l"\nrobot = "car"\nprogram = "{SOURCE}/models/programs/car.dyn"\n'
        path = folder / 'robots.toml'
        path.write_text(robot, encoding='utf-8')
        done = self.benchmark(folder, status=1)
        self.assertIn(' (no) ', done.stdout)
        self.assertIn('creep of car, car: it is not in results.json', done.stderr)
        path.write_text(robot + 'meets = ["creep"]\n', encoding='utf-8')
        for more in ((), ('--write',)):
            done = self.benchmark(folder, *more, status=1)
            self.assertIn('car does not meet creep', done.stderr)
            self.assertRegex(done.stdout, r' no ')
        (folder / 'other.toml').write_text('title = "near"\nseconds = 2\nmet = "distance >= 0"\n', encoding='utf-8')
        path.write_text(robot + 'tasks = ["other"]\nmeets = ["creep"]\n', encoding='utf-8')
        self.assertIn("robot car meets 'creep', which is not one of its tasks", self.benchmark(folder, status=2).stderr)
        path.write_text(robot + 'meets = ["crawl"]\n', encoding='utf-8')
        self.assertIn("has a task 'crawl', which no file is called by", self.benchmark(folder, status=2).stderr)


def named(robot):
    """The model and the name of a robot of robots.toml, as results.json has them."""
    return robot['model'].rpartition('/')[2].removesuffix('.m3l'), robot['robot']


class Shipped(unittest.TestCase):
    def test_every_robot_of_the_models_is_meant_to_meet_a_task(self):
        there = {(path.stem, robot) for path in (SOURCE / 'models').glob('*.m3l')
                 for robot in re.findall(r'^robot (\w+):', path.read_text(encoding='utf-8'), re.M)}
        meant = {named(robot) for robot in ROBOTS if robot['meets']}
        self.assertEqual(there - meant, set())

    def test_every_robot_meets_what_it_is_meant_to(self):
        for row in RESULTS:
            self.assertRegex(row['hash'] or '', r'^[0-9a-f]{32}$', row)
            self.assertIsNone(row['error'])
            self.assertTrue(row['met'] or not row['meant'], row)
        # The results are those of robots.toml as it is, in its order.
        tasks = sorted(path.stem for path in FOLDER.glob('*.toml') if path.stem != 'robots')
        self.assertEqual([(row['task'], row['model'], row['robot'], row['meant']) for row in RESULTS],
                         [(task, *named(robot), task in robot['meets']) for task in tasks for robot in ROBOTS
                          if task in robot['tasks']])

    def test_the_results_are_of_the_models_programs_and_worlds_as_they_are(self):
        # Here all rows, the long ones too, which only All runs.
        rows = as_json('benchmark', FOLDER, '--dry-run')['rows']
        self.assertEqual([row['others'] for row in rows], [[]] * len(RESULTS))

    def test_the_document_has_the_results(self):
        done = subprocess.run([SOURCE / 'tools' / 'benchmark_table', '--check'], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)


class All(Case):
    def test_all_rows_are_as_they_ship(self):
        rows = as_json('benchmark', FOLDER, timeout=3600)['rows']
        self.assertEqual(rows, RESULTS)


if __name__ == '__main__':
    unittest.main()
