"""Comb: hair follows the ring."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from core.field import field
from core.groom.comb import comb
from core.groom.guides import Guides
from core.groom.region import facing
from core.overlay import Overlays, Polyline
from tools.tool import BrushParams, Ground, Pointer, Stroke, Tool, nothing_to_do, ring_radius, ring_strength


class CombParams(BrushParams):
    """Settings of the comb."""

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
    through: Annotated[bool, field(
        "Far side too", "Combs hair on the far side of the animal as well as what you see.")] = False


class Comb(Tool[CombParams]):
    """The comb."""

    name = "comb"
    label = "Comb"
    icon = "comb"
    order = 30
    tooltip = "Combs hair along the stroke: it follows the ring sideways, slips along its length and lies down."
    hint = "Drag: comb   Shift: smooth   Ctrl: length"
    step = "Comb"
    with_shift = "smooth"
    with_ctrl = "length"
    Params = CombParams

    def begin(self, ground: Ground, pointer: Pointer) -> Stroke:
        """A stroke of the comb."""
        if len(ground.guides) == 0:
            raise nothing_to_do()
        return CombStroke(self.params, ground)


class CombStroke:
    """Combs along the way since the last batch."""

    def __init__(self, params: CombParams, ground: Ground) -> None:
        self.params, self.ground = params, ground
        self.last: Pointer | None = None
        self.way: NDArray[np.float64] = np.empty((0, 2))
        # the side that is seen is settled at press: hair must not drop out of a stroke as it turns
        self.mask = None if params.through else facing(ground.guides, ground.view)

    def extend(self, guides: Guides, pointers: tuple[Pointer, ...]) -> Guides:
        """Guides combed along these samples."""
        way = np.array([(p.x, p.y) for p in ((self.last, *pointers) if self.last else pointers) if p is not None])
        self.last, self.way = pointers[-1], way
        p, last = self.params, pointers[-1]
        return comb(
            guides, self.ground.view, way, ring_radius(p, self.ground, last), field=self.ground.field,
            strength=ring_strength(p, last), grip=p.grip, lay=p.lay, tip_first=p.tip_first, lift=p.lift, mask=self.mask,
            ranges=self.ground.evaluator.workers.ranges,
        )

    def finish(self, guides: Guides) -> Guides:
        """Nothing more is done at release."""
        return guides

    def overlays(self) -> Overlays:
        """The direction of pull."""
        if len(self.way) < 2:
            return ()
        pull = self.way[-1] - self.way[0]
        size = float(np.linalg.norm(pull))
        if size < 1e-6:
            return ()
        ring = ring_radius(self.params, self.ground, self.last) if self.last else 0.0
        return (Polyline(np.stack([self.way[-1], self.way[-1] + pull / size * ring]), "accent", 2.0),)
