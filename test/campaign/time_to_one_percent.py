#!/usr/bin/env python3
"""time_to_one_percent.py: CPU time to one per cent of the bar's limit, tet10-mean against tet4, at three ratios.

    python3 test/campaign/time_to_one_percent.py [--full] [--flesh PROGRAM] [--out FOLDER]

A bar of 4 x 1 x 1 m, held at one end, bends under 200 N/m^3 (form S, E = 1e5 Pa) on finer and finer grids, in
equilibrium to 1e-6, on one thread. A run's cost is the CPU time that it reports, the least of three. If the finest grid
is not fine enough, a lower bound is given, marked `>`: the error falls with the square of the size of the tets (locking
lets it fall more slowly), the cost grows with their number. With --full tet4 goes on to 192 000 tets, else to 24 000.
The exit status is 0 if tet10-mean reaches it and is cheaper each time.
"""
import argparse
import json
import os
import subprocess
import sys

SCENE = """body:
  mesh: {mesh}
  density: 1000
  material: {{energy: S, young: 1e5, poisson: {poisson}}}
  element: {element}
effects:
  - gravity: {{acceleration: [0, 0, -0.2]}}
  - pin: {{box: [[-1, -1, -1], [1e-9, 2, 2]]}}
time: {{method: static}}
solver: {{newton_tolerance: 1e-6, threads: 1}}
"""
# Tips, m: limits of quadratic displacements with linear pressures by an independent code, good to .15 %
# (test_tet10_physics has them too).
LIMITS = {0.3: -0.7813, 0.45: -0.7649, 0.49: -0.7583}


def positions(state):
    """Returns the rows x y z vx vy vz of a saved state."""
    with open(state, encoding="utf-8") as file:
        return [[float(word) for word in line.split()] for line in file if not line.startswith("#")]


def run(arguments, folder, cells, poisson, element):
    mesh = os.path.join(folder, f"bar_{cells}.msh")
    if not os.path.exists(mesh):
        subprocess.run([arguments.flesh, "mesh", "box", "--cells", f"{4 * cells},{cells},{cells}", "--size", "4,1,1",
                        "--out", mesh], check=True, stdout=subprocess.DEVNULL)
    scene = os.path.join(folder, "bar.yaml")
    with open(scene, "w", encoding="utf-8") as file:
        file.write(SCENE.format(mesh=os.path.basename(mesh), poisson=poisson, element=element))
    costs = []
    for _ in range(3):
        out = os.path.join(folder, "run")
        subprocess.run([arguments.flesh, "run", scene, "--out", out, "--quiet"], check=True,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        with open(os.path.join(out, "result.json"), encoding="utf-8") as file:
            costs.append(json.load(file)["figures"]["cpu_s"])
        if costs[-1] > 20:
            break
    # Node (i, j, k) of the grid is number (k (n+1) + j) (4n+1) + i; an even n has a node in the middle of the end.
    node = (cells // 2 * (cells + 1) + cells // 2) * (4 * cells + 1) + 4 * cells
    return positions(os.path.join(out, "state.txt"))[node][2] - 0.5, min(costs)


def reach(arguments, folder, poisson, element, grids):
    """Returns (tets, CPU s, error, bound) of the first grid within 1 %, or a lower bound of its cost."""
    rows = []
    for cells in grids:
        z, cost = run(arguments, folder, cells, poisson, element)
        error = abs(z / LIMITS[poisson] - 1)
        rows.append((24 * cells**3, cost, error))
        print(f"# {element}, nu {poisson}, {24 * cells**3} tets: {100 * error:.2f} %, {cost:.3g} s", flush=True)
        if error <= 0.01:
            return rows[-1] + (False,)
    tets, cost, error = rows[-1]
    more = (error / 0.01) ** 1.5
    return tets * more, cost * more, 0.01, True


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--full", action="store_true")
    parser.add_argument("--flesh", default="build/drivers/flesh")
    parser.add_argument("--out", default="out/time_to_one_percent")
    arguments = parser.parse_args()
    arguments.flesh = os.path.abspath(arguments.flesh)
    os.makedirs(arguments.out, exist_ok=True)
    table = ["| ν | tet10-mean: tets | CPU s | error | tet4: tets | CPU s | error | ratio |",
             "|---|---|---|---|---|---|---|---|"]
    cheaper = True
    for poisson in LIMITS:
        mean = reach(arguments, arguments.out, poisson, "tet10-mean", (2, 4, 6, 8))
        linear = reach(arguments, arguments.out, poisson, "tet4", (4, 8, 10, 20) if arguments.full else (4, 8, 10))
        cheaper = cheaper and not mean[3] and linear[1] > mean[1]
        cells = [f"{poisson}"]
        for row in (mean, linear):
            sign = ">" if row[3] else ""
            tets = round(row[0], -4) if row[3] else row[0]
            cells += [f"{sign}{tets:.0f}", f"{sign}{row[1]:.2g}", f"{100 * row[2]:.1f} %"]
        table.append("| " + " | ".join(cells + [f"{'>' if linear[3] else ''}{linear[1] / mean[1]:.2g}"]) + " |")
    print("\n".join(table))
    return 0 if cheaper else 1


if __name__ == "__main__":
    sys.exit(main())
