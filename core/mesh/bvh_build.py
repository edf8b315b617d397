"""Building and refitting a bounding volume hierarchy (kernels)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from core.mesh.bvh_kernels import LANES, STACK_SIZE

F32_2D = types.Array(types.float32, 2, "C", readonly=True)
I32_1D = types.Array(types.int32, 1, "C", readonly=True)
I32_2D = types.Array(types.int32, 2, "C", readonly=True)
BUILT = types.Tuple((types.int64, types.int32[::1]))  # type: ignore[no-untyped-call]

MAX_SAH_DEPTH = 30  # deeper nodes are halved by count, so that no tree outgrows the stack
BINS = 16
HUGE = np.float32(1e30)
FAR_AWAY = np.float32(1e15)  # its square is still a float32


@njit(
    types.void(F32_2D, I32_2D, I32_1D, types.float32[:, ::1], types.float32[:, :, ::1]), cache=True, nogil=True
)
def gather_corners(points, triangles, order, corners, blocks):  # type: ignore[no-untyped-def]
    """Copy the corners of the triangle in each slot, by slot and in lanes; empty slots are not finite, or far away."""
    for s in range(len(order)):
        total = np.float32(0.0)
        for j in range(3):
            for k in range(3):
                value = points[triangles[order[s], j], k] if order[s] >= 0 else np.float32(np.nan)
                corners[s, 3 * j + k] = value
                total += value
        finite = math.isfinite(total)
        for k in range(9):
            blocks[s // LANES, k, s % LANES] = corners[s, k] if finite else FAR_AWAY


@njit(cache=True, inline="always")
def _clear_box(boxes, i, at):  # type: ignore[no-untyped-def]
    for k in range(3):
        boxes[i, at + k] = HUGE
        boxes[i, at + 3 + k] = -HUGE


@njit(cache=True, inline="always")
def _grow_and_measure(box, bin_boxes, b):  # type: ignore[no-untyped-def]
    """Join bin b to the box; half the surface of the result (0 while empty)."""
    for k in range(3):
        box[0, k] = min(box[0, k], bin_boxes[b, k])
        box[0, 3 + k] = max(box[0, 3 + k], bin_boxes[b, 3 + k])
    if box[0, 0] > box[0, 3]:
        return 0.0
    x = np.float64(box[0, 3]) - box[0, 0]
    y = np.float64(box[0, 4]) - box[0, 1]
    z = np.float64(box[0, 5]) - box[0, 2]
    return x * y + y * z + z * x


@njit(BUILT(F32_2D, I32_2D, types.float32[:, ::1], types.int32[:, ::1]), cache=True, nogil=True)
def build_tree(points, triangles, boxes, children):  # type: ignore[no-untyped-def]
    """Fill boxes and children; returns the number of nodes and the triangle of each slot (-1: an empty lane)."""
    count = len(triangles)
    order = np.arange(count).astype(np.int32)
    slots = np.full(LANES * max(1, count), -1, np.int32)
    leaves = 0
    tri_boxes = np.empty((count, 6), np.float32)
    centres = np.empty((count, 3), np.float32)
    for t in range(count):
        finite = True
        for k in range(3):
            a, b, c = points[triangles[t, 0], k], points[triangles[t, 1], k], points[triangles[t, 2], k]
            finite = finite and math.isfinite(a + b + c)
            lo, hi = min(a, b, c), max(a, b, c)
            tri_boxes[t, k], tri_boxes[t, 3 + k] = lo, hi
            centres[t, k] = np.float32(0.5) * lo + np.float32(0.5) * hi
        if not finite:
            _clear_box(tri_boxes, t, 0)
            for k in range(3):
                centres[t, k] = 0.0

    # open ranges of slots: where they start and end, and the node and side that wait for them
    todo = np.empty((2 * STACK_SIZE, 5), np.int64)
    bin_boxes = np.empty((BINS, 6), np.float32)
    bin_counts = np.empty(BINS, np.int64)
    suffix_areas = np.empty(BINS, np.float64)
    box = np.empty((1, 6), np.float32)
    nodes = 1
    for side in range(2):
        _clear_box(boxes, 0, 6 * side)
        children[0, side] = ~0
    open_ranges = 0
    if count > 0:
        todo[0, 0], todo[0, 1], todo[0, 2], todo[0, 3], todo[0, 4] = 0, count, -1, 0, 0
        open_ranges = 1
    while open_ranges > 0:
        open_ranges -= 1
        start, stop = todo[open_ranges, 0], todo[open_ranges, 1]
        parent, side, depth = todo[open_ranges, 2], todo[open_ranges, 3], todo[open_ranges, 4]
        _clear_box(box, 0, 0)
        c0x = c0y = c0z = HUGE
        c1x = c1y = c1z = -HUGE
        for s in range(start, stop):
            t = order[s]
            for k in range(3):
                box[0, k] = min(box[0, k], tri_boxes[t, k])
                box[0, 3 + k] = max(box[0, 3 + k], tri_boxes[t, 3 + k])
            x, y, z = centres[t, 0], centres[t, 1], centres[t, 2]
            c0x, c1x = min(c0x, x), max(c1x, x)
            c0y, c1y = min(c0y, y), max(c1y, y)
            c0z, c1z = min(c0z, z), max(c1z, z)
        if parent >= 0:
            for k in range(6):
                boxes[parent, 6 * side + k] = box[0, k]
        size = stop - start
        if size <= LANES:
            leaf = np.int32(~(leaves * 2 * LANES + size))
            for s in range(size):
                slots[LANES * leaves + s] = order[start + s]
            leaves += 1
            if parent >= 0:
                children[parent, side] = leaf
            else:  # a whole mesh of one leaf: the root's second child stays empty
                for k in range(6):
                    boxes[0, k] = box[0, k]
                children[0, 0] = leaf
            continue

        axis, low, extent = 0, c0x, c1x - c0x
        if c1y - c0y > extent:
            axis, low, extent = 1, c0y, c1y - c0y
        if c1z - c0z > extent:
            axis, low, extent = 2, c0z, c1z - c0z
        middle = start
        if depth < MAX_SAH_DEPTH and extent > 0.0:
            to_bin = np.float32(BINS * 0.999) / extent
            for b in range(BINS):
                _clear_box(bin_boxes, b, 0)
                bin_counts[b] = 0
            for s in range(start, stop):
                t = order[s]
                b = min(BINS - 1, max(0, int((centres[t, axis] - low) * to_bin)))
                bin_counts[b] += 1
                for k in range(3):
                    bin_boxes[b, k] = min(bin_boxes[b, k], tri_boxes[t, k])
                    bin_boxes[b, 3 + k] = max(bin_boxes[b, 3 + k], tri_boxes[t, 3 + k])
            _clear_box(box, 0, 0)
            for b in range(BINS - 1, 0, -1):
                suffix_areas[b] = _grow_and_measure(box, bin_boxes, b)
            _clear_box(box, 0, 0)
            best, cut, left = np.inf, -1, 0
            for b in range(BINS - 1):
                area = _grow_and_measure(box, bin_boxes, b)
                left += bin_counts[b]
                if 0 < left < size:
                    cost = area * left + suffix_areas[b + 1] * (size - left)
                    if cost < best:
                        best, cut = cost, b
            if cut >= 0:
                middle, last = start, stop - 1
                while middle <= last:
                    t = order[middle]
                    if min(BINS - 1, max(0, int((centres[t, axis] - low) * to_bin))) <= cut:
                        middle += 1
                    else:
                        order[middle] = order[last]
                        order[last] = t
                        last -= 1
        if middle <= start or middle >= stop:
            middle = (start + stop) // 2
        node = 0
        if parent >= 0:
            node = nodes
            nodes += 1
            children[parent, side] = node
        for which in range(2):
            todo[open_ranges, 0] = start if which == 1 else middle
            todo[open_ranges, 1] = middle if which == 1 else stop
            todo[open_ranges, 2], todo[open_ranges, 3], todo[open_ranges, 4] = node, 1 - which, depth + 1
            open_ranges += 1
    return nodes, slots[: LANES * max(1, leaves)].copy()


@njit(types.void(I32_2D, F32_2D, types.float32[:, ::1]), cache=True, nogil=True)
def refit_boxes(children, corners, boxes):  # type: ignore[no-untyped-def]
    for node in range(len(children) - 1, -1, -1):  # a child has always a higher number than its parent
        for side in range(2):
            at = 6 * side
            _clear_box(boxes, node, at)
            child = children[node, side]
            if child >= 0:
                for k in range(3):
                    boxes[node, at + k] = min(boxes[child, k], boxes[child, 6 + k])
                    boxes[node, at + 3 + k] = max(boxes[child, 3 + k], boxes[child, 9 + k])
            else:
                leaf = ~child
                first = (leaf >> 4) * LANES
                for s in range(first, first + (leaf & 15)):
                    total = np.float32(0.0)
                    for k in range(9):
                        total += corners[s, k]
                    if not math.isfinite(total):
                        continue
                    for k in range(9):
                        axis = k % 3
                        boxes[node, at + axis] = min(boxes[node, at + axis], corners[s, k])
                        boxes[node, at + 3 + axis] = max(boxes[node, at + 3 + axis], corners[s, k])
