"""Which thing is meant, and hiding and showing it."""

import pytest

from core.camera import Camera, look_at
from core.document import Document, MeshObject, with_groom, with_mesh
from core.workspace import Workspace
from tests.documents import grid_mesh, small_document
from tools.document_edits import set_groom_hidden, set_mesh_hidden
from tools.scene import active_mesh, ghosted, isolated, show_all, stored_bookmark


def two_meshes() -> Document:
    document = with_mesh(small_document(), MeshObject(id=9, name="other", mesh=grid_mesh(2)))
    return with_groom(document, document.grooms[0].replace(id=2, name="second", mesh_id=9))


@pytest.mark.parametrize(("groom", "mesh"), [(None, 7), (1, 7), (2, 9), (77, 7)])
def test_the_active_mesh_is_that_of_the_active_groom(groom: int | None, mesh: int) -> None:
    found = active_mesh(two_meshes(), Workspace(groom=groom))
    assert found is not None
    assert found.id == mesh


def test_without_grooms_it_is_the_first_mesh() -> None:
    document = two_meshes().replace(grooms=())
    found = active_mesh(document, Workspace())
    assert found is document.meshes[0]
    assert active_mesh(Document(), Workspace()) is None


def test_all_that_is_hidden_is_shown() -> None:
    document = two_meshes()
    hidden = set_mesh_hidden(document, 9, True)
    shown = show_all(hidden)
    assert [m.hidden for m in shown.meshes] == [False, False]
    assert shown.meshes[0] is document.meshes[0]
    assert show_all(document) is document
    bald = set_groom_hidden(document, document.grooms[0].id, True)
    assert bald.grooms[0].hidden
    assert not any(g.hidden for g in show_all(bald).grooms)


def test_isolating_and_ghosting_go_and_come_back() -> None:
    document, workspace = two_meshes(), Workspace(groom=2)
    alone = isolated(document, workspace)
    assert alone.view.isolated == (9,)
    assert isolated(document, alone).view.isolated == ()
    assert isolated(document, alone.replace(groom=1)).view.isolated == (7,)
    clear = ghosted(document, workspace)
    assert clear.view.ghosted == (9,)
    assert ghosted(document, clear.replace(groom=1)).view.ghosted == (9, 7)
    assert ghosted(document, clear).view.ghosted == ()
    assert ghosted(Document(), workspace) is workspace


def test_a_view_is_kept_under_a_name() -> None:
    camera = Camera(world_from_camera=look_at([0.0, 0.0, 1.0], [0.0, 0.0, 0.0]))
    assert stored_bookmark(Workspace(), "1").bookmarks == {}
    kept = stored_bookmark(Workspace(cameras=(camera,), bookmarks={"2": camera}), "1")
    assert kept.bookmarks["1"] is camera
    assert set(kept.bookmarks) == {"1", "2"}
