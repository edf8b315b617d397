"""Shafts shaped by hand: a place on the shaft is pulled, the root stays."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Way = Literal["bend", "turn", "lengthen"]
STEPS = 40  # halvings of an angle
MOST = 0.75 * np.pi  # radians a shaft is bent by; beyond it curls up


def pulled(shaft: ArrayLike, along: float, target: ArrayLike, way: Way) -> Array:
    """A shaft (P, 3) pulled at a place towards a target (3,), any lengths in one unit, its root fixed.

    Parameters
    ----------
    along : of the place that is held, 0 at the root .. 1 at the tip.
    way : "bend" turns each piece a little more than the one before, so that what lies beyond the hand goes on straight;
        "turn" turns the whole shaft about its root; "lengthen" also makes it as long as the hand is away.

    Returns
    -------
    (P, 3) float64. The place then lies in the direction of the target; bent and turned shafts keep the length of every
    piece.
    """
    line, to = np.asarray(shaft, np.float64), np.asarray(target, np.float64)
    root, held = line[0], place_on(line, along)
    here, there = held - root, to - root
    size = float(np.linalg.norm(here)), float(np.linalg.norm(there))
    if min(size) < 1e-12:
        return line.copy()
    cross = np.cross(here, there)
    angle = float(np.arctan2(np.linalg.norm(cross), here @ there))
    axis = cross / max(float(np.linalg.norm(cross)), 1e-300)
    if way != "bend":
        turned = root + _turned(line - root, axis, np.full(len(line), angle))
        return root + (turned - root) * (size[1] / size[0]) if way == "lengthen" else turned

    def reached(bend: float) -> float:
        at = place_on(_bent(line, along, axis, bend), along) - root
        return float(np.arctan2(np.cross(here, at) @ axis, here @ at))

    low, high = 0.0, min(2.0 * angle, MOST)
    for _ in range(STEPS):  # the more the pieces turn the farther the place has turned: halve
        middle = 0.5 * (low + high)
        low, high = (middle, high) if 0.0 <= reached(middle) < angle else (low, middle)
    rest = angle - reached(low)  # what bending alone does not reach, the root turns
    bent = _bent(line, along, axis, low)
    return root + _turned(bent - root, axis, np.full(len(line), rest))


def place_on(shaft: Array, along: float) -> Array:
    """The place (3,) on a shaft (P, 3), 0 at the root .. 1 at the tip by its points."""
    at = along * (len(shaft) - 1)
    return np.array([np.interp(at, np.arange(len(shaft)), shaft[:, k]) for k in range(3)])


def _bent(line: Array, along: float, axis: Array, angle: float) -> Array:
    """Each piece of a line turned about `axis`, the more the nearer it is to `along`, and by `angle` from there on."""
    pieces = np.diff(line, axis=0)
    lengths = np.linalg.norm(pieces, axis=1)
    ends = np.concatenate([[0.0], np.cumsum(lengths)])
    held = float(np.interp(along * len(pieces), np.arange(len(ends)), ends))
    shares = np.minimum(0.5 * (ends[:-1] + ends[1:]) / max(held, 1e-12), 1.0)
    turned = _turned(pieces, axis, angle * shares)
    return np.concatenate([line[:1], line[0] + np.cumsum(turned, axis=0)])


def _turned(vectors: Array, axis: Array, angles: Array) -> Array:
    """Vectors (N, 3), each turned about the unit `axis` by its angle (Rodrigues)."""
    cosine, sine = np.cos(angles)[:, None], np.sin(angles)[:, None]
    return np.asarray(
        vectors * cosine + np.cross(axis, vectors) * sine + axis * (vectors @ axis)[:, None] * (1.0 - cosine))
