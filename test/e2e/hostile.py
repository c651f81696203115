#!/usr/bin/env python3
"""Somebody on the bus of a run who wants no good and has not its key, over real LCM: every attack is counted and named,
and the run is what it would have been without. Run inside a private network (see isolated.cc).
test/bridge/stranger_test.cc has such attacks without a network, message by message."""
import random
import signal
import subprocess
import unittest

from hostile_bus import ACTUATOR, CLOCK, RUN, SECONDS, Attack, Attacked, ahead
from support import LIMIT, MODEL, PROGRAM, as_json, command, decode, encode, end_of, morphbus, new_key, read_events


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
            self.attacked(Attack(CLOCK, act, tick=5))
            end_of(player[0])
            self.assert_unharmed()
            self.assert_noticed()

    def path_of_same(self):
        """The log of an earlier run of the same robot, program and name."""
        path = self.folder / 'same.log'
        morphbus('run', *RUN, '--seconds', SECONDS, '--inproc', '--log', path)
        return path

    def test_a_second_sim_of_the_same_name_ended_by_a_signal(self):
        # Whoever starts one has not the key of this run.
        second, key = [], new_key(self.folder)

        def act(forger, _):
            second.append(subprocess.Popen(command('sim', *RUN, '--seconds', SECONDS, '--key', key), stdout=subprocess.DEVNULL,
                                           stderr=subprocess.DEVNULL))

        def on_message(forger, channel, data):
            attack(forger, channel, data)
            # Once it has spoken of tick 0 it is ended.
            if second and channel == CLOCK and decode(data).header.tick == 0 and second[0].poll() is None:
                second[0].send_signal(signal.SIGINT)
        attack = Attack(CLOCK, act, tick=2)
        self.attacked(on_message, speed=0.5)
        second[0].wait(timeout=LIMIT)
        self.assert_unharmed()
        self.assert_noticed()

    def test_a_health_with_a_bad_body_is_not_in_the_log(self):
        def act(forger, message):
            for _ in range(10):
                forger.say('live/m2/HEALTH', encode(message))
        self.attacked_while_held(act)
        self.assertEqual(self.summary['processes']['LOG']['unauthentic'], 10)
        self.assert_named('LOG', '/HEALTH: not authentic')

    def test_what_the_run_said_is_taken_once_however_often_it_is_said_again(self):
        def act(forger, _):
            # HEALTH comes once a second, and while the run is held the sim says that it lives.
            while not {'live/m2/HEALTH', 'live/SIM/PROGRESS'} <= set(forger.last) and not forger.stop:
                forger.hear()
            said = sorted(forger.last.items())
            for _ in range(100):
                for channel, data in said:
                    forger.say(channel, data)
        self.attacked_while_held(act)
        events = [(channel, data) for _, _, channel, data in read_events(self.path)]
        self.assertEqual(len(events), len(set(events)))
        # What found the logger's socket full was never heard.
        health = [decode(data) for channel, data in events if channel == 'live/LOG/HEALTH']
        self.assertGreater(health[-1].duplicates, 100)
        self.assertEqual(self.counted('unauthentic'), 0)

    def test_invented_channels_cost_a_count(self):
        def act(forger, message):
            data = encode(message)
            for i in range(40000):
                forger.say(f'live/x{i}/ACTUATOR', data)
        self.attacked_while_held(act)
        log = self.summary['processes']['LOG']
        # What found the logger's socket full was never seen.
        self.assertGreater(log['unauthentic'], 0)
        self.assertLessEqual(log['unauthentic'], 40000)
        self.assert_named('LOG', '/ACTUATOR: not authentic')
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
        self.assertGreaterEqual(topics, {'CLOCK', 'SENSORS', 'TRANSFORM', 'ACTUATOR', 'STATUS', 'PROGRESS', 'HEALTH', 'HELLO'})
        # What found a socket full was never seen; each message of garbage that was comes to the logger.
        self.assertGreater(self.summary['processes']['LOG']['unauthentic'], 0)


class AsInVirtualTime(Attacked):
    """What stranger_test.cc and forger_test.cc have message by message and in virtual time."""

    def test_a_command_from_the_future_is_neither_obeyed_nor_logged(self):
        def act(forger, message):
            for ticks in (1, 20, 60, 100):
                forged = ahead(message, ticks)
                forged.joints[0].target_si += 0.25
                forger.say(ACTUATOR, encode(forged))
        self.attacked_while_held(act)
        self.assertEqual(self.summary['processes']['SIM']['unauthentic'], 4)
        self.assert_named('SIM', 'm2/ACTUATOR: not authentic')
        self.assertIn('not authentic (4 on m2/ACTUATOR)', morphbus('info', self.path, '--all').stdout)

    def test_a_flood_of_requests_multiplies_nothing(self):
        def flood(forger, command):
            ask = encode(self.made_up('resend_t', command, sender='LOG', channel=ACTUATOR, last_sequence=1 << 62))
            for _ in range(200):
                forger.say('live/m2/RESEND', ask)
        self.attacked(Attack(ACTUATOR, flood, times=10))
        self.assert_unharmed()
        self.assertLess(self.summary['processes']['m2']['resent'], 200)

    def test_what_the_parties_tell_each_other_made_up_a_hundred_times_changes_nothing(self):
        # On each channel what might be believed there, in the name of who might say it.
        kinds = {'m2/RESEND': ('resend_t', {'sender': 'SIM', 'channel': ACTUATOR}),
                 'LOG/RESEND': ('resend_t', {'sender': 'TOOL', 'channel': 'live/INFO'}),
                 'LOG/PROGRESS': ('progress_t', {'complete_tick': 100, 'verdict_heard': True}),
                 'TOTALS': ('totals_t', {'process': 'm2', 'num_parts': 1}),
                 'SIM/VERDICT': ('verdict_t', {}),
                 'SIM/LEAVE': ('leave_t', {}),
                 'SIM/ANSWER': ('control_answer_t', {}),
                 'SIM/ADMIT': ('admit_t', {'module_name': 'm2'})}
        said = dict.fromkeys(kinds, 0)

        def act(forger, command):
            for channel, (kind, fields) in kinds.items():
                if said[channel] < 100:
                    said[channel] += 1
                    forger.say(f'live/{channel}', encode(self.made_up(kind, command, **fields)))
        self.attacked(Attack(ACTUATOR, act, tick=5, times=1000))
        self.assert_unharmed()
        self.assertEqual(set(said.values()), {100})
        for process in ('m2', 'SIM', 'LOG'):
            self.assertGreater(self.summary['processes'][process]['unauthentic'], 90, process)
            self.assert_named(process, ': not authentic')


class Races(Attacked):
    """Every message that a run has is raced a hundred times by an altered copy, before the original or after it."""

    def race(self, topic, alter, run=RUN, reference=None, realtime=False):
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
        if realtime:
            self.attacked(on_message, run=run, options=('--realtime',), speed=1)
        else:
            self.attacked(on_message, run=run, reference=reference)
        self.assertEqual(len(done), 100, topic)
        self.assert_unharmed()
        self.assert_noticed()

    @staticmethod
    def sensors(m):
        m.modules[0].joint_position_si = [p + 0.1 for p in m.modules[0].joint_position_si]

    @staticmethod
    def clock(m):
        m.num_controls, m.controls = 1, ['lose m2']

    @staticmethod
    def end(m):
        m.phase, m.end_reason = 2, 'forged'

    @staticmethod
    def actuator(m):
        m.joints[0].target_si += 0.25

    @staticmethod
    def transform(m):
        m.role = 0 if m.role < 0 else -1

    @staticmethod
    def status(m):
        m.role_name = 'Forged'

    def test_of_sim_and_modules(self):
        for topic, alter in (('SENSORS', self.sensors), ('CLOCK', self.clock), ('CLOCK', self.end),
                             ('ACTUATOR', self.actuator), ('TRANSFORM', self.transform), ('STATUS', self.status)):
            with self.subTest(topic, alter=alter.__name__):
                self.race(topic, alter)

    def test_in_real_time(self):
        for topic, alter in {'SENSORS': self.sensors, 'ACTUATOR': self.actuator, 'TRANSFORM': self.transform,
                             'STATUS': self.status}.items():
            with self.subTest(topic):
                self.race(topic, alter, realtime=True)

    def test_of_the_world(self):
        def world(m):
            m.num_bodies, m.bodies = 0, []
        physics = tuple(argument for argument in RUN if argument != '--still')
        reference = as_json('run', *physics, '--seconds', SECONDS, '--inproc', '--log', self.folder / 'x.log')['hash']
        self.race('WORLD', world, physics, reference)

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

    def test_a_second_claimant_before_the_run_has_begun(self):
        def act(forger, hello):
            hello.claim += 1
            forger.say('live/HELLO', encode(hello))
        self.attacked(Attack('live/HELLO', act, tick=0, times=20))
        self.assert_unharmed()


if __name__ == '__main__':
    unittest.main()
