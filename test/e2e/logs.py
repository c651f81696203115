#!/usr/bin/env python3
"""The commands for runs and logs, when they are asked for what cannot be: status 2, at once, and why."""
import json
import os
import pathlib
import re
import resource
import signal
import subprocess
import unittest

from support import LIMIT, MODEL, PROGRAM, ROBOTS, ShortRun, as_json, morphbus, read_events, write_events


class Logs(ShortRun):
    """Questions to one short log of a run called "short"."""

    SECONDS = 2

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

    def test_replay_refuses_what_would_never_begin(self):
        for options, why in ((('--from', 5, '--to', 3), 'the range is empty'), (('--from', 1, '--to', 1), 'empty'),
                             (('--from', 'nan'), "expected seconds, such as 2.5, 2.5s or 200ms, not 'nan'"), (('--from=-1',), '--from -1'),
                             (('--to', 'inf'), "not 'inf'"), (('--to=-1',), '--to -1'), (('--wait-for=-1',), '--wait-for')):
            self.assertIn(why, self.refused('replay', self.short, '--isolate', *options))

    def test_a_replay_that_waits_for_enter_needs_somebody_to_type_it(self):
        for stdin in (subprocess.DEVNULL, None):
            ended = {'stdin': stdin} if stdin else {'input': ''}
            self.assertIn('in a terminal', self.refused('replay', self.short, '--isolate', '--paused', **ended))
        done = morphbus('replay', self.short, '--isolate', '--speed', 0, '--paused', input='\n')
        self.assertIn('messages published', done.stdout)

    def test_replay_warns_of_a_range_beyond_the_end_and_of_damaged_messages(self):
        done = morphbus('replay', self.short, '--isolate', '--speed', 0, '--from', 50)
        self.assertRegex(done.stderr, r'warning: --from 50: .* ends at 2\.0')
        damaged = self.folder / 'damaged.log'
        events = read_events(self.short)
        number, timestamp, channel, data = events[len(events) // 2]
        events[len(events) // 2] = (number, timestamp, channel, data[:-1] + bytes([data[-1] ^ 1]))
        write_events(damaged, events)
        done = morphbus('replay', damaged, '--isolate', '--speed', 0, '--json')
        self.assertIn('"damaged_messages": 1', done.stdout)
        self.assertIn('1 damaged message in the file', done.stderr)
        self.assertNotIn('warning', morphbus('replay', self.short, '--isolate', '--speed', 0).stderr)

    def test_draw_says_what_belongs_to_a_log_and_what_to_a_model(self):
        picture = self.folder / 'x.svg'
        for arguments, why in (((self.short,), 'is a log: say with --at'), ((self.short, '--at', 'nan'), "not 'nan'"),
                               ((self.short, '--at=-1'), '--at -1: expected a sim time'),
                               ((self.short, '--at', '1e300'), 'the log ends at 1.98'),
                               ((self.short, '--at', 1, '--robot', 'quadruped'), 'leave --robot out'),
                               ((self.short, '--at', 1, '--module', 'MTRAN'), 'leave them out'),
                               ((self.short, '--at', 1, '--number', 3), '--number and --program draw from a model'),
                               ((self.short, '--at', 1, '--fps', 30), '--fps is of a video'),
                               ((MODEL, '--robot', 'quadruped', '--fps', 30), '--fps is of a video'),
                               ((self.short, '--at', 1, '--from', 0.5), '--from and --to are of a strip or a video'),
                               ((MODEL, '--robot', 'quadruped', '--to', 2), '--from and --to are of a strip or a video'),
                               ((MODEL, '--at', 1), f'{MODEL} holds no sound event: it is no log'),
                               ((MODEL, '--robot', 'quadruped', '--run', 'x'), 'needs --at')):
            said = self.refused('draw', *arguments, '-o', picture)
            self.assertIn(why, said)
            self.assertEqual(said.count('\n'), 1, said)
            self.assertFalse(picture.exists())
        # A file that no picture may be called like is not offered to be written over.
        self.assertRegex(self.refused('draw', self.short, '--at', 1, '-o', MODEL), "error: .*: a picture's name ends in .svg or .png\n$")
        widths = []
        for width in (300, 500):
            morphbus('draw', self.short, '--at', 1, '--width', width, '-o', picture)
            widths.append(float(re.search(r'<svg [^>]*width="([\d.]+)', picture.read_text())[1]))
        self.assertEqual(widths[1] - widths[0], 200)

    def test_repair_keeps_what_is_sound_and_spares_the_log(self):
        whole = pathlib.Path(self.short).read_bytes()
        cut, sound = self.folder / 'walk.log.partial', self.folder / 'sound.log'
        cut.write_bytes(whole[:len(whole) // 2])
        answer = as_json('repair', cut, '-o', sound)
        self.assertEqual(answer['events_kept'], len(read_events(sound)))
        self.assertEqual(answer['bytes_dropped'], len(whole) // 2 - sound.stat().st_size)
        self.assertEqual([f['kind'] for f in answer['findings']], ['truncated'])
        self.assertRegex(morphbus('repair', cut, '-o', sound).stdout, r'inside the event.*\n.*events kept, \d+ bytes? dropped')
        for output in (cut, self.folder / 'walk.log'):
            self.assertIn('would overwrite', self.refused('repair', cut, '-o', output))
        self.refused('repair', cut, '-o', '-')
        self.refused('repair', MODEL, '-o', self.folder / 'x.log')
        self.assertEqual(cut.read_bytes(), whole[:len(whole) // 2])
        self.assertIn('no END', morphbus('verify', sound, status=1).stdout)

    def test_a_pipe_is_no_log_and_is_refused_at_once(self):
        pipe = self.folder / 'pipe'
        os.mkfifo(pipe)
        for arguments in (('info', pipe), ('verify', pipe), ('compare', pipe, self.short), ('compare', self.short, pipe),
                          ('repair', pipe, '-o', self.folder / 'x.log')):
            self.assertIn('not a regular file', self.refused(*arguments, timeout=LIMIT))

    def test_repair_drops_a_message_that_does_not_fit_its_crc(self):
        damaged, sound = self.folder / 'damaged.log', self.folder / 'sound.log'
        events = read_events(self.short)
        number, timestamp, channel, data = events[len(events) // 2]
        events[len(events) // 2] = (number, timestamp, channel, data[:-1] + bytes([data[-1] ^ 1]))
        write_events(damaged, events)
        answer = as_json('repair', damaged, '-o', sound)
        self.assertEqual(answer['events_kept'], len(events) - 1)
        self.assertEqual([f['kind'] for f in answer['findings']], ['payload'])
        self.assertEqual(as_json('info', sound)['num_damage'], 0)

    def test_run_and_info_say_the_same_of_one_log(self):
        log = self.folder / 'same.log'
        for how in (('--inproc',), ('--isolate',), ('--inproc', '--loss', 0.05)):
            run = as_json('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 3, *how, '--log', log)
            info = as_json('info', log)
            hashed = [c for c in info['channels'].values() if c['hashed']]
            self.assertEqual(run['messages'], sum(c['messages'] for c in hashed))
            for key in ('hash', 'ticks', 'seconds', 'num_faults'):
                self.assertEqual(run[key], info[key], key)
            self.assertEqual(set(run['processes']), set(info['health']))
            for process, ledger in run['processes'].items():
                self.assertEqual(ledger, {key: info['health'][process][key] for key in ledger}, process)

    def test_a_full_disk_ends_a_run_at_once_and_says_so(self):
        def limit():
            signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
            resource.setrlimit(resource.RLIMIT_FSIZE, (3_000_000, 3_000_000))

        log = self.folder / 'full.log'
        done = morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 3600, '--inproc', '--json',
                        '--log', log, status=3, preexec_fn=limit, restore_signals=False, timeout=LIMIT)
        self.assertIn('File too large', json.loads(done.stdout)['error'])
        self.assertTrue(pathlib.Path(f'{log}.partial').exists())

    def test_a_log_without_world_is_equivalent_only_if_simulated_poses_are_left_out(self):
        bare = self.folder / 'bare.log'
        write_events(bare, [event for event in read_events(self.short) if not event[2].endswith('/SIM/WORLD')])
        self.assertIn('WORLD', morphbus('verify', bare, status=1).stdout)
        answer = as_json('compare', self.short, bare, status=2)
        self.assertEqual(answer['verdict'], 'unusable')
        self.assertTrue(any('simulated' in what for what in answer['not_compared']), answer['not_compared'])
        self.assertIn('--without nothing: expected one of propagated, simulated',
                      self.refused('compare', self.short, bare, '--without', 'nothing'))

    def test_one_walk_has_one_cycle_whichever_congruent_robot_walks_it(self):
        walks = [as_json('run', MODEL, PROGRAM, '--robot', robot, '--seconds', 18, '--inproc',
                         '--log', self.folder / 'x.log')['walk'] for robot in ROBOTS]
        for walk in walks:
            # A joint's command may come a tick sooner in one cycle than in another, of which a part shows in the period.
            self.assertAlmostEqual(walk['cycle_s'], 7.02, delta=0.001)
            self.assertAlmostEqual(walk['cycle_s'], walks[0]['cycle_s'], delta=1e-9)
            self.assertAlmostEqual(walk['min_height_m'], walks[0]['min_height_m'], delta=1e-4)
            self.assertEqual(len(walk['cycle_north_m']), 2)

    def test_summaries_fit_a_screen_and_all_has_the_rest(self):
        said, every = (morphbus('info', self.short, *options).stdout for options in ((), ('--all',)))
        self.assertLess(len(said.splitlines()), 35, said)
        facts = as_json('info', self.short)
        modules = [name for name in facts['health'] if name.startswith('m')]
        self.assertEqual(len(modules), 9)
        run = facts['run']
        for module in modules:
            self.assertNotIn(f'/{module}/ACTUATOR', said)
            self.assertRegex(every, f'  {run}/{module}/ACTUATOR +[0-9]')
            self.assertRegex(every, f'  {module}: received [0-9]')
        # The row of all modules is the sum of theirs, and their rate is that of each.
        of_modules = [facts['channels'][f'{run}/{module}/ACTUATOR'] for module in modules]
        messages, rate = sum(c['messages'] for c in of_modules), of_modules[0]['rate_hz']
        self.assertRegex(said, rf'\n  {run}/\*/ACTUATOR \(9\) +{messages} +{rate:.2f} ')
        received = sum(health['received'] for health in facts['health'].values())
        self.assertIn(f'\n  11 processes: received {received}, lost 0,', said)

        said, every = (morphbus('compare', self.short, self.short, *options).stdout for options in ((), ('--all',)))
        self.assertLess(len(said.splitlines()), 25, said)
        self.assertGreater(len(every.splitlines()), 60)
        self.assertEqual(len(re.findall('joint angle', said)), 1)
        self.assertEqual(len(re.findall('joint angle', every)), 9)

    def test_faults_beyond_ten_are_counted_unless_all_are_asked_for(self):
        program = self.folder / 'faults.dyn'
        program.write_text('role A extends Module {\n  behavior b() {\n    print("n", self.time());\n    self.sleepds(1);\n  }\n}\n')
        log = self.folder / 'faults.log'
        morphbus('run', MODEL, program, '--robot', 'quadruped', '--seconds', 2, '--inproc', '--log', log)
        number = as_json('info', log)['num_prints']
        self.assertGreater(number, 50)
        said, every = (morphbus('info', log, *options).stdout for options in ((), ('--all',)))
        self.assertIn(f'\n{number} lines printed:\n', said)
        self.assertEqual(said.count('faults.dyn:3: n '), 10)
        self.assertIn(f'\n  and {number - 10} more (--all)\n', said)
        self.assertEqual(every.count('faults.dyn:3: n '), number)

    def test_one_standard_output_takes_one_output(self):
        for stdout in ('-', '/dev/stdout'):
            said = self.refused('compare', self.short, self.short, '--report', stdout, '--json')
            self.assertIn('both write to standard output', said)
            said = self.refused('graph', MODEL, '--robot', 'quadruped', '--dot', stdout, '--json')
            self.assertIn('both write to standard output', said)
        page = morphbus('compare', self.short, self.short, '--report', '-').stdout
        self.assertTrue(page.lstrip().startswith('<') and page.rstrip().endswith('</html>'), page[-200:])


if __name__ == '__main__':
    unittest.main()
