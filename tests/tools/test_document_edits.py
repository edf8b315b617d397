"""Edits of meshes, grooms, maps and coats."""

import inspect

import cv2
import numpy as np
import pytest

import tools.document_edits as edits
from core.document import Document
from core.errors import UserError
from core.formats.mesh_file import read_mesh, write_mesh
from core.formats.project import read_project, write_project
from core.groom.groom import Map
from core.groom.length import lengths
from core.mesh.mesh import Mesh
from core.mesh.surface import root_positions
from core.record import freeze
from core.value import constant, formula
from tests.core.groom.small_grooms import ball
from tests.documents import feathered, grid_mesh, small_document
from tests.tools.scenes import EVALUATOR, document, rig, session


def test_every_edit_is_a_named_step_that_undo_takes_back():
    s = session()
    before = s.document
    s.edit("Rename", edits.rename_mesh, 1, "sphere")
    s.edit("Lock", edits.set_mesh_locked, 1, True)
    s.edit("Nothing", edits.set_mesh_locked, 1, True)
    assert s.history.names == ("New", "Rename", "Lock")
    s.undo()
    s.undo()
    assert s.document is before


def test_meshes_come_go_and_move(tmp_path):
    mesh = ball().skin.mesh
    write_mesh(tmp_path / "ball.ply", mesh)
    start = document()
    two = edits.import_mesh(start, tmp_path / "ball.ply", unit="m", up="y")
    assert [m.name for m in two.meshes] == ["ball", "ball 2"]
    assert two.meshes[1].id == 2
    np.testing.assert_allclose(two.meshes[1].mesh.points, mesh.points)
    assert [m.id for m in edits.move_mesh(two, 2, 0).meshes] == [2, 1]
    assert edits.move_mesh(two, 2, 7) is not None
    assert [m.id for m in edits.move_mesh(two, 2, 7).meshes] == [1, 2]
    gone = edits.remove_mesh(two, 1)
    assert [m.id for m in gone.meshes] == [2]
    assert gone.grooms == ()
    assert edits.rename_mesh(two, 2, "  a horn\n").meshes[1].name == "a horn"
    assert edits.set_mesh_hidden(two, 2, True).meshes[1].hidden
    assert edits.set_mesh_hidden(two, 2, False) is two
    assert edits.set_groom_hidden(two, 1, True).grooms[0].hidden
    assert edits.set_groom_hidden(two, 1, False) is two
    assert edits.set_groom_locked(two, 1, True).grooms[0].locked
    assert edits.set_groom_locked(two, 1, False) is two
    with pytest.raises(UserError, match="letter"):
        edits.rename_mesh(two, 2, " \t")
    with pytest.raises(UserError, match="no mesh 9"):
        edits.remove_mesh(two, 9)


def test_grooms_come_go_and_move():
    start = document()
    two = edits.add_styled_groom(start, 1, "short", guides=40, hairs=100, evaluator=EVALUATOR)
    assert [(g.id, g.name, g.mesh_id) for g in two.grooms] == [(1, "coat", 1), (2, "short", 1)]
    assert len(two.grooms[1].guides) == 40
    assert two.grooms[1].coat.count == 100
    three = edits.add_empty_groom(two, 1, "short", points=9)
    assert three.grooms[2].name == "short 2"
    assert three.grooms[2].guides.points.shape == (0, 9, 3)
    assert [g.id for g in edits.move_groom(three, 3, 0).grooms] == [3, 1, 2]
    assert [g.id for g in edits.remove_groom(three, 1).grooms] == [2, 3]
    assert edits.rename_groom(three, 1, "coat") is not None
    assert edits.rename_groom(three, 3, "mane").grooms[2].name == "mane"
    for wrong in (lambda: edits.remove_groom(three, 8), lambda: edits.add_styled_groom(start, 8, "short"),
                  lambda: edits.add_styled_groom(start, 1, "no such style")):
        with pytest.raises(UserError):
            wrong()


def test_a_coat_of_feathers_goes_with_its_keys():
    start = feathered(document())
    (coat,) = start.feathers
    assert coat.keys_id in {g.id for g in start.grooms}
    gone = edits.remove_feathers_with_keys(start, coat.id)
    assert gone.feathers == ()
    assert [g.id for g in gone.grooms] == [g.id for g in start.grooms if g.id != coat.keys_id]
    with pytest.raises(UserError, match="feathers"):
        edits.remove_feathers_with_keys(gone, coat.id)


def test_a_coat_takes_what_is_in_range_and_refuses_the_rest_in_words():
    start = document()
    coat = edits.set_coat(start, 1, count=5, frizz=constant(0.25), density_map="half").grooms[0].coat
    assert (coat.count, coat.density_map) == (5, "half")
    for wrong in ({"count": -1}, {"density_map": "none"}, {"frizz": constant(7.0)}, {"nothing": 1}):
        with pytest.raises(UserError):
            edits.set_coat(start, 1, **wrong)


def test_the_document_has_a_unit_a_rate_and_a_range():
    changed = edits.set_document(document(), unit="cm", fps=25.0, last_frame=1200)
    assert (changed.unit, changed.fps, changed.last_frame) == ("cm", 25.0, 1200)
    for wrong in ({"unit": "ell"}, {"fps": 0.0}, {"last_frame": 0}, {"meshes": ()}):
        with pytest.raises(UserError):
            edits.set_document(document(), **wrong)


def test_maps_come_from_pictures_and_paint_and_go(tmp_path):
    start = document()
    image = np.zeros((4, 6, 3), np.uint8)
    image[:, 3:] = (30, 60, 120)
    cv2.imwrite(str(tmp_path / "thick fur.png"), image)
    read = edits.add_map_from_image(start, 1, tmp_path / "thick fur.png")
    item = read.grooms[0].map("thick fur")
    np.testing.assert_allclose(item.image[:, 3:], 70 / 255, atol=1e-6)
    assert not item.image[:, :3].any()
    flat = edits.add_flat_map(read, 1, "thick fur", 0.5)
    assert [m.name for m in flat.grooms[0].maps] == ["half", "thick fur", "thick fur 2"]
    assert (flat.grooms[0].maps[2].values == 0.5).all()
    vertices = len(start.meshes[0].mesh.points)
    painted = edits.set_map(flat, 1, Map(name="half", values=np.full(vertices, 0.25, np.float32)))
    assert [m.name for m in painted.grooms[0].maps] == ["half", "thick fur", "thick fur 2"]
    assert (painted.grooms[0].map("half").values == 0.25).all()
    with pytest.raises(UserError, match="vertices"):
        edits.set_map(flat, 1, Map(name="half", values=np.ones(3, np.float32)))
    used = edits.set_coat(painted, 1, density_map="half", clump=formula("half * 0.5"))
    with pytest.raises(UserError, match="clump"):
        edits.remove_map(used, 1, "half")
    freed = edits.remove_map(edits.set_coat(used, 1, clump=constant(0.5)), 1, "half")
    assert freed.grooms[0].map("half") is None
    assert freed.grooms[0].coat.density_map is None
    with pytest.raises(UserError, match="no map"):
        edits.remove_map(freed, 1, "half")


def turned_by(mesh: Mesh, matrix) -> Mesh:
    return mesh.replace(points=freeze((mesh.points @ np.asarray(matrix, np.float32).T).astype(np.float32)))


def test_hair_follows_a_mesh_that_moved():
    start = document()
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    found = edits.replaced_mesh(start, 1, turned_by(start.meshes[0].mesh, turn))
    before, after = start.grooms[0].guides, found.document.grooms[0].guides
    np.testing.assert_allclose(after.points, before.points @ turn.T, atol=2e-5)
    assert np.array_equal(after.ids, before.ids)
    assert found.doubtful[1].size == 0
    assert found.document.meshes[0].rig is rig(), "the vertices are the same, so is what moves them"
    assert found.document.grooms[0].maps[0].values is start.grooms[0].maps[0].values


def test_a_mesh_is_read_again_in_the_unit_that_was_given_for_it(tmp_path):
    path = tmp_path / "ball.obj"
    write_mesh(path, ball().skin.mesh)
    start = edits.import_mesh(Document(), path, unit="cm", up="z")
    again = edits.reload_mesh(start, start.meshes[0].id)
    np.testing.assert_array_equal(again.meshes[0].mesh.points, start.meshes[0].mesh.points)
    plain = edits.import_mesh(Document(), path)
    assert np.ptp(plain.meshes[0].mesh.points) == pytest.approx(100 * np.ptp(again.meshes[0].mesh.points))
    write_project(tmp_path / "kept.filo", again)
    kept = read_project(tmp_path / "kept.filo").document.meshes[0]
    assert (kept.source, kept.source_unit, kept.source_up) == (str(path), 0.01, "z")
    inches = edits.reload_mesh(again, again.meshes[0].id, unit="in")
    assert (inches.meshes[0].source_unit, inches.meshes[0].source_up) == (0.0254, "z")


def test_a_mesh_as_read_in_another_unit_takes_the_place_of_itself(tmp_path):
    path = tmp_path / "ball.obj"
    write_mesh(path, ball().skin.mesh)
    start = edits.add_empty_groom(edits.import_mesh(Document(), path), 1)
    start = edits.add_empty_groom(start, 1, "chosen")
    start = edits.set_coat(start, 2, reach=0.03)
    after = edits.with_mesh_as_read(start, 1, read_mesh(path, unit="cm", up="z"))
    points = start.meshes[0].mesh.points
    np.testing.assert_allclose(after.meshes[0].mesh.points, 0.01 * points[:, [0, 2, 1]] * [1, 1, -1], atol=1e-6)
    assert (after.meshes[0].source_unit, after.meshes[0].source_up) == (0.01, "z")
    assert after.grooms[0].coat.reach == pytest.approx(0.01 * start.grooms[0].coat.reach, rel=0.05)
    assert after.grooms[1].coat.reach == 0.03, "an artist's own"


def test_hair_and_maps_are_kept_on_a_finer_mesh(tmp_path):
    start = document()
    fine = ball(subdivisions=4).skin.mesh
    write_mesh(tmp_path / "fine.obj", fine)
    after = edits.reload_mesh(start, 1, tmp_path / "fine.obj", unit="m", up="y")
    mesh, groom = after.meshes[0].mesh, after.grooms[0]
    assert edits.reload_mesh(after, 1).meshes[0].source == str(tmp_path / "fine.obj"), "it knows its file"
    with pytest.raises(UserError, match="name the file"):
        edits.reload_mesh(edits.set_mesh_source(after, 1, ""), 1)
    assert len(mesh.points) == len(fine.points)
    assert after.meshes[0].rig is None
    assert np.array_equal(groom.guides.points[:, 0], root_positions(mesh, groom.guides.roots))
    np.testing.assert_allclose(groom.guides.points, start.grooms[0].guides.points, atol=0.05)
    np.testing.assert_allclose(lengths(groom.guides.points), lengths(start.grooms[0].guides.points), rtol=1e-4)
    values = groom.map("half").values
    clear = np.abs(mesh.points[:, 1]) > 0.2
    np.testing.assert_allclose(values[clear], mesh.points[clear, 1] > 0, atol=1e-6)


def test_hair_whose_place_was_only_guessed_is_named():
    start = small_document(30)
    upside = grid_mesh(4)
    down = upside.replace(corners=freeze(upside.corners.reshape(-1, 4)[:, ::-1].ravel().copy()), uvs=None)
    found = edits.replaced_mesh(start, 7, down)
    assert len(found.doubtful[1]) == 30
    with pytest.raises(UserError):
        edits.replace_mesh(start, 7, Mesh(
            points=np.zeros((0, 3), np.float32), counts=np.zeros(0, np.int32), corners=np.zeros(0, np.int32),
            parts=np.zeros(0, np.int32), part_names=("none",)))


def test_all_edits_are_tested_here():
    makers = {
        name for name, function in inspect.getmembers(edits, inspect.isfunction)
        if function.__module__ == edits.__name__ and not name.startswith("_")
        and inspect.signature(function).return_annotation in ("Document", Document)
    }  # fmt: skip
    source = inspect.getsource(inspect.getmodule(test_all_edits_are_tested_here))
    assert {name for name in makers if f"edits.{name}" not in source} <= {"add_mesh", "add_mesh_file", "add_groom"}
