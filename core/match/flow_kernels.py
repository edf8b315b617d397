"""Kernels of spline flow: uniform cubic B-splines between a control grid and pixels, both ways, and the data term."""

from __future__ import annotations

import numpy as np
from numba import njit, types

f32, i64 = types.float32, types.int64
F32_2D = types.Array(types.float32, 2, "C", readonly=True)
W_F32_2D = f32[:, ::1]
BOOL_2D = types.Array(types.boolean, 2, "C", readonly=True)
F32_3D = types.Array(types.float32, 3, "C", readonly=True)
FAST = {"reassoc", "contract", "arcp", "nsz"}  # sums in any order, but what is not a number stays so


@njit(cache=True, nogil=True, error_model="numpy")
def _table(step):  # type: ignore[no-untyped-def]
    """The four weights at every pixel between two vertices."""
    out = np.empty((step, 4), np.float32)
    for k in range(step):
        t = k / step
        r = 1.0 - t
        out[k, 0], out[k, 3] = r * r * r / 6.0, t * t * t / 6.0
        out[k, 1] = (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0
        out[k, 2] = 1.0 - out[k, 0] - out[k, 1] - out[k, 3]
    return out


@njit(types.void(F32_2D, i64, W_F32_2D), cache=True, nogil=True, error_model="numpy", fastmath=FAST)
def spread(grid, step, out):  # type: ignore[no-untyped-def]
    """Values at pixels (H, W) of the spline with coefficients `grid`, whose vertex (1, 1) is on pixel (0, 0)."""
    height, width = out.shape
    columns = grid.shape[1]
    line = np.empty(columns, np.float32)
    table = _table(step)
    for y in range(height):
        j = y // step
        w = table[y - j * step]
        for i in range(columns):
            line[i] = w[0] * grid[j, i] + w[1] * grid[j + 1, i] + w[2] * grid[j + 2, i] + w[3] * grid[j + 3, i]
        for i in range((width + step - 1) // step):
            a, b, c, d = line[i], line[i + 1], line[i + 2], line[i + 3]
            for k in range(min(step, width - i * step)):
                out[y, i * step + k] = a * table[k, 0] + b * table[k, 1] + c * table[k, 2] + d * table[k, 3]


@njit(types.void(F32_2D, i64, i64, W_F32_2D), cache=True, nogil=True, error_model="numpy", fastmath=FAST)
def gather(field, step, power, out):  # type: ignore[no-untyped-def]
    """The transpose of :func:`spread`: pixels summed onto vertices with their weights to the `power`."""
    height, width = field.shape
    columns = out.shape[1]
    line = np.empty(columns, np.float32)
    table = _table(step) ** power
    out[:] = 0.0
    for y in range(height):
        line[:] = 0.0
        for i in range((width + step - 1) // step):
            a = b = c = d = np.float32(0.0)
            for k in range(min(step, width - i * step)):
                v = field[y, i * step + k]
                a += table[k, 0] * v
                b += table[k, 1] * v
                c += table[k, 2] * v
                d += table[k, 3] * v
            line[i] += a
            line[i + 1] += b
            line[i + 2] += c
            line[i + 3] += d
        j = y // step
        w = table[y - j * step]
        for q in range(4):
            for i in range(columns):
                out[j + q, i] += w[q] * line[i]


@njit(
    types.void(F32_3D, BOOL_2D, F32_2D, F32_2D, F32_2D, i64, i64, i64, f32[:, :, ::1]),
    cache=True, nogil=True, error_model="numpy", fastmath=FAST,
)  # fmt: skip
def normal_product(grid, busy, xx, xy, yy, step, first, stop, out):  # type: ignore[no-untyped-def]
    """The normal equations times a displacement on the grid (2, rows, columns), without ever making their matrix.

    busy : (rows - 3, columns - 3), the cells that a vertex which is not zero or not held still reaches.
    first, stop : the rows of cells whose part of the sum is made.
    """
    height, width = xx.shape
    columns = grid.shape[2]
    lu, lv, su, sv = (np.empty(columns, np.float32), np.empty(columns, np.float32), np.empty(columns, np.float32),
                      np.empty(columns, np.float32))  # fmt: skip
    table = _table(step)
    out[:] = 0.0
    for y in range(first * step, min(stop * step, height)):
        j = y // step
        if not busy[j].any():
            continue
        w = table[y - j * step]
        for i in range(columns):
            lu[i] = (
                w[0] * grid[0, j, i] + w[1] * grid[0, j + 1, i] + w[2] * grid[0, j + 2, i] + w[3] * grid[0, j + 3, i]
            )
            lv[i] = (
                w[0] * grid[1, j, i] + w[1] * grid[1, j + 1, i] + w[2] * grid[1, j + 2, i] + w[3] * grid[1, j + 3, i]
            )
            su[i] = sv[i] = 0.0
        for i in range((width + step - 1) // step):
            if not busy[j, i]:
                continue
            a0 = a1 = a2 = a3 = b0 = b1 = b2 = b3 = np.float32(0.0)
            for k in range(min(step, width - i * step)):
                t0, t1, t2, t3 = table[k, 0], table[k, 1], table[k, 2], table[k, 3]
                u = t0 * lu[i] + t1 * lu[i + 1] + t2 * lu[i + 2] + t3 * lu[i + 3]
                v = t0 * lv[i] + t1 * lv[i + 1] + t2 * lv[i + 2] + t3 * lv[i + 3]
                x = i * step + k
                p, q = xx[y, x] * u + xy[y, x] * v, xy[y, x] * u + yy[y, x] * v
                a0 += t0 * p
                a1 += t1 * p
                a2 += t2 * p
                a3 += t3 * p
                b0 += t0 * q
                b1 += t1 * q
                b2 += t2 * q
                b3 += t3 * q
            su[i] += a0
            su[i + 1] += a1
            su[i + 2] += a2
            su[i + 3] += a3
            sv[i] += b0
            sv[i + 1] += b1
            sv[i + 2] += b2
            sv[i + 3] += b3
        for q in range(4):
            for i in range(columns):
                out[0, j + q, i] += w[q] * su[i]
                out[1, j + q, i] += w[q] * sv[i]


@njit(
    types.void(F32_2D, F32_2D, F32_2D, F32_2D, f32, *([W_F32_2D] * 6)),
    cache=True, nogil=True, error_model="numpy",
)  # fmt: skip
def data_term(rest, inside, gx, gy, scale, xx, xy, yy, bx, by, square):  # type: ignore[no-untyped-def]
    """Gauss-Newton's tensors and right side per pixel for the residuals `rest`, with Geman & McClure's weights.

    square : becomes the squared residual, 0 outside.
    """
    height, width = rest.shape
    limit = 1.0 / (9.0 * scale * scale)
    for y in range(height):
        for x in range(width):
            r = rest[y, x]
            w = 1.0 / (1.0 + r * r * limit)
            w = w * w * inside[y, x]
            u, v = gx[y, x], gy[y, x]
            xx[y, x], xy[y, x], yy[y, x] = w * u * u, w * u * v, w * v * v
            bx[y, x], by[y, x] = -w * u * r, -w * v * r
            square[y, x] = r * r * inside[y, x]
