#!/usr/bin/env python3
"""What happens to a run when its processes die, are stopped, begin anew, or are lost on purpose."""
import os
import random
import re
import signal
import subprocess
import sys
import time
import unittest

from control_live import written_so_far
from dying import MODULES, QUADRUPED, Dying
from support import MODEL, as_json, await_condition, command, content, decode, morphbus, processes_of, read_events


class Deaths(Dying):
    def test_a_process_that_hosts_several_modules_goes_on_with_all_of_them(self):
        self.start('--processes', 3)
        for module in ('m1', 'm5', 'm9'):
            self.await_successor(module, self.kill(module))
        self.reach(self.control('speed', 0)['tick'] + 20)
        self.control('stop')
        summary = self.end()
        self.assertEqual(summary['restarts'], {module: 1 for module in MODULES})
        self.assert_clean()
        self.assert_repeats()

    def test_a_process_that_is_killed_before_it_has_joined_joins_all_the_same(self):
        self.run_name = 'early'
        self.path = self.folder / 'early.log'
        self.process = subprocess.Popen(
            command('run', *QUADRUPED, '--run', 'early', '--log', self.path, '--json', '--isolate', '--seconds', 0.6),
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.kill_at_the_end(self.process)
        pid = self.kill('m3')
        summary = self.end()
        # It may have been quick enough to be killed in the middle of the run.
        self.assertEqual(summary['restarts'], {'m3': 1}, pid)
        self.assert_repeats()

    def test_the_third_death_within_ten_seconds_ends_the_run_and_is_named(self):
        self.start()
        for _ in range(2):
            self.await_successor('m3', self.kill('m3'))
        self.kill('m3')
        error = self.end(3)['error']
        self.assertEqual(error, 'module m3 was killed by signal 9 (Killed), the third exit within 10 s')
        self.assertEqual(self.summary['restarts'], {'m3': 2})
        self.assertIn(f'END verified, not clean: {error}', morphbus('verify', self.path).stdout)

    def test_a_dead_simulator_or_logger_ends_the_run_and_is_named(self):
        for name in ('sim', 'log'):
            with self.subTest(name):
                self.start(run=f'dead{name}')
                await_condition(lambda: self.ticks_so_far() > 20, 'the log has some of it')
                self.kill(name)
                summary = self.end(3)
                self.assertEqual(summary['error'], f'{name} was killed by signal 9 (Killed)')
                await_condition(lambda: not processes_of(self.run_name), 'no orphans')
                # A logger that is alive says at the end of the log why the run ended; a dead one cannot.
                facts = as_json('info', summary['log'])
                self.assertEqual((facts['end'], facts['clean'], facts['reason']),
                                 ('verified', False, summary['error']) if name == 'sim' else ('missing', None, None))
                self.assert_whole_to_there(summary['log'])

    def assert_whole_to_there(self, path):
        """Up to its last tick, the log lacks no message, and each is that of a run in which nobody died."""
        told = self.payloads(path)
        last = max(decode(data).header.tick for data in told['SIM/CLOCK'])
        self.assertGreater(last, 20)
        as_json('run', *QUADRUPED, '--seconds', (last + 2) * 0.02, '--inproc', '--run', 'alone', '--force', '--log',
                self.folder / 'alone.log', status=None)
        alone = self.payloads(self.folder / 'alone.log')
        # The test set the run's speed, which CLOCK tells.
        commanded = told.pop('SIM/CLOCK')
        self.assertEqual([decode(data).header.tick for data in commanded], list(range(last + 1)))
        self.assertEqual(set(told), set(alone) - {'SIM/CLOCK'})
        for channel, payloads in told.items():
            self.assertEqual([*map(content, payloads)], [*map(content, alone[channel][:len(payloads)])], channel)
            # Only of the last tick something may be missing: it was under way. Of STATUS a tick may have none.
            if not channel.endswith('/STATUS'):
                self.assertGreaterEqual(decode(payloads[-1]).header.tick, last - 1, channel)

    def payloads(self, path):
        """What a log, which may be cut, holds of each channel that counts for the hash, in order."""
        found = {}
        for _, _, channel, data in written_so_far(path):
            name = channel.split('/', 1)[1]
            if name.split('/')[-1] in ('CLOCK', 'SENSORS', 'WORLD', 'TRANSFORM', 'ACTUATOR', 'STATUS'):
                found.setdefault(name, []).append(data)
        return found


class ColdStarts(Dying):
    def roles_by_tick(self, path):
        """{module: [(tick, role), ...]} as STATUS tells."""
        roles = {module: [] for module in MODULES}
        for _, _, channel, data in read_events(path):
            if channel.endswith('/STATUS'):
                status = decode(data)
                roles[channel.split('/')[1]].append((status.header.tick, status.role_name, status.incarnation))
        return roles

    def test_twenty_of_twenty_are_back_within_a_second_and_nobody_else_loses_a_role(self):
        chance = random.Random(20)
        starts, tick = [], 100
        for _ in range(20):
            starts.append((tick, chance.choice(MODULES)))
            tick += chance.randint(60, 75)
        script = self.folder / 'script'
        script.write_text(''.join(f'{at} restart {module} --cold\n' for at, module in starts))
        options = ['--seconds', (tick + 100) * 0.02, '--commands', script, '--run', 'cold', '--force']
        self.path = self.folder / 'cold.log'
        summary = as_json('run', *QUADRUPED, *options, '--isolate', '--log', self.path)
        self.assertEqual(self.commands(), [(at, f'restart {module} --cold') for at, module in starts])
        # Starting anew at somebody's command is no death.
        self.assertEqual(summary['restarts'], {})
        self.assert_clean()
        roles = self.roles_by_tick(self.path)
        usual = {module: {role for tick, role, _ in told if tick < 100 and role} for module, told in roles.items()}
        self.assertEqual({len(played) for played in usual.values()}, {1})
        for at, victim in starts:
            for module, told in roles.items():
                during = [(tick, role) for tick, role, _ in told if at <= tick < at + 60]
                if module != victim:
                    self.assertEqual({role for _, role in during}, usual[module] if during else set(), (at, victim, module))
                    continue
                self.assertEqual(during[0], (at, ''))
                back = [tick for tick, role in during if role]
                self.assertTrue(back and back[0] - at <= 50, (at, victim, during))
                self.assertEqual({role for _, role in during if role}, usual[victim])
        for module, told in roles.items():
            self.assertEqual(told[-1][2], 1 + sum(m == module for _, m in starts))
        # The same in one process, and in three.
        for where in (['--inproc'], ['--isolate', '--processes', 3]):
            again = as_json('run', *QUADRUPED, *options, *where, '--log', self.folder / 'again.log')
            self.assertEqual(again['hash'], summary['hash'], where)

    def test_a_module_begins_anew_at_somebodys_command(self):
        self.start()
        self.control('pause')
        waits = self.control('restart', 'm2', '--cold')
        self.assertTrue(waits['pending'])
        self.control('push', 'm5', 'EAST', 2)
        self.control('resume')
        # One that was killed is first what it was, and then begins anew.
        self.control('kill', 'm7')
        done = self.control('restart', 'm7', '--cold')['tick']
        # Two at once, the root among them.
        self.control('pause')
        both = [self.control('restart', module, '--cold')['tick'] for module in ('m5', 'm1')]
        self.control('resume')
        self.reach(both[0] + 80)
        self.control('stop')
        summary = self.end()
        self.assertIn((waits['tick'], 'restart m2 --cold'), self.commands())
        self.assertIn((done, 'restart m7 --cold'), self.commands())
        self.assertEqual(both[0], both[1])
        self.assertEqual(summary['restarts'], {})
        self.assertNotIn(None, summary['roles'].values())
        self.assert_clean()
        self.assert_repeats()

    def test_a_module_whose_state_is_gone_or_damaged_begins_anew(self):
        self.start()
        folder = self.folder / 'runtime' / 'morphbus' / 'live'
        self.reach(80)
        (folder / 'process-1.state').unlink()
        pid = self.kill('m2')
        self.await_successor('m2', pid)
        # Damaged: the process that was to go on finds out, and the next one begins anew.
        state = folder / 'process-6.state'
        os.kill(self.pid_of('m7'), signal.SIGSTOP)
        head = state.read_bytes()[:64]
        state.write_bytes(head + b'\xff' * (state.stat().st_size - 64))
        self.kill('m7')
        self.await_both_begun()
        self.control('stop')
        summary = self.end()
        self.assertEqual(summary['restarts'], {'m2': 1, 'm7': 2})
        self.assertRegex(self.said, r'm2 was killed by signal 9 \(Killed\); started again, and m2 without a state, anew')
        self.assertRegex(self.said, r'm7 exited with status 4; started again, and m7 without a state, anew')
        self.assertIsNone(summary['error'])
        self.assertNotIn(None, summary['roles'].values())
        names = [re.sub(r' --from \d+', '', text) for _, text in self.commands()]
        self.assertEqual([text for text in names if 'restart' in text], ['restart m2 --cold', 'restart m7 --cold'])
        self.assert_clean()
        # All of it can be done again; only CLOCK names it a tick earlier, as it could not then.
        script = self.folder / 'script'
        script.write_text(morphbus('info', self.path, '--commands').stdout)
        morphbus('run', *QUADRUPED, '--seconds', summary['ticks'] * 0.02, '--inproc', '--run', 'live', '--commands', script,
                 '--log', self.folder / 'again.log')
        hashes = [{name: channel['hash'] for name, channel in as_json('info', path)['channels'].items()
                   if channel['hashed'] and name != 'live/SIM/CLOCK'} for path in (self.path, self.folder / 'again.log')]
        self.assertEqual(len(hashes[0]), 2 + 3 * 9)
        self.assertEqual(*hashes)

    def await_both_begun(self):
        """Until the run has gone on for more than a second of sim time with everybody in it."""
        def reached():
            done = subprocess.run(command('control', 'speed', 0, '--run', 'live', '--json'), capture_output=True, text=True)
            return int(re.search(r'"tick": *(\d+)', done.stdout)[1]) if done.returncode == 0 else 0
        first = await_condition(reached, 'the run answers')
        await_condition(lambda: reached() > first + 80, 'the run goes on')


class Losses(Dying):
    def lose(self, *options, name='lost', status=0, seconds=4):
        self.path = self.folder / f'{name}.log'
        self.summary = as_json('run', *QUADRUPED, '--seconds', seconds, '--run', 'lost', '--log', self.path, '--force', *options,
                               status=status)
        return self.summary

    def test_who_is_lost_is_blamed_for_nothing(self):
        for where in '--inproc', '--isolate':
            summary = self.lose('--lose', 'm4@1.4', where, name=f'blame{where}')
            # It refuses nothing of the run that goes on, answers nothing too late, and its connectors stay closed.
            self.assertEqual((summary['refused'], summary['missed_deadlines'], summary['lateness']), (0, 0, {}))
            self.assertEqual(summary['lost_modules'], {'m4': 1.4})
            self.assertEqual(as_json('info', self.path)['dockings'], [])
            self.assertNotIn('parted', morphbus('info', self.path).stdout)

    def test_a_run_that_loses_modules_goes_on_and_says_so(self):
        loss = ['--lose', 'm1@2.02', '--lose', 'm9@3']
        summary = self.lose(*loss, '--isolate')
        self.assertEqual((summary['lost_modules'], summary['error']), ({'m1': 2.02, 'm9': 3.0}, None))
        self.assertEqual(summary['ended'], 'finished, without m1, without m9')
        self.assertEqual((summary['ticks'], summary['restarts']), (200, {}))
        # The upper halves have no hip any more that has a knee beside it; all others go on.
        self.assertEqual({m for m, role in summary['roles'].items() if role is None}, {'m1', 'm2', 'm8', 'm9'})
        self.assertEqual({text[:3] for text in summary['problems']}, {'m2:', 'm8:'})
        self.assert_clean()
        facts = as_json('info', self.path)
        self.assertEqual((facts['lost_modules'], facts['clean']), ({'m1': 2.02, 'm9': 3.0}, True))
        self.assertEqual(self.commands(), [(101, 'lose m1'), (150, 'lose m9')])
        said = morphbus('info', self.path).stdout
        self.assertIn('m1 was lost at 2.020 s: the run went on without it', said)
        counts = {channel.split('/', 1)[1]: c['messages'] for channel, c in facts['channels'].items()}
        self.assertEqual((counts['m1/TRANSFORM'], counts['m9/ACTUATOR'], counts['m2/ACTUATOR']), (101, 150, 200))
        # Nobody has a connection to it any more, nor has it one.
        for _, _, channel, data in read_events(self.path):
            if not channel.endswith('/SENSORS'):
                continue
            sensors = decode(data)
            for reading in sensors.modules:
                mates = {docked.mate_module for docked in reading.docked}
                there = sensors.header.tick < 101
                self.assertEqual(0 in mates, there and reading.name == 'm2', (reading.name, sensors.header.tick))
                if reading.name == 'm1':
                    self.assertEqual(bool(mates), there, sensors.header.tick)
        whole = self.path
        for where in (['--inproc'], ['--inproc', '--loss', 0.3], ['--isolate', '--processes', 2, '--loss', 0.2]):
            self.assertEqual(self.lose(*loss, *where, name='again')['hash'], summary['hash'], where)
        self.assertEqual(as_json('compare', whole, self.path)['verdict'], 'equivalent')
        # Limp legs and all: it is another run than one without losses.
        self.assertNotEqual(self.lose('--inproc')['hash'], summary['hash'])
        self.assertEqual(self.summary['lost_modules'], {})

    def test_a_program_that_takes_modules_as_they_are_resolves_anew(self):
        program = self.folder / 'count.dyn'
        program.write_text('role Four extends Module { require sizeof(self.connected) == 4; }\n'
                           'role Three extends Module { require sizeof(self.connected) == 3; }\n'
                           'role Two extends Module { require sizeof(self.connected) == 2; }\n'
                           'role One extends Module { require sizeof(self.connected) == 1; }\n'
                           'role None extends Module { require sizeof(self.connected) == 0; }\n')
        run = lambda *options: as_json('run', MODEL, program, '--robot', 'quadruped', '--seconds', 2, '--inproc', '--log',
                                       self.folder / 'count.log', '--force', *options)['roles']
        before, after = run(), run('--lose', 'm3@1')
        names = ['None', 'One', 'Two', 'Three', 'Four']
        changed = {m: (before[m], after[m]) for m in before if before[m] != after[m]}
        self.assertEqual(changed.pop('m3')[1], None)
        # m4 hung on m3 alone: it is cut off from the root, so it takes no new role.
        self.assertEqual(changed.pop('m4'), ('One', None))
        self.assertTrue(changed)
        for module, (was, now) in changed.items():
            self.assertEqual(names.index(was) - names.index(now), 1, module)

    def test_a_module_is_lost_at_somebodys_command_and_then_nothing_can_be_had_of_it(self):
        self.start()
        self.control('pause')
        waits = self.control('lose', 'm6')
        self.assertIn("did you mean 'm6'", self.refuse(2, 'lose', 'm66'))
        self.assertIn('m6 is lost', self.refuse(1, 'lose', 'm6'))
        self.control('resume')
        for words in (['restart', 'm6'], ['restart', 'm6', '--cold'], ['kill', 'm6'],
                      ['invoke', 'FrontLeftUpperHalf.move_thigh', '--to', 'm6']):
            self.assertIn('m6 is lost: the run goes on without it', self.refuse(1, *words))
        # Its process has nothing more to do.
        await_condition(lambda: not self.pids_of('m6'), 'm6 has left')
        self.reach(waits['tick'] + 30)
        self.control('stop')
        summary = self.end()
        self.assertEqual(summary['lost_modules'], {'m6': waits['seconds']})
        self.assertEqual(summary['ended'], 'stopped by command')
        self.assert_clean()
        self.assert_repeats()

    def test_the_last_words_of_a_lost_module_are_in_the_log_though_it_was_killed_before_the_logger_had_them(self):
        self.run_name, self.path = 'words', self.folder / 'words.log'
        script, rules = self.folder / 'script', self.folder / 'rules'
        script.write_text('60 speed 0\n')
        # Of what m6 says last the logger loses most, whenever it is said.
        rules.write_text('fault process=LOG channel=m6/* from=49 until=50 loss=0.9\n')
        loss = [*QUADRUPED, '--seconds', 4, '--lose', 'm6@1', '--commands', script, '--run', 'words', '--log', self.path, '--force']
        self.process = subprocess.Popen(command('run', *loss, '--speed', 0.25, '--faults', rules, '--isolate', '--json'),
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.kill_at_the_end(self.process)
        state = self.folder / 'runtime' / 'morphbus' / 'words' / 'process-5.state'
        # It is saved before the first tick, with each, and when the module is told to leave (bridge/module/snapshot_file.cc).

        def saves():
            if not state.exists():
                return 0
            with state.open('rb') as file:
                # It is empty for a moment.
                return int.from_bytes(file.read(8), sys.byteorder)
        logger, module = self.pid_of('log'), self.pid_of('m6')
        await_condition(lambda: saves() > 42, 'tick 41 is answered', pause=0.001)
        os.kill(logger, signal.SIGSTOP)
        await_condition(lambda: saves() > 50, 'tick 49 is answered', pause=0.001)
        # Who did not wait for the logger would go on without m6, and the launcher would hear of that.
        time.sleep(0.3)
        os.kill(module, signal.SIGKILL)
        os.kill(logger, signal.SIGCONT)
        summary = self.end()
        self.assertEqual((summary['lost_modules'], summary['restarts']), ({'m6': 1.0}, {'m6': 1}))
        self.assert_clean()
        self.assertEqual(as_json('run', *loss, '--inproc')['hash'], summary['hash'])

    def test_after_the_last_tick_nobody_is_lost(self):
        whole = self.lose('--inproc', seconds=1)['hash']
        for where in '--inproc', '--isolate':
            summary = self.lose('--lose', 'm4@1', where, seconds=1)
            self.assertEqual((summary['ended'], summary['lost_modules'], summary['hash']), ('finished', {}, whole))
            self.assertTrue(as_json('reproduce', self.path)['same'])

    def test_of_commands_that_a_run_ends_before_it_warns(self):
        script = self.folder / 'script'
        script.write_text('49 push m5 EAST 20\n50 push m5 EAST 20\n')
        for options, warnings in (
                (('--lose', 'm4@1'), ['the run ends before tick 50, in which "lose m4" was to take effect: give it more --seconds']),
                (('--lose', 'm4@0.98'), []),
                (('--commands', script),
                 ['the run ends before tick 50, in which "push m5 EAST 20" was to take effect: give it more --seconds'])):
            run = morphbus('run', *QUADRUPED, '--inproc', '--no-log', '--seconds', 1, *options)
            self.assertEqual(run.stderr.splitlines(), [f'morphbus: warning: {text}' for text in warnings])

    def test_what_cannot_be_lost_is_refused(self):
        for text, why in (('m33@1', "did you mean 'm3'"), ('m3', 'expected MODULE@SECONDS'), ('@1', 'expected MODULE@'),
                          ('m3@', 'expected MODULE@'), ('m3@0', 'expected MODULE@'), ('m3@nan', 'expected MODULE@'),
                          ('m3@1e300', 'expected MODULE@'), ('', 'its value is empty'), ('m3@1x', 'expected MODULE@')):
            done = morphbus('run', *QUADRUPED, '--seconds', 1, '--inproc', '--lose', text, status=2)
            self.assertIn(why, done.stderr, text)


if __name__ == '__main__':
    unittest.main()
