"""Guides on the pose shown, and edits made there carried back to rest."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.groom.guides import Guides
from core.mesh.skin import Skin
from core.mesh.surface import rest_from_posed, root_frames, strands_on_deformed
from core.record import freeze
from core.rows import changed_rows
from tools.respect import rows_of


def in_pose(guides: Guides, skin: Skin) -> Guides:
    """Guides on the skin of a pose, their frames with them, so that kernels see which way the skin faces there."""
    points = strands_on_deformed(skin.mesh, guides.roots, guides.points, skin.points, skin.normals)
    frames = root_frames(skin.mesh, guides.roots, skin.points, skin.normals)
    return guides.replace(points=freeze(points), roots=guides.roots.replace(frames=freeze(frames)))


def back_to_rest(guides: Guides, shown: Guides, before: Guides, skin: Skin) -> Guides:
    """Guides edited on a pose as they stand at rest.

    Those that were not touched keep their bits, all of them their roots.

    Parameters
    ----------
    guides : edited. shown : as they were in the pose before the edit. before : as they were at rest.
    skin : of the pose.
    """
    if guides.roots is shown.roots and guides.points is shown.points:
        return guides.replace(points=before.points, roots=before.roots)
    if len(guides) == 0:
        return guides.replace(roots=before.roots.take(np.zeros(0, np.intp)))
    there, row = rows_of(before.ids, guides.ids)
    if not there.all():
        raise ValueError("a tool that plants works at rest: set at_rest")
    whole = guides.ids is before.ids
    roots = before.roots if whole else before.roots.take(row)
    same_count = guides.points.shape[1] == shown.points.shape[1]
    moved: NDArray[Any]
    if same_count:
        points = before.points.copy() if whole else before.points[row]
        moved = changed_rows(shown.points if whole else shown.points[row], guides.points)
    else:
        points = np.empty(guides.points.shape, np.float32)
        moved = np.arange(len(guides))
    points[moved] = rest_from_posed(skin.mesh, roots.take(moved), guides.points[moved], skin.points, skin.normals)
    points[:, 0] = before.points[row, 0]
    return guides.replace(points=freeze(points), roots=roots)
