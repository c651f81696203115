#!/usr/bin/env python3
"""Records the walks that the other tests look at: one program, compiled once, on both robots, each run
with one simulator, nine module processes and a logger."""
import json
import unittest

from support import MODEL, PROGRAM, ROBOTS, SCRATCH, WALK_SECONDS, Case, as_json, morphbus


class Record(Case):
    def test_both_robots_run_with_the_same_image(self):
        SCRATCH.mkdir(parents=True, exist_ok=True)
        image = SCRATCH / 'quadruped.image'
        morphbus('compile', PROGRAM, '--model', MODEL, '-o', image)
        hashes = set()
        for robot in ROBOTS:
            summary = as_json('run', MODEL, image, '--robot', robot, '--seconds', WALK_SECONDS, '--isolate',
                              '--log', SCRATCH / f'{robot}.log')
            self.assertIsNone(summary['error'])
            self.assertEqual(summary['ticks'], WALK_SECONDS * 50)
            (SCRATCH / f'{robot}.json').write_text(json.dumps(summary))
            hashes.add(summary['program_hash'])
        self.assertEqual(len(hashes), 1)


if __name__ == '__main__':
    unittest.main()
