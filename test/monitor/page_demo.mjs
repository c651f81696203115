// The page on two robots, the paper's quadrupeds: one from a log, the other one live, in lockstep and slowed.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import {
  changedPixels,
  drawn,
  inside,
  keepShot,
  launch,
  newPage,
  pixelsOf,
  plotPoints,
  robotBoxes,
  SIZES,
} from './browser.mjs';
import { Demo, MODEL, PROGRAM } from './demo.mjs';

const demo = new Demo();
let browser, page, monitor, log;

before(async () => {
  browser = await launch();
  log = demo.record('quadruped', 'first', 12);
  // The run holds still but where a test lets it go on, so that nothing depends on the machine's speed.
  await demo.run('equivalent_quadruped', 'second', 'pause');
  demo.control('second', 'speed', '1');
  monitor = await demo.monitor([log, '--run', 'second']);
  page = await newPage(browser);
  await page.goto(monitor.url);
});
after(async () => {
  await browser?.close();
  await demo.end();
});

/** What has been received of the live run, in ticks. */
const tick = () => page.evaluate(() => Math.round(window.monitor.session.runs[1].poses.endTime * 50));
const text = (selector) => page.locator(selector).innerText();

/** Reads something until it is as expected; if it never is, says what it was. */
async function eventually(read, expected) {
  for (const limit = Date.now() + 120_000; ;) {
    const value = await read();
    try {
      assert.deepEqual(value, expected);
      return;
    } catch (error) {
      if (Date.now() > limit) throw error;
    }
  }
}

/** The roles that the page lists for a run, by module. */
const listedRoles = (index) =>
  page.evaluate((i) => {
    const rows = [...(document.querySelectorAll('.roles')[i]?.querySelectorAll('tbody tr') ?? [])];
    return Object.fromEntries(rows.map((row) => [row.dataset.module, row.dataset.role]));
  }, index);

/** The convention signs of a run's labelled joints, by module and label. */
const knownSigns = (index) =>
  page.evaluate((i) => {
    const run = window.monitor.session.runs[i];
    return Object.fromEntries(
      run.moduleNames.map((module) => {
        const labels = run.lastState(module)?.labels.filter((label) => label.sign !== 0) ?? [];
        return [module, Object.fromEntries(labels.map((label) => [label.name, label.sign]))];
      }),
    );
  }, index);

/** Lets the run go on by so many ticks by the page's own button, and waits until they are shown. */
async function step(ticks) {
  const before = await tick();
  await page.locator('#tab-control').click();
  await page.getByRole('spinbutton', { name: 'Ticks' }).fill(String(ticks));
  await page.getByRole('button', { name: 'Step', exact: true }).click();
  await atRest(before + ticks);
}

/** Waits until the page has got this tick and shows it. */
async function atRest(expected) {
  await eventually(tick, expected);
  await page.waitForFunction((n) => Math.round(window.monitor.time * 50) === n, expected);
  await drawn(page);
}

test('both robots are there, connected and with the roles and signs that the compiler finds', async () => {
  await page.waitForFunction(
    () =>
      window.monitor.session.runs.length === 2 &&
      window.monitor.session.runs[0].poses.length === 600 &&
      window.monitor.session.runs[1].poses.length > 0,
  );
  assert.equal(await page.locator('.connection').getAttribute('data-state'), 'connected');
  assert.match(await text('.sources'), /A · first\s*quadruped, log[\s\S]*B · second\s*equivalent_quadruped, /);
  await step(100);
  await page.locator('#tab-roles').click();
  for (const [i, robot] of ['quadruped', 'equivalent_quadruped'].entries()) {
    const found = Object.entries(demo.json('roles', MODEL, PROGRAM, '--robot', robot).modules);
    await eventually(() => listedRoles(i), Object.fromEntries(found.map(([module, { role }]) => [module, role])));
    await eventually(() => knownSigns(i), Object.fromEntries(found.map(([module, { signs }]) => [module, signs])));
  }
  await keepShot(page, 'demo-roles');
});

test('both robots move, and only they', async () => {
  // Nothing in the view changes but the robots: no camera, no trails, no names, and no fewer pixels on a slow machine.
  await page.evaluate(() => {
    const { scene } = window.monitor;
    scene.view.options.adaptive = false;
    for (const flag of ['follow', 'trails']) if (scene.view.options[flag]) scene.toggle(flag);
    document.querySelector('.view-overlay').style.display = 'none';
  });
  await drawn(page);
  const [boxesBefore, pointsBefore] = [await robotBoxes(page, 60), await plotPoints(page)];
  const pictureBefore = await pixelsOf(page, '.stage');
  await keepShot(page, 'demo-before');
  await step(75);
  const [boxes, points, picture] = [await robotBoxes(page, 60), await plotPoints(page), await pixelsOf(page, '.stage')];
  await keepShot(page, 'demo-after');
  const changed = changedPixels(pictureBefore, picture);
  for (const i of [0, 1]) {
    const mine = changed.filter((place) => inside(place, boxes[i]) || inside(place, boxesBefore[i]));
    assert.ok(mine.length > 300, `robot ${'AB'[i]}: ${mine.length} pixels`);
  }
  const elsewhere = changed.filter((place) => ![...boxes, ...boxesBefore].some((box) => inside(place, box)));
  assert.deepEqual(elsewhere, []);
  assert.equal(points.length, 2);
  // Differences are drawn up to the newest instant that both runs have.
  assert.ok(points[1] >= pointsBefore[1] + 75, `${pointsBefore} then ${points} points`);
});

test('the run goes on, pauses and steps by the page', async () => {
  const before = await tick();
  await page.locator('#tab-control').click();
  await page.getByRole('button', { name: 'Resume run' }).click();
  await page.waitForFunction((n) => window.monitor.time * 50 > n + 10, before);
  await page.getByRole('button', { name: 'Pause run' }).click();
  await page.waitForSelector('.answers li:has-text("pause")');
  await page.waitForFunction(() => window.monitor.session.runs[1].clock.paused);
  await drawn(page);
  await step(5);
});

test('scrubbing back shows both robots as they were', async () => {
  const then = await tick();
  const before = await pixelsOf(page, '.stage');
  await step(60);
  assert.ok(changedPixels(before, await pixelsOf(page, '.stage')).length > 300);
  await page.locator('.slider input').fill(String(then * 20));
  await page.waitForFunction(
    (n) => Math.round(window.monitor.time * 50) === n && window.monitor.clock.mode === 'hold',
    then,
  );
  await drawn(page);
  assert.equal(changedPixels(before, await pixelsOf(page, '.stage')).length, 0);
  await page.locator('h1').click();
  await page.keyboard.press('End');
});

test('the congruent robots do not differ, as the comparison says', async () => {
  await page.locator('#tab-compare').click();
  await page.waitForSelector('.compare tbody tr');
  const most = await page.evaluate(() => {
    const { difference } = window.monitor.session;
    return difference.pairNames
      .filter((name) => name.endsWith('.foot'))
      .map((name) => difference.maximum(`${name} position`));
  });
  assert.equal(most.length, 4);
  for (const metres of most) assert.ok(metres < 1e-6, `${metres} m`);
  await keepShot(page, 'demo-compare');
});

test('plots show both robots under one sign, whose joints are mounted in opposite ways', async () => {
  // What the page shows of each pair of joints is compared over all ticks that both runs have.
  const joints = await page.evaluate(() => {
    const { session } = window.monitor;
    const [a, b] = session.runs.map((run) => run.tables.get('joints').table);
    const end = Math.min(a.endTime, b.endTime);
    return session.pairs
      .filter((pair) => pair.kind === 'joint')
      .map(({ name, moduleA, partA, moduleB, partB, signsA, signsB }) => {
        let [raw, shown, common] = [0, 0, 0];
        for (let row = 0; row < a.length && a.time(row) <= end; row++) {
          const other = b.rowAt(a.time(row) + 1e-9);
          if (other < 0 || Math.abs(b.time(other) - a.time(row)) > 1e-6) continue;
          common++;
          const [p, q] = [a.value(a.find(`${moduleA}.${partA} position`), row), b.value(b.find(`${moduleB}.${partB} position`), other)];
          raw = Math.max(raw, Math.abs(p - q));
          shown = Math.max(shown, Math.abs(p * signsA.at(-1).sign - q * signsB.at(-1).sign));
        }
        return { name, raw, shown, common };
      });
  });
  assert.equal(joints.length, 18);
  for (const { name, shown, common } of joints)
    assert.ok(shown < 1e-4 && common > 100, `${name}: ${shown} rad in ${common} ticks`);
  // In the actuators' own signs some of them differ.
  assert.ok(joints.some(({ raw }) => raw > 0.2));
  const values = await page.locator('.plot').first().locator('.value').allInnerTexts();
  assert.equal(values.length, 4);
  assert.equal(values[0], values[1]);
  assert.equal(values[2], values[3]);
  const names = await page.locator('.plot').first().locator('.name').allInnerTexts();
  assert.match(names[0], /^A \w+\.\w+ \(m\d\.joint_\d\) position$/);
  assert.equal(names[0].split(' ')[1], names[1].split(' ')[1]);
});

// Behind what compares the two, which a push makes differ.
test('pushes and the forces of the ground are told', async () => {
  await page.locator('#tab-control').click();
  await page.evaluate(() => window.monitor.control.give('push m5 EAST 2 0.4'));
  await page.waitForSelector('.answers li:has-text("push m5")');
  await step(5);
  const told = await page.evaluate(() => {
    const { time, session } = window.monitor;
    const of = (table) => session.runs.map((run) => run.forcesAt(table, time));
    return { pushes: of('pushes'), contacts: of('contacts') };
  });
  assert.deepEqual(told.pushes[0], []);
  assert.deepEqual(
    told.pushes[1].map(({ link, force }) => [link.split('/')[0], force]),
    [['m5', [0, 0, 2]]],
  );
  // The ground bears both robots, which weigh the same.
  for (const contacts of told.contacts) {
    const up = contacts.reduce((sum, { force }) => sum + force[1], 0);
    assert.ok(up > 1, `${up} N`);
  }
});

test('a changed program is deployed from the page and seen in the roles', async () => {
  await page.locator('#tab-control').click();
  const program = page.locator('[data-form=deploy] textarea');
  assert.match(await program.inputValue(), /role Junction extends Module/);
  await program.fill((await program.inputValue()).replaceAll('Junction', 'Hub'));
  await page.locator('[data-form=deploy] button[type=submit]').click();
  await page.waitForSelector('.answers li:has-text("deploy")');
  assert.equal(await page.locator('.answers .failed:has-text("deploy")').count(), 0);
  // The run holds still: the deployment is taken up once it goes on.
  await page.getByRole('button', { name: 'Resume run' }).click();
  await page.locator('#tab-roles').click();
  await page.waitForFunction(() =>
    [...document.querySelectorAll('.roles')[1].querySelectorAll('tbody tr')].some((row) => row.dataset.role === 'Hub'),
  );
  assert.deepEqual(
    Object.values(await listedRoles(0)).filter((role) => role === 'Hub'),
    [],
  );
  await keepShot(page, 'demo-deployed');
});

test('a monitor that ends is missed, and found again when it is back', async () => {
  await demo.stop(monitor.process);
  await page.waitForSelector('.banner:visible');
  assert.equal(await page.locator('.connection').getAttribute('data-state'), 'disconnected');
  await keepShot(page, 'demo-disconnected');
  monitor = await demo.monitor([log, '--run', 'second'], monitor.port);
  await page.waitForSelector('.banner', { state: 'hidden' });
  await page.waitForFunction(() => window.monitor.session.runs.every((run) => run.poses.length > 10));
});

test('who lacks the token may look and nothing else', async () => {
  const stranger = await newPage(browser, SIZES[1], 'dark');
  await stranger.goto(monitor.url.replace(/\?.*/, ''));
  await stranger.waitForFunction(
    () =>
      window.monitor?.session.runs.length === 2 && window.monitor.session.runs.every((run) => run.poses.length > 10),
  );
  await stranger.locator('#tab-control').click();
  await stranger.waitForSelector('.control .empty:has-text("may only watch")');
  assert.equal(await stranger.getByRole('button', { name: 'Pause run' }).isEnabled(), false);
  await keepShot(stranger, 'demo-400-dark', { fullPage: true });
  assert.deepEqual(stranger.problems, []);
  await stranger.close();
});

test('nothing went wrong in the page', () => assert.deepEqual(page.problems, []));
