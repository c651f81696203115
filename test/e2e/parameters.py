#!/usr/bin/env python3
"""Parameters of programs: values that a run chooses, and values that change while it runs."""
import subprocess
import unittest

from control_live import Live
from support import MODEL, Case, as_json, command, morphbus

PROGRAM = """
param swing = 30.0 in [10, 60];
role Any extends Module {
  param pause = 10 in [1, 50];
  n = 0;
  startup s() { print("began with", swing); }
  behavior go() {
    n += 1;
    self.JOINT_1.SET_POSITION(swing);
    self.sleepcs(pause);
    self.JOINT_1.SET_POSITION(-swing);
    self.sleepcs(pause);
  }
}
"""

# Runs without physics know no places.
WITHOUT = ('--without', 'simulated')


class Parameters(Case):
    def setUp(self):
        super().setUp()
        self.program = self.folder / 'swing.dyn'
        self.program.write_text(PROGRAM)
        self.robot = (MODEL, self.program, '--robot', 'quadruped')

    def run_it(self, name, *options):
        """A second without physics, as one process; its summary and its log."""
        log = self.folder / f'{name}.log'
        seconds = () if '--seconds' in options else ('--seconds', 1)
        return as_json('run', *self.robot, *seconds, '--still', '--inproc', '--log', log, *options), log

    def test_a_run_chooses_values_and_its_log_tells_them(self):
        plain, plain_log = self.run_it('plain')
        chosen, log = self.run_it('chosen', '--set', 'swing=45.5', '--set', 'Any.pause=20')
        described = as_json('info', log)['description']['parameters']
        self.assertEqual(described['swing'], {'value': 45.5, 'source': 30, 'least': 10, 'most': 60})
        self.assertEqual(described['Any.pause'], {'value': 20, 'source': 10, 'least': 1, 'most': 50})
        self.assertIn('parameters swing 45.5 (30 in the source), Any.pause 20 (10 in the source)\n',
                      morphbus('info', log).stdout)
        self.assertIn('swing 45.5 (30 in the source)', self.report(log))
        # What the joints are told: 45.5 degrees.
        table = self.folder / 'csv'
        morphbus('convert', log, '--to', 'csv', '-o', table)
        self.assertIn('0.7941', (table / 'commands.csv').read_text())
        # The values of the source, said once more, are the same run; of two settings the later one counts.
        self.assertEqual(self.run_it('same', '--set', 'swing=60', '--set', 'swing=30')[0]['hash'], plain['hash'])
        self.assertNotEqual(chosen['hash'], plain['hash'])
        # A comparison says first what was set otherwise.
        said = morphbus('compare', plain_log, log, *WITHOUT, status=1).stdout
        self.assertTrue(said.startswith('differs in parameters: Any.pause 10 / 20, swing 30 / 45.5\ndifferent: '), said[:200])
        self.assertEqual(as_json('compare', plain_log, log, *WITHOUT, status=1)['settings'],
                         [{'name': 'Any.pause', 'a': '10', 'b': '20'}, {'name': 'swing', 'a': '30', 'b': '45.5'}])
        self.assertEqual(as_json('compare', log, log, *WITHOUT)['settings'], [])
        page = self.folder / 'compare.html'
        morphbus('compare', plain_log, log, '--report', page, *WITHOUT, status=1)
        self.assertIn('swing 30 / 45.5', page.read_text())

    def report(self, log):
        page = self.folder / 'report.html'
        morphbus('report', log, '-o', page)
        return page.read_text()

    def test_images_keep_the_values_that_they_were_compiled_with(self):
        image = self.folder / 'swing.image'
        made = as_json('compile', self.program, '--model', MODEL, '--set', 'pause=3', '-o', image)
        self.assertIn('constant 1 int 3 parameter Any.pause in [1, 50]', morphbus('disasm', image).stdout)
        self.robot = (MODEL, image, '--robot', 'quadruped')
        summary, log = self.run_it('image')
        self.assertEqual(summary['program_hash'], made['hash'])
        self.assertEqual(as_json('info', log)['description']['parameters']['Any.pause']['value'], 3)

    def test_a_file_holds_values_and_the_command_line_replaces_them(self):
        params = self.folder / 'best.toml'
        params.write_text('swing = 45.5  # degrees\n[Any]\npause = 20\n["MTRAN"."joint_1"]\nspeed = "90deg"\n')
        _, log = self.run_it('file', '--params', params, '--set', 'pause=30')
        described = as_json('info', log)['description']
        self.assertEqual({name: p['value'] for name, p in described['parameters'].items()}, {'swing': 45.5, 'Any.pause': 30})
        self.assertEqual(described['attributes'], ['MTRAN.joint_1.speed=90deg'])
        for text, words in (('swing = 99\n', f'{params}:1: swing=99: parameter swing: 99 is out of its range'),
                            ('swing = [1]\n', f'{params}:1:9: error: expected a number'),
                            ('swing = \n', f'{params}:1:')):
            params.write_text(text)
            done = morphbus('run', *self.robot, '--seconds', 1, '--inproc', '--no-log', '--params', params, status=2)
            self.assertIn(words, done.stderr)
        done = morphbus('run', *self.robot, '--seconds', 1, '--inproc', '--no-log', '--params', self.folder / 'none', status=2)
        self.assertIn('--params: ', done.stderr)

    def test_requirements_see_the_values(self):
        program = self.folder / 'near.dyn'
        program.write_text('param joints = 1 in [1, 9];\nrole A extends Module { require sizeof(self.connected) == joints; }\n')
        for joints, status in ((4, 0), (9, 1)):
            morphbus('roles', MODEL, program, '--robot', 'quadruped', '--set', f'joints={joints}', status=status)

    def test_the_source_is_found_whatever_was_set(self):
        self.program.write_text(PROGRAM.replace('n += 1;', 'n += 1; print("round", n);'))
        script = self.folder / 'commands'
        script.write_text('5 set swing 45\n')
        _, log = self.run_it('lines', '--set', 'pause=5', '--commands', script, '--seconds', 2)
        facts = as_json('info', log)
        # After the value holds, too, prints have the path that the program was given by.
        switched = facts['deployments'][0]['switch_tick'] * 0.02
        self.assertGreater(max(p['time'] for p in facts['prints']), switched)
        printed = [line for line in morphbus('info', log, '--all').stdout.splitlines() if ' round ' in line]
        self.assertEqual(len(printed), facts['num_prints'] - 9)
        self.assertEqual([line for line in printed if str(self.program) not in line], [])
        script.write_text('5 set swing 40\n')
        _, other = self.run_it('others', '--set', 'pause=5', '--commands', script, '--seconds', 2)
        trace = as_json('compare', log, other, *WITHOUT, status=1)['trace']
        self.assertEqual((trace['message_a']['file'], trace['message_b']['file']), (str(self.program),) * 2)

    def test_a_module_that_begins_anew_comes_to_the_values_and_a_lost_root_to_none(self):
        script = self.folder / 'commands'
        # As many as are kept, and more; then a module that knows none of them.
        sets = ''.join(f'{5 + 40 * i} set swing {20 + i}\n' for i in range(11))
        script.write_text(sets + '460 restart m7 --cold\n560 set swing 45\n700 lose m1\n710 set swing 50\n')
        log = self.folder / 'anew.log'
        done = morphbus('run', *self.robot, '--still', '--inproc', '--root', 'm1', '--log', log, '--commands', script, '--seconds', 15)
        self.assertIn('the root is lost, from which values spread', done.stderr)
        facts = as_json('info', log)
        self.assertEqual(len(facts['deployments']), 12)
        last = facts['deployments'][-1]
        self.assertEqual((last['value'], len(set(last['switched'].values()))), ('45', 1))
        self.assertNotIn(None, last['switched'].values())
        morphbus('reproduce', log)

    def test_what_cannot_be_set_is_refused(self):
        for options, words in (
                (('--set', 'swing=61'), 'parameter swing: 61 is out of its range, 10 to 60'),
                (('--set', 'pause=2.5'), 'parameter Any.pause: expected an int, 1 to 50'),
                (('--set', 'swin=20'), "did you mean 'swing'?"),
                (('--set', 'swing'), 'expected NAME=VALUE'),
                (('--set', '=3'), 'expected NAME=VALUE')):
            done = morphbus('run', *self.robot, '--seconds', 1, '--inproc', '--no-log', *options, status=2)
            self.assertIn(words, done.stderr)
        (self.folder / 'plain.dyn').write_text('role A extends Module { startup s() { self.sleepcs(1); } }\n')
        done = morphbus('run', MODEL, self.folder / 'plain.dyn', '--robot', 'quadruped', '--seconds', 1, '--inproc', '--no-log',
                        '--set', 'swing=3', status=2)
        self.assertIn('the program has none', done.stderr)

    def test_a_value_changes_everywhere_at_one_tick_and_the_run_repeats(self):
        script = self.folder / 'commands'
        script.write_text('5 set swing 45\n6 set Any.pause 5 --at 0.9\n')
        options = ('--commands', script, '--seconds', 2)
        summary, log = self.run_it('set', *options)
        facts = as_json('info', log)
        # Both were said before the first was everywhere: the second goes out with the first one's value in it.
        self.assertEqual([c['command'].split()[:3] for c in facts['commands']],
                         [['set', 'swing', '45'], ['set', 'Any.pause', '5']])
        last = facts['deployments'][-1]
        self.assertEqual(set(last['switched'].values()), {45})
        # Nobody begins anew: each module prints once.
        self.assertEqual([p['text'] for p in facts['prints']], ['began with 30'] * 9)
        self.assertEqual(facts['num_faults'], 0)
        # The same as processes, from the log's own commands, and each module by itself.
        self.assertEqual(as_json('reproduce', log)['hash'], summary['hash'])
        other = self.folder / 'processes.log'
        again = as_json('run', *self.robot, '--still', '--isolate', '--processes', 2, '--log', other, *options)
        self.assertEqual(again['hash'], summary['hash'])
        morphbus('replay', log, '--into', 'm5')
        # Two in one tick build on each other, and repeat so; later both are found to be there.
        script.write_text('5 set swing 45\n5 set pause 5\n60 set swing 45\n60 set pause 5\n')
        log = self.folder / 'both.log'
        done = morphbus('run', *self.robot, '--still', '--inproc', '--log', log, *options)
        self.assertIn('swing is 45 already', done.stderr)
        self.assertIn('pause is 5 already', done.stderr)
        self.assertEqual([(d['parameter'], d['value'], d['program']) for d in as_json('info', log)['deployments']],
                         [('swing', '45', None), ('pause', '5', None)])
        morphbus('reproduce', log)
        # A value of a program that waits for its time does not bring it forward.
        other = self.folder / 'other.dyn'
        other.write_text(PROGRAM.replace('n += 1', 'n += 2'))
        script.write_text(f'5 deploy {other} --at 1.5\n10 set swing 45\n11 set swing 50 --at 1\n')
        done = morphbus('run', *self.robot, '--still', '--inproc', '--log', log, '--force', *options)
        self.assertIn('--at 1: the program that has this value is taken up at 1.5 s', done.stderr)
        last = as_json('info', log)['deployments'][-1]
        self.assertEqual((last['value'], set(last['switched'].values())), ('45', {75}))
        # What is set where it is so already, or in another program, is told and changes nothing.
        script.write_text('5 set swing 30\n7 set swing 40 0123456789abcdef\n')
        done = morphbus('run', *self.robot, '--still', '--inproc', '--no-log', *options)
        self.assertIn('swing is 30 already', done.stderr)
        self.assertIn('another one than swing was set in', done.stderr)


class SetLive(Live):
    def start(self, *options, **more):
        program = self.folder / 'swing.dyn'
        program.write_text(PROGRAM)
        self.run_name = 'live'
        self.path = self.folder / 'live.log'
        self.process = subprocess.Popen(
            command('run', MODEL, program, '--robot', 'quadruped', '--run', self.run_name, '--log', self.path, '--json', '--still',
                    '--isolate', *options), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.kill_at_the_end(self.process)
        self.reach(40, 4)

    def test_people_set_values_of_a_robot_that_runs(self):
        self.start()
        self.control('pause')
        given = self.control('set', 'swing', 12.5)
        self.assertTrue(given['pending'])
        self.assertGreater(given['switch_seconds'], given['seconds'])
        self.control('set', 'pause', 20)
        self.assertIn('expected: set PARAMETER VALUE', self.refuse(2, 'set', 'swing'))
        self.control('resume')
        self.reach(round(given['switch_seconds'] / 0.02) + 100)
        # Both were set while the run held still.
        self.assertIn('swing is 12.5 already', self.refuse(1, 'set', 'swing', 12.5))
        self.assertIn('pause is 20 already', self.refuse(1, 'set', 'pause', 20))
        self.assertIn('out of its range', self.refuse(2, 'set', 'swing', 99))
        self.assertIn("did you mean 'swing'", self.refuse(2, 'set', 'swign', 20))
        self.control('stop')
        self.end()
        facts = as_json('info', self.path)
        self.assertEqual(len(set(facts['deployments'][-1]['switched'].values())), 1)
        self.assertEqual(as_json('reproduce', self.path)['hash'], facts['hash'])


if __name__ == '__main__':
    unittest.main()
