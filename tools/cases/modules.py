"""What the campaign knows of the module types that ship: their files, shapes, and names."""
import dataclasses

DEGREES = 57.29577951308232


@dataclasses.dataclass(frozen=True)
class ModuleType:
    """A module type of models/."""
    joints: dict  # name: 'revolute', 'continuous' or 'prismatic'
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
    'TELESCOPE': ModuleType({'slide': 'prismatic'}, ('rod', 'tube'), ('head', 'tail'), (-0.0325, 0.0325), 0.0325),
}


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
    Family('snakes.m3l', ('MTRAN',), ('MTRAN_to_MTRAN',), ('snake',), 1),
    Family('snakes.m3l', ('CKBOT',), ('CKBOT_to_CKBOT',), ('snake',), 1),
    Family('snakes.m3l', ('MOLECUBE',), ('MOLECUBE_to_MOLECUBE',), ('snake',), 1),
)
