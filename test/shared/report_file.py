#!/usr/bin/env python3
"""report_file.py: reads the output of `flesh report` as specified in drivers/report/report.h: its payload, and the
positions, values and flags of the frames in it."""
import base64
import json
import re
import struct
import zlib

FIELDS = 3  # J, stress, speed


class Report:
    def __init__(self, path):
        with open(path, encoding="utf-8") as file:
            self.html = file.read()
        found = re.search(r'<script id="payload" type="text/plain">([A-Za-z0-9+/=]*)</script>', self.html)
        data = zlib.decompress(base64.b64decode(found.group(1)))
        length = int(data[:12])
        self.json = json.loads(data[12:12 + length])
        self.bytes = data[12 + length:]
        self.at = 0

    def number(self):
        value = shift = 0
        while True:
            byte = self.bytes[self.at]
            self.at += 1
            value |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return value >> 1 ^ -(value & 1)

    def list(self, place):
        self.at, count = place
        values, last = [], 0
        for _ in range(count):
            last += self.number()
            values.append(last)
        return values

    def frames(self, run):
        """Yields for each frame of a run: positions [nodes][3], fields [3][nodes] and the inverted tets."""
        nodes, tets = run["mesh"]["nodes"], run["mesh"]["tet_count"]
        moving = 3 * sum(obstacle["vertices"] for obstacle in run["obstacles"])
        total = (3 + FIELDS) * nodes + moving
        self.at = run["at"]
        one = two = None
        flags = bytes((tets + 7) // 8)
        for _ in run["times"]:
            values = []
            for k in range(total):
                told = 2 * one[k] - two[k] if two else one[k] if one else values[-1] if values else 0
                values.append(told + self.number())
            changed = self.bytes[self.at:self.at + len(flags)]
            self.at += len(flags)
            flags = bytes(a ^ b for a, b in zip(flags, changed))
            two, one = one, values
            x = [[values[d * nodes + i] * run["quantum"] for d in range(3)] for i in range(nodes)]
            begin = 3 * nodes + moving
            fields = [[low + step * value for value in values[begin + f * nodes:begin + (f + 1) * nodes]]
                      for f, (low, step) in enumerate(run["fields"])]
            yield x, fields, {t for t in range(tets) if flags[t // 8] >> t % 8 & 1}


def vtu_array(path, name):
    """Returns an array of doubles of a frame, as a flat list."""
    with open(path, "rb") as file:
        data = file.read()
    head = data[:data.index(b"<AppendedData")].decode()
    offset = int(re.search(rf'Name="{name}"[^>]*offset="(\d+)"', head).group(1))
    begin = data.index(b"_", data.index(b"<AppendedData")) + 1 + offset
    size = struct.unpack_from("<I", data, begin)[0]
    return struct.unpack_from(f"<{size // 8}d", data, begin + 4)
