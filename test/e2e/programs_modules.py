#!/usr/bin/env python3
"""The programs of the modules that others have built (SuperBot, RoFI, Roombots, Dtto, Revolve2), and of robots of modules of two makers,
move them as they say.

Margins are about two thirds of what was measured when the programs were written, as in programs.py.
"""
import unittest

from program_case import Programs


class Modules(Programs):
    SECONDS = 8
    # In that time: metres to the north, and what program does it.
    MEASURED = {
        ('superbot', 'superbot_snake'): ('superbot_snake', 0.300),
        ('rofi', 'rofi_snake'): ('rofi_snake', 0.406),
        ('roombots', 'roombots_snake'): ('roombots_snake', 0.067),
        ('dtto', 'dtto_ring'): ('dtto_ring', 0.761),
        ('revolve2', 'spider'): ('spider', 0.653),
        ('pairs', 'crane'): ('crane', 0.180),
        ('pairs', 'tractor'): ('tractor', 0.634),
    }

    def moves(self, model, robot):
        program, metres = self.MEASURED[model, robot]
        summary = self.run_program(model, program, robot, self.SECONDS)
        self.assertGreater(summary['root_displacement'][0], metres * 2 / 3, robot)
        self.assertLess(summary['root_displacement'][0], metres * 4 / 3, robot)
        return summary

    def test_six_superbots_crawl_straight_by_their_pitch_joints(self):
        self.assertLess(abs(self.course(self.moves('superbot', 'superbot_snake'))), 10)

    def test_four_rofis_crawl_straight_by_their_shoes(self):
        self.assertLess(abs(self.course(self.moves('rofi', 'rofi_snake'))), 10)

    def test_three_roombots_crawl_by_their_diagonals(self):
        self.moves('roombots', 'roombots_snake')

    def test_a_ring_of_three_dttos_rolls(self):
        self.assertLess(abs(self.course(self.moves('dtto', 'dtto_ring'))), 10)

    def test_the_spider_rows_straight(self):
        self.assertLess(abs(self.course(self.moves('revolve2', 'spider'))), 10)

    def test_a_car_of_atrons_drives_and_moves_its_arm_of_mtrans(self):
        self.moves('pairs', 'crane')

    def test_a_smores_pulls_ckbots(self):
        self.moves('pairs', 'tractor')


if __name__ == '__main__':
    unittest.main()
