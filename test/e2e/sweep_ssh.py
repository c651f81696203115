#!/usr/bin/env python3
"""`morphbus sweep --engine ssh`: other machines have the same rows, whatever becomes of them; those of another build do none.
The machines are addresses of the loopback in a network of the test's own, behind an sshd of its own: with its own keys, as
whoever runs the test."""
import contextlib
import os
import pathlib
import pwd
import re
import shutil
import signal
import subprocess
import sys
import unittest

from slurm_cluster import SKIPPED, may_have_mounts
from support import BIN, LIMIT, SOURCE, as_json, await_condition, morphbus
from sweep_case import SMALL, SweepCase, children_of, workers_of

SSHD = shutil.which('sshd', path='/usr/sbin:/usr/local/sbin:' + os.environ['PATH'])
PORT = 2222
HOSTS = ('127.0.0.1', '127.0.0.2', '127.0.0.3')


class SshCase(SweepCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        assert SSHD, 'there is no sshd: tools/setup --test installs it'
        assert shutil.which('ssh'), 'there is no ssh: tools/setup --test installs it'
        if os.geteuid() == 0 and not may_have_mounts():
            print('SKIPPED: the sshd of root needs mounts of its own, which this container does not give')
            sys.exit(SKIPPED)
        if os.geteuid() == 0 and re.search(r'^root:!', pathlib.Path('/etc/shadow').read_text(), re.M):
            print('SKIPPED: the account of root is locked, and sshd does not let it in; as an ordinary user this test runs')
            sys.exit(SKIPPED)

    def setUp(self):
        super().setUp()
        self.there = self.folder / 'there'
        self.binary = self.there / 'morphbus'
        self.there.mkdir()
        shutil.copy(BIN / 'morphbus', self.binary)
        self.start_sshd()
        self.be_client()

    def start_sshd(self):
        keys = self.folder / 'keys'
        keys.mkdir(mode=0o700)
        for name in ('host', 'user'):
            subprocess.run(['ssh-keygen', '-q', '-t', 'ed25519', '-N', '', '-f', keys / name], check=True, timeout=LIMIT)
        config = keys / 'sshd_config'
        config.write_text(f'Port {PORT}\nHostKey {keys}/host\nAuthorizedKeysFile {keys}/user.pub\nPidFile none\n' +
                          ''.join(f'ListenAddress {host}\n' for host in HOSTS) +
                          'StrictModes no\nUsePAM no\nPasswordAuthentication no\nPermitRootLogin prohibit-password\n'
                          'MaxStartups 100\nPrintMotd no\n')
        words = [SSHD, '-f', str(config), '-D', '-e']
        if os.geteuid() == 0:
            # Root's sshd wants a folder in /run. Where its sessions live there is no source and no other build either: all
            # that they have is the program. A folder of the build in the source's is hidden before that.
            hide = ''.join(f'mount -t tmpfs none {folder}\n' for folder in (BIN, SOURCE) if folder.exists())
            script = f'set -e\n{hide}mount -t tmpfs none /run\nmkdir -m 755 /run/sshd\nexec "$@"'
            words = ['unshare', '--mount', 'sh', '-c', script, 'sh', *words]
        self.sshd = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        self.addCleanup(self.sshd.communicate, timeout=LIMIT)
        self.addCleanup(self.end_sessions)
        self.addCleanup(self.sshd.kill)

    def end_sessions(self):
        for pid in self.workers():
            # It may have ended by itself.
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)

    def be_client(self):
        """Puts an ssh first in $PATH that knows the keys, and waits until it gets through."""
        folder = self.folder / 'client'
        folder.mkdir()
        (folder / 'config').write_text(
            f'IdentityFile {self.folder}/keys/user\nIdentitiesOnly yes\nUserKnownHostsFile {folder}/known\nPort {PORT}\n'
            'GlobalKnownHostsFile /dev/null\nStrictHostKeyChecking no\nLogLevel ERROR\n')
        ssh = folder / 'ssh'
        ssh.write_text(f'#!/bin/sh\nexec {shutil.which("ssh")} -F {folder}/config "$@"\n')
        ssh.chmod(0o755)
        before = os.environ['PATH']
        self.addCleanup(os.environ.__setitem__, 'PATH', before)
        os.environ['PATH'] = f'{folder}:{before}'

        def through():
            if self.sshd.poll() is not None:
                raise AssertionError(f'sshd ended: {self.sshd.stderr.read()}')
            done = subprocess.run([ssh, '-o', 'BatchMode=yes', HOSTS[0], 'echo through'], capture_output=True, text=True,
                                  timeout=LIMIT, check=False)
            return done.stdout == 'through\n'
        await_condition(through, 'sshd takes connections', pause=0.1)

    def engine(self, *hosts, binary=None):
        """The table of these hosts, each a text as it stands in the file."""
        return f'[engine]\nkind = "ssh"\nbinary = "{binary or self.binary}"\nhosts = [{", ".join(hosts)}]\n'

    def workers(self, binary=None):
        """The processes that ssh has started."""
        return workers_of(binary or self.binary)

    def program_that_says(self, old, new):
        """Another build, as far as anybody can see."""
        program = self.there / 'other'
        program.write_text(f'#!/bin/sh\n{self.binary} "$@" | sed -u \'s/{old}/{new}/\'\n')
        program.chmod(0o755)
        return program


class Rows(SshCase):
    def test_the_rows_are_those_of_one_process(self):
        text = SMALL + 'keep = {best = 1, by = "path_length"}\n'
        expected = self.expected(text)
        file = self.sweep_file(text + self.engine(f'"{HOSTS[0]}:{PORT}/1"', f'{{host = "{pwd.getpwuid(os.geteuid()).pw_name}@{HOSTS[1]}", jobs = 2}}'))
        log, = as_json('sweep', file)['logs']
        self.assertEqual(self.rows(self.database()), expected)
        best = max(expected, key=lambda row: float(row['path_length']))
        self.assertEqual(as_json('info', log)['hash'], best['hash'])
        # The engine of the file runs a share again, too.
        self.assertEqual(as_json('sweep', 'verify', file, '--sample', 1)['agree'], 8)
        self.assertEqual(as_json('sweep', 'verify', file, '--sample', 1, '--engine', 'local')['agree'], 8)
        # A host has what it needs for a search as well.
        search = ''.join(line + '\n' for line in SMALL.splitlines() if '[' not in line) + \
            'maximise = "path_length"\npopulation = 5\ngenerations = 2\n[search.MOLECUBE.swivel]\nspeed = {from = 1, to = 6}\n'
        best = []
        for name, engine in (('here', ''), ('elsewhere', self.engine(f'"{HOSTS[0]}/2"'))):
            best.append(as_json('optimise', self.sweep_file(search + engine, name))['best'])
        self.assertEqual(best[0], best[1])
        await_condition(lambda: not self.workers(), 'nothing is left on the hosts')


class Losses(SshCase):
    def test_a_host_that_is_lost_gives_its_rows_to_the_others(self):
        text = SMALL.replace('0.2\n', '1\n', 1).replace('[1, 2]', '[1, 2, 3, 4]')
        expected = self.expected(text)
        other = self.there / 'second'
        shutil.copy(self.binary, other)
        file = self.sweep_file(text + self.engine(f'"{HOSTS[0]}/1"', f'{{host = "{HOSTS[1]}/1", binary = "{other}"}}'))
        process = self.start(file)

        def under_way():
            return [pid for pid in self.workers(other) if children_of(pid)]
        worker, = await_condition(under_way, 'the second host runs a row')
        # It hangs, and keeps the rows that it has, two at most.
        os.kill(worker, signal.SIGSTOP)
        self.await_done(self.database(), len(expected) - 2)
        os.kill(worker, signal.SIGKILL)
        output, errors = process.communicate(timeout=LIMIT)
        self.assertEqual(process.returncode, 0, output + errors)
        self.assertIn(f'warning: {HOSTS[1]} was lost: ', errors)
        self.assertEqual(self.rows(self.database()), expected)

    def test_whatever_ends_the_command_ends_the_hosts_work_and_it_goes_on(self):
        expected = self.expected(SMALL)
        long = self.sweep_file(SMALL.replace('0.2\n', '[0.2, 1000000]\n', 1) + self.engine(f'"{HOSTS[0]}/2"'))
        for end in (signal.SIGKILL, signal.SIGINT):
            process = self.start(long)
            await_condition(lambda: any(children_of(pid) for pid in self.workers()), 'a row runs')
            process.send_signal(end)
            process.communicate(timeout=LIMIT)
            self.assertEqual(process.returncode, -9 if end == signal.SIGKILL else 1)
            await_condition(lambda: not self.workers(), 'nothing is left on the host')
        self.sweep_file(SMALL + self.engine(f'"{HOSTS[0]}/2"'))
        morphbus('sweep', long)
        self.assertEqual(self.rows(self.database()), expected)

    def test_a_run_that_crashes_there_is_its_rows_failure(self):
        file = self.sweep_file(SMALL.replace('0.2\n', '[0.2, 1000000]\n', 1).replace('[0.4, 0.8]', '0.4')
                               .replace('loss = [0, 0.2]\nseeds = [1, 2]\n', '') + self.engine(f'"{HOSTS[0]}/1"'))
        process = self.start(file)
        self.await_done(self.database(), 1)
        run, = await_condition(lambda: [child for pid in self.workers() for child in children_of(pid)], 'the second row runs')
        os.kill(run, signal.SIGKILL)
        output, errors = process.communicate(timeout=LIMIT)
        self.assertEqual(process.returncode, 3, output + errors)
        self.assertEqual([row['status'] for row in self.rows(self.database())], ['done', 'crashed'])


class Refused(SshCase):
    def refused(self, expected, *hosts, binary=None, status=2):
        """Alone such a host ends the sweep; beside another one it does no harm."""
        file = self.sweep_file(SMALL + self.engine(*hosts, binary=binary))
        done = morphbus('sweep', file, status=status)
        self.assertRegex(done.stderr, f'error: no host is left to run rows: {expected}')
        self.assertEqual(as_json('sweep', 'status', file)['missing'], 8)
        # The other one begins once this one has been given up.
        go = self.there / 'go'
        patient = self.there / 'patient'
        patient.write_text(f'#!/bin/sh\nuntil [ -e {go} ]; do sleep 0.05; done\nexec {self.binary} "$@"\n')
        patient.chmod(0o755)
        self.sweep_file(SMALL + self.engine(*hosts, f'{{host = "{HOSTS[2]}/1", binary = "{patient}"}}', binary=binary))
        process = self.start(file)
        self.assertRegex(process.stderr.readline(), f'warning: {expected}')
        go.touch()
        output, errors = process.communicate(timeout=LIMIT)
        self.assertEqual(process.returncode, 0, output + errors)
        self.assertEqual({row['status'] for row in self.rows(self.database())}, {'done'})

    def test_another_build(self):
        program = self.program_that_says('"version":"[^"]*"', '"version":"9.9.9"')
        self.refused(f'{HOSTS[0]} is refused: it is morphbus 9.9.9, this is ', f'"{HOSTS[0]}/1"', binary=program)

    def test_other_arithmetic(self):
        program = self.program_that_says('"arithmetic":"[^"]*"', '"arithmetic":"0123456789abcdef"')
        self.refused(f'{HOSTS[0]} is refused: its arithmetic has the fingerprint 0123456789abcdef, ', f'"{HOSTS[0]}/1"', binary=program)

    def test_no_program(self):
        self.refused(f'{HOSTS[0]} cannot run rows: .*{self.there}/none.*([Nn]ot found|No such file)', f'"{HOSTS[0]}/1"',
                     binary=self.there / 'none')

    def test_nobody_there(self):
        self.refused(f'{HOSTS[0]} cannot run rows: .*refused', f'"{HOSTS[0]}:2223/1"')

    def test_the_file(self):
        for hosts, line, expected in ((['"-oProxyCommand=x"'], 12, 'expected a host'), (['"a:b"'], 12, 'expected a host'),
                                      (['{host = "a", job = 1}'], 12, "did you mean 'jobs'"), ([], 12, 'expected a list')):
            done = morphbus('sweep', self.sweep_file(SMALL + '\n' + self.engine(*hosts)), status=2)
            self.assertRegex(done.stderr, rf's\.toml:{line}:\d+: error: ')
            self.assertIn(expected, done.stderr)
        file = self.sweep_file(SMALL)
        self.assertIn('the engine ssh needs hosts', morphbus('sweep', file, '--engine', 'ssh', status=2).stderr)
        empty = {**os.environ, 'PATH': str(self.folder)}
        done = morphbus('sweep', self.sweep_file(SMALL + self.engine('"a"')), status=2, env=empty)
        self.assertIn("there is no program 'ssh'", done.stderr)


if __name__ == '__main__':
    unittest.main()
