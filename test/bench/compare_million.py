#!/usr/bin/env python3
"""How long `morphbus compare` takes on two logs of a million events each, and the most memory that it needs: of the two
congruent quadrupeds that walk by one program. Goals: 2 s and 200 MB.

Usage: test/bench/compare_million.py [BUILD_FOLDER] [--repeat N] [--events N]   (default build/release, 3, a million)

The logs are made by runs in one process, which takes some minutes, and kept in BUILD_FOLDER/bench for the next time.
"""
import argparse
import json
import os
import pathlib
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
MODEL = ROOT / 'models/mtran.m3l'
PROGRAM = ROOT / 'models/programs/quadruped.dyn'


def run(morphbus, robot, seconds, log):
    """Records a run as fast as it goes."""
    subprocess.run([morphbus, 'run', MODEL, PROGRAM, '--robot', robot, '--seconds', str(seconds), '--inproc', '--run', 'bench',
                    '--log', log, '--json'], check=True, stdout=subprocess.DEVNULL)


def events(morphbus, log):
    return json.loads(subprocess.check_output([morphbus, 'info', log, '--json']))['events']


def make_logs(morphbus, folder, wanted):
    """The two logs, with at least as many events as wanted; made anew only where they are missing."""
    folder.mkdir(parents=True, exist_ok=True)
    probe = folder / 'probe.log'
    run(morphbus, 'quadruped', 20, probe)
    # A longer run has somewhat fewer events a second.
    seconds = int(wanted * 20.5 / events(morphbus, probe)) + 1
    probe.unlink()
    logs = []
    for robot in ('quadruped', 'equivalent_quadruped'):
        log = folder / f'{robot}-{seconds}.log'
        if not log.exists():
            run(morphbus, robot, seconds, log)
        logs.append(log)
    return logs


def compare(morphbus, a, b):
    """Seconds, megabytes and the verdict of one comparison."""
    begin = time.monotonic()
    process = subprocess.Popen([morphbus, 'compare', a, b, '--json'], stdout=subprocess.PIPE)
    text = process.stdout.read()
    _, _, usage = os.wait4(process.pid, 0)
    return time.monotonic() - begin, usage.ru_maxrss / 1024, json.loads(text)['verdict']


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('build', nargs='?', default=ROOT / 'build/release', type=pathlib.Path)
    parser.add_argument('--repeat', type=int, default=3)
    parser.add_argument('--events', type=int, default=1_000_000)
    options = parser.parse_args()
    morphbus = options.build.resolve() / 'bin/morphbus'
    logs = make_logs(morphbus, options.build.resolve() / 'bench', options.events)
    counts = [events(morphbus, log) for log in logs]
    print(f'two logs of {counts[0]} and {counts[1]} events, {sum(log.stat().st_size for log in logs) / 1e6:.0f} MB together')
    for _ in range(options.repeat):
        seconds, megabytes, verdict = compare(morphbus, *logs)
        load = pathlib.Path('/proc/loadavg').read_text().split()[0]
        print(f'  {verdict}: {seconds:.2f} s (2), {megabytes:.0f} MB (200); load {load}')
    return 0


if __name__ == '__main__':
    sys.exit(main())
