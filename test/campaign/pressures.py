"""pressures.py: the effect of pressures other than one for each ten-node tet, by a prototype in small strain.

    pressures.py       needs NumPy, SciPy and the package flesh (PYTHONPATH=build/drivers/python); prints a table. The
                       irregular meshes need gmsh as well, and are left out where it is missing.

Quadratic displacements at a Poisson's ratio of .4999, with 2 mu of the volume term at the points and the rest by pressures:
one for each tet, one for each patch of three, continuous and linear, or these with a lumped mass, so that they can be
eliminated (infsup.py has the spaces). A smooth motion with a known pressure that varies by about one mu, held on one side
or all over; Cook's membrane and a pressed block (test_cook, test_compressed_block) against linear pressures on a finer mesh. Errors: of
displacement in L2, or of the work of the loads; of tets' mean pressures, as they are, as means over patches, and even, as
frames have them (lib/output/even_pressure.c).
"""
import shutil
import time

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import splu

import flesh
import infsup

MU, NU = 1., 0.4999
LAMBDA = 2 * MU * NU / (1 - 2 * NU)
KINDS = ("tets", "patches", "corners", "lumped")


def rule():
    """Returns 14 points of a tet, exact for degree 5 (Walkington 2000): barycentric coordinates, weights."""
    points = [np.where(np.arange(4) == k, 1 - 3 * a, a) for a in (0.31088591926330061, 0.092735250310891226) for k in range(4)]
    points += [np.where(np.isin(np.arange(4), pair), 0.454496295874350, 0.045503704125650) for pair in infsup.PAIRS]
    return list(zip(points, [0.112687925718016] * 4 + [0.073493043116362] * 4 + [0.042546020777081] * 6))


RULE = rule()
TRIANGLE = [((1 / 3,) * 3, 0.225)] + [(np.roll((1 - 2 * a, a, a), k), w) for a, w in
                                      ((0.470142064105115, 0.132394152788506), (0.101286507323456, 0.125939180544827))
                                      for k in range(3)]


class Body(infsup.Elements):
    def __init__(self, mesh):
        super().__init__(mesh)
        self.X, self.corners = mesh.positions, mesh.positions[mesh.tet_nodes[:, :4]]
        self.middles = {tuple(sorted((tet[i], tet[j]))): tet[4 + k]
                        for tet in self.nodes for k, (i, j) in enumerate(self.edges)}
        self.outer = [(np.array(face), tets[0]) for face, tets in infsup.faces(self.nodes).items() if len(tets) == 1]

    def at(self, L):
        return np.einsum("c,tci->ti", L, self.corners)

    def shape(self, L):
        return np.concatenate([L * (2 * L - 1), [4 * L[i] * L[j] for i, j in self.edges]])

    def face_nodes(self, face):
        return np.concatenate([face, [self.middles[tuple(sorted((face[i], face[j])))] for i, j in ((0, 1), (1, 2), (0, 2))]])

    def stiffness(self):
        """Returns K with 2 mu of the volume term."""
        K, rows = 0, (3 * self.nodes[:, :, None] + np.arange(3)).reshape(len(self.nodes), 30)
        for G in map(self.gradients, infsup.FOUR):
            block = np.einsum("tak,tbk,ij->taibj", G, G, np.eye(3)) + np.einsum("taj,tbi->taibj", G, G)
            K = K + MU * (block + 2 * np.einsum("tai,tbj->taibj", G, G)) * (self.volumes / 4)[:, None, None, None, None]
        places = np.repeat(rows, 30, axis=1).ravel(), np.tile(rows, (1, 30)).ravel()
        return sparse.csc_matrix((K.ravel(), places), (3 * self.node_count,) * 2)

    def pressures(self, kind):
        """Returns B, the diagonal or matrix M, and E [4 tets, pressures], which maps pressures to corners of tets."""
        count = 4 * len(self.nodes)
        if kind in ("corners", "lumped"):
            corners, numbers = np.unique(self.nodes[:, :4], return_inverse=True)
            E = sparse.csr_matrix((np.ones(count), (np.arange(count), numbers.ravel())), (count, len(corners)))
            B, M = self.continuous()
            return B, sparse.diags(np.asarray(M.sum(1)).ravel()) if kind == "lumped" else M, E
        P = infsup.patches(self.nodes) if kind == "patches" else sparse.eye(len(self.nodes)).tocsr()
        return P @ self.divergence(), sparse.diags(P @ self.volumes), sparse.kron(P.T, np.ones((4, 1))).tocsr()

    def tractions(self, where, traction):
        load = np.zeros((self.node_count, 3))
        for face, tet in self.outer:
            x = self.X[face]
            if not where(x.mean(0)):
                continue
            normal = np.cross(x[1] - x[0], x[2] - x[0]) / 2
            area = np.linalg.norm(normal)
            normal *= np.sign(normal @ (x.mean(0) - self.corners[tet].mean(0))) / area
            for L, w in TRIANGLE:
                L = np.array(L)
                N = np.concatenate([L * (2 * L - 1), [4 * L[0] * L[1], 4 * L[1] * L[2], 4 * L[0] * L[2]]])
                load[self.face_nodes(face)] += N[:, None] * traction(L @ x, normal) * area * w
        return load

    def solve(self, kind, load, fixed, u):
        """Returns u [nodes, 3] in equilibrium, mean pressures of tets, non-zeros of K and of its factor, seconds."""
        K, (B, M, E), u, start = self.stiffness(), self.pressures(kind), u.ravel().copy(), time.process_time()
        free, d = np.setdiff1d(np.arange(u.size), fixed), LAMBDA - 2 * MU
        if kind == "corners":
            A = sparse.bmat([[K[free][:, free], B[:, free].T], [B[:, free], -M / d]]).tocsc()
        else:
            A = (K + B.T @ sparse.diags(d / M.diagonal()) @ B).tocsc()[free][:, free]
        pivots = 1e-3 if kind == "corners" else 0
        factor = splu(A, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}, diag_pivot_thresh=pivots)
        p = np.zeros(B.shape[0])
        for _ in range(4):  # iterative refinement: A is ill-conditioned
            if kind == "corners":
                z = factor.solve(np.concatenate([(load - K @ u - B.T @ p)[free], M @ p / d - B @ u]))
                u[free], p = u[free] + z[:len(free)], p + z[len(free):]
            else:
                u[free] += factor.solve((load - K @ u - B.T @ (d * (B @ u) / M.diagonal()))[free])
        if kind != "corners":
            p = d * (B @ u) / M.diagonal()
        u = u.reshape(-1, 3)
        at_points = 2 * MU * np.einsum("tai,tai->t", self.gradients(np.full(4, 0.25)), u[self.nodes])
        return u, (E @ p).reshape(-1, 4).mean(1) + at_points, A.nnz, factor.nnz, time.process_time() - start

    def even(self, p):
        """Returns the means over tets of the continuous, linear field fitted to p, as in lib/output/even_pressure.c."""
        corners, q = self.nodes[:, :4], 0
        volume = np.bincount(corners.ravel(), np.repeat(self.volumes, 4), self.node_count)
        for step in range(9):
            lacks = self.volumes * (p - (q[corners].mean(1) if step else 0))
            q = q + np.bincount(corners.ravel(), np.repeat(lacks, 4), self.node_count) / np.where(volume > 0, volume, 1)
        return q[corners].mean(1)

    def readings(self, p, exact, weights):
        """Returns root mean square errors of p itself, of means over patches, and of even pressures."""
        P = infsup.patches(self.nodes)
        return [np.sqrt(weights @ (q - exact)**2 / weights.sum())
                for q in (p, P.T @ ((P @ (self.volumes * p)) / (P @ self.volumes)), self.even(p))]


def motion(x):
    """Returns u, its gradient [.., i, j], and the body force of the smooth motion; its pressure is lambda div u."""
    X, Y, Z = np.moveaxis(x, -1, 0)
    s, c, k = np.sin, np.cos, 1 / LAMBDA
    P, Q, zero = -c(3 * X) * c(2 * Y) / 3 + X * Z**2 * c(3 * Z), s(3 * X) * c(2 * Y) + Z**2 * c(3 * Z), 0 * X
    Py, Pz = 2 * c(3 * X) * s(2 * Y) / 3, X * (2 * Z * c(3 * Z) - 3 * Z**2 * s(3 * Z))
    Qx, Qy, Qz = 3 * c(3 * X) * c(2 * Y), -2 * s(3 * X) * s(2 * Y), 2 * Z * c(3 * Z) - 3 * Z**2 * s(3 * Z)
    Pyy, Pzz = 4 * c(3 * X) * c(2 * Y) / 3, X * (2 * c(3 * Z) - 12 * Z * s(3 * Z) - 9 * Z**2 * c(3 * Z))
    a, b, e = X + 2 * Z, 2 * X - Y, 2 * Y + Z
    u = 0.2 * np.stack([-c(b) + 2 * s(a), c(e) - 2 * c(b), -s(a) - 2 * c(e)], -1)
    u[..., 0] += k * P
    grad = 0.2 * np.stack([np.stack(row, -1) for row in ((2 * s(b) + 2 * c(a), -s(b), 4 * c(a)),
                                                        (4 * s(b), -2 * s(e) - 2 * s(b), -s(e)),
                                                        (-c(a), 4 * s(e), -2 * c(a) + 2 * s(e)))], -2)
    grad[..., 0, :] += k * np.stack([Q, Py, Pz], -1)
    laplace = 0.2 * np.stack([5 * c(b) - 10 * s(a), -5 * c(e) + 10 * c(b), 5 * s(a) + 10 * c(e)], -1)
    laplace[..., 0] += k * (Qx + Pyy + Pzz)
    return u, grad, -MU * laplace - (LAMBDA + MU) * k * np.stack([Qx, Qy, Qz], -1), Q


def smooth(name, mesh, where):
    body = Body(mesh)

    def traction(x, normal):
        grad, p = motion(x)[1::2]
        return MU * (grad + grad.T) @ normal + p * normal

    load, dofs = np.zeros((body.node_count, 3)), np.arange(3)
    for L, w in RULE:
        force = motion(body.at(L))[2]
        np.add.at(load, body.nodes, np.einsum("a,ti,t->tai", body.shape(L), force, w * body.volumes))
    held = np.unique([body.face_nodes(face) for face, _ in body.outer if where == "all" or body.X[face][:, 0].max() < 1e-9])
    if where == "side":
        load += body.tractions(lambda x: x[0] > 1e-9, traction)
    u = np.zeros((body.node_count, 3))
    u[held] = motion(body.X[held])[0]
    exact = sum(w * motion(body.at(L))[3] for L, w in RULE)
    for kind in KINDS:
        found, p, *cost = body.solve(kind, load.ravel(), (3 * held[:, None] + dofs).ravel(), u)
        square = sum(w * body.volumes @ ((np.einsum("a,tai->ti", body.shape(L), found[body.nodes]) -
                                          motion(body.at(L))[0])**2).sum(1) for L, w in RULE)
        row(f"{name}, {where}", mesh, kind, f"{np.sqrt(square):.2e} m", body.readings(p, exact, body.volumes), cost)


def cook(n):
    box = flesh.Mesh.box((4 * n, 2 * n, n), (1, 1, 1))
    x, y, z = box.positions.T
    return flesh.Mesh(np.stack([x, x * 11 / 12 + y * (11 - 7 * x) / 12, z * 5 / 24], 1), box.tets).raise_order()


def loaded(name, make, coarse, fine):
    """Prints errors of the work of the loads, and of pressures over their root mean square, for each kind."""
    def solve(body, kind):
        X, held = body.X, np.zeros((body.node_count, 3), bool)
        if name == "Cook":
            held[X[:, 0] < 1e-9] = True
            load = body.tractions(lambda x: x[0] > 1 - 1e-9, lambda x, normal: np.array([0, 0.1, 0]))
        else:
            held[X < 1e-9] = True
            held[X[:, 2] > 1 - 1e-9, :2] = True
            load = body.tractions(lambda x: x[2] > 1 - 1e-9 and max(x[:2]) < 0.5, lambda x, normal: -0.1 * normal)
        u, *rest = body.solve(kind, load.ravel(), np.flatnonzero(held.ravel()), np.zeros((body.node_count, 3)))
        return [load.ravel() @ u.ravel(), *rest]

    best, body = Body(make(fine)), Body(make(coarse))
    work, p, *_ = solve(best, "corners")
    centres, home = best.at(np.full(4, 0.25)), np.empty(len(best.nodes), int)
    for k, x in enumerate(centres):
        L = np.einsum("tci,ti->tc", body.of_corners, x - body.at(np.full(4, 0.25))) + 0.25
        home[k] = L.min(1).argmax()
    volumes = np.bincount(home, best.volumes, len(body.nodes))
    exact = np.bincount(home, best.volumes * p, len(body.nodes)) / volumes
    size = np.sqrt(volumes @ exact**2 / volumes.sum())
    for kind in KINDS:
        own, p, *cost = solve(body, kind)
        row(name, make(coarse), kind, f"{100 * (own / work - 1):+.2f} %", np.array(body.readings(p, exact, volumes)) / size, cost)


def row(name, mesh, kind, error, readings, cost):
    print(f"| {name} | {mesh.tet_count} | {kind} | {error} | {' | '.join(f'{e:.4f}' for e in readings)} | {cost[0] / 1e3:.0f} | "
          f"{cost[1] / 1e6:.2f} | {cost[2]:.2f} |", flush=True)


def main():
    print("| case | tets | pressures | u | p | over patches | even | K, 1000 | factor, 1e6 | CPU s |\n" + "|---" * 10 + "|")
    for where in ("side", "all"):
        for n in (2, 4, 6):
            smooth(f"cube, {n} cells", flesh.Mesh.box((n,) * 3, (1,) * 3).raise_order(), where)
        for size in (0.3, 0.15) if shutil.which("gmsh") else ():
            smooth("cube, gmsh", infsup.irregular("cube", size), where)
    loaded("Cook", cook, 2, 4)
    loaded("block", lambda n: flesh.Mesh.box((n,) * 3, (1,) * 3).raise_order(), 4, 8)


if __name__ == "__main__":
    main()
