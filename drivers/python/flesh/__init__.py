"""flesh: dynamics of soft, nearly incompressible bodies, from Python.

    import flesh
    scene = flesh.Scene("bar.yaml")
    for step in scene.steps():
        print(step.t, step.x[-1, 2])

Arrays are numpy's: positions and velocities are [nodes, 3], SI units. What the library hands out are views that keep
their owner alive. Every failure is an exception with the library's sentence. Long calls release the interpreter's
lock, and Ctrl-C ends them in order.
"""
