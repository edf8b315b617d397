"""Normals and areas of triangles, vertices and polygons, as flat functions over arrays."""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from core.mesh.mesh import Mesh

F32_2D = types.Array(types.float32, 2, "C", readonly=True)
I32_1D = types.Array(types.int32, 1, "C", readonly=True)
I32_2D = types.Array(types.int32, 2, "C", readonly=True)


def face_normals(points: NDArray[np.float32], triangles: NDArray[np.int32]) -> NDArray[np.float32]:
    """Unit normals (T, 3) float32 of `triangles` (T, 3) int32 over `points` (V, 3) float32.

    Counter-clockwise corners seen from outside; a triangle without area gets a zero normal.
    """
    return _normals_and_areas(points, triangles)[0]


def face_areas(points: NDArray[np.float32], triangles: NDArray[np.int32]) -> NDArray[np.float64]:
    """Areas (T,) float64, in the square of the unit of `points`."""
    return _normals_and_areas(points, triangles)[1]


def vertex_normals(points: NDArray[np.float32], triangles: NDArray[np.int32]) -> NDArray[np.float32]:
    """Unit normals (V, 3) float32 of the vertices: faces weighted by their angle at the vertex.

    Does not depend on how a flat region is triangulated (Thuermer and Wuethrich, "Computing Vertex Normals from
    Polygonal Facets", 1998). A vertex without a face of some area gets a zero normal.
    """
    counts = np.full(len(triangles), 3, np.int32)
    return _polygon_vertex_normals(points, counts, np.ascontiguousarray(triangles, np.int32).reshape(-1))


def mesh_normals(
    mesh: Mesh, points: NDArray[np.float32] | None = None,
    known: tuple[NDArray[np.float32], NDArray[np.float32]] | None = None,
) -> NDArray[np.float32]:
    """Angle-weighted unit normals (V, 3) float32 of the vertices of a polygon mesh.

    points : (V, 3) float32, deformed positions instead of those of the mesh at rest.
    known : points and normals (V, 3) float32 of this mesh as it was before some vertices moved: only normals around
        these are made anew, and all are what they would be without it, to the last bit.
    """
    return _polygon_vertex_normals(mesh.points if points is None else points, mesh.counts, mesh.corners, known)


def _normals_and_areas(
    points: NDArray[np.float32], triangles: NDArray[np.int32]
) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    normals = np.empty((len(triangles), 3), np.float32)
    areas = np.empty(len(triangles), np.float64)
    _faces(np.ascontiguousarray(points, np.float32), np.ascontiguousarray(triangles, np.int32), normals, areas)
    return normals, areas


def _polygon_vertex_normals(
    points: NDArray[np.float32], counts: NDArray[np.int32], corners: NDArray[np.int32],
    known: tuple[NDArray[np.float32], NDArray[np.float32]] | None = None,
) -> NDArray[np.float32]:
    points = np.ascontiguousarray(points, np.float32)
    total = np.zeros((len(points), 3), np.float64)
    if known is None:
        turned, normals = np.ones(len(points), np.bool_), np.empty((len(points), 3), np.float32)
    else:
        turned, normals = np.zeros(len(points), np.bool_), known[1].copy()
        _mark_turned(points, np.ascontiguousarray(known[0], np.float32), counts, corners, turned)
    _gather_polygons(points, counts, corners, turned, total)
    _normalise(total, turned, normals)
    return normals


@njit(cache=True, inline="always")
def edge(points, a, b):  # type: ignore[no-untyped-def]
    """From point a to point b, in float64."""
    return (
        np.float64(points[b, 0]) - points[a, 0], np.float64(points[b, 1]) - points[a, 1],
        np.float64(points[b, 2]) - points[a, 2],
    )  # fmt: skip


@njit(types.void(F32_2D, I32_2D, types.float32[:, ::1], types.float64[::1]), cache=True, nogil=True)
def _faces(points, triangles, normals, areas):  # type: ignore[no-untyped-def]
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        ux, uy, uz = edge(points, a, b)
        vx, vy, vz = edge(points, a, c)
        x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        length = math.sqrt(x * x + y * y + z * z)
        areas[t] = 0.5 * length
        scale = 1.0 / length if length > 0.0 else 0.0
        normals[t, 0], normals[t, 1], normals[t, 2] = x * scale, y * scale, z * scale


@njit(cache=True, inline="always")
def _any_of(marked, corners, start, count):  # type: ignore[no-untyped-def]
    found = False
    for k in range(start, start + count):
        found |= marked[corners[k]]
    return found


@njit(types.void(F32_2D, F32_2D, I32_1D, I32_1D, types.boolean[::1]), cache=True, nogil=True)
def _mark_turned(points, before, counts, corners, turned):  # type: ignore[no-untyped-def]
    """Mark the vertices of all faces that have a vertex which moved."""
    moved = np.empty(len(points), np.bool_)
    for v in range(len(points)):
        moved[v] = (
            points[v, 0] != before[v, 0] or points[v, 1] != before[v, 1] or points[v, 2] != before[v, 2]
        )  # fmt: skip
    start = 0
    for f in range(len(counts)):
        if _any_of(moved, corners, start, counts[f]):
            for k in range(start, start + counts[f]):
                turned[corners[k]] = True
        start += counts[f]


@njit(types.void(F32_2D, I32_1D, I32_1D, types.boolean[::1], types.float64[:, ::1]), cache=True, nogil=True)
def _gather_polygons(points, counts, corners, turned, total):  # type: ignore[no-untyped-def]
    """Add to the vertices of faces with `turned` ones the unit normal of the face times its angle there."""
    start = 0
    for f in range(len(counts)):
        n = counts[f]
        if not _any_of(turned, corners, start, n):
            start += n
            continue
        # Newell's vector area, relative to the first corner so that far-away meshes lose no digits
        o = corners[start]
        ox, oy, oz = np.float64(points[o, 0]), np.float64(points[o, 1]), np.float64(points[o, 2])
        x = y = z = 0.0
        for k in range(1, n - 1):
            a, b = corners[start + k], corners[start + k + 1]
            ax, ay, az = points[a, 0] - ox, points[a, 1] - oy, points[a, 2] - oz
            bx, by, bz = points[b, 0] - ox, points[b, 1] - oy, points[b, 2] - oz
            x += ay * bz - az * by
            y += az * bx - ax * bz
            z += ax * by - ay * bx
        length = math.sqrt(x * x + y * y + z * z)
        if length > 0.0:
            x, y, z = x / length, y / length, z / length
            for k in range(n):
                v = corners[start + k]
                p = corners[start + (k - 1 if k > 0 else n - 1)]
                q = corners[start + (k + 1 if k < n - 1 else 0)]
                ax, ay, az = edge(points, v, p)
                bx, by, bz = edge(points, v, q)
                cx, cy, cz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
                angle = math.atan2(math.sqrt(cx * cx + cy * cy + cz * cz), ax * bx + ay * by + az * bz)
                total[v, 0] += angle * x
                total[v, 1] += angle * y
                total[v, 2] += angle * z
        start += n


@njit(types.void(types.float64[:, ::1], types.boolean[::1], types.float32[:, ::1]), cache=True, nogil=True)
def _normalise(total, turned, normals):  # type: ignore[no-untyped-def]
    for v in range(len(total)):
        if not turned[v]:
            continue
        x, y, z = total[v, 0], total[v, 1], total[v, 2]
        length = math.sqrt(x * x + y * y + z * z)
        # 1e-9 of a radian: opposite faces that cancel leave no direction worth having
        scale = 1.0 / length if length > 1e-9 else 0.0
        normals[v, 0], normals[v, 1], normals[v, 2] = x * scale, y * scale, z * scale
