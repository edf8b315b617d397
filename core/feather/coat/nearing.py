"""How near the skin comes to feathers in a pose: they draw in before it reaches them, as smoothly as it comes.

What a skin that folds would swallow cannot be known from the root of a feather alone. Points along its vane ask how far
off the skin is, and are compared with how far it was at rest; a feather ends before the first that the skin comes to.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from core.mesh.bvh import closest_points
from core.mesh.skin import Skin
from core.workers import Workers

AT_EASE = 0.9  # of how far the skin was at rest: nearer than that a feather begins to draw in
SOFT = 0.05  # of the length of a feather: how deep the skin may come before all beyond a point is drawn in
LEAST = 0.01  # of its length that stays of a feather
CHUNK = 8192  # feathers whose points are asked for at once


def clearances(
    vanes: NDArray[np.float32], lengths: NDArray[np.float64], skin: Skin, workers: Workers
) -> NDArray[np.float32]:
    """How far points of N vanes lie off the skin (N, P, 3), over the length of the feather; below 0 inside.

    vanes : (N, R, C, 3) float32. lengths : (N,), metres. The points lie between and on the rows of the vane beyond the
    root, P of them along both edges and the shaft.
    """
    out = np.empty((len(vanes), 2 * (vanes.shape[1] - 1), 3), np.float32)
    for rows in _chunks(len(vanes)):
        points = _sampled(vanes[rows])
        flat = np.ascontiguousarray(points.reshape(-1, 3))
        triangle, weights, distance = closest_points(skin.bvh, flat, workers=workers)
        corners = skin.triangles.vertices[np.maximum(triangle, 0)]
        nearest = np.einsum("nk,nkc->nc", weights, skin.points[corners])
        outward = np.einsum("nk,nkc->nc", weights, skin.normals[corners])
        inside = np.einsum("nc,nc->n", flat - nearest, outward) < 0.0
        signed = np.where(inside, -distance, distance).reshape(points.shape[:3])
        out[rows] = signed / np.maximum(lengths[rows, None, None], 1e-30)
    return out


def drawn_from_skin(
    own: NDArray[np.float32], rest: NDArray[np.float32], now: NDArray[np.float32]
) -> NDArray[np.float64]:
    """Factor (N,) on lengths, from the ``clearances`` (N, P, 3) at rest and in a pose; 1 where they are alike.

    own : (N, R, C, 3) float32, vanes in their own frames at length 1: where along the feather their points lie. Points
    that lay inside at rest say nothing.
    """
    factor = np.empty(len(own))
    for rows in _chunks(len(own)):
        along = np.clip(_sampled(own[rows])[..., 1].astype(np.float64), 0.0, 1.0)
        before = np.full_like(along, LEAST)
        before[:, 2:] = np.maximum(along[:, :-2], LEAST)
        was, is_now = rest[rows].astype(np.float64), now[rows]
        share = np.clip((is_now + SOFT) / (AT_EASE * np.maximum(was, 0.0) + SOFT), 0.0, 1.0)
        share = np.where(was > 0.0, share, 1.0)
        factor[rows] = (before + (1.0 - before) * share).min(axis=(1, 2), initial=1.0)
    return factor


def _sampled(vanes: NDArray[np.float32]) -> NDArray[np.float32]:
    """Points (N, 2 (R - 1), 3, 3) of both edges and the shaft of vanes (N, R, C, 3): between rows, and on them."""
    columns = vanes[:, :, [0, vanes.shape[2] // 2, vanes.shape[2] - 1]]
    out = np.empty((len(vanes), 2 * (vanes.shape[1] - 1), 3, 3), np.float32)
    out[:, 0::2] = 0.5 * (columns[:, 1:] + columns[:, :-1])
    out[:, 1::2] = columns[:, 1:]
    return out


def _chunks(count: int) -> Iterator[slice]:
    return (slice(start, min(start + CHUNK, count)) for start in range(0, count, CHUNK))
