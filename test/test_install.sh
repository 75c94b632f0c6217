#!/bin/sh
# test_install.sh: outside programs, C and C++, against an installed copy in another folder (DESTDIR), by pkg-config
# with the shared and the static library and by CMake; and what the shared library shows to the outside. Speaks TAP.
# BUILD is the build directory; CC and CXX name the compilers.
set -u

here=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
number=0
# From reference/oracle/static_8x2x2_S_g0.5.txt: 0.5 - 0.84855813959973336.
expected='tip -0.348558'

# verdict STATUS NAME: TAP line; the words of a failure are in $work/log.
verdict() {
  number=$((number + 1))
  if [ "$1" -eq 0 ]; then
    echo "ok $number - $2"
  else
    tail -n 60 "$work/log" | sed 's/^/# /'
    echo "not ok $number - $2"
  fi
}
# skip NAME WHY
skip() {
  number=$((number + 1))
  echo "ok $number - $1 # SKIP $2"
}

echo 1..12
if ! command -v meson >/dev/null 2>&1; then
  while [ "$number" -lt 12 ]; do skip 'installed copy' 'there is no meson to install with'; done
  exit 0
fi
DESTDIR="$work/copy" meson install -C "$BUILD" --no-rebuild >"$work/log" 2>&1
verdict $? 'meson install with DESTDIR'
pc=$(find "$work/copy" -name flesh.pc)
library=$(dirname "$(dirname "$pc")")
include=$(dirname "$(dirname "$(find "$work/copy" -name flesh.h)")")

# Nothing beside what the headers declare with FLESH_API, and all of it.
cat "$include"/flesh/*.h | tr '\n' ' ' | grep -oE 'FLESH_API [^;(]*\(' | grep -oE 'flesh_[a-z0-9_]+ *\($' |
  tr -d ' (' | LC_ALL=C sort >"$work/declared"
nm -D --defined-only "$library/libflesh.so" | awk '{ print $3 }' | LC_ALL=C sort >"$work/shown"
diff "$work/declared" "$work/shown" >"$work/log" && [ -s "$work/shown" ]
verdict $? 'the shared library shows the public functions and nothing else'
readelf -d "$library/libflesh.so" >"$work/log" && grep -q 'SONAME.*\[libflesh\.so\.[0-9]*\]' "$work/log"
verdict $? 'the shared library has a soname of the major version'
# SUNDIALS, SuiteSparse, libfyaml: no GSL, which is GPL.
! grep -q 'NEEDED.*\(gsl\|jansson\)' "$work/log"
verdict $? 'the library does without the libraries of the program'

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

# runs PROGRAM: whether it prints what it should.
runs() {
  said=$("$1" 2>>"$work/log")
  echo "it says: $said; expected: $expected" >>"$work/log"
  [ "$said" = "$expected" ]
}

# build KIND LANGUAGE COMPILER...: by pkg-config.
build() {
  kind=$1 language=$2
  shift 2
  rm -f "$work/program"
  (
    cd "$work" || exit 1
    if [ "$kind" = static ]; then
      PKG_CONFIG_PATH="$work/static${library#"$work/copy"}/pkgconfig:$PKG_CONFIG_PATH"
      # shellcheck disable=SC2046
      "$@" -Wall -Wextra "installed.$language" $(pkg-config --cflags --libs --static flesh) -o program
    else
      # shellcheck disable=SC2046
      "$@" -Wall -Wextra "installed.$language" $(pkg-config --cflags --libs flesh) \
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

if ! command -v cmake >/dev/null 2>&1; then
  for what in 'shared library, c' 'shared library, cpp' 'static library, c' 'static library, cpp'; do
    skip "CMake, $what" 'there is no cmake'
  done
  exit 0
fi
languages=C
[ -z "$cxx" ] || languages='C CXX'
{
  printf 'cmake_minimum_required(VERSION 3.10)\nproject(outside %s)\n' "$languages"
  printf 'find_package(flesh 0.1 REQUIRED)\n'
  printf 'add_executable(shared_c installed.c)\ntarget_link_libraries(shared_c flesh::flesh)\n'
  printf 'add_executable(static_c installed.c)\ntarget_link_libraries(static_c flesh::flesh_static)\n'
  if [ -n "$cxx" ]; then
    printf 'set(CMAKE_CXX_STANDARD 17)\n'
    printf 'add_executable(shared_cpp installed.cpp)\ntarget_link_libraries(shared_cpp flesh::flesh)\n'
    printf 'add_executable(static_cpp installed.cpp)\ntarget_link_libraries(static_cpp flesh::flesh_static)\n'
  fi
} >"$work/CMakeLists.txt"
(
  cd "$work" && mkdir by_cmake && cd by_cmake &&
    cmake -G Ninja -DCMAKE_PREFIX_PATH="${library%/lib*}" -Dflesh_DIR="$library/cmake/flesh" .. && cmake --build .
) >"$work/cmake.log" 2>&1
for kind in shared static; do
  for language in c cpp; do
    if [ "$language" = cpp ] && [ -z "$cxx" ]; then
      skip "CMake, $kind library, $language" 'there is no C++ compiler'
      continue
    fi
    cp "$work/cmake.log" "$work/log"
    runs "$work/by_cmake/${kind}_$language"
    verdict $? "CMake, $kind library, $language"
  done
done
