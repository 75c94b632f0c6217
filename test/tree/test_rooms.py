#!/usr/bin/env python3
"""test_rooms.py: every room of the house uses only rooms below it, no files include each other in a circle (or call each
other in one, in drivers/), and files and functions are short enough to be read.

Reads the C files of lib/, include/flesh/ and drivers/. Speaks TAP."""
import os
import re
import sys

TOP = os.path.abspath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))

# From the ground up; lib/README.md tells what each is for.
ROOMS = ["base", "math", "material", "mesh", "surface", "skin", "parallel", "linear", "element", "geometry", "effect",
         "system", "newton", "sundials", "time", "output", "scene", "drivers"]

# Whose interface a public header is.
PUBLIC = {
    "status": "base", "version": "base", "threads": "base", "instructions": "base", "fibre": "material",
    "material": "material", "mesh": "mesh",
    "surface": "surface", "skin": "skin", "block_matrix": "linear", "linear_solver": "linear", "ranks": "parallel",
    "body": "element", "motion": "geometry", "obstacle": "geometry", "contact": "effect", "effect": "effect", "effects": "effect",
    "proximity": "effect",
    "system": "system", "state": "system", "solver": "newton", "kinsol": "sundials", "ida": "sundials",
    "ode": "sundials", "integrator": "time", "observer": "time", "probe": "output", "scene": "scene", "flesh": "scene",
}


# Lines of a file, and of a function with its head.
LONGEST_FILE, LONGEST_FUNCTION = 450, 60

# What may be longer: lines, and why.
LONGER = {
    "drivers/examples/bar_ida.c:main": (73, "an example is read from its beginning to its end"),
    "drivers/examples/coupled_reflex.c:main": (84, "an example is read from its beginning to its end"),
    "drivers/examples/bar_cvode_arkode.c:main": (86, "an example is read from its beginning to its end"),
}


def sources(examples=False):
    for top in ("lib", "include", "drivers"):
        for folder, names, files in os.walk(os.path.join(TOP, top)):
            names[:] = [name for name in names if examples or name != "examples"]
            for name in sorted(files):
                if name.endswith((".c", ".h")):
                    yield os.path.relpath(os.path.join(folder, name), TOP)


def room_of(path):
    parts = path.split("/")
    if parts[0] == "drivers":
        return "drivers"
    if parts[0] == "include":
        return PUBLIC.get(parts[-1][:-2])
    return parts[1]


def resolve(target, exist):
    for folder in ("include", "lib", "drivers"):
        if os.path.join(folder, target) in exist:
            return os.path.join(folder, target)
    return None


def verdict(number, name, findings):
    for finding in findings:
        print("#", finding)
    print(f"{'not ok' if findings else 'ok'} {number} - {name}")
    return bool(findings)


def find_circles(arrows):
    """Circles of files, as lists; one for each edge that closes one in a depth-first walk."""
    state, path, circles = {}, [], []

    def visit(node):
        state[node] = 1
        path.append(node)
        for other in sorted(arrows.get(node, ())):
            if state.get(other) == 1:
                circles.append(path[path.index(other):] + [other])
            elif other not in state:
                visit(other)
        path.pop()
        state[node] = 2

    for node in sorted(arrows):
        if node not in state:
            visit(node)
    return circles


def functions(lines):
    """Name, line of the head and number of lines of every function: what lies between braces in the first column."""
    begin = None
    for k, line in enumerate(lines):
        if line == "{":
            begin = k
            while begin > 0 and lines[begin - 1] and not re.match(r"[ ]\*|/\*|#|\}", lines[begin - 1]) \
                    and not lines[begin - 1].endswith((";", "*/")):
                begin -= 1
        elif line.startswith("}") and begin is not None:
            found = re.search(r"(\w+)\(", lines[begin])
            yield found.group(1) if found else "?", begin + 1, k - begin + 1
            begin = None


def too_long():
    """Files and functions that are longer than they may be, and exceptions that nothing needs."""
    findings, used = [], set()
    for path in sorted(sources(examples=True)):
        with open(os.path.join(TOP, path), encoding="utf-8") as file:
            lines = file.read().split("\n")[:-1]
        long = [(path, 1, len(lines), LONGEST_FILE)]
        long += [(f"{path}:{name}", at, count, LONGEST_FUNCTION) for name, at, count in functions(lines)]
        for name, at, count, limit in long:
            if count <= limit:
                continue
            used.add(name)
            allowed = LONGER.get(name, (limit, ""))[0]
            if count > allowed:
                findings.append(f"{name} (line {at}) has {count} lines, of at most {allowed}")
    return findings + [f"{name} is short enough: no exception is needed" for name in LONGER if name not in used]


def calls():
    """Which sources of drivers/ use functions of which others: name -> names."""
    texts, home = {}, {}
    for path in sorted(sources()):
        if path.startswith("drivers/") and path.endswith(".c"):
            with open(os.path.join(TOP, path), encoding="utf-8") as file:
                texts[path] = re.sub(r"/\*.*?\*/", " ", file.read(), flags=re.S)
            for name in re.findall(r"^(?!static)\w[\w \t*]*?[ *](flesh_\w+)\([^;{}]*\)\s*\{", texts[path], re.M):
                home.setdefault(name, path)  # of two builds of a function, one is enough
    return {path: {home[name] for name in re.findall(r"\bflesh_\w+", text) if home.get(name, path) != path}
            for path, text in texts.items()}


def main():
    exist = set(sources())
    unknown, upward, arrows = [], [], {}
    for path in sorted(exist):
        if room_of(path) not in ROOMS:
            unknown.append(f"{path} is in no room that test_rooms.py knows")
            continue
        with open(os.path.join(TOP, path), encoding="utf-8") as file:
            text = file.read()
        for target in re.findall(r'^#include ["<]([^">]+)[">]', text, re.M):
            other = resolve(target, exist)
            if not other or room_of(other) not in ROOMS:
                continue
            if ROOMS.index(room_of(other)) > ROOMS.index(room_of(path)):
                upward.append(f"{path} includes {target}: {room_of(path)} is below {room_of(other)}")
            # A source and the header of its name are one thing.
            one, two = (re.sub(r"\.[ch]$", "", name) for name in (path, other))
            if one != two:
                arrows.setdefault(one, set()).add(two)
    print("1..5")
    failed = verdict(1, "every file is in a room", unknown)
    failed |= verdict(2, "rooms use only rooms below them", upward)
    failed |= verdict(3, "no files include each other in a circle",
                      [" -> ".join(circle) for circle in find_circles(arrows)])
    failed |= verdict(4, "files of at most 450 lines, functions of at most 60", too_long())
    failed |= verdict(5, "no files of drivers/ call each other in a circle",
                      [" -> ".join(circle) for circle in find_circles(calls())])
    return failed


if __name__ == "__main__":
    sys.setrecursionlimit(10000)
    sys.exit(main())
