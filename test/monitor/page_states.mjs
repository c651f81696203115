// The page in a browser against a server inside it: what it shows in every state, its keys, both widths and both themes.
import assert from 'node:assert/strict';
import { after, afterEach, before, test } from 'node:test';
import {
  changedPixels,
  drawn,
  inside,
  keepShot,
  launch,
  openLive,
  openMock,
  pixelsOf,
  plotPoints,
  robotBoxes,
  SIZES,
  text,
  THEMES,
  time,
} from './browser.mjs';

let browser;
before(async () => (browser = await launch()));
after(async () => browser.close());
// A page that is left behind would go on drawing.
afterEach(async () => Promise.all(browser.contexts().map((context) => context.close())));

const live = (ticks, size, theme) => openLive(browser, ticks, size, theme);
/** What stands in the table of roles, by module. */
const roles = (page) =>
  page.$$eval('.roles tbody tr', (rows) =>
    rows.map((row) => [row.dataset.module, row.dataset.role, row.querySelector('.sign')?.textContent]),
  );

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
  // What happened is told in the bar, in place of what was told before, and covers nothing.
  await page.waitForSelector('.bar .notice:has-text("divides")');
  await page.evaluate(() => window.monitor.tell('something else'));
  await page.waitForSelector('.bar .notice:has-text("something else")');
  assert.equal(await page.locator('.notice').count(), 1);
  assert.equal(await page.locator('.notice:has-text("divides")').count(), 0);
  await page.locator('#tab-faults').click();
  await page.waitForSelector('.fault pre:has-text("x = 3 / y;")');
  await page.locator('.fault .place').click();
  assert.equal((await text(page, '.program .marked')).trim(), 'role Head extends Module {');
  await page.keyboard.press('Escape');
  await page.locator('.fault .time').click();
  await page.waitForFunction(() => window.monitor.clock.mode === 'hold');
  // Counts are those up to the instant that is shown.
  const badge = () => page.locator('#tab-faults .badge');
  assert.equal(await badge().innerText(), '1');
  await page.evaluate(() => window.monitor.seek(0.5));
  await badge().waitFor({ state: 'hidden' });
  await page.waitForSelector('.fault.later');
});

test('channels are counted up to the cursor, in sim time, and what is said once has no rate', async () => {
  const page = await live(150);
  await page.locator('#tab-channels').click();
  const row = (name) => page.locator(`.channels tbody tr:has-text("${name}")`).locator('.number').allInnerTexts();
  await page.waitForSelector('.channels tbody tr');
  assert.deepEqual((await row('m1/TRANSFORM')).slice(0, 3), ['100', '50.0', '20.0']);
  assert.deepEqual((await row('INFO')).slice(0, 3), ['1', '–', '–']);
  await page.evaluate(() => window.monitor.seek(1.5));
  await page.waitForSelector('.channels td.number:text-is("50")');
  assert.deepEqual((await row('m1/TRANSFORM')).slice(0, 2), ['50', '50.0']);
  await keepShot(page, 'channels');
});

test('who comes late to a run sees what was before', async () => {
  const page = await openMock(browser, 'late');
  await page.evaluate(() => {
    const run = window.server.run('walk');
    run.tick = 200;
    window.server.advance('walk', 50);
  });
  await page.waitForFunction(() => {
    const [run] = window.monitor.session.runs;
    return run.poses.length === 251 && run.poses.beginTime === 0 && Math.round(window.monitor.time * 50) === 250;
  });
  // One run, whose past can be looked at as what came since.
  assert.equal(await page.evaluate(() => window.monitor.session.runs.length), 1);
  await page.evaluate(() => window.monitor.seek(2));
  await page.waitForSelector('tr[data-module=m2][data-role=Leg2]');
  await drawn(page);
  const place = await page.evaluate(() => window.monitor.scene.view.robots[0].links[0].object.position.x);
  assert.ok(Math.abs(place - 0.1) < 1e-6, `${place}`);
  await keepShot(page, 'late');
  assert.deepEqual(page.problems, []);
});

test('a log opens where there is something to see, and the address brings back what was shown', async () => {
  const page = await openMock(browser, 'two');
  // The modules of the mock have their roles at 20 ms.
  await page.waitForFunction(() => Math.abs(window.monitor.time - 2.02) < 0.03);
  await page.evaluate(() => {
    window.monitor.seek(7.5);
    window.monitor.scene.toggle('names');
    window.monitor.scene.toggle('trails');
    window.monitor.plots.add(['first|joints|m2.joint_1 velocity']);
    window.monitor.select({ run: window.monitor.session.runs[1], module: 'm3' });
  });
  await page.locator('#tab-compare').click();
  // A layout is kept under a name.
  await page.keyboard.press('l');
  await page.getByRole('textbox', { name: 'Name of the layout' }).fill('gait');
  await page.keyboard.press('Enter');
  await page.waitForSelector('.layouts .name:has-text("gait")');
  await keepShot(page, 'layouts');
  await page.keyboard.press('Escape');
  await page.waitForFunction(() => /t=7\.50/.test(location.hash) && /module=B\.m3/.test(location.hash) && /tab=compare/.test(location.hash));
  const state = () =>
    page.evaluate(() => {
      const { monitor } = window;
      const { names, trails } = monitor.scene.view.options;
      const plots = monitor.plots.views.map((view) => view.fields.length);
      return { time: monitor.time, module: monitor.selected?.module, run: monitor.selected?.run.name, names, trails, plots, tab: document.querySelector('[aria-selected=true]').id };
    });
  const before = await state();
  const url = page.url();
  // Another browser has only the address.
  await page.evaluate(() => localStorage.clear());
  await page.goto('about:blank');
  await page.goto(url);
  await page.waitForFunction(() => window.monitor?.session.difference?.table.length === 1001 && Math.abs(window.monitor.time - 7.5) < 1e-6);
  assert.deepEqual(await state(), before);
  assert.deepEqual(page.problems, []);
});

test('without a graphics card fewer pixels are drawn of what moves, and more of what stands still', async () => {
  const page = await openMock(browser, 'two');
  const whenStill = () =>
    page.waitForFunction(() => {
      const { domElement: canvas } = window.monitor.scene.view.renderer;
      return canvas.width === 2 * canvas.clientWidth;
    });
  await whenStill();
  // A line of the ground is as wide as before.
  const [moving, line] = await page.evaluate(() => {
    const { view } = window.monitor.scene;
    view.touch();
    view.render(window.monitor.time);
    const { domElement: canvas } = view.renderer;
    return [canvas.width / canvas.clientWidth, view.ground.mesh.material.uniforms.pixelRatio.value];
  });
  assert.ok(moving > 0.7 && moving <= 1, `${moving} pixels`);
  assert.equal(line, 1);
  await whenStill();
  assert.equal(await page.evaluate(() => window.monitor.scene.view.ground.mesh.material.uniforms.pixelRatio.value), 2);
  // The pictures of a video, which take as long as they take, are as smooth.
  const filmed = await page.evaluate(() => {
    const { view } = window.monitor.scene;
    const { domElement: canvas } = view.renderer;
    const restore = view.fix(1);
    const ratio = canvas.width / canvas.clientWidth;
    restore();
    return ratio;
  });
  assert.equal(filmed, 2);
  assert.deepEqual(page.problems, []);
});

test('a layout that was saved comes back', async () => {
  const page = await live(60);
  const flags = () => page.evaluate(() => [window.monitor.scene.view.options.names, window.monitor.plots.views.length]);
  await page.keyboard.press('n');
  await page.evaluate(() => window.monitor.plots.add(['walk|joints|m2.joint_1 velocity']));
  await page.locator('[data-action=layouts]').click();
  await page.getByRole('textbox', { name: 'Name of the layout' }).fill('mine');
  await page.keyboard.press('Enter');
  await page.waitForSelector('.layouts .name:has-text("mine")');
  await page.keyboard.press('Escape');
  await page.keyboard.press('n');
  await page.locator('.plot').last().locator('[data-action=plot-close]').click();
  assert.deepEqual(await flags(), [false, 2]);
  await page.locator('[data-action=layouts]').click();
  await page.locator('.layouts .name:has-text("mine")').click();
  assert.deepEqual(await flags(), [true, 3]);
});

test('a log that was cut says where', async () => {
  const page = await openMock(browser, 'cut');
  await page.waitForSelector('.source .facts:has-text("log, cut at 15.18 s")');
  assert.match(await page.locator('.source').getAttribute('title'), /torn\.log: an event has no end/);
  await keepShot(page, 'cut');
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
      // Nothing is cut off at the side, in no list, and with a module selected.
      await page.evaluate(() => window.monitor.select({ run: window.monitor.session.runs[0], module: 'm2' }));
      for (const tab of ['roles', 'faults', 'channels', 'control']) {
        await page.evaluate((id) => document.getElementById(`tab-${id}`).click(), tab);
        const cut = await page.$$eval('.bar *, main *, .timeline *', (all) =>
          all
            .filter((e) => e.clientWidth > 0 && e.scrollWidth > e.clientWidth + 1 && getComputedStyle(e).overflowX !== 'visible')
            .filter((e) => getComputedStyle(e).textOverflow !== 'ellipsis' && !['PRE', 'TEXTAREA', 'INPUT'].includes(e.tagName))
            .map((e) => `${e.className}: ${e.scrollWidth} of ${e.clientWidth}`),
        );
        assert.deepEqual(cut, [], `${tab} at ${size.width}`);
      }
      await keepShot(page, `selected-${size.width}-${theme}`, { fullPage: size.width < 820 });
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
