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

# The build links a program for each test, and LLVM's linker needs a third of the time of the default one.
export CC_LD=lld
# Lets ccache share objects between copies of the tree; the folder in their debug information does not matter.
export CCACHE_NOHASHDIR=yes

launcher=
jobs=$(($(nproc) + 1)) # launchers of MPI and what waits for others leave processors idle
# Checks of pointers are off that cost a third of the time: the address sanitizer finds what null pointers and those that
# wrap or point too far read, and x86 and ARM read what is not aligned.
unchecked=-fno-sanitize=pointer-overflow,null,object-size,alignment
instrumented="-Dbuildtype=debugoptimized -Doptimization=1 -Dc_args=['-g1','$unchecked'] -Db_lundef=false"
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

# Passes if the last build, which compiles every file in a fresh clone, had no warnings.
no_warnings() { ! grep -A 5 'warning:' "$notes/build.log"; }

# Clang's warnings are errors here. Code that is optimised less compiles sooner and shows sanitizers more. Meson adds
# ccache only to a compiler that it chooses itself.
sanitized_build() {
  CC='ccache clang'
  export CC
  # shellcheck disable=SC2086
  build build-sanitize -Dwerror=true -Dfuzz=true $instrumented -Db_sanitize=address,undefined
}

# Builds only what the tests of threads need.
threads_build() {
  targets=meson-test-prereq
  # shellcheck disable=SC2086
  build build-threads $instrumented -Db_sanitize=thread
}

# Older runtimes of the thread sanitizer find no room for their shadow memory where the system randomises addresses
# widely; setarch -R switches that off.
find_launcher() {
  build-threads/test/test_error >/dev/null 2>&1 && return
  launcher="setarch $(uname -m) -R"
}

# Fails if the thread sanitizer has reported a race, even where a test ignored its program's exit status.
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
  # Clang fuses other sums and products than GCC does, its sanitizers find more, and its fuzzers need the same build.
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
