"""A camera is solved at the real window: one step of undo, figures, advice by a click, a cube, and a file."""

from __future__ import annotations

import time
from pathlib import Path

import cv2
import numpy as np
from PySide6.QtCore import QEvent, QPointF, Qt
from PySide6.QtGui import QMouseEvent

from app.window.match.solve_panel import SolvePanel
from core.document import Document
from core.formats.shot_file import read_shot
from core.image.plate import Plate
from core.match.solved import pixels_of
from core.match.track import Track, keyed_track
from core.record import freeze
from tests.core.match.solve.shots import SIZE, shot
from tests.window.conftest import Opened


def tracked(folder: Path, tracks: int = 30, frames: int = 16) -> Document:
    """A plate of grey frames with tracks of a shot; one of them slides away."""
    made = shot("orbit", tracks, frames, seed=1)
    rows, found = made.observations, []
    for k in range(tracks):
        own = rows.track == k
        xy = rows.xy[own] + (np.linspace(0, 40, own.sum())[:, None] if k == 7 else 0.0)
        table = np.column_stack([made.frames[rows.frame[own]], xy])
        track: Track = keyed_track(k + 1, f"point {k + 1}", table, 1)
        found.append(track.replace(covariance=freeze(np.tile([0.09, 0.0, 0.09], (own.sum(), 1)))))
    grey = np.full((SIZE[1], SIZE[0], 3), 90, np.uint8)
    for frame in made.frames:
        cv2.imwrite(str(folder / f"grey.{frame}.jpg"), grey)
    plate = Plate(id=1, name="grey", path=str(folder / "grey.####.jpg"), first=1001, last=1000 + frames, width=SIZE[0],
                  height=SIZE[1])
    return Document(plates=(plate,), tracks=tuple(found), first_frame=1001, last_frame=1000 + frames)


def test_a_camera_is_solved_judged_and_given_away(opened: Opened, tmp_path: Path) -> None:
    hand = opened(tracked(tmp_path))
    window, desk = hand.window, hand.window.desk
    desk.set_craft("match")
    window.commands.run("match.solve")
    hand.until(lambda: not desk.jobs.running, 60_000)
    (solved,) = desk.document.solves
    assert desk.session.history.undo_name == "Solve camera"
    assert solved.kind == "free"
    assert len(solved.frames) == 16
    assert 8 not in solved.track_ids
    panel = window.findChild(SolvePanel)
    assert panel is not None
    assert "16 cameras (free)" in panel.figures.text()
    assert panel.figures.text().startswith(("The camera holds", "Look at the warnings"))
    panel.curve.resize(200, 60)
    press = QPointF(198.0, 30.0)
    panel.curve.mousePressEvent(QMouseEvent(
        QEvent.Type.MouseButtonPress, press, press, Qt.MouseButton.LeftButton, Qt.MouseButton.LeftButton,
        Qt.KeyboardModifier.NoModifier))
    assert desk.workspace.frame == 1016
    words = [panel.advice.item(k).text() for k in range(panel.advice.count())]
    at = next(k for k, text in enumerate(words) if text.startswith("point 8 does not fit"))
    panel.advice.itemClicked.emit(panel.advice.item(at))
    assert desk.document.track_selection == (8,)
    track = desk.document.tracks[0]
    row = int(np.flatnonzero(solved.track_ids == 1)[0])
    told = pixels_of(solved, 1004, solved.points[row][None])
    assert told is not None
    assert np.abs(told[0] - track.points[list(track.frames).index(1004)]).max() < 3.0
    desk.set_craft("match")
    desk.edit("Select tracks", lambda document: document.replace(track_selection=(1,)))
    window.commands.run("match.cube")
    assert desk.document.solves[0].cubes == (1,)
    hand.painted()
    desk.edit("Select tracks", lambda document: document.replace(track_selection=(1, 2, 3)))
    window.commands.run("match.ground")
    assert desk.session.history.undo_name == "Set ground"
    assert np.ptp(desk.document.solves[0].points[np.isin(solved.track_ids, (1, 2, 3)), 1]) < 1e-9
    out = tmp_path / "out.usda"
    window.match.doors.export_camera(out)
    hand.until(lambda: not desk.jobs.running, 60_000)
    np.testing.assert_allclose(read_shot(out, None).focal, solved.focal, rtol=1e-5)
    for _ in range(6):  # ground, cube, three selections, the solve
        window.commands.run("edit.undo")
    assert not desk.document.solves


def test_too_few_tracks_are_refused_in_words(opened: Opened, tmp_path: Path) -> None:
    document = tracked(tmp_path)
    hand = opened(document.replace(tracks=document.tracks[:3]))
    hand.window.desk.set_craft("match")
    errors: list[object] = []
    hand.window.desk.failed.connect(lambda words, details: errors.append(words))
    hand.window.commands.run("match.solve")
    hand.until(lambda: not hand.window.desk.jobs.running, 60_000)
    assert not hand.window.desk.document.solves
    assert "needs 8" in str(errors[0])


def test_a_cancelled_solve_ends_soon_and_leaves_all_as_it_was(opened: Opened, tmp_path: Path) -> None:
    hand = opened(tracked(tmp_path, 200, 100))
    desk = hand.window.desk
    desk.set_craft("match")
    before = desk.document
    for patience in (0.05, 0.2, 0.4):  # into its search, and into what it adjusts
        hand.window.commands.run("match.solve")
        job = next(one for one in desk.jobs.running if one.name == "Solve camera")
        assert job.thread is not None
        time.sleep(patience)
        began = time.monotonic()
        desk.jobs.cancel(job)
        job.thread.join(5.0)
        assert not job.thread.is_alive()
        assert time.monotonic() - began < 1.0, patience  # 0.1 s on a machine that does nothing else
        hand.until(lambda: not desk.jobs.running, 5_000)
    assert desk.document is before
