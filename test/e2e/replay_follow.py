#!/usr/bin/env python3
"""morphbus log --follow: what a replay publishes as fast as it can comes whole and once, over real sockets."""
import collections
import subprocess
import unittest

from support import HASHED, MODEL, PROGRAM, Case, as_json, await_condition, command, morphbus, read_events


class Follow(Case):
    def setUp(self):
        super().setUp()
        self.log = self.folder / 'walk.log'
        morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 10, '--inproc', '--run', 'walk',
                 '--log', self.log)

    def follow(self, *options):
        """A replay in a network of its own, and what two followers recorded of it."""
        replay = subprocess.Popen(command('replay', self.log, '--isolate', '--wait-for', 2, '--json', *options),
                                  stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.kill_at_the_end(replay)
        listed = await_condition(lambda: as_json('runs')['runs'], 'the replay is listed')
        copies = [self.folder / f'copy{i}.log' for i in range(2)]
        followers = [subprocess.Popen(command('log', '--follow', 'walk', '--run', listed[0]['run'], '-o', copy),
                                      stdout=subprocess.PIPE, text=True) for copy in copies]
        for follower in followers:
            self.kill_at_the_end(follower)
        for follower in followers:
            self.assertEqual(follower.wait(240), 0)
        replay.wait(60)
        return [[event[2:] for event in read_events(copy)] for copy in copies]

    def published(self, wanted):
        return [event[2:] for event in read_events(self.log)
                if event[2].split('/')[-1] in HASHED | {'HEALTH', 'INFO'} and wanted(event[2])]

    def test_every_message_comes_exactly_once_and_in_order_at_the_highest_speed(self):
        expected = self.published(lambda channel: True)
        for got in self.follow('--speed', 0):
            self.assertEqual(collections.Counter(channel for channel, _ in got),
                             collections.Counter(channel for channel, _ in expected))
            self.assertEqual(got, expected)

    def test_a_log_is_cut_by_channel(self):
        expected = self.published(lambda channel: channel.endswith('/STATUS'))
        for got in self.follow('--speed', 50, '--channel', 'walk/.*/STATUS'):
            self.assertEqual(got, expected)


if __name__ == '__main__':
    unittest.main()
