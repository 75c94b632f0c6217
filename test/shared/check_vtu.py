"""check_vtu.py: VTK itself reads what the writers wrote.

    check_vtu.py PROGRAM    runs `PROGRAM --write DIR`, which writes sample.vtu and sample.pvd from the same
                            formulas as below, and compares (TAP; exit 77 without VTK)
    check_vtu.py FILE...    checks any .vtu or .pvd: it reads, its cells are tets of finite points; where it has stresses,
                            they are tensors with units, and their von Mises stress is von_mises
"""
import math
import os
import re
import subprocess
import sys
import tempfile

sys.dont_write_bytecode = True  # write nothing beside the sources
from vtk_tap import check, collection, finish, read, rows_of
from vtkmodules.vtkCommonCore import reference, vtkDataArray

UNITS = vtkDataArray.UNITS_LABEL()


def values(array):
    """Returns the rows of a VTK array; plain values if it has one component."""
    rows = rows_of(array)
    return [row[0] for row in rows] if array.GetNumberOfComponents() == 1 else rows


def arrays(data):
    return {data.GetArrayName(a): values(data.GetArray(a)) for a in range(data.GetNumberOfArrays())}


def tets_of(grid, sizes=None):
    return [[grid.GetCell(c).GetPointId(k) for k in range(sizes[c] if sizes else 4)]
            for c in range(grid.GetNumberOfCells())]


def volume(points, tet):
    o, *others = (points[k] for k in tet)
    a, b, c = ([p - q for p, q in zip(other, o)] for other in others)
    return sum(a[i] * (b[i - 2] * c[i - 1] - b[i - 1] * c[i - 2]) for i in range(3)) / 6


def check_grid(path):
    grid, fine = read(path)
    fine = fine and grid.GetNumberOfCells() > 0
    check(f"{path} reads", fine)
    if not fine:
        return grid, []
    points = values(grid.GetPoints().GetData())
    check(f"{path}: points are finite", all(math.isfinite(p) for point in points for p in point))
    check(f"{path}: every cell is a tet",
          all(grid.GetCellType(c) in (10, 24) for c in range(grid.GetNumberOfCells())))
    for where, data in (("nodes", grid.GetPointData()), ("tets", grid.GetCellData())):
        if data.HasArray("stress"):
            check_stress(f"{path}: {where}", data)
    check_for_meshio(path, points)
    return grid, points


def check_for_meshio(path, points):
    """Reads by meshio, if it is installed; meshio finds arrays by offsets, which is only right if they descend."""
    with open(path, "rb") as file:
        offsets = [int(offset) for offset in re.findall(rb' offset="(\d+)"', file.read().split(b"<AppendedData")[0])]
    check(f"{path}: offsets descend to 0", offsets == sorted(set(offsets), reverse=True) and offsets[-1] == 0)
    try:
        import meshio
    except ImportError:
        return
    check(f"{path}: meshio reads the same", [tuple(row) for row in meshio.read(path).points.tolist()] == points)


def von_mises(stress):
    xx, yy, zz, xy, yz, xz = stress
    return math.sqrt(((xx - yy)**2 + (yy - zz)**2 + (zz - xx)**2) / 2 + 3 * (xy**2 + yz**2 + xz**2))


def check_stress(where, data):
    names = ["XX", "YY", "ZZ", "XY", "YZ", "XZ"]
    array = data.GetArray("stress")
    check(f"{where}: components and unit", array.GetInformation().Get(UNITS) == "Pa" and
          [array.GetComponentName(c) for c in range(array.GetNumberOfComponents())] == names)
    rows = values(array)
    check(f"{where}: there is stress", max(map(von_mises, rows)) > 100)
    if data.HasArray("von_mises"):
        check(f"{where}: von Mises", all(math.isclose(v, von_mises(row), rel_tol=1e-12, abs_tol=1e-9)
                                         for v, row in zip(values(data.GetArray("von_mises")), rows)))
    if data.HasArray("stress_at_points"):
        at = data.GetArray("stress_at_points")
        count = at.GetNumberOfComponents() // 6
        check(f"{where}: components at points", [at.GetComponentName(c) for c in range(6 * count)] ==
              ([f"{name}_{q + 1}" for q in range(count) for name in names] if count > 1 else names))


def check_sample(folder):
    grid, points = check_grid(os.path.join(folder, "sample.vtu"))
    corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]]
    check("points are exact", points == [tuple(c / 3 for c in corner) for corner in corners])
    tets = tets_of(grid)
    check("tets are exact", tets == [[0, 1, 2, 3], [1, 2, 3, 4]])
    check("volumes", all(abs(volume(points, tet) - expected) < 1e-16
                         for tet, expected in zip(tets, [1 / 162, 2 / 162])))
    point, cell = arrays(grid.GetPointData()), arrays(grid.GetCellData())
    check("point arrays", sorted(point) == ["mark", "velocity"])
    check("vectors are exact", point["velocity"] == [(i + .1, i * .1, -i / 7) for i in range(5)])
    check("units are VTK's", grid.GetPointData().GetArray("velocity").GetInformation().Get(UNITS) == "m/s & more" and
          not grid.GetPointData().GetArray("mark").GetInformation().Has(UNITS))
    check("integers are exact", point["mark"] == [0, -1, -2, -3, -4])
    check("cell arrays", sorted(cell) == ["J & more", "region"])
    check("cell values are exact", cell["J & more"] == [.5, 1 / 3])
    check("regions are exact", cell["region"] == [7, -2147483648])
    polygons, fine = read(os.path.join(folder, "polygons.vtu"))
    check("polygons read", fine and tets_of(polygons, [3, 4]) == [[0, 1, 4], [0, 2, 4, 3]])
    check("polygons' values are exact", arrays(polygons.GetCellData())["J & more"] == [.5, 1 / 3])
    grid, points = check_grid(os.path.join(folder, "quadratic.vtu"))
    check("ten nodes are in VTK's order", tets_of(grid, [10]) == [[0, 1, 2, 3, 9, 8, 7, 6, 5, 4]])
    groups = [[grid.GetCellData().GetArray(name).GetComponentName(c) for c in range(count)]
              for name, count in (("named", 4), ("numbered", 3))]
    check("components have names", groups == [["<x>_1", "y_1", "<x>_2", "y_2"], ["1", "2", "3"]])
    parameters = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    bent = []
    for k, (i, j) in enumerate([(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]):
        place, weights = [0.0] * 3, [0.0] * 10
        half = [(p + q) / 2 for p, q in zip(parameters[i], parameters[j])]
        grid.GetCell(0).EvaluateLocation(reference(0), half, place, weights)
        expected = [(corners[i][d] + corners[j][d]) / 6 + (k + 1) * (d + 1) / 256 for d in range(3)]
        bent.append(max(abs(p - q) for p, q in zip(place, expected)))
    check("curved edges go where they should", max(bent) < 1e-15)
    rows = collection(os.path.join(folder, "sample.pvd"))
    check("times of the collection", [row[0] for row in rows] == [0, 1 / 3])
    for _, path in rows:
        check_grid(path)


arguments = sys.argv[1:]
if all(a.endswith((".vtu", ".pvd")) for a in arguments):
    for argument in arguments:
        for path in [row[1] for row in collection(argument)] if argument.endswith(".pvd") else [argument]:
            check_grid(path)
else:
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([arguments[0], "--write", folder], check=True)
        check_sample(folder)
finish()
