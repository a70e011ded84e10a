#!/usr/bin/env bash
# lexicon_assets.sh BUILD [RUNS]: a lexicon of 150 entries to GLB files, cold, then with nothing changed, then as one file;
# and every part of every entry of the library taken out. The least of RUNS runs (5 unless said): by the clock on the
# wall, and the processor's time of all threads.
set -euo pipefail
export LC_ALL=C TIMEFORMAT='%R %U %S'
if [[ $# -lt 1 || $# -gt 2 ]]; then
  echo "usage: lexicon_assets.sh BUILD [RUNS]" >&2
  exit 2
fi
build=$(realpath "$1")
runs=${2:-5}
root=$(cd "$(dirname "$0")/.." && pwd)
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
cd "$dir"
"$build/bench/write_lexicon" >bench.nms

# least WHAT BEFORE COMMAND...: BEFORE is run in front of each, untimed.
least() {
  local what=$1 before=$2
  shift 2
  for ((i = 0; i < runs; ++i)); do
    $before
    { time "$@" >/dev/null 2>log || { cat log >&2; exit 1; }; } 2>>times
  done
  awk -v what="$what" '{ w = $1; c = $2 + $3; if (NR == 1 || w < wall) wall = w; if (NR == 1 || c < cpu) cpu = c }
    END { printf "%-44s %6.3f s on the wall, %6.3f s of the processor\n", what, wall, cpu }' times
  rm times
}
least "150 entries to 150 files, cold" "rm -rf out" "$build/cli/nmsc" build --lexicon bench.nms -o out
[[ $(ls out/*.glb | wc -l) -eq 150 ]] || { echo "there are not 150 files" >&2; exit 1; }
least "the same again, nothing changed" : "$build/cli/nmsc" build --lexicon bench.nms -o out
least "150 entries to one file, cold" "rm -rf one.glb one.glb.manifest.json" "$build/cli/nmsc" build --lexicon bench.nms -o one.glb
least "nmsc check of every lexicon" : "$build/cli/nmsc" check "$root"/stdlib/lexicons/*.nms
least "nmsc test --mutate of the library" : "$build/cli/nmsc" test --mutate "$root"/stdlib/tests/*.nms
