#!/usr/bin/env python3
"""tests.py BUILD SETS: the tests of a build, as meson.build reads them, from the lines `TEST` in the tests themselves.

BUILD is plain, memory (any sanitizer but the thread sanitizer) or threads; SETS are the kernels' instruction sets, with
commas. The first line of the output has all files with such lines, every other line one test: the fields of FIELDS,
with tabs, and lists within a field with spaces. A wrong line is refused with its file, number and what would be valid; the
exit status is then 1. The words of a line:

    quick, full         the suite: a second or two, run at every edit; the rest, not for the address sanitizer
    memory              with full: the address sanitizer is to see it nevertheless
    program, source     tests the program; tests the tree and not a build: the plain one has it
    excerpt             is a part of a full test
    alone               runs after the others, one by one: ranks that wait take their turn of a processor that others need
    each_set            once for each instruction set of the kernels, in the quick suite for the first
    seconds=N           on an idle machine: the longest begin first
    ranks=2,3           on so many ranks, each a test
    args: WORD...       with these arguments; @flesh@ and @mpirun@ are programs, @folder@ is a folder for results
    needs=flesh,cc      left out of builds that lack one; their paths are in its environment
    needs=drivers       linked with what the program is made of
    uses=stop_at        as needs, but not left out
    builds=plain,memory,threads   for builds without sanitizer, with one, with the thread sanitizer (default: the first two,
                        and the third with TEST_OF_THREADS); slow quick ones are plain where others run the same lines
    name=NAME           not called as its file
    by=shared/check_vtu.py    run by this script
    protocol=exitcode   does not speak TAP
    part_of=NAME        a file of the test NAME
"""
import glob
import os
import re
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
# Limits on time are for hangs, not for busy machines or sanitizers: an hour, or ten times `seconds` where that is longer.
LIMIT = 3600
BUILDS = ("plain", "memory", "threads")
SUITES = ("quick", "full", "memory", "program", "source", "excerpt")
FLAGS = ("alone", "each_set")
KEYS = ("name", "seconds", "needs", "uses", "ranks", "builds", "by", "protocol", "part_of")
# Names known to meson.build, each with environment and targets; a build may lack some.
NEEDS = ("arkode", "build", "cc", "cvode", "drivers", "fail_allocation", "far_bodies_cost", "flesh", "includes",
         "libraries", "library", "mpirun", "nvecparallel", "plain", "python", "ranks", "scaling", "slow_clock", "stop_at",
         "sundials", "sunlinsolspgmr")
FIELDS = ("name", "suites", "seconds", "limit", "alone", "set", "ranks", "args", "needs", "uses", "by", "protocol",
          "source")
LINE = re.compile(r"^(?://|#) TEST(\+?)(?: (.*))?$")
OF_THREADS = "TEST_OF_THREADS("


class Refused(Exception):
    """A message on what is wrong with a line."""


def one_of(key, words, valid):
    for word in words:
        if word not in valid:
            raise Refused(f"{key} has '{word}'; valid are {', '.join(valid)}")
    return words


def number(key, text, least):
    if not text.isdigit() or int(text) < least:
        raise Refused(f"{key} is '{text}'; valid are whole numbers from {least} on")
    return text


def parse(words, source):
    """Returns the line's words as a dictionary of lists; missing ones have their defaults."""
    line = {key: [] for key in KEYS} | {"suites": [], "flags": [], "args": []}
    if "args:" in words:
        k = words.index("args:")
        words, line["args"] = words[:k], words[k + 1:]
    for word in words:
        key, equals, value = word.partition("=")
        if equals:
            one_of("TEST", [key], KEYS)
            line[key] += value.split(",")
        elif word in FLAGS:
            line["flags"].append(word)
        else:
            line["suites"] += one_of("TEST", [word], SUITES + FLAGS)
    if not line["part_of"] and not {"quick", "full", "memory"} & set(line["suites"]):
        raise Refused("TEST names no suite; valid are quick, full, memory")
    one_of("builds", line["builds"], BUILDS)
    one_of("needs", line["needs"], NEEDS)
    one_of("uses", line["uses"], NEEDS)
    for text in line["seconds"]:
        number("seconds", text, 1)
    for text in line["ranks"]:
        number("ranks", text, 1)
    if line["flags"].count("each_set") and not source.endswith(".c"):
        raise Refused("each_set is for tests in C")
    return line


def files():
    """Returns every file of the tests' rooms that has lines or should have some, by its name."""
    found = []
    for ending in ("c", "sh", "py"):
        found += glob.glob(os.path.join(HERE, "*", "*." + ending))
        found += glob.glob(os.path.join(HERE, "drivers", "python", "*." + ending))
    return sorted(os.path.relpath(path, HERE) for path in found)


def lines_of(source):
    """Returns the lines of a file, parsed, and whether it tests threads."""
    with open(os.path.join(HERE, source), encoding="utf-8") as stream:
        text = stream.read()
    found = []
    for k, row in enumerate(text.splitlines(), 1):
        match = LINE.match(row)
        if match and match.group(1) and found:
            found[-1][1].extend((match.group(2) or "").split())
        elif match:
            found.append((k, (match.group(2) or "").split()))
    parsed = []
    for k, words in found:
        try:
            parsed.append((f"test/{source}:{k}", parse(words, source)))
        except Refused as refusal:
            raise Refused(f"test/{source}:{k}: {refusal}") from None
    if not parsed and os.path.basename(source).startswith("test_") and source != "tree/test_examples.sh":
        raise Refused(f"test/{source}: no line TEST; test/README.md tells what it says")
    return parsed, OF_THREADS in text


def variants(line, build, sets):
    """Yields a test for every count of ranks and every instruction set: (suffix of its name, suites, set, ranks)."""
    for name in sets if "each_set" in line["flags"] else [""]:
        # Three ranks are for every edit and for sanitizers, which other counts show nothing new; the first
        # instruction set is for every edit, the others for sanitizers.
        for ranks in line["ranks"] or [""]:
            if build == "plain" or ranks in ("", "3"):
                suites = line["suites"] if ranks in ("", "3") else ["full"]
                suites = suites if name in ("", sets[0]) else ["full", "memory"]
                yield "".join("_" + part for part in (name, ranks) if part), suites, name, ranks


def tests_of(source, line, of_threads, build, sets):
    """Yields the tests that a line makes in a build, as dictionaries of FIELDS."""
    in_c = source.endswith(".c")
    if build not in (line["builds"] or ("plain", "memory") + (("threads",) if in_c and of_threads else ())):
        return
    stem = os.path.splitext(os.path.basename(source))[0]
    for ending, suites, name, ranks in variants(line, build, sets):
        if build == "memory" and ("source" in suites or not {"quick", "memory"} & set(suites)):
            continue
        alone = "alone" in line["flags"] or ranks not in ("", "1")
        seconds = max(map(int, line["seconds"]), default=0)
        yield {"name": [(line["name"] or [stem])[0] + ending], "suites": suites,
               # Tests that are themselves on several ranks have the machine for themselves and come last.
               "seconds": ["-1" if alone else str(seconds)], "limit": [str(max(LIMIT, 10 * seconds))],
               "alone": ["alone"] if alone else [], "set": [name] if name else [], "ranks": [ranks] if ranks else [],
               "args": line["args"], "needs": line["needs"], "uses": line["uses"],
               "by": line["by"], "protocol": line["protocol"] or ["tap"], "source": [source]}


def main(build, sets):
    one_of("BUILD", [build], BUILDS)
    with_lines, tests, parts = [], [], {}
    for source in files():
        lines, of_threads = lines_of(source)
        if lines:
            with_lines.append(source)
        for place, line in lines:
            for whole in line["part_of"]:
                parts.setdefault(whole, []).append((place, os.path.basename(source)))
            if not line["part_of"]:
                tests += [(place, test) for test in tests_of(source, line, of_threads, build, sets)]
    names = {}
    for place, test in tests:
        if names.setdefault(test["name"][0], place) != place:
            raise Refused(f"{place}: {names[test['name'][0]]} has a test {test['name'][0]} already; name= gives another name")
        test["args"] = test["args"] + [part for _, part in parts.pop(test["name"][0], [])]
    for whole, members in parts.items():
        if build == "plain":
            raise Refused(f"{members[0][0]}: part_of is '{whole}'; there is no such test")
    print(" ".join(with_lines))
    for _, test in tests:
        print("\t".join(" ".join(test[field]) for field in FIELDS))


if __name__ == "__main__":
    try:
        main(sys.argv[1], sys.argv[2].split(","))
    except Refused as refusal:
        sys.exit(str(refusal))
