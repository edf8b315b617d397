"""Normal equations of the bundle adjustment, one pass over the observations."""

from __future__ import annotations

import math

from numba import njit, types

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
    frames (F, 7, 7), frames_right (F, 7), crossed (N, 7, 3), of_points (P, 3, 3), points_right (P, 3), lenses (6, 6),
    lens_right (6,), frame_lens (F, 7, 6), point_lens (P, 3, 6).
    """
    cost = 0.0
    stretch = math.exp(lens[3])
    a = [0.0] * 16
    b = [0.0] * 16
    for n in range(len(frame)):
        f, p = frame[n], track[n]
        x = rotation[f, 0, 0] * points[p, 0] + rotation[f, 0, 1] * points[p, 1] + rotation[f, 0, 2] * points[p, 2]
        y = rotation[f, 1, 0] * points[p, 0] + rotation[f, 1, 1] * points[p, 1] + rotation[f, 1, 2] * points[p, 2]
        z = rotation[f, 2, 0] * points[p, 0] + rotation[f, 2, 1] * points[p, 1] + rotation[f, 2, 2] * points[p, 2]
        tx, ty, tz = x + translation[f, 0], y + translation[f, 1], z + translation[f, 2]
        if tz < BEHIND:  # it says nothing of where to go; the cost keeps a step from hiding points behind a camera
            cost += 1e4
            for i in range(7):
                for k in range(3):
                    crossed[n, i, k] = 0.0
            continue
        fx, fy = tx / tz, ty / tz
        rr = fx * fx + fy * fy
        bend = 1.0 + lens[1] * rr + lens[2] * rr * rr
        slope = 2.0 * lens[1] + 4.0 * lens[2] * rr
        gx = math.exp(lens[0] + focal[f])
        gy = gx * stretch
        ex = gx * bend * fx + lens[4] - xy[n, 0]
        ey = gy * bend * fy + lens[5] - xy[n, 1]
        # of the pixel by the place over depth, then by the place before the camera
        uu, uv = gx * (bend + slope * fx * fx), gx * slope * fx * fy
        vu, vv = gy * slope * fx * fy, gy * (bend + slope * fy * fy)
        ux, uy, uz = uu / tz, uv / tz, -(uu * fx + uv * fy) / tz
        vx, vy, vz = vu / tz, vv / tz, -(vu * fx + vv * fy) / tz
        # columns: turn (3), shift (3), zoom, point (3), lens (6): the derivative in x in a, in y in b
        a[0], a[1], a[2] = uz * y - uy * z, ux * z - uz * x, uy * x - ux * y
        b[0], b[1], b[2] = vz * y - vy * z, vx * z - vz * x, vy * x - vx * y
        a[3], a[4], a[5] = ux, uy, uz
        b[3], b[4], b[5] = vx, vy, vz
        a[6], b[6] = gx * bend * fx, gy * bend * fy
        for k in range(3):
            a[7 + k] = ux * rotation[f, 0, k] + uy * rotation[f, 1, k] + uz * rotation[f, 2, k]
            b[7 + k] = vx * rotation[f, 0, k] + vy * rotation[f, 1, k] + vz * rotation[f, 2, k]
        a[10], b[10] = a[6], b[6]
        a[11], b[11] = gx * rr * fx, gy * rr * fy
        a[12], b[12] = gx * rr * rr * fx, gy * rr * rr * fy
        a[13], b[13] = 0.0, b[6]
        a[14], b[14], a[15], b[15] = 1.0, 0.0, 0.0, 1.0
        r0, r1, r2 = root[n, 0], root[n, 1], root[n, 2]
        ex, ey = r0 * ex + r1 * ey, r2 * ey
        square = ex * ex + ey * ey
        weight = 1.0
        if scale > 0.0:
            cost += scale * scale * math.log1p(square / (scale * scale))
            weight = 1.0 / (1.0 + square / (scale * scale))
        else:
            cost += square
        for i in range(16):
            a[i], b[i] = r0 * a[i] + r1 * b[i], r2 * b[i]
        for i in range(7):
            wa, wb = weight * a[i], weight * b[i]
            for k in range(7):
                frames[f, i, k] += wa * a[k] + wb * b[k]
            for k in range(3):
                crossed[n, i, k] = wa * a[7 + k] + wb * b[7 + k]
            for k in range(6):
                frame_lens[f, i, k] += wa * a[10 + k] + wb * b[10 + k]
            frames_right[f, i] -= wa * ex + wb * ey
        for i in range(3):
            wa, wb = weight * a[7 + i], weight * b[7 + i]
            for k in range(3):
                of_points[p, i, k] += wa * a[7 + k] + wb * b[7 + k]
            for k in range(6):
                point_lens[p, i, k] += wa * a[10 + k] + wb * b[10 + k]
            points_right[p, i] -= wa * ex + wb * ey
        for i in range(6):
            wa, wb = weight * a[10 + i], weight * b[10 + i]
            for k in range(6):
                lenses[i, k] += wa * a[10 + k] + wb * b[10 + k]
            lens_right[i] -= wa * ex + wb * ey
    return cost
