# TEST quick program needs=flesh
# test_others.sh: hard cases as data for other solvers.
set -u
. "$(dirname -- "$0")/../shared/command.sh"

# Cases are data that a program without flesh reads, and only those that it can: static, without effects.
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
    expect 2 "$flesh" hardcases --quick --export --out none --solvers clamped && has stderr.txt 'leave --solvers out'
}

run_tests static_cases_are_data
