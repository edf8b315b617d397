"""Gradient noise in one and three dimensions, keyed on the same hash as everything random.

After Perlin, "Improving Noise" (SIGGRAPH 2002): quintic fade, twelve edge gradients; hash32 is the
permutation.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from core.random import hash32

MAX_OCTAVES = 8


@njit("float64(float64)", cache=True, nogil=True, inline="always")
def _fade(f: float) -> float:
    return f * f * f * (f * (f * 6.0 - 15.0) + 10.0)


@njit("float64(uint32, float64, float64, float64)", cache=True, nogil=True, inline="always")
def _slope(hashed: np.uint32, x: float, y: float, z: float) -> float:
    """Dot product with one of the twelve edges of a cube."""
    h = hashed & np.uint32(15)
    u = x if h < 8 else y
    v = y if h < 4 else (x if h in (12, 14) else z)
    return (u if h & np.uint32(1) == 0 else -u) + (v if h & np.uint32(2) == 0 else -v)


@njit("float64(float64, uint32)", cache=True, nogil=True)
def noise1(x: float, seed: int | np.uint32) -> float:
    """Noise -1 .. 1 along a line, 0 at whole numbers (kernel form)."""
    cell = math.floor(x)
    f = x - cell
    i = np.int64(cell)
    low = hash32(np.uint32(i & 0xFFFFFFFF), seed) * (2.0 / 4294967296.0) - 1.0
    high = hash32(np.uint32((i + 1) & 0xFFFFFFFF), seed) * (2.0 / 4294967296.0) - 1.0
    a, b = low * f, high * (f - 1.0)
    return 2.0 * (a + _fade(f) * (b - a))


@njit("float64(float64, float64, float64, uint32)", cache=True, nogil=True)
def noise3(x: float, y: float, z: float, seed: int | np.uint32) -> float:
    """Noise -1 .. 1 in space, 0 where all three are whole numbers (kernel form)."""
    cx, cy, cz = math.floor(x), math.floor(y), math.floor(z)
    fx, fy, fz = x - cx, y - cy, z - cz
    ix, iy, iz = np.int64(cx), np.int64(cy), np.int64(cz)
    wx, wy, wz = _fade(fx), _fade(fy), _fade(fz)
    total = 0.0
    for k in range(2):
        hz = hash32(np.uint32((iz + k) & 0xFFFFFFFF), seed)
        for j in range(2):
            hy = hash32(np.uint32((iy + j) & 0xFFFFFFFF), hz)
            for i in range(2):
                h = hash32(np.uint32((ix + i) & 0xFFFFFFFF), hy)
                weight = (wx if i else 1.0 - wx) * (wy if j else 1.0 - wy) * (wz if k else 1.0 - wz)
                total += weight * _slope(h, fx - i, fy - j, fz - k)
    return min(1.0, max(-1.0, total))  # the edges of a cube reach 1.04 in a few places


@njit(
    "void(int64, float64[::1], float64[::1], float64[::1], float64[::1], uint32[::1], float64[::1])",
    cache=True, nogil=True,
)
def fractal_noise(
    dimensions: int, x: np.ndarray, y: np.ndarray, z: np.ndarray,
    octaves: np.ndarray, seeds: np.ndarray, out: np.ndarray,
) -> None:
    """Sum of octaves, each twice as fine and half as strong, divided by the sum of strengths; all arrays (N,).

    `dimensions` is 1 (y and z are not read) or 3; `octaves` is clamped to 1 .. MAX_OCTAVES.
    """
    for row in range(out.shape[0]):
        count = np.int64(min(float(MAX_OCTAVES), max(1.0, octaves[row])))
        strength, scale, total, whole = 1.0, 1.0, 0.0, 0.0
        for octave in range(count):
            seed = np.uint32(seeds[row] + np.uint32(octave))
            if dimensions == 1:
                total += strength * noise1(x[row] * scale, seed)
            else:
                total += strength * noise3(x[row] * scale, y[row] * scale, z[row] * scale, seed)
            whole += strength
            strength *= 0.5
            scale *= 2.0
        out[row] = total / whole
