"""Rotations as a pose space reads them: relative to rest, split into swing and twist about an axis.

Quaternions are (x, y, z, w); every function gives the same for q and -q. Of a rotation q = (v, w) and a unit axis a,
the twist is the part about a, and the swing what is left: q = swing * twist (twist first). ``w^2 + (v.a)^2`` is the
squared cosine of half the swing angle; where it vanishes (a swing of 180 degrees) every twist is as good as any other.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numba.core.types import float64, void
from numpy.typing import ArrayLike, NDArray

from core.transform import Array, matrix_from_quaternion, normalized, quaternion_about, quaternion_product

FADE_FROM = 0.5  # cosine of half the swing (120 degrees) beyond which the twist fades out


def inverse(quaternions: ArrayLike) -> Array:
    """The opposite rotations (..., 4), of unit length."""
    return normalized(quaternions) * np.array([-1.0, -1.0, -1.0, 1.0])


def relative(rest: ArrayLike, local: ArrayLike) -> Array:
    """What `local` adds to `rest`: q_rest^-1 * q_local (..., 4), unit, w >= 0."""
    q = normalized(quaternion_product(inverse(rest), normalized(local)))
    return np.where(q[..., 3:] < 0.0, -q, q)


def rotated_axis(quaternions: ArrayLike, axes: ArrayLike) -> Array:
    """Where the axes (..., 3) are carried (..., 3)."""
    return np.einsum("...ij,...j->...i", matrix_from_quaternion(quaternions), np.asarray(axes, np.float64))


def swing_twist(quaternions: ArrayLike, axes: ArrayLike) -> tuple[Array, Array]:
    """Quaternions (..., 4) of swing and of twist about unit axes (..., 3), so that q = swing * twist.

    At a swing of exactly 180 degrees the twist is the identity.
    """
    q, a = normalized(quaternions), np.asarray(axes, np.float64)
    along = np.sum(q[..., :3] * a, axis=-1, keepdims=True)
    twist = np.concatenate([along * a, q[..., 3:]], axis=-1)
    length = np.linalg.norm(twist, axis=-1, keepdims=True)
    none = np.broadcast_to([0.0, 0.0, 0.0, 1.0], twist.shape)
    twist = np.where(length > 1e-15, normalized(twist), none)
    return quaternion_product(q, inverse(twist)), twist


def twist_angle(quaternions: ArrayLike, axes: ArrayLike) -> Array:
    """Angle (...) of the twist about unit axes, radians, -pi .. pi."""
    q = normalized(quaternions)
    along = np.sum(q[..., :3] * np.asarray(axes, np.float64), axis=-1)
    sign = np.where(q[..., 3] < 0.0, -1.0, 1.0)
    return 2.0 * np.arctan2(sign * along, np.abs(q[..., 3]))


def swing_angle(quaternions: ArrayLike, axes: ArrayLike) -> Array:
    """Angle (...) between the axes and where they are carried, radians, 0 .. pi (accurate at both ends)."""
    a = np.asarray(axes, np.float64)
    b = rotated_axis(quaternions, a)
    return 2.0 * np.arctan2(np.linalg.norm(a - b, axis=-1), np.linalg.norm(a + b, axis=-1))


def swung_and_twisted(unit: Array, frames: Array) -> Array:
    """Where joints are swung and twisted to, five numbers that move steadily with the rotation.

    The first axis of a frame as it is carried, along the three axes of the frame; then cosine and sine of the twist
    about it, faded to (0, 0) where the swing nears 180 degrees: with f = sqrt(w^2 + (v.a)^2) they are whole up to a
    swing of 120 degrees (f >= 1/2), so that swing alone does not move them, and then shrink by t (3 - t^2) / 2 with
    t = 2 f: continuous through the pole, where the twist is not.

    Parameters
    ----------
    unit : (N, T, 4) quaternions of length 1. frames : (T, 3, 3), rows are three perpendicular unit axes.

    Returns
    -------
    (N, T, 5) float64.
    """
    out = np.empty((*unit.shape[:2], 5))
    _swing_and_twist(np.ascontiguousarray(unit, np.float64), np.ascontiguousarray(frames, np.float64), out)
    return out


@njit(void(float64[:, :, ::1], float64[:, :, ::1], float64[:, :, ::1]), cache=True, nogil=True)
def _swing_and_twist(unit: np.ndarray, frames: np.ndarray, out: np.ndarray) -> None:
    for n in range(unit.shape[0]):
        for t in range(unit.shape[1]):
            q, frame, o, w = unit[n, t], frames[t], out[n, t], unit[n, t, 3]
            x = frame[0, 0] * q[0] + frame[0, 1] * q[1] + frame[0, 2] * q[2]
            y = frame[1, 0] * q[0] + frame[1, 1] * q[1] + frame[1, 2] * q[2]
            z = frame[2, 0] * q[0] + frame[2, 1] * q[1] + frame[2, 2] * q[2]
            o[0] = 1.0 - 2.0 * (y * y + z * z)
            o[1] = 2.0 * (x * y + z * w)
            o[2] = 2.0 * (x * z - y * w)
            squared = w * w + x * x
            part = min(1.0, math.sqrt(squared) / FADE_FROM)
            fade = 0.5 * part * (3.0 - part * part) / max(squared, 1e-300)
            o[3], o[4] = fade * (w * w - x * x), fade * 2.0 * w * x


def quaternion_from_euler(degrees: ArrayLike) -> Array:
    """Quaternions (..., 4) of XYZ angles (..., 3) in degrees: about x first, then y, then z, axes fixed."""
    angles = np.radians(np.asarray(degrees, np.float64))
    x, y, z = (quaternion_about(np.eye(3)[i], angles[..., i]) for i in range(3))
    return normalized(quaternion_product(z, quaternion_product(y, x)))


def euler_from_quaternion(quaternions: ArrayLike) -> Array:
    """XYZ angles (..., 3) in radians, the reverse of :func:`quaternion_from_euler`.

    Only for showing and for the comparison of metrics: near y = 90 degrees they jump where the rotation does not.
    """
    m = matrix_from_quaternion(quaternions)
    cosine = np.hypot(m[..., 0, 0], m[..., 1, 0])
    y = np.arctan2(-m[..., 2, 0], cosine)
    locked = cosine < 1e-9
    x = np.where(locked, np.arctan2(-m[..., 1, 2], m[..., 1, 1]), np.arctan2(m[..., 2, 1], m[..., 2, 2]))
    z = np.where(locked, 0.0, np.arctan2(m[..., 1, 0], m[..., 0, 0]))
    return np.stack([x, y, z], axis=-1)


def polar_rotation(matrices: ArrayLike) -> Array:
    """The nearest rotations (..., 3, 3), determinant +1, of any matrices (..., 3, 3); never NaN."""
    u, _, vt = np.linalg.svd(np.asarray(matrices, np.float64))
    turned: NDArray[np.float64] = np.where(np.linalg.det(u @ vt) < 0.0, -1.0, 1.0)
    u = u.copy()
    u[..., :, 2] *= turned[..., None]
    return u @ vt
