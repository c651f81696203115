"""A cluster of its own for a test: Slurm's real daemons, two nodes on one machine.

Each daemon lives in a namespace of host names, so that the two nodes are called n1 and n2, and of mounts, so that they need not
have the same files; all are in the network and among the processes of the test alone, in which `enter` begins it anew, and end
with it. Slurm's daemons run as root, and so does the test."""
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import time

from support import LIMIT, await_condition

ADDRESS = '10.77.0.1'
PROGRAMS = ('munged', 'slurmctld', 'slurmd', 'sbatch', 'squeue', 'scontrol', 'sinfo', 'scancel')
# ctest lists a test that ends so as skipped.
SKIPPED = 77


def may_have_mounts():
    """Whether a process may have mounts of its own here: root of some containers may not."""
    return subprocess.run(['unshare', '--mount', '--pid', '--fork', '--mount-proc', 'true'], capture_output=True, check=False).returncode == 0


def enter():
    """Begins the test anew among processes of its own, all of which end with it. Called first; the network is private already."""
    if os.environ.get('MORPHBUS_CLUSTER') is not None:
        return
    if os.geteuid() != 0:
        print('SKIPPED: Slurm\'s daemons need root; in a container, or by sudo, this test runs')
        sys.exit(SKIPPED)
    if not may_have_mounts():
        print('SKIPPED: the two nodes need mounts of their own, which this container does not give')
        sys.exit(SKIPPED)
    os.environ['PATH'] += ':/usr/sbin:/sbin'
    missing = [name for name in PROGRAMS if not shutil.which(name)]
    if missing:
        sys.exit(f'there is no {", ".join(missing)}: tools/setup --test installs them')
    words = ['unshare', '--mount', '--pid', '--fork', '--kill-child', '--mount-proc', 'sh', '-c', '"$@"; exit $?', 'sh',
             sys.executable, *sys.argv]
    os.execvpe(words[0], words, {**os.environ, 'MORPHBUS_CLUSTER': '1'})


def wait_for(program, *words):
    """Runs one of Slurm's commands until it succeeds: a controller that has much to do answers late."""
    def done():
        run = subprocess.run([program, *map(str, words)], capture_output=True, text=True, timeout=LIMIT, check=False)
        return run.stdout + ' ' if run.returncode == 0 else None
    return await_condition(done, f'{program} {words} succeeds', pause=0.2)[:-1]


class Cluster:
    """Started when it is made; `stop` ends it."""
    NODES = {'n1': 7001, 'n2': 7002}

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self.daemons = {}
        # Slurm's clients look for an address that is not the loopback's own.
        subprocess.run(['ip', 'address', 'replace', f'{ADDRESS}/32', 'dev', 'lo'], check=True)
        for name in ('munge', 'state', 'log'):
            (self.folder / name).mkdir(mode=0o700, parents=True)
        self.start_munge()
        (self.folder / 'slurm.conf').write_text(self.config())
        os.environ['SLURM_CONF'] = str(self.folder / 'slurm.conf')
        self.start('n0', 'slurmctld', '-D')
        for node in self.NODES:
            self.start_node(node)
        self.await_idle(*self.NODES)

    def start_munge(self):
        folder = self.folder / 'munge'
        (folder / 'key').write_bytes(os.urandom(1024))
        (folder / 'key').chmod(0o600)
        words = ['munged', '--foreground', '--force', f'--key-file={folder}/key', f'--socket={folder}/socket', f'--pid-file={folder}/pid',
                 f'--log-file={folder}/log', f'--seed-file={folder}/seed']
        self.daemons['munged'] = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        await_condition((folder / 'socket').exists, 'munged runs')

    def config(self):
        nodes = '\n'.join(f'NodeName={node} NodeAddr={ADDRESS} Port={port} CPUs=2 State=UNKNOWN' for node, port in self.NODES.items())
        # A job that was put back waits as long as a credential lives; a node is lost after SlurmdTimeout.
        return f"""
ClusterName=morphbus
SlurmctldHost=n0({ADDRESS})
AuthType=auth/munge
AuthInfo=socket={self.folder}/munge/socket,cred_expire=5
CredType=cred/munge
MpiDefault=none
ProctrackType=proctrack/pgid
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SlurmUser=root
SlurmdUser=root
StateSaveLocation={self.folder}/state
SlurmdSpoolDir={self.folder}/spool-%n
SlurmctldPidFile={self.folder}/slurmctld.pid
SlurmdPidFile={self.folder}/slurmd-%n.pid
SlurmctldLogFile={self.folder}/log/slurmctld
SlurmdLogFile={self.folder}/log/slurmd-%n
SlurmdTimeout=15
KillWait=5
ReturnToService=2
SchedulerType=sched/builtin
PriorityType=priority/basic
SchedulerParameters=batch_sched_delay=0,sched_interval=2
PreemptType=preempt/partition_prio
PreemptMode=REQUEUE
{nodes}
PartitionName=low Nodes=n1,n2 Default=YES State=UP PriorityTier=1
PartitionName=high Nodes=n1,n2 State=UP PriorityTier=10
PartitionName=first Nodes=n1 State=UP PriorityTier=1
"""

    def start(self, host, *words):
        script = 'hostname "$1" && shift && exec "$@"'
        with (self.folder / 'log' / f'{host}.out').open('ab') as out:
            self.daemons[host] = subprocess.Popen(['unshare', '--uts', '--mount', 'sh', '-c', script, 'sh', host, *words],
                                                  stdout=out, stderr=out)

    def start_node(self, node):
        self.start(node, 'slurmd', '-D')

    def processes_of(self, node):
        """All that runs on a node: slurmd, Slurm's steps, what they have started."""
        def host_of(pid):
            try:
                return os.readlink(f'/proc/{pid}/ns/uts')
            except OSError:
                return None
        host = host_of(self.daemons[node].pid)
        return [int(folder.name) for folder in pathlib.Path('/proc').glob('[0-9]*') if host and host_of(folder.name) == host]

    def kill_node(self, node):
        """The node is gone from one moment to the next."""
        for pid in self.processes_of(node):
            try:
                os.kill(pid, signal.SIGKILL)
            except ProcessLookupError:
                pass
        self.daemons[node].wait(LIMIT)

    def hide(self, node, path):
        """On this node there is nothing in a folder."""
        subprocess.run(['nsenter', '--target', str(self.daemons[node].pid), '--mount', 'mount', '-t', 'tmpfs', 'none', str(path)], check=True)

    def unhide(self, node, path):
        subprocess.run(['nsenter', '--target', str(self.daemons[node].pid), '--mount', 'umount', '-l', str(path)], check=True)

    def states(self):
        lines = wait_for('sinfo', '-N', '-h', '-p', 'low', '-o', '%N %T').splitlines()
        return dict(line.split() for line in lines)

    def await_idle(self, *nodes):
        def idle():
            states = self.states()
            return all(states.get(node) == 'idle' for node in nodes)
        try:
            await_condition(idle, f'{nodes} are idle', pause=0.2)
        except AssertionError as error:
            raise AssertionError(f'{error}\n{self.logs()}') from None

    def tasks(self):
        """What Slurm knows: {"17_1": (state, node, restarts)}."""
        lines = wait_for('squeue', '-h', '-r', '-t', 'all', '-O', 'ArrayJobID:16,ArrayTaskID:16,State:24,BatchHost:24,RestartCnt:8').splitlines()
        rows = [line.split() for line in lines]
        return {f'{job}_{task}': (state, node, int(restarts)) for job, task, state, node, restarts in rows if task != 'N/A'}

    def clear(self):
        """Ends all jobs."""
        wait_for('scancel', '--user=root')

        def none():
            return not wait_for('squeue', '-h').split()
        await_condition(none, 'no job is left', pause=0.2)

    def logs(self):
        return '\n'.join(f'{path.name}:\n{path.read_text(errors="replace")[-3000:]}' for path in sorted((self.folder / 'log').iterdir()))

    def stop(self):
        for daemon in self.daemons.values():
            daemon.kill()
            daemon.wait(LIMIT)
        # What they have started is gone before its folders are.
        limit = time.monotonic() + 10
        while time.monotonic() < limit and len(list(pathlib.Path('/proc').glob('[0-9]*'))) > 3:
            time.sleep(0.05)
