"""From tracks to observations; refused where no camera could come of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from core.errors import UserError
from core.match.solve.state import Observations, Rows
from core.match.solve.views import Views
from core.match.track import HAND, Track

LEAST_TRACKS, LEAST_PICKS = 8, 6  # of a shot; of photographs
TOGETHER = 2e-3  # of the width of the picture: tracks so near to each other are one place
ON_LINE = 1e-3  # of the width of the picture: tracks so near to a line lie on it
ROOM, OUTSIDE = 0.1, 0.1  # of the size beyond the picture; share of the tracks that may be farther out


def observations_of(tracks: Sequence[Track]) -> tuple[Observations, Rows]:
    """Observations of tracks and the numbers of their frames, (F,) rising.

    The covariance of each is that of the tracker; where none is known (keys of a hand, other programs) it is 1 px^2.
    """
    frames = np.unique(np.concatenate([t.frames for t in tracks])) if tracks else np.zeros(0, np.int32)
    rows, numbers, xy, covariance = [], [], [], []
    for k, track in enumerate(tracks):
        rows.append(np.searchsorted(frames, track.frames))
        numbers.append(np.full(len(track.frames), k))
        xy.append(track.points)
        covariance.append(track.own)
    if not rows:
        raise UserError("There are no tracks to solve from; track some points first.")
    order = np.argsort(np.concatenate(rows), kind="stable")
    c = np.concatenate(covariance)[order]
    hand = c[:, 0] <= 4.0 * HAND
    if hand.mean() > 0.5:
        c[:] = [1.0, 0.0, 1.0]
    else:
        c[hand] = np.median(c[~hand], axis=0)
    c[:, [0, 2]] = np.maximum(c[:, [0, 2]], 1e-4)
    limit = 0.95 * np.sqrt(c[:, 0] * c[:, 2])
    c[:, 1] = np.clip(c[:, 1], -limit, limit)
    # root U (upper) of the inverse covariance, U^T U = C^-1, in closed form
    rest = c[:, 0] - c[:, 1] ** 2 / c[:, 2]
    u00 = 1.0 / np.sqrt(rest)
    root = np.stack([u00, -c[:, 1] / c[:, 2] * u00, 1.0 / np.sqrt(c[:, 2])], axis=1)
    return Observations(
        np.concatenate(rows)[order].astype(np.int32), np.concatenate(numbers)[order].astype(np.int32),
        np.ascontiguousarray(np.concatenate(xy)[order], np.float64), np.ascontiguousarray(root),
    ), frames.astype(np.int32)


def check_observations(observations: Observations, frames: Rows, tracks: int, views: Views) -> None:
    """Raise UserError with the reason where no camera could come of the observations of `tracks` tracks."""
    if len(frames) < 2:
        raise UserError("The tracks are on one frame only; a camera needs two frames at least, better twenty.")
    if not np.isfinite(observations.xy).all():
        raise UserError("The tracks hold places that are not numbers; track them again.")
    long = np.bincount(observations.track, minlength=tracks) >= 2
    least = LEAST_PICKS if views.alone.all() else LEAST_TRACKS
    if long.sum() < least:
        raise UserError(
            f"{int(long.sum())} tracks are seen on two frames or more; a camera needs {least} at least, better "
            "twenty, spread over the picture and over near and far."
        )
    if len(views.cameras) == 1:
        _check_places(observations, views.cameras[0].size)


def _check_places(observations: Observations, size: tuple[int, int]) -> None:
    """Raise UserError when tracks are not of a picture of `size`, or all at one place of it."""
    off = np.array(size) * ROOM
    outside = ((observations.xy < -off) | (observations.xy > np.array(size) + off)).any(axis=1)
    if outside.mean() > OUTSIDE:
        raise UserError(
            f"{max(1, round(100 * outside.mean()))} % of the tracks lie outside of a plate of {size[0]} x {size[1]} "
            "pixels; give the size of their own plate."
        )
    count = np.maximum(np.bincount(observations.frame), 1)
    away = observations.xy.copy()
    for axis in range(2):
        away[:, axis] -= (np.bincount(observations.frame, away[:, axis]) / count)[observations.frame]
    spread = np.sqrt(np.mean(away**2, axis=0))
    xx, xy, yy = (np.bincount(observations.frame, away[:, i] * away[:, j]) / count for i, j in ((0, 0), (0, 1), (1, 1)))
    across = np.sqrt(np.maximum(0.5 * (xx + yy) - np.hypot(0.5 * (xx - yy), xy), 0.0))  # of the line through each frame
    if np.hypot(*spread) < TOGETHER * size[0]:
        raise UserError(
            f"The tracks all lie within {4.0 * np.hypot(*spread):.1f} px of each other; a camera needs them spread "
            "over the picture."
        )
    if np.median(across[count > 2]) < ON_LINE * size[0]:
        raise UserError("The tracks all lie on one line of the picture; a camera needs them spread over it.")
