"""Masks over a surface: (V,) float32, 0 free .. 1 protected from every brush."""

from __future__ import annotations

import numpy as np
from numba import njit
from numba.core.types import float32, void
from numpy.typing import NDArray

from core.pose.sculpt.ring import Ring
from core.pose.sculpt.surface import NUMBERS, ROWS, STARTS, VALUES, SculptSurface

Mask = NDArray[np.float32]


def no_mask(surface: SculptSurface) -> Mask:
    """Nothing is protected."""
    return np.zeros(len(surface.site), np.float32)


def paint_mask(surface: SculptSurface, mask: Mask, ring: Ring, value: float = 1.0, strength: float = 1.0) -> Mask:
    """Bring the mask within the ring nearer to `value` by the share `strength`. Lay the ring without a mask."""
    share = np.clip(strength * ring.weights, 0.0, 1.0)
    out = mask.copy()
    out[ring.sites] = np.clip((1.0 - share) * mask[ring.sites] + share * value, 0.0, 1.0)
    return _follow(surface, out)


def blur_mask(
    surface: SculptSurface, mask: Mask, ring: Ring, strength: float = 1.0, iterations: int = 1
) -> Mask:
    """Soften the mask within the ring: every site takes the mean of its neighbours by the share `strength`."""
    share = np.clip(strength * ring.weights, 0.0, 1.0)
    out = mask.copy()
    for _ in range(iterations):
        _blur(out.copy(), surface.starts, surface.neighbours, ring.sites, share, out)
    return _follow(surface, out)


def invert_mask(mask: Mask) -> Mask:
    """What was protected is free, and the other way round."""
    return np.float32(1.0) - mask


def grown_mask(surface: SculptSurface, mask: Mask) -> Mask:
    """What is protected reaches one ring of neighbours farther: every site takes the most of those joined to it."""
    out = mask.copy()
    np.maximum.at(out, np.repeat(np.arange(len(mask)), np.diff(surface.starts)), mask[surface.neighbours])
    return _follow(surface, out)


def shrunk_mask(surface: SculptSurface, mask: Mask) -> Mask:
    """What is protected gives way by one ring of neighbours: the reverse of :func:`grown_mask`."""
    return invert_mask(grown_mask(surface, invert_mask(mask)))


def _follow(surface: SculptSurface, mask: Mask) -> Mask:
    mask[surface.followers] = mask[surface.site[surface.followers]]
    return mask


@njit(void(VALUES, STARTS, ROWS, ROWS, NUMBERS, float32[::1]), cache=True, nogil=True)
def _blur(
    mask: np.ndarray, starts: np.ndarray, neighbours: np.ndarray, sites: np.ndarray, shares: np.ndarray, out: np.ndarray
) -> None:
    for i in range(len(sites)):
        v = sites[i]
        first, last = starts[v], starts[v + 1]
        if first == last:
            continue
        total = 0.0
        for e in range(first, last):
            total += mask[neighbours[e]]
        out[v] = float32((1.0 - shares[i]) * mask[v] + shares[i] * total / (last - first))
