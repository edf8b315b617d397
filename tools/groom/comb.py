"""Comb: hair follows the ring."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np

from core.falloff import SHAPES, Shape
from core.field import field
from core.groom.comb import comb
from core.groom.guides import Guides
from core.groom.region import facing
from core.overlay import Overlays, Polyline
from tools.brush import BrushStroke
from tools.groom.craft import GroomGround, nothing_to_do
from tools.ground import Pointer
from tools.ring import BrushParams, ring_strength
from tools.tool import Stroke, Tool, Turn

FULL_TILT = math.radians(60.0)  # what pens report at the most
STEEPEST = 1.3  # radians, what the kernel takes


class CombParams(BrushParams):
    """Settings of the comb."""

    falloff: Annotated[Shape, field(
        "Falloff", "How the comb fades from the middle of its ring to the rim.", choices=SHAPES)] = "flat"
    grip: Annotated[float, field(
        "Grip", "How firmly hair follows the ring across its length; low lets it slip through.", "", (0, 1), (0, 1))
    ] = 0.85
    lay: Annotated[float, field(
        "Lay down", "How fast hair turns to lie along the stroke; 0 only bends it and keeps curls.", "", (0, 2), (0, 2))
    ] = 1.0
    tip_first: Annotated[float, field(
        "Tip first", "At 0 the whole length is combed, at 1 mostly the tips.", "", (0, 1), (0, 1))] = 0.2
    lift: Annotated[float, field(
        "Lift off skin", "Angle at which combed hair stands off the skin, in degrees.", "rad", (0, 0.8), (0, 1.3))
    ] = 0.08
    tilt_lift: Annotated[float, field(
        "Pen tilt lifts", "Angle that a pen laid flat adds to the lift; 0 ignores how you hold the pen.", "rad",
        (0, 0.8), (0, 1.3))] = 0.0


class Comb(Tool[CombParams]):
    """The comb."""

    name = "comb"
    label = "Comb"
    icon = "comb"
    order = 30
    tooltip = "Combs hair along the stroke: it follows the ring sideways, slips along its length and lies down."
    hint = "Drag: comb   Shift: smooth   Ctrl: length   Eraser: smooth"
    step = "Comb"
    with_shift = Turn("smooth")
    with_ctrl = Turn("length")
    with_eraser = Turn("smooth")
    Params = CombParams

    def begin(self, ground: GroomGround, pointer: Pointer) -> Stroke[Guides]:
        """A stroke of the comb."""
        if len(ground.guides) == 0:
            raise nothing_to_do()
        return CombStroke(self.params, ground)


class CombStroke(BrushStroke[CombParams]):
    """Combs along the way since the last batch."""

    def __init__(self, params: CombParams, ground: GroomGround) -> None:
        super().__init__(params, ground)
        # the side that is seen is settled at press: hair must not drop out of a stroke as it turns
        self.mask = None if params.through else facing(ground.guides, ground.view)

    def brush(self, guides: Guides) -> Guides:
        """Guides combed along the way."""
        p, last = self.params, self.last
        assert last is not None
        tilt = min(math.hypot(last.tilt_x, last.tilt_y) / FULL_TILT, 1.0)
        return comb(
            guides, self.ground.view, self.way, self.radius, field=self.ground.field, strength=ring_strength(p, last),
            grip=p.grip, lay=p.lay, shape=p.falloff, tip_first=p.tip_first,
            lift=min(p.lift + tilt * p.tilt_lift, STEEPEST), mask=self.mask,
            ranges=self.ground.evaluator.workers.ranges,
        )

    def overlays(self) -> Overlays:
        """The direction of pull."""
        if len(self.way) < 2:
            return ()
        pull = self.way[-1] - self.way[0]
        size = float(np.linalg.norm(pull))
        if size < 1e-6:
            return ()
        return (Polyline(np.stack([self.way[-1], self.way[-1] + pull / size * self.radius]), "accent", 2.0),)
