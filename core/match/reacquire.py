"""A pattern that was lost, looked for by a hand: around a click, by the template of the nearest key."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.match.runs import Ranges, Runs
from core.match.track import Track, TrackSettings
from core.workers import serial_ranges

SLACK = 0.3  # of likeness: how much less than the settings ask for is believed where a hand pointed


def find_again(
    track: Track,
    key_image: NDArray[np.float32],
    key_frame: int,
    image: NDArray[np.float32],
    near: tuple[float, float],
    *,
    settings: TrackSettings | None = None,
    ranges: Ranges = serial_ranges,
) -> tuple[NDArray[np.float64], float] | None:
    """Where the pattern of the key at `key_frame` lies in another frame, within the search around `near`.

    key_image, image : (H, W, C) float32, what tracking sees. Returns the place (2,) and the score, or None.
    The edit that follows is ``key_track``: the place becomes a key, and the track is followed from there.
    """
    at = np.flatnonzero(track.keys[:, 0] == key_frame)
    if not len(at):
        raise ValueError(f"track {track.name} has no key at frame {key_frame}")
    given = settings if settings is not None else track.settings or TrackSettings()
    runs = Runs(given.replace(least_score=max(0.0, given.least_score - SLACK)), key_image.shape[2], ranges)
    shape = None if track.shape is None else (track.shape, track.shape_smooth)
    row = runs.begin(
        key_image, track.keys[at, 1:].copy(), np.array([key_frame + 1]), None, np.array([track.offset]), [shape]
    )
    if not runs.alive[row[0]]:
        return None
    runs.motion[row, :2] = np.asarray(near) - track.keys[at, 1:]
    seen = runs.step(image)
    return (seen.points[0], float(seen.score[0])) if len(seen.rows) else None
