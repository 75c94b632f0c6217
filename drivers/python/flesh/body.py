"""body.py: bodies: mesh, materials and densities."""
from typing import Optional

import numpy as np

from ._arrays import Names, integers, pointer, view
from ._callbacks import Const, call
from ._library import ffi, lib, text
from .errors import ArgumentError
from .material import Material
from .mesh import Mesh

__all__ = ["Body", "INSTRUCTIONS", "usable_instructions"]

_MASSES = Names("flesh_mass", "FLESH_MASS_")
_ELEMENTS = Names("flesh_element", "FLESH_ELEMENT_", lib.flesh_element_name)
_INSTRUCTIONS = Names("flesh_instructions", "FLESH_INSTRUCTIONS_", lib.flesh_instructions_name)

INSTRUCTIONS = tuple(_INSTRUCTIONS.words)
"""Sets of vector instructions that elements and linear solvers know."""


def usable_instructions(asked: str = "auto") -> str:
    """Returns the instructions that this machine runs when `asked` for: "auto" becomes the best. ArgumentError if it
    lacks them."""
    out = ffi.new("flesh_instructions *")
    call(lib.flesh_instructions_find, _INSTRUCTIONS.value(asked, "instructions"), out)
    return _INSTRUCTIONS.word(out[0])


class Body(Const):
    """A body: its mesh, materials and densities. The effects made from it keep it alive.

    Args:
        mesh: the body's mesh.
        material: one for all tets, a list of materials, or None for a body without elasticity.
        density: [tets] or one for all, kg/m^3, > 0; copied.
        tet_material: [tets] indices into the list of materials; copied; None: all tets have the first.
        mass: "lumped" or "consistent".
        element: "auto", "tet4", "tet10" or "tet10-mean".
        instructions: vector instructions, "auto": the best that this machine has.
    """

    def __init__(self, mesh: Mesh, material=None, density=1000.0, *, tet_material=None, mass: str = "lumped",
                 element: str = "auto", instructions: str = "auto"):
        self.mesh = mesh
        self.materials = [] if material is None else list(material) if np.iterable(material) else [material]
        for one in self.materials:
            if not isinstance(one, Material):
                raise TypeError(f"material is or has {one!r}; it must be of class Material")
        density = pointer(mesh._densities(density).copy())
        if tet_material is not None:
            tet_material = integers(tet_material, (mesh.tet_count,), "tet_material").copy()
            if not len(self.materials) > tet_material.max() >= tet_material.min() >= 0:
                raise ArgumentError(f"tet_material must be 0 to {len(self.materials) - 1}")
        indices = pointer(tet_material, "int")
        rows = ffi.new("flesh_material[]", max(len(self.materials), 1))
        for k, one in enumerate(self.materials):
            rows[k] = one._struct[0]
        # Objects to which the struct points: its own copies, and objects whose attributes callers may still change.
        self._keep = (mesh, tuple(self.materials), density, indices, rows)
        self._struct = ffi.new("flesh_body *")
        self._struct.mesh, self._struct.density, self._struct.tet_material = mesh._pointer, density, indices
        self._struct.materials = rows if self.materials else ffi.NULL
        self._struct.mass = _MASSES.value(mass, "mass")
        self._struct.element = _ELEMENTS.value(element, "element")
        self._struct.instructions = _INSTRUCTIONS.value(instructions, "instructions")

    @classmethod
    def _of(cls, struct, mesh, materials, owner):
        """Wraps a body that belongs to `owner`."""
        made = cls.__new__(cls)
        made._struct, made.mesh, made.materials, made._owner = struct, mesh, materials, owner
        return made

    @property
    def density(self) -> np.ndarray:
        """[tets] kg/m^3."""
        return view(self._struct.density, (self.mesh.tet_count,), "double", self)

    @property
    def tet_material(self) -> Optional[np.ndarray]:
        """[tets] indices into `materials`; None: all tets have the first."""
        indices = self._struct.tet_material
        return view(indices, (self.mesh.tet_count,), "int", self) if indices else None

    @property
    def mass(self) -> str:
        """"lumped" or "consistent"."""
        return _MASSES.word(self._struct.mass)

    @property
    def element(self) -> str:
        """"auto", "tet4", "tet10" or "tet10-mean"."""
        return _ELEMENTS.word(self._struct.element)

    @property
    def instructions(self) -> str:
        """Vector instructions that were requested."""
        return _INSTRUCTIONS.word(self._struct.instructions)

    @property
    def parts(self):
        """List of the bodies that share the mesh, (name, first tet, tets); empty for one body without a name."""
        parts = self._struct.parts
        return [(text(parts[k].name), parts[k].first_tet, parts[k].tets) for k in range(self._struct.part_count)]
