#!/usr/bin/env python3
"""fits.py: whether the 95 % intervals of `flesh fit` hold: the same experiments with the noise of many seeds.

    python3 test/campaign/fits.py [--full | --seeds N] [--flesh PROGRAM] [--table FILE] [--case NAME]

A case is a body, measurements of it at known parameters, and the deviation of the noise. The spec states the deviation
three times too small on purpose: the residuals' scale has to compensate for that. Every seed is a fit from another
start. An interval holds if it contains the true parameter. Cases of maps state the true deviation; the intervals of all
tets count, and those of a load that is fitted beside the map; what holds there is told and not judged. The exit status
is 0 where of 100 seeds or more the intervals of every parameter hold in 88 % or more (less is chance once in 250
times), of fewer in 80 %, and all fits end.
"""
import argparse
import csv
import json
import os
import subprocess
import sys
import tempfile

import numpy

HEAD = """body:
  mesh: cube.mesh
  density: 1000
  material: {energy: S, young: 1e5, poisson: 0.4}
effects:
"""
TAIL = """time: {method: static, step: 1, end: 1}
output:
  frame_interval: 0
  probes: [{name: top, box: [[-1, -1, 0.999], [2, 2, 2]]}]
"""
FLOOR = "  - pin: {box: [[-1, -1, -1], [2, 2, 1e-9]]}\n"
LOAD = "  - traction: {box: [[-1, -1, 0.999], [2, 2, 2]], traction: %s}\n"
MUSCLE = ("  - muscle: {box: [[%g, 0, 0], [%g, 1, 1]], fibres: {direction: [0, 0, 1]}, peak_stress: 3e4, "
          "activation: [{time: 0, value: 0}]}\n")
SLIDE = """body: {mesh: cube.mesh, density: 1000, material: {energy: S, young: 1e6, poisson: 0.4}}
effects:
  - inertia: {}
  - gravity: {acceleration: [4.905, 0, -8.496]}
  - viscosity: {shear: 5000, bulk: 5000}
  - contact: {plane: {point: [0, 0, -0.017]}, thickness: 0.02, friction: 0.3}
start: {velocity: [2, 0, 0]}
time: {method: backward-euler, step: 1/25, end: 0.8}
output: {frame_interval: 0, probes: [{name: top, box: [[-1, -1, -1], [2, 2, 2]]}]}
"""

# Each: scenes by name, {key: (true value, bounds of starts, rest of the row)}, deviation of the noise in m.
CASES = {
    "two constants": ({"pull": HEAD + FLOOR + LOAD % "[0, 0, 2e4]" + TAIL, "shear": HEAD + FLOOR + LOAD % "[0, 8e3, 0]" + TAIL},
                      {"body.material.young": (1e5, 3e4, 3e5, "from: 1e3, to: 1e7, spacing: logarithmic"),
                       "body.material.poisson": (0.4, 0.1, 0.45, "from: 0, to: 0.49")}, 3e-3),
    "two muscles": ({"bend": HEAD + FLOOR + MUSCLE % (0, 0.5) + MUSCLE % (0.5, 1) + TAIL},
                    {"effects.muscle[0].activation[0].value": (0.5, 0.1, 0.9, "name: left, from: 0, to: 1"),
                     "effects.muscle[1].activation[0].value": (0.2, 0.1, 0.9, "name: right, from: 0, to: 1")}, 3e-3),
    "friction": ({"slide": SLIDE},
                 {"effects.contact.friction": (0.3, 0.2, 0.4, "from: 0.01, to: 2"),
                  "start.velocity[0]": (2, 1.7, 2.3, "name: speed, from: 0, to: 10")}, 3e-3),
}
STATED = 1 / 3
BLOCK = HEAD.replace("cube", "block") + "  - pin: {box: [[-1, -1, -1], [1, 1, 1e-9]]}\n" + \
    "  - traction: {box: [[-1, -1, 0.0999], [1, 1, 1]], traction: %s}\ntime: {method: static}\noutput: {frame_interval: 0}\n"
# Maps of the logarithm over 5e4 Pa, by centres over the block's edge: a wave as smooth as penalties like it, and a stiff quarter.
MAPS = {
    "a smooth map": (lambda c: 0.4 * numpy.cos(numpy.pi * c[:, 0]) * numpy.cos(numpy.pi * c[:, 2]), "quadratic"),
    "a stiff quarter": (lambda c: numpy.log(3) * ((c[:, 0] > 0.5) & (c[:, 2] > 0.5)), "quadratic"),
    "a stiff quarter, variation": (lambda c: numpy.log(3) * ((c[:, 0] > 0.5) & (c[:, 2] > 0.5)), "variation"),
}


def run(flesh, words):
    subprocess.run([flesh] + words, check=True, stdout=subprocess.DEVNULL)


def measure(flesh, scenes, truth):
    """Returns the exact measurements of each scene: (names of columns, rows)."""
    found = {}
    for name, text in scenes.items():
        with open(name + ".yaml", "w") as file:
            file.write(text)
        words = ["run", name + ".yaml", "--out", "true_" + name, "--quiet", "--set", "solver.newton_tolerance=1e-8"]
        for key, row in truth.items():
            words += ["--set", f"{key}={row[0]!r}"]
        run(flesh, words)
        if "inertia" in text:
            with open(f"true_{name}/probes.csv") as file:
                rows = list(csv.reader(file))
            found[name] = ("probes", rows[0][:2], numpy.array(rows[1:], float)[1:, :2])
        else:
            places = numpy.loadtxt(f"true_{name}/state.txt")[:, :3]
            nodes = numpy.arange(len(places))[:, None]
            found[name] = ("positions", ["node", "x", "y", "z"], numpy.hstack([nodes, places])[places[:, 2] > 0.1])
    return found


def fit(flesh, found, case, seed):
    """Runs one seed: returns {parameter: (true, low, high)}, and the result."""
    _, truth, deviation = CASES[case]
    random = numpy.random.default_rng((list(CASES).index(case), seed))
    lines = ["experiments:"]
    for name, (kind, columns, rows) in found.items():
        noisy = rows.copy()
        noisy[:, 1:] += deviation * random.normal(size=noisy[:, 1:].shape)
        with open(name + ".csv", "w") as file:
            csv.writer(file).writerows([columns] + noisy.tolist())
        lines.append(f"  - {{name: {name}, scene: {name}.yaml, measured: [{{{kind}: {name}.csv, deviation: {STATED * deviation}}}]}}")
    lines.append("parameters:")
    for key, (_, low, high, rest) in truth.items():
        lines.append(f"  - {{key: \"{key}\", start: {random.uniform(low, high):.6g}, {rest}}}")
    with open("spec.yaml", "w") as file:
        file.write("\n".join(lines) + "\n")
    subprocess.run(["rm", "-rf", "fit"], check=True)
    run(flesh, ["fit", "spec.yaml", "--out", "fit", "--quiet"])
    with open("fit/result.json") as file:
        result = json.load(file)
    return {one["name"]: (row[0], one["low_95"], one["high_95"])
            for one, row in zip(result["parameters"], truth.values())}, result


def map_rows(flesh, name, seeds):
    """Returns rows of the table for a map: of its tets, and of the load fitted with it."""
    truth, penalty = MAPS[name]
    run(flesh, ["mesh", "box", "--cells", "3,3,4", "--size", "0.1,0.1,0.1", "--out", "block.mesh"])
    with open("block.mesh") as file:
        lines = file.read().split("\n")
    at, of = lines.index("Vertices") + 2, lines.index("Tetrahedra") + 2
    places = numpy.array([line.split()[:3] for line in lines[at:at + int(lines[at - 1])]], float)
    tets = numpy.array([line.split()[:4] for line in lines[of:of + int(lines[of - 1])]], int) - 1
    young = 5e4 * numpy.exp(truth(places[tets].mean(axis=1) / 0.1))
    numpy.savetxt("truth.csv", numpy.c_[numpy.arange(len(young)), young], fmt=["%d", "%.17g"], delimiter=",",
                  header="tet,young [Pa]", comments="")
    seen = numpy.flatnonzero((places[:, 2] > 0) & (numpy.isin(places, (0, 0.1)).any(axis=1)))
    exact = {}
    for scene, load in ("pull", [0, 0, 2000]), ("shear", [1000, 0, 0]):
        with open(scene + ".yaml", "w") as file:
            file.write(BLOCK % load)
        run(flesh, ["run", scene + ".yaml", "--out", "true", "--quiet", "--set", "body.material_map=truth.csv", "--set",
                    "solver.newton_tolerance=1e-8"])
        exact[scene] = numpy.loadtxt("true/state.txt")[seen, :3]
    with open("spec.yaml", "w") as file:
        file.write("experiments:\n" + "".join(f"  - {{name: {s}, scene: {s}.yaml, measured: [{{positions: {s}.csv, deviation: 2e-5}}]}}\n"
                                              for s in exact) +
                   f"map: {{constant: young, start: 4e4, penalty: {penalty}}}\nparameters:\n"
                   "  - {key: \"effects.traction.traction[0]\", name: load, start: 500, experiments: [shear]}\n")
    held, widths, loads, runs, scale = [], [], [], [], []
    for seed in range(1, seeds + 1):
        random = numpy.random.default_rng((len(name), seed))
        for scene, x in exact.items():
            numpy.savetxt(scene + ".csv", numpy.c_[seen, x + 2e-5 * random.normal(size=x.shape)], fmt=["%d"] + ["%.17g"] * 3,
                          delimiter=",", header="node,x,y,z", comments="")
        subprocess.run(["rm", "-rf", "fit"], check=True)
        run(flesh, ["fit", "spec.yaml", "--out", "fit", "--quiet"])
        low, high = numpy.loadtxt("fit/tets.csv", delimiter=",", skiprows=1, usecols=(5, 6)).T
        held.append(numpy.mean((low <= young) & (young <= high)))
        widths.append(numpy.median((high - low) / young))
        with open("fit/result.json") as file:
            result = json.load(file)
        loads.append(result["parameters"][0])
        runs.append(result["runs"]["used"])
        scale.append(result["residuals"]["scale"])
    inside = sum(one["low_95"] <= 1000 <= one["high_95"] for one in loads)
    width = numpy.median([(one["high_95"] - one["low_95"]) / 1000 for one in loads])
    rest = f"{numpy.median(scale):.2f} | {numpy.median(runs):.0f} |"
    return [f"| {name} | {len(young)} tets | {100 * numpy.mean(held):.0f} % | {100 * numpy.median(widths):.2g} % | {rest}",
            f"| {name} | load | {inside} of {seeds} | {100 * width:.2g} % | {rest}"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--full", dest="seeds", action="store_const", const=100, default=10)
    parser.add_argument("--seeds", type=int)
    parser.add_argument("--flesh", default="build/drivers/flesh")
    parser.add_argument("--table")
    parser.add_argument("--case", choices=[*CASES, *MAPS])
    given = parser.parse_args()
    flesh, seeds, bad, lines = os.path.abspath(given.flesh), given.seeds, 0, []
    table = open(given.table, "w") if given.table else sys.stdout
    for name, case in CASES.items():
        if given.case not in (None, name):
            continue
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            run(flesh, ["mesh", "box", "--cells", "2,2,2", "--size", "1,1,1", "--out", "cube.mesh"])
            found = measure(flesh, case[0], case[1])
            results = [fit(flesh, found, name, seed) for seed in range(1, seeds + 1)]
            os.chdir("/")
        runs = numpy.median([result["runs"]["used"] for _, result in results])
        scale = numpy.median([result["residuals"]["scale"] for _, result in results])
        for parameter in results[0][0]:
            rows = [one[parameter] for one, _ in results]
            holds = sum(low is not None and low <= true <= high for true, low, high in rows)
            width = numpy.median([(high - low) / true for true, low, high in rows if low is not None])
            bad += not (holds >= (0.88 if seeds >= 100 else 0.8) * seeds)
            lines.append(f"| {name} | {parameter} | {holds} of {seeds} ({100 * holds / seeds:.0f} %) | {100 * width:.2g} % | "
                         f"{scale:.2f} | {runs:.0f} |")
    for name in MAPS:
        if given.case in (None, name):
            with tempfile.TemporaryDirectory() as folder:
                os.chdir(folder)
                lines += map_rows(flesh, name, min(seeds, 30))
                os.chdir("/")
    print("| case | parameter | intervals that hold | width (median) | residuals, in stated deviations | runs |", file=table)
    print("|---|---|---|---|---|---|", file=table)
    print("\n".join(lines), file=table)
    return bad > 0


if __name__ == "__main__":
    sys.exit(main())
