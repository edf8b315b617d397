"""Cut: scissors for the ring, or along a drawn line."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray

from core.field import field
from core.groom.guides import Guides
from core.groom.length import cut_at_line, cut_with_ring, lengths
from core.groom.region import editable
from core.overlay import Overlays, Polyline
from tools.brush import BrushStroke, on_rows
from tools.groom.craft import GroomGround, nothing_to_do
from tools.ground import Pointer
from tools.ring import ReachParams, ring_overlays
from tools.tool import Stroke, Tool, Turn

SHORTEST = 1e-4  # of the animal's diagonal


class CutParams(ReachParams):
    """Settings of Cut."""

    size: Annotated[float, field(
        "Size", "Radius of the ring, in pixels of the screen or along the skin.", "px", (4, 300), (1, 4000))] = 20.0
    how: Annotated[Literal["ring", "line"], field(
        "Cuts with", "The ring cuts hair where it first touches it; a line cuts at release, where it crosses.",
        choices=("ring", "line"))] = "ring"
    stub: Annotated[float, field(
        "Stub", "The share of its length a hair keeps, however near its root the cut goes; 0 shaves.",
        soft=(0.0, 1.0), hard=(0.0, 1.0))] = 0.25


class Cut(Tool[CutParams]):
    """Scissors."""

    name = "cut"
    label = "Cut"
    icon = "cut"
    order = 41
    tooltip = "Cuts off what lies beyond the place where the ring, or a line you draw, meets a hair."
    hint = "Drag: cut   Ctrl: along a line"
    step = "Cut"
    with_ctrl = Turn("cut", {"how": "line"})
    Params = CutParams

    def begin(self, ground: GroomGround, pointer: Pointer) -> Stroke[Guides]:
        """A stroke of the scissors."""
        if len(ground.guides) == 0:
            raise nothing_to_do()
        return RingCut(self.params, ground) if self.params.how == "ring" else LineCut(self.params, ground)

    def hover(self, ground: GroomGround, pointer: Pointer) -> Overlays:
        """The ring; nothing for a line."""
        return ring_overlays(self.params, ground, pointer) if self.params.how == "ring" else ()


def stubs_of(ground: GroomGround, params: CutParams) -> NDArray[np.float64]:
    """Metres (G,) that stay of each guide, by its length at press: going over it again in a stroke cuts no more."""
    return np.maximum(params.stub * lengths(ground.guides.points), SHORTEST * ground.rest.diagonal)


class RingCut(BrushStroke[CutParams]):
    """Cuts while it goes."""

    def brush(self, guides: Guides) -> Guides:
        """Guides cut where the ring met them."""
        self.screen.follow(guides)
        rows = self.screen.near(self.way, self.radius, self.params.through)
        rows = rows[editable(guides)[rows]]
        view, stubs = self.ground.view, stubs_of(self.ground, self.params)[rows]
        return on_rows(guides, rows, lambda g: cut_with_ring(g, view, self.way, self.radius, None, stubs))


class LineCut(BrushStroke[CutParams]):
    """Draws a line and cuts at release."""

    def __init__(self, params: CutParams, ground: GroomGround) -> None:
        super().__init__(params, ground)
        self.line: list[tuple[float, float]] = []

    def brush(self, guides: Guides) -> Guides:
        """The line goes on."""
        self.line += [(float(x), float(y)) for x, y in (self.way[1:] if self.line else self.way)]
        return guides

    def finish(self, guides: Guides) -> Guides:
        """Guides cut where they first cross the line."""
        self.screen.follow(guides)
        line = np.array(self.line)
        rows = self.screen.near(line, 1.0, self.params.through)
        rows = rows[editable(guides)[rows]]
        view, stubs = self.ground.view, stubs_of(self.ground, self.params)[rows]
        return on_rows(guides, rows, lambda g: cut_at_line(g, view, line, None, stubs))

    def overlays(self) -> Overlays:
        """The line so far."""
        return (Polyline(np.array(self.line), "accent", 2.0, dashed=True),) if len(self.line) > 1 else ()
