#!/usr/bin/env python3
"""An hour of walking (sim time) on a bad bus: no process grows, the log lacks nothing, and what the processes counted is
what the log holds. No part of the suite: tools/check --all runs it. SECONDS_OF_WALK in the environment makes it shorter.
"""
import collections
import os
import unittest

from support import MODEL, PROGRAM, Case, as_json, decode, read_events

SECONDS = int(os.environ.get('SECONDS_OF_WALK', '3600'))
# The logger is spared, so that it hears every message that was sent, those that are not asked for again included.
FAULTS = """seed 11
fault process=m* loss=0.02 duplicate=0.02 reorder=0.02 corrupt=0.01
fault process=SIM loss=0.02 duplicate=0.02 reorder=0.02 corrupt=0.01
"""
HASHED = ('CLOCK', 'SENSORS', 'WORLD', 'TRANSFORM', 'ACTUATOR', 'STATUS')


class Hour(Case):
    def setUp(self):
        super().setUp()
        faults = self.folder / 'hour.faults'
        faults.write_text(FAULTS)
        self.log = self.folder / 'hour.log'
        self.run_summary = as_json('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', SECONDS, '--isolate',
                                   '--run', 'hour', '--faults', faults, '--log', self.log, timeout=2 * SECONDS)

    def test_nothing_grows_and_nothing_is_lost(self):
        run = self.run_summary
        self.assertEqual(run['ticks'], SECONDS * 50)
        info = as_json('info', self.log)
        self.assertTrue(info['clean'] and info['whole'], info['reason'])
        self.assertEqual((info['lost'], info['num_damage'], info['hash']), (0, 0, run['hash']))
        memory, last, sent = collections.defaultdict(list), {}, collections.Counter()
        seen = collections.Counter()
        for _, _, channel, data in read_events(self.log):
            _, _, topic = channel.rpartition('/')
            if topic in ('END', 'CONTROL'):
                continue
            if topic == 'INFO':
                # The logger tells the run's description.
                sent['LOG'] += 1
                continue
            process = channel.split('/')[1]
            if topic in HASHED:
                seen[channel.removeprefix('hour/')] += 1
            elif topic == 'HEALTH':
                last[process] = decode(data)
                memory[process].append(last[process].max_rss_kb)
            else:
                message = decode(data)
                process = message.sender if topic == 'ASK' else message.process
            sent[process] += 1
        for name, totals in info['channels'].items():
            if totals['hashed']:
                self.assertEqual(seen[name.removeprefix('hour/')], totals['messages'], name)
        self.assertEqual(sum(seen.values()), run['messages'])
        for process, health in last.items():
            # The last ledgers are sent when the logger has left, or nearly so.
            self.assertLessEqual(abs(sent[process] - health.sent), 3, process)
            rows = memory[process]
            # What a process needs it has after a tenth of the run; half a percent is left for the allocator.
            self.assertLessEqual(rows[-1], rows[len(rows) // 10] * 1.005 + 256, f'{process} grows: {rows[::len(rows) // 10]} kB')
        print({process: (rows[len(rows) // 10], rows[-1]) for process, rows in memory.items()})


if __name__ == '__main__':
    unittest.main()
