# TEST full program seconds=30 needs=flesh
# test_command_adapt.sh: `flesh run --to`: its error bars against finer answers, its meshes, and its refusals. FLESH names
# the program.
set -u
. "$(dirname -- "$0")/../shared/command.sh"

"$flesh" mesh box --cells 8,2,2 --size 4,1,1 --out bar.mesh >/dev/null || exit 1
cat >bar.yaml <<'END'
body: {mesh: bar.mesh, density: 1000, material: {energy: S, young: 1e7, poisson: 0.3}}
effects:
  - gravity: {acceleration: [0, 0, -9.81]}
  - pin: {box: [[-1, -1, -1], [0.2, 2, 2]]}
time: {method: static}
solver: {newton_tolerance: 1e-7}
output:
  frame_interval: 0
  probes:
    - {name: tip, point: [4, 0.5, 0.5], quantities: [position]}
    - {name: end, box: [[4, -1, -1], [5, 2, 2]], quantities: [position]}
    - {name: wall, box: [[-1, -1, -1], [0.2, 2, 2]], quantities: [reaction]}
    - {name: clamp, point: [0.01, 0.4, 0.4], quantities: [stress]}
END

# The error bar of the last mesh, by the rule of the page on error bars.
cat >rule.py <<'END'
def bar(meshes):
    m = meshes[-1]
    back = [e for e in meshes if e["dofs"] >= m["dofs"] / 4]
    back = back if len(back) > 2 else meshes[-3:]
    x = [m["dofs"] / e["dofs"] for e in back]
    w = [(e["dofs"] / m["dofs"]) ** 2 for e in back]
    mean_x, mean_y = (sum(a * b for a, b in zip(w, of)) / sum(w) for of in (x, [e["value"] for e in back]))
    slope = (sum(a * (b - mean_x) * (e["value"] - mean_y) for a, b, e in zip(w, x, back)) /
             sum(a * (b - mean_x) ** 2 for a, b in zip(w, x)))
    limit = mean_y - slope * mean_x
    rest = sum(a * (e["value"] - limit - slope * b) ** 2 for a, b, e in zip(w, x, back)) / (len(back) - 2)
    return 1.2 * (abs(m["value"] - limit) + rest ** .5) + .3 * m["estimate"] + abs(m.get("cut_off", 0))
END

# Error bars cover the error of each mesh; the last mesh has few dofs and good tets, and its wall carries the weight.
the_bar_covers_and_the_mesh_is_as_it_should_be() {
  expect 0 "$flesh" run bar.yaml --to 1%:tip.position_z --out to || return 1
  has stdout.txt '^mesh 0: .* tets, .* dofs: tip.position_z = .* m$' || return 1
  has stdout.txt '^tip.position_z = .* m +/- .* (mesh)$' && has stdout.txt '^again: flesh run to/scene.yaml$' || return 1
  for refine in 0 1 2; do
    expect 0 "$flesh" run bar.yaml --set body.element=tet10-mean --set body.refine=$refine \
      --set "effects.pin.box=[[-1, -1, -1], [1e-9, 2, 2]]" --out fine_$refine --quiet || return 1
  done
  expect 0 "$flesh" run to/scene.yaml --out again --quiet || return 1
  python3 - <<'END'
import csv, json
from rule import bar
def last(folder):
    with open(folder + "/probes.csv") as file:
        return {name: float(value) for name, value in list(csv.DictReader(file))[-1].items()}
name = "tip.position_z [m]"
a, b, c = (last(f"fine_{k}")[name] for k in range(3))
exact, given = c + (c - b) ** 2 / ((b - a) - (c - b)), last("to")
meshes = json.load(open("to/result.json"))["adapted_mesh"]["meshes"]
print(exact, [(m["dofs"], m["value"], m["error_mesh"], m["estimate"]) for m in meshes])
end = meshes[-1]
assert given[name] == end["value"] and last("again") == given
# The last mesh would have 2964 dofs if not fewer tets were marked near the tolerance.
assert abs(given[name] - exact) <= end["error_mesh"] <= .01 * abs(exact - .5) and end["dofs"] < 2800
# Every bar covers the error, and follows the rule of the page on error bars from a fit to the meshes so far and the estimate.
for k, m in enumerate(meshes):
    if not m["error_mesh"]:
        continue
    rule = bar(meshes[:k + 1])
    assert abs(m["value"] - exact) <= m["error_mesh"] and abs(m["error_mesh"] / rule - 1) < 1e-6, (k, m, rule)
# The estimate by recovery has the error's size on the first mesh, which is not adapted yet.
assert 0.6 < meshes[0]["estimate"] / abs(meshes[0]["value"] - exact) < 3
assert abs(meshes[0]["value"] - exact) > 3 * abs(end["value"] - exact)
assert min(m["radius_ratio_min"] for m in meshes) > .6
# The box of pin and wall ends within tets: refined meshes hold the same face as the first one.
assert abs(given["wall.reaction_z [N]"] - 4 * 9810) < 1
END
}

# `flesh snap --error` draws each tet's share of the error; on the bar's first mesh the error comes from tets at the wall, of
# which the largest share is 5 to 20 % of the estimate.
shares_of_tets_are_drawn() {
  expect 0 "$flesh" snap to/to/0 --error tip.position_z --width 100 --out shares.png || return 1
  python3 - <<'END' || return 1
import json, re
estimate = json.load(open("to/result.json"))["adapted_mesh"]["meshes"][0]["estimate"]
least, most = re.search(r"^colours: error of the mesh \[µm\] from 0 to .*; there is (\S+) to (\S+)$", open("stdout.txt").read(),
                        re.M).groups()
print(estimate, least, most)
assert 0 <= float(least) < 1e-4 * float(most) and .05 * estimate < 1e-6 * float(most) < .2 * estimate
END
  for seen in 'bar.yaml --error tip.position_z' 'to/to/0 --error tip.velocity_q' 'to/to/0 --error wall.reaction_z'; do
    # shellcheck disable=SC2086
    expect 2 "$flesh" snap $seen --out no.png && has stderr.txt 'need ten-node tets and a position of a probe' || return 1
  done
  [ ! -e no.png ]
}

# All meshes carry the same load, though the sphere ends within tets and contains nodes on edges without the edges' ends.
loads_within_tets_are_carried() {
  sed -e 's/pin: {box.*/pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}/' \
    -e 's/- gravity.*/- traction: {sphere: {centre: [2, 0.5, 1], radius: 0.6}, traction: [0, 0, 1e4]}/' \
    -e 's/  *solver/solver/' bar.yaml >patch.yaml
  expect 0 "$flesh" run patch.yaml --to .5%:tip.position_z --out patch || return 1
  has stderr.txt '^flesh: warning: effects\[0\].traction ends within tets: .* leaves out [0-9]* of its [0-9]* nodes$' || return 1
  python3 - <<'END'
import csv, json
with open("patch/probes.csv") as file:
    row = list(csv.DictReader(file))[-1]
meshes = json.load(open("patch/result.json"))["adapted_mesh"]["meshes"]
values = [m["value"] for m in meshes]
print(values, row["wall.reaction_z [N]"])
assert len(values) > 2 and max(values) - min(values) < .1 * abs(values[-1] - .5)
assert abs(float(row["wall.reaction_z [N]"]) + 2500) < 1 # the load on two triangles, halves of a square of .5 m
assert all(abs(m["value"] - values[-1]) <= m["error_mesh"] for m in meshes[:-1] if m["error_mesh"] is not None)
END
}

# A tet has the material at its middle. The estimated effect of the parts that a box cuts off, `cut_off`, is like that of
# moving the box, and the bar includes it: without it, the bar was 0.6 of the error if the box begins at 1.7 m.
boxes_of_regions_within_tets_are_counted() {
  sed -e 's/^effects:/  regions: [{box: [[2, -9, -9], [9, 9, 9]], material: {energy: S, young: 3e7, poisson: 0.3}}]\n&/' \
    -e 's/^body: {\(.*\)}$/body:\n  \1/; s/-1, -1, -1\], \[0.2/-1, -1, -1], [1e-9/' bar.yaml |
    sed '2s/, \([dm]\)/\n  \1/g' >regions.yaml
  for x in 1.5 2 2.5; do
    expect 0 "$flesh" run regions.yaml --set body.element=tet10-mean --set "body.regions.0.box[0]=[$x, -9, -9]" --out at_$x \
      --quiet || return 1
  done
  for x in 1.97 2 2.03; do
    expect 0 "$flesh" run regions.yaml --to 0.1:tip.position_z --set "body.regions.0.box[0]=[$x, -9, -9]" --out to_$x || return 1
  done
  ! has stderr.txt warning || return 1
  "$flesh" mesh box --cells 40,2,2 --size 4,1,1 --out fine.mesh >/dev/null || return 1
  set -- --set 'body.regions.0.box[0]=[1.7, -9, -9]' --set body.regions.0.material.young=3e6
  expect 0 "$flesh" run regions.yaml "$@" --set body.element=tet10-mean --set body.mesh=fine.mesh --out exact --quiet || return 1
  expect 0 "$flesh" run regions.yaml "$@" --to 1.5%:tip.position_z --out counted --quiet || return 1
  python3 - <<'END' || return 1
import csv, json
from rule import bar
def last(folder):
    with open(folder + "/probes.csv") as file:
        return float(list(csv.DictReader(file))[-1]["tip.position_z [m]"])
def meshes(folder):
    return json.load(open(folder + "/result.json"))["adapted_mesh"]["meshes"]
slope = last("at_2.5") - last("at_1.5")
told = {x: meshes(f"to_{x}")[0].get("cut_off") for x in ("1.97", "2", "2.03")}
print(last("at_2"), slope, told, last("exact"), meshes("counted"))
assert told["2"] is None and all(.4 < told[x] / (slope * (float(x) - 2)) < 2.5 for x in ("1.97", "2.03"))
end = meshes("counted")[-1]
assert abs(last("counted") - last("exact")) <= end["error_mesh"] and abs(end["error_mesh"] / bar(meshes("counted")) - 1) < 1e-6
END
  expect 0 "$flesh" run regions.yaml "$@" --set body.regions.0.density=2000 --to 9%:tip.position_z --out denser &&
    has stderr.txt 'boxes of body.regions cut [0-9]* tets, .*; the bar of tip.position_z does not count the densities$' || return 1
  expect 0 "$flesh" run bar.yaml --to 20%:tip.position_z --out muscle --set "effects[2]={muscle: {box: [[2.1, -1, -1], [9, 2, 2]],
    fibres: {direction: [1, 0, 0]}, peak_stress: 1e4}}" &&
    has stderr.txt 'effects.2..muscle.box cuts [0-9]* tets, .*; the bar of tip.position_z does not count that$'
}

# Refined meshes carry over many selections, here nine pins.
many_selections_are_carried() {
  pin='  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}'
  sed -e "s/^  - pin: .*/$(printf '%s\\n' "$pin" "$pin" "$pin" "$pin" "$pin" "$pin" "$pin" "$pin" "$pin")/" bar.yaml >many.yaml
  expect 0 "$flesh" run many.yaml --to 10%:tip.position_z --out many
}

bodies_keep_their_shape() {
  cat >finger.yaml <<END
body: {mesh: $source_folder/../data/meshes/finger_coarse.msh, density: 1000, material: {energy: S, young: 5e5, poisson: 0.45}}
effects:
  - gravity: {acceleration: [0, 0, -9.81]}
  - pin: {box: [[-1, -1, -1], [1e-6, 1, 1]]}
time: {method: static}
output: {frame_interval: 0, probes: [{name: tip, point: [0.075, 0, 0], quantities: [position]}]}
END
  expect 0 "$flesh" run finger.yaml --to 2%:tip.position_z --out finger || return 1
  expect 0 "$flesh" run finger.yaml --set body.element=tet10-mean --out finger_0 --quiet || return 1
  python3 - <<'END'
import csv, json
def volume(folder):
    with open(folder + "/history.csv") as file:
        row = next(csv.DictReader(file))
    return float(row["volume"]) / float(row["volume_ratio"])
meshes = json.load(open("finger/result.json"))["adapted_mesh"]["meshes"]
print(volume("finger"), volume("finger_0"), [(m["tets"], m["radius_ratio_min"]) for m in meshes])
assert meshes[-1]["tets"] > meshes[0]["tets"] and abs(volume("finger") / volume("finger_0") - 1) < 1e-12
assert min(m["radius_ratio_min"] for m in meshes) > .3
END
}

# Pressures are constant in each tet, so values at a point scatter until its tets are small: their size halves from mesh to
# mesh. When they were only bisected once from mesh to mesh, the scatter was more than a tenth at 100 000 dofs.
stresses_at_points_settle() {
  expect 0 "$flesh" run bar.yaml --set body.material.poisson=0.45 --to 10%:in.stress_zz --out stress \
    --set 'output.probes=[{name: in, point: [1.3, 0.4, 0.85], quantities: [stress]}]' || return 1
  python3 - <<'END'
import json
meshes = json.load(open("stress/result.json"))["adapted_mesh"]["meshes"]
print([(m["dofs"], m["value"], m["error_mesh"]) for m in meshes])
assert meshes[-1]["dofs"] < 40000
END
}

what_has_no_bar_is_refused() {
  expect 2 "$flesh" run bar.yaml --to 1%:end.position_z --out no || return 1
  has stderr.txt 'end.position_z is a mean over nodes, of which finer meshes have others; give the probe a point' || return 1
  expect 2 "$flesh" run bar.yaml --to 1%:clamp.stress_xx --out no || return 1
  has stderr.txt 'clamp.stress_xx is a strain beside a pin, which grows without end' || return 1
  expect 2 "$flesh" run bar.yaml --to 1%:energy_total --out no || return 1
  has stderr.txt 'it must be a column of output.probes' || return 1
  expect 2 "$flesh" run bar.yaml --to 1%:tip.velocity_q --out no || return 1
  has stderr.txt 'tip.velocity_q; it must be a column of output.probes' && [ ! -e no ] || return 1
  expect 2 "$flesh" run bar.yaml --set effects.inertia={} --method newmark --set time.step=0.1 --set time.end=1 \
    --to 1%:tip.position_z --out no || return 1
  has stderr.txt 'refines the meshes of equilibria' || return 1
  for wrong in 1% 0:tip.position_z -1%:a.b 100%:a.b x:a.b; do
    expect 2 "$flesh" run bar.yaml --to "$wrong" --out no || return 1
  done
  expect 2 "$flesh" run bar.yaml --to 1%:tip.position_z --error --out no
}

# For a point that does not move, by symmetry or without load, a tolerance in % of its movement is refused, one in m is not.
what_does_not_move_needs_a_length() {
  expect 2 "$flesh" run bar.yaml --set 'effects.gravity.acceleration=[0, 0, 0]' --to 1%:tip.position_z --out rests || return 1
  has stderr.txt 'tip.position_z has moved by 0 m, which its bar' && has stderr.txt 'as 0.001:tip.position_z' || return 1
  expect 0 "$flesh" run bar.yaml --set 'effects.gravity.acceleration=[0, 0, 0]' --to .001:tip.position_z --out rests &&
    expect 2 "$flesh" run bar.yaml --to 1%:tip.position_y --out beside &&
    has stderr.txt 'tip.position_y has moved by .* does not tell from nothing'
}

# A compressed bar buckles to a side that depends on its mesh: the first run finds it soft. Rows before the last one and the way to
# the first one count, too.
what_buckles_is_refused() {
  "$flesh" mesh box --cells 4,1,1 --size 4,1,1 --out strut.mesh >/dev/null || return 1
  cat >strut.yaml <<'END'
body: {mesh: strut.mesh, density: 1000, material: {energy: S, young: 1e5, poisson: 0.3}}
effects:
  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}
  - prescribed_motion: {box: [[3.999, -1, -1], [5, 2, 2]], motion: [{time: 0}, {time: 1, translation: [-0.8, 0, 0]}]}
time: {method: static, step: 1, end: 1}
output: {frame_interval: 0, probes: [{name: middle, point: [2, 0.5, 0.5], quantities: [position]}]}
END
  sed -e 's/{time: 1, \(.*\)}\]}/{time: 1}, {time: 2, \1}, {time: 3}]}/; s/end: 1/end: 3/' strut.yaml >back.yaml
  sed -e 's/- prescribed.*/- traction: {box: [[3.999, -1, -1], [5, 2, 2]], traction: [-5e3, 0, 0]}/' strut.yaml >pressed.yaml
  for how in 'strut:at t = 0.25 s' 'back:at t = 2 s' 'pressed:under 12.5 % of its load'; do
    expect 2 "$flesh" run "${how%%:*}.yaml" --to .001:middle.position_z --out strut &&
      has stderr.txt "times as stiff against its softest motion as at rest, ${how#*:}, .* and there is no bar" || return 1
  done
  sed -e 's/-0.8, 0, 0/-1.6, 0, 0/; s/energy: S/energy: M/' strut.yaml >crushed.yaml
  expect 2 "$flesh" run crushed.yaml --to .001:middle.position_z --out crushed || return 1
  has stderr.txt 'the equilibrium on a mesh of .* tets has .* inverted ones'
}

# A slenderer bar, whose stress at rest keeps its stiffness from being known, buckles the same way on some meshes, whose error
# bars become small, and then the other way: a warning says so, and the error bars from there on count the change.
another_equilibrium_is_told() {
  "$flesh" mesh box --cells 6,1,1 --size 6,1,1 --out slender.mesh >/dev/null || return 1
  sed -e 's/strut.mesh/slender.mesh/' -e 's/3.999/5.999/' -e 's/5, 2, 2/7, 2, 2/' -e 's/point: .2/point: [3/' \
    -e 's/-0.8, 0, 0/-1.5, 0, 0/' -e 's/S, young: 1e5, poisson: 0.3/D, young: 1e5, poisson: 0.45/' strut.yaml >slender.yaml
  expect 6 "$flesh" run slender.yaml --to .02:middle.position_z --out slender || return 1
  has stderr.txt 'warning: middle.position_z changes by .* m from mesh .* to .*, .* times its bar: .* another equilibrium' ||
    return 1
  python3 - <<'END'
import re
meshes = [(float(v), float(b)) for v, b in re.findall(r"position_z = (\S+) m \+/- (\S+)", open("stdout.txt").read())]
change = [abs(v - u) if abs(v - u) > 3.05 * b else 0 for (u, b), (v, _) in zip(meshes, meshes[1:])]
first = next(k for k, c in enumerate(change) if c)
print(meshes, change)
assert first + 2 < len(meshes) and all(b > .95 * change[first] for _, b in meshes[first + 1:])
END
}

# Values have all digits that their error bars need, even of a bar whose movement is below the six digits of its position.
values_have_the_digits_of_their_bars() {
  expect 0 "$flesh" run bar.yaml --set body.material.young=1e11 --to 1%:tip.position_z --out stiff || return 1
  python3 - <<'END'
import json, re
told = [(float(v), float(b)) for v, b in re.findall(r"position_z = (\S+) m \+/- (\S+)", open("stdout.txt").read())]
meshes = [m for m in json.load(open("stiff/result.json"))["adapted_mesh"]["meshes"] if m["error_mesh"]]
print(told, meshes)
assert len(told) == len(meshes) + 1 and meshes[-1]["error_mesh"] < 1e-6
assert all(abs(v - m["value"]) <= .1 * m["error_mesh"] for (v, _), m in zip(told, meshes + meshes[-1:]))
END
}

run_tests what_does_not_move_needs_a_length what_buckles_is_refused another_equilibrium_is_told the_bar_covers_and_the_mesh_is_as_it_should_be shares_of_tets_are_drawn loads_within_tets_are_carried boxes_of_regions_within_tets_are_counted many_selections_are_carried bodies_keep_their_shape stresses_at_points_settle what_has_no_bar_is_refused values_have_the_digits_of_their_bars
