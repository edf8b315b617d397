"""Two plates side by side, in step by their offsets: tracks are taken in either, and they change places."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from PySide6.QtCore import QPointF, Qt
from PySide6.QtTest import QTest

from core.document import Document
from core.formats.frame_decoder import FrameDecoder
from core.formats.plate_file import read_plate
from core.image.plate_view import view_points
from core.match.track import keyed_track
from tests.window.conftest import Opened
from tests.window.hand import LEFT, NONE

SIDE = (120, 80)


@pytest.fixture(scope="module")
def plates(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Frames of one grey each: 10 n, and 100 + 10 n, the second numbered 100 higher."""
    made = []
    for name, first, base in (("main", 1001, 0), ("witness", 1101, 100)):
        folder = tmp_path_factory.mktemp(name) / name
        folder.mkdir()
        for n in range(4):
            grey = np.full((SIDE[1], SIDE[0], 3), base + 10 * n, np.uint8)
            cv2.imwrite(str(folder / f"{name}.{first + n}.png"), grey)
        made.append(folder)
    return made[0], made[1]


def test_a_witness_stands_beside_in_step_and_changes_places(opened: Opened, plates: tuple[Path, Path]) -> None:
    decoder = FrameDecoder()
    main, witness = (read_plate(path, decoder, plate_id=k) for k, path in enumerate(plates, 1))
    decoder.close()
    track = keyed_track(7, "corner", np.array([[1102.0, 60.0, 30.0]])).replace(plate_id=2)
    hand = opened(Document(plates=(main, witness.replace(offset=-100)), tracks=(track,)))
    window, desk = hand.window, hand.window.desk
    window.commands.run("window.craft_match")
    assert not window.plate_beside.isVisible()
    window.commands.run("window.beside")
    assert window.plate_beside.isVisible()
    sheet = window.plate_beside.sheet
    assert sheet.plate is not None
    assert (sheet.plate.id, sheet.frame) == (2, 1101)
    desk.set_workspace(frame=1002.0)
    assert sheet.frame == 1102

    def middle() -> int:
        image = sheet.grab().toImage()
        return image.pixelColor(image.width() // 2 - 60, 3 * image.height() // 4).red()

    hand.until(lambda: middle() == 110)
    x, y = view_points(sheet.camera, 1.0, (60.0, 30.0), sheet.width(), sheet.height())[0] + 0.5
    QTest.mouseClick(sheet, LEFT, NONE, QPointF(x, y).toPoint())
    assert desk.document.track_selection == (7,)
    before = sheet.at(QPointF(40.0, 50.0))
    QTest.mousePress(sheet, LEFT, NONE, QPointF(40.0, 50.0).toPoint())
    QTest.mouseMove(sheet, QPointF(60.0, 45.0).toPoint())
    QTest.mouseRelease(sheet, LEFT, NONE, QPointF(60.0, 45.0).toPoint())
    np.testing.assert_allclose(sheet.at(QPointF(60.0, 45.0)), before, atol=1e-6)
    QTest.mouseDClick(sheet, LEFT, NONE, QPointF(60.0, 45.0).toPoint())
    assert window.match.eye.plate is not None
    assert window.match.eye.plate.id == 2
    assert sheet.plate is not None
    assert sheet.plate.id == 1
    desk.session.undo()
    assert window.match.eye.plate.id == 1


def test_nothing_beside_says_what_to_do(opened: Opened, plates: tuple[Path, Path]) -> None:
    decoder = FrameDecoder()
    alone = read_plate(plates[0], decoder)
    decoder.close()
    hand = opened(Document(plates=(alone,)))
    hand.window.commands.run("window.craft_match")
    hand.window.commands.run("window.beside")
    assert hand.window.plate_beside.sheet.plate is None
    assert not hand.window.plate_beside.sheet.grab().isNull()
    assert Qt.MouseButton.LeftButton == LEFT
