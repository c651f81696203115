#!/usr/bin/env python3
"""What programs print and draw, from the language to the summary: the same in one process, in many, and whatever is lost."""
import unittest

from support import MODEL, Case, as_json, morphbus

PROGRAM = '''// Every module draws, prints and tells its southern neighbour.
role Talker extends Module {
  shared drawn = 0.0;
  heard = 0;
  label turned = self.JOINT_1;
  startup s() {
    print("begins at", self.ms, "with", self.connected, "neighbours, turns", turned);
  }
  handler draw() every 0.5 {
    drawn = random(-10, 10);
    self.jointSetDegreesNonBlocking(turned, drawn);
    self.connected($SOUTH, $Talker).hear(1);
  }
  command hear(int n) {
    heard += n;
    if (heard % 2 == 0) print("heard", heard, "times");
  }
}
'''


class Language(Case):
    def setUp(self):
        super().setUp()
        self.program = self.folder / 'talk.dyn'
        self.program.write_text(PROGRAM)
        self.log = self.folder / 'talk.log'

    def run_once(self, *options):
        return as_json('run', MODEL, self.program, '--robot', 'quadruped', '--seconds', 2, '--still', '--run', 'talk',
                       '--force', '--log', self.log, *options)

    def test_prints_and_draws_are_the_same_however_the_run_is_spread(self):
        alone = self.run_once('--inproc')
        self.assertEqual(alone['num_faults'], 0)
        self.assertEqual(alone['num_prints'], len(alone['prints']))
        begun = [p for p in alone['prints'] if p['text'].startswith('begins at')]
        self.assertEqual({p['module'] for p in begun}, {f'm{i}' for i in range(1, 10)})
        for p in begun:
            # The root's time and the joint by its name; the hub of the quadruped has four neighbours.
            self.assertRegex(p['text'], r'^begins at \d+ with [1-4] neighbours, turns joint_1$')
            self.assertEqual((p['role'], p['line']), ('Talker', 7))
            self.assertAlmostEqual(p['time'] * 1000, int(p['text'].split()[2]), delta=0.5)
        self.assertTrue(any(p['text'].startswith('heard') for p in alone['prints']))
        info = as_json('info', self.log)
        self.assertEqual(info['prints'], alone['prints'])
        for options in (['--isolate', '--processes', 3], ['--isolate', '--loss', 0.2]):
            with self.subTest(options=options):
                spread = self.run_once(*options)
                self.assertEqual((spread['hash'], spread['prints']), (alone['hash'], alone['prints']))

    def test_the_seed_of_a_run_decides_what_is_drawn(self):
        first = self.run_once('--inproc')['hash']
        self.assertEqual(self.run_once('--inproc', '--random-seed', 1)['hash'], first)
        self.assertNotEqual(self.run_once('--inproc', '--random-seed', 2)['hash'], first)
        # A process is told the seed, too.
        second = self.run_once('--inproc', '--random-seed', 2)['hash']
        self.assertEqual(self.run_once('--isolate', '--processes', 2, '--random-seed', 2)['hash'], second)

    def test_the_summary_shows_the_lines(self):
        text = morphbus('run', MODEL, self.program, '--robot', 'quadruped', '--seconds', 1, '--still', '--inproc', '--force',
                        '--log', self.log).stdout
        self.assertRegex(text, r'\d+ lines printed\n')
        self.assertRegex(text, r'm1 \(Talker\): .*talk.dyn:7: begins at \d+ with')
        self.assertRegex(morphbus('info', self.log).stdout, r'talk.dyn:7: begins at')


if __name__ == '__main__':
    unittest.main()
