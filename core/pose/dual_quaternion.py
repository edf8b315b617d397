"""Dual quaternion skinning (Kavan, Collins, Zara, O'Sullivan 2008): joints blend as rotations, so a twist keeps volume.

Scale and shear of a joint, which no dual quaternion has, are blended as matrices and applied first, as UsdSkel does.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numba.core.types import Array, float32, float64, int32, int64, void
from numpy.typing import NDArray

from core.transform import quaternion_from_matrix, quaternion_product

NO_STRETCH = 1e-7


def dual_quaternions(
    matrices: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Affine matrices (J, 4, 4) as a stretch, then a rotation, then a translation.

    Returns
    -------
    real, dual : (J, 4) float64, unit dual quaternions x, y, z, w.
    stretch : (J, 3, 3) float64, symmetric, or (0, 3, 3) when no joint has any; of a mirroring joint negative definite.
    """
    inner = np.asarray(matrices, np.float64)[:, :3, :3]
    u, _, vt = np.linalg.svd(inner)
    turn = u @ vt
    turn = np.where(np.linalg.det(turn)[:, None, None] < 0.0, -turn, turn)
    stretch = np.swapaxes(turn, 1, 2) @ inner
    real = quaternion_from_matrix(turn)
    moved = np.concatenate([matrices[:, :3, 3], np.zeros((len(inner), 1))], axis=1)
    if np.abs(stretch - np.eye(3)).max(initial=0.0) < NO_STRETCH:
        stretch = stretch[:0]
    return real, 0.5 * quaternion_product(moved, real), np.ascontiguousarray(stretch)


_POINTS = Array(float32, 2, "C", readonly=True)


@njit(
    void(_POINTS, Array(int32, 2, "C", readonly=True), _POINTS, float64[:, ::1], float64[:, ::1], float64[:, :, ::1],
         float32[:, ::1], int64, int64),
    cache=True, nogil=True,
)
def skin_dual_quaternion(
    points: np.ndarray, joints: np.ndarray, weights: np.ndarray, real: np.ndarray, dual: np.ndarray,
    stretch: np.ndarray, out: np.ndarray, first: int, last: int,
) -> None:
    """Points first .. last of `out` by the blended dual quaternions; `points` and `out` may be one array."""
    for v in range(first, last):
        px, py, pz = float64(points[v, 0]), float64(points[v, 1]), float64(points[v, 2])
        pivot, most = 0, float32(-1.0)
        for k in range(joints.shape[1]):
            if weights[v, k] > most:
                most, pivot = weights[v, k], joints[v, k]
        ax, ay, az, aw = real[pivot, 0], real[pivot, 1], real[pivot, 2], real[pivot, 3]
        rx = ry = rz = rw = dx = dy = dz = dw = sx = sy = sz = 0.0
        for k in range(joints.shape[1]):
            w = float64(weights[v, k])
            if w == 0.0:
                continue
            j = joints[v, k]
            if len(stretch) > 0:
                sx += w * (stretch[j, 0, 0] * px + stretch[j, 0, 1] * py + stretch[j, 0, 2] * pz)
                sy += w * (stretch[j, 1, 0] * px + stretch[j, 1, 1] * py + stretch[j, 1, 2] * pz)
                sz += w * (stretch[j, 2, 0] * px + stretch[j, 2, 1] * py + stretch[j, 2, 2] * pz)
            # the same rotation, from the side of the strongest joint
            w = math.copysign(w, ax * real[j, 0] + ay * real[j, 1] + az * real[j, 2] + aw * real[j, 3])
            rx += w * real[j, 0]
            ry += w * real[j, 1]
            rz += w * real[j, 2]
            rw += w * real[j, 3]
            dx += w * dual[j, 0]
            dy += w * dual[j, 1]
            dz += w * dual[j, 2]
            dw += w * dual[j, 3]
        if len(stretch) > 0:
            px, py, pz = sx, sy, sz
        length = np.sqrt(rx * rx + ry * ry + rz * rz + rw * rw)
        if length < 1e-12:  # no joint moves it, or its joints cancel out
            rx, ry, rz, rw, length = ax, ay, az, aw, 1.0
            dx, dy, dz, dw = dual[pivot, 0], dual[pivot, 1], dual[pivot, 2], dual[pivot, 3]
        over = 1.0 / length
        rx, ry, rz, rw = rx * over, ry * over, rz * over, rw * over
        dx, dy, dz, dw = dx * over, dy * over, dz * over, dw * over
        tx = 2.0 * (rw * dx - dw * rx + ry * dz - rz * dy)
        ty = 2.0 * (rw * dy - dw * ry + rz * dx - rx * dz)
        tz = 2.0 * (rw * dz - dw * rz + rx * dy - ry * dx)
        cx, cy, cz = ry * pz - rz * py + rw * px, rz * px - rx * pz + rw * py, rx * py - ry * px + rw * pz
        out[v, 0] = px + 2.0 * (ry * cz - rz * cy) + tx
        out[v, 1] = py + 2.0 * (rz * cx - rx * cz) + ty
        out[v, 2] = pz + 2.0 * (rx * cy - ry * cx) + tz
