"""fenicsx.py: the adapter for FEniCSx (Debian's python3-dolfinx): the energy in UFL, DOLFINx's own Newton solver, MUMPS.

`solve` moves the prescribed positions in load steps, and halves a step that fails. ELEMENT "P2-P1" has a continuous
pressure beside quadratic displacements: the energy's volume term lambda/2 (J-1)^2 becomes p (J-1) - p^2/(2 lambda)."""
import time

import numpy as np

from case import EDGES

SNES = False  # True: PETSc's newtonls with backtracking instead of DOLFINx's Newton solver
ELEMENT = "P"  # "P2-P1": the mixed element
STEPS = 10  # load steps, if prescribed positions differ from the start's
MOST = 50  # largest number of iterations of a solve: the default of DOLFINx and of PETSc
FORMS = ["Neo", "A", "B", "E", "S"]


def version():
    try:
        import dolfinx
        import petsc4py
    except ImportError:
        return None
    return f"DOLFINx {dolfinx.__version__}, PETSc {petsc4py.__version__}" + (", SNES" if SNES else "")


def can_run(case):
    """Returns None if the adapter can run the case, else why it cannot."""
    if not set(case.forms) <= set(FORMS):
        return f"its adapter has no form {', '.join(case.forms)}"
    if ELEMENT == "P2-P1" and case.forms != ["B"]:
        return "its mixed form is B's"
    return None


def density(form, mu, bulk, alpha, I, J):
    import ufl
    if form == "Neo":
        return mu / 2 * (I - 3) - mu * ufl.ln(J) + bulk / 2 * ufl.ln(J)**2
    if form == "A":
        return mu / 2 * (I - 3) - mu * ufl.ln(J) + bulk / 2 * (J - 1)**2
    if form == "B":
        return mu / 2 * (J**(-2 / 3) * I - 3) + bulk / 2 * (J - 1)**2
    if form == "E":
        return mu / 2 * (I - 3) + bulk / 2 * (J - alpha)**2
    return mu / 2 * (I - 3 - ufl.ln(I + 1)) + bulk / 2 * (J - alpha)**2


class Problem:
    """The case as forms of UFL: the unknowns u (and p), boundary values, and the dofs of each node."""

    def __init__(self, case):
        import ufl
        from dolfinx import fem, mesh
        from mpi4py import MPI
        corners = np.unique(case.tets[:, :4])
        number = np.full(len(case.rest), -1)
        number[corners] = np.arange(len(corners))
        domain = ufl.Mesh(ufl.VectorElement("Lagrange", "tetrahedron", 1))
        self.mesh = mesh.create_mesh(MPI.COMM_SELF, number[case.tets[:, :4]], case.rest[corners], domain)
        order = 2 if case.tets.shape[1] == 10 else 1
        element = ufl.VectorElement("Lagrange", "tetrahedron", order)
        self.mixed = ELEMENT == "P2-P1"
        if self.mixed:
            element = ufl.MixedElement(element, ufl.FiniteElement("Lagrange", "tetrahedron", 1))
        self.space = fem.FunctionSpace(self.mesh, element)
        self.w = fem.Function(self.space)
        u, p = ufl.split(self.w) if self.mixed else (self.w, None)
        cells = self.mesh.topology.original_cell_index
        constants = {}
        for name in ("mu", "lambda", "alpha"):
            constants[name] = fem.Function(fem.FunctionSpace(self.mesh, ("DG", 0)))
            constants[name].x.array[:] = case.constants(name)[cells]
        F = ufl.Identity(3) + ufl.grad(u)
        I, J = ufl.tr(F.T * F), ufl.det(F)
        mu, bulk = constants["mu"], constants["lambda"]
        if self.mixed:
            psi = mu / 2 * (J**(-2 / 3) * I - 3) + p * (J - 1) - p**2 / (2 * bulk)
        else:
            psi = density(case.forms[0], mu, bulk, constants["alpha"], I, J)
        measure = ufl.dx(metadata={"quadrature_degree": 4 if self.mixed else order})
        self.residual = ufl.derivative(psi * measure, self.w)
        self.jacobian = ufl.derivative(self.residual, self.w)
        self.node_dofs(case, cells)

    def node_dofs(self, case, cells):
        """Sets dof [n, 3], the dofs of every node's displacement."""
        space = self.space.sub(0) if self.mixed else self.space
        collapsed, parent = space.collapse() if self.mixed else (self.space, None)
        layout, geometry = collapsed.dofmap, self.mesh.geometry
        corners = np.unique(case.tets[:, :4])
        self.dof = np.full((len(case.rest), 3), -1)
        middle = {}
        if case.tets.shape[1] == 10:
            for tet in case.tets:
                for k, (a, b) in enumerate(EDGES):
                    middle[tuple(sorted((tet[a], tet[b])))] = tet[4 + k]
        reference = [(2, 3), (1, 3), (1, 2), (0, 3), (0, 2), (0, 1)]  # edges of Basix's tetrahedron
        for c in range(len(cells)):
            nodes = list(corners[np.array(geometry.input_global_indices)[geometry.dofmap.links(c)]])
            if middle:
                nodes += [middle[tuple(sorted((nodes[a], nodes[b])))] for a, b in reference]
            for node, dof in zip(nodes, layout.cell_dofs(c)):
                self.dof[node] = 3 * dof + np.arange(3)
        if self.mixed:
            self.dof = np.array(parent)[self.dof]

    def hold(self, case):
        """Returns the boundary conditions; `solve` fills the function of their values before each solve."""
        from dolfinx import fem
        self.wanted = fem.Function(self.space)
        # In Debian's DOLFINx 0.5, dirichletbc takes numbers of blocks, not of dofs, for a blocked space.
        if self.mixed:
            dofs = np.sort(self.dof[case.fixed].ravel()).astype(np.int32)
        else:
            dofs = np.sort(self.dof[case.fixed, 0] // 3).astype(np.int32)
        return [fem.dirichletbc(self.wanted, dofs)]

    def make(self, case):
        from dolfinx import fem
        from dolfinx.fem.petsc import NonlinearProblem
        self.bcs = self.hold(case)
        self.problem = NonlinearProblem(self.residual, self.w, bcs=self.bcs, J=self.jacobian)
        self.target = 0.1 * case.judge["residual"]
        self.fem = fem

    def forces(self):
        """Returns the residual at every dof, including constrained ones."""
        from dolfinx.fem.petsc import assemble_vector
        return assemble_vector(self.fem.form(self.residual)).array

    def newton(self):
        """Solves from w by DOLFINx's Newton solver; returns its iterations, and raises RuntimeError if it fails."""
        from dolfinx.nls.petsc import NewtonSolver
        from petsc4py import PETSc
        solver = NewtonSolver(self.mesh.comm, self.problem)
        solver.convergence_criterion, solver.max_it = "residual", MOST
        solver.atol, solver.rtol = self.target, 1e-9
        direct(solver.krylov_solver, PETSc)
        count, _ = solver.solve(self.w)
        return count

    def snes(self):
        """Solves as `newton` does, by PETSc's newtonls with backtracking."""
        from dolfinx.fem.petsc import create_matrix, create_vector
        from petsc4py import PETSc

        def take(x):
            x.ghostUpdate(addv=PETSc.InsertMode.INSERT, mode=PETSc.ScatterMode.FORWARD)
            x.copy(self.w.vector)
            self.problem.form(self.w.vector)

        def function(_, x, b):
            take(x)
            self.problem.F(self.w.vector, b)

        def jacobian(_, x, A, P):
            take(x)
            self.problem.J(self.w.vector, A)

        solver, x = PETSc.SNES().create(self.mesh.comm), self.w.vector.copy()
        solver.setFunction(function, create_vector(self.problem.L))
        solver.setJacobian(jacobian, create_matrix(self.problem.a))
        solver.setType("newtonls")
        solver.setTolerances(rtol=1e-9, atol=self.target, stol=0, max_it=MOST)
        direct(solver.getKSP(), PETSc)
        solver.solve(None, x)
        if solver.getConvergedReason() <= 0:
            raise RuntimeError(f"SNES ended for reason {solver.getConvergedReason()}")
        x.copy(self.w.vector)
        return solver.getIterationNumber()


def direct(krylov, PETSc):
    """Makes the linear solver an LU factorization by MUMPS."""
    krylov.setType("preonly")
    krylov.getPC().setType("lu")
    krylov.getPC().setFactorSolverType("mumps")


def solve(case, seconds, folder):
    """Returns a dict: final positions x [n, 3] (m; None if it failed), Newton iterations, why it failed (else None), CPU
    seconds from the mesh on without compilation, the total force on the moved nodes (N) and the number of unknowns."""
    if case.loads.any():
        return {"x": None, "newton": 0, "said": "its adapter has no loads"}
    Problem(case).make(case)  # compiles the forms, which is not timed
    begin, newton, said = time.process_time(), 0, None
    p = Problem(case)
    p.make(case)
    moved = case.start - case.rest
    p.w.x.array[p.dof] = moved
    goal, done = case.held_at - case.rest[case.fixed], 0.0
    start = moved[case.fixed]
    share = 1.0 if np.abs(goal - start).max(initial=0) < 1e-12 else 1 / STEPS
    while done < 1 - 1e-12 and said is None:
        before = p.w.x.array.copy()
        p.wanted.x.array[p.dof[case.fixed]] = start + min(1.0, done + share) * (goal - start)
        try:
            newton += p.snes() if SNES else p.newton()
            if not np.isfinite(p.w.x.array).all():
                raise RuntimeError("the solution is not finite")
            done += share
        except RuntimeError as error:
            p.w.x.array[:] = before
            share /= 2
            if share < 1 / STEPS / 64 or not (goal - start).any():
                said = " ".join(str(error).split())
    x = None if said else case.rest + p.w.x.array[p.dof]
    force = p.forces()[p.dof[case.moved]].sum(0).tolist() if not said and len(case.moved) else None
    return {"x": x, "force": force, "newton": newton, "said": said, "seconds": time.process_time() - begin,
            "unknowns": len(p.w.x.array)}


def cleanup(folder):
    """Does nothing: a run leaves no large files."""
