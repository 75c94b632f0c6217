#!/bin/sh
# TEST full seconds=300 needs=plain,cc,build,sundials,libraries
# test_install.sh: programs in C and C++ build with an installed copy in another folder (DESTDIR), by pkg-config with the
# shared and the static library and by CMake; the shared library exports the public functions alone; and headers and
# libraries of another SUNDIALS are refused. Speaks TAP.
# BUILD is the build directory; CC and CXX name the compilers; SUNDIALS_FOLDER is where the build's SUNDIALS has its
# libraries, if the linker does not look there.
set -u

here=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
number=0
# From reference/oracle/static_8x2x2_S_g0.5.txt: 0.5 - 0.84855813959973336.
expected='tip -0.348558'

# verdict STATUS NAME: prints a TAP line; the words of a failure are in $work/log.
verdict() {
  number=$((number + 1))
  if [ "$1" -eq 0 ]; then
    echo "ok $number - $2"
  else
    tail -n 60 "$work/log" | sed 's/^/# /'
    echo "not ok $number - $2"
  fi
}
# skip NAME WHY: prints the TAP line of a test that is left out.
skip() {
  number=$((number + 1))
  echo "ok $number - $1 # SKIP $2"
}

count=27
echo 1..$count
if ! command -v meson >/dev/null 2>&1; then
  while [ "$number" -lt $count ]; do skip 'installed copy' 'there is no meson to install with'; done
  exit 0
fi
DESTDIR="$work/copy" meson install -C "$BUILD" --no-rebuild >"$work/log" 2>&1
verdict $? 'meson install with DESTDIR'
if [ -n "$(find "$work/copy" -path '*/bin/flesh')" ]; then
  for file in man/man1/flesh.1 man/man1/flesh-run.1 man/man5/flesh-scene.5 bash-completion/completions/flesh \
    zsh/site-functions/_flesh; do
    find "$work/copy" -path "*/share/$file" | grep . >/dev/null || echo "no $file"
  done >"$work/log"
  [ ! -s "$work/log" ]
  verdict $? 'manual pages and completion'
else
  skip 'manual pages and completion' 'there is no program'
fi
pc=$(find "$work/copy" -name flesh.pc)
library=$(dirname "$(dirname "$pc")")
include=$(dirname "$(dirname "$(find "$work/copy" -name flesh.h)")")

# The shared library exports exactly what the headers declare with FLESH_API.
cat "$include"/flesh/*.h | tr '\n' ' ' | grep -oE 'FLESH_API [^;(]*\(' | grep -oE 'flesh_[a-z0-9_]+ *\($' |
  tr -d ' (' | LC_ALL=C sort >"$work/declared"
nm -D --defined-only "$library/libflesh.so" | awk '{ print $3 }' | LC_ALL=C sort >"$work/shown"
diff "$work/declared" "$work/shown" >"$work/log" && [ -s "$work/shown" ]
verdict $? 'the shared library shows the public functions and nothing else'
version=$(sed -n 's/^#define FLESH_VERSION_STRING "\(.*\)"$/\1/p' "$include/flesh/version.h")
# The library links SUNDIALS, SuiteSparse and libfyaml, and not GSL, which is GPL.
readelf -d "$library/libflesh.so" >"$work/log" && ! grep -q 'NEEDED.*\(gsl\|jansson\)' "$work/log"
verdict $? 'the library does without the libraries of the program'

# Every library is loaded from the folder in which the configuration found it, not another of the same soname.
shown=$library/libflesh.so
for program in $(find "$work/copy" -path '*/bin/flesh'); do shown="$shown $program"; done
# shellcheck disable=SC2086
(unset LD_LIBRARY_PATH && ldd $shown) >"$work/log" 2>&1 && ! grep -q 'not found' "$work/log" &&
  grep 'libsundials.*=>' "$work/log" >"$work/loaded" &&
  { [ -z "${SUNDIALS_FOLDER:-}" ] || ! grep -v " $SUNDIALS_FOLDER/" "$work/loaded"; }
verdict $? 'what is installed finds the SUNDIALS that it was built with'

cp "$here/installed.c" "$work/installed.c"
cp "$here/installed.c" "$work/installed.cpp"
cxx=${CXX:-}
for candidate in c++ g++ clang++; do
  if [ -z "$cxx" ] && command -v "$candidate" >/dev/null 2>&1; then cxx=$candidate; fi
done
export PKG_CONFIG_PATH="$library/pkgconfig${PKG_CONFIG_PATH:+:$PKG_CONFIG_PATH}"

# A copy without the shared library, so that -lflesh is the archive.
mkdir "$work/static"
cp -R "$work/copy/." "$work/static"
rm -f "$work/static${library#"$work/copy"}"/libflesh.so*

# runs PROGRAM: the program prints what is expected.
runs() {
  said=$("$1" 2>>"$work/log")
  echo "it says: $said; expected: $expected" >>"$work/log"
  [ "$said" = "$expected" ]
}

# build KIND LANGUAGE COMPILER...: builds a program by pkg-config and runs it.
build() {
  kind=$1 language=$2
  shift 2
  rm -f "$work/program"
  (
    cd "$work" || exit 1
    if [ "$kind" = static ]; then
      PKG_CONFIG_PATH="$work/static${library#"$work/copy"}/pkgconfig:$PKG_CONFIG_PATH"
      # shellcheck disable=SC2046
      "$@" -Wall -Wextra -Werror "installed.$language" $(pkg-config --cflags --libs --static flesh) -o program
    else
      # shellcheck disable=SC2046
      "$@" -Wall -Wextra -Werror "installed.$language" $(pkg-config --cflags --libs flesh) \
        -Wl,-rpath,"$library" -o program
    fi
  ) >"$work/log" 2>&1 && runs "$work/program"
  verdict $? "pkg-config, $kind library, $language"
}
# shellcheck disable=SC2086
for kind in shared static; do
  build $kind c ${CC:-cc} -std=c11
  if [ -n "$cxx" ]; then
    build $kind cpp $cxx -std=c++17
  else
    skip "pkg-config, $kind library, cpp" 'there is no C++ compiler'
  fi
done

# A program that owns its KINSOL and its KLU: the headers and libraries of both are in flesh.pc and flesh-sundials.pc.
cp "$here/../../drivers/examples/bar.h" "$here/../../drivers/examples/bar_kinsol.c" "$work"
for packages in '--static flesh' flesh-sundials; do
  # shellcheck disable=SC2046,SC2086
  (
    cd "$work" && unset CPATH C_INCLUDE_PATH LIBRARY_PATH LD_LIBRARY_PATH &&
      ${CC:-cc} -std=c11 bar_kinsol.c $(pkg-config --cflags --libs $packages) -Wl,-rpath,"$library" -o owner &&
      ./owner >said && diff said "$here/../reference/examples/bar_kinsol.txt"
  ) >"$work/log" 2>&1
  verdict $? "pkg-config $packages, a program that owns KINSOL and KLU"
done

# others LINES: compiles against SUNDIALS' headers as they would be with other LINES in sundials_config.h.
mkdir -p "$work/others/sundials"
others() {
  printf '#pragma once\n#include_next <sundials/sundials_config.h>\n%s\n' "$1" >"$work/others/sundials/sundials_config.h"
  # shellcheck disable=SC2046,SC2086
  (cd "$work" && ${CC:-cc} -std=c11 -fsyntax-only -Iothers $(pkg-config --cflags flesh) installed.c) >"$work/log" 2>&1
}
others '/* the same */'
verdict $? 'compiles with the SUNDIALS that flesh was built with'
others '#undef SUNDIALS_VERSION_PATCH
#define SUNDIALS_VERSION_PATCH 99'
verdict $? 'compiles with another patch of it'
# stops NAME LINES WORDS: with these LINES it does not compile, and the error has WORDS.
stops() {
  ! others "$2" && grep -q "error.*flesh was built with.*$3" "$work/log"
  verdict $? "does not compile with $1"
}
stops 'another minor version' '#undef SUNDIALS_VERSION_MINOR
#define SUNDIALS_VERSION_MINOR 99' 'another version'
stops 'another major version' '#undef SUNDIALS_VERSION_MAJOR
#define SUNDIALS_VERSION_MAJOR 99' 'another version'
stops 'another index size' '#if defined(SUNDIALS_INT64_T)
#undef SUNDIALS_INT64_T
#undef SUNDIALS_INDEX_TYPE
#define SUNDIALS_INT32_T 1
#define SUNDIALS_INDEX_TYPE int32_t
#else
#undef SUNDIALS_INT32_T
#undef SUNDIALS_INDEX_TYPE
#define SUNDIALS_INT64_T 1
#define SUNDIALS_INDEX_TYPE int64_t
#endif' '-bit indices'
stops 'single precision' '#undef SUNDIALS_DOUBLE_PRECISION
#define SUNDIALS_SINGLE_PRECISION 1' 'another precision'
number_of() { sed -n "s/^#define FLESH_SUNDIALS_$1 \([0-9]*\).*/\1/p" "$include/flesh/sundials_abi.h"; }
if [ "$(number_of VERSION_MAJOR)" -ge 7 ]; then
  # The value 2 differs from the build's own, whether that is on or off, and needs no mpi.h more than it did.
  stops 'MPI where it had none, or none where it had' '#undef SUNDIALS_MPI_ENABLED
#define SUNDIALS_MPI_ENABLED 2' 'has MPI'
else
  skip 'does not compile with MPI where it had none, or none where it had' 'before 7 MPI changes nothing that flesh uses'
fi

# With LD_LIBRARY_PATH, or the same soname elsewhere, the loader takes another SUNDIALS.
cat >"$work/another.c" <<'END'
#include <string.h>
int SUNDIALSGetVersionNumber(int *major, int *minor, int *patch, char *label, int length)
{
  *major = *minor = *patch = 98;
  memset(label, 0, (size_t)length);
  return 0;
}
END
# shellcheck disable=SC2046,SC2086
(
  cd "$work" && ${CC:-cc} -shared -fPIC another.c -o another.so &&
    ${CC:-cc} -std=c11 installed.c $(pkg-config --cflags --libs flesh) -Wl,-rpath,"$library" -o program &&
    ! LD_PRELOAD="$work/another.so" ./program && LD_PRELOAD="$work/another.so" ./program 2>&1 |
    grep "loaded SUNDIALS is 98.98.98, but flesh was built with"
) >"$work/log" 2>&1
verdict $? 'another loaded SUNDIALS is refused'

if ! command -v cmake >/dev/null 2>&1; then
  while [ "$number" -lt $count ]; do skip 'CMake' 'there is no cmake'; done
  exit 0
fi
# by_cmake FOLDER LANGUAGES LINES: configures and builds a project of these languages.
by_cmake() {
  mkdir "$work/$1"
  {
    printf 'cmake_minimum_required(VERSION 3.10)\nproject(outside %s)\nset(CMAKE_CXX_STANDARD 17)\n' "$2"
    printf 'find_package(flesh %s REQUIRED)\n%s\n' "${version%.*}" "$3"
  } >"$work/$1/CMakeLists.txt"
  cmake -G Ninja -S "$work/$1" -B "$work/$1/build" -DCMAKE_PREFIX_PATH="${library%/lib*}" \
    -Dflesh_DIR="$library/cmake/flesh" >"$work/$1.log" 2>&1 && cmake --build "$work/$1/build" >>"$work/$1.log" 2>&1
}
# program NAME SOURCE TARGETS...: prints a project's lines of a program.
program() {
  printf 'add_executable(%s %s)\ntarget_link_libraries(%s' "$1" "$work/$2" "$1"
  shift 2
  printf ' %s' "$@"
  echo ')'
}
by_cmake c C "$(program shared installed.c flesh::flesh)
$(program static installed.c flesh::flesh_static)
$(program owner bar_kinsol.c flesh::flesh flesh::sundials)
$(program static_owner bar_kinsol.c flesh::flesh_static)"
for kind in shared static; do
  cp "$work/c.log" "$work/log"
  runs "$work/c/build/$kind"
  verdict $? "CMake, $kind library, c"
done
for kind in owner static_owner; do
  cp "$work/c.log" "$work/log"
  "$work/c/build/$kind" >"$work/said" 2>>"$work/log" &&
    diff "$work/said" "$here/../reference/examples/bar_kinsol.txt" >>"$work/log"
  verdict $? "CMake, $kind of KINSOL and KLU"
done
# Projects of C++ with C and without.
for languages in 'C CXX' CXX; do
  folder=$(echo "$languages" | tr -d ' ')
  if [ -n "$cxx" ]; then
    by_cmake "$folder" "$languages" "$(program shared installed.cpp flesh::flesh)
$(program static installed.cpp flesh::flesh_static)"
  fi
  for kind in shared static; do
    if [ -z "$cxx" ]; then
      skip "CMake, $kind library, languages $languages" 'there is no C++ compiler'
      continue
    fi
    cp "$work/$folder.log" "$work/log"
    runs "$work/$folder/build/$kind"
    verdict $? "CMake, $kind library, languages $languages"
  done
done
