"""Lasso: hair inside a drawn outline."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np

from core.field import field
from core.groom.guides import Guides
from core.groom.region import facing
from core.groom.select import select_in_lasso
from core.overlay import Overlays, Polyline
from core.record import Record
from tools.groom.craft import GroomGround, nothing_to_do
from tools.ground import Pointer
from tools.tool import Stroke, Tool, Turn


class LassoParams(Record):
    """Settings of the lasso."""

    mode: Annotated[Literal["replace", "add", "remove"], field(
        "Does", "The outline selects anew, adds to what is selected, or takes away from it.",
        choices=("replace", "add", "remove"))] = "replace"
    roots_only: Annotated[bool, field(
        "Roots only", "Takes only hair that grows inside the outline, not what hangs into it.")] = False
    through: Annotated[bool, field(
        "Far side too", "Takes hair on the far side of the animal as well as what you see.")] = False


class Lasso(Tool[LassoParams]):
    """An outline that selects."""

    name = "lasso"
    label = "Lasso"
    icon = "lasso"
    order = 61
    tooltip = "Selects all hair inside an outline that you draw around it, at release."
    hint = "Drag: outline   Shift: add   Ctrl: remove   Eraser: remove"
    step = "Lasso"
    edits = "selection"
    with_shift = Turn("lasso", {"mode": "add"})
    with_ctrl = Turn("lasso", {"mode": "remove"})
    with_eraser = Turn("lasso", {"mode": "remove"})
    Params = LassoParams

    def begin(self, ground: GroomGround, pointer: Pointer) -> Stroke[Guides]:
        """An outline."""
        if len(ground.guides) == 0:
            raise nothing_to_do()
        return LassoStroke(self.params, ground)


class LassoStroke:
    """Draws the outline and selects at release."""

    def __init__(self, params: LassoParams, ground: GroomGround) -> None:
        self.params, self.ground = params, ground
        self.outline: list[tuple[float, float]] = []

    def extend(self, guides: Guides, pointers: tuple[Pointer, ...]) -> Guides:
        """The outline goes on."""
        self.outline += [(p.x, p.y) for p in pointers]
        return guides

    def finish(self, guides: Guides) -> Guides:
        """Guides selected by the outline; a click around nothing selects nothing."""
        mode = self.params.mode
        if mode == "replace" and self.ground.mirrored:
            mode = "add"
        mask = None if self.params.through else facing(guides, self.ground.view)
        return select_in_lasso(guides, self.ground.view, self.outline, mode, mask, self.params.roots_only)

    def overlays(self) -> Overlays:
        """The outline so far."""
        if len(self.outline) < 2:
            return ()
        return (Polyline(np.array(self.outline), "selected", 1.5, closed=True, dashed=True),)
