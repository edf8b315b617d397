"""The palette by keys alone."""

from __future__ import annotations

import pytest
from PySide6.QtCore import Qt
from pytestqt.qtbot import QtBot

from app.window.palette import CATEGORY, KEY, REASON, Palette
from tests.window.host import Host


@pytest.fixture
def palette(host: Host, qtbot: QtBot) -> Palette:
    palette = Palette(host, host.commands, host.keymap)
    with qtbot.waitExposed(palette):
        palette.open_over(host)
    return palette


def gone(host: Host) -> bool:
    return not any(p.isVisible() for p in host.findChildren(Palette))


def test_typed_words_and_return_run_a_command(palette: Palette, host: Host, qtbot: QtBot) -> None:
    assert host.desk.workspace.view.grid
    qtbot.keyClicks(palette.line, "grid")
    qtbot.keyClick(palette.line, Qt.Key.Key_Return)
    assert not host.desk.workspace.view.grid
    qtbot.waitUntil(lambda: gone(host))
    assert host.commands.recent == ["view.grid"]


def test_arrows_go_round_and_pages_stop(palette: Palette, qtbot: QtBot) -> None:
    count = palette.model.rowCount()
    qtbot.keyClick(palette.line, Qt.Key.Key_Down)
    assert palette.list.currentIndex().row() == 1
    qtbot.keyClick(palette.line, Qt.Key.Key_Up)
    qtbot.keyClick(palette.line, Qt.Key.Key_Up)
    assert palette.list.currentIndex().row() == count - 1
    qtbot.keyClick(palette.line, Qt.Key.Key_PageDown)
    assert palette.list.currentIndex().row() == count - 1
    qtbot.keyClick(palette.line, Qt.Key.Key_PageUp)
    assert palette.list.currentIndex().row() == count - 12


def test_what_cannot_run_stays_and_says_why(palette: Palette, host: Host, qtbot: QtBot) -> None:
    qtbot.keyClicks(palette.line, "undo")
    index = palette.list.currentIndex()
    assert index.data() == "Undo"
    assert index.data(REASON) == "There is nothing to undo."
    assert index.data(KEY) == "Ctrl+Z"
    assert index.data(CATEGORY) == "Edit"
    qtbot.keyClick(palette.line, Qt.Key.Key_Return)
    assert palette.isVisible()
    assert host.commands.recent == []


def test_nothing_found_runs_nothing_and_esc_leaves(palette: Palette, host: Host, qtbot: QtBot) -> None:
    qtbot.keyClicks(palette.line, "xqzwvk")
    assert palette.model.rowCount() == 0
    assert palette.nothing.isVisible()
    qtbot.keyClick(palette.line, Qt.Key.Key_Down)
    qtbot.keyClick(palette.line, Qt.Key.Key_Return)
    qtbot.keyClick(palette.line, Qt.Key.Key_Escape)
    qtbot.waitUntil(lambda: gone(host))
    assert host.commands.recent == []


def test_a_click_runs_too(palette: Palette, host: Host, qtbot: QtBot) -> None:
    qtbot.keyClicks(palette.line, "axes")
    place = palette.list.visualRect(palette.model.index(0)).center()
    qtbot.mouseClick(palette.list.viewport(), Qt.MouseButton.LeftButton, pos=place)
    assert not host.desk.workspace.view.axes


def test_the_last_used_come_first(host: Host, qtbot: QtBot) -> None:
    host.commands.run("view.axes")
    palette = Palette(host, host.commands, host.keymap)
    assert palette.list.currentIndex().data() == "Axes"
