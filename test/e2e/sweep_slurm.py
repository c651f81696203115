#!/usr/bin/env python3
"""`morphbus sweep --engine slurm`: a real cluster has the same rows, whatever becomes of its nodes, of its jobs and of whoever
waits for them."""
import json
import os
import pathlib
import shutil
import signal
import tempfile
import unittest

import slurm_cluster
from slurm_cluster import Cluster, wait_for
from support import BIN, LIMIT, as_json, await_condition, end_of, morphbus
from sweep_case import ARM, ENDLESS, SMALL, SweepCase, children_of, workers_of


def rows_in(path):
    """Lines of a file; of one that has another name by now none, for it is counted by that when asked again."""
    try:
        return path.read_bytes().count(b'\n')
    except FileNotFoundError:
        return 0


class SlurmCase(SweepCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        folder = tempfile.TemporaryDirectory(prefix='morphbus-slurm-', ignore_cleanup_errors=True)
        cls.addClassCleanup(folder.cleanup)
        cls.cluster = Cluster(folder.name)
        cls.addClassCleanup(cls.cluster.stop)

    def setUp(self):
        super().setUp()
        self.addCleanup(self.cluster.clear)
        self.binary = self.folder / 'there' / 'morphbus'
        self.binary.parent.mkdir()
        shutil.copy(BIN / 'morphbus', self.binary)
        self.jobs = self.folder / 's.sweep.db.jobs'

    def engine(self, more='chunk = 0.001\n', binary=None):
        """The table; by default each row is a task of its own."""
        return f'[engine]\nkind = "slurm"\nbinary = "{binary or self.binary}"\n{more}'

    def sbatch(self, script):
        """An environment in which `sbatch` is this script, of which `real` is Slurm's own. Each call leaves a line."""
        folder = self.folder / 'bin'
        folder.mkdir()
        program = folder / 'sbatch'
        program.write_text(f'#!/bin/sh\ncalls={self.folder}/calls\necho >> $calls\nreal() {{ {shutil.which("sbatch")} "$@"; }}\n{script}')
        program.chmod(0o755)
        return {**os.environ, 'PATH': f'{folder}:{os.environ["PATH"]}'}

    def calls(self):
        path = self.folder / 'calls'
        return path.read_text().count('\n') if path.exists() else 0

    def queue(self):
        """The ids of the jobs that wait or run."""
        return wait_for('squeue', '-h', '-o', '%F').split()

    def tasks_of(self, job):
        return {task: row for task, row in self.cluster.tasks().items() if task.startswith(f'{job}_')}

    def job(self):
        """The id of the one job of the sweep, once it has been submitted."""
        def submitted():
            for state in self.jobs.glob('job-*/job.json'):
                return json.loads(state.read_text())['id']
            return None
        return await_condition(submitted, 'the job is submitted')

    def await_task(self, condition, what):
        return await_condition(lambda: next((pid for pid in self.workers() if condition(pid)), None), what)

    def workers(self):
        """The processes that Slurm has started, on all nodes."""
        return workers_of(self.binary)

    def await_row_on(self, node):
        def running():
            there = self.cluster.processes_of(node)
            return [pid for pid in self.workers() if pid in there and children_of(pid)]
        await_condition(running, f'a row runs on {node}')

    def await_results(self, count):
        """So many rows have been run, whether or not anybody has taken their results."""
        def enough():
            return sum(rows_in(path) for path in self.jobs.glob('job-*/results-*')) >= count
        await_condition(enough, f'{count} rows have been run')


class Rows(SlurmCase):
    def test_the_rows_are_those_of_one_process(self):
        text = SMALL + 'keep = {best = 1, by = "path_length"}\n'
        expected = self.expected(text)
        file = self.sweep_file(text + self.engine('partition = "low"\ncpus = 2\ntime = "0:10:00"\nchunk = 0.2\n'))
        log, = as_json('sweep', file)['logs']
        self.assertEqual(self.rows(self.database()), expected)
        best = max(expected, key=lambda row: float(row['path_length']))
        self.assertEqual(as_json('info', log)['hash'], best['hash'])
        self.assertLessEqual(self.hosts(), {'n1', 'n2'})
        self.assertFalse(list(self.folder.glob('*.jobs*')), 'what the tasks needed is still there')
        # A share runs again where the file says, or elsewhere.
        self.assertEqual(as_json('sweep', 'verify', file, '--sample', 1)['agree'], 8)
        self.assertEqual(as_json('sweep', 'verify', file, '--sample', 1, '--engine', 'local')['agree'], 8)
        self.assertFalse(list(self.folder.glob('*.jobs*')), 'what the tasks needed is still there')

    def hosts(self):
        return {row['host'] for row in json.loads(morphbus('sweep', 'export', self.database(), '--to', 'json').stdout)}

    def test_a_node_that_is_killed_in_the_middle(self):
        text = SMALL
        expected = self.expected(text)
        # What runs on n2 does nothing, so that it is there when the node is killed.
        held, real = self.folder / 'held', self.folder / 'there' / 'real'
        self.binary.rename(real)
        self.binary.write_text(f'#!/bin/sh\nif [ "$SLURMD_NODENAME" = n2 ] && [ ! -e {held}.no_more ]; then\n  touch {held}\n  exec sleep {ENDLESS}\nfi\n'
                               f'exec {real} "$@"\n')
        self.binary.chmod(0o755)
        file = self.sweep_file(text + self.engine())
        process = self.start(file)
        await_condition(held.exists, 'a row has begun on n2')
        pathlib.Path(f'{held}.no_more').touch()
        self.cluster.kill_node('n2')
        self.addCleanup(self.cluster.await_idle, 'n1', 'n2')
        self.addCleanup(self.cluster.start_node, 'n2')
        output, errors = process.communicate(timeout=LIMIT)
        self.assertEqual(process.returncode, 0, output + errors)
        self.assertEqual(self.rows(self.database()), expected)


class Searches(SlurmCase):
    SEARCH = ''.join(line + '\n' for line in SMALL.splitlines() if '[' not in line) + \
        'maximise = "path_length"\npopulation = 5\ngenerations = 2\n[search.MOLECUBE.swivel]\nspeed = {from = 1, to = 6}\n'

    def best(self, engine, name):
        return as_json('optimise', self.sweep_file(self.SEARCH + engine, name))['best']

    def interrupted(self, file, env, calls):
        """A search that was left with this job of its."""
        process = self.start(file, search=True, env=env)
        await_condition(lambda: self.calls() == calls, 'the job is submitted')
        job = self.job()
        process.send_signal(signal.SIGINT)
        output, errors = process.communicate(timeout=LIMIT)
        self.assertEqual(process.returncode, 1, output + errors)
        self.assertIn(f'Slurm goes on with job {job}', errors)
        return job

    def test_a_search_finds_the_same(self):
        self.assertEqual(self.best('', 'here'), self.best(self.engine(), 'there'))

    def test_a_generation_that_runs_is_gone_on_with(self):
        file = self.sweep_file(self.SEARCH + self.engine())
        # The jobs are what there is without a search, and two generations, of which the second one waits for this test.
        env = self.sbatch('[ $(wc -l < $calls) -lt 3 ] || hold=--hold\nreal $hold "$@"\n')
        job = self.interrupted(file, env, 3)
        wait_for('scontrol', 'release', job)
        await_condition(lambda: job not in self.queue(), 'the job is done', pause=0.2)
        self.assertEqual(as_json('optimise', file, env=env)['best'], self.best('', 'here'))
        self.assertEqual(self.calls(), 3)
        self.assertFalse(self.jobs.exists())

    def test_a_job_for_which_no_generation_waits_is_ended(self):
        file = self.sweep_file(self.SEARCH + self.engine())
        job = self.interrupted(file, self.sbatch('real --hold "$@"\n'), 1)
        morphbus('optimise', file, '--engine', 'local')
        self.assertIn(job, self.queue())
        morphbus('optimise', file)
        self.assertNotIn(job, self.queue())
        self.assertFalse(self.jobs.exists())


class Jobs(SlurmCase):
    """One job, and what may become of it."""
    # Its second row ends only when a test lets it.
    HELD = ARM + f'seconds = [0.1, {ENDLESS}, 0.2]\n'

    def test_who_leaves_comes_back(self):
        expected = self.expected(SMALL)
        file = self.sweep_file(SMALL + self.engine())
        before = set(self.cluster.tasks())
        done = morphbus('sweep', file, '--detach')
        job = self.job()
        self.assertIn(f'Slurm goes on with job {job}: the same command takes the results in, scancel {job} ends it', done.stderr)
        self.await_results(8)
        # Nothing is submitted again.
        morphbus('sweep', file, '--engine', 'slurm')
        self.assertEqual(self.rows(self.database()), expected)
        self.assertLessEqual({task.split('_')[0] for task in set(self.cluster.tasks()) - before}, {job})
        self.assertFalse(self.jobs.exists())

    def test_it_is_killed_and_goes_on(self):
        expected = self.expected(SMALL)
        file = self.sweep_file(SMALL + self.engine())
        # Killed before, while and after it submits, and while it waits.
        for moment in (lambda: self.database().exists(), lambda: list(self.jobs.glob('job-*/chunk-1')), lambda: list(self.jobs.glob('job-*/job.json')),
                       lambda: list(self.jobs.glob('job-*/task-*.out'))):
            process = self.start(file)
            await_condition(lambda: moment() or process.poll() is not None, 'the moment')
            end_of(process)
        morphbus('sweep', file)
        self.assertEqual(self.rows(self.database()), expected)

    def test_ctrl_c_leaves_the_job_alone(self):
        file = self.sweep_file(self.HELD + self.engine('chunk = 1e12\n'))
        process = self.start(file)
        self.await_done(self.database(), 1)
        process.send_signal(signal.SIGINT)
        output, errors = process.communicate(timeout=LIMIT)
        self.assertEqual(process.returncode, 1, output + errors)
        job = self.job()
        self.assertIn(f'Slurm goes on with job {job}', errors)
        self.assertIn('the same command goes on', errors)
        self.assertEqual([row['status'] for row in self.rows(self.database())], ['done', 'missing', 'missing'])
        # Another file of the sweep wants other rows: what runs is not waited for.
        self.sweep_file(ARM + 'seconds = [0.1, 0.2]\n' + self.engine('chunk = 1e12\n'))
        morphbus('sweep', file)
        self.assertEqual([row['status'] for row in self.rows(self.database())], ['done', 'done'])
        # Nor does it go on for nobody.
        await_condition(lambda: not self.workers(), 'the job is ended')

    def test_a_signal_while_sbatch_runs_leaves_no_job_behind(self):
        file = self.sweep_file(ARM + 'seconds = [0.1, 0.2]\n' + self.engine())
        morphbus('sweep', file, '--engine', 'local')
        # Slurm has the job, and its id is lost.
        env = self.sbatch('real --hold "$@" > /dev/null\nkill -INT $PPID\nexit 1\n')
        morphbus('sweep', 'verify', file, '--sample', 1, status=1, env=env)
        self.assertEqual(self.calls(), 1)
        await_condition(lambda: not self.queue(), 'the job is cancelled', pause=0.2)
        self.assertFalse(list(self.folder.glob('*.jobs*')))

    def test_a_job_that_is_put_back_goes_on_where_it_was(self):
        text = ARM + f'seconds = [0.1, {ENDLESS}, 0.2]\n'
        file = self.sweep_file(text + self.engine('chunk = 1e12\n'))
        process = self.start(file, '--timeout', '100000')
        self.await_done(self.database(), 1)
        first = self.await_task(children_of, 'the second row runs')
        job = self.job()
        wait_for('scontrol', 'requeue', f'{job}_1')
        second = await_condition(lambda: next((pid for pid in self.workers() if pid != first and children_of(pid)), None), 'it runs again')
        self.assertEqual(self.tasks_of(job)[f'{job}_1'][2], 1)
        # The row that had no result is run again, and no other.
        row, = children_of(second)
        os.kill(row, signal.SIGKILL)
        output, errors = process.communicate(timeout=LIMIT)
        self.assertEqual(process.returncode, 3, output + errors)
        self.assertEqual([row['status'] for row in self.rows(self.database())], ['done', 'crashed', 'done'])

    def test_preemption(self):
        text = ARM + f'seconds = [0.1, {ENDLESS}]\n'
        file = self.sweep_file(text + self.engine('chunk = 1e12\npartition = "first"\ncpus = 2\n'))
        process = self.start(file, '--timeout', '100000')
        self.await_done(self.database(), 1)
        first = self.await_task(children_of, 'the second row runs')
        # Somebody more important needs the node.
        other = wait_for('sbatch', '--parsable', '--partition=high', '--nodelist=n1', '--cpus-per-task=2', '--chdir=/tmp', '--output=/dev/null',
                         '--wrap=true').strip()
        second = await_condition(lambda: next((pid for pid in self.workers() if pid != first and children_of(pid)), None), 'it runs again')
        self.assertTrue(other)
        row, = children_of(second)
        os.kill(row, signal.SIGKILL)
        output, errors = process.communicate(timeout=LIMIT)
        self.assertEqual(process.returncode, 3, output + errors)
        self.assertEqual([row['status'] for row in self.rows(self.database())], ['done', 'crashed'])

    def test_who_cancels_the_job_ends_the_sweep(self):
        file = self.sweep_file(self.HELD + self.engine('chunk = 1e12\n'))
        process = self.start(file)
        self.await_done(self.database(), 1)
        job = self.job()
        wait_for('scancel', job)
        output, errors = process.communicate(timeout=LIMIT)
        self.assertEqual(process.returncode, 3, output + errors)
        self.assertIn(f"Slurm's job {job} was cancelled; what was written before is whole", errors)
        self.sweep_file(ARM + 'seconds = [0.1, 0.2]\n' + self.engine())
        morphbus('sweep', file)
        self.assertEqual([row['status'] for row in self.rows(self.database())], ['done', 'done'])

    def test_a_task_that_comes_to_nothing_three_times_is_its_rows_failure(self):
        program = self.binary.parent / 'broken'
        program.write_text('#!/bin/sh\necho no licence >&2\nexit 9\n')
        program.chmod(0o755)
        file = self.sweep_file(ARM + 'seconds = [0.1, 0.2]\n' + self.engine('chunk = 1e12\n', binary=program))
        morphbus('sweep', file, status=3)
        rows = as_json('sweep', 'missing', file, status=1)['missing']
        for row in rows:
            self.assertRegex(row['error'], r'Slurm ended its task 3 times before it was run: FAILED with status 9 on n[12]: no licence')
        # Another program does them.
        self.sweep_file(ARM + 'seconds = [0.1, 0.2]\n' + self.engine())
        morphbus('sweep', file, '--retry')
        self.assertEqual({row['status'] for row in self.rows(self.database())}, {'done'})

    def test_what_is_known_of_a_job_may_be_damaged(self):
        expected = self.expected(SMALL)
        file = self.sweep_file(SMALL + self.engine())
        morphbus('sweep', file, '--detach')
        state = self.jobs / 'job-1' / 'job.json'
        state.write_text(state.read_text()[:20])
        done = morphbus('sweep', file)
        self.assertIn(f'warning: {state} is damaged: rows of that job are run again', done.stderr)
        self.assertEqual(self.rows(self.database()), expected)


class Refused(SlurmCase):
    def test_a_node_without_the_program(self):
        expected = self.expected(SMALL)
        self.cluster.hide('n2', self.binary.parent)
        file = self.sweep_file(SMALL + self.engine())
        try:
            done = morphbus('sweep', file)
        finally:
            self.cluster.unhide('n2', self.binary.parent)
        self.assertEqual(self.rows(self.database()), expected)
        # Unless the other node was so quick that this one was never asked.
        if done.stderr:
            self.assertRegex(done.stderr, rf'warning: n2 cannot run rows: FAILED with status 127 on n2: there is no program {self.binary} on n2')

    def test_no_node_with_the_program(self):
        expected = self.expected(SMALL)
        file = self.sweep_file(SMALL + self.engine(binary=self.binary.parent / 'none'))
        done = morphbus('sweep', file, status=2)
        self.assertRegex(done.stderr, rf'there is no program {self.binary.parent}/none on n[12]')
        self.assertEqual({row['status'] for row in self.rows(self.database())}, {'missing'})
        self.sweep_file(SMALL + self.engine())
        morphbus('sweep', file)
        self.assertEqual(self.rows(self.database()), expected)

    def test_another_build_on_the_nodes(self):
        program = self.binary.parent / 'other'
        # The chunk is of another version, as far as this program can see.
        program.write_text('#!/bin/sh\nsed \'s/"version":"[^"]*"/"version":"9.9.9"/\' "$3" > "$3.other"\nchunk=$3.other\nshift 3\n'
                           f'exec {self.binary} sweep worker "$chunk" "$@"\n')
        program.chmod(0o755)
        done = morphbus('sweep', self.sweep_file(SMALL + self.engine(binary=program)), status=2)
        self.assertIn('the chunk is of another build: it is morphbus 9.9.9, this is ', done.stderr)

    def test_what_slurm_refuses(self):
        done = morphbus('sweep', self.sweep_file(SMALL + self.engine('partition = "none"\n')), status=2)
        self.assertRegex(done.stderr, 'Slurm does not take the job: .*[Ii]nvalid partition')
        done = morphbus('sweep', self.sweep_file(SMALL + self.engine('options = ["--mem=nothing"]\n')), status=2)
        self.assertIn('Slurm does not take the job: ', done.stderr)
        self.assertFalse(list(self.jobs.glob('job-*')))
        empty = {**os.environ, 'PATH': str(self.folder)}
        done = morphbus('sweep', self.sweep_file(SMALL + self.engine()), status=2, env=empty)
        self.assertIn("no Slurm: there is no program 'sbatch' on this machine", done.stderr)
        self.assertIn('only Slurm goes on by itself', morphbus('sweep', self.sweep_file(SMALL), '--detach', status=2).stderr)


class TimeLimit(SlurmCase):
    """Slurm counts in minutes, and so do these."""

    def test_a_task_that_runs_out_of_time_is_gone_on_with(self):
        text = ARM + f'seconds = [0.1, {ENDLESS}, 0.2]\n'
        file = self.sweep_file(text + self.engine('chunk = 1e12\ntime = "0:01"\n'))
        process = self.start(file, '--timeout', '100000')
        self.await_done(self.database(), 1)
        first = self.await_task(children_of, 'the second row runs')
        job = self.job()
        await_condition(lambda: self.tasks_of(job).get(f'{job}_1', ('',))[0] == 'TIMEOUT', 'the time is over', pause=1)
        second = await_condition(lambda: next((pid for pid in self.workers() if pid != first and children_of(pid)), None), 'another task goes on')
        row, = children_of(second)
        os.kill(row, signal.SIGKILL)
        output, errors = process.communicate(timeout=LIMIT)
        self.assertEqual(process.returncode, 3, output + errors)
        self.assertEqual([row['status'] for row in self.rows(self.database())], ['done', 'crashed', 'done'])


if __name__ == '__main__':
    slurm_cluster.enter()
    unittest.main()
