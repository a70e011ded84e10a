// build.mjs OUT: writes OUT/viewer.js and OUT/viewer.LICENSE.txt, and holds the script against viewer.sha256:
// versions are pinned, so its bytes are. `--record` writes that file anew, after a change of viewer.mjs or a version.
import { createHash } from 'node:crypto';
import { mkdir, readFile, writeFile } from 'node:fs/promises';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';

const [out, option = ''] = process.argv.slice(2);
if (!out || !['', '--record'].includes(option)) {
  console.error('usage: build.mjs OUT [--record]');
  process.exit(2);
}
const here = fileURLToPath(new URL('.', import.meta.url));
const packages = JSON.parse(await readFile(join(here, 'package.json'), 'utf8'));
const result = await build({
  absWorkingDir: here,
  entryPoints: ['viewer.mjs'],
  bundle: true,
  minify: true,
  format: 'iife',
  globalName: 'nmsViewer',
  target: 'es2020',
  charset: 'ascii',
  legalComments: 'none',
  banner: { js: `/* three.js ${packages.dependencies.three}, MIT: see viewer.LICENSE.txt. Made by tools/viewer of nmsc. */` },
  write: false,
});
const script = result.outputFiles[0].contents;
const sum = createHash('sha256').update(script).digest('hex');
const recorded = join(here, 'viewer.sha256');
if (option === '--record') {
  await writeFile(recorded, `${sum}\n`);
} else if ((await readFile(recorded, 'utf8')).trim() !== sum) {
  console.error(`viewer.js is not what viewer.sha256 says: ${sum}`);
  process.exit(1);
}
await mkdir(out, { recursive: true });
await writeFile(join(out, 'viewer.js'), script);
await writeFile(join(out, 'viewer.LICENSE.txt'), await readFile(join(here, 'node_modules/three/LICENSE')));
console.log(`${out}/viewer.js: ${script.length} bytes, ${sum}`);
