"""Paint: a number over the skin, brushed where it should be: how dense or long the coat is, or what a value reads."""

from __future__ import annotations

from functools import cached_property
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray

from core.falloff import falloff
from core.field import field
from core.pose.sculpt.mask import blur_mask, paint_mask
from core.pose.sculpt.ring import Ring, ring_at
from core.pose.sculpt.surface import SculptSurface, sculpt_surface
from core.record import freeze
from tools.brush import RingStroke
from tools.groom.craft import GroomGround
from tools.ground import Pointer
from tools.ring import BrushParams
from tools.screen import FLAT
from tools.tool import Stroke, Tool, Turn

PASS = 4.0  # share of the way to the value that a way of one radius goes at strength 1: a pass is all of it
SOFTENED = 2  # times a dab takes the mean of neighbours

Values = NDArray[np.float32]


class PaintMapParams(BrushParams):
    """Settings of Paint."""

    map: Annotated[str | None, field(
        "Map", "The map that is painted; none is the one of the density, made at the first stroke.")] = None
    value: Annotated[float, field(
        "Value", "What is painted: 0 takes all hair or length away, 1 leaves all of it.", "", (0, 1), (0, 1))] = 0.0
    how: Annotated[Literal["paint", "reverse", "soften"], field(
        "Does", "Paints the value, 1 less the value, or takes the mean of what lies around.",
        choices=("paint", "reverse", "soften"))] = "paint"


class PaintMap(Tool[PaintMapParams]):
    """Paints maps."""

    name = "paint_map"
    label = "Paint map"
    icon = "map"
    order = 75
    tooltip = "Paints a map on the skin: where the coat is dense or bare, long or short, clumped or loose."
    hint = "Drag: paint the value   Ctrl or eraser: its reverse   Shift: soften"
    step = "Paint map"
    edits = "map"
    with_shift = Turn("paint_map", {"how": "soften"})
    with_ctrl = Turn("paint_map", {"how": "reverse"})
    with_eraser = Turn("paint_map", {"how": "reverse"})
    Params = PaintMapParams

    def begin(self, ground: GroomGround, pointer: Pointer) -> Stroke[Values]:
        """A stroke that paints."""
        return PaintStroke(self.params, ground)


class PaintStroke(RingStroke[PaintMapParams, GroomGround, Values]):
    """Dabs along the way, each over the skin joined to where it falls."""

    def brush(self, values: Values) -> Values:
        """Values (V,) after the piece of the way."""
        p, ground = self.params, self.ground
        surface = ground.evaluator.get(sculpt_surface, ground.item.mesh)
        goal = 1.0 - p.value if p.how == "reverse" else p.value
        dabs = self.dabs()
        share = min(PASS * self.dose / len(dabs), 1.0)
        for dab in dabs:
            ring = self._ring(surface, dab)
            if ring is None:
                continue
            if p.how == "soften":
                values = blur_mask(surface, values, ring, share, SOFTENED)
            elif len(ring.sites):
                values = paint_mask(surface, values, ring, goal, share)
        return freeze(values)

    def _ring(self, surface: SculptSurface, dab: Pointer) -> Ring | None:
        """What a dab touches: the skin joined to where it falls, or all that the ring covers on the screen."""
        p, ground = self.params, self.ground
        if p.through:
            away = np.linalg.norm(self._pixels - (dab.x, dab.y), axis=1) / max(self.radius, 1e-9)
            weights = falloff(away, p.falloff, FLAT)
            sites = np.flatnonzero((weights > 0.0) & (surface.site == np.arange(len(weights)))).astype(np.int32)
            return Ring(sites, weights[sites].astype(np.float64), np.zeros(3), self.radius)
        hit = ground.hit(dab)
        if hit is None:
            return None
        metres = self.radius / ground.pixels_per_metre(hit.point)
        return ring_at(surface, ground.skin.points, hit.point, metres, p.falloff)

    @cached_property
    def _pixels(self) -> NDArray[np.float64]:
        """Where the vertices (V, 2) are on the screen, infinitely far away behind the eye."""
        pixels, depth = self.ground.view.pixels(self.ground.skin.points)
        return np.where(depth[:, None] > 0.0, pixels, np.inf)
