#!/bin/sh
# run.sh: every test there is. Installs what is missing from Debian, builds, tests.
#
#   sh test/run.sh              everything
#   sh test/run.sh --quick      the quick suite alone, on the plain build
#   sh test/run.sh test_math    these tests alone (arguments of `meson test`), on the plain build
#
# The last line is `N passed, N failed`, and the exit status is 0 only when nothing failed.
set -eu

root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)
. "$root/drivers/setup.sh"

everything=yes
if [ "${1:-}" = --quick ]; then
  shift
  set -- --suite quick "$@"
fi
if [ $# -gt 0 ]; then everything=; fi

install_missing build_packages
install_missing test_packages
cd "$root"

# LLVM's linker takes a third of the time, and the build links a program for each test.
export CC_LD=lld
# Copies of the tree in other folders have the same objects; where their debug information says they lie does not matter.
export CCACHE_NOHASHDIR=yes

launcher=
jobs=$(($(nproc) + 1)) # launchers of MPI and what waits for others leave processors idle
# Checks that sums of pointers do not wrap take half of the kernels' compilation; what such a pointer reads is seen.
instrumented="-Dbuildtype=debugoptimized -Doptimization=1 -Dc_args=['-g1','-fno-sanitize=pointer-overflow'] -Db_lundef=false"
notes=$(mktemp -d)
trap 'rm -rf "$notes"' EXIT
: >"$notes/results"

# step NAME COMMAND...: one test of its own, silent unless it fails.
step() {
  name=$1
  shift
  printf '\n== %s\n' "$name"
  if ("$@") >"$notes/log" 2>&1; then
    printf 'ok %s\n' "$name" >>"$notes/results"
  else
    cat "$notes/log"
    printf 'not-ok %s\n' "$name" >>"$notes/results"
    return 1
  fi
}

# Of the files that the build compiled anew, which in a fresh clone are all.
no_warnings() { ! grep -A 5 'warning:' "$notes/build.log"; }

# Clang's warnings are errors here. What is optimised less is compiled sooner, and sanitizers see more of it. Meson finds
# ccache by itself only for the compiler that it chooses.
sanitized_build() {
  CC='ccache clang'
  export CC
  # shellcheck disable=SC2086
  build build-sanitize -Dwerror=true -Dfuzz=true $instrumented -Db_sanitize=address,undefined
}

# With what the tests of threads need and no more.
threads_build() {
  targets=meson-test-prereq
  # shellcheck disable=SC2086
  build build-threads $instrumented -Db_sanitize=thread
}

# Where the system spreads addresses widely, thread sanitizer's older runtimes find no room for what they note.
find_launcher() {
  build-threads/test/test_error >/dev/null 2>&1 && return
  launcher="setarch $(uname -m) -R"
}

# What thread sanitizer has reported, whatever the tests made of their programs' exit status.
no_races() {
  for report in "$notes"/race.*; do
    if [ -e "$report" ]; then cat "$report"; fi
  done
  [ ! -e "$report" ]
}

# suite NAME DIR [arguments of meson test]: the tests of one build.
suite() {
  name=$1
  directory=$2
  shift 2
  printf '\n== %s\n' "$name"
  rm -f "$directory/meson-logs/testlog.json"
  status=0
  # shellcheck disable=SC2086
  $launcher meson test -C "$directory" --no-rebuild --num-processes "$jobs" "$@" || status=$?
  printf 'suite %s %s %s\n' "$status" "$directory" "$name" >>"$notes/results"
}

if step 'the build' build build; then
  cp "$notes/log" "$notes/build.log"
  if [ -n "$everything" ]; then step 'no warnings from what was compiled' no_warnings || true; fi
  suite 'the tests' build ${everything:+--no-suite excerpt} "$@"
else
  everything=
fi

if [ -n "$everything" ]; then
  # Clang contracts other sums and products than GCC, its sanitizers see more, and its fuzzers need the same build.
  if step "Clang's build with sanitizers, without warnings" sanitized_build; then
    ASAN_OPTIONS=detect_leaks=1 UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1
    export ASAN_OPTIONS UBSAN_OPTIONS
    step "the fuzzers' kept inputs" sh test/campaign/fuzz.sh --kept build-sanitize || true
    suite 'the quick tests with sanitizers' build-sanitize
  fi
  if step 'the build with thread sanitizer' threads_build; then
    TSAN_OPTIONS=log_path=$notes/race
    export TSAN_OPTIONS
    find_launcher
    suite 'the tests of threads with thread sanitizer' build-threads
    launcher=
    step 'no data races' no_races || true
  fi
fi

python3 test/summarise.py "$notes/results"
