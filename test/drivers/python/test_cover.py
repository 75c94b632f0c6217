# TEST part_of=test_python
"""test_cover.py: the package covers the public headers: functions, members of structs, statuses, documentation."""
import glob
import inspect
import os
import pydoc
import re
import shlex
import shutil
import subprocess

import pytest

import flesh
from flesh import _arrays, own_effect
from flesh._library import ffi, lib
from conftest import TOP

PACKAGE = os.path.dirname(flesh.__file__)

# What the package leaves out, and why.
LEFT_OUT = {
    "flesh_solve_stats_print": "prints into a C file; SolveStats.as_dict has the figures",
    "flesh_effect_operations.destroy": "Python's own counting of references frees what an effect holds",
    "flesh_effect_operations.constraints": "one effect of a system may have them, and incompressible elasticity does",
    "flesh_effect_operations.library": "what the library's own effects have",
    "flesh_point_near": "a memory that belongs to a run; SurfaceContact is what has one",
    **{f"flesh_effect_barrier.{name}": "a memory that belongs to a run; SurfaceContact is what has one"
       for name in ("remember", "forget", "coupled", "follow")},
    "flesh_effect_figures.memory": "an effect does not know the memory of Python's objects",
}
# Objects that only SUNDIALS in C uses: SciPy uses csc_matrix and preconditioner_solve instead.
for _kind in ("", "ida_", "ode_"):
    for _thing in ("sunmatrix", "sunlinsol"):
        LEFT_OUT[f"flesh_{_kind}{_thing}_create"] = "an object for SUNDIALS in C"
for _name in ("ida_vector_create", "ode_vector_create", "ida_sunnonlinsol_create", "arkode_sunnonlinsol_create",
              "cvode_sunnonlinsol_create", "sunnonlinsol_position_norm"):
    LEFT_OUT[f"flesh_{_name}"] = "an object for SUNDIALS in C"
LEFT_OUT["flesh_ode_accept"] = "what ARKODE tells an object for SUNDIALS in C"
for _name in ("communicator_create", "communicator_destroy", "communicator_rank", "communicator_size",
              "communicator_exchanged", "communicator_agree", "rank_part_create", "rank_part_create_for", "rank_part_destroy",
              "rank_part_mesh", "rank_part_own", "rank_part_neighbours", "rank_part_nodes", "rank_part_tets", "rank_part_find",
              "rank_part_gather", "system_set_part"):
    LEFT_OUT[f"flesh_{_name}"] = "for programs of MPI in C"


def sources():
    return {path: open(path, encoding="utf-8").read() for path in glob.glob(os.path.join(PACKAGE, "*.py"))
            if os.path.basename(path) != "_declarations.py"}


def exported():
    with open(os.path.join(TOP, "test", "tree", "abi.txt"), encoding="utf-8") as file:
        return [line.split()[1] for line in file if line.startswith("T ")]


def wrapped(text):
    """Returns the names of functions that the sources call, including composed names."""
    names = set(re.findall(r"\blib\.(flesh_\w+)", text))
    for kind in re.findall(r'_kind = "(flesh_\w+)"', text) + re.findall(r'_kind, _short = "(flesh_\w+)"', text):
        names |= {f"{kind}_create", f"{kind}_destroy"}
    for short in re.findall(r'_kind, _short = "\w+", "(\w+)"', text):
        names |= {f"flesh_{short}_{name}" for name in re.findall(r'self\._function\("(\w+)"\)', text)}
    return names


def test_every_function_is_wrapped_or_left_out():
    text = "\n".join(sources().values())
    names = wrapped(text)
    missing = [name for name in exported() if name not in names and name not in LEFT_OUT]
    assert not missing, f"wrap them in drivers/python/flesh or say in LEFT_OUT why not: {missing}"
    assert not [name for name in LEFT_OUT if name in names], "left out, but wrapped"
    assert not [name for name in names if name not in exported()], "called, but not exported"
    assert all(hasattr(lib, name) for name in exported())


def test_every_operation_of_an_effect_is_offered_or_left_out():
    offered = {"name", "role", "traits", "cells", "report_names", "report", "stress", "time", "barrier",
               "figures", "internal", *own_effect._CORE, *own_effect._TIME, *own_effect._BARRIER, *own_effect._INTERNAL}
    for table in ("operations", "time", "barrier", "figures", "internal"):
        for member, _field in ffi.typeof(f"flesh_effect_{table}").fields:
            left_out = {f"flesh_effect_{table}.{member}", f"flesh_effect_{table}.*"} & set(LEFT_OUT)
            assert member in offered or left_out, f"{table}.{member}"
    traits = ffi.typeof("flesh_trait").relements
    assert set(own_effect._TRAITS.values()) == set(traits)


def structs():
    def below(cls):
        for one in cls.__subclasses__():
            yield one
            yield from below(one)
    return [cls for cls in below(_arrays.Struct) if cls._ctype]


@pytest.mark.parametrize("cls", structs(), ids=lambda cls: cls.__name__)
def test_records_have_every_member(cls):
    functions = {"flesh_adaptive_options": {"observe", "observe_data"}}.get(cls._ctype, set())
    members = [name for name, _field in ffi.typeof(cls._ctype).fields if name not in functions]
    assert [name.rstrip("_") for name in cls.fields()] == members


def test_every_status_has_its_class():
    for name, value in ffi.typeof("flesh_status").relements.items():
        cls = flesh.by_status(value)
        assert (cls is flesh.Error) == (name == "FLESH_OK"), name
        assert issubclass(cls, flesh.RecoverableError) == (value > 0)


def declarations():
    """Returns every struct with its members, and every enumerator, as C expressions with the values that Python
    uses."""
    rows = []
    typedefs, structs_, unions = ffi.list_types()
    functions = {"flesh_task"}  # a type of functions has neither size nor members
    for name in sorted({*typedefs, *(f"struct {one}" for one in structs_)} - functions):
        kind = ffi.typeof(name)
        if kind.kind == "struct" and kind.fields and "flesh" in name:
            rows.append((f"sizeof({name})", ffi.sizeof(name)))
            for member, field in kind.fields:
                rows.append((f"offsetof({name}, {member})", field.offset))
                rows.append((f"sizeof((({name} *)0)->{member})", ffi.sizeof(field.type)))
    rows += [(name, getattr(lib, name)) for name in dir(lib) if isinstance(getattr(lib, name), int)]
    assert not unions
    return rows


@pytest.mark.skipif(not shutil.which((os.environ.get("CC") or "cc").split()[0]), reason="there is no C compiler")
def test_layouts_are_those_of_the_compiled_library(tmp_path):
    rows = declarations()
    assert len(rows) > 400
    source = tmp_path / "layout.c"
    source.write_text("#include <flesh/flesh.h>\n#include <flesh/kinsol.h>\n#include <flesh/ida.h>\n"
                      "#include <flesh/ode.h>\n#include <stddef.h>\n#include <stdio.h>\nstatic const long long rows[] = {\n"
                      + "".join(f"  (long long)({expression}),\n" for expression, _value in rows)
                      + "};\nint main(void)\n{\n  for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) "
                      'printf("%lld\\n", rows[k]);\n  return 0;\n}\n')
    compiler = (os.environ.get("CC") or "cc").split()
    include = shlex.split(os.environ["INCLUDES"])
    subprocess.run([*compiler, *include, f"-I{TOP}/include", str(source), "-o", str(tmp_path / "layout")], check=True)
    said = subprocess.run([str(tmp_path / "layout")], check=True, stdout=subprocess.PIPE).stdout.split()
    assert [(row[0], int(word)) for row, word in zip(rows, said)] == rows


def public():
    """Yields every public class, function, method and property."""
    for name in flesh.__all__:
        thing = getattr(flesh, name)
        if inspect.isclass(thing):
            yield name, thing
            for member, value in vars(thing).items():
                if not member.startswith("_") and (callable(value) or isinstance(
                        value, (property, classmethod, staticmethod, _arrays.Field))):
                    yield f"{name}.{member}", value
        elif callable(thing):
            yield name, thing


def test_help_is_complete():
    bare = [name for name, thing in public() if not (inspect.getdoc(thing) or "").strip()]
    assert not bare, f"without a docstring: {bare}"
    untyped = []
    for name, thing in public():
        function = getattr(thing, "__func__", thing)
        if inspect.isfunction(function) and "return" not in function.__annotations__:
            untyped.append(name)
    assert not untyped, f"without the type of what they return: {untyped}"
    shown = pydoc.plain(pydoc.render_doc(flesh))
    assert not [name for name, _thing in public() if name.split(".")[-1] not in shown]
    assert "[nodes, 3]" in shown and flesh.SolverOptions.max_newton.__doc__ in shown


def test_lines_are_short_and_files_too():
    for path, text in sources().items():
        lines = text.split("\n")
        assert len(lines) <= 451, f"{path} has {len(lines)} lines"
        assert max(map(len, lines)) <= 121, path
