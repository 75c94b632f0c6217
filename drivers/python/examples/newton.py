"""newton.py SCENE: the equilibrium of a scene, a hundred times as stiff, by Newton's method and SciPy's sparse solver."""
import sys

from scipy.sparse.linalg import spsolve

import flesh

scene = flesh.Scene(sys.argv[1], {"effects.inertia": None, "body.material.young": 1e7})
system, x = scene.system, scene.start().x
free = system.free()
for iteration in range(8):
    r = system.residual(x).ravel()[free]
    print(f"|r| = {(r @ r)**0.5:.1e} N")
    x.reshape(-1)[free] -= spsolve(system.jacobian(x)[free][:, free].tocsc(), r)
assert (r @ r)**0.5 < 1e-6
