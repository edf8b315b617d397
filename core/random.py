"""Seeded randomness keyed on stable ids, never on the order of rows.

The hash is the finaliser of MurmurHash3 (32 bit) over id and seed: the same id and seed give the same
number on every machine, in numpy and inside numba kernels alike.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray


@njit("uint32(uint32, uint32)", cache=True, inline="always")
def hash32(key: int | np.uint32, seed: int | np.uint32) -> np.uint32:
    """Hash one 32-bit key with a seed (kernel form)."""
    s = np.uint32(seed)
    h = np.uint32(np.uint32(key) ^ np.uint32(np.uint32(s * np.uint32(0x9E3779B9)) + np.uint32(0x7F4A7C15)))
    h = np.uint32(h ^ (h >> np.uint32(16)))
    h = np.uint32(h * np.uint32(0x85EBCA6B))
    h = np.uint32(h ^ (h >> np.uint32(13)))
    h = np.uint32(h * np.uint32(0xC2B2AE35))
    h = np.uint32(h ^ (h >> np.uint32(16)))
    h = np.uint32(np.uint32(h + s) * np.uint32(0x9E3779B1))
    h = np.uint32(h ^ (h >> np.uint32(15)))
    return h


@njit("float64(uint32, uint32)", cache=True, inline="always")
def rand1(key: int | np.uint32, seed: int | np.uint32) -> float:
    """Uniform number in [0, 1) of one key (kernel form)."""
    return hash32(key, seed) * (1.0 / 4294967296.0)


def rand(keys: ArrayLike, seed: ArrayLike = 0) -> NDArray[np.float64]:
    """Uniform numbers in [0, 1), one for each integer key, for an integer `seed`; the two broadcast."""
    with np.errstate(over="ignore"):
        k = np.asarray(keys).astype(np.int64).astype(np.uint32)
        s = np.asarray(seed).astype(np.int64).astype(np.uint32)
        h = k ^ (s * np.uint32(0x9E3779B9) + np.uint32(0x7F4A7C15))
        h ^= h >> np.uint32(16)
        h *= np.uint32(0x85EBCA6B)
        h ^= h >> np.uint32(13)
        h *= np.uint32(0xC2B2AE35)
        h ^= h >> np.uint32(16)
        h += s
        h *= np.uint32(0x9E3779B1)
        h ^= h >> np.uint32(15)
    return h * (1.0 / 4294967296.0)
