#!/usr/bin/env python3
"""Draws the pictures of docs/tutorial.md anew: runs its commands in a scratch folder, in their order, and keeps what
they draw at half the size and in fewer colors.

Usage: docs/pictures/tutorial.py [MORPHBUS]     the program (default build/release/bin/morphbus)
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

from robots import SOURCE, read_png, shrink, write_png

STEP = 16  # of a color channel


def main():
    morphbus = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else SOURCE / 'build/release/bin/morphbus').resolve()
    text = (SOURCE / 'docs/tutorial.md').read_text(encoding='utf-8')
    environment = {**os.environ, 'PATH': f'{morphbus.parent}{os.pathsep}{os.environ["PATH"]}'}
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / 'models').symlink_to(SOURCE / 'models')
        for kind, file, body in re.findall(r'```(m3l|dyn|xml|toml|sh) ?(\S*)\n(.*?)```', text, re.S):
            if kind != 'sh':
                (folder / file).write_text(body)
                continue
            for line in body.splitlines():
                subprocess.run(['sh', '-c', line], cwd=folder, env=environment, check='# exit status' not in line,
                               stdout=subprocess.DEVNULL)
        for picture in re.findall(r'!\[.*?\]\(pictures/(\S+)\)', text):
            rows = [bytes(min(255, (value + STEP // 2) // STEP * STEP) for value in row)
                    for row in shrink(read_png(folder / picture))]
            write_png(SOURCE / 'docs/pictures' / picture, rows)


if __name__ == '__main__':
    main()
