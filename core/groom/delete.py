"""Delete guides. Frozen, held and (where any are selected) unselected ones stay."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.groom.guides import Guides
from core.groom.region import editable, strand_freedom
from core.groom.rows import take_rows


def removable(guides: Guides) -> NDArray[np.bool_]:
    """(G,) bool: editable and nowhere locked by hairspray."""
    return editable(guides) & (strand_freedom(guides.hold) > 0.0)


def delete(guides: Guides, mask: NDArray[np.bool_] | None = None) -> Guides:
    """Guides without those of `mask` (G,) that may go: the selected ones, or all where none is selected, when None.

    Ids of the others stay and those of the deleted ones are never given again.
    """
    gone = removable(guides) if mask is None else removable(guides) & np.asarray(mask, np.bool_)
    return take_rows(guides, ~gone) if gone.any() else guides
