#!/usr/bin/env python3
# TEST quick program needs=flesh
"""test_schema.py: the JSON Schema accepts every scene of data/scenes and refuses what the program refuses. FLESH names
the program. Speaks TAP; skipped without Debian's python3-jsonschema and python3-yaml."""
import copy
import glob
import json
import os
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "shared"))
import tap  # noqa: E402

try:
    import jsonschema
    import yaml
except ImportError as error:
    print(f"1..0 # SKIP {error}")
    sys.exit(0)

FLESH = os.environ.get("FLESH", "flesh")
TOP = os.path.realpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))
SCENES = sorted(glob.glob(os.path.join(TOP, "data", "scenes", "*.yaml")))
EDITORS_LINE = "# yaml-language-server: $schema="
RIGHT = {"body": {"mesh": "box.msh", "material": {"energy": "S", "young": 1e5, "poisson": 0.45}},
         "effects": [{"inertia": {}}, {"gravity": {}}], "time": {"step": "1/60", "end": 0.1}, "solver": {}}
WRONG = {  # changes to a valid scene
    "an unknown key": {"tme": {"step": 0.1}},
    "a key of another section": {"solver": {"step": 0.1}},
    "a choice that there is not": {"time": {"method": "euler"}},
    "a number that must be positive": {"time": {"step": -1}},
    "a list in place of a text": {"body": {"mesh": ["box.msh"]}},
    "an effect that there is not": {"effects": [{"gravitation": {}}]},
    "an effect with an unknown key": {"effects": [{"gravity": {"g": 9.81}}]},
}


def schema():
    text = subprocess.run([FLESH, "schema", "--format", "json"], capture_output=True, text=True, check=True).stdout
    return json.loads(text)


SCHEMA = schema()
VALIDATOR = jsonschema.Draft202012Validator(SCHEMA)


def scene(path):
    with open(path, encoding="utf-8") as file:
        return yaml.safe_load(file)


def the_schema_is_one():
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    version = subprocess.run([FLESH, "--version"], capture_output=True, text=True, check=True).stdout.split()[1].rstrip(",")
    assert SCHEMA["$id"] == f"urn:flesh:scene:{version}", (SCHEMA["$id"], version)


def all_scenes_are_taken():
    assert len(SCENES) > 20, SCENES
    for path in SCENES:
        errors = [error.message for error in VALIDATOR.iter_errors(scene(path))]
        assert not errors, (path, errors)


def every_scene_names_the_schema_for_editors():
    with open(os.path.join(TOP, "drivers", "manual", "meson.build"), encoding="utf-8") as file:
        assert "'scene.schema.json'" in file.read()
    for path in SCENES:
        with open(path, encoding="utf-8") as file:
            line = file.readline().rstrip("\n")
        assert line.startswith(EDITORS_LINE), (path, line)
        named = os.path.relpath(os.path.join(os.path.dirname(path), line[len(EDITORS_LINE):]), TOP)
        assert named == os.path.join("build", "drivers", "manual", "scene.schema.json"), (path, named)


def what_is_wrong_is_refused_by_both():
    with tempfile.TemporaryDirectory() as folder:
        run = {"cwd": folder, "capture_output": True, "text": True, "check": False}
        subprocess.run([FLESH, "mesh", "box", "--cells", "1,1,1", "--size", "1,1,1", "--out", "box.msh"], **run)
        for name, change in ({"nothing": {}} | WRONG).items():
            wrong = copy.deepcopy(RIGHT)
            for key, value in change.items():
                if isinstance(value, dict) and key in wrong:
                    wrong[key].update(value)
                else:
                    wrong[key] = value
            with open(os.path.join(folder, "scene.json"), "w", encoding="utf-8") as file:
                json.dump(wrong, file)
            done = subprocess.run([FLESH, "check", "scene.json"], **run)
            assert VALIDATOR.is_valid(wrong) == (name == "nothing"), name
            assert done.returncode == (0 if name == "nothing" else 2), (name, done.returncode, done.stderr)


TESTS = (the_schema_is_one, all_scenes_are_taken, every_scene_names_the_schema_for_editors,
         what_is_wrong_is_refused_by_both)
sys.exit(tap.run(TESTS))
