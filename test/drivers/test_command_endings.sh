# TEST full memory program seconds=5 needs=flesh
# test_command_endings.sh: what `flesh run` says of the end of a run: spurious energy, a budget within a step, rest in
# a stressed state, motion without force, no equilibrium. FLESH names the program.
set -u
. "$(dirname -- "$0")/../shared/command.sh"

"$flesh" mesh box --cells 4,4,4 --size 0.1,0.1,0.1 --out block.msh >/dev/null || exit 1
scene() { # NAME EFFECTS TIME
  printf 'body:\n  mesh: block.msh\n  density: 1000\n  material: {energy: S, young: 1e5, poisson: 0.45}\n' >"$1.yaml"
  printf 'effects:\n%s\ntime: {%s}\n' "$2" "$3" >>"$1.yaml"
}

# A block that starts within its barrier's reach is blown up by HHT's first step: 3.3 J become 4500. Fixed steps that gain
# energy from nowhere are cut, unless time.max_energy_gain allows it; IDA's are not cut, and the run ends.
energy_from_nowhere_ends_a_run() {
  scene near '  - inertia: {}
  - gravity: {}
  - contact: {plane: {point: [0, 0, -0.0005]}}' 'method: hht, step: 1/100, end: 0.3'
  expect 0 "$flesh" run near.yaml --out near --no-frames || return 1
  has near/result.json '"energy_gain": 0.0' && has near/result.json '"rejected_steps": [1-9]' &&
    has stdout.txt '[0-9]* of [0-9]* internal steps led out of a tangle, gained energy or swung; backward Euler' || return 1
  expect 8 "$flesh" run near.yaml --out near --no-frames --method ida --set time.tolerance=5e-3 \
    --set time.max_order=3 || return 1
  has stderr.txt 'the energy grew by .* J although nothing put it in' && has stderr.txt 'node [0-9]* at (' &&
    has stderr.txt 'in tet [0-9]* at (' && has stderr.txt 'advice: the body starts so near an obstacle' &&
    has near/result.json '"exit_code": 8' && has near/result.json '"reason": "FLESH_ERR_ENERGY"' &&
    has near/result.json '"warning": "from t = 0' && rows near/state.txt 125 || return 1
  expect 0 "$flesh" run near.yaml --out near --no-frames --set time.max_energy_gain=1e300 || return 1
  has stderr.txt 'warning: from t = 0 s' && has near/result.json '"energy_gain_J": 4[0-9][0-9][0-9]' || return 1
  # A block that falls gets energy from IDA when it bounces.
  scene drop '  - inertia: {}
  - gravity: {}
  - contact: {plane: {point: [0, 0, -0.1]}}' 'method: ida, max_order: 4, tolerance: 0.1, step: 1/1000, end: 1'
  expect 8 "$flesh" run drop.yaml --out drop --no-frames || return 1
  has stderr.txt 'advice: try a smaller time.tolerance or time.max_order=2' || return 1
  expect 0 "$flesh" run drop.yaml --out drop --no-frames --method backward-euler || return 1
  has drop/result.json '"energy_gain": 0.0' &&
    has drop/result.json '"warning": "time.max_order has no effect: [^;]*; time.tolerance has no effect: [^;]*",'
}

# A budget that is spent within a step is reported as such, not as the plate's overlap with the body, into which it moves.
# The step takes hundreds of times as long as the budget.
a_budget_within_a_step_is_told_as_such() {
  "$flesh" mesh box --cells 14,14,14 --size 1,1,1 --out large.msh >/dev/null || return 1
  scene press '  - inertia: {}
  - pin: {box: [[-1, -1, -1], [2, 2, 1e-9]]}
  - contact:
      plane: {point: [0, 0, 1.001], normal: [0, 0, -1]}
      motion: [{time: 0}, {time: 1, translation: [0, 0, -0.5]}]' 'step: 1, end: 1'
  set -- run press.yaml --set body.mesh=large.msh --set body.material.poisson=0.4999 --out press --no-frames \
    --set solver.preconditioner=none --set solver.linear_tolerance=1e-12 --set solver.max_linear=1000000
  # The budget is doubled until it outlasts the set-up, however slow the machine, and is spent within the step.
  for budget in 0.5 1 2 4 8 16 32; do
    expect 6 "$flesh" "$@" --max-seconds "$budget" || return 1
    if has press/result.json '"unfinished_linear": [1-9]' >/dev/null 2>&1; then break; fi
  done
  has stderr.txt "the budget of $budget s is spent" && has press/result.json '"status": "out of budget"' &&
    has press/result.json '"failure": null' &&
    has stdout.txt ' linear iterations in the step that was not finished' &&
    has press/result.json '"unfinished_linear": [1-9]'
}

# Writes strip.yaml: a strip, 1 cm thick, with a pressure on its upper side.
make_strip() {
  "$flesh" mesh box --cells 20,4,1 --size 0.4,0.06,0.01 --out strip.msh >/dev/null || return 1
  scene strip '  - pressure: {box: [[-1, -1, 0.00999], [1, 1, 1]], pressure: 1}
  - pin: {box: [[-1, -1, -1], [1e-9, 9, 9]]}' 'method: static'
  sed -i 's/block.msh/strip.msh\n  element: tet10-mean/' strip.yaml
  printf 'output: {probes: [{name: tip, point: [0.4, 0.03, 0.005], quantities: [position]}]}\n' >>strip.yaml
}

# A body at rest in a stressed state is reported: a ring of square section, twisted by a full turn, can neither untwist nor,
# far below Michell's limit, buckle. By Saint-Venant's torsion of a bar its strain energy is at least
# G 0.1406 a^4 (1 rad/m)^2/2 2 pi m = 24.4 J; this coarse mesh is stiffer.
a_stressed_rest_is_told() {
  awk -v mesh=ring.mesh -v start=ring.txt "$ring" || return 1
  scene ring '  - inertia: {}' 'step: 1/30, end: 12'
  expect 0 "$flesh" run ring.yaml --set body.mesh=ring.mesh --set start.state=ring.txt --set effects.settling_damping.rate=2 \
    --no-frames --out ring || return 1
  has stderr.txt 'the body is at rest in a stressed state: 1[0-9.]* J of strain energy, and no load holds it' &&
    has ring/result.json '"stressed_rest_J": 1[0-9][0-9]\.' &&
    has ring/result.json '"warning": "the body is at rest in a stressed state' || return 1
  expect 0 "$flesh" run ring.yaml --set body.mesh=ring.mesh --set start.state=ring.txt --set effects.inertia=null \
    --no-frames --out ring || return 1
  has ring/result.json '"stressed_rest_J": 1[0-9][0-9]\.' || return 1
  # Nothing is reported while the ring moves, if a load acts on it, or if it starts unstressed.
  for other in 'effects.settling_damping.rate=2 --set time.end=0.2' 'effects.gravity={}' 'start.state=null'; do
    # shellcheck disable=SC2086
    expect 0 "$flesh" run ring.yaml --set body.mesh=ring.mesh --set start.state=ring.txt --set $other --no-frames \
      --out ring || return 1
    has ring/result.json '"stressed_rest_J": 0.0' && has ring/result.json '"warning": null' || return 1
  done
  # A cloth that hangs from its edge is not reported, though its weight is small beside forces on tets as thick as long.
  "$flesh" mesh box --cells 8,8,1 --size 4,4,1e-4 --out cloth.msh >/dev/null || return 1
  scene cloth '  - gravity: {}
  - pin: {box: [[-1, -1, -1], [1e-9, 9, 9]]}' 'method: static'
  expect 0 "$flesh" run cloth.yaml --set body.mesh=cloth.msh --no-frames --out cloth &&
    has cloth/result.json '"stressed_rest_J": 0.0' && has cloth/result.json '"warning": null' || return 1
  # A strip that a small pressure bends far is not reported.
  make_strip && expect 0 "$flesh" run strip.yaml --set body.material.poisson=0.3 --no-frames --out strip &&
    has strip/result.json '"stressed_rest_J": 0.0'
}

# An incompressible strip, whose end a follower pressure turns by 60 degrees, finds its equilibrium in 92 iterations; with
# cut Newton steps they would be more than 400. The end of an elastica is at x = 0.2275 m and moves by -0.2991 m along z.
thin_bodies_find_equilibria_of_follower_loads() {
  make_strip && expect 0 "$flesh" run strip.yaml --set body.material.poisson=0.5 --max-seconds 300 --no-frames --out strip ||
    return 1
  awk -F, 'NR == 1 { for (k = 1; k <= NF; k++) at[$k] = k } END {
    print "# the end is at " $at["tip.position_x [m]"] ", " $at["tip.position_z [m]"] " m"
    exit !($at["tip.position_x [m]"] > 0.219 && $at["tip.position_x [m]"] < 0.236 &&
           $at["tip.position_z [m]"] > -0.3 && $at["tip.position_z [m]"] < -0.288) }' strip/probes.csv &&
    awk -F, 'NR == 1 { for (k = 1; k <= NF; k++) at[$k] = k } END { exit !($at["newton"] <= 200) }' strip/history.csv
}

# A step that takes more than 100 times the median is reported: the top of an almost still block is turned by some 10 rad
# within a step. As the work of such a step depends on the last bits, several are tried until one takes so long.
a_long_step_is_told() {
  "$flesh" mesh box --cells 3,3,3 --size 0.1,0.1,0.1 --out small.msh >/dev/null || return 1
  told=
  for jerk in 10:-0.3 12:-0.3 15:-0.3 8:-0.5 12:-0.5 8:-0.3 10:-0.5 15:-0.5; do
    scene jerk "  - inertia: {}
  - gravity: {acceleration: [0, 0, -0.001]}
  - pin: {box: [[-1, -1, -1], [2, 2, 1e-9]]}
  - prescribed_motion: {box: [[-1, -1, 0.0999], [2, 2, 2]], from: 0.5, until: 0.52, centre: [0.05, 0.05, 0.1],
      motion: [{time: 0.5}, {time: 0.51, rotation: [0, ${jerk%:*}, 0], translation: [0, 0, ${jerk#*:}]}]}" \
      'step: 1/60, end: 0.56'
    rm -rf jerk
    "$flesh" run jerk.yaml --set body.mesh=small.msh --set body.material.poisson=0.4999 --set solver.linear_solver=klu \
      --set solver.newton_tolerance=1e-3 --no-frames --out jerk >stdout.txt 2>stderr.txt
    has jerk/result.json '"longest_step": 3[0-9]' && has jerk/result.json '"longest_step_cuts": [0-9]' || return 1
    if sed -n 's/.*"longest_step_over_median": \([0-9.]*\).*/\1/p' jerk/result.json | awk '{ exit !($1 > 100) }'; then
      told=yes
      has stderr.txt 'step 3[0-9] (to t = 0.5[0-9]* s) took [0-9]* Newton and 0 linear .* [1-9][0-9.]* times the median' &&
        has jerk/result.json '"warning": ".*step 3[0-9] (to t' || return 1
      break
    fi
    ! grep -q 'times the median' stderr.txt jerk/result.json || return 1
  done
  [ "$told" ] || return 1
  # At the default tolerance the other steps take more, and nothing is reported.
  expect 0 "$flesh" run jerk.yaml --set body.mesh=small.msh --no-frames --out jerk &&
    ! grep -q 'times the median' stderr.txt && has jerk/result.json '"longest_step": 3[0-9]' &&
    has jerk/result.json '"longest_step_linear": [0-9][0-9]'
}
ring='function id(i, j, k) { return (i % n) * 9 + 3 * j + k + 1 }
function node(i, j, k, twist) {
  t = 6.283185307179586 * i / n; u = 0.1 * (j - 1); w = 0.1 * (k - 1); q = twist * t
  r = 1 + cos(q) * u - sin(q) * w
  return sprintf("%.17g %.17g %.17g", r * cos(t), r * sin(t), sin(q) * u + cos(q) * w)
}
BEGIN {
  n = 40; split("100 110 111|100 101 111|010 110 111|010 011 111|001 101 111|001 011 111", path, "|")
  print "MeshVersionFormatted 2\nDimension 3\nVertices\n" 9 * n > mesh
  for (i = 0; i < n; i++) for (j = 0; j < 3; j++) for (k = 0; k < 3; k++) {
    print node(i, j, k, 0), 0 > mesh
    print node(i, j, k, 1), "0 0 0" > start
  }
  print "Tetrahedra\n" 24 * n > mesh
  for (i = 0; i < n; i++) for (j = 0; j < 2; j++) for (k = 0; k < 2; k++) for (p = 1; p <= 6; p++) {
    split(path[p], corner, " "); line = id(i, j, k)
    for (c = 1; c <= 3; c++)
      line = line " " id(i + substr(corner[c], 1, 1), j + substr(corner[c], 2, 1), k + substr(corner[c], 3, 1))
    print line, 0 > mesh
  }
  print "End" > mesh
}'

# A free body in uniform motion takes no Newton iterations, and nothing of rounding is reported.
motion_without_force_is_nothing_to_tell() {
  for method in backward-euler bdf2 midpoint newmark hht generalized-alpha; do
    scene free '  - inertia: {}' "method: $method, step: 1/60, end: 0.5}
start: {velocity: [1, 0.5, 0.25]"
    expect 0 "$flesh" run free.yaml --out free --no-frames || return 1
    has free/result.json '"solves_at_rounding": 0' && has free/result.json '"newton": 0' || return 1
    ! grep rounding stdout.txt || return 1
  done
}

# A run of more steps than can be counted is refused before it begins, without printing figures.
more_steps_than_can_be_counted_are_refused() {
  scene long '  - inertia: {}' 'step: 1/60, end: 1e10'
  expect 2 "$flesh" run long.yaml --out long --no-frames || return 1
  has stderr.txt 'long.yaml:7:25: time.end: 1e+10 s .* 6e+11 steps; at most 2147483646 can be taken' && [ ! -e long ] &&
    ! grep steps\ to\ t stdout.txt || return 1
  scene single '  - pin: {box: [[-1, -1, -1], [1, 1, 1e-9]]}' 'step: 1e-12, end: 1' && expect 0 "$flesh" run single.yaml --out single --no-frames
}

# `flesh check` refuses what `flesh run` refuses before its first step, in the same words.
checks_say_what_runs_refuse() {
  scene early '  - inertia: {}
  - contact: {plane: {point: [0, 0, -1]}}' 'step: 1/60, end: 1/60'
  "$flesh" run early.yaml --out early --no-frames --quiet || return 1
  for set in time.end=1e300 time.step=1e-300 'effects.contact.plane.point[2]=0.05' \
    'time.end=1/99 start.state=early/state.txt'; do
    for command in check run; do
      expect 2 "$flesh" "$command" early.yaml --set "${set%% *}" --set "${set##* }" || return 1
      sed "s/flesh $command/flesh/; /^[^f]/d" stderr.txt >"$command.txt"
    done
    cmp check.txt run.txt && [ -s run.txt ] || return 1
  done
}

# Statics without an equilibrium say which part moves away because nothing holds it.
statics_say_what_holds_no_body() {
  scene loose '  - gravity: {}' 'method: static'
  expect 4 "$flesh" run loose.yaml --out loose --no-frames && has stderr.txt 'advice: a body that no pin holds' || return 1
  scene bent '  - pin: {box: [[-1, -1, -1], [1e-9, 1, 1]]}
  - gravity: {acceleration: [0, 0, -1e9]}' 'method: static'
  expect 4 "$flesh" run bent.yaml --out bent --no-frames --set solver.max_newton=3 --set solver.max_cutbacks=0 &&
    has stderr.txt 'advice: ' && ! grep 'no pin holds' stderr.txt || return 1
  # In statics, a stack of cubes that friction would hold slides away on a floor that slopes a little.
  expect 4 "$flesh" run "$source_folder/../data/scenes/stack.yaml" --method static --out stack --no-frames \
    --set effects.1.gravity.acceleration='[0.05, 0, -9.81]' || return 1
  has stderr.txt 'no equilibrium at t = 10 s: with [0-9.]* of the load the part around (.*) m, which' &&
    has stderr.txt 'no pin holds, went [1-9][0-9.e+]* m' && has stderr.txt 'in statics friction holds nothing' &&
    has stderr.txt 'advice: a body that no pin holds' &&
    has stack/result.json '"unfinished_newton": [1-9][0-9]\{0,1\},' &&
    has stderr.txt 'effects\[[0-9]\].contact.friction has no effect: in statics there is friction on obstacles that move only'
}

# K is singular at the start of a free body's statics. The body turns about the edge that holds it until it hangs, falls onto
# a plane, or would fall for ever, which takes few iterations to find.
statics_goes_where_a_body_is_free_to() {
  scene hung '  - gravity: {}
  - pin: {box: [[-1, -1, 0.099], [1e-9, 1, 1]]}' 'method: static'
  for element in tet4 tet10-mean; do
    expect 0 "$flesh" run hung.yaml --out hung --no-frames --set body.element=$element || return 1
    has hung/result.json '"newton": [1-9][0-9]*,' && has hung/result.json '"direct": 0,' || return 1
  done
  scene falls '  - gravity: {}
  - contact: {plane: {point: [0, 0, -0.03]}}' 'method: static'
  expect 0 "$flesh" run falls.yaml --out falls --no-frames && has falls/result.json '"newton": [1-4]\{0,1\}[0-9],' || return 1
  scene free '  - gravity: {}' 'method: static'
  expect 4 "$flesh" run free.yaml --out free --no-frames || return 1
  has stderr.txt 'no equilibrium at t = 0 s: 0.0312 of the load would move the body on and on, as nothing holds it or stops it' &&
    has stderr.txt 'advice: a body that no pin holds' && has free/result.json '"unfinished_newton": [1-9][0-9]\{0,1\},'
}

# Loads that follow a rod's end swing it ever wider. The full derivative leads to the equilibrium, but is not used near an
# obstacle, where the run fails and says why.
loads_that_follow_for_ever_are_told() {
  "$flesh" mesh box --cells 12,2,2 --size 6,1,1 --out rod.msh >/dev/null || return 1
  scene rod '  - pressure: {box: [[5.9, -1, 0.5], [7, 2, 2]], pressure: 5500}
  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}' 'method: static'
  expect 0 "$flesh" run rod.yaml --set body.mesh=rod.msh --out rod --no-frames || return 1
  printf '  - contact: {sphere: {centre: [0.5, 0.5, -0.205], radius: 0.2}}\n' >near.txt
  sed '/^effects:/r near.txt' rod.yaml >near.yaml && set -- run near.yaml --set body.mesh=rod.msh --no-frames --out
  expect 0 "$flesh" "$@" far --set 'effects.contact.sphere.centre[2]=-50' || return 1
  [ "$(sed 1d far/state.txt)" = "$(sed 1d rod/state.txt)" ] || return 1
  expect 0 "$flesh" "$@" moved --set 'effects.contact.sphere.centre[2]=-50' --set effects.contact.friction=1 \
    --set 'effects.contact.motion=[{time: 0}, {time: 1}]' --set time.end=1 --set time.step=1 && has moved/result.json '"warning": null' || return 1
  expect 4 "$flesh" "$@" near || return 1
  has stderr.txt 'no equilibrium at t = [0-9.]* s: none is found with 0\.[0-9]* of the loads that follow the surface; ' ||
    return 1
  expect 4 "$flesh" "$@" near --set effects.pressure.pressure=20000 --set solver.max_cutbacks=1 || return 1
  has stderr.txt 'no equilibrium at t = 0 s: 0.5 of the loads that follow the surface would stretch the body without bound' &&
    has stderr.txt 'last try: t = 0 s, load factor 1 after 0 halvings' && has near/result.json '"load_factor": 1\.0' || return 1
  # A plate held at its edges bears less than two thirds of a pressure, which is found in less than 60 000 linear iterations.
  "$flesh" mesh box --cells 10,10,2 --size 1,1,0.1 --out plate.msh >/dev/null || return 1
  scene plate '  - pressure: {box: [[-1, -1, -1], [2, 2, 1e-9]], pressure: 30000}
  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}
  - pin: {box: [[0.999, -1, -1], [2, 2, 2]]}
  - pin: {box: [[-1, -1, -1], [2, 1e-9, 2]]}
  - pin: {box: [[-1, 0.999, -1], [2, 2, 2]]}' 'method: static'
  expect 4 "$flesh" run plate.yaml --set body.mesh=plate.msh --out plate --no-frames || return 1
  has stderr.txt 'none is found with 0.6[0-9]* of the loads that follow' && has plate/result.json '"linear": [0-5][0-9]\{4\},' ||
    return 1
  scene part '  - gravity: {}
  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}' 'method: static, step: 1, end: 1'
  expect 4 "$flesh" run part.yaml --out part --no-frames --set body.mesh=rod.msh --set solver.max_newton=3 \
    --set solver.max_cutbacks=1 || return 1
  has stderr.txt 'at t = 1 s with load factor 0\.5: ' && has part/result.json '"load_factor": 0\.5'
}

# A body that is moved into a plane or another body, which no shorter step can avoid, ends the run with advice.
nodes_led_into_others_are_told() {
  cat >led.yaml <<END
body: {mesh: $source_folder/../data/meshes/one_tet.mesh, material: {energy: S, young: 1e5, poisson: 0.4}}
effects:
  - inertia: {}
  - prescribed_motion: {box: [[-1, -1, -1], [2, 2, 2]], motion: [{time: 0}, {time: 1, translation: [0, 0, -1]}]}
  - contact: {plane: {point: [0, 0, -0.5]}}
time: {step: 1/10, end: 1}
END
  for method in newmark adaptive static; do
    for energy in S Neo; do
      expect 4 "$flesh" run led.yaml --out led --no-frames --set time.method=$method --set body.material.energy=$energy \
        $([ $method != static ] || echo --set 'effects[0]=null') && has stderr.txt 'advice: nodes start or are held in an obstacle' ||
        { echo "$method, $energy:"; cat stderr.txt; return 1; }
    done
  done
  scene lower '  - inertia: {}
  - pin: {body: body, box: [[-1, -1, -1], [1, 1, 1]]}
  - prescribed_motion: {body: upper, box: [[-1, -1, -1], [1, 1, 1]], motion: [{time: 0}, {time: 1, translation: [0, 0, -0.1]}]}
  - contact: {between: all, thickness: 0.005}' 'step: 1/10, end: 1'
  echo 'bodies: [{name: upper, mesh: block.msh, translation: [0.005, 0.007, 0.12]}]' >>lower.yaml
  expect 4 "$flesh" run lower.yaml --out lower --no-frames && has stderr.txt 'surfaces in contact intersect' &&
    has stderr.txt 'advice: nodes start or are held in an obstacle'
}

# Backward Euler evaluates loads only at the ends of its steps, and so misses one between two of them, which is reported;
# other methods end a step where the load ends.
a_load_within_a_step_is_told() {
  scene pulse '  - inertia: {}
  - force: {body: body, force: [1, 0, 0], from: 0.02, until: 0.03}' 'step: 1/60, end: 0.1'
  expect 0 "$flesh" run pulse.yaml --out pulse --no-frames && has stderr.txt 'in 1 step, first at t = 0.02 s, loads or motions' &&
    has pulse/result.json '"warning": "in 1 step, first at t = 0.02 s' && has pulse/result.json '"work_put_in": 0.0' || return 1
  for other in time.method=bdf2 time.step=1/100 effects.force.until=0.034 effects.force.from=1/60 time.end=0.02; do
    expect 0 "$flesh" run pulse.yaml --out pulse --no-frames --set "$other" && has pulse/result.json '"warning": null' || return 1
  done
}

# A scene without inertia is solved for equilibrium; that its time.method would step in time is a warning.
a_method_without_inertia_is_told() {
  scene bent '  - pin: {box: [[-1, -1, -1], [1e-9, 1, 1]]}
  - gravity: {}' 'method: bdf2, end: 0'
  expect 0 "$flesh" run bent.yaml --out bent --no-frames && has bent/result.json '"warning": "time.method is bdf2' &&
    has stderr.txt 'time.method is bdf2, but the scene has no inertia and is solved for equilibrium; add' || return 1
  expect 0 "$flesh" check bent.yaml && has stdout.txt 'warning: time.method is bdf2, but' || return 1
  for quiet in time.method=static time.method=null; do
    expect 0 "$flesh" run bent.yaml --out bent --no-frames --set $quiet && has bent/result.json '"warning": null' || return 1
  done
  # A resumed run has the warning, too, though its scene.yaml has the method that is used.
  scene moved '  - prescribed_motion: {box: [[-1, -1, -1], [1e-9, 1, 1]], motion: [{time: 0}, {time: 1, translation: [1, 0, 0]}]}' \
    'method: bdf2, end: 1, step: 1/20'
  expect 6 "$flesh" run moved.yaml --out moved --no-frames --checkpoint 5steps --max-seconds 1e-3 || return 1
  expect 0 "$flesh" run --resume moved --max-seconds 99 && has moved/result.json '"warning": "time.method is bdf2'
}

run_tests energy_from_nowhere_ends_a_run a_budget_within_a_step_is_told_as_such a_stressed_rest_is_told \
  ${long:+thin_bodies_find_equilibria_of_follower_loads} a_long_step_is_told motion_without_force_is_nothing_to_tell \
  more_steps_than_can_be_counted_are_refused statics_say_what_holds_no_body nodes_led_into_others_are_told \
  statics_goes_where_a_body_is_free_to checks_say_what_runs_refuse loads_that_follow_for_ever_are_told \
  a_load_within_a_step_is_told a_method_without_inertia_is_told
