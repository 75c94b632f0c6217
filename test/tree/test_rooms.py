#!/usr/bin/env python3
# TEST quick source
"""test_rooms.py: every room of the house uses only rooms below it, no files include each other in a circle (or call each
other in one, in drivers/), files and functions are short enough to be read, and functions of lib/ have few parameters.

Reads the C files of lib/, include/flesh/ and drivers/. Speaks TAP."""
import os
import re
import sys

TOP = os.path.abspath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))

# From the ground up; lib/README.md tells what each is for.
ROOMS = ["base", "math", "material", "mesh", "surface", "skin", "parallel", "linear", "element", "geometry", "effect",
         "system", "newton", "sundials", "time", "output", "sensitivity", "scene", "drivers"]

# Rooms whose interfaces the public headers are.
PUBLIC = {
    "status": "base", "version": "base", "threads": "base", "instructions": "base", "fibre": "material",
    "material": "material", "mesh": "mesh",
    "surface": "surface", "skin": "skin", "block_matrix": "linear", "linear_solver": "linear", "ranks": "parallel",
    "body": "element", "motion": "geometry", "obstacle": "geometry", "contact": "effect", "derivative_check": "effect", "effect": "effect", "effects": "effect",
    "system": "system", "state": "system", "solver": "newton", "kinsol": "sundials", "ida": "sundials",
    "ode": "sundials", "sunnonlinsol": "sundials", "integrator": "time", "observer": "time", "probe": "output", "sensitivity": "sensitivity", "scene": "scene", "flesh": "scene",
}


# Lines of a file, and of a function with its head.
LONGEST_FILE, LONGEST_FUNCTION = 450, 60

# Exceptions that may be longer: lines, and why.
LONGER = {
    "drivers/examples/bar_ida.c:main": (73, "an example is read from its beginning to its end"),
    "drivers/examples/coupled_reflex.c:main": (84, "an example is read from its beginning to its end"),
    "drivers/examples/bar_cvode_arkode.c:main": (86, "an example is read from its beginning to its end"),
}

# Largest number of parameters of a function of lib/; functions that may have more, and why.
MOST_PARAMETERS = 7
SUNDIALS, PUBLIC_API = "SUNDIALS prescribes them", "programs call it, by names that its header explains"
MORE_PARAMETERS = {
    "flesh_ida_jacobian": SUNDIALS, "flesh_ida_jacobian_times": SUNDIALS, "flesh_ida_preconditioner_solve": SUNDIALS,
    "flesh_ode_jacobian": SUNDIALS, "flesh_ode_preconditioner_solve": SUNDIALS,
    "flesh_effect_spring_within": PUBLIC_API,
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
    """Returns circles of files, as lists: one for each edge that closes a circle in a depth-first walk."""
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
    """Yields name, line of the head and number of lines of every function, whose braces are in the first column."""
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
    """Returns files and functions that are longer than they may be, and exceptions that nothing needs."""
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
    """Returns the sources of drivers/, each with the other sources whose functions it uses: name -> names."""
    texts, home = {}, {}
    for path in sorted(sources()):
        if path.startswith("drivers/") and path.endswith(".c"):
            with open(os.path.join(TOP, path), encoding="utf-8") as file:
                texts[path] = re.sub(r"/\*.*?\*/", " ", file.read(), flags=re.S)
            for name in re.findall(r"^(?!static)\w[\w \t*]*?[ *](flesh_\w+)\([^;{}]*\)\s*\{", texts[path], re.M):
                home.setdefault(name, path)  # one source is enough if two builds have each its own
    return {path: {home[name] for name in re.findall(r"\bflesh_\w+", text) if home.get(name, path) != path}
            for path, text in texts.items()}


def count_parameters(head):
    """Returns the number of parameters in the head of a function, whose list begins at the first bracket."""
    depth, count = 0, 1
    for letter in re.sub(r"/\*.*?\*/", "", head[head.index("("):], flags=re.S):
        depth += {"(": 1, "[": 1, ")": -1, "]": -1}.get(letter, 0)
        if depth == 0:
            break
        count += letter == "," and depth == 1
    return count


def too_many_parameters():
    """Returns functions of lib/ with more parameters than they may have, and exceptions that nothing needs."""
    findings, used = [], set()
    for path in sorted(path for path in sources() if path.startswith("lib/")):
        with open(os.path.join(TOP, path), encoding="utf-8") as file:
            lines = file.read().split("\n")[:-1]
        for name, at, count in functions(lines):
            head = "\n".join(lines[at - 1:at - 1 + count]).split("\n{")[0]
            parameters = count_parameters(head) if "(" in head else 0
            if parameters <= MOST_PARAMETERS:
                continue
            used.add(name)
            if name not in MORE_PARAMETERS:
                findings.append(f"{path}:{at}: {name} has {parameters} parameters, of at most {MOST_PARAMETERS}")
    return findings + [f"{name} has few parameters: no exception is needed" for name in MORE_PARAMETERS if name not in used]


# Limits of the contract of effects, include/flesh/effect.h, which everyone who adds an effect has to fulfil.
MOST_OPERATIONS, MOST_TABLES, MOST_MEMBERS, MOST_LINES, MOST_MAKERS = 26, 6, 12, 260, 1


def members(body):
    """Returns the number of members of a struct: "const double *x, *v;" are two."""
    return sum(declaration.count(",") + 1 for declaration in body.split(";") if declaration.strip())


def too_wide():
    """Returns figures of the contract of effects that have grown beyond their limits."""
    with open(os.path.join(TOP, "include", "flesh", "effect.h"), encoding="utf-8") as file:
        whole = file.read()
    text = re.sub(r"/\*.*?\*/", " ", whole, flags=re.S)
    point = re.search(r"typedef struct flesh_point \{(.*?)\} flesh_point;", text, re.S).group(1)
    makers = 0
    for path in sources():
        if path.startswith("lib/"):
            with open(os.path.join(TOP, path), encoding="utf-8") as file:
                makers += len(re.findall(r"\(flesh_point\)\{|\bflesh_point \w+ = \{", file.read()))
    found = [("operations", len(re.findall(r"\(\*\w+\)\(", text)), MOST_OPERATIONS),
             ("tables", len(re.findall(r"typedef struct flesh_effect_\w+ \{", text)), MOST_TABLES),
             ("members of flesh_point", members(point), MOST_MEMBERS), ("lines of effect.h", whole.count("\n"), MOST_LINES),
             ("places in lib/ that fill in a point by hand", makers, MOST_MAKERS)]
    return [f"{count} {name}, of at most {limit}" for name, count, limit in found if count > limit]


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
    print("1..7")
    failed = verdict(1, "every file is in a room", unknown)
    failed |= verdict(2, "rooms use only rooms below them", upward)
    failed |= verdict(3, "no files include each other in a circle",
                      [" -> ".join(circle) for circle in find_circles(arrows)])
    failed |= verdict(4, "files of at most 450 lines, functions of at most 60", too_long())
    failed |= verdict(5, "no files of drivers/ call each other in a circle",
                      [" -> ".join(circle) for circle in find_circles(calls())])
    failed |= verdict(6, "functions of lib/ have at most seven parameters", too_many_parameters())
    failed |= verdict(7, "the contract of effects is narrow", too_wide())
    return failed


if __name__ == "__main__":
    sys.setrecursionlimit(10000)
    sys.exit(main())
