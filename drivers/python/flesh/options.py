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
    """Order of accuracy in time; 0 for statics and for ida, which chooses it."""
    return lib.flesh_method_order(METHOD_NAMES.value(method, "method"))


class SolverOptions(Options):
    """How a step or an equilibrium is solved: SolverOptions(newton_tolerance=1e-8, threads=2)."""
    _ctype = "flesh_solver_options"
    newton_tolerance: float = Field("converged when |r| <= this times the larger of the load and the first residual")
    linear_tolerance: float = Field("residual reduction of each linear solve")
    max_newton: int = Field("iterations of a solve")
    max_linear: int = Field("iterations of a linear solve")
    max_cutbacks: int = Field("how often a failing step or load increment may be halved")
    linear_solver: str = Field("who solves linear systems", _LINEAR)
    preconditioner: str = Field("of pcg", _PRECONDITIONERS)
    eigenvalue_filter: str = Field("what becomes of negative eigenvalues, and when", FILTERS)
    line_search: str = Field("how the length of a step is chosen", _LINE_SEARCH)
    accept_unconverged: int = Field("1: a solve that ends at max_newton without convergence is accepted")
    techniques: tuple = Field("what helps where plain Newton steps are slow, as a tuple of", _TECHNIQUES)
    threads: int = Field("0: one for each processor; results do not depend on it")
    lag_iterations: int = Field("how often at most a step is solved, with what is lagged as the last solve left it")

    def _default(self):
        lib.flesh_solver_options_default(self._struct)


class MethodOptions(Options):
    """Parameters of the methods, each of which reads its own only.

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
    """Of ida, and of the other methods whose steps their error chooses (control)."""
    _ctype = "flesh_adaptive_options"
    control: int = Field("1: methods that estimate their error (runge-kutta) choose their own steps by it")
    tolerance: float = Field("error of positions to aim at, as a share of the body's longest side")
    max_order: int = Field("1 to 5; above 2 not A-stable")
    max_step: float = Field("s; inf: no limit")
    max_steps: int = Field("internal steps in one step")

    def _default(self):
        lib.flesh_adaptive_options_default(self._struct)


class SolveStats(Record):
    """What a solve took, or the sum over a step with its cutbacks."""
    _ctype = "flesh_solve_stats"
    solves: int = Field("nonlinear solves")
    newton: int = Field("Newton iterations")
    linear: int = Field("iterations of linear solves")
    assemblies: int = Field("Hessians assembled")
    projections: int = Field("of these with projected eigenvalues")
    residuals: int = Field("residuals evaluated")
    potentials: int = Field("potentials evaluated")
    backtracks: int = Field("line-search reductions")
    subdomains: int = Field("solves for few nodes alone")
    subdomain_newton: int = Field("their Newton iterations")
    subdomain_share: float = Field("these, each counted as its elements' share of all")
    watchdog_steps: int = Field("steps beyond what cut them that were taken")
    potential_rises: int = Field("iterates whose potential lies above the first one's")
    at_rounding: int = Field("solves that ended at rounding above the tolerance")
    untanglings: int = Field("how often tangles were removed")
    untangled_nodes: int = Field("nodes moved by that")
    unconverged: int = Field("solves accepted without convergence")
    linear_single: int = Field("those of `linear` in single precision")
    multiplier_updates: int = Field("of the pressures of incompressible tets, each followed by a solve")
    direct: int = Field("linear solves by a direct factorisation")
    residual_first: float = Field("2-norm over the free dofs at the first iterate, N, of the last solve")
    residual_last: float = Field("at its end, N")
    residual_target: float = Field("what it was to reach, N")
    steps: int = Field("internal steps of the integrator")
    rejected: int = Field("steps thrown away because they erred too much, or gained energy")
    convergence_failures: int = Field("steps thrown away because Newton did not converge")
    order: int = Field("of the last step")
    impact_steps: int = Field("steps taken by backward Euler because an obstacle barred the way")
    damped_steps: int = Field("steps taken by backward Euler out of a tangle, or because the method's own gained energy")
    h_last: float = Field("length of the last step, s")


class Progress(Record):
    """Where a step that is being made stands."""
    _ctype = "flesh_progress"
    t: float = Field("start of the part that is tried, s")
    h: float = Field("its length, s")
    newton: int = Field("Newton iteration of the solve under way")
    linear: int = Field("iterations of this solve so far")
    residual: float = Field("at its last linear solve, N")
    target: float = Field("what it is to reach, N")


class Failure(Record):
    """Everything known when a step could not be taken."""
    _ctype = "flesh_failure"
    status: int = Field("of the last attempt")
    t: float = Field("where it was tried last, s")
    h: float = Field("s")
    halvings: int = Field("how deep")
    residual: float = Field("2-norm over the free dofs, N")
    target: float = Field("N")
    worst_tet: int = Field("smallest J at the last iterate, or -1")
    worst_J: float = Field("its J")
    worst_position: np.ndarray = Field("[3] its middle, m")
    worst_node: int = Field("largest residual at the last iterate (ida: local error), or -1")
    order: int = Field("ida: of the last attempt; else 0")
    volume_gap: float = Field("largest |mean of J - 1| where forces balance and incompressible tets do not; else 0")
    load: float = Field("in equilibria the factor of the loads that was tried last; else 0")


class Separation(Record):
    """How far surfaces that went through each other at the start are apart; in pairs of patches of them."""
    _ctype = "flesh_separation"
    begun: int = Field("pairs where the run began")
    ignored: int = Field("pairs now")
    t_apart: float = Field("end of the step since which all touch, s; NaN: not yet, or nothing went through anything")


class EnergyBalance(Record):
    """The balance of a motion's energy with the work that loads and motions have put in."""
    _ctype = "flesh_energy_balance"
    begun: int = Field("there is a first state")
    supplied: float = Field("work put in since the first state, J")
    released: float = Field("what changes of internal variables have dissipated (something broke), J")
    excess: float = Field("spurious energy now, J")
    gain: float = Field("largest excess beyond rounding and tolerance, as a share of `scale`")
    largest: float = Field("with the excess, J")
    t_least: float = Field("time at which it began, s")
    t_largest: float = Field("time at which it was that large, s")
    scale: float = Field("most energy above the lowest potential so far, J")
    t_since: float = Field("when energy minus work was least, s")
    worst_tet: int = Field("tet with the smallest J where an excess was reported last, or -1")
    fastest_node: int = Field("fastest node there, or -1")
    worst_J: float = Field("the tet's J")
    worst_position: np.ndarray = Field("[3] its middle, m")
    fastest_position: np.ndarray = Field("[3] m")
    fastest_speed: float = Field("m/s")
