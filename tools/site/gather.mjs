// Puts the pages of the site together, in the folder of --output: docs/*.md as they are, what stands in README.md, lcmtypes/ and
// CONTRIBUTING.md, a page a command, a page a library, and one for Python.
import { execFileSync } from 'node:child_process';
import { cpSync, mkdirSync, readFileSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { parseArgs } from 'node:util';
import { slug } from './slug.mjs';

const { values, positionals } = parseArgs({
  options: { source: { type: 'string' }, morphbus: { type: 'string' }, python: { type: 'string' }, output: { type: 'string' } },
  allowPositionals: true,
});
const { source, morphbus, output } = values;
const here = dirname(fileURLToPath(import.meta.url));

function read(...path) {
  return readFileSync(join(source, ...path), 'utf8');
}

function write(path, text) {
  mkdirSync(dirname(join(output, path)), { recursive: true });
  writeFileSync(join(output, path), text);
}

/** Text that a table's cell takes as it is. */
function cell(text) {
  return text.replaceAll('|', '\\|').replaceAll('<', '\\<').replaceAll('\n', ' ');
}

/** In a fence's first line docs/tutorial.md names the file that it holds, which the text before it says, too. */
function withoutFileNames(text) {
  return text.replace(/^```(\w+) \S+$/gm, '```$1');
}

/** Documents outside docs/ that the site has, by their page. */
const others = { 'wire-types.md': 'lcmtypes/README.md', 'contributing.md': 'CONTRIBUTING.md', 'changelog.md': 'CHANGELOG.md' };

/** Links of a document of `folder` ('' or 'lcmtypes'), as they are among the pages: what is no page is named and not linked. */
function pageLinks(text, folder) {
  return text.replace(/(!?)\[([^\]]*)\]\(([^)\s]+)\)/g, (whole, picture, name, target) => {
    if (/^[a-z]+:|^#/.test(target)) return whole;
    const [file, anchor] = target.split('#');
    const path = join(folder, file);
    if (path.startsWith('docs/')) return `${picture}[${name}](${path.slice('docs/'.length)}${anchor ? `#${anchor}` : ''})`;
    const page = Object.keys(others).find((key) => others[key] === path);
    return page ? `[${name}](${page}${anchor ? `#${anchor}` : ''})` : name;
  });
}

/** `--set NAME=VALUE`, with its other names before it; of an argument its name. */
function optionWords(option) {
  if (!option.names[0].startsWith('-')) return `\`${option.names[0]}\``;
  const value = option.values === 0 ? '' : option.value_optional ? ` [${option.type}]` : ` ${option.type}`;
  return `\`${option.names.join(', ')}${value}\``;
}

function tableOf(options, heading) {
  if (options.length === 0) return '';
  const rows = options.map((option) => `| ${cell(optionWords(option))} | ${cell(option.what)} |`);
  return `| ${heading} | |\n|---|---|\n${rows.join('\n')}\n\n`;
}

/** The end of the help: what is indented there are lines to type. */
function footerText(footer) {
  return footer.replace(/^((?:  .*\n?)+)/gm, (lines) => `\n\`\`\`sh\n${lines.replace(/^  /gm, '').trimEnd()}\n\`\`\`\n`);
}

function commandText(command, words, heading) {
  const isArgument = (option) => !option.names[0].startsWith('-');
  const isHelp = (option) => option.names.includes('--help');
  const given = command.options.filter(isArgument);
  const usage = given.map((o) => (o.required ? o.names[0] : `[${o.names[0]}]`) + (o.values === 1 ? '' : '...')).join(' ');
  const below = command.commands.map((one) => commandText(one, `${words} ${one.name}`, `${heading}#`)).join('');
  const synopsis = command.commands.length ? `${words} COMMAND ...` : `${words} [OPTIONS] ${usage}`;
  return `${heading} ${words}\n\n${command.what}.\n\n\`\`\`\n${synopsis.trim()}\n\`\`\`\n\n` +
    tableOf(given, 'argument') + tableOf(command.options.filter((o) => !isArgument(o) && !isHelp(o)), 'option') +
    `${footerText(command.footer)}\n\n${below}`;
}

function writeCommands() {
  const program = JSON.parse(execFileSync(morphbus, ['man', '--json'], { encoding: 'utf8' }));
  const explained = read('docs', 'cli.md');
  const pages = program.commands.map((command) => {
    // docs/cli.md explains some of the commands under one heading.
    const heading = explained.match(new RegExp(`^### (.*\`${command.name}\`.*)$`, 'm'))?.[1];
    const more = heading ? ` [What it prints and how it is meant](../cli.md#${slug(heading)}).` : '';
    const text = commandText(command, `morphbus ${command.name}`, '#');
    write(`commands/${command.name}.md`, text.replace(`\n\n${command.what}.`, (line) => line + more));
    return { text: command.name, link: `/commands/${command.name}`, what: command.what };
  });
  const rows = pages.map((page) => `| [\`${page.text}\`](${page.text}.md) | ${cell(page.what)} |`);
  write('commands/index.md', `# Commands\n\nAll are commands of one program, \`morphbus\`. [The command line](../cli.md) explains them by what they are for.\n\n` +
    `| command | does |\n|---|---|\n${rows.join('\n')}\n\n${footerText(program.footer)}\n`);
  return pages.map(({ text, link }) => ({ text, link }));
}

/** A page a library: what its headers say of themselves. */
function writeLibraries() {
  const table = [...read('docs', 'cpp.md').matchAll(/^\| `(\w+)` \| (`.*?`) \| (.*) \|$/gm)];
  const common = readdirSync(join(source, 'include/morphbus')).filter((name) => name.endsWith('.h'));
  const pages = [['common', common.map((name) => name), 'What all libraries have: poses, failures, diagnostics.'],
    ...table.map(([, name, , what]) => [name, readdirSync(join(source, 'include/morphbus', name)).map((file) => `${name}/${file}`), `${what[0].toUpperCase()}${what.slice(1)}.`])];
  for (const [name, headers, what] of pages) {
    const texts = headers.map((header) => {
      // What stands at its head is for people, and what it includes is no part of what it offers.
      const [, head, rest] = read('include/morphbus', header).match(/^#pragma once\n((?:\/\/.*\n)*)([^]*)$/);
      const about = head.replace(/^\/\/ ?/gm, '').replaceAll('<', '\\<');
      const code = rest.replace(/^#include.*\n/gm, '').replace(/^namespace morphbus \{\n|^\}  \/\/ namespace morphbus\n?/gm, '')
        .replaceAll('MORPHBUS_EXPORT ', '').replace(/\n{3,}/g, '\n\n').trim();
      return `## morphbus/${header}\n\n${about}\n\`\`\`cpp\n${code}\n\`\`\`\n`;
    });
    const use = name === 'common' ? '' : `\`\`\`cmake\nfind_package(Morphbus REQUIRED COMPONENTS ${name})\ntarget_link_libraries(my_tool Morphbus::${name})\n\`\`\`\n\n`;
    write(`cpp/${name}.md`, `# C++: ${name}\n\n${what} [From C++](../cpp.md) tells how the libraries are found.\n\n${use}${texts.join('\n')}`);
  }
  return pages.map(([name]) => ({ text: name, link: `/cpp/${name}` }));
}

rmSync(output, { recursive: true, force: true });
mkdirSync(join(output, '.vitepress/theme'), { recursive: true });
for (const name of readdirSync(join(source, 'docs')).filter((file) => file.endsWith('.md'))) {
  write(name, pageLinks(withoutFileNames(read('docs', name)), 'docs'));
}
for (const [page, path] of Object.entries(others)) write(page, pageLinks(read(path), dirname(path) === '.' ? '' : dirname(path)));
cpSync(join(source, 'docs/pictures'), join(output, 'pictures'), { recursive: true, filter: (path) => !/\.(py|mjs|dot)$/.test(path) });
const sections = { commands: writeCommands(), cpp: writeLibraries() };
if (values.python) {
  const text = execFileSync(values.python, [join(here, 'python_reference.py')], { encoding: 'utf8', env: { ...process.env, PYTHONPATH: positionals[0] } });
  write('python-reference.md', text);
  sections.python = true;
}
write('.vitepress/sections.json', JSON.stringify(sections));
for (const language of ['m3l', 'dynarole']) cpSync(join(source, `tools/editor/${language}.tmLanguage.json`), join(output, `.vitepress/${language}.json`));
for (const file of ['config.mjs', 'slug.mjs', 'theme/index.mjs', 'theme/style.css']) cpSync(join(here, file), join(output, '.vitepress', file));
cpSync(join(here, 'index.md'), join(output, 'index.md'));
// The first page names its picture by where it lies on the site.
cpSync(join(source, 'docs/pictures/walking.webp'), join(output, 'public/walking.webp'));
