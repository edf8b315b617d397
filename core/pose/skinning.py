"""Where the joints are, and the skin they carry: blend shapes first, then linear blend or dual quaternion skinning."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Literal

import numpy as np
from numba import njit
from numba.core.types import Array, float32, float64, int32, int64, void
from numpy.typing import NDArray

from core.errors import UserError
from core.pose.blend_shapes import morphed, shape_weights
from core.pose.clip import local_matrices, numbers_at
from core.pose.dual_quaternion import dual_quaternions, skin_dual_quaternion
from core.pose.rig import Control, Rig, resting_numbers
from core.pose.skeleton import Skeleton, SkinWeights
from core.workers import serial_ranges

Ranges = Callable[..., None]
NO_NUMBERS: Mapping[str, float] = {}


def object_matrices(skeleton: Skeleton, local: NDArray[np.float64]) -> NDArray[np.float64]:
    """Matrices (J, 4, 4) object_from_joint of local ones (parent_from_joint)."""
    out = np.array(local, np.float64)
    for joint, parent in enumerate(skeleton.parents):
        if parent >= 0:
            out[joint] = out[parent] @ out[joint]
    return out


def skin_matrices_of(skeleton: Skeleton, local: NDArray[np.float64]) -> NDArray[np.float64]:
    """Matrices (J, 4, 4) that carry points from where they were bound to where local ones put them."""
    return object_matrices(skeleton, local) @ np.linalg.inv(skeleton.bind)


def local_at(rig: Rig, frame: float) -> NDArray[np.float64]:
    """Matrices (J, 4, 4) parent_from_joint at `frame` of the clip that plays, at rest without one."""
    return rig.skeleton.rest if rig.clip is None else local_matrices(rig.clip, frame)


def skin_matrices(rig: Rig, frame: float) -> NDArray[np.float64]:
    """Matrices (J, 4, 4) that carry points from where they were bound to where they are at `frame`."""
    return skin_matrices_of(rig.skeleton, local_at(rig, frame))


def posed_points(
    mesh_points: NDArray[np.float32], rig: Rig, frame: float, ranges: Ranges = serial_ranges
) -> NDArray[np.float32]:
    """Points (V, 3) float32, object space, of a mesh at a frame of the clip that plays; see :func:`deformed`."""
    numbers = NO_NUMBERS if rig.clip is None else numbers_at(rig.clip, frame)
    return deformed(mesh_points, rig, local_at(rig, frame), numbers, ranges)


def deformed(
    mesh_points: NDArray[np.float32], rig: Rig, local: NDArray[np.float64], numbers: Mapping[str, float] = NO_NUMBERS,
    ranges: Ranges = serial_ranges,
) -> NDArray[np.float32]:
    """Points (V, 3) float32, object space: moved by the shapes, then by the joints.

    Parameters
    ----------
    mesh_points : (V, 3) float32, at rest, object space.
    local : (J, 4, 4) parent_from_joint.
    numbers : of abstract controls by name; those not named rest.
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
    points = np.ascontiguousarray(mesh_points, np.float32)
    if rig.shapes is not None:
        weights = shape_weights(rig.shapes, {**resting_numbers(rig), **numbers})
        if weights.any():
            points = morphed(points, rig.shapes, weights, ranges)
    return carried(points, rig, skin_matrices_of(rig.skeleton, local), ranges)


def carried(
    points: NDArray[np.float32], rig: Rig, matrices: NDArray[np.float64], ranges: Ranges = serial_ranges,
    vertices: NDArray[np.int32] | None = None,
) -> NDArray[np.float32]:
    """Points (n, 3) float32, each carried as the rig skins it by skin matrices (J, 4, 4); a new array.

    Parameters
    ----------
    vertices : (n,) whose weights carry the points; those of the mesh in their order when None.
    """
    skin = rig.skin if vertices is None else _rows(rig.skin, vertices)
    if rig.skinning != "mixed":
        return skinned(points, skin, matrices, rig.skinning, ranges)
    assert rig.dual is not None
    dual = rig.dual if vertices is None else rig.dual[vertices]
    out = np.empty_like(points)
    for mine, method in ((np.flatnonzero(~dual), "linear"), (np.flatnonzero(dual), "dual-quaternion")):
        out[mine] = skinned(points[mine], _rows(skin, mine), matrices, method, ranges)  # type: ignore[arg-type]
    return out


def _rows(skin: SkinWeights, rows: NDArray[np.integer[Any]]) -> SkinWeights:
    return SkinWeights(joints=skin.joints[rows], weights=skin.weights[rows])


def skinned(
    points: NDArray[np.float32], skin: SkinWeights, matrices: NDArray[np.float64],
    method: Literal["linear", "dual-quaternion"] = "linear", ranges: Ranges = serial_ranges,
) -> NDArray[np.float32]:
    """Points (V, 3) float32 carried by skin matrices (J, 4, 4); a new array."""
    if not skin.joints.shape[1]:
        return np.array(points, np.float32)
    out = np.empty_like(points)
    if method == "dual-quaternion":
        real, dual, stretch = dual_quaternions(matrices)
        ranges(len(points), lambda a, b: skin_dual_quaternion(
            points, skin.joints, skin.weights, real, dual, stretch, out, a, b))
    else:
        rows = np.ascontiguousarray(matrices[:, :3, :])
        ranges(len(points), lambda a, b: skin_linear(points, skin.joints, skin.weights, rows, out, a, b))
    return out


def moved_number(
    control: Control, rig: Rig, mesh_points: NDArray[np.float32], local: NDArray[np.float64],
    numbers: Mapping[str, float] = NO_NUMBERS,
) -> float:
    """The number of an abstract control: as set, or how far its piece of geometry or its joint has moved.

    Parameters
    ----------
    mesh_points, local, numbers : as for :func:`deformed`. A piece of geometry is moved by its joints, not by shapes.
    """
    if control.kind == "number":
        return float(numbers.get(control.name, control.rest))
    matrices = skin_matrices_of(rig.skeleton, local)
    at_rest = skin_matrices_of(rig.skeleton, rig.skeleton.rest)
    if control.joint is not None:
        joint = rig.skeleton.names.index(control.joint)
        origin = rig.skeleton.bind[joint, :, 3]
        moved = ((matrices[joint] - at_rest[joint]) @ origin)[:3]
    else:
        piece = np.asarray(mesh_points, np.float32)[control.vertices]
        now, then = (
            carried(piece, rig, m, vertices=control.vertices).astype(np.float64) for m in (matrices, at_rest))
        moved = (now - then).mean(axis=0)
    axis = np.array(control.axis) / np.linalg.norm(control.axis)
    return control.rest + float(moved @ axis) / control.travel


_POINTS = Array(float32, 2, "C", readonly=True)


@njit(
    void(_POINTS, Array(int32, 2, "C", readonly=True), _POINTS, Array(float64, 3, "C", readonly=True),
         float32[:, ::1], int64, int64),
    cache=True, nogil=True,
)
def skin_linear(
    points: np.ndarray, joints: np.ndarray, weights: np.ndarray, matrices: np.ndarray, out: np.ndarray,
    first: int, last: int,
) -> None:
    """Points first .. last of `out` by the weighted sum of joint matrices (J, 3, 4); `points` may be `out`."""
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
