"""fit.py: Young's modulus and Poisson's ratio from a pulled specimen, by scipy.optimize.least_squares.

A specimen of 2 m x 1 m x 1 m is held at one end and pulled at the other. How much longer and thinner it becomes is
"measured" for three loads (here: computed with values that the fit does not know, with noise of 0.1 mm). Each trial of
the fit computes an equilibrium for every load.
"""
import numpy as np
from scipy.optimize import least_squares

import flesh

LOADS = (1e3, 3e3, 6e3)  # Pa
TRUE = (3.2e4, 0.41)  # Young's modulus, Pa, and Poisson's ratio
BLUR = 1e-4  # noise of the measurement, m

MESH = flesh.Mesh.box((4, 2, 2), (2, 1, 1))
END = MESH.surface[(MESH.positions[MESH.surface][:, :, 0] == 2).all(axis=1)]
WALL = MESH.nodes_in_box((0, 0, 0), (0, 1, 1))
SIDE = MESH.nodes_in_box((1, 1, 0.5), (1, 1, 0.5))  # the middle of a side


def pulled(young, poisson):
    """Returns [2 * loads]: how much longer the specimen becomes and how much thinner in its middle, m, for each load."""
    body = flesh.Body(MESH, flesh.Material("S", young=young, poisson=poisson))
    state, found = flesh.State.at_rest(MESH), []
    for load in LOADS:
        system = flesh.System(MESH, [flesh.Elasticity(body), flesh.Traction(body, END, (load, 0, 0))]).pin(WALL)
        state = flesh.equilibrium(system, state)
        moved = state.x - MESH.positions
        found += [moved[END].mean(axis=(0, 1))[0], -2 * moved[SIDE][:, 1].mean()]
    return np.array(found)


def fit(measured):
    """Returns Young's modulus in 10 kPa and Poisson's ratio, and their standard errors."""
    solved = least_squares(lambda p: (pulled(1e4 * p[0], p[1]) - measured) / BLUR, (5, 0.3),
                           bounds=((0.1, 0), (100, 0.499)), diff_step=1e-4)
    errors = np.sqrt(np.diag(np.linalg.inv(solved.jac.T @ solved.jac)))
    return solved.x, errors


def main():
    measured = pulled(*TRUE) + BLUR * np.random.default_rng(1).normal(size=2 * len(LOADS))
    (young, poisson), (young_error, poisson_error) = fit(measured)
    print(f"Young's modulus {young:.3f} +- {young_error:.3f} (true: {TRUE[0] / 1e4}) x 10 kPa")
    print(f"Poisson's ratio {poisson:.4f} +- {poisson_error:.4f} (true: {TRUE[1]})")
    return (young, young_error), (poisson, poisson_error)


if __name__ == "__main__":
    main()
