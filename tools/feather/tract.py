"""Tract: a band of skin on which feathers of a part of the bird grow, drawn in one stroke."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np

from core.errors import UserError
from core.feather.coat.coat import MOST_FEATHERS, FeatherCoat, Placement
from core.feather.coat.drawn import coat_with_tract, free_tract_name
from core.field import field
from core.overlay import Label, Overlay, Overlays, Polyline
from core.record import Record
from tools.feather.craft import FeatherGround
from tools.feather.way import SkinWay
from tools.ground import Pointer
from tools.tool import Stroke, Tool

Part = Literal["back", "primaries", "secondaries", "tail", "down", "bristle", "body", "tract"]
WIDTH = 0.06  # of the animal's diagonal, where none is given
SAME = 0.25  # of the width: a mirrored band nearer than this is the same band


class TractParams(Record):
    """Settings of Tract."""

    part: Annotated[Part, field(
        "Part", "The part of the bird whose feathers grow in the band; a plain tract wears those of the body.",
        choices=("back", "primaries", "secondaries", "tail", "down", "bristle", "body", "tract"))] = "back"
    width: Annotated[float, field(
        "Width", "Width of the band from edge to edge; 0 takes a sixteenth of the animal.", "m", (0, 0.3), (0, 1e4),
        step=0.005)] = 0.0
    count: Annotated[int, field(
        "Feathers", "How many more feathers are set in the band; 0 sets none, those there wear the part.", "",
        (0, 2000), (0, MOST_FEATHERS))] = 0


class DrawTract:
    """A band that is drawn; it is made at the release, for every feather may change with it."""

    def __init__(self, params: TractParams, ground: FeatherGround, pointer: Pointer) -> None:
        self.params, self.ground = params, ground
        self.width = params.width or WIDTH * ground.rest.diagonal
        pixels = self.width * ground.pixels_per_metre()
        self.way = SkinWay(ground, "accent", float(np.clip(pixels, 2.0, 60.0)))

    def extend(self, matter: FeatherCoat, pointers: tuple[Pointer, ...]) -> FeatherCoat:
        """Nothing is made before the release."""
        self.way.extend(pointers)
        return matter

    def finish(self, matter: FeatherCoat) -> FeatherCoat:
        """The coat with the band, and with what is set in it."""
        from core.feather.coat.place import distance_to_tract  # with kernels, which a window starts without

        line = self.way.line(0.05 * self.width)
        if not len(line):
            if self.ground.mirrored:
                return matter
            raise UserError("Draw the tract over the skin of the animal.")
        new = matter.tracts[len(self.ground.coat.tracts):]  # of the other side of symmetry
        if any(distance_to_tract(line.astype(np.float32), other).max() <= SAME * self.width for other in new):
            return matter
        name = free_tract_name(matter, self.params.part)
        made = coat_with_tract(matter, name, line, self.width)
        if self.params.count:
            made = made.replace(placements=(
                *made.placements, Placement(kind="even", count=self.params.count, tract=name)))
        return made

    def overlays(self) -> Overlays:
        """The band so far."""
        return self.way.overlays()


class Tract(Tool[TractParams]):
    """Draws tracts (pterylae)."""

    name = "tract"
    label = "Tract"
    icon = "tract"
    order = 94
    tooltip = "Draws a band of skin, a pteryla, whose feathers are those of a part of the bird."
    hint = "Drag over the skin: draw a tract   A click: a round one"
    step = "Tract"
    craft = "feather"
    edits = "coat"
    Params = TractParams

    def begin(self, ground: FeatherGround, pointer: Pointer) -> Stroke[FeatherCoat]:
        """A new band."""
        return DrawTract(self.params, ground, pointer)

    def hover(self, ground: FeatherGround, pointer: Pointer) -> Overlays:
        """The tracts there are."""
        found: list[Overlay] = []
        for tract in ground.coat.tracts:
            pixels = ground.in_view(ground.shown(tract.line))
            if len(pixels) > 1:
                found.append(Polyline(pixels, "accent", 1.5, dashed=True))
            found.append(Label(float(pixels[0, 0]) + 4.0, float(pixels[0, 1]) - 4.0, tract.name, "plain", plate=True))
        return tuple(found)
