#!/usr/bin/env python3
"""Every command of `morphbus control` has an example in its help and in docs/cli.md, and all of them work as they
stand there, typed into a shell one after the other while the quadruped runs."""
import os
import re
import subprocess
import unittest

from control_live import Live
from support import BIN, MODEL, PROGRAM, SOURCE, morphbus


class Examples(Live):
    def assert_all_work(self, lines, commands):
        """Runs these lines; they hold all of `commands` (pairs of a word and whether it begins anew)."""
        shown = {(line.split()[2], '--cold' in line) for line in lines}
        self.assertEqual(shown, commands)
        # An example that names a time in the future must not find it over.
        self.start('--speed', 4, run='walk')
        environment = {**os.environ, 'PATH': f'{BIN}{os.pathsep}{os.environ["PATH"]}'}
        for line in lines:
            done = subprocess.run(['sh', '-c', line], cwd=SOURCE, env=environment, capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 0, f'{line}\n{done.stdout}{done.stderr}')
        self.assertEqual(self.end()['ended'], 'stopped by command')
        # What a paused run puts off may fail later, which it warns of.
        self.assertNotIn('control:', self.said)
        self.assertEqual({(command.split()[0], '--cold' in command) for _, command in self.commands()}, commands)

    def commands_there_are(self, text):
        usages = re.search(r'\nCommands:\n((?:  .*\n)+)', text)[1].splitlines()
        commands = {(usage.split()[0], False) for usage in usages}
        self.assertEqual(len(commands), 15)
        return commands | {('restart', True)}

    def test_those_of_the_help(self):
        text = morphbus('control', '--help').stdout
        examples = text[text.index('\nExamples'):]
        lines = [line.strip() for line in examples.splitlines() if line.startswith('  morphbus control ')]
        self.assert_all_work(lines, self.commands_there_are(text))

    def test_those_of_the_reference(self):
        # The line with … is how the command is called, for people.
        lines = [line for line in (SOURCE / 'docs' / 'cli.md').read_text(encoding='utf-8').splitlines()
                 if line.startswith('morphbus control ') and '…' not in line]
        self.assert_all_work(lines, self.commands_there_are(morphbus('control', '--help').stdout))

    def test_the_deployment_of_the_reference(self):
        text = (SOURCE / 'docs' / 'cli.md').read_text(encoding='utf-8')
        given, answer, told = re.search(r'\$ morphbus control (deploy .*)\n(.*)\n\$ morphbus info walk.log\n\.\.\.\n(.*\n.*\n)```',
                                        text).groups()
        tick = int(re.search(r'tick (\d+)', answer)[1])
        script, log = self.folder / 'script', self.folder / 'walk.log'
        script.write_text(f'{tick} {given}\n')
        morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--inproc', '--seconds', 20, '--commands', script, '--log', log,
                 cwd=SOURCE)
        # Any change of the compiler gives the image another hash.
        done = morphbus('info', log, '--commands').stdout.strip()
        hashless = [re.sub(r' [0-9a-f]{16} ', ' ', line) for line in (f'{tick} {answer}', done)]
        self.assertEqual(hashless[0].split(':')[0], hashless[1])
        self.assertIn(f'it runs from {done.split()[-1]} s on', answer)
        self.assertIn(told, morphbus('info', log).stdout)


if __name__ == '__main__':
    unittest.main()
