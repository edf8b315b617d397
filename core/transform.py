"""Matrices, quaternions, minimal rotations and tangent frames.

Conventions of the whole program: a matrix is named ``target_from_source`` and acts on column vectors
(``p_target = M @ p_source``, translation in the last column), so a chain reads by cancellation:
``clip_from_world = clip_from_view @ view_from_world``. Quaternions are (x, y, z, w) as in scipy and glTF.
Frames are (..., 3, 3) with ROWS tangent, bitangent, normal.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def normalized(vectors: ArrayLike, axis: int = -1) -> Array:
    """Vectors of length 1, float64; a vector of length 0 stays 0."""
    v = np.asarray(vectors, np.float64)
    largest = np.max(np.abs(v), axis=axis, keepdims=True)  # scaled first: squares neither overflow nor vanish
    scaled = v / np.where(largest > 0.0, largest, 1.0)
    lengths = np.linalg.norm(scaled, axis=axis, keepdims=True)
    return scaled / np.where(lengths > 0.0, lengths, 1.0)


def translation(offset: ArrayLike) -> Array:
    """(4, 4) matrix that moves points by `offset` (3,)."""
    m = np.eye(4)
    m[:3, 3] = np.asarray(offset, np.float64)
    return m


def scaling(factors: ArrayLike) -> Array:
    """(4, 4) matrix that scales about the origin by one factor or by three."""
    m = np.eye(4)
    m[[0, 1, 2], [0, 1, 2]] = np.asarray(factors, np.float64)
    return m


def rotation(axis: ArrayLike, angle: float) -> Array:
    """(4, 4) rotation about `axis` (3,) through the origin by `angle` radians, right-handed."""
    return compose(rotations=quaternion_about(axis, angle))


def compose(
    translations: ArrayLike = (0.0, 0.0, 0.0),
    rotations: ArrayLike = (0.0, 0.0, 0.0, 1.0),
    scales: ArrayLike = (1.0, 1.0, 1.0),
) -> Array:
    """Matrices (..., 4, 4) that scale, then rotate (quaternions), then translate. The parts broadcast."""
    t, q, s = (np.asarray(a, np.float64) for a in (translations, rotations, scales))
    shape = np.broadcast_shapes(t.shape[:-1], q.shape[:-1], s.shape[:-1])
    m = np.zeros((*shape, 4, 4))
    m[..., :3, :3] = matrix_from_quaternion(q) * s[..., None, :]
    m[..., :3, 3] = t
    m[..., 3, 3] = 1.0
    return m


def transform_points(target_from_source: ArrayLike, points: ArrayLike) -> Array:
    """Points (..., 3) through one affine 4x4 matrix, float64. No perspective division."""
    m = np.asarray(target_from_source, np.float64)
    return np.asarray(points, np.float64) @ m[:3, :3].T + m[:3, 3]


def transform_vectors(target_from_source: ArrayLike, vectors: ArrayLike) -> Array:
    """Directions (..., 3), which do not move with the translation, through one affine 4x4 matrix."""
    return np.asarray(vectors, np.float64) @ np.asarray(target_from_source, np.float64)[:3, :3].T


def transform_normals(target_from_source: ArrayLike, normals: ArrayLike) -> Array:
    """Unit normals (..., 3) of a surface moved by an invertible affine 4x4 matrix (inverse transpose)."""
    source_from_target = np.linalg.inv(np.asarray(target_from_source, np.float64)[:3, :3])
    return normalized(np.asarray(normals, np.float64) @ source_from_target)


def quaternion_about(axis: ArrayLike, angle: ArrayLike) -> Array:
    """Quaternions (..., 4) of right-handed rotations about `axis` (..., 3) by `angle` (...) radians."""
    half = 0.5 * np.asarray(angle, np.float64)[..., None]
    xyz = normalized(axis) * np.sin(half)
    return np.concatenate([xyz, np.broadcast_to(np.cos(half), (*xyz.shape[:-1], 1))], axis=-1)


def quaternion_product(a: ArrayLike, b: ArrayLike) -> Array:
    """Hamilton product: the rotation `b` followed by the rotation `a`."""
    p, q = np.asarray(a, np.float64), np.asarray(b, np.float64)
    pv, pw, qv, qw = p[..., :3], p[..., 3:], q[..., :3], q[..., 3:]
    xyz = pw * qv + qw * pv + np.cross(pv, qv)
    return np.concatenate([xyz, pw * qw - np.sum(pv * qv, axis=-1, keepdims=True)], axis=-1)


def matrix_from_quaternion(quaternions: ArrayLike) -> Array:
    """Rotation matrices (..., 3, 3) of quaternions (..., 4), which are normalised first."""
    x, y, z, w = np.moveaxis(normalized(quaternions), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def quaternion_from_matrix(rotations: ArrayLike) -> Array:
    """Quaternions (..., 4), w >= 0, of rotation matrices (..., 3, 3); any angle, pi included.

    The largest of four candidate rows is taken (Shepperd, 1978).
    """
    m = np.asarray(rotations, np.float64)
    xx, yy, zz = m[..., 0, 0], m[..., 1, 1], m[..., 2, 2]
    xy, xz, yz = m[..., 1, 0] + m[..., 0, 1], m[..., 0, 2] + m[..., 2, 0], m[..., 2, 1] + m[..., 1, 2]
    xw, yw, zw = m[..., 2, 1] - m[..., 1, 2], m[..., 0, 2] - m[..., 2, 0], m[..., 1, 0] - m[..., 0, 1]
    rows = np.stack([
        np.stack([1 + xx - yy - zz, xy, xz, xw], axis=-1),
        np.stack([xy, 1 - xx + yy - zz, yz, yw], axis=-1),
        np.stack([xz, yz, 1 - xx - yy + zz, zw], axis=-1),
        np.stack([xw, yw, zw, 1 + xx + yy + zz], axis=-1),
    ], axis=-2)
    best = np.argmax(np.diagonal(rows, axis1=-2, axis2=-1), axis=-1)
    q = normalized(np.take_along_axis(rows, best[..., None, None], axis=-2)[..., 0, :])
    return np.where(q[..., 3:] < 0.0, -q, q)


def slerp(a: ArrayLike, b: ArrayLike, fraction: ArrayLike) -> Array:
    """Unit quaternions on the shorter arc from `a` to `b`; `fraction` 0 .. 1 (...)."""
    p, q = normalized(a), normalized(b)
    f = np.asarray(fraction, np.float64)[..., None]
    q = np.where(np.sum(p * q, axis=-1, keepdims=True) < 0.0, -q, q)
    # atan2 of difference and sum stays accurate for tiny angles, where arccos does not
    apart, together = (np.linalg.norm(v, axis=-1, keepdims=True) for v in (p - q, p + q))
    angle = 2.0 * np.arctan2(apart, together)
    tiny = angle < 1e-6
    sine = np.where(tiny, 1.0, np.sin(np.where(tiny, 1.0, angle)))
    wp = np.where(tiny, 1.0 - f, np.sin((1.0 - f) * angle) / sine)
    wq = np.where(tiny, f, np.sin(f * angle) / sine)
    return normalized(wp * p + wq * q)


def minimal_rotation(from_normals: ArrayLike, to_normals: ArrayLike) -> Array:
    """Rotation matrices (..., 3, 3) of the smallest angle that carry one direction to the other.

    The product of two half turns, about `from` and about the bisector, which is orthonormal to rounding at
    every angle. At exactly opposite directions the axis is arbitrary but always the same. A direction of length 0
    gives the identity.

    Parameters
    ----------
    from_normals, to_normals : (..., 3), any length.
    """
    a, b = normalized(from_normals), normalized(to_normals)
    a, b = np.broadcast_arrays(a, b)
    bisector = a + b
    opposite = np.linalg.norm(bisector, axis=-1, keepdims=True) < 1e-8  # below it rounding would err more
    h = np.where(opposite, any_perpendicular(a), normalized(bisector))
    eye = np.eye(3)
    half_turn_h = 2.0 * h[..., :, None] * h[..., None, :] - eye
    half_turn_a = 2.0 * a[..., :, None] * a[..., None, :] - eye
    missing = (np.max(np.abs(a), axis=-1) == 0.0) | (np.max(np.abs(b), axis=-1) == 0.0)
    return np.where(missing[..., None, None], eye, half_turn_h @ half_turn_a)


def any_perpendicular(vectors: ArrayLike) -> Array:
    """One unit vector perpendicular to each vector (..., 3); of a zero vector, the x axis."""
    v = np.asarray(vectors, np.float64)
    smallest = np.eye(3)[np.argmin(np.abs(v), axis=-1)]
    out = normalized(np.cross(v, smallest))
    zero = np.max(np.abs(v), axis=-1, keepdims=True) == 0.0
    return np.where(zero, np.array([1.0, 0.0, 0.0]), out)


def tangent_frames(normals: ArrayLike, hints: ArrayLike | None = None) -> Array:
    """Right-handed orthonormal frames (..., 3, 3), rows tangent, bitangent, normal.

    The tangent is the part of `hints` (for example dP/du) in the tangent plane; where there is no hint, or it is
    parallel to the normal, an arbitrary but repeatable one (x-like: Duff et al., JCGT 2017). A normal of length 0
    is taken as +z.
    """
    n = normalized(normals)
    n = np.where(np.max(np.abs(n), axis=-1, keepdims=True) == 0.0, np.array([0.0, 0.0, 1.0]), n)
    x, y, z = n[..., 0], n[..., 1], n[..., 2]
    sign = np.where(z >= 0.0, 1.0, -1.0)
    a = -1.0 / (sign + z)
    tangent = np.stack([1.0 + sign * x * x * a, sign * x * y * a, -sign * x], axis=-1)
    if hints is not None:
        h = normalized(hints)
        h = h - n * np.sum(h * n, axis=-1, keepdims=True)
        good = np.linalg.norm(h, axis=-1, keepdims=True) > 1e-6
        tangent = np.where(good, h, tangent)
    tangent = normalized(tangent - n * np.sum(tangent * n, axis=-1, keepdims=True))
    return np.stack(np.broadcast_arrays(tangent, np.cross(n, tangent), n), axis=-2)
