"""What befalls the processes of a run from outside: SIGKILL, and SIGSTOP until SIGCONT comes."""
import dataclasses
import os
import pathlib
import re
import signal
import struct
import subprocess
import time

# Of each process of modules: a third exit within ten seconds would end the run.
MOST_KILLS = 2


@dataclasses.dataclass
class Disturbance:
    """Something that happens once process `process` has saved its state so often: about once a tick."""
    saves: int
    process: int  # of modules, in the order of the robot
    later: float  # s, so that it falls anywhere in a tick
    victim: str  # 'modules' (that process), 'sim', 'log' or 'launcher'
    seconds: float = 0.0  # of a freeze; 0: it is killed


class Disturber:
    """Carries out the disturbances of one run, whose launcher is a child of ours."""

    def __init__(self, launcher, runtime, planned):
        self._launcher, self._runtime = launcher, pathlib.Path(runtime)
        # By process: what is to come, the next one last.
        self._planned = {}
        for each in sorted(planned, key=lambda each: each.saves, reverse=True):
            self._planned.setdefault(each.process, []).append(each)
        self._states = {}  # by process: its open file
        self._freezers = []
        self.killed = self.frozen = 0

    @property
    def is_done(self):
        return not self._planned

    def step(self):
        """Does what is due."""
        for process, planned in list(self._planned.items()):
            while planned and self._saves(process) >= planned[-1].saves:
                pid = self._pid(planned[-1])
                # It is not there yet, or not again; that of a module that is lost never will be.
                if pid is None:
                    break
                disturbance = planned.pop()
                time.sleep(disturbance.later)
                self._do(disturbance, pid)
            if not planned:
                del self._planned[process]

    def finish(self):
        """To be called when the run is over."""
        for file in self._states.values():
            if file is not None:
                os.close(file)
        for freezer in self._freezers:
            freezer.wait()

    def _saves(self, process):
        """How often the process has saved its state, which the first bytes of its file say (bridge/module/snapshot_file.cc); -1
        before there is one. A process of several modules has a file for each of them."""
        file = self._states.get(process)
        if file is None:
            path = next(self._runtime.glob(f'morphbus/*/process-{process}.state*'), None)
            try:
                file = self._states[process] = os.open(path, os.O_RDONLY | os.O_CLOEXEC) if path else None
            except OSError:
                pass  # It is taken away right now.
        count = os.pread(file, 8, 0) if file is not None else b''
        return struct.unpack('=Q', count)[0] if len(count) == 8 else -1

    def _children(self):
        """The processes of the run by pid, with their command lines."""
        try:
            pids = pathlib.Path(f'/proc/{self._launcher}/task/{self._launcher}/children').read_text(encoding='ascii').split()
        except OSError:
            pids = []  # It has ended; or the kernel has no such file, and nobody is disturbed.
        found = {}
        for pid in pids:
            try:
                found[int(pid)] = pathlib.Path(f'/proc/{pid}/cmdline').read_bytes().decode(errors='replace').replace('\0', ' ')
            except OSError:
                continue  # It has ended.
        return found

    def _pid(self, disturbance):
        if disturbance.victim == 'launcher':
            return self._launcher
        pattern = rf'^\S*morphbus {disturbance.victim} '
        if disturbance.victim == 'modules':
            pattern = rf'/process-{disturbance.process}\.state '
        return next((pid for pid, text in self._children().items() if re.search(pattern, text)), None)

    def _do(self, disturbance, pid):
        if disturbance.seconds > 0:
            # A shell of its own, so that nobody stays frozen should we be killed meanwhile.
            self._freezers.append(subprocess.Popen(
                ['sh', '-c', 'sleep "$2"; kill -CONT "$1"', 'sh', str(pid), f'{disturbance.seconds:.3f}'], start_new_session=True,
                stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))
        try:
            os.kill(pid, signal.SIGSTOP if disturbance.seconds > 0 else signal.SIGKILL)
        except OSError:
            return  # It has ended by itself.
        if disturbance.seconds > 0:
            self.frozen += 1
        else:
            self.killed += 1
