#!/usr/bin/env python3
# TEST name=test_hardcases_ranks full program alone needs=flesh,ranks,plain protocol=exitcode
# TEST+ args: @flesh@ --launcher @mpirun@ --out @folder@/ranks_battery --cases
# TEST+ single_*,static_shear,static_stretch4,squash10_static,two_bodies,twist2_h1,mirrored,invert_one,point,line
"""ranks_battery.py: the quick battery of hard cases with every body shared out among ranks.

  python3 test/campaign/ranks_battery.py build/drivers/flesh --ranks 3 --poisson 0.45 --cases '*' --out out/ranks_battery

`flesh hardcases` runs the battery on one rank and leaves a scene of each case; `mpirun -n N flesh run` then repeats each, a
case at a time. A case is back when all phases are complete and the body's nodes, after the best rigid fit (Horn 1987), and
its volume are within 1e-3 of its rest shape, with no tet inverted. Says of each what came of it on one rank and on N, and
exits with 1 when one is back on one rank alone; equilibria that are to stay (a free line, a free point) are not judged. The energies are those with their rest shape free of stress (S, E).
"""
import argparse
import csv
import json
import os
import re
import subprocess
import sys

TOLERANCE = 1e-3


def read_mesh(path):
    """Returns the vertices of a Medit file."""
    words = iter(open(path).read().split())
    for word in words:
        if word == "Vertices":
            count = int(next(words))
            return [[float(next(words)) for _ in range(4)][:3] for _ in range(count)]
    sys.exit(f"{path}: no vertices")


def read_state(path):
    rows = (line.split() for line in open(path) if not line.startswith("#"))
    return [[float(word) for word in row[:3]] for row in rows]


def rotation(a, b):
    """Returns the rotation about their middle that takes the points a nearest to b: from the quaternion that belongs to
    the largest eigenvalue of Horn's matrix."""
    s = [[sum(p[i] * q[j] for p, q in zip(a, b)) for j in range(3)] for i in range(3)]
    n = [[s[0][0] + s[1][1] + s[2][2], s[1][2] - s[2][1], s[2][0] - s[0][2], s[0][1] - s[1][0]],
         [0, s[0][0] - s[1][1] - s[2][2], s[0][1] + s[1][0], s[2][0] + s[0][2]],
         [0, 0, s[1][1] - s[0][0] - s[2][2], s[1][2] + s[2][1]],
         [0, 0, 0, s[2][2] - s[0][0] - s[1][1]]]
    for i in range(4):
        for j in range(i):
            n[i][j] = n[j][i]
    shift = sum(abs(value) for row in n for value in row) or 1
    q = [1, 0.1, 0.2, 0.3]
    for _ in range(5000):
        q = [sum(n[i][j] * q[j] for j in range(4)) + shift * q[i] for i in range(4)]
        size = sum(value * value for value in q) ** 0.5
        q = [value / size for value in q]
    w, x, y, z = q
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]


def distance(rest, points):
    """Returns the distance of the node farthest from the rest shape, over the body's length."""
    def middle(p):
        return [sum(q[c] for q in p) / len(p) for c in range(3)]
    m, k = middle(rest), middle(points)
    a = [[p[c] - m[c] for c in range(3)] for p in rest]
    b = [[p[c] - k[c] for c in range(3)] for p in points]
    r = rotation(a, b)
    worst = max(sum((q[c] - sum(r[c][d] * p[d] for d in range(3))) ** 2 for c in range(3)) for p, q in zip(a, b))
    length = max(max(p[c] for p in rest) - min(p[c] for p in rest) for c in range(3))
    return worst ** 0.5 / length if worst == worst else float("inf")


def run(launch, scene, out, start, seconds):
    """Runs a phase; returns its result, and the message if there is none."""
    command = launch + ["run", scene, "--quiet", "--no-frames", "--max-seconds", seconds, "--out", out]
    command += ["--start-state", start] if start else []
    done = subprocess.run(command, capture_output=True, text=True)
    said = re.search(r"^flesh run: (.*)$", done.stderr, re.M)
    try:
        result = json.load(open(f"{out}/result.json"))
    except OSError:
        return None, said.group(1) if said else f"exit code {done.returncode}"
    return result, said.group(1) if said else result["status"]


def repeat(launch, folder, name, seconds):
    """Returns the outcome of the case on ranks: a word, and the reason."""
    out = start = None
    for phase in "scene", "release":
        if not os.path.exists(f"{folder}/{phase}.yaml"):
            continue
        out = f"{folder}/{name}_{phase}"
        result, said = run(launch, f"{folder}/{phase}.yaml", out, start, seconds)
        if not result or result["status"] != "complete":
            return "stopped", said
        start = f"{out}/state.txt"
    figures = result["figures"]
    rest, end = read_mesh(f"{folder}/body.mesh"), read_state(start)
    far = distance(rest, end)
    if far < TOLERANCE and abs(figures["final_volume_drift"]) < TOLERANCE and not figures["final_inverted"]:
        return "back", f"{far:.1e}"
    return "not back", f"{far:.2g} off, {figures['final_inverted']} inverted, volume {figures['final_volume_drift']:.2g}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("flesh")
    parser.add_argument("--ranks", type=int, default=3)
    parser.add_argument("--launcher", default="mpirun")
    parser.add_argument("--energies", default="S")
    parser.add_argument("--poisson", default="0.45")
    parser.add_argument("--cases", default="*")
    parser.add_argument("--max-seconds", default="60", help="of each run on ranks")
    parser.add_argument("--out", default="out/ranks_battery")
    given = parser.parse_args()
    flesh = os.path.abspath(given.flesh)
    subprocess.run([flesh, "hardcases", "--quick", "--energies", given.energies, "--poisson", given.poisson, "--cases",
                    given.cases, "--out", given.out], check=True, stdout=subprocess.DEVNULL)
    launch = [given.launcher, "-n", str(given.ranks), flesh]
    lost = back = 0
    rows = list(csv.DictReader(open(f"{given.out}/hardcases.csv")))
    for row in rows:
        word, why = repeat(launch, f"{given.out}/{row['folder']}", f"ranks{given.ranks}", given.max_seconds)
        alone = row["outcome"]
        back += word == "back"
        lost += word != "back" and alone in ("recovered", "untangled")
        print(f"{row['case']}, {row['energy']} {row['poisson']}: {alone}; on {given.ranks} ranks {word}: {why}", flush=True)
    print(f"{back} of {len(rows)} back on {given.ranks} ranks; {lost} that are back on one rank are not")
    sys.exit(lost > 0)


main()
