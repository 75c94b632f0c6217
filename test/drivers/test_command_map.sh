# TEST full memory program seconds=16 needs=flesh
# test_command_map.sh: `flesh fit` with a map: derivatives, deviations and the minimum against an independent computation, an
# inclusion that is found from noisy positions, resuming after a kill, bad specs. FLESH names the program.
set -u
. "$(dirname -- "$0")/../shared/command.sh"

# result FOLDER EXPRESSION: the Python expression of r, the folder's result.json, is true.
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

# The same beam in motion.
sed 's/^effects:/&\n  - inertia: {}\n  - damping: {stiffness: 0.02}/; s/{time: 0, value: 0}/{time: 0, value: 1}/; s/^time.*/time: {method: newmark, step: 0.05, end: 1}/; /name: wall/d' beam.yaml >swing.yaml

# Deviations, resolutions, covariance and the minimum, of equilibria and of a motion, are those that are computed here from the
# matrix of all derivatives, by differences of runs, and from the penalty.
deviations_are_those_of_an_independent_matrix() {
  "$flesh" mesh box --cells 2,1,1 --size 2,1,1 --out beam.mesh >/dev/null || return 1
  python3 - <<'END' || return 1
print("t [s],tip.position_z [m],tip.position_x [m]\n0.7,0.56,2.01\n1,0.63,2.001", file=open("tip.csv", "w"))
print("t [s],wall.reaction_x [N]\n1,-2100", file=open("wall.csv", "w"))
print("X,Y,Z,x,z\n0.9,0.4,0.3,0.9,0.34\n1.9,0.1,0.8,1.885,0.9", file=open("places.csv", "w"))
END
  "$flesh" run swing.yaml --out of_swing --quiet --set body.material.young=8e4 && python3 - <<'END' || return 1
import csv
rows = {float(row["t [s]"]): row for row in csv.DictReader(open("of_swing/probes.csv"))}
state = [[float(w) for w in line.split()[:3]] for line in open("of_swing/state.txt") if line[0] != "#"]
print("node,x,z\n5,%r,%r\n8,%r,%r" % (state[5][0] + 0.01, state[5][2], state[8][0], state[8][2] - 0.02), file=open("nodes.csv", "w"))
with open("swung.csv", "w") as file:
    print("t [s],tip.position_z [m],tip.position_x [m]", file=file)
    for k, t in enumerate((0.25, 0.5, 0.75, 1)):
        print(t, *(float(rows[t][f"tip.position_{c} [m]"]) + 0.01 * e for c, e in (("z", (-1) ** k), ("x", k - 2))), sep=",", file=file)
END
  for case in 'beam quadratic' ${long:+'beam variation'} 'swing quadratic'; do
    scene=${case% *} penalty=${case#* } wall='{probes: wall.csv, deviation: 30}, ' keys=
    [ "$case" = 'beam quadratic' ] || keys='parameters: [{key: body.material.poisson, start: 0.3, from: 0, to: 0.49},
  {key: "effects.traction.traction[2]", name: load, start: 1500, spacing: logarithmic}]'
    tip=tip.csv places=places.csv
    [ $scene = beam ] || wall= tip=swung.csv places=nodes.csv
    cat >beam_fit.yaml <<END
experiments:
  - name: bend
    scene: $scene.yaml
    measured: [{probes: $tip, deviation: 0.01}, $wall{positions: $places, deviation: 0.02}]
map: {constant: young, start: 1e5, from: 1e3, to: 1e6, weight: 3, penalty: $penalty, edge: 0.1}
tolerance: 1e-6
$keys
END
    rm -rf beam
    expect 0 "$flesh" fit beam_fit.yaml --out beam || return 1
    python3 - "$flesh" "$penalty" "$scene" <<'END' || return 1
import csv, json, os, subprocess, sys
import numpy as np
flesh, penalty, scene = sys.argv[1:]
out = "beam"
result = json.load(open(out + "/result.json"))
keys = result["parameters"]
lines = open("beam.mesh").read().split("\n")
def section(name, columns, kind):
    at = lines.index(name) + 2
    return np.array([[kind(w) for w in l.split()[:columns]] for l in lines[at:at + int(lines[at - 1])]])
X, T = section("Vertices", 3, float), section("Tetrahedra", 4, int) - 1
rows = list(csv.DictReader(open(out + "/tets.csv")))
q = np.log([float(row["young [Pa]"]) for row in rows])
K = len(keys)
sizes = [p["start"] if p["name"] == "poisson" else None for p in keys]  # None: logarithmic
q = np.array([p["value"] / s if s else np.log(p["value"]) for p, s in zip(keys, sizes)] + list(q))
fit = list(csv.DictReader(open(out + "/fit.csv")))
deviation = np.array([float(row["deviation"]) for row in fit])
assert len(fit) == (9 if scene == "beam" else 12) and len(rows) == 12
def values(q):
    with open("own.csv", "w") as file:
        print("tet,young [Pa]\n" + "\n".join(f"{t},{float(p)!r}" for t, p in enumerate(np.exp(q[K:]))), file=file)
    sets = [f"{p['key']}={float(x * s if s else np.exp(x))!r}" for p, s, x in zip(keys, sizes, q)]
    subprocess.run([flesh, "run", scene + ".yaml", "--out", "own", "--quiet", "--set", "body.material_map=own.csv", "--set",
                    "solver.newton_tolerance=1e-10"] + [w for s in sets for w in ("--set", s)], check=True)
    probes = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(open("own/probes.csv"))]
    x = np.array([[float(w) for w in l.split()[:3]] for l in open("own/state.txt") if l[0] != "#"])
    def at(t, name):
        return np.interp(t, [p["t [s]"] for p in probes], [p[name] for p in probes])
    def place(P):
        for t in T:
            L = np.linalg.solve(np.vstack([X[t].T, np.ones(4)]), [*P, 1])
            if L.min() > -1e-9: return L @ x[t]
    a, b = (place((0.9, 0.4, 0.3)), place((1.9, 0.1, 0.8))) if scene == "beam" else (x[5], x[8])
    z, across = "tip.position_z [m]", "tip.position_x [m]"
    wall = [at(1, "wall.reaction_x [N]")] if scene == "beam" else []
    times = (.7, 1) if scene == "beam" else (.25, .5, .75, 1)
    return np.array([at(t, name) for t in times for name in (z, across)] + wall + [a[0], a[2], b[0], b[2]])
f = values(q)
assert np.allclose(f, [float(row["fitted"]) for row in fit], rtol=1e-6), (f, fit)
h = 1e-4
J = np.array([(values(q + d) - values(q - d)) / (2 * h) for d in h * np.eye(K + 12)]).T / deviation[:, None]
faces = {}
for t, nodes in enumerate(T):
    for o in range(4): faces.setdefault(tuple(sorted(np.delete(nodes, o))), []).append(t)
pairs = {face: two for face, two in faces.items() if len(two) == 2}
P, R, bend = np.zeros((len(pairs), K + 12)), np.zeros((K + 12, K + 12)), np.zeros(len(pairs))
for k, (face, (a, b)) in enumerate(pairs.items()):
    u, v, w = X[list(face)]
    weight = 3 * np.linalg.norm(np.cross(v - u, w - u)) / 2 / np.linalg.norm(X[T[a]].mean(0) - X[T[b]].mean(0)) / 2 ** (1 / 3)
    a, b = a + K, b + K
    d = q[a] - q[b]
    of = lambda d: d if penalty == "quadratic" else np.sign(d) * 0.1 * np.sqrt(2 * (np.sqrt(1 + (d / 0.1) ** 2) - 1))
    slope = 1 if penalty == "quadratic" else (of(d + 1e-5) - of(d - 1e-5)) / 2e-5
    P[k, a], P[k, b] = np.sqrt(weight) * slope, -np.sqrt(weight) * slope
    curve = (of(d + 1e-4) ** 2 - 2 * of(d) ** 2 + of(d - 1e-4) ** 2) / 2e-8
    R[np.ix_([a, b], [a, b])] += weight * curve * np.array([[1, -1], [-1, 1]])
    bend[k] = np.sqrt(weight) * of(d)
information = J.T @ J
H = information + P.T @ P
def find_errors(belief):
    inverse = np.linalg.inv(information + belief * R + 0.01 * np.eye(K + 12))
    shift = inverse @ P.T @ bend
    return inverse, inverse + np.outer(shift, shift)
inverse, errors = find_errors(1)
assert np.allclose([float(row["deviation of q"]) for row in rows], np.sqrt(np.diag(errors))[K:], rtol=1e-3)
resolution, errors = np.diag(inverse @ information)[K:], find_errors(0.1)[1]
assert np.allclose([float(row["resolution"]) for row in rows], resolution, rtol=1e-3, atol=1e-5)
slopes = [s or p["value"] for p, s in zip(keys, sizes)]
covariance = errors[:K, :K] * np.outer(slopes, slopes)
sizes_of = np.sqrt(np.outer(np.diag(covariance), np.diag(covariance)))
assert np.all(np.abs(np.reshape(result["covariance"], (K, K)) - covariance) <= 2e-3 * sizes_of), (result["covariance"], covariance)
for k, p in enumerate(keys):
    half, s = 1.95996 * np.sqrt(errors[k, k]), sizes[k]
    ends = [(q[k] + e) * s if s else np.exp(q[k] + e) for e in (-half, half)]
    assert np.allclose([p["low_95"], p["high_95"]], ends, rtol=2e-3), (p, ends)
r = (f - [float(row["value"]) for row in fit]) / deviation
step = np.linalg.solve(H, J.T @ r + P.T @ bend)
print(penalty, "further step", np.abs(step).max(), "of", np.ptp(q[K:]), "residuals", r @ r, keys)
assert np.abs(step).max() < 0.01 and np.ptp(q[K:]) > 0.05
assert abs(result["map"]["determined_numbers"] - resolution.sum()) < 1e-2 and result["map"]["weight"] == 3
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
    result block 'abs(r["map"]["stages"][-1]["determined_numbers"] / r["map"]["determined_numbers"] - 1) < 0.15' &&
    comes_back block 0.9 && python3 - <<'END' || return 1
import csv
assert all(float(row["low_95 [Pa]"]) < float(row["young [Pa]"]) < float(row["high_95 [Pa]"]) for row in csv.DictReader(open("block/tets.csv")))
assert "Name=\"young\"" in open("block/map.vtu", errors="replace").read()
END
  # A run of the fitted scene gives the fitted numbers.
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

# The load of one of two experiments is found beside the map; with that experiment alone, it is not determined apart from the
# stiffness. A key stays at a bound.
cat >load_fit.yaml <<'END'
experiments:
  - {name: pull, scene: block.yaml, measured: [{positions: pull.csv, deviation: 2e-5}]}
  - {name: shear, scene: block.yaml, measured: [{positions: shear.csv, deviation: 2e-5}], set: {"effects.traction.traction": [100, 0, 0]}}
map: {constant: young, start: 6e4}
parameters:
  - {key: "effects.traction.traction[0]", name: load, start: 500, experiments: [shear]}
  - {key: body.material.poisson, start: 0.3, from: 0, to: 0.399}
END
a_load_comes_back_beside_a_map() {
  expect 0 "$flesh" fit load_fit.yaml --out load && has stdout.txt '^poisson stays at its upper bound' || return 1
  result load 'abs(r["parameters"][0]["value"] - 1000) < 3 * r["parameters"][0]["standard_error"] < 15' &&
    result load '[p["at_bound"] for p in r["parameters"]] == [None, "upper"] and r["parameters"][1]["value"] == 0.399' &&
    comes_back load 0.9 || return 1
  sed '/name: pull/d; s/body.material.poisson, .*/body.density, start: 500}/' load_fit.yaml >apart.yaml
  expect 0 "$flesh" fit apart.yaml --out apart &&
    has stdout.txt '^load and young of all tets are not determined apart: the measured numbers depend on their ratio alone' &&
    has stdout.txt '^density is not determined: it changes none' && result apart 'r["parameters"][0]["standard_error"] is None'
}

# comes_back FOLDER LEAST: the correlation of the logarithms of the map and the truth is above LEAST.
comes_back() {
  python3 - "$@" <<'END'
import csv, math, sys
true = [float(row["young [Pa]"]) for row in csv.DictReader(open("truth.csv"))]
own = [float(row["young [Pa]"]) for row in csv.DictReader(open(sys.argv[1] + "/tets.csv"))][:len(true)]
a, b = ([math.log(y) - sum(map(math.log, x)) / len(x) for y in x] for x in (true, own))
correlation = sum(x * y for x, y in zip(a, b)) / math.sqrt(sum(x * x for x in a) * sum(y * y for y in b))
print("correlation", correlation)
assert correlation > float(sys.argv[2])
END
}

# A map and a load are found from a motion that is measured at four points.
a_map_comes_back_from_a_motion() {
  "$flesh" mesh box --cells 2,2,2 --size 0.1,0.1,0.1 --out cube.mesh >/dev/null || return 1
  cat >moving.yaml <<'END'
body: {mesh: cube.mesh, density: 1000, material: {energy: S, young: 3e4, poisson: 0.4}}
effects:
  - inertia: {}
  - damping: {stiffness: 0.002}
  - pin: {box: [[-1, -1, -1], [1, 1, 1e-9]]}
  - traction: {box: [[-1, -1, 0.0999], [1, 1, 1]], traction: [1e3, 0, 0]}
  - gravity: {acceleration: [0, 0, -9.81]}
time: {method: newmark, step: 0.01, end: 0.1}
output:
  frame_interval: 0
  probes:
    - {name: a, point: [0.1, 0.1, 0.1], quantities: [position]}
    - {name: b, point: [0, 0.1, 0.1], quantities: [position]}
    - {name: c, point: [0, 0, 0.05], quantities: [position, velocity]}
    - {name: d, point: [0.1, 0, 0.05], quantities: [position]}
END
  python3 - "$flesh" <<'END' || return 1
import csv, random, subprocess, sys
random.seed(5)
lines = open("cube.mesh").read().split("\n")
def section(name, columns, kind):
    at = lines.index(name) + 2
    return [[kind(w) for w in l.split()[:columns]] for l in lines[at:at + int(lines[at - 1])]]
X, T = section("Vertices", 3, float), section("Tetrahedra", 4, int)
stiff = [sum(X[n - 1][0] for n in t) / 4 > 0.05 for t in T]
print("tet,young [Pa]\n" + "\n".join(f"{t},{9e4 if s else 3e4}" for t, s in enumerate(stiff)), file=open("truth.csv", "w"))
subprocess.run([sys.argv[1], "run", "moving.yaml", "--out", "moved", "--quiet", "--set", "body.material_map=truth.csv"], check=True)
rows = list(csv.reader(open("moved/probes.csv")))
with open("moved.csv", "w") as file:
    print(",".join(rows[0]), file=file)
    for row in rows[1:]:
        print(row[0], *(float(x) + random.gauss(0, 2e-3 if "velocity" in n else 2e-5) for x, n in zip(row[1:], rows[0][1:])),
              *[2e-3 if "velocity" in n else 2e-5 for n in rows[0][1:]], sep=",", file=file)
text = open("moved.csv").read().split("\n", 1)
names = [n.split(" [")[0] for n in rows[0][1:]]
open("moved.csv", "w").write(text[0] + "," + ",".join(n + "_deviation" for n in names) + "\n" + text[1])
END
  cat >moved.yaml <<'END'
experiments: [{name: swing, scene: moving.yaml, measured: [{probes: moved.csv}]}]
map: {constant: young, start: 5e4, weight: 10, penalty: variation}
parameters: [{key: "effects.traction.traction[0]", name: load, start: 500}]
END
  expect 0 "$flesh" fit moved.yaml --out swung && result swung 'r["experiments"][0]["derivatives"] == "by tangents and adjoints"' &&
    result swung 'r["parameters"][0]["low_95"] < 1000 < r["parameters"][0]["high_95"] < 1100' && comes_back swung 0.9
}

# A part of a body, here the stiff half, may have a map; data that need no map, that contradict each other or that have too
# large a weight beside them are reported.
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

# A killed fit resumes with its stages and runs, and ends with the same bits.
a_killed_fit_resumes() {
  "$flesh" fit load_fit.yaml --out killed --quiet 2>stderr.txt &
  process=$!
  has_stages() {
    python3 -c 'import sqlite3
exit(sqlite3.connect("file:killed/fit.db?mode=ro", uri=True).execute("SELECT count(*) FROM cases WHERE what = \"stage\" AND result NOT NULL").fetchone()[0] < 2)'
  }
  wait_until $process has_stages || return 1
  kill -9 $process
  wait $process 2>/dev/null
  expect 2 "$flesh" fit load_fit.yaml --out killed && expect 0 "$flesh" fit load_fit.yaml --out killed --resume --quiet &&
    cmp killed/map.csv load/map.csv && cmp killed/tets.csv load/tets.csv || return 1
  result killed 'r["runs"]["made_now"] > 0 and r["parameters"] == json.load(open("load/result.json"))["parameters"]' || return 1
  for change in 's/start: 6e4/start: 5e4/' 's/start: 500/start: 501/'; do
    sed "$change" load_fit.yaml >other.yaml
    expect 2 "$flesh" fit other.yaml --out killed --resume && has stderr.txt 'is of another fit' || return 1
  done
}

# bad WORDS SED...: block_fit.yaml, changed by sed, is refused with one line that has WORDS.
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
    bad 'start is 60000; it must lie from 1000 to 50000' 's/start: 6e4/start: 6e4, from: 1e3, to: 5e4/' &&
    bad 'start is 60000, which is a bound; in a fit of a map it must lie between' 's/start: 6e4/start: 6e4, from: 6e4/' &&
    bad 'start is 0, which is a bound; in a fit of a map' '$a parameters: [{key: body.material.poisson, start: 0, from: 0, to: 0.4}]' &&
    bad 'weight is 0; it must be a number > 0' 's/start: 6e4/start: 6e4, weight: 0/' &&
    bad 'no tet of the mesh meets' 's/start: 6e4/start: 6e4, regions: [7]/' &&
    bad 'parameters are 0; they must be 1 to 256, or there is a map' '/^map/d' &&
    bad 'the scene has body.refine, beside which no map can be fitted' 's/name: shear, scene: block.yaml, set: {/&body.refine: 1, /' &&
    bad 'a map needs tangents, but derivatives of pull are by differences: the spec asks for them' 's/name: pull, /&derivatives: differences, /' &&
    bad 'a map needs tangents, but derivatives of pull are by differences: friction' 's/scene: block.yaml, m/scene: block.yaml, set: {effects.contact: {plane: {point: [0, 0, -9]}, friction: 0.1}}, m/' &&
    bad 'a map is fitted to positions and to columns of probes, not to history' 's/positions: pull.csv/history: energy.csv/' || return 1
  printf 'node,x [mm]\n30,100\n' >bad.csv
  bad 'bad.csv: column x is in mm; it must be in m' 's/positions: pull.csv/positions: bad.csv/' || return 1
  printf 'wall.contact_force_x\n3\n' >bad.csv
  bad 'column wall.contact_force_x is none that a map can be fitted to' 's/positions: pull.csv/probes: bad.csv/'
}

printf 'energy_total\n3\n' >energy.csv
prepare || exit 1
run_tests deviations_are_those_of_an_independent_matrix a_stiff_part_comes_back a_load_comes_back_beside_a_map \
  ${long:+parts_of_a_body_have_maps} a_killed_fit_resumes ${long:+a_map_comes_back_from_a_motion} bad_maps_are_refused
