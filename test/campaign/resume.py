#!/usr/bin/env python3
"""resume.py: `flesh run --checkpoint`, killed (SIGKILL) at random moments and gone on with by --resume, over and over.

  FLESH=build/drivers/flesh python3 test/campaign/resume.py            40 kills
  FLESH=build/drivers/flesh python3 test/campaign/resume.py --full     200 kills
  ... --kills N --seed S --only WORD

Every run ends with the bits of one that nothing has disturbed and that writes no checkpoints: all files but
result.json, and the figures and counts in that. Checkpoints are written every few steps or every few hundredths of a
second, by chance. With IDA, whose history is not restored, the last positions agree within time.tolerance instead.
"""
import argparse
import json
import math
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time

FLESH = os.path.realpath(os.environ.get("FLESH", "build/drivers/flesh"))
SCENES = os.path.join(os.path.dirname(os.path.realpath(__file__)), "..", "..", "data", "scenes")
SWING, JELLY, TWIST = "swing_coarse.yaml", "jelly_drop.yaml", "twist.yaml"
THROWN = ("start.velocity=[0.4, 0, -2]", "time.end=0.4")
OUTPUT = ("output.frame_interval=3", "output.fields=[stress, reaction]", "output.probes=[{name: all, box: [[-9, -9, -9], [9, 9, 9]], "
          "quantities: [position, reaction, stress, energy]}]")

# Name, scene, values; the figures that must be above 0, so that a case is what its name says.
CASES = [
    ("euler", SWING, ("time.end=2",), None),
    ("euler, kept matrices", SWING, ("time.end=1", "time.step=1/480"), None),
    ("bdf2", SWING, ("time.end=2", "time.method=bdf2"), None),
    ("midpoint", SWING, ("time.end=2", "time.method=midpoint"), None),
    ("newmark", SWING, ("time.end=2", "time.method=newmark"), None),
    ("hht", SWING, ("time.end=2", "time.method=hht"), None),
    ("klu", SWING, ("time.end=1", "solver.linear_solver=klu", "time.step=1/240"), None),
    ("direct fallback", SWING, ("time.end=1", "solver.preconditioner=none", "solver.max_linear=40"), "direct"),
    ("two levels", "bar_gravity.yaml", ("body.mesh=../meshes/bar_16x4x4.mesh", "solver.preconditioner=two-level",
                                        "time.end=0.5"), None),
    ("refined, two threads", SWING, ("body.refine=1", "time.end=0.5", "solver.threads=2"), None),
    ("twist", TWIST, ("time.end=0.5",), "projections"),
    ("twist, newmark", TWIST, ("time.end=0.2", "time.method=newmark", "time.max_energy_gain=1e9"), "projections"),
    ("ten nodes", SWING, ("body.element=tet10", "time.end=0.5"), None),
    ("volume projection", SWING, ("body.element=tet10-mean", "body.material.poisson=0.4995", "time.end=0.3"), None),
    ("nu 1/2", SWING, ("body.element=tet10-mean", "body.material.poisson=0.5", "time.end=0.3"), "multiplier_updates"),
    ("nu 1/2, midpoint", SWING, ("body.element=tet10-mean", "body.material.poisson=0.5", "time.end=0.2",
                                 "time.method=midpoint"), "multiplier_updates"),
    ("friction", JELLY, THROWN, None),
    ("friction, midpoint", JELLY, (*THROWN, "time.method=midpoint"), "impact_steps"),
    ("prescribed motion", "viscous_spin.yaml", ("body.mesh=../meshes/bar_8x2x2.mesh", "time.end=0.5"), None),
    ("static", "loaded_bar.yaml", ("body.mesh=../meshes/bar_8x2x2.mesh", "time.step=1/40"), None),
    ("untangle", "knot.yaml", ("solver.techniques=[-softened_steps]",), "untanglings"),
    ("ida", SWING, ("time.end=2", "time.method=ida", "time.tolerance=1e-3"), None),
    ("runge-kutta", TWIST, ("time.end=1", "time.method=runge-kutta", "time.tolerance=1e-3"), None),
]
# A clamped bar whose nodes start anywhere in it; long steps damp its motion.
KNOT = """body: {mesh: knot.msh, density: 1000, material: {energy: S, young: 1e5, poisson: 0.49}}
effects: [inertia: {}, pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}]
start: {state: knot.txt}
time: {step: 1/2, end: 30, max_energy_gain: 1e9}
"""
faults = []


def fault(what):
    faults.append(what)
    print(f"FAULT: {what}", flush=True)


def read(path):
    with open(path, "rb") as file:
        return file.read()


def flesh(folder, *words):
    return subprocess.run([FLESH, *words], cwd=folder, capture_output=True, timeout=600, check=False)


def files(folder):
    """Lists the files except the lock of a run that was killed when all was done."""
    return sorted(os.path.relpath(os.path.join(top, name), folder) for top, _, names in os.walk(folder) for name in names
                  if name != ".flesh.lock")


def counts(folder):
    """Returns the part of result.json that does not depend on the machine's speed."""
    result = json.loads(read(os.path.join(folder, "result.json")))
    figures = {key: value for key, value in result["figures"].items() if key not in ("wall_s", "cpu_s", "peak_memory_kB")}
    return result["status"], figures, result["effects"], result["warning"]


def positions(path):
    return [[float(word) for word in line.split()[:3]] for line in read(path).decode().splitlines() if line[0] != "#"]


class Case:
    def __init__(self, folder, number, name, scene, values, needs):
        self.folder, self.name = folder, name
        self.whole, self.out = os.path.join(folder, f"whole_{number}"), os.path.join(folder, f"out_{number}")
        path = scene if scene == "knot.yaml" else os.path.join(SCENES, scene)
        values = [value.replace("=../meshes", "=" + os.path.join(SCENES, "../meshes")) for value in (*values, *OUTPUT)]
        self.words = ["run", path, "--quiet", *(word for value in values for word in ("--set", value))]
        self.inexact = name == "ida"
        started = time.time()
        done = flesh(folder, *self.words, "--out", self.whole)
        self.seconds = time.time() - started
        if done.returncode:
            sys.exit(f"{name}: {done.stderr.decode()}")
        figures = counts(self.whole)[1]
        if needs and not figures.get(needs):
            sys.exit(f"{name}: no {needs}")

    def check(self):
        if self.inexact:
            x, y = (positions(os.path.join(folder, "state.txt")) for folder in (self.whole, self.out))
            off = max(math.dist(a, b) for a, b in zip(x, y)) / 4
            if not off <= 1e-3:
                fault(f"{self.name}: apart by {off:.2g} of the length")
            return
        if files(self.whole) != files(self.out):
            fault(f"{self.name}: other files: {set(files(self.whole)) ^ set(files(self.out))}")
        for name in files(self.whole):
            there = os.path.join(self.out, name)
            if name != "result.json" and os.path.exists(there) and read(there) != read(os.path.join(self.whole, name)):
                fault(f"{self.name}: {name} is another")
        if counts(self.whole) != counts(self.out):
            fault(f"{self.name}: the figures are others")

    def killed(self, words, chance):
        """Runs the command and kills it; returns whether it was killed before its end."""
        process = subprocess.Popen([FLESH, *words], cwd=self.folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        time.sleep(chance.uniform(0, 1.1 * self.seconds))
        alive = process.poll() is None
        if alive:
            process.send_signal(signal.SIGKILL)
        words = process.communicate()[1].decode()
        if not alive and process.returncode:
            fault(f"{self.name}: ended with {process.returncode}: {words}")
        return alive and process.returncode < 0

    def run(self, chance):
        """Performs one run with its kills; returns their number."""
        every = chance.choice(("1steps", "2steps", "5steps", "13steps", "0.01s", "0.05s"))
        kills = 0
        shutil.rmtree(self.out, ignore_errors=True)
        if not self.killed([*self.words, "--out", self.out, "--checkpoint", every], chance):
            return 0
        kills = 1
        while kills < 6 and os.path.exists(os.path.join(self.out, "checkpoint.bin")):
            if not self.killed(["run", "--quiet", "--resume", self.out], chance):
                break
            kills += 1
        if os.path.exists(os.path.join(self.out, "checkpoint.bin")):
            done = flesh(self.folder, "run", "--quiet", "--resume", self.out)
            if done.returncode:
                fault(f"{self.name}: gone on with it ends with {done.returncode}: {done.stderr.decode()}")
        elif not os.path.exists(os.path.join(self.out, "state.txt")):
            return kills  # killed before any checkpoint existed
        if len(faults) < 20:
            self.check()
        return kills


def make_knot(folder):
    for words in (("mesh", "box", "--cells", "12,4,4", "--size", "1,1/3,1/3", "--out", "knot.msh"),
                  ("mesh", "convert", "knot.msh", "knot.mesh")):
        done = flesh(folder, *words)
        if done.returncode:
            sys.exit(done.stderr.decode())
    words = read(os.path.join(folder, "knot.mesh")).decode().split()
    at, chance = words.index("Vertices"), random.Random(5)
    with open(os.path.join(folder, "knot.txt"), "w", encoding="utf-8") as file:
        for k in range(int(words[at + 1])):
            x = [float(word) for word in words[at + 2 + 4 * k:at + 5 + 4 * k]]
            if x[0] > 1e-9:
                x = [chance.random(), chance.random() / 3, chance.random() / 3]
            file.write(f"{x[0]!r} {x[1]!r} {x[2]!r} 0 0 0\n")
    with open(os.path.join(folder, "knot.yaml"), "w", encoding="utf-8") as file:
        file.write(KNOT)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--full", action="store_true")
    parser.add_argument("--kills", type=int)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    kills = options.kills or (200 if options.full else 40)
    chance = random.Random(options.seed)
    folder = tempfile.mkdtemp(prefix="flesh-resume-", dir=os.environ.get("TMPDIR", "/dev/shm"))
    make_knot(folder)
    cases = [Case(folder, k, *case) for k, case in enumerate(CASES) if options.only in case[0]]
    done = runs = 0
    while done < kills and runs < 5 * kills and len(faults) < 20:
        done += cases[runs % len(cases)].run(chance)
        runs += 1
    if not faults:
        shutil.rmtree(folder, ignore_errors=True)
    print(f"{done} kills in {runs} runs of {len(cases)} cases; {len(faults)} faults (seed {options.seed})"
          f"{', see ' + folder if faults else ''}")
    return 1 if faults or done < kills else 0


if __name__ == "__main__":
    sys.exit(main())
