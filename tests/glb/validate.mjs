// validate.mjs FILE...: the Khronos validator; whatever it has to say fails.
import { readFile } from 'node:fs/promises';
import { basename } from 'node:path';
import validator from 'gltf-validator';

const files = process.argv.slice(2);
if (files.length === 0) {
  console.error('usage: validate.mjs FILE...');
  process.exit(2);
}
let bad = 0;
for (const file of files) {
  const report = await validator.validateBytes(new Uint8Array(await readFile(file)), {
    uri: basename(file), maxIssues: 50, writeTimestamp: false,
  });
  const { numErrors, numWarnings, numInfos, messages } = report.issues;
  const wrong = numErrors + numWarnings + numInfos > 0;
  if (wrong) bad += 1;
  const info = report.info;
  console.log(`${wrong ? 'FAIL' : 'ok  '} ${file}: ${numErrors} errors, ${numWarnings} warnings, ${numInfos} infos; ` +
    `${info.animationCount ?? 0} animations, ${info.totalVertexCount ?? 0} vertices`);
  for (const m of messages) {
    if (m.severity <= 2) console.log(`     ${['error', 'warning', 'info'][m.severity]} ${m.code} ${m.pointer ?? ''}: ${m.message}`);
  }
}
process.exit(bad === 0 ? 0 : 1);
