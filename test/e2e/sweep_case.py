"""What the tests of sweeps and of searches share."""
import csv
import json
import re
import sqlite3
import subprocess

from support import Case, await_condition, command, morphbus


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

    def rows_of(self, page):
        """The rows that the page's scripts read."""
        data, = re.findall(r"<script type='application/json' id='rows'>(.*?)</script>", page.read_text(), re.S)
        return json.loads(data)

    def start(self, *arguments, search=False, **options):
        """A sweep, or a search, that goes on beside the test, and ends with it."""
        process = subprocess.Popen(command('optimise' if search else 'sweep', *arguments), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)
        self.addCleanup(process.communicate)
        self.addCleanup(process.kill)
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
