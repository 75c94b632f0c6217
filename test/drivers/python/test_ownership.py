# TEST part_of=test_python
"""test_ownership.py: nothing is freed twice, and no array of another length, of another mesh or from an earlier state
is read."""
import copy
import gc
import inspect
import os
import pickle
import struct
import subprocess
import sys

import numpy as np
import pytest

import flesh
from flesh import _arrays, _callbacks
from conftest import GRAVITY, effects_of, interpreter_environment


class Pull(flesh.OwnEffect):
    name, report_names, internal_count = "pull", ("most",), 2

    def residual(self, point):
        return np.ones((self._nodes, 3))

    def report(self, point):
        return [point.internal.sum()]

    def update(self, point):
        return point.internal + 1


def all_effects(mesh, body):
    return [*effects_of(mesh, body), flesh.SurfaceContact(body), Pull(mesh)]


def test_an_object_of_another_class_is_refused(mesh, body, system):
    for wanted, wrong in (("System", lambda: flesh.Integrator(mesh)), ("System", lambda: flesh.IdaProblem(system=3)),
                          ("Effect", lambda: system.add(mesh)), ("Amplitude", lambda: flesh.Force(body, [0], [0, 0, 1], 2)),
                          ("Mesh", lambda: flesh.State.at_rest(system)), ("Mapping", lambda: flesh.Table(3)), ("System", lambda: flesh.equilibrium(mesh)),
                          ("Lagged", lambda: flesh.Point(mesh.positions, lagged=(0, mesh.positions, mesh.positions))),
                          ("Threads", lambda: flesh.Point(mesh.positions, threads=2))):
        with pytest.raises(TypeError, match=f" is of class .*; it must be of class {wanted}$"):
            wrong()
    for wrong in (lambda: flesh.Integrator(system).step(flesh.State.at_rest(mesh), "1"), lambda: flesh.Gravity(body).check_derivatives(
            mesh, mesh.positions, t="1"), lambda: flesh.Spring(body, (0, 0, 0), b"1", (0, 0, 0), radius="1")):
        with pytest.raises(TypeError, match="^[a-z]+ is b?'1'; it must be a number$"):
            wrong()
    with pytest.raises(TypeError, match=r"^mass is array\(.*; it must be a number$"):
        flesh.Damping(body, mesh.positions)
    with pytest.raises(flesh.ArgumentError, match=r"^element is \['tet4'\]; it must be one of "):
        flesh.Body(mesh, None, element=["tet4"])
    for wrong in ([(0, 1, 2)], "ab", body, 3):
        with pytest.raises((flesh.ArgumentError, TypeError), match="^points "):
            flesh.Amplitude(wrong)
    trajectory, x = flesh.Trajectory(flesh.Integrator(system)), mesh.positions
    parameter = flesh.Parameter(lambda _: system, 1.0)
    for wrong in (x, [x], parameter, [parameter, 3]):
        with pytest.raises(TypeError, match="^parameters must be a sequence of class Parameter$"):
            trajectory.gradient(wrong, by_x=x)
    with pytest.raises(TypeError, match="^probes must be a sequence of class Probe$"):
        flesh.Probes("probes.csv", body, system, "bdf2", probes=["tip"])
    for wrong in ("S", 3, ["S"], [flesh.Material("S", young=1e5, poisson=0.45), None]):
        with pytest.raises(TypeError, match="^system returned .*; it must return an object of class System$"):
            flesh.Parameter(lambda _value: wrong, 1.0)
        with pytest.raises(TypeError, match="^material is or has .*; it must be of class Material$"):
            flesh.Body(mesh, wrong)
    for wrong, told in (("1000", "texts"), (1j, "complex values"), (np.array(["1"] * mesh.tet_count), "texts")):
        with pytest.raises(flesh.ArgumentError, match=f"^density has {told}; they must be"):
            flesh.Body(mesh, None, wrong)
    for made, wrong in (("PointView", lambda: flesh.PointView(3, 4)), ("MeshInfo", lambda: flesh.MeshInfo([]))):
        with pytest.raises(TypeError, match=f"^{made} is made by the library from a struct of its own, not from "):
            wrong()


def test_every_effect_is_refused_by_another_mesh(mesh, body, system):
    fine = mesh.refine()
    fewer = flesh.Mesh(mesh.positions, mesh.tets[:-1])
    named = set()
    for other in (fine, fewer, flesh.Mesh.box((1, 1, 1), (1, 1, 1))):
        for effect in all_effects(mesh, body):
            named.add(type(effect))
            with pytest.raises(flesh.ArgumentError, match=f"{effect.name} is made for a mesh of 45 nodes and 96 tets"):
                effect.check_derivatives(other, other.positions)
            alone = flesh.System(other)
            with pytest.raises(flesh.ArgumentError, match=f"{effect.name} is made for a mesh of 45 nodes and 96 tets"):
                alone.add(effect)
            for use in (lambda e: e.check_derivatives(mesh, mesh.positions), flesh.System(mesh).add):
                with pytest.raises(flesh.ArgumentError, match="this effect is gone"):
                    use(effect)
            assert alone.effect_count == 0
    kinds = {thing for thing in vars(flesh).values() if inspect.isclass(thing) and issubclass(thing, flesh.Effect)}
    assert kinds - {flesh.Effect, flesh.OwnEffect} <= named


def test_bodies_and_files_of_another_mesh_are_refused(mesh, body, system, tmp_path):
    fine = mesh.refine()
    other = flesh.Body(fine, flesh.Material(young=1e5, poisson=0.4))
    with pytest.raises(flesh.ArgumentError, match="is made for a mesh"):
        flesh.Frames(tmp_path / "f", fine).set_fields(other, system, "bdf2", ["reaction"])
    with pytest.raises(flesh.ArgumentError, match="is made for a mesh"):
        flesh.Probes(tmp_path / "p.csv", other, system, "bdf2", [flesh.Probe("a", ["position"], nodes=[0])])
    surface = flesh.Surface.of_mesh(fine)
    skin = flesh.SkinFrames(tmp_path / "s", flesh.Skin(fine, surface), surface)
    with pytest.raises(flesh.ArgumentError, match="vertices"):
        flesh.SkinFrames(tmp_path / "t", flesh.Skin(fine, surface), flesh.Surface.of_mesh(mesh))
    integrator = flesh.Integrator(system)
    for observer in (flesh.Frames(tmp_path / "f", fine), skin):
        with pytest.raises(flesh.ArgumentError, match="is made for a mesh"):
            flesh.run(integrator, flesh.State.at_rest(mesh), 0.01, 0.01, [observer])


def handles(mesh, body, system, folder):
    surface = flesh.Surface.of_mesh(mesh)
    return [flesh.Scene({"body": {"mesh": str(folder / "m.mesh"), "material": {"energy": "S", "young": 1e5, "poisson": 0.4}},
                         "effects": [{"inertia": {}}], "time": {"step": 0.1, "end": 0.1}}),
            mesh, body, system, surface, flesh.Skin(mesh, surface), flesh.Material(young=1e5, poisson=0.4),
            flesh.Motion.fixed((0, 0, 0)), flesh.Amplitude([(0, 1)]), flesh.Obstacle.sphere((0, 0, 0), 1),
            flesh.Threads(1), flesh.Point(mesh.positions), flesh.Integrator(system), flesh.KinsolProblem(system),
            flesh.Parameter(lambda p: system, 1.0), flesh.Trajectory(flesh.Integrator(system)), flesh.Sensitivity(system, flesh.equilibrium(system, options=flesh.SolverOptions(newton_tolerance=1e-8))),
            flesh.IdaProblem(system), flesh.OdeProblem(system), flesh.History(folder / "h.csv", system),
            flesh.Probes(folder / "p.csv", body, system, "bdf2", [flesh.Probe("a", ["position"], nodes=[1])]),
            flesh.Frames(folder / "f", mesh), flesh.SkinFrames(folder / "s", flesh.Skin(mesh, surface), surface),
            *all_effects(mesh, body)]


def test_what_owns_something_of_the_library_is_never_copied(mesh, body, system, tmp_path):
    mesh.write(tmp_path / "m.mesh")
    owners = handles(mesh, body, system, tmp_path)
    kinds = {type(one) for one in owners}
    for kind in vars(flesh).values():  # no class is missing
        if inspect.isclass(kind) and issubclass(kind, _callbacks.Handle):
            assert kind in kinds or kind in (flesh.Effect, flesh.OwnEffect), kind
    for one in owners:
        for duplicate in (copy.copy, copy.deepcopy):
            if isinstance(one, _callbacks.Const):
                assert duplicate(one) is one
            else:
                with pytest.raises(flesh.ArgumentError, match=f"{type(one).__name__} .*neither copied nor pickled"):
                    duplicate(one)
        with pytest.raises(flesh.ArgumentError, match="neither copied nor pickled"):
            pickle.dumps(one)
    for name in ("mesh", "materials"):
        with pytest.raises(AttributeError, match="can only be read"):
            setattr(body, name, None)
    with pytest.raises(AttributeError):
        system.mesh = mesh.refine()
    del owners, one
    gc.collect()


def public_structs():
    return [kind for kind in vars(flesh).values() if inspect.isclass(kind) and issubclass(kind, _arrays.Struct)
            and kind._ctype]


@pytest.mark.parametrize("kind", public_structs(), ids=lambda kind: kind.__name__)
def test_copies_of_plain_data_are_others_of_the_same_values(kind):
    one = kind()
    for duplicate in (copy.copy, copy.deepcopy, lambda value: pickle.loads(pickle.dumps(value))):
        other = duplicate(one)
        assert type(other) is kind and other._struct != one._struct and repr(other) == repr(one)
    if issubclass(kind, _arrays.Options):
        name = next(name for name in kind.fields() if isinstance(getattr(one, name), float))
        before = getattr(one, name)
        setattr(other, name, before / 2 + 0.25)
        assert getattr(one, name) == before != getattr(other, name)


def test_a_copied_state_is_one_of_its_own(mesh, rng):
    state = flesh.State(mesh.positions, rng.normal(size=(mesh.node_count, 3)), 0.5, internal=[1, 2])
    for duplicate in (copy.copy, copy.deepcopy, lambda value: pickle.loads(pickle.dumps(value)), flesh.State.copy):
        other = duplicate(state)
        assert other.t == 0.5 and np.array_equal(other.v, state.v) and list(other.internal) == [1, 2]
        other.x[0, 0], other.t = 9, 3
        assert state.x[0, 0] != 9 and state.t == 0.5


def test_a_body_keeps_what_it_was_given(mesh, bent):
    materials = [flesh.Material(young=1e5, poisson=0.4), flesh.Material.from_psi(lambda I, J: (I + J, 1, 1, 0, 0, 0))]
    which, density = np.zeros(mesh.tet_count, np.intc), np.full(mesh.tet_count, 1000.0)
    body = flesh.Body(mesh, materials, density, tet_material=which)
    before = flesh.System(mesh, [flesh.Elasticity(body), flesh.Gravity(body, GRAVITY)]).residual(bent)
    which[:], density[:] = 10**8, np.nan
    body.materials.clear()
    del materials
    gc.collect()
    after = flesh.System(mesh, [flesh.Elasticity(body), flesh.Gravity(body, GRAVITY)]).residual(bent)
    assert np.array_equal(before, after) and not body.tet_material.any() and (body.density == 1000).all()


def test_points_and_states_keep_the_arrays_that_they_show(mesh, system, tmp_path):
    point = flesh.Point(mesh.positions * 1.1)
    before = system.residual(point)
    point.x = None
    gc.collect()
    assert np.array_equal(system.residual(point), before)
    kept = []

    def rebind(record):
        kept.append(record.x)
        state.x, state.v = np.zeros_like(state.x), np.zeros_like(state.v)
        gc.collect()
    state = flesh.State.at_rest(mesh)
    flesh.run(flesh.Integrator(system), state, 0.01, 0.03, [rebind])
    assert len(kept) == 4 and np.abs(kept[3] - kept[2]).max() > 0
    for many in (np.zeros((3, 3)), np.zeros((mesh.node_count, 3), np.float32), np.zeros((mesh.node_count, 6))[:, ::2]):
        state.x = many
        with pytest.raises(flesh.ArgumentError, match="state.x must be"):
            flesh.Integrator(system).step(state, 0.01)


CYCLES = """
import gc, flesh
for order in (1, -1):
    for _ in range(2):
        scene = flesh.Scene({
            "body": {"mesh": "bar.mesh", "density": 1000, "material": {"energy": "S", "young": 1e4, "poisson": 0.4}},
            "effects": [{"inertia": {}}, {"contact": {"between": "self", "thickness": 0.01}}],
            "time": {"step": 0.01, "end": 0.02}})
        integrator = scene.integrator()
        integrator.step(scene.start(), 0.01)
        cycle = [scene, integrator, flesh.Trajectory(integrator)][::order]
        cycle.append(cycle)
        for step in scene.steps():
            pass
        del scene, integrator, cycle, step
    gc.collect()
"""


def test_cycles_are_freed_in_the_order_of_the_library(mesh, tmp_path):
    mesh.write(tmp_path / "bar.mesh")
    path = os.path.dirname(os.path.dirname(flesh.__file__))
    # Freed memory is overwritten then, so that reading it ends the program.
    subprocess.run([sys.executable, "-c", CYCLES], cwd=tmp_path, check=True,
                   env=interpreter_environment(MALLOC_PERTURB_="85", PYTHONPATH=path))


def test_an_observer_is_not_closed_while_it_is_written(mesh, system, tmp_path):
    history = flesh.History(tmp_path / "h.csv", system)

    def close(_record):
        with pytest.raises(flesh.ArgumentError, match="a run writes this History"):
            history.close()
    flesh.run(flesh.Integrator(system), flesh.State.at_rest(mesh), 0.01, 0.01, [close, history])
    history.close()
    assert flesh.Table.read(tmp_path / "h.csv").rows == 2
    with pytest.raises(flesh.ArgumentError, match="the History is closed"):
        flesh.run(flesh.Integrator(system), flesh.State.at_rest(mesh), 0.01, 0.01, [history])


def test_what_is_asked_may_be_exchanged_while_it_is_asked(mesh, system):
    integrator, asked = flesh.Integrator(system), []

    def first():
        asked.append(1)
        integrator.stop = lambda: asked.append(2)
        gc.collect()
    integrator.stop = first
    integrator.step(flesh.State.at_rest(mesh), 0.01)
    assert asked[0] == 1 and set(asked[1:]) == {2}


def test_an_own_effect_keeps_the_sizes_that_it_was_made_with(mesh):
    pull = Pull(mesh)
    pull.report_names, pull.internal_count = ("a", "b", "c"), 99
    system = flesh.System(mesh, [pull])
    assert system.internal_count == 2
    assert list(system.update_internal(mesh.positions, internal=[1, 2])[0]) == [2, 3]


WRONG = [2**32 + 3, -2**31 - 1, np.uint64(2**63), 2**31]


@pytest.mark.parametrize("number", WRONG)
def test_integers_do_not_wrap(mesh, body, system, number, tmp_path):
    """Calls every function that takes integers, in an array or alone."""
    corner = [[0, 1, number]]
    for use in (lambda: flesh.Force(body, [number], (0, 0, 1)), lambda: flesh.Traction(body, corner, (0, 0, 1)),
                lambda: flesh.Pressure(body, corner, 1), lambda: flesh.Drag(body, corner, 1, (1, 0, 0)),
                lambda: flesh.Weld(body, corner, [[0, 1, 2]]), lambda: flesh.Weld(body, [[0, 1, 2]], corner),
                lambda: flesh.Joint(body, [number], [1], (0, 0, 0), 1), lambda: flesh.Joint(body, [1], [number], (0, 0, 0), 1),
                lambda: flesh.JointSpring(body, [number], [1], (0, 0, 0), (1, 0, 0), 1),
                lambda: flesh.Muscle(body, (1, 0, 0), flesh.Fibre(), tets=[number]),
                lambda: flesh.SurfaceContact(body, [[0, number]]), lambda: flesh.System(mesh).pin([number]),
                lambda: flesh.System(mesh).prescribe([number], flesh.Motion.fixed((0, 0, 0))),
                lambda: Pull(mesh, cells=[[0, number]]), lambda: flesh.Mesh(mesh.positions, [[0, 1, 2, number]]),
                lambda: flesh.Mesh(mesh.positions, mesh.tets[:1], [number]), lambda: flesh.Mesh.box((number, 1, 1), (1, 1, 1)),
                lambda: flesh.Surface(mesh.positions, [[0, 1, number]]), lambda: flesh.Obstacle.mesh(mesh.positions, corner),
                lambda: flesh.Body(mesh, [flesh.Material(young=1, poisson=0)], tet_material=np.full(mesh.tet_count, number)),
                lambda: flesh.Probes(tmp_path / "p", body, system, "bdf2", [flesh.Probe("a", ["position"], nodes=[number])]),
                lambda: flesh.Probes(tmp_path / "p", body, system, "bdf2",
                                     [flesh.Probe("a", ["position"], nodes=[0], holder=number)]),
                lambda: flesh.Frames(tmp_path / "f", mesh, every=int(number)), lambda: flesh.Threads(int(number)),
                lambda: flesh.SolverOptions(max_newton=int(number)), lambda: flesh.Threads(1).run(int(number), print)):
        with pytest.raises(flesh.ArgumentError):
            use()
    for use in (lambda: flesh.Force(body, [0.5], (0, 0, 1)), lambda: flesh.Force(body, np.ones(3, bool), (0, 0, 1)),
                lambda: flesh.Force(body, ["1"], (0, 0, 1)), lambda: flesh.Gravity(body, (0, 0, 1j)),
                lambda: flesh.Probes(tmp_path / "p", body, system, "bdf2", [flesh.Probe("a", ["position"], nodes=[0.5])])):
        with pytest.raises(flesh.ArgumentError):
            use()


def test_damaged_frames_are_file_errors(mesh, body, tmp_path):
    """Leaves out or replaces every attribute of every header, changes lengths, and inserts random bytes."""
    system = flesh.System(mesh, [flesh.Inertia(body), flesh.Elasticity(body)])
    with flesh.Frames(tmp_path / "f", mesh) as frames:
        frames.set_fields(body, system, "bdf2", ["stress"], ["nodes", "points"])
        flesh.run(flesh.Integrator(system), flesh.State.at_rest(mesh), 0.01, 0.01, [frames])
    whole = (tmp_path / "f" / "frame_000001.vtu").read_bytes()
    path, begin = tmp_path / "damaged.vtu", whole.index(b"<AppendedData")
    read = refused = 0

    def attempt(content):
        nonlocal read, refused
        path.write_bytes(content)
        try:
            frame = flesh.Frame.read(path)
        except flesh.FileError as error:
            assert "damaged.vtu: not a whole frame" in str(error)
            refused += 1
        else:  # the remaining data are complete
            assert frame.positions.shape[1:] == (3,) and frame.tets.shape[1] in (4, 10)
            assert all(len(one) == len(frame.positions) for one in frame.nodes.values())
            assert all(len(one) == len(frame.tets) for one in frame.cells.values())
            read += 1
    for word in (b"type", b"Name", b"offset", b"NumberOfComponents", b"byte_order"):
        at = 0
        while (at := whole.find(word + b'="', at, begin)) >= 0:
            end = whole.index(b'"', at + len(word) + 2) + 1
            for other in (b"", *(word + b'="' + value + b'"' for value in (b"", b"-8", b"0", b"7", b"x", b"1" * 30, b"UInt8"))):
                attempt(whole[:at] + other + whole[end:])
            at = end
    start = begin + len(b'<AppendedData encoding="raw">\n_')
    for size in (0, 1, 2**63, 2**64 - 1):
        attempt(whole[:start] + struct.pack("<Q", size) + whole[start + 8:])
    rng = np.random.default_rng(3)
    for _ in range(300):
        damaged = bytearray(whole)
        for at in rng.integers(0, begin if rng.random() < 0.7 else len(whole), 3):
            damaged[at] = rng.integers(256)
        attempt(bytes(damaged[:rng.integers(len(whole))] if rng.random() < 0.2 else damaged))
    assert refused > 200 and read > 20


def test_damaged_tables_and_results_are_file_errors(tmp_path):
    for name, content in (("history.csv", b"t,x\n\xff,1\n"), ("history.csv", b"t,x\n1\n"), ("history.csv", b""),
                          ("result.json", b"{"), ("result.json", b"[]"), ("result.json", b"\xff{}")):
        (tmp_path / "history.csv").write_bytes(b"t,x\n0,1\n")
        (tmp_path / "result.json").write_bytes(b"{}")
        assert flesh.results.RunResult(tmp_path).history.rows == 1
        (tmp_path / name).write_bytes(content)
        with pytest.raises(flesh.FileError, match=name):
            flesh.results.RunResult(tmp_path)
