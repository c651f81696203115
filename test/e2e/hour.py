#!/usr/bin/env python3
"""An hour of walking (sim time) on a bad bus: the robot walks all the while, no process grows, the log lacks nothing, and
what the processes counted is what the log holds, to the message. The suite has its first seconds; with SECONDS_OF_WALK=3600 in the
environment, as tools/check --all has it, it is an hour.
"""
import collections
import json
import math
import os
import pathlib
import subprocess
import time
import unittest

from gait import CYCLE, FIRST_STEP, MOST_TILT, STEP, HUB, up_of
from support import HASHED, MODEL, PROGRAM, Case, as_json, await_condition, command, decode, each_event, header_of

SECONDS = int(os.environ.get('SECONDS_OF_WALK', '20'))
# The logger, too, misses and mistakes what it can ask for again. HEALTH, RESEND and the like nobody sends again: on their
# way to the logger they are spared, so that it hears each of them and every process's count can be held against the log.
BAD = 'loss=0.02 duplicate=0.02 reorder=0.02 corrupt=0.01'
FAULTS = '\n'.join(['seed 11', f'fault process=m* {BAD}', f'fault process=SIM {BAD}',
                    *(f'fault process=LOG channel={channel} {BAD}'
                      for channel in ('SIM/CLOCK', 'SIM/SENSORS', 'SIM/WORLD', '*/TRANSFORM', '*/ACTUATOR', '*/STATUS'))]) + '\n'


class Hour(Case):
    def setUp(self):
        super().setUp()
        faults = self.folder / 'hour.faults'
        faults.write_text(FAULTS)
        self.log = self.folder / 'hour.log'
        launcher = subprocess.Popen(
            command('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', SECONDS, '--isolate', '--run', 'hour',
                    '--faults', faults, '--log', self.log, '--json'),
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.kill_at_the_end(launcher)
        self.launcher = watch_memory(launcher, 2 * SECONDS + 60)
        out, err = launcher.communicate(timeout=600)
        self.assertEqual(launcher.returncode, 0, err)
        self.run_summary = json.loads(out)

    def test_nothing_grows_and_nothing_is_lost_while_it_walks(self):
        run = self.run_summary
        self.assertEqual((run['ticks'], run['error']), (SECONDS * 50, None))
        info = as_json('info', self.log)
        self.assertTrue(info['clean'] and info['whole'], info['reason'])
        self.assertEqual((info['lost'], info['num_damage'], info['hash']), (0, 0, run['hash']))
        self.read_log()
        # The log has all that was published, each message once.
        for name, totals in info['channels'].items():
            if totals['hashed']:
                self.assertEqual(self.seen[name.removeprefix('hour/')], totals['messages'], name)
        self.assertEqual(sum(self.seen.values()), run['messages'])
        # It was a bad bus for everybody, and what was damaged was found out.
        for process, health in self.last.items():
            self.assertEqual(health.bad, health.corrupted, process)
            for kind in ('discarded', 'doubled', 'delayed', 'corrupted'):
                self.assertGreater(getattr(health, kind), 0, (process, kind))
        # Each process tells its ledger once a second of the wall, and once when the run has ended.
        self.assertGreaterEqual(self.compared, 11 + (11 if SECONDS >= 3600 else 0))
        self.assert_walked()
        self.assert_nothing_grows()

    def read_log(self):
        """Everything that is compared, in one pass over a log that does not fit into memory."""
        self.memory, self.last = collections.defaultdict(list), {}
        self.seen, self.other = collections.Counter(), collections.defaultdict(dict)
        self.walk, self.compared, self.logger_has_ended = {}, 0, False
        for _, _, channel, data in each_event(self.log):
            name = channel.removeprefix('hour/')
            process, _, topic = name.rpartition('/')
            if topic in HASHED:
                # Numbers without a gap: no message is missing, and none is there twice.
                self.assertEqual(header_of(data).sequence, self.seen[name], name)
                self.seen[name] += 1
                if topic == 'WORLD':
                    self.take_world(data)
            elif topic == 'HEALTH':
                self.take_health(process, decode(data))
            elif topic == 'INFO':
                # The description, which stands at the head of the log and which the logger tells once when it begins.
                told = self.other['LOG']
                told[name] = told.get(name, 0) + 1
            elif topic != 'END':
                # RESEND goes out on the channel of who is asked, HELLO and TOTALS on that of all.
                message = decode(data)
                sender = {'RESEND': 'sender', 'HELLO': 'process', 'TOTALS': 'process'}.get(topic)
                self.take_other(name, message, getattr(message, sender) if sender else process)

    def take_other(self, channel, message, process):
        """What the parties tell each other only. Who begins before the logger says some of it to nobody; from then on every
        number is there."""
        told = self.other[process]
        if channel in told:
            self.assertEqual(message.header.sequence, told[channel], channel)
        told[channel] = message.header.sequence + 1

    def other_of(self, process):
        """Messages that a process has published up to here, HEALTH and what counts for the hash left out."""
        return sum(self.other[process].values())

    def take_world(self, data):
        tick = header_of(data).tick
        if tick in self.walk:
            return
        body = next((b for b in decode(data).bodies if b.module_id == HUB), None)
        if body is not None:
            self.walk[tick] = (body.position_m, up_of(body))

    def take_health(self, process, health):
        """What a process has sent is what it has published on channels that count for the hash, which it tells beside,
        and what the log has of its other messages, which come in the order in which they were sent."""
        told = len(self.memory[process])
        self.memory[process].append(health.max_rss_kb)
        self.last[process] = health
        if process == 'LOG' and health.header.sequence == told + 1:
            # The logger's very last ledger is written and not published. It counts one HEALTH more, the one that the logger
            # tells the others when it has ended, and does not hear itself any more.
            self.assertFalse(self.logger_has_ended, 'a HEALTH of LOG is missing')
            self.logger_has_ended = True
            self.assertEqual(health.sent, self.other_of(process) + told + 1)
            return
        self.assertEqual(health.header.sequence, told, f'a HEALTH of {process} is missing')
        published = sum(total.count for total in health.totals)
        self.assertEqual(health.sent, published + told + self.other_of(process), (process, health.header.tick))
        self.compared += 1

    def assert_walked(self):
        """In every cycle of the gait the trunk got further, wherever the robot was heading by then, and stayed upright."""
        first = self.walk[min(self.walk)][1]
        for tick, (_, up) in self.walk.items():
            cosine = sum(a * b for a, b in zip(first, up))
            self.assertLess(math.acos(max(-1, min(1, cosine))), MOST_TILT, f'tick {tick}')
        ticks = range(FIRST_STEP, SECONDS * 50 - CYCLE, CYCLE)
        self.assertGreater(len(ticks), 0)
        way = []
        for tick in ticks:
            (x0, _, z0), (x1, _, z1) = (self.walk[t][0] for t in (tick, tick + CYCLE))
            way.append(math.hypot(x1 - x0, z1 - z0))
            self.assertGreater(way[-1], STEP, f'the cycle from tick {tick} on')
        print(f'{sum(way):.1f} m in {len(way)} cycles of {min(way):.4f} to {max(way):.4f} m')

    def assert_nothing_grows(self):
        self.memory['launcher'] = self.launcher
        self.assertEqual(len(self.memory), 12)
        for process, rows in self.memory.items():
            # What a process needs it has after a tenth of the run, and not before some seconds; half a percent is left for
            # the allocator.
            early = rows[min(len(rows) - 1, max(20, len(rows) // 10))]
            self.assertLessEqual(rows[-1], early * 1.005 + 256, f'{process} grows: {rows[::len(rows) // 10 + 1]} kB')
            print(f'{process}: {early} kB early on, {rows[-1]} kB in the end')


def watch_memory(launcher, seconds):
    """Most memory that a launcher has had so far, in kB, once a second while it has a simulator: when that has ended, it
    reads the whole log for its summary."""
    process = pathlib.Path(f'/proc/{launcher.pid}')

    def has_simulator():
        for child in (process / 'task' / str(launcher.pid) / 'children').read_text().split():
            try:
                words = pathlib.Path(f'/proc/{child}/cmdline').read_bytes().split(b'\0')
            except OSError:
                continue
            if b'sim' in words[1:2]:
                return True
        return False
    await_condition(has_simulator, 'the run has a simulator')
    rows, end = [], time.monotonic() + seconds
    while launcher.poll() is None and has_simulator():
        status = (process / 'status').read_text()
        rows.append(int(status.split('VmHWM:')[1].split()[0]))
        if time.monotonic() > end:
            raise AssertionError(f'the run has not ended after {seconds} s')
        time.sleep(1)
    return rows


if __name__ == '__main__':
    unittest.main()
