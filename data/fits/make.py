#!/usr/bin/python3
"""make.py: makes the measurements of the fits in this folder: finer meshes, or a closed form, at known parameters, with noise
of a known seed. `make.py FLESH [NAME...]` writes them, or those of some fits, beside itself."""
import csv
import os
import subprocess
import sys
import tempfile

import numpy

HERE = os.path.dirname(os.path.abspath(__file__))


def run(flesh, scene, folder, *sets):
    """The tables of a run: {column: values}, and its last positions."""
    words = [flesh, "run", os.path.join(HERE, scene), "--out", folder, "--set", "solver.newton_tolerance=1e-8"]
    for text in sets:
        words += ["--set", text]
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
    table = {}
    if os.path.exists(os.path.join(folder, "probes.csv")):
        with open(os.path.join(folder, "probes.csv")) as file:
            rows = list(csv.reader(file))
        table = {name: numpy.array([float(row[c]) for row in rows[1:]]) for c, name in enumerate(rows[0])}
    return table, numpy.loadtxt(os.path.join(folder, "state.txt"))[:, :3]


def box(flesh, cells, size, path):
    """The lines of a mesh's file, its nodes' places, and where its tets' lines begin and end."""
    subprocess.run([flesh, "mesh", "box", "--cells", cells, "--size", size, "--out", path], check=True, stdout=subprocess.DEVNULL)
    with open(path) as file:
        lines = file.read().split("\n")
    at, tets = lines.index("Vertices") + 2, lines.index("Tetrahedra") + 2
    x = numpy.array([[float(word) for word in line.split()[:3]] for line in lines[at:at + int(lines[at - 1])]])
    return lines, x, range(tets, tets + int(lines[tets - 1]))


def centre(line, x):
    return x[[int(word) - 1 for word in line.split()[:4]]].mean(axis=0)


def plate(flesh, path):
    """A plate of 0.1 m by 0.1 m by 0.01 m with 25 square regions, tags 1 to 25."""
    lines, x, tets = box(flesh, "10,10,1", "0.1,0.1,0.01", path)
    for k in tets:
        i, j, _ = (centre(lines[k], x) / 0.02).astype(int)
        lines[k] = " ".join(lines[k].split()[:4]) + f" {1 + i + 5 * j}"
    with open(path, "w") as file:
        file.write("\n".join(lines))


def write(name, columns, digits):
    with open(os.path.join(HERE, name), "w") as file:
        file.write("# made by make.py\n" + ",".join(columns) + "\n")
        for row in zip(*columns.values()):
            file.write(",".join(f"{value:.{n}g}" for value, n in zip(row, digits)) + "\n")


def indentation(flesh, folder, random):
    """Young's modulus 30 kPa, Poisson's ratio 0.4; a mesh of eight times as many tets."""
    table, _ = run(flesh, "indentation_scene.yaml", folder, "body.refine=1")
    t = table["t [s]"][1:]
    force = "ball.contact_force_z [N]"
    write("indentation_force.csv", {"t [s]": t, force: table[force][1:] + 0.3 * random.normal(size=len(t))}, (4, 5))
    sides = {name: table[name][1:] + 3e-5 * random.normal(size=len(t))
             for name in ("front.position_y [m]", "side.position_x [m]")}
    write("indentation_bulge.csv", {"t [s]": t, **sides}, (4, 6, 6))


def muscles(flesh, folder, random):
    """Activations 0.3, 0.1, 0, 0.15, seen at every seventh node."""
    sets = [f"effects.muscle[{k}].activation[0].value={a}" for k, a in enumerate((0.3, 0.1, 0, 0.15))]
    _, x = run(flesh, "muscles_scene.yaml", folder, *sets)
    nodes = numpy.arange(0, len(x), 7)
    x = x[nodes] + 0.5e-3 * random.normal(size=(len(nodes), 3))
    write("muscles_shape.csv", {"node": nodes, "x [m]": x[:, 0], "y [m]": x[:, 1], "z [m]": x[:, 2]}, (6, 5, 5, 5))


def slide(flesh, folder, random):
    """A rigid block with a coefficient of friction of 0.35 and a speed of 0.2 m/s."""
    t = numpy.arange(1, 21) * 0.03
    x = 0.05 + 0.2 * t + 0.5 * (4.905 - 0.35 * 8.496) * t**2
    write("slide_path.csv", {"t [s]": t, "middle.position_x [m]": x + 1e-3 * random.normal(size=len(t))}, (4, 6))


def stiffness(flesh, folder, random):
    """Young's moduli of 30 kPa times exp(0.4 g), g normal, of 25 regions of a plate that is pulled in two directions; the
    positions of all nodes."""
    plate(flesh, os.path.join(HERE, "stiffness_plate.mesh"))
    young = 3e4 * numpy.exp(0.4 * random.normal(size=25))
    regions = "".join(f"    - {{tags: [{k + 1}], material: {{energy: S, young: 3e4, poisson: 0.4}}}}\n" for k in range(25))
    rows = "".join(f"  - {{key: \"body.regions[{k}].material.young\", name: young_{k + 1}, start: 3e4, from: 1e3, to: 1e6, "
                   f"spacing: logarithmic}}  # {young[k]:.0f}\n" for k in range(25))
    with open(os.path.join(HERE, "stiffness_scene.yaml"), "w") as file:
        file.write("# made by make.py\nbody:\n  mesh: stiffness_plate.mesh\n  density: 1000\n  material: {energy: S, young: 3e4, "
                   f"poisson: 0.4}}\n  regions:\n{regions}effects:\n  - pin: {{box: [[-1, -1, -1], [1e-9, 1, 1]]}}\n"
                   "  - traction: {box: [[0.0999, -1, -1], [1, 1, 1]], traction: [4e3, 0, 0]}\n"
                   "time: {method: static, step: 1, end: 1}\noutput: {frame_interval: 0}\n")
    with open(os.path.join(HERE, "stiffness.yaml"), "w") as file:
        file.write("# made by make.py: a map of Young's modulus, in 25 regions whose true values stand behind the rows\nexperiments:\n"
                   "  - name: pull\n    scene: stiffness_scene.yaml\n    measured: [{positions: stiffness_pull.csv, deviation: 5e-5}]\n"
                   "  - name: shear\n    scene: stiffness_scene.yaml\n    set: {\"effects.traction.traction\": [0, 1e3, 0]}\n"
                   f"    measured: [{{positions: stiffness_shear.csv, deviation: 5e-5}}]\nparameters:\n{rows}")
    sets = [f"body.regions[{k}].material.young={young[k]!r}" for k in range(25)]
    for name, more in (("pull", []), ("shear", ["effects.traction.traction=[0, 1e3, 0]"])):
        _, x = run(flesh, "stiffness_scene.yaml", folder, *sets, *more)
        x = x + 5e-5 * random.normal(size=x.shape)
        write(f"stiffness_{name}.csv", {"node": numpy.arange(len(x)), "x [m]": x[:, 0], "y [m]": x[:, 1], "z [m]": x[:, 2]},
              (6, 6, 6, 6))


def inclusion(flesh, folder, random):
    """A block of 30 kPa with a ball of 90 kPa in it, under three loads: the nodes of its surface."""
    lines, x, tets = box(flesh, "6,6,6", "0.06,0.06,0.06", os.path.join(HERE, "inclusion_block.mesh"))
    inside = [numpy.linalg.norm(centre(lines[k], x) - (0.03, 0.03, 0.036)) < 0.016 for k in tets]
    write("inclusion_truth.csv", {"tet": range(len(inside)), "young [Pa]": numpy.where(inside, 9e4, 3e4)}, (6, 6))
    seen = numpy.nonzero((abs(x - 0.03).max(axis=1) > 0.0299) & (x[:, 2] > 0))[0]
    truth = "body.material_map=" + os.path.join(HERE, "inclusion_truth.csv")
    for name, load in (("pull", "[0, 0, 2e3]"), ("shear", "[1e3, 0, 0]"), ("side", "[0, 1e3, 0]")):
        _, at = run(flesh, "inclusion_scene.yaml", folder, truth, f"effects.traction.traction={load}")
        at = at[seen] + 2e-5 * random.normal(size=(len(seen), 3))
        write(f"inclusion_{name}.csv", {"node": seen, "x [m]": at[:, 0], "y [m]": at[:, 1], "z [m]": at[:, 2]}, (6, 6, 6, 6))


if __name__ == "__main__":
    for k, make in enumerate((indentation, muscles, slide, stiffness, inclusion)):
        if len(sys.argv) > 2 and make.__name__ not in sys.argv[2:]:
            continue
        with tempfile.TemporaryDirectory() as folder:
            make(os.path.abspath(sys.argv[1]), folder, numpy.random.default_rng(k + 1))
