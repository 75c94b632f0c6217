"""bar_tip.py: a bar of 4 m x 1 m x 1 m, held at x = 0, sags for half a second."""
import flesh

mesh = flesh.Mesh.box((16, 4, 4), (4, 1, 1))
body = flesh.Body(mesh, flesh.Material("S", young=1e5, poisson=0.45), density=1000)
system = flesh.System(mesh, [flesh.Inertia(body), flesh.Elasticity(body), flesh.Gravity(body)])
system.pin(mesh.nodes_in_box((0, 0, 0), (0, 1, 1)))
integrator, state = flesh.Integrator(system), flesh.State.at_rest(mesh)
for step in range(30):
    integrator.step(state, 1 / 60)
print(f"at {state.t:.2f} s the tip is at z = {state.x[-1, 2]:.4f} m")
