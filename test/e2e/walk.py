#!/usr/bin/env python3
"""Both robots of the paper walk, by the same image, from the logs that record.py made."""
import json
import math
import unittest

from support import ROBOTS, SCRATCH, Case, as_json, decode, read_events

ROLES = {
    'quadruped': {
        'm1': 'FrontLeftLowerHalf', 'm2': 'FrontLeftUpperHalf', 'm3': 'BackLeftUpperHalf', 'm4': 'BackLeftLowerHalf',
        'm5': 'Junction', 'm6': 'FrontRightLowerHalf', 'm7': 'FrontRightUpperHalf', 'm8': 'BackRightUpperHalf',
        'm9': 'BackRightLowerHalf'},
    'equivalent_quadruped': {
        'm1': 'FrontRightLowerHalf', 'm2': 'FrontRightUpperHalf', 'm3': 'BackRightUpperHalf',
        'm4': 'BackRightLowerHalf', 'm5': 'Junction', 'm6': 'FrontLeftLowerHalf', 'm7': 'FrontLeftUpperHalf',
        'm8': 'BackLeftUpperHalf', 'm9': 'BackLeftLowerHalf'},
}


class Walk(Case):
    def summary(self, robot):
        return json.loads((SCRATCH / f'{robot}.json').read_text())

    def test_every_cycle_goes_at_least_70_mm_north(self):
        for robot in ROBOTS:
            cycles = self.summary(robot)['walk']['cycle_north_m']
            self.assertGreaterEqual(len(cycles), 5, robot)
            for north in cycles[:5]:
                self.assertGreaterEqual(north, 0.070, f'{robot}: {cycles}')
                self.assertLessEqual(north, 0.0925, f'{robot}: further than its legs reach: {cycles}')

    def test_it_turns_less_than_10_degrees_in_five_cycles(self):
        for robot in ROBOTS:
            turns = self.summary(robot)['walk']['cycle_turn_rad'][:5]
            self.assertLess(abs(math.degrees(sum(turns))), 10, f'{robot}: {turns}')

    def test_it_does_not_fall(self):
        for robot in ROBOTS:
            walk = self.summary(robot)['walk']
            self.assertLess(math.degrees(walk['max_tilt_rad']), 30, robot)

    def test_roles_are_those_of_the_paper(self):
        for robot in ROBOTS:
            self.assertEqual(self.summary(robot)['roles'], ROLES[robot])

    def test_nothing_is_lost(self):
        for robot in ROBOTS:
            facts = as_json('verify', self.log(f'{robot}.log'))
            self.assertEqual(facts['end'], 'verified', facts)
            self.assertEqual(facts['lost'], 0)

    def test_to_the_engine_the_robots_are_the_same_problem(self):
        self.assertEqual(*(self.summary(robot)['world_hash'] for robot in ROBOTS))

    def test_joints_stay_within_their_limits(self):
        for robot in ROBOTS:
            for _, _, channel, data in read_events(self.log(f'{robot}.log')):
                if not channel.endswith('/SIM/SENSORS'):
                    continue
                for module in decode(data).modules:
                    for angle in module.joint_position_si:
                        self.assertLessEqual(abs(angle), math.pi / 2 + math.radians(2), (robot, module.name))


if __name__ == '__main__':
    unittest.main()
