#!/usr/bin/env python3
"""LCM's stock tools and ours on one bus. Run inside a private network (see isolated.cc)."""
import signal
import socket
import struct
import subprocess
import threading
import unittest

from control_live import written_so_far
from lcm_datagrams import GROUP, PORT, receiver, sender
from support import (HASHED, LIMIT, MODEL, PROGRAM, Case, as_json, await_condition, command, decode, morphbus, new_key,
                     read_events, seal)


class Listener:
    """A receiver of LCM datagrams that shares no code with LCM or with us."""

    def __init__(self):
        self.socket = receiver(timeout=0.2)
        self.messages = []
        self.stop = False
        self.thread = threading.Thread(target=self.listen)
        self.thread.start()

    def listen(self):
        """Until told to stop, and then until nothing is left in the socket."""
        while True:
            try:
                data = self.socket.recv(65536)
            except TimeoutError:
                if self.stop:
                    return
                continue
            if data[:4] == b'LC02':
                channel, payload = data[8:].split(b'\0', 1)
                self.messages.append((channel.decode(), payload))

    def close(self):
        self.stop = True
        self.thread.join()
        self.socket.close()
        return self.messages


def send(channel, payload):
    with sender() as out:
        out.sendto(b'LC02' + struct.pack('>I', 1) + channel.encode() + b'\0' + payload, (GROUP, PORT))


class Interop(Case):
    def record(self, *options, seconds=4):
        log = self.folder / 'ours.log'
        summary = as_json('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', seconds, '--log', log, *options)
        return log, summary

    def test_lcm_logplayer_replays_a_log_of_ours(self):
        log, _ = self.record()
        listener = Listener()
        subprocess.run(['lcm-logplayer', '--speed=2', str(log)], check=True, capture_output=True, timeout=LIMIT)
        heard = [m for m in listener.close() if m[0] != 'LCM_SELF_TEST']
        sent = [(channel, data) for _, _, channel, data in read_events(log)]
        # On a busy machine this listener's socket overflows; what came is the log's, in its order, and once.
        # test/logger/stock_tools_test.cc has a log that is heard message for message.
        self.assertGreater(len(heard), 0)
        rest = iter(sent)
        for message in heard:
            self.assertIn(message, rest)

    def test_lcm_logger_records_a_run_of_ours_that_anyone_can_decode(self):
        theirs = self.folder / 'theirs.log'
        stock = subprocess.Popen(['lcm-logger', '-f', '--flush-interval=20', str(theirs)], stdout=subprocess.DEVNULL,
                                 stderr=subprocess.DEVNULL)
        try:
            def recording():
                send('READY', b'x')
                return theirs.exists() and b'READY' in theirs.read_bytes()
            await_condition(recording, 'lcm-logger records')
            # The run goes on until lcm-logger has some of everything, however little of it that comes by.
            ours = self.folder / 'ours.log'
            run = subprocess.Popen(command('run', MODEL, PROGRAM, '--robot', 'quadruped', '--run', 'stock', '--speed', 1,
                                           '--log', ours), stdout=subprocess.DEVNULL)
            self.kill_at_the_end(run)

            def enough():
                channels = {c.split('/')[-1] for _, _, c, _ in written_so_far(theirs) if c.startswith('stock/')}
                return {'SENSORS', 'ACTUATOR', 'TRANSFORM'} <= channels
            await_condition(enough, 'lcm-logger has some of what comes in every tick', pause=0.5)
            run.send_signal(signal.SIGINT)
            # 1: when it is stopped so early, no module has a role yet.
            self.assertIn(run.wait(timeout=LIMIT), (0, 1))
        finally:
            stock.send_signal(signal.SIGINT)
            stock.wait(timeout=LIMIT)
        messages = [(c, d) for _, _, c, d in read_events(theirs) if c.startswith('stock/')]
        for _, data in messages:
            decode(data)  # every message, by lcm-gen's own types
        # It drops what its queue of 30 messages has no room for; what it has is what our own logger has.
        distinct = {m for m in messages if m[0].split('/')[-1] in HASHED}
        self.assertLessEqual(distinct, {(c, d) for _, _, c, d in read_events(ours)})
        # The description comes in parts, of which it may lack some.
        parts = {decode(d).part: decode(d) for c, d in messages if c.endswith('/INFO')}
        if parts and len(parts) == parts[min(parts)].num_parts:
            facts = as_json('info', theirs, '--run', 'stock')
            self.assertEqual(facts['description']['robot'], 'quadruped')

    def test_our_replay_is_heard_by_stock_tools(self):
        log, _ = self.record()
        listener = Listener()
        result = as_json('replay', log, '--speed', 0)
        heard = [m for m in listener.close() if m[0] != 'LCM_SELF_TEST']
        self.assertGreater(len(heard), 0)
        self.assertLessEqual(len(heard), result['published'])
        sent = {(c, d) for _, _, c, d in read_events(log)}
        self.assertTrue(set(heard) <= sent)
        for channel, _ in heard:
            self.assertIn(channel.split('/')[-1], HASHED | {'HEALTH', 'INFO'})

    def test_replay_selects_range_and_channels(self):
        log, _ = self.record()
        listener = Listener()
        morphbus('replay', log, '--speed', 0, '--from', 1, '--to', 2, '--channel', '.*/SIM/SENSORS')
        heard = [decode(d) for c, d in listener.close() if c.endswith('/SENSORS')]
        ticks = sorted({m.header.tick for m in heard})
        self.assertEqual((ticks[0], ticks[-1]), (50, 99))

    def test_a_run_has_the_key_that_it_is_given(self):
        key = new_key(self.folder)
        summaries = [as_json('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 1, '--inproc', '--no-log')]
        for options in (('--inproc',), ('--force',)):
            log, summary = self.record(*options, '--key', key, seconds=1)
            summaries.append(summary)
            # What travelled is sealed with this key; what only stands in the log is not.
            sealed = [(channel, data) for *_, channel, data in read_events(log) if decode(data).header.auth != 0]
            self.assertGreater(len(sealed), 100)
            for channel, data in sealed:
                self.assertEqual(seal(channel, data, key.read_bytes()), data, channel)
        self.assertEqual(len({summary['hash'] for summary in summaries}), 1, 'the key is outside the hash')
        run = ('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 1, '--inproc', '--no-log')
        self.assertIn('leave out --key', morphbus(*run, '--open', '--key', key, status=2).stderr)
        key.chmod(0o640)
        self.assertIn(f'{key} is not private to its owner: chmod 600 {key}', morphbus(*run, '--key', key, status=2).stderr)
        for listener in ('spy', 'monitor'):
            self.assertIn('is not private', morphbus(listener, '--once' if listener == 'spy' else '--json', '--key', key,
                                                     '--lcm-url', 'udpm://239.255.76.67:7667?ttl=0', status=2).stderr)

    def test_parts_started_by_hand_make_the_same_run(self):
        _, summary = self.record('--inproc', seconds=2)
        image, kinematics = self.folder / 'q.image', self.folder / 'mtran.kinematics'
        morphbus('compile', PROGRAM, '--model', MODEL, '-o', image)
        morphbus('export', MODEL, '--module', 'MTRAN', '--to', 'kinematics', '-o', kinematics)
        log = self.folder / 'hand.log'
        same = (MODEL, PROGRAM, '--robot', 'quadruped', '--run', 'hand', '--seconds', 2, '--open')
        parts = [subprocess.Popen(command('log', *same, '-o', log), stdout=subprocess.PIPE, text=True)]
        for i in range(9):
            options = ['--run', 'hand', '--module', f'm{i + 1}', '--id', i, '--kinematics', kinematics, '--program', image,
                       '--open']
            if i == 4:  # the frame of the robot sits one unit to +x of m5's own
                options += ['--root-link', 1, '--root-pose=-0.0325,0,0,1,0,0,0']
            parts.append(subprocess.Popen(command('module', *options)))
        done = morphbus('sim', *same)
        for part in parts:
            part.communicate(timeout=LIMIT)
            self.assertEqual(part.returncode, 0, part.args)
        self.assertIn(summary['hash'], done.stdout)
        morphbus('verify', log)
        # Nobody had a key, and the log says so.
        self.assertTrue(as_json('info', log)['description']['open'])
        self.assertIn('clean, of an open run', morphbus('info', log).stdout)
        self.assertEqual({decode(data).header.auth for *_, data in read_events(log)}, {0})


if __name__ == '__main__':
    unittest.main()
