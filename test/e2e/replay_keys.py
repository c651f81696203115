#!/usr/bin/env python3
"""morphbus replay in a terminal: what each key does, as the line of progress tells it."""
import os
import pty
import re
import select
import subprocess
import termios
import time
import unittest

from support import LIMIT, MODEL, PROGRAM, Case, command, morphbus

LEFT, RIGHT, PAGE_DOWN, HOME = '\x1b[D', '\x1b[C', '\x1b[6~', '\x1b[H'


class Terminal:
    """A pseudo-terminal with a replay in it, which is told keys and whose lines are read."""

    def __init__(self, case, *arguments):
        self.master, slave = pty.openpty()
        self.slave = slave
        case.addCleanup(os.close, self.master)
        case.addCleanup(os.close, slave)
        self.mode = termios.tcgetattr(slave)

        def own_terminal():
            os.setsid()
            import fcntl
            fcntl.ioctl(0, termios.TIOCSCTTY, 0)

        self.process = subprocess.Popen(command('replay', *arguments), stdin=slave, stdout=subprocess.PIPE, stderr=slave,
                                        preexec_fn=own_terminal, env={**os.environ, 'TERM': 'xterm', 'NO_COLOR': ''})
        case.kill_at_the_end(self.process)
        self.text = ''

    def press(self, keys):
        """What was shown before does not count any more."""
        self.text = ''
        os.write(self.master, keys.encode())

    def await_line(self, pattern, seconds=LIMIT):
        """Reads until a line of progress matches; the time is a limit, never an expectation."""
        limit = time.monotonic() + seconds
        while time.monotonic() < limit:
            # A line is whole once the next one begins.
            for line in self.text.split('\r\x1b[K')[1:-1]:
                found = re.search(pattern, line)
                if found:
                    return found
            if select.select([self.master], [], [], 1)[0]:
                self.text += os.read(self.master, 65536).decode(errors='replace')
        raise AssertionError(f'{pattern}: not within {seconds} s after\n{self.text[-500:]!r}')


class ReplayKeys(Case):
    def setUp(self):
        super().setUp()
        self.log = self.folder / 'short.log'
        morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 30, '--still', '--inproc', '--run', 'short',
                 '--log', self.log)

    def test_every_key_does_what_the_help_says(self):
        terminal = Terminal(self, self.log, '--isolate', '--paused')
        terminal.await_line(r'^0\.00 of 30\.00 s, 1 x, 0 messages, paused')
        terminal.press('.')
        first = int(terminal.await_line(r', ([1-9]\d*) messages, paused')[1])
        terminal.press('..')
        terminal.await_line(r'^0\.0[24] of')
        terminal.press(RIGHT)
        self.assertGreater(int(terminal.await_line(r'^1\.0[24] of .* (\d+) messages, paused')[1]), first)
        terminal.press(PAGE_DOWN)
        terminal.await_line(r'^11\.0[24] of .* paused')
        terminal.press(LEFT)
        terminal.await_line(r'^10\.0[24] of .* paused')
        terminal.press('-')
        terminal.await_line(r' 0\.5 x, .*paused')
        terminal.press('++++')
        terminal.await_line(r' 8 x, .*paused')
        terminal.press(PAGE_DOWN * 5)
        terminal.await_line(r'^(29|30)\.\d\d of .* paused')
        terminal.press(HOME)
        terminal.await_line(r'^0\.00 of .* paused')
        terminal.press(' ')
        terminal.await_line(r'^[1-9]\d?\.\d\d of .* messages$')
        terminal.press(' ')
        terminal.await_line(r'paused')
        terminal.press('q')
        self.assertIn(b'messages published', terminal.process.stdout.read())
        self.assertEqual(terminal.process.wait(60), 0)
        self.assertEqual(termios.tcgetattr(terminal.slave), terminal.mode)

    def test_ctrl_c_restores_the_terminal(self):
        terminal = Terminal(self, self.log, '--isolate', '--paused')
        terminal.await_line('paused')
        self.assertNotEqual(termios.tcgetattr(terminal.slave), terminal.mode)
        terminal.press('\x03')
        terminal.process.stdout.read()
        terminal.process.wait(60)
        self.assertEqual(termios.tcgetattr(terminal.slave), terminal.mode)

    def test_a_loop_begins_again_and_again(self):
        terminal = Terminal(self, self.log, '--isolate', '--loop', '--speed', 0)
        count = int(terminal.await_line(r', (\d{6,}) messages')[1])
        self.assertGreater(count, 100_000)
        terminal.press('q')
        terminal.process.stdout.read()
        self.assertEqual(terminal.process.wait(60), 0)


if __name__ == '__main__':
    unittest.main()
