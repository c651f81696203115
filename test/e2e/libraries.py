#!/usr/bin/env python3
"""The installed libraries, as an outsider uses them: found by CMake and by pkg-config, linked, run."""
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

from arithmetic import bindings
from support import BIN, LIMIT, MODEL, PROGRAM, SOURCE, as_json, command, morphbus

BUILD = BIN.parent
LIBRARIES = ('model', 'm3l', 'dynarole', 'vm', 'bus', 'run', 'observe', 'compare', 'view')
# What a header of ours may include: the C++ standard library, and others of ours.
STANDARD = re.compile(r'<[a-z_]+>$')


def run(*parts, status=0, **options):
    """Runs a program, and fails with all that it says unless it ends with `status`."""
    done = subprocess.run([str(part) for part in parts], capture_output=True, text=True, timeout=LIMIT, **options)
    if done.returncode != status:
        raise AssertionError(f'{" ".join(map(str, parts))}\nstatus {done.returncode}, expected {status}\n{done.stdout}\n{done.stderr}')
    return done


class Installed(unittest.TestCase):
    """Everything here sees the installed tree alone, which has been moved since."""

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        run('cmake', '--install', BUILD, '--prefix', cls.folder / 'first')
        cls.prefix = (cls.folder / 'first').rename(cls.folder / 'moved')
        cls.lib = next(cls.prefix.glob('lib/**/libmorphbus-model.so')).parent
        cls.include = cls.prefix / 'include'
        examples = cls.folder / 'examples'
        shutil.copytree(SOURCE / 'examples/cpp', examples)
        run('cmake', '-S', examples, '-B', examples / 'build', f'-DCMAKE_PREFIX_PATH={cls.prefix}', '-DCMAKE_BUILD_TYPE=Release')
        run('cmake', '--build', examples / 'build')
        cls.examples = examples / 'build'

    def test_poses_are_those_of_the_command_line(self):
        printed = run(self.examples / 'print_poses', MODEL, 'quadruped', 'm1.joint_1=0.3').stdout.splitlines()
        links = as_json('fk', MODEL, '--robot', 'quadruped', '--set', 'm1.joint_1=0.3')['links']
        self.assertEqual(len(printed), len(links))
        for line, (name, pose) in zip(printed, links.items()):
            numbers = [f'{value:9.5f}' for value in pose['p']] + [f'{value:7.4f}' for value in pose['q']]
            self.assertEqual(line.split(), [name, *' '.join(numbers[:3]).split(), 'm', *' '.join(numbers[3:]).split()])

    def test_errors_of_a_model_come_with_their_lines(self):
        bad = self.folder / 'bad.m3l'
        bad.write_text(MODEL.read_text().replace('joint ', 'joynt ', 1))
        said = run(self.examples / 'print_poses', bad, 'quadruped', status=2).stderr
        self.assertRegex(said, r'bad\.m3l:\d+:\d+: error: ')
        self.assertIn("did you mean 'quadruped'", run(self.examples / 'print_poses', MODEL, 'quadrupet', status=2).stderr)

    def test_joint_angles_are_those_of_the_log(self):
        log = self.folder / 'walk.log'
        morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--inproc', '--seconds', '4', '--log', log)
        printed = run(self.examples / 'joint_angles', log, 'FrontLeftUpperHalf', 'hip').stdout.splitlines()
        joint = re.match(r'# (\S+) of run', printed[0]).group(1)
        tables = self.folder / 'tables'
        morphbus('convert', log, '--to', 'csv', '-o', tables)
        header, *rows = [line.split(',') for line in (tables / 'joints.csv').read_text().splitlines()]
        column = header.index(f'{joint}.position [rad]')
        logged = {f'{float(row[0]):.2f}': abs(float(row[column])) for row in rows if row[column]}
        self.assertGreater(len(printed), 100)
        for line in printed[1:]:
            time, _, angle, _ = line.split()
            self.assertAlmostEqual(abs(float(angle)), logged[time], places=5)

    def test_members_of_ones_own_take_part_in_a_run(self):
        """A simulator of one's own in the place of Bullet, and a controller of one's own in m1, beside the stock logger and modules."""
        run_key = self.folder / 'walk.key'
        run_key.touch(mode=0o600)
        run_key.write_bytes(os.urandom(16))
        image, kinematics, log = (self.folder / name for name in ('walk.image', 'mtran.kinematics', 'own.log'))
        morphbus('compile', PROGRAM, '--model', MODEL, '-o', image)
        morphbus('export', MODEL, '--module', 'MTRAN', '--to', 'kinematics', '-o', kinematics)
        robot = (MODEL, PROGRAM, 'quadruped', 'walk')
        commands = {
            'simulator': (self.examples / 'own_simulator', *robot, 3, run_key),
            'controller': (self.examples / 'own_controller', *robot, 'm1', run_key),
            'logger': command('log', MODEL, PROGRAM, '--robot', 'quadruped', '--run', 'walk', '-o', log, '--key', run_key)}
        for number in range(1, 9):
            root = ('--root-link', 1, '--root-pose=-0.0325,0,0,1,0,0,0') if number == 4 else ()
            commands[f'm{number + 1}'] = command('module', '--run', 'walk', '--module', f'm{number + 1}', '--id', number, '--kinematics',
                                                 kinematics, '--program', image, '--key', run_key, *root)
        started = {name: subprocess.Popen([str(part) for part in parts], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
                   for name, parts in commands.items()}
        said = {name: process.communicate(timeout=LIMIT)[0] for name, process in started.items()}
        self.assertEqual({name: process.returncode for name, process in started.items()}, dict.fromkeys(commands, 0), said)
        # What the simulator and the logger heard is the same, and whole.
        self.assertIn(as_json('info', log)['hash'], said['simulator'])
        morphbus('verify', log)
        self.assertIn('the run is over: finished', said['controller'])
        # The joint went where the controller said, and the other modules where the program did.
        tables = self.folder / 'own_tables'
        morphbus('convert', log, '--to', 'csv', '-o', tables)
        header, *rows = [line.split(',') for line in (tables / 'joints.csv').read_text().splitlines()]
        most = {joint: max(abs(float(row[header.index(f'{joint}.position [rad]')])) for row in rows) for joint in ('m1.joint_1', 'm2.joint_1')}
        self.assertAlmostEqual(most['m1.joint_1'], 0.52, delta=0.02)
        self.assertGreater(most['m2.joint_1'], 0.1)

    def test_a_run_has_the_hash_of_the_command_line(self):
        """Also where the engine finds the functions of C that the library shows."""
        source = self.folder / 'steps.cc'
        source.write_text('#include <morphbus/m3l/m3l.h>\n#include <morphbus/run/run.h>\n#include <cstdio>\n'
                          'int main(int, char** argv) {\n  const morphbus::Model model = morphbus::CompileM3l(argv[1]);\n'
                          '  morphbus::Run run(model.robot("quadruped"), morphbus::CompileDynaRole(argv[2], model), {.seconds = 4});\n'
                          '  while (!run.over()) run.Step(9);\n  std::puts(run.Close().hash.c_str());\n'
                          '  std::puts(morphbus::ArithmeticFingerprint().c_str());\n}\n')
        run('g++', '-std=c++20', source, '-o', self.folder / 'steps', '-I', self.include, '-L', self.lib, '-lmorphbus-run', '-lmorphbus-m3l',
            '-lmorphbus-dynarole', '-lmorphbus-model', f'-Wl,-rpath-link,{self.lib}')
        printed = run(self.folder / 'steps', MODEL, PROGRAM, env={**os.environ, 'LD_LIBRARY_PATH': str(self.lib)}).stdout.split()
        ran = as_json('run', MODEL, PROGRAM, '--robot', 'quadruped', '--inproc', '--no-log', '--seconds', 4)
        self.assertEqual(printed, [ran['hash'], ran['arithmetic']])
        # The bits of libm may be the same here and not elsewhere: what counts is who is called.
        own = {symbol for user, definer, symbol in bindings(self.folder / 'steps', MODEL, PROGRAM, library_path=str(self.lib))
               if user.startswith('libBullet') and definer.startswith('libmorphbus-run')}
        self.assertLessEqual({'sin', 'cos', 'sincos', 'atan2', 'pow'}, own)

    def test_pkg_config_finds_them(self):
        environment = {**os.environ, 'PKG_CONFIG_PATH': str(self.lib / 'pkgconfig')}
        for name in LIBRARIES:
            flags = run('pkg-config', '--cflags', '--libs', f'morphbus-{name}', env=environment).stdout.split()
            self.assertIn(f'-lmorphbus-{name}', flags)
        run('g++', '-std=c++20', SOURCE / 'examples/cpp/print_poses.cc', '-o', self.folder / 'by_pkg_config',
            *run('pkg-config', '--cflags', '--libs', 'morphbus-m3l', env=environment).stdout.split())
        run(self.folder / 'by_pkg_config', MODEL, 'quadruped', env={**os.environ, 'LD_LIBRARY_PATH': str(self.lib)})

    def test_a_library_that_there_is_not_is_named(self):
        project = self.folder / 'wrong'
        project.mkdir()
        (project / 'CMakeLists.txt').write_text('cmake_minimum_required(VERSION 3.25)\nproject(wrong CXX)\n'
                                                'find_package(Morphbus REQUIRED COMPONENTS modle)\n')
        said = run('cmake', '-S', project, '-B', project / 'build', f'-DCMAKE_PREFIX_PATH={self.prefix}', status=1).stderr
        self.assertRegex(said, r"Morphbus has no library 'modle'; it has\s+model,")

    def test_headers_compile_alone_and_need_nothing_but_the_standard_library(self):
        headers = sorted(path.relative_to(self.include) for path in self.include.rglob('*.h'))
        self.assertGreater(len(headers), 8)
        checks = ('-std=c++20', '-Wall', '-Wextra', '-Wpedantic', '-Werror', '-fsyntax-only', '-I', self.include)
        for header in headers:
            for used in re.findall(r'^#include (\S+)', (self.include / header).read_text(), re.M):
                self.assertTrue(used.startswith('<morphbus/') or STANDARD.match(used), f'{header}: {used}')
            alone = self.folder / 'alone.cc'
            alone.write_text(f'#include <{header}>\nint main() {{}}\n')
            run('g++', *checks, alone)
        if shutil.which('clang++'):
            together = self.folder / 'together.cc'
            together.write_text(''.join(f'#include <{header}>\n' for header in headers) + 'int main() {}\n')
            run('clang++', *checks, together)

    def test_nothing_shows_but_what_the_headers_declare(self):
        # What of ours every program that uses the headers has, too: the type of what is thrown.
        elementary = set(re.findall(r'\w+', next(BUILD.glob('compiler/elementary/exported.list')).read_text()))
        for name in LIBRARIES:
            listed = run('nm', '-D', '--defined-only', '-C', self.lib / f'libmorphbus-{name}.so').stdout
            symbols = [line.split(' ', 2)[2] for line in listed.splitlines() if ' A ' not in line]
            self.assertTrue(symbols, name)
            for symbol in symbols:
                name_of = re.sub(r'\[abi:\w+\]', '', re.split(r'[(@]', symbol)[0])
                if name == 'run' and symbol.split('@')[0] in elementary:
                    continue
                # Classes and functions of the public headers begin with a capital, namespaces of our own do not.
                self.assertRegex(name_of, r'^(typeinfo (name )?for |vtable for )?morphbus::[A-Z]\w*(::~?\w+(=)?)?$', name)

    def test_each_library_loads_no_more_than_it_needs(self):
        needs = {name: run('readelf', '-d', self.lib / f'libmorphbus-{name}.so').stdout for name in LIBRARIES}
        for name, needed in needs.items():
            for other in ('boost', 'sqlite', 'curses', 'tbb'):
                self.assertNotIn(other, needed, name)
            if name != 'run':
                self.assertNotIn('Bullet', needed, name)
            if name not in ('run', 'view'):
                self.assertNotIn('cairo', needed, name)
        for name in ('model', 'm3l', 'dynarole'):
            self.assertNotIn('liblcm', needs[name], name)


if __name__ == '__main__':
    unittest.main()
