#!/usr/bin/env python3
"""Programs that feel, see and know what is level, in Bullet: a rover presses against a wall, and drives up a ramp."""
import math
import re
import unittest

from support import SOURCE, Case, as_json

# The rover of docs/m3l.md: two wheels, a ball in front that slides, a sensor of each kind.
MODEL = re.search(r'```m3l\n(const range.*?)```', (SOURCE / 'docs/m3l.md').read_text(encoding='utf-8'), re.S)[1]

# It drives north at 0.079 m/s.
DRIVE = '''role Rover extends Module {
  startup align() {
    self.setJointAxis(self.DRIVE_LEFT, $LINK_LEFT, $EAST_WEST);
    self.setJointAxis(self.DRIVE_RIGHT, $LINK_RIGHT, $EAST_WEST);
    self.sleepds(5);
  }
  function drive(float speed) {
    self.turnContinuous(self.DRIVE_LEFT, -speed);
    self.turnContinuous(self.DRIVE_RIGHT, -speed);
  }
'''

PRESS = DRIVE + '''  startup press() {
    drive(90);
    while (!self.contact($NORTH)) self.sleepcs(2);
    print("touched", self.distance($NORTH), self.BUMPER.GET_CONTACT());
    self.sleepds(5);
    print("presses", self.contact($NORTH));
    drive(-90);
    self.sleepds(10);
    print("free", self.contact($NORTH));
    drive(0);
  }
}
'''

CLIMB = DRIVE + '''  behavior climb() {
    print("tilt", self.tilt($EAST_WEST), self.tilt($NORTH_SOUTH), self.LEVEL.GET_TILT());
    drive(90);
    self.sleepds(10);
  }
}
'''

WALL = '''<?xml version="1.0"?>
<sdf version="1.9"><world name="walled"><model name="wall"><static>true</static>
<pose>0.35 0 0.1 0 0 0</pose><link name="link"><collision name="box">
<geometry><box><size>0.1 1 0.2</size></box></geometry></collision></link></model></world></sdf>
'''

# A slab that rises to the north; its upper side begins at the ground, 0.25 m north of the rover.
SLOPE = 12
RAMP = '''<?xml version="1.0"?>
<sdf version="1.9"><world name="sloped"><model name="ramp"><static>true</static>
<pose>{north} 0 {up} 0 -{pitch} 0</pose><link name="link"><collision name="box">
<geometry><box><size>2 1 0.1</size></box></geometry></collision></link></model></world></sdf>
'''


class Sensors(Case):
    def run_rover(self, program, world, seconds):
        for name, text in (('rover.m3l', MODEL), ('rover.dyn', program), ('world.sdf', world)):
            (self.folder / name).write_text(text)
        summary = as_json('run', self.folder / 'rover.m3l', self.folder / 'rover.dyn', '--seconds', seconds, '--inproc',
                          '--world', self.folder / 'world.sdf', '--friction', 0.9)
        self.assertEqual((summary['problems'], summary['faults']), ([], []))
        return [(p['time'], p['text'].split()) for p in summary['prints']]

    def test_a_robot_presses_against_a_wall_and_notices(self):
        (touched_at, touched), (_, presses), (_, free) = self.run_rover(PRESS, WALL, 6)
        # Nose to wall, where the eye in the ball's middle sees it.
        self.assertEqual(touched[0], 'touched')
        self.assertAlmostEqual(float(touched[1]), 40, delta=15)
        self.assertEqual(touched[2:], ['true'])
        # 0.16 m at 0.079 m/s, and half a second before.
        self.assertAlmostEqual(touched_at, 0.5 + 0.16 / 0.0785, delta=0.6)
        self.assertEqual((presses, free), (['presses', 'true'], ['free', 'false']))

    def test_on_a_slope_the_tilt_is_that_of_the_slope(self):
        pitch = math.radians(SLOPE)
        # The middle of a slab whose upper southern edge is on the ground.
        north = 0.25 + math.cos(pitch) + 0.05 * math.sin(pitch)
        up = math.sin(pitch) - 0.05 * math.cos(pitch)
        prints = self.run_rover(CLIMB, RAMP.format(north=north, up=up, pitch=pitch), 9)
        tilts = [tuple(map(float, words[1:])) for _, words in prints]
        level, slope = tilts[0], tilts[-1]
        # On the level its nose hangs down a little, for the ball is smaller than the wheels.
        self.assertAlmostEqual(level[0], -math.degrees(math.asin(0.01 / 0.1)), delta=2.5)
        # Up the slope it is turned about east, the other way.
        self.assertAlmostEqual(slope[0] - level[0], SLOPE, delta=3)
        for east_west, north_south, by_name in (level, slope):
            self.assertAlmostEqual(north_south, 0, delta=3)
            # Its direction is the frame's up.
            self.assertAlmostEqual(by_name, math.hypot(east_west, north_south), delta=1)


if __name__ == '__main__':
    unittest.main()
