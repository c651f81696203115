#!/usr/bin/env python3
"""Programs of several files: compiled, run, explained, repeated, and told by file and line."""
import json
import unittest

from support import SOURCE, Case, as_json, morphbus

ROBOTS = SOURCE / 'models' / 'mtran_robots.m3l'
MAIN = """// A program of three files.
import "lib/counter.dyn";
role Loner extends Counter {
  require self.connected == 9;
}
role Member extends Counter {
  least = 1;
  startup s() {
    print("share", share(8, 2));
  }
}
"""
COUNTER = """import "../shares.dyn";
param begin = 2 in [0, 9];
abstract role Counter extends Module {
  least = 0;
  rest = begin;
  require sizeof(self.connected) >= 1;
  behavior count() {
    self.sleepds(2);
    rest -= 1;
    print("rest", share(8, rest));
  }
}
"""
SHARES = """// Shares of a whole.
function share(int whole, int parts) {
  return whole / parts;
}
"""


class Imports(Case):
    def setUp(self):
        super().setUp()
        self.main = self.folder / 'walk' / 'main.dyn'
        self.counter = self.folder / 'walk' / 'lib' / 'counter.dyn'
        self.shares = self.folder / 'walk' / 'shares.dyn'
        self.counter.parent.mkdir(parents=True)
        for path, text in ((self.main, MAIN), (self.counter, COUNTER), (self.shares, SHARES)):
            path.write_text(text)

    def run_it(self, log, *options, program=None, seconds=1):
        return as_json('run', ROBOTS, program or self.main, '--robot', 'snake', '--seconds', seconds, '--inproc', '--log', log, *options)

    def test_faults_prints_and_calls_are_told_by_file_and_line(self):
        log = self.folder / 'run.log'
        self.run_it(log)
        facts = as_json('info', log)
        faults = {(fault['file'], fault['line'], fault['function']) for fault in facts['faults']}
        self.assertEqual(faults, {(str(self.shares), 3, 'Module.share')})
        prints = {(line['text'], line['file'], line['line']) for line in facts['prints']}
        self.assertEqual(prints, {('share 4', str(self.main), 9), ('rest 8', str(self.counter), 10)})
        self.assertIn(f'{self.shares}:3: ', morphbus('info', log).stdout)
        # A module that runs again names them as the image does, which knows no folder.
        breaks = as_json('replay', log, '--into', 'm1', '--break', 'shares.dyn:3')['breaks']
        self.assertEqual([[(c['function'], c['file'], c['line']) for c in b['calls']] for b in breaks],
                         [[('Module.share', 'shares.dyn', 3), ('Member.s', 'main.dyn', 9)],
                          [('Module.share', 'shares.dyn', 3), ('Counter.count', 'lib/counter.dyn', 10)],
                          [('Module.share', 'shares.dyn', 3), ('Counter.count', 'lib/counter.dyn', 10)]])
        self.assertIn('in Module.share, shares.dyn:3', morphbus('replay', log, '--into', 'm1', '--break', 'shares.dyn:3').stdout)
        self.assertEqual(len(as_json('replay', log, '--into', 'm1', '--break', 9)['breaks']), 1)
        self.assertIn('no task of m1 came to line 3 of other.dyn',
                      morphbus('replay', log, '--into', 'm1', '--break', 'other.dyn:3').stderr)
        self.assertIn('expected a line', morphbus('replay', log, '--into', 'm1', '--break', 'shares.dyn:', status=2).stderr)
        steps = as_json('replay', log, '--into', 'm1', '--at', breaks[1]['seconds'], '--steps', 'lines')['steps']
        self.assertIn(('shares.dyn', 3), {(step['source'], step['line']) for step in steps})

    def test_a_run_is_repeated_when_its_files_are_gone(self):
        log = self.folder / 'run.log'
        self.run_it(log, '--set', 'begin=3')
        for path in (self.main, self.counter, self.shares):
            path.unlink()
        self.assertTrue(as_json('reproduce', log)['same'])
        self.assertEqual({fault['file'] for fault in as_json('info', log)['faults']}, {str(self.shares)})

    def test_an_image_goes_as_its_text_does(self):
        image = self.folder / 'main.image'
        morphbus('compile', self.main, '--model', ROBOTS, '-o', image)
        texts, images = self.folder / 'text.log', self.folder / 'image.log'
        self.assertEqual(self.run_it(texts)['hash'], self.run_it(images, program=image)['hash'])
        # What it was compiled from lay elsewhere, and only the image says how.
        self.assertEqual({fault['file'] for fault in as_json('info', images)['faults']}, {'shares.dyn'})
        listing = morphbus('disasm', image).stdout
        for place in ('; line 9', '; lib/counter.dyn:10', '; shares.dyn:3'):
            self.assertIn(place + '\n', listing)

    def test_roles_show_lines_of_all_files(self):
        self.counter.write_text(COUNTER.replace('>= 1', '== 9'))
        said = morphbus('roles', ROBOTS, self.main, '--robot', 'snake', status=1).stdout
        self.assertIn(f'{self.counter}:6:3: note: not Member: this requirement fails, measured 1 against 9\n'
                      '    require sizeof(self.connected) == 9;\n', said)
        problems = as_json('roles', ROBOTS, self.main, '--robot', 'snake', status=1)['problems']
        self.assertIn(f'm1: not Member: a requirement fails ({self.counter}:6: require sizeof(self.connected) == 9;), measured 1 against 9', problems)
        why = as_json('roles', ROBOTS, self.main, '--robot', 'snake', '--why', 'm1', 'Loner', status=1)
        self.assertEqual([(part['file'], part['line']) for part in why['parts']], [(str(self.counter), 6), (str(self.main), 4)])
        self.counter.write_text(COUNTER.replace('rest = begin;', 'rest = begin;\n  function me() {\n    return self.id;\n  }').replace('share(8, rest)', 'me()'))
        answer = as_json('roles', ROBOTS, self.main, '--robot', 'snake')
        self.assertEqual((answer['id_lines'], answer['id_places']), ([], [{'file': str(self.counter), 'line': 7}]))

    def test_programs_that_are_deployed_and_swept_have_their_files(self):
        other = self.folder / 'other.dyn'
        other.write_text('import "walk/shares.dyn";\nrole Other extends Module {\n  startup s() {\n    print("other", share(1, 0));\n  }\n}\n')
        log = self.folder / 'run.log'
        script = self.folder / 'script'
        script.write_text(f'20 deploy {other}\n')
        self.run_it(log, '--commands', script, seconds=6)
        self.assertIn(('walk/shares.dyn', 3), {(fault['file'], fault['line']) for fault in as_json('info', log)['faults']})
        sweep = self.folder / 'sweep.toml'
        sweep.write_text(f'model = "{ROBOTS}"\nrobot = "snake"\nprogram = "walk/main.dyn"\nseconds = 0.2\n[set]\nbegin = [2, 3]\n')
        morphbus('sweep', sweep)
        morphbus('sweep', 'export', sweep, '--to', 'csv', '-o', self.folder / 'rows.csv')
        self.assertEqual(len((self.folder / 'rows.csv').read_text().splitlines()), 3)

    def test_what_is_wrong_is_told_where_it_stands(self):
        self.shares.unlink()
        said = morphbus('compile', self.main, '--model', ROBOTS, '-o', self.folder / 'x.image', status=2).stderr
        self.assertIn(f"{self.folder}/walk/lib/counter.dyn:1:8: error: cannot read '{self.folder}/walk/lib/../shares.dyn': no such file\n"
                      '  import "../shares.dyn";\n', said)
        self.shares.write_text(SHARES + 'import "main.dyn";\n')
        said = morphbus('compile', self.main, '--model', ROBOTS, '-o', self.folder / 'x.image', status=2).stderr
        self.assertIn("shares.dyn:5:8: error: import cycle: 'main.dyn' is itself still being read\n", said)
        self.assertIn("main.dyn:2:8: note: which imports 'counter.dyn' here\n", said)
        self.assertIn("counter.dyn:1:8: note: which imports 'shares.dyn' here\n", said)
        self.shares.write_text(SHARES)
        self.main.write_text(MAIN + SHARES)
        said = morphbus('compile', self.main, '--model', ROBOTS, '-o', self.folder / 'x.image', status=2).stderr
        self.assertIn("main.dyn:13:10: error: 'share' is declared twice in 'Module'\n", said)
        self.assertIn('shares.dyn:2:10: note: first declared here\n', said)
        self.assertFalse((self.folder / 'x.image').exists())

    def test_the_formatter_keeps_imports(self):
        text = '// First.\nimport "lib/counter.dyn";  // Counts.\nimport "shares.dyn";\n\nrole R extends Module {}\n'
        self.main.write_text(text.replace('import', ' import ').replace(';', ' ;'))
        self.assertEqual(json.loads(morphbus('format', self.main, '--json').stdout)['files'][0]['layout'], 'formatted')
        self.assertEqual(self.main.read_text(), text)


if __name__ == '__main__':
    unittest.main(verbosity=2)
