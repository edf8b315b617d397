"""Guides as rows: taking some, joining two bundles, putting new values into some rows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.groom.guides import Guides
from core.mesh.roots import Roots
from core.record import freeze


def take_rows(guides: Guides, rows: NDArray[np.bool_] | NDArray[np.int64]) -> Guides:
    """The guides of the given rows (mask or indices) in that order; `next_id` is kept."""
    return Guides(
        ids=guides.ids[rows], roots=guides.roots.take(rows), points=guides.points[rows], hold=guides.hold[rows],
        selected=guides.selected[rows], frozen=guides.frozen[rows], next_id=guides.next_id,
    )


def append_guides(
    guides: Guides, roots: Roots, points: NDArray[np.float32], hold: NDArray[np.float32] | None = None
) -> Guides:
    """These guides followed by new ones, free and unselected, with the next ids."""
    count = len(roots.faces)
    if count == 0:
        return guides
    new_ids = np.arange(guides.next_id, guides.next_id + count, dtype=np.int32)
    if hold is None:
        hold = np.zeros(points.shape[:2], np.float32)
    off = np.zeros(count, np.bool_)
    if len(guides) == 0:
        return Guides(ids=new_ids, roots=roots, points=points, hold=hold, selected=off, frozen=off,
                      next_id=guides.next_id + count)
    return Guides(
        ids=np.concatenate([guides.ids, new_ids]), roots=guides.roots.join(roots),
        points=np.concatenate([guides.points, points]), hold=np.concatenate([guides.hold, hold]),
        selected=np.concatenate([guides.selected, off]), frozen=np.concatenate([guides.frozen, off]),
        next_id=guides.next_id + count,
    )


def with_points(guides: Guides, rows: NDArray[np.bool_] | NDArray[np.int64], points: NDArray[np.float32]) -> Guides:
    """The guides with `points` (R, P, 3) in the given rows, roots to the bit as they were; all else is shared."""
    if len(points) == 0:
        return guides
    out = guides.points.copy()
    out[rows, 1:] = points[:, 1:]
    return guides.replace(points=freeze(out))


def no_guides(point_count: int = 16) -> Guides:
    """An empty bundle whose guides will have `point_count` points."""
    return Guides(
        ids=np.zeros(0, np.int32),
        roots=Roots(faces=np.zeros(0, np.int32), corners=np.zeros((0, 3), np.int32),
                    weights=np.zeros((0, 3), np.float32), uvs=np.zeros((0, 2), np.float32),
                    frames=np.zeros((0, 3, 3), np.float32)),
        points=np.zeros((0, point_count, 3), np.float32), hold=np.zeros((0, point_count), np.float32),
        selected=np.zeros(0, np.bool_), frozen=np.zeros(0, np.bool_), next_id=0,
    )
