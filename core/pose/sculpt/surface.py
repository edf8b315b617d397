"""What sculpting has to know of a mesh: neighbours, corners, neutral lengths, seams. Found once per mesh."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba.core.types import Array, boolean, float32, float64, int32, int64
from numpy.typing import NDArray

from core.mesh.edges import Edges, edge_vertices, next_corner
from core.mesh.halfedge import weld
from core.mesh.mesh import Mesh
from core.record import freeze

# arguments of the kernels
POINTS = Array(float32, 2, "C", readonly=True)
VALUES = Array(float32, 1, "C", readonly=True)
ROWS = Array(int32, 1, "C", readonly=True)
STARTS = Array(int64, 1, "C", readonly=True)
PAIRS = Array(int32, 2, "C", readonly=True)
NUMBERS = Array(float64, 1, "C", readonly=True)
FLAGS = Array(boolean, 1, "C", readonly=True)


class SculptSurface(NamedTuple):
    """The mesh as brushes see it. Vertices that lie at one place along open edges (a seam) are one *site*.

    site : (V,) int32, the lowest vertex at the place of each vertex; brushes move sites.
    followers : (K,) int32, vertices that are not the lowest of their site; they are moved along.
    starts : (V + 1,) int64; neighbours : (N,) int32, sites joined to each site by an edge, ascending.
    lengths : (N,) float32, metres, of those edges at rest.
    border : (V,) bool, sites on an edge of one face only.
    corner_starts : (V + 1,) int64; corner_ends : (C, 2) int32, for each face at a site the vertices before and after.
    """

    site: NDArray[np.int32]
    followers: NDArray[np.int32]
    starts: NDArray[np.int64]
    neighbours: NDArray[np.int32]
    lengths: NDArray[np.float32]
    border: NDArray[np.bool_]
    corner_starts: NDArray[np.int64]
    corner_ends: NDArray[np.int32]


def sculpt_surface(mesh: Mesh) -> SculptSurface:
    """The surface of a mesh for brushes; the mesh is in its rest shape."""
    vertices = len(mesh.points)
    site = _sites(mesh)
    corners = site[mesh.corners]
    following = next_corner(mesh.counts)
    before = np.empty_like(corners)
    before[following] = corners
    order = np.argsort(corners, kind="stable")
    ends = np.stack([before, corners[following]], axis=1)[order]

    welded = mesh.replace(corners=freeze(corners))
    edges = edge_vertices(welded)
    edges = edges[edges[:, 0] != edges[:, 1]].astype(np.int64)
    both = np.concatenate([edges, edges[:, ::-1]])
    both = both[np.lexsort((both[:, 1], both[:, 0]))]
    points = mesh.points.astype(np.float64)
    lengths = np.linalg.norm(points[both[:, 1]] - points[both[:, 0]], axis=1)
    return SculptSurface(
        freeze(site), freeze(np.flatnonzero(site != np.arange(vertices)).astype(np.int32)),
        freeze(_starts(both[:, 0], vertices)), freeze(both[:, 1].astype(np.int32)), freeze(lengths.astype(np.float32)),
        freeze(_on_border(welded)), freeze(_starts(corners, vertices)), freeze(ends.astype(np.int32)),
    )


def _sites(mesh: Mesh) -> NDArray[np.int32]:
    """The site of each vertex: only what touches along open edges is one place, lips that meet are two."""
    site = np.arange(len(mesh.points), dtype=np.int32)
    open_ = np.flatnonzero(_on_border(mesh))
    site[open_] = open_[weld(mesh.points[open_].astype(np.float64))]
    return site


def _on_border(mesh: Mesh) -> NDArray[np.bool_]:
    edges = Edges.of(mesh.counts, mesh.corners, len(mesh.points))
    lone = edges.order[(edges.uses == 1)[edges.group]]
    out = np.zeros(len(mesh.points), np.bool_)
    out[mesh.corners[lone]] = True
    out[mesh.corners[next_corner(mesh.counts)[lone]]] = True
    return out


def _starts(rows: NDArray[np.integer], count: int) -> NDArray[np.int64]:
    return np.concatenate([[0], np.cumsum(np.bincount(rows, minlength=count))]).astype(np.int64)
