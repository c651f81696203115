#!/usr/bin/env python3
"""Ten other bodies that the quadruped could have: the unchanged program image walks in each of them."""
import unittest

from support import MODEL, PROGRAM, Case, as_json, morphbus

SECONDS = 20  # standing up and two gait cycles
COUNT = 10


class Variants(Case):
    def test_one_image_walks_alike_in_ten_sampled_bodies(self):
        image = self.folder / 'quadruped.image'
        model = self.folder / 'variants.m3l'
        morphbus('compile', PROGRAM, '--model', MODEL, '-o', image)
        morphbus('variants', MODEL, '--robot', 'quadruped', '--max', COUNT, '--seed', 1, '-o', model)

        def run(robot):
            log = self.folder / f'{robot}.log'
            summary = as_json('run', model, image, '--robot', robot, '--seconds', SECONDS, '--inproc', '--log', log)
            self.assertEqual(summary['faults'], [], robot)
            return log, summary

        usual_log, usual = run('quadruped')
        for i in range(1, COUNT + 1):
            robot = f'quadruped_variant_{i}'
            log, summary = run(robot)
            self.assertEqual(summary['program_hash'], usual['program_hash'])
            # Left and right are the robot frame's, which variants keep.
            self.assertEqual(summary['roles'], usual['roles'], robot)
            verdict = as_json('compare', usual_log, log)
            self.assertEqual(verdict['verdict'], 'equivalent', robot)
            self.assertIsNone(verdict['first_divergence'], robot)
            log.unlink()


if __name__ == '__main__':
    unittest.main()
