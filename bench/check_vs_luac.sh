#!/usr/bin/env bash
# bench/check_vs_luac.sh [BUILD [RUNS [BYTES]]]: how fast `nmsc check` is beside `luac -p`.
#
# Measured is the whole process, from its start to its exit, by the clock on the wall: reading the file, parsing it, for
# nmsc also the standard library and every check that a program needs (names, units, ranges, shares, durations, limits).
# Both read a file that is in the page cache, say nothing and write nothing. The two take turns, so that what else the
# machine does falls on both; the median counts. Peak memory is the largest resident set that the kernel saw.
#
# The input is what bench/write_stream writes: 60 % poses of 2 to 6 action units, 40 % expressions of 2 to 4 poses; the
# Lua holds the same data. An empty file shows what a run costs before it reads anything.
set -euo pipefail
build=${1:-build/release}
runs=${2:-21}
bytes=${3:-10000000}
luac=$(command -v luac5.4 || command -v luac) || { echo "check_vs_luac: install lua5.4" >&2; exit 1; }
command -v time > /dev/null || { echo "check_vs_luac: install time" >&2; exit 1; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
definitions=$("$build/bench/write_stream" "$work" "$bytes")
: > "$work/empty.nms"

# Nanoseconds of one run.
timed() {
  local begin end
  begin=$(date +%s%N)
  "$@" > /dev/null
  end=$(date +%s%N)
  echo $((end - begin))
}
median() { sort -n "$1" | awk '{ v[NR] = $1 } END { print v[int((NR + 1) / 2)] }'; }
# Peak resident set in KiB, of one run. Asked of time(1): a child's peak counts what its parent was before it became it.
peak() { command time --quiet --format %M "$@" 2>&1 > /dev/null; }

check=("$build/cli/nmsc" check "$work/stream.nms")
other=("$luac" -p "$work/stream.lua")
empty=("$build/cli/nmsc" check "$work/empty.nms")
for ((i = 0; i < runs; ++i)); do
  timed "${check[@]}" >> "$work/check"
  timed "${other[@]}" >> "$work/luac"
  timed "${empty[@]}" >> "$work/none"
done
size=$(stat -c %s "$work/stream.nms")
awk -v n="$definitions" -v size="$size" -v lua_size="$(stat -c %s "$work/stream.lua")" -v runs="$runs" \
    -v c="$(median "$work/check")" -v l="$(median "$work/luac")" -v e="$(median "$work/none")" \
    -v cp="$(peak "${check[@]}")" -v lp="$(peak "${other[@]}")" -v ep="$(peak "${empty[@]}")" 'BEGIN {
  printf "%d definitions, %.1f MB, median of %d runs\n\n", n, size / 1e6, runs
  printf "%-12s %10s %14s %8s %14s %10s\n", "", "ms", "ns/definition", "MB/s", "peak, x source", "MB"
  printf "%-12s %10.1f %14.0f %8.0f %14.2f %10.1f\n", "nmsc check", c / 1e6, c / n, size / c * 1e3, cp * 1024 / size, cp * 1024 / 1e6
  printf "%-12s %10.1f %14.0f %8.0f %14.2f %10.1f\n", "luac -p", l / 1e6, l / n, lua_size / l * 1e3, lp * 1024 / lua_size, lp * 1024 / 1e6
  printf "%-12s %10.1f %14s %8s %14s %10.1f\n", "empty file", e / 1e6, "", "", "", ep * 1024 / 1e6
  printf "\nnmsc check is %.2f times as fast as luac -p\n", l / c
}'
