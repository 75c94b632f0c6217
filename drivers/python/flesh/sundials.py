"""sundials.py: a system's equations for a solver of your own: KINSOL's r(u) = 0, IDA's F(t, y, y') = 0, and the
y' = f(t, y) of CVODE, ARKODE or scipy.integrate.

These are the library's own functions for SUNDIALS, with numpy arrays for its vectors and scipy.sparse for its matrices.
A problem belongs to one thread at a time."""
from typing import TYPE_CHECKING, Optional, Tuple

import numpy as np

from ._arrays import doubles, pointer
from ._callbacks import Handle, call, create, owned
from ._library import ffi, lib, null_communicator, sundials_function
from .errors import ArgumentError, SundialsError
from .options import SolverOptions, SolveStats
from .point import Shift
from .system import State, System

if TYPE_CHECKING:
    import scipy.sparse

__all__ = ["KinsolProblem", "IdaProblem", "OdeProblem"]


class _Problem(Handle):
    """Common base of the three problems: `_kind` names the C type and begins its functions' names."""
    _kind = _short = ""
    _parts = 1  # number of parts of a vector, of 3 * nodes numbers each

    def __init__(self, system: System, options: Optional[SolverOptions] = None):
        self._system = system
        options = SolverOptions() if options is None else options
        self._pointer = owned(self._kind, create(self._kind, getattr(lib, f"{self._kind}_create"), system._ready(),
                                                 options._struct), getattr(lib, f"{self._kind}_destroy"), system)
        self._context = ffi.new("SUNContext *")
        if sundials_function("SUNContext_Create")(null_communicator(), self._context):
            raise SundialsError("SUNContext_Create failed")
        self._context = ffi.gc(self._context, sundials_function("SUNContext_Free"))

    @property
    def system(self) -> System:
        """The system of the equations."""
        return self._system

    @property
    def size(self) -> int:
        """Length of a vector."""
        return self._parts * self.system.unknowns

    def _vector(self, array):
        """Returns a vector that is a view of an array and keeps it alive."""
        made = sundials_function("N_VMake_Serial")(self.size, pointer(array), self._context[0])
        if not made:
            raise SundialsError("N_VMake_Serial failed")
        destroy = sundials_function("N_VDestroy")
        return ffi.gc(made, lambda vector, _keep=array: destroy(vector))

    def _in(self, values, name):
        """Returns a vector that is a view of an argument, or of a copy of it."""
        return self._vector(doubles(np.ravel(values), (self.size,), name))

    def _out(self):
        """Returns a new array and a vector that is a view of it."""
        array = np.zeros(self.size)
        return array, self._vector(array)

    def _sparse(self, entries, function, *before):
        """Returns the SUNSparseMatrix that a Jacobian function fills, as a scipy.sparse.csc_matrix."""
        from scipy import sparse
        if entries < 0:
            raise ArgumentError("the Jacobian has too many entries for the indices of this SUNDIALS")
        made = sundials_function("SUNSparseMatrix")(self.size, self.size, entries, 0, self._context[0])
        if not made:
            raise SundialsError("SUNSparseMatrix failed")
        matrix = ffi.gc(made, sundials_function("SUNMatDestroy"))
        call(function, *before, matrix)
        kind = np.dtype(f"i{ffi.sizeof('sunindextype')}")

        def numbers(name, count, dtype):
            address = sundials_function(f"SUNSparseMatrix_{name}")(matrix)
            return np.frombuffer(ffi.buffer(address, count * np.dtype(dtype).itemsize), dtype).copy()
        starts = numbers("IndexPointers", self.size + 1, kind)
        return sparse.csc_matrix((numbers("Data", starts[-1], np.float64), numbers("IndexValues", starts[-1], kind),
                                  starts), shape=(self.size, self.size))

    def _stats(self, function):
        return SolveStats(function(self._pointer))


class KinsolProblem(_Problem):
    """r(u) = 0 of one solve: x = x0 + sx u, v = v0 + sv u, a = a0 + sa u; u [3*nodes].

    At first it is the static problem at the mesh's rest shape; `set_stage` changes it. Rows of constrained dofs are
    (u - prescribed) times a typical stiffness, so that r(u) = 0 can be solved directly.
    """
    _kind = "flesh_problem"

    def __init__(self, system: System, options: Optional[SolverOptions] = None):
        super().__init__(system, options)
        self.set_stage(system.mesh.positions)

    def set_stage(self, x0, v0=None, a0=None, t: float = 0.0, load: float = 1.0, prescribed_fraction: float = 1.0,
                  shift: Shift = Shift(), *, x_lag=None, v_lag=None, t_lag: Optional[float] = None,
                  frozen_at_solution: bool = False, multipliers=None, penalty: float = 1.0,
                  held=None, internal=None, x_from=None, t_from: Optional[float] = None) -> None:
        """Sets the time, and how u moves the point from x0, v0, a0 [nodes, 3]. Dofs in `held` [nodes, 3] stay at x0, as
        well as constrained ones. The path from x_from [nodes, 3] at t_from (None: from the lagged state) must be clear
        of obstacles. See flesh.Point for the other arguments."""
        shape = (self.system.mesh.node_count, 3)
        arrays = {"x0": x0, "v0": v0, "a0": a0, "x_lag": x_lag, "v_lag": v_lag, "x_from": x_from}
        shown = {name: None if value is None else pointer(doubles(value, shape, name).copy())
                 for name, value in arrays.items()}
        stage = ffi.new("flesh_stage *")
        stage.t, stage.load, stage.prescribed_fraction, stage.t_lag = t, load, prescribed_fraction, t
        if t_lag is not None:
            stage.t_lag = t_lag
        stage.t_from = t if t_from is None else t_from
        stage.frozen_at_solution, stage.penalty = int(frozen_at_solution), float(penalty)
        if held is not None:
            shown["held"] = pointer(np.array(np.broadcast_to(held, shape), dtype=np.uint8), "uint8_t")
        for name, values, count in (("multipliers", multipliers, self.system.multiplier_count),
                                    ("internal", internal, self.system.internal_count)):
            if values is not None:
                shown[name] = pointer(doubles(values, (count,), name).copy())
        stage.shift = Shift(*shift)._struct()[0]
        for name, address in shown.items():
            if address is not None:
                setattr(stage, name, address)
        call(lib.flesh_problem_set_stage, self._pointer, stage)
        self._stage = (stage, shown)  # set after the call: until then the library uses the previous one

    def start(self) -> np.ndarray:
        """Returns u [3*nodes], 0 except for the constrained dofs, which have their prescribed positions."""
        u = np.zeros(self.size)
        lib.flesh_problem_start(self._pointer, pointer(u))
        return u

    def freeze(self, u) -> None:
        """Sets the frozen state to the point of u, for stages with frozen_at_solution."""
        lib.flesh_problem_freeze(self._pointer, pointer(doubles(np.ravel(u), (self.size,), "u")))

    @property
    def stats(self) -> SolveStats:
        """Counts since creation."""
        return self._stats(lib.flesh_problem_stats)

    def solve(self, u, b, tolerance: float = 1e-10) -> np.ndarray:
        """Returns p with K p = b, K = dr/du at u, without filter or secants: tangents and, as K is symmetric, adjoints.

        b [3*nodes] or [k, 3*nodes]; its entries for constrained dofs are not read, and p is 0 there. u None: uses the
        K of the previous call and its factors.
        """
        p = np.array(b, dtype=float)
        if p.ndim not in (1, 2) or p.shape[-1] != self.size:
            raise ArgumentError(f"b has the shape {p.shape}; it must be [{self.size}] or [k, {self.size}]")
        at = ffi.NULL if u is None else pointer(doubles(np.ravel(u), (self.size,), "u"))
        call(lib.flesh_problem_solve, self._pointer, at, p.size // self.size, pointer(p), tolerance)
        return p

    def residual(self, u) -> np.ndarray:
        """Returns r(u) [3*nodes], N."""
        at, (r, out) = self._in(u, "u"), self._out()
        call(lib.flesh_kinsol_residual, at, out, self._pointer)
        return r

    def jacobian(self, u) -> "scipy.sparse.csc_matrix":
        """Returns dr/du at u as a scipy.sparse.csc_matrix, N/m."""
        at = self._in(u, "u")

        def fill(matrix):
            return lib.flesh_kinsol_jacobian(at, ffi.NULL, matrix, self._pointer, ffi.NULL, ffi.NULL)
        return self._sparse(lib.flesh_problem_entries(self._pointer), fill)

    def jacobian_times(self, v, u=None) -> np.ndarray:
        """Returns (dr/du) v [3*nodes] with the matrix of the last Jacobian or preconditioner set-up.

        NotPositiveError if v . Jv <= 0 although v is not 0: a direction of negative curvature.
        """
        right, (out, result) = self._in(v, "v"), self._out()
        new = ffi.new("flesh_sunboolean *", 0)
        at = ffi.NULL if u is None else self._in(u, "u")
        call(lib.flesh_kinsol_jacobian_times, right, result, at, new, self._pointer)
        return out

    def preconditioner_setup(self, u) -> None:
        """Assembles at u and factors."""
        at = self._in(u, "u")
        call(lib.flesh_kinsol_preconditioner_setup, at, ffi.NULL, ffi.NULL, ffi.NULL, self._pointer)

    def preconditioner_solve(self, r) -> np.ndarray:
        """Returns P^-1 r [3*nodes]."""
        z = doubles(np.ravel(r), (self.size,), "r").copy()
        vector = self._vector(z)
        call(lib.flesh_kinsol_preconditioner_solve, ffi.NULL, ffi.NULL, ffi.NULL, ffi.NULL, vector, self._pointer)
        return z


class _Motion(_Problem):
    """Common base of IDA's and the ODE's equations: y = (x, v) [6*nodes]."""
    _parts = 2

    def _function(self, name):
        return getattr(lib, f"flesh_{self._short}_{name}")

    @property
    def event(self) -> float:
        """Time up to which the start is valid, s; inf if always."""
        return self._function("event")(self._pointer)

    def tolerances(self, tolerance: float) -> np.ndarray:
        """Returns absolute tolerances [6*nodes], so large for constrained dofs that no test depends on them. Call it
        after a start."""
        atol, out = self._out()
        call(self._function("tolerances"), self._pointer, float(tolerance), out)
        return atol

    def get_state(self, t: float, y) -> State:
        """Returns a new state from y [6*nodes] at t s; constrained dofs have their exact values."""
        at = self._in(y, "y")
        state = State.at_rest(self.system.mesh)
        call(self._function("get_state"), self._pointer, float(t), at, state._struct)
        return state

    @property
    def stats(self) -> SolveStats:
        """Counts since creation."""
        return self._stats(self._function("stats"))


class IdaProblem(_Motion):
    """F(t, y, y') = 0 with y = (x, v) [6*nodes]: x' - v, and r(t, x, v, a = v') in N."""
    _kind, _short = "flesh_ida_problem", "ida"

    def start(self, state: State) -> Tuple[np.ndarray, np.ndarray]:
        """Returns consistent y and y' [6*nodes] from a state; valid up to `event`."""
        (y, out), (yp, derivative) = self._out(), self._out()
        call(lib.flesh_ida_start, self._pointer, state._checked(self.system.mesh.node_count), out, derivative)
        return y, yp

    def residual(self, t: float, y, yp) -> np.ndarray:
        """Returns F(t, y, y') [6*nodes]."""
        at, derivative, (r, out) = self._in(y, "y"), self._in(yp, "yp"), self._out()
        call(lib.flesh_ida_residual, float(t), at, derivative, out, self._pointer)
        return r

    def jacobian(self, t: float, cj: float, y, yp) -> "scipy.sparse.csc_matrix":
        """Returns dF/dy + cj dF/dy' as a scipy.sparse.csc_matrix [6*nodes, 6*nodes]."""
        at, derivative = self._in(y, "y"), self._in(yp, "yp")

        def fill(matrix):
            return lib.flesh_ida_jacobian(float(t), float(cj), at, derivative, ffi.NULL, matrix, self._pointer,
                                          ffi.NULL, ffi.NULL, ffi.NULL)
        return self._sparse(lib.flesh_ida_entries(self._pointer), fill)

    def preconditioner_setup(self, t: float, cj: float, y, yp) -> None:
        """Assembles at (t, y, y') and factors."""
        at, derivative = self._in(y, "y"), self._in(yp, "yp")
        call(lib.flesh_ida_preconditioner_setup, float(t), at, derivative, ffi.NULL, float(cj), self._pointer)

    def preconditioner_solve(self, b, t: float = 0.0, cj: float = 0.0, delta: float = 0.0) -> np.ndarray:
        """Returns P^-1 b [6*nodes] with the last set-up; t, cj and delta are not used."""
        right, (z, out) = self._in(b, "b"), self._out()
        call(lib.flesh_ida_preconditioner_solve, float(t), ffi.NULL, ffi.NULL, ffi.NULL, right, out, float(cj),
             float(delta), self._pointer)
        return z

    def jacobian_times(self, v) -> np.ndarray:
        """Returns the product [6*nodes] with the matrix of the last preconditioner set-up, and its cj."""
        right, (out, result) = self._in(v, "v"), self._out()
        call(lib.flesh_ida_jacobian_times, 0.0, ffi.NULL, ffi.NULL, ffi.NULL, right, result, 0.0, self._pointer,
             ffi.NULL, ffi.NULL)
        return out


class OdeProblem(_Motion):
    """y' = f(t, y) with y = (x, v) [6*nodes]: what scipy.integrate.solve_ivp takes as `fun` and `jac`."""
    _kind, _short = "flesh_ode_problem", "ode"

    def start(self, state: State) -> np.ndarray:
        """Returns y [6*nodes] from a state, with constrained dofs at their prescribed values; valid up to `event`."""
        y, out = self._out()
        call(lib.flesh_ode_start, self._pointer, state._checked(self.system.mesh.node_count), out)
        return y

    def rhs(self, t: float, y) -> np.ndarray:
        """Returns f(t, y) [6*nodes]."""
        at, (ydot, out) = self._in(y, "y"), self._out()
        call(lib.flesh_ode_rhs, float(t), at, out, self._pointer)
        return ydot

    def jacobian(self, t: float, y) -> "scipy.sparse.csc_matrix":
        """Returns df/dy as a scipy.sparse.csc_matrix [6*nodes, 6*nodes]; lumped mass only, as it is full otherwise."""
        at = self._in(y, "y")

        def fill(matrix):
            return lib.flesh_ode_jacobian(float(t), at, ffi.NULL, matrix, self._pointer, ffi.NULL, ffi.NULL,
                                          ffi.NULL)
        return self._sparse(lib.flesh_ode_entries(self._pointer), fill)

    def jacobian_times_setup(self, t: float, y) -> None:
        """Assembles at (t, y) for `jacobian_times`."""
        at = self._in(y, "y")
        call(lib.flesh_ode_jacobian_times_setup, float(t), at, ffi.NULL, self._pointer)

    def jacobian_times(self, v) -> np.ndarray:
        """Returns (df/dy) v [6*nodes] at the point of the last set-up."""
        right, (out, result) = self._in(v, "v"), self._out()
        call(lib.flesh_ode_jacobian_times, right, result, 0.0, ffi.NULL, ffi.NULL, self._pointer, ffi.NULL)
        return out

    def preconditioner_setup(self, t: float, y, gamma: float) -> None:
        """Assembles and factors I - gamma df/dy with one half eliminated, gamma in s."""
        at = self._in(y, "y")
        current = ffi.new("flesh_sunboolean *")
        call(lib.flesh_ode_preconditioner_setup, float(t), at, ffi.NULL, 0, current, float(gamma), self._pointer)

    def preconditioner_solve(self, r, gamma: float) -> np.ndarray:
        """Returns P^-1 r [6*nodes] with the last set-up; pass the same gamma."""
        right, (z, out) = self._in(r, "r"), self._out()
        call(lib.flesh_ode_preconditioner_solve, 0.0, ffi.NULL, ffi.NULL, right, out, float(gamma), 0.0, 1,
             self._pointer)
        return z
