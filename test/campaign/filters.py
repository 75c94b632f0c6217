#!/usr/bin/env python3
"""filters.py: ratios of cost between eigenvalue filters, with intervals, from what filters.sh has run.

   /usr/bin/python3 test/campaign/filters.py OUT          a table in Markdown of the problems that are not held out
   /usr/bin/python3 test/campaign/filters.py OUT --held   the same of those that are

A ratio is the median over the problems of one filter's iterations over the other's; a problem that only one of them
solves counts as an infinite ratio, one that neither solves does not count. Intervals hold the median of 99 of 100
resamples: meshes are drawn with replacement, then problems of each. A verdict (bold) requires that the interval
excludes 1 and that a sign test over the problems that differ by 5 % has p < 0.01; all else is a tie."""
import csv
import math
import os
import random
import sys

RESAMPLES, LEVEL, MARGIN, LEAST = 2000, 0.01, math.log(1.05), 6
PAIRS = (("clamped", "absolute"), ("trust-region", "absolute"), ("clamped-always", "absolute-always"),
         ("trust-region-always", "absolute-always"), ("absolute-always", "absolute"), ("absolute-bare", "absolute"))
GROUPS = ("rest", "load", "motion")


def read(out, held):
    """Returns costs by [(element, group)][problem][solver]: (Newton, linear), None if unsolved."""
    sets = {}
    for folder in sorted(os.listdir(out)):
        path = os.path.join(out, folder, "hardcases.csv")
        if folder.endswith("_held") != held or not os.path.exists(path):
            continue
        for row in csv.DictReader(open(path, encoding="utf-8")):
            if row["outcome"] == "not run" or row["status"] in ("FLESH_UNDEFINED", "FLESH_ERR_ARGUMENT"):
                continue
            problem = (row["mesh"], row["case"], row["seed"], row["energy"], float(row["poisson"]), row["step"])
            loaded = row["group"] != "rest" and row["outcome"] == "not recovered" and row["inverted_end"] == "0"
            solved = row["outcome"] == "recovered" or loaded
            cost = (float(row["newton"]), float(row["linear"])) if solved else None
            sets.setdefault((row["element"], row["group"]), {}).setdefault(problem, {})[row["solver"]] = cost
    return sets


def log_ratio(a, b, measure):
    if a is None or b is None:
        return math.inf if a is None else -math.inf
    return math.log(max(a[measure], 1) / max(b[measure], 1))


def ratios(problems, one, other, measure):
    """Returns the logarithms of the ratios as lists, one for each mesh."""
    meshes = {}
    for problem, costs in problems.items():
        if one in costs and other in costs and not costs[one] is costs[other] is None:
            meshes.setdefault(problem[0], []).append(log_ratio(costs[one], costs[other], measure))
    return list(meshes.values())


def median(values):
    values = sorted(values)
    low, high = values[(len(values) - 1) // 2], values[len(values) // 2]
    return low if low == high else (low + high) / 2


def interval(meshes, rng):
    found = []
    for _ in range(RESAMPLES):
        drawn = [rng.choices(mesh, k=len(mesh)) for mesh in rng.choices(meshes, k=len(meshes))]
        found.append(median([value for mesh in drawn for value in mesh]))
    found.sort()
    edge = int(RESAMPLES * LEVEL / 2)
    return found[edge], found[-1 - edge]


def chance(wins, losses):
    """Returns the two-sided probability that tosses of a fair coin are at least this uneven."""
    n, most = wins + losses, max(wins, losses)
    return min(1, 2 * sum(math.comb(n, k) for k in range(most, n + 1)) / 2**n) if n else 1


def judge(meshes, rng):
    """Returns (median, low, high, verdict) in logarithms; verdict -1: less, 1: more, 0: a tie. None: too few
    problems."""
    values = [value for mesh in meshes for value in mesh]
    if len(values) < LEAST:
        return None
    low, high = interval(meshes, rng)
    wins, losses = sum(v <= -MARGIN for v in values), sum(v >= MARGIN for v in values)
    apart = chance(wins, losses) < LEVEL and (high < 0 or low > 0)
    return median(values), low, high, (losses > wins) - (wins > losses) if apart else 0


def show(judged):
    if judged is None:
        return "-"
    middle, low, high = (f"{math.exp(v):.2f}" if v < 700 else "∞" for v in judged[:3])
    return f"**{middle}** ({low}–{high})" if judged[3] else f"{middle} ({low}–{high})"


def main():
    out, held = sys.argv[1], "--held" in sys.argv[2:]
    sets = read(out, held)
    for measure, title in enumerate(("Newton iterations", "linear iterations")):
        print(f"\n{title}\n\n| | problems | " + " | ".join(f"{a} / {b}" for a, b in PAIRS) + " |\n|" + "---|" * (len(PAIRS) + 2))
        for group in GROUPS:
            for element in ("tet4", "tet10", "tet10-mean"):
                for name, test in (("all", lambda nu: True), ("to 0.45", lambda nu: nu <= 0.45), ("0.49 on", lambda nu: nu >= 0.49)):
                    problems = {p: c for p, c in sets.get((element, group), {}).items() if test(p[4])}
                    cells = [show(judge(ratios(problems, a, b, measure), random.Random(1))) for a, b in PAIRS]
                    print(f"| {group}, {element}, {name} | {len(problems)} | " + " | ".join(cells) + " |")
    print("\nsolved\n")
    for (element, group), problems in sorted(sets.items()):
        solvers = sorted({s for costs in problems.values() for s in costs})
        print(group, element, len(problems), *(f"{s} {sum(c.get(s) is not None for c in problems.values())}" for s in solvers))


if __name__ == "__main__":
    main()
