#!/usr/bin/env python3
"""`tools/campaign`: cases follow from their numbers, what is done is never run again, and a way that differs is found out."""
import json
import os
import re
import shlex
import signal
import subprocess
import sys
import unittest

from support import BIN, LIMIT, SOURCE, Case, await_condition, end_of, processes_of

sys.path.insert(0, str(SOURCE / 'tools'))
from cases.case import attributes, shipped_pairs, shipped_robot  # noqa: E402
from cases.chance import Chance  # noqa: E402
from cases.programs import random_program  # noqa: E402

TOOL = SOURCE / 'tools' / 'campaign'
WAYS = ('reference', 'lossy', 'processes', 'rough', 'killed', 'frozen', 'everything', 'logged')
# As morphbus, but that runs of several processes have another hash.
LIAR = '''#!/bin/bash
set -o pipefail
if [[ $* == *--isolate* ]]; then
  {} "$@" | sed 's/"hash": "[0-9a-f]/"hash": "g/'
else
  exec {} "$@"
fi
'''


class CampaignCase(Case):
    def setUp(self):
        super().setUp()
        self.results = self.folder / 'results'
        # A campaign that is killed leaves the folder of its case behind.
        os.environ['TMPDIR'] = str(self.folder)

    def command(self, *arguments, morphbus=BIN / 'morphbus'):
        return [str(TOOL), '--morphbus', str(morphbus), *map(str, arguments)]

    def campaign(self, *arguments, status=0, **options):
        done = subprocess.run(self.command(*arguments, **options), capture_output=True, text=True, timeout=LIMIT)
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        return done.stderr if status == 2 else done.stdout

    def start(self, *arguments):
        process = subprocess.Popen(self.command(*arguments), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        # What it had run goes on to its own end, in the test's folder.
        self.addCleanup(await_condition, lambda: not processes_of('morphbus-campaign-'), 'all processes are gone')
        self.kill_at_the_end(process)
        return process

    def lines(self):
        return self.results.read_bytes().splitlines(keepends=True) if self.results.exists() else []

    def await_lines(self, count):
        await_condition(lambda: len(self.lines()) >= count, f'{count} cases are done')

    def records(self):
        return {record['case']: record for record in map(json.loads, self.lines())}


class Cases(CampaignCase):
    def test_every_way_has_the_hash_of_the_first_and_nothing_is_run_twice(self):
        self.assertIn('of 2 cases, no difference', self.campaign('--results', self.results, '--cases', '1-2', '--jobs', 2))
        records = self.records()
        self.assertEqual(set(records), {1, 2})
        for record in records.values():
            # On a machine that is too busy a run may not finish; there is no other excuse.
            self.assertLessEqual({run['result'] for run in record['runs']}, {'same', 'unfinished'})
            if record['runs'][0]['result'] == 'same':
                self.assertEqual({run['way'] for run in record['runs']}, set(WAYS))
        before = self.lines()
        self.campaign('--results', self.results, '--cases', '1-2')
        self.assertEqual(self.lines(), before)
        runs = sum(run['result'] == 'same' for record in records.values() for run in record['runs'])
        self.assertRegex(self.campaign('--summary', self.results), rf'(?m)^ *{runs}  runs$')

    def test_a_case_follows_from_its_number(self):
        said = [self.campaign('--case', 7, '--way', 'reference', '--keep', self.folder / name) for name in ('one', 'two')]
        one, two = (re.search('hash ([0-9a-f]{32})', text)[1] for text in said)
        self.assertEqual(one, two)
        for name in ('robot.m3l', 'program.dyn', 'script'):
            files = [self.folder / folder / name for folder in ('one', 'two')]
            self.assertEqual(*[file.read_text() if file.exists() else None for file in files])
        # What was kept runs without the tool.
        command = re.search(r'^morphbus (run .*) # reference$', said[0], re.M)[1]
        done = subprocess.run([BIN / 'morphbus', *shlex.split(command)], cwd=self.folder / 'one', capture_output=True, text=True,
                              timeout=LIMIT)
        self.assertEqual(json.loads(done.stdout)['hash'], one)

    def test_a_campaign_that_is_killed_goes_on_where_it_was(self):
        arguments = ('--results', self.results, '--cases', '1-3')
        for count in (1, 2):
            process = self.start(*arguments)
            self.await_lines(count)
            end_of(process)
        # As if it had been killed while it wrote a line.
        before = self.lines()
        with open(self.results, 'ab') as file:
            file.write(before[0][:len(before[0]) // 2])
        self.assertRegex(self.campaign('--summary', self.results), rf'(?m)^ *{len(before)}  cases')
        self.campaign(*arguments)
        self.assertEqual(self.lines()[:len(before)], before)
        self.assertEqual(sorted(record['case'] for record in map(json.loads, self.lines())), [1, 2, 3])

    def test_ctrl_c_ends_it_and_all_that_it_runs(self):
        for cases, status in (((), 0), (('--cases', '1-1000000'), 1)):
            self.results.unlink(missing_ok=True)
            process = self.start('--results', self.results, *cases)
            self.await_lines(1)
            process.send_signal(signal.SIGINT)
            said, errors = process.communicate(timeout=LIMIT)
            self.assertEqual((process.returncode, errors), (status, ''))
            self.assertRegex(said.splitlines()[-1], r'^\d+ runs of \d+ cases, no difference')
            await_condition(lambda: not processes_of('morphbus-campaign-'), 'all processes are gone')
            self.assertTrue(self.lines()[-1].endswith(b'\n'))


class Findings(CampaignCase):
    def test_a_difference_is_told_with_the_command_that_shows_it(self):
        liar = self.folder / 'liar'
        liar.write_text(LIAR.format(*[shlex.quote(str(BIN / 'morphbus'))] * 2))
        liar.chmod(0o755)
        said = self.campaign('--results', self.results, '--cases', '5', morphbus=liar, status=1)
        self.assertRegex(said, r'different: case 5, processes: hash g[0-9a-f]{31} instead of [0-9a-f]{32}')
        again = re.search(r'^  tools/campaign (--case 5 --way processes --morphbus .*)$', said, re.M)[1]
        shown = subprocess.run([TOOL, *shlex.split(again)], cwd=self.folder, capture_output=True, text=True, timeout=LIMIT)
        self.assertEqual(shown.returncode, 1, shown.stdout + shown.stderr)
        self.assertIn('hash g', shown.stdout)
        same = {run['way'] for run in self.records()[5]['runs'] if run['result'] == 'same'}
        self.assertEqual(same - {'logged'}, {'reference', 'lossy'})
        self.assertIn(again.split(' --morphbus')[0], self.campaign('--summary', self.results, status=1))
        # It is the liar's, and not the run's.
        self.campaign('--case', 5, '--way', 'processes')

    def test_every_robot_that_ships_can_be_that_of_a_case(self):
        for _, model, robots, _ in shipped_pairs():
            for name in robots:
                robot, chance = shipped_robot(model, name), Chance('case', 1)
                self.assertTrue(attributes(chance, robot), name)
                self.assertIn('role ', random_program(chance, robot)[0], name)

    def test_a_run_that_takes_too_long_is_no_difference(self):
        said = self.campaign('--results', self.results, '--cases', '1-2', '--limit', 0.001)
        self.assertIn('0 runs of 2 cases, no difference, 2 not finished', said)
        self.assertIn('--case 2 --way reference', self.campaign('--summary', self.results))

    def test_what_cannot_be_used_is_refused(self):
        def refused(*arguments, **options):
            return self.campaign(*arguments, status=2, **options)
        self.assertIn('required', refused())
        self.assertIn("expected A-B, A- or A, not '5-3'", refused('--results', self.results, '--cases', '5-3'))
        self.assertIn('invalid number above 0 value', refused('--results', self.results, '--jobs', 0))
        self.assertIn('invalid number above 0 value', refused('--results', self.results, '--minutes', '-1'))
        self.assertIn('invalid choice', refused('--case', 1, '--way', 'sideways'))
        self.assertIn('not allowed with', refused('--case', 1, '--results', self.results))
        self.assertIn('expected a new folder', refused('--case', 1, '--keep', self.folder))
        self.assertIn('cannot run', refused('--case', 1, morphbus=self.folder / 'none'))
        self.assertIn('No such file', refused('--summary', self.folder / 'none'))
        self.assertIn('none/x', refused('--results', self.folder / 'none' / 'x'))
        self.assertFalse(self.results.exists())
        # Files that hold something else are left as they are.
        for text, why in (('a diary\n', ':1: this is no line'), ('a diary', 'no file of a campaign'),
                          ('{"case": 1}\n', ':1: this is no line'),
                          ('{"case": 1, "generator": "0", "runs": []}\n', 'begin another file')):
            self.results.write_text(text)
            self.assertIn(why, refused('--results', self.results))
            self.assertEqual(self.results.read_text(), text)

    def test_two_campaigns_do_not_write_to_one_file(self):
        self.start('--results', self.results)
        self.await_lines(1)
        self.assertIn('another campaign writes to it', self.campaign('--results', self.results, status=2))

    def test_the_document_has_the_ways(self):
        text = (SOURCE / 'docs' / 'campaign.md').read_text(encoding='utf-8')
        for way in WAYS:
            self.assertIn(f'| `{way}` |', text)
        self.assertEqual([text.count(mark) for mark in ('<!-- tools/campaign writes from here -->\n', '<!-- to here -->\n')], [1, 1])


if __name__ == '__main__':
    unittest.main()
