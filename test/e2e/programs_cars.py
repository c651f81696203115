#!/usr/bin/env python3
"""The programs that drive: the car of seven ATRON modules, and that of three, which stops before what it senses and
drives past it; SMORES' train. Margins as in programs.py."""
import math
import random
import re
import unittest

from program_case import MODELS, Programs, rotated
from support import decode, read_events

# An obstacle, z up and y to the west.
WORLD = '''<?xml version="1.0"?>
<sdf version="1.9"><world name="seeded"><model name="obstacle"><static>true</static>
<pose>{north} {west} {up} 0 0 {turn}</pose>
<link name="link"><collision name="shape">
<geometry>{shape}</geometry></collision></link>
</model></world></sdf>
'''


def atron_corners():
    """{link: corners of its hull} in its frame, in metres, from the text of the model: those of four connectors' points
    and the equator's."""
    text = re.sub('//.*', '', (MODELS / 'atron.m3l').read_text())
    text = text[text.index('module ATRON'):text.index('axis up')]
    corners = {0: [], 1: []}
    for triple in re.findall(r'coords=\(([^)]*)\)', text):
        x, y, z = (float(number) for number in triple.split(','))
        point = [0.055 / math.sqrt(2) * value for value in (x, y, z)]
        for link, sign in ((0, 1), (1, -1)):
            if z * sign >= 0 and point not in corners[link]:
                corners[link].append(point)
    return corners


def hull_of(points):
    """The corners of the convex hull of points in a plane, counter-clockwise (Andrew 1979)."""
    def half(ordered):
        chain = []
        for p in ordered:
            while len(chain) > 1 and ((chain[-1][0] - chain[-2][0]) * (p[1] - chain[-2][1])
                                      - (chain[-1][1] - chain[-2][1]) * (p[0] - chain[-2][0])) <= 0:
                chain.pop()
            chain.append(p)
        return chain[:-1]
    points = sorted(map(tuple, points))
    return half(points) + half(points[::-1])


def distance_to(polygon, point):
    """Of a point in the plane from a convex polygon, counter-clockwise; 0 within it."""
    nearest, inside = math.inf, True
    for (ax, ay), (bx, by) in zip(polygon, polygon[1:] + polygon[:1]):
        ux, uy, vx, vy = bx - ax, by - ay, point[0] - ax, point[1] - ay
        part = max(0, min(1, (ux * vx + uy * vy) / (ux * ux + uy * uy)))
        nearest = min(nearest, math.hypot(vx - part * ux, vy - part * uy))
        inside = inside and ux * vy - uy * vx >= 0
    return 0 if inside else nearest


def between(one, other):
    """Of two convex polygons the distance that is seen from their corners; 0 if a corner lies in the other. Bodies
    that come together tick by tick meet with a corner first."""
    return min(min(distance_to(one, p) for p in other), min(distance_to(other, p) for p in one))


class Obstacle:
    """Something before the car, in its way: its middle line is at most 30 mm off the car's. Two of five placements
    have a round one."""
    HEIGHT = 0.2

    def __init__(self, seed):
        chance = random.Random(seed)
        self.depth, self.width = chance.uniform(0.04, 0.1), chance.uniform(0.1, 0.2)
        self.north, self.west = chance.uniform(0.3, 0.4), chance.uniform(-0.03, 0.03)
        self.turn = chance.uniform(-0.2, 0.2)
        self.kind = ('box', 'cylinder', 'box', 'sphere', 'box')[seed % 5]
        if self.kind != 'box':
            # Round ones, as wide as a box would be.
            self.depth = self.width

    def world(self):
        radius = self.width / 2
        shape = {'box': f'<box><size>{self.depth} {self.width} {self.HEIGHT}</size></box>',
                 'cylinder': f'<cylinder><radius>{radius}</radius><length>{self.HEIGHT}</length></cylinder>',
                 'sphere': f'<sphere><radius>{radius}</radius></sphere>'}[self.kind]
        up = radius if self.kind == 'sphere' else self.HEIGHT / 2
        return WORLD.format(north=self.north, west=self.west, up=up, turn=self.turn, shape=shape)

    def beyond(self):
        """North of it."""
        return self.north + self.depth

    def distance(self, outline):
        """Of the outline of a body as seen from above: (north, east) of its corners. All obstacles are as high as the
        car at least, and stand upright; of a ball what is seen from above counts, which is more than there is."""
        if self.kind != 'box':
            return distance_to(outline, (self.north, -self.west)) - self.width / 2
        corners = []
        for x, y in ((1, 1), (-1, 1), (-1, -1), (1, -1)):
            x, y = x * self.depth / 2, y * self.width / 2
            c, s = math.cos(self.turn), math.sin(self.turn)
            corners.append((self.north + c * x - s * y, -(self.west + s * x + c * y)))
        return between(outline, hull_of(corners))


class Cars(Programs):
    def test_the_car_of_three_drives_straight_north(self):
        summary = self.run_program('atron', 'car', 'car', 7)
        self.assertGreater(summary['displacement'][0], 0.23)  # measured: 347 mm
        self.assertLess(abs(self.course(summary)), 5)
        self.assertLess(abs(self.turn(summary)), 5)

    def test_the_car_of_seven_steers(self):
        summary = self.run_program('atron', 'car7', 'car7', 7)
        begin, straight, end = (self.place(1, seconds) for seconds in (0.5, 2.5, 6.5))
        self.assertGreater(straight[0] - begin[0], 0.05)
        self.assertLess(abs(straight[2] - begin[2]), 0.01)
        self.assertGreater(end[0] - straight[0], 0.08)
        # Measured: 29 degrees to the left, and 28 mm.
        self.assertGreater(self.turn(summary), 19)
        self.assertLess(self.turn(summary), 45)
        self.assertLess(end[2] - straight[2], -0.012)

    def clearance(self, obstacle):
        """How near any module came to the obstacle, in metres: their hulls where WORLD has them, tick by tick."""
        corners, nearest = atron_corners(), math.inf
        for bodies in self.worlds().values():
            for body in bodies:
                north, _, east = body.position_m
                # Far away all the same.
                if math.hypot(north - obstacle.north, east + obstacle.west) > 0.3:
                    continue
                places = [rotated(body.orientation_wxyz, p) for p in corners[body.link]]
                outline = hull_of([(north + p[0], east + p[2]) for p in places])
                nearest = min(nearest, obstacle.distance(outline))
        return nearest

    def evade(self, seed):
        obstacle = Obstacle(seed)
        told = f'seed {seed}, {obstacle.kind}'
        world = self.folder / 'obstacle.sdf'
        world.write_text(obstacle.world())
        summary = self.run_program('atron', 'car_evade', 'car', 25, '--world', world, '--noise-seed', seed + 1)
        halts = [p for p in summary['prints'] if 'halted' in p['text']]
        self.assertGreaterEqual(len(halts), 1, told)
        # It stands for a second before it says so, and does not touch the obstacle, which stays ahead.
        self.assertGreater(float(halts[0]['text'].split()[-1]), 120, told)
        moved = math.dist(self.place(1, halts[0]['time']), self.place(1, halts[0]['time'] - 0.5))
        self.assertLess(moved, 0.003, told)
        self.assertGreater(self.place(1, 24.9)[0], obstacle.beyond(), f'{told}: not past it')
        # It came no nearer than 97 mm, passed on the left (22 to 28 degrees off, as seen from the start), and heads north.
        self.assertGreater(self.clearance(obstacle), 0.05, told)
        self.assertAlmostEqual(self.course(summary), -25, delta=12, msg=told)
        self.assertLess(abs(self.turn(summary)), 10, told)

    def test_a_car_without_eyes_drives_into_it(self):
        # So the clearance above means something: here it is that of hulls that touch.
        for seed in (0, 1, 3):
            obstacle = Obstacle(seed)
            world = self.folder / 'obstacle.sdf'
            world.write_text(obstacle.world())
            self.run_program('atron', 'car', 'car', 8, '--world', world)
            self.assertLess(self.clearance(obstacle), 0.004, obstacle.kind)

    def test_the_car_of_three_stops_before_an_obstacle_and_drives_past_it(self):
        self.evade(0)


class Trains(Programs):
    """SMORES, which drives on wheels, and whose first module looks about with its face."""

    def joints(self):
        """{joint of the first module: [degrees in each tick]}, in the order of the model."""
        found = {'left_axle': [], 'right_axle': [], 'tilt': [], 'pan': []}
        for _, _, channel, data in read_events(self.log):
            if channel.endswith('/SIM/SENSORS'):
                for module in decode(data).modules:
                    if module.name == 'm1':
                        for name, position in zip(found, module.joint_position_si):
                            found[name].append(math.degrees(position))
        return found

    def test_it_drives_straight_north(self):
        summary = self.run_program('smores', 'smores_train', 'train', 6)
        self.assertGreater(summary['displacement'][0], 0.55)  # measured: 819 mm
        self.assertLess(abs(self.course(summary)), 5)
        self.assertLess(abs(self.turn(summary)), 5)

    def test_before_a_wall_it_tilts_and_pans_its_face_and_sees_over_it(self):
        # The wall is 200 mm high, and the eye 50 mm above the ground.
        summary = self.run_program('smores', 'smores_train', 'train', 9, '--world', MODELS / 'yard.sdf')
        joints = self.joints()
        self.assertAlmostEqual(max(joints['tilt']), 60, delta=3)
        self.assertAlmostEqual(max(joints['pan'], key=abs), 90, delta=3)
        self.assertAlmostEqual(joints['tilt'][-1], 0, delta=3)
        self.assertAlmostEqual(joints['pan'][-1], 0, delta=3)
        said = [p['text'].split() for p in summary['prints']]
        self.assertEqual(said[0][0], 'sees')
        ahead, above = float(said[0][1]), float(said[0][-1])
        self.assertLess(ahead, 400)
        self.assertGreater(above, 2 * ahead)


class TwentySeeds(Cars):
    def test_in_each_of_twenty_placements(self):
        for seed in range(20):
            self.evade(seed)


if __name__ == '__main__':
    unittest.main()
