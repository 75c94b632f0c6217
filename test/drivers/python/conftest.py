"""conftest.py: what the tests of the Python package share: where things are, and a small bar."""
import os

import numpy as np
import pytest

import flesh

TOP = os.path.abspath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", ".."))
DATA = os.path.join(TOP, "data")
GRAVITY = (0, 0, -9.81)


@pytest.fixture
def mesh():
    """A bar of 2 m x 1 m x 1 m, 288 tets."""
    return flesh.Mesh.box((4, 2, 2), (2, 1, 1))


@pytest.fixture
def body(mesh):
    return flesh.Body(mesh, flesh.Material("S", young=1e5, poisson=0.45), 1000)


@pytest.fixture
def held(mesh):
    """The nodes at x = 0."""
    return mesh.nodes_in_box((0, -1, -1), (0, 2, 2))


@pytest.fixture
def system(mesh, body, held):
    return flesh.System(mesh, [flesh.Inertia(body), flesh.Elasticity(body), flesh.Gravity(body, GRAVITY)]).pin(held)


@pytest.fixture
def bent(mesh):
    """Positions away from rest, where no gradient vanishes, with every J > 0."""
    x = mesh.positions
    noise = np.random.default_rng(7).normal(size=x.shape)
    return x * (1.05, 0.97, 1.02) + 0.1 * np.sin(x[:, [1, 2, 0]]) + 0.01 * noise


@pytest.fixture
def rng():
    return np.random.default_rng(1)
