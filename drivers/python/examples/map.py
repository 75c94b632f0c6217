"""map.py: the stiffness of each tet of a block, and the force that pushed it, from the motion of its top.

A block of 0.1 m, stiff on one side, stands in gravity and is pushed. The positions of its top's nodes after each step are
"measured" (here: computed with values that the fit does not know, with noise of 0.02 mm). scipy.sparse.linalg.lsqr finds
the Gauss-Newton steps from products alone: a tangent of the motion gives the product of the derivatives with a change of
all tets, and one adjoint gives that of their transpose. Differences between tets that share a face are penalised.
"""
import numpy as np
from scipy.sparse.linalg import LinearOperator, lsqr

import flesh

STEPS, STEP = 10, 0.01  # s
BLUR, WEIGHT = 2e-5, 3  # noise of the measurement, m; weight of the squared differences of logarithms
MESH = flesh.Mesh.box((2, 2, 2), (0.1, 0.1, 0.1))
TETS = MESH.tet_count
TOP = MESH.surface[(MESH.positions[MESH.surface][:, :, 2] == 0.1).all(axis=1)]
SEEN = MESH.nodes_in_box((0, 0, 0.1), (0.1, 0.1, 0.1))
FLOOR = MESH.nodes_in_box((0, 0, 0), (0.1, 0.1, 0))
PAIRS = np.array([(a, b) for a in range(TETS) for b in range(a) if len(set(MESH.tets[a]) & set(MESH.tets[b])) == 3])
STIFF = MESH.positions[MESH.tets].mean(axis=1)[:, 0] > 0.05
TRUE = np.append(np.log(np.where(STIFF, 9e4, 3e4)), 1)  # logarithms of Young's moduli in Pa; the push in kPa


def made(q):
    body = flesh.Body(MESH, [flesh.Material("S", young=young, poisson=0.4) for young in np.exp(q[:TETS])],
                      tet_material=np.arange(TETS))
    push = flesh.Traction(body, TOP, (1e3 * q[TETS], 0, 0))
    return body, flesh.System(MESH, [flesh.Inertia(body), flesh.Elasticity(body), flesh.Gravity(body), push]).pin(FLOOR)


def swing(q):
    """Returns the places [steps, nodes seen, 3], in units of the noise, and the recorded motion."""
    integrator = flesh.Integrator(made(q)[1], "newmark", flesh.SolverOptions(newton_tolerance=1e-10))
    trajectory, state, seen = flesh.Trajectory(integrator), flesh.State.at_rest(MESH), []
    for _ in range(STEPS):
        integrator.step(state, STEP)
        seen.append(state.x[SEEN] / BLUR)
    return np.array(seen), trajectory


def derivatives(q, trajectory):
    """Returns the derivatives by q of the places, and below them of the penalty, as a linear operator."""
    def along(change):
        parameter = flesh.Parameter(lambda s: made(q + s * change)[1], 0, 1e-4 / np.abs(change).max())
        return np.array([dx[SEEN] for _t, dx, _dv in trajectory.tangents(parameter)[1:]]).ravel() / BLUR

    bodies = [made(q + h)[0] for h in (-1e-4, 1e-4)]
    by_push = along(np.eye(TETS + 1)[TETS])
    numbers = len(by_push)

    def times(change):
        tets = np.append(np.ravel(change)[:TETS], 0)
        places = np.ravel(change)[TETS] * by_push + (along(tets) if tets.any() else 0)
        return np.append(places, np.sqrt(WEIGHT) * (tets[PAIRS[:, 0]] - tets[PAIRS[:, 1]]))

    def transposed(y):
        places, roughness = np.split(np.ravel(y), [numbers])
        steps = places.reshape(STEPS, -1, 3) / BLUR

        def read(t, by_x, _by_v):
            if t > STEP / 2:
                by_x[SEEN] += steps[round(t / STEP) - 1]

        gradient = np.append(trajectory.tet_gradient(*bodies, 2e-4, read), places @ by_push)
        np.add.at(gradient, PAIRS[:, 0], np.sqrt(WEIGHT) * roughness)
        np.subtract.at(gradient, PAIRS[:, 1], np.sqrt(WEIGHT) * roughness)
        return gradient

    return LinearOperator((numbers + len(PAIRS), TETS + 1), dtype=float, matvec=times, rmatvec=transposed)


def fit(measured, steps=6):
    q = np.append(np.full(TETS, np.log(5e4)), 0.7)
    for _ in range(steps):
        places, trajectory = swing(q)
        rough = np.sqrt(WEIGHT) * (q[PAIRS[:, 0]] - q[PAIRS[:, 1]])
        right = -np.append((places - measured).ravel(), rough)
        q = q + lsqr(derivatives(q, trajectory), right, atol=1e-3, btol=1e-3, iter_lim=60)[0]
    return q


def main():
    places = swing(TRUE)[0]
    q = fit(places + np.random.default_rng(1).normal(size=places.shape))
    correlation = np.corrcoef(q[:TETS], TRUE[:TETS])[0, 1]
    print(f"stiff tets {np.exp(np.median(q[:TETS][STIFF])):.3g} Pa (true: 9e+04), soft ones "
          f"{np.exp(np.median(q[:TETS][~STIFF])):.3g} Pa (3e+04), correlation of logarithms {correlation:.3f}")
    print(f"push {q[TETS]:.4f} kPa (true: 1)")
    return q, correlation


if __name__ == "__main__":
    main()
