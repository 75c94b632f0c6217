"""curved_quadrature.py: the error of the four-point rule of straight ten-node tets on curved ones.

    curved_quadrature.py [--full]    needs NumPy, SciPy and build/drivers/flesh; prints a table

Ciarlet & Raviart (1972; Ciarlet 1978, section 4.4) keep the order of isoparametric elements of degree k with any rule
that is exact for degree 2k - 2 on the reference tet: 2 for ten nodes, which the four points are. This script measures
the error for an octant of a thick sphere under internal pressure (Lame), of curved ten-node tets with mid-edge nodes at
the exact positions, by an independent implementation of linear elasticity, once with the four points and once with 64
(Gauss and Gauss-Jacobi, exact for degree 7), on the same meshes. With tet10-mean all but 2 mu of the volume's modulus
is borne by the tet's mean of the divergence. Errors are relative to the exact field: of displacements in L2, of strains
in L2, both by the 64 points, and of the hole's opening.
"""
import itertools
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import spsolve
from scipy.special import roots_jacobi

INNER, OUTER, PRESSURE, YOUNG = 0.5, 1.0, 1.0, 1.0
EDGES = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]


def four_points():
    near, far = (5 + 3 * 5**0.5) / 20, (5 - 5**0.5) / 20
    return np.where(np.eye(4) > 0, near, far), np.full(4, 1 / 24)


def many_points(n=4):
    """Returns Stroud's conical product rule: barycentric coordinates and weights that sum to 1/6."""
    (a, wa), (b, wb), (c, wc) = (roots_jacobi(n, k, 0) for k in (2, 1, 0))
    points, weights = [], []
    for (x, u), (y, v), (z, w) in itertools.product(zip(a, wa), zip(b, wb), zip(c, wc)):
        x, y, z = (1 + x) / 2, (1 + y) / 2, (1 + z) / 2
        L = [x, y * (1 - x), z * (1 - x) * (1 - y)]
        points.append([1 - sum(L)] + L)
        weights.append(u / 8 * v / 4 * w / 2)
    return np.array(points), np.array(weights)


def shapes(L):
    """Returns values [points, 10] and derivatives by the coordinates 1 to 3 [points, 10, 3]."""
    N = np.concatenate([L * (2 * L - 1)] + [4 * L[:, [i]] * L[:, [j]] for i, j in EDGES], axis=1)
    by_L = np.zeros((len(L), 10, 4))
    for i in range(4):
        by_L[:, i, i] = 4 * L[:, i] - 1
    for k, (i, j) in enumerate(EDGES):
        by_L[:, 4 + k, i], by_L[:, 4 + k, j] = 4 * L[:, j], 4 * L[:, i]
    return N, by_L[:, :, 1:] - by_L[:, :, :1]


def place(p):
    """Maps the parameters (s, t, r), s + t <= 1, to the octant: a direction in the first octant, and a radius."""
    direction = np.array([1 - p[0] - p[1], p[0], p[1]])
    return (INNER + p[2] * (OUTER - INNER)) * direction / np.linalg.norm(direction)


def mesh(n):
    """Returns n^2 triangles by n layers of prisms, three tets each, with mid-edge nodes in the middle in parameters."""
    numbers, parameters = {}, []

    def number(p):
        key = tuple(int(round(2 * n * c)) for c in p)
        if key not in numbers:
            numbers[key] = len(parameters)
            parameters.append(np.array(key) / (2.0 * n))
        return numbers[key]

    tets = []
    for i, j, k in itertools.product(range(n), repeat=3):
        corner = {(a, b): (i + a, j + b) for a in (0, 1) for b in (0, 1)}
        for triangle in ([(0, 0), (1, 0), (0, 1)], [(1, 0), (1, 1), (0, 1)]):
            nodes = sorted(corner[c] for c in triangle)
            if max(sum(c) for c in nodes) > n:
                continue
            low, high = ([np.array([a, b, k + h]) / n for a, b in nodes] for h in (0, 1))
            for tet in ((low[0], low[1], low[2], high[2]), (low[0], low[1], high[1], high[2]),
                        (low[0], high[0], high[1], high[2])):
                X = [place(p) for p in tet]
                if np.linalg.det([X[1] - X[0], X[2] - X[0], X[3] - X[0]]) < 0:
                    tet = (tet[0], tet[1], tet[3], tet[2])
                tets.append([number(p) for p in tet] + [number((tet[a] + tet[b]) / 2) for a, b in EDGES])
    P = np.array(parameters)
    return np.array([place(p) for p in P]), np.array(tets), P


def geometry(X, tets, rule):
    """Returns gradients [tets, points, 10, 3], weights [tets, points], values [points, 10] and positions."""
    L, w = rule
    N, dN = shapes(L)
    D = np.einsum("qak,tai->tqik", dN, X[tets])
    return np.einsum("qak,tqki->tqai", dN, np.linalg.inv(D)), w * np.linalg.det(D), N, np.einsum("qa,tai->tqi", N, X[tets])


def solve(X, tets, P, poisson, mean, rule):
    mu, lam = YOUNG / (2 + 2 * poisson), YOUNG * poisson / ((1 + poisson) * (1 - 2 * poisson))
    g, w, _, _ = geometry(X, tets, rule)
    own = 2 * mu if mean and lam > 2 * mu else lam
    K = mu * (np.einsum("tq,tqak,tqbk,ij->taibj", w, g, g, np.eye(3), optimize=True) +
              np.einsum("tq,tqaj,tqbi->taibj", w, g, g, optimize=True))
    K += own * np.einsum("tq,tqai,tqbj->taibj", w, g, g, optimize=True)
    b = np.einsum("tq,tqai->tai", w, g)
    K += (lam - own) * np.einsum("tai,tbj,t->taibj", b, b, 1 / w.sum(axis=1))
    dofs = (3 * tets[:, :, None] + np.arange(3)).reshape(len(tets), 30)
    n = 3 * len(X)
    rows, columns = np.repeat(dofs, 30, axis=1).ravel(), np.tile(dofs, (1, 30)).ravel()
    matrix = coo_matrix((K.reshape(-1), (rows, columns)), shape=(n, n)).tocsc()
    f = np.zeros(n)
    add_pressure(X, tets, P, f)
    held = np.concatenate([3 * np.flatnonzero(np.abs(X[:, c]) < 1e-12) + c for c in range(3)])
    free = np.setdiff1d(np.arange(n), held)
    u = np.zeros(n)
    u[free] = spsolve(matrix[free][:, free], f[free])
    return u.reshape(-1, 3)


def add_pressure(X, tets, P, f):
    """Integrates on the hole's faces, with 25 points."""
    x, w = np.polynomial.legendre.leggauss(5)
    for tet in tets:
        for face in itertools.combinations(range(4), 3):
            if np.any(P[tet[list(face)], 2] > 1e-12):
                continue
            for (s, u), (t, v) in itertools.product(zip((1 + x) / 2, w / 2), repeat=2):
                L = np.zeros((1, 4))
                L[0, list(face)] = [1 - s, s * (1 - t), s * t]
                N, dN = shapes(L)
                full = np.concatenate([np.zeros((10, 1)), dN[0]], axis=1)
                along = [X[tet].T @ (full[:, face[k]] - full[:, face[0]]) for k in (1, 2)]
                normal = np.cross(*along)
                if normal @ X[tet[list(face)]].sum(axis=0) < 0:
                    normal = -normal
                for a in range(10):
                    f[3 * tet[a]:3 * tet[a] + 3] += PRESSURE * u * v * s * N[0, a] * normal


def lame(x, poisson):
    """Returns the exact displacement and its gradient at x [..., 3]."""
    k = PRESSURE * INNER**3 / (YOUNG * (OUTER**3 - INNER**3))
    a, b = k * (1 - 2 * poisson), k * (1 + poisson) * OUTER**3 / 2
    r = np.linalg.norm(x, axis=-1)[..., None]
    gradient = (a + b / r**3)[..., None] * np.eye(3) - 3 * b * x[..., :, None] * x[..., None, :] / (r**5)[..., None]
    return a * x + b * x / r**3, gradient


def errors(X, tets, u, poisson):
    g, w, N, x = geometry(X, tets, many_points())
    exact, by_x = lame(x, poisson)
    off = np.einsum("qa,tai->tqi", N, u[tets]) - exact
    strain = np.einsum("tqak,tai->tqik", g, u[tets], optimize=True) - by_x
    strain, exact_strain = ((a + np.swapaxes(a, -1, -2)) / 2 for a in (strain, by_x))
    norm = lambda a: np.sqrt(np.einsum("tq,tq->", w, (a**2).reshape(*w.shape, -1).sum(axis=-1)))
    hole = np.abs(np.linalg.norm(X, axis=1) - INNER) < 1e-9
    opening = np.einsum("ni,ni->n", u[hole], X[hole]).mean() / INNER
    exact_opening = np.linalg.norm(lame(X[hole][:1], poisson)[0])
    return norm(off) / norm(exact), norm(strain) / norm(exact_strain), opening / exact_opening - 1


def by_flesh(program, X, tets, poisson, mean):
    """Returns the displacements by `flesh run` on the same mesh under a pressure of 1e-7 E, times 1e7."""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder)
        rows = ["nodes %d" % len(X)] + ["%.17g %.17g %.17g" % tuple(x) for x in X]
        rows += ["tets10 %d" % len(tets)] + [" ".join(map(str, tet)) for tet in tets]
        (path / "octant.txt").write_text("\n".join(rows) + "\n")
        pins = "".join("  - pin: {box: [[%s], [%s]], axes: [%s]}\n" % (
            ", ".join("-1e-9" if d == c else "-9" for d in range(3)),
            ", ".join("1e-9" if d == c else "9" for d in range(3)), "xyz"[c]) for c in range(3))
        (path / "scene.yaml").write_text(
            "body: {mesh: octant.txt, element: %s, material: {energy: Neo, young: 1, poisson: %g}}\n"
            "effects:\n%s  - pressure: {sphere: {centre: [0, 0, 0], radius: %.9g}, pressure: 1e-7}\n"
            "solver: {newton_tolerance: 1e-9}\n" % ("tet10-mean" if mean else "tet10", poisson, pins, INNER + 1e-6))
        subprocess.run([program, "run", path / "scene.yaml", "--out", path / "out"], check=True, stdout=subprocess.DEVNULL)
        x = [line.split()[:3] for line in (path / "out/state.txt").read_text().splitlines()
             if line and not line.startswith("#")][-len(X):]
        return (np.array(x, dtype=float) - X) * 1e7


def main(levels, program):
    """Prints the table; returns whether the four points cost no error and no order, and flesh agrees with them."""
    assert abs(four_points()[1].sum() - 1 / 6) < 1e-14 and abs(many_points()[1].sum() - 1 / 6) < 1e-14
    fine = True
    for poisson, mean in ((0.3, False), (0.45, True), (0.4999, True)):
        print(f"\npoisson {poisson}, {'tet10-mean' if mean else 'tet10'}: displacement, strain, hole; "
              "4 points, then 64; order from the row before")
        before = None
        for n in levels:
            X, tets, P = mesh(n)
            found = [solve(X, tets, P, poisson, mean, rule) for rule in (four_points(), many_points())]
            rows = [errors(X, tets, u, poisson) for u in found]
            text = f"{len(tets):6d} tets"
            for k, row in enumerate(rows):
                for c, value in enumerate(row):
                    order = f" ({np.log(abs(before[0][k][c] / value)) / np.log(n / before[1]):.2f})" if before else ""
                    text += f"  {value: .3e}{order}"
            if n <= 4:
                own = by_flesh(program, X, tets, poisson, mean)
                off = np.abs(own - found[0]).max() / np.abs(found[0]).max()
                text += f"; flesh is off the four points by {off:.1e}"
                fine &= off < 1e-5
            print(text, flush=True)
            fine &= all(a <= 1.05 * b for a, b in zip(rows[0][:2], rows[1][:2]))
            before = rows, n
    return fine


if __name__ == "__main__":
    found_nothing = main([2, 4, 6, 8, 10] if "--full" in sys.argv else [2, 4, 6],
                         pathlib.Path(__file__).resolve().parents[2] / "build/drivers/flesh")
    sys.exit(0 if found_nothing else 1)
