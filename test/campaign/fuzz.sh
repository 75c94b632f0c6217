#!/bin/sh
# fuzz.sh: coverage-guided fuzzing of every reader, with the address and undefined-behaviour sanitizers.
#
#   sh test/campaign/fuzz.sh                     short: 200 000 executions more
#   sh test/campaign/fuzz.sh --full              until there are 1e9 executions in all; may be interrupted and restarted
#   sh test/campaign/fuzz.sh --runs 2e7 [READER...]   until there are that many in all, with these readers
#   sh test/campaign/fuzz.sh --report            prints the executions and findings so far
#   sh test/campaign/fuzz.sh --keep              minimises the inputs so far into the corpus that git keeps
#   sh test/campaign/fuzz.sh --kept [BUILD]     runs the inputs that git keeps once each, with the fuzzers of that build
#   sh test/campaign/fuzz.sh --try READER FILE...     runs inputs one by one, with the sentence of a failure
#
# Inputs, counts and findings stay outside the tree: in $CAMPAIGN, by default ~/.cache/flesh-campaign. One process runs at
# a time, at the lowest priority. The exit status is 1 if inputs that break a reader have been found.
set -eu

root=$(CDPATH='' cd -- "$(dirname -- "$0")/../.." && pwd)
state=${CAMPAIGN:-${XDG_CACHE_HOME:-$HOME/.cache}/flesh-campaign}
build=$state/build-fuzz
# Readers, each with its slices of executions in a round: readers that take microseconds get more than those that build a
# scene.
readers='mesh:60 surface:50 body:60 words:6 table:20 scene:3 sweep:1 hardcases:3'
slice=5000

die() {
  printf 'fuzz.sh: %s\n' "$*" >&2
  exit 2
}

executions() {
  awk -F'\t' -v only="${1:-}" 'only == "" || $1 == only { n += $2 } END { printf "%.0f\n", n }' "$state/executions.tsv"
}

findings() { find "$state/findings" -type f 2>/dev/null | wc -l; }

report() {
  printf '%-10s %14s %10s %9s\n' reader executions findings corpus
  for entry in $readers; do
    reader=${entry%:*}
    printf '%-10s %14s %10s %9s\n' "$reader" "$(executions "$reader")" \
      "$(find "$state/findings/$reader" -type f 2>/dev/null | wc -l)" \
      "$(find "$state/corpus/$reader" -type f 2>/dev/null | wc -l)"
  done
  printf '%-10s %14s %10s\n' all "$(executions)" "$(findings)"
  find "$state/findings" -type f 2>/dev/null || true
}

make_build() {
  command -v clang >/dev/null 2>&1 || die 'clang is missing: install the Debian package clang'
  if [ ! -f "$build/build.ninja" ]; then
    CC=clang meson setup "$build" "$root" -Dfuzz=true -Dtests=false -Dbuildtype=debugoptimized -Doptimization=1 \
      -Dc_args=-fsanitize=fuzzer-no-link -Db_sanitize=address,undefined -Db_lundef=false >/dev/null
  fi
  targets=
  for entry in $readers; do targets="$targets test/campaign/fuzz/fuzz_${entry%:*}"; done
  # shellcheck disable=SC2086
  nice ninja -C "$build" $targets >"$state/build.log" 2>&1 || {
    tail -20 "$state/build.log" >&2
    die 'the fuzzers do not build'
  }
}

ASAN_OPTIONS=quarantine_size_mb=8:malloc_context_size=8:detect_leaks=1:allocator_may_return_null=1
LSAN_OPTIONS="suppressions='$root/test/campaign/fuzz/leaks.txt':print_suppressions=0"
UBSAN_OPTIONS=print_stacktrace=1
export ASAN_OPTIONS LSAN_OPTIONS UBSAN_OPTIONS

# fuzz READER RUNS: runs a slice and notes its executions in executions.tsv; a finding ends the slice, not the campaign.
fuzz() {
  mkdir -p "$state/corpus/$1" "$state/findings/$1"
  FUZZ_FOLDER=$(mktemp -d /dev/shm/flesh-fuzz-XXXXXX)
  export FUZZ_FOLDER
  nice -n 19 "$build/test/campaign/fuzz/fuzz_$1" -runs="$2" -max_len=4096 -timeout=60 -rss_limit_mb=2048 \
    -malloc_limit_mb=256 -print_final_stats=1 -close_fd_mask=3 -artifact_prefix="$state/findings/$1/" \
    "$state/corpus/$1" "$root/test/campaign/corpus/$1" >"$state/log" 2>&1 || cp "$state/log" "$state/last-finding.log"
  rm -rf "$FUZZ_FOLDER"
  done=$(sed -n 's/^stat::number_of_executed_units: *//p' "$state/log")
  printf '%s\t%s\t%s\t%s\n' "$1" "${done:-0}" "$(date -u +%FT%TZ)" "$commit" >>"$state/executions.tsv"
}

# Runs every kept input once, with all readers even if one fails; prints the first lines of a failure.
kept() {
  failed=
  for entry in $readers; do
    reader=${entry%:*}
    FUZZ_FOLDER=$(mktemp -d /dev/shm/flesh-fuzz-XXXXXX)
    export FUZZ_FOLDER
    if "$build/test/campaign/fuzz/fuzz_$reader" -runs=0 -timeout=60 -rss_limit_mb=2048 -malloc_limit_mb=256 \
      -artifact_prefix="$state/" "$root/test/campaign/corpus/$reader" >"$state/log" 2>&1; then
      printf '%-10s %s inputs\n' "$reader" "$(find "$root/test/campaign/corpus/$reader" -type f | wc -l)"
    else
      failed=yes
      printf '%s fails:\n' "$reader"
      grep -v '^#' "$state/log" | head -40
    fi
    rm -rf "$FUZZ_FOLDER"
  done
  [ -z "$failed" ]
}

# rounds COUNT: repeats rounds over the readers until COUNT executions are done.
rounds() {
  while [ "$(executions)" -lt "$1" ]; do
    for entry in $readers; do
      if [ "$(executions)" -ge "$1" ]; then break; fi
      fuzz "${entry%:*}" $((${entry#*:} * slice))
    done
    if [ "$(findings)" -ge 100 ]; then die "100 inputs break a reader: see $state/findings"; fi
  done
}

# Minimises the kept inputs and those found since, for each reader; large inputs stay outside.
keep() {
  for entry in $readers; do
    reader=${entry%:*}
    kept=$root/test/campaign/corpus/$reader
    rm -rf "$state/least"
    mkdir -p "$state/least" "$state/corpus/$reader"
    FUZZ_FOLDER=$(mktemp -d /dev/shm/flesh-fuzz-XXXXXX)
    export FUZZ_FOLDER
    "$build/test/campaign/fuzz/fuzz_$reader" -merge=1 -max_len=4096 -close_fd_mask=3 "$state/least" "$kept" \
      "$state/corpus/$reader" >"$state/log" 2>&1 || die "merging the corpus of $reader failed: see $state/log"
    rm -rf "$FUZZ_FOLDER"
    # Inputs with names are written by hand and stay. Of the others at most 100 are kept, of all sizes below 1500 bytes.
    find "$kept" -type f -regex '.*/[0-9a-f]\{12\}' -delete
    find "$state/least" -type f -size -1500c -printf '%s %f\n' | sort -n >"$state/least.txt"
    all=$(wc -l <"$state/least.txt")
    awk -v all="$all" 'BEGIN { n = all < 100 ? all : 100 } int(NR * n / all) > int((NR - 1) * n / all) { print $2 }' \
      "$state/least.txt" | while read -r name; do
      cp "$state/least/$name" "$kept/$(printf %.12s "$name")"
    done
    printf '%s: %s inputs\n' "$reader" "$(find "$kept" -type f | wc -l)"
  done
}

mkdir -p "$state/corpus" "$state/findings"
touch "$state/executions.tsv"
commit=$(git -C "$root" rev-parse --short HEAD 2>/dev/null || echo unknown)
action=run
target=$(($(executions) + 200000))
while [ $# -gt 0 ]; do
  case $1 in
    --full) target=1000000000 ;;
    --runs)
      [ $# -gt 1 ] || die '--runs needs a number'
      target=$(printf '%.0f' "$2")
      shift
      ;;
    --report) action=report ;;
    --keep) action=keep ;;
    --kept)
      action=kept
      state=$(mktemp -d)
      trap 'rm -rf "$state"' EXIT
      if [ $# -gt 1 ]; then
        build=$2
        shift
      else
        build=$state/build-fuzz
        make_build
      fi
      ;;
    --try)
      action=try
      shift
      break
      ;;
    -*) die "unknown option $1; the first lines of this file tell the options" ;;
    *) break ;;
  esac
  shift
done
case $action in
  report) report ;;
  kept)
    kept
    exit
    ;;
  keep)
    make_build
    keep
    ;;
  try)
    make_build
    reader=${1:?a reader is expected}
    shift
    for input in "$@"; do
      FUZZ_FOLDER=$(mktemp -d /dev/shm/flesh-fuzz-XXXXXX)
      export FUZZ_FOLDER
      "$build/test/campaign/fuzz/fuzz_$reader" -timeout=60 -malloc_limit_mb=256 -rss_limit_mb=2048 \
        "$(realpath "$input")" || true
      rm -rf "$FUZZ_FOLDER"
    done
    ;;
  run)
    if [ $# -gt 0 ]; then
      chosen=
      for reader in "$@"; do
        for entry in $readers; do
          if [ "${entry%:*}" = "$reader" ]; then chosen="$chosen $entry"; fi
        done
      done
      [ -n "$chosen" ] || die "there is no such reader; they are $(printf '%s ' "$readers" | sed 's/:[0-9]*//g')"
      readers=$chosen
    fi
    make_build
    rounds "$target"
    report
    ;;
esac
[ "$(findings)" -eq 0 ]
