# TEST quick program seconds=120 needs=flesh
# test_command_run.sh: `flesh run` and `flesh check`: their exit codes, files, signals and restarts.
# FLESH names the program.
set -u
. "$(dirname -- "$0")/../shared/command.sh"

# same_states FILE FILE LIMIT: the two states differ by at most LIMIT.
same_states() {
  grep -v '^#' "$1" >one.txt
  grep -v '^#' "$2" >two.txt
  paste -d ' ' one.txt two.txt | awk -v limit="$3" '
    NF != 12 { bad = 1 }
    { for (c = 1; c <= 6; c++) { d = $c - $(c + 6); if (d < 0) d = -d; if (d > worst) worst = d } }
    END { print "largest difference", worst; exit bad || NR == 0 || worst > limit }'
}

"$flesh" mesh box --cells 6,2,2 --size 3,1,1 --out bar.msh >/dev/null || exit 1
cat >bar.yaml <<'END'
body:
  mesh: bar.msh
  density: 1000
  material: {energy: S, constants: matched, young: 1e5, poisson: 0.45}
effects:
  - inertia: {}
  - gravity: {}
  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}
time: {method: backward-euler, step: 1/60, end: 1/2}
solver: {newton_tolerance: 1e-10}
END

a_good_run_writes_everything() {
  expect 0 "$flesh" run bar.yaml || return 1
  [ ! -s stderr.txt ] || { cat stderr.txt; return 1; } # no progress line without a terminal
  has stdout.txt 'material 0: S (matched)' && has stdout.txt 'poisson 0.45$' || return 1
  has stdout.txt '^preconditioner: ic$' || return 1
  [ "$(lines out/bar/history.csv)" -eq 32 ] || return 1 # header, start, 30 steps
  [ "$(ls out/bar/frames/*.vtu | wc -l)" -eq 31 ] || return 1
  [ "$(grep -c DataSet out/bar/frames/frames.pvd)" -eq 31 ] || return 1
  rows out/bar/state.txt 63 || return 1
  has out/bar/result.json '"status": "complete"' && has out/bar/result.json '"steps": 30' &&
    has out/bar/result.json '"instructions": "[a-z0-9]*"' &&
    has out/bar/result.json "$(sha256sum bar.yaml | cut -d ' ' -f 1)" &&
    has out/bar/result.json "$(sha256sum bar.msh | cut -d ' ' -f 1)" || return 1
  ! find . -name '*.part-*' | grep .
}

probes_stand_beside_the_history() {
  [ ! -e out/bar/probes.csv ] || return 1 # the scene has no probes
  expect 0 "$flesh" run bar.yaml --out probed --no-frames --quiet \
    --set 'output.probes[0]={name: tip, point: [2, 0.5, 0.5]}' \
    --set 'output.probes[1]={name: clamp, box: [[-1, -1, -1], [1e-9, 2, 2]], quantities: [reaction]}' || return 1
  [ "$(lines probed/probes.csv)" -eq 32 ] && cmp out/bar/state.txt probed/state.txt || return 1
  has probed/probes.csv '^t \[s\],tip.position_x \[m\],tip.position_y \[m\],tip.position_z \[m\],clamp.reaction_x \[N' ||
    return 1
  awk -F , 'NF != 10 { exit 1 }' probed/probes.csv || return 1
  expect 0 "$flesh" run probed/scene.yaml --out repeated --no-frames --quiet || return 1
  cmp probed/probes.csv repeated/probes.csv || return 1
  expect 0 "$flesh" run bar.yaml --out repeated --no-frames --quiet && [ ! -e repeated/probes.csv ]
}

# documented TABLE: prints the names of a table of `flesh schema results`, one a line.
documented() {
  "$flesh" schema "$1" | sed -n 's/^| \([^|]*\) | .*/\1/p' | tr -d ' ' | tr , '\n'
}

every_number_is_documented() {
  expect 0 "$flesh" schema results && has stdout.txt '^## history.csv$' && has stdout.txt '^## frames$' || return 1
  expect 0 "$flesh" run bar.yaml --out all --set time.end=1/60 --set output.reactions=true --quiet --error \
    --set 'effects.contact.plane={point: [0, 0, -5], normal: [0, 0, 1]}' \
    --set 'output.probes[0]={name: a, point: [2, 0.5, 0.5],
      quantities: [position, velocity, J, stretch, stress, energy]}' \
    --set 'output.probes[1]={name: b, box: [[-1, -1, -1], [2, 2, 2]], quantities: [J, reaction, contact_force]}' || return 1
  documented result.json >names
  sed -n '/^  "figures"/,/^  }/s/^    "\([A-Za-z_]*\)": .*/\1/p; s/^  "\([a-z_]*\)": .*/\1/p' all/result.json >named
  [ "$(lines named)" -gt 50 ] || return 1
  head -n 1 all/history.csv | tr , '\n' | grep -v '^energy_\|_error_' >columns
  # Columns that effects report, such as weld_broken from "broken" in weld.c.
  for effect in contact weld muscle surface_contact; do
    grep '_names\[\] = {"' "$source_folder/../lib/effect/$effect.c" |
      grep -o '"[a-z]*"' | tr -d '"' | sed "s/^/${effect#surface_}_/"
  done >>columns
  grep -qx weld_traction columns && grep -qx contact_ignored columns || return 1
  documented history.csv >history_names
  head -n 1 all/probes.csv | tr , '\n' | grep -v _error_ | sed -n 's/^[a-z]*\.\(.*\) \[.*/\1/p' | sed 's/_[xyz]*$//; s/_[123]$//' | sort -u >probes
  documented probes.csv >probe_names
  grep -vxFf names named && return 1
  grep -vxFf history_names columns && return 1
  grep -vxFf probe_names probes && return 1
  # The table's row of joints has the columns that a joint has.
  expect 0 "$flesh" run "$source_folder/../data/scenes/hinged.yaml" --set time.end=1/60 --set output.reactions=true --no-frames \
    --quiet --out joint && head -n 1 joint/probes.csv | grep -o '[,]joint[.][a-z]*_[a-z]*' | sort -u >joint_names || return 1
  "$flesh" schema results | sed -n 's/^| \([a-z_]*\), .*weld or joint.*/,joint.\1/p' >said && grep -qxFf said joint_names
}

vtk_reads_the_frames() {
  /usr/bin/python3 -c 'import vtkmodules.vtkIOXML' || { echo skipped; return 0; }
  /usr/bin/python3 "$source_folder/shared/check_vtu.py" out/bar/frames/frames.pvd || return 1
  for element in tet4 tet10-mean; do
    expect 0 "$flesh" run bar.yaml --set body.element=$element --set 'output.fields=[J, stress, von_mises, reaction]' \
      --set 'output.fields_at=[nodes, tets, points]' --set time.end=1/30 --out fields --quiet &&
      /usr/bin/python3 "$source_folder/shared/check_vtu.py" fields/frames/frame_000002.vtu >vtk.txt &&
      has vtk.txt 'nodes: von Mises' && has vtk.txt 'tets: components at points' || { cat vtk.txt; return 1; }
  done
}

the_resolved_scene_repeats_the_run() {
  expect 0 "$flesh" run out/bar/scene.yaml --out again --quiet || return 1
  [ ! -s stdout.txt ] || return 1
  cmp out/bar/state.txt again/state.txt && cmp out/bar/scene.yaml again/scene.yaml
}

threads_change_no_bit() {
  has out/bar/result.json '"threads": 1,' && has out/bar/result.json '"preconditioner": "ic"' || return 1
  for threads in 2 3 0; do
    expect 0 "$flesh" run bar.yaml --set "solver.threads=$threads" --out threaded --no-frames --quiet || return 1
    cmp out/bar/state.txt threaded/state.txt || return 1
    [ "$threads" = 0 ] && threads=$(nproc)
    has threaded/result.json "\"threads\": $threads," || return 1
  done
  expect 2 "$flesh" run bar.yaml --set solver.threads=257 --out refused --quiet && [ ! -e refused ] || return 1
  has stderr.txt 'threads is 257; it must be in 0 to 256'
}

# Which preconditioner `auto` is depends on the element, Poisson's ratio and whether the solves have inertia, and is printed.
preconditioners_are_told() {
  while read -r kind element poisson method said; do
    expect 0 "$flesh" run bar.yaml --set "solver.preconditioner=$kind" --set "body.element=$element" \
      --set "body.material.poisson=$poisson" --set "time.method=$method" --set time.end=1/60 --out told --no-frames ||
      return 1
    has stdout.txt "^preconditioner: $said\$" && has told/result.json "\"preconditioner\": \"$said\"" ||
      { echo "$kind, $element, $poisson, $method"; return 1; }
  done <<'END'
auto tet10-mean 0.49 backward-euler ic
auto tet10-mean 0.49 static volume-projection
auto tet10-mean 0.499 backward-euler volume-projection
auto tet10-mean 0.45 static ic
auto tet10 0.499 static ic
volume-projection tet10-mean 0.49 newmark volume-projection
volume-projection tet4 0.49 backward-euler ic
two-level tet10-mean 0.499 static two-level
END
}

methods_are_chosen_by_name() {
  for method in bdf2 midpoint newmark hht generalized-alpha; do
    expect 0 "$flesh" run bar.yaml --method "$method" --out "by-$method" --no-frames --quiet || return 1
    has "by-$method/scene.yaml" "method: $method\$" || return 1
    ! cmp -s out/bar/state.txt "by-$method/state.txt" || return 1
    same_states out/bar/state.txt "by-$method/state.txt" 1 || return 1
  done
  expect 0 "$flesh" run bar.yaml --set time.method=newmark --set time.gamma=0.6 --set time.beta=0.3025 --out damped \
    --no-frames --quiet || return 1
  ! cmp -s damped/state.txt by-newmark/state.txt || return 1
  expect 0 "$flesh" run bar.yaml --set time.alpha=0 --method hht --out undamped --no-frames --quiet || return 1
  same_states undamped/state.txt by-newmark/state.txt 1e-6 || return 1
  expect 2 "$flesh" run bar.yaml time.end=1 && has stderr.txt "time.end=1.*--set KEY=VALUE" || return 1
  expect 2 "$flesh" run bar.yaml --method euler --out none || return 1
  has stderr.txt 'time.method is "euler"; it must be one of backward-euler, static, bdf2, midpoint'
}

a_restart_goes_on_where_it_was() {
  # First iterates come from the steps before, which a restart does not have, so the solves are precise.
  precise='solver.newton_tolerance=1e-11'
  expect 0 "$flesh" run bar.yaml --out whole --set $precise --no-frames || return 1
  expect 0 "$flesh" run bar.yaml --out half --set $precise --set time.end=1/4 --save-state "it's half.txt" \
    --no-frames || return 1
  has "it's half.txt" '^# t 0.25$' && cmp "it's half.txt" half/state.txt || return 1
  expect 0 "$flesh" run bar.yaml --out rest --set $precise --start-state "it's half.txt" --no-frames || return 1
  [ "$(lines rest/history.csv)" -eq 17 ] || return 1
  same_states whole/state.txt rest/state.txt 1e-11 || return 1
  # The resolved scene of the restart repeats it.
  expect 0 "$flesh" run rest/scene.yaml --out rest2 --no-frames || return 1
  cmp rest/state.txt rest2/state.txt
}

older_results_are_replaced() {
  expect 0 "$flesh" run bar.yaml --out again --set time.end=1/10 || return 1
  [ "$(ls again/frames/*.vtu | wc -l)" -eq 7 ] && [ "$(grep -c DataSet again/frames/frames.pvd)" -eq 7 ] || return 1
  [ "$(lines again/history.csv)" -eq 8 ] || return 1
  expect 0 "$flesh" run bar.yaml --out again --set time.end=1/10 --no-frames || return 1
  [ ! -e again/frames ]
}

statics_make_one_solve() {
  sed '/inertia/d; /^time/d' bar.yaml >static.yaml
  expect 0 "$flesh" run static.yaml || return 1
  [ "$(lines out/static/history.csv)" -eq 3 ] && has out/static/result.json '"steps": 1'
}

help_is_help() {
  for words in --help 'run --help' 'help run'; do
    expect 0 "$flesh" $words && has stdout.txt '130/143' && has stdout.txt Usage || return 1
  done
  expect 0 "$flesh" --version && has stdout.txt 'SUNDIALS [67].* MPI [0-9n]'
}

bad_usage_is_refused() {
  for words in '' nonsense run 'run a b' 'run bar.yaml --nonsense' 'run bar.yaml --out' 'check' \
    'run bar.yaml --max-seconds 0' 'run bar.yaml --quiet=yes' 'run bar.yaml --set nonsense=1' \
    'run bar.yaml --set time.step=-1'; do
    expect 2 "$flesh" $words && [ "$(lines stderr.txt)" -eq 1 ] || { echo "words: $words"; cat stderr.txt; return 1; }
  done
  has stderr.txt 'time.step'
}

a_key_given_twice_is_refused() {
  expect 2 "$flesh" run bar.yaml --method adaptive --set time.method=hht --out twice &&
    has stderr.txt '^flesh run: --method adaptive and --set time.method=hht both give time.method; leave one out$' &&
    expect 2 "$flesh" run bar.yaml --start-state none.txt --set start.state=other.txt --out twice &&
    has stderr.txt 'both give start.state' && [ ! -e twice ]
}

bad_scenes_are_refused() {
  sed 's/density/dencity/' bar.yaml >bad.yaml
  for command in run check; do
    expect 2 "$flesh" $command bad.yaml && has stderr.txt 'bad.yaml:3' && has stderr.txt density || return 1
    expect 3 "$flesh" $command missing.yaml && has stderr.txt missing.yaml || return 1
  done
  [ ! -e out/bad ] && [ ! -e out/missing ] || return 1
  # A method that cannot run the scene is refused before anything is written.
  expect 2 "$flesh" run "$source_folder/../data/scenes/two_bodies.yaml" --method ida --out refused && [ ! -e refused ]
}

# `adaptive` is runge-kutta with steps by its error, also in the scene that the run has written.
adaptive_is_runge_kutta_by_its_error() {
  expect 0 "$flesh" run bar.yaml --method adaptive --set time.end=1/30 --out adaptive --no-frames &&
    has stdout.txt '^time: runge-kutta, steps by its error (tolerance 0.0001), states every 0.0166667 s to 0.0333333 s' &&
    expect 0 "$flesh" run adaptive/scene.yaml --out again --no-frames && cmp adaptive/state.txt again/state.txt &&
    expect 0 "$flesh" run bar.yaml --method runge-kutta --set time.end=1/30 --out fixed --no-frames &&
    has stdout.txt '^time: runge-kutta, steps of 0.0166667 s to 0.0333333 s' && ! cmp -s adaptive/state.txt fixed/state.txt
}

bad_meshes_are_refused() {
  printf 'nodes 4\n0 0 0\n1 0 0\n0 1 0\n1 1 0\ntets 1\n0 1 2 3\n' >flat.mesh
  for command in run check; do
    expect 3 "$flesh" $command bar.yaml --set body.mesh=flat.mesh && has stderr.txt flat.mesh || return 1
    expect 3 "$flesh" $command bar.yaml --set body.mesh=none.mesh && has stderr.txt none.mesh || return 1
  done
}

a_bad_place_is_refused_before_solving() {
  echo precious >file
  expect 3 "$flesh" run bar.yaml --out file && has stderr.txt 'must be a directory' || return 1
  expect 3 "$flesh" run bar.yaml --out file/below && has stderr.txt file/below || return 1
  expect 3 "$flesh" run bar.yaml --out saved --save-state none/state.txt && has stderr.txt none/state.txt || return 1
  [ ! -e saved ] || return 1
  [ "$(cat file)" = precious ]
}

# interrupted SIGNAL CODE: a run that would take hours ends by the signal with CODE, and leaves valid files.
interrupted() {
  "$flesh" run bar.yaml --out "long$1" --set time.end=1e5 --set output.frame_interval=5 \
    --max-seconds 600 >stdout.txt 2>stderr.txt &
  run=$!
  wait_until "$run" [ -e "long$1/frames/frame_000005.vtu" ] || return 1
  kill "-$1" "$run"
  wait "$run"
  status=$?
  [ "$status" -eq "$2" ] || { echo "ended with $status"; cat stderr.txt; return 1; }
  has "long$1/result.json" '"status": "interrupted"' && has "long$1/result.json" "\"exit_code\": $2" || return 1
  [ "$(tail -n 1 "long$1/result.json")" = '}' ] || return 1
  rows "long$1/state.txt" 63 || return 1
  # All rows are whole, the last is at the saved state's time, and every listed frame is there.
  awk -F , 'NR == 1 { n = NF } NF != n { exit 1 } END { exit NR < 3 }' "long$1/history.csv" || return 1
  [ "# t $(tail -n 1 "long$1/history.csv" | cut -d , -f 1)" = "$(head -n 1 "long$1/state.txt")" ] || return 1
  sed -n 's/.*file="\(.*\)".*/\1/p' "long$1/frames/frames.pvd" >listed
  [ -s listed ] && while read -r frame; do [ -s "long$1/frames/$frame" ] || return 1; done <listed
  ! find "long$1" -name '*.part-*' | grep .
}
sigint_keeps_what_was_done() { interrupted INT 130; }
sigterm_keeps_what_was_done() { interrupted TERM 143; }
# SIGHUP comes when a remote terminal goes away; under nohup it is ignored.
sighup_keeps_what_was_done() {
  # If the tests themselves were started with nohup, their children ignore SIGHUP, too.
  sh -c 'kill -HUP $$; exit 0' && { echo 'SIGHUP is ignored here'; return 0; }
  interrupted HUP 129
}
more_frames() { [ "$(find "$1" -name '*.vtu' | wc -l)" -gt "$2" ]; } # FOLDER COUNT
nohup_goes_on() {
  (trap '' HUP; exec "$flesh" run bar.yaml --out nohup --set time.end=1e5 --set output.frame_interval=5 --quiet) &
  run=$!
  wait_until "$run" more_frames nohup 2 || return 1
  kill -HUP "$run"
  wait_until "$run" more_frames nohup $(($(find nohup -name '*.vtu' | wc -l) + 2)) || return 1
  kill -INT "$run"
  wait "$run"
  [ $? -eq 130 ]
}

a_spent_budget_keeps_what_was_done() {
  expect 6 "$flesh" run bar.yaml --out budget --set time.end=1e5 --max-seconds 0.3 --no-frames || return 1
  has stderr.txt 'budget of 0.3 s' && has budget/result.json '"status": "out of budget"' && rows budget/state.txt 63
}

# A scene of 6 million tets, which takes seconds to read.
large="body: {mesh: $source_folder/../data/meshes/bar_16x4x4.mesh, refine: 4, material: {energy: S, young: 1e5, poisson: 0.4}}
effects: [gravity: {}, pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}]"
a_scene_is_given_up() {
  echo "$large" >large.yaml
  expect 6 "$flesh" run large.yaml --out large --max-seconds 0.1 && has stderr.txt 'budget is spent while the scene was set up' &&
    [ ! -e large ] || return 1
  for signal in INT TERM; do
    expect $([ $signal = INT ] && echo 130 || echo 143) timeout --preserve-status -s $signal 0.3 "$flesh" run large.yaml --out large &&
      [ ! -e large ] || return 1
  done
}

# A step that would take minutes is given up on a signal or a spent budget, and the state before it is kept.
"$flesh" mesh box --cells 36,12,12 --size 3,1,1 --out long.msh >/dev/null || exit 1
long_step() {
  set -- "$flesh" run bar.yaml --set body.mesh=long.msh --set time.method=static --set solver.preconditioner=none \
    --set body.material.poisson=0.4999 --set solver.max_linear=1000000 --set solver.linear_tolerance=1e-12 "$@"
  echo "$*" >command.txt
  "$@" >stdout.txt 2>stderr.txt
}
kept_before_the_step() { # NAME STATUS
  has "$1/result.json" "\"status\": \"$2\"" && has "$1/result.json" '"steps": 0' && rows "$1/state.txt" 6253 &&
    [ "$(head -n 1 "$1/state.txt")" = '# t 0' ] && [ "$(lines "$1/history.csv")" -eq 2 ]
}
a_budget_ends_a_long_step() {
  # The budget is doubled until it outlasts the set-up, however slow the machine, and is spent within the step.
  for budget in 0.5 1 2 4 8 16 32; do
    long_step --out long_budget --max-seconds $budget
    [ $? -eq 6 ] || { cat stderr.txt; return 1; }
    ! grep -q 'while the scene was set up' stderr.txt || continue
    if has long_budget/result.json '"unfinished_linear": [1-9]' >/dev/null 2>&1; then break; fi
  done
  kept_before_the_step long_budget 'out of budget'
}
a_signal_ends_a_long_step() {
  "$flesh" run long_budget/scene.yaml --out long_signal >stdout.txt 2>stderr.txt &
  run=$!
  wait_until "$run" [ -s long_signal/history.csv ] || return 1
  sleep 0.5 # into the step; before it the outcome is the same
  kill -INT "$run"
  wait "$run"
  [ $? -eq 130 ] || { cat stderr.txt; return 1; }
  kept_before_the_step long_signal interrupted
}

a_failed_solve_is_explained() {
  expect 4 "$flesh" run bar.yaml --out failed --set body.material.energy=B --set time.step=0.5 --set time.end=2 \
    --set 'effects.gravity.acceleration=[0, 0, -2000]' --set solver.max_cutbacks=1 --set solver.max_newton=3 || return 1
  has stderr.txt 'last try: t = .* s, h = .* after 1 halvings' && has stderr.txt 'worst tet: .* J = .* at (' &&
    has stderr.txt 'residual: .* N; target' && has stderr.txt 'advice: try' || return 1
  for key in '"status": "failed"' '"exit_code": 4' '"halvings": 1' '"worst_tet": [0-9]' '"worst_J"' \
    '"worst_position"' '"residual_target"' '"worst_node"' '"advice"'; do
    has failed/result.json "$key" || return 1
  done
  rows failed/state.txt 63 && [ "$(lines failed/history.csv)" -ge 2 ]
}

a_state_without_an_energy_is_explained() {
  awk '{ if ($1 != "#") $1 = -$1; print }' out/bar/state.txt | sed '/^# t/d' >mirrored.txt
  expect 4 "$flesh" run bar.yaml --out mirrored --set body.material.energy=B --start-state mirrored.txt || return 1
  has stderr.txt 'residual: none' && has stderr.txt 'advice: this energy has no value where' &&
    has mirrored/result.json '"residual": null' || return 1
  expect 7 "$flesh" run bar.yaml --out vast --set 'start.velocity=[1e200, 0, 0]' || return 1
  has stderr.txt 'residual: none' && has stderr.txt 'advice: numbers overflowed' &&
    has vast/result.json '"exit_code": 7'
}

check_differentiates() {
  expect 0 "$flesh" check bar.yaml --set time.method=bdf2 || return 1
  has stdout.txt '^time: bdf2, steps of' || return 1
  expect 0 "$flesh" check bar.yaml || return 1
  has stdout.txt 'elasticity .* pass' && has stdout.txt 'inertia .* pass' && has stdout.txt 'all fine'
}

odd_meshes_and_solves_are_named() {
  printf 'nodes 5\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n5 5 5\ntets 1\n0 1 3 2\n' >odd.mesh
  expect 0 "$flesh" run bar.yaml --out odd --set body.mesh=odd.mesh --set time.end=1/60 --no-frames || return 1
  has stdout.txt '1 tet was wound inversely and has been flipped' && has stdout.txt '1 node is used by no tet' ||
    return 1
  expect 0 "$flesh" run bar.yaml --out tight --set time.end=1/60 --set solver.newton_tolerance=1e-30 --no-frames ||
    return 1
  has stdout.txt '1 of 1 solves ended at rounding, above solver.newton_tolerance' && has tight/result.json '"warning": null' ||
    return 1
  printf 'nodes 5\n0 0 0\n1 0 0\n0 1 0\n.3 .3 1e-13\n1 1 1\ntets 2\n0 1 2 3\n1 2 3 4\n' >sliver.mesh
  expect 0 "$flesh" run bar.yaml --out sliver --set body.mesh=sliver.mesh --set time.end=1/60 --no-frames || return 1
  has stderr.txt '1 of 1 solves ended at rounding, the last with .* N out of balance, 1 of the forces to balance'
}

# A limit of the files' size acts like a file system without room.
a_full_disk_leaves_only_whole_files() {
  (ulimit -f 1 && expect 3 "$flesh" mesh box --cells 9,9,9 --size 1,1,1 --out big.msh) &&
    has stderr.txt 'big.msh: could not be written completely' && [ ! -e big.msh ] || return 1
  (ulimit -f 8 && expect 3 "$flesh" run bar.yaml --out full --set body.mesh=bar.msh) || return 1
  has stderr.txt 'frame_000000.vtu: could not be written completely' && has full/result.json '"status": "failed"' ||
    return 1
  ! find . -name 'big*' -o -name '*.vtu' -path './full/*' -o -name '*.part-*' | grep .
}

full_output_is_noticed() {
  [ -c /dev/full ] || return 0
  "$flesh" run --help >/dev/full 2>stderr.txt
  [ $? -eq 3 ]
}

tests='a_good_run_writes_everything
probes_stand_beside_the_history
every_number_is_documented
vtk_reads_the_frames
the_resolved_scene_repeats_the_run
threads_change_no_bit
preconditioners_are_told
methods_are_chosen_by_name
a_restart_goes_on_where_it_was
older_results_are_replaced
statics_make_one_solve
help_is_help
bad_usage_is_refused
a_key_given_twice_is_refused
bad_scenes_are_refused
adaptive_is_runge_kutta_by_its_error
bad_meshes_are_refused
a_bad_place_is_refused_before_solving
sigint_keeps_what_was_done
sigterm_keeps_what_was_done
sighup_keeps_what_was_done
nohup_goes_on
a_spent_budget_keeps_what_was_done
a_scene_is_given_up
a_budget_ends_a_long_step
a_signal_ends_a_long_step
a_failed_solve_is_explained
a_state_without_an_energy_is_explained
check_differentiates
odd_meshes_and_solves_are_named
a_full_disk_leaves_only_whole_files
full_output_is_noticed'
# shellcheck disable=SC2086
run_tests $tests
