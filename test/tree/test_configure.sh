#!/bin/sh
# TEST full source needs=cc,sundials
# test_configure.sh: the configuration of a build refuses a SUNDIALS that does not fit, with a sentence that says what and
# where it is; and a cross build, which can run nothing, is configured. Speaks TAP.
# CC names the compiler; SUNDIALS_INCLUDE and SUNDIALS_FOLDER name the folders of headers and libraries of a SUNDIALS that
# fits (without the latter: where the linker looks).
set -u

top=$(CDPATH='' cd -- "$(dirname -- "$0")/../.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
unset CPATH C_INCLUDE_PATH LIBRARY_PATH CFLAGS CPPFLAGS LDFLAGS
number=0
compiler=${CC:-cc}
count=9

echo 1..$count
if ! command -v meson >/dev/null 2>&1; then
  while [ "$number" -lt $count ]; do
    number=$((number + 1))
    echo "ok $number - configuration # SKIP there is no meson"
  done
  exit 0
fi
folder=${SUNDIALS_FOLDER:-$(dirname "$(${CC:-cc} -print-file-name=libsundials_kinsol.so)")}

# prefix NAME [LINES]: makes a SUNDIALS with other LINES in its sundials_config.h and the libraries of the one that fits.
prefix() {
  mkdir -p "$work/$1/include/sundials" "$work/$1/lib"
  for name in ida kinsol nvector sunlinsol sunmatrix sunadaptcontroller sunnonlinsol sunmemory; do
    [ ! -e "$SUNDIALS_INCLUDE/$name" ] || ln -s "$SUNDIALS_INCLUDE/$name" "$work/$1/include"
  done
  ln -s "$SUNDIALS_INCLUDE"/sundials/* "$work/$1/include/sundials"
  rm "$work/$1/include/sundials/sundials_config.h"
  {
    echo '#pragma once'
    cat "$SUNDIALS_INCLUDE/sundials/sundials_config.h"
    printf '%s\n' "${2:-}"
  } >"$work/$1/include/sundials/sundials_config.h"
  ln -s "$folder"/libsundials_* "$work/$1/lib"
}

# configure ARGUMENTS...: configures a build of the library alone.
configure() {
  rm -rf "$work/build"
  meson setup "$work/build" "$top" -Dprogram=false -Dtests=false "$@" >"$work/log" 2>&1
}

# verdict STATUS NAME: prints a TAP line; the words of a failure are in $work/log.
verdict() {
  number=$((number + 1))
  if [ "$1" -eq 0 ]; then
    echo "ok $number - $2"
  else
    tail -n 20 "$work/log" | sed 's/^/# /'
    echo "not ok $number - $2"
  fi
}

# refused NAME WORDS: the prefix NAME is refused with an error that has WORDS.
refused() {
  ! configure "-Dsundials=$work/$1" && grep -q "ERROR: .*$2" "$work/log"
  verdict $? "$1: $2"
}

prefix fits
configure "-Dsundials=$work/fits" && grep -q "SUNDIALS (KINSOL, IDA) *: .*headers in $work/fits/include" "$work/log" &&
  grep -q "^Libs.private:.* $work/fits/lib/libsundials_kinsol" "$work/build/meson-private/flesh.pc" &&
  grep -q "^Cflags:.* -I$work/fits/include" "$work/build/meson-private/flesh.pc" &&
  grep -q "$work/fits/include" "$work/build/lib/flesh-config.cmake" &&
  grep -q "$work/fits/lib/libsundials_kinsol" "$work/build/lib/flesh-config.cmake"
verdict $? 'fits: is taken and recorded'

(CPATH="$work/fits/include" && export CPATH && configure) &&
  grep -q "^Libs.private:.* $work/fits/lib/libsundials_kinsol" "$work/build/meson-private/flesh.pc"
verdict $? 'fits: libraries come from where CPATH finds the headers'

# A project of which flesh is a subproject; its program is only compiled, as linking would need the whole library.
mkdir -p "$work/outer/subprojects"
ln -s "$top" "$work/outer/subprojects/flesh"
cp "$top"/drivers/examples/bar_kinsol.c "$top"/drivers/examples/bar.h "$work/outer"
cat >"$work/outer/meson.build" <<END
project('outer', 'c')
flesh = dependency('flesh', fallback: 'flesh', default_options: ['program=false', 'tests=false'])
executable('bar', 'bar_kinsol.c', dependencies: flesh)
END
(cd "$work/outer" && meson setup --force-fallback-for=flesh build >"$work/log" 2>&1 &&
  object=$(ninja -C build -t targets all | sed -n 's/^\(bar\.p[^:]*\.o\):.*/\1/p') && ninja -C build "$object" >>"$work/log" 2>&1)
verdict $? 'a subproject of meson is found as flesh'

# A compiler for another machine: nothing that it makes can be run here.
cat >"$work/cross.ini" <<END
[binaries]
c = '$(command -v "${compiler##* }")'
ar = 'ar'
strip = 'strip'
pkgconfig = 'pkg-config' # as meson before 1.3 calls it
pkg-config = 'pkg-config'
[properties]
needs_exe_wrapper = true
[host_machine]
system = 'linux'
cpu_family = '$(uname -m)'
cpu = '$(uname -m)'
endian = 'little'
END
configure --cross-file "$work/cross.ini" "-Dsundials=$work/fits" && [ -s "$work/build/meson-private/flesh.pc" ]
verdict $? 'a cross build is configured without running anything'

prefix single '#undef SUNDIALS_DOUBLE_PRECISION
#define SUNDIALS_SINGLE_PRECISION 1'
refused single 'is in single precision, and flesh is in double'

prefix old '#undef SUNDIALS_VERSION
#define SUNDIALS_VERSION "6.3.0"'
refused old 'SUNDIALS is 6.3.0 in .*6.4 or newer'

major=$(sed -n 's/^#define SUNDIALS_VERSION_MAJOR *//p' "$SUNDIALS_INCLUDE/sundials/sundials_config.h")
prefix mixed "#undef SUNDIALS_VERSION
#define SUNDIALS_VERSION \"$major.99.0\"
#undef SUNDIALS_VERSION_MINOR
#define SUNDIALS_VERSION_MINOR 99"
refused mixed "headers of $major.99.0 in .*, but the libraries that are linked are of"

prefix partial
rm "$work"/partial/lib/libsundials_ida.*
refused partial 'has no library sundials_ida here'

mkdir "$work/empty"
refused empty '\(has no header\|but the header\).*sundials/sundials_config.h'
