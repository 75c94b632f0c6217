# TEST full program seconds=10 needs=flesh
# test_others.sh: hard cases as data for other solvers, and the runner and judge of drivers/others. No other solver is
# needed.
set -u
. "$(dirname -- "$0")/../shared/command.sh"

# Static cases without effects, and no others, are exported as data that a program without flesh can read.
static_cases_are_data() {
  expect 0 "$flesh" hardcases --quick --export --out data --energies S,D --poisson 0.45 --elements tet4,tet10 \
    --cases 'squash10*' && has stdout.txt '^2 cases written to data/cases, 22 left out' || return 1
  [ ! -e data/cases/squash10_static_S_0.45/out ] && [ ! -e data/hardcases.csv ] && python3 - <<'E' &&
import json
for element, nodes in ("", 4), ("_tet10", 10):
    folder = "data/cases/squash10_static_S_0.45" + element
    case = json.load(open(folder + "/case.json"))
    mesh = open(folder + "/" + case["mesh"]).read().split("\n")
    count = int(mesh[mesh.index("Vertices") + 1])
    start = [line.split() for line in open(folder + "/" + case["start"]) if line[0] != "#"]
    rest = [line.split() for line in mesh[mesh.index("Vertices") + 2:][:count]]
    tets = mesh.index("TetrahedraP2" if nodes == 10 else "Tetrahedra")
    assert (case["format"], case["version"], case["loads"]) == ("flesh-case", 1, [])
    assert len(mesh[tets + 2].split()) == nodes + 1 and len(start) == count
    assert all(abs(float(s[0]) - float(r[0]) / 10) < 1e-12 for s, r in zip(start, rest))
    held = [i for i, x in enumerate(rest) if abs(float(x[0])) < 1e-9]
    assert [row[0] for row in case["fixed"]] == held
    assert all([float(x) for x in rest[row[0]][:3]] == row[1:] for row in case["fixed"])
    material = case["materials"][0]
    assert abs(material["mu"] - 1e5 / 2.9 * 4 / 3) < 1e-6 and material["energy"] == "S"
    assert abs(case["judge"]["distance"] - 2e-4) < 1e-12
    assert abs(case["judge"]["energy"] - 1e-6 * material["mu"] * 2e-3) < 1e-9
E
    expect 2 "$flesh" hardcases --quick --export --out none --cases squash10 && has stderr.txt 'finds no case that is static' &&
    expect 2 "$flesh" hardcases --quick --export --out none --solvers clamped && has stderr.txt 'leave --solvers and --ablation out' && [ ! -e none ]
}

others=$source_folder/../drivers/others

# The cases of today have the frozen checksums.
frozen_cases_are_unchanged() {
  sh "$others/export.sh" frozen "$flesh" >log.txt || { cat log.txt; return 1; }
  python3 "$others/battery.py" frozen --freeze >sums.txt
  grep -v '^#' "$source_folder/../data/hardcases/frozen.txt" | diff - sums.txt
}

# The judge's forces are differences of its energy, which is that of Lame's constants at small strains; both are 0 at rest.
the_judge_knows_its_forms() {
  python3 - "$others" frozen/filters/cases/4x2x2_twist_seed1_S_0.49 <<'E'
import sys
sys.path.insert(0, sys.argv[1])
import numpy as np
import case as cases
import judge
random = np.random.default_rng(1)
for form in judge.FORMS:
    for ending in "", "_tet10":
        case = cases.read(sys.argv[2] + ending)
        mu, bulk = 3e4, 2e5
        alpha = {"E": 1 + mu / bulk, "S": 1 + mu / bulk - mu / 4 / bulk}.get(form, 1)
        case.materials = [{"energy": form, "mu": mu, "lambda": bulk, "alpha": alpha}]
        energy, forces, J = judge.evaluate(case, case.rest)
        assert abs(energy) < 1e-9 and np.abs(forces).max() < 1e-9 and np.abs(J - 1).max() < 1e-12
        x = case.rest + 0.003 * random.normal(size=case.rest.shape)
        p = random.normal(size=x.shape)
        _, forces, J = judge.evaluate(case, x)
        assert J.min() > 0
        slope = [(judge.evaluate(case, x + h * p)[0] - judge.evaluate(case, x - h * p)[0]) / 2 / h for h in (1e-6, 2e-6)]
        exact = (forces * p).sum()
        assert abs((4 * slope[0] - slope[1]) / 3 - exact) < 1e-6 * abs(exact), form
        # A strain of 1e-4: shear and dilatation.
        volume = judge.gradients(case)[1].sum()
        small = {"Neo": (mu, bulk), "A": (mu, bulk), "B": (mu, bulk - 2 / 3 * mu), "E": (mu, bulk - mu),
                 "S": (0.75 * mu, bulk - 0.625 * mu)}[form]
        for strain, wanted in (np.outer([1, 0, 0], [0, 1, 0]), small[0] / 2), (np.eye(3), 3 * small[0] + 4.5 * small[1]):
            energies = [judge.evaluate(case, case.rest @ (np.eye(3) + e * strain))[0] for e in (1e-4, -1e-4)]
            assert abs(sum(energies) / 2 / volume / 1e-8 / wanted - 1) < 1e-3, (form, ending, energies, wanted)
E
}

# The final state of an adapter is judged: the right one is a solution, and each wrong one is refused for its reason. Runs are
# killed if they take too long, recorded, and not repeated. A case that is not as it was frozen is refused.
wrong_ends_are_judged_wrong() {
  cat >fake.py <<'E'
import os, sys, time
import numpy as np
def version(): return "fake 1"
def can_run(case): return "is not asked" if "shake" in case.name else None
def cleanup(folder): pass
def solve(case, seconds, folder):
    open("calls.txt", "a").write(case.name + "\n")
    x, free = case.rest.copy(), np.setdiff1d(np.arange(len(case.rest)), case.fixed)
    kind = KIND
    if kind == "turned": x[:, 1:] *= -1  # an equilibrium, and at rest, but not where it is held
    if kind == "mirrored": x[:, 1] *= -1
    if kind == "off": x[free[5]] += 1e-6
    if kind == "nan": x[free[0], 0] = np.nan
    if kind == "short": x = x[:-1]
    if kind == "start": x = case.start
    if kind == "raises": raise RuntimeError("it broke")
    if kind == "exits": os._exit(7)
    if kind == "stops": return {"x": None, "newton": 3, "said": "no convergence"}
    while kind == "spins": pass
    return {"x": x, "newton": 3, "said": None}
E
  one=frozen/filters/cases/4x2x2_squash_seed1_S_0.49
  for kind in right turned mirrored off nan short start raises exits stops spins; do
    sed "s/KIND/'$kind'/" fake.py >$kind.py
    expect 0 python3 "$others/battery.py" $one --adapters $kind.py --seconds 2 --out judged || return 1
    printf '%s %s\n' $kind "$(sed -n 's/^# 4x2x2[^:]*: //p' stdout.txt | cut -c 1-40)" >>verdicts.txt
  done
  cat verdicts.txt
  [ "$(wc -l <calls.txt)" -eq 11 ] && [ "$(wc -l <judged/results.jsonl)" -eq 11 ] && has verdicts.txt '^right solved$' &&
    has verdicts.txt '^turned wrong end, a fixed node is' && has verdicts.txt '^mirrored wrong end, a fixed node is' &&
    has verdicts.txt '^off wrong end, the residual is' && has verdicts.txt '^nan wrong end, a position is' &&
    has verdicts.txt '^short wrong end, a position is' && has verdicts.txt '^start wrong end, the residual is' &&
    has verdicts.txt '^raises died' && has verdicts.txt '^exits died' && has verdicts.txt '^stops stopped, no conv' &&
    has verdicts.txt '^spins out of time' || return 1
  expect 0 python3 "$others/battery.py" $one --adapters start.py --seconds 2 --out judged &&
    has stdout.txt '| fake 1 | 0 | 1 | 0 |' && [ "$(wc -l <calls.txt)" -eq 11 ] || return 1
  cp -r $one changed && sed 's/^0\.05 /0.0501 /' $one/start.txt >changed/start.txt
  sed 's/"residual": /"residual": 2/' $one/case.json >changed/case.json
  expect 2 python3 "$others/battery.py" changed --adapters right.py --out judged && has stderr.txt 'not as they were frozen' &&
    expect 2 python3 "$others/battery.py" "$others" --out judged && has stderr.txt 'no case.json' || return 1
  sed 's/"version": 1/"version": 2/' $one/case.json >changed/case.json
  expect 2 python3 "$others/battery.py" changed --out judged && has stderr.txt 'must be flesh-case 1'
}

# flesh itself gets the same data as all other solvers.
flesh_is_an_adapter() {
  FLESH=$flesh expect 0 python3 "$others/battery.py" frozen/filters/cases/4x2x2_noise_seed1_B_0.49 \
    frozen/filters/cases/4x2x2_stretch_seed1_S_0.49_tet10 --adapters flesh --out flesh &&
    has stdout.txt '4x2x2_noise_seed1_B_0.49 flesh: ' && has stdout.txt 'stretch_seed1_S_0.49_tet10 flesh: solved'
}

# The compared force is that of the tets on the probe's nodes, which is computed here by the judge's code. tet10 is stiffer.
a_limb_is_indented() {
  command -v gmsh >/dev/null || { echo 'no gmsh'; return 0; }
  export FLESH="$flesh"
  expect 0 python3 "$others/limb.py" --out limb --sizes 40,32 --poisson 0.49 --solvers flesh,flesh_tet10 --seconds 200 &&
    [ "$(wc -l <limb/results.jsonl)" -eq 4 ] && expect 0 python3 "$others/limb.py" --out limb --table &&
    has stdout.txt '^| 0.49 | flesh, tet10 | 40 | ' || return 1
  python3 - "$others" <<'E'
import json, sys
sys.path.insert(0, sys.argv[1])
import numpy as np
import case as cases
import judge
force = {(r["solver"], r["size"]): r["force"] for r in map(json.loads, open("limb/results.jsonl"))}
case = cases.read("limb/limb_40_0.49")
_, forces, J = judge.evaluate(case, np.load("limb/limb_40_0.49/flesh_tet10/end.npy"))
assert J.min() > 0 and set(case.region) == {0, 1, 2, 3}
own = forces[case.moved].sum(0)[2]
print(force, own)
assert abs(own / force["flesh_tet10", 40] - 1) < 1e-5
assert force["flesh_tet10", 40] < 1.02 * force["flesh", 40] < 0
E
}

if python3 -c 'import numpy' 2>/dev/null; then
  run_tests static_cases_are_data frozen_cases_are_unchanged the_judge_knows_its_forms wrong_ends_are_judged_wrong \
    flesh_is_an_adapter a_limb_is_indented
else
  run_tests static_cases_are_data
fi
