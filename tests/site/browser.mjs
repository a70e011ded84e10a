// browser.mjs SITE [all]: opens the pages of `nmsc doc` from file:// in headless Chromium. Fails if anything is logged as
// an error, the face does not move, keys do not work, something does not fit or can hardly be read. `all` opens every
// entry's page, else the first ones do.
import { createRequire } from 'node:module';
import { readdir } from 'node:fs/promises';
import { resolve, join } from 'node:path';
import { pathToFileURL } from 'node:url';
// Installed for the checks of glTF files.
const { chromium } = createRequire(new URL('../glb/package.json', import.meta.url))('playwright-core');

const [site, which = ''] = process.argv.slice(2);
if (!site || !['', 'all'].includes(which)) {
  console.error('usage: browser.mjs SITE [all]');
  process.exit(2);
}
const READY = 120_000; // ms: software rendering on a busy machine
const url = (path) => pathToFileURL(join(resolve(site), path)).href;
const bad = [];
const holds = (what, is) => { if (!is) bad.push(what); };

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
  args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'],
});

async function open(options) {
  const page = await browser.newPage({ viewport: { width: 1280, height: 900 }, ...options });
  const at = () => decodeURI(page.url().split('/').slice(-2).join('/'));
  page.on('console', (m) => { if (['error', 'warning'].includes(m.type()) && !/GPU stall|GL Driver/.test(m.text())) bad.push(`${at()}: console: ${m.text()}`); });
  page.on('pageerror', (e) => bad.push(`${at()}: ${e.message}`));
  page.on('requestfailed', (r) => bad.push(`${at()}: cannot load ${r.url()}`));
  page.on('request', (r) => { if (!/^(file|data|blob):/.test(r.url())) bad.push(`${at()}: asks for ${r.url()}`); });
  return page;
}
const player = async (page, path) => {
  await page.goto(url(path));
  await page.waitForFunction('window.nmsPlayer || window.nmsFailed', null, { timeout: READY });
  const failed = await page.evaluate('window.nmsFailed');
  if (failed) bad.push(`${path}: ${failed}`);
  return !failed;
};
/** Pixels of the canvas that differ between two times of the clip. */
const moved = (page, a, b) => page.evaluate(([from, to]) => {
  const p = window.nmsPlayer;
  const canvas = document.getElementById('face');
  const look = (time) => {
    p.pause();
    p.seek(time);
    const gl = canvas.getContext('webgl2');
    const data = new Uint8Array(4 * gl.drawingBufferWidth * gl.drawingBufferHeight);
    gl.readPixels(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight, gl.RGBA, gl.UNSIGNED_BYTE, data);
    return data;
  };
  const one = look(from), two = look(to);
  let count = 0;
  for (let i = 0; i < one.length; i += 4)
    if (Math.abs(one[i] - two[i]) + Math.abs(one[i + 1] - two[i + 1]) + Math.abs(one[i + 2] - two[i + 2]) > 24) count += 1;
  return count;
}, [a, b]);
/** Texts whose contrast with what is behind them is below 4.5, or 3 for large ones (WCAG 2.2, 1.4.3). */
const faint = (page) => page.evaluate(() => {
  const parse = (color) => color.match(/[\d.]+/g).map(Number);
  const light = ([r, g, b]) => {
    const f = (c) => (c / 255 <= 0.04045 ? c / 255 / 12.92 : ((c / 255 + 0.055) / 1.055) ** 2.4);
    return 0.2126 * f(r) + 0.7152 * f(g) + 0.0722 * f(b);
  };
  const behind = (node) => {
    for (let e = node; e; e = e.parentElement) {
      const color = parse(getComputedStyle(e).backgroundColor);
      if (color.length < 4 || color[3] > 0) return color;
    }
    return [255, 255, 255];
  };
  const out = new Set();
  for (const e of document.querySelectorAll('body *')) {
    if (![...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim()) || e.closest('[hidden], noscript, script') || e.matches('option, .skip')) continue;
    const style = getComputedStyle(e);
    const a = light(parse(style.color)), b = light(behind(e));
    const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    if (ratio < (parseFloat(style.fontSize) >= 24 ? 3 : 4.5)) out.add(`${e.tagName}.${e.className} ${ratio.toFixed(2)}`);
  }
  return [...out];
});
const fits = (page) => page.evaluate(() => document.documentElement.scrollWidth <= innerWidth);

try {
  // ---- The index, by keyboard alone
  const page = await open({});
  await page.goto(url('index.html'));
  const cards = await page.locator('li[data-search]').count();
  const shown = () => page.locator('li[data-search]:visible').count();
  holds('the index says how many entries there are', (await page.textContent('#count')) === `${cards} entries`);
  await page.keyboard.press('Tab');
  holds('the first key goes past the navigation', (await page.evaluate(() => document.activeElement.className)) === 'skip');
  await page.keyboard.press('Tab');
  holds('then comes the search', (await page.evaluate(() => document.activeElement.id)) === 'search');
  await page.keyboard.type('question');
  const found = await shown();
  holds(`"question" finds some of ${cards}: ${found}`, found > 0 && found < cards);
  holds('the count follows', (await page.textContent('#count')).startsWith(`${found} entr`));
  await page.keyboard.press('ArrowDown');
  holds('an arrow goes to the first entry', await page.evaluate(() => document.activeElement.matches('li[data-search]:not([hidden]) a')));
  await page.keyboard.press('ArrowUp');
  holds('and back', (await page.evaluate(() => document.activeElement.id)) === 'search');
  await page.keyboard.type(' zzz');
  holds('words are all looked for', (await shown()) === 0);
  for (let i = 0; i < 4; ++i) await page.keyboard.press('Backspace');
  const first = await page.locator('li[data-search]:visible a').first().getAttribute('href');
  await page.keyboard.press('Enter');
  await page.waitForURL('**/' + first);

  // ---- An entry's page, by keyboard alone
  const ready = await player(page, first);
  if (ready) {
    await page.waitForFunction('window.nmsPlayer.playing && window.nmsPlayer.time > 0', null, { timeout: READY });
    const early = await page.evaluate('window.nmsPlayer.time');
    await page.waitForFunction(`window.nmsPlayer.time !== ${early}`, null, { timeout: READY });
    await page.focus('#play');
    await page.keyboard.press('Space');
    holds('the space bar stops it', (await page.evaluate('window.nmsPlayer.playing')) === false && (await page.textContent('#play')) === 'Play');
    await page.keyboard.press('Tab');
    holds('then comes the time', (await page.evaluate(() => document.activeElement.id)) === 'time');
    await page.keyboard.press('Home');
    await page.keyboard.press('ArrowRight');
    holds('an arrow moves the time on', Math.abs(await page.evaluate('window.nmsPlayer.time') - 0.01) < 1e-6);
    await page.selectOption('#view', 'side');
    holds('three ways to look at it', (await page.evaluate(() => document.querySelectorAll('#view option').length)) === 3);
  }
  await page.close();

  // ---- Every page that is asked for: it loads, and the face moves
  const entries = [];
  for (const folder of await readdir(site, { withFileTypes: true }))
    if (folder.isDirectory() && folder.name !== 'assets')
      for (const file of await readdir(join(site, folder.name)))
        if (file.endsWith('.html')) entries.push(`${folder.name}/${file}`);
  entries.sort();
  const looked = which === 'all' ? entries : entries.slice(0, 3);
  const pages = await open({ viewport: { width: 500, height: 700 }, reducedMotion: 'reduce' });
  for (const path of looked) {
    if (!(await player(pages, path))) continue;
    const telling = await pages.evaluate(() => {
      const { start, telling: t } = document.getElementById('face').dataset;
      return t - start;
    });
    holds(`${path}: who wants less motion sees it stand`, (await pages.evaluate('window.nmsPlayer.playing')) === false);
    const still = (await pages.textContent('dl')).includes('it holds the face as it is');
    const pixels = await moved(pages, 0, telling) + await moved(pages, telling, (await pages.evaluate('window.nmsPlayer.duration')) * 0.999);
    holds(`${path}: ${pixels} pixels move`, still ? pixels === 0 : pixels > 60);
  }
  await pages.close();

  // ---- It fits and can be read, by day and by night
  for (const [width, colorScheme] of [[1280, 'light'], [390, 'dark'], [320, 'light']]) {
    const look = await open({ viewport: { width, height: 844 }, colorScheme, reducedMotion: 'reduce' });
    for (const path of ['index.html', entries[0]]) {
      await look.goto(url(path));
      holds(`${path} fits ${width} pixels`, await fits(look));
      for (const line of await faint(look)) bad.push(`${path}, ${colorScheme}: hard to read: ${line}`);
    }
    await look.close();
  }
  console.log(`${site}: ${cards} entries, ${looked.length} pages played`);
} finally {
  await browser.close();
}
for (const line of bad) console.error(`FAIL ${line}`);
process.exit(bad.length === 0 ? 0 : 1);
