"""Straighten: strands stretch out along the line from root to tip; lengths and roots stay."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.groom.collide import push_out
from core.groom.guides import Guides
from core.groom.region import editable, segment_freedom
from core.groom.rows import with_points
from core.mesh.distance_field import DistanceField


def straighten(
    guides: Guides, amount: float = 1.0, weights: NDArray[np.float64] | None = None, field: DistanceField | None = None
) -> Guides:
    """Turn the segments of strands towards the line from where they may move to their tip.

    Parameters
    ----------
    amount : 0 leaves strands as they are, 1 makes them straight.
    weights : (G,) 0 .. 1, times the amount; everything when None.
    field : signed distance to the skin, to keep out of it; None ignores it.
    """
    share = np.full(len(guides), min(max(amount, 0.0), 1.0))
    if weights is not None:
        share *= np.clip(np.asarray(weights, np.float64), 0.0, 1.0)
    freedom = segment_freedom(guides.hold)
    rows = np.flatnonzero(editable(guides) & (share > 0.0) & (freedom[:, -1] > 0.0))
    if len(rows) == 0:
        return guides
    x = guides.points[rows].astype(np.float64)
    steps = np.diff(x, axis=1)
    size = np.linalg.norm(steps, axis=2, keepdims=True)
    directions = np.where(size > 0.0, steps / np.where(size > 0.0, size, 1.0), 0.0)
    first = np.argmax(freedom[rows] > 0.0, axis=1)  # freedom grows from root to tip: below this one all is locked
    line = x[:, -1] - x[np.arange(len(rows)), first]
    line_size = np.linalg.norm(line, axis=1, keepdims=True)
    # a closed loop has no line; it goes where it leaves the skin
    line = np.where(line_size > 1e-9, line / np.maximum(line_size, 1e-9), guides.roots.frames[rows, 2])
    part = (share[rows, None] * freedom[rows])[:, :, None]
    turned = (1.0 - part) * directions + part * line[:, None]
    turned_size = np.linalg.norm(turned, axis=2, keepdims=True)
    turned = np.where(turned_size > 1e-6, turned / np.maximum(turned_size, 1e-6), directions)
    moved = (np.arange(steps.shape[1]) >= first[:, None])[:, :, None]
    out = x.copy()
    out[:, 1:] = np.where(moved, x[:, :1] + np.cumsum(np.where(moved, turned * size, steps), axis=1), x[:, 1:])
    done = with_points(guides, rows, out.astype(np.float32))
    if field is None:
        return done
    mask = np.zeros(len(guides), np.bool_)
    mask[rows] = True
    return push_out(done, field, mask=mask)
