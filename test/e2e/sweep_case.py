"""What the tests of sweeps and of searches share."""
import csv
import json
import pathlib
import re
import sqlite3
import subprocess

from support import SOURCE, Case, await_condition, command, morphbus

MODEL = SOURCE / 'models' / 'molecube.m3l'
PROGRAMS = SOURCE / 'models' / 'programs'
ARM = f'model = "{MODEL}"\nprogram = "{PROGRAMS}/arm.dyn"\nrobot = "arm"\n'
SMALL = ARM + 'seconds = 0.2\nfriction = [0.4, 0.8]\nloss = [0, 0.2]\nseeds = [1, 2]\n'
# A run of this length ends on no machine while a test waits.
ENDLESS = 1000000


def children_of(pid):
    """None of a process that has ended."""
    try:
        return [int(child) for task in pathlib.Path(f'/proc/{pid}/task').iterdir() for child in (task / 'children').read_text().split()]
    except OSError:
        return []


def workers_of(binary):
    """The processes that run rows for somebody elsewhere, by the program at this path."""
    found = []
    for folder in pathlib.Path('/proc').glob('[0-9]*'):
        try:
            words = (folder / 'cmdline').read_bytes().decode(errors='replace').split('\0')
        except OSError:
            continue
        if words[:3] == [str(binary), 'sweep', 'worker'] and '--fd' not in words:
            found.append(int(folder.name))
    return found


def cpu_ticks(pid):
    """Of the processor's time that a process has had, in hundredths of a second."""
    return int(pathlib.Path(f'/proc/{pid}/stat').read_text().rsplit(')', 1)[1].split()[11])


class SweepCase(Case):
    def sweep_file(self, text, name='s'):
        path = self.folder / f'{name}.toml'
        path.write_text(text)
        return path

    def database(self, name='s'):
        return self.folder / f'{name}.sweep.db'

    def rows(self, database):
        """What a sweep came to, without what differs from machine to machine."""
        text = morphbus('sweep', 'export', database, '--to', 'csv').stdout
        table = list(csv.DictReader(text.splitlines()))
        for row in table:
            del row['wall_seconds'], row['host']
        return table

    def expected(self, text):
        """What the rows have to be, by processes of this machine."""
        morphbus('sweep', self.sweep_file(text, 'expected'), '--engine', 'local')
        return self.rows(self.database('expected'))

    def rows_of(self, page):
        """The rows that the page's scripts read."""
        data, = re.findall(r"<script type='application/json' id='rows'>(.*?)</script>", page.read_text(), re.S)
        return json.loads(data)

    def start(self, *arguments, search=False, **options):
        """A sweep, or a search, that goes on beside the test, and ends with it."""
        process = subprocess.Popen(command('optimise' if search else 'sweep', *arguments), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)
        self.kill_at_the_end(process)
        return process

    def await_done(self, database, count):
        def enough():
            done = morphbus('sweep', 'status', database, '--json', status=None)
            return done.returncode == 0 and json.loads(done.stdout)['done'] >= count
        await_condition(enough, f'{count} rows are done')

    def alter(self, statements, name='s'):
        """Changes a database behind the back of all commands."""
        with sqlite3.connect(self.database(name)) as database:
            database.executescript(statements)
        database.close()
