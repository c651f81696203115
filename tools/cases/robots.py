"""Random robots: modules of the types that ship, docked at random, mostly as trees, with the loops that close by themselves."""
import dataclasses
import json
import math
import pathlib
import subprocess

from cases.modules import CALLED, DEGREES, FAMILIES, TYPES

NEAR = 1e-6  # m, and in quaternions: what counts as one place
NAME = 'assembled'

# The 24 ways in which the axes of a frame can lie along those of a link.
_AXES = ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))
FRAMES = tuple((north, up) for north in _AXES for up in _AXES if sum(a * b for a, b in zip(north, up)) == 0)


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def product(p, q):
    """Of two quaternions, w x y z."""
    return (p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3], p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
            p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1], p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0])


def conjugate(q):
    return (q[0], -q[1], -q[2], -q[3])


@dataclasses.dataclass(frozen=True)
class Pose:
    """Of a frame B in a frame A; `a * b` is first b, then a."""
    p: tuple = (0.0, 0.0, 0.0)
    q: tuple = (1.0, 0.0, 0.0, 0.0)

    def point(self, v):
        turned = product(product(self.q, (0.0, *v)), conjugate(self.q))
        return tuple(a + b for a, b in zip(self.p, turned[1:]))

    def __mul__(self, other):
        return Pose(self.point(other.p), product(self.q, other.q))

    def inverse(self):
        q = conjugate(self.q)
        return Pose(tuple(-x for x in Pose(q=q).point(self.p)), q)

    def is_near(self, other):
        # q and -q turn alike.
        return (math.dist(self.p, other.p) < NEAR
                and min(math.dist(self.q, other.q), math.dist(self.q, tuple(-x for x in other.q))) < NEAR)


@dataclasses.dataclass(frozen=True)
class Docking:
    """A numbered way in which a module of type `b` can be docked to one of type `a`, seen from either."""
    name: str  # of the connection, with the number
    a: str
    b: str
    connector_a: str
    connector_b: str
    pose: Pose  # of b in a
    reversed: bool  # b is the connection's first member

    def text(self, a, b):
        first, second = f'{a}.{self.connector_a}', f'{b}.{self.connector_b}'
        return f'({second},{first},{self.name})' if self.reversed else f'({first},{second},{self.name})'


class Dockings:
    """The ways to dock of all families, as `morphbus connections` has them."""

    def __init__(self, morphbus, models):
        self._morphbus, self._models = str(morphbus), pathlib.Path(models)
        self._of_connection = {}

    def of(self, family):
        return [docking for name in family.connections for docking in self._load(family.model, name)]

    def _load(self, model, name):
        if name not in self._of_connection:
            done = subprocess.run([self._morphbus, 'connections', self._models / model, '--connection', name, '--json'],
                                  stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
            if done.returncode != 0:
                raise RuntimeError(f'morphbus connections {model}: status {done.returncode}: {done.stderr.strip()}')
            a, b = (CALLED.get(kind, kind) for kind in name.split('_to_'))
            both = []
            for each in json.loads(done.stdout)['connections']:
                pose = Pose(tuple(each['pose']['p']), tuple(each['pose']['q']))
                numbered = f'{name}:{each["number"]}'
                both.append(Docking(numbered, a, b, each['a'], each['b'], pose, False))
                both.append(Docking(numbered, b, a, each['b'], each['a'], pose.inverse(), True))
            self._of_connection[name] = both
        return self._of_connection[name]


@dataclasses.dataclass
class Robot:
    """A robot that a run can take."""
    model: str  # of models/: the file that it is from, or that it imports
    name: str
    modules: dict  # name: type
    text: str = ''  # the definition in M3L of a random one; empty of a shipped one
    dockings: tuple = ()  # pairs of connectors, 'm1.c2'
    loops: int = 0
    reach: float = 1.0  # m: no part is farther from the robot frame's origin at the start


class _Assembly:
    """Modules that are docked one after the other."""

    def __init__(self, dockings):
        self.possible = dockings
        # By modules: types, places, and connectors in use; and who is docked to whom, how.
        self.types, self.poses, self.used, self.docked = [], [], set(), []
        self.loops = 0

    def add(self, kind, pose):
        self.types.append(kind)
        self.poses.append(pose)

    def is_free(self, kind, pose):
        """Whether a module fits there without lying in another one."""
        for other, place in zip(self.types, self.poses):
            least = TYPES[kind].radius + TYPES[other].radius - 0.003
            for a in TYPES[kind].middles:
                for b in TYPES[other].middles:
                    if math.dist(pose.point((a, 0, 0)), place.point((b, 0, 0))) < least:
                        return False
        return True

    def dock(self, a, b, docking):
        self.used |= {(a, docking.connector_a), (b, docking.connector_b)}
        self.docked.append((a, b, docking))

    def grow(self, chance, kind):
        """Docks one more module somewhere; false where it found no room in some tries."""
        for _ in range(40):
            a = chance.whole(0, len(self.types) - 1)
            fitting = [docking for docking in self.possible if docking.a == self.types[a] and docking.b == kind
                       and (a, docking.connector_a) not in self.used]
            if not fitting:
                continue
            docking = chance.one(fitting)
            pose = self.poses[a] * docking.pose
            if self.is_free(kind, pose):
                self.add(kind, pose)
                self.dock(a, len(self.types) - 1, docking)
                return True
        return False

    def close_loops(self):
        """Docks all connectors that meet."""
        for a in range(len(self.types)):
            for b in range(a):
                between = self.poses[a].inverse() * self.poses[b]
                for docking in self.possible:
                    if (docking.a == self.types[a] and docking.b == self.types[b] and (a, docking.connector_a) not in self.used
                            and (b, docking.connector_b) not in self.used and docking.pose.is_near(between)):
                        self.dock(a, b, docking)
                        self.loops += 1


def starts(chance, assembly, names):
    """Start values of joints, small ones so that nobody lies in his neighbour."""
    found = []
    for name, kind in zip(names, assembly.types):
        for joint, sort in TYPES[kind].joints.items():
            if chance.happens(0.5):
                value = chance.between(0, 1) if sort == 'prismatic' else chance.between(-15, 15) / DEGREES
                found.append(f'{name}.{joint}={value:.4f}')
    return found


def frame(chance, assembly, names):
    """A robot frame on some link, turned in some way; and the module that has it."""
    at = chance.whole(0, len(names) - 1)
    link = chance.one(TYPES[assembly.types[at]].links)
    north, up = chance.one(FRAMES)
    axes = ',\n         '.join(f'{names[at]}.{link}.(axis: origin=(0,0,0), direction=({",".join(map(str, axis))}))'
                               for axis in (north, up, cross(north, up)))
    return at, f'  frame=({axes})'


def random_robot(chance, dockings, modules=None):
    """A robot of some family, and the family."""
    family = chance.weighted({family: family.weight for family in FAMILIES})
    if modules is None:
        modules = chance.weighted({1: 1, 2: 4, 3: 6, 4: 6, 5: 5, 6: 4, 7: 3, 8: 3, 12: 1, 16: 0.5})
    assembly = _Assembly(dockings.of(family))
    # A telescope has two faces only: the first module is one that others can be docked to.
    assembly.add(family.types[0], Pose())
    while len(assembly.types) < modules and assembly.grow(chance, chance.one(family.types)):
        pass
    if chance.happens(0.7):
        assembly.close_loops()
    # The modules share processes in the order in which they are declared, which is any.
    count = len(assembly.types)
    order = chance.shuffled(range(count))
    names = [''] * count
    for number, module in enumerate(order):
        names[module] = f'm{number + 1}'
    parts = [f'robot {NAME}:', '  modules=(' + ', '.join(f'{assembly.types[module]} {names[module]}' for module in order) + ')']
    if assembly.docked:
        parts.append('  connections=(' + ',\n               '.join(
            docking.text(names[a], names[b]) for a, b, docking in chance.shuffled(assembly.docked)) + ')')
    at = order[0]
    if chance.happens(0.5):
        at, text = frame(chance, assembly, names)
        parts.append(text)
    # A loop that closes with all joints at 0 does so in few other postures.
    if assembly.loops == 0 and chance.happens(0.4):
        values = starts(chance, assembly, names)
        if values:
            parts.append('  joints=(' + ', '.join(values) + ')')
    reach = max(math.dist(assembly.poses[at].p, pose.p) for pose in assembly.poses) + 0.25
    text = parts[0] + '\n' + ',\n'.join(parts[1:]) + '\n'
    return Robot(family.model, NAME, {names[module]: assembly.types[module] for module in order}, text,
                 tuple((f'{names[a]}.{docking.connector_a}', f'{names[b]}.{docking.connector_b}')
                       for a, b, docking in assembly.docked), assembly.loops, reach), family
