#!/usr/bin/env python3
"""The lints must fail on what they forbid: each test plants one violation in a small tree."""
import pathlib
import subprocess
import tempfile
import unittest

LINT = pathlib.Path(__file__).resolve().parents[2] / 'tools' / 'lint'
GOOD_LCM = '''package morphbus;

// A reading. Channel <RUN>/X; every tick; a -> b.
struct reading_t {
  // How far, metres.
  double distance_m;
  // How many.
  int16_t count;
}
'''


class Tree(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.root = pathlib.Path(self.folder.name)
        self.write('CMakeLists.txt', ''.join(f'add_subdirectory({d})\n' for d in (
            'lcmtypes', 'vm', 'compiler', 'bridge', 'sim', 'logger', 'tools', 'test')))
        self.write('compiler/CMakeLists.txt', 'add_subdirectory(source)\nadd_subdirectory(model)\n')
        self.write('lcmtypes/CMakeLists.txt', 'set(MORPHBUS_LCM_TYPES\n  reading_t)\n')
        self.write('lcmtypes/reading_t.lcm', GOOD_LCM)

    def write(self, path, text):
        (self.root / path).parent.mkdir(parents=True, exist_ok=True)
        (self.root / path).write_text(text)

    def run_lint(self, name):
        done = subprocess.run([LINT / name, self.root], capture_output=True, text=True)
        return done.returncode, done.stderr


class LayersTest(Tree):
    def expect(self, path, include, status):
        self.write(path, f'#include {include}\n')
        code, text = self.run_lint('layers')
        self.assertEqual(code, status, text)
        if status:
            self.assertIn(f'{path}:1: error:', text)

    def test_including_what_comes_before_is_accepted(self):
        self.expect('logger/a.cc', '"bridge/bus.h"', 0)

    def test_including_what_comes_after_is_rejected(self):
        self.expect('sim/a.cc', '"logger/event_log.h"', 1)

    def test_vm_depends_on_nothing(self):
        self.expect('vm/a.cc', '<morphbus/header_t.hpp>', 1)

    def test_bridge_keeps_off_the_model(self):
        self.expect('bridge/a.cc', '"compiler/model/robot_model.h"', 1)

    def test_bridge_outward_may_use_the_model(self):
        self.expect('bridge/outward/a.cc', '"compiler/model/robot_model.h"', 0)

    def test_stages_of_the_compiler_are_ordered(self):
        self.expect('compiler/source/a.h', '"compiler/model/robot_model.h"', 1)


class LcmCommentsTest(Tree):
    def expect(self, before, after, message):
        self.write('lcmtypes/reading_t.lcm', GOOD_LCM.replace(before, after))
        code, text = self.run_lint('lcm_comments')
        self.assertEqual(code, 1, text)
        self.assertIn(message, text)

    def test_a_documented_type_is_accepted(self):
        self.assertEqual(self.run_lint('lcm_comments')[0], 0)

    def test_field_without_comment_is_rejected(self):
        self.expect('  // How many.\n', '', 'count: no comment')

    def test_measure_without_unit_is_rejected(self):
        self.expect('How far, metres.', 'How far.', 'distance_m: the comment does not say the unit')

    def test_trailing_comment_is_rejected(self):
        self.expect('int16_t count;', 'int16_t count;  // so many', 'trails')

    def test_type_without_channel_is_rejected(self):
        self.expect('Channel <RUN>/X', 'Somewhere', 'names no channel')

    def test_unlisted_file_is_rejected(self):
        self.write('lcmtypes/other_t.lcm', GOOD_LCM.replace('reading_t', 'other_t'))
        code, text = self.run_lint('lcm_comments')
        self.assertEqual(code, 1)
        self.assertIn('other_t.lcm:1: error: is not listed', text)


if __name__ == '__main__':
    unittest.main()
