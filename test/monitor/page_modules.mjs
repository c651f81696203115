// The page in a browser against a server inside it: modules that are lost, selected, pushed, and what happened to them.
import assert from 'node:assert/strict';
import { after, afterEach, before, test } from 'node:test';
import { drawn, keepShot, launch, newPage, openLive, openMock, pixelsOf, text } from './browser.mjs';
import { Demo } from './demo.mjs';

let browser;
before(async () => (browser = await launch()));
after(async () => browser.close());
// A page that is left behind would go on drawing.
afterEach(async () => Promise.all(browser.contexts().map((context) => context.close())));

const live = (ticks, size, theme) => openLive(browser, ticks, size, theme);

test('a lost module is a ghost with a tag, and who has no role says which requirement failed', async () => {
  const page = await live(100);
  await page.evaluate(() => {
    window.server.lose('walk', 'm3');
    window.server.advance('walk', 2);
  });
  await page.waitForSelector('.name-tag.lost:has-text("m3 lost")');
  await drawn(page);
  // It is the one that is seen through; it is grey, and the list says what it was.
  const looks = await page.evaluate(() =>
    window.monitor.scene.view.robots[0].links.map(({ module, mesh }) => [module, mesh.material.opacity]),
  );
  for (const [module, opacity] of looks) assert.equal(opacity < 0.5, module === 'm3', `${module}: ${opacity}`);
  assert.match(await text(page, 'tr[data-module=m3]'), /lost\s+was Leg3/);
  // The others name the line that fails of the role that they had, with the rest at hand.
  const row = page.locator('tr[data-module=m4]');
  await row.locator('.missing-role').first().waitFor();
  assert.equal(
    await row.locator('.missing-role').first().innerText(),
    'not Leg4: its type has no wheel mock.dyn:2',
  );
  assert.equal(await row.locator('summary').innerText(), 'and 1 more');
  await keepShot(page, 'lost');
  await row.locator('.missing-role .place').first().click();
  assert.equal((await text(page, '.program .marked')).trim(), '}');
  await page.keyboard.press('Escape');
  // The question is asked once, not with every look at the list.
  const asked = await page.evaluate(
    () => window.server.calls.filter(({ service }) => service === '/walk/missing_roles').length,
  );
  assert.equal(asked, 1);
  // As it was before: nobody was lost.
  await page.evaluate(() => window.monitor.seek(1));
  await page.waitForSelector('.name-tag.lost', { state: 'hidden' });
  await page.waitForSelector('tr[data-module=m4][data-role=Leg4]');
  assert.deepEqual(page.problems, []);
});

/** How many pixels of the view have about this colour. */
async function coloured(page, hex) {
  const picture = await pixelsOf(page, '.stage');
  const wanted = [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16));
  let n = 0;
  for (let y = 0; y < picture.height; y++)
    for (let x = 0; x < picture.width; x++)
      if (wanted.every((c, i) => Math.abs(c - picture.at(x, y)[i]) < 40)) n++;
  return n;
}

test('frames are those of the selected module, ghosts where modules believe to be, arrows what pushes', async () => {
  const page = await live(100);
  // Names of directions have the colours of axes, too.
  await page.evaluate(() => (document.querySelector('.compass').style.display = 'none'));
  const axes = () => Promise.all(['#e03131', '#2f9e44', '#1c7ed6'].map((colour) => coloured(page, colour)));
  const before = await axes();
  await page.evaluate(() => {
    const [run] = window.monitor.session.runs;
    window.monitor.scene.toggle('forces');
    window.monitor.scene.toggle('frames');
    window.monitor.select({ run, module: 'm2' });
  });
  await drawn(page);
  const one = await axes();
  one.forEach((n, i) => assert.ok(n > before[i] + 40, `axis ${i}: ${before[i]}, then ${n} pixels`));
  await keepShot(page, 'frames');
  await page.evaluate(() => window.monitor.select(null));
  await drawn(page);
  (await axes()).forEach((n, i) => assert.ok(n > 2 * one[i], `axis ${i} of all: ${one[i]}, then ${n} pixels`));
  await page.evaluate(() => window.monitor.scene.toggle('frames'));
  // Ghosts lie 3 cm above the links.
  await page.keyboard.press('v');
  await drawn(page);
  const heights = await page.evaluate(() =>
    window.monitor.scene.view.robots[0].links.map((link) => link.ghost.position.y - link.object.position.y),
  );
  for (const height of heights) assert.ok(Math.abs(height - 0.03) < 1e-6, `${height}`);
  await keepShot(page, 'propagated');
  await page.keyboard.press('v');
  // The ground bears the modules; somebody pushes, and stops.
  const [teal, pink] = ['#12a594', '#e0308a'];
  assert.ok((await coloured(page, teal)) < 5);
  await page.keyboard.press('o');
  await page.evaluate(() => window.monitor.control.give('push m1 EAST 15 0.2'));
  await page.evaluate(() => window.server.advance('walk', 5));
  await page.waitForFunction(() => Math.round(window.monitor.time * 50) === 104);
  await drawn(page);
  const [supported, pushed] = [await coloured(page, teal), await coloured(page, pink)];
  assert.ok(supported > 100 && pushed > 60, `${supported} and ${pushed} pixels`);
  await keepShot(page, 'forces');
  await page.evaluate(() => window.server.advance('walk', 20));
  await page.waitForFunction(() => Math.round(window.monitor.time * 50) === 124);
  await drawn(page);
  assert.ok((await coloured(page, pink)) < 5);
  assert.deepEqual(page.problems, []);
});

test('a module is selected anywhere, outlined, and inspected', async () => {
  const page = await live(100);
  const head = () => text(page, '.inspector-head b');
  const outlined = () =>
    page.evaluate(() => [
      ...new Set(window.monitor.scene.view.robots[0].links.filter((link) => link.outline?.visible).map((link) => link.module)),
    ]);
  assert.equal(await page.locator('.inspector').isVisible(), false);
  // In the list of roles.
  await page.locator('tr[data-module=m2] .pick').click();
  await page.waitForSelector('.inspector:visible');
  assert.equal(await head(), 'm2');
  await drawn(page);
  assert.deepEqual(await outlined(), ['m2']);
  assert.ok((await coloured(page, '#1f7ae0')) > 60);
  // Role and why, what runs, neighbours, joints and links with labels and values.
  await page.waitForSelector('.inspector .why.holds:has-text("label foot is tip")');
  const told = await text(page, '.inspector');
  for (const part of [/Leg2\s+since 0:00\.02/, /requirement holds, measured 2 against 2\s+mock\.dyn:2/, /behavior Leg2\.gait/])
    assert.match(told, part);
  assert.match(await text(page, '.inspector .numbers >> nth=0'), /ankle joint_1 −\s+27\.70 °\s+28\.65 °\s+5\.73 °\/s/);
  await keepShot(page, 'inspector');
  // The newest message as a tree, with what is of this module.
  await page.locator('.tree summary:has-text("joints")').click();
  await page.waitForSelector('.tree details:has(summary:has-text("joints")) .tree-leaf:has-text("position0.48")');
  await page.locator('.chip:has-text("m3")').click();
  assert.equal(await head(), 'm3');
  // In a plot: on a line, and in the legend.
  const line = await page.evaluate(() => {
    const [view] = window.monitor.plots.views;
    const { canvas, plot, lines } = view;
    const box = canvas.getBoundingClientRect();
    for (let y = 0; y < canvas.clientHeight; y++) {
      const x = 54 + (canvas.clientWidth - 64) * 0.1;
      if (lines[plot.lineAt(x, y, lines)]?.module === 'm4') return { x: box.left + x, y: box.top + y };
    }
    return null;
  });
  await page.mouse.click(line.x, line.y);
  assert.equal(await head(), 'm4');
  await page.locator('.plot').first().locator('.entry .name').first().click();
  assert.equal(await head(), 'm1');
  // In the view.
  const place = await page.evaluate(() => {
    const { view } = window.monitor.scene;
    const box = view.renderer.domElement.getBoundingClientRect();
    const p = view.robots[0].modulePlaces().get('m5').clone().project(view.camera);
    return { x: box.left + ((p.x + 1) / 2) * box.width, y: box.top + ((1 - p.y) / 2) * box.height };
  });
  await page.mouse.click(place.x, place.y);
  assert.equal(await head(), 'm5');
  // In the list of channels, and what it plots.
  await page.locator('#tab-channels').click();
  await page.locator('.channels .pick:has-text("m2/")').click();
  assert.equal(await head(), 'm2');
  await page.locator('.inspector [aria-label="Plot ankle"]').click();
  await page.waitForFunction(() => window.monitor.plots.views[2]?.plot.drawnPoints > 0);
  assert.match(await page.locator('.legend').last().innerText(), /Leg2\.ankle \(m2\.joint_1\) position[\s\S]*target/);
  await page.keyboard.press('Escape');
  await page.waitForSelector('.inspector', { state: 'hidden' });
  await drawn(page);
  assert.deepEqual(await outlined(), []);
  assert.deepEqual(page.problems, []);
});

test('marks on the time line have labels, tell what happened, and lead there', async () => {
  const page = await live(50);
  await page.evaluate(() => window.server.fault('walk', { module: 'm2', role: 'Leg2', name: 'x', text: 'Leg2 divides 3 by zero' }));
  await page.evaluate(() => window.server.advance('walk', 150));
  await page.waitForFunction(() => Math.round(window.monitor.time * 50) === 199);
  await drawn(page);
  const track = await page.locator('.slider .marks').boundingBox();
  // The fault came a quarter of the way along.
  const x = track.x + (track.width * 49) / 199;
  await page.mouse.move(x + 2, track.y + track.height / 2);
  await page.waitForSelector('.mark-tip:visible');
  assert.equal(await text(page, '.mark-tip'), '0:00.98 m2: Leg2 divides 3 by zero');
  await keepShot(page, 'marks');
  await page.mouse.click(x + 3, track.y + track.height / 2);
  await page.waitForFunction(() => Math.abs(window.monitor.time - 0.98) < 1e-9);
  await page.mouse.move(track.x + track.width * 0.7, track.y + track.height / 2);
  await page.waitForSelector('.mark-tip', { state: 'hidden' });
});

test('of many modules all are in sight, drawn in a few calls, and each can be picked', async () => {
  const page = await openMock(browser, 'large');
  await page.waitForFunction(() => window.monitor.session.runs[0]?.poses.length > 50);
  await page.waitForFunction(() => window.monitor.scene.view.robots[0].trails.length > 0);
  // Each of 300 modules has a foot that would leave a trail.
  assert.equal(await page.evaluate(() => window.monitor.scene.view.robots[0].trails.length), 24);
  const toggle = async (flag) => {
    await page.evaluate((name) => window.monitor.scene.toggle(name), flag);
    await drawn(page);
  };
  // Each trail is drawn by itself; the forces on 300 modules are drawn in one go.
  await toggle('trails');
  const forced = await page.evaluate(() => window.monitor.scene.view.renderer.info.render);
  await toggle('forces');
  const view = () =>
    page.evaluate(() => {
      const { view } = window.monitor.scene;
      const { calls, triangles } = view.renderer.info.render;
      const [robot] = view.robots;
      const seen = [...robot.modulePlaces(() => true)].map(([module, place]) => {
        const { x, y, z } = place.clone().project(view.camera);
        return { module, x, y, z };
      });
      return { calls, triangles, seen };
    });
  const whole = await view();
  assert.equal(forced.calls, whole.calls + 1);
  assert.ok(forced.triangles >= whole.triangles + 300 * 20, `${forced.triangles} triangles with arrows`);
  assert.equal(whole.seen.length, 300);
  for (const { module, x, y, z } of whole.seen)
    assert.ok(Math.max(Math.abs(x), Math.abs(y)) < 1 && z < 1, `${module} is in sight: ${x} ${y} ${z}`);
  assert.ok(whole.calls < 10, `${whole.calls} calls for 600 links`);
  // All links are drawn, as boxes, also those that have another one in them; the mock's obstacle, and the ground.
  assert.equal(whole.triangles, (600 + 1) * 12 + 2);
  // Where the middle and both ends of the row are, no ground is seen, and a click finds them.
  const picture = await pixelsOf(page, '.stage');
  for (const at of [0, 150, 299]) {
    const { module, x, y } = whole.seen[at];
    const [u, v] = [Math.round(((x + 1) / 2) * picture.width), Math.round(((1 - y) / 2) * picture.height)];
    const ground = picture.at(u, v + 40);
    let contrast = 0;
    for (let dx = -3; dx <= 3; dx++)
      for (let dy = -3; dy <= 3; dy++)
        contrast = Math.max(contrast, ...picture.at(u + dx, v + dy).map((c, i) => Math.abs(c - ground[i])));
    assert.ok(contrast > 40, `${module} is drawn at ${u}, ${v}`);
  }
  await keepShot(page, 'many');
  // Near one end the others are out of sight, and are not drawn.
  await page.evaluate(() => window.monitor.scene.view.setCamera([0, 1, 0.5, 0, 0, 0]));
  await drawn(page);
  const near = await view();
  assert.ok(near.triangles < whole.triangles / 4, `${near.triangles} of ${whole.triangles} triangles`);
  await page.locator('.stage canvas').click();
  assert.match(await page.evaluate(() => window.monitor.selected?.module ?? 'none'), /^m\d+$/);
  assert.deepEqual(page.problems, []);
});

test('modules that become known later are in sight, until somebody moves the camera', async (context) => {
  const demo = new Demo();
  context.after(async () => demo.end());
  // Of 150 modules in a row, 18 m, the first tick knows one.
  const monitor = await demo.monitor([demo.recordRow(150, 4)]);
  const opened = async () => {
    const row = await newPage(browser);
    await row.goto(monitor.url);
    await row.waitForFunction(() => window.monitor?.session.runs[0]?.poses.length === 200);
    return row;
  };
  const seen = (row, time) =>
    row.evaluate(async (at) => {
      window.monitor.seek(at);
      const { view } = window.monitor.scene;
      for (const { frames } = view; view.frames < frames + 2;) {
        view.touch();
        await new Promise((done) => requestAnimationFrame(done));
      }
      const places = [...view.robots[0].modulePlaces().values()].map((place) => place.clone().project(view.camera));
      return { all: places.length, inSight: places.filter((p) => Math.max(Math.abs(p.x), Math.abs(p.y)) < 1 && p.z < 1).length };
    }, time);
  const row = await opened();
  assert.ok((await seen(row, 0.02)).all < 5);
  assert.deepEqual(await seen(row, 3.9), { all: 150, inSight: 150 });
  await row.close();
  // Where somebody has zoomed, the camera keeps its place from the robot.
  const near = await opened();
  await seen(near, 0.02);
  const camera = () => near.evaluate(() => window.monitor.scene.view.cameraPlace);
  const before = await camera();
  await near.mouse.move(300, 300);
  await near.mouse.wheel(0, -300);
  while ((await camera()).join() === before.join());
  const zoomed = await camera();
  await seen(near, 3.9);
  (await camera()).forEach((c, i) => assert.ok(Math.abs(c - zoomed[i]) < 1e-6, `${c} is not ${zoomed[i]}`));
  assert.deepEqual([...row.problems, ...near.problems], []);
  await near.close();
});
