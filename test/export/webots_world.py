#!/usr/bin/env python3
"""The Webots world: read by two parsers of VRML that are not ours, checked against a table of Webots' nodes and
against the model's kinematics; the controller against Webots' prototypes."""
import collections
import functools
import math
import pathlib
import random
import re
import shutil
import tempfile
import unittest

from support import MODEL, MORPHBUS, SOURCE, Case, export, main, matrix, poses, product, run, run_any
from wbt import JOINTS, SOLIDS, Reader, as_vrml

COIN = MORPHBUS.parent / 'coin_check'


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


def motion(joint, q):
    parameters = joint['jointParameters']
    if joint.type == 'SliderJoint':
        return shift([q * a / math.hypot(*parameters['axis']) for a in parameters['axis']])
    return product(product(shift(parameters['anchor']), turn(parameters['axis'], q)),
                   shift([-a for a in parameters['anchor']]))


def limits_below(node):
    """{joint: (lower, upper)} of a module; as wide as it gets where there are none."""
    found = {}
    for joint in (n for n in every_node([node]) if n.type in JOINTS):
        motor = joint['device'][0]
        found[motor['name']] = (motor.get('minPosition', -math.pi), motor.get('maxPosition', math.pi))
    return found


def links_below(node, X, values, found):
    """Poses of a node's Solids at joint values; what has no value keeps the position in the file."""
    found[node['name']] = X
    for child in node.get('children', []):
        if child.type in SOLIDS:
            links_below(child, product(X, place(child)), values, found)
        if child.type not in JOINTS or child['endPoint'].type == 'SolidReference':
            continue
        parameters = child['jointParameters']
        q = values.get(child['device'][0]['name'], parameters['position']) - parameters['position']
        links_below(child['endPoint'], product(X, product(motion(child, q), place(child['endPoint']))), values, found)
    return found


def connectors_below(node, X):
    for child in node.get('children', []):
        if child.type == 'Connector':
            yield child, product(X, place(child))
        elif child.type in SOLIDS:
            yield from connectors_below(child, product(X, place(child)))
        elif child.type in JOINTS and child['endPoint'].type == 'Solid':
            yield from connectors_below(child['endPoint'], product(X, place(child['endPoint'])))


def hull_points(node, X):
    """Corners of all faces below a node, in the world."""
    found = []
    for child in node.get('children', []):
        if child.type == 'Shape' and child['geometry'].type == 'IndexedFaceSet':
            for x, y, z in child['geometry']['coord']['point']:
                found.append([X[4 * i] * x + X[4 * i + 1] * y + X[4 * i + 2] * z + X[4 * i + 3] for i in range(3)])
        elif child.type in SOLIDS:
            found += hull_points(child, product(X, place(child)))
        elif child.type in JOINTS and child['endPoint'].type == 'Solid':
            found += hull_points(child['endPoint'], product(X, place(child['endPoint'])))
    return found


def every_node(nodes):
    for node in nodes:
        yield node
        for value in node.values():
            if isinstance(value, dict):
                yield from every_node([value])
            elif isinstance(value, list) and value and isinstance(value[0], dict):
                yield from every_node(value)


@functools.cache
def rest_poses(robot, model):
    """Poses of a robot of a model that stays as it is, at its start values."""
    return poses(robot, {}, model)


@functools.cache
def shipped_worlds():
    """(robot, model, text) of all robots that are shipped. They are exported once for all tests: there are many of them."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for model in sorted((SOURCE / 'models').glob('*.m3l')):
            for robot in re.findall(r'(?m)^ *robot (\w+)', model.read_text()):
                found.append((robot, str(model), world_text(pathlib.Path(folder), robot, str(model))))
    return found


def world_text(folder, robot, model):
    """Its text; there is no warning, so all docked faces look at each other."""
    said = export('webots', folder / f'{robot}.wbt', '--robot', robot, model=model).stderr
    mixed = {'crane': 'ATRON', 'sensing_quadruped': '(?:MTRAN|SOLE)'}
    if robot in mixed:
        # Of their two kinds of modules Webots lets faces dock that the model keeps apart, and it is said of which.
        said, count = re.subn(rf'(?m)^morphbus: warning: Webots will let {mixed[robot]}\.\w+ dock to .*\n', '', said)
        if count == 0:
            raise AssertionError(f'{model} {robot}: no warning')
    if said:
        raise AssertionError(f'{model} {robot}: {said}')
    return (folder / f'{robot}.wbt').read_text()


class World(Case):
    def world(self, robot, model=MODEL):
        folder = self.folder / 'worlds'
        folder.mkdir(exist_ok=True)
        return world_text(folder, robot, model)

    def all_worlds(self):
        """Of all robots that are shipped, and one more."""
        yield 'snake', self.snake(), self.world('snake', self.snake())
        yield from shipped_worlds()

    def root_link(self, robot, module, model, links):
        """The link that is the module's Robot node: the one that is no Solid below it."""
        names = {name.partition('.')[2] for name in rest_poses(robot, model) if name.startswith(module + '.')}
        name, = names - links
        return name

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
        for robot, model, text in self.all_worlds():
            self.assertEqual(self.complaints(text), [], f'{model} {robot}')

    def test_damage_is_seen_by_the_parsers_or_the_table(self):
        self.need_parsers()
        text = self.world('quadruped')
        for old, new in (('HingeJoint {', 'HingJoint {'), ('anchor', 'ancor'), ('physics Physics {', 'physics {'),
                         ('isLocked TRUE', 'isLocked YES'), ('mass 0.18', 'mass "0.18"'), ('USE FLOOR', 'USE FLOR'),
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
            expected = rest_poses(robot, model)
            lifts = set()
            for module in (node for node in world if node.type == 'Robot'):
                found = links_below(module, place(module), {}, {})
                root = found.pop(module['name'])
                found[self.root_link(robot, module['name'], model, set(found))] = root
                for link, X in found.items():
                    want = matrix(expected[f'{module["name"]}.{link}'])
                    lift = X[7] - want[7]
                    lifts.add(round(lift, 9))
                    self.assertLess(distance(X, product(shift([0, lift, 0]), want)), 1e-9)
            self.assertEqual(len(lifts), 1)

    def test_the_joints_move_as_the_models_do(self):
        source = random.Random(5)
        alone = self.folder / 'alone.m3l'
        kinds = set()
        # The modules of a type have one subtree of nodes: a few of them tell as much as all.
        tried = collections.Counter()
        for robot, model, text in self.all_worlds():
            for module in (node for node in Reader(text).world() if node.type == 'Robot'):
                values = {joint: round(source.uniform(*limits), 6)
                          for joint, limits in limits_below(module).items()}
                kinds |= {node.type for node in every_node([module]) if node.type in JOINTS}
                found = links_below(module, place(module), values, {})
                # Alone, since loops of the robot would leave the module gaping.
                kind = module['controller'].partition('_')[2].rpartition('_')[0]
                tried[model, kind] += 1
                if tried[model, kind] > 6:
                    continue
                alone.write_text(f'import "{model}"\nrobot alone: modules=({kind} m)\n')
                expected = poses('alone', {f'm.{joint}': q for joint, q in values.items()}, str(alone))
                root = inverse(found.pop(module['name']))
                link = self.root_link(robot, module['name'], model, set(found))
                want_root = inverse(matrix(expected[f'm.{link}']))
                for link, X in found.items():
                    want = product(want_root, matrix(expected[f'm.{link}']))
                    self.assertLess(distance(product(root, X), want), 1e-9, f'{model} {robot} {link}')
        self.assertEqual(kinds, set(JOINTS))

    def test_locked_connectors_meet_mates(self):
        counts = {}
        for robot, _, text in self.all_worlds():
            faces = []
            for module in (node for node in Reader(text).world() if node.type == 'Robot'):
                faces += connectors_below(module, place(module))
            locked = [(c, X) for c, X in faces if c.get('isLocked')]
            self.assertEqual(len(locked), text.count('isLocked TRUE'))
            self.assertLessEqual({c['type'] for c, _ in locked}, {'active', 'symmetric'})
            for connector, X in locked:
                mates = [(c, Y) for c, Y in faces
                         if c is not connector and max(abs(X[i] - Y[i]) for i in (3, 7, 11)) < 1e-6]
                self.assertEqual(len(mates), 1)
                mate, Y = mates[0]
                self.assertEqual(mate['model'], connector['model'])
                self.assertEqual(mate['type'], {'active': 'passive'}.get(connector['type'], 'symmetric'))
                self.assertEqual(mate['numberOfRotations'], connector['numberOfRotations'])
                D = product(inverse(X), Y)
                self.assertAlmostEqual(D[0], -1, delta=1e-9)  # x against x.
                quarters = math.atan2(D[6], D[10]) / (2 * math.pi / connector['numberOfRotations'])
                self.assertAlmostEqual(quarters, round(quarters), delta=1e-6)
            counts[robot] = len(locked)
        self.assertEqual(counts['quadruped'], 10)

    def test_modules_are_told_what_their_controllers_cannot_sense(self):
        for robot, model, text in self.all_worlds():
            modules = [node for node in Reader(text).world() if node.type == 'Robot']
            roots = 0
            for index, module in enumerate(modules):
                words = module['customData'].split()
                self.assertEqual(words[:2], ['id', str(index)])
                emitters = [node for node in every_node([module]) if node.type == 'Emitter']
                self.assertGreater(len(emitters), 0)
                for emitter in emitters:
                    self.assertEqual((emitter['translation'], emitter['range']), ([0, 0, 0.002], 0.01))
                if len(words) == 2:
                    continue
                roots += 1
                self.assertEqual(words[2], 'root')
                # By the order of fk, which is that of the model.
                links = [name for name in rest_poses(robot, model) if name.startswith(module['name'] + '.')]
                x, y, z, w, a, b, c = map(float, words[4:])
                want = matrix(rest_poses(robot, model)[links[int(words[3])]])
                self.assertLess(distance(matrix(((x, y, z), (w, a, b, c))), want), 1e-9)
            self.assertEqual(roots, 1, robot)

    def test_numbers_of_turns_are_the_models(self):
        for robot, _, text in self.all_worlds():
            turns = {node['numberOfRotations'] for node in every_node(Reader(text).world()) if node.type == 'Connector'}
            self.assertEqual(turns, {1} if robot.startswith('car') and 'ATRON' in text else {4}, robot)

    def test_the_camera_sees_the_whole_robot(self):
        for robot, _, text in self.all_worlds():
            world = Reader(text).world()
            view, = (node for node in world if node.type == 'Viewpoint')
            *axis, angle = view['orientation']
            R = turn(axis, angle)
            points = []
            for node in (n for n in world if n.type == 'Robot'):
                points += hull_points(node, place(node))
            middle = [(min(p[i] for p in points) + max(p[i] for p in points)) / 2 for i in range(3)]
            self.assertGreater(view['position'][1], 0)
            self.assertGreater(R[6], 0.5, 'the camera stands upright: its z is up, which is y here')
            seen = 0
            for p in [middle, *points]:
                to = [a - b for a, b in zip(p, view['position'])]
                x, y, z = (sum(R[4 * i + j] * to[i] for i in range(3)) for j in range(3))
                self.assertGreater(x, 0)
                # Webots' angle of view, 45 degrees, is across the width; a picture of 16:9.
                self.assertLess(abs(y) / x, math.tan(math.pi / 8))
                self.assertLess(abs(z) / x, math.tan(math.pi / 8) * 9 / 16)
                seen = max(seen, math.hypot(y, z) / x)
            self.assertGreater(seen, 0.05, 'not from the moon')

    def test_modules_may_be_called_floor(self):
        path = self.folder / 'floor.m3l'
        path.write_text(f'import "{MODEL}"\nrobot f: modules=(MTRAN floor, MTRAN FLOOR), '
                        'connections=((floor.c2,FLOOR.c5))\n')
        world = Reader(self.world('f', str(path))).world()
        names = [node['name'] for node in world if node.type in SOLIDS]
        self.assertEqual(sorted(names), ['FLOOR', 'floor', 'floor_'])

    def test_limits_that_webots_cannot_hold_are_reported(self):
        path = self.folder / 'slide.m3l'
        path.write_text((SOURCE / 'models/mixed.m3l').read_text().replace('value=[0, 2]', 'value=[0.5, 2]')
                        .replace('import "mtran.m3l"', f'import "{MODEL}"'))
        said = export('webots', self.folder / 'slide.wbt', '--robot', 'inchworm', model=str(path)).stderr
        self.assertIn('warning: Webots takes limits only on either side of 0: slide of TELESCOPE is left without '
                      'its own, 0.01625 to 0.065 m', said)
        self.assertEqual(said.count('warning'), 1)

    def test_limits_without_stops_are_reported(self):
        path = self.folder / 'far.m3l'
        path.write_text((SOURCE / 'models/molecube.m3l').read_text().replace('value=[-2*pi/3, 2*pi/3]', 'value=[-4, 1]'))
        said = export('webots', self.folder / 'far.wbt', '--robot', 'snake', model=str(path)).stderr
        self.assertEqual(said, 'morphbus: warning: Webots has stops only within half a turn of 0: swivel of MOLECUBE is '
                               'kept to its limits, -4 to 1 rad, by its motor alone\n')
        text = (self.folder / 'far.wbt').read_text()
        self.assertIn('minPosition -4', text)
        self.assertNotIn('Stop', text)

    def test_turns_that_webots_allows_beyond_the_models_are_reported(self):
        # As M-TRAN, but that c4 docks with _1 on _1 or on _3 only, in two turns.
        text = pathlib.Path(MODEL).read_text().partition('// m5 is the junction')[0]
        for old, new in (('gender="male"', 'gender="male", few=false'),
                         ('gender="female"', 'gender="female", few=false'),
                         ('(p_a._1 coincident p_b.point)', '(p_a._1 coincident p_b.point) and ((p_a.few == false and '
                          'p_b.few == false) or p_a._1 coincident p_b._1 or p_a._1 coincident p_b._3)')):
            self.assertIn(old, text)
            text = text.replace(old, new)
        text += 'robot r: modules=(MTRAN a, MTRAN b), connections=((a.c2,b.c5))\n'
        path = self.folder / 'few.m3l'
        path.write_text(text.replace('few=false, extended=false', 'few=true, extended=false', 1))
        said = export('webots', self.folder / 'r.wbt', '--robot', 'r', model=str(path)).stderr
        self.assertEqual(said, 'morphbus: warning: Webots will let MTRAN.c1 dock to MTRAN.c4 in 4 turns, '
                               'the model has 2\n')
        # Two turns for all are two turns in Webots too.
        path.write_text(text.replace('few=false', 'few=true'))
        self.assertIn('numberOfRotations 2', self.world('r', str(path)))

    def test_files_lie_where_webots_looks(self):
        self.world('quadruped')
        controller, = (self.folder / 'controllers').iterdir()
        self.assertRegex(controller.name, '^morphbus_MTRAN_[0-9a-f]{8}$')
        self.assertEqual(sorted(p.name for p in controller.iterdir()),
                         ['Makefile', f'{controller.name}.c', 'morphbus_module.c', 'morphbus_module.def', 'morphbus_module.h'])
        export('webots', self.folder / 'flat.wbt', '--robot', 'quadruped')
        self.assertTrue((self.folder / 'flat.wbt').exists())

    def test_worlds_of_unlike_models_keep_their_controllers(self):
        text = pathlib.Path(MODEL).read_text()
        fewer = self.folder / 'fewer.m3l'
        fewer.write_text(text.replace('extended == true', 'extended == false'))
        self.assertNotEqual(fewer.read_text(), text)

        def controllers_of(path):
            return set(re.findall(r'(?m)^  controller "(.*)"$', path.read_text()))

        first = self.folder / 'first.wbt'
        export('webots', first, '--robot', 'quadruped')
        before = {p: p.read_bytes() for p in (self.folder / 'controllers').glob('*/*')}
        second = self.folder / 'second.wbt'
        export('webots', second, '--module', 'MTRAN', model=str(fewer))
        third = self.folder / 'third.wbt'
        export('webots', third, '--robot', 'equivalent_quadruped')
        self.assertEqual(controllers_of(first), controllers_of(third))
        self.assertFalse(controllers_of(first) & controllers_of(second))
        self.assertEqual({p: p.read_bytes() for p in before}, before)
        self.assertEqual({p.name for p in (self.folder / 'controllers').iterdir()},
                         controllers_of(first) | controllers_of(second))


if __name__ == '__main__':
    main()
