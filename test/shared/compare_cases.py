"""Compares the results of two executions of a command on its cases: compare_cases.py FOLDER FOLDER. They must have the
same files, with the same contents in the same order, except for times, values derived from times, and the folders' own
names."""

import csv
import json
import os
import re
import sys

# Ignored columns of tables: times, and which run was fastest.
TIMED = re.compile(r"wall|cpu_s|seconds|time_worst|longest_step|front_time|started|finished|worker|machine|peak_memory")
# Ignored in result.json and its kind: the same results have different dates and folders.
PRIVATE = re.compile(r"wall|cpu_s|seconds|longest|peak_memory|date|path|command|effects|started|program|wall_s")
# Pictures of times and words about them; the database is compared by its exports.
LEFT_OUT = re.compile(r"(\.png|\.gp|\.dat|verdict\.txt|[a-z]+\.db.*|log\.txt)$")


def strip(value):
    if isinstance(value, dict):
        return {key: strip(item) for key, item in value.items() if not PRIVATE.search(key)}
    return [strip(item) for item in value] if isinstance(value, list) else value


def read_table(path):
    with open(path) as file:
        return [{key: word for key, word in row.items() if not TIMED.search(key)} for row in csv.DictReader(file)]


def files(folder):
    found = (os.path.join(place, name) for place, _, names in os.walk(folder) for name in names)
    return sorted(os.path.relpath(path, folder) for path in found)


def contents(folder, name):
    path = os.path.join(folder, name)
    if name.endswith(".csv"):
        return read_table(path)
    if name.endswith(".json"):
        with open(path) as file:
            value = strip(json.load(file))
        return value
    with open(path, "rb") as file:
        return file.read().replace(os.path.abspath(folder).encode(), b"FOLDER")


def main(one, other):
    names = files(one)
    assert names == files(other), f"{set(names) ^ set(files(other))} in one of the two alone"
    compared = [name for name in names if not LEFT_OUT.search(name)]
    assert compared, names
    for name in compared:
        a, b = contents(one, name), contents(other, name)
        if isinstance(a, list):
            assert len(a) == len(b) > 0, f"{name}: {len(a)} and {len(b)} rows"
            for first, second in zip(a, b):
                assert first == second, f"{name}: {first} and {second}"
        assert a == b, f"{name}: {a} and {b}"


main(sys.argv[1], sys.argv[2])
