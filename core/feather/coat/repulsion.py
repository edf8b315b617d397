"""Places pushed apart over the skin until they are evenly spaced: particle repulsion on the surface.

Each place is pushed by its neighbours within two spacings, slides over its tangent plane and is put back on the skin.
Places on the other side of a thin part do not push. (Turk, "Re-tiling polygonal surfaces", 1992; Witkin and Heckbert,
"Using particles to sample and control implicit surfaces", 1994.)
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from core.feather.coat.posing import F32_2D
from core.mesh.bvh import Bvh, closest_points
from core.mesh.normals import face_normals
from core.mesh.scatter import Scatter
from core.workers import Workers

STEPS = 20
REACH = 1.45  # spacings within which places push each other
FORCE = 0.24


@njit(
    types.void(
        F32_2D, F32_2D, types.Array(types.float32, 1, "C", readonly=True),
        types.Array(types.int64, 1, "C", readonly=True), types.Array(types.int32, 1, "C", readonly=True),
        types.Array(types.int64, 1, "C", readonly=True), types.Array(types.float64, 1, "C", readonly=True),
        types.float64, types.float64, types.int64, types.int64, types.float32[:, ::1],
    ),
    cache=True, nogil=True,
)
def _push(points, normals, spacing, keys, order, starts, low, cell, force, begin, end, out):  # type: ignore[no-untyped-def]
    """New places of rows begin .. end: each pushed within its tangent plane.

    keys : sorted cell keys that are occupied; starts : their first places in `order`, one more at the end.
    """
    cells = np.empty(3, np.int64)
    for i in range(begin, end):
        for k in range(3):
            cells[k] = int((points[i, k] - low[k]) / cell)
        mx = my = mz = 0.0
        own = np.float64(spacing[i])
        for dx in range(-1, 2):
            for dy in range(-1, 2):
                key = ((cells[0] + dx) << 40) | ((cells[1] + dy) << 20) | (cells[2] - 1)
                at = np.searchsorted(keys, key)
                while at < len(keys) and keys[at] <= key + 2:
                    for q in range(starts[at], starts[at + 1]):
                        j = order[q]
                        if j == i:
                            continue
                        x = np.float64(points[i, 0]) - points[j, 0]
                        y = np.float64(points[i, 1]) - points[j, 1]
                        z = np.float64(points[i, 2]) - points[j, 2]
                        reach = REACH * 0.5 * (own + spacing[j])
                        d2 = x * x + y * y + z * z
                        if d2 >= reach * reach:
                            continue
                        facing = (
                            normals[i, 0] * normals[j, 0] + normals[i, 1] * normals[j, 1]
                            + normals[i, 2] * normals[j, 2]
                        )
                        if facing < 0.0:
                            continue
                        d = math.sqrt(d2)
                        if d < 1e-12 * reach:  # two at one place part, each its own way
                            angle = 2.39996 * i
                            x, y, z, d = math.cos(angle) * reach, math.sin(angle) * reach, 0.0, reach
                        fall = 1.0 - d / reach
                        strength = fall * fall / d * own
                        mx += strength * x
                        my += strength * y
                        mz += strength * z
                    at += 1
        along = mx * normals[i, 0] + my * normals[i, 1] + mz * normals[i, 2]
        mx, my, mz = mx - along * normals[i, 0], my - along * normals[i, 1], mz - along * normals[i, 2]
        size = math.sqrt(mx * mx + my * my + mz * mz)
        scale = 4.0 * force
        if size * scale > 0.3 * own:
            scale = 0.3 * own / size
        out[i, 0] = points[i, 0] + scale * mx
        out[i, 1] = points[i, 1] + scale * my
        out[i, 2] = points[i, 2] + scale * mz


def spread(
    bvh: Bvh, points: NDArray[np.float32], start: Scatter, spacing: NDArray[np.float32], workers: Workers,
    steps: int = STEPS,
) -> Scatter:
    """The places of `start`, in their order, evenly apart.

    Parameters
    ----------
    points : (V, 3) float32, the skin. spacing : (N,) float32, metres wanted around each place.
    steps : more are more even and slower.
    """
    count = len(start.triangle)
    if count < 2:
        return start
    corners = points[bvh.triangles]
    normals = face_normals(points, bvh.triangles)
    triangle, weights = start.triangle, start.barycentric
    now = np.einsum("nk,nkc->nc", weights, corners[triangle]).astype(np.float32)
    cell = REACH * float(spacing.max())
    spacing = np.ascontiguousarray(spacing, np.float32)
    moved = np.empty_like(now)
    for step in range(steps):
        low = now.min(axis=0).astype(np.float64) - cell
        cells = ((now - low) / cell).astype(np.int64)
        code = (cells[:, 0] << 40) | (cells[:, 1] << 20) | cells[:, 2]
        order = np.argsort(code, kind="stable").astype(np.int32)
        keys, first = np.unique(code[order], return_index=True)
        starts = np.append(first, count).astype(np.int64)
        facing = np.ascontiguousarray(normals[triangle])
        force = FORCE * (1.0 - 0.6 * step / steps)
        workers.ranges(
            count,
            lambda a, b, p=now, n=facing, k=keys, o=order, s=starts, w=low, f=force: _push(  # type: ignore[misc]
                p, n, spacing, k, o, s, w, cell, f, a, b, moved
            ),
            1024,
        )
        triangle, weights, _ = closest_points(bvh, moved, workers=workers)
        lost = triangle < 0
        if lost.any():
            triangle[lost], weights[lost] = start.triangle[lost], start.barycentric[lost]
        now = np.einsum("nk,nkc->nc", weights, corners[triangle]).astype(np.float32)
    return Scatter(triangle, weights)
