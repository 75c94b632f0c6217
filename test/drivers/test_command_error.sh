# TEST full program seconds=60 needs=flesh
# test_command_error.sh: `flesh run --error`: its error bars against finer answers, and why some numbers have none. FLESH
# names the program.
set -u
. "$(dirname -- "$0")/../shared/command.sh"

"$flesh" mesh box --cells 4,1,1 --size 4,1,1 --out bar.mesh >/dev/null || exit 1
cat >bar.yaml <<'END'
body:
  mesh: bar.mesh
  density: 1000
  material: {energy: S, constants: matched, young: 4e6, poisson: 0.45}
effects:
  - inertia: {}
  - gravity: {acceleration: [0, 0, -9.81]}
  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}
time: {method: bdf2, step: 1/60, end: 1}
output:
  frame_interval: 0
  probes:
    - {name: tip, point: [4, 0.4, 0.4], quantities: [position]}
    - {name: clamp, point: [0.01, 0.4, 0.4], quantities: [stress]}
END
sed '/inertia/d; s/^time.*/time: {method: static}/' bar.yaml >still.yaml

# covers RUN KIND FINER WIDEST: the tip's bars of this kind are at least its distance from the finer run at all times that
# both runs have, and the last one is at most WIDEST times the largest distance.
covers() {
  python3 - "$@" <<'END'
import csv, sys
run, kind, finer, widest = sys.argv[1], sys.argv[2], sys.argv[3], float(sys.argv[4])
def read(folder):
    with open(folder + "/probes.csv") as file:
        return list(csv.DictReader(file))
given, exact = read(run), {round(float(row["t [s]"]), 9): row for row in read(finer)}
name, bar = "tip.position_z [m]", f"tip.position_z_error_{kind} [m]"
errors = [abs(float(row[name]) - float(exact[round(float(row["t [s]"]), 9)][name])) for row in given[1:]]
bars = [float(row[bar]) for row in given[1:]]
print(max(errors), bars[-1])
# A bar counts differences in later rows, too, and is at least 0.3 times that of another direction.
assert float(given[0][bar]) > 0 and all(float(row[bar.replace("_z_", "_y_")]) > 0.29 * float(row[bar]) for row in given)
assert max(errors) > 5e-5 and all(b >= e - 1e-6 for b, e in zip(bars, errors)) and bars[-1] <= widest * max(errors)
END
}

other_steps_cover() {
  for method in bdf2 newmark; do
    expect 0 "$flesh" run bar.yaml --method $method --error --out steps || return 1
    has stdout.txt '^error bars of the step: by steps of 0.00833333 s and of 0.0333333 s$' || return 1
    has stdout.txt '^tip.position_z = .* m +/- .* (mesh) +/- .* (step); tet10-mean gives .* m$' || return 1
    expect 0 "$flesh" run bar.yaml --method newmark --set time.step=1/960 --out fine --quiet || return 1
    covers steps step fine 4 || return 1
  done
}

newmark_covers_backward_euler() {
  expect 0 "$flesh" run bar.yaml --method backward-euler --error --out euler || return 1
  has stdout.txt '^error bars of the step: by newmark with the same steps$' && covers euler step fine 3
}

a_smaller_tolerance_covers() {
  expect 0 "$flesh" run bar.yaml --method adaptive --set time.tolerance=1e-3 --error --out adaptive || return 1
  covers adaptive step fine 4 || return 1
  # If outputs limit the steps, a smaller tolerance alone would change nothing, so time.step is smaller, too.
  expect 0 "$flesh" run bar.yaml --method adaptive --set time.tolerance=0.5 --error --out capped || return 1
  has stdout.txt '^error bars of the step: by a tolerance of 0.125 and a time.step of 0.00833333 s$' || return 1
  covers capped step fine 10
}

# The mesh's bars cover the error, even of tet4, which locks.
meshes_cover() {
  expect 0 "$flesh" run still.yaml --set body.element=tet10-mean --set body.refine=2 --out fine_mesh --quiet || return 1
  expect 0 "$flesh" run still.yaml --set body.element=tet10-mean --set body.refine=1 --error --out coarse || return 1
  has stdout.txt '^error bars of the mesh: by the next coarser mesh (body.refine 0), and tet10 on it$' || return 1
  has stdout.txt '^error bars of the step: none, as these equilibria do not depend on the steps' || return 1
  covers coarse mesh fine_mesh 20 || return 1
  expect 0 "$flesh" run still.yaml --set body.refine=1 --error --out halved && covers halved mesh fine_mesh 2.5 || return 1
  has stdout.txt '^error bars of the mesh: by tet10-mean on the next coarser mesh, mostly the better answer$' || return 1
  said halved mesh '"body.refine=0" in companions[0]["set"]' || return 1
  expect 0 "$flesh" run still.yaml --error --out linear && covers linear mesh fine_mesh 2 || return 1
  expect 0 "$flesh" run bar.yaml --set body.element=tet10-mean --set body.refine=1 --out fine_motion --quiet || return 1
  expect 0 "$flesh" run bar.yaml --error --out linear_motion && covers linear_motion mesh fine_motion 2
}

# Bars from the coarser mesh follow the rule of the page on error bars: that of two companions, or of one if the other
# element's run fails, as it does at a Poisson's ratio of one half.
coarser_meshes_make_bars() {
  for poisson in 0.3 0.499 0.5; do
    expect 0 "$flesh" run still.yaml --set body.element=tet10-mean --set body.refine=1 --error --out both \
      --set body.material.poisson=$poisson || return 1
    python3 - $poisson <<'END' || return 1
import csv, json, os, sys
def last(folder):
    with open("both" + folder + "/probes.csv") as file:
        return {name.split(" ")[0]: float(value) for name, value in list(csv.DictReader(file))[-1].items()}
run, mesh = last(""), last("/error/mesh")
told = json.load(open("both/result.json"))["error_bars"]["mesh"]
print(told)
other = last("/error/mesh_2") if len(told["companions"]) > 1 else mesh
assert (sys.argv[1] == "0.5") == (len(told["companions"]) == 1)
names = [f"tip.position_{c}" for c in "xyz"]
wide = [abs(run[n] - mesh[n]) for n in names]
for name, w in zip(names, wide):
    rule = .62 * (w + .3 * abs(mesh[name] - other[name]) + .3 * max(wide)) if len(told["companions"]) > 1 else \
        1.8 * max(w, .3 * max(wide))
    assert abs(run[name + "_error_mesh"] / rule - 1) < 1e-6, (name, rule)
END
    rm -r both
  done
}

# Waves that the steps do not resolve may agree on two meshes by chance. With twice the step they differ more, which widens
# the mesh's bars, also in a run of ten steps, which has no bars of the step.
twice_the_step_widens_bars_of_the_mesh() {
  for how in 1/2:step_2 1/6:twice; do
    rm -rf waves
    expect 0 "$flesh" run bar.yaml --method newmark --set body.element=tet10-mean --set body.refine=1 \
      --set time.end="${how%:*}" --error --out waves \
      --set 'effects[1]={traction: {box: [[3.99, -1, -1], [9, 2, 2]], traction: [3e5, 0, 0]}}' || return 1
    has stdout.txt 'next coarser mesh (body.refine 0), there with steps of 0.0333333 s, and tet10 on it$' || return 1
    python3 - "${how#*:}" <<'END' || return 1
import csv, sys
def read(folder):
    with open("waves" + folder + "/probes.csv") as file:
        return {round(float(row["t [s]"]), 9): {name.split(" ")[0]: float(value) for name, value in row.items()}
                for row in csv.DictReader(file)}
def change(a, b, name):
    return max(abs(a[t][name] - b[t][name]) for t in a if t in b)
run, mesh, other, twice, coarse = map(read, ("", "/error/mesh", "/error/mesh_2", "/error/" + sys.argv[1], "/error/mesh_2_steps"))
names, widened = [f"tip.position_{c}" for c in "xyz"], 0
wide = [max(change(run, mesh, n), .3 * change(mesh, other, n), change(twice, coarse, n)) for n in names]
for name, w in zip(names, wide):
    rule = 1.1 * max(w, .3 * max(wide))
    print(name, rule, w, change(run, mesh, name))
    assert abs(run[max(run)][name + "_error_mesh"] / rule - 1) < 1e-6
    widened += w > 1.2 * change(run, mesh, name)
assert widened
END
    expect 0 "$flesh" run bar.yaml --out waves --quiet && [ ! -e waves/error ] || return 1
  done
}

# A tet has the material of the region that contains its middle, and boxes that cut tets are reported: a box that begins at
# 2.1 m cuts the 24 tets from 2 to 2.5 m.
boxes_of_regions_that_cut_tets_are_told() {
  for box in 2:0 2.1:24; do
    expect 0 "$flesh" run still.yaml --set body.element=tet10-mean --set body.refine=1 --error --out regions \
      --set "body.regions=[{box: [[${box%:*}, -1, -1], [9, 2, 2]], material: {energy: S, young: 1e6, poisson: .45}}]" || return 1
    if [ "${box#*:}" -eq 0 ]; then
      ! grep -q 'cut' stdout.txt && said regions mesh '"left_out" not in found[0]' || return 1
    fi
  done
  has stdout.txt '^error bars of the mesh: .*; boxes of body.regions cut 24 tets, .* material of .*: 2.[3-7] % of the volume' ||
    return 1
  said regions mesh '"which the bars do not count" in left_out' || return 1
  expect 0 "$flesh" run still.yaml --set body.element=tet10-mean --set body.refine=1 --error --out regions \
    --set 'body.regions=[{box: [[2.1, -1, -1], [9, 2, 2]], density: 2000}, {box: [[-1, -1, -1], [0.7, 2, 2]]}]' || return 1
  said regions mesh '"cut 24 tets, which have the density and material" in left_out' || return 1
  for box in 2:0 2.1:24; do
    expect 0 "$flesh" run still.yaml --set body.element=tet10-mean --set body.refine=1 --error --out muscle --set "effects[2]={
      muscle: {box: [[${box%:*}, -1, -1], [9, 2, 2]], fibres: {direction: [1, 0, 0]}, peak_stress: 1e4}}" || return 1
    said muscle mesh "found[0].get('left_out') == ('effects[2].muscle.box cuts 24 tets, whose middle decides whether they have ' +
      'fibres, which the bars do not count' if ${box#*:} else None)" || return 1
  done
}

# said RUN QUANTITY EXPRESSION: the Python expression is true for what the run's result.json says of the quantity's bars.
said() {
  python3 - "$@" <<'END'
import json, sys
bars = json.load(open(sys.argv[1] + "/result.json"))["error_bars"]
found = [q for q in bars["quantities"] if q["name"] == sys.argv[2]] or [bars[sys.argv[2]]]
print(found[0])
assert eval(sys.argv[3], {**found[0], "found": found}), sys.argv[3]
END
}

# result.json says why a number has no bar.
no_bar_is_said() {
  said linear_motion J_min 'error_mesh is None and "extreme" in no_mesh_bar and "extreme" in no_step_bar' || return 1
  said linear_motion clamp.stress_xx 'error_mesh is None and "beside a pin" in no_mesh_bar and error_step > 0' || return 1
  ! grep -q 'J_min_error\|J_min_tet_error' linear_motion/history.csv || return 1
  ! grep -q 'clamp.stress_xx_error_mesh' linear_motion/probes.csv || return 1
  expect 0 "$flesh" run bar.yaml --set body.element=tet10-mean --set time.end=1/10 --error --out short || return 1
  said short mesh '"no coarser mesh" in no_bar and companions == []' && said short step '"twelve steps" in no_bar' || return 1
  # A pin or load that ends within tets leaves no bar, also if only tets of the coarser mesh are cut, or if both meshes hold the
  # same nodes.
  for set in 'pin.box=[[-1, -1, -1], [0.25, 2, 2]]' 'pin.box=[[-1, -1, -1], [0.6, 2, 2]]' 'pin={sphere: {centre: [0, .5, .5], radius: .9}}'; do
    expect 0 "$flesh" run still.yaml --set body.element=tet10-mean --set body.refine=1 --error --out cut --set "effects.$set" ||
      return 1
    said cut mesh '".pin ends within tets" in no_bar' || return 1
  done
  expect 0 "$flesh" run still.yaml --error --out cut \
    --set 'effects[2]={traction: {box: [[1.6, -1, 0.9], [9, 2, 2]], traction: [0, 0, 7]}}' || return 1
  said cut mesh '"effects[2].traction ends within tets" in no_bar' || return 1
  # Ten-node tets on the coarser mesh have the same nodes as four-node tets on the finer one, so there is a bar.
  expect 0 "$flesh" run still.yaml --set body.refine=1 --error --out cut --set 'effects.pin.box=[[-1, -1, -1], [0.53, 2, 2]]' ||
    return 1
  said cut mesh '"better answer" in compared_with' && said cut tip.position_z 'error_mesh > 0' || return 1
  # A motion so violent that steps of these lengths show no order has no bar.
  expect 0 "$flesh" run "$source_folder/../data/scenes/whip.yaml" --method newmark --error --out whip || return 1
  said whip energy_total 'error_step is None and "not asymptotic" in no_step_bar'
}

failed_companions_leave_no_bar() {
  expect 0 "$flesh" run "$source_folder/../data/scenes/whip.yaml" --method bdf2 --set time.end=0.5 --error --out failed \
    --set solver.max_newton=5 --set solver.max_cutbacks=0 || return 1
  has stdout.txt 'error bars of the step: none, as the companion (steps of .*) ended: at t = .*iteration limit' || return 1
  said failed step '"iteration limit" in no_bar' && said failed energy_total 'error_step is None' || return 1
  # The run with half the step fails. If that with twice the step fails, too, the mesh is not said to be judged at twice the
  # step.
  for how in 7:1/4 6:1/8; do
    expect 0 "$flesh" run bar.yaml --method newmark --set body.element=tet10-mean --set body.refine=1 --set time.end=${how#*:} \
      --set 'effects[1]={traction: {box: [[3.99, -1, -1], [9, 2, 2]], traction: [7e5, 0, 7e5]}}' --error --out halves_${how%:*} \
      --set solver.max_newton=${how%:*} --set solver.max_cutbacks=0 || return 1
  done
  said halves_7 step '"iteration limit" in no_bar' && said halves_7 mesh '"steps" in compared_with and len(companions) == 4' &&
    said halves_6 mesh '"steps" not in compared_with and len(companions) == 1 and factor == 1.8' || return 1
  # Companions of four-node tets on the same mesh give no bar of J if the body is nearly incompressible, and wider bars of
  # moments than of forces.
  for how in 0.48:0:1 0.47:0:0 0.48:1:0; do
    poisson=${how%%:*} refine=${how#*:}
    expect 0 "$flesh" run still.yaml --set body.material.poisson="$poisson" --set body.refine="${refine%:*}" --error \
      --out "stiff_$how" --set 'output.probes=[{name: in, point: [1.3, 0.4, 0.85], quantities: [J]},
        {name: wall, box: [[-1, -1, -1], [1e-9, 2, 2]], quantities: [reaction]}]' || return 1
    said "stiff_$how" in.J "(error_mesh is None and 'J of nearly' in no_mesh_bar) == bool(${how##*:})" || return 1
  done
  said stiff_0.47:0:0 wall.reaction_moment_y 'abs(error_mesh / abs(value - better) / (1.5 * 1.75) - 1) < 1e-9' || return 1
  # Bars of what ten-node tets give at a point are of what smoothing changes and half the difference, those of sums over tets
  # are not. A run without error bars lacks what is smoothed.
  for how in static newmark; do
    expect 0 "$flesh" run still.yaml --set body.element=tet10-mean --set body.refine=1 --method $how --error --out "in_$how" \
      --set 'output.probes=[{name: in, point: [1.3, 0.4, 0.85], quantities: [J, stress, energy]},
        {name: all, box: [[2, -1, -1], [5, 2, 2]], quantities: [stress]}]' || return 1
    has stdout.txt '^in.stress_xx = .* (mesh).*; smoothed' || return 1
    ! has stdout.txt '^in.energy = .*; smoothed\|^all.stress_xx = .*; smoothed' && ! grep -q smooth "in_$how/probes.csv" || return 1
    python3 - "in_$how" $how <<'END' || return 1
import csv, json, sys
folder, method = sys.argv[1:]
quantities = {q["name"]: q for q in json.load(open(folder + "/result.json"))["error_bars"]["quantities"]}
def rows(out, name):
    with open(out + ("/probes.csv" if "." in name else "/history.csv")) as file:
        return [float(value) for row in csv.DictReader(file) for column, value in row.items() if column.split(" ")[0] == name]
def most(name, first="", second="/error/mesh"):
    return max(abs(a - b) for a, b in zip(rows(folder + first, name), rows(folder + second, name)))
def parts(name):
    q = quantities[name]
    return abs(q["value"] - q["better"]) + 0.5 * most(name)
stresses = [f"in.stress_{c}" for c in ("xx", "yy", "zz", "xy", "yz", "xz")]
if method == "static":
    rule = .62 * (1.3 * most("energy_elasticity") + .3 * most("energy_elasticity", "/error/mesh", "/error/mesh_2"))
    assert abs(quantities["energy_elasticity"]["error_mesh"] / rule - 1) < 1e-6
    for name, factor in [("in.J", 1.5)] + [(name, 1) for name in stresses]:
        widest = parts(name) if name == "in.J" else max(parts(n) for n in stresses)
        print(name, quantities[name], widest)
        assert abs(quantities[name]["error_mesh"] / (0.62 * factor * (parts(name) + 0.5 * widest)) - 1) < 1e-6
else:  # in motions smoothing may change an earlier row more
    assert all(quantities[name]["error_mesh"] > 0.62 * parts(name) for name in stresses)
assert "better" not in quantities["all.stress_xx"] and "better" not in quantities["in.energy"]
END
  done
  expect 0 "$flesh" run still.yaml --set body.element=tet10-mean --set body.refine=1 --out late --quiet \
    --set 'output.probes=[{name: in, point: [1.3, 0.4, 0.85], quantities: [position, J]}]' || return 1
  expect 0 "$flesh" run --resume late --error && said late in.position_x 'error_mesh > 0' &&
    said late in.J 'error_mesh is None and "begin with --error" in no_mesh_bar' || return 1
  # A probe at a node that the coarser mesh lacks has no bar.
  expect 0 "$flesh" run still.yaml --set body.element=tet10-mean --set body.refine=1 --error --out node \
    --set 'output.probes[0]={name: tip, nodes: [100]}' || return 1
  said node mesh '"100" in no_bar'
}

# Where the ends of a bar come together by a fifth, it buckles, otherwise on a finer mesh; by a twentieth, it stays straight.
# Rows before the last one have no bar either if the bar is straight again at the end.
buckled_bodies_have_no_bar() {
  sed '/gravity/d; /name: clamp/d; s/tip, point: .4,/middle, point: [2,/' still.yaml >pressed.yaml
  for way in 0.2:+ 0.9:-; do
    set -- pressed.yaml --set "effects[1]={prescribed_motion: {box: [[3.99, -1, -1], [5, 2, 2]],
      motion: [{time: 0, translation: [-${way%:*}, 0.02, 0.01]}]}}"
    expect 0 "$flesh" run "$@" --set body.refine=2 --set body.element=tet10-mean --out finer --quiet || return 1
    expect 0 "$flesh" run "$@" --set body.refine=1 --error --out pressed || return 1
    python3 - "${way#*:}" <<'END' || return 1
import csv, json, sys
def last(folder):
    with open(folder + "/probes.csv") as file:
        return float(list(csv.DictReader(file))[-1]["middle.position_y [m]"])
told = json.load(open("pressed/result.json"))["error_bars"]["mesh"]
run, finer = map(last, ("pressed", "finer"))
print(told, run, finer)
if sys.argv[1] == "+":
    assert "compared_with" in told and abs(run - finer) < 1e-3
else:
    assert "against its softest motion" in told["no_bar"] and abs(run - finer) > 0.1
END
  done
  expect 0 "$flesh" run pressed.yaml --set body.refine=1 --error --out back --set time.step=0.5 --set time.end=2 --set "effects[1]={
    prescribed_motion: {box: [[3.99, -1, -1], [5, 2, 2]], motion: [{time: 0}, {time: 1}, {time: 1.5, translation: [-0.8, 0, 0]},
    {time: 2}]}}" && said back mesh '"against its softest motion as at rest, at t = 1.5 s" in no_bar' || return 1
  # At 2.9 times Euler's load a column is as stiff as at rest, and bends otherwise on a finer mesh: the bar was .008 of the error.
  "$flesh" mesh box --cells 5,1,1 --size 5,1,.9 --out column.mesh >/dev/null || return 1
  for load in 5330:+ 77300:-; do
    set -- still.yaml --set body.mesh=column.mesh --set body.element=tet10-mean --set body.material.poisson=0.3 \
      --set "effects[0]={traction: {box: [[4.99, -1, -1], [6, 2, 2]], traction: [-${load%:*}, 0, 0]}}" \
      --set 'output.probes=[{name: tip, point: [5, 0.5, 0.45], quantities: [position]}]'
    expect 0 "$flesh" run "$@" --set body.refine=1 --error --out column || return 1
    said column mesh "('no_bar' in found[0]) == ('${load#*:}' == '-')" || return 1
  done
  # A material that is stressed at rest relaxes, and has a bar.
  expect 0 "$flesh" run still.yaml --set body.refine=1 --set body.material='{energy: D, young: 4e6, poisson: 0.45}' --error --out free &&
    said free tip.position_z 'error_mesh > 0'
}

# Error bars do not change the run: their columns come after its own, and its state is the same.
columns_come_last() {
  expect 0 "$flesh" run bar.yaml --out plain --quiet || return 1
  expect 0 "$flesh" run bar.yaml --set output.error_bars=true --out keyed --quiet || return 1
  for table in probes history; do
    width=$(head -n 1 plain/$table.csv | tr ',' '\n' | grep -c '')
    cut -d, -f1-"$width" keyed/$table.csv | cmp - plain/$table.csv || return 1
  done
  cmp keyed/state.txt plain/state.txt && [ -f keyed/error/step_2/probes.csv ] || return 1
  expect 0 "$flesh" run bar.yaml --out keyed --quiet && [ ! -e keyed/error ]
}

complete_runs_get_bars() {
  expect 0 "$flesh" run --resume plain --error || return 1
  has stdout.txt 'is complete' && has stdout.txt '+/- .* (step)' || return 1
  cp -r plain again && expect 0 "$flesh" run --resume again --error || return 1
  ! grep -q '+/-' stdout.txt && cmp again/probes.csv plain/probes.csv || return 1
  covers plain step fine 4
}

# A run that is interrupted in its companions is complete, and gets its bars when it is resumed. The companions take some
# forty times as long as the pause between two looks at their file.
an_interrupted_companion_is_taken_up() {
  "$flesh" run bar.yaml --set body.refine=3 --set time.end=4 --error --out stopped >stdout.txt 2>stderr.txt &
  process=$!
  wait_until "$process" [ -e stopped/error/step/history.csv ] || return 1
  kill -INT "$process"
  wait "$process"
  [ $? -eq 130 ] || return 1
  grep -q '"status": "complete"' stopped/result.json && ! grep -q error_bars stopped/result.json || return 1
  expect 0 "$flesh" run --resume stopped && said stopped energy_total 'error_mesh > 0'
}

wrong_words_are_refused() {
  expect 2 "$flesh" run bar.yaml --set output.error_bars=3 --out wrong || return 1
  has stderr.txt 'output.error_bars' && [ ! -e wrong ] || return 1
  expect 2 "$flesh" run bar.yaml --error=1 --out wrong && [ ! -e wrong ]
}

# Positions that move by a billionth are printed with all digits that their bars need.
values_have_the_digits_of_their_bars() {
  expect 0 "$flesh" run still.yaml --set body.material.young=1e14 --error --out stiff || return 1
  python3 - <<'END'
import json, re
told = re.findall(r"^tip.position_(.) = (\S+) m \+/- (\S+) \(mesh\); tet10-mean gives (\S+) m$", open("stdout.txt").read(), re.M)
kept = {q["name"][-1]: q for q in json.load(open("stiff/result.json"))["error_bars"]["quantities"] if "position" in q["name"]}
print(told, kept)
assert len(told) == 3 and all(q["error_mesh"] < 1e-5 for q in kept.values())
for axis, value, _, better in told:
    for given, key in ((value, "value"), (better, "better")):
        assert abs(float(given) - kept[axis][key]) <= .1 * kept[axis]["error_mesh"]
END
}

# Forces at the start have no bars: the body is not loaded yet and has no reactions, or falls freely.
forces_at_the_start_have_no_bars() {
  sed '/name: tip/a\    - {name: wall, box: [[-1, -1, -1], [1e-9, 2, 2]], quantities: [reaction, position]}' still.yaml >wall.yaml
  expect 0 "$flesh" run wall.yaml --error --out wall && expect 0 "$flesh" report wall --out wall.html || return 1
  python3 - <<'END'
import csv
first, *others = csv.DictReader(open("wall/probes.csv"))
bars = [name for name in first if "wall." in name and "_error_mesh" in name]
assert len(bars) == 9 and others and all(float(row[bar]) >= 0 for row in others for bar in bars)
assert all((first[bar] == "") == ("reaction" in bar) for bar in bars), first
END
}

bars_are_drawn_as_bands() {
  expect 0 "$flesh" run bar.yaml --error --out bands || return 1
  expect 0 "$flesh" plot bands --y tip.position_z --out bands.svg || return 1
  has bands.gp '^plot [$]curve_1 using 1:([$]2 - [$]3):([$]2 + [$]3) with filledcurves' || return 1
  expect 0 "$flesh" plot bands --y tip.position_z --log y --out log.svg && ! has log.gp filledcurves || return 1
  python3 - <<'END'
import csv
rows = list(csv.DictReader(open("bands/probes.csv")))
script = open("bands.gp").read().split("<< END\n")[1].split("END")[0].splitlines()
drawn = [float(line.split()[2]) for line in script]
bars = [sum(float(row[f"tip.position_z_error_{of} [m]"]) for of in ("mesh", "step")) for row in rows]
assert len(drawn) == len(bars) > 5 and all(abs(a - b) <= 1e-9 * b for a, b in zip(drawn, bars)), (drawn, bars)
END
}

run_tests values_have_the_digits_of_their_bars forces_at_the_start_have_no_bars bars_are_drawn_as_bands \
  other_steps_cover newmark_covers_backward_euler a_smaller_tolerance_covers meshes_cover coarser_meshes_make_bars \
  twice_the_step_widens_bars_of_the_mesh boxes_of_regions_that_cut_tets_are_told no_bar_is_said failed_companions_leave_no_bar \
  buckled_bodies_have_no_bar columns_come_last complete_runs_get_bars an_interrupted_companion_is_taken_up wrong_words_are_refused
