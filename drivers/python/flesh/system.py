"""system.py: the sum of the effects on a body with its constraints, evaluated at a point; states."""
import threading
from typing import TYPE_CHECKING, List, NamedTuple, Tuple

import numpy as np

from ._arrays import Names, doubles, integers, pointer, view
from ._callbacks import Handle, call, call_value, create, owned
from ._library import ffi, lib, path_bytes
from .effects import Effect, _ROLES
from .errors import ArgumentError
from .mesh import Mesh
from .motion import Motion
from .point import Point, Shift

if TYPE_CHECKING:
    import scipy.sparse

__all__ = ["State", "Potential", "PrescribedMotion", "System"]


class State:
    """Position and motion of a body: a time and two arrays, which steps change in place.

    Args:
        x: [nodes, 3] positions, m; copied.
        v: [nodes, 3] velocities, m/s; None: at rest.
        t: s.
        multipliers: [System.multiplier_count] pressures of incompressible tets, Pa; None: the integrator keeps its own.
        internal: [System.internal_count] internal variables of effects (for example, broken parts); None: likewise.
    """

    def __init__(self, x, v=None, t: float = 0.0, multipliers=None, internal=None):
        self.x = doubles(x, (None, 3), "x").copy()
        self.v = np.zeros_like(self.x) if v is None else doubles(v, self.x.shape, "v").copy()
        self._struct = ffi.new("flesh_state *", {"t": float(t)})
        self.multipliers = None if multipliers is None else doubles(multipliers, (None,), "multipliers").copy()
        self.internal = None if internal is None else doubles(internal, (None,), "internal").copy()
        self._point_to_arrays()

    def _point_to_arrays(self):
        """Points the struct to the arrays of the attributes, and keeps the arrays until it points to others."""
        names = ("x", "v", "multipliers", "internal")
        self._shown = [pointer(getattr(self, name)) for name in names]
        for name, address in zip(names, self._shown):
            setattr(self._struct, name, address)
        self._struct.multiplier_count = 0 if self.multipliers is None else len(self.multipliers)
        self._struct.internal_count = 0 if self.internal is None else len(self.internal)

    @property
    def t(self) -> float:
        """Time, s."""
        return self._struct.t

    @t.setter
    def t(self, value: float):
        self._struct.t = value

    @classmethod
    def at_rest(cls, mesh: Mesh) -> "State":
        """The mesh's shape, without velocity, at t = 0."""
        return cls(mesh.positions)

    @classmethod
    def read(cls, path, nodes: int, multipliers: int = 0, internal: int = 0) -> "State":
        """Reads a state file (rows `x y z vx vy vz`) of `nodes` nodes.

        It also reads as many multipliers and internal variables as are asked for."""
        state = cls(np.zeros((nodes, 3)), multipliers=np.zeros(multipliers) if multipliers else None,
                    internal=np.zeros(internal) if internal else None)
        call(lib.flesh_state_read, path_bytes(path), nodes, state._struct)
        return state

    def write(self, path) -> None:
        """Writes a state file, which reads back bitwise; NonFiniteError, nothing written, for a NaN or infinity."""
        call(lib.flesh_state_write, path_bytes(path), len(self.x), self._checked(len(self.x)))

    def copy(self) -> "State":
        """Returns an independent copy, as copy.copy, copy.deepcopy and pickle do."""
        return State(self.x, self.v, self.t, self.multipliers, self.internal)

    def __reduce__(self):
        return State, (self.x, self.v, self.t, self.multipliers, self.internal)

    def _checked(self, nodes):
        """Returns the struct with the arrays of the attributes, which may have been replaced."""
        for name in "xv":
            array = getattr(self, name)
            if not isinstance(array, np.ndarray) or array.dtype != np.float64 or array.shape != (nodes, 3) or \
                    not array.flags.c_contiguous or not array.flags.writeable:
                raise ArgumentError(f"state.{name} must be a writable, contiguous array of doubles of shape "
                                    f"({nodes}, 3)")
        if self.multipliers is not None:
            self.multipliers = doubles(self.multipliers, (None,), "state.multipliers")
        if self.internal is not None:
            self.internal = doubles(self.internal, (None,), "state.internal")
        self._point_to_arrays()
        return self._struct

    def __repr__(self):
        return f"<flesh.State of {len(self.x)} nodes at t = {self.t:g} s>"


class Potential(NamedTuple):
    """A potential, J."""
    value: float
    magnitude: float  # sum of the absolute values of its terms, against which rounding is measured


class PrescribedMotion(NamedTuple):
    """Prescribed velocities and accelerations of constrained dofs; 0 elsewhere."""
    velocity: np.ndarray  # [nodes, 3] m/s
    acceleration: np.ndarray  # [nodes, 3] m/s^2


def _axes(axes):
    if isinstance(axes, str) and axes and set(axes) <= set("xyz"):
        return sum(getattr(lib, f"FLESH_AXIS_{letter.upper()}") for letter in set(axes))
    raise ArgumentError(f"axes is {axes!r}; it must be some of 'xyz'")


class System(Handle):
    """The sum of effects on a body, and its constraints. Const once finished, so that several runs can share it.

    It takes ownership of added effects. The first evaluation or integrator finishes it; then nothing can be added.

    Args:
        mesh: the mesh whose nodes are the unknowns.
        effects: added in this order.
    """

    def __init__(self, mesh: Mesh, effects=()):
        self._mesh = mesh
        self._pointer = owned("flesh_system", create("flesh_system", lib.flesh_system_create, mesh._pointer),
                              lib.flesh_system_destroy, mesh, self)
        self._keep: List = []
        self._finished, self._finishing = False, threading.Lock()
        for effect in effects:
            self.add(effect)

    @classmethod
    def _of(cls, pointer_, owner):
        """Wraps a finished system that belongs to `owner`."""
        made = cls.__new__(cls)
        made._pointer, made._keep, made._life = pointer_, [owner], owner._life
        made._finished, made._finishing = True, threading.Lock()
        made._mesh = Mesh._of(lib.flesh_system_mesh(pointer_), owner)
        return made

    @property
    def mesh(self) -> Mesh:
        """The mesh whose nodes are the unknowns."""
        return self._mesh

    def add(self, effect: Effect) -> "System":
        """Adds an effect and takes ownership of it; returns the system."""
        if self._finished:
            raise ArgumentError(f"the system is finished; {effect.name} must be added before it is used")
        call(lib.flesh_system_add_effect, self._pointer, effect._give(self))
        effect._own = lib.flesh_system_effect(self._pointer, self.effect_count - 1)
        self._keep.append(effect._keep)
        return self

    def pin(self, nodes, axes: str = "xyz", start: float = -np.inf, until: float = np.inf) -> "System":
        """Constrains `axes` of `nodes` [count] to their rest positions while start <= t < until; returns the system."""
        chosen = integers(nodes, (None,), "nodes")
        call(lib.flesh_system_add_pin, self._pointer, len(chosen), pointer(chosen, "int"), _axes(axes), float(start),
             float(until))
        return self

    def prescribe(self, nodes, motion: Motion, axes: str = "xyz", start: float = -np.inf,
                  until: float = np.inf) -> "System":
        """Makes `nodes` [count] follow a motion along `axes` while start <= t < until; returns the system."""
        chosen = integers(nodes, (None,), "nodes")
        call(lib.flesh_system_add_prescribed_motion, self._pointer, len(chosen), pointer(chosen, "int"), _axes(axes),
             motion._struct, float(start), float(until))
        return self

    def finalize(self) -> "System":
        """Builds the Jacobian's pattern; nothing can be added afterwards. Returns the system."""
        with self._finishing:  # threads that share the system may call this at the same time
            if not self._finished:
                call(lib.flesh_system_finalize, self._pointer)
                self._finished = True
        return self

    def _ready(self):
        return self.finalize()._pointer

    @property
    def unknowns(self) -> int:
        """3 * nodes."""
        return lib.flesh_system_unknowns(self._pointer)

    @property
    def effect_count(self) -> int:
        """Number of effects."""
        return lib.flesh_system_effect_count(self._pointer)

    @property
    def effects(self) -> List[Effect]:
        """The effects in their order."""
        return [Effect._of(lib.flesh_system_effect(self._pointer, k), self) for k in range(self.effect_count)]

    @property
    def instructions(self) -> str:
        """Vector instructions that the effects and linear solvers use."""
        return Names("flesh_instructions", "FLESH_INSTRUCTIONS_", lib.flesh_instructions_name).word(
            lib.flesh_system_instructions(self._ready()))

    def has_role(self, role: str) -> bool:
        """Returns whether an effect of that role is present."""
        return bool(lib.flesh_system_has_role(self._pointer, _ROLES.value(role, "role")))

    @property
    def moves(self) -> bool:
        """Whether prescribed positions or effects change with time."""
        return bool(lib.flesh_system_moves(self._ready()))

    def next_event(self, t: float) -> float:
        """Returns the first time after t s at which a constraint or effect is not smooth; inf if there is none."""
        return call_value(lib.flesh_system_next_event, self._ready(), float(t))

    @property
    def multiplier_count(self) -> int:
        """Number of pressures that keep tets' volumes: one per tet, or 0 if none is incompressible."""
        return lib.flesh_system_multiplier_count(self._ready())

    @property
    def internal_count(self) -> int:
        """Number of internal variables of all effects together."""
        return lib.flesh_system_internal_count(self._ready())

    def update_internal(self, x, v=None, a=None, **point) -> Tuple[np.ndarray, bool]:
        """Returns the internal variables after a step that ends at the point, and whether forces or energies change.

        point.internal are those within the step."""
        at, changed = self._point(x, v, a, point), ffi.new("int *")
        internal = np.zeros(self.internal_count) if at._internal is None else at._internal.copy()
        call(lib.flesh_system_update_internal, self._ready(), at._struct, pointer(internal), changed)
        return internal, bool(changed[0])

    def _point(self, x, v, a, options):
        point = x if isinstance(x, Point) else Point(x, v, a, **options)
        if point._multipliers is not None and len(point._multipliers) != self.multiplier_count:
            raise ArgumentError(f"multipliers has {len(point._multipliers)} values; there are {self.multiplier_count}")
        if point._internal is not None and len(point._internal) != self.internal_count:
            raise ArgumentError(f"internal has {len(point._internal)} values; there are {self.internal_count}")
        if point._nodes != self.mesh.node_count:
            raise ArgumentError(f"x has shape ({point._nodes}, 3); it must be ({self.mesh.node_count}, 3)")
        return point

    def residual(self, x, v=None, a=None, **point) -> np.ndarray:
        """Returns r [nodes, 3], N: the sum of the residuals, constraints not applied.

        x is a Point, or positions [nodes, 3] with v, a and the other arguments of Point.
        """
        at, r = self._point(x, v, a, point), np.zeros((self.mesh.node_count, 3))
        call(lib.flesh_system_residual, self._ready(), at._struct, pointer(r))
        return r

    def load(self, x, v=None, a=None, **point) -> np.ndarray:
        """Returns the residual of the external effects alone [nodes, 3], N, which is minus the applied load."""
        at, r = self._point(x, v, a, point), np.zeros((self.mesh.node_count, 3))
        call(lib.flesh_system_load, self._ready(), at._struct, pointer(r))
        return r

    def jacobian(self, x, v=None, a=None, *, shift: Shift = Shift(), **point) -> "scipy.sparse.csr_matrix":
        """Returns shift.x dr/dx + shift.v dr/dv + shift.a dr/da, N/m, a scipy.sparse.csr_matrix [3*nodes, 3*nodes].

        Constraints are not applied: `free` names the dofs to solve for.
        """
        at = self._point(x, v, a, point)
        matrix = create("flesh_block_matrix", lib.flesh_system_matrix_create, self._ready())
        matrix = owned("flesh_block_matrix", matrix, lib.flesh_block_matrix_destroy)
        call(lib.flesh_system_jacobian, self._ready(), at._struct, Shift(*shift)._struct(), matrix)
        return _sparse(matrix)

    def potential(self, x, v=None, a=None, *, shift: Shift = Shift(), **point) -> Potential:
        """Returns phi, J, whose change is r . du for a change du of the unknown."""
        at, out = self._point(x, v, a, point), ffi.new("double[2]")
        call(lib.flesh_system_potential, self._ready(), at._struct, Shift(*shift)._struct(), out, out + 1)
        return Potential(*out)

    def energies(self, x, v=None, a=None, **point) -> np.ndarray:
        """Returns the physical energy of every effect [effects], J."""
        at, out = self._point(x, v, a, point), np.zeros(self.effect_count)
        call(lib.flesh_system_energies, self._ready(), at._struct, pointer(out))
        return out

    def check(self, x, t: float = 0.0) -> None:
        """Raises ArgumentError, with the node, if an effect does not allow the body to be at x [nodes, 3]."""
        call(lib.flesh_system_check, self._ready(), float(t), pointer(doubles(x, (self.mesh.node_count, 3), "x")))

    def fixed(self, t: float = 0.0) -> np.ndarray:
        """Returns [nodes, 3], True for the dofs constrained at t s, and for those of nodes that no tet uses."""
        out = np.zeros((self.mesh.node_count, 3), np.uint8)
        lib.flesh_system_fixed(self._ready(), float(t), pointer(out, "uint8_t"))
        return out.astype(bool)

    def free(self, t: float = 0.0) -> np.ndarray:
        """Returns the numbers of the dofs that are not constrained at t s: indices into r.ravel()."""
        return np.flatnonzero(~self.fixed(t))

    def prescribe_positions(self, x, t: float = 0.0) -> np.ndarray:
        """Returns a copy of x [nodes, 3] with the constrained components at their prescribed positions at t s."""
        out = doubles(x, (self.mesh.node_count, 3), "x").copy()
        lib.flesh_system_prescribe(self._ready(), float(t), pointer(out))
        return out

    def prescribed_motion(self, t: float = 0.0) -> PrescribedMotion:
        """Returns the prescribed velocities and accelerations [nodes, 3] at t s; 0 for free components."""
        v, a = np.zeros((self.mesh.node_count, 3)), np.zeros((self.mesh.node_count, 3))
        lib.flesh_system_prescribe_velocity(self._ready(), float(t), pointer(v), pointer(a))
        return PrescribedMotion(v, a)

    def __repr__(self):
        names = ", ".join(effect.name for effect in self.effects)
        return f"<flesh.System of {self.mesh.node_count} nodes: {names}>"


def _sparse(matrix):
    """Returns the whole matrix from the blocks of its upper triangle, whose rows have an order of their own."""
    from scipy import sparse
    rows, blocks = matrix.rows, matrix.row_start[matrix.rows]
    start = view(matrix.row_start, (rows,), "int", matrix).astype(np.int64)
    count = view(matrix.row_end, (rows,), "int", matrix) - start
    places = np.repeat(start - (np.cumsum(count) - count), count) + np.arange(count.sum())
    columns = view(matrix.column, (blocks,), "int", matrix)[places]
    values = view(matrix.values, (blocks, 3, 3), "double", matrix)[places]
    indptr = np.concatenate(([0], np.cumsum(count)))
    upper = sparse.bsr_matrix((values, columns, indptr), shape=(3 * rows, 3 * rows)).tocsr()
    above = sparse.triu(upper, 1, format="csr")
    # The blocks on the diagonal are stored whole; of their two halves the upper one stands for both.
    whole = (sparse.triu(upper, format="csr") + above.T).tocsr()
    whole.sort_indices()
    return whole
