#!/usr/bin/env python3
"""`roles`: why a module takes no role, with carets in both files; what a role asks of a module; which programs fit."""
import re
import unittest

from support import MODEL, PROGRAM, SOURCE, Case, as_json, morphbus

CAR = SOURCE / 'models' / 'programs' / 'car.dyn'
NOBODY = """// Nobody has so many neighbours, and no joint lies along one axis only.
role Hermit extends Module {
  require sizeof(self.connected) == 9;  // of six connectors
}
role Pair extends Module {
  require sizeof(self.connected) >= 2 && sizeof(self.connected) < 4;
  label odd = self.joints($EAST_WEST, 1);
  label link = $LINK_CONNECTING_BAR;
}
"""


class Roles(Case):
    def program(self, text, name='x.dyn'):
        path = self.folder / name
        path.write_text(text)
        return path

    def roles(self, program, *options, robot='quadruped', status=0):
        return morphbus('roles', MODEL, program, '--robot', robot, *options, status=status).stdout

    def test_a_module_without_a_role_is_shown_in_the_model_and_in_the_program(self):
        program = self.program(NOBODY)
        said = self.roles(program, status=1)
        line = next(i for i, text in enumerate(MODEL.read_text().splitlines(), 1) if 'MTRAN m1,' in text)
        self.assertIn(f'{MODEL}:{line}:18: warning: module m1 takes no role\n'
                      '    modules=(MTRAN m1, MTRAN m2, MTRAN m3, MTRAN m4, MTRAN m5, MTRAN m6, MTRAN m7, MTRAN m8,\n'
                      '                   ^~\n'
                      f'{program}:3:3: note: not Hermit: this requirement fails, measured 1 against 9\n'
                      '    require sizeof(self.connected) == 9;  // of six connectors\n'
                      '    ^~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~\n'
                      f'{program}:6:3: note: not Pair: this requirement fails, measured 1 against 2\n', said)
        self.assertIn(f'{program}:7:3: note: not Pair: label odd fits no joints, and one is wanted\n', said)
        # The hub has four neighbours: its requirement fails before its label does.
        self.assertIn('note: not Pair: this requirement fails, measured 4 against 4\n', said)
        self.assertRegex(said, f'{program}:[0-9]+:[0-9]+: warning: no module of robot quadruped takes role Hermit\n')
        answer = as_json('roles', MODEL, program, '--robot', 'quadruped', status=1)
        self.assertEqual(answer['unplayed'], ['Hermit', 'Pair'])
        self.assertIn("m2: not Pair: label odd fits no joints, and one is wanted", answer['problems'])

    def test_a_program_that_asks_for_module_numbers_is_marked(self):
        program = self.program('role R extends Module {\n  behavior b() {\n    if (self.id == 3) self.sleepds(2);\n    self.sleepds(1);\n  }\n}\n')
        said = self.roles(program)
        self.assertIn(f"{program}:3:5: warning: the program asks for the module's number", said)
        self.assertEqual(as_json('roles', MODEL, program, '--robot', 'quadruped')['id_lines'], [3])

    def test_an_image_has_no_text_to_show_and_says_the_same(self):
        program = self.program(NOBODY)
        morphbus('compile', program, '--model', MODEL, '-o', self.folder / 'x.image')
        said = self.roles(self.folder / 'x.image', status=1)
        self.assertIn('module m1 takes no role: not Hermit: this requirement fails, measured 1 against 9', said)

    def test_two_roles_that_fit_are_shown_with_the_module(self):
        program = self.program('role Left extends Module {\n  label a = self.JOINT_1;\n}\n'
                               'role Right extends Module {\n  label b = self.JOINT_2;\n}\n')
        said = self.roles(program)
        self.assertIn('warning: module m1 plays Left\n', said)
        self.assertRegex(said, f'{program}:[12]:[13]: note: role Left and role Right both fit this module')
        self.assertIn('warning: no module of robot quadruped takes role Right\n', said)

    def test_a_role_that_nobody_takes_is_shown_with_the_module_that_comes_nearest(self):
        program = self.program('role Hub extends Module {\n  require sizeof(self.connected) == 4;\n}\n'
                               'role Tower extends Module {\n'
                               '  require sizeof(self.connected) >= 3;\n'
                               '  require self.connected($UP) == 2;  // nobody is on top\n'
                               '}\nrole Also extends Module {\n  require sizeof(self.connected) == 4;\n}\n')
        said = self.roles(program)
        # m2 is the first with three neighbours, and so the first that comes to the second requirement.
        line, text = next((i, text) for i, text in enumerate(MODEL.read_text().splitlines(), 1) if 'MTRAN m2,' in text)
        column = text.index('m2') + 1
        # The role stands at the first line of its code.
        self.assertIn(f'{program}:5:3: warning: no module of robot quadruped takes role Tower\n'
                      '    require sizeof(self.connected) >= 3;\n'
                      '    ^~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~\n'
                      '  hint: --why m2 Tower tells what it lacks\n'
                      f'{MODEL}:{line}:{column}: note: module m2 comes nearest\n'
                      f'  {text}\n'
                      f'  {" " * (column - 1)}^~\n'
                      f'{program}:6:3: note: not Tower: this requirement fails, measured 0 against 2\n'
                      '    require self.connected($UP) == 2;  // nobody is on top\n'
                      '    ^~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~\n', said)
        # One that fits, but whose place another role has.
        self.assertIn('note: module m5 fits it, and has another role\n', said)
        # An image has no text to point at.
        morphbus('compile', program, '--model', MODEL, '-o', self.folder / 'x.image')
        said = self.roles(self.folder / 'x.image')
        self.assertIn('note: module m2 comes nearest: not Tower: this requirement fails, measured 0 against 2\n', said)

    def test_an_axis_that_is_off_is_told_with_both_places_and_the_angle(self):
        source = ('role Tilted extends Module {\n  startup s() {\n'
                  '    self.setJointAxis(self.JOINT_1, $LINK_ACTIVE_BLOCK, $NORTH_SOUTH);\n  }\n}\n')
        program = self.program(source)
        problems = as_json('roles', MODEL, program, '--robot', 'quadruped')['problems']
        self.assertTrue(problems)
        for problem in problems:
            self.assertRegex(problem, f'^m[0-9]: {program}:3: .*NORTH_SOUTH.*which is 90.0° off')
        said = self.roles(program)
        line, text = next((i, text) for i, text in enumerate(MODEL.read_text().splitlines(), 1) if 'MTRAN m1,' in text)
        column = text.index('m1') + 1
        told = (f'{MODEL}:{line}:{column}: warning: module m1 plays Tilted\n'
                f'  {text}\n'
                f'  {" " * (column - 1)}^~\n'
                f'{program}:3:5: note: ')
        self.assertIn(told, said)
        note = said[said.index(told) + len(told):].splitlines()
        self.assertRegex(note[0], r'joint_1 turns link active_block about a direction .*NORTH_SOUTH.*'
                                  r'which is 90.0° off, either way, and may be 75° off at most')
        call = source.splitlines()[2]
        self.assertEqual(note[1:3], ['  ' + call, '  ' + ' ' * 4 + '^' + '~' * (len(call.strip()) - 1)])

    def test_why_evaluates_everything_that_the_role_asks_for(self):
        program = self.program(NOBODY)
        why = as_json('roles', MODEL, program, '--robot', 'quadruped', '--why', 'm5', 'Pair', status=1)
        self.assertEqual((why['module'], why['role'], why['fits']), ('m5', 'Pair', False))
        self.assertEqual((why['held'], why['lacks'], why['abstract'], why['has_pose']), (None, None, False, True))
        self.assertEqual([(p['kind'], p['label'], p['line'], p['holds'], p['finding']) for p in why['parts']],
                         [('label', 'odd', 7, False, 'fits no joints, and one is wanted'),
                          ('label', 'link', 8, True, 'is connecting_bar'),
                          ('requirement', None, 6, False, 'does not hold, measured 4 against 2 and 4 against 4')])
        said = self.roles(program, '--why', 'm2', 'Pair', status=1)
        self.assertIn('m2 does not fit Pair; it has no role\n', said)
        self.assertIn(f'{program}:6:3: note: holds, measured 3 against 2 and 3 against 4\n', said)
        fits = as_json('roles', MODEL, PROGRAM, '--robot', 'quadruped', '--why', 'm5', 'Junction')
        self.assertEqual((fits['fits'], fits['held'], {p['holds'] for p in fits['parts']}), (True, 'Junction', {True}))

    def test_why_without_a_role_tells_what_every_role_lacks(self):
        program = self.program(NOBODY + 'role Any extends Module {\n}\n')
        why = as_json('roles', MODEL, program, '--robot', 'quadruped', '--why', 'm5')
        self.assertEqual((why['module'], why['held']), ('m5', 'Any'))
        self.assertEqual([(role['role'], role['fits']) for role in why['roles']],
                         [('Hermit', False), ('Pair', False), ('Any', True)])
        # What a role says alone is what it says among all.
        alone = as_json('roles', MODEL, program, '--robot', 'quadruped', '--why', 'm5', 'Pair', status=1)
        self.assertEqual(why['roles'][1], alone)
        said = self.roles(program, '--why', 'm5')
        self.assertTrue(said.startswith('m5: it has role Any\n'), said)
        self.assertIn(f'\ndoes not fit Hermit\n{program}:3:3: note: does not hold, measured 4 against 9\n', said)
        self.assertIn('\nfits Any\n', said)
        self.assertNotIn('is connecting_bar', said)
        none = self.program('abstract role A extends Module {\n}\n', 'none.dyn')
        done = morphbus('roles', MODEL, none, '--robot', 'quadruped', '--why', 'm5', status=2)
        self.assertIn('no roles that a module could take', done.stderr)

    def test_why_names_what_there_is_not(self):
        for words, told in ((('m55', 'Junction'), "no module 'm55' (did you mean 'm5'?)"),
                            (('m5', 'Junctoin'), "no role 'Junctoin' (did you mean 'Junction'?)"),
                            ((), '1 required MODULE [ROLE] missing')):
            done = morphbus('roles', MODEL, PROGRAM, '--robot', 'quadruped', '--why', *words, status=2)
            self.assertIn(told, done.stderr)
        done = morphbus('roles', MODEL, PROGRAM, CAR, '--robot', 'quadruped', '--why', 'm5', 'Junction', status=2)
        self.assertIn('one program and one robot', done.stderr)

    def test_long_names_of_modules_keep_the_columns_in_line(self):
        # Words are replaced, so that the model stays as it is in all else.
        text = re.sub(r'\bm([1-9])\b', r'segment_number_\1', MODEL.read_text())
        model = self.folder / 'long.m3l'
        model.write_text(text)
        said = morphbus('roles', model, PROGRAM, '--robot', 'quadruped').stdout.splitlines()
        rows = [line for line in said if re.match('module|segment_', line)]
        self.assertEqual(len(rows), 10)
        for title in ('role', 'labels'):
            column = rows[0].index(title)
            for row in rows[1:]:
                self.assertRegex(row[column - 1:], '^( [^ ]|$)', f'{title} in {row}')

    def test_of_several_programs_it_says_which_fit(self):
        wheels = self.program('role Any extends Module {\n  startup s() { self.turnContinuous($JOINT_HUB); }\n}\n')
        some = self.program('role Hub extends Module {\n  require sizeof(self.connected) == 4;\n}\n', 'some.dyn')
        found = as_json('roles', MODEL, PROGRAM, CAR, wheels, some, '--robot', 'quadruped',
                        '--robot', 'equivalent_quadruped')
        self.assertEqual([(a['program'], a['robot'], a['compiles'], a['fits']) for a in found['answers']],
                         [(str(program), robot, compiles, fits) for program, compiles, fits in
                          ((PROGRAM, True, 'yes'), (CAR, True, 'no'), (wheels, False, 'no'), (some, True, 'partly'))
                          for robot in ('quadruped', 'equivalent_quadruped')])
        alone = as_json('roles', MODEL, PROGRAM, '--robot', 'quadruped')
        self.assertEqual(found['answers'][0]['modules'], alone['modules'])
        self.assertEqual(found['unplayed'],
                         {str(PROGRAM): [], str(CAR): ['Head', 'LeftWheel', 'RightWheel'], str(some): []})
        done = morphbus('roles', MODEL, CAR, wheels, '--robot', 'quadruped', '--robot', 'equivalent_quadruped',
                        status=1)
        self.assertIn('does not compile for this model', done.stdout)
        self.assertIn('no module of these robots takes Head, LeftWheel, RightWheel', done.stdout)
        # The compiler speaks once for all robots.
        self.assertEqual(done.stderr.count("unknown name '$JOINT_HUB'"), 1)
        said = morphbus('roles', MODEL, CAR, wheels, '--robot', 'quadruped', status=1).stdout
        self.assertIn('no module of robot quadruped takes Head, LeftWheel, RightWheel', said)

    def test_what_cannot_be_asked_is_no_answer(self):
        for arguments, told in (((PROGRAM, CAR, '--robot', 'quadrupde'), "did you mean 'quadruped'?"),
                                ((PROGRAM, self.folder / 'none.dyn', '--robot', 'quadruped'), 'none.dyn'),
                                ((PROGRAM, CAR, '--robot', 'quadruped', '--root', 'm77'), "no module 'm77'"),
                                ((PROGRAM, CAR), 'choose one with --robot')):
            done = morphbus('roles', MODEL, *arguments, status=2)
            self.assertIn(told, done.stderr)
            self.assertEqual(done.stdout, '')


if __name__ == '__main__':
    unittest.main()
