"""case.py: reads and writes cases for any solver (drivers/hardcases.md has the format), with a checksum that shows whether
a case has changed. Needs NumPy and nothing of flesh."""
import hashlib
import json
import os

import numpy as np

VERSION = 1
# Order of the nodes on edges, which follow the corners: that of VTK and CalculiX; Gmsh swaps the last two.
EDGES = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]


class Case:
    """A case as arrays: rest and start [n, 3] (m); tets [m, 4 or 10]; region [m], a place in materials; fixed [k], nodes that
    are held at held_at [k, 3] (m), and start there if that is their position at rest; loads [n, 3] (N). All other values of
    case.json, such as element, materials and judge, are attributes."""

    def __init__(self, values, rest, tets, start):
        self.__dict__.update(values)
        self.rest, self.tets, self.start = rest, tets, start
        region = self.tet_material
        self.region = np.zeros(len(tets), int) if region is None else np.array(region, int)
        fixed = np.array(values["fixed"], float).reshape(-1, 4)
        self.fixed, self.held_at = fixed[:, 0].astype(int), fixed[:, 1:]
        at_rest = (self.held_at == rest[self.fixed]).all(1)
        self.start[self.fixed[at_rest]] = self.held_at[at_rest]
        self.loads = np.zeros_like(rest)
        for node, *force in values["loads"]:
            self.loads[int(node)] += force
        self.values = values

    @property
    def moved(self):
        """Nodes whose total force is measured: those of the key `measured`, else the fixed ones that are not held at their
        position at rest."""
        if "measured" in self.values:
            return np.array(self.values["measured"], int)
        return self.fixed[(self.held_at != self.rest[self.fixed]).any(1)]

    def constants(self, name):
        """Returns a constant of the material for each of the m tets."""
        return np.array([material[name] for material in self.materials])[self.region]

    @property
    def forms(self):
        return sorted({material["energy"] for material in self.materials})

    @property
    def sum(self):
        """SHA-256 of the solver's input and the judge's limits, with numbers of twelve digits."""
        said = {key: value for key, value in self.values.items() if key not in ("name", "doc", "mesh", "start")}
        said.update(rest=self.rest.tolist(), tets=self.tets.tolist(), positions=self.start.tolist())
        return hashlib.sha256(json.dumps(rounded(said), sort_keys=True).encode()).hexdigest()


def rounded(value):
    if isinstance(value, float):
        return f"{value + 0.0:.11e}"
    if isinstance(value, dict):
        return {key: rounded(part) for key, part in value.items()}
    return [rounded(part) for part in value] if isinstance(value, list) else value


def read_medit(path):
    """Reads positions [n, 3] and tets [m, 4 or 10], numbered from 0, from a Medit file."""
    with open(path, encoding="utf-8") as file:
        words = file.read().split()

    def table(keyword, columns, kind):
        begin = words.index(keyword) + 2
        count = int(words[begin - 1])
        return np.array(words[begin:begin + count * columns], kind).reshape(count, columns)

    quadratic = "TetrahedraP2" in words
    tets = table("TetrahedraP2", 11, int) if quadratic else table("Tetrahedra", 5, int)
    return table("Vertices", 4, float)[:, :3], tets[:, :-1] - 1


def write_medit(path, rest, tets, region):
    with open(path, "w", encoding="utf-8") as file:
        file.write(f"MeshVersionFormatted 2\nDimension 3\nVertices\n{len(rest)}\n")
        np.savetxt(file, np.column_stack([rest, np.zeros(len(rest))]), "%.17g %.17g %.17g %d")
        file.write(f"Tetrahedra{'P2' if tets.shape[1] == 10 else ''}\n{len(tets)}\n")
        np.savetxt(file, np.column_stack([tets + 1, region]), "%d")
        file.write("End\n")


def read(folder):
    """Reads the case in the folder. Raises ValueError if it has another format or version, or its start other nodes."""
    with open(os.path.join(folder, "case.json"), encoding="utf-8") as file:
        values = json.load(file)
    if (values.get("format"), values.get("version")) != ("flesh-case", VERSION):
        raise ValueError(f"{folder}/case.json is {values.get('format')} {values.get('version')}; it must be flesh-case "
                         f"{VERSION}")
    rest, tets = read_medit(os.path.join(folder, values["mesh"]))
    start = np.loadtxt(os.path.join(folder, values["start"]))[:, :3]
    if start.shape != rest.shape:
        raise ValueError(f"{folder} has {len(rest)} nodes and {len(start)} positions at the start")
    return Case(values, rest, tets, start)


def write(folder, values, rest, tets, start):
    """Writes a case for `read`; `values` are those of case.json without format, version, mesh and start."""
    os.makedirs(folder, exist_ok=True)
    values = {"format": "flesh-case", "version": VERSION, "mesh": "body.mesh", "start": "start.txt", **values}
    region = values["tet_material"]
    write_medit(os.path.join(folder, "body.mesh"), rest, tets, np.zeros(len(tets)) if region is None else region)
    np.savetxt(os.path.join(folder, "start.txt"), np.column_stack([start, np.zeros_like(start)]), "%.17g")
    with open(os.path.join(folder, "case.json"), "w", encoding="utf-8") as file:
        json.dump(values, file, indent=1)
