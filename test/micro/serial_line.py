#!/usr/bin/env python3
"""Two emulated microcontrollers joined by a serial line: each runs one module's firmware (vm/port), finds its neighbour
and its role over the line, and says in every tick, byte for byte, what the same module said in a run on the host. And the
sizes of docs/porting.md."""
import os
import pathlib
import re
import shutil
import socket
import struct
import subprocess
import threading
import zlib

from cortex_m import BOARDS, MODEL, SOURCE, Micro, linked, main

BOARD = 'cortex-m3'
PORT = ['vm/' + name for name in os.environ['MORPHBUS_PORT'].split(',')]
PORTING = SOURCE / 'docs/porting.md'

# The rear module is rolled by a quarter turn, so it can tell its role only by the pose that comes over the line.
PAIR = f'''import "{MODEL}"
robot pair: modules=(MTRAN front, MTRAN rear), connections=((front.c2, rear.c5, rot=90))
'''
PROGRAM = '''
role Level extends Module {
  require self.JOINT_1.AXIS == $EAST_WEST;
  shared phase = 0.0;
  behavior lead() {
    phase = 90 * self.time;
    self.jointSetDegreesNonBlocking(self.JOINT_1, 20 * sin(phase));
    self.sleepcs(2);
  }
  handler call() every 1.0 { Rolled.lift(10 + round(random(0, 20))); }
}
role Rolled extends Module {
  require self.JOINT_1.AXIS == $UP_DOWN;
  require self.connected($ANY) == 1;
  behavior follow() {
    if (self.connected($ANY, $Level) == 1) {
      self.jointSetDegreesNonBlocking(self.JOINT_1, 15 * cos(self.connected($ANY, $Level).phase - 45 * self.hops));
    }
    self.sleepcs(2);
  }
  command lift(float angle) { self.jointSetDegreesNonBlocking(self.JOINT_2, angle); }
}
'''


def carry(source, target, sent):
    """One direction of the line, until its machine is switched off."""
    while data := source.recv(4096):
        sent += data
        try:
            target.sendall(data)
        except OSError:
            pass  # Nobody listens any more.


class SerialLine(Micro):
    def prepare(self):
        """Runs the pair on the host, and builds the firmware that does the same."""
        model, program = self.folder / 'pair.m3l', self.folder / 'pair.dyn'
        model.write_text(PAIR)
        program.write_text(PROGRAM)
        log = self.host_run(model, 'pair', program, 6)
        self.folders = [self.folder / name for name in ('front', 'rear')]
        for folder in self.folders:
            folder.mkdir()
            found = self.recorded(log, folder.name, folder)
            self.assertEqual((found['ticks'], found['neighbours']), (300, 1))
            # The program's calls are on their way over the line as well.
            self.assertGreater(found['invocations'], 0)
        # Both are of one type, so one firmware is for both; who it is, a module reads from its configuration.
        for name in ('image.bin', 'kinematics.bin'):
            shutil.copy(self.folders[0] / name, self.folder / name)
            self.assertEqual(*((folder / name).read_bytes() for folder in self.folders))
        self.elf = self.build(BOARD, *PORT, 'test/micro/serial_main.cc')

    def machine(self, folder):
        """Starts one, whose UART is its end of the line."""
        process = subprocess.Popen(['qemu-system-arm', '-M', BOARDS[BOARD][1], '-display', 'none', '-monitor', 'none',
                                    '-chardev', f'socket,id=line,path={folder}/line,server=off', '-serial',
                                    'chardev:line', '-semihosting-config', 'enable=on,target=native', '-kernel', self.elf],
                                   stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                   cwd=folder)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def run_both(self):
        """Runs both to their end. Returns what each says of itself and the bytes that it sent."""
        waiting = []
        for folder in self.folders:
            waiting.append(socket.socket(socket.AF_UNIX))
            self.addCleanup(waiting[-1].close)
            waiting[-1].bind(f'{folder}/line')
            waiting[-1].listen()
            waiting[-1].settimeout(120)
        machines = [self.machine(folder) for folder in self.folders]
        ends = [one.accept()[0] for one in waiting]
        sent = [bytearray(), bytearray()]
        wires = [threading.Thread(target=carry, args=(ends[i], ends[1 - i], sent[i])) for i in (0, 1)]
        for wire in wires:
            wire.start()
        said = []
        for machine in machines:
            text = machine.communicate(timeout=240)[0]
            self.assertRegex(text, r'ticks \d+ role', text)
            said.append({name: int(value) for name, value in re.findall(r'(\w+) (-?\d+)', text)})
        for wire, end in zip(wires, ends):
            wire.join()
            end.close()
        return said, sent

    def test_two_machines_find_each_other_and_their_roles(self):
        self.prepare()
        said, sent = self.run_both()
        self.assertEqual([one['ticks'] for one in said], [300, 300])
        self.assertEqual([one['role'] for one in said], [0, 1])
        for folder in self.folders:
            expected, actual = ((folder / name).read_bytes() for name in ('expected.bin', 'output.bin'))
            self.assertGreater(len(expected), 300 * 100)
            if expected != actual:
                differing = next((i for i, (a, b) in enumerate(zip(expected, actual)) if a != b), None)
                self.fail(f'{folder.name}: {len(actual)} bytes for {len(expected)}, first difference at {differing}')
        # Connectors c2 and c5.
        self.the_line_is_as_documented(self.folders[0], 1, bytes(sent[0]))
        self.the_line_is_as_documented(self.folders[1], 4, bytes(sent[1]))
        table = self.sizes(said)
        found = PORTING.read_text()
        self.assertTrue(table in found, f'{PORTING} has other sizes; now they are\n{table}')

    def test_loop_and_port_are_as_short_as_the_document_says(self):
        for files in (('vm/port/firmware.h', 'vm/port/firmware.cc'), ('test/micro/serial_main.cc',)):
            self.assertLess(sum(len((SOURCE / file).read_text().splitlines()) for file in files), 200, files)

    def the_line_is_as_documented(self, folder, connector, line):
        """What a machine sent is read here by docs/porting.md alone: a greeting, then a packet a tick."""
        module = struct.unpack_from('<H', (folder / 'config.bin').read_bytes())[0]
        packets = []
        while line:
            start, size, check = struct.unpack_from('<BHB', line)
            self.assertEqual((start, check), (0xa5, ~(size ^ size >> 8) & 0xff))
            body, crc = line[4:4 + size], struct.unpack_from('<I', line, 4 + size)[0]
            self.assertEqual(crc, zlib.crc32(line[:4 + size]))
            self.assertEqual(struct.unpack_from('<HB', body), (module, connector))
            packets.append(body[3:])
            line = line[8 + size:]
        self.assertEqual(packets.pop(0), b'')
        for tick, packet in enumerate(packets):
            self.assertEqual(struct.unpack_from('<BHIq', packet), (2, module, 1, tick))
        self.assertEqual(len(packets), 300)

    def sizes(self, said):
        code = linked(pathlib.Path(f'{self.elf}.map').read_text())[2]
        rows = (('code of the loop, of frames and of packets', code),
                ('`Firmware`, with buffers for six connectors', max(one['firmware'] for one in said)),
                ('the longest frame of the two', max(one['longest'] for one in said)))
        return ''.join(f'| {name} | {-(-value // 16) * 16:,} |\n' for name, value in rows)


if __name__ == '__main__':
    main()
