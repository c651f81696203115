#!/usr/bin/env python3
"""`morphbus spy` on a terminal, in tmux: keys, scrolling, sizes, colours, foreign traffic, a run that is commanded.

Run inside a private network. Nothing here waits for the clock: every step waits until the screen shows what it should.
"""
import os
import re
import shlex
import struct
import subprocess
import sys
import threading
import unittest

from interop import send
from support import MODEL, PROGRAM, Case, as_json, await_condition, command, morphbus

# The fields that a colour has in an escape sequence: 30..37, 90..97, 38, 39 and their backgrounds.
COLOR = re.compile(r'\x1b\[(?:\d+;)*(?:3[0-8]|9[0-7]|4[0-8]|10[0-7])(?:;\d+)*m')


class Terminal(Case):
    """A tmux server of its own, in which one program runs."""
    servers = 0

    def open(self, *arguments, width=80, height=24, environment=None):
        # A server that was told to end may still be there: the next one has a socket of its own.
        self.servers += 1
        self.socket = self.folder / f'tmux{self.servers}'
        settings = {'LC_ALL': 'C.UTF-8', 'TERM': 'screen-256color', **(environment or {})}
        line = ' '.join(f'{name}={shlex.quote(value)}' for name, value in settings.items())
        program = ' '.join(shlex.quote(word) for word in command(*arguments))
        # What the program leaves on the terminal is there to be seen until the test ends.
        self.tmux('new-session', '-d', '-x', width, '-y', height,
                  f'env -u NO_COLOR {line} {program}; echo "status $?"; cat')
        self.addCleanup(self.close)

    def close(self):
        """Ends the server, if it has not ended."""
        subprocess.run(['tmux', '-S', str(self.socket), 'kill-server'], capture_output=True)

    def tmux(self, *arguments):
        environment = {**os.environ, 'LC_ALL': 'C.UTF-8'}
        return subprocess.run(['tmux', '-S', str(self.socket), '-f', '/dev/null', *map(str, arguments)], check=True,
                              capture_output=True, text=True, env=environment).stdout

    def screen(self, *options):
        return self.tmux('capture-pane', '-p', *options)

    def keys(self, *keys):
        self.tmux('send-keys', *keys)

    def type(self, text):
        self.tmux('send-keys', '-l', text)

    def await_screen(self, pattern, *options):
        """The screen once it matches."""
        text = ''

        def matches():
            nonlocal text
            text = self.screen(*options)
            return re.search(pattern, text, re.M | re.S)
        try:
            await_condition(matches, pattern)
        except AssertionError as error:
            raise AssertionError(f'{error}\n{text}') from None
        return text

    def await_without(self, pattern):
        """The screen once it no longer matches."""
        await_condition(lambda: not re.search(pattern, self.screen(), re.M), f'no {pattern}')
        return self.screen()

    def selected(self):
        return next((line for line in self.screen().splitlines() if line.startswith('>')), '')

    def await_selected(self, name):
        await_condition(lambda: name in self.selected(), f'{name} is selected')


class ForeignTraffic(Terminal):
    """Channels that are none of ours, sent by this test."""

    def setUp(self):
        super().setUp()
        self.types = self.folder / 'types'
        self.types.mkdir()
        (self.types / 'wheel_t.lcm').write_text(
            'package cart;\nstruct wheel_t { double speed; string name; int8_t gear; }\n')
        self.stop = threading.Event()
        sender = threading.Thread(target=self.send, args=[self.fingerprint()])
        sender.start()
        self.addCleanup(sender.join)
        self.addCleanup(self.stop.set)

    def fingerprint(self):
        """What lcm-gen says a message of the wheel begins with."""
        generated = self.folder / 'py'
        subprocess.run(['lcm-gen', '-p', '--ppath', str(generated), str(self.types / 'wheel_t.lcm')], check=True,
                       capture_output=True)
        return subprocess.run([sys.executable, '-c', 'import sys; from cart import wheel_t; '
                               'sys.stdout.buffer.write(wheel_t._get_packed_fingerprint())'],
                              cwd=generated, check=True, capture_output=True).stdout

    def send(self, fingerprint):
        """Thirty channels, until the test is over; the wheel's speed rises and falls."""
        step = 0
        while not self.stop.wait(0.02):
            step += 1
            speed = struct.pack('>d', abs(step % 100 - 50))
            send('CART_WHEEL', fingerprint + speed + struct.pack('>i', 5) + b'left\0' + b'\3')
            for i in range(29):
                send(f'OTHER_{i:02}', bytes(range(8)) + bytes(i * 10))

    def test_foreign_channels_are_listed_scrolled_sorted_and_filtered(self):
        self.open('spy', '--lcm-url', 'udpm://')
        text = self.await_screen(r'30 channels')
        self.assertIn('no run of Morphbus heard', text)
        self.assertRegex(text, r'CHANNEL 1-\d+ ')
        self.assertEqual(len(text.splitlines()), 24)
        self.assertNotIn('MODULE', text)
        self.await_selected('CART_WHEEL')
        # Down to the last one, and back to the first.
        self.keys('Down', 'j')
        self.await_selected('OTHER_01')
        self.keys('NPage')
        await_condition(lambda: re.search(r'OTHER_(1|2)', self.selected()), 'a page further')
        self.keys('End')
        self.await_selected('OTHER_28')
        self.assertNotIn('CART_WHEEL', self.screen())
        self.keys('Home')
        self.await_selected('CART_WHEEL')
        # By bandwidth the largest payload comes first; turned round, the smallest.
        self.keys('s', 's', 's', 's', 's', 'Home')
        self.await_screen(r'B/S↓[^\n]*\n[> ]OTHER_28')
        self.keys('r', 'Home')
        self.await_screen(r'B/S↑[^\n]*\n[> ]OTHER_00')
        self.keys('/')
        self.await_screen(r'filter: _')
        self.type('other_1')
        self.await_screen(r'filter: other_1_')
        self.keys('Enter')
        text = self.await_screen(r"filter 'other_1'  10 of 30 channels")
        self.assertNotIn('CART_WHEEL', text)
        self.assertIn('OTHER_19', text)
        self.keys('Escape')
        self.await_screen(r'CART_WHEEL')
        self.keys('q')
        self.await_screen(r'status 0')

    def test_fields_of_a_foreign_type_have_sparklines(self):
        self.open('spy', '--lcm-url', 'udpm://', '--types', self.types)
        self.await_screen(r'>CART_WHEEL +cart\.wheel_t')
        self.keys('Enter')
        text = self.await_screen(r'speed +[\d.]+ [▁▂▃▄▅▆▇█]{4,}')
        self.assertIn('CART_WHEEL  cart.wheel_t', text)
        self.assertRegex(text, r'name +"left"')
        self.assertRegex(text, r'gear +3\n', 'what never changes has no bars')
        # The next channel from there: its type is unknown, and the screen says so, with a way out and the bytes.
        self.keys(']')
        self.await_screen(r'OTHER_00  of unknown type  0001020304050607.*unknown type.*name its \.lcm files by --types$.*'
                          r'^0000  00 01 02 03 04 05 06 07 +\.{8}$')
        self.keys(']')
        self.await_screen(r'^0000  00 01 02 03 04 05 06 07  00 00 00 00 00 00 00 00  \.{16}$.*^0010  00 00 +\.\.$')
        self.keys('Escape')
        self.await_selected('OTHER_01')

    def test_every_size_has_its_screen(self):
        self.open('spy', '--lcm-url', 'udpm://', '--types', self.types)
        self.await_screen(r'CHANNEL .*TYPE +HZ +TREND +P50 +P99 +B/S +COUNT +LOST +UNDEC')
        for width, height in ((60, 20), (40, 12), (24, 6), (12, 3), (3, 2), (120, 40), (80, 24)):
            self.tmux('resize-window', '-x', width, '-y', height)

            def fits():
                lines = self.screen().split('\n')[:-1]
                # It is drawn for this size once the last line has the keys, where there is room for them.
                keys = width < 12 or lines[-1].startswith('? help')
                return len(lines) == height and keys and all(lines[:min(height - 1, 3)])
            await_condition(fits, f'a screen of {width}x{height}')
            self.assertTrue(all(len(line) <= width for line in self.screen().splitlines()))
            if width >= 24 and height >= 6:
                self.await_screen(r'^>CART_WHEEL')
        self.await_screen(r'CHANNEL .*TYPE +HZ +TREND +P50 +P99 +B/S +COUNT +LOST +UNDEC')

    def test_the_last_line_and_the_help_have_the_keys_that_do_something(self):
        self.open('spy', '--lcm-url', 'udpm://')
        text = self.await_screen(r'30 channels')
        self.assertRegex(text, r'\? help  q quit  Enter open  / filter  s sort  f freeze\n$')
        self.keys('?')
        text = self.await_screen(r'^KEYS.*^Esc back  j k scroll$')
        self.assertNotIn('…', text)
        self.assertNotIn('pauses', text)

    def test_colours_only_where_they_are_wanted(self):
        self.open('spy', '--lcm-url', 'udpm://')
        self.await_screen(r'CART_WHEEL')
        self.assertRegex(self.screen('-e'), COLOR)
        self.close()
        self.open('spy', '--lcm-url', 'udpm://', environment={'NO_COLOR': '1'})
        self.await_screen(r'CART_WHEEL')
        self.assertNotRegex(self.screen('-e'), COLOR)
        # The selection and the headings can be told all the same: they are inverse.
        self.assertRegex(self.screen('-e'), r'\x1b\[(?:\d+;)*7m')

    def test_a_locale_without_utf8_gets_ascii(self):
        self.open('spy', '--lcm-url', 'udpm://', '--types', self.types, environment={'LC_ALL': 'C'})
        self.await_screen(r'CART_WHEEL +cart\.whe\S+ +\d+\.\d+ +[_.=+*%#-]{2,} ')
        self.keys('Enter')
        text = self.await_screen(r'speed +[\d.]+ [_.=+*%#-]{4,}')
        self.assertTrue(text.isascii(), text)

    def test_dumb_terminals_get_one_plain_table(self):
        self.open('spy', '--lcm-url', 'udpm://', environment={'TERM': 'dumb'})
        self.await_screen(r'status 0')
        text = self.screen('-S', '-')
        self.assertIn('CHANNEL', text)
        self.assertIn('OTHER_28', text)

    def test_a_terminal_that_nobody_knows_gets_a_table_and_is_told_why(self):
        self.open('spy', '--lcm-url', 'udpm://', environment={'TERM': 'never-heard-of'})
        text = self.await_screen(r'status 0')
        self.assertIn("the terminal cannot show a screen (TERM is 'never-heard-of')", self.screen('-S', '-'))
        self.assertIn('OTHER_28', text)

    def test_interrupting_it_gives_the_terminal_back(self):
        self.open('spy', '--lcm-url', 'udpm://')
        self.await_screen(r'CART_WHEEL')
        self.keys('C-c')
        text = self.await_screen(r'status 0')
        self.assertNotIn('CART_WHEEL', text)

    def test_frozen_figures_stand_still(self):
        self.open('spy', '--lcm-url', 'udpm://')
        self.await_screen(r'30 channels')
        self.keys('f')
        text = self.await_screen(r'FROZEN')
        frozen = re.search(r'CART_WHEEL.*', text).group()
        self.keys('f')
        self.await_without('FROZEN')
        await_condition(lambda: re.search(r'CART_WHEEL.*', self.screen()).group() != frozen, 'the figures go on')


class OurRun(Terminal):
    """A walking quadruped on this network, which is commanded by keys."""

    def setUp(self):
        super().setUp()
        self.run_process = subprocess.Popen(
            command('run', MODEL, PROGRAM, '--robot', 'quadruped', '--seconds', 100000, '--speed', 1, '--run', 'walk',
                    '--log', self.folder / 'walk.log'), stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.kill_at_the_end(self.run_process)
        await_condition(lambda: as_json('runs')['runs'], 'the run is there')

    def test_modules_have_role_pose_and_process(self):
        self.open('spy')
        self.await_screen(r'walk  running  sim \d+\.\d\d s  ×')
        self.await_screen(r'^ m5 +Junction +0µs +0 +\d+\.\d% +[▏▎▍▌▋▊▉█]* +[▁▂▃▄▅▆▇█]+ +\d+\.\dM')
        self.await_screen(r'^ m1 +FrontLeftLowerHalf')
        # Its name stands in the first line, and not in every row.
        text = self.await_screen(r'^ SIM/CLOCK +sim_clock_t +[1-9]\S+ +[▁▂▃▄▅▆▇█]{2,} ')
        self.assertNotIn('walk/', text)
        self.keys('Tab')
        self.await_screen(r'^>m1 .*^ SIM +simulator')
        self.keys('Down', 'Enter')
        text = self.await_screen(r'^m2  of run walk  MTRAN.*^role +FrontLeftUpperHalf.*^convention.*^process +\d')
        self.assertRegex(text, r'pose +\d+ms old, 1 module from the root')
        # Joints and links are called what the model calls them, of a run that began before the spy.
        self.assertRegex(text, r'(?m)^convention +joint_1 [+-]1, joint_2 [+-]1$')
        self.assertRegex(text, r': (active|passive)_block$|: connecting_bar$|: joint_[12]\n')
        self.keys('?')
        self.await_screen(r'^KEYS')
        self.keys('?')
        self.await_screen(r'^m2  of run walk')

    def test_keys_pause_step_and_change_the_speed(self):
        self.open('spy', '--run', 'walk')
        self.await_screen(r'walk  running')
        self.await_screen(r'MODULE')
        # A run that goes on cannot step, one that holds still can.
        self.tmux('resize-window', '-x', 120, '-y', 30)
        text = self.await_screen(r'p pause  \+- speed  f freeze$')
        self.assertNotIn('. step', text)
        self.keys('?')
        self.await_screen(r'paused: runs one tick, ten ticks')
        self.keys('?')
        self.keys('p')
        self.await_screen(r'^pause: tick \d+')
        held = int(re.search(r'tick (\d+)', self.await_screen(r'walk  paused.*×0\.00')).group(1))
        self.keys('.')
        self.await_screen(rf'^step 1: tick {held + 1} ')
        self.keys('Up')
        self.await_screen(r'p resume  \. step  \+- speed')
        self.await_screen(rf'paused.*tick {held + 1}\b')
        self.keys(',')
        self.await_screen(rf'paused.*tick {held + 11}\b')
        self.keys('+')
        self.await_screen(r'^speed 2: tick')
        self.keys('+')
        self.await_screen(r'^speed 4: tick')
        self.keys('Space')
        self.await_screen(r'^resume: tick')
        self.await_screen(r'walk  running')
        # What the run says is what the screen says.
        run = as_json('spy', '--run', 'walk', '--once')['runs']['walk']
        self.assertGreater(run['tick'], held + 11)
        self.assertFalse(run['paused'])
        # A run that is not paused refuses to step, and the screen says why.
        self.keys('.')
        self.await_screen(r'^step 1: the run is not paused')

    def test_a_channel_that_was_named_is_opened(self):
        self.open('spy', '--channel', 'walk/m5/ACTUATOR')
        self.await_screen(r'^walk/m5/ACTUATOR  morphbus\.actuator_t')
        # Names of the model, modes and hashes in words.
        self.await_screen(r'^module_id +m5.*^joints\[joint_1\]\.mode +(HOLD|POSITION|VELOCITY)\b')
        self.keys('End')
        self.await_screen(r'^ +\.tick +\d+ [▁▂▃▄▅▆▇█]{3,}')
        told = as_json('spy', '--run', 'walk', '--once', '--channel', 'walk/m5/ACTUATOR')
        header = next(c for c in told['channels'] if 'last' in c)['last']['header']
        self.assertRegex(header['program_hash'], r'^[0-9a-f]{16}$')
        self.await_screen(rf'^ +\.program_hash +{header["program_hash"]}$')
        # They are those that `info` prints, of the log that is being written.
        log = self.folder / 'walk.log.partial'
        self.assertIn(f'program {header["program_hash"]},', morphbus('info', log).stdout)
        self.keys('q', 'q')
        self.await_screen(r'status 0')


if __name__ == '__main__':
    unittest.main()
