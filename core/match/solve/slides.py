"""Tracks that slide slowly and straight: each residual stays small, but along the shot they have a slope.

A score test for every track: would a drift at an even pace explain its residuals, beyond what moving its point does?
What slides along the epipolar lines looks like another depth, and harms no camera.
"""

from __future__ import annotations

import numpy as np

from core.match.solve.state import Array, Flags, Observations, State, projected, residuals, whitened

SURE = 30.0  # gain of two parameters in variances: one track in three million by chance
MEDIAN = 1.386  # of the gain of two parameters where nothing slides
FEWEST = 8  # observations of a track
STEP = 1e-5  # of the depth
NEAR = 1e-6  # of the median depth


def drift_gains(state: State, observations: Observations, tracks: int, sigma: float) -> Array:
    """(tracks,) by how many variances the squares of a track fall when it may drift at an even pace.

    sigma : standard deviation of the whitened residuals of an axis.
    """
    if not len(observations.track):
        return np.zeros(tracks)
    count = np.bincount(observations.track, minlength=tracks)
    frame = observations.frame.astype(np.float64)
    mean = np.bincount(observations.track, weights=frame, minlength=tracks) / np.maximum(count, 1)
    span = np.zeros(tracks)
    away = frame - mean[observations.track]
    np.maximum.at(span, observations.track, np.abs(away))
    pace = away / np.maximum(span[observations.track], 1.0)
    points = state.points[observations.track]
    here, depth = projected(state, observations.frame, points)
    ahead_of = depth > NEAR * np.median(np.abs(depth))
    step = STEP * np.maximum(np.abs(depth), 1e-9)
    slope = np.empty((len(frame), 2, 6))  # of the point, of the drift, and the residual itself
    for k, axis in enumerate(np.eye(3)):
        ahead, _ = projected(state, observations.frame, points + step[:, None] * axis)
        slope[:, :, k] = whitened(observations, (ahead - here) / step[:, None])
    for k, side in enumerate(np.eye(2)):
        slope[:, :, 3 + k] = whitened(observations, pace[:, None] * side)
    slope[:, :, 5] = residuals(state, observations)
    slope[~ahead_of | ~np.isfinite(slope).all(axis=(1, 2))] = 0.0  # behind a camera nothing is told
    order = np.argsort(observations.track, kind="stable")
    first = np.flatnonzero(np.diff(observations.track[order], prepend=-1))
    sums = np.add.reduceat(np.matmul(slope.transpose(0, 2, 1), slope)[order], first, axis=0)
    whole = np.zeros((tracks, 6, 6))
    whole[observations.track[order][first]] = sums
    matrix, right = whole[:, :5, :5], whole[:, :5, 5]
    inner = np.linalg.pinv(matrix[:, :3, :3], rcond=1e-10, hermitian=True)
    across = matrix[:, 3:, :3] @ inner
    left = matrix[:, 3:, 3:] - across @ matrix[:, :3, 3:]
    score = right[:, 3:] - np.einsum("pij,pj->pi", across, right[:, :3])
    values, axes = np.linalg.eigh(left)
    along = np.einsum("pji,pj->pi", axes, score)
    told = values > 1e-3 * np.maximum(np.trace(matrix[:, 3:, 3:], axis1=1, axis2=2), 1e-30)[:, None]
    gains = np.where(told, along**2 / np.where(told, values, 1.0), 0.0).sum(axis=1) / max(sigma, 1e-12) ** 2
    return np.where(count >= FEWEST, gains, 0.0)


def sliding(state: State, observations: Observations, tracks: int, sigma: float) -> Flags:
    """(tracks,) those that drift beyond doubt. Where something is wrong with the lens all tracks seem to, and none is
    told apart."""
    gains = drift_gains(state, observations, tracks, sigma)
    seen = gains[gains > 0.0]
    usual = max(1.0, float(np.median(seen)) / MEDIAN) if len(seen) else 1.0
    return np.asarray(gains > SURE * usual)


def correlation(state: State, observations: Observations) -> float:
    """Of the residuals of a track from one frame to the next, 0 where they are noise that is new in every frame.

    What is missing in the model shows here before it shows in the size of residuals; so does a tracker that wanders.
    """
    order = np.lexsort((observations.frame, observations.track))
    rows = observations.take(order)
    error = residuals(state, rows)
    next_to = (np.diff(rows.track) == 0) & (np.diff(rows.frame) == 1)
    whole = float((error**2).sum()) / max(1, len(error))
    if not next_to.any() or whole <= 0.0:
        return 0.0
    return float((error[:-1] * error[1:]).sum(axis=1)[next_to].mean()) / whole
