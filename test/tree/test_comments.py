#!/usr/bin/env python3
# TEST quick source
"""test_comments.py: every public function has a comment that names its errors or says that it cannot fail, and every
comment in C names its subject.

A comment belongs to the declarations right below it, up to a blank line. A function that returns no status may leave it
to the sentence at the top of its header. The codes that a function's own body fails with must be among those named, and
a function that "cannot fail" must have none. A comment that opens with a pronoun or a preposition cannot be read alone.
Speaks TAP."""
import glob
import os
import re

TOP = os.path.abspath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))
DECLARATION = re.compile(r"FLESH_API\s+([^;{(]*?)\b(flesh_\w+)\s*\(([^;]*?)\);")
CODE = re.compile(r"FLESH_(?:ERR_\w+|UNDEFINED|NONFINITE|NOT_CONVERGED|NOT_POSITIVE)\b")
ALL = "Functions that return no status cannot fail."
TOKEN = re.compile(r'"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\'|//[^\n]*|/\*.*?\*/', re.S)
HEADLESS = re.compile(r"/[/*]+<?[\s*]*(Of|What|Where|Those|That|The same|Whose|As|By)\b")


def read(path):
    with open(path, encoding="utf-8") as stream:
        return stream.read()


def bodies():
    """Returns the body of every function of the library, without comments, by its name."""
    found = {}
    for path in glob.glob(os.path.join(TOP, "lib", "**", "*.c"), recursive=True):
        text = re.sub(r"/\*.*?\*/", " ", read(path), flags=re.S)
        for match in re.finditer(r"^\w[\w \t*]*?[ *](flesh_\w+)\([^;{}]*\)\s*\{(.*?)^\}", text, re.S | re.M):
            found.setdefault(match.group(1), match.group(2))
    return found


def own_codes(body):
    """Returns the codes with which the body itself fails."""
    codes = set(re.findall(r"flesh_fail\(\s*(FLESH_\w+)", body))
    return codes | ({"FLESH_ERR_ARGUMENT"} if "FLESH_NEED(" in body else set())


def comment_of(text, start):
    """Returns the comment right above the declaration at `start` or above declarations right before it; None without one."""
    end = text.rfind("*/", 0, start)
    between = text[end + 2:start]
    if end < 0 or "\n\n" in between or re.sub(r"FLESH_API[^;]*;", "", between).strip():
        return None
    return text[text.rfind("/*", 0, end):end]


def fault(text, match, body):
    """Returns what is wrong with the comment of a declaration; None if nothing is."""
    comment = comment_of(text, match.start())
    if comment is None:
        return "has no comment"
    comment = re.sub(r"\s*\n \*\s*", " ", comment)
    returns_status = match.group(1).strip() == "int"
    codes = set(CODE.findall(comment))
    cannot = "annot fail" in comment
    if returns_status and not codes and not cannot:
        return "does not name its errors"
    if not returns_status and not cannot and not codes and ALL not in re.sub(r"\s*\n \* ?", " ", text[:text.index("*/")]):
        return "does not say whether it can fail"
    refers = re.search(r"\bas (flesh_\w+)|what flesh_\w+ returns|as theirs", comment)
    missing = own_codes(body) - codes if returns_status and not refers else set()
    if missing and "NULL" not in comment or missing - {"FLESH_ERR_ARGUMENT"}:
        return "does not name " + ", ".join(sorted(missing))
    return None


def headless(path):
    """Yields the comments of a C file that begin without a subject, with their lines."""
    text = read(path)
    for match in TOKEN.finditer(text):
        if HEADLESS.match(match.group()):
            opening = " ".join(match.group().split())[:60]
            yield f"{os.path.relpath(path, TOP)}:{text.count(chr(10), 0, match.start()) + 1}: {opening}"


def main():
    known = bodies()
    print("1..4")
    faults, count = [], 0
    for path in sorted(glob.glob(os.path.join(TOP, "include", "flesh", "*.h"))):
        text = read(path)
        for match in DECLARATION.finditer(text):
            count += 1
            wrong = fault(text, match, known.get(match.group(2), ""))
            if wrong:
                faults.append(f"{os.path.basename(path)}: {match.group(2)} {wrong}")
    for line in faults:
        print("#", line)
    print("not ok" if faults else "ok", "1 - public functions name their errors")
    print("ok" if count > 200 else "not ok", f"2 - declarations are found # {count}")
    files = [path for folder in ("lib", "include", "drivers", "test")
             for path in sorted(glob.glob(os.path.join(TOP, folder, "**", "*.[ch]"), recursive=True))]
    openings = [line for path in files for line in headless(path)]
    for line in openings:
        print("#", line)
    print("not ok" if openings else "ok", "3 - comments name their subject")
    print("ok" if len(files) > 900 else "not ok", f"4 - files are found # {len(files)}")


main()
