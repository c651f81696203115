#!/usr/bin/env python3
"""How runs end that do not go as planned: whoever failed is named, by every process that knows, and no END
says `clean` that is not."""
import subprocess
import unittest

from support import LIMIT, MODEL, PROGRAM, Case, command, decode, new_key, read_events


def end_of(path):
    """The END event of a log."""
    _, _, channel, data = read_events(path)[-1]
    assert channel.endswith('/END'), channel
    return decode(data)


class Endings(Case):
    def by_hand(self, what, *arguments):
        return subprocess.Popen(command(what, MODEL, PROGRAM, '--robot', 'quadruped', '--run', 'hand', '--seconds', 2,
                                        *arguments), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def test_who_has_another_key_is_told_so(self):
        if not self.in_private_network():
            return
        keys = []
        for name in ('sim', 'log'):
            (self.folder / name).mkdir()
            keys.append(new_key(self.folder / name))
        log = self.by_hand('log', '-o', self.folder / 'hand.log', '--key', keys[1])
        sim = self.by_hand('sim', '--give-up', 6, '--key', keys[0])
        _, said = sim.communicate(timeout=LIMIT)
        self.assertEqual(sim.returncode, 3, said)
        self.assertRegex(said, r"waiting for m1, .*to join; \d+ messages? without the run's key came "
                               r'\(the first on HELLO\): has everybody the same --key\?')
        _, said = log.communicate(timeout=LIMIT)
        self.assertEqual(log.returncode, 3, said)
        self.assertRegex(said, r"nothing heard from run 'hand' any more; \d+ messages? without the run's key came")

    def test_modules_that_never_come_are_named_by_sim_and_log(self):
        if not self.in_private_network():
            return
        path = self.folder / 'hand.log'
        log = self.by_hand('log', '-o', path, '--open')
        sim = self.by_hand('sim', '--give-up', 6, '--open')
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
