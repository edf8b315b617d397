"""The walk-through of docs/match.md is that of the program, and can be followed on a real plate."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from docs.first_track import SIZE, STEPS
from tests.window.alone import hand_at
from tests.window.conftest import OFFSCREEN, home  # noqa: F401 (fixture)


@pytest.mark.skipif(OFFSCREEN is not None, reason=str(OFFSCREEN))
@pytest.mark.timeout(200)
def test_the_first_tracks_followed_literally(home: Path, qapp: object) -> None:  # noqa: F811
    if "FILOPLUME_DATA" not in os.environ:
        pytest.skip("FILOPLUME_DATA names no folder of real plates")
    hand = hand_at(None, SIZE)
    desk = hand.window.desk
    made: list[str] = []
    for step in STEPS:
        step.do(hand, home)
        made += step.made
        assert list(desk.session.history.names)[1:] == made, step.title
        if step.title.startswith("See"):
            (worst,) = desk.document.track_selection
            assert (worst, desk.workspace.frame) == (7, 20.0)
    tracks = {track.id: track for track in desk.document.tracks}
    assert tracks[7].frames.tolist() == [16, 17, 18]
    assert tracks[11].frames.tolist() == [16, 17, 18, 19, 20]
    for number in (7, 11):  # neither turns by more than a camera in a hand, as the one did that the apple took
        assert np.abs(np.diff(tracks[number].points, 2, axis=0)).max() < 0.3
    hand.window.close_unasked()
