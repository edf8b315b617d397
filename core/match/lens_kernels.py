"""How lenses bend: places over depth to pixels and back, with exact derivatives, flat functions for kernels.

A lens is one row of numbers whose length says its model (`core/match/lens.py` names the columns). Brown and fisheye
are written as straight to bent, those of 3DEqualizer as bent to straight; the other way is found by Newton's method and
its derivatives by the theorem of the implicit function. Sources: Brown, "Decentering distortion of lenses", 1966, in
the numbers of OpenCV; Kannala and Brandt, "A generic camera model", 2006, section II; "3DE4 Radial - Standard, Degree
4" and "3DE4 Anamorphic - Standard, Degree 4" as the Lens Distortion Plugin Kit documents them.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

BROWN, FISHEYE, BROWN5, RADIAL4, ANAMORPHIC4 = 6, 8, 9, 13, 18  # columns of each model
UNIT = 6  # column of those of 3DEqualizer: pixels of what their polynomials call 1
STEPS = 40
CLOSE = 1e-13
LEAST_SLOPE = 1e-6  # of areas: where a lens folds over there is no way back

F1 = types.Array(types.float64, 1, "C", readonly=True)
F2 = types.Array(types.float64, 2, "C", readonly=True)
OUT = types.float64[::1]
# out: 0, 1 the place; 2 to 5 its derivative by x and y, row by row; from 6 on that of both by each column of the lens


@njit(types.void(F1, types.float64, types.float64, OUT), cache=True, nogil=True, error_model="numpy")
def _brown(lens, x, y, out):  # type: ignore[no-untyped-def]
    rr = x * x + y * y
    bend = 1.0 + lens[1] * rr + lens[2] * rr * rr
    slope = 2.0 * lens[1] + 4.0 * lens[2] * rr
    out[0], out[1] = bend * x, bend * y
    out[2], out[3], out[4], out[5] = bend + slope * x * x, slope * x * y, slope * x * y, bend + slope * y * y
    out[8], out[9], out[10], out[11] = rr * x, rr * y, rr * rr * x, rr * rr * y


@njit(types.void(F1, types.float64, types.float64, OUT), cache=True, nogil=True, error_model="numpy")
def _brown5(lens, x, y, out):  # type: ignore[no-untyped-def]
    k1, k2, p1, p2, k3 = lens[1], lens[2], lens[6], lens[7], lens[8]
    rr = x * x + y * y
    a, b, c = rr + 2.0 * x * x, rr + 2.0 * y * y, 2.0 * x * y
    bend = 1.0 + rr * (k1 + rr * (k2 + rr * k3))
    slope = 2.0 * k1 + rr * (4.0 * k2 + rr * 6.0 * k3)
    mixed = slope * x * y + 2.0 * p1 * x + 2.0 * p2 * y
    out[0], out[1] = bend * x + p1 * c + p2 * a, bend * y + p1 * b + p2 * c
    out[2], out[3] = bend + slope * x * x + 2.0 * p1 * y + 6.0 * p2 * x, mixed
    out[4], out[5] = mixed, bend + slope * y * y + 6.0 * p1 * y + 2.0 * p2 * x
    out[8], out[9], out[10], out[11] = rr * x, rr * y, rr * rr * x, rr * rr * y
    out[18], out[19], out[20], out[21] = c, b, a, c
    out[22], out[23] = rr * rr * rr * x, rr * rr * rr * y


@njit(types.void(F1, types.float64, types.float64, OUT), cache=True, nogil=True, error_model="numpy")
def _fisheye(lens, x, y, out):  # type: ignore[no-untyped-def]
    rr = x * x + y * y
    r = math.sqrt(rr)
    if r < 1e-8:
        out[0], out[1] = x, y
        out[2], out[3], out[4], out[5] = 1.0, 0.0, 0.0, 1.0
        for k in range(6, 6 + 2 * FISHEYE):
            out[k] = 0.0
        return
    t = math.atan(r)
    tt = t * t
    power = t * tt
    angle = t * (1.0 + tt * (lens[1] + tt * (lens[2] + tt * (lens[6] + tt * lens[7]))))
    along = 1.0 + tt * (3.0 * lens[1] + tt * (5.0 * lens[2] + tt * (7.0 * lens[6] + tt * 9.0 * lens[7])))
    bend = angle / r
    slope = (along / (1.0 + rr) - bend) / rr  # of `bend` by r, over r
    out[0], out[1] = bend * x, bend * y
    out[2], out[3], out[4], out[5] = bend + slope * x * x, slope * x * y, slope * x * y, bend + slope * y * y
    for column in (1, 2, 6, 7):
        out[6 + 2 * column], out[7 + 2 * column] = power / r * x, power / r * y
        power *= tt


@njit(types.void(F1, types.float64, types.float64, OUT), cache=True, nogil=True, error_model="numpy")
def _radial4(lens, x, y, out):  # type: ignore[no-untyped-def]
    c2, c4, u1, v1, u3, v3, first, second = lens[1], lens[2], lens[7], lens[8], lens[9], lens[10], lens[11], lens[12]
    rr = x * x + y * y
    bend, slope = 1.0 + c2 * rr + c4 * rr * rr, 2.0 * c2 + 4.0 * c4 * rr
    u, v = u1 + u3 * rr, v1 + v3 * rr
    a, b, c = rr + 2.0 * x * x, rr + 2.0 * y * y, 2.0 * x * y
    px, py = bend * x + a * u + c * v, bend * y + b * v + c * u
    xx = bend + slope * x * x + 6.0 * x * u + 2.0 * y * v + 2.0 * x * (a * u3 + c * v3)
    xy = slope * x * y + 2.0 * y * u + 2.0 * x * v + 2.0 * y * (a * u3 + c * v3)
    yx = slope * x * y + 2.0 * x * v + 2.0 * y * u + 2.0 * x * (b * v3 + c * u3)
    yy = bend + slope * y * y + 6.0 * y * v + 2.0 * x * u + 2.0 * y * (b * v3 + c * u3)
    # the bend of a cylinder, q along a direction and 1 / q across: the exponential of a symmetric matrix
    hh = first * first + second * second
    h = math.sqrt(hh)
    if h < 1e-5:
        ch, sh, turn = 1.0 + 0.5 * hh, 1.0 + hh / 6.0, 1.0 / 3.0
    else:
        ch, sh = math.cosh(h), math.sinh(h) / h
        turn = (ch - sh) / hh
    mxx, mxy, myy = ch + sh * first, sh * second, ch - sh * first
    out[0], out[1] = mxx * px + mxy * py, mxy * px + myy * py
    out[2], out[3] = mxx * xx + mxy * yx, mxx * xy + mxy * yy
    out[4], out[5] = mxy * xx + myy * yx, mxy * xy + myy * yy
    out[8], out[9] = rr * x, rr * y
    out[10], out[11] = rr * rr * x, rr * rr * y
    out[20], out[21], out[22], out[23] = a, c, c, b
    out[24], out[25], out[26], out[27] = rr * a, rr * c, rr * c, rr * b
    for i in range(6, 28, 2):
        if i < 12 or i >= 20:
            p, q = out[i], out[i + 1]
            out[i], out[i + 1] = mxx * p + mxy * q, mxy * p + myy * q
    sx, sy = first * px + second * py, second * px - first * py
    out[28], out[29] = first * (sh * px + turn * sx) + sh * px, first * (sh * py + turn * sy) - sh * py
    out[30], out[31] = second * (sh * px + turn * sx) + sh * py, second * (sh * py + turn * sy) + sh * px


@njit(types.void(F1, types.float64, types.float64, OUT), cache=True, nogil=True, error_model="numpy")
def _anamorphic4(lens, x0, y0, out):  # type: ignore[no-untyped-def]
    cs, sn = math.cos(lens[15]), math.sin(lens[15])
    x, y = cs * x0 + sn * y0, cs * y0 - sn * x0
    xx, yy = x * x, y * y
    rr, dd = xx + yy, xx - yy
    four = dd * dd - 4.0 * xx * yy
    bx = 1.0 + lens[1] * rr + lens[7] * dd + lens[9] * rr * rr + lens[11] * rr * dd + lens[13] * four
    by = 1.0 + lens[2] * rr + lens[8] * dd + lens[10] * rr * rr + lens[12] * rr * dd + lens[14] * four
    # of r^2, d, r^4, r^2 d, r^4 cos 4t by x and by y
    tx = lens[1] + lens[7] + 2.0 * lens[9] * rr + lens[11] * 2.0 * xx + lens[13] * (2.0 * xx - 6.0 * yy)
    ty = lens[1] - lens[7] + 2.0 * lens[9] * rr - lens[11] * 2.0 * yy + lens[13] * (2.0 * yy - 6.0 * xx)
    sx = lens[2] + lens[8] + 2.0 * lens[10] * rr + lens[12] * 2.0 * xx + lens[14] * (2.0 * xx - 6.0 * yy)
    sy = lens[2] - lens[8] + 2.0 * lens[10] * rr - lens[12] * 2.0 * yy + lens[14] * (2.0 * yy - 6.0 * xx)
    qx, qy = lens[16], lens[17]
    px, py = qx * x * bx, qy * y * by
    jxx, jxy = qx * (bx + 2.0 * xx * tx), qx * 2.0 * x * y * ty
    jyx, jyy = qy * 2.0 * x * y * sx, qy * (by + 2.0 * yy * sy)
    # rotate the derivative on the right, then all on the left
    axx, axy = jxx * cs - jxy * sn, jxx * sn + jxy * cs
    ayx, ayy = jyx * cs - jyy * sn, jyx * sn + jyy * cs
    out[0], out[1] = cs * px - sn * py, sn * px + cs * py
    out[2], out[3] = cs * axx - sn * ayx, cs * axy - sn * ayy
    out[4], out[5] = sn * axx + cs * ayx, sn * axy + cs * ayy
    ox, oy = qx * x, qy * y
    out[8], out[9], out[10], out[11] = cs * ox * rr, sn * ox * rr, -sn * oy * rr, cs * oy * rr
    column = 7
    for term in (dd, rr * rr, rr * dd, four):
        out[6 + 2 * column], out[7 + 2 * column] = cs * ox * term, sn * ox * term
        out[8 + 2 * column], out[9 + 2 * column] = -sn * oy * term, cs * oy * term
        column += 2
    # the turn: of what goes in, (x, y) by it is (y, -x); of what comes out, (-out y, out x)
    wx, wy = jxx * y - jxy * x, jyx * y - jyy * x
    out[36], out[37] = cs * wx - sn * wy - out[1], sn * wx + cs * wy + out[0]
    out[38], out[39], out[40], out[41] = cs * x * bx, sn * x * bx, -sn * y * by, cs * y * by


@njit(types.void(F1, types.float64, types.float64, OUT), cache=True, nogil=True, error_model="numpy")
def _written(lens, x, y, out):  # type: ignore[no-untyped-def]
    """The model as it is written, and its derivatives."""
    if len(lens) == BROWN:
        _brown(lens, x, y, out)
    elif len(lens) == FISHEYE:
        _fisheye(lens, x, y, out)
    elif len(lens) == BROWN5:
        _brown5(lens, x, y, out)
    elif len(lens) == RADIAL4:
        _radial4(lens, x, y, out)
    else:
        _anamorphic4(lens, x, y, out)


@njit(types.boolean(F1, types.float64, types.float64, OUT), cache=True, nogil=True, error_model="numpy")
def _turned_round(lens, x, y, out):  # type: ignore[no-untyped-def]
    """The other way: where the model as written leads to (x, y); False where it folds over and nothing does.

    `out` becomes that of the way back: the place, and its derivatives by x, y and the columns of the lens.
    """
    gx, gy = x, y
    for _ in range(STEPS):
        _written(lens, gx, gy, out)
        ex, ey = out[0] - x, out[1] - y
        det = out[2] * out[5] - out[3] * out[4]
        if det < LEAST_SLOPE or not math.isfinite(det):
            return False
        dx, dy = (out[5] * ex - out[3] * ey) / det, (out[2] * ey - out[4] * ex) / det
        size = math.sqrt(dx * dx + dy * dy)
        most = 0.25 + 0.5 * math.sqrt(gx * gx + gy * gy)
        if size > most:
            dx, dy = dx * most / size, dy * most / size
        gx, gy = gx - dx, gy - dy
        if size < CLOSE * (1.0 + abs(gx) + abs(gy)):
            break
    _written(lens, gx, gy, out)
    det = out[2] * out[5] - out[3] * out[4]
    if det < LEAST_SLOPE or abs(out[0] - x) + abs(out[1] - y) > 1e-9 * (1.0 + abs(x) + abs(y)):
        return False
    out[0], out[1] = gx, gy
    xx, xy, yx, yy = out[5] / det, -out[3] / det, -out[4] / det, out[2] / det
    out[2], out[3], out[4], out[5] = xx, xy, yx, yy
    for k in range(6, 6 + 2 * len(lens), 2):
        a, b = out[k], out[k + 1]
        out[k], out[k + 1] = -(xx * a + xy * b), -(yx * a + yy * b)
    return True


@njit(types.boolean(F1, types.float64, types.float64, types.float64, OUT), cache=True, nogil=True, error_model="numpy")
def pixel_of(lens, focal, x, y, out):  # type: ignore[no-untyped-def]
    """The pixel of a place over depth, with derivatives by (x, y) and all columns of the lens.

    focal : logarithm of the zoom of the frame; its derivative is that by column 0. False where the lens leads nowhere.
    """
    scale, stretch = math.exp(lens[0] + focal), math.exp(lens[3])
    if len(lens) < RADIAL4:
        _written(lens, x, y, out)
        unit, inner, fine = scale, 1.0, out[2] * out[5] - out[3] * out[4] > LEAST_SLOPE
        by_x, by_y = out[0], out[1]
    else:
        unit, inner = lens[UNIT], scale / lens[UNIT]
        fine = _turned_round(lens, inner * x, inner * y, out)
        by_x, by_y = inner * (out[2] * x + out[3] * y), inner * (out[4] * x + out[5] * y)
    out[0], out[1] = unit * out[0], unit * stretch * out[1]
    out[2], out[3] = unit * inner * out[2], unit * inner * out[3]
    out[4], out[5] = unit * inner * stretch * out[4], unit * inner * stretch * out[5]
    for k in range(6, 6 + 2 * len(lens), 2):
        out[k], out[k + 1] = unit * out[k], unit * stretch * out[k + 1]
    out[6], out[7] = unit * by_x, unit * stretch * by_y
    out[12], out[13] = 0.0, out[1]
    out[14], out[15], out[16], out[17] = 1.0, 0.0, 0.0, 1.0
    if len(lens) >= RADIAL4:
        out[6 + 2 * UNIT], out[7 + 2 * UNIT] = 0.0, 0.0
    out[0], out[1] = out[0] + lens[4], out[1] + lens[5]
    return fine


@njit(types.void(F1, F1, F2, types.float64[:, ::1]), cache=True, nogil=True, error_model="numpy")
def bend(lens, focal, flat, xy):  # type: ignore[no-untyped-def]
    """Fill `xy` (N, 2) with the pixels of places over depth (N, 2); not a number where the lens leads nowhere."""
    room = np.zeros(6 + 2 * len(lens))
    for n in range(len(flat)):
        fine = pixel_of(lens, focal[n], flat[n, 0], flat[n, 1], room)
        xy[n, 0], xy[n, 1] = (room[0], room[1]) if fine else (math.nan, math.nan)


@njit(types.void(F1, F1, F2, types.float64[:, ::1]), cache=True, nogil=True, error_model="numpy")
def straighten(lens, focal, xy, flat):  # type: ignore[no-untyped-def]
    """Fill `flat` (N, 2) with the places over depth of pixels (N, 2); not a number where nothing is seen there."""
    room = np.zeros(6 + 2 * len(lens))
    stretch = math.exp(lens[3])
    for n in range(len(xy)):
        scale = math.exp(lens[0] + focal[n])
        near = len(lens) < RADIAL4
        unit = scale if near else lens[UNIT]
        x, y = (xy[n, 0] - lens[4]) / unit, (xy[n, 1] - lens[5]) / (unit * stretch)
        if near:
            fine = _turned_round(lens, x, y, room)
            flat[n, 0], flat[n, 1] = (room[0], room[1]) if fine else (math.nan, math.nan)
        else:
            _written(lens, x, y, room)
            flat[n, 0], flat[n, 1] = room[0] * unit / scale, room[1] * unit / scale
