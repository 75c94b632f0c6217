# TEST full memory program seconds=40 needs=flesh
# test_command_fit.sh: `flesh fit`: known parameters and errors are found; bounds, undetermined parameters, kills, bad specs.
# FLESH names the program.
set -u
. "$(dirname -- "$0")/../shared/command.sh"
data=$source_folder/../data

"$flesh" mesh box --cells 2,2,2 --size 1,1,1 --out cube.mesh >/dev/null || exit 1
cat >pull.yaml <<'END'
body:
  mesh: cube.mesh
  density: 1000
  material: {energy: S, young: 1e5, poisson: 0.4}
effects:
  - pin: {box: [[-1, -1, -1], [2, 2, 1e-9]]}
  - traction: {box: [[-1, -1, 0.999], [2, 2, 2]], traction: [0, 0, 1e4]}
time: {method: static, step: 1, end: 1}
output:
  frame_interval: 0
  probes:
    - {name: top, box: [[-1, -1, 0.999], [2, 2, 2]], quantities: [position]}
    - {name: side, point: [1, 0.5, 0.5], quantities: [position]}
END
sed 's/\[0, 0, 1e4\]/[0, 4e3, 0]/' pull.yaml >shear.yaml

# measure SCENE NAME NOISE SEED [SET...]: writes probes at the end of a run to NAME.csv, nodes' positions to NAME_shape.csv.
measure() {
  scene=$1 name=$2 noise=$3 seed=$4
  shift 4
  "$flesh" run "$scene" --out "of_$name" --set solver.newton_tolerance=1e-9 "$@" --quiet || return 1
  python3 - "$name" "$noise" "$seed" <<'END'
import csv, random, sys
name, noise, seed = sys.argv[1], float(sys.argv[2]), sys.argv[3]
random.seed(seed)
with open(f"of_{name}/probes.csv") as file:
    rows = list(csv.reader(file))
with open(f"{name}.csv", "w") as file:
    print(",".join(rows[0]), file=file)
    print(",".join([rows[-1][0]] + [repr(float(x) + random.gauss(0, noise)) for x in rows[-1][1:]]), file=file)
with open(f"{name}_shape.csv", "w") as file:
    print("node,x [m],y [m],z [m]", file=file)
    for node, row in enumerate(line for line in open(f"of_{name}/state.txt") if line[0] != "#"):
        place = [float(x) + random.gauss(0, noise) for x in row.split()[:3]]
        print(node, *place, sep=",", file=file)
END
}
measure pull.yaml pulled 0 1 && measure shear.yaml sheared 0 2 && measure pull.yaml noisy 1e-3 3 || exit 1

# result FOLDER EXPRESSION: the Python expression of r, the folder's result.json, and p, its parameters by name, is true.
result() {
  python3 - "$1" "$2" <<'END'
import json, sys
r = json.load(open(sys.argv[1] + "/result.json"))
p = {one["name"]: one for one in r.get("parameters", [])}
if not eval(sys.argv[2]):
    print(json.dumps(r, indent=1)[:3000])
    sys.exit(1)
END
}

young='{key: body.material.young, start: 3e4, from: 1e3, to: 1e7, spacing: logarithmic}'
poisson='{key: body.material.poisson, start: 0.2, from: 0, to: 0.49}'
cat >two.yaml <<END
experiments:
  - name: pull
    scene: pull.yaml
    measured: [{probes: pulled.csv, columns: [top.position_z, side.position_x], deviation: 1e-4}]
  - name: shear
    scene: shear.yaml
    measured: [{positions: sheared_shape.csv, deviation: 1e-4}]
parameters: [$young, $poisson]
END

constants_come_back_without_noise() {
  expect 0 "$flesh" fit two.yaml --out two || return 1
  result two 'abs(p["young"]["value"] / 1e5 - 1) < 1e-5 and abs(p["poisson"]["value"] - 0.4) < 1e-5' &&
    result two 'r["status"] == "complete" and r["residuals"]["degrees_of_freedom"] == r["residuals"]["measured_numbers"] - 2' &&
    result two 'r["identifiability"][0] == "All parameters are determined." and r["program"]["arguments"][1] == "two.yaml"' &&
    result two 'len(r["experiments"]) == 2 and r["experiments"][0]["inputs"]["files"][0]["path"].endswith("pull.yaml")' &&
    has two/fit.csv '^pull,pulled.csv,1,top.position_z,m,1,' && expect 0 "$flesh" plot two --x value --y fitted --out two.svg || return 1
  expect 0 "$flesh" run two/scenes/pull.yaml --out again --quiet &&
    python3 -c "
import csv
a = list(csv.DictReader(open('again/probes.csv')))[-1]; b = list(csv.DictReader(open('pulled.csv')))[0]
assert abs(float(a['top.position_z [m]']) - float(b['top.position_z [m]'])) < 1e-6, (a, b)"
}

# A measurement at the time of the start is compared with the equilibrium, not with the start, whose row stands before it.
an_equilibrium_at_the_start_counts() {
  sed 's/^time: .*/time: {method: static}/' pull.yaml >still.yaml
  sed 's/^1,/0,/' pulled.csv >still.csv
  sed 's/pull.yaml/still.yaml/; s/pulled.csv/still.csv/; /shear/,/sheared/d' two.yaml >at_start.yaml
  expect 0 "$flesh" fit at_start.yaml --out at_start || return 1
  result at_start 'abs(p["young"]["value"] / 1e5 - 1) < 1e-5 and abs(p["poisson"]["value"] - 0.4) < 1e-5'
}

# Where errors choose the steps, a fit sets no newton_tolerance, which would not be used.
a_fit_sets_what_is_used() {
  sed 's/^effects:/&\n  - inertia: {}/; s|^time.*|time: {method: adaptive, tolerance: 1e-3, step: 1/20, end: 1/20}|' pull.yaml >swing.yaml
  expect 0 "$flesh" run swing.yaml --out swing --quiet || return 1
  cat >swings.yaml <<'END'
experiments: [{name: swing, scene: swing.yaml, measured: [{probes: swing/probes.csv, deviation: 1e-5}]}]
parameters: [{key: body.material.young, start: 9e4}]
END
  expect 0 "$flesh" fit swings.yaml --out swings --quiet || return 1
  result swings/runs/swing '"newton_tolerance" not in (r["warning"] or "")'
}

# Covariance, intervals and correlation are those of a linear model that is computed here, from differences of runs.
errors_are_those_of_the_linear_model() {
  sed "s/pulled.csv, columns: .*/noisy.csv, deviation: 2e-3}, {positions: noisy_shape.csv, deviation: 2e-3}]/; /shear/,/sheared/d" two.yaml >noisy.yaml
  expect 0 "$flesh" fit noisy.yaml --out noisy || return 1
  python3 - "$flesh" <<'END'
import csv, json, math, subprocess, sys
import numpy as np
from scipy import stats
r = json.load(open("noisy/result.json"))
p = np.array([one["value"] for one in r["parameters"]])
rows = list(csv.DictReader(open("noisy/fit.csv")))
def values(young, poisson):
    subprocess.run([sys.argv[1], "run", "pull.yaml", "--out", "own", "--quiet", "--set", f"body.material.young={float(young)!r}",
                    "--set", f"body.material.poisson={float(poisson)!r}", "--set", "solver.newton_tolerance=1e-10"], check=True)
    last = list(csv.DictReader(open("own/probes.csv")))[-1]
    state = [[float(x) for x in line.split()[:3]] for line in open("own/state.txt") if line[0] != "#"]
    return np.array([state[int(row["row"]) - 1]["xyz".index(row["quantity"])] if len(row["quantity"]) == 1
                     else float(last[row["quantity"] + " [m]"]) for row in rows])
steps = p * 2e-3
J = np.array([(values(*(p + d)) - values(*(p - d))) / (2 * h) for d, h in zip(np.diag(steps), steps)]).T / 2e-3
f = values(*p)
residual = (f - np.array([float(row["value"]) for row in rows])) / 2e-3
assert np.allclose(f, [float(row["fitted"]) for row in rows], atol=1e-8)
freedom = len(rows) - 2
scale = math.sqrt(residual @ residual / freedom)
C = scale**2 * np.linalg.inv(J.T @ J)
assert np.allclose(r["covariance"], C, rtol=1e-3), (r["covariance"], C)
assert 0.3 < scale < 0.7 and abs(r["residuals"]["scale"] / scale - 1) < 1e-4  # the noise is 1e-3, not 2e-3
assert any("times the stated deviations" in s for s in r["identifiability"])
t = stats.t.ppf(0.975, freedom)
q = r["parameters"]
assert abs(q[1]["high_95"] - (p[1] + t * math.sqrt(C[1, 1]))) < 1e-4
assert abs(math.log(q[0]["high_95"] / p[0]) * p[0] / (t * math.sqrt(C[0, 0])) - 1) < 1e-3
assert abs(r["correlation"][0][1] - C[0, 1] / math.sqrt(C[0, 0] * C[1, 1])) < 1e-3
assert abs(J.T @ residual @ np.linalg.solve(J.T @ J, J.T @ residual)) < 1e-3 * scale**2  # the least squares are found
END
}

bounds_hold() {
  sed 's/to: 0.49/to: 0.35/' two.yaml >bound.yaml
  expect 0 "$flesh" fit bound.yaml --out bound || return 1
  result bound 'p["poisson"]["value"] == 0.35 and p["poisson"]["at_bound"] == "upper" and p["poisson"]["standard_error"] is None' &&
    result bound '"poisson stays at its upper bound" in r["identifiability"][0] and p["young"]["standard_error"] > 0' &&
    sed 's/start: 0.2, from: 0, to: 0.49/start: 0, from: 0, to: 0.49/' two.yaml >lower.yaml &&
    expect 0 "$flesh" fit lower.yaml --out lower &&
    result lower 'abs(p["poisson"]["value"] - 0.4) < 1e-5 and p["poisson"]["at_bound"] is None'
}

# Parameters that are not determined are reported: density and acceleration, of which only the product counts, and the
# pressure of an effect that does not act.
not_determined_is_said() {
  cat >hang.yaml <<END
body: {mesh: cube.mesh, density: 1000, material: {energy: S, young: 1e5, poisson: 0.4}}
effects:
  - gravity: {acceleration: [0, 0, -5]}
  - pin: {box: [[-1, -1, 0.999], [2, 2, 2]]}
  - pressure: {box: [[-1, -1, -1], [2, 2, 1e-9]], pressure: 100, from: 5}
time: {method: static, step: 1, end: 1}
output: {probes: [{name: low, point: [0.5, 0.5, 0]}]}
END
  measure hang.yaml hung 0 5 || return 1
  cat >product.yaml <<END
experiments: [{name: hang, scene: hang.yaml, measured: [{positions: hung_shape.csv, deviation: 1e-4}]}]
parameters:
  - {key: body.density, start: 800, spacing: logarithmic}
  - {key: "effects.gravity.acceleration[2]", name: g, start: -4}
  - {key: body.material.poisson, start: 0.3, from: 0, to: 0.49}
  - {key: effects.pressure.pressure, start: 120}
END
  expect 0 "$flesh" fit product.yaml --out product || return 1
  result product '"density and g are not determined apart: the measured numbers depend on their product alone." in r["identifiability"]' &&
    result product '"pressure is not determined: it changes none of the measured numbers." in r["identifiability"]' &&
    result product 'p["density"]["standard_error"] is None and p["g"]["low_95"] is None and abs(p["poisson"]["value"] - .4) < 1e-4' &&
    result product 'abs(p["density"]["value"] * p["g"]["value"] / -5000 - 1) < 1e-4 and p["poisson"]["standard_error"] > 0' || return 1
  # Only the ratio of Young's modulus and the load counts.
  cat >ratio.yaml <<END
experiments: [{name: hang, scene: hang.yaml, measured: [{positions: hung_shape.csv, weight: 1e8}]}]
parameters:
  - {key: body.density, start: 800, spacing: logarithmic}
  - {key: body.material.young, start: 1.2e5, spacing: logarithmic}
END
  expect 0 "$flesh" fit ratio.yaml --out ratio && has stdout.txt 'depend on their ratio alone'
}

# ended FOLDER: prints how many completed runs and derivatives the folder's database has.
ended() {
  python3 -c 'import sqlite3, sys
try: print(sqlite3.connect(f"file:{sys.argv[1]}/fit.db?mode=ro", uri=True).execute("SELECT count(*) FROM cases WHERE result IS NOT NULL").fetchone()[0])
except sqlite3.Error: print(0)' "$1"
}

# A fit that is killed again and again ends with the same bits and runs nothing twice.
a_killed_fit_resumes() {
  expect 0 "$flesh" fit two.yaml --out whole --quiet || return 1
  times=0
  while [ "$times" -lt 200 ]; do
    times=$((times + 1))
    before=$(ended killed)
    "$flesh" fit two.yaml --out killed --resume --quiet &
    process=$!
    # Waits until the fit has recorded one more run or has ended.
    while kill -0 $process 2>/dev/null && [ "$(ended killed)" -le "$before" ]; do sleep 0.01; done
    kill -9 $process 2>/dev/null
    wait $process 2>/dev/null && break
  done
  echo "killed $((times - 1)) times"
  [ "$times" -gt 3 ] && [ "$(ended killed)" -eq "$(ended whole)" ] || return 1
  python3 - <<'END'
import json
a, b = (json.load(open(f + "/result.json")) for f in ("whole", "killed"))
for key in ("parameters", "covariance", "residuals", "iterations"):
    assert a[key] == b[key], key
assert b["runs"]["used"] == a["runs"]["used"] and b["runs"]["made_now"] < a["runs"]["made_now"]
END
  cmp whole/fit.csv killed/fit.csv || return 1
  expect 2 "$flesh" fit two.yaml --out killed && has stderr.txt '^flesh fit: killed/fit.db: is there already; --resume goes on' || return 1
  sed 's/columns: .*side.position_x\]/columns: [top.position_z]/' two.yaml >other.yaml
  expect 2 "$flesh" fit other.yaml --out killed --resume && has stderr.txt 'is of another fit: scenes, measurements or keys have changed' || return 1
  # With other starts, bounds or deviations a fit resumes with the same runs.
  sed 's/deviation: 1e-4/deviation: 2e-4/' two.yaml >wider.yaml
  expect 0 "$flesh" fit wider.yaml --out killed --resume && result killed 'r["runs"]["made_now"] == 0' || return 1
  python3 -c 'import sqlite3
with sqlite3.connect("killed/fit.db") as store: store.execute("UPDATE cases SET result = \"{}\" WHERE id = 3")'
  expect 3 "$flesh" fit two.yaml --out killed --resume && has stderr.txt 'killed/fit.db: the record of a case is not whole'
}

an_interrupted_fit_says_so() {
  # Derivatives by differences on finer meshes take many long runs, which can be interrupted.
  sed 's/^    measured/    derivatives: differences\n    set: {body.refine: 2}\n&/' two.yaml >slow.yaml
  "$flesh" fit slow.yaml --out stopped --quiet 2>stderr.txt &
  process=$!
  at_least() { [ "$(ended stopped)" -ge 2 ]; }
  wait_until $process at_least || return 1
  kill -TERM $process
  wait $process
  [ $? -eq 143 ] && result stopped 'r["status"] == "interrupted" and r["exit_code"] == 143' || return 1
  expect 0 "$flesh" fit slow.yaml --out stopped --resume && result stopped 'r["status"] == "complete"'
}

a_run_that_fails_cuts_the_step() {
  # As displacements are proportional to 1/E, the first step from far above would lead below 0.
  sed 's/start: 3e4.*logarithmic/start: 3e5/; s/, {key: body.material.poisson.*}\]/]/' two.yaml >cut.yaml
  expect 0 "$flesh" fit cut.yaml --out cut &&
    result cut 'r["runs"]["failed"] > 0 and abs(p["young"]["value"] / 1e5 - 1) < 1e-5' || return 1
  sed '0,/scene: pull.yaml/s//&\n    set: {solver.max_newton: 1, solver.max_cutbacks: 1}/' two.yaml >fails.yaml
  expect 4 "$flesh" fit fails.yaml --out fails && has stderr.txt 'the start cannot be run: the experiment pull' &&
    result fails 'r["status"] == "failed" and r["exit_code"] == 4' || return 1
  sed 's/deviation: 1e-4/deviation: 1e-300/' two.yaml >tiny.yaml
  expect 7 "$flesh" fit tiny.yaml --out tiny && has stderr.txt 'start is not finite: deviations are far too small' || return 1
  sed 's/^parameters/max_iterations: 1\nparameters/' two.yaml >short.yaml
  expect 4 "$flesh" fit short.yaml --out short && has stderr.txt 'has not ended after 1 iterations' &&
    result short 'r["status"] == "failed" and p["young"]["value"] > 3e4' || return 1
}

# bad WORDS SED...: two.yaml, changed by sed, is refused with one line that has WORDS.
bad() {
  words=$1
  shift
  sed "$@" two.yaml >bad.yaml
  expect 2 "$flesh" fit bad.yaml --out bad || return 1
  [ "$(lines stderr.txt)" -eq 1 ] && has stderr.txt "$words" && [ ! -e bad ]
}
bad_specs_are_refused() {
  bad 'bad.yaml:8:[0-9]*: body.material.youngs is unknown; did you mean young' 's/material.young/material.youngs/' &&
    bad 'bad.yaml:8:[0-9]*: .*starts is unknown; did you mean start' 's/start: 3e4/starts: 3e4/' &&
    bad 'bad.yaml:8:.*start is 30000; it must lie from 100000 to 1e+07' 's/from: 1e3/from: 1e5/' &&
    bad 'to is 500; it must be above from, which is 1000' 's/to: 1e7/to: 500/' &&
    bad 'from is -1; it must be > 0 when spacing is logarithmic' 's/from: 1e3/from: -1/' &&
    bad 'poisson is 0.7; it must be a number in (-1, 0.5]' 's/to: 0.49/to: 0.7/' &&
    bad 'scale applies to linear parameters' 's/start: 3e4/start: 3e4, scale: 2/' &&
    bad 'start is 0; it must be > 0 when spacing' 's/start: 3e4, from: 1e3/start: 0/' &&
    bad 'two parameters are named young' 's/poisson, start/poisson, name: young, start/' &&
    bad 'body.material.young is fitted twice' 's/material.poisson, start: 0.2, from: 0, to: 0.49/material.young, start: 1e4/' &&
    bad 'name is a-b; it must be of letters' 's/poisson, start/poisson, name: a-b, start/' &&
    bad 'experiments has pall; it must be the name of an experiment, as pull' 's/start: 3e4/start: 3e4, experiments: [pall]/' &&
    bad 'two experiments are named pull' 's/name: shear/name: pull/' &&
    bad 'bad.yaml:7:.*weight stands beside deviation' '7s/deviation: 1e-4/deviation: 1e-4, weight: 2/' &&
    bad 'bad.yaml:7:.*deviation is missing; .* must have the column x_deviation' '7s/, deviation: 1e-4//' &&
    bad 'deviation is 0; it must be a number > 0' '7s/deviation: 1e-4/deviation: 0/' &&
    bad 'has no column top.position_w; did you mean' 's/top.position_z/top.position_w/' &&
    bad 'column top.position_z stands twice; it must stand once' 's/top.position_z/top.position_z, top.position_z/' &&
    bad 'either probes, history or positions' '7s/positions: /probes: a.csv, positions: /' &&
    bad 'column side.position_x is none of probes.csv, which has top.position_x' 's/pull.yaml/hang_only.yaml/' &&
    bad 'bad.yaml:8:[0-9]*: solver.max_newton takes whole numbers only; a parameter must take any number' 's/body.material.poisson, start: 0.2, from: 0, to: 0.49/solver.max_newton, start: 3/' &&
    bad '^flesh fit: bad.yaml:4:25: body.density is -1' '4s/^/    set: {body.density: -1}\n/' &&
    bad 'max_iterations is 0; it must be a whole number > 0' 's/^parameters/max_iterations: 0\nparameters/' &&
    bad 'parameters are 0' 's/^parameters.*/parameters: []/' &&
    bad 'experiments is \[\]' -e '2,7d' -e 's/^experiments:/experiments: []/' &&
    bad 'bad.yaml:1:1: the spec is empty' d || return 1
  expect 3 "$flesh" fit no_such.yaml && has stderr.txt no_such.yaml || return 1
  sed 's/scene: pull/scene: no_such/' two.yaml >bad.yaml
  expect 3 "$flesh" fit bad.yaml --out bad && has stderr.txt '^flesh fit: bad.yaml:3:12: .*no_such.yaml' || return 1
  sed 's/pulled.csv/no_such.csv/' two.yaml >bad.yaml
  expect 3 "$flesh" fit bad.yaml --out bad && has stderr.txt '^flesh fit: bad.yaml:4:25: .*no_such.csv' || return 1
  table 'rows 1 and 3 both have top.position_z at t = 1 s; it must have one number at a time' 't [s],top.position_z' '1,1' \
    '0.5,1' '1,2' &&
    table 'row 1, column top.position_z is high; it must be a number' 't [s],top.position_z' '1,high' &&
    table 't is 3 s; it must be a time of the run, which goes from 0 to 1 s' 't [s],top.position_z' '3,1' &&
    table 'has 2 rows and no column t' 'top.position_z' '1' '2' &&
    table 'has no measured number' 't [s],top.position_z' '1,' &&
    table 'row 1, column top.position_z is nan; it must be a number, or empty' 't [s],top.position_z' '1,nan' &&
    table 'column t is in ms; it must be in s' 't [ms],top.position_z' '1,1' &&
    table 'column top.position_z_deviation is in mm; it must be in m' 't [s],top.position_z [m],top.position_z_deviation [mm]' '1,1,1' &&
    table 'a deviation must be > 0' 't [s],top.position_z,top.position_z_deviation' '1,1,-1' &&
    table 'column top.position_z is in cm; it must be in m' 't [s],top.position_z [cm]' '1,1' || return 1
  shape 'node is 27; it must be a whole number from 0 to 26' 'node,x' '27,0' &&
    shape 'has no column node, nor X, Y and Z' 'x,y' '0,0' && shape 'has the column w; positions have' 'node,w' '0,0' &&
    shape 'the point \[5, 0, 0\] is outside of the body at rest, by more than 0.125 m' 'X,Y,Z,x' '5,0,0,0'
}

# Measured points on the surface of a finer mesh, up to 2 mm outside of the coarse mesh, give the same stiffness within 10 %.
points_of_another_mesh_count() {
  for mesh in limb limb_coarse; do
    cat >$mesh.yaml <<END
body: {mesh: $data/meshes/$mesh.msh, element: tet10-mean, density: 1000, material: {energy: S, young: 5e4, poisson: 0.4}}
effects:
  - pin: {box: [[-1, -1, -1], [0.03, 1, 1]]}
  - force: {box: [[0.27, -1, -1], [1, 1, 1]], force: [2, 0, 0]}
time: {method: static, step: 1, end: 1}
output: {frame_interval: 0}
END
  done
  expect 0 "$flesh" run limb.yaml --out limb --quiet --no-frames &&
    expect 0 "$flesh" mesh convert "$data/meshes/limb.msh" limb.mesh || return 1
  python3 - <<'END' || return 1
lines = open("limb.mesh").read().split("\n")
at = lines.index("Vertices") + 2
X = [line.split()[:3] for line in lines[at:at + int(lines[at - 1])]]
x = [line.split()[:3] for line in open("limb/state.txt") if line[0] != "#"]
with open("limb.csv", "w") as file:
    print("X,Y,Z,x,y,z", *(",".join(a + b) for a, b in zip(X, x) if 0.04 < float(a[0]) < 0.26), sep="\n", file=file)
END
  cat >limb_fit.yaml <<'END'
experiments: [{name: pull, scene: limb_coarse.yaml, measured: [{positions: limb.csv, deviation: 1e-4}]}]
parameters: [{key: body.material.young, start: 3e4}]
END
  expect 0 "$flesh" fit limb_fit.yaml --out limb_fit --quiet || return 1
  python3 - <<'END'
import json
value = json.load(open("limb_fit/result.json"))["parameters"][0]["value"]
print("# young", value)
assert 4.5e4 < value < 5.5e4, value
END
}

# table WORDS LINE...: these lines are refused as the first experiment's measurements; shape: as the second's.
table() {
  words=$1
  shift
  printf '%s\n' "$@" >bad.csv
  bad "$words" 's/pulled.csv, columns: .*position_x\], deviation: 1e-4/bad.csv'"$(case $1 in *_deviation) ;; *) echo ', deviation: 1' ;; esac)/"
}
shape() {
  words=$1
  shift
  printf '%s\n' "$@" >bad.csv
  bad "$words" 's/sheared_shape.csv/bad.csv/'
}
sed '/name: side/d' pull.yaml >hang_only.yaml

# Measurements may be at points of the body at rest, between the run's times, of columns of the history, and have columns of
# deviations.
measurements_of_all_kinds_count() {
  sed 's/^time.*/time: {method: static, step: 1\/4, end: 1}/; s/traction: \[0, 0, 1e4\]/&, amplitude: [{time: 0, value: 0}, {time: 1, value: 1}]/' pull.yaml >slow.yaml
  "$flesh" run slow.yaml --out slow --quiet --set solver.newton_tolerance=1e-9 || return 1
  python3 - <<'END' || return 1
import csv
rows = list(csv.DictReader(open("slow/probes.csv"))); history = list(csv.DictReader(open("slow/history.csv")))
z = [float(row["top.position_z [m]"]) for row in rows]
state = [[float(x) for x in line.split()[:3]] for line in open("slow/state.txt") if line[0] != "#"]
with open("between.csv", "w") as file:
    print("t [s],top.position_z [m],top.position_z_deviation [m]", file=file)
    print(0.375, (z[1] + z[2]) / 2, 1e-4, sep=",", file=file)
    print(1, z[4], 1e-4, sep=",", file=file)
    print(0.5, "", 1e-4, sep=",", file=file)
with open("energy.csv", "w") as file:
    print("energy_elasticity\n" + history[-1]["energy_elasticity"], file=file)
with open("points.csv", "w") as file:  # the middle of the edge between the nodes 26 (1, 1, 1) and 25 (1/2, 1, 1)
    print("X,Y,Z,x,y", file=file)
    print(0.75, 1, 1, *((a + b) / 2 for a, b in zip(state[26][:2], state[25][:2])), sep=",", file=file)
END
  cat >kinds.yaml <<END
experiments:
  - {name: slow, scene: slow.yaml, measured: [{probes: between.csv}, {history: energy.csv, weight: 1}, {positions: points.csv, deviation: 1e-4}]}
parameters: [$young, $poisson]
END
  expect 0 "$flesh" fit kinds.yaml --out kinds || return 1
  result kinds 'r["residuals"]["measured_numbers"] == 5 and abs(p["young"]["value"] / 1e5 - 1) < 1e-4 and abs(p["poisson"]["value"] - 0.4) < 1e-4'
}

# Tangents are the derivatives of runs: the same fit by differences, which friction makes necessary, gives the same.
tangents_are_derivatives() {
  expect 0 "$flesh" fit two.yaml --out two --resume && result two 'all(e["derivatives"] == "by tangents" for e in r["experiments"])' &&
    result two 'r["runs"]["used"] == 2 * (1 + r["iterations"])' || return 1
  sed 's/scene: pull.yaml/&\n    set: {effects.contact: {plane: {point: [0, 0, -9]}, friction: 0.1}}/; s/scene: shear.yaml/&\n    set: {effects.contact: {plane: {point: [0, 0, -9]}, friction: 0.1}}/' two.yaml >differences.yaml
  expect 0 "$flesh" fit differences.yaml --out differences &&
    has stdout.txt '^derivatives of pull are by differences: friction makes' || return 1
  python3 - <<'END'
import json
a, b = (json.load(open(f + "/result.json")) for f in ("two", "differences"))
for one, other in zip(a["parameters"], b["parameters"]):
    assert abs(one["value"] / other["value"] - 1) < 1e-6
C, D = ([[x / r["residuals"]["scale"]**2 for x in row] for row in r["covariance"]] for r in (a, b))
assert all(abs(x / y - 1) < 1e-4 for row, other in zip(C, D) for x, y in zip(row, other)), (C, D)
END
}

# Tangents are exact near a Poisson's ratio of 1/2, where wide differences are not. With one measured number, the error is its
# deviation over the derivative.
tangents_are_exact_near_incompressibility() {
  measure pull.yaml stiff 0 1 --set body.material.poisson=0.498 || return 1
  cat >stiff.yaml <<END
experiments: [{name: pull, scene: pull.yaml, measured: [{probes: stiff.csv, columns: [side.position_x], deviation: 1e-6}]}]
parameters: [{key: body.material.poisson, start: 0.497, from: 0, to: 0.49999}]
END
  expect 0 "$flesh" fit stiff.yaml --out stiff || return 1
  for poisson in 0.49799 0.49801; do
    "$flesh" run pull.yaml --out "at_$poisson" --quiet --set solver.newton_tolerance=1e-10 --set body.material.poisson=$poisson || return 1
  done
  python3 - <<'END'
import csv, json
x = [float(list(csv.DictReader(open(f"at_{p}/probes.csv")))[-1]["side.position_x [m]"]) for p in ("0.49799", "0.49801")]
error = json.load(open("stiff/result.json"))["parameters"][0]["standard_error"]
print("# error", error, 1e-6 * 2e-5 / abs(x[1] - x[0]))
assert abs(error * abs(x[1] - x[0]) / 2e-11 - 1) < 1e-3
END
}

# A map of 25 parameters takes at most 30 equilibria; the true values are comments in the spec's rows.
many_parameters_take_few_equilibria() {
  expect 0 "$flesh" fit "$data/fits/stiffness.yaml" --out map || return 1
  result map 'len(p) == 25 and r["runs"]["used"] <= 30 and r["residuals"]["degrees_of_freedom"] == 1427' || return 1
  python3 - "$data/fits/stiffness.yaml" <<'END'
import json, re, sys
true = [float(x) for x in re.findall(r"# (\d+)$", open(sys.argv[1]).read(), re.M)]
p = json.load(open("map/result.json"))["parameters"]
assert len(true) == 25 and all(abs(one["value"] / x - 1) < 0.06 for one, x in zip(p, true))
assert sum(one["low_95"] < x < one["high_95"] for one, x in zip(p, true)) >= 22
END
}

# The fits in data/fits find the values with which their measurements were made.
worked_examples_find_the_truth() {
  for name in slide muscles; do
    expect 0 "$flesh" fit "$data/fits/$name.yaml" --out "$name" || return 1
  done
  result slide 'p["friction"]["low_95"] < 0.35 < p["friction"]["high_95"] and p["friction"]["standard_error"] < 0.005' &&
    result muscles 'all(p[n]["at_bound"] or p[n]["low_95"] < a < p[n]["high_95"] for n, a in zip(p, (0.3, 0.1, 0, 0.15)))' || return 1
  # Tangents of a motion with friction, and of its start, agree with differences of runs.
  sed "s,scene: ,&$data/fits/,; s,probes: ,&$data/fits/,; s/^    measured/    derivatives: differences\n&/" "$data/fits/slide.yaml" >slid.yaml
  expect 0 "$flesh" fit slid.yaml --out slid && has stdout.txt 'derivatives of slide are by differences: the spec asks for them' || return 1
  result slide 'r["runs"]["used"] == 2 * (1 + r["iterations"]) and r["experiments"][0]["derivatives"] == "by tangents"' &&
    result slid 'r["runs"]["used"] == 20' && python3 - <<'END' || return 1
import json
a, b = (json.load(open(f + "/result.json")) for f in ("slide", "slid"))
assert all(abs(x["value"] / y["value"] - 1) < 1e-6 for x, y in zip(a["parameters"], b["parameters"]))
assert all(abs(x / y - 1) < 1e-4 for row, other in zip(a["covariance"], b["covariance"]) for x, y in zip(row, other))
END
  command -v gnuplot >/dev/null || return 0
  [ "$(wc -c <slide/fit.png)" -gt 5000 ]
}

# If residuals exceed the deviations, the minimum may not be the best one, and no parameter is called determined.
what_does_not_fit_is_not_called_determined() {
  sed "s/pulled.csv, columns: .*/noisy.csv, deviation: 1e-5}, {positions: noisy_shape.csv, deviation: 1e-5}]/; /shear/,/sheared/d" two.yaml >unfit.yaml
  expect 0 "$flesh" fit unfit.yaml --out unfit || return 1
  result unfit 'not any("determined" in s for s in r["identifiability"])' &&
    result unfit 'any("times the stated" in s and "another start" in s for s in r["identifiability"])'
}

run_tests constants_come_back_without_noise an_equilibrium_at_the_start_counts a_fit_sets_what_is_used errors_are_those_of_the_linear_model what_does_not_fit_is_not_called_determined bounds_hold not_determined_is_said \
  a_killed_fit_resumes an_interrupted_fit_says_so a_run_that_fails_cuts_the_step bad_specs_are_refused \
  measurements_of_all_kinds_count points_of_another_mesh_count \
  tangents_are_derivatives tangents_are_exact_near_incompressibility many_parameters_take_few_equilibria ${long:+worked_examples_find_the_truth}
