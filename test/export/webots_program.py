#!/usr/bin/env python3
"""Webots worlds whose modules run a program, their sensors, and obstacles in exported worlds: the controllers are built by their own Makefile and
run on a fake Webots of one module. How a whole robot walks by them is test/compiler/emit/webots_vm_test.cc's."""
import math
import random
import re

from support import MODEL, MORPHBUS, SOURCE, Case, export, main, run
from webots_controller import STUB, controller_of
from webots_world import every_node, turn
from wbt import Reader

SENSING = '''module EYED: unit=0.1
point c: (point _1: coords=(1,1,0)) (point _2: coords=(1,0,1)) coords=(1,0,0), connector
link l: grouping=(c), hull=box(size=(2,2,2)) + box(size=(1,1,1), at=(0,2,0))
sensor skin: type=contact, link=l, origin=(0,0,1), direction=(0,0,1)
sensor nose: type=contact, link=l, origin=(0.9,0,1), direction=(0,0,1), range=.2
sensor edge: type=contact, link=l, origin=(-1,-1,0), direction=(-1,-1,0)
sensor corner: type=contact, link=l, origin=(1,1,1), direction=(1,1,1)
sensor up: type=tilt, link=l, origin=(0,0,0), direction=(0,1,0)
sensor ir: type=distance, link=l, origin=(0,0,-1), direction=(0,3,-4), range=5
'''

PROGRAM = '''role Lone extends Module {
  startup begin() {
    print("half {", 0.5, true, -7);
    print("parts", $UP, self.JOINT_2, self.C1);
    self.JOINT_1.SET_POSITION(30);
  }
  behavior fail() {
    var zero = 0;
    print("never", 1 / zero);
  }
}
'''

# What Webots' own file does with the variables of a Makefile, as its head says.
MAKEFILE_INCLUDE = '''
NAME = $(notdir $(CURDIR))
OBJECTS = $(C_SOURCES:.c=.o) $(CXX_SOURCES:.cc=.o)
FLAGS = -O0 -Wall -Wextra -Werror -I. $(if $(USE_C_API),-isystem $(WEBOTS_HOME)/include/controller/c)
release: $(NAME)
$(NAME): $(OBJECTS)
	$(if $(CXX_SOURCES),$(CXX),$(CC)) $^ -L$(WEBOTS_HOME) -lController -lm -o $@
%.o: %.c
	$(CC) -c -O0 -Wall -I. -isystem $(WEBOTS_HOME)/include/controller/c $< -o $@
%.o: %.cc
	$(CXX) -c $(FLAGS) $< -o $@
'''


class Program(Case):
    def webots_home(self):
        """A folder like Webots' own, with our headers and a library of the fake."""
        home = self.folder / 'webots'
        (home / 'resources').mkdir(parents=True)
        (home / 'resources/Makefile.include').write_text(MAKEFILE_INCLUDE)
        (home / 'include/controller').mkdir(parents=True)
        (home / 'include/controller/c').symlink_to(STUB)
        run(['gcc', '-std=gnu99', '-I', STUB, '-c', STUB / 'fake_webots.c', '-o', home / 'fake.o'])
        run(['ar', 'rcs', home / 'libController.a', home / 'fake.o'])
        return home

    def controller(self, program=None):
        """Exports the quadruped with a program and builds its controller."""
        options = [] if program is None else ['--program', program]
        export('webots', self.folder / 'robot.wbt', '--robot', 'quadruped', *options)
        folder = controller_of(self.folder / 'robot.wbt')
        run(['make', '-C', folder, f'WEBOTS_HOME={self.webots_home()}'])
        return folder / folder.name

    def program(self, text, name='lone.dyn'):
        path = self.folder / name
        path.write_text(text)
        return path

    def test_a_controller_runs_the_program_and_tells_of_it(self):
        controller = self.controller(self.program(PROGRAM))
        said = run([controller], env={'STEPS': '60'}).stdout.splitlines()
        self.assertIn('m1: role Lone', said)
        self.assertIn('m1: half { 0.5 true -7', said)
        # In the words of `run`, parts of the module by their names.
        self.assertIn('m1: parts $UP joint_2 c1', said)
        # 30 degrees at the joint's full speed, for no other was asked for.
        at = said.index('position joint_1 0.523599')
        self.assertTrue(said[at - 1].startswith('velocity joint_1 '))
        self.assertIn('m1: line 9: division by zero (asked 0, measured 0, limit 0)', said)
        self.assertEqual(said[-1], 'cleanup')
        # The machine's messages travel over every connector.
        sizes = {int(line.split()[2]) for line in said if line.startswith('send c6.emitter')}
        self.assertTrue(any(size > 90 for size in sizes), sizes)

    def test_a_program_feels_what_touches(self):
        model = self.folder / 'eyed.m3l'
        model.write_text(SENSING)
        program = self.program('role Felt extends Module { startup s() { print("feels", self.contact($EAST), '
                               'self.NOSE.GET_CONTACT()); print("sees", self.IR.GET_DISTANCE()); } }')
        done = export('webots', self.folder / 'robot.wbt', '--module', 'EYED', '--program', program, model=model)
        self.assertNotIn('programs read false', done.stderr)
        folder = controller_of(self.folder / 'robot.wbt')
        run(['make', '-C', folder, f'WEBOTS_HOME={self.webots_home()}'])
        said = run([folder / folder.name], env={'STEPS': '60', 'CUSTOM_DATA': 'id 3 root 0 0 0 0 1 0 0 0'}).stdout
        self.assertIn('m1: feels true true\n', said)
        self.assertIn('m1: sees 125\n', said)

    def test_a_module_without_an_id_runs_nothing(self):
        controller = self.controller(self.program(PROGRAM))
        done = run([controller], status=1, env={'CUSTOM_DATA': ''})
        self.assertIn('this module has no id', done.stderr)

    def test_without_a_program_the_same_makefile_builds_the_controller_that_holds(self):
        said = run([self.controller()]).stdout
        self.assertIn('position joint_1 0.25', said)
        self.assertNotIn('role', said)

    def test_an_image_does_as_well_as_its_text(self):
        text = self.program(PROGRAM)
        image = self.folder / 'lone.dyni'
        run([MORPHBUS, 'compile', text, '--model', MODEL, '-o', image])
        names = []
        for program in (text, image):
            export('webots', self.folder / 'robot.wbt', '--robot', 'quadruped', '--program', program)
            names.append(controller_of(self.folder / 'robot.wbt').name)
        self.assertEqual(names[0], names[1])
        # Another program is another controller, which lies beside the first.
        export('webots', self.folder / 'robot.wbt', '--robot', 'quadruped', '--program',
               self.program(PROGRAM.replace('30', '31'), 'other.dyn'))
        other = controller_of(self.folder / 'robot.wbt')
        self.assertNotEqual(other.name, names[0])
        self.assertTrue((other.parent / names[0]).is_dir())

    def test_what_cannot_be_is_refused(self):
        world = self.folder / 'robot.wbt'
        good = self.program(PROGRAM)
        done = export('urdf', world, '--robot', 'quadruped', '--program', good, status=2)
        self.assertIn('--to urdf runs no program', done.stderr)
        bad = self.program('role R extends Module { startup s() { nonsense(); } }', 'bad.dyn')
        done = export('webots', world, '--robot', 'quadruped', '--program', bad, status=2)
        self.assertIn('bad.dyn:1:', done.stderr)
        done = export('webots', world, '--robot', 'quadruped', '--program', self.folder / 'none.dyn', status=2)
        self.assertIn('none.dyn', done.stderr)
        done = export('webots', good, '--robot', 'quadruped', '--program', good, '--force', status=2)
        self.assertIn('lone.dyn', done.stderr)
        self.assertEqual(good.read_text(), PROGRAM)
        self.assertFalse(world.exists())


class Sensors(Case):
    def export(self, model, *of):
        done = export('webots', self.folder / 'robot.wbt', *of, model=model)
        return (self.folder / 'robot.wbt').read_text(), done.stderr

    def sensors(self, text):
        """{name: (node, the direction of its x in its link)}."""
        found = {}
        for node in every_node(Reader(text).world()):
            if node.type in ('DistanceSensor', 'Accelerometer', 'TouchSensor'):
                *axis, angle = node.get('rotation', [0, 0, 1, 0])
                found[node['name']] = node, turn(axis, angle)[0::4] if angle else [1, 0, 0]
        return found

    def pads(self, sensors, name):
        """[[(least, most) along x, y, z], ...] of what a sensor of touch collides with, in millimetres."""
        node, _ = sensors[f'{name}.sensor']
        self.assertEqual((node.type, node['type']), ('TouchSensor', 'bumper'))
        body = node['boundingObject']
        shapes = [child['geometry'] for child in body['children']] if body.type == 'Group' else [body]
        return [[(round(1000 * min(axis), 6), round(1000 * max(axis), 6)) for axis in zip(*shape['coord']['point'])]
                for shape in shapes]

    def test_they_sit_and_look_as_in_the_model(self):
        model = self.folder / 'eyed.m3l'
        model.write_text(SENSING)
        text, _ = self.export(model, '--module', 'EYED')
        sensors = self.sensors(text)
        self.assertEqual(set(sensors), {f'{name}.sensor' for name in ('skin', 'nose', 'edge', 'corner', 'up', 'ir')})
        node, direction = sensors['ir.sensor']
        self.assertEqual(node.type, 'DistanceSensor')
        self.assertEqual(node['lookupTable'], [[0, 0, 0], [0.5, 0.5, 0]])
        for got, expected in zip(node['translation'] + direction, [0, 0, -0.1, 0, 0.6, -0.8]):
            self.assertTrue(math.isclose(got, expected, abs_tol=1e-9), (node, direction))
        self.assertEqual(sensors['up.sensor'][0].type, 'Accelerometer')
        self.assertNotIn('lookupTable', sensors['up.sensor'][0])
        # A level sensor that is mounted straight tells of the link's own frame.
        self.assertEqual(sensors['up.sensor'][1], [1, 0, 0])

    def test_contacts_are_felt_by_pads_on_the_faces_that_look_there(self):
        model = self.folder / 'eyed.m3l'
        model.write_text(SENSING)
        text, said = self.export(model, '--module', 'EYED')
        sensors = self.sensors(text)
        # Of both parts of the link, 1 mm before their faces.
        self.assertEqual(self.pads(sensors, 'skin'), [[(-100, 100), (-100, 100), (100, 101)],
                                                      [(-50, 50), (150, 250), (50, 51)]])
        # As far as the range goes: 20 mm to each side of x = 90, and no farther than the face; the other part is out of it.
        self.assertEqual(self.pads(sensors, 'nose'), [[(70, 100), (-20, 20), (100, 101)]])
        # Two faces of the box lie at 45 degrees to where it looks.
        (west_down, _), = [self.pads(sensors, 'edge')]
        self.assertEqual([axis[1] for axis in west_down], [100, 100, 100])
        self.assertAlmostEqual(west_down[0][0], -100 - math.sqrt(0.5), places=5)
        # None looks within 45 degrees of a corner's direction.
        self.assertEqual(sensors['corner.sensor'][0]['boundingObject'].type, 'Sphere')
        self.assertIn('contact sensor corner of EYED: no face', said)
        self.assertEqual(said.count('contact sensor'), 1)

    def deviation(self, table, value):
        """The standard deviation of what Webots tells of a value: it interpolates the third column of the table, which
        is in parts of the value (WbLookupTable in its sources)."""
        for (x, a, noise), (next_x, b, next_noise) in zip(table, table[1:]):
            if x <= value <= next_x:
                part = (value - x) / (next_x - x)
                self.assertAlmostEqual(a + part * (b - a), value, places=9)
                return abs(value) * (noise + part * (next_noise - noise))
        raise AssertionError(value)

    def test_noise_is_that_of_the_model(self):
        model = self.folder / 'eyed.m3l'
        model.write_text(SENSING.replace('range=5', 'range=5, noise=.03')
                         .replace('direction=(0,1,0)', 'direction=(0,1,0), noise=.01'))
        sensors = self.sensors(self.export(model, '--module', 'EYED')[0])
        chance = random.Random(1)
        table = sensors['ir.sensor'][0]['lookupTable']
        self.assertEqual((table[0][0], table[-1][0]), (0, 0.5))
        for _ in range(100):
            self.assertAlmostEqual(self.deviation(table, chance.uniform(0.005, 0.5)) / 0.003, 1.025, delta=0.026)
        # A tilt's noise turns it: each component has so much of gravity.
        table = sensors['up.sensor'][0]['lookupTable']
        for value in (chance.uniform(1, 20) * chance.choice((1, -1)) for _ in range(100)):
            self.assertAlmostEqual(self.deviation(table, value) / 0.0981, 1.025, delta=0.026)

    def test_every_sensor_of_the_shipped_models_is_there(self):
        found = 0
        for path in sorted((SOURCE / 'models').glob('*.m3l')):
            source = path.read_text()
            for module in re.findall(r'(?m)^ *module (\w+)', source):
                named = set(re.findall(r'(?m)^ *sensor (\w+): type=(?:distance|tilt|contact)', source))
                text, said = self.export(path, '--module', module)
                sensors = self.sensors(text)
                self.assertEqual(set(sensors), {f'{name}.sensor' for name in named}, path)
                self.assertNotIn('contact sensor', said)
                found += len(sensors)
        self.assertGreater(found, 3)

    def read(self, model, text, **environment):
        """What a controller of the module type says of its sensors."""
        model.write_text(text)
        self.export(model, '--module', 'EYED')
        folder = controller_of(self.folder / 'robot.wbt')
        test = self.folder / 'test.c'
        test.write_text('''#include "morphbus_module.h"
            #include <stdio.h>
            int main(void) {
              module_start(0);
              module_step();
              printf("values %d: skin %g up %g %g %g ir %g\\n", NUM_SENSOR_VALUES, module_sensor(SENSOR_skin),
                     module_sensor(SENSOR_up), module_sensor(SENSOR_up + 1), module_sensor(SENSOR_up + 2),
                     module_sensor(SENSOR_ir));
              return 0;
            }''')
        program = self.folder / 'test'
        run(['gcc', '-std=gnu99', '-Wall', '-Wextra', '-Wpedantic', '-Werror', '-isystem', STUB, '-I', folder, test,
             folder / 'morphbus_module.c', STUB / 'fake_webots.c', '-lm', '-o', program])
        return run([program], env=environment).stdout

    def test_the_wrapper_reads_them(self):
        model = self.folder / 'eyed.m3l'
        self.assertIn('values 8: skin 1 up 0 0.6 0.8 ir 0.125', self.read(model, SENSING))
        # Noise takes no distance beyond what there is.
        for seen, told in (('-0.01', 'ir 0\n'), ('0.6', 'ir 0.5\n')):
            self.assertIn(told, self.read(model, SENSING, DISTANCE=seen))


class Scenery(Case):
    def test_obstacles_stand_where_the_world_has_them(self):
        done = export('webots', self.folder / 'robot.wbt', '--robot', 'quadruped', '--world',
                      SOURCE / 'models/yard.sdf')
        self.assertEqual(done.stderr, '')
        nodes = Reader((self.folder / 'robot.wbt').read_text()).world()
        solids = {node['name']: node for node in nodes if node.type == 'Solid'}
        # SDFormat's z is up, which is y here; what was y looks to the west.
        for name, place, corner in (('wall.link.box', (1, 0.1, 0), (0.05, 0.6, 0.1)),
                                    ('post.link.pole', (-1.2, 0.15, -0.8), (0.05, 0, 0.15)),
                                    ('post.link.knob', (-1.2, 0.35, -0.8), (0, 0, 0.06)),
                                    ('ramp.link.slab', (-1.5, 0, 1), (0.3, 0.25, 0.01))):
            node = solids[name]
            for got, expected in zip(node['translation'], place):
                self.assertTrue(math.isclose(got, expected, abs_tol=1e-9), (name, node['translation']))
            shape, = [child['geometry'] for child in node['children']]
            self.assertIs(node['boundingObject'], shape)
            self.assertTrue(any(all(math.isclose(a, b, abs_tol=1e-9) for a, b in zip(p, corner))
                                for p in shape['coord']['point']), name)
        # The ramp grips in its own way.
        contacts, = nodes[0]['contactProperties']
        self.assertEqual(contacts['material2'], solids['ramp.link.slab']['contactMaterial'])
        self.assertEqual(contacts['coulombFriction'], [1.2])

    def test_a_world_that_cannot_be_is_refused(self):
        for to, world, said in (('urdf', SOURCE / 'models/yard.sdf', 'has no world around the robot'),
                                ('sdf', SOURCE / 'models/mtran.m3l', 'mtran.m3l'),
                                ('mjcf', self.folder / 'none.sdf', 'none.sdf')):
            done = export(to, self.folder / 'out', '--robot', 'quadruped', '--world', world, status=2)
            self.assertIn(said, done.stderr)
            self.assertFalse((self.folder / 'out').exists())

    def test_without_the_robot_the_exported_sdf_is_the_world_again(self):
        export('sdf', self.folder / 'out.sdf', '--robot', 'quadruped', '--world', SOURCE / 'models/yard.sdf')
        text = (self.folder / 'out.sdf').read_text()
        robot = re.search(r'(?s)    <model name="quadruped">.*?\n    </model>\n', text).group()
        (self.folder / 'again.sdf').write_text(text.replace(robot, ''))
        pictures = []
        for world in (SOURCE / 'models/yard.sdf', self.folder / 'again.sdf'):
            run([MORPHBUS, 'draw', MODEL, '--robot', 'quadruped', '--world', world, '-o', self.folder / 'x.svg'])
            pictures.append((self.folder / 'x.svg').read_text())
        self.assertEqual(*pictures)


if __name__ == '__main__':
    main()
