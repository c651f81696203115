#!/usr/bin/env python3
"""What a test does with processes that do not end: whoever lives on after the one that started it was killed makes the test fail,
is named with what it does, and is killed. A test that hangs tells where."""
import os
import pathlib
import re
import select
import subprocess
import sys
import unittest

from support import LIMIT, Case, await_condition, end_of, started_here


class LeftBehind(Case):
    def test_who_outlives_what_started_it_is_named_and_killed(self):
        process = subprocess.Popen(['sh', '-c', 'sleep 1000000 & exec sleep 2000000'], stdout=subprocess.PIPE)
        both = ['sleep 1000000 ', 'sleep 2000000 ']
        await_condition(lambda: sorted(started_here().values()) == both, 'both have begun')
        with self.assertRaises(AssertionError) as refused:
            end_of(process, limit=0.01)
        said = str(refused.exception)
        pid = int(re.search(r'(?m)^(\d+) sleep 1000000 $', said)[1])
        self.assertRegex(said, r'status: State:\s+\w')
        self.assertEqual(process.returncode, -9)
        await_condition(lambda: pid not in started_here(), 'it is gone')

    def test_who_ends_with_what_started_it_is_no_matter(self):
        process = subprocess.Popen(['sleep', '1000000'], stdout=subprocess.PIPE)
        self.kill_at_the_end(process)
        self.doCleanups()
        self.assertEqual((process.returncode, started_here()), (-9, {}))

    def test_where_one_stands_that_waits_without_a_limit_is_told(self):
        waiting = subprocess.Popen([sys.executable, '-c', 'import support\ninput()'], cwd=pathlib.Path(__file__).parent,
                                   env={**os.environ, 'MORPHBUS_TEST_LIMIT': '0.01'}, stdin=subprocess.PIPE, stderr=subprocess.PIPE,
                                   text=True)
        self.kill_at_the_end(waiting)
        self.assertTrue(select.select([waiting.stderr], [], [], LIMIT)[0], 'nothing is told')
        for place in 'Timeout', 'Thread ', '  File "<string>", line 2 in <module>':
            self.assertTrue(waiting.stderr.readline().startswith(place), place)


if __name__ == '__main__':
    unittest.main()
