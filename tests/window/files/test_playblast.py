"""Playblasts run beside the window, draw on its thread, and keep what they have when they are cancelled."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import av
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from PySide6.QtCore import Qt, QThread
from pytestqt.qtbot import QtBot

from app.window.desk import Desk
from app.window.files.playblast import Playblast, PlayblastDialog, start_playblast
from core.errors import UserError
from tests.documents import small_document
from tools.session import Session


@pytest.fixture
def desk() -> Iterator[Desk]:
    desk = Desk(Session(small_document()))
    yield desk
    assert desk.jobs.close()
    desk.session.close(discard=True)


def draw(frame: float, size: tuple[int, int]) -> NDArray[np.uint8]:
    """A grey that says which frame it is."""
    return np.full((size[1], size[0], 3), int(frame) % 200, np.uint8)


def in_slices(frame: float, size: tuple[int, int]) -> Iterator[object]:
    """The same in three pieces of work."""
    yield 0.3
    yield 0.6
    yield draw(frame, size)


def finish(desk: Desk, qtbot: QtBot) -> None:
    qtbot.waitUntil(lambda: not desk.jobs.running, timeout=30_000)


@pytest.mark.parametrize("how", [draw, in_slices])
def test_pictures_are_drawn_on_the_thread_of_the_window(desk: Desk, tmp_path: Path, qtbot: QtBot, how: object) -> None:
    window = QThread.currentThread()
    threads: list[bool] = []
    said: list[str] = []
    desk.said.connect(said.append)

    def drawing(frame: float, size: tuple[int, int]) -> object:
        threads.append(QThread.currentThread() is window)
        return how(frame, size)  # type: ignore[operator]

    start_playblast(desk, Playblast(tmp_path / "a.##.png", 12, 9, (32, 24)), drawing)  # type: ignore[arg-type]
    finish(desk, qtbot)
    assert threads == [True] * 4
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.09.png", "a.10.png", "a.11.png", "a.12.png"]
    assert np.array_equal(np.asarray(Image.open(tmp_path / "a.11.png")), draw(11, (32, 24)))
    assert said == [f"Playblast: 4 frames are in {tmp_path}."]


def test_a_cancelled_movie_keeps_what_was_drawn(desk: Desk, tmp_path: Path, qtbot: QtBot) -> None:
    said: list[str] = []
    desk.said.connect(said.append)

    def drawing(frame: float, size: tuple[int, int]) -> NDArray[np.uint8]:
        if frame == 1005.0:
            desk.jobs.cancel(job)
        return draw(frame, size)

    path = tmp_path / "a.mp4"
    job = start_playblast(desk, Playblast(path, 1001, 1100, (32, 24)), drawing)
    finish(desk, qtbot)
    with av.open(str(path)) as movie:
        count = len(list(movie.decode(video=0)))
    assert 4 <= count <= 5
    assert said == [f"Playblast cancelled: {count} of 100 frames are kept in {path}."]
    assert list(tmp_path.iterdir()) == [path]


def test_a_view_that_cannot_be_drawn_is_said(desk: Desk, tmp_path: Path, qtbot: QtBot) -> None:
    failed: list[str] = []
    desk.failed.connect(lambda sentence, details: failed.append(sentence))

    def drawing(frame: float, size: tuple[int, int]) -> NDArray[np.uint8]:
        raise UserError("There is no camera.")

    start_playblast(desk, Playblast(tmp_path / "a.mp4", 1, 5, (32, 24)), drawing)
    finish(desk, qtbot)
    assert failed == ["There is no camera."]
    assert list(tmp_path.iterdir()) == []


def test_the_dialog_proposes_and_starts(desk: Desk, tmp_path: Path, qtbot: QtBot) -> None:
    desk.session.path = tmp_path / "cat.filo"
    dialog = PlayblastDialog(desk, draw, (40, 30))
    qtbot.addWidget(dialog)
    dialog.show()
    assert not dialog.isModal()
    assert dialog.path.text() == str(tmp_path / "cat.mp4")
    dialog.kind.setCurrentIndex(1)
    assert dialog.path.text() == str(tmp_path / "cat.####.png")
    assert (dialog.first.value(), dialog.last.value()) == (1001, 1100)
    dialog.last.setValue(1003)
    qtbot.mouseClick(dialog.start, Qt.MouseButton.LeftButton)
    finish(desk, qtbot)
    assert [np.asarray(Image.open(path)).shape for path in sorted(tmp_path.iterdir())] == [(30, 40, 3)] * 3
    dialog.kind.setCurrentIndex(0)
    assert dialog.path.text() == str(tmp_path / "cat.mp4")
    failed: list[str] = []
    desk.failed.connect(lambda sentence, details: failed.append(sentence))
    dialog.path.setText(str(tmp_path / "cat.gif"))
    qtbot.mouseClick(dialog.start, Qt.MouseButton.LeftButton)
    assert len(failed) == 1
    assert not desk.jobs.running
