#!/usr/bin/env python3
"""docs/data.md: the ten lines run as they stand there, and plot what is in the log."""
import json
import os
import pathlib
import re
import subprocess
import sys
import unittest
import xml.etree.ElementTree

from support import MODEL, PROGRAM, SOURCE, Case, as_json, decode, morphbus, read_events

# matplotlib comes from Debian, and so must the interpreter.
PYTHON = '/usr/bin/python3' if pathlib.Path('/usr/bin/python3').exists() else sys.executable


class DataDocs(Case):
    def test_the_ten_lines_plot_the_log(self):
        text = (SOURCE / 'docs' / 'data.md').read_text(encoding='utf-8')
        generate, = re.findall(r'```sh\n(.*?)```', text, re.S)
        lines, = re.findall(r'```python\n(.*?)```', text, re.S)
        self.assertEqual(len(lines.splitlines()), 10)
        morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 3, '--inproc', '--run', 'walk',
                 '--log', self.folder / 'walk.log')
        (self.folder / 'lcmtypes').symlink_to(SOURCE / 'lcmtypes')
        subprocess.run(['sh', '-ec', generate], cwd=self.folder, check=True)
        # What was plotted is printed behind the lines, which stay as they are.
        told = 'import json; print(json.dumps(points))'
        done = subprocess.run([PYTHON, '-c', lines + told], cwd=self.folder, capture_output=True, text=True, check=False,
                              env={**os.environ, 'MPLBACKEND': 'svg', 'MPLCONFIGDIR': str(self.folder)})
        self.assertEqual(done.returncode, 0, done.stderr)
        expected = [[message.header.sim_time_us / 1e6, module.joint_position_si[0]]
                    for _, _, channel, data in read_events(self.folder / 'walk.log') if channel.endswith('/SIM/SENSORS')
                    for message in (decode(data),) for module in message.modules if module.name == 'm2']
        self.assertEqual(len(expected), 150)
        self.assertEqual(json.loads(done.stdout), expected)
        picture = xml.etree.ElementTree.parse(self.folder / 'joint.svg').getroot()
        self.assertTrue(picture.tag.endswith('svg'))

    def test_the_document_names_every_table_and_format(self):
        text = (SOURCE / 'docs' / 'data.md').read_text(encoding='utf-8')
        log = self.folder / 'walk.log'
        morphbus('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 3, '--inproc', '--log', log)
        files = as_json('convert', log, '--to', 'csv', '-o', self.folder / 'walk')['files']
        self.assertEqual(re.findall(r'^\| `(\w+\.csv)` \|', text, re.M), files)


if __name__ == '__main__':
    unittest.main()
