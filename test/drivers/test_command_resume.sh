# TEST quick program needs=flesh,stop_at
# TEST name=test_resume_methods full program needs=flesh,stop_at args: methods
# test_command_resume.sh: `flesh run --checkpoint` and `--resume`: a run that is killed before some call that touches a file
# resumes from its last checkpoint and gives the bits of an undisturbed run; runs that cannot be resumed are refused. FLESH
# names the program, STOP_AT the library to preload. `methods` runs only the tests of the other methods and bodies.
set -u
# Nothing here needs a disk, and waiting for one would take most of the time.
[ -n "${TMPDIR-}" ] || [ ! -w /dev/shm ] || TMPDIR=/dev/shm
export TMPDIR
. "$(dirname -- "$0")/../shared/command.sh"
shim=$(preloadable "${STOP_AT:?STOP_AT must name the library that stops the program}") || exit 1

"$flesh" mesh box --cells 3,1,1 --size 3,1,1 --out bar.msh >/dev/null || exit 1
"$flesh" mesh surface bar.msh skin.obj >/dev/null || exit 1
cat >bar.yaml <<'END'
body:
  mesh: bar.msh
  density: 1000
  material: {energy: S, young: 2e4, poisson: 0.45}
effects:
  - inertia: {}
  - gravity: {acceleration: [0, 0, -9.81]}
  - prescribed_motion: {box: [[-1, -1, -1], [1e-9, 2, 2]], motion: [{time: 0}, {time: 0.1, translation: [0, 0.3, 0]}]}
  - contact: {plane: {point: [0, 0, -0.05], normal: [0, 0, 1]}, friction: 0.3, slip_speed: 0.01}
time: {step: 1/60, end: 0.2}
output:
  frame_interval: 2
  skin: {surface: skin.obj, formats: [obj, vtu, pc2]}
  probes: [{name: tip, point: [3, 0.5, 0.5], quantities: [position, stress]}, {name: all, box: [[-9, -9, -9], [9, 9, 9]], quantities: [reaction, contact_force]}]
END

# stopped_at NUMBER COMMAND...: runs the command, which is killed before this call of those that touch a file (0: never);
# log.txt has these calls.
stopped_at() {
  number=$1
  shift
  rm -f log.txt
  env LD_PRELOAD="$shim" FLESH_STOP_AT="$number" FLESH_STOP_LOG="$work/log.txt" "$@" >stdout.txt 2>stderr.txt
}

# same_results FOLDER FOLDER: both folders hold the same files with the same bytes, except for result.json.
same_results() {
  (cd "$1" && find . -type f | sort) >files_1
  (cd "$2" && find . -type f | sort) >files_2
  cmp files_1 files_2 || { diff files_1 files_2; return 1; }
  while read -r file; do
    [ "$file" = ./result.json ] || cmp "$1/$file" "$2/$file" || return 1
  done <files_1
  # Counts go on when a run resumes: figures that do not depend on the machine's speed are equal.
  for folder in "$1" "$2"; do
    sed -n '/"figures"/,/"wall_s"/p; /"effects"/,/\]/p' "$folder/result.json" | grep -v 'wall_s\|cpu_s\|peak_memory'
  done >figures.txt
  half=$(($(wc -l <figures.txt) / 2))
  head -n "$half" figures.txt >figures_1
  tail -n "$half" figures.txt | cmp - figures_1
}

# killed_and_resumed ARGUMENT...: a run that is killed after two thirds of its calls resumes with the results of an undisturbed
# run.
killed_and_resumed() {
  rm -rf whole out
  expect 0 "$flesh" run bar.yaml --quiet --out whole "$@" || return 1
  stopped_at 0 "$flesh" run bar.yaml --quiet --checkpoint 3steps --out out "$@" || return 1
  [ ! -e out/checkpoint.bin ] || { echo 'the checkpoint of a complete run is still there'; return 1; }
  same_results whole out || return 1
  calls=$(($(wc -l <log.txt) * 2 / 3))
  stopped_at "$calls" "$flesh" run bar.yaml --quiet --checkpoint 3steps --out out "$@"
  [ $? -eq 137 ] && [ -e out/checkpoint.bin ] || { echo "not killed before call $calls"; return 1; }
  expect 0 "$flesh" run --resume out || return 1
  has stdout.txt 'goes on after step [1-9]' && same_results whole out
}
backward_euler_goes_on() { killed_and_resumed; }
bdf2_goes_on() { killed_and_resumed --method bdf2; }
midpoint_goes_on() { killed_and_resumed --method midpoint; }
newmark_goes_on() { killed_and_resumed --method newmark; }
hht_goes_on() { killed_and_resumed --method hht; }
static_goes_on() { killed_and_resumed --method static --set effects.inertia=null; }
# Part of the weld, or all of it, has broken before the kill.
a_weld_that_breaks_goes_on() {
  "$flesh" mesh box --cells 3,3,3 --size 3,1,1 --out fine.msh >/dev/null || return 1
  killed_and_resumed --set body.name=bar --set 'bodies=[{name: other, mesh: fine.msh, translation: [3, 0, 0]}]' \
    --set 'effects.weld.bodies=[other, bar]' --set effects.weld.breaks_at=500 &&
    has whole/result.json '"notes": "weld: 100 % of 1 m^2 broke, first at t = 0.05 s at' &&
    awk -F, 'NR == 1 { for (c = 1; c <= NF; c++) if ($c == "weld_broken") at = c }
      NR == 5 { exit !($at > 0 && $at < 1) }' whole/history.csv
}
# The matrix's pattern has grown before the kill.
bodies_that_touch_go_on() {
  killed_and_resumed --set 'bodies=[{name: other, mesh: bar.msh, translation: [0.3, 0.2, 1.02], rotation: [0, 0, 0.2]}]' \
    --set 'effects.contact[1].between=all' --set 'effects.contact[1].friction=0.4' &&
    awk -F, 'NR == 1 { for (c = 1; c <= NF; c++) if ($c == "contact_2_pairs") at = c } $at > most { most = $at }
      END { exit !(most > 0) }' whole/history.csv
}
incompressible_tets_go_on() { killed_and_resumed --set body.element=tet10-mean --set body.material.poisson=0.5 --set effects.contact=null --set output.probes=null --no-frames; }
runge_kutta_goes_on() { killed_and_resumed --method runge-kutta --set time.tolerance=1e-3; }

# Prints the largest difference of the last states' positions.
apart() { paste -d ' ' "$1/state.txt" "$2/state.txt" | awk '!/#/ { for (k = 1; k < 4; k++) { d = $k - $(k + 6); if (d < 0) d = -d; if (d > most) most = d } } END { print most }'; }

adaptive_agrees_and_says_so() {
  rm -rf whole out
  set -- --method ida --set effects.contact=null --set output.probes=null --set time.tolerance=1e-3
  expect 0 "$flesh" run bar.yaml --quiet --out whole "$@" || return 1
  stopped_at 150 "$flesh" run bar.yaml --quiet --checkpoint 3steps --out out "$@"
  [ $? -eq 137 ] || { echo 'not killed'; return 1; }
  expect 0 "$flesh" run --resume out || return 1
  has stdout.txt 'IDA starts anew there: the motion agrees with an unbroken one within time.tolerance' || return 1
  has out/result.json '"same_bits": false' || return 1
  echo "apart by $(apart whole out) m of 3"
  apart whole out | awk '{ exit !($1 > 0 && $1 < 3e-3) }' && [ "$(lines whole/history.csv)" -eq "$(lines out/history.csv)" ]
}

# A run may be killed at any moment, also while it resumes; each part is killed a little later.
any_moment_will_do() {
  rm -rf whole out
  expect 0 "$flesh" run bar.yaml --quiet --out whole || return 1
  for number in 3 8 14 25 60; do
    rm -rf out
    stopped_at "$number" "$flesh" run bar.yaml --quiet --checkpoint 1steps --out out
    resumed=0
    while [ -e out/checkpoint.bin ] && [ "$resumed" -lt 40 ]; do
      resumed=$((resumed + 1))
      stopped_at $((number + 7 * resumed)) "$flesh" run --resume out --quiet
    done
    if [ -e out/result.json ] && grep -q '"status": "complete"' out/result.json; then same_results whole out || return 1; fi
    [ "$resumed" -lt 40 ] || { echo "never done"; return 1; }
  done
}

sigterm_writes_one() {
  rm -rf whole out
  expect 0 "$flesh" run bar.yaml --quiet --out whole || return 1
  FLESH_STOP_SIGNAL=15 stopped_at 60 "$flesh" run bar.yaml --quiet --checkpoint 1000s --out out
  [ $? -eq 143 ] || return 1
  has stderr.txt 'interrupted by SIGTERM at t = .* s; flesh run --resume goes on' || return 1
  rows_before=$(lines out/history.csv)
  expect 0 "$flesh" run --resume out || return 1
  has stdout.txt "goes on after step $((rows_before - 2))," || return 1
  same_results whole out
}

a_spent_budget_goes_on() {
  rm -rf out
  expect 6 "$flesh" run bar.yaml --quiet --checkpoint 1000s --out out --max-seconds 1e-9 || return 1
  expect 6 "$flesh" run --resume out || return 1
  has stderr.txt 'the budget of 1e-09 s is spent' || return 1
  expect 0 "$flesh" run --resume out --quiet --max-seconds 1000 && same_results whole out
}

refused() { # CODE WORDS ARGUMENT...
  code=$1 words=$2
  shift 2
  expect "$code" "$flesh" run "$@" && has stderr.txt "$words"
}

what_cannot_go_on_is_refused() {
  rm -rf out empty copy
  mkdir empty
  expect 6 "$flesh" run bar.yaml --quiet --checkpoint 1000s --out out --max-seconds 1e-9 || return 1
  refused 3 'there is no checkpoint to go on from' --resume empty || return 1
  refused 3 'there is no checkpoint to go on from' --resume nowhere || return 1
  refused 2 'give no SCENE' --resume out bar.yaml || return 1
  refused 2 'give no SCENE' --resume out --set time.end=1 || return 1
  refused 2 'give no --out' --resume out --out other || return 1
  refused 2 'SCENE is missing' || return 1
  refused 2 'bar.msh: is read by this command' --resume out --save-state bar.msh || return 1
  for text in 60 s 0s 1.5steps -1s 5m 3stepss; do
    refused 2 'must be a number of seconds or steps' bar.yaml "--checkpoint=$text" || return 1
  done
  cp -r out copy
  sed -i 's/gravity/gravity /' copy/scene.yaml
  refused 2 'differs from the checkpoint.s scene' --resume copy || return 1
  rm -r copy
  cp -r out copy
  printf 'flesh checkpoint 4\nflesh 0.0.1, another\n' >copy/checkpoint.bin
  refused 2 'was written by flesh 0.0.1, another; this is flesh' --resume copy || return 1
  head -c 5000 out/checkpoint.bin >copy/checkpoint.bin
  refused 3 'is damaged' --resume copy || return 1
  echo nothing >copy/checkpoint.bin
  refused 3 'no checkpoint of flesh, or one of another format' --resume copy || return 1
  rm -r copy
  cp -r out copy
  head -n 1 out/history.csv | head -c 20 >copy/history.csv
  refused 3 'history.csv: has 20 bytes; the run had written' --resume copy || return 1
  rm -r copy
  cp -r out copy
  rm copy/frames/frames.pvd
  refused 3 'frames.pvd' --resume copy || return 1
  cp bar.msh kept.msh
  "$flesh" mesh box --cells 3,1,1 --size 3,1,1.5 --out bar.msh >/dev/null
  refused 2 'bar.msh: has changed since the run began' --resume out
  result=$?
  mv kept.msh bar.msh
  return $result
}

a_complete_run_says_so() {
  expect 0 "$flesh" run bar.yaml --quiet --no-frames --checkpoint 3steps --out out || return 1
  expect 0 "$flesh" run --resume out && has stdout.txt 'out: this run is complete, 12 steps to t = 0.2 s' || return 1
  expect 0 "$flesh" run bar.yaml --set time.end=1/60 --quiet --no-frames --out out &&
    expect 0 "$flesh" run --resume out && has stdout.txt 'complete, 1 step to'
}

a_new_run_drops_an_old_checkpoint() {
  rm -rf out
  expect 6 "$flesh" run bar.yaml --quiet --checkpoint 1000s --out out --max-seconds 1e-9 || return 1
  [ -e out/checkpoint.bin ] || return 1
  expect 0 "$flesh" run bar.yaml --quiet --out out || return 1
  [ ! -e out/checkpoint.bin ]
}

# All that a checkpoint relies on is on the disk before it gets its name, and the name is before the run goes on.
files_are_on_the_disk_first() {
  rm -rf out
  stopped_at 0 "$flesh" run bar.yaml --quiet --checkpoint 3steps --out out || return 1
  awk -v out="$work/out" '
    function base(path) { sub(".*/", "", path); return path }
    $1 == "write" || $1 == "truncate" { dirty[base($2)] = 1 }
    $1 == "fsync" { delete dirty[base($2)]; synced[base($2)] = 1 }
    $1 == "rename" {
      delete dirty[base($2)]
      if (base($3) == "checkpoint.bin") {
        checkpoints++
        if (!synced[base($2)]) { print "renamed before its bytes are on the disk: " $2; bad = 1 }
        for (file in dirty)
          if (file ~ /^(frame_.*vtu|skin_.*|frames.pvd|skin.pvd|history.csv|probes.csv)$/) { print "not on the disk: " file; bad = 1 }
        waits = 1
      } else dirty[base($3)] = 1
    }
    waits && $1 == "fsync" && $2 == out { waits = 0 }
    waits && $1 != "rename" && $1 != "fsync" { print "goes on before the name is on the disk: " $0; bad = 1; waits = 0 }
    END { if (checkpoints != 4) { print checkpoints " checkpoints"; bad = 1 } exit bad }' log.txt
}

if [ "${1-}" = methods ]; then
  run_tests bdf2_goes_on midpoint_goes_on newmark_goes_on hht_goes_on static_goes_on incompressible_tets_go_on \
    runge_kutta_goes_on any_moment_will_do
  exit
fi
run_tests backward_euler_goes_on bodies_that_touch_go_on a_weld_that_breaks_goes_on adaptive_agrees_and_says_so sigterm_writes_one \
  a_spent_budget_goes_on what_cannot_go_on_is_refused a_complete_run_says_so \
  a_new_run_drops_an_old_checkpoint files_are_on_the_disk_first
