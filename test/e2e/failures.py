#!/usr/bin/env python3
"""What bad input and bad luck get: a clear end that names the cause, no orphans, the log kept."""
import json
import os
import re
import resource
import shutil
import signal
import subprocess
import unittest

from support import (BIN, LIMIT, MODEL, PROGRAM, Case, as_json, await_condition, command, end_of, morphbus,
                     processes_of)


class Running(Case):
    """A run without an end, that a test then disturbs."""

    def start(self, name, *options, log=None):
        self.run_name = name
        self.log_path = self.folder / f'{name}.log'
        self.process = subprocess.Popen(
            command('run', MODEL, PROGRAM, '--robot', 'quadruped', '--isolate', '--run', name, '--log', self.log_path,
                    *options), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.kill_at_the_end(self.process)
        partial = self.folder / f'{log or name}.log.partial'
        await_condition(lambda: partial.exists() and partial.stat().st_size > 300000, 'the run is under way')

    def pid_of(self, pattern):
        pids = [pid for pid, text in processes_of(self.run_name).items() if re.search(pattern, text)]
        self.assertEqual(len(pids), 1, (pattern, processes_of(self.run_name)))
        return pids[0]

    def finish(self, status):
        out, err = self.process.communicate(timeout=LIMIT)
        self.assertEqual(self.process.returncode, status, out + err)
        await_condition(lambda: not processes_of(self.run_name), 'no orphans')
        return out, err

    def test_the_figures_of_a_broken_run_are_those_of_its_log(self):
        self.start('broken', '--json')
        os.kill(self.pid_of('/morphbus sim '), signal.SIGKILL)
        summary = json.loads(self.finish(3)[0])
        facts = as_json('info', summary['log'])
        for key in ('run', 'hash', 'ticks', 'seconds', 'num_faults'):
            self.assertEqual(summary[key], facts[key], key)
        self.assertGreater(facts['ticks'], 10)
        self.assertEqual(summary['messages'], sum(c['messages'] for c in facts['channels'].values() if c['hashed']))
        ledgers = facts['health']
        self.assertEqual(summary['lost'], sum(h['lost'] + h['discarded'] for h in ledgers.values()))
        self.assertEqual(summary['resent'], sum(h['resent'] for h in ledgers.values()))
        self.assertEqual(summary['processes'], {process: {key: ledger[key] for key in summary['processes'][process]}
                                                for process, ledger in ledgers.items()})
        self.assertEqual(len(summary['faults']), len(facts['faults']))

    def test_a_hung_process_is_blamed_and_the_log_is_named(self):
        # After how long is shown in virtual time (test/bridge/run_end_test.cc), but for the launcher's 8 s for a simulator.
        for name, pattern, error in (('log', '/morphbus log ', 'LOG does not answer'),
                                     ('sim', '/morphbus sim ', 'sim has been silent for 8 s'),
                                     ('m5', '--module m5 ', 'm5 does not answer')):
            with self.subTest(name):
                self.start(f'hung{name}', '--json')
                os.kill(self.pid_of(pattern), signal.SIGSTOP)
                out, err = self.finish(3)
                summary = json.loads(out)
                self.assertEqual(summary['error'], error)
                if name != 'log':
                    facts = as_json('info', summary['log'])
                    self.assertEqual((facts['end'], facts['clean'], facts['reason']), ('verified', False, error))
                    self.assertIn(f'not clean: {error}', morphbus('verify', summary['log'], status=None).stdout)
                self.assertIn(error, err)
                self.assertIn(summary['log'], (str(self.log_path), f'{self.log_path}.partial'))
                self.assertIn(summary['log'], err)
                self.assertGreater(as_json('info', summary['log'])['events'], 1000)

    def test_a_run_in_one_process_is_listed_and_says_why_nobody_can_join_it(self):
        run = subprocess.Popen(command('run', MODEL, PROGRAM, '--robot', 'quadruped', '--inproc', '--run', 'alone', '--no-log'),
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.kill_at_the_end(run)
        listed = await_condition(lambda: as_json('runs')['runs'], 'the run is listed')
        self.assertEqual([(r['run'], r['pid'], r['robot'], r['network']) for r in listed],
                         [('alone', run.pid, 'quadruped', 'in one process')])
        self.assertRegex(morphbus('runs').stdout, r'(?m)^alone .* in one process .*\n(.*\n)*a run in one process .* has no bus')
        self.assertIn('in one process and has no bus', morphbus('spy', '--run', 'alone', '--once', status=2).stderr)
        self.start('seen')
        self.assertEqual({r['run']: r['network'] for r in as_json('runs')['runs']}, {'alone': 'in one process', 'seen': 'private'})
        # The only run that can be meant.
        self.assertIn('seen', as_json('spy', '--once')['runs'])
        # One that is killed is listed no more.
        end_of(run)
        self.assertEqual([r['run'] for r in as_json('runs')['runs']], ['seen'])

    def test_many_that_are_silent_are_three_names_and_a_number_said_once(self):
        self.start('many', '--processes', 2)
        os.kill(self.pid_of('--modules m1,m2,m3'), signal.SIGSTOP)
        out, err = self.finish(3)
        error = 'm1, m2, m3 and 2 more do not answer'
        self.assertRegex(out, rf'\Afailed at [\d.]+ s: {error}\nrun many: ')
        self.assertEqual(err, f'morphbus: error: {error}; the log is {self.log_path}\n')

    def test_a_signal_ends_all_of_several_runs(self):
        self.start('several', '--json', '--seconds', 10000, '--repeat', 5, log='several-1')
        self.process.send_signal(signal.SIGINT)
        out, _ = self.finish(1)
        answer = json.loads(out)
        self.assertEqual((answer['stopped'], len(answer['runs'])), (True, 1))
        self.assertEqual(sorted(path.name for path in self.folder.glob('*.log')), ['several-1.log'])

    def test_a_killed_launcher_leaves_nobody(self):
        self.start('killlauncher')
        end_of(self.process)
        await_condition(lambda: not processes_of(self.run_name), 'no orphans')
        left = self.folder / 'runtime' / 'morphbus' / 'killlauncher'
        self.assertTrue((left / 'key').exists())
        # The name is free at once; in so short a run no module comes to a role.
        next_log = self.folder / 'next.log'
        morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--isolate', '--run', 'killlauncher', '--seconds', 0.2,
                 '--log', next_log, status=1)
        morphbus('verify', next_log)
        self.assertEqual(as_json('runs')['runs'], [])
        self.assertEqual(list((self.folder / 'runtime' / 'morphbus').iterdir()), [])
        kept = self.log_path if self.log_path.exists() else f'{self.log_path}.partial'
        morphbus('info', kept)

    def test_interrupting_ends_cleanly(self):
        self.start('interrupt')
        self.process.send_signal(signal.SIGINT)
        out, err = self.finish(0)
        self.assertIn('interrupted', out)
        morphbus('verify', self.log_path)

    def test_a_run_whose_modules_never_come_can_be_interrupted(self):
        # A copy of the program has modules of its own beside it, which do nothing.
        programs = self.folder / 'bin'
        programs.mkdir()
        shutil.copy(BIN / 'morphbus', programs)
        (programs / 'morphbus-module').write_text('#!/bin/sh\nexec sleep 1000\n')
        (programs / 'morphbus-module').chmod(0o700)
        log = self.folder / 'idle.log'
        run = subprocess.Popen([str(programs / 'morphbus'), *command(
            'run', MODEL, PROGRAM, '--robot', 'quadruped', '--isolate', '--run', 'idle', '--log', log, '--json')[1:]],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.kill_at_the_end(run)
        await_condition(lambda: [text for text in processes_of('idle').values() if '/morphbus sim ' in text], 'it has a sim')
        run.send_signal(signal.SIGINT)
        out, err = run.communicate(timeout=LIMIT)
        # Not a failure: but no module has a role.
        self.assertEqual(run.returncode, 1, out + err)
        summary = json.loads(out)
        self.assertEqual((summary['ended'], summary['error']), ('interrupted', None))
        await_condition(lambda: not processes_of('idle'), 'no orphans')
        # The log says that nobody answered the tick that was published.
        self.assertIn('NOT whole; END verified, clean: interrupted', morphbus('verify', log, status=1).stdout)

    def test_a_name_in_use_is_refused(self):
        self.start('inuse')
        done = morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 1, '--isolate', '--run', 'inuse',
                        status=2)
        self.assertIn(f"run 'inuse' is already in use by process {self.process.pid}", done.stderr)

    def test_a_bus_that_is_named_is_looked_at_whatever_runs(self):
        self.start('elsewhere')
        done = subprocess.run([str(BIN / 'isolated'), *command('spy', '--once', '--json', '--lcm-url', 'udpm://')],
                              capture_output=True, text=True, timeout=LIMIT)
        self.assertEqual(json.loads(done.stdout)['channels'], [], done.stderr)

    def test_an_isolated_replay_can_be_listened_to(self):
        log = self.folder / 'walk.log'
        morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 1, '--inproc', '--run', 'old', '--log', log)
        replay = subprocess.Popen(command('replay', log, '--isolate', '--loop'), stdin=subprocess.DEVNULL,
                                  stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.kill_at_the_end(replay)
        listed = await_condition(lambda: as_json('runs')['runs'], 'the replay is listed')
        self.assertEqual((listed[0]['pid'], listed[0]['isolated'], listed[0]['log']), (replay.pid, True, str(log)))
        heard = lambda: [c['channel'] for c in as_json('spy', '--once', '--run', listed[0]['run'])['channels']]
        await_condition(lambda: 'old/SIM/CLOCK' in heard(), 'the replay is heard')
        replay.send_signal(signal.SIGINT)
        self.assertIn(f"morphbus spy --run {listed[0]['run']}", replay.communicate(timeout=LIMIT)[1])
        self.assertEqual(as_json('runs')['runs'], [])

    def test_a_disk_that_is_full_ends_the_run_and_is_named(self):
        def little_room():
            # Beyond the limit writing fails as on a full disk. That the signal does not kill is morphbus' own doing.
            signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
            resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 20, 1 << 20))

        for mode in ('--inproc', '--isolate'):
            with self.subTest(mode):
                log = self.folder / f'full{mode}.log'
                done = subprocess.run(
                    command('run', MODEL, PROGRAM, '--robot', 'quadruped', mode, '--seconds', '10000', '--log', log,
                            '--json'), capture_output=True, text=True, timeout=LIMIT, preexec_fn=little_room)
                self.assertEqual(done.returncode, 3, done.stderr)
                summary = json.loads(done.stdout)
                self.assertIn('File too large', summary['error'])
                self.assertEqual(summary['log'], f'{log}.partial')
                self.assertGreater(summary['messages'], 0)

    def test_runs_and_spy_see_it(self):
        self.start('seen')
        runs = as_json('runs')['runs']
        self.assertEqual([(r['run'], r['pid'], r['robot']) for r in runs], [('seen', self.process.pid, 'quadruped')])

        def looked(channels, seconds, enough):
            """What the spy shows of these channels; a busy machine's run may say little in a second, so it may look again."""
            return await_condition(lambda: (lambda spy: enough(spy) and spy)(as_json(
                'spy', '--once', '--seconds', seconds, '--channel', channels)), f'the spy has enough of {channels}')

        def clocks(spy):
            return {c['channel']: c for c in spy['channels']}.get('seen/SIM/CLOCK', {'messages': 0})
        spy = looked('seen/SIM/CLOCK', 2, lambda spy: clocks(spy)['messages'] > 1 and spy['modules'].get('m5', {}).get('role'))
        channels = {c['channel']: c for c in spy['channels']}
        self.assertEqual(channels['seen/SIM/CLOCK']['type'], 'morphbus.sim_clock_t')
        self.assertEqual(channels['seen/SIM/CLOCK']['last']['tick_us'], 20000)
        self.assertEqual(spy['modules']['m5']['role'], 'Junction')

        def shown(spy):
            return [c['channel'] for c in spy['channels'] if 'last' in c]
        chosen = looked('seen/m[12]/STATUS', 1, lambda spy: len(shown(spy)) >= 2)
        self.assertEqual(shown(chosen), ['seen/m1/STATUS', 'seen/m2/STATUS'])
        self.assertIn('no regular expression', morphbus('spy', '--channel', '(', status=2).stderr)
        # What matches nothing is told, in text and beside JSON.
        for options in ((), ('--json',)):
            said = morphbus('spy', '--once', '--channel', 'm1/ACT', *options).stderr
            self.assertIn('--channel m1/ACT: heard nothing on such a channel; the pattern must match the whole name', said)
        self.assertNotIn('heard nothing', morphbus('spy', '--once', '--channel', '.*/SIM/CLOCK', '--seconds', 5).stderr)
        self.assertIn('expected more than 0 seconds', morphbus('spy', '--once', '--seconds', 0, status=2).stderr)


class BadInput(Case):
    def test_a_command_that_does_not_exist_is_named_with_the_nearest(self):
        done = morphbus('comparr', 'a.log', 'b.log', status=2)
        self.assertIn("no command 'comparr' (did you mean 'compare'?)", done.stderr)

    def test_an_option_that_does_not_exist_is_named_with_the_nearest(self):
        for arguments, said in ((('--vesion',), "no option '--vesion' (did you mean '--version'?)"),
                                # The misspelt option is what is wrong, not --to, which is missing for it.
                                (('export', MODEL, '--too=mjcf', '-o', 'x'), "no option '--too' (did you mean '--to'?)"),
                                (('run', MODEL, PROGRAM, '--seconds', 1, '--inprok'), "(did you mean '--inproc'?)"),
                                (('check', MODEL, '-q'), "no option '-q' (see morphbus check --help)")):
            self.assertIn(said, morphbus(*arguments, status=2).stderr)
        done = subprocess.run([str(BIN / 'morphbus-module'), '--kinematic', 'x'], capture_output=True, text=True, timeout=LIMIT)
        self.assertEqual((done.returncode, done.stderr),
                         (2, "morphbus-module: error: there is no option '--kinematic' (did you mean '--kinematics'?)\n"))

    def test_without_a_multicast_route_one_sentence_says_what_to_do(self):
        done = subprocess.run(
            [str(BIN / 'isolated'), '--no-route', *command('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', '1')],
            capture_output=True, text=True, timeout=LIMIT)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn('--isolate', done.stderr)
        self.assertEqual(done.stderr.count('\n'), 1, done.stderr)

    def test_isolation_works_without_a_route(self):
        done = subprocess.run(
            [str(BIN / 'isolated'), '--no-route',
             *command('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', '1', '--isolate', '--log',
                      str(self.folder / 'x.log'))],
            capture_output=True, text=True, timeout=LIMIT)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_a_robot_without_roles_is_told_why(self):
        program = self.folder / 'hermit.dyn'
        program.write_text('role Hermit extends Module {\n  require sizeof(self.connected) == 9;\n}\n')
        of = (MODEL, program, '--robot', 'quadruped')
        answer = as_json('roles', *of, status=1)
        self.assertIn(f'm1: not Hermit: a requirement fails ({program}:2: require sizeof(self.connected) == 9;), measured 1 against 9', answer['problems'][0])
        summary = as_json('run', *of, '--seconds', 1, '--inproc', '--log', self.folder / 'x.log', status=1)
        self.assertEqual((summary['error'], set(summary['roles'].values())), (None, {None}))
        self.assertEqual(summary['problems'], answer['problems'])
        said = morphbus('run', *of, '--seconds', 1, '--inproc', '--log', self.folder / 'x.log', status=1).stdout
        self.assertIn(f'problem: m1: not Hermit: a requirement fails ({program}:2: require sizeof(self.connected) == 9;), measured 1 against 9', said)

    def test_a_program_whose_roles_are_all_abstract_gives_none(self):
        program = self.folder / 'abstract.dyn'
        program.write_text('abstract role Base extends Module {\n  behavior b() {\n    self.sleepds(1);\n  }\n}\n')
        of = (MODEL, program, '--robot', 'quadruped')
        answer = as_json('roles', *of, status=1)
        self.assertEqual(answer['problems'][0], 'm1: all roles of the program are abstract, so it can take none')
        summary = as_json('run', *of, '--seconds', 0.5, '--inproc', '--no-log', status=1)
        self.assertEqual((summary['error'], summary['problems']), (None, answer['problems']))

    def test_a_damaged_image_is_refused(self):
        image = self.folder / 'x.image'
        morphbus('compile', PROGRAM, '--model', MODEL, '-o', image)
        whole = image.read_bytes()
        for at in (4, 30, len(whole) // 2, len(whole) - 1):
            image.write_bytes(whole[:at] + bytes([whole[at] ^ 0x40]) + whole[at + 1:])
            done = morphbus('run', MODEL, image, '--robot', 'quadruped', '--seconds', 1, '--inproc', status=2)
            self.assertIn('damaged', done.stderr)
            morphbus('disasm', image, status=2)

    def run_with_other_modules(self, program):
        """A run by a copy of the program whose companion is `program`, a shell script; None: missing."""
        folder = self.folder / 'bin'
        folder.mkdir()
        shutil.copy(BIN / 'morphbus', folder / 'morphbus')
        if program is not None:
            (folder / 'morphbus-module').write_text(program)
            (folder / 'morphbus-module').chmod(0o755)
        done = subprocess.run([str(folder / 'morphbus'), 'run', str(MODEL), str(PROGRAM), '--robot', 'quadruped',
                               '--seconds', '1', '--isolate', '--run', 'lonely', '--log', str(self.folder / 'x.log')],
                              capture_output=True, text=True, timeout=LIMIT)
        self.assertEqual(done.returncode, 3, done.stderr)
        await_condition(lambda: not processes_of('lonely'), 'no orphans')
        return done.stderr

    def test_a_module_that_cannot_start_is_named(self):
        self.assertIn('cannot start module m1', self.run_with_other_modules(None))

    def test_a_module_that_ends_at_once_is_named(self):
        self.assertRegex(self.run_with_other_modules('#!/bin/sh\nexit 5\n'), r'module m\d exited with status 5')

    def test_modules_that_never_join_are_named(self):
        self.assertRegex(self.run_with_other_modules('#!/bin/sh\nexec sleep 1000\n'), r'\bm1\b')

    def test_sources_with_errors_exit_with_2_and_carets(self):
        broken = self.folder / 'broken.m3l'
        broken.write_text(MODEL.read_text().replace('m1.c2, m2.c5', 'm1.c2, m2.c55', 1))
        done = morphbus('check', broken, status=2)
        self.assertRegex(done.stderr, r'broken\.m3l:\d+:\d+: error: ')
        self.assertIn('^', done.stderr)
        program = self.folder / 'broken.dyn'
        program.write_text(PROGRAM.read_text().replace('self.sleepds(10)', 'self.sleepsd(10)'))
        done = morphbus('compile', program, '--model', MODEL, '-o', self.folder / 'x', status=2)
        self.assertRegex(done.stderr, r'broken\.dyn:\d+:\d+: error: ')
        self.assertFalse((self.folder / 'x').exists())

    def test_missing_files_are_named(self):
        for arguments in (('check', 'none.m3l'), ('info', 'none.log'), ('compare', 'none.log', 'none.log'),
                          ('disasm', 'none.image'), ('replay', 'none.log', '--isolate')):
            self.assertIn('none.', morphbus(*arguments, status=2).stderr)

    def test_bad_options_exit_with_2(self):
        for options in (('--loss', 2), ('--seconds', -1), ('--root', 'm77'), ('--run', 'a/b'), ('--robot', 'quadrupel'),
                        ('--lcm-url', 'udpm://10.0.0.1:1'), ('--unknown',), ('--repeat', 0)):
            morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 1, '--log', self.folder / 'x',
                     *options, status=2)


if __name__ == '__main__':
    unittest.main()
