"""effects.py: the effects that come with the library."""
from typing import Optional

import numpy as np

from ._arrays import Field, Names, Record, doubles, integers, pointer
from ._callbacks import Handle, call, create, owned
from ._library import ffi, lib, text
from .body import Body
from .errors import ArgumentError
from .mesh import Mesh
from .motion import Amplitude, Motion, Obstacle

__all__ = ["Effect", "Inertia", "Elasticity", "Gravity", "Spring", "Damping", "SettlingDamping", "Viscosity", "Force",
           "Traction", "Pressure", "Drag", "Buoyancy", "Weld", "Joint", "JointSpring", "Contact", "SurfaceContact",
           "DerivativeReport", "ROLES"]

_ROLES = Names("flesh_role", "FLESH_ROLE_")
ROLES = tuple(_ROLES.words)
"""What an effect may be to a body."""


class DerivativeReport(Record):
    """Relative errors of the consistency of an effect's potential, residual and Jacobian.

    The columns are the shifts of statics and of the midpoint rule with h = 1/60 s. NaN: the effect lacks the operation.
    """
    _ctype = "flesh_derivative_report"
    potential: np.ndarray = Field("[2] error of the residual as the gradient of the potential, and of the energy")
    jacobian: np.ndarray = Field("[2] error of the Jacobian as the derivative of the residual")
    evaluate: np.ndarray = Field("[2] error of residual and potential in one pass")
    asymmetry: float = Field("asymmetry of the diagonal blocks")
    negative: float = Field("most negative curvature of the projected Jacobian over its largest")

    def passes(self, tolerance: float = 1e-6) -> bool:
        """Returns whether every measured error is below `tolerance`."""
        return bool(lib.flesh_derivative_report_passes(self._struct, tolerance))


class Effect(Handle):
    """An action on a body. A system takes ownership of an effect, which then lives as long as the system.

    Every effect is a residual r(t, x, v, a), a gradient of its potential, and a Jacobian. To write one of your own,
    derive from OwnEffect.
    """
    _own = _owner = None

    def _take(self, made, *keep):
        self._own, self._keep, self._owner = owned("flesh_effect", made, lib.flesh_effect_destroy), keep, None
        return self

    @property
    def _pointer(self):
        if self._own is None:
            made = type(self).__name__
            raise ArgumentError(f"this {made} was never made; its __init__ must call super().__init__(mesh)")
        if not self._own:
            raise ArgumentError("this effect is gone: the system that was to take it refused it")
        return self._own

    @classmethod
    def _of(cls, pointer_, owner) -> "Effect":
        """Wraps an effect that belongs to `owner`."""
        made = Effect.__new__(Effect)
        made._own, made._keep, made._owner = pointer_, (), owner
        return made

    def _give(self, owner):
        """Returns the pointer for a function that takes ownership; from then on it is `owner`'s."""
        pointer_ = self._pointer
        if self._owner is not None:
            raise ArgumentError(f"a system has taken this effect ({self.name}) already; each system needs its own")
        ffi.gc(pointer_, None)
        self._owner, self._own = owner, ffi.NULL
        return ffi.new("flesh_effect **", pointer_)

    @property
    def _operations(self):
        return self._pointer.operations

    @property
    def name(self) -> str:
        """Name in histories and messages."""
        return text(self._operations.name)

    @property
    def role(self) -> str:
        """Role of the effect in a body: one of ROLES."""
        return _ROLES.word(self._operations.role)

    def check_derivatives(self, mesh: Mesh, x, t: float = 0.0, seed: int = 1) -> DerivativeReport:
        """Checks by differences at x [nodes, 3] m and t s that residual, potential and Jacobian are consistent.

        x should be generic, not the rest state, where gradients vanish. Raises the effect's error if it cannot be
        evaluated (UndefinedError: choose another x).
        """
        report = DerivativeReport()
        call(lib.flesh_effect_check_derivatives, self._pointer, mesh._pointer, float(t),
             pointer(doubles(x, (mesh.node_count, 3), "x")), seed, report._struct)
        return report

    def __repr__(self):
        return f"<flesh.{type(self).__name__} {self.name!r}, {self.role}>"


def _vector(values, name):
    return pointer(doubles(values, (3,), name))


def _amplitude(amplitude: Optional[Amplitude]):
    return ffi.NULL if amplitude is None else amplitude._struct


class Inertia(Effect):
    """Inertia r = M a, with the body's lumped or consistent mass."""

    def __init__(self, body: Body):
        self._take(create("flesh_effect", lib.flesh_effect_inertia, body._struct), body)


class Elasticity(Effect):
    """Elasticity r = dV/dx, V the sum of volume * psi(F)."""

    def __init__(self, body: Body):
        self._take(create("flesh_effect", lib.flesh_effect_elasticity, body._struct), body)


class Gravity(Effect):
    """Gravity r = -load M g with the acceleration g [3], m/s^2."""

    def __init__(self, body: Body, acceleration=(0, 0, -9.81)):
        self._take(create("flesh_effect", lib.flesh_effect_gravity, body._struct,
                          _vector(acceleration, "acceleration")), body)



class Spring(Effect):
    """A spring of `stiffness` N/m from the body's point nearest to `point` [3] m at rest to a moving target.

    `target` is a Motion whose translation is the target's position, or a fixed position [3] m; start <= t < until, s.
    The spring pulls the point without a torque about it, through all nodes within `radius` m, which carry the point; at
    most 1200. 0: through the nodes of the point's tet only, whose displacement grows as the mesh is refined; None: a
    twentieth of the body's longest side.
    """

    def __init__(self, body: Body, point, stiffness: float, target, start: float = 0.0, until: float = np.inf,
                 radius: Optional[float] = 0.0):
        motion = target if isinstance(target, Motion) else Motion.fixed(target)
        within = (motion._struct, float(start), float(until))
        if radius == 0:
            made = create("flesh_effect", lib.flesh_effect_spring, body._struct, _vector(point, "point"),
                          float(stiffness), *within)
        else:
            made = create("flesh_effect", lib.flesh_effect_spring_within, body._struct, _vector(point, "point"),
                          np.nan if radius is None else float(radius), float(stiffness), *within)
        self._take(made, body)



class Damping(Effect):
    """Rayleigh damping r = mass M v + stiffness K v; mass in 1/s, stiffness in s; K "rest" or "current"."""

    def __init__(self, body: Body, mass: float = 0.0, stiffness: float = 0.0, stiffness_at: str = "rest"):
        kinds = Names("flesh_stiffness", "FLESH_STIFFNESS_")
        self._take(create("flesh_effect", lib.flesh_effect_damping, body._struct, float(mass), float(stiffness),
                          kinds.value(stiffness_at, "stiffness_at")), body)


class SettlingDamping(Effect):
    """Artificial damping: r = rate w M v, rate in 1/s; w rises from 0 to 1 between speed/2 and speed, m/s."""

    def __init__(self, body: Body, rate: float, speed: float = 0.0, start: float = 0.0, until: float = np.inf):
        self._take(create("flesh_effect", lib.flesh_effect_settling_damping, body._struct, float(rate), float(speed),
                          float(start), float(until)), body)


class Viscosity(Effect):
    """Kelvin-Voigt damping by the rate of the Green strain; shear and bulk viscosities in Pa s."""

    def __init__(self, body: Body, shear: float = 0.0, bulk: float = 0.0):
        self._take(create("flesh_effect", lib.flesh_effect_viscosity, body._struct, float(shear), float(bulk)), body)


class Force(Effect):
    """A dead load: a total force of `force` [3] N, shared evenly by `nodes` [count]."""

    def __init__(self, body: Body, nodes, force, amplitude: Optional[Amplitude] = None):
        chosen = integers(nodes, (None,), "nodes")
        self._take(create("flesh_effect", lib.flesh_effect_force, body._struct, len(chosen), pointer(chosen, "int"),
                          _vector(force, "force"), _amplitude(amplitude)), body)


class Traction(Effect):
    """A dead load of `traction` [3] Pa per area at rest on `triangles` [count, 3] of the mesh's surface."""

    def __init__(self, body: Body, triangles, traction, amplitude: Optional[Amplitude] = None):
        chosen = integers(triangles, (None, 3), "triangles")
        self._take(create("flesh_effect", lib.flesh_effect_traction, body._struct, len(chosen), pointer(chosen, "int"),
                          _vector(traction, "traction"), _amplitude(amplitude)), body)


class Pressure(Effect):
    """A pressure, Pa, on the deformed `triangles` [count, 3], wound outwards."""

    def __init__(self, body: Body, triangles, pressure: float, amplitude: Optional[Amplitude] = None):
        chosen = integers(triangles, (None, 3), "triangles")
        self._take(create("flesh_effect", lib.flesh_effect_pressure, body._struct, len(chosen), pointer(chosen, "int"),
                          float(pressure), _amplitude(amplitude)), body)


class Drag(Effect):
    """Drag: a fluid of `density`, kg/m^3, and `velocity` [3] m/s presses on `triangles` that move against it.

    The pressure is coefficient * density/2 * s^2, s > 0 the normal speed of a face against the stream.
    """

    def __init__(self, body: Body, triangles, density: float, velocity=(0.0, 0.0, 0.0), coefficient: float = 1.0):
        chosen = integers(triangles, (None, 3), "triangles")
        self._take(create("flesh_effect", lib.flesh_effect_drag, body._struct, len(chosen), pointer(chosen, "int"),
                          float(density), _vector(velocity, "velocity"), float(coefficient)), body)


class Buoyancy(Effect):
    """Pressure of a fluid of `density`, kg/m^3, below `level`, m, a height against `acceleration` [3] m/s^2."""

    def __init__(self, body: Body, level: float, density: float = 1000.0, acceleration=(0.0, 0.0, -9.81)):
        self._take(create("flesh_effect", lib.flesh_effect_buoyancy, body._struct, float(level), float(density),
                          _vector(acceleration, "acceleration")), body)


class Weld(Effect):
    """Ties two facing surfaces `first` and `second` [count, 3], triangles of meshes that need not match.

    Args:
        distance: m, largest distance between them at rest, apart or overlapping.
        stiffness: Pa/m; None: 30 times 3 mu over an edge of the softer side.
        breaks_at: Pa; the overlap of two triangles breaks if the root of tension^2 + shear^2 exceeds it at the end of
            a step; None: nothing breaks.
    """

    def __init__(self, body: Body, first, second, distance: float = 1e-6, stiffness: Optional[float] = None,
                 breaks_at: Optional[float] = None):
        sides = [integers(side, (None, 3), name) for side, name in ((first, "first"), (second, "second"))]
        given = [np.nan if value is None else float(value) for value in (stiffness, breaks_at)]
        triangles = [ffi.new("flesh_triangles *", (len(side), pointer(side, "int")))[0] for side in sides]
        self._take(create("flesh_effect", lib.flesh_effect_weld, body._struct, *triangles, float(distance), *given),
                   body)



class Joint(Effect):
    """A joint of two groups of nodes, which rotate about a point (ball) or an axis (hinge).

    Args:
        first, second: [count] the groups; each node is coupled with every other.
        point: [3] m, position of the joint at rest.
        stiffness: N/m, against separation; a hinge has half of it at either end of the axis.
        axis: [3] m, from one end of a hinge to the other, with the point in the middle; None: a ball.
    """

    def __init__(self, body: Body, first, second, point, stiffness: float, axis=None):
        sides = [integers(side, (None,), name) for side, name in ((first, "first"), (second, "second"))]
        nodes = [ffi.new("flesh_nodes *", (len(side), pointer(side, "int")))[0] for side in sides]
        self._take(create("flesh_effect", lib.flesh_effect_joint, body._struct, *nodes, _vector(point, "point"),
                          ffi.NULL if axis is None else _vector(axis, "axis"), float(stiffness)), body)


class JointSpring(Effect):
    """A spring between two points that groups of nodes carry along.

    Args:
        first, second: [count] the groups; each node is coupled with every other.
        first_point, second_point: [3] m, at rest, the point that each group carries along.
        stiffness: N/m.
        length: m, at which the spring has no force; None: the distance at rest; 0: the points are drawn together.
    """

    def __init__(self, body: Body, first, second, first_point, second_point, stiffness: float,
                 length: Optional[float] = None):
        sides = [integers(side, (None,), name) for side, name in ((first, "first"), (second, "second"))]
        points = [doubles(point, (3,), name) for point, name in ((first_point, "first_point"),
                                                                 (second_point, "second_point"))]
        ends = [ffi.new("flesh_carried_point *", ((len(side), pointer(side, "int")), list(point)))
                for side, point in zip(sides, points)]
        self._take(create("flesh_effect", lib.flesh_effect_joint_spring, body._struct, *ends, float(stiffness),
                          float("nan") if length is None else float(length)), body)


def _contact_options(stiffness, thickness, friction, slip_speed):
    options = ffi.new("flesh_contact_options *")
    lib.flesh_contact_options_default(options)
    for name, value in (("stiffness", stiffness), ("thickness", thickness), ("friction", friction),
                        ("slip_speed", slip_speed)):
        if value is not None:
            setattr(options, name, float(value))
    return options


class Contact(Effect):
    """Keeps a body out of an obstacle, and takes ownership of the obstacle.

    Args:
        stiffness: Pa; None: three times the body's largest shear modulus.
        thickness: m, distance at which the force begins; None: 1/20 of the mean surface edge.
        friction: Coulomb's coefficient.
        slip_speed: m/s, slip speed below which friction is viscous.
    """

    def __init__(self, body: Body, obstacle: Obstacle, stiffness: Optional[float] = None,
                 thickness: Optional[float] = None, friction: Optional[float] = None,
                 slip_speed: Optional[float] = None):
        options = _contact_options(stiffness, thickness, friction, slip_speed)
        place, taken = obstacle._pointer, obstacle._give(self)
        self._take(create("flesh_effect", lib.flesh_effect_obstacle_contact, body._struct, options, taken), body)
        obstacle._pointer = place  # where the effect has it



class SurfaceContact(Effect):
    """Keeps the surfaces of a body's parts out of each other and out of themselves.

    Args:
        pairs: [count, 2] numbers of parts that may touch, the same twice for a part that touches itself; None: all
            pairs, each part with itself included. A body without parts is part 0.
        stiffness, thickness, friction, slip_speed: as for `Contact`.
        separates: surfaces that overlap at the start are ignored until they are apart (`Integrator.separation`); else
            such a start is refused.
        adaptive: the stiffness adapts to the pressures from step to step, beginning with `stiffness`.
    """

    def __init__(self, body: Body, pairs=None, stiffness: Optional[float] = None, thickness: Optional[float] = None,
                 friction: Optional[float] = None, slip_speed: Optional[float] = None, separates: bool = False,
                 adaptive: bool = False):
        options = _contact_options(stiffness, thickness, friction, slip_speed)
        options.separates = bool(separates)
        options.adaptive = bool(adaptive)
        chosen = None if pairs is None else integers(pairs, (None, 2), "pairs")
        count, numbers = (0, ffi.NULL) if chosen is None else (len(chosen), pointer(chosen, "int"))
        self._take(create("flesh_effect", lib.flesh_effect_surface_contact, body._struct, options, count, numbers), body)
