"""Mask: protects parts of the surface from every sculpt brush."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray

from core.field import field
from core.pose.sculpt.mask import blur_mask, paint_mask
from core.pose.sculpt.ring import Ring
from core.record import freeze
from tools.ground import Pointer
from tools.pose.brushes import SculptParams, SculptStroke
from tools.pose.craft import PoseGround
from tools.tool import Stroke, Tool, Turn


class MaskParams(SculptParams):
    """Settings of Mask."""

    how: Annotated[Literal["protect", "free", "soften"], field(
        "Way", "Protect paints the mask, free takes it away, soften blurs its border.",
        choices=("protect", "free", "soften"))] = "protect"


class Mask(Tool[MaskParams]):
    """Paints the mask."""

    name = "mask"
    label = "Mask"
    icon = "mask"
    order = 130
    tooltip = "Protects the surface under the ring from every sculpt brush; Ctrl frees it again."
    hint = "Drag: protect   Ctrl: free   Shift: soften"
    step = "Mask"
    craft = "pose"
    edits = "mask"
    with_ctrl = Turn("mask", {"how": "free"})
    with_shift = Turn("mask", {"how": "soften"})
    with_eraser = Turn("mask", {"how": "free"})
    Params = MaskParams

    def begin(self, ground: PoseGround, pointer: Pointer) -> Stroke[NDArray[np.float32]]:
        """A stroke of dabs on the mask."""
        how, surface = self.params.how, ground.surface

        def dab(mask: NDArray[np.float32], ring: Ring, dose: float) -> NDArray[np.float32]:
            strength = min(4.0 * dose, 1.0)
            if how == "soften":
                return freeze(blur_mask(surface, mask, ring, strength, 2))
            return freeze(paint_mask(surface, mask, ring, float(how == "protect"), strength))

        return SculptStroke(self.params, ground, dab, masked=False)
