#!/usr/bin/env python3
"""What people did to a run is shown by all who show the run: compare, report, replay and whatever records a replay."""
import re
import subprocess
import tempfile
import unittest

from support import MODEL, PROGRAM, SOURCE, Case, as_json, await_condition, command, morphbus

CAREFUL = SOURCE / 'models' / 'programs' / 'quadruped_careful.dyn'
SCRIPTS = {
    'a': '50 push m5 UP 2 0.1\n60 speed 0\n80 restart m7 --cold\n120 deploy {} --to m5 --at 4\n',
    'b': '55 push m5 UP 2 0.1\n60 speed 0\n100 invoke FrontLeftUpperHalf.move_thigh --to m3\n120 deploy {} --to m5 --at 4\n',
}


class Shown(Case):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix='morphbus-e2e-')
        cls.addClassCleanup(folder.cleanup)
        cls.logs, cls.given = {}, {}
        for name, script in SCRIPTS.items():
            path = f'{folder.name}/{name}.script'
            with open(path, 'w', encoding='utf-8') as file:
                file.write(script.format(CAREFUL))
            cls.logs[name] = f'{folder.name}/{name}.log'
            morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--run', 'walk', '--inproc', '--seconds', 6, '--commands',
                     path, '--log', cls.logs[name])
            cls.given[name] = [(c['tick'], c['command']) for c in as_json('info', cls.logs[name])['commands']]
            assert len(cls.given[name]) == 4, cls.given[name]

    def of(self, name, word):
        return next((tick, text) for tick, text in self.given[name] if text.startswith(word))

    def test_compare_has_those_of_both_logs_and_notes_where_they_differ(self):
        answer = as_json('compare', self.logs['a'], self.logs['b'], status=1)
        rows = [(c['tick_a'], c['tick_b'], c['command'], c['differs']) for c in answer['commands']]
        push, deploy = self.of('a', 'push')[1], self.of('a', 'deploy')[1]
        self.assertEqual(rows, [(50, 55, push, True), (60, 60, 'speed 0', False), (80, None, 'restart m7 --cold', True),
                                (None, 100, self.of('b', 'invoke')[1], True), (120, 120, deploy, False)])
        note = f"people gave them different commands: '{push}' at tick 50 in A and 55 in B, and 2 more"
        self.assertIn(note, answer['notes'])
        # One truth: what compare says of a log is what info says of it.
        for side, name in (('tick_a', 'a'), ('tick_b', 'b')):
            self.assertEqual([(c[side], c['command']) for c in answer['commands'] if c[side] is not None], self.given[name])
        text = morphbus('compare', self.logs['a'], self.logs['b'], status=1).stdout
        self.assertIn(f'  note: {note}\n', text)
        self.assertIn(f'commands while they ran (tick in A, tick in B, command):\n!      50      55  {push}\n'
                      '       60      60  speed 0\n!      80       -  restart m7 --cold\n', text)

    def test_compare_of_a_run_with_itself_notes_nothing(self):
        answer = as_json('compare', self.logs['a'], self.logs['a'])
        self.assertEqual([c['differs'] for c in answer['commands']], [False] * 4)
        self.assertEqual(answer['notes'], [])

    def test_where_ticks_mean_nothing_the_same_command_at_another_tick_is_no_difference(self):
        # So short a walk has no gait to compare, which does not keep the commands from being listed.
        answer = as_json('compare', self.logs['a'], self.logs['b'], '--level', 'gait', status=2)
        self.assertEqual([c['differs'] for c in answer['commands']], [False, False, True, True, False])

    def test_pages_list_them_and_mark_them_in_plots_over_time(self):
        page = self.folder / 'page.html'
        morphbus('compare', self.logs['a'], self.logs['b'], '--report', page, status=1)
        html = page.read_text(encoding='utf-8')
        self.assertIn('<h2>Commands</h2>', html)
        self.assertRegex(html, r"<tr class='over'><td class='n'>80</td><td class='n'>1.60</td><td class='n dim'>–</td>"
                               r"<td class='n dim'>–</td><td class='m'>restart m7 --cold</td><td>only in A</td></tr>")
        marks = set(re.findall(r"class='mark-text'[^>]*>([^<]*)<", html))
        self.assertLessEqual({'push', 'restart (A)', 'invoke (B)', 'deploy'}, marks)
        # The pace leaves no trace in sim time.
        self.assertNotIn('speed', marks)
        morphbus('report', self.logs['a'], '-o', page)
        html = page.read_text(encoding='utf-8')
        for tick, text in self.given['a']:
            self.assertIn(f"<tr><td class='n'>{tick}</td><td class='n'>{tick * 0.02:.2f}</td><td class='m'>{text}</td>", html)
        self.assertRegex(html, r'<td>tilted \d+\.\d° at most in 5 s</td>')
        self.assertEqual(set(re.findall(r"class='mark-text'[^>]*>([^<]*)<", html)), {'push', 'restart', 'deploy'})

    def test_replay_says_them_as_it_passes_them(self):
        for options, commands in (((), self.given['a']), (('--from', 1.1, '--to', 2), self.given['a'][1:3]),
                                  (('--channel', 'walk/.*/STATUS'), self.given['a'])):
            done = morphbus('replay', self.logs['a'], '--isolate', '--speed', 0, '--json', *options, stdin=subprocess.DEVNULL)
            said = [line for line in done.stderr.splitlines() if ', tick ' in line]
            self.assertEqual(said, [f'{tick * 0.02:.2f} s, tick {tick}: {text}' for tick, text in commands])

    def test_a_replay_that_is_recorded_has_them_still(self):
        replay = subprocess.Popen(command('replay', self.logs['a'], '--isolate', '--wait-for', 1, '--speed', 0),
                                  stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.kill_at_the_end(replay)
        listed = await_condition(lambda: as_json('runs')['runs'], 'the replay is listed')
        copy = self.folder / 'copy.log'
        morphbus('log', '--follow', 'walk', '--run', listed[0]['run'], '-o', copy)
        self.assertEqual(morphbus('info', copy, '--commands').stdout, morphbus('info', self.logs['a'], '--commands').stdout)
        # END is not published again, so that a copy is not known to be whole.
        answer = as_json('compare', self.logs['a'], copy, status=2)
        self.assertEqual([c['differs'] for c in answer['commands']], [False] * 4)
        deployed, = as_json('info', copy)['deployments']
        self.assertEqual(deployed, as_json('info', self.logs['a'])['deployments'][0])


if __name__ == '__main__':
    unittest.main()
