#!/bin/sh
# TEST quick needs=library
# test_abi.sh: what libflesh.so exports is what abi.txt lists and what the headers declare. Speaks TAP.
# LIBRARY names the shared library. UPDATE=1 writes the list anew.
set -u
LC_ALL=C
export LC_ALL

top=$(CDPATH='' cd -- "$(dirname -- "$0")/../.." && pwd)
library=${LIBRARY:-$top/build/lib/libflesh.so}
list=$top/test/tree/abi.txt
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# T for functions, B, D or R for data. Names that begin with _ are the compiler's.
version=$(sed -n 's/^#define FLESH_VERSION_STRING "\(.*\)"$/\1/p' "$top/include/flesh/version.h")
nm -D --defined-only "$library" >"$work/names" || exit 1
{
  echo "# What libflesh.so $version exports. To announce a change: UPDATE=1 sh test/tree/test_abi.sh"
  awk '$3 !~ /^_/ { print $2, $3 }' "$work/names" | sort -k 2
} >"$work/now"
if [ "${UPDATE:-0}" = 1 ]; then cp "$work/now" "$list"; fi

echo 1..3
if diff -u "$list" "$work/now" >"$work/difference"; then
  echo 'ok 1 - what is exported is listed in abi.txt'
else
  sed 's/^/# /' "$work/difference"
  echo '# + is exported and not listed, - is listed and not exported. If this is intended:'
  echo '#   1. raise the version in meson.build and include/flesh/version.h: if there is a -, or anything changed that programs'
  echo '#      were compiled with, MAJOR (MINOR while MAJOR is 0); if there is only +, MINOR (PATCH while MAJOR is 0);'
  echo '#   2. UPDATE=1 LIBRARY=<build>/lib/libflesh.so sh test/tree/test_abi.sh, and commit test/tree/abi.txt with the change.'
  echo 'not ok 1 - what is exported is listed in abi.txt'
fi

# A header's function begins after FLESH_API and may go on in the next line.
cat "$top"/include/flesh/*.h | tr '\n' ' ' | sed 's/FLESH_API/\n&/g' |
  sed -n 's/^FLESH_API[^(;]*[ *]\(flesh_[a-z0-9_]*\)(.*/T \1/p' | sort -u -k 2 >"$work/declared"
if grep -v '^#' "$work/now" | diff -u "$work/declared" - >"$work/difference"; then
  echo 'ok 2 - what is exported is declared in the public headers'
else
  sed 's/^/# /' "$work/difference"
  echo 'not ok 2 - what is exported is declared in the public headers'
fi

# The soname has the version's MAJOR, and the MINOR while MAJOR is 0.
case $version in
0.*) together=${version%.*} ;;
*) together=${version%%.*} ;;
esac
if readelf -d "$library" | grep -q "SONAME.*\[libflesh\.so\.$together\]"; then
  echo "ok 3 - the soname ends with $together"
else
  readelf -d "$library" | grep SONAME | sed 's/^/# /'
  echo "not ok 3 - the soname ends with $together"
fi
