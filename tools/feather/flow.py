"""Flow: strokes on the skin along which all feathers lie."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np

from core.errors import UserError
from core.feather.coat.coat import FeatherCoat
from core.feather.coat.drawn import coat_with_stroke, coat_without_strokes
from core.field import field
from core.groom.region import distance_to_path
from core.overlay import Circle, Overlay, Overlays, Polyline
from core.record import Record
from tools.feather.craft import Array, FeatherGround
from tools.feather.way import SkinWay
from tools.ground import Pointer
from tools.tool import Stroke, Tool, Turn

REACH = 10.0  # pixels of the view


class FlowParams(Record):
    """Settings of Flow."""

    how: Annotated[Literal["draw", "erase"], field(
        "Strokes", "Draws strokes that feathers follow from root to tip, or takes those under the hand away.",
        choices=("draw", "erase"))] = "draw"


class DrawFlow:
    """A stroke that is drawn; feathers turn at the release, for all of them may."""

    def __init__(self, ground: FeatherGround) -> None:
        self.ground, self.way = ground, SkinWay(ground, "accent")

    def extend(self, matter: FeatherCoat, pointers: tuple[Pointer, ...]) -> FeatherCoat:
        """Nothing is made before the release."""
        self.way.extend(pointers)
        return matter

    def finish(self, matter: FeatherCoat) -> FeatherCoat:
        """The coat following one more stroke."""
        line = self.way.line()
        if len(line) < 2:
            if self.ground.mirrored:
                return matter
            raise UserError("Drag over the skin, the way the feathers are to lie from root to tip.")
        return coat_with_stroke(matter, line)

    def overlays(self) -> Overlays:
        """The way so far."""
        return self.way.overlays()


class EraseFlow:
    """Strokes taken away under the hand."""

    def __init__(self, ground: FeatherGround) -> None:
        self.ground = ground
        self.path: list[list[float]] = []

    def extend(self, matter: FeatherCoat, pointers: tuple[Pointer, ...]) -> FeatherCoat:
        """Nothing is taken before the release."""
        self.path += [[p.x, p.y] for p in pointers]
        return matter

    def finish(self, matter: FeatherCoat) -> FeatherCoat:
        """The coat without the strokes that the hand passed."""
        path = np.array(self.path)
        gone = {
            id(stroke) for stroke in matter.strokes
            if distance_to_path(_dense(self.ground.in_view(self.ground.shown(stroke.points))), path).min() <= REACH
        }
        return coat_without_strokes(matter, [k for k, s in enumerate(matter.strokes) if id(s) in gone])

    def overlays(self) -> Overlays:
        """The way so far."""
        return (Polyline(np.array(self.path), "trouble"),) if len(self.path) > 1 else ()


class Flow(Tool[FlowParams]):
    """Draws the direction of feathers."""

    name = "flow"
    label = "Flow"
    icon = "flow"
    order = 93
    tooltip = "Draws strokes along which all feathers lie, from root to tip, instead of along their keys."
    hint = "Drag over the skin: feathers lie along it   Ctrl+drag: take strokes away"
    step = "Flow"
    craft = "feather"
    edits = "coat"
    with_ctrl = Turn("flow", {"how": "erase"})
    with_eraser = Turn("flow", {"how": "erase"})
    Params = FlowParams

    def begin(self, ground: FeatherGround, pointer: Pointer) -> Stroke[FeatherCoat]:
        """A new stroke, or an eraser."""
        return EraseFlow(ground) if self.params.how == "erase" else DrawFlow(ground)

    def hover(self, ground: FeatherGround, pointer: Pointer) -> Overlays:
        """The strokes there are, a ring at the tip of each."""
        found: list[Overlay] = []
        for stroke in ground.coat.strokes:
            pixels = ground.in_view(ground.shown(stroke.points))
            found.append(Polyline(pixels, "accent"))
            found.append(Circle(float(pixels[-1, 0]), float(pixels[-1, 1]), 3.0, "accent"))
        return tuple(found)


def _dense(line: Array) -> Array:
    """A line (P, 2) with points every few pixels."""
    steps = np.maximum(np.ceil(np.linalg.norm(np.diff(line, axis=0), axis=1) / 4.0).astype(int), 1)
    pieces = [line[k] + (line[k + 1] - line[k]) * (np.arange(n) / n)[:, None] for k, n in enumerate(steps)]
    return np.concatenate([*pieces, line[-1:]])
