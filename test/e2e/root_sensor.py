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

    def poses(self):
        """By (tick, module, link): the bodies of WORLD, and the poses that modules tell."""
        world, told = {}, {}
        for _, _, channel, data in read_events(self.folder / 'x.log'):
            if channel.endswith('/SIM/WORLD'):
                message = decode(data)
                for body in message.bodies:
                    world[message.header.tick, body.module_id, body.link] = body
            elif channel.endswith('/TRANSFORM'):
                message = decode(data)
                for link, pose in enumerate(message.link_poses):
                    told[message.header.tick, message.module_id, link] = pose
        return world, told

    def lift(self):
        """By how much the origin of R stood above that of W when nothing had moved, in m, from a log in which all poses
        have come through by then: they are those of the model."""
        world, told = self.poses()
        lifts = [body.position_m[1] - told[key].position_m[1] for key, body in world.items() if key[0] == 8]
        self.assertLess(max(lifts) - min(lifts), 1e-4)
        return sum(lifts) / len(lifts)

    def disagreements(self, from_tick, lift):
        """Distances (m) and turns (rad), ascending, from that tick on between where modules say that their links are and
        where WORLD has them. What the log lacks is left out."""
        distances, turns = [], []
        world, told = self.poses()
        for key, body in world.items():
            if key[0] < from_tick or key not in told:
                continue
            x, y, z = told[key].position_m
            distances.append(math.dist((x, y + lift, z), body.position_m))
            turns.append(turn_between(told[key].orientation_wxyz, body.orientation_wxyz))
        self.assertGreater(len(distances), 100)
        return sorted(distances), sorted(turns)

    def disagreement(self, from_tick):
        """The largest ones of a log that lacks nothing."""
        world, told = self.poses()
        self.assertLessEqual({key for key in world if key[0] >= from_tick}, set(told))
        distances, turns = self.disagreements(from_tick, self.lift())
        return distances[-1], turns[-1]

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

    def test_in_real_time_poses_follow_the_robot_that_gets_up(self):
        # When it has got up its root is 0.17 m higher than the model has it, and then it walks. Messages are late, so that
        # most poses are looked at and not the worst.
        seconds, standing = 5, 165
        blind = self.run_once('--inproc', seconds=seconds)
        self.assertEqual(blind['problems'], [])
        lift = self.lift()
        distances, _ = self.disagreements(standing, lift)
        self.assertGreater(distances[len(distances) // 10], 0.1)
        rules = self.folder / 'late.faults'
        for text in ('', 'fault channel=*/TRANSFORM late=0.1 by=0.04s\n'):
            with self.subTest(faults=text):
                rules.write_text(text)
                summary = self.run_once('--inproc', '--faults', rules, '--realtime', '--root-sensor', seconds=seconds)
                self.assertEqual(summary['ticks'], seconds * 50)
                self.assertIsNone(summary['error'])
                self.assertTrue(as_json('info', self.folder / 'x.log')['description']['root_sensor'])
                distances, turns = self.disagreements(standing, lift)
                self.assertLess(distances[len(distances) * 9 // 10], 0.03)
                self.assertLess(turns[len(turns) * 9 // 10], math.radians(15))

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
