"""check_plot.py: the curves of a picture by `flesh plot` are those of a table.

    check_plot.py PICTURE.svg TABLE.csv X Y COLOUR [log]   its curve of that colour goes through the points of the
                                                           columns X and Y (headers), to half a pixel; `log`: of log Y
    check_plot.py PICTURE.png COLOUR...                    it has a hundred pixels of each colour at least
    check_plot.py PICTURE.png OTHER.png                    no pixel differs by more than 60 of 255, nor one of a hundred by 8
"""
import csv
import math
import re
import struct
import sys
import xml.etree.ElementTree as ElementTree
import zlib


def fit(pixels, values):
    """Returns the largest distance of pixels from the best straight line over values."""
    n = len(values)
    mean_v, mean_p = sum(values) / n, sum(pixels) / n
    square = sum((v - mean_v)**2 for v in values)
    slope = sum((v - mean_v) * (p - mean_p) for v, p in zip(values, pixels)) / square
    return slope, max(abs(p - mean_p - slope * (v - mean_v)) for v, p in zip(values, pixels))


def check_svg(path, table, x, y, colour, logarithmic):
    with open(table, newline="", encoding="utf-8") as file:
        rows = [(float(row[x]), float(row[y])) for row in csv.DictReader(file)]
    if logarithmic:
        rows = [(a, math.log(b)) for a, b in rows if b > 0]
    paths = []
    for group in ElementTree.parse(path).getroot().iter("{http://www.w3.org/2000/svg}g"):
        if (group.get("id") or "").startswith("gnuplot_plot"):
            paths += [line for p in group.iter("{http://www.w3.org/2000/svg}path")
                      if p.get("stroke", "").replace(" ", "") == rgb(colour) for line in p.get("d").split("M")]
    points = [[(float(a), float(b)) for a, b in re.findall(r"(-?[\d.]+),(-?[\d.]+)", d)] for d in paths]
    points = max(points, key=len, default=[])  # the legend has two
    if len(points) != len(rows):
        sys.exit(f"{path}: {len(points)} points of {colour}, {len(rows)} in {table}")
    across, off_x = fit([p[0] for p in points], [row[0] for row in rows])
    up, off_y = fit([p[1] for p in points], [row[1] for row in rows])
    if off_x > 0.6 or off_y > 0.6 or across <= 0 or up >= 0:
        sys.exit(f"{path}: off by {off_x:.3g} and {off_y:.3g} pixels")


def rgb(colour):
    return "rgb({},{},{})".format(*bytes.fromhex(colour[1:]))


def pixels_of(path):
    with open(path, "rb") as file:
        content = file.read()
    at, data = 8, b""
    while at < len(content):
        size, kind = struct.unpack(">I4s", content[at:at + 8])
        if kind == b"IHDR":
            width, height, depth, colours, _, _, interlace = struct.unpack(">IIBBBBB", content[at + 8:at + 21])
        data += content[at + 8:at + 8 + size] if kind == b"IDAT" else b""
        at += 12 + size
    assert depth == 8 and colours in (2, 6) and not interlace
    each = 3 if colours == 2 else 4
    raw, before, rows = zlib.decompress(data), bytearray(width * each), []
    for r in range(height):
        line = raw[r * (width * each + 1):(r + 1) * (width * each + 1)]
        row = bytearray(line[1:])
        for i, byte in enumerate(row):
            a, b = row[i - each] if i >= each else 0, before[i]
            c = before[i - each] if i >= each else 0
            p = a + b - c
            nearest = min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2]
            row[i] = (byte + (0, a, b, (a + b) // 2, nearest)[line[0]]) % 256
        before = row
        rows.append(row)
    return [tuple(row[i:i + 3]) for row in rows for i in range(0, len(row), each)]


if sys.argv[1].endswith(".svg"):
    check_svg(*sys.argv[1:6], len(sys.argv) > 6)
elif sys.argv[2].endswith(".png"):
    off = [max(abs(p - q) for p, q in zip(*pair)) for pair in zip(pixels_of(sys.argv[1]), pixels_of(sys.argv[2]))]
    print(f"# {sum(d > 8 for d in off)} of {len(off)} pixels differ by more than 8, at most by {max(off)}")
    if max(off) > 60 or sum(d > 8 for d in off) > len(off) / 100:
        sys.exit(f"{sys.argv[1]} is not {sys.argv[2]}")
else:
    seen = pixels_of(sys.argv[1])
    for wanted in sys.argv[2:]:
        found = seen.count(tuple(bytes.fromhex(wanted[1:])))
        if found < 100:
            sys.exit(f"{sys.argv[1]}: {found} pixels of {wanted}")
