#!/usr/bin/env python3
"""What happens around a run: a log that somebody alters while it is written, programs that were renamed, and states for
which there is no room."""
import errno
import os
import pathlib
import shutil
import subprocess
import sys
import unittest

from control_live import Live
from dying import MODULES, Dying
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
        shutil.rmtree(gone)
        # The logger looks at its file whenever it writes, and the run ends with it; nobody has to stop it.
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
    def in_small(self, size, *arguments):
        """Runs something whose registry of runs is a file system of this size (as mount's) that nobody else sees."""
        small = self.folder / 'small'
        small.mkdir()
        script = f'mount -t tmpfs -o size={size},mode=700 none "$0" && exec "$@"'
        alone = ['unshare', '-rm', 'sh', '-c', script, small]
        if subprocess.run([*alone, 'true'], capture_output=True).returncode != 0:
            raise unittest.SkipTest('a file system of our own cannot be mounted here')
        done = subprocess.run([*alone, *arguments], capture_output=True, text=True, timeout=2 * LIMIT,
                              env={**os.environ, 'XDG_RUNTIME_DIR': str(small), 'MORPHBUS_SMALL': str(small)})
        self.assertEqual(done.returncode, 0, done.stderr)
        return done

    def test_a_run_goes_on_without_room_for_its_states(self):
        # Room for the inputs of the run and for the states of some modules, and not of all nine.
        done = self.in_small('300k', BIN / 'morphbus', 'run', MODEL, PROGRAM, *ROBOT, '--seconds', '1', '--isolate',
                             '--log', self.folder / 'room.log')
        self.assertIn('no room for', done.stderr)
        morphbus('verify', self.folder / 'room.log')

    def test_a_run_goes_on_when_the_room_ends(self):
        self.in_small('4m', sys.executable, __file__, 'RoomEnds')


class RoomEnds(Dying):
    """What Room has run where its file system is the registry."""

    def setUp(self):
        super().setUp()
        if 'MORPHBUS_SMALL' not in os.environ:
            raise unittest.SkipTest('Room runs it')
        self.small = pathlib.Path(os.environ['MORPHBUS_SMALL'])
        # That of Room, by which the run's processes are known.
        self.folder = self.small.parent
        os.environ['XDG_RUNTIME_DIR'] = str(self.small)

    def large_program(self):
        """The robot's own, and so many roles that no module has that its image does not fit into what states have room for."""
        path = self.folder / 'large.dyn'
        spare = ''.join(f'role Spare{i} extends Module {{\n  x = 0;\n  require (sizeof(self.connected) == 40);\n  behavior b() {{\n' +
                        f'    x += {i};\n' * 20 + '  }\n}\n' for i in range(40))
        path.write_text(PROGRAM.read_text() + spare)
        return path

    def fill(self):
        """Takes all room that is left."""
        with open(self.small / 'filler', 'wb', buffering=0) as file, self.assertRaises(OSError) as failed:
            while True:
                file.write(bytes(4096))
        self.assertEqual(failed.exception.errno, errno.ENOSPC)

    def test_a_state_that_finds_no_room_to_grow_is_saved_no_more(self):
        self.start()
        held = self.control('pause')['tick']
        self.await_held(held)
        # The states have their room by now; what comes with the new program does not fit into it.
        self.control('deploy', self.large_program())
        self.fill()
        self.control('resume')
        self.reach(held + 200)
        # Whoever has grown has no file any more, and is there all the same.
        states = {path.name for path in self.small.glob('morphbus/live/*.state')}
        lost = [m for i, m in enumerate(MODULES) if f'process-{i}.state' not in states]
        self.assertGreater(len(lost), 0)
        pid = self.kill(lost[0])
        self.await_successor(lost[0], pid)
        self.reach(held + 400)
        self.control('stop')
        summary = self.end()
        for module in lost:
            self.assertIn(f'{module} saves its state no more: no room for', self.said)
        self.assertIn(f'{lost[0]} without a state, anew', self.said)
        self.assertEqual(summary['restarts'], {lost[0]: 1})
        self.assert_clean()


if __name__ == '__main__':
    unittest.main()
