#!/usr/bin/env python3
"""kills.py: `flesh run` and `flesh sweep`, killed (SIGKILL) at random moments.

  FLESH=build/drivers/flesh python3 test/campaign/kills.py            40 kills
  FLESH=build/drivers/flesh python3 test/campaign/kills.py --full     1000 kills, half of each
  ... --kills N --seed S

After every kill each file is whole: no table, frame, state or picture ends in the middle, every row and frame that is
there is one of those of an undisturbed run, `complete` stands only in a result whose state and history are those of the
undisturbed run, and the rows of finished cases stay as they were. Then the same command (`--resume` for a sweep) does
what is left, gives the undisturbed results bit for bit and clears away what the killed process left behind.
"""
import argparse
import json
import os
import random
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time

FLESH = os.path.realpath(os.environ.get("FLESH", "build/drivers/flesh"))
SCENE = """body: {mesh: box.msh, density: 1000, material: {energy: S, young: 1e5, poisson: 0.45}}
effects:
  - inertia: {}
  - gravity: {acceleration: [0, 0, -9.81]}
  - pin: {box: [[-1, -1, -1], [1e-9, 9, 9]]}
time: {method: backward-euler, step: 1/200, end: 1/4}
output: {frame_interval: 1, skin: {surface: skin.obj, formats: [obj, vtu, pc2]}}
"""
SPEC = "scene: box.yaml\nkeep: true\nset: {output.frame_interval: 0, time.end: 1/5}\n" \
       "axes: [{key: body.material.poisson, name: nu, values: [0.3, 0.35, 0.4, 0.45]}, " \
       "{key: time.step, name: step, values: [1/100, 1/200]}]\n"
faults = []


def fault(what):
    faults.append(what)
    print(f"FAULT: {what}", flush=True)


def expect(condition, what):
    if not condition:
        fault(what)


def read(path):
    with open(path, "rb") as file:
        return file.read()


def flesh(folder, *words):
    return subprocess.run([FLESH, *words], cwd=folder, capture_output=True, timeout=300, check=False)


def leftovers(folder):
    """Lists files of processes that have ended: parts of files, locks, and cases claimed by a sweep's workers."""
    found = []
    for top, _, files in os.walk(folder):
        found += [os.path.join(top, f) for f in files if ".part-" in f or f.endswith(".lock") or f.startswith(".sweep")]
    return found


def killed(folder, words, longest, chance):
    """Starts the command and kills it with all its children; returns whether it was still running, and after how
    long."""
    process = subprocess.Popen([FLESH, *words], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                               start_new_session=True)
    pause = chance.uniform(0, longest)
    time.sleep(pause)
    alive = process.poll() is None
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except ProcessLookupError:
        pass
    process.wait()
    return alive, pause


class Run:
    """Kills of a run; `whole` is the folder of an undisturbed one."""

    words = ("run", "box.yaml", "--out", "out", "--quiet", "--save-state", "saved.txt")

    def __init__(self, folder):
        self.folder, self.out, self.whole = folder, os.path.join(folder, "out"), os.path.join(folder, "whole")
        started = time.time()
        done = flesh(folder, *self.words)
        self.seconds = time.time() - started
        if done.returncode:
            sys.exit(done.stderr.decode())
        shutil.move(self.out, self.whole)
        self.saved = read(os.path.join(folder, "saved.txt"))
        os.unlink(os.path.join(folder, "saved.txt"))

    def check_file(self, path, reference):
        name, data = os.path.relpath(path, self.out), read(path)
        wanted = read(reference) if os.path.exists(reference) else None
        if name == "result.json":
            try:
                result = json.loads(data)
            except ValueError:
                return fault(f"{name} is not whole")
            if result["status"] == "complete":
                for other in "state.txt", "history.csv", "scene.yaml":
                    there = os.path.join(self.out, other)
                    expect(os.path.exists(there) and read(there) == read(os.path.join(self.whole, other)),
                           f"complete, and {other} is another")
            return expect(result["status"] in ("running", "complete"), f"the status is {result['status']}")
        if wanted is None:
            return fault(f"{name} is of no undisturbed run")
        if name.endswith((".pvd", "history.csv")):
            # Written as the run goes on: existing rows equal those of the undisturbed run.
            expect(data.endswith(b"\n") or not data, f"{name} ends in the middle of a row")
            if name.endswith(".pvd"):
                expect(data.rstrip().endswith(b"</VTKFile>"), f"{name} is cut")
                for file in [line.split(b'file="')[1].split(b'"')[0] for line in data.splitlines() if b'file="' in line]:
                    expect(os.path.exists(os.path.join(os.path.dirname(path), file.decode())), f"{name} names {file}")
            expect(set(data.splitlines()) <= set(wanted.splitlines()), f"{name} has rows of its own")
        else:
            expect(data == wanted, f"{name} is not whole")
        return None

    def check(self):
        for top, _, files in os.walk(self.out):
            for file in files:
                path = os.path.join(top, file)
                if ".part-" in file or file.endswith(".lock"):
                    continue
                self.check_file(path, os.path.join(self.whole, os.path.relpath(path, self.out)))
        saved = os.path.join(self.folder, "saved.txt")
        expect(not os.path.exists(saved) or read(saved) == self.saved, "the saved state is not whole")

    def again(self):
        done = flesh(self.folder, *self.words)
        if done.returncode:
            return fault(f"run again it ends with {done.returncode}: {done.stderr.decode()}")
        self.check()
        for top, _, files in os.walk(self.whole):
            for file in files:
                path = os.path.join(self.out, os.path.relpath(os.path.join(top, file), self.whole))
                expect(os.path.exists(path), f"run again it lacks {file}")
        expect(json.loads(read(os.path.join(self.out, "result.json")))["status"] == "complete", "run again it is not complete")
        expect(not leftovers(self.folder), f"run again it leaves {leftovers(self.folder)}")
        return None

    def kill(self, chance):
        alive, pause = killed(self.folder, self.words, 1.1 * self.seconds, chance)
        self.check()
        self.seconds = 0.98 * self.seconds if not alive else max(self.seconds, pause)
        if chance.random() < 0.2:
            self.again()
            if chance.random() < 0.5:
                shutil.rmtree(self.out)
        return alive


class Sweep:
    """Kills of a sweep: each start resumes what the killed one has left, until all is done."""

    words = ("sweep", "spec.yaml", "--out", "swept", "--jobs", "2", "--resume", "--quiet")
    columns = "id, nu, step, status, exit_code, newton, t_end"

    def __init__(self, folder):
        self.folder, self.base = folder, os.path.join(folder, "swept", "sweep.db")
        started = time.time()
        done = flesh(folder, *self.words)
        self.seconds = time.time() - started
        if done.returncode:
            sys.exit(done.stderr.decode())
        self.whole = self.rows(self.columns)
        self.before = {}
        shutil.rmtree(os.path.dirname(self.base))

    def rows(self, columns, table="results"):
        """Reads the rows of a table. A database killed during a transaction is rolled back when it is opened next."""
        base = sqlite3.connect(self.base, timeout=30)
        try:
            return base.execute(f"SELECT {columns} FROM {table} ORDER BY id").fetchall()
        finally:
            base.close()

    def check(self):
        if not os.path.exists(self.base):
            return expect(not self.before, "the database is gone")
        base = sqlite3.connect(self.base, timeout=30)
        tables = [name for (name,) in base.execute("SELECT name FROM sqlite_master WHERE name = 'cases'")]
        intact = base.execute("PRAGMA integrity_check").fetchall()
        base.close()
        expect(intact == [("ok",)], f"the database is broken: {intact}")
        if not tables:
            return expect(not self.before, "the tables are gone")
        rows = {row[0]: row for row in self.rows("id, started, worker, seconds, status, result, message", "cases")}
        for number, row in self.before.items():
            expect(rows.get(number) == row, f"the finished case {number} has changed")
        self.before = {number: row for number, row in rows.items() if row[3] is not None}
        for number, row in self.before.items():
            expect(row[4] == "complete", f"case {number} is {row[4]}: {row[6]}")
            kept = os.path.join(self.folder, "swept", "cases", f"{number:06d}", "state.txt")
            expect(os.path.exists(kept) and read(kept).endswith(b"\n"), f"case {number} is complete without a state")
        return None

    def finish(self):
        done = flesh(self.folder, *self.words)
        if done.returncode:
            return fault(f"resumed it ends with {done.returncode}: {done.stderr.decode()}")
        self.check()
        expect(self.rows(self.columns) == self.whole, "resumed it gives other results")
        expect(not leftovers(os.path.join(self.folder, "swept")), f"resumed it leaves {leftovers(os.path.join(self.folder, 'swept'))}")
        shutil.rmtree(os.path.dirname(self.base))
        self.before = {}
        return None

    def kill(self, chance):
        alive, _ = killed(self.folder, self.words, 0.7 * self.seconds, chance)
        self.check()
        if not alive or chance.random() < 0.2:
            self.finish()
        return alive


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--full", action="store_true")
    parser.add_argument("--kills", type=int)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    kills = options.kills or (1000 if options.full else 40)
    chance = random.Random(options.seed)
    folder = tempfile.mkdtemp(prefix="flesh-kills-", dir=os.environ.get("TMPDIR", "/dev/shm"))
    counts = {}
    try:
        for words in (("mesh", "box", "--cells", "8,3,3", "--size", "8,3,3", "--out", "box.msh"),
                      ("mesh", "surface", "box.msh", "skin.obj")):
            done = flesh(folder, *words)
            if done.returncode:
                sys.exit(done.stderr.decode())
        for name, content in ("box.yaml", SCENE), ("spec.yaml", SPEC):
            with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
                file.write(content)
        for kind in Run, Sweep:
            victim, amidst, tried = kind(folder), 0, 0
            while amidst < kills // 2 and tried < 5 * kills and len(faults) < 100:
                amidst += victim.kill(chance)
                tried += 1
            counts[kind.__name__.lower()] = amidst
    finally:
        if not faults:
            shutil.rmtree(folder, ignore_errors=True)
    words = ", ".join(f"{count} of {kind}" for kind, count in counts.items())
    print(f"killed amidst: {words}; {len(faults)} faults (seed {options.seed}){', see ' + folder if faults else ''}")
    return 1 if faults or sum(counts.values()) < kills // 2 * 2 else 0


if __name__ == "__main__":
    sys.exit(main())
