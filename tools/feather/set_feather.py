"""Set: single feathers, or a row of them, where the hand wants them."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np

from core.errors import UserError
from core.feather.coat.coat import FeatherCoat
from core.feather.coat.drawn import coat_with_set, coat_without_set, set_ids
from core.field import field
from core.mesh.surface import place_roots, root_positions
from core.overlay import Circle, Marker, Overlays
from core.record import Record
from tools.feather.craft import Array, FeatherGround
from tools.ground import Pointer
from tools.places import places_under
from tools.tool import Stroke, Tool, Turn

STEP = 2.0  # pixels between the places that are tried along a drag
SPACING = 0.02  # of the animal's diagonal, where none is given
REACH = 14.0  # pixels around the hand in which feathers are taken away


class SetParams(Record):
    """Settings of Set."""

    how: Annotated[Literal["set", "take away"], field(
        "Feathers", "Sets feathers under the hand, or takes those away that were set by hand.",
        choices=("set", "take away"))] = "set"
    spacing: Annotated[float, field(
        "Spacing", "Distance between feathers along a drag; 0 takes a fiftieth of the animal.", "m", (0, 0.1),
        (0, 1e4), step=0.001)] = 0.0


class SetFeathers:
    """Places along the way of the hand; the coat takes them at the release."""

    def __init__(self, params: SetParams, ground: FeatherGround) -> None:
        self.ground = ground
        self.spacing = params.spacing or SPACING * ground.rest.diagonal
        self.triangles: list[int] = []
        self.weights: list[np.ndarray] = []
        self.pixels: list[Array] = []
        self.last: Array | None = None
        self.at: Array | None = None
        self.due = 0.0  # metres until the next feather

    def extend(self, matter: FeatherCoat, pointers: tuple[Pointer, ...]) -> FeatherCoat:
        """Nothing is set before the release."""
        for pointer in pointers:
            end = np.array([pointer.x, pointer.y])
            start = end if self.last is None else self.last
            steps = max(1, int(np.ceil(np.linalg.norm(end - start) / STEP)))
            self._along(start + (end - start) * (np.arange(1, steps + 1) / steps)[:, None])
            self.last = end
        return matter

    def finish(self, matter: FeatherCoat) -> FeatherCoat:
        """The coat with the feathers."""
        if not self.triangles:
            if self.ground.mirrored:
                return matter
            raise UserError("Press on the skin where a feather is to stand.")
        rest = self.ground.rest
        return coat_with_set(matter, place_roots(
            rest.mesh, rest.triangles, np.array(self.triangles, np.int32), np.array(self.weights, np.float32),
            rest.normals))

    def overlays(self) -> Overlays:
        """Where feathers will stand."""
        return tuple(Marker(float(x), float(y), 7.0) for x, y in self.pixels)

    def _along(self, pixels: Array) -> None:
        found = places_under(self.ground, pixels)
        for i in range(len(pixels)):
            if found.triangle[i] < 0:
                self.at = None  # beside the animal: the row is broken off
                continue
            if self.at is not None:
                self.due -= float(np.linalg.norm(found.rest[i] - self.at))
            self.at = found.rest[i]
            if self.due <= 1e-9 * self.spacing:
                self.due += self.spacing if self.due > -self.spacing else self.spacing - self.due
                self.triangles.append(int(found.triangle[i]))
                self.weights.append(found.barycentric[i])
                self.pixels.append(pixels[i])


class TakeAway:
    """Feathers that were set by hand taken away around the hand."""

    def __init__(self, ground: FeatherGround) -> None:
        self.ground = ground
        self.ids, self.roots = _set_roots(ground)
        self.gone = np.zeros(len(self.ids), bool)

    def extend(self, matter: FeatherCoat, pointers: tuple[Pointer, ...]) -> FeatherCoat:
        """They go at the release."""
        for pointer in pointers:
            self.gone |= np.hypot(self.roots[:, 0] - pointer.x, self.roots[:, 1] - pointer.y) <= REACH
        return matter

    def finish(self, matter: FeatherCoat) -> FeatherCoat:
        """The coat without them."""
        return coat_without_set(matter, self.ids[self.gone]) if self.gone.any() else matter

    def overlays(self) -> Overlays:
        """What will go."""
        return tuple(Circle(float(x), float(y), 5.0, "trouble") for x, y in self.roots[self.gone])


class SetFeather(Tool[SetParams]):
    """Sets feathers by hand."""

    name = "set_feather"
    label = "Set"
    icon = "plant"
    order = 95
    tooltip = "Sets a feather where you click, or a row along a drag; keys around say how it lies."
    hint = "Click: set a feather   Drag: set a row   Ctrl: take away what was set by hand"
    step = "Set feathers"
    craft = "feather"
    edits = "coat"
    with_ctrl = Turn("set_feather", {"how": "take away"})
    with_eraser = Turn("set_feather", {"how": "take away"})
    Params = SetParams

    def begin(self, ground: FeatherGround, pointer: Pointer) -> Stroke[FeatherCoat]:
        """A click or a row."""
        return TakeAway(ground) if self.params.how == "take away" else SetFeathers(self.params, ground)

    def hover(self, ground: FeatherGround, pointer: Pointer) -> Overlays:
        """The roots that were set by hand."""
        _, roots = _set_roots(ground)
        ring = (Circle(pointer.x, pointer.y, REACH, "trouble"),) if self.params.how == "take away" else ()
        return (*(Circle(float(x), float(y), 3.0, "accent") for x, y in roots), *ring)


def _set_roots(ground: FeatherGround) -> tuple[np.ndarray, Array]:
    """Ids (N,) of the feathers that were set by hand and pixels (N, 2) of their roots."""
    points = [np.zeros((0, 3))]
    for placement in ground.coat.placements:
        if placement.hand is not None:
            found = root_positions(ground.item.mesh, placement.hand, ground.skin.points)
            points.append(found.astype(np.float64))
    return set_ids(ground.coat), ground.in_view(np.concatenate(points)).reshape(-1, 2)
