#!/usr/bin/env python3
"""What `morphbus spy` tells of rates, jitter, losses and foreign types. Run inside a private network."""
import json
import struct
import subprocess
import sys
import unittest

from interop import send
from support import BIN, Case, command

RATES = (10, 100, 1000)
SECONDS = 2


class Spy(Case):
    def listen(self, *options):
        """A spy whose objects can be read line by line; it hears the bus when this returns."""
        spy = subprocess.Popen(command('spy', '--json', '--interval', 0.5, *options), stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True)
        self.kill_at_the_end(spy)
        self.assertTrue(spy.stdout.readline(), 'the spy has not begun')
        return spy

    def look(self, spy):
        """The next object: its channels by name, and the whole."""
        seen = json.loads(spy.stdout.readline())
        return {c['channel']: c for c in seen['channels']}, seen

    def look_until(self, spy, condition):
        """The first object whose channels fulfil the condition; the test's time limit is the only other way out."""
        while True:
            channels, seen = self.look(spy)
            if condition(channels):
                return channels, seen


class Rates(Spy):
    def test_what_is_sent_is_heard_counted_and_timed(self):
        """What rates and jitter come of which times is shown without a bus (test/tools/arrival_stats_test.cc)."""
        spy = self.listen()
        record = self.folder / 'record'
        subprocess.run([str(BIN / 'bus_generator'), '--seconds', str(SECONDS), str(record), *map(str, RATES)], check=True)
        sent = {f'GEN_{hz}': 0 for hz in RATES}
        for line in record.read_text().splitlines():
            sent[line.split()[0]] += 1
        self.assertEqual(sent, {f'GEN_{hz}': SECONDS * hz + 1 for hz in RATES})

        # A socket that overflows loses some, and the spy knows how many as soon as another one comes.
        probes = 0
        while True:
            send('PROBE', b'x')
            probes += 1
            channels, seen = self.look(spy)
            heard = sum(channels.get(name, {}).get('messages', 0) for name in (*sent, 'PROBE'))
            if heard + seen['listener']['missing'] >= sum(sent.values()) + probes:
                break
        self.assertEqual(heard + seen['listener']['missing'], sum(sent.values()) + probes)
        for name, count in sent.items():
            if name in channels:
                messages, jitter = channels[name]['messages'], channels[name]['jitter']
                self.assertLessEqual(messages, count)
                # The spy keeps the last 1024 intervals.
                self.assertEqual(jitter['intervals'] if jitter else 0, min(messages - 1, 1024), name)


class Foreign(Spy):
    def test_messages_of_many_datagrams_are_heard(self):
        spy = self.listen()
        # They go on until some have come whole, one shortly after another: a socket that overflows breaks them.
        generator = subprocess.Popen([str(BIN / 'bus_generator'), '--seconds', '3600', '--size', '300000',
                                      str(self.folder / 'r'), '20'])
        self.kill_at_the_end(generator)
        channels, _ = self.look_until(spy, lambda c: c.get('GEN_20', {}).get('hz', 0) > 0)
        self.assertEqual(channels['GEN_20']['undecodable'], channels['GEN_20']['messages'])
        self.assertAlmostEqual(channels['GEN_20']['bytes_per_s'] / channels['GEN_20']['hz'], 300000, delta=1)

    def test_foreign_types_are_decoded_by_their_files(self):
        types = self.folder / 'types'
        (types / 'deep').mkdir(parents=True)
        (types / 'example_t.lcm').write_text(
            'package exlcm;\n// LCM\'s own example.\nstruct example_t {\n  int64_t timestamp;\n  double position[3];\n'
            '  double orientation[4];\n  int32_t num_ranges;\n  int16_t ranges[num_ranges];\n  string name;\n'
            '  boolean enabled;\n}\n')
        (types / 'deep' / 'pair_t.lcm').write_text('package exlcm;\nstruct pair_t { example_t first; mode_t mode; }\n')
        (types / 'deep' / 'mode_t.lcm').write_text('package exlcm;\nenum mode_t { OFF = 1, ON = 2 }\n')
        example = struct.pack('>q3d4di2h', 7, 1, 2, 3, 1, 0, 0, 0, 2, -5, 6) + struct.pack('>i', 5) + b'left\0' + b'\1'
        fingerprint = bytes.fromhex('37553c5361f75516')
        # lcm-gen says what a message of the nested type begins with.
        subprocess.run(['lcm-gen', '-p', '--ppath', str(self.folder / 'py'), *map(str, types.rglob('*.lcm'))],
                       check=True, capture_output=True)
        nested = subprocess.run([sys.executable, '-c', 'import sys; from exlcm import pair_t; '
                                 'sys.stdout.write(pair_t._get_packed_fingerprint().hex())'],
                                cwd=self.folder / 'py', check=True, capture_output=True, text=True).stdout
        spy = self.listen('--types', types, '--channel', 'EXAMPLE|PAIR')
        send('EXAMPLE', fingerprint + example)
        send('PAIR', bytes.fromhex(nested) + example + struct.pack('>i', 2))
        send('STRANGE', b'\1\2\3\4\5\6\7\x08more')
        send('EXAMPLE', fingerprint + example + b'too long')
        send('EXAMPLE', fingerprint + example)
        channels, _ = self.look_until(
            spy, lambda c: c.get('EXAMPLE', {}).get('messages') == 3 and 'PAIR' in c and 'STRANGE' in c)
        self.assertEqual(channels['EXAMPLE']['type'], 'exlcm.example_t')
        self.assertEqual(channels['EXAMPLE']['last'],
                         {'timestamp': 7, 'position': [1, 2, 3], 'orientation': [1, 0, 0, 0], 'num_ranges': 2,
                          'ranges': [-5, 6], 'name': 'left', 'enabled': True})
        self.assertEqual((channels['EXAMPLE']['bad'], channels['EXAMPLE']['undecodable']), (1, 1))
        self.assertEqual(channels['PAIR']['type'], 'exlcm.pair_t')
        self.assertEqual(channels['PAIR']['last']['mode'], 'ON')
        self.assertIsNone(channels['STRANGE']['type'])
        self.assertEqual(channels['STRANGE']['fingerprint'], '0102030405060708')
        self.assertEqual(channels['STRANGE']['undecodable'], 1)

    def test_types_that_cannot_be_read_are_refused_with_file_and_line(self):
        bad = self.folder / 'bad.lcm'
        bad.write_text('package a;\nstruct b_t {\n  int8_t x\n}\n')
        for path, message in ((bad, f'{bad}: line 4: expected'), (self.folder / 'none', 'none'),
                              (self.folder / 'runtime', 'no .lcm file in it')):
            done = subprocess.run(command('spy', '--once', '--types', path), capture_output=True, text=True)
            self.assertEqual(done.returncode, 2)
            self.assertIn(message, done.stderr)

    def test_a_flood_of_invented_channels_is_counted_and_not_kept(self):
        spy = self.listen()
        # More and more of them, for of each lot a socket that overflows loses some.
        sent = beyond = 0
        while not beyond:
            for sent in range(sent, sent + 2000):
                send(f'FLOOD_{sent}', b'x')
            sent += 1
            channels, seen = self.look(spy)
            self.assertLessEqual(len(channels), 4096)
            beyond = seen['listener']['messages_beyond_table']
        self.assertEqual(len(channels), 4096)


if __name__ == '__main__':
    unittest.main()
