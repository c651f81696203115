#!/usr/bin/env python3
"""Every command of `morphbus control`, given to the quadruped while it walks: in lockstep on a private network and on the
bus that all tools share, and by a script in real time. Each mode is one run, to which all commands are given one after
the other; then each command has a test, which looks for its effect in the log and not only for its acknowledgement."""
import functools
import math
import time
import unittest

from control_live import ROLES_TAKEN, Live, written_so_far
from support import MODEL, PROGRAM, SOURCE, as_json, await_condition, decode, processes_of, read_events

CAREFUL = SOURCE / 'models' / 'programs' / 'quadruped_careful.dyn'
MODULES = [f'm{i}' for i in range(1, 10)]
HUB = 4  # number of m5, whose body is the robot's trunk
DIAMETER = 4
STANDING_UP = 260  # ticks from the last role taken to the first step of the walk
SLOW, SLOW_TICKS = 0.5, 25  # A paced run is at this speed for so many ticks.
# Ticks in which a push must show, and a killed module be missed.
SOON = 20
# No pause between two steps is so many ticks long, and each turns some joint by more than this (rad).
BETWEEN_STEPS, LEAST_TURN = 150, 0.15
# These follow a module's beginning anew, which stands up first while the others may wait for it.
AFTER_A_COLD_START = ('deploy', 'invoke', 'push')
PUSHED_AWAY, NOT_PUSHED = 0.05, 0.02  # m


class WalkUnderCommand(Live):
    """A run of one mode with all commands in it; `given` has what was answered to each."""

    def give_all(self, isolate):
        self.given = {}
        self.start(isolate=isolate)
        self.get_walking()
        self.change_speed()
        self.hold_and_step()
        self.undock_and_dock()
        self.kill_and_restart()
        self.reprogram()
        self.push_and_lose()
        self.give('stop', 'stop')
        self.end()
        self.info = as_json('info', self.path)

    def give(self, name, *words):
        self.given[name] = self.control(*words)
        return self.given[name]['tick']

    def go_to(self, tick):
        """Lets the run go on until this tick is over."""
        self.reach(tick)

    def events_so_far(self, topic):
        return [decode(data) for *_, channel, data in written_so_far(f'{self.path}.partial') if channel.endswith(topic)]

    def latest(self, topic):
        """The tick of the newest message of a topic."""
        return decode([data for *_, channel, data in written_so_far(f'{self.path}.partial')
                       if channel.endswith(topic)][-1]).header.tick

    def get_walking(self):
        def all_have_roles():
            taken = {}
            for status in self.events_so_far('/STATUS'):
                if status.role_name:
                    taken.setdefault(status.module_id, status.header.tick)
            return len(taken) == len(MODULES) and max(taken.values())
        self.walking = await_condition(all_have_roles, 'all modules have roles') + STANDING_UP
        self.go_to(self.walking)

    def change_speed(self):
        begun = time.monotonic()
        tick = self.give('speed', 'speed', SLOW)
        await_condition(lambda: self.latest('/SIM/CLOCK') > tick + SLOW_TICKS, 'the run goes on slowly')
        self.slow_seconds = time.monotonic() - begun
        self.control('speed', 0)

    def hold_and_step(self):
        held = self.give('pause', 'pause')
        self.await_held(held)
        self.give('step', 'step', 3)
        self.await_held(held + 3)
        self.steps_done = self.refuse(1, 'pause')
        self.give('resume', 'resume')

    def undock_and_dock(self):
        # In two ticks without its front left leg the robot cannot fall apart.
        held = self.control('pause')['tick']
        self.give('disconnect', 'disconnect', 'm2.c3')
        self.control('step', 2)
        self.await_held(held + 2)
        self.give('connect', 'connect', 'm2.c3', 'm5.c4')
        self.go_to(self.control('resume')['tick'] + SOON)

    def process_of(self, module):
        return {pid for pid, text in processes_of(self.run_name).items() if f'--module {module} ' in f'{text} '}

    def kill_and_restart(self):
        before = {module: self.process_of(module) for module in ('m2', 'm7')}
        self.give('kill', 'kill', 'm2')
        await_condition(lambda: not self.process_of('m2'), 'the process of m2 is gone')
        self.control('restart', 'm2')
        restarted = self.give('restart', 'restart', 'm7')
        for module in before:
            await_condition(lambda topic=f'/{module}/TRANSFORM': self.latest(topic) > restarted, f'{module} speaks again')
        self.processes = {module: (was, self.process_of(module)) for module, was in before.items()}
        self.give('restart --cold', 'restart', 'm9', '--cold')
        await_condition(lambda: any(status.incarnation == 2 and status.role_name for status in self.events_so_far('/m9/STATUS')),
                        'm9 has begun anew and has its role')

    def reprogram(self):
        self.give('deploy', 'deploy', self.greeting(), '--to', 'm3')
        self.go_to(round(self.given['deploy']['switch_seconds'] / 0.02) + SOON)
        self.go_to(self.give('invoke', 'invoke', 'Junction.greet', 7, '--to', 'm9') + SOON)

    def greeting(self):
        program = self.folder / 'greeting.dyn'
        program.write_text(CAREFUL.read_text().replace(
            'behavior gait() {', 'command greet(int n) { print("heard", n); }\n\n  behavior gait() {', 1))
        return program

    def push_and_lose(self):
        self.go_to(self.give('push', 'push', 'm5', 'EAST', 60, 0.1) + SOON)
        self.go_to(self.give('lose', 'lose', 'm1') + SOON)
        await_condition(lambda: not self.process_of('m1'), 'the process of m1 is gone')

    def give_script(self, faults):
        """The same in real time in one process, by a script: all but what only processes can do. Lateness is by `faults`."""
        self.path = self.folder / 'script.log'
        program = self.greeting()
        self.walking = ROLES_TAKEN + STANDING_UP
        tick = self.walking + SOON
        script = [('speed', tick, f'speed {SLOW}'), ('pause', tick + 30, 'pause'), ('step', tick + 31, 'step 3'),
                  ('resume', tick + 34, 'resume'),
                  ('disconnect', tick + 60, 'disconnect m2.c3'), ('connect', tick + 62, 'connect m2.c3 m5.c4'),
                  ('restart --cold', tick + 90, 'restart m9 --cold'), ('deploy', tick + 200, f'deploy {program} --to m3 --at 18'),
                  ('invoke', 950, 'invoke Junction.greet 7 --to m9'), ('push', 1000, 'push m5 EAST 60 0.1'),
                  ('lose', 1050, 'lose m1'), ('stop', 1100, 'stop')]
        texts = {'commands': ''.join(f'{at} {text}\n' for _, at, text in script), 'faults': faults}
        for name, text in texts.items():
            (self.folder / name).write_text(text)
        self.summary = as_json('run', MODEL, PROGRAM, '--robot', 'quadruped', '--realtime', '--inproc', '--run', 'script', '--log',
                               self.path, '--commands', self.folder / 'commands', '--faults', self.folder / 'faults')
        self.info = as_json('info', self.path)
        done = {c['tick']: c['command'] for c in self.info['commands']}
        self.given = {name: {'tick': at, 'command': done.get(at), 'refused': None} for name, at, _ in script}
        self.given['deploy']['switch_seconds'] = 18

    @functools.cache
    def messages(self, topic):
        """The messages of a topic in order of ticks."""
        found = [decode(data) for *_, channel, data in self.events if channel.endswith(topic)]
        return sorted(found, key=lambda message: message.header.tick)

    @functools.cached_property
    def events(self):
        return read_events(self.path)

    def east(self, tick):
        """How far east the trunk is, in m, at this tick or the first after it that the log has."""
        world = next(w for w in self.messages('/SIM/WORLD') if w.header.tick >= tick)
        return next(body for body in world.bodies if body.module_id == HUB).position_m[2]

    def turned(self, first, last):
        """By how much the joint that turned most did between two ticks, in rad."""
        angles = {}
        for sensors in self.messages('/SIM/SENSORS'):
            if first <= sensors.header.tick <= last:
                for module in sensors.modules:
                    for joint, angle in enumerate(module.joint_position_si):
                        angles.setdefault((module.name, joint), []).append(angle)
        return max(max(seen) - min(seen) for seen in angles.values())


class Commands:
    """What each command has done; the classes below say in which mode."""
    REALTIME, COMMANDS = False, 14

    @classmethod
    def setUpClass(cls):
        cls.run_ = WalkUnderCommand()
        cls.addClassCleanup(cls.run_.doCleanups)
        cls.run_.setUp()
        cls.give()

    def tick(self, name):
        return self.run_.given[name]['tick']

    def said_by(self, module, since=0):
        return [status for status in self.run_.messages(f'/{module}/STATUS') if status.header.tick >= since]

    def ticks_of(self, module):
        return [message.header.tick for message in self.run_.messages(f'/{module}/TRANSFORM')]

    def dockings(self):
        """(tick, docked) of the connector that is opened and closed."""
        return [(round(d['time'] / 0.02), d['docked']) for d in self.run_.info['dockings'] if d['connector'] == 'm2.c3']

    def assert_same_role_before_and_after(self, module, tick):
        roles = [status.role_name for status in self.said_by(module)]
        self.assertNotEqual(roles[-1], '')
        self.assertEqual({role for role in roles if role}, {roles[-1]})
        if not self.REALTIME:
            # In lockstep nobody notices anything, not even for a tick.
            self.assertNotIn('', [status.role_name for status in self.said_by(module, self.run_.walking)])

    def test_each_is_given_while_the_robot_walks_and_stands_in_the_log(self):
        commands = [(c['tick'], c['command']) for c in self.run_.info['commands']]
        self.assertEqual(len(self.run_.given), self.COMMANDS)
        for name, answer in self.run_.given.items():
            with self.subTest(name):
                self.assertIsNone(answer['refused'])
                self.assertGreater(answer['tick'], self.run_.walking)
                self.assertIn((answer['tick'], answer['command']), commands)
                if name not in ('lose', 'stop'):
                    since = answer['tick'] - BETWEEN_STEPS
                    if name in AFTER_A_COLD_START:
                        # Standing up at the start of the run is no walk.
                        since = max(self.run_.walking, since - STANDING_UP)
                    turned = self.run_.turned(since, answer['tick'])
                    self.assertGreater(turned, LEAST_TURN, 'the robot stands still')

    def test_pause_holds_the_run(self):
        # The next tick is that of the step, however long that took to come.
        self.assertEqual(self.tick('step'), self.tick('pause') + 1)

    def test_resume_goes_on_where_the_steps_ended(self):
        self.assertEqual(self.tick('resume'), self.tick('pause') + 4)
        ticks = [clock.header.tick for clock in self.run_.messages('/SIM/CLOCK')]
        self.assertEqual(ticks, sorted(ticks))
        if not self.REALTIME:
            self.assertEqual(sorted(set(ticks)), list(range(self.run_.summary['ticks'] + 1)))

    def test_disconnect_opens_a_connector(self):
        self.assertEqual(self.dockings()[0], (self.tick('disconnect'), False))

    def test_connect_closes_it_again(self):
        self.assertEqual(self.dockings()[1:], [(self.tick('connect'), True)])
        self.assert_same_role_before_and_after('m4', self.tick('connect'))

    def test_cold_restart_begins_anew_and_takes_the_role_again(self):
        told = self.said_by('m9')
        begun = next(i for i, status in enumerate(told) if status.incarnation == 2)
        before, after = told[:begun], told[begun:]
        self.assertEqual({status.incarnation for status in before}, {1})
        self.assertEqual({status.incarnation for status in after}, {2})
        self.assertEqual(after[0].role_name, '')
        taken = next(status for status in after if status.role_name)
        self.assertEqual(taken.role_name, [status.role_name for status in before if status.role_name][-1])
        if not self.REALTIME:
            # In real time it depends on when the process is there, before or after the CLOCK that names the command.
            self.assertEqual(after[0].header.tick, self.tick('restart --cold'))
            self.assertLessEqual(taken.header.tick, after[0].header.tick + ROLES_TAKEN)

    def test_deploy_switches_every_module_at_the_time_it_named(self):
        deployment, = self.run_.info['deployments']
        named = round(self.run_.given['deploy']['switch_seconds'] / 0.02)
        self.assertEqual((deployment['tick'], deployment['switch_tick']), (self.tick('deploy'), named))
        self.assertEqual(set(deployment['switched']), set(MODULES))
        for module, tick in deployment['switched'].items():
            self.assertIsNotNone(tick, module)
            self.assertGreaterEqual(tick, named)
            self.assertLessEqual(tick, named + (DIAMETER + 2 if self.REALTIME else 0), module)

    def test_invoke_runs_a_command_of_the_program(self):
        printed, = self.run_.info['prints']
        self.assertEqual((printed['module'], printed['role'], printed['text']), ('m5', 'Junction', 'heard 7'))
        self.assertGreaterEqual(round(printed['time'] / 0.02), self.tick('invoke'))

    def test_push_moves_the_body(self):
        pushed = self.tick('push')
        self.assertLess(math.fabs(self.run_.east(pushed) - self.run_.east(pushed - SOON)), NOT_PUSHED)
        self.assertGreater(self.run_.east(pushed + SOON - 1) - self.run_.east(pushed), PUSHED_AWAY)

    def test_lose_goes_on_without_the_module(self):
        lost = self.tick('lose')
        self.assertLess(max(self.ticks_of('m1')), lost)
        self.assertGreater(max(self.ticks_of('m9')), lost + SOON - 2)
        self.assertEqual({name: round(time / 0.02) for name, time in self.run_.info['lost_modules'].items()}, {'m1': lost})

    def test_stop_ends_the_run_well(self):
        self.assertEqual((self.run_.summary['ended'], self.run_.summary['ticks']), ('stopped by command', self.tick('stop')))
        self.assertIsNone(self.run_.summary['error'])
        self.assertEqual((self.run_.info['clean'], self.run_.info['end']), (True, 'verified'))


class OfProcesses(Commands):
    """Where each module is a process; what can be done to it, and how a run answers to people."""
    ISOLATE = True

    @classmethod
    def give(cls):
        cls.run_.give_all(cls.ISOLATE)

    def test_speed_is_the_pace_of_the_run(self):
        # However busy the machine is, no tick begins before its time.
        self.assertGreater(self.run_.slow_seconds, SLOW_TICKS * 0.02 / SLOW)

    def test_step_runs_as_many_ticks_as_it_says(self):
        self.assertIn(f'at tick {self.tick("pause") + 3}\n', self.run_.steps_done)

    def test_kill_ends_the_process(self):
        was, now = self.run_.processes['m2']
        self.assertEqual((len(was), len(was & now)), (1, 0))
        killed = self.tick('kill')
        spoken = set(self.ticks_of('m2')) & set(range(killed, killed + SOON))
        # The others wait for it, so that it has said all.
        self.assertEqual(len(spoken), SOON)

    def test_restart_brings_another_process_that_goes_on_as_the_same_module(self):
        for module in ('m2', 'm7'):
            was, now = self.run_.processes[module]
            self.assertEqual((len(now), len(was & now)), (1, 0), module)
            self.assertGreater(max(self.ticks_of(module)), self.tick('restart') + SOON)
            self.assertEqual({status.incarnation for status in self.said_by(module)}, {1}, module)
        self.assert_same_role_before_and_after('m7', self.tick('restart'))

    def test_the_same_commands_make_the_same_run(self):
        self.run_.assert_repeats()


class Lockstep(OfProcesses, unittest.TestCase):
    pass


class LockstepShared(OfProcesses, unittest.TestCase):
    ISOLATE = False


class Realtime(Commands, unittest.TestCase):
    """In virtual time, so that messages are as late as `LATE` says on any machine."""
    REALTIME, COMMANDS = True, 12
    LATE = 'fault channel=*/TRANSFORM late=0.1 by=0.04s\nfault process=SIM channel=*/ACTUATOR late=0.02 by=0.03s\n'

    @classmethod
    def give(cls):
        cls.run_.give_script(cls.LATE)

    def test_there_are_late_answers(self):
        self.assertGreater(self.run_.summary['missed_deadlines'], 10)


if __name__ == '__main__':
    unittest.main()
