"""The guides of one groom as lines, remade only where they changed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.groom.children import moved_guides
from core.groom.collision import Collision, strands_inside
from core.groom.guides import Guides
from core.groom.live_coat import LiveCoat
from core.mesh.mesh import Mesh
from core.mesh.skin import Posed
from core.mesh.surface import root_normals, strands_on_deformed
from core.workers import Workers
from viewport.scene import GuideLines

PLAIN, SELECTED, FROZEN, SPRAYED, TROUBLE = range(5)  # states of guides, indices into the colours of GuideLines


class LiveGuides:
    """Lines of one groom that follow it. A guide that runs inside the skin (at rest) is in trouble; which do is
    looked at bit by bit, see :meth:`check`."""

    def __init__(self) -> None:
        self._guides: Guides | None = None
        self._posed: Posed | None = None
        self._points: NDArray[np.float32] = np.zeros((0, 2, 3), np.float32)
        self._normals: NDArray[np.float32] = np.zeros((0, 3), np.float32)
        self._states: NDArray[np.uint8] = np.zeros(0, np.uint8)
        self._inside = np.zeros(0, np.bool_)
        self._unchecked = np.zeros(0, np.bool_)

    @property
    def unchecked(self) -> int:
        """How many guides have not been looked at since they moved."""
        return int(np.count_nonzero(self._unchecked))

    def follow(self, guides: Guides, mesh: Mesh, posed: Posed, live: LiveCoat | None, workers: Workers) -> None:
        """Follow the document.

        live : the hairs, where they hang on these very guides on this skin already: their guides stand posed.
        """
        before, self._guides = self._guides, guides
        if before is not guides:
            self._note_moved(before, guides, workers)
            self._set_states()
        same_pose = self._posed is not None and posed.points is self._posed.points
        same_roots = before is not None and before.roots is guides.roots
        if same_pose and same_roots and before is not None and before.points is guides.points:
            return
        self._posed = posed
        at_rest = posed.points is mesh.points
        hung = live is not None and live.guides is guides
        if not (same_pose and same_roots):
            at = (None, None) if at_rest else posed
            self._normals = live.guide_normals if live is not None and hung else root_normals(mesh, guides.roots, *at)
        if at_rest:
            self._points = guides.points
        elif live is not None and hung and live.guide_points.shape == guides.points.shape:
            self._points = live.guide_points
        else:
            self._points = strands_on_deformed(mesh, guides.roots, guides.points, *posed)

    def check(self, most: int, skin: Collision, workers: Workers) -> bool:
        """Look whether guides that moved run inside the skin at rest, at most so many; True when any state changed."""
        guides = self._guides
        rows = np.flatnonzero(self._unchecked)[:most]
        if guides is None or not len(rows):
            return False
        self._unchecked[rows] = False
        inside = strands_inside(guides.points[rows], skin, workers)
        if np.array_equal(inside, self._inside[rows]):
            return False
        self._inside[rows] = inside
        self._set_states()
        return True

    def lines(self) -> GuideLines:
        """What to draw; arrays are the same objects as long as nothing in them changed."""
        return GuideLines(self._points, self._states, normals=self._normals)

    def _note_moved(self, before: Guides | None, guides: Guides, workers: Workers) -> None:
        if before is not None and before.ids is guides.ids and before.points.shape == guides.points.shape:
            self._unchecked |= moved_guides(before.points, guides.points, workers.ranges)
            return
        inside, self._inside = self._inside, np.zeros(len(guides), np.bool_)
        self._unchecked = np.ones(len(guides), np.bool_)
        if before is not None:
            _, old, new = np.intersect1d(before.ids, guides.ids, return_indices=True)
            self._inside[new] = inside[old]

    def _set_states(self) -> None:
        guides = self._guides
        assert guides is not None
        states = np.zeros(len(guides), np.uint8)
        states[(guides.hold > 0.0).any(axis=1)] = SPRAYED
        states[guides.frozen] = FROZEN
        states[guides.selected] = SELECTED
        states[self._inside] = TROUBLE
        if not np.array_equal(states, self._states):
            self._states = states
