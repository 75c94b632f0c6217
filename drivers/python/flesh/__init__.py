"""flesh: dynamics of soft, nearly incompressible bodies, from Python.

    import flesh
    scene = flesh.Scene("bar.yaml")
    for step in scene.steps():
        print(step.t, step.x[-1, 2])

Arrays are numpy's: positions and velocities are [nodes, 3], units are SI. Arrays from the library are views that
cannot be written to and keep their owner alive. Contiguous arrays of doubles are passed without a copy; a Body and
a State have their own copies. Every failure is an exception with the library's sentence (flesh.Error and its kinds).
Calls release the interpreter's lock, and Ctrl-C ends a step cleanly: the state is then that of the last step.

copy and pickle copy states, options and statistics. A mesh, body, material or scene is its own copy. An effect, system,
integrator or history cannot be copied (ArgumentError).

    Mesh, Surface, Skin                 geometry from arrays or files
    Material, Body                      energy densities, built-in or your own; mesh, materials and densities of a body
    Inertia, Elasticity, Gravity, ...   effects; OwnEffect for those written in Python
    System, State, Point, Shift         the sum of effects: residual, Jacobian (scipy.sparse), potential
    Scene                               all of these from YAML, a file or a dict
    Integrator, equilibrium             steps and statics
    run, steps, History, Probes, Frames a run as a loop or as an iterator, and its files
    Parameter, Sensitivity, Trajectory  derivatives of equilibria and motions with respect to inputs
    KinsolProblem, IdaProblem, OdeProblem   the equations for a solver of your own
    run_scene, drift, accuracy, sweep   the program's comparisons as tables
"""
from . import _callbacks, _kinds, body, effects, errors, fibre, frame, integrator, material, mesh, motion, options
from . import output, own_effect, point, results, scene, sensitivity, sundials, surface, system
from ._library import ffi, lib, text
from .body import *
from .effects import *
from .errors import *
from .fibre import *
from .frame import *
from .integrator import *
from .material import *
from .mesh import *
from .motion import *
from .options import *
from .output import *
from .own_effect import *
from .results import *
from .scene import *
from .sensitivity import *
from .sundials import *
from .surface import *
from .point import *
from .system import *

__version__ = text(lib.flesh_version())
__all__ = ["__version__", "set_error_handler"]
for _module in (body, effects, errors, fibre, frame, integrator, material, mesh, motion, options, output, own_effect,
                point, results, scene, sensitivity, sundials, surface, system):
    __all__ += _module.__all__
    globals().update(_kinds.check(_module))

_handler = None


def set_error_handler(handler) -> None:
    """Sets handler(status, sentence), called for every failure that the library records; None: no handler.

    A positive status is recoverable. It may be called from threads of the library.
    """
    global _handler
    if handler is not None and not callable(handler):
        raise ArgumentError(f"handler is {handler!r}; it must be a function, or None")
    function = ffi.NULL if handler is None else _callbacks.value_callback(
        "flesh_error_handler", lambda _data, status, sentence: handler(status, text(sentence)))
    lib.flesh_set_error_handler(function, ffi.NULL)
    _handler = function  # set after the call, as another thread may still be within the previous handler
