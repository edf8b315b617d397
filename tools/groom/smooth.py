"""Smooth: bends even out under the ring."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from core.field import field
from core.groom.guides import Guides
from core.groom.region import neighbours
from core.groom.smooth import smooth
from core.mesh.mesh import Mesh
from core.mesh.roots import Roots
from core.mesh.surface import root_positions
from core.record import freeze
from tools.brush import BrushStroke
from tools.groom.craft import GroomGround, nothing_to_do
from tools.ground import Pointer
from tools.ring import BrushParams
from tools.tool import Stroke, Tool, Turn


class SmoothParams(BrushParams):
    """Settings of Smooth."""

    along: Annotated[float, field(
        "Along the hair", "How much bends and curls of a strand even out along its length.", "", (0, 1), (0, 1))] = 0.5
    across: Annotated[float, field(
        "To its neighbours", "How much a strand turns to lie like those around it; 0 keeps locks apart.", "", (0, 1),
        (0, 1))] = 0.3


class Smooth(Tool[SmoothParams]):
    """Evens bends out."""

    name = "smooth"
    label = "Smooth"
    icon = "smooth"
    order = 31
    tooltip = "Evens out bends under the ring, along each hair and towards its neighbours; lengths stay."
    hint = "Drag: smooth   Ctrl: comb"
    step = "Smooth"
    with_ctrl = Turn("comb")
    Params = SmoothParams

    def begin(self, ground: GroomGround, pointer: Pointer) -> Stroke[Guides]:
        """A stroke that smooths."""
        if len(ground.guides) == 0:
            raise nothing_to_do()
        return SmoothStroke(self.params, ground)


class SmoothStroke(BrushStroke[SmoothParams]):
    """Smooths what lies under the ring."""

    def brush(self, guides: Guides) -> Guides:
        """Guides smoothed along the way."""
        rows, reach = self.under(guides)
        if len(rows) == 0:
            return guides
        weights = np.zeros(guides.hold.shape)
        weights[rows] = reach * min(4.0 * self.dose, 1.0)
        p, ground = self.params, self.ground
        near = None
        if p.across > 0.0:
            # the roots stay the same from stroke to stroke, so their neighbours are remembered
            near = ground.evaluator.get(_near, ground.item.mesh, ground.groom.guides.roots)
        return smooth(
            guides, along=p.along, across=p.across, iterations=2, weights=weights, near=near, field=ground.field,
            ranges=ground.evaluator.workers.ranges,
        )


def _near(mesh: Mesh, roots: Roots) -> NDArray[np.int64]:
    return freeze(neighbours(root_positions(mesh, roots)))
