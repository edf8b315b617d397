"""Roots carried to a changed mesh: by topology, by UV, by the closest skin that faces the same way."""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from core.errors import UserError
from core.mesh.bvh import build_bvh, cast_rays, closest_points
from core.mesh.mesh import Mesh, Triangles
from core.mesh.normals import mesh_normals
from core.mesh.roots import Roots
from core.mesh.surface import place_roots, root_frames, root_positions
from core.mesh.triangulate import triangulate

MOST_OVERLAPS = 16  # UV islands lying over each other at one root
SAME_SIDE = 0.2  # least cosine between the old normal and the new one
OFFSETS = (0.0, 0.0025, 0.01, 0.03)  # of the diagonal, along the old normal, to leave the wrong side of thin skin


class RebindMethod(IntEnum):
    """How a root found its new place, from the surest to the least."""

    TOPOLOGY = 0
    UV = 1
    CLOSEST = 2
    CLOSEST_ANY = 3  # nothing near faces the same way: look at these


def rebind_roots(
    roots: Roots, old_mesh: Mesh, new_mesh: Mesh
) -> tuple[Roots, NDArray[np.uint8], NDArray[np.float32]]:
    """Move roots from `old_mesh` to `new_mesh`.

    Returns
    -------
    roots : on the new mesh, in the same order, with rest frames of the new mesh.
    method : (N,) uint8, a `RebindMethod` for each.
    error : (N,) float32, metres between the place on the old mesh at rest and that on the new one; for the same
        topology the roots have not slid on the skin, whatever its shape, and the error is 0.

    Raises
    ------
    UserError
        The new mesh has no faces.
    """
    count = len(roots.faces)
    if not len(new_mesh.counts):
        raise UserError("The roots cannot be bound to the new mesh: it has no faces.")
    if np.array_equal(old_mesh.counts, new_mesh.counts) and np.array_equal(old_mesh.corners, new_mesh.corners):
        frames = root_frames(old_mesh, roots, new_mesh.points)
        kept = Roots(faces=roots.faces, corners=roots.corners, weights=roots.weights, uvs=roots.uvs, frames=frames)
        return kept, np.full(count, RebindMethod.TOPOLOGY, np.uint8), np.zeros(count, np.float32)

    places = root_positions(old_mesh, roots)
    triangles = triangulate(new_mesh)
    triangle = np.full(count, -1, np.int32)
    weights = np.zeros((count, 3), np.float32)
    method = np.full(count, RebindMethod.UV, np.uint8)
    if old_mesh.uvs is not None and new_mesh.uvs is not None:
        triangle, weights = _by_uv(roots.uvs, places, new_mesh, triangles)
    rows = np.flatnonzero(triangle < 0)
    if len(rows):
        triangle[rows], weights[rows], method[rows] = _by_place(
            places[rows], roots.frames[rows, 2], new_mesh, triangles
        )
    moved = place_roots(new_mesh, triangles, triangle, weights)
    error = np.linalg.norm(root_positions(new_mesh, moved).astype(np.float64) - places, axis=1).astype(np.float32)
    return moved, method, error


def _by_uv(
    uvs: NDArray[np.float32], places: NDArray[np.float32], mesh: Mesh, triangles: Triangles
) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """The triangle over each UV; of islands that overlap (mirrored halves) the one nearest at rest; -1 outside all.

    Every island becomes a flat layer of its own and a ray goes up through all layers.
    """
    assert mesh.uvs is not None
    corner_uvs = mesh.uvs[triangles.corners]
    island = _uv_islands(mesh, triangles)
    layers = np.concatenate(
        [corner_uvs, np.broadcast_to(island[:, None, None].astype(np.float32), (*corner_uvs.shape[:2], 1))], axis=2
    ).reshape(-1, 3)
    bvh = build_bvh(layers, np.arange(len(layers), dtype=np.int32).reshape(-1, 3))
    found = np.full(len(uvs), -1, np.int32)
    found_weights = np.zeros((len(uvs), 3), np.float32)
    nearest = np.full(len(uvs), np.inf)
    rows = np.arange(len(uvs))
    start = np.concatenate([uvs, np.full((len(uvs), 1), -0.5, np.float32)], axis=1)
    for _ in range(MOST_OVERLAPS):
        up = np.broadcast_to(np.array([0, 0, 1], np.float32), (len(rows), 3))
        _, hit, bary = cast_rays(bvh, start[rows], up)
        rows, hit, bary = rows[hit >= 0], hit[hit >= 0], bary[hit >= 0]
        if not len(rows):
            break
        there = (mesh.points[triangles.vertices[hit]].astype(np.float64) * bary[:, :, None]).sum(1)
        distance = np.linalg.norm(there - places[rows], axis=1)
        better = distance < nearest[rows]
        nearest[rows[better]] = distance[better]
        found[rows[better]], found_weights[rows[better]] = hit[better], bary[better]
        start[rows, 2] = island[hit] + 0.5
    return found, found_weights


def _uv_islands(mesh: Mesh, triangles: Triangles) -> NDArray[np.int32]:
    """A number for each triangle; those joined through a corner of the same vertex and the same UV share it.

    Mirrored halves folded over each other along their seam are told apart by the way their triangles wind in UV.
    """
    assert mesh.uvs is not None
    corners = triangles.corners.ravel()
    keys = np.column_stack([mesh.corners[corners], mesh.uvs[corners].view(np.int32)])
    _, knot = np.unique(keys, axis=0, return_inverse=True)
    count = len(triangles.faces)
    rows = np.repeat(np.arange(count), 3)
    knot = knot.ravel() + count
    size = count + len(corners)
    graph = coo_matrix((np.ones(len(rows), np.int8), (rows, knot)), shape=(size, size))
    island = connected_components(graph, directed=False)[1][:count]
    edges = mesh.uvs[triangles.corners[:, 1:]] - mesh.uvs[triangles.corners[:, :1]]
    folded = edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0] < 0
    return np.unique(2 * island + folded, return_inverse=True)[1].astype(np.int32)


def _by_place(
    places: NDArray[np.float32], normals: NDArray[np.float32], mesh: Mesh, triangles: Triangles
) -> tuple[NDArray[np.int32], NDArray[np.float32], NDArray[np.uint8]]:
    """The closest place on the skin that faces the old way, else the closest of all."""
    bvh = build_bvh(mesh.points, triangles.vertices)
    smooth = mesh_normals(mesh)
    finite = mesh.points[triangles.vertices.ravel()].astype(np.float64)
    diagonal = float(np.linalg.norm(np.ptp(finite, axis=0)))
    triangle, weights, _ = closest_points(bvh, places)
    if (triangle < 0).any():
        raise UserError("The roots cannot be bound to the new mesh: none of its faces has finite coordinates.")
    method = np.full(len(places), RebindMethod.CLOSEST_ANY, np.uint8)
    rows = np.arange(len(places))
    for offset in OFFSETS:
        outside = (places[rows] + normals[rows] * np.float32(offset * diagonal)).astype(np.float32)
        hit, bary, _ = closest_points(bvh, outside)
        there = (smooth[triangles.vertices[hit]] * bary[:, :, None]).sum(1)
        there /= np.maximum(np.linalg.norm(there, axis=1), 1e-12)[:, None]
        same = (there * normals[rows]).sum(1) > SAME_SIDE
        triangle[rows[same]], weights[rows[same]] = hit[same], bary[same]
        method[rows[same]] = RebindMethod.CLOSEST
        rows = rows[~same]
        if not len(rows):
            break
    return triangle, weights, method
