"""Carries out one way of a case, and holds its outcome against the reference's."""
import dataclasses
import json
import os
import pathlib
import select
import shutil
import signal
import subprocess
import time

from cases.disturbances import Disturber

# What differs from run to run, or with the way: everything else of a summary must be equal.
OF_THE_WAY = {'run', 'wall_seconds', 'lost', 'resent', 'refused', 'processes', 'restarts', 'log', 'log_hash',
              'missed_deadlines', 'lateness'}
MOST_MEMORY = 3 << 30  # bytes: a run that takes more is ended, before the machine ends something else
# How a run's error reads where somebody did not answer in time: of a machine that is too busy, or of a run that hangs.
OUT_OF_TIME = ('do not answer', 'does not answer', 'has been silent', 'did not end with the run', 'left the run before its end',
               'did not join', 'did not stop', 'exited with status 3')


class Stopped(Exception):
    """The campaign is to end: what is under way counts for nothing."""


@dataclasses.dataclass
class Outcome:
    """Of one run of `morphbus`."""
    status: int  # its exit status; -9 and the like: a signal
    summary: dict  # of --json; empty if there was none
    said: str  # on stderr
    seconds: float
    timed_out: bool = False
    too_large: bool = False
    kills: int = 0
    freezes: int = 0

    @property
    def hash(self):
        return self.summary.get('hash', '')

    @property
    def is_out_of_time(self):
        return self.timed_out or (self.status == 3 and any(text in str(self.summary.get('error')) for text in OUT_OF_TIME))

    def counts(self):
        """How much befell the run, for the table."""
        processes = self.summary.get('processes', {}).values()
        return {'kills': self.kills, 'freezes': self.freezes, **{
            kind: sum(process.get(kind, 0) for process in processes) for kind in ('discarded', 'doubled', 'delayed', 'corrupted')}}


def execute(morphbus, arguments, folder, limit, stop, disturbances=()):
    """Runs `morphbus` in a folder, with a registry of runs of its own there; ends what takes longer than `limit` seconds."""
    runtime = folder / 'runtime'
    # Anew, for a run that was ended leaves its files behind.
    shutil.rmtree(runtime, ignore_errors=True)
    runtime.mkdir(mode=0o700)
    environment = {**os.environ, 'XDG_RUNTIME_DIR': str(runtime)}
    environment.pop('LCM_DEFAULT_URL', None)
    begun = time.monotonic()
    with (open(folder / 'stdout', 'w+', encoding='utf-8', errors='replace') as out,
          open(folder / 'stderr', 'w+', encoding='utf-8', errors='replace') as err):
        # In a session of its own, so that Ctrl-C is ours alone.
        process = subprocess.Popen([str(morphbus), *arguments], cwd=folder, env=environment, stdin=subprocess.DEVNULL, stdout=out,
                                   stderr=err, start_new_session=True)
        disturber = Disturber(process.pid, runtime, disturbances)
        why = ''
        try:
            why = _await_end(process, begun + limit, stop, disturber)
        finally:
            if process.poll() is None:
                # Its children die with it.
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
            disturber.finish()
        seconds = time.monotonic() - begun
        out.seek(0)
        err.seek(0)
        try:
            summary = json.loads(out.read())
        except ValueError:
            summary = {}
        said = err.read()
    return Outcome(process.returncode, summary if isinstance(summary, dict) else {}, said, seconds, why == 'time', why == 'memory',
                   disturber.killed, disturber.frozen)


def _await_end(process, limit, stop, disturber):
    """Waits until the process ends, and disturbs it meanwhile. Why it is to be ended: '' (it has), 'time' or 'memory'."""
    descriptor = os.pidfd_open(process.pid)
    try:
        poll = select.poll()
        poll.register(descriptor, select.POLLIN)
        look = 0.0
        while True:
            # Ticks take about a millisecond, and are looked for as often while something is to come.
            ended = poll.poll(200 if disturber.is_done else 1)
            # What took longer has, also where we were the ones who looked late.
            now = time.monotonic()
            if now > limit:
                return 'time'
            if ended:
                process.wait()
                return ''
            if stop.is_set():
                raise Stopped
            if now > look:
                look = now + 0.2
                if _memory(process.pid) > MOST_MEMORY:
                    return 'memory'
            disturber.step()
    finally:
        os.close(descriptor)


def _memory(pid):
    """Bytes that a process has of the machine's memory."""
    try:
        return int(pathlib.Path(f'/proc/{pid}/statm').read_text(encoding='ascii').split()[1]) * os.sysconf('SC_PAGE_SIZE')
    except (OSError, IndexError):
        return 0  # It has ended.


def differences(reference, outcome):
    """How an outcome differs from the reference's, in words; empty if in nothing."""
    found = []
    if outcome.status != reference.status:
        found.append(f'exit status {outcome.status} instead of {reference.status}')
    if outcome.hash != reference.hash:
        found.append(f'hash {outcome.hash or "none"} instead of {reference.hash or "none"}')
    elif outcome.summary.get('log_hash') != outcome.hash:
        found.append('the log has another hash than what was recorded')
    for key in sorted((set(reference.summary) | set(outcome.summary)) - OF_THE_WAY - {'hash'}):
        ours, theirs = outcome.summary.get(key), reference.summary.get(key)
        if ours != theirs:
            found.append(f'{key}: {str(ours)[:200]} instead of {str(theirs)[:200]}')
    return found
