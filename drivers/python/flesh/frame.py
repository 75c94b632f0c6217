"""frame.py: a frame that flesh wrote for ParaView, as numpy arrays."""
import os
import xml.etree.ElementTree as ElementTree
from typing import Dict

import numpy as np

from .errors import FileError

__all__ = ["Frame"]

_TYPES = {"Float64": "f8", "Int64": "i8", "Int32": "i4", "UInt8": "u1"}
_MARK = b'<AppendedData encoding="raw">\n_'


class Frame:
    """A .vtu file of flesh: arrays of its nodes and tets, by name.

    Attributes:
        positions: [nodes, 3] m.
        tets: [tets, 4] or [tets, 10] nodes in VTK's order; -1 six times in four-node tets of a mesh with ten-node tets.
        nodes: arrays at nodes: displacement [nodes, 3] m, velocity [nodes, 3] m/s, and output.fields.
        cells: arrays of tets: J [tets], region [tets], and output.fields; those at points are [tets, points, ...].
        units: units of arrays by name: {"stress": "Pa"}.
    """
    positions: np.ndarray
    tets: np.ndarray
    nodes: Dict[str, np.ndarray]
    cells: Dict[str, np.ndarray]
    units: Dict[str, str]

    def __init__(self):
        raise TypeError("Frame.read(path) reads a frame; there is no empty one")

    @classmethod
    def read(cls, path) -> "Frame":
        """Reads a frame; its arrays are copies. FileError if flesh did not write the file."""
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
        except (ElementTree.ParseError, LookupError, ValueError, OverflowError) as error:
            raise FileError(f"{path}: not a whole frame as flesh writes them: {error}") from None

    @classmethod
    def _of(cls, root, data):
        order = {"LittleEndian": "<", "BigEndian": ">"}[root.get("byte_order", "no byte_order")]
        length = np.dtype(order + {"UInt32": "u4", "UInt64": "u8"}[root.get("header_type", "no header_type")])
        frame, units = cls.__new__(cls), {}

        def section(name, rows=None):
            arrays = {}
            for row in root.iter(name):
                for header in row.iter("DataArray"):
                    array = values(header)
                    if len(array) != (len(array) if rows is None else rows):
                        raise ValueError(f"{header.get('Name')} has {len(array)} rows; there must be {rows}")
                    arrays[attribute(header, "Name")] = array
            return arrays

        def attribute(header, name):
            if header.get(name) is None:
                raise ValueError(f"a DataArray has no {name}")
            return header.get(name)

        def values(header):
            kind, start = np.dtype(order + _TYPES[attribute(header, "type")]), int(attribute(header, "offset"))
            components, unit = int(attribute(header, "NumberOfComponents")), header.find("InformationKey")
            size = int(np.frombuffer(data, length, 1, start)[0])
            if start < 0 or size % (kind.itemsize * max(components, 1)) or components < 1:
                raise ValueError(f"{header.get('Name')} has {size} bytes at {start} in {components} components")
            array = np.frombuffer(data, kind, size // kind.itemsize, start + length.itemsize)
            array = array.astype(kind.newbyteorder("="))
            if unit is not None:
                units[header.get("Name")] = unit.text or ""
            return array.reshape(-1, components) if components > 1 else array

        frame.positions = section("Points")["Points"]
        if frame.positions.ndim != 2 or frame.positions.shape[1] != 3:
            raise ValueError("its points have not three coordinates each")
        frame.tets = _tets(section("Cells"), len(frame.positions))
        frame.nodes, frame.cells = section("PointData", len(frame.positions)), section("CellData", len(frame.tets))
        frame.units = units
        for name, array in frame.cells.items():
            if name.endswith("_at_points"):
                points = 4 if frame.tets.shape[1] == 10 else 1
                size = array.size // max(1, points * len(frame.tets))
                frame.cells[name] = array.reshape(-1, points, size) if size > 1 else array.reshape(-1, points)
        return frame

    def __repr__(self):
        return f"<flesh.Frame of {len(self.positions)} nodes: {', '.join([*self.nodes, *self.cells])}>"


def _tets(cells, nodes):
    """Returns [tets, 4] or [tets, 10] nodes from VTK's list; -1 six times in tets of four beside others of ten."""
    connectivity, ends, kinds = (cells[name] for name in ("connectivity", "offsets", "types"))
    sizes = np.where(kinds == 24, 10, 4)
    if connectivity.ndim != 1 or not np.isin(kinds, (10, 24)).all() or not np.array_equal(np.cumsum(sizes), ends) or \
            len(connectivity) != sizes.sum() or (connectivity < 0).any() or (connectivity >= nodes).any():
        raise ValueError("its cells are no tets of its points")
    tets = np.full((len(kinds), sizes.max(initial=4)), -1, connectivity.dtype)
    tets[np.arange(tets.shape[1]) < sizes[:, None]] = connectivity
    return tets
