#!/usr/bin/env python3
"""morphbus new: modules, programs and projects to begin with."""
import re
import unittest

from support import SOURCE, Case, morphbus

MODELS = SOURCE / 'models'


class Beginnings(Case):
    def test_a_new_project_checks_runs_and_sweeps(self):
        made = self.folder / 'my walker'
        morphbus('new', 'project', made)
        self.assertEqual(sorted(path.name for path in made.iterdir()), ['README.md', 'amplitude.toml', 'module.m3l', 'wave.dyn'])
        morphbus('format', '--check', made / 'module.m3l', made / 'wave.dyn')
        morphbus('check', made / 'module.m3l')
        run = morphbus('run', made / 'module.m3l', made / 'wave.dyn', '--seconds', 8, '--inproc', '--no-log').stdout
        self.assertIn('no faults', run)
        # It walks on its own: more than half a module's length in each wave.
        self.assertGreater(float(re.search(r'a cycle ([\d.]+) mm forward', run)[1]), 50)
        plan = morphbus('sweep', made / 'amplitude.toml', '--dry-run').stdout
        self.assertIn('18', plan)
        readme = (made / 'README.md').read_text()
        self.assertTrue(readme.startswith('# my walker\n'))

    def test_a_new_module_and_program(self):
        module, program = self.folder / 'knee-joint.m3l', self.folder / 'w.dyn'
        morphbus('new', 'module', module)
        self.assertIn('module KNEE_JOINT:', module.read_text())
        morphbus('new', 'program', program, '--model', MODELS / 'mtran.m3l')
        self.assertIn('self.JOINT_1', program.read_text())
        morphbus('roles', MODELS / 'mtran.m3l', program, '--robot', 'quadruped')
        morphbus('format', '--check', module, program)

    def test_what_is_there_stays(self):
        module = self.folder / 'm.m3l'
        module.write_text('mine')
        said = morphbus('new', 'module', module, status=2).stderr
        self.assertIn('is there already', said)
        self.assertEqual(module.read_text(), 'mine')
        morphbus('new', 'module', module, '--force')
        self.assertNotEqual(module.read_text(), 'mine')
        self.assertIn('ends in .m3l', morphbus('new', 'module', self.folder / 'm.txt', status=2).stderr)
        self.assertIn('begins with a letter', morphbus('new', 'module', self.folder / '1.m3l', status=2).stderr)
        project = self.folder / 'p'
        project.mkdir()
        (project / 'wave.dyn').write_text('mine')
        morphbus('new', 'project', project, status=2)
        self.assertIn('FOLDER is empty', morphbus('new', 'project', '', status=2).stderr)
        self.assertEqual([path.name for path in project.iterdir()], ['wave.dyn'])
        self.assertIn('no module type of the model has a joint that turns', self.refused_model())

    def refused_model(self):
        model = self.folder / 'block.m3l'
        model.write_text('module BLOCK: unit=0.1\nlink body: hull=box(size=(1, 1, 1)), mass=1\nrobot r: modules=(BLOCK m)\n')
        return morphbus('new', 'program', self.folder / 'b.dyn', '--model', model, status=2).stderr


if __name__ == '__main__':
    unittest.main()
