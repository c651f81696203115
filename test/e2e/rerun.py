#!/usr/bin/env python3
"""`replay --into`: a module of a log runs again, says what it said, and shows what it knew."""
import re
import unittest

from support import MODEL, PROGRAM, SOURCE, ShortRun, as_json, decode, encode, morphbus, read_events, write_events


class Rerun(ShortRun):
    MODULES = [f'm{i}' for i in range(1, 10)]

    def record(self, name, *options, seconds=3, status=0):
        log = self.folder / f'{name}.log'
        morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', seconds, '--run', name, '--log', log, *options,
                 status=status)
        return log

    def test_every_module_says_again_what_it_said(self):
        for module in self.MODULES:
            again = as_json('replay', self.short, '--into', module)
            self.assertEqual((again['same'], again['different'], again['first']), (True, 0, None), module)
            self.assertEqual((again['ticks'], again['first_tick'], again['last_tick']), (150, 0, 149))
            # TRANSFORM and ACTUATOR every tick, STATUS when it says something new.
            self.assertGreater(again['messages'], 300)
            self.assertEqual((again['skipped'], again['unheard']), (0, 0))
        said = morphbus('replay', self.short, '--into', 'm5').stdout
        self.assertRegex(said, r'^m5: 150 ticks run again, 0\.00 to 2\.98 s; \d+ messages compared: the same to the bit\n$')

    def test_what_came_late_to_the_log_changes_nothing(self):
        log = self.record('lossy', '--isolate', '--loss', 0.3, '--seed', 5)
        for module in ('m1', 'm5', 'm8'):
            again = as_json('replay', log, '--into', module)
            self.assertTrue(again['same'], again)
            self.assertEqual((again['ticks'], again['unheard']), (150, 0))

    def test_a_program_that_was_deployed_and_a_module_that_began_anew(self):
        other = self.folder / 'other.dyn'
        other.write_text(PROGRAM.read_text().replace('45', '30'))
        script = self.folder / 'script.commands'
        script.write_text(f'25 deploy {other} --to m5\n175 restart m7 --cold\n')
        log = self.record('changed', '--isolate', '--commands', script, seconds=5)
        programs = {decode(data).header.program_hash for _, _, channel, data in read_events(log)
                    if channel.endswith('/m7/TRANSFORM')}
        self.assertEqual(len(programs), 2, 'the program was not replaced')
        for module in ('m5', 'm7', 'm1'):
            again = as_json('replay', log, '--into', module)
            self.assertTrue(again['same'], (module, again))

    def test_what_a_lost_module_does_not_say_is_counted_to_the_end_of_the_log(self):
        # Without m3 the others know no place of theirs, and have no role, in the end.
        lost = self.record('lost', '--lose', 'm3@1', '--inproc', status=1)
        again = as_json('replay', lost, '--into', 'm3')
        self.assertEqual((again['same'], again['ticks'], again['skipped']), (True, 50, 100))

    def test_in_real_time_a_neighbours_message_serves_for_three_ticks(self):
        # Nobody hears m2 in the ticks 50 to 59, the logger neither: modules go on by what it said in tick 49.
        faults = self.folder / 'deaf.faults'
        faults.write_text('fault channel=m2/TRANSFORM from=1s until=1.2s loss=1\n')
        log = self.record('deaf', '--inproc', '--realtime', '--faults', faults, seconds=2)
        for module in ('m1', 'm3', 'm5'):
            again = as_json('replay', log, '--into', module)
            self.assertEqual((again['same'], again['ticks'], again['unheard']), (True, 100, 7), module)

    def test_an_altered_command_is_named(self):
        events = read_events(self.short)
        altered = self.folder / 'altered.log'
        at = next(i for i, (_, _, channel, data) in enumerate(events)
                  if channel.endswith('/m3/ACTUATOR') and decode(data).header.tick == 120)
        message = decode(events[at][3])
        message.joints[1].target_si += 0.01
        events[at] = (*events[at][:3], encode(message))
        write_events(altered, events)
        again = as_json('replay', altered, '--into', 'm3', status=1)
        self.assertEqual((again['same'], again['different']), (False, 1))
        first = again['first']
        self.assertEqual((first['tick'], first['seconds'], first['topic'], first['field']),
                         (120, 2.4, 'ACTUATOR', 'joints[1].target_si'))
        self.assertAlmostEqual(float(first['logged']) - float(first['again']), 0.01, 9)
        said = morphbus('replay', altered, '--into', 'm3', status=1).stdout
        self.assertIn('1 is different\nfirst at tick 120 (2.40 s), ACTUATOR, joints[1].target_si: ', said)
        # Nobody else is told of it.
        self.assertTrue(as_json('replay', altered, '--into', 'm4')['same'])

    def test_what_a_neighbour_said_otherwise_shows_in_what_follows(self):
        events = read_events(self.short)
        altered = self.folder / 'altered.log'
        # The root, from whom the neighbours have their own poses.
        root = next(channel.split('/')[1] for _, _, channel, data in events
                    if channel.endswith('/TRANSFORM') and decode(data).has_pose)
        at = next(i for i, (_, _, channel, data) in enumerate(events)
                  if channel.endswith(f'/{root}/TRANSFORM') and decode(data).header.tick == 60)
        message = decode(events[at][3])
        for pose in message.link_poses:
            pose.position_m = [value + 0.01 for value in pose.position_m]
        events[at] = (*events[at][:3], encode(message))
        write_events(altered, events)
        mates = {module: as_json_any('replay', altered, '--into', module) for module in self.MODULES}
        self.assertEqual(mates[root]['first']['tick'], 60)
        self.assertEqual(mates[root]['first']['field'], 'link_poses[0].position_m[0]')
        self.assertTrue(any(not mates[m]['same'] and mates[m]['first']['tick'] == 61 for m in self.MODULES if m != root))

    def test_the_state_at_a_time(self):
        known = as_json('replay', self.short, '--into', 'm1', '--at', 2.5)['at']
        status = [decode(data) for _, _, channel, data in read_events(self.short)
                  if channel.endswith('/m1/STATUS') and decode(data).header.tick <= 125][-1]
        self.assertEqual((known['tick'], known['seconds'], known['role']), (125, 2.5, status.role_name))
        self.assertEqual(list(known['labels']), [label.name for label in status.labels])
        self.assertEqual([joint['sign'] for joint in known['joints'].values()], list(status.joint_sign))
        target = [joint['target'] for joint in known['joints'].values()]
        self.assertEqual(len(target), 2)
        # The junction's behavior stands somewhere in its gait.
        known = as_json('replay', self.short, '--into', 'm5', '--at', 2.5)['at']
        behaviors = [task for task in known['tasks'] if task['kind'] == 'behavior']
        self.assertEqual(len(behaviors), 1)
        call = behaviors[0]['calls'][-1]
        self.assertEqual(call['function'], 'Junction.gait')
        self.assertGreater(call['line'], 0)
        said = morphbus('replay', self.short, '--into', 'm5', '--at', 2.5).stdout
        self.assertIn('tick 125 (2.50 s): role Junction, pose known\n', said)
        self.assertIn(f'in Junction.gait, quadruped.dyn:{call["line"]}', said)

    def steps(self, at, by, module='m5'):
        return as_json('replay', self.short, '--into', module, '--at', at, '--steps', by)['steps']

    def test_the_steps_of_a_tick(self):
        # The gait's behavior sleeps in most ticks.
        asleep = as_json('replay', self.short, '--into', 'm5', '--at', 1, '--steps', 'lines')
        self.assertEqual(asleep['steps'], [])
        at = asleep['next_steps_at']
        self.assertGreater(at, 1)
        lines = self.steps(at, 'lines')
        self.assertEqual({step['task'] for step in lines}, {'behavior'})
        self.assertIn('Junction.gait', [step['function'] for step in lines])
        self.assertRegex(lines[-1]['then'], '^waits for ')
        self.assertEqual([step for step in lines[:-1] if 'then' in step], [])
        # The program's own text has the calls that the lines are said to make.
        program = (SOURCE / 'models/programs/quadruped.dyn').read_text().splitlines()
        self.assertTrue(all(program[step['line'] - 1].strip() for step in lines))
        # By instructions the same lines come in the same order, and stores show what they store.
        instructions = self.steps(at, 'instructions')
        self.assertGreater(len(instructions), len(lines))
        self.assertEqual(runs_of(step['line'] for step in instructions), runs_of(step['line'] for step in lines))
        # The state after the tick is where the steps have led; the comparison is what it was.
        whole = as_json('replay', self.short, '--into', 'm5', '--at', at, '--steps', 'lines')
        self.assertTrue(whole['same'])
        self.assertEqual(whole['steps_dropped'], 0)
        self.assertEqual(whole['at']['tasks'][0]['calls'][0]['function'], lines[-1]['function'])
        said = morphbus('replay', self.short, '--into', 'm5', '--at', at, '--steps', 'lines').stdout
        self.assertIn(f'quadruped.dyn:{lines[0]["line"]} {lines[0]["function"]}', said)
        self.assertRegex(said, re.escape(f'    {lines[-1]["then"]}') + r'\n  the next steps are at \d\.\d\d s\nafter tick ')

    def test_steps_show_operands_locals_and_fields(self):
        program = self.folder / 'count.dyn'
        program.write_text('role Counter extends Module {\n'
                           '  sum = 0;\n'
                           '  behavior count() {\n'
                           '    var i = 0;\n'
                           '    while (i < 2) {\n'
                           '      sum += twice(i) + 1;\n'
                           '      i += 1;\n'
                           '    }\n'
                           '    self.sleepds(5);\n'
                           '  }\n'
                           '  function twice(n) {\n'
                           '    return 2 * n;\n'
                           '  }\n'
                           '}\n')
        log = self.folder / 'count.log'
        morphbus('run', SOURCE / 'models' / 'mtran_robots.m3l', program, '--robot', 'snake', '--seconds', 1, '--log', log, '--inproc')
        first = as_json('replay', log, '--into', 'm1', '--at', 0, '--steps', 'lines')
        self.assertEqual(first['steps'], [])

        def steps(by):
            return as_json('replay', log, '--into', 'm1', '--at', first['next_steps_at'], '--steps', by)['steps']

        lines = [(step['function'], step['line'], {v['name']: v['value'] for v in step['locals']}, step['changed'])
                 for step in steps('lines')]
        counted = ('Counter.count', 6)
        self.assertEqual([line for line in lines if line[0] == 'Counter.twice'],
                         [('Counter.twice', 12, {'n': '0'}, {}), ('Counter.twice', 12, {'n': '1'}, {})])
        self.assertEqual([line[3] for line in lines if line[:2] == counted],
                         [{}, {'field sum': '1'}, {}, {'field sum': '4'}])
        self.assertEqual([line[2:] for line in lines if line[1] == 4], [({}, {'local i': '0'})])
        self.assertEqual([line[2:] for line in lines if line[1] == 7],
                         [({'i': '0'}, {'local i': '1'}), ({'i': '1'}, {'local i': '2'})])
        stores = [step for step in steps('instructions') if step['instruction'] == 'store_field sum']
        self.assertEqual([step['operands'] for step in stores], [['1'], ['4']])
        self.assertEqual([step['changed'] for step in stores], [{'field sum': '1'}, {'field sum': '4'}])

        # Whenever a task comes to a line: the first turn's calls of the first tick with steps, the outer one with its variable.
        at = first['next_steps_at']

        def breaks(line, *options):
            found = as_json('replay', log, '--into', 'm1', '--break', line, *options)
            self.assertTrue(found['same'])
            self.assertEqual(found['breaks_dropped'], 0)
            return found['breaks']

        sums = [(b['seconds'], [(c['line'], {v['name']: v['value'] for v in c['locals']}) for c in b['calls']],
                 b['fields']['sum']['value']) for b in breaks(6)[:2]]
        self.assertEqual(sums, [(at, [(6, {'i': '0'})], '0'), (at, [(6, {'i': '1'})], '1')])
        inner = breaks(12, '--from', at, '--to', at + 0.02)
        self.assertEqual([[(c['function'], c['line'], {v['name']: v['value'] for v in c['locals']}) for c in b['calls']] for b in inner],
                         [[('Counter.twice', 12, {'n': n}), ('Counter.count', 6, {'i': n})] for n in ('0', '1')])
        self.assertEqual({(b['kind'], b['routine']) for b in inner}, {('behavior', 'Counter.count')})
        self.assertEqual(breaks(12, '--to', at), [])
        said = morphbus('replay', log, '--into', 'm1', '--break', 12, '--from', at, '--to', at + 0.02).stdout
        self.assertIn('    in Counter.twice, count.dyn:12: n = 1\n    in Counter.count, count.dyn:6: i = 1\n  field sum = 1 (int)\n', said)
        self.assertIn('no task of m1 came to line 99', morphbus('replay', log, '--into', 'm1', '--break', 99).stderr)

    def test_a_loop_shows_its_neighbour_by_the_connector_and_nothing_of_the_compiler(self):
        snake = SOURCE / 'models' / 'mtran_robots.m3l'
        docked = {'c2', 'c5'}  # As the model has m2.
        # The compiler's own names may be a program's, too.
        for variable, neighbour in (('best', 'n'), ('switch', 'neighbours')):
            program = self.folder / f'{variable}.dyn'
            program.write_text('role Asking extends Module {\n'
                               '  shared told = 1;\n'
                               '  behavior ask() {\n'
                               f'    var {variable} = 0;\n'
                               f'    for ({neighbour} in self.connected($ANY, $Asking)) {{\n'
                               f'      {variable} += {neighbour}.told;\n'
                               '    }\n'
                               f'    self.sleepds({variable});\n'
                               '  }\n'
                               '}\n')
            log = self.folder / f'{variable}.log'
            morphbus('run', snake, program, '--robot', 'snake', '--seconds', 1, '--log', log, '--inproc')
            found = as_json('replay', log, '--into', 'm2', '--break', 6)['breaks']
            rounds = [[(v['name'], v['value']) for v in b['calls'][0]['locals']] for b in found]
            for names in rounds:
                self.assertEqual([name for name, _ in names], [variable, neighbour])
            self.assertEqual({names[1][1] for names in rounds}, docked)
            steps = as_json('replay', log, '--into', 'm2', '--at', found[-1]['seconds'], '--steps', 'lines')['steps']
            told = [step['changed'][f'local {neighbour}'] for step in steps if f'local {neighbour}' in step['changed']]
            self.assertEqual(set(told), docked | {'none'})
            self.assertEqual({name for step in steps for name in step['changed'] if name.startswith('local ')},
                             {f'local {variable}', f'local {neighbour}'})

    def test_what_cannot_be_is_refused(self):
        for options, said in ((['--into', 'm99'], 'expected a module of the run, m1, m2'),
                              (['--at', 1], '--at needs --into MODULE'),
                              (['--break', 1], '--break needs --into MODULE'),
                              (['--into', 'm1', '--break', 0], 'expected a line, 1 or more'),
                              (['--into', 'm1', '--break', 1, '--at', 1], 'give one of them'),
                              (['--into', 'm1', '--steps', 'lines'], '--steps needs --at T'),
                              (['--into', 'm1', '--at', 1, '--steps', 'days'], 'expected lines or instructions'),
                              (['--into', 'm1', '--loop'], 'leave out --loop'),
                              (['--into', 'm1', '--speed', 2], 'leave out --speed'),
                              (['--into', 'm1', '--at', 99], 'the last tick of m1 begins at 2.98 s'),
                              (['--into', 'm1', '--at', -1], 'expected a sim time')):
            self.assertIn(said, morphbus('replay', self.short, *options, status=2).stderr)
        # Without its description the log does not say what ran.
        bare = self.folder / 'bare.log'
        write_events(bare, [e for e in read_events(self.short) if not e[2].endswith('/INFO')])
        self.assertIn('model', morphbus('replay', bare, '--into', 'm1', status=2).stderr)
        lent = as_json('replay', bare, '--into', 'm1', '--description', self.short)
        self.assertTrue(lent['same'])


def runs_of(values):
    """Without repetitions of one value."""
    kept = []
    for value in values:
        if not kept or kept[-1] != value:
            kept.append(value)
    return kept


def as_json_any(*arguments):
    """Of a comparison that may end either way."""
    try:
        return as_json(*arguments)
    except AssertionError:
        return as_json(*arguments, status=1)


if __name__ == '__main__':
    unittest.main(verbosity=2)
