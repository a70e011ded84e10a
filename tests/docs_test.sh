#!/usr/bin/env bash
# docs_test.sh NMSC ROOT: runs `nmsc check` on every ```nms block of README.md and docs/*.md.
# A block opened with ```nms fail must be refused, with exit code 1. Tests in the other blocks must pass.
#
# A page may also be a session: a block opened with a language and a file's name is that file, in a folder that the page
# has to itself; ```sh run [CODE] is run there, and must exit with CODE, else 0; ```text output is what the run before it
# prints, on both streams. Hashes change with the program's version: they are compared as HASH.
set -euo pipefail
export LC_ALL=C
if [[ $# -ne 2 ]]; then
  echo "usage: docs_test.sh NMSC ROOT" >&2
  exit 2
fi
nmsc=$(realpath "$1")
root=$(realpath "$2")
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
    case $block in
      *_fail.nms) want=1 command=check ;;
      *) want=0 command=check
        if grep -q '^test "' "$block"; then command=test; fi ;;
    esac
    "$nmsc" "$command" "$block" >"$dir/log" 2>&1 || status=$?
    if [[ $status -ne $want ]]; then
      failed=$((failed + 1))
      line=$(basename "$block" .nms)
      line=${line%_fail}
      echo "${page#"$root"/}:$((10#$line)): exit code $status, expected $want"
      sed 's/^/    /' "$dir/log"
    fi
  done
done

# ---- Sessions
wrong() {
  failed=$((failed + 1))
  echo "${page#"$root"/}:$((10#$line)): $1"
  sed 's/^/    /' "$dir/log"
}
mkdir "$dir/bin"
ln -s "$nmsc" "$dir/bin/nmsc"
export PATH="$dir/bin:$PATH"
for page in "$root"/docs/*.md; do
  session=$dir/session
  rm -rf "$session" "$dir"/*.block
  mkdir "$session"
  awk -v dir="$dir" '
    /^```/ && file != "" { close(file); file = ""; next }
    /^```[a-z]+ [A-Za-z0-9_.]+[.][a-z]+$/ { file = sprintf("%s/%05d.file.%s.block", dir, NR, $2); printf "" > file; next }
    /^```sh run( [0-9]+)?$/ { file = sprintf("%s/%05d.run.%d.block", dir, NR, $3); next }
    /^```text output$/ { file = sprintf("%s/%05d.output.block", dir, NR); printf "" > file; next }
    /^```/ { file = "/dev/null"; next }
    file != "" { print > file }' "$page"
  for block in "$dir"/*.block; do
    name=$(basename "$block" .block)
    line=${name%%.*}
    case $name in
      *.file.*) cp "$block" "$session/${name#*.file.}" ;;
      *.run.*)
        count=$((count + 1))
        status=0
        (cd "$session" && bash "$block") >"$dir/log" 2>&1 </dev/null || status=$?
        [[ $status -eq "${name##*.}" ]] || wrong "exit code $status, expected ${name##*.}"
        sed -i -E 's/hash [0-9a-f]{16}/hash HASH/' "$dir/log"
        ;;
      *.output)
        count=$((count + 1))
        diff "$block" "$dir/log" >"$dir/diff" || { mv "$dir/diff" "$dir/log"; wrong "prints something else"; }
        ;;
    esac
  done
done
echo "$count blocks, $failed wrong"
[[ $failed -eq 0 && $count -gt 0 ]]
