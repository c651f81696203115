// Builds the extension's script, in a folder that has node_modules and links to src and tsconfig.json (CMakeLists.txt makes it): checks
// the types, and bundles extension.js with the licences of what is in it; and preview_page.mjs, the page of the preview, for tests.
import { execFileSync } from 'node:child_process';
import { existsSync, readFileSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';

const here = process.cwd();
const require = createRequire(join(here, 'package.json'));
const { build } = require('esbuild');
const shared = { absWorkingDir: here, bundle: true, preserveSymlinks: true, logLevel: 'warning', platform: 'node', target: 'node18' };

execFileSync(process.execPath, [require.resolve('typescript/bin/tsc'), '-p', here, '--preserveSymlinks'], { stdio: 'inherit' });
const result = await build({
  ...shared,
  entryPoints: ['src/extension.ts'],
  outfile: 'extension.js',
  format: 'cjs',
  external: ['vscode'],
  minify: true,
  metafile: true,
  legalComments: 'none',
});
await build({ ...shared, entryPoints: ['src/preview_page.ts'], outfile: 'preview_page.mjs', format: 'esm' });

const folders = new Set(
  Object.keys(result.metafile.inputs).flatMap((path) => /^(.*node_modules\/(?:@[^/]+\/)?[^/]+)\//.exec(path)?.[1] ?? []),
);
const texts = [...folders].sort().map((folder) => {
  const { name, version, license } = JSON.parse(readFileSync(join(folder, 'package.json'), 'utf8'));
  const file = ['LICENSE', 'LICENSE.md', 'License.txt', 'LICENSE.txt'].map((f) => join(folder, f)).find((f) => existsSync(f));
  if (!file) throw new Error(`the licence of ${name} has no text`);
  return `${name} ${version}: ${license}\n\n${readFileSync(file, 'utf8')}`;
});
writeFileSync('licenses.txt', `Software of others that is part of this extension.\n\n${texts.join(`\n${'-'.repeat(80)}\n\n`)}`);
