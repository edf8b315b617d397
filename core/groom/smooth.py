"""Smooth: bends even out along a strand and between neighbours; lengths and roots stay."""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from core.groom.chain import first_free, read_chain, rebuild_chain, write_chain
from core.groom.collide import F32_2D, F32_3D, Ranges, push_out
from core.groom.guides import Guides
from core.groom.region import editable, neighbours
from core.mesh.distance_field import DistanceField
from core.record import freeze
from core.workers import serial_ranges


def smooth(
    guides: Guides,
    *,
    along: float = 0.5,
    across: float = 0.0,
    iterations: int = 4,
    weights: NDArray[np.float64] | None = None,
    near: NDArray[np.int64] | None = None,
    field: DistanceField | None = None,
    ranges: Ranges = serial_ranges,
) -> Guides:
    """Even out the directions of segments.

    Parameters
    ----------
    along : 0 .. 1, toward the segments before and after on the same strand.
    across : 0 .. 1, toward the same segments of the neighbours, turned from their skin normal to this one's.
    iterations : passes of both.
    weights : (G, P) 0 .. 1, what a brush reaches; everything when None.
    near : (G, K) rows of each strand's neighbours, where the caller has them; else the 6 nearest roots.
    field : signed distance to the skin, to keep out of it; None ignores the skin.
    """
    if len(guides) == 0:
        return guides
    edit = editable(guides)
    if weights is None:
        reach = np.ones(guides.hold.shape, np.float32)
    else:
        reach = np.clip(np.asarray(weights, np.float32), 0.0, 1.0)
        edit = edit & (reach > 0.0).any(axis=1)
    if not edit.any():
        return guides
    if near is None:
        near = neighbours(guides.points[:, 0]) if across > 0.0 else np.zeros((len(guides), 0), np.int64)
    rows_near = np.ascontiguousarray(near, np.int64)
    before = guides.points
    for _ in range(iterations):
        after = before.copy()
        source = before

        def rows(start: int, stop: int, source: np.ndarray = source, after: np.ndarray = after) -> None:
            _smooth_rows(start, stop, source, after, guides.hold, guides.roots.frames, np.ascontiguousarray(reach),
                         edit, rows_near, float(along), float(across))

        ranges(len(guides), rows)
        before = after
    out = guides.replace(points=freeze(before))
    return out if field is None else push_out(out, field, mask=edit, ranges=ranges)


@njit(
    types.void(
        types.int64, types.int64, F32_3D, types.float32[:, :, ::1], F32_2D, F32_3D, F32_2D,
        types.Array(types.bool_, 1, "C", readonly=True), types.Array(types.int64, 2, "C", readonly=True),
        types.float64, types.float64,
    ),
    cache=True, nogil=True, error_model="numpy",
)
def _smooth_rows(  # type: ignore[no-untyped-def]
    start, stop, points, out, hold, frames, reach, edit, near, along, across
):
    """One pass: rows of `points` read, those of `out` (a copy) written."""
    count = points.shape[1]
    joints = count - 1
    x, q, lengths = np.empty((count, 3)), np.empty((joints, 3)), np.empty(joints)
    turned, freedom = np.empty((joints, 3)), np.empty(joints)
    for row in range(start, stop):
        if not edit[row]:
            continue
        first = first_free(hold, row, freedom)
        if first == joints:
            continue
        quantum = read_chain(points, row, x, q, lengths)
        turned[:] = q
        nx, ny, nz = np.float64(frames[row, 2, 0]), np.float64(frames[row, 2, 1]), np.float64(frames[row, 2, 2])
        moved = joints
        for j in range(first, joints):
            amount = freedom[j] * reach[row, j + 1]
            if amount <= 0.0:
                continue
            dx = dy = dz = 0.0
            if along > 0.0 and joints > 1:
                b, a = max(0, j - 1), min(joints - 1, j + 1)
                dx += along * (0.5 * (q[b, 0] + q[a, 0]) - q[j, 0])
                dy += along * (0.5 * (q[b, 1] + q[a, 1]) - q[j, 1])
                dz += along * (0.5 * (q[b, 2] + q[a, 2]) - q[j, 2])
            if across > 0.0 and near.shape[1] > 0:
                mx = my = mz = 0.0
                for i in range(near.shape[1]):
                    other = near[row, i]
                    vx = np.float64(points[other, j + 1, 0]) - points[other, j, 0]
                    vy = np.float64(points[other, j + 1, 1]) - points[other, j, 1]
                    vz = np.float64(points[other, j + 1, 2]) - points[other, j, 2]
                    size = math.sqrt(vx * vx + vy * vy + vz * vz)
                    ax, ay = np.float64(frames[other, 2, 0]), np.float64(frames[other, 2, 1])
                    az = np.float64(frames[other, 2, 2])
                    c = ax * nx + ay * ny + az * nz
                    if size == 0.0 or c < 0.0:  # the other side of a thin skin is no neighbour
                        continue
                    # smallest rotation of the other's normal to this one's: v + k x v + k x (k x v) / (1 + c)
                    kx, ky, kz = ay * nz - az * ny, az * nx - ax * nz, ax * ny - ay * nx
                    cx, cy, cz = ky * vz - kz * vy, kz * vx - kx * vz, kx * vy - ky * vx
                    mx += (vx + cx + (ky * cz - kz * cy) / (1.0 + c)) / size
                    my += (vy + cy + (kz * cx - kx * cz) / (1.0 + c)) / size
                    mz += (vz + cz + (kx * cy - ky * cx) / (1.0 + c)) / size
                size = math.sqrt(mx * mx + my * my + mz * mz)
                if size > 1e-9:
                    dx += across * (mx / size - q[j, 0])
                    dy += across * (my / size - q[j, 1])
                    dz += across * (mz / size - q[j, 2])
            vx, vy, vz = q[j, 0] + amount * dx, q[j, 1] + amount * dy, q[j, 2] + amount * dz
            size = math.sqrt(vx * vx + vy * vy + vz * vz)
            if size > 1e-6:
                turned[j, 0], turned[j, 1], turned[j, 2] = vx / size, vy / size, vz / size
                moved = min(moved, j)
        if moved < joints:
            rebuild_chain(x, turned, lengths, moved)
            write_chain(out, row, x, lengths, moved, quantum)
