"""errors.py: an exception for every status of the library, with the library's own sentence.

A sentence says where, what, and what would be valid: `scene.yaml:12:9: body.material.poisson is 0.6; it must be a
number in (-1, 0.5]`. If a function of your own that the library calls (an effect, an energy density) raises a
recoverable error, the library tries a shorter step; any other exception ends the call, which raises it."""
from ._library import lib, text

__all__ = ["Error", "RecoverableError", "UndefinedError", "NonFiniteError", "NotConvergedError", "NotPositiveError",
           "ArgumentError", "OutOfMemoryError", "FileError", "SolveError", "IntegratorError", "BudgetError",
           "NonFiniteRunError", "StoppedError", "SundialsError", "EnergyError", "ProgramError", "by_status"]


class Error(Exception):
    """Base of all errors: the library refused a call, or failed.

    Attributes:
        status: the flesh_status, an int; 0 if the failure was found before the library was called.
    """
    status = 0

    def __init__(self, message="", status=None):
        super().__init__(message or (text(lib.flesh_status_text(self.status)) if self.status else ""))
        if status is not None:
            self.status = status

    @property
    def name(self) -> str:
        """Name of the status, as in C: "FLESH_ERR_ARGUMENT"."""
        return text(lib.flesh_status_name(self.status))


class RecoverableError(Error):
    """A positive status: nothing was modified, a shorter step or another state may succeed."""


class UndefinedError(RecoverableError):
    """The energy is undefined at this state (J <= 0, or within an obstacle)."""
    status = lib.FLESH_UNDEFINED


class NonFiniteError(RecoverableError):
    """A number is not finite."""
    status = lib.FLESH_NONFINITE


class NotConvergedError(RecoverableError):
    """The iteration limit was reached before the tolerance."""
    status = lib.FLESH_NOT_CONVERGED


class NotPositiveError(RecoverableError):
    """The matrix is not positive definite."""
    status = lib.FLESH_NOT_POSITIVE


class ArgumentError(Error, ValueError):
    """Invalid argument or scene."""
    status = lib.FLESH_ERR_ARGUMENT


class OutOfMemoryError(Error, MemoryError):
    """Out of memory."""
    status = lib.FLESH_ERR_MEMORY


class FileError(Error, OSError):
    """Invalid or unreadable file or mesh."""
    status = lib.FLESH_ERR_FILE


class SolveError(Error):
    """The nonlinear solve failed; Integrator.failure has the details."""
    status = lib.FLESH_ERR_SOLVE


class IntegratorError(Error):
    """The time integrator failed."""
    status = lib.FLESH_ERR_INTEGRATOR


class BudgetError(Error):
    """The budget is spent."""
    status = lib.FLESH_ERR_BUDGET


class NonFiniteRunError(Error):
    """A non-finite number ended the run."""
    status = lib.FLESH_ERR_NONFINITE


class StoppedError(Error):
    """Interrupted by a stop function."""
    status = lib.FLESH_ERR_INTERRUPTED


class SundialsError(Error):
    """A SUNDIALS function failed, or another version is loaded."""
    status = lib.FLESH_ERR_SUNDIALS


class EnergyError(Error):
    """The energy grew although nothing put it in."""
    status = lib.FLESH_ERR_ENERGY


class ProgramError(Error):
    """A command of the program ended with an exit code other than 0; `status` is that code."""


def _classes(above):
    for cls in above.__subclasses__():
        yield cls
        yield from _classes(cls)


_BY_STATUS = {cls.status: cls for cls in _classes(Error) if cls.status}


def by_status(status: int) -> type:
    """Returns the class of a status; Error for a status without one.

    >>> by_status(-3).__name__
    'FileError'
    """
    return _BY_STATUS.get(status, Error)


def of(status):
    """Returns the exception for a status that a call of the library has just returned in this thread.

    Positive statuses mostly have no sentence: the thread's last sentence would be that of an earlier failure."""
    sentence = text(lib.flesh_error_text()) if status < 0 else ""
    return by_status(status)(sentence or text(lib.flesh_status_text(status)), status)
