"""Hotkeys by real keys: what they run, where they work, and how they are changed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QGuiApplication, QWindow
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLineEdit, QTreeWidget, QTreeWidgetItem, QWidget
from pytestqt.qtbot import QtBot

from app.window import keymap as keymaps
from app.window.commands import Command
from app.window.hotkeys import Hotkeys, tooltip
from app.window.keymap_editor import KeymapEditor
from core.errors import UserError
from tests.window.host import Host

CTRL, SHIFT, NONE = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.ShiftModifier, Qt.KeyboardModifier(0)


@pytest.fixture
def tree(host: Host) -> QTreeWidget:
    tree = QTreeWidget(host)
    tree.addTopLevelItems([QTreeWidgetItem([f"row {i}"]) for i in range(3)])
    tree.show()
    return tree


@pytest.fixture
def hotkeys(host: Host, tree: QTreeWidget, qtbot: QtBot) -> Hotkeys:
    host.activateWindow()
    qtbot.waitUntil(host.isActiveWindow)
    return Hotkeys(host, host.commands, host.keymap, tree)


@pytest.fixture
def editor(host: Host, qtbot: QtBot, tmp_path: Path) -> Iterator[KeymapEditor]:
    editor = KeymapEditor(host, host.commands, host.keymap, "blender", tmp_path)
    with qtbot.waitExposed(editor):
        editor.show()
    yield editor
    editor.close()


def test_a_key_runs_its_command(host: Host, hotkeys: Hotkeys, qtbot: QtBot) -> None:
    host.setFocus()
    qtbot.keyClick(host, Qt.Key.Key_H)
    assert host.desk.document.meshes[0].hidden
    qtbot.keyClick(host, Qt.Key.Key_Z, CTRL)
    assert not host.desk.document.meshes[0].hidden
    qtbot.keyClick(host, Qt.Key.Key_Z, CTRL | SHIFT)
    assert host.desk.document.meshes[0].hidden


def test_letters_typed_into_a_field_are_letters(host: Host, hotkeys: Hotkeys, qtbot: QtBot) -> None:
    line = QLineEdit(host)
    line.show()
    line.setFocus()
    qtbot.keyClicks(line, "hh]")
    qtbot.keyClick(line, Qt.Key.Key_Left)
    assert line.text() == "hh]"
    assert line.cursorPosition() == 2
    assert not host.desk.document.meshes[0].hidden
    qtbot.keyClick(line, Qt.Key.Key_K, CTRL)  # but this works everywhere
    assert host.palettes == 1


def test_delete_means_what_has_the_focus(host: Host, tree: QTreeWidget, hotkeys: Hotkeys, qtbot: QtBot) -> None:
    done: list[str] = []
    host.commands.add([
        Command("a.view", "Delete guides", "", lambda w: done.append("guides"), "", scope="viewport"),
        Command("a.tree", "Delete rows", "", lambda w: done.append("rows"), "", scope="outliner")])
    free = host.keymap.assigned("groom.delete_selected", ())
    hotkeys.set_keymap(free.assigned("a.view", ("Del",)).assigned("a.tree", ("Del",)))
    host.setFocus()
    qtbot.keyClick(host, Qt.Key.Key_Delete)
    assert done == ["guides"]
    tree.setFocus()
    qtbot.keyClick(tree, Qt.Key.Key_Delete)
    assert done == ["guides", "rows"]
    line = QLineEdit("abc", host)
    line.show()
    line.setFocus()
    line.home(False)
    qtbot.keyClick(line, Qt.Key.Key_Delete)
    assert line.text() == "bc"
    assert done == ["guides", "rows"]


def test_arrows_move_in_a_list_not_in_time(host: Host, tree: QTreeWidget, hotkeys: Hotkeys, qtbot: QtBot) -> None:
    host.commands.run("frame.first")
    frame = host.desk.workspace.frame
    tree.setFocus()
    tree.setCurrentItem(tree.topLevelItem(0))
    qtbot.keyClick(tree, Qt.Key.Key_Down)
    qtbot.keyClick(tree, Qt.Key.Key_Right)
    assert tree.currentItem() is tree.topLevelItem(1)
    assert host.desk.workspace.frame == frame
    host.setFocus()
    qtbot.keyClick(host, Qt.Key.Key_Right)
    assert host.desk.workspace.frame == frame + 1


def test_another_keymap_takes_over_at_once(host: Host, hotkeys: Hotkeys, qtbot: QtBot) -> None:
    action = hotkeys.action("view.hide")
    assert action.text() == "Hide\tH"
    hotkeys.set_keymap(keymaps.preset("houdini"))
    assert action.text() == "Hide"
    host.setFocus()
    qtbot.keyClick(host, Qt.Key.Key_H)
    assert not host.desk.document.meshes[0].hidden
    assert not hotkeys.press_with_space(Qt.Key.Key_J)


def test_actions_show_what_can_run_and_what_is_on(host: Host, hotkeys: Hotkeys) -> None:
    undo, grid = hotkeys.action("edit.undo"), hotkeys.action("view.grid")
    hotkeys.refresh()
    assert not undo.isEnabled()
    assert "nothing to undo" in undo.toolTip()
    assert grid.isChecked()
    grid.trigger()
    assert not grid.isChecked()
    assert not host.desk.workspace.view.grid
    host.commands.run("view.hide")
    hotkeys.refresh()
    assert undo.isEnabled()
    undo.trigger()
    assert not host.desk.document.meshes[0].hidden
    words = tooltip(host.commands["view.hide"], host.keymap, "Why not.").split("\n")
    assert words == ["Hide   H", host.commands["view.hide"].tooltip, "Why not."]


def test_a_pressed_key_is_the_hotkey_from_then_on(editor: KeymapEditor, qtbot: QtBot, tmp_path: Path) -> None:
    editor.choose("view.grid")
    editor.capture.setFocus()
    with qtbot.waitSignal(editor.changed) as changed:
        qtbot.keyPress(editor.capture, Qt.Key.Key_Control, CTRL)
        qtbot.keyClick(editor.capture, Qt.Key.Key_G, CTRL | SHIFT)
    assert changed.args[0].of("view.grid") == ("Ctrl+Shift+G",)
    assert editor.current() == "view.grid"
    assert editor.capture.text() == "Ctrl+Shift+G"
    assert keymaps.load("blender", tmp_path).keymap.of("view.grid") == ("Ctrl+Shift+G",)


def test_a_conflict_is_said_and_can_be_taken_over(editor: KeymapEditor, qtbot: QtBot) -> None:
    editor.choose("view.grid")
    editor.capture.setFocus()
    qtbot.keyClick(editor.capture, Qt.Key.Key_H)
    assert editor.message.text() == "H is Hide already."
    assert editor.take_over.isVisible()
    assert editor.keymap.of("view.grid") == ()
    qtbot.mouseClick(editor.take_over, Qt.MouseButton.LeftButton)
    assert editor.keymap.of("view.grid") == ("H",)
    assert editor.keymap.of("view.hide") == ()
    assert not editor.take_over.isVisible()


def test_a_conflict_can_be_cancelled(editor: KeymapEditor, qtbot: QtBot) -> None:
    editor.choose("view.grid")
    qtbot.keyClick(editor.capture, Qt.Key.Key_Z, CTRL)
    assert editor.message.text() == "Ctrl+Z is Undo already."
    qtbot.mouseClick(editor.cancel, Qt.MouseButton.LeftButton)
    assert editor.keymap.of("view.grid") == ()
    assert editor.keymap.of("edit.undo") == ("Ctrl+Z",)
    qtbot.keyClick(editor.capture, Qt.Key.Key_Escape)
    assert editor.keymap is not None
    assert editor.isVisible()


def test_a_gesture_of_the_preset_is_not_taken_over(editor: KeymapEditor, qtbot: QtBot) -> None:
    editor.choose("view.grid")
    qtbot.keyClick(editor.capture, Qt.Key.Key_F)
    assert "the size gesture" in editor.message.text()
    assert not editor.take_over.isVisible()
    assert editor.keymap.of("view.grid") == ()


def test_reset_of_one_and_of_all(editor: KeymapEditor, qtbot: QtBot) -> None:
    editor.choose("view.grid")
    editor.press("H")
    editor.take_over.click()
    editor.choose("view.hide")
    editor.reset_one.click()
    assert editor.message.text() == "H is Grid now: change that first."
    assert editor.keymap.of("view.hide") == ()
    editor.choose("view.grid")
    editor.clear.click()
    editor.choose("view.hide")
    editor.reset_one.click()
    assert editor.keymap.of("view.hide") == ("H",)
    editor.press("J")
    editor.reset_all.click()
    assert editor.keymap.keys == keymaps.preset("blender").keys


def test_the_search_narrows_the_table(editor: KeymapEditor, qtbot: QtBot) -> None:
    qtbot.keyClicks(editor.search, "undo")
    labels = [editor.table.model().index(r, 0).data() for r in range(editor.table.model().rowCount())]
    assert labels == ["Undo", "Undo everything"]
    qtbot.keyClick(editor.search, Qt.Key.Key_Return)
    assert editor.isVisible()


def test_a_keymap_goes_to_a_file_and_comes_back(editor: KeymapEditor, tmp_path: Path) -> None:
    editor.choose("view.grid")
    editor.press("Ctrl+Shift+G")
    editor.export_to(tmp_path / "mine.json")
    editor.reset_all.click()
    assert editor.keymap.of("view.grid") == ()
    editor.import_from(tmp_path / "mine.json")
    assert editor.keymap.of("view.grid") == ("Ctrl+Shift+G",)


@pytest.mark.parametrize("content", [
    "{", '{"name": "x"}',
    '{"name": "x", "navigate": {}, "brush": {}, "keys": {"edit.undo": ["J"], "edit.redo": ["J"]}}'])
def test_a_file_that_is_no_keymap_is_refused(editor: KeymapEditor, tmp_path: Path, content: str) -> None:
    (tmp_path / "other.json").write_text(content)
    before = editor.keymap
    with pytest.raises(UserError, match=r"other\.json"):
        editor.import_from(tmp_path / "other.json")
    assert editor.keymap is before


def test_keys_over_the_native_window_of_the_viewport_run_commands(
        host: Host, hotkeys: Hotkeys, tree: QTreeWidget, qtbot: QtBot) -> None:
    viewport = QWindow()
    container = QWidget.createWindowContainer(viewport, host)
    host.setCentralWidget(container)
    container.show()
    tree.setFocus()
    viewport.requestActivate()
    qtbot.waitUntil(lambda: QGuiApplication.focusWindow() is viewport)
    assert hotkeys.scope() == "viewport"
    QTest.keyClick(viewport, Qt.Key.Key_H)
    assert host.desk.document.meshes[0].hidden
    tree.setFocus()
    tree.window().activateWindow()
    qtbot.waitUntil(lambda: hotkeys.scope() == "outliner")
