#!/usr/bin/env python3
"""embed.py: writes the page of a report as a C string: page.html with style, licence, library and scripts at its marks.

    embed.py OUT.c page.html page.css LICENSE three.min.js SCRIPT.js..."""
import sys


def literal(text):
    """Returns the text as lines of a C string."""
    out = []
    data = text.encode()
    for k in range(0, len(data), 100):
        part = data[k:k + 100]
        out.append('"' + "".join(
            chr(b) if 32 <= b < 127 and b not in b'"\\?' else f"\\{b:03o}" for b in part) + '"')
    return "\n".join(out)


def main():
    out, page, style, licence, library, *scripts = sys.argv[1:]
    read = lambda path: open(path, encoding="utf-8").read()
    own = "".join(read(path) for path in scripts)
    for path in [library, *scripts]:
        if "</script" in read(path).lower():
            sys.exit(f"{path}: </script would end it")
    text = read(page)
    for mark, part in {"@STYLE@": read(style), "@LICENCE@": read(licence), "@THREE@": read(library),
                       "@SCRIPT@": '"use strict";\n(() => {\n' + own + "})();\n"}.items():
        if text.count(mark) != 1:
            sys.exit(f"{page}: {mark} must stand in it once")
        text = text.replace(mark, part)
    for mark in ("@TITLE@", "@LEAD@", "@STILL@", "@PAYLOAD@"):
        if text.count(mark) != 1:
            sys.exit(f"{page}: {mark} must stand in it once")
    with open(out, "w", encoding="ascii") as file:
        file.write('#include "report/report.h"\n\nconst char flesh_report_page[] =\n' + literal(text) + ";\n")


main()
