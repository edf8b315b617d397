"""The document's records and the pure functions on them."""

import numpy as np
import pytest

from core.document import (
    Document,
    MeshObject,
    find_groom,
    find_mesh,
    free_id,
    problems,
    with_groom,
    with_mesh,
    without_groom,
    without_mesh,
)
from core.errors import UserError
from core.field import fields_of
from core.pose.rig import Rig
from core.pose.skeleton import Skeleton, SkinWeights
from core.units import METRES_PER_UNIT
from core.workspace import Workspace
from tests.documents import grid_mesh, small_document


def test_with_puts_in_place_of_the_same_id_or_at_the_end():
    document = small_document()
    groom = document.grooms[0]
    renamed = with_groom(document, groom.replace(name="mane"))
    assert [g.name for g in renamed.grooms] == ["mane"]
    assert renamed.meshes is document.meshes
    two = with_groom(document, groom.replace(id=free_id(document.grooms)))
    assert [g.id for g in two.grooms] == [1, 2]
    assert two.grooms[0] is groom
    assert [m.id for m in with_mesh(document, document.meshes[0].replace(id=3)).meshes] == [7, 3]
    assert free_id(()) == 1


def test_find_says_what_there_is():
    document = small_document()
    assert find_groom(document, 1) is document.grooms[0]
    assert find_mesh(document, 7) is document.meshes[0]
    with pytest.raises(UserError, match=r"no groom 5 .* choose one of \[1\]"):
        find_groom(document, 5)
    with pytest.raises(UserError, match=r"no mesh 1 .* choose one of \[7\]"):
        find_mesh(document, 1)


def test_a_mesh_goes_with_its_grooms():
    document = small_document()
    other = with_mesh(document, MeshObject(id=8, name="other", mesh=grid_mesh(1)))
    assert without_mesh(other, 8).grooms == document.grooms
    assert without_mesh(other, 7).grooms == ()
    assert [m.id for m in without_mesh(other, 7).meshes] == [8]
    assert without_groom(document, 1).grooms == ()
    assert without_groom(document, 2).grooms[0] is document.grooms[0]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"unit": "yard"}, "unit must be one of"),
        ({"fps": 0.0}, "fps"),
        ({"fps": float("nan")}, "fps"),
        ({"first_frame": 5, "last_frame": 4}, "after"),
        ({"meshes": ()}, "does not exist"),
        ({"grooms": small_document().grooms * 2}, "same id"),
    ],
)
def test_a_document_that_cannot_be_is_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        small_document().replace(**changes)


def test_a_rig_moves_the_vertices_of_its_mesh():
    item = small_document().meshes[0]
    skeleton = Skeleton(
        names=("a",), parents=np.array([-1], np.int32), rest=np.eye(4)[None], bind=np.eye(4)[None]
    )
    skin = SkinWeights(joints=np.zeros((5, 1), np.int32), weights=np.ones((5, 1), np.float32))
    with pytest.raises(ValueError, match="5 vertices of 16"):
        item.replace(rig=Rig(skeleton=skeleton, skin=skin))


def test_problems_are_references_that_lead_nowhere():
    document = small_document()
    assert problems(document) == []
    assert problems(Document()) == []
    groom = document.grooms[0]
    roots = groom.guides.roots
    for name, array, sentence in (
        ("faces", np.full(12, 9, np.int32), "a face that its mesh does not have"),
        ("corners", np.full((12, 3), 4, np.int32), "a corner that its face does not have"),
    ):
        broken = groom.replace(guides=groom.guides.replace(roots=roots.replace(**{name: array})))
        assert sentence in problems(with_groom(document, broken))[0]
    smaller = with_mesh(document, document.meshes[0].replace(mesh=grid_mesh(2)))
    assert len(problems(smaller)) == 2  # roots and the map
    assert "16 values for 9 vertices" in problems(smaller)[1]


def test_workspaces_do_not_share_their_parameters():
    assert Workspace().params is not Workspace().params
    with pytest.raises(ValueError, match="frame"):
        Workspace(frame=float("inf"))


def test_records_do_not_change():
    with pytest.raises(AttributeError):
        small_document().fps = 3.0
    points = small_document().grooms[0].guides.points
    with pytest.raises(ValueError, match="read-only"):
        points[0] = 1


def test_fields_an_artist_edits_are_described():
    assert list(fields_of(Document)) == ["unit", "fps", "first_frame", "last_frame"]
    assert list(fields_of(MeshObject)) == ["hidden", "locked"]
    for known in [*fields_of(Document).values(), *fields_of(MeshObject).values()]:
        assert len(known.tooltip.split()) >= 8, known.label
    assert fields_of(Document)["unit"].choices == tuple(METRES_PER_UNIT)
