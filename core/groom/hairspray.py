"""Hairspray: strands hold their shape, 0 free to 1 locked, along all of their length or a part; wash removes it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.groom.guides import Guides
from core.groom.region import editable
from core.groom.resample import arc_fractions
from core.record import freeze


def spray(
    guides: Guides, amount: float = 1.0, weights: NDArray[np.float64] | None = None, start: float = 0.0,
    end: float = 1.0,
) -> Guides:
    """Add `amount` of hold where a brush reaches.

    Parameters
    ----------
    amount : 0 .. 1, added at weight 1.
    weights : (G,) or (G, P) 0 .. 1; everything when None.
    start, end : part of each strand's length that is sprayed, 0 root .. 1 tip.

    Notes
    -----
    Points from `start` to `end` get it, both included. How kernels honour it: core/groom/region.py.
    """
    return _change(guides, abs(amount), weights, start, end)


def wash(
    guides: Guides, amount: float = 1.0, weights: NDArray[np.float64] | None = None, start: float = 0.0,
    end: float = 1.0,
) -> Guides:
    """Take `amount` of hold away where a brush reaches (see :func:`spray`)."""
    return _change(guides, -abs(amount), weights, start, end)


def _change(
    guides: Guides, amount: float, weights: NDArray[np.float64] | None, start: float, end: float
) -> Guides:
    t = arc_fractions(guides.points)
    share = ((t >= start - 1e-6) & (t <= end + 1e-6)).astype(np.float64)
    if weights is not None:
        w = np.clip(np.asarray(weights, np.float64), 0.0, 1.0)
        share *= w if w.ndim == 2 else w[:, None]
    share[~editable(guides)] = 0.0
    hold = np.where(share > 0.0, np.clip(guides.hold + amount * share, 0.0, 1.0), guides.hold).astype(np.float32)
    if np.array_equal(hold, guides.hold):
        return guides
    return guides.replace(hold=freeze(hold))
