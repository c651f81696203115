// Takes docs/pictures/monitor.png anew: both quadrupeds in the monitor, side by side, with the distances of their links.
//
// Usage: node docs/pictures/monitor.mjs [BUILD]     the build's folder, with page and program (default build/release)
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';

const source = resolve(dirname(fileURLToPath(import.meta.url)), '../..');
const build = resolve(source, process.argv[2] ?? 'build/release');
process.env.MORPHBUS_SOURCE ??= source;
process.env.MORPHBUS_BIN ??= join(build, 'bin');
process.env.MORPHBUS_PAGE_WORK ??= join(build, 'tools/monitor/page');
process.env.MORPHBUS_SHOTS = join(source, 'docs/pictures');
const { drawn, keepShot, launch, newPage } = await import('../../test/monitor/browser.mjs');
const { Demo } = await import('../../test/monitor/demo.mjs');

const TIME = 12.1; // s

const demo = new Demo();
const browser = await launch();
try {
  const logs = [demo.record('quadruped', 'quadruped', 20), demo.record('equivalent_quadruped', 'equivalent', 20)];
  const monitor = await demo.monitor(logs);
  const page = await newPage(browser);
  await page.goto(monitor.url);
  await page.waitForFunction(() => window.monitor?.session.difference?.table.length === 1000);
  await page.evaluate((time) => window.monitor.seek(time), TIME);
  await page.locator('#tab-compare').click();
  await drawn(page);
  await keepShot(page, 'monitor');
} finally {
  await browser.close();
  await demo.end();
}
