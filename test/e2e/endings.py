#!/usr/bin/env python3
"""How runs end that do not go as planned: whoever failed is named, by every process that knows, and no END
says `clean` that is not."""
import os
import signal
import subprocess
import unittest

from support import BIN, MODEL, PROGRAM, Case, as_json, await_condition, command, decode, morphbus, processes_of, read_events


def end_of(path):
    """The END event of a log."""
    _, _, channel, data = read_events(path)[-1]
    assert channel.endswith('/END'), channel
    return decode(data)


class Endings(Case):
    def test_a_module_stopped_for_ever_is_named_by_all(self):
        log = self.folder / 'stopped.log'
        run = subprocess.Popen(command('run', MODEL, PROGRAM, '--robot', 'quadruped', '--isolate', '--run', 'stopped',
                                       '--log', log, '--json'), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(run.communicate)
        self.addCleanup(run.kill)
        partial = self.folder / 'stopped.log.partial'
        await_condition(lambda: partial.exists() and partial.stat().st_size > 300000, 'the run is under way')
        pids = [pid for pid, text in processes_of('stopped').items() if '--module m5 ' in text]
        os.kill(pids[0], signal.SIGSTOP)
        out, err = run.communicate(timeout=60)
        self.assertEqual(run.returncode, 3, out + err)
        self.assertIn('m5 does not answer', err)
        end = end_of(log)
        self.assertFalse(end.clean)
        self.assertEqual(end.reason, 'm5 does not answer')
        self.assertIn('not clean: m5 does not answer', morphbus('verify', log).stdout)

    def by_hand(self, what, *arguments, **options):
        return subprocess.Popen(command(what, MODEL, PROGRAM, '--robot', 'quadruped', '--run', 'hand', '--seconds', 2,
                                        *arguments), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)

    def test_modules_that_never_come_are_named_by_sim_and_log(self):
        if os.environ.get('MORPHBUS_PRIVATE_NETWORK') is None:
            # The processes of this test meet on a network that they share with nobody else.
            done = subprocess.run([str(BIN / 'isolated'), 'python3', __file__, f'Endings.{self._testMethodName}'],
                                  env={**os.environ, 'MORPHBUS_PRIVATE_NETWORK': '1'}, capture_output=True, text=True,
                                  timeout=120)
            return self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        path = self.folder / 'hand.log'
        log = self.by_hand('log', '-o', path)
        sim = self.by_hand('sim', '--give-up', 6)
        _, said = sim.communicate(timeout=60)
        self.assertEqual(sim.returncode, 3, said)
        self.assertRegex(said, r'waiting for m1, m2, .*m9 to join')
        self.assertRegex(said, r'm1, m2, .*m9 do not answer \(the run had not begun\)')
        self.assertNotIn('LOG', said)
        _, said = log.communicate(timeout=60)
        self.assertEqual(log.returncode, 3, said)
        self.assertRegex(said, r'm1, m2, .*m9 do not answer')
        self.assertFalse(end_of(path).clean)

    def test_loss_in_real_time_is_counted_and_no_failure(self):
        log = self.folder / 'lossy.log'
        summary = as_json('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 3, '--realtime', '--loss', 0.01,
                          '--isolate', '--run', 'lossy', '--log', log)
        self.assertIsNone(summary['error'])
        self.assertGreater(summary['lost'], 0)
        end = end_of(log)
        self.assertTrue(end.clean, end.reason)
        self.assertLessEqual(len(end.reason.encode()), 200)
        morphbus('info', log)


if __name__ == '__main__':
    unittest.main()
