#!/usr/bin/env python3
"""Webots worlds whose modules run a program, their sensors, and obstacles in exported worlds: the controllers are built by their own Makefile and
run on a fake Webots of one module. How a whole robot walks by them is test/compiler/emit/webots_vm_test.cc's."""
import math
import re

from support import MODEL, MORPHBUS, SOURCE, Case, export, main, run
from webots_world import STUB, controller_of, every_node, turn
from wbt import Reader

SENSING = '''module EYED: unit=0.1
point c: (point _1: coords=(1,1,0)) (point _2: coords=(1,0,1)) coords=(1,0,0), connector
link l: grouping=(c), hull=box(size=(2,2,2))
sensor skin: type=contact, link=l, origin=(0,0,1), direction=(0,0,1)
sensor up: type=tilt, link=l, origin=(0,0,0), direction=(0,1,0)
sensor ir: type=distance, link=l, origin=(0,0,-1), direction=(0,3,-4), range=5
'''

PROGRAM = '''role Lone extends Module {
  startup begin() {
    print("half {", 0.5, true, -7);
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
        # 30 degrees at the joint's full speed, for no other was asked for.
        at = said.index('position joint_1 0.523599')
        self.assertTrue(said[at - 1].startswith('velocity joint_1 '))
        self.assertIn('m1: line 8: division by zero (asked 0, measured 0, limit 0)', said)
        self.assertEqual(said[-1], 'cleanup')
        # The machine's messages travel over every connector.
        sizes = {int(line.split()[2]) for line in said if line.startswith('send c6.emitter')}
        self.assertTrue(any(size > 90 for size in sizes), sizes)

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
            if node.type in ('DistanceSensor', 'Accelerometer'):
                *axis, angle = node.get('rotation', [0, 0, 1, 0])
                found[node['name']] = node, turn(axis, angle)[0::4] if angle else [1, 0, 0]
        return found

    def test_they_sit_and_look_as_in_the_model(self):
        model = self.folder / 'eyed.m3l'
        model.write_text(SENSING)
        text, said = self.export(model, '--module', 'EYED')
        self.assertIn('contact sensor skin of EYED is not in the world', said)
        sensors = self.sensors(text)
        self.assertEqual(set(sensors), {'up.sensor', 'ir.sensor'})
        node, direction = sensors['ir.sensor']
        self.assertEqual(node.type, 'DistanceSensor')
        self.assertEqual(node['lookupTable'], [[0, 0, 0], [0.5, 0.5, 0]])
        for got, expected in zip(node['translation'] + direction, [0, 0, -0.1, 0, 0.6, -0.8]):
            self.assertTrue(math.isclose(got, expected, abs_tol=1e-9), (node, direction))
        self.assertEqual(sensors['up.sensor'][0].type, 'Accelerometer')
        # A level sensor that is mounted straight tells of the link's own frame.
        self.assertEqual(sensors['up.sensor'][1], [1, 0, 0])

    def test_every_sensor_of_the_shipped_models_is_there(self):
        found = 0
        for path in sorted((SOURCE / 'models').glob('*.m3l')):
            source = path.read_text()
            for module in re.findall(r'(?m)^ *module (\w+)', source):
                named = set(re.findall(r'(?m)^ *sensor (\w+): type=(?:distance|tilt)', source))
                sensors = self.sensors(self.export(path, '--module', module)[0])
                self.assertEqual(set(sensors), {f'{name}.sensor' for name in named}, path)
                found += len(sensors)
        self.assertGreater(found, 3)

    def test_the_wrapper_reads_them(self):
        model = self.folder / 'eyed.m3l'
        model.write_text(SENSING)
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
        self.assertIn('values 5: skin 0 up 0 0.6 0.8 ir 0.125', run([program]).stdout)


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
