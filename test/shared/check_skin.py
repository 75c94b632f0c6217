"""check_skin.py: the files of a skin, read by others: PC2 by struct, OBJ and VTU by VTK.

    check_skin.py SKIN FRAMES BINDING    SKIN: folder of skin_*.obj, skin.pc2, skin.pvd; FRAMES: the run's frames.pvd

Every position must be sum w_i x_i of the binding's rows and of the run's frames, which are multiplied out here. TAP;
exit 77 without VTK.
"""
import glob
import os
import struct
import sys

sys.dont_write_bytecode = True  # write nothing beside the sources
from vtk_tap import check, collection, finish, read, rows_of

from vtkmodules.vtkIOGeometry import vtkOBJReader


def read_pc2(path):
    data = open(path, "rb").read()
    mark, version, points, start, rate, samples = struct.unpack_from("<12siiffi", data)
    check("the point cache's header", mark == b"POINTCACHE2\0" and version == 1 and start == 0 and rate == 1)
    check("the point cache's size", len(data) == 32 + 12 * points * samples)
    return [[struct.unpack_from("<3f", data, 32 + 12 * (s * points + p)) for p in range(points)]
            for s in range(samples)]


def read_binding(path):
    rows = [line.split() for line in open(path) if line[0] in "0123456789"]
    return [(int(r[0]), [float(w) for w in r[1:5]]) for r in rows]


def worst(found, expected):
    if len(found) != len(expected):
        return float("inf")
    return max(abs(a - b) for p, q in zip(found, expected) for a, b in zip(p, q))


skin, frames, binding_path = sys.argv[1:]
binding = read_binding(binding_path)
expected, velocities = [], []
for _, path in collection(frames):
    grid, _ = read(path)
    x, v = rows_of(grid.GetPoints().GetData()), rows_of(grid.GetPointData().GetArray("velocity"))
    nodes = [[grid.GetCell(t).GetPointId(k) for k in range(4)] for t, _ in binding]
    expected.append([tuple(sum(w * x[n][d] for w, n in zip(weights, tet)) for d in range(3))
                     for (_, weights), tet in zip(binding, nodes)])
    velocities.append([tuple(sum(w * v[n][d] for w, n in zip(weights, tet)) for d in range(3))
                       for (_, weights), tet in zip(binding, nodes)])
size = max(abs(c) for frame in expected for p in frame for c in p)
check("the body moves", worst(expected[0], expected[-1]) > 0.01 * size)

cache = read_pc2(os.path.join(skin, "skin.pc2"))
check("a sample per frame", len(cache) == len(expected))
check("samples are where the tets put them",
      max(worst(a, b) for a, b in zip(cache, expected)) < 1e-6 * size)

objs = sorted(glob.glob(os.path.join(skin, "skin_*.obj")))
check("an OBJ per frame", len(objs) == len(expected))
for path, points in list(zip(objs, expected))[::5]:
    reader = vtkOBJReader()
    reader.SetFileName(path)
    reader.Update()
    output = reader.GetOutput()
    check(f"{os.path.basename(path)} has faces and points",
          output.GetNumberOfPolys() > 0 and output.GetNumberOfPoints() == len(points))
    check(f"{os.path.basename(path)} is where the tets put it",
          worst(rows_of(output.GetPoints().GetData()), points) < 1e-6 * size)

vtus = collection(os.path.join(skin, "skin.pvd"))
check("the times of the frames", [t for t, _ in vtus] == [t for t, _ in collection(frames)])
for (_, path), points, speed in list(zip(vtus, expected, velocities))[::5]:
    grid, _ = read(path)
    name = os.path.basename(path)
    check(f"{name}: polygons", all(grid.GetCellType(c) in (5, 7) for c in range(grid.GetNumberOfCells())))
    check(f"{name} is where the tets put it",
          worst(rows_of(grid.GetPoints().GetData()), points) < 1e-14 * len(points) * size)
    check(f"{name} has the velocities",
          worst(rows_of(grid.GetPointData().GetArray("velocity")), speed) < 1e-12)
finish()
