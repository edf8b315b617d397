"""Kernels of the scatter: drawing stratified candidates, and the order of those chosen."""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from core.random import rand1

F32_2D = types.Array(types.float32, 2, "C", readonly=True)
F64_1D = types.Array(types.float64, 1, "C", readonly=True)
I64_1D = types.Array(types.int64, 1, "C", readonly=True)
U32_1D = types.Array(types.uint32, 1, "C", readonly=True)


@njit(cache=True, inline="always")
def _weights(key, seed):  # type: ignore[no-untyped-def]
    """Uniform barycentric weights of a candidate (the square root of Turk, "Generating random points", 1990)."""
    root = math.sqrt(rand1(key, np.uint32(seed + 1)))
    v = rand1(key, np.uint32(seed + 2))
    return 1.0 - root, root * (1.0 - v), root * v


@njit(types.void(U32_1D, types.int64, types.float32[:, ::1]), cache=True, nogil=True, error_model="numpy")
def interpolate(keys, seed, barycentric):  # type: ignore[no-untyped-def]
    """Write the barycentric weights of candidates `keys`."""
    for i in range(len(keys)):
        a, b, c = _weights(keys[i], seed)
        barycentric[i, 0], barycentric[i, 1], barycentric[i, 2] = a, b, c


@njit(
    types.void(
        F64_1D, F32_2D, I64_1D, types.int64, types.int32[::1], types.float32[:, ::1], types.int64, types.int64
    ),
    cache=True, nogil=True, error_model="numpy",
)
def draw_candidates(cumulative, corners, ends, seed, triangle, places, start, stop):  # type: ignore[no-untyped-def]
    """Candidates start .. stop: the i-th of a batch of m lies at (i + random) / m of the cumulative area."""
    last = len(cumulative) - 1
    batch = np.searchsorted(ends, start, side="right")
    t = -1
    for i in range(start, stop):
        if i >= ends[batch]:
            batch += 1
            t = -1
        first = ends[batch - 1] if batch > 0 else 0
        share = (i - first + rand1(np.uint32(i), np.uint32(seed))) / (ends[batch] - first)
        target = share * cumulative[last]
        if t < 0:
            t = min(last, np.searchsorted(cumulative, target, side="right"))
        while t < last and cumulative[t] <= target:
            t += 1
        a, b, c = _weights(np.uint32(i), seed)
        triangle[i] = t
        for k in range(3):
            places[i, k] = a * corners[t, k] + b * corners[t, 3 + k] + c * corners[t, 6 + k]


@njit(
    types.int64[::1](I64_1D, I64_1D, types.int64), cache=True, nogil=True, error_model="numpy"
)
def shuffled(chosen, levels, seed):  # type: ignore[no-untyped-def]
    """Order that sorts roots by level, at random within each: a radix sort (the hash permutes its 32 bits)."""
    count = len(chosen)
    number = np.empty(count, np.uint32)
    for i in range(count):
        number[i] = np.uint32(rand1(np.uint32(chosen[i]), np.uint32(seed + 5)) * 4294967296.0)
    order, other = np.empty(count, np.int64), np.arange(count)
    for digit in range(3):
        ends = np.zeros(65537, np.int64)
        for i in range(count):
            ends[(levels[i] if digit == 2 else (number[i] >> np.uint32(16 * digit)) & 65535) + 1] += 1
        for d in range(65536):
            ends[d + 1] += ends[d]
        for k in range(count):
            i = other[k]
            d = levels[i] if digit == 2 else (number[i] >> np.uint32(16 * digit)) & 65535
            order[ends[d]] = i
            ends[d] += 1
        order, other = other, order
    return other
