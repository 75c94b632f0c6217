#!/usr/bin/env python3
"""mutations.py: breaks one rule after the other (mutations.txt) in a copy of the tree, and says which no test sees.

  python3 test/campaign/mutations.py                 every fifth rule, by the tests that the list names
  python3 test/campaign/mutations.py --full          every rule
  ... --suite            those that survive, by the whole quick suite as well
  ... --only TEXT        the rules whose line holds TEXT; may be given again for others
  ... --check            only that every text stands where the list says, once
  ... --tree DIR --work DIR    another tree; where the copy and its build are kept (~/.cache/flesh-campaign/mutations)

The copy is of what git tracks and what is changed in the tree. A rule's tests are to pass before it is broken. Exit
status 1 when a rule's mutation survives, 2 when a text of the list is not found.
"""
import argparse
import json
import os
import re
import shutil
import subprocess
import sys

SUITE = ["--suite", "quick", "--no-suite", "source"]
HERE = os.path.dirname(os.path.abspath(__file__))


def rules(path):
    lines = [line.rstrip("\n") for line in open(path, encoding="utf-8")]
    lines = [line for line in lines if line and not line.startswith("#")]
    if len(lines) % 3:
        sys.exit(f"{path}: an entry is three lines: =, - and +")
    for k in range(0, len(lines), 3):
        head, old, new = lines[k:k + 3]
        if not (head.startswith("= ") and old.startswith("- ") and new.startswith("+ ")):
            sys.exit(f"{path}: an entry begins with =, - and +, not: {head} / {old} / {new}")
        name, file, tests = [part.strip() for part in head[2:].split("|")]
        yield name, file, tests.split(), *(re.sub(r"\\n", "\n", text[2:]) for text in (old, new))


def find(tree, name, text):
    """Returns the file of that name under lib/, drivers/ or data/studies/ that contains the text once; a word if there
    is none."""
    found = []
    for folder in "lib", "drivers", "data/studies":
        for top, _, files in os.walk(os.path.join(tree, folder)):
            if name in files:
                path = os.path.join(top, name)
                found += [path] * open(path, encoding="utf-8").read().count(text)
    return found[0] if len(found) == 1 else f"stands {len(found)} times"


def copy_tree(tree, copy):
    names = subprocess.run(["git", "-C", tree, "ls-files", "-z", "--cached", "--others", "--exclude-standard"], check=True,
                           capture_output=True).stdout.decode().split("\0")
    os.makedirs(copy, exist_ok=True)
    subprocess.run(["git", "init", "-q", copy], check=True)  # so that no repository around it is taken for its own
    for name in filter(None, names):
        source, target = os.path.join(tree, name), os.path.join(copy, name)
        if not os.path.isfile(source):
            continue
        data = open(source, "rb").read()
        if os.path.isfile(target) and open(target, "rb").read() == data:
            continue  # keeps its time, so that what was built of it stays valid
        os.makedirs(os.path.dirname(target), exist_ok=True)
        shutil.copy(source, target)


def run(command, folder, seconds):
    try:
        done = subprocess.run(["nice", *command], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False,
                              timeout=seconds)
        return done.returncode, done.stdout.decode(errors="replace")
    except subprocess.TimeoutExpired:
        return 124, "it does not end in time"


def known_tests(build):
    text = subprocess.run(["meson", "test", "-C", build, "--list", "--no-rebuild"], capture_output=True, check=True).stdout
    return {line.split(" / ")[-1].split(":")[-1].strip() for line in text.decode().splitlines()}


def needed(build, tests):
    """Lists the files of the build that these tests run."""
    known, targets = (json.load(open(os.path.join(build, "meson-info", f"intro-{what}.json"), encoding="utf-8"))
                      for what in ("tests", "targets"))
    ids = {depends for test in known if test["name"] in tests for depends in test["depends"]}
    return [os.path.relpath(file, build) for target in targets if target["id"] in ids for file in target["filename"]]


def test(build, words):
    code, text = run(["meson", "test", "-C", build, "--no-rebuild", "--timeout-multiplier", "4", *words], build, 3600)
    failed = re.findall(r"^\s*\d+/\d+\s+(?:\S+ / )?(\S+)\s+(?:FAIL|ERROR|TIMEOUT)", text, re.M)
    return code == 0, failed


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--full", action="store_true")
    parser.add_argument("--suite", action="store_true")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--only", action="append", default=[])
    parser.add_argument("--tree", default=os.path.dirname(os.path.dirname(HERE)))
    parser.add_argument("--work", default=os.path.expanduser("~/.cache/flesh-campaign/mutations"))
    parser.add_argument("--list", default=os.path.join(HERE, "mutations.txt"))
    options = parser.parse_args()
    entries = list(rules(options.list))
    missing = [f"{name}: its text {where} in {file}" for name, file, _, old, _ in entries
               for where in [find(options.tree, file, old)] if not os.path.isabs(where)]
    print("\n".join(missing) if missing else f"{len(entries)} rules, every text found")
    if missing or options.check:
        return 2 if missing else 0
    tree = os.path.join(options.work, "tree")
    build = os.path.join(tree, "build")  # so that a compiler cache finds objects compiled in the other tree
    copy_tree(options.tree, tree)
    if not os.path.exists(os.path.join(build, "build.ninja")):
        subprocess.run(["meson", "setup", build, tree], check=True, stdout=subprocess.DEVNULL)
    chosen = [e for k, e in enumerate(entries)
              if (any(text in e[0] + e[1] for text in options.only) if options.only else options.full or k % 5 == 0)]
    known = known_tests(build)

    def ninja(tests):
        """Builds the files that these tests run, or all that --suite runs."""
        return run(["ninja", *([] if options.suite else needed(build, tests))], build, 7200)

    code, text = ninja({t for e in chosen for t in e[2]})
    if code:
        sys.exit(text[-2000:])
    good = {t: test(build, [t])[0] for t in sorted({t for e in chosen for t in e[2]} & known)}
    for t in good:
        if not good[t]:
            print(f"{t} fails without a mutation", flush=True)
    survivors, seen, bad = [], 0, set()
    if options.suite:
        bad = set(test(build, SUITE)[1])
        print(f"without a mutation {', '.join(sorted(bad)) if bad else 'no test'} of the quick suite fails", flush=True)
    for name, file, tests, old, new in chosen:
        tests = [t for t in tests if good.get(t)]
        path = find(tree, file, old)
        whole = open(path, encoding="utf-8").read()
        try:
            with open(path, "w", encoding="utf-8") as out:
                out.write(whole.replace(old, new))
            code, text = ninja(tests)
            if code:
                print(f"does not build: {name} ({file})\n{text[-600:]}", flush=True)
                survivors.append(name)
                continue
            passed, failed = test(build, tests) if tests else (True, [])
            if not tests:
                print(f"no test of {name} is in this build, or passes", flush=True)
            if passed and options.suite:
                failed = sorted(set(test(build, SUITE)[1]) - bad)
                passed = not failed
            print(f"{'SURVIVES' if passed else 'seen'}: {name} ({file}){': ' + ', '.join(failed) if failed else ''}", flush=True)
            seen += not passed
            if passed:
                survivors.append(name)
        finally:
            with open(path, "w", encoding="utf-8") as out:
                out.write(whole)
    ninja({t for e in chosen for t in e[2]})
    print(f"{seen} of {len(chosen)} mutations seen, {len(survivors)} survive")
    return 1 if survivors else 0


if __name__ == "__main__":
    sys.exit(main())
