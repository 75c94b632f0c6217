# TEST part_of=test_python_runs
"""test_infsup.py: checks what data/results/elements.md says of the inf-sup constants of tet10-mean on small meshes."""
import pathlib
import sys

import numpy as np

import flesh

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "campaign"))
import infsup  # noqa: E402


def cube(cells):
    return flesh.Mesh.box((cells,) * 3, (1,) * 3).raise_order()


def test_the_constraints_are_those_of_the_element():
    """From lambda to lambda + 1 the matrix at rest changes by B^T V^-1 B, with the B of the inf-sup test."""
    mesh = cube(2)

    def matrix(of_volume):
        material = flesh.Material("E", mu=1, lambda_=of_volume)
        body = flesh.Body(mesh, material, element="tet10-mean")
        return flesh.System(mesh, [flesh.Elasticity(body)]).finalize().jacobian(mesh.positions)

    B = infsup.Elements(mesh).divergence()
    expected = B.T @ B.multiply(1 / mesh.tet_volumes[:, None])
    assert abs(matrix(11) - matrix(10) - expected).max() < 1e-12 * abs(expected).max() * 11


def test_one_pressure_for_each_tet_is_not_stable_and_one_for_each_patch_is():
    found = {(cells, held): infsup.measure(cube(cells), held) for cells in (2, 3, 4) for held in ("side", "all")}
    for held in ("side", "all"):
        each = np.array([found[cells, held]["tets"][1] for cells in (2, 3, 4)])
        assert (np.diff(each) < 0).all() and each[2] < 0.8 * each[0]
        assert all(zeros == 0 and beta > 0.38 for zeros, beta in (found[cells, held]["patches"] for cells in (2, 3, 4)))
    assert [found[cells, "all"]["tets"][0] for cells in (2, 3, 4)] == [3, 3, 3]
    assert all(abs(found[cells, "side"]["corners"][1] - 0.563) < 0.003 for cells in (2, 3, 4))  # known to be stable
