#!/usr/bin/env python3
"""`run --root-sensor`: the modules' poses follow the robot that walks, since its root measures where it is."""
import math
import unittest

from support import MODEL, PROGRAM, Case, as_json, decode, morphbus, read_events


def turn_between(a, b):
    """Angle between two unit quaternions, rad."""
    return 2 * math.acos(min(1.0, abs(sum(x * y for x, y in zip(a, b)))))


class RootSensor(Case):
    def run_once(self, *options, seconds=2):
        return as_json('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', seconds, '--force', '--log',
                       self.folder / 'x.log', *options)

    def disagreement(self, from_tick):
        """The largest distance (m) and turn (rad) from that tick on between where modules say that their links
        are and where WORLD has them, as W stands above R at tick 0."""
        world, told, lift = {}, {}, None
        for _, _, channel, data in read_events(self.folder / 'x.log'):
            if channel.endswith('/SIM/WORLD'):
                message = decode(data)
                for body in message.bodies:
                    world[message.header.tick, body.module_id, body.link] = body
            elif channel.endswith('/TRANSFORM'):
                message = decode(data)
                for link, pose in enumerate(message.link_poses):
                    told[message.header.tick, message.module_id, link] = pose
        distance = turn = 0
        # Before anything has moved, poses that have come through are those of the model.
        lifts = [body.position_m[1] - told[key].position_m[1] for key, body in world.items() if key[0] == 8]
        lift = sum(lifts) / len(lifts)
        self.assertLess(max(lifts) - min(lifts), 1e-4)
        compared = 0
        for key, body in world.items():
            if key[0] < from_tick:
                continue
            pose = told[key]
            p = (pose.position_m[0], pose.position_m[1] + lift, pose.position_m[2])
            distance = max(distance, math.dist(p, body.position_m))
            turn = max(turn, turn_between(pose.orientation_wxyz, body.orientation_wxyz))
            compared += 1
        self.assertGreater(compared, 100)
        return distance, turn

    def test_poses_follow_the_walk(self):
        # 17 s are two gait cycles, 0.17 m; a pose is as many ticks old as the module is hops away.
        walked = self.run_once('--inproc', '--root-sensor', seconds=17)
        self.assertEqual(walked['problems'], [])
        distance, turn = self.disagreement(100)
        self.assertLess(distance, 0.03)
        self.assertLess(turn, math.radians(15))
        # What the model says of the root is wrong by as much as the robot has walked.
        still = self.run_once('--inproc', seconds=17)
        distance, turn = self.disagreement(840)
        self.assertGreater(distance, 0.1)
        # The walk itself is alike: roles rest on directions, not on places.
        self.assertEqual(still['roles'], walked['roles'])
        self.assertAlmostEqual(still['displacement'][0], walked['displacement'][0], delta=0.02)

    def test_one_hash_however_the_run_is_spread(self):
        plain = self.run_once('--inproc')['hash']
        sensed = self.run_once('--inproc', '--root-sensor')['hash']
        self.assertNotEqual(sensed, plain)
        self.assertEqual(self.run_once('--isolate', '--root-sensor', '--loss', 0.1)['hash'], sensed)
        noisy = self.run_once('--inproc', '--root-sensor', '--root-noise', '0.002,0.005')
        self.assertNotEqual(noisy['hash'], sensed)
        self.assertEqual(self.run_once('--isolate', '--processes', 3, '--root-sensor', '--root-noise', '0.002,0.005')['hash'],
                         noisy['hash'])
        other = self.run_once('--inproc', '--root-sensor', '--root-noise', '0.002,0.005', '--noise-seed', 2)
        self.assertNotEqual(other['hash'], noisy['hash'])
        info = as_json('info', self.folder / 'x.log')['description']
        self.assertEqual((info['root_sensor'], info['root_noise_m'], info['root_noise_rad']), (True, 0.002, 0.005))

    def test_another_root_has_the_sensor_then(self):
        summary = self.run_once('--inproc', '--root-sensor', '--root', 'm1', seconds=4)
        self.assertEqual(summary['problems'], [])
        distance, _ = self.disagreement(150)
        self.assertLess(distance, 0.03)

    def test_options_that_make_no_sense_are_refused(self):
        for options, said in ((('--root-noise', '0.1,0.1'), 'add --root-sensor'),
                              (('--root-sensor', '--still'), 'which nothing has under --still'),
                              (('--root-sensor', '--root-noise', '0.1'), '0.002,0.01'),
                              (('--root-sensor', '--root-noise', 'nan,0'), '0.002,0.01'),
                              (('--root-sensor', '--root-noise', '0.1,2'), '0.002,0.01')):
            with self.subTest(options=options):
                done = morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 1, *options, status=2,
                                cwd=self.folder)
                self.assertIn(said, done.stderr)


if __name__ == '__main__':
    unittest.main()
