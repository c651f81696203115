#!/usr/bin/env python3
"""Somebody on the bus of a run who wants no good, over real LCM: every attack is counted and named, and is either
harmless to the run's hash or ends the run soon, with a status and an END that say why. Run inside a private network
(see isolated.cc). test/bridge/hostile_test.cc has the same attacks without a network, message by message."""
import os
import random
import signal
import subprocess
import time
import unittest

from hostile_bus import ACTUATOR, CLOCK, RUN, SECONDS, Attack, Attacked, ahead
from support import (LIMIT, MODEL, PROGRAM, as_json, command, decode, encode, lcm_types, morphbus, processes_of, read_events)


class Hostile(Attacked):
    """What needs sockets, or other programs."""

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
            self.assertTrue(any(p['first_refused'] for p in self.summary['processes'].values()))

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
        second[0].wait(timeout=LIMIT)
        self.assertEqual((self.status, self.facts['clean']), (0, True), self.facts['reason'])
        self.assertGreater(self.summary['refused'], 0)
        self.assertTrue(any(p['first_refused'] for p in self.summary['processes'].values()))

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
        self.attacked(attack, speed=0.5)
        self.assert_unharmed()
        self.assertEqual(attack.done, 20)
        log = self.summary['processes']['LOG']
        # What found the logger's socket full was never seen.
        self.assertGreater(log['foreign'], 0)
        self.assertLessEqual(log['foreign'], 40000)
        self.assert_named('LOG', '/ACTUATOR: the run has no such channel')
        self.assertLess(len(self.facts['channels']), 80)
        self.assertEqual(self.facts['end'], 'verified')

    def test_fragments_of_huge_messages_cost_no_memory(self):
        self.attacked(lambda *_: None)

        def rss():
            """Of each process the largest."""
            most = {}
            for _, _, channel, data in read_events(self.path):
                if channel.endswith('/HEALTH'):
                    health = decode(data)
                    most[health.process] = max(most.get(health.process, 0), health.max_rss_kb)
            return most
        before = rss()
        self.assertEqual(len(before), 11)

        def act(forger, _):
            for _ in range(300):
                forger.say_fragment(15 << 20)
        attack = Attack(ACTUATOR, act, times=20, tick=5)
        self.attacked(attack)
        self.assert_unharmed()
        self.assertEqual(attack.done, 20)
        self.assertGreater(self.summary['processes']['LOG']['fragments'], 0)
        self.assert_named('LOG', 'a fragment of a message')
        for process, kilobytes in rss().items():
            self.assertLess(kilobytes, before[process] + 10000, process)

    def test_garbage_on_every_channel_is_counted_and_changes_nothing(self):
        chance = random.Random(7)
        seen = {}

        def on_message(forger, channel, data):
            if seen.setdefault(channel, 0) >= 20:
                return
            seen[channel] += 1
            # Bytes that are nothing, a message that was cut, one with a flipped bit, and one with another's body.
            forger.say(channel, chance.randbytes(chance.randrange(1300)))
            forger.say(channel, data[:chance.randrange(len(data))])
            at = chance.randrange(len(data))
            forger.say(channel, data[:at] + bytes([data[at] ^ 16]) + data[at + 1:])
            forger.say(channel, data[:12] + chance.randbytes(len(data) - 12))
        self.attacked(on_message)
        self.assert_unharmed()
        topics = {channel.split('/')[-1] for channel in seen}
        self.assertGreaterEqual(topics, {'CLOCK', 'SENSORS', 'TRANSFORM', 'ACTUATOR', 'STATUS', 'ASK', 'HEALTH', 'HELLO'})
        # What found a socket full was never seen; each message of garbage that was comes to the logger.
        self.assertGreater(self.summary['processes']['LOG']['bad'], 0)


class AsInVirtualTime(Attacked):
    """The attacks of hostile_test.cc and believed_test.cc, which say message by message and in virtual time how soon a run
    ends and how much is sent again; here it depends on who is quicker."""

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
            self.assertEqual(resumed[0].wait(timeout=LIMIT), 0)
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
                named = [p['first_refused'] for p in self.summary['processes'].values() if p['first_refused']]
                self.assertTrue(any('END' in text or 'SIM/CLOCK' in text for text in named), named)

    def test_a_poll_from_the_future_and_a_flood_of_requests_multiply_nothing(self):
        kinds = lcm_types()['ask_t']

        def poll(forger, command):
            ask = self.ask(command, kind=kinds.KIND_POLL, sender='SIM')
            ask.header.tick = 1 << 62
            forger.say('live/LOG/ASK', encode(ask))
        self.attacked(Attack(ACTUATOR, poll))
        self.assert_unharmed()
        self.assert_named('LOG', 'LOG/ASK: POLL at tick 4611686018427387904')

        def flood(forger, command):
            ask = encode(self.ask(command, kind=kinds.KIND_RESEND, sender='LOG', channel=ACTUATOR,
                                  last_sequence=1 << 62))
            for _ in range(200):
                forger.say('live/m2/ASK', ask)
        attack = Attack(ACTUATOR, flood, times=10)
        self.attacked(attack)
        self.assert_unharmed()
        # 16 messages are kept: without a bound all of them would have been sent again for each request.
        self.assertLess(self.summary['processes']['m2']['resent'], 16 * 200 * attack.done)

    def test_byes_and_verdicts_before_the_end_are_counted(self):
        kinds = lcm_types()['ask_t']

        def act(forger, command):
            for name in ('LOG', 'm1', 'm5'):
                for kind in (kinds.KIND_BYE, kinds.KIND_VERDICT):
                    forger.say(f'live/{name}/ASK', encode(self.ask(command, kind=kind, sender='SIM')))
        self.attacked(Attack(ACTUATOR, act, times=5))
        self.assert_unharmed()
        # LOG takes both, modules BYE; a verdict is none of theirs.
        self.assertEqual(self.counted('false_ends'), 5 * 2 + 5 * 2)
        self.assertEqual([self.summary['processes'][m]['bad'] for m in ('m1', 'm5')], [5, 5])
        self.assert_named('LOG', 'LOG/ASK: BYE at tick')
        self.assert_named('m1', 'm1/ASK: BYE at tick')

    def test_a_module_that_somebody_sends_away_stays(self):
        kinds = lcm_types()['ask_t']

        def act(forger, command):
            # Said of the tick that it has answered, before the sim goes on.
            forger.say('live/m2/ASK', encode(self.ask(command, kind=kinds.KIND_LEAVE, sender='SIM')))
        attack = Attack(ACTUATOR, act, times=100)
        self.attacked(attack)
        self.assert_unharmed()
        self.assertEqual(attack.done, 100)
        self.assertGreater(self.summary['processes']['m2']['false_ends'], 0)
        self.assert_named('m2', 'm2/ASK: LEAVE')

    def test_a_clock_that_loses_a_module_ends_the_run_or_nothing(self):
        for ticks in (0, 1):
            def act(forger, clock):
                forged = ahead(clock, ticks)
                forged.num_controls, forged.controls = 1, ['lose m2']
                forger.say(CLOCK, encode(forged))
            self.attacked(Attack(CLOCK, act))
            if ticks == 0:
                self.assert_unharmed()
            # As other bytes under that number; or, where the forger got too little of a processor, as too late.
            self.assert_named('LOG', 'SIM/CLOCK: ')

    def test_requests_of_every_kind_a_hundred_times_each_change_nothing(self):
        kinds = lcm_types()['ask_t']
        names = ('RESEND', 'ACK', 'INFO', 'END_ACK', 'POLL', 'BYE', 'VERDICT', 'VERDICT_ACK', 'LEAVE', 'ADMIT', 'TAKEN')
        said = dict.fromkeys(names, 0)

        def act(forger, command):
            for name in names:
                # To whoever might believe it, in the name of who might say it.
                kind = getattr(kinds, f'KIND_{name}')
                fields = {'kind': kind, 'sender': 'SIM', 'channel': ACTUATOR}
                if name in ('END_ACK', 'TAKEN'):
                    fields |= {'num_parts': 1}
                to = 'LOG' if name in ('INFO', 'POLL', 'VERDICT', 'TAKEN') else 'm2'
                if name in ('ACK', 'END_ACK', 'VERDICT_ACK'):
                    to, fields['sender'] = 'SIM', 'm2' if name == 'END_ACK' else 'LOG'
                if said[name] < 100:
                    said[name] += 1
                    forger.say(f'live/{to}/ASK', encode(self.ask(command, **fields)))
        self.attacked(Attack(ACTUATOR, act, tick=5, times=1000))
        self.assert_unharmed()
        self.assertEqual(set(said.values()), {100})
        # BYE, LEAVE and ADMIT at the module, acknowledgements at the sim, the verdict at the logger.
        for process in ('m2', 'SIM', 'LOG'):
            self.assertGreater(self.summary['processes'][process]['false_ends'] +
                               self.summary['processes'][process]['bad'], 90, process)
            self.assert_named(process, '/ASK: ')


class Realtime(Attacked):
    """Real time: messages may be lost there, but none may be two."""

    def test_no_number_has_two_messages(self):
        def sensors(m):
            m.modules[0].joint_position_si = [p + 0.1 for p in m.modules[0].joint_position_si]
            m.header.sequence = m.header.tick * m.num_parts + m.part

        def actuator(m):
            m.joints[0].target_si += 0.25

        def transform(m):
            m.role = 0 if m.role < 0 else -1

        def status(m):
            m.role_name = 'Forged'
            m.header.tick -= 1
        for channel, alter in {'SIM/SENSORS': sensors, 'm2/ACTUATOR': actuator, 'm2/TRANSFORM': transform,
                               'm2/STATUS': status}.items():
            with self.subTest(channel):
                def act(forger, message):
                    forged = ahead(message, 1)
                    alter(forged)
                    forger.say(f'live/{channel}', encode(forged))
                attack = Attack(f'live/{channel}', act, tick=50)
                self.attacked(attack, options=('--realtime',), seconds=3, speed=1)
                self.assertEqual((attack.done, self.status, self.facts['clean']), (1, 3, False))
                self.assertIn(channel, self.summary['error'])
                self.assertIn('somebody else speaks on this bus', self.summary['error'])


class Races(Attacked):
    """Every message that a run has is raced a hundred times by an altered copy, before the original or after it."""

    def race(self, topic, alter, run=RUN, reference=None):
        """Says altered copies of messages of the topic, as that of this tick, the next one, or the one after, at each
        command that is heard, so that a hundred are said of rare messages, too."""
        chosen = random.Random(topic)
        last, done = {}, []

        def on_message(forger, channel, data):
            if channel.endswith('/' + topic):
                last[channel] = data
            if not last or len(done) >= 100 or not channel.endswith('/ACTUATOR') or decode(data).header.tick < 2:
                return
            origin = chosen.choice(sorted(last))
            forged = ahead(decode(last[origin]), chosen.choice((0, 1, 1, 1, 2)))
            if topic in ('SENSORS', 'WORLD'):
                forged.header.sequence = forged.header.tick * forged.num_parts + forged.part
            alter(forged)
            done.append(origin)
            forger.say(origin, encode(forged))
        self.attacked(on_message, run=run, reference=reference)
        self.assertEqual(len(done), 100, topic)
        return self.counted('conflicts') + self.counted('outside_window')

    def test_of_the_sim(self):
        def sensors(m):
            m.modules[0].joint_position_si = [p + 0.1 for p in m.modules[0].joint_position_si]

        def clock(m):
            m.num_controls, m.controls = 1, ['forged']
        self.assertGreater(self.race('SENSORS', sensors), 0)
        self.assertGreater(self.race('CLOCK', clock), 0)

    def test_of_the_world(self):
        def world(m):
            m.num_bodies, m.bodies = 0, []
        physics = tuple(argument for argument in RUN if argument != '--still')
        reference = as_json('run', *physics, '--seconds', SECONDS, '--inproc', '--log', self.folder / 'x.log')['hash']
        self.assertGreater(self.race('WORLD', world, physics, reference), 0)

    def test_of_modules(self):
        def actuator(m):
            m.joints[0].target_si += 0.25

        def transform(m):
            m.role = 0 if m.role < 0 else -1

        def status(m):
            m.role_name = 'Forged'
        for topic, alter in {'ACTUATOR': actuator, 'TRANSFORM': transform, 'STATUS': status}.items():
            with self.subTest(topic):
                self.assertGreater(self.race(topic, alter), 0)

    def test_a_second_claimant_before_the_run_has_begun_ends_it_by_name(self):
        def act(forger, hello):
            hello.claim += 1
            forger.say('live/HELLO', encode(hello))
        self.attacked(Attack('live/HELLO', act, tick=0))
        # It may be too late already, and then it is turned away.
        if self.status != 0:
            self.assertIn('claims to be', self.summary['error'])

    def test_outside_the_hash(self):
        def hello(m):
            m.claim += 1

        def health(m):
            m.conflicts += 1

        def info(m):
            m.total_bytes += 1
        for topic, alter in {'HELLO': hello, 'HEALTH': health, 'INFO': info}.items():
            with self.subTest(topic):
                self.race(topic, alter)
                self.assert_unharmed()


if __name__ == '__main__':
    unittest.main()
