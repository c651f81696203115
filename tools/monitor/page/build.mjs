// Builds the page: node build.mjs OUTPUT_FOLDER, in a folder that has node_modules and links to src and tsconfig.json
// (CMakeLists.txt makes it, so that nothing is left among the sources). Checks the types, bundles the scripts, and writes the licences of what is
// bundled beside them. The folder holds the whole page then; nothing is loaded from elsewhere.
// `node build.mjs OUTPUT_FOLDER ENTRY.ts` makes a page with another beginning, as tests do.
// `node build.mjs --script OUTPUT.js ENTRY.ts` makes one script for the pages of reports, with the licences beside it instead;
// `node build.mjs --tests OUTPUT_FOLDER TEST.ts...` bundles tests of the pages' logic for `node --test`.
import { execFileSync } from 'node:child_process';
import { copyFileSync, mkdirSync, readFileSync, existsSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

const here = process.cwd();
const require = createRequire(join(here, 'package.json'));
const { build } = require('esbuild');
const shared = { absWorkingDir: here, bundle: true, preserveSymlinks: true, logLevel: 'warning', target: 'es2022' };

if (process.argv[2] === '--tests') {
  const [out, ...tests] = process.argv.slice(3);
  await build({
    ...shared,
    entryPoints: tests,
    outdir: out,
    platform: 'node',
    format: 'esm',
    outExtension: { '.js': '.mjs' },
    sourcemap: 'inline',
    nodePaths: [join(here, 'node_modules')],
  });
} else if (process.argv[2] === '--script') {
  const [out, entry] = process.argv.slice(3);
  mkdirSync(dirname(out), { recursive: true });
  const result = await build({
    ...shared,
    entryPoints: [entry],
    outfile: out,
    format: 'iife',
    minify: true,
    metafile: true,
    legalComments: 'none',
  });
  writeFileSync(join(dirname(out), 'licenses.txt'), licences(Object.keys(result.metafile.inputs)));
} else {
  const [out, entry = 'src/main.ts'] = process.argv.slice(2);
  if (!out) throw new Error('usage: node build.mjs OUTPUT_FOLDER');
  execFileSync(process.execPath, [require.resolve('typescript/bin/tsc'), '-p', here], { stdio: 'inherit' });
  mkdirSync(out, { recursive: true });
  const result = await build({
    ...shared,
    entryPoints: { app: entry },
    outdir: out,
    format: 'esm',
    loader: { '.bin': 'binary' },
    minify: true,
    metafile: true,
    legalComments: 'none',
  });
  await build({ ...shared, entryPoints: { app: 'src/app.css' }, outdir: out, minify: true });
  copyFileSync(join(dirname(fileURLToPath(import.meta.url)), 'index.html'), join(out, 'index.html'));
  writeFileSync(join(out, 'licenses.txt'), licences(Object.keys(result.metafile.inputs)));
}

// The licence texts of all packages of which a file was bundled. Throws if one of them cannot be told.
function licences(inputs) {
  const files = new Map();
  // What packages leave out in browsers is listed, too, as disabled.
  for (const path of inputs.filter((input) => !input.startsWith('(disabled):'))) {
    const folder = /^(.*node_modules\/(?:@[^/]+\/)?[^/]+)\//.exec(path)?.[1];
    if (folder) files.set(folder, [...(files.get(folder) ?? []), path]);
  }
  const texts = [...files].sort().map(([folder, paths]) => {
    const { name, version, license } = JSON.parse(readFileSync(join(folder, 'package.json'), 'utf8'));
    const file = ['LICENSE', 'LICENSE.md', 'LICENSE.txt'].map((f) => join(folder, f)).find((f) => existsSync(f));
    const notice = join(folder, 'NOTICE');
    const text =
      (file ? readFileSync(file, 'utf8') : textsByName(name, license, paths)) +
      (existsSync(notice) ? `\n${readFileSync(notice, 'utf8')}` : '');
    return `${name} ${version}: ${license}\n\n${text}`;
  });
  return `Software of others that is part of this page.\n\n${texts.join(`\n${'-'.repeat(80)}\n\n`)}`;
}

// What a package without a file for its licence says of it: the notices at the head of its files, and the texts of the
// licences that it names, as far as the notices do not hold them.
function textsByName(name, license, paths) {
  const notices = new Set();
  for (const path of paths) {
    const head = /^(?:\/\/.*\n)+/.exec(readFileSync(path, 'utf8'))?.[0] ?? '';
    if (/copyright/i.test(head)) notices.add(head.replace(/^\/\/ ?/gm, ''));
  }
  const parts = [...notices];
  // By what a text of each licence is recognized.
  const known = { 'Apache-2.0': 'TERMS AND CONDITIONS FOR USE', 'BSD-3-Clause': 'Redistribution and use in source' };
  for (const id of license.match(/[A-Za-z][\w.-]+/g).filter((word) => !['AND', 'OR', 'WITH'].includes(word))) {
    if (known[id] && parts.some((part) => part.includes(known[id]))) continue;
    const path = join(dirname(fileURLToPath(import.meta.url)), 'licenses', `${id}.txt`);
    if (!existsSync(path)) throw new Error(`${name}: there is no text of its licence ${id}; put it into ${path}`);
    parts.push(readFileSync(path, 'utf8'));
  }
  return parts.join('\n');
}
