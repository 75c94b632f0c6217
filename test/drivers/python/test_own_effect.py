# TEST part_of=test_python
"""test_own_effect.py: effects written in Python: checked, in runs, with exceptions, time, barriers, figures."""
import gc
import weakref

import numpy as np
import pytest

import flesh
from conftest import GRAVITY


class OwnGravity(flesh.OwnEffect):
    """Equals flesh.Gravity with the lumped mass."""
    name, role, depends_on_position_only = "gravity", "load", True

    def __init__(self, body):
        super().__init__(body.mesh)
        self.force = body.mesh.lumped_mass(body.density)[:, None] * GRAVITY

    def residual(self, point):
        return -point.load * self.force

    def potential(self, point, shift):
        return -point.load * self.force * point.x / shift.x if shift.x else 0

    def energy(self, point):
        return -(self.force * point.x).sum()


class Strings(flesh.OwnEffect):
    """Springs along pairs of nodes, of stiffness k N/m and length 0: V = k/2 |x_a - x_b|^2, with friction proportional
    to speed."""
    name, role, passive = "strings", "other", True

    def __init__(self, mesh, pairs, k, c=0.0):
        self.pairs, self.k, self.c = np.asarray(pairs), k, c
        super().__init__(mesh, cells=pairs)

    def apart(self, array):
        return array[self.pairs[:, 0]] - array[self.pairs[:, 1]]

    def residual(self, point):
        r, f = np.zeros_like(point.x), self.k * self.apart(point.x) + self.c * self.apart(point.v)
        np.add.at(r, self.pairs[:, 0], f)
        np.add.at(r, self.pairs[:, 1], -f)
        return r

    def jacobian(self, point, shift):
        block = (shift.x * self.k + shift.v * self.c) * np.kron([[1, -1], [-1, 1]], np.eye(3))
        return np.broadcast_to(block, (len(self.pairs), 6, 6))

    def potential(self, point, shift):
        terms = [self.k / 2 * self.apart(point.x)**2 / shift.x]
        if shift.v:
            terms.append(self.c / 2 * self.apart(point.v)**2 / shift.v)
        return np.array(terms)

    def energy(self, point):
        return self.k / 2 * (self.apart(point.x)**2).sum()


class Wrong(Strings):
    """An effect with a Jacobian of half the size."""

    def jacobian(self, point, shift):
        return super().jacobian(point, shift) / 2


class Nail(flesh.OwnEffect):
    """Pulls every node diagonally to its rest position, until t = 1."""
    name, report_names = "nail", ("longest", "pull")

    def residual(self, point):
        return 9 * (point.x - self.mesh.positions)

    def jacobian(self, point, shift):
        return np.broadcast_to(9 * shift.x * np.eye(3), point.x.shape + (3,))

    def potential(self, point, shift):
        return 4.5 * (point.x - self.mesh.positions)**2 / shift.x

    def next_event(self, t):
        return 1.0 if t < 1 else np.inf

    def report(self, point):
        return [np.abs(point.x - self.mesh.positions).max(), 9 * np.abs(point.x - self.mesh.positions).max()]


class Linear(flesh.OwnEffect):
    """r = A x of every cell, with a given symmetric A [count, 3k, 3k]."""
    name = "linear"

    def __init__(self, mesh, cells, matrices):
        self.cells, self.matrices = np.asarray(cells), matrices
        super().__init__(mesh, cells)

    def residual(self, point):
        count, k = self.cells.shape
        r = np.zeros_like(point.x)
        forces = np.einsum("cij,cj->ci", self.matrices, point.x[self.cells].reshape(count, 3 * k))
        np.add.at(r, self.cells, forces.reshape(count, k, 3))
        return r

    def jacobian(self, point, shift):
        return shift.x * self.matrices


# Some pairs name the higher node first, as cells may do.
PAIRS = [(0, 44), (44, 3), (7, 3), (12, 30)]


def test_the_check_of_derivatives_tells_right_from_wrong(mesh, body, bent):
    for right in (OwnGravity(body), Strings(mesh, PAIRS, 300, 2), Nail(mesh)):
        assert right.check_derivatives(mesh, bent).passes(), right
    report = Wrong(mesh, PAIRS, 300, 2).check_derivatives(mesh, bent)
    assert not report.passes() and report.jacobian[1] == pytest.approx(1) and report.potential.max() < 1e-6


def test_it_moves_a_body_as_the_built_in_one_does(mesh, body, held):
    ends = []
    for gravity in (flesh.Gravity(body, GRAVITY), OwnGravity(body)):
        system = flesh.System(mesh, [flesh.Inertia(body), flesh.Elasticity(body), gravity]).pin(held)
        assert system.effects[2].name == "gravity" and system.effects[2].role == "load"
        integrator, state = flesh.Integrator(system), flesh.State.at_rest(mesh)
        for _ in range(6):
            integrator.step(state, 1 / 60)
        ends.append(state.x)
    assert np.abs(ends[0] - ends[1]).max() < 1e-12 and ends[0][-1, 2] < 0.95


def test_its_jacobian_is_in_the_systems(mesh, bent):
    strings = Strings(mesh, PAIRS, 300)
    K = flesh.System(mesh, [strings]).jacobian(bent).toarray()
    expected = np.zeros((45, 3, 45, 3))
    for a, b in PAIRS:
        for d in range(3):
            expected[[a, b], d, [a, b], d] += 300
            expected[[a, b], d, [b, a], d] -= 300
    assert np.array_equal(K, expected.reshape(135, 135))
    # Cells with nodes in any order, and matrices that change under any exchange of nodes.
    some = np.random.default_rng(3).normal(size=(3, 12, 12))
    linear = Linear(mesh, [(5, 1, 9, 3), (1, 2, 3, 4), (44, 9, 0, 5)], some + some.transpose(0, 2, 1))
    assert linear.check_derivatives(mesh, bent).jacobian.max() < 1e-6
    K = flesh.System(mesh, [linear]).jacobian(bent)
    assert np.allclose(K @ bent.ravel(), flesh.System(mesh, [Linear(mesh, linear.cells, linear.matrices)])
                       .residual(bent).ravel(), atol=1e-12)
    nail = flesh.System(mesh, [Nail(mesh)])
    assert np.array_equal(nail.jacobian(bent).toarray(), 9 * np.eye(135)) and nail.next_event(0.5) == 1


def test_its_figures_stand_in_the_history(mesh, body, tmp_path):
    system = flesh.System(mesh, [flesh.Inertia(body), flesh.Elasticity(body), Nail(mesh), flesh.Gravity(body)])
    with flesh.History(tmp_path / "history.csv", system) as history:
        flesh.run(flesh.Integrator(system), flesh.State.at_rest(mesh), 0.1, 0.3, [history])
    table = flesh.Table.read(tmp_path / "history.csv")
    assert table["nail_pull"][-1] == pytest.approx(9 * table["nail_longest"][-1]) and table["nail_longest"][-1] > 0.1


class Swelling(Nail):
    """Claims that the tets have a pressure that rises with t and their number, and a tension along the image of x."""

    def stress(self, t, tet, F):
        return -(t + tet) * np.linalg.det(F) * np.eye(3) + 5 * np.outer(F[:, 0], F[:, 0])


def test_its_stress_stands_beside_the_elastic_one(mesh, body, bent, tmp_path):
    rows = []
    probe = flesh.Probe("p", ("stress",), mesh.positions[mesh.tets[3]].mean(0))
    for effect in (Nail(mesh), Swelling(mesh)):
        system = flesh.System(mesh, [flesh.Elasticity(body), effect])
        state = flesh.State.at_rest(mesh)
        state.x[...] = bent
        state.t = 0.25
        with flesh.Probes(tmp_path / "probes.csv", body, system, "static", [probe]) as probes:
            flesh.run(flesh.Integrator(system, "static"), state, 1.0, 0.25, [probes])
        rows.append(flesh.Table.read(tmp_path / "probes.csv"))
    corner, *others = mesh.tets[3]
    F = np.linalg.solve(mesh.positions[others] - mesh.positions[corner], bent[others] - bent[corner]).T
    expected = -3.25 * np.eye(3) + 5 * np.outer(F[:, 0], F[:, 0]) / np.linalg.det(F)
    for name, i, j in (("xx", 0, 0), ("yy", 1, 1), ("zz", 2, 2), ("xy", 0, 1), ("yz", 1, 2), ("xz", 0, 2)):
        own, both = (row[f"p.stress_{name} [Pa]"][0] for row in rows)
        assert both - own == pytest.approx(expected[i, j], abs=1e-9 * (abs(own) + 1))


class Failing(Nail):
    error = None
    calls = 0

    def residual(self, point):
        self.calls += 1
        if self.calls > 3:
            raise self.error
        return super().residual(point)


def test_what_it_raises_comes_out_of_the_step(mesh, body):
    effect = Failing(mesh)
    system = flesh.System(mesh, [flesh.Inertia(body), flesh.Gravity(body), effect])
    integrator, state = flesh.Integrator(system), flesh.State.at_rest(mesh)
    effect.error = ZeroDivisionError("mine")
    with pytest.raises(ZeroDivisionError, match="mine"):
        for _ in range(9):
            integrator.step(state, 0.1)
    assert state.t < 0.5 and np.isfinite(state.x).all()
    effect.error = KeyboardInterrupt()
    with pytest.raises(KeyboardInterrupt):
        integrator.step(state, 0.1)
    effect.error = flesh.UndefinedError()  # recoverable: shorter steps are tried down to the shortest
    with pytest.raises(flesh.SolveError):
        integrator.step(state, 0.1)
    assert integrator.failure.halvings == 8
    effect.calls = -1000
    integrator.step(state, 0.1)  # it continues as if nothing had happened


def test_wrong_shapes_are_told(mesh, bent):
    class Flat(Nail):
        returned, forms = np.zeros(3), 0

        def residual(self, point):
            return self.returned

        def potential(self, point, shift):
            return self.forms
    with pytest.raises(flesh.ArgumentError, match=r"Flat.residual returned .* shape \(3,\); it must be \(45, 3\)"):
        flesh.System(mesh, [Flat(mesh)]).residual(bent)
    for wrong, told in ((np.zeros((45, 3), complex), "complex values"), ("x", "no array of numbers: could not convert")):
        Flat.returned = Flat.forms = wrong
        with pytest.raises(flesh.ArgumentError, match=f"Flat.residual .*{told}"):
            flesh.System(mesh, [Flat(mesh)]).residual(bent)
        with pytest.raises(flesh.ArgumentError, match=f"Flat.potential .*{told}"):
            flesh.System(mesh, [Flat(mesh)]).potential(bent)
    with pytest.raises(flesh.ArgumentError, match="node numbers from 0 to 44"):
        Strings(mesh, [(0, 45)], 1)
    with pytest.raises(flesh.ArgumentError, match="twice"):
        Strings(mesh, [(4, 4)], 1)
    with pytest.raises(flesh.ArgumentError, match="no method residual"):
        type("Empty", (flesh.OwnEffect,), {})(mesh)
    with pytest.raises(flesh.ArgumentError, match="role"):
        type("Odd", (Nail,), {"role": "odd"})(mesh)


class Floor(flesh.OwnEffect):
    """A rising barrier at z = height, below which no node gets."""
    name, role = "floor", "contact"

    def residual(self, point):
        return np.zeros_like(point.x)

    def carry(self, point, t_from, t_to):
        return np.zeros_like(point.x) if t_to > 1 else None

    def max_feasible_step(self, t_from, x_from, t_to, x_to):
        down = x_from[:, 2] - x_to[:, 2]
        share = np.where(down > 0, (x_from[:, 2] + 0.2) / np.where(down > 0, down, 1), 1)
        return min(1.0, 0.9 * share.min())

    def push_out(self, t_from, x_from, t_to, x_to):
        x_to[:, 2] = np.maximum(x_to[:, 2], -0.2)
        return x_to

    def tunnelled(self, t_from, x_from, t_to, x_to):
        return (x_to[:, 2] < -0.2).any()

    def check(self, t, x):
        if (x[:, 2] <= -0.2).any():
            raise flesh.ArgumentError(f"node {x[:, 2].argmin()} is below the floor")

    def clearance(self, t, x):
        return x[:, 2].min() + 0.2 - 0.01

    def approach(self, t_from, t_to, low, high):
        return 0.0


def test_its_barrier_is_asked(mesh, body):
    system = flesh.System(mesh, [flesh.Inertia(body), flesh.Gravity(body), Floor(mesh)])
    system.check(mesh.positions)
    with pytest.raises(flesh.ArgumentError, match="below the floor"):
        system.check(mesh.positions - 1)
    integrator, state = flesh.Integrator(system), flesh.State.at_rest(mesh)
    try:
        for _ in range(20):
            integrator.step(state, 1 / 60)
    except flesh.SolveError:
        pass  # no force acts: only the barrier's feasible step limits
    assert -0.2 < state.x[:, 2].min() < 0


def test_it_lives_as_long_as_its_system_and_no_longer(mesh):
    def pulled():
        effect = Strings(mesh, PAIRS, 3)
        return weakref.ref(effect), flesh.System(mesh, [effect])
    effect, system = pulled()
    gc.collect()
    assert effect() is not None and np.abs(system.residual(mesh.positions)).max() > 0
    del system
    gc.collect()
    assert effect() is None


def test_cells_of_tets_are_ascending(mesh):
    cells = flesh.OwnEffect.tet_cells(mesh)
    assert np.array_equal(cells, np.sort(mesh.tets, axis=1))


class Tearing(flesh.OwnEffect):
    """Springs of 9 N/m that hold nodes at their rest positions, until one is longer than half a metre."""
    name, role, passive, report_names = "tearing", "other", True, ("torn",)

    def __init__(self, mesh):
        self.internal_count = mesh.node_count
        super().__init__(mesh)

    def stretched(self, point):
        return (point.x - self.mesh.positions) * (point.internal == 0)[:, None]

    def residual(self, point):
        return 9 * self.stretched(point)

    def jacobian(self, point, shift):
        return 9 * shift.x * (point.internal == 0)[:, None, None] * np.eye(3)

    def potential(self, point, shift):
        return 4.5 * self.stretched(point)**2 / shift.x

    def energy(self, point):
        return (4.5 * self.stretched(point)**2).sum()

    def update(self, point):
        return np.maximum(point.internal, np.linalg.norm(self.stretched(point), axis=1) > 0.5)

    def tell(self, internal):
        return f"{int(internal.sum())} tore"

    def report(self, point):
        return point.internal.sum()


def test_internal_variables_change_after_accepted_steps(mesh, body, tmp_path):
    system = flesh.System(mesh, [flesh.Inertia(body), Tearing(mesh)])
    assert system.internal_count == mesh.node_count
    far = mesh.positions + (0.6, 0, 0)
    torn, changed = system.update_internal(far)
    assert changed and (torn == 1).all() and not system.update_internal(far, internal=torn)[1]
    assert np.abs(system.residual(far)).max() > 5 and not system.residual(far, internal=torn).any()
    with pytest.raises(flesh.ArgumentError, match="internal has 3 values"):
        system.residual(far, internal=np.zeros(3))
    # The faster half of the springs breaks, and their nodes move on freely.
    fast = mesh.positions[:, 0] > mesh.positions[:, 0].mean()
    speed = np.where(fast, 60, 1)[:, None] * np.array([0, 0, 1.0])
    state = flesh.State(mesh.positions, speed, internal=np.zeros(system.internal_count))
    stepper = flesh.Integrator(system, "backward-euler")
    for _ in range(3):
        stepper.step(state, 0.01)
    assert (state.internal == fast).all()
    assert stepper.energy_balance.released == pytest.approx(fast.sum() * 4.5 * 0.6**2, rel=1e-2)
    state.write(tmp_path / "torn.txt")
    again = flesh.State.read(tmp_path / "torn.txt", mesh.node_count, internal=system.internal_count)
    assert (again.internal == state.internal).all() and (again.copy().internal == fast).all()
    with pytest.raises(flesh.ArgumentError, match="internal variables"):
        flesh.Integrator(system, "ida")
    problem = flesh.KinsolProblem(system)
    problem.set_stage(far, internal=torn)
    assert not problem.residual(np.zeros(problem.size)).any()


def test_internal_variables_need_an_update(mesh):
    class Forgetful(Nail):
        internal_count = 2
    with pytest.raises(flesh.ArgumentError, match="has internal variables, but no method update"):
        Forgetful(mesh)


def test_an_effect_that_is_wrongly_made_is_refused(system, mesh):
    class Forgetful(flesh.OwnEffect):
        def __init__(self, mesh):
            pass

        def residual(self, point):
            return np.zeros_like(point.x)

    class Numbered(flesh.OwnEffect):
        name, residual = 3, Forgetful.residual

    class Reporting(flesh.OwnEffect):
        report_names, residual = (3,), Forgetful.residual

    forgotten = r"^this Forgetful was never made; its __init__ must call super\(\).__init__\(mesh\)$"
    for use in (system.add, lambda effect: effect.check_derivatives(mesh, mesh.positions)):
        with pytest.raises(flesh.ArgumentError, match=forgotten):
            use(Forgetful(mesh))
    with pytest.raises(flesh.ArgumentError, match="^Numbered.name has 3; it must be a text$"):
        Numbered(mesh)
    with pytest.raises(flesh.ArgumentError, match="^Reporting.report_names has 3; it must be a text$"):
        Reporting(mesh)
    Reporting.report_names = "ab"
    with pytest.raises(flesh.ArgumentError, match="^Reporting.report_names is 'ab'; it must be a list of texts$"):
        Reporting(mesh)
    for count in (-1, 1.5, "2"):
        counted = type("Counted", (Forgetful,), {"__init__": flesh.OwnEffect.__init__, "internal_count": count})
        with pytest.raises(flesh.ArgumentError, match="^Counted.internal_count is .*; it must be a count$"):
            counted(mesh)
