"""A case of the campaign: one robot, one program, and all that a run of them is told. It follows from the case's number."""
import dataclasses
import importlib.machinery
import importlib.util
import pathlib
import re
import shutil

from cases.chance import Chance
from cases.modules import TYPES
from cases.programs import PARAMETERS, random_program
from cases.robots import Robot, random_robot

ROOT = pathlib.Path(__file__).resolve().parents[2]
MODELS = ROOT / 'models'
TICK = 0.02  # s

WORLD_BOX = '''<model name="box_{number}"><static>true</static><pose>{x:.3f} {y:.3f} 0.1 0 0 0</pose><link name="link">
<collision name="box"><geometry><box><size>{size:.3f} {size:.3f} 0.2</size></box></geometry></collision></link></model>
'''


@dataclasses.dataclass
class Case:
    number: int
    robot: Robot
    program: str  # its file, relative to the folder of the case
    files: dict  # name: text, what is written to that folder
    parts: list  # of which the program consists; the name of one that ships
    options: list  # of every run
    seconds: float
    commands: int = 0  # given by a script

    @property
    def ticks(self):
        return round(self.seconds / TICK)

    def run(self):
        """The arguments of `morphbus` that all ways have in common, in the folder of the case."""
        return ['run', 'robot.m3l', self.program, '--robot', self.robot.name, '--seconds', f'{self.seconds:.2f}', *self.options]

    def write(self, folder):
        # With the models beside it, a case can be looked at, and altered, without the project.
        shutil.copytree(MODELS, folder / 'models', ignore=shutil.ignore_patterns('terrain*', '*.faults'))
        for name, text in self.files.items():
            (folder / name).write_text(text, encoding='utf-8')


def shipped_pairs():
    """(program, model, robots, seconds) of all that ships and can be compiled together, from tools/gait_table."""
    loader = importlib.machinery.SourceFileLoader('gait_table', str(ROOT / 'tools' / 'gait_table'))
    table = importlib.util.module_from_spec(importlib.util.spec_from_loader('gait_table', loader))
    loader.exec_module(table)
    return [row for row in table.PROGRAMS if table.COMPILED_FOR.get(row[0], row[1]) == row[1]]


def shipped_robot(model, name):
    text = (MODELS / f'{model}.m3l').read_text(encoding='utf-8')
    modules = re.search(rf'^robot {name}:\s*modules=\((.*?)\)', text, re.M | re.S)[1]
    return Robot(f'{model}.m3l', name, {each.split()[1]: each.split()[0] for each in modules.split(',')})


def robot_and_program(chance, dockings):
    """(robot, program or None for one that ships, its parts)"""
    sort = chance.weighted({'random': 72, 'shipped': 14, 'shipped program': 7, 'shipped robot': 7})
    if sort in ('random', 'shipped program'):
        robot, family = random_robot(chance, dockings)
        if sort == 'shipped program':
            return robot, None, [chance.one(family.programs)]
        return robot, *random_program(chance, robot)
    program, model, robots, _ = chance.one(shipped_pairs())
    robot = shipped_robot(model, chance.one(robots))
    if sort == 'shipped':
        return robot, None, [program]
    return robot, *random_program(chance, robot)


def world(chance, reach):
    """Some boxes out of the robot's reach, for sensors to see."""
    boxes = []
    for number in range(chance.whole(1, 4)):
        # On a square round the robot, and rather far: one that it starts in is refused.
        along, away = chance.between(-1.5, 1.5), (reach + 0.25) * chance.one((-1, 1))
        x, y = (along, away) if chance.happens(0.5) else (away, along)
        boxes.append(WORLD_BOX.format(number=number, x=x, y=y, size=chance.between(0.1, 0.35)))
    return f'<sdf version="1.9"><world name="boxes">\n{"".join(boxes)}</world></sdf>\n'


def attributes(chance, robot):
    """--set of numbers of the module types, by which simulated modules are less ideal."""
    found = []
    for kind in sorted(set(robot.modules.values())):
        if not TYPES[kind].joints:
            found += ['--set', f'{kind}.{chance.one(TYPES[kind].links)}.mass_spread={chance.whole(1, 10)}%']
            continue
        joint, sort = chance.one(sorted(TYPES[kind].joints.items()))
        found += ['--set', chance.one((
            f'{kind}.{joint}.delay={chance.whole(1, 60)}ms', f'{kind}.{joint}.torque={chance.between(0.5, 3):.2f}',
            f'{kind}.{chance.one(TYPES[kind].links)}.mass_spread={chance.whole(1, 10)}%',
            f'{kind}.{joint}.backlash={chance.between(0.1, 2):.2f}{"" if sort == "prismatic" else "deg"}'))]
        if 'backlash' in found[-1] and sort == 'prismatic':
            # Of a prismatic joint it is a length, in units of the module.
            found[-1] = f'{kind}.{joint}.backlash=0.02'
    return found


def run_options(chance, robot, ticks):
    """Options that change what is run, and so the hash of every way."""
    options = ['--random-seed', str(chance.whole(1, 1000000))]
    modules = list(robot.modules)
    still = chance.happens(0.08)
    if still:
        options.append('--still')
    elif chance.happens(0.1):
        options.append('--root-sensor')
        if chance.happens(0.5):
            options += ['--root-noise', f'{chance.between(0, 0.01):.4f},{chance.between(0, 0.02):.4f}']
    if chance.happens(0.3):
        options += ['--noise-seed', str(chance.whole(1, 1000000))]
    if chance.happens(0.2):
        options += ['--root', chance.one(modules)]
    if chance.happens(0.2) and not still:
        options += ['--friction', f'{chance.between(0, 1.2):.2f}']
    if chance.happens(0.15):
        options += attributes(chance, robot)
    if len(modules) > 1 and chance.happens(0.08):
        options += ['--lose', f'{chance.one(modules)}@{TICK * chance.whole(1, ticks):.2f}']
    return options, still


def command(chance, robot, own_program):
    """Commands of a script that belong together, in the words of `morphbus control`: each with how many ticks after the first."""
    module = chance.one(list(robot.modules))
    kinds = {'push': 5, 'restart --cold': 4, 'inspect': 2, 'lose': 1, 'restart': 1}
    if robot.dockings:
        kinds['part'] = 4
    if own_program:
        kinds.update({'set': 3, 'invoke': 3, 'deploy': 3})
    kind = chance.weighted(kinds)
    if kind == 'push':
        direction = chance.one(('NORTH', 'SOUTH', 'UP', 'EAST', 'WEST', '1,1,0', '0,1,-1'))
        return [(0, f'push {module} {direction} {chance.whole(1, 8)} {chance.between(0.02, 0.4):.2f}')]
    if kind == 'restart --cold':
        return [(0, f'restart {module} --cold')]
    if kind == 'part':
        # Soon after they may still meet, and dock again; later the run warns of it.
        a, b = chance.one(robot.dockings)
        return [(0, f'disconnect {chance.one((a, b))}'), (chance.whole(0, 12), f'connect {a} {b}')]
    if kind == 'set':
        return [(0, f'set {setting(chance, " ")}')]
    if kind == 'invoke':
        return [(0, chance.one((f'invoke Any.poke {chance.whole(1, 9)} 0.5 --to {module}',
                                f'invoke Any.step {chance.whole(-30, 30)}')))]
    if kind == 'deploy':
        return [(0, f'deploy second.dyn --to {module}')]
    return [(0, f'{kind} {module}')]


def setting(chance, between):
    """A parameter of the programs that are put together, with another value."""
    name, first, least, most = chance.one(PARAMETERS)
    value = chance.whole(least, most) if isinstance(first, int) else f'{chance.between(least, most):.2f}'
    return f'{name}{between}{value}'


def script(chance, robot, own_program, ticks):
    """One to five commands, or pairs of them, at any ticks."""
    found = []
    for _ in range(chance.whole(1, 5)):
        begin = chance.whole(1, max(1, ticks - 1))
        found += [(begin + later, text) for later, text in command(chance, robot, own_program)]
    return [f'{tick} {text}\n' for tick, text in sorted(found, key=lambda each: each[0])]


def make(number, dockings):
    """The case of a number."""
    chance = Chance('case', number)
    robot, program, parts = robot_and_program(chance, dockings)
    seconds = chance.weighted({0.4: 4, 0.6: 5, 1.0: 4, 2.0: 1, 4.0: 0.2})
    # Large robots are simulated more slowly.
    seconds = min(seconds, 1.0) if len(robot.modules) > 8 else seconds
    ticks = round(seconds / TICK)
    options, still = run_options(chance, robot, ticks)
    files = {'robot.m3l': f'import "models/{robot.model}"\n\n{robot.text}'}
    name = f'models/programs/{parts[0]}.dyn'
    if program is not None:
        name = 'program.dyn'
        files[name] = program
        if chance.happens(0.3):
            options += ['--set', setting(chance, '=')]
    if not still and robot.text and chance.happens(0.12):
        files['world.sdf'] = world(chance, robot.reach)
        options += ['--world', 'world.sdf']
    lines = script(chance, robot, program is not None, ticks) if chance.happens(0.35) else []
    if lines:
        files['script'] = ''.join(lines)
        options += ['--commands', 'script']
    if any(' deploy ' in line for line in lines):
        files['second.dyn'] = random_program(Chance('second', number), robot)[0]
    return Case(number, robot, name, files, parts, options, seconds, len(lines))
