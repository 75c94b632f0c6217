"""sensitivity.py: sensitivities of results to inputs: tangents, adjoints, gradients."""
from typing import TYPE_CHECKING, Callable, NamedTuple, Optional, Sequence

import numpy as np

from ._arrays import finite, pointer
from ._callbacks import Handle, call, create, owned, status_callback
from ._library import ffi, lib
from .body import Body
from .errors import ArgumentError
from .integrator import Integrator
from .options import SolverOptions
from .system import State, System

if TYPE_CHECKING:
    import scipy.sparse.linalg

__all__ = ["MotionGradient", "Parameter", "Sensitivity", "Trajectory", "TrajectoryCosts", "tet_forces"]


class Parameter(Handle):
    """A parameter for derivatives: a number p with which a system is made.

    Args:
        system: function that makes the System for a value of p; all else, nodes and tets included, stays the same.
        value: the value of p.
        difference: step of the differences in p; by default a millionth of the value, or 1e-6 if that is 0. A larger
            one may cross kinks, for example where contact begins.
    """

    def __init__(self, system: Callable[[float], System], value: float, difference: Optional[float] = None):
        self.value = float(value)
        self.difference = float(difference if difference is not None else abs(self.value) * 1e-6 or 1e-6)
        self._systems = [system(self.value + k * self.difference) for k in (-2, -1, 1, 2)]
        for made in self._systems:
            if not isinstance(made, System):
                raise TypeError(f"system returned {made!r}; it must return an object of class System")
        self._struct = ffi.new("flesh_parameter *", {"difference": self.difference})
        for k, made in enumerate(self._systems):
            self._struct.systems[k] = made._ready()


class Sensitivity(Handle):
    """Derivatives of an equilibrium of a system, which is linearised and factored once.

    Args:
        system: the system in equilibrium.
        state: the equilibrium, with the system's multipliers and internal variables; solve it to a small
            newton_tolerance, as derivatives are no more accurate than the state.
        options: options of the solves.
        tolerance: tolerance of the solves, relative to their right-hand sides.
        lagged: the State before the step, which friction uses; None: the equilibrium itself.
    """

    def __init__(self, system: System, state: State, options: Optional[SolverOptions] = None, *,
                 tolerance: float = 1e-10, lagged: Optional[State] = None):
        options = SolverOptions() if options is None else options
        made = create("flesh_sensitivity", lib.flesh_sensitivity_create, system._ready(), options._struct, tolerance)
        self._pointer = owned("flesh_sensitivity", made, lib.flesh_sensitivity_destroy, system)
        self._nodes = system.mesh.node_count
        before = ffi.NULL
        if lagged is not None:
            struct = lagged._checked(self._nodes)
            before = ffi.new("flesh_lagged *", {"t": struct.t, "x": struct.x, "v": struct.v})
        call(lib.flesh_sensitivity_set, self._pointer, state._checked(self._nodes), before)

    def _quantity(self, by_x, of_residual):
        shape, kept = (self._nodes, 3), []
        struct = ffi.new("flesh_quantity *")
        for name, values in (("by_x", by_x), ("of_residual", of_residual)):
            if values is not None:
                kept.append(pointer(finite(values, shape, name)))
                setattr(struct, name, kept[-1])
        return struct, kept

    def _vector(self, function, *arguments):
        out = np.empty((self._nodes, 3))
        call(function, self._pointer, *arguments, pointer(out))
        return out

    def force(self, parameter: Parameter) -> np.ndarray:
        """Returns dr/dp [nodes, 3], N per unit of p."""
        return self._vector(lib.flesh_sensitivity_force, parameter._struct)

    def tangent(self, parameter: Parameter) -> np.ndarray:
        """Returns dx/dp [nodes, 3]."""
        return self._vector(lib.flesh_sensitivity_tangent, parameter._struct)

    def respond(self, force) -> np.ndarray:
        """Returns -K^-1 force [nodes, 3]: the change of the equilibrium for a change `force` of its residual."""
        return self._vector(lib.flesh_sensitivity_respond, pointer(finite(force, (self._nodes, 3), "force")))

    def adjoint(self, by_x=None, of_residual=None) -> np.ndarray:
        """Returns lambda [nodes, 3], with dQ = -lambda . dr for a change dr of the free forces.

        Q is given by its derivative by_x [nodes, 3], or as a sum of reactions by weights of_residual [nodes, 3].
        """
        struct, _kept = self._quantity(by_x, of_residual)
        return self._vector(lib.flesh_sensitivity_adjoint, struct)

    def gradient(self, parameters: Sequence[Parameter], by_x=None, of_residual=None) -> np.ndarray:
        """Returns dQ/dp [parameters] for a Q as in `adjoint`, by one solve for all parameters."""
        struct, _kept = self._quantity(by_x, of_residual)
        all_of_them = list(parameters)
        gradient = np.empty(len(all_of_them))
        structs = ffi.new("flesh_parameter[]", [p._struct[0] for p in all_of_them])
        call(lib.flesh_sensitivity_gradient, self._pointer, struct, len(all_of_them), structs, pointer(gradient))
        return gradient

    def operator(self, parameters: Sequence[Parameter]) -> "scipy.sparse.linalg.LinearOperator":
        """Returns dx/dp [3*nodes, parameters] as a scipy LinearOperator: by tangents; its transpose by one adjoint."""
        from scipy.sparse.linalg import LinearOperator
        all_of_them = list(parameters)
        if not all_of_them:
            raise ArgumentError("parameters is empty; an operator needs at least one")
        return LinearOperator((3 * self._nodes, len(all_of_them)), dtype=float,
                              matvec=lambda p: self._along(all_of_them, np.ravel(p)),
                              rmatvec=lambda x: self.gradient(all_of_them, by_x=np.reshape(x, (self._nodes, 3))))

    def _along(self, parameters, amounts):
        return sum(amount * self.tangent(p).ravel() for amount, p in zip(amounts, parameters))


def _by_tet(low, high, difference):
    """Returns a flesh_tet_parameter, and the arrays that it borrows."""
    differences = np.ascontiguousarray(np.broadcast_to(np.asarray(difference, dtype=float), (low.mesh.tet_count,)))
    struct = ffi.new("flesh_tet_parameter *", {"bodies": [low._struct, high._struct]})
    struct.difference = pointer(differences)
    return struct, differences


def tet_forces(low: Body, high: Body, difference, state: State) -> np.ndarray:
    """Returns dr/dp [tets, 4 or 10, 3], N per unit of p, at the nodes of each tet for a constant p of its material.

    Args:
        low, high: bodies of one mesh, whose materials differ in the constant.
        difference: [tets] or one for all: p in `high` minus p in `low`; 0: the tet's constant is no parameter.
        state: an equilibrium of the body.
    """
    mesh, (struct, _kept) = low.mesh, _by_tet(low, high, difference)
    forces = np.empty((mesh.tet_count, 10 if mesh.order == 2 else 4, 3))
    call(lib.flesh_tet_forces, struct, state._checked(mesh.node_count), pointer(forces))
    return forces


class MotionGradient(NamedTuple):
    """Derivatives of a quantity of a motion."""
    by_parameters: np.ndarray  # [parameters]
    by_x: np.ndarray  # [nodes, 3] with respect to the first positions
    by_v: np.ndarray  # [nodes, 3] with respect to the first velocities


class TrajectoryCosts(NamedTuple):
    """Costs of a trajectory."""
    parts: int  # number of recorded parts of steps
    repeated: int  # number of parts that gradients have repeated
    bytes: int  # largest size of recorded parts and checkpoints together


class Trajectory(Handle):
    """Records the steps that an integrator takes from now on, for derivatives of their end by one discrete adjoint.

    Steps without sensitivities (a removed tangle, internal variables that change) end with ArgumentError.

    Args:
        integrator: an integrator of any method but ida; solve to a small newton_tolerance.
        tolerance: tolerance of the adjoint's solves, relative to their right-hand sides.
        states: memory to use, in states of the body (x and v), at least 20; steps that do not fit are repeated from
            checkpoints, bitwise the same.
    """

    def __init__(self, integrator: Integrator, tolerance: float = 1e-10, states: int = lib.FLESH_TRAJECTORY_STATES):
        made = create("flesh_trajectory", lib.flesh_trajectory_create, integrator._pointer, tolerance, states)
        self._pointer = owned("flesh_trajectory", made, lib.flesh_trajectory_destroy, integrator)
        self._nodes = integrator.system.mesh.node_count

    @property
    def costs(self) -> TrajectoryCosts:
        """Costs of recording and gradients so far."""
        costs = lib.flesh_trajectory_get_costs(self._pointer)
        return TrajectoryCosts(costs.parts, costs.repeated, costs.bytes)

    def gradient(self, parameters: Sequence[Parameter] = (), by_x=None, by_v=None,
                 over: str = "end") -> MotionGradient:
        """Returns derivatives of a quantity Q of the last state, given by dQ/dx and dQ/dv [nodes, 3] (None: 0).

        With `over` "mean" or "integral", Q is the mean over time or the integral, by the trapezoidal rule, of a linear
        function of the state, and dQ/dx and dQ/dv are the derivatives of that function.
        """
        shape, all_of_them = (self._nodes, 3), list(parameters)
        gradient, start = np.empty(len(all_of_them)), np.empty((2, *shape))
        structs = ffi.new("flesh_parameter[]", [p._struct[0] for p in all_of_them] or 1)
        overs = {"end": lib.FLESH_AT_END, "integral": lib.FLESH_INTEGRAL, "mean": lib.FLESH_MEAN}
        if not isinstance(over, str) or over not in overs:
            raise ArgumentError(f"over is {over!r}; it must be 'end', 'mean' or 'integral'")
        by = [None if one is None else finite(one, shape, name) for one, name in ((by_x, "by_x"), (by_v, "by_v"))]
        quantity = ffi.new("flesh_motion_quantity *", (pointer(by[0]), pointer(by[1]), overs[over]))
        call(lib.flesh_trajectory_gradient, self._pointer, quantity, len(all_of_them), structs, pointer(gradient),
             pointer(start))
        return MotionGradient(gradient, start[0], start[1])

    def tet_gradient(self, low: Body, high: Body, difference,
                     visit: Callable[[float, np.ndarray, np.ndarray], None]) -> np.ndarray:
        """Returns dQ/dp [tets] for a constant p of each tet's material, by one adjoint.

        Args:
            low, high, difference: as for `tet_forces`.
            visit: visit(t, by_x, by_v) adds dQ/dx and dQ/dv of the state at t to arrays [nodes, 3], from the last state
                to the first. The arrays are the library's: copy them to keep them.
        """
        struct, _kept = _by_tet(low, high, difference)

        def see(_data, t, by_x, by_v):
            both = [np.frombuffer(ffi.buffer(d, 24 * self._nodes)).reshape(self._nodes, 3) for d in (by_x, by_v)]
            visit(t, *both)
            for values, name in zip(both, ("by_x", "by_v")):
                finite(values, values.shape, name)

        visited, gradient = status_callback("int(void *, double, double *, double *)", see), np.empty(low.mesh.tet_count)
        call(lib.flesh_trajectory_tet_gradient, self._pointer, struct, visited, ffi.NULL, pointer(gradient))
        return gradient

    def tangent(self, parameter: Parameter) -> "tuple[np.ndarray, np.ndarray]":
        """Returns dx/dp and dv/dp [nodes, 3] of the last state, by one linear solve for each solve of a stage."""
        dx, dv = np.empty((2, self._nodes, 3))
        call(lib.flesh_trajectory_tangent, self._pointer, parameter._struct, pointer(dx), pointer(dv))
        return dx, dv

    def tangents(self, parameter: Parameter, start=None) -> "list[tuple[float, np.ndarray, np.ndarray]]":
        """Returns (t, dx/dp, dv/dp) of every state, from the first one on, at the cost of `tangent`.

        start: [2, nodes, 3] the derivatives of the first state's positions and velocities; None: 0.
        """
        kept = []
        self._visit([parameter], start, lambda _k, t, both: kept.append((t, *both.copy())))
        return kept

    def _visit(self, parameters, start, visit):
        """Calls visit(k, t, [dx, dv]) for all states and parameters, which share factorisations."""
        shape = (2, self._nodes, 3)
        structs = ffi.new("flesh_parameter[]", [p._struct[0] for p in parameters])

        def see(_data, k, t, dx, dv):
            visit(k, t, np.array([np.frombuffer(ffi.buffer(d, 24 * self._nodes)).reshape(shape[1:]) for d in (dx, dv)]))

        visited = status_callback("int(void *, int, double, const double *, const double *)", see)
        begin = ffi.NULL if start is None else pointer(finite(start, shape, "start"))
        call(lib.flesh_trajectory_tangents, self._pointer, len(parameters), structs, begin, visited, ffi.NULL)

    def operator(self, parameters: Sequence[Parameter]) -> "scipy.sparse.linalg.LinearOperator":
        """Returns d(x, v)/dp [6*nodes, parameters] of the last state as a scipy LinearOperator.

        Products are by tangents; those of its transpose by one adjoint.
        """
        from scipy.sparse.linalg import LinearOperator
        all_of_them, shape = list(parameters), (2, self._nodes, 3)
        if not all_of_them:
            raise ArgumentError("parameters is empty; an operator needs at least one")
        def along(p):
            last = {}  # by parameter
            self._visit(all_of_them, None, lambda k, _t, both: last.update({k: both}))
            return sum(amount * np.ravel(last[k]) for k, amount in enumerate(np.ravel(p)))

        return LinearOperator((6 * self._nodes, len(all_of_them)), dtype=float, matvec=along,
                              rmatvec=lambda y: self.gradient(all_of_them, *np.reshape(y, shape)).by_parameters)
