#!/usr/bin/env python3
"""The tab key in bash, zsh and fish, and manual pages."""
import os
import pathlib
import pty
import re
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

from support import BIN, LIMIT, MODEL, SOURCE, Case, as_json, command, morphbus

sys.path.insert(0, str(SOURCE / 'test/docs'))
import links_test  # noqa: E402

QUADRUPED = SOURCE / 'models/programs/quadruped_careful.dyn'


def offered(*words):
    """What a shell's script is told of the last of these words: word and explanation, and lines about files."""
    lines = morphbus('complete', '--', *words).stdout.splitlines()
    return dict(line.split('\t') if '\t' in line else (line, None) for line in lines)


class Words(Case):
    def test_commands_options_and_values_are_offered(self):
        self.assertEqual(set(offered('re')), {'replay', 'repair', 'reproduce', 'report'})
        self.assertIn('--robot', offered('run', MODEL, '--ro'))
        self.assertEqual(list(offered('run', MODEL, '--robot', 'cong', '--rob')), [])
        self.assertEqual(set(offered('export', MODEL, '--to', 's')), {'sdf'})
        self.assertEqual(set(offered('sweep', 'st')), {'status', ':files .toml'})
        self.assertEqual(list(offered('sweep', '--dry')), ['--dry-run'])
        self.assertEqual(set(offered('man', 'ru')), {'run', 'runs'})
        # An option that is there counts once, and one that may be repeated is offered again.
        self.assertNotIn('--json', offered('run', '--json', '--'))
        self.assertIn('--set', offered('run', '--set', 'a=1', '--'))
        # Nobody is told of what is for our own processes.
        self.assertNotIn('complete', offered(''))
        self.assertNotIn('--launcher-fd', offered('sim', '--'))

    def test_names_come_from_the_model_and_the_program_on_the_line(self):
        robots = offered('fk', MODEL, '--robot', '')
        self.assertEqual(robots['quadruped'], '9 modules')
        self.assertEqual(offered('fk', MODEL, '--robot=quadr'), {'--robot=quadruped': '9 modules'})
        run = ('run', MODEL, QUADRUPED, '--robot', 'quadruped')
        self.assertEqual(offered(*run, '--root', 'm9'), {'m9': 'MTRAN'})
        self.assertEqual(list(offered(*run, '--lose', 'm3')), ['m3@'])
        self.assertEqual(offered(*run, '--set', 'stride'), {'stride_deg=': '30 in [5, 60]'})
        self.assertIn('MTRAN.joint_1.torque=', offered(*run, '--set', 'MTRAN.joint_1.'))
        why = offered('roles', MODEL, QUADRUPED, '--robot', 'quadruped', '--why', 'm1', 'FrontLeft')
        # Behind the role there may also be another program.
        self.assertEqual(list(why), ['FrontLeftUpperHalf', 'FrontLeftLowerHalf', ':files .dyn'])
        self.assertEqual(list(offered('fk', MODEL, '--robot', 'quadruped', '--set', 'm2.joint_1')), ['m2.joint_1='])
        # Of several robots only the modules of the one that is meant.
        snakes = SOURCE / 'models/snakes.m3l'
        self.assertEqual(len(offered('fk', snakes, '--robot', 'ckbot_snake4', '--set', '')), 4)
        self.assertGreater(len(offered('fk', snakes, '--set', '')), 16)

    def test_a_path_may_begin_with_the_home_folder_and_hold_blanks(self):
        with tempfile.TemporaryDirectory() as home:
            shutil.copy(MODEL, f'{home}/my robots.m3l')
            found = morphbus('complete', '--', 'fk', '~/my robots.m3l', '--robot', 'quadr', env={**os.environ, 'HOME': home}).stdout
        self.assertEqual(found, 'quadruped\t9 modules\n')

    def test_files_are_left_to_the_shell(self):
        self.assertEqual(list(offered('run', '')), [':files .m3l'])
        self.assertEqual(list(offered('run', MODEL, '')), [':files .dyn'])
        self.assertEqual(list(offered('run', MODEL, QUADRUPED, '')), [])
        self.assertEqual(list(offered('compare', 'a.log', 'b.log', '--baseline', '')), [':folders'])
        self.assertIn(':files .toml', offered('sweep', ''))
        self.assertEqual(list(offered('control', 'deploy', '')), [':files .dyn'])

    def test_a_line_that_is_wrong_or_whose_files_are_offers_nothing_and_does_no_harm(self):
        for words in (('nonsense', ''), ('run', 'none.m3l', '--robot', ''), ('fk', '/dev/null', '--robot', ''), ('run', '--nonsense=', ''),
                      ('info', '/dev/zero', '--run', ''), ('control', 'nonsense', ''), ('control', 'kill', 'm1', 'm2', ''), ('',), ()):
            morphbus('complete', '--', *words)
        self.assertEqual(list(offered('nonsense', '')), [])

    def test_words_of_control_are_those_of_the_run(self):
        commands = offered('control', '')
        self.assertEqual(commands['kill'], 'kill MODULE')
        self.assertEqual(set(offered('control', 'push', 'm1', 'N')), {'NORTH'})
        process = subprocess.Popen(command('run', MODEL, QUADRUPED, '--robot', 'quadruped', '--run', 'tab', '--isolate', '--no-log'),
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.kill_at_the_end(process)
        limit = time.monotonic() + LIMIT
        while 'tab' not in offered('spy', '--run', '') and time.monotonic() < limit:
            self.assertIsNone(process.poll())
        self.assertEqual(offered('spy', '--run', 'ta'), {'tab': 'quadruped'})
        at = ('--run', 'tab')
        self.assertEqual(list(offered('control', *at, 'kill', 'm9')), ['m9'])
        self.assertEqual(list(offered('control', *at, 'disconnect', 'm2.c6')), ['m2.c6'])
        self.assertIn('m1.active_block', offered('control', *at, 'push', 'm1.'))
        self.assertIn('FrontLeftUpperHalf.move_thigh', offered('control', *at, 'invoke', 'FrontLeft'))
        self.assertEqual(offered('control', *at, 'set', 'stride'), {'stride_deg': '30 in [5, 60]'})
        self.assertEqual(set(offered('spy', *at, '--channel', 'tab/m9/')),
                         {f'tab/m9/{topic}' for topic in ('TRANSFORM', 'ACTUATOR', 'STATUS', 'HEALTH', 'RESEND')})


class Shells(unittest.TestCase):
    """Each in a terminal of its own, whose keys are typed."""

    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)
        for name in ('robots.m3l', 'walk.dyn', 'notes.txt'):
            source = {'.m3l': MODEL, '.dyn': QUADRUPED}.get(pathlib.Path(name).suffix, '/dev/null')
            shutil.copy(source, self.folder / name)

    def completed(self, shell, setup, typed):
        """The command line that `typed`, with its tabs, becomes."""
        environment = {**os.environ, 'PATH': f'{BIN}:{os.environ["PATH"]}', 'HOME': str(self.folder), 'TERM': 'dumb', 'LC_ALL': 'C.UTF-8'}
        process, main = pty.fork()
        if process == 0:
            os.chdir(self.folder)
            os.execvpe(shell[0], shell, environment)
        try:
            # What was typed is taken back to its beginning, and printed instead of done.
            os.write(main, f'{setup}\n{typed}\x01echo RESULT \n'.encode())
            text = ''
            limit = time.monotonic() + LIMIT
            while time.monotonic() < limit:
                if select.select([main], [], [], 0.1)[0]:
                    text += os.read(main, 4096).decode(errors='replace')
                found = re.findall(r'^(?:\x1b[^\r\n]*?)?RESULT (.*?)\s*$', text.replace('\r', '\n'), re.M)
                if found:
                    return re.sub(r' +', ' ', found[-1])
            self.fail(f'{shell} printed no result: {text!r}')
        finally:
            os.kill(process, signal.SIGKILL)
            os.waitpid(process, 0)
            os.close(main)

    def check(self, shell, setup):
        for typed, line in (('morphbus equiv\t', 'morphbus equivalent'),
                            ('morphbus fk rob\t', 'morphbus fk robots.m3l'),
                            ('morphbus fk robots.m3l --robot quadruped --se\t', 'morphbus fk robots.m3l --robot quadruped --set'),
                            ('morphbus fk robots.m3l --robot equivalent_quadr\t', 'morphbus fk robots.m3l --robot equivalent_quadruped'),
                            ('morphbus fk robots.m3l --robot=equivalent_quadr\t', 'morphbus fk robots.m3l --robot=equivalent_quadruped'),
                            # A value goes on in the same word.
                            ('morphbus run robots.m3l walk.dyn --set stri\t45', 'morphbus run robots.m3l walk.dyn --set stride_deg=45'),
                            ('morphbus run robots.m3l wa\t', 'morphbus run robots.m3l walk.dyn'),
                            ('morphbus export robots.m3l --to mj\t', 'morphbus export robots.m3l --to mjcf')):
            with self.subTest(typed):
                self.assertEqual(self.completed(shell, setup, typed), line)

    def test_bash(self):
        self.check(['bash', '--noprofile', '--norc', '-i'], 'source <(morphbus completion bash)')

    def test_zsh(self):
        self.check(['zsh', '-f', '-i'], 'autoload -U compinit; compinit -u; source <(morphbus completion zsh)')

    def test_zsh_from_a_file(self):
        (self.folder / '_morphbus').write_text(morphbus('completion', 'zsh').stdout)
        self.check(['zsh', '-f', '-i'], 'fpath+=($PWD); autoload -U compinit; compinit -u')

    def test_fish(self):
        folder = self.folder / '.config/fish/completions'
        folder.mkdir(parents=True)
        (folder / 'morphbus.fish').write_text(morphbus('completion', 'fish').stdout)
        self.check(['fish', '-i'], '')

    def test_another_shell_is_refused(self):
        self.assertIn("there is no completion for 'fsh' (did you mean 'fish'?)", morphbus('completion', 'fsh', status=2).stderr)


class Manual(unittest.TestCase):
    def read(self, *arguments):
        """A page as people read it; fails where man warns of it."""
        return self.shown(morphbus('man', *arguments).stdout)

    def shown(self, page):
        environment = {**os.environ, 'MANWIDTH': '100', 'MANPAGER': 'cat', 'LC_ALL': 'C.UTF-8'}
        done = subprocess.run(['man', '--warnings', '-l', '-'], input=page, capture_output=True, text=True, env=environment, timeout=LIMIT)
        self.assertEqual((done.returncode, done.stderr), (0, ''))
        return re.sub('.\b', '', done.stdout)

    def test_a_page_says_what_the_help_says(self):
        page = ' '.join(self.read('run').split())
        self.assertIn('morphbus run [OPTIONS] FILE.m3l PROG.dyn', page)
        self.assertRegex(morphbus('run', '--help').stdout, 'PROG.dyn REQUIRED +DynaRole program or image')
        self.assertIn('-o, --log FILE Log to write (default: morphbus-<run>.log)', page)
        self.assertIn('morphbus run ... --inproc --seconds 30 --lose m3@12.5 --lose m8@20', page)

    def test_every_command_has_a_page(self):
        with tempfile.TemporaryDirectory() as folder:
            morphbus('man', '-o', folder)
            # Pages replace pages, and no other file.
            morphbus('man', '-o', folder)
            other = pathlib.Path(folder) / 'morphbus-run.1'
            other.write_text('mine')
            self.assertIn('morphbus-run.1', morphbus('man', '-o', folder, status=2).stderr)
            self.assertEqual(other.read_text(), 'mine')
            morphbus('man', '-o', folder, '--force')
            pages = {path.name for path in pathlib.Path(folder).iterdir()}
        commands = re.findall(r'^  (\w+)', morphbus('--help').stdout.split('Subcommands:')[1].split('Examples:')[0], re.M)
        self.assertEqual(pages, {'morphbus.1'} | {f'morphbus-{command}.1' for command in commands})
        # One reader for all of them, one after the other.
        together = self.shown(''.join(morphbus('man', name).stdout for name in commands))
        self.assertEqual(re.findall(r'^NAME\n +morphbus-(\w+) +- ', together, re.M), commands)
        # The commands of a command stand on its page.
        self.assertIn('morphbus sweep status', self.read('sweep'))
        self.assertIn('morphbus-run(1)', self.read())

    def test_the_table_of_commands_is_had_as_json(self):
        table = as_json('man')
        self.assertEqual(as_json('man', 'run'), next(command for command in table['commands'] if command['name'] == 'run'))
        fk = as_json('man', 'fk')
        self.assertEqual([option['names'] for option in fk['options'] if option['required']], [['FILE.m3l']])
        self.assertIn('morphbus fk ', fk['footer'])
        output = next(option for option in as_json('man', 'draw')['options'] if '--output' in option['names'])
        self.assertEqual((output['names'], output['type'], output['values']), (['-o', '--output'], 'FILE', 1))
        self.assertIsNone(next(option for option in as_json('man', 'check')['options'] if option['names'] == ['FILE.m3l'])['values'])
        self.assertIn('leave one out', morphbus('man', '--json', '-o', '/nowhere', status=2).stderr)

    def test_of_what_is_no_command_there_is_none(self):
        self.assertIn('leave out run', morphbus('man', 'run', '-o', '/nowhere', status=2).stderr)
        self.assertIn("there is no command 'runn' (did you mean 'run'?)", morphbus('man', 'runn', status=2).stderr)


class Installed(unittest.TestCase):
    def test_what_is_installed_works_wherever_it_lies(self):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            subprocess.run(['cmake', '--install', BIN.parent, '--prefix', root / 'first'], check=True, capture_output=True, timeout=LIMIT)
            prefix = (root / 'first').rename(root / 'moved')
            models = prefix / 'share/morphbus/models'
            subprocess.run([prefix / 'bin/morphbus', 'run', models / 'mtran.m3l', models / 'programs/quadruped.dyn', '--robot', 'quadruped',
                            '--seconds', '2', '--isolate', '--no-log'], check=True, capture_output=True, timeout=LIMIT)
            for path, text in (('bash-completion/completions/morphbus', 'complete -F _morphbus morphbus'),
                               ('zsh/site-functions/_morphbus', '#compdef morphbus'),
                               ('fish/vendor_completions.d/morphbus.fish', 'complete -c morphbus')):
                self.assertIn(text, (prefix / 'share' / path).read_text())
            page = subprocess.run(['man', '-M', prefix / 'share/man', '-P', 'cat', 'morphbus-run'], check=True, capture_output=True, text=True,
                                  timeout=LIMIT)
            self.assertIn('morphbus-run(1)', re.sub('.\b', '', page.stdout))
            # The documents lead to one another there, too.
            documents = sorted((prefix / 'share/doc').glob('*/*.md'))
            self.assertIn('tutorial.md', [path.name for path in documents])
            self.assertEqual([wrong for path in documents for wrong in links_test.broken(path)], [])
            # Where the monitor's page was built it is there, too.
            for built in BIN.parent.glob('share/morphbus/*/*'):
                self.assertTrue((prefix / built.relative_to(BIN.parent)).exists(), built)


if __name__ == '__main__':
    unittest.main()
