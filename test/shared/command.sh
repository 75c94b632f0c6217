# command.sh: shared by the tests of the program's commands: a temporary folder, TAP, expected exit codes.
# To be sourced; FLESH names the program.
# shellcheck shell=sh
flesh=${FLESH:?FLESH must name the flesh program}
source_folder=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)  # test/
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
number=0

# Debian's Python, which has the packages; another one that comes first on the path may lack them or start slowly.
if [ -x /usr/bin/python3 ]; then
  python3() { /usr/bin/python3 "$@"; }
fi

# Each test is a function whose status says whether it passed; its output is shown as comments when it did not.
try() {
  number=$((number + 1))
  if ("$1") >log 2>&1; then
    printf 'ok %d - %s\n' "$number" "$1"
  else
    printf 'not ok %d - %s\n' "$number" "$1"
    sed 's/^/# /' log
  fi
}

# preloadable LIBRARY: copies it here, because LD_PRELOAD takes no path with spaces.
preloadable() {
  cp "$1" "$work/" && printf '%s\n' "$work/${1##*/}"
}

# expect CODE COMMAND...: the exit status; output goes to stdout.txt and stderr.txt.
expect() {
  code=$1
  shift
  "$@" >stdout.txt 2>stderr.txt
  status=$?
  [ "$status" -eq "$code" ] && return
  echo "$* ended with $status, not $code:"
  cat stdout.txt stderr.txt
  return 1
}

has() { grep -q -e "$2" "$1" || { echo "$1 lacks: $2"; cat "$1"; return 1; }; }
lines() { grep -c '' "$1"; }
rows() { [ "$(grep -v '^#' "$1" | wc -l)" -eq "$2" ]; }

# wait_until PID COMMAND...: repeats the command until it succeeds or the process PID has ended. There is no time limit, as
# none is right for all machines.
wait_until() {
  process=$1
  shift
  until "$@" 2>/dev/null; do
    grep -q '^State:.[^Z]' "/proc/$process/status" 2>/dev/null || { echo "$process ended before: $*"; return 1; }
    sleep 0.05
  done
}

# run_tests NAME... ${long:+NAME...}: runs the functions; with sanitizers without the long ones, which run the same lines in
# more steps.
if [ -z "${SANITIZED-}" ]; then long=yes; else long=; fi
run_tests() {
  echo "1..$#"
  for name in "$@"; do try "$name"; done
}
