#!/usr/bin/env python3
"""embed.py: writes files that are compiled into the program as C strings: a table of flesh_embedded (study/embedded.h).

    embed.py OUT.c TABLE FILE..."""
import json
import os
import sys

out, table, *files = sys.argv[1:]
with open(out, "w", encoding="ascii") as file:
    file.write(f'#include "study/embedded.h"\n\nconst flesh_embedded {table}[] = {{\n')
    for path in files:
        lines = "\n".join(json.dumps(line) for line in open(path, encoding="utf-8"))
        file.write(f'{{"{os.path.splitext(os.path.basename(path))[0]}",\n{lines}}},\n')
    file.write("{0}};\n")
