"""Moving the view by the gestures of each keymap: what is under the cursor stays there, or follows it."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from core.camera import Camera, project
from core.document import Document
from tests.documents import small_document
from tests.window.conftest import Opened
from tests.window.hand import ALT, CTRL, LEFT, MIDDLE, NONE, RIGHT, SHIFT, Hand

BACK, ASIDE = (0.60, 0.42), (0.68, 0.50)
PRESETS = {
    "blender": {"orbit": (MIDDLE, NONE), "pan": (MIDDLE, SHIFT), "dolly": (MIDDLE, CTRL)},
    "maya": {"orbit": (LEFT, ALT), "pan": (MIDDLE, ALT), "dolly": (RIGHT, ALT)},
    "houdini": {"orbit": (LEFT, ALT), "pan": (MIDDLE, ALT), "dolly": (RIGHT, ALT)},
}


def camera(hand: Hand) -> Camera:
    return hand.window.desk.workspace.cameras[0]


def pixel(hand: Hand, point: np.ndarray) -> np.ndarray:
    return project(camera(hand), point, *hand.view.pixels()).xy


def under(hand: Hand, place: tuple[float, float]) -> np.ndarray:
    at = hand.at(place)
    found = hand.view.eye.under(at.x(), at.y())
    assert found is not None
    return found


def wheel(hand: Hand, place: tuple[float, float], notches: int, modifiers: Qt.KeyboardModifier = NONE) -> None:
    where = QPointF(hand.at(place))
    event = QWheelEvent(
        where, QPointF(hand.view.mapToGlobal(where)), QPoint(), QPoint(0, 120 * notches), Qt.MouseButton.NoButton,
        modifiers, Qt.ScrollPhase.NoScrollPhase, False)
    QApplication.sendEvent(hand.view, event)


@pytest.mark.parametrize("keymap", list(PRESETS))
def test_gestures_of_a_keymap_turn_slide_and_approach(keymap: str, opened: Opened, animal: Document) -> None:
    hand = opened(animal, keymap=keymap)
    document = hand.window.desk.document
    grabbed, start = under(hand, BACK), camera(hand)
    for action, (button, modifiers) in PRESETS[keymap].items():
        before = camera(hand)
        at = pixel(hand, grabbed)
        place = (float(at[0] + 0.5) / hand.view.width(), float(at[1] + 0.5) / hand.view.height())
        grabbed = under(hand, place)
        at = pixel(hand, grabbed)
        goal = (place[0] + 0.06, place[1] + 0.05)
        hand.drag(place, goal, button, modifiers)
        now = camera(hand)
        assert now is not before, action
        if action == "pan":
            way = hand.at(goal) - hand.at(place)
            assert np.allclose(pixel(hand, grabbed) - at, (way.x(), way.y()), atol=1e-3)
            assert np.allclose(now.world_from_camera[:3, :3], before.world_from_camera[:3, :3])
        else:
            assert np.allclose(pixel(hand, grabbed), at, atol=1e-3), action
        if action == "orbit":
            assert not np.allclose(now.forward, before.forward)
            assert abs(now.world_from_camera[1, 0]) < 1e-6  # up stays up
    assert hand.window.desk.document is document
    assert camera(hand) is not start
    assert not hand.window.desk.session.history.undo_name


def test_the_wheel_approaches_what_is_under_the_cursor(hand: Hand) -> None:
    goal, at = under(hand, BACK), pixel(hand, under(hand, BACK))
    far = np.linalg.norm(camera(hand).position - goal)
    wheel(hand, BACK, 3)
    assert np.allclose(pixel(hand, goal), at, atol=1e-3)
    near = np.linalg.norm(camera(hand).position - goal)
    assert near < 0.75 * far
    wheel(hand, BACK, -3)
    assert np.linalg.norm(camera(hand).position - goal) == pytest.approx(far, rel=1e-6)


def test_the_wheel_sizes_the_brush_in_houdini(opened: Opened, animal: Document) -> None:
    hand = opened(animal, keymap="houdini")
    before, size = camera(hand), hand.window.desk.session.tool.params.size
    wheel(hand, BACK, 1)
    assert hand.window.desk.session.tool.params.size > size
    assert camera(hand) is before


def test_escape_brings_the_view_back(hand: Hand) -> None:
    before = camera(hand)
    hand.press(BACK, MIDDLE)
    hand.move(ASIDE)
    hand.painted()
    assert not np.allclose(camera(hand).position, before.position)
    hand.key(Qt.Key.Key_Escape)
    assert np.allclose(camera(hand).world_from_camera, before.world_from_camera)
    hand.release(ASIDE, MIDDLE)


def test_a_held_key_makes_the_left_button_turn_in_houdini(opened: Opened, animal: Document) -> None:
    hand = opened(animal, keymap="houdini")
    before, document = camera(hand), hand.window.desk.document
    QTest.keyPress(hand.view, Qt.Key.Key_Space)
    hand.drag(BACK, ASIDE)
    QTest.keyRelease(hand.view, Qt.Key.Key_Space)
    assert not np.allclose(camera(hand).forward, before.forward)
    assert hand.window.desk.document is document
    hand.drag(BACK, (0.64, 0.45))
    assert hand.window.desk.session.history.undo_name == "Comb"


@pytest.mark.parametrize("side", ["front", "left", "top"])
def test_standard_views_look_along_the_animals_axes(side: str, hand: Hand) -> None:
    hand.window.commands.run(f"view.{side}")
    forward = camera(hand).forward
    # the demo animal looks along +z
    wanted = {"front": (0, 0, -1), "left": (-1, 0, 0), "top": (0, -1, 0)}[side]
    assert forward == pytest.approx(wanted, abs=1e-9)


def test_framing_and_projection(hand: Hand) -> None:
    wheel(hand, BACK, 12)
    hand.window.commands.run("view.frame_all")
    points = hand.window.desk.document.meshes[0].mesh.points
    xy = project(camera(hand), points, *hand.view.pixels()).xy
    width, height = hand.view.pixels()
    assert (xy >= -0.5).all()
    assert (xy <= (width, height)).all()
    assert np.ptp(xy, axis=0).max() > 0.5 * height
    goal = under(hand, BACK)
    at = pixel(hand, goal)
    hand.window.commands.run("view.projection")
    assert camera(hand).orthographic
    hand.window.commands.run("view.projection")
    assert np.allclose(pixel(hand, goal), at, atol=1e-3)


def test_frame_selected_sees_the_selected_guides_large(hand: Hand) -> None:
    desk = hand.window.desk
    groom = desk.document.grooms[0]
    selected = np.zeros(len(groom.guides), bool)
    selected[:6] = True
    marked = groom.replace(guides=groom.guides.replace(selected=selected))
    desk.edit("Select", lambda d: d.replace(grooms=(marked,)))
    hand.window.commands.run("view.frame_all")
    far = camera(hand)
    hand.window.commands.run("view.frame_selected")
    xy = project(camera(hand), groom.guides.points[:6].reshape(-1, 3), *hand.view.pixels()).xy
    assert (xy >= -1).all()
    assert (xy <= hand.view.pixels()).all()
    assert np.linalg.norm(camera(hand).position - far.position) > 0.0


def test_a_kept_view_is_saved_and_comes_back(hand: Hand) -> None:
    before = camera(hand)
    hand.window.commands.run("view.store_1")
    hand.drag(BACK, ASIDE, MIDDLE)
    hand.window.commands.run("view.recall_1")
    assert np.allclose(camera(hand).world_from_camera, before.world_from_camera)


def test_the_first_view_is_the_same_however_late_the_window_gets_its_size(opened: Opened) -> None:
    hand = opened(small_document())  # wider than high
    hand.rest()
    first, size = camera(hand), hand.window.size()
    resized(hand, 500, size.height())
    assert not np.array_equal(camera(hand).world_from_camera, first.world_from_camera)
    resized(hand, size.width(), size.height())
    np.testing.assert_array_equal(camera(hand).world_from_camera, first.world_from_camera)


def test_a_view_that_was_moved_stays_when_the_window_is_resized(hand: Hand) -> None:
    hand.rest()
    wheel(hand, BACK, 1)
    moved = camera(hand)
    resized(hand, 700, hand.window.height())
    np.testing.assert_array_equal(camera(hand).world_from_camera, moved.world_from_camera)


def resized(hand: Hand, width: int, height: int) -> None:
    size, frames = hand.view.size(), hand.view.frames
    hand.window.resize(width, height)
    hand.until(lambda: hand.view.size() != size and hand.view.frames > frames)
    hand.rest()
