#!/usr/bin/env python3
"""Two emulated microcontrollers with clocks of their own, switched on one after the other, with servos that go where they
are told, and joined by a serial line that damages, loses and adds bytes: they find each other and their roles, keep their
ticks together, and a program that is handed to one of them spreads to the other, and runs on both from the tick that it
names. And the sizes of a whole module, of which docs/porting.md has the table."""
import pathlib
import random
import re
import shutil
import socket
import subprocess
import threading

from cortex_m import BOARDS, MODEL, MORPHBUS, SOURCE, Micro, linked, main, run
from serial_line import PAIR, PORT, PORTING, PROGRAM

# In the same roles other joints move.
LATER = '''
role Level extends Module {
  require self.JOINT_1.AXIS == $EAST_WEST;
  startup s() { self.jointSetDegreesNonBlocking(self.JOINT_2, 40); }
}
role Rolled extends Module {
  require self.JOINT_1.AXIS == $UP_DOWN;
  startup s() { self.jointSetDegreesNonBlocking(self.JOINT_2, 25); }
}
'''
# Of bytes: as many each are lost, damaged, and have another one put before them.
BAD = 0.0002
# Some of the bytes that are counted stand within a frame; a module that is less than 32 ticks behind need not leap.
FRAMES_BEFORE_THE_SECOND = 120


class BadWire(threading.Thread):
    """One direction of the line, whose accidents are drawn from a seed."""

    def __init__(self, seed):
        super().__init__(daemon=True)
        self.random = random.Random(seed)
        self.source = self.target = None
        self.carried = 0
        self.accidents = [0, 0, 0]
        self.heard_enough = threading.Event()

    def run(self):
        while data := self.receive():
            self.carried += data.count(0xa5)
            if self.carried >= FRAMES_BEFORE_THE_SECOND:
                self.heard_enough.set()
            data = b''.join(self.passed(byte) for byte in data)
            target = self.target()
            if target is None:
                continue  # Nobody is there yet.
            try:
                target.send(data, socket.MSG_DONTWAIT)
            except OSError:
                pass  # Nobody listens any more, or not fast enough: a line does not wait.

    def receive(self):
        try:
            return self.source.recv(4096)
        except OSError:
            return b''

    def passed(self, byte):
        kind = int(self.random.random() / BAD)
        if kind > 2:
            return bytes([byte])
        self.accidents[kind] += 1
        return (b'', bytes([byte ^ 1 << self.random.randrange(8)]), bytes([self.random.randrange(256), byte]))[kind]


class ClockLine(Micro):
    def prepare(self):
        model = self.folder / 'pair.m3l'
        model.write_text(PAIR)
        for name, text in (('pair.dyn', PROGRAM), ('later.dyn', LATER)):
            (self.folder / name).write_text(text)
        log = self.host_run(model, 'pair', self.folder / 'pair.dyn', 1)
        run([MORPHBUS, 'compile', self.folder / 'later.dyn', '--model', model, '--strip', '-o', self.folder / 'later.bin'])
        self.folders = [self.folder / name for name in ('front', 'rear')]
        for folder in self.folders:
            folder.mkdir()
            self.recorded(log, folder.name, folder)
        for name in ('image.bin', 'kinematics.bin'):
            shutil.copy(self.folders[0] / name, self.folder / name)

    def machine(self, board, elf, folder):
        """Switches one on: its process, and its end of the line."""
        path = f'{folder}/line'
        pathlib.Path(path).unlink(missing_ok=True)
        with socket.socket(socket.AF_UNIX) as waiting:
            waiting.bind(path)
            waiting.listen()
            waiting.settimeout(120)
            process = subprocess.Popen(
                ['qemu-system-arm', '-M', BOARDS[board][1], '-display', 'none', '-monitor', 'none', '-chardev',
                 f'socket,id=line,path={path},server=off', '-serial', 'chardev:line', '-semihosting-config',
                 'enable=on,target=native', '-kernel', elf],
                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=folder)
            self.addCleanup(process.stdout.close)
            self.addCleanup(process.wait)
            self.addCleanup(process.kill)
            return process, waiting.accept()[0]

    def told(self, process):
        """What a machine says of itself, which then runs on until it is switched off."""
        lines = []

        def read():
            for line in process.stdout:
                lines.append(line)
                if line.startswith('done'):
                    return

        reader = threading.Thread(target=read, daemon=True)
        reader.start()
        reader.join(240)
        text = ''.join(lines)
        self.assertIn('done\n', text, 'the machine has not come to its end')
        return {name: int(value) for name, value in re.findall(r'(\w+) (-?\d+)', text)}

    def run_both(self, board, elf):
        wires = [BadWire(1), BadWire(2)]
        ends = [None, None]
        machines = []
        for i in (0, 1):
            process, ends[i] = self.machine(board, elf, self.folders[i])
            self.addCleanup(ends[i].close)
            machines.append(process)
            wires[i].source = ends[i]
            wires[i].target = lambda other=1 - i: ends[other]
            wires[i].start()
            if i == 0:
                # The second is switched on when the first has computed for a while.
                self.assertTrue(wires[0].heard_enough.wait(120))
        said = [self.told(machine) for machine in machines]
        for machine in machines:
            machine.kill()
        return said, [wire.accidents for wire in wires]

    def one_board(self, board):
        elf = self.build(board, *PORT, 'test/micro/clock_main.cc')
        (front, rear), accidents = self.run_both(board, elf)
        for counts in accidents:
            self.assertTrue(all(count > 0 for count in counts), counts)
        self.assertEqual((front['role'], rear['role']), (0, 1))
        self.assertEqual((front['faults'], rear['faults']), (0, 0))
        # It leapt to its neighbour's ticks when it began, and its slow clock was kept together with the other's since.
        self.assertGreaterEqual(rear['leaps'], 1)
        # Both joints went where they were driven: under the first program to 20 degrees and, for the one which
        # follows, to 15; under the later one to stay at 40 and 25.
        self.assertGreater(front['highest0'] - front['lowest0'], 500, front)
        self.assertGreater(rear['highest0'] - rear['lowest0'], 350, rear)
        self.assertAlmostEqual(abs(front['joint1']), 698, delta=2)
        self.assertAlmostEqual(abs(rear['joint1']), 436, delta=2)
        # The program lies in the flash of both, and began at the tick that it names.
        self.assertEqual((front['in_flash'], rear['in_flash']), (1, 1))
        self.assertEqual((front['switched'], rear['switched']), (front['deployed'],) * 2)
        return self.sizes(elf, front, rear)

    def test_they_keep_together_and_a_program_spreads(self):
        self.prepare()
        measured = {}
        for board in BOARDS:
            with self.subTest(board=board):
                measured[board] = self.one_board(board)
        self.assertEqual(len(measured), len(BOARDS))
        lines = ['| bytes | ' + ' | '.join(BOARDS) + ' |', '|---|' + '---:|' * len(BOARDS)]
        for name in measured['cortex-m3']:
            values = (-(-measured[board][name] // 16) * 16 for board in BOARDS)
            lines.append(f'| {name} | ' + ' | '.join(f'{value:,}' for value in values) + ' |')
        table = '\n'.join(lines) + '\n'
        self.assertTrue(table in PORTING.read_text(), f'{PORTING} has other sizes; now they are\n{table}')

    def sizes(self, elf, *said):
        text = pathlib.Path(f'{elf}.map').read_text()
        core, arithmetic, link, spread = linked(text)
        most = {name: max(one[name] for one in said) for name in said[1]}
        images = sum((self.folder / name).stat().st_size for name in ('image.bin', 'kinematics.bin'))
        return {'core and arithmetic': core + arithmetic, 'loop, frames and packets': link,
                'what spreads and changes programs': spread, 'both images': images,
                '**flash together**': core + arithmetic + link + spread + images,
                '`VmState`': most['state'], '`Firmware`': most['firmware'],
                'what the verifier keeps of both images': most['program'] + most['kinematics'],
                'deepest stack': most['stack'],
                '**RAM together**': sum(most[name] for name in ('state', 'firmware', 'program', 'kinematics', 'stack'))}

    def test_the_port_is_as_short_as_the_document_says(self):
        for file in ('test/micro/clock_main.cc', 'test/micro/serial_main.cc'):
            self.assertLess(len((SOURCE / file).read_text().splitlines()), 200, file)


if __name__ == '__main__':
    main()
