"""What edits heed: hairspray and selection come off before an edit that is not to heed them, and go back on after."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from core.groom.guides import Guides
from core.workspace import Respect

# what an edit changes; of the other things it is spared what is not respected
Edits = Literal["shape", "hold", "selection", "map", "nothing"]


def respected(guides: Guides, respect: Respect, edits: Edits) -> Guides:
    """Guides with hold and selection taken off where they are not to be heeded (nor edited)."""
    if _hold_off(guides, respect, edits):
        guides = guides.replace(hold=np.zeros_like(guides.hold))
    if _selection_off(guides, respect, edits):
        guides = guides.replace(selected=np.zeros_like(guides.selected))
    return guides


def restored(before: Guides, guides: Guides, respect: Respect, edits: Edits) -> Guides:
    """Edited guides with what :func:`respected` took off `before` put back on those that are still there."""
    hold, selected = _hold_off(before, respect, edits), _selection_off(before, respect, edits)
    if not (hold or selected):
        return guides
    there, row = rows_of(before.ids, guides.ids)
    changes: dict[str, Any] = {}
    if hold and before.hold.shape[1] == guides.hold.shape[1]:
        changes["hold"] = np.where(there[:, None], before.hold[row], guides.hold)
    if selected:
        thawed = ~guides.frozen | before.frozen[row]  # what was frozen meanwhile is not selected
        changes["selected"] = np.where(there, before.selected[row] & thawed, guides.selected)
    return guides.replace(**changes)


def rows_of(ids: NDArray[np.int32], wanted: NDArray[np.int32]) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
    """Which of the `wanted` ids are among `ids` (at least one), and in which row each stands (any row where not)."""
    if wanted is ids:
        return np.ones(len(ids), np.bool_), np.arange(len(ids))
    order = np.argsort(ids, kind="stable")
    row = order[np.minimum(np.searchsorted(ids, wanted, sorter=order), len(order) - 1)]
    return ids[row] == wanted, row


def _hold_off(guides: Guides, respect: Respect, edits: Edits) -> bool:
    return not respect.hairspray and edits not in ("hold", "selection") and bool(guides.hold.any())


def _selection_off(guides: Guides, respect: Respect, edits: Edits) -> bool:
    return not respect.selection and edits != "selection" and bool(guides.selected.any())
