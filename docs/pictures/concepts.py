#!/usr/bin/env python3
"""Draws the pictures of what M3L and DynaRole speak of anew, by `morphbus draw`: module.png, connections.png, roles.png; and README's
of the quadruped, standing.png and walking.webp.

Usage: docs/pictures/concepts.py [MORPHBUS]     the program (default build/release/bin/morphbus)
"""
import pathlib
import subprocess
import sys
import tempfile

from robots import SOURCE, beside, read_png, shrink, write_png

MODEL = SOURCE / 'models/mtran.m3l'
PROGRAM = SOURCE / 'models/programs/quadruped.dyn'
# Each a row of panels: the options of `draw` for each panel.
PICTURES = {
    'module': [('--module', 'MTRAN', '--view', 'iso'), ('--module', 'MTRAN', '--view', 'side')],
    'connections': [('--number', str(number), '--view', 'iso') for number in (1, 2, 13, 26)],
    'roles': [('--robot', robot, '--program', PROGRAM, '--view', 'iso') for robot in ('quadruped', 'equivalent_quadruped')],
}
WIDTH = {'module': 420, 'connections': 260, 'roles': 520}


def main():
    morphbus = sys.argv[1] if len(sys.argv) > 1 else SOURCE / 'build/release/bin/morphbus'

    def run(*arguments):
        subprocess.run([morphbus, *arguments], check=True, stdout=subprocess.DEVNULL)

    with tempfile.TemporaryDirectory() as name:
        for picture, panels in PICTURES.items():
            drawn = []
            for i, options in enumerate(panels):
                path = pathlib.Path(name) / f'{picture}{i}.png'
                run('draw', MODEL, *options, '--width', str(WIDTH[picture]), '-o', path)
                drawn.append(read_png(path))
            write_png(SOURCE / f'docs/pictures/{picture}.png', beside(drawn))
        log = pathlib.Path(name) / 'walk.log'
        run('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', '17', '--inproc', '--log', log)
        standing = pathlib.Path(name) / 'standing.png'
        run('draw', log, '--at', '3', '--view', 'side,top', '-o', standing)
        write_png(SOURCE / 'docs/pictures/standing.png', shrink(read_png(standing)))
        # One cycle, which then begins again.
        run('draw', log, '--video', '--view', 'iso', '--fps', '6', '--width', '420', '--from', '9.32', '--to', '16.3', '--force', '-o',
            SOURCE / 'docs/pictures/walking.webp')


if __name__ == '__main__':
    main()
