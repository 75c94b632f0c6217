"""calculix.py: the adapter for CalculiX (Debian's calculix-ccx), with its elements C3D4 and C3D10 and the material
*HYPERELASTIC, NEO HOOKE, which is flesh's form B."""
import os
import re
import shutil
import subprocess

import numpy as np

FIRST = 0.1  # first increment of the step if nodes are moved; CalculiX chooses the following ones
# Whether 100 iterations are allowed before an increment is cut, and a largest residual of 1e-7 of the mean force, not 5e-3.
TIGHT = True
CONTROLS = ["*CONTROLS, PARAMETERS=TIME INCREMENTATION", "50, 80, 9, 100, 10, 4, , 5, , ",
            "*CONTROLS, PARAMETERS=FIELD", "1e-7, 1e-2, , , , , , "]


def version():
    if not shutil.which("ccx"):
        return None
    said = subprocess.run(["ccx", "-v"], capture_output=True, text=True, check=False).stdout
    return "CalculiX " + re.search(r"Version (\S+)", said).group(1)


def can_run(case):
    """Returns None if the adapter can run the case, else why it cannot."""
    if case.forms != ["B"]:
        return f"has no form {', '.join(case.forms)}"
    return None


def deck(case):
    """Returns the text of the input file. CalculiX reads only the first 20 characters of a number."""
    quadratic = case.tets.shape[1] == 10
    lines = ["*NODE, NSET=ALL"]
    lines += ["%d, %.12e, %.12e, %.12e" % (i + 1, *x) for i, x in enumerate(case.rest)]
    for k, material in enumerate(case.materials):
        lines.append(f"*ELEMENT, TYPE=C3D{10 if quadratic else 4}, ELSET=PART{k}")
        lines += [", ".join(map(str, [t + 1, *(case.tets[t] + 1)])) for t in np.flatnonzero(case.region == k)]
        lines += [f"*MATERIAL, NAME=M{k}", "*HYPERELASTIC, NEO HOOKE",
                  f"{material['mu'] / 2:.12e}, {2 / material['lambda']:.12e}", f"*SOLID SECTION, ELSET=PART{k}, MATERIAL=M{k}"]
    if len(case.moved):
        lines += ["*NSET, NSET=MOVED"] + [f"{node + 1}," for node in case.moved]
    moved = case.start - case.rest
    if moved.any():
        lines.append("*INITIAL CONDITIONS, TYPE=DISPLACEMENT")
        lines += [f"{i + 1}, {c + 1}, {moved[i, c]:.12e}" for i in range(len(moved)) for c in range(3) if moved[i, c]]
    first = FIRST if len(case.moved) else 1
    lines += ["*STEP, NLGEOM, INC=10000", "*STATIC", f"{first}, 1.", *(CONTROLS if TIGHT else []), "*BOUNDARY"]
    for node, target in zip(case.fixed, case.held_at - case.rest[case.fixed]):
        lines += [f"{node + 1}, {c + 1}, {c + 1}, {target[c]:.12e}" for c in range(3)]
    if case.loads.any():
        lines.append("*CLOAD")
        lines += [f"{i + 1}, {c + 1}, {f[c]:.12e}" for i, f in enumerate(case.loads) for c in range(3) if f[c]]
    # Results are printed only at the end of the step.
    lines += ["*NODE PRINT, NSET=ALL, FREQUENCY=100000", "U"]
    if len(case.moved):
        lines += ["*NODE PRINT, NSET=MOVED, FREQUENCY=100000, TOTALS=ONLY", "RF"]
    lines += ["*END STEP", ""]
    return "\n".join(lines)


def solve(case, seconds, folder):
    """Returns a dict: final positions x [n, 3] (m; None if it failed), Newton iterations, why it failed (else None), and
    the total force on the moved nodes (N)."""
    with open(os.path.join(folder, "case.inp"), "w", encoding="utf-8") as file:
        file.write(deck(case))
    run = subprocess.run(["ccx", "case"], cwd=folder, capture_output=True, text=True, check=False)
    log = run.stdout + run.stderr
    newton = len(re.findall(r"^ iteration ", log, re.M))
    if "Job finished" not in log or run.returncode:
        said = re.findall(r"\*ERROR[^\n]*(?:\n[^\n]+)?", log)
        return {"x": None, "newton": newton, "said": " ".join(said[-1].split()) if said else "ended without a result"}
    with open(os.path.join(folder, "case.dat"), encoding="utf-8") as file:
        lines = file.readlines()
    rows = [line.split() for line in lines if re.match(r"\s+\d+\s+[-\d.E+]+\s+\S+\s+\S+\s*$", line)]
    total = [k for k, line in enumerate(lines) if "total force" in line]
    x = case.rest.copy()
    for row in rows:
        x[int(row[0]) - 1] += [float(word) for word in row[1:]]
    return {"x": x, "newton": newton, "said": None,
            "force": [float(word) for word in lines[total[-1] + 2].split()] if total else None}


def cleanup(folder):
    for suffix in ("dat", "cvg", "sta", "frd", "12d"):
        path = os.path.join(folder, "case." + suffix)
        if os.path.exists(path):
            os.remove(path)
