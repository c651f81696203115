#!/usr/bin/env python3
"""What the physics engine cannot compute: refused before the run, or the end of it."""
import re
import unittest

from support import MODEL, PROGRAM, Case, as_json, morphbus

WORLD = '''<sdf version="1.9"><world name="w"><model name="wall"><static>true</static><pose>{pose} 0 0 0</pose><link name="link">
<collision name="box"><geometry><box><size>{size}</size></box></geometry></collision></link></model></world></sdf>'''


class Engine(Case):
    def run_model(self, text, *more, status):
        model = self.folder / 'model.m3l'
        model.write_text(text)
        return morphbus('run', model, PROGRAM, '--robot', 'quadruped', '--seconds', 0.5, '--inproc', '--force',
                        '--log', self.folder / 'x.log', *more, status=status)

    def test_lengths_that_the_engine_cannot_bear_are_refused_by_name(self):
        source = MODEL.read_text()
        for unit, least in (('1e-7', '0.001 m at least'), ('1e-6', '0.001 m at least'), ('4e5', r'2.5e\+05 m at most')):
            text = source.replace('unit=0.0325', f'unit={unit}')
            self.assertNotEqual(text, source)
            done = self.run_model(text, status=2)
            self.assertRegex(done.stderr, rf"link \w+ of (MTRAN|m\d) .* {least}; change its 'hull=', or 'unit='")
        # What is said to be enough is enough.
        for unit in ('0.0006', '5e4'):
            self.run_model(source.replace('unit=0.0325', f'unit={unit}'), status=0)

    def test_a_robot_inside_an_obstacle_does_not_start(self):
        world = self.folder / 'wall.sdf'
        start = ['run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 0.1, '--inproc', '--force',
                 '--log', self.folder / 'x.log', '--world', world]
        world.write_text(WORLD.format(pose='0.1 0 0.1', size='0.1 1.2 0.2'))
        done = morphbus(*start, status=2)
        said = re.search(r'inside an obstacle: (\w+)\.\w+ \(and \d+ more links\) lies 0\.\d+ m deep in wall\.link\.box: '
                         r'move that (\S+) m north \(\+x in its file\)', done.stderr)
        self.assertTrue(said, done.stderr)
        # The way out is one.
        world.write_text(WORLD.format(pose=f'{0.1 + float(said[2])} 0 0.1', size='0.1 1.2 0.2'))
        morphbus(*start, status=1)
        # A floor that touches the ground is none to start in, one that lies 5 mm higher is.
        world.write_text(WORLD.format(pose='0 0 -0.05', size='2 2 0.1'))
        morphbus(*start, status=1)
        world.write_text(WORLD.format(pose='0 0 -0.045', size='2 2 0.1'))
        self.assertIn('down (-z in its file)', morphbus(*start, status=2).stderr)

    def test_a_joint_far_beyond_its_limit_ends_the_run(self):
        text = MODEL.read_text().replace('mass=0.06', 'mass=1e9')
        done = self.run_model(text, '--json', status=3)
        pattern = (r"the simulation broke down: m\d\.joint_\d is at -?[\d.]+ degrees, [\d.]+ beyond its limit; "
                   r"bodies weigh 0\.18 to 1e\+09 kg: bring 'mass=' nearer together \(tick \d+\)")
        self.assertRegex(done.stderr, 'error: ' + pattern)
        # END tells the same.
        info = as_json('info', self.folder / 'x.log')
        self.assertFalse(info['clean'])
        self.assertRegex(info['reason'], pattern)


if __name__ == '__main__':
    unittest.main()
