"""Roto mask: shapes drawn on the plate that hold tracks off."""

from __future__ import annotations

from typing import Annotated

import numpy as np

from core.document import free_id
from core.errors import UserError
from core.field import field
from core.match.outline import Mask, key_mask, outline_at
from core.overlay import Circle, Overlays
from core.record import freeze
from tools.ground import Pointer
from tools.match.craft import Marks, MatchGround
from tools.match.drawn_shape import ShapeParams, Way
from tools.tool import Stroke, Tool

REACH = 9.0  # pixels of the view


class RotoParams(ShapeParams):
    """Settings of Roto mask."""

    whole: Annotated[bool, field(
        "Move whole shape", "A point that is dragged takes the whole shape with it instead of going alone.")] = False


class DrawShape:
    """A new shape."""

    def __init__(self, params: RotoParams, ground: MatchGround, pointer: Pointer) -> None:
        self.ground, self.params = ground, params
        self.way = Way(params, ground, pointer, "trouble")

    @property
    def step(self) -> str | None:
        """The name of the tool."""
        return None

    def extend(self, matter: Marks, pointers: tuple[Pointer, ...]) -> Marks:
        """Nothing is made before the release."""
        self.way.extend(pointers)
        return matter

    def finish(self, matter: Marks) -> Marks:
        """A mask with as few points as keep it near the way of the hand."""
        points = self.way.outline()
        if points is None:
            raise UserError("Draw around what tracks must not look at, and let go where you began.")
        number = free_id(matter.masks)
        made = Mask(
            id=number, name=f"mask_{number:02d}", frames=freeze(np.array([self.ground.frame], np.int32)),
            points=freeze(points[None].copy()), plate_id=self.ground.plate.id, smooth=self.params.smooth)
        return matter._replace(masks=(*matter.masks, made))

    def overlays(self) -> Overlays:
        """The way so far."""
        return self.way.overlays()


class MovePoint:
    """A point of a mask in the hand, which sets a key of the mask."""

    def __init__(self, params: RotoParams, ground: MatchGround, pointer: Pointer, mask: Mask, point: int) -> None:
        self.ground, self.mask, self.point, self.whole = ground, mask, point, params.whole
        self.start = ground.place(pointer)
        self.points = outline_at(mask, ground.frame)

    @property
    def step(self) -> str | None:
        """What it is."""
        return "Move mask"

    def extend(self, matter: Marks, pointers: tuple[Pointer, ...]) -> Marks:
        """The mask with its point where the hand is."""
        by = self.ground.place(pointers[-1]) - self.start
        if not by.any():
            return matter
        points = self.points.copy()
        points[slice(None) if self.whole else self.point] += by
        moved = key_mask(self.mask, self.ground.frame, points)
        masks = tuple(moved if m.id == moved.id else m for m in self.ground.marks.masks)
        return self.ground.marks._replace(masks=masks)

    def finish(self, matter: Marks) -> Marks:
        """The mask as it is."""
        return matter

    def overlays(self) -> Overlays:
        """Nothing: the marks themselves are drawn."""
        return ()


class Roto(Tool[RotoParams]):
    """Draws and moves masks."""

    name = "roto"
    label = "Roto mask"
    icon = "mask"
    order = 213
    tooltip = "Draws a shape around what moves by itself; tracks do not look at it. Drag a point to key it."
    hint = "Drag: draw around what tracks must not look at   Drag a point: move it on this frame"
    step = "Roto mask"
    craft = "match"
    edits = "marks"
    Params = RotoParams

    def begin(self, ground: MatchGround, pointer: Pointer) -> Stroke[Marks]:
        """A point in the hand, or a new shape."""
        near = point_near(ground, pointer)
        if near is None:
            return DrawShape(self.params, ground, pointer)
        if near[0].locked:
            raise UserError(f"Mask {near[0].name} is locked; unlock it to move it.")
        return MovePoint(self.params, ground, pointer, *near)

    def hover(self, ground: MatchGround, pointer: Pointer) -> Overlays:
        """The points of the masks; that in reach larger."""
        near = point_near(ground, pointer)
        found: list[Circle] = []
        for mask in _masks(ground):
            for number, (x, y) in enumerate(ground.in_view(outline_at(mask, ground.frame))):
                held = near is not None and near[0] is mask and near[1] == number
                found.append(Circle(float(x), float(y), 6.0 if held else 3.0, "accent" if held else "trouble"))
        return tuple(found)


def point_near(ground: MatchGround, pointer: Pointer) -> tuple[Mask, int] | None:
    """The mask and the number of its point nearest to a pointer, within reach."""
    best, found = REACH, None
    for mask in _masks(ground):
        at = ground.in_view(outline_at(mask, ground.frame)) - [pointer.x, pointer.y]
        away = np.hypot(at[:, 0], at[:, 1])
        if away.min() <= best:
            best, found = float(away.min()), (mask, int(away.argmin()))
    return found


def _masks(ground: MatchGround) -> list[Mask]:
    return [m for m in ground.marks.masks if m.plate_id == ground.plate.id and not m.hidden]
