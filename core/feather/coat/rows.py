"""Rows of places along the lines on which a field over the skin is constant, like roof tiles or on a square grid."""

from __future__ import annotations

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from core.feather.coat.posing import F32_2D
from core.mesh.bvh import I32_2D
from core.mesh.scatter import Scatter

F64_1D = types.Array(types.float64, 1, "C", readonly=True)
HALVINGS = 26


@njit(cache=True, inline="always")
def _other_edge(triangles, values, f, at, enter):  # type: ignore[no-untyped-def]
    """The edge of triangle f, but `enter`, that the line crosses; -1 when there is none."""
    for c in range(3):
        if c != enter and (values[triangles[f, c]] < at) != (values[triangles[f, (c + 1) % 3]] < at):
            return c
    return -1


@njit(cache=True, nogil=True)
def _edge_twins(triangles):  # type: ignore[no-untyped-def]
    """The half-edge 3 f + c on the other side of each, -1 at a border; where more than two meet they pair up."""
    count = len(triangles)
    edge = np.empty(3 * count, np.int64)
    for f in range(count):
        for c in range(3):
            a, b = triangles[f, c], triangles[f, (c + 1) % 3]
            edge[3 * f + c] = (np.int64(min(a, b)) << 32) | max(a, b)
    order = np.argsort(edge, kind="mergesort")
    twin = np.full(3 * count, -1, np.int64)
    k = 0
    while k < 3 * count - 1:
        if edge[order[k]] == edge[order[k + 1]]:
            twin[order[k]], twin[order[k + 1]] = order[k + 1], order[k]
            k += 1
        k += 1
    return twin


@njit(cache=True, nogil=True)
def _crossing(points, triangles, values, f, c, at, place, weights):  # type: ignore[no-untyped-def]
    """Where the line crosses edge c of triangle f: place (3,) and weights of the corners (3,)."""
    a, b = triangles[f, c], triangles[f, (c + 1) % 3]
    t = (at - values[a]) / (values[b] - values[a])
    for k in range(3):
        place[k] = points[a, k] + t * (np.float64(points[b, k]) - points[a, k])
        weights[k] = 0.0
    weights[c], weights[(c + 1) % 3] = 1.0 - t, t


@njit(
    types.int64(
        F32_2D, I32_2D, F64_1D, types.float64, types.float64, types.float64, types.boolean, types.int64,
        types.int32[::1], types.float32[:, ::1],
    ),
    cache=True, nogil=True,
)
def _lay(points, triangles, values, first, step, spacing, brick, room, triangle, bary):  # type: ignore[no-untyped-def]
    """Places every `spacing` metres along the lines where values are first + k step; how many there are."""
    count = len(triangles)
    twin = _edge_twins(triangles)
    least, widest, high = np.empty(count), 0.0, -np.inf
    for f in range(count):
        a, b, c = values[triangles[f, 0]], values[triangles[f, 1]], values[triangles[f, 2]]
        least[f] = min(a, b, c)
        widest, high = max(widest, max(a, b, c) - least[f]), max(high, a, b, c)
    by_least = np.argsort(least, kind="mergesort")
    sorted_least = least[by_least]
    seen = np.full(count, -1, np.int64)
    p, q, wp, wq = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    made = level = 0
    while first + level * step <= high:
        at = first + level * step
        begin, end = np.searchsorted(sorted_least, at - widest), np.searchsorted(sorted_least, at, side="right")
        for k in range(begin, end):
            start = by_least[k]
            if seen[start] == level:
                continue
            edge = _other_edge(triangles, values, start, at, -1)
            if edge < 0:
                continue
            # back to the beginning of the line, or once round
            f, enter = start, edge
            for _ in range(count):
                leave = _other_edge(triangles, values, f, at, enter)
                following = twin[3 * f + leave]
                if following < 0 or following // 3 == start or seen[following // 3] == level:
                    enter = leave
                    break
                f, enter = following // 3, following % 3
            else:
                enter = leave
            # and forth, laying places
            carried = (0.5 if brick and level % 2 else 0.0) * spacing
            while f >= 0 and seen[f] != level:
                seen[f] = level
                leave = _other_edge(triangles, values, f, at, enter)
                _crossing(points, triangles, values, f, enter, at, p, wp)
                _crossing(points, triangles, values, f, leave, at, q, wq)
                length = np.sqrt((q[0] - p[0]) ** 2 + (q[1] - p[1]) ** 2 + (q[2] - p[2]) ** 2)
                while carried < length:
                    u = carried / length
                    if made < room:
                        triangle[made] = f
                        for c in range(3):
                            bary[made, c] = (1.0 - u) * wp[c] + u * wq[c]
                    made += 1
                    carried += spacing
                carried -= length
                following = twin[3 * f + leave]
                f, enter = (following // 3, following % 3) if following >= 0 else (-1, 0)
        level += 1
    return made


def along_rows(
    points: NDArray[np.float32], triangles: NDArray[np.int32], values: NDArray[np.float64], count: int,
    brick: bool = True, ratio: float = 0.866,
) -> Scatter:
    """At least nearly `count` places in rows, the spacing found by halving; row by row.

    Parameters
    ----------
    points : (V, 3). triangles : (T, 3). values : (V,) float64, the field, in metres of distance where rows shall be
        as far apart as `ratio` of the spacing in them.
    brick : every second row is moved by half a spacing.

    Returns
    -------
    As few as the spacing allows but `count` or more; none where the field is flat.
    """
    used = values[triangles]
    reach = float(np.ptp(used)) if used.size else 0.0
    if not (np.isfinite(reach) and reach > 0.0) or count == 0:
        return Scatter(np.zeros(0, np.int32), np.zeros((0, 3), np.float32))
    room = 2 * count + 64
    triangle, bary = np.empty(room, np.int32), np.empty((room, 3), np.float32)
    corners = points[triangles].astype(np.float64)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = 0.5 * float(np.linalg.norm(normals, axis=1).sum())
    guess = max(np.sqrt(area / count), reach * 1e-4)
    values = np.ascontiguousarray(values, np.float64)
    triangles = np.ascontiguousarray(triangles, np.int32)

    def lay(h: float) -> int:
        first = float(used.min()) + 0.25 * ratio * h
        return int(_lay(points, triangles, values, first, ratio * h, h, brick, room, triangle, bary))

    small, large = 0.5 * guess, 2.0 * guess
    while lay(small) < count and small > 1e-3 * guess:
        small *= 0.5
    for _ in range(HALVINGS):
        middle = 0.5 * (small + large)
        made = lay(middle)
        if made >= count:
            small = middle
            if made <= count + max(2, count // 500):
                break
        else:
            large = middle
    made = min(lay(small), room)
    return Scatter(triangle[:made].copy(), bary[:made].copy())
