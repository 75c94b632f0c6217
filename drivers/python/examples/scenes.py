"""scenes.py SCENE: the steps of a scene by another method than its own, and the equilibrium of a scene from a dict."""
import sys

import flesh

scene = flesh.Scene(sys.argv[1], {"time.method": "bdf2"})  # keys as in --set
for step in scene.steps():  # the start, then every accepted step
    print(f"{step.t:.3f} s: last node at {step.x[-1, 2]:.4f} m, least J {step.J_min:.4f}, {step.stats.newton} iterations")

scene = flesh.Scene({
    "body": {"mesh": "data/meshes/bar_16x4x4.mesh", "material": {"energy": "E", "young": 1e5, "poisson": 0.4}},
    "effects": [{"gravity": {}}, {"pin": {"box": [[-1, -1, -1], [1e-9, 2, 2]]}}],
})
print("equilibrium:", flesh.equilibrium(scene.system, scene.start(), scene.solver).x[-1])
