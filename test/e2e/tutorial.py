#!/usr/bin/env python3
"""docs/tutorial.md: its files are written and its commands run, in order and in one folder, as they stand there.

A fence names the file that it holds (```m3l worm.m3l, ```toml waves.toml); a fence of sh has one command a line, and behind # the exit
status where that is not 0.
"""
import os
import re
import subprocess
import unittest

from support import BIN, SOURCE, Case, as_json

TEXT = (SOURCE / 'docs' / 'tutorial.md').read_text(encoding='utf-8')
PICTURES = SOURCE / 'docs' / 'pictures'
LESSON, SHIPPED = TEXT.split('\n## Each in motion\n')
MOST_BYTES = 1_500_000  # all pictures of the page together


class Page(Case):
    def follow(self, text):
        """Writes the files of a part of the page and runs its commands, each of which must end as it says; all of
        them. The pictures that the part shows have the names of those that its commands draw."""
        (self.folder / 'models').symlink_to(SOURCE / 'models')
        environment = {**os.environ, 'PATH': f'{BIN}{os.pathsep}{os.environ["PATH"]}'}
        commands = []
        for kind, name, body in re.findall(r'```(m3l|dyn|xml|toml|sh) ?(\S*)\n(.*?)```', text, re.S):
            if kind != 'sh':
                (self.folder / name).write_text(body)
                continue
            for line in body.splitlines():
                status = re.search(r'# exit status (\d)', line)
                done = subprocess.run(['sh', '-c', line], cwd=self.folder, env=environment, capture_output=True,
                                      text=True, check=False)
                self.assertEqual(done.returncode, int(status[1]) if status else 0,
                                 f'{line}\n{done.stdout}{done.stderr}')
                commands.append(line)
        for name in pictures_of(text):
            self.assertTrue((self.folder / name).stat().st_size, name)
        return commands


def pictures_of(text):
    return re.findall(r'!\[.*?\]\(pictures/(\S+)\)', text)


class Tutorial(Page):
    def test_from_an_empty_file_to_a_comparison(self):
        commands = self.follow(LESSON)
        for wanted in ('check', 'roles', 'run', 'equivalent', 'compare', 'draw', 'sweep', 'optimise'):
            self.assertTrue(any(line.startswith(f'morphbus {wanted} ') for line in commands), wanted)
        self.assertTrue((self.folder / 'worm.png').stat().st_size)
        self.assertEqual(pictures_of(LESSON), ['carrying.png', 'quicker.png'])
        speeds = [as_json('run', self.folder / 'worm.m3l', self.folder / 'quick.dyn', '--robot', 'worm', '--seconds', 10, '--inproc', '--no-log',
                          *settings)['displacement'][0] for settings in ((), ('--params', self.folder / 'quicker.best.toml'))]
        self.assertGreater(speeds[1], 1.3 * speeds[0])

    def test_its_pictures_are_there_and_small(self):
        shown = pictures_of(TEXT)
        self.assertEqual(len(shown), len(set(shown)))
        for name in shown:
            # As wide as `draw` makes them, at half the size (docs/pictures/tutorial.py).
            head = (PICTURES / name).read_bytes()[:24]
            self.assertEqual(head[:8], b'\x89PNG\r\n\x1a\n', name)
            self.assertIn(int.from_bytes(head[16:20], 'big'), range(1400, 1700), name)
        self.assertLess(sum((PICTURES / name).stat().st_size for name in shown), MOST_BYTES)

    def test_every_program_has_its_command_and_its_picture(self):
        parts = dict(re.findall(r'^### (\w+\.dyn)\n(.*?)(?=^### |\Z)', SHIPPED, re.M | re.S))
        programs = {path.name for path in (SOURCE / 'models' / 'programs').glob('*.dyn')}
        # One stands in the lesson itself.
        self.assertIn('models/programs/carry.dyn', LESSON)
        # Those that all robots run have theirs where they are explained.
        algorithms = (SOURCE / 'docs' / 'algorithms.md').read_text(encoding='utf-8')
        explained = set(re.findall(r'^morphbus run \S+ models/programs/(\w+\.dyn) ', algorithms, re.M))
        # Those of modules that others have built stand together.
        others = SHIPPED.partition('\n### Modules that others have built\n')[2]
        together = set(re.findall(r'^morphbus run \S+ models/programs/(\w+\.dyn) .*--log \S+$', others, re.M))
        self.assertEqual(set(parts) | explained | together | {'carry.dyn'}, programs)
        for program, part in parts.items():
            self.assertRegex(part, rf'(?m)^morphbus run \S+ models/programs/{program} .*--log (\S+)$', program)
            shown = pictures_of(part)
            self.assertTrue(shown, program)
            for name in shown:
                self.assertRegex(part, rf'(?m)^morphbus draw \S+\.log .* -o {name}$', program)

    def test_its_table_has_every_program(self):
        programs = {path.name for path in (SOURCE / 'models' / 'programs').glob('*.dyn')}
        self.assertEqual(set(re.findall(r'^\| `(\w+\.dyn)` \|', TEXT, re.M)), programs)


class Shipped(Page):
    def test_their_commands_move_them_and_draw_their_pictures(self):
        self.follow(SHIPPED)


if __name__ == '__main__':
    unittest.main()
