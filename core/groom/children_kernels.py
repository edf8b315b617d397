"""Kernels of the coat: children from the curves of three guides each, rotated with the surface.

A child is p = root + f sum_i w_i R_i g_i, where g_i is guide i relative to its root and R_i the smallest rotation from
the guide's normal a_i to the child's normal n. R g = g - ((a + n).g) / (1 + a.n) (a + n) + 2 (a.g) n needs no
matrix and keeps a.g, the height over the skin, so no child dips under the skin where its guides do not.
"""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt
from typing import Any

import numpy as np
from numba import njit, types

F1 = types.Array(types.float32, 1, "C", readonly=True)
F2 = types.Array(types.float32, 2, "C", readonly=True)
F3 = types.Array(types.float32, 3, "C", readonly=True)
I1 = types.Array(types.int32, 1, "C", readonly=True)
I2 = types.Array(types.int32, 2, "C", readonly=True)
U1 = types.Array(types.uint8, 1, "C", readonly=True)
U2 = types.Array(types.uint32, 2, "C", readonly=True)
OUT_F2 = types.Array(types.float32, 2, "C")
OUT_F3 = types.Array(types.float32, 3, "C")
OUT_I1 = types.Array(types.int32, 1, "C")
OUT_I2 = types.Array(types.int32, 2, "C")
OUT_U1 = types.Array(types.uint8, 1, "C")
I8 = types.int64

# no nnan and ninf: a broken guide must give NaN, not anything at all
FAST = {"contract", "reassoc", "nsz", "arcp", "afn"}


@njit(types.void(I1, I1, F2, I2, F2, I8, I8, OUT_I1, OUT_F2, OUT_I2, OUT_F2), cache=True, nogil=True)
def take_places(  # type: ignore[no-untyped-def]
    order, triangle, bary, sites, weights, start, stop, out_triangle, out_bary, out_sites, out_weights
):
    """Rows start .. stop of what is bound, taken in `order`; of three weights the first two."""
    for i in range(start, stop):
        row = order[i]
        out_triangle[i] = triangle[row]
        for k in range(2):
            out_bary[i, k], out_weights[i, k] = bary[row, k], weights[row, k]
        for k in range(3):
            out_sites[i, k] = sites[row, k]


@njit(types.void(F3, F2, U1, I8, I8, OUT_F3), cache=True, nogil=True, fastmath=FAST)
def prepare_guides(points, normals, moved, start, stop, out):  # type: ignore[no-untyped-def]
    """Rows x, y, z of every guide relative to its root, and its height over the skin: (G, 4, P), moved guides only."""
    count = points.shape[1]
    for g in range(start, stop):
        if not moved[g]:
            continue
        x0, y0, z0 = points[g, 0, 0], points[g, 0, 1], points[g, 0, 2]
        nx, ny, nz = normals[g, 0], normals[g, 1], normals[g, 2]
        for j in range(count):
            x, y, z = points[g, j, 0] - x0, points[g, j, 1] - y0, points[g, j, 2] - z0
            out[g, 0, j], out[g, 1, j], out[g, 2, j] = x, y, z
            out[g, 3, j] = nx * x + ny * y + nz * z


@njit(types.void(U2, U2, I8, I8, OUT_U1), cache=True, nogil=True)
def differ(old, new, start, stop, out):  # type: ignore[no-untyped-def]
    """Rows whose bits differ."""
    for g in range(start, stop):
        any_bit = np.uint32(0)
        for j in range(old.shape[1]):
            any_bit |= old[g, j] ^ new[g, j]
        out[g] = any_bit != 0


@njit(I8(I2, U1, I8, I8, OUT_I1), cache=True, nogil=True)
def rows_of_guides(sites, moved, start, stop, rows):  # type: ignore[no-untyped-def]
    """Write the children in start .. stop that hang on a moved guide to ``rows[start ..]``; returns how many."""
    at = start
    for r in range(start, stop):
        rows[at] = r
        at += moved[sites[r, 0]] | moved[sites[r, 1]] | moved[sites[r, 2]]
    return at - start


def _kernel(points: int) -> Callable[..., Any]:
    """The evaluation kernel for `points` points on every child; 0 for any number."""

    @njit(
        types.void(F3, F2, I2, F2, F2, I1, F2, I2, F2, F1, I1, types.boolean, I8, I8, OUT_F3),
        cache=True, nogil=True, fastmath=FAST,
    )
    def grow(  # type: ignore[no-untyped-def]
        guides, guide_normals, triangles, skin, skin_normals, triangle, bary, sites, weights, length, rows, some,
        start, stop, out,
    ):
        count = points if points > 0 else guides.shape[2]
        for i in range(start, stop):
            r = rows[i] if some else i
            t = triangle[r]
            a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
            u, v = bary[r, 0], bary[r, 1]
            w = np.float32(1.0) - u - v
            nx = u * skin_normals[a, 0] + v * skin_normals[b, 0] + w * skin_normals[c, 0]
            ny = u * skin_normals[a, 1] + v * skin_normals[b, 1] + w * skin_normals[c, 1]
            nz = u * skin_normals[a, 2] + v * skin_normals[b, 2] + w * skin_normals[c, 2]
            scale = np.float32(1.0) / np.float32(sqrt(nx * nx + ny * ny + nz * nz + np.float32(1e-30)))
            nx *= scale
            ny *= scale
            nz *= scale
            x0 = u * skin[a, 0] + v * skin[b, 0] + w * skin[c, 0]
            y0 = u * skin[a, 1] + v * skin[b, 1] + w * skin[c, 1]
            z0 = u * skin[a, 2] + v * skin[b, 2] + w * skin[c, 2]
            s0, s1, s2 = sites[r, 0], sites[r, 1], sites[r, 2]
            f = length[r]
            w0, w1 = weights[r, 0] * f, weights[r, 1] * f
            w2 = f - w0 - w1
            ax, ay, az = guide_normals[s0, 0], guide_normals[s0, 1], guide_normals[s0, 2]
            k = w0 / max(np.float32(1.0) + ax * nx + ay * ny + az * nz, np.float32(1e-4))
            hx0, hy0, hz0 = (ax + nx) * k, (ay + ny) * k, (az + nz) * k
            ax, ay, az = guide_normals[s1, 0], guide_normals[s1, 1], guide_normals[s1, 2]
            k = w1 / max(np.float32(1.0) + ax * nx + ay * ny + az * nz, np.float32(1e-4))
            hx1, hy1, hz1 = (ax + nx) * k, (ay + ny) * k, (az + nz) * k
            ax, ay, az = guide_normals[s2, 0], guide_normals[s2, 1], guide_normals[s2, 2]
            k = w2 / max(np.float32(1.0) + ax * nx + ay * ny + az * nz, np.float32(1e-4))
            hx2, hy2, hz2 = (ax + nx) * k, (ay + ny) * k, (az + nz) * k
            for j in range(count):
                gx0, gy0, gz0, h0 = guides[s0, 0, j], guides[s0, 1, j], guides[s0, 2, j], guides[s0, 3, j]
                gx1, gy1, gz1, h1 = guides[s1, 0, j], guides[s1, 1, j], guides[s1, 2, j], guides[s1, 3, j]
                gx2, gy2, gz2, h2 = guides[s2, 0, j], guides[s2, 1, j], guides[s2, 2, j], guides[s2, 3, j]
                d0 = h0 + nx * gx0 + ny * gy0 + nz * gz0
                d1 = h1 + nx * gx1 + ny * gy1 + nz * gz1
                d2 = h2 + nx * gx2 + ny * gy2 + nz * gz2
                up = np.float32(2.0) * (w0 * h0 + w1 * h1 + w2 * h2)
                out[r, 0, j] = (
                    x0 + nx * up + w0 * gx0 + w1 * gx1 + w2 * gx2 - d0 * hx0 - d1 * hx1 - d2 * hx2
                )
                out[r, 1, j] = (
                    y0 + ny * up + w0 * gy0 + w1 * gy1 + w2 * gy2 - d0 * hy0 - d1 * hy1 - d2 * hy2
                )
                out[r, 2, j] = (
                    z0 + nz * up + w0 * gz0 + w1 * gz1 + w2 * gz2 - d0 * hz0 - d1 * hz1 - d2 * hz2
                )

    return grow


grow_16 = _kernel(16)
grow_any = _kernel(0)


@njit(types.void(F2, F2, I2, I1, F2, I8, I8, OUT_F2, OUT_F2), cache=True, nogil=True)
def child_roots(skin, skin_normals, triangles, triangle, bary, start, stop, root, normal):  # type: ignore[no-untyped-def]
    """Where the children stand and their unit normals, (N, 3) each."""
    for r in range(start, stop):
        t = triangle[r]
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        u, v = bary[r, 0], bary[r, 1]
        w = np.float32(1.0) - u - v
        length = np.float32(0.0)
        for k in range(3):
            root[r, k] = u * skin[a, k] + v * skin[b, k] + w * skin[c, k]
            normal[r, k] = u * skin_normals[a, k] + v * skin_normals[b, k] + w * skin_normals[c, k]
            length += normal[r, k] * normal[r, k]
        scale = np.float32(1.0) / np.float32(sqrt(length + np.float32(1e-30)))
        for k in range(3):
            normal[r, k] *= scale


@njit(types.void(F3, I1, I8, I8, OUT_F3), cache=True, nogil=True)
def bake_rows(points, rows, start, stop, out):  # type: ignore[no-untyped-def]
    """Children ``rows`` (N, 3, P) as curves (n, P, 3)."""
    for i in range(start, stop):
        r = rows[i]
        for j in range(points.shape[2]):
            out[i, j, 0], out[i, j, 1], out[i, j, 2] = points[r, 0, j], points[r, 1, j], points[r, 2, j]


@njit(types.void(OUT_I2, I8), cache=True, nogil=True)
def lower_sites(sites, row):  # type: ignore[no-untyped-def]
    """Guides after `row` have one row less; children of `row` itself are about to be bound again."""
    for r in range(len(sites)):
        for k in range(3):
            s = sites[r, k]
            sites[r, k] = s - 1 if s > row or (s == row and s > 0) else s
