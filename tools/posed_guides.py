"""Guides on the pose shown, and edits made there carried back to rest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.groom.guides import Guides
from core.mesh.roots import Roots
from core.mesh.skin import Skin
from core.mesh.surface import (
    Carried,
    Ranges,
    rest_from_posed,
    rest_from_posed_again,
    root_frames,
    strands_on_deformed,
)
from core.record import freeze
from core.rows import changed_rows
from core.workers import serial_ranges
from tools.respect import rows_of


def in_pose(guides: Guides, skin: Skin) -> Guides:
    """Guides on the skin of a pose, their frames with them, so that kernels see which way the skin faces there."""
    points = strands_on_deformed(skin.mesh, guides.roots, guides.points, skin.points, skin.normals)
    frames = root_frames(skin.mesh, guides.roots, skin.points, skin.normals)
    return guides.replace(points=freeze(points), roots=guides.roots.replace(frames=freeze(frames)))


class BackToRest:
    """The way back of one stroke: guides edited on a pose as they stand at rest.

    Those that were not touched keep their bits, all of them their roots. What was carried for one preview is not
    carried again for the next.

    Parameters
    ----------
    shown : as they were in the pose before the edit. before : as they were at rest. skin : of the pose.
    ranges : threads.
    """

    def __init__(self, shown: Guides, before: Guides, skin: Skin, ranges: Ranges = serial_ranges) -> None:
        self.shown, self.before, self.skin, self._ranges = shown, before, skin, ranges
        self._start = self._last = Carried(shown.points, before.points)

    def __call__(self, guides: Guides) -> Guides:
        """Edited guides of the pose at rest."""
        if guides.roots is self.shown.roots and guides.points.shape == self.shown.points.shape:
            return guides.replace(points=self._carried(guides), roots=self.before.roots)
        return self._rearranged(guides)

    def _carried(self, guides: Guides) -> NDArray[np.float32]:
        if guides.points is self.shown.points:
            return self.before.points
        rest = rest_from_posed_again(
            guides.points, self._last, self._start, self.shown.roots.frames, self.before.roots.frames, self._ranges
        )
        self._last = Carried(guides.points, freeze(rest))
        return rest

    def _rearranged(self, guides: Guides) -> Guides:
        """Where guides went, or have another number of points."""
        before, shown = self.before, self.shown
        if len(guides) == 0:
            return guides.replace(roots=before.roots.take(np.zeros(0, np.intp)))
        there, row = rows_of(before.ids, guides.ids)
        if not there.all():
            raise ValueError("a tool that plants works at rest: set at_rest")
        roots, moved = before.roots.take(row), np.arange(len(guides), dtype=np.int32)
        points = np.empty(guides.points.shape, np.float32)
        if guides.points.shape[1] == shown.points.shape[1]:
            points[:] = before.points[row]
            moved = changed_rows(shown.points[row], guides.points)
        points[moved] = self._back(roots.take(moved), guides.points[moved])
        points[:, 0] = before.points[row, 0]
        return guides.replace(points=freeze(points), roots=roots)

    def _back(self, roots: Roots, points: NDArray[np.float32]) -> NDArray[np.float32]:
        return rest_from_posed(self.skin.mesh, roots, points, self.skin.points, self.skin.normals)
