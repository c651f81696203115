#!/usr/bin/env python3
"""Draws README's pictures of the quadruped anew, standing.png and walking.png: records its walk, and keeps what
`morphbus draw` makes of it at half the size. monitor.mjs and robots.py draw the other two.

Usage: docs/pictures/readme.py [MORPHBUS]     the program (default build/release/bin/morphbus)
"""
import pathlib
import subprocess
import sys
import tempfile

from robots import SOURCE, read_png, shrink, write_png

PICTURES = {'standing': ('--at', '3', '--view', 'side,top'),
            # Four moments of one cycle, which takes 7.02 s.
            'walking': ('--strip', '4', '--from', '9.32', '--to', '14.6', '--view', 'iso')}


def main():
    morphbus = sys.argv[1] if len(sys.argv) > 1 else SOURCE / 'build/release/bin/morphbus'
    with tempfile.TemporaryDirectory() as name:
        log = pathlib.Path(name) / 'walk.log'
        subprocess.run([morphbus, 'run', SOURCE / 'models/mtran.m3l', SOURCE / 'models/programs/quadruped.dyn', '--robot',
                        'quadruped', '--seconds', '15', '--inproc', '--log', log], check=True, stdout=subprocess.DEVNULL)
        for picture, options in PICTURES.items():
            path = pathlib.Path(name) / f'{picture}.png'
            subprocess.run([morphbus, 'draw', log, *options, '-o', path], check=True, stdout=subprocess.DEVNULL)
            write_png(SOURCE / f'docs/pictures/{picture}.png', shrink(read_png(path)))


if __name__ == '__main__':
    main()
