"""Where strands are on the screen: projected once, then again only where they changed."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from core.falloff import Shape, falloff
from core.groom.guides import Guides
from core.groom.project_strands import project_strands
from core.groom.region import View, distance_to_path, facing
from core.groom.rows import take_rows
from core.rows import changed_rows
from tools.respect import rows_of

FLAT = 0.25  # of the radius, of the falloff "flat"


class Screen:
    """Strands as a view sees them. One belongs to a stroke, which lets it follow its guides.

    ids : (G,) of the strands. pixels : (G, P, 2), far outside where a point lies behind the eye.
    seen : (G,) bool, those that grow on skin which faces the eye.
    """

    def __init__(self, view: View, guides: Guides) -> None:
        self.view = view
        self._put(guides)

    def _put(self, guides: Guides) -> None:
        self.ids, self._points = guides.ids, guides.points
        self.pixels, self.low, self.high = project_strands(guides.points, self.view)
        self.seen = facing(guides, self.view)

    def follow(self, guides: Guides) -> None:
        """Find the strands of `guides` that moved, came or went since."""
        if guides.points is self._points:
            return
        if guides.points.shape[1] != self._points.shape[1] or len(self.ids) == 0:
            self._put(guides)
            return
        new = np.empty(0, np.int64)
        if not np.array_equal(guides.ids, self.ids):
            there, row = rows_of(self.ids, guides.ids)
            self.ids, self._points = guides.ids, self._points[row]
            self.pixels, self.low, self.high = self.pixels[row], self.low[row], self.high[row]
            self.seen = self.seen[row]
            new = np.flatnonzero(~there)
            self.seen[new] = facing(take_rows(guides, new), self.view)
        rows = np.union1d(new, changed_rows(self._points, guides.points))
        self.pixels[rows], self.low[rows], self.high[rows] = project_strands(guides.points[rows], self.view)
        self._points = guides.points

    def near(self, path: NDArray[np.float64], radius: float, through: bool = True) -> NDArray[np.int64]:
        """Rows that may have a point within `radius` pixels of a path (K, 2), by their boxes; all that have are in."""
        low, high = path.min(axis=0) - radius, path.max(axis=0) + radius
        there = (self.low <= high).all(axis=1) & (self.high >= low).all(axis=1)
        return np.flatnonzero(there if through else there & self.seen)

    def reach(
        self, path: NDArray[np.float64], radius: float, shape: Shape = "constant", through: bool = True,
        roots_only: bool = False,
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Rows under a ring of `radius` pixels dragged along a path (K, 2), and weights (R, P) of their points.

        roots_only : only the root of a strand counts; the weights are (R, 1) then.
        """
        rows = self.near(path, radius, through)
        pixels = self.pixels[rows, :1] if roots_only else self.pixels[rows]
        weights = falloff(distance_to_path(pixels, path) / max(radius, 1e-9), shape, FLAT)
        under = (weights > 0.0).any(axis=1)
        return rows[under], weights[under]

    def nearest(self, place: ArrayLike, radius: float) -> int | None:
        """Row of the strand on the near side that passes a place (2,) most closely, within `radius` pixels."""
        at = np.asarray(place, np.float64)
        rows = self.near(at[None], radius, through=False)
        if len(rows) == 0:
            return None
        a, b = self.pixels[rows, :-1], self.pixels[rows, 1:]
        ab = b - a
        t = np.clip(((at - a) * ab).sum(axis=2) / np.maximum((ab * ab).sum(axis=2), 1e-12), 0.0, 1.0)
        distance = np.linalg.norm(a + t[..., None] * ab - at, axis=2).min(axis=1)
        best = int(np.argmin(distance))
        return int(rows[best]) if distance[best] <= radius else None
