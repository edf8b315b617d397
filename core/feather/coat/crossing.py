"""Exact tests of what passes through what: vanes through each other and through the skin, triangle against triangle.

Boxes of strips (the cells between two rows of a vane) come first, then triangles: every edge of one that changes sides
of the plane of the other is followed to that plane (Moller, "A Fast Triangle-Triangle Intersection Test", 1997, in the
form of segments). Coordinates are taken relative to a corner, in float64: what is tested is what is written.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from core.feather.coat.posing import F32_3D, F32_4D, Ranges
from core.mesh.bvh import F32_2D, I32_2D, Bvh
from core.mesh.bvh_kernels import LANES, STACK_SIZE
from core.workers import serial_ranges

I32_1D = types.Array(types.int32, 1, "C", readonly=True)


class Pairs(NamedTuple):
    """Pairs of feathers whose boxes meet, a < b, as rows for every feather (both ways).

    start : (N + 1,) int32. other : (2 P,) int32, ``other[start[i]:start[i + 1]]`` are the neighbours of i.
    """

    start: NDArray[np.int32]
    other: NDArray[np.int32]


@njit(cache=True, inline="always")
def _segment_meets(p, q, a, b, c, nx, ny, nz, dp, dq):  # type: ignore[no-untyped-def]
    """True when segment p-q, whose ends lie at signed heights dp and dq over the plane of a b c, meets the triangle."""
    if (dp > 0.0 and dq > 0.0) or (dp < 0.0 and dq < 0.0) or dp == dq:
        return False
    t = dp / (dp - dq)
    x, y, z = p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1]), p[2] + t * (q[2] - p[2])
    for side in range(3):
        u = a if side == 0 else (b if side == 1 else c)
        v = b if side == 0 else (c if side == 1 else a)
        ex, ey, ez = v[0] - u[0], v[1] - u[1], v[2] - u[2]
        wx, wy, wz = x - u[0], y - u[1], z - u[2]
        cx, cy, cz = ey * wz - ez * wy, ez * wx - ex * wz, ex * wy - ey * wx
        if cx * nx + cy * ny + cz * nz < 0.0:
            return False
    return True


@njit(cache=True, nogil=True)
def triangles_meet(a, b):  # type: ignore[no-untyped-def]
    """True when triangles `a` and `b` (3, 3) float64 pass through each other; lying in one plane does not count."""
    n1x = (b[1, 1] - b[0, 1]) * (b[2, 2] - b[0, 2]) - (b[1, 2] - b[0, 2]) * (b[2, 1] - b[0, 1])
    n1y = (b[1, 2] - b[0, 2]) * (b[2, 0] - b[0, 0]) - (b[1, 0] - b[0, 0]) * (b[2, 2] - b[0, 2])
    n1z = (b[1, 0] - b[0, 0]) * (b[2, 1] - b[0, 1]) - (b[1, 1] - b[0, 1]) * (b[2, 0] - b[0, 0])
    d0 = n1x * (a[0, 0] - b[0, 0]) + n1y * (a[0, 1] - b[0, 1]) + n1z * (a[0, 2] - b[0, 2])
    d1 = n1x * (a[1, 0] - b[0, 0]) + n1y * (a[1, 1] - b[0, 1]) + n1z * (a[1, 2] - b[0, 2])
    d2 = n1x * (a[2, 0] - b[0, 0]) + n1y * (a[2, 1] - b[0, 1]) + n1z * (a[2, 2] - b[0, 2])
    if (d0 > 0.0 and d1 > 0.0 and d2 > 0.0) or (d0 < 0.0 and d1 < 0.0 and d2 < 0.0):
        return False
    n2x = (a[1, 1] - a[0, 1]) * (a[2, 2] - a[0, 2]) - (a[1, 2] - a[0, 2]) * (a[2, 1] - a[0, 1])
    n2y = (a[1, 2] - a[0, 2]) * (a[2, 0] - a[0, 0]) - (a[1, 0] - a[0, 0]) * (a[2, 2] - a[0, 2])
    n2z = (a[1, 0] - a[0, 0]) * (a[2, 1] - a[0, 1]) - (a[1, 1] - a[0, 1]) * (a[2, 0] - a[0, 0])
    e0 = n2x * (b[0, 0] - a[0, 0]) + n2y * (b[0, 1] - a[0, 1]) + n2z * (b[0, 2] - a[0, 2])
    e1 = n2x * (b[1, 0] - a[0, 0]) + n2y * (b[1, 1] - a[0, 1]) + n2z * (b[1, 2] - a[0, 2])
    e2 = n2x * (b[2, 0] - a[0, 0]) + n2y * (b[2, 1] - a[0, 1]) + n2z * (b[2, 2] - a[0, 2])
    if (e0 > 0.0 and e1 > 0.0 and e2 > 0.0) or (e0 < 0.0 and e1 < 0.0 and e2 < 0.0):
        return False
    return (
        _segment_meets(a[0], a[1], b[0], b[1], b[2], n1x, n1y, n1z, d0, d1)
        or _segment_meets(a[1], a[2], b[0], b[1], b[2], n1x, n1y, n1z, d1, d2)
        or _segment_meets(a[2], a[0], b[0], b[1], b[2], n1x, n1y, n1z, d2, d0)
        or _segment_meets(b[0], b[1], a[0], a[1], a[2], n2x, n2y, n2z, e0, e1)
        or _segment_meets(b[1], b[2], a[0], a[1], a[2], n2x, n2y, n2z, e1, e2)
        or _segment_meets(b[2], b[0], a[0], a[1], a[2], n2x, n2y, n2z, e2, e0)
    )


@njit(cache=True, inline="always")
def load_cell(vane, r, c, half, out):  # type: ignore[no-untyped-def]
    """Triangle `half` (0 or 1) of the cell between rows r, r + 1 and columns c, c + 1, into out (3, 3) float64."""
    for k in range(3):
        if half == 0:
            out[0, k], out[1, k], out[2, k] = vane[r, c, k], vane[r, c + 1, k], vane[r + 1, c + 1, k]
        else:
            out[0, k], out[1, k], out[2, k] = vane[r, c, k], vane[r + 1, c + 1, k], vane[r + 1, c, k]


@njit(cache=True, nogil=True)
def strip_boxes(vane, boxes):  # type: ignore[no-untyped-def]
    """Boxes (R - 1, 6) of the strips of a vane, low then high; the last row (R - 1) holds the whole."""
    rows, columns = vane.shape[0], vane.shape[1]
    for k in range(3):
        boxes[rows - 1, k], boxes[rows - 1, 3 + k] = math.inf, -math.inf
    for r in range(rows - 1):
        for k in range(3):
            low, high = vane[r, 0, k], vane[r, 0, k]
            for c in range(columns):
                low = min(low, vane[r, c, k], vane[r + 1, c, k])
                high = max(high, vane[r, c, k], vane[r + 1, c, k])
            boxes[r, k], boxes[r, 3 + k] = low, high
            boxes[rows - 1, k] = min(boxes[rows - 1, k], low)
            boxes[rows - 1, 3 + k] = max(boxes[rows - 1, 3 + k], high)


@njit(cache=True, inline="always")
def boxes_apart(a, b):  # type: ignore[no-untyped-def]
    """True when two boxes (6,) do not touch."""
    return (
        a[0] > b[3] or b[0] > a[3] or a[1] > b[4] or b[1] > a[4] or a[2] > b[5] or b[2] > a[5]
    )


@njit(cache=True, inline="always")
def _reach(t, k):  # type: ignore[no-untyped-def]
    return min(t[0, k], t[1, k], t[2, k]), max(t[0, k], t[1, k], t[2, k])


@njit(cache=True, nogil=True)
def vanes_meet(a, b, boxes_a, boxes_b, s, t):  # type: ignore[no-untyped-def]
    """True when two vanes (R, C, 3) pass through each other; s, t : (3, 3) float64 scratch."""
    rows_a, rows_b = a.shape[0], b.shape[0]
    whole_a, whole_b = boxes_a[rows_a - 1], boxes_b[rows_b - 1]
    if boxes_apart(whole_a, whole_b):
        return False
    for i in range(rows_a - 1):
        if boxes_apart(boxes_a[i], whole_b):
            continue
        for j in range(rows_b - 1):
            if boxes_apart(boxes_a[i], boxes_b[j]):
                continue
            for p in range(2 * (a.shape[1] - 1)):
                load_cell(a, i, p >> 1, p & 1, s)
                x0, x1 = _reach(s, 0)
                y0, y1 = _reach(s, 1)
                z0, z1 = _reach(s, 2)
                if (
                    x0 > boxes_b[j, 3] or boxes_b[j, 0] > x1 or y0 > boxes_b[j, 4] or boxes_b[j, 1] > y1
                    or z0 > boxes_b[j, 5] or boxes_b[j, 2] > z1
                ):
                    continue
                for q in range(2 * (b.shape[1] - 1)):
                    load_cell(b, j, q >> 1, q & 1, t)
                    if triangles_meet(s, t):
                        return True
    return False


@njit(cache=True, nogil=True)
def vane_meets_skin(vane, boxes, nodes, children, corners, stack, s, t):  # type: ignore[no-untyped-def]
    """True when a vane (R, C, 3) passes through the skin of a tree (see ``core.mesh.bvh.Bvh``)."""
    rows, columns = vane.shape[0], vane.shape[1]
    for r in range(rows - 1):
        box = boxes[r]
        node, top = 0, 0
        while True:
            following = -1
            for which in range(2):
                at = 6 * which
                if (
                    box[0] > nodes[node, at + 3] or nodes[node, at] > box[3]
                    or box[1] > nodes[node, at + 4] or nodes[node, at + 1] > box[4]
                    or box[2] > nodes[node, at + 5] or nodes[node, at + 2] > box[5]
                ):
                    continue
                child = children[node, which]
                if child >= 0:
                    if following < 0:
                        following = child
                    else:
                        stack[top] = child
                        top += 1
                    continue
                first = (~child >> 4) * LANES
                for slot in range(first, first + (~child & 15)):
                    apart = False
                    for k in range(3):
                        u, v, w = corners[slot, k], corners[slot, 3 + k], corners[slot, 6 + k]
                        if min(u, v, w) > box[3 + k] or max(u, v, w) < box[k] or not math.isfinite(u + v + w):
                            apart = True
                            break
                        t[0, k], t[1, k], t[2, k] = u, v, w
                    if apart:
                        continue
                    for p in range(2 * (columns - 1)):
                        load_cell(vane, r, p >> 1, p & 1, s)
                        if triangles_meet(s, t):
                            return True
            if following >= 0:
                node = following
            elif top > 0:
                top -= 1
                node = stack[top]
            else:
                break
    return False


@njit(types.void(F32_4D, types.int64, types.int64, types.float32[:, :, ::1]), cache=True, nogil=True)
def _boxes_of(vanes, start, stop, boxes):  # type: ignore[no-untyped-def]
    for i in range(start, stop):
        strip_boxes(vanes[i], boxes[i])


def vane_boxes(vanes: NDArray[np.float32], ranges: Ranges = serial_ranges) -> NDArray[np.float32]:
    """Boxes (N, R, 6) float32 of the strips of every vane, that of the whole last."""
    boxes = np.empty((len(vanes), vanes.shape[1], 6), np.float32)
    ranges(len(vanes), lambda start, stop: _boxes_of(vanes, start, stop, boxes), 1024)
    return boxes


@njit(
    types.void(
        F32_4D, F32_3D, I32_1D, I32_1D, types.int64, types.int64, types.boolean[::1]
    ),
    cache=True, nogil=True,
)
def _test_pairs(vanes, boxes, first, second, start, stop, meet):  # type: ignore[no-untyped-def]
    s, t = np.empty((3, 3)), np.empty((3, 3))
    for p in range(start, stop):
        i, j = first[p], second[p]
        meet[p] = vanes_meet(vanes[i], vanes[j], boxes[i], boxes[j], s, t)


@njit(
    types.void(
        F32_4D, F32_3D, F32_2D, I32_2D, F32_2D, I32_1D, types.int64, types.int64, types.boolean[::1]
    ),
    cache=True, nogil=True,
)
def _test_skin(vanes, boxes, nodes, children, corners, rows, start, stop, meet):  # type: ignore[no-untyped-def]
    s, t = np.empty((3, 3)), np.empty((3, 3))
    stack = np.empty(STACK_SIZE, np.int32)
    for k in range(start, stop):
        i = rows[k]
        meet[k] = vane_meets_skin(vanes[i], boxes[i], nodes, children, corners, stack, s, t)


def crossing_pairs(
    vanes: NDArray[np.float32], boxes: NDArray[np.float32], first: NDArray[np.int32], second: NDArray[np.int32],
    ranges: Ranges = serial_ranges,
) -> NDArray[np.bool_]:
    """Which of the pairs (`first`, `second`) (P,) int32 of vanes (N, R, C, 3) pass through each other, (P,) bool."""
    meet = np.zeros(len(first), np.bool_)
    ranges(len(first), lambda start, stop: _test_pairs(vanes, boxes, first, second, start, stop, meet), 1024)
    return meet


def skin_crossings(
    vanes: NDArray[np.float32], boxes: NDArray[np.float32], bvh: Bvh, rows: NDArray[np.int32] | None = None,
    ranges: Ranges = serial_ranges,
) -> NDArray[np.bool_]:
    """Which of the vanes (all, or those of `rows` (n,) int32) pass through the skin, (n,) bool."""
    rows = np.arange(len(vanes), dtype=np.int32) if rows is None else rows
    meet = np.zeros(len(rows), np.bool_)
    ranges(
        len(rows),
        lambda start, stop: _test_skin(
            vanes, boxes, bvh.boxes, bvh.children, bvh.corners, rows, start, stop, meet
        ),
        256,
    )
    return meet


@njit(types.int64(F32_2D, types.float64, types.int64, types.int32[:, ::1]), cache=True, nogil=True)
def _sweep(boxes, cell, room, found):  # type: ignore[no-untyped-def]
    """Pairs of boxes (N, 6) that touch, by a grid of `cell` metres; a pair belongs to the first cell of its overlap.

    Writes at most `room` pairs; returns how many there are.
    """
    n = len(boxes)
    low = np.empty(3)
    for k in range(3):
        low[k] = boxes[:, k].min()
    total = 0
    for i in range(n):
        cells = 1
        for k in range(3):
            cells *= int((boxes[i, 3 + k] - low[k]) / cell) - int((boxes[i, k] - low[k]) / cell) + 1
        total += cells
    key = np.empty(total, np.int64)
    who = np.empty(total, np.int32)
    at = 0
    for i in range(n):
        for x in range(int((boxes[i, 0] - low[0]) / cell), int((boxes[i, 3] - low[0]) / cell) + 1):
            for y in range(int((boxes[i, 1] - low[1]) / cell), int((boxes[i, 4] - low[1]) / cell) + 1):
                for z in range(int((boxes[i, 2] - low[2]) / cell), int((boxes[i, 5] - low[2]) / cell) + 1):
                    key[at] = (x << 40) | (y << 20) | z
                    who[at] = i
                    at += 1
    order = np.argsort(key, kind="mergesort")
    count = 0
    begin = 0
    while begin < total:
        end = begin
        here = key[order[begin]]
        while end < total and key[order[end]] == here:
            end += 1
        x, y, z = here >> 40, (here >> 20) & 0xFFFFF, here & 0xFFFFF
        for p in range(begin, end):
            i = who[order[p]]
            for q in range(p + 1, end):
                j = who[order[q]]
                if boxes_apart(boxes[i], boxes[j]):
                    continue
                # the pair is met in every cell both boxes lie in; it counts in the first
                if (
                    int((max(boxes[i, 0], boxes[j, 0]) - low[0]) / cell) == x
                    and int((max(boxes[i, 1], boxes[j, 1]) - low[1]) / cell) == y
                    and int((max(boxes[i, 2], boxes[j, 2]) - low[2]) / cell) == z
                ):
                    if count < room:
                        found[count, 0], found[count, 1] = min(i, j), max(i, j)
                    count += 1
        begin = end
    return count


def touching_boxes(boxes: NDArray[np.float32]) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Pairs (first, second), first < second, (P,) int32 each, of boxes (N, 6) float32 that touch."""
    if len(boxes) < 2:
        return np.zeros(0, np.int32), np.zeros(0, np.int32)
    extent = (boxes[:, 3:] - boxes[:, :3]).astype(np.float64)
    whole = float((boxes[:, 3:].max(0) - boxes[:, :3].min(0)).max())
    # a few very long feathers must not spread over millions of cells, nor the cells outgrow 20 bits a side
    cell = max(float(np.median(extent.max(1))), float(extent.max()) / 24.0, whole / 1e6, 1e-30)
    room = 32 * len(boxes)
    while True:
        found = np.empty((room, 2), np.int32)
        count = _sweep(boxes, cell, room, found)
        if count <= room:
            return np.ascontiguousarray(found[:count, 0]), np.ascontiguousarray(found[:count, 1])
        room = count


def neighbour_rows(count: int, first: NDArray[np.int32], second: NDArray[np.int32]) -> Pairs:
    """The pairs as rows of neighbours of each of `count` feathers."""
    own, other = np.concatenate([first, second]), np.concatenate([second, first])
    # the same order either way; numpy sorts whole numbers of 16 bits by radix, in a fraction of the time
    order = np.argsort(own.astype(np.uint16) if count <= 1 << 16 else own, kind="stable")
    start = np.zeros(count + 1, np.int32)
    np.cumsum(np.bincount(own, minlength=count), out=start[1:])
    return Pairs(start, other[order].astype(np.int32))
