"""scene.py: scenes from YAML text, a file or a dict, by the same reader as the program's."""
import json
import math
import os
from typing import Iterator, List, Mapping, NamedTuple, Optional, Tuple, Union

import numpy as np

from . import _callbacks
from ._arrays import Field, Names, Record
from ._callbacks import Const, call, create, owned
from ._library import ffi, free, lib, path_bytes, text
from .body import Body
from .errors import ArgumentError
from .integrator import Integrator
from .material import Material
from .mesh import Mesh
from .options import METHOD_NAMES, AdaptiveOptions, MethodOptions, SolverOptions
from .output import FIELDS, PLACES, Probe, StepRecord, run, steps
from .system import State, System

__all__ = ["Scene", "SceneTime", "SceneOutput", "Camera", "schema"]

_SCHEMAS = Names("flesh_schema_format", "FLESH_SCHEMA_")
_SKIN_FORMATS = {"obj": lib.FLESH_SKIN_OBJ, "pc2": lib.FLESH_SKIN_PC2, "vtu": lib.FLESH_SKIN_VTU}


class SceneTime(NamedTuple):
    """Time settings of a scene."""
    method: str  # "static" when the scene has no inertia
    step: float  # s
    end: float  # s
    max_energy_gain: float
    options: MethodOptions
    adaptive: AdaptiveOptions


class Camera(Record):
    """Camera of pictures; members that are NaN are fitted to the body."""
    _ctype = "flesh_camera"
    up: np.ndarray = Field("[3] direction that points upwards in the picture")
    azimuth: float = Field("camera's position about `up`, degrees")
    elevation: float = Field("camera's position above the horizon, degrees")
    target: np.ndarray = Field("[3] centre of the picture, m")
    height: float = Field("height of the visible region at the target, m")
    field_of_view: float = Field("degrees; 0: parallel projection")


class SceneOutput(NamedTuple):
    """Output settings of a scene."""
    frame_interval: int  # steps between frames; 0: none
    seed: int
    skin_surface: Optional[str]  # absolute path; None: no skin
    skin_formats: List[str]
    camera: Camera
    fields: Tuple[str, ...]  # fields of frames, for Frames.set_fields
    fields_at: Tuple[str, ...]


def _flow(value):
    """Returns a value as YAML in one line."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{json.dumps(str(key))}: {_flow(item)}" for key, item in value.items()) + "}"
    if isinstance(value, np.ndarray):
        return _flow(value.tolist())
    if isinstance(value, np.generic):
        return _flow(value.item())
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_flow(item) for item in value) + "]"
    if isinstance(value, float) and not math.isfinite(value):
        return ".nan" if math.isnan(value) else ".inf" if value > 0 else "-.inf"
    if isinstance(value, os.PathLike):
        value = os.fspath(value)
    try:
        return json.dumps(value, ensure_ascii=False)
    except TypeError:
        valid = "a dict, a list, a text, a number, True, False or None"
        raise ArgumentError(f"a scene has {value!r}; it must be {valid}") from None


def _overrides(given):
    """Returns the count, the texts, and the objects that cffi must keep alive."""
    rows = [f"{key}={_flow(value)}" for key, value in given.items()] if isinstance(given, Mapping) else \
        [given] if isinstance(given, str) else list(given or ())
    texts = [ffi.new("char[]", path_bytes(row)) for row in rows]
    return len(rows), ffi.new("char *[]", texts) if texts else ffi.NULL, texts


def _named(name, folder):
    return name if folder == os.curdir else os.path.join(folder, name)


class Scene(Const):
    """A mesh, a system and the options of a run, from YAML or JSON. Its parts keep it alive.

    Args:
        source: a path, or the scene as a dict: {"body": {...}, "effects": [...], "time": {...}}.
        overrides: applied in their order before validation: {"time.method": "bdf2"}, or "path.to.key=value" strings.
        folder: folder to which paths in a dict are relative.

    Raises:
        ArgumentError: a bad scene or override, with file, line, column, key, and what is valid.
        FileError: a file or mesh that cannot be read.
        KeyboardInterrupt: Ctrl-C while it is read.
    """

    def __init__(self, source: Union[str, os.PathLike, Mapping], overrides=None, folder=os.curdir):
        if isinstance(source, Mapping):
            self._read(overrides, lib.flesh_scene_read_text, path_bytes(_flow(source)),
                       path_bytes(_named("scene", folder)))
        else:
            self._read(overrides, lib.flesh_scene_read, path_bytes(source))

    def _read(self, overrides, function, *arguments):
        count, rows, _keep = _overrides(overrides)
        # Python handles signals while it runs this function: KeyboardInterrupt is raised in it.
        stop = _callbacks.status_callback("int(void *)", lambda _data: 0)
        lib.flesh_scene_set_stop(stop, ffi.NULL)
        try:
            return self._take(create("flesh_scene", function, *arguments, count, rows))
        finally:
            lib.flesh_scene_set_stop(ffi.NULL, ffi.NULL)

    def _take(self, made):
        self._pointer = owned("flesh_scene", made, lib.flesh_scene_destroy, holder=self)
        return self

    @classmethod
    def from_text(cls, yaml: str, overrides=None, folder=os.curdir, name: str = "scene") -> "Scene":
        """Makes a scene from YAML or JSON text; `name` is its name in messages."""
        return cls.__new__(cls)._read(overrides, lib.flesh_scene_read_text, path_bytes(yaml),
                                      path_bytes(_named(name, folder)))

    @property
    def warning(self) -> Optional[str]:
        """A warning about the scene that was read, such as faces near but not on a surface of `curved`; or None."""
        return text(lib.flesh_scene_warning(self._pointer))

    @property
    def mesh(self) -> Mesh:
        """The body's mesh."""
        return Mesh._of(lib.flesh_scene_mesh(self._pointer), self)

    @property
    def materials(self) -> List[Material]:
        """Materials: the body's first, then those of its regions; empty without elasticity."""
        rows = lib.flesh_scene_body(self._pointer).materials
        return [Material._copy(rows + k, self) for k in range(lib.flesh_scene_material_count(self._pointer))]

    @property
    def body(self) -> Body:
        """The body, from which further effects may be made."""
        return Body._of(lib.flesh_scene_body(self._pointer), self.mesh, self.materials, self)

    @property
    def system(self) -> System:
        """The system: the sum of the effects and the constraints, finished."""
        return System._of(lib.flesh_scene_system(self._pointer), self)

    @property
    def solver(self) -> SolverOptions:
        """A copy of the solver options."""
        return SolverOptions._copy(lib.flesh_scene_solver(self._pointer))

    @property
    def time(self) -> SceneTime:
        """Method, step and end, with a copy of their options."""
        times = lib.flesh_scene_times(self._pointer)
        return SceneTime(METHOD_NAMES.word(times.method), times.step, times.end, times.max_energy_gain,
                         MethodOptions._copy(ffi.addressof(times, "options")),
                         AdaptiveOptions._copy(ffi.addressof(times, "adaptive")))

    @property
    def output(self) -> SceneOutput:
        """Output settings of its run."""
        given = lib.flesh_scene_outputs(self._pointer)
        return SceneOutput(given.frame_interval, given.seed, text(given.skin.surface),
                           [name for name, bit in _SKIN_FORMATS.items() if given.skin.formats & bit],
                           Camera(ffi.addressof(given, "camera")), FIELDS.word(given.fields),
                           PLACES.word(given.fields_at))

    @property
    def probes(self) -> List[Probe]:
        """The scene's output.probes, for Probes."""
        count = ffi.new("int *")
        rows = lib.flesh_scene_probes(self._pointer, count)
        return [Probe._of(rows[k]) for k in range(count[0])]

    def start(self) -> State:
        """Returns a new state at the scene's start."""
        system = lib.flesh_scene_system(self._pointer)
        counts = lib.flesh_system_multiplier_count(system), lib.flesh_system_internal_count(system)
        multipliers, internal = (np.zeros(count) if count else None for count in counts)
        state = State(self.mesh.positions, multipliers=multipliers, internal=internal)
        lib.flesh_scene_start(self._pointer, state._struct)
        return state

    def integrator(self, **arguments) -> Integrator:
        """Returns an integrator with the scene's method and options; keywords are those of Integrator."""
        time = self.time
        made = Integrator(self.system, **{"method": time.method, "options": self.solver,
                                          "method_options": time.options, "adaptive": time.adaptive, **arguments})
        made.set_max_energy_gain(time.max_energy_gain)
        return made

    def run(self, observers=(), stop=None) -> State:
        """Runs the scene from its start to its end; returns the state there. See flesh.run for the arguments."""
        state, time = self.start(), self.time
        run(self.integrator(), state, time.step, max(time.end, state.t), observers, stop)
        return state

    def steps(self, observers=()) -> Iterator[StepRecord]:
        """Makes the run as an iterator of StepRecords, the first of which is the start."""
        state, time = self.start(), self.time
        return steps(self.integrator(), state, time.step, max(time.end, state.t), observers)

    def write(self, path) -> None:
        """Writes the resolved scene, every key with its value in force, as YAML that repeats the run."""
        call(lib.flesh_scene_write, self._pointer, path_bytes(path))

    def __repr__(self):
        return f"<flesh.Scene {self.time.method}, to {self.time.end:g} s: {self.mesh.node_count} nodes>"


def schema(format: str = "markdown") -> str:
    """Returns the documentation of all keys: "markdown", "json" (JSON Schema), "man" or "paths"."""
    out = ffi.new("char **")
    call(lib.flesh_scene_schema, _SCHEMAS.value(format, "format"), out)
    try:
        return text(out[0])
    finally:
        free(out[0])
