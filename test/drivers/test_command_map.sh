# TEST quick memory program seconds=12 needs=flesh
# test_command_map.sh: `flesh fit` with a map: derivatives, deviations and the minimum against an independent computation, an
# inclusion that comes back from noisy positions, going on after a kill, bad specs. FLESH names the program.
set -u
. "$(dirname -- "$0")/../shared/command.sh"

# result FOLDER EXPRESSION: of r, its result.json.
result() {
  python3 -c 'import json, sys
r = json.load(open(sys.argv[1] + "/result.json"))
if not eval(sys.argv[2]): print(json.dumps(r, indent=1)[:3000]); sys.exit(1)' "$1" "$2"
}

cat >beam.yaml <<'END'
body:
  mesh: beam.mesh
  density: 1000
  material: {energy: S, young: 1e5, poisson: 0.4}
effects:
  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}
  - traction: {box: [[1.999, -1, -1], [3, 2, 2]], traction: [200, 0, 2e3], amplitude: [{time: 0, value: 0}, {time: 1, value: 1}]}
  - gravity: {acceleration: [0, 0, -1]}
time: {method: static, step: 1/2, end: 1}
output:
  frame_interval: 0
  probes:
    - {name: tip, point: [2, 0.5, 0.5], quantities: [position]}
    - {name: wall, box: [[-1, -1, -1], [1e-9, 2, 0.1]], quantities: [reaction]}
END

# The matrix of all derivatives by differences of runs, the penalty by the mesh: deviations, resolutions, and the minimum.
deviations_are_those_of_an_independent_matrix() {
  "$flesh" mesh box --cells 2,1,1 --size 2,1,1 --out beam.mesh >/dev/null || return 1
  python3 - <<'END' || return 1
print("t [s],tip.position_z [m],tip.position_x [m]\n0.7,0.56,2.01\n1,0.63,2.001", file=open("tip.csv", "w"))
print("t [s],wall.reaction_x [N]\n1,-2100", file=open("wall.csv", "w"))
print("X,Y,Z,x,z\n0.9,0.4,0.3,0.9,0.34\n1.9,0.1,0.8,1.885,0.9", file=open("places.csv", "w"))
END
  for penalty in quadratic variation; do
    cat >beam_fit.yaml <<END
experiments:
  - name: bend
    scene: beam.yaml
    measured: [{probes: tip.csv, deviation: 0.01}, {probes: wall.csv, deviation: 30}, {positions: places.csv, deviation: 0.02}]
map: {constant: young, start: 1e5, from: 1e3, to: 1e6, weight: 3, penalty: $penalty, edge: 0.1}
tolerance: 1e-6
END
    expect 0 "$flesh" fit beam_fit.yaml --out "beam_$penalty" || return 1
    python3 - "$flesh" "$penalty" <<'END' || return 1
import csv, json, os, subprocess, sys
import numpy as np
flesh, penalty = sys.argv[1:]
out = "beam_" + penalty
lines = open("beam.mesh").read().split("\n")
def section(name, columns, kind):
    at = lines.index(name) + 2
    return np.array([[kind(w) for w in l.split()[:columns]] for l in lines[at:at + int(lines[at - 1])]])
X, T = section("Vertices", 3, float), section("Tetrahedra", 4, int) - 1
rows = list(csv.DictReader(open(out + "/tets.csv")))
q = np.log([float(row["young [Pa]"]) for row in rows])
fit = list(csv.DictReader(open(out + "/fit.csv")))
deviation = np.array([float(row["deviation"]) for row in fit])
assert len(fit) == 9 and len(rows) == 12
def values(q):
    with open("own.csv", "w") as file:
        print("tet,young [Pa]\n" + "\n".join(f"{t},{float(p)!r}" for t, p in enumerate(np.exp(q))), file=file)
    subprocess.run([flesh, "run", "beam.yaml", "--out", "own", "--quiet", "--set", "body.material_map=own.csv", "--set",
                    "solver.newton_tolerance=1e-10"], check=True)
    probes = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(open("own/probes.csv"))]
    x = np.array([[float(w) for w in l.split()[:3]] for l in open("own/state.txt") if l[0] != "#"])
    def at(t, name):
        return np.interp(t, [p["t [s]"] for p in probes], [p[name] for p in probes])
    def place(P):
        for t in T:
            L = np.linalg.solve(np.vstack([X[t].T, np.ones(4)]), [*P, 1])
            if L.min() > -1e-9: return L @ x[t]
    a, b = place((0.9, 0.4, 0.3)), place((1.9, 0.1, 0.8))
    z, across = "tip.position_z [m]", "tip.position_x [m]"
    return np.array([at(.7, z), at(.7, across), at(1, z), at(1, across), at(1, "wall.reaction_x [N]"), a[0], a[2], b[0], b[2]])
f = values(q)
assert np.allclose(f, [float(row["fitted"]) for row in fit], rtol=1e-6), (f, fit)
h = 1e-4
J = np.array([(values(q + d) - values(q - d)) / (2 * h) for d in h * np.eye(12)]).T / deviation[:, None]
faces = {}
for t, nodes in enumerate(T):
    for o in range(4): faces.setdefault(tuple(sorted(np.delete(nodes, o))), []).append(t)
pairs = {face: two for face, two in faces.items() if len(two) == 2}
P, bend = np.zeros((len(pairs), 12)), np.zeros(len(pairs))
for k, (face, (a, b)) in enumerate(pairs.items()):
    u, v, w = X[list(face)]
    weight = 3 * np.linalg.norm(np.cross(v - u, w - u)) / 2 / np.linalg.norm(X[T[a]].mean(0) - X[T[b]].mean(0)) / 2 ** (1 / 3)
    d = q[a] - q[b]
    of = lambda d: d if penalty == "quadratic" else np.sign(d) * 0.1 * np.sqrt(2 * (np.sqrt(1 + (d / 0.1) ** 2) - 1))
    slope = 1 if penalty == "quadratic" else (of(d + 1e-5) - of(d - 1e-5)) / 2e-5
    P[k, a], P[k, b] = np.sqrt(weight) * slope, -np.sqrt(weight) * slope
    bend[k] = np.sqrt(weight) * of(d)
information = J.T @ J
H = information + P.T @ P
inverse = np.linalg.inv(H + 0.01 * np.eye(12))
assert np.allclose([float(row["deviation of q"]) for row in rows], np.sqrt(np.diag(inverse)), rtol=1e-3)
assert np.allclose([float(row["resolution"]) for row in rows], np.diag(inverse @ information), rtol=1e-3, atol=1e-5)
r = (f - [float(row["value"]) for row in fit]) / deviation
step = np.linalg.solve(H, J.T @ r + P.T @ bend)
print(penalty, "further step", np.abs(step).max(), "of", np.ptp(q), "residuals", r @ r)
assert np.abs(step).max() < 0.01 and np.ptp(q) > 0.05
result = json.load(open(out + "/result.json"))
assert abs(result["map"]["determined_numbers"] - np.trace(inverse @ information)) < 1e-2 and result["map"]["weight"] == 3
assert abs(result["map"]["stages"][0]["penalty"] - bend @ bend) < 1e-4 * (bend @ bend + 1e-6)
END
  done
}

cat >block.yaml <<'END'
body:
  mesh: block.mesh
  density: 1000
  material: {energy: S, young: 3e4, poisson: 0.4}
effects:
  - pin: {box: [[-1, -1, -1], [1, 1, 1e-9]]}
  - traction: {box: [[-1, -1, 0.0999], [1, 1, 1]], traction: [0, 0, 2e3]}
time: {method: static}
output: {frame_interval: 0}
END
cat >block_fit.yaml <<'END'
experiments:
  - {name: pull, scene: block.yaml, measured: [{positions: pull.csv, deviation: 2e-5}]}
  - {name: shear, scene: block.yaml, set: {"effects.traction.traction": [1e3, 0, 0]}, measured: [{positions: shear.csv, deviation: 2e-5}]}
map: {constant: young, start: 6e4}
END
prepare() {
  "$flesh" mesh box --cells 3,3,4 --size 0.1,0.1,0.1 --out block.mesh >/dev/null && python3 - "$flesh" <<'END'
import random, subprocess, sys
random.seed(3)
lines = open("block.mesh").read().split("\n")
def section(name, columns, kind):
    at = lines.index(name) + 2
    return [[kind(w) for w in l.split()[:columns]] for l in lines[at:at + int(lines[at - 1])]]
X, T = section("Vertices", 3, float), section("Tetrahedra", 4, int)
stiff = [sum(X[n - 1][2] for n in t) / 4 > 0.05 and sum(X[n - 1][0] for n in t) / 4 > 0.05 for t in T]
print("tet,young [Pa]\n" + "\n".join(f"{t},{9e4 if s else 3e4}" for t, s in enumerate(stiff)), file=open("truth.csv", "w"))
for name, load in ("pull", "[0, 0, 2e3]"), ("shear", "[1e3, 0, 0]"):
    subprocess.run([sys.argv[1], "run", "block.yaml", "--out", "of_" + name, "--quiet", "--set", "body.material_map=truth.csv",
                    "--set", "solver.newton_tolerance=1e-8", "--set", "effects.traction.traction=" + load], check=True)
    x = [[float(w) for w in l.split()[:3]] for l in open(f"of_{name}/state.txt") if l[0] != "#"]
    with open(name + ".csv", "w") as file:
        print("node,x [m],y [m],z [m]", file=file)
        for n, (at, P) in enumerate(zip(x, X)):
            if P[2] > 0 and any(p in (0, 0.1) for p in P): print(n, *(p + random.gauss(0, 2e-5) for p in at), sep=",", file=file)
END
}

a_stiff_part_comes_back() {
  expect 0 "$flesh" fit block_fit.yaml --out block && has stdout.txt '^The measurements determine about ' || return 1
  result block 'abs(r["residuals"]["scale"] - 1) < 0.011 and r["map"]["weight_from"] == "discrepancy" and r["map"]["tets"] == 216' &&
    result block '20 < r["map"]["determined_numbers"] < 160 and all(e["derivatives"] == "by tangents and adjoints" for e in r["experiments"])' &&
    python3 - <<'END' || return 1
import csv, math
true = [float(row["young [Pa]"]) for row in csv.DictReader(open("truth.csv"))]
rows = list(csv.DictReader(open("block/tets.csv")))
own = [float(row["young [Pa]"]) for row in rows]
a, b = ([math.log(y) - sum(map(math.log, x)) / len(x) for y in x] for x in (true, own))
correlation = sum(x * y for x, y in zip(a, b)) / math.sqrt(sum(x * x for x in a) * sum(y * y for y in b))
print("correlation", correlation)
assert correlation > 0.9
assert all(float(row["low_95 [Pa]"]) < y < float(row["high_95 [Pa]"]) for row, y in zip(rows, own))
assert "Name=\"young\"" in open("block/map.vtu", errors="replace").read()
END
  # The fitted scene runs, with the fitted numbers.
  expect 0 "$flesh" run block/scenes/pull.yaml --out again --quiet && python3 - <<'END' || return 1
import csv
x = [[float(w) for w in l.split()[:3]] for l in open("again/state.txt") if l[0] != "#"]
nodes = [int(row["node"]) for row in csv.DictReader(open("pull.csv"))]
fit = [row for row in csv.DictReader(open("block/fit.csv")) if row["experiment"] == "pull"]
assert len(fit) == 3 * len(nodes)
assert all(abs(x[nodes[int(row["row"]) - 1]]["xyz".index(row["quantity"])] - float(row["fitted"])) < 1e-8 for row in fit)
END
  expect 0 "$flesh" snap again --colour young --width 100 --out young.png && has stdout.txt "^colours: Young's modulus \[kPa\]"
}

# Only the stiff half is a map; without differences in the data there is none in it.
parts_of_a_body_have_maps() {
  sed 's/start: 6e4/start: 6e4, box: [[-1, -1, 0.05], [1, 1, 1]], penalty: variation/' block_fit.yaml >half.yaml
  expect 0 "$flesh" fit half.yaml --out half --quiet && result half 'r["map"]["tets"] == 108 and abs(r["residuals"]["scale"] - 1) < 0.011' &&
    [ "$(lines half/map.csv)" -eq 109 ] || return 1
  sed 's/2e-5/1e-2/g' block_fit.yaml >loose.yaml
  expect 0 "$flesh" fit loose.yaml --out loose && has stdout.txt '^A nearly uniform value agrees with the measurements' || return 1
  sed 's/pull.csv, /other.csv, /' block_fit.yaml >conflict.yaml
  { cat pull.csv; echo 10,0.1,0.1,0.1; } >other.csv
  expect 0 "$flesh" fit conflict.yaml --out conflict && has stdout.txt 'residuals stay .* however rough the map may be' || return 1
  sed 's/2e-5/1e-9/g; s/^map.*/map: {constant: young, start: 6e4, weight: 1e9}/' block_fit.yaml >tight.yaml
  expect 0 "$flesh" fit tight.yaml --out tight && has stdout.txt 'times the stated deviations: the weight is too large'
}

# A fit that is killed goes on with its stages and runs, to the same bits.
killed_it_goes_on() {
  "$flesh" fit block_fit.yaml --out killed --quiet 2>stderr.txt &
  process=$!
  has_stages() {
    python3 -c 'import sqlite3
exit(sqlite3.connect("file:killed/fit.db?mode=ro", uri=True).execute("SELECT count(*) FROM cases WHERE what = \"stage\" AND result NOT NULL").fetchone()[0] < 2)'
  }
  wait_until $process has_stages || return 1
  kill -9 $process
  wait $process 2>/dev/null
  expect 2 "$flesh" fit block_fit.yaml --out killed && expect 0 "$flesh" fit block_fit.yaml --out killed --resume --quiet &&
    cmp killed/map.csv block/map.csv && cmp killed/tets.csv block/tets.csv || return 1
  result killed 'r["runs"]["made_now"] > 0' || return 1
  sed 's/start: 6e4/start: 5e4/' block_fit.yaml >other.yaml
  expect 2 "$flesh" fit other.yaml --out killed --resume && has stderr.txt 'is of another fit'
}

# bad WORDS SED...: the spec, changed so, is refused with one line that has the words.
bad() {
  words=$1
  shift
  sed "$@" block_fit.yaml >bad.yaml
  rm -rf bad
  expect 2 "$flesh" fit bad.yaml --out bad || return 1
  [ "$(lines stderr.txt)" -eq 1 ] && has stderr.txt "$words"
}
bad_maps_are_refused() {
  bad 'bad.yaml:4:.*body.material.yung is unknown; did you mean young' 's/constant: young/constant: yung/' &&
    bad 'start is -1; it must be > 0 when spacing is logarithmic' 's/start: 6e4/start: -1/' &&
    bad 'the map has from and not to; it must have both or none' 's/start: 6e4/start: 6e4, from: 1e3/' &&
    bad 'start is 60000; it must lie between 1000 and 50000' 's/start: 6e4/start: 6e4, from: 1e3, to: 5e4/' &&
    bad 'weight is 0; it must be a number > 0' 's/start: 6e4/start: 6e4, weight: 0/' &&
    bad 'no tet of the mesh meets' 's/start: 6e4/start: 6e4, regions: [7]/' &&
    bad 'map stands beside parameters; give either' '$a parameters: [{key: body.material.poisson, start: 0.3}]' &&
    bad 'parameters are 0; they must be 1 to 256, or give a map' '/^map/d' &&
    bad 'the scene has body.refine, beside which no map can be fitted' 's/name: shear, scene: block.yaml, set: {/&body.refine: 1, /' &&
    bad 'a map needs equilibria.*it is a motion' 's/name: shear, scene: block.yaml, set: {/&effects.inertia: {}, time.method: newmark, time.end: 1, /' &&
    bad 'a map is fitted to positions and to columns of probes, not to history' 's/positions: pull.csv/history: energy.csv/' || return 1
  printf 'node,x [mm]\n30,100\n' >bad.csv
  bad 'bad.csv: column x is in mm; it must be in m' 's/positions: pull.csv/positions: bad.csv/' || return 1
  printf 'wall.contact_force_x\n3\n' >bad.csv
  bad 'column wall.contact_force_x is none that a map can be fitted to' 's/positions: pull.csv/probes: bad.csv/'
}

printf 'energy_total\n3\n' >energy.csv
prepare || exit 1
run_tests deviations_are_those_of_an_independent_matrix a_stiff_part_comes_back parts_of_a_body_have_maps killed_it_goes_on \
  bad_maps_are_refused
