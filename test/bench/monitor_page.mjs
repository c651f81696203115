#!/usr/bin/env node
// How many frames a second the monitor's page draws, in Chromium at 1280 x 800 with rendering in software: of a nine-module
// robot that runs in real time, of a log that is played with nothing else running, and of a log of 500 modules, once the page has
// read them. Goals: 20, 30 and 20.
// Usage: test/bench/monitor_page.mjs BUILD_FOLDER [SECONDS]
import { join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';

const [folder, seconds = '10'] = process.argv.slice(2);
if (!folder) {
  console.error('usage: monitor_page.mjs BUILD_FOLDER [SECONDS]');
  process.exit(2);
}
process.env.MORPHBUS_BIN = resolve(folder, 'bin');
process.env.MORPHBUS_SOURCE = fileURLToPath(new URL('../..', import.meta.url));
process.env.MORPHBUS_PAGE_WORK = resolve(folder, 'tools/monitor/page');
process.env.MORPHBUS_SHOTS = join(resolve(folder), 'monitor');
const { launch, newPage } = await import('../monitor/browser.mjs');
const { Demo } = await import('../monitor/demo.mjs');

/** Waits until the page has all of its log. */
function read(page) {
  const whole = () => window.monitor?.session.runs.length && window.monitor.session.runs.every((run) => window.monitor.session.loaded(run) >= 1);
  return page.waitForFunction(whole, null, { timeout: 600_000 });
}

/** Frames a second that the view draws while it is looked at. */
async function measure(page) {
  await page.waitForFunction(() => window.monitor?.session.runs[0]?.poses.length > 100);
  return page.evaluate(async (wanted) => {
    const { view } = window.monitor.scene;
    const [began, frames] = [performance.now(), view.frames];
    await new Promise((done) => setTimeout(done, wanted * 1000));
    return ((view.frames - frames) * 1000) / (performance.now() - began);
  }, Number(seconds));
}

const demo = new Demo();
const browser = await launch();
try {
  await demo.run('quadruped', 'live', 'speed', '1');
  const live = await demo.monitor(['--run', 'live']);
  const page = await newPage(browser);
  await page.goto(live.url);
  console.log(`live, nine modules   ${(await measure(page)).toFixed(1)} frames/s (goal 20)`);
  await page.close();
  for (const child of demo.processes) if (child.exitCode === null) await demo.stop(child);

  const log = demo.record('quadruped', 'recorded', 30);
  const played = await demo.monitor([log]);
  const second = await newPage(browser);
  await second.goto(played.url);
  await read(second);
  await second.keyboard.press('Space');
  console.log(`log, nine modules    ${(await measure(second)).toFixed(1)} frames/s (goal 30)`);
  await second.close();

  // Poses reach the last module after 500 ticks of 20 ms.
  const settled = 10.5;
  const end = settled + Number(seconds);
  const large = await demo.monitor([demo.recordRow(500, end)]);
  const third = await newPage(browser);
  await third.goto(large.url);
  await read(third);
  await third.evaluate((time) => window.monitor.clock.seek(time), settled);
  await third.keyboard.press('Space');
  console.log(`log, 500 modules     ${(await measure(third)).toFixed(1)} frames/s (goal 20)`);
} finally {
  await browser.close();
  await demo.end();
}
