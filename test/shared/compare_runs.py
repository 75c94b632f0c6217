"""Compares the results of two runs of a scene: compare_runs.py FOLDER FOLDER LIMIT. States, histories and probes must
have the same rows, and their numbers may differ by LIMIT times the largest of their kind."""

import csv
import os
import sys

# How the solver got there; and which of several tets with the same J is named.
ITS_OWN = {"internal_steps", "newton", "linear", "assemblies", "projections", "backtracks", "residual", "residual_target",
           "J_min_tet"}


def read_state(path):
    with open(path) as file:
        rows = [[float(word) for word in line.split()] for line in file if not line.startswith("#")]
    return {"place": [n for row in rows for n in row[:3]], "velocity": [n for row in rows for n in row[3:]]}


def read_table(path):
    with open(path) as file:
        rows = list(csv.DictReader(file))
    names = [name for name in rows[0] if name not in ITS_OWN]
    columns = {name: [float(row[name]) for row in rows] for name in names}
    # Energies that are exchanged with each other, and axes, share one scale.
    for group in ("energy_", "probe"):
        sizes = [abs(n) for name in names if name.startswith(group) for n in columns[name]]
        for name in names:
            if name.startswith(group):
                columns[name].append(max(sizes))
    return columns


def compare(name, first, second, limit):
    assert first.keys() == second.keys(), f"{name}: {sorted(first)} and {sorted(second)}"
    for key, numbers in first.items():
        others = second[key]
        assert len(numbers) == len(others), f"{name}: {len(numbers)} and {len(others)} numbers of {key}"
        size = max(abs(n) for n in numbers) or 1
        worst = max(abs(a - b) for a, b in zip(numbers, others)) / size
        assert worst <= limit, f"{name}: {key} differs by {worst:.2g} of its size"


def main(one, other, limit):
    compare("state.txt", read_state(f"{one}/state.txt"), read_state(f"{other}/state.txt"), limit)
    for table in ("history.csv", "probes.csv"):
        assert os.path.exists(f"{one}/{table}") == os.path.exists(f"{other}/{table}"), table
        if os.path.exists(f"{one}/{table}"):
            compare(table, read_table(f"{one}/{table}"), read_table(f"{other}/{table}"), limit)


main(sys.argv[1], sys.argv[2], float(sys.argv[3]))
