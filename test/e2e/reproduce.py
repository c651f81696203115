#!/usr/bin/env python3
"""`morphbus reproduce`: a logged run again, from its log alone."""
import json
import struct
import unittest

from support import MODEL, PROGRAM, SOURCE, Case, as_json, morphbus, read_events, write_events

# What people do to a run, and to the bus.
COMMANDS = '10 push m5 EAST 20 0.2\n20 pause\n21 resume\n30 lose m3\n40 deploy {deployed}\n'
# The friction of the description: field 14, a double.
FRICTION = b'\x71' + struct.pack('<d', 0.8)


class Reproduce(Case):
    def record(self, *options, name='x.log', model=MODEL, program=PROGRAM, robot='quadruped', seconds=2, status=0):
        path = self.folder / name
        morphbus('run', model, program, '--robot', robot, '--seconds', seconds, '--log', path, '--force', *options,
                 status=status)
        return path

    def assert_same(self, log, *options):
        found = as_json('reproduce', log, *options)
        self.assertTrue(found['same'] and found['whole'], found)
        self.assertEqual(found['hash'], found['logged_hash'])
        self.assertEqual((found['differing'], found['first'], found['note']), (0, None, ''))
        return found

    def test_a_run_in_one_process_is_the_same_again_in_one_and_in_many(self):
        log = self.record('--inproc')
        self.assertEqual(self.assert_same(log)['hash'], self.assert_same(log, '--processes')['hash'])
        said = morphbus('reproduce', log).stdout
        self.assertRegex(said, r'^same: \d+ messages again, hash [0-9a-f]{32}\n$')

    def test_a_lossy_run_of_processes_is_the_same_again(self):
        self.assert_same(self.record('--isolate', '--loss', 0.2, '--faults', SOURCE / 'models' / 'rough.faults', seconds=0.5))

    def test_a_compressed_log_of_noisy_sensors_is_the_same_again(self):
        log = self.record('--inproc', '--root-sensor', '--root-noise', '0.002,0.01', '--noise-seed', 4, '--random-seed', 9)
        morphbus('convert', log, '--to', 'zst', '-o', self.folder / 'x.log.zst')
        self.assert_same(self.folder / 'x.log.zst')

    def test_a_world_comes_from_the_log(self):
        log = self.record('--inproc', '--world', SOURCE / 'models' / 'terrain.sdf', '--friction', 0.5)
        self.assert_same(log)

    def test_commands_and_deployed_programs_come_from_the_log(self):
        careful = self.folder / 'careful.dyn'
        careful.write_text((SOURCE / 'models' / 'programs' / 'quadruped_careful.dyn').read_text())
        (self.folder / 'commands').write_text(COMMANDS.format(deployed=careful))
        log = self.record('--inproc', '--commands', self.folder / 'commands', seconds=3, status=None)
        self.assertEqual(len(as_json('info', log)['commands']), 5)
        # The program's file is not needed any more.
        careful.unlink()
        self.assert_same(log)
        self.assert_same(log, '--processes')

    def test_a_run_that_was_stopped_ends_where_it_ended(self):
        (self.folder / 'commands').write_text('25 stop\n')
        self.assert_same(self.record('--inproc', '--commands', self.folder / 'commands'))
        # Paused for ever, it was ended, and CLOCK says why.
        (self.folder / 'commands').write_text('25 pause\n')
        log = self.record('--inproc', '--commands', self.folder / 'commands')
        self.assertIn('paused', as_json('info', log)['reason'])
        self.assert_same(log)

    def test_a_still_run_is_the_same_again(self):
        self.assert_same(self.record('--inproc', '--still'))

    def test_a_log_with_one_input_doctored_is_found_out(self):
        log = self.record('--inproc')
        doctored = self.doctored(log, FRICTION, FRICTION[:1] + struct.pack('<d', 0.7))
        found = json.loads(morphbus('reproduce', doctored, '--json', status=1).stdout)
        self.assertFalse(found['same'])
        self.assertNotEqual(found['hash'], found['logged_hash'])
        first = found['first']
        self.assertGreater(first['tick'], 0)
        # The feet slide: what is sensed differs before what is done.
        self.assertEqual(first['channel'], 'SIM/SENSORS')
        self.assertIn('modules[', first['field'])
        said = morphbus('reproduce', doctored, status=1).stdout
        self.assertIn(f'first at tick {first["tick"]} ', said)
        self.assertIn(f'SIM/SENSORS, {first["field"]}: {first["logged"]} in the log, {first["again"]} now', said)

    def test_a_log_that_is_cut_proves_nothing_but_what_it_holds_is_compared(self):
        events = read_events(self.record('--inproc'))
        write_events(self.folder / 'cut.log', events[:len(events) // 2])
        done = morphbus('reproduce', self.folder / 'cut.log', '--json', status=2)
        found = json.loads(done.stdout)
        self.assertTrue(found['same'])
        self.assertFalse(found['whole'])
        self.assertIn('is not whole', done.stderr)

    def test_what_cannot_be_done_again_is_said(self):
        events = read_events(self.record('--inproc'))
        write_events(self.folder / 'bare.log', [e for e in events if not e[2].endswith('/INFO')])
        self.assertIn('does not hold the run\'s description',
                      morphbus('reproduce', self.folder / 'bare.log', status=2).stderr)
        (self.folder / 'garbage').write_text('garbage')
        morphbus('reproduce', self.folder / 'garbage', status=2)
        morphbus('reproduce', self.folder / 'no.log', status=2)

    def test_another_version_is_named(self):
        log = self.record('--inproc', seconds=1)
        build = as_json('info', log)['description']['build'].encode()
        older = self.doctored(log, build, build.replace(b'0.1', b'0.0', 1))
        found = json.loads(morphbus('reproduce', older, '--json', status=2).stdout)
        self.assertTrue(found['same'])
        self.assertFalse(found['whole'])
        self.assertRegex(found['note'], r'^made by 0\.0\.0\S*, this is \S+: its hash may differ$')
        self.assertIn(found['note'], morphbus('reproduce', older, status=2).stderr)

    def test_the_second_log_is_kept_where_it_is_asked_for(self):
        log = self.record('--inproc', seconds=1)
        self.assert_same(log, '--log', self.folder / 'again.log')
        self.assertEqual(as_json('info', self.folder / 'again.log')['hash'], as_json('info', log)['hash'])
        morphbus('reproduce', log, '--log', log, status=2)


if __name__ == '__main__':
    unittest.main()
