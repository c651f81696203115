"""Somebody on the bus of a run who wants no good, and what becomes of the run."""
import copy
import json
import socket
import struct
import subprocess
import tempfile
import threading

from lcm_datagrams import GROUP, PORT, receiver, sender
from support import LIMIT, MODEL, PROGRAM, Case, as_json, command, decode, lcm_types

SECONDS = 3
RUN = (MODEL, PROGRAM, '--robot', 'quadruped', '--still', '--run', 'live')
SHORT, FRAGMENT = 0x4c433032, 0x4c433033
CLOCK, ACTUATOR = 'live/SIM/CLOCK', 'live/m2/ACTUATOR'


class Forger:
    """Hears everything on the bus and says what it likes, as LCM's own datagrams, written without LCM."""

    def __init__(self, on_message):
        self.on_message, self.stop, self.count = on_message, False, 0
        self.own = set()  # Its own messages come back to it.
        self.last = {}  # By channel what others said last.
        self.out = sender()
        self.socket = receiver(timeout=0.1)
        self.thread = threading.Thread(target=self.listen)
        self.thread.start()

    def listen(self):
        while not self.stop:
            self.hear()

    def hear(self):
        """One message of others, if there is one."""
        try:
            data = self.socket.recv(65536)
        except TimeoutError:
            return
        if data[:4] == b'LC02' and data[8:13] == b'live/':
            channel, payload = data[8:].split(b'\0', 1)
            if payload not in self.own:
                self.last[channel.decode()] = payload
                self.on_message(self, channel.decode(), payload)

    def close(self):
        self.stop = True
        self.thread.join()
        self.socket.close()
        self.out.close()

    def say(self, channel, data):
        self.count += 1
        if len(self.own) < 10000:
            self.own.add(data)
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


class Attacked(Case):
    """A run with somebody on its bus."""

    @classmethod
    def setUpClass(cls):
        with tempfile.TemporaryDirectory() as folder:
            cls.reference = as_json('run', *RUN, '--seconds', SECONDS, '--inproc', '--log', f'{folder}/x.log')['hash']

    def attacked(self, on_message, speed=2, options=(), reference=None, seconds=SECONDS, run=RUN):
        """A run with a forger on its bus: its summary, and what its log says of itself."""
        self.path = self.folder / 'live.log'
        forger = Forger(on_message)
        try:
            done = subprocess.run(command('run', *run, '--seconds', seconds, '--speed', speed, '--log', self.path,
                                          '--force', '--json', *options), capture_output=True, text=True, timeout=LIMIT)
        finally:
            forger.close()
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.summary = json.loads(done.stdout)
        self.facts = as_json('info', self.path)
        # In real time no two runs have the same hash.
        if '--realtime' not in options:
            self.assertEqual(self.summary['hash'], reference or self.reference, self.summary)
        self.assertTrue(self.facts['whole'], self.facts)

    def attacked_while_held(self, act):
        """As `attacked`, with `act(forger, message)` for an ACTUATOR of tick 20, at which the run is held until the forger has
        spoken: however late he is, all is heard by a run that goes on."""
        held, through = self.folder / 'held', self.folder / 'through'
        held.write_text('20 pause\n')
        through.write_text('20 pause\n21 resume\n')
        reference = as_json('run', *RUN, '--seconds', SECONDS, '--inproc', '--log', self.folder / 'through.log',
                            '--commands', through)['hash']
        resumed = []

        def act_and_resume(forger, message):
            act(forger, message)
            resumed.append(subprocess.Popen(command('control', 'resume', '--run', 'live')))
        attack = Attack(ACTUATOR, act_and_resume)
        self.attacked(attack, options=('--commands', held), reference=reference)
        self.assertEqual(attack.done, 1)
        self.assertEqual(resumed[0].wait(timeout=LIMIT), 0)
        self.assert_unharmed()

    def counted(self, what):
        return sum(process[what] for process in self.summary['processes'].values())

    def assert_unharmed(self):
        self.assertEqual((self.summary['error'], self.facts['clean']), (None, True), self.facts['reason'])

    def assert_noticed(self):
        """Some process has refused something as not authentic, and names it."""
        self.assertGreater(self.counted('unauthentic'), 0)
        self.assertTrue(any(': not authentic' in p['first_refused'] for p in self.summary['processes'].values()))

    def assert_named(self, process, what):
        """The first message that the process refused is named."""
        self.assertIn(what, self.summary['processes'][process]['first_refused'])

    def made_up(self, kind, like, **fields):
        """A message of this type, of the tick of `like`."""
        message = lcm_types()[kind]()
        message.header = copy.deepcopy(like.header)
        message.header.program_hash = 0
        for name, value in fields.items():
            setattr(message, name, value)
        return message
