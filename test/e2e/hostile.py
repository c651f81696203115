#!/usr/bin/env python3
"""Somebody on the bus of a run who wants no good, over real LCM: every attack is counted and named, and is either
harmless to the run's hash or ends the run soon, with a status and an END that say why. Run inside a private network
(see isolated.cc). test/bridge/hostile_test.cc has the same attacks without a network, message by message."""
import copy
import json
import os
import random
import signal
import socket
import struct
import subprocess
import tempfile
import threading
import time
import unittest

from lcm_datagrams import GROUP, PORT, receiver, sender
from support import (MODEL, PROGRAM, Case, as_json, command, decode, encode, lcm_types, morphbus, processes_of,
                     read_events)

SECONDS = 3
RUN = (MODEL, PROGRAM, '--robot', 'quadruped', '--still', '--run', 'live')
SHORT, FRAGMENT = 0x4c433032, 0x4c433033
CLOCK, ACTUATOR = 'live/SIM/CLOCK', 'live/m2/ACTUATOR'


class Forger:
    """Hears everything on the bus and says what it likes, as LCM's own datagrams, written without LCM."""

    def __init__(self, on_message):
        self.on_message, self.stop, self.count = on_message, False, 0
        self.out = sender()
        self.socket = receiver(timeout=0.1)
        self.thread = threading.Thread(target=self.listen)
        self.thread.start()

    def listen(self):
        while not self.stop:
            try:
                data = self.socket.recv(65536)
            except TimeoutError:
                continue
            if data[:4] == b'LC02' and data[8:13] == b'live/':
                channel, payload = data[8:].split(b'\0', 1)
                self.on_message(self, channel.decode(), payload)

    def close(self):
        self.stop = True
        self.thread.join()
        self.socket.close()
        self.out.close()

    def say(self, channel, data):
        self.count += 1
        self.out.sendto(struct.pack('>II', SHORT, self.count) + channel.encode() + b'\0' + data, (GROUP, PORT))

    def say_fragment(self, size):
        """The first fragment of a message that claims to have so many bytes."""
        self.count += 1
        self.out.sendto(struct.pack('>IIIIHH', FRAGMENT, self.count, size, 0, 0, 2) + b'live/long\0' + b'x' * 1000,
                        (GROUP, PORT))


class Attack:
    """Calls `act(forger, message)` for messages of one channel, from a tick on, `times` times at most."""

    def __init__(self, channel, act, tick=20, times=1):
        self.channel, self.act, self.tick, self.times, self.done = channel, act, tick, times, 0

    def __call__(self, forger, channel, data):
        if channel != self.channel or self.done >= self.times:
            return
        message = decode(data)
        if message.header.tick < self.tick:
            return
        self.done += 1
        self.act(forger, message)


def ahead(message, ticks):
    """A copy of the message from so many ticks later."""
    forged = copy.deepcopy(message)
    forged.header.tick += ticks
    forged.header.sequence += ticks
    forged.header.sim_time_us += 20000 * ticks
    return forged


class Hostile(Case):
    @classmethod
    def setUpClass(cls):
        with tempfile.TemporaryDirectory() as folder:
            cls.reference = as_json('run', *RUN, '--seconds', SECONDS, '--inproc', '--log', f'{folder}/x.log')['hash']

    def attacked(self, on_message, speed=2, options=(), reference=None, seconds=SECONDS):
        """A run with a forger on its bus: its summary, and what its log says of itself."""
        self.path = self.folder / 'live.log'
        forger = Forger(on_message)
        try:
            begun = time.monotonic()
            done = subprocess.run(command('run', *RUN, '--seconds', seconds, '--speed', speed, '--log', self.path,
                                          '--force', '--json', *options), capture_output=True, text=True, timeout=120)
            self.wall = time.monotonic() - begun
        finally:
            forger.close()
        self.assertIn(done.returncode, (0, 3), done.stdout + done.stderr)
        self.summary = json.loads(done.stdout)
        self.facts = as_json('info', self.path)
        self.status = done.returncode
        # Whatever happened: only a run of which everybody speaks alike ends well.
        if done.returncode == 0 or self.facts['clean']:
            self.assertEqual(self.summary['hash'], reference or self.reference, self.summary)
            self.assertTrue(self.facts['whole'], self.facts)
            self.assertEqual((done.returncode, self.facts['clean']), (0, True), done.stderr)
        else:
            self.assertTrue(self.facts['reason'])
            self.assertIsNotNone(self.summary['error'])

    def counted(self, what):
        return sum(process[what] for process in self.summary['processes'].values())

    def assert_unharmed(self):
        self.assertEqual((self.status, self.summary['error'], self.facts['clean']), (0, None, True), self.facts['reason'])

    def test_a_command_from_the_future_is_neither_obeyed_nor_logged(self):
        # The run is held at tick 20 until the forger has spoken: however late he is, his tick lies ahead.
        held, through = self.folder / 'held', self.folder / 'through'
        held.write_text('20 pause\n')
        through.write_text('20 pause\n21 resume\n')
        reference = as_json('run', *RUN, '--seconds', SECONDS, '--inproc', '--log', self.folder / 'through.log',
                            '--commands', through)['hash']
        for ticks in (20, 60, 100):
            resumed = []

            def act(forger, command_):
                forged = ahead(command_, ticks)
                forged.joints[0].target_si += 0.25
                forger.say(ACTUATOR, encode(forged))
                resumed.append(subprocess.Popen(command('control', 'resume', '--run', 'live')))
            attack = Attack(ACTUATOR, act)
            self.attacked(attack, options=('--commands', held), reference=reference)
            self.assertEqual(attack.done, 1)
            self.assertEqual(resumed[0].wait(timeout=60), 0)
            self.assert_unharmed()
            # The sim knows at which tick it is; the logger may be up to 16 behind.
            self.assertEqual(self.summary['processes']['SIM']['outside_window'], 1)
            self.assertIn('m2/ACTUATOR: tick', self.summary['processes']['SIM']['first_refused'])
        self.assertIn('refused 1 of a tick that cannot be', morphbus('info', self.path).stdout)

    def test_a_run_whose_log_has_a_forgery_ends_while_it_goes_on(self):
        seconds = 120
        last, stopped, said = [], [], []

        def on_message(forger, channel, data):
            if channel == ACTUATOR:
                last[:] = [decode(data)]
                if last[0].header.tick >= 20 and not stopped:
                    # The module is held, so that it is certain who answers the next tick first.
                    stopped.extend(pid for pid, text in processes_of('live').items() if '--module m2 ' in text)
                    os.kill(stopped[0], signal.SIGSTOP)
            elif channel == 'live/m2/ASK' and stopped and not said:
                # Somebody lacks its answer.
                said.append(ahead(last[0], 1))
                said[0].joints[0].target_si += 0.25
                forger.say(ACTUATOR, encode(said[0]))
                os.kill(stopped[0], signal.SIGCONT)
        self.attacked(on_message, seconds=seconds)
        self.assertEqual((self.status, self.facts['clean']), (3, False))
        self.assertIn('on m2/ACTUATOR than m2 published', self.summary['error'])
        self.assertIn('on m2/ACTUATOR than m2 published', self.facts['reason'])
        self.assertLess(self.summary['ticks'], 50 * seconds / 2)

    def test_an_end_that_is_none_and_a_clock_from_ahead_end_nothing(self):
        for ticks, phase in ((0, 2), (1, 2), (1, 1), (5, 1), (5, 2)):
            def act(forger, clock):
                forged = ahead(clock, ticks)
                forged.phase, forged.end_reason = phase, 'forged' if phase == 2 else ''
                forger.say(CLOCK, encode(forged))
            attack = Attack(CLOCK, act, times=1 if phase == 2 else 3)
            self.attacked(attack)
            # A CLOCK that only tells the next tick may have come first; then its run is not called clean.
            if phase == 2:
                self.assert_unharmed()
                self.assertGreater(self.counted('false_ends'), 0)

    def test_an_old_log_of_the_same_name_played_beside_the_run(self):
        old = self.folder / 'old.log'
        morphbus('run', MODEL, PROGRAM, '--robot', 'equivalent_quadruped', '--still', '--seconds', 2, '--run', 'live',
                 '--log', old, '--isolate')
        for log in (old, self.path_of_same()):
            player = []

            def act(forger, _):
                player.append(subprocess.Popen(['lcm-logplayer', '--speed=2', str(log)], stdout=subprocess.DEVNULL,
                                               stderr=subprocess.DEVNULL))
                self.played = time.monotonic()
            self.attacked(Attack(CLOCK, act, tick=5))
            player[0].kill()
            player[0].wait()
            self.assertGreater(self.summary['refused'], 0)

    def path_of_same(self):
        """The log of an earlier run of the same robot, program and name."""
        path = self.folder / 'same.log'
        morphbus('run', *RUN, '--seconds', SECONDS, '--inproc', '--log', path)
        return path

    def test_a_second_sim_of_the_same_name_ended_by_a_signal(self):
        second = []

        def act(forger, _):
            second.append(subprocess.Popen(command('sim', *RUN, '--seconds', SECONDS), stdout=subprocess.DEVNULL,
                                           stderr=subprocess.DEVNULL))

        def on_message(forger, channel, data):
            attack(forger, channel, data)
            # Once it has spoken of tick 0 it is ended.
            if second and channel == CLOCK and decode(data).header.tick == 0 and second[0].poll() is None:
                second[0].send_signal(signal.SIGINT)
        attack = Attack(CLOCK, act, tick=2)
        self.attacked(on_message, speed=0.5)
        second[0].wait(timeout=30)
        self.assertEqual((self.status, self.facts['clean']), (0, True), self.facts['reason'])
        self.assertGreater(self.summary['refused'], 0)

    def test_a_health_with_a_bad_body_is_not_in_the_log(self):
        def act(forger, command):
            forger.say('live/m2/HEALTH', encode(command))
        attack = Attack(ACTUATOR, act, times=10)
        self.attacked(attack)
        self.assert_unharmed()
        self.assertEqual(self.summary['processes']['LOG']['bad'], 10)

    def test_invented_channels_cost_a_count(self):
        def act(forger, command):
            data = encode(command)
            for i in range(2000):
                forger.say(f'live/x{attack.done}_{i}/ACTUATOR', data)
        attack = Attack(ACTUATOR, act, times=20, tick=5)
        self.attacked(attack)
        self.assert_unharmed()
        self.assertEqual(attack.done, 20)
        log = self.summary['processes']['LOG']
        # What found the logger's socket full was never seen.
        self.assertGreater(log['foreign'], 10000)
        self.assertLessEqual(log['foreign'], 40000)
        self.assertLess(len(self.facts['channels']), 80)
        self.assertEqual(self.facts['end'], 'verified')

    def test_fragments_of_huge_messages_cost_neither_memory_nor_time(self):
        self.attacked(lambda *_: None)
        calm = self.wall

        def rss(facts):
            return max(decode(data).max_rss_kb for _, _, channel, data in read_events(self.path)
                       if channel == 'live/LOG/HEALTH')
        before = rss(self.facts)

        def act(forger, _):
            for _ in range(300):
                forger.say_fragment(15 << 20)
        attack = Attack(ACTUATOR, act, times=20, tick=5)
        self.attacked(attack)
        self.assert_unharmed()
        self.assertEqual(attack.done, 20)
        self.assertGreater(self.summary['processes']['LOG']['fragments'], 3000)
        self.assertLess(rss(self.facts), before + 10000)
        self.assertLess(self.wall, 2 * calm + 2)

    def ask(self, like, **fields):
        ask = lcm_types()['ask_t']()
        ask.header = copy.deepcopy(like.header)
        ask.header.program_hash = 0
        ask.acknowledged_tick = -1
        for name, value in fields.items():
            setattr(ask, name, value)
        return ask

    def test_a_poll_from_the_future_and_a_flood_of_requests_multiply_nothing(self):
        kinds = lcm_types()['ask_t']

        def poll(forger, command):
            ask = self.ask(command, kind=kinds.KIND_POLL, sender='SIM')
            ask.header.tick = 1 << 62
            forger.say('live/LOG/ASK', encode(ask))
        self.attacked(Attack(ACTUATOR, poll))
        self.assert_unharmed()
        self.assertLess(self.summary['resent'], 300)

        def flood(forger, command):
            ask = encode(self.ask(command, kind=kinds.KIND_RESEND, sender='LOG', channel=ACTUATOR,
                                  last_sequence=1 << 62))
            for _ in range(200):
                forger.say('live/m2/ASK', ask)
        attack = Attack(ACTUATOR, flood, times=10)
        self.attacked(attack)
        self.assert_unharmed()
        asked = 200 * attack.done
        # 16 messages are kept: without a bound they would have been sent 32,000 times.
        self.assertLess(self.summary['processes']['m2']['resent'], 16 * asked / 10)

    def test_byes_and_verdicts_before_the_end_are_counted(self):
        kinds = lcm_types()['ask_t']

        def act(forger, command):
            for name in ('LOG', 'm1', 'm5'):
                for kind in (kinds.KIND_BYE, kinds.KIND_VERDICT):
                    forger.say(f'live/{name}/ASK', encode(self.ask(command, kind=kind, sender='SIM')))
        self.attacked(Attack(ACTUATOR, act, times=5))
        self.assert_unharmed()
        self.assertEqual(self.counted('false_ends'), 5 * 2 + 5 * 2)  # LOG takes both, modules BYE

    def race(self, topic, alter, seed):
        """Copies every message of the topic as that of the next tick, altered, a hundred times."""
        chosen = random.Random(seed)

        class Racer(Attack):
            def __call__(self, forger, channel, data):
                if not channel.endswith('/' + topic) or self.done >= 100 or chosen.random() < 0.3:
                    return
                message = decode(data)
                self.done += 1
                forged = ahead(message, chosen.choice((0, 1, 1, 1, 2)))
                if topic in ('SENSORS', 'WORLD'):
                    parts = forged.num_parts
                    forged.header.sequence = forged.header.tick * parts + forged.part
                alter(forged)
                forger.say(channel, encode(forged))
        racer = Racer('', None)
        self.attacked(racer)
        # A run that ends badly may end soon, and some messages are rare.
        if self.status == 0 and topic not in ('STATUS', 'HELLO'):
            self.assertEqual(racer.done, 100)
        self.assertGreater(racer.done, 0)

    def test_whoever_races_a_message_a_hundred_times_never_falsifies_a_run_unseen(self):
        def sensors(m):
            m.modules[0].joint_position_si = [p + 0.1 for p in m.modules[0].joint_position_si]

        def actuator(m):
            m.joints[0].target_si += 0.25

        def transform(m):
            m.role = 0 if m.role < 0 else -1

        def status(m):
            m.role_name = 'Forged'

        def world(m):
            m.num_bodies, m.bodies = 0, []

        def clock(m):
            m.num_controls, m.controls = 1, ['forged']

        def hello(m):
            m.claim += 1
        kinds = {'SENSORS': sensors, 'ACTUATOR': actuator, 'TRANSFORM': transform, 'STATUS': status, 'CLOCK': clock}
        for topic, alter in kinds.items():
            with self.subTest(topic):
                self.race(topic, alter, 1)
        with self.subTest('HELLO'):
            self.race('HELLO', hello, 1)


if __name__ == '__main__':
    unittest.main()
