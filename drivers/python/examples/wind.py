"""wind.py SCENE: an effect written in Python, the drag of a wind on a body that is held at x = 0."""
import sys

import numpy as np

import flesh


class Wind(flesh.OwnEffect):
    """Drag of the surface's nodes in a wind along x: c (v - w), in N."""
    name, role = "wind", "load"

    def __init__(self, mesh, drag, speed):
        super().__init__(mesh)  # without cells: only diagonal blocks
        self.c = drag * np.isin(np.arange(mesh.node_count), mesh.surface)[:, None]
        self.wind = np.array([speed, 0, 0])

    def residual(self, point):
        return point.load * self.c * (point.v - self.wind)

    def jacobian(self, point, shift):
        return point.load * shift.v * self.c[:, :, None] * np.eye(3)

    def potential(self, point, shift):
        if shift.v:
            return point.load * self.c / 2 * (point.v - self.wind)**2 / shift.v
        return point.load * self.c * (point.v - self.wind) * point.x / shift.x  # statics: a dead load


scene = flesh.Scene(sys.argv[1])
wind = Wind(scene.mesh, 2.0, 30.0)
bent = scene.mesh.positions + 0.01 * np.random.default_rng(1).normal(size=scene.mesh.positions.shape)
assert wind.check_derivatives(scene.mesh, bent).passes()

body = scene.body
system = flesh.System(body.mesh, [flesh.Inertia(body), flesh.Elasticity(body), wind])
system.pin(body.mesh.nodes_in_box((0, 0, 0), (0, 1, 1)))
state = flesh.State.at_rest(body.mesh)
flesh.run(flesh.Integrator(system), state, 1 / 60, 1 / 2)
print(f"the wind has moved the tip by {state.x[-1, 0] - body.mesh.positions[-1, 0]:.4f} m")
