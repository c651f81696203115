// Videos that the page records of a log, in a browser: read back by ffprobe, a reader of others.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { after, afterEach, before, test } from 'node:test';
import { drawn, keepShot, launch, newPage, openMock, text, time } from './browser.mjs';
import { Demo } from './demo.mjs';

let browser, demo, log;
before(async () => {
  browser = await launch();
  demo = new Demo();
  log = demo.record('quadruped', 'walk', 4);
});
after(async () => {
  await browser.close();
  await demo.end();
});
// A page that is left behind would go on drawing.
afterEach(async () => Promise.all(browser.contexts().map((context) => context.close())));

/** What ffprobe finds in a video, all of whose frames it decodes. */
function probed(path) {
  const words = ['-v', 'error', '-count_frames', '-of', 'json', '-show_entries', 'stream=width,height,nb_read_frames:frame=pts_time'];
  const { streams, frames } = JSON.parse(execFileSync('ffprobe', [...words, path], { encoding: 'utf8' }));
  return { ...streams[0], times: frames.map((frame) => Number(frame.pts_time)) };
}

/** The RGB bytes of a video's frame, as ffmpeg decodes them. */
function pixels(path, frame) {
  const words = ['-v', 'error', '-i', path, '-vf', `select=eq(n\\,${frame})`, '-frames:v', '1', '-f', 'rawvideo', '-pix_fmt', 'rgb24', '-'];
  return execFileSync('ffmpeg', words, { maxBuffer: 1 << 26 });
}

/** Opens the log, all of which is there. */
async function openLog() {
  const { url } = await demo.monitor([log]);
  const page = await newPage(browser);
  await page.goto(url);
  await page.waitForFunction(() => window.monitor?.session.runs[0]?.poses.length === 200);
  await page.locator('h1').click();
  return page;
}

/** Has a stretch of the log recorded; returns the name and the path of the file, and what the page says of it. */
async function record(page, from, to, plots) {
  await page.keyboard.press('m');
  await page.locator('.record-dialog [name=from]').fill(String(from));
  await page.locator('.record-dialog [name=to]').fill(String(to));
  await page.locator('.record-dialog [name=plots]').setChecked(plots);
  await keepShot(page, 'record-dialog');
  const download = page.waitForEvent('download');
  await page.locator('.record-dialog [type=submit]').click();
  await page.waitForSelector('[data-action=record].recording:has-text("Stop 0.")');
  await keepShot(page, 'recording');
  const file = await download;
  return { name: file.suggestedFilename(), path: await file.path(), said: await text(page, '.notice') };
}

test('a stretch of a log becomes a video picture by picture, at any speed', async () => {
  const page = await openLog();
  const { name, path, said } = await record(page, 2, 2.3, true);
  assert.match(name, /^walk_2\.0s\.(mp4|webm)$/);
  assert.match(said, /^walk_2\.0s\.\w+: 0\.3 s, 0\.\d MB\.$/);
  const video = probed(path);
  assert.equal(Number(video.nb_read_frames), 10);
  // Thirty a second, whatever time each took to be drawn.
  video.times.forEach((at, i) => assert.ok(Math.abs(at - i / 30) < 0.002, `${video.times}`));
  // It has the size of view and plots, and at least 1280 pixels of width.
  const [stage, plots] = await page.evaluate(() =>
    ['.stage', '.plot-list'].map((s) => document.querySelector(s).getBoundingClientRect().height),
  );
  const scale = video.width / (await page.evaluate(() => document.querySelector('.stage').clientWidth));
  assert.ok(video.width >= 1280 && Math.abs(video.height / scale - stage - plots) < 3, `${video.width} x ${video.height}`);
  const [first, last] = [0, 9].map((frame) => pixels(path, frame));
  assert.equal(first.length, video.width * video.height * 3);
  const changed = first.filter((value, i) => Math.abs(value - last[i]) > 40).length;
  assert.ok(changed > 1000, `${changed} bytes of the pictures differ`);
  assert.ok(Math.abs((await time(page)) - 2.3) < 1e-6);
  // Twice as fast there are half as many, without the plots.
  await page.keyboard.press(']');
  const fast = probed((await record(page, 2, 2.3, false)).path);
  assert.equal(Number(fast.nb_read_frames), 5);
  assert.ok(Math.abs(fast.height / scale - stage) < 3);
  assert.deepEqual(page.problems, []);
});

test('a recording is stopped by the key, and what was taken is saved', async () => {
  const page = await openLog();
  await page.keyboard.press('m');
  await page.locator('.record-dialog [type=submit]').click();
  await page.waitForSelector('[data-action=record]:has-text("Stop 0.2")');
  const download = page.waitForEvent('download');
  await page.keyboard.press('m');
  const frames = Number(probed(await (await download).path()).nb_read_frames);
  assert.ok(frames >= 5 && frames < 50, `${frames} frames`);
  assert.equal(await text(page, '[data-action=record]'), 'Record');
  await drawn(page);
  assert.deepEqual(page.problems, []);
});

test('where the browser gives a page no encoder, as over the network, a live run is recorded all the same', async () => {
  // http://monitor.test is not this machine, and has no encryption.
  const page = await openMock(browser, 'live');
  assert.equal(await page.evaluate(() => typeof VideoEncoder), 'undefined');
  await page.evaluate(() => window.server.advance('walk', 50));
  await page.waitForFunction(() => window.monitor.time > 0.9);
  await page.locator('[data-action=record]').click();
  assert.ok(!(await page.locator('.record-dialog [name=from]').isVisible()));
  await page.locator('.record-dialog [type=submit]').click();
  await page.waitForSelector('[data-action=record]:has-text("Stop ")');
  // How long the browser takes to encode a picture is the machine's affair; it hands out what it has every second.
  const parts = () => page.evaluate(() => window.monitor.recorder.recording.film.parts.filter(({ size }) => size).length);
  while ((await parts()) < 2) await page.evaluate(() => window.server.advance('walk', 1));
  const download = page.waitForEvent('download');
  await page.locator('[data-action=record]').click();
  const file = await download;
  assert.match(file.suggestedFilename(), /^walk_1\.0s\.webm$/);
  const video = probed(await file.path());
  // How many pictures there are is the machine's affair.
  assert.ok(video.times.at(-1) > video.times[0], `${video.times}`);
  assert.deepEqual(page.problems, []);
});

test('a recording of which the browser has encoded nothing is told, and no file is saved', async () => {
  const page = await openMock(browser, 'live');
  await page.evaluate(() => {
    // An encoder that never gets to its first picture.
    window.MediaRecorder = class extends EventTarget {
      static isTypeSupported = () => true;
      mimeType = 'video/webm';
      constructor(stream) {
        super();
        this.stream = stream;
      }
      start() {}
      stop() {
        this.dispatchEvent(new Event('stop'));
      }
    };
    window.server.advance('walk', 50);
  });
  await page.waitForFunction(() => window.monitor.time > 0.9);
  let saved = false;
  page.on('download', () => (saved = true));
  await page.locator('[data-action=record]').click();
  await page.locator('.record-dialog [type=submit]').click();
  await page.waitForSelector('[data-action=record]:has-text("Stop ")');
  await page.locator('[data-action=record]').click();
  await page.waitForSelector('.notice:has-text("The recording failed: the browser has encoded no picture")');
  assert.ok(!saved);
  assert.deepEqual(page.problems, []);
});
