"""infsup.py: inf-sup constants of quadratic displacements with one pressure for each tet, and with others.

    infsup.py [--full]    needs NumPy, SciPy and the package flesh (PYTHONPATH=build/drivers/python); prints a table. The
                       irregular meshes need gmsh as well, and are left out where it is missing.

The numerical inf-sup test of Chapelle & Bathe (1993): the least beta of sup_u (p, div u)/(|u|_1 |p|_0) over pressures
p, by the generalised eigenvalues of B A^-1 B^T p = beta^2 M p. A is the H1 seminorm, B the divergence, M the mass of
pressures. A pair of spaces is stable if beta stays above a bound as the mesh is refined. On a body with a fixed surface
a constant pressure does no work, so the least beta is left out there; every further 0 is a spurious pressure mode.
Pressures: one for each tet, as tet10-mean has them; one for each patch of three tets or more that share faces;
continuous and linear (Taylor & Hood), which are known to be stable.
"""
import itertools
import pathlib
import shutil
import subprocess
import sys
import tempfile

import numpy as np
import scipy.linalg
import scipy.sparse as sparse
from scipy.sparse.linalg import splu

import flesh

PAIRS = list(itertools.combinations(range(4), 2))
FOUR = np.where(np.eye(4) > 0, (5 + 3 * 5**0.5) / 20, (5 - 5**0.5) / 20)


class Elements:
    """The ten-node tets of a mesh with straight edges: gradients of shape functions, in the order of mesh.tet_nodes."""

    def __init__(self, mesh):
        corners = mesh.positions[mesh.tet_nodes[:, :4]]
        self.nodes, self.volumes, self.node_count = mesh.tet_nodes, mesh.tet_volumes, mesh.node_count
        self.of_corners = np.linalg.inv(np.insert(corners, 0, 1, axis=2))[:, 1:].transpose(0, 2, 1)  # [tets, 4, 3]
        middles = mesh.positions[mesh.tet_nodes[0, 4:]]
        halves = np.array([corners[0, [i, j]].mean(0) for i, j in PAIRS])
        self.edges = [PAIRS[np.linalg.norm(halves - m, axis=1).argmin()] for m in middles]

    def gradients(self, L):
        """Returns [tets, 10, 3] at barycentric coordinates L [4]."""
        g = self.of_corners
        return np.concatenate([(4 * L[:, None] - 1) * g] +
                              [4 * (L[i] * g[:, [j]] + L[j] * g[:, [i]]) for i, j in self.edges], axis=1)

    def seminorm(self):
        """Returns A [3 nodes, 3 nodes]: the integral of grad u : grad v."""
        blocks = sum(np.einsum("tia,tja,t->tij", G, G, self.volumes / 4) for G in map(self.gradients, FOUR))
        rows, columns = np.repeat(self.nodes, 10, axis=1), np.tile(self.nodes, (1, 10))
        A = sparse.coo_matrix((blocks.ravel(), (rows.ravel(), columns.ravel())), (self.node_count,) * 2)
        return sparse.kron(A, sparse.eye(3), format="csc")

    def divergence(self):
        """Returns B [tets, 3 nodes]: the integral of div u over each tet; its rows are volume * d(mean of J)/dx at
        rest."""
        values = self.gradients(np.full(4, 0.25)) * self.volumes[:, None, None]  # linear, so its value at the middle is the mean
        columns = 3 * self.nodes[:, :, None] + np.arange(3)
        rows = np.repeat(np.arange(len(self.nodes)), 30)
        return sparse.csr_matrix((values.ravel(), (rows, columns.ravel())), (len(self.nodes), 3 * self.node_count))

    def continuous(self):
        """Returns B and M of continuous, linear pressures with a value at each corner."""
        corners, numbers = np.unique(self.nodes[:, :4], return_inverse=True)
        numbers = numbers.reshape(-1, 4)
        B = M = 0
        for L in FOUR:
            at = self.gradients(L) * (self.volumes / 4)[:, None, None]
            values = L[None, :, None, None] * at[:, None]  # [tets, corners, nodes, 3]
            rows = np.broadcast_to(numbers[:, :, None, None], values.shape)
            columns = np.broadcast_to((3 * self.nodes[:, :, None] + np.arange(3))[:, None], values.shape)
            B += sparse.csr_matrix((values.ravel(), (rows.ravel(), columns.ravel())), (len(corners), 3 * self.node_count))
            mass = np.outer(L, L) * (self.volumes / 4)[:, None, None]
            rows, columns = np.repeat(numbers, 4, axis=1), np.tile(numbers, (1, 4))
            M += sparse.csr_matrix((mass.ravel(), (rows.ravel(), columns.ravel())), (len(corners),) * 2)
        return B, M


def faces(tets):
    """Returns the tets of each face, by its corners."""
    found = {}
    for k, tet in enumerate(tets[:, :4]):
        for face in itertools.combinations(np.sort(tet), 3):
            found.setdefault(face, []).append(k)
    return found


def patches(tets):
    """Returns [patches, tets] of ones: patches of three tets that share faces; remaining tets join a neighbour's."""
    neighbours = [[] for _ in tets]
    for pair in faces(tets).values():
        if len(pair) == 2:
            neighbours[pair[0]].append(pair[1])
            neighbours[pair[1]].append(pair[0])
    patch, count = np.full(len(tets), -1), 0
    for first in range(len(tets)):
        members = [first] if patch[first] < 0 else []
        for k in members:
            for other in neighbours[k]:
                if patch[other] < 0 and other not in members and len(members) < 3:
                    members.append(other)
        if len(members) == 3:
            patch[members] = count
            count += 1
    while (patch < 0).any():
        for k in np.flatnonzero(patch < 0):
            patch[k] = max((patch[other] for other in neighbours[k]), default=0)
    return sparse.csr_matrix((np.ones(len(tets)), (patch, np.arange(len(tets)))))


def held(mesh, elements, where):
    """Returns the dofs of the nodes at the least x ("side"), or on the whole surface ("all")."""
    if where == "side":
        x = mesh.positions[:, 0]
        nodes = np.flatnonzero(x < x.min() + 1e-9)
    else:
        outer = [face for face, tets in faces(elements.nodes).items() if len(tets) == 1]
        edges = {edge for face in outer for edge in itertools.combinations(face, 2)}
        middles = {tuple(sorted((tet[i], tet[j]))): tet[4 + k]
                   for tet in elements.nodes for k, (i, j) in enumerate(elements.edges)}
        nodes = np.unique([node for face in outer for node in face] + [middles[edge] for edge in edges])
    return (3 * nodes[:, None] + np.arange(3)).ravel()


def constants(A, B, M, fixed):
    """Returns all beta, the least first."""
    free = np.setdiff1d(np.arange(A.shape[0]), fixed)
    B = B[:, free]
    solve = splu(A[free][:, free].tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}, diag_pivot_thresh=0)
    S = B @ solve.solve(B.T.toarray())
    return np.sqrt(np.maximum(scipy.linalg.eigh((S + S.T) / 2, M.toarray(), eigvals_only=True), 0))


def measure(mesh, where):
    """Returns, by kind of pressure, how many beta are 0 (besides the constant pressure), and the least of the
    others."""
    elements = Elements(mesh)
    A, B, M = elements.seminorm(), elements.divergence(), sparse.diags(elements.volumes).tocsr()
    P, fixed = patches(mesh.tet_nodes), held(mesh, elements, where)
    result = {}
    for kind, (b, m) in {"tets": (B, M), "patches": (P @ B, P @ M @ P.T), "corners": elements.continuous()}.items():
        beta = constants(A, b, m, fixed)[where == "all":]
        result[kind] = int((beta < 1e-6).sum()), beta[beta >= 1e-6].min()
    return result


def irregular(shape, size):
    """Returns gmsh's mesh of a cube or a ball with edges of `size`, of ten-node tets."""
    with tempfile.TemporaryDirectory() as folder:
        geometry, path = pathlib.Path(folder, "body.geo"), pathlib.Path(folder, "body.msh")
        what = {"cube": "Box(1) = {0, 0, 0, 1, 1, 1};", "ball": "Sphere(1) = {0, 0, 0, 0.6};"}[shape]
        geometry.write_text(f'SetFactory("OpenCASCADE"); {what}\n')
        subprocess.run(["gmsh", "-3", "-clmin", str(size), "-clmax", str(size), "-format", "msh41", "-o", path, geometry],
                       check=True, stdout=subprocess.DEVNULL)
        return flesh.Mesh.read(path).raise_order()


def main(full):
    print("| mesh | tets | held | one for each tet | 0 | one for each patch | linear |\n|---|---|---|---|---|---|---|")
    cubes = [(f"cube, {n} cells", lambda n=n: flesh.Mesh.box((n,) * 3, (1,) * 3).raise_order(), ("side", "all"))
             for n in ((2, 3, 4, 5, 6, 8) if full else (2, 3, 4))]
    sizes = () if not shutil.which("gmsh") else (0.4, 0.25, 0.17, 0.13) if full else (0.4, 0.25)
    others = [(f"{shape}, gmsh", lambda shape=shape, size=size: irregular(shape, size),
               ("side", "all") if shape == "cube" else ("all",)) for shape in ("cube", "ball") for size in sizes]
    for name, make, wheres in cubes + others:
        mesh = make()
        for where in wheres:
            found = measure(mesh, where)
            print(f"| {name} | {mesh.tet_count} | {where} | {found['tets'][1]:.3f} | {found['tets'][0]} | "
                  f"{found['patches'][1]:.3f} | {found['corners'][1]:.3f} |", flush=True)


if __name__ == "__main__":
    if sys.argv[1:] not in ([], ["--full"]):
        sys.exit("usage: infsup.py [--full]")
    main("--full" in sys.argv)
