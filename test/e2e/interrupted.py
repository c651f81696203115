#!/usr/bin/env python3
"""Commands that are interrupted leave nothing half written, and what is no log becomes no file."""
import os
import pathlib
import pty
import shutil
import signal
import subprocess

from support import BIN, LIMIT, MODEL, PROGRAM, ShortRun, await_condition, command, morphbus

# So many zeros (bytes) follow the log, which take no room on the disk: whoever looks for the next event behind them is still
# at it when the signal comes, on the fastest machine too.
ENDLESS = 1 << 42


class Interrupted(ShortRun):
    SECONDS = 1

    def files(self):
        return set(os.listdir(self.folder))

    def test_a_signal_removes_what_is_half_written(self):
        log = self.folder / 'endless.log'
        shutil.copy(self.short, log)
        os.truncate(log, ENDLESS)
        before = self.files()
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            for arguments in (('convert', log, '--to', 'json', '-o', self.folder / 'o.json'),
                              ('convert', log, '--to', 'mcap', '-o', self.folder / 'o.mcap'),
                              ('convert', log, '--to', 'zst', '-o', self.folder / 'o.log.zst'),
                              ('repair', log, '-o', self.folder / 'o.log')):
                process = subprocess.Popen(command(*arguments), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
                self.kill_at_the_end(process)
                await_condition(lambda: self.files() - before, 'something is written')
                process.send_signal(number)
                self.assertEqual(process.wait(timeout=LIMIT), -number, arguments)
                self.assertEqual(self.files(), before, arguments)

    def shown_on_a_terminal(self, *arguments):
        master, slave = pty.openpty()
        self.addCleanup(os.close, master)
        process = subprocess.Popen(command(*arguments), stdout=subprocess.DEVNULL, stderr=slave,
                                   env={**os.environ, 'TERM': 'xterm'})
        os.close(slave)
        shown = b''
        while True:
            try:
                piece = os.read(master, 65536)
            except OSError:  # Linux says so that nobody holds the other end any more
                break
            if not piece:
                break
            shown += piece
        self.assertEqual(process.wait(timeout=LIMIT), 0, shown)
        self.assertTrue(shown.endswith(b'\r\x1b[K'), shown[-80:])
        return shown.decode()

    def test_a_terminal_is_told_how_far_the_work_is(self):
        # Long enough that it is told more than once: it is told of every MiB.
        log = self.folder / 'many.log'
        log.write_bytes(pathlib.Path(self.short).read_bytes() * 20)
        self.assertRegex(self.shown_on_a_terminal('convert', log, '--to', 'json', '-o', self.folder / 'o.json'),
                         r'many\.log \[#*\.*\] \d+ %')
        self.assertRegex(self.shown_on_a_terminal('draw', self.short, '--video', '-o', self.folder / 'o.webp', '--fps', 5),
                         r'o\.webp \[#*\.*\] \d+ %')

    def test_what_is_no_log_becomes_no_file(self):
        garbage = self.folder / 'garbage'
        garbage.write_bytes(bytes(range(1, 251)) * 80)
        before = self.files()
        for form in ('json', 'mcap', 'zst', 'csv'):
            morphbus('convert', garbage, '--to', form, '-o', self.folder / f'out.{form}', status=2)
            self.assertEqual(self.files(), before, form)


class Refused(ShortRun):
    SECONDS = 1
    RUNS = ('run', MODEL, PROGRAM, '--robot', 'quadruped')

    def test_empty_values(self):
        for option in ('--seconds', '--log', '--run'):
            for words in ((option, ''), (f'{option}=',)):
                said = morphbus(*self.RUNS, '--inproc', *words, status=2).stderr
                self.assertIn(f'{option}: its value is empty', said)

    def test_a_named_pipe_is_not_waited_for(self):
        pipe = self.folder / 'pipe'
        os.mkfifo(pipe)
        briefly = (*self.RUNS, '--seconds', 1, '--inproc')
        for arguments in (('run', MODEL, pipe, '--robot', 'quadruped', '--seconds', 1, '--inproc'), ('check', pipe),
                          *((*briefly, option, pipe) for option in ('--world', '--faults', '--commands')),
                          ('disasm', pipe), ('compile', PROGRAM, '--keywords', pipe, '-o', self.folder / 'x.image'),
                          ('spy', '--once', '--types', pipe)):
            self.assertIn('named pipe', morphbus(*arguments, status=2).stderr, arguments)

    def test_a_shells_pipe_is_read(self):
        script = '"$0" roles "$1" <(cat "$2") --robot quadruped && "$0" check <(cat "$1")'
        done = subprocess.run(['bash', '-c', script, BIN / 'morphbus', MODEL, PROGRAM], capture_output=True, text=True,
                              timeout=LIMIT)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue(done.stdout)

    def test_providers_that_carry_no_run(self):
        for url in ('memq://', 'tcpq://x', f'file://{self.folder}/x'):
            said = morphbus(*self.RUNS, '--seconds', 1, '--lcm-url', url, status=2).stderr
            self.assertIn('cannot carry a run', said)

    def test_a_name_that_has_no_room_for_its_ending(self):
        said = morphbus(*self.RUNS, '--seconds', 1, '--inproc', '--log', self.folder / ('x' * 250), status=2).stderr
        self.assertIn('its name is too long', said)


if __name__ == '__main__':
    import unittest
    unittest.main()
