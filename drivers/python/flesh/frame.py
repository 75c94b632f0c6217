"""frame.py: a frame of a run, as flesh writes it for ParaView, as numpy arrays."""
import os
import xml.etree.ElementTree as ElementTree
from typing import Dict

import numpy as np

from .errors import FileError

__all__ = ["Frame"]

_TYPES = {"Float64": "f8", "Int64": "i8", "Int32": "i4", "UInt8": "u1"}
_MARK = b'<AppendedData encoding="raw">\n_'


class Frame:
    """A .vtu file of flesh: what its nodes and tets have, by name.

    Attributes:
        positions: [nodes, 3] m.
        tets: [tets, 4] or [tets, 10] nodes in VTK's order.
        nodes: arrays at nodes: displacement [nodes, 3] m, velocity [nodes, 3] m/s, and output.fields.
        cells: arrays of tets: J [tets], region [tets], and output.fields; those at points are [tets, points, ...].
        units: by name, of what has one: {"stress": "Pa"}.
    """
    positions: np.ndarray
    tets: np.ndarray
    nodes: Dict[str, np.ndarray]
    cells: Dict[str, np.ndarray]
    units: Dict[str, str]

    @classmethod
    def read(cls, path) -> "Frame":
        """Reads a frame; its arrays are copies. FileError where the file is none of flesh's."""
        path = os.fspath(path)
        try:
            with open(path, "rb") as file:
                content = file.read()
        except OSError as error:
            raise FileError(f"{path}: {error.strerror}") from None
        at = content.find(_MARK)
        try:
            if at < 0:
                raise ValueError("it has no raw appended data")
            root = ElementTree.fromstring(content[:at] + b"</VTKFile>")
            return cls._of(root, memoryview(content)[at + len(_MARK):])
        except (ElementTree.ParseError, ValueError, KeyError, AttributeError) as error:
            raise FileError(f"{path}: not a whole frame as flesh writes them: {error}") from None

    @classmethod
    def _of(cls, root, data):
        order = {"LittleEndian": "<", "BigEndian": ">"}[root.get("byte_order")]
        length = np.dtype(order + {"UInt32": "u4", "UInt64": "u8"}[root.get("header_type")])
        frame, units = cls(), {}

        def section(name):
            arrays = {}
            for row in root.iter(name):
                for header in row.iter("DataArray"):
                    arrays[header.get("Name")] = values(header)
            return arrays

        def values(header):
            kind, start = np.dtype(order + _TYPES[header.get("type")]), int(header.get("offset"))
            size = int(np.frombuffer(data, length, 1, start)[0])
            array = np.frombuffer(data, kind, size // kind.itemsize, start + length.itemsize).astype(kind.newbyteorder("="))
            components, unit = int(header.get("NumberOfComponents")), header.find("InformationKey")
            if unit is not None:
                units[header.get("Name")] = unit.text
            return array.reshape(-1, components) if components > 1 else array

        frame.nodes, frame.cells, frame.units = section("PointData"), section("CellData"), units
        frame.positions = section("Points")["Points"]
        cells = section("Cells")
        frame.tets = cells["connectivity"].reshape(len(cells["types"]), -1)
        points = 4 if frame.tets.shape[1] == 10 else 1
        for name, array in frame.cells.items():
            if name.endswith("_at_points"):
                size = array.size // max(1, points * len(frame.tets))
                frame.cells[name] = array.reshape(-1, points, size) if size > 1 else array.reshape(-1, points)
        return frame

    def __repr__(self):
        return f"<flesh.Frame of {len(self.positions)} nodes: {', '.join([*self.nodes, *self.cells])}>"
