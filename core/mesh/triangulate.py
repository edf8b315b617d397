"""Polygons to triangles: quads by the better diagonal, larger faces by ear clipping."""

from __future__ import annotations

import numpy as np
from numba import njit, types

from core.mesh.mesh import Mesh, Triangles

SMALL = 64  # up to here the shortest ear is searched; above, the first one found is taken
BUDGET = 400_000_000  # point-in-ear tests of one call, about a second; what is left after that is fanned
SAME_LENGTH = 1.0 - 1e-6  # mirrored quads must not differ by rounding, so nearly equal diagonals count as equal


def triangulate(mesh: Mesh) -> Triangles:
    """Split every face of n corners into n - 2 triangles, in the order of the faces.

    Returns
    -------
    Triangles whose winding is that of their faces. Faces without area are split too, so that each face
    always has its n - 2 triangles; a concave face stays inside its outline where it is nearly flat.

    Notes
    -----
    Quads take the diagonal whose two triangles face the way of the quad, and of two such the shorter.
    Larger faces: ear clipping (Meisters 1975) in the plane of the Newell normal.
    """
    starts = np.cumsum(mesh.counts, dtype=np.int64) - mesh.counts
    first = np.cumsum(mesh.counts - 2, dtype=np.int64) - (mesh.counts - 2)
    total = int((mesh.counts - 2).sum(dtype=np.int64))
    corners = np.empty((total, 3), np.int32)

    threes = np.flatnonzero(mesh.counts == 3)
    corners[first[threes]] = starts[threes, None] + np.arange(3)
    fours = np.flatnonzero(mesh.counts == 4)
    if len(fours):
        _cut_quads(mesh.points, mesh.corners, starts, first, fours, corners)
    many = np.flatnonzero(mesh.counts > 4)
    if len(many):
        _clip_ears(mesh.points, mesh.corners, starts, first, mesh.counts, many, BUDGET, corners)
    return Triangles(
        vertices=mesh.corners[corners],
        corners=corners,
        faces=np.repeat(np.arange(len(mesh.counts), dtype=np.int32), mesh.counts - 2),
    )


_points = types.Array(types.float32, 2, "C", readonly=True)
_ints = types.Array(types.int32, 1, "C", readonly=True)
_longs = types.Array(types.int64, 1, "C", readonly=True)


@njit(
    types.void(_points, _ints, _longs, _longs, _longs, types.Array(types.int32, 2, "C")), cache=True, nogil=True
)
def _cut_quads(points, corners, starts, first, faces, out):  # type: ignore[no-untyped-def]
    """Two triangles for each quad, cut from corner 0 to 2 or, where that is better, from 1 to 3."""
    p = np.empty((4, 3), np.float64)
    across, along = np.empty(3, np.float64), np.empty(3, np.float64)
    worst = np.empty(2, np.float64)  # of each cut, how much the triangle facing the quad's way least does so
    for face in faces:
        start = starts[face]
        for i in range(4):
            for axis in range(3):
                p[i, axis] = points[corners[start + i], axis]
        for axis in range(3):
            across[axis] = p[2, axis] - p[0, axis]
            along[axis] = p[3, axis] - p[1, axis]
        nx = across[1] * along[2] - across[2] * along[1]
        ny = across[2] * along[0] - across[0] * along[2]
        nz = across[0] * along[1] - across[1] * along[0]
        for cut in range(2):
            worst[cut] = np.inf
            for half in range(2):
                i, j, k = cut, cut + 1, cut + 2
                if half == 1:
                    i, j, k = cut, cut + 2, (cut + 3) % 4
                k %= 4
                ax, ay, az = p[j % 4, 0] - p[i, 0], p[j % 4, 1] - p[i, 1], p[j % 4, 2] - p[i, 2]
                bx, by, bz = p[k, 0] - p[i, 0], p[k, 1] - p[i, 1], p[k, 2] - p[i, 2]
                facing = (ay * bz - az * by) * nx + (az * bx - ax * bz) * ny + (ax * by - ay * bx) * nz
                worst[cut] = min(worst[cut], facing)
        length_first = across[0] ** 2 + across[1] ** 2 + across[2] ** 2
        length_second = along[0] ** 2 + along[1] ** 2 + along[2] ** 2
        if worst[0] > 0.0 and worst[1] > 0.0:
            second = length_second < SAME_LENGTH * length_first
        else:
            second = worst[1] > max(worst[0], 0.0)
        row = first[face]
        if second:
            out[row, 0], out[row, 1], out[row, 2] = start, start + 1, start + 3
            out[row + 1, 0], out[row + 1, 1], out[row + 1, 2] = start + 1, start + 2, start + 3
        else:
            out[row, 0], out[row, 1], out[row, 2] = start, start + 1, start + 2
            out[row + 1, 0], out[row + 1, 1], out[row + 1, 2] = start, start + 2, start + 3


@njit(
    types.void(_points, _ints, _longs, _longs, _ints, _longs, types.int64, types.Array(types.int32, 2, "C")),
    cache=True, nogil=True,
)  # fmt: skip
def _clip_ears(points, corners, starts, first, counts, faces, budget, out):  # type: ignore[no-untyped-def]
    longest = 0
    for face in faces:
        longest = max(longest, counts[face])
    x = np.empty(longest, np.float64)
    y = np.empty(longest, np.float64)
    following = np.empty(longest, np.int64)
    previous = np.empty(longest, np.int64)
    for face in faces:
        n = counts[face]
        start = starts[face]
        row = first[face]
        # Newell normal about the first corner, then the plane of its two smaller axes
        origin = corners[start]
        nx = ny = nz = 0.0
        for i in range(n):
            a = corners[start + i]
            b = corners[start + (i + 1) % n]
            ax = np.float64(points[a, 0]) - points[origin, 0]
            ay = np.float64(points[a, 1]) - points[origin, 1]
            az = np.float64(points[a, 2]) - points[origin, 2]
            bx = np.float64(points[b, 0]) - points[origin, 0]
            by = np.float64(points[b, 1]) - points[origin, 1]
            bz = np.float64(points[b, 2]) - points[origin, 2]
            nx += ay * bz - az * by
            ny += az * bx - ax * bz
            nz += ax * by - ay * bx
        u, v, w = 0, 1, nz
        if abs(nx) >= abs(ny) and abs(nx) >= abs(nz):
            u, v, w = 1, 2, nx
        elif abs(ny) >= abs(nz):
            u, v, w = 2, 0, ny
        if w < 0:
            u, v = v, u
        for i in range(n):
            a = corners[start + i]
            x[i] = np.float64(points[a, u]) - points[origin, u]
            y[i] = np.float64(points[a, v]) - points[origin, v]
            following[i] = (i + 1) % n
            previous[i] = (i + n - 1) % n
        left = n
        at = 0
        while left > 3:
            best = -1
            best_length = np.inf
            b = at
            for _ in range(left):
                a = previous[b]
                c = following[b]
                if (x[b] - x[a]) * (y[c] - y[a]) - (y[b] - y[a]) * (x[c] - x[a]) > 0.0:
                    length = (x[c] - x[a]) ** 2 + (y[c] - y[a]) ** 2
                    if length < best_length:
                        ear = True
                        k = following[c]
                        while k != a and budget > 0:
                            budget -= 1
                            inside = (
                                (x[b] - x[a]) * (y[k] - y[a]) - (y[b] - y[a]) * (x[k] - x[a]) >= 0.0
                                and (x[c] - x[b]) * (y[k] - y[b]) - (y[c] - y[b]) * (x[k] - x[b]) >= 0.0
                                and (x[a] - x[c]) * (y[k] - y[c]) - (y[a] - y[c]) * (x[k] - x[c]) >= 0.0
                            )
                            if inside and not (
                                (x[k] == x[a] and y[k] == y[a])
                                or (x[k] == x[b] and y[k] == y[b])
                                or (x[k] == x[c] and y[k] == y[c])
                            ):
                                ear = False
                                break
                            k = following[k]
                        if ear:
                            best = b
                            best_length = length
                            if n > SMALL:
                                break
                b = c
            if best < 0:  # a face without area or one that crosses itself: cut where we stand
                best = at
            a = previous[best]
            c = following[best]
            out[row, 0] = start + a
            out[row, 1] = start + best
            out[row, 2] = start + c
            row += 1
            following[a] = c
            previous[c] = a
            left -= 1
            at = c
        out[row, 0] = start + previous[at]
        out[row, 1] = start + at
        out[row, 2] = start + following[at]
