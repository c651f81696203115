#!/usr/bin/env python3
"""The hashes that runs of the shipped robots have on every machine.

runs.json lists the runs: by name, the options of `morphbus run` (files are relative to the repository) and the hashes
of the world and of the run, and for a program that is compiled for more module types than the robot has the options of
`morphbus compile`, with {image} for the file. The suite demands these hashes of runs as they are, without the processor's fused
multiply-add, and, in tools/check, of runs on an emulated old processor and of other builds. It also demands
of each run the fingerprint of arithmetic that sim/arithmetic.h calls usual.

Usage: golden.py [--write] [--without-fma] [--runner COMMAND] [--reproduce] [--short] [--jobs N] [NAME]...
  (default)      runs all of them, or those named, and compares; status 1 if a hash is another
  --write        writes the hashes that they have here into runs.json, and says which have changed
  --without-fma  the C library is told that the processor has neither AVX2 nor FMA, by which it chooses its functions
  --runner       what runs the programs, such as "qemu-x86_64 -cpu core2duo"; not of runs with a process a module
  --reproduce    makes the log of each run as the machine is and has the runner reproduce it, and the other way round
  --short        only the runs marked as short, for slow runners
  --jobs         so many at once (default 1)
MORPHBUS_BIN is the folder of the programs (default: build/release/bin).
"""
import argparse
import concurrent.futures
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
SOURCE = HERE.parent.parent
RUNS = HERE / 'runs.json'
# glibc before and after 2.33 names what is usable differently, and takes no notice of names that it does not know.
WITHOUT_FMA = 'glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F,-AVX2_Usable,-FMA_Usable,-FMA4_Usable,-AVX512F_Usable'
HASHES = ('world_hash', 'hash')
# How machines compute on which these hashes hold.
USUAL = re.search(r'kUsualArithmetic = "(\w+)"', (SOURCE / 'sim' / 'arithmetic.h').read_text(encoding='utf-8'))[1]


def morphbus(runner, folder, *words, environment=os.environ):
    """What `morphbus` says, run by the runner's words."""
    binary = pathlib.Path(os.environ.get('MORPHBUS_BIN', SOURCE / 'build' / 'release' / 'bin')) / 'morphbus'
    return subprocess.run([*runner, binary, *words], cwd=SOURCE, capture_output=True, text=True, timeout=1800,
                          env={**environment, 'XDG_RUNTIME_DIR': f'{folder}/runtime'})


def run_in(folder, run, runner, environment=os.environ):
    """What the run says, with its log in the folder."""
    # The runs have one name, so that each wants a registry of its own.
    os.makedirs(f'{folder}/runtime', mode=0o700)
    commands = [f'run {run["options"]} --run golden --log {{folder}}/golden.log --json']
    if 'compile' in run:
        commands.insert(0, f'compile {run["compile"]} -o {{image}}')
    for command in commands:
        words = [word.format(folder=folder, image=f'{folder}/golden.image') for word in shlex.split(command)]
        done = morphbus(runner, folder, *words, environment=environment)
    return done


def run_once(name, run, runner, environment):
    """The hashes of one run, or what it said instead."""
    with tempfile.TemporaryDirectory() as folder:
        done = run_in(folder, run, runner, environment)
    if done.returncode not in (0, 1) or not done.stdout:
        return name, f'status {done.returncode}: {done.stderr[:2000]}'
    summary = json.loads(done.stdout)
    if summary['arithmetic'] != USUAL:
        return name, f'its arithmetic has the fingerprint {summary["arithmetic"]}, in sim/arithmetic.h {USUAL}'
    return name, {key: summary[key] for key in HASHES}


def reproduce_both_ways(number, run, runner):
    """Makes a log as the machine is and has the runner reproduce it, and the other way round. What went wrong, a line each;
    and how many logs there were. Every third log is compressed."""
    wrong, logs = [], 0
    for made_by, again_by in (([], runner), (runner, [])):
        # What a program starts runs as the machine is.
        if made_by and '--isolate' in run['options']:
            continue
        with tempfile.TemporaryDirectory() as folder:
            made = run_in(folder, run, made_by)
            log = f'{folder}/golden.log'
            if number % 3 == 0:
                morphbus([], folder, 'convert', log, '--to', 'zst', '-o', log + '.zst')
                log += '.zst'
            again = morphbus(again_by, folder, 'reproduce', log)
        logs += 1
        if made.returncode not in (0, 1) or again.returncode != 0 or not again.stdout.startswith('same'):
            wrong.append(f'made by {shlex.join(made_by) or "this machine"}: {made.stderr[:500]}{again.stdout[:500]}{again.stderr[:500]}')
    return wrong, logs


def reproduce_all(golden, names, runner, jobs):
    """Reproduces all logs both ways; the exit status."""
    logs, failed = 0, 0
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        pending = [(n, pool.submit(reproduce_both_ways, i, golden[n], runner)) for i, n in enumerate(names)]
        for name, future in pending:
            wrong, made = future.result()
            logs += made
            failed += len(wrong)
            for line in wrong:
                print(f'{name}: {line}')
    print(f'{logs - failed} of {logs} logs were reproduced')
    return 1 if failed else 0


def main():
    parser = argparse.ArgumentParser(usage=__doc__.split('Usage: ')[1].split('\n')[0])
    parser.add_argument('names', nargs='*')
    parser.add_argument('--write', action='store_true')
    parser.add_argument('--without-fma', action='store_true')
    parser.add_argument('--runner', default='')
    parser.add_argument('--reproduce', action='store_true')
    parser.add_argument('--short', action='store_true')
    parser.add_argument('--jobs', type=int, default=1)
    asked = parser.parse_args()

    golden = json.loads(RUNS.read_text(encoding='utf-8'))
    if unknown := set(asked.names) - set(golden):
        print(f'golden.py: no run {", ".join(sorted(unknown))}; there are: {", ".join(golden)}', file=sys.stderr)
        return 2
    names = [n for n in golden if (not asked.names or n in asked.names) and (not asked.short or golden[n].get('short'))]
    if asked.reproduce:
        return reproduce_all(golden, names, shlex.split(asked.runner), asked.jobs)
    if asked.runner:
        # What a program starts runs as the machine is.
        names = [n for n in names if '--isolate' not in golden[n]['options']]
    environment = {**os.environ, **({'GLIBC_TUNABLES': WITHOUT_FMA} if asked.without_fma else {})}

    differing = []
    with concurrent.futures.ThreadPoolExecutor(asked.jobs) as pool:
        pending = [pool.submit(run_once, n, golden[n], shlex.split(asked.runner), environment) for n in names]
        for name, found in (future.result() for future in pending):
            kept = {key: golden[name].get(key) for key in HASHES}
            if found == kept:
                continue
            differing.append(name)
            if isinstance(found, str):
                print(f'{name}: {found}')
                continue
            for key in HASHES:
                if found[key] != kept[key]:
                    print(f'{name}: {key} {found[key]}, in runs.json {kept[key]}')
            golden[name].update(found)
    if asked.write:
        RUNS.write_text(json.dumps(golden, indent=1) + '\n', encoding='utf-8')
    print(f'{len(names) - len(differing)} runs have the hashes of runs.json, {len(differing)} have not'
          f'{": runs.json is written anew" if asked.write and differing else ""}')
    return 0 if not differing or asked.write else 1


if __name__ == '__main__':
    sys.exit(main())
