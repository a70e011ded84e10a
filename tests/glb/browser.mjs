// browser.mjs FILE OUT.png [CLIP [TIME]]: plays a .glb with three.js in headless Chromium and keeps a picture.
// Fails if anything is logged as an error, nothing is drawn, or the picture at TIME (default: where most moves) does
// not differ from the one at rest.
import { createServer } from 'node:http';
import { readFile, writeFile } from 'node:fs/promises';
import { extname, join, normalize } from 'node:path';
import { fileURLToPath } from 'node:url';
import { chromium } from 'playwright-core';

const [file, out, clip = '', time = ''] = process.argv.slice(2);
if (!file || !out) {
  console.error('usage: browser.mjs FILE OUT.png [CLIP [TIME]]');
  process.exit(2);
}
const here = fileURLToPath(new URL('.', import.meta.url));
const types = { '.html': 'text/html', '.js': 'text/javascript', '.mjs': 'text/javascript', '.glb': 'model/gltf-binary' };
const server = createServer(async (request, response) => {
  const path = normalize(decodeURIComponent(new URL(request.url, 'http://x').pathname));
  try {
    const body = await readFile(path === '/model.glb' ? file : join(here, path));
    response.writeHead(200, { 'content-type': types[extname(path)] ?? 'application/octet-stream' });
    response.end(body);
  } catch {
    response.writeHead(path === '/favicon.ico' ? 204 : 404);
    response.end();
  }
});
await new Promise((done) => server.listen(0, '127.0.0.1', done));

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
  args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'],
});
let bad = [];
try {
  const page = await browser.newPage({ viewport: { width: 720, height: 800 } });
  page.on('console', (m) => { if (m.type() === 'error') bad.push(`console: ${m.text()}`); });
  page.on('pageerror', (e) => bad.push(`page: ${e.message}`));
  await page.goto(`http://127.0.0.1:${server.address().port}/player.html`);
  await page.waitForFunction('window.ready || window.failed', null, { timeout: 120_000 });
  const result = await page.evaluate(([c, t]) => window.failed ? { failed: window.failed } : window.play(c, t), [clip, time]);
  if (result.failed) {
    bad.push(result.failed);
  } else {
    await writeFile(out, await page.locator('canvas').screenshot());
    console.log(`${file}: ${result.clips.length} clips (${result.clips.join(', ')}), ${result.targets} targets; ` +
      `${result.clip} at ${result.time.toFixed(3)} s moves ${result.moved} pixels of ${result.drawn}`);
    if (result.drawn < 10_000) bad.push(`only ${result.drawn} pixels are drawn`);
    if (result.moved < 500) bad.push(`only ${result.moved} pixels differ from the face at rest`);
  }
} finally {
  await browser.close();
  server.close();
}
for (const line of bad) console.error(`FAIL ${line}`);
process.exit(bad.length === 0 ? 0 : 1);
