#!/usr/bin/env python3
"""The distributed algorithms of docs/algorithms.md find what a search through the model finds."""
import collections
import csv
import re
import unittest

from program_case import MODELS, Programs
from support import as_json, morphbus


def neighbours(model, robot):
    """{module: the modules that it is docked to}, by the numbers in their names, as the model's text says."""
    text = (MODELS / f'{model}.m3l').read_text()
    body = re.search(rf'^robot {robot}:(.*?)(?=^\w|\Z)', text, re.M | re.S).group(1)
    found = collections.defaultdict(set)
    for a, b in re.findall(r'\(\s*m(\d+)\.\w+\s*,\s*m(\d+)\.\w+', body):
        found[int(a)].add(int(b))
        found[int(b)].add(int(a))
    return found


def distances(near, sources):
    """How many dockings each module is away from the nearest source."""
    found = dict.fromkeys(sources, 0)
    queue = collections.deque(sources)
    while queue:
        module = queue.popleft()
        for other in near[module]:
            if other not in found:
                found[other] = found[module] + 1
                queue.append(other)
    return found


class Distributed(Programs):
    # A robot with loops, one that is a loop, one that is a line.
    ROBOTS = (('mtran', 'quadruped'), ('mtran_robots', 'caterpillar'), ('ckbot', 'snake'))

    def said(self, model, program, robot, seconds, *more):
        """{module's number: what it printed last}"""
        # A loop that nobody drives may sag until a joint stalls, which is no matter here.
        summary = self.run_program(model, program, robot, seconds, *more, faults=True)
        return {int(line['module'][1:]): line['text'] for line in summary['prints']}

    def test_all_follow_the_module_with_the_least_number_by_the_shortest_way(self):
        for model, robot in self.ROBOTS:
            far = distances(neighbours(model, robot), [1])
            # m1 is number 0.
            self.assertEqual(self.said(model, 'leader', robot, 3),
                             {module: f'leader 0 distance {far[module]}' for module in far}, robot)

    def test_the_root_knows_how_many_modules_there_are_and_each_how_many_are_below_it(self):
        for model, robot in self.ROBOTS:
            near = neighbours(model, robot)
            said = self.said(model, 'tree', robot, 3)
            [root] = [module for module, text in said.items() if text.startswith('modules')]
            self.assertEqual(said.pop(root), f'modules {len(near)}', robot)
            depth = distances(near, [root])
            parent, size = {}, dict.fromkeys(near, 1)
            for module, text in said.items():
                parent[module], size[module] = (int(n) for n in re.findall(r'\d+', text))
                parent[module] += 1
                # Of those that are nearer to the root the one with the least number.
                self.assertEqual(parent[module], min(n for n in near[module] if depth[n] == depth[module] - 1), robot)
            for module in near:
                below = [n for n in parent if parent[n] == module]
                wanted = 1 + sum(size[n] for n in below)
                self.assertEqual(size[module] if module != root else len(near), wanted, (robot, module))

    def test_each_module_knows_how_far_the_nearest_source_is_and_tells_it_in_every_tick(self):
        for model, robot in self.ROBOTS:
            said = self.said(model, 'gradient', robot, 3)
            sources = [module for module, text in said.items() if text == 'source']
            far = distances(neighbours(model, robot), sources)
            self.assertEqual(said, {module: 'source' if module in sources else f'value {far[module]}' for module in far})
            # The traces say the same at the end, and something of every module in every tick of its role.
            morphbus('convert', self.log, '--to', 'csv', '-o', self.folder / robot)
            with open(self.folder / robot / 'traces.csv', newline='', encoding='utf-8') as file:
                rows = list(csv.DictReader(file))
            last = {int(row['module'][1:]): float(row['value']) for row in rows}
            self.assertEqual(last, far, robot)
            ticks = collections.defaultdict(list)
            for row in rows:
                self.assertEqual(row['field'], 'value')
                ticks[row['module']].append(int(row['tick']))
            for module, told in ticks.items():
                self.assertEqual(told, list(range(told[0], told[-1] + 1)), module)
                self.assertGreater(len(told), 100)

    def test_all_agree_on_the_mean_of_their_numbers(self):
        for model, robot, seconds in (('mtran', 'quadruped', 10), ('ckbot', 'snake', 30)):
            near = neighbours(model, robot)
            said = self.said(model, 'consensus', robot, seconds)
            self.assertEqual(set(said), set(near), robot)
            mean = (len(near) - 1) / 2
            for text in said.values():
                self.assertAlmostEqual(float(text.split()[1]), mean, delta=0.01)


class Kept(Programs):
    FIRST = """
role Counter extends Module {
  kept rounds = 0;
  kept other = 1;
  kept marks = [0, 0];
  plain = 0;
  behavior count() {
    rounds += 1;
    other += 1;
    marks[1] = rounds;
    plain += 1;
    self.sleepcs(plain);
  }
}
"""
    SECOND = """
role Heir extends Module {
  kept rounds = -5;
  kept other = 0.5;
  kept marks = [7, 7];
  plain = 3;
  startup tell() {
    print(rounds, other, marks[0], marks[1], plain);
  }
}
"""

    def test_a_field_that_is_kept_outlives_the_role_and_the_program_by_name_and_type(self):
        first, second = self.folder / 'first.dyn', self.folder / 'second.dyn'
        first.write_text(self.FIRST)
        second.write_text(self.SECOND)
        script = self.folder / 'script'
        script.write_text(f'100 deploy {second} --at 3\n')
        summary = as_json('run', MODELS / 'atron.m3l', first, '--robot', 'car', '--seconds', 4, '--inproc', '--commands', script)
        self.assertEqual(summary['problems'], [])
        self.assertEqual({line['module'] for line in summary['prints']}, {'head', 'left', 'right'})
        for line in summary['prints']:
            rounds, other, zero, mark, plain = line['text'].split()
            # The first program's count; what has another type, and what is not kept, begin anew.
            self.assertGreater(int(rounds), 10)
            self.assertEqual((other, zero, mark, plain), ('0.5', '0', rounds, '3'))


    def test_what_neighbours_share_and_keep_is_known_in_the_tick_of_the_switch(self):
        text = 'role Counter extends Module {{\n  shared kept rounds = {};\n  {}\n}}\n'
        first, second = self.folder / 'first.dyn', self.folder / 'second.dyn'
        first.write_text(text.format(0, 'behavior count() {\n    rounds += 1;\n  }'))
        # No neighbour has told anything under the second program when the startups run.
        second.write_text(text.format(-5, 'startup tell() {\n    for (n in self.connected($ANY, $Counter)) print(n.rounds, rounds);\n  }'))
        script = self.folder / 'script'
        script.write_text(f'100 deploy {second} --at 3\n')
        summary = as_json('run', MODELS / 'atron.m3l', first, '--robot', 'car', '--seconds', 4, '--inproc', '--commands', script)
        self.assertEqual({line['module'] for line in summary['prints']}, {'head', 'left', 'right'})
        for line in summary['prints']:
            its, own = map(int, line['text'].split())
            self.assertGreater(own, 100)
            self.assertLessEqual(abs(its - own), 5)


class Oscillators(Programs):
    # Millimetres that the head came in 20 s.
    MEASURED = {'mtran_snake8': 1059, 'ckbot_snake8': 463, 'molecube_snake8': 515}

    def test_coupled_oscillators_move_snakes_of_three_kinds(self):
        for robot, measured in self.MEASURED.items():
            summary = self.run_program('snakes', 'cpg', robot, 20)
            north, _, east = summary['root_displacement']
            came = 1000 * (north ** 2 + east ** 2) ** 0.5
            self.assertGreater(came, 2 / 3 * measured, robot)


if __name__ == '__main__':
    unittest.main()
