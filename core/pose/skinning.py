"""Where the joints are at a frame, and the skin they carry: linear blend skinning."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numba import njit
from numba.core.types import Array, float32, float64, int32, int64, void
from numpy.typing import NDArray

from core.errors import UserError
from core.pose.rig import Rig
from core.pose.skeleton import Clip, Skeleton
from core.transform import compose, slerp
from core.workers import serial_ranges


def local_matrices(clip: Clip, frame: float) -> NDArray[np.float64]:
    """Matrices (J, 4, 4) parent_from_joint at any frame; between samples mixed, held outside the clip."""
    at = min(max(frame - clip.start, 0.0), float(len(clip.translations) - 1))
    low = int(at)
    high, part = min(low + 1, len(clip.translations) - 1), at - low
    t = (1.0 - part) * clip.translations[low].astype(np.float64) + part * clip.translations[high]
    s = (1.0 - part) * clip.scales[low].astype(np.float64) + part * clip.scales[high]
    return compose(t, slerp(clip.rotations[low], clip.rotations[high], np.full(t.shape[0], part)), s)


def object_matrices(skeleton: Skeleton, local: NDArray[np.float64]) -> NDArray[np.float64]:
    """Matrices (J, 4, 4) object_from_joint of local ones (parent_from_joint)."""
    out = np.array(local, np.float64)
    for joint, parent in enumerate(skeleton.parents):
        if parent >= 0:
            out[joint] = out[parent] @ out[joint]
    return out


def skin_matrices(rig: Rig, frame: float) -> NDArray[np.float64]:
    """Matrices (J, 4, 4) that carry points from where they were bound to where they are at `frame`."""
    local = rig.skeleton.rest if rig.clip is None else local_matrices(rig.clip, frame)
    return object_matrices(rig.skeleton, local) @ np.linalg.inv(rig.skeleton.bind)


def posed_points(
    mesh_points: NDArray[np.float32], rig: Rig, frame: float, ranges: Callable[..., None] = serial_ranges
) -> NDArray[np.float32]:
    """Points (V, 3) float32, object space, of a mesh at a frame.

    Parameters
    ----------
    mesh_points : (V, 3) float32, at rest, object space.
    ranges : how rows are spread over threads (``Workers.ranges``).

    Raises
    ------
    UserError
        When the skin was made for another number of vertices.
    """
    if len(mesh_points) != len(rig.skin.joints):
        raise UserError(
            f"The skin moves {len(rig.skin.joints)} vertices but the mesh has {len(mesh_points)}; "
            "load the mesh that belongs to this rig."
        )
    matrices = np.ascontiguousarray(skin_matrices(rig, frame)[:, :3, :])
    points = np.ascontiguousarray(mesh_points, np.float32)
    out = np.empty_like(points)
    ranges(len(points), lambda a, b: _skin(points, rig.skin.joints, rig.skin.weights, matrices, out, a, b))
    return out


_POINTS = Array(float32, 2, "C", readonly=True)


@njit(
    void(_POINTS, Array(int32, 2, "C", readonly=True), _POINTS, Array(float64, 3, "C", readonly=True),
         float32[:, ::1], int64, int64),
    cache=True, nogil=True,
)
def _skin(
    points: np.ndarray, joints: np.ndarray, weights: np.ndarray, matrices: np.ndarray, out: np.ndarray,
    first: int, last: int,
) -> None:
    for v in range(first, last):
        px, py, pz = float64(points[v, 0]), float64(points[v, 1]), float64(points[v, 2])
        x = y = z = 0.0
        for k in range(joints.shape[1]):
            w = float64(weights[v, k])
            if w != 0.0:
                m = matrices[joints[v, k]]
                x += w * (m[0, 0] * px + m[0, 1] * py + m[0, 2] * pz + m[0, 3])
                y += w * (m[1, 0] * px + m[1, 1] * py + m[1, 2] * pz + m[1, 3])
                z += w * (m[2, 0] * px + m[2, 1] * py + m[2, 2] * pz + m[2, 3])
        out[v, 0] = x
        out[v, 1] = y
        out[v, 2] = z
