"""Freeze guides against every edit, and thaw them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.groom.guides import Guides
from core.record import freeze as read_only


def freeze(guides: Guides, mask: NDArray[np.bool_] | None = None) -> Guides:
    """Freeze the guides of `mask` (G,); the selected ones when None. Frozen guides are not selected."""
    chosen = guides.selected if mask is None else np.asarray(mask, np.bool_)
    if not (chosen & ~guides.frozen).any():
        return guides
    return guides.replace(frozen=read_only(guides.frozen | chosen), selected=read_only(guides.selected & ~chosen))


def freeze_others(guides: Guides) -> Guides:
    """Freeze all guides but the selected ones."""
    return freeze(guides, ~guides.selected)


def unfreeze(guides: Guides, mask: NDArray[np.bool_] | None = None) -> Guides:
    """Thaw the guides of `mask` (G,); all when None."""
    chosen = np.ones(len(guides), np.bool_) if mask is None else np.asarray(mask, np.bool_)
    if not (chosen & guides.frozen).any():
        return guides
    return guides.replace(frozen=read_only(guides.frozen & ~chosen))
