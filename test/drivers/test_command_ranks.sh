# TEST full program alone seconds=60 needs=flesh,mpirun uses=stop_at
# TEST name=test_command_ranks_quick memory program excerpt alone needs=flesh,mpirun uses=stop_at args: quick
# test_command_ranks.sh: `mpirun -n N flesh run SCENE` against the same scene on one rank, its refusals and its ends. FLESH
# names the program, MPIRUN the launcher, STOP_AT the library to preload; without it the tests of killed runs are left out.
# `quick` takes few scenes, each on one number of ranks, as launchers are slow.
set -u
. "$(dirname -- "$0")/../shared/command.sh"
. "$source_folder/shared/ranks.sh"
scenes=$source_folder/../data/scenes
if [ -n "${STOP_AT-}" ]; then shim=$(preloadable "$STOP_AT") || exit 1; fi
case ${1-} in quick) quick=1 ;; *) quick= ;; esac

# agree RANKS SCENE ARGUMENT...: runs on RANKS ranks and on one have the same results, within `limit`, and the same files.
# The solves are so tight that their errors stay far below `limit`. In a full test, scenes on 5 ranks are run on 8, too.
limit=1e-6
tolerance=1e-9
agree() {
  numbers=$1
  if [ -z "$quick" ] && [ "$1" -eq 5 ]; then numbers='5 8'; fi
  scene=$2
  shift 2
  "$flesh" run "$scene" "$@" --quiet --set solver.newton_tolerance=$tolerance --out alone || return 1
  for ranks in $numbers; do
    expect 0 on_ranks "$ranks" "$flesh" run "$scene" "$@" --quiet --set solver.newton_tolerance=$tolerance --out shared || return 1
    python3 "$source_folder/shared/compare_runs.py" alone shared "$limit" || return 1
    (cd alone && find . -type f | sort) >files_1
    (cd shared && find . -type f | sort) >files_2
    diff files_1 files_2 || return 1
  done
}

statics() { agree 3 "$scenes/swing_coarse.yaml" --set effects.inertia=null; }
damping() { agree 5 "$scenes/damped_bar.yaml" --set time.end=0.05 --no-frames; }
prescribed_motion() { agree 2 "$scenes/viscous_spin.yaml" --set time.end=0.02 --no-frames; }
several_bodies() { agree 3 "$scenes/two_bodies.yaml" --set effects.contact=null --set time.end=0.05; }
newmark() { agree 2 "$scenes/swing_coarse.yaml" --method newmark --set time.end=0.1; }
# Rounding leads IDA to other steps, which are as good: they leave errors of a few times 1e-6, of velocities ten times that.
adaptive() {
  # Of this body of ten-node tets one rank has as many nodes as a coarse level needs, and the other fewer.
  "$flesh" mesh box --cells 15,2,2 --size 1,.3,.3 --out beam.msh >/dev/null || return 1
  cat >beam.yaml <<'END'
body: {mesh: beam.msh, density: 1000, element: tet10, material: {energy: S, young: 1e5, poisson: 0.4}}
effects: [inertia, gravity, pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}]
time: {method: ida, tolerance: 1e-4, step: 1/60, end: 1/60}
END
  limit=1e-4
  agree 3 "$scenes/swing_coarse.yaml" --method ida --set time.tolerance=1e-6 --set time.end=0.2 --no-frames &&
    agree 2 "$scenes/viscous_spin.yaml" --method ida --set time.tolerance=1e-6 --set time.end=0.05 --no-frames &&
    agree 2 beam.yaml --no-frames
  code=$?
  limit=1e-6
  return "$code"
}
# A cube lands on a plane, and slides with friction.
contact() {
  "$flesh" mesh box --cells 4,3,3 --size 1,1,1 --out cube.msh >/dev/null || return 1
  cat >cube.yaml <<'END'
body: {mesh: cube.msh, density: 1000, material: {energy: S, young: 1e5, poisson: 0.4}}
effects:
  - inertia: {}
  - gravity: {}
  - contact: {plane: {point: [0, 0, -0.1], normal: [0.1, 0, 1]}, friction: 0.3, slip_speed: 0.01}
start: {velocity: [1, 0.5, -1]}
time: {step: 1/60, end: 0.4}
END
  agree 3 cube.yaml --no-frames && python3 - shared/history.csv <<'END'
import csv, sys
assert max(int(float(row["contact_nodes"])) for row in csv.DictReader(open(sys.argv[1]))) >= 4
END
}
pressures() { agree 3 "$scenes/inflated_sphere.yaml" --set body.element=tet10 --set time.end=0.1 --no-frames; }
# A strip that a pressure bends until its end hangs four fifths of its length below.
following_loads() {
  "$flesh" mesh box --cells 6,1,1 --size 0.1,0.03,0.01 --out strip.msh >/dev/null || return 1
  cat >strip.yaml <<'END'
body: {mesh: strip.msh, element: tet10-mean, density: 1000, material: {energy: S, young: 1e5, poisson: 0.3}}
effects:
  - pin: {box: [[-1, -1, -1], [1e-9, 1, 1]]}
  - pressure: {box: [[-1, -1, 0.00999], [1, 1, 1]], pressure: 128}
time: {method: static}
END
  agree 2 strip.yaml
}

# An incompressible body has a pressure for each tet, also in its states.
incompressible_body() {
  "$flesh" mesh box --cells 4,2,2 --size 2,1,1 --out bar.msh >/dev/null || return 1
  cat >bar.yaml <<'END'
body: {mesh: bar.msh, density: 1000, element: tet10-mean, material: {energy: S, young: 1e5, poisson: 0.5}}
effects: [inertia: {}, gravity: {}, pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}]
time: {step: 1/60, end: 0.05}
END
}
incompressible() {
  incompressible_body && agree 3 bar.yaml --no-frames && has shared/result.json '"preconditioner": "volume-projection"'
}
# An incompressible body beside a compressible one: a rank has no tets with pressures.
incompressible_beside_others() {
  incompressible_body || return 1
  cat >>bar.yaml <<'END'
bodies:
  - {name: other, mesh: bar.msh, translation: [5, 0, 0], density: 1000, element: tet10-mean, material: {energy: S, young: 1e5, poisson: 0.4}}
END
  agree 2 bar.yaml --no-frames
}
# Ranks cut through surfaces in contact: of bodies that collide with friction, and of a strip that lies on itself.
bodies_that_touch() {
  agree 3 "$scenes/two_bodies.yaml" --set time.end=0.2 --no-frames && touched shared/history.csv
}
a_body_that_touches_itself() { agree 3 "$scenes/fold.yaml" --set time.end=0.1 --no-frames; }
touched() {
  python3 - "$1" <<'END'
import csv, sys
assert max(float(row["contact_force"]) for row in csv.DictReader(open(sys.argv[1]))) > 0
END
}
# make_cubes HEIGHT VELOCITY CONTACT: writes cubes.yaml, in which one cube falls onto another, or begins within it and is
# separated.
make_cubes() {
  "$flesh" mesh box --cells 3,3,2 --size 1,1,1 --out cube.msh >/dev/null && cat >cubes.yaml <<END
body: {name: low, mesh: cube.msh, density: 1000, material: {energy: S, young: 1e5, poisson: 0.4}}
bodies:
  - {name: high, mesh: cube.msh, translation: [0.3, 0.2, $1], density: 1000,
     material: {energy: S, young: 1e5, poisson: 0.4}, velocity: $2}
effects:
  - inertia: {}
  - gravity: {}
  - pin: {body: low, box: [[-1, -1, -1], [2, 2, 0.001]]}
  - contact: {between: all, friction: 0.3, slip_speed: 0.01, stiffness: 1e6, $3}
time: {step: 1/100, end: 0.3}
END
}
cubes() {
  make_cubes "$@" && agree 5 cubes.yaml --no-frames && touched shared/history.csv
}
adaptive_contact() {
  cubes 1.06 '[0.5, 0, -1]' 'adaptive: true' && has shared/result.json 'the stiffness was 1e+06 Pa at first'
}
bodies_that_come_apart() {
  cubes 0.97 '[0.1, 0, 1]' 'intersecting: separate' && python3 - shared/history.csv <<'END'
import csv, sys
ignored = [int(float(row["contact_ignored"])) for row in csv.DictReader(open(sys.argv[1]))]
assert ignored[0] == 1 and ignored[-1] == 0, ignored
END
}
# Ranks report intersecting bodies by the numbers of the whole, as a single process does.
bodies_in_each_other_are_refused() {
  quick=1
  cubes 0.97 '[0, 0, 0]' 'adaptive: false' >refusal.txt && return 1
  expect 2 "$flesh" run cubes.yaml --quiet --out crossed && grep -o 'the edge of.*' stderr.txt >said_alone || return 1
  expect 2 on_ranks 3 "$flesh" run cubes.yaml --quiet --out crossed && grep -o 'the edge of.*' stderr.txt >said || return 1
  diff said_alone said
}
# A cube that has collapsed into a point is untangled as a whole, above the plane through which it would reach.
untangling() {
  "$flesh" mesh box --cells 3,3,3 --size 1,1,1 --out cube.mesh >/dev/null && cat >point.yaml <<'END' || return 1
body: {mesh: cube.mesh, density: 1000, material: {energy: E, young: 1e5, poisson: 0.3}}
effects:
  - inertia: {}
  - contact: {plane: {point: [0, 0, 0], normal: [0.1, 0, 1]}}
start: {state: point.txt}
time: {step: 0.1, end: 8}
END
  awk '/^Vertices/ { getline count; for (; count > 0; count--) { getline; print $1 / 100 + 0.5, $2 / 100, $3 / 100 + 0.1, 0, 0, 0 } }' \
    cube.mesh >point.txt
  expect 0 "$flesh" run point.yaml --quiet --no-frames --out alone || return 1
  numbers=${quick:+3}
  for ranks in ${numbers:-2 3 5}; do
    expect 0 on_ranks "$ranks" "$flesh" run point.yaml --quiet --no-frames --out shared && python3 - alone shared <<'END' || return 1
import json, sys
ends = []
for folder in sys.argv[1:]:
    figures = json.load(open(f"{folder}/result.json"))["figures"]
    assert figures["untanglings"] == 1 and figures["untangled_nodes"] == 64, figures
    assert figures["final_inverted"] == 0 and abs(figures["final_volume_drift"]) < 1e-6, figures
    rows = [line.split() for line in open(f"{folder}/state.txt") if not line.startswith("#")]
    ends.append([[float(word) for word in row[:3]] for row in rows])
    assert min(0.1 * x + z for x, _, z in ends[-1]) > 0 and max(z for _, _, z in ends[-1]) > 0.9
# Nothing holds it along the plane.
assert max(abs(a - b) for one, other in zip(*ends) for a, b in zip(one, other)) < 1e-2
END
  done
}
welds() { agree 3 "$scenes/welded.yaml" --set time.end=0.1 --no-frames; }
joints() { agree 5 "$scenes/hinged.yaml" --set time.end=0.1 --no-frames; }
# Two cubes fly apart, and their weld breaks part by part, in the same steps on one rank and on several.
make_torn() {
  "$flesh" mesh box --cells 3,3,2 --size 1,1,1 --out cube.msh >/dev/null && cat >torn.yaml <<'END'
body: {name: left, mesh: cube.msh, density: 1000, material: {energy: S, young: 1e5, poisson: 0.4}}
bodies:
  - {name: right, mesh: cube.msh, translation: [1, 0, 0], density: 1000, material: {energy: S, young: 1e5, poisson: 0.4},
     velocity: [0.5, 0, 1]}
effects:
  - inertia: {}
  - weld: {bodies: [left, right], breaks_at: 30000}
time: {method: midpoint, step: 1/100, end: 0.12}
END
}
welds_that_break() {
  make_torn && agree 3 torn.yaml --no-frames && python3 - shared/history.csv <<'END'
import csv, sys
rows = list(csv.DictReader(open(sys.argv[1])))
broken = [float(row["weld_broken"]) for row in rows]
assert len(set(broken)) >= 3 and broken[-1] > 0.2 and float(rows[-1]["weld_released"]) > 0, broken
END
}
springs() { agree 2 "$scenes/hand_pull.yaml" --set time.end=0.05 --no-frames; }
muscles() { agree 3 "$scenes/muscle_spindle.yaml" --set time.end=0.05 --no-frames; }
fluids() { agree 5 "$scenes/floating.yaml" --set time.end=0.1 --no-frames; }
a_moving_ball() { agree 3 "$scenes/hand_ball.yaml" --set time.end=0.25 --no-frames; }
loads() { agree 3 "$scenes/loaded_bar.yaml" --no-frames; }
settling() { agree 3 "$scenes/settling_drop.yaml" --set time.end=0.1 --no-frames; }
ten_nodes() { agree 3 "$scenes/swing_coarse.yaml" --set body.element=tet10-mean --set time.end=0.05; }

# The first rank writes probes, reactions, frames with fields and a skin of the whole body.
outputs() {
  "$flesh" mesh box --cells 4,2,2 --size 4,1,1 --out bar.msh >/dev/null && "$flesh" mesh surface bar.msh skin.obj >/dev/null || return 1
  cat >bar.yaml <<'END'
body:
  mesh: bar.msh
  density: 1000
  material: {energy: S, young: 2e4, poisson: 0.3}
effects:
  - inertia: {}
  - gravity: {acceleration: [0, 0, -9.81]}
  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]], until: 0.05}
time: {step: 1/60, end: 0.1}
output:
  frame_interval: 2
  fields: [stress, reaction]
  skin: {surface: skin.obj, formats: [obj, vtu, pc2]}
  reactions: true
  probes: [{name: probe_tip, point: [4, 0.5, 0.5], quantities: [position, stress]}]
END
  tolerance=1e-11 # reactions are sums of forces that cancel
  agree 3 bar.yaml || return 1
  tolerance=1e-9
  python3 - shared/result.json <<'END'
import json, sys
result = json.load(open(sys.argv[1]))
ranks = result["ranks"]
assert result["status"] == "complete" and ranks["count"] == len(ranks["parts"]), ranks
assert sum(part["tets"] for part in ranks["parts"]) == 96 and sum(part["own_nodes"] for part in ranks["parts"]) == 45, ranks
assert all(part["messages"] > 0 and part["bytes"] > 0 and part["peak_memory_kB"] > 0 for part in ranks["parts"]), ranks
END
}

# A state is that of the whole body, on any number of ranks: a run goes on from it on any other.
a_state_goes_on_on_others() {
  for ranks in 1 2; do
    expect 0 on_ranks "$ranks" "$flesh" run "$scenes/swing_coarse.yaml" --quiet --no-frames --out "begin_$ranks" \
      --set solver.newton_tolerance=1e-9 --set time.end=0.05 || return 1
  done
  "$flesh" run "$scenes/swing_coarse.yaml" --quiet --no-frames --start-state begin_1/state.txt --out end_1 \
    --set solver.newton_tolerance=1e-9 --set time.end=0.1 || return 1
  expect 0 on_ranks 3 "$flesh" run "$scenes/swing_coarse.yaml" --quiet --no-frames --start-state begin_2/state.txt \
    --out end_3 --set solver.newton_tolerance=1e-9 --set time.end=0.1 || return 1
  python3 "$source_folder/shared/compare_runs.py" end_1 end_3 1e-6
}

# Some ranks have only pinned nodes, and some have no tets.
more_ranks_than_there_is_work() {
  "$flesh" mesh box --cells 2,1,1 --size 2,1,1 --out two.msh >/dev/null || return 1
  cat >two.yaml <<'END'
body: {mesh: two.msh, density: 1000, material: {energy: S, young: 1e5, poisson: 0.4}}
effects:
  - inertia: {}
  - gravity: {}
  - pin: {box: [[-1, -1, -1], [1.001, 2, 2]]}
time: {step: 1/60, end: 0.1}
END
  quick=1
  agree 14 two.yaml --no-frames && has shared/result.json '"count": 12'
}

# refused CODE WORDS ARGUMENT...: three ranks end with CODE and one sentence of one of them, which has WORDS.
refused() {
  code=$1 words=$2
  shift 2
  expect "$code" on_ranks 3 "$flesh" run "$@" --out refused || return 1
  has stderr.txt "$words" && [ "$(grep -c "^flesh run: " stderr.txt)" -eq 1 ] && [ ! -e refused/history.csv ]
}

what_is_not_there_is_refused() {
  refused 2 'direct solvers do not run on several ranks' "$scenes/swing_coarse.yaml" --set solver.linear_solver=klu || return 1
  [ -z "$quick" ] || return 0
  refused 3 'nowhere.yaml' nowhere.yaml &&
    refused 2 'unknown' "$scenes/swing_coarse.yaml" --never
  for command in "sensitivity $scenes/swing_coarse.yaml --of tip.position_z --to body.density" 'fit nowhere.yaml'; do
    # shellcheck disable=SC2086
    expect 2 on_ranks 2 "$flesh" $command || return 1
    [ "$(grep -c '^flesh .*: a launcher of MPI has started 2 ranks, which cannot share this out' stderr.txt)" -eq 1 ] || return 1
  done
}

# If rank 1 alone does not find the scene, all ranks end.
a_bad_scene_on_one_rank_ends_all() {
  mkdir -p here there && cp "$scenes/bar_gravity.yaml" here/scene.yaml || return 1
  sed -i "s|\.\./meshes|$source_folder/../data/meshes|" here/scene.yaml
  echo 'if [ "$OMPI_COMM_WORLD_RANK" = 1 ]; then cd there; else cd here; fi; exec "$@"' >apart.sh
  expect 3 on_ranks 3 sh apart.sh "$flesh" run scene.yaml --out out && has stderr.txt 'scene.yaml: cannot be opened' &&
    [ "$(grep -c '^flesh run: ' stderr.txt)" -eq 1 ] && [ ! -e here/out ]
}

# One rank reports a failed step, by the numbers of the whole body.
a_failed_step_is_that_of_one_rank() {
  set -- "$scenes/swing_coarse.yaml" --no-frames --quiet --set solver.max_newton=1 --set solver.max_cutbacks=0 \
    --set time.step=0.5 --set 'effects.gravity.acceleration=[1, 2, -9]'
  expect 4 "$flesh" run "$@" --out failed_1 && expect 4 on_ranks 3 "$flesh" run "$@" --out failed_3 || return 1
  [ "$(grep -c '^flesh run: ' stderr.txt)" -eq 1 ] || return 1
  expect 5 on_ranks 3 "$flesh" run "$@" --method ida --set time.max_steps=3 --out failed_ida || return 1
  has stderr.txt 'max_steps = 3 internal steps' && [ "$(grep -c '^flesh run: ' stderr.txt)" -eq 1 ] || return 1
  python3 - <<'END'
import json
one, three = [json.load(open(f"failed_{n}/result.json"))["failure"] for n in (1, 3)]
assert one["worst_tet"] == three["worst_tet"] and one["worst_node"] == three["worst_node"], (one, three)
assert abs(one["worst_J"] - three["worst_J"]) < 1e-3, (one, three)
END
}

# begin RANKS [SCENE [ARGUMENT...]]: starts a run without end; the files pid_0, pid_1 ... have its ranks' processes.
begin() {
  rm -rf endless
  number=$1 scene=${2:-$scenes/swing_coarse.yaml}
  shift
  [ $# -eq 0 ] || shift
  begin_on "$number" "$flesh" run "$scene" --out endless --set time.end=1e4 --quiet --no-frames "$@"
  wait_until "$launched" test -s endless/history.csv
}

# A signal to one rank stops all ranks in an orderly way.
a_signal_to_one_rank_ends_all() {
  begin 3 || return 1
  kill -TERM "$(cat pid_1)" || return 1
  wait "$launched"
  [ $? -eq 143 ] || { echo 'not 143'; cat stderr.txt; return 1; }
  has stderr.txt 'interrupted by SIGTERM at t = ' && has endless/result.json '"status": "interrupted"' &&
    [ "$(grep -c '^flesh run: ' stderr.txt)" -eq 1 ] && rows endless/state.txt 81
}

# A signal to an idle rank does so, too.
a_signal_to_an_idle_rank_ends_all() {
  "$flesh" mesh box --cells 1,1,1 --size 1,1,1 --out six.msh >/dev/null || return 1
  sed 's/two.msh/six.msh/; s/end: 0.1/end: 1e4/; s/1.001/0.001/' two.yaml >six.yaml || return 1
  begin 7 six.yaml || return 1
  kill -TERM "$(cat pid_6)" || return 1
  wait "$launched"
  [ $? -eq 143 ] || { echo 'not 143'; cat stderr.txt; return 1; }
  has stderr.txt 'interrupted by SIGTERM at t = ' && has endless/result.json '"count": 6'
}

# If a rank is killed, no other waits for it, and the files that were written are valid.
a_killed_rank_ends_all() {
  begin 3 || return 1
  kill -KILL "$(cat pid_2)" || return 1
  wait "$launched"
  code=$?
  case $code in 0 | 124) echo "ended with $code"; return 1 ;; esac
  wait_for_ends "$(cat pid_0)" "$(cat pid_1)" "$(cat pid_2)" || return 1
  has endless/result.json '"status": "running"' || return 1
  python3 -c 'import csv; rows = list(csv.DictReader(open("endless/history.csv"))); [float(n) for row in rows for n in row.values()]'
}

a_budget_ends_all() {
  expect 6 on_ranks 2 "$flesh" run "$scenes/swing_coarse.yaml" --out short --set time.end=1e4 --max-seconds 0.3 --quiet \
    --no-frames && has short/result.json '"status": "out of budget"'
}

# first_stopped_at NUMBER COMMAND...: runs the command on three ranks, of which the first is killed before this call of those
# that touch a file (0: never); it logs these calls in calls.txt.
first_stopped_at() {
  cat >first.sh <<'END'
if [ "$OMPI_COMM_WORLD_RANK" = 0 ]; then
  FLESH_STOP_AT=$2 FLESH_STOP_LOG=$PWD/calls.txt LD_PRELOAD=$1
  export FLESH_STOP_AT FLESH_STOP_LOG LD_PRELOAD
fi
shift 2
exec "$@"
END
  rm -f calls.txt
  number=$1
  shift
  on_ranks 3 sh first.sh "$shim" "$number" "$@" >stdout.txt 2>stderr.txt
}

# Writes bent.yaml: a bar is bent at one end and meets a plane.
make_bent() {
  "$flesh" mesh box --cells 6,2,2 --size 3,1,1 --out bent.msh >/dev/null && cat >bent.yaml <<'END'
body: {mesh: bent.msh, density: 1000, material: {energy: S, young: 2e4, poisson: 0.45}}
effects:
  - inertia: {}
  - gravity: {}
  - prescribed_motion: {box: [[-1, -1, -1], [1e-9, 2, 2]], motion: [{time: 0}, {time: 0.1, translation: [0, 0.3, 0]}]}
  - contact: {plane: {point: [0, 0, -0.05], normal: [0, 0, 1]}, friction: 0.3, slip_speed: 0.01}
time: {step: 1/60, end: 0.25}
output: {frame_interval: 4}
END
}

# killed_and_resumed SCENE ARGUMENT...: a run of which a rank is killed two thirds of the way resumes on as many ranks with the
# same bits, and on two ranks or one with the same results, within `apart`.
killed_and_resumed() {
  make_bent || return 1
  set -- "$@" --set solver.newton_tolerance=1e-6
  rm -rf undisturbed broken by_*
  first_stopped_at 0 "$flesh" run "$@" --quiet --checkpoint 3steps --out undisturbed || return 1
  [ ! -e undisturbed/checkpoint.bin ] || { echo 'the checkpoint of a complete run is still there'; return 1; }
  first_stopped_at $(($(wc -l <calls.txt) * 2 / 3)) "$flesh" run "$@" --quiet --checkpoint 3steps --out broken
  [ $? -ne 0 ] && [ -e broken/checkpoint.bin ] || { echo 'not killed'; return 1; }
  for ranks in 3 ${quick:-1 2}; do
    cp -r broken "by_$ranks"
    expect 0 on_ranks "$ranks" "$flesh" run --resume "by_$ranks" && has stdout.txt 'goes on after step [1-9]' || return 1
    has "by_$ranks/result.json" "\"same_bits\": $([ "$ranks" = 3 ] && echo true || echo false)" || return 1
    python3 "$source_folder/shared/compare_runs.py" undisturbed "by_$ranks" "${apart:-1e-4}" || return 1
  done
  # The work that is put in is counted on, on any number of ranks.
  python3 - undisturbed by_* <<'END' && diff -rq -x result.json undisturbed by_3
import json, sys
work = [json.load(open(f"{name}/result.json"))["figures"]["work_put_in"] for name in sys.argv[1:]]
assert all(abs(w - work[0]) <= 1e-3 * abs(work[0]) for w in work), work
END
}
# Backward Euler keeps matrices over many steps.
backward_euler_goes_on() { killed_and_resumed "$scenes/swing_coarse.yaml" --set time.end=0.4 --no-frames; }
volume_projection_goes_on() {
  killed_and_resumed "$scenes/swing_coarse.yaml" --set body.element=tet10-mean --set body.material.poisson=0.499 \
    --set time.end=0.2 --no-frames && has by_3/result.json '"preconditioner": "volume-projection"'
}
incompressible_tets_go_on() { incompressible_body && killed_and_resumed bar.yaml --set time.end=0.2 --no-frames; }
bdf2_goes_on() { killed_and_resumed bent.yaml --method bdf2; }
hht_goes_on() { killed_and_resumed bent.yaml --method hht; }
a_weld_that_breaks_goes_on() { make_torn && killed_and_resumed torn.yaml --no-frames; }
adaptive_contact_goes_on() { make_cubes 1.06 '[0.5, 0, -1]' 'adaptive: true' && killed_and_resumed cubes.yaml --no-frames; }
separation_goes_on() { make_cubes 0.97 '[0.1, 0, 1]' 'intersecting: separate' && killed_and_resumed cubes.yaml --no-frames; }
# Errors of positions choose the steps, so velocities of bodies in contact agree less.
runge_kutta_goes_on() {
  apart=2e-3
  killed_and_resumed bent.yaml --method runge-kutta --set time.tolerance=1e-5
  set -- $?
  apart=
  return "$1"
}

# Ranks resume from the checkpoint of a single process; if the scene has changed, all refuse it.
ranks_go_on_with_what_one_has_begun() {
  make_bent && rm -rf alone begun || return 1
  set -- bent.yaml --quiet --method newmark --set solver.newton_tolerance=1e-6
  expect 0 "$flesh" run "$@" --out alone && expect 6 "$flesh" run "$@" --checkpoint 1steps --max-seconds 1e-9 --out begun || return 1
  cp -r begun other
  expect 0 on_ranks 3 "$flesh" run --resume begun --max-seconds 100 && has stdout.txt 'another number of ranks has come there' || return 1
  python3 "$source_folder/shared/compare_runs.py" alone begun 1e-4 || return 1
  sed -i 's/gravity/gravity /' other/scene.yaml
  expect 2 on_ranks 3 "$flesh" run --resume other && [ "$(grep -c '^flesh run: ' stderr.txt)" -eq 1 ] &&
    has stderr.txt 'differs from the checkpoint.s scene'
}

# On a signal to any rank, all write a checkpoint before they end. IDA starts anew from it.
a_signal_leaves_a_checkpoint() {
  begin 3 "$scenes/swing_coarse.yaml" --checkpoint 1000s --method ida --set time.tolerance=1e-3 || return 1
  wait_until "$launched" awk 'END { exit NR < 3 }' endless/history.csv || return 1
  kill -TERM "$(cat pid_2)" || return 1
  wait "$launched"
  [ $? -eq 143 ] || { echo 'not 143'; cat stderr.txt; return 1; }
  has stderr.txt 'flesh run --resume goes on from its last checkpoint' || return 1
  step=$(($(lines endless/history.csv) - 2))
  expect 6 on_ranks 3 "$flesh" run --resume endless --max-seconds 1e-9 || return 1
  has stdout.txt "goes on after step $step, t = .* s; IDA starts anew there" && [ "$step" -gt 0 ]
}

# The costs of effects are counted on from those of the first rank, which are in result.json. Each end of the bar belongs to
# one rank and has a traction.
costs_go_on_from_those_of_the_first_rank() {
  "$flesh" mesh box --cells 16,8,8 --size 4,1,1 --out long.msh >/dev/null && cat >ends.yaml <<'END'
body: {mesh: long.msh, density: 1000, material: {energy: S, young: 2e4, poisson: 0.45}}
effects:
  - inertia: {}
  - traction: {box: [[-1, -1, -1], [1e-9, 2, 2]], traction: [-10, 0, 0]}
  - traction: {box: [[3.999, -1, -1], [5, 2, 2]], traction: [10, 0, 0]}
time: {step: 1/60, end: 1}
END
  begin 2 ends.yaml --profile --checkpoint 1000s || return 1
  many() { [ "$(lines endless/history.csv)" -gt 10 ]; }
  wait_until "$launched" many || return 1
  kill -TERM "$(cat pid_0)" || return 1
  wait "$launched"
  cp endless/result.json before.json || return 1
  expect 6 "$flesh" run --resume endless --profile --max-seconds 1e-9 && python3 - <<'END'
import json
before, after = [json.load(open(name))["effects"] for name in ("before.json", "endless/result.json")]
for b, a in zip(before, after):
    print(b["name"], *((name, b[name], a[name]) for name in ("residuals", "energies", "cpu_s")))
    assert a["cpu_s"] >= b["cpu_s"] > 0 and a["residuals"] >= b["residuals"], (b, a)
END
}

if [ -n "$quick" ]; then
  run_tests several_bodies contact untangling adaptive_contact bodies_that_come_apart welds_that_break incompressible incompressible_beside_others outputs \
    more_ranks_than_there_is_work what_is_not_there_is_refused a_bad_scene_on_one_rank_ends_all \
    a_signal_to_one_rank_ends_all a_signal_to_an_idle_rank_ends_all a_killed_rank_ends_all \
    ${STOP_AT:+backward_euler_goes_on}
else
  run_tests statics damping prescribed_motion several_bodies newmark adaptive ten_nodes contact untangling bodies_that_touch \
    a_body_that_touches_itself adaptive_contact bodies_that_come_apart bodies_in_each_other_are_refused welds joints \
    pressures following_loads incompressible incompressible_beside_others welds_that_break springs muscles fluids a_moving_ball loads settling outputs \
    a_state_goes_on_on_others more_ranks_than_there_is_work \
    what_is_not_there_is_refused a_bad_scene_on_one_rank_ends_all a_failed_step_is_that_of_one_rank \
    a_signal_to_one_rank_ends_all a_signal_to_an_idle_rank_ends_all a_killed_rank_ends_all a_budget_ends_all \
    ${STOP_AT:+backward_euler_goes_on bdf2_goes_on hht_goes_on runge_kutta_goes_on a_weld_that_breaks_goes_on} \
    ${STOP_AT:+adaptive_contact_goes_on separation_goes_on volume_projection_goes_on incompressible_tets_go_on} \
    ranks_go_on_with_what_one_has_begun a_signal_leaves_a_checkpoint costs_go_on_from_those_of_the_first_rank
fi
