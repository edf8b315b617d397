"""Normal equations of the bundle adjustment, one pass over the observations."""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from core.match.lens_kernels import pixel_of

F1 = types.Array(types.float64, 1, "C", readonly=True)
F2 = types.Array(types.float64, 2, "C", readonly=True)
F3 = types.Array(types.float64, 3, "C", readonly=True)
I1 = types.Array(types.int32, 1, "C", readonly=True)
BEHIND = 1e-9


@njit(
    types.float64(
        I1, I1, F2, F2, F3, F2, F2, F1, F1, types.float64, types.float64[:, :, ::1], types.float64[:, ::1],
        types.float64[:, :, ::1], types.float64[:, ::1], types.float64[:, :, ::1], types.float64[:, ::1],
        types.float64[::1], types.float64[:, :, ::1], types.float64[:, :, ::1]
    ),
    cache=True, nogil=True, error_model="numpy",
)
def accumulate(  # type: ignore[no-untyped-def]
    frame, track, xy, root, rotation, translation, points, focal, lens, scale, frames, frames_right, crossed,
    points_right, of_points, lenses, lens_right, frame_lens, point_lens
):
    """Add every observation to the blocks of the normal equations; returns the robust cost.

    scale : of the Cauchy loss in standard deviations; 0 means plain squares.
    frames (F, 7, 7), frames_right (F, 7), crossed (N, 7, 3), of_points (P, 3, 3), points_right (P, 3), lenses (L, L),
    lens_right (L,), frame_lens (F, 7, L), point_lens (P, 3, L), of a lens of L columns.
    """
    cost = 0.0
    count = len(lens)
    a, b = np.zeros(10 + count), np.zeros(10 + count)
    bent = np.zeros(6 + 2 * count)
    for n in range(len(frame)):
        f, p = frame[n], track[n]
        x = rotation[f, 0, 0] * points[p, 0] + rotation[f, 0, 1] * points[p, 1] + rotation[f, 0, 2] * points[p, 2]
        y = rotation[f, 1, 0] * points[p, 0] + rotation[f, 1, 1] * points[p, 1] + rotation[f, 1, 2] * points[p, 2]
        z = rotation[f, 2, 0] * points[p, 0] + rotation[f, 2, 1] * points[p, 1] + rotation[f, 2, 2] * points[p, 2]
        tx, ty, tz = x + translation[f, 0], y + translation[f, 1], z + translation[f, 2]
        fx, fy = tx / tz, ty / tz
        # where there is no picture it says nothing of where to go; the cost keeps a step from hiding points there
        if tz < BEHIND or not pixel_of(lens, focal[f], fx, fy, bent):
            cost += 1e4
            for i in range(7):
                for k in range(3):
                    crossed[n, i, k] = 0.0
            continue
        ex, ey = bent[0] - xy[n, 0], bent[1] - xy[n, 1]
        # of the pixel by the place over depth, then by the place before the camera
        uu, uv, vu, vv = bent[2], bent[3], bent[4], bent[5]
        ux, uy, uz = uu / tz, uv / tz, -(uu * fx + uv * fy) / tz
        vx, vy, vz = vu / tz, vv / tz, -(vu * fx + vv * fy) / tz
        # columns: turn (3), shift (3), zoom, point (3), lens: the derivative in x in a, in y in b
        a[0], a[1], a[2] = uz * y - uy * z, ux * z - uz * x, uy * x - ux * y
        b[0], b[1], b[2] = vz * y - vy * z, vx * z - vz * x, vy * x - vx * y
        a[3], a[4], a[5] = ux, uy, uz
        b[3], b[4], b[5] = vx, vy, vz
        a[6], b[6] = bent[6], bent[7]
        for k in range(3):
            a[7 + k] = ux * rotation[f, 0, k] + uy * rotation[f, 1, k] + uz * rotation[f, 2, k]
            b[7 + k] = vx * rotation[f, 0, k] + vy * rotation[f, 1, k] + vz * rotation[f, 2, k]
        for k in range(count):
            a[10 + k], b[10 + k] = bent[6 + 2 * k], bent[7 + 2 * k]
        r0, r1, r2 = root[n, 0], root[n, 1], root[n, 2]
        ex, ey = r0 * ex + r1 * ey, r2 * ey
        square = ex * ex + ey * ey
        weight = 1.0
        if scale > 0.0:
            cost += scale * scale * math.log1p(square / (scale * scale))
            weight = 1.0 / (1.0 + square / (scale * scale))
        else:
            cost += square
        for i in range(10 + count):
            a[i], b[i] = r0 * a[i] + r1 * b[i], r2 * b[i]
        for i in range(7):
            wa, wb = weight * a[i], weight * b[i]
            for k in range(7):
                frames[f, i, k] += wa * a[k] + wb * b[k]
            for k in range(3):
                crossed[n, i, k] = wa * a[7 + k] + wb * b[7 + k]
            for k in range(count):
                frame_lens[f, i, k] += wa * a[10 + k] + wb * b[10 + k]
            frames_right[f, i] -= wa * ex + wb * ey
        for i in range(3):
            wa, wb = weight * a[7 + i], weight * b[7 + i]
            for k in range(3):
                of_points[p, i, k] += wa * a[7 + k] + wb * b[7 + k]
            for k in range(count):
                point_lens[p, i, k] += wa * a[10 + k] + wb * b[10 + k]
            points_right[p, i] -= wa * ex + wb * ey
        for i in range(count):
            wa, wb = weight * a[10 + i], weight * b[10 + i]
            for k in range(count):
                lenses[i, k] += wa * a[10 + k] + wb * b[10 + k]
            lens_right[i] -= wa * ex + wb * ey
    return cost
