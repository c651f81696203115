#!/usr/bin/env python3
"""The generated C: on the host against the library, on an emulated Cortex-M and an AVR against both."""
import re
import subprocess

from support import MODEL, Case, export, main, matrix, need, poses, random_values, run

FLAGS = ['-std=c99', '-Wall', '-Wextra', '-Wpedantic', '-Wconversion', '-Wdouble-promotion', '-Werror']
ARM = ['arm-none-eabi-gcc', '-mcpu=cortex-m3', '-mthumb', '-Os', *FLAGS]
AVR_GCC = ['avr-gcc', '-mmcu=atmega128', '-DF_CPU=16000000UL', '-Os', '-std=gnu99', '-Wall', '-Werror']
IN_FLASH = ['-DMORPHBUS_FLASH=__flash']
TOLERANCE = 1e-5  # Metres, or parts of a unit vector.

# Prints every element of every pose as a whole number of 1e-7: no printf of floats, which small
# targets lack.
DRIVER = '''#include "@NAME@.h"
#include <stdio.h>
@INCLUDES@
static const float values[@ROUNDS@][@NUM_JOINTS@] = {
@VALUES@};
static float X[@NUM_LINKS@][12];
@BEFORE@
int main(void) {
  int round, link, k;
  @START@
  for (round = 0; round < @ROUNDS@; ++round) {
    @NAME@_forward_kinematics(values[round], X);
    for (link = 0; link < @NUM_LINKS@; ++link)
      for (k = 0; k < 12; ++k) printf("%ld\\n", (long)(X[link][k] * 1e7f));
  }
  printf("done\\n");
  @END@
  return 0;
}
'''

# Prints the tables of a module type: names, and each number as a whole number of 1e-7 (limits of 1e-3).
TABLES = '''#include "module.h"
#include <stdio.h>
@INCLUDES@
typedef const MORPHBUS_FLASH float *numbers;
static void name(const MORPHBUS_FLASH char *text) {
  while (*text) putchar(*text++);
  putchar('\\n');
}
static void print(numbers values, int count, float unit) {
  int k;
  for (k = 0; k < count; ++k) printf("%ld\\n", (long)(values[k] * unit));
}
@BEFORE@
int main(void) {
  const MORPHBUS_FLASH morphbus_kinematics *all = &MTRAN_kinematics;
  unsigned i, k;
  @START@
  name(all->type_name);
  for (i = 0; i < all->num_links; ++i) name(all->links[i].name);
  for (i = 0; i < all->num_joints; ++i) {
    const MORPHBUS_FLASH morphbus_joint *joint = &all->joints[i];
    name(joint->name);
    printf("%d\\n%d\\n%d\\n", joint->kind, joint->link_a, joint->link_b);
    print(joint->origin, 3, 1e7f);
    print(joint->axis, 3, 1e7f);
    print(&joint->lower, 1, 1e3f);
    print(&joint->upper, 1, 1e3f);
    print(&joint->speed, 1, 1e3f);
  }
  for (i = 0; i < all->num_connectors; ++i) {
    const MORPHBUS_FLASH morphbus_connector *connector = &all->connectors[i];
    name(connector->name);
    printf("%d\\n", connector->link);
    for (k = 0; k < connector->num_states; ++k) name(connector->states[k].name);
    for (k = 0; k < connector->num_points; ++k) print(connector->points[k], 3, 1e7f);
  }
  for (i = 0; i < all->num_connections; ++i) {
    const MORPHBUS_FLASH morphbus_connection *c = &all->connections[i];
    printf("%d\\n%d\\n%d\\n%d\\n", c->is_member_b, c->number, c->connector, c->mate_connector);
    print(c->p, 3, 1e7f);
    print(c->q, 4, 1e7f);
  }
  printf("done\\n");
  @END@
  return 0;
}
'''

AVR = {
    'INCLUDES': '#include <avr/interrupt.h>\n#include <avr/io.h>\n#include <avr/sleep.h>\n',
    # What simavr shows of the serial port, a line at a time.
    'BEFORE': '''static int put(char c, FILE *stream) {
  (void)stream;
  while (!(UCSR0A & (1 << UDRE0))) continue;
  UDR0 = (uint8_t)c;
  return 0;
}
static FILE serial = FDEV_SETUP_STREAM(put, NULL, _FDEV_SETUP_WRITE);
''',
    'START': 'UCSR0B = 1 << TXEN0; stdout = &serial;',
    'END': 'while (!(UCSR0A & (1 << UDRE0))) continue; cli(); sleep_mode();',
}


def filled(text, parts):
    for key, value in {'INCLUDES': '', 'BEFORE': '', 'START': '', 'END': '', **parts}.items():
        text = text.replace(f'@{key}@', str(value))
    return text


def driver(name, num_links, rounds, **parts):
    rows = ''.join('  {' + ', '.join(f'{q}f' for q in values) + '},\n' for values in rounds)
    return filled(DRIVER, {'NAME': name, 'NUM_LINKS': num_links, 'NUM_JOINTS': len(rounds[0]),
                           'ROUNDS': len(rounds), 'VALUES': rows, **parts})


def numbers(output):
    lines = output.split()
    if lines[-1] != 'done':
        raise AssertionError(f'the program did not end well: {lines[-5:]}')
    return [int(line) * 1e-7 for line in lines[:-1]]


def undefined(nm, file):
    return set(re.findall(r'^\s+U (\w+)', run([nm, file]).stdout, re.M))


class Generated(Case):
    def make(self, robot, modules, rounds, model=MODEL):
        """Exports a robot; returns its link poses at random values, by the library, row by row."""
        export('c', self.folder / f'{robot}.c', '--robot', robot, model=model)
        self.values = [random_values(modules, seed) for seed in range(rounds)]
        expected = []
        for values in self.values:
            for pose in poses(robot, values, model).values():
                expected += matrix(pose)
        self.num_links = 3 * modules
        return expected

    def write_driver(self, name, rounds, **parts):
        values = [[row[joint] for joint in row] for row in self.values[:rounds]]
        path = self.folder / 'main.c'
        path.write_text(driver(name, self.num_links, values, **parts))
        return path

    def make_tables(self, **parts):
        """Exports the module type with a program that prints its tables; returns what that prints on the host."""
        export('c', self.folder / 'module.c', '--module', 'MTRAN')
        (self.folder / 'tables.c').write_text(filled(TABLES, {}))
        run(['gcc', *FLAGS, self.folder / 'tables.c', self.folder / 'module.c', '-lm', '-o', self.folder / 'host'])
        (self.folder / 'tables.c').write_text(filled(TABLES, parts))
        return run([self.folder / 'host']).stdout.split()

    def assert_close(self, actual, expected):
        self.assertEqual(len(actual), len(expected))
        worst = max(abs(a - b) for a, b in zip(actual, expected))
        self.assertLess(worst, TOLERANCE)


class Host(Generated):
    def on_host(self, robot, modules, model=MODEL):
        expected = self.make(robot, modules, 5, model)
        source = self.write_driver(robot, 5)
        for level in ('-O0', '-O3'):
            run(['gcc', *FLAGS, level, source, self.folder / f'{robot}.c', '-lm', '-o', self.folder / 'host'])
            self.assert_close(numbers(run([self.folder / 'host']).stdout), expected)

    def test_the_quadrupeds_on_this_machine(self):
        self.on_host('quadruped', 9)
        self.on_host('equivalent_quadruped', 9)

    def test_a_robot_without_loops_on_this_machine(self):
        self.on_host('snake', 3, self.snake())

    def test_a_module_type_has_the_names_of_its_parts(self):
        export('c', self.folder / 'module.c', '--module', 'MTRAN')
        header = (self.folder / 'module.h').read_text()
        self.assertIn('MTRAN_link_passive_block = 1', header)
        self.assertIn('MTRAN_joint_joint_2 = 1', header)
        (self.folder / 'main.c').write_text('''#include "module.h"
            int main(void) {
              const float q[MTRAN_num_joints] = {0.5f, 0.0f};
              float X[MTRAN_num_links][12];
              MTRAN_forward_kinematics(q, X);
              /* Seen from the active block, the bar turns back by as much. */
              return !(X[MTRAN_link_connecting_bar][0] > 0.8775f && X[MTRAN_link_connecting_bar][0] < 0.8777f
                       && X[MTRAN_link_connecting_bar][1] > 0.4794f);
            }''')
        run(['gcc', *FLAGS, self.folder / 'main.c', self.folder / 'module.c', '-lm', '-o', self.folder / 'host'])
        run([self.folder / 'host'])

    def test_a_module_type_has_its_tables_and_no_more_code(self):
        lines = self.make_tables()
        self.assertEqual(lines[:4], ['MTRAN', 'active_block', 'passive_block', 'connecting_bar'])
        self.assertEqual(lines.count('extended'), 3)
        # 72 connections from either side, 11 numbers each, end the list.
        rows = [list(map(int, lines[i:i + 11])) for i in range(len(lines) - 1 - 144 * 11, len(lines) - 1, 11)]
        for is_member_b in (0, 1):
            self.assertEqual(sorted(row[1] for row in rows if row[0] == is_member_b), list(range(1, 73)))
        # The paper's (c6, c3): 1 to 4.
        self.assertEqual([row[1] for row in rows if row[2:4] == [5, 2] and not row[0]], [1, 2, 3, 4])
        self.assertEqual(lines[-1], 'done')
        run(['gcc', *FLAGS, '-c', self.folder / 'module.c', '-o', self.folder / 'm.o'])
        self.assertLessEqual(undefined('nm', self.folder / 'm.o'),
                             {'sinf', 'cosf', 'sincosf', '_GLOBAL_OFFSET_TABLE_'})
        self.assertRegex(run(['size', '-A', self.folder / 'm.o']).stdout, r'(?m)^\.bss +0 ')
        (self.folder / 'use.cc').write_text('#include "module.h"\nint n = MTRAN_kinematics.num_links;\n')
        run(['g++', '-c', self.folder / 'use.cc', '-o', self.folder / 'use.o'])

    def test_the_header_serves_cpp_and_the_code_calls_only_sine_and_cosine(self):
        self.make('quadruped', 9, 1)
        (self.folder / 'use.cc').write_text('#include "quadruped.h"\nint n = quadruped_num_links;\n')
        run(['g++', '-c', self.folder / 'use.cc', '-o', self.folder / 'use.o'])
        for level in ('-O0', '-O2'):
            run(['gcc', *FLAGS, level, '-c', self.folder / 'quadruped.c', '-o', self.folder / 'q.o'])
            self.assertLessEqual(undefined('nm', self.folder / 'q.o'),
                                 {'sinf', 'cosf', 'sincosf', '_GLOBAL_OFFSET_TABLE_'})
            sections = run(['size', '-A', self.folder / 'q.o']).stdout
            for section in ('.data', '.bss'):
                self.assertRegex(sections, rf'(?m)^\{section} +0 ')


class CortexM(Generated):
    def test_on_a_cortex_m3(self):
        need('arm-none-eabi-gcc', 'qemu-system-arm')
        expected = self.make('quadruped', 9, 5)
        self.write_driver('quadruped', 5)
        run([*ARM, '-ffreestanding', '-c', self.folder / 'quadruped.c', '-o', self.folder / 'q.o',
             '--specs=picolibc.specs'])
        allowed = {'sinf', 'cosf'} | {f'__aeabi_f{op}' for op in ('add', 'sub', 'mul')}
        self.assertLessEqual(undefined('arm-none-eabi-nm', self.folder / 'q.o'), allowed)
        self.assert_close(numbers(self.emulated('main.c', 'quadruped.c')), expected)

    def test_the_tables_on_a_cortex_m3(self):
        need('arm-none-eabi-gcc', 'qemu-system-arm')
        expected = self.make_tables()
        self.assertEqual(self.emulated('tables.c', 'module.c').split(), expected)

    def emulated(self, *sources):
        """What the program prints."""
        run([*ARM, *(self.folder / source for source in sources), '--specs=picolibc.specs', '--oslib=semihost',
             '--crt0=semihost', '-Wl,--defsym=__flash=0', '-Wl,--defsym=__flash_size=256K',
             '-Wl,--defsym=__ram=0x20000000', '-Wl,--defsym=__ram_size=64K', '-lm', '-o', self.folder / 'm3.elf'])
        done = run(['qemu-system-arm', '-M', 'mps2-an385', '-nographic', '-monitor', 'none', '-serial', 'null',
                    '-semihosting-config', 'enable=on,target=native', '-kernel', self.folder / 'm3.elf'],
                   stdin=subprocess.DEVNULL)
        return done.stdout + done.stderr


class Avr(Generated):
    def test_on_an_avr(self):
        need('avr-gcc', 'simavr')
        expected = self.make('quadruped', 9, 2)
        self.write_driver('quadruped', 2, **AVR)
        run([*AVR_GCC, '-c', self.folder / 'quadruped.c', '-o', self.folder / 'q.o'])
        allowed = {'sin', 'cos'} | {f'__{op}sf3' for op in ('add', 'sub', 'mul')}
        # Register saving, which avr-gcc -Os shares between functions.
        allowed |= {'__prologue_saves__', '__epilogue_restores__'}
        self.assertLessEqual(undefined('avr-nm', self.folder / 'q.o'), allowed)
        lines = self.emulated('main.c', 'quadruped.c')
        self.assert_close(numbers('\n'.join(line for line in lines if re.fullmatch(r'-?\d+|done', line))), expected)

    def test_the_tables_in_the_flash_of_an_avr(self):
        need('avr-gcc', 'simavr')
        expected = self.make_tables(**AVR)
        # 5 KiB of connections would not leave room in 4 KiB of RAM.
        run([*AVR_GCC, *IN_FLASH, '-c', self.folder / 'module.c', '-o', self.folder / 'm.o'])
        sections = run(['avr-size', '-A', self.folder / 'm.o']).stdout
        for section in ('.data', '.bss', '.rodata'):
            self.assertNotRegex(sections, rf'(?m)^\{section}\S* +[1-9]')
        lines = self.emulated(*IN_FLASH, 'tables.c', 'module.c')
        self.assertEqual(lines[lines.index('MTRAN'):lines.index('done') + 1], expected)

    def emulated(self, *words):
        """The lines that the program prints; words are options and sources."""
        run([*AVR_GCC, *(word if word.startswith('-') else self.folder / word for word in words), '-lm',
             '-o', self.folder / 'a.elf'])
        done = run(['simavr', '-m', 'atmega128', '-f', '16000000', self.folder / 'a.elf'])
        text = re.sub(r'\x1b\[[0-9;]*m', '', done.stdout + done.stderr)
        return [line.rstrip('.') for line in text.splitlines()]


if __name__ == '__main__':
    main()
