#!/usr/bin/env python3
"""How long Python needs to read a log of a million events, open it and sum all joints' angles and efforts, beside C++ with the
same library. Goal: at most twice its time. The sums must be the same. Prints both times and their ratio; status 1 if it is above 2.

Usage: test/bench/log_python.py [BUILD_FOLDER] [--repeat N] [--events N]   (default build/release, 5, a million)
"""
import argparse
import pathlib
import subprocess
import sys
import time

from compare_million import ROOT, events, make_logs

READ = ('import sys, morphbus\n'
        'log = morphbus.Log(sys.argv[1])\n'
        'joints = [log.joint(joint.name) for joint in log.robot.joints]\n'
        "print(f'{sum(j.position.sum() for j in joints):.6f} {sum(j.effort.sum() for j in joints):.6f}')\n")


def timed(command, folder):
    begin = time.monotonic()
    text = subprocess.check_output(command, env={'PYTHONPATH': str(folder)}, text=True)
    return time.monotonic() - begin, [float(x) for x in text.split()]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('build', nargs='?', default=ROOT / 'build/release', type=pathlib.Path)
    parser.add_argument('--repeat', type=int, default=5)
    parser.add_argument('--events', type=int, default=1_000_000)
    options = parser.parse_args()
    build = options.build.resolve()
    log = make_logs(build / 'bin/morphbus', build / 'bench', options.events)[0]
    cpp, python = [], []
    for _ in range(options.repeat):
        seconds, expected = timed([build / 'bin/log_series', log], build / 'python')
        cpp.append(seconds)
        seconds, sums = timed(['/usr/bin/python3', '-c', READ, log], build / 'python')
        python.append(seconds)
        # The order of the sums differs.
        if any(abs(a - b) > 1e-6 * max(1, abs(a)) for a, b in zip(expected, sums)):
            print(f'the sums differ: {expected} and {sums}', file=sys.stderr)
            return 1
    ratio = min(python) / min(cpp)
    print(f'{events(build / "bin/morphbus", log)} events: C++ {min(cpp):.2f} s, Python {min(python):.2f} s, ratio {ratio:.2f} (2)')
    return 1 if ratio > 2 else 0


if __name__ == '__main__':
    sys.exit(main())
