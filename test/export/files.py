#!/usr/bin/env python3
"""Exported files as they lie on disk: names, companions, schemas, and requests that make no sense."""
import json
import os
import pathlib
import re
import struct
import subprocess
import xml.etree.ElementTree as ElementTree

from support import MODEL, MORPHBUS, ROBOTS, SOURCE, Case, export, main, matrix, poses, product, run

SCHEMA = SOURCE / 'compiler/keywords/keywords.rng'


def row(length):
    """Modules in a row, as M3L."""
    modules = ', '.join(f'MTRAN m{i}' for i in range(length))
    connections = ', '.join(f'(m{i}.c2, m{i + 1}.c5)' for i in range(length - 1))
    return f'import "{MODEL}"\nrobot row: modules=({modules}), connections=({connections})\n'


def hubs(count):
    """Quadrupeds one behind the other, as M3L: each has a loop that locks two joints."""
    modules = ', '.join(f'MTRAN h{k}m{i}' for k in range(count) for i in range(1, 10))
    pattern = ('(h{0}m1.c2, h{0}m2.c5), (h{0}m2.c2, h{0}m3.c5), (h{0}m3.c2, h{0}m4.c5), (h{0}m2.c3, h{0}m5.c4), '
               '(h{0}m3.c6, h{0}m5.c3, 3), (h{0}m6.c2, h{0}m7.c5), (h{0}m7.c2, h{0}m8.c5), (h{0}m8.c2, h{0}m9.c5), '
               '(h{0}m7.c1, h{0}m5.c6), (h{0}m8.c4, h{0}m5.c1, 35)')
    connections = ', '.join([pattern.format(k) for k in range(count)]
                            + [f'(h{k}m4.c2, h{k + 1}m1.c5)' for k in range(count - 1)])
    return f'import "{MODEL}"\nrobot hubs: modules=({modules}), connections=({connections})\n'


def module_types(model):
    return re.findall(r'(?m)^\s*module\s+(\w+)', pathlib.Path(model).read_text())


def read_stl(path):
    """Triangles of a binary STL file: lists of three corners."""
    data = path.read_bytes()
    count, = struct.unpack_from('<I', data, 80)
    assert len(data) == 84 + 50 * count, path
    floats = [struct.unpack_from('<12f', data, 84 + 50 * i) for i in range(count)]
    return [(f[3:6], f[6:9], f[9:12]) for f in floats]


class Files(Case):
    def test_check_urdf_accepts_every_robot(self):
        snake = self.snake()
        for model, of in [(MODEL, ('--robot', robot)) for robot in ROBOTS] + \
                [(snake, ('--robot', 'snake')), (MODEL, ('--module', 'MTRAN'))]:
            path = self.folder / 'robot.urdf'
            export('urdf', path, *of, model=model)
            checked = run(['check_urdf', path])
            self.assertNotIn('Error:', checked.stderr + checked.stdout)
            self.assertIn('root Link: world', checked.stdout)

    def test_cut_loops_are_reported_and_no_others(self):
        path = self.folder / 'robot.urdf'
        said = export('urdf', path, '--robot', 'quadruped').stderr
        text = path.read_text()
        self.assertEqual(said.count('warning: URDF holds trees only'), 3)
        # Of the six connections that hold the hub together one is left out, then one of m5's joints.
        left_out, = re.findall(r'only: (\S+) is left out; nothing is lost', said)
        cut, = re.findall(r"only: (\S+), which the robot's loops lock, is cut", said)
        self.assertRegex(cut, r'^m5\.joint_[12]$')
        self.assertIn(f'<!-- Opens a loop: {left_out} ', text)
        self.assertIn(f'<!-- Opens a loop: {cut},', text)
        text = text.split('<gazebo>')[0]  # Beyond it stands the joint as Gazebo closes it again.
        self.assertNotIn(f'<joint name="{cut}"', text)
        for i in range(1, 10):
            for joint in ('joint_1', 'joint_2'):
                self.assertEqual(text.count(f'<joint name="m{i}.{joint}"'), f'm{i}.{joint}' != cut)
        said = export('urdf', path, '--robot', 'snake', model=self.snake()).stderr
        self.assertEqual(said.count('warning:'), 1)
        self.assertIn('no start values', said)
        self.assertIn('(rad or m), others 0: m1.joint_1=', path.read_text())
        for to in ('mjcf', 'sdf'):
            self.assertEqual(export(to, self.folder / f'whole.{to}', '--robot', 'quadruped').stderr, '')

    def test_cuts_are_listed_beside_the_file(self):
        path = self.folder / 'walker.urdf'
        export('urdf', path, '--robot', 'quadruped')
        listed = json.loads((self.folder / 'walker_cuts.json').read_text())
        self.assertEqual(listed['robot'], 'quadruped')
        connection, joint = listed['cuts']
        self.assertEqual((connection['kind'], connection['loses']), ('connection', 'nothing'))
        self.assertEqual((joint['kind'], joint['loses'], joint['type']), ('joint', 'a locked joint', 'revolute'))
        self.assertRegex(joint['name'], r'^m5\.joint_[12]$')
        # Both hold at the start of this robot, by the library's own poses.
        links = poses('quadruped', {})
        for cut in (connection, joint):
            parent, child, between = (matrix(pose) for pose in (
                links[cut['parent']], links[cut['child']], (cut['pose']['p'], cut['pose']['q'])))
            for ours, theirs in zip(product(parent, between), child):
                self.assertAlmostEqual(ours, theirs, places=9)
        self.assertIn(f'<joint name="{joint["name"]}" type="revolute">', path.read_text().split('<gazebo>')[1])
        # A list is there also of what has no loops: else the one above would be taken for this one's.
        export('urdf', path, '--module', 'MTRAN')
        self.assertEqual(json.loads((self.folder / 'walker_cuts.json').read_text()), {'robot': 'MTRAN', 'cuts': []})

    def test_parts_of_an_earlier_export_go(self):
        model = self.folder / 'row.m3l'
        model.write_text(row(100))
        path = self.folder / 'robot.xml'
        parts = self.folder / 'robot_parts'
        export('mjcf', path, '--robot', 'row', model=model)
        deep = sorted(parts.iterdir())
        self.assertGreater(len(deep), 1)
        notes = parts / 'notes.xml'
        notes.write_text('mine')
        model.write_text(row(40))
        export('mjcf', path, '--robot', 'row', model=model)
        self.assertEqual(sorted(parts.iterdir()), [deep[0], notes])
        self.assertIn('robot_parts/1.xml', path.read_text())
        notes.unlink()
        export('mjcf', path, '--robot', 'quadruped')
        self.assertFalse(parts.exists())

    def test_no_output_takes_the_place_of_an_input(self):
        model = self.folder / 'in.m3l'
        model.write_text(pathlib.Path(MODEL).read_text())
        user = self.folder / 'in.h'
        user.write_text('import "in.m3l"\n')
        link = self.folder / 'link'
        link.symlink_to('in.m3l')
        picture = self.folder / 'link.svg'
        picture.symlink_to('in.m3l')
        program = self.folder / 'walk.dyn'
        program.write_text((SOURCE / 'models/programs/quadruped.dyn').read_text())
        keywords = self.folder / 'mtran.xml'
        export('xml', keywords, '--module', 'MTRAN')
        files = {path: path.read_bytes() for path in self.folder.iterdir()}
        robot = ('--robot', 'quadruped')
        compiled = (MORPHBUS, 'compile', program)
        for command in (
                (MORPHBUS, 'export', user, *robot, '--to', 'urdf', '-o', user),
                (MORPHBUS, 'export', user, *robot, '--to', 'urdf', '-o', model),
                (MORPHBUS, 'export', model, '--to', 'model', '-o', link),
                (MORPHBUS, 'export', user, *robot, '--to', 'c', '-o', self.folder / 'in.c'),  # Its header.
                (*compiled, '--model', user, '-o', program), (*compiled, '--model', user, '-o', model),
                (*compiled, '--keywords', keywords, '-o', keywords),
                (MORPHBUS, 'graph', user, *robot, '--dot', model), (MORPHBUS, 'draw', user, *robot, '-o', picture),
                (MORPHBUS, 'variants', user, *robot, '-o', link),
                (MORPHBUS, 'run', model, program, *robot, '--seconds', 1, '--inproc', '--log', program)):
            with self.subTest(' '.join(map(str, command[1:]))):
                done = run(command, status=2)
                self.assertIn('this command reads that file; name another', done.stderr)
                self.assertNotIn('warning', done.stderr)
                self.assertEqual({path: path.read_bytes() for path in self.folder.iterdir()}, files)
        log = self.folder / 'run.log'
        log.write_text('anything')
        picture = self.folder / 'run.svg'
        picture.symlink_to('run.log')
        for command in ((MORPHBUS, 'compare', log, log, '--report', log),
                        (MORPHBUS, 'draw', log, '--at', 0, '-o', picture)):
            self.assertIn('this command reads that file', run(command, status=2).stderr)
        self.assertEqual(log.read_text(), 'anything')

    def test_meshes_lie_beside_the_file_and_are_closed(self):
        for to in ('urdf', 'sdf'):
            path = self.folder / to / f'walker.{to}'
            path.parent.mkdir()
            export(to, path, '--robot', 'quadruped')
            meshes = sorted(p.name for p in (path.parent / 'walker_meshes').iterdir())
            # A mesh for each hull, and one for each part of what is seen: a block with three faces, and the bar.
            self.assertEqual(meshes, sorted(
                [f'MTRAN.{link}.stl' for link in ('active_block', 'connecting_bar', 'passive_block')] +
                [f'MTRAN.{block}.look{n}.stl' for block in ('active_block', 'passive_block') for n in (1, 2, 3, 4)] +
                ['MTRAN.connecting_bar.look1.stl']))
            text = path.read_text()
            for mesh in meshes:
                self.assertIn(f'walker_meshes/{mesh}', text)
                edges = set()
                volume = 0.0
                for a, b, c in read_stl(path.parent / 'walker_meshes' / mesh):
                    edges |= {(a, b), (b, c), (c, a)}
                    volume += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2])
                               + a[2] * (b[0] * c[1] - b[1] * c[0])) / 6
                self.assertTrue(all((b, a) in edges for a, b in edges), 'a hole')
                self.assertGreater(volume, 1e-7, 'inside out')

    def test_a_prefix_stands_before_the_paths_of_meshes(self):
        for to, element in (('urdf', 'filename="'), ('sdf', '<uri>')):
            path = self.folder / f'walker.{to}'
            export(to, path, '--robot', 'quadruped', '--mesh-prefix', 'package://zoo/')
            text = path.read_text()
            # Of nine modules three hulls each, and nine parts of what is seen.
            self.assertEqual(text.count(element), 9 * (3 + 9))
            self.assertEqual(text.count(f'{element}package://zoo/walker_meshes/MTRAN.'), 9 * (3 + 9))
        said = export('mjcf', path, '--robot', 'quadruped', '--mesh-prefix', 'x/', status=2).stderr
        self.assertIn('leave out --mesh-prefix', said)

    def test_places_that_cannot_be_written_to_leave_nothing_behind(self):
        there = self.folder / 'there'
        there.mkdir()
        for to, output, words in (
                ('urdf', there, 'that is a folder'), ('urdf', f'{self.folder}/new/', 'there is no folder'),
                ('sdf', f'{there}/', 'that is a folder'), ('c', there / 'q.h', 'belongs beside it'),
                ('c', there / 'a"b.c', 'no quotes'), ('urdf', self.folder / 'none/x.urdf', 'there is no folder')):
            said = export(to, output, '--robot', 'quadruped', status=2).stderr
            self.assertIn(words, said)
            self.assertNotIn('warning', said)
            self.assertEqual([str(p) for p in self.folder.rglob('*')], [str(there)])

    def test_a_pipe_gets_the_main_file_alone(self):
        pipe = self.folder / 'pipe'
        os.mkfifo(pipe)
        reader = subprocess.Popen(['cat', pipe], stdout=subprocess.PIPE, text=True)
        said = export('urdf', pipe, '--robot', 'quadruped').stderr
        self.assertIn('</robot>', reader.communicate(timeout=60)[0])
        self.assertIn('quadruped_meshes/MTRAN.active_block.stl belongs to this output', said)
        self.assertEqual([p.name for p in self.folder.iterdir()], ['pipe'])

    def test_a_redirected_stream_gets_the_main_file_where_it_stands(self):
        for name in ('/dev/stdout', '/dev/fd/1', '/proc/self/fd/1'):
            target = self.folder / 'target'
            target.write_text('before\n')
            with open(target, 'a') as stream:
                done = subprocess.run([str(MORPHBUS), 'export', MODEL, '--robot', 'quadruped', '--to', 'urdf', '-o', name],
                                      stdout=stream, stderr=subprocess.PIPE, text=True, timeout=120)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn('quadruped_meshes/MTRAN.active_block.stl belongs to this output', done.stderr)
            self.assertRegex(target.read_text(), r'(?s)^before\n<\?xml.*</robot>\n$')
            self.assertEqual([p.name for p in self.folder.iterdir()], ['target'])

    def test_companions_lie_beside_the_target_of_a_link(self):
        there = self.folder / 'there'
        there.mkdir()
        link = self.folder / 'link.urdf'
        link.symlink_to('there/walker.urdf')
        for _ in range(2):  # First the link points to nothing yet.
            export('urdf', link, '--robot', 'quadruped')
            self.assertTrue(link.is_symlink())
            self.assertEqual(sorted(p.name for p in there.iterdir()),
                             ['walker.urdf', 'walker_cuts.json', 'walker_meshes'])
            self.assertEqual(sorted(p.name for p in self.folder.iterdir()), ['link.urdf', 'there'])
            self.assertIn('walker_meshes/MTRAN.', link.read_text())

    def test_thousands_of_warnings_are_counted_not_listed(self):
        model = self.folder / 'rings.m3l'
        model.write_text(hubs(12))
        path = self.folder / 'robot.urdf'
        said = export('urdf', path, '--robot', 'hubs', model=model).stderr.splitlines()
        # Each hub has a connection left out, a joint cut, and a joint that can move here.
        cuts = json.loads((self.folder / 'robot_cuts.json').read_text())['cuts']
        self.assertEqual(len(cuts), 24)
        for words in ('is left out; nothing is lost', 'is cut; ', 'can move here'):
            self.assertEqual(sum(words in line for line in said), 10)
            self.assertEqual(path.read_text().count(words), 12)
        self.assertEqual([line for line in said if 'more' in line], ['morphbus: warning: and 2 more like the last'] * 3)
        checked = run([MORPHBUS, 'check', model]).stdout
        locked = next(line for line in checked.splitlines() if 'locked by loops' in line and 'and' in line)
        self.assertRegex(locked, r'^  locked by loops: (\S+, ){9}\S+ and 14 more$')

    def test_graphviz_draws_the_graphs(self):
        assembly = self.folder / 'assembly.dot'
        export('dot', assembly, '--robot', 'quadruped')
        graph = self.folder / 'graph.dot'
        run([MORPHBUS, 'graph', MODEL, '--robot', 'quadruped', '--dot', graph])
        # Nodes, edges and clusters of the assembly; bodies and joints of the kinematic graph.
        for path, nodes, edges, clusters in ((assembly, 27, 28, 9), (graph, 18, 18, 0)):
            done = run(['dot', '-Tsvg', path])
            self.assertEqual(done.stderr, '')
            drawn = ElementTree.fromstring(done.stdout)
            kinds = [element.get('class') for element in drawn.iter() if element.get('class')]
            self.assertEqual([kinds.count(kind) for kind in ('node', 'edge', 'cluster')], [nodes, edges, clusters])

    def test_nothing_else_is_left_behind(self):
        export('c', self.folder / 'robot.c', '--robot', 'quadruped')
        self.assertEqual(sorted(p.name for p in self.folder.iterdir()), ['robot.c', 'robot.h'])
        export('c', self.folder / 'module.c', '--module', 'MTRAN')
        self.assertEqual(sorted(p.name for p in self.folder.iterdir()),
                         ['module.c', 'module.h', 'morphbus_kinematics.h', 'robot.c', 'robot.h'])
        said = export('c', '-', '--robot', 'quadruped')
        self.assertIn('quadruped.h', said.stderr)
        self.assertIn('sinf', said.stdout)

    def test_two_exports_are_alike(self):
        for to in ('urdf', 'sdf', 'mjcf', 'c'):
            for name in ('a', 'b'):
                (self.folder / name).mkdir(exist_ok=True)
                export(to, self.folder / name / f'robot.{to}', '--robot', 'quadruped')
            first, second = ((self.folder / name / f'robot.{to}').read_text() for name in ('a', 'b'))
            self.assertEqual(first, second)

    def test_the_help_names_every_format_that_there_is(self):
        said = ' '.join(run([MORPHBUS, 'export', '--help']).stdout.split())
        listed = export('none', self.folder / 'x', status=2).stderr.partition('expected one of ')[2].strip()
        self.assertGreater(listed.count(','), 7)
        self.assertIn(f'--to {listed.replace(", ", "|")} ', said)
        self.assertIn('For urdf, sdf:', said)
        self.assertIn('(for kinematics, xml: default', said)

    def test_requests_that_make_no_sense(self):
        path = self.folder / 'x'
        for to, of, words in (
                ('urdf', ('--robot', 'quadruped', '--module', 'MTRAN'), 'not both'),
                ('xml', ('--robot', 'quadruped'), 'leave out --robot'),
                ('model', ('--robot', 'quadruped'), 'leave out --robot'),
                ('dot', ('--module', 'MTRAN'), 'leave out --module'),
                ('urdff', ('--robot', 'quadruped'), "did you mean 'urdf'?"),
                ('step', ('--robot', 'quadruped'), 'expected one of'),
                ('urdf', (), 'choose one with --robot'),
                ('urdf', ('--robot', 'quadrupd'), "did you mean 'quadruped'"),
                ('c', ('--module', 'MTRN'), "no module 'MTRN' (did you mean 'MTRAN'?)"),
                ('c', ('--module', 'ATRON'), "no module 'ATRON'; it has MTRAN")):
            self.assertIn(words, export(to, path, *of, status=2).stderr)
            self.assertFalse(path.exists())
        several = export('kinematics', path, model=SOURCE / 'models' / 'revolve2.m3l', status=2).stderr
        self.assertIn('the model has several modules; choose one with --module: CORE, ', several)
        self.assertIn('cannot', export('urdf', '/nowhere/at/all/x.urdf', '--robot', 'quadruped', status=2).stderr)


class Keywords(Case):
    def check(self, path, status=0):
        return run(['xmllint', '--noout', '--relaxng', SCHEMA, path], status)

    def test_every_module_type_of_every_model_fits_the_schema(self):
        models = [str(path) for path in sorted((SOURCE / 'models').glob('*.m3l'))]
        seen = 0
        for model in models:
            for name in module_types(model):
                path = self.folder / f'{name}.xml'
                export('xml', path, '--module', name, model=model)
                self.check(path)
                seen += 1
        self.assertGreater(seen, 0)

    def test_states_of_all_types_fit(self):
        model = self.folder / 'states.m3l'
        model.write_text('module STATES: unit=0.1\n'
                         'point p: coords=(0,0,0), connector, mode=["slow","fast"], turns=[bool]\n'
                         'link body: (point a: coords=(1,0,0)) (point b: coords=(0,1,0)) (point c: coords=(0,0,1))\n'
                         '  grouping=(p), hull=convex(body.point, p.point), mass=0.1\n')
        path = self.folder / 'states.xml'
        export('xml', path, '--module', 'STATES', model=str(model))
        self.assertIn('<value>slow</value>', path.read_text())
        self.check(path)

    def test_what_the_compiler_refuses_the_schema_refuses(self):
        good = self.folder / 'mtran.xml'
        export('xml', good, '--module', 'MTRAN')
        program = str(SOURCE / 'models/programs/quadruped.dyn')
        text = good.read_text()
        for old, new in (('version="1" name', 'version="2" name'), ('LINK_ACTIVE_BLOCK', 'ACTIVE_BLOCK'),
                         ('keyword="C1"', 'keyword="c1"'), ('type="revolute"', 'type="ball"'),
                         (' keyword="JOINT_1"', ''), ('<connector', '<plug'), ('type="bool"', 'type="number"'),
                         ('name="c1"', 'name=""'), ('name="c1"', 'name="c1" gender="male"')):
            self.assertIn(old, text)
            bad = self.folder / 'bad.xml'
            bad.write_text(text.replace(old, new).replace('</connector', '</plug')
                           if new == '<plug' else text.replace(old, new, 1))
            ElementTree.parse(bad)
            self.check(bad, status=3)
            run([MORPHBUS, 'compile', program, '--keywords', bad, '-o', self.folder / 'image'], status=2)

    def test_schema_and_compiler_agree(self):
        good = self.folder / 'mtran.xml'
        export('xml', good, '--module', 'MTRAN')
        text = good.read_text()
        program = str(SOURCE / 'models/programs/quadruped.dyn')
        state = '<state name="s" keyword="S" type="{}">{}</state>'

        def with_state(kind, values):
            changed = re.sub(r'(<connector name="c4" keyword="C4") ?/>',
                             r'\1>' + state.format(kind, values) + '</connector>', text)
            self.assertNotEqual(changed, text)
            return changed

        def with_root(attributes):
            return text.replace('<module ', f'<module {attributes} ', 1)

        cases = [
            (True, text), (True, text + '<!-- the end -->\n'), (False, text + '<module version="1" name="M"/>\n'),
            (False, text + 'x'), (True, with_state('string', '<value>a<!-- x -->b</value>')),
            (False, with_state('string', '<value>a<b/></value>')), (False, with_state('string', '<value a="b"/>')),
            (True, with_state('string', '<value> </value> <value/>')), (False, with_state('string', 'x<value/>')),
            (False, with_state('string', '')), (False, with_state('bool', '<value/>')), (True, with_state('bool', ' ')),
            (False, with_state(' bool', '')), (False, with_root('xmlns="urn:x"')), (True, with_root('xmlns:x="urn:x"')),
            (False, text.replace('version="1" name', 'version=" 1" name')),
            (False, text.replace('type="revolute"', 'type="revolute "', 1)),
            (False, text.replace('LINK_ACTIVE_BLOCK', 'LINK_')), (True, text.replace('LINK_ACTIVE_BLOCK', 'LINK_X')),
            (True, text.replace('name="c4"', f'name="{"é" * 200}"')),
            (True, text.replace('name="c4"', f'name="{"é" * 255}"')),
            (False, text.replace('name="c4"', f'name="{"é" * 256}"')),
        ]
        for number in ('1', '-1', '1.', '.5', '1.5e3', '1e+3', '2E-3', '-0', '00'):
            cases.append((True, with_state('number', f'<value>{number}</value>')))
        for number in (' 1 ', '+1', 'infinity', '-inf', 'INF', 'nan', 'NaN', '0x1', '1e', '.', '', '1,5', '1 2'):
            cases.append((False, with_state('number', f'<value>{number}</value>')))
        path = self.folder / 'case.xml'
        for is_good, case in cases:
            path.write_text(case, encoding='utf-8')
            words = ['xmllint', '--noout', '--relaxng', SCHEMA, path]
            compiles = [MORPHBUS, 'compile', program, '--keywords', path, '-o', self.folder / 'image']
            with self.subTest(case[-600:]):
                self.assertEqual(subprocess.run(words, capture_output=True).returncode == 0, is_good)
                self.assertEqual(subprocess.run(compiles, capture_output=True).returncode, 0 if is_good else 2)


if __name__ == '__main__':
    main()
