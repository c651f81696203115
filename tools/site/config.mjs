// How the site looks, and what leads to what.
import { readFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { defineConfig } from 'vitepress';
import { slug } from './slug.mjs';

const here = dirname(fileURLToPath(import.meta.url));
const json = (name) => JSON.parse(readFileSync(join(here, name), 'utf8'));
const sections = json('sections.json');
const page = (text, link) => ({ text, link });
/** The grammars of the editor's extension, by the names that fences have. */
const grammar = (file, names) => ({ ...json(file), name: names[0], aliases: names.slice(1) });

const start = [page('What it is', '/'), page('Installing', '/install'), page('Tutorial', '/tutorial'), page('Questions', '/faq')];
const languages = [page('M3L: modules and robots', '/m3l'), page('DynaRole: programs', '/dynarole'), page('Roles: the rules', '/roles'), page("The paper's own text", '/paper')];
const guides = [
  page('Watching in a browser', '/monitor'), page('Watching in a terminal', '/spy'), page('Logs', '/log'), page('Data: plots, tables', '/data'),
  page('Congruent robots', '/congruence'), page('Gaits in figures', '/gaits'), page('Robots at tasks', '/benchmark'), page('Distributed algorithms', '/algorithms'), page('Many runs', '/sweep'), page('Gaits that are found', '/optimise'),
  page('Robots for other programs', '/export'), page('In an editor', '/editor'), page('From Python', '/python'), page('From C++', '/cpp'),
  page('On a microcontroller', '/porting'),
];
const inside = [
  page('Architecture', '/architecture'), page('The virtual machine', '/vm'), page('What it needs', '/footprint'), page('The same bits everywhere', '/arithmetic'),
  page('A campaign of runs', '/campaign'), page('The lockstep as a model', '/lockstep-model'), page('Libraries that were tried', '/libraries'),
  page('Contributing', '/contributing'), page('What has changed', '/changelog'),
];
const reference = [
  page('The command line', '/cli'),
  { text: 'Commands', collapsed: true, link: '/commands/', items: sections.commands },
  { text: 'C++', collapsed: true, items: sections.cpp },
  ...(sections.python ? [page('Python', '/python-reference')] : []),
  page('Wire types', '/wire-types'), page('What the monitor sends', '/monitor-protocol'),
];

export default defineConfig({
  title: 'Morphbus',
  description: 'Programs for modular robots, by role and not by module',
  outDir: process.env.VITEPRESS_OUTPUT,
  cleanUrls: false,
  head: [['link', { rel: 'icon', href: 'data:,' }]],
  markdown: {
    // The documents are GitHub's Markdown: no HTML in them, and headings have the names that GitHub gives them.
    html: false,
    anchor: { slugify: slug },
    languages: [grammar('m3l.json', ['m3l']), grammar('dynarole.json', ['dyn', 'dynarole'])],
    toc: { level: [2, 3] },
  },
  themeConfig: {
    search: { provider: 'local' },
    outline: { level: [2, 3] },
    nav: [page('Start', '/install'), page('Tutorial', '/tutorial'), page('Languages', '/m3l'), page('Commands', '/commands/'), page('Architecture', '/architecture')],
    sidebar: [
      { text: 'Start', items: start },
      { text: 'Languages', items: languages },
      { text: 'Guides', items: guides },
      { text: 'Reference', items: reference },
      { text: 'Inside', collapsed: true, items: inside },
    ],
  },
});
