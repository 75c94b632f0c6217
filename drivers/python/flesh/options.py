"""options.py: the options of solves and methods, and the statistics of a step."""
import numpy as np

from ._arrays import Field, Flags, Names, Options, Record
from ._callbacks import call
from ._library import ffi, lib, text

__all__ = ["SolverOptions", "MethodOptions", "AdaptiveOptions", "SolveStats", "Progress", "Failure", "EnergyBalance",
           "METHODS", "TECHNIQUES", "method_order"]

_LINEAR = Names("flesh_linear_solver", "FLESH_LINEAR_")
_PRECONDITIONERS = Names("flesh_preconditioner", "FLESH_PRECONDITIONER_", lib.flesh_preconditioner_name)
FILTERS = Names("flesh_eigenvalue_filter", "FLESH_FILTER_")
_LINE_SEARCH = Names("flesh_line_search", "FLESH_LINE_SEARCH_")
_TECHNIQUES = Flags("flesh_technique", "FLESH_TECHNIQUE_")
_TABLES = Names("flesh_table", "FLESH_TABLE_")
METHOD_NAMES = Names("flesh_method", "FLESH_METHOD_", lib.flesh_method_name)

TECHNIQUES = {text(lib.flesh_technique_name(bit)): text(lib.flesh_technique_doc(bit))
              for bit in _TECHNIQUES.words.values()}
"""Names of the techniques of a solve (SolverOptions.techniques), and what each does."""
METHODS = tuple(METHOD_NAMES.words)
"""Names of the methods, as in a scene."""


def method_order(method: str) -> int:
    """Returns a method's order of accuracy in time; 0 for statics and for ida, which chooses it."""
    return lib.flesh_method_order(METHOD_NAMES.value(method, "method"))


class SolverOptions(Options):
    """Options of the solve of a step or an equilibrium: SolverOptions(newton_tolerance=1e-8, threads=2)."""
    _ctype = "flesh_solver_options"
    newton_tolerance: float = Field("converged when |r| <= this times the larger of the load and the first residual; "
                                    "not used with error control")
    linear_tolerance: float = Field("largest ratio of the residual after a linear solve to that before it")
    max_newton: int = Field("maximum number of iterations of a solve")
    max_linear: int = Field("maximum number of iterations of a linear solve")
    max_cutbacks: int = Field("how often a failed step or load increment may be halved")
    linear_solver: str = Field("solver of linear systems", _LINEAR)
    preconditioner: str = Field("preconditioner of pcg", _PRECONDITIONERS)
    eigenvalue_filter: str = Field("treatment of negative eigenvalues, and when it applies", FILTERS)
    line_search: str = Field("line search that sets the length of a step", _LINE_SEARCH)
    accept_unconverged: int = Field("1: a solve that ends at max_newton without convergence is accepted")
    techniques: tuple = Field("techniques for steps on which plain Newton is slow, as a tuple of", _TECHNIQUES)
    threads: int = Field("number of threads, 0: one for each processor; results do not depend on it")
    lag_iterations: int = Field("maximum number of solves of a step, each with the lagged quantities of the last one")

    def _default(self):
        lib.flesh_solver_options_default(self._struct)


class MethodOptions(Options):
    """Parameters of the methods, each of which reads only its own.

    Raises:
        ArgumentError: a value out of its range.
    """
    _ctype = "flesh_method_options"
    for _name, _type in ffi.typeof("flesh_method_options").fields:
        vars()[_name] = Field(f"see time.{_name} in flesh.schema()")
    table: str = Field("see time.table in flesh.schema()", _TABLES)

    def __init__(self, **values):
        super().__init__(**values)
        call(lib.flesh_method_options_check, self._struct)

    def _default(self):
        lib.flesh_method_options_default(self._struct)


class AdaptiveOptions(Options):
    """Options of ida, and of the other methods with error control."""
    _ctype = "flesh_adaptive_options"
    control: int = Field("1: methods of fixed steps but midpoint choose their own steps by their error; 0: only ida")
    tolerance: float = Field("target error of positions, as a fraction of the body's longest side")
    max_order: int = Field("1 to 5; above 2 not A-stable")
    max_step: float = Field("s; inf: no limit")
    max_steps: int = Field("maximum number of internal steps in one step")

    def _default(self):
        lib.flesh_adaptive_options_default(self._struct)


class SolveStats(Record):
    """Statistics of a solve, or their sum over a step with its cutbacks."""
    _ctype = "flesh_solve_stats"
    solves: int = Field("nonlinear solves")
    newton: int = Field("Newton iterations")
    linear: int = Field("iterations of linear solves")
    assemblies: int = Field("Hessians assembled")
    projections: int = Field("assembled Hessians with projected eigenvalues")
    residuals: int = Field("residuals evaluated")
    potentials: int = Field("potentials evaluated")
    backtracks: int = Field("line-search reductions")
    subdomains: int = Field("solves for few nodes only")
    subdomain_newton: int = Field("their Newton iterations")
    subdomain_share: float = Field("sum of these iterations, each times its fraction of the elements")
    watchdog_steps: int = Field("longer steps that were accepted (watchdog)")
    potential_rises: int = Field("iterates whose potential lies above the first one's")
    at_rounding: int = Field("solves that ended at rounding above the tolerance")
    untanglings: int = Field("number of untanglings")
    untangled_nodes: int = Field("nodes moved by them")
    unconverged: int = Field("solves accepted without convergence")
    linear_single: int = Field("those of `linear` in single precision")
    multiplier_updates: int = Field("updates of the pressures of incompressible tets, each followed by a solve")
    direct: int = Field("linear solves by a direct factorisation")
    residual_first: float = Field("2-norm over the free dofs at the first iterate of the last solve, N")
    residual_last: float = Field("2-norm at its end, N")
    residual_target: float = Field("target of the 2-norm, N")
    steps: int = Field("internal steps of the integrator")
    rejected: int = Field("steps rejected by their error or their gain of energy")
    convergence_failures: int = Field("steps rejected because Newton did not converge")
    order: int = Field("order of the last step")
    impact_steps: int = Field("steps taken by backward Euler because an obstacle barred the way")
    damped_steps: int = Field("steps by backward Euler or Runge-Kutta: out of a tangle, or after gains or swings")
    h_last: float = Field("length of the last step, s")


class Progress(Record):
    """Progress of the current step."""
    _ctype = "flesh_progress"
    t: float = Field("start of the part of the step that is tried, s")
    h: float = Field("length of that part, s")
    newton: int = Field("Newton iteration of the current solve")
    linear: int = Field("linear iterations of this solve so far")
    residual: float = Field("residual at its last linear solve, N")
    target: float = Field("target of the residual, N")


class Failure(Record):
    """Facts known about a step that could not be taken."""
    _ctype = "flesh_failure"
    status: int = Field("status of the last attempt")
    t: float = Field("start of the last attempt, s")
    h: float = Field("length of the last attempt, s")
    halvings: int = Field("number of times that the step had been halved")
    residual: float = Field("2-norm over the free dofs, N")
    target: float = Field("target of the 2-norm, N")
    worst_tet: int = Field("tet with the smallest J at the last iterate, or -1")
    worst_J: float = Field("its J")
    worst_position: np.ndarray = Field("[3] its centre, m")
    worst_node: int = Field("node with the largest residual (ida: local error) at the last iterate, or -1")
    order: int = Field("ida: order of the last attempt; else 0")
    volume_gap: float = Field("largest |mean of J - 1| if forces balance but incompressible tets change volume; else 0")
    load: float = Field("in equilibria the last factor of the loads that was tried; else 0")


class Separation(Record):
    """Progress of the separation of surfaces that overlapped at the start, in pairs of surface patches."""
    _ctype = "flesh_separation"
    begun: int = Field("number of ignored pairs where the run began")
    ignored: int = Field("number of ignored pairs now")
    t_apart: float = Field("end of the step since which all pairs touch, s; NaN: not yet, or nothing overlapped")


class EnergyBalance(Record):
    """Balance of a motion's energy with the external work of loads and prescribed motions."""
    _ctype = "flesh_energy_balance"
    begun: int = Field("1: there is a first state")
    supplied: float = Field("external work since the first state, J")
    released: float = Field("energy dissipated by changes of internal variables (something broke), J")
    excess: float = Field("spurious energy now, J")
    gain: float = Field("largest excess beyond rounding and tolerance, as a fraction of `scale`")
    largest: float = Field("the same excess, J")
    t_least: float = Field("time at which it began, s")
    t_largest: float = Field("time at which it was largest, s")
    scale: float = Field("largest energy above the lowest potential so far, J")
    t_since: float = Field("time at which energy minus work was smallest, s")
    worst_tet: int = Field("tet with the smallest J when an excess was last reported, or -1")
    fastest_node: int = Field("fastest node at that time, or -1")
    worst_J: float = Field("the tet's J")
    worst_position: np.ndarray = Field("[3] the tet's centre, m")
    fastest_position: np.ndarray = Field("[3] the node's position, m")
    fastest_speed: float = Field("the node's speed, m/s")
