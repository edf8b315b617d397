"""Select: hair under the ring."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np

from core.field import field
from core.groom.guides import Guides
from core.groom.select import select
from tools.brush import BrushStroke
from tools.groom.craft import GroomGround, nothing_to_do
from tools.ground import Pointer
from tools.ring import ReachParams
from tools.tool import Stroke, Tool, Turn


class SelectParams(ReachParams):
    """Settings of Select."""

    mode: Annotated[Literal["replace", "add", "remove"], field(
        "Does", "A stroke selects anew, adds to what is selected, or takes away from it.",
        choices=("replace", "add", "remove"))] = "replace"
    roots_only: Annotated[bool, field(
        "Roots only", "Takes only hair that grows under the ring, not what hangs into it.")] = False


class Select(Tool[SelectParams]):
    """A brush that selects."""

    name = "select"
    label = "Select"
    icon = "select"
    order = 60
    tooltip = "Selects hair under the ring; while any is selected, tools edit only that."
    hint = "Drag: select   Shift: add   Ctrl: remove   Eraser: remove"
    step = "Select"
    edits = "selection"
    with_shift = Turn("select", {"mode": "add"})
    with_ctrl = Turn("select", {"mode": "remove"})
    with_eraser = Turn("select", {"mode": "remove"})
    Params = SelectParams

    def begin(self, ground: GroomGround, pointer: Pointer) -> Stroke[Guides]:
        """A stroke that selects."""
        if len(ground.guides) == 0:
            raise nothing_to_do()
        return SelectStroke(self.params, ground)


class SelectStroke(BrushStroke[SelectParams]):
    """Selects along the way. The press clears what was selected before, once for both sides of symmetry."""

    def brush(self, guides: Guides) -> Guides:
        """Guides with those under the ring selected."""
        rows, _ = self.under(guides, only_editable=False, roots_only=self.params.roots_only)
        mask = np.zeros(len(guides), np.bool_)
        mask[rows] = True
        if self.params.mode == "remove":
            return select(guides, mask, "remove")
        clears = self.params.mode == "replace" and len(self.way) == 1 and not self.ground.mirrored
        return select(guides, mask, "replace" if clears else "add")
