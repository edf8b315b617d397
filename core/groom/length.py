"""Length: grow, shrink, set and scale strands; cut them at a line drawn on the screen or with a ring."""

from __future__ import annotations

import numpy as np
from numba import njit, types
from numpy.typing import ArrayLike, NDArray

from core.groom.collide import F32_3D
from core.groom.guides import Guides
from core.groom.region import View, editable, strand_freedom
from core.groom.resample import arc_fractions, arc_lengths, sample_at, stretched
from core.groom.rows import with_points

MINIMUM = 1e-4  # metres
Weights = NDArray[np.float64] | NDArray[np.float32] | None


def lengths(points: NDArray[np.float32]) -> NDArray[np.float64]:
    """Arc length of each strand (G, P, 3), metres."""
    return np.linalg.norm(np.diff(points.astype(np.float64), axis=1), axis=-1).sum(axis=1)


def grow(guides: Guides, amount: float, weights: Weights = None, minimum: float = MINIMUM) -> Guides:
    """Strands longer by `amount` metres (shorter when negative), times their weight (G,).

    Longer ones go on along their last direction, shorter ones lose their tips: what stays keeps its shape.
    """
    return _to_lengths(guides, lengths(guides.points) + amount, weights, minimum)


def set_length(guides: Guides, length: ArrayLike, weights: Weights = None, minimum: float = MINIMUM) -> Guides:
    """Strands of `length` metres (a number or (G,)), by their weight between what they are and that."""
    wanted = np.broadcast_to(np.asarray(length, np.float64), (len(guides),))
    return _to_lengths(guides, wanted, weights, minimum)


def scale_length(guides: Guides, factor: float, weights: Weights = None, minimum: float = MINIMUM) -> Guides:
    """Strands scaled about their roots, curls and all, by `factor` to the power of their weight times freedom."""
    amount = _amount(guides, weights)
    now = lengths(guides.points)
    scale = np.maximum(factor, 1e-9) ** amount
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = np.where(scale * now < minimum, np.minimum(1.0, minimum / now), scale)
    rows = np.flatnonzero((amount > 0.0) & (scale != 1.0) & (now > 0.0))
    x = guides.points[rows].astype(np.float64)
    points = x[:, :1] + (x - x[:, :1]) * scale[rows, None, None]
    return with_points(guides, rows, points.astype(np.float32))


def cut_at_line(
    guides: Guides, view: View, line: ArrayLike, mask: NDArray[np.bool_] | None = None, minimum: ArrayLike = MINIMUM
) -> Guides:
    """Strands lose what lies beyond the place where they first cross a line (K, 2) drawn in pixels.

    mask : (G,) bool, strands that may be cut, e.g. `facing`. minimum : metres that stay, a number or (G,).
    """
    path = np.ascontiguousarray(np.asarray(line, np.float64).reshape(-1, 2))
    return _cut(guides, _first_crossings(guides.points, *_screen(guides, view), path), mask, minimum)


def cut_with_ring(
    guides: Guides, view: View, path: ArrayLike, radius: float, mask: NDArray[np.bool_] | None = None,
    minimum: ArrayLike = MINIMUM,
) -> Guides:
    """Strands lose what lies beyond the place where they first enter a ring of `radius` pixels dragged along a path.

    minimum : metres that stay where the ring goes over the root, a number or (G,).
    """
    way = np.ascontiguousarray(np.asarray(path, np.float64).reshape(-1, 2))
    return _cut(guides, _first_entries(guides.points, *_screen(guides, view), way, float(radius)), mask, minimum)


def _amount(guides: Guides, weights: Weights) -> NDArray[np.float64]:
    amount = editable(guides) * strand_freedom(guides.hold)
    return amount if weights is None else amount * np.clip(np.asarray(weights, np.float64), 0.0, 1.0)


def _to_lengths(guides: Guides, wanted: NDArray[np.float64], weights: Weights, minimum: float) -> Guides:
    now = lengths(guides.points)
    amount = _amount(guides, weights)
    # a strand already below the minimum is not made longer by shrinking it
    target = np.maximum(now + amount * (wanted - now), np.minimum(minimum, now))
    rows = np.flatnonzero((amount > 0.0) & (np.abs(target - now) > 1e-9 * now) & (now > 0.0))
    return with_points(guides, rows, stretched(guides.points[rows], target[rows]))


def _cut(guides: Guides, at: NDArray[np.float64], mask: NDArray[np.bool_] | None, minimum: ArrayLike) -> Guides:
    now = arc_lengths(guides.points)[:, -1]
    may = editable(guides) & (strand_freedom(guides.hold) > 0.5)  # half held is held: scissors do not cut by halves
    if mask is not None:
        may &= mask
    rows = np.flatnonzero(may & np.isfinite(at) & (at < now))
    least = np.broadcast_to(np.asarray(minimum, np.float64), (len(guides),))
    keep = np.maximum(at[rows], np.minimum(least, now)[rows])
    points = guides.points[rows]
    return with_points(guides, rows, sample_at(points, arc_fractions(points) * keep[:, None]))


def _screen(guides: Guides, view: View) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    pixels, w = view.pixels(guides.points)
    return np.array(pixels, order="C"), np.array(w, order="C")


@njit(cache=True, nogil=True)
def _depth_fraction(s, w0, w1):  # type: ignore[no-untyped-def]
    """Fraction along a segment in space of fraction `s` along its picture (w: clip w of its ends)."""
    return s * w0 / (w1 * (1.0 - s) + s * w0)


@njit(cache=True, nogil=True)
def _segment_length(points, row, j):  # type: ignore[no-untyped-def]
    total = 0.0
    for k in range(3):
        d = np.float64(points[row, j + 1, k]) - points[row, j, k]
        total += d * d
    return np.sqrt(total)


@njit(
    types.float64[::1](F32_3D, types.float64[:, :, ::1], types.float64[:, ::1], types.float64[:, ::1]),
    cache=True, nogil=True,
)
def _first_crossings(points, pixels, w, line):  # type: ignore[no-untyped-def]
    """Arc length at which each strand first crosses the polyline on the screen, infinite where it does not."""
    out = np.full(points.shape[0], np.inf)
    for row in range(points.shape[0]):
        arc = 0.0
        for j in range(points.shape[1] - 1):
            length = _segment_length(points, row, j)
            if w[row, j] > 0.0 and w[row, j + 1] > 0.0:
                px, py = pixels[row, j, 0], pixels[row, j, 1]
                dx, dy = pixels[row, j + 1, 0] - px, pixels[row, j + 1, 1] - py
                first = np.inf
                for k in range(line.shape[0] - 1):
                    ex, ey = line[k + 1, 0] - line[k, 0], line[k + 1, 1] - line[k, 1]
                    cross = dx * ey - dy * ex
                    if cross == 0.0:
                        continue
                    qx, qy = line[k, 0] - px, line[k, 1] - py
                    s, t = (qx * ey - qy * ex) / cross, (qx * dy - qy * dx) / cross
                    if 0.0 <= s <= 1.0 and 0.0 <= t <= 1.0:
                        first = min(first, s)
                if first <= 1.0:
                    out[row] = arc + length * _depth_fraction(first, w[row, j], w[row, j + 1])
                    break
            arc += length
    return out


@njit(cache=True, nogil=True)
def _inside_ring(px, py, path, radius):  # type: ignore[no-untyped-def]
    for k in range(max(1, path.shape[0] - 1)):
        e = min(k + 1, path.shape[0] - 1)
        ax, ay = path[k, 0], path[k, 1]
        bx, by = path[e, 0] - ax, path[e, 1] - ay
        size = bx * bx + by * by
        t = 0.0
        if size > 0.0:
            t = min(max(((px - ax) * bx + (py - ay) * by) / size, 0.0), 1.0)
        dx, dy = px - ax - t * bx, py - ay - t * by
        if dx * dx + dy * dy <= radius * radius:
            return True
    return False


@njit(
    types.float64[::1](F32_3D, types.float64[:, :, ::1], types.float64[:, ::1], types.float64[:, ::1], types.float64),
    cache=True, nogil=True,
)
def _first_entries(points, pixels, w, path, radius):  # type: ignore[no-untyped-def]
    """Arc length at which each strand first enters the ring, to a 2^-30 of a quarter radius; infinite where never."""
    out = np.full(points.shape[0], np.inf)
    for row in range(points.shape[0]):
        arc = 0.0
        done = False
        for j in range(points.shape[1] - 1):
            length = _segment_length(points, row, j)
            if w[row, j] > 0.0 and w[row, j + 1] > 0.0:
                px, py = pixels[row, j, 0], pixels[row, j, 1]
                dx, dy = pixels[row, j + 1, 0] - px, pixels[row, j + 1, 1] - py
                pieces = int(min(1000.0, 1.0 + np.sqrt(dx * dx + dy * dy) / max(0.25 * radius, 1e-9)))
                for piece in range(pieces + 1):
                    s = piece / pieces
                    if _inside_ring(px + s * dx, py + s * dy, path, radius):
                        low, high = max(0.0, s - 1.0 / pieces), s
                        for _ in range(30):
                            middle = 0.5 * (low + high)
                            if _inside_ring(px + middle * dx, py + middle * dy, path, radius):
                                high = middle
                            else:
                                low = middle
                        out[row] = arc + length * _depth_fraction(low, w[row, j], w[row, j + 1])
                        done = True
                        break
            if done:
                break
            arc += length
    return out
