"""_callbacks.py: Python functions that the library calls, and the exceptions that they raise.

An exception cannot pass through C. It is stored, the callback returns a status that ends the call, and the wrapper of
the call raises the exception again. The library may call an energy density from its own threads; an exception raised
there is raised by the next wrapper that returns."""
import threading

from ._library import ffi, lib
from .errors import ArgumentError, RecoverableError, of

_kept = {}  # by thread: the first exception since the thread's last call of the library
_foreign = []  # exceptions of threads that never call the library themselves
_callers = set()  # threads that call it


def _keep(error):
    thread = threading.get_ident()
    if thread in _callers:
        _kept.setdefault(thread, error)
    else:
        _foreign.append(error)


def _failed(_kind, error, _trace):
    if isinstance(error, RecoverableError):
        return error.status
    _keep(error)
    return lib.FLESH_ERR_INTERRUPTED


def _failed_silently(_kind, error, _trace):
    _keep(error)


def status_callback(kind, function):
    """Returns a C function of type `kind` that calls `function` and returns a status; None stands for success."""
    def call(*arguments):
        return function(*arguments) or 0
    return ffi.callback(kind, call, error=lib.FLESH_ERR_INTERRUPTED, onerror=_failed)


def value_callback(kind, function, default=None):
    """Returns a C function of type `kind` that returns no status, but `default` if `function` raises."""
    if default is None:
        return ffi.callback(kind, function, onerror=_failed_silently)
    return ffi.callback(kind, function, error=default, onerror=_failed_silently)


def raise_kept():
    """Raises the exception of a callback of the last calls, if there is one."""
    error = _kept.pop(threading.get_ident(), None)
    if error is None and _foreign:
        error = _foreign.pop(0)
        _foreign.clear()
    if error is not None:
        raise error


def call(function, *arguments):
    """Calls a function that returns a status; raises a callback's exception, or the status's."""
    status = call_value(function, *arguments)
    if status:
        raise of(status)


def call_value(function, *arguments):
    """Calls a function that returns no status but may call back; raises a callback's exception.

    An argument that C's type cannot hold is an ArgumentError."""
    _callers.add(threading.get_ident())
    try:
        value = function(*arguments)
    except (TypeError, OverflowError) as error:
        raise ArgumentError(str(error)) from None
    if _kept or _foreign:
        raise_kept()
    return value


class Handle:
    """Owner of an object of the library. It cannot be copied, as the object would be freed twice."""

    def __reduce_ex__(self, _protocol):
        raise ArgumentError(f"{type(self).__name__} belongs to the library and can be neither copied nor pickled; "
                            "make another one")


class Const(Handle):
    """A handle of an object that does not change once made: its copy is itself, and its attributes are read-only."""

    def __setattr__(self, name, value):
        if name in vars(self) and not name.startswith("_"):
            raise AttributeError(f"{type(self).__name__}.{name} can only be read")
        super().__setattr__(name, value)

    def __copy__(self):
        return self

    def __deepcopy__(self, _memo):
        return self


def create(kind, function, *arguments):
    """Calls a constructor, whose last argument is a `kind **`; returns the new `kind *`."""
    out = ffi.new(f"{kind} **")
    call(function, *arguments, out)
    return out[0]


class _Life:
    """Destroys an object of the library once its handle and all objects that were made from it are freed.

    Python frees the handles of a cycle in any order."""

    def __init__(self, free, keep):
        self._free, self._keep, self._users = free, keep, 1
        self._parent = getattr(keep, "_life", None)
        if self._parent is not None:
            self._parent._users += 1

    def leave(self, *_address):
        self._users -= 1
        if self._users == 0:
            self._free()
            if self._parent is not None:
                self._parent.leave()


def owned(kind, pointer, destroy, keep=None, holder=None):
    """Returns `pointer`, for which `destroy(kind **)` is called when nothing refers to it any more; keeps `keep` alive.

    Objects that are made with `keep=holder` also keep it from being destroyed."""
    cell = ffi.new(f"{kind} **", pointer)
    life = _Life(lambda: destroy(cell), keep)
    if holder is not None:
        holder._life = life
    return ffi.gc(pointer, life.leave)
