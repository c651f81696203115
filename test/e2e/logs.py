#!/usr/bin/env python3
"""The commands for runs and logs, when they are asked for what cannot be: status 2, at once, and why."""
import os
import re
import shutil
import subprocess
import tempfile
import unittest

from support import MODEL, PROGRAM, Case, as_json, command, morphbus


class Logs(Case):
    """Questions to one short log of a run called "short"."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.mkdtemp(prefix='morphbus-e2e-')
        cls.addClassCleanup(shutil.rmtree, folder)
        cls.short = f'{folder}/short.log'
        os.environ['XDG_RUNTIME_DIR'] = folder
        morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 2, '--inproc', '--run', 'short',
                 '--log', cls.short)

    def refused(self, *arguments, **options):
        """What is said on stderr by a command that must end with status 2 and print nothing else."""
        options.setdefault('timeout', 60)
        done = morphbus(*arguments, status=2, **options)
        self.assertEqual(done.stdout, '', arguments)
        return done.stderr

    def test_a_run_that_a_log_does_not_hold_is_named_with_those_it_holds(self):
        for arguments in (('info', self.short), ('verify', self.short), ('info', self.short, '--json'),
                          ('draw', self.short, '--at', 1, '-o', self.folder / 'x.svg')):
            self.assertIn(f"no run 'nope' in {self.short}; it holds short", self.refused(*arguments, '--run', 'nope'))
        morphbus('verify', self.short, '--run', 'short')

    def test_spy_takes_no_time_that_never_ends(self):
        for option in ('--seconds', '--interval'):
            for value in ('nan', 'inf', '-1'):
                self.assertIn(option, self.refused('spy', '--once', f'{option}={value}'))

    def test_a_log_that_cannot_be_written_ends_the_run_before_it_starts(self):
        (self.folder / 'walk.log.partial').mkdir()
        os.mkfifo(self.folder / 'pipe')
        for log, why in ((self.folder, 'is a folder'), (f'{self.folder}/', 'is a folder'),
                         (self.folder / 'walk.log', r'walk\.log\.partial is a folder'),
                         (self.folder / 'pipe', 'is no file'), (self.folder / 'none' / 'x.log', 'No such file')):
            for how in ('--inproc', '--isolate'):
                self.assertRegex(self.refused('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 1, how,
                                              '--log', log), f'cannot write .*{why}')


if __name__ == '__main__':
    unittest.main()
