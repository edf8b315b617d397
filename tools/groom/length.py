"""Length: hair under the ring grows, shrinks, or comes to a length."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np

from core.field import field
from core.groom.guides import Guides
from core.groom.length import lengths, set_length
from tools.brush import BrushStroke, on_rows
from tools.groom.craft import GroomGround, nothing_to_do
from tools.ground import Pointer
from tools.ring import BrushParams
from tools.tool import Stroke, Tool, Turn

RATE = 0.25  # at strength 1 hair grows by exp of this on a way of one radius: half as long again in a pass over it
APPROACH = 3.0  # and comes to within exp of minus this of a length
SHORTEST, LONGEST = 1e-4, 1.0  # of the animal's diagonal, when growing and shrinking

How = Literal["grow", "shrink", "set"]


class LengthParams(BrushParams):
    """Settings of Length."""

    how: Annotated[How, field(
        "Does", "Grows or shrinks hair as you drag, or brings it to the length below.",
        choices=("grow", "shrink", "set"))] = "grow"
    length: Annotated[float, field(
        "Length", "What hair is brought to when the brush sets lengths; 0 takes that under the press.", "m", (0, 0.3),
        (0, 1e4))] = 0.0


class Length(Tool[LengthParams]):
    """Grows and shrinks."""

    name = "length"
    label = "Length"
    icon = "length"
    order = 40
    tooltip = "Grows hair as you drag over it and shrinks it with Ctrl, or sets it to one length."
    hint = "Drag: grow   Ctrl: shrink   Shift: smooth   Eraser: shrink"
    step = "Length"
    with_shift = Turn("smooth")
    with_ctrl = Turn("length", {"how": "shrink"})
    with_eraser = Turn("length", {"how": "shrink"})
    Params = LengthParams

    def begin(self, ground: GroomGround, pointer: Pointer) -> Stroke[Guides]:
        """A stroke that grows, shrinks or sets."""
        if len(ground.guides) == 0:
            raise nothing_to_do()
        return LengthStroke(self.params, ground)


class LengthStroke(BrushStroke[LengthParams]):
    """Changes lengths by a share of what they are, the same however the way is cut into batches."""

    wanted: float = 0.0

    def brush(self, guides: Guides) -> Guides:
        """Guides grown or shrunk along the way."""
        rows, reach = self.under(guides)
        if len(rows) == 0:
            return guides
        amount = self.dose * reach.max(axis=1)
        p, shortest = self.params, SHORTEST * self.ground.rest.diagonal
        if p.how == "set":
            if self.wanted == 0.0:
                self.wanted = p.length or float(np.average(lengths(guides.points[rows]), weights=reach.max(axis=1)))
            wanted = max(self.wanted, shortest)
            return on_rows(guides, rows, lambda g: set_length(g, wanted, 1.0 - np.exp(-APPROACH * amount), shortest))
        factor = np.exp((RATE if p.how == "grow" else -RATE) * amount)
        longest = LONGEST * self.ground.rest.diagonal

        def scaled(some: Guides) -> Guides:
            now = lengths(some.points)
            # what is longer already is left as long as it is
            return set_length(some, np.minimum(now * factor, np.maximum(longest, now)), None, shortest)

        return on_rows(guides, rows, scaled)
