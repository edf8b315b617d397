"""Two feathers: blended, and compared attribute by attribute and outline to outline."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from core.feather.attributes import ATTRIBUTES, limits
from core.feather.barbs import condense, expand


class Difference(NamedTuple):
    """One attribute two feathers differ in; `share` is the difference as a part of its range."""

    name: str
    first: float
    second: float
    share: float


class Comparison(NamedTuple):
    """How two feathers differ: attributes, the largest first; and how far their outlines lie apart, in shaft lengths:
    at most, and on average."""

    attributes: tuple[Difference, ...]
    outline_most: float
    outline_mean: float


def blend(first: NDArray[Any], second: NDArray[Any], share: float | NDArray[Any]) -> NDArray[np.float32]:
    """Attributes (..., K) between two feathers: `share` 0 is the first to the bit, 1 the second."""
    a, b, f = (np.asarray(v, np.float64) for v in (first, second, share))
    mixed = a * (1.0 - f) + b * f
    low, high = limits()
    return np.clip(mixed, low, high).astype(np.float32)


def compare(first: NDArray[Any], second: NDArray[Any]) -> Comparison:
    """Compare the attributes (K,) of two feathers and the outlines of what they make."""
    found = [
        Difference(known.name, float(a), float(b), float(abs(b - a)) / (known.high - known.low))
        for known, a, b in zip(ATTRIBUTES, first, second, strict=True) if a != b
    ]  # fmt: skip
    found.sort(key=lambda difference: -difference.share)
    lines = [outline(v) for v in (first, second)]
    apart = np.concatenate([
        cKDTree(lines[1]).query(lines[0])[0], cKDTree(lines[0]).query(lines[1])[0],
    ])  # fmt: skip
    return Comparison(tuple(found), float(apart.max()), float(apart.mean()))


def outline(values: NDArray[Any]) -> NDArray[np.float64]:
    """Points (P, 2) along the outline of a feather lying flat, in shaft lengths: ends of its barbs and its shaft."""
    a = np.ascontiguousarray(values, np.float32)
    curves = expand(a, condense(a[None], np.zeros(1, np.int64)), 0, 2)
    shaft = np.stack([np.zeros(64), np.linspace(0.0, 1.0, 64)], axis=1)
    return np.concatenate([curves.flat[:, -1].astype(np.float64), shaft])
