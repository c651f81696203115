#!/usr/bin/env python3
"""`run`, `report` and `compare` say the same of every program that ships, and docs/gaits.md says it, too: by
tools/gait_table. Waves have a cycle, the tutorial's worm among them."""
import re
import subprocess
import unittest

from support import BIN, SOURCE, Case, as_json, morphbus


def table(*options):
    done = subprocess.run([SOURCE / 'tools' / 'gait_table', '--morphbus', BIN / 'morphbus', *options], stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, check=False)
    return done.returncode, done.stdout.decode(), done.stderr.decode()


class Some(Case):
    def test_run_report_and_compare_agree_to_the_digit(self):
        status, rows, errors = table('--only', 'car,crawler,arm')
        self.assertEqual((status, errors), (0, ''))
        # The crawler also with the settings that were found for it.
        self.assertEqual(len(rows.splitlines()), 4)

    def test_the_worm_of_the_tutorial_has_a_cycle_of_two_seconds(self):
        text = (SOURCE / 'docs' / 'tutorial.md').read_text(encoding='utf-8')
        for name in ('worm.m3l', 'worm.dyn'):
            source = re.search(rf'```\w+ {name}\n(.*?)```', text, re.S)[1]
            (self.folder / name).write_text(source.replace('"models/', f'"{SOURCE}/models/'))
        log = self.folder / 'worm.log'
        told = morphbus('run', self.folder / 'worm.m3l', self.folder / 'worm.dyn', '--robot', 'worm', '--seconds', 15, '--inproc',
                        '--log', log).stdout
        self.assertIn('cycle of 2.00 s', told)
        answer = as_json('compare', log, log, '--level', 'gait')
        self.assertEqual(answer['verdict'], 'equivalent')
        gait = answer['gait']['a']
        # Every cycle, the first one from standing still left aside, brings as much as the next: measured 71 mm.
        norths = [each['advance'][0] for each in gait['each'][1:]]
        self.assertEqual(len(norths), 6)
        self.assertLess(max(norths) - min(norths), 0.003)
        page = self.folder / 'worm.html'
        morphbus('report', log, '-o', page)
        self.assertIn('<th>cycle</th>', page.read_text())


class All(Case):
    def test_the_document_has_the_figures_of_today(self):
        status, _, errors = table('--check')
        self.assertEqual((status, errors), (0, ''))


if __name__ == '__main__':
    unittest.main()
