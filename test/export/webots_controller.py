#!/usr/bin/env python3
"""The controller of exported Webots worlds, compiled against Webots' prototypes and run on a stub of them."""
import re

from support import MODEL, SOURCE, Case, export, main, run

STUB = SOURCE / 'test/export/webots_stub'


def controller_of(world):
    """The folder of the only controller of a world, which its modules name."""
    name, = set(re.findall(r'(?m)^  controller "(.*)"$', world.read_text()))
    return world.parent / 'controllers' / name


class Controller(Case):
    def compile(self, *sources, output, of=('--robot', 'quadruped'), model=MODEL):
        """Compiles files of the controller, 'MAIN' its main file, and files of the test's."""
        export('webots', self.folder / 'robot.wbt', *of, model=model)
        folder = controller_of(self.folder / 'robot.wbt')
        sources = [f'{folder.name}.c' if source == 'MAIN' else source for source in sources]
        strict = ['-std=c99', '-Wall', '-Wextra', '-Wpedantic', '-Wconversion', '-Werror']
        system = ['-isystem', STUB, '-I', folder]
        # The stub stands for Webots' own headers and library: our warnings are not for it.
        run(['gcc', '-std=gnu99', '-I', STUB, '-c', STUB / 'fake_webots.c', '-o', self.folder / 'fake.o'])
        run(['gcc', *strict, *system, *(folder / source if isinstance(source, str) else source for source in sources),
             self.folder / 'fake.o', '-lm', '-o', output])
        return folder

    def test_the_controller_holds_the_start_values(self):
        program = self.folder / 'controller'
        self.compile('morphbus_module.c', 'MAIN', output=program)
        said = run([program]).stdout.splitlines()
        devices = {line.split()[1] for line in said if line.startswith('device')}
        text = (self.folder / 'robot.wbt').read_text()
        self.assertEqual(len(devices), 2 * 2 + 3 * 6)
        for device in devices:
            self.assertIn(f'name "{device}"', text)
        self.assertIn('position joint_1 0.25', said)
        self.assertIn('position joint_2 0.25', said)
        self.assertEqual(said[-1], 'cleanup')

    def test_a_module_without_an_id_says_so_once(self):
        program = self.folder / 'controller'
        self.compile('morphbus_module.c', 'MAIN', output=program)
        self.assertEqual(run([program]).stderr, '')
        self.assertEqual(run([program], env={'CUSTOM_DATA': 'id 0'}).stderr, '')
        said = run([program], env={'CUSTOM_DATA': ''}).stderr
        self.assertEqual(said.count('\n'), 1)
        self.assertIn('m1: warning: this module has no id', said)

    def test_the_wrapper_drives_joints_locks_and_talks(self):
        test = self.folder / 'test.c'
        test.write_text('''#include "morphbus_module.h"
            #include <string.h>
            int main(void) {
              char got[8];
              int link;
              double pose[7];
              struct module_reading reading;
              module_start(0);
              if (strcmp(module_name(), "m1") != 0 || module_id() != 3) return 1;
              if (!module_is_root(&link, pose) || link != 1 || pose[0] != 0.5 || pose[5] != -0.5) return 2;
              module_read_connector(CONNECTOR_c6, &reading);
              if (reading.docked || module_sees_mate(CONNECTOR_c6)) return 3;
              if (!module_send(CONNECTOR_c6, "hello", 5)) return 4;
              if (module_send(CONNECTOR_c6, got, MODULE_MAX_MESSAGE + 1)) return 5;
              module_step();
              if (module_time_us() != 4000) return 6;
              /* The echo of our own is passed over, the neighbour's is taken; it holds us, though c6 senses nothing. */
              if (module_receive(CONNECTOR_c6, got, 4) != 4 || memcmp(got, "hell", 4) != 0) return 7;
              if (module_receive(CONNECTOR_c6, got, 8) != -1 || !module_sees_mate(CONNECTOR_c6)) return 8;
              module_read_connector(CONNECTOR_c6, &reading);
              if (!reading.docked || reading.mate_module != 7 || reading.mate_connector != 2) return 9;
              if (reading.number < 1 || reading.number > 4 || reading.is_member_b) return 10; /* (c6, c3): 1 to 4. */
              module_command_joint(JOINT_joint_2, MODULE_POSITION, -0.5, 0.1);
              module_command_joint(JOINT_joint_1, MODULE_POSITION, 0.5, 99);
              module_step();
              if (module_joint(JOINT_joint_2) != -0.5) return 11;
              if (module_joint_velocity(JOINT_joint_2) > -187 || module_joint_velocity(JOINT_joint_2) < -188) return 12;
              if (module_joint_effort(JOINT_joint_2) != -0.5) return 13;
              module_command_joint(JOINT_joint_1, MODULE_HOLD, 0, 0);
              module_command_joint(JOINT_joint_2, MODULE_VELOCITY, 0, -99);
              module_command_connector(CONNECTOR_c3, 0, 1);
              module_command_connector(CONNECTOR_c3, 0, 0);
              return 0;
            }''')
        program = self.folder / 'test'
        self.compile('morphbus_module.c', test, output=program)
        said = run([program]).stdout
        self.assertIn('velocity joint_2 0.1000\nposition joint_2 -0.5\n', said)
        self.assertIn('velocity joint_1 3.1416\nposition joint_1 0.5\n', said)
        self.assertIn('velocity joint_1 3.1416\nposition joint_1 0.5\nposition joint_2 inf\n'
                      'velocity joint_2 -3.1416\nlock c3\nunlock c3\n', said)
        # Each connector says every step who it is, in 6 bytes, with the message if there is one.
        self.assertEqual(said.count('send c6.emitter 11\n'), 1)
        self.assertEqual(said.count('send c6.emitter 6\n'), 1)
        self.assertEqual(said.count('send c1.emitter 6\n'), 2)

    def test_the_wrapper_locks_in_each_setting_in_which_a_connection_holds(self):
        model = self.folder / 'station.m3l'
        model.write_text("""
            module TOWER: unit=0.1
            point top: coords=(0,0,1), connector, normal=(0,0,1), grip=["open","shut","tight"], lid=[bool]
            point side: coords=(1,0,0), connector, normal=(1,0,0), grip=["open","shut","tight"], lid=[bool]
            link foot: grouping=(top, side), mass=1
            axis front: origin=(0,0,0), direction=(0,1,0)
            connection GRIP: members=(TOWER a, TOWER b), conditions=(
              a.point p coincident b.point q and p antiparallel q and a.front parallel b.front
              and (p.grip=="shut" and not p.lid or p.grip=="tight"))""")
        test = self.folder / 'test.c'
        # State 0 is the grip, 1 the lid.
        test.write_text("""#include "morphbus_module.h"
            int main(void) {
              int step, steps[5][2] = {{0, 1}, {1, 0}, {1, 1}, {0, 2}, {0, 0}};
              module_start(0);
              for (step = 0; step < 5; ++step) module_command_connector(CONNECTOR_top, steps[step][0], steps[step][1]);
              return 0;
            }""")
        self.compile('morphbus_module.c', test, output=self.folder / 'test', of=('--module', 'TOWER'), model=model)
        said = run([self.folder / 'test']).stdout
        self.assertEqual([line for line in said.splitlines() if 'lock' in line],
                         ['unlock top', 'lock top', 'unlock top', 'lock top', 'unlock top'])

    def test_a_fixed_joint_has_no_devices(self):
        model = self.folder / 'plate.m3l'
        model.write_text(''.join([
            'module PLATE: unit=1\n',
            *(f'link {name}: (point a: coords=({x},0,0)) (point b: coords=({x + 1},0,0)) (point c: coords=({x},1,0)) '
              f'(point d: coords=({x},0,1)) grouping=(a), hull=convex({name}.point)\n' for x, name in enumerate(('l', 'k', 'm'))),
            'axis x: origin=(0,0,0), direction=(1,0,0)\naxis y: origin=(0,0,0), direction=(-1,0,0)\n',
            'joint hold: type=fixed, pair=((l,x),(k,y))\njoint turn: type=continuous, pair=((k,x),(m,y))\n']))
        self.compile('morphbus_module.c', 'MAIN', output=self.folder / 'controller', of=('--module', 'PLATE'), model=model)
        said = run([self.folder / 'controller']).stdout.splitlines()
        self.assertEqual([line for line in said if line.startswith('device')], ['device turn', 'device turn.sensor'])

    def test_the_wrapper_of_every_module_type_compiles(self):
        bare = self.folder / 'bare.m3l'
        bare.write_text('module BARE: unit=1\nlink l: (point a: coords=(0,0,0)) (point b: coords=(1,0,0)) '
                        '(point c: coords=(0,1,0)) (point d: coords=(0,0,1)) grouping=(a), hull=convex(l.point)\n')
        types = [(str(bare), 'BARE')]
        for model in sorted((SOURCE / 'models').glob('*.m3l')):
            types += [(str(model), name) for name in re.findall(r'(?m)^ *module (\w+)', model.read_text())]
        self.assertGreater(len(types), 5)
        for model, name in types:
            export('webots', self.folder / 'one.wbt', '--module', name, model=model)
            folder = controller_of(self.folder / 'one.wbt')
            for source in ('morphbus_module.c', f'{folder.name}.c'):
                run(['gcc', '-std=c99', '-O2', '-Wall', '-Wextra', '-Wpedantic', '-Wconversion', '-Werror', '-isystem', STUB,
                     '-I', folder, '-c', folder / source, '-o', self.folder / 'c.o'])

    def test_the_wrapper_is_cpp_too(self):
        folder = self.compile('morphbus_module.c', 'MAIN', output=self.folder / 'controller')
        run(['g++', '-x', 'c++', '-Wall', '-Wextra', '-isystem', STUB, '-I', folder, '-c', folder / 'morphbus_module.c',
             '-o', self.folder / 'cpp.o'])


if __name__ == '__main__':
    main()
