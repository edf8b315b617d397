"""The timeline by mouse and keys, and playback against a clock of our own."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QColor, QWheelEvent
from PySide6.QtWidgets import QApplication, QWidget
from pytestqt.qtbot import QtBot

from app.window.desk import Desk
from app.window.theme import look_of
from app.window.timeline.playback import Playback
from app.window.timeline.timeline import Timeline
from tests.documents import animated_document, small_document
from tools.session import Session


@pytest.fixture
def desk() -> Iterator[Desk]:
    desk = Desk(Session(animated_document()))
    desk.set_workspace(frame=1001.0)
    yield desk
    desk.jobs.close()
    desk.session.close(discard=True)


@pytest.fixture
def timeline(desk: Desk, qtbot: QtBot) -> Timeline:
    timeline = Timeline(desk)
    qtbot.addWidget(timeline)
    timeline.resize(1200, 60)
    with qtbot.waitExposed(timeline):
        timeline.show()
    return timeline


def at(timeline: Timeline, frame: float) -> QPoint:
    return QPoint(round(timeline.ruler.x_of(frame)), timeline.ruler.height() // 2)


def colours(timeline: Timeline, frame: float, row: QWidget | None = None) -> set[str]:
    """Of the column of pixels at a frame, of the ruler or what is below it."""
    image = (row or timeline.ruler).grab().toImage()
    ratio = image.devicePixelRatio()
    x = round(timeline.ruler.x_of(frame) * ratio)
    return {QColor(image.pixel(x, y)).name() for y in range(image.height())}


def test_dragging_scrubs_and_stays_within_the_timeline(desk: Desk, timeline: Timeline, qtbot: QtBot) -> None:
    ruler = timeline.ruler
    qtbot.mousePress(ruler, Qt.MouseButton.LeftButton, pos=at(timeline, 1024))
    assert desk.workspace.frame == 1024.0
    qtbot.mouseMove(ruler, at(timeline, 1050))
    qtbot.waitUntil(lambda: desk.workspace.frame == 1050.0)
    qtbot.mouseMove(ruler, QPoint(ruler.width() + 300, 5))
    qtbot.waitUntil(lambda: desk.workspace.frame == 1100.0)
    qtbot.mouseRelease(ruler, Qt.MouseButton.LeftButton, pos=at(timeline, 1100))
    qtbot.mouseMove(ruler, at(timeline, 1010))
    assert desk.workspace.frame == 1100.0
    assert timeline.frame.text() == "1100"
    assert desk.session.history.undo_name is None


def test_keys_wheel_and_buttons_step(desk: Desk, timeline: Timeline, qtbot: QtBot) -> None:
    ruler = timeline.ruler
    for key, frame in ((Qt.Key.Key_Right, 1002), (Qt.Key.Key_Left, 1001), (Qt.Key.Key_Left, 1001),
                       (Qt.Key.Key_End, 1100), (Qt.Key.Key_Home, 1001), (Qt.Key.Key_PageDown, 1011)):
        qtbot.keyClick(ruler, key)
        assert desk.workspace.frame == frame
    for button, frame in ((timeline.next_button, 1012), (timeline.previous_button, 1011),
                          (timeline.last_button, 1100), (timeline.first_button, 1001)):
        qtbot.mouseClick(button, Qt.MouseButton.LeftButton)
        assert desk.workspace.frame == frame
    place = QPointF(at(timeline, 1001))
    down = QWheelEvent(place, ruler.mapToGlobal(place), QPoint(), QPoint(0, -240), Qt.MouseButton.NoButton,
                       Qt.KeyboardModifier.NoModifier, Qt.ScrollPhase.NoScrollPhase, False)
    QApplication.sendEvent(ruler, down)
    assert desk.workspace.frame == 1003.0


def test_range_and_rate_are_steps_of_history(desk: Desk, timeline: Timeline, qtbot: QtBot) -> None:
    def type_in(field: object, words: str) -> None:
        field.selectAll()  # type: ignore[attr-defined]
        qtbot.keyClicks(field, words)
        qtbot.keyClick(field, Qt.Key.Key_Return)

    type_in(timeline.first, "990")
    assert (desk.document.first_frame, desk.document.last_frame) == (990, 1100)
    assert desk.session.history.undo_name == "Frame range"
    type_in(timeline.last, "980")  # crossed: put in order
    assert (desk.document.first_frame, desk.document.last_frame) == (980, 990)
    type_in(timeline.rate, "25")
    assert desk.document.fps == 25.0
    assert desk.session.history.undo_name == "Frame rate"
    for nonsense in ("fast", "nan", ""):
        type_in(timeline.rate, nonsense)
        assert desk.document.fps == 25.0
        assert timeline.rate.text() == "25"
    said: list[str] = []
    desk.failed.connect(lambda sentence, details: said.append(sentence))
    type_in(timeline.rate, "-3")
    assert said
    assert timeline.rate.text() == "25"
    desk.session.undo()
    assert timeline.rate.text() == "24"
    type_in(timeline.frame, "985.5")
    assert desk.workspace.frame == 985.5


def test_cached_frames_keys_and_the_current_frame_are_seen(desk: Desk, timeline: Timeline) -> None:
    theme = look_of().theme
    desk.set_workspace(frame=1090.0)
    assert theme.cached not in colours(timeline, 1020)
    timeline.set_cached([*range(1015, 1031), 1060])
    assert theme.cached in colours(timeline, 1020)
    assert theme.cached in colours(timeline, 1060)
    assert theme.cached not in colours(timeline, 1040)
    assert theme.accent in colours(timeline, 1090)
    assert theme.text in colours(timeline, 1010, timeline.keys)  # the diamond of a key
    assert theme.text not in colours(timeline, 1012, timeline.keys)
    desk.edit("Flat", lambda document: small_document())
    assert not timeline.keys.isVisible()


def test_keys_below_the_ruler_are_selected_and_dragged(desk: Desk, timeline: Timeline, qtbot: QtBot) -> None:
    row = timeline.keys

    def place(frame: float) -> QPoint:
        return QPoint(round(timeline.ruler.x_of(frame)), row.height() // 2)

    before = desk.document
    qtbot.mousePress(row, Qt.MouseButton.LeftButton, pos=place(1010))
    assert desk.keys.count == 2  # of both curves
    qtbot.mouseMove(row, place(1015.3))
    qtbot.waitUntil(lambda: key_frames(desk) == {1001.0, 1015.0, 1030.0})
    assert desk.session.history.undo_name is None  # while it is dragged
    qtbot.mouseMove(row, place(1030))  # on top of others: it stays
    qtbot.mouseRelease(row, Qt.MouseButton.LeftButton, pos=place(1015.3))
    assert desk.session.history.undo_name == "Move keys"
    desk.session.undo()
    assert desk.document is before
    qtbot.mousePress(row, Qt.MouseButton.LeftButton, pos=place(1004))
    assert desk.keys.count == 0
    qtbot.mouseMove(row, place(1050))
    qtbot.mouseRelease(row, Qt.MouseButton.LeftButton, pos=place(1050))
    assert desk.keys.count == 4
    qtbot.mousePress(row, Qt.MouseButton.LeftButton, pos=place(1010))
    qtbot.mouseMove(row, place(1020))
    qtbot.waitUntil(lambda: key_frames(desk) == {1001.0, 1020.0, 1040.0})
    qtbot.keyClick(row, Qt.Key.Key_Escape)
    assert desk.document is before
    qtbot.mouseDClick(row, Qt.MouseButton.LeftButton, pos=place(1030))
    assert desk.workspace.frame == 1030.0


def key_frames(desk: Desk) -> set[float]:
    return {key.frame for keyed in desk.keys.all for key in keyed.curve.keys}


@pytest.mark.parametrize("frames", [(7, 7), (-5, 5), (0, 2_000_000), (-(2**31), 2**31 - 1)])
def test_any_range_is_drawn_at_once(desk: Desk, timeline: Timeline, frames: tuple[int, int]) -> None:
    desk.edit("Range", lambda d: d.replace(first_frame=frames[0], last_frame=frames[1]))
    timeline.ruler.grab()
    assert timeline.ruler.frame_at(timeline.ruler.x_of(frames[1])) == frames[1]
    assert timeline.ruler.frame_at(-1e6) == frames[0]


class Clock:
    """Time that passes when a test says so."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def test_playback_shows_the_frame_whose_time_it_is(desk: Desk, qtbot: QtBot) -> None:
    clock = Clock()
    playback = Playback(desk, clock=clock)
    desk.set_workspace(frame=1098.0)
    playback.play()
    assert playback.playing
    seen = []
    for passed in (0.0, 1 / 24, 3 / 24, 3.5 / 24, 10 / 24):
        clock.now = 100.0 + passed
        playback.tick()
        seen.append(desk.workspace.frame)
    assert seen == [1098.0, 1099.0, 1001.0, 1001.0, 1008.0]  # late by six frames: they are dropped; it loops
    desk.set_workspace(frame=1050.0)  # scrubbed meanwhile: goes on from there
    playback.tick()
    clock.now += 2 / 24
    playback.tick()
    assert desk.workspace.frame == 1052.0
    desk.edit("Rate", lambda d: d.replace(fps=48.0))
    playback.tick()
    clock.now += 1.0
    playback.tick()
    assert desk.workspace.frame == 1100.0
    playback.pause()
    assert not playback.playing


def test_at_another_speed_places_between_frames_are_played_or_frames_left_out(desk: Desk, qtbot: QtBot) -> None:
    for speed, places in ((0.5, [1098.0, 1098.5, 1099.0, 1100.0, 1100.0, 1001.0]), (2.0, [1098.0, 1100.0, 1002.0])):
        clock = Clock()
        playback = Playback(desk, clock=clock, speed=lambda speed=speed: speed)
        desk.set_workspace(frame=1098.0)
        playback.play()
        seen = []
        for passed in range(len(places)):
            clock.now = 100.0 + (passed + (passed > 2)) / 24
            playback.tick()
            seen.append(desk.workspace.frame)
        assert seen == places
        playback.pause()


def test_frames_left_out_are_said_beside_the_rate(
    desk: Desk, timeline: Timeline, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock, playback = Clock(), timeline.playback
    monkeypatch.setattr(playback, "_clock", clock)
    playback.play()
    for frames, said in ((1, "fps"), (4, "fps, 20 shown"), (4, "fps, 18 shown")):
        clock.now += frames / 24
        playback.tick()
        assert timeline._unit.text() == said
    playback.pause()
    assert timeline._unit.text() == "fps"


def test_playback_waits_for_a_stroke(desk: Desk, monkeypatch: pytest.MonkeyPatch, qtbot: QtBot) -> None:
    clock = Clock()
    playback = Playback(desk, clock=clock)
    playback.play()
    monkeypatch.setattr(Session, "stroking", True)
    clock.now += 5.0
    playback.tick()
    assert desk.workspace.frame == 1001.0
    monkeypatch.undo()
    clock.now += 1 / 24
    playback.tick()
    assert desk.workspace.frame == 1002.0
    playback.pause()


def test_the_button_plays_in_real_time(desk: Desk, timeline: Timeline, qtbot: QtBot) -> None:
    desk.edit("Rate", lambda d: d.replace(fps=100.0))
    frames: list[float] = []
    desk.workspace_changed.connect(lambda old, new: frames.append(new.frame))
    qtbot.mouseClick(timeline.play, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: len(frames) > 10, timeout=5000)
    qtbot.mouseClick(timeline.play, Qt.MouseButton.LeftButton)
    stopped = desk.workspace.frame
    assert frames == sorted(frames)
    assert timeline.playback.reached > 1.0
    desk.edit("Nothing", lambda d: d.replace())
    assert desk.workspace.frame == stopped
