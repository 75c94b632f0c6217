#!/usr/bin/env python3
"""limb.py: compares solvers on a limb of skin, fat, muscle and bone that a probe indents, by the error of the probe's force
and CPU time.

    python3 drivers/others/limb.py [--out FOLDER] [--poisson 0.49,0.4999] [--sizes 16,13,11,9] [--solvers NAMES]
                                   [--seconds 600] [--table]

The limb is an octagonal prism, 64 mm thick and 80 mm long, of nested layers, held at both ends. A rectangle of 40 x 24 mm
of its skin is moved towards the bone, by 4 mm in its middle and by less towards its rim (cos^2 along both sides), as a
round probe would. All solvers get the same ten-node tets, made by gmsh with edges of SIZE mm, half of that near the probe.
Every run is a process of one thread. Results are lines of FOLDER/results.jsonl, and a run that has a line is not repeated.
--table makes limb.md and limb.png from all lines. Errors are relative to the force of tet10-mean on its finest mesh, which
should be finer than the others'."""
import argparse
import json
import math
import os
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
import numpy as np  # noqa: E402

import battery  # noqa: E402
import case as cases  # noqa: E402

# Name, distance from the axis to a flat side in mm, and Young's modulus in Pa.
LAYERS = [("bone", 10, 1e7), ("muscle", 22, 3e4), ("fat", 28, 1e4), ("skin", 32, 1e5)]
LENGTH, PROBE, DEPTH = 80, (40, 24), 4  # mm
BONE_RATIO = 0.3
SOLVERS = {"flesh": "flesh, tet10-mean", "flesh_tet10": "flesh, tet10",
           "calculix": "CalculiX, C3D10", "fenicsx": "FEniCSx, P2", "mixed": "FEniCSx, P2-P1"}

# Settings that a user would choose: CalculiX with its own tolerances, FEniCSx with five load steps.
SETTINGS = {"flesh": "flesh:ELEMENT=tet10-mean:TOLERANCE=1e-6", "flesh_tet10": "flesh:TOLERANCE=1e-6",
            "calculix": "calculix:TIGHT=0", "fenicsx": "fenicsx:STEPS=5", "mixed": "fenicsx:STEPS=5:ELEMENT=P2-P1"}


def recipe(size):
    """Returns the recipe for gmsh."""
    lines = ['SetFactory("OpenCASCADE");']
    for k, (_, flat, _) in enumerate(LAYERS):
        r, first = flat / math.cos(math.pi / 8), 100 * (k + 1)
        for n in range(8):
            angle = math.pi / 8 + n * math.pi / 4
            lines.append(f"Point({first + n}) = {{0, {r * math.cos(angle):.12g}, {r * math.sin(angle):.12g}}};")
        lines += [f"Line({first + n}) = {{{first + n}, {first + (n + 1) % 8}}};" for n in range(8)]
        lines.append(f"Curve Loop({1000 + k}) = {{{first}:{first + 7}}}; Plane Surface({1000 + k}) = {{{1000 + k}}};")
    lines += [f"e{k}[] = Extrude {{{LENGTH}, 0, 0}} {{ Surface{{{1000 + k}}}; }};" for k in range(len(LAYERS))]
    a, b = PROBE
    lines += [f"Rectangle(9000) = {{{LENGTH / 2 - a / 2}, {-b / 2}, {LAYERS[-1][1]}, {a}, {b}}};",
              "BooleanFragments{ Volume{" + ", ".join(f"e{k}[1]" for k in range(4)) +
              "}; Delete; }{ Surface{9000}; Delete; }",
              f"rim[] = Curve In BoundingBox {{{LENGTH / 2 - a / 2 - 1}, {-b / 2 - 1}, {LAYERS[-1][1] - 1e-3}, "
              f"{LENGTH / 2 + a / 2 + 1}, {b / 2 + 1}, {LAYERS[-1][1] + 1e-3}}};",
              "Field[1] = Distance; Field[1].CurvesList = {rim[]}; Field[1].NumPointsPerCurve = 200;",
              f"Field[2] = Threshold; Field[2].InField = 1; Field[2].SizeMin = {size / 2}; Field[2].SizeMax = {size};"
              "Field[2].DistMin = 12; Field[2].DistMax = 30;",
              "Background Field = 2; Mesh.MeshSizeExtendFromBoundary = 0; Mesh.MeshSizeFromPoints = 0;",
              "Mesh.Algorithm3D = 1; Mesh.Optimize = 1; Mesh.MshFileVersion = 2.2; Mesh.SaveAll = 1;"]
    return "\n".join(lines) + "\n"


def read_gmsh(path):
    """Reads positions (mm) and four-node tets from a Gmsh 2 text file."""
    with open(path, encoding="utf-8") as file:
        lines = file.read().split("\n")
    at = lines.index("$Nodes") + 2
    nodes = np.array([line.split() for line in lines[at:at + int(lines[at - 1])]], float)
    at = lines.index("$Elements") + 2
    elements = [line.split() for line in lines[at:at + int(lines[at - 1])]]
    tets = np.array([row[-4:] for row in elements if row[1] == "4"], int)
    number = np.full(int(nodes[:, 0].max()) + 1, -1)
    number[nodes[:, 0].astype(int)] = np.arange(len(nodes))
    used, tets = np.unique(number[tets], return_inverse=True)
    return nodes[used, 1:], tets.reshape(-1, 4)


def ten_nodes(x, tets):
    """Adds a node in the middle of each edge, after the corners."""
    ends = np.sort(tets[:, cases.EDGES].reshape(-1, 2), 1)
    edges, place = np.unique(ends, axis=0, return_inverse=True)
    return np.vstack([x, x[edges].mean(1)]), np.hstack([tets, len(x) + place.reshape(-1, 6)])


def profile(x, half):
    """Returns the fraction of the probe's depth at a distance x from its middle; it is 0 at `half`."""
    return np.cos(math.pi / 2 * x / half)**2


def make(folder, size, poisson):
    """Writes the limb as a case and returns its number of unknowns."""
    mesh = os.path.join(os.path.dirname(folder), f"limb_{size:g}.msh")
    if not os.path.exists(mesh):
        with open(mesh[:-4] + ".geo", "w", encoding="utf-8") as file:
            file.write(recipe(size))
        subprocess.run(["gmsh", "-3", "-nt", "1", mesh[:-4] + ".geo", "-o", mesh], check=True, stdout=subprocess.DEVNULL)
    x, tets = read_gmsh(mesh)
    middle = x[tets].mean(1)
    angle = np.arctan2(middle[:, 2], middle[:, 1])
    side = np.round(angle / (math.pi / 4)) * math.pi / 4
    flat = middle[:, 1] * np.cos(side) + middle[:, 2] * np.sin(side)
    region = np.searchsorted([layer[1] for layer in LAYERS], flat)
    x, tets = ten_nodes(x / 1000, tets)
    a, b, top = PROBE[0] / 2000 + 1e-9, PROBE[1] / 2000 + 1e-9, LAYERS[-1][1] / 1000
    ends = np.flatnonzero((x[:, 0] < 1e-9) | (x[:, 0] > LENGTH / 1000 - 1e-9))
    probe = np.flatnonzero((np.abs(x[:, 0] - LENGTH / 2000) < a) & (np.abs(x[:, 1]) < b) & (x[:, 2] > top - 1e-9))
    share = profile(x[probe, 0] - LENGTH / 2000, a)
    share *= profile(x[probe, 1], b)
    fixed = [[int(i), *x[i]] for i in ends]
    fixed += [[int(i), x[i, 0], x[i, 1], x[i, 2] - DEPTH / 1000 * part] for i, part in zip(probe, share)]
    materials = []
    for name, _, young in LAYERS:
        ratio = BONE_RATIO if name == "bone" else poisson
        mu, lame = young / 2 / (1 + ratio), young * ratio / (1 + ratio) / (1 - 2 * ratio)
        materials.append({"energy": "B", "mu": mu, "lambda": lame + 2 / 3 * mu, "alpha": 1.0})
    cases.write(folder, {"name": f"limb_{size:g}_{poisson:g}", "doc": "a limb that a probe indents", "element": "tet10",
                         "materials": materials, "tet_material": region.tolist(), "fixed": fixed, "loads": [], "measured": probe.tolist(),
                         "judge": {"inverted": 0, "residual": 1e-4, "energy": None, "distance": None}}, x, tets, x)
    return 3 * (len(x) - len(ends) - len(probe))


def run(name, folder, work, seconds):
    result, used, _ = battery.in_a_process(SETTINGS[name], folder, work, seconds)
    if result is None or result["said"]:
        return {"force": None, "seconds": used, "said": result["said"] if result else f"ended after {used:.0f} s"}
    return {"force": result["force"][2], "seconds": result.get("seconds", used), "newton": result["newton"], "said": None,
            "unknowns": result.get("unknowns")}


def seconds_at(rows, error, limit):
    """Returns (CPU seconds at which these meshes, by ascending unknowns, reach the error, ""), interpolated in logarithms;
    (seconds of the coarsest mesh, ">") if even that is more accurate, so that ratios of cost to it are lower bounds; None
    if no mesh is as accurate."""
    errors = [abs(row["force"] / limit - 1) for row in rows]
    first = next((k for k, own in enumerate(errors) if own <= error), None)
    if first is None:
        return None
    if first == 0:
        return rows[0]["seconds"], ">"
    a, b = rows[first - 1], rows[first]
    part = math.log(errors[first - 1] / error) / math.log(errors[first - 1] / max(errors[first], 1e-9))
    return a["seconds"] * (b["seconds"] / a["seconds"])**part, ""


def chosen(records, name, poisson):
    return sorted((r for r in records if r["solver"] == name and r["poisson"] == poisson), key=lambda r: r["size"])[::-1]


def limits(records):
    """Returns the reference force of every Poisson's ratio: that of tet10-mean on its finest mesh."""
    return {p: chosen(records, "flesh", p)[-1]["force"] for p in {r["poisson"] for r in records}
            if len(chosen(records, "flesh", p)) > 1}


def write_table(folder, records):
    """Writes limb.md and limb.png."""
    records = [r for r in records if r["force"] is not None]
    limit = limits(records)
    lines = ["| ν | solver | SIZE, mm | unknowns | CPU s | force, N | error, % | CPU over flesh's: same mesh | same error |",
             "|---" * 9 + "|"]
    for poisson in sorted(limit):
        best = chosen(records, "flesh", poisson)
        for name, title in SOLVERS.items():
            for row in chosen(records, name, poisson):
                error = row["force"] / limit[poisson] - 1
                same = next((r["seconds"] for r in best if r["size"] == row["size"]), None)
                at = seconds_at(best, abs(error), limit[poisson]) if name not in ("flesh", "flesh_tet10") else None
                over = [f"{row['seconds'] / same:.2g}" if same else "", f"{at[1]} {row['seconds'] / at[0]:.2g}" if at else ""]
                lines.append(f"| {poisson:g} | {title} | {row['size']:g} | {row['unknowns']} | {row['seconds']:.3g} | "
                             f"{-row['force']:.4g} | {100 * error:+.1f} | " + " | ".join(over) + " |")
    with open(os.path.join(folder, "limb.md"), "w", encoding="utf-8") as file:
        file.write("\n".join(lines) + "\n")
    print("\n".join(lines))
    try:
        import matplotlib
    except ImportError:
        return
    matplotlib.use("Agg")
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(1, len(limit), figsize=(4 * len(limit), 3.6), sharey=True, squeeze=False)
    for axis, poisson in zip(axes[0], sorted(limit)):
        for name, mark in zip(SOLVERS, "osv^D"):
            rows = chosen(records, name, poisson)
            rows = rows[:-1] if name == "flesh" else rows  # the last one is the reference
            if rows:
                axis.loglog([r["seconds"] for r in rows], [100 * abs(r["force"] / limit[poisson] - 1) for r in rows],
                            mark + "-", label=SOLVERS[name])
        axis.set_title(f"ν = {poisson:g}", fontsize=10)
        axis.set_xlabel("CPU time, s")
        axis.grid(True, which="both", linewidth=0.3)
    axes[0][0].set_ylabel("error of the probe's force, %")
    axes[0][0].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(os.path.join(folder, "limb.png"), dpi=110)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", default="out/limb")
    parser.add_argument("--poisson", default="0.49,0.4999")
    parser.add_argument("--sizes", default="16,13,11,9")
    parser.add_argument("--solvers", default=",".join(SOLVERS))
    parser.add_argument("--seconds", type=float, default=600)
    parser.add_argument("--table", action="store_true", help="run nothing")
    arguments = parser.parse_args()
    os.makedirs(arguments.out, exist_ok=True)
    path, done = os.path.join(arguments.out, "results.jsonl"), {}
    if os.path.exists(path):
        with open(path, encoding="utf-8") as file:
            for line in file:
                record = json.loads(line)
                done[record["solver"], record["size"], record["poisson"]] = record
    if arguments.table:
        write_table(arguments.out, list(done.values()))
        return 0
    for poisson in map(float, arguments.poisson.split(",")):
        for size in map(float, arguments.sizes.split(",")):
            folder = os.path.join(arguments.out, f"limb_{size:g}_{poisson:g}")
            for name in arguments.solvers.split(","):
                if (name, size, poisson) in done:
                    continue
                unknowns = make(folder, size, poisson)
                work = os.path.join(folder, name)
                record = {"solver": name, "size": size, "poisson": poisson, "unknowns": unknowns}
                found = run(name, os.path.abspath(folder), os.path.abspath(work), arguments.seconds)
                record.update({key: value for key, value in found.items() if value is not None or key != "unknowns"})
                with open(path, "a", encoding="utf-8") as file:
                    file.write(json.dumps(record) + "\n")
                print(json.dumps(record), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
