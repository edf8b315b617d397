"""A mesh laid flat by its UVs: the edges of its islands, and maps as pictures there. Plain data, made in jobs."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from core.groom.groom import Map
from core.mesh.mesh import Mesh

BAKED = 1024  # pixels along a side of a vertex map laid flat
MOST_INNER = 60_000  # edges inside islands that are kept to be drawn
_SHIFT = 4  # binary digits behind the point in OpenCV's coordinates


class UvLayout(NamedTuple):
    """Edges in UV, each (u, v, u, v). borders : (B, 4) float32, of islands. inner : (E, 4) float32; none when many."""

    borders: NDArray[np.float32]
    inner: NDArray[np.float32]


class FlatMap(NamedTuple):
    """A map laid over the unit square. values : (H, W) float32, its first row at v = 1; NaN where there is no skin."""

    values: NDArray[np.float32]


def uv_layout(mesh: Mesh) -> UvLayout:
    """The edges of a mesh with UVs. An edge is inside an island when another face has it with the same two UVs."""
    assert mesh.uvs is not None
    count = len(mesh.corners)
    following = np.arange(1, count + 1)
    ends = np.cumsum(mesh.counts) - 1
    following[ends] = mesh.starts
    # a corner is the same point of the layout as another when vertex and UV are the same
    keys = np.empty((count, 3), np.int64)
    keys[:, 0] = mesh.corners
    keys[:, 1:] = np.round(mesh.uvs.astype(np.float64) * 1e7).astype(np.int64)
    _, point = np.unique(keys, axis=0, return_inverse=True)
    point = point.reshape(-1)
    pair = np.sort(np.stack([point, point[following]], axis=1), axis=1)
    _, first, times = np.unique(pair, axis=0, return_index=True, return_counts=True)
    edges = np.concatenate([mesh.uvs[first], mesh.uvs[following[first]]], axis=1)
    inner = edges[times > 1]
    return UvLayout(edges[times == 1], inner if len(inner) <= MOST_INNER else inner[:0])


def flat_map(item: Map, mesh: Mesh) -> FlatMap:
    """A map as a picture over UV: an image as it is, values of vertices filled in face by face."""
    if item.image is not None:
        return FlatMap(item.image)
    assert mesh.uvs is not None
    assert item.values is not None
    picture = np.full((BAKED, BAKED), np.nan, np.float32)
    corners = np.stack([mesh.uvs[:, 0], 1.0 - mesh.uvs[:, 1]], axis=1).astype(np.float64) * BAKED - 0.5
    places = np.round(corners * (1 << _SHIFT)).clip(-(2**27), 2**27).astype(np.int32)
    means = np.add.reduceat(item.values[mesh.corners], mesh.starts) / mesh.counts if len(mesh.counts) else ()
    for start, size, value in zip(mesh.starts.tolist(), mesh.counts.tolist(), np.asarray(means).tolist(), strict=True):
        cv2.fillPoly(picture, [places[start : start + size]], value, shift=_SHIFT)
    return FlatMap(picture)


def value_at(flat: FlatMap, u: float, v: float) -> float | None:
    """The number a picture shows at a place of the unit square; None beside it and where there is no skin."""
    height, width = flat.values.shape
    column, row = int(np.floor(u * width)), int(np.floor((1.0 - v) * height))
    if not (0 <= column < width and 0 <= row < height):
        return None
    value = float(flat.values[row, column])
    return None if np.isnan(value) else value


def grey(flat: FlatMap, ground: tuple[int, int, int], most: int = 2048) -> NDArray[np.uint8]:
    """Pixels (h, w, 3) uint8 of a map, black at 0 (or the least below) and white at 1 (or the most above).

    Parameters
    ----------
    ground : colour where there is no skin. most : pixels along a side.
    """
    values = flat.values
    largest = max(values.shape)
    if largest > most:
        step = -(-largest // most)
        values = values[::step, ::step]
    known = ~np.isnan(values)
    inside = values[known]
    low, high = min(0.0, float(inside.min(initial=0.0))), max(1.0, float(inside.max(initial=1.0)))
    out = np.empty((*values.shape, 3), np.uint8)
    out[:] = ground
    out[known] = np.round(255.0 * (inside - low) / (high - low)).astype(np.uint8)[:, None]
    return out
