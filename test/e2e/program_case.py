"""What the tests of the programs in models/programs/ share: running one, and asking where its modules went."""
import math

from support import SOURCE, Case, as_json, decode, read_events

MODELS = SOURCE / 'models'
PROGRAMS = MODELS / 'programs'
TICKS_PER_SECOND = 50


def rotated(orientation, v):
    """A vector turned by a unit quaternion w x y z."""
    w, *u = orientation
    t = [2 * (u[(i + 1) % 3] * v[(i + 2) % 3] - u[(i + 2) % 3] * v[(i + 1) % 3]) for i in range(3)]
    return [v[i] + w * t[i] + u[(i + 1) % 3] * t[(i + 2) % 3] - u[(i + 2) % 3] * t[(i + 1) % 3] for i in range(3)]


class Programs(Case):
    def run_program(self, model, program, robot, seconds, *more, faults=False):
        """Runs it for so long; fails on modules without a role and, unless they are expected, on faults."""
        path = program if str(program).endswith('.image') else PROGRAMS / f'{program}.dyn'
        self.log = self.folder / f'{robot}.log'
        self._worlds = None
        summary = as_json('run', MODELS / f'{model}.m3l', path, '--robot', robot, '--seconds', seconds, '--inproc',
                          '--log', self.log, '--force', *more)
        self.assertEqual(summary['problems'], [], robot)
        self.assertTrue(all(summary['roles'].values()), summary['roles'])
        if not faults:
            self.assertEqual(summary['faults'], [], robot)
        return summary

    def worlds(self):
        """{tick: bodies}: where everything was, from the log of the last run."""
        if self._worlds is None:
            self._worlds = {}
            for _, _, channel, data in read_events(self.log):
                if channel.endswith('/SIM/WORLD'):
                    world = decode(data)
                    self._worlds.setdefault(world.header.tick, []).extend(world.bodies)
        return self._worlds

    def bodies(self, module, seconds):
        """The bodies of a module at a time; m1 is module 1. One that two modules share is with the first of them."""
        return [b for b in self.worlds()[round(seconds * TICKS_PER_SECOND)] if b.module_id == module - 1]

    def place(self, module, seconds):
        """The mean of the places of a module's bodies: north, up, east, in metres."""
        places = [b.position_m for b in self.bodies(module, seconds)]
        return [sum(axis) / len(places) for axis in zip(*places)]

    def turn(self, summary):
        """Degrees by which the robot has turned to the left, about up."""
        return math.degrees(summary['walk']['turn_rad'])

    def course(self, summary):
        """Which way its root's body went: degrees from north to east."""
        north, _, east = summary['root_displacement']
        return math.degrees(math.atan2(east, north))

    def turned_axis(self, module, begin, end):
        """Degrees by which a module's east-west axis has turned to the left between two times, also where it has
        rolled about that axis meanwhile."""
        before, after = (self.bodies(module, seconds)[0].orientation_wxyz for seconds in (begin, end))
        axes = [[float(i == k) for k in range(3)] for i in range(3)]
        axis = max(axes, key=lambda v: abs(rotated(before, v)[2]))
        begun, ended = (math.atan2(rotated(q, axis)[0], rotated(q, axis)[2]) for q in (before, after))
        return math.degrees(math.remainder(ended - begun, 2 * math.pi))
