#!/usr/bin/env python3
"""allocations.py: every k-th allocation of `mesh`, `check`, `run`, `snap`, `report`, `sweep` and `fit` fails, alone and with all after it.

  FLESH=build/drivers/flesh FAIL_ALLOCATION=build/test/libfail_allocation.so python3 test/campaign/allocations.py
  ... --full          every k in place of every 29th

Each command then says so in one line and ends with 1, or does without and leaves the same files; it does not crash by
its own fault (crashes within libraries are counted apart, and which libraries these are is told), and leaves no part of
a file and no result that says it is running. In a sweep each process counts its own allocations, and a case
that fails is a row that says so.
"""
import argparse
import base64
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import zlib

FLESH = os.path.realpath(os.environ.get("FLESH", "build/drivers/flesh"))
SHIM = os.path.realpath(os.environ.get("FAIL_ALLOCATION", "build/test/libfail_allocation.so"))
SCENE = """body: {mesh: bar.msh, material: {energy: S, young: 1e5, poisson: 0.45}}
effects: [{inertia: {}}, {gravity: {}}, {pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}}]
time: {step: 1/60, end: 1/30}
"""
SPEC = """scene: bar.yaml
keep: true
axes: [{key: time.end, name: end, values: [1/60, 1/30]}]
"""
FIT = """experiments:
  - name: bar
    scene: bar.yaml
    set: {effects.inertia: null, time: {method: static, step: 1, end: 1}}
    measured: [{positions: fit.csv, deviation: 1e-2}]
parameters: [{key: body.material.young, start: 4e5, spacing: logarithmic}]
"""
COMMANDS = {
    "mesh": ["mesh", "convert", "bar.msh", "new/made.node"],
    "check": ["check", "bar.yaml"],
    "run": ["run", "bar.yaml", "--out", "new/out", "--quiet"],
    "snap": ["snap", "run", "--out", "new/picture.png", "--width", "64"],
    "report": ["report", "run", "--out", "new/report.html"],
    "fit": ["fit", "fit.yaml", "--out", "new/out", "--quiet"],
    "sweep": ["sweep", "spec.yaml", "--out", "new/out", "--jobs", "1", "--quiet"],
}
# Content that differs from run to run.
TIMEOUT = 20
VARIES = re.compile(rb'.*"(wall_s|cpu_s|date|peak_memory_kB|memory_bytes)".*\n')


def unpacked(data):
    """Returns a report with its payload unpacked, without the date."""
    found = re.search(rb'type="text/plain">([A-Za-z0-9+/=]+)<', data)
    if not found:
        return data
    payload = zlib.decompress(base64.b64decode(found[1]))
    return data.replace(found[1], re.sub(rb'"date":"[^"]*"', b"", payload))


def contents(folder):
    found = {}
    for top, _, files in os.walk(folder):
        for name in files:
            path = os.path.join(top, name)
            if not name.endswith((".db", ".db-wal", ".db-shm", "log.txt")):
                data = open(path, "rb").read()
                found[os.path.relpath(path, folder)] = unpacked(data) if name.endswith(".html") else VARIES.sub(b"", data)
    return found


def attempt(folder, words, at, on, count=None):
    new = os.path.join(folder, "new")
    shutil.rmtree(new, ignore_errors=True)
    os.mkdir(new)
    env = {**os.environ, "LD_PRELOAD": SHIM, "FLESH_FAIL_AT": str(at), "FLESH_FAIL_ON": str(on),
           "PATH": "/nowhere"}  # because gnuplot, which draws the fit, would lack memory, too
    if count:
        env["FLESH_FAIL_COUNT"] = count
    process = subprocess.Popen([FLESH, *words], cwd=folder, env=env, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    try:
        said = process.communicate(timeout=TIMEOUT)[1]
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGABRT)  # it reports where it is
        try:
            said = process.communicate(timeout=5)[1]
        except subprocess.TimeoutExpired:
            process.kill()
            said = process.communicate()[1]
        said = b"does not end\n" + said
    return process.returncode, said.decode(errors="replace")


def culprit(said):
    """Returns the library or program that a crash is in, leaving out the C library, and its function."""
    for line in said.splitlines():
        found = re.match(r"frame: (.*)\((\w*)", line)
        if found and not re.match(r"(libc|ld-linux.*|libfail_allocation|libpthread)\.so", os.path.basename(found[1])):
            return os.path.basename(found[1]), found[2]
    return "", ""


def fault_of(folder, kind, code, words, wanted, known):
    """Returns None if the run is fine, "known" for a crash of a library, else what is wrong."""
    got = contents(os.path.join(folder, "new"))
    parts = [name for name in got if ".part-" in name or name.endswith(".flesh.lock")]
    if code < 0:
        library, function = culprit(words)
        if library and library != os.path.basename(FLESH):
            known.add(library)
            return "known"
        return f"ends by signal {-code} in {library} {function}: {words[:60]!r}"
    if parts:
        return f"leaves {parts}"
    if kind != "sweep" and any(b'"status": "running"' in data for data in got.values()):
        return "its result says that it is running"
    if code == 0:
        if kind == "sweep":
            return None  # its rows say what failed
        return None if got == wanted else f"gives other files: {sorted(set(got.items()) ^ set(wanted.items()))[:1]!r:.300}"
    if code != 1 and not (kind == "sweep" and code in (2, 3)):
        return f"ends with {code}: {words[:200]}"
    return None if words.strip() else "says nothing"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--full", action="store_true")
    parser.add_argument("commands", nargs="*")
    options = parser.parse_args()
    stride = 1 if options.full else 29
    known = set()
    folder = tempfile.mkdtemp(prefix="flesh-allocations-", dir=os.environ.get("TMPDIR", "/dev/shm"))
    all_faults = all_tried = 0
    try:
        for name, text in {"bar.yaml": SCENE, "fit.yaml": FIT, "fit.csv": "X,Y,Z,x,z\n2,0.5,0.5,2,0\n", "spec.yaml": SPEC}.items():
            with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
                file.write(text)
        for words in ["mesh", "box", "--cells", "2,1,1", "--size", "2,1,1", "--out", "bar.msh"], ["run", "bar.yaml", "--out", "run"]:
            subprocess.run([FLESH, *words], cwd=folder, check=True, stdout=subprocess.DEVNULL)
        for kind, words in COMMANDS.items():
            if options.commands and kind not in options.commands:
                continue
            count = os.path.join(folder, "count.txt")
            code, said = attempt(folder, words, 0, 0, count)
            if code:
                sys.exit(f"{kind}: {said}")
            wanted, total = contents(os.path.join(folder, "new")), int(open(count, encoding="utf-8").read())
            tally = {"tried": 0, "fine without": 0, "refused": 0, "crashes of libraries": 0, "faults": 0}
            for on in 0, 1:
                for k in range(1 + on * (stride // 2), total + 1, stride):
                    code, said = attempt(folder, words, k, on)
                    fault = fault_of(folder, kind, code, said, wanted, known)
                    tally["tried"] += 1
                    if fault == "known":
                        tally["crashes of libraries"] += 1
                    elif fault:
                        tally["faults"] += 1
                        print(f"FAULT: {kind}, {k} of {total}{' and all after it' if on else ''}: {fault}", flush=True)
                    else:
                        tally["refused" if code else "fine without"] += 1
            print(f"{kind}: {total} allocations: " + ", ".join(f"{n} {what}" for what, n in tally.items()), flush=True)
            all_faults += tally["faults"]
            all_tried += tally["tried"]
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    print(f"{all_tried} failing allocations, {all_faults} faults; crashes within: {', '.join(sorted(known)) or 'nothing'}")
    return 1 if all_faults or not all_tried else 0


if __name__ == "__main__":
    sys.exit(main())
