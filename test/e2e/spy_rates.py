#!/usr/bin/env python3
"""What `morphbus spy` tells of rates, jitter, losses and foreign types. Run inside a private network."""
import json
import math
import struct
import subprocess
import sys
import unittest

from interop import send
from support import BIN, Case, command

RATES = (1, 10, 50, 100, 1000)
SECONDS = 12


def percentile(values, share):
    """The smallest value that a share of them does not exceed (nearest rank)."""
    return sorted(values)[max(0, math.ceil(share * len(values)) - 1)]


class Spy(Case):
    def listen(self, *options):
        """A spy whose objects can be read line by line; it hears the bus when this returns."""
        spy = subprocess.Popen(command('spy', '--json', '--interval', 0.5, *options), stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True)

        def end():
            spy.kill()
            spy.communicate()
        self.addCleanup(end)
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
    def test_rates_and_jitter_are_those_of_the_sender(self):
        spy = self.listen()
        record = self.folder / 'record'
        generator = subprocess.Popen([str(BIN / 'bus_generator'), '--seconds', str(SECONDS), str(record),
                                      *map(str, RATES)])
        # Rates are looked at while they are sent: at the last look before the end.
        names = [f'GEN_{hz}' for hz in RATES]
        rates, done = {}, False
        while not done:
            channels, seen = self.look(spy)
            done = all(channels.get(f'GEN_{hz}', {}).get('messages') == SECONDS * hz + 1 for hz in RATES)
            for name in names:
                if channels.get(name, {}).get('hz', 0) > 0:
                    rates[name] = channels[name]['hz']
        self.assertEqual(generator.wait(), 0)
        self.assertEqual(seen['listener']['missing'], 0)
        sent = {name: [] for name in names}
        for line in record.read_text().splitlines():
            name, ns = line.split()
            sent[name].append(int(ns))
        for hz, name in zip(RATES, names):
            times = sent[name]
            intervals = [(b - a) * 1e-9 for a, b in zip(times, times[1:])]
            true_hz = len(intervals) / sum(intervals)
            self.assertLess(abs(rates[name] / true_hz - 1), 0.02, f'{name}: {rates[name]} Hz heard, {true_hz} sent')
            # The spy keeps the last 1024 intervals.
            last = intervals[-1024:]
            period = percentile(last, 0.5)
            jitter = percentile([abs(i - period) for i in last], 0.5)
            heard = channels[name]['jitter']
            self.assertEqual(heard['intervals'], len(last))
            limit = max(20e-6, 0.02 / hz)
            self.assertLess(abs(heard['p50_s'] - jitter), limit,
                            f'{name}: p50 {heard["p50_s"] * 1e6:.1f} us heard, {jitter * 1e6:.1f} us sent')
            print(f'{name}: {rates[name]:.3f} Hz heard, {true_hz:.3f} sent; p50 {heard["p50_s"] * 1e6:.1f} us heard, '
                  f'{jitter * 1e6:.1f} sent; p99 {heard["p99_s"] * 1e6:.1f} us heard')


class Foreign(Spy):
    def test_messages_of_many_datagrams_are_heard(self):
        spy = self.listen()
        subprocess.run([str(BIN / 'bus_generator'), '--seconds', '1', '--size', '300000', str(self.folder / 'r'), '20'],
                       check=True)
        channels, seen = self.look_until(spy, lambda c: c.get('GEN_20', {}).get('messages') == 21)
        self.assertEqual(channels['GEN_20']['undecodable'], 21)
        self.assertEqual(seen['listener']['incomplete'], 0)
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
        for i in range(6000):
            send(f'FLOOD_{i}', b'x')
        _, seen = self.look_until(spy, lambda c: len(c) == 4096)
        while seen['listener']['messages_beyond_table'] + seen['listener']['missing'] < 6000 - 4096:
            _, seen = self.look(spy)
        self.assertEqual(len(seen['channels']), 4096)


if __name__ == '__main__':
    unittest.main()
