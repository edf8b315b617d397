"""Select guides: by brush, lasso, neighbours, islands of the mesh. While any are selected only those are edited.

Frozen guides are never selected or unselected.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from core.groom.guides import Guides
from core.groom.region import View, inside_polygon, neighbours, screen_weights
from core.mesh.mesh import Mesh
from core.mesh.surface import root_vertices
from core.record import freeze

Mode = Literal["replace", "add", "remove", "toggle"]


def select(guides: Guides, mask: NDArray[np.bool_], mode: Mode = "replace") -> Guides:
    """Select the guides of `mask` (G,), or add them, take them away or toggle them."""
    chosen = np.asarray(mask, np.bool_)
    if mode == "replace":
        selected = chosen
    elif mode == "add":
        selected = guides.selected | chosen
    elif mode == "remove":
        selected = guides.selected & ~chosen
    else:
        selected = guides.selected ^ chosen
    selected = np.where(guides.frozen, guides.selected, selected)
    if np.array_equal(selected, guides.selected):
        return guides
    return guides.replace(selected=freeze(selected))


def select_all(guides: Guides) -> Guides:
    """Select every guide that is not frozen."""
    return select(guides, np.ones(len(guides), np.bool_))


def select_none(guides: Guides) -> Guides:
    """Select nothing, so that everything may be edited again."""
    return select(guides, np.zeros(len(guides), np.bool_))


def select_inverse(guides: Guides) -> Guides:
    """Select what is not selected."""
    return select(guides, ~guides.selected)


def select_ids(guides: Guides, ids: ArrayLike, mode: Mode = "replace") -> Guides:
    """Select guides by their ids; ids that do not exist are passed over."""
    return select(guides, np.isin(guides.ids, np.asarray(ids)), mode)


def select_with_ring(
    guides: Guides, view: View, path: ArrayLike, radius: float, mode: Mode = "add",
    mask: NDArray[np.bool_] | None = None, roots_only: bool = False,
) -> Guides:
    """Select strands with a point under a ring of `radius` pixels dragged along `path` (K, 2) pixels.

    mask : (G,) bool, those that may be picked, e.g. `facing`. roots_only : only the root counts.
    """
    points = guides.points[:, :1] if roots_only else guides.points
    under = np.any(screen_weights(points, view, path, radius, "constant") > 0.0, axis=1)
    return select(guides, under if mask is None else under & mask, mode)


def select_in_lasso(
    guides: Guides, view: View, polygon: ArrayLike, mode: Mode = "replace",
    mask: NDArray[np.bool_] | None = None, roots_only: bool = False,
) -> Guides:
    """Select strands with a point inside a closed polygon (K, 2) drawn in pixels (even-odd)."""
    pixels, w = view.pixels(guides.points[:, :1] if roots_only else guides.points)
    inside = np.any(inside_polygon(pixels, polygon) & (w > 0.0), axis=1)
    return select(guides, inside if mask is None else inside & mask, mode)


def select_more(guides: Guides, near: NDArray[np.int64] | None = None) -> Guides:
    """Add the neighbours (the 6 nearest roots, or `near` (G, K)) of what is selected."""
    if near is None:
        near = neighbours(guides.points[:, 0])
    added = guides.selected.copy()
    added[near[guides.selected].ravel()] = True
    return select(guides, added)


def select_less(guides: Guides, near: NDArray[np.int64] | None = None) -> Guides:
    """Take away those with an unselected neighbour."""
    if near is None:
        near = neighbours(guides.points[:, 0])
    return select(guides, guides.selected & guides.selected[near].all(axis=1))


def select_islands(guides: Guides, mesh: Mesh) -> Guides:
    """Select everything on those connected pieces of the mesh where something is selected."""
    if not guides.selected.any():
        return guides
    piece = pieces(mesh)
    of_root = piece[root_vertices(mesh, guides.roots)[:, 0]]
    return select(guides, np.isin(of_root, of_root[guides.selected]))


def pieces(mesh: Mesh) -> NDArray[np.int32]:
    """The connected piece of the mesh each vertex belongs to, (V,) int32, numbered from 0."""
    starts = mesh.starts
    after = np.arange(1, len(mesh.corners) + 1)
    after[starts + mesh.counts - 1] = starts  # the next corner around each face
    edges = coo_array(
        (np.ones(len(mesh.corners), np.int8), (mesh.corners, mesh.corners[after])),
        shape=(len(mesh.points), len(mesh.points)),
    )
    return np.asarray(connected_components(edges.tocsr(), directed=False)[1], np.int32)
