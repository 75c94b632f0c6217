"""fibre.py: tension of muscle fibres, and the effect of fibres in a body."""
from typing import NamedTuple, Optional

from ._arrays import Field, Names, Options, doubles, integers, pointer
from ._callbacks import call, create
from ._library import ffi, lib
from .body import Body
from .effects import Effect
from .motion import Amplitude

__all__ = ["Fibre", "FibreTension", "Muscle", "FIBRE_CURVES"]

_CURVES = Names("flesh_fibre_curve", "FLESH_FIBRE_", lib.flesh_fibre_curve_name)
FIBRE_CURVES = tuple(_CURVES.words)
"""Force-stretch curves of muscle fibres."""


class FibreTension(NamedTuple):
    """Energy, tension and stiffness of a fibre at a stretch, per volume and area of the rest shape."""
    energy: float  # J/m^3
    tension: float  # Pa
    stiffness: float  # Pa, the tension's derivative with respect to the stretch


class Fibre(Options):
    """Tension of a muscle fibre over its stretch; by default the other members are the curve's published passive part.

    Args:
        curve: one of FIBRE_CURVES.
        peak_stress: Pa, at full activation and optimal stretch; not negative.
        values: the other members by name.
    """
    _ctype = "flesh_fibre"
    curve: str = Field("curve of the tension over the stretch", _CURVES)
    peak_stress: float = Field("Pa, fully active at the optimal stretch, per area of the deformed shape")
    optimal_stretch: float = Field("stretch at which the active tension is largest")
    passive_stress: float = Field("Pa, c1 of c1 (exp(c2 (l-1)) - 1), l the stretch over the optimal one; 0: none")
    passive_exponent: float = Field("c2")
    passive_limit: float = Field("l - 1 from which the passive part is linear")
    max_shortening_velocity: float = Field("1/s, in optimal lengths, at full activation; 0: no effect of speed")

    def __init__(self, curve: str = "blemker", peak_stress: float = 3e5, **values: float):
        self._begin = (_CURVES.value(curve, "curve"), float(peak_stress))
        super().__init__(**values)

    def _default(self):
        call(lib.flesh_fibre_default, *self._begin, self._struct)

    def tension(self, stretch: float, activation: float = 1.0) -> FibreTension:
        """Returns energy, tension and stiffness at a stretch."""
        values = ffi.new("double[3]")
        call(lib.flesh_fibre_tension, self._struct, float(activation), float(stretch), values)
        return FibreTension(*values)


class Muscle(Effect):
    """Muscle fibres that pull along their direction in the tets `tets` [count] (ascending; None: all).

    Args:
        fibres: [count, 3] directions at rest, of any length; or one [3] for all.
        fibre: the tension of the fibres.
        activation: active fraction, 0 to 1, in time; None: 1.
    """

    def __init__(self, body: Body, fibres, fibre: Fibre, activation: Optional[Amplitude] = None, tets=None):
        chosen = None if tets is None else integers(tets, (None,), "tets")
        count = body.mesh.tet_count if chosen is None else len(chosen)
        directions = doubles(fibres, (None, 3), "fibres")
        if len(directions) == 1:
            directions = directions.repeat(count, axis=0)
        directions = doubles(directions, (count, 3), "fibres")
        self._take(create("flesh_effect", lib.flesh_effect_muscle, body._struct, count, pointer(chosen, "int"),
                          pointer(directions), fibre._struct, ffi.NULL if activation is None else activation._struct),
                   body)
