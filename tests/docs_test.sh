#!/usr/bin/env bash
# docs_test.sh NMSC ROOT: runs `nmsc check` on every ```nms block of README.md and docs/*.md.
# A block opened with ```nms fail must be refused, with exit code 1.
set -euo pipefail
export LC_ALL=C
if [[ $# -ne 2 ]]; then
  echo "usage: docs_test.sh NMSC ROOT" >&2
  exit 2
fi
nmsc=$1
root=$2
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT

shopt -s nullglob
count=0
failed=0
for page in "$root"/README.md "$root"/docs/*.md "$root"/docs/decisions/*.md; do
  rm -f "$dir"/*.nms
  # One file per block, padded with empty lines so that a diagnostic's line is the page's own.
  awk -v dir="$dir" '
    /^```nms( fail)?[ \t]*$/ { file = sprintf("%s/%05d%s.nms", dir, NR, /fail/ ? "_fail" : ""); for (i = 1; i <= NR; ++i) print "" > file; next }
    /^```/ && file != "" { close(file); file = ""; next }
    file != "" { print > file }' "$page"
  for block in "$dir"/*.nms; do
    count=$((count + 1))
    status=0
    "$nmsc" check "$block" >"$dir/log" 2>&1 || status=$?
    case $block in
      *_fail.nms) want=1 ;;
      *) want=0 ;;
    esac
    if [[ $status -ne $want ]]; then
      failed=$((failed + 1))
      line=$(basename "$block" .nms)
      line=${line%_fail}
      echo "${page#"$root"/}:$((10#$line)): exit code $status, expected $want"
      sed 's/^/    /' "$dir/log"
    fi
  done
done
echo "$count blocks, $failed wrong"
[[ $failed -eq 0 && $count -gt 0 ]]
