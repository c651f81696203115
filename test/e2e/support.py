"""What the end-to-end tests share: running the program, reading and altering logs without its help.

Everything here is the Python standard library and lcm-gen's own Python types, so that it is independent
of the code under test. ctest sets MORPHBUS_BIN (the folder of the programs), MORPHBUS_SOURCE and
MORPHBUS_SCRATCH (a folder of this build for logs that several tests share).
"""
import contextlib
import faulthandler
import importlib
import io
import json
import mmap
import os
import pathlib
import re
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest
import zlib

BIN = pathlib.Path(os.environ['MORPHBUS_BIN'])
SOURCE = pathlib.Path(os.environ['MORPHBUS_SOURCE'])
SCRATCH = pathlib.Path(os.environ['MORPHBUS_SCRATCH'])
MODEL = SOURCE / 'models' / 'mtran.m3l'
PROGRAM = SOURCE / 'models' / 'programs' / 'quadruped.dyn'
ROBOTS = ('quadruped', 'equivalent_quadruped')
UNIT = 0.0325
WALK_SECONDS = 38.5  # standing up and five gait cycles of 7.02 s

# After so long (s) what a test waits for does not come any more: a limit for what hangs, on the slowest machine, and never an
# expectation. Of ctest a test has twice as long.
LIMIT = float(os.environ.get('MORPHBUS_TEST_LIMIT', 900))
# Where a test hangs that waits without a limit is told before ctest ends it. Those that take longer on purpose go on.
faulthandler.dump_traceback_later(1.9 * LIMIT)
# Topics that count for the run's hash.
HASHED = {'CLOCK', 'SENSORS', 'WORLD', 'TRANSFORM', 'ACTUATOR', 'STATUS'}

EVENT = struct.Struct('>IqqII')
EVENT_MAGIC = 0xEDA1DA01


def command(*arguments):
    return [str(BIN / 'morphbus'), *map(str, arguments)]


def morphbus(*arguments, status=0, **options):
    """Runs one command, and fails unless it ends with `status`; None: with whatever status."""
    options.setdefault('timeout', LIMIT)
    done = subprocess.run(command(*arguments), capture_output=True, text=True, **options)
    if status is not None and done.returncode != status:
        raise AssertionError(f'{" ".join(command(*arguments))}\nstatus {done.returncode}, expected {status}\n'
                             f'{done.stdout}\n{done.stderr}')
    return done


def as_json(*arguments, **options):
    return json.loads(morphbus(*arguments, '--json', **options).stdout)


def await_condition(condition, what, seconds=LIMIT, pause=0.02):
    """Waits until `condition()` holds, and asks again after a pause (s); the time is a limit, never an expectation."""
    limit = time.monotonic() + seconds
    while time.monotonic() < limit:
        value = condition()
        if value:
            return value
        time.sleep(pause)
    raise AssertionError(f'{what}: not within {seconds} s')


# All that this test starts inherits it.
os.environ['MORPHBUS_TEST'] = str(os.getpid())
OURS = f'MORPHBUS_TEST={os.getpid()}'.encode()


def started_here():
    """What this test has started, and what that has started, as far as it lives: {pid: command line}."""
    found = {}
    for folder in pathlib.Path('/proc').glob('[0-9]*'):
        try:
            text = (folder / 'cmdline').read_bytes().decode(errors='replace').replace('\0', ' ')
            ours = OURS in (folder / 'environ').read_bytes().split(b'\0')
            alive = (folder / 'stat').read_text().rsplit(')', 1)[1].split()[0] != 'Z'
        except OSError:
            continue
        if ours and alive and int(folder.name) != os.getpid():
            found[int(folder.name)] = text
    return found


def processes_of(run):
    """Processes of this test that name this run on their command line or in their files: {pid: command line}. Other
    tests, which run at the same time, have runs of the same name."""
    return {pid: text for pid, text in started_here().items() if 'morphbus' in text and run in text and 'python' not in text}


def describe_process(pid):
    """What a process does or waits for, as far as the kernel tells this user."""
    told = []
    for name in ('status', 'wchan', 'syscall', 'stack'):
        with contextlib.suppress(OSError):
            text = (pathlib.Path('/proc') / str(pid) / name).read_text()
            lines = [line for line in text.splitlines() if name != 'status' or re.match('State|PPid|Sig|Shd', line)]
            told.append(f'  {name}: ' + '\n    '.join(lines))
    return '\n'.join(told)


def end_of(process, limit=LIMIT / 2):
    """Kills a process and waits until nobody has its output open: what it started has ended then, too. Whoever lives on after
    the limit (s) is named, with what it does, and killed."""
    process.kill()
    try:
        process.communicate(timeout=limit)
    except subprocess.TimeoutExpired:
        left = {pid: f'{pid} {text}\n{describe_process(pid)}' for pid, text in started_here().items()}
        for pid in left:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        # Should a stranger hold it, the test says what it knows before ctest ends it.
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.communicate(timeout=LIMIT / 10)
        raise AssertionError(f'{process.args} was killed, and {limit} s later its output is still open. Who lives on:\n' +
                             '\n'.join(left.values())) from None


def each_event(path):
    """The events of a log, one after the other, as (number, timestamp, channel, data): of logs larger than memory, too."""
    if os.path.getsize(path) == 0:
        return
    with open(path, 'rb') as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        at = 0
        while at < len(data):
            magic, number, timestamp, channel_size, size = EVENT.unpack_from(data, at)
            assert magic == EVENT_MAGIC, f'{path}: no event at byte {at}'
            at += EVENT.size
            channel = data[at:at + channel_size].decode()
            at += channel_size
            yield number, timestamp, channel, data[at:at + size]
            at += size


def read_events(path):
    """All events of a log as (number, timestamp, channel, data)."""
    return list(each_event(path))


def write_events(path, events):
    with open(path, 'wb') as file:
        for number, timestamp, channel, data in events:
            name = channel.encode()
            file.write(EVENT.pack(EVENT_MAGIC, number, timestamp, len(name), len(data)) + name + data)


_types = None


def lcm_types():
    """lcm-gen's Python modules of our types, by name, and by fingerprint."""
    global _types
    if _types is None:
        folder = tempfile.mkdtemp()
        files = sorted((SOURCE / 'lcmtypes').glob('*.lcm'))
        subprocess.run(['lcm-gen', '-p', '--ppath', folder, *map(str, files)], check=True, capture_output=True)
        sys.path.insert(0, folder)
        _types = {f.stem: getattr(importlib.import_module(f'morphbus.{f.stem}'), f.stem) for f in files}
        shutil.rmtree(folder)
        for kind in list(_types.values()):
            _types[kind._get_packed_fingerprint()] = kind
    return _types


def decode(data):
    return lcm_types()[data[:8]].decode(data)


def header_of(data):
    """The header alone, for messages that are too many to be decoded whole."""
    return lcm_types()['header_t']._decode_one(io.BytesIO(data[8:8 + 64]))


def content(data):
    """The message without its CRC and auth, which every run has other ones of: equal where the messages are."""
    return data[:8] + data[20:]


def with_crc(data):
    """The message with the CRC that belongs to it."""
    data = data[:8] + bytes(4) + data[12:]
    return data[:8] + struct.pack('>I', zlib.crc32(data)) + data[12:]


def encode(message):
    """With the CRC that belongs to it."""
    return with_crc(message.encode())


def sip_hash(key, text):
    """SipHash-2-4 (Aumasson and Bernstein, 2012) as a number of 64 bits."""
    mask = (1 << 64) - 1
    first, second = struct.unpack('<QQ', key)
    v = [first ^ 0x736f6d6570736575, second ^ 0x646f72616e646f6d, first ^ 0x6c7967656e657261, second ^ 0x7465646279746573]

    def turn(x, by):
        return (x << by | x >> (64 - by)) & mask

    def rounds(count):
        for _ in range(count):
            v[0], v[2] = v[0] + v[1] & mask, v[2] + v[3] & mask
            v[1], v[3] = turn(v[1], 13) ^ v[0], turn(v[3], 16) ^ v[2]
            v[0] = turn(v[0], 32)
            v[2], v[0] = v[2] + v[1] & mask, v[0] + v[3] & mask
            v[1], v[3] = turn(v[1], 17) ^ v[2], turn(v[3], 21) ^ v[0]
            v[2] = turn(v[2], 32)
    last = text[len(text) - len(text) % 8:]
    words = [*struct.iter_unpack('<Q', text[:len(text) - len(last)]),
             struct.unpack('<Q', last + bytes(7 - len(last)) + bytes([len(text) & 255]))]
    for (word,) in words:
        v[3] ^= word
        rounds(2)
        v[0] ^= word
    v[2] ^= 0xff
    rounds(4)
    return v[0] ^ v[1] ^ v[2] ^ v[3]


def seal(channel, data, key):
    """The message as whoever has the run's key says it."""
    bare = data[:8] + bytes(12) + data[20:]
    auth = sip_hash(key, bytes([len(channel)]) + channel.encode() + bare)
    return with_crc(bare[:12] + struct.pack('>Q', auth) + bare[20:])


def new_key(folder):
    """A file with a run's key, as docs/cli.md has it made by hand."""
    path = folder / 'run.key'
    subprocess.run(['sh', '-c', '(umask 077; head -c 16 /dev/urandom > "$1")', 'sh', str(path)], check=True)
    return path


class Case(unittest.TestCase):
    """With a folder of its own for files and for the registry of runs."""
    maxDiff = None

    def setUp(self):
        self._folder = tempfile.TemporaryDirectory(prefix='morphbus-e2e-')
        self.addCleanup(self._folder.cleanup)
        self.folder = pathlib.Path(self._folder.name)
        runtime = self.folder / 'runtime'
        runtime.mkdir(mode=0o700)
        os.environ['XDG_RUNTIME_DIR'] = str(runtime)
        os.environ.pop('LCM_DEFAULT_URL', None)

    def kill_at_the_end(self, process):
        """However this test ends, the process does so before it, and what it started."""
        self.addCleanup(end_of, process)

    def in_private_network(self):
        """Whether the test runs in one, where nobody but its processes is on the bus; if not, it has now been repeated in one."""
        if os.environ.get('MORPHBUS_PRIVATE_NETWORK') is not None:
            return True
        script, name = sys.modules[type(self).__module__].__file__, '.'.join(self.id().split('.')[-2:])
        done = subprocess.run([str(BIN / 'isolated'), sys.executable, script, name],
                              env={**os.environ, 'MORPHBUS_PRIVATE_NETWORK': '1'}, capture_output=True, text=True,
                              timeout=LIMIT)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return False

    def log(self, name):
        """A log that the fixture recorded."""
        path = SCRATCH / name
        self.assertTrue(path.exists(), f'{path} is missing: run the test e2e.record first')
        return path


    def doctored(self, log, old, new):
        """The log of an --inproc run with other bytes, as many, in its description."""
        self.assertEqual(len(old), len(new))
        events = read_events(log)
        parts = {i: decode(data) for i, (_, _, channel, data) in enumerate(events) if channel.endswith('/INFO')}
        whole = b''.join(part.data for part in sorted(parts.values(), key=lambda part: part.part))
        self.assertEqual(len(whole), next(iter(parts.values())).total_bytes)
        self.assertIn(old, whole)
        whole = whole.replace(old, new)
        for i, part in sorted(parts.items(), key=lambda entry: entry[1].part):
            part.data, whole = whole[:part.size], whole[part.size:]
            events[i] = (*events[i][:3], encode(part))
        path = self.folder / 'doctored.log'
        write_events(path, events)
        return path


class ShortRun(Case):
    """With a short log, `self.short`, recorded once for all tests of the class: SECONDS of the quadruped's walk."""
    RUN = 'short'
    SECONDS = 3

    @classmethod
    def setUpClass(cls):
        folder = tempfile.mkdtemp(prefix='morphbus-e2e-')
        cls.addClassCleanup(shutil.rmtree, folder)
        cls.short = f'{folder}/{cls.RUN}.log'
        # A registry of its own: a run of a test that goes on beside this one may have the same name.
        os.environ['XDG_RUNTIME_DIR'] = folder
        morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', cls.SECONDS, '--inproc',
                 '--run', cls.RUN, '--log', cls.short)
