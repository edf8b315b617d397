"""The hairs that a few evaluated ones stand for: those around them move too, though nobody has moved them yet."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from core.camera import Camera
from viewport.near_side import roots_of, shown_rows
from viewport.scene import Coat

NEAREST = 3  # of the sparse hairs around one, the farthest of which says how far apart they are
REACH = 1.3  # of that distance


class Neighbours:
    """Finds the hairs of a coat, on its near side, around hairs of a sparse part of it.

    drawn : of :func:`viewport.near_side.sparse_coat`. Roots are looked at once; they stay where they are in a stroke.
    """

    def __init__(self, coat: Coat, drawn: Coat, camera: Camera) -> None:
        assert drawn.order is not None
        rows = shown_rows(coat, camera, near_only=True)
        self.rows: NDArray[np.integer] = np.zeros(0, np.int32) if rows is None else rows
        self.roots = np.ascontiguousarray(roots_of(coat.points)[self.rows])
        self.spacing = np.zeros(len(coat.points), np.float32)
        if NEAREST < len(drawn.order) < len(self.rows):
            roots = roots_of(coat.points)[drawn.order]
            self.spacing[drawn.order] = cKDTree(roots).query(roots, k=NEAREST + 1)[0][:, NEAREST]
        self.coat_roots = roots_of(coat.points)

    def around(self, rows: NDArray[np.integer]) -> NDArray[np.integer]:
        """Rows of all hairs around those of the sparse part among `rows`."""
        rows = rows[self.spacing[rows] > 0.0]
        if len(rows) == 0:
            return rows
        centres, reach = self.coat_roots[rows], REACH * float(self.spacing[rows].max())
        low, high = centres.min(axis=0) - reach, centres.max(axis=0) + reach
        inside = np.flatnonzero(((self.roots >= low) & (self.roots <= high)).all(axis=1))
        away, nearest = cKDTree(centres).query(self.roots[inside], distance_upper_bound=reach)
        found = np.isfinite(away)
        inside, away, nearest = inside[found], away[found], nearest[found]
        return self.rows[inside[away <= REACH * self.spacing[rows[nearest]]]]
