#!/usr/bin/env python3
# TEST quick needs=build builds=plain
"""test_lines.py: of the lines TEST, from which tests are made, wrong ones are refused; this build has their tests; and no
time limit is short. BUILD names the build. Speaks TAP."""
import contextlib
import glob
import io
import json
import os
import re
import sys
import tempfile

TEST = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, TEST)
import tests  # noqa: E402, beside its folder


def refusal(files):
    """Returns the sentence that refuses a folder with these files, {name: text}; empty if it is accepted."""
    here = tests.HERE
    with tempfile.TemporaryDirectory() as folder:
        for name, text in files.items():
            os.makedirs(os.path.join(folder, "mesh"), exist_ok=True)
            with open(os.path.join(folder, "mesh", name), "w", encoding="utf-8") as stream:
                stream.write(text)
        tests.HERE = folder
        try:
            with contextlib.redirect_stdout(io.StringIO()):
                tests.main("plain", ["portable"])
        except tests.Refused as refused:
            return str(refused)
        finally:
            tests.HERE = here
    return ""


def wrong_lines_are_refused():
    good = {"test_a.c": "// TEST quick\n"}
    cases = [(good, ""),
             (good | {"test_b.c": "int main(void) { return 0; }\n"}, "test/mesh/test_b.c: no line TEST"),
             (good | {"test_b.c": "\n// TEST qick\n"}, "test/mesh/test_b.c:2: TEST has 'qick'; valid are quick, full,"),
             (good | {"test_b.c": "// TEST seconds=2\n"}, "names no suite; valid are quick, full, memory"),
             (good | {"test_b.c": "// TEST quick limit=60\n"}, "TEST has 'limit'; valid are name, seconds,"),
             (good | {"test_b.c": "// TEST quick seconds=2.5\n"}, "seconds is '2.5'; valid are whole numbers from 1 on"),
             (good | {"test_b.sh": "# TEST quick needs=flash\n"}, "needs has 'flash'; valid are "),
             (good | {"test_b.sh": "# TEST quick uses=flash\n"}, "uses has 'flash'; valid are "),
             (good | {"test_b.sh": "# TEST quick each_set\n"}, "each_set is for tests in C"),
             (good | {"test_b.c": "// TEST quick builds=fast\n"}, "builds has 'fast'; valid are plain, memory, threads"),
             (good | {"test_b.c": "// TEST quick\n// TEST+ name=test_a\n"}, "mesh/test_a.c:1 has a test test_a already"),
             (good | {"test_b.py": "# TEST part_of=test_c\n"}, "part_of is 'test_c'; there is no such test")]
    for files, sentence in cases:
        said = refusal(files)
        if (sentence not in said) if sentence else said:
            yield f"{files} gives '{said}' and not '{sentence}'"


def known():
    """Returns the tests of this build by their names."""
    with open(os.path.join(os.environ["BUILD"], "meson-info", "intro-tests.json"), encoding="utf-8") as stream:
        return {test["name"]: test for test in json.load(stream)}


def this_build_has_the_tests_of_the_lines():
    build = {name: test for name, test in known().items() if not name.startswith("example_")}
    sets = [name[len("test_sparse_"):] for name in build if name.startswith("test_sparse_")]
    output = io.StringIO()
    with contextlib.redirect_stdout(output):
        tests.main("plain", sets)
    rows = [dict(zip(tests.FIELDS, row.split("\t"))) for row in output.getvalue().splitlines()[1:]]
    # A build may lack things that tests need, but not those that one of its tests needs.
    needs = {row["name"]: set(row["needs"].split()) for row in rows}
    there = set().union(*(needs[name] for name in build if name in needs))
    for row in rows:
        if row["name"] not in build and there >= needs[row["name"]]:
            yield f"{row['name']} (test/{row['source']}) is not in this build: meson setup --reconfigure"
        elif row["name"] in build and {s.split(":")[-1] for s in build[row["name"]]["suite"]} != set(row["suites"].split()):
            yield f"{row['name']} has other suites in this build: meson setup --reconfigure"
    for name in build.keys() - {row["name"] for row in rows}:
        yield f"{name} is in this build, and no line TEST makes it: meson setup --reconfigure"


def limits_are_for_hangs():
    for name, test in known().items():
        if test["timeout"] < max(tests.LIMIT, 10 * test["priority"]):
            yield f"{name} has a limit of {test['timeout']} s and takes up to {test['priority']} s; an hour is the least"
    # `timeout -s`, which sends a signal after a time, is no limit for hangs.
    wait = re.compile(r"\btimeout (?:-k \d+ )?(\d[\d.]*)\b|\btimeout=(\d+)")
    for path in glob.glob(os.path.join(TEST, "**", "*.sh"), recursive=True) + glob.glob(os.path.join(TEST, "**", "*.py"),
                                                                                         recursive=True):
        if "campaign" in path:
            continue
        with open(path, encoding="utf-8") as stream:
            for k, row in enumerate(stream, 1):
                for found in wait.finditer(row):
                    if float(found.group(1) or found.group(2)) < tests.LIMIT / 2:
                        yield f"{os.path.relpath(path, TEST)}:{k} waits for less than {tests.LIMIT // 2} s"


CHECKS = [wrong_lines_are_refused, this_build_has_the_tests_of_the_lines, limits_are_for_hangs]
print(f"1..{len(CHECKS)}")
for k, check in enumerate(CHECKS, 1):
    found = list(check())
    for fault in found:
        print("#", fault)
    print("not ok" if found else "ok", k, "-", check.__name__)
