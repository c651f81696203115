#!/usr/bin/env python3
"""The lints must fail on what they forbid: each test plants one violation in a small tree."""
import json
import pathlib
import subprocess
import tempfile
import unittest

# A row of docs/architecture.md for each room of the small tree.
ROWS = ''.join(f'| `{room}/` | x | |\n' for room in (
    'compiler/base', 'compiler/model', 'vm/image', 'vm/run', 'bridge/bus', 'bridge/wire'))
LINT = pathlib.Path(__file__).resolve().parents[2] / 'tools' / 'lint'
GOOD_LCM = '''package morphbus;

// A reading. Channel <RUN>/X; every tick; a -> b.
struct reading_t {
  // How far, metres. [finite]
  double distance_m;
  // How many. [0, 100]
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
        self.write('compiler/CMakeLists.txt', 'add_subdirectory(base)\nadd_subdirectory(model)\n')
        self.write('compiler/base/CMakeLists.txt', 'morphbus_library(morphbus_base SOURCES a.cc)\n')
        self.write('compiler/model/CMakeLists.txt', 'morphbus_library(morphbus_model SOURCES a.cc DEPS morphbus_base)\n')
        self.write('vm/CMakeLists.txt', 'set(rooms image run)\nmorphbus_library(morphbus_vm SOURCES a.cc)\n')
        self.write('bridge/CMakeLists.txt', 'set(rooms bus wire)\n'
                   'morphbus_library(morphbus_bridge SOURCES a.cc DEPS morphbus_lcmtypes morphbus_vm morphbus_base)\n')
        self.write('sim/CMakeLists.txt', 'morphbus_library(morphbus_sim SOURCES a.cc DEPS morphbus_model)\n')
        self.write('logger/CMakeLists.txt',
                   'morphbus_library(morphbus_logger SOURCES a.cc\n  DEPS morphbus_bridge\n  PRIVATE_DEPS morphbus_model)\n')
        self.write('lcmtypes/CMakeLists.txt',
                   'set(MORPHBUS_LCM_TYPES\n  reading_t)\nadd_library(morphbus_lcmtypes INTERFACE)\n')
        self.write('lcmtypes/reading_t.lcm', GOOD_LCM)

    def write(self, path, text):
        (self.root / path).parent.mkdir(parents=True, exist_ok=True)
        (self.root / path).write_text(text)

    def run_lint(self, name, *arguments):
        done = subprocess.run([LINT / name, self.root, *arguments], capture_output=True, text=True)
        return done.returncode, done.stderr


class LayersTest(Tree):
    def expect(self, path, include, why=None):
        self.write(path, f'#include {include}\n')
        code, text = self.run_lint('layers')
        self.assertEqual(code, 1 if why else 0, text)
        if why:
            self.assertIn(f'{path}:1: error:', text)
            self.assertIn(why, text)

    def test_including_what_comes_before_is_accepted(self):
        self.expect('logger/a.cc', '"bridge/bus/bus.h"')

    def test_including_what_comes_after_is_rejected(self):
        self.expect('sim/a.cc', '"logger/log/event_log.h"', 'sim/ comes before logger/')

    def test_what_is_linked_through_others_is_accepted(self):
        self.expect('logger/a.cc', '"vm/vm.h"')

    def test_what_is_not_linked_is_rejected(self):
        self.expect('sim/a.cc', '"bridge/bus/bus.h"', 'no library of sim/ links one of bridge/')

    def test_vm_which_links_nothing_depends_on_nothing(self):
        self.expect('vm/a.cc', '<morphbus/header_t.hpp>', 'no library of vm/ links one of lcmtypes/')

    def test_bridge_which_does_not_link_the_model_keeps_off_it(self):
        self.expect('bridge/a.cc', '"compiler/model/robot_model.h"', 'no library of bridge/ links one of compiler/model/')
        self.expect('bridge/a.cc', '"compiler/base/result.h"')

    def test_stages_of_the_compiler_are_ordered(self):
        self.expect('compiler/base/a.h', '"compiler/model/robot_model.h"', 'compiler/base/ comes before compiler/model/')

    def test_rooms_of_a_folder_are_ordered(self):
        self.expect('bridge/wire/a.h', '"bridge/bus/bus.h"')
        self.expect('bridge/bus/a.h', '"bridge/wire/codec.h"', 'bridge/bus/ comes before bridge/wire/')

    def test_what_lies_beside_the_rooms_is_in_no_order(self):
        self.expect('vm/vm.cc', '"vm/run/state.h"')
        self.expect('vm/run/a.h', '"vm/module_api.h"')
        self.expect('vm/image/a.h', '"vm/run/state.h"', 'vm/image/ comes before vm/run/')

    def rooms(self, row):
        self.write('docs/architecture.md', '# Map\n\n## Rooms\n\n| room | for | not |\n|---|---|---|\n' + row + '\n## Words\n')

    def test_what_a_room_may_not_know_it_may_not_reach_through_others(self):
        self.write('compiler/base/a.h', '#include <Eigen/Core>\n')
        self.rooms('| `sim/` | physics | numbers: `Eigen` |\n' + ROWS)
        self.expect('sim/a.cc', '"compiler/base/b.h"')
        self.write('sim/a.cc', '#include "compiler/base/a.h"\n')
        code, text = self.run_lint('layers')
        self.assertEqual(code, 1)
        self.assertIn('sim/a.cc: error: compiler/base/a.h -> Eigen/Core: sim/ may not know Eigen', text)

    def test_what_a_folder_may_not_know_its_rooms_may_not(self):
        self.rooms('| `sim/` | physics | `compiler/model/` |\n' + ROWS)
        self.write('sim/a.cc', '#include "compiler/model/a.h"\n')
        code, text = self.run_lint('layers')
        self.assertEqual(code, 1)
        self.assertIn('sim/a.cc: error: compiler/model/a.h: sim/ may not know compiler/model/', text)

    def test_every_room_has_a_row_and_every_row_a_room(self):
        self.rooms(ROWS.replace('| `bridge/wire/` | x | |\n', '| `bridge/tyre/` | x | |\n'))
        code, text = self.run_lint('layers')
        self.assertEqual(code, 1)
        self.assertIn('bridge/wire/ has no row', text)
        self.assertIn('bridge/tyre/ has a row in the table of rooms, and is none', text)

    def test_tests_may_include_anything(self):
        self.expect('test/a.cc', '"logger/log/event_log.h"')


class HelperNamesTest(Tree):
    def expect(self, first, second, clashes, script='morphbus_library(morphbus_sim SOURCES a.cc b.cc)\n'):
        self.write('sim/CMakeLists.txt', script)
        for name, helper in (('a', first), ('b', second)):
            self.write(f'sim/{name}.cc', f'namespace {{\n\n{helper}\n\n}}  // namespace\n')
        code, text = self.run_lint('helper_names')
        self.assertEqual(code, 1 if clashes else 0, text)
        if clashes:
            self.assertIn('sim/b.cc: error: morphbus_sim has another', text)

    def test_the_same_function_twice_is_rejected(self):
        self.expect('int Root(const Tree& t, int i) {', 'int Root(const Tree& tree, int n) {', True)

    def test_overloads_are_accepted(self):
        self.expect('int Root(int i) {', 'int Root(double x) {', False)

    def test_a_parameter_with_a_default_makes_no_difference(self):
        self.expect('int Root(int i) {', 'int Root(int i, int j = 0) {', True)
        self.expect('int Root(int i) {', 'int Root(int i, const Colour& colour = {0.2, 0.4}) {', True)

    def test_the_same_type_twice_is_rejected(self):
        self.expect('struct Options {', 'struct Options {', True)

    def test_the_same_constant_twice_is_rejected(self):
        self.expect('constexpr double kGap = 1;', 'constexpr double kGap = 1;', True)

    def test_an_alias_of_another_type_is_rejected_the_same_alias_accepted(self):
        self.expect('using Kind = A::Kind;', 'using Kind = B::Kind;', True)
        self.expect('using Kind = A::Kind;', 'using Kind = A::Kind;', False)

    def hidden(self, space, parameters, include=''):
        """The lint's status where b.cc includes a function, and a.cc has a helper of its name."""
        self.write('sim/CMakeLists.txt', 'morphbus_library(morphbus_sim SOURCES a.cc b.cc)\n')
        self.write('sim/seal.h', 'namespace sim {\n\n/// Seals.\n[[nodiscard]] bool Seal(std::vector<int>* bytes);\n\n}  // namespace sim\n')
        self.write('sim/all.h', '#include "sim/seal.h"\n')
        self.write('sim/a.cc', f'{include}namespace {space} {{\nnamespace {{\n\nbool Seal({parameters}) {{\n\n}}  // namespace\n')
        self.write('sim/b.cc', '#include "sim/all.h"\n')
        return self.run_lint('helper_names')

    def test_a_helper_that_would_hide_a_function_of_a_header_is_rejected(self):
        code, text = self.hidden('sim', 'std::vector<int>* image')
        self.assertEqual(code, 1, text)
        self.assertIn('sim/a.cc: error: morphbus_sim has another Seal in sim/seal.h', text)

    def test_a_helper_that_hides_nothing_or_hides_it_today_is_accepted(self):
        for case in (('sim', 'int image'), ('other', 'std::vector<int>* image'),
                     ('sim', 'std::vector<int>* image', '#include "sim/seal.h"\n')):
            with self.subTest(case):
                code, text = self.hidden(*case)
                self.assertEqual(code, 0, text)

    def test_a_file_that_is_compiled_alone_is_left_out(self):
        self.expect('struct Options {', 'struct Options {', False,
                    'morphbus_library(morphbus_sim SOURCES a.cc b.cc)\nmorphbus_compile_alone(b.cc)\n')


class LcmCommentsTest(Tree):
    def expect(self, before, after, message):
        self.write('lcmtypes/reading_t.lcm', GOOD_LCM.replace(before, after))
        code, text = self.run_lint('lcm_comments')
        self.assertEqual(code, 1, text)
        self.assertIn(message, text)

    def test_a_documented_type_is_accepted(self):
        self.assertEqual(self.run_lint('lcm_comments')[0], 0)

    def test_field_without_comment_is_rejected(self):
        self.expect('  // How many. [0, 100]\n', '', 'count: no comment')

    def test_measure_without_unit_is_rejected(self):
        self.expect('How far, metres.', 'How far.', 'distance_m: the comment does not say the unit')

    def test_number_without_range_is_rejected(self):
        self.expect('How many. [0, 100]', 'How many.', 'reading_t.lcm:8: error: count: the comment says no range')
        self.expect('How far, metres. [finite]', 'How far, metres.', 'distance_m: the comment does not say which numbers')

    def test_trailing_comment_is_rejected(self):
        self.expect('int16_t count;', 'int16_t count;  // so many', 'trails')

    def test_type_without_channel_is_rejected(self):
        self.expect('Channel <RUN>/X', 'Somewhere', 'names no channel')

    def test_unlisted_file_is_rejected(self):
        self.write('lcmtypes/other_t.lcm', GOOD_LCM.replace('reading_t', 'other_t'))
        code, text = self.run_lint('lcm_comments')
        self.assertEqual(code, 1)
        self.assertIn('other_t.lcm:1: error: is not listed', text)


class LcmNamesTest(Tree):
    def expect(self, before, after, *words):
        self.write('lcmtypes/reading_t.lcm', GOOD_LCM.replace(before, after))
        code, text = self.run_lint('lcm_names')
        self.assertEqual(code, 1, text)
        for word in words:
            self.assertIn(word, text)

    def test_plain_names_are_accepted(self):
        self.assertEqual(self.run_lint('lcm_names')[0], 0)

    def test_a_word_of_any_language_is_rejected_as_a_field(self):
        for name, language in (('from', 'Python'), ('end', 'Lua'), ('function', 'Lua'), ('params', 'C#'), ('type', 'Go'),
                               ('boolean', 'Java'), ('template', 'C++'), ('restrict', 'C')):
            self.expect('count;', f'{name};', f'reading_t.lcm:8: error: {name} is a reserved word of', language)

    def test_arrays_and_constants_and_packages_are_looked_at(self):
        self.expect('int16_t count;', 'int16_t count;\n  // More, no unit.\n  int16_t range[3];', 'range', 'Go')
        self.expect('int16_t count;', 'int16_t count;\n  const int8_t GOOD = 1, None = 2;', 'None', 'Python')
        self.expect('package morphbus;', 'package internal;', 'internal', 'C#')

    def test_the_word_in_a_comment_is_no_name(self):
        self.write('lcmtypes/reading_t.lcm', GOOD_LCM.replace('How many.', 'How many; from; in.'))
        self.assertEqual(self.run_lint('lcm_names')[0], 0)


class PrintingTest(Tree):
    def expect(self, path, line, code):
        self.write(path, line + '\n')
        found, text = self.run_lint('printing')
        self.assertEqual(found, code, text)
        if code:
            self.assertIn(f'{path}:1: error:', text)
        (self.root / path).unlink()

    def test_what_throws_where_a_stream_cannot_be_written_is_rejected(self):
        for line in ('fmt::print("{}", 1);', 'fmt::print(stderr, "x");', 'std::cerr << "x";', 'std::printf("x");',
                     'std::fputs("x", stdout);', 'std::fputs("x", stderr);'):
            self.expect('tools/commands/x.cc', line, 1)
        self.expect('logger/log/x.cc', 'std::cout << 1;', 1)

    def test_the_one_place_and_stderr_below_the_tools_are_accepted(self):
        self.expect('tools/base/print.cc', 'std::fwrite(text.data(), 1, text.size(), stdout);', 0)
        self.expect('bridge/module/x.cc', 'std::fprintf(stderr, "x");', 0)
        self.expect('tools/commands/x.cc', 'Say("stdout"); // std::cout would throw', 0)


class GlossaryTest(Tree):
    PAGE = ('# Map\n\n## Words\n\n| word | meaning | declared in |\n|---|---|---|\n'
            '| held | what a module holds | `bridge/wire/held.h` |\n| neighbour | a module beside one | `vm/` |\n')

    def expect(self, why=None, page=PAGE):
        self.write('docs/architecture.md', page)
        self.write('bridge/wire/held.h', 'struct HeldState {\n  int held_ = 0;  // what nobody held\n};\n')
        self.write('vm/neighbours.h', 'void UpdateNeighbours(int tick);\n')
        code, text = self.run_lint('glossary')
        self.assertEqual(code, 1 if why else 0, text)
        self.assertIn(why or '', text)

    def test_words_where_the_glossary_has_them_are_accepted(self):
        self.expect()

    def test_a_second_meaning_is_rejected(self):
        for line, name in (('class HeldSubscriptions {', 'HeldSubscriptions'), ('enum class Held : int {', 'Held'),
                           ('  std::vector<int> held_;', 'held_'), ('  [[nodiscard]] bool held() const;', 'held'),
                           ('inline constexpr int kMostHeld = 3;', 'kMostHeld'), ('  kHeld,', 'kHeld'),
                           ('  uint8_t held : 1 = 0;', 'held'), ('using Held = std::vector<int>;', 'Held')):
            with self.subTest(line):
                self.write('bridge/bus/bus.h', f'// A bus.\n{line}\n')
                self.expect(f"bridge/bus/bus.h:2: error: '{name}': 'held' has a meaning already")

    def test_what_only_sounds_alike_or_is_said_in_passing_is_accepted(self):
        self.write('bridge/bus/bus.h', '// Held.\nvoid Hold(int upheld);  // held\nconst char* Text() { return "held"; }\n')
        self.expect()

    def test_places_that_do_not_have_the_word_are_rejected(self):
        self.expect("'held': nothing in vm/run/ is called so", self.PAGE.replace('held.h`', 'held.h`, `vm/run/`'))

    def test_more_words_than_a_reader_learns_are_rejected(self):
        rows = ''.join(f'| word{chr(97 + i // 26)}{chr(97 + i % 26)} | - | - |\n' for i in range(39))
        self.expect('41 words', self.PAGE + rows)

    def test_a_page_without_the_table_cannot_be_read(self):
        self.write('docs/architecture.md', '# Map\n')
        self.assertEqual(self.run_lint('glossary')[0], 2)


class ArithmeticTest(Tree):
    def setUp(self):
        super().setUp()
        self.top = (self.root / 'CMakeLists.txt').read_text()
        self.write('cmake/Options.cmake', 'add_compile_options(-ffp-contract=off)\n')
        self.write('CMakeLists.txt', 'include(Options)\n' + self.top)

    def expect(self, why=None, *arguments):
        code, text = self.run_lint('arithmetic', *arguments)
        self.assertEqual(code, 1 if why else 0, text)
        self.assertIn(why or '', text)

    def commands(self, *options):
        self.write('commands.json', json.dumps([{'file': 'a.cc', 'command': ' '.join(('c++', *options, '-c a.cc'))}]))
        return self.root / 'commands.json'

    def test_contraction_is_off_for_all(self):
        self.expect()
        self.write('CMakeLists.txt', self.top + 'include(Options)\n')
        self.expect('CMakeLists.txt:1: error: nothing before the first folder')

    def test_options_that_reassociate_are_rejected(self):
        self.write('sim/CMakeLists.txt', 'target_compile_options(a PRIVATE\n  -O3 -ffast-math)\n')
        self.expect('sim/CMakeLists.txt:2: error: -ffast-math')

    def test_presets_are_looked_at(self):
        self.write('CMakePresets.json', '{"CMAKE_CXX_FLAGS_RELEASE": "-Ofast"}\n')
        self.expect('CMakePresets.json:1: error: -Ofast')

    def test_sources_that_ask_for_it_are_rejected(self):
        for line in ('#pragma STDC FP_CONTRACT ON', '#pragma GCC optimize ("fast-math")',
                     '__attribute__((optimize("O3"))) void F();'):
            self.write('vm/a.cc', '// A file.\n' + line + '\n')
            self.expect('vm/a.cc:2: error:')

    def test_a_compile_command_must_say_it_last(self):
        self.expect(None, self.commands('-O2', '-ffp-contract=off'))
        self.expect('a.cc:1: error: is compiled without', self.commands('-O2'))
        self.expect('a.cc:1: error: is compiled with -ffp-contract=fast',
                    self.commands('-ffp-contract=off', '-ffp-contract=fast'))
        self.expect('a.cc:1: error: is compiled with -ffast-math', self.commands('-ffast-math', '-ffp-contract=off'))


if __name__ == '__main__':
    unittest.main()
