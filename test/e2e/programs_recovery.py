#!/usr/bin/env python3
"""The programs of docs/algorithms.md that go by what they sense: a train that drives on after it was tipped over, and a walk by
tilt and contact. Each is held against itself without what it senses."""
import unittest

from program_case import MODELS, Programs, rotated


class Recovery(Programs):
    # Two of four left wheels are lifted for 0.4 s, as docs/algorithms.md has it. The train comes to rest on its side.
    TIP = '150 push m2.left_wheel UP 14 0.4\n150 push m3.left_wheel UP 14 0.4\n'

    def tipped(self, recovers):
        """Metres that the train came between 8 s and 15 s, and the modules that lie on their sides at either time."""
        commands = self.folder / 'tip'
        commands.write_text(self.TIP)
        self.said = self.run_program('smores', 'smores_recover', 'train', 16, '--commands', commands, '--set', f'recovers={recovers}')['prints']
        begun, ended = (self.place(2, seconds) for seconds in (8, 15))
        return sum((b - a) ** 2 for a, b in zip(begun, ended)) ** 0.5, [self.on_their_sides(seconds) for seconds in (8, 15)]

    def on_their_sides(self, seconds):
        """The modules whose own up (y) lies nearer to level than to upright."""
        bodies = ((module, self.bodies(module, seconds)[0].orientation_wxyz) for module in range(1, 5))
        return [module for module, orientation in bodies if abs(rotated(orientation, (0, 1, 0))[1]) < 0.7]

    def test_a_train_on_its_side_turns_its_halves_and_drives_on(self):
        came, lying = self.tipped(1)
        self.assertEqual(lying, [[], []])
        # Measured 1.01 m.
        self.assertGreater(came, 0.65)
        # It was on its side before: only then is there anything to turn.
        self.assertEqual({line['text'] for line in self.said}, {'on its side: turns its halves against each other'})

    def test_without_that_it_stays_where_it_lies(self):
        came, lying = self.tipped(0)
        self.assertEqual(lying, [[1, 2, 3, 4], [1, 2, 3, 4]])
        # Measured 0.02 m.
        self.assertLess(came, 0.1)


class Feeling(Programs):
    SECONDS = 60
    OPEN_LOOP = ('--set', 'feel=0', '--set', 'lean=0')

    def climbed(self, *options):
        """Metres to the north up a slope of 10 degrees that begins half a metre ahead, and so not far from the robot's feet."""
        world = self.folder / 'slope.sdf'
        text = (MODELS / 'benchmark' / 'slope.sdf').read_text()
        nearer = text.replace('<pose degrees="true">3.9631 ', '<pose degrees="true">3.4631 ')
        self.assertNotEqual(nearer, text)
        world.write_text(nearer)
        return self.run_program('mtran_soles', 'quadruped_feeling', 'sensing_quadruped', self.SECONDS, '--world', world, *options,
                                faults=True)['displacement']

    def test_up_a_slope_it_comes_farther_by_tilt_and_contact_than_without(self):
        north, up, _ = self.climbed()
        # Measured 1.58 m, and 0.28 m up.
        self.assertGreater(north, 1.3)
        self.assertGreater(up, 0.2)
        north, _, _ = self.climbed(*self.OPEN_LOOP)
        # Measured 0.92 m.
        self.assertLess(north, 1.1)

    def test_on_level_ground_it_walks_straight(self):
        summary = self.run_program('mtran_soles', 'quadruped_feeling', 'sensing_quadruped', 10)
        self.assertGreater(summary['displacement'][0], 0.2)
        self.assertLess(abs(self.course(summary)), 15)


if __name__ == '__main__':
    unittest.main()
