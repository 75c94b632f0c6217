#!/bin/sh
# TEST full source seconds=900 needs=cc,includes uses=mpirun
# test_readme.sh: runs the commands of all Markdown files in a fresh copy of the tree.
# Speaks TAP, one test per block. `sh test_readme.sh PAGE...` takes these pages alone, after the README.
#
# Pages are taken in the order of their names, but the README first and tutorials last. Each tutorial begins in a copy
# that has the README's build and nothing else, and in another HOME.
#
# A block that begins with
#   ```sh             is run by `sh -eu` at the top of the copy, after the blocks before it; HOME is
#                     a fresh directory.
#   ```yaml NAME      (or any other language) is written to the file NAME of the copy.
#   ```sh with TOOL   is such a block, skipped if there is no TOOL.
#   ```text           (one word, not sh) is only shown.
#   ```sh elsewhere   is not run: it installs, or the whole test run covers it. Its commands must be
#                     some that this file knows, and the packages it names those of setup.sh.
set -u

top=$(CDPATH='' cd -- "$(dirname -- "$0")/../.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
copy="$work/flesh"
mkdir "$copy" "$work/home" "$work/blocks"
# HOME is another folder, but ccache's objects are those of the user.
CCACHE_DIR=$(ccache --get-config cache_dir 2>/dev/null) && export CCACHE_DIR

cd "$top" || exit 1
# fill: the copy gets the files of the tree.
fill() {
  if [ -e .git ] && git ls-files >"$work/files" 2>/dev/null; then
    tar -c -T "$work/files" | tar -x -C "$copy"
  else
    tar -c --exclude='./build*' --exclude=./out --exclude=./.git . | tar -x -C "$copy"
  fi
}
fill
# Commands of SLURM run on this machine.
PATH=$top/test/shared/slurm:$PATH

# Blocks go to files NNN, their opening lines to NNN.head.
if [ $# -gt 0 ]; then
  printf '%s\n' README.md "$@"
else
  (cd "$copy" && find . -name '*.md') | sed 's|^\./|1 |; s|^1 \(README\)|0 \1|; s|^1 \(drivers/tutorials\)|2 \1|' |
    LC_ALL=C sort | cut -d' ' -f2
fi >"$work/documents"
count=0
while IFS= read -r document; do
  count=$(awk -v blocks="$work/blocks" -v count="$count" -v document="$document" '
    /^ *```/ && inside { inside = 0; if (file != "") close(file); next }
    /^ *```/ {
      inside = 1
      file = ""
      match($0, /^ */)
      indent = RLENGTH
      sub(/^ *```/, "")
      if ($1 != "sh" && NF < 2) next  # only shown
      file = sprintf("%s/%03d", blocks, ++count)
      printf "" > file
      print document ":" FNR " " $0 > (file ".head")
      close(file ".head")
      next
    }
    inside && file != "" { print substr($0, 1 + indent) > file }
    END { print count }' "$copy/$document")
done <"$work/documents"

# known COMMANDS_FILE: prints the commands of an `elsewhere` block that are not allowed there.
known() {
  # Without -r, so that lines that end in a backslash go on.
  # shellcheck disable=SC2162
  while read first second third rest; do
    case "$first $second $third" in
      '  ' | '#'*) ;;
      'git clone '* | 'cd '*) ;;
      '/usr/bin/python3 -m venv' | 'env/bin/pip install --no-build-isolation') ;; # test_wheel.py
      'build/drivers/flesh hardcases --quick') ;; # test_hardcases_battery.sh
      'sh drivers/demo.sh ' | 'sh test/run.sh '* | 'sh test/campaign/fuzz.sh '* | 'sh test/campaign/debian.sh '*) ;;
      'sudo apt-get install')
        # shellcheck disable=SC2086
        given=$(printf '%s\n' $rest | grep -v '^-' | sort | tr '\n' ' ')
        list=build_packages
        case "$given" in python3-*) list=python_packages ;; esac
        wanted=$(root=$top CC='' sh -c '. "$root/drivers/setup.sh"; '"$list" | cut -d' ' -f1 | sort | tr '\n' ' ')
        [ "$wanted" = "$given" ] || echo "packages are $given; setup.sh has $wanted"
        ;;
      *) echo "not a command that the test run covers: $first $second $third $rest" ;;
    esac
  done <"$1"
}

echo "1..$((count + 1))"
number=0
page=
for block in "$work"/blocks/???; do
  [ -f "$block" ] || continue
  number=$((number + 1))
  read -r place language argument <"$block.head" || :
  name="$place $language${argument:+ $argument}"
  : >"$work/log"
  status=0
  skipped=
  if [ "${place%:*}" != "$page" ]; then
    page=${place%:*}
    case $page in
      drivers/tutorials/*)
        mv "$copy/build" "$work/build"
        rm -rf "$copy" "${work:?}/home"
        mkdir "$copy" "$work/home"
        mv "$work/build" "$copy"
        fill
        ;;
    esac
  fi
  case "$language $argument" in
    'sh with '*)
      tool=${argument#with }
      if command -v "$tool" >/dev/null 2>&1; then argument=; else skipped=" # SKIP there is no $tool"; fi
      ;;
  esac
  case "$language $argument" in
    'sh with '*) ;;
    'sh ')
      (cd "$copy" && HOME="$work/home" CMAKE_GENERATOR=Ninja sh -eu "$block") >"$work/log" 2>&1 </dev/null || status=$?
      [ "$status" -eq 0 ] || echo "ended with status $status" >>"$work/log"
      ;;
    'sh elsewhere')
      known "$block" >"$work/log"
      [ ! -s "$work/log" ] || status=1
      ;;
    *) cp "$block" "$copy/$argument" 2>"$work/log" || status=1 ;;
  esac
  if [ "$status" -eq 0 ]; then
    echo "ok $number - $name$skipped"
  else
    tail -n 100 "$work/log" | sed 's/^/# /'
    echo "not ok $number - $name"
  fi
done

number=$((number + 1))
if grep -qx 'sh drivers/demo.sh' "$work"/blocks/??? && grep -qx 'sh test/run.sh' "$work"/blocks/???; then
  echo "ok $number - the two main commands are told"
else
  echo "not ok $number - the two main commands are told"
fi
