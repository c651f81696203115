#!/usr/bin/env python3
"""Behaviors and startups that a fault has ended: the fault says so, and run and info count them."""
import re
import unittest

from support import MODEL, Case, as_json, morphbus

# The hub of the quadruped has four neighbours: it dies in its startup; of the others one behavior dies in a function.
PROGRAM = """abstract role Part extends Module {
  zero = 0;
  function divide() { zero = 1 / zero; }
}
role Hub extends Part {
  require sizeof(self.connected) == 4;
  startup begin() { self.sleepds(1); self.divide(); }
  behavior never() { print("never"); }
}
role Rest extends Part {
  require sizeof(self.connected) < 4;
  behavior dies() { self.sleepds(5); self.divide(); }
  behavior lives() { self.sleepds(5); }
  handler rings() every 0.5 { self.divide(); }
}
"""
MENDED = PROGRAM.replace('zero = 0', 'zero = 1')


class EndedTasks(Case):
    def setUp(self):
        super().setUp()
        self.log = self.folder / 'ended.log'
        self.write('dies.dyn', PROGRAM)
        self.write('mended.dyn', MENDED)

    def write(self, name, text):
        (self.folder / name).write_text(text)

    def options(self, *more):
        return ('run', MODEL, self.folder / 'dies.dyn', '--robot', 'quadruped', '--still', '--run', 'ended', '--force', '--log',
                self.log, *more)

    def test_the_fault_says_that_its_task_has_ended(self):
        summary = as_json(*self.options('--inproc', '--seconds', 2))
        said = {(f['ended'], f['fault'].split('; ', 1)[1]) for f in summary['faults']}
        self.assertEqual(said, {
            ('startup', 'the startup Hub.begin has ended, and nothing else of the role starts while it is held'),
            ('behavior', 'the behavior Rest.dies has ended and does not start again while the role is held'),
            ('handler', 'the handler Rest.rings has ended; the next event starts it anew')})
        self.assertEqual({f['function'] for f in summary['faults']}, {'Part.divide'})
        self.assertEqual({f['text'] for f in as_json('info', self.log)['faults']}, {f['fault'] for f in summary['faults']})

    def test_run_and_info_count_what_is_dead_at_the_end(self):
        text = morphbus(*self.options('--inproc', '--seconds', 2)).stdout
        hub = as_json('info', self.log)['faults'][0]['module']
        for told in (text, morphbus('info', self.log).stdout):
            dead = re.search(r'^ *8 behaviors have ended by a fault: (.*) Rest.dies \(.*/dies.dyn:3\)$', told, re.M)
            self.assertEqual(sorted(dead[1].split(', ')), [f'm{i}' for i in range(1, 10) if f'm{i}' != hub])
            self.assertRegex(told, '1 startup has ended by a fault, and nothing else of the role has started: '
                             fr'{hub} Hub.begin \(.*/dies.dyn:3\)\n')
            self.assertNotIn('never', told)
        alone = as_json('info', self.log)['ended_tasks']
        self.assertEqual((alone['behaviors'], alone['startups'], len(alone['tasks'])), (8, 1, 9))
        # The same of a run of processes, and as its summary says.
        spread = as_json(*self.options('--isolate', '--processes', 3, '--seconds', 2))
        self.assertEqual(spread['ended_tasks'], alone)

    def test_a_new_program_begins_all_tasks_afresh(self):
        (self.folder / 'commands').write_text(f'60 deploy {self.folder}/mended.dyn\n')
        summary = as_json(*self.options('--inproc', '--seconds', 8, '--commands', self.folder / 'commands'))
        self.assertGreater(summary['num_faults'], 9)
        self.assertTrue(all(t is not None for t in as_json('info', self.log)['deployments'][0]['switched'].values()))
        self.assertEqual(summary['ended_tasks'], {'behaviors': 0, 'startups': 0, 'tasks': []})


if __name__ == '__main__':
    unittest.main()
