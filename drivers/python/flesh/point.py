"""point.py: points at which effects are evaluated, how the unknown moves them, and threads."""
from typing import Callable, NamedTuple, Optional

import numpy as np

from . import _callbacks
from ._arrays import doubles, pointer
from ._callbacks import Handle, call_value, create, owned
from ._library import ffi, lib
from .options import FILTERS

__all__ = ["Shift", "Lagged", "Frozen", "Point", "Threads"]


class Shift(NamedTuple):
    """How the unknown u moves a point: dx = x du, dv = v du, da = a du.

    Statics (1, 0, 0); backward Euler with the step h (1, 1/h, 1/h^2). `filter` is the treatment of negative
    eigenvalues: "none", "clamp" or "absolute".
    """
    x: float = 1.0
    v: float = 0.0
    a: float = 0.0
    filter: str = "none"

    @classmethod
    def backward_euler(cls, h: float, filter: str = "none") -> "Shift":
        """Returns the shift of a step of h s."""
        return cls(1.0, 1 / h, 1 / h**2, filter)

    def _struct(self):
        return ffi.new("flesh_shift *", {"x": self.x, "v": self.v, "a": self.a,
                                         "filter": FILTERS.value(self.filter, "filter")})


class Threads(Handle):
    """Threads that share the work of evaluations; count 0: as many as there are processors."""

    def __init__(self, count: int = 0):
        self._pointer = owned("flesh_threads", create("flesh_threads", lib.flesh_threads_create, count),
                              lib.flesh_threads_destroy)

    def run(self, tasks: int, function: Callable[[int], None]) -> None:
        """Calls function(0) ... function(tasks - 1) in any order and on any thread; returns when all are done."""
        task = _callbacks.value_callback("void(void *, int)", lambda _data, number: function(number))
        call_value(lib.flesh_threads_run, self._pointer, tasks, task, ffi.NULL)


class Lagged(NamedTuple):
    """The state at which lagged forces are evaluated."""
    t: float  # s
    x: np.ndarray  # [nodes, 3] m
    v: np.ndarray  # [nodes, 3] m/s


class Frozen(NamedTuple):
    """The state at which effects freeze terms without a potential."""
    x: np.ndarray  # [nodes, 3] m
    v: Optional[np.ndarray]  # [nodes, 3] m/s; None: at rest


class Point(Handle):
    """A point at which effects are evaluated.

    Args:
        x: [nodes, 3] m.
        v, a: [nodes, 3] m/s, m/s^2; None: zero.
        t: s.
        load: factor of the external loads, in [0, 1].
        lagged, frozen: a Lagged and a Frozen; None: the point's own t, x and v.
        multipliers, penalty: [System.multiplier_count] Pa, pressures of incompressible tets; the factor of penalties.
        internal: [System.internal_count] internal variables of the effects; None: all 0.
        threads: threads to use; results do not depend on them.
    """

    def __init__(self, x, v=None, a=None, t: float = 0.0, load: float = 1.0, *,
                 lagged: Optional[Lagged] = None, frozen: Optional[Frozen] = None, multipliers=None,
                 penalty: float = 1.0, internal=None, threads: Optional[Threads] = None):
        self.x = doubles(x, (None, 3), "x")
        self.v = np.zeros_like(self.x) if v is None else doubles(v, self.x.shape, "v")
        self.a = np.zeros_like(self.x) if a is None else doubles(a, self.x.shape, "a")
        self.t, self.load = float(t), float(load)
        self._nodes, self._threads = len(self.x), threads
        self._shown = [self.x, self.v, self.a]  # the arrays, even if attributes are replaced
        self._struct = ffi.new("flesh_point *", lib.flesh_point_at(self.t, *map(pointer, self._shown)))
        self._struct.load, self._struct.penalty = self.load, float(penalty)
        if lagged is not None:
            self._struct.lagged.t = float(lagged[0])
            self._show(self._struct.lagged, Lagged._fields[1:], lagged[1:], self.x.shape)
        if frozen is not None:
            self._show(self._struct.frozen, Frozen._fields, frozen, self.x.shape)
        self._multipliers, self._internal = self._show(self._struct, ("multipliers", "internal"),
                                                       (multipliers, internal), (None,))
        if threads is not None:
            self._struct.threads = threads._pointer

    def _show(self, struct, names, values, shape):
        arrays = [None if value is None else doubles(value, shape, name) for name, value in zip(names, values)]
        self._shown += arrays
        for name, array in zip(names, arrays):
            setattr(struct, name, pointer(array))
        return arrays
