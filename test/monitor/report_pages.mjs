// The pages of `report`, `compare` and `build` in a browser: what is read, where it stands, and in which colours; and that a role has its
// colour in pictures and in the monitor, too.
import assert from 'node:assert/strict';
import { execFileSync, spawnSync } from 'node:child_process';
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, describe, test } from 'node:test';
import { drawn, keepShot, launch, newPage, pixelsOf, THEMES } from './browser.mjs';
import { Demo, MODEL, PROGRAM } from './demo.mjs';

const MORPHBUS = join(process.env.MORPHBUS_BIN, 'morphbus');
/** A laptop, and a tablet on which two plots do not stand beside each other. */
const WIDTHS = [1280, 800];
/** What the Web Content Accessibility Guidelines demand of text. */
const READABLE = 4.5;

const demo = new Demo();
let browser, log;
/** A run at whose end only five modules have found their roles: its log, and which these are. */
const early = {};

/** The file of a page. */
const file = (name) => join(demo.folder, `${name}.html`);

before(async () => {
  // One of two runs is lifted for a moment, and comes down more than 100 mm from where the other one is.
  const commands = join(demo.folder, 'commands');
  writeFileSync(commands, '150 push m5 UP 45 0.3\n');
  log = demo.record('quadruped', 'calm', 4);
  const b = join(demo.folder, 'pushed.log');
  const options = ['--run', 'pushed', '--seconds', '4', '--inproc', '--log', b, '--commands', commands];
  demo.json('run', MODEL, PROGRAM, '--robot', 'equivalent_quadruped', ...options);
  execFileSync(MORPHBUS, ['report', log, '-o', file('report')], { stdio: ['ignore', 'ignore', 'inherit'] });
  const compared = spawnSync(MORPHBUS, ['compare', log, b, '--report', file('compare')], { encoding: 'utf8' });
  assert.equal(compared.status, 1, compared.stderr);
  execFileSync(MORPHBUS, ['build', MODEL, '--robot', 'quadruped', '-o', file('build')], { stdio: ['ignore', 'ignore', 'inherit'] });
  early.log = join(demo.folder, 'early.log');
  const short = ['--run', 'early', '--seconds', '0.3', '--inproc', '--log', early.log];
  early.roles = Object.values(demo.json('run', MODEL, PROGRAM, '--robot', 'quadruped', ...short).roles).filter((role) => role);
  assert.equal(early.roles.length, 5);
  execFileSync(MORPHBUS, ['compare', early.log, early.log, '--report', file('early')], { stdio: ['ignore', 'ignore', 'inherit'] });
  browser = await launch();
});

after(async () => {
  await browser?.close();
  await demo.end();
});

/** Opens a page of a file. */
async function open(name, width = 1280, theme = 'light') {
  const page = await newPage(browser, { width, height: 900 }, theme);
  await page.goto(`file://${file(name)}`);
  return page;
}

/** Red, green and blue, 0…255, of "rgb(…)" or "#rrggbb". */
const partsOf = (colour) =>
  colour.startsWith('#') ? [1, 3, 5].map((i) => parseInt(colour.slice(i, i + 2), 16)) : colour.match(/\d+(\.\d+)?/g).map(Number);

/** Two colours are the same but for how they were rounded. */
function assertAlike(one, other, what) {
  const [p, q] = [partsOf(one), partsOf(other)];
  for (let i = 0; i < 3; i++) assert.ok(Math.abs(p[i] - q[i]) <= 1, `${what}: ${one} and ${other}`);
}

/** Contrast of two colours (WCAG 2.2). */
function contrast(one, other) {
  const luminance = (colour) => {
    const [r, g, b] = partsOf(colour).map((c) => (c / 255 <= 0.04045 ? c / 255 / 12.92 : ((c / 255 + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const [low, high] = [luminance(one), luminance(other)].sort((x, y) => x - y);
  return (high + 0.05) / (low + 0.05);
}

/** Colours by role, of a key or legend of which each entry, a span, has a coloured square. */
const colorsOf = (page, entries, square) =>
  page.evaluate(
    ([all, one]) =>
      Object.fromEntries(
        [...document.querySelectorAll(all)].map((s) => [s.textContent, getComputedStyle(s.querySelector(one)).backgroundColor]),
      ),
    [entries, square],
  );

/** The colours of the key below the pictures. */
const keyOf = (page) => colorsOf(page, '.keys span', 'i');

/** The key of the page of `report`. */
async function reportKey() {
  const page = await open('report');
  const key = await keyOf(page);
  await page.close();
  return key;
}

describe('pages of report, compare and build', () => {
  for (const name of ['report', 'compare', 'build']) {
    test(`${name} has no number with an exponent`, async () => {
      const page = await open(name);
      const text = await page.evaluate(() => document.body.innerText + [...document.querySelectorAll('svg text')].map((t) => t.textContent));
      assert.deepEqual(text.match(/\b\d(\.\d+)?e[+-]\d+/g), null);
      await page.close();
    });

    for (const width of WIDTHS)
      for (const theme of THEMES)
        test(`${name} is whole and can be read at ${width} pixels, ${theme}`, async () => {
          const page = await open(name, width, theme);
          const wide = await page.evaluate(() => document.documentElement.scrollWidth - window.innerWidth);
          assert.ok(wide <= 0, `the page is ${wide} pixels wider than the window`);
          // Cards and pictures are as dark or light as the page's ground is.
          const letters = await page.evaluate(() => getComputedStyle(document.body).color);
          const cards = await page.evaluate(() =>
            [...document.querySelectorAll('.card, figure, .scroll, .banner, .notes')].map((e) => getComputedStyle(e).backgroundColor),
          );
          for (const card of new Set(cards)) assert.ok(contrast(letters, card) >= READABLE, `${letters} on ${card}`);
          const picture = await pixelsOf(page, 'figure img >> nth=0');
          const corner = [...picture.at(3, 3)];
          assert.ok(contrast(letters, `rgb(${corner})`) >= READABLE, `picture's ground ${corner}`);
          await keepShot(page, `${name}_${width}_${theme}`, { fullPage: true });
          await page.close();
        });
  }

  test('a sheet is light on paper, whatever the screen is', async () => {
    const page = await open('build', 1280, 'dark');
    await page.emulateMedia({ media: 'print', colorScheme: 'dark' });
    assert.deepEqual(partsOf(await page.evaluate(() => getComputedStyle(document.body).backgroundColor)).slice(0, 3), [255, 255, 255]);
    const letters = await page.evaluate(() => getComputedStyle(document.body).color);
    assert.ok(contrast(letters, '#ffffff') >= READABLE, letters);
    const picture = await pixelsOf(page, 'figure img >> nth=0');
    assert.ok(contrast(letters, `rgb(${[...picture.at(3, 3)]})`) >= READABLE);
    await page.close();
  });

  test('the largest difference can be read', async () => {
    const page = await open('compare');
    const text = await page.locator('.banner .figures').innerText();
    const [, position] = text.match(/^largest difference in position (\d+\.\d{3}) mm, in rotation \d+\.\d{3} deg, /) ?? [];
    assert.ok(Number(position) > 100, text);
    await page.close();
  });

  test('letters on the bars of roles can be read, and each bar has the colour of its role', async () => {
    const page = await open('report');
    const key = await keyOf(page);
    const bars = await page.evaluate(() =>
      [...document.querySelectorAll('.bar-text')].map((text) => {
        const rect = text.previousElementSibling;
        return { role: text.textContent, ink: getComputedStyle(text).fill, ground: getComputedStyle(rect).fill };
      }),
    );
    assert.ok(bars.length >= 9, `${bars.length} bars`);
    for (const { role, ink, ground } of bars) {
      assert.ok(contrast(ink, ground) >= READABLE, `${role}: ${ink} on ${ground}`);
      assert.equal(ground, key[role], role);
    }
    await page.close();
  });

  test('a role has one colour in report and compare, of other runs, too', async () => {
    const key = await reportKey();
    for (const [name, roles] of [['compare', 9], ['early', 6]]) {
      const page = await open(name);
      const other = await keyOf(page);
      assert.equal(Object.keys(other).length, roles, name);
      for (const [role, colour] of Object.entries(other)) assert.equal(key[role], colour, `${role} in ${name}`);
      await page.close();
    }
  });

  test('a role has one colour in report and draw, of another run', async () => {
    const picture = join(demo.folder, 'drawn.svg');
    execFileSync(MORPHBUS, ['draw', early.log, '--at', '0.3', '-o', picture], { stdio: ['ignore', 'ignore', 'inherit'] });
    const page = await newPage(browser);
    await page.goto(`file://${picture}`);
    // Names are outlines there; the squares of its key stand in the order of the names, from the left, row by row.
    const colours = await page.evaluate(() =>
      [...document.querySelectorAll('path')]
        .map((path) => ({ box: path.getBBox(), fill: getComputedStyle(path).fill }))
        .filter(({ box }) => Math.abs(box.width - 14) < 0.1 && Math.abs(box.height - 14) < 0.1)
        .sort((p, q) => Math.round(p.box.y - q.box.y) || p.box.x - q.box.x)
        .map(({ fill }) => fill),
    );
    const key = await reportKey();
    const roles = ['(no role)', ...early.roles.sort()];
    assert.equal(colours.length, roles.length);
    for (const [i, role] of roles.entries()) assertAlike(colours[i], key[role], role);
    await page.close();
  });

  test('a role has one colour in report and in the view, the lists and the plots of the monitor', async () => {
    const key = await reportKey();
    const monitor = await demo.monitor([log]);
    const page = await newPage(browser);
    await page.goto(monitor.url);
    await page.waitForFunction(() => window.monitor?.session.runs[0]?.poses.endTime > 3);
    await page.evaluate(() => window.monitor.seek(3));
    const named = ['FrontLeftUpperHalf', 'BackRightLowerHalf', 'Junction'];
    const roles = () => page.evaluate(() => document.querySelectorAll(".roles-legend > span").length);
    for (const limit = Date.now() + 120_000; (await roles()) < 9;) {
      assert.ok(Date.now() < limit, 'the legend of the view has no nine roles');
      await drawn(page);
    }
    const legend = await colorsOf(page, '.roles-legend > span', '.swatch');
    for (const role of Object.keys(legend)) assert.equal(legend[role], key[role], role);
    for (const role of named) assert.ok(legend[role], `${role} is not in ${Object.keys(legend)}`);

    // What the view draws links with, by role; and lines of joints, one plot a module.
    const { links, lines } = await page.evaluate(() => {
      const [run] = window.monitor.session.runs;
      const roleOf = (module) => run.stateAt(module, 3).role;
      const [robot] = window.monitor.scene.view.robots;
      for (const module of run.moduleNames) window.monitor.plots.add([`${run.name}|joints|${module}.joint_1 position`]);
      return {
        links: robot.meshes.map((mesh) => [roleOf(robot.moduleOf(mesh)), `#${mesh.material.color.getHexString()}`]),
        lines: run.moduleNames.map(roleOf),
      };
    });
    assert.equal(links.length, 27);
    for (const [role, colour] of links) assertAlike(colour, key[role], `${role} in the view`);
    // A plot is there as soon as its line has values.
    await page.waitForFunction((n) => document.querySelectorAll('.stroke').length >= n, lines.length);
    const strokes = await page.evaluate(
      (n) => [...document.querySelectorAll('.stroke')].slice(-n).map((s) => getComputedStyle(s).borderTopColor),
      lines.length,
    );
    assert.equal(strokes.length, lines.length);
    for (const [i, role] of lines.entries()) assertAlike(strokes[i], key[role], `${role} in a plot`);
    assert.deepEqual(page.problems, []);
    await page.close();
  });

  test('the table of roles is neither clipped at 1280 pixels nor breaks a word', async () => {
    const page = await open('compare', 1280);
    const clipped = await page.evaluate(() => {
      const boxes = [...document.querySelectorAll('.scroll')];
      const box = boxes.find((b) => b.previousElementSibling?.textContent === 'Largest differences by role');
      return box.scrollWidth - box.clientWidth;
    });
    assert.ok(clipped <= 0, `${clipped} pixels are clipped`);
    // Where a line ends inside a name, the next one begins a word of it.
    const broken = await page.evaluate(() => {
      const found = [];
      for (const cell of document.querySelectorAll('table.wide td:first-child, table.wide th')) {
        const walker = document.createTreeWalker(cell, NodeFilter.SHOW_TEXT);
        for (let node = walker.nextNode(); node; node = walker.nextNode()) {
          const topOf = (i) => {
            const range = document.createRange();
            range.setStart(node, i);
            range.setEnd(node, i + 1);
            return range.getBoundingClientRect().top;
          };
          for (let i = 1; i < node.length; i++)
            if (/[a-z]/.test(node.data[i]) && /\w/.test(node.data[i - 1]) && topOf(i) > topOf(i - 1) + 4) found.push(cell.textContent);
        }
      }
      return found;
    });
    assert.deepEqual(broken, []);
    await page.close();
  });

  test('names of marks do not cover each other', async () => {
    const page = await open('compare');
    const { plots, covered } = await page.evaluate(() => {
      let several = 0;
      const found = [];
      for (const svg of document.querySelectorAll('svg')) {
        const texts = [...svg.querySelectorAll('.mark-text')];
        const boxes = texts.map((t) => t.getBoundingClientRect());
        if (boxes.length > 1) several++;
        for (let i = 0; i < boxes.length; i++)
          for (let k = 0; k < i; k++) {
            const [p, q] = [boxes[i], boxes[k]];
            // Boxes of lines have room above and below the letters.
            const over = Math.min(p.bottom, q.bottom) - Math.max(p.top, q.top);
            if (p.left < q.right && q.left < p.right && over > p.height / 3) found.push(`${texts[i].textContent} and ${texts[k].textContent}`);
          }
      }
      return { plots: several, covered: found };
    });
    assert.ok(plots > 0, 'no plot has two marks');
    assert.deepEqual(covered, []);
    await page.close();
  });

  test('paths of feet are above the ground', async () => {
    const page = await open('compare');
    // Heights of the lowest points of both lines, by the scale of the plot's ticks.
    const lowest = await page.evaluate(() =>
      [...document.querySelectorAll('section')]
        .filter((section) => section.querySelector('h2')?.textContent === 'Paths from the side')
        .flatMap((section) => [...section.querySelectorAll('svg')])
        .map((svg) => {
          const ticks = [...svg.querySelectorAll(".tick[text-anchor='end']")].map((t) => [Number(t.getAttribute('y')), Number(t.textContent)]);
          const [[y0, h0], [y1, h1]] = [ticks[0], ticks.at(-1)];
          const lines = [...svg.querySelectorAll('path.line-a, path.line-b')].map((line) => line.getBBox());
          const bottom = Math.max(...lines.map((box) => box.y + box.height));
          return h0 + ((bottom - y0) * (h1 - h0)) / (y1 - y0);
        }),
    );
    assert.equal(lowest.length, 4);
    // The middle of a foot's link stays above the ground by its half width of 17 mm or so.
    for (const height of lowest) assert.ok(height > 0.005 && height < 0.03, `${lowest}`);
    await page.close();
  });

  test('what differs first is marked in both pictures', async () => {
    const page = await open('compare');
    const captions = await page.locator('figure figcaption').allTextContents();
    const marked = captions.filter((text) => text.includes('at the first divergence'));
    assert.equal(marked.length, 2);
    for (const [i, text] of captions.entries()) {
      if (!marked.includes(text)) continue;
      assert.match(text, /! is joint velocity of \w+ \w+/);
      const picture = await pixelsOf(page, `figure:has(figcaption) img >> nth=${i}`);
      // The mark's red ring is in no role's colour.
      let red = 0;
      for (let y = 0; y < picture.height; y++)
        for (let x = 0; x < picture.width; x++) {
          const [r, g, b] = picture.at(x, y);
          if (Math.abs(r - 207) + Math.abs(g - 33) + Math.abs(b - 46) < 12) red++;
        }
      assert.ok(red > 20, `${text}: ${red} pixels are the mark's`);
    }
    await page.close();
  });
});
