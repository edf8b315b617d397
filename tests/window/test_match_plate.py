"""A matchmover at the real window: a plate is opened, a point placed and followed, saved and opened again."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest

from core.document import Document
from core.image.plate_view import view_points
from tests.window.conftest import Opened
from tests.window.hand import LEFT, NONE, Hand

WIDTH, HEIGHT, FIRST, COUNT = 240, 160, 1001, 10
STEP = np.array([2.3, -0.7])  # pixels from frame to frame
START = np.array([90.0, 90.0])


@pytest.fixture(scope="module")
def plate(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Smooth noise that slides by STEP."""
    folder = tmp_path_factory.mktemp("plate") / "sliding"
    folder.mkdir()
    rough = np.random.default_rng(7).random((100, 140, 3)).astype(np.float32)
    noise = cv2.resize(rough, (560, 400), interpolation=cv2.INTER_CUBIC)
    for n in range(COUNT):
        x, y = np.meshgrid(np.arange(WIDTH) + 100 - n * STEP[0], np.arange(HEIGHT) + 100 - n * STEP[1])
        frame = cv2.remap(noise, x.astype(np.float32), y.astype(np.float32), cv2.INTER_CUBIC)
        cv2.imwrite(str(folder / f"sliding.{FIRST + n}.png"), np.clip(frame * 255.0, 0, 255).astype(np.uint8))
    return folder


def pixel(hand: Hand, place: NDArray[np.float64]) -> QPoint:
    """The pixel of Qt's that shows a place of the plate."""
    view = hand.view
    x, y = view_points(view.eye.camera, 1.0, place, *view.pixels())[0]
    ratio = view.devicePixelRatio()
    return QPoint(round(x / ratio), round(y / ratio))


def click(hand: Hand, place: NDArray[np.float64], modifiers: Qt.KeyboardModifier = NONE) -> None:
    at = pixel(hand, place)
    QTest.mousePress(hand.view, LEFT, modifiers, at)
    QTest.mouseRelease(hand.view, LEFT, modifiers, at)
    hand.painted()


def opened_plate(opened: Opened, plate: Path) -> Hand:
    hand = opened(Document())
    hand.window.opening.open(plate)
    hand.until(lambda: bool(hand.window.desk.document.plates))
    hand.rest()
    return hand


def test_a_point_is_placed_followed_saved_and_opened_again(opened: Opened, plate: Path, tmp_path: Path) -> None:
    hand = opened_plate(opened, plate)
    desk = hand.window.desk
    assert desk.session.tool.name == "track_point"
    assert (desk.document.first_frame, desk.document.last_frame) == (FIRST, FIRST + COUNT - 1)
    click(hand, START)
    (track,) = desk.document.tracks
    assert np.abs(track.points[0] - START).max() < 1.0 / hand.window.match.eye.camera.height * HEIGHT
    assert desk.document.track_selection == (track.id,)
    hand.window.commands.run("match.forward")
    hand.until(lambda: not desk.jobs.running, 240_000)
    (track,) = desk.document.tracks
    assert list(track.frames) == list(range(FIRST, FIRST + COUNT))
    truth = track.points[0] + STEP * np.arange(COUNT)[:, None]
    assert np.abs(track.points - truth).max() < 0.1
    assert desk.session.history.undo_name == "Track forward"
    desk.set_workspace(frame=float(FIRST + 5))
    hand.rest()
    project = tmp_path / "shot.filo"
    desk.session.save(project)
    hand.window.opening.open(project)
    hand.until(lambda: desk.session.path == project)
    hand.rest()
    assert np.array_equal(desk.document.tracks[0].points, track.points)
    assert hand.window.match.shown
