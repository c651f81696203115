// The page of `sweep report` in a browser: its plots, what a reader chooses in them, and its table.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, describe, test } from 'node:test';
import { keepShot, launch, newPage, SIZES, THEMES } from './browser.mjs';
import { Demo } from './demo.mjs';

const MORPHBUS = join(process.env.MORPHBUS_BIN, 'morphbus');
const MODELS = join(process.env.MORPHBUS_SOURCE, 'models');

const demo = new Demo();
let browser;

before(async () => {
  writeFileSync(
    join(demo.folder, 's.toml'),
    `model = "${MODELS}/snakes.m3l"
program = "${MODELS}/programs/snake.dyn"
robot = "mtran_snake4"
seconds = 2
friction = [0.4, 0.6, 0.8]
loss = [0, 0.1]
set."MTRAN.joint_1.torque" = [1.0, 1.9]
`,
  );
  const run = { cwd: demo.folder, env: demo.environment, stdio: ['ignore', 'ignore', 'inherit'] };
  execFileSync(MORPHBUS, ['sweep', 's.toml'], run);
  execFileSync(MORPHBUS, ['sweep', 'report', 's.toml', '-o', 's.html', '--best', '2'], run);
  writeFileSync(
    join(demo.folder, 'o.toml'),
    `model = "${MODELS}/molecube.m3l"
program = "${MODELS}/programs/arm.dyn"
robot = "arm"
seconds = 2
maximise = "path_length"
minimise = "energy"
subject_to = "path_length > 100 mm"
population = 12
generations = 6
[search.MOLECUBE.swivel]
speed = {from = 0.2, to = 6}
torque = {from = 0.5, to = 20, log = true}
`,
  );
  execFileSync(MORPHBUS, ['optimise', 'o.toml'], run);
  execFileSync(MORPHBUS, ['sweep', 'report', 'o.toml', '-o', 'o.html', '--best', '1'], run);
  browser = await launch();
});

after(async () => {
  await browser?.close();
  await demo.end();
});

async function open(size = SIZES[0], theme = 'light', file = 's.html') {
  const page = await newPage(browser, size, theme);
  await page.goto(`file://${join(demo.folder, file)}`);
  return page;
}

/** How many pixels of a plot are not its ground; a plot may be several canvases, one over the other. */
const painted = (page, chart) =>
  page.locator('.chart').nth(chart).evaluate((plot) => {
    let count = 0;
    for (const canvas of plot.querySelectorAll('canvas')) {
      const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
      for (let at = 3; at < data.length; at += 4) count += data[at] > 0 ? 1 : 0;
    }
    return count;
  });

const bodyRows = (page) => page.locator('#plots tbody tr').count();

describe('the page of a sweep', () => {
  for (const size of SIZES)
    for (const theme of THEMES)
      test(`is whole at ${size.width} pixels, ${theme}`, async () => {
        const page = await open(size, theme);
        assert.equal(await page.locator('.chart').count(), 3);
        for (let chart = 0; chart < 3; chart++) assert.ok((await painted(page, chart)) > 1000, `plot ${chart}`);
        const wide = await page.evaluate(() => document.documentElement.scrollWidth - window.innerWidth);
        assert.ok(wide <= 0, `the page is ${wide} pixels wider than the window`);
        assert.deepEqual(page.problems, []);
        await keepShot(page, `sweep_${size.width}_${theme}`, { fullPage: true });
        await page.close();
      });

  test('its table is sorted by any column, and a row has its command', async () => {
    const page = await open();
    assert.equal(await bodyRows(page), 12);
    const column = async (n) => (await page.locator(`#plots tbody tr td:nth-child(${n})`).allInnerTexts()).map(Number);
    const places = await column(1);
    await page.getByRole('button', { name: 'friction' }).click();
    assert.deepEqual(await column(2), [...Array(4).fill(0.4), ...Array(4).fill(0.6), ...Array(4).fill(0.8)]);
    await page.getByRole('button', { name: 'friction' }).click();
    assert.equal((await column(2))[0], 0.8);
    await page.getByRole('button', { name: /^row/ }).click();
    assert.deepEqual(await column(1), places.slice().sort((a, b) => a - b));
    await page.locator('#plots tbody tr').nth(4).click();
    assert.equal(await page.locator('#plots p code').innerText(), 'morphbus sweep rerun s.sweep.db 5 --log row-5.log');
    assert.deepEqual(page.problems, []);
    await page.close();
  });

  test('a range of an axis chooses the rows of the table', async () => {
    const page = await open();
    const chart = page.locator('.chart').nth(2);
    await chart.scrollIntoViewIfNeeded();
    const box = await chart.boundingBox();
    // The first axis is friction, from 0.4 below to 0.8 above; the upper third of it has the largest alone.
    const [top, bottom, x] = [box.y + 48, box.y + box.height - 64, box.x + 60];
    await page.mouse.move(x, top - 2);
    await page.mouse.down();
    await page.mouse.move(x, top + (bottom - top) / 6, { steps: 5 });
    await page.mouse.move(x, top + (bottom - top) / 3, { steps: 5 });
    await page.mouse.up();
    await page.waitForFunction(() => document.querySelectorAll('#plots tbody tr').length === 4);
    assert.match(await page.locator('#plots > p').innerText(), /^4 of 12 rows are chosen/);
    assert.deepEqual(page.problems, []);
    await page.close();
  });

  for (const [size, theme] of [
    [SIZES[0], 'light'],
    [SIZES[1], 'dark'],
  ])
    test(`of a search it shows how that went, at ${size.width} pixels`, async () => {
      const page = await open(size, theme, 'o.html');
      assert.deepEqual((await page.locator('#plots h3').allInnerTexts()).slice(0, 3), [
        'The most so far: path_length',
        'The least so far: energy',
        'Nothing is better than the line in both',
      ]);
      for (let chart = 0; chart < 3; chart++) assert.ok((await painted(page, chart)) > 1000, `plot ${chart}`);
      assert.deepEqual(page.problems, []);
      await keepShot(page, `search_${size.width}_${theme}`, { fullPage: true });
      await page.close();
    });

  test('another choice draws another plot', async () => {
    const page = await open();
    const shot = () => page.locator('.chart canvas').nth(0).evaluate((canvas) => canvas.toDataURL());
    const before = await shot();
    await page.getByLabel('across').first().selectOption('cost_of_transport');
    assert.notEqual(await shot(), before);
    await page.close();
  });
});
