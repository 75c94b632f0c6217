# TEST part_of=test_python_runs
"""test_equations.py: the equations for user-owned solvers: KINSOL's, IDA's, SciPy's."""
import numpy as np
import pytest
from scipy.sparse.linalg import LinearOperator, cg, spsolve

import flesh


def difference(function, at, along, h=1e-6):
    return (function(at + h * along) - function(at - h * along)) / (2 * h)


@pytest.fixture
def mild(mesh, body, held):
    """Returns a body with gravity so small that plain Newton steps converge."""
    return flesh.System(mesh, [flesh.Inertia(body), flesh.Elasticity(body), flesh.Damping(body, 0.1, 0.01),
                               flesh.Gravity(body, (0, 0, -1))]).pin(held)


def test_newton_on_kinsols_equations(mild, mesh, body, held, rng):
    statics = flesh.System(mesh, [flesh.Elasticity(body), flesh.Gravity(body, (0, 0, -1))]).pin(held)
    problem = flesh.KinsolProblem(statics)
    u = problem.start()
    assert not u.any() and problem.size == 135
    du = rng.normal(size=problem.size)
    K = problem.jacobian(u + 0.01 * du)
    assert np.abs(difference(problem.residual, u + 0.01 * du, du) - K @ du).max() < 1e-6 * np.abs(K @ du).max()
    assert np.allclose(problem.jacobian_times(du), K @ du, rtol=1e-12, atol=1e-6)
    problem.preconditioner_setup(u)
    preconditioner = LinearOperator(K.shape, problem.preconditioner_solve)
    for _ in range(10):
        step, failed = cg(problem.jacobian(u), problem.residual(u), M=preconditioner, maxiter=500, atol=0)
        assert not failed
        u -= step
    assert np.linalg.norm(problem.residual(u)) < 1e-3
    found = flesh.equilibrium(statics, options=flesh.SolverOptions(newton_tolerance=1e-10))
    assert np.abs(mesh.positions.ravel() + u - found.x.ravel()).max() < 1e-5
    assert problem.stats.assemblies == 12  # those of `jacobian` and of the set-up
    with pytest.raises(flesh.ArgumentError, match=r"u has shape \(3,\)"):
        problem.residual(np.zeros(3))


def test_tangents_and_adjoints_of_a_stage(mild, rng):
    problem = flesh.KinsolProblem(mild)
    u = problem.start()
    K, free = problem.jacobian(u), mild.free()
    b = np.zeros((2, problem.size))
    b[:, free] = rng.normal(size=(2, len(free)))
    p = problem.solve(u, b, 1e-12)
    assert np.abs(p @ K - b)[:, free].max() < 1e-9 and np.abs(problem.solve(None, b[1]) - p[1]).max() < 1e-9
    with pytest.raises(flesh.ArgumentError, match=r"b has the shape \(3,\)"):
        problem.solve(u, np.zeros(3))


def test_equilibria_have_pressures():
    mesh = flesh.Mesh.box((2, 1, 1), (2, 1, 1)).raise_order()
    body = flesh.Body(mesh, flesh.Material("S", young=1e5, poisson=0.5), density=1000)
    system = flesh.System(mesh, [flesh.Elasticity(body), flesh.Gravity(body)])
    system.pin(mesh.nodes_in_box((0, 0, 0), (0, 1, 1)))
    state = flesh.equilibrium(system, options=flesh.SolverOptions(newton_tolerance=1e-8))
    assert state.multipliers.shape == (mesh.tet_count,) and state.multipliers.any() and state.internal is None
    assert np.isfinite(flesh.Sensitivity(system, state).respond(system.load(state.x))).all()


def test_gradients_of_an_equilibrium(mesh, body, held):
    def system(young=1e5, gravity=-1.0):
        body = flesh.Body(mesh, flesh.Material("S", young=young, poisson=0.45), 1000)
        return flesh.System(mesh, [flesh.Elasticity(body), flesh.Gravity(body, (0, 0, gravity))]).pin(held)

    exact = flesh.SolverOptions(newton_tolerance=1e-12)
    state = flesh.equilibrium(system(), options=exact)
    parameters = [flesh.Parameter(system, 1e5, 100), flesh.Parameter(lambda g: system(gravity=g), -1.0)]
    sensitivity = flesh.Sensitivity(system(), state)
    weights = np.zeros_like(state.x)
    weights[-1, 2] = 1
    young, gravity = sensitivity.gradient(iter(parameters), by_x=weights)
    assert young * 1e5 == pytest.approx(-gravity * -1.0, rel=1e-9)  # the shape depends only on their ratio
    ends = [flesh.equilibrium(system(young=1e5 + k), options=exact).x[-1, 2] for k in (-20, 20)]
    assert young == pytest.approx((ends[1] - ends[0]) / 40, rel=1e-6)
    operator = sensitivity.operator(parameters)
    assert np.allclose(operator.rmatvec(weights.ravel()), (young, gravity), rtol=1e-9)
    assert np.allclose(weights.ravel() @ operator.matvec([0, 1]), gravity, rtol=1e-8)
    held_z = np.zeros_like(state.x)
    held_z[held, 2] = 1
    assert sensitivity.gradient(parameters[1:], of_residual=held_z)[0] == pytest.approx(-2000, rel=1e-9)  # the weight
    load = sensitivity.force(parameters[1])
    assert np.allclose(-(sensitivity.adjoint(by_x=weights) * load).sum(), gravity, rtol=1e-9)
    bodies = [flesh.Body(mesh, flesh.Material("S", young=1e5 + k, poisson=0.45), 1000) for k in (-100, 100)]
    forces = flesh.tet_forces(*bodies, 200, state)
    whole = np.zeros_like(state.x)
    np.add.at(whole, mesh.tets, forces)
    assert np.allclose(whole, sensitivity.force(parameters[0]), atol=1e-9 * np.abs(whole).max())
    assert np.allclose(sensitivity.respond(whole), sensitivity.tangent(parameters[0]), rtol=1e-7, atol=1e-15)
    with pytest.raises(flesh.ArgumentError, match="is no equilibrium"):
        flesh.Sensitivity(system(), flesh.State.at_rest(mesh))
    weights[-1, 2] = np.nan
    for refused in (lambda: sensitivity.gradient(parameters, by_x=weights), lambda: sensitivity.respond(weights),
                    lambda: sensitivity.adjoint(of_residual=weights)):
        with pytest.raises(flesh.ArgumentError, match=r"\[44, 2\] is nan; it must be finite"):
            refused()


def test_gradients_of_a_motion(mesh, body, held):
    def system(young=1e5):
        body = flesh.Body(mesh, flesh.Material("S", young=young, poisson=0.45), 1000)
        return flesh.System(mesh, [flesh.Inertia(body), flesh.Elasticity(body), flesh.Gravity(body)]).pin(held)

    def fall(young=1e5, push=0.0, record=False):
        integrator = flesh.Integrator(system(young), "bdf2", flesh.SolverOptions(newton_tolerance=1e-12))
        trajectory = flesh.Trajectory(integrator, 1e-11) if record else None
        state = flesh.State.at_rest(mesh)
        state.v[-1, 1] = push
        z = [state.x[-1, 2]]
        for _ in range(20):
            integrator.step(state, 0.01)
            z.append(state.x[-1, 2])
        return z[-1], trajectory, (sum(z) - (z[0] + z[-1]) / 2) / 20

    _, trajectory, _ = fall(record=True)
    weights = np.zeros((mesh.node_count, 3))
    weights[-1, 2] = 1
    found = trajectory.gradient([flesh.Parameter(system, 1e5)], by_x=weights)
    assert found.by_parameters[0] == pytest.approx((fall(1e5 + 20)[0] - fall(1e5 - 20)[0]) / 40, rel=1e-5)
    assert found.by_v[-1, 1] == pytest.approx((fall(push=1e-3)[0] - fall(push=-1e-3)[0]) / 2e-3, rel=1e-5)
    bodies = [flesh.Body(mesh, flesh.Material("S", young=1e5 + k, poisson=0.45), 1000) for k in (-20, 20)]
    seen = []

    def at_end(t, by_x, by_v):
        if not seen:
            by_x += weights
        seen.append(t)

    by_tet = trajectory.tet_gradient(*bodies, 40, at_end)
    assert by_tet.shape == (mesh.tet_count,) and by_tet.sum() == pytest.approx(found.by_parameters[0], rel=1e-7)
    assert len(seen) == 21 and seen[0] == pytest.approx(0.2) and seen[-1] == 0
    dx, dv = trajectory.tangent(flesh.Parameter(system, 1e5))
    assert dx[-1, 2] == pytest.approx(found.by_parameters[0], rel=1e-7) and np.abs(dv).max() > 0
    operator, both = trajectory.operator([flesh.Parameter(system, 1e5)]), np.concatenate([weights, 0 * weights])
    assert (operator.T @ both.ravel())[0] == pytest.approx((both.ravel() @ (operator @ [1.0])), rel=1e-7)
    mean = trajectory.gradient([flesh.Parameter(system, 1e5)], by_x=weights, over="mean").by_parameters[0]
    assert mean == pytest.approx((fall(1e5 + 20)[2] - fall(1e5 - 20)[2]) / 40, rel=1e-5)
    with pytest.raises(flesh.ArgumentError, match="over is 'middle'"):
        trajectory.gradient(over="middle")
    with pytest.raises(flesh.ArgumentError, match="over is \\['mean'\\]"):
        trajectory.gradient(over=["mean"])
    weights[-1, 2] = np.inf
    with pytest.raises(flesh.ArgumentError, match=r"by_v\[44, 2\] is inf; it must be finite"):
        trajectory.gradient(by_v=weights)
    with pytest.raises(flesh.ArgumentError, match=r"start\[0, 44, 2\] is inf"):
        trajectory.tangents(flesh.Parameter(system, 1e5), [weights, 0 * both[45:]])
    seen.clear()
    with pytest.raises(flesh.ArgumentError, match=r"by_x\[44, 2\] is inf"):
        trajectory.tet_gradient(*bodies, 40, at_end)
    with pytest.raises(flesh.ArgumentError, match="ida has no sensitivities"):
        flesh.Trajectory(flesh.Integrator(system(), "ida"))


def test_a_stage_is_the_step_of_backward_euler(mild, mesh):
    h, state = 1 / 60, flesh.State.at_rest(mesh)
    stepped = state.copy()
    flesh.Integrator(mild, options=flesh.SolverOptions(newton_tolerance=1e-12)).step(stepped, h)
    problem = flesh.KinsolProblem(mild)
    problem.set_stage(state.x, state.v, -state.v / h, t=h, shift=flesh.Shift.backward_euler(h), x_lag=state.x,
                      v_lag=state.v, t_lag=0.0)
    u = problem.start()
    for _ in range(4):
        u -= spsolve(problem.jacobian(u), problem.residual(u))
    problem.freeze(u)
    assert np.abs(state.x.ravel() + u - stepped.x.ravel()).max() < 1e-10


def test_idas_equations(mild, mesh, rng):
    problem = flesh.IdaProblem(mild, flesh.SolverOptions(linear_solver="klu"))
    state = flesh.State(mesh.positions * (1.02, 1, 1))
    y, yp = problem.start(state)
    free = np.concatenate((mild.free(), 135 + mild.free()))
    F, size = problem.residual(0, y, yp), np.abs(mild.residual(state.x)).max()
    assert np.abs(F[free]).max() < 1e-9 * size and problem.event == np.inf
    d, cj = rng.normal(size=problem.size), 60.0
    J = problem.jacobian(0, cj, y, yp)
    tried = difference(lambda s: problem.residual(0, y + s * d, yp + s * cj * d), 0.0, 1.0)
    assert np.abs(tried - J @ d).max() < 1e-6 * np.abs(J @ d).max()
    problem.preconditioner_setup(0, cj, y, yp)
    assert np.abs(problem.jacobian_times(d) - J @ d).max() < 1e-9 * np.abs(J @ d).max()
    b = J @ d
    assert np.abs(problem.preconditioner_solve(b) - d)[free].max() < 1e-6 * np.abs(d).max()
    atol = problem.tolerances(1e-3)
    assert atol[free[0]] == pytest.approx(2e-3) and atol[0] > 1e6
    with pytest.raises(flesh.ArgumentError, match="tolerance is nan"):
        problem.tolerances(np.nan)
    assert problem.stats.residuals >= 3 and problem.stats.assemblies >= 2
    again = problem.get_state(0, y)
    assert np.array_equal(again.v, state.v) and np.array_equal(again.x, mild.prescribe_positions(state.x))


def test_the_ode_is_the_systems(mild, mesh, rng):
    problem = flesh.OdeProblem(mild, flesh.SolverOptions(linear_solver="klu"))
    state = flesh.State(mesh.positions, 0.1 * rng.normal(size=mesh.positions.shape))
    y = problem.start(state)
    x, v = y.reshape(2, -1, 3)
    f = problem.rhs(0, y).reshape(2, -1, 3)
    mass = mesh.lumped_mass(1000)[:, None]
    expected = np.where(mild.fixed(), 0, -mild.residual(x, v) / mass)
    assert np.array_equal(f[0], np.where(mild.fixed(), 0, v)) and np.allclose(f[1], expected, rtol=1e-9, atol=1e-9)
    d = rng.normal(size=problem.size)
    J = problem.jacobian(0, y)
    assert np.abs(difference(lambda at: problem.rhs(0, at), y, d) - J @ d).max() < 1e-6 * np.abs(J @ d).max()
    problem.jacobian_times_setup(0, y)
    assert np.abs(problem.jacobian_times(d) - J @ d).max() < 1e-9 * np.abs(J @ d).max()
    gamma = 1e-3
    problem.preconditioner_setup(0, y, gamma)
    b = d - gamma * (J @ d)
    assert np.abs(problem.preconditioner_solve(b, gamma) - d).max() < 1e-6 * np.abs(d).max()
    assert problem.event == np.inf and problem.stats.residuals >= 1
    assert problem.tolerances(1e-4).shape == (270,) and problem.get_state(2.0, y).t == 2


def test_arguments_of_any_kind_give_the_same(mild, mesh, rng):
    problem = flesh.IdaProblem(mild)
    y, yp = problem.start(flesh.State(mesh.positions * (1.02, 1, 1)))
    expected = problem.residual(0, y, yp)
    pairs = np.empty((2, 2 * problem.size))
    pairs[:, ::2] = y, yp
    for given in ((list(y), list(yp)), (pairs[0, ::2], pairs[1, ::2]), (y.reshape(2, -1, 3), yp.astype(np.longdouble))):
        for _ in range(50):
            assert np.array_equal(problem.residual(0, *given), expected)
    problem = flesh.OdeProblem(mild)
    y = problem.start(flesh.State.at_rest(mesh))
    assert abs(problem.jacobian(0, list(y)) - problem.jacobian(0, y)).max() == 0


def test_an_undefined_energy_is_recoverable(mesh, body):
    body = flesh.Body(mesh, flesh.Material("Neo", young=1e5, poisson=0.3))
    problem = flesh.OdeProblem(flesh.System(mesh, [flesh.Inertia(body), flesh.Elasticity(body)]))
    y = problem.start(flesh.State.at_rest(mesh))
    y[:135] *= -1
    with pytest.raises(flesh.ArgumentError):  # whose message is not that of the next failure
        flesh.Material("Neo", young=-1, poisson=0.3)
    with pytest.raises(flesh.RecoverableError) as error:
        problem.rhs(0, y)
    assert isinstance(error.value, flesh.UndefinedError) and "the energy is undefined" in str(error.value)
    statics = flesh.System(mesh, [flesh.Elasticity(body)])
    with pytest.raises(flesh.ArgumentError, match="inertia"):
        flesh.OdeProblem(statics)
