#!/usr/bin/env python3
# TEST full program needs=flesh name=test_every_scene seconds=200 builds=plain protocol=exitcode args: --steps 2 --max-seconds 600
"""scenes.py: every scene of data/scenes by every method, at the scene's own step or at a tolerance.

    python3 test/campaign/scenes.py [--full | --steps N] [--scenes LIST] [--methods LIST] [--tolerance T]
                                    [--max-seconds S] [--flesh PROGRAM] [--out FOLDER]

Methods are those of the schema with steps as the scene has them, and again, marked `*`, those that take `time.adaptive`
with the tolerance; scenes without inertia are static. Long scenes end sooner (ENDS) without --full, with --steps all
after N of their steps. A run is fine if it completes, or if it is refused before its first step; a gain of energy above
5 % requires a warning; and at the end no surface intersects another or an obstacle at rest. Rows are kept in
FOLDER/rows.jsonl, and existing ones are not run again. The table has a line for each run that is not fine, and sums.
The exit status is 0 where all are fine.
"""
import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from fractions import Fraction

SCENES = os.path.join(os.path.dirname(os.path.realpath(__file__)), "..", "..", "data", "scenes")
ENDS = {"finger_pull_coarse": 1, "finger_pull_fine": 0.9, "fist": 0.6, "floating": 3, "fold": 1, "funnel": 0.2,
        "hand_ball": 0.6, "hand_pull": 0.9, "inflated_sphere": 1.2, "jelly_drop": 0.6, "limb": 0.5,
        "limb_antagonists": 0.8, "muscle_spindle": 1, "soft_and_stiff": 0.3, "stack": 0.4, "tentacle": 0.5, "tube": 0.5}
# Scenes in which a check of the last state would not find what the run ended with.
MOVES = ("funnel", "hand_ball", "tube")
GAIN = 0.05


def methods(flesh):
    """Returns the names of the schema's methods: of fixed steps (and IDA's), and those that take `time.adaptive`."""
    text = subprocess.run([flesh, "schema", "time"], capture_output=True, text=True, check=True).stdout
    names = next(line for line in text.splitlines() if line.startswith("| `method`")).split("|")[2]
    names = [name for name in names.replace("one of", "").replace(",", " ").split() if name != "adaptive"]
    return names + [name + "*" for name in names if name not in ("midpoint", "static", "ida")]


def read(scene):
    with open(os.path.join(SCENES, scene + ".yaml"), encoding="utf-8") as file:
        return file.read()


def settings(method, arguments, scene):
    values = ["solver.threads=1", f"time.method={method.rstrip('*')}"]
    if method.endswith("*"):
        values += ["time.adaptive=true", f"time.tolerance={arguments.tolerance}"]
    if method == "ida":
        values += [f"time.tolerance={arguments.tolerance}"]
    if arguments.steps:
        values += [f"time.end={arguments.steps * Fraction(re.search('step: ([0-9./e-]+)', read(scene))[1])}"]
    elif scene in ENDS and not arguments.full:
        values += [f"time.end={ENDS[scene]}"]
    return [word for value in values for word in ("--set", value)]


def last_sentence(text):
    lines = [line for line in text.splitlines() if line.strip()]
    return lines[-1] if lines else ""


def run(scene, method, arguments):
    path, out = os.path.join(SCENES, scene + ".yaml"), os.path.join(arguments.out, "run")
    row = {"scene": scene, "method": method}
    result = os.path.join(out, "result.json")
    shutil.rmtree(out, ignore_errors=True)
    values = settings(method, arguments, scene)
    try:
        done = subprocess.run(["nice", arguments.flesh, "run", path, *values, "--no-frames", "--quiet", "--out", out,
                               "--max-seconds", str(arguments.max_seconds)], capture_output=True, text=True, check=False,
                              timeout=2 * arguments.max_seconds + 60)
    except subprocess.TimeoutExpired:
        return {**row, "exit": "hangs"}
    row |= {"exit": done.returncode, "says": last_sentence(done.stderr)}
    if not os.path.exists(result):
        return row
    with open(result, encoding="utf-8") as file:
        told = json.load(file)
    figures = told["figures"] or {}
    row["says"] = told["message"] or told["warning"] or row["says"]
    row["warned"] = "energy" in (told["warning"] or "") + told["message"]
    row |= {name: figures.get(name) for name in ("t_end", "steps", "internal_steps", "newton", "rejected_steps",
                                                 "convergence_failures", "impact_steps", "damped_steps", "energy_gain",
                                                 "J_min", "final_inverted", "cpu_s")}
    state = os.path.join(out, "state.txt")
    if scene not in MOVES and os.path.exists(state):
        check = subprocess.run([arguments.flesh, "check", path, "--start-state", state], capture_output=True, text=True,
                               check=False)
        row["crossed"] = last_sentence(check.stderr) if check.returncode == 2 and "differ" not in check.stderr else ""
    return row


def fault(row):
    """Returns what is wrong with a row, if anything."""
    if row["exit"] == 6:
        return "out of time"
    if row["exit"] == 2 and not row.get("steps"):
        return ""
    if row["exit"] != 0:
        return f"exit {row['exit']}"
    if (row["energy_gain"] or 0) > GAIN:
        return "gains energy" if row["warned"] else "gains energy and does not say so"
    return "crossed" if row.get("crossed") else ""


def table(rows):
    print("| scene | method | ends | at s | steps | Newton | refused, failed | gain % | least J | |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    for row in rows:
        what = fault(row)
        if what:
            gain = 100 * (row.get("energy_gain") or 0)
            print(f"| {row['scene']} | {row['method']} | {what} | {row.get('t_end') or 0:.3g} | {row.get('internal_steps')} | "
                  f"{row.get('newton')} | {row.get('rejected_steps')}, {row.get('convergence_failures')} | {gain:.3g} | "
                  f"{row.get('J_min') or 0:.2g} | {row.get('crossed') or row['says']} |")
    counts = {}
    for row in rows:
        name = fault(row) or ("refused" if row["exit"] else "fine")
        counts.setdefault(row["method"], {}).setdefault(name, []).append(row["scene"])
    print()
    for method, names in counts.items():
        print(f"{method}: " + ", ".join(f"{len(scenes)} {name}" for name, scenes in sorted(names.items())))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--full", action="store_true")
    parser.add_argument("--steps", type=int, default=0)
    parser.add_argument("--scenes", default="")
    parser.add_argument("--methods", default="")
    parser.add_argument("--tolerance", type=float, default=1e-2)
    parser.add_argument("--max-seconds", type=float, default=60)
    parser.add_argument("--flesh", default=os.environ.get("FLESH", "build/drivers/flesh"))
    parser.add_argument("--out", default=None)
    arguments = parser.parse_args()
    arguments.out = arguments.out or tempfile.mkdtemp(prefix="flesh-scenes-")
    arguments.flesh = os.path.abspath(arguments.flesh)
    os.makedirs(arguments.out, exist_ok=True)
    scenes = arguments.scenes.split(",") if arguments.scenes else sorted(
        name[:-5] for name in os.listdir(SCENES) if name.endswith(".yaml"))
    chosen = arguments.methods.split(",") if arguments.methods else methods(arguments.flesh)
    record, rows = os.path.join(arguments.out, "rows.jsonl"), {}
    if os.path.exists(record):
        with open(record, encoding="utf-8") as file:
            rows = {(row["scene"], row["method"]): row for row in map(json.loads, file)}
    wanted = []
    for scene in scenes:
        moves = "inertia" in read(scene)
        wanted += [(scene, method) for method in chosen if (method != "static") == moves]
    for scene, method in wanted:
        if (scene, method) not in rows:
            rows[scene, method] = row = run(scene, method, arguments)
            with open(record, "a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")
            print(f"# {scene} {method}: {fault(row) or 'fine'}", file=sys.stderr, flush=True)
    rows = [rows[pair] for pair in wanted]
    table(rows)
    return 1 if any(map(fault, rows)) else 0


if __name__ == "__main__":
    sys.exit(main())
