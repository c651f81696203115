#!/usr/bin/env python3
"""`morphbus control` on the walking quadruped, as its users give commands: in lockstep and in real time, on a
private network and on the tools' own. Whatever was done stands in the log, and is done again by --commands."""
import json
import os
import subprocess
import unittest

from control_live import GREETER, Live
from support import MODEL, PROGRAM, as_json, await_condition, command, morphbus


class Lockstep(Live):
    def test_pause_step_speed_resume_and_stop(self):
        self.start()
        paused = self.control('pause')['tick']
        self.assertIn(f'paused already, at tick {paused}', self.refuse(1, 'pause'))
        stepped = self.control('step', 3)
        self.assertEqual((stepped['tick'], stepped['pending'], stepped['refused']), (paused + 1, False, None))
        self.await_held(paused + 3)
        resumed = self.control('resume')['tick']
        self.assertEqual(resumed, paused + 4)
        self.assertIn('the run is not paused', self.refuse(1, 'resume'))
        self.assertIn('the run is not paused', self.refuse(1, 'step'))
        said = morphbus('control', 'stop', '--run', 'live').stdout
        self.assertRegex(said, r'^stop: tick \d+ \(\d+\.\d\d s\)\n$')
        summary = self.end()
        self.assertEqual(summary['ended'], 'stopped by command')
        self.assertIsNone(summary['error'])
        done = self.commands()
        self.assertIn((paused, 'pause'), done)
        self.assertIn((paused + 1, 'step 3'), done)
        self.assertIn((resumed, 'resume'), done)
        self.assertEqual(done[-1], (summary['ticks'], 'stop'))
        self.assertIn('END verified, clean', morphbus('info', self.path).stdout)
        self.assert_repeats()

    def test_a_push_moves_the_body_and_nothing_else_differs_before(self):
        self.start()
        self.control('pause')
        waits = self.control('push', 'm5.active_block', 'EAST', 20, 0.3)
        self.assertTrue(waits['pending'])
        self.assertIn("did you mean 'active_block'", self.refuse(2, 'push', 'm5.activ_block', 'EAST', 2))
        self.assertIn("did you mean 'EAST'", self.refuse(2, 'push', 'm5', 'EST', 2))
        self.refuse(2, 'push', 'm55', 'UP', 2)
        self.assertEqual(self.control('resume')['tick'], waits['tick'])
        self.reach(waits['tick'] + 20)
        self.control('stop')
        self.end()
        self.assertIn((waits['tick'], 'push m5.active_block EAST 20 0.3'), self.commands())
        self.assert_repeats()
        # The same run without the push.
        quiet = self.folder / 'quiet'
        lines = [line for line in morphbus('info', self.path, '--commands').stdout.splitlines() if 'push' not in line]
        quiet.write_text('\n'.join(lines))
        pushed = self.path
        self.path = self.folder / 'quiet.log'
        morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--inproc', '--run', 'quiet', '--commands', quiet,
                 '--seconds', 60, '--log', self.path, '--json')
        apart = []
        for tick in (waits['tick'], waits['tick'] + 20):
            calm = self.world(tick, 4)
            self.path, other = pushed, self.path
            apart.append(self.world(tick, 4)[2] - calm[2])
            self.path = other
        self.assertEqual(apart[0], 0)
        self.assertGreater(apart[1], 0.0005)

    def test_connectors_open_and_close(self):
        self.start()
        self.control('pause')
        self.assertIn('has no', self.refuse(2, 'disconnect', 'm2.c9'))
        self.control('disconnect', 'm2.c3')
        tick = self.control('connect', 'm2.c3', 'm5.c4')['tick']
        self.control('step')
        self.control('resume')
        self.assertIn('is connected already', self.refuse(1, 'connect', 'm5.c4', 'm2.c3'))
        self.assertIn('is not', self.refuse(1, 'disconnect', 'm1.c5'))
        self.control('stop')
        self.end()
        self.assertEqual([c for t, c in self.commands() if t == tick and c != 'step 1'],
                         ['disconnect m2.c3', 'connect m2.c3 m5.c4'])
        self.assert_repeats()

    def test_a_module_is_killed_and_started_again(self):
        self.start()
        self.control('pause')
        self.control('kill', 'm2')
        self.assertIn('module m2 does not run', self.refuse(1, 'kill', 'm2'))
        self.control('restart', 'm2')
        self.control('restart', 'm7')
        self.control('resume')
        reached = self.control('restart', 'm5')['tick']
        self.reach(reached + 20)
        self.control('stop')
        self.end()
        self.assert_repeats()

    def test_a_script_kills_nobody(self):
        # Run again, a dead module would be waited for, and no tick would come to restart it.
        script = self.folder / 'script'
        script.write_text('5 kill m2\n9 restart m2\n12 kill m3\n')
        runs = [as_json('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 0.4, where, '--run', 'spared',
                        '--commands', script, '--log', self.folder / 'spared.log', '--force')
                for where in ('--isolate', '--inproc')]
        self.assertEqual(runs[0]['hash'], runs[1]['hash'])
        self.path = self.folder / 'spared.log'
        self.assertEqual(self.commands(), [(5, 'kill m2'), (9, 'restart m2'), (12, 'kill m3')])

    def test_a_tick_takes_as_many_commands_as_clock_names(self):
        self.start()
        self.control('pause')
        self.control('restart', 'm2')
        for newtons in (1, 2, 3):
            self.control('push', 'm5', 'EAST', newtons)
        self.assertIn('wait for the next tick already', self.refuse(1, 'push', 'm5', 'EAST', 4))
        self.assertIn('wait for the next tick already', self.refuse(1, 'restart', 'm3'))
        tick = self.control('resume')['tick']
        self.reach(tick + 10)
        self.control('stop')
        self.end()
        self.assertEqual([c for t, c in self.commands() if t == tick],
                         ['restart m2', 'resume', 'push m5 EAST 1', 'push m5 EAST 2', 'push m5 EAST 3'])
        self.assert_repeats()

    def test_a_script_may_do_more_at_once_and_the_log_says_when(self):
        script = self.folder / 'script'
        script.write_text(''.join(f'5 push m5 EAST {n}\n' for n in range(1, 13)))
        options = ['--robot', 'quadruped', '--inproc', '--seconds', 0.4, '--run', 'many', '--json', '--force']
        first = morphbus('run', MODEL, PROGRAM, *options, '--commands', script, '--log', self.folder / 'many.log')
        self.assertNotIn('--commands', first.stderr)
        self.path = self.folder / 'many.log'
        self.assertEqual([t for t, _ in self.commands()], [5] * 5 + [6] * 5 + [7] * 2)
        script.write_text(morphbus('info', self.path, '--commands').stdout)
        again = morphbus('run', MODEL, PROGRAM, *options, '--commands', script, '--log', self.folder / 'again.log')
        self.assertEqual(json.loads(again.stdout)['hash'], json.loads(first.stdout)['hash'])

    def test_a_run_that_is_slow_answers_before_it_does(self):
        self.start()
        self.control('speed', 0.001)
        waits = self.control('push', 'm5', 'EAST', 2)
        self.assertTrue(waits['pending'])
        self.reach(waits['tick'])
        self.control('stop')
        self.end()
        self.assertIn((waits['tick'], 'push m5 EAST 2'), self.commands())

    def test_what_was_put_off_and_then_fails_is_warned_of(self):
        self.start()
        self.control('pause')
        tick = self.control('connect', 'm2.c3', 'm5.c4')['tick']
        self.control('resume')
        self.reach(tick)
        self.control('stop')
        self.end()
        self.assertRegex(self.said, rf'control: tick {tick}: connect m2.c3 m5.c4: .*is connected already')
        self.assertNotIn('connect', ' '.join(c for _, c in self.commands()))

    def test_a_module_that_stays_dead_ends_the_run(self):
        self.start()
        self.control('kill', 'm9')
        self.assertEqual(self.end(3)['error'], 'm9 does not answer')

    def test_a_program_is_deployed_and_its_commands_are_invoked(self):
        self.start()
        program = self.folder / 'greeter.dyn'
        program.write_text(GREETER)
        os.chdir(self.folder)
        self.assertIn("did you mean 'move_thigh'", self.refuse(2, 'invoke', 'FrontLeftUpperHalf.move_thig'))
        self.control('invoke', 'FrontLeftUpperHalf.move_thigh', '--to', 'm3')
        begun = self.control('deploy', 'greeter.dyn', '--to', 'm5')
        # Handed over piece by piece, then from module to module; m4 is last to hear of it.
        await_condition(lambda: self.attempt('invoke', 'Foot.lift', 1, '--to', 'm4') == 0, 'm4 runs it')
        self.assertIn('m5 runs this program already', self.refuse(1, 'deploy', 'greeter.dyn', '--to', 'm5'))
        for words, why in ((['Junction.raise', 5, 2], 'takes 3 arguments, not 2'),
                           (['Junction.raise', 5, 2.5, 'true'], 'argument 2 of Junction.raise: expected an int'),
                           (['Junktion.raise', 5, 2, 'true'], "did you mean 'Junction'"),
                           (['FrontLeftUpperHalf.move_thigh'], 'no role')):
            self.assertIn(why, self.refuse(2, 'invoke', *words))
        called = self.control('invoke', 'Junction.raise', 20, 2, 'true')['tick']
        self.reach(called + 50)
        self.control('stop')
        summary = self.end()
        self.assertEqual(summary['roles']['m5'], 'Junction')
        self.assertEqual(summary['roles']['m1'], 'Foot')
        # What is said of modules without a role is said of the program that runs now.
        self.assertTrue(any('Foot' in problem for problem in summary['problems']), summary['problems'])
        self.assertFalse(any('UpperHalf' in problem for problem in summary['problems']), summary['problems'])
        self.assertRegex(dict(self.commands())[begun['tick']], r'^deploy greeter.dyn [0-9a-f]{16} --to m5 --at \d+(\.\d+)?$')
        # Before, each had the role of the program that it was started with.
        self.assertEqual(self.roles_of('m5')[-1], 'Junction')
        self.assertEqual(self.roles_of('m1')[-1], 'Foot')
        self.assertNotIn('Foot', self.roles_of('m1')[:-1])
        self.assertIn(self.roles_when_nobody_interferes()['m1'], self.roles_of('m1')[:-1])
        self.assert_repeats()
        self.assertEqual(as_json('compare', self.path, self.folder / 'again.log')['verdict'], 'equivalent')
        # Another program under the same name is not what was deployed.
        program.write_text(GREETER.replace('== 4', '== 3'))
        err = morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--inproc', '--commands', self.folder / 'text',
                       status=2).stderr
        self.assertIn('is another program now', err)

    def roles_when_nobody_interferes(self):
        return as_json('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 2, '--inproc', '--run', 'alone', '--log',
                       self.folder / 'alone.log', '--force')['roles']

    def test_programs_that_cannot_run_here_are_refused(self):
        self.start()
        broken = self.folder / 'broken.dyn'
        broken.write_text('role A extends Module { behavior b() { self.nothing(); } }')
        self.assertIn('broken.dyn:1:', self.refuse(2, 'deploy', broken))
        image = self.folder / 'program.image'
        morphbus('compile', PROGRAM, '--model', MODEL, '-o', image)
        data = bytearray(image.read_bytes())
        damaged = self.folder / 'damaged.image'
        damaged.write_bytes(data[:100] + bytes([data[100] ^ 1]) + data[101:])
        self.assertIn('damaged', self.refuse(2, 'deploy', damaged))
        data[4] += 1
        newer = self.folder / 'newer.image'
        newer.write_bytes(data)
        self.assertIn('version', self.refuse(2, 'deploy', newer))
        car = self.folder / 'car.image'
        atron = MODEL.parent / 'atron.m3l'
        (self.folder / 'atron.dyn').write_text('role A extends Module { startup s() { self.C7.SET_EXTENDED(true); } }')
        morphbus('compile', self.folder / 'atron.dyn', '--model', atron, '-o', car)
        self.assertIn('for another model', self.refuse(2, 'deploy', car))
        for name, why in (('my prog.dyn', 'must not hold blanks'), ('my#prog.dyn', "must not hold '#'")):
            (self.folder / name).write_text(GREETER)
            self.assertIn(why, self.refuse(2, 'deploy', self.folder / name))
        # The old program goes on, from which each module took its role.
        self.reach(100)
        self.control('stop')
        self.assertEqual(self.end()['roles'], self.roles_when_nobody_interferes())
        self.assertFalse(any('deploy' in c for _, c in self.commands()))

    def test_commands_get_through_loss(self):
        self.start('--loss', 0.3)
        tick = self.control('pause')['tick']
        self.assertEqual(self.control('resume')['tick'], tick + 1)
        self.control('stop')
        self.end()
        self.assertEqual([c for c in self.commands() if 'speed' not in c[1]],
                         [(tick, 'pause'), (tick + 1, 'resume'), (self.summary['ticks'], 'stop')])

    def test_a_run_in_one_process_takes_no_commands(self):
        run = subprocess.Popen(command('run', MODEL, PROGRAM, '--robot', 'quadruped', '--inproc', '--run', 'alone', '--log',
                                       self.folder / 'alone.log'), stdout=subprocess.DEVNULL)
        self.kill_at_the_end(run)
        await_condition(lambda: as_json('runs')['runs'], 'the run is listed')
        self.run_name = 'alone'
        self.assertIn('is in one process', self.refuse(2, 'pause'))

    def test_without_a_run_there_is_nothing_to_command(self):
        self.assertIn('nothing runs here', morphbus('control', 'pause', status=2).stderr)
        self.assertIn("did you mean 'pause'", morphbus('control', 'puase', status=2).stderr)

    def test_a_script_with_mistakes_is_refused_before_anything_starts(self):
        script = self.folder / 'script'
        for text, why in (('5 pause\n7 resum\n', "script:2: no command 'resum' (did you mean 'resume'?)"),
                          ('0 pause\n', 'script:1: expected a tick'), ('9 stop\n# later\n4 pause', 'script:3: ticks must not fall'),
                          ('5 deploy nowhere.dyn', 'nowhere.dyn'),
                          ('{"commands":[{"tick":"x"}]}', 'script: commands[0]: expected an object with a tick')):
            script.write_text(text)
            err = morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--inproc', '--commands', script, status=2).stderr
            self.assertIn(why, err)

    def test_a_script_may_leave_a_run_in_one_process_nothing_to_go_on_with(self):
        script = self.folder / 'script'
        script.write_text('5 pause\n6 step 2\n')
        summary = as_json('run', MODEL, PROGRAM, '--robot', 'quadruped', '--inproc', '--commands', script, '--log',
                          self.folder / 'p.log', '--seconds', 4, status=1)
        self.assertEqual((summary['ended'], summary['ticks']), ('paused, with no command to resume', 8))


class Realtime(Live):
    def test_commands_in_real_time(self):
        self.start('--realtime', '--speed', 4)
        paused = self.control('pause')['tick']
        self.control('push', 'm5', '0,0,1', 5)
        self.control('step', 2)
        self.await_held(paused + 2)
        self.assertEqual(self.control('resume')['tick'], paused + 3)
        program = self.folder / 'greeter.dyn'
        program.write_text(GREETER)
        self.control('invoke', 'FrontLeftUpperHalf.move_thigh')
        self.control('disconnect', 'm2.c3')
        self.control('deploy', program)
        self.control('kill', 'm2')
        self.control('restart', 'm2')
        self.control('stop')
        summary = self.end()
        self.assertEqual(summary['ended'], 'stopped by command')
        self.assertEqual([c.split()[0] for _, c in self.commands() if not c.startswith('speed')],
                         ['pause', 'step', 'push', 'resume', 'invoke', 'disconnect', 'deploy', 'kill', 'restart', 'stop'])
        self.assertTrue(as_json('info', self.path)['clean'])


if __name__ == '__main__':
    unittest.main()
