# TEST full program alone seconds=60 needs=flesh,mpirun uses=stop_at
# TEST name=test_command_ranks_cases_quick memory program excerpt alone needs=flesh,mpirun uses=stop_at args: quick
# test_command_ranks_cases.sh: `mpirun -n N flesh sweep`, `drift`, `hardcases` and `accuracy`: ranks share out the cases,
# and the results are those of one rank; refusals, signals, crashes. FLESH names the program, MPIRUN the launcher.
set -u
. "$(dirname -- "$0")/../shared/command.sh"
. "$source_folder/shared/ranks.sh"
. "$source_folder/shared/sweep.sh"
case ${1-} in quick) numbers=3 ;; *) numbers='1 2 3' ;; esac
scenes=$data/scenes

# alike COMMAND ARGUMENT...: one rank and several give the same results, in folders of the same files.
alike() {
  command=$1
  shift
  rm -rf alone
  expect 0 "$flesh" "$command" "$@" --out alone || return 1
  for ranks in $numbers; do
    rm -rf shared
    expect 0 on_ranks "$ranks" "$flesh" "$command" "$@" --out shared || return 1
    [ ! -s stderr.txt ] || { cat stderr.txt; return 1; }
    python3 "$source_folder/shared/compare_cases.py" alone shared || return 1
  done
}

a_sweep() {
  { bar_spec 1/30; echo 'keep: true'; } >short.yaml
  alike sweep short.yaml && has stdout.txt '^48 cases: 48 complete' || return 1
  [ "$(figures alone/sweep.db)" = "$(figures shared/sweep.db)" ] || { figures shared/sweep.db; return 1; }
  expect 0 on_ranks 2 "$flesh" sweep short.yaml --out two --jobs 2 --shard 2/4 && has stdout.txt '^12 cases: 12 complete'
}

a_drift() {
  alike drift "$scenes/finger_pull_coarse.yaml" --energies S,E --poisson 0.3,0.45 --set time.end=0.05 || return 1
  cmp alone/verdict.txt shared/verdict.txt
}

a_battery() {
  alike hardcases --quick --cases 'single_*,twist1,line' --energies S --poisson 0.45 || return 1
  has stdout.txt '^5 runs: 5 cases, 1 settings; '
}

an_accuracy() {
  set -- "$scenes/swing_coarse.yaml" --quick --repeat 1 --reference-seconds 1 --set time.end=0.1 \
    --methods backward-euler,newmark --steps 1/60,1/120
  alike accuracy "$@"
}

# told CODE WORDS COMMAND...: three ranks end with CODE and one sentence of one of them, which has WORDS.
told() {
  code=$1 words=$2
  shift 2
  expect "$code" on_ranks 3 "$flesh" "$@" --out refused || return 1
  has stderr.txt "$words" && [ "$(grep -c "^flesh $1: " stderr.txt)" -eq 1 ] && [ ! -e refused ]
}

what_is_wrong_is_told_once() {
  told 3 'nowhere.yaml' sweep nowhere.yaml || return 1
  [ "$numbers" = 3 ] && return 0
  told 2 'unknown' drift "$scenes/swing_coarse.yaml" --never &&
    told 2 "has 'none'" hardcases --cases none &&
    told 2 'no inertia' accuracy "$scenes/swing_coarse.yaml" --set effects.inertia=null &&
    expect 0 on_ranks 2 "$flesh" hardcases --list && [ "$(grep -c '^.* single_plane ' stdout.txt)" -eq 1 ] &&
    expect 0 on_ranks 2 "$flesh" sweep short.yaml --dry-run && [ "$(grep -c '^48 cases' stdout.txt)" -eq 1 ]
}

# Writes endless.yaml: a sweep of cases without end.
endless_spec() {
  cat >endless.yaml <<END
scene: $scenes/bar_gravity.yaml
set: {time.end: 1e6, output.frame_interval: 0}
keep: true
axes: [{key: body.density, from: 500, to: 2000, count: 8}]
END
}

# Each of the two ranks runs a case.
two_run() { [ "$(find endless/cases -name history.csv 2>/dev/null | wc -l)" -eq 2 ]; }
children_of() { cat "/proc/$1/task/$1/children"; }

# A signal to a rank other than the first stops all in an orderly way; unfinished cases can be resumed.
a_signal_to_one_rank_ends_all() {
  endless_spec
  rm -rf endless
  begin_on 2 "$flesh" sweep endless.yaml --out endless
  wait_until "$launched" two_run || return 1
  kill -TERM "$(cat pid_1)" || return 1
  wait "$launched"
  [ $? -eq 143 ] || { echo 'not 143'; cat stderr.txt; return 1; }
  has stderr.txt 'interrupted after [0-9]* of 8 cases; --resume goes on' && [ "$(grep -c '^flesh sweep: ' stderr.txt)" -eq 1 ] &&
    [ "$(ask endless/sweep.db id "status <> 'planned'")" = '' ]
}

# A signal also stops ranks that wait for the first rank, which alone runs the meshes.
a_signal_ends_what_the_others_wait_for() {
  cat >sag.yaml <<END
body: {mesh: $data/meshes/bar_16x4x4.mesh, density: 1000, material: {energy: S, young: 1e5, poisson: 0.45}}
effects: [gravity: {acceleration: [0, 0, -0.2]}, pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}]
END
  begin_on 2 "$flesh" accuracy sag.yaml --mesh --mesh-seconds 1e6 --out meshes
  wait_until "$launched" [ -e meshes/mesh_0.states ] || return 1
  kill -TERM "$(cat pid_1)" || return 1
  wait "$launched"
  [ $? -eq 143 ] || { echo 'not 143'; cat stderr.txt; return 1; }
  has stderr.txt 'interrupted while the meshes were run'
}

# A killed case is a row, whichever rank runs it, and the rank takes the next case.
a_case_that_is_killed_is_a_row() {
  endless_spec
  rm -rf endless
  begin_on 2 "$flesh" sweep endless.yaml --out endless
  wait_until "$launched" two_run || return 1
  # shellcheck disable=SC2046
  kill -KILL $(children_of "$(cat pid_1)") || return 1
  three_run() { [ "$(find endless/cases -name history.csv | wc -l)" -eq 3 ]; }
  wait_until "$launched" three_run || return 1
  kill -TERM "$(cat pid_0)" || return 1
  wait "$launched"
  [ $? -eq 143 ] || { echo 'not 143'; cat stderr.txt; return 1; }
  [ "$(ask endless/sweep.db message "status <> 'planned'")" = 'its process was ended by signal 9 (Killed)' ] ||
    { ask endless/sweep.db '*'; return 1; }
}

# If a rank is killed, no other waits for it and no case goes on; the sweep can resume from the completed cases.
a_killed_rank_ends_all() {
  endless_spec
  rm -rf endless
  begin_on 2 "$flesh" sweep endless.yaml --out endless
  wait_until "$launched" two_run || return 1
  cases="$(children_of "$(cat pid_0)") $(children_of "$(cat pid_1)")"
  kill -KILL "$(cat pid_1)" || return 1
  wait "$launched"
  code=$?
  case $code in 0 | 124) echo "ended with $code"; return 1 ;; esac
  # shellcheck disable=SC2086
  wait_for_ends "$(cat pid_0)" "$(cat pid_1)" $cases || return 1
  [ "$(ask endless/sweep.db id "status not in ('planned', 'running')")" = '' ]
}

if [ "$numbers" = 3 ]; then
  run_tests a_sweep what_is_wrong_is_told_once a_signal_to_one_rank_ends_all
else
  run_tests a_sweep a_drift a_battery an_accuracy what_is_wrong_is_told_once \
    a_signal_to_one_rank_ends_all a_signal_ends_what_the_others_wait_for a_case_that_is_killed_is_a_row \
    a_killed_rank_ends_all
fi
