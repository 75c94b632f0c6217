#!/usr/bin/env python3
"""Writes OUT.csv: of every case of shards I/2 in FOLDER_I, how fast the balls part over how fast they met."""
import csv
import sqlite3
import sys

folders, out = sys.argv[1:-1], sys.argv[-1]


def parting(path):
    """The mean of the relative velocity over the last fifth of the time, while the balls ring."""
    with open(path) as file:
        rows = list(csv.reader(file))[1:]
    late = [float(row[4]) - float(row[1]) for row in rows if float(row[0]) > 0.8 * float(rows[-1][0])]
    return sum(late) / len(late)


results = []
for folder in folders:
    query = "SELECT id, method, h, young FROM results WHERE status = 'complete'"
    for case, method, h, young in sqlite3.connect(f"{folder}/sweep.db").execute(query):
        restitution = parting(f"{folder}/cases/{case:06d}/probes.csv") / 2
        results.append((f"{method} {young:.0e} Pa", h, restitution))
with open(out, "w", newline="") as file:
    table = csv.writer(file)
    table.writerow(("series", "h [s]", "restitution"))
    table.writerows(sorted(results))
for row in sorted(results):
    print("{:26} {:8.4g} s  {:.4f}".format(*row))
