#!/usr/bin/env python3
"""tolerances.py: the cost of `method: adaptive` compared with the best fixed step, and whether its error follows the
tolerance.

    python3 test/campaign/tolerances.py [--quick] [--scenes LIST] [--max-seconds S] [--flesh PROGRAM] [--out FOLDER]

Twenty scenes: seven of data/scenes, most of them shortened, and thirteen of this file. `flesh accuracy` measures each
with all fixed methods at steps from twice the scene's to its 64th, and adaptive steps at tolerances from 1e-1 to 1e-5.
For errors of 1, 0.1 and 0.01 % of the motion the table has CPU time and Newton iterations of adaptive steps over those
of the fixed steps that need the least, both interpolated in logarithms between settings. A setting counts if all finer
ones of its method reach the error, too. Then, over the four decades, the least and the largest error over the
tolerance: for tolerances below the motion, and errors at least three times that of the reference. With --quick steps go
to the 8th and tolerances to 1e-4. Results in FOLDER are not measured again. The exit status is 0 if every CPU time is
at most twice that of fixed steps.
"""
import argparse
import csv
import json
import math
import os
import subprocess
import sys

SCENES = os.path.join(os.path.dirname(os.path.realpath(__file__)), "..", "..", "data", "scenes")
FIXED = ("backward-euler", "bdf2", "midpoint", "newmark", "hht", "generalized-alpha")
SHARES = (1e-2, 1e-3, 1e-4)
# Scenes of data/scenes with their ends in s, None: as they are.
OURS = {"swing_coarse": None, "whip": 0.5, "twist": 0.5, "hinged": None, "settling_drop": 0.5, "floating": 0.3, "damped_bar": 0.1}
MESHES = (("cube", "4,4,4", "0.1,0.1,0.1"), ("bar", "6,2,2", "0.3,0.1,0.1"), ("beam", "3,1,1", "0.3,0.1,0.1"),
          ("lump", "1,1,1", "0.06,0.06,0.06"), ("pad", "2,1,2", "0.1,0.03,0.1"), ("strip", "10,2,1", "0.3,0.06,0.01"),
          ("block", "2,2,1", "0.1,0.1,0.05"), ("rod", "4,1,1", "0.2,0.05,0.05"))
BAR, BEAM = "mesh: bar.msh, density: 1000", "mesh: beam.msh, density: 1000, element: tet10-mean"
HELD = "pin: {box: [[-1, -1, -1], [1e-9, 1, 1]]}"
OWN = {
    "impact": """body: {mesh: cube.msh, density: 1000, material: {energy: S, young: 2e4, poisson: 0.4}}
effects: [inertia, gravity, contact: {plane: {point: [0, 0, -0.05], normal: [0.3, 0.2, 1]}}]
start: {velocity: [0.2, 0, -1]}
time: {step: 1/60, end: 0.3}
""",
    "muscle": f"""body: {{{BAR}, material: {{energy: S, young: 3e4, poisson: 0.45}}}}
effects:
  - inertia: {{}}
  - {HELD}
  - muscle:
      box: [[-1, -1, 0.05], [1, 1, 1]]
      fibres: {{direction: [1, 0, 0]}}
      peak_stress: 2e4
      interpolation: smooth
      activation: [{{time: 0, value: 0}}, {{time: 0.2, value: 0.7}}, {{time: 0.4, value: 0.1}}]
time: {{step: 1/60, end: 0.5}}
""",
    "wring": f"""body: {{{BEAM}, material: {{energy: S, young: 5e4, poisson: 0.4999}}}}
effects:
  - inertia: {{}}
  - {HELD}
  - prescribed_motion:
      box: [[0.2999, -1, -1], [1, 1, 1]]
      centre: [0.3, 0.05, 0.05]
      motion: [{{time: 0}}, {{time: 0.2, rotation: [3, 0, 0]}}]
      interpolation: smooth
time: {{step: 1/60, end: 0.3}}
""",
    "half": f"""body: {{{BEAM}, material: {{energy: S, young: 5e4, poisson: 0.5}}}}
effects: [inertia, gravity: {{acceleration: [0, 0, -5]}}, {HELD}]
time: {{step: 1/60, end: 0.1}}
""",
    "flag": f"""body: {{{BAR}, material: {{energy: Neo, young: 1e5, poisson: 0.3}}}}
effects:
  - inertia: {{}}
  - gravity: {{}}
  - pin: {{box: [[-1, -1, -1], [1e-9, 1e-9, 1]]}}
  - drag: {{box: [[-9, -9, -9], [9, 9, 9]], density: 50, velocity: [4, 3, 0]}}
start: {{velocity: [0, 0, 2]}}
time: {{step: 1/60, end: 0.6}}
""",
    "blow": f"""body: {{{BEAM}, material: {{energy: S, young: 5e4, poisson: 0.499}}}}
effects: [inertia, {HELD}, contact: {{sphere: {{centre: [0.25, 0.05, -0.06], radius: 0.05}}}}]
start: {{velocity: [0, 0, -1]}}
time: {{step: 1/60, end: 0.08}}
""",
    "grasp": f"""body: {{name: lump, mesh: lump.msh, density: 1000, material: {{energy: S, young: 3e4, poisson: 0.45}}}}
bodies:
  - {{name: left, mesh: pad.msh, translation: [-0.01, -0.035, -0.02]}}
  - {{name: right, mesh: pad.msh, translation: [-0.03, 0.065, -0.015]}}
effects:
  - inertia: {{}}
  - viscosity: {{shear: 100, bulk: 100}}
  - prescribed_motion:
      body: left
      box: [[-1, -1, -1], [1, -0.0349, 1]]
      motion: [{{time: 0}}, {{time: 0.15, translation: [0, 0.015, 0]}}, {{time: 0.4, translation: [0, 0.015, 0.04]}}]
      interpolation: smooth
  - prescribed_motion:
      body: right
      box: [[-1, 0.0949, -1], [1, 1, 1]]
      motion: [{{time: 0}}, {{time: 0.15, translation: [0, -0.015, 0]}}, {{time: 0.4, translation: [0, -0.015, 0.04]}}]
      interpolation: smooth
  - contact: {{between: all, friction: 0.5, thickness: 0.004}}
time: {{step: 1/60, end: 0.2}}
""",
    "crumple": f"""body: {{mesh: strip.msh, density: 1000, material: {{energy: S, young: 1e5, poisson: 0.45}}}}
effects:
  - inertia: {{}}
  - viscosity: {{shear: 200, bulk: 200}}
  - {HELD}
  - prescribed_motion:
      box: [[0.2999, -1, -1], [1, 1, 1]]
      centre: [0.3, 0.03, 0.005]
      motion: [{{time: 0}}, {{time: 0.3, translation: [-0.2, 0, 0], rotation: [8, 0, 0]}}]
      interpolation: smooth
  - contact: {{between: self, friction: 0.2, thickness: 0.003}}
time: {{step: 1/60, end: 0.3}}
""",
    "pile": """body: {name: a, mesh: block.msh, density: 1000, material: {energy: S, young: 1e5, poisson: 0.45}}
bodies:
  - {name: b, mesh: block.msh, translation: [0.02, 0.01, 0.052], rotation: [0, 0, 0.2]}
  - {name: c, mesh: block.msh, translation: [0, 0.02, 0.104], rotation: [0, 0, -0.2]}
effects:
  - inertia: {}
  - gravity: {}
  - viscosity: {shear: 300, bulk: 300}
  - contact: {between: all, friction: 0.5, thickness: 0.002}
  - contact: {plane: {point: [0, 0, -0.002]}, friction: 0.5, thickness: 0.002}
time: {step: 1/60, end: 0.15}
""",
    "slope": """body: {mesh: block.msh, density: 1000, material: {energy: S, young: 5e4, poisson: 0.45}}
effects:
  - inertia: {}
  - gravity: {acceleration: [4, 0, -9]}
  - viscosity: {shear: 100, bulk: 100}
  - contact: {plane: {point: [0, 0, -0.002]}, friction: 0.2, thickness: 0.002}
time: {step: 1/60, end: 0.3}
""",
    "tear": f"""body: {{name: a, mesh: rod.msh, density: 1000, material: {{energy: S, young: 5e4, poisson: 0.4}}}}
bodies: [{{name: b, mesh: rod.msh, translation: [0.2, 0, 0]}}]
effects:
  - inertia: {{}}
  - viscosity: {{shear: 20, bulk: 20}}
  - {HELD}
  - prescribed_motion:
      box: [[0.3999, -1, -1], [1, 1, 1]]
      motion: [{{time: 0}}, {{time: 0.2, translation: [0.08, 0, 0.02]}}]
      interpolation: smooth
  - weld: {{bodies: [a, b], breaks_at: 8e3}}
time: {{step: 1/60, end: 0.25}}
""",
    "door": f"""body: {{name: a, mesh: rod.msh, density: 1000, material: {{energy: S, young: 2e5, poisson: 0.4}}}}
bodies: [{{name: b, mesh: rod.msh, translation: [0.21, 0, 0], velocity: [0, 1, 0]}}]
effects:
  - inertia: {{}}
  - {HELD}
  - joint:
      first: {{body: a, box: [[0.14, -1, -1], [1, 1, 1]]}}
      second: {{body: b, box: [[-1, -1, -1], [0.27, 1, 1]]}}
      point: [0.205, 0.025, 0.025]
      axis: [0, 0, 0.05]
      stiffness: 2e4
  - joint:
      first: {{body: a, box: [[0.09, -1, -1], [0.16, 1, 1]]}}
      second: {{body: b, box: [[0.25, -1, -1], [0.32, 1, 1]]}}
      point: [0.15, 0.05, 0.025]
      to: [0.26, 0.05, 0.025]
      stiffness: 100
time: {{step: 1/60, end: 0.6}}
""",
    "sway": f"""body: {{{BEAM}, material: {{energy: S, young: 1e5, poisson: 0.4999}}}}
effects: [inertia, gravity, viscosity: {{shear: 20, bulk: 20}}, {HELD}]
start: {{velocity: [0, 1, 0]}}
time: {{step: 1/60, end: 0.3}}
""",
}


def make_scene(name, arguments):
    """Returns the path of a scene, and the settings that go with it."""
    if name in OURS:
        return os.path.join(SCENES, name + ".yaml"), [f"time.end={OURS[name]}"] if OURS[name] else []
    for mesh, cells, size in MESHES:
        path = os.path.join(arguments.out, mesh + ".msh")
        if not os.path.exists(path):
            subprocess.run([arguments.flesh, "mesh", "box", "--cells", cells, "--size", size, "--out", path], check=True,
                           stdout=subprocess.DEVNULL)
    path = os.path.join(arguments.out, name + ".yaml")
    with open(path, "w", encoding="utf-8") as file:
        file.write(OWN[name])
    return path, []


def measure(name, arguments):
    """Returns the rows of accuracy.csv; without one, exits with the reason."""
    path, values = make_scene(name, arguments)
    out = os.path.join(arguments.out, name)
    finest = [] if arguments.quick else ["--tolerances", "1e-1,1e-2,1e-3,1e-4,1e-5"]
    if not os.path.exists(os.path.join(out, "accuracy.csv")):
        done = subprocess.run(["nice", arguments.flesh, "accuracy", path, "--methods", ",".join(FIXED + ("adaptive",)),
                               *(["--quick"] if arguments.quick else finest), "--max-seconds", str(arguments.max_seconds),
                               "--reference-seconds", str(arguments.max_seconds), "--repeat", "1", "--out", out,
                               *(word for value in values for word in ("--set", value))],
                              capture_output=True, text=True, check=False)
        if done.returncode:
            return None, (done.stderr.strip().splitlines() or [f"exit {done.returncode}"])[-1]
    with open(os.path.join(out, "accuracy.csv"), encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["price"] == "work"]
    with open(os.path.join(out, "accuracy.json"), encoding="utf-8") as file:
        reference = json.load(file)["reference"]
    unknown, motion = reference["uncertainty_position_rms"], reference["motion"]
    for row in rows:
        row["counts"] = float(row["error_position_rms"] or 0) > 3 * unknown and float(row["value"]) * reference["length"] < motion
        # An error below that of the reference is only known to be no larger.
        row["share"] = float(row["error_over_motion"] or (unknown / motion if row["status"] == "below reference" else math.inf))
    return rows, ""


def cost(rows, method, share, column):
    """Returns the method's cost for an error of that fraction of the motion, interpolated; None: not reached."""
    settings = [row for row in rows if row["method"] == method]
    reached = None
    for finer in reversed(settings):
        error = finer["share"]
        if error > share:
            if reached and error < math.inf:
                place = math.log(error / share) / math.log(error / reached[0])
                value = float(finer[column])
                return value * (reached[1] / value) ** place if value > 0 else reached[1]
            break
        reached = error, float(finer[column])
    return reached and reached[1]


def line(name, rows):
    """Returns a line of the table, and the largest ratio of CPU times."""
    cells, most = [], 0
    for share in SHARES:
        ratios = []
        for column in ("cpu_s", "newton"):
            fixed = [(cost(rows, method, share, column), method) for method in FIXED]
            fixed = min([pair for pair in fixed if pair[0]], default=None)
            own = cost(rows, "adaptive", share, column)
            alone = "adaptive alone" if own else "fixed alone" if fixed else "-"
            ratios.append(f"{own / fixed[0]:.2f}" if own and fixed else alone)
            if column == "cpu_s" and own and fixed:
                most = max(most, own / fixed[0])
        cells.append(alone if ratios[0] == alone else ", ".join(ratios))
    errors = [float(row["error_over_tolerance"]) for row in rows
              if row["method"] == "adaptive" and row["error_over_tolerance"] and row["counts"]]
    spread = f"{min(errors):.2g} to {max(errors):.2g}" if errors else "-"
    return f"| {name} | {' | '.join(cells)} | {spread} | {max(errors) / min(errors) if errors else 0:.1f} |", most


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--scenes", default=",".join([*OWN, *OURS]))
    parser.add_argument("--max-seconds", type=float, default=15)
    parser.add_argument("--flesh", default="build/drivers/flesh")
    parser.add_argument("--out", default="out/tolerances")
    arguments = parser.parse_args()
    arguments.flesh = os.path.abspath(arguments.flesh)
    os.makedirs(arguments.out, exist_ok=True)
    print("| scene | 1 %: CPU, Newton | 0.1 % | 0.01 % | error over tolerance | largest over least |")
    print("|---|---|---|---|---|---|")
    worst = 0
    for name in arguments.scenes.split(","):
        rows, why = measure(name, arguments)
        text, most = line(name, rows) if rows else (f"| {name} | {why} |||||", math.inf)
        print(text, flush=True)
        worst = max(worst, most)
    return 0 if worst <= 2 else 1


if __name__ == "__main__":
    sys.exit(main())
