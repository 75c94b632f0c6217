#!/bin/sh
# test_examples.sh: an example prints what the reference says and what its own header shows. Speaks TAP.
# Usage: test_examples.sh PROGRAM SOURCE REFERENCE; RUN is the command that runs it, if it needs one.
set -u

program=$1 source=$2 reference=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# verdict STATUS NAME: prints a TAP line; the words of a failure are in $work/log.
number=0
verdict() {
  number=$((number + 1))
  if [ "$1" -eq 0 ]; then
    echo "ok $number - $2"
  else
    sed 's/^/# /' "$work/log"
    echo "not ok $number - $2"
  fi
}

echo 1..2
# shellcheck disable=SC2086
${RUN:-} "$program" >"$work/out" 2>"$work/err"
status=$?
{ diff "$reference" "$work/out"; cat "$work/err"; } >"$work/log" 2>&1
[ "$status" -eq 0 ] && cmp -s "$reference" "$work/out"
verdict $? "$(basename "$source" .c) prints what it should"

# The lines between "Sample output:" and the end of the comment, without the comment's " *   ".
awk '/^ \* Sample output:/ { inside = 1; next } /^ \*\// { exit } inside { sub(/^ \*   /, ""); print }' \
  "$source" >"$work/shown"
diff "$reference" "$work/shown" >"$work/log" 2>&1
verdict $? 'its header shows the same'
