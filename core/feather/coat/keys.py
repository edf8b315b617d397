"""From keys to feathers: what the strands of the keys say, interpolated over the surface between them.

A key is a strand like a guide of a groom: its root tangent is the direction and the lift of the feathers around it, its
length theirs, its turning their curl. Weights come from the binding of the hair (barycentric in the intrinsic Delaunay
triangulation of the keys): continuous, exact at keys, never across a gap between two parts of the body.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.feather.coat.coat import KeyAttributes
from core.groom.guides import Guides
from core.mesh.intrinsic import Binding


class KeyShape(NamedTuple):
    """What G keys say of the feathers around them.

    normals : (G, 3), unit, of the skin. directions : (G, 3), unit, along the skin. scalars : (G, 3), lift at the root
    (radians), length (metres), turning from root to tip (radians, away from the skin above 0).
    """

    normals: NDArray[np.float64]
    directions: NDArray[np.float64]
    scalars: NDArray[np.float64]


def key_shapes(guides: Guides) -> KeyShape:
    """What the strands of keys (at rest) say; a strand without length says only where it stands."""
    points = guides.points.astype(np.float64)
    normals = guides.roots.frames[:, 2].astype(np.float64)
    steps = np.diff(points, axis=1)
    lengths = np.linalg.norm(steps, axis=2)
    total = lengths.sum(axis=1)
    quarter = max(1, steps.shape[1] // 4)
    first = _unit(steps[:, :quarter].sum(axis=1))
    last = _unit(steps[:, -quarter:].sum(axis=1))
    chord = points[:, -1] - points[:, 0]
    along = chord - normals * np.einsum("gc,gc->g", chord, normals)[:, None]
    direction = _unit(along)
    rise = _angle(first, direction, normals)
    turn = _angle(last, direction, normals) - rise
    return KeyShape(normals, direction, np.stack([rise, total, turn], axis=1))


def _angle(
    steps: NDArray[np.float64], along: NDArray[np.float64], normals: NDArray[np.float64]
) -> NDArray[np.float64]:
    height, reach = np.einsum("gc,gc->g", steps, normals), np.einsum("gc,gc->g", steps, along)
    return np.asarray(np.arctan2(height, np.maximum(reach, 1e-9)))


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-30))


def interpolate_directions(
    shape: KeyShape, binding: Binding, normals: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Directions (N, 3), not yet unit, at feathers whose normals (N, 3) are given.

    Each key's direction is turned by the smallest rotation from its normal to the feather's before they are mixed.
    """
    out = np.zeros((len(binding.sites), 3))
    for k in range(3):
        site = binding.sites[:, k]
        a, t = shape.normals[site], shape.directions[site]
        cosine = np.einsum("nc,nc->n", a, normals)
        axis = np.cross(a, normals)
        turned = (
            t * cosine[:, None] + np.cross(axis, t)
            + axis * (np.einsum("nc,nc->n", axis, t) / np.maximum(1.0 + cosine, 1e-3))[:, None]
        )
        out += binding.weights[:, k, None] * turned
    return out


def interpolate(values: NDArray[np.floating], binding: Binding) -> NDArray[np.float64]:
    """Values (N, A) at the feathers of values (G, A) at the keys."""
    out = np.zeros((len(binding.sites), values.shape[1]))
    for k in range(3):
        out += binding.weights[:, k, None] * values[binding.sites[:, k]]
    return out


def attributes_of_keys(guides: Guides, given: KeyAttributes, defaults: NDArray[np.float64]) -> NDArray[np.float64]:
    """Attributes (G, A) of all keys: those given by id, `defaults` (A,) for the others."""
    out = np.tile(np.asarray(defaults, np.float64), (len(guides), 1))
    rows = {int(key): row for row, key in enumerate(given.ids)}
    for row, key in enumerate(guides.ids.tolist()):
        if key in rows:
            out[row] = given.values[rows[key]]
    return out
