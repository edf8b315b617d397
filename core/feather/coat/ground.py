"""The ground feathers stand on: which roots are neighbours on the skin, and how the skin curves between them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit, types
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from core.feather.coat.posing import F32_2D, F32_3D, Ranges
from core.mesh.bvh import I32_2D
from core.workers import serial_ranges

NEIGHBOURS = 14
FACING = 0.25  # cosine between normals beyond which a root lies on another side of a thin part


class Ground(NamedTuple):
    """Neighbours of N roots at rest.

    near : (N, K) int32, the nearest roots that face the same way, -1 where there are fewer.
    spacing : (N,) float32, metres to the nearest ones (the mean of six).
    """

    near: NDArray[np.int32]
    spacing: NDArray[np.float32]


def ground_of(roots: NDArray[np.float32], normals: NDArray[np.float32]) -> Ground:
    """Neighbours of roots (N, 3) whose normals (N, 3) are given."""
    count = len(roots)
    wanted = min(count, 2 * NEIGHBOURS)
    if wanted < 2:
        return Ground(np.full((count, NEIGHBOURS), -1, np.int32), np.ones(count, np.float32))
    distance, index = cKDTree(roots).query(roots, wanted)
    facing = np.einsum("nkc,nc->nk", normals[index], normals) > FACING
    facing &= index != np.arange(count)[:, None]
    order = np.argsort(~facing, axis=1, kind="stable")[:, :NEIGHBOURS]
    taken = np.take_along_axis(facing, order, 1)
    near = np.where(taken, np.take_along_axis(index, order, 1), -1).astype(np.int32)
    if near.shape[1] < NEIGHBOURS:
        near = np.pad(near, ((0, 0), (0, NEIGHBOURS - near.shape[1])), constant_values=-1)
    six = min(7, wanted)
    spacing = distance[:, 1:six].mean(axis=1)
    return Ground(np.ascontiguousarray(near), np.maximum(spacing, 1e-30).astype(np.float32))


@njit(
    types.void(F32_2D, F32_3D, I32_2D, types.int64, types.int64, types.float64[:, ::1]), cache=True, nogil=True
)
def _curvatures(roots, frames, near, start, stop, out):  # type: ignore[no-untyped-def]
    """Least squares of the turn of the normal over the step, a symmetric 2 x 2 matrix in the frame of the feather."""
    for i in range(start, stop):
        a11 = a12 = a22 = a23 = a33 = b1 = b2 = b3 = 0.0
        for k in range(near.shape[1]):
            j = near[i, k]
            if j < 0:
                continue
            x = y = p = q = d2 = 0.0
            for c in range(3):
                d = np.float64(roots[j, c]) - roots[i, c]
                m = np.float64(frames[j, 2, c]) - frames[i, 2, c]
                x += d * frames[i, 0, c]
                y += d * frames[i, 1, c]
                p += m * frames[i, 0, c]
                q += m * frames[i, 1, c]
                d2 += d * d
            if not d2 > 0.0:
                continue
            w = 1.0 / d2  # what the normals say of near and far neighbours weighs the same
            # unknown: across, along, mixed; p = across x + mixed y, q = mixed x + along y
            a11 += w * x * x
            a22 += w * y * y
            a12 += w * x * y
            a33 += w * (x * x + y * y)
            b1 += w * x * p
            b2 += w * y * q
            b3 += w * (x * q + y * p)
        a23 = a12
        small = 1e-3 * (a11 + a22) + 1e-300
        a11 += small
        a22 += small
        a33 += small
        # [[a11, 0, a12], [0, a22, a23], [a12, a23, a33]]
        rest = a33 - a12 * a12 / a11 - a23 * a23 / a22
        mixed = (b3 - a12 * b1 / a11 - a23 * b2 / a22) / rest
        out[i, 0] = (b1 - a12 * mixed) / a11
        out[i, 1] = (b2 - a23 * mixed) / a22
        out[i, 2] = mixed


def curvatures(
    roots: NDArray[np.float32], frames: NDArray[np.float32], near: NDArray[np.int32], ranges: Ranges = serial_ranges
) -> NDArray[np.float64]:
    """Curvature of the skin (N, 3) float64, 1 / metre, convex above 0: across, along and mixed, in feathers' frames.

    roots : (N, 3) float32. frames : (N, 3, 3) float32, rows right, along, out. near : see :class:`Ground`.
    """
    out = np.zeros((len(roots), 3))
    ranges(len(roots), lambda start, stop: _curvatures(roots, frames, near, start, stop, out), 2048)
    return out


@njit(
    types.void(
        types.Array(types.float64, 2, "C", readonly=True), I32_2D, types.int64, types.int64, types.float64[:, ::1]
    ),
    cache=True, nogil=True,
)
def _average(values, near, start, stop, out):  # type: ignore[no-untyped-def]
    for i in range(start, stop):
        count = 1
        for c in range(values.shape[1]):
            out[i, c] = values[i, c]
        for k in range(near.shape[1]):
            j = near[i, k]
            if j >= 0:
                count += 1
                for c in range(values.shape[1]):
                    out[i, c] += values[j, c]
        for c in range(values.shape[1]):
            out[i, c] /= count


def smoothed(
    values: NDArray[np.float64], near: NDArray[np.int32], passes: int, ranges: Ranges = serial_ranges
) -> NDArray[np.float64]:
    """`values` (N, K) averaged with those of the neighbours, `passes` times."""
    now = np.array(values, np.float64)
    other = np.empty_like(now)
    for _ in range(passes):
        ranges(len(now), lambda start, stop, a=now, b=other: _average(a, near, start, stop, b), 4096)
        now, other = other, now
    return now
