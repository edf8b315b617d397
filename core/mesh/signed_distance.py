"""Which side of the skin: exact signed distances by angle-weighted pseudo-normals.

Baerentzen and Aanaes, "Signed Distance Computation Using the Angle Weighted Pseudonormal", 2005: the sign is that of
the offset against the pseudo-normal of the closest feature (face, edge or vertex). On a closed skin it is right
everywhere. On an open one it is right near the skin and positive (outside) where the closest feature is the border.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from core.mesh.bvh import Bvh, build_bvh, closest_one, new_stack
from core.mesh.normals import face_normals, vertex_normals
from core.workers import Workers, serial_ranges

F32_2D = types.Array(types.float32, 2, "C", readonly=True)
F32_3D = types.Array(types.float32, 3, "C", readonly=True)
I32_2D = types.Array(types.int32, 2, "C", readonly=True)


class SignedSkin(NamedTuple):
    """Triangles ready for signed queries.

    bvh : the hierarchy.
    pseudo : (S, 7, 3) float32, in slots of the hierarchy: pseudo-normals of the face, of the edges a-b, b-c, c-a and
        of the corners a, b, c; zero on a border.
    closed : every edge has two faces that run along it in opposite directions.
    """

    bvh: Bvh
    pseudo: NDArray[np.float32]
    closed: bool


def build_signed_skin(points: NDArray[np.float32], triangles: NDArray[np.int32]) -> SignedSkin:
    """Prepare `triangles` (T, 3) int32 of `points` (V, 3) float32; points at the same place count as one."""
    bvh = build_bvh(points, triangles)
    welded = weld(points)[triangles]
    normals = face_normals(points, triangles)
    whole = (welded != np.roll(welded, -1, 1)).all(1)  # a triangle with two equal corners borders nothing
    count = int(welded.max(initial=-1)) + 1
    first, second = welded, np.roll(welded, -1, 1)
    keys = np.minimum(first, second).astype(np.int64) * max(1, count) + np.maximum(first, second)
    _, edge, uses = np.unique(keys[whole], return_inverse=True, return_counts=True)
    edge = edge.reshape(-1, 3)
    forward = (first < second)[whole]
    balance = np.bincount(edge.ravel(), np.where(forward, 1, -1).ravel(), len(uses))
    sums = np.stack(
        [np.bincount(edge.ravel(), np.repeat(normals[whole, k], 3), len(uses)) for k in range(3)], axis=1
    )
    border_edge = uses == 1
    sums[border_edge] = 0.0
    border_vertex = np.zeros(count, bool)
    border_vertex[first[whole][border_edge[edge]]] = True
    border_vertex[second[whole][border_edge[edge]]] = True
    places = np.zeros((count, 3), np.float32)
    places[welded] = points[triangles]
    corner = vertex_normals(places, welded.astype(np.int32))
    corner[border_vertex] = 0.0

    pseudo = np.zeros((len(triangles), 7, 3), np.float32)
    pseudo[:, 0] = normals
    pseudo[whole, 1:4] = sums[edge]
    pseudo[:, 4:7] = corner[welded]
    closed = bool(len(uses) > 0 and (uses == 2).all() and (balance == 0).all())
    pseudo_of_slots = np.zeros((len(bvh.order), 7, 3), np.float32)
    filled = bvh.order >= 0
    pseudo_of_slots[filled] = pseudo[bvh.order[filled]]
    return SignedSkin(bvh, pseudo_of_slots, closed)


def weld(points: NDArray[np.float32]) -> NDArray[np.int32]:
    """A number for each of `points` (V, 3), the same for points at exactly the same place; (V,) int32 from 0."""
    if not len(points):
        return np.zeros(0, np.int32)
    clean = points + np.float32(0.0)  # -0 and 0 are one place
    rows = np.lexsort(clean.T)
    changes = (clean[rows[1:]] != clean[rows[:-1]]).any(1)
    numbers = np.empty(len(points), np.int32)
    numbers[rows] = np.concatenate([[0], np.cumsum(changes)])
    return numbers


def signed_distances(
    skin: SignedSkin, queries: NDArray[np.float32], max_distance: float = math.inf, workers: Workers | None = None
) -> NDArray[np.float32]:
    """Signed distances (N,) float32 of `queries` (N, 3) float32, negative inside.

    Farther than `max_distance`, or for a query that is not finite: +infinity, on either side.
    """
    queries = np.ascontiguousarray(queries, np.float32)
    out = np.empty(len(queries), np.float32)
    bvh = skin.bvh

    def rows(start: int, stop: int) -> None:
        _rows(
            bvh.boxes, bvh.children, bvh.corners, bvh.blocks, skin.pseudo, queries, float(max_distance), out,
            start, stop,
        )

    (serial_ranges if workers is None else workers.ranges)(len(queries), rows)
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def is_inside(corners, pseudo, slot, b0, b1, b2, x, y, z):  # type: ignore[no-untyped-def]
    """True when (x, y, z), whose closest point is known, lies behind the skin (kernel form)."""
    # which feature: a weight of zero says that the closest point lies on the opposite edge
    tiny = 1e-9
    feature = 0
    if b0 <= tiny:
        feature = 2
        if b1 <= tiny:
            feature = 6
        elif b2 <= tiny:
            feature = 5
    elif b1 <= tiny:
        feature = 4 if b2 <= tiny else 3
    elif b2 <= tiny:
        feature = 1
    px = b0 * corners[slot, 0] + b1 * corners[slot, 3] + b2 * corners[slot, 6]
    py = b0 * corners[slot, 1] + b1 * corners[slot, 4] + b2 * corners[slot, 7]
    pz = b0 * corners[slot, 2] + b1 * corners[slot, 5] + b2 * corners[slot, 8]
    nx, ny, nz = pseudo[slot, feature, 0], pseudo[slot, feature, 1], pseudo[slot, feature, 2]
    return (x - px) * nx + (y - py) * ny + (z - pz) * nz < 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def signed_one(boxes, children, corners, blocks, pseudo, x, y, z, limit2, stack, keys):  # type: ignore[no-untyped-def]
    """Signed distance from the skin to (x, y, z) float32 (kernel form); +inf when farther than sqrt(limit2)."""
    slot, d2, b0, b1, b2 = closest_one(boxes, children, corners, blocks, x, y, z, limit2, stack, keys)
    if slot < 0:
        return np.inf
    d = math.sqrt(d2)
    return -d if is_inside(corners, pseudo, slot, b0, b1, b2, x, y, z) else d


@njit(
    types.void(
        F32_2D, I32_2D, F32_2D, F32_3D, F32_3D, F32_2D, types.float64, types.float32[::1], types.int64, types.int64
    ),
    cache=True, nogil=True, error_model="numpy",
)
def _rows(boxes, children, corners, blocks, pseudo, queries, max_distance, out, start, stop):  # type: ignore[no-untyped-def]
    stack, keys = new_stack()
    limit2 = max_distance * max_distance * (1.0 + 1e-12)
    for i in range(start, stop):
        x, y, z = queries[i, 0], queries[i, 1], queries[i, 2]
        out[i] = signed_one(boxes, children, corners, blocks, pseudo, x, y, z, limit2, stack, keys)
