#!/usr/bin/env python3
"""What happens around a run: a log that somebody alters while it is written, programs that were renamed, and states for
which there is no room."""
import os
import shutil
import subprocess
import unittest

from control_live import Live
from support import BIN, EVENT, LIMIT, MODEL, PROGRAM, await_condition, morphbus

ROBOT = ('--robot', 'quadruped')


class Altered(Live):
    def test_both_hashes_are_told(self):
        self.start()
        self.control('pause')
        partial = self.path.with_name(self.path.name + '.partial')

        def second_event():
            """Where the second event begins, once the first two are in the file."""
            with open(partial, 'rb') as file:
                head = file.read(EVENT.size)
                if len(head) < EVENT.size:
                    return 0
                _, _, _, channel_size, size = EVENT.unpack(head)
                at = EVENT.size + channel_size + size
                file.seek(at)
                return at if len(file.read(EVENT.size)) == EVENT.size else 0
        at = await_condition(second_event, 'two events are in the file')
        with open(partial, 'r+b') as file:
            file.seek(at)
            file.write(b'\xff')
        self.control('stop')
        summary = self.end(3)
        self.assertIn('altered while it was written', summary['error'])
        for told in (summary['hash'], summary['log_hash']):
            self.assertIn(told, summary['error'])

    def test_a_log_whose_folder_is_removed_is_not_said_to_be_there(self):
        gone = self.folder / 'gone'
        gone.mkdir()
        self.folder = gone
        self.start()
        self.control('pause')
        shutil.rmtree(gone)
        self.control('stop')
        self.assertIn('nothing is left of the log', self.end(3)['error'])


class Programs(Live):
    def test_morphbus_may_be_renamed_and_its_module_program_is_named_when_missing(self):
        folder = self.folder / 'bin'
        folder.mkdir()
        shutil.copy(BIN / 'morphbus', folder / 'mb')

        def run():
            return subprocess.run([folder / 'mb', 'run', MODEL, PROGRAM, *ROBOT, '--seconds', '1', '--isolate', '--force',
                                   '--log', self.folder / 'renamed.log'], capture_output=True, text=True, timeout=LIMIT)
        missing = run()
        self.assertEqual(missing.returncode, 3, missing.stderr)
        self.assertIn(f'cannot run {folder}/morphbus-module', missing.stderr)
        shutil.copy(BIN / 'morphbus-module', folder / 'morphbus-module')
        done = run()
        self.assertEqual(done.returncode, 0, done.stderr)


class Room(Live):
    def test_a_run_goes_on_without_room_for_its_states(self):
        small = self.folder / 'small'
        small.mkdir()
        # Room for the inputs of the run and for the states of some modules, and not of all nine.
        script = 'mount -t tmpfs -o size=300k,mode=700 none "$0" && exec "$@"'
        probe = subprocess.run(['unshare', '-rm', 'sh', '-c', script, small, 'true'], capture_output=True)
        if probe.returncode != 0:
            raise unittest.SkipTest('a file system of our own cannot be mounted here')
        done = subprocess.run(
            ['unshare', '-rm', 'sh', '-c', script, small, BIN / 'morphbus', 'run', MODEL, PROGRAM, *ROBOT, '--seconds', '1',
             '--isolate', '--log', self.folder / 'room.log'], capture_output=True, text=True, timeout=LIMIT,
            env={**os.environ, 'XDG_RUNTIME_DIR': str(small)})
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn('no room for', done.stderr)
        morphbus('verify', self.folder / 'room.log')


if __name__ == '__main__':
    unittest.main()
