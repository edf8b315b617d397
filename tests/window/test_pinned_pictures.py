"""Pictures pinned to the view are moved and sized by hand and by numbers, and the line below says so."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtWidgets import QApplication

from app.window.pictures_dialog import PicturesDialog
from core.workspace import Reference
from tests.window.hand import ALT, CTRL, LEFT, Hand


@pytest.fixture
def pinned(hand: Hand, tmp_path: Path) -> Hand:
    """A view with a red picture, twice as wide as high, from (0.1, 0.2), a third as wide as the view."""
    cv2.imwrite(str(tmp_path / "red.png"), np.full((40, 80, 3), (0, 0, 255), np.uint8))
    desk = hand.window.desk
    view = desk.workspace.view.replace(references=(Reference(str(tmp_path / "red.png"), 0.1, 0.2, 0.3),))
    desk.set_workspace(view=view)
    hand.rest()
    return hand


def reference(hand: Hand) -> Reference:
    return hand.window.desk.workspace.view.references[0]


def is_red(hand: Hand, place: tuple[float, float]) -> bool:
    colour = hand.view.grabFramebuffer().pixelColor(hand.at(place) * hand.view.devicePixelRatio())
    return colour.red() > 200 and colour.green() < 40


def test_a_drag_moves_it_and_its_picture(pinned: Hand) -> None:
    hand, document, camera = pinned, pinned.window.desk.document, pinned.window.desk.workspace.cameras
    assert is_red(hand, (0.2, 0.25))
    hand.press((0.2, 0.25), LEFT, CTRL | ALT)
    assert "move the picture" in hand.window.status.words.text()
    hand.move((0.5, 0.65))
    hand.release((0.5, 0.65), LEFT, CTRL | ALT)
    hand.rest()
    assert (reference(hand).x, reference(hand).y) == (pytest.approx(0.4, abs=0.003), pytest.approx(0.6, abs=0.003))
    assert reference(hand).width == 0.3
    assert is_red(hand, (0.5, 0.65))
    assert not is_red(hand, (0.2, 0.25))
    assert "move the picture" not in hand.window.status.words.text()
    assert hand.window.desk.document is document  # no stroke, no step
    assert hand.window.desk.workspace.cameras is camera


def test_its_corner_sizes_it_and_escape_puts_it_back(pinned: Hand) -> None:
    hand = pinned
    tall = 0.3 * 0.5 * hand.view.width() / hand.view.height()
    corner = (0.395, 0.2 + tall - 0.01)
    hand.press(corner, LEFT, CTRL | ALT)
    hand.move((corner[0] + 0.2, corner[1]))
    hand.painted()
    assert reference(hand).width == pytest.approx(0.5, abs=0.003)
    assert (reference(hand).x, reference(hand).y) == (0.1, 0.2)
    hand.key(Qt.Key.Key_Escape)
    assert reference(hand).width == pytest.approx(0.3)
    hand.release(corner, LEFT, CTRL | ALT)
    assert reference(hand).width == pytest.approx(0.3)


def test_the_wheel_sizes_it_about_the_pointer_and_it_cannot_be_lost(pinned: Hand) -> None:
    hand = pinned
    where = QPointF(hand.at((0.1, 0.2)) + QPoint(1, 1))
    QApplication.sendEvent(hand.view, QWheelEvent(
        where, QPointF(hand.view.mapToGlobal(where)), QPoint(), QPoint(0, 240), Qt.MouseButton.NoButton, CTRL | ALT,
        Qt.ScrollPhase.NoScrollPhase, False))
    assert reference(hand).width == pytest.approx(0.3 * 1.21)
    assert (reference(hand).x, reference(hand).y) == (pytest.approx(0.1, abs=0.003), pytest.approx(0.2, abs=0.003))
    hand.drag((0.2, 0.25), (-3.0, -3.0), LEFT, CTRL | ALT)
    assert reference(hand).x + reference(hand).width > 0.02
    hand.rest()
    assert is_red(hand, (0.01, 0.005))


def test_numbers_follow_the_hand_and_the_view_follows_numbers(pinned: Hand) -> None:
    hand = pinned
    assert hand.window.commands.run("view.pictures")
    dialog = next(d for d in hand.window.findChildren(PicturesDialog))
    field = dialog.panels[0].fields["x"]
    field.edited.emit(0.5, True)
    assert reference(hand).x == 0.5
    hand.drag((0.6, 0.25), (0.4, 0.25), LEFT, CTRL | ALT)
    assert field.value() == reference(hand).x == pytest.approx(0.3, abs=0.003)
    dialog._remove(0)
    assert hand.window.desk.workspace.view.references == ()
    assert dialog.panels == []
    dialog.close()


def test_nothing_under_the_pointer_is_said(hand: Hand) -> None:
    document = hand.window.desk.document
    hand.drag((0.6, 0.42), (0.7, 0.4), LEFT, CTRL | ALT)
    assert "no pinned picture" in hand.window.status.words.text()
    assert hand.window.desk.document is document
