#!/usr/bin/env python3
"""Every robot of models/ has a program in models/programs/ that moves it as it says there.

Margins are about two thirds of what was measured when the programs were written, so that another version of the
engine passes and a program that no longer does its work fails.
"""
import math
import re
import unittest

from program_case import MODELS, PROGRAMS, TICKS_PER_SECOND, Programs
from support import ROBOTS, SOURCE, Case, as_json, decode, morphbus, read_events

TUTORIAL = (SOURCE / 'docs' / 'tutorial.md').read_text(encoding='utf-8')

# Which program moves which robot; each stands in a test of this folder.
MOVED_BY = {
    ('atron', 'car'): 'car_evade', ('atron', 'car7'): 'car7',
    ('ckbot', 'snake'): 'snake', ('ckbot', 'loop'): 'ckbot_loop',
    ('mixed', 'inchworm'): 'inchworm',
    ('molecube', 'snake'): 'snake', ('molecube', 'arm'): 'arm',
    ('mtran', 'quadruped'): 'quadruped', ('mtran', 'equivalent_quadruped'): 'quadruped',
    ('mtran_robots', 'snake'): 'snake', ('mtran_robots', 'caterpillar'): 'caterpillar',
    ('mtran_robots', 'crawler'): 'crawler',
    ('mtran_robots', 'carrier'): 'carry', ('mtran_robots', 'equivalent_carrier'): 'carry',
    ('smores', 'train'): 'smores_train',
    ('superbot', 'superbot_snake'): 'superbot_snake', ('rofi', 'rofi_snake'): 'rofi_snake',
    ('roombots', 'roombots_snake'): 'roombots_snake', ('dtto', 'dtto_ring'): 'dtto_ring', ('revolve2', 'spider'): 'spider',
    ('mtran_soles', 'sensing_quadruped'): 'quadruped_feeling',
    ('pairs', 'crane'): 'crane', ('pairs', 'tractor'): 'tractor',
    **{('snakes', f'{kind}_snake{n}'): 'snake' for kind in ('mtran', 'ckbot', 'molecube') for n in (4, 8, 16)},
}


class Shipped(Case):
    def test_every_robot_has_a_program_that_compiles_for_its_model(self):
        robots = {(path.stem, robot) for path in MODELS.glob('*.m3l')
                  for robot in re.findall(r'^robot (\w+):', path.read_text(), re.M)}
        self.assertEqual(robots, set(MOVED_BY))

    def test_every_program_is_moved_by_or_tested_elsewhere(self):
        elsewhere = {'quadruped_careful', 'quadruped_tuned'}  # deploy.py, optimise.py
        here = ''.join(path.read_text() for path in (SOURCE / 'test' / 'e2e').glob('programs*.py'))
        for path in PROGRAMS.glob('*.dyn'):
            self.assertTrue(path.stem in elsewhere or f"'{path.stem}'" in here, path)


class Snakes(Programs):
    # In 8 s: millimetres, in which direction (degrees from north to east), and by how much the head has turned to the
    # left (degrees). Molecubes bend in an oblique plane, so that the path of a short snake is curved.
    MEASURED = {
        ('mtran', 4): (269, 0, 0), ('mtran', 8): (360, 0, 0), ('mtran', 16): (425, 0, 0),
        ('ckbot', 4): (162, 0, 0), ('ckbot', 8): (187, 1, 0), ('ckbot', 16): (193, 0, 0),
        ('molecube', 4): (82, -77, 29), ('molecube', 8): (145, -33, 22), ('molecube', 16): (114, -19, 15),
    }
    MODULE_MM = {'mtran': 130, 'ckbot': 60, 'molecube': 100}
    SECONDS = 8

    def crawl(self, kind):
        for count in (4, 8, 16):
            robot = f'{kind}_snake{count}'
            summary = self.run_program('snakes', 'snake', robot, self.SECONDS)
            distance, course, turn = self.MEASURED[kind, count]
            # The head is the root's body.
            north, _, east = summary['root_displacement']
            self.assertGreater(1000 * math.hypot(north, east), distance * 2 / 3, robot)
            self.assertLess(1000 * math.hypot(north, east), distance * 4 / 3, robot)
            self.assertAlmostEqual(self.course(summary), course, delta=10, msg=robot)
            self.assertAlmostEqual(self.turn(summary), turn, delta=10, msg=robot)

    def test_of_mtran_one_program_crawls_with_four_eight_and_sixteen_modules(self):
        self.crawl('mtran')

    def test_of_ckbot_one_program_crawls_with_four_eight_and_sixteen_modules(self):
        self.crawl('ckbot')

    def test_of_molecubes_it_crawls_by_their_diagonals(self):
        self.crawl('molecube')

    def test_the_tutorial_tells_how_fast_per_body_length(self):
        told = {}
        for kind, row in re.findall(r'^\| (M-TRAN|CKBot|Molecube), \d+ mm \|(.*)\|$', TUTORIAL, re.M):
            for count, cell in zip((4, 8, 16), row.split('|')):
                told[kind.replace('-', '').lower(), count] = cell.strip()
        self.assertEqual(told, {
            (kind, count): f'{distance} mm, {distance / self.SECONDS / (count * self.MODULE_MM[kind]):.3f}/s'
            for (kind, count), (distance, _, _) in self.MEASURED.items()})

    def test_one_image_crawls_with_the_snakes_of_other_models(self):
        image = self.folder / 'snake.image'
        morphbus('compile', PROGRAMS / 'snake.dyn', '--model', MODELS / 'snakes.m3l', '-o', image)
        for model in ('mtran_robots', 'ckbot'):
            summary = self.run_program(model, image, 'snake', 6)
            self.assertGreater(summary['displacement'][0], 0.07, model)
            self.assertLess(abs(self.course(summary)), 10, model)
            self.assertLess(abs(self.turn(summary)), 10, model)
        # The head of this one looks south: its root is the southern end.
        summary = self.run_program('molecube', image, 'snake', 6)
        self.assertLess(summary['displacement'][0], -0.01)


class Quadrupeds(Programs):
    """Both robots, which are put together differently and move alike."""

    def steer(self, *told, seconds):
        """Runs that are told to steer so from the first cycle on, or nothing: summaries of both robots."""
        commands = self.folder / 'commands'
        commands.write_text('60 invoke Junction.steer {} {}\n'.format(*told) if told else '')
        return [self.run_program('mtran', 'quadruped_steered', robot, seconds, '--commands', commands)
                for robot in ROBOTS]

    def test_it_turns_left_on_the_spot(self):
        # Measured in two cycles: 46 degrees, 34 mm.
        for summary in self.steer(seconds=17):
            self.assertGreater(self.turn(summary), 28)
            self.assertLess(self.turn(summary), 58)
            self.assertLess(math.hypot(summary['displacement'][0], summary['displacement'][2]), 0.06)

    def test_it_is_told_to_walk_backwards_or_ahead(self):
        # Measured: 106 and 113 mm.
        for way, least in ((-1, 0.07), (1, 0.07)):
            for summary in self.steer(way, way, seconds=12):
                self.assertGreater(way * summary['displacement'][0], least)
                self.assertLess(abs(summary['displacement'][2]), 0.08)
                self.assertLess(abs(self.turn(summary)), 10)

    def test_it_stands_up_after_a_push(self):
        commands = self.folder / 'commands'
        commands.write_text('200 push m5.active_block DOWN 150 2\n')
        for robot in ROBOTS:
            summary = self.run_program('mtran', 'quadruped_upright', robot, 12, '--commands', commands, faults=True)
            # The faults are the stalls by which it learns of the push.
            for fault in summary['faults']:
                self.assertIn('stalled', fault['fault'])
            self.assertIn('pushed down', [p['text'] for p in summary['prints']])
            before, pushed, flat, after = (self.place(5, seconds)[1] for seconds in (3.9, 5.9, 7.9, 11.9))
            self.assertLess(pushed, 0.88 * before)  # measured: from 208 to 161 mm
            self.assertLess(flat, 0.05)
            self.assertAlmostEqual(after, before, delta=0.01)
            # It stands near where it stood, and looks nearly where it looked. Measured: 49 mm, 12 degrees.
            self.assertLess(math.hypot(summary['displacement'][0], summary['displacement'][2]), 0.08)
            self.assertLess(abs(self.turn(summary)), 18)


class Others(Programs):
    def test_closed_loops_roll_north(self):
        for model, program, robot, least in (('mtran_robots', 'caterpillar', 'caterpillar', 0.35),
                                             ('ckbot', 'ckbot_loop', 'loop', 0.2)):
            summary = self.run_program(model, program, robot, 6)
            self.assertGreater(summary['displacement'][0], least, robot)
            # It rolls: the module that was at the bottom is at the top after half a turn or so.
            self.assertGreater(math.degrees(summary['walk']['max_tilt_rad']), 120, robot)
            # Straight on: the axes of its joints, about which it rolls, still lie east and west. Measured: within 3 degrees.
            self.assertLess(abs(self.course(summary)), 5, robot)
            self.assertLess(abs(self.turned_axis(1, 0.5, 5.9)), 8, robot)

    def test_the_crawler_crawls_north(self):
        summary = self.run_program('mtran_robots', 'crawler', 'crawler', 7)
        self.assertGreater(summary['displacement'][0], 0.1)  # measured: 176 mm
        self.assertLess(abs(self.course(summary)), 5)
        self.assertLess(abs(self.turn(summary)), 10)

    def test_the_inchworm_steps_by_its_telescope(self):
        summary = self.run_program('mixed', 'inchworm', 'inchworm', 9)
        self.assertGreater(summary['displacement'][0], 0.025)  # measured: 39 mm in a step
        self.assertLess(abs(self.course(summary)), 8)
        self.assertLess(abs(self.turn(summary)), 5)

    def test_the_arm_raises_its_hand(self):
        self.run_program('molecube', 'arm', 'arm', 6)
        lying, raised = self.place(4, 0.5)[1], self.place(4, 5.5)[1]
        self.assertAlmostEqual(raised - lying, 0.1, delta=0.03)  # one cube higher


class Carriers(Programs):
    """A module lets go, is carried and docks elsewhere, and its role follows from where it hangs."""
    BLOCK = 0.065  # m
    ALWAYS = {('front.c5', 'rear.c2'), ('arm.c5', 'front.c2')}
    ON_ARM, ON_DECK = ('arm.c2', 'load.c5'), ('front.c6', 'load.c2')
    SECONDS = 9

    def carry(self, robot, *more, seconds=SECONDS):
        return self.run_program('mtran_robots', 'carry', robot, seconds, *more)

    def of_the_load(self):
        """[(tick, dockings)] whenever the load's dockings change; those of the others must not. From SENSORS."""
        changes = []
        for _, _, channel, data in read_events(self.log):
            if not channel.endswith('/SIM/SENSORS'):
                continue
            sensors = decode(data)
            names = {m.module_id: m.name for m in sensors.modules}
            now = {tuple(sorted((f'{m.name}.c{d.connector + 1}', f'{names[d.mate_module]}.c{d.mate_connector + 1}')))
                   for m in sensors.modules for d in m.docked}
            self.assertLessEqual(self.ALWAYS, now, sensors.header.tick)
            if not changes or changes[-1][1] != now - self.ALWAYS:
                changes.append((sensors.header.tick, now - self.ALWAYS))
        return changes

    def roles(self, module):
        """[(tick, role)] whenever a module takes another role."""
        changes = []
        for _, _, channel, data in read_events(self.log):
            if channel.endswith(f'/{module}/STATUS'):
                status = decode(data)
                if status.role_name and (not changes or changes[-1][1] != status.role_name):
                    changes.append((status.header.tick, status.role_name))
        return changes

    def assert_changes(self, dockings, roles):
        """The load's dockings and roles, one after the other; each role a few ticks after the docking it rests on."""
        docked, taken = self.of_the_load(), self.roles('load')
        self.assertEqual([held for _, held in docked], dockings)
        self.assertEqual([role for _, role in taken], roles)
        for (changed, _), (tick, role) in zip(docked[1:], taken[1:]):
            # Settling takes 10 ticks, and hearing of it one or two.
            self.assertIn(tick - changed, range(10, 14), role)
        for module, role in (('rear', 'Deck'), ('front', 'Deck'), ('arm', 'Arm')):
            self.assertEqual([other for _, other in self.roles(module)], [role], module)
        return [tick for tick, _ in docked]

    def link(self, number, seconds):
        """Where a link of the load is, seen from the middle of the deck block that it is put on: north, up, east in
        metres; and which way its x axis points, which is from the active to the passive block."""
        for _, _, channel, data in read_events(self.log):
            if channel.endswith('/SIM/WORLD'):
                world = decode(data)
                if world.header.tick == round(seconds * TICKS_PER_SECOND):
                    bodies = {(b.module_id, b.link): b for b in world.bodies}
                    body, deck = bodies[3, number], bodies[0, 0].position_m  # the rear's block, docked to that one
                    w, x, y, z = body.orientation_wxyz
                    place = [p - q - offset for p, q, offset in
                             zip(body.position_m, deck, (1.5 * self.BLOCK, 0, 0))]
                    return place, [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)]
        raise AssertionError(f'no tick at {seconds} s')

    def test_the_tail_becomes_a_fin(self):
        for robot in ('carrier', 'equivalent_carrier'):
            self.carry(robot)
            docked, parted = self.assert_changes([{self.ON_ARM}, {self.ON_ARM, self.ON_DECK}, {self.ON_DECK}],
                                                 ['Tail', 'Bridge', 'Fin'])[1:]
            # `info` says the same. Measured: 2.42 and 2.68 s.
            told = as_json('info', self.log)
            self.assertEqual(
                [(round(d['time'] * TICKS_PER_SECOND), d['docked'], d['connector'], d['mate'])
                 for d in told['dockings']],
                [(docked, True, 'front.c6', 'load.c2'), (parted, False, 'arm.c2', 'load.c5')])
            self.assertEqual(told['num_dockings'], 2)
            self.assertRegex(morphbus('info', self.log).stdout,
                             r'2 changes of connectors:\n  \S+ s front.c6 and load.c2 docked\n')
            self.assertLess(docked, 4 * TICKS_PER_SECOND)
            self.assertLess(parted - docked, 20)
            # The arm is home again, and the fin stands straight up: its bar a block and a half above the deck's block.
            place, upright = self.link(2, self.SECONDS - 0.5)
            for measured, wanted in zip(place, (0, 1.5 * self.BLOCK, 0)):
                self.assertAlmostEqual(measured, wanted, delta=0.003)  # measured: 2 mm as it waves
            self.assertGreater(upright[1], math.cos(math.radians(3)))
            # It waves: its upper block leans to and fro once in two seconds.
            leans = [math.degrees(math.atan2(*self.link(1, 5 + i / 10)[1][:2])) for i in range(30)]
            self.assertGreater(max(leans), 30)
            self.assertLess(min(leans), -30)

    def test_both_robots_move_alike(self):
        logs = []
        for robot in ('carrier', 'equivalent_carrier'):
            self.carry(robot)
            logs.append(self.log)
        morphbus('compare', *logs)

    def test_it_is_told_to_fetch_the_load_and_to_put_it_down_again(self):
        commands = self.folder / 'commands'
        # The second comes when the arm is on its way.
        commands.write_text('400 invoke Arm.carry\n420 invoke Arm.carry\n800 invoke Arm.carry\n')
        clean = self.carry('carrier', '--commands', commands, seconds=22)
        self.assert_changes([{self.ON_ARM}, {self.ON_ARM, self.ON_DECK}, {self.ON_DECK}, {self.ON_ARM, self.ON_DECK},
                             {self.ON_ARM}, {self.ON_ARM, self.ON_DECK}, {self.ON_DECK}],
                            ['Tail', 'Bridge', 'Fin', 'Bridge', 'Tail', 'Bridge', 'Fin'])
        self.assertEqual([p['text'] for p in clean['prints']], ['not now: on the way'])
        # Fetched, it lies where it lay, at the end of the arm.
        for measured, wanted in zip(self.link(2, 15.9)[0], (4.5 * self.BLOCK, 0, 0)):
            self.assertAlmostEqual(measured, wanted, delta=0.005)
        lossy = self.carry('carrier', '--commands', commands, '--loss', 0.3, seconds=22)
        self.assertEqual(lossy['world_hash'], clean['world_hash'])
        self.assertEqual(lossy['hash'], clean['hash'])


if __name__ == '__main__':
    unittest.main()
