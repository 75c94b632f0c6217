# TEST part_of=test_python
"""test_physics.py: materials, effects, systems and integrators agree with closed forms and with the library itself."""
import ctypes
import math

import numpy as np
import pytest

import flesh
from conftest import effects_of

STRETCH = np.array([[1.2, 0.1, 0], [0.05, 0.9, 0.2], [0, -0.1, 1.1]])


def own_psi(I_C, J):
    """Form E with mu = 2e4, lambda = 8e4 Pa."""
    mu, lambda_ = 2e4, 8e4
    alpha = 1 + mu / lambda_
    return (mu / 2 * (I_C - 3) + lambda_ / 2 * (J - alpha)**2, mu / 2, lambda_ * (J - alpha), 0, 0, lambda_)


def log_psi(I_C, J):
    """Form Neo, which has no value at J <= 0."""
    if J <= 0:
        raise flesh.UndefinedError
    mu, lambda_ = 2e4, 8e4
    return (mu / 2 * (I_C - 3) - mu * math.log(J) + lambda_ / 2 * math.log(J)**2, mu / 2,
            (lambda_ * math.log(J) - mu) / J, 0, 0, (lambda_ - lambda_ * math.log(J) + mu) / J**2)


def test_a_material_has_the_constants_it_was_given():
    soft = flesh.Material("stable-neo-hookean", young=1e5, poisson=0.3)
    mu = 1e5 / 2.6
    assert soft.form == "S" and soft.constants == "matched" and soft.mu == pytest.approx(4 / 3 * mu, rel=1e-14)
    assert soft.small_strain().mu == pytest.approx(mu) and abs(soft.small_strain().rest_stress) < 1e-9 * mu
    assert flesh.Material("D", young=1e5, poisson=0.45).constants == "raw" and soft.rest_ratio() == 1
    assert flesh.Material("D", "raw", mu=1e4, lambda_=1e5).rest_ratio() < 1
    assert flesh.Material.from_lame("E", "raw", 1e4, 1e5).lambda_ == 1e5
    assert flesh.Material.from_young("E", "matched", 1e5, 0.3).mu == pytest.approx(mu)
    assert flesh.Material("Fung", young=1e5, poisson=0.3, exponent=0.5).exponent == 0.5
    assert set("SEBD") <= set(flesh.FORMS) and {"exponent", "links"} <= set(flesh.FORM_CONSTANTS)
    for arguments, words in (((("Q",), {"young": 1, "poisson": 0}), "Neo"),
                             ((("S",), {"young": 1, "poisson": 0.6}), "0.5"),
                             ((("S",), {"young": 1, "poisson": 0, "exponent": 1}), "exponent"),
                             ((("S",), {"young": 1, "poisson": 0, "poison": 1}), "no 'poison'"),
                             ((("S",), {"mu": 1}), "lambda")):
        with pytest.raises(flesh.ArgumentError, match=words):
            flesh.Material(*arguments[0], **arguments[1])


@pytest.mark.parametrize("form", flesh.FORMS)
def test_stress_and_hessian_are_derivatives(form):
    material = flesh.Material(form, young=1e5, poisson=0.3)
    h = 1e-6
    directions = np.eye(9).reshape(9, 3, 3)
    difference = (material.energy(STRETCH + h * directions) - material.energy(STRETCH - h * directions)) / (2 * h)
    assert np.allclose(difference, material.stress(STRETCH).ravel(), rtol=1e-6, atol=1)
    columns = (material.stress(STRETCH + h * directions) - material.stress(STRETCH - h * directions)) / (2 * h)
    H = material.hessian(STRETCH)
    assert np.allclose(columns.reshape(9, 9), H, rtol=1e-5, atol=1e-5 * np.abs(H).max())
    pairs = material.eigen(STRETCH)
    Q = pairs.vectors.reshape(9, 9)
    assert np.allclose(Q.T @ np.diag(pairs.values) @ Q, H, atol=1e-9 * np.abs(H).max())
    assert np.linalg.eigvalsh(material.hessian_projected(-STRETCH) if form in "EDMS" else H).min() > -1e9


def test_a_psi_in_python_is_the_built_in_form(mesh, bent):
    own = flesh.Material.from_psi(own_psi)
    built_in = flesh.Material("E", "raw", mu=2e4, lambda_=8e4)
    assert own.form == "user" and own.energy(STRETCH) == pytest.approx(built_in.energy(STRETCH), rel=1e-14)
    assert own.psi(3, 1).J == own_psi(3, 1)[2]

    def residual(material):
        return flesh.System(mesh, [flesh.Elasticity(flesh.Body(mesh, material))]).residual(bent)
    r, threads = residual(built_in), flesh.Threads(2)
    assert np.allclose(residual(own), r, rtol=1e-12, atol=1e-9 * np.abs(r).max())
    system = flesh.System(mesh, [flesh.Elasticity(flesh.Body(mesh, own))])
    assert np.array_equal(system.residual(bent, threads=threads), system.residual(bent))
    # A compiled function causes no Python calls.
    kind = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_double, ctypes.c_double, ctypes.c_void_p,
                            ctypes.POINTER(ctypes.c_double))

    @kind
    def compiled(I_C, J, _material, out):
        for k, value in enumerate(own_psi(I_C, J)):
            out[k] = value
        return 0
    assert flesh.Material.from_psi(compiled).energy(STRETCH) == pytest.approx(own.energy(STRETCH), rel=1e-14)


def test_a_volume_part_in_python_is_the_built_in_one():
    mesh = flesh.Mesh.box((2, 1, 1), (2.0, 1.0, 1.0)).raise_order()
    x = mesh.positions + 0.02 * np.sin(9 * mesh.positions[:, ::-1])
    mu, lambda_ = 2e4, 8e5

    def neo(I_C, J):
        log = np.log(J)
        return (mu / 2 * (I_C - 3) - mu * log + lambda_ / 2 * log**2, mu / 2, (lambda_ * log - mu) / J, 0, 0,
                (lambda_ * (1 - log) + mu) / J**2)

    def volume(J):
        return np.log(J)**2 / 2, np.log(J) / J, (1 - np.log(J)) / J**2

    def residual(material):
        return flesh.System(mesh, [flesh.Elasticity(flesh.Body(mesh, material))]).residual(x)
    r = residual(flesh.Material("Neo", "raw", mu=mu, lambda_=lambda_))
    assert np.allclose(residual(flesh.Material.from_psi(neo, lambda_=lambda_, volume=volume)), r, rtol=1e-11,
                       atol=1e-10 * np.abs(r).max())
    with pytest.raises(flesh.ArgumentError, match="material.volume"):
        residual(flesh.Material.from_psi(neo, lambda_=lambda_))
    with pytest.raises(flesh.ArgumentError, match=r"must be \(value, J, JJ\)"):
        residual(flesh.Material.from_psi(neo, lambda_=lambda_, volume=lambda J: J))


def test_what_a_psi_raises_comes_out(mesh, bent):
    log = flesh.Material.from_psi(log_psi)
    with pytest.raises(flesh.UndefinedError):
        log.energy(np.diag([1, 1, -1.]))

    def wrong(I_C, J):
        return I_C, J
    with pytest.raises(flesh.ArgumentError, match=r"it must be \(value, I, J, II, IJ, JJ\)"):
        flesh.Elasticity(flesh.Body(mesh, flesh.Material.from_psi(wrong)))  # which is evaluated at rest for the moduli

    def broken(I_C, J):
        return 1 / 0 if J != 1 else (0, 1, -1, 0, 0, 1)
    system = flesh.System(mesh, [flesh.Elasticity(flesh.Body(mesh, flesh.Material.from_psi(broken)))])
    for threads in (None, flesh.Threads(2)):
        with pytest.raises(ZeroDivisionError):
            system.residual(bent, threads=threads)
    system = flesh.System(mesh, [flesh.Elasticity(flesh.Body(mesh, log))])
    system.residual(bent)  # nothing of it remains


def test_every_effect_passes_the_check_of_derivatives(mesh, body, bent):
    for effect in effects_of(mesh, body):
        report = effect.check_derivatives(mesh, bent, t=0.5)
        assert report.passes(1e-6), (effect, report)
        assert report.potential[0] < 1e-6 and effect.role in flesh.ROLES
    top = mesh.surface[(mesh.positions[mesh.surface][:, :, 2] == 1).all(axis=1)]
    weld = flesh.Weld(body, top, mesh.surface, distance=2, stiffness=3e5)
    assert weld.check_derivatives(mesh, bent, t=0.5).passes()
    spring, wide = (flesh.Spring(body, (2, 1, 1), 50, (3, 1, 1), radius=radius) for radius in (0, 0.75))
    assert wide.check_derivatives(mesh, bent, t=0.5).passes()
    pulls = [np.abs(flesh.System(mesh, [one]).residual(mesh.positions)).max() for one in (spring, wide)]
    assert pulls[0] == pytest.approx(50) and pulls[1] < 40  # of one node, of several


def test_what_goes_through_each_other_is_let_apart(mesh):
    """Joins two bars in one mesh, without parts, the upper one sunk by a fifth of its height into the lower one."""
    x, count = mesh.positions, mesh.node_count
    both = flesh.Mesh(np.concatenate([x, x + (0.13, 0.07, 0.8)]), np.concatenate([mesh.tets, mesh.tets + count]))
    body = flesh.Body(both, flesh.Material("S", young=1e5, poisson=0.45), 1000)
    state = flesh.State(both.positions, np.repeat([[0, 0, 0], [0, 0, 2.0]], count, axis=0))
    for separates in (False, True):
        system = flesh.System(both, [flesh.Inertia(body), flesh.Elasticity(body),
                                     flesh.SurfaceContact(body, separates=separates)])
        if not separates:
            with pytest.raises(flesh.ArgumentError, match="intersect"):
                system.check(state.x)
    integrator = flesh.Integrator(system, "backward-euler")
    for _ in range(30):
        integrator.step(state, 0.005)
    apart = integrator.separation
    assert (apart.begun, apart.ignored) == (1, 0) and 0.1 < apart.t_apart < 0.15
    assert np.allclose(state.v[count:], (0, 0, 2), atol=1e-5) and np.allclose(state.v[:count], 0, atol=1e-5)


def test_muscles_pull_as_their_fibres_say(mesh, body):
    fibre = flesh.Fibre(peak_stress=2e4)
    assert flesh.FIBRE_CURVES == ("blemker", "thelen") and fibre.curve == "blemker"
    assert fibre.passive_stress == pytest.approx(1e3) and fibre.passive_limit == 0.4
    assert fibre.tension(1).tension == pytest.approx(2e4) and fibre.tension(1, 0).tension == 0
    h = 1e-6
    for stretch in (0.5, 0.8, 1.3):
        low, at, high = (fibre.tension(stretch + s, 0.7) for s in (-h, 0, h))
        assert (high.energy - low.energy) / (2 * h) == pytest.approx(at.tension, rel=1e-6)
        assert (high.tension - low.tension) / (2 * h) == pytest.approx(at.stiffness, rel=1e-5)
    with pytest.raises(flesh.ArgumentError, match="activation is 2; it must be from 0 to 1"):
        fibre.tension(1, 2)
    stretched = mesh.positions * (1.2, 1, 1)
    system = flesh.System(mesh, [flesh.Muscle(body, (1, 0, 0), fibre)])
    volume = mesh.tet_volumes.sum()
    assert system.energies(stretched)[0] == pytest.approx(volume * fibre.tension(1.2).energy)
    with pytest.raises(flesh.ArgumentError, match=r"fibres has shape \(2, 3\)"):
        flesh.Muscle(body, [(1, 0, 0)] * 2, fibre)


def test_a_systems_parts_belong_together(mesh, body, bent, rng):
    system = flesh.System(mesh, effects_of(mesh, body)[:5]).pin([0, 1], "xz")
    shift, v, a = flesh.Shift.backward_euler(1 / 60), rng.normal(size=bent.shape), rng.normal(size=bent.shape)
    du = rng.normal(size=bent.shape)

    def at(s):
        return flesh.Point(bent + s * shift.x * du, v + s * shift.v * du, a + s * shift.a * du, t=0.3)
    h = 1e-6
    K, r = system.jacobian(at(0), shift=shift), system.residual(at(0))
    assert abs(K - K.T).max() == 0 and K.shape == (135, 135)
    Kdu = K @ du.ravel()
    dr = (system.residual(at(h)) - system.residual(at(-h))).ravel() / (2 * h)
    assert np.abs(dr - Kdu).max() < 1e-6 * np.abs(Kdu).max()
    dphi = (system.potential(at(h), shift=shift).value - system.potential(at(-h), shift=shift).value) / (2 * h)
    assert dphi == pytest.approx((r * du).sum(), rel=1e-6)
    assert len(system.energies(at(0))) == 5 and system.load(at(0)).sum() == pytest.approx(
        2000 * 9.81 + system.residual(at(0))[:0].sum() + _spring_pull(system, at(0)), rel=1e-9)
    assert np.flatnonzero(system.fixed()).tolist() == [0, 2, 3, 5] and len(system.free()) == 131
    assert system.unknowns == 135 and system.has_role("damping") and not system.has_role("contact")
    assert system.instructions != "auto" and system.next_event(0) == np.inf


def _spring_pull(system, point):
    """Returns the sum of the spring's residual, from a system of it alone."""
    body = flesh.Body(system.mesh, None)
    return flesh.System(system.mesh, [flesh.Spring(body, (2, 1, 1), 50, (3, 1, 1))]).residual(point).sum()


def test_constraints_prescribe(mesh, body):
    motion = flesh.Motion([(0, (0, 0, 0)), (2, (0, 0, 1))])
    system = flesh.System(mesh, [flesh.Inertia(body)]).prescribe([5], motion, "z").pin([7], until=1)
    x = system.prescribe_positions(mesh.positions + 9, t=1)
    assert x[5, 2] == mesh.positions[5, 2] + 0.5 and x[5, 0] == mesh.positions[5, 0] + 9
    assert system.prescribed_motion(1).velocity[5].tolist() == [0, 0, 0.5] and system.moves
    assert system.next_event(0) == 1 and system.next_event(1) == 2
    of_a_set = [flesh.System(mesh).pin(nodes, "z").fixed() for nodes in ({5, 7}, {7: "z", 5: "z"}.keys(), [5, 7])]
    assert np.array_equal(of_a_set[0], of_a_set[2]) and np.array_equal(of_a_set[1], of_a_set[2]) and of_a_set[2].any()
    with pytest.raises(flesh.ArgumentError, match="'xyz'"):
        system.pin([0], "w")
    with pytest.raises(flesh.ArgumentError, match="finished"):
        system.add(flesh.Inertia(body))


def test_an_effect_belongs_to_one_system(mesh, body):
    gravity = flesh.Gravity(body)
    system = flesh.System(mesh, [gravity])
    with pytest.raises(flesh.ArgumentError, match="taken this effect"):
        flesh.System(mesh, [gravity])
    del system
    assert gravity.role == "load"  # it keeps the system alive


def test_free_fall_is_exact_and_steps_are_told(mesh, body):
    for method, fall in (("backward-euler", 9.81 * (1 + 10) * 10 / 2 / 3600), ("midpoint", 9.81 * (10 / 60)**2 / 2)):
        system = flesh.System(mesh, [flesh.Inertia(body), flesh.Elasticity(body), flesh.Gravity(body)])
        integrator = flesh.Integrator(system, method, flesh.SolverOptions(newton_tolerance=1e-6))
        state = flesh.State.at_rest(mesh)
        for _ in range(10):
            stats = integrator.step(state, 1 / 60)
        assert np.allclose(mesh.positions[:, 2] - state.x[:, 2], fall, rtol=1e-6)
        assert state.t == pytest.approx(1 / 6) and stats.residuals >= 1 and stats.solves == 1
        assert integrator.method == method
        assert integrator.energy_balance.gain < 1e-6 and integrator.warning is None
        assert integrator.energies(state)[2] == pytest.approx(system.energies(state.x, state.v)[2])


def test_newtons_method_in_python_finds_the_equilibrium(mesh, body, held):
    statics = flesh.System(mesh, [flesh.Elasticity(body), flesh.Gravity(body, (0, 0, -1))]).pin(held)
    found = flesh.equilibrium(statics, options=flesh.SolverOptions(newton_tolerance=1e-10))
    from scipy.sparse.linalg import spsolve
    x, free = mesh.positions.copy(), statics.free()
    for _ in range(20):
        r = statics.residual(x).ravel()[free]
        x.reshape(-1)[free] -= spsolve(statics.jacobian(x)[free][:, free].tocsc(), r)
    assert np.abs(x - found.x).max() < 1e-7 and x[-1, 2] < 0.95
    with pytest.raises(flesh.ArgumentError, match="must be at least"):
        flesh.equilibrium(statics, flesh.State(x, t=1))


def test_incompressible_tets_have_multipliers(mesh):
    ten = mesh.raise_order()
    rubber = flesh.Material("S", young=1e5, poisson=0.5)
    body = flesh.Body(ten, rubber, 1000)
    system = flesh.System(ten, [flesh.Elasticity(body), flesh.Gravity(body, (0, 0, -1))])
    system.pin(ten.nodes_in_box((0, 0, 0), (0, 1, 1)))
    assert rubber.incompressible and system.multiplier_count == ten.tet_count == 96
    state = flesh.State(ten.positions, multipliers=np.zeros(96))
    flesh.Integrator(system, "static").step(state, 0)
    assert np.abs(ten.mean_jacobians(state.x) - 1).max() < 1e-6 < np.abs(state.multipliers).max()
    free = system.free()
    balanced, unbalanced = (np.abs(system.residual(state.x, multipliers=p).ravel()[free]).max()
                            for p in (state.multipliers, None))
    assert balanced < 1e-2 * unbalanced
    with pytest.raises(flesh.ArgumentError, match="there are 96"):
        system.residual(state.x, multipliers=np.zeros(3))


def test_options_are_checked(system):
    options = flesh.SolverOptions(linear_solver="klu", threads=2)
    assert options.linear_solver == "klu" and flesh.SolverOptions().linear_solver == "pcg"
    assert flesh.SolverOptions().preconditioner == "auto" and flesh.SolverOptions(preconditioner="two-level")
    assert set(options.techniques) == set(flesh.TECHNIQUES) and "steps" in flesh.TECHNIQUES["longer_steps"]
    options.techniques = ["watchdog", "untangle"]
    assert options.techniques == ("watchdog", "untangle") and options._struct.techniques == 12
    options.techniques = ()
    with pytest.raises(flesh.ArgumentError, match="one of negative_curvature"):
        options.techniques = "prayer"
    assert "ic" in flesh.SolverOptions.preconditioner.__doc__
    with pytest.raises(flesh.ArgumentError, match="did you mean 'newton_tolerance'"):
        flesh.SolverOptions(newton_tolerence=1)
    with pytest.raises(flesh.ArgumentError, match="did you mean"):
        options.thread = 3
    with pytest.raises(flesh.ArgumentError, match="one of pcg, klu"):
        options.linear_solver = "lu"
    with pytest.raises(flesh.ArgumentError, match="alpha"):
        flesh.MethodOptions(alpha=-1)
    with pytest.raises(flesh.ArgumentError, match="one of backward-euler"):
        flesh.Integrator(system, "euler")
    with pytest.raises(flesh.ArgumentError, match="tolerance"):
        flesh.Integrator(system, "ida", adaptive=flesh.AdaptiveOptions(tolerance=2))
    assert flesh.method_order("bdf2") == 2 and flesh.usable_instructions() in flesh.INSTRUCTIONS


def test_a_failed_step_says_why_and_leaves_the_state(mesh, held):
    body = flesh.Body(mesh, flesh.Material("B", young=1e3, poisson=0.45), 1000)
    system = flesh.System(mesh, [flesh.Inertia(body), flesh.Elasticity(body), flesh.Gravity(body, (0, 0, -5e4))])
    system.pin(held)
    options = flesh.SolverOptions(max_newton=1, max_cutbacks=1)
    integrator, state = flesh.Integrator(system, options=options), flesh.State.at_rest(mesh)
    reported = []
    flesh.set_error_handler(lambda status, sentence: reported.append((status, sentence)))
    try:
        with pytest.raises(flesh.SolveError) as error:
            integrator.step(state, 1)
    finally:
        flesh.set_error_handler(None)
    assert reported[-1] == (error.value.status, str(error.value)) and integrator.failure.halvings == 1
    assert state.t == 0 and np.array_equal(state.x, mesh.positions)


def test_what_an_error_handler_raises_comes_out_of_the_call():
    with pytest.raises(flesh.ArgumentError, match="it must be a function"):
        flesh.set_error_handler("print")
    flesh.set_error_handler(lambda _status, sentence: {}[sentence])
    try:
        with pytest.raises(KeyError, match="nowhere.mesh"):
            flesh.Mesh.read("nowhere.mesh")
    finally:
        flesh.set_error_handler(None)
    with pytest.raises(flesh.FileError):
        flesh.Mesh.read("nowhere.mesh")


def test_adaptive_steps_are_told(system, mesh):
    seen = []
    integrator = flesh.Integrator(system, "ida", adaptive=flesh.AdaptiveOptions(tolerance=1e-3),
                                  observe=lambda step: seen.append((step.t, step.x[-1, 2])))
    state = flesh.State.at_rest(mesh)
    stats = integrator.step(state, 0.2)
    assert len(seen) == stats.steps > 5 and seen[-1][0] >= 0.2 and integrator.ida and integrator.kinsol

    def fail(_step):
        raise KeyError("mine")
    integrator.set_adaptive(flesh.AdaptiveOptions(), fail)
    with pytest.raises(KeyError, match="mine"):
        integrator.step(state, 0.2)


def test_adaptive_is_runge_kutta_with_error_control(system, mesh):
    given, ends = flesh.AdaptiveOptions(tolerance=1e-2), []
    for method, control in (("adaptive", None), ("runge-kutta", 1), ("runge-kutta", 0)):
        options = given if control is None else flesh.AdaptiveOptions(tolerance=1e-2, control=control)
        integrator, state = flesh.Integrator(system, method, adaptive=options), flesh.State.at_rest(mesh)
        integrator.step(state, 0.2)
        assert integrator.method == "runge-kutta"
        ends.append(state.x)
    assert np.array_equal(ends[0], ends[1]) and not np.array_equal(ends[0], ends[2]) and given.control == 0


def test_states_come_back_bit_for_bit(mesh, rng, tmp_path):
    state = flesh.State(mesh.positions, rng.normal(size=mesh.positions.shape), t=1 / 3)
    state.write(tmp_path / "state.txt")
    again = flesh.State.read(tmp_path / "state.txt", mesh.node_count)
    assert again.t == state.t and np.array_equal(again.x, state.x) and np.array_equal(again.v, state.v)
    state.v = state.v[:, :2]
    with pytest.raises(flesh.ArgumentError, match="state.v must be"):
        state.write(tmp_path / "state.txt")
    state.v = np.full_like(state.x, np.nan)
    with pytest.raises(flesh.NonFiniteRunError):
        state.write(tmp_path / "state.txt")


def test_a_saved_integrator_goes_on_with_the_same_bits(system, mesh):
    def parts(ends):
        """A run in parts, each with a new integrator that loads what the last one saved."""
        state, taken, saved, told = flesh.State.at_rest(mesh), 0, None, []
        for end in ends:
            integrator = flesh.Integrator(system, "bdf2")
            if saved:
                integrator.load(saved)
            taken = flesh.run(integrator, state, 1 / 100, end, [lambda record: told.append(record.step)], taken=taken,
                              begin=0 if saved else None)
            saved = integrator.save()
            assert integrator.saves_all
        return state, taken, saved, told

    whole, steps, saved, told = parts([0.2])
    again, steps_again, _, told_again = parts([0.05, 0.06, 0.2])
    assert steps == steps_again == 20 and told == told_again == list(range(21))
    assert np.array_equal(whole.x, again.x) and np.array_equal(whole.v, again.v) and whole.t == again.t
    for data, words, error in ((saved[:-1], "it must have", flesh.FileError), (b"none", "no saved", flesh.FileError),
                               (saved[:200] + bytes([saved[200] ^ 1]) + saved[201:], "checksum", flesh.FileError)):
        with pytest.raises(error, match=words):
            flesh.Integrator(system, "bdf2").load(data)
    with pytest.raises(flesh.ArgumentError, match="saved by method bdf2"):
        flesh.Integrator(system, "newmark").load(saved)
    adaptive, state = flesh.Integrator(system, "ida"), flesh.State.at_rest(mesh)
    adaptive.step(state, 0.01)
    assert not adaptive.saves_all
