# TEST part_of=test_python_runs
"""test_scenes.py: scenes from files, text and dicts; runs as loops and as iterators; what they write."""
import gc
import os

import numpy as np
import pytest

import flesh
from flesh import _location
from conftest import DATA

BAR = {
    "title": "quotes \" and \\ and é",
    "body": {"mesh": "bar_8x2x2.mesh", "density": 1000,
             "material": {"energy": "S", "young": 1e5, "poisson": np.float64(0.45)}},
    "effects": [{"inertia": {}}, {"gravity": {"acceleration": np.array([0, 0, -9.81])}},
                {"pin": {"box": [[-1, -1, -1], (1e-9, 2, float("inf"))]}}],
    "time": {"method": "backward-euler", "step": "1/60", "end": 0.1},
}
TEXT = """
body:
  mesh: bar_8x2x2.mesh
  material: {energy: S, young: 1e5, poisson: 0.45}
effects: [inertia: {}, gravity: {acceleration: [0, 0, -9.81]}, pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}]
time: {step: 1/60, end: 0.1}
"""


@pytest.fixture
def folder(tmp_path):
    flesh.Mesh.box((8, 2, 2), (2, 1, 1)).write(tmp_path / "bar_8x2x2.mesh")
    return tmp_path


def test_faces_that_are_left_are_told(tmp_path):
    mesh = flesh.Mesh.box((2, 2, 2), (2, 2, 2), (-1, -1, -1))
    x = mesh.positions.copy()
    x /= np.maximum(np.linalg.norm(x, axis=1), 1e-9)[:, None]
    x[0] *= 1.2
    flesh.Mesh(x, mesh.tets).write(tmp_path / "ball.mesh")
    scene = flesh.Scene({"body": {"mesh": "ball.mesh", "element": "tet10", "curved": [{"sphere": {"radius": 1}}]},
                         "effects": [{"gravity": {}}]}, folder=tmp_path)
    assert scene.warning.startswith("body.curved[0]: 6 faces")


def test_a_dict_text_and_a_file_are_the_same_scene(folder):
    (folder / "bar.yaml").write_text(TEXT)
    ends = []
    for scene in (flesh.Scene(BAR, folder=folder), flesh.Scene.from_text(TEXT, folder=folder),
                  flesh.Scene(folder / "bar.yaml")):
        assert scene.time.method == "backward-euler" and scene.time.step == 1 / 60 and scene.time.end == 0.1
        assert [effect.name for effect in scene.system.effects] == ["inertia", "gravity", "elasticity"]
        assert scene.materials[0].young == 1e5 and scene.body.density.tolist() == [1000] * 192
        assert scene.warning is None
        assert scene.output.frame_interval == 1 and scene.output.skin_surface is None
        ends.append(scene.run().x)
    assert np.array_equal(ends[0], ends[1]) and np.array_equal(ends[0], ends[2])


@pytest.mark.skipif(not _location.PROGRAM, reason="the program is not built")
def test_it_ends_as_the_programs_run_does(folder):
    scene = flesh.Scene(BAR, {"time.method": "bdf2", "output.frame_interval": 3,
                              "output.probes": [
                                  {"name": "tip", "point": [1, 0.1, 0.1], "quantities": ["position", "J"]},
                                  {"name": "two", "nodes": [0, 1], "quantities": ["reaction"]}],
                              "output.reactions": True}, folder)
    probes = scene.probes
    assert [(probe.name, probe.holder) for probe in probes] == [("tip", 0), ("two", 0), ("pin", 1)]
    assert probes[0].quantities == ("position", "J") and probes[0].point == (1, 0.1, 0.1) and probes[1].nodes == (0, 1)
    scene.write(folder / "resolved.yaml")
    with flesh.History(folder / "history.csv", scene.system) as history, \
            flesh.Frames(folder / "frames", scene.mesh, 3) as frames, \
            flesh.Probes(folder / "probes.csv", scene.body, scene.system, scene.time.method, probes) as written:
        end = scene.run([history, frames, written])
    result = flesh.run_scene(folder / "resolved.yaml", folder / "out")
    assert result.result["status"] == "complete" and result.scene.time.method == "bdf2"
    assert np.array_equal(result.state.x, end.x) and np.array_equal(result.state.v, end.v)
    assert (folder / "probes.csv").read_text() == (folder / "out" / "probes.csv").read_text()
    assert (folder / "history.csv").read_text() == (folder / "out" / "history.csv").read_text()
    assert result.probes.rows == 7 and result.probes["pin.reaction_z [N]"][-1] > 1
    assert np.array_equal(result.probes["pin.reaction_z"], result.probes["pin.reaction_z [N]"])
    names = sorted(os.listdir(folder / "frames"))
    assert names == sorted(os.listdir(folder / "out" / "frames")) and len(result.frames) == 3
    assert (folder / "frames" / names[0]).read_bytes() == (folder / "out" / "frames" / names[0]).read_bytes()
    assert result.history.rows == 7 and result.history["t"][-1] == 0.1
    assert flesh.program("--version").stdout.split()[1] == flesh.__version__
    with pytest.raises(flesh.ProgramError, match="nowhere.yaml") as error:
        flesh.program("run", folder / "nowhere.yaml")
    assert error.value.status == 3


@pytest.mark.skipif(not _location.PROGRAM, reason="the program is not built")
def test_the_last_state_has_all_that_a_run_goes_on_from(folder):
    (folder / "bar.yaml").write_text(TEXT)
    overrides = {"body.material.poisson": 0.5, "body.element": "tet10-mean", "time.end": 0.05}
    result = flesh.run_scene(folder / "bar.yaml", folder / "out", overrides)
    written, count = result.state.multipliers, result.scene.system.multiplier_count
    assert count > 0 and written.shape == (count,) and np.abs(written).max() > 100
    assert result.state.internal is None
    with pytest.raises(IndexError, match="frame 9 is asked for; the run in .* wrote 4"):
        result.frame(9)
    for scene in (result.scene, BAR):
        with pytest.raises(flesh.ArgumentError, match="the program reads scenes from files"):
            flesh.run_scene(scene, folder / "more")
    assert flesh.Scene(folder / "bar.yaml", "time.end=0.05").time.end == 0.05


@pytest.mark.skipif(not _location.PROGRAM, reason="the program is not built")
@pytest.mark.parametrize("element, points", [("tet4", 1), ("tet10", 4)])
def test_frames_have_the_fields_that_are_asked_for(folder, element, points):
    fields = ["J", "stretch", "stress", "von_mises", "reaction"]
    scene = flesh.Scene(BAR, {"body.element": element, "time.end": 0.05, "output.fields": fields,
                              "output.fields_at": ["nodes", "tets", "points"]}, folder)
    assert scene.output.fields == tuple(fields) and scene.output.fields_at == ("nodes", "tets", "points")
    with flesh.Frames(folder / "frames", scene.mesh, 3) as frames:
        frames.set_fields(scene.body, scene.system, scene.time.method, fields, scene.output.fields_at)
        end = scene.run([frames])
    scene.write(folder / "resolved.yaml")
    result = flesh.run_scene(folder / "resolved.yaml", folder / "out")
    frame = result.frame()
    with pytest.raises(TypeError, match="Frame.read"):
        flesh.Frame()
    assert result.probes is None and "stress" in repr(frame)
    assert (folder / "frames" / "frame_000003.vtu").read_bytes() == (folder / "out/frames/frame_000003.vtu").read_bytes()
    assert np.array_equal(frame.positions, end.x) and np.array_equal(frame.nodes["velocity"], end.v)
    assert np.array_equal(frame.tets[:, :4], scene.mesh.tets) and len(frame.cells["region"]) == scene.mesh.tet_count
    assert {"stress": "Pa", "von_mises_at_points": "Pa", "reaction": "N", "stretch": "1", "velocity": "m/s"}.items() \
        <= frame.units.items()
    stress, at_points = frame.cells["stress"], frame.cells["stress_at_points"]
    J, J_at_points = frame.cells["J_mean"], frame.cells["J_at_points"]
    assert at_points.shape == (len(stress), points, 6) and frame.nodes["stress"].shape == (len(end.x), 6)
    assert np.allclose(J, J_at_points.mean(axis=1), rtol=1e-13)
    assert np.allclose(stress * J[:, None], (at_points * J_at_points[:, :, None]).mean(axis=1), rtol=1e-9, atol=1e-8)
    assert np.allclose(frame.cells["stretch_at_points"].prod(axis=2), J_at_points, rtol=1e-13)
    xx, yy, zz, xy, yz, xz = frame.nodes["stress"].T
    mises = np.sqrt(((xx - yy)**2 + (yy - zz)**2 + (zz - xx)**2) / 2 + 3 * (xy**2 + yz**2 + xz**2))
    assert np.allclose(frame.nodes["von_mises"], mises, rtol=1e-12) and mises.max() > 100
    held = frame.nodes["reaction"].any(axis=1)
    assert held.any() and np.all(scene.mesh.positions[held, 0] < 1e-9)
    with pytest.raises(flesh.ArgumentError, match="fields has contact_force, but nothing touches"):
        flesh.Scene(BAR, {"output.fields": ["contact_force"]}, folder)
    cut = folder / "cut.vtu"
    cut.write_bytes((folder / "frames" / "frame_000003.vtu").read_bytes()[:6000])
    for path, words in ((cut, "not a whole frame"), (folder / "none.vtu", "No such file"), (folder / "resolved.yaml", "no raw")):
        with pytest.raises(flesh.FileError, match=words):
            flesh.Frame.read(path)


def test_overrides_and_their_errors(folder):
    assert flesh.Scene(BAR, {"time.step": 0.05}, folder).time.step == 0.05
    assert flesh.Scene(BAR, ["effects.inertia=null"], folder).time.method == "static"
    assert flesh.Scene(BAR, {"effects.inertia": None}, folder).time.method == "static"
    for overrides, words in (({"time.step": -1}, "time.step"), ({"time.stp": 1}, "did you mean step")):
        with pytest.raises(flesh.ArgumentError, match=words):
            flesh.Scene(BAR, overrides, folder)
    with pytest.raises(flesh.ArgumentError, match="^a scene has <object .*>; it must be a dict, a list, a text"):
        flesh.Scene({"body": object()})
    with pytest.raises(flesh.ArgumentError, match="note:2:9: body.densty is unknown; did you mean density"):
        flesh.Scene.from_text("\nbody: {{densty: 3}}".replace("{{", "{ ").replace("}}", "}"), name="note")
    with pytest.raises(flesh.FileError, match="nowhere.yaml"):
        flesh.Scene(folder / "nowhere.yaml")


def test_the_iterator_is_the_loop(folder):
    scene = flesh.Scene(BAR, folder=folder)
    observed = []
    end = scene.run([observed.append])
    records = list(scene.steps())
    assert [record.step for record in records] == list(range(7)) and records[-1].last and not records[0].h
    assert all(np.array_equal(one.x, two.x) and one.t == two.t for one, two in zip(records, observed))
    assert np.array_equal(records[-1].x, end.x) and records[3].stats.newton == observed[3].stats.newton > 0
    assert records[-1].tet_J_min.shape == (192,) and records[-1].J_min == records[-1].tet_J_min.min()
    assert np.array_equal(records[-1].tet_J_mean, records[-1].tet_J_min) and records[-1].J_bound == records[-1].J_min
    assert records[-1].volume == pytest.approx(scene.mesh.volume(end.x), rel=1e-14)
    assert np.allclose(records[-1].energies, scene.system.energies(end.x, end.v), rtol=1e-12)


def test_leaving_the_loop_ends_the_run(folder):
    import threading
    scene = flesh.Scene(BAR, folder=folder)
    state, integrator = scene.start(), scene.integrator()
    for record in flesh.steps(integrator, state, 1 / 60, 1e6):
        if record.step == 2:
            break
    gc.collect()
    assert state.t == pytest.approx(2 / 60) and not [one for one in threading.enumerate() if "flesh" in one.name]
    integrator.step(state, 1 / 60)  # it is complete, and independent again
    with pytest.raises(RuntimeError, match="mine"):
        for record in flesh.steps(integrator, state, 1 / 60, 1):
            raise RuntimeError("mine")

    def fail(record):
        if record.step == 1:
            raise KeyError("mine")
    with pytest.raises(KeyError, match="mine"):
        list(flesh.steps(integrator, state, 1 / 60, 1, [fail]))
    with pytest.raises(KeyError, match="mine"):
        flesh.run(integrator, state, 1 / 60, 1, [fail])
    with pytest.raises(flesh.StoppedError):
        flesh.run(integrator, state, 1 / 60, 1, stop=lambda: state.t > 0.2)
    assert 0.2 < state.t < 0.25
    with pytest.raises(flesh.ArgumentError):
        flesh.run(integrator, state, -1, 1)


def test_parts_of_a_scene_keep_it_alive(folder):
    expected = flesh.Mesh.read(folder / "bar_8x2x2.mesh").positions.copy()
    # With separate scenes, because each part alone must keep its scene alive.
    positions = flesh.Scene(BAR, folder=folder).mesh.positions
    mesh = flesh.Scene(BAR, folder=folder).mesh
    system = flesh.Scene(BAR, folder=folder).system
    effect = flesh.Scene(BAR, folder=folder).system.effects[1]
    more = flesh.System(mesh, [flesh.Elasticity(flesh.Scene(BAR, folder=folder).body)])
    gc.collect()
    for _ in range(5):
        flesh.Scene(BAR, folder=folder).run()
    assert np.array_equal(positions, expected) and np.array_equal(mesh.positions, expected)
    assert system.residual(expected).sum() == pytest.approx(2000 * 9.81) and effect.name == "gravity"
    assert np.abs(more.residual(expected)).max() < 1e-9 and more.residual(1.1 * expected).any()


def test_skin_frames(folder):
    mesh = flesh.Mesh.box((8, 2, 2), (2, 1, 1))
    surface = flesh.Surface.of_mesh(mesh)
    surface.write(folder / "skin.obj")
    scene = flesh.Scene(BAR, folder=folder)
    frames = flesh.SkinFrames(folder / "skin", flesh.Skin(mesh, surface), surface, ["obj", "pc2"], every=3)
    scene.run([frames])
    frames.close()
    names = sorted(os.listdir(folder / "skin"))
    assert names == ["skin.pc2", *(f"skin_{k:06}.obj" for k in (0, 3, 6))]


def test_schemas():
    assert "body.mesh" in flesh.schema("paths").split() and "| key" in flesh.schema().lower()
    import json
    assert json.loads(flesh.schema("json"))["properties"]["body"]
    with pytest.raises(flesh.ArgumentError, match="markdown"):
        flesh.schema("pdf")


def test_every_scene_of_the_gallery_is_read():
    names = sorted(name for name in os.listdir(os.path.join(DATA, "scenes")) if name.endswith(".yaml"))
    assert names
    for name in names[:4]:
        scene = flesh.Scene(os.path.join(DATA, "scenes", name))
        assert scene.system.unknowns == 3 * scene.mesh.node_count == scene.start().x.size
