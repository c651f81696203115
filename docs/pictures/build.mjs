// Takes docs/pictures/build.png anew: a step of the sheet by which the quadruped is put together.
//
// Usage: node docs/pictures/build.mjs [BUILD]     the build's folder, with page and program (default build/release)
import { execFileSync } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';

const source = resolve(dirname(fileURLToPath(import.meta.url)), '../..');
const build = resolve(source, process.argv[2] ?? 'build/release');
process.env.MORPHBUS_SOURCE ??= source;
process.env.MORPHBUS_BIN ??= join(build, 'bin');
process.env.MORPHBUS_PAGE_WORK ??= join(build, 'tools/monitor/page');
process.env.MORPHBUS_SHOTS = join(source, 'docs/pictures');
const { launch, newPage } = await import('../../test/monitor/browser.mjs');

const folder = mkdtempSync(join(tmpdir(), 'morphbus-build-'));
const browser = await launch();
try {
  const sheet = join(folder, 'sheet.html');
  const model = join(source, 'models/mtran.m3l');
  execFileSync(join(process.env.MORPHBUS_BIN, 'morphbus'), ['build', model, '--robot', 'quadruped', '-o', sheet]);
  const page = await newPage(browser, { width: 1000, height: 900 });
  await page.goto(`file://${sheet}`);
  // m3 is put on two connectors at once, and closes a loop.
  const step = page.locator('.block', { has: page.getByRole('heading', { name: /^Step 3 / }) });
  await step.screenshot({ path: join(process.env.MORPHBUS_SHOTS, 'build.png') });
} finally {
  await browser.close();
  rmSync(folder, { recursive: true });
}
