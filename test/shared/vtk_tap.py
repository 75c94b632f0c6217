"""vtk_tap.py: shared by the checks of files with VTK: TAP, and reading with VTK; importing it exits with 77 without
VTK."""
import os
import sys
import xml.etree.ElementTree as ElementTree

try:
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader
except ImportError as error:
    print(f"1..0 # SKIP VTK for Python is missing ({error}); Debian's package is python3-vtk9")
    sys.exit(77)

failures = 0
number = 0


def check(name, condition):
    global failures, number
    number += 1
    failures += not condition
    print(("ok" if condition else "not ok"), number, "-", name)


def finish():
    print(f"1..{number}")
    sys.exit(failures > 0)


def read(path):
    """Returns the grid of a .vtu, and whether VTK had no complaints."""
    errors = []
    reader = vtkXMLUnstructuredGridReader()
    reader.AddObserver("ErrorEvent", lambda *_: errors.append(path))
    reader.SetFileName(path)
    reader.Update()
    return reader.GetOutput(), not errors


def rows_of(array):
    return [array.GetTuple(i) for i in range(array.GetNumberOfTuples())]


def collection(path):
    """Returns the (time, file) pairs of a .pvd."""
    rows = ElementTree.parse(path).getroot().iter("DataSet")
    return [(float(r.get("timestep")), os.path.join(os.path.dirname(path), r.get("file"))) for r in rows]
