#!/usr/bin/env python3
"""`control inspect`: modules of a walking robot tell what they hold, on STATUS, in lockstep and in real time. What they
said stands in the log, is what the log gives when the module is run again, and is said again by --commands."""
import json
import subprocess
import unittest

from control_live import Live
from support import LIMIT, MODEL, PROGRAM, SOURCE, Case, as_json, command, decode, morphbus, read_events

MODULES = [f'm{i}' for i in range(1, 10)]
# By this tick the quadruped walks.
WALKS = 150

COUNTER = """role Counter extends Module {
  sum = 0;
  speed = 2.5;
  shared far = false;
  behavior count() {
    var i = 3;
    while (i < 9) {
      sum += i;
      rest(i, true);
      i += 1;
    }
  }
  function rest(times, deep) {
    if (deep) {
      var tenths = 10 * times;
      self.sleepds(tenths);
    }
    var never = 1;
    sum += never;
  }
}
"""


def told(log, tick):
    """The inspections of a tick by module, as the log has them."""
    parts = {}
    for _, _, channel, data in read_events(log):
        if channel.endswith('/STATUS'):
            status = decode(data)
            if status.header.tick == tick and status.inspections:
                parts.setdefault(channel.split('/')[1], []).extend(status.inspections)
    return parts


class Inspection(Live):
    def test_what_a_walking_robot_holds_is_what_its_log_gives(self):
        self.start()
        self.reach(WALKS)
        self.control('speed', 1)
        one = self.control('inspect', 'm5')
        self.assertEqual((one['command'], one['pending'], one['refused']), ('inspect m5', False, None))
        every = self.control('inspect')
        self.assertEqual([answer['module'] for answer in every['modules']], MODULES)
        self.assertIn("did you mean 'm5'", self.refuse(2, 'inspect', 'm55'))
        said = morphbus('control', 'inspect', 'm5', '--run', 'live').stdout
        self.assertRegex(said, r'^inspect m5: tick \d+ \(\d+\.\d\d s\)\nm5: role Junction, pose known\n')
        self.assertRegex(said, r'\n  behavior Junction\.gait waits for .+\n    in Junction\.gait, quadruped\.dyn:\d+')
        self.control('stop')
        self.end()
        self.assertIn((one['tick'], 'inspect m5'), self.commands())
        self.assertIn((every['tick'], 'inspect'), self.commands())
        # Those who were asked, at their tick, and nobody else.
        self.assertEqual(set(told(self.path, one['tick'])), {'m5'})
        self.assertEqual(set(told(self.path, every['tick'])), set(MODULES))
        self.assertFalse(told(self.path, every['tick'] + 1))
        # The junction's behavior stands in its gait.
        junction, = one['modules']
        self.assertEqual((junction['module'], junction['tick'], junction['role']), ('m5', one['tick'], 'Junction'))
        behavior, = (task for task in junction['tasks'] if task['kind'] == 'behavior')
        self.assertEqual(behavior['routine'], 'Junction.gait')
        text = PROGRAM.read_text().splitlines()
        self.assertTrue(text[behavior['calls'][-1]['line'] - 1].strip())
        # Run again from the log, the modules hold the same, and say the same.
        for answer in [junction, *every['modules']]:
            again = as_json('replay', self.path, '--into', answer['module'], '--at', answer['seconds'])
            self.assertTrue(again['same'], again)
            for key in ('tick', 'role', 'labels', 'fields', 'tasks', 'has_pose'):
                self.assertEqual(again['at'][key], answer[key], (answer['module'], key))
            self.assertEqual({name: joint['sign'] for name, joint in again['at']['joints'].items()}, answer['conventions'])
        self.assert_repeats()

    def test_a_paused_run_answers_when_it_goes_on(self):
        self.start()
        paused = self.control('pause')['tick']
        waiting = subprocess.Popen(command('control', 'inspect', 'm2', '--run', 'live', '--json'),
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.kill_at_the_end(waiting)
        self.assertEqual(waiting.stderr.readline(), f'inspect m2 waits for tick {paused + 1}, once the run goes on\n')
        self.control('step')
        out, err = waiting.communicate(timeout=LIMIT)
        self.assertEqual((waiting.returncode, err), (0, ''))
        answer = json.loads(out)
        self.assertEqual((answer['tick'], answer['pending']), (paused + 1, False))
        self.assertEqual([module['tick'] for module in answer['modules']], [paused + 1])
        self.control('stop')
        self.end()

    def test_who_is_lost_is_not_asked(self):
        self.start()
        # A foot: the others go on with their roles, without which the run would end with status 1.
        self.reach(WALKS)
        self.control('lose', 'm6')
        answer = self.control('inspect')
        self.assertEqual([module['module'] for module in answer['modules']], [m for m in MODULES if m != 'm6'])
        self.assertIn('m6 is lost', self.refuse(1, 'inspect', 'm6'))
        self.control('stop')
        self.end()

    def test_a_script_inspects_alike_in_one_process_and_in_many(self):
        script = self.folder / 'script'
        script.write_text('60 inspect\n61 inspect m4\n80 inspect m4\n')
        runs = {}
        for where, lines in (('--inproc', script), ('--isolate', script), ('quiet', None)):
            log = self.folder / f'{where.strip("-")}.log'
            more = ['--inproc'] if lines is None else [where, '--commands', lines]
            run = as_json('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 2, '--run', 'script', '--log', log, *more)
            self.assertEqual([(at['tick'], sorted(answer['module'] for answer in at['modules'])) for at in run['inspections']],
                             [] if lines is None else [(60, MODULES), (61, ['m4']), (80, ['m4'])])
            runs[where] = (run['hash'], [sorted(told(log, tick)) for tick in (59, 60, 61, 62, 80)])
        self.assertEqual(runs['--inproc'], runs['--isolate'])
        self.assertEqual(runs['--inproc'][1], [[], MODULES, ['m4'], [], ['m4']])
        self.assertEqual(runs['quiet'][1], [[]] * 5)
        self.assertNotEqual(runs['quiet'][0], runs['--inproc'][0])

    def test_calls_show_parameters_variables_and_fields(self):
        program, script, log = self.folder / 'count.dyn', self.folder / 'script', self.folder / 'count.log'
        program.write_text(COUNTER)
        # The first rest lasts three seconds.
        script.write_text('100 inspect m1\n')
        ran = morphbus('run', SOURCE / 'models' / 'mtran_robots.m3l', program, '--robot', 'snake', '--seconds', 2.5, '--log', log,
                 '--inproc', '--commands', script)
        part, = told(log, 100)['m1']
        self.assertEqual([(f.name, f.type_name, f.value_text) for f in part.fields],
                         [('sum', 'int', '3'), ('speed', 'float', '2.5'), ('far', 'bool', 'false')])
        task, = part.tasks
        self.assertEqual((task.kind, task.routine_name, task.wait), (1, 'Counter.count', 2))
        self.assertGreater(task.until_us, 2000000)
        self.assertEqual([(call.function_name, call.line, [(v.name, v.type_name, v.value_text) for v in call.locals])
                          for call in task.calls],
                         [('Counter.rest', 16, [('times', 'int', '3'), ('deep', 'bool', 'true'), ('tenths', 'int', '30')]),
                          ('Counter.count', 9, [('i', 'int', '3')])])
        known = as_json('replay', log, '--into', 'm1', '--at', 2)
        self.assertTrue(known['same'])
        self.assertEqual(known['at']['fields'], {'sum': {'type': 'int', 'value': '3'}, 'speed': {'type': 'float', 'value': '2.5'},
                                                 'far': {'type': 'bool', 'value': 'false'}})
        # The run that was asked says so at its end, as replay does of any tick: with the file, since a robot may run several.
        told_by_run = ('inspected at tick 100 (2.00 s):\nm1: role Counter, pose known\n  field sum = 3 (int)\n')
        self.assertIn(told_by_run, ran.stdout)
        for said in (ran.stdout, morphbus('replay', log, '--into', 'm1', '--at', 2).stdout):
            self.assertIn('  field speed = 2.5 (float)\n', said)
            self.assertIn('    in Counter.rest, count.dyn:16: times = 3, deep = true, tenths = 30\n'
                          '    in Counter.count, count.dyn:9: i = 3\n', said)


class Realtime(Case):
    def test_every_module_that_hears_of_it_in_time_answers_while_the_clock_runs(self):
        # m3 is asked late within tick 60, and in tick 80 not at all: the clock does not wait for it.
        script, rules, log = self.folder / 'script', self.folder / 'late.faults', self.folder / 'x.log'
        script.write_text('60 inspect\n80 inspect\n')
        rules.write_text('fault process=m3 channel=SIM/SENSORS from=60 until=61 late=1 by=0.019s\n'
                         'fault process=m3 channel=SIM/SENSORS from=80 until=81 loss=1\n')
        morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 2, '--realtime', '--inproc', '--commands', script,
                 '--faults', rules, '--log', log)
        answered = {tick: sorted(told(log, tick)) for tick in (59, 60, 61, 79, 80, 81, 82)}
        self.assertEqual(answered, {59: [], 60: MODULES, 61: [], 79: [], 80: [m for m in MODULES if m != 'm3'], 81: [], 82: []})


if __name__ == '__main__':
    unittest.main(verbosity=2)
