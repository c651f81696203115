#!/usr/bin/env python3
"""A run is the same on every processor: who computes what, and hashes without what newer processors can (docs/arithmetic.md)."""
import json
import os
import pathlib
import re
import subprocess
import unittest

from support import BIN, MODEL, PROGRAM, SOURCE, Case, ShortRun, as_json, morphbus

# What IEEE 754 or C define to the bit: these give everywhere what they give here. The last ones are no functions of
# numbers: rounding modes and variables of old error handling.
EXACT = set('''sqrt floor ceil trunc round roundeven rint nearbyint lround llround lrint llrint fmod remainder remquo fma frexp
               ldexp scalbn scalbln modf copysign fabs fmin fmax fdim nextafter nexttoward ilogb logb'''.split())
EXACT |= {name + suffix for name in EXACT for suffix in 'fl'}
EXACT |= set('fegetround fesetround fegetenv fesetenv feholdexcept feupdateenv feclearexcept feraiseexcept fetestexcept '
             '_LIB_VERSION signgam __signgam matherr'.split())
BINDING = re.compile(r"binding file (\S+) \[\d+\] to (\S+) \[\d+\]: normal symbol `(\w+)'")

# glibc 2.36 and later read the short names, older ones those that end with _Usable.
OLD_PROCESSOR = 'glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F,-AVX2_Usable,-FMA_Usable'


def bindings(program, *arguments, library_path=''):
    """All that the dynamic linker binds when this program (of ours, or a path) runs: (library, library that defines it, symbol)."""
    environment = {**os.environ, 'LD_BIND_NOW': '1', 'LD_DEBUG': 'bindings', 'LD_LIBRARY_PATH': library_path}
    done = subprocess.run([BIN / program, *(arguments or ('--version',))], env=environment, capture_output=True, text=True, timeout=120)
    if done.returncode != 0:
        raise AssertionError(done.stderr[-2000:])
    return [(pathlib.Path(user).name, pathlib.Path(definer).name, symbol)
            for user, definer, symbol in BINDING.findall(done.stderr)]


class Bindings(unittest.TestCase):
    """Which definition a library calls is decided when the program starts, and the linker tells."""

    def inexact(self, program):
        """Functions of libm that a run could get other bits from on another machine, with who calls them."""
        found = bindings(program)
        self.assertTrue([symbol for _, definer, symbol in found if definer.startswith('libm.so')], 'libm is bound by nobody')
        return [f'{user} calls {symbol} of {definer}' for user, definer, symbol in found
                if definer.startswith('libm.so') and symbol not in EXACT and not user.startswith('libm.so')]

    def test_nobody_takes_what_is_not_exact_from_libm(self):
        # No library is exempt: even those that only draw call the program's own.
        self.assertEqual(self.inexact('morphbus'), [])

    def test_modules_call_no_such_function_at_all(self):
        self.assertEqual(self.inexact('morphbus-module'), [])
        libraries = {definer for _, definer, _ in bindings('morphbus-module')}
        self.assertFalse([name for name in libraries if 'mpfr' in name])

    def test_the_engine_calls_the_programs_own(self):
        own = {symbol for user, definer, symbol in bindings('morphbus') if user.startswith('libBullet') and definer == 'morphbus'}
        self.assertLessEqual({'sin', 'cos', 'sincos', 'atan2', 'acos', 'asin', 'pow'}, own)


BOX = '''<sdf version="1.9"><world name="yard"><model name="box"><static>true</static><pose>0.9 0 0.1 0 0 0</pose>
<link name="link"><collision name="c"><geometry><box><size>0.1 2 0.2</size></box></geometry></collision></link></model></world></sdf>
'''


class WithoutFma(Case):
    """glibc chooses its functions by the processor, and can be told to take those for an old one."""

    def expect_the_same(self, model, program, robot, *options, seconds=20):
        hashes = {}
        for tunables in ('', OLD_PROCESSOR):
            environment = {**os.environ, 'GLIBC_TUNABLES': tunables}
            summary = as_json('run', SOURCE / f'models/{model}.m3l', SOURCE / f'models/programs/{program}.dyn', '--robot', robot,
                              '--seconds', seconds, '--inproc', '--run', 'same', '--log', self.folder / 'x.log', '--force', *options,
                              env=environment)
            hashes[tunables] = summary['hash']
        self.assertEqual(hashes[''], hashes[OLD_PROCESSOR])

    def world(self):
        path = self.folder / 'box.sdf'
        path.write_text(BOX)
        return path

    def test_quadruped(self):
        self.expect_the_same('mtran', 'quadruped', 'quadruped')

    def test_noise_of_sensors(self):
        self.expect_the_same('atron', 'car_evade', 'car', '--world', self.world())

    def test_snake_of_molecubes(self):
        self.expect_the_same('snakes', 'snake', 'molecube_snake8')

    def test_train(self):
        self.expect_the_same('smores', 'smores_train', 'train', '--world', self.world())

    def test_noise_of_the_root_sensor(self):
        self.expect_the_same('mtran', 'quadruped_upright', 'quadruped', '--root-sensor', '--root-noise', '0.002,0.01')


class Fingerprint(ShortRun):
    """What the arithmetic makes of fixed operations and a small world of the engine's, in logs and out of them."""
    SECONDS = 1

    def setUp(self):
        super().setUp()
        self.known = as_json('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 0.1, '--inproc', '--log',
                             self.folder / 'x.log', status=1)['arithmetic']

    def of_another_machine(self):
        return self.doctored(self.short, self.known.encode(), b'0123456789abcdef')

    def test_run_doctor_and_info_say_the_same(self):
        self.assertRegex(self.known, '^[0-9a-f]{16}$')
        doctor = morphbus('doctor', '--lcm-url', 'memq://', status=None).stdout
        self.assertRegex(doctor, f'(?m)^ok +arithmetic +{self.known}')
        self.assertEqual(as_json('info', self.short)['description']['arithmetic'], self.known)
        self.assertIn(f'\narithmetic {self.known}\n', morphbus('info', self.short).stdout)

    def test_an_older_log_does_not_tell(self):
        # The number of a field that no version has.
        older = self.doctored(self.short, b'\xb2\x02\x10' + self.known.encode(), b'\xba\x3e\x10' + self.known.encode())
        self.assertEqual(as_json('info', older)['description']['arithmetic'], '')
        self.assertIn('\narithmetic not known\n', morphbus('info', older).stdout)
        self.assertNotIn('arithmetic', morphbus('compare', self.short, older, status=None).stdout)
        self.assertNotIn('arithmetic', morphbus('reproduce', older, status=None).stderr)

    def test_compare_says_when_that_of_two_logs_differs(self):
        other = self.of_another_machine()
        note = f'their arithmetic differs (A {self.known}, B 0123456789abcdef), so that equal hashes cannot be expected'
        self.assertIn(f'  note: {note}\n', morphbus('compare', self.short, other, status=None).stdout)
        for level in ('sample', 'gait'):
            found = json.loads(morphbus('compare', self.short, other, '--level', level, '--json', status=None).stdout)
            self.assertIn(note, found['notes'])
        self.assertNotIn('arithmetic', morphbus('compare', self.short, self.short).stdout)

    def test_reproduce_says_that_the_hash_may_differ(self):
        other = self.of_another_machine()
        note = f'made with arithmetic 0123456789abcdef, that of this machine is {self.known}: its hash may differ'
        self.assertIn(note, morphbus('reproduce', other, status=2).stderr)
        found = json.loads(morphbus('reproduce', other, '--json', status=2).stdout)
        self.assertEqual((found['note'], found['arithmetic'], found['logged_arithmetic']), (note, self.known, '0123456789abcdef'))


if __name__ == '__main__':
    unittest.main()
