#!/usr/bin/env bash
# site_test.sh NMSC ROOT: what `nmsc doc` writes is well formed, complete, the same twice, and asks for nothing elsewhere.
set -euo pipefail
export LC_ALL=C
if [[ $# -ne 2 ]]; then
  echo "usage: site_test.sh NMSC ROOT" >&2
  exit 2
fi
nmsc=$(realpath "$1")
root=$(realpath "$2")
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
cd "$dir"
mkdir viewer
echo "var nmsViewer;" >viewer/viewer.js
echo "MIT" >viewer/viewer.LICENSE.txt
cp "$root"/tests/site/*.nms .
echo 'test "puff, from elsewhere" { play puff; expect AU34 >= 90% at 200ms }' | sed '1i use "other.nms"' >more.nms

for site in one two; do
  "$nmsc" doc --lexicon small.nms --lexicon other.nms --tests more.nms --viewer viewer -o "$site" 2>log || { cat log; exit 1; }
done
grep -q "5 entries on ada" log || { echo "wrong: it does not say what it did"; cat log; exit 1; }
diff -r one two || { echo "wrong: the same lexicons give other bytes"; exit 1; }
python3 "$root/tests/site/check_pages.py" one small/ask small/smile small/nod_twice small/looks_ahead other/puff
grep -q "puff, from elsewhere" one/other/puff.html || { echo "wrong: a test of another file is missing"; exit 1; }

# Entries that are gone take their pages with them; nothing else goes, whatever the list says.
mkdir two/mine outside
echo mine >two/mine/notes.html
echo mine >two/notes.html
echo mine >outside/page.html
ln -s ../outside two/link
echo mine >two/own.md
printf '%s\n' ../outside/page.html link/page.html /etc/hostname mine "$dir/outside/page.html" own.md two/../notes.html >>two/written.txt
"$nmsc" doc --lexicon small.nms --viewer viewer -o two 2>log || { cat log; exit 1; }
grep -q "; 4 files of entries that are gone removed" log || { echo "wrong: what is gone is not told"; cat log; exit 1; }
[[ ! -e two/other ]] || { echo "wrong: pages of a lexicon that is gone are there"; exit 1; }
for kept in two/small/ask.html two/mine/notes.html two/notes.html two/own.md outside/page.html two/link/page.html; do
  [[ -f $kept ]] || { echo "wrong: $kept is gone"; exit 1; }
done
"$nmsc" doc --lexicon small.nms --viewer viewer -o three 2>log || { cat log; exit 1; }
rm -r two/mine two/link two/notes.html two/own.md
diff -r two three || { echo "wrong: a folder used again differs from a new one"; exit 1; }
rm -r three

# The library's words, and what cannot be done.
fails() {
  local status=0
  "$nmsc" doc --viewer "${viewer:-viewer}" "${@:2}" 2>log || status=$?
  if [[ $status -ne 1 ]] || ! grep -q "error $1" log; then echo "wrong: $* gives $status"; cat log; exit 1; fi
}
viewer=nowhere fails no_viewer --lexicon small.nms -o three
fails unknown_lexicon --lexicon nobodys -o three
fails cannot_read --lexicon missing.nms -o three
fails unknown_name --lexicon small.nms -o three --tests <(echo 'test "t" { play nothing; expect AU1 never }')
[[ ! -e three ]] || { echo "wrong: something was written"; exit 1; }
touch file
fails cannot_write --lexicon other.nms -o file/site
echo "site: all as it should be"
