#!/usr/bin/env python3
"""docs/tutorial.md: its files are written and its commands run, in order and in one folder, as they stand there.

A fence names the file that it holds (```m3l worm.m3l); a fence of sh has one command a line, and behind # the exit
status where that is not 0.
"""
import os
import re
import subprocess
import unittest

from support import BIN, SOURCE, Case

TEXT = (SOURCE / 'docs' / 'tutorial.md').read_text(encoding='utf-8')


class Tutorial(Case):
    def test_from_an_empty_file_to_a_comparison(self):
        (self.folder / 'models').symlink_to(SOURCE / 'models')
        environment = {**os.environ, 'PATH': f'{BIN}{os.pathsep}{os.environ["PATH"]}'}
        commands = []
        for kind, name, text in re.findall(r'```(m3l|dyn|sh) ?(\S*)\n(.*?)```', TEXT, re.S):
            if kind != 'sh':
                (self.folder / name).write_text(text)
                continue
            for line in text.splitlines():
                status = re.search(r'# exit status (\d)', line)
                done = subprocess.run(['sh', '-c', line], cwd=self.folder, env=environment, capture_output=True,
                                      text=True, check=False)
                self.assertEqual(done.returncode, int(status[1]) if status else 0,
                                 f'{line}\n{done.stdout}{done.stderr}')
                commands.append(line)
        for wanted in ('check', 'roles', 'run', 'equivalent', 'compare', 'draw'):
            self.assertTrue(any(line.startswith(f'morphbus {wanted} ') for line in commands), wanted)
        self.assertTrue((self.folder / 'worm.png').stat().st_size)
        # The pictures that it shows have the names of those that its commands draw.
        shown = re.findall(r'!\[.*?\]\(pictures/(\S+)\)', TEXT)
        self.assertEqual(shown, ['carrying.png'])
        for name in shown:
            self.assertTrue((SOURCE / 'docs' / 'pictures' / name).exists(), name)
            self.assertTrue((self.folder / name).exists(), name)

    def test_its_table_has_every_program(self):
        programs = {path.name for path in (SOURCE / 'models' / 'programs').glob('*.dyn')}
        self.assertEqual(set(re.findall(r'^\| `(\w+\.dyn)` \|', TEXT, re.M)), programs)


if __name__ == '__main__':
    unittest.main()
