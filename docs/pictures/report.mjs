// Takes docs/pictures/report.png anew: both robots in the report on two quadrupeds of which one has weaker motors.
//
// Usage: node docs/pictures/report.mjs [BUILD]     the build's folder, with page and program (default build/release)
import { execFileSync } from 'node:child_process';
import { mkdtempSync, rmSync, symlinkSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';

const source = resolve(dirname(fileURLToPath(import.meta.url)), '../..');
const build = resolve(source, process.argv[2] ?? 'build/release');
process.env.MORPHBUS_SOURCE ??= source;
process.env.MORPHBUS_BIN ??= join(build, 'bin');
process.env.MORPHBUS_PAGE_WORK ??= join(build, 'tools/monitor/page');
process.env.MORPHBUS_SHOTS = join(source, 'docs/pictures');
const { keepShot, launch, newPage } = await import('../../test/monitor/browser.mjs');

const folder = mkdtempSync(join(tmpdir(), 'morphbus-report-'));
/** One command; a comparison that finds a difference ends with status 1. */
function morphbus(...args) {
  try {
    execFileSync(join(process.env.MORPHBUS_BIN, 'morphbus'), args, { cwd: folder, stdio: 'ignore' });
  } catch (error) {
    if (error.status !== 1) throw error;
  }
}
const browser = await launch();
try {
  // Paths stand in the report as they are given.
  symlinkSync(join(source, 'models'), join(folder, 'models'));
  const walk = (robot, torque, log) =>
    morphbus('run', 'models/mtran.m3l', 'models/programs/quadruped.dyn', '--robot', robot, '--seconds', '20', '--inproc', '--run', robot,
      ...(torque ? ['--set', `MTRAN.joint_1.torque=${torque}`] : []), '--log', log);
  walk('quadruped', '', 'a.log');
  walk('equivalent_quadruped', '1.2', 'weak.log');
  morphbus('compare', 'a.log', 'weak.log', '--report', 'report.html');
  const page = await newPage(browser, { width: 1280, height: 1000 });
  await page.goto(`file://${join(folder, 'report.html')}`);
  await page.waitForLoadState('load');
  // Both robots, at the beginning and where they part, in the colours of their roles.
  await page.getByText('Both robots', { exact: true }).evaluate((heading) => heading.scrollIntoView());
  await keepShot(page, 'report');
} finally {
  await browser.close();
  rmSync(folder, { recursive: true });
}
