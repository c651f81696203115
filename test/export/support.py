"""What the tests of exported files share: the program, the model, scratch folders, finding tools."""
import json
import os
import pathlib
import random
import shutil
import subprocess
import sys
import tempfile
import unittest

SOURCE = pathlib.Path(os.environ['MORPHBUS_SOURCE'])
MORPHBUS = pathlib.Path(os.environ['MORPHBUS_BIN']) / 'morphbus'
MODEL = str(SOURCE / 'models/mtran.m3l')
ROBOTS = ('quadruped', 'equivalent_quadruped')

# Robots that the shipped model lacks: without loops, with start values.
SNAKE = f'''import "{MODEL}"
robot snake: modules=(MTRAN m1, MTRAN m2, MTRAN m3), connections=((m1.c2,m2.c5), (m2.c2,m3.c5)),
  joints=(m1.joint_1=pi/6, m2.joint_2=-0.3)
'''


def run_any(command):
    """What becomes of a command of any program."""
    return subprocess.run([str(word) for word in command], text=True, capture_output=True, timeout=120)


def run(command, status=0, **options):
    """Runs a program; its status must be `status`. Returns the finished process, output as text."""
    done = subprocess.run([str(word) for word in command], text=True, capture_output=True, timeout=120, **options)
    if done.returncode != status:
        raise AssertionError(f'{" ".join(map(str, command))}: status {done.returncode}, expected {status}\n'
                             f'{done.stdout}{done.stderr}')
    return done


def export(to, output, *of, model=MODEL, status=0):
    return run([MORPHBUS, 'export', model, '--to', to, '-o', output, *of], status)


def poses(robot, values, model=MODEL):
    """Link poses by the library: {link: (position, quaternion w x y z)}."""
    settings = [word for name, q in values.items() for word in ('--set', f'{name}={q!r}')]
    answer = json.loads(run([MORPHBUS, 'fk', model, '--robot', robot, '--json', *settings]).stdout)
    return {name: (pose['p'], pose['q']) for name, pose in answer['links'].items()}


def matrix(pose):
    """A pose as 12 numbers, 3 x 4, row by row."""
    (x, y, z), (w, a, b, c) = pose
    return [1 - 2 * (b * b + c * c), 2 * (a * b - c * w), 2 * (a * c + b * w), x,
            2 * (a * b + c * w), 1 - 2 * (a * a + c * c), 2 * (b * c - a * w), y,
            2 * (a * c - b * w), 2 * (b * c + a * w), 1 - 2 * (a * a + b * b), z]


def product(a, b):
    """a * b of poses as `matrix` makes them."""
    return [sum(a[4 * row + k] * b[4 * k + column] for k in range(3)) + (a[4 * row + 3] if column == 3 else 0)
            for row in range(3) for column in range(4)]


def joints_of(modules):
    return [f'm{m}.joint_{j}' for m in range(1, modules + 1) for j in (1, 2)]


def random_values(modules, seed):
    source = random.Random(seed)
    # Single precision, as the generated code takes them.
    return {name: round(source.uniform(-1.57, 1.57), 4) for name in joints_of(modules)}


def need(*tools):
    """Skips the test, naming what is missing, unless all programs are there."""
    missing = [tool for tool in tools if shutil.which(tool) is None]
    if missing:
        raise unittest.SkipTest(f'{", ".join(missing)} not installed (tools/setup --cross)')


class Case(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix='morphbus-export-')
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def snake(self):
        path = self.folder / 'snake.m3l'
        path.write_text(SNAKE)
        return str(path)


def main():
    """Like unittest.main, but says on ctest's behalf (status 77) if everything was skipped."""
    program = unittest.main(exit=False, verbosity=2)
    result = program.result
    if not result.wasSuccessful():
        sys.exit(1)
    sys.exit(77 if result.testsRun and len(result.skipped) == result.testsRun else 0)
