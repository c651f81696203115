"""What the campaign knows of the module types that ship: their files, shapes, and names."""
import dataclasses

DEGREES = 57.29577951308232


@dataclasses.dataclass(frozen=True)
class ModuleType:
    """A module type of models/."""
    joints: dict  # name: 'revolute', 'continuous' or 'prismatic'; none of a module that only holds others together
    links: tuple
    connectors: tuple
    # Middles (m, on the module's x axis) and radius of the balls that a module fills with all joints at 0. Neighbours touch;
    # nearer than that two modules lie in each other, and the physics would throw them apart.
    middles: tuple
    radius: float
    # Expressions of a program that read a sensor as a float.
    sensors: tuple = ()
    # Connectors whose hooks a program drives out and in.
    hooks: tuple = ()


TYPES = {
    'MTRAN': ModuleType({'joint_1': 'revolute', 'joint_2': 'revolute'}, ('active_block', 'passive_block', 'connecting_bar'),
                        ('c1', 'c2', 'c3', 'c4', 'c5', 'c6'), (-0.0325, 0.0325), 0.0325, hooks=('c1', 'c2', 'c3')),
    'ATRON': ModuleType({'centre': 'continuous'}, ('north', 'south'), ('c0', 'c1', 'c2', 'c3', 'c4', 'c5', 'c6', 'c7'), (0.0,),
                        0.055, sensors=('self.NORTH_EYE.GET_DISTANCE()', 'self.SOUTH_EYE.GET_DISTANCE()'),
                        hooks=('c0', 'c2', 'c4', 'c6')),
    'CKBOT': ModuleType({'hinge': 'revolute'}, ('bracket', 'body'), ('front', 'back', 'left', 'right'), (0.0,), 0.03),
    'MOLECUBE': ModuleType({'swivel': 'revolute'}, ('upper', 'lower'), ('c1', 'c2', 'c3', 'c4', 'c5', 'c6'), (0.0,), 0.05),
    'SMORES': ModuleType({'left_axle': 'continuous', 'right_axle': 'continuous', 'tilt': 'revolute', 'pan': 'continuous'},
                         ('body', 'left_wheel', 'right_wheel', 'yoke', 'face'), ('front', 'back', 'left', 'right'), (0.0,), 0.05,
                         sensors=('self.EYE.GET_DISTANCE()', 'self.LEVEL.GET_TILT()')),
    'SUPERBOT': ModuleType({'yaw': 'revolute', 'roll': 'revolute', 'pitch': 'revolute'},
                           ('yaw_end', 'yaw_body', 'pitch_body', 'pitch_end'),
                           ('y_front', 'y_up', 'y_down', 'p_front', 'p_east', 'p_west'), (-0.042, 0.042), 0.042),
    'ROFI': ModuleType({'alpha': 'revolute', 'beta': 'revolute', 'gamma': 'continuous'}, ('shoe_a', 'body_a', 'shoe_b', 'body_b'),
                       ('a_front', 'a_east', 'a_west', 'b_front', 'b_east', 'b_west'), (-0.05, 0.05), 0.05,
                       hooks=('a_front', 'a_east', 'a_west', 'b_front', 'b_east', 'b_west')),
    'ROOMBOT': ModuleType({'m1': 'continuous', 'm2': 'continuous', 'm3': 'continuous'},
                          ('left_outer', 'left_inner', 'right_inner', 'right_outer'),
                          tuple(f'c{i}' for i in range(10)), (-0.055, 0.055), 0.055),
    'DTTO': ModuleType({'joint_1': 'revolute', 'joint_2': 'revolute'}, ('active_block', 'passive_block', 'connecting_bar'),
                       ('c1', 'c2', 'c3', 'c4', 'c5', 'c6'), (-0.0325, 0.0325), 0.0325, hooks=('c1', 'c2', 'c3')),
    'CORE': ModuleType({}, ('body',), ('front', 'right', 'back', 'left'), (0.0,), 0.075),
    'BRICK': ModuleType({}, ('body',), ('back', 'front', 'right', 'left'), (0.0,), 0.0375),
    'ACTIVE_HINGE': ModuleType({'hinge': 'revolute'}, ('frame', 'servo'), ('base', 'tip'), (0.026, 0.058), 0.026),
    'SOLE': ModuleType({}, ('plate',), ('top',), (0.005,), 0.005, sensors=('self.LEVEL.GET_TILT()',)),
    'TELESCOPE': ModuleType({'slide': 'prismatic'}, ('rod', 'tube'), ('head', 'tail'), (-0.0325, 0.0325), 0.0325),
}


# Types that the names of their connections call otherwise.
CALLED = {'HINGE': 'ACTIVE_HINGE'}


@dataclasses.dataclass(frozen=True)
class Family:
    """Module types that can be docked to each other, and the file that has them."""
    model: str  # of models/
    types: tuple
    connections: tuple
    programs: tuple  # that ship and compile for these types
    weight: int  # how often it is drawn


FAMILIES = (
    Family('mtran.m3l', ('MTRAN',), ('MTRAN_to_MTRAN',),
           ('quadruped', 'quadruped_careful', 'quadruped_upright', 'quadruped_steered', 'caterpillar', 'crawler', 'carry'), 6),
    Family('atron.m3l', ('ATRON',), ('ATRON_to_ATRON',), ('car', 'car_evade', 'car7'), 5),
    Family('ckbot.m3l', ('CKBOT',), ('CKBOT_to_CKBOT',), ('ckbot_loop',), 5),
    Family('molecube.m3l', ('MOLECUBE',), ('MOLECUBE_to_MOLECUBE',), ('arm',), 5),
    Family('smores.m3l', ('SMORES',), ('SMORES_to_SMORES',), ('smores_train',), 4),
    Family('mixed.m3l', ('MTRAN', 'TELESCOPE'), ('MTRAN_to_MTRAN', 'MTRAN_to_TELESCOPE'), ('inchworm',), 4),
    Family('superbot.m3l', ('SUPERBOT',), ('SUPERBOT_to_SUPERBOT',), ('superbot_snake',), 3),
    Family('rofi.m3l', ('ROFI',), ('ROFI_to_ROFI',), ('rofi_snake',), 3),
    Family('roombots.m3l', ('ROOMBOT',), ('ROOMBOT_to_ROOMBOT',), ('roombots_snake',), 3),
    Family('dtto.m3l', ('DTTO',), ('DTTO_to_DTTO',), ('dtto_ring',), 3),
    Family('revolve2.m3l', ('BRICK', 'ACTIVE_HINGE'), ('BRICK_to_BRICK', 'BRICK_to_HINGE', 'HINGE_to_HINGE'), ('spider',), 3),
    Family('snakes.m3l', ('MTRAN',), ('MTRAN_to_MTRAN',), ('snake',), 1),
    Family('snakes.m3l', ('CKBOT',), ('CKBOT_to_CKBOT',), ('snake',), 1),
    Family('snakes.m3l', ('MOLECUBE',), ('MOLECUBE_to_MOLECUBE',), ('snake',), 1),
)
