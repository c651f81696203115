#!/usr/bin/env python3
"""A walk whose processes are killed, stopped and starved is, message for message, the walk of processes that are left
alone."""
import os
import pathlib
import random
import signal
import subprocess
import sys
import time
import unittest

from dying import MODULES, QUADRUPED, Dying
from gait import CYCLE, FIRST_STEP
from support import as_json, await_condition, command, morphbus

EXIT_SECONDS = 10  # In which a process may die twice, and not three times.
KILLS = 50  # Of each module.
PER_RUN = 2


class Kills(Dying):
    def kill_each_twice(self, seed):
        """In one walk every module process dies twice: at random ticks of a cycle of the gait, somewhere in the tick."""
        chance = random.Random(seed)
        run = f'walk{seed}'
        self.start(run=run)
        self.reach(FIRST_STEP)
        victims = MODULES * PER_RUN
        chance.shuffle(victims)
        first = self.tick()
        moments = sorted(first + chance.randrange(CYCLE) for _ in victims)
        for module, moment in zip(victims, moments):
            pid = self.pid_of(module)
            await_condition(lambda: self.tick() >= moment, f'tick {moment}')
            time.sleep(chance.uniform(0, 0.02))  # The moment: anywhere in a tick.
            os.kill(pid, signal.SIGKILL)
            self.await_successor(module, pid)
        # The walk goes on after the last death, long enough for a whole cycle.
        self.reach(FIRST_STEP + 2 * CYCLE)
        self.control('stop')
        summary = self.end()
        self.assertIsNone(summary['error'])
        self.assertEqual(summary['restarts'], {module: PER_RUN for module in MODULES})
        self.assertIn('started again, it goes on where it was', self.said)
        # Whoever reads the log later learns of it.
        health = as_json('info', self.path)['health']
        self.assertEqual({m: health[m]['restarts'] for m in MODULES}, summary['restarts'])
        self.assert_clean()
        self.assert_walked()
        self.assert_undisturbed()

    def assert_undisturbed(self):
        """The hash is that of a run with the same commands at the same ticks, in which nobody dies."""
        script = self.folder / 'script'
        script.write_text(morphbus('info', self.path, '--commands').stdout)
        alone = as_json('run', *QUADRUPED, '--seconds', self.summary['ticks'] * 0.02, '--inproc', '--run', 'alone',
                        '--commands', script, '--log', self.folder / 'alone.log', '--force')
        self.assertEqual(alone['restarts'], {})
        self.assertEqual(alone['hash'], self.summary['hash'])


class Once(Kills):
    def test_each_module_killed_twice_in_a_walk_changes_no_message(self):
        self.kill_each_twice(9)


class Often(Kills):
    def test_each_module_killed_at_fifty_random_moments_of_a_walk_changes_no_message(self):
        # Only two a walk, for the third within ten seconds would end it.
        for seed in range(KILLS // PER_RUN):
            with self.subTest(seed=seed):
                self.kill_each_twice(seed)

    def test_a_process_may_die_more_than_twice_if_not_within_ten_seconds(self):
        chance = random.Random(9)
        self.start()
        self.reach(FIRST_STEP)
        exits = {module: [] for module in MODULES}
        for _ in range(KILLS):
            # A process that died twice within ten seconds is spared for a while.
            def spared():
                now = time.monotonic()
                return [m for m in MODULES if len(exits[m]) < 2 or now - exits[m][-2] > EXIT_SECONDS + 0.5]
            module = chance.choice(await_condition(spared, 'somebody may die'))
            pid = self.kill(module)
            self.await_successor(module, pid)
            # Whoever counts exits has noticed it by now, and not before it happened: two that are so far apart here are
            # no nearer there, however busy the machine is.
            exits[module].append(time.monotonic())
        self.control('stop')
        summary = self.end()
        self.assertGreater(max(summary['restarts'].values()), 2)
        self.assertEqual(summary['restarts'], {m: len(times) for m, times in sorted(exits.items()) if times})
        self.assertEqual(sum(summary['restarts'].values()), KILLS)
        self.assert_clean()
        self.assert_repeats()


class Stops(Dying):
    def test_whoever_is_stopped_for_two_seconds_changes_no_message(self):
        self.start()
        self.reach(FIRST_STEP)
        for name in (*MODULES, 'sim', 'log', 'launcher'):
            pid = self.pid_of(name)
            before = self.tick()
            os.kill(pid, signal.SIGSTOP)
            time.sleep(2)  # What is tested: two seconds.
            self.assertEqual(state_of(pid), 'T', name)
            os.kill(pid, signal.SIGCONT)
            # The walk goes on before the next one is stopped.
            await_condition(lambda: self.tick() > before + 50, f'it goes on after {name}')
        self.control('stop')
        self.assertEqual(self.end()['restarts'], {})
        self.assert_clean()
        self.assert_walked()
        self.assert_repeats()


class StoppedTogether(Dying):
    def test_a_launcher_that_goes_on_before_the_rest_of_a_run_takes_nobody_for_silent(self):
        self.start()
        self.reach(FIRST_STEP)
        names = ('launcher', *MODULES, 'sim', 'log')
        before = self.tick()
        pids = {name: self.pid_of(name) for name in names}
        for pid in pids.values():
            os.kill(pid, signal.SIGSTOP)
        time.sleep(9)  # What is tested: longer than the launcher waits for a word of the simulator.
        os.kill(pids['launcher'], signal.SIGCONT)
        time.sleep(0.3)  # What is tested: that it goes on first.
        for name in names[1:]:
            os.kill(pids[name], signal.SIGCONT)
        await_condition(lambda: self.tick() > before + 50, 'the run goes on')
        self.control('stop')
        self.assertEqual(self.end()['restarts'], {})
        self.assert_clean()


def state_of(pid):
    """As the kernel names it: R, S, T, ..."""
    return pathlib.Path(f'/proc/{pid}/stat').read_text().rsplit(')', 1)[1].split()[0]


class Starved(Dying):
    SECONDS = 1
    HOGS = 1

    def test_processes_that_hardly_get_a_processor_change_no_message(self):
        alone = as_json('run', *QUADRUPED, '--seconds', self.SECONDS, '--inproc', '--log', self.folder / 'alone.log')
        # All eleven processes on one processor, where another that goes before them never rests: of its time they get
        # a seventh or less.
        core = str(min(os.sched_getaffinity(0)))
        for _ in range(self.HOGS):
            hog = subprocess.Popen(['taskset', '-c', core, sys.executable, '-c', 'while True: pass'])
            self.kill_at_the_end(hog)
        log = self.folder / 'starved.log'
        begun = os.times()
        done = subprocess.run(['nice', '-n', '19', 'taskset', '-c', core, *command(
            'run', *QUADRUPED, '--seconds', self.SECONDS, '--isolate', '--log', log, '--json')],
            capture_output=True, text=True, timeout=800)
        self.assertEqual(done.returncode, 0, done.stderr)
        ended = os.times()
        # It was starved indeed.
        used = ended.children_user + ended.children_system - begun.children_user - begun.children_system
        self.assertLess(used, 0.25 * (ended.elapsed - begun.elapsed))
        starved = as_json('info', log)
        self.assertEqual(starved['hash'], alone['hash'])
        self.path = log
        self.assert_clean()


if __name__ == '__main__':
    unittest.main()
