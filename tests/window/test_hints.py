"""The status line says what mouse and keys do now, whatever goes on; turning is that of the preferences."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QGuiApplication

from app.window.status_line import hint
from core.document import Document
from core.errors import UserError
from tests.window.conftest import Opened
from tests.window.hand import ALT, LEFT, MIDDLE, RIGHT, SHIFT, Hand

BACK, ASIDE = (0.60, 0.42), (0.68, 0.36)


def words(hand: Hand) -> str:
    return hand.window.status.words.text()


def test_during_strokes_moves_of_the_camera_and_the_brush(hand: Hand) -> None:
    idle = words(hand)
    assert hand.window.desk.session.tool.hint in idle
    hand.press(BACK)
    assert words(hand).startswith("Comb: let go")
    hand.release(BACK)
    assert words(hand) == idle
    hand.press(BACK, MIDDLE)
    assert "turn about" in words(hand)
    hand.key(Qt.Key.Key_Escape)
    assert words(hand) == idle
    hand.release(BACK, MIDDLE)
    hand.press(BACK, MIDDLE, SHIFT)
    assert "slide" in words(hand)
    hand.release(BACK, MIDDLE, SHIFT)
    assert words(hand) == idle
    hand.move(BACK)
    hand.key(Qt.Key.Key_F)
    assert "Sideways: size" in words(hand)
    hand.press(BACK, RIGHT)
    assert words(hand) == idle
    hand.release(BACK, RIGHT)


def test_a_narrow_line_shows_whole_hints_and_the_rest_in_its_tooltip(hand: Hand) -> None:
    whole = hint(hand.window.desk, hand.window.hotkeys.keymap)
    label = hand.window.status.words
    seen = set()
    for wide in range(900, 500, -25):
        hand.window.resize(wide, 640)
        hand.until(lambda: hand.window.width() <= 900)
        hand.painted()
        label.resize(wide - 420, label.height())  # narrower than any window may be
        shown = words(hand)
        seen.add(shown)
        parts = shown.removesuffix("…").rstrip().split("   ")
        assert parts == whole.split("   ")[:len(parts)]
        assert label.fontMetrics().horizontalAdvance(shown) <= label.width()
        assert label.toolTip() == ("" if shown == whole else whole)
    assert len(seen) > 2


def test_what_went_wrong_stays_while_the_hand_goes_on(hand: Hand) -> None:
    hand.window.desk.edit("Lock", lambda d: d.replace(meshes=(d.meshes[0].replace(locked=True),)))
    hand.press(BACK)
    hand.release(BACK)
    assert "locked" in words(hand)
    hand.press(BACK, MIDDLE)
    assert "locked" in words(hand)
    hand.release(BACK, MIDDLE)
    assert "locked" in words(hand)


def test_whatever_went_wrong_can_be_copied(hand: Hand) -> None:
    error = UserError("The file is damaged.")
    error.add_note("at byte 7")
    hand.window.desk.error(error)
    assert words(hand) == "The file is damaged."
    hand.window.status.copy.click()
    assert QGuiApplication.clipboard().text() == "The file is damaged.\n\nat byte 7"
    hand.window.desk.error(UserError("There is no mesh."))
    assert hand.window.status.copy.isVisible()
    hand.window.status.copy.click()
    assert QGuiApplication.clipboard().text() == "There is no mesh."


def test_a_held_key_says_what_the_buttons_do(opened: Opened, animal: Document) -> None:
    from PySide6.QtTest import QTest

    hand = opened(animal, keymap="houdini")
    hand.move(BACK)
    QTest.keyPress(hand.view, Qt.Key.Key_Space)
    assert words(hand).startswith("Space held")
    assert "LMB: orbit" in words(hand)
    QTest.keyRelease(hand.view, Qt.Key.Key_Space)
    assert not words(hand).startswith("Space held")


@pytest.mark.parametrize(("style", "keymap"), [("turntable", "blender"), ("trackball", "maya")])
def test_turning_keeps_up_or_rolls_as_preferred(opened: Opened, animal: Document, keymap: str, style: str) -> None:
    hand = opened(animal, keymap=keymap)
    window = hand.window
    window.change_settings(orbit=style)
    usual = (MIDDLE, Qt.KeyboardModifier.NoModifier) if keymap == "blender" else (LEFT, ALT)
    other = (MIDDLE, ALT) if keymap == "blender" else (LEFT, ALT | SHIFT)
    for gesture, level in ((usual, style == "turntable"), (other, style == "trackball")):
        window.commands.run("view.three_quarter")
        hand.rest()
        hand.drag((0.4, 0.3), (0.5, 0.5), *gesture)
        hand.drag((0.4, 0.3), (0.55, 0.3), *gesture)
        right = window.desk.workspace.cameras[0].world_from_camera[:3, 0]
        assert (abs(right[1]) < 1e-6) == level, gesture
        assert np.linalg.det(window.desk.workspace.cameras[0].world_from_camera[:3, :3]) == pytest.approx(1.0)


def test_rings_are_told_of_where_the_tool_has_one(hand: Hand) -> None:
    desk, keymap = hand.window.desk, hand.window.hotkeys.keymap
    for tool, told in (("comb", ("size", "strength")), ("plant", ()), ("delete", ("size",))):
        desk.choose(tool)
        assert tuple(what for what in ("size", "strength") if f"F: {what}" in hint(desk, keymap)) == told, tool
