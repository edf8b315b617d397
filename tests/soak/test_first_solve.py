"""The walk-through of docs/match.md from an unseen plate to a USD camera that holds a cube on the table."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import OpenImageIO as oiio
import pytest

from core.camera import project
from core.formats.shot_file import read_shot
from core.match.solved import row_of_frame
from docs.first_solve import ACROSS, FIRST, FRAMES, MARKS, PLATE, SIZE, STEPS, TABLE, camera, off_the_plane
from tests.window.alone import hand_at
from tests.window.conftest import OFFSCREEN, home  # noqa: F401 (fixture)


@pytest.mark.skipif(OFFSCREEN is not None, reason=str(OFFSCREEN))
@pytest.mark.timeout(200)
def test_the_first_solve_followed_literally(home: Path, qapp: object) -> None:  # noqa: F811
    hand = hand_at(None, SIZE)
    desk = hand.window.desk
    made: list[str] = []
    for step in STEPS:
        step.do(hand, home)
        made += step.made
        assert list(desk.session.history.names)[1:] == made, step.title
        if step.title.startswith("See"):
            assert desk.document.track_selection == (len(MARKS) + 1,)
    assert len(MARKS) + 1 not in desk.document.solves[0].track_ids  # what rolls by itself is no part of the set
    assert np.abs(off_the_plane(hand)).max() < 0.01  # metres, of a table of 1.2
    shot = read_shot(home / "table.usda", PLATE)
    ids = [int(i) for i in desk.document.solves[0].track_ids]
    rows = [ids.index(number) for number in range(1, len(TABLE) + 1)]
    apart = np.linalg.norm(shot.points[rows][:, None] - shot.points[rows], axis=2)
    true = np.linalg.norm(MARKS[: len(TABLE), None] - MARKS[: len(TABLE)], axis=2)
    assert np.abs(apart - true).max() < 0.015
    assert abs(apart[ACROSS[0] - 1, ACROSS[1] - 1] - true[ACROSS[0] - 1, ACROSS[1] - 1]) < 1e-6
    # a cube of 10 cm on the mark that was chosen is seen where the true camera sees it
    corners = np.array([(x, y, z) for x in (0.0, 0.1) for y in (0.0, 0.1) for z in (0.0, 0.1)])
    for frame in (FIRST, FIRST + FRAMES - 1):
        row = row_of_frame(desk.document.solves[0], frame)
        assert row is not None
        base = shot.points[rows[2]]
        told = shot.pixels(row, base + corners * (1.0, -1.0, -1.0))
        seen = project(camera(frame - FIRST), MARKS[2] + corners, *PLATE).xy
        assert np.linalg.norm(told - seen, axis=1).max() < 4.0
    film = cv2.VideoCapture(str(home / "table.mp4"))
    assert film.get(cv2.CAP_PROP_FRAME_COUNT) == FRAMES
    film.release()
    wide, tall = PLATE
    for way in ("undistort", "redistort"):  # of a lens that bends nothing
        places = oiio.ImageBuf(str(home / f"table.{way}.exr")).get_pixels(oiio.FLOAT)
        np.testing.assert_allclose(places[0, :, 0], (np.arange(wide) + 0.5) / wide, atol=1e-5)
        np.testing.assert_allclose(places[:, 0, 1], 1.0 - (np.arange(tall) + 0.5) / tall, atol=1e-5)
    hand.window.close_unasked()
