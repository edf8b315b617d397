"""The radial menu: a direction chooses, by flick or by click."""

from __future__ import annotations

import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QWidget
from pytestqt.qtbot import QtBot

from app.window.radial import Entry, RadialMenu

NAMES = ("up", "right", "down", "left", "up right", "down right", "down left", "up left")
PLACE = QPoint(400, 300)


@pytest.fixture
def home(qtbot: QtBot) -> QWidget:
    home = QWidget()
    home.resize(800, 600)
    qtbot.addWidget(home)
    home.show()
    qtbot.waitExposed(home)
    return home


def opened(home: QWidget, qtbot: QtBot, *entries: Entry | None, place: QPoint = PLACE) -> tuple[RadialMenu, list[str]]:
    menu, chosen = RadialMenu(home, entries or [Entry(n, n.capitalize(), "comb") for n in NAMES]), []
    menu.chosen.connect(chosen.append)
    with qtbot.waitExposed(menu):
        menu.open_at(place)
    return menu, chosen


@pytest.mark.parametrize(("way", "name"), [
    ((0, -60), "up"), ((60, 0), "right"), ((0, 60), "down"), ((-60, 0), "left"), ((50, -40), "up right"),
    ((40, 50), "down right"), ((-45, 45), "down left"), ((-300, -280), "up left"), ((8, -40), "up"),
])
def test_a_flick_chooses_by_its_direction_alone(
        home: QWidget, qtbot: QtBot, way: tuple[int, int], name: str) -> None:
    menu, chosen = opened(home, qtbot)
    middle = menu.rect().center()
    qtbot.mouseMove(menu, middle)
    end = menu.mapFromGlobal(PLACE + QPoint(*way))
    qtbot.mouseMove(menu, end)
    qtbot.mouseRelease(menu, Qt.MouseButton.RightButton, pos=end)
    assert chosen == [name]
    qtbot.waitUntil(lambda: not menu_is_there(home))


def menu_is_there(home: QWidget) -> bool:
    return any(child.isVisible() for child in home.findChildren(RadialMenu))


def test_a_short_press_leaves_it_open_and_a_click_chooses(home: QWidget, qtbot: QtBot) -> None:
    menu, chosen = opened(home, qtbot)
    qtbot.mouseRelease(menu, Qt.MouseButton.RightButton, pos=menu.rect().center())
    assert menu.isVisible()
    assert chosen == []
    qtbot.mouseClick(menu, Qt.MouseButton.LeftButton, pos=menu.rect().center() + QPoint(70, 0))
    assert chosen == ["right"]


def test_esc_and_a_click_in_the_middle_leave(home: QWidget, qtbot: QtBot) -> None:
    menu, chosen = opened(home, qtbot)
    qtbot.keyClick(menu, Qt.Key.Key_Escape)
    qtbot.waitUntil(lambda: not menu_is_there(home))
    menu, more = opened(home, qtbot)
    qtbot.mouseRelease(menu, Qt.MouseButton.RightButton, pos=menu.rect().center())
    qtbot.mouseClick(menu, Qt.MouseButton.LeftButton, pos=menu.rect().center())
    qtbot.waitUntil(lambda: not menu_is_there(home))
    assert chosen == more == []


def test_a_released_key_chooses_too(home: QWidget, qtbot: QtBot) -> None:
    menu, chosen = opened(home, qtbot)
    menu.point_to(PLACE + QPoint(0, 90))
    qtbot.keyRelease(menu, Qt.Key.Key_Space)
    assert chosen == ["down"]


def test_directions_count_from_the_hand_at_the_border_of_the_screen(home: QWidget, qtbot: QtBot) -> None:
    corner = QGuiApplication.primaryScreen().availableGeometry().bottomRight()
    menu, chosen = opened(home, qtbot, place=corner)
    assert QGuiApplication.primaryScreen().availableGeometry().contains(menu.geometry())
    menu.point_to(corner + QPoint(-50, 0))
    menu.let_go()
    assert chosen == ["left"]


def test_what_cannot_run_or_is_not_there_is_not_chosen(home: QWidget, qtbot: QtBot) -> None:
    menu, chosen = opened(home, qtbot, Entry("a", "A", None, "There is no mesh."), None, Entry("b", "B"))
    for way in (QPoint(0, -60), QPoint(60, 0), QPoint(-60, 0)):
        assert (menu.entry_at(QPointF(menu.rect().center() + way)) or Entry("", "")).name in ("a", "")
    menu.point_to(PLACE + QPoint(0, -60))
    menu.let_go()
    assert chosen == []


def test_entries_lie_in_their_direction_and_apart(home: QWidget, qtbot: QtBot) -> None:
    menu, _ = opened(home, qtbot)
    picture = menu.grab().toImage()
    assert picture.pixelColor(picture.rect().center().x(), 4).alpha() < 255  # about the entries one sees through
    for name in NAMES:
        place = menu._place(NAMES.index(name))
        assert (menu.entry_at(place) or Entry("", "")).name == name
        assert picture.pixelColor((place * menu.devicePixelRatioF()).toPoint()).alpha() == 255


def test_nine_entries_are_refused(home: QWidget) -> None:
    with pytest.raises(ValueError, match="at most 8"):
        RadialMenu(home, [Entry("a", "A")] * 9)
