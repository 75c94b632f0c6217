"""output.py: runs, as a loop with observers or as an iterator, and the files that a run writes."""
import threading
from typing import Callable, Iterable, Iterator, NamedTuple, Optional, Sequence

import numpy as np

from . import _callbacks
from ._arrays import Flags, integers, pointer, view
from ._callbacks import Handle, call, create
from ._library import ffi, lib, path_bytes
from .body import Body
from .errors import ArgumentError
from .integrator import Integrator
from .mesh import Mesh
from .options import METHOD_NAMES, SolveStats
from .surface import Skin, Surface
from .system import State, System

__all__ = ["StepRecord", "run", "steps", "History", "Probe", "Probes", "Frames", "SkinFrames"]


class StepRecord(NamedTuple):
    """An accepted step; step 0 is the start. Its arrays are copies, which may be kept."""
    step: int
    t: float  # s
    h: float  # s; 0 at the start
    last: bool  # whether the run ends with this step
    x: np.ndarray  # [nodes, 3] m
    v: np.ndarray  # [nodes, 3] m/s
    tet_J_mean: np.ndarray  # [tets] mean of J = det F over the tet's quadrature points
    tet_J_min: np.ndarray  # [tets] smallest J at a quadrature point
    energies: np.ndarray  # [effects] J
    rest_energies: np.ndarray  # [effects] J, energies at rest that are only the formula's constant; else 0
    volume: float  # m^3
    rest_volume: float  # m^3
    J_min: float  # smallest of tet_J_min
    J_min_tet: int
    J_bound: float  # lower bound of J anywhere in a tet
    inverted: int  # number of tets with J <= 0 at a quadrature point
    stats: SolveStats

    @classmethod
    def _of(cls, record, mesh, effects):
        nodes = (mesh.node_count, 3)

        def copy(address, shape):
            return view(address, shape, "double", None).copy()
        return cls(record.step, record.state.t, record.h, bool(record.last), copy(record.state.x, nodes),
                   copy(record.state.v, nodes), copy(record.tet_J_mean, (mesh.tet_count,)),
                   copy(record.tet_J_min, (mesh.tet_count,)), copy(record.energies, (effects,)),
                   copy(record.rest_energies, (effects,)), record.volume, record.rest_volume, record.J_min,
                   record.J_min_tet, record.J_bound, record.inverted, SolveStats(record.stats))


class _File(Handle):
    """A file that is written during a run: an observer, and a context that closes it."""
    _close = _observe = None
    _runs = 0  # number of runs that write it now

    def _open(self, kind, function, *arguments):
        self._kind, self._pointer = kind, create(kind, function, *arguments)

    def close(self) -> None:
        """Completes the files. FileError if not all could be written, ArgumentError while a run writes them."""
        if self._pointer:
            call(type(self)._close, self._given_up())

    def _given_up(self):
        if self._runs:
            raise ArgumentError(f"a run writes this {type(self).__name__}; it can be closed when the run has ended")
        out, self._pointer = ffi.new(f"{self._kind} **", self._pointer), ffi.NULL
        return out

    def __enter__(self):
        return self

    def __exit__(self, *_error):
        self.close()

    def __del__(self):
        pointer_ = getattr(self, "_pointer", None)
        if pointer_:
            type(self)._close(ffi.new(f"{self._kind} **", pointer_))


class History(_File):
    """history.csv: a header and a row per step, flushed as it is written. Pass it to run() or steps()."""
    _close, _observe = lib.flesh_history_close, lib.flesh_history_observe

    def __init__(self, path, system: System):
        self._keep = system
        self._open("flesh_history", lib.flesh_history_create, path_bytes(path), system._ready())


_QUANTITIES = Flags("flesh_probe_quantity", "FLESH_PROBE_")
_QUANTITIES.words = {"J" if word == "j" else word: bit for word, bit in _QUANTITIES.words.items()}

FIELDS = Flags("flesh_field", "FLESH_FIELD_")
FIELDS.words = {"J" if word == "j" else word: bit for word, bit in FIELDS.words.items()}
PLACES = Flags("flesh_field_place", "FLESH_AT_")


class Probe(NamedTuple):
    """A place whose quantities a run writes: a point of the body at rest, or nodes."""
    name: str
    quantities: Sequence[str]  # some of position, velocity, reaction, J, stretch, stress, energy, contact_force
    point: Optional[Sequence[float]] = None  # [3] m, at rest
    nodes: Sequence[int] = ()  # if there is no point
    about: Optional[Sequence[float]] = None  # [3] m, centre of moments; default: the nodes' mean at rest
    holder: int = 0  # number of the pin or prescribed motion, from 1 as added, whose reaction is written; 0: of all
    contact: int = 0  # contact force of the system's effect contact - 1 only; 0: of all contacts

    @classmethod
    def _of(cls, row):
        def place(numbers):
            return None if numbers[0] != numbers[0] else tuple(numbers)
        return cls(ffi.string(row.name).decode(), _QUANTITIES.word(row.quantities), place(row.point),
                   tuple(row.nodes[k] for k in range(row.node_count)), place(row.about), row.holder, row.contact)


class Probes(_File):
    """probes.csv: a header and a row per step. `method` is the run's. ArgumentError for a point outside the body, and
    for quantities that a place does not have."""
    _close, _observe = lib.flesh_probes_close, lib.flesh_probes_observe

    def __init__(self, path, body: Body, system: System, method: str, probes: Sequence[Probe]):
        self._keep = (body, system)
        rows, kept = ffi.new("flesh_probe[]", max(1, len(probes))), []
        for row, probe in zip(rows, probes):
            nodes = integers(probe.nodes, (None,), "nodes")
            numbers = integers((probe.holder, probe.contact), (2,), "(holder, contact)")
            kept += [ffi.new("char[]", probe.name.encode()), pointer(nodes, "int")]
            row.name, row.nodes, row.node_count = kept[-2], kept[-1], len(nodes)
            row.holder, row.contact = numbers.tolist()
            row.quantities = _QUANTITIES.value(probe.quantities, "quantities")
            row.point = [float("nan")] * 3 if probe.point is None else [float(x) for x in probe.point]
            row.about = [float("nan")] * 3 if probe.about is None else [float(x) for x in probe.about]
            call(lib.flesh_probe_prepare, ffi.addressof(row), body._struct, system._ready())
        self._open("flesh_probes", lib.flesh_probes_create, path_bytes(path), body._struct, system._ready(),
                   METHOD_NAMES.value(method, "method"), len(probes), rows)


class Frames(_File):
    """frame_000000.vtu ... and frames.pvd in `directory`: the start, every `every`-th step and the last one."""
    _close, _observe = lib.flesh_frames_close, lib.flesh_frames_observe

    def __init__(self, directory, mesh: Mesh, every: int = 1):
        self._keep = mesh
        self._open("flesh_frames", lib.flesh_frames_create, path_bytes(directory), mesh._pointer, every)

    def set_fields(self, body: Body, system: System, method: str, fields: Sequence[str],
                   at: Sequence[str] = ("nodes", "tets")) -> None:
        """Sets further fields beside displacement, velocity and the smallest J of each tet, as a scene's output.fields.

        Args:
            method: the run's.
            fields: some of J, stretch, stress, von_mises, pressure, energy_density, reaction, contact_force.
            at: some of nodes, tets, points (of quadrature).
        """
        call(lib.flesh_frames_set_fields, self._pointer, body._struct, system._ready(),
             METHOD_NAMES.value(method, "method"), FIELDS.value(fields, "fields"), PLACES.value(at, "at"))
        self._keep = (self._keep, body, system)


class SkinFrames(_File):
    """Frames of the moving skin: `formats` are some of "obj", "pc2" (Blender's Mesh Cache) and "vtu"."""
    _close, _observe = lib.flesh_skin_frames_close, lib.flesh_skin_frames_observe

    def __init__(self, directory, skin: Skin, surface: Surface, formats=("vtu",), every: int = 1):
        self._keep, self._nodes = (skin, surface), skin._nodes
        bits = {"obj": lib.FLESH_SKIN_OBJ, "pc2": lib.FLESH_SKIN_PC2, "vtu": lib.FLESH_SKIN_VTU}
        self._open("flesh_skin_frames", lib.flesh_skin_frames_create, path_bytes(directory), skin._pointer,
                   surface._pointer, sum(bits[name] for name in set(formats)), every)



class _Run:
    """The options of one run, and the objects that must live as long."""

    def __init__(self, integrator, state, h, end, observers, stop):
        system = integrator.system
        self.keep = (integrator, state, observers)
        self.functions = []
        self.observers = ffi.new("flesh_observer[]", max(len(observers), 1))
        for slot, observer in zip(self.observers, observers):
            if isinstance(observer, _File):
                if not observer._pointer:
                    raise ArgumentError(f"the {type(observer).__name__} is closed; a run needs a new one")
                slot.observe, slot.data = type(observer)._observe, observer._pointer
            else:
                slot.observe = self._told(observer, system)
        self.options = ffi.new("flesh_run_options *", {"h": float(h), "end": float(end),
                                                       "observer_count": len(observers),
                                                       "observers": self.observers})
        # Python handles signals while it runs this function: Ctrl-C ends the run between steps, too.
        self.stop = _callbacks.status_callback("int(void *)",
                                               lambda _data: lib.FLESH_ERR_INTERRUPTED if stop and stop() else 0)
        self.options.stop = self.stop
        self.steps = ffi.new("int *")
        self.arguments = (system._ready(), integrator._pointer, self.options,
                          state._checked(system.mesh.node_count), self.steps)
        self.shown = state._shown  # the arrays that the run changes, even if the state's attributes are replaced

    def _told(self, observer, system):
        def observed(_data, record):
            observer(StepRecord._of(record, system.mesh, system.effect_count))
        self.functions.append(_callbacks.status_callback("int(void *, const flesh_step_record *)", observed))
        return self.functions[-1]

    def go(self, step=0, begin=None):
        files = [observer for observer in self.keep[2] if isinstance(observer, _File)]
        for file in files:
            file._runs += 1
        try:
            if begin is None:
                call(lib.flesh_run, *self.arguments)
            else:
                call(lib.flesh_run_resume, *self.arguments[:3], step, float(begin), *self.arguments[3:])
        finally:
            for file in files:
                file._runs -= 1
        return self.steps[0]


def run(integrator: Integrator, state: State, h: float, end: float,
        observers: Iterable[Callable[[StepRecord], None]] = (), stop: Optional[Callable] = None, *,
        taken: int = 0, begin: Optional[float] = None) -> int:
    """Makes steps of h s from state.t to `end` s, the last one shortened to end there; returns the number of steps.

    A static integrator on a system that does not move makes one solve, to `end`. The state changes in place and is
    always that of the last success, also after an exception or Ctrl-C.

    Args:
        observers: History, Frames, SkinFrames or functions of a StepRecord; called with the start, then with every step.
        stop: called between and within steps, without arguments; a true result ends the run with StoppedError.
        taken, begin: to continue a run that began at `begin` s and has taken so many steps to the state, which observers
            have already seen. The result is bitwise that of the whole run if the integrator has loaded what that run's
            integrator saved there.
    """
    return _Run(integrator, state, h, end, list(observers), stop).go(taken, begin)


def steps(integrator: Integrator, state: State, h: float, end: float,
          observers: Iterable = ()) -> Iterator[StepRecord]:
    """Makes the same run as an iterator of StepRecords, the first of which is the start.

    The run waits while the loop's body works, which may read `state`; leaving the loop ends the run. The library's own
    loop runs in a separate thread, in which effects written in Python are called.
    """
    return _Steps(integrator, state, h, end, list(observers)).records()


class _Steps:
    def __init__(self, integrator, state, h, end, observers):
        self.ready, self.wanted = threading.Semaphore(0), threading.Semaphore(0)
        self.record, self.error, self.left, self.done = None, None, False, False
        self.run = _Run(integrator, state, h, end, [*observers, self._told], lambda: self.left)
        self.integrator = integrator

    def _told(self, record):
        if self.left:
            return
        self.record = record
        self.ready.release()
        self.wanted.acquire()

    def _work(self):
        self.wanted.acquire()
        try:
            if not self.left:
                self.run.go()
        except BaseException as error:  # handed to the thread that iterates
            self.error = error
        self.done = True
        self.ready.release()

    def records(self):
        thread = threading.Thread(target=self._work, name="flesh.steps", daemon=True)
        thread.start()
        asked = self.integrator.stop
        self.integrator.stop = lambda: self.left or (asked and asked())
        try:
            while True:
                self.wanted.release()
                self.ready.acquire()  # Ctrl-C interrupts this
                if self.done:
                    break
                yield self.record
        finally:
            self.left = self.left or not self.done
            self.wanted.release()
            thread.join()
            self.integrator.stop = asked
        if self.error is not None:
            raise self.error
