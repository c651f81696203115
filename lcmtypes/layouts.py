#!/usr/bin/env python3
"""Makes of the ranges in the comments of .lcm files what C++ checks messages by.

The comment above a field ends with what the field may hold (lcmtypes/README.md, Ranges). The header that is
written has a function `Walk` for each type, which tells a visitor of the type's fields, one by one and in their
order (bridge/wire/message_layout.h says what a visitor is). tools/lint/lcm_comments reads fields by this file too.

Usage: layouts.py OUTPUT.hpp TYPE.lcm ...     exit status 0: written; 2: unusable input, each fault with file and line
"""
import dataclasses
import os
import pathlib
import re
import sys

BITS = {'int8_t': 8, 'int16_t': 16, 'int32_t': 32, 'int64_t': 64}
REALS = {'float': 'Float', 'double': 'Double'}
FIELD = re.compile(r'\s*(?!const\b|struct\b|package\b)([\w.]+)\s+(\w+)\s*(?:\[\s*(\w+)\s*\]\s*)?;\s*(//.*|)$')
OTHER = re.compile(r'\s*(?:package\s[\w.]+;|struct\s+\w+\s*\{|const\s[^;]*;|\}|)\s*(?://.*)?$')
BOUND = r'\s*(-?(?:2\^\d{1,2}|\d{1,20}))\s*'
INTERVAL = re.compile(rf'([\[(]){BOUND},{BOUND}([\])])$')
TEXT = re.compile(r'\[at most (\d{1,6}) bytes\]$')


class Fault(Exception):
    """What is wrong with a line of an .lcm file, as a sentence with a way out."""

    def __init__(self, line: int, text: str):
        super().__init__(text)
        self.line = line


@dataclasses.dataclass
class Field:
    """A field as its file declares it."""
    kind: str      # its type, as written: "int8_t", "morphbus.pose_t"
    name: str
    length: str    # of an array, a number or a field's name; None if it is none
    comment: str   # the comment above it, its lines joined
    trailing: str  # what follows it on its line
    line: int


def fields_of(text: str):
    """Yields the fields of an .lcm file. Raises Fault at a line that is none of what such a file has."""
    comment = []
    for number, line in enumerate(text.splitlines(), 1):
        if line.strip().startswith('//'):
            comment.append(line.strip()[2:].strip())
            continue
        if match := FIELD.match(line):
            yield Field(*match.group(1, 2, 3), ' '.join(comment), match.group(4), number)
        elif not OTHER.match(line):
            raise Fault(number, 'cannot be read: write one field a line, an array with one length, as in '
                                '"int8_t joint_sign[num_joints];"')
        comment = []


def bound(text: str) -> int:
    """"-1", "2^31"."""
    digits = text.lstrip('-')
    value = 1 << int(digits[2:]) if '^' in digits else int(digits)
    return -value if text.startswith('-') else value


def range_of(field: Field):
    """The lowest and the highest value of a whole number, both allowed; None if any will do."""
    if field.comment.endswith('[any]'):
        return None
    match = INTERVAL.search(field.comment)
    if not match:
        raise Fault(field.line, f'{field.name}: the comment says no range: end it with one, such as [0, 127], '
                                '[-1, 2^31) or [any]')
    lowest = bound(match.group(2)) + (match.group(1) == '(')
    highest = bound(match.group(3)) - (match.group(4) == ')')
    limit = 1 << (BITS[field.kind] - 1)
    if not -limit <= lowest <= highest < limit:
        raise Fault(field.line, f'{field.name}: {match.group()} is no range of {field.kind}, which goes from {-limit} '
                                f'to {limit - 1}: write the lower bound first, and both within it')
    return lowest, highest


def text_limit(field: Field) -> int:
    """How many bytes a string has at most."""
    if match := TEXT.search(field.comment):
        return int(match.group(1))
    raise Fault(field.line, f'{field.name}: the comment says no length: end it with one, such as [at most 64 bytes]')


def is_unit(field: Field) -> bool:
    """Whether the numbers are a quaternion of unit length; else they are any that are finite."""
    if field.comment.endswith('[unit length]') and field.length == '4':
        return True
    if field.comment.endswith('[finite]'):
        return False
    raise Fault(field.line, f'{field.name}: the comment does not say which numbers: end it with [finite], or a '
                            'quaternion\'s (an array of 4) with [unit length]')


class Layout:
    """The layout of one type, put together field by field."""

    def __init__(self, name: str, text: str):
        self.name = name
        self.ranges = {}  # whole numbers that are no arrays and have a range: the range
        self.lines = []
        self.faults = []
        self.fields = []
        checked = 0  # behind the line of the last number
        try:
            self.fields = list(fields_of(text))
        except Fault as fault:
            self.faults.append(fault)
        for field in self.fields:
            try:
                self.add(field)
            except Fault as fault:
                self.faults.append(fault)
            if field.name in self.ranges:
                checked = len(self.lines)
        if self.ranges:
            self.lines.insert(checked, 'CheckTogether(v, n);')
            self.lines.insert(0, f'Numbers<morphbus::{name}> n = {{}};')

    def count(self, field: Field) -> str:
        """How many elements the field has, as C++."""
        if field.length is None or field.length.isdigit():
            return field.length or '1'
        if self.ranges.get(field.length, (-1,))[0] < 0:
            raise Fault(field.line, f'{field.name}: its length {field.length} must be a field before it, of a whole '
                                    'number, with a range from 0 or 1')
        return f'n.{field.length}'

    def add_whole(self, field: Field, count: str) -> None:
        """Of whole numbers."""
        bits, span = BITS[field.kind], range_of(field)
        if span is None:
            self.lines.append(f'v.Bytes("{field.name}", {bits // 8}{f" * {count}" if field.length else ""});')
            return
        # A lowest value of -2^63 cannot be written as a number of C++.
        lowest, highest = (f'{n}' if n > -(1 << 63) else f'({n + 1} - 1)' for n in span)
        visit = 'Count' if any(f.length == field.name for f in self.fields) else 'Int'
        call = f'v.template {visit}<{field.kind}>("{field.name}", {lowest}, {highest});'
        if field.length is None:
            self.ranges[field.name] = span
            self.lines.append(f'n.{field.name} = {call}')
        else:
            self.lines.append(f'for (int64_t i = 0; i < {count}; ++i) {call}')

    def add(self, field: Field) -> None:
        count, called = self.count(field), f'"{field.name}"'
        if field.kind in BITS:
            self.add_whole(field, count)
        elif real := REALS.get(field.kind):
            self.lines.append(f'v.{real}Quaternion({called});' if is_unit(field) else f'v.{real}s({called}, {count});')
        elif field.kind == 'string':
            limit = text_limit(field)
            self.lines.append(f'v.Texts({called}, {count}, {limit});' if field.length else f'v.Text({called}, {limit});')
        elif field.comment.endswith(']'):
            raise Fault(field.line, f'{field.name}: the comment ends with a range, and a {field.kind} has none: take it out')
        elif field.kind == 'byte':
            self.lines.append(f'v.Bytes({called}, {count});')
        elif field.kind == 'boolean':
            if field.length:
                raise Fault(field.line, f'{field.name}: no check is known of an array of boolean: use int8_t with [0, 1]')
            self.lines.append(f'v.Bool({called});')
        else:
            struct = field.kind.replace('.', '::')
            self.lines.append(f'v.template Structs<{struct}>({called}, {count});' if field.length
                              else f'v.template Struct<{struct}>({called});')

    def text(self) -> str:
        """The layout as C++, of a type without faults."""
        kind = f'morphbus::{self.name}'
        numbers = f'template <>\nstruct Numbers<{kind}> {{\n  int64_t {", ".join(self.ranges)};\n}};\n'
        body = ''.join(f'  {line}\n' for line in self.lines)
        return f'{numbers if self.ranges else ""}template <class V>\nconstexpr void Walk(V& v, As<{kind}>) {{\n{body}}}\n'


HEAD = '''#pragma once
// Made by lcmtypes/layouts.py of the ranges in lcmtypes/*.lcm; to be included by bridge/wire/message_layout.h only,
// which has CheckTogether and says what V is.

#include <cstdint>
{includes}
namespace morphbus::layout {{

/// Stands for the type whose layout a Walk describes, and has no content: the compiler chooses by it.
template <class M>
struct As {{}};

/// The whole numbers of an M that have a range.
template <class M>
struct Numbers;

{layouts}
}}  // namespace morphbus::layout
'''


def main(arguments: list) -> int:
    if arguments[:1] in (['-h'], ['--help']):
        print(__doc__.strip())
        return 0
    if len(arguments) < 2:
        print(__doc__.strip(), file=sys.stderr)
        return 2
    output, paths = pathlib.Path(arguments[0]), [pathlib.Path(a) for a in arguments[1:]]
    try:
        layouts = [Layout(path.stem, path.read_text(encoding='utf-8')) for path in paths]
    except (OSError, UnicodeDecodeError) as error:
        print(f'layouts.py: {error}', file=sys.stderr)
        return 2
    faults = [(path, fault) for path, layout in zip(paths, layouts) for fault in layout.faults]
    for path, fault in faults:
        print(f'{path}:{fault.line}: error: {fault}', file=sys.stderr)
    if faults:
        return 2
    text = HEAD.format(includes=''.join(f'#include <morphbus/{path.stem}.hpp>\n' for path in paths),
                       layouts='\n'.join(layout.text() for layout in layouts))
    try:
        output.parent.mkdir(parents=True, exist_ok=True)
        unfinished = output.with_name(output.name + '.part')
        unfinished.write_text(text, encoding='utf-8')
        os.replace(unfinished, output)
    except OSError as error:
        print(f'layouts.py: {error}', file=sys.stderr)
        return 2
    return 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
