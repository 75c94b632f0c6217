"""_library.py: libflesh in cffi: `ffi` with the declarations of the headers, `lib` with the functions.

cffi reads the public headers as the library was compiled with them (_declarations.py) and needs no compiler. It
releases the interpreter's lock during every call."""
import ctypes.util
import os

import cffi

from . import _declarations, _location

ffi = cffi.FFI()
ffi.cdef(_declarations.HEADERS)
ffi.cdef(_declarations.OTHERS)


def text(pointer):
    """Returns a C string as str; None for NULL."""
    return ffi.string(pointer).decode("utf-8", "replace") if pointer else None


def path_bytes(path):
    """Returns a path or a text as bytes for C. ValueError for a NUL within it, at which C would end."""
    encoded = os.fsencode(os.fspath(path))
    if b"\0" in encoded:
        raise ValueError(f"{path!r:.100} has a zero byte; no path and no text of a scene has one")
    return encoded


def _open():
    path = os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), _location.LIBRARY))
    try:
        opened = ffi.dlopen(path)
    except OSError as error:
        raise ImportError(f"flesh: {path} cannot be loaded ({error}); build or install the library that this package "
                          "came with") from None
    version = text(opened.flesh_version())
    if version != _declarations.VERSION:
        raise ImportError(f"flesh: this package goes with version {_declarations.VERSION} of the library, and {path} is "
                          f"{version}; build or install both anew")
    return opened, path


lib, LIBRARY_PATH = _open()
free = ffi.dlopen(None).free  # matches the malloc that the library calls, also if another allocator is loaded first


def sundials_function(name):
    """Returns a function of the SUNDIALS with which libflesh is linked, or of its library of vectors or matrices."""
    try:
        return getattr(lib, name)
    except AttributeError:
        pass
    for part in ("sundials_nvecserial", "sundials_sunmatrixsparse", "sundials_core"):
        found = ctypes.util.find_library(part)
        if found:
            try:
                return getattr(ffi.dlopen(found), name)
            except (AttributeError, OSError):
                pass
    raise ImportError(f"flesh: SUNDIALS {_declarations.SUNDIALS_VERSION} shows no function {name} here; the callback "
                      "layer (flesh.sundials) needs it")


def null_communicator():
    """SUNContext_Create's argument for no MPI: 0, or from 7.0 on, if SUNDIALS has MPI, MPI's null communicator."""
    if not _declarations.COMMUNICATOR_OF_MPI:
        return ffi.NULL
    try:  # Open MPI: the address of an object
        found = ctypes.c_char.in_dll(ctypes.CDLL(LIBRARY_PATH, ctypes.RTLD_GLOBAL), "ompi_mpi_comm_null")
        return ffi.cast("void *", ctypes.addressof(found))
    except ValueError:  # MPICH and compatible ones: a number of their common ABI
        return ffi.cast("void *", 0x04000000)
