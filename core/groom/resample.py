"""Strands resampled by arc length: cut, extended along their last direction, or given another number of points."""

from __future__ import annotations

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from core.groom.collide import F32_3D
from core.groom.guides import Guides
from core.record import freeze


def arc_lengths(points: NDArray[np.float32]) -> NDArray[np.float64]:
    """Arc length from the root to each point, (G, P) float64, of strands (G, P, 3)."""
    steps = np.linalg.norm(np.diff(points.astype(np.float64), axis=1), axis=-1)
    return np.concatenate([np.zeros((len(points), 1)), np.cumsum(steps, axis=1)], axis=1)


def arc_fractions(points: NDArray[np.float32]) -> NDArray[np.float64]:
    """Arc length over the length of the strand, (G, P), 0 at the root and 1 at the tip (evenly where it has none)."""
    arcs = arc_lengths(points)
    even = np.broadcast_to(np.linspace(0.0, 1.0, arcs.shape[1]), arcs.shape)
    total = arcs[:, -1:]
    return np.where(total > 0.0, arcs / np.where(total > 0.0, total, 1.0), even)


def sample_at(points: NDArray[np.float32], arcs: NDArray[np.float64]) -> NDArray[np.float32]:
    """Points at the given arc lengths on strands, piecewise linear; beyond the tip along the last segment.

    Parameters
    ----------
    points : (G, P, 3) float32. arcs : (G, Q) metres from the root, each row growing.

    Returns
    -------
    (G, Q, 3) float32. Arc length 0 gives the root to the bit.
    """
    out = np.empty((*arcs.shape, 3), np.float32)
    _sample_rows(np.ascontiguousarray(points), np.array(arcs, np.float64, order="C"), out)
    return out


def stretched(points: NDArray[np.float32], lengths: NDArray[np.float64]) -> NDArray[np.float32]:
    """Strands shortened or extended along their course to the given lengths (G,), points spread as before.

    The shape that stays is kept; directions are resampled and laid end to end so that the lengths are exact.
    """
    fractions = arc_fractions(points)
    wanted = fractions * lengths[:, None]
    sampled = sample_at(points, wanted).astype(np.float64)
    d = np.diff(sampled, axis=1)
    size = np.linalg.norm(d, axis=-1, keepdims=True)
    d = np.where(size > 0.0, d / np.where(size > 0.0, size, 1.0), 0.0) * np.diff(wanted, axis=1)[..., None]
    out = np.empty(points.shape, np.float32)
    out[:, 0] = points[:, 0]
    out[:, 1:] = points[:, :1].astype(np.float64) + np.cumsum(d, axis=1)
    return out


def with_point_count(guides: Guides, count: int) -> Guides:
    """The guides with `count` points each, evenly spread along their length; hold is carried over.

    This changes every guide, frozen and held ones too: all guides of a groom have the same number of points.
    """
    if count < 2:
        raise ValueError("guides need at least 2 points")
    if count == guides.points.shape[1]:
        return guides
    arcs = arc_lengths(guides.points)
    wanted = arcs[:, -1:] * np.linspace(0.0, 1.0, count)
    points = sample_at(guides.points, wanted)
    at = np.linspace(0.0, 1.0, count)
    fractions = arc_fractions(guides.points)
    hold = np.empty((len(guides), count), np.float32)
    for row in range(len(guides)):
        hold[row] = np.interp(at, fractions[row], guides.hold[row])
    hold[hold > 1.0 - 1e-5] = 1.0  # locked stays locked
    return guides.replace(points=freeze(points), hold=freeze(hold))


@njit(types.void(F32_3D, types.float64[:, ::1], types.float32[:, :, ::1]), cache=True, nogil=True)
def _sample_rows(points, arcs, out):  # type: ignore[no-untyped-def]
    count = points.shape[1]
    for row in range(points.shape[0]):
        j = 0
        before = 0.0
        dx = np.float64(points[row, 1, 0]) - points[row, 0, 0]
        dy = np.float64(points[row, 1, 1]) - points[row, 0, 1]
        dz = np.float64(points[row, 1, 2]) - points[row, 0, 2]
        length = np.sqrt(dx * dx + dy * dy + dz * dz)
        ex, ey, ez = dx, dy, dz  # the last direction that has one
        for i in range(arcs.shape[1]):
            while j < count - 2 and (arcs[row, i] > before + length or length == 0.0):
                before += length
                j += 1
                dx = np.float64(points[row, j + 1, 0]) - points[row, j, 0]
                dy = np.float64(points[row, j + 1, 1]) - points[row, j, 1]
                dz = np.float64(points[row, j + 1, 2]) - points[row, j, 2]
                length = np.sqrt(dx * dx + dy * dy + dz * dz)
                if length > 0.0:
                    ex, ey, ez = dx, dy, dz
            scale = np.sqrt(ex * ex + ey * ey + ez * ez)
            t = (arcs[row, i] - before) / scale if scale > 0.0 else 0.0
            out[row, i, 0] = points[row, j, 0] + t * ex
            out[row, i, 1] = points[row, j, 1] + t * ey
            out[row, i, 2] = points[row, j, 2] + t * ez
