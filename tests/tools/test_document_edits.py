"""Edits of the tree: what they change, and that everything else is the very same."""

from __future__ import annotations

import pytest

from core.document import Document
from core.errors import UserError
from tests.documents import grid_mesh, small_document
from tools.document_edits import (
    add_empty_groom,
    add_groom,
    add_mesh,
    free_name,
    import_mesh,
    move_groom,
    move_mesh,
    rename_groom,
    rename_mesh,
    set_hidden,
    set_locked,
)


def three_meshes() -> Document:
    document = small_document()
    for name in ("sheet", "tail"):
        document = import_mesh(document, grid_mesh(2), name)
    return add_empty_groom(document, 7, "whiskers")


def test_meshes_and_grooms_get_ids_and_names_of_their_own() -> None:
    document = three_meshes()
    assert [(m.id, m.name) for m in document.meshes] == [(7, "sheet"), (8, "sheet 2"), (9, "tail")]
    assert [(g.id, g.name, g.mesh_id) for g in document.grooms] == [
        (1, "coat", 7), (2, "coat 2", 8), (3, "coat 3", 9), (4, "whiskers", 7)]
    assert len(document.grooms[1].guides) == 0
    assert document.meshes[0] is not small_document().meshes[0]
    again = add_groom(document, document.grooms[0])
    assert again.grooms[-1].guides is document.grooms[0].guides
    assert add_mesh(document, grid_mesh(1), "\n").meshes[-1].name == "thing"
    with pytest.raises(UserError, match="no mesh 99"):
        add_empty_groom(document, 99)


def test_a_name_is_changed_or_refused_in_words() -> None:
    document = three_meshes()
    assert rename_mesh(document, 8, "  Katze 猫 ").meshes[1].name == "Katze 猫"
    assert rename_groom(document, 4, "beard").grooms[3].name == "beard"
    assert rename_mesh(document, 8, "sheet 2") is document
    assert rename_groom(document, 4, " whiskers") is document
    for bad in ("", "   ", "a\nb", "x" * 256):
        with pytest.raises(UserError, match="1 to 255 letters"):
            rename_mesh(document, 8, bad)
        with pytest.raises(UserError, match="1 to 255 letters"):
            rename_groom(document, 4, bad)


def test_hiding_and_locking_touch_one_mesh() -> None:
    document = three_meshes()
    hidden = set_hidden(document, 8, True)
    assert [m.hidden for m in hidden.meshes] == [False, True, False]
    assert hidden.meshes[0] is document.meshes[0]
    assert set_hidden(hidden, 8, True) is hidden
    locked = set_locked(document, 9, True)
    assert [m.locked for m in locked.meshes] == [False, False, True]
    assert set_locked(document, 9, False) is document


def test_order_changes_among_equals_only() -> None:
    document = three_meshes()
    assert [m.id for m in move_mesh(document, 9, 0).meshes] == [9, 7, 8]
    assert [m.id for m in move_mesh(document, 7, 99).meshes] == [8, 9, 7]
    assert move_mesh(document, 8, 1) is document
    assert [g.id for g in move_groom(document, 4, 0).grooms] == [4, 2, 3, 1]
    assert move_groom(document, 2, 5) is document  # alone on its mesh


def test_free_names_count_up() -> None:
    assert free_name("coat", []) == "coat"
    assert free_name("coat", ["coat", "coat 2"]) == "coat 3"
    assert len(free_name("x" * 400, ["x" * 247])) <= 255
