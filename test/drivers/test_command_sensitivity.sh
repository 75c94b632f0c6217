# TEST quick memory program seconds=40 needs=flesh
# test_command_sensitivity.sh: `flesh sensitivity`: derivatives against the body's weight and differences of runs, and refusals.
# FLESH names the program.
set -u
. "$(dirname -- "$0")/../shared/command.sh"

"$flesh" mesh box --cells 4,1,1 --size 4,1,1 --out bar.mesh >/dev/null || exit 1
cat >bar.yaml <<'END'
body:
  mesh: bar.mesh
  density: 1000
  material: {energy: S, young: 1e6, poisson: 0.4}
effects:
  - inertia: {}
  - gravity: {acceleration: [0, 0, -10]}
  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}
time: {method: static, step: 1, end: 1}
output:
  frame_interval: 0
  probes:
    - {name: tip, point: [4, 0.5, 0.5], quantities: [position, velocity]}
    - {name: inside, point: [1.3, 0.6, 0.4], quantities: [J, stress, energy]}
    - {name: half, box: [[1.9, -1, -1], [5, 2, 2]], quantities: [J, stretch, stress, energy]}
    - {name: end, box: [[3.9, -1, -1], [5, 2, 2]], quantities: [position]}
    - {name: wall, box: [[-1, -1, -1], [1e-9, 2, 2]], quantities: [reaction]}
END

# derivatives EXPRESSION: the Python expression of d, the derivatives of found.csv by column and key, is true.
derivatives() {
  python3 - "$1" <<'END'
import csv, sys
d = {(row["of"], row["to"]): float(row["derivative"]) for row in csv.DictReader(open("found.csv"))}
if not eval(sys.argv[1]):
    print(d)
    sys.exit(1)
END
}

the_wall_carries_the_weight() {
  expect 0 "$flesh" sensitivity bar.yaml --of wall.reaction_z --to 'body.density,effects.gravity.acceleration[2]' --out found.csv &&
    has stdout.txt '^wall.reaction_z = 40000 N at t = 1 s$' &&
    has stdout.txt '^  by body.density  *1000: 40; +400 N for 1 % more$' &&
    derivatives 'abs(d["wall.reaction_z", "body.density"] - 40) < 1e-6' &&
    derivatives 'abs(d["wall.reaction_z", "effects.gravity.acceleration[2]"] + 4000) < 1e-4' || return 1
  # So does a single pin, also of an incompressible body. What has no unit is told without one.
  expect 0 "$flesh" sensitivity bar.yaml --set body.element=tet10-mean --set body.material.poisson=0.5 \
    --set 'output.probes=[{name: pin, effect: pin, quantities: [reaction]}, {name: in, point: [1.3, 0.6, 0.4], quantities: [J]}]' \
    --of pin.reaction_z,in.J --to body.density --out found.csv && has stdout.txt '^in.J = [0-9.]* at t = 1 s$' &&
    derivatives 'abs(d["pin.reaction_z", "body.density"] - 40) < 1e-6'
}

# The derivative of the wall's reaction, 40000 N, by Young's modulus is 0 to rounding. KLU and PCG agree, though factors of
# stiff volume terms leave a larger residual than is asked for.
little_is_left_of_what_the_weight_holds() {
  expect 0 "$flesh" sensitivity bar.yaml --set body.element=tet10-mean --set body.material.poisson=0.499 --of wall.reaction_z \
    --to body.material.young --out found.csv && derivatives 'abs(d["wall.reaction_z", "body.material.young"]) < 6e-11' || return 1
  for solver in klu pcg; do
    expect 0 "$flesh" sensitivity bar.yaml --set body.element=tet10-mean --set body.material.poisson=0.49999 --of tip.position_z \
      --to body.density --set "solver.linear_solver=$solver" --out $solver.csv || return 1
  done
  sed 1d klu.csv >>pcg.csv && python3 -c "
import csv
pcg, klu = (float(row['derivative']) for row in csv.DictReader(open('pcg.csv')))
print(pcg, klu)
assert abs(klu / pcg - 1) < 1e-5"
}

# Derivatives are also by keys whose number the scene does not give.
keys_that_are_not_given_have_derivatives() {
  expect 0 "$flesh" sensitivity bar.yaml --set 'effects.gravity={}' --of wall.reaction_z --to 'effects.gravity.acceleration[2]' \
    --out found.csv && derivatives 'abs(d["wall.reaction_z", "effects.gravity.acceleration[2]"] + 4000) < 1e-4'
}

# agree METHOD COLUMNS STEP [SIZE]: derivatives agree to 1e-6 with fourth-order differences of runs, of relative SIZE (1e-3).
agree() {
  expect 0 "$flesh" sensitivity bar.yaml --set "time.method=$1" --set "time.step=$3" --of "$2" \
    --to body.material.young,body.material.poisson,body.density --out found.csv || return 1
  python3 - "$flesh" "$@" <<'END'
import csv, subprocess, sys
flesh, method, columns, step, size = *sys.argv[1:5], float((sys.argv[5:] or [1e-3])[0])
def run(key, value):
    subprocess.run([flesh, "run", "bar.yaml", "--out", "own", "--quiet", "--set", f"time.method={method}", "--set",
                    f"time.step={step}", "--set", "solver.newton_tolerance=1e-12", "--set", f"{key}={value!r}"], check=True)
    rows = [{name.split()[0]: text for name, text in row.items()} for row in csv.DictReader(open("own/probes.csv"))]
    last = rows[-1]
    values = {name.split()[0]: float(text) for name, text in last.items()}
    t = [float(row["t"]) for row in rows]
    for name in list(values):
        q = [float(row[name]) for row in rows]
        values[name + ".integral"] = sum((b - a) * (x + y) / 2 for a, b, x, y in zip(t, t[1:], q, q[1:]))
        values[name + ".mean"] = values[name + ".integral"] / (t[-1] - t[0] or 1)
    return values
found = list(csv.DictReader(open("found.csv")))
assert len(found) == 3 * len(columns.split(","))
for key, value in (("body.material.young", 1e6), ("body.material.poisson", 0.4), ("body.density", 1000.0)):
    a, b, c, d = (run(key, value * (1 + s * size)) for s in (-2, -1, 1, 2))
    for row in (row for row in found if row["to"] == key):
        by_runs = (a[row["of"]] - 8 * b[row["of"]] + 8 * c[row["of"]] - d[row["of"]]) / (12 * size * value)
        off = abs(float(row["derivative"]) / by_runs - 1)
        print(row["of"], key, row["derivative"], by_runs, off)
        assert off < 1e-6
END
}
equilibria_agree_with_differences() { agree static tip.position_z,end.position_z,tip.position_x 1; }
# Quantities of tets without J and stretches, whose derivatives are small beside their terms if a body bends unstretched.
tets=half.energy,half.stress_xx,half.stress_xz,inside.energy,inside.stress_xx
what_tets_have_agrees_with_differences() {
  agree static $tets,inside.stress_zz,half.J_mean,inside.J,half.stretch_1,half.stretch_3 1 && agree midpoint $tets,half.energy.integral,inside.stress_xx.mean 1/50 &&
    agree backward-euler $tets,half.energy.integral,inside.stress_xx.mean 1/50
}
motions_agree_with_differences() {
  agree newmark tip.position_z,end.position_z,tip.velocity_z,tip.position_z.integral,end.position_z.mean 1/50 &&
    python3 - <<'END'
import csv
rows = [{name.split()[0]: text for name, text in row.items()} for row in csv.DictReader(open("own/probes.csv"))]
mean = sum((float(a["end.position_z"]) + float(b["end.position_z"])) / 2 for a, b in zip(rows, rows[1:])) / (len(rows) - 1)
told = {row["of"]: row for row in csv.DictReader(open("found.csv"))}
found = float(told["end.position_z.mean"]["value"]) + 2 * float(told["end.position_z.mean"]["derivative"]) # the density is 1002
print(told, mean)
assert abs(found / mean - 1) < 1e-5 and told["tip.position_z.integral"]["unit"] == "m s"
END
}

# Derivatives of reactions, with lumped masses and with consistent ones (to which free accelerations add), and of contact
# forces with friction agree with differences.
forces_agree_with_differences() {
  agree midpoint wall.reaction_x,wall.reaction_z,wall.reaction_moment_y 1/50 || return 1
  cp bar.yaml kept.yaml
  sed -i -e 's|^time:|  - contact: {plane: {point: [0, 0, -0.04]}, friction: 0.3, thickness: 0.05, stiffness: 1e5}\ntime:|' \
    -e 's|density: 1000|&\n  mass: consistent|' bar.yaml
  echo '    - {name: ground, effect: "contact[0]", quantities: [contact_force]}' >>bar.yaml
  agree backward-euler wall.reaction_z,wall.reaction_moment_y,wall.reaction_x.mean,ground.contact_force_z,ground.contact_moment_y 1/50 1e-4 &&
    agree static wall.reaction_z,wall.reaction_moment_y,ground.contact_force_z 1 &&
    refused 'ground.contact_force_z: contact forces are of a time' --of ground.contact_force_z --to body.density --set time.method=midpoint
  status=$?
  mv kept.yaml bar.yaml
  return $status
}

# A bar's end slides on a ground that moves, in two steps, whose friction refers to the state before each.
equilibria_with_friction_agree_with_differences() {
  cp bar.yaml kept.yaml
  sed -i -e 's|^time: .*|  - contact: {plane: {point: [0, 0, -0.04]}, motion: [{time: 0}, {time: 4, translation: [2e-3, 4e-3, 0]}], friction: 0.4, thickness: 0.05, stiffness: 1e5}\ntime: {method: static, step: 1, end: 2}|' bar.yaml
  agree static tip.position_y,tip.position_z 1
  status=$?
  mv kept.yaml bar.yaml
  return $status
}

# refused SENTENCE OPTION...: these options are refused with the sentence, and no file is written.
refused() {
  sentence=$1
  shift
  expect 2 "$flesh" sensitivity bar.yaml "$@" --out left.csv && has stderr.txt "$sentence" && [ ! -e left.csv ]
}

bad_requests_are_refused() {
  by='--to body.density'
  # shellcheck disable=SC2086
  refused '^flesh sensitivity: --of is missing; it must be' $by && refused '--to is missing; it must be' --of tip.position_z &&
    refused 'top.position_z; it must be PROBE.COLUMN' --of top.position_z $by &&
    refused 'tip.velocity_z; a probe has no such column' --of tip.velocity_z $by &&
    refused 'tip.reaction_x; ' --of tip.reaction_x $by && refused 'wall.contact_force_x; ' --of wall.contact_force_x $by &&
    refused "'body.yung'; the scene has no such key" --of tip.position_z --to body.yung &&
    refused "'effects.gravity.acceleration\[3\]'; the scene has" --of tip.position_z --to 'effects.gravity.acceleration[3]' &&
    refused "'body.mesh'; this key is no number" --of tip.position_z --to body.mesh &&
    refused "'time.end'; derivatives are by keys of bodies, effects and the start" --of tip.position_z --to time.end &&
    refused 'tip.position_z.mean; means and integrals over time are of motions' --of tip.position_z.mean $by &&
    refused 'ida has no sensitivities' --of tip.position_z $by --set time.method=ida &&
    refused 'half.stress_xx; .* the pressure of incompressible tets' --of half.stress_xx $by --set body.element=tet10-mean \
      --set body.material.poisson=0.5 &&
    refused '--of has more than 64 columns' --of "$(yes tip.position_z | head -65 | tr '\n' ,)" $by || return 1
  cp bar.yaml kept.yaml
  # shellcheck disable=SC2086
  expect 2 "$flesh" sensitivity bar.yaml --of tip.position_z $by --out bar.yaml && has stderr.txt 'results would replace it' &&
    cmp bar.yaml kept.yaml && expect 3 "$flesh" sensitivity none.yaml --of tip.position_z $by
}

# Steps in which blocks that begin in each other ignore contact have no derivatives.
contact_that_is_ignored_is_refused() {
  refused 'before t = 0.02 s contact is still ignored between bodies that intersect at the start' --set 'bodies=[{name: on, mesh: bar.mesh, translation: [0.1, 0.2, 0.95]}]' \
    --set 'effects[3]={contact: {between: all, intersecting: separate}}' --set 'time={method: backward-euler, step: 0.02, end: 0.04}' \
    --of tip.position_z --to body.material.young
}

# Derivatives by a component that is far smaller than others of its vector, or than the body, are exact: here a clamp moves
# the whole body.
small_components_have_wide_differences() {
  expect 0 "$flesh" sensitivity bar.yaml --set effects.pin=null --of tip.position_y --to 'effects.prescribed_motion.motion[0].translation[1]' \
    --set 'effects[2]={prescribed_motion: {box: [[-1, -1, -1], [1e-9, 2, 2]], motion: [{time: 0, translation: [0.1, 1e-9, 0]}]}}' \
    --out found.csv && derivatives 'abs(d["tip.position_y", "effects.prescribed_motion.motion[0].translation[1]"] - 1) < 1e-6' &&
    expect 0 "$flesh" sensitivity bar.yaml --set effects.pin=null --of tip.position_y \
      --to 'effects.prescribed_motion.motion[0].translation[1]' \
      --set 'effects[2]={prescribed_motion: {box: [[-1, -1, -1], [1e-9, 2, 2]], motion: [{time: 0, translation: [0, 1e-9, 0]}]}}' \
      --out found.csv && derivatives 'abs(d["tip.position_y", "effects.prescribed_motion.motion[0].translation[1]"] - 1) < 1e-6'
}

# Derivatives by keys whose range ends near their value are those of small differences.
narrow_keys_have_small_differences() {
  expect 0 "$flesh" sensitivity bar.yaml --set body.element=tet10-mean --set body.material.poisson=0.4999 --of tip.position_z \
    --to body.material.poisson --out found.csv || return 1
  for ratio in 0.49988 0.49992; do
    "$flesh" run bar.yaml --out $ratio --quiet --set body.element=tet10-mean --set body.material.poisson=$ratio \
      --set solver.newton_tolerance=1e-11 || return 1
  done
  by_runs=$(tail -qn 1 0.49988/probes.csv 0.49992/probes.csv | awk -F, 'NR == 1 { z = $4 } NR == 2 { printf "%.9g", ($4 - z) / 4e-5 }')
  derivatives "abs(d['tip.position_z', 'body.material.poisson'] / $by_runs - 1) < 1e-3" || return 1
  for ratio in 0.4999965 0.4999975 0.499997; do
    expect 0 "$flesh" sensitivity bar.yaml --set body.element=tet10-mean --set body.material.poisson=$ratio --of tip.position_z \
      --to body.material.poisson --out found.csv || return 1
    mv found.csv $ratio.csv
  done
  python3 - <<'END'
import csv
above, below, own = ([float(row[name]) for name in ("value", "derivative")] for row in
                     (next(csv.DictReader(open(f"{ratio}.csv"))) for ratio in ("0.4999975", "0.4999965", "0.499997")))
by_values = (above[0] - below[0]) / 1e-6
print(own, by_values)
assert abs(own[1] / by_values - 1) < 5e-3
END
}

# Derivatives by a coordinate that is 0 use differences of the body's size, here millimetres, with gaps of hundredths.
places_have_differences_of_the_size_of_the_body() {
  "$flesh" mesh box --cells 4,1,1 --size 0.004,0.001,0.001 --origin 0,0,3e-5 --out small.mesh >/dev/null || return 1
  cat >small.yaml <<'END'
body: {mesh: small.mesh, density: 1000, material: {energy: S, young: 1e4, poisson: 0.4}}
effects:
  - pin: {box: [[-1, -1, -1], [1e-9, 1, 1]]}
  - contact: {plane: {point: [0, 0, 0]}}
  - traction: {box: [[0.00399, -1, -1], [1, 1, 1]], traction: [0, 0, -20]}
time: {method: static}
output: {probes: [{name: tip, point: [0.0039, 0.0005, 0.0005], quantities: [position]}]}
END
  expect 0 "$flesh" sensitivity small.yaml --of tip.position_z --to 'effects.contact.plane.point[2]' --out found.csv || return 1
  for place in -2e-7 2e-7; do
    "$flesh" run small.yaml --out at$place --quiet --set "effects.contact.plane.point[2]=$place" --set solver.newton_tolerance=1e-11 || return 1
  done
  by_runs=$(tail -qn 1 at-2e-7/probes.csv at2e-7/probes.csv | awk -F, 'NR == 1 { z = $4 } NR == 2 { printf "%.9g", ($4 - z) / 4e-7 }')
  derivatives "abs(d['tip.position_z', 'effects.contact.plane.point[2]'] / $by_runs - 1) < 1e-3"
}

# Derivatives by keys at an end of their range use differences within the range.
ends_of_ranges_have_differences() {
  muscle='effects[3]={muscle: {fibres: {direction: [1, 0, 0]}, peak_stress: 1e5, activation: [{time: 0, value: VALUE}]}}'
  key='effects.muscle.activation[0].value'
  for end in 0,1e-3,2e-3 1,0.999,0.998; do
    for value in $(echo $end | tr , ' '); do
      "$flesh" run bar.yaml --out "$value" --quiet --set "$(echo "$muscle" | sed "s/VALUE/$value/")" \
        --set solver.newton_tolerance=1e-11 || return 1
    done
    value=${end%%,*}
    expect 0 "$flesh" sensitivity bar.yaml --set "$(echo "$muscle" | sed "s/VALUE/$value/")" --of tip.position_x --to "$key" \
      --out found.csv || return 1
    by_runs=$(tail -qn 1 $(echo $end | sed 's|,|/probes.csv |g')/probes.csv |
      awk -F, -v from="$value" '{ x[NR] = $2 } END { printf "%.9g", (4 * x[2] - 3 * x[1] - x[3]) / (from < 0.5 ? 2e-3 : -2e-3) }')
    derivatives "abs(d['tip.position_x', '$key'] / $by_runs - 1) < 1e-4" || return 1
  done
  refused "'body.material.poisson', differences of which are refused" --of tip.position_z --to body.material.poisson \
    --set body.element=tet10-mean --set body.material.poisson=0.5
}

# Derivatives by the start, of bodies in free flight. A point's place stays when the start of its body is moved, and another
# part of the body comes there.
the_start_has_derivatives() {
  cat >flight.yaml <<'END'
body: {name: own, mesh: bar.mesh, density: 1000, material: {energy: S, young: 1e6, poisson: 0.4}}
bodies: [{name: other, mesh: bar.mesh, translation: [0, 0, 3], velocity: [0, 0, 1], density: 1000, material: {energy: S, young: 1e6, poisson: 0.4}}]
effects: [{inertia: {}}, {gravity: {}}]
time: {method: newmark, step: 1/50, end: 0.2}
start: {velocity: [0, 0, 0.5]}
output: {probes: [{name: own, body: own, quantities: [position]}, {name: other, body: other, quantities: [position, velocity]},
                  {name: place, point: [2, 0.5, 3.5], quantities: [position]}]}
END
  expect 0 "$flesh" sensitivity flight.yaml --of own.position_z,other.position_z,other.velocity_z,other.position_z.mean,place.position_z \
    --to 'start.velocity[2],bodies[0].velocity[2],bodies[0].translation[2]' --out found.csv &&
    derivatives 'all(abs(d[of + "_z" + over, key] - is_) < 1e-7 for of, over, key, is_ in [
      ("own.position", "", "start.velocity[2]", 0.2), ("own.position", "", "bodies[0].velocity[2]", 0),
      ("other.position", "", "bodies[0].velocity[2]", 0.2), ("other.velocity", "", "bodies[0].velocity[2]", 1),
      ("other.position", ".mean", "bodies[0].velocity[2]", 0.1), ("other.position", "", "bodies[0].translation[2]", 1),
      ("place.position", "", "bodies[0].translation[2]", 0), ("place.position", "", "bodies[0].velocity[2]", 0.2)])'
}

# Tets with nearly no stress are close to a kink of their clamped eigenvalues, the closer the stiffer their volumes are; the
# derivative is that of differences all the same.
damping_by_a_stiff_shape_agrees_with_differences() {
  cat >stiff.yaml <<END
body: {mesh: "$source_folder/../data/meshes/cube_3x3x3.mesh", element: tet10, density: 1000, material: {energy: B, young: 249150, poisson: 0.4999}}
effects:
  - inertia: {}
  - pin: {box: [[-1, -1, -1], [1e-9, 9, 9]]}
  - damping: {stiffness: 0.002849, stiffness_at: current, mass: 2}
  - contact: {sphere: {centre: [0.09, 0.05, 0.16], radius: 0.05}, friction: 0.2, thickness: 0.012, motion: [{time: 0}, {time: 1, translation: [0, 0, -0.3]}]}
time: {method: bdf2, step: 1/100, end: 1/25}
solver: {newton_tolerance: 1e-12}
output: {frame_interval: 0, probes: [{name: tip, point: [0.1, 0.05, 0.05], quantities: [position]}]}
END
  expect 0 "$flesh" sensitivity stiff.yaml --of tip.position_x --to body.material.young --out found.csv || return 1
  by_runs=0
  for at in 1:-2 -8:-1 8:1 -1:2; do
    "$flesh" run stiff.yaml --out stiff --quiet --set body.material.young="$(awk "BEGIN {print 249150 + ${at#*:} * 25}")" || return 1
    by_runs="$by_runs + ${at%:*} * $(tail -n 1 stiff/probes.csv | cut -d, -f2) / (12 * 25)"
  done
  derivatives "abs(d['tip.position_x', 'body.material.young'] / ($by_runs) - 1) < 3e-6"
}

run_tests damping_by_a_stiff_shape_agrees_with_differences the_wall_carries_the_weight little_is_left_of_what_the_weight_holds keys_that_are_not_given_have_derivatives the_start_has_derivatives \
  equilibria_agree_with_differences what_tets_have_agrees_with_differences forces_agree_with_differences motions_agree_with_differences equilibria_with_friction_agree_with_differences bad_requests_are_refused contact_that_is_ignored_is_refused \
  small_components_have_wide_differences places_have_differences_of_the_size_of_the_body narrow_keys_have_small_differences ends_of_ranges_have_differences
