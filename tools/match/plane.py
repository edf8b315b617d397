"""Track plane: a flat piece of the scene, drawn as a rectangle, is followed as a whole: a corner pin."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.document import free_id
from core.errors import UserError
from core.match.track import PlaneTrack, TrackSettings, drawn_plane
from core.overlay import Circle, Overlays, Polyline
from core.record import freeze
from tools.ground import Pointer
from tools.match.craft import Marks, MatchGround
from tools.tool import Stroke, Tool

Array = NDArray[np.float64]
REACH, SMALLEST = 9.0, 9.0  # pixels of the view; of the plate


class PlaneParams(TrackSettings):
    """Settings of Track plane: those of the planes it draws."""


class DrawPlane:
    """A rectangle from the press to the hand."""

    def __init__(self, params: PlaneParams, ground: MatchGround, pointer: Pointer) -> None:
        self.ground, self.params = ground, params
        self.start = self.end = ground.place(pointer)

    @property
    def step(self) -> str | None:
        """The name of the tool."""
        return None

    def extend(self, matter: Marks, pointers: tuple[Pointer, ...]) -> Marks:
        """Nothing is made before the release."""
        self.end = self.ground.place(pointers[-1])
        return matter

    def finish(self, matter: Marks) -> Marks:
        """A plane with that outline, its key on this frame."""
        if np.abs(self.end - self.start).min() < SMALLEST:
            raise UserError(f"Draw the plane {SMALLEST:g} pixels of the plate or larger, then drag its corners.")
        number = free_id(matter.planes)
        made = drawn_plane(
            number, f"plane_{number:02d}", self.ground.frame, self._corners(), self.ground.plate.id)
        told = {name: getattr(self.params, name) for name in TrackSettings.__struct_fields__}
        return matter._replace(planes=(*matter.planes, made.replace(
            outline=freeze(made.outline), corners=freeze(made.corners), settings=TrackSettings(**told))))

    def overlays(self) -> Overlays:
        """The rectangle."""
        return (Polyline(self.ground.in_view(self._corners()), "accent", 1.5, closed=True),)

    def _corners(self) -> Array:
        (left, top), (right, bottom) = np.minimum(self.start, self.end), np.maximum(self.start, self.end)
        return np.array([[left, top], [right, top], [right, bottom], [left, bottom]])


class MoveCorner:
    """A corner of a plane in the hand, on the frame of its key. What was followed before is forgotten."""

    def __init__(self, ground: MatchGround, pointer: Pointer, plane: PlaneTrack, corner: int) -> None:
        self.ground, self.plane, self.corner = ground, plane, corner
        self.start = ground.place(pointer)

    @property
    def step(self) -> str | None:
        """What it is."""
        return "Move corner"

    def extend(self, matter: Marks, pointers: tuple[Pointer, ...]) -> Marks:
        """The plane with its corner where the hand is."""
        corners = self.plane.corners.copy()
        corners[self.corner] += self.ground.place(pointers[-1]) - self.start
        fresh = drawn_plane(self.plane.id, self.plane.name, self.plane.key_frame, corners, self.plane.plate_id)
        moved = fresh.replace(
            outline=freeze(fresh.outline), corners=freeze(fresh.corners), settings=self.plane.settings)
        planes = tuple(moved if p.id == moved.id else p for p in self.ground.marks.planes)
        return self.ground.marks._replace(planes=planes)

    def finish(self, matter: Marks) -> Marks:
        """The plane as it is."""
        return matter

    def overlays(self) -> Overlays:
        """Nothing: the marks themselves are drawn."""
        return ()


class TrackPlane(Tool[PlaneParams]):
    """Draws planes."""

    name = "track_plane"
    label = "Track plane"
    icon = "perspective"
    order = 212
    tooltip = "Draws a flat piece of the scene, whose corners follow it in perspective when planes are tracked."
    hint = "Drag: draw a plane   Drag a corner on the frame of its key: move it"
    step = "Track plane"
    craft = "match"
    edits = "marks"
    Params = PlaneParams

    def begin(self, ground: MatchGround, pointer: Pointer) -> Stroke[Marks]:
        """A corner in the hand, or a new plane."""
        near = corner_near(ground, pointer)
        if near is None:
            return DrawPlane(self.params, ground, pointer)
        if near[0].locked:
            raise UserError(f"Plane {near[0].name} is locked; unlock it to move it.")
        return MoveCorner(ground, pointer, *near)

    def hover(self, ground: MatchGround, pointer: Pointer) -> Overlays:
        """The corner in reach."""
        near = corner_near(ground, pointer)
        if near is None:
            return ()
        x, y = ground.in_view(near[0].corners[near[1]])[0]
        return (Circle(float(x), float(y), REACH, "accent"),)


def corner_near(ground: MatchGround, pointer: Pointer) -> tuple[PlaneTrack, int] | None:
    """The plane with its key on this frame, and the number of its corner nearest to a pointer, within reach."""
    best, found = REACH, None
    for plane in ground.marks.planes:
        if plane.plate_id == ground.plate.id and not plane.hidden and plane.key_frame == ground.frame:
            at = ground.in_view(plane.corners) - [pointer.x, pointer.y]
            away = np.hypot(at[:, 0], at[:, 1])
            if away.min() <= best:
                best, found = float(away.min()), (plane, int(away.argmin()))
    return found
