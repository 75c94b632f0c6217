#!/bin/sh
# TEST quick source needs=cc,includes
# test_tree.sh: the tree keeps its own rules: the top level's names, no machine's paths in files,
# no unfinished marks, C files of a size that one reads. Speaks TAP.
set -u

top=$(CDPATH='' cd -- "$(dirname -- "$0")/../.." && pwd)
cd "$top" || exit 1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# The files that git tracks; without git, all files but build folders.
tracked=yes
if [ ! -e .git ] || ! git ls-files >"$work/files" 2>/dev/null; then
  tracked=
  find . -name .git -prune -o -path './build*' -prune -o -path './out' -prune -o -type f -print |
    sed 's|^\./||' >"$work/files"
fi
# A tracked file may have been deleted.
while IFS= read -r file; do [ ! -f "$file" ] || printf '%s\n' "$file"; done <"$work/files" >"$work/there"
mv "$work/there" "$work/files"

number=0
# verdict NAME: TAP line of the test whose findings are in $work/found; none is success.
verdict() {
  number=$((number + 1))
  if [ -s "$work/found" ]; then
    sed 's/^/# /' "$work/found"
    echo "not ok $number - $1"
  else
    echo "ok $number - $1"
  fi
}

echo 1..11

[ -s "$work/files" ] || echo 'Bail out! no files found'

# Without git there is no telling a stray file of the tree from one of its user.
allowed='lib|include|drivers|data|test|meson\.build|meson_options\.txt|README\.md|CHANGELOG\.md|CITATION\.cff|LICENSE|\..*'
if [ -n "$tracked" ]; then
  cut -d/ -f1 "$work/files" | sort -u | grep -Ev "^($allowed)\$" >"$work/found"
  verdict 'only the agreed names at the top level'
else
  number=1
  echo 'ok 1 - only the agreed names at the top level # SKIP not a git checkout'
fi

# search PATTERN: lines of text files that match.
search() {
  tr '\n' '\0' <"$work/files" | xargs -0 grep -nIHE -- "$1" >"$work/found"
}

search '(^|[^A-Za-z0-9_.}~-])/(work|farm|tmp|home|root)/'
verdict 'no paths of one machine'

# Split, so that this file does not match itself.
search '(^|[^A-Za-z])(TO''DO|FIX''ME|XX''X)([^A-Za-z]|$)'
verdict 'nothing marked as unfinished'

# snprintf returns the length that it wanted to write, so adding up its results overflows: flesh_text_add appends instead.
# Measuring a length with snprintf(NULL, 0, ...) is allowed.
grep -E '^(lib|drivers|include)/.*\.[ch]$' "$work/files" | grep -v '^lib/base/text\.c$' | tr '\n' '\0' |
  xargs -0 grep -snHE '([=+,(]|return) *(\((size_t|int)\) *)?v?snprintf\(' | grep -vE '= v?snprintf\(NULL, 0,' >"$work/found"
verdict 'nobody adds up what snprintf returns'

# Files are opened, made and removed by base/confine.h, so that folders of results are kept to. output.c compares files by
# whatever name; devices are no results.
grep -E '^(lib|drivers)/.*\.c$' "$work/files" | grep -vE '^(lib/base/confine|drivers/cli/output|drivers/examples/.*)\.c$' |
  tr '\n' '\0' | xargs -0 grep -snHE '(^|[^a-z_."`>])(fopen|open|creat|opendir|mkdir|unlink|rename|rmdir|remove|stat|lstat|access)\(' |
  grep -vE 'open\("/(dev|proc)/|: *(/\*|\*)|/\*[^/]*(fopen|open|stat|access|remove|rename)\(' >"$work/found"
verdict 'files are opened in one way'

grep '\.[ch]$' "$work/files" | tr '\n' '\0' |
  xargs -0 awk 'FNR == 601 { print FILENAME " has more than 600 lines" }' >"$work/found"
verdict 'C files of at most 600 lines'

grep '^include/.*\.h$' "$work/files" | tr '\n' '\0' |
  xargs -0 awk 'length > 121 { print FILENAME ":" FNR " has " length " columns" }' >"$work/found"
verdict 'public headers of at most 121 columns'

lines=$(wc -l <README.md)
{ if [ "$lines" -gt 150 ]; then echo "README.md has $lines lines"; fi; } >"$work/found"
verdict 'a README of at most 150 lines'

for picture in data/pictures/*.png; do
  name=$(basename "$picture" .png)
  grep -q "\\b$name\\b" data/pictures/make.sh || echo "data/pictures/make.sh does not make $picture"
  grep '\.md$' "$work/files" | xargs grep -q "pictures/$name\.png)" || echo "no page shows $picture"
done >"$work/found"
verdict 'one script makes every picture, and a page shows it'

# Links to other places of the tree; those to the web and within a page are not looked at.
grep '\.md$' "$work/files" | tr '\n' '\0' | xargs -0 grep -oH '\](\([^)#: ]*\))' | sed 's/:](/ /; s/)$//' |
  while read -r file link; do
    case $file in */*) folder=${file%/*} ;; *) folder=. ;; esac
    [ -e "$folder/$link" ] || echo "$file links to $link, which is not there"
  done >"$work/found"
verdict 'links of pages lead somewhere'

# Every name that a registry has stands in the page that tells of it.
{
  sed -n 's/^ *X(\(FLESH_[A-Z_]*\),.*/\1/p' include/flesh/status.h | while IFS= read -r name; do
    grep -q "\`$name\`" include/flesh/README.md || echo "include/flesh/README.md does not name $name"
  done
  for scene in data/scenes/*.yaml; do
    name=${scene##*/}
    grep -q "$name\`" data/README.md drivers/*.md || echo "no page names $scene"
  done
} >"$work/found"
verdict 'pages name every status and scene'
