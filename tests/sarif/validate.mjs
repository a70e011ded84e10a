// validate.mjs NMSC ROOT: what nmsc writes as SARIF is valid against the schema of SARIF 2.1.0 (OASIS), with and
// without results; and the check can fail: each of some broken logs is refused.
import { spawnSync } from "node:child_process";
import { readFileSync, readdirSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import Ajv from "ajv-draft-04";
import addFormats from "ajv-formats";

const [nmsc, root] = process.argv.slice(2);
if (root === undefined) {
  console.error("usage: validate.mjs NMSC ROOT");
  process.exit(2);
}
const require = createRequire(import.meta.url);
const folder = dirname(require.resolve("@microsoft/jest-sarif/package.json"));
const schema = JSON.parse(readFileSync(join(folder, "lib/schemas/sarif-2.1.0-rtm.5.json"), "utf8"));
// A pattern of the schema is no regular expression in Unicode mode.
const ajv = new Ajv({ strict: false, allErrors: true, unicodeRegExp: false });
addFormats(ajv);
const valid = ajv.compile(schema);

let failed = 0;
function sarif(...args) {
  return JSON.parse(spawnSync(nmsc, ["--error-format=sarif", ...args], { encoding: "utf8", cwd: root }).stderr);
}
function expectValid(what, log) {
  if (valid(log)) return;
  failed += 1;
  console.log(`${what}: ${ajv.errorsText(valid.errors, { separator: "\n    " })}`);
}

let results = 0;
const kinds = new Set();
const checks = "tests/golden/check";
const sources = readdirSync(join(root, checks)).filter((name) => name.endsWith(".nms"));
for (const name of sources) {
  const log = sarif("check", `${checks}/${name}`);
  expectValid(name, log);
  for (const result of log.runs[0].results) {
    results += 1;
    kinds.add(result.ruleId);
    const rule = log.runs[0].tool.driver.rules[result.ruleIndex];
    if (rule.id !== result.ruleId) {
      failed += 1;
      console.log(`${name}: rule ${result.ruleIndex} is ${rule.id}, not ${result.ruleId}`);
    }
  }
}
expectValid("no results", sarif("check", "examples/wh_question.nms"));
expectValid("a failure of the world", sarif("check", "nowhere.nms"));

// The check itself: what is broken must be refused.
const good = sarif("check", `${checks}/fail_unknown_name.nms`);
const breaks = {
  "no version": (log) => delete log.version,
  "another version": (log) => (log.version = "2.0.0"),
  "no tool": (log) => delete log.runs[0].tool,
  "no message": (log) => delete log.runs[0].results[0].message,
  "an unknown level": (log) => (log.runs[0].results[0].level = "fatal"),
  "line 0": (log) => (log.runs[0].results[0].locations[0].physicalLocation.region.startLine = 0),
  "a field that SARIF does not have": (log) => (log.runs[0].results[0].severity = "error"),
};
for (const [name, damage] of Object.entries(breaks)) {
  const log = structuredClone(good);
  damage(log);
  if (valid(log)) {
    failed += 1;
    console.log(`a log with ${name} is called valid`);
  }
}
const count = sources.length + 2 + Object.keys(breaks).length;
console.log(`${count} logs of ${results} results and ${kinds.size} kinds, ${failed} wrong`);
process.exit(failed === 0 && results > 50 && kinds.size > 30 ? 0 : 1);
