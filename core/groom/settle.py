"""The last look at a coat before it leaves: no hair runs inside the animal.

First quickly by the distance field, then, for the few hairs in creases finer than its grid, exactly.
"""

from __future__ import annotations

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from core.groom.chain import rebuild_chain
from core.groom.collide import F64_1D, collide_chain
from core.mesh.bvh import closest_points
from core.mesh.distance_field import DistanceField, sample_points
from core.mesh.signed_distance import SignedSkin, signed_distances
from core.workers import Workers

LIFTS, SHRINKS = 6, 8
NEAR_CELLS = 0.75  # the field is exact to much less than this
F32_SOA = types.Array(types.float32, 3, "C", readonly=True)


@njit(
    types.void(types.int64, types.int64, types.float32[:, :, ::1], F32_SOA, F64_1D, types.float64, types.float64,
               types.bool_[::1]),
    cache=True, nogil=True, error_model="numpy",
)
def _settle_rows(start, stop, hairs, values, origin, cell, clearance, moved):  # type: ignore[no-untyped-def]
    count = hairs.shape[2]
    x, q, lengths = np.empty((count, 3)), np.empty((count - 1, 3)), np.empty(count - 1)
    for row in range(start, stop):
        total = 0.0
        for k in range(count):
            for c in range(3):
                x[k, c] = hairs[row, c, k]
        for k in range(count - 1):
            d2 = 0.0
            for c in range(3):
                q[k, c] = x[k + 1, c] - x[k, c]
                d2 += q[k, c] * q[k, c]
            lengths[k] = np.sqrt(d2)
            total += lengths[k]
            for c in range(3):
                q[k, c] = q[k, c] / lengths[k] if lengths[k] > 0.0 else 0.0
        if total <= 0.0:
            continue
        gap = min(clearance, 0.05 * total)
        if collide_chain(x, q, lengths, 0, values, origin, cell, gap, False) >= 0.25 * gap * lengths[0] / total:
            continue
        collide_chain(x, q, lengths, 0, values, origin, cell, gap, True)
        rebuild_chain(x, q, lengths, 0)
        moved[row] = True
        for k in range(1, count):
            for c in range(3):
                hairs[row, c, k] = x[k, c]


def settle(
    hairs: NDArray[np.float32], field: DistanceField, clearance: float | None = None, workers: Workers | None = None
) -> int:
    """Lift hairs out of the skin in place, lengths kept; returns how many were touched.

    Parameters
    ----------
    hairs : (N, 3, P) float32, object space at rest, written to.
    field : signed distance to the skin at rest.
    clearance : metres kept from the skin away from the root; half a cell of the field when None.
    """
    moved = np.zeros(len(hairs), np.bool_)
    gap = 0.5 * field.cell if clearance is None else clearance

    def rows(start: int, stop: int) -> None:
        _settle_rows(start, stop, hairs, field.values, field.origin, field.cell, gap, moved)

    if workers is None:
        rows(0, len(hairs))
    else:
        workers.ranges(len(hairs), rows)
    return int(moved.sum())


def settle_exactly(
    hairs: NDArray[np.float32], field: DistanceField, skin: SignedSkin, tolerance: float,
    workers: Workers | None = None,
) -> int:
    """Lift the last hairs, where the grid of the field was too coarse, by exact distances; returns how many.

    Points of a segment inside the skin go to just outside the closest place of it. A hair that will not come free
    (in a crease narrower than the hair is long) is shortened towards its root, at the very last to nothing.

    Parameters
    ----------
    hairs : (N, 3, P) float32, written to. tolerance : metres below the skin that still count as on it.
    """
    bad = np.flatnonzero(inside_segments(hairs, field, skin, tolerance, workers).any(axis=1))
    if not len(bad):
        return 0
    part = np.ascontiguousarray(np.swapaxes(hairs[bad], 1, 2)).astype(np.float64)
    gap = 4.0 * tolerance
    rows = np.arange(len(bad))
    for attempt in range(LIFTS + SHRINKS):
        if attempt >= LIFTS:
            keep = 0.0 if attempt == LIFTS + SHRINKS - 1 else 0.7
            part[rows] = part[rows, :1] + keep * (part[rows] - part[rows, :1])
        out = part[rows]
        middle = _lift(0.5 * (out[:, 1:] + out[:, :-1]), skin, gap, workers)
        out[:, 1:] += middle
        out[:, 1:-1] += middle[:, 1:]
        out[:, 1:] += _lift(out[:, 1:], skin, gap, workers)
        part[rows] = out
        hairs[bad[rows]] = np.swapaxes(out, 1, 2)
        still = inside_segments(hairs[bad[rows]], field, skin, tolerance, workers).any(axis=1)
        rows = rows[still]
        if not len(rows):
            break
    return len(bad)


def _lift(points: NDArray[np.float64], skin: SignedSkin, gap: float, workers: Workers | None) -> NDArray[np.float64]:
    """Motions that bring points which are inside (or closer than half the gap) to `gap` outside; zero elsewhere."""
    flat = np.ascontiguousarray(points.reshape(-1, 3), np.float32)
    depth = signed_distances(skin, flat, workers=workers)
    triangle, weights, _ = closest_points(skin.bvh, flat, workers=workers)
    slot = np.empty(len(skin.bvh.order), np.int64)
    slot[skin.bvh.order] = np.arange(len(slot))
    corners = skin.bvh.corners[slot[triangle]].reshape(-1, 3, 3).astype(np.float64)
    on_skin = np.einsum("nk,nkc->nc", weights, corners)
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-30)
    motion = on_skin + gap * outward - flat
    motion[depth > 0.5 * gap] = 0.0
    return motion.reshape(points.shape)


def inside_segments(
    hairs: NDArray[np.float32], field: DistanceField, skin: SignedSkin, tolerance: float,
    workers: Workers | None = None, chunk: int = 20_000,
) -> NDArray[np.bool_]:
    """Which segments (N, P - 1) of the hairs (N, 3, P) run inside a closed skin deeper than `tolerance` metres.

    The ends and the middle of every segment are measured: by the field far from the skin, exactly near it.
    A root lies on the skin by definition, so of the first segment only the middle and the far end count.
    """
    inside = np.zeros((len(hairs), max(hairs.shape[2] - 1, 0)), np.bool_)
    for start in range(0, len(hairs), chunk):
        part = np.ascontiguousarray(np.swapaxes(hairs[start : start + chunk], 1, 2))
        ends = _below(part[:, 1:], field, skin, tolerance, workers)
        halves = _below(0.5 * (part[:, 1:] + part[:, :-1]), field, skin, tolerance, workers)
        inside[start : start + chunk] = ends | halves
        inside[start : start + chunk, 1:] |= ends[:, :-1]
    return inside


def _below(
    points: NDArray[np.float32], field: DistanceField, skin: SignedSkin, tolerance: float, workers: Workers | None
) -> NDArray[np.bool_]:
    flat = np.ascontiguousarray(points, np.float32).reshape(-1, 3)
    below = np.zeros(len(flat), np.bool_)
    near = np.flatnonzero(sample_points(field, flat) < NEAR_CELLS * field.cell)
    below[near] = signed_distances(skin, flat[near], workers=workers) < -tolerance
    return below.reshape(points.shape[:2])
