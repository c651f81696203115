#!/usr/bin/env python3
"""Real time: the wall sets the pace, and who does not keep it is named."""
import os
import signal
import unittest

from control_live import Live
from support import MODEL, PROGRAM, as_json, morphbus, processes_of


class Realtime(Live):
    def test_a_module_that_stands_still_is_late_by_name(self):
        self.start('--realtime')
        pid = next(pid for pid, text in processes_of('live').items() if '--module m5 ' in text)
        self.control('pause')
        os.kill(pid, signal.SIGSTOP)
        # A fifth of the speed gives the others 100 ms a tick, which is enough on any machine.
        self.control('speed', 0.2)
        # Held, nobody owes anything; each step is a tick that m5 does not answer.
        before = self.control('step', 40)['tick']
        self.await_held(before + 39)
        os.kill(pid, signal.SIGCONT)
        self.control('resume')
        self.reach(before + 45, 0.2)
        seen = as_json('spy', '--run', 'live', '--once', '--seconds', 2.5)['modules']
        self.control('stop')
        summary = self.end()
        for lateness in (seen['m5']['lateness'], summary['lateness']['m5'], as_json('info', self.path)['lateness']['m5']):
            self.assertGreaterEqual(lateness['missed'], 38)
        # What it was told meanwhile lay in its socket, and it answered in the end.
        late = summary['lateness']['m5']
        self.assertGreater(late['late'], 0)
        self.assertGreater(late['worst_us'], 20_000)
        self.assertGreaterEqual(summary['missed_deadlines'], late['missed'])
        for module, other in summary['lateness'].items():
            if module != 'm5':
                self.assertLess(other['missed'], late['missed'], module)
        self.assertRegex(morphbus('info', self.path).stdout, r'm5: \d+ deadlines missed; \d+ answers? came late, [0-9.]+ ms')

    def test_the_clock_does_not_run_ahead_of_the_wall(self):
        for speed in (1, 4):
            summary = as_json('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 2, '--realtime', '--speed', speed,
                              '--isolate', '--log', self.folder / 'x.log', '--force')
            self.assertEqual(summary['ticks'], 100)
            self.assertGreaterEqual(summary['wall_seconds'], 97 * 0.02 / speed)

    def test_steps_at_the_pace_and_speed_while_it_runs(self):
        self.start('--realtime')
        paused = self.control('pause')['tick']
        self.control('speed', 0.5)
        began = self.control('step', 5)['tick']
        self.assertEqual(began, paused + 1)
        self.await_held(paused + 5)
        self.control('speed', 8)
        self.assertEqual(self.control('resume')['tick'], paused + 6)
        self.control('stop')
        self.assertIsNone(self.end()['error'])
        self.assertEqual([c.split()[0] for tick, c in self.commands() if tick >= paused],
                         ['pause', 'speed', 'step', 'speed', 'resume', 'stop'])


if __name__ == '__main__':
    unittest.main()
