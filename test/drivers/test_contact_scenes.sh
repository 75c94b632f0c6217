# TEST full memory program seconds=20 needs=flesh
# TEST name=test_fast_sheets_run full program seconds=20 needs=flesh builds=plain args: fast
# test_contact_scenes.sh: the scenes with obstacles in a short form, and messages and refusals of contact. `fast` runs only the
# test of fast sheets. FLESH names the program.
set -u
. "$(dirname -- "$0")/../shared/command.sh"
scenes=$source_folder/../data/scenes

# touches FOLDER: three nodes or more touch at some step, the gap stays open, and there is a force only when nodes touch.
touches() {
  awk -F, '
    NR == 1 { for (c = 1; c <= NF; c++) column[$c] = c; next }
    { gap = $column["contact_gap"]; nodes = $column["contact_nodes"]; force = $column["contact_force"] }
    gap <= 0 || (nodes > 0) != (force > 0) { bad = 1; print "line", NR, gap, nodes, force }
    nodes > most { most = nodes }
    END { print NR, "lines, up to", most, "nodes touch"; exit bad || most < 3 }' "$1/history.csv"
}

jelly_on_stairs() {
  expect 0 "$flesh" run "$scenes/jelly_drop.yaml" --set time.end=0.2 --out out/jelly --quiet || return 1
  touches out/jelly && [ "$(ls out/jelly/frames/*.obj)" = out/jelly/frames/obstacle_1.obj ]
}

hand_on_a_ball() {
  expect 0 "$flesh" run "$scenes/hand_ball.yaml" --set time.end=0.2 --set time.step=1/40 --out out/hand --quiet &&
    touches out/hand && [ "$(ls out/hand/frames/obstacle_1_*.obj | wc -l)" -eq 9 ]
}

# The energy that a loose tolerance leaves uncertain does not allow each step a gain: the whole gain is at most 0.02.
loose_tolerances_gain_no_energy() {
  expect 0 "$flesh" run "$scenes/balls.yaml" --method newmark --set time.adaptive=true --set time.tolerance=0.1 \
    --set time.end=0.05 --out out/loose --no-frames --quiet || return 1
  python3 -c "import json; f = json.load(open('out/loose/result.json'))['figures']; exit(f['energy_gain'] > 0.02)"
}

# A sheet hits another with its edge at 200 m/s, and would fly 40 times its length in a step. A step ends within 2000 Newton
# iterations, or within 4000 if steps were cut, which result.json says.
fast_sheets_end_their_steps() {
  "$flesh" mesh box --cells 6,6,1 --size 0.1,0.1,0.005 --out sheet.mesh >mesh.log || return 1
  cat >sheets.yaml <<'END'
body: {name: rests, mesh: sheet.mesh, density: 1000, material: {energy: S, young: 1e5, poisson: 0.45}}
bodies:
  - {name: flies, mesh: sheet.mesh, translation: [0.013, 0.05, 0.11], rotation: [80, 0, 0], velocity: [0, 0, -200],
     density: 1000, material: {energy: S, young: 1e5, poisson: 0.45}}
effects: [{inertia: {}}, {contact: {between: all}}]
time: {method: backward-euler, step: 1/50, end: 2/50}
END
  expect 0 "$flesh" run sheets.yaml --out out/sheets --no-frames --quiet || return 1
  has out/sheets/result.json '"convergence_failures": [1-9]' && most=4000 || most=2000
  awk -F, -v allowed=$most '
    NR == 1 { for (c = 1; c <= NF; c++) column[$c] = c; next }
    { newton = $column["newton"]; moves += newton > allowed || !($column["contact_gap"] > 0) }
    newton > most { most = newton }
    END { print NR - 1, "lines, up to", most, "Newton iterations"; exit moves || NR != 4 || most < 10 }' out/sheets/history.csv
}

# inputs RESULT NAME...: the result has exactly the files of these names, once each, with their hashes.
inputs() {
  python3 - "$@" <<'END'
import hashlib, json, os, sys
files = json.load(open(sys.argv[1]))['inputs']['files']
assert sorted(os.path.basename(f['path']) for f in files) == sorted(sys.argv[2:]), files
for f in files:
    assert os.path.isabs(f['path']) and f['sha256'] == hashlib.sha256(open(f['path'], 'rb').read()).hexdigest(), f
END
}

every_file_that_goes_in_has_its_hash() {
  inputs out/jelly/result.json jelly_drop.yaml jelly_cube.mesh stairs.obj || return 1
  "$flesh" mesh convert "$scenes/../meshes/jelly_cube.mesh" jelly.node || return 1
  "$flesh" mesh surface "$scenes/../meshes/jelly_cube.mesh" skin.ply || return 1
  expect 0 "$flesh" run "$scenes/jelly_drop.yaml" --set body.mesh=jelly.ele --set start.state=out/jelly/state.txt \
    --set output.skin.surface=skin.ply --set time.end=0.25 --out out/files --quiet &&
    inputs out/files/result.json jelly_drop.yaml jelly.node jelly.ele stairs.obj state.txt skin.ply || return 1
  # The mesh of two bodies stands there once.
  expect 0 "$flesh" run "$scenes/two_bodies.yaml" --set time.end=1/60 --out out/two --quiet &&
    inputs out/two/result.json two_bodies.yaml bar_8x2x2.mesh
}

# A run of several bodies says whether they touch each other; a run of one body does not.
bodies_are_told_to_pass_through_each_other() {
  expect 0 "$flesh" run "$scenes/two_bodies.yaml" --set effects.contact=null --set time.end=1/60 --out out/apart &&
    has stdout.txt 'bodies: 2, which do not touch each other: they pass through each other' || return 1
  expect 0 "$flesh" run "$scenes/two_bodies.yaml" --set time.end=1/60 --out out/touch &&
    has stdout.txt 'bodies: 2, which touch each other' || return 1
  expect 0 "$flesh" run "$scenes/two_bodies.yaml" --set 'effects.contact.between=self' --set time.end=1/60 --out out/self &&
    has stdout.txt 'bodies: 2, which do not touch each other: they pass through each other' || return 1
  expect 0 "$flesh" run "$scenes/bar_gravity.yaml" --set time.end=1/60 --out out/one && ! grep -q 'bodies:' stdout.txt &&
    "$flesh" schema bodies >schema.txt && has schema.txt 'bodies pass through each other'
}

bodies_that_begin_crossed_are_refused() {
  expect 2 "$flesh" run "$scenes/two_bodies.yaml" --set 'bodies[0].translation=[3, -1.5, 0.5]' --out out/crossed &&
    has stderr.txt 'intersect: the edge of the nodes' && has stderr.txt 'of flyer' && has stderr.txt 'of bar'
}

# With `intersecting: separate` the run goes on, and says when the bodies are apart, or that they are not.
bodies_that_begin_crossed_are_let_apart() {
  crossed='--set bodies[0].translation=[3,-0.9,0.5] --set effects.contact.intersecting=separate --out out/separate'
  expect 0 "$flesh" run "$scenes/two_bodies.yaml" $crossed --set time.end=1/60 &&
    has stdout.txt 'contact: bar goes through flyer at (' && has stdout.txt 'do not touch each other until they are apart' &&
    has stderr.txt 'surfaces that intersect at the start (1 place) are not apart at the end (1 place)' &&
    has out/separate/result.json '"intersecting_at_end": 1' && has out/separate/result.json 'are not apart' || return 1
  expect 0 "$flesh" run "$scenes/two_bodies.yaml" $crossed --set 'bodies[0].velocity=[0,-12,0]' --set time.end=0.3 &&
    has stdout.txt 'the initial overlaps (1 place) were resolved at t = ' &&
    has out/separate/result.json '"intersecting_at_end": 0' && ! grep -q 'are not apart' out/separate/result.json || return 1
  expect 4 "$flesh" run "$scenes/two_bodies.yaml" $crossed --set time.method=static &&
    has stderr.txt 'advice: bodies that intersect at the start do not touch, and nothing else holds one of them'
}

# A gap that is smaller than the thickness at rest is reported, here between the ends of an almost closed ring.
gaps_that_never_close_are_told() {
  python3 - "$scenes/../meshes/bar_16x4x4.mesh" ring.mesh <<'END'
import math, sys
lines, out, left = open(sys.argv[1]).read().split('\n'), [], 0
for k, line in enumerate(lines):
    if left:
        x, y, z, *rest = line.split()
        angle = (2 * math.pi - 0.004) * float(x) / 4
        r = 1.6 - 0.2 * float(z)
        line = ' '.join([repr(r * math.cos(angle)), repr(0.2 * float(y)), repr(r * math.sin(angle)), *rest])
        left -= 1
    elif k and lines[k - 1].strip() == 'Vertices':
        left = int(line)
    out.append(line)
open(sys.argv[2], 'w').write('\n'.join(out))
END
  cat >ring.yaml <<'END'
body: {mesh: ring.mesh, density: 1000, material: {energy: S, young: 1e5, poisson: 0.3}}
effects: [inertia, contact: {between: self, thickness: 0.01}]
time: {method: backward-euler, step: 1/60, end: 1/60}
END
  expect 0 "$flesh" run ring.yaml --out out/ring &&
    has stdout.txt 'contact: 50 nodes are faced across a gap that is smaller than the thickness at rest: they do not touch' &&
    expect 0 "$flesh" run ring.yaml --set effects.contact.thickness=1e-3 --out out/ring && ! grep -q 'faced' stdout.txt
}

# A thickness of more than twice the gap at the start, whose barrier throws bodies apart, is reported.
surfaces_that_start_close_are_told() {
  expect 0 "$flesh" run "$scenes/two_bodies.yaml" --set effects.contact.thickness=1.25 --set time.end=1/60 --out out/close &&
    has stdout.txt 'contact: surfaces start 0.6 m from each other, within half of the thickness of 1.25 m: its barrier' &&
    expect 0 "$flesh" run "$scenes/two_bodies.yaml" --set effects.contact.thickness=1 --set time.end=1/60 --out out/close &&
    ! grep -q 'surfaces start' stdout.txt
}

# The written scene runs again, to the same bits.
a_scene_with_contact_repeats() {
  expect 0 "$flesh" run out/jelly/scene.yaml --out out/again --quiet || return 1
  cmp out/jelly/state.txt out/again/state.txt
}

# refuse WORDS CONTACT [CODE]: a scene with this contact is refused with CODE (2) and these words.
refuse() {
  cat >bad.yaml <<END
body: {mesh: $scenes/../meshes/cube_of_six_tets.mesh, material: {energy: S, young: 1e5, poisson: 0.4}}
effects:
  - inertia: {}
  - contact: $2
time: {end: 1}
END
  expect "${3:-2}" "$flesh" run bad.yaml --quiet && has stderr.txt "$1"
}

bad_contacts_are_refused() {
  refuse 'bad.yaml:4.*0 obstacles are given' '{friction: 0.3}' &&
    refuse '2 obstacles are given' '{plane: {point: [0, 0, -1]}, sphere: {centre: [0, 0, -3], radius: 1}}' &&
    refuse 'radius' '{sphere: {centre: [0, 0, -3], radius: -1}}' &&
    refuse 'normal is (0, 0, 0)' '{plane: {point: [0, 0, -1], normal: [0, 0, 0]}}' &&
    refuse 'nothing.obj' '{mesh: nothing.obj}' 3 &&
    refuse 'bad.yaml:4:14: effects\[1\].contact: 4 nodes are in the plane.*0.25 m below' '{plane: {point: [0, 0, 0.25]}}' &&
    expect 2 "$flesh" check bad.yaml && has stderr.txt 'bad.yaml:4:14: effects\[1\].contact: 4 nodes are in the plane'
}

# `flesh check` differentiates contact where it has a value: if the body touches.
a_scene_that_touches_checks() {
  cat >touching.yaml <<END
body: {mesh: $scenes/../meshes/cube_of_six_tets.mesh, material: {energy: S, young: 1e5, poisson: 0.4}}
effects:
  - inertia: {}
  - contact: {plane: {point: [0, 0, -0.01]}, thickness: 0.02, friction: 0.5}
time: {end: 1}
END
  expect 0 "$flesh" check touching.yaml && has stdout.txt 'contact .* pass' &&
    expect 0 "$flesh" check touching.yaml --set effects.contact.plane.point=[0,0,-1] &&
    has stdout.txt 'contact .* 0.0e+00  zero$'
}

# `flesh check` differentiates damping by the current stiffness, of an energy that is defined only for J > 0, even with small
# tets.
a_crumb_beside_a_bar_checks() {
  "$flesh" mesh box --cells 3,1,1 --size 3,1,1 --out bar.mesh >/dev/null &&
    "$flesh" mesh box --cells 1,1,1 --size 1/20,1/20,1/20 --out crumb.mesh >/dev/null && cat >crumb.yaml <<'END' || return 1
body: {mesh: bar.mesh, material: {energy: B, young: 1e5, poisson: 0.4}}
bodies: [{name: crumb, mesh: crumb.mesh, translation: [0, 0, 9]}]
effects: [inertia: {}, damping: {stiffness: 0.001, stiffness_at: current}]
time: {end: 1}
END
  expect 0 "$flesh" check crumb.yaml && has stdout.txt 'damping .* pass'
}

case ${1-} in
fast) run_tests fast_sheets_end_their_steps; exit ;;
esac
run_tests loose_tolerances_gain_no_energy jelly_on_stairs every_file_that_goes_in_has_its_hash hand_on_a_ball \
  a_scene_that_touches_checks a_crumb_beside_a_bar_checks bodies_are_told_to_pass_through_each_other \
  bodies_that_begin_crossed_are_refused bodies_that_begin_crossed_are_let_apart gaps_that_never_close_are_told \
  surfaces_that_start_close_are_told a_scene_with_contact_repeats bad_contacts_are_refused
