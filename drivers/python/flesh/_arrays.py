"""_arrays.py: numpy arrays for the library's pointers and back, and its plain structs as Python objects.

Arrays passed to the library are used without a copy if they are contiguous and of the right type; arrays from the
library are views that keep their owner alive."""
import difflib
from collections.abc import Set

import numpy as np

from ._library import ffi, text
from .errors import ArgumentError

_TYPES = {"double": np.float64, "int": np.intc, "uint8_t": np.uint8}


def doubles(values, shape, name):
    """Returns a contiguous float64 array of `shape`, from anything with as many numbers; None in shape: any length."""
    if np.iscomplexobj(values):
        raise ArgumentError(f"{name} has complex values; they must be real")
    if np.ma.is_masked(values):
        raise ArgumentError(f"{name} has masked values; every number must be there")
    if getattr(values, "dtype", np.dtype(float)).kind in "US":
        raise ArgumentError(f"{name} has texts; they must be numbers")
    return _array(values, np.float64, shape, name)


def finite(values, shape, name):
    """Does what `doubles` does; ArgumentError if a number is not finite."""
    given = doubles(values, shape, name)
    for place in np.argwhere(~np.isfinite(given))[:1].tolist():
        raise ArgumentError(f"{name}{place} is {given[tuple(place)]:g}; it must be finite")
    return given


def integers(values, shape, name):
    """Returns a contiguous array of C ints of `shape`; a set is accepted if no order is asked for.

    ArgumentError if a value is not a whole number or does not fit C's int."""
    given = np.asarray(list(values) if isinstance(values, Set) and shape == (None,) else values)
    limits = np.iinfo(np.intc)
    if given.dtype.kind not in "iu" and given.size:
        raise ArgumentError(f"{name} has values of type {given.dtype}; they must be whole numbers")
    if given.size and (given.min() < limits.min or given.max() > limits.max):
        worst = given.max() if given.max() > limits.max else given.min()
        raise ArgumentError(f"{name} has {worst}; whole numbers must be from {limits.min} to {limits.max}")
    return _array(given, np.intc, shape, name)


def _array(values, kind, shape, name):
    try:
        given = np.ascontiguousarray(values, dtype=kind)
    except (TypeError, ValueError) as error:
        raise ArgumentError(f"{name} is no array of numbers: {error}") from None
    rest = int(np.prod([n for n in shape if n is not None], dtype=np.int64))
    whole = tuple(given.size // max(rest, 1) if n is None else n for n in shape)
    flat = given.ndim == 1 and len(shape) > 1
    if given.size != int(np.prod(whole, dtype=np.int64)) or not (flat or given.shape == whole):
        wanted = ", ".join("any" if n is None else str(n) for n in shape)
        raise ArgumentError(f"{name} has shape {given.shape}; it must be ({wanted})")
    return given.reshape(whole)


def pointer(array, kind="double"):
    """Returns the C pointer to an array's numbers; NULL for None. The pointer keeps the array alive; a struct to which
    the pointer is assigned does not."""
    return ffi.NULL if array is None else ffi.from_buffer(f"{kind}[]", array)


class _Memory:
    """Memory of the library and its owner: numpy keeps this object as the base of a view."""

    def __init__(self, address, shape, kind, owner, read_only):
        self.owner = owner
        self.__array_interface__ = {"version": 3, "shape": shape, "typestr": np.dtype(kind).str,
                                    "data": (address, read_only)}


def view(address, shape, kind, owner, read_only=True):
    """Returns an array that is a view of the library's memory; it keeps `owner` alive."""
    kind = _TYPES[kind]
    if not address or 0 in shape:
        return np.zeros(shape, kind)
    return np.asarray(_Memory(int(ffi.cast("uintptr_t", address)), tuple(shape), kind, owner, read_only))


class Names:
    """Values of a C enum by the words that scenes and Python use for them."""

    def __init__(self, enum, prefix, name_function=None):
        self.enum = enum
        self.words = {}
        for name, value in sorted(ffi.typeof(enum).relements.items(), key=lambda row: row[1]):
            word = name_function and text(name_function(value))
            if name.startswith(prefix) and not name.endswith("_COUNT") and word != "unknown":
                self.words[word or name[len(prefix):].lower()] = value
        self._by_value = {value: word for word, value in self.words.items()}

    def value(self, word, name):
        """Returns the number of a word. ArgumentError, with the valid words, for any other."""
        plain = {known.lower().replace("-", "_"): value for known, value in self.words.items()}
        found = self.words.get(word, plain.get(word.lower().replace("-", "_"))) if isinstance(word, str) else None
        if found is None:
            raise ArgumentError(f"{name} is {word!r}; it must be one of {', '.join(self.words)}")
        return found

    def word(self, value):
        """Returns the word of a number."""
        return self._by_value.get(int(value), str(int(value)))


class Flags(Names):
    """Values of an enum of bits: a tuple of words stands for their sum."""

    def __init__(self, enum, prefix):
        super().__init__(enum, prefix)
        self.words = {word: bit for word, bit in self.words.items() if bit & (bit - 1) == 0}

    def value(self, word, name):
        words = [word] if isinstance(word, str) else word
        return sum({super(Flags, self).value(one, name) for one in words})

    def word(self, value):
        return tuple(word for word, bit in self.words.items() if value & bit)


def made_by_library(struct, name):
    """Returns the library's struct that the object `name` wraps; TypeError if a program passes something else."""
    if not isinstance(struct, ffi.CData):
        raise TypeError(f"{name} is made by the library from a struct of its own, not from {type(struct).__name__}")
    return struct


class Field:
    """A member of a struct as an attribute of its Python object: numbers, arrays, or words of an enum."""

    def __init__(self, doc, names=None):
        self.__doc__ = f"{doc}: {', '.join(names.words)}" if names else doc
        self.names = names

    def __set_name__(self, owner, name):
        self.name = name
        self.member = name.rstrip("_")

    def __get__(self, instance, owner=None):
        if instance is None:
            return self
        value = getattr(instance._struct, self.member)
        if self.names:
            return self.names.word(value)
        if isinstance(value, (int, float)):
            return value
        kind = ffi.typeof(value)
        if kind.kind == "array":
            return view(value, (kind.length,), kind.item.cname, instance, read_only=isinstance(instance, Record))
        return text(value) if kind.cname == "char *" else value

    def __set__(self, instance, value):
        if isinstance(instance, Record):
            raise AttributeError(f"{type(instance).__name__}.{self.name} can only be read")
        try:
            setattr(instance._struct, self.member, self.names.value(value, self.name) if self.names else value)
        except (TypeError, OverflowError) as error:
            raise ArgumentError(f"{self.name} is {value!r}: {error}") from None


class Struct:
    """A plain C struct, whose attributes are the members that the header declares."""
    _ctype = ""

    @classmethod
    def fields(cls):
        """Names of its attributes, in their order."""
        return [name for above in reversed(cls.__mro__) for name, field in vars(above).items()
                if isinstance(field, Field)]

    def as_dict(self):
        """Names and values of all attributes; arrays are copied."""
        values = {name: getattr(self, name) for name in self.fields()}
        return {name: value.copy() if isinstance(value, np.ndarray) else value for name, value in values.items()}

    def __reduce__(self):
        return _restored, (type(self), self.as_dict())

    def __repr__(self):
        return f"{type(self).__name__}({', '.join(f'{name}={value!r}' for name, value in self.as_dict().items())})"


def _restored(cls, values):
    """Returns a struct whose attributes have these values."""
    made = cls.__new__(cls)
    made._struct = ffi.new(f"{cls._ctype} *")
    for name, value in values.items():
        names = getattr(cls, name).names
        setattr(made._struct, name.rstrip("_"), names.value(value, name) if names else
                value.tolist() if isinstance(value, np.ndarray) else value)
    return made


class Record(Struct):
    """A struct that the library fills in and Python reads: a copy, which does not change."""

    def __init__(self, struct=None):
        self._struct = ffi.new(f"{self._ctype} *")
        if struct is not None:
            self._struct[0] = made_by_library(struct, type(self).__name__)[0]


class Options(Struct):
    """A struct of options, which has the library's defaults except for those that keywords set."""

    def __init__(self, **values):
        self._struct = ffi.new(f"{self._ctype} *")
        self._default()
        for name, value in values.items():
            self._set(name, value)

    def _default(self):
        raise NotImplementedError

    def _set(self, name, value):
        if name not in self.fields():
            near = difflib.get_close_matches(name, self.fields(), 1)
            raise ArgumentError(f"{type(self).__name__} has no {name!r}" + (f"; did you mean {near[0]!r}?" if near else
                                f"; it has {', '.join(self.fields())}"))
        setattr(self, name, value)

    def __setattr__(self, name, value):
        if not name.startswith("_") and name not in self.fields():
            self._set(name, value)
        super().__setattr__(name, value)

    @classmethod
    def _copy(cls, struct):
        """Copies the library's struct."""
        made = cls()
        made._struct[0] = struct[0]
        return made
