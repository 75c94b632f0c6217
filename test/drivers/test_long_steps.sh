# TEST quick program needs=flesh,slow_clock
# test_long_steps.sh: a run says what it does in a long step: first after ten seconds, then whenever the time has doubled,
# and at least every ten minutes; short steps and quiet runs say nothing. The clock advances by a given number of seconds
# at each reading. FLESH names the program, SLOW_CLOCK the library to preload.
set -u
. "$(dirname -- "$0")/../shared/command.sh"
shim=$(preloadable "${SLOW_CLOCK:?SLOW_CLOCK must name the library that slows the clock}") || exit 1

"$flesh" mesh box --cells 6,2,2 --size 3,1,1 --out bar.msh >/dev/null || exit 1
cat >bar.yaml <<'END'
body:
  mesh: bar.msh
  density: 1000
  material: {energy: S, constants: matched, young: 2e4, poisson: 0.45}
effects:
  - inertia: {}
  - gravity: {}
  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}
time: {method: static, step: 1, end: 0}
END

# ticking SECONDS ARGUMENT...: a run whose clock advances by SECONDS at each reading; its words are in stderr.txt.
ticking() {
  tick=$1
  shift
  expect 0 env LD_PRELOAD="$shim" FLESH_CLOCK_TICK="$tick" "$flesh" run bar.yaml --no-frames --out out "$@"
}

# Prints the seconds in these words, in a line.
told() { sed -n 's/^step [0-9]* has taken \([0-9]*\) s: .*/\1/p' stderr.txt | tr '\n' ' '; }

words_come_at_ten_seconds_and_at_each_doubling() {
  ticking 1 || return 1
  head -n 1 stderr.txt
  has stderr.txt '^step 1 has taken 10 s: from t = 0 s with h = [0-9.]* s, Newton iteration [0-9]*, [0-9]* linear ones, residual [0-9.e+-]* N, wanted [0-9.e+-]* N$' || return 1
  case $(told) in
  '10 20 '*) ;;
  *) told; return 1 ;;
  esac
  told | awk '{ for (k = 2; k <= NF; k++) bad += $k != 2 * $(k - 1); exit bad > 0 || NF < 2 }'
}

# With readings 100 s apart, words come at 100, 200, 400 and 800 s, and from then on every 600 s.
nothing_is_silent_for_longer_than_ten_minutes() {
  ticking 100 || return 1
  told
  case $(told) in
  '100 200 400 800 1400 2000 '*) ;;
  *) return 1 ;;
  esac
  told | awk '{ for (k = 2; k <= NF; k++) bad += $k - $(k - 1) > 600; exit bad > 0 }'
}

# Before the first linear solve of a solve no residual is known, and none is printed.
unknown_residuals_are_not_told() {
  ticking 5 || return 1
  has stderr.txt 'Newton iteration 1, 0 linear ones$' && ! grep 'residual 0 N' stderr.txt
}

# A long run of short steps says nothing.
short_steps_say_nothing() {
  ticking 0.5 --set time.method=backward-euler --set time.step=1/240 --set time.end=1/4 || return 1
  [ -z "$(told)" ] || { told; return 1; }
  has out/result.json '"steps": 60' &&
    awk -F'[:,]' '/"wall_s"/ && $2 > 60 { long = 1 } END { exit !long }' out/result.json
}

# In a long step after short ones, the words name this step and count from its beginning.
words_count_from_the_last_step() {
  ticking 0.5 --set time.method=backward-euler --set time.step=1/240 --set time.end=1/60 || return 1
  [ -z "$(told)" ] || return 1
  ticking 4 --set time.method=backward-euler --set time.step=1/240 --set time.end=1/60 || return 1
  has stderr.txt '^step 3 has taken 12 s: from t = 0.00833' || return 1
  ! told | grep -v '^\([0-9]\|[1-4][0-9]\| \)*$'
}

quiet_runs_say_nothing() {
  ticking 100 --quiet || return 1
  [ ! -s stderr.txt ]
}

run_tests words_come_at_ten_seconds_and_at_each_doubling unknown_residuals_are_not_told \
  nothing_is_silent_for_longer_than_ten_minutes short_steps_say_nothing words_count_from_the_last_step quiet_runs_say_nothing
