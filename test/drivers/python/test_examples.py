# TEST part_of=test_python_examples
"""test_examples.py: the examples and the notebook work as described; the program's comparisons as tables."""
import importlib.util
import json
import os
import runpy

import matplotlib
import numpy as np
import pytest

import flesh
from flesh import _location
from conftest import TOP

matplotlib.use("Agg")
EXAMPLES = os.path.join(TOP, "drivers", "python", "examples")
needs_program = pytest.mark.skipif(not _location.PROGRAM, reason="the program is not built")
SCENE = {"body": {"mesh": os.path.join(TOP, "data", "meshes", "bar_16x4x4.mesh"), "density": 1000,
                  "material": {"energy": "S", "young": 1e5, "poisson": 0.45}},
         "effects": [{"inertia": {}}, {"gravity": {"acceleration": [0, 0, -9.81]}},
                     {"pin": {"box": [[-1, -1, -1], [1e-9, 2, 2]]}}],
         "time": {"method": "backward-euler", "step": "1/60", "end": 0.5}}


def load(name):
    spec = importlib.util.spec_from_file_location(name, os.path.join(EXAMPLES, name + ".py"))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def bar(tmp_path, monkeypatch):
    """Returns the path of a scene, in a separate working directory."""
    monkeypatch.chdir(tmp_path)
    flesh.Scene(SCENE, {"time.end": 0.1}).write("bar.yaml")
    return "bar.yaml"


def test_the_bars_tip_in_twelve_lines(capsys):
    path = os.path.join(EXAMPLES, "bar_tip.py")
    with open(path, encoding="utf-8") as file:
        assert len([line for line in file if line.strip()]) <= 12
    runpy.run_path(path)
    tip = flesh.Scene(SCENE).run().x[-1, 2]  # the same by the scene of the README
    assert capsys.readouterr().out == f"at 0.50 s the tip is at z = {tip:.4f} m\n" and -0.3 < tip < -0.27


@pytest.mark.parametrize("name, words", [("scenes", "0.500 s: last node at"), ("newton", "e-08 N"),
                                         ("wind", "the wind has moved the tip by 0.4"),
                                         ("gradient", "body.density: 2.7")])
def test_examples_take_a_scene(name, words, bar, capsys, monkeypatch):
    flesh.Scene(SCENE).write(bar)
    os.symlink(os.path.join(TOP, "data"), "data")
    monkeypatch.setattr("sys.argv", [name, bar])
    runpy.run_path(os.path.join(EXAMPLES, name + ".py"))
    assert words in capsys.readouterr().out


def test_scipys_solution_is_ours():
    distances = load("solve_ivp").main()
    ida = [distances[f"ida, tolerance {tolerance}"] for tolerance in ("1e-03", "1e-04", "1e-05")]
    bdf2 = [distances[f"bdf2, {steps} steps"] for steps in (50, 100, 200)]
    assert ida[0] > 3 * ida[1] > 9 * ida[2] and ida[2] < 1e-5
    assert all(3 < one / two < 5 for one, two in zip(bdf2, bdf2[1:])), bdf2  # of order 2


def test_the_map_and_the_push_come_back():
    q, correlation = load("map").main()
    assert correlation > 0.93 and abs(q[-1] - 1) < 0.01


def test_the_fit_finds_the_constants():
    fit = load("fit")
    (young, young_error), (poisson, poisson_error) = fit.main()
    assert abs(young - fit.TRUE[0] / 1e4) < 3 * young_error < 0.02
    assert abs(poisson - fit.TRUE[1]) < 3 * poisson_error < 0.01
    exact, _errors = fit.fit(fit.pulled(*fit.TRUE))
    assert np.allclose(exact, (fit.TRUE[0] / 1e4, fit.TRUE[1]), rtol=1e-4)


@needs_program
def test_a_sweep_becomes_a_figure(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    drift = load("sweep_figure").main()
    assert load("sweep_figure").main().equals(drift)  # again: completed cases are not run again
    assert list(drift.columns) == ["B", "E", "S"] and len(drift) == 5 and (drift["S"] < drift["E"]).all()
    with open("out/python_sweep/drift.png", "rb") as file:
        assert file.read(8) == b"\x89PNG\r\n\x1a\n"
    assert matplotlib.image.imread("out/python_sweep/drift.png").std() > 0.05  # something is drawn
    result = flesh.SweepResult("out/python_sweep")
    assert repr(result) == f"<flesh.SweepResult of {result.table.rows} cases in {result.path}>"
    assert result.table.rows == 15 and result.table.where(energy="S", nu=0.49).rows == 1
    assert set(result.table["status"]) == {"complete"} and result.query("SELECT sum(newton) n FROM results")["n"][0] > 15
    with pytest.raises(flesh.FileError, match="readonly|read-only|query_only"):
        result.query("CREATE TABLE other (a)")
    with pytest.raises(flesh.ArgumentError, match="spec\\['scene'\\]"):
        flesh.sweep({"axes": []}, "out/other")


@needs_program
def test_comparisons_are_tables(bar):
    drift = flesh.drift(bar, "out/drift", {"time.end": 0.05}, energies=["E", "S"], poisson=[0.3, 0.45],
                        solvers=["guarded"])
    rows = drift.table.to_pandas()
    assert len(rows) == 4 and (rows.max_volume_drift > 0).all() and drift.verdict.strip()
    assert np.isnan(drift.table["failed_at"]).all() and drift.table.where(energy="S", poisson=0.45).rows == 1
    assert any(np.ptp(run.history["volume"]) > 0 for run in drift.runs.values())
    accuracy = flesh.accuracy(bar, "out/accuracy", methods=["bdf2", "midpoint"], quick=True, steps=["1/30", "1/60"])
    found = accuracy.table.where(method="midpoint", price="work")
    assert found.rows == 2 and found["error_position_rms"].max() > 0 and accuracy.orders.rows and accuracy.verdict
    cases = flesh.hardcases("out/hardcases", cases="jitter20", quick=True, energies="S", poisson="0.45")
    assert cases.table.rows >= 1 and cases.verdict.strip()
    with pytest.raises(flesh.ProgramError, match="energies") as error:
        flesh.drift(bar, "out/drift", energies="Q")
    assert error.value.status == 2
    with pytest.raises(KeyError, match="there are scene"):
        drift.table["nothing"]


def test_the_notebook_runs(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", os.path.dirname(os.path.dirname(flesh.__file__)))
    path = os.path.join(EXAMPLES, "swing.ipynb")
    with open(path, encoding="utf-8") as file:
        cells = json.load(file)["cells"]
    assert not [cell for cell in cells if cell.get("outputs") or cell.get("execution_count")]
    try:
        import ipykernel  # noqa: F401, the kernel that nbclient starts
        import nbclient
        import nbformat
    except ImportError:
        source = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")
        exec(compile(source, path, "exec"), {"__name__": "__main__"})
        return
    notebook = nbformat.read(path, as_version=4)
    nbclient.NotebookClient(notebook, timeout=1800, resources={"metadata": {"path": str(tmp_path)}}).execute()
    said = "".join(output.get("text", "") for cell in notebook.cells for output in cell.get("outputs", []))
    assert "Hz by the Jacobian" in said and "with the muscle" in said
    assert any("image/png" in output.get("data", {}) for cell in notebook.cells for output in cell.get("outputs", []))
