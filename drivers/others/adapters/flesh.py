"""flesh.py: the adapter for flesh itself, whose program gets the same data as any other solver. FLESH names the program."""
import json
import os
import subprocess

import numpy as np

from case import write_medit

PROGRAM = os.environ.get("FLESH", "build/drivers/flesh")
ELEMENT = ""  # element to use instead of the case's; empty: the case's
TOLERANCE = 1e-8


def version():
    try:
        said = subprocess.run([PROGRAM, "--version"], capture_output=True, text=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError):
        return None
    return said.split("\n")[0]


def can_run(case):
    """Returns None if the adapter can run the case, else why it cannot."""
    return "its adapter has no loads" if case.loads.any() else None


def material(values):
    return f"{{energy: {values['energy']}, constants: raw, mu: {values['mu']!r}, lambda: {values['lambda']!r}}}"


def scene(case):
    """Returns the text of the scene."""
    lines = ["body:", "  mesh: body.mesh", f"  element: {ELEMENT or case.element}", f"  material: {material(case.materials[0])}"]
    if len(case.materials) > 1:
        lines.append("  regions:")
        lines += [f"    - {{tags: [{k}], material: {material(m)}}}" for k, m in enumerate(case.materials)]
    lines += ["effects:", "  - elasticity: {}"]
    moves = np.round(case.held_at - case.rest[case.fixed], 12)
    for move in np.unique(moves, axis=0):
        nodes = case.fixed[(moves == move).all(1)].tolist()
        if move.any():
            lines.append(f"  - prescribed_motion: {{nodes: {nodes}, motion: [{{time: 0, translation: {move.tolist()}}}]}}")
        else:
            lines.append(f"  - pin: {{nodes: {nodes}}}")
    if len(case.moved):
        lines += ["output:", f"  probes: [{{name: moved, nodes: {case.moved.tolist()}, quantities: [reaction]}}]"]
    lines += ["time: {method: static}", "start: {state: start.txt}", f"solver: {{newton_tolerance: {TOLERANCE}}}", ""]
    return "\n".join(lines)


def solve(case, seconds, folder):
    """Returns a dict: final positions x [n, 3] (m; None if it failed), Newton iterations, CPU seconds, why it failed (else
    None), and the total force on the moved nodes (N)."""
    write_medit(os.path.join(folder, "body.mesh"), case.rest, case.tets, case.region)
    np.savetxt(os.path.join(folder, "start.txt"), np.column_stack([case.start, 0 * case.start]), "%.17g")
    with open(os.path.join(folder, "scene.yaml"), "w", encoding="utf-8") as file:
        file.write(scene(case))
    out = os.path.join(folder, "out")
    run = subprocess.run([PROGRAM, "run", os.path.join(folder, "scene.yaml"), "--out", out, "--quiet"], check=False,
                         capture_output=True, text=True)
    try:
        with open(os.path.join(out, "result.json"), encoding="utf-8") as file:
            result = json.load(file)
    except OSError:
        return {"x": None, "newton": 0, "said": " ".join(run.stderr.split())}
    figures = result["figures"]
    x = np.loadtxt(os.path.join(out, "state.txt"))[:, :3] if run.returncode == 0 else None
    force = None
    if x is not None and len(case.moved):
        with open(os.path.join(out, "probes.csv"), encoding="utf-8") as file:
            names, *_, last = [line.rstrip("\n").split(",") for line in file]
        force = [float(last[names.index(f"moved.reaction_{axis} [N]")]) for axis in "xyz"]
    return {"x": x, "newton": figures["newton"], "seconds": figures["cpu_s"], "force": force,
            "said": None if run.returncode == 0 else result["message"]}


def cleanup(folder):
    for name in ("history.csv", "state.txt"):
        path = os.path.join(folder, "out", name)
        if os.path.exists(path):
            os.remove(path)
