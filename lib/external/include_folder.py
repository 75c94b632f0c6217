"""include_folder.py HEADER COMPILER [ARGUMENT...]: where a compiler takes <HEADER> from.

Prints the folder that HEADER is named in, and on a second line `default` where the compiler looks there by itself, or
`own` where an argument, CPATH or C_INCLUDE_PATH led there. Prints nothing where there is no such header.
"""
import os
import re
import subprocess
import sys


def without_folders(command):
    """The command without its -I and the like."""
    kept, skip = [], False
    for word in command:
        names_folder = re.match(r"-(I|isystem|idirafter|iquote)", word)
        if not names_folder and not skip:
            kept.append(word)
        skip = bool(names_folder) and names_folder.group(0) == word
    return kept


def preprocess(command, text, environment):
    return subprocess.run(command + ["-E", "-v", "-x", "c", "-"], input=text, text=True, capture_output=True,
                          env=environment)


header, command = sys.argv[1], sys.argv[2:]
plain = {**os.environ, "LC_ALL": "C"}
result = preprocess(command, f"#include <{header}>\n", plain)
place = re.search(r'^# 1 "(.*)/' + re.escape(header) + '"', result.stdout, re.MULTILINE)
if result.returncode == 0 and place:
    # Relative to the build folder, as the compiler will see it.
    folder = os.path.normpath(os.path.join(os.environ.get("MESON_BUILD_ROOT", ""), place.group(1)))
    for name in ("CPATH", "C_INCLUDE_PATH"):
        plain.pop(name, None)
    listed = preprocess(without_folders(command), "", plain).stderr
    listed = listed.partition("#include <...> search starts here:")[2].partition("End of search list")[0]
    defaults = {os.path.realpath(line.strip()) for line in listed.splitlines() if line.strip()}
    print(folder)
    print("default" if os.path.realpath(folder) in defaults else "own")
