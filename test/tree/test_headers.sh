#!/bin/sh
# TEST quick source seconds=60 needs=cc,includes
# test_headers.sh: every public header compiles alone, as C11 and as C++17, and every C program of a page as C11, without
# a warning.
# Speaks TAP. CC and CXX name the compilers, INCLUDES a build's options for its generated header, SUNDIALS and MPI.
set -u

top=$(CDPATH='' cd -- "$(dirname -- "$0")/../.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

includes=${INCLUDES:-"\"-I$top/build/include\""} # words as the shell reads them

number=0
# compile NAME FILE COMPILER FLAGS...: compiles the file and prints a TAP line.
compile() {
  name=$1
  file=$2
  shift 2
  eval "set -- \"\$@\" $includes"
  number=$((number + 1))
  if "$@" -Wall -Wextra -Wpedantic -Werror -fsyntax-only -I"$top/include" "$file" >"$work/log" 2>&1; then
    echo "ok $number - $name"
  else
    sed 's/^/# /' "$work/log"
    echo "not ok $number - $name"
  fi
}

cxx=${CXX:-}
for candidate in c++ g++ clang++; do
  if [ -z "$cxx" ] && command -v "$candidate" >/dev/null 2>&1; then cxx=$candidate; fi
done

cd "$top/include/flesh" || exit 1
for header in *.h sundials_abi.h; do
  # The header is included twice to test its guard, and the struct is for a header that declares nothing.
  printf '#include "flesh/%s"\n#include "flesh/%s"\nstruct something;\n' "$header" "$header" >"$work/alone.c"
  cp "$work/alone.c" "$work/alone.cpp"
  # shellcheck disable=SC2086
  compile "$header alone as c" "$work/alone.c" ${CC:-cc} -std=c11
  if [ -n "$cxx" ]; then
    # shellcheck disable=SC2086
    compile "$header alone as cpp" "$work/alone.cpp" $cxx -std=c++17
  else
    number=$((number + 1))
    echo "ok $number - $header alone as cpp # SKIP there is no C++ compiler"
  fi
done

# Writes the blocks of pages that are whole programs: "```c NAME.c".
cd "$top" || exit 1
for page in README.md include/flesh/README.md drivers/*.md lib/*.md; do
  awk -v folder="$work" '/^```c [a-z_]+\.c$/ { file = folder "/page_" $2; next } /^```/ { file = "" } file { print >file }' \
    "$page"
done
for program in "$work"/page_*.c; do
  name=${program##*/page_}
  # shellcheck disable=SC2086
  compile "$name of a page" "$program" ${CC:-cc} -std=c11
done
echo "1..$number"
