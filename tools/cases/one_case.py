"""Runs one case in all its ways, or in one of them, and tells of each run what came of it."""
import pathlib
import tempfile

from cases import case as cases
from cases import runs, ways

REPEATS = 3  # of a run that ended by a time limit of its own
# How a run's error reads where a kill found a process that was about to leave: nobody is started again then.
AT_THE_END = 'at the end of the run'
# What `reproduce` says of a run that ended before a program that was deployed to it had reached anybody.
NOT_WHOLE = 'whole, which was deployed at tick'

SAME, DIFFERENT, UNFINISHED = 'same', 'different', 'unfinished'
# Why a run was repeated.
TOO_LATE, OUT_OF_TIME = 'killed too late', 'out of time'


class Runner:
    """What the runs of a campaign have in common."""

    def __init__(self, morphbus, dockings, limit, stop):
        self.morphbus, self.dockings, self.limit, self.stop = morphbus, dockings, limit, stop

    def run_case(self, number, only=None, keep=None):
        """The record of a case: what it consists of, and its runs."""
        case = cases.make(number, self.dockings)
        all_ways = ways.make(case)
        chosen = [each for name, each in all_ways.items() if name in (ways.REFERENCE, only) or only is None]
        with tempfile.TemporaryDirectory(prefix='morphbus-campaign-', ignore_cleanup_errors=True) as temporary:
            folder = pathlib.Path(keep or temporary)
            case.write(folder)
            records, reference = [], None
            for way in chosen:
                if way.faults:
                    (folder / 'faults').write_text(way.faults, encoding='utf-8')
                found, outcome = self._run_way(case, way, folder, reference)
                records += found
                if way.name == ways.REFERENCE:
                    reference = outcome
                    # Without a hash to demand there is nothing to hold the others against.
                    if found[0]['result'] != SAME:
                        break
        return describe(case, reference, records)

    def _run_way(self, case, way, folder, reference):
        """(records of its runs, outcome of the first)"""
        log = ['--log', 'x.log', '--force'] if way.logged else ['--no-log']
        arguments = [*case.run(), *way.options, *log, '--json']
        repeats = []
        while True:
            outcome = runs.execute(self.morphbus, arguments, folder, self.limit, self.stop, way.disturbances)
            # A kill that came too late, and a machine that was too busy, are no fault of the run's.
            late = AT_THE_END in str(outcome.summary.get('error')) and outcome.kills > 0
            if outcome.timed_out or not (late or outcome.is_out_of_time) or len(repeats) + 1 == REPEATS:
                break
            repeats.append((TOO_LATE if late else OUT_OF_TIME, outcome.summary.get('error')))
        record = judged(way.name, outcome, reference)
        if repeats:
            record['repeated'] = repeats
        records = [record]
        if way.logged and record['result'] == SAME and outcome.status != 3:
            records += self._reproduce(way, folder, outcome)
        return records, outcome

    def _reproduce(self, way, folder, logged):
        """The record of the run that a log is made into again, in a list; empty if the log does not tell enough for that."""
        again = runs.execute(self.morphbus, ['reproduce', 'x.log', *way.reproduced, '--json'], folder, self.limit, self.stop)
        if again.status == 2 and NOT_WHOLE in again.said:
            return []
        record = {'way': way.name, 'of': 'reproduce', 'seconds': round(again.seconds, 3), 'result': SAME}
        if again.timed_out:
            record.update(result=UNFINISHED, why=[f'not over after {again.seconds:.0f} s'])
        elif again.status != 0 or again.hash != logged.hash:
            record.update(result=DIFFERENT, said=again.said[-600:],
                          why=[f'reproduce: exit status {again.status}, {str(again.summary)[:600]}'])
        return [record]


def judged(name, outcome, reference):
    """The record of a run."""
    record = {'way': name, 'seconds': round(outcome.seconds, 3), 'result': SAME, **{k: n for k, n in outcome.counts().items() if n}}
    if outcome.is_out_of_time:
        error = outcome.summary.get('error')
        return {**record, 'result': UNFINISHED, 'why': [error or f'not over after {outcome.seconds:.0f} s']}
    why = []
    if outcome.too_large:
        why = [f'it was ended, since it took more than {runs.MOST_MEMORY >> 30} GiB of memory']
    elif reference is not None:
        why = runs.differences(reference, outcome)
    # A robot that the solver loses hold of ends its run with status 3, and that in all ways.
    elif outcome.status not in (0, 1, 3) or not outcome.hash:
        why = [f'the reference has no hash: exit status {outcome.status}']
    if why:
        record.update(result=DIFFERENT, why=why, said=outcome.said[-600:])
    return record


def describe(case, reference, records):
    types = list(case.robot.modules.values())
    return {'case': case.number, 'types': {kind: types.count(kind) for kind in sorted(set(types))}, 'loops': case.robot.loops,
            'assembled': bool(case.robot.text), 'program': case.parts, 'shipped': case.program.startswith('models/'),
            'seconds': case.seconds, 'commands': case.commands, 'hash': reference.hash if reference else '',
            'status': reference.status if reference else None, 'runs': records}
