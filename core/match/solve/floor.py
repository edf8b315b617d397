"""The noise of tracks without a camera: over few frames all of them lie near a flat piece of three dimensions.

(After Tomasi and Kanade, "Shape and Motion from Image Streams under Orthography", 1992: the centred matrix of
measurements has rank 3.)
"""

from __future__ import annotations

import numpy as np

from core.match.solve.state import Array, Observations

WINDOW = 3
FEWEST = 10  # tracks of a window
SHARE = 0.6  # of the tracks that the flat piece is laid through, the nearest to it
ROUNDS = 6


def noise_floor(observations: Observations, frames: int) -> float | None:
    """Standard deviation of an axis in pixels, robust against tracks that slide; None where too few are seen together.
    """
    tracks = int(observations.track.max(initial=-1)) + 1
    table = np.full((frames, tracks, 2), np.nan)
    table[observations.frame, observations.track] = observations.xy
    found: list[float] = []
    for start in range(0, frames - WINDOW + 1, max(1, (frames - WINDOW + 1) // 64)):
        part = table[start : start + WINDOW]
        seen = np.isfinite(part[:, :, 0]).all(axis=0)
        rows = np.concatenate([part[:, seen, 0], part[:, seen, 1]])
        if rows.shape[1] >= FEWEST:
            found.append(_variance(rows))
    return float(np.sqrt(np.median(found))) if found else None


def _variance(rows: Array) -> float:
    """Variance of an axis about the best flat piece of 3 dimensions through columns of `rows` (2 w, n)."""
    good = np.ones(rows.shape[1], bool)
    for k in range(ROUNDS):
        near = rows[:, good]
        centre = near.mean(axis=1, keepdims=True)
        u = np.linalg.svd(near - centre, full_matrices=False)[0][:, :3]
        rest = rows - centre
        rest = ((rest - u @ (u.T @ rest)) ** 2).sum(axis=0)
        if k == ROUNDS - 1:
            break
        # first the nearest of them, then all that are as near as normal noise would be
        bound = np.quantile(rest, max(SHARE, 8.0 / len(rest))) if k < ROUNDS - 2 else 9.0 * np.median(rest)
        good = rest <= bound
    return float(rest[good].sum() / ((len(rows) - 3) * max(1, int(good.sum()) - 4)))
