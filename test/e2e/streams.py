#!/usr/bin/env python3
"""Standard streams that are closed, full or without a reader: what cannot be said is no reason to stop, and a result that
cannot be written is status 2."""
import os
import pathlib
import signal
import subprocess
import unittest

from support import BIN, MODEL, PROGRAM, Case, await_condition, command, processes_of, read_events

ROBOT = ('--robot', 'quadruped')
FULL = pathlib.Path('/dev/full')


class Streams(Case):
    def shell(self, redirections, *arguments):
        """Runs `morphbus ARGUMENTS` by a shell that redirects its streams; returns the status."""
        done = subprocess.run(['sh', '-c', f'exec "$@" {redirections}', 'sh', *command(*arguments)], timeout=120,
                              capture_output=True, text=True)
        self.assertNotIn('terminate called', done.stderr)
        return done.returncode

    def broken_streams(self):
        """Redirections of stderr to where nothing can be written."""
        return ['2>&-'] + (['2>/dev/full'] if FULL.exists() else [])

    def test_a_warning_that_cannot_be_said_stops_no_command(self):
        broken = self.folder / 'broken.m3l'
        broken.write_text('module {')
        for stderr in self.broken_streams():
            self.assertEqual(self.shell(stderr, 'check', MODEL), 0, stderr)
            self.assertEqual(self.shell(stderr, 'check', broken), 2, stderr)
            self.assertEqual(self.shell(stderr, 'nonsense'), 2, stderr)
            self.assertEqual(self.shell(stderr, 'variants', MODEL, *ROBOT, '--max', 1, '-o', self.folder / 'v.m3l',
                                        '--force'), 0, stderr)

    def test_a_result_that_cannot_be_written_is_status_2(self):
        for stdout in ['>&-'] + (['>/dev/full'] if FULL.exists() else []):
            for arguments in (('check', MODEL), ('connections', MODEL, '--json'), ('--help',), ('--version',),
                              ('check', '--help'), ('graph', MODEL, *ROBOT, '--json'),
                              ('export', MODEL, *ROBOT, '--to', 'mjcf', '-o', '-')):
                self.assertEqual(self.shell(stdout, *arguments), 2, (stdout, arguments))
                self.assertEqual(self.shell(f'{stdout} 2>&-', *arguments), 2, (stdout, arguments))

    def test_a_closed_stream_does_not_become_a_file_of_ours(self):
        log = self.folder / 'walk.log'
        run = ('run', MODEL, PROGRAM, *ROBOT, '--seconds', 1, '--inproc', '--log', log)
        # What is said of the run must not stand among the log's events.
        self.assertEqual(self.shell('<&- >&- 2>&-', *run), 2)
        self.assertGreater(len(read_events(log)), 100)

    def start(self, name, stdout, stderr):
        log = self.folder / f'{name}.log'
        process = subprocess.Popen(command('run', MODEL, PROGRAM, *ROBOT, '--isolate', '--run', name, '--log', log,
                                           '--seconds', 6), stdout=stdout, stderr=stderr)
        self.kill_at_the_end(process)
        partial = self.folder / f'{name}.log.partial'
        await_condition(lambda: partial.exists() and partial.stat().st_size > 100000, 'the run is under way')
        return process, log

    def kill_a_module(self, name):
        """Which the launcher warns of, on stderr."""
        pids = [pid for pid, text in processes_of(name).items() if '--module m5 ' in text]
        self.assertEqual(len(pids), 1)
        os.kill(pids[0], signal.SIGKILL)

    @unittest.skipUnless(FULL.exists(), 'no /dev/full')
    def test_a_warning_that_cannot_be_said_ends_no_run(self):
        with open('/dev/full', 'w') as full:
            process, log = self.start('full', subprocess.DEVNULL, full)
            self.kill_a_module('full')
            self.assertEqual(process.wait(timeout=120), 0)
        self.assertTrue(read_events(log)[-1][2].endswith('/END'))

    def test_a_run_whose_reader_went_away_ends_as_it_should(self):
        # As behind `2>&1 | head -1`, whose reader is gone before anything is said.
        reader, writer = os.pipe()
        os.close(reader)
        process, log = self.start('head', writer, writer)
        os.close(writer)
        self.kill_a_module('head')
        # The log is whole; the summary had nobody who read it.
        self.assertEqual(process.wait(timeout=120), 2)
        self.assertTrue(read_events(log)[-1][2].endswith('/END'))

    def test_a_modules_process_bears_it_as_well(self):
        module = [str(BIN / 'morphbus-module'), '--run', 'walk', '--module', 'm1', '--id', '0', '--kinematics', 'none',
                  '--program', 'none', '--open']
        for redirections in ('>&- 2>&-', '2>/dev/full' if FULL.exists() else '2>&-'):
            done = subprocess.run(['sh', '-c', f'exec "$@" {redirections}', 'sh', *module], timeout=60)
            self.assertEqual(done.returncode, 2, redirections)


if __name__ == '__main__':
    unittest.main()
