// The site in a browser: every page can be read at both widths and in both themes, without an error of its scripts or a file that is not
// there, and the search finds what is on it without asking anybody else.
import assert from 'node:assert/strict';
import { createReadStream, existsSync, readdirSync, statSync } from 'node:fs';
import { createServer } from 'node:http';
import { extname, join, relative } from 'node:path';
import { after, before, test } from 'node:test';
import { keepShot, launch, newPage, SIZES, THEMES } from '../monitor/browser.mjs';

const SITE = process.env.MORPHBUS_SITE;
const KINDS = { '.html': 'text/html', '.js': 'text/javascript', '.css': 'text/css', '.json': 'application/json', '.png': 'image/png', '.svg': 'image/svg+xml', '.webp': 'image/webp', '.woff2': 'font/woff2' };
/** Pages of which pictures are kept. */
const SHOWN = ['index', 'tutorial', 'm3l', 'congruence', 'commands/index', 'commands/run', 'cpp/run', 'python-reference', 'faq'];

function pages(folder = SITE) {
  return readdirSync(folder, { withFileTypes: true }).flatMap((entry) => {
    const path = join(folder, entry.name);
    if (entry.isDirectory()) return pages(path);
    return extname(path) === '.html' && entry.name !== '404.html' ? [relative(SITE, path)] : [];
  });
}

let server;
let browser;
let root;
before(async () => {
  server = createServer((request, response) => {
    const path = join(SITE, decodeURIComponent(new URL(request.url, 'http://localhost').pathname));
    const file = existsSync(path) && statSync(path).isDirectory() ? join(path, 'index.html') : path;
    if (!existsSync(file)) {
      response.writeHead(404).end();
      return;
    }
    response.writeHead(200, { 'content-type': KINDS[extname(file)] ?? 'application/octet-stream' });
    createReadStream(file).pipe(response);
  });
  await new Promise((listening) => server.listen(0, '127.0.0.1', listening));
  root = `http://127.0.0.1:${server.address().port}`;
  browser = await launch();
});
after(async () => {
  await browser?.close();
  server?.close();
});

/** A page whose requests to anybody but the site are noted as problems. */
async function sitePage(size, theme) {
  const page = await newPage(browser, size, theme);
  page.on('request', (request) => {
    if (!request.url().startsWith(root) && !request.url().startsWith('data:')) page.problems.push(`asks for ${request.url()}`);
  });
  page.on('response', (response) => {
    if (response.status() >= 400) page.problems.push(`${response.status()} ${response.url()}`);
  });
  return page;
}

for (const size of SIZES) {
  for (const theme of THEMES) {
    test(`every page can be read, ${size.width} wide, ${theme}`, async () => {
      const page = await sitePage(size, theme);
      const all = pages();
      assert.ok(all.length > 70, `${all.length} pages`);
      for (const path of all) {
        await page.goto(`${root}/${path}`, { waitUntil: 'load' });
        const found = await page.evaluate(() => ({
          heading: document.querySelector('h1')?.textContent ?? '',
          beyond: document.documentElement.scrollWidth - document.documentElement.clientWidth,
          broken: [...document.images].filter((image) => image.complete && image.naturalWidth === 0).map((image) => image.src),
          dark: document.documentElement.classList.contains('dark'),
        }));
        assert.notEqual(found.heading, '', path);
        assert.ok(found.beyond <= 0, `${path} is ${found.beyond} pixels wider than the screen`);
        assert.deepEqual(found.broken, [], path);
        assert.equal(found.dark, theme === 'dark', path);
        assert.deepEqual(page.problems, [], path);
        if (SHOWN.includes(path.replace(/\.html$/, ''))) await keepShot(page, `site_${path.replace(/\W/g, '_')}_${size.width}_${theme}`);
      }
      await page.close();
    });
  }
}

test('the search finds what is on a page, and leads there', async () => {
  const page = await sitePage(SIZES[0], 'light');
  await page.goto(`${root}/index.html`);
  await page.locator('.VPNavBarSearch button').first().click();
  await page.locator('.VPLocalSearchBox input').fill('limp');
  const found = page.locator('.VPLocalSearchBox .result', { hasText: 'Modules' }).first();
  await found.waitFor();
  await found.click();
  await page.waitForURL(/m3l\.html#modules/);
  assert.deepEqual(page.problems, []);
  await page.close();
});

test('a command has a page with its options', async () => {
  const page = await sitePage(SIZES[0], 'light');
  await page.goto(`${root}/commands/draw.html`);
  const text = await page.locator('main').innerText();
  for (const wanted of ['morphbus draw [OPTIONS] FILE', '--program PROG.dyn', '-o, --output FILE', 'morphbus draw walk.log --strip 6']) assert.ok(text.includes(wanted), wanted);
  await page.close();
});
