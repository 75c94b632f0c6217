"""surface.py: surfaces of polygons, and skins: fine surfaces that follow a body's coarse tets."""
import numpy as np

from ._arrays import Field, Record, doubles, integers, pointer, view
from ._callbacks import Const, call, create, owned
from ._library import ffi, lib, path_bytes
from .mesh import Mesh

__all__ = ["Surface", "Skin", "SkinInfo"]


class Surface(Const):
    """A surface of polygons; const once made.

    Args:
        positions: [vertices, 3] m.
        faces: [faces, 3] triangles, or a list of faces, each a list of any number of vertices.
    """

    def __init__(self, positions, faces):
        x = doubles(positions, (None, 3), "positions")
        starts = np.zeros(len(faces) + 1, dtype=np.intc)
        starts[1:] = np.cumsum([len(face) for face in faces])
        corners = integers([corner for face in faces for corner in face], (int(starts[-1]),), "faces")
        self._take(create("flesh_surface", lib.flesh_surface_create, len(x), pointer(x), len(faces),
                          pointer(starts, "int"), pointer(corners, "int")))

    def _take(self, made):
        self._pointer = owned("flesh_surface", made, lib.flesh_surface_destroy)
        return self

    @classmethod
    def read(cls, path) -> "Surface":
        """Reads Wavefront .obj, Stanford .ply or .stl, recognised by content."""
        return cls.__new__(cls)._take(create("flesh_surface", lib.flesh_surface_read, path_bytes(path)))

    @classmethod
    def of_mesh(cls, mesh: Mesh) -> "Surface":
        """Makes a surface of the boundary triangles of a mesh and the nodes that they use."""
        return cls.__new__(cls)._take(create("flesh_surface", lib.flesh_surface_of_mesh, mesh._pointer))

    def write(self, path, x=None) -> None:
        """Writes .obj or .ply by the suffix with the vertices at `x` [vertices, 3] m (None: at their own positions)."""
        at = None if x is None else doubles(x, (self.vertex_count, 3), "x")
        call(lib.flesh_surface_write, self._pointer, pointer(at), path_bytes(path))

    @property
    def vertex_count(self) -> int:
        """Number of vertices."""
        return lib.flesh_surface_vertex_count(self._pointer)

    @property
    def face_count(self) -> int:
        """Number of faces."""
        return lib.flesh_surface_face_count(self._pointer)

    @property
    def positions(self) -> np.ndarray:
        """[vertices, 3] m."""
        return view(lib.flesh_surface_positions(self._pointer), (self.vertex_count, 3), "double", self)

    @property
    def starts(self) -> np.ndarray:
        """[faces + 1] index in `corners` at which the corners of each face begin."""
        return view(lib.flesh_surface_starts(self._pointer), (self.face_count + 1,), "int", self)

    @property
    def corners(self) -> np.ndarray:
        """[starts[-1]] vertices of all faces in a row."""
        return view(lib.flesh_surface_corners(self._pointer), (int(self.starts[-1]),), "int", self)

    @property
    def triangles(self) -> np.ndarray:
        """[triangles, 3] the faces divided into triangles with the same winding."""
        count = ffi.new("int *")
        corners = lib.flesh_surface_triangles(self._pointer, count)
        return view(corners, (count[0], 3), "int", self)

    def __repr__(self):
        return f"<flesh.Surface: {self.vertex_count} vertices, {self.face_count} faces>"


class SkinInfo(Record):
    """Quality of a skin's binding."""
    _ctype = "flesh_skin_info"
    vertices: int = Field("number of vertices")
    outside: int = Field("vertices outside all tets")
    distance_max: float = Field("largest distance of a vertex from the tets, m; 0 when all lie inside")
    farthest: int = Field("the vertex with distance_max; -1 when all lie inside")
    weight_min: float = Field("smallest weight: far below 0 the extrapolation is rough")


class Skin(Const):
    """A surface bound to a mesh at rest, so that it follows the body.

    Raises:
        FileError: a vertex so far outside curved tets that none of them can be continued to it.
    """

    def __init__(self, mesh: Mesh, surface: Surface):
        self._take(create("flesh_skin", lib.flesh_skin_bind, mesh._pointer, surface._pointer), mesh)

    def _take(self, made, mesh):
        self._pointer = owned("flesh_skin", made, lib.flesh_skin_destroy)
        self._nodes, self.order = mesh.node_count, mesh.order
        return self

    @classmethod
    def read(cls, path, mesh: Mesh, surface: Surface) -> "Skin":
        """Reads a binding that `write` made for this mesh and surface."""
        return cls.__new__(cls)._take(create("flesh_skin", lib.flesh_skin_read, path_bytes(path), mesh._pointer,
                                             surface._pointer), mesh)

    def write(self, path) -> None:
        """Writes the binding as text that reads back bitwise the same."""
        call(lib.flesh_skin_write, self._pointer, path_bytes(path))

    @property
    def info(self) -> SkinInfo:
        """Quality of the binding."""
        info = SkinInfo()
        lib.flesh_skin_inspect(self._pointer, info._struct)
        return info

    @property
    def tets(self) -> np.ndarray:
        """[vertices] the tet to which each vertex is bound."""
        return view(lib.flesh_skin_tets(self._pointer), (self.info.vertices,), "int", self)

    @property
    def weights(self) -> np.ndarray:
        """[vertices, 4] weights of the tet's corners, or at order 2 barycentric coordinates."""
        return view(lib.flesh_skin_weights(self._pointer), (self.info.vertices, 4), "double", self)

    def apply(self, nodal, clamp=False) -> np.ndarray:
        """Computes values at the skin's vertices from those at the nodes.

        Args:
            nodal: [nodes, components] or [nodes]: positions, velocities, a scalar field.
            clamp: keep weights in [0, 1], so that a field never leaves its range.

        Returns:
            [vertices, components] or [vertices].
        """
        shape = np.shape(nodal)
        components = 1 if len(shape) == 1 else shape[-1]
        values = doubles(nodal, (self._nodes, components) if len(shape) > 1 else (self._nodes,), "nodal")
        skinned = np.empty((self.info.vertices,) + values.shape[1:])
        lib.flesh_skin_apply(self._pointer, components, int(clamp), pointer(values), pointer(skinned))
        return skinned
