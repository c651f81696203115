"""What a campaign came to, in figures."""
import collections

from cases.one_case import DIFFERENT, OUT_OF_TIME, SAME, TOO_LATE, UNFINISHED
from cases.ways import REFERENCE

KINDS = (  # name in a record, and in the table
    ('kills', 'processes killed (SIGKILL)'), ('freezes', 'processes frozen (SIGSTOP, SIGCONT)'),
    ('discarded', 'messages lost on purpose'), ('doubled', 'messages doubled'),
    ('delayed', 'messages overtaken or late'), ('corrupted', 'messages damaged'))
WAYS = (
    (REFERENCE, 'in one process: the reference'), ('lossy', 'in one process, on a bad bus'), ('processes', 'in processes'),
    ('rough', 'in processes, on a bad bus'), ('killed', 'in processes that are killed'), ('frozen', 'in processes that are frozen'),
    ('everything', 'in processes that are killed and frozen, on a bad bus'), ('logged', 'with a log, and again from the log'))


class Counts:
    """Sums over records; of a case that is there twice, as in two files, the first counts."""

    def __init__(self, records):
        self.records = list({(record['generator'], record['case']): record for record in reversed(records)}.values())[::-1]
        self.runs = [(record, run) for record in self.records for run in record['runs']]

    def of(self, result):
        return [(record, run) for record, run in self.runs if run['result'] == result]

    @property
    def finished(self):
        return len(self.runs) - len(self.of(UNFINISHED))

    def told(self, result, options=''):
        """For people: what is known of each run with that result, and the command by which it is run again."""
        for record, run in self.of(result):
            again = f'tools/campaign --case {record["case"]} --way {run["way"]}{options}'
            yield f'{run["result"]}: case {record["case"]}, {run["way"]}: {"; ".join(run["why"])[:600]}\n  {again}'

    def given_up(self):
        """The same of runs that gave somebody up, and then did well: the machine was too busy, or they hang at times."""
        for record, run in self.runs:
            for error in sorted({error for why, error in run.get('repeated', ()) if why == OUT_OF_TIME}):
                yield (f'gave up at first: case {record["case"]}, {run["way"]}: {error}\n'
                       f'  tools/campaign --case {record["case"]} --way {run["way"]} --repeat 50')

    def sentence(self):
        different, unfinished = len(self.of(DIFFERENT)), len(self.of(UNFINISHED))
        text = f'{self.finished:,} runs of {len(self.records):,} cases, {different or "no"} difference{"" if different < 2 else "s"}'
        return text + (f', {unfinished:,} not finished' if unfinished else '')

    def rows(self):
        """(what, how many, how many of them differed)"""
        hashes = {record['hash'] for record in self.records if record['hash']}
        several = sum(record['status'] == 3 for record in self.records)
        yield 'runs', self.finished, len(self.of(DIFFERENT))
        for way, text in WAYS:
            found = [run for _, run in self.runs if run['way'] == way and run['result'] != UNFINISHED]
            yield f'… {text}', len(found), sum(run['result'] == DIFFERENT for run in found)
        yield 'not finished in the time that they had', len(self.of(UNFINISHED)), None
        repeated = collections.Counter(why for _, run in self.runs for why, _ in run.get('repeated', ()))
        yield 'run again, since somebody was given up for want of an answer', repeated[OUT_OF_TIME], None
        yield 'run again, since a kill found a process that was leaving', repeated[TOO_LATE], None
        yield 'cases (robots with a program)', len(self.records), None
        yield 'different hashes demanded', len(hashes), None
        yield '… of runs that the physics ended (status 3)', several, None
        for kind, text in KINDS:
            yield text, sum(run.get(kind, 0) for _, run in self.runs if run['result'] == SAME), None
        yield 'commands in scripts', sum(record['commands'] for record in self.records), None
        yield 'sim time of all runs, s', round(sum(record['seconds'] * len(record['runs']) for record in self.records)), None
        yield from self._robots()

    def _robots(self):
        yield 'robots that ship', sum(not record['assembled'] for record in self.records), None
        yield 'robots docked at random', sum(record['assembled'] for record in self.records), None
        yield '… with loops', sum(record['loops'] > 0 for record in self.records), None
        for kind in sorted({kind for record in self.records for kind in record['types']}):
            yield (f'… with modules of {kind}', sum(kind in record['types'] for record in self.records), None)
        sizes = ((1, 1, '1 module'), (2, 4, '2 to 4 modules'), (5, 8, '5 to 8 modules'), (9, 99, '9 and more modules'))
        for least, most, text in sizes:
            yield f'… of {text}', sum(least <= sum(record['types'].values()) <= most for record in self.records), None
        yield 'programs that ship', sum(record['shipped'] for record in self.records), None
        yield 'programs put together at random', sum(not record['shipped'] for record in self.records), None
        parts = collections.Counter(part for record in self.records if not record['shipped'] for part in record['program'])
        for part, count in sorted(parts.items()):
            yield f'… with `{part}`', count, None

    def table(self):
        """As the document has it."""
        lines = ['| what | how many | of which differ |\n', '|---|---|---|\n']
        lines += [f'| {what} | {count:,} | {"" if differ is None else differ} |\n' for what, count, differ in self.rows()]
        return ''.join(lines)

    def text(self):
        return ''.join(f'{count:>12,}  {what}{f" ({differ} differ)" if differ else ""}\n' for what, count, differ in self.rows())

