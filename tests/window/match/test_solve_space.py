"""The solved camera in space beside the plate, the table of what to mend, the movie to judge by."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest

from app.window.match.check_movie import marked
from app.window.match.solve_table import worst_of
from core.document import Document
from core.match.solved import SolvedCamera, SolveSettings, cube_edges, pixels_of
from core.match.solved_scene import frustum_up, misses, path_up, points_up
from tests.window.conftest import Opened
from tests.window.match.test_solve_window import tracked
from tools.match_edits import set_tracks
from tools.solve_edits import put_solve, solved_camera, tracks_to_solve

LEFT, SHIFT, NONE = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.ShiftModifier, Qt.KeyboardModifier.NoModifier


@pytest.fixture(scope="module")
def solved(tmp_path_factory: pytest.TempPathFactory) -> Document:
    """A plate whose camera is solved; track 8 slides away."""
    document = tracked(tmp_path_factory.mktemp("plate"))
    return put_solve(document, solved_camera(document.plates[0], tracks_to_solve(document, 1), SolveSettings()))


def solve_of(document: Document) -> SolvedCamera:
    return document.solves[0]


def test_the_picture_in_space_is_what_the_camera_sees(solved: Document) -> None:
    one = solve_of(solved)
    corners = frustum_up(one, int(one.frames[3]))
    assert corners is not None
    np.testing.assert_allclose(corners[0], path_up(one)[3], atol=1e-12)
    back = pixels_of(one, int(one.frames[3]), corners[1:] * (1.0, -1.0, -1.0))
    wide, tall = one.size
    assert back is not None
    np.testing.assert_allclose(
        back, [[-0.5, -0.5], [wide - 0.5, -0.5], [wide - 0.5, tall - 0.5], [-0.5, tall - 0.5]], atol=1e-6)


def test_the_table_has_the_worst_first_with_their_share(solved: Document) -> None:
    one, rows = solve_of(solved), worst_of(solve_of(solved), solved)
    tracks = [row for row in rows if row.track_id]
    errors = [row.error for row in tracks]
    assert errors == sorted(errors, reverse=True)
    assert errors[0] == one.errors.max()
    track = next(t for t in solved.tracks if t.id == tracks[0].track_id)
    _, off = misses(one, track)
    assert np.sqrt((off**2).mean()) == pytest.approx(errors[0], rel=0.02)
    everything = sum((misses(one, t)[1] ** 2).sum() for t in solved.tracks if t.id in one.track_ids)
    assert tracks[0].share == pytest.approx((off**2).sum() / everything, rel=0.05)
    assert all(row.sigma > 0.0 for row in tracks)


def test_the_movie_has_the_cube_where_the_camera_sees_it(solved: Document) -> None:
    one = solve_of(solved)
    cubed = one.replace(cubes=(int(one.track_ids[0]),))
    wide, tall = one.size
    grey = np.full((tall, wide, 3), 90, np.uint8)
    frame = int(one.frames[5])
    changed = (marked(grey, solved.plates[0], cubed, frame) != marked(grey, solved.plates[0], one, frame)).any(axis=2)
    told = pixels_of(cubed, frame, cube_edges(cubed, int(one.track_ids[0])).reshape(-1, 3))
    assert told is not None
    inside = ((told > 4) & (told < np.array([wide, tall]) - 5)).all(axis=1)
    x, y = np.rint(told[inside]).astype(int).T
    assert changed[y, x].mean() > 0.9
    low, high = told.min(axis=0) - 4.0, told.max(axis=0) + 4.0
    ys, xs = np.nonzero(changed)
    assert (xs >= low[0]).all()
    assert (xs <= high[0]).all()
    assert (ys >= low[1]).all()
    assert (ys <= high[1]).all()


def test_points_are_taken_in_space_and_the_solve_follows_edits(opened: Opened, solved: Document) -> None:
    hand = opened(solved)
    window, desk = hand.window, hand.window.desk
    desk.set_craft("match")
    QTest.mouseClick(window.solve_panel.space, LEFT)
    space = window.solve_space
    hand.until(space.isVisible)
    hand.rest()
    one, (xy, _) = solve_of(solved), space.places()
    apart = np.linalg.norm(xy[:, None] - xy, axis=2) + 1e9 * np.eye(len(xy))
    first, second = np.argsort(-apart.min(axis=1))[:2]  # those that stand alone
    for row, held in ((first, NONE), (second, SHIFT)):
        QTest.mouseClick(space, LEFT, held, QPoint(*np.rint(xy[row]).astype(int).tolist()))
    assert desk.document.track_selection == (int(one.track_ids[first]), int(one.track_ids[second]))
    before = space.camera
    middle = np.median(points_up(one)[[first, second]], axis=0)
    space._move("orbit", 40.0, 0.0)
    far = [np.linalg.norm(camera.position - middle) for camera in (before, space.camera)]
    assert far[0] == pytest.approx(far[1])
    assert np.linalg.norm(before.position - space.camera.position) > 0.1 * far[0]

    window.match.solving.set_settings(SolveSettings(focal=float(one.focal[0]), again=True))
    window.match.solving._stale.setInterval(0)
    desk.edit("Hide tracks", set_tracks, (int(one.track_ids[0]),), hidden=True)
    hand.until(lambda: desk.session.history.undo_name == "Solve camera", 60_000)
    assert int(one.track_ids[0]) not in solve_of(desk.document).track_ids
    for _ in range(2):
        window.commands.run("edit.undo")
    assert not window.match.solving._stale.isActive()  # or redo would go
    assert desk.session.history.redo_name == "Hide tracks"
    window.commands.run("match.solve")
    job = window.match.solving.job
    assert job is not None
    desk.jobs.cancel(job)
    assert not window.match.solving.running
    hand.until(lambda: not desk.jobs.running, 60_000)
    assert desk.session.history.redo_name == "Hide tracks"
