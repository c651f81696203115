#!/usr/bin/env python3
"""How runs end that do not go as planned: whoever failed is named, by every process that knows, and no END
says `clean` that is not."""
import os
import subprocess
import unittest

from support import BIN, LIMIT, MODEL, PROGRAM, Case, command, decode, read_events


def end_of(path):
    """The END event of a log."""
    _, _, channel, data = read_events(path)[-1]
    assert channel.endswith('/END'), channel
    return decode(data)


class Endings(Case):
    def by_hand(self, what, *arguments, **options):
        return subprocess.Popen(command(what, MODEL, PROGRAM, '--robot', 'quadruped', '--run', 'hand', '--seconds', 2,
                                        '--open', *arguments), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)

    def test_modules_that_never_come_are_named_by_sim_and_log(self):
        if os.environ.get('MORPHBUS_PRIVATE_NETWORK') is None:
            # The processes of this test meet on a network that they share with nobody else.
            done = subprocess.run([str(BIN / 'isolated'), 'python3', __file__, f'Endings.{self._testMethodName}'],
                                  env={**os.environ, 'MORPHBUS_PRIVATE_NETWORK': '1'}, capture_output=True, text=True,
                                  timeout=LIMIT)
            return self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        path = self.folder / 'hand.log'
        log = self.by_hand('log', '-o', path)
        sim = self.by_hand('sim', '--give-up', 6)
        _, said = sim.communicate(timeout=LIMIT)
        self.assertEqual(sim.returncode, 3, said)
        self.assertRegex(said, r'waiting for m1, m2, .*m9 to join')
        self.assertRegex(said, r'm1, m2, m3 and 6 more do not answer \(the run had not begun\)')
        self.assertNotIn('LOG', said)
        _, said = log.communicate(timeout=LIMIT)
        self.assertEqual(log.returncode, 3, said)
        self.assertRegex(said, r'm1, m2, m3 and 6 more do not answer')
        self.assertFalse(end_of(path).clean)


if __name__ == '__main__':
    unittest.main()
