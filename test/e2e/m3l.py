#!/usr/bin/env python3
"""What the commands on models say where the answer is unusual: nothing computed, errors, odd bytes, odd options."""
import json
import math
import unittest

from support import SOURCE, Case, as_json, command, morphbus

MTRAN = SOURCE / 'models' / 'mtran.m3l'


def ring(modules):
    """A ring of M-TRAN modules, each bent a little, that closes at its start values."""
    names = [f'm{i}' for i in range(modules)]
    docked = ', '.join(f'({a}.c2, {b}.c5, rot=180)' for a, b in zip(names, names[1:] + names[:1]))
    bend = math.pi / modules
    joints = ', '.join(f'{m}.joint_1={bend!r}, {m}.joint_2={-bend!r}' for m in names)
    return (f'import "{MTRAN}"\nrobot ring: modules=({", ".join("MTRAN " + m for m in names)}),\n'
            f'connections=({docked}), joints=({joints})\n')


class NotComputed(Case):
    def test_the_mobility_of_a_large_ring_is_not_claimed(self):
        path = self.folder / 'ring.m3l'
        path.write_text(ring(260))
        text = morphbus('check', path).stdout
        self.assertIn('mobility not computed (over 500 joints in one system of loops)', text)
        self.assertNotRegex(text, r'robot ring.*mobility \d')
        self.assertIn('mobility not computed', morphbus('graph', path, '--robot', 'ring').stdout)
        answer = as_json('graph', path, '--robot', 'ring')
        self.assertIsNone(answer['mobility'])
        self.assertEqual({joint['locked'] for joint in answer['joints']}, {None})

    def test_a_ring_that_is_small_enough_is_computed(self):
        path = self.folder / 'ring.m3l'
        path.write_text(ring(20))
        # 40 parallel joints: a planar loop leaves all but three.
        self.assertEqual(as_json('graph', path, '--robot', 'ring')['mobility'], 37)

    def test_lists_of_adjacent_axes_that_are_too_long_are_not_listed(self):
        # 1500 joints on one body: over two million pairs.
        sides = ''.join(f'link l{i}: mass=1\naxis a{i}: origin=(0,0,0), direction=(0,0,1)\n'
                        f'axis b{i}: origin=(0,0,0), direction=(0,0,-1)\n'
                        f'joint j{i}: type=continuous, pair=((l{i},a{i}),(hub,b{i}))\n' for i in range(99))
        path = self.folder / 'hub.m3l'
        path.write_text(
            'module STAR:\npoint c: coords=(0,0,0), connector, side=1, normal=(0,0,1)\n'
            'point d: coords=(0,0,0), connector, side=2, normal=(0,0,1)\n'
            'axis x: origin=(0,0,0), direction=(1,0,0)\n'
            f'link hub: grouping=(c,d), mass=1\n{sides}'
            'connection C: members=(STAR a, STAR b), conditions=(a.point p coincident b.point q and p parallel q\n'
            'and a.x parallel b.x and p.side==1 and q.side==2)\n'
            f'robot star: modules=({", ".join(f"STAR m{i}" for i in range(16))}),\n'
            f'connections=({", ".join(f"(m{i}.c,m{i + 1}.d)" for i in range(15))})\n')
        answer = as_json('graph', path, '--robot', 'star')
        self.assertEqual(len(answer['joints']), 16 * 99)
        self.assertEqual({joint['adjacent'] for joint in answer['joints']}, {16 * 99 - 1})
        self.assertEqual({joint['adjacent_axes'] for joint in answer['joints']}, {None})
        self.assertIn('not listed (over 2000000 pairs)', morphbus('graph', path, '--robot', 'star').stdout)


if __name__ == '__main__':
    unittest.main()
