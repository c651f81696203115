#!/usr/bin/env python3
"""Draws docs/pictures/robots.png and modules.png anew: robots of each kind of module in perspective, by
`morphbus draw`, put side by side in true color.

Usage: docs/pictures/robots.py [MORPHBUS]     the program (default build/release/bin/morphbus)
"""
import pathlib
import struct
import subprocess
import sys
import tempfile
import zlib

SOURCE = pathlib.Path(__file__).resolve().parents[2]
ROBOTS = (('atron', 'car7'), ('molecube', 'arm'), ('ckbot', 'loop'),
          ('mtran_robots', 'caterpillar'), ('mtran_robots', 'crawler'), ('mixed', 'inchworm'))
OTHERS = (('smores', 'train'), ('superbot', 'superbot_snake'), ('rofi', 'rofi_snake'),
          ('roombots', 'roombots_snake'), ('dtto', 'dtto_ring'), ('revolve2', 'spider'),
          ('pairs', 'crane'), ('pairs', 'tractor'))
COLUMNS = 2
SHRINK = 2  # draw's pixels a pixel of the picture, each way: their mean is one more smoothing


def read_png(path):
    """Rows of 3-byte pixels of an 8-bit RGB picture, as cairo writes it."""
    data, at, packed = path.read_bytes(), 8, b''
    while at < len(data):
        size, kind = struct.unpack_from('>I4s', data, at)
        body = data[at + 8:at + 8 + size]
        if kind == b'IHDR':
            width, height, depth, color, _, _, interlaced = struct.unpack('>IIBBBBB', body)
            assert (depth, color, interlaced) == (8, 2, 0), path
        if kind == b'IDAT':
            packed += body
        at += size + 12
    raw, stride = zlib.decompress(packed), width * 3
    rows, above = [], bytearray(stride)
    for y in range(height):
        kind = raw[y * (stride + 1)]
        row = bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        for i in range(stride if kind else 0):  # undo the row's filter
            left, up, corner = (row[i - 3] if i > 2 else 0), above[i], (above[i - 3] if i > 2 else 0)
            guess = min((abs(up - corner), 0, left), (abs(left - corner), 1, up),
                        (abs(left + up - 2 * corner), 2, corner))[2]
            row[i] = (row[i] + (0, left, up, (left + up) // 2, guess)[kind]) & 255
        rows.append(row)
        above = row
    return rows


def shrink(rows):
    """The mean of SHRINK × SHRINK pixels each."""
    small = []
    for y in range(0, len(rows) - SHRINK + 1, SHRINK):
        sums = [sum(column) for column in zip(*rows[y:y + SHRINK])]
        row = bytearray()
        for x in range(0, len(sums) - 3 * SHRINK + 1, 3 * SHRINK):
            row += bytes(sum(sums[x + c:x + 3 * SHRINK:3]) // SHRINK**2 for c in range(3))
        small.append(row)
    return small


def beside(pictures):
    """Pictures in a row, with white below those that are not so high."""
    height = max(map(len, pictures))
    return [b''.join(p[y] if y < len(p) else b'\xff' * len(p[0]) for p in pictures) for y in range(height)]


def write_png(path, rows):
    def chunk(kind, body):
        return struct.pack('>I', len(body)) + kind + body + struct.pack('>I', zlib.crc32(kind + body))

    head = struct.pack('>IIBBBBB', len(rows[0]) // 3, len(rows), 8, 2, 0, 0, 0)
    differences = bytearray()
    above = bytearray(len(rows[0]))
    for row in rows:  # filter 2: what changes from the row above
        differences += b'\2' + bytes((a - b) & 255 for a, b in zip(row, above))
        above = row
    path.write_bytes(b'\x89PNG\r\n\x1a\n' + chunk(b'IHDR', head) +
                     chunk(b'IDAT', zlib.compress(bytes(differences), 9)) + chunk(b'IEND', b''))


def draw(morphbus, robots, name):
    pictures = []
    with tempfile.TemporaryDirectory() as folder:
        for model, robot in robots:
            path = pathlib.Path(folder) / f'{robot}.png'
            subprocess.run([morphbus, 'draw', SOURCE / f'models/{model}.m3l', '--robot', robot, '--view', 'iso',
                            '-o', path], check=True)
            pictures.append(shrink(read_png(path)))
    rows = []
    for begin in range(0, len(pictures), COLUMNS):
        rows += beside(pictures[begin:begin + COLUMNS])
    write_png(SOURCE / 'docs/pictures' / name, rows)


def main():
    morphbus = sys.argv[1] if len(sys.argv) > 1 else SOURCE / 'build/release/bin/morphbus'
    draw(morphbus, ROBOTS, 'robots.png')
    draw(morphbus, OTHERS, 'modules.png')


if __name__ == '__main__':
    main()
