#!/usr/bin/env python3
"""lcmtypes/layouts.py: what it makes of ranges, and what it says of those that are missing or wrong."""
import contextlib
import io
import pathlib
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / 'lcmtypes'))
import layouts  # noqa: E402  what is tested


def generate(*arguments):
    """Exit status and stderr."""
    text = io.StringIO()
    with contextlib.redirect_stderr(text):
        return layouts.main([str(a) for a in arguments]), text.getvalue()



class Generator(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.source = pathlib.Path(folder.name) / 'reading_t.lcm'
        self.output = pathlib.Path(folder.name) / 'made' / 'layouts.hpp'

    def run_on(self, fields):
        """A type with these lines between its braces, of which the first is line 4."""
        self.source.write_text(f'package morphbus;\n\nstruct reading_t {{\n{fields}\n}}\n')
        return generate(self.output, self.source)


class RangesTest(Generator):
    def expect(self, fields, *calls):
        code, text = self.run_on(fields)
        self.assertEqual(code, 0, text)
        made = [line.strip() for line in self.output.read_text().splitlines()]
        for call in calls:
            self.assertIn(call, made)

    def test_whole_numbers_have_the_width_of_their_type_and_the_range_of_their_comment(self):
        self.expect('// [0, 127]\nint8_t a;', 'n.a = v.template Int<int8_t>("a", 0, 127);')
        self.expect('// From there. [-1, 2^15)\nint16_t a;', 'n.a = v.template Int<int16_t>("a", -1, 32767);')
        self.expect('// So many,\n// at most. (0, 65552]\nint32_t a;', 'n.a = v.template Int<int32_t>("a", 1, 65552);')
        self.expect('// [-2^63, 2^56]\nint64_t a;', 'n.a = v.template Int<int64_t>("a", (-9223372036854775807 - 1), 72057594037927936);')
        self.expect('// [any]\nint64_t a;', 'v.Bytes("a", 8);')

    def test_a_number_by_which_an_array_goes_is_a_count(self):
        self.expect('// [1, 4]\nint16_t size;\n// The bytes.\nbyte bytes[size];',
                    'n.size = v.template Count<int16_t>("size", 1, 4);', 'v.Bytes("bytes", n.size);')
        self.expect('// [0, 4]\nint8_t n;\n// [-1, 1]\nint8_t signs[n];\n// [any]\nint32_t cells[n];',
                    'for (int64_t i = 0; i < n.n; ++i) v.template Int<int8_t>("signs", -1, 1);', 'v.Bytes("cells", 4 * n.n);')

    def test_numbers_texts_flags_and_structs(self):
        self.expect('// Metres. [finite]\nfloat p[3];\n// [finite]\ndouble d;\n// [unit length]\ndouble q[4];\n// [unit length]\n'
                    'float r[4];', 'v.Floats("p", 3);', 'v.Doubles("d", 1);', 'v.DoubleQuaternion("q");',
                    'v.FloatQuaternion("r");')
        self.expect('// [0, 2]\nint8_t n;\n// [at most 28 bytes]\nstring name;\n// [at most 9 bytes]\nstring words[n];',
                    'v.Text("name", 28);', 'v.Texts("words", n.n, 9);')
        self.expect('// [0, 2]\nint8_t n;\n// True.\nboolean flag;\nmorphbus.header_t header;\nmorphbus.pose_t poses[n];',
                    'v.Bool("flag");', 'v.template Struct<morphbus::header_t>("header");',
                    'v.template Structs<morphbus::pose_t>("poses", n.n);')

    def test_what_numbers_say_together_is_checked_behind_the_last_of_them(self):
        self.expect('// [0, 4]\nint8_t a;\n// [1, 4]\nint8_t b;\n// The bytes.\nbyte bytes[b];', 'int64_t a, b;')
        made = self.output.read_text()
        self.assertLess(made.index('"b"'), made.index('CheckTogether(v, n);'))
        self.assertLess(made.index('CheckTogether(v, n);'), made.index('"bytes"'))


class FaultsTest(Generator):
    def expect(self, fields, line, *words):
        code, text = self.run_on(fields)
        self.assertEqual(code, 2, fields)
        self.assertIn(f'{self.source}:{line}: error: ', text)
        for word in words:
            self.assertIn(word, text)
        self.assertFalse(self.output.exists())

    def test_a_field_without_its_range_is_refused_with_an_example(self):
        self.expect('// How many.\nint8_t a;', 5, 'a: the comment says no range', '[0, 127]')
        self.expect('int8_t a;', 4, 'a: the comment says no range')
        self.expect('// [0, 1]\nint8_t a;\n\nint8_t b;', 7, 'b: the comment says no range')
        self.expect('// A name.\nstring a;', 5, 'a: the comment says no length', '[at most 64 bytes]')
        self.expect('// Metres.\ndouble a[3];', 5, 'a: the comment does not say which numbers', '[finite]')

    def test_a_wrong_range_is_refused(self):
        for wrong in ('[0, 128]', '[-129, 0]', '[2, 1]', '(0, 1)', '[0, 2^7]', '[0, 2^99)'):
            self.expect(f'// {wrong}\nint8_t a;', 5, f'a: {wrong} is no range of int8_t, which goes from -128 to 127')
        for wrong in ('[0 127]', '[0, kMost]', '[0, 1.5]', '[0, 5].', '[0, 5] or so', '[finite]', '[0, 2^999999999)', '[]'):
            self.expect(f'// {wrong}\nint8_t a;', 5, 'a: the comment says no range')
        self.expect('// [at most some bytes]\nstring a;', 5, 'a: the comment says no length')
        self.expect('// [unit length]\ndouble a[3];', 5, 'an array of 4')

    def test_a_range_where_none_belongs_is_refused(self):
        self.expect('// [0, 1]\nboolean a;', 5, 'a boolean has none')
        self.expect('// [any]\nbyte a[3];', 5, 'a byte has none')

    def test_an_array_needs_a_length_that_is_known_before_it(self):
        self.expect('// The bytes.\nbyte a[size];\n// [0, 4]\nint8_t size;', 5, 'its length size must be a field before it')
        self.expect('// [any]\nint8_t size;\n// The bytes.\nbyte a[size];', 7, 'its length size must be a field before it')
        self.expect('// [-1, 4]\nint8_t size;\n// The bytes.\nbyte a[size];', 7, 'with a range from 0')
        self.expect('// Flags.\nboolean a[3];', 5, 'use int8_t with [0, 1]')

    def test_a_line_that_would_be_passed_over_is_refused(self):
        for line in ('int8_t a, b;', 'int8_t a; int8_t b;', 'double a[3][3];', '/* More. */', 'enum b_t { A }'):
            self.expect(f'// [0, 1]\n{line}', 5, 'write one field a line')

    def test_every_fault_is_named_at_once(self):
        code, text = self.run_on('// One.\nint8_t a;\n// Two.\nint8_t b;')
        self.assertEqual(code, 2)
        self.assertEqual(text.count('error:'), 2)

    def test_what_was_made_before_stays_where_something_is_wrong(self):
        self.assertEqual(self.run_on('// [0, 1]\nint8_t a;')[0], 0)
        before = self.output.read_text()
        self.assertEqual(self.run_on('int8_t a;')[0], 2)
        self.assertEqual(self.output.read_text(), before)

    def test_files_that_cannot_be_read_are_named(self):
        code, text = generate(self.output, self.source)
        self.assertEqual(code, 2)
        self.assertIn(str(self.source), text)
        self.assertEqual(generate(self.output)[0], 2)


if __name__ == '__main__':
    unittest.main()
