#!/usr/bin/env python3
"""error_bars.py: coverage and sharpness of `flesh run --error` on random bodies, loads and motions.

    python3 test/campaign/error_bars.py [--full] [--set chosen|tried|fresh|later] [--flesh PROGRAM] [--table FILE] [--only KIND]

Every case is a random bar, block or plate of flesh (Poisson's ratio .25 to .4999), clamped at one end, under its weight
or with its other end moved; a twist or a taper warps most of them. Shapes are shells, brackets, tori, re-entrant
corners, limbs, plates with holes and domes by gmsh (shapes.py), under their weight, a pressure or a pull; short ones
move for ten steps, every other stepped one is by backward Euler. Thin bodies, brackets, clips, plates with holes, tubes
and half rings one or two tets across, are for --to alone; no set of theirs chose a factor. Bars are compared with a
finer answer: for the mesh tet10-mean on meshes refined twice more, extrapolated (of motions and of shapes of more than
110 tets once more); for `--to 1%` of a tip `--to 0.25%` from finer meshes; for the step Newmark's rule with steps of a
sixteenth, of `adaptive` a hundredth of the tolerance. A bar covers the error if it is not less than the error at all
times. Sharpness is the largest bar over the largest error. The factors were chosen on the set `chosen`, those of moving
shapes also on `tried`; `fresh` and `later` have seeds that chose none. The exit status is 0 if the bars of every kind
cover 95 % of the rows and their median sharpness is at most 6.
"""
import argparse
import csv
import json
import math
import os
import random
import re
import statistics
import subprocess
import sys
import tempfile

import shapes

RATIOS = [0.25, 0.3, 0.4, 0.45, 0.49, 0.499, 0.4999]
METHODS = ["bdf2", "newmark", "midpoint", "generalized-alpha", "hht", "backward-euler", "adaptive"]
SEEDS = {"chosen": 1, "tried": 4, "fresh": 7, "later": 11}
# Cases of each kind: short, full.
COUNTS = {"statics": (3, 16), "motion": (1, 6), "step": (7, 84), "adapted": (1, 60), "thin": (2, 40),
          "shapes": (0, 28), "moving shapes": (0, 14), "short shapes": (0, 14), "stepped shapes": (0, 60)}
MOTIONS = ["motion", "moving shapes", "short shapes", "stepped shapes"]
THIN_DOFS = 18000
SHAPES = ["shell", "bracket", "torus", "corner", "limb", "plate", "dome"]

SCENE = """body:
  mesh: {mesh}
  density: 1000
  material: {{energy: S, constants: matched, young: {young}, poisson: {poisson}}}
effects:
{inertia}  - gravity: {{acceleration: {gravity}}}
  - pin: {{box: {held}}}
{motion}start: {{velocity: {velocity}}}
time: {{method: {method}, step: {step}, end: {end}}}
solver: {{newton_tolerance: 1e-7}}
output:
  frame_interval: 0
  probes:
    - {{name: tip, point: {tip}, quantities: [position]}}
    - {{name: middle, point: {middle}, quantities: [stress]}}
    - {{name: wall, box: {held}, quantities: [reaction]}}
"""


def warp(path, length, kind, amount):
    """Twists or tapers the mesh along x, keeping the plane x = 0."""
    with open(path, encoding="utf-8") as file:
        lines = file.read().split("\n")
    at = lines.index("Vertices") + 2
    for k in range(at, at + int(lines[at - 1])):
        x, y, z, *rest = lines[k].split()
        x, y, z = float(x), float(y), float(z)
        if kind == "twist":
            c, s = math.cos(amount * x / length), math.sin(amount * x / length)
            y, z = c * y - s * z, s * y + c * z
        else:
            y, z = y * (1 - amount * x / length), z * (1 - amount * x / length)
        lines[k] = " ".join([repr(x), repr(y), repr(z), *rest])
    with open(path, "w", encoding="utf-8") as file:
        file.write("\n".join(lines))


def make_case(flesh, folder, kind, rng):
    """Returns a scene and its keys of interest by name."""
    shape = rng.choice(["bar", "block", "plate"])
    cells, size = {"bar": ((4, 1, 1), (rng.uniform(3, 5), 1, rng.uniform(.7, 1.3))),
                   "block": ((2, 2, 2), (rng.uniform(.8, 1.5), 1, rng.uniform(.8, 1.2))),
                   "plate": ((3, 3, 1), (rng.uniform(2, 3), rng.uniform(2, 3), .5))}[shape]
    mesh = os.path.join(folder, "body.mesh")
    subprocess.run([flesh, "mesh", "box", "--cells", ",".join(map(str, cells)), "--size", ",".join(map(str, size)),
                    "--origin", f"0,{-size[1] / 2},{-size[2] / 2}", "--out", mesh], check=True, capture_output=True)
    how, amount = rng.choice([("none", 0), ("twist", rng.uniform(.2, .8)), ("taper", rng.uniform(.2, .5))])
    if how != "none":
        warp(mesh, size[0], how, amount)
    length, thick = size[0], min(size[1:])
    young = 10 ** rng.uniform(4.5, 6.5)
    strain = 10 ** rng.uniform(-2, -.6)
    bends = (length / thick) ** 2
    weight = strain * young * thick / bends / 1000 / thick * thick / length
    direction = [rng.gauss(0, 1) for _ in range(3)]
    norm = math.sqrt(sum(d * d for d in direction))
    load = [weight * d / norm for d in direction]
    period = 2 * math.pi / 3.52 * length ** 2 / thick * math.sqrt(12 * 1000 / young)
    moved = kind == "statics" and rng.random() < .4
    case = {"shape": shape, "poisson": rng.choice(RATIOS), "warp": how, "load": "moved" if moved else "weight",
            "method": "static"}
    keys = {"mesh": mesh, "young": young, "poisson": case["poisson"], "inertia": "", "gravity": load, "motion": "",
            "held": [[-9, -9, -9], [1e-9, 9, 9]], "velocity": [0, 0, 0], "method": "static", "step": 1, "end": 1,
            "middle": [.37 * length, .013, .017], "tip": [length * .999, .05, .05]}
    if moved:
        keys["gravity"] = [0, 0, 0]
        keys["motion"] = (f"  - prescribed_motion:\n      box: [[{length - 1e-6}, -9, -9], [9, 9, 9]]\n"
                          f"      motion: [{{time: 0}}, {{time: 1, translation: "
                          f"{[strain * length * d / norm for d in direction]}}}]\n")
        keys["tip"][0] = length * .6
    if kind != "statics":
        case["method"] = "newmark" if kind == "motion" else rng.choice(METHODS)
        steps = 40 if kind == "motion" else rng.randint(12, 90)
        keys.update(method=case["method"], inertia="  - inertia: {}\n", step=period / steps,
                    end=period * (.75 if kind == "motion" else 1.5))
        if kind == "step" and rng.random() < .5:
            keys["gravity"] = [0, 0, 0]
            keys["velocity"] = [5 * strain * length / period * d / norm for d in direction]
            case["load"] = "thrown"
    path = os.path.join(folder, "case.yaml")
    with open(path, "w", encoding="utf-8") as file:
        file.write(SCENE.format(**keys))
    return case, path, keys


def make_shape(folder, kind, rng, k):
    """Returns a scene of a body by gmsh and its keys of interest by name."""
    among = shapes.THIN if kind == "thin" else SHAPES
    shape = among[k % len(among)]
    tets, held, pushed, tip, middle, length, thick = shapes.mesh(shape, rng, os.path.join(folder, "body"))
    young, strain = 10 ** rng.uniform(4.5, 6.5), 10 ** rng.uniform(-2, -.8)
    direction = [rng.gauss(0, 1) for _ in range(3)]
    norm = math.sqrt(sum(d * d for d in direction))
    unit = [d / norm for d in direction]
    stress = strain * young * (thick / length) ** 2  # load that bends a bar of this length by strain * length
    load = rng.choice(["weight", "pressure", "pull"])
    moving = kind in MOTIONS
    case = {"shape": shape, "poisson": rng.choice(RATIOS), "warp": "none", "load": load,
            "method": "newmark" if moving else "static"}
    effect = {"weight": "", "pressure": f"  - pressure: {{box: {pushed}, pressure: {rng.choice([-1, 1]) * stress}}}\n",
              "pull": f"  - traction: {{box: {pushed}, traction: {[stress * d for d in unit]}}}\n"}[load]
    period = 2 * math.pi / 3.52 * length ** 2 / thick * math.sqrt(12 * 1000 / young)
    keys = {"mesh": os.path.join(folder, "body.msh"), "young": young, "poisson": case["poisson"], "held": held,
            "inertia": "  - inertia: {}\n" if moving else "", "motion": effect, "velocity": [0, 0, 0],
            "gravity": [3 * stress / length / 1000 * d if load == "weight" else 0 for d in unit],
            "method": case["method"], "step": period / 40 if moving else 1, "end": (.25 if kind == "short shapes" else .5) * period if moving else 1,
            "middle": middle, "tip": tip, "large": tets > 110}
    if kind == "stepped shapes":
        case["method"] = keys["method"] = "backward-euler" if k % 2 else rng.choice(METHODS)
        keys["step"] = keys["end"] / rng.choice([12, 20, 30, 45])
    path = os.path.join(folder, "case.yaml")
    with open(path, "w", encoding="utf-8") as file:
        file.write(SCENE.format(**keys))
    return case, path, keys


def run(flesh, path, out, *words):
    """Returns the numbers of a run by column, with its seconds and result."""
    done = subprocess.run([flesh, "run", path, "--out", out, "--quiet", *words], capture_output=True, text=True)
    if done.returncode:
        return None
    columns = {}
    for name in ("history.csv", "probes.csv"):
        with open(os.path.join(out, name), encoding="utf-8") as file:
            rows = list(csv.reader(file))
        for k, column in enumerate(rows[0]):
            columns[column.split(" ")[0]] = [float(row[k] or "nan") for row in rows[1:]]
    with open(os.path.join(out, "result.json"), encoding="utf-8") as file:
        columns["result"] = json.load(file)
    return columns


def extrapolate(a, b, c):
    """Returns the limit of a sequence if its differences fall by a ratio below 1; else the last term."""
    d, e = b - a, c - b
    return c + e * e / (d - e) if d and 0 < e / d < .7 else c


def reference(flesh, kind, path, folder, keys, level):
    """Computes the finer answer, with the rows of the run; None if there is none, or if finer meshes end with inverted
    tets."""
    if keys["method"] == "adaptive":
        finer = run(flesh, path, os.path.join(folder, "fine"), "--set", "time.tolerance=1e-6")
        return finer and {name: values for name, values in finer.items() if name != "result"}
    if "step" in kind:
        finer = run(flesh, path, os.path.join(folder, "fine"), "--method", "newmark", "--set",
                    f"time.step={keys['step'] / 16!r}")
        return finer and {name: values[::16] + ([] if (len(values) - 1) % 16 == 0 else values[-1:])
                          for name, values in finer.items() if name != "result"}
    runs = [run(flesh, path, os.path.join(folder, f"fine{k}"), "--set", "body.element=tet10-mean", "--set",
                f"body.refine={level + k}") for k in ((-1, 0, 1) if keys.get("large") or kind in MOTIONS else (0, 1, 2))]
    if not all(runs) or any(finer["result"]["figures"]["final_inverted"] for finer in runs):
        return None
    return {name: [extrapolate(*three) for three in zip(values, runs[1][name], runs[2][name])]
            for name, values in runs[0].items() if name != "result"}


def judge(case, kind, of, given, exact):
    """Yields a row for each quantity: whether it has a bar, whether the bar covers, and how wide it is."""
    for name in exact:
        what = ("position" if ".position" in name else "reaction" if ".reaction_" in name and "moment" not in name else
                "stress" if ".stress" in name else "energy" if name == "energy_elasticity" else None)
        if not what or "_error_" in name:
            continue
        begin = what == "reaction"  # at the start these need not balance
        errors = [abs(a - b) for a, b in zip(given[name], exact[name])][begin:]
        group = [other for other in exact if other.split("_")[0] == name.split("_")[0] and "_error_" not in other
                 and "moment" not in other and other.split("_")[0] != "energy"] or [name]
        spans = [exact[other][begin:] + [0] * begin for other in group]
        scale = max(max(span) - min(span) for span in spans)
        if max(errors) < 1e-4 * scale:
            continue
        bars = given.get(f"{name}_error_{of}")
        row = dict(case, kind=kind, of=of, quantity=what, error=f"{max(errors) / scale:.3g}")
        if bars:
            bars = bars[begin:]
            factor = given["result"]["error_bars"][of]["factor"]
            small = 1e-4 * scale
            need = max((e - small) / b if b else 0 if e <= small else math.inf for e, b in zip(errors, bars))
            row.update(needs=f"{need * factor:.3g}", factor=factor, ratio=f"{max(bars) / max(errors):.3g}",
                       covers=sum(b >= e - 1e-4 * scale for e, b in zip(errors, bars)) / len(errors))
        yield row


def adapt(flesh, path, out, name, tolerance, *words):
    """Returns the meshes of `flesh run --to`, or None."""
    done = subprocess.run([flesh, "run", path, "--to", f"{tolerance}:{name}", "--out", out, "--quiet", "--max-seconds",
                           "300", *words], capture_output=True, text=True)
    if done.returncode:
        print(" ".join(done.stderr.split()), file=sys.stderr)
        return None
    with open(os.path.join(out, "result.json"), encoding="utf-8") as file:
        return json.load(file)["adapted_mesh"]["meshes"]


def read_end(folder):
    """Returns the last row of the probes by column."""
    with open(os.path.join(folder, "probes.csv"), encoding="utf-8") as file:
        return {name.split(" ")[0]: float(value) for name, value in list(csv.DictReader(file))[-1].items()}


def find_widest(flesh, path, folder, keys):
    """Returns the column of the tip's direction in which it moves most, and by how much."""
    coarse = run(flesh, path, os.path.join(folder, "coarse"), "--set", "body.element=tet10-mean")
    moved = {c: abs(coarse[f"tip.position_{c}"][-1] - rest) if coarse else 0 for c, rest in zip("xyz", keys["tip"])}
    widest = max(moved, key=moved.get)
    return f"tip.position_{widest}", moved[widest]


def try_adapted(flesh, folder, rng):
    """Yields a row: the tip to 1 % along the direction in which it moves most, against .25 % on meshes that start
    finer."""
    case, path, keys = make_case(flesh, folder, "statics", rng)
    name, moved = find_widest(flesh, path, folder, keys)
    folders = [os.path.join(folder, "given"), os.path.join(folder, "exact")]
    given = moved and adapt(flesh, path, folders[0], name, "1%")
    exact = given and adapt(flesh, path, folders[1], name, "0.25%", "--set", "body.refine=1")
    ends = [read_end(out) for out in folders] if exact else []
    if exact and max(abs(ends[0][f"tip.position_{c}"] - ends[1][f"tip.position_{c}"]) for c in "xyz") > .2 * moved:
        print("another equilibrium on finer meshes", file=sys.stderr)
    elif exact:
        yield tell_adapted(case, "adapted", abs(given[-1]["value"] - exact[-1]["value"]), 0, given[-1]["error_mesh"], moved,
                           given[-1]["dofs"])


def tell_adapted(case, kind, error, unsure, bar, moved, dofs):
    """Returns the row of a mesh whose bar covers an error that is known to `unsure`."""
    return dict(case, kind=kind, of="mesh", element="tet10-mean", quantity="position", factor=1, error=f"{error / moved:.3g}",
                needs=f"{error / bar:.3g}", ratio=f"{bar / max(error, unsure):.3g}", covers=float(error <= bar + unsure),
                cost=str(dofs))


def follow(flesh, path, out, name):
    """Returns the meshes reported by --to up to THIN_DOFS: dofs, value and bar (0: none)."""
    meshes = []
    words = [flesh, "run", path, "--to", f"1e-9:{name}", "--out", out]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        for line in process.stdout:
            found = re.match(r"mesh (\d+): \d+ tets, (\d+) dofs: .*?(?: \+/- (.*))?$", line)
            if found:
                value = read_end(os.path.join(out, "to", found[1]))[name]
                meshes.append((int(found[2]), value, float(found[3] or 0)))
            if meshes and meshes[-1][0] > THIN_DOFS:
                process.terminate()
                break
    return meshes


def try_thin(flesh, folder, k, rng):
    """Yields rows of the first bars within 3, 1, .5 and .3 % of the tip's displacement. The reference is the last mesh
    of at most 10 000 dofs refined once; its error is assumed to be .37 of the change, with an uncertainty of .15 of
    it."""
    case, path, keys = make_shape(folder, "thin", rng, k)
    name, moved = find_widest(flesh, path, folder, keys)
    out = os.path.join(folder, "to")
    meshes = follow(flesh, path, out, name) if moved else []
    last = max((i for i, mesh in enumerate(meshes) if mesh[0] <= 10000), default=0)
    finer = meshes and run(flesh, os.path.join(out, "to", str(last), "scene.yaml"), os.path.join(folder, "fine"), "--set",
                           "body.refine=1")
    if not finer:
        return
    change = finer[name][-1] - meshes[last][1]
    exact, unsure = finer[name][-1] + .37 * change, .15 * abs(change)
    firsts = {next((i for i, mesh in enumerate(meshes) if 0 < mesh[2] <= share * moved), None)
              for share in (.03, .01, .005, .003)}
    for i in sorted(firsts - {None}):
        dofs, value, bar = meshes[i]
        yield tell_adapted(case, "thin", abs(value - exact), unsure, bar, moved, dofs)


def try_case(flesh, folder, kind, k, rng):
    """Yields the rows of a case."""
    if kind == "adapted":
        yield from try_adapted(flesh, folder, rng)
        return
    if kind == "thin":
        yield from try_thin(flesh, folder, k, rng)
        return
    case, path, keys = make_shape(folder, kind, rng, k) if "shapes" in kind else make_case(flesh, folder, kind, rng)
    level = 0 if "step" in kind else 1
    runs = [("step", "tet4", ())] if "step" in kind else [
        ("mesh", "tet4", ("--set", "body.refine=1")),
        ("mesh", "tet10-mean", ("--set", "body.refine=1", "--set", "body.element=tet10-mean"))]
    exact = reference(flesh, kind, path, folder, keys, level)
    for of, element, words in runs if exact else []:
        given = run(flesh, path, os.path.join(folder, element), "--error", *words)
        if given:
            own = given["result"]["figures"]["cpu_s"]
            spent = sum(c["cpu_s"] for c in given["result"]["error_bars"][of].get("companions", []))
            case.update(element=element, cost=f"{spent / own:.3g}")
            yield from judge(case, kind, of, given, exact)


def tell(rows):
    """Prints a table by kind; returns whether everything meets the limits."""
    good = True
    print("| bars | of | cases | with a bar | covered at all times | rows covered | median width |")
    print("|---|---|---|---|---|---|---|")
    for group in sorted({(r["kind"], r["element"], r["method"] if "step" in r["kind"] else "") for r in rows}):
        for what in ("position", "energy", "reaction", "stress", "all"):
            own = [r for r in rows if (r["kind"], r["element"], r["method"] if "step" in r["kind"] else "") == group
                   and what in (r["quantity"], "all")]
            bars = [r for r in own if "needs" in r]
            if not bars:
                continue
            covered = sum(r["covers"] >= 1 for r in bars) / len(bars)
            parts = statistics.mean(r["covers"] for r in bars)
            width = statistics.median(float(r["ratio"]) for r in bars)
            print(f"| {' '.join(group)} | {what} | {len(own)} | {len(bars)} | {covered:.0%} | {parts:.1%} | {width:.2g} |")
            good &= what != "all" or (parts >= .95 and width <= 6)
    return good


def main():
    """Reads the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--full", action="store_true")
    parser.add_argument("--set", choices=SEEDS, default="tried", dest="seeds")
    parser.add_argument("--flesh", default="build/drivers/flesh")
    parser.add_argument("--table")
    parser.add_argument("--only", choices=COUNTS)
    words = parser.parse_args()
    rows = []
    for kind, counts in COUNTS.items():
        for k in range(counts[words.full] if words.only in (None, kind) else 0):
            rng = random.Random(f"{SEEDS[words.seeds]} {kind} {k}")
            with tempfile.TemporaryDirectory() as folder:
                found = [dict(row, case=k) for row in try_case(os.path.abspath(words.flesh), folder, kind, k, rng)]
                print(kind, k, len(found), file=sys.stderr)
                rows += found
    if words.table:
        with open(words.table, "w", encoding="utf-8", newline="") as file:
            names = ["kind", "case", "shape", "warp", "poisson", "load", "method", "element", "of", "quantity", "error",
                     "factor", "needs", "ratio", "covers", "cost"]
            writer = csv.DictWriter(file, names)
            writer.writeheader()
            writer.writerows(rows)
    return 0 if tell(rows) else 1


if __name__ == "__main__":
    sys.exit(main())
