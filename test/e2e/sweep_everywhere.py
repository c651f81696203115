#!/usr/bin/env python3
"""A thousand runs of the tutorial's worm are the same rows to the byte, whoever runs them and whatever happens meanwhile: one
process, two that are killed ten times at random, a cluster whose node dies in the middle, other machines over ssh. Memory does
not grow with the rows."""
import pathlib
import random
import re
import time
import unittest

import slurm_cluster
from support import LIMIT, SOURCE, end_of
from sweep_case import SweepCase, children_of
from sweep_slurm import SlurmCase
from sweep_ssh import HOSTS, SshCase

ROWS = 1000
# What one process has made of them, for all who must have the same.
EXPECTED = []


def resident(pid):
    """Memory of a process and of those that it has started, in bytes."""
    total = 0
    for process in (pid, *children_of(pid)):
        pages = int(pathlib.Path(f'/proc/{process}/statm').read_text().split()[1])
        total += 4096 * pages
    return total


class Worms:
    def worms(self, more=''):
        text = (SOURCE / 'docs' / 'tutorial.md').read_text(encoding='utf-8')
        for name in ('worm.m3l', 'worm.dyn'):
            source = re.search(rf'```\w+ {name}\n(.*?)```', text, re.S)[1]
            (self.folder / name).write_text(source.replace('"models/', f'"{SOURCE}/models/'))
        return self.sweep_file('model = "worm.m3l"\nprogram = "worm.dyn"\nrobot = "worm"\nseconds = 10\n'
                               f'random_seed = {{from = 1, to = {ROWS}, step = 1}}\n{more}')

    def finish(self, process):
        output, errors = process.communicate(timeout=20 * LIMIT)
        self.assertEqual(process.returncode, 0, output + errors)

    def check(self):
        rows = self.rows(self.database())
        self.assertEqual(len(rows), ROWS)
        self.assertEqual({row['status'] for row in rows}, {'done'})
        if not EXPECTED:
            EXPECTED.extend(rows)
        self.assertEqual(rows, EXPECTED)


class Here(Worms, SweepCase):
    # Tests run by their names: what this one makes is what is expected of the others.
    def test_1_one_process_whose_memory_does_not_grow(self):
        process = self.start(self.worms(), '--jobs', '1')
        sizes = []
        while process.poll() is None:
            try:
                sizes.append(resident(process.pid))
            except (OSError, IndexError):
                # One of them has just ended.
                pass
            time.sleep(0.05)
        self.finish(process)
        self.check()
        quarter = len(sizes) // 4
        self.assertGreater(quarter, 10)
        second, last = max(sizes[quarter:2 * quarter]), max(sizes[-quarter:])
        print(f'at most {second / 1e6:.1f} MB in the second quarter of {ROWS} rows, {last / 1e6:.1f} MB in the last one')
        self.assertLess(last, 1.05 * second)

    def test_2_two_that_are_killed_ten_times(self):
        file = self.worms()
        moment = random.Random(3)
        killed = 0
        for count in sorted(moment.sample(range(1, ROWS - 50), 10)):
            process = self.start(file, '--jobs', '2')
            self.await_done(self.database(), count)
            end_of(process)
            killed += process.returncode == -9
        self.assertEqual(killed, 10)
        self.finish(self.start(file, '--jobs', '2'))
        self.check()


class OnSlurm(Worms, SlurmCase):
    def test_3_a_node_dies_in_the_middle(self):
        process = self.start(self.worms(self.engine('chunk = 10\n')))
        self.await_results(ROWS // 4)
        self.await_row_on('n2')
        self.cluster.kill_node('n2')
        self.addCleanup(self.cluster.await_idle, 'n1', 'n2')
        self.addCleanup(self.cluster.start_node, 'n2')
        self.finish(process)
        self.check()


class OverSsh(Worms, SshCase):
    def test_4_two_hosts(self):
        self.finish(self.start(self.worms(self.engine(*(f'"{host}/1"' for host in HOSTS[:2])))))
        self.check()


if __name__ == '__main__':
    slurm_cluster.enter()
    unittest.main()
