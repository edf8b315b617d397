"""The edges of polygons: who shares them, and whether a surface is closed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.mesh.mesh import Mesh, Triangles


class Edges(NamedTuple):
    """The edges of polygons, one entry per corner (the edge from it to the next), sorted by their two ends.

    order : (C,) corners sorted so that equal edges are neighbours; group : (C,) which edge each sorted entry is;
    uses : (E,) how many faces use each edge; forward : (C,) sorted entry runs from the lower vertex to the higher.
    """

    order: NDArray[np.int64]
    group: NDArray[np.int64]
    uses: NDArray[np.int64]
    forward: NDArray[np.bool_]

    @staticmethod
    def of(counts: NDArray[np.integer], corners: NDArray[np.integer], vertices: int) -> Edges:
        following = corners[next_corner(counts)].astype(np.int64)
        low, high = np.minimum(corners, following), np.maximum(corners, following)
        key = low * np.int64(vertices) + high
        order = np.argsort(key, kind="stable")
        key = key[order]
        new = np.empty(len(key), np.bool_)
        new[:1] = True
        np.not_equal(key[1:], key[:-1], out=new[1:])
        group = np.cumsum(new) - 1
        starts = np.flatnonzero(new)
        uses = np.diff(np.append(starts, len(key)))
        return Edges(order, group, uses, (corners == low)[order])

    @property
    def closed(self) -> bool:
        if not len(self.uses) or not (self.uses == 2).all():
            return False
        return bool((self.forward[0::2] != self.forward[1::2]).all())


def next_corner(counts: NDArray[np.integer]) -> NDArray[np.int64]:
    """The corner after each corner, going round its face, (C,) int64."""
    ends = np.cumsum(counts, dtype=np.int64)
    following = np.arange(1, (int(ends[-1]) if len(ends) else 0) + 1)
    some = counts > 0
    following[ends[some] - 1] = (ends - counts)[some]
    return following


def reversed_corners(counts: NDArray[np.integer]) -> NDArray[np.int64]:
    """Corner numbers that turn every face over: the corners of each face in the other order, (C,) int64."""
    ends = np.cumsum(counts, dtype=np.int64)
    total = int(ends[-1]) if len(ends) else 0
    return np.repeat(2 * ends - counts - 1, counts) - np.arange(total)


def is_closed(surface: Mesh | Triangles) -> bool:
    """True when every edge is used exactly twice, once in each direction: the surface has an inside."""
    if isinstance(surface, Triangles):
        counts, corners = np.full(len(surface.vertices), 3), surface.vertices.reshape(-1)
    else:
        counts, corners = surface.counts, surface.corners
    return Edges.of(counts, corners, int(corners.max(initial=-1)) + 1).closed


def edge_vertices(mesh: Mesh) -> NDArray[np.int32]:
    """The edges of the polygons as pairs of vertices (E, 2) int32, the lower first, each edge once."""
    following = mesh.corners[next_corner(mesh.counts)]
    low, high = np.minimum(mesh.corners, following), np.maximum(mesh.corners, following)
    wide = np.int64(len(mesh.points))
    keys = np.unique(low * wide + high)
    return np.stack([keys // wide, keys % wide], axis=1).astype(np.int32)
