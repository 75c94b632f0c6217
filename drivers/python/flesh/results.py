"""results.py: the program's results (histories, drift, accuracy, hard cases, sweeps) as tables; and the program.

A table's columns are numpy arrays; to_pandas() gives a pandas.DataFrame if pandas is installed."""
import csv
import glob
import io
import json
import os
import sqlite3
import subprocess
from typing import TYPE_CHECKING, Dict, Iterator, List, Mapping, Optional

import numpy as np

from . import _location
from .errors import ArgumentError, FileError, ProgramError
from .frame import Frame
from .scene import Scene, _flow
from .system import State

if TYPE_CHECKING:
    import pandas

__all__ = ["Table", "RunResult", "DriftResult", "AccuracyResult", "HardcasesResult", "SweepResult", "program",
           "run_scene", "drift", "accuracy", "hardcases", "sweep"]


def _column(values):
    """Returns a column of whole numbers, else of numbers with NaN for empty cells, else of texts."""
    try:
        if all(isinstance(value, (str, int)) for value in values):
            return np.array([int(value) for value in values], dtype=np.int64)
    except (ValueError, OverflowError):
        pass
    try:
        return np.array([np.nan if value in ("", None) else float(value) for value in values])
    except (TypeError, ValueError):
        return np.array(["" if value is None else value for value in values], dtype=object)


class Table(Mapping):
    """Columns by name, with or without their unit: table["t"] or table["t [s]"] is an array [rows]. Empty cells are
    NaN in a column of numbers."""

    def __init__(self, columns: Mapping):
        self._columns = {name: np.asarray(values) for name, values in columns.items()}

    @classmethod
    def _of_rows(cls, names, rows):
        return cls({name: _column([row[k] for row in rows]) for k, name in enumerate(names)})

    @classmethod
    def read(cls, path) -> "Table":
        """Reads a CSV file with a header row. FileError if it is not one."""
        try:
            rows = list(csv.reader(io.StringIO(_text(os.path.dirname(path), os.path.basename(path)), newline="")))
        except csv.Error as error:
            raise FileError(f"{os.fspath(path)}: not a table: {error}") from None
        if not rows or any(len(row) != len(rows[0]) for row in rows):
            raise FileError(f"{os.fspath(path)}: not a table: rows of different lengths, or none")
        return cls._of_rows(rows[0], rows[1:])

    @classmethod
    def _of_query(cls, path, query, parameters=()):
        if not os.path.exists(path):
            raise FileError(f"{os.fspath(path)}: there is no such database")
        connection = sqlite3.connect(os.fspath(path))
        try:
            connection.execute("PRAGMA query_only = on")
            cursor = connection.execute(query, parameters)
            return cls._of_rows([column[0] for column in cursor.description], cursor.fetchall())
        except sqlite3.Error as error:
            raise FileError(f"{os.fspath(path)}: {error}") from None
        finally:
            connection.close()

    def __getitem__(self, name: str) -> np.ndarray:
        if name in self._columns:
            return self._columns[name]
        for column, values in self._columns.items():
            if column.partition(" [")[0] == name:
                return values
        raise KeyError(f"{name!r}; there are {', '.join(self._columns)}")

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(next(iter(self._columns.values()))) if self._columns else 0

    def where(self, **values) -> "Table":
        """Returns the rows whose columns have these values: table.where(energy="S")."""
        chosen = np.ones(self.rows, bool)
        for name, value in values.items():
            chosen &= self[name] == value
        return Table({name: column[chosen] for name, column in self._columns.items()})

    def to_pandas(self) -> "pandas.DataFrame":
        """Returns the table as a pandas.DataFrame (Debian's python3-pandas)."""
        import pandas
        return pandas.DataFrame(dict(self._columns))

    def __repr__(self):
        return f"<flesh.Table of {self.rows} rows: {', '.join(self._columns)}>"


def _text(folder, name):
    path = os.path.join(folder, name)
    try:
        with open(path, newline="", encoding="utf-8") as file:
            return file.read()
    except OSError as error:
        raise FileError(f"{path}: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise FileError(f"{path}: not a text in UTF-8: {error}") from None


def _object(folder, name):
    try:
        given = json.loads(_text(folder, name))
    except (json.JSONDecodeError, RecursionError) as error:
        raise FileError(f"{os.path.join(folder, name)}: not JSON: {error}") from None
    if not isinstance(given, dict):
        raise FileError(f"{os.path.join(folder, name)}: not an object of JSON")
    return given


class RunResult:
    """The folder of a run.

    Attributes:
        folder: its path.
        history: Table of history.csv, a row per step.
        probes: Table of probes.csv, a row per step; None where the scene has no probes.
        result: result.json as a dict: status, figures, provenance.
    """

    def __init__(self, folder):
        self.folder = os.fspath(folder)
        self.history = Table.read(os.path.join(folder, "history.csv"))
        probed = os.path.join(folder, "probes.csv")
        self.probes: Optional[Table] = Table.read(probed) if os.path.exists(probed) else None
        self.result: Dict = _object(folder, "result.json")

    @property
    def state(self) -> State:
        """The last state, with its multipliers and internal variables."""
        lines = [line.split() for line in _text(self.folder, "state.txt").splitlines() if line.strip()]
        counts = {line[1]: int(line[2]) for line in lines if line[1] in ("multipliers", "internal")}
        return State.read(os.path.join(self.folder, "state.txt"), sum(line[0] != "#" for line in lines), **counts)

    @property
    def scene(self) -> Scene:
        """The scene with every value in force."""
        return Scene(os.path.join(self.folder, "scene.yaml"))

    @property
    def frames(self) -> List[str]:
        """Paths of the run's frames, in order."""
        return sorted(glob.glob(os.path.join(glob.escape(self.folder), "frames", "frame_*.vtu")))

    def frame(self, index: int = -1) -> Frame:
        """Reads a frame with its fields as arrays; the last one by default."""
        paths = self.frames
        if not -len(paths) <= index < len(paths):
            raise IndexError(f"frame {index} is asked for; the run in {self.folder} wrote {len(paths)}")
        return Frame.read(paths[index])


class DriftResult:
    """The folder of a comparison of energies: `table` of drift.csv, `verdict` in words, `run(scene=..., ...)`."""

    def __init__(self, folder):
        self.folder = os.fspath(folder)
        self.table = Table.read(os.path.join(folder, "drift.csv"))
        self.verdict = _text(folder, "verdict.txt")

    @property
    def runs(self) -> Dict[str, RunResult]:
        """The runs, by the names of their folders."""
        folders = sorted(glob.glob(os.path.join(glob.escape(self.folder), "runs", "*")))
        return {os.path.basename(one): RunResult(one) for one in folders
                if os.path.exists(os.path.join(one, "history.csv"))}


class AccuracyResult:
    """The folder of a comparison of methods: `table` of accuracy.csv, `orders` of orders.csv, `verdict` in words."""

    def __init__(self, folder):
        self.folder = os.fspath(folder)
        self.table = Table.read(os.path.join(folder, "accuracy.csv"))
        self.orders = Table.read(os.path.join(folder, "orders.csv"))
        self.verdict = _text(folder, "verdict.txt")


class HardcasesResult:
    """The folder of a battery of hard cases: `table` of hardcases.csv, `verdict` in words."""

    def __init__(self, folder):
        self.folder = os.fspath(folder)
        self.table = Table.read(os.path.join(folder, "hardcases.csv"))
        self.verdict = _text(folder, "verdict.txt")


class SweepResult:
    """The database of a sweep: `table` has a row per case, with its axes, results and columns."""

    def __init__(self, path):
        self.path = os.path.join(path, "sweep.db") if os.path.isdir(path) else os.fspath(path)
        self.table = self.query("SELECT * FROM results")

    def query(self, sql: str, parameters=()) -> Table:
        """Returns the result of an SQL query."""
        return Table._of_query(self.path, sql, parameters)

    def __repr__(self):
        return f"<flesh.SweepResult of {self.table.rows} cases in {self.path}>"


def program(*arguments, check: bool = True) -> "subprocess.CompletedProcess[str]":
    """Runs the program `flesh` with these arguments; returns what it printed.

    Raises:
        ProgramError: the exit code was not 0; has the program's own sentence. Not raised if check is False.
    """
    path = os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), _location.PROGRAM))
    if not _location.PROGRAM:
        raise FileError("this copy of the package came without the program flesh (a wheel has no program, nor has a "
                        "build with -Dprogram=false); use the package from a build or an installation with the program")
    if not os.path.exists(path):
        raise FileError(f"{path}: the program is not there; build or install it")
    done = subprocess.run([path, *map(os.fspath, map(_word, arguments))], stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, stdin=subprocess.DEVNULL, universal_newlines=True, check=False)
    if check and done.returncode:
        said = done.stderr.strip() or f"flesh {arguments[0]} ended with the code {done.returncode}"
        raise ProgramError(said, done.returncode)
    return done


def _word(argument):
    if isinstance(argument, (Scene, Mapping)):
        raise ArgumentError("the program reads scenes from files; Scene.write makes one, whose path is to be given")
    return argument if isinstance(argument, (str, os.PathLike)) else str(argument)


def _arguments(out, overrides, options):
    words = ["--out", os.fspath(out)]
    for key, value in (overrides or {}).items():
        words += ["--set", f"{key}={_flow(value)}"]
    for name, value in options.items():
        option = "--" + name.replace("_", "-")
        if value is True:
            words.append(option)
        elif value is not False and value is not None:
            words += [option, ",".join(map(str, value)) if isinstance(value, (list, tuple)) else str(value)]
    return words


def run_scene(scene, out, overrides: Optional[Mapping] = None, **options) -> RunResult:
    """`flesh run`: runs the scene at a path into the folder `out`. Options as in `flesh run --help`: no_frames=True."""
    program("run", scene, *_arguments(out, overrides, options))
    return RunResult(out)


def drift(scenes, out, overrides: Optional[Mapping] = None, **options) -> DriftResult:
    """`flesh drift`: compares how well energies keep the volume: drift([path], out, energies=["S"], poisson=[0.45])."""
    paths = [scenes] if isinstance(scenes, (str, os.PathLike)) else list(scenes)
    program("drift", *paths, *_arguments(out, overrides, options))
    return DriftResult(out)


def accuracy(scene, out, overrides: Optional[Mapping] = None, **options) -> AccuracyResult:
    """`flesh accuracy`: compares the cost of accuracy: accuracy(path, out, methods=["bdf2"], quick=True)."""
    program("accuracy", scene, *_arguments(out, overrides, options))
    return AccuracyResult(out)


def hardcases(out, overrides: Optional[Mapping] = None, **options) -> HardcasesResult:
    """`flesh hardcases`: runs the hard cases: hardcases(out, cases="jitter20", quick=True)."""
    program("hardcases", *_arguments(out, overrides, options))
    return HardcasesResult(out)


def sweep(spec, out, **options) -> SweepResult:
    """`flesh sweep`: makes many runs into one database. The spec is a path, or a dict with paths relative to here."""
    if isinstance(spec, Mapping):
        if "scene" not in spec:
            raise ArgumentError("the sweep has no scene; spec['scene'] must be its path")
        os.makedirs(out, exist_ok=True)
        given = {**spec, "scene": os.path.abspath(spec["scene"])}
        spec = os.path.join(out, "spec.yaml")
        with open(spec, "w", encoding="utf-8") as file:
            file.write(_flow(given) + "\n")
    program("sweep", spec, *_arguments(out, None, options))
    return SweepResult(out)
