"""conftest.py: what the tests of the Python package share: where things are, and a small bar."""
import os

import numpy as np
import pytest

import flesh

TOP = os.path.abspath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", ".."))
DATA = os.path.join(TOP, "data")
GRAVITY = (0, 0, -9.81)


def interpreter_environment(**more):
    """What an interpreter that a test starts needs to load the library."""
    preload = os.environ.get("INTERPRETER_PRELOAD")
    return {**os.environ, **({"LD_PRELOAD": preload} if preload else {}), **more}


@pytest.fixture
def mesh():
    """A bar of 2 m x 1 m x 1 m, 96 tets."""
    return flesh.Mesh.box((4, 2, 2), (2, 1, 1))


@pytest.fixture
def body(mesh):
    return flesh.Body(mesh, flesh.Material("S", young=1e5, poisson=0.45), 1000)


def effects_of(mesh, body):
    """One of every effect, on the bar."""
    surface = mesh.surface
    top = surface[(mesh.positions[surface][:, :, 2] == 1).all(axis=1)]
    amplitude = flesh.Amplitude([(0, 0), (1, 1)], smooth=True)
    return [flesh.Inertia(body), flesh.Elasticity(body), flesh.Gravity(body, GRAVITY),
            flesh.Spring(body, (2, 1, 1), 50, (3, 1, 1)), flesh.Damping(body, 0.2, 0.01),
            flesh.Damping(body, 0.2, 0.01, "current"), flesh.SettlingDamping(body, 2),
            flesh.Viscosity(body, 10, 20), flesh.Force(body, [3, 4], (1, 2, 3), amplitude),
            flesh.Traction(body, top, (0, 0, 9)), flesh.Pressure(body, surface, 100),
            flesh.Muscle(body, (1, 0.5, 0), flesh.Fibre("thelen", 1e4, optimal_stretch=0.9), amplitude, [0, 2, 5]),
            flesh.Drag(body, surface, 1.2, (1, -3, 2)), flesh.Buoyancy(body, 0.6),
            flesh.Weld(body, top, surface, distance=2), flesh.Weld(body, top, surface, distance=2, breaks_at=1e4),
            flesh.Joint(body, range(0, mesh.node_count, 2), range(1, mesh.node_count, 2), (0.5, 0.5, 0.5), 2e3, (0, 0.5, 0)),
            flesh.JointSpring(body, range(0, mesh.node_count, 2), range(1, mesh.node_count, 2), (0, 0, 0), (1, 1, 1),
                              2e3),
            flesh.Contact(body, flesh.Obstacle.plane((0, 0, -0.4), (0, 0, 1)), thickness=0.5)]


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
