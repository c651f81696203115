// The page in a browser against a server inside it: what it shows in every state, its keys, both widths and both themes.
import assert from 'node:assert/strict';
import { after, afterEach, before, test } from 'node:test';
import {
  changedPixels,
  drawn,
  inside,
  keepShot,
  launch,
  openMock,
  pixelsOf,
  plotPoints,
  robotBoxes,
  SIZES,
  THEMES,
} from './browser.mjs';

let browser;
before(async () => (browser = await launch()));
after(async () => browser.close());
// A page that is left behind would go on drawing.
afterEach(async () => Promise.all(browser.contexts().map((context) => context.close())));

/** What stands in the table of roles, by module. */
const roles = (page) =>
  page.$$eval('.roles tbody tr', (rows) =>
    rows.map((row) => [row.dataset.module, row.dataset.role, row.querySelector('.sign')?.textContent]),
  );
const time = (page) => page.evaluate(() => window.monitor.time);
const text = (page, selector) => page.locator(selector).innerText();

/** Opens a live run that has run for so many ticks, seen by a camera that stands still. */
async function live(ticks, size, theme) {
  const page = await openMock(browser, 'live', size, theme);
  await page.evaluate((n) => window.server.advance('walk', n), ticks);
  await page.waitForFunction((n) => Math.round(window.monitor.time * 50) === n - 1, ticks);
  await page.evaluate(() => {
    for (const flag of ['follow', 'trails'])
      if (window.monitor.scene.view.options[flag]) window.monitor.scene.toggle(flag);
  });
  await drawn(page);
  return page;
}

test('without a run the page says how to start one', async () => {
  const page = await openMock(browser, 'none');
  await page.waitForSelector('.message:visible');
  assert.match(await text(page, '.message'), /Nothing runs[\s\S]*morphbus run models/);
  await keepShot(page, 'empty');
  assert.deepEqual(page.problems, []);
});

test('roles, labels and signs are listed, and plots are drawn', async () => {
  const page = await live(200);
  assert.deepEqual(await roles(page), [
    ['m1', 'Head', '+'],
    ['m2', 'Leg2', '−'],
    ['m3', 'Leg3', '+'],
    ['m4', 'Leg4', '−'],
    ['m5', 'Leg5', '+'],
  ]);
  const points = await plotPoints(page);
  assert.equal(points.length, 2);
  assert.ok(
    points.every((n) => n >= 200),
    `${points}`,
  );
});

test('the robot moves where it is, and nothing else does', async () => {
  const page = await live(100);
  const [before, boxesBefore] = [await pixelsOf(page, '.stage'), await robotBoxes(page, 70)];
  await page.evaluate(() => window.server.advance('walk', 20));
  await page.waitForFunction(() => Math.round(window.monitor.time * 50) === 119);
  await drawn(page);
  const [now, boxes] = [await pixelsOf(page, '.stage'), await robotBoxes(page, 70)];
  const changed = changedPixels(before, now);
  assert.ok(changed.length > 300, `${changed.length} pixels changed`);
  for (const place of changed) assert.ok(inside(place, boxes[0]) || inside(place, boxesBefore[0]), `${place} changed`);
});

test('holding, stepping and scrubbing show earlier instants as they were', async () => {
  const page = await live(100);
  const then = await pixelsOf(page, '.stage');
  await page.evaluate(() => window.server.advance('walk', 200));
  await page.waitForFunction(() => Math.round(window.monitor.time * 50) === 299);
  await drawn(page);
  assert.ok(changedPixels(then, await pixelsOf(page, '.stage')).length > 300);
  // Back by the slider, as with a mouse.
  await page.locator('.slider input').fill('1980');
  await page.waitForFunction(() => Math.abs(window.monitor.time - 1.98) < 1e-9);
  await drawn(page);
  assert.equal(changedPixels(then, await pixelsOf(page, '.stage')).length, 0);
  // The run goes on meanwhile, and the view stays.
  await page.evaluate(() => window.server.advance('walk', 50));
  await drawn(page);
  assert.equal(await time(page), 1.98);
  assert.match(await text(page, '[data-field=behind]'), /tick 99 · 5\.0 s ago/);
  await page.locator('h1').click();
  await page.keyboard.press('ArrowRight');
  await page.waitForFunction(() => Math.round(window.monitor.time * 50) === 100);
  await page.keyboard.press('Shift+ArrowLeft');
  await page.waitForFunction(() => Math.round(window.monitor.time * 50) === 50);
  await page.keyboard.press('Home');
  await page.waitForFunction(() => window.monitor.time === 0);
  // Playing on moves the view; the end of what there is becomes the newest instant again.
  await page.keyboard.press(']');
  assert.equal(await page.evaluate(() => window.monitor.clock.speed), 2);
  await page.keyboard.press('Space');
  await page.waitForFunction(() => window.monitor.time > 0.2 && window.monitor.clock.mode === 'play');
  await page.keyboard.press('Space');
  await page.waitForFunction(() => window.monitor.clock.mode === 'hold');
  await page.keyboard.press('End');
  await page.waitForFunction(
    () => Math.round(window.monitor.time * 50) === 349 && window.monitor.clock.mode === 'follow',
  );
  assert.deepEqual(page.problems, []);
});

test('a lost connection is shown and heals by itself', async () => {
  const page = await live(50);
  assert.equal(await page.locator('.banner').isVisible(), false);
  await page.evaluate(() => {
    window.server.accepts = false;
    window.server.disconnectAll();
  });
  await page.waitForSelector('.banner:visible');
  assert.match(await text(page, '.banner'), /lost[\s\S]*tries again by itself/);
  assert.equal(await page.locator('.connection').getAttribute('data-state'), 'disconnected');
  // What was received can still be looked at.
  await page.keyboard.press('Home');
  await page.waitForFunction(() => window.monitor.time === 0);
  await keepShot(page, 'disconnected');
  await page.evaluate(() => (window.server.accepts = true));
  await page.waitForSelector('.banner', { state: 'hidden' });
  await page.evaluate(() => {
    window.monitor.clock.follow();
    window.server.advance('walk', 25);
  });
  await page.waitForFunction(() => Math.round(window.monitor.time * 50) === 74);
});

test('orders are given by buttons, and their answers listed', async () => {
  const page = await live(100);
  await page.locator('#tab-control').click();
  await page.locator('[data-form=push] button[type=submit]').click();
  await page.waitForSelector('.answers li:has-text("push m1 NORTH 5 0.2")');
  assert.match(await text(page, '.answers'), /took effect at tick 100/);
  await page.getByRole('button', { name: 'Pause run' }).click();
  await page.waitForFunction(() => window.monitor.session.runs[0].clock.paused);
  await page.getByRole('spinbutton', { name: 'Ticks' }).fill('7');
  await page.getByRole('button', { name: 'Step', exact: true }).click();
  await page.waitForFunction(() => Math.round(window.monitor.time * 50) === 106);
  // A key steps the run by one tick; within a text it is a full stop.
  await page.locator('h1').click();
  await page.keyboard.press('.');
  await page.waitForFunction(() => Math.round(window.monitor.time * 50) === 107);
  await page.locator('[data-field=raw]').fill('dance');
  await page.keyboard.press('Enter');
  await page.waitForSelector('.answers .failed:has-text("no command")');
  await keepShot(page, 'control');
  // Another program, and its roles.
  await page.locator('[data-form=deploy] textarea').fill('role Other1 extends Module {}');
  await page.locator('[data-form=deploy] button[type=submit]').click();
  await page.waitForSelector('.answers li:has-text("deploy")');
  await page.locator('#tab-roles').click();
  await page.waitForSelector('tr[data-module=m1][data-role=Other1]');
});

test('parameters are set by sliders, and follow what others set', async () => {
  const page = await live(100);
  await page.locator('#tab-control').click();
  const swing = page.getByRole('slider', { name: 'swing, slider' });
  assert.equal(await swing.inputValue(), '30');
  await swing.fill('45.5');
  await page.waitForSelector('.answers li:has-text("set swing 45.5"):has-text("holds everywhere from 9 s on")');
  await page.getByRole('spinbutton', { name: 'Head.steps' }).fill('3');
  await page.keyboard.press('Enter');
  await page.waitForSelector('.answers li:has-text("set Head.steps 3")');
  // What a run says counts, whoever has asked for it; the role may be left out.
  await page.evaluate(() => {
    window.server.run('walk').said.push('set swing 12 0123456789abcdef --at 9', 'set steps 7 0123456789abcdef --at 9');
    window.server.advance('walk', 2);
  });
  await page.waitForFunction(
    () => document.querySelector('.parameters [aria-label="Head.steps, slider"]').value === '7',
  );
  assert.equal(await page.getByRole('spinbutton', { name: 'swing' }).inputValue(), '12');
  await keepShot(page, 'parameters');
});

test('faults come with their line, which opens the program there', async () => {
  const page = await live(60);
  await page.evaluate(() =>
    window.server.fault('walk', {
      module: 'm2',
      role: 'Leg2',
      name: 'x',
      text: 'Leg2 divides 3 by zero',
      file: 'mock.dyn',
      line: 1,
      sourceLine: '  x = 3 / y;',
      function: 'Leg2.gait',
    }),
  );
  await page.waitForSelector('.toast:has-text("divides")');
  await page.locator('#tab-faults').click();
  await page.waitForSelector('.fault pre:has-text("x = 3 / y;")');
  await page.locator('.fault .place').click();
  assert.equal((await text(page, '.program .marked')).trim(), 'role Head extends Module {');
  await page.keyboard.press('Escape');
  await page.locator('.fault .time').click();
  await page.waitForFunction(() => window.monitor.clock.mode === 'hold');
});

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
  assert.match(await page.locator('.legend').last().innerText(), /Leg3\.ankle \(m3\.joint_1\) velocity\s*11\.46 °\/s/);
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

test('keys are listed in the help, which the keyboard opens and closes', async () => {
  const page = await live(10);
  await page.keyboard.press('?');
  await page.waitForSelector('dialog.help[open]');
  assert.match(await text(page, 'dialog.help'), /Space[\s\S]*one tick back[\s\S]*dark or light/);
  await keepShot(page, 'help');
  await page.keyboard.press('Escape');
  await page.waitForSelector('dialog.help', { state: 'hidden' });
  const dark = () => page.evaluate(() => document.documentElement.dataset.theme);
  assert.equal(await dark(), 'light');
  await page.keyboard.press('d');
  assert.equal(await dark(), 'dark');
  await page.reload();
  await page.waitForFunction(() => window.monitor?.session.state === 'connected');
  assert.equal(await dark(), 'dark');
});

/** The contrast of two colours by the web content accessibility guidelines, 1 to 21. */
function contrast(a, b) {
  const luminance = (hex) => {
    const [r, g, bl] = [1, 3, 5]
      .map((i) => parseInt(hex.slice(i, i + 2), 16) / 255)
      .map((c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * bl;
  };
  const [high, low] = [luminance(a), luminance(b)].sort((x, y) => y - x);
  return (high + 0.05) / (low + 0.05);
}

for (const size of SIZES) {
  for (const theme of THEMES) {
    test(`the page fits ${size.width} pixels, ${theme}, with names and contrast for everybody`, async () => {
      const page = await live(300, size, theme);
      await page.evaluate(() => window.monitor.scene.toggle('trails'));
      await drawn(page);
      await keepShot(page, `live-${size.width}-${theme}`, { fullPage: size.width < 820 });
      const width = await page.evaluate(() => document.documentElement.scrollWidth);
      assert.ok(width <= size.width, `the page is ${width} pixels wide`);
      assert.equal(await page.evaluate(() => document.documentElement.dataset.theme), theme);
      const nameless = await page.$$eval('button, input, select, textarea, canvas[role=img]', (all) =>
        all
          .filter(
            (e) => !(e.getAttribute('aria-label') || e.textContent.trim() || e.closest('label')?.textContent.trim()),
          )
          .map((e) => e.outerHTML),
      );
      assert.deepEqual(nameless, []);
      const colours = await page.evaluate(() => {
        const styles = getComputedStyle(document.documentElement);
        return Object.fromEntries(
          [
            'surface',
            'raised',
            'text',
            'text-quiet',
            'accent',
            'accent-text',
            'accent-soft',
            'warn',
            'fault',
            'fault-soft',
          ].map((n) => [n, styles.getPropertyValue(`--${n}`).trim()]),
        );
      });
      for (const [front, back] of [
        ['text', 'surface'],
        ['text', 'raised'],
        ['text-quiet', 'surface'],
        ['accent', 'surface'],
        ['accent-text', 'accent'],
        ['text', 'accent-soft'],
        ['warn', 'surface'],
        ['fault', 'surface'],
        ['text', 'fault-soft'],
      ]) {
        const c = contrast(colours[front], colours[back]);
        assert.ok(c >= 4.5, `${front} on ${back}: ${c.toFixed(2)}`);
      }
      assert.deepEqual(page.problems, []);
    });
  }
}
