#!/usr/bin/env python3
"""Whoever is on the bus of a run without its key, and old commands on it again, change nothing and are counted."""
import socket
import struct
import time
import unittest

from control_live import Live, written_so_far
from support import as_json, await_condition, command, decode, encode, lcm_types, morphbus, read_events, seal, with_crc


class Bus:
    """LCM's own datagrams, written without LCM."""

    def __init__(self, test):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        test.addCleanup(self.socket.close)
        self.socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        self.count = 0

    def publish(self, channel, data):
        self.count += 1
        self.socket.sendto(struct.pack('>II', 0x4c433032, self.count) + channel.encode() + b'\0' + data,
                           ('239.255.76.67', 7667))


class Forgers(Live):
    """Whoever is on the bus without the key, and old commands on it again, change nothing and are counted."""

    def message(self, kind, counter, **fields):
        """A command, without the key, as whoever has the types of lcmtypes/ makes it."""
        control = lcm_types()['control_t']()
        control.header = lcm_types()['header_t']()
        control.header.protocol, control.header.model_hash = self.pattern.protocol, self.pattern.model_hash
        control.counter, control.kind = counter, getattr(control, f'KIND_{kind}')
        for name, value in fields.items():
            self.assertTrue(hasattr(control, name), name)
            setattr(control, name, value)
        return encode(control)

    def logged(self, channel):
        return [event for event in written_so_far(self.folder / 'live.log.partial') if event[2] == channel]

    def await_counts(self, **least):
        """Until the sim has told what it refused: the run may be over before its last HEALTH is heard."""
        def told():
            health = [decode(data) for *_, data in self.logged('live/SIM/HEALTH')]
            return health and all(getattr(health[-1], name) >= count for name, count in least.items())
        await_condition(told, f'HEALTH says {least}')

    def test_forged_old_and_malformed_commands(self):
        if not self.in_private_network():
            return
        self.start(isolate=False)
        self.control('pause')
        path = self.folder / 'runtime' / 'morphbus' / 'live' / 'key'
        self.assertEqual((path.stat().st_mode & 0o777, path.stat().st_size), (0o600, 16))
        key = path.read_bytes()
        events = await_condition(lambda: self.logged('live/CONTROL'), 'commands are logged')
        self.pattern = decode(events[0][3]).header
        # What the key makes of a message is what its definition says.
        for *_, data in events:
            self.assertEqual(seal('live/CONTROL', data, key), data)
        bus = Bus(self)
        now = time.monotonic_ns() // 1000
        # Without the key, or with another one; once more; altered; on another channel; and no message at all.
        for i in range(100):
            bus.publish('live/CONTROL', self.message('STOP', now + i))
            bus.publish('live/CONTROL', seal('live/CONTROL', self.message('STOP', now + i), bytes(16)))
            bus.publish('live/CONTROL', events[0][3])
            bus.publish('live/CONTROL', b'\x93' * 40)
        altered = bytearray(events[0][3])
        altered[-3] ^= 1
        bus.publish('live/CONTROL', with_crc(bytes(altered)))
        bus.publish('live/CONTROL', seal('live/HELLO', self.message('STOP', now), key))
        bus.publish('live/CONTROL', seal('live/CONTROL', self.message('STEP', time.monotonic_ns() // 1000, num_steps=-5), key))
        self.await_counts(unauthentic=302, old_commands=100, malformed_commands=1)
        # After all that the run takes the commands of its owner, as if nothing had been.
        self.control('step')
        self.control('resume')
        self.control('stop')
        self.end()
        health = as_json('info', self.path)['health']['SIM']
        self.assertEqual(health['unauthentic'], 302)
        self.assertGreaterEqual(health['old_commands'], 100)
        self.assertEqual(health['malformed_commands'], 1)
        said = morphbus('info', self.path).stdout
        self.assertIn('not authentic (302 on CONTROL)', said)
        self.assertIn('first: CONTROL: not authentic', said)
        self.assertRegex(said, r'refused commands: \d+ old, 1 malformed')
        self.assertEqual([c for _, c in self.commands() if c.startswith('stop')], ['stop'])
        self.assertEqual(self.summary['ended'], 'stopped by command')
        self.assert_repeats()

    def test_an_open_run_obeys_and_answers_whoever_has_the_types(self):
        if not self.in_private_network():
            return
        self.start('--open', isolate=False)
        self.control('pause')
        self.pattern = decode(await_condition(lambda: self.logged('live/CONTROL'), 'commands are logged')[0][3]).header
        bus = Bus(self)

        def give(kind, **fields):
            counter = time.monotonic_ns() // 1000
            bus.publish('live/CONTROL', self.message(kind, counter, **fields))
            answer = await_condition(lambda: [a for *_, data in self.logged('live/SIM/ANSWER')
                                              for a in [decode(data)] if a.counter == counter], f'{kind} is answered')[0]
            return answer, (answer.status, answer.reason)
        push = {'module_name': 'm5', 'direction': (0, 0, 1), 'force_n': 2.5}
        pushed, _ = give('PUSH', **push)
        self.assertEqual((pushed.state, pushed.command, pushed.has_time), (pushed.STATE_LATER, 'push m5 EAST 2.5', False))
        self.assertEqual(give('PUSH', **{**push, 'module_name': 'm55'})[1], (2, "the robot has no module 'm55' (did you mean 'm5'?)"))
        self.assertEqual(give('PUSH', **{**push, 'direction': (0, 0, 0)})[1], (2, 'direction: it has no length'))
        self.assertEqual(give('PAUSE')[1], (1, f'the run is paused already, at tick {pushed.tick - 1}'))
        done, _ = give('STEP', num_steps=3)
        self.assertEqual((done.state, done.tick), (done.STATE_DONE, pushed.tick))
        self.await_held(pushed.tick + 2)
        give('RESUME')
        # The log has another name once the run has ended, so that its last answer is not awaited there.
        bus.publish('live/CONTROL', self.message('STOP', time.monotonic_ns() // 1000))
        self.end()
        self.assertEqual([c for c in self.commands() if c[0] >= pushed.tick][:2],
                         [(pushed.tick, 'step 3'), (pushed.tick, 'push m5 EAST 2.5')])
        self.assert_repeats()

    def test_a_replayed_log_of_the_same_name_commands_nothing(self):
        self.start()
        self.control('pause')
        self.control('resume')
        self.control('stop')
        self.end()
        old = read_events(self.path)
        controls = [data for _, _, channel, data in old if channel == 'live/CONTROL']
        self.assertGreater(len(controls), 3)
        if not self.in_private_network():
            return
        self.start(isolate=False)
        self.control('pause')
        bus = Bus(self)
        for data in controls:
            bus.publish('live/CONTROL', data)
        self.await_counts(unauthentic=len(controls))
        self.control('resume')
        self.control('stop')
        self.end()
        self.assertEqual(as_json('info', self.path)['health']['SIM']['unauthentic'], len(controls))


if __name__ == '__main__':
    unittest.main()
