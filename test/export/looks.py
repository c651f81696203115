#!/usr/bin/env python3
"""How links look, in exported files: meshes of all formats as they are, colours, and nothing of it where modules are only
programmed. What other people's parsers make of SDF and MJCF is tried in test/compiler/emit."""
import base64
import json
import re
import struct
import unittest
import xml.etree.ElementTree as ElementTree

from files import read_stl
from support import Case, export, main, need, run
from webots_world import COIN, every_node
from wbt import Reader, as_vrml

# A pyramid of which one side is dented: its fifth corner lies inside the others.
POINTS = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (.125, .125, .125))
TRIANGLES = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 4), (2, 3, 4), (3, 1, 4))
UNIT = 0.5  # m
ORANGE, GREY = '#ff8000', '#404850'
LINK = 'link {name}: hull=box(size=(1,1,1), at=({x},0,0)), visual=mesh("{file}", colour="{colour}") + sphere(radius=.25)\n'


def obj():
    return ''.join(f'v {x} {y} {z}\n' for x, y, z in POINTS) + \
        ''.join(f'f {a + 1} {b + 1} {c + 1}\n' for a, b, c in TRIANGLES)


def stl():
    return b' ' * 80 + struct.pack('<I', len(TRIANGLES)) + b''.join(
        struct.pack('<12fH', 0, 0, 0, *(x for corner in triangle for x in POINTS[corner]), 0) for triangle in TRIANGLES)


def gltf():
    places, corners = struct.pack('<15f', *(x for p in POINTS for x in p)), struct.pack('<18H', *(i for t in TRIANGLES for i in t))
    data = base64.b64encode(places + corners).decode()
    return json.dumps({
        'asset': {'version': '2.0'}, 'scene': 0, 'scenes': [{'nodes': [0]}], 'nodes': [{'mesh': 0}],
        'meshes': [{'primitives': [{'attributes': {'POSITION': 0}, 'indices': 1}]}],
        'accessors': [{'bufferView': 0, 'componentType': 5126, 'count': 5, 'type': 'VEC3', 'min': [0, 0, 0], 'max': [1, 1, 1]},
                      {'bufferView': 1, 'componentType': 5123, 'count': 18, 'type': 'SCALAR'}],
        'bufferViews': [{'buffer': 0, 'byteLength': len(places)},
                        {'buffer': 0, 'byteOffset': len(places), 'byteLength': len(corners)}],
        'buffers': [{'byteLength': len(places + corners), 'uri': 'data:application/octet-stream;base64,' + data}]})


def turned(triangle):
    """The triangle from its least corner on: which way round it goes stays."""
    at = triangle.index(min(triangle))
    return tuple(triangle[at:]) + tuple(triangle[:at])


WANTED = sorted(turned([tuple(UNIT * x for x in POINTS[corner]) for corner in triangle]) for triangle in TRIANGLES)


class Looks(Case):
    def setUp(self):
        super().setUp()
        (self.folder / 'part.obj').write_text(obj())
        (self.folder / 'part.stl').write_bytes(stl())
        (self.folder / 'part.gltf').write_text(gltf())
        self.model = self.folder / 'looks.m3l'
        files = ('part.obj', 'part.stl', 'part.gltf')
        links = ''.join(LINK.format(name=f'l{i}', x=2 * i, file=file, colour=ORANGE if i else GREY) for i, file in enumerate(files))
        joints = ''.join(f'joint j{i}: type=revolute, value=[-1,1], pair=((l{i},z),(l{i - 1},y))\n' for i in (1, 2))
        robot = 'robot two: modules=(A m)\n'
        self.text = f'module A: unit={UNIT}\n{links}axis z: origin=(0,0,0), direction=(0,0,1)\n' \
                    f'axis y: origin=(0,0,0), direction=(0,0,-1)\n{joints}{robot}'
        self.model.write_text(self.text)

    def export(self, to):
        path = self.folder / to / f'robot.{to}'
        path.parent.mkdir()
        export(to, path, '--robot', 'two', model=self.model)
        return path

    def is_dented(self, mesh):
        self.assertEqual(sorted(map(turned, read_stl(mesh))), WANTED, mesh)

    def test_urdf_has_meshes_as_they_are_and_their_colours(self):
        need('check_urdf')
        path = self.export('urdf')
        checked = run(['check_urdf', path])
        self.assertNotIn('Error:', checked.stderr + checked.stdout)
        robot = ElementTree.parse(path).getroot()
        for i, rgba in enumerate(((0x40, 0x48, 0x50), (0xff, 0x80, 0), (0xff, 0x80, 0))):
            link = robot.find(f'link[@name="m.l{i}"]')
            meshes = [mesh.get('filename') for mesh in link.iterfind('visual/geometry/mesh')]
            self.assertEqual(meshes, [f'robot_meshes/A.l{i}.look{n}.stl' for n in (1, 2)])
            self.is_dented(path.parent / meshes[0])
            colour, other = link.findall('visual')[0].find('material/color'), link.findall('visual')[1].find('material')
            for value, byte in zip(colour.get('rgba').split(), (*rgba, 255)):
                self.assertAlmostEqual(float(value), byte / 255, delta=0.5 / 255)
            self.assertIsNone(other)
            self.assertEqual([mesh.get('filename') for mesh in link.iterfind('collision/geometry/mesh')],
                             [f'robot_meshes/A.l{i}.stl'])

    def test_sdf_and_mjcf_have_the_same_meshes(self):
        sdf = self.export('sdf')
        for i in range(3):
            self.is_dented(sdf.parent / f'robot_meshes/A.l{i}.look1.stl')
        mjcf = ElementTree.parse(self.export('mjcf')).getroot()
        for i in range(3):
            mesh = mjcf.find(f'asset/mesh[@name="A.l{i}.look1"]')
            numbers = list(map(float, mesh.get('vertex').split()))
            places = list(zip(*[iter(numbers)] * 3))
            faces = list(zip(*[iter(map(int, mesh.get('face').split()))] * 3))
            self.assertEqual(sorted(turned([places[corner] for corner in face]) for face in faces), WANTED)
            geom = mjcf.find(f'.//geom[@mesh="A.l{i}.look1"]')
            self.assertEqual((geom.get('contype'), geom.get('conaffinity')), ('0', '0'))

    def test_webots_shows_them_and_has_hulls_to_bound(self):
        text = self.export('webots').read_text()
        found = 0
        for shape in (node for node in every_node(Reader(text).world()) if node.type == 'IndexedFaceSet'):
            places = [tuple(p) for p in shape['coord']['point']]
            corners = [int(corner) for corner in shape['coordIndex']]
            if corners.count(-1) == len(TRIANGLES) and len(places) == len(POINTS):
                triangles = [[places[i] for i in corners[at:at + 3]] for at in range(0, len(corners), 4)]
                self.assertEqual(sorted(map(turned, triangles)), WANTED)
                found += 1
        self.assertEqual(found, 3)
        if COIN.exists():
            vrml = self.folder / 'world.wrl'
            vrml.write_text(as_vrml(text))
            run([COIN, vrml])

    def test_keywords_and_code_know_nothing_of_them(self):
        bare = self.folder / 'bare.m3l'
        bare.write_text(re.sub(r', visual=.*', '', self.text))
        for to, name in (('xml', 'a.xml'), ('kinematics', 'a.kin'), ('c', 'a.c')):
            said = []
            for number, model in enumerate((self.model, bare)):
                folder = self.folder / f'{to}{number}'
                folder.mkdir()
                export(to, folder / name, '--module', 'A', model=model)
                said.append({path.name: path.read_bytes() for path in folder.iterdir()})
            self.assertEqual(*said)


if __name__ == '__main__':
    main()
