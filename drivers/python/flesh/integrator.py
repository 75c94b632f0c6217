"""integrator.py: time stepping and statics."""
from typing import Callable, NamedTuple, Optional

import numpy as np

from . import _callbacks
from ._arrays import view
from ._callbacks import Handle, call, call_value, create, owned
from ._library import ffi, lib, text
from .errors import ArgumentError
from .options import (METHOD_NAMES, AdaptiveOptions, EnergyBalance, Failure, MethodOptions, Progress, Separation,
                      SolverOptions, SolveStats)
from .system import State, System

__all__ = ["Integrator", "InternalStep", "equilibrium"]


class InternalStep(NamedTuple):
    """One internal step of a method with error control. The arrays are the library's: copy them to keep them."""
    t: float  # s, end of the step
    h: float  # s, length of the step
    order: int
    rejected: int  # attempts before it that were rejected by their error
    convergence_failures: int  # attempts before it whose Newton iteration did not converge
    x: np.ndarray  # [nodes, 3] m
    v: np.ndarray  # [nodes, 3] m/s


class Integrator(Handle):
    """Advances states of a system in time; belongs to one thread at a time.

    Ctrl-C ends a step: KeyboardInterrupt is raised and the state is that of the last finished part of the step.

    Args:
        system: the system; it is finished if it was not.
        method: one of METHODS: "backward-euler", "bdf2", ..., "static"; or "adaptive", "runge-kutta" with error control.
        options: options of solves; SolverOptions() by default.
        method_options: parameters of newmark, hht, generalized-alpha and runge-kutta.
        adaptive: options of error control and of ida.
        observe: called with every InternalStep of methods with error control.
        stop: called often during a step, without arguments; a true result ends the step with StoppedError.
    """

    def __init__(self, system: System, method: str = "backward-euler", options: Optional[SolverOptions] = None, *,
                 method_options: Optional[MethodOptions] = None, adaptive: Optional[AdaptiveOptions] = None,
                 observe: Optional[Callable[[InternalStep], None]] = None, stop: Optional[Callable] = None):
        self._system = system
        options = SolverOptions() if options is None else options
        if method == "adaptive":
            method, adaptive = "runge-kutta", AdaptiveOptions._copy((adaptive or AdaptiveOptions())._struct)
            adaptive.control = 1
        made = create("flesh_integrator", lib.flesh_integrator_create, system._ready(),
                      METHOD_NAMES.value(method, "method"), options._struct)
        self._pointer = owned("flesh_integrator", made, lib.flesh_integrator_destroy, system, self)
        self._asked = asked = [stop]
        # Python handles signals while it runs this function: KeyboardInterrupt is raised in it.
        self._stop = _callbacks.status_callback(
            "int(void *)", lambda _data: lib.FLESH_ERR_INTERRUPTED if asked[0] and asked[0]() else 0)
        self.stop = stop
        if method_options is not None:
            self.set_method_options(method_options)
        if adaptive is not None or observe is not None:
            self.set_adaptive(adaptive or AdaptiveOptions(), observe)

    @property
    def system(self) -> System:
        """The system that is integrated."""
        return self._system

    @property
    def stop(self) -> Optional[Callable]:
        """Function called during a step, and by derivatives of a Trajectory; None: only Ctrl-C ends them."""
        return self._asked[0]

    @stop.setter
    def stop(self, function: Optional[Callable]):
        if function is not None and not callable(function):
            raise ArgumentError(f"stop is {function!r}; it must be a function, or None")
        self._asked[0] = function
        lib.flesh_integrator_set_stop(self._pointer, self._stop, ffi.NULL)

    def set_method_options(self, options: MethodOptions) -> None:
        """Replaces the defaults of the methods' parameters and restarts the method."""
        call(lib.flesh_integrator_set_method_options, self._pointer, options._struct)

    def set_adaptive(self, options: AdaptiveOptions, observe: Optional[Callable[[InternalStep], None]] = None) -> None:
        """Replaces the default options of error control; `observe` is called with every InternalStep."""
        copy = AdaptiveOptions._copy(options._struct)
        function = ffi.NULL
        if observe is not None:
            def observed(_data, step):
                shape = (self.system.mesh.node_count, 3)
                observe(InternalStep(step.t, step.h, step.order, step.rejected, step.convergence_failures,
                                     view(step.state.x, shape, "double", self),
                                     view(step.state.v, shape, "double", self)))
            function = _callbacks.status_callback("int(void *, const flesh_internal_step *)", observed)
        copy._struct.observe = function
        call(lib.flesh_integrator_set_adaptive, self._pointer, copy._struct)
        self._observe = function  # set after the call: until then the library uses the previous one

    @property
    def method(self) -> str:
        """Name of the method."""
        return METHOD_NAMES.word(lib.flesh_integrator_method(self._pointer))

    def step(self, state: State, h: float) -> SolveStats:
        """Advances the state from t to t + h s, in place; statics: to equilibrium at t + h.

        Raises:
            SolveError, IntegratorError, EnergyError, ...: the step could not be made; the state is that of the last
                success, t included, and `failure` has the details.
            KeyboardInterrupt: Ctrl-C; the state is as above.
        """
        stats = SolveStats()
        call(lib.flesh_integrator_step, self._pointer, state._checked(self.system.mesh.node_count), float(h),
             stats._struct)
        return stats

    @property
    def warning(self) -> Optional[str]:
        """A warning about the steps so far, although none failed; None if there is none."""
        return text(lib.flesh_integrator_warning(self._pointer))

    @property
    def energy_balance(self) -> EnergyBalance:
        """Energy, external work, and spurious energy."""
        return EnergyBalance(lib.flesh_integrator_energy_balance(self._pointer))

    @property
    def separation(self) -> Separation:
        """Progress of the separation of surfaces that overlapped at the start (SurfaceContact's `separates`)."""
        return Separation(ffi.new("flesh_separation *", lib.flesh_integrator_separation(self._pointer)))

    def set_max_energy_gain(self, gain: float) -> None:
        """Sets the gain (see EnergyBalance) above which a step ends with EnergyError; inf: no limit."""
        call(lib.flesh_integrator_set_max_energy_gain, self._pointer, float(gain))

    def energies(self, state: State) -> Optional[np.ndarray]:
        """Returns [effects] J at the state to which the last step has led; None if they are not known there."""
        values = call_value(lib.flesh_integrator_energies, self._pointer, state._checked(self.system.mesh.node_count))
        return view(values, (self.system.effect_count,), "double", self).copy() if values else None

    @property
    def progress(self) -> Progress:
        """Progress of the current step, for a `stop` function."""
        return Progress(ffi.new("flesh_progress *", lib.flesh_integrator_progress(self._pointer)))

    @property
    def failure(self) -> Failure:
        """Details of the last failed step."""
        return Failure(lib.flesh_integrator_failure(self._pointer))

    def save(self) -> bytes:
        """Returns the integrator's memory between steps, without the state.

        Another Integrator of the same system, method and options that loads it and gets the state continues bitwise
        identically if `saves_all`.
        """
        size = ffi.new("size_t *")
        call(lib.flesh_integrator_save, self._pointer, 0, ffi.NULL, size)
        data = bytearray(size[0])
        call(lib.flesh_integrator_save, self._pointer, len(data), ffi.from_buffer(data), size)
        return bytes(data)

    def load(self, data: bytes) -> None:
        """Loads memory that an integrator saved. Call it between steps, after setting the options.

        Raises:
            FileError: no saved memory, damaged, or of another version or kind of machine.
            ArgumentError: saved with another method, mesh, other effects, solvers or instructions.
        """
        call(lib.flesh_integrator_load, self._pointer, ffi.from_buffer(data), len(data))

    @property
    def saves_all(self) -> bool:
        """Whether the memory that would be saved now is all that the next step depends on. Not while IDA steps, as its
        history cannot be restored; a loaded integrator then agrees within the tolerance of AdaptiveOptions."""
        return bool(lib.flesh_integrator_saves_all(self._pointer))

    @property
    def kinsol(self) -> int:
        """Address of the KINSOL memory inside, for KINSet... and KINGet... by ctypes or cffi."""
        return int(ffi.cast("uintptr_t", lib.flesh_integrator_kinsol(self._pointer)))

    @property
    def ida(self) -> int:
        """Address of the IDA memory inside an integrator of ida; 0 for other methods."""
        return int(ffi.cast("uintptr_t", lib.flesh_integrator_ida(self._pointer)))


def equilibrium(system: System, start: Optional[State] = None, options: Optional[SolverOptions] = None,
                t: float = 0.0) -> State:
    """Returns the equilibrium of a system at t s, a new state with the system's multipliers and internal variables; the
    solve begins at `start`, by default the rest shape.

    Raises:
        SolveError: none was found.
    """
    state = State.at_rest(system.mesh) if start is None else start.copy()
    if t < state.t:
        raise ArgumentError(f"t is {t:g} s; it must be at least that of the start, {state.t:g} s")
    if state.multipliers is None and system.multiplier_count:
        state.multipliers = np.zeros(system.multiplier_count)
    if state.internal is None and system.internal_count:
        state.internal = np.zeros(system.internal_count)
    Integrator(system, "static", options).step(state, t - state.t)
    return state
