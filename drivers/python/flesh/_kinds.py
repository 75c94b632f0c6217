"""_kinds.py: checks arguments against annotations before they are used, and refuses texts as numbers, which Python's
float would convert."""
import functools
import inspect
import reprlib
import typing
from collections.abc import Mapping, Sequence


def _classes(hint):
    """Returns a hint's classes, if the package's or mappings are among them; none for sequences and functions."""
    kinds = typing.get_args(hint) if typing.get_origin(hint) is typing.Union else (hint,)
    kinds = tuple(Mapping if kind is typing.Mapping else kind for kind in kinds)
    kinds = tuple(kind for kind in kinds if inspect.isclass(kind))
    return kinds if any(kind is Mapping or kind.__module__.startswith(__package__ + ".") for kind in kinds) else ()


def _is_number(value):
    """Returns whether a value is a number for Python, not a text."""
    try:
        return not isinstance(value, (str, bytes, bytearray)) and float(value) is not None
    except (TypeError, ValueError, OverflowError):
        return False


def _checked(function):
    """Wraps a function: TypeError for an argument that is not of its annotation's classes, or not a number."""
    names = list(inspect.signature(function).parameters)
    given = {name: hint for name, hint in function.__annotations__.items() if name in names}
    hints = {name: kinds for name, hint in given.items() if (kinds := _classes(hint))}
    items = {name: typing.get_args(hint)[0] for name, hint in given.items() if typing.get_origin(hint) is Sequence}
    items = {name: kind for name, kind in items.items() if _classes(kind)}
    numbers = {name: hint for name, hint in given.items() if hint in (float, typing.Optional[float])}

    @functools.wraps(function)
    def call(*args, **keywords):
        for name, value in (*zip(names, args), *keywords.items()):
            if name in hints and not isinstance(value, hints[name]):
                wanted = hints[name][0].__name__
                raise TypeError(f"{name} is of class {type(value).__name__}; it must be of class {wanted}")
            if name in items and not (hasattr(value, "__iter__") and all(
                    isinstance(one, items[name]) for one in (value if hasattr(value, "__len__") else ()))):
                raise TypeError(f"{name} must be a sequence of class {items[name].__name__}")
            if name in numbers and not (_is_number(value) or value is None and numbers[name] is not float):
                raise TypeError(f"{name} is {reprlib.repr(value)}; it must be a number")
        return function(*args, **keywords)
    return call if hints or items or numbers else function


def _check_methods(cls):
    for name, member in list(vars(cls).items()):
        if name == "__init__" or not name.startswith("_"):
            if isinstance(member, classmethod):
                setattr(cls, name, classmethod(_checked(member.__func__)))
            elif inspect.isfunction(member):
                setattr(cls, name, _checked(member))


def check(module):
    """Makes public methods of a module's classes check arguments; returns its checked public functions by name."""
    for cls in vars(module).values():
        if inspect.isclass(cls) and cls.__module__ == module.__name__:
            _check_methods(cls)
    return {name: _checked(vars(module)[name]) for name in module.__all__ if inspect.isfunction(vars(module)[name])}
