"""The noise of tracks without a camera, told from few frames at a time.

Over three frames all tracks lie near a flat piece of three dimensions (after Tomasi and Kanade, "Shape and Motion from
Image Streams under Orthography", 1992: the centred matrix of measurements has rank 3); and how they speed up is nearly
a quadratic of where they are in the picture, as a turning camera makes it. What is left of either is noise and what the
model lacks, so the smaller of both is the better answer: a fast pan bends the first, a shaken path the second. Noise
that goes on from frame to frame hides from the second; how it grows with the step between frames gives it away.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from core.match.solve.state import Array, Observations

WINDOW = 3
MOST = 32  # windows
FEWEST = 10  # tracks of a window
SHARE = 0.6  # of the tracks that the model is laid through, the nearest to it
ROUNDS = 6
QUADRATIC = 6  # numbers of a quadratic of two coordinates
MOST_OFF = 12.0  # of the median square: more than three standard deviations
LITTLE = 1e-9 * np.eye(QUADRATIC)  # for tracks on one line
CORRELATION = np.linspace(0.0, 0.95, 39)  # of noise from one frame to the next


def noise_floor(observations: Observations, frames: int) -> float | None:
    """Standard deviation of an axis in pixels, robust against tracks that slide; None where too few are seen together.
    """
    tracks = int(observations.track.max(initial=-1)) + 1
    table = np.full((frames, tracks, 2), np.nan)
    table[observations.frame, observations.track] = observations.xy
    flat = _median(table, 1, FEWEST, _flat_variance)
    if flat is None:
        return None
    steady = [_median(table, step, 3 * QUADRATIC, _steady_variance) for step in (1, 2)]
    if steady[0] is None or steady[0] >= flat:
        return float(np.sqrt(flat))
    growth = 1.0 if steady[1] is None else steady[1] / max(steady[0], 1e-30)
    # of second differences over one frame and over two, of an autoregressive noise of variance 1
    one, two = (6.0 - 8.0 * rho + 2.0 * rho**2 for rho in (CORRELATION, CORRELATION**2))
    hidden = float(np.interp(growth, two / one, one / 6.0, right=0.0))
    return float(np.sqrt(flat if hidden == 0.0 else min(flat, steady[0] / hidden)))


def _median(table: Array, step: int, fewest: int, variance: Callable[[Array], float]) -> float | None:
    """Median variance over windows of three frames `step` apart in which enough tracks are seen."""
    found = []
    last = len(table) - 2 * step
    for start in range(0, last, max(1, last // MOST)):
        part = table[start : start + 2 * step + 1 : step]
        seen = np.isfinite(part[:, :, 0]).all(axis=0)
        if int(seen.sum()) >= fewest:
            found.append(variance(part[:, seen]))
    return float(np.median(found)) if found else None


def _flat_variance(part: Array) -> float:
    """Variance of an axis about the best flat piece of 3 dimensions through places (w, n, 2)."""
    rows = np.concatenate([part[:, :, 0], part[:, :, 1]])
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


def _steady_variance(part: Array) -> float:
    """Variance of an axis from second differences of places (3, n, 2), less a quadratic of the place."""
    unit = (part[1] - part[1].mean(axis=0)) / np.maximum(part[1].std(axis=0), 1e-9)
    x, y = unit.T
    basis = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
    bend = part[0] - 2.0 * part[1] + part[2]
    good = np.ones(len(x), bool)
    for k in range(ROUNDS):
        near = basis[good]
        rest = bend - basis @ np.linalg.solve(near.T @ near + LITTLE, near.T @ bend[good])
        square = (rest**2).sum(axis=1)
        if k == ROUNDS - 1:
            break
        share = max(SHARE, 2.0 * QUADRATIC / len(x))
        bound = np.quantile(square, share) if k < ROUNDS - 2 else MOST_OFF * np.median(square)
        good = square <= bound
    return float(square[good].sum() / (12.0 * max(1, int(good.sum()) - QUADRATIC)))
