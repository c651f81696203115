#!/usr/bin/env python3
"""The VM core on emulated Cortex-M: on what modules of real runs sensed and heard it says what the host said,
byte for byte; and the memory that it needs, of which docs/footprint.md has the table."""
import concurrent.futures
import os
import pathlib
import re
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(os.environ['MORPHBUS_SOURCE']) / 'test/export'))
from support import MODEL, MORPHBUS, SOURCE, Case, main, need, run  # noqa: E402

RECORD = os.environ['MORPHBUS_RECORD']
CORE = ['vm/' + name for name in os.environ['MORPHBUS_CORE'].split(',')]
QUADRUPED = str(SOURCE / 'models/programs/quadruped.dyn')
FOOTPRINT = SOURCE / 'docs/footprint.md'
FLAGS = ['-mthumb', '-Os', '-std=c++20', '-DMORPHBUS_VM_SMALL', '-DMORPHBUS_VM_SWITCH', '-fno-exceptions',
         '-fno-rtti', '-ffp-contract=off', '-ffunction-sections', '-fdata-sections', '-fno-threadsafe-statics',
         '-fno-inline-functions-called-once', '-fconserve-stack', '-Wall', '-Wextra', '-Werror',
         '--specs=picolibcpp.specs']
# The core is optimized as a whole when it is linked; what only links and new programs need, and the harness, are compiled by themselves,
# so that the linker's map tells their bytes from the core's.
LINK = ('packet', 'firmware', 'frame', 'message_pool')
SPREAD = ('package', 'program_relay', 'program_changer')
WHOLE = [name for name in CORE if pathlib.Path(name).stem not in LINK + SPREAD]

# The emulated boards: the processor's options, the machine, and where its memories begin.
BOARDS = {
    'cortex-m0': (['-mcpu=cortex-m0'], 'microbit', 0, 0x20000000, '16K'),
    'cortex-m3': (['-mcpu=cortex-m3'], 'mps2-an385', 0, 0x20000000, '64K'),
    'cortex-m4': (['-mcpu=cortex-m4', '-mfloat-abi=hard', '-mfpu=fpv4-sp-d16'], 'mps2-an386', 0, 0x20000000, '64K'),
}

# A program that counts on the same bits: mathematics, the root's clock and how far it is, random numbers, diagonals,
# shared fields.
MATHEMATICS = '''
role Wave extends Module {
  shared phase = 0.0;
  angle = 0.0;
  startup begin() {
    self.setJointAxis(self.JOINT_1, $LINK_ACTIVE_BLOCK, axis($EAST + $UP));
    print("begins at", self.time, self.hops);
  }
  behavior swing() {
    var t = self.time + 0.37 * random(-1, 1);
    phase = 60 * sin(40 * t) * cos(17 * t + phase) + atan2(t, 1 + abs(phase)) / 9;
    angle = asin(sin(phase)) * 0.3 + sqrt(abs(tan(phase / 2))) + acos(cos(angle)) % 7;
    if (self.JOINT_2.AXIS == axis($EAST)) angle += 1;
    angle += floor(17.3 * t) % 3 + 0.25 * self.hops - floor(-angle / 7);
    angle = angle + self.ms % 1000 * 0.001 + sizeof(self.connected($NORTH + $EAST)) - sizeof(self.connected($DOWN + $SOUTH));
    self.jointSetDegreesNonBlocking(self.JOINT_1, min(40, max(-40, angle)));
    self.JOINT_2.SET_POSITION(round(phase) / 3);
    self.sleepcs(2);
  }
}
'''


class Micro(Case):
    def setUp(self):
        need('arm-none-eabi-g++', 'qemu-system-arm')
        super().setUp()

    def record(self, program, module, seconds):
        """What a module of the quadruped sensed, heard and said in a run, and the images that it ran."""
        return self.recorded(self.host_run(MODEL, 'quadruped', program, seconds), module, self.folder)

    def host_run(self, model, robot, program, seconds):
        """The log of a run on this machine."""
        log = self.folder / 'run.log'
        run([MORPHBUS, 'run', model, program, '--robot', robot, '--seconds', str(seconds), '--inproc', '-o', log,
             '--force'])
        return log

    def recorded(self, log, module, folder):
        """Puts what one module of a run sensed, heard and said into a folder, and the images that it ran."""
        found = run([RECORD, log, module, folder]).stdout.split()
        return dict(zip(found[::2], map(int, found[1::2])))

    def build(self, board, *sources):
        """Links the core with a program's own sources; returns the ELF file, beside which lies the linker's map."""
        processor, _, flash, ram, ram_size = BOARDS[board]
        folder = self.folder / board
        folder.mkdir(exist_ok=True)

        def compiled(source):
            target = folder / (source.replace('/', '.') + '.o')
            # Sources of the core do not change from one recording to the next, those with images in them do.
            if source not in CORE or not target.exists():
                run(['arm-none-eabi-g++', *processor, *FLAGS, *(['-flto'] if source in WHOLE else []), f'-I{SOURCE}', '-c',
                     SOURCE / source, '-o', target], cwd=self.folder)
            return target

        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            objects = list(pool.map(compiled, [*CORE, *sources]))
        elf = folder / 'module.elf'
        # The harness prints integers only, and shall not pull in arithmetic that the core does without.
        run(['arm-none-eabi-g++', *processor, *FLAGS, '-flto=auto', *objects, '--oslib=semihost', '--crt0=semihost',
             '-Wl,--defsym=vfprintf=__i_vfprintf', '-Wl,--gc-sections', f'-Wl,--defsym=__flash={flash}',
             '-Wl,--defsym=__flash_size=256K', f'-Wl,--defsym=__ram={ram}', f'-Wl,--defsym=__ram_size={ram_size}',
             f'-Wl,-Map={elf}.map', '-o', elf])
        return elf

    def emulate(self, board, elf):
        """Runs it in the scratch folder; returns what it prints."""
        done = subprocess.run(['qemu-system-arm', '-M', BOARDS[board][1], '-nographic', '-monitor', 'none', '-serial',
                               'null', '-semihosting-config', 'enable=on,target=native', '-kernel', elf],
                              stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=300, cwd=self.folder)
        text = done.stdout + done.stderr
        self.assertRegex(text, r'ticks \d+ verify_stack', text)
        return {name: int(value) for name, value in re.findall(r'(\w+) (\d+)', text)}


class Replayed(Micro):
    def same(self, board):
        """The emulated module's outputs, each tick with its size before it, are the host's."""
        (self.folder / 'output.bin').unlink(missing_ok=True)
        said = self.emulate(board, self.build(board, 'test/micro/replay_main.cc'))
        expected, actual = ((self.folder / name).read_bytes() for name in ('expected.bin', 'output.bin'))
        if expected != actual:
            differing = next((i for i, (a, b) in enumerate(zip(expected, actual)) if a != b), None)
            self.fail(f'{board}: {len(actual)} bytes for {len(expected)}, first difference at {differing}')
        return said

    def test_the_quadrupeds_modules_say_what_they_said_on_the_host(self):
        # The junction, which leads; an upper half, which two others are docked to; a lower half.
        for module in ('m5', 'm2', 'm1'):
            found = self.record(QUADRUPED, module, 8)
            self.assertEqual(found['ticks'], 400)
            for board in BOARDS:
                with self.subTest(module=module, board=board):
                    self.assertEqual(self.same(board)['ticks'], 400)

    def test_a_program_that_counts_has_the_same_bits(self):
        program = self.folder / 'wave.dyn'
        program.write_text(MATHEMATICS)
        self.record(program, 'm2', 4)
        for board in BOARDS:
            with self.subTest(board=board):
                self.same(board)


# What the core needs of the compiler's and the C library's arithmetic; the rest of what is linked prints.
ARITHMETIC = re.compile(r'libgcc\.a\((_arm_\w*[ds]f\w*|_\w*fix\w*|_udivmod\w*|_aeabi_u?ldivmod|_\w*float\w*|'
                        r'_u?divsi3|_thumb1\w*|_mul\w*3|_div\w*3|_add\w*3|\w*df2|\w*sf2|bpabi|_clz\w*|_ctz\w*|'
                        r'_popcount\w*|\w*ldivmod|_lshrdi3|_ashldi3|_lmul)\.o\)|libm_\w+|libc_string_mem\w+|mem\w+')


def linked(text):
    """Bytes of code and constants in the linker's map: of the core, of the arithmetic that it calls, of what links need,
    and of what new programs need."""
    text = text[text.index('Linker script and memory map'):]
    # A long name of a section stands on a line of its own.
    text = re.sub(r'\n (\.\S+)\n\s+', r'\n \1 ', text)
    sizes = [0, 0, 0, 0]
    for size, file in re.findall(r'^ \.(?:text|rodata|data|ARM)\S*\s+0x[0-9a-f]+\s+0x([0-9a-f]+) (\S+)$', text, re.M):
        name = file.rsplit('/')[-1]
        own = re.fullmatch(r'vm\.\w+\.(\w+)\.cc\.o', name)
        if '.ltrans' in name:
            sizes[0] += int(size, 16)
        elif ARITHMETIC.search(name):
            sizes[1] += int(size, 16)
        elif own and own[1] in LINK + SPREAD:
            sizes[2 if own[1] in LINK else 3] += int(size, 16)
    return sizes


class Footprint(Micro):
    """The numbers of docs/footprint.md are those of this build."""
    LIMITS = {'flash': 48 * 1024, 'ram': 8 * 1024, 'state': 4 * 1024, 'image': 1536}

    def measure(self, board):
        self.record(QUADRUPED, 'm5', 8)
        elf = self.build(board, 'test/micro/replay_main.cc')
        said = self.emulate(board, elf)
        static = {name: said[name] for name in ('state', 'program', 'kinematics', 'input', 'output', 'messages', 'vm')}
        stack = max(said['verify_stack'], said['tick_stack'])
        code, arithmetic, *_ = linked(pathlib.Path(f'{elf}.map').read_text())
        return {'code': code, 'arithmetic': arithmetic, 'flash': code + arithmetic, **static, 'stack': stack,
                'ram': sum(static.values()) + stack, 'image': (self.folder / 'image.bin').stat().st_size,
                'kinematics_image': (self.folder / 'kinematics.bin').stat().st_size}

    def test_the_table_is_that_of_this_build(self):
        measured = {board: self.measure(board) for board in BOARDS}
        table = table_of(measured)
        goals = measured['cortex-m3']
        for name, limit in self.LIMITS.items():
            self.assertLess(goals[name], limit, name)
        found = FOOTPRINT.read_text()
        self.assertIn(table, found, f'{FOOTPRINT} has another table; now it is\n{table}')


ROWS = (('code', 'code and constants of the core'),
        ('arithmetic', 'arithmetic that the processor lacks'),
        ('flash', '**flash together**'),
        ('image', 'program image of the quadruped, in flash'),
        ('kinematics_image', 'kinematics image of the M-TRAN module, in flash'),
        ('state', 'the whole changing state of a VM, its tasks included'),
        ('program', 'what the verifier keeps of a program'),
        ('kinematics', 'what it keeps of a module type'),
        ('vm', 'configuration and references'),
        ('input', 'what a tick senses'),
        ('messages', 'what four neighbours said'),
        ('output', 'what a tick says'),
        ('stack', 'deepest stack, of the verifier and of a tick'),
        ('ram', '**RAM together**'))


def table_of(measured):
    """Rounded up to 16 bytes."""
    def bytes_of(board, row):
        return f'{-(-measured[board][row] // 16) * 16:,}'
    lines = ['| bytes | ' + ' | '.join(BOARDS) + ' |', '|---|' + '---:|' * len(BOARDS)]
    for name, text in ROWS:
        lines.append(f'| {text} | ' + ' | '.join(bytes_of(board, name) for board in BOARDS) + ' |')
    return '\n'.join(lines) + '\n'


if __name__ == '__main__':
    main()
