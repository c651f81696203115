// What the tests in a browser share: Debian's Chromium driven by Playwright, pictures of pages, and their pixels.
import { mkdirSync, readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';
import { inflateSync } from 'node:zlib';

// The folder in which the page was built has the packages.
const require = createRequire(join(process.env.MORPHBUS_PAGE_WORK, 'package.json'));
const { chromium } = require('playwright-core');

const SHOTS = process.env.MORPHBUS_SHOTS;
/** How long anything may take, milliseconds: a limit for machines that are busy, never an expectation. */
const WAIT = 120_000;
/** The two widths at which the page must be readable, and both themes. */
export const SIZES = [
  { width: 1280, height: 800 },
  { width: 400, height: 860 },
];
export const THEMES = ['light', 'dark'];

/** A browser that draws by software, as every machine can. */
export async function launch() {
  return chromium.launch({
    executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
    headless: true,
    args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
  });
}

/** A new page; what goes wrong in its scripts is in `page.problems`. */
export async function newPage(browser, size = SIZES[0], colorScheme = 'light') {
  const page = await browser.newPage({ viewport: size, colorScheme });
  page.setDefaultTimeout(WAIT);
  page.problems = [];
  page.on('pageerror', (error) => page.problems.push(error.stack ?? error.message));
  page.on('console', (message) => {
    // A server that is away is the subject of some tests.
    if (message.type() === 'error' && !/WebSocket|ERR_CONNECTION/.test(message.text()))
      page.problems.push(message.text());
  });
  return page;
}

/** Opens the page with the server inside (page/mock_main.ts). */
export async function openMock(browser, kind, size, colorScheme) {
  const page = await newPage(browser, size, colorScheme);
  const types = { html: 'text/html', js: 'text/javascript', css: 'text/css', txt: 'text/plain' };
  await page.route('http://monitor.test/**', (route) => {
    const path = new URL(route.request().url()).pathname;
    const file = path === '/' ? 'index.html' : path.slice(1);
    route.fulfill({
      body: readFileSync(join(process.env.MORPHBUS_PAGE_WORK, 'mock', file)),
      contentType: types[file.split('.').pop()],
    });
  });
  await page.goto(`http://monitor.test/?case=${kind}`);
  await page.waitForFunction(() => window.monitor?.session.state === 'connected');
  return page;
}

/** Waits until what is known now is drawn: the view with the next frame, lists within their interval. */
export async function drawn(page) {
  await page.evaluate(
    () =>
      new Promise((done) => {
        let frames = 0;
        const began = performance.now();
        const next = () => (++frames > 3 && performance.now() - began > 450 ? done() : requestAnimationFrame(next));
        requestAnimationFrame(next);
      }),
  );
}

/** The instant that is shown, seconds of sim time. */
export const time = (page) => page.evaluate(() => window.monitor.time);
export const text = (page, selector) => page.locator(selector).innerText();

/** Opens a live run of the mock that has run for so many ticks, seen by a camera that stands still, always as finely. */
export async function openLive(browser, ticks, size, theme) {
  const page = await openMock(browser, 'live', size, theme);
  await page.evaluate((n) => window.server.advance('walk', n), ticks);
  await page.waitForFunction((n) => Math.round(window.monitor.time * 50) === n - 1, ticks);
  await page.evaluate(() => {
    const { scene } = window.monitor;
    scene.view.options.adaptive = false;
    for (const flag of ['follow', 'trails']) if (scene.view.options[flag]) scene.toggle(flag);
  });
  await drawn(page);
  return page;
}

/** Keeps a picture of the page as output of the test; with `fullPage` in a window that is as high as the page. */
export async function keepShot(page, name, { fullPage = false } = {}) {
  mkdirSync(SHOTS, { recursive: true });
  const size = page.viewportSize();
  if (fullPage) {
    const height = await page.evaluate(() => document.documentElement.scrollHeight);
    await page.setViewportSize({ width: size.width, height });
    await drawn(page);
  }
  await page.screenshot({ path: join(SHOTS, `${name}.png`) });
  if (fullPage) await page.setViewportSize(size);
}

/** The pixels of an element: width, height, and RGB bytes. */
export async function pixelsOf(page, selector) {
  return decodePng(await page.locator(selector).screenshot({ animations: 'disabled' }));
}

/** Reads a PNG as Chromium writes it: 8 bits a channel, RGB or RGBA, not interlaced. */
export function decodePng(bytes) {
  const width = bytes.readUInt32BE(16);
  const height = bytes.readUInt32BE(20);
  const channels = bytes[25] === 6 ? 4 : 3;
  const parts = [];
  for (let at = 8; at < bytes.length;) {
    const size = bytes.readUInt32BE(at);
    if (bytes.toString('latin1', at + 4, at + 8) === 'IDAT') parts.push(bytes.subarray(at + 8, at + 8 + size));
    at += size + 12;
  }
  const raw = inflateSync(Buffer.concat(parts));
  const stride = width * channels;
  const rows = Buffer.alloc(stride * height);
  for (let y = 0; y < height; y++) {
    const filter = raw[y * (stride + 1)];
    for (let x = 0; x < stride; x++) {
      const left = x >= channels ? rows[y * stride + x - channels] : 0;
      const up = y > 0 ? rows[(y - 1) * stride + x] : 0;
      const corner = y > 0 && x >= channels ? rows[(y - 1) * stride + x - channels] : 0;
      const estimate = left + up - corner;
      const [a, b, c] = [Math.abs(estimate - left), Math.abs(estimate - up), Math.abs(estimate - corner)];
      const paeth = a <= b && a <= c ? left : b <= c ? up : corner;
      const predicted = [0, left, up, (left + up) >> 1, paeth][filter];
      rows[y * stride + x] = (raw[y * (stride + 1) + 1 + x] + predicted) & 255;
    }
  }
  return { width, height, at: (x, y) => rows.subarray(y * stride + x * channels, y * stride + x * channels + 3) };
}

/** The places at which two pictures of one size differ visibly. */
export function changedPixels(a, b) {
  const places = [];
  for (let y = 0; y < a.height; y++) {
    for (let x = 0; x < a.width; x++) {
      const [p, q] = [a.at(x, y), b.at(x, y)];
      if (Math.abs(p[0] - q[0]) + Math.abs(p[1] - q[1]) + Math.abs(p[2] - q[2]) > 24) places.push([x, y]);
    }
  }
  return places;
}

/** By robot the box, in pixels of the view, in which its modules lie now, with `room` around their middles. */
export async function robotBoxes(page, room) {
  return page.evaluate((margin) => {
    const { view } = window.monitor.scene;
    const canvas = view.renderer.domElement;
    return view.robots.map((robot) => {
      const places = [...robot.modulePlaces().values()].map((place) => place.clone().project(view.camera));
      const x = places.map((p) => ((p.x + 1) / 2) * canvas.clientWidth);
      const y = places.map((p) => ((1 - p.y) / 2) * canvas.clientHeight);
      return {
        left: Math.min(...x) - margin,
        right: Math.max(...x) + margin,
        top: Math.min(...y) - margin,
        bottom: Math.max(...y) + margin,
      };
    });
  }, room);
}

export function inside([x, y], box) {
  return x >= box.left && x <= box.right && y >= box.top && y <= box.bottom;
}

/** How many points a plot's lines have that were drawn last, by plot. */
export async function plotPoints(page) {
  return page.evaluate(() => window.monitor.plots.views.map((view) => view.plot.drawnPoints));
}
