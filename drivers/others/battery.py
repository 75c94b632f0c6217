#!/usr/bin/env python3
"""battery.py: runs cases (drivers/hardcases.md: cases for other solvers) by flesh and by other solvers, judges the final
states by its own code, and prints one table.

    python3 drivers/others/battery.py FOLDER... [--adapters flesh,calculix,FILE.py] [--seconds 60] [--out FOLDER]

Settings of an adapter, as in fenicsx:SNES=1, replace constants of its file. FOLDER is that of a case, or has cases below
it. Every run is a process with a limit of CPU time. Results are lines of OUT/results.jsonl; a run that has a line is
repeated only with --again. An adapter is a Python file with

    version()                      its solver and version as a sentence; None if it is not installed
    can_run(case)                  None if it can run the case, else why it cannot
    solve(case, seconds, folder)   {"x": final positions [n, 3] in m or None, "newton": iterations,
                                   "said": why there are none or None, "seconds": CPU time of the solve, optional}
    cleanup(folder)                removes large files that are no longer needed from the run's folder

where `case` is a case.Case. Needs only NumPy."""
import argparse
import collections
import importlib.util
import json
import os
import resource
import signal
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
import numpy as np  # noqa: E402

import case as cases  # noqa: E402
import judge as judges  # noqa: E402

FROZEN = os.path.join(HERE, "..", "..", "data", "hardcases", "frozen.txt")
# Outcomes, from best to worst. The first two have a final state, which is judged.
OUTCOMES = ["solved", "wrong end", "stopped", "died", "out of time", "cannot"]


def load(word):
    """Returns the adapter of a name (adapters/NAME.py) or path, with its settings applied, as in fenicsx:SNES=1:STEPS=5."""
    name, *settings = word.split(":")
    path = name if name.endswith(".py") else os.path.join(HERE, "adapters", name + ".py")
    spec = importlib.util.spec_from_file_location(os.path.basename(name).removesuffix(".py"), path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    for setting in settings:
        key, value = setting.split("=")
        setattr(module, key, type(getattr(module, key))(float(value) if value[0].isdigit() else value))
    return module


def why_not(adapter, case):
    """Returns None if the adapter can run the case, else why it cannot."""
    if set(case.forms) & {"Neo", "A", "B"} and (judges.evaluate(case, case.start)[2] <= 0).any():
        return "the form is undefined at the start"
    return adapter.can_run(case)


def run_one(name, folder, work, seconds):
    """Solves the case in this process and writes work/record.json and work/end.npy."""
    case = cases.read(folder)
    result = load(name).solve(case, seconds, work)
    if result["x"] is not None:
        np.save(os.path.join(work, "end.npy"), result["x"])
    del result["x"]
    with open(os.path.join(work, "record.json"), "w", encoding="utf-8") as file:
        json.dump(result, file)


def limit(seconds):
    resource.setrlimit(resource.RLIMIT_CPU, (int(seconds) + 1, int(seconds) + 5))


def in_a_process(name, folder, work, seconds):
    """Returns (record or None, CPU seconds, whether it ran out of time). Kills the run after ten times `seconds` by the
    clock."""
    os.makedirs(work, exist_ok=True)
    for stale in ("record.json", "end.npy"):
        if os.path.exists(os.path.join(work, stale)):
            os.remove(os.path.join(work, stale))
    environment = dict(os.environ, OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
    words = [sys.executable, os.path.abspath(__file__), folder, "--adapters", name, "--one", work, "--seconds", str(seconds)]
    with open(os.path.join(work, "log.txt"), "w", encoding="utf-8") as log:
        process = subprocess.Popen(words, stdout=log, stderr=log, env=environment, start_new_session=True,
                                   preexec_fn=lambda: limit(seconds))
        end = time.monotonic() + 10 * seconds
        while True:
            pid, status, usage = os.wait4(process.pid, os.WNOHANG)
            if pid or time.monotonic() > end:
                break
            time.sleep(0.02)
        late = not pid
        if late:
            os.killpg(process.pid, signal.SIGKILL)
            _, status, usage = os.wait4(process.pid, 0)
    process.returncode = status
    used = usage.ru_utime + usage.ru_stime
    try:
        with open(os.path.join(work, "record.json"), encoding="utf-8") as file:
            return json.load(file), used, late
    except (OSError, ValueError):
        # The kernel counts the CPU time for its limit separately from the one that it reports.
        return None, used, late or used >= seconds or os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGXCPU


def run(name, folder, case, work, seconds):
    """Runs the case and returns the record of the run."""
    adapter = load(name)
    reason = why_not(adapter, case)
    if reason:
        return {"outcome": "cannot", "said": reason}
    result, used, late = in_a_process(name, folder, work, seconds)
    adapter.cleanup(work)
    if result is None:
        return {"outcome": "out of time" if late else "died", "said": f"see {work}/log.txt", "cpu": used}
    result["cpu"] = used
    if result["said"]:
        # A solver whose child process was killed for its CPU time reports a failure.
        return {**result, "outcome": "out of time" if used >= seconds else "stopped"}
    figures = judges.judge(case, np.load(os.path.join(work, "end.npy")))
    return {**result, **figures, "outcome": "wrong end" if figures["wrong"] else "solved"}


def frozen(path):
    """Reads the frozen checksums of cases, by name."""
    if not os.path.exists(path):
        return {}
    with open(path, encoding="utf-8") as file:
        return {line.split()[1]: line.split()[0] for line in file if line.strip() and line[0] != "#"}


def find(folders):
    found = []
    for folder in folders:
        found += [at for at, _, files in os.walk(folder) if "case.json" in files]
    if not found:
        raise ValueError(f"no case.json in or below {' '.join(folders)}")
    return sorted(found, key=os.path.basename)


def table(records, adapters):
    """Returns a table: for each adapter a row of all cases, and below it one of each kind (forms and element)."""
    lines = ["| solver | " + " | ".join(OUTCOMES) + " | Newton, median | CPU s, median |",
             "|---" * (len(OUTCOMES) + 3) + "|"]
    for name in adapters:
        own = [r for r in records if r["adapter"] == name]
        groups = [("", own)] + [(f", {kind}", [r for r in own if r["kind"] == kind]) for kind in
                                sorted({r["kind"] for r in own})]
        for label, rows in groups:
            count = collections.Counter(r["outcome"] for r in rows)
            good = [r for r in rows if r["outcome"] == "solved"]
            middle = [f"{np.median([r[key] for r in good]):.2g}" if good else "–" for key in ("newton", "seconds")]
            if rows:
                lines.append(f"| {rows[0]['version'] if not label else name + label} | " +
                             " | ".join(str(count[o]) for o in OUTCOMES) + " | " + " | ".join(middle) + " |")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", metavar="FOLDER")
    parser.add_argument("--adapters", default="flesh,calculix,fenicsx,fenicsx:SNES=1")
    parser.add_argument("--seconds", type=float, default=60, help="CPU time of a run (default 60)")
    parser.add_argument("--out", default="out/others")
    parser.add_argument("--frozen", default=FROZEN, help="file of checksums, by which cases must not have changed")
    parser.add_argument("--freeze", action="store_true", help="print the checksums of the cases and exit")
    parser.add_argument("--again", action="store_true", help="repeat runs that have a result")
    parser.add_argument("--one", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    names = arguments.adapters.split(",")
    if arguments.one:
        run_one(names[0], arguments.folders[0], arguments.one, arguments.seconds)
        return 0
    try:
        read = [(folder, cases.read(folder)) for folder in find(arguments.folders)]
        for at, case in read:
            if not set(case.forms) <= set(judges.FORMS):
                raise ValueError(f"{at} has the form {', '.join(case.forms)}; the judge knows {', '.join(judges.FORMS)}")
    except (OSError, ValueError, KeyError) as error:
        print(f"battery.py: {error}", file=sys.stderr)
        return 2
    if arguments.freeze:
        for _, case in read:
            print(case.sum, case.name)
        return 0
    known = frozen(arguments.frozen)
    changed = [case.name for _, case in read if known.get(case.name, case.sum) != case.sum]
    if changed:
        print(f"battery.py: not as they were frozen in {arguments.frozen}: {', '.join(changed)}", file=sys.stderr)
        return 2
    versions = {name: load(name).version() for name in names}
    for name in [name for name in names if not versions[name]]:
        print(f"# {name} is not installed", flush=True)
        names.remove(name)
    os.makedirs(arguments.out, exist_ok=True)
    path, done = os.path.join(arguments.out, "results.jsonl"), {}
    if os.path.exists(path):
        with open(path, encoding="utf-8") as file:
            for line in file:
                if line.endswith("\n"):  # a line without end was cut when the battery was killed
                    record = json.loads(line)
                    done[key_of(record)] = record
    records = []
    for folder, case in read:
        for name in names:
            head = {"case": case.name, "sum": case.sum, "adapter": name, "version": versions[name],
                    "limit": arguments.seconds, "kind": f"{'+'.join(case.forms)} {case.element}"}
            record = done.get(key_of(head))
            if record is None or arguments.again:
                work = os.path.join(arguments.out, "runs", case.name, os.path.basename(name))
                record = {**head, **run(name, os.path.abspath(folder), case, os.path.abspath(work), arguments.seconds)}
                record.setdefault("seconds", record.get("cpu"))
                with open(path, "a", encoding="utf-8") as file:
                    file.write(json.dumps(record) + "\n")
            records.append(record)
            said = record.get("said") or "; ".join(record.get("wrong", []))
            print(f"# {case.name} {name}: {record['outcome']}{', ' + said if said else ''}", flush=True)
            if record["outcome"] not in ("solved", "cannot"):
                print(f"#   again: python3 drivers/others/battery.py {folder} --adapters {name} --seconds "
                      f"{arguments.seconds:g} --again", flush=True)
    print(table(records, names))
    return 0


def key_of(record):
    return tuple(record[key] for key in ("sum", "adapter", "version", "limit"))


if __name__ == "__main__":
    sys.exit(main())
