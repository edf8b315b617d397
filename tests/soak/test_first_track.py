"""The walk-through of docs/match.md is that of the program, and can be followed on a real plate."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from docs.first_track import SIZE, STEPS
from tests.window.alone import hand_at


@pytest.mark.timeout(200)
def test_the_first_tracks_followed_literally(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if "FILOPLUME_DATA" not in os.environ:
        pytest.skip("FILOPLUME_DATA names no folder of real plates")
    for name in ("STATE", "SETTINGS"):
        monkeypatch.setenv(f"FILOPLUME_{name}", str(tmp_path))
    hand = hand_at(None, SIZE)
    desk = hand.window.desk
    made: list[str] = []
    for step in STEPS:
        step.do(hand, tmp_path)
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
