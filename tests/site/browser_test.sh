#!/usr/bin/env bash
# browser_test.sh NMSC ROOT [LEXICON]: the pages of `nmsc doc` in headless Chromium: of two small lexicons, or all pages of
# one of the library. Exit code 77, skipped, where Chromium, node, or what scripts/viewer and npm fetch is not there.
set -euo pipefail
export LC_ALL=C
if [[ $# -lt 2 || $# -gt 3 ]]; then
  echo "usage: browser_test.sh NMSC ROOT [LEXICON]" >&2
  exit 2
fi
nmsc=$(realpath "$1")
root=$(realpath "$2")
skip() { echo "skipped: $*"; exit 77; }
command -v node >/dev/null || skip "no node"
[[ -x ${CHROMIUM:-/usr/bin/chromium} ]] || skip "no Chromium"
[[ -d $root/tests/glb/node_modules/playwright-core ]] || skip "no playwright-core: npm ci --prefix tests/glb"
[[ -f $root/build/viewer/viewer.js ]] || skip "no viewer: scripts/viewer"
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
if [[ $# -eq 3 ]]; then
  "$nmsc" doc --lexicon "$3" --viewer "$root/build/viewer" -o "$dir/site" --tests "$root"/stdlib/tests/*.nms
  node "$root/tests/site/browser.mjs" "$dir/site" all
else
  cd "$root/tests/site"
  "$nmsc" doc --lexicon small.nms --lexicon other.nms --viewer "$root/build/viewer" -o "$dir/site"
  node browser.mjs "$dir/site"
fi
