#!/usr/bin/env python3
"""What the monitor's server costs: sixty modules in one process, in real time at 50 ticks a second without physics, and four
clients that subscribe to everything, one of which stops reading. Goals: the run misses no more deadlines than without a
monitor, the server takes at most 25 % of a processor, and its memory stays what it was.

Usage: test/bench/monitor_load.py [BUILD_FOLDER] [--seconds S] [--without S] [--modules N]
       (default build/release, 600 s with the monitor, 120 s without, 60 modules)

The run has a network of its own. A line a minute tells the server's memory; the clients are in this process, whose
processor time is told too, since they share the machine.
"""
import argparse
import base64
import json
import os
import pathlib
import select
import socket
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
CLIENTS = 4
TOKEN = 'token-of-the-benchmark'
TICKS_A_SECOND = os.sysconf('SC_CLK_TCK')


def write_snake(folder, modules):
    """A chain of M-TRAN modules, pitch and yaw in turn, and a program in which each of them rocks."""
    names = [f'm{i + 1}' for i in range(modules)]
    mates = ', '.join(f'({a}.c2, {b}.c5, rot=90)' for a, b in zip(names, names[1:]))
    model = folder / 'snake.m3l'
    model.write_text(f'import "{ROOT / "models/mtran.m3l"}"\nrobot snake:\n  modules=({", ".join("MTRAN " + n for n in names)}),\n'
                     f'  connections=({mates})\n')
    program = folder / 'rock.dyn'
    program.write_text("""role Rocker extends Module {
  require sizeof(self.connected) >= 1;
  behavior rock() {
    self.JOINT_1.SET_POSITION(15);
    self.sleepds(5);
    self.JOINT_1.SET_POSITION(-15);
    self.sleepds(5);
  }
}
""")
    return model, program


class Client:
    """Subscribes to every topic and throws away what comes."""

    def __init__(self, port):
        self.socket = socket.create_connection(('127.0.0.1', port))
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall((f'GET / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n'
                             f'Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n'
                             'Sec-WebSocket-Protocol: foxglove.websocket.v1\r\n\r\n').encode())
        while not self.exactly(1) == b'\n' or not self.exactly(2) == b'\r\n':
            pass
        while True:
            message = json.loads(self.text())
            if message['op'] == 'advertise':
                break
        wanted = [{'id': c['id'], 'channelId': c['id']} for c in message['channels']]
        data = json.dumps({'op': 'subscribe', 'subscriptions': wanted}).encode()
        # A mask of zeros leaves the text as it is.
        size = bytes([0x80 | len(data)]) if len(data) < 126 else bytes([0xFE]) + len(data).to_bytes(2, 'big')
        self.socket.sendall(b'\x81' + size + bytes(4) + data)
        self.bytes = 0

    def exactly(self, size):
        data = b''
        while len(data) < size:
            chunk = self.socket.recv(size - len(data))
            if not chunk:
                raise EOFError('the monitor closed the connection')
            data += chunk
        return data

    def text(self):
        size = self.exactly(2)[1]
        if size == 126:
            size = int.from_bytes(self.exactly(2), 'big')
        elif size == 127:
            size = int.from_bytes(self.exactly(8), 'big')
        return self.exactly(size)

    def read(self):
        size = len(self.socket.recv(1 << 20))
        if size == 0:
            raise EOFError('the monitor closed the connection')
        self.bytes += size


def cpu_seconds(pid):
    fields = pathlib.Path(f'/proc/{pid}/stat').read_text().rsplit(')', 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / TICKS_A_SECOND


def memory_mb(pid):
    text = pathlib.Path(f'/proc/{pid}/status').read_text()
    return int(text.split('VmRSS:')[1].split()[0]) / 1024


def load():
    return pathlib.Path('/proc/loadavg').read_text().split()[0]


def start_run(morphbus, files, seconds, environment):
    return subprocess.Popen([morphbus, 'run', *files, '--robot', 'snake', '--run', 'load', '--seconds', str(seconds),
                             '--still', '--realtime', '--processes', '1', '--isolate', '--json',
                             '--log', files[0].parent / 'load.log'],
                            stdout=subprocess.PIPE, env=environment, text=True)


def missed(process):
    """Deadlines that a run missed, and its ticks."""
    said = json.loads(process.communicate()[0])
    return said['missed_deadlines'], said['ticks']


def start_monitor(morphbus, environment):
    """The monitor and its port, once the run is there."""
    for _ in range(200):
        monitor = subprocess.Popen([morphbus, 'monitor', '--run', 'load', '--port', '0', '--token', TOKEN, '--json'],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment, text=True)
        line = monitor.stdout.readline()
        if line:
            return monitor, json.loads(line)['port']
        error = monitor.communicate()[1]
        time.sleep(0.1)
    raise SystemExit(error)


def watch(monitor, port, process):
    """Serves the clients until the run ends; prints what the server needs."""
    clients = [Client(port) for _ in range(CLIENTS)]
    # The last one reads nothing any more.
    readers = {client.socket: client for client in clients[:-1]}
    begin, cpu, own_cpu = time.monotonic(), cpu_seconds(monitor.pid), time.process_time()
    memories = []
    next_line = begin
    while process.poll() is None:
        for ready in select.select(list(readers), [], [], 0.1)[0]:
            readers[ready].read()
        now = time.monotonic()
        if now >= next_line:
            memories.append(memory_mb(monitor.pid))
            print(f'  {now - begin:5.0f} s: memory of the server {memories[-1]:6.2f} MB; load {load()}', flush=True)
            next_line = now + 60
    passed = time.monotonic() - begin
    share = (cpu_seconds(monitor.pid) - cpu) / passed
    rates = ', '.join(f'{client.bytes / passed / 1e6:.2f}' for client in clients)
    print(f'  server: {100 * share:.1f} % of a processor (25), memory {memories[0]:.2f} to {max(memories):.2f} MB; '
          f'clients read {rates} MB/s with {100 * (time.process_time() - own_cpu) / passed:.1f} % of a processor')


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('build', nargs='?', default=ROOT / 'build/release', type=pathlib.Path)
    parser.add_argument('--seconds', type=int, default=600)
    parser.add_argument('--without', type=int, default=120)
    parser.add_argument('--modules', type=int, default=60)
    options = parser.parse_args()
    morphbus = options.build.resolve() / 'bin/morphbus'
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        environment = {**os.environ, 'XDG_RUNTIME_DIR': name}
        files = write_snake(folder, options.modules)
        count, ticks = missed(start_run(morphbus, files, options.without, environment))
        print(f'{options.modules} modules without a monitor: {count} missed deadlines in {ticks} ticks; load {load()}', flush=True)
        process = start_run(morphbus, files, options.seconds, environment)
        monitor, port = start_monitor(morphbus, environment)
        print(f'{options.modules} modules with {CLIENTS} clients, one of which does not read')
        watch(monitor, port, process)
        count, ticks = missed(process)
        print(f'  {count} missed deadlines in {ticks} ticks; load {load()}')
        monitor.send_signal(2)
        monitor.communicate()
    return 0


if __name__ == '__main__':
    sys.exit(main())
