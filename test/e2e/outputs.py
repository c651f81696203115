#!/usr/bin/env python3
"""What an output may take the place of (docs/cli.md, Files), and what is left when it cannot be written."""
import unittest

from support import MODEL, PROGRAM, Case, morphbus

ROBOT = ('--robot', 'quadruped')
MINE = '// A model of mine, and no output.\n'


class Outputs(Case):
    def outputs(self):
        """Every command that writes a file: (its arguments, the name of the output)."""
        formats = [('urdf', ROBOT), ('sdf', ROBOT), ('mjcf', ROBOT), ('webots', ROBOT), ('dot', ROBOT), ('c', ROBOT),
                   ('xml', ('--module', 'MTRAN')), ('kinematics', ('--module', 'MTRAN')), ('model', ())]
        log = self.folder / 'walk.log'
        if not log.exists():
            morphbus('run', MODEL, PROGRAM, *ROBOT, '--seconds', 1, '--inproc', '--log', log)
        return [(('export', MODEL, *of, '--to', target, '-o'), f'x.{target}') for target, of in formats] + [
            (('compile', PROGRAM, '--model', MODEL, '-o'), 'x.image'),
            (('draw', MODEL, *ROBOT, '-o'), 'x.svg'),
            (('draw', MODEL, *ROBOT, '-o'), 'x.png'),
            (('build', MODEL, *ROBOT, '-o'), 'x.pdf'),
            (('build', MODEL, *ROBOT, '-o'), 'sheet.html'),
            (('graph', MODEL, *ROBOT, '--dot'), 'graph.dot'),
            (('variants', MODEL, *ROBOT, '--max', 1, '-o'), 'variants.m3l'),
            (('compare', log, log, '--report'), 'report.html'),
            (('repair', log, '-o'), 'sound.log'),
            (('run', MODEL, PROGRAM, *ROBOT, '--seconds', 1, '--inproc', '--log'), 'run.log'),
        ]

    def test_a_file_of_another_kind_stays_unless_forced(self):
        for arguments, name in self.outputs():
            output = self.folder / name
            for mine in (MINE, '\n\n', '<?xml version="1.0"?>\n<mine/>\n'):
                output.write_text(mine)
                said = morphbus(*arguments, output, status=2).stderr
                self.assertIn('--force', said, name)
                self.assertIn(str(output), said)
                self.assertEqual(output.read_text(), mine, name)
            morphbus(*arguments, output, '--force')
            self.assertNotEqual(output.read_bytes(), MINE.encode(), name)

    def test_an_output_replaces_its_like_and_an_empty_file_and_no_other_kind(self):
        written = []
        for arguments, name in self.outputs():
            output = self.folder / name
            output.write_text('')
            morphbus(*arguments, output)
            self.assertGreater(output.stat().st_size, 0, name)
            morphbus(*arguments, output)
            written.append((arguments, output, output.read_bytes()))
        alike = {'x.dot', 'graph.dot'}, {'sheet.html', 'report.html'}, {'run.log', 'sound.log', 'walk.log'}
        for i, (arguments, output, _) in enumerate(written):
            for _, other, content in (written * 2)[i + 1:i + 4]:
                if any({output.name, other.name} <= names for names in alike):
                    continue
                output.write_bytes(content)
                morphbus(*arguments, output, status=2)

    def test_a_log_spares_a_file_that_has_its_temporary_name(self):
        for arguments, name in self.outputs()[-2:]:
            partial = self.folder / f'{name}.partial'
            partial.write_text(MINE)
            self.assertIn(str(partial), morphbus(*arguments, self.folder / name, status=2).stderr)
            self.assertEqual(partial.read_text(), MINE)

    def test_a_model_is_not_replaced_by_the_log_of_its_run(self):
        other = self.folder / 'other.m3l'
        other.write_bytes(MODEL.read_bytes())
        for command in ('run', 'log'):
            arguments = ('--run', 'walk') if command == 'log' else ('--inproc',)
            said = morphbus(command, MODEL, PROGRAM, *ROBOT, '--seconds', 1, *arguments, '--log', other, status=2).stderr
            self.assertIn('a file that is not a log is there', said)
        self.assertEqual(other.read_bytes(), MODEL.read_bytes())

    def test_an_input_is_not_replaced_even_if_forced(self):
        model = self.folder / 'model.m3l'
        model.write_bytes(MODEL.read_bytes())
        said = morphbus('variants', model, *ROBOT, '-o', model, '--force', status=2).stderr
        self.assertIn('this command reads that file', said)
        self.assertEqual(model.read_bytes(), MODEL.read_bytes())

    def test_what_lies_beside_an_export_is_spared_as_well(self):
        for target, beside in (('urdf', 'x_meshes/MTRAN.active_block.stl'), ('urdf', 'x_cuts.json'), ('c', 'x.h')):
            (self.folder / 'x.urdf').unlink(missing_ok=True)
            mine = self.folder / beside
            mine.parent.mkdir(exist_ok=True)
            mine.write_text(MINE)
            arguments = ('export', MODEL, *ROBOT, '--to', target, '-o', self.folder / f'x.{target}')
            self.assertIn(str(mine), morphbus(*arguments, status=2).stderr)
            self.assertEqual(mine.read_text(), MINE)
            self.assertFalse((self.folder / f'x.{target}').exists())
            morphbus(*arguments, '--force')
            self.assertNotEqual(mine.read_bytes(), MINE.encode())
            morphbus(*arguments)

    def test_a_failed_export_leaves_nothing_behind(self):
        # Its companions fit beside it; its own name leaves no room for that of a temporary file.
        folder = self.folder / 'export'
        folder.mkdir()
        for target in ('urdf', 'webots'):
            morphbus('export', MODEL, *ROBOT, '--to', target, '-o', folder / ('x.' + 'y' * 250), status=2)
            self.assertEqual(list(folder.iterdir()), [], target)


if __name__ == '__main__':
    unittest.main()
