#!/usr/bin/env python3
"""What Debian's packages are built with is what tools/setup installs: neither list has what the other lacks."""
import os
import pathlib
import re
import subprocess
import unittest

ROOT = pathlib.Path(os.environ.get('MORPHBUS_SOURCE', pathlib.Path(__file__).resolve().parents[2]))
# What every builder of packages has, and what only builds packages.
BASE = {'g++', 'debhelper-compat', 'dh-python'}
# What tools/setup installs besides: to run, and Python's users' own.
BESIDES = {'iproute2', 'python3', 'python3-pandas'}
# Where Node is of another origin than Debian, tools/setup leaves it as it is.
NODE = {'nodejs', 'npm'}


class PackagesTest(unittest.TestCase):
    def test_the_build_dependencies_are_those_of_setup(self):
        control = (ROOT / 'debian' / 'control').read_text(encoding='utf-8')
        listed = re.search(r'^Build-Depends:\n((?: .*\n)+)', control, re.M)[1]
        needed = set(re.findall(r'^ ([\w.+-]+)', listed, re.M))
        told = subprocess.run([ROOT / 'tools' / 'setup', '--print', '--run'], check=True, capture_output=True, text=True).stdout.split()
        python = re.search(r'^python=\((.*)\)', (ROOT / 'tools' / 'setup').read_text(encoding='utf-8'), re.M)[1].split()
        self.assertLessEqual(NODE, needed)
        self.assertEqual(needed - BASE - NODE, (set(told) | set(python)) - BASE - BESIDES, 'debian/control and tools/setup')

    def test_the_version_is_that_of_the_project(self):
        project = re.search(r'project\(morphbus VERSION (\S+)', (ROOT / 'CMakeLists.txt').read_text(encoding='utf-8'))[1]
        self.assertTrue((ROOT / 'debian' / 'changelog').read_text(encoding='utf-8').startswith(f'morphbus ({project})'))
        self.assertIn(f'Package: libmorphbus{project}\n', (ROOT / 'debian' / 'control').read_text(encoding='utf-8'))


if __name__ == '__main__':
    unittest.main()
