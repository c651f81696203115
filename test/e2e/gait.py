"""How the quadruped walks, read from a log's WORLD without the help of the program under test."""
import math

from support import decode, each_event

HUB = 4  # number of m5, whose body is the robot's trunk
MOST_TILT = math.radians(8)
CYCLE = 351  # ticks, 7.02 s: what the program sleeps, each sleep up to the next tick
STEP = 0.0325 / 2  # m; a walk that goes on gets further in a cycle
FIRST_STEP = 300  # by this tick the robot has got up and walks


def hub_bodies(path, module=HUB):
    """(tick, first body of the module) for every WORLD that has it, once a tick, in the log's order."""
    last = None
    for _, _, channel, data in each_event(path):
        if not channel.endswith('/SIM/WORLD'):
            continue
        world = decode(data)
        body = next((b for b in world.bodies if b.module_id == module), None)
        if body is not None and world.header.tick != last:
            last = world.header.tick
            yield last, body


def up_of(body):
    """The world's up axis in the body's frame: the middle row of the rotation's matrix."""
    w, x, y, z = body.orientation_wxyz
    return 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)


def tilts(path, module=HUB):
    """By tick, by how much the up axis of a module's first body has turned away from where it was in the first tick, in
    rad."""
    found, up_B = {}, None
    for tick, body in hub_bodies(path, module):
        up = up_of(body)
        up_B = up_B or up
        cosine = sum(a * b for a, b in zip(up, up_B))
        found.setdefault(tick, math.acos(max(-1, min(1, cosine))))
    return found


def north(path, module=HUB):
    """By tick, how far north the module's first body is, in m."""
    return {tick: body.position_m[0] for tick, body in hub_bodies(path, module)}


def assert_walked(case, path, since, least_cycles=1):
    """From tick `since` on the robot walked: a step's length in every whole cycle of the gait, of which there are so many
    at least, and its trunk stayed upright."""
    way, tilt = north(path), tilts(path)
    worst = max(tilt, key=tilt.get)
    case.assertLess(tilt[worst], MOST_TILT, f'{math.degrees(tilt[worst]):.1f} degrees at tick {worst}')
    ticks = range(since, max(way) - CYCLE + 1, CYCLE)
    case.assertGreaterEqual(len(ticks), least_cycles, 'cycles')
    for tick in ticks:
        case.assertGreater(way[tick + CYCLE] - way[tick], STEP, f'the cycle from tick {tick} on')
