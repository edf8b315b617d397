"""Wash: takes hairspray out of the hair under the ring."""

from __future__ import annotations

from core.groom.guides import Guides
from core.groom.hairspray import wash
from tools.brush import BrushStroke, on_rows
from tools.groom.craft import GroomGround, nothing_to_do
from tools.ground import Pointer
from tools.ring import BrushParams
from tools.tool import Stroke, Tool, Turn

PASS = 2.0  # hold that a way of one radius takes away at strength 1


class WashParams(BrushParams):
    """Settings of Wash."""


class Wash(Tool[WashParams]):
    """Frees hair."""

    name = "wash"
    label = "Wash"
    icon = "wash"
    order = 51
    tooltip = "Washes hairspray out of the hair under the ring, so that tools move it again."
    hint = "Drag: wash   Ctrl: spray"
    step = "Wash"
    edits = "hold"
    with_ctrl = Turn("hairspray")
    Params = WashParams

    def begin(self, ground: GroomGround, pointer: Pointer) -> Stroke[Guides]:
        """A stroke that washes."""
        if len(ground.guides) == 0:
            raise nothing_to_do()
        return WashStroke(self.params, ground)


class WashStroke(BrushStroke[WashParams]):
    """Takes hold away along the way."""

    def brush(self, guides: Guides) -> Guides:
        """Guides washed under the ring."""
        rows, reach = self.under(guides)
        amount = PASS * self.dose
        return on_rows(guides, rows, lambda g: wash(g, amount, reach))
