"""mesh.py: tetrahedral meshes: made from arrays, read, written, measured."""
from typing import Dict, NamedTuple, Optional, Tuple

import numpy as np

from ._arrays import Field, Record, doubles, integers, pointer, view
from ._callbacks import Const, call, create, owned
from ._library import ffi, lib, path_bytes, text
from .errors import ArgumentError

__all__ = ["Mesh", "MeshInfo", "MeshParents", "Jacobians", "NamedSet"]


class MeshInfo(Record):
    """Findings from the making of a mesh, and measures of its shape. Lengths in m, volumes in m^3."""
    _ctype = "flesh_mesh_info"
    nodes: int = Field("number of nodes")
    tets: int = Field("number of tets")
    triangles: int = Field("triangles of the surface")
    flipped: int = Field("tets whose winding was inverted and has been flipped")
    unused_nodes: int = Field("nodes that no tet uses")
    regions: int = Field("distinct region tags")
    volume: float = Field("m^3")
    low: np.ndarray = Field("[3] lower corner of the box around the nodes that tets use, m")
    high: np.ndarray = Field("[3] upper corner, m")
    edge_min: float = Field("shortest edge between corners, m")
    edge_mean: float = Field("mean edge, m")
    edge_max: float = Field("longest edge, m")
    radius_ratio_min: float = Field("smallest 3 * inradius / circumradius; 1 for a regular tet")
    radius_ratio_mean: float = Field("mean of that")
    worst_tet: int = Field("the tet with radius_ratio_min")
    order: int = Field("1, or 2 if tets have ten nodes")
    quadratic: int = Field("number of ten-node tets")
    curved: int = Field("tets with a curved edge")
    scaled_jacobian_min: float = Field("smallest over largest Jacobian of a tet's map, 1 if all edges are straight")
    most_bent_tet: int = Field("the tet with scaled_jacobian_min")


class Jacobians(NamedTuple):
    """J = det F of the tets of a mesh: the smallest values at quadrature points, or lower bounds in whole tets."""
    J: np.ndarray  # [tets]
    least: float  # the smallest; NaN if one is NaN
    worst: int  # its tet
    not_positive: int  # number of tets without J > 0: inverted tets, if J is that of quadrature points


class MeshParents(NamedTuple):
    """Places of a refined mesh's tets and nodes in the mesh from which it was made."""
    tet: np.ndarray  # [tets] the coarser mesh's tet of which each is a part, ascending
    node_tet: np.ndarray  # [nodes] a tet of the coarser mesh that contains the node; -1: none does
    place: np.ndarray  # [nodes, 4] the node's barycentric coordinates in that tet


class NamedSet(NamedTuple):
    """A named set of a mesh; a scene's `set: NAME` selects its nodes and those of its tets."""
    nodes: np.ndarray  # numbers, ascending
    tets: np.ndarray


class Mesh(Const):
    """A mesh of tets with four nodes (order 1) or ten (order 2, where some may have four); const once made.

    Its arrays are views that cannot be written to and keep the mesh alive.

    Args:
        positions: [nodes, 3] rest positions, m.
        tets: [tets, 4] or [tets, 10] node indices from 0; the last six of ten are on the edges 01, 12, 02, 03, 13, 23;
            a tet with six times -1 there has four nodes.
        regions: [tets] tags, or None for 0 everywhere.

    Raises:
        ArgumentError: an array of another shape, a flat or doubled tet, a node out of range, a number that is not
            finite, an empty mesh.
    """

    def __init__(self, positions, tets, regions=None):
        x = doubles(positions, (None, 3), "positions")
        width = np.shape(tets)[-1] if np.ndim(tets) == 2 else 4
        if width not in (4, 10):
            raise ArgumentError(f"tets has shape {np.shape(tets)}; it must be (any, 4) or (any, 10)")
        nodes = integers(tets, (None, width), "tets")
        tags = None if regions is None else integers(regions, (len(nodes),), "regions")
        make = lib.flesh_mesh_create if width == 4 else lib.flesh_mesh_create_quadratic
        self._take(create("flesh_mesh", make, len(x), pointer(x), len(nodes), pointer(nodes, "int"),
                          pointer(tags, "int")))

    def _take(self, made, owner=None):
        """Owns `made`, or, with `owner`, keeps its owner alive."""
        if owner is None:
            self._pointer = owned("flesh_mesh", made, lib.flesh_mesh_destroy, holder=self)
        else:
            self._pointer, self._life = made, owner._life
        self._owner = owner
        return self

    @classmethod
    def _of(cls, made, owner=None) -> "Mesh":
        return cls.__new__(cls)._take(made, owner)

    @classmethod
    def box(cls, cells, size, origin=(0, 0, 0)) -> "Mesh":
        """Makes a grid of cells[0] x cells[1] x cells[2] boxes of six tets each, which fills `size` [3] m from `origin`.

        Node (i, j, k) has the number (k*(ny+1) + j)*(nx+1) + i.
        """
        return cls._of(create("flesh_mesh", lib.flesh_mesh_box, pointer(integers(cells, (3,), "cells"), "int"),
                              pointer(doubles(size, (3,), "size")), pointer(doubles(origin, (3,), "origin"))))

    @classmethod
    def read(cls, path) -> "Mesh":
        """Reads TetGen (.node, .ele), Gmsh (.msh 2.2, 4.1), Medit (.mesh) or a plain list, recognised by content, and
        Abaqus .inp, VTK .vtu and VegaFEM .veg by their names.

        Raises:
            FileError: with file and line.
        """
        return cls._of(create("flesh_mesh", lib.flesh_mesh_read, path_bytes(path)))

    def write(self, path) -> None:
        """Writes .node/.ele (TetGen), .msh (Gmsh 4.1) or .mesh (Medit) by the suffix; never a partial file."""
        call(lib.flesh_mesh_write, self._pointer, path_bytes(path))

    def raise_order(self) -> "Mesh":
        """Returns the mesh of order 2 with a node in the middle of each edge of this mesh, which has order 1."""
        return self._of(create("flesh_mesh", lib.flesh_mesh_raise_order, self._pointer))

    def lower_order(self) -> "Mesh":
        """Returns the mesh of order 1 with the corners of this mesh, which has order 2."""
        return self._of(create("flesh_mesh", lib.flesh_mesh_lower_order, self._pointer))

    def refine(self) -> "Mesh":
        """Returns the mesh with each tet of this mesh cut into eight; the nodes keep their numbers."""
        return self._of(create("flesh_mesh", lib.flesh_mesh_refine, self._pointer))

    def refine_marked(self, halvings) -> Tuple["Mesh", MeshParents]:
        """Returns the mesh with tet t bisected at least halvings[t] times, and others where faces would not fit, and the
        places of its tets and nodes in this mesh. However often a mesh is so refined, its tets have a fixed number of
        shapes.

        Args:
            halvings: [tets], 0 to 255.
        """
        wanted = integers(halvings, (self.tet_count,), "halvings")
        if wanted.size and not 0 <= wanted.min() <= wanted.max() <= 255:
            raise ArgumentError("halvings must be from 0 to 255")
        raw, times = ffi.new("flesh_mesh_parents *"), wanted.astype(np.uint8)
        try:
            made, out = ffi.new("flesh_mesh **"), pointer(times, "uint8_t")
            call(lib.flesh_mesh_refine_marked, self._pointer, out, made, raw)
            parents = MeshParents(view(raw.tet, (raw.tets,), "int", None).copy(),
                                  view(raw.node_tet, (raw.nodes,), "int", None).copy(),
                                  view(raw.place, (raw.nodes, 4), "double", None).copy())
        finally:
            lib.flesh_mesh_parents_clear(raw)
        return self._of(made[0]), parents

    def transfer(self, parents: MeshParents, field) -> np.ndarray:
        """Transfers `field` [nodes, ...] to the refined mesh with these parents, by the shape functions of this mesh."""
        width = max(int(np.size(field)) // self.node_count, 1)
        values = doubles(np.reshape(field, (-1, width)), (self.node_count, width), "field")
        tet, node_tet = integers(parents.tet, (None,), "tet"), integers(parents.node_tet, (None,), "node_tet")
        place, finer = doubles(parents.place, (len(node_tet), 4), "place"), np.empty((len(node_tet), width))
        raw = ffi.new("flesh_mesh_parents *", {"nodes": len(node_tet), "tets": len(tet), "tet": pointer(tet, "int"),
                                               "node_tet": pointer(node_tet, "int"), "place": pointer(place)})
        call(lib.flesh_mesh_transfer, self._pointer, raw, width, pointer(values), pointer(finer))
        return finer.reshape((len(node_tet),) + np.shape(field)[1:])

    @property
    def node_count(self) -> int:
        """Number of nodes."""
        return lib.flesh_mesh_node_count(self._pointer)

    @property
    def tet_count(self) -> int:
        """Number of tets."""
        return lib.flesh_mesh_tet_count(self._pointer)

    @property
    def order(self) -> int:
        """1: four-node tets; 2: ten-node tets, at least some."""
        return lib.flesh_mesh_order(self._pointer)

    def _view(self, address, shape, kind):
        return view(address, shape, kind, self)

    @property
    def positions(self) -> np.ndarray:
        """[nodes, 3] rest positions, m."""
        return self._view(lib.flesh_mesh_positions(self._pointer), (self.node_count, 3), "double")

    @property
    def tets(self) -> np.ndarray:
        """[tets, 4] nodes at the corners."""
        return self._view(lib.flesh_mesh_tets(self._pointer), (self.tet_count, 4), "int")

    @property
    def tet_edges(self) -> Optional[np.ndarray]:
        """[tets, 6] nodes on the edges 01, 12, 02, 03, 13, 23, -1 for four-node tets; None at order 1."""
        edges = lib.flesh_mesh_tet_edges(self._pointer)
        return self._view(edges, (self.tet_count, 6), "int") if edges else None

    @property
    def tet_nodes(self) -> np.ndarray:
        """[tets, 4] or [tets, 10] all nodes of every tet, a new array at order 2."""
        return self.tets if self.order == 1 else np.hstack((self.tets, self.tet_edges))

    @property
    def tet_curved(self) -> np.ndarray:
        """[tets] 1 if the node of one of its edges is off the edge's middle."""
        return self._view(lib.flesh_mesh_tet_curved(self._pointer), (self.tet_count,), "uint8_t")

    @property
    def regions(self) -> np.ndarray:
        """[tets] region tags."""
        return self._view(lib.flesh_mesh_regions(self._pointer), (self.tet_count,), "int")

    @property
    def tet_volumes(self) -> np.ndarray:
        """[tets] rest volumes, m^3, all positive."""
        return self._view(lib.flesh_mesh_tet_volumes(self._pointer), (self.tet_count,), "double")

    @property
    def sets(self) -> Dict[str, NamedSet]:
        """Named sets of the file from which the mesh was read, by name."""
        found = {}
        for k in range(lib.flesh_mesh_set_count(self._pointer)):
            one = lib.flesh_mesh_set_at(self._pointer, k)
            found[text(one.name)] = NamedSet(
                *(self._view(values, (count,), "int") if count else np.empty(0, np.intc)
                  for values, count in ((one.nodes, one.node_count), (one.tets, one.tet_count))))
        return found

    @property
    def surface(self) -> np.ndarray:
        """[triangles, 3] boundary triangles, outward by the right-hand rule; four for each face of a ten-node tet."""
        count = ffi.new("int *")
        corners = lib.flesh_mesh_surface(self._pointer, count)
        return self._view(corners, (count[0], 3), "int")

    @property
    def surface_tets(self) -> np.ndarray:
        """[triangles] the tet of each boundary triangle."""
        return self._view(lib.flesh_mesh_surface_tets(self._pointer), (len(self.surface),), "int")

    @property
    def node_used(self) -> np.ndarray:
        """[nodes] 1 if some tet uses the node, else 0."""
        return self._view(lib.flesh_mesh_node_used(self._pointer), (self.node_count,), "uint8_t")

    @property
    def info(self) -> MeshInfo:
        """Counts, size and quality; every call measures the whole mesh."""
        info = MeshInfo()
        lib.flesh_mesh_inspect(self._pointer, info._struct)
        return info

    def nodes_in_box(self, low, high) -> np.ndarray:
        """Returns nodes [count] with rest positions in the box from `low` [3] to `high` [3], m, its faces included."""
        x = self.positions
        return np.flatnonzero(((x >= np.asarray(low)) & (x <= np.asarray(high))).all(axis=1)).astype(np.intc)

    def _at(self, x):
        return doubles(x, (self.node_count, 3), "x")

    def volume(self, x) -> float:
        """Returns the sum of the signed volumes of the tets, m^3, with the nodes at `x` [nodes, 3]."""
        return lib.flesh_mesh_volume(self._pointer, pointer(self._at(x)))

    def _jacobians(self, function, x):
        J = np.empty(self.tet_count)
        worst, not_positive = ffi.new("int *"), ffi.new("int *")
        least = function(self._pointer, pointer(self._at(x)), pointer(J), worst, not_positive)
        return Jacobians(J, least, worst[0], not_positive[0])

    def jacobians(self, x) -> Jacobians:
        """Returns the smallest J = det F at a quadrature point of every tet, with the nodes at `x` [nodes, 3]."""
        return self._jacobians(lib.flesh_mesh_jacobians, x)

    def jacobian_bounds(self, x) -> Jacobians:
        """Returns a lower bound of J = det F anywhere in every tet; J itself for four-node tets."""
        return self._jacobians(lib.flesh_mesh_jacobian_bounds, x)

    def mean_jacobians(self, x) -> np.ndarray:
        """Returns the mean of J = det F over the quadrature points of every tet, [tets]."""
        J = np.empty(self.tet_count)
        lib.flesh_mesh_mean_jacobians(self._pointer, pointer(self._at(x)), pointer(J))
        return J

    def _densities(self, density):
        return doubles(density if np.ndim(density) else np.full(self.tet_count, density), (self.tet_count,), "density")

    def lumped_mass(self, density) -> np.ndarray:
        """Returns the lumped mass [nodes], kg, for a density [tets] or one for all, kg/m^3."""
        mass = np.empty(self.node_count)
        lib.flesh_mesh_lumped_mass(self._pointer, pointer(self._densities(density)), pointer(mass))
        return mass

    def consistent_mass_times(self, density, x) -> np.ndarray:
        """Returns M x [nodes, 3] with the consistent mass for a density [tets] or one for all, kg/m^3; x [nodes, 3]."""
        y = np.empty((self.node_count, 3))
        lib.flesh_mesh_consistent_mass_times(self._pointer, pointer(self._densities(density)), pointer(self._at(x)),
                                             pointer(y))
        return y

    def __repr__(self):
        return f"<flesh.Mesh of order {self.order}: {self.node_count} nodes, {self.tet_count} tets>"
