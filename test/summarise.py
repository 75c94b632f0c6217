"""summarise.py RESULTS: what failed in a test run, with its output, and `N passed, N failed`.

RESULTS is written by run.sh, one line each: `ok NAME`, `not-ok NAME` or `suite STATUS DIRECTORY NAME` for a run of
`meson test` in DIRECTORY, whose log is read here. TAP lines are counted one by one; a program that crashes, takes too
long or breaks its plan is at least one failure.
"""
import json
import math
import re
import sys

passed = failed = skipped = 0
reports = []


def fail(title, output=""):
    global failed
    failed += 1
    reports.append((title, output))


def last_lines(lines):
    return "\n".join(lines[-100:])


def fail_program(label, entry):
    output = (entry.get("stdout") or "") + "\n" + (entry.get("stderr") or "")
    fail(f"{label}: {entry['result']}, exit status {entry.get('returncode')}",
         last_lines(output.splitlines()))


def count_tap(label, entry):
    """Counts the TAP lines of one test program's log entry."""
    global passed, skipped
    output = entry.get("stdout") or ""
    errors = entry.get("stderr") or ""
    seen, planned, failures_before = 0, None, failed
    notes = []  # the lines since the last result
    for line in output.splitlines():
        result = re.match(r"(not )?ok\b[\s\d]*(?:- )?([^#]*)(?:#\s*(\w+))?", line)
        plan = re.match(r"1\.\.(\d+)\s*(?:#\s*(\w+))?", line)
        if result:
            seen += 1
            broken, name, directive = result.groups()
            if broken:
                fail(f"{label}: {name.strip()}", "\n".join(notes))
            elif (directive or "").upper() == "SKIP":
                skipped += 1
            else:
                passed += 1
            notes = []
        elif plan:
            planned = int(plan.group(1))
            if planned == 0 and (plan.group(2) or "").upper() == "SKIP":
                skipped += 1
                return
        elif line.startswith("Bail out!"):
            fail(f"{label}: {line}", "\n".join(notes))
        else:
            notes.append(line)
    tail = last_lines(notes + errors.splitlines())
    if planned is None:
        fail(f"{label}: no TAP plan ({entry['result']}, exit status {entry.get('returncode')})", tail)
    elif planned != seen:
        fail(f"{label}: {planned} tests planned, {seen} ran ({entry['result']})", tail)
    elif seen == 0:
        fail(f"{label}: no test in it", tail)
    elif entry["result"] not in ("OK", "SKIP") and failed == failures_before:
        fail(f"{label}: {entry['result']}, exit status {entry.get('returncode')}", tail)
    elif failed > failures_before and errors.strip():
        reports.append((f"{label}: standard error", tail))


def count_suite(status, directory, name):
    """Counts the tests of one `meson test`."""
    global passed, skipped
    failures_before, before = failed, passed + failed
    try:
        with open(f"{directory}/meson-logs/testlog.json", encoding="utf-8", errors="replace") as log:
            entries = [json.loads(line) for line in log if line.strip()]
        with open(f"{directory}/meson-info/intro-tests.json", encoding="utf-8") as intro:
            tests = {test["name"]: test for test in json.load(intro)}
    except (OSError, ValueError) as error:
        fail(f"{name}: no readable log of meson test", str(error))
        return
    if not entries:
        fail(f"{name}: no test ran")
    for entry in entries:
        test = re.split(r" / |:", entry["name"])[-1]  # meson puts `project:suite / ` or `suite - project:` before it
        label = f"{name}: {test}"
        known = tests.get(test, {"protocol": "tap", "timeout": math.inf})
        if entry.get("duration", 0) > known["timeout"] / 10:
            print(f"{label} took {entry['duration']:.0f} s, over a tenth of its limit: its line TEST needs more `seconds`")
        if known["protocol"] == "tap":
            count_tap(label, entry)
        elif entry["result"] == "OK":
            passed += 1
        elif entry["result"] == "SKIP":
            skipped += 1
        else:
            fail_program(label, entry)
    if entries and passed + failed == before:
        fail(f"{name}: every test was skipped")
    if status != "0" and failed == failures_before:
        fail(f"{name}: meson test ended with status {status}")


with open(sys.argv[1], encoding="utf-8") as results:
    for line in results:
        kind, rest = line.rstrip("\n").split(" ", 1)
        if kind == "ok":
            passed += 1
        elif kind == "not-ok":
            fail(rest, "(its output is above)")
        else:
            count_suite(*rest.split(" ", 2))

if passed + failed == 0:
    fail("no test ran")
print()
for title, output in reports:
    print(f"FAILED {title}")
    for line in output.splitlines():
        print(f"    {line}")
print(f"{passed} passed, {failed} failed" + (f", {skipped} skipped" if skipped else ""))
sys.exit(1 if failed else 0)
