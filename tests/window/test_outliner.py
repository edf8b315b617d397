"""The outliner by mouse and keys: names, eyes, locks, order, what is chosen; undo takes all of it back."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from PySide6.QtCore import QMimeData, QModelIndex, QPoint, Qt
from PySide6.QtWidgets import QLineEdit, QMenu
from pytestqt.qtbot import QtBot

from app.window.desk import Desk
from app.window.outliner import Outliner
from app.window.scene_model import MIME, Item
from core.document import Document, find_groom, find_mesh
from tests.documents import grid_mesh, small_document, stroked
from tests.window.conftest import Opened
from tools.document_edits import add_empty_groom, add_mesh, set_mesh_locked
from tools.session import Session

NOWHERE = QModelIndex()


def scene() -> Document:
    """sheet (7): coat (1), whiskers (3); collar (8): trim (2)."""
    document = add_mesh(small_document(), grid_mesh(2), "collar")
    document = add_empty_groom(document, 8, "trim")
    return add_empty_groom(document, 7, "whiskers")


@pytest.fixture
def desk() -> Iterator[Desk]:
    desk = Desk(Session(scene()))
    yield desk
    assert desk.jobs.close()
    desk.session.close(discard=True)


@pytest.fixture
def tree(desk: Desk, qtbot: QtBot) -> Outliner:
    tree = Outliner(desk)
    qtbot.addWidget(tree)
    tree.resize(300, 300)
    with qtbot.waitExposed(tree):
        tree.show()
    tree.setFocus()
    return tree


def groom(desk: Desk, groom_id: int) -> Item:
    return find_groom(desk.document, groom_id)


def mesh(desk: Desk, mesh_id: int) -> Item:
    return find_mesh(desk.document, mesh_id)


def shown(tree: Outliner) -> list[str]:
    """Every row as a word, grooms indented."""
    model = tree.scene
    found = []
    for row in range(model.rowCount()):
        parent = model.index(row, 0)
        found.append(parent.data())
        found += [f"  {model.index(r, 0, parent).data()}" for r in range(model.rowCount(parent))]
    return found


def click(tree: Outliner, qtbot: QtBot, item: Item, button: Qt.MouseButton = Qt.MouseButton.LeftButton) -> None:
    place = tree.visualRect(tree.scene.index_of(item)).center()
    qtbot.mouseClick(tree.viewport(), button, pos=place)


def click_button(tree: Outliner, qtbot: QtBot, item: Item, which: int) -> None:
    area = tree.rows.buttons(tree.visualRect(tree.scene.index_of(item)))[which]
    qtbot.mouseClick(tree.viewport(), Qt.MouseButton.LeftButton, pos=area.center().toPoint())


def drag(tree: Outliner, item: Item, row: int, parent: QModelIndex = NOWHERE) -> bool:
    """Drop an item between rows (or onto the parent, with row -1), as Qt does; False where it may not lie."""
    model, move = tree.scene, Qt.DropAction.MoveAction
    data = model.mimeData([model.index_of(item)])
    if not model.canDropMimeData(data, move, row, 0, parent):
        return False
    assert not model.dropMimeData(data, move, row, 0, parent)
    return True


def test_it_shows_meshes_with_their_grooms_and_follows(desk: Desk, tree: Outliner) -> None:
    everything = ["sheet", "  coat", "  whiskers", "collar", "  trim"]
    assert shown(tree) == everything
    desk.edit("Delete", lambda d: d.replace(meshes=d.meshes[:1], grooms=d.grooms[:1]))
    assert shown(tree) == ["sheet", "  coat"]
    desk.session.undo()
    assert shown(tree) == everything
    desk.replace_session(Session())
    assert shown(tree) == []


def test_only_what_changed_is_drawn_again(desk: Desk, tree: Outliner, monkeypatch: pytest.MonkeyPatch) -> None:
    changed: list[str] = []
    resets: list[int] = []
    tree.scene.dataChanged.connect(lambda first, last: changed.append(first.data()))
    tree.scene.modelReset.connect(lambda: resets.append(1))
    desk.edit("Comb", stroked, 1)
    assert (changed, resets) == (["coat"], [])
    desk.edit("Frames", lambda d: d.replace(last_frame=2000))
    assert (changed, resets) == (["coat"], [])
    monkeypatch.setattr(Session, "stroking", True)
    desk.edit("Comb", stroked, 2)
    assert (changed, resets) == (["coat"], [])
    monkeypatch.undo()
    desk.stroke_ended.emit()
    assert (changed, resets) == (["coat", "coat"], [])


def test_a_click_chooses_the_groom_tools_edit(desk: Desk, tree: Outliner, qtbot: QtBot) -> None:
    click(tree, qtbot, groom(desk, 2))
    assert desk.workspace.groom == 2
    click(tree, qtbot, mesh(desk, 7))
    assert desk.workspace.groom == 1
    assert tree.chosen is mesh(desk, 7)  # the mesh stays marked: it is what was clicked
    desk.set_workspace(groom=2)
    assert tree.chosen is groom(desk, 2)
    qtbot.keyClick(tree, Qt.Key.Key_Up)
    qtbot.keyClick(tree, Qt.Key.Key_Up)
    assert desk.workspace.groom == 3
    assert desk.session.history.undo_name is None


def test_names_are_changed_in_place(desk: Desk, tree: Outliner, qtbot: QtBot) -> None:
    click(tree, qtbot, groom(desk, 1))
    qtbot.keyClick(tree, Qt.Key.Key_F2)
    editor = tree.findChild(QLineEdit)
    assert editor is not None
    assert editor.selectedText() == "coat"
    editor.insert("Fell 猫")
    qtbot.keyClick(editor, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: groom(desk, 1).name == "Fell 猫")
    assert desk.session.history.undo_name == "Rename"
    place = tree.visualRect(tree.scene.index_of(mesh(desk, 8))).center()
    click(tree, qtbot, mesh(desk, 8))  # a hand's double click begins with one
    qtbot.mouseDClick(tree.viewport(), Qt.MouseButton.LeftButton, pos=place)
    qtbot.waitUntil(lambda: any(e.isVisible() for e in tree.findChildren(QLineEdit)))
    editor = next(e for e in tree.findChildren(QLineEdit) if e.isVisible())
    qtbot.keyClick(editor, Qt.Key.Key_Delete)  # of letters, not of the mesh
    qtbot.keyClicks(editor, "ring")
    qtbot.keyClick(editor, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: mesh(desk, 8).name == "ring")
    assert len(desk.document.meshes) == 2
    failed: list[str] = []
    desk.failed.connect(lambda sentence, details: failed.append(sentence))
    assert not tree.scene.setData(tree.scene.index_of(mesh(desk, 8)), "   ")
    assert failed
    assert mesh(desk, 8).name == "ring"


def test_eye_and_lock_are_steps(desk: Desk, tree: Outliner, qtbot: QtBot) -> None:
    click_button(tree, qtbot, mesh(desk, 8), 0)
    assert [m.hidden for m in desk.document.meshes] == [False, True]
    assert desk.session.history.undo_name == "Hide"
    click_button(tree, qtbot, mesh(desk, 8), 0)
    assert desk.session.history.undo_name == "Show"
    click_button(tree, qtbot, mesh(desk, 7), 1)
    assert [m.locked for m in desk.document.meshes] == [True, False]
    desk.session.undo()
    assert not desk.document.meshes[0].locked
    click_button(tree, qtbot, groom(desk, 2), 0)
    assert [g.hidden for g in desk.document.grooms] == [False, True, False]
    assert [m.hidden for m in desk.document.meshes] == [False, False]
    click_button(tree, qtbot, groom(desk, 3), 1)
    assert [g.locked for g in desk.document.grooms] == [False, False, True]
    assert desk.session.history.undo_name == "Lock"
    assert desk.workspace.groom is None  # a click on a button chooses nothing


def test_delete_takes_what_is_chosen_and_undo_brings_it_back(desk: Desk, tree: Outliner, qtbot: QtBot) -> None:
    click(tree, qtbot, groom(desk, 3))
    qtbot.keyClick(tree, Qt.Key.Key_Delete)
    assert [g.id for g in desk.document.grooms] == [1, 2]
    click(tree, qtbot, mesh(desk, 7))
    qtbot.keyClick(tree, Qt.Key.Key_Backspace)
    assert shown(tree) == ["collar", "  trim"]
    desk.session.undo()
    desk.session.undo()
    assert shown(tree) == ["sheet", "  coat", "  whiskers", "collar", "  trim"]


def test_rows_are_dragged_into_another_order(desk: Desk, tree: Outliner) -> None:
    model = tree.scene
    sheet, collar = (model.index_of(mesh(desk, i)) for i in (7, 8))
    assert drag(tree, mesh(desk, 7), 2)
    assert [m.id for m in desk.document.meshes] == [8, 7]
    desk.session.undo()
    assert drag(tree, mesh(desk, 8), -1, sheet)
    assert [m.id for m in desk.document.meshes] == [8, 7]
    assert shown(tree) == ["collar", "  trim", "sheet", "  coat", "  whiskers"]
    desk.session.undo()
    assert drag(tree, groom(desk, 3), 0, sheet)
    assert shown(tree)[:3] == ["sheet", "  whiskers", "  coat"]
    assert desk.session.history.undo_name == "Reorder"
    assert drag(tree, groom(desk, 3), 2, sheet)
    assert shown(tree)[:3] == ["sheet", "  coat", "  whiskers"]
    assert drag(tree, groom(desk, 3), -1, model.index_of(groom(desk, 1)))
    assert shown(tree)[:3] == ["sheet", "  whiskers", "  coat"]
    assert drag(tree, groom(desk, 3), -1, sheet)
    assert shown(tree)[:3] == ["sheet", "  coat", "  whiskers"]
    assert not drag(tree, groom(desk, 3), 0, collar)  # hair stays on its mesh
    assert not drag(tree, groom(desk, 3), 1)
    assert not drag(tree, mesh(desk, 7), 0, collar)
    words = QMimeData()
    words.setText("groom 1")
    assert not model.canDropMimeData(words, Qt.DropAction.MoveAction, 0, 0, sheet)
    stranger = QMimeData()
    stranger.setData(MIME, b"Groom 99")
    assert not model.canDropMimeData(stranger, Qt.DropAction.MoveAction, 0, 0, sheet)


def run(menu: QMenu, *words: str) -> None:
    for word in words[:-1]:
        action = next(a for a in menu.actions() if a.text() == word)
        menu = action.menu()  # type: ignore[assignment]
    next(a for a in menu.actions() if a.text().split("\t")[0] == words[-1]).trigger()


def test_the_menu_isolates_ghosts_and_adds(desk: Desk, tree: Outliner, qtbot: QtBot) -> None:
    def menu(item: Item) -> QMenu:
        return tree.menu(tree.scene.index_of(item))

    run(menu(mesh(desk, 8)), "Isolate")
    run(menu(groom(desk, 1)), "Ghost")
    assert desk.workspace.view.isolated == (8,)
    assert desk.workspace.view.ghosted == (7,)
    run(menu(mesh(desk, 8)), "Isolate")
    run(menu(mesh(desk, 7)), "Ghost")
    assert desk.workspace.view.isolated == desk.workspace.view.ghosted == ()
    run(menu(mesh(desk, 8)), "Add groom", "Empty")
    assert desk.document.grooms[-1].mesh_id == 8
    assert desk.workspace.groom == desk.document.grooms[-1].id
    run(menu(mesh(desk, 8)), "Hide")
    run(menu(mesh(desk, 8)), "Lock")
    run(menu(groom(desk, 2)), "Lock")
    run(menu(groom(desk, 2)), "Hide")
    assert (groom(desk, 2).locked, groom(desk, 2).hidden) == (True, True)
    assert [m.text() for m in menu(groom(desk, 2)).actions()][1:3] == ["Show", "Unlock"]
    assert mesh(desk, 8).hidden
    assert mesh(desk, 8).locked
    run(menu(groom(desk, 2)), "Delete")
    assert all(g.id != 2 for g in desk.document.grooms)
    place = tree.visualRect(tree.scene.index_of(mesh(desk, 8))).center()
    tree.customContextMenuRequested.emit(QPoint(place))
    opened = [m for m in tree.findChildren(QMenu) if m.isVisible()]
    assert len(opened) == 1
    opened[0].close()


def test_a_styled_groom_is_laid_beside_the_window(desk: Desk, tree: Outliner, qtbot: QtBot) -> None:
    tree.add_groom(desk.document.meshes[1], "short")
    [job] = desk.jobs.running
    assert job.name == "Lay a short coat on collar"
    desk.edit("Comb", stroked, 3)  # the hand goes on meanwhile
    qtbot.waitUntil(lambda: not desk.jobs.running, timeout=60_000)
    added = desk.document.grooms[-1]
    assert (added.name, added.mesh_id, len(added.guides)) == ("short", 8, 2500)
    assert desk.workspace.groom == added.id
    assert desk.session.history.names[-2:] == ("Comb", "Add groom")


def test_what_is_folded_stays_folded(desk: Desk, tree: Outliner) -> None:
    tree.collapse(tree.scene.index_of(mesh(desk, 7)))
    desk.edit("Add", add_mesh, grid_mesh(1), "floor")
    assert not tree.isExpanded(tree.scene.index_of(mesh(desk, 7)))
    assert tree.isExpanded(tree.scene.index_of(mesh(desk, 8)))
    assert tree.chosen is mesh(desk, 7)  # its groom is the active one, and is not seen


def test_a_thousand_meshes_are_one_list(qtbot: QtBot) -> None:
    document, sheet = small_document(), grid_mesh(1)
    first = document.meshes[0]
    meshes = tuple(first.replace(id=100 + i, name=f"part {i}", mesh=sheet) for i in range(1000))
    desk = Desk(Session(document.replace(meshes=(first, *meshes))))
    tree = Outliner(desk)
    qtbot.addWidget(tree)
    tree.show()
    resets: list[int] = []
    tree.scene.modelReset.connect(lambda: resets.append(1))
    desk.edit("Lock", set_mesh_locked, 600, True)
    assert tree.scene.rowCount() == 1001
    assert resets == []
    desk.session.close(discard=True)


@pytest.mark.parametrize("size", [10, 12, 16, 20])
def test_a_small_scene_needs_no_scrolling_at_any_text_size(opened: Opened, animal: Document, size: int) -> None:
    hand = opened(animal, text_size=12)
    hand.window.change_settings(text_size=size)
    outliner = hand.window.outliner
    hand.until(lambda: outliner.verticalScrollBar().maximum() == 0, 5_000)
    hand.window.change_settings(text_size=12)
