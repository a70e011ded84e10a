#!/usr/bin/env bash
# cli_test.sh NMSC ROOT: what the command promises to whoever runs it. One line for each thing that does not hold.
set -uo pipefail
export LC_ALL=C
unset NO_COLOR
if [[ $# -ne 2 ]]; then
  echo "usage: cli_test.sh NMSC ROOT" >&2
  exit 2
fi
nmsc=$(realpath "$1")
root=$(realpath "$2")
dir=$(mktemp -d)
trap 'chmod -R u+w "$dir"; rm -rf "$dir"' EXIT
cd "$dir"
failed=0
count=0

wrong() {
  failed=$((failed + 1))
  echo "wrong: $1"
  sed 's/^/    /' err | head -n 20
}
# expect CODE NAME COMMAND...: runs it, output in `out` and `err`.
expect() {
  local want=$1 name=$2
  shift 2
  count=$((count + 1))
  local status=0
  "$@" >out 2>err </dev/null || status=$?
  [[ $status -eq $want ]] || wrong "$name: exit code $status, not $want"
}
# holds NAME COMMAND...: it succeeds.
holds() {
  local name=$1
  shift
  count=$((count + 1))
  "$@" >/dev/null 2>&1 || wrong "$name"
}
says() { holds "$1: says \"$2\"" grep -qF -- "$2" err; }
silent() { holds "$1: prints nothing" test ! -s "$2"; }
no_leftovers() { holds "$1: leaves nothing half-written" bash -c '[[ -z $(find . -name "*.part") ]]'; }

cat >good.nms <<'NMS'
pose grin = 60% AU12
expression smile 2s {
  50%: grin
  50%: 0% grin
}
timeline look 1s {
  gaze left over 0.2s..0.6s
}
NMS
cat >bad.nms <<'NMS'
pose a = AU998
pose b = rase(50%)
timeline t 1s { grni at 0s }
NMS
printf 'timeline t 5s { AU1 over 1s..1.01s }\n' >warn.nms

# ---- Exit codes
expect 0 "check good" "$nmsc" check good.nms
silent "check good" out
silent "check good" err
expect 1 "check bad" "$nmsc" check bad.nms
for line in 1 2 3; do says "several errors in one run" "bad.nms:$line:"; done
expect 0 "a warning is no error" "$nmsc" check warn.nms
says "a warning is no error" "warning phases_shrunk"
expect 1 "one bad file among good ones" "$nmsc" check good.nms bad.nms
expect 2 "no command" "$nmsc"
expect 2 "unknown command" "$nmsc" frobnicate good.nms
expect 2 "unknown flag" "$nmsc" check --frobnicate good.nms
expect 2 "no file" "$nmsc" check
expect 2 "compile without -o" "$nmsc" compile good.nms
expect 2 "unknown error format" "$nmsc" --error-format=xml check good.nms
expect 2 "sample without times" "$nmsc" sample good.nms --clip smile
expect 2 "sample with both kinds of times" "$nmsc" sample good.nms --clip smile --fps 10 --at 1
for fps in 0 -1 nan 1e9; do expect 2 "sample at $fps" "$nmsc" sample good.nms --clip smile --fps $fps; done
expect 0 "help" "$nmsc" --help
expect 0 "version" "$nmsc" --version

# ---- What a file can be
expect 1 "missing file" "$nmsc" check missing.nms
says "missing file" "missing.nms"
expect 1 "missing file in fmt" "$nmsc" fmt missing.nms
mkdir folder
expect 1 "folder" "$nmsc" check folder
says "folder" "folder"
: >empty.nms
expect 0 "empty file" "$nmsc" check empty.nms
expect 0 "empty program" "$nmsc" compile empty.nms -o empty.auc
expect 0 "empty program" "$nmsc" dump empty.auc
head -c 20000 /dev/urandom >binary.nms
expect 1 "binary" "$nmsc" check binary.nms
printf 'pose p = AU12 // \xff\xfe\npose \xc3\x28 = AU1\n' >utf8.nms
expect 1 "invalid UTF-8" "$nmsc" check utf8.nms
says "invalid UTF-8" "utf8.nms:1:"
cp good.nms $'latin\xe9.nms'
expect 0 "a name that is not UTF-8" "$nmsc" compile $'latin\xe9.nms' -o latin.auc
sed 's/$/\r/' good.nms >crlf.nms
expect 0 "CRLF" "$nmsc" check crlf.nms
printf '\xef\xbb\xbf' | cat - good.nms >bom.nms
expect 0 "a byte order mark" "$nmsc" check bom.nms
truncate -s 300M huge.nms
expect 1 "huge" "$nmsc" check huge.nms
says "huge" "file_too_large"
rm huge.nms
{ printf 'pose p = '; printf '(%.0s' {1..100000}; printf 'AU1\n'; } >deep.nms
expect 1 "brackets without end" "$nmsc" check deep.nms
yes 'pose p = AU998 + nothing' | head -n 20000 >many.nms
expect 1 "twenty thousand errors" timeout 20 "$nmsc" check many.nms
if [[ $(id -u) -ne 0 ]]; then
  cp good.nms secret.nms && chmod 000 secret.nms
  expect 1 "unreadable file" "$nmsc" check secret.nms
  mkdir locked && chmod 555 locked
  expect 1 "read-only folder" "$nmsc" compile good.nms -o locked/out.auc
  no_leftovers "read-only folder"
fi

# ---- Standard input
expect_stdin() {
  local want=$1 name=$2 input=$3
  shift 3
  count=$((count + 1))
  local status=0
  "$@" >out 2>err <"$input" || status=$?
  [[ $status -eq $want ]] || wrong "$name: exit code $status, not $want"
}
expect_stdin 0 "check -" good.nms "$nmsc" check -
expect_stdin 1 "check -" bad.nms "$nmsc" check -
says "check -" "<stdin>:1:"
expect_stdin 0 "fmt -" good.nms "$nmsc" fmt -
holds "fmt - prints" grep -q smile out
expect_stdin 0 "list -" good.nms "$nmsc" list -

# ---- Output
expect 0 "compile" "$nmsc" compile good.nms -o good.auc
no_leftovers "compile"
expect 1 "no program from errors" "$nmsc" compile bad.nms -o bad.auc
holds "no program from errors" test ! -e bad.auc
cp good.auc kept.auc
expect 1 "errors leave the old program" "$nmsc" compile bad.nms -o kept.auc
holds "errors leave the old program" cmp good.auc kept.auc
expect 1 "folder that is not there" "$nmsc" compile good.nms -o nowhere/out.auc
says "folder that is not there" "cannot_write"
expect 1 "a folder as output" "$nmsc" compile good.nms -o folder
no_leftovers "folder as output"
if [[ -e /dev/full ]]; then
  expect 1 "full disk" "$nmsc" compile good.nms -o /dev/full
  says "full disk" "cannot_write"
  for command in "dump good.nms" "list good.nms" "sample good.nms --clip smile --fps 10" "fmt -"; do
    count=$((count + 1))
    status=0
    # shellcheck disable=SC2086
    "$nmsc" $command >/dev/full 2>err <good.nms || status=$?
    [[ $status -eq 1 ]] || wrong "$command to a full disk: exit code $status, not 1"
    says "$command to a full disk" "cannot_write"
  done
fi
expect 0 "to /dev/null" "$nmsc" compile good.nms -o /dev/null
for command in "dump good.nms" "sample good.nms --clip smile --fps 100000"; do
  count=$((count + 1))
  # shellcheck disable=SC2086
  "$nmsc" $command 2>err | head -n 1 >/dev/null
  status=${PIPESTATUS[0]}
  [[ $status -eq 0 || $status -eq 1 || $status -eq 141 ]] || wrong "$command to a closed pipe: exit code $status"
done

# ---- JSON diagnostics
json='import json, sys
d = json.load(open("err", encoding="utf-8"))
d = d if isinstance(d, list) else d["diagnostics"]
assert len(d) == int(sys.argv[1]), d
for one in d:
    for key in ("kind", "severity", "message"): assert isinstance(one[key], str) and one[key], one'
if command -v python3 >/dev/null; then
  expect 1 "JSON of errors" "$nmsc" --error-format=json check bad.nms
  holds "JSON of errors has its fields" python3 -c "$json" 3
  expect 1 "JSON after the command" "$nmsc" check --error-format=json bad.nms
  holds "JSON after the command" python3 -c "$json" 3
  expect 0 "JSON of nothing" "$nmsc" --error-format=json check good.nms
  holds "JSON of nothing is an empty list" python3 -c "$json" 0
  expect 1 "JSON of the world's failures" "$nmsc" --error-format=json check missing.nms
  holds "JSON of the world's failures" python3 -c "$json" 1
  expect 1 "JSON of invalid UTF-8" "$nmsc" --error-format=json check utf8.nms
  holds "JSON of invalid UTF-8 is UTF-8" python3 -c 'import json; json.load(open("err", encoding="utf-8"))'
fi

# ---- fmt
printf 'pose   a=60%%AU12\n\n\n\npose b = a' >messy.nms
cp messy.nms before.nms
expect 1 "fmt --check of a messy file" "$nmsc" fmt --check messy.nms
holds "fmt --check changes nothing" cmp messy.nms before.nms
expect 0 "fmt" "$nmsc" fmt messy.nms
holds "fmt changes the file" bash -c '! cmp -s messy.nms before.nms'
cp messy.nms once.nms
expect 0 "fmt again" "$nmsc" fmt messy.nms
holds "fmt is idempotent" cmp messy.nms once.nms
expect 0 "fmt --check of a clean file" "$nmsc" fmt --check messy.nms
printf 'pose a = = AU1\n' >broken.nms
cp broken.nms before.nms
expect 1 "fmt of a broken file" "$nmsc" fmt broken.nms
holds "fmt leaves a broken file alone" cmp broken.nms before.nms
cp before.nms mixed.nms && printf 'pose   a=AU1' >mixed2.nms
expect 1 "fmt goes on after a broken file" "$nmsc" fmt mixed.nms mixed2.nms
holds "fmt goes on after a broken file" grep -q 'pose a = AU1' mixed2.nms
printf 'pose   a=AU1' >private.nms && chmod 640 private.nms
expect 0 "fmt of a private file" "$nmsc" fmt private.nms
holds "fmt keeps permissions" test "$(stat -c %a private.nms)" = 640
printf 'pose   a=AU1' >target.nms && ln -s target.nms link.nms
expect 0 "fmt of a link" "$nmsc" fmt link.nms
holds "fmt keeps a link" test -L link.nms
holds "fmt writes through a link" grep -q 'pose a = AU1' target.nms
no_leftovers "fmt"

# ---- list, dump, sample
expect 0 "list" "$nmsc" list good.nms
printf 'smile\texpression\t2\nlook\ttimeline\t1\n' >want
holds "list" cmp out want
expect 0 "list of a program" "$nmsc" list good.auc
holds "list of a program" cmp out want
expect 0 "dump of a program" "$nmsc" dump good.auc
sed '/^inputs$/,$d' out | sed '$d' >dumped # what was read stands in programs only
expect 0 "dump of its source" "$nmsc" dump good.nms
holds "a program and its source dump the same" cmp out dumped
expect 0 "sample --at" "$nmsc" sample good.nms --clip smile --at 0,500ms,1s,2
printf 'time_s,AU12L,AU12R\n0,0,0\n0.5,0.3,0.3\n1,0.6,0.6\n2,0,0\n' >want
holds "sample --at" cmp out want
expect 0 "sample of a program" "$nmsc" sample good.auc --clip smile --at 0,500ms,1s,2
holds "sample of a program" cmp out want
expect 0 "sample --fps" "$nmsc" sample good.nms --clip smile --fps 25
holds "sample --fps has a row a frame" test "$(wc -l <out)" -eq 52
holds "sample has as many columns in each row" bash -c '[[ $(awk -F, "{ print NF }" out | sort -u) = 3 ]]'
expect 0 "sample before and after" "$nmsc" sample good.nms --clip smile --at=-5s,100s
expect 0 "both units of an axis" "$nmsc" sample good.nms --clip look --at 0.4
holds "both units of an axis" grep -q 'AU61,AU62' out
expect 1 "sample of no clip" "$nmsc" sample good.nms --clip smlie --at 0
says "sample of no clip" "smile"
expect 1 "sample at no time" "$nmsc" sample good.nms --clip smile --at later
for at in "," "1,,2"; do expect_stdin 1 "sample at '$at'" /dev/null "$nmsc" sample good.nms --clip smile "--at=$at"; done
printf 'timeline long 90000s { blink at 0s }\n' >long.nms
expect 1 "too many rows" "$nmsc" sample long.nms --clip long --fps 1000
says "too many rows" "too_many_rows"

# ---- A program beside its source: what is printed is the same with it and without
mkdir beside
cp good.nms beside/x.nms
expect 0 "list without a program beside" "$nmsc" list beside/x.nms
cp out list.want
expect 0 "sample without a program beside" "$nmsc" sample beside/x.nms --clip smile --fps 25
cp out sample.want
expect 0 "compile beside" "$nmsc" compile beside/x.nms -o beside/x.auc
expect 0 "list beside" "$nmsc" list beside/x.nms
holds "list beside is the same" cmp out list.want
silent "list beside" err
expect 0 "sample beside" "$nmsc" sample beside/x.nms --clip smile --fps 25
holds "sample beside is the same" cmp out sample.want
expect 0 "compile with a face" "$nmsc" compile --face ada beside/x.nms -o beside/x.auc
expect 0 "list beside, with a face" "$nmsc" list beside/x.nms
holds "list beside is the same with a face" cmp out list.want
expect 0 "dump with a face" "$nmsc" dump beside/x.auc
holds "a program says what was read" grep -q '^  nmsc path' out
holds "a program describes its face" grep -q '^face ada' out
expect 1 "compile with no face" "$nmsc" compile --face bob beside/x.nms -o beside/y.auc
says "compile with no face" "unknown_face"
# Stale: the text counts, and nothing is said.
printf 'pose other = 10%% AU4\nexpression late 1s { 100%%: other }\n' >>beside/x.nms
expect 0 "list of a changed source" "$nmsc" list beside/x.nms
holds "a changed source counts" grep -q '^late' out
silent "list of a changed source" err
# Damaged: the text counts, and it is said.
expect 0 "compile beside again" "$nmsc" compile beside/x.nms -o beside/x.auc
expect 0 "list of the changed source" "$nmsc" list beside/x.nms
cp out list.want
head -c 1000 beside/x.auc >beside/cut && mv beside/cut beside/x.auc
expect 0 "list beside a cut program" "$nmsc" list beside/x.nms
holds "a source beside a cut program counts" cmp out list.want
says "list beside a cut program" "warning truncated_program"
expect 1 "a cut program, warnings denied" "$nmsc" --deny warnings list beside/x.nms
cp good.nms beside/x.auc
expect 0 "list beside what is no program" "$nmsc" list beside/x.nms
says "list beside what is no program" "warning not_a_program"

# ---- test
cat >tests.nms <<'NMS'
timeline grin 2s { 60% AU12 over 0.5s..1s { onset 100ms  offset 100ms } }
test "it grins" { play grin; expect AU12 == 60% at 0.8s; expect AU4 never }
test "a <smile> & \"more\"" { play grin; expect AU12L >= 50%; expect AU12R == 60% at 0.8s }
test "it stops" { play grin; expect AU12 never over 1.2s..2s }
NMS
printf 'test "late" {\n  play smile\n  expect AU12 >= 50%% at 1s\n}\nexpression smile 2s {\n  50%%: 60%% AU12\n  50%%: 0%% AU12\n}\n' >passes.nms
expect 0 "tests that pass" "$nmsc" test passes.nms
echo "1 passed, 0 failed" >want
holds "tests that pass" cmp out want
silent "tests that pass" err
expect 1 "a test that fails" "$nmsc" test tests.nms
holds "a test that fails: the summary is last" test "$(tail -n 1 out)" = "2 passed, 1 failed"
for line in 'failed: a <smile> & "more"' "tests.nms:3:42: error expectation_failed: AU12L is 0% at 0s" \
  "expect AU12L >= 50%" "60% AU12 over 0.5s..1s"; do
  holds "a test that fails: prints $line" grep -qF -- "$line" out
done
silent "a test that fails" err
expect 1 "several files" "$nmsc" test passes.nms tests.nms
holds "several files" test "$(tail -n 1 out)" = "3 passed, 1 failed"
expect 0 "--filter" "$nmsc" test tests.nms --filter grins
holds "--filter" cmp out want
expect 0 "--filter of nothing" "$nmsc" test tests.nms --filter nothing
says "--filter of nothing" "warning no_tests"
expect 0 "--filter leaves failures out" "$nmsc" test tests.nms --filter "it "
holds "--filter leaves failures out" test "$(cat out)" = "2 passed, 0 failed"
expect 1 "tests of a missing file" "$nmsc" test missing.nms passes.nms
holds "tests of a missing file: others run" grep -qx "1 passed, 0 failed" out
expect 1 "tests of a program" "$nmsc" test good.auc
expect 2 "no file to test" "$nmsc" test
# ---- test --mutate
cat >entries.nms <<'NMS'
lexicon l "L" { entry grin : affect { 60% AU12 + 20% AU6 { lead 100ms } } }
test "it grins" { play grin; expect AU12 == 60% at 0.2s; expect AU12 >= 5% at -50ms }
NMS
expect 1 "--mutate" "$nmsc" test --mutate entries.nms
holds "--mutate: names the place" grep -qF "entries.nms:1:50: error removal_unnoticed: no test notices when this term" out
holds "--mutate: the summary is last" test "$(tail -n 1 out)" = "4 parts taken out: 3 noticed, 1 unnoticed, 0 untested, 0 without which nothing compiles"
expect 1 "--mutate as JSON" "$nmsc" test --mutate --format json entries.nms
holds "--mutate as JSON" python3 -c '
import json
removals = json.load(open("out"))["removals"]
assert [r["fate"] for r in removals].count("unnoticed") == 1, removals
assert [(r["line"], r["column"], r["text"], r["part"], r["entry"], r["lexicon"]) for r in removals if r["fate"] == "unnoticed"] == [(1, 50, "20% AU6", "term", "grin", "l")]
'
printf 'test "its cheeks" { play grin; expect AU6 == 20%% at 0.2s }\n' >>entries.nms
expect 0 "--mutate, all noticed" "$nmsc" test --mutate entries.nms
expect 1 "--mutate of failing tests" "$nmsc" test --mutate tests.nms
says "--mutate of failing tests" "error failing_tests"
expect 2 "--mutate with --filter" "$nmsc" test --mutate --filter x entries.nms
expect 2 "--format without --mutate" "$nmsc" test --format json entries.nms
expect 0 "check of failing tests" "$nmsc" check tests.nms
printf 'test "t" {\n  play gron\n  expect AU998 == 0%%\n}\n' >badtest.nms
expect 1 "a test of nothing" "$nmsc" test badtest.nms --junit bad.xml
for line in 2 3; do says "a test of nothing" "badtest.nms:$line:"; done
holds "a test of nothing writes no results" test ! -e bad.xml
expect 1 "check of a test of nothing" "$nmsc" check badtest.nms
expect 1 "JUnit" "$nmsc" test passes.nms tests.nms --junit results.xml
cp results.xml again.xml
expect 1 "JUnit again" "$nmsc" test passes.nms tests.nms --junit results.xml
holds "JUnit is the same again" cmp results.xml again.xml
expect 1 "JUnit where there is no folder" "$nmsc" test passes.nms --junit nowhere/results.xml
says "JUnit where there is no folder" "cannot_write"
if command -v python3 >/dev/null; then
  holds "JUnit parses" python3 -c 'import xml.etree.ElementTree as e
root = e.parse("results.xml").getroot()
assert root.tag == "testsuites" and root.attrib["tests"] == "4" and root.attrib["failures"] == "1"
suites = list(root)
assert [s.attrib["name"] for s in suites] == ["passes.nms", "tests.nms"]
assert [(s.attrib["tests"], s.attrib["failures"], len(s)) for s in suites] == [("1", "0", 1), ("3", "1", 3)]
case = suites[1][1]
assert "a <smile> & " in case.attrib["name"] and case.attrib["line"] == "3", case.attrib
assert len(case) == 1 and "expectation_failed" in case[0].text and "\n" in case[0].text
assert all(c.attrib["time"] == "0" for c in root.iter("testcase"))'
  printf 'test "bell\001 \xef\xbf\xbf" {\n  play blink\n  expect AU45 never\n}\n' >bell.nms
  expect 1 "JUnit of what XML cannot say" "$nmsc" test bell.nms --junit bell.xml
  holds "JUnit of what XML cannot say parses" python3 -c 'import xml.etree.ElementTree as e; e.parse("bell.xml")'
  expect 1 "JSON of failed tests" "$nmsc" --error-format=json test passes.nms tests.nms
  holds "JSON of failed tests" python3 -c "$json" 1
fi

# ---- Programs that are none
size=$(stat -c %s good.auc)
for at in 0 1 7 8 16 63 100 $((size / 2)) $((size - 1)); do
  head -c "$at" good.auc >cut.auc
  expect 1 "cut at $at" "$nmsc" dump cut.auc
  holds "cut at $at: says why" test -s err
done
for at in 0 4 9 40 $((size / 3)) $((size / 2)) $((size - 2)); do
  cp good.auc flipped.auc
  byte=$(od -An -tu1 -j "$at" -N 1 good.auc | tr -d ' ')
  # shellcheck disable=SC2059
  printf "$(printf '\\%03o' $((byte ^ 16)))" | dd of=flipped.auc bs=1 seek="$at" conv=notrunc status=none
  expect 1 "a bit flipped at $at" "$nmsc" dump flipped.auc
done
cp good.nms text.auc
expect 1 "a source called .auc" "$nmsc" dump text.auc
says "a source called .auc" "not_a_program"
cp good.auc program.nms
expect 1 "a program called .nms" "$nmsc" check program.nms
expect 1 "a program among sources" "$nmsc" check good.nms good.auc

# ---- Places
mkdir -p a/b stdlib
printf 'pose inner = 30%% AU12\n' >a/b/inner.nms
printf 'use "b/inner.nms"\nexpression e 1s { 100%%: inner }\n' >a/outer.nms
expect 0 "a relative use" "$nmsc" dump a/outer.nms
mkdir -p elsewhere
(cd elsewhere && "$nmsc" list ../a/outer.nms) >out 2>err
printf 'e\texpression\t1\n' >want
holds "a relative use from another folder" cmp out want
expect 0 "an absolute path" "$nmsc" check "$dir/a/outer.nms"
expect 0 "one file twice" "$nmsc" list a/outer.nms ./a/../a/outer.nms
holds "one file twice is one file" cmp out want
printf 'pose helper = AU1\n' >stdlib/helper.nms
printf 'use "helper.nms"\nexpression e 1s { 100%%: helper }\n' >stdlib/mine.nms
expect 0 "a folder of one's own that is called stdlib" "$nmsc" check stdlib/mine.nms
expect 2 "a library that is not there" "$nmsc" --stdlib nowhere check good.nms
expect 0 "the library from its folder" "$nmsc" --stdlib "$root/stdlib" dump good.nms
holds "the library from its folder is the one inside" cmp out dumped
for name in de_DE.UTF-8 de_DE.utf8; do
  locale -a 2>/dev/null | grep -qx "$name" || continue
  LC_ALL=$name "$nmsc" dump good.nms >out 2>err
  holds "the same in $name" cmp out dumped
done

# ---- Pictures and overbar text
expect 0 "plot" "$nmsc" plot good.nms --clip look -o look.svg
silent plot out
expect 0 "plot to standard output" "$nmsc" plot good.nms --clip look -o -
holds "plot writes one picture wherever it goes" cmp out look.svg
expect 1 "plot of no such clip" "$nmsc" plot good.nms --clip loko -o no.svg
says "plot of no such clip" "did you mean look?"
holds "plot of no such clip writes nothing" test ! -e no.svg
expect 1 "plot into no folder" "$nmsc" plot good.nms --clip look -o nowhere/look.svg
expect 2 "plot without a clip" "$nmsc" plot good.nms -o -
expect 2 "plot too narrow" "$nmsc" plot good.nms --clip look --width 10 -o -

expect 1 "build to no name" "$nmsc" build good.nms -o ""
says "build to no name" "output: error cannot_write"
for option in "--clip wh" --report; do
  expect 2 "a lexicon with $option" "$nmsc" build --lexicon asl $option -o no_lexicon
done
expect 1 "build onto standard output" "$nmsc" build good.nms -o -
says "build onto standard output" "-: error cannot_write"
holds "no file is called -" test ! -e ./-
count=$((count + 1))
[[ $("$nmsc" build good.nms -o /dev/stdout 2>/dev/null | head -c 4) == glTF ]] || wrong "build into a device"
expect 0 "build for a program to read" "$nmsc" --error-format json build good.nms -o told.glb
command -v python3 >/dev/null && holds "stderr is one JSON document" python3 -m json.tool err
holds "what was built is told on stdout" grep -q "told.glb: 2 clips" out

# ---- An avatar that others made
expect 0 "a still face to animate" "$nmsc" build good.nms --all-targets --clip smile -o still.glb
expect 0 "build on an avatar" "$nmsc" build good.nms --clip look --on still.glb -o moving.glb
says "build on an avatar" "1 clip on still.glb"
expect 1 "build on an avatar that has the clip" "$nmsc" build good.nms --clip look --on moving.glb -o again.glb
says "build on an avatar that has the clip" "clip_exists"
expect 1 "build on what is no avatar" "$nmsc" build good.nms --clip look --on good.nms -o again.glb
says "build on what is no avatar" "bad_avatar"
head -c 4000 still.glb >cut.glb
expect 1 "build on half an avatar" "$nmsc" build good.nms --clip look --on cut.glb -o again.glb
expect 1 "build on no avatar" "$nmsc" build good.nms --clip look --on nowhere.glb -o again.glb
holds "a build on no avatar writes nothing" test ! -e again.glb
printf 'au 299 "Glow" { track mouth }\ntimeline wall 1s { AU299 over 0.2s..0.6s }\n' >wall.nms
for option in "--face ada" --all-targets "--max-error 0.2mm" --report --dense --quantize "--lexicon asl"; do
  expect 2 "build on an avatar with $option" "$nmsc" build good.nms --on still.glb $option -o again.glb
done
expect 2 "corrections of no error" "$nmsc" build good.nms --max-corrections 3 -o again.glb
holds "builds on avatars that fail write nothing" test ! -e again.glb
expect 0 "build what an avatar cannot show" "$nmsc" build wall.nms --on still.glb -o wall.glb
says "build what an avatar cannot show" "not_on_avatar"

# ---- A lexicon as assets
mkdir lex
cat >lex/shared.nms <<'NMS'
pose lifted = 60% AU1 + 60% AU2
pose drawn = 50% AU4
NMS
cat >lex/house.nms <<'NMS'
use "shared.nms"
lexicon house "Of a house" {
  licence "CC0-1.0"
  entry ask : syntactic {
    label "q" "ask?"
    meaning "asks"
    lifted
  }
  entry doubt : syntactic { drawn }
  entry nod_once : lexical { AU54 }
}
NMS
made() { holds "$1: $2 made anew" grep -qF ": $2 of" err; }
expect 0 "build of a lexicon" "$nmsc" build --lexicon lex/house.nms -o assets --depfile assets.d
made "build of a lexicon" 3
holds "a lexicon's files" test -s assets/ask.glb -a -s assets/doubt.glb -a -s assets/nod_once.glb -a -s assets/manifest.json
holds "the manifest has the labels" grep -qF '"ask?"' assets/manifest.json
holds "the manifest has the licences" bash -c 'grep -qF "CC0-1.0" assets/manifest.json && grep -qF "Apache-2.0 AND MIT" assets/manifest.json'
holds "the manifest has the action units" grep -qF '"AU1L"' assets/manifest.json
holds "the rule names what was read" bash -c 'grep -q "^assets/manifest.json:" assets.d && grep -qF lex/shared.nms assets.d && grep -qF lex/house.nms assets.d'
cp -r assets assets.first
expect 0 "build of the same lexicon" "$nmsc" build --lexicon lex/house.nms -o assets
says "build of the same lexicon" "nothing changed: 3 entries are up to date"
expect 0 "build of a lexicon elsewhere" "$nmsc" build --lexicon lex/house.nms -o elsewhere
holds "a lexicon's files have the same bytes anywhere" diff -r assets elsewhere
sed -i 's/50% AU4/40% AU4/' lex/shared.nms
expect 0 "build after a shared pose changed" "$nmsc" build --lexicon lex/house.nms -o assets
made "build after a shared pose changed" 1
holds "what did not use it stays" cmp assets/ask.glb assets.first/ask.glb
holds "what used it is new" bash -c '! cmp -s assets/doubt.glb assets.first/doubt.glb'
rm assets/ask.glb
expect 0 "build after a file was lost" "$nmsc" build --lexicon lex/house.nms -o assets
made "build after a file was lost" 1
printf 'not a manifest' >assets/manifest.json
expect 0 "build over a broken manifest" "$nmsc" build --lexicon lex/house.nms -o assets
made "build over a broken manifest" 3
sed -i '/nod_once/d' lex/house.nms
expect 0 "build after an entry went" "$nmsc" build --lexicon lex/house.nms -o assets
says "build after an entry went" "1 removed"
holds "its file went too" test ! -e assets/nod_once.glb
expect 0 "build of a lexicon as one file" "$nmsc" build --lexicon lex/house.nms -o house.glb
holds "one file has its manifest beside it" test -s house.glb -a -s house.glb.manifest.json
expect 0 "build of the same one file" "$nmsc" build --lexicon lex/house.nms -o house.glb
says "build of the same one file" "nothing changed"
expect 1 "build of no lexicon" "$nmsc" build --lexicon nowhere -o no
says "build of no lexicon" "unknown_lexicon"
expect 1 "build of a file without a lexicon" "$nmsc" build --lexicon good.nms -o no
expect 1 "build of a broken lexicon" "$nmsc" build --lexicon bad.nms -o no
holds "builds that fail make no folder" test ! -e no
expect 2 "build of a lexicon and of files" "$nmsc" build good.nms --lexicon asl -o no
expect 2 "build of nothing" "$nmsc" build -o no.glb

# ---- How far a file is from the runtime's surface
expect 0 "build --report" "$nmsc" build good.nms --clip smile --report -o told.glb
says "build --report" "smile: max 0."
expect 0 "build --max-error" "$nmsc" build good.nms --clip smile --max-error 0.1mm -o exact.glb
says "build --max-error" "smile: max 0.0"
expect 0 "build --quantize" "$nmsc" build good.nms --clip smile --quantize -o small.glb
holds "build --quantize makes it much smaller" test "$(stat -c %s small.glb)" -lt $(($(stat -c %s told.glb) * 7 / 10))
expect 1 "build --max-error without a unit" "$nmsc" build good.nms --clip smile --max-error 0.1 -o exact2.glb
says "build --max-error without a unit" "bad_length"

# ---- What a face can show: axes' units have their own names
expect 0 "face report" "$nmsc" face report ada
holds "face report names the units of axes" grep -q "^AU51 .* Head Turn Left$" out
holds "face report names the other end too" grep -q "^AU112 .* Tongue Right$" out

# ---- Any face: one triangle with two landmarks turns its head and leans
printf 'v 0 -64 110\nv 43 -59 77\nv -43 -59 77\nf 1 2 3\n' >mask.obj
cat >mask.nms <<'NMS'
face mask {
  surface "mask.obj"
  unit 1mm
  landmark head_pivot (0mm, -10mm, 9mm)
  landmark torso_pivot (0mm, -175mm, -10mm)
}
NMS
expect 0 "face report of a mask" "$nmsc" face report mask.nms
holds "face report: sixteen units, what they do not show" bash -c '[[ $(grep -c "^AU" out) -eq 16 ]] && grep -q "^not shown: AU1L, AU1R" out'
says "face report of a mask" "no landmark nasion, so these do nothing: corrugator_L, corrugator_R, procerus"
holds "a landmark of the midline has one name" bash -c '! grep -E "no landmark (nasion|stomion|cervical)_" err'
holds "a landmark that has sides is missed by side" bash -c '! grep -E "no landmark jaw_hinge," err'
expect 0 "face check" "$nmsc" face check mask.nms
holds "face check says how much there is" grep -qF "mask: 2 of 85 landmarks; 8 of 90 channels can be shown" out
expect 0 "face export" "$nmsc" face export mask.nms -o mask.glb
expect 0 "preview of each unit" "$nmsc" preview --face mask.nms --each-au --size 24x30 --columns 5 -o units.png
expect 0 "face check of ada" "$nmsc" face check ada
holds "ada shows every channel" grep -qxF "ada: 85 of 85 landmarks; 90 of 90 channels can be shown" out
expect 1 "face check of no face" "$nmsc" face check nobody
expect 1 "face export of no face" "$nmsc" face export nowhere.nms -o no.glb
holds "face export of no face writes nothing" test ! -e no.glb
expect 0 "face export of ada" "$nmsc" face export ada -o ada.glb
if command -v python3 >/dev/null; then
  holds "the chart has a picture for each unit and one at rest, with captions" python3 -c '
import struct
width, height = struct.unpack(">II", open("units.png", "rb").read()[16:24])
assert width == 8 + 5 * (24 + 8), width
rows = (1 + 16 + 4) // 5
assert rows * (30 + 8) < height < (rows + 1) * (30 + 40), height'
  holds "an exported face has every target and no clip" python3 -c '
import json, struct, sys
def targets(name):
  data = open(name, "rb").read()
  scene = json.loads(data[20:20 + struct.unpack("<I", data[12:16])[0]])
  assert not scene.get("animations")
  return {m["name"]: m["extras"]["targetNames"] for m in scene["meshes"] if "targetNames" in m.get("extras", {})}
ada = targets("ada.glb")
for unit in ("AU1L", "AU12R", "AU26", "AU43L", "AU61", "AU66"): assert unit in ada["skin"], unit
for unit in ("AU19", "AU26", "AU111", "AU116"): assert unit in ada["tongue"], unit
assert "AU27" in ada["teeth_lower"]
assert not targets("mask.glb")'
  expect 0 "face check as JSON" "$nmsc" face check mask.nms --format json
  holds "face check as JSON says what a landmark costs" python3 -c '
import json
found = json.load(open("out"))
assert found["landmarks"] == {"known": 2, "all": 85} and found["channels"] == {"shown": 8, "all": 90}, found
menton = [l for l in found["missing_landmarks"] if l["name"] == "menton"][0]
assert "jaw_opener" in menton["muscles"] and any(u["unit"] == "AU29" for u in menton["units"]), menton'
  expect 0 "face report as JSON" "$nmsc" face report mask.nms --format json
  holds "face report as JSON says how far" python3 -c '
import json
units = {u["unit"]: u for u in json.load(open("out"))["units"]}
assert abs(units["AU57"]["largest_mm"] - 40) < 1e-3 and units["AU57"]["direction"][2] > 0.999, units["AU57"]'
fi

# ---- A person's own face
printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n' >scan.obj
printf '{"nasion": [0, 1, 2]}' >marks.json
printf '{"nasion": [0, 1]}' >flat.json
expect 1 "face fit with one landmark" "$nmsc" face fit scan.obj --landmarks marks.json -o me.nms
says "face fit with one landmark" "fit_few_landmarks"
expect 1 "face fit with a place of two numbers" "$nmsc" face fit scan.obj --landmarks flat.json -o me.nms
says "face fit with a place of two numbers" "bad_landmarks"
expect 1 "face fit without a scan" "$nmsc" face fit nowhere.obj --landmarks marks.json -o me.nms
expect 1 "face fit to a name that is none" "$nmsc" face fit scan.obj --landmarks marks.json -o a-b.nms
says "face fit to a name that is none" "bad_name"
expect 1 "face fit in seconds" "$nmsc" face fit scan.obj --landmarks marks.json --unit 1s -o me.nms
holds "fits that fail write nothing" test ! -e me.nms -a ! -e me.x3d -a ! -e a-b.nms

cat >tri.obj <<'OBJ'
v 0 -64 110
v 43 -59 77
v -43 -59 77
f 1 2 3
OBJ
cat >slips.nms <<'NMS'
face slips {
  surface "tri.obj"
  unit 1mm
  landmark nose_tp vertex 0
  landmark ala vertex 1
  landmark pogonion sides vertex 1 2
}
NMS
expect 0 "face check of misspelt landmarks" "$nmsc" face check slips.nms
holds "a misspelt landmark" grep -q "look at nose_tp: no muscle asks for .*did you mean nose_tip?" out
holds "a landmark without its sides" grep -q "look at ala: it has two sides" out
holds "a landmark with sides that it has not" grep -q "look at pogonion: it has no sides" out
printf 'face bare { unit 1mm }\n' >bare.nms
expect 1 "geometry for a face" "$nmsc" face check tri.obj
says "geometry for a face" 'face mine { surface "tri.obj" }'
expect 1 "a file without a face" "$nmsc" face check good.nms
says "a file without a face" "it declares no face"
expect 1 "a face without a surface" "$nmsc" face check bare.nms
says "a face without a surface" "bare.nms:1:6: error missing_property"

# ---- Pictures of the face
tiny=(--size 24x30 -o sheet.png)
expect 0 "preview" "$nmsc" preview good.nms --clip smile --at 0,1s --view front,side "${tiny[@]}"
silent preview out
holds "preview writes a PNG" bash -c '[[ $(head -c 4 sheet.png | tail -c 3) == PNG ]]'
mv sheet.png first.png
expect 0 "preview twice" "$nmsc" preview good.nms --clip smile --at 0,1s --view front,side "${tiny[@]}"
holds "preview draws the same picture again" cmp first.png sheet.png
expect 0 "preview of another time" "$nmsc" preview good.nms --clip smile --at 0,0.9 --view front,side "${tiny[@]}"
holds "preview draws what the face does" bash -c '! cmp -s first.png sheet.png'
rm sheet.png
expect 1 "preview of no such clip" "$nmsc" preview good.nms --clip smlie "${tiny[@]}"
says "preview of no such clip" "did you mean smile?"
expect 1 "preview from nowhere" "$nmsc" preview good.nms --clip smile --view behind "${tiny[@]}"
says "preview from nowhere" "unknown_view"
expect 1 "preview at no time" "$nmsc" preview good.nms --clip smile --at noon "${tiny[@]}"
says "preview at no time" "bad_time"
expect 1 "preview of a broken source" "$nmsc" preview bad.nms --clip t "${tiny[@]}"
holds "a preview that fails writes nothing" test ! -e sheet.png
for option in "--clip smile" "--at 1"; do
  expect 2 "a chart with $option" "$nmsc" preview --each-au $option "${tiny[@]}"
done
for at in 0.5m 0.5u 3n; do expect 1 "preview at $at" "$nmsc" preview good.nms --clip smile --at $at "${tiny[@]}"; done
expect 2 "preview without a clip" "$nmsc" preview good.nms "${tiny[@]}"
expect 1 "previews too large together" "$nmsc" preview good.nms --clip smile --at 0,1,2,3 --size 4096x4096 -o sheet.png
says "previews too large together" "too_many_pictures"
expect 2 "preview too large" "$nmsc" preview good.nms --clip smile --size 90000x3 -o sheet.png
no_leftovers preview
expect 0 "gloss without utterances" "$nmsc" gloss good.nms
silent "gloss without utterances" out
expect 1 "gloss of no utterance" "$nmsc" gloss good.nms --clip look
says "gloss of no utterance" no_signs
expect 1 "gloss of no such clip" "$nmsc" gloss good.nms --clip loko
# ---- Commands and warnings by name
expect 2 "no such command" "$nmsc" frob
says "no such command" "there is no command frob"
expect 2 "a command misspelt" "$nmsc" chek good.nms
says "a command misspelt" "did you mean check?"
expect 2 "a command of faces misspelt" "$nmsc" face chek ada
says "a command of faces misspelt" "there is no command face chek; did you mean check?"
expect 2 "the fit of muscles" "$nmsc" fit
says "the fit of muscles" "nmsc-fit"
printf 'timeline t 2s { AU17 over 1s..1.05s }\npose p = 80%% AU12 + 80%% AU12\n' >warns.nms
warned() {
  local want=$1 many=$2
  shift 2
  expect "$want" "warnings: $*" "$nmsc" check warns.nms "$@"
  holds "warnings: $* are $many" test "$(grep -c ': warning ' err)" -eq "$many"
}
warned 0 2
warned 1 2 --deny warnings
warned 1 2 --deny timing
warned 1 2 --deny saturated
warned 0 2 --deny names
warned 0 1 --allow timing
warned 0 0 --allow timing --allow saturated
warned 1 1 --deny warnings --allow timing
warned 0 0 --deny warnings --allow timing --allow ranges
warned 1 2 --deny phases_shrunk --allow timing
warned 0 1 --deny timing --allow phases_shrunk
expect 2 "a group misspelt" "$nmsc" check warns.nms --deny timin
says "a group misspelt" "did you mean timing?"
expect 2 "an error cannot be allowed" "$nmsc" check warns.nms --allow unknown_name
groups=$("$nmsc" explain | sed -n 's/^  [a-z_0-9]* *\[\([a-z]*\)\].*/\1/p' | sort -u | tr '\n' ' ')
expect 0 "the help names the groups" "$nmsc" --help
holds "the help names the groups" grep -qF "Groups of warnings: $(sed 's/ $//; s/ /, /g' <<<"$groups");" out
expect 0 "kinds" "$nmsc" explain
expect 0 "a kind" "$nmsc" explain phases_shrunk
expect 1 "a kind misspelt" "$nmsc" explain phases_shrank
says "a kind misspelt" "did you mean phases_shrunk?"

# ---- fmt --range
printf 'pose   a=AU1\npose   b=AU2\npose   c=AU4\n' >lines.nms
expect 0 "fmt --range" "$nmsc" fmt --range 2:2 lines.nms
printf 'pose   a=AU1\npose b = AU2\npose   c=AU4\n' >want
holds "fmt --range" cmp lines.nms want
expect 0 "fmt --range again" "$nmsc" fmt --range 2:2 lines.nms
holds "fmt --range again" cmp lines.nms want
for range in 0:1 3:2 2 2: x:y 1:2:3 -1:2; do expect 2 "fmt --range $range" "$nmsc" fmt "--range=$range" lines.nms; done
expect 2 "fmt --range --check" "$nmsc" fmt --range 1:2 --check lines.nms
expect 0 "fmt --range past the end" "$nmsc" fmt --range 40:50 lines.nms
holds "fmt --range past the end" cmp lines.nms want

# ---- Why
expect 0 "explain" "$nmsc" explain good.nms --clip smile --at 0.5
silent "explain" err
holds "explain names the line" grep -q 'good.nms:[0-9]*:[0-9]*  ' out
expect 0 "explain one channel" "$nmsc" explain good.nms --clip smile --at 500ms --channel AU12L
holds "explain one channel" test "$(grep -c ' is ' out)" -eq 1
expect 0 "explain what the clip does not speak of" "$nmsc" explain good.nms --clip smile --at 0.5 --channel AU4
holds "explain what the clip does not speak of" grep -q 'does not speak of it' out
expect 0 "explain at rest" "$nmsc" explain good.nms --clip smile --at 0
holds "explain at rest" grep -q 'at rest' out
expect 1 "explain no such clip" "$nmsc" explain good.nms --clip smlie --at 0
says "explain no such clip" "did you mean smile?"
expect 1 "explain no such channel" "$nmsc" explain good.nms --clip smile --at 0 --channel AU999
says "explain no such channel" unknown_channel
expect 1 "explain at no time" "$nmsc" explain good.nms --clip smile --at later
says "explain at no time" bad_time
expect 1 "explain a program" "$nmsc" explain good.auc --clip smile --at 0
says "explain a program" wrong_input
expect 2 "explain in no such format" "$nmsc" explain good.nms --clip smile --at 0 --format xml

# ---- Times from outside
cat >marked.nms <<'NMS'
utterance u in asl {
  signs { BOOK WHERE }
  blink at mark beat
}
test "the mark and the signs are where the table says" {
  play u
  expect AU45 >= 95% at mark beat + 100ms
  expect AU45 never at end of BOOK
}
NMS
printf 'name,time\nbeat,700ms\n' >beat.csv
printf '[{"clip": "u", "sign": "BOOK", "start_ms": 0, "end_ms": 300}]' >signs.json
expect 1 "a mark without a table" "$nmsc" check marked.nms
says "a mark without a table" unknown_mark
expect 0 "a mark and a sign" "$nmsc" --marks beat.csv --marks signs.json dump marked.nms
holds "a mark stands in its clip" grep -qF "marker 0.7s mark beat" out
holds "a sign stands where the table says" grep -qF "marker 0.3s sign_end BOOK" out
cp out with_tables
expect 0 "the options behind the file" "$nmsc" dump marked.nms --marks signs.json --marks beat.csv
holds "the order of tables says nothing" cmp out with_tables
expect 0 "a test with tables" "$nmsc" test marked.nms --marks beat.csv --marks signs.json
for command in "list marked.nms" "gloss marked.nms" "plot marked.nms --clip u -o -" "sample marked.nms --clip u --at 0.7" \
  "explain marked.nms --clip u --at 0.7" "compile marked.nms -o marked.auc" "build marked.nms -o marked.glb"; do
  # shellcheck disable=SC2086
  expect 0 "$command with tables" "$nmsc" $command --marks beat.csv --marks signs.json
done
expect 1 "a compiled program with a table" "$nmsc" dump marked.auc --marks beat.csv
says "a compiled program with a table" wrong_input
expect 1 "fmt with a table" "$nmsc" fmt marked.nms --marks beat.csv
says "fmt with a table" wrong_input
expect 1 "a table that is not there" "$nmsc" check marked.nms --marks none.csv
says "a table that is not there" cannot_read
printf 'name,time\n"beat,1s\n' >open.csv
expect 1 "a table that is none" "$nmsc" check marked.nms --marks open.csv --marks none.csv
says "a table that is none" "open.csv:2:1: error table_syntax"
says "a table that is none" cannot_read
expect 1 "a table of another kind" "$nmsc" check marked.nms --marks marked.nms
head -c 70000000 /dev/zero >zeros.csv
expect 1 "a table too large" "$nmsc" check marked.nms --marks zeros.csv
says "a table too large" file_too_large
printf 'name,time\nbeat,1s\nother,1s\n' >more.csv
expect 0 "more than is asked for" "$nmsc" check marked.nms --marks more.csv
says "more than is asked for" unused_times
expect 1 "more than is asked for, denied" "$nmsc" check marked.nms --marks more.csv --deny warnings
rm -f zeros.csv

# ---- Discourses
cat >talk.nms <<'NMS'
utterance ask in asl { signs { wh[ WHO{wh}@0s..0.6s COME@0.7s..1.4s ] } }
discourse talk in asl {
  role mary at right
  ask
  rs(mary)[ ask ]
  by addressee { nod(2x) at 0.3s }
}
NMS
expect 0 "a discourse" "$nmsc" list talk.nms
holds "a discourse and its addressee are as long" bash -c '[[ $(grep "discourse" out | cut -f3 | uniq | wc -l) -eq 1 && $(grep -c discourse out) -eq 2 ]]'
holds "an addressee has a clip" grep -q "^talk.addressee" out
expect 0 "a discourse on a face" "$nmsc" build talk.nms --clip talk --clip talk.addressee -o talk.glb
expect 0 "a role shift in overbar notation" "$nmsc" gloss talk.nms --clip talk
holds "a role shift is a bar over the bar that it quotes" grep -q "_rs:mary" out
no_leftovers "all of this"

echo "$count checks, $failed wrong"
[[ $failed -eq 0 && $count -gt 100 ]]
