"""The page of a tracking run: what an artist is to look at first stands first."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from app.track_report import write_report
from core.image.plate import Plate
from core.match.track import TrackSettings, keyed_track
from core.record import freeze


def test_a_track_that_is_unlike_its_key_stands_before_one_that_is_a_little_unsure(tmp_path: Path) -> None:
    rows = np.column_stack((np.arange(11.0, 21.0), np.full((10, 2), 50.0)))
    sure, unsure, slipped = (keyed_track(n, name, rows, 1) for n, name in enumerate(("sure", "unsure", "slipped"), 1))
    unsure = unsure.replace(covariance=freeze(np.tile([0.04, 0.0, 0.04], (10, 1))))
    slipped = slipped.replace(score=freeze(np.where(np.arange(10) == 6, 0.4, 1.0)))
    film = Plate(id=1, name="film", path="film.####.png", first=11, last=20, width=200, height=100)
    write_report(tmp_path / "page.html", film, (sure, unsure, slipped), TrackSettings(), lambda frame: None, [])
    page = (tmp_path / "page.html").read_text("utf-8")
    assert page.index(">slipped<") < page.index(">unsure<") < page.index(">sure<")
    assert "score 0.40<br>frame 17" in page
