#!/bin/sh
# test_headers.sh: every public header compiles alone, as C11 and as C++17, without a warning.
# Speaks TAP. CC and CXX name the compilers, INCLUDES what a build adds for the header that it makes, SUNDIALS and MPI.
set -u

top=$(CDPATH='' cd -- "$(dirname -- "$0")/../.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

includes=${INCLUDES:-"\"-I$top/build/include\""} # words as the shell reads them

number=0
# compile LANGUAGE HEADER COMPILER FLAGS...: one TAP line.
compile() {
  language=$1
  header=$2
  shift 2
  eval "set -- \"\$@\" $includes"
  number=$((number + 1))
  # Twice, so that the guard is seen to work; a header may declare nothing.
  printf '#include "flesh/%s"\n#include "flesh/%s"\nstruct something;\n' "$header" "$header" >"$work/alone.$language"
  # shellcheck disable=SC2086
  if "$@" -Wall -Wextra -Wpedantic -Werror -fsyntax-only -I"$top/include" "$work/alone.$language" >"$work/log" 2>&1; then
    echo "ok $number - $header alone as $language"
  else
    sed 's/^/# /' "$work/log"
    echo "not ok $number - $header alone as $language"
  fi
}

cxx=${CXX:-}
for candidate in c++ g++ clang++; do
  if [ -z "$cxx" ] && command -v "$candidate" >/dev/null 2>&1; then cxx=$candidate; fi
done

cd "$top/include/flesh" || exit 1
for header in *.h sundials_abi.h; do
  # shellcheck disable=SC2086
  compile c "$header" ${CC:-cc} -std=c11
  if [ -n "$cxx" ]; then
    # shellcheck disable=SC2086
    compile cpp "$header" $cxx -std=c++17
  else
    number=$((number + 1))
    echo "ok $number - $header alone as cpp # SKIP there is no C++ compiler"
  fi
done
echo "1..$number"
