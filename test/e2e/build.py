#!/usr/bin/env python3
"""`morphbus build`: the sheet with which a person puts a robot together, as a page, on paper and as JSON."""
import math
import os
import pty
import re
import select
import signal
import subprocess
import unittest

from support import LIMIT, MODEL, SOURCE, Case, as_json, command, morphbus

MODELS = SOURCE / 'models'


def connections_of(path, robot):
    """The connections of a robot as its file has them, without our reader: {(end, end)}, ends in order of their names."""
    text = path.read_text(encoding='utf-8')
    body = re.search(rf'^robot {robot}:(.*?)(?=^robot |^module |\Z)', text, re.M | re.S)[1]
    listed = re.search(r'connections=\((.*?)\)\s*(?:,\s*\w+=|\Z|\n\s*(?://|\n))', body, re.S)[1] + ')'
    return {tuple(sorted(pair)) for pair in re.findall(r'\((\w+\.\w+),\s*(\w+\.\w+)', listed)}


def poppler(program, *arguments):
    """What a program of poppler-utils prints (tools/setup --test)."""
    return subprocess.run([program, *map(str, arguments)], check=True, capture_output=True, text=True).stdout


class SheetCase(Case):
    def row(self, modules):
        """A file with a row of so many modules."""
        path = self.folder / f'row{modules}.m3l'
        names = [f'm{i}' for i in range(modules)]
        path.write_text(f'import "{MODEL}"\nrobot row: modules=({", ".join("MTRAN " + name for name in names)}),\n'
                        f'connections=({", ".join(f"({a}.c2, {b}.c5)" for a, b in zip(names, names[1:]))})\n', encoding='utf-8')
        return path


class Build(SheetCase):
    def sheet(self, model, robot, name):
        path = self.folder / name
        morphbus('build', model, '--robot', robot, '-o', path)
        return path

    def test_json_has_every_connection_once_onto_what_stands(self):
        for model, robot in (('mtran', 'quadruped'), ('mtran', 'equivalent_quadruped'), ('atron', 'car'), ('mixed', 'inchworm')):
            path = MODELS / f'{model}.m3l'
            answer = as_json('build', path, '--robot', robot)
            standing, made = set(), []
            for step in answer['steps']:
                for mating in step['connections']:
                    self.assertEqual(mating['own'].split('.')[0], step['module'])
                    self.assertIn(mating['standing'].split('.')[0], standing)
                    made.append(tuple(sorted((mating['own'], mating['standing']))))
                    self.assertIn(mating['number'], mating['ways'])
                standing.add(step['module'])
            self.assertEqual(len(made), len(set(made)))
            self.assertEqual(set(made), connections_of(path, robot), robot)
            self.assertEqual([step['step'] for step in answer['steps']], list(range(1, len(standing) + 1)))

    def test_json_says_what_connections_and_fk_say(self):
        # The same numbers and states as `connections`, the same closure as `fk`.
        answer = as_json('build', MODEL, '--robot', 'quadruped')
        listed = {c['number']: c for c in as_json('connections', MODEL)['connections']}
        for step in answer['steps']:
            for mating in step['connections']:
                numbered = listed[mating['number']]
                own, standing = (mating[key].split('.')[1] for key in ('own', 'standing'))
                self.assertEqual({numbered['a'], numbered['b']}, {own, standing})
                self.assertEqual(mating['ways'], [n for n, c in listed.items() if (c['a'], c['b']) == (numbered['a'], numbered['b'])])
                self.assertEqual(list(mating['state'].values()), list(numbered['state'].values()))
        self.assertEqual(answer['loops'], 2)
        for pose in answer['poses']:
            settings = [f'--set={m}.{j}={q}' for m, joints in pose['joints'].items() for j, q in joints.items()]
            fk = as_json('fk', MODEL, '--robot', 'quadruped', *settings)
            self.assertLess(fk['closure_m'], 1e-9, pose['pose'])
        bent = answer['poses'][-1]
        self.assertEqual((bent['pose'], bent['alike']), ('bent', []))
        self.assertAlmostEqual(abs(bent['joints']['m1']['joint_1']), math.radians(30))

    def test_the_page_needs_no_other_file(self):
        html = self.sheet(MODEL, 'quadruped', 'sheet.html').read_text(encoding='utf-8')
        self.assertEqual(re.findall(r'<h3>(Step \d+ of 9)', html), [f'Step {i} of 9' for i in range(1, 10)])
        # One picture of the module type, one a step, one a pose; each for light and dark.
        self.assertEqual(html.count('<picture>'), 1 + 9 + 2)
        sources = re.findall(r'(?:src|srcset|href)=\'?"?([^\'" >]*)', html)
        self.assertEqual(len(sources), 2 * 12)
        self.assertEqual({source[:22] for source in sources}, {'data:image/png;base64,'})
        self.assertIn('Put m2.c3 (no. 2) on m5.c4 (no. 1).', html)

    def test_paper_says_what_the_page_says(self):
        for model, robot, steps in ((MODEL, 'quadruped', 9), (MODELS / 'pairs.m3l', 'crane', 5), (MODELS / 'ckbot.m3l', 'loop', 10)):
            pdf = self.sheet(model, robot, f'{robot}.pdf')
            self.assertTrue(pdf.read_bytes().startswith(b'%PDF-'))
            info = poppler('pdfinfo', pdf)
            self.assertIn(f'{robot}: how it is put together', info)
            self.assertRegex(info, r'Page size:.*\(A4\)')
            pages = int(re.search(r'^Pages: +(\d+)', info, re.M)[1])
            text = poppler('pdftotext', '-layout', pdf, '-')
            self.assertEqual(re.findall(r'page (\d+) of (\d+)', text), [(str(i), str(pages)) for i in range(1, pages + 1)])
            # At most two parts of text before the first step and behind the last one, and a page a step or less.
            self.assertLessEqual(pages, steps + 6)
            self.assertGreater(pages, steps // 3)
            words = ' '.join(text.split())
            html = self.sheet(model, robot, f'{robot}.html').read_text(encoding='utf-8')
            for heading in re.findall(r'<h[123]>([^<]*)</h', html):
                self.assertIn(heading, words)

    def test_the_same_robot_has_the_same_sheet(self):
        for ending in ('html', 'pdf'):
            one, two = (self.sheet(MODELS / 'smores.m3l', 'train', f'{i}.{ending}').read_bytes() for i in range(2))
            self.assertEqual(one, two)

    def test_what_cannot_be_built_is_said(self):
        def refused(*arguments):
            before = set(os.listdir(self.folder))
            said = morphbus('build', *arguments, status=2).stderr
            self.assertEqual(set(os.listdir(self.folder)), before)
            return said

        out = self.folder / 'x.pdf'
        self.assertIn('the model has several robots; choose one with --robot: quadruped, equivalent_quadruped',
                      refused(MODEL, '-o', out))
        self.assertIn("the model has no robot 'quadrupd' (did you mean 'quadruped'?); it has quadruped, equivalent_quadruped",
                      refused(MODEL, '--robot', 'quadrupd', '-o', out))
        self.assertIn('.html or .pdf', refused(MODEL, '--robot', 'quadruped', '-o', self.folder / 'x.txt'))
        self.assertIn('say what to write', refused(MODEL, '--robot', 'quadruped'))
        self.assertIn('no/x.pdf', refused(MODEL, '--robot', 'quadruped', '-o', self.folder / 'no' / 'x.pdf'))
        self.assertIn('missing.m3l', refused(self.folder / 'missing.m3l', '-o', out))
        self.assertIn('FILE.m3l', refused('-o', out))
        mine = self.folder / 'mine.pdf'
        mine.write_text('no sheet\n', encoding='utf-8')
        self.assertIn('--force', refused(MODEL, '--robot', 'quadruped', '-o', mine))
        self.assertEqual(mine.read_text(encoding='utf-8'), 'no sheet\n')
        morphbus('build', MODEL, '--robot', 'quadruped', '-o', mine, '--force')
        self.assertTrue(mine.read_bytes().startswith(b'%PDF-'))

    def test_an_interrupted_one_leaves_nothing(self):
        path = self.row(100)
        before = set(os.listdir(self.folder))
        master, slave = pty.openpty()
        self.addCleanup(os.close, master)
        build = command('build', path, '--robot', 'row', '-o', self.folder / 'row.html')
        process = subprocess.Popen(build, stdout=subprocess.DEVNULL, stderr=slave, env={**os.environ, 'TERM': 'xterm'})
        self.kill_at_the_end(process)
        os.close(slave)
        # It is at its pictures once it says how far it has come.
        self.assertTrue(select.select([master], [], [], LIMIT)[0])
        self.assertIn(b'row.html', os.read(master, 4096))
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(timeout=LIMIT), -signal.SIGINT)
        self.assertEqual(set(os.listdir(self.folder)), before)


class Large(SheetCase):
    def test_many_modules_have_a_sheet_of_bounded_size(self):
        path = self.row(300)
        answer = as_json('build', path, '--robot', 'row', '-o', self.folder / 'row.pdf')
        self.assertEqual(len(answer['steps']), 300)
        self.assertEqual(answer['steps'][-1]['step'], 60)
        self.assertLess((self.folder / 'row.pdf').stat().st_size, 20e6)
        said = morphbus('build', self.row(1001), '--robot', 'row', '--json', status=2).stderr
        self.assertIn('1001 modules; a sheet is made for 1000 at most', said)


if __name__ == '__main__':
    unittest.main()
