#!/usr/bin/env python3
"""What the documentation says of the tree must be so.

In docs/architecture.md a line of a table, or a paragraph, names files and functions in backquotes. Every
file or folder must exist; every function must stand in one of the files of its line or paragraph. In
README.md and CONTRIBUTING.md only files and folders are checked (NAME stands for any name). The picture
must have been drawn from the source beside it.
"""
import html
import os
import pathlib
import re
import unittest

ROOT = pathlib.Path(os.environ.get('MORPHBUS_SOURCE', pathlib.Path(__file__).resolve().parents[2]))
QUOTED = re.compile(r'`([^`\n]+)`')
PATH = re.compile(r'^(?:bridge|compiler|docs|lcmtypes|logger|models|sim|test|tools|vm|cmake)/[\w./-]*$')
FUNCTION = re.compile(r'^(?:(?:[A-Z]\w+::)?[A-Z][a-z]\w*|HANDLE(?:\(\w+\))?)$')


def blocks(text):
    """Lines of tables, and paragraphs without their line breaks, but for fenced examples."""
    text = re.sub(r'^```.*?^```', '', text, flags=re.M | re.S)
    for paragraph in text.split('\n\n'):
        if paragraph.lstrip().startswith('|'):
            yield from paragraph.splitlines()
        else:
            yield paragraph.replace('\n', ' ')


def paths_in(block):
    return [quoted for quoted in QUOTED.findall(block) if PATH.match(quoted) and 'NAME' not in quoted]


def missing_functions(block, sources):
    """The functions of a block of text that none of `sources` contains, last parts of qualified names."""
    names = [quoted for quoted in QUOTED.findall(block) if FUNCTION.match(quoted)]
    # HANDLE(kName), the code of one instruction, is looked for as it stands.
    return [n for n in names if not any(re.search(rf'\b{re.escape(n.split("::")[-1])}\b\s*[(<]|\b{re.escape(n)}(?!\w)', s)
                                        for s in sources)]


class DocumentsTest(unittest.TestCase):
    def test_every_file_that_is_named_exists(self):
        for document in ('docs/architecture.md', 'README.md', 'CONTRIBUTING.md'):
            for block in blocks((ROOT / document).read_text()):
                for path in paths_in(block):
                    with self.subTest(document=document, path=path):
                        self.assertTrue((ROOT / path).exists(), f'{document} names {path}')

    def test_every_function_is_in_a_file_named_beside_it(self):
        checked = 0
        for block in blocks((ROOT / 'docs/architecture.md').read_text()):
            files = [ROOT / p for p in paths_in(block) if (ROOT / p).is_file()]
            if not files:
                continue
            sources = [f.read_text() for f in files]
            checked += len([q for q in QUOTED.findall(block) if FUNCTION.match(q)])
            self.assertEqual(missing_functions(block, sources), [], block)
        self.assertGreater(checked, 30)

    def test_a_function_that_is_gone_is_found_out(self):
        block = '| 1 | it turns | `sim/servo.cc` | `Servo::Stride` |'
        self.assertEqual(missing_functions(block, ['double Servo::Step(double position) {']), ['Servo::Stride'])
        self.assertEqual(missing_functions(block, ['double Servo::Stride(double position) {']), [])

    def test_an_instruction_without_its_code_is_found_out(self):
        block = '| 1 | it turns | `vm/run/interpreter.cc` | `HANDLE(kSpin)` |'
        self.assertEqual(missing_functions(block, ['HANDLE(kTurn) { Turn(); }']), ['HANDLE(kSpin)'])
        self.assertEqual(missing_functions(block, ['HANDLE(kSpin) { Spin(); }']), [])

    def test_the_picture_shows_what_its_source_says(self):
        source = (ROOT / 'docs/pictures/architecture.dot').read_text()
        picture = html.unescape((ROOT / 'docs/pictures/architecture.svg').read_text())
        drawn = {' '.join(text.split()) for text in re.findall(r'<text[^>]*>([^<]*)</text>', picture)}
        for label in re.findall(r'label="([^"]*)"', source):
            for line in label.split('\\n'):
                self.assertIn(' '.join(line.split()), drawn, 'draw it again: cmake --build --preset dev --target pictures')
        for folder in re.findall(r'\b((?:bridge|compiler|logger|sim|vm)/\w*)', source):
            self.assertTrue((ROOT / folder).is_dir(), folder)


if __name__ == '__main__':
    unittest.main()
