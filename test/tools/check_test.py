#!/usr/bin/env python3
"""tools/check and tools/demo in a folder whose lints say that they ran and which has nothing to build."""
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(os.environ.get('MORPHBUS_SOURCE', pathlib.Path(__file__).resolve().parents[2]))


class CheckTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        lints = self.folder / 'tools' / 'lint'
        lints.mkdir(parents=True)
        for program in ('check', 'demo'):
            shutil.copy(ROOT / 'tools' / program, self.folder / 'tools' / program)
        for tool in ['setup', *(f'lint/{lint.name}' for lint in (ROOT / 'tools' / 'lint').iterdir())]:
            stub = self.folder / 'tools' / tool
            stub.write_text('#!/bin/sh\necho "ran ${0##*/}"\n')
            stub.chmod(0o755)

    def check(self, *options):
        done = subprocess.run([self.folder / 'tools' / 'check', *options], capture_output=True, text=True)
        return done.returncode, [line.removeprefix('ran ') for line in done.stdout.splitlines() if line.startswith('ran ')], done

    def test_it_begins_with_the_step_that_is_named(self):
        status, ran, done = self.check('--from', 'printing')
        self.assertEqual(ran, ['printing', 'glossary'])
        # The steps before it stand in the table, and the first that fails, the build, ends it.
        self.assertRegex(done.stdout, r'(?m)^layers +left out$')
        self.assertIn('FAILED in: build', done.stderr)
        self.assertEqual(status, 1)

    def test_a_script_that_looks_for_python_is_asked_once(self):
        script = self.folder / 'bin' / 'python3'
        script.parent.mkdir()
        script.write_text(f'#!/bin/sh\nexec {sys.executable} "$@"\n')
        script.chmod(0o755)
        (self.folder / 'tools' / 'lint' / 'printing').write_text('#!/bin/sh\necho "ran $(command -v python3)"\n')
        done = subprocess.run([self.folder / 'tools' / 'check'], capture_output=True, text=True,
                              env={**os.environ, 'PATH': f'{script.parent}{os.pathsep}{os.environ["PATH"]}'})
        self.assertIn(f'ran {pathlib.Path(sys.executable).parent}/python3\n', done.stdout)

    def test_a_demo_of_no_number_of_seconds_builds_nothing(self):
        for seconds in ('soon', '--seconds', '3s'):
            done = subprocess.run([self.folder / 'tools' / 'demo', seconds], capture_output=True, text=True)
            self.assertEqual((done.returncode, done.stdout), (2, ''))
            self.assertIn(f"not '{seconds}'", done.stderr)

    def test_without_it_all_steps_run(self):
        _, ran, _ = self.check()
        self.assertEqual(ran[:3] + ran[-2:], ['setup', 'format', 'arithmetic', 'printing', 'glossary'])

    def test_a_step_that_there_is_not_is_no_success(self):
        status, ran, done = self.check('--from', 'nowhere')
        self.assertEqual((status, ran), (2, []))
        self.assertIn("there is no step 'nowhere'", done.stderr)


if __name__ == '__main__':
    unittest.main()
