#!/usr/bin/env python3
"""Every command that a document shows is run: here, in the order in which they stand, or by the test that is named for it. Where a
document shows what a command prints, it prints that."""
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

from support import BIN, LIMIT, MODEL, PROGRAM, SOURCE, morphbus

# A command that is asked for, and a form of one, which stands for many: [OPTIONS], FILE.m3l, A|B.
COMMAND = re.compile(r'^(?:\$ )?(?:morphbus|tools/\w+|test/\w+/\w+|cmake|xmllint) ', re.M)
FORM = re.compile(r'\[-|\[NAME\]|FILE|OPTIONS|\bLOG\b|\bIMAGE\b|\bPROGRAM\b|COMMAND…|bash\|zsh|^morphbus (runs|doctor|lsp)\b(?! *#)')
# Tests that run these blocks, by document and beginning of the block. `check`: the folder's own programs, which tools/check runs.
ELSEWHERE = {
    ('campaign.md', 'tools/campaign'): 'test/e2e/campaign.py',
    ('cli.md', 'morphbus control pause'): 'test/e2e/control_examples.py',
    ('cli.md', '$ morphbus control deploy'): 'test/e2e/deploy.py',
    ('cli.md', '$ morphbus control inspect'): 'test/e2e/inspection.py',
    ('cli.md', 'morphbus monitor'): 'test/e2e/monitor.py',
    ('cli.md', 'source <('): 'test/e2e/shell.py',
    ('editor.md', 'cmake --preset'): 'test/editor/protocol.mjs',
    ('install.md', 'mkdir robots'): 'debian/tests/tutorial',
    ('install.md', 'tools/setup --page'): 'test/packages/tarball',
    ('install.md', 'tools/setup --run'): 'test/e2e/shell.py',
    ('lockstep-model.md', 'tools/setup'): 'test/promela/check',
    ('benchmark.md', ''): 'test/e2e/benchmark.py',
    ('monitor.md', 'morphbus monitor'): 'test/e2e/monitor.py',
    ('optimise.md', ''): 'test/e2e/optimise.py',
    ('python.md', 'cmake --preset'): 'test/python/morphbus_test.py',
    ('spy.md', 'morphbus spy --lcm-url'): 'test/e2e/spy_rates.py',
    ('spy.md', 'morphbus spy  walk'): 'test/e2e/spy_terminal.py',
    ('sweep.md', ''): 'test/e2e/sweep.py',
    ('tutorial.md', ''): 'test/e2e/tutorial.py',
}


def blocks(document):
    """The fenced blocks of a document in which commands stand."""
    text = (SOURCE / 'docs' / document).read_text(encoding='utf-8')
    for fence in re.finditer(r'^```(\w*)[^\n]*\n(.*?)^```', text, re.M | re.S):
        lines = [line for line in fence[2].splitlines() if COMMAND.match(line)]
        if fence[1] in ('', 'sh') and lines and not any(FORM.search(line) for line in lines):
            yield fence[2]


def elsewhere(document, block):
    return next((test for (name, begin), test in ELSEWHERE.items() if name == document and block.startswith(begin)), None)


def documents():
    return sorted(path.name for path in (SOURCE / 'docs').glob('*.md'))


class Documents(unittest.TestCase):
    """A folder as a reader has it who followed the text so far."""

    @classmethod
    def setUpClass(cls):
        cls.recorded = pathlib.Path(tempfile.mkdtemp(prefix='morphbus-e2e-'))
        # A registry of its own: a run of a test that goes on beside this one may have the same name.
        runtime = cls.recorded.parent / f'{cls.recorded.name}-runtime'
        runtime.mkdir(mode=0o700)
        cls.addClassCleanup(shutil.rmtree, runtime)
        os.environ['XDG_RUNTIME_DIR'] = str(runtime)
        for name, robot in (('walk', 'quadruped'), ('other', 'equivalent_quadruped')):
            morphbus('run', MODEL, PROGRAM, '--robot', robot, '--seconds', 20, '--inproc', '--run', 'walk', '--log', cls.recorded / f'{name}.log')
        whole = (cls.recorded / 'walk.log').read_bytes()
        (cls.recorded / 'cut.log').write_bytes(whole[:len(whole) // 2])
        # A recording that began late has no description of its own.
        subprocess.run([BIN / 'morphbus', 'convert', 'walk.log', '--to', 'description', '-o', 'walk.description'], cwd=cls.recorded, check=True,
                       capture_output=True, timeout=LIMIT)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.recorded)

    def folder(self):
        folder = pathlib.Path(tempfile.mkdtemp(prefix='morphbus-e2e-'))
        self.addCleanup(shutil.rmtree, folder)
        shutil.copytree(self.recorded, folder, dirs_exist_ok=True)
        (folder / 'late.log').write_bytes((folder / 'walk.log').read_bytes())
        (folder / 'models').symlink_to(SOURCE / 'models')
        (folder / 'compiler').symlink_to(SOURCE / 'compiler')
        for name, of in (('robot.m3l', MODEL), ('mtran.m3l', MODEL), ('walk.dyn', PROGRAM), ('program.dyn', PROGRAM), ('quadruped.dyn', PROGRAM)):
            shutil.copy(of, folder / name)
        for name in ('urdf', 'worlds', 'home'):
            (folder / name).mkdir()
        return folder

    def run_block(self, folder, block):
        """Runs the commands of a block, as they stand or behind `$ `; returns what they print."""
        typed = [line[2:] for line in block.splitlines() if line.startswith('$ ')]
        # Whoever is still at work in the background ends by itself.
        script = '\n'.join(typed) if typed else block
        environment = {**os.environ, 'PATH': f'{BIN}:{os.environ["PATH"]}', 'HOME': str(folder / 'home')}
        done = subprocess.run(['bash', '-ec', f'{script}\nfor job in $(jobs -p); do wait "$job"; done\n'], cwd=folder, env=environment,
                              capture_output=True, text=True, timeout=LIMIT, check=False)
        # A finding that is shown is no failure.
        self.assertLessEqual(done.returncode, 1 if typed else 0, f'{script}\n{done.stdout}\n{done.stderr}')
        return done.stdout

    def test_what_the_documents_show_runs(self):
        ran = 0
        for document in documents():
            folder = self.folder()
            for block in blocks(document):
                if elsewhere(document, block):
                    continue
                with self.subTest(document=document, block=block):
                    printed = self.run_block(folder, block)
                    if block.startswith('$ '):
                        shown = [line for line in block.splitlines() if not line.startswith('$ ') and line != '...']
                        self.assertEqual([line for line in shown if line not in printed.splitlines()], [], printed)
                ran += 1
        self.assertGreater(ran, 15)

    def test_each_exception_is_one_and_its_test_is_there(self):
        for (document, begin), test in ELSEWHERE.items():
            self.assertTrue(any(block.startswith(begin) for block in blocks(document)), (document, begin))
            self.assertTrue((SOURCE / test).exists(), test)


if __name__ == '__main__':
    unittest.main()
