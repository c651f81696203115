#!/usr/bin/env python3
"""What a stranger with lcm-gen and Python gets: the types import as a package and decode a log of ours.

Nothing of this repository but lcmtypes/*.lcm is used: the log is read by hand, and lcm-gen's Python code
needs only the standard library.
"""
import collections
import importlib
import pathlib
import subprocess
import sys
import tempfile
import unittest

from support import MODEL, PROGRAM, SOURCE, Case, morphbus, read_events


class PythonTypes(Case):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix='morphbus-types-')
        cls.addClassCleanup(folder.cleanup)
        cls.names = sorted(file.stem for file in (SOURCE / 'lcmtypes').glob('*.lcm'))
        subprocess.run(['lcm-gen', '-p', '--ppath', folder.name,
                        *(str(SOURCE / 'lcmtypes' / f'{name}.lcm') for name in cls.names)],
                       check=True, capture_output=True)
        sys.path.insert(0, folder.name)
        cls.addClassCleanup(sys.path.remove, folder.name)
        cls.package = importlib.import_module('morphbus')
        assert pathlib.Path(cls.package.__file__).is_relative_to(folder.name)

    def test_the_package_holds_every_type(self):
        for name in self.names:
            kind = getattr(self.package, name)
            self.assertEqual(type(kind()).__name__, name)

    def test_every_message_of_a_log_is_decoded_and_encodes_to_its_bytes(self):
        log = self.folder / 'short.log'
        morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 2, '--inproc', '--run', 'short',
                 '--log', log)
        kinds = {kind._get_packed_fingerprint(): kind for kind in (getattr(self.package, n) for n in self.names)}
        counts = collections.Counter()
        roles = set()
        for _, _, channel, data in read_events(log):
            message = kinds[data[:8]].decode(data)
            self.assertEqual(message.encode(), data, channel)
            counts[type(message).__name__] += 1
            if channel.endswith('/STATUS'):
                roles.add(message.role_name)
        self.assertEqual(counts['sensors_t'], 100)
        self.assertEqual(counts['transform_t'], 900)
        self.assertEqual(counts['log_end_t'], 1)
        self.assertGreater(counts['totals_t'], 0)
        self.assertIn('Junction', roles)


if __name__ == '__main__':
    unittest.main()
