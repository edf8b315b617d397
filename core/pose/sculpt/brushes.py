"""The brushes: points of a posed surface in, new points out. What a brush does not touch keeps its bits.

All take a :class:`~core.pose.sculpt.ring.Ring`. Grab is given the ring of the start of its stroke again and again (its
vertices do not change under the hand, and pressure is no part of it); the others one of every dab. Weights of the ring
fade every brush out to its rim.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numba.core.types import float32, float64, void
from numpy.typing import ArrayLike, NDArray

from core.pose.sculpt.ring import Ring, follow, mean_normal, ring_normals
from core.pose.sculpt.surface import FLAGS, NUMBERS, ROWS, STARTS, VALUES, SculptSurface

Points = NDArray[np.float32]
RELAX_STEP = 0.9  # of the mean correction of the edges at a site; above 1 dense meshes ring


def grab(surface: SculptSurface, points: Points, ring: Ring, movement: ArrayLike) -> Points:
    """Move the ring along.

    Parameters
    ----------
    points : (V, 3) float32, as they were when the stroke began. ring : laid when the stroke began.
    movement : (3,) metres, of the hand since then.
    """
    return _moved(surface, points, ring, ring.weights[:, None] * np.asarray(movement, np.float64))


def draw(surface: SculptSurface, points: Points, ring: Ring, height: float) -> Points:
    """Raise the ring by up to `height` metres (below 0: dig) in the one direction in which it faces."""
    return _moved(surface, points, ring, (height * ring.weights)[:, None] * mean_normal(surface, points, ring))


def inflate(surface: SculptSurface, points: Points, ring: Ring, height: float) -> Points:
    """Move every site by up to `height` metres (below 0: shrink) along its own normal."""
    return _moved(surface, points, ring, (height * ring.weights)[:, None] * ring_normals(surface, points, ring.sites))


def pinch(surface: SculptSurface, points: Points, ring: Ring, strength: float) -> Points:
    """Draw the ring together towards its centre along the surface, by the share `strength` (below 0: apart)."""
    normal = mean_normal(surface, points, ring)
    inward = ring.centre - points[ring.sites].astype(np.float64)
    inward -= np.outer(inward @ normal, normal)
    return _moved(surface, points, ring, (strength * ring.weights)[:, None] * inward)


def flatten(surface: SculptSurface, points: Points, ring: Ring, strength: float) -> Points:
    """Press the ring onto its mean plane, by the share `strength` (below 0: away from it)."""
    total = float(ring.weights.sum())
    if total <= 0.0:
        return points.copy()
    here = points[ring.sites].astype(np.float64)
    normal = mean_normal(surface, points, ring)
    off = (here - (ring.weights @ here) / total) @ normal
    return _moved(surface, points, ring, -(strength * ring.weights * off)[:, None] * normal)


def restore(surface: SculptSurface, points: Points, ring: Ring, towards: Points, strength: float) -> Points:
    """Bring the ring back towards another surface by the share `strength`; 1 at full weight arrives exactly.

    Parameters
    ----------
    towards : (V, 3) float32, the same vertices in the same pose: skinned without corrections, or with the shape that
        another pose has.
    """
    if not (np.shape(towards) == points.shape):
        raise ValueError("restore needs as many points to go towards as there are")
    share = np.clip(strength * ring.weights, 0.0, 1.0)[:, None]
    here, there = points[ring.sites].astype(np.float64), towards[ring.sites].astype(np.float64)
    return _put(surface, points, ring, (1.0 - share) * here + share * there)


def smooth(
    surface: SculptSurface, points: Points, ring: Ring, strength: float, iterations: int = 2
) -> Points:
    """Move every site towards the mean of its neighbours by the share `strength`, `iterations` times.

    Sites on a border are only drawn along it.
    """
    out = points.copy()
    step = np.empty((len(ring.sites), 3))
    for _ in range(iterations):
        _smooth(out, surface.starts, surface.neighbours, surface.border, ring.sites, strength * ring.weights, step)
    return follow(surface, out)


def relax(
    surface: SculptSurface, points: Points, ring: Ring, strength: float, iterations: int = 4,
    lengths: NDArray[np.float32] | None = None,
) -> Points:
    """Let edges slide towards their neutral lengths: stretch evens out, and the shape keeps its form.

    Every site takes the mean of the corrections its edges ask for, without the part along its normal (position based
    dynamics after Mueller et al. 2007, all edges at once).

    Parameters
    ----------
    lengths : (N,) float32, other neutral lengths than those at rest, one for each of ``surface.neighbours``.
    """
    out = points.copy()
    step = np.empty((len(ring.sites), 3))
    neutral = surface.lengths if lengths is None else lengths
    for _ in range(iterations):
        normals = ring_normals(surface, out, ring.sites)
        _relax(
            out, surface.starts, surface.neighbours, neutral, ring.sites, RELAX_STEP * strength * ring.weights, normals,
            step,
        )
    return follow(surface, out)


def _moved(surface: SculptSurface, points: Points, ring: Ring, steps: NDArray[np.float64]) -> Points:
    return _put(surface, points, ring, points[ring.sites] + steps)


def _put(surface: SculptSurface, points: Points, ring: Ring, places: NDArray[np.float64]) -> Points:
    out = points.copy()
    touched = ring.weights != 0.0
    out[ring.sites[touched]] = places[touched]
    return follow(surface, out)


@njit(void(float32[:, ::1], STARTS, ROWS, FLAGS, ROWS, NUMBERS, float64[:, ::1]), cache=True, nogil=True)
def _smooth(
    points: np.ndarray, starts: np.ndarray, neighbours: np.ndarray, border: np.ndarray, sites: np.ndarray,
    shares: np.ndarray, step: np.ndarray,
) -> None:
    for i in range(len(sites)):
        v = sites[i]
        x = y = z = 0.0
        count = 0
        for e in range(starts[v], starts[v + 1]):
            n = neighbours[e]
            if border[v] and not border[n]:
                continue
            x += points[n, 0]
            y += points[n, 1]
            z += points[n, 2]
            count += 1
        share = shares[i] / max(count, 1)
        step[i, 0] = share * (x - count * points[v, 0])
        step[i, 1] = share * (y - count * points[v, 1])
        step[i, 2] = share * (z - count * points[v, 2])
    for i in range(len(sites)):
        if shares[i] != 0.0:
            for k in range(3):
                points[sites[i], k] = float32(points[sites[i], k] + step[i, k])


@njit(
    void(float32[:, ::1], STARTS, ROWS, VALUES, ROWS, NUMBERS, float64[:, ::1], float64[:, ::1]),
    cache=True, nogil=True,
)
def _relax(
    points: np.ndarray, starts: np.ndarray, neighbours: np.ndarray, lengths: np.ndarray, sites: np.ndarray,
    shares: np.ndarray, normals: np.ndarray, step: np.ndarray,
) -> None:
    for i in range(len(sites)):
        v = sites[i]
        x = y = z = 0.0
        for e in range(starts[v], starts[v + 1]):
            n = neighbours[e]
            dx = float64(points[n, 0]) - points[v, 0]
            dy = float64(points[n, 1]) - points[v, 1]
            dz = float64(points[n, 2]) - points[v, 2]
            length = math.sqrt(dx * dx + dy * dy + dz * dz)
            if length > 0.0:
                part = 0.5 * (length - lengths[e]) / length
                x += part * dx
                y += part * dy
                z += part * dz
        share = shares[i] / max(starts[v + 1] - starts[v], 1)
        off = x * normals[i, 0] + y * normals[i, 1] + z * normals[i, 2]
        step[i, 0] = share * (x - off * normals[i, 0])
        step[i, 1] = share * (y - off * normals[i, 1])
        step[i, 2] = share * (z - off * normals[i, 2])
    for i in range(len(sites)):
        if shares[i] != 0.0:
            for k in range(3):
                points[sites[i], k] = float32(points[sites[i], k] + step[i, k])
