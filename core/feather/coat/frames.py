"""Frames feathers lie in: from combed keys or a field over the skin, turned in the skin, carried to a posed one.

A frame is (3, 3) float32, rows right, along, out: the feather points along, and out is the skin's normal.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.evaluator import Evaluator
from core.feather.coat.bed import Bed
from core.feather.coat.ground import smoothed
from core.feather.coat.keys import interpolate_directions, key_shapes
from core.mesh.intrinsic import Binding
from core.mesh.mesh import Mesh
from core.mesh.skin import Skin, skin_at_rest
from core.mesh.surface import root_frames, root_positions


def frames_of(directions: NDArray[np.float64], normals: NDArray[np.float64]) -> NDArray[np.float32]:
    """Frames (N, 3, 3), rows right, along, out, of directions made square to unit normals."""
    along = directions - normals * np.einsum("nc,nc->n", directions, normals)[:, None]
    lost = np.linalg.norm(along, axis=1) < 1e-9
    if lost.any():
        helper = np.where(np.abs(normals[lost, 1:2]) < 0.9, [[0.0, 1.0, 0.0]], [[1.0, 0.0, 0.0]])
        along[lost] = np.cross(normals[lost], helper)
    along = unit(along)
    return np.ascontiguousarray(np.stack([np.cross(along, normals), along, normals], axis=1), np.float32)


def unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Vectors (..., 3) with length 1; zeros stay zeros."""
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-30))


def key_frames(
    guides: Any, binding: Binding, bed: Bed, ranges: Any
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Frames of the feathers and of the flow they lie in, both as combed keys lay them."""
    along = interpolate_directions(key_shapes(guides), binding, bed.normals)
    frames = frames_of(along, bed.normals)
    return frames, frames


def field_frames(
    field: NDArray[np.float32], bed: Bed, mesh: Mesh, evaluator: Evaluator
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Frames of the feathers and of the flow they lie in, both along a field (V, 3) over the vertices."""
    corners = skin_at_rest(mesh, evaluator).triangles.vertices[bed.places.triangle]
    along = np.einsum("nk,nkc->nc", bed.places.barycentric, field[corners]).astype(np.float64)
    frames = frames_of(smoothed(along, bed.ground.near, 6, evaluator.workers.ranges), bed.normals)
    return frames, frames


def turned(frames: NDArray[np.float32], yaw: NDArray[np.float64]) -> NDArray[np.float32]:
    """Frames turned about their normals, to the right above 0."""
    c, s = np.cos(yaw)[:, None], np.sin(yaw)[:, None]
    right, along = frames[:, 0], frames[:, 1]
    turned = np.stack([c * right - s * along, c * along + s * right, frames[:, 2]], axis=1)
    return np.ascontiguousarray(turned, np.float32)


def carried(
    mesh: Mesh, bed: Bed, rest_frames: NDArray[np.float32], flow_frames: NDArray[np.float32], skin: Skin
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """Positions (N, 3) and frames (N, 3, 3), twice, carried by the frames of the roots to a posed skin."""
    moved = root_frames(mesh, bed.roots, skin.points, skin.normals)
    turn = np.einsum("nij,nik->njk", bed.roots.frames.astype(np.float64), moved)  # rest -> posed, for rows
    positions = root_positions(mesh, bed.roots, skin.points)
    carried = [np.ascontiguousarray(frames @ turn, np.float32) for frames in (rest_frames, flow_frames)]
    return positions, carried[0], carried[1]
