#!/usr/bin/env python3
"""embed.py: the program's own hard cases as C texts.

    embed.py OUT.c FILE.yaml..."""
import json
import os
import sys

with open(sys.argv[1], "w", encoding="ascii") as out:
    out.write('#include "hardcases/cases.h"\n\nconst flesh_hardcases_own flesh_hardcases_own_files[] = {\n')
    for path in sys.argv[2:]:
        lines = "\n".join(json.dumps(line) for line in open(path, encoding="ascii"))
        out.write(f'{{"{os.path.basename(path).removesuffix(".yaml")}",\n{lines}}},\n')
    out.write("{0}};\n")
