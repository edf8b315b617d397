"""Plant: a guide where you click, a row of them where you drag."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from core.field import field
from core.groom.guides import Guides
from core.groom.plant import plant
from core.groom.rows import append_guides
from core.overlay import Marker, Overlays
from core.record import Record
from tools.groom.craft import GroomGround
from tools.ground import Pointer
from tools.places import directions_at_rest, places_under
from tools.tool import Stroke, Tool, Turn

STEP = 2.0  # pixels between the places that are tried along a drag
BACK = 10.0  # pixels of the way that tell the direction of a drag
SPACING = 0.02  # of the animal's diagonal, where none is given


class PlantParams(Record):
    """Settings of Plant."""

    spacing: Annotated[float, field(
        "Spacing", "Distance between guides along a drag; 0 takes a fiftieth of the animal.", "m", (0, 0.1), (0, 1e4))
    ] = 0.0
    length: Annotated[float, field(
        "Length", "How long new guides are; 0 takes after their neighbours, or suits the animal.", "m", (0, 0.3),
        (0, 1e4))] = 0.0
    inherit: Annotated[int, field(
        "Take after", "How many guides nearby give a new one its shape; 0 plants straight ones that lean.", "", (0, 8),
        (0, 64), 1)] = 4
    lean: Annotated[float, field(
        "Lean", "Angle from the skin's normal at which straight guides lean along your drag.", "rad", (0, 1.5),
        (0, 1.55))] = 0.9


class Plant(Tool[PlantParams]):
    """Plants guides one by one or in rows."""

    name = "plant"
    label = "Plant"
    icon = "plant"
    order = 10
    tooltip = "Plants a guide where you click, or a row along a drag, shaped like the hair around."
    hint = "Click: plant one   Drag: plant a row   Eraser: delete"
    step = "Plant"
    at_rest = True
    with_eraser = Turn("delete")
    Params = PlantParams

    def begin(self, ground: GroomGround, pointer: Pointer) -> Stroke[Guides]:
        """A click or a row."""
        return PlantStroke(self.params, ground)


class PlantStroke:
    """Plants along the way. The first guide waits until it is known where the hand goes, or for the release."""

    def __init__(self, params: PlantParams, ground: GroomGround) -> None:
        self.params, self.ground = params, ground
        self.spacing = params.spacing or SPACING * ground.rest.diagonal
        self.last: Pointer | None = None
        self.way: list[tuple[NDArray[np.float64], NDArray[np.float64]]] = []  # pixels and place in the pose shown
        self.at: NDArray[np.float64] | None = None  # the last place at rest
        self.due = 0.0  # metres until the next guide
        self.first: tuple[int, NDArray[np.float32]] | None = None

    def extend(self, guides: Guides, pointers: tuple[Pointer, ...]) -> Guides:
        """Guides planted along these samples."""
        triangles, weights, directions = [], [], []
        pixels = self._pixels(pointers)
        found = places_under(self.ground, pixels)
        for i in range(len(pixels)):
            if found.triangle[i] < 0:
                self.at, self.way = None, []  # beside the animal: the row is broken off
                continue
            if self.at is not None:
                self.due -= float(np.linalg.norm(found.rest[i] - self.at))
            self.at = found.rest[i]
            self.way.append((pixels[i], found.shown[i]))
            place = (int(found.triangle[i]), found.barycentric[i])
            direction = self._direction()
            if self.first is not None and direction is not None:
                triangles.append(self.first[0])
                weights.append(self.first[1])
                directions.append(direction)
                self.first = None
            if self.due <= 1e-9 * self.spacing:
                self.due += self.spacing if self.due > -self.spacing else self.spacing - self.due
                if direction is None:
                    self.first = place
                else:
                    triangles.append(place[0])
                    weights.append(place[1])
                    directions.append(direction)
        return self._planted(guides, triangles, weights, directions)

    def finish(self, guides: Guides) -> Guides:
        """A click plants at release."""
        if self.first is None:
            return guides
        (triangle, weights), self.first = self.first, None
        return self._planted(guides, [triangle], [weights], None)

    def overlays(self) -> Overlays:
        """Where a click will plant."""
        if self.first is None or self.last is None:
            return ()
        return (Marker(self.last.x, self.last.y),)

    def _pixels(self, pointers: tuple[Pointer, ...]) -> NDArray[np.float64]:
        pieces = []
        for pointer in pointers:
            end = np.array([pointer.x, pointer.y], np.float64)
            start = end if self.last is None else np.array([self.last.x, self.last.y])
            steps = max(1, int(np.ceil(np.linalg.norm(end - start) / STEP)))
            pieces.append(start + (end - start) * (np.arange(1, steps + 1) / steps)[:, None])
            self.last = pointer
        return np.concatenate(pieces)

    def _direction(self) -> NDArray[np.float64] | None:
        """Where the hand goes in the pose shown, over the last pixels of the way; None before it is known."""
        here, at = self.way[-1]
        for pixel, place in reversed(self.way):
            if np.linalg.norm(here - pixel) >= BACK:
                return at - place
        return None

    def _planted(
        self, guides: Guides, triangles: list[int], weights: list[NDArray[np.float32]],
        directions: list[NDArray[np.float64]] | None,
    ) -> Guides:
        if not triangles:
            return guides
        p, ground, base = self.params, self.ground, self.ground.guides
        triangle, barycentric = np.array(triangles, np.int32), np.array(weights, np.float32)
        toward = None if directions is None else directions_at_rest(ground, triangle, barycentric, np.array(directions))
        # they take after the guides at press, not after each other: a row follows the drag
        made = plant(
            base, ground.rest, triangle, barycentric, length=p.length or None, direction=toward, lean=p.lean,
            inherit=p.inherit, field=ground.rest_field,
        )
        new = np.arange(len(base), len(made))
        return append_guides(guides, made.roots.take(new), made.points[new])
