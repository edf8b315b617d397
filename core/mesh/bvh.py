"""A bounding volume hierarchy over triangles: closest points, rays and segments.

Binary tree by binned surface area heuristic (Wald, "On fast Construction of SAH-based Bounding Volume Hierarchies",
2007); a node holds the boxes of its two children so that one read decides where to go. Boxes are float32, tests on
triangles are float64. Inner functions (`closest_one`, `ray_one`, `any_hit_segment`) take plain arrays so that other
kernels can call them; each needs a `stack` from `new_stack()`, made once per kernel call.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from core.mesh.bvh_build import build_tree, gather_corners, refit_boxes
from core.mesh.bvh_kernels import LANES, any_hit_segment, closest_on_triangle, closest_one, new_stack, ray_one
from core.mesh.morton import morton_codes
from core.workers import Workers, serial_ranges

F32_2D = types.Array(types.float32, 2, "C", readonly=True)
F32_3D = types.Array(types.float32, 3, "C", readonly=True)
I32_1D = types.Array(types.int32, 1, "C", readonly=True)
I32_2D = types.Array(types.int32, 2, "C", readonly=True)

CELL_BITS = 5  # of each axis, in which closest points are looked for cell by cell

__all__ = [
    "Bvh", "any_hit_segment", "build_bvh", "cast_rays", "closest_on_triangle", "closest_one", "closest_points",
    "hit_segments", "new_stack", "ray_one", "refit",
]


class Bvh(NamedTuple):
    """A hierarchy over T triangles, M nodes.

    boxes : (M, 12) float32, low xyz and high xyz of the first child, then of the second.
    children : (M, 2) int32, >= 0 another node, else ``~(leaf * 16 + count)``; the slots of a leaf begin at leaf * 8.
    order : (S,) int32, the triangle in each slot, -1 in an empty one.
    corners : (S, 9) float32, the three points of the triangle in each slot.
    blocks : (S / 8, 9, 8) float32, the same numbers a leaf at a time, for tests of 8 triangles at once.
    triangles : (T, 3) int32, vertices of each triangle (as given).
    """

    boxes: NDArray[np.float32]
    children: NDArray[np.int32]
    order: NDArray[np.int32]
    corners: NDArray[np.float32]
    blocks: NDArray[np.float32]
    triangles: NDArray[np.int32]


def build_bvh(points: NDArray[np.float32], triangles: NDArray[np.int32]) -> Bvh:
    """Build over `triangles` (T, 3) int32 of `points` (V, 3) float32.

    Degenerate triangles are kept (they are points or segments); those with a vertex that is not finite are never hit.
    """
    points = np.ascontiguousarray(points, np.float32)
    triangles = np.ascontiguousarray(triangles, np.int32)
    room = max(1, len(triangles))
    boxes = np.empty((room, 12), np.float32)
    children = np.empty((room, 2), np.int32)
    nodes, order = build_tree(points, triangles, boxes, children)
    corners, blocks = _gathered(points, triangles, order)
    return Bvh(boxes[:nodes].copy(), children[:nodes].copy(), order, corners, blocks, triangles)


def _gathered(
    points: NDArray[np.float32], triangles: NDArray[np.int32], order: NDArray[np.int32]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    corners = np.empty((len(order), 9), np.float32)
    blocks = np.empty((len(order) // LANES, 9, LANES), np.float32)
    gather_corners(points, triangles, order, corners, blocks)
    return corners, blocks


def refit(bvh: Bvh, points: NDArray[np.float32]) -> Bvh:
    """The same tree around moved `points` (V, 3) float32: quick, and good while the skin keeps its general shape."""
    corners, blocks = _gathered(np.ascontiguousarray(points, np.float32), bvh.triangles, bvh.order)
    boxes = np.empty_like(bvh.boxes)
    refit_boxes(bvh.children, corners, boxes)
    return bvh._replace(corners=corners, blocks=blocks, boxes=boxes)


def closest_points(
    bvh: Bvh, queries: NDArray[np.float32], max_distance: float = math.inf, workers: Workers | None = None
) -> tuple[NDArray[np.int32], NDArray[np.float32], NDArray[np.float32]]:
    """The nearest point of the skin for each of `queries` (N, 3) float32.

    Returns
    -------
    triangle : (N,) int32, -1 where nothing lies within `max_distance` (or the query is not finite).
    barycentric : (N, 3) float32, weights of that triangle's corners (zeros where none).
    distance : (N,) float32 (infinite where none).
    """
    queries = np.ascontiguousarray(queries, np.float32)
    count = len(queries)
    triangle = np.empty(count, np.int32)
    barycentric = np.empty((count, 3), np.float32)
    distance = np.empty(count, np.float32)
    by_place = np.argsort(_cells(bvh, queries), kind="stable").astype(np.int32)

    def rows(start: int, stop: int) -> None:
        _closest_rows(
            bvh.boxes, bvh.children, bvh.order, bvh.corners, bvh.blocks, queries, by_place, float(max_distance),
            triangle, barycentric, distance, start, stop,
        )

    _ranges(workers)(count, rows)
    return triangle, barycentric, distance


def cast_rays(
    bvh: Bvh,
    origins: NDArray[np.float32],
    directions: NDArray[np.float32],
    max_distance: float = math.inf,
    workers: Workers | None = None,
) -> tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.float32]]:
    """The first triangle each ray meets, from either side.

    Parameters
    ----------
    origins, directions : (N, 3) float32; directions need not be unit.
    max_distance : in lengths of the direction, as is the distance returned.

    Returns
    -------
    distance : (N,) float32, the hit is ``origin + distance * direction``; infinite where nothing is met.
    triangle : (N,) int32, -1 where nothing is met.
    barycentric : (N, 3) float32.
    """
    origins = np.ascontiguousarray(origins, np.float32)
    directions = np.ascontiguousarray(directions, np.float32)
    count = len(origins)
    distance = np.empty(count, np.float32)
    triangle = np.empty(count, np.int32)
    barycentric = np.empty((count, 3), np.float32)

    def rows(start: int, stop: int) -> None:
        _ray_rows(
            bvh.boxes, bvh.children, bvh.order, bvh.corners, origins, directions, float(max_distance),
            distance, triangle, barycentric, start, stop,
        )

    _ranges(workers)(count, rows)
    return distance, triangle, barycentric


def hit_segments(
    bvh: Bvh, starts: NDArray[np.float32], ends: NDArray[np.float32], workers: Workers | None = None
) -> NDArray[np.bool_]:
    """True (N,) where the segment from `starts` to `ends` (N, 3) float32 meets the skin, end points included."""
    starts = np.ascontiguousarray(starts, np.float32)
    ends = np.ascontiguousarray(ends, np.float32)
    out = np.empty(len(starts), np.bool_)

    def rows(start: int, stop: int) -> None:
        _segment_rows(bvh.boxes, bvh.children, bvh.corners, starts, ends, out, start, stop)

    _ranges(workers)(len(starts), rows)
    return out


def _cells(bvh: Bvh, queries: NDArray[np.float32]) -> NDArray[np.uint16]:
    """Cells of the queries along a curve through the box of the skin (16 bits, which numpy sorts by radix)."""
    box = bvh.boxes[0].reshape(2, 2, 3).astype(np.float64)
    return morton_codes(queries, box[:, 0].min(0), box[:, 1].max(0), CELL_BITS).astype(np.uint16)


def _ranges(workers: Workers | None) -> Callable[..., None]:
    return serial_ranges if workers is None else workers.ranges


@njit(
    types.void(
        F32_2D, I32_2D, I32_1D, F32_2D, F32_3D, F32_2D, I32_1D, types.float64,
        types.int32[::1], types.float32[:, ::1], types.float32[::1], types.int64, types.int64,
    ),
    cache=True, nogil=True, error_model="numpy",
)
def _closest_rows(  # type: ignore[no-untyped-def]
    boxes, children, order, corners, blocks, queries, by_place, max_distance, triangle, barycentric, distance,
    start, stop
):
    """Queries ``by_place[start:stop]``. What was nearest to the one before bounds the search for the next; a little
    more than that is searched, so that of equally near triangles the same is found whatever came before."""
    stack, keys = new_stack()
    limit2 = max_distance * max_distance * (1.0 + 1e-12)  # a point exactly at the limit is within it
    last = -1
    for at in range(start, stop):
        i = by_place[at]
        x, y, z = queries[i, 0], queries[i, 1], queries[i, 2]
        bound = limit2
        if last >= 0:
            known = closest_on_triangle(corners, last, np.float64(x), np.float64(y), np.float64(z))[0]
            bound = min(limit2, known * (1.0 + 1e-5) + 1e-300) if known < limit2 else limit2
        slot, d2, b0, b1, b2 = closest_one(boxes, children, corners, blocks, x, y, z, bound, stack, keys)
        if slot < 0 and bound < limit2:  # lost to rounding
            slot, d2, b0, b1, b2 = closest_one(boxes, children, corners, blocks, x, y, z, limit2, stack, keys)
        last = slot if slot >= 0 else last
        triangle[i] = order[slot] if slot >= 0 else -1
        barycentric[i, 0], barycentric[i, 1], barycentric[i, 2] = b0, b1, b2
        distance[i] = math.sqrt(d2) if slot >= 0 else np.inf


@njit(
    types.void(
        F32_2D, I32_2D, I32_1D, F32_2D, F32_2D, F32_2D, types.float64,
        types.float32[::1], types.int32[::1], types.float32[:, ::1], types.int64, types.int64,
    ),
    cache=True, nogil=True,
)
def _ray_rows(  # type: ignore[no-untyped-def]
    boxes, children, order, corners, origins, directions, limit, distance, triangle, barycentric, start, stop
):
    stack, keys = new_stack()
    for i in range(start, stop):
        slot, t, b0, b1, b2 = ray_one(
            boxes, children, corners, origins[i, 0], origins[i, 1], origins[i, 2],
            directions[i, 0], directions[i, 1], directions[i, 2], limit, False, stack, keys,
        )
        triangle[i] = order[slot] if slot >= 0 else -1
        distance[i] = t if slot >= 0 else np.inf
        barycentric[i, 0], barycentric[i, 1], barycentric[i, 2] = b0, b1, b2


@njit(
    types.void(F32_2D, I32_2D, F32_2D, F32_2D, F32_2D, types.boolean[::1], types.int64, types.int64),
    cache=True, nogil=True,
)
def _segment_rows(boxes, children, corners, starts, ends, out, start, stop):  # type: ignore[no-untyped-def]
    stack, keys = new_stack()
    for i in range(start, stop):
        out[i] = any_hit_segment(
            boxes, children, corners, starts[i, 0], starts[i, 1], starts[i, 2],
            ends[i, 0], ends[i, 1], ends[i, 2], stack, keys,
        )
