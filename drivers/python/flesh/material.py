"""material.py: energy densities psi, built-in or your own, and stresses and Hessians at a deformation gradient."""
from typing import Callable, NamedTuple, Optional

import numpy as np

from . import _callbacks
from ._arrays import Field, Names, Record, doubles, pointer
from ._callbacks import Const, call
from ._library import ffi, lib
from .errors import ArgumentError

__all__ = ["Material", "Psi", "SmallStrain", "EigenPairs", "FORMS", "CONSTANTS", "FORM_CONSTANTS"]

_FORMS = Names("flesh_energy", "FLESH_ENERGY_", lib.flesh_energy_name)
_CONSTANTS = Names("flesh_constants", "FLESH_CONSTANTS_", lib.flesh_constants_name)

FORMS = tuple(name for name in _FORMS.words if name != "user")
"""Names of the built-in forms, as in a scene."""
CONSTANTS = tuple(_CONSTANTS.words)
"""How small-strain constants become those of a form: used as they are, matched at rest, or (D) as E's."""
FORM_CONSTANTS = tuple(name for name, _type in ffi.typeof("flesh_material_given").fields
                       if name not in ("mu", "lambda", "young", "poisson"))
"""Names of the constants that some form has beyond mu and lambda."""


class Psi(Record):
    """psi and its derivatives with respect to I_C = tr(F^T F) and J = det F, J/m^3."""
    _ctype = "flesh_psi"
    value: float = Field("value of psi")
    I: float = Field("d psi / d I_C")
    J: float = Field("d psi / d J")
    II: float = Field("second derivative with respect to I_C")
    IJ: float = Field("mixed second derivative with respect to I_C and J")
    JJ: float = Field("second derivative with respect to J")


class SmallStrain(NamedTuple):
    """The linearisation at F = I."""
    mu: float  # Pa
    lambda_: float  # Pa
    rest_stress: float  # Pa, P(I) = rest_stress * identity


class EigenPairs(NamedTuple):
    """Eigenpairs of the Hessian d vec(P) / d vec(F)."""
    values: np.ndarray  # [9] Pa: three of scaling, three twists, three flips
    vectors: np.ndarray  # [9, 3, 3] unit eigenvectors Q_k


def _one_of(enum, word, find, name):
    if not isinstance(word, str):
        raise ArgumentError(f"{name} is {word!r}; it must be a name")
    out = ffi.new(f"{enum} *")
    call(find, word.encode(), out)
    return out[0]


class Material(Const):
    """A material: one of the built-in forms with its constants. Copied freely, const once made.

    Give `young` and `poisson`, or `mu` and `lambda_`.

    Args:
        form: "Neo", "A" ... "S", "Fung", "StVK", or a full name ("stable-neo-hookean"); see FORMS.
        constants: "matched" (default if the form has matched ones), "raw" or "as_e".
        young: Young's modulus of small strain, Pa.
        poisson: Poisson's ratio of small strain, in (-1, 0.5]; 0.5 on ten-node tets, for forms with a volume term.
        mu: Lame's mu of small strain, Pa.
        lambda_: Lame's lambda of small strain, Pa.
        form_constants: further constants of the form: exponent=0.5 (b of Fung), links=8 (N of Arruda & Boyce); see
            flesh.FORM_CONSTANTS.

    Raises:
        ArgumentError: constants that the form cannot have, with the limit.
    """

    def __init__(self, form: str = "S", constants: Optional[str] = None, *, young: Optional[float] = None,
                 poisson: Optional[float] = None, mu: Optional[float] = None, lambda_: Optional[float] = None,
                 **form_constants: float):
        self._struct = ffi.new("flesh_material *")
        energy = _one_of("flesh_energy", form, lib.flesh_energy_from_name, "form")
        given = ffi.new("flesh_material_given *")
        lib.flesh_material_given_default(given)
        for name, value in {"mu": mu, "lambda": lambda_, "young": young, "poisson": poisson, **form_constants}.items():
            if name in form_constants and name not in FORM_CONSTANTS:
                raise ArgumentError(f"a material has no {name!r}; constants of forms are {', '.join(FORM_CONSTANTS)}")
            if value is not None:
                setattr(given, name, float(value))
        if constants is None:
            # As in a scene: matched if the form can be, which a trial with any valid constants shows.
            constants = "raw" if lib.flesh_material_from_young(energy, lib.FLESH_CONSTANTS_MATCHED, 1, 0.25,
                                                               self._struct) else "matched"
        how = _one_of("flesh_constants", constants, lib.flesh_constants_from_name, "constants")
        call(lib.flesh_material_from_given, energy, how, given, self._struct)
        self._keep = ()

    @classmethod
    def from_lame(cls, form: str, constants: str, mu: float, lambda_: float) -> "Material":
        """Makes a material from the small-strain constants mu and lambda, Pa."""
        made = cls.__new__(cls)
        made._struct, made._keep = ffi.new("flesh_material *"), ()
        call(lib.flesh_material_from_lame, _one_of("flesh_energy", form, lib.flesh_energy_from_name, "form"),
             _one_of("flesh_constants", constants, lib.flesh_constants_from_name, "constants"), mu, lambda_,
             made._struct)
        return made

    @classmethod
    def from_young(cls, form: str, constants: str, young: float, poisson: float) -> "Material":
        """Makes a material from Young's modulus, Pa, and Poisson's ratio."""
        made = cls.__new__(cls)
        made._struct, made._keep = ffi.new("flesh_material *"), ()
        call(lib.flesh_material_from_young, _one_of("flesh_energy", form, lib.flesh_energy_from_name, "form"),
             _one_of("flesh_constants", constants, lib.flesh_constants_from_name, "constants"), young, poisson,
             made._struct)
        return made

    @classmethod
    def from_psi(cls, psi: Callable, mu: float = float("nan"), lambda_: float = float("nan"),
                 volume: Optional[Callable] = None) -> "Material":
        """Makes a material of your own psi(I_C, J).

        Args:
            psi: returns (value, I, J, II, IJ, JJ), psi and its derivatives as in Psi, J/m^3; raises UndefinedError
                if the form has no value. Must depend on its arguments only: it is called from several threads, once
                for every tet and point. A compiled function (a ctypes or cffi function pointer with the C signature
                flesh_psi_function) is called directly and costs as much as a built-in form.
            mu: Pa, stored for psi to read.
            lambda_: Pa; if given, psi contains lambda U(J), of which ten-node tets take a mean.
            volume: U(J), returns (value, J, JJ), U and its first and second derivatives, with J 0 and JJ 1 at J = 1; may
                be compiled (flesh_volume_function). None: U = (J-1)^2/2.
        """
        made = cls.__new__(cls)
        made._struct = ffi.new("flesh_material *")
        function, made._keep = _psi_function(psi)
        call(lib.flesh_material_from_psi, function, ffi.NULL, made._struct)
        if volume is not None:
            made._struct.volume, keep = _volume_function(volume)
            made._keep += keep
        setattr(made._struct, "mu", mu)
        setattr(made._struct, "lambda", lambda_)
        return made

    @classmethod
    def _copy(cls, struct, owner) -> "Material":
        made = cls.__new__(cls)
        made._struct, made._keep = ffi.new("flesh_material *"), owner
        made._struct[0] = struct[0]
        return made

    @property
    def form(self) -> str:
        """Name of the form; "user" for one of your own."""
        return _FORMS.word(self._struct.energy)

    @property
    def constants(self) -> str:
        """"raw", "matched" or "as_e"."""
        return _CONSTANTS.word(self._struct.constants)

    @property
    def mu(self) -> float:
        """mu of the formula, Pa; NaN for a psi of your own that has not set it."""
        return self._struct.mu

    @property
    def lambda_(self) -> float:
        """lambda of the formula, Pa; NaN for a psi of your own that has not set it."""
        return getattr(self._struct, "lambda")

    @property
    def alpha(self) -> float:
        """Rest offset of J that follows from mu and lambda; 1 if the form has none."""
        return self._struct.alpha

    for _name in FORM_CONSTANTS:
        vars()[_name] = property(lambda self, _name=_name: getattr(self._struct, _name),
                                 doc="See body.material.{0} in flesh.schema(); 0 for other forms.".format(_name))

    @property
    def incompressible(self) -> bool:
        """Whether Poisson's ratio is 1/2: pressures are then multipliers of the tets, and psi includes a penalty."""
        return bool(self._struct.incompressible)

    @property
    def young(self) -> float:
        """Young's modulus as given, Pa; NaN if mu and lambda were given."""
        return self._struct.young

    @property
    def poisson(self) -> float:
        """Poisson's ratio as given; NaN if mu and lambda were given."""
        return self._struct.poisson

    def psi(self, I_C: float, J: float) -> Psi:
        """Returns psi and its derivatives at one (I_C, J). UndefinedError if it has none."""
        out = Psi()
        call(self._struct.psi, float(I_C), float(J), self._struct, out._struct)
        return out

    def small_strain(self) -> SmallStrain:
        """Returns mu and lambda of the linearisation at F = I and the stress there, Pa."""
        out = ffi.new("double[3]")
        call(lib.flesh_material_small_strain, self._struct, out, out + 1, out + 2)
        return SmallStrain(*out)

    def rest_ratio(self) -> float:
        """Returns J*, at which a free body is at rest; UndefinedError if there is none."""
        out = ffi.new("double *")
        call(lib.flesh_material_rest_ratio, self._struct, out)
        return out[0]

    def _each(self, function, F, shape):
        gradients = doubles(F, np.shape(F)[:-2] + (3, 3), "F")
        out = np.empty(gradients.shape[:-2] + shape)
        inputs, outputs = gradients.reshape(-1, 9), out.reshape(-1, int(np.prod(shape)))
        for k in range(len(inputs)):
            call(function, self._struct, pointer(inputs[k]), pointer(outputs[k]))
        return out

    def energy(self, F) -> np.ndarray:
        """Returns psi(F) [...], J/m^3, for deformation gradients F [..., 3, 3]."""
        return self._each(lib.flesh_material_energy, F, ())[()]

    def stress(self, F) -> np.ndarray:
        """Returns the first Piola-Kirchhoff stress P [..., 3, 3], Pa, for F [..., 3, 3]."""
        return self._each(lib.flesh_material_stress, F, (3, 3))

    def hessian(self, F) -> np.ndarray:
        """Returns d vec(P) / d vec(F) [..., 9, 9], Pa, for F [..., 3, 3]; vec is row-major."""
        return self._each(lib.flesh_material_hessian, F, (9, 9))

    def hessian_projected(self, F) -> np.ndarray:
        """Returns the Hessian [..., 9, 9] with its negative eigenvalues set to zero, Pa."""
        return self._each(lib.flesh_material_hessian_projected, F, (9, 9))

    def eigen(self, F) -> EigenPairs:
        """Returns the nine eigenpairs of the Hessian in closed form, for one F [3, 3]."""
        values, vectors = np.empty(9), np.empty((9, 3, 3))
        call(lib.flesh_material_eigen, self._struct, pointer(doubles(F, (3, 3), "F")), pointer(values), pointer(vectors))
        return EigenPairs(values, vectors)

    def __repr__(self):
        return f"<flesh.Material {self.form}, {self.constants}: mu {self.mu:g} Pa, lambda {self.lambda_:g} Pa>"


def _compiled(function, kind):
    """Returns a compiled function as a C function of this kind; None for a Python function."""
    if isinstance(function, ffi.CData):
        return ffi.cast(kind, function)
    if hasattr(function, "_objects") or type(function).__name__ == "CFunctionType":
        import ctypes
        return ffi.cast(kind, ctypes.cast(function, ctypes.c_void_p).value)
    return None


def _volume_function(volume):
    """Returns the C function of a volume part U, and the objects that must live as long."""
    compiled = _compiled(volume, "flesh_volume_function")
    if compiled is not None:
        return compiled, (volume,)
    if not callable(volume):
        raise ArgumentError(f"volume is {volume!r}; it must be a function of J")

    def evaluate(J, _material, out):
        value = volume(J)
        try:
            out.value, out.J, out.JJ = value
        except (TypeError, ValueError):
            raise ArgumentError(f"volume({J:g}) returned {value!r}; it must be (value, J, JJ)") from None
    function = _callbacks.status_callback("int(double, const struct flesh_material *, flesh_volume_part *)", evaluate)
    return function, (function, volume)


def _psi_function(psi):
    """Returns the C function of a psi, and the objects that must live as long."""
    compiled = _compiled(psi, "flesh_psi_function")
    if compiled is not None:
        return compiled, (psi,)
    if not callable(psi):
        raise ArgumentError(f"psi is {psi!r}; it must be a function of I_C and J")

    def evaluate(I_C, J, _material, out):
        value = psi(I_C, J)
        try:
            out.value, out.I, out.J, out.II, out.IJ, out.JJ = value
        except (TypeError, ValueError):
            raise ArgumentError(f"psi({I_C:g}, {J:g}) returned {value!r}; it must be "
                                "(value, I, J, II, IJ, JJ)") from None
    function = _callbacks.status_callback("int(double, double, const struct flesh_material *, flesh_psi *)", evaluate)
    return function, (function, psi)
