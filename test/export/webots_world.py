#!/usr/bin/env python3
"""The Webots world: read by two parsers of VRML that are not ours, checked against a table of Webots' nodes and
against the model's kinematics; the controller against Webots' prototypes."""
import math
import random
import re
import shutil
import subprocess
import unittest

from support import MODEL, MORPHBUS, ROBOTS, SOURCE, Case, export, main, matrix, poses, run
from wbt import SOLIDS, Reader, as_vrml

COIN = MORPHBUS.parent / 'coin_check'
STUB = SOURCE / 'test/export/webots_stub'


def product(A, B):
    """Of two poses, each 12 numbers, 3 x 4 row by row."""
    return [sum(A[4 * i + k] * B[4 * k + j] for k in range(3)) + (A[4 * i + 3] if j == 3 else 0)
            for i in range(3) for j in range(4)]


def inverse(A):
    R = [[A[4 * j + i] for j in range(3)] for i in range(3)]
    return [x for i in range(3) for x in (*R[i], -sum(R[i][k] * A[4 * k + 3] for k in range(3)))]


def turn(axis, angle):
    half = math.sin(angle / 2) / math.hypot(*axis)
    return matrix(((0, 0, 0), (math.cos(angle / 2), *(half * a for a in axis))))


def shift(p):
    return [1, 0, 0, p[0], 0, 1, 0, p[1], 0, 0, 1, p[2]]


def place(node):
    *axis, angle = node.get('rotation', [0, 0, 1, 0])
    return product(shift(node.get('translation', [0, 0, 0])), turn(axis, angle))


def distance(A, B):
    return max(abs(a - b) for a, b in zip(A, B))


def links_below(node, X, values, found):
    """Poses of a node's Solids at joint values; what has no value keeps the position in the file."""
    found[node['name']] = X
    for child in node.get('children', []):
        if child.type in SOLIDS:
            links_below(child, product(X, place(child)), values, found)
        if child.type != 'HingeJoint' or child['endPoint'].type == 'SolidReference':
            continue
        parameters = child['jointParameters']
        motor = child['device'][0]['name']
        q = values.get(motor, parameters['position']) - parameters['position']
        hinge = product(product(shift(parameters['anchor']), turn(parameters['axis'], q)),
                        shift([-a for a in parameters['anchor']]))
        links_below(child['endPoint'], product(X, product(hinge, place(child['endPoint']))), values, found)
    return found


def connectors_below(node, X):
    for child in node.get('children', []):
        if child.type == 'Connector':
            yield child, product(X, place(child))
        elif child.type in SOLIDS:
            yield from connectors_below(child, product(X, place(child)))
        elif child.type == 'HingeJoint' and child['endPoint'].type == 'Solid':
            yield from connectors_below(child['endPoint'], product(X, place(child['endPoint'])))


def every_node(nodes):
    for node in nodes:
        yield node
        for value in node.values():
            if isinstance(value, dict):
                yield from every_node([value])
            elif isinstance(value, list) and value and isinstance(value[0], dict):
                yield from every_node(value)


class World(Case):
    def world(self, robot, model=MODEL):
        path = self.folder / 'worlds' / f'{robot}.wbt'
        path.parent.mkdir(exist_ok=True)
        said = export('webots', path, '--robot', robot, model=model)
        self.assertEqual(said.stderr, '')
        return path.read_text()

    def all_worlds(self):
        yield 'snake', self.snake(), self.world('snake', self.snake())
        for robot in ROBOTS:
            yield robot, MODEL, self.world(robot)

    def complaints(self, text):
        """Of the other parsers; empty if both take the world."""
        path = self.folder / 'world.wrl'
        path.write_text(as_vrml(text))
        found = []
        for command in ([COIN, path], ['tovrmlx3d', path]):
            done = run_any(command)
            if done.returncode != 0 or done.stderr.strip():
                found.append(f'{command[0]}: {done.stderr.strip() or done.returncode}')
        return found

    def need_parsers(self):
        if not COIN.exists() or shutil.which('tovrmlx3d') is None:
            raise unittest.SkipTest('libcoin-dev or view3dscene not installed (tools/setup)')

    def test_two_other_parsers_read_it(self):
        self.need_parsers()
        for robot, _, text in self.all_worlds():
            self.assertEqual(self.complaints(text), [], robot)

    def test_every_robot_that_is_shipped_is_read(self):
        self.need_parsers()
        for model in sorted((SOURCE / 'models').glob('*.m3l')):
            for robot in re.findall(r'(?m)^ *robot (\w+)', model.read_text()):
                text = self.world(robot, str(model))  # Without a warning: all docked faces look at each other.
                Reader(text).world()
                self.assertEqual(self.complaints(text), [], f'{model} {robot}')

    def test_damage_is_seen_by_the_parsers_or_the_table(self):
        self.need_parsers()
        text = self.world('quadruped')
        for old, new in (('HingeJoint {', 'HingJoint {'), ('anchor', 'ancor'), ('physics Physics {', 'physics {'),
                         ('isLocked TRUE', 'isLocked YES'), ('mass 0.18', 'mass "0.18"'), ('USE HULL', 'USE HUL'),
                         ('coordinateSystem "NUE"', 'coordinateSystem NUE'), ('children [', 'children {')):
            self.assertIn(old, text)
            damaged = text.replace(old, new, 1)
            self.assertNotEqual(self.complaints(damaged), [], new)
            with self.assertRaises((ValueError, KeyError, IndexError)):
                Reader(damaged).world()

    def test_it_starts_as_webots_wants(self):
        for _, _, text in self.all_worlds():
            self.assertTrue(text.startswith('#VRML_SIM R2023b utf8\n'))
            world = Reader(text).world()
            self.assertEqual(world[0].type, 'WorldInfo')
            self.assertEqual(world[0]['coordinateSystem'], 'NUE')

    def test_faces_bodies_and_names_are_sound(self):
        for _, _, text in self.all_worlds():
            world = Reader(text).world()
            for node in every_node(world):
                if node.type == 'IndexedFaceSet':
                    corners = len(node['coord']['point'])
                    self.assertEqual(node['coordIndex'][-1], -1)
                    self.assertTrue(all(-1 <= i < corners and i == int(i) for i in node['coordIndex']))
                if 'physics' in node:
                    self.assertIsNotNone(node.get('boundingObject'))
                    physics = node['physics']
                    self.assertEqual(physics['density'], -1)
                    self.assertGreater(physics['mass'], 0)
                    (x, y, z), _ = physics['inertiaMatrix']
                    self.assertTrue(x + y >= z and y + z >= x and x + z >= y)
            for robot in (node for node in world if node.type == 'Robot'):
                devices = [node['name'] for node in every_node([robot])
                           if 'name' in node and node.type not in ('Robot', 'Solid')]
                self.assertEqual(len(devices), len(set(devices)))
                self.assertNotIn(':', robot['name'])

    def test_the_modules_stand_where_the_model_has_them(self):
        for robot, model, text in self.all_worlds():
            world = Reader(text).world()
            expected = poses(robot, {}, model)
            lifts = set()
            for module in (node for node in world if node.type == 'Robot'):
                found = links_below(module, place(module), {}, {})
                found['active_block'] = found.pop(module['name'])
                for link, X in found.items():
                    want = matrix(expected[f'{module["name"]}.{link}'])
                    lift = X[7] - want[7]
                    lifts.add(round(lift, 9))
                    self.assertLess(distance(X, product(shift([0, lift, 0]), want)), 1e-9)
            self.assertEqual(len(lifts), 1)

    def test_the_joints_move_as_the_models_do(self):
        source = random.Random(5)
        for robot, model, text in self.all_worlds():
            for module in (node for node in Reader(text).world() if node.type == 'Robot'):
                values = {f'joint_{j}': round(source.uniform(-1.5, 1.5), 6) for j in (1, 2)}
                found = links_below(module, place(module), values, {})
                name = module['name']
                expected = poses(robot, {f'{name}.{joint}': q for joint, q in values.items()}, model)
                root = inverse(found.pop(name))
                want_root = inverse(matrix(expected[f'{name}.active_block']))
                for link, X in found.items():
                    want = product(want_root, matrix(expected[f'{name}.{link}']))
                    self.assertLess(distance(product(root, X), want), 1e-9)

    def test_locked_connectors_meet_mates(self):
        for _, _, text in self.all_worlds():
            faces = []
            for robot in (node for node in Reader(text).world() if node.type == 'Robot'):
                faces += connectors_below(robot, place(robot))
            locked = [(c, X) for c, X in faces if c.get('isLocked')]
            self.assertEqual(len(locked), text.count('isLocked TRUE'))
            self.assertEqual({c['type'] for c, _ in locked}, {'active'})  # The hooks are on one side.
            for connector, X in locked:
                mates = [(c, Y) for c, Y in faces
                         if c is not connector and max(abs(X[i] - Y[i]) for i in (3, 7, 11)) < 1e-6]
                self.assertEqual(len(mates), 1)
                mate, Y = mates[0]
                self.assertEqual((mate['type'], mate['model']), ('passive', connector['model']))
                D = product(inverse(X), Y)
                self.assertAlmostEqual(D[0], -1, delta=1e-9)  # x against x.
                quarters = math.atan2(D[6], D[10]) / (2 * math.pi / connector['numberOfRotations'])
                self.assertAlmostEqual(quarters, round(quarters), delta=1e-6)
        self.assertEqual(len(locked), 10)

    def test_files_lie_where_webots_looks(self):
        self.world('quadruped')
        controllers = self.folder / 'controllers/morphbus_MTRAN'
        self.assertEqual(sorted(p.name for p in controllers.iterdir()),
                         ['Makefile', 'morphbus_MTRAN.c', 'morphbus_module.c', 'morphbus_module.h'])
        export('webots', self.folder / 'flat.wbt', '--robot', 'quadruped')
        self.assertTrue((self.folder / 'flat.wbt').exists())


def run_any(command):
    return subprocess.run([str(word) for word in command], text=True, capture_output=True, timeout=120)


class Controller(Case):
    def compile(self, *sources, output):
        export('webots', self.folder / 'robot.wbt', '--robot', 'quadruped')
        folder = self.folder / 'controllers/morphbus_MTRAN'
        strict = ['-std=c99', '-Wall', '-Wextra', '-Wpedantic', '-Wconversion', '-Werror']
        system = ['-isystem', STUB, '-I', folder]
        # The stub stands for Webots' own headers and library: our warnings are not for it.
        run(['gcc', '-std=gnu99', '-I', STUB, '-c', STUB / 'fake_webots.c', '-o', self.folder / 'fake.o'])
        run(['gcc', *strict, *system, *(folder / source if isinstance(source, str) else source for source in sources),
             self.folder / 'fake.o', '-o', output])
        return folder

    def test_the_controller_holds_the_start_values(self):
        program = self.folder / 'controller'
        self.compile('morphbus_module.c', 'morphbus_MTRAN.c', output=program)
        said = run([program]).stdout.splitlines()
        devices = {line.split()[1] for line in said if line.startswith('device')}
        text = (self.folder / 'robot.wbt').read_text()
        self.assertEqual(len(devices), 2 * 2 + 3 * 6)
        for device in devices:
            self.assertIn(f'name "{device}"', text)
        self.assertIn('position joint_1 0.25', said)
        self.assertIn('position joint_2 0.25', said)
        self.assertEqual(said[-1], 'cleanup')

    def test_the_wrapper_drives_joints_locks_and_talks(self):
        test = self.folder / 'test.c'
        test.write_text('''#include "morphbus_module.h"
            #include <string.h>
            int main(void) {
              char got[8];
              module_start();
              if (strcmp(module_name(), "m1") != 0) return 1;
              module_set_joint(JOINT_joint_2, -0.5, 0.1);
              if (module_joint(JOINT_joint_2) != -0.5) return 2;
              module_set_joint(JOINT_joint_1, 0.5, 99);
              if (module_is_locked(CONNECTOR_c3)) return 3;
              module_set_lock(CONNECTOR_c3, 1);
              if (!module_is_locked(CONNECTOR_c3)) return 4;
              module_set_lock(CONNECTOR_c3, 0);
              if (module_is_locked(CONNECTOR_c3)) return 5;
              if (module_receive(CONNECTOR_c6, got, 8) != -1) return 6;
              if (!module_send(CONNECTOR_c6, "hello", 5)) return 7;
              if (module_send(CONNECTOR_c6, got, MODULE_MAX_MESSAGE + 1)) return 8;
              /* The echo of our own is passed over, the neighbour's is taken. */
              if (module_receive(CONNECTOR_c6, got, 4) != 4 || memcmp(got, "hell", 4) != 0) return 9;
              return module_receive(CONNECTOR_c6, got, 8) == -1 ? 0 : 10;
            }''')
        program = self.folder / 'test'
        self.compile('morphbus_module.c', test, output=program)
        said = run([program]).stdout
        self.assertIn('velocity joint_2 0.1000\nposition joint_2 -0.5\n', said)
        self.assertIn('velocity joint_1 3.1416\nposition joint_1 0.5\n', said)
        self.assertIn('send c6.emitter 8\n', said)

    def test_the_wrapper_is_cpp_too(self):
        folder = self.compile('morphbus_module.c', 'morphbus_MTRAN.c', output=self.folder / 'controller')
        run(['g++', '-x', 'c++', '-Wall', '-Wextra', '-isystem', STUB, '-I', folder, '-c', folder / 'morphbus_module.c',
             '-o', self.folder / 'cpp.o'])


if __name__ == '__main__':
    main()
