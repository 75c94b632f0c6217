# TEST part_of=test_python
"""test_geometry.py: meshes, surfaces, skins, motions, obstacles; arrays keep their owners alive."""
import gc

import numpy as np
import pytest

import flesh

CUBE = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)


def test_a_mesh_from_arrays_is_the_box(mesh):
    again = flesh.Mesh(mesh.positions, mesh.tets, regions=np.arange(mesh.tet_count))
    assert again.node_count == 45 and again.tet_count == 96 == again.info.regions
    assert np.array_equal(again.tets, mesh.tets) and np.array_equal(again.positions, mesh.positions)
    assert again.volume(again.positions) == pytest.approx(2, rel=1e-14) == again.info.volume
    assert again.tet_volumes.sum() == pytest.approx(2, rel=1e-14)
    assert list(again.regions) == list(range(96)) and again.node_used.all() and not again.tet_curved.any()
    assert again.info.high.tolist() == [2, 1, 1] and again.info.as_dict()["order"] == 1


def test_order_two_from_arrays_and_back(mesh):
    raised = mesh.raise_order()
    again = flesh.Mesh(raised.positions, raised.tet_nodes)
    assert again.order == 2 and again.tet_nodes.shape == (96, 10)
    assert np.array_equal(again.tet_edges, raised.tet_edges) and mesh.tet_edges is None
    middle = again.positions[again.tets[:, [0, 1, 0, 0, 1, 2]]] + again.positions[again.tets[:, [1, 2, 2, 3, 3, 3]]]
    assert np.allclose(again.positions[again.tet_edges], middle / 2, atol=1e-15)
    assert np.array_equal(raised.lower_order().tets, mesh.tets)
    assert mesh.refine().tet_count == 8 * mesh.tet_count
    with pytest.raises(flesh.ArgumentError, match="order 1"):
        raised.raise_order()


def test_marked_tets_are_halved_and_fields_go_along(mesh):
    raised = mesh.raise_order()
    halvings = np.zeros(raised.tet_count, int)
    halvings[5] = 3
    finer, parents = raised.refine_marked(halvings)
    assert (parents.tet == 5).sum() >= 4 and finer.info.volume == pytest.approx(2, rel=1e-14)
    assert len(parents.node_tet) == finer.node_count == len(parents.place) > raised.node_count

    def field(x):
        return np.c_[x[:, 0] * x[:, 1] - x[:, 2] ** 2, x[:, 2]]
    assert np.allclose(raised.transfer(parents, field(raised.positions)), field(finer.positions), atol=1e-14)
    assert raised.transfer(parents, raised.positions[:, 0]).shape == (finer.node_count,)
    with pytest.raises(flesh.ArgumentError, match="halvings must be from 0 to 255"):
        raised.refine_marked(-halvings)
    with pytest.raises(flesh.ArgumentError, match="are not in this mesh"):
        finer.transfer(parents._replace(node_tet=parents.node_tet[:-1], place=parents.place[:-1]), finer.positions)


@pytest.mark.parametrize("suffix", ["msh", "mesh", "node"])
def test_files_give_the_mesh_back(mesh, tmp_path, suffix):
    mesh.write(tmp_path / f"bar.{suffix}")
    again = flesh.Mesh.read(tmp_path / f"bar.{suffix}")
    assert np.array_equal(again.positions, mesh.positions) and np.array_equal(again.tets, mesh.tets)


def test_named_sets_of_a_file(tmp_path):
    deck = "".join(["*NODE\n", *(f"{k + 1},{x},{y},{z}\n" for k, (x, y, z) in enumerate(np.eye(4)[:, 1:])),
                    "*ELEMENT, TYPE=C3D4, ELSET=all\n7,1,2,3,4\n*SURFACE, NAME=base\nall, S1\n"])
    (tmp_path / "tet.inp").write_text(deck)
    flesh.Mesh.read(tmp_path / "tet.inp").write(tmp_path / "tet.msh")
    for mesh in (flesh.Mesh.read(tmp_path / name) for name in ("tet.inp", "tet.msh")):
        assert list(mesh.sets) == ["all", "base"] and not mesh.sets["all"].nodes.size
        assert mesh.sets["all"].tets.tolist() == [0] and mesh.sets["base"].nodes.tolist() == [0, 1, 2]
        assert not flesh.Mesh.box((1, 1, 1), (1, 1, 1)).sets


def test_measures_of_a_stretched_body(mesh):
    x = mesh.positions * (1.5, 1, 1)
    found = mesh.jacobians(x)
    assert np.allclose(found.J, 1.5, rtol=1e-14) and found.not_positive == 0
    assert np.array_equal(mesh.jacobian_bounds(x).J, found.J) and np.array_equal(mesh.mean_jacobians(x), found.J)
    assert mesh.jacobians(-mesh.positions).not_positive == mesh.tet_count
    assert mesh.lumped_mass(1000).sum() == pytest.approx(2000)
    ones = np.ones_like(x)
    assert mesh.consistent_mass_times(1000, ones).sum() == pytest.approx(6000)


def test_bad_input_says_what_would_be_valid(mesh, tmp_path):
    with pytest.raises(flesh.ArgumentError, match=r"positions has shape \(2, 2\); it must be \(any, 3\)"):
        flesh.Mesh(np.zeros((2, 2)), [[0, 1, 2, 3]])
    with pytest.raises(flesh.ArgumentError, match="whole numbers"):
        flesh.Mesh(CUBE, np.array([[0, 1, 2, 4.5]]))
    with pytest.raises(flesh.ArgumentError, match=r"tets has shape \(1, 5\)"):
        flesh.Mesh(CUBE, [[0, 1, 2, 3, 4]])
    with pytest.raises(flesh.ArgumentError, match="flat") as error:
        flesh.Mesh(CUBE, [[0, 1, 2, 3]])
    assert isinstance(error.value, ValueError) and not isinstance(error.value, OSError)
    with pytest.raises(flesh.FileError, match="nowhere.mesh: cannot be opened") as error:
        flesh.Mesh.read(tmp_path / "nowhere.mesh")
    assert error.value.status == -3 and error.value.name == "FLESH_ERR_FILE" and isinstance(error.value, OSError)
    with pytest.raises(ValueError, match="zero byte"):
        flesh.Mesh.read(str(tmp_path / "cube.mesh") + "\0.mesh")
    with pytest.raises(flesh.ArgumentError, match="masked"):
        mesh.volume(np.ma.array(mesh.positions, mask=mesh.positions > 0))
    with pytest.raises(flesh.ArgumentError, match=r"x has shape \(3, 3\); it must be \(45, 3\)"):
        mesh.volume(np.zeros((3, 3)))
    with pytest.raises(ValueError):
        flesh.Mesh.box((0, 1, 1), (1, 1, 1))


def test_a_view_cannot_be_written_to_and_outlives_its_mesh():
    def positions():
        mesh = flesh.Mesh.box((8, 8, 8), (1, 1, 1))
        return mesh.positions, mesh.positions.copy(), mesh.info.high
    view, copy, high = positions()
    gc.collect()
    for _ in range(20):  # freed memory would be reused
        flesh.Mesh.box((8, 8, 8), (5, 5, 5))
    assert np.array_equal(view, copy) and high.tolist() == [1, 1, 1]
    with pytest.raises(ValueError):
        view[0] = 1
    assert not view[:3].flags.writeable and view[:3].base is not None


def test_surfaces_and_skins_follow_the_body(mesh, tmp_path):
    surface = flesh.Surface.of_mesh(mesh)
    assert surface.face_count == len(mesh.surface) == len(mesh.surface_tets) == 80
    quads = flesh.Surface(CUBE, [[0, 2, 3, 1], [4, 5, 7, 6]])
    assert quads.triangles.shape == (4, 3) and list(quads.starts) == [0, 4, 8] and len(quads.corners) == 8
    quads.write(tmp_path / "cube.ply")
    assert flesh.Surface.read(tmp_path / "cube.ply").face_count == 2
    fine = flesh.Surface.of_mesh(mesh.refine())
    skin = flesh.Skin(mesh, fine)
    assert skin.info.outside == 0 and np.allclose(skin.weights.sum(axis=1), 1)
    affine = mesh.positions @ np.diag([1.2, 0.9, 1.1]) + 2
    assert np.allclose(skin.apply(affine), fine.positions @ np.diag([1.2, 0.9, 1.1]) + 2, atol=1e-14)
    assert skin.apply(mesh.positions[:, 0]).shape == (fine.vertex_count,)
    skin.write(tmp_path / "skin.txt")
    assert np.array_equal(flesh.Skin.read(tmp_path / "skin.txt", mesh, fine).weights, skin.weights)


def test_obstacles_move_and_are_taken_once(body):
    ball = flesh.Obstacle.sphere((0, 0, -1), 0.5).move(flesh.Motion([(0, (0, 0, 0)), (1, (0, 0, 2), (0, 0, 1))]))
    at_rest, moved = ball.surface(0), ball.surface(1)
    assert np.allclose(moved.positions.mean(axis=0) - at_rest.positions.mean(axis=0), (0, 0, 2), atol=1e-12)
    assert at_rest.corners.max() < len(at_rest.positions)
    contact = flesh.Contact(body, ball, friction=0.3)
    assert np.allclose(ball.surface(1).positions, moved.positions) and contact.role == "contact"
    with pytest.raises(flesh.ArgumentError, match="taken this obstacle already"):
        flesh.Contact(body, ball)
    with pytest.raises(flesh.ArgumentError, match="before that"):
        ball.move(flesh.Motion.fixed((0, 0, 0)))
    with pytest.raises(flesh.ArgumentError, match="radius"):
        flesh.Obstacle.sphere((0, 0, 0), -1)
    assert flesh.Obstacle.mesh(CUBE, [[0, 1, 2]]).surface().corners.shape == (1, 3)
    assert len(flesh.Obstacle.plane((0, 0, 0), (0, 0, 1)).surface(0, (1, 1, 5), 2).positions) == 4
    assert len(flesh.Obstacle.capsule((0, 0, 0), (1, 0, 0), 0.1).surface().corners) > 10
