"""Smooth noise keyed on a seed, for wear and patterns (kernels)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from core.random import rand1


@njit(cache=True, inline="always")
def signed(key, seed):  # type: ignore[no-untyped-def]
    """Uniform in -1 .. 1 for a key and a seed."""
    return 2.0 * rand1(np.uint32(key & 0xFFFFFFFF), np.uint32(seed & 0xFFFFFFFF)) - 1.0


@njit(cache=True)
def noise1(x, seed):  # type: ignore[no-untyped-def]
    """Smooth noise along a line, -1 .. 1, one bump a unit."""
    at = math.floor(x)
    f = x - at
    f = f * f * (3.0 - 2.0 * f)
    a, b = signed(int(at), seed), signed(int(at) + 1, seed)
    return a + (b - a) * f


@njit(cache=True)
def noise2(x, y, seed):  # type: ignore[no-untyped-def]
    """Smooth noise in a plane, -1 .. 1, one bump a unit."""
    at = math.floor(y)
    f = y - at
    f = f * f * (3.0 - 2.0 * f)
    a = noise1(x, seed + 7919 * int(at))
    b = noise1(x, seed + 7919 * (int(at) + 1))
    return a + (b - a) * f
