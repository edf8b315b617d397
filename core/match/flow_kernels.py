"""Kernels of spline flow: uniform cubic B-splines between a control grid and pixels, both ways, and the data term."""

from __future__ import annotations

import numpy as np
from numba import njit, types

f32, i64 = types.float32, types.int64
F32_2D = types.Array(types.float32, 2, "C", readonly=True)
W_F32_2D = f32[:, ::1]
W_F32_3D = f32[:, :, ::1]
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
    types.void(F32_3D, BOOL_2D, F32_2D, F32_2D, F32_2D, i64, i64, i64, W_F32_3D),
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
    types.void(F32_2D, F32_3D, F32_2D, F32_2D, f32, i64, *([W_F32_2D] * 7)),
    cache=True, nogil=True, error_model="numpy",
)  # fmt: skip
def data_term(rest, flow, gx, gy, scale, every, xx, xy, yy, bx, by, square, inside):  # type: ignore[no-untyped-def]
    """Gauss-Newton's tensors and right side per pixel for the residuals `rest`, with Geman & McClure's weights.

    every : of so many rows and columns one is made. inside : becomes 1 where the flow ends in the frame, else 0.
    square : the squared residual, 0 outside.
    """
    height, width = rest.shape
    limit = np.float32(1.0) / (np.float32(9.0) * scale * scale)
    right, bottom = np.float32(width - 1), np.float32(height - 1)
    for j in range(xx.shape[0]):
        for i in range(xx.shape[1]):
            y, x = j * every, i * every
            r = rest[y, x]
            tx, ty = flow[y, x, 0] + np.float32(x), flow[y, x, 1] + np.float32(y)
            seen = np.float32(1.0) if tx >= 0.0 and tx <= right and ty >= 0.0 and ty <= bottom else np.float32(0.0)
            w = np.float32(1.0) / (np.float32(1.0) + r * r * limit)
            w = w * w * seen
            u, v = gx[y, x], gy[y, x]
            wu, wv = w * u, w * v
            xx[j, i], xy[j, i], yy[j, i] = wu * u, wu * v, wv * v
            bx[j, i], by[j, i] = -wu * r, -wv * r
            square[j, i] = r * r * seen
            inside[j, i] = seen


@njit(types.void(F32_3D, W_F32_2D, W_F32_2D), cache=True, nogil=True, error_model="numpy")
def aim(flow, x, y):  # type: ignore[no-untyped-def]
    """Where in the second frame the pixels of the first are by a flow."""
    for row in range(flow.shape[0]):
        for column in range(flow.shape[1]):
            x[row, column] = flow[row, column, 0] + np.float32(column)
            y[row, column] = flow[row, column, 1] + np.float32(row)


@njit(types.void(F32_3D, F32_3D, F32_3D, W_F32_3D), cache=True, nogil=True, error_model="numpy")
def smaller_gap(flow, fine, coarse, out):  # type: ignore[no-untyped-def]
    """Outer products (H, W, 3: xx, xy, yy) of the smaller of the gaps there and back, by either of two ways back."""
    for y in range(flow.shape[0]):
        for x in range(flow.shape[1]):
            u, v = flow[y, x, 0] + fine[y, x, 0], flow[y, x, 1] + fine[y, x, 1]
            p, q = flow[y, x, 0] + coarse[y, x, 0], flow[y, x, 1] + coarse[y, x, 1]
            if u * u + v * v >= p * p + q * q:
                u, v = p, q
            out[y, x, 0], out[y, x, 1], out[y, x, 2] = u * u, u * v, v * v


@njit(types.void(F32_3D, F32_3D, F32_2D, f32, W_F32_3D), cache=True, nogil=True, error_model="numpy")
def mixed_covariance(gap, lean, apart, share, out):  # type: ignore[no-untyped-def]
    """`out` (H, W, 3) becomes its `share`, and `apart` times what `gap` and the outer product of `lean` say."""
    for y in range(gap.shape[0]):
        for x in range(gap.shape[1]):
            u, v, a = lean[y, x, 0], lean[y, x, 1], apart[y, x]
            out[y, x, 0] = share * out[y, x, 0] + a * (gap[y, x, 0] + u * u)
            out[y, x, 1] = share * out[y, x, 1] + a * (gap[y, x, 1] + u * v)
            out[y, x, 2] = share * out[y, x, 2] + a * (gap[y, x, 2] + v * v)


@njit(types.void(i64, i64, W_F32_2D), cache=True, nogil=True, error_model="numpy")
def overlaps(side, step, out):  # type: ignore[no-untyped-def]
    """Of a line of `side` pixels: `out` (vertices, 7) becomes the products of the splines of a vertex and of the
    vertices from three before it to three behind, summed over the pixels."""
    table = _table(step)
    out[:] = 0.0
    for x in range(side):
        i = x // step
        for p in range(4):
            for q in range(4):
                out[i + p, q - p + 3] += table[x - i * step, p] * table[x - i * step, q]


@njit(types.void(F32_3D, F32_2D, types.float32, W_F32_3D), cache=True, nogil=True, error_model="numpy")
def splat(vectors, weight, share, out):  # type: ignore[no-untyped-def]
    """Every pixel's vector (H, W, 2), carried along a share of itself and summed onto the four pixels about that place.

    weight : (H, W). out : (H, W, 3), the sums of weighted x, y and of the weights.
    """
    height, width = vectors.shape[:2]
    out[:] = 0.0
    for y in range(height):
        for x in range(width):
            u, v = vectors[y, x, 0], vectors[y, x, 1]
            px, py = x + share * u, y + share * v
            if not (-1.0 < px < width and -1.0 < py < height):
                continue
            i, j = int(np.floor(px)), int(np.floor(py))
            s, t = px - i, py - j
            for q in range(2):
                for p in range(2):
                    if 0 <= j + q < height and 0 <= i + p < width:
                        w = weight[y, x] * (s if p else 1.0 - s) * (t if q else 1.0 - t)
                        out[j + q, i + p, 0] += w * u
                        out[j + q, i + p, 1] += w * v
                        out[j + q, i + p, 2] += w
