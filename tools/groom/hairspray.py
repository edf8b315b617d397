"""Hairspray: hair under the ring holds its shape."""

from __future__ import annotations

from typing import Annotated

from core.field import field
from core.groom.guides import Guides
from core.groom.hairspray import spray
from tools.brush import BrushStroke, on_rows
from tools.groom.craft import GroomGround, nothing_to_do
from tools.ground import Pointer
from tools.ring import BrushParams
from tools.tool import Stroke, Tool, Turn

PASS = 2.0  # hold that a way of one radius adds at strength 1: a pass locks what the inner half of the ring goes over


class HairsprayParams(BrushParams):
    """Settings of Hairspray."""

    start: Annotated[float, field(
        "From", "Where along a hair the spray begins: 0 is the root, 1 the tip.", "", (0, 1), (0, 1))] = 0.0
    end: Annotated[float, field(
        "To", "Where along a hair the spray ends: 0 is the root, 1 the tip.", "", (0, 1), (0, 1))] = 1.0


class Hairspray(Tool[HairsprayParams]):
    """Holds hair."""

    name = "hairspray"
    label = "Hairspray"
    icon = "hairspray"
    order = 50
    tooltip = "Sprays hair so that it holds its shape under every tool, more with every pass."
    hint = "Drag: spray   Ctrl: wash   Eraser: wash"
    step = "Hairspray"
    edits = "hold"
    with_ctrl = Turn("wash")
    with_eraser = Turn("wash")
    Params = HairsprayParams

    def begin(self, ground: GroomGround, pointer: Pointer) -> Stroke[Guides]:
        """A stroke that sprays."""
        if len(ground.guides) == 0:
            raise nothing_to_do()
        return HairsprayStroke(self.params, ground)


class HairsprayStroke(BrushStroke[HairsprayParams]):
    """Adds hold along the way."""

    def brush(self, guides: Guides) -> Guides:
        """Guides sprayed under the ring."""
        rows, reach = self.under(guides)
        p, amount = self.params, PASS * self.dose
        return on_rows(guides, rows, lambda g: spray(g, amount, reach, p.start, p.end))
