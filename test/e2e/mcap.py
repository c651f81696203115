#!/usr/bin/env python3
"""MCAP files as other people read them: @mcap/core with every CRC validated, and protobufjs by the schemas in them."""
import collections
import hashlib
import json
import math
import random
import shutil
import subprocess
import sys
import unittest

from support import MODEL, PROGRAM, SCRATCH, SOURCE, Case, as_json, decode, lcm_types, morphbus, read_events, write_events

PACKAGES = SOURCE / 'test' / 'e2e' / 'mcap'


def reader_folder():
    """The reader with its packages as the lock file pins them, made once a build."""
    stamp = hashlib.sha256(b''.join(p.read_bytes() for p in sorted(PACKAGES.iterdir()))).hexdigest()
    folder = SCRATCH / 'mcap_reader'
    if not (folder / stamp).exists():
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(PACKAGES, folder)
        subprocess.run(['npm', 'ci', '--ignore-scripts', '--no-audit', '--no-fund'], cwd=folder, check=True,
                       stdout=sys.stderr)
        (folder / stamp).touch()
    return folder


def read_mcap(path):
    """Its messages, and the line about its index."""
    done = subprocess.run(['node', reader_folder() / 'read.mjs', path], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise AssertionError(done.stderr)
    lines = [json.loads(line) for line in done.stdout.splitlines() if line]
    return lines[:-1], lines[-1]


class Mcap(Case):
    def setUp(self):
        super().setUp()
        self.log = self.folder / 'short.log'
        morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 2, '--inproc', '--run', 'short',
                 '--log', self.log)

    def same(self, value, read, where):
        """Whether a field is read as the value that LCM's own types give."""
        if isinstance(value, bool):
            self.assertEqual(read, value, where)
        elif isinstance(value, float):
            read = float(read)
            self.assertEqual((read, math.copysign(1, read)), (value, math.copysign(1, value)), where)
        elif isinstance(value, int):
            self.assertEqual(int(read), value, where)
        elif isinstance(value, str):
            self.assertEqual(read, value, where)
        elif isinstance(value, (bytes, bytearray)):
            self.assertEqual(read, value.hex(), where)
        elif isinstance(value, (list, tuple)):
            self.assertEqual(len(read), len(value), where)
            for v, r in zip(value, read):
                self.same(v, r, where)
        else:
            for name in value.__slots__:
                self.same(getattr(value, name), read[name], f'{where}.{name}')

    def test_every_message_is_read_with_its_number_times_type_and_fields(self):
        morphbus('convert', self.log, '--to', 'mcap', '-o', self.folder / 'short.mcap')
        messages, index = read_mcap(self.folder / 'short.mcap')
        events = read_events(self.log)
        ours = [m for m in messages if not m['topic'].startswith('/')]
        self.assertEqual(len(ours), len(events))
        for read, (number, stamp, channel, data) in zip(ours, events):
            message = decode(data)
            self.assertEqual((read['topic'], read['sequence']), (channel, number))
            self.assertEqual(int(read['logTime']), stamp * 1000)
            self.assertEqual(int(read['publishTime']), message.header.sim_time_us * 1000)
            self.assertEqual((read['schema'], read['encoding']), (f'morphbus.{type(message).__name__}', 'protobuf'))
            self.same(message, read['message'], channel)

        counts = collections.Counter(channel for _, _, channel, _ in events)
        for told in (index['statistics']['channelMessageCounts'], index['indexed'], index['streamed']):
            self.assertEqual({topic: int(n) for topic, n in told.items() if not topic.startswith('/')}, counts)
        self.assertEqual(int(index['statistics']['messageCount']), len(messages))
        self.assertEqual(int(index['statistics']['chunkCount']), index['chunks'])
        self.assertGreater(index['chunks'], 0)
        self.assertEqual(index['offsets'], 4)

    def test_the_topics_for_viewers_hold_the_transforms_of_the_log(self):
        morphbus('convert', self.log, '--to', 'mcap', '-o', self.folder / 'short.mcap')
        messages, _ = read_mcap(self.folder / 'short.mcap')
        by_topic = collections.defaultdict(list)
        for message in messages:
            by_topic[message['topic']].append(message)
        self.assertEqual(len(by_topic['/short/scene']), 1)
        self.assertEqual(by_topic['/short/scene'][0]['schema'], 'foxglove.SceneUpdate')
        events = read_events(self.log)
        numbers = {number: stamp for number, stamp, _, _ in events}
        ids, expected = {}, {}
        for _, _, channel, data in events:
            if channel.endswith('/SIM/SENSORS'):
                ids.update((m.module_id, m.name) for m in decode(data).modules)
            if channel.endswith('/SIM/WORLD'):
                for body in decode(data).bodies:
                    link = ('active_block', 'passive_block', 'connecting_bar')[body.link]
                    expected[(decode(data).header.sim_time_us * 1000, body.module_id, link)] = body
        seen = 0
        for message in by_topic['/short/tf']:
            self.assertEqual(int(message['logTime']), numbers[message['sequence']] * 1000)
            for transform in message['message']['transforms']:
                for (time, module, link), body in expected.items():
                    if time == int(message['publishTime']) and transform['child_frame_id'] == f'short/{ids[module]}/{link}':
                        p, q = transform['translation'], transform['rotation']
                        self.assertEqual([p['x'], p['y'], p['z'], q['w'], q['x'], q['y'], q['z']],
                                         [*body.position_m, *body.orientation_wxyz])
                        seen += 1
        self.assertEqual(seen, len(expected))
        morphbus('convert', self.log, '--to', 'mcap', '-o', self.folder / 'tf.mcap', '--channel', '/short/tf')
        self.assertEqual({m['topic'] for m in read_mcap(self.folder / 'tf.mcap')[0]}, {'/short/tf'})

    def test_what_a_program_prints_is_told_to_viewers_in_the_words_of_info(self):
        program = self.folder / 'counts.dyn'
        program.write_text('role Any extends Module {\n  startup s() {\n    print("has", self.connected, "neighbours");\n'
                           '  }\n}\n')
        log = self.folder / 'counts.log'
        morphbus('run', MODEL, program, '--robot', 'quadruped', '--seconds', 1, '--still', '--inproc', '--run', 'counts',
                 '--log', log)
        morphbus('convert', log, '--to', 'mcap', '-o', self.folder / 'counts.mcap')
        messages, _ = read_mcap(self.folder / 'counts.mcap')
        told = [m for m in messages if m['topic'] == '/counts/prints']
        said = as_json('info', log)['prints']
        self.assertEqual([(int(m['publishTime']) / 1e9, m['message']['module'], m['message']['text'], m['message']['line'])
                          for m in told], [(p['time'], p['module'], p['text'], p['line']) for p in said])
        self.assertEqual(len(told), 9)
        lines = [m['message']['message'] for m in messages if m['topic'] == '/counts/log']
        self.assertEqual([line for line in lines if line.startswith('has')], [p['text'] for p in said])

    def test_a_recording_in_any_order_tells_viewers_the_same(self):
        # As another logger has it where messages are lost on the way and sent again.
        order = random.Random(3)
        events = [event for event in read_events(self.log) if not event[2].endswith(('/HEALTH', '/END'))]
        late = sorted(events, key=lambda event: event[0] + 40 * order.random())
        told = []
        for name, these in (('straight', events), ('late', late)):
            write_events(self.folder / f'{name}.log', [(i, *event[1:]) for i, event in enumerate(these)])
            morphbus('convert', self.folder / f'{name}.log', '--to', 'mcap', '-o', self.folder / f'{name}.mcap')
            messages, _ = read_mcap(self.folder / f'{name}.mcap')
            told.append([(m['topic'], m['publishTime'], m['message']) for m in messages if m['topic'].startswith('/')])
        self.assertGreater(len(told[0]), 500)
        self.assertEqual(*told)

    def test_a_wrong_byte_of_a_chunk_is_noticed_by_the_reader(self):
        path = self.folder / 'short.mcap'
        morphbus('convert', self.log, '--to', 'mcap', '-o', path)
        data = bytearray(path.read_bytes())
        data[len(data) // 3] ^= 1
        path.write_bytes(data)
        with self.assertRaises(AssertionError):
            read_mcap(path)

    def test_foreign_messages_keep_their_bytes(self):
        log = self.folder / 'mixed.log'
        events = read_events(self.log)[:100]
        events[50] = (50, events[50][1], 'FOREIGN', b'\x01\x02\x03')
        write_events(log, events)
        morphbus('convert', log, '--to', 'mcap', '-o', self.folder / 'mixed.mcap')
        messages, _ = read_mcap(self.folder / 'mixed.mcap')
        foreign = [m for m in messages if m['topic'] == 'FOREIGN']
        self.assertEqual([(m['bytes'], m['encoding'], m['schema'], m['sequence']) for m in foreign],
                         [('010203', 'lcm', None, 50)])


if __name__ == '__main__':
    if shutil.which('node') is None or shutil.which('npm') is None:
        print('SKIPPED: Node is not installed (tools/setup installs it), so nobody can read the MCAP files', file=sys.stderr)
        sys.exit(77)
    lcm_types()
    unittest.main()
