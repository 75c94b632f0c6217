"""solve_ivp.py: the same equations of motion, y' = f(t, y), in SciPy's Radau and in flesh's own integrators.

A bar is let go, stretched and bent, and swings for a quarter of a second. Radau, of order 5, with a tolerance a
thousand times as tight as the tightest of IDA's, is the reference; the distance from it falls with the tolerance of IDA
and with the square of the step of BDF2.
"""
import numpy as np
from scipy.integrate import solve_ivp

import flesh

END = 0.25  # s


def make_bar():
    """Returns a system with 45 nodes, and its start."""
    mesh = flesh.Mesh.box((4, 2, 2), (2, 1, 1))
    body = flesh.Body(mesh, flesh.Material("E", young=2e4, poisson=0.4), density=1000)
    system = flesh.System(mesh, [flesh.Inertia(body), flesh.Elasticity(body), flesh.Damping(body, mass=1.0)])
    system.pin(mesh.nodes_in_box((0, 0, 0), (0, 1, 1)))
    x = mesh.positions * (1.05, 1, 1)
    x[:, 2] += 0.02 * mesh.positions[:, 0]**2
    return system, flesh.State(x)


def by_scipy(system, start, tolerance):
    """Returns the positions at END and the number of evaluations of f."""
    problem = flesh.OdeProblem(system)
    y = problem.start(start)
    solved = solve_ivp(problem.rhs, (0, END), y, method="Radau", jac=problem.jacobian, rtol=tolerance,
                       atol=problem.tolerances(tolerance))
    assert solved.success, solved.message
    return problem.get_state(END, solved.y[:, -1]).x, solved.nfev


def by_flesh(system, start, method, steps=1, **options):
    """Returns the positions at END."""
    state = start.copy()
    integrator = flesh.Integrator(system, method, flesh.SolverOptions(newton_tolerance=1e-9), **options)
    for _ in range(steps):
        integrator.step(state, END / steps)
    return state.x


def main():
    system, start = make_bar()
    reference, evaluations = by_scipy(system, start, 1e-8)
    print(f"Radau, tolerance 1e-08: {evaluations} evaluations of f")
    distances = {}
    for tolerance in (1e-3, 1e-4, 1e-5):
        x = by_flesh(system, start, "ida", adaptive=flesh.AdaptiveOptions(tolerance=tolerance))
        distances[f"ida, tolerance {tolerance:.0e}"] = np.abs(x - reference).max()
    for steps in (50, 100, 200):
        distances[f"bdf2, {steps} steps"] = np.abs(by_flesh(system, start, "bdf2", steps) - reference).max()
    for name, distance in distances.items():
        print(f"{name}: {distance:.2e} m from it")
    return distances


if __name__ == "__main__":
    main()
