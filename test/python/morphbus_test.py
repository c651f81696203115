#!/usr/bin/python3
"""The Python package, against the command line: the same numbers, the same hashes, errors as exceptions."""
import gc
import json
import os
import pathlib
import pickle
import re
import subprocess
import sys
import tempfile
import unittest

BIN, SOURCE = (pathlib.Path(os.environ[name]) for name in ('MORPHBUS_BIN', 'MORPHBUS_SOURCE'))
sys.path.insert(0, str(BIN.parent / 'python'))

import numpy

import morphbus
from morphbus import env

MODEL = str(SOURCE / 'models/mtran.m3l')
PROGRAM = str(SOURCE / 'models/programs/quadruped.dyn')


def as_json(*arguments):
    return json.loads(subprocess.run([BIN / 'morphbus', *map(str, arguments), '--json'], check=True, capture_output=True).stdout)


class WithRobot(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.model = morphbus.Model(MODEL)
        cls.robot = cls.model.robot('quadruped')
        cls.program = morphbus.Program(PROGRAM, cls.model)


class Models(WithRobot):
    def test_poses_are_those_of_the_command_line_to_the_bit(self):
        q = self.robot.start_values()
        q[self.robot.find_joint('m1.joint_1')] = 0.3
        poses = self.robot.fk(q)
        links = as_json('fk', MODEL, '--robot', 'quadruped', '--set', 'm1.joint_1=0.3')['links']
        self.assertEqual([link.name for link in self.robot.links], list(links))
        self.assertEqual(poses.position.tolist(), [pose['p'] for pose in links.values()])
        self.assertEqual(poses.rotation.tolist(), [pose['q'] for pose in links.values()])
        self.assertEqual(poses.matrix.shape, (27, 4, 4))
        numpy.testing.assert_array_equal(poses.matrix[:, :3, 3], poses.position)

    def test_the_jacobian_is_that_of_the_command_line(self):
        jacobian = self.robot.jacobian('m1.active_block')
        columns = as_json('fk', MODEL, '--robot', 'quadruped', '--jacobian', 'm1.active_block')['jacobian']['joints']
        numpy.testing.assert_array_equal(jacobian.T, list(columns.values()))

    def test_errors_carry_their_places(self):
        with self.assertRaises(morphbus.TextError) as raised:
            morphbus.Model.from_text('module M:\n  unit=1\n  pont a: coords=(0, 0, 0)\n', name='bad.m3l')
        self.assertIsInstance(raised.exception, morphbus.Failure)
        self.assertIn('bad.m3l:3:3: error:', str(raised.exception))
        where = [diagnostic.where for diagnostic in raised.exception.diagnostics]
        self.assertIn(('bad.m3l', 3, 3), [(place.file, place.line, place.column) for place in where])
        with self.assertRaisesRegex(morphbus.Failure, "did you mean 'quadruped'"):
            self.model.robot('quadrupet')
        with self.assertRaisesRegex(morphbus.Failure, 'has 18 joints, and here are 2 values'):
            self.robot.fk([0, 1])

    def test_a_file_is_checked_without_an_exception(self):
        self.assertEqual(morphbus.check(MODEL), [])
        with tempfile.NamedTemporaryFile('w', suffix='.m3l') as file:
            file.write('module M: unit=1\npont a: coords=(0, 0, 0)\n')
            file.flush()
            found = morphbus.check(file.name)
        self.assertTrue(all(diagnostic.is_error for diagnostic in found))
        self.assertIn((file.name, 2, 1), [(one.where.file, one.where.line, one.where.column) for one in found])

    def test_congruent_robots_are_found(self):
        answer = self.robot.compare(self.model.robot('equivalent_quadruped'))
        self.assertTrue(answer)
        self.assertTrue(answer.keeps_frame)
        variant = self.robot.variants(2, seed=7)[1]
        self.assertTrue(self.robot.compare(variant).congruent)
        self.assertEqual({robot.congruence_hash() for robot in (self.robot, variant, self.model.robot('equivalent_quadruped'))},
                         {int(as_json('graph', MODEL, '--robot', 'quadruped')['congruence_hash'], 16)})
        graph = self.robot.graph()
        self.assertEqual(graph.mobility, as_json('graph', MODEL, '--robot', 'quadruped')['mobility'])

    def test_models_and_programs_can_be_pickled_and_robots_shown(self):
        self.assertEqual(pickle.loads(pickle.dumps(self.model)).hash, self.model.hash)
        self.assertEqual(pickle.loads(pickle.dumps(self.program)).hash, self.program.hash)
        self.assertIn('<svg', self.robot._repr_svg_())
        self.assertIn('<svg', self.robot.draw(['side', 'top']))
        with self.assertRaisesRegex(morphbus.Failure, 'expected side, top'):
            self.robot.draw(['below'])

    def test_programs_tell_roles_and_parameters(self):
        tuned = morphbus.Program(str(SOURCE / 'models/programs/quadruped_tuned.dyn'), self.model)
        parameter = tuned.parameters[0]
        changed = tuned.with_parameter(parameter.name, parameter.least)
        self.assertNotEqual(changed.hash, tuned.hash)
        self.assertEqual(changed.parameters[0].value, parameter.least)
        self.assertIn('FrontLeftUpperHalf', [role.name for role in self.program.roles])
        with self.assertRaises(morphbus.Failure):
            tuned.with_parameter(parameter.name, parameter.most + 1)
        with self.assertRaises(morphbus.TextError):
            morphbus.Program.from_text('role {', self.model)


class Stubs(unittest.TestCase):
    def test_the_stubs_name_all_that_there_is(self):
        """Every public name of the compiled part stands in _core.pyi, and has a text that help() shows."""
        import ast
        tree = ast.parse((pathlib.Path(morphbus.__file__).parent / '_core.pyi').read_text())
        told = {node.name: node for node in tree.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
        names = {name for name in dir(morphbus._core) if not name.startswith('_')}
        self.assertEqual(names, set(told))
        for name, node in told.items():
            if not isinstance(node, ast.ClassDef):
                continue
            members = {m.name for m in node.body if isinstance(m, (ast.FunctionDef, ast.ClassDef))}
            members |= {m.target.id for m in node.body if isinstance(m, ast.AnnAssign)}
            members |= {target.id for m in node.body if isinstance(m, ast.Assign) for target in m.targets}
            there = {member for member in vars(getattr(morphbus._core, name)) if not member.startswith('_')}
            self.assertEqual(there - {'name', 'value', 'diagnostics'}, {m for m in members if not m.startswith('_')} - {'name', 'value', 'diagnostics'},
                             name)
        for name in ('Model', 'Robot', 'Program', 'Run', 'Batch', 'Log'):
            self.assertTrue(getattr(morphbus, name).__doc__, name)


class Runs(WithRobot):
    def run_for(self, seconds, ticks=10, **options):
        with morphbus.Run(self.robot, self.program, seconds=seconds, **options) as run:
            while not run.over:
                run.step(ticks)
            return run.close()

    def test_a_run_has_the_hash_of_the_command_line(self):
        ran = as_json('run', MODEL, PROGRAM, '--robot', 'quadruped', '--inproc', '--no-log', '--seconds', 3)
        self.assertEqual(morphbus.arithmetic_fingerprint(), ran['arithmetic'])
        self.assertEqual(self.run_for(3).hash, ran['hash'])
        self.assertEqual(self.run_for(3, ticks=1).hash, ran['hash'])

    def test_the_engine_calls_the_librarys_own_functions(self):
        """The bits of libm may be the same here and not elsewhere: what counts is who is called."""
        environment = {**os.environ, 'LD_BIND_NOW': '1', 'LD_DEBUG': 'bindings', 'PYTHONPATH': str(BIN.parent / 'python')}
        told = subprocess.run([sys.executable, '-c', 'import morphbus'], env=environment, capture_output=True, text=True, check=True).stderr
        found = {(pathlib.Path(definer).name.split('.')[0], symbol) for definer, symbol in
                 re.findall(r"binding file \S*libBullet\S+ \[\d+\] to (\S+) \[\d+\]: normal symbol `(\w+)'", told)}
        for symbol in ('sin', 'cos', 'sincos', 'atan2', 'pow'):
            self.assertIn(('libmorphbus-run', symbol), found)
            self.assertNotIn(('libm', symbol), found)

    def test_a_batch_is_the_same_for_any_number_of_threads(self):
        robots = [self.robot, self.model.robot('equivalent_quadruped'), *self.robot.variants(2)]

        def hashes(threads):
            batch = morphbus.Batch([morphbus.Run(robot, self.program, seconds=1) for robot in robots], threads=threads)
            while not batch.over:
                batch.step(10)
            return [result.hash for result in batch.close()]
        self.assertEqual(hashes(1), hashes(2))
        self.assertEqual(len(set(hashes(2))), len(robots))

    def test_it_shows_and_takes_what_it_is_told(self):
        run = morphbus.Run(self.robot, self.program, still=True)
        joint = self.robot.find_joint('m1.joint_1')
        run.drive(joint, 0.4, 1.0)
        run.step(60)
        seen = run.observe()
        self.assertAlmostEqual(seen.position[joint], 0.4)
        self.assertEqual(seen.position.shape, (18,))
        self.assertEqual(seen.link_position.shape, (27, 3))
        self.assertEqual(len(seen.roles), 9)
        with self.assertRaises(morphbus.Failure):
            run.command('dance')
        self.assertEqual(run.close().error, '')
        self.assertEqual(morphbus.summary(run)['hash'], run.close().hash)

    def test_a_hill_climber_of_thirty_lines_improves_the_worm(self):
        model = morphbus.Model(str(SOURCE / 'models/mtran_robots.m3l'))
        program = morphbus.Program(str(SOURCE / 'models/programs/caterpillar.dyn'), model)
        robot = model.robot('caterpillar')
        parameters = {p.name: p for p in program.parameters}

        def advance(values):
            changed = program
            for name, value in values.items():
                changed = changed.with_parameter(name, value)
            run = morphbus.Run(robot, changed, seconds=4)
            before = run.observe().link_position[0]
            run.step(200)
            after = run.observe().link_position[0]
            return float(numpy.hypot(after[0] - before[0], after[2] - before[2]))

        random = numpy.random.default_rng(1)
        best = {name: p.value for name, p in parameters.items()}
        start = score = advance(best)
        for _ in range(12):
            tried = {}
            for name, p in parameters.items():
                value = float(numpy.clip(best[name] + 0.2 * (p.most - p.least) * random.normal(), p.least, p.most))
                tried[name] = float(round(value)) if p.is_int else value
            found = advance(tried)
            if found > score:
                best, score = tried, found
        self.assertGreater(score, start)

    def test_nothing_is_left_of_runs_that_are_gone(self):
        def resident():
            gc.collect()
            return int(pathlib.Path('/proc/self/statm').read_text().split()[1])
        walk = env.WalkEnv(self.robot, self.program, still=True)
        for _ in range(20):
            walk.reset(seed=1)
        before = resident()
        for _ in range(100):
            walk.reset(seed=1)
        self.assertLess(resident() - before, 500, 'pages of 4 KiB')


class Logs(WithRobot):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.path = os.path.join(cls.folder.name, 'walk.log')
        run = morphbus.Run(cls.robot, cls.program, seconds=4, log=cls.path)
        run.step(1000)
        run.close()
        cls.log = morphbus.Log(cls.path)

    def test_series_are_those_of_the_log(self):
        self.assertEqual(morphbus.info(self.log), as_json('info', self.path))
        series = self.log.joint('m1.joint_1')
        self.assertEqual(series.position.shape, series.time_s.shape)
        self.assertEqual(series.position.dtype, numpy.float64)
        (hip,) = self.log.joints_labelled('FrontLeftUpperHalf', 'hip')
        self.assertLess(len(hip.time_s), len(series.time_s))
        self.assertEqual(self.log.pose('m1.active_block').position.shape[1], 3)
        self.assertEqual(self.log.believed_pose('m1.active_block').rotation.shape[1], 4)
        self.assertEqual(self.log.roles('m1')[-1].role, as_json('run', MODEL, PROGRAM, '--robot', 'quadruped', '--inproc', '--no-log',
                                                                '--seconds', 4)['roles']['m1'])
        self.assertTrue(self.log.whole)
        with self.assertRaisesRegex(morphbus.Failure, "did you mean 'm1.joint_1'"):
            self.log.joint('m1.joint_l')

    def test_logs_are_compared_and_drawn(self):
        comparison = morphbus.compare(self.log, self.log)
        self.assertEqual(comparison.verdict, morphbus.Verdict.equivalent)
        self.assertIn('equivalent', str(comparison))
        self.assertIn('<svg', self.log.draw(1.0))
        self.assertEqual(self.log.draw_video(fps=5, to_s=0.4)[:4], b'RIFF')
        self.assertIn('<html', self.log.report_html())


class Environments(WithRobot):
    def test_it_is_used_as_gymnasiums_are(self):
        walk = env.WalkEnv(self.robot, self.program, seconds=0.5)
        seen, told = walk.reset(seed=3)
        self.assertTrue(walk.observation_space.contains(seen))
        self.assertEqual(told, {'tick': 0})
        action = walk.action_space.sample()
        self.assertTrue(walk.action_space.contains(action))
        rewards = []
        for _ in range(5):
            seen, reward, terminated, truncated, told = walk.step(action)
            self.assertFalse(terminated)
            rewards.append(reward)
        self.assertTrue(truncated)
        # The same seed, the same episode.
        walk.reset(seed=3)
        numpy.testing.assert_array_equal(walk.action_space.sample(), action)
        self.assertEqual([walk.step(action)[1] for _ in range(5)], rewards)
        walk.close()

    def test_modules_can_be_agents(self):
        modules = env.ModulesEnv(self.robot, self.program, seconds=0.2)
        seen, _ = modules.reset(seed=1)
        self.assertEqual(list(seen), modules.agents)
        self.assertEqual(seen['m1'].shape, (4,))
        actions = {agent: modules.action_space(agent).sample() for agent in modules.agents}
        modules.step(actions)
        seen, rewards, terminated, truncated, _ = modules.step(actions)
        self.assertTrue(all(truncated.values()))
        self.assertEqual(len(set(rewards.values())), 1)
        self.assertEqual(modules.agents, [])
        modules.close()


if __name__ == '__main__':
    unittest.main()
