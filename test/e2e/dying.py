"""A run whose processes a test kills and stops, for the tests of what a run outlives."""
import os
import re
import signal

from control_live import Live, written_so_far
from gait import FIRST_STEP, assert_walked
from support import MODEL, PROGRAM, await_condition, decode, morphbus, processes_of

MODULES = [f'm{i}' for i in range(1, 10)]
QUADRUPED = (MODEL, PROGRAM, '--robot', 'quadruped')


class Dying(Live):
    """A run whose processes a test kills and stops."""

    def pids_of(self, name):
        """Of the process that hosts a module, or of "sim" or "log"; other tests have runs of this name, too."""
        pattern = rf'/morphbus {name} ' if name in ('sim', 'log') else rf' --modules? (\w+,)*{name}[, ]'
        return [pid for pid, text in processes_of(self.run_name).items() if re.search(pattern, text) and f'{self.folder}/' in text]

    def pid_of(self, name):
        """As pids_of, and "launcher" is whoever started them all."""
        if name == 'launcher':
            return self.process.pid
        return await_condition(lambda: self.pids_of(name), f'{name} runs')[0]

    def kill(self, name):
        pid = self.pid_of(name)
        os.kill(pid, signal.SIGKILL)
        return pid

    def await_successor(self, name, pid):
        return await_condition(lambda: [new for new in self.pids_of(name) if new != pid], f'{name} runs again')[0]

    def tick(self):
        """The tick that the run is at. Asking sets its speed, to as fast as it goes."""
        return self.control('speed', 0)['tick']

    def ticks_so_far(self):
        """How far the log is, which is flushed about once a second."""
        for _, _, channel, data in reversed(written_so_far(f'{self.path}.partial')):
            if channel.endswith('/SIM/CLOCK'):
                return decode(data).header.tick
        return -1

    def assert_clean(self):
        said = morphbus('verify', self.path).stdout
        self.assertIn('whole; END verified, clean', said)
        self.assertNotIn('NOT', said)

    def assert_walked(self):
        assert_walked(self, self.path, FIRST_STEP)
