"""gradient.py SCENE: derivatives of the last node's height after half a second by constants of the body and by the start."""
import sys

import numpy as np

import flesh


def system(key):
    """Returns a function that makes the scene's system with the key at a value."""
    return lambda value: flesh.Scene(sys.argv[1], {key: value}).system


scene = flesh.Scene(sys.argv[1])
integrator = flesh.Integrator(scene.system, "bdf2", flesh.SolverOptions(newton_tolerance=1e-10))
trajectory, state = flesh.Trajectory(integrator), scene.start()
for step in range(30):
    integrator.step(state, 1 / 60)

keys = {"body.material.young": 1e5, "body.material.poisson": 0.45, "body.density": 1000}
tip = np.zeros_like(state.x)
tip[-1, 2] = 1  # dQ/dx of Q = z of the last node
found = trajectory.gradient([flesh.Parameter(system(key), value) for key, value in keys.items()], by_x=tip)
for (key, value), slope in zip(keys.items(), found.by_parameters):
    print(f"{key}: {slope:.6g} m per unit, {0.01 * value * slope:+.5f} m for 1 % more")
print(f"by the velocities at the start: {np.abs(found.by_v).max():.3g} s at most")
