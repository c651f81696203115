#!/usr/bin/env python3
"""Every model of models/ through the command line; explanations of connections; the layout of files."""
import csv
import os
import re
import shutil
import struct
import unittest

from support import SOURCE, Case, as_json, morphbus

MODELS = SOURCE / 'models'


def robots_of(path):
    return re.findall(r'^robot (\w+):', path.read_text(), re.M)


class Models(Case):
    def test_every_robot_closes_and_is_drawn(self):
        drawn = 0
        for path in sorted(MODELS.glob('*.m3l')):
            self.assertIn('module', morphbus('check', path).stdout)
            for robot in robots_of(path):
                poses = as_json('fk', path, '--robot', robot)
                self.assertLess(poses['closure_m'], 1e-9, f'{path} {robot}')
                self.assertLess(poses['closure_rad'], 1e-9, f'{path} {robot}')
                picture = self.folder / f'{path.stem}_{robot}.svg'
                morphbus('draw', path, '--robot', robot, '-o', picture)
                # Each link shows some faces, and each face is a path.
                self.assertGreater(picture.read_text().count('<path'), 2 * len(poses['links']), f'{path} {robot}')
                drawn += 1
        self.assertGreaterEqual(drawn, 12)

    def test_the_graph_says_how_axes_lie(self):
        def relations(model, robot):
            joints = as_json('graph', MODELS / model, '--robot', robot)['joints']
            return {r for joint in joints for r in joint['adjacent_axes'].values()}
        self.assertEqual(relations('mtran_robots.m3l', 'snake'), {'parallel', 'orthogonal'})
        self.assertEqual(relations('molecube.m3l', 'snake'), {'coplanar'})
        self.assertEqual(relations('molecube.m3l', 'arm'), {'parallel', 'skew', 'coplanar'})
        car = {j['name']: j for j in as_json('graph', MODELS / 'atron.m3l', '--robot', 'car')['joints']}
        self.assertEqual(car['head.centre']['adjacent_axes'], {'left.centre': 'orthogonal', 'right.centre': 'orthogonal'})
        self.assertIn('orthogonal to', morphbus('graph', MODELS / 'atron.m3l', '--robot', 'car').stdout)


class Car(Case):
    def test_the_wheels_of_the_manual_find_themselves_and_drive_north(self):
        program = MODELS / 'programs' / 'car.dyn'
        manual = (SOURCE / 'docs' / 'dynarole.md').read_text()
        code = ''.join(line for line in program.read_text().splitlines(keepends=True) if not line.startswith('//'))
        self.assertIn(code.strip(), manual)
        roles = {'head': 'Head', 'left': 'LeftWheel', 'right': 'RightWheel'}
        settled = as_json('roles', MODELS / 'atron.m3l', program, '--robot', 'car')
        self.assertEqual({m: r['role'] for m, r in settled['modules'].items()}, roles)
        run = as_json('run', MODELS / 'atron.m3l', program, '--robot', 'car', '--seconds', 6, '--inproc',
                      '--log', self.folder / 'car.log')
        self.assertEqual(run['roles'], roles)
        self.assertEqual(run['faults'], [])
        north, _, east = run['displacement']
        self.assertGreater(north, 0.2)
        self.assertLess(abs(east), 0.05)


class Smores(Case):
    MODEL = MODELS / 'smores.m3l'
    PROGRAM = MODELS / 'programs' / 'smores_train.dyn'

    def test_the_whole_module_takes_forty_lines(self):
        code = re.sub(r'//.*', '', self.MODEL.read_text()).split('robot train')[0]
        # Besides how it looks.
        code = re.sub(r',\s*visual=.*?(?=\n\S|\n\n)', '', code, flags=re.S)
        self.assertLessEqual(len([line for line in code.splitlines() if line.strip()]), 40)

    def test_its_four_faces_mate_in_four_orientations_each(self):
        solved = as_json('connections', self.MODEL)
        self.assertEqual(solved['count'], 64)
        pairs = {(c['a'], c['b']) for c in solved['connections']}
        self.assertEqual(len(pairs), 16)

    def test_four_modules_drive_north_and_report_what_they_sense(self):
        log = self.folder / 'train.log'
        run = as_json('run', self.MODEL, self.PROGRAM, '--robot', 'train', '--seconds', 4, '--inproc', '--log', log)
        self.assertEqual(list(run['roles'].values()), ['Engine', 'Trailer', 'Trailer', 'Trailer'])
        self.assertEqual(run['faults'], [])
        north, up, east = run['displacement']
        self.assertGreater(north, 0.4)
        self.assertLess(abs(east), 0.05)
        self.assertLess(abs(up), 0.01)
        morphbus('convert', log, '--to', 'csv', '-o', self.folder / 'csv')
        with open(self.folder / 'csv' / 'sensors.csv', newline='') as file:
            rows = list(csv.DictReader(file))
        # Nothing is in front of the first one; the others see the back of the one before them, a face away.
        self.assertTrue(all(float(row['m1.eye [m]']) > 0.99 for row in rows))
        self.assertTrue(all(float(row['m3.eye [m]']) < 0.01 for row in rows))
        for row in rows:
            self.assertGreater(float(row['m2.level.y']), 0.99)
        self.assertNotEqual(rows[3]['m1.level.x'], rows[4]['m1.level.x'])

    def test_the_train_halts_before_the_wall_of_the_yard(self):
        log = self.folder / 'yard.log'
        yard = MODELS / 'yard.sdf'
        run = as_json('run', self.MODEL, self.PROGRAM, '--robot', 'train', '--seconds', 8, '--inproc', '--log', log,
                      '--world', yard)
        self.assertEqual(run['faults'], [])
        # The wall's near side is at 0.95 m; the first face of the train begins 0.05 m north of the origin.
        self.assertLess(run['displacement'][0], 0.85)
        self.assertGreater(run['displacement'][0], 0.4)
        morphbus('convert', log, '--to', 'csv', '-o', self.folder / 'yard')
        with open(self.folder / 'yard' / 'sensors.csv', newline='') as file:
            seen = [float(row['m1.eye [m]']) for row in csv.DictReader(file)]
        self.assertLess(min(seen), 0.15)
        self.assertGreater(min(seen), 0.03)
        for arguments in ((self.MODEL, '--robot', 'train', '--world', yard), (log, '--at', 6)):
            picture = self.folder / f'yard{len(arguments)}.svg'
            bare = self.folder / 'bare.svg'
            morphbus('draw', *arguments, '--view', 'top', '-o', picture)
            self.assertIn('<path', picture.read_text())
        morphbus('draw', self.MODEL, '--robot', 'train', '--view', 'top', '-o', bare)
        self.assertGreater((self.folder / 'yard5.svg').read_text().count('<path'), bare.read_text().count('<path'))

    def test_a_log_of_the_terrain_needs_none_of_its_files(self):
        # The world is copied, so that its files can go.
        shutil.copytree(MODELS / 'terrain', self.folder / 'terrain')
        world = self.folder / 'terrain.sdf'
        shutil.copy(MODELS / 'terrain.sdf', world)
        log = self.folder / 'terrain.log'
        run = as_json('run', self.MODEL, self.PROGRAM, '--robot', 'train', '--seconds', 8, '--inproc', '--log', log,
                      '--world', world)
        self.assertEqual(run['faults'], [])
        # The ridges begin at 0.8 m; the train sees their slope and halts.
        self.assertGreater(run['displacement'][0], 0.3)
        self.assertLess(run['displacement'][0], 0.75)
        # The same again in processes of their own.
        again = as_json('run', self.MODEL, self.PROGRAM, '--robot', 'train', '--seconds', 8, '--world', world)
        for key in ('world_hash', 'displacement'):
            self.assertEqual(again[key], run[key])
        bare = as_json('run', self.MODEL, self.PROGRAM, '--robot', 'train', '--seconds', 1, '--inproc')
        self.assertNotEqual(bare['world_hash'], run['world_hash'])
        morphbus('draw', self.MODEL, '--robot', 'train', '--world', world, '-o', self.folder / 'model.svg')
        shutil.rmtree(self.folder / 'terrain')
        world.unlink()
        morphbus('draw', log, '--at', 1, '-o', self.folder / 'log.svg')
        for picture in ('model.svg', 'log.svg'):
            # Two triangles a cell of 32 x 32, and the ridges, seen from whichever side.
            self.assertGreater((self.folder / picture).read_text().count('<path'), 2 * 32 * 32 + 8)
        self.assertIn('the same to the bit', morphbus('replay', log, '--into', 'm1').stdout)

    def test_a_world_too_large_for_a_description_is_refused(self):
        # Triangles that share no corners, in four files of 2.5 MB.
        count = 50000
        uses = ''
        for k in range(4):
            name = f'soup{k}.stl'
            (self.folder / name).write_bytes(bytes(80) + struct.pack('<I', count) + b''.join(
                struct.pack('<12fH', 0, 0, 1, i, k, 0, i + .5, k, 0, i, k + .5, 0, 0) for i in range(count)))
            uses += f'<collision name="c{k}"><geometry><mesh><uri>{name}</uri></mesh></geometry></collision>'
        (self.folder / 'soup.sdf').write_text('<sdf version="1.9"><world name="w"><model name="m"><static>true</static>'
                                              f'<link name="l">{uses}</link></model></world></sdf>')
        done = morphbus('run', self.MODEL, self.PROGRAM, '--robot', 'train', '--world', self.folder / 'soup.sdf', status=2)
        self.assertRegex(done.stderr, r'with its meshes and height maps it has \d+ bytes, the most is 8388608')

    def test_meshes_and_height_maps_go_into_every_format_with_a_world(self):
        for kind, name in (('sdf', 'train.sdf'), ('webots', 'train.wbt'), ('mjcf', 'train.xml')):
            morphbus('export', self.MODEL, '--robot', 'train', '--to', kind, '--world', MODELS / 'terrain.sdf',
                     '-o', self.folder / name)
        # MuJoCo takes meshes for their hulls, so that each triangle is a mesh of its own there: two for each four pixels.
        meshes = re.findall(r'<mesh name="([\w.]+)/\d+"', (self.folder / 'train.xml').read_text())
        self.assertEqual(meshes.count('bumps.link.map'), 2 * 32 * 32)
        self.assertGreater(meshes.count('ridges.link.mesh'), 4)
        (self.folder / 'vast.sdf').write_text(
            '<sdf version="1.9"><world name="w"><model name="m"><static>true</static><link name="l">' + ''.join(
                f'<collision name="c{k}"><geometry><heightmap><uri>bumps.png</uri><size>2 2 0.1</size></heightmap></geometry></collision>'
                for k in range(10)) + '</link></model></world></sdf>')
        shutil.copy(MODELS / 'terrain' / 'bumps.png', self.folder)
        done = morphbus('export', self.MODEL, '--robot', 'train', '--to', 'mjcf', '--world', self.folder / 'vast.sdf',
                        '-o', self.folder / 'vast.xml', status=2)
        self.assertIn('of 20000 at most; the world\'s meshes and height maps have 20480', done.stderr)
        # What SDF says is a world that can be read again.
        self.assertEqual(sorted(p.name for p in (self.folder / 'train_meshes').glob('obstacle*')),
                         ['obstacle-1.stl', 'obstacle-2.stl'])
        self.assertEqual((self.folder / 'train.wbt').read_text().count('boundingObject USE OBSTACLE_'), 2)
        # A mesh that the world needs is not overwritten by what is made of it.
        mesh = self.folder / 'train_meshes' / 'obstacle-1.stl'
        before = mesh.read_bytes()
        (self.folder / 'own.sdf').write_text(
            '<sdf version="1.9"><world name="w"><model name="m"><static>true</static><pose>2 0 0 0 0 0</pose><link name="l"><collision name="c">'
            '<geometry><mesh><uri>train_meshes/obstacle-1.stl</uri></mesh></geometry></collision></link></model></world></sdf>')
        done = morphbus('export', self.MODEL, '--robot', 'train', '--to', 'sdf', '--world', self.folder / 'own.sdf',
                        '-o', self.folder / 'train.sdf', '--force', status=2)
        self.assertIn('train_meshes/obstacle-1.stl', done.stderr)
        self.assertEqual(mesh.read_bytes(), before)

    def test_each_part_of_a_link_is_exported_by_itself(self):
        for kind, name, sign in (('sdf', 'train.sdf', 'yoke.part2'), ('mjcf', 'train.xml', 'yoke.part2'),
                                 ('urdf', 'train.urdf', 'yoke.part2'), ('webots', 'train.wbt', 'HULL_m1_yoke_2')):
            path = self.folder / kind / name
            path.parent.mkdir()
            morphbus('export', self.MODEL, '--robot', 'train', '--to', kind, '-o', path)
            self.assertIn(sign, path.read_text(), kind)


class Why(Case):
    def test_an_impossible_pair_shows_both_conditions_underlined(self):
        text = morphbus('connections', MODELS / 'mtran.m3l', '--why', 'c1,c2').stdout
        self.assertIn('never', text)
        for part in ('c1.gender is "male"', 'c2.gender is "male"', 'gender == "female"', '^~~~'):
            self.assertIn(part, text)

    def test_candidates_that_hulls_remove_say_how_deep(self):
        answer = as_json('connections', MODELS / 'mtran.m3l', '--why', 'c6,c3')
        self.assertEqual({c['number'] for c in answer['candidates'] if c['kept']}, {1, 2, 3, 4})
        removed = [c for c in answer['candidates'] if not c['kept']]
        self.assertEqual(len(removed), 4)
        for candidate in removed:
            self.assertGreater(candidate['overlaps'][0]['depth_m'], 0.03)
        text = morphbus('connections', MODELS / 'mtran.m3l', '--pair', 'c6,c3', '--why').stdout
        self.assertEqual(text.count('removed'), 4)
        self.assertIn('deep in link', text)

    def test_the_forms_of_the_option(self):
        morphbus('connections', MODELS / 'mtran.m3l', '--why', status=2)
        morphbus('connections', '--why', 'c1,c2', status=2)
        morphbus('connections', MODELS / 'mtran.m3l', '--why', 'c1', status=2)
        self.assertEqual(morphbus('connections', '--why', 'c1,c4', MODELS / 'mtran.m3l').stdout,
                         morphbus('connections', MODELS / 'mtran.m3l', '--why', 'c1,c4').stdout)


class Format(Case):
    def test_models_and_programs_are_canonical(self):
        morphbus('format', '--check', *sorted(MODELS.glob('*.m3l')), *sorted((MODELS / 'programs').glob('*.dyn')))

    def test_a_changed_file_is_reported_and_mended(self):
        path = self.folder / 'x.m3l'
        canonical = (MODELS / 'mtran.m3l').read_text()
        path.write_text(''.join(line if line.startswith('//') else line.replace(', ', ' ,\n\n  ')
                                for line in canonical.splitlines(keepends=True)))
        os.chmod(path, 0o640)
        link = self.folder / 'link.m3l'
        link.symlink_to(path)
        broken = path.read_text()
        self.assertIn('x.m3l', morphbus('format', '--check', path, status=1).stdout)
        self.assertEqual(path.read_text(), broken)
        as_said = as_json('format', '--check', path, MODELS / 'mtran.m3l', status=1)['files']
        self.assertEqual([f['layout'] for f in as_said], ['not in canonical layout', 'canonical'])
        self.assertEqual(as_json('format', link), {'files': [{'file': str(link), 'layout': 'formatted'}]})
        self.assertEqual(path.read_text(), canonical)
        self.assertTrue(link.is_symlink())
        self.assertEqual(path.stat().st_mode & 0o777, 0o640)
        morphbus('format', '--check', path)
        self.assertEqual(sorted(p.name for p in self.folder.glob('*m3l*')), ['link.m3l', 'x.m3l'])

    def test_a_file_with_syntax_errors_is_left_alone(self):
        path = self.folder / 'x.dyn'
        good = self.folder / 'good.dyn'
        path.write_text('role  R extends Module {  x = ; }')
        shutil.copy(MODELS / 'programs' / 'quadruped.dyn', good)
        done = morphbus('format', path, good, status=2)
        self.assertIn('error:', done.stderr)
        self.assertEqual(path.read_text(), 'role  R extends Module {  x = ; }')
        morphbus('format', self.folder / 'nothing.m3l', status=2)
        morphbus('format', self.folder / 'text.txt', status=2)


if __name__ == '__main__':
    unittest.main()
