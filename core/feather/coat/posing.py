"""Feathers posed on the skin: a vane in its own frame bent, cupped, twisted, rolled and lifted at its root.

A feather is a rigid instance (root, frame, lift, roll) of a shape (its own vane under bend, cup and twist): what is
laid out here a point instancer can carry. Bend, cup and twist are curvatures: those of the skin below make
a vane lie parallel to it, and what is added to them is the feather's own.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from core.workers import serial_ranges

Ranges = Callable[..., None]
F32_2D = types.Array(types.float32, 2, "C", readonly=True)
F32_3D = types.Array(types.float32, 3, "C", readonly=True)
F32_4D = types.Array(types.float32, 4, "C", readonly=True)
F64_2D = types.Array(types.float64, 2, "C", readonly=True)
I32_1D = types.Array(types.int32, 1, "C", readonly=True)

LIFT, ROLL, BEND, CUP, TWIST, LENGTH = range(6)  # columns of the pose of a feather
POSE = 6


@njit(cache=True, inline="always")
def _arc(s, z, curvature):  # type: ignore[no-untyped-def]
    """A point at `s` along and `z` above a line that bends down with `curvature`, lengths on the line kept."""
    a = curvature * s
    if abs(a) < 1e-6:
        return s, z - 0.5 * a * s
    sine = math.sin(a)
    return sine / curvature + z * sine, z * math.cos(a) - (1.0 - math.cos(a)) / curvature


@njit(cache=True, inline="always")
def shaped_point(x, y, z, length, bend, cup, twist):  # type: ignore[no-untyped-def]
    """A point of a vane in its own frame, scaled by `length`, cupped across, twisted and bent along (kernel form)."""
    x, y, z = length * x, length * y, length * z
    x, z = _arc(x, z, cup)
    z -= twist * x * y
    y, z = _arc(y, z, bend)
    return x, y, z


@njit(cache=True, nogil=True)
def pose_vane(vane, pose, root, frame, out):  # type: ignore[no-untyped-def]
    """Write the vane (R, C, 3) under `pose` (6,), at `root` (3,) in `frame` (3, 3), rows right, along, out."""
    cos_roll, sin_roll = math.cos(pose[ROLL]), math.sin(pose[ROLL])
    cos_lift, sin_lift = math.cos(pose[LIFT]), math.sin(pose[LIFT])
    for r in range(vane.shape[0]):
        for c in range(vane.shape[1]):
            x, y, z = shaped_point(
                np.float64(vane[r, c, 0]), np.float64(vane[r, c, 1]), np.float64(vane[r, c, 2]),
                pose[LENGTH], pose[BEND], pose[CUP], pose[TWIST],
            )
            x, z = x * cos_roll - z * sin_roll, x * sin_roll + z * cos_roll
            y, z = y * cos_lift - z * sin_lift, y * sin_lift + z * cos_lift
            for k in range(3):
                out[r, c, k] = root[k] + x * frame[0, k] + y * frame[1, k] + z * frame[2, k]


@njit(
    types.void(
        F32_4D, F64_2D, F32_2D, F32_3D, I32_1D, types.int64, types.int64, types.float32[:, :, :, ::1]
    ),
    cache=True, nogil=True,
)
def _pose_rows(vanes, poses, roots, frames, rows, start, stop, out):  # type: ignore[no-untyped-def]
    for k in range(start, stop):
        i = rows[k]
        pose_vane(vanes[i], poses[i], roots[i], frames[i], out[i])


def pose_vanes(
    vanes: NDArray[np.float32], poses: NDArray[np.float64], roots: NDArray[np.float32], frames: NDArray[np.float32],
    out: NDArray[np.float32] | None = None, rows: NDArray[np.int32] | None = None, ranges: Ranges = serial_ranges,
) -> NDArray[np.float32]:
    """The surfaces of N feathers in space.

    Parameters
    ----------
    vanes : (N, R, C, 3) float32, each in its own frame: x right, y along the shaft, z away from the skin, at length 1.
    poses : (N, 6) float64: lift and roll (radians), bend, cup and twist (1 / metre), length (metres).
    roots : (N, 3) float32, metres. frames : (N, 3, 3) float32, rows right, along, out.
    out, rows : where to write, and which rows (n,) int32; everything anew when they are None.

    Returns
    -------
    (N, R, C, 3) float32, metres.
    """
    out = np.empty(vanes.shape, np.float32) if out is None else out
    rows = np.arange(len(vanes), dtype=np.int32) if rows is None else rows
    ranges(len(rows), lambda start, stop: _pose_rows(vanes, poses, roots, frames, rows, start, stop, out), 256)
    return out
