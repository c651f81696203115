#!/usr/bin/env python3
"""morphbus convert: what it writes, read back with the standard library, is what is in the log."""
import csv
import json
import os
import pathlib
import struct
import subprocess
import unittest

from support import LIMIT, MODEL, PROGRAM, ShortRun, as_json, decode, lcm_types, morphbus, read_events, write_events


def table(path):
    """A table's column names and rows, as a spreadsheet would have them."""
    with open(path, newline='', encoding='utf-8') as file:
        rows = list(csv.reader(file))
    return rows[0], rows[1:]


def bits(number):
    """What tells two doubles apart, -0.0 from 0.0 as well."""
    return struct.pack('>d', number)


class Convert(ShortRun):
    """Conversions of one short log."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.events = [(number, stamp, channel, decode(data))
                      for number, stamp, channel, data in read_events(cls.short)]

    def messages(self, suffix):
        return [message for _, _, channel, message in self.events if channel.endswith(suffix)]

    def refused(self, *arguments):
        done = morphbus(*arguments, status=2, timeout=LIMIT)
        self.assertEqual(done.stdout, '', arguments)
        return done.stderr

    def converted(self, to, name, *arguments, log=None):
        path = self.folder / name
        morphbus('convert', log or self.short, '--to', to, '-o', path, *arguments)
        return path

    def check_columns(self, rows, names, expected):
        """`expected`: by time, in seconds, the values of some columns, exactly."""
        found = {}
        for row in rows:
            cells = dict(zip(names, row))
            found[float(cells['time [s]'])] = cells
        self.assertEqual(len(found), len(rows))
        count = 0
        for time, values in expected.items():
            for name, value in values.items():
                self.assertEqual(bits(float(found[time][name])), bits(value), f'{name} at {time}')
                count += 1
        self.assertGreater(count, 1000)

    def test_csv_has_units_time_first_and_every_double_of_the_log(self):
        folder = self.converted('csv', 'walk')
        names, rows = table(folder / 'joints.csv')
        self.assertEqual(names[:3], ['time [s]', 'm1.joint_1.position [rad]', 'm1.joint_1.velocity [rad/s]'])
        expected = {}
        for message in self.messages('/SIM/SENSORS'):
            values = expected.setdefault(message.header.sim_time_us / 1e6, {})
            for module in message.modules:
                for j in range(2):
                    joint = f'{module.name}.joint_{j + 1}'
                    values[f'{joint}.position [rad]'] = module.joint_position_si[j]
                    values[f'{joint}.velocity [rad/s]'] = module.joint_velocity_si[j]
                    values[f'{joint}.effort [N m]'] = module.joint_effort_si[j]
        self.assertEqual(len(rows), 150)
        self.check_columns(rows, names, expected)

        ids = {module.module_id: module.name for message in self.messages('/SIM/SENSORS') for module in message.modules}
        links = ('active_block', 'passive_block', 'connecting_bar')
        names, rows = table(folder / 'poses.csv')
        expected = {}
        for message in self.messages('/SIM/WORLD'):
            values = expected.setdefault(message.header.sim_time_us / 1e6, {})
            for body in message.bodies:
                for name, value in zip(('x [m]', 'y [m]', 'z [m]', 'qw', 'qx', 'qy', 'qz'),
                                       (*body.position_m, *body.orientation_wxyz)):
                    values[f'{ids[body.module_id]}.{links[body.link]}.{name}'] = value
        self.check_columns(rows, names, expected)

    def test_csv_has_the_forces_of_the_ground_which_carry_the_robot(self):
        names, rows = table(self.converted('csv', 'walk') / 'contact_forces.csv')
        ids = {module.module_id: module.name for message in self.messages('/SIM/SENSORS') for module in message.modules}
        links = ('active_block', 'passive_block', 'connecting_bar')
        expected, loads = {}, {}
        for message in self.messages('/SIM/WORLD'):
            values = expected.setdefault(message.header.sim_time_us / 1e6, {})
            for contact in message.contacts:
                for name, value in zip(('fx [N]', 'fy [N]', 'fz [N]'), contact.force_n):
                    values[f'{ids[contact.module_id]}.{links[contact.link]}.{name}'] = value
            tick = message.header.tick
            loads[tick] = loads.get(tick, 0) + sum(contact.force_n[1] for contact in message.contacts)
        self.check_columns(rows, names, expected)
        # Nine modules of 0.42 kg, which start half a millimetre above the ground; what bounces evens out over the run.
        self.assertEqual(loads[0], 0)
        self.assertAlmostEqual(sum(loads.values()) / (len(loads) - 1), 9 * 0.42 * 9.81, delta=0.02 * 9 * 0.42 * 9.81)

    def test_csv_tells_commands_roles_and_what_modules_believe_of_their_poses(self):
        folder = self.converted('csv', 'walk')
        names, rows = table(folder / 'commands.csv')
        targets, modes = {}, {}
        for _, _, channel, message in self.events:
            if not channel.endswith('/ACTUATOR'):
                continue
            module, time = channel.split('/')[1], message.header.sim_time_us / 1e6
            for j, joint in enumerate(message.joints):
                name = f'{module}.joint_{j + 1}'
                modes[(time, f'{name}.mode')] = ('hold', 'position', 'velocity')[joint.mode]
                if joint.mode == joint.MODE_POSITION:
                    targets.setdefault(time, {})[f'{name}.target [rad]'] = joint.target_si
                    targets[time][f'{name}.speed [rad/s]'] = joint.speed_si
        self.check_columns(rows, names, targets)
        cells = {(float(row[0]), name): cell for row in rows for name, cell in zip(names, row)}
        self.assertEqual({key: cells[key] for key in modes}, modes)

        names, rows = table(folder / 'roles.csv')
        self.assertEqual(names[:4], ['time [s]', 'tick', 'module', 'role'])
        told = sorted((m.header.tick, c.split('/')[1], m.role_name) for _, _, c, m in self.events if c.endswith('/STATUS'))
        self.assertEqual(sorted((int(row[1]), row[2], row[3]) for row in rows), told)
        self.assertIn('hip=joint_2', [row[4].split()[0] for row in rows if 'UpperHalf' in row[3]] +
                      [cell for row in rows for cell in row[4].split()])

        names, rows = table(folder / 'propagated_poses.csv')
        expected = {}
        for _, _, channel, message in self.events:
            if channel.endswith('/TRANSFORM') and message.has_pose:
                values = expected.setdefault(message.header.sim_time_us / 1e6, {})
                for link, pose in zip(('active_block', 'passive_block', 'connecting_bar'), message.link_poses):
                    column = f'{channel.split("/")[1]}.{link}'
                    for name, value in zip(('x [m]', 'y [m]', 'z [m]', 'qw', 'qx', 'qy', 'qz'),
                                           (*pose.position_m, *pose.orientation_wxyz)):
                        values[f'{column}.{name}'] = value
        self.check_columns(rows, names, expected)
        for name in ('faults.csv', 'controls.csv', 'connector_commands.csv'):
            self.assertEqual(table(folder / name)[0][0], 'time [s]')

    def test_faults_prints_and_commands_of_people_are_in_their_tables(self):
        program = self.folder / 'divides.dyn'
        program.write_text('role Any extends Module {\n  startup s() {\n    var none = self.connected - self.connected;\n'
                           '    print("divides, \'by\'", none);\n    print(1 / none);\n  }\n}\n')
        log = self.folder / 'faults.log'
        orders = self.folder / 'orders'
        orders.write_text('10 push m1 NORTH 1 0.1\n')
        done = as_json('run', MODEL, program, '--robot', 'quadruped', '--seconds', 1, '--inproc', '--log', log,
                       '--commands', orders)
        folder = self.converted('csv', 'faults', log=log)
        _, rows = table(folder / 'controls.csv')
        self.assertEqual([row[:2] for row in rows], [['0.2', '10']])
        self.assertIn('push m1 NORTH 1 0.1', rows[0][2])
        names, rows = table(folder / 'faults.csv')
        self.assertEqual(names, ['time [s]', 'module', 'role', 'fault', 'function', 'file', 'line'])
        self.assertEqual({(row[1], row[2], row[6]) for row in rows}, {(f'm{i}', 'Any', '5') for i in range(1, 10)})
        self.assertEqual([row[3] for row in rows], [fault['fault'] for fault in done['faults']])
        names, rows = table(folder / 'prints.csv')
        self.assertEqual(names, ['time [s]', 'module', 'role', 'text', 'file', 'line'])
        self.assertEqual({row[3] for row in rows}, {"divides, 'by' 0"})
        self.assertEqual([(float(row[0]), row[1], row[2], row[3], int(row[5])) for row in rows],
                         [(p['time'], p['module'], p['role'], p['text'], p['line']) for p in done['prints']])
        self.assertEqual(len(rows), 9)

    def test_json_lines_hold_every_message_with_its_type_and_exact_numbers(self):
        def plain(value):
            if isinstance(value, (bytes, bytearray)):
                return value.hex()
            if isinstance(value, (list, tuple)):
                return [plain(v) for v in value]
            return {n: plain(getattr(value, n)) for n in value.__slots__} if hasattr(value, '__slots__') else value

        lines = [json.loads(line) for line in self.converted('json', 'walk.json').read_text().splitlines()]
        self.assertEqual(len(lines), len(self.events))
        for line, (number, stamp, channel, message) in zip(lines, self.events):
            self.assertEqual((line['event'], line['received_us'], line['channel']), (number, stamp, channel))
            self.assertEqual(line['type'], f'morphbus.{type(message).__name__}')
            self.assertEqual(line['sim_time_us'], message.header.sim_time_us)
            self.assertEqual(line['message'], plain(message), channel)
        only = morphbus('convert', self.short, '--to', 'json', '--channel', 'short/m./STATUS', '-o', '-').stdout
        self.assertEqual(len(only.splitlines()), len(self.messages('/STATUS')))

    def test_foreign_and_damaged_messages_are_kept_as_bytes(self):
        log = self.folder / 'mixed.log'
        events = read_events(self.short)[:200]
        events[50] = (50, events[50][1], 'FOREIGN', b'\x01\x02\x03')
        events[60] = (60, events[60][1], events[60][2], events[60][3][:-5])
        write_events(log, events)
        done = morphbus('convert', log, '--to', 'json', '-o', self.folder / 'mixed.json')
        self.assertIn('2 events of a type that nobody defined', done.stderr)
        lines = [json.loads(line) for line in (self.folder / 'mixed.json').read_text().splitlines()]
        self.assertEqual(len(lines), 200)
        self.assertEqual((lines[50]['bytes'], lines[50]['type']), ('010203', None))
        self.assertEqual(lines[60]['bytes'], events[60][3].hex())
        self.assertIn('fit', lines[60]['error'])

    def test_a_compressed_log_is_the_log_to_every_command(self):
        ours = self.converted('zst', 'ours.log.zst')
        stock = self.folder / 'stock.log.zst'
        subprocess.run(['zstd', '-q', self.short, '-o', stock], check=True)
        for log in (ours, stock):
            self.assertLess(log.stat().st_size, os.path.getsize(self.short) / 2)
            self.assertEqual(subprocess.run(['zstd', '-dc', log], check=True, capture_output=True).stdout,
                             pathlib.Path(self.short).read_bytes())
            info = as_json('info', log)
            self.assertEqual((info['compressed'], info['log_bytes'], info['whole']),
                             (True, os.path.getsize(self.short), True))
            morphbus('verify', log)
            self.assertEqual(as_json('compare', self.short, log)['verdict'], 'equivalent')
            self.assertIn('is a log: say with --at', self.refused('draw', log, '-o', self.folder / 'x.svg'))
            morphbus('draw', log, '--at', 1, '-o', self.folder / 'x.svg')
            self.assertEqual(as_json('replay', log, '--isolate', '--speed', 0)['published'],
                             as_json('replay', self.short, '--isolate', '--speed', 0)['published'])
            morphbus('repair', log, '-o', self.folder / 'back.log')
            self.assertEqual((self.folder / 'back.log').read_bytes(), pathlib.Path(self.short).read_bytes())
            self.assertEqual(self.converted('json', 'a.json', log=log).read_bytes(),
                             self.converted('json', 'b.json').read_bytes())
        cut = self.folder / 'cut.log.zst'
        cut.write_bytes(stock.read_bytes()[:100_000])
        said = morphbus('verify', cut, status=1).stdout
        self.assertIn('the compressed file ends at its byte 100000', said)
        self.assertIn('no END', said)
        done = morphbus('repair', cut, '-o', self.folder / 'sound.log')
        self.assertIn('the compressed file ends', done.stdout)
        self.assertEqual(as_json('info', self.folder / 'sound.log')['num_damage'], 0)
        nothing = self.folder / 'nothing.zst'
        nothing.write_bytes(bytes.fromhex('28b52ffd') + b'garbage')
        self.assertIn('damaged between its bytes', self.refused('info', nothing))

    def test_outputs_take_the_place_of_their_like_and_of_nothing_else(self):
        for to, name in (('json', 'x.json'), ('mcap', 'x.mcap'), ('zst', 'x.zst'), ('description', 'x.description')):
            path = self.converted(to, name)
            first = path.read_bytes()
            self.converted(to, name)
            self.assertEqual(path.read_bytes(), first)
            path.write_text('mine')
            self.assertIn('--force', self.refused('convert', self.short, '--to', to, '-o', path))
            self.assertEqual(path.read_text(), 'mine')
            self.converted(to, name, '--force')
            self.assertEqual(path.read_bytes(), first)
        folder = self.converted('csv', 'tables')
        self.converted('csv', 'tables')
        (folder / 'joints.csv').write_text('mine')
        self.assertIn('--force', self.refused('convert', self.short, '--to', 'csv', '-o', folder))
        self.assertIn('folder', self.refused('convert', self.short, '--to', 'csv', '-o', self.folder / 'x.json'))
        self.assertIn('reads that file', self.refused('convert', self.short, '--to', 'zst', '-o', self.short, '--force'))
        self.assertEqual([p.name for p in self.folder.iterdir() if '.json.' in p.name], [])

    def test_options_that_do_not_go_together_are_refused(self):
        for arguments, why in ((('--to', 'cvs'), "did you mean 'csv'"), (('--to', 'zst', '--channel', 'x'), '--channel'),
                               (('--to', 'json', '--run', 'x'), '--run chooses for --to csv'),
                               (('--to', 'json', '--channel', '('), 'no regular expression'),
                               (('--to', 'csv', '--run', 'nope'), "no run 'nope'")):
            self.assertIn(why, self.refused('convert', self.short, '-o', self.folder / 'x', *arguments))
        self.assertIn('both write', self.refused('convert', self.short, '--to', 'json', '--json', '-o', '-'))

    def late(self):
        """What lcm-logger writes if it is started after two seconds: no INFO, no END."""
        log = self.folder / 'late.log'
        # What is outside the hash is written as it comes, before the ticks that it speaks of are whole.
        start = next(i for i, (_, _, c, m) in enumerate(self.events) if c.endswith('/SIM/CLOCK') and m.header.tick >= 60)
        kept = [e for e in read_events(self.short)[start:] if not e[2].endswith(('/INFO', '/END', '/HELLO'))]
        write_events(log, [(i, *event[1:]) for i, event in enumerate(kept)])
        return log

    def test_a_recording_that_began_late_is_usable_with_a_lent_description(self):
        late = self.late()
        self.assertIsNone(as_json('info', late).get('description'))
        self.assertIn("not hold the robot's model", self.refused('draw', late, '--at', 2, '-o', self.folder / 'x.svg'))
        file = self.converted('description', 'run.description')
        for description in (file, self.short):
            info = as_json('info', late, '--description', description)
            self.assertEqual((info['description']['robot'], info['problems']), ('quadruped', []))
            morphbus('draw', late, '--at', 2, '-o', self.folder / 'x.svg', '--description', description)
            self.converted('csv', 'late', '--description', description, log=late)
            names, rows = table(self.folder / 'late' / 'joints.csv')
            self.assertEqual((names[1], rows[0][0]), ('m1.joint_1.position [rad]', '1.2'))
            # Nothing differs, but a cut log cannot vouch for itself.
            answer = as_json('compare', late, late, '--description', description, status=2)
            self.assertEqual((answer['max_position_m'], answer['first_divergence']), (0, None))
            self.assertIn('FrontLeftUpperHalf', answer['roles'])
        self.assertEqual(as_json('verify', late, '--description', file, status=1)['whole'], False)
        _, rows = table(self.converted('csv', 'nameless', log=late) / 'joints.csv')
        self.assertEqual(table(self.folder / 'nameless' / 'joints.csv')[0][1], 'm1.joint0.position [rad]')

    def test_a_description_of_another_run_lends_the_model_and_one_of_another_model_is_refused(self):
        late, other, equivalent = self.late(), self.folder / 'other.log', self.folder / 'equivalent.log'
        morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 3, '--inproc', '--run', 'other', '--log', other)
        info = as_json('info', late, '--description', other)
        self.assertEqual(info['description']['robot'], 'quadruped')
        self.assertEqual(info['description']['mode'], '')
        self.assertIn('those of run other', info['problems'][0])
        model = self.folder / 'changed.m3l'
        model.write_text(MODEL.read_text().replace('unit=0.0325', 'unit=0.0326'))
        self.assertNotEqual(model.read_text(), MODEL.read_text())
        morphbus('run', model, PROGRAM, '--robot', 'quadruped', '--seconds', 3, '--inproc', '--log', equivalent)
        self.assertIn('the description is of model', self.refused('info', late, '--description', equivalent))
        self.assertIn('neither a log nor the description', self.refused('info', late, '--description', MODEL))
        self.assertIn('cannot open', self.refused('info', late, '--description', self.folder / 'none'))


if __name__ == '__main__':
    lcm_types()
    unittest.main()
