#!/usr/bin/env python3
"""Logs in motion: MP4, GIF and WebP as other people's readers find them, and what stands in the way of one."""
import os
import re
import struct
import subprocess
import unittest

from support import ShortRun, morphbus

FPS = 20
#: Sim times between which the videos lie, seconds: so many frames, the first and the last among them.
FROM, TO = 0.5, 1.5
FRAMES = 21
#: Width of each view, pixels: an odd one, for which MP4 has no room.
WIDTH = 301


def probed(path):
    """What ffprobe finds in a file, all of whose frames it decodes."""
    done = subprocess.run(['ffprobe', '-v', 'error', '-count_frames', '-select_streams', 'v', '-of', 'default=noprint_wrappers=1',
                           '-show_entries', 'stream=codec_name,pix_fmt,width,height,nb_read_frames,color_space:format=duration', path],
                          capture_output=True, text=True, check=True)
    assert not done.stderr, done.stderr
    return dict(line.split('=', 1) for line in done.stdout.split())


def pixels(path, time):
    """Width, height and the RGB bytes of the frame at `time`, decoded by ffmpeg."""
    found = probed(path)
    done = subprocess.run(['ffmpeg', '-v', 'error', '-ss', str(time), '-i', path, '-frames:v', '1', '-f', 'rawvideo', '-pix_fmt', 'rgb24', '-'],
                          capture_output=True, check=True)
    return int(found['width']), int(found['height']), done.stdout


def boxes(content):
    """Names of the parts of an MP4, in their order."""
    names, at = [], 0
    while at < len(content):
        size, name = struct.unpack_from('>I4s', content, at)
        names.append(name.decode())
        at += size
    return names


def gif_frames(content):
    """Delays (hundredths of a second) of a GIF's frames, and how often it is repeated (0: for ever), by its blocks."""
    delays, loops = [], None
    at = 13 + (3 << ((content[10] & 7) + 1) if content[10] & 128 else 0)
    while content[at] != 0x3B:
        kind, start = content[at], at
        at += 2 if kind == 0x21 else 10 + (3 << ((content[at + 9] & 7) + 1) if content[at + 9] & 128 else 0) + 1
        if kind == 0x21 and content[start + 1] == 0xF9:
            delays.append(int.from_bytes(content[start + 4:start + 6], 'little'))
        if content[start + 3:start + 14] == b'NETSCAPE2.0':
            loops = int.from_bytes(content[start + 16:start + 18], 'little')
        while content[at]:
            at += content[at] + 1
        at += 1
    return delays, loops


def webp_frames(content):
    """Durations (ms) of an animated WebP's frames, and its size in pixels."""
    durations, at, size = [], 12, None
    while at < len(content):
        name, length = content[at:at + 4], int.from_bytes(content[at + 4:at + 8], 'little')
        if name == b'VP8X':
            size = tuple(1 + int.from_bytes(content[at + 12 + 3 * i:at + 15 + 3 * i], 'little') for i in range(2))
        if name == b'ANMF':
            durations.append(int.from_bytes(content[at + 20:at + 23], 'little'))
        at += 8 + length + length % 2
    return durations, size


class Videos(ShortRun):
    SECONDS = 2

    def video(self, name, *options, to=TO):
        path = self.folder / name
        morphbus('draw', self.short, '--video', '--fps', FPS, '--from', FROM, '--to', to, '--width', WIDTH, '-o', path, *options)
        return path

    def test_each_kind_has_all_frames_of_one_size_for_as_long_as_they_took(self):
        durations, (width, height) = webp_frames(self.video('x.webp').read_bytes())
        self.assertEqual((len(durations), sum(durations)), (FRAMES, FRAMES * 1000 // FPS))
        self.assertEqual(width % 2, 1)
        gif = self.video('x.gif')
        delays, loops = gif_frames(gif.read_bytes())
        self.assertEqual((delays, loops), ([100 // FPS] * FRAMES, 0))
        found = probed(gif)
        self.assertEqual((int(found['nb_read_frames']), int(found['width']), int(found['height'])), (FRAMES, width, height))
        mp4 = self.video('x.mp4')
        found = probed(mp4)
        self.assertEqual(int(found['nb_read_frames']), FRAMES)
        self.assertAlmostEqual(float(found['duration']), FRAMES / FPS, places=3)
        # H.264 with colours at half the resolution, of even size, with the index in front.
        self.assertEqual((int(found['width']), int(found['height'])), (width + width % 2, height + height % 2))
        self.assertEqual((found['codec_name'], found['pix_fmt'], found['color_space']), ('h264', 'yuv420p', 'bt709'))
        names = boxes(mp4.read_bytes())
        self.assertLess(names.index('moov'), names.index('mdat'), names)

    def test_roles_have_their_colours_and_the_robot_moves(self):
        picture = self.folder / 'x.svg'
        morphbus('draw', self.short, '--at', 1, '-o', picture)
        # The legend's first square.
        colour = [round(float(share) * 2.55) for share in
                  re.search(r'fill:rgb\(([\d.]+)%,([\d.]+)%,([\d.]+)%\)[^>]*/>\s*</svg>|fill:rgb\(([\d.]+)%,([\d.]+)%,([\d.]+)%\)',
                            picture.read_text().split('<rect')[-1]).groups() if share]
        for name, tolerance in (('x.mp4', 8), ('x.gif', 2)):
            path = self.video(name)
            frames = [pixels(path, time) for time in (0, 0.5, 1)]
            for width, height, rgb in frames:
                self.assertEqual(len(rgb), width * height * 3)
                self.assertGreater(min(rgb[:3]), 250, 'the ground of the picture is white')
                like = sum(all(abs(rgb[i + c] - colour[c]) <= tolerance for c in range(3)) for i in range(0, len(rgb), 3))
                self.assertGreater(like, 50, (name, colour))
            self.assertEqual(len({rgb for _, _, rgb in frames}), 3)

    def test_the_same_log_becomes_the_same_bytes(self):
        for ending in ('webp', 'gif', 'mp4'):
            first, second = (self.video(f'{i}.{ending}', to=0.7) for i in range(2))
            self.assertEqual(first.read_bytes(), second.read_bytes(), ending)

    def test_the_name_may_stand_behind_video(self):
        path = self.folder / 'x.mp4'
        morphbus('draw', self.short, '--video', path, '--to', 0.2, '--view', 'side,top')
        self.assertEqual(probed(path)['nb_read_frames'], '3')
        said = self.refused('draw', self.short, '--video', path, '-o', self.folder / 'y.mp4')
        self.assertIn('two names of one picture', said)
        self.assertIn('which picture to write?', self.refused('draw', self.short, '--video'))

    def test_a_log_that_ends_before_is_not_the_fault_of_the_video(self):
        for ending in ('webp', 'gif', 'mp4'):
            said = self.refused('draw', self.short, '--video', '--from', 50, '-o', self.folder / f'x.{ending}')
            self.assertEqual(said, 'morphbus: error: the log ends at 1.98 s, before 50 s\n')

    def test_names_that_are_no_videos_and_files_of_others_are_refused(self):
        for name in ('x.avi', 'x.svg', 'x'):
            self.assertIn("a video's name ends in .mp4, .gif or .webp", self.refused('draw', self.short, '--video', '-o', self.folder / name))
        for ending in ('webp', 'gif', 'mp4'):
            path = self.folder / f'mine.{ending}'
            self.assertIn('add --video', self.refused('draw', self.short, '--at', 1, '-o', path))
            # A text that has MP4's word in it is no MP4.
            path.write_text('    ftyp is how MP4 begins')
            self.assertIn('--force', self.refused('draw', self.short, '--video', '-o', path))
            self.assertTrue(path.read_text().startswith('    ftyp'))
            for force in (['--force'], []):
                morphbus('draw', self.short, '--video', '--to', 0.1, '-o', path, *force)
        other = self.folder / 'other.mp4'
        other.write_bytes((self.folder / 'mine.gif').read_bytes())
        self.assertIn('a file that is not an MP4 video is there', self.refused('draw', self.short, '--video', '-o', other))

    def with_path(self, path, *arguments):
        """What a refused command says where programs are looked for in `path`."""
        return morphbus(*arguments, status=2, env={**os.environ, 'PATH': str(path)}).stderr

    def refused(self, *arguments):
        return morphbus(*arguments, status=2).stderr

    def test_without_ffmpeg_it_is_said_what_to_install(self):
        for ending in ('gif', 'mp4'):
            said = self.with_path(self.folder, 'draw', self.short, '--video', '-o', self.folder / f'x.{ending}')
            self.assertIn('apt install ffmpeg', said)
            self.assertEqual(said.count('\n'), 1, said)
        self.assertEqual(list(self.folder.glob('x*')), [])
        morphbus('draw', self.short, '--video', '--to', 0.1, '-o', self.folder / 'x.webp')

    def test_an_ffmpeg_that_fails_is_quoted_and_leaves_nothing(self):
        for script, why in (('echo "Unknown encoder libx264" >&2; exit 1', 'ffmpeg exited with status 1: Unknown encoder libx264'),
                            ('/bin/cat >/dev/null; kill -9 $$', 'ffmpeg was killed by signal 9'),
                            ('exit 0', 'ffmpeg ended before it had all frames')):
            programs = self.folder / 'programs'
            programs.mkdir(exist_ok=True)
            (programs / 'ffmpeg').write_text(f'#!/bin/sh\n{script}\n')
            (programs / 'ffmpeg').chmod(0o755)
            said = self.with_path(programs, 'draw', self.short, '--video', '-o', self.folder / 'x.mp4')
            self.assertIn(f'x.mp4: {why}', said)
            self.assertEqual(list(self.folder.glob('x*')), [])
        # What cannot be sought is no place for a video.
        (self.folder / 'device.mp4').symlink_to('/dev/null')
        self.assertIn('only be written to a file', self.refused('draw', self.short, '--video', '-o', self.folder / 'device.mp4'))


if __name__ == '__main__':
    unittest.main()
