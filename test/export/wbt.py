"""Webots worlds: a table of the nodes that we write, a reader, and the world as plain VRML for other parsers."""
import re

# Node: {field: (VRML type, default)}. Webots R2023b's reference manual; of each node the fields that we
# may use. Nodes derived from Solid have Solid's fields too.
SOLID = {
    'translation': ('SFVec3f', '0 0 0'), 'rotation': ('SFRotation', '0 0 1 0'), 'children': ('MFNode', '[]'),
    'name': ('SFString', '"solid"'), 'model': ('SFString', '""'), 'contactMaterial': ('SFString', '"default"'),
    'boundingObject': ('SFNode', 'NULL'), 'physics': ('SFNode', 'NULL'), 'locked': ('SFBool', 'FALSE'),
}
MOTOR = {
    'acceleration': ('SFFloat', '-1'), 'controlPID': ('SFVec3f', '10 0 0'), 'maxVelocity': ('SFFloat', '10'),
    'minPosition': ('SFFloat', '0'), 'maxPosition': ('SFFloat', '0'), 'multiplier': ('SFFloat', '1'),
}
JOINT = {'jointParameters': ('SFNode', 'NULL'), 'device': ('MFNode', '[]'), 'endPoint': ('SFNode', 'NULL')}
PARAMETERS = {
    'position': ('SFFloat', '0'), 'minStop': ('SFFloat', '0'), 'maxStop': ('SFFloat', '0'),
    'springConstant': ('SFFloat', '0'), 'dampingConstant': ('SFFloat', '0'), 'staticFriction': ('SFFloat', '0'),
}
NODES = {
    'WorldInfo': {
        'title': ('SFString', '""'), 'info': ('MFString', '[]'), 'gravity': ('SFFloat', '9.81'),
        'basicTimeStep': ('SFFloat', '32'), 'coordinateSystem': ('SFString', '"ENU"'),
        'contactProperties': ('MFNode', '[]'),
    },
    'ContactProperties': {'material1': ('SFString', '"default"'), 'material2': ('SFString', '"default"'),
                          'coulombFriction': ('MFFloat', '[1]')},
    'Viewpoint': {'orientation': ('SFRotation', '0 0 1 0'), 'position': ('SFVec3f', '-10 0 0')},
    'Background': {'skyColor': ('MFColor', '[0 0 0]')},
    'DirectionalLight': {'direction': ('SFVec3f', '0 0 -1'), 'intensity': ('SFFloat', '1')},
    'Solid': SOLID,
    'Robot': {**SOLID, 'controller': ('SFString', '"<generic>"'), 'controllerArgs': ('MFString', '[]'),
              'customData': ('SFString', '""'),
              'supervisor': ('SFBool', 'FALSE'), 'selfCollision': ('SFBool', 'FALSE')},
    'Connector': {**SOLID, 'type': ('SFString', '"symmetric"'), 'isLocked': ('SFBool', 'FALSE'),
                  'autoLock': ('SFBool', 'FALSE'), 'distanceTolerance': ('SFFloat', '0.01'),
                  'axisTolerance': ('SFFloat', '0.2'), 'rotationTolerance': ('SFFloat', '0.2'),
                  'numberOfRotations': ('SFInt32', '4'), 'snap': ('SFBool', 'TRUE')},
    'Emitter': {**SOLID, 'type': ('SFString', '"radio"'), 'range': ('SFFloat', '-1'), 'channel': ('SFInt32', '0')},
    'Receiver': {**SOLID, 'type': ('SFString', '"radio"'), 'channel': ('SFInt32', '0')},
    'HingeJoint': JOINT,
    'SliderJoint': JOINT,
    'HingeJointParameters': {**PARAMETERS, 'axis': ('SFVec3f', '1 0 0'), 'anchor': ('SFVec3f', '0 0 0')},
    'JointParameters': {**PARAMETERS, 'axis': ('SFVec3f', '0 0 1')},
    'RotationalMotor': {**MOTOR, 'name': ('SFString', '"rotational motor"'), 'maxTorque': ('SFFloat', '10')},
    'LinearMotor': {**MOTOR, 'name': ('SFString', '"linear motor"'), 'maxForce': ('SFFloat', '10')},
    'PositionSensor': {'name': ('SFString', '"position sensor"'), 'noise': ('SFFloat', '0'),
                       'resolution': ('SFFloat', '-1')},
    'DistanceSensor': {**SOLID, 'lookupTable': ('MFVec3f', '[0 0 0, 0.1 1000 0]'), 'type': ('SFString', '"generic"'),
                       'numberOfRays': ('SFInt32', '1'), 'aperture': ('SFFloat', '1.5708')},
    'Accelerometer': {**SOLID, 'lookupTable': ('MFVec3f', '[]'), 'resolution': ('SFFloat', '-1')},
    'TouchSensor': {**SOLID, 'type': ('SFString', '"bumper"'), 'lookupTable': ('MFVec3f', '[0 0 0, 5000 50000 0]'),
                    'resolution': ('SFFloat', '-1')},
    'SolidReference': {'solidName': ('SFString', '""')},
    'Physics': {'density': ('SFFloat', '1000'), 'mass': ('SFFloat', '-1'), 'centerOfMass': ('MFVec3f', '[]'),
                'inertiaMatrix': ('MFVec3f', '[]')},
    'PBRAppearance': {'baseColor': ('SFColor', '1 1 1'), 'roughness': ('SFFloat', '0'), 'metalness': ('SFFloat', '1')},
}
# VRML 97's own, which the other parsers know.
VRML = {
    'Shape': {'appearance': ('SFNode', 'NULL'), 'geometry': ('SFNode', 'NULL')},
    'Group': {'children': ('MFNode', '[]')},
    'Box': {'size': ('SFVec3f', '2 2 2')},
    'Sphere': {'radius': ('SFFloat', '1')},
    'IndexedFaceSet': {'coord': ('SFNode', 'NULL'), 'coordIndex': ('MFInt32', '[]')},
    'Coordinate': {'point': ('MFVec3f', '[]')},
}
SOLIDS = ('Solid', 'Robot')
JOINTS = ('HingeJoint', 'SliderJoint')
GEOMETRIES = ('Box', 'Sphere', 'IndexedFaceSet')
# What a slot for nodes takes, in Webots.
SLOTS = {
    'jointParameters': ('HingeJointParameters', 'JointParameters'), 'physics': ('Physics',),
    'device': ('RotationalMotor', 'LinearMotor', 'PositionSensor'), 'endPoint': ('Solid', 'SolidReference'),
    'appearance': ('PBRAppearance',), 'geometry': GEOMETRIES, 'coord': ('Coordinate',),
    'contactProperties': ('ContactProperties',), 'boundingObject': (*GEOMETRIES, 'Shape', 'Group'),
    'children': ('Solid', 'Connector', 'Emitter', 'Receiver', 'DistanceSensor', 'Accelerometer',
                 'TouchSensor', 'HingeJoint', 'SliderJoint', 'Shape'),
}
LENGTHS = {'SFVec3f': 3, 'SFColor': 3, 'SFRotation': 4, 'SFFloat': 1, 'SFInt32': 1}


class Node(dict):
    """Fields by name; `type` is the node's."""

    def __init__(self, kind):
        super().__init__()
        self.type = kind

    def field(self, name):
        """The value, or the default as text."""
        return self.get(name, {**NODES, **VRML}[self.type][name][1])


class Reader:
    """Reads a world by the table above; anything the table does not have is an error."""

    def __init__(self, text):
        first, _, rest = text.partition('\n')
        if not re.fullmatch(r'#VRML_SIM R2023b utf8', first):
            raise ValueError(f'header {first!r}')
        self.tokens = re.findall(r'"(?:[^"\\]|\\.)*"|[\[\]{}]|[^\s,\[\]{}"]+', re.sub(r'(?m)#.*$', '', rest))
        self.at = 0
        self.defined = {}

    def take(self, expected=None):
        if self.at == len(self.tokens):
            raise ValueError('the file ends too early')
        token = self.tokens[self.at]
        self.at += 1
        if expected is not None and token != expected:
            raise ValueError(f'{token} instead of {expected}')
        return token

    def world(self):
        nodes = []
        while self.at < len(self.tokens):
            nodes.append(self.node(None))
        return nodes

    def node(self, slot):
        word = self.take()
        if word == 'NULL':
            return None
        if word == 'USE':
            node = self.defined[self.take()]
        else:
            name = self.take() if word == 'DEF' else None
            kind = self.take() if name else word
            fields = {**NODES, **VRML}.get(kind)
            if fields is None:
                raise ValueError(f'unknown node {kind}')
            node = Node(kind)
            self.take('{')
            while self.tokens[self.at] != '}':
                field = self.take()
                if field not in fields or field in node:
                    raise ValueError(f'{kind} has no field {field}, or has it twice')
                node[field] = self.value(fields[field][0], field)
            self.take('}')
            if name:
                self.defined[name] = node
        if slot in SLOTS and node.type not in SLOTS[slot]:
            raise ValueError(f'{slot} takes no {node.type}')
        return node

    def value(self, kind, field):
        if kind == 'SFNode':
            return self.node(field)
        if kind == 'MFNode':
            return self.many(lambda: self.node(field))
        if kind == 'SFString':
            return self.string()
        if kind == 'MFString':
            return self.many(self.string)
        if kind == 'SFBool':
            return {'TRUE': True, 'FALSE': False}[self.take()]
        if kind.startswith('MF'):
            numbers = self.many(self.number)
            part = LENGTHS.get('S' + kind[1:], 1)
            if len(numbers) % part:
                raise ValueError(f'{field}: {len(numbers)} numbers are no whole count of {part}')
            return numbers if part == 1 else [numbers[i:i + part] for i in range(0, len(numbers), part)]
        numbers = [self.number() for _ in range(LENGTHS[kind])]
        return numbers[0] if len(numbers) == 1 else numbers

    def many(self, item):
        self.take('[')
        items = []
        while self.tokens[self.at] != ']':
            items.append(item())
        self.take(']')
        return items

    def string(self):
        token = self.take()
        if token[0] != '"':
            raise ValueError(f'{token} is no string')
        return token[1:-1]

    def number(self):
        return float(self.take())


def as_vrml(text):
    """The world for parsers of plain VRML 97: each Webots node as a PROTO with the fields of the table. Nodes
    that VRML has too, with other fields, get other names."""
    clashes = ('WorldInfo', 'Viewpoint', 'Background', 'DirectionalLight')
    prelude = ['#VRML V2.0 utf8']
    for name, fields in NODES.items():
        # exposedField would demand an IS; a node that stands for an appearance must be one.
        body = 'Appearance {}' if name == 'PBRAppearance' else 'Group {}'
        declared = ' '.join(f'field {kind} {field} {default}' for field, (kind, default) in fields.items())
        prelude.append(f'PROTO {"W" + name if name in clashes else name} [ {declared} ] {{ {body} }}')
    rest = text.partition('\n')[2]
    for name in clashes:
        rest = re.sub(rf'\b{name}(?= \{{)', f'W{name}', rest)
    return '\n'.join(prelude) + '\n' + rest
