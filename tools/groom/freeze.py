"""Freeze: hair under the ring is safe from every tool."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np

from core.field import field
from core.groom.freeze import freeze, unfreeze
from core.groom.guides import Guides
from tools.brush import BrushStroke
from tools.groom.craft import GroomGround, nothing_to_do
from tools.ground import Pointer
from tools.ring import ReachParams
from tools.tool import Stroke, Tool, Turn


class FreezeParams(ReachParams):
    """Settings of Freeze."""

    how: Annotated[Literal["freeze", "thaw"], field(
        "Does", "Freezes hair under the ring against every edit, or thaws it.", choices=("freeze", "thaw"))] = "freeze"
    roots_only: Annotated[bool, field(
        "Roots only", "Takes only hair that grows under the ring, not what hangs into it.")] = False


class Freeze(Tool[FreezeParams]):
    """Freezes and thaws."""

    name = "freeze"
    label = "Freeze"
    icon = "freeze"
    order = 70
    tooltip = "Freezes hair under the ring so that no tool changes it until it is thawed."
    hint = "Drag: freeze   Ctrl: thaw   Eraser: thaw"
    step = "Freeze"
    edits = "selection"  # what is frozen is no longer selected
    with_ctrl = Turn("freeze", {"how": "thaw"})
    with_eraser = Turn("freeze", {"how": "thaw"})
    Params = FreezeParams

    def begin(self, ground: GroomGround, pointer: Pointer) -> Stroke[Guides]:
        """A stroke that freezes or thaws."""
        if len(ground.guides) == 0:
            raise nothing_to_do()
        return FreezeStroke(self.params, ground)


class FreezeStroke(BrushStroke[FreezeParams]):
    """Freezes along the way."""

    def brush(self, guides: Guides) -> Guides:
        """Guides frozen or thawed under the ring."""
        rows, _ = self.under(guides, only_editable=False, roots_only=self.params.roots_only)
        mask = np.zeros(len(guides), np.bool_)
        mask[rows] = True
        return freeze(guides, mask) if self.params.how == "freeze" else unfreeze(guides, mask)
