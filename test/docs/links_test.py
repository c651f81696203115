#!/usr/bin/env python3
"""The documents lead to one another: every link has its file and its heading, every document can be reached from
README.md, and the table of contents of docs/cli.md has all that stands below it."""
import os
import pathlib
import re
import unittest

ROOT = pathlib.Path(os.environ.get('MORPHBUS_SOURCE', pathlib.Path(__file__).resolve().parents[2]))
LINK = re.compile(r'\]\(([^)\s]+)\)')
FENCED = re.compile(r'^```.*?^```', re.M | re.S)


def text_of(path):
    return FENCED.sub('', path.read_text(encoding='utf-8'))


def anchors(text):
    """The names that GitHub gives to headings: lower case, blanks as hyphens, no punctuation; of two alike the second gets -1."""
    seen, names = {}, set()
    for heading in re.findall(r'^#+ +(.*?) *$', text, re.M):
        name = re.sub(r'[^\w\- ]', '', LINK.sub(']', heading).lower()).replace(' ', '-')
        names.add(f'{name}-{seen[name]}' if name in seen else name)
        seen[name] = seen.get(name, 0) + 1
    return names


def links(path):
    """Where a document's links lead inside the project: pairs of a file and a heading's name, or ''."""
    for target in LINK.findall(re.sub(r'`[^`\n]*`', '', text_of(path))):
        if not re.match(r'[a-z]+:', target):
            file, _, anchor = target.partition('#')
            yield (path.parent / file if file else path).resolve(), anchor


def broken(path):
    """What is wrong with a document's links, in words."""
    for file, anchor in links(path):
        if not file.exists():
            yield f'{path.name}: there is no {os.path.relpath(file, path.parent)}'
        elif anchor and anchor not in anchors(text_of(file)):
            yield f'{path.name}: {file.name} has no heading #{anchor}'


def reached(start):
    found, ahead = set(), [start.resolve()]
    while ahead:
        path = ahead.pop()
        if path not in found:
            found.add(path)
            ahead += [file for file, _ in links(path) if file.suffix == '.md' and file.exists()]
    return found


class LinksTest(unittest.TestCase):
    def documents(self):
        return [*ROOT.glob('*.md'), *ROOT.glob('docs/**/*.md'), ROOT / 'lcmtypes' / 'README.md']

    def test_every_link_has_its_file_and_its_heading(self):
        self.assertEqual([wrong for path in self.documents() for wrong in broken(path)], [])

    def test_every_document_can_be_reached_from_the_first(self):
        found = reached(ROOT / 'README.md')
        self.assertEqual([str(path) for path in self.documents() if path.resolve() not in found], [])

    def test_headings_have_the_names_that_github_gives_them(self):
        self.assertEqual(anchors('# What it does\n## `run FILE`, and *more*\n## Twice\n## Twice\n'),
                         {'what-it-does', 'run-file-and-more', 'twice', 'twice-1'})


class ContentsTest(unittest.TestCase):
    """docs/cli.md: a row a section, `[Title](#title) | commands | what for`."""

    def setUp(self):
        self.text = text_of(ROOT / 'docs' / 'cli.md')
        contents = re.search(r'^## Contents\n(.*?)^## ', self.text, re.M | re.S)[1]
        self.rows = [(title, re.findall(r'`(\w+)`', commands))
                     for title, commands in re.findall(r'^\| \[(.*?)\]\(.*?\) \|(.*?)\|', contents, re.M)]

    def test_the_contents_have_the_sections_in_their_order(self):
        sections = [title for title in re.findall(r'^## (.*)$', self.text, re.M) if title != 'Contents']
        self.assertEqual([title for title, _ in self.rows], sections)

    def test_headings_of_commands_are_their_names(self):
        """So that links to them stay what they are when an option is added; how a command is called stands below its heading."""
        whole = (ROOT / 'docs' / 'cli.md').read_text(encoding='utf-8')
        for heading in re.findall(r'^### (.*)$', self.text, re.M):
            with self.subTest(heading=heading):
                self.assertRegex(heading, r'^`\w+`(, `\w+`)*$')
                for name in re.findall(r'`(\w+)`', heading):
                    section = re.search(rf'^### {re.escape(heading)}\n(.*?)(?=^##|\Z)', whole, re.M | re.S)[1]
                    self.assertRegex(section, rf'(?m)^morphbus {name}\b')

    def test_the_contents_have_the_commands_of_each_section(self):
        for title, commands in self.rows:
            with self.subTest(section=title):
                section = re.search(rf'^## {re.escape(title)}\n(.*?)(?=^## |\Z)', self.text, re.M | re.S)[1]
                headings = re.findall(r'^### (.*)$', section, re.M)
                named = [name for heading in headings for name in re.findall(r'`(\w+)', heading)]
                self.assertEqual(commands, list(dict.fromkeys(named)))


if __name__ == '__main__':
    unittest.main()
