"""The ways in which each case is run, which all must have the hash of the first: the reference, in one process and undisturbed."""
import dataclasses

from cases.chance import Chance
from cases.disturbances import MOST_KILLS, Disturbance

REFERENCE = 'reference'


@dataclasses.dataclass
class Way:
    name: str
    options: list  # beside those of the case
    disturbances: list = dataclasses.field(default_factory=list)
    faults: str = ''  # the rules of --faults
    processes: int = 0  # of modules; 0: all in one process
    reproduced: tuple = ()  # options of `reproduce`, by which the log is run again; none: no log
    logged: bool = False


def rules(chance, case):
    """Faults of the bus, as --faults reads them."""
    modules = list(case.robot.modules)

    def kinds(most):
        found = []
        for kind, top in (('loss', most), ('duplicate', 0.3), ('reorder', 0.3), ('corrupt', 0.1)):
            if chance.happens(0.6):
                found.append(f'{kind}={chance.between(0.01, top):.3f}')
        found = found or [f'loss={chance.between(0.01, most):.3f}']
        if any(each.startswith('reorder') for each in found):
            found.append(f'delay={chance.whole(1, 20)}')
        if chance.happens(0.1):
            found.append(f'late={chance.between(0.01, 0.1):.3f} by={chance.whole(1, 6)}ms')
        return ' '.join(found)

    lines = [f'seed {chance.whole(1, 1000000)}', f'fault {kinds(0.25)}']
    for _ in range(chance.whole(0, 2)):
        module = chance.one(modules)
        where = chance.one((f'process={module}', 'process=SIM', 'process=LOG', f'channel={module}/TRANSFORM', 'channel=SIM/SENSORS',
                            f'process=SIM channel={module}/ACTUATOR', 'channel=*/STATUS', 'channel=HELLO'))
        begin = chance.whole(0, case.ticks)
        lines.append(f'fault {where} from={begin} until={begin + chance.whole(1, 20)} {kinds(0.5)}')
    return '\n'.join(lines) + '\n'


def bad_bus(chance, case):
    """(options, rules): --loss, or rules of a file, or both."""
    sort = chance.weighted({'loss': 2, 'faults': 5, 'both': 1})
    options, text = ['--seed', str(chance.whole(1, 1000000))], ''
    if sort != 'faults':
        options += ['--loss', f'{chance.between(0.01, 0.3):.3f}']
    if sort != 'loss':
        options += ['--faults', 'faults']
        text = rules(chance, case)
    return options, text


def placement(chance, case):
    """(options, number of processes): a process a module, or fewer that share them."""
    modules = len(case.robot.modules)
    processes = modules if modules == 1 or chance.happens(0.5) else chance.whole(1, modules)
    return ['--isolate'] + ([] if processes == modules else ['--processes', str(processes)]), processes


def kills(chance, case, processes):
    """SIGKILL for processes of modules at random ticks, the time before they have joined included."""
    left = {process: MOST_KILLS for process in range(processes)}
    found = []
    for _ in range(chance.whole(1, min(6, MOST_KILLS * processes))):
        process = chance.one([process for process, kills in left.items() if kills])
        left[process] -= 1
        # In the last ticks a kill might find a process that is about to leave, which ends the run.
        saves = 0 if chance.happens(0.05) else chance.whole(1, max(1, case.ticks - 5))
        found.append(Disturbance(saves, process, chance.between(0, 0.002), 'modules'))
    return found


def freezes(chance, case, processes):
    """SIGSTOP for a while, shorter than the time after which a run gives somebody up."""
    found = []
    for _ in range(chance.whole(1, 3)):
        victim = chance.weighted({'modules': 6, 'sim': 2, 'log': 2, 'launcher': 1})
        seconds = chance.weighted({0.01: 4, 0.05: 4, 0.2: 3, 0.6: 1}) * chance.between(0.5, 1.5)
        found.append(Disturbance(chance.whole(0, max(1, case.ticks - 2)), chance.whole(0, processes - 1), chance.between(0, 0.002),
                                 victim, seconds))
    return found


def pace(chance):
    """Mostly none, so that processes are at work whenever something befalls them."""
    return ['--speed', f'{chance.between(2, 10):.1f}'] if chance.happens(0.15) else []


def make(case):
    """By name, the reference first."""
    found = {REFERENCE: Way(REFERENCE, ['--inproc'])}

    def chance_of(name):
        return Chance('way', case.number, name)

    chance = chance_of('lossy')
    options, text = bad_bus(chance, case)
    found['lossy'] = Way('lossy', ['--inproc', *options], faults=text)

    chance = chance_of('processes')
    options, processes = placement(chance, case)
    found['processes'] = Way('processes', [*options, *pace(chance)], processes=processes)

    chance = chance_of('rough')
    options, processes = placement(chance, case)
    bus, text = bad_bus(chance, case)
    found['rough'] = Way('rough', [*options, *bus], faults=text, processes=processes)

    chance = chance_of('killed')
    options, processes = placement(chance, case)
    found['killed'] = Way('killed', [*options, *pace(chance)], kills(chance, case, processes), processes=processes)

    chance = chance_of('frozen')
    options, processes = placement(chance, case)
    found['frozen'] = Way('frozen', [*options, *pace(chance)], freezes(chance, case, processes), processes=processes)

    chance = chance_of('everything')
    options, processes = placement(chance, case)
    bus, text = bad_bus(chance, case)
    both = kills(chance, case, processes) + freezes(chance, case, processes)
    found['everything'] = Way('everything', [*options, *bus], both, text, processes)

    # A log, too, must lead to the same run again.
    chance = chance_of('logged')
    options, processes = (['--inproc'], 0) if chance.happens(0.5) else placement(chance, case)
    found['logged'] = Way('logged', options, processes=processes, logged=True,
                          reproduced=('--processes',) if chance.happens(0.4) else ())
    return found
