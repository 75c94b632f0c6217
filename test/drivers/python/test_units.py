# TEST part_of=test_python_runs
"""test_units.py: a scene in other units of length, time and mass is the same scene: no constant has a hidden unit."""
import json
import os
import pathlib
import re
from fractions import Fraction

import numpy as np
import pytest

import flesh
from conftest import DATA

yaml = pytest.importorskip("yaml")
SCENES = pathlib.Path(DATA, "scenes")

# kg, m, s of each unit that the schema names
UNITS = {"m": (0, 1, 0), "s": (0, 0, 1), "kg/m^3": (1, -3, 0), "Pa": (1, -1, -2), "m/s": (0, 1, -1),
         "m/s^2": (0, 1, -2), "N": (1, 1, -2), "N/m": (1, 0, -2), "Pa s": (1, -1, -1), "Pa/m": (1, -2, -2),
         "1/s": (0, 0, -1), "rad": (0, 0, 0)}
# kg, m and s in other units: powers of two, so that no number is rounded.
SYSTEMS = (2.**9, 2.**10, 2.**-7), (2.**-20, 2.**-10, 2.**13)


def unit_of(schema):
    found = re.search(r"\[([^\]]+)\]$", schema.get("description", ""))
    return UNITS[found[1]] if found and found[1] in UNITS else None


def multiplied(value, factor):
    if isinstance(value, list):
        return [multiplied(item, factor) for item in value]
    try:
        return float(Fraction(value) if isinstance(value, str) else value) * factor
    except ValueError:  # .inf
        return value


def factor_of(unit, system):
    return np.prod([scale**power for scale, power in zip(system, unit)])


def in_units(node, schema, system):
    """Returns the part `node` of a scene, and its omitted defaults, in other units."""
    choices = [choice for choice in schema.get("anyOf", []) if "properties" in choice]
    if choices and isinstance(node, (dict, str)):
        return in_units({node: {}} if isinstance(node, str) else node, choices[0], system)
    if isinstance(node, list) and "items" in schema:
        return [in_units(item, schema["items"], system) for item in node]
    if not isinstance(node, dict):
        return node
    result = dict(node)
    for key, entry in schema["properties"].items():
        unit = unit_of(entry)
        value = node.get(key, entry.get("default") if unit else None)
        if value is not None:
            result[key] = multiplied(value, factor_of(unit, system)) if unit else in_units(value, entry, system)
    return result


@pytest.mark.parametrize("name, time", [
    ("balls", {"method": "newmark", "end": 0.03}),
    ("stack", {"method": "bdf2", "end": 0.04}),
    ("damped_bar", {"method": "hht", "end": 0.1}),
    ("hinged", {"method": "adaptive", "tolerance": 0.1, "end": 0.2}),
    ("swing_coarse", {"method": "ida", "tolerance": 0.01, "end": 0.1}),
    ("bar_gravity", {"method": "static"}),
])
def test_other_units_give_the_same_bits(name, time, tmp_path):
    schema = json.loads(flesh.schema("json"))
    scene = yaml.safe_load((SCENES / f"{name}.yaml").read_text())
    scene["time"] = {**scene["time"], **time}
    ends = []
    for number, system in enumerate(((1, 1, 1), *SYSTEMS)):
        folder = tmp_path / str(number)
        folder.mkdir()
        changed = in_units(scene, schema, system)
        for body in (changed["body"], *changed.get("bodies", [])):
            mesh = flesh.Mesh.read(SCENES / body["mesh"])
            body["mesh"] = os.path.basename(body["mesh"]).rsplit(".", 1)[0] + ".msh"
            flesh.Mesh(mesh.positions * system[1], mesh.tets, mesh.regions).write(folder / body["mesh"])
        if "state" in scene.get("start", {}):
            rows = np.loadtxt(SCENES / scene["start"]["state"]) * system[1]
            rows[:, 3:] /= system[2]
            np.savetxt(folder / "state.txt", rows, "%.17g")
            changed["start"]["state"] = "state.txt"
        ends.append(flesh.Scene(changed, folder=folder).run().x / system[1])
    assert np.array_equal(ends[0], ends[1]) and np.array_equal(ends[0], ends[2])
