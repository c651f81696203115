#!/usr/bin/env python3
"""Real time: the clock waits for nobody, and who does not keep it is named. In one process it is a virtual one, lateness comes
from a file of faults, and a run repeats to the bit; on the machine's own clock two things remain to be seen."""
import os
import signal
import unittest

from control_live import Live
from support import MODEL, PROGRAM, Case, as_json, content, morphbus, processes_of, read_events

QUADRUPED = (MODEL, PROGRAM, '--robot', 'quadruped')


class Realtime(Case):
    def run_once(self, faults='', *options, seconds=4, name='x'):
        rules = self.folder / 'x.faults'
        rules.write_text(faults)
        self.path = self.folder / f'{name}.log'
        self.summary = as_json('run', *QUADRUPED, '--realtime', '--inproc', '--run', 'x', '--seconds', seconds, '--faults', rules,
                               '--log', self.path, '--force', *options)
        self.assertIsNone(self.summary['error'])
        self.assertEqual(self.summary['ticks'], seconds * 50)
        return self.summary

    def contents(self):
        """All that the log holds of the run, but for its key, its description and what each process tells of the machine."""
        return [(channel, content(data)) for _, _, channel, data in read_events(self.path)
                if channel.split('/')[-1] not in ('HELLO', 'HEALTH', 'INFO', 'END')]

    def test_whoever_answers_at_once_is_never_late(self):
        summary = self.run_once()
        self.assertEqual((summary['missed_deadlines'], summary['lateness'], summary['lost']), (0, {}, 0))
        self.assertNotIn(None, summary['roles'].values())
        self.assertTrue(as_json('info', self.path)['clean'])
        # On the virtual clock nobody waits for the machine's: the pace only says how long a tick is.
        self.assertEqual(as_json('info', self.path)['description']['mode'], 'realtime')

    def test_a_module_whose_answers_are_late_is_named_with_how_late(self):
        summary = self.run_once('fault process=SIM channel=m5/ACTUATOR from=20 until=120 late=1 by=0.1s\n')
        late = summary['lateness']['m5']
        self.assertEqual(set(summary['lateness']), {'m5'})
        self.assertEqual(summary['missed_deadlines'], late['missed'])
        # Of a hundred answers four fifths are late by more than the tick of 20 ms.
        self.assertGreater(late['missed'], 60)
        self.assertLess(late['missed'], 100)
        self.assertEqual(late['late'], late['missed'])
        self.assertGreater(late['worst_us'], 60_000)
        self.assertLessEqual(late['worst_us'], 80_000)
        self.assertEqual(as_json('info', self.path)['lateness'], summary['lateness'])
        self.assertRegex(morphbus('info', self.path).stdout, r'm5: \d+ deadlines missed; \d+ answers? came late, [0-9.]+ ms')

    def test_a_module_that_says_nothing_has_missed_every_tick(self):
        summary = self.run_once('fault process=m5 channel=SIM/SENSORS from=20 until=60 loss=1\n')
        self.assertEqual(summary['lateness'], {'m5': {'missed': 40, 'late': 0, 'worst_us': 0}})

    def test_the_pace_says_how_late_is_too_late(self):
        late = 'fault process=SIM channel=m5/ACTUATOR late=1 by=0.015s\n'
        self.assertEqual(self.run_once(late)['missed_deadlines'], 0)
        # Four times as fast a tick has 5 ms.
        self.assertGreater(self.run_once(late, '--speed', 4)['lateness']['m5']['missed'], 80)

    def test_one_seed_is_one_run_and_another_is_another(self):
        late = 'fault channel=*/TRANSFORM late=0.3 by=0.05s\nfault process=SIM channel=*/ACTUATOR late=0.1 by=0.05s\n'
        seen = []
        for name, seed in (('one', 1), ('again', 1), ('other', 2)):
            summary = self.run_once(late, '--loss', 0.05, '--seed', seed, name=name)
            self.assertGreater(summary['missed_deadlines'], 0)
            seen.append((summary['lateness'], summary['processes'], self.contents()))
        self.assertEqual(seen[0], seen[1])
        self.assertNotEqual(seen[0][0], seen[2][0])
        self.assertNotEqual(seen[0][2], seen[2][2])

    def test_loss_is_counted_and_no_failure(self):
        summary = self.run_once('', '--loss', 0.01, seconds=3)
        self.assertGreater(summary['lost'], 0)
        facts = as_json('info', self.path)
        self.assertTrue(facts['clean'], facts['reason'])
        self.assertLessEqual(len(facts['reason'].encode()), 200)

    def test_the_clock_does_not_wait_for_a_farewell(self):
        script = self.folder / 'script'
        script.write_text('40 restart m7 --cold\n')
        summary = self.run_once('', '--lose', 'm6@0.5', '--commands', script)
        self.assertEqual((summary['lost_modules'], summary['missed_deadlines']), ({'m6': 0.5}, 0))

    def test_commands_of_a_script(self):
        script = self.folder / 'script'
        lines = ['60 pause', '61 speed 0.5', '61 step 5', '66 speed 8', '66 resume', '80 push m5 EAST 20', '90 inspect m1', '150 stop']
        script.write_text('\n'.join(lines) + '\n')
        summary = as_json('run', *QUADRUPED, '--realtime', '--inproc', '--commands', script, '--log', self.folder / 'x.log')
        self.assertEqual((summary['ended'], summary['ticks'], summary['missed_deadlines']), ('stopped by command', 150, 0))
        self.assertEqual([f'{c["tick"]} {c["command"]}' for c in as_json('info', self.folder / 'x.log')['commands']], lines)


class WallClock(Live):
    def test_the_clock_does_not_run_ahead_of_the_wall(self):
        for speed in (1, 4):
            summary = as_json('run', *QUADRUPED, '--seconds', 2, '--realtime', '--speed', speed, '--isolate', '--log',
                              self.folder / 'x.log', '--force')
            self.assertEqual(summary['ticks'], 100)
            self.assertGreaterEqual(summary['wall_seconds'], 97 * 0.02 / speed)

    def test_a_process_that_stands_still_is_late_by_name(self):
        self.start('--realtime')
        pid = next(pid for pid, text in processes_of('live').items() if '--module m5 ' in text)
        self.control('pause')
        os.kill(pid, signal.SIGSTOP)
        # A fifth of the speed gives the others 100 ms a tick.
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


if __name__ == '__main__':
    unittest.main()
