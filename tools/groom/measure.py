"""Measure: how long a hair is, how far it is from here to there. Nothing is edited."""

from __future__ import annotations

import math

import numpy as np

from core.groom.guides import Guides
from core.groom.length import lengths
from core.overlay import Label, Marker, Overlays, Polyline
from core.record import Record
from core.units import METRES_PER_UNIT
from tools.groom.craft import GroomGround
from tools.ground import Hit, Pointer
from tools.tool import Stroke, Tool

PICK = 12.0  # pixels around the pointer within which a hair is found


class MeasureParams(Record):
    """Measure has no settings: the unit is the document's."""


class Measure(Tool[MeasureParams]):
    """A ruler."""

    name = "measure"
    label = "Measure"
    icon = "measure"
    order = 90
    tooltip = "Shows length, points and angle of the hair under the pointer; a drag measures a distance."
    hint = "Hover: measure a hair   Drag: measure a distance"
    step = "Measure"
    edits = "nothing"
    Params = MeasureParams

    def begin(self, ground: GroomGround, pointer: Pointer) -> Stroke[Guides]:
        """A distance."""
        return MeasureStroke(ground)

    def hover(self, ground: GroomGround, pointer: Pointer) -> Overlays:
        """The hair under the pointer and its figures."""
        row = ground.screen.nearest((pointer.x, pointer.y), PICK) if len(ground.guides) else None
        if row is None:
            return ()
        line, words = ground.screen.pixels[row], hair_in_words(ground, row)
        return (Polyline(line, "accent", 2.0), Label(pointer.x + 14.0, pointer.y - 10.0, words))


class MeasureStroke:
    """A straight line between two places on the skin."""

    def __init__(self, ground: GroomGround) -> None:
        self.ground = ground
        self.start: Hit | None = None
        self.ends: tuple[Pointer, Pointer] | None = None

    def extend(self, guides: Guides, pointers: tuple[Pointer, ...]) -> Guides:
        """The line goes to the newest place."""
        first = pointers[0] if self.ends is None else self.ends[0]
        if self.ends is None:
            self.start = self.ground.hit(first)
        self.ends = (first, pointers[-1])
        return guides

    def finish(self, guides: Guides) -> Guides:
        """Nothing is edited."""
        return guides

    def overlays(self) -> Overlays:
        """The line and its length, once it has both ends on the animal."""
        if self.ends is None or self.start is None or self.ends[0][:2] == self.ends[1][:2]:
            return ()
        a, b = self.ends
        line = Polyline(np.array([(a.x, a.y), (b.x, b.y)]), "accent", 2.0)
        end = self.ground.hit(b)
        if end is None:
            return (line, Marker(a.x, a.y))
        metres = float(np.linalg.norm(end.point - self.start.point))
        return (line, Marker(a.x, a.y), Marker(b.x, b.y), Label(b.x + 14.0, b.y - 10.0, in_words(self.ground, metres)))


def hair_in_words(ground: GroomGround, row: int) -> str:
    """Length, number of points and angle to the skin of one hair."""
    points = ground.shown.points[row].astype(np.float64)
    first = points[1] - points[0]
    rise = float(first @ ground.shown.roots.frames[row, 2]) / max(float(np.linalg.norm(first)), 1e-12)
    angle = math.degrees(math.asin(min(max(rise, -1.0), 1.0)))
    metres = float(lengths(ground.shown.points[row : row + 1])[0])
    return f"{in_words(ground, metres)}, {len(points)} points, {angle:.0f}° off the skin"


def in_words(ground: GroomGround, metres: float) -> str:
    """A length in the document's unit."""
    return f"{metres / METRES_PER_UNIT[ground.unit]:.4g} {ground.unit}"
