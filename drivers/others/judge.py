"""judge.py: decides whether a final state solves its case, by its own code: energies and forces of tets in NumPy."""
import numpy as np

from case import EDGES

FORMS = ["Neo", "A", "B", "E", "S"]  # the README of flesh has their formulas


def log_of(J):
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.log(J)


def shape_part(form, mu, I, J):
    """Returns the part of psi without lambda and its derivatives by I and J."""
    if form in ("Neo", "A"):
        return mu / 2 * (I - 3) - mu * log_of(J), mu / 2 + 0 * I, -mu / J
    if form == "B":
        with np.errstate(invalid="ignore", divide="ignore"):
            scale = np.where(J > 0, np.abs(J), np.nan)**(-2 / 3)
        return mu / 2 * (scale * I - 3), mu / 2 * scale, -mu / 3 * scale * I / J
    if form == "E":
        return mu / 2 * (I - 3), mu / 2 + 0 * I, 0 * J
    if form == "S":
        return mu / 2 * (I - 3 - np.log(I + 1)), mu / 2 * (1 - 1 / (I + 1)), 0 * J
    raise ValueError(f"the judge does not know the form {form}; it knows {', '.join(FORMS)}")


def volume_part(form, bulk, alpha, J):
    """Returns lambda U and its derivative by J."""
    if form == "Neo":
        return bulk / 2 * log_of(J)**2, bulk * log_of(J) / J
    return bulk / 2 * (J - alpha)**2, bulk * (J - alpha)


def gradients(case):
    """Returns derivatives of the shape functions by rest position [q, m, nodes, 3] and weights [q, m] (m^3)."""
    a, b = (5 - 5**0.5) / 20, (5 + 3 * 5**0.5) / 20
    if case.tets.shape[1] == 4:
        points, weights = np.full((1, 4), 0.25), [1 / 6]
    else:
        points, weights = np.full((4, 4), a) + (b - a) * np.eye(4), [1 / 24] * 4
    barycentric = np.vstack([-np.ones(3), np.eye(3)])  # derivatives of L by the reference coordinates
    found, measures = [], []
    for L, weight in zip(points, weights):
        if case.tets.shape[1] == 4:
            local = barycentric
        else:
            corner = (4 * L - 1)[:, None] * barycentric
            edge = [4 * (L[i] * barycentric[k] + L[k] * barycentric[i]) for i, k in EDGES]
            local = np.vstack([corner, edge])
        jacobian = np.einsum("mni,nj->mij", case.rest[case.tets], local)
        found.append(np.einsum("nj,mji->mni", local, np.linalg.inv(jacobian)))
        measures.append(weight * np.linalg.det(jacobian))
    return np.array(found), np.array(measures)


def evaluate(case, x):
    """Returns the elastic energy less that at rest (J), its derivative by the positions [n, 3] (N; the residual without
    loads), and det F at the quadrature points [q, m]."""
    slopes, weights = gradients(case)
    F = np.einsum("mni,qmnj->qmij", x[case.tets], slopes)
    I, J = np.einsum("qmij,qmij->qm", F, F), np.linalg.det(F)
    cofactor = np.stack([np.cross(F[..., (i + 1) % 3, :], F[..., (i + 2) % 3, :]) for i in range(3)], -2)
    mu, bulk, alpha = (case.constants(name) for name in ("mu", "lambda", "alpha"))
    energy, of_I, of_J = np.zeros_like(J), np.zeros_like(J), np.zeros_like(J)
    for form in case.forms:
        own = np.array([material["energy"] == form for material in case.materials])[case.region]
        psi, psi_I, psi_J = shape_part(form, mu[own], I[:, own], J[:, own])
        U, dU = volume_part(form, bulk[own], alpha[own], J[:, own])
        one = np.ones(own.sum())
        rest = shape_part(form, mu[own], 3 * one, one)[0] + volume_part(form, bulk[own], alpha[own], one)[0]
        energy[:, own], of_I[:, own], of_J[:, own] = psi + U - rest, psi_I, psi_J + dU
    stress = 2 * of_I[..., None, None] * F + of_J[..., None, None] * cofactor
    forces = np.zeros_like(x)
    parts = np.einsum("qm,qmij,qmnj->mni", weights, stress, slopes)
    np.add.at(forces, case.tets, parts)
    return float((weights * energy).sum()), forces, J


def judge(case, x):
    """Returns figures of the final positions x [n, 3], and `wrong`, a list of sentences why they are no solution."""
    limits, length = case.judge, np.ptp(case.rest, 0).max()
    if x.shape != case.rest.shape or not np.isfinite(x).all():
        return {"wrong": ["a position is missing or not finite"]}
    energy, forces, J = evaluate(case, x)
    free = np.ones(len(x), bool)
    free[case.fixed] = False
    residual = float(np.linalg.norm((forces - case.loads)[free]))
    off = float(np.abs(x[case.fixed] - case.held_at).max(initial=0))
    distance = float(np.linalg.norm(x - case.rest, axis=1).max())
    inverted = int((J <= 0).any(0).sum())
    wrong = []
    if off > 1e-6 * length:
        wrong.append(f"a fixed node is {off:.1e} m off")
    if inverted > limits["inverted"]:
        wrong.append(f"{inverted} tets are inverted")
    # `not a <= b` is true for NaN, too.
    if not residual <= limits["residual"]:
        wrong.append(f"the residual is {residual:.1e} N, not below {limits['residual']:.1e}")
    if limits["energy"] is not None and not energy <= limits["energy"]:
        wrong.append(f"the energy is {energy:.1e} J, not below {limits['energy']:.1e}")
    if limits["distance"] is not None and not distance <= limits["distance"]:
        wrong.append(f"a node is {distance:.1e} m from rest")
    return {"inverted": inverted, "residual": residual, "energy": energy, "distance": distance, "wrong": wrong}
