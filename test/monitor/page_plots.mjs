// The page in a browser against a server inside it: how fields are found, and plots of one run and of two.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { after, afterEach, before, test } from 'node:test';
import { drawn, keepShot, launch, openLive, openMock, robotBoxes, text, time } from './browser.mjs';

let browser;
before(async () => (browser = await launch()));
after(async () => browser.close());
// A page that is left behind would go on drawing.
afterEach(async () => Promise.all(browser.contexts().map((context) => context.close())));

const live = (ticks, size, theme) => openLive(browser, ticks, size, theme);

/** The stretch of time that the plots are drawn over. */
const stretch = (page) =>
  page.evaluate(() => {
    const { plot } = window.monitor.plots.views[0];
    return [plot.from, plot.to];
  });

/** Waits until the plots are drawn over this stretch of time. */
const stretches = (page, from, to) =>
  page.waitForFunction(
    ([a, b]) => {
      const { plot } = window.monitor.plots.views[0];
      return Math.abs(plot.from - a) < 0.2 && Math.abs(plot.to - b) < 0.2;
    },
    [from, to],
  );

/** Where a share of the time lies on the first plot: its x by the share, and a height within it. */
async function onPlot(page) {
  const box = await page.locator('.plot-canvas').first().boundingBox();
  return { at: (share) => box.x + 54 + (box.width - 64) * share, y: box.y + box.height / 2 };
}

test('any field is found by role and label, and plotted under that name', async () => {
  const page = await live(150);
  await page.locator('h1').click();
  await page.keyboard.press('p');
  const search = page.locator('.picker input[type=search]');
  const first = () => page.locator('.field .what').first().innerText();
  // By label, by a part of the role's name, and by label and coordinate: each as people call it.
  await search.fill('ankle velocity');
  assert.match(await text(page, '.picker [role=status]'), /^5 of \d+ fields/);
  await search.fill('leg4');
  assert.match(await first(), /^Leg4/);
  await search.fill('foot y');
  assert.match(await first(), /^\w+\.foot \(m\d\/tip\) y$/);
  // A part without a label is found by its module's role, and the model's own names do as well.
  await search.fill('leg3 base x');
  assert.equal(await first(), 'Leg3 (m3/base) x');
  await keepShot(page, 'picker');
  await search.fill('m3 velocity');
  await page.locator('.field').first().click();
  await page.keyboard.press('Enter');
  await page.waitForFunction(
    () => window.monitor.plots.views.length === 3 && window.monitor.plots.views[2].plot.drawnPoints === 150,
  );
  assert.match(await page.locator('.legend').last().innerText(), /Leg3\.ankle \(m3\.joint_1\) velocity\s*11\.459 °\/s/);
});

test('plots zoom and move, show what is under the pointer, derive, and are saved', async () => {
  const page = await live(1000);
  const shown = () => stretch(page);
  const shows = (from, to) => stretches(page, from, to);
  // The cursor stays inside the window while time moves on.
  const [begin, end] = await shown();
  assert.ok(end > 19.98 + 0.3 && Math.abs(end - begin - 10) < 1e-6, `${begin} to ${end}`);
  const { at, y } = await onPlot(page);
  // The wheel zooms about the pointer.
  await page.mouse.move(at(0.5), y);
  await page.mouse.wheel(0, -Math.log(2) / 0.0015);
  await shows(begin + 2.5, begin + 7.5);
  // A drag chooses a stretch of it, and one with Shift moves it.
  await page.mouse.move(at(0.2), y);
  await page.mouse.down();
  await page.mouse.move(at(0.6), y, { steps: 4 });
  await page.mouse.up();
  await shows(begin + 3.5, begin + 5.5);
  await page.keyboard.down('Shift');
  await page.mouse.move(at(0.5), y);
  await page.mouse.down();
  await page.mouse.move(at(0), y, { steps: 4 });
  await page.mouse.up();
  await page.keyboard.up('Shift');
  await shows(begin + 4.5, begin + 6.5);
  // All values under the pointer, always with the same decimals; the instant that is shown has not moved.
  await page.mouse.move(at(0.25), y);
  await drawn(page);
  const values = await page.locator('.plot').first().locator('.value').allInnerTexts();
  const hover = await page.evaluate(() => window.monitor.plots.hover);
  assert.ok(Math.abs(hover - (begin + 5)) < 0.2, `${hover}`);
  values.forEach((value, i) => {
    assert.match(value, /^-?\d+\.\d\d °$/);
    const angle = (0.6 * Math.sin(Math.PI * (Math.floor(hover * 50 + 1e-6) / 50) + i) * 180) / Math.PI;
    assert.ok(Math.abs(parseFloat(value) - angle) < 0.006, `${value} is not ${angle}`);
  });
  assert.equal(await time(page), 19.98);
  await keepShot(page, 'plots-zoomed');
  await page.locator('h1').click();
  await page.keyboard.press('0');
  await shows(begin, end);
  // How fast an angle changes, and how fast a link moves, which is as the mock has it: 5 cm/s.
  const entry = page.locator('.plot').first().locator('.entry').first();
  await entry.hover();
  await entry.locator('button:has-text("d/dt")').click();
  await page.waitForSelector('.entry:has-text("d/dt Head.ankle (m1.joint_1) position")');
  assert.match(await entry.locator('.value').innerText(), / °\/s$/);
  await page.locator('[data-action=add-plot]').click();
  await page.locator('.picker input[type=search]').fill('head base speed');
  await page.locator('.field').first().click();
  await page.locator('.picker [type=submit]').click();
  await page.waitForFunction(() => window.monitor.plots.views[2]?.plot.drawnPoints > 0);
  assert.match(await page.locator('.legend').last().innerText(), /Head \(m1\/base\) speed\s*0\.05000* m\/s/);
  // What is shown is saved, as values and as a picture.
  const save = async (name) => {
    const download = page.waitForEvent('download');
    await page.locator('.plot').nth(1).locator(`[data-action=plot-${name}]`).click();
    return readFileSync(await (await download).path());
  };
  const rows = (await save('table')).toString().trim().split('\n');
  assert.equal(rows[0].split(',')[1], 'Head.foot (m1/tip) y (m)');
  const [first, second] = await shown();
  assert.ok(Math.abs(rows.length - 1 - (Math.min(second, 19.98) - first) * 50) < 3, `${rows.length} rows`);
  assert.equal((await save('picture')).subarray(1, 4).toString(), 'PNG');
  assert.deepEqual(page.problems, []);
});

test('fingers move and zoom plots, select modules and turn the view', async () => {
  const page = await live(1000);
  const client = await page.context().newCDPSession(page);
  /** All fingers that are on the screen now; none ends the touch. */
  const touch = (type, ...fingers) =>
    client.send('Input.dispatchTouchEvent', { type, touchPoints: fingers.map(([x, y], id) => ({ x, y, id })) });
  const shows = (from, to) => stretches(page, from, to);
  const [begin, end] = await stretch(page);
  const { at, y } = await onPlot(page);
  // One finger takes the time under it along; the first pixels may be taken for a tap.
  await touch('touchStart', [at(0.25), y]);
  for (const share of [0.35, 0.45, 0.5]) await touch('touchMove', [at(share), y]);
  await touch('touchEnd');
  await shows(begin - 2.5, end - 2.5);
  // Of two that go apart to twice their distance half of the time is left between them.
  await touch('touchStart', [at(0.4), y], [at(0.6), y]);
  for (const spread of [0.13, 0.17, 0.2]) await touch('touchMove', [at(0.5 - spread), y], [at(0.5 + spread), y]);
  await touch('touchEnd');
  await shows(begin, begin + 5);
  // A tap selects the module under it, and a finger turns the view.
  const stage = await page.locator('.stage canvas').boundingBox();
  const [x, z] = await page.evaluate(() => {
    const { view } = window.monitor.scene;
    const place = view.robots[0].modulePlaces().get('m3').project(view.camera);
    return [(place.x + 1) / 2, (1 - place.y) / 2];
  });
  const finger = [stage.x + x * stage.width, stage.y + z * stage.height];
  await touch('touchStart', finger);
  await touch('touchEnd');
  await page.waitForFunction(() => window.monitor.selected?.module === 'm3');
  const camera = () => page.evaluate(() => window.monitor.scene.view.cameraPlace);
  const before = await camera();
  await touch('touchStart', finger);
  for (const dx of [20, 60, 120]) await touch('touchMove', [finger[0] + dx, finger[1]]);
  await touch('touchEnd');
  const turned = Math.hypot(...(await camera()).map((c, i) => c - before[i]));
  assert.ok(turned > 0.05, `the camera went ${turned} m`);
  assert.deepEqual(page.problems, []);
});

test('two logs are shown beside each other with the difference of their labelled links', async () => {
  const page = await openMock(browser, 'two');
  await page.waitForFunction(() => window.monitor.session.difference?.table.length === 1001);
  await page.evaluate(() => window.monitor.seek(6));
  await page.locator('#tab-compare').click();
  await page.waitForSelector('.compare tbody tr:nth-child(4)');
  const cells = await page.$$eval('.compare tbody tr', (rows) =>
    rows.map((row) => [row.cells[0].textContent, row.cells[1].textContent]),
  );
  assert.deepEqual(
    cells,
    ['Head', 'Leg2', 'Leg3', 'Leg4'].map((role) => [`${role}.foot`, '4.000']),
  );
  const boxes = await robotBoxes(page, 0);
  assert.ok(boxes[0].right < boxes[1].left || boxes[0].bottom < boxes[1].top, 'the robots lie beside each other');
  await drawn(page);
  await keepShot(page, 'two-logs');
  // Over each other, the second one lets the first one be seen.
  const translucent = () =>
    page.evaluate(() => window.monitor.scene.view.robots.map((robot) => robot.links[0].mesh.material.transparent));
  assert.deepEqual(await translucent(), [false, false]);
  await page.getByRole('button', { name: 'Beside' }).click();
  await drawn(page);
  assert.deepEqual(await translucent(), [false, true]);
});

test('plots of two runs show the same motion under one sign, the second run dashed', async () => {
  const page = await openMock(browser, 'two');
  await page.waitForFunction(() => window.monitor.session.difference?.table.length === 1001);
  await page.evaluate(() => window.monitor.seek(6.3));
  await drawn(page);
  const legend = (i) => page.locator('.plot').nth(i).locator('.entry');
  const entries = await legend(0).evaluateAll((all) =>
    all.map((e) => [e.querySelector('.name').textContent, e.querySelector('.value').textContent, e.querySelector('.stroke').className]),
  );
  // The robots' joints turn in opposite senses: A's first has the sign +, and B's the sign −.
  assert.deepEqual(
    await page.evaluate(() =>
      window.monitor.session.runs.map((run) => {
        const { table } = run.tables.get('joints');
        return Math.sign(table.value(table.find('m1.joint_1 position'), table.rowAt(6.3)));
      }),
    ),
    [1, -1],
  );
  assert.deepEqual(
    entries.map(([name, , stroke]) => [name, stroke]),
    [
      ['A Head.ankle (m1.joint_1) position', 'stroke'],
      ['B Head.ankle (m1.joint_1) position', 'stroke dashed'],
      ['A Leg2.ankle (m2.joint_1) position', 'stroke'],
      ['B Leg2.ankle (m2.joint_1) position', 'stroke dashed'],
    ],
  );
  assert.equal(entries[0][1], '27.81 °');
  assert.equal(entries[1][1], entries[0][1]);
  assert.equal(entries[3][1], entries[2][1]);
  await keepShot(page, 'two-logs-paired');
  // What two runs have in common is one field, and so is its difference; what is paired is not listed run by run.
  await page.locator('[data-action=add-plot]').click();
  await page.locator('.picker input[type=search]').fill('leg3 ankle position');
  assert.deepEqual(await page.locator('.field .what').allInnerTexts(), [
    'Leg3.ankle (m3.joint_1 / m3.joint_1) position',
    'Leg3.ankle (m3.joint_1 / m3.joint_1) position A − B',
  ]);
  await page.locator('.field').nth(1).click();
  await page.locator('.picker [type=submit]').click();
  await page.waitForFunction(() => window.monitor.plots.views[2]?.plot.drawnPoints > 0);
  assert.match(await legend(2).innerText(), /Leg3\.ankle position A − B\s*0\.0+ °/);
  assert.deepEqual(page.problems, []);
});
