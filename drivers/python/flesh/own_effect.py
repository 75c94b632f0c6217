"""own_effect.py: effects written in Python."""
import numpy as np

from . import _callbacks
from ._arrays import doubles, integers, made_by_library, pointer, view
from ._callbacks import create
from ._library import ffi, lib
from .effects import Effect, _ROLES
from .errors import ArgumentError
from .mesh import Mesh
from .options import FILTERS
from .point import Frozen, Lagged, Shift

__all__ = ["OwnEffect", "PointView"]


class PointView:
    """The point at which an effect is evaluated. Its arrays are valid during the call: copy them to keep them.

    Attributes:
        t, load: s; the factor of external loads.
        x, v, a: [nodes, 3] m, m/s, m/s^2.
        lagged: a Lagged, the state at which the forces last balanced.
        frozen: a Frozen, the state at which terms without a potential are frozen.
        internal: [internal_count] the effect's internal variables.
    """
    __slots__ = ("t", "load", "x", "v", "a", "lagged", "frozen", "internal")

    def __init__(self, point, nodes, internal_count=0):
        made_by_library(point, "PointView")
        self.internal = view(point.internal, (internal_count,), "double", None) if point.internal else \
            np.zeros(internal_count)
        self.t, self.load = point.t, point.load
        self.x, self.v, self.a = (self._vectors(address, nodes) for address in (point.x, point.v, point.a))
        self.lagged = Lagged(point.lagged.t, self._vectors(point.lagged.x, nodes), self._vectors(point.lagged.v, nodes))
        self.frozen = Frozen(self._vectors(point.frozen.x, nodes), self._vectors(point.frozen.v, nodes))

    @staticmethod
    def _vectors(address, nodes):
        return view(address, (nodes, 3), "double", None) if address else None


# Traits by their Python names.
_TRAITS = {"passive": "FLESH_IS_PASSIVE", "is_follower_load": "FLESH_IS_FOLLOWER_LOAD", "freezes": "FLESH_FREEZES",
           "depends_on_position_only": "FLESH_DEPENDS_ON_POSITION_ONLY",
           "is_sum_over_tets": "FLESH_IS_SUM_OVER_TETS"}

# Operations that a class may define, by their table in the library.
_CORE = ("residual", "jacobian", "potential", "energy")
_TIME = ("next_event", "carry")
_BARRIER = ("max_feasible_step", "push_out", "tunnelled", "check", "clearance", "approach")
_INTERNAL = ("count", "update", "tell")


def _member_type(struct, name):
    return next(field.type for member, field in ffi.typeof(struct).item.fields if member == name)


class OwnEffect(Effect):
    """Base of effects of your own: derive from it, define `residual` and other operations, and add it to a system.

        class Wind(flesh.OwnEffect):
            name, role = "wind", "load"
            def residual(self, point):
                return -point.load * self.force          # [nodes, 3] N: a gradient, not a force
            def potential(self, point, shift):
                return -point.load * self.force * point.x / shift.x   # its terms; they are summed

    A derived class may define, beside `residual`:

        jacobian(self, point, shift): for every cell the matrix [count, 3k, 3k], N/m: shift.x dr/dx + shift.v dr/dv +
            shift.a dr/da of its k nodes, symmetric; without `cells` the diagonal blocks [nodes, 3, 3]
        potential(self, point, shift): phi with d phi = r . du, J, or an array of terms that are summed
        energy(self, point): the physical energy, J
        next_event(self, t): first time after t at which the effect is not smooth, s. An effect that changes with time
            must have one, for example 0 for t < 0; without one it is constant, and statics finds one equilibrium
        carry(self, point, t_from, t_to): [nodes, 3] m, displacement of a moving obstacle or the like; None: no motion
        max_feasible_step(self, t_from, x_from, t_to, x_to): the fraction of a straight step that is feasible
        push_out(self, t_from, x_from, t_to, x_to): x_to [nodes, 3] with those nodes moved that cannot be reached
        tunnelled(self, t_from, x_from, t_to, x_to): whether the body must have gone through something
        check(self, t, x): raises ArgumentError if the body cannot be at x
        clearance(self, t, x): lower bound of the body's distance beyond the effect's reach, m
        approach(self, t_from, t_to, low, high): upper bound of the obstacle's displacement anywhere in a box, m
        report(self, point): a number for each of `report_names`
        stress(self, t, tet, F): if the force is that of a stress in the tets, a function of shape and time: the
            Kirchhoff stress J sigma [3, 3], Pa, at a place of a tet with the deformation gradient F [3, 3]; frames and
            probes add it to the elastic one
        update(self, point): the new internal variables [internal_count] at the end of an accepted step;
            point.internal are those within the step
        tell(self, internal): a sentence about the internal variables at a run's end, "" for none

    If an operation raises UndefinedError or NonFiniteError, the library tries a shorter step. Any other exception ends
    the call, which raises it. Operations are called in the thread that steps, with the interpreter's lock.

    Class attributes: `name`; `role`, one of flesh.ROLES; `passive`, `is_follower_load`, `freezes`,
    `depends_on_position_only` (see include/flesh/effect.h); `report_names`, columns of histories;
    `internal_count`, the number of internal variables, which are 0 at first and constant within a step.

    Args:
        mesh: the body's mesh.
        cells: [count, k] nodes that the Jacobian couples; None: only diagonal blocks.
    """
    name: str = "own"
    role: str = "other"
    passive = is_follower_load = freezes = depends_on_position_only = is_sum_over_tets = False
    report_names = ()
    internal_count = 0

    def __init__(self, mesh: Mesh, cells=None):
        self.mesh = mesh
        self._nodes = mesh.node_count
        self._alive = []
        operations = self._table = ffi.new("flesh_effect_operations *")
        operations.name = self._hold(self._word("name", self.name))
        operations.role = _ROLES.value(self.role, "role")
        operations.traits = sum(getattr(lib, trait) for name, trait in _TRAITS.items() if getattr(self, name))
        if cells is not None:
            self._set_cells(cells)
        if not self._defines("residual"):
            raise ArgumentError(f"{type(self).__name__} has no method residual; an effect must have one")
        for name in _CORE:
            self._set(operations, name)
        for table, names in (("time", _TIME), ("barrier", _BARRIER)):
            if any(self._defines(name) for name in names):
                part = self._hold(ffi.new(f"flesh_effect_{table} *"))
                for name in names:
                    self._set(part, name)
                setattr(operations, table, part)
        if not isinstance(self.internal_count, (int, np.integer)) or self.internal_count < 0:
            raise ArgumentError(f"{type(self).__name__}.internal_count is {self.internal_count!r}; it must be a count")
        if isinstance(self.report_names, str):
            raise ArgumentError(f"{type(self).__name__}.report_names is {self.report_names!r}; "
                                "it must be a list of texts")
        self._internals, self._reports = int(self.internal_count), len(self.report_names)
        if self._internals:
            if not self._defines("update"):
                raise ArgumentError(f"{type(self).__name__} has internal variables, but no method update")
            part = operations.internal = self._hold(ffi.new("flesh_effect_internal *"))
            for name in _INTERNAL:
                if name == "count" or self._defines(name):
                    make = _callbacks.status_callback if name == "update" else _callbacks.value_callback
                    setattr(part, name, self._hold(make(_member_type(part, name), getattr(self, f"_call_{name}"))))
        if self.report_names or self._defines("stress"):
            self._set_figures(operations)
        made = create("flesh_effect", lib.flesh_effect_create, operations, mesh._pointer, ffi.NULL)
        self._take(made, self._alive, operations)

    def _defines(self, name):
        return callable(getattr(self, name, None))

    def _word(self, attribute, value):
        if not isinstance(value, str):
            raise ArgumentError(f"{type(self).__name__}.{attribute} has {value!r}; it must be a text")
        return ffi.new("char[]", value.encode())

    def _hold(self, thing):
        self._alive.append(thing)
        return thing

    def _set(self, table, name):
        if self._defines(name):
            returns_status = name in _CORE or name == "check"
            make = _callbacks.status_callback if returns_status else _callbacks.value_callback
            setattr(table, name, self._hold(make(_member_type(table, name), getattr(self, f"_call_{name}"))))

    def _set_figures(self, operations):
        part = operations.figures = self._hold(ffi.new("flesh_effect_figures *"))
        if self.report_names:
            names = self._hold([self._word("report_names", name) for name in self.report_names] + [ffi.NULL])
            part.report_names = self._hold(ffi.new("char *[]", names))
            part.report = self._hold(_callbacks.value_callback(_member_type(part, "report"), self._call_report))
        self._set(part, "stress")

    def _set_cells(self, cells):
        self._width = np.shape(cells)[-1] if np.ndim(cells) == 2 else 0
        nodes = integers(cells, (None, self._width), "cells")
        if not nodes.size or nodes.min() < 0 or nodes.max() >= self._nodes:
            raise ArgumentError(f"cells must be [count, k] node numbers from 0 to {self._nodes - 1}")
        # The library's cells have ascending nodes; the class's matrices have the order of its cells.
        self._order = np.argsort(nodes, axis=1, kind="stable")
        self._cell_nodes = np.ascontiguousarray(np.take_along_axis(nodes, self._order, 1))
        if (np.diff(self._cell_nodes, axis=1) == 0).any():
            raise ArgumentError("a cell names a node twice")
        struct = self._hold(ffi.new("flesh_cells *"))
        struct.count, struct.nodes_per_cell = nodes.shape
        struct.nodes = pointer(self._cell_nodes, "int")
        callback = ffi.callback("const flesh_cells *(const flesh_effect *)", lambda _effect: struct)
        self._table.cells = self._hold(callback)

    @classmethod
    def tet_cells(cls, mesh: Mesh) -> np.ndarray:
        """Returns [tets, 4] or [tets, 10] ascending nodes of every tet: the cells of a sum over tets."""
        cells = ffi.new("flesh_cells *")
        _callbacks.call(lib.flesh_cells_of_tets, mesh._pointer, cells)
        nodes = view(cells.nodes, (cells.count, cells.nodes_per_cell), "int", None).copy()
        lib.flesh_cells_clear(cells)
        return nodes

    # Callbacks of the library: `_effect` is this effect.

    def _array(self, address, writable=False):
        return view(address, (self._nodes, 3), "double", None, read_only=not writable)

    def _point(self, point):
        return PointView(point, self._nodes, self._internals)

    @staticmethod
    def _shift(shift):
        return Shift(shift.x, shift.v, shift.a, FILTERS.word(shift.filter))

    def _numbers(self, value, name):
        return doubles(value, np.shape(value), f"{type(self).__name__}.{name}")

    def _shaped(self, value, shape, name):
        array = self._numbers(value, name)
        if array.shape != shape:
            raise ArgumentError(f"{type(self).__name__}.{name} returned an array of shape {array.shape}; "
                                f"it must be {shape}")
        return array

    def _call_residual(self, _effect, point, r):
        self._array(r, True)[...] += self._shaped(self.residual(self._point(point)), (self._nodes, 3), "residual")

    def _call_jacobian(self, _effect, point, shift, K, slots):
        given = self.jacobian(self._point(point), self._shift(shift))
        blocks = view(K.values, (K.row_start[K.rows], 3, 3), "double", None, read_only=False)
        if not hasattr(self, "_cell_nodes"):
            starts = view(K.row_start, (K.rows,), "int", None)
            blocks[starts] += self._shaped(given, (self._nodes, 3, 3), "jacobian")
            return
        count, k = self._cell_nodes.shape
        cell = self._shaped(given, (count, 3 * k, 3 * k), "jacobian").reshape(count, k, 3, k, 3)
        which, row, column = np.arange(count)[:, None], *np.triu_indices(k)
        pairs = cell[which, self._order[:, row], :, self._order[:, column], :]
        places = view(slots, (count, len(row)), "int", None)
        np.add.at(blocks, places.ravel(), pairs.reshape(-1, 3, 3))

    def _call_potential(self, _effect, point, shift, phi, magnitude):
        terms = self._numbers(self.potential(self._point(point), self._shift(shift)), "potential")
        phi[0] += terms.sum()
        magnitude[0] += np.abs(terms).sum()

    def _call_energy(self, _effect, point, energy):
        energy[0] = float(self.energy(self._point(point)))

    def _call_next_event(self, _effect, t):
        return float(self.next_event(t))

    def _call_carry(self, _effect, point, t_from, t_to, dx):
        moved = self.carry(self._point(point), t_from, t_to)
        if moved is None:
            return 0
        self._array(dx, True)[...] += self._shaped(moved, (self._nodes, 3), "carry")
        return 1

    def _call_max_feasible_step(self, _effect, _near, _internal, t_from, x_from, t_to, x_to):
        return float(self.max_feasible_step(t_from, self._array(x_from), t_to, self._array(x_to)))

    def _call_push_out(self, _effect, t_from, x_from, t_to, x_to):
        to = self._array(x_to, True)
        to[...] = self._shaped(self.push_out(t_from, self._array(x_from), t_to, to.copy()), (self._nodes, 3), "push_out")

    def _call_tunnelled(self, _effect, t_from, x_from, t_to, x_to):
        return int(bool(self.tunnelled(t_from, self._array(x_from), t_to, self._array(x_to))))

    def _call_check(self, _effect, _internal, t, x):
        self.check(t, self._array(x))

    def _call_clearance(self, _effect, t, x):
        return float(self.clearance(t, self._array(x)))

    def _call_approach(self, _effect, t_from, t_to, low, high):
        return float(self.approach(t_from, t_to, np.array(list(low[0:3])), np.array(list(high[0:3]))))

    def _call_report(self, _effect, point, values):
        view(values, (self._reports,), "double", None, read_only=False)[...] = \
            self._shaped(np.atleast_1d(self.report(self._point(point))), (self._reports,), "report")

    def _call_count(self, _effect):
        return self._internals

    def _call_update(self, _effect, point, internal, changed):
        at, shape = self._point(point), (self._internals,)
        now = view(internal, shape, "double", None, read_only=False)
        given = self._shaped(self.update(at), shape, "update")
        changed[0] |= int((given != now).any())
        now[...] = given

    def _call_tell(self, _effect, internal, size, text):
        given = self.tell(view(internal, (self._internals,), "double", None)).encode()[:size - 1] + b"\0"
        ffi.memmove(text, given, len(given))

    def _call_stress(self, _effect, t, tet, F, tau):
        given = self._shaped(self.stress(t, tet, view(F, (3, 3), "double", None)), (3, 3), "stress")
        view(tau, (3, 3), "double", None, read_only=False)[...] += given
