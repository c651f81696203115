"""A run that is under way, for the tests of `morphbus control`."""
import json
import pathlib
import subprocess

from support import EVENT, LIMIT, MODEL, PROGRAM, Case, as_json, await_condition, command, decode, morphbus, read_events

GREETER = """
role Junction extends Module {
  require (sizeof(self.connected) == 4);
  command raise(float degrees, int times, bool left) {
    if (left) { Foot.lift(degrees); }
  }
}
role Foot extends Module {
  label ankle = self.joints($ANY, 1);
  command lift(degrees) { self.jointRotateDegreesNonBlocking(ankle, degrees); }
}
"""


def written_so_far(path):
    """The events of a log that is still written, as read_events has them; the last one may be cut."""
    try:
        data = pathlib.Path(path).read_bytes()
    except OSError:
        return []
    events, at = [], 0
    while at + EVENT.size <= len(data):
        _, number, timestamp, channel_size, size = EVENT.unpack_from(data, at)
        at += EVENT.size + channel_size + size
        if at <= len(data):
            events.append((number, timestamp, data[at - size - channel_size:at - size].decode(), data[at - size:at]))
    return events


# In lockstep all nine modules have taken their roles by this tick (the last of them at 24), and the quadruped gets up.
ROLES_TAKEN = 40


class Live(Case):
    """A run that is under way; pausing it makes what follows independent of the machine's speed."""

    def start(self, *options, run='live', isolate=True):
        self.run_name = run
        self.path = self.folder / f'{run}.log'
        self.process = subprocess.Popen(
            command('run', MODEL, PROGRAM, '--robot', 'quadruped', '--run', run, '--log', self.path, '--json',
                    *(['--isolate'] if isolate else []), *options),
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.kill_at_the_end(self.process)
        # The sim takes commands before the first tick, too, but then does most of them later; and a run that is stopped before
        # everybody has a role ends with status 1.
        self.reach(ROLES_TAKEN, 4)

    def attempt(self, *words):
        return subprocess.run(command('control', *words, '--run', self.run_name), capture_output=True).returncode

    def control(self, *words, **options):
        return as_json('control', *words, '--run', self.run_name, **options)

    def refuse(self, status, *words):
        done = subprocess.run(command('control', *words, '--run', self.run_name), capture_output=True, text=True)
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        self.assertEqual(done.stdout, '')
        return done.stderr

    def reach(self, tick, speed=0):
        """Waits until a tick is over; at this speed until then."""
        def over():
            # A run that is slow to take up what was said before refuses more for a while.
            done = subprocess.run(command('control', 'speed', speed, '--run', self.run_name, '--json'), capture_output=True)
            return done.returncode == 0 and json.loads(done.stdout)['tick'] > tick
        # Each question is a process, which takes from the run what a processor can do.
        await_condition(over, f'tick {tick} is over', pause=0.2)

    def await_held(self, tick):
        """Waits until a paused run has done its steps; asking so changes nothing."""
        await_condition(lambda: f'at tick {tick}\n' in self.refuse(1, 'pause'), f'held at tick {tick}')

    def end(self, status=0):
        out, err = self.process.communicate(timeout=LIMIT)
        self.assertEqual(self.process.returncode, status, out + err)
        self.summary, self.said = json.loads(out), err
        return self.summary

    def commands(self):
        """What the log says was done: (tick, command)."""
        return [(c['tick'], c['command']) for c in as_json('info', self.path)['commands']]

    def roles_of(self, module):
        """The roles that a module has played, in order."""
        roles = [decode(data).role_name for _, _, channel, data in read_events(self.path)
                 if channel.endswith(f'/{module}/STATUS')]
        return [role for role, before in zip(roles, [''] + roles) if role not in ('', before)]

    def world(self, tick, module):
        """Where the first body of a module is at a tick."""
        for _, _, channel, data in read_events(self.path):
            if channel.endswith('/SIM/WORLD'):
                world = decode(data)
                if world.header.tick == tick:
                    for body in world.bodies:
                        if body.module_id == module:
                            return body.position_m

    def assert_repeats(self):
        """The same commands at the same ticks make the same run, in one process or many."""
        for name, arguments in (('text', ['--commands']), ('json', ['--json'])):
            file = self.folder / name
            file.write_text(morphbus('info', self.path, *arguments).stdout)
        ticks = self.summary['ticks']
        for file, where in (('text', '--inproc'), ('json', '--isolate')):
            again = as_json('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', ticks * 0.02, where, '--run', 'again',
                            '--commands', self.folder / file, '--log', self.folder / 'again.log', '--force',
                            cwd=self.folder)
            self.assertEqual(again['hash'], self.summary['hash'], where)
            self.assertEqual(again['ended'], self.summary['ended'])
