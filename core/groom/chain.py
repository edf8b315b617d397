"""A strand as a chain: segments of fixed length, read from float32 points and written back without drift.

The kernels work in float64 on one strand at a time, in scratch arrays made once per call.
Rounding to float32 would let lengths walk away over a thousand strokes. So lengths are read as whole multiples of the
float32 step at the strand (its quantum) and points are written so that the same multiples are read again.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit


@njit(cache=True, nogil=True, error_model="numpy")
def read_chain(points, row, x, q, lengths):  # type: ignore[no-untyped-def]
    """Read strand `row` of `points` (N, P, 3) float32 into float64 scratch; returns its quantum in metres.

    x : (P, 3) points. q : (P - 1, 3) unit directions. lengths : (P - 1,) metres.
    A segment of no length gets the direction of the one before it (the first: of the next one that has one).
    """
    count = x.shape[0]
    size = 0.0
    for k in range(3):
        size = max(size, abs(np.float64(points[row, 0, k])))
        x[0, k] = points[row, 0, k]
    total = 0.0
    for j in range(count - 1):
        d2 = 0.0
        for k in range(3):
            x[j + 1, k] = points[row, j + 1, k]
            q[j, k] = x[j + 1, k] - x[j, k]
            d2 += q[j, k] * q[j, k]
        lengths[j] = math.sqrt(d2)
        total += lengths[j]
    _, exponent = math.frexp(size + total)
    quantum = math.ldexp(1.0, exponent - 24)
    first = -1
    for j in range(count - 1):
        d = lengths[j]
        lengths[j] = math.floor(d / quantum + 0.5) * quantum
        if d > 0.0:
            for k in range(3):
                q[j, k] /= d
            if first < 0:
                first = j
        elif first >= 0:
            for k in range(3):
                q[j, k] = q[j - 1, k]
    for j in range(max(0, first)):
        for k in range(3):
            q[j, k] = q[first, k]
    if first < 0:  # a strand of no length at all
        for j in range(count - 1):
            q[j, 0], q[j, 1], q[j, 2] = 0.0, 0.0, 1.0
    return quantum


@njit(cache=True, nogil=True, error_model="numpy")
def rebuild_chain(x, q, lengths, first):  # type: ignore[no-untyped-def]
    """Lay the points of segments `first` .. end one after another: x[j+1] = x[j] + lengths[j] q[j]."""
    for j in range(first, lengths.shape[0]):
        for k in range(3):
            x[j + 1, k] = x[j, k] + lengths[j] * q[j, k]


@njit(cache=True, nogil=True, error_model="numpy")
def write_chain(points, row, x, lengths, first, quantum):  # type: ignore[no-untyped-def]
    """Store x[first + 1:] in float32 so that each segment is read back with the same length.

    Of the float32 neighbours of a point one is taken whose distance from the point before it is right.
    """
    for j in range(first, lengths.shape[0]):
        bx, by, bz = np.float64(points[row, j, 0]), np.float64(points[row, j, 1]), np.float64(points[row, j, 2])
        dx, dy, dz = x[j + 1, 0] - bx, x[j + 1, 1] - by, x[j + 1, 2] - bz
        d = math.sqrt(dx * dx + dy * dy + dz * dz)
        scale = lengths[j] / d if d > 0.0 else 0.0
        cx, cy, cz = np.float32(bx + scale * dx), np.float32(by + scale * dy), np.float32(bz + scale * dz)
        for _ in range(3):
            ex, ey, ez = np.float64(cx) - bx, np.float64(cy) - by, np.float64(cz) - bz
            d = math.sqrt(ex * ex + ey * ey + ez * ez)
            error = d - lengths[j]
            if abs(error) <= 0.25 * quantum or d == 0.0:
                break
            # the single step of one coordinate that helps most (a step changes the length by step * direction)
            ux = math.ldexp(1.0, max(math.frexp(np.float64(cx))[1], -100) - 24) * (-1.0 if error * ex > 0.0 else 1.0)
            uy = math.ldexp(1.0, max(math.frexp(np.float64(cy))[1], -100) - 24) * (-1.0 if error * ey > 0.0 else 1.0)
            uz = math.ldexp(1.0, max(math.frexp(np.float64(cz))[1], -100) - 24) * (-1.0 if error * ez > 0.0 else 1.0)
            rx, ry, rz = abs(error + ux * ex / d), abs(error + uy * ey / d), abs(error + uz * ez / d)
            if min(rx, ry, rz) >= abs(error):
                break
            if rx <= ry and rx <= rz:
                cx = np.float32(cx + ux)
            elif ry <= rz:
                cy = np.float32(cy + uy)
            else:
                cz = np.float32(cz + uz)
        points[row, j + 1, 0], points[row, j + 1, 1], points[row, j + 1, 2] = cx, cy, cz


@njit(cache=True, nogil=True, error_model="numpy")
def first_free(hold, row, freedom):  # type: ignore[no-untyped-def]
    """How far each segment may be turned, 0 .. 1, into `freedom` (P - 1,); returns the first free segment.

    Turning a segment carries every point beyond it, so a segment is as free as the stiffest of those points.
    The number of segments is returned where the whole strand is locked.
    """
    count = freedom.shape[0]
    stiffest = 0.0
    first = count
    for j in range(count - 1, -1, -1):
        stiffest = max(stiffest, np.float64(hold[row, j + 1]))
        freedom[j] = max(0.0, 1.0 - stiffest)
        if freedom[j] > 0.0:
            first = j
    return first
