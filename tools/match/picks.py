"""What the tools that pick in photographs share: the photograph at hand, the pick at a pointer, and a pick in the hand.

A model that is solved is solved again under the hand.
"""

from __future__ import annotations

from typing import Annotated, Literal, NamedTuple

import numpy as np

from core.errors import UserError
from core.field import field
from core.match.photomodel.records import Photo, Photomodel, Picked, find
from core.overlay import Circle, Overlay, Overlays
from core.record import Record
from tools.ground import Pointer
from tools.match.craft import REACH, Array, Marks, MatchGround
from tools.match.point import STILL
from tools.photomodel_edits import photo_of, with_model, with_photo, working_model

Kind = Literal["points", "lines", "circles"]


class PickParams(Record):
    """How a pick follows the hand."""

    speed: Annotated[float, field(
        "Speed", "How far a pick goes for the way of the hand; 0.1 to place it within a pixel.", "",
        (0.1, 1.0), (0.01, 1.0), step=0.1)] = 1.0


class Held(NamedTuple):
    """A pick: of which thing of the model, and its row among the picks of that."""

    kind: Kind
    id: int
    row: int


def model_here(ground: MatchGround) -> tuple[Photomodel, Photo]:
    """The model that is worked on with the frame in view among its photographs."""
    return with_photo(working_model(ground.marks.photomodels), ground.plate, ground.frame)


def pick_near(ground: MatchGround, pointer: Pointer, kind: Kind) -> Held | None:
    """The pick of a kind in the photograph in view that is nearest to a pointer, within reach."""
    model = working_model(ground.marks.photomodels)
    photo = photo_of(model, ground.plate.id, ground.frame)
    best, found = REACH, None
    if photo is not None:
        for item in getattr(model, kind):
            for row in np.flatnonzero(item.picks.photo == photo.id):
                x, y = ground.in_view(item.picks.xy[row])[0]
                away = float(np.hypot(x - pointer.x, y - pointer.y))
                if away <= best:
                    best, found = away, Held(kind, item.id, int(row))
    return found


def place_of(model: Photomodel, held: Held) -> Array:
    """Where a pick is (2,)."""
    items = getattr(model, held.kind)
    place: Array = items[find(items, held.id)].picks.xy[held.row]
    return place


def moved(model: Photomodel, held: Held, xy: Array) -> Photomodel:
    """The model with a pick somewhere else."""
    items = getattr(model, held.kind)
    row = find(items, held.id)
    places = items[row].picks.xy.copy()
    places[held.row] = xy
    item = items[row].replace(picks=items[row].picks.replace(xy=places))
    changed: Photomodel = model.replace(**{held.kind: (*items[:row], item, *items[row + 1:])})
    return changed


def added(model: Photomodel, kind: Kind, id_: int, photo: Photo, xy: Array) -> tuple[Photomodel, Held]:
    """The model with one more pick of a thing, and that pick."""
    items = getattr(model, kind)
    row = find(items, id_)
    picks = items[row].picks
    more = Picked(photo=np.append(picks.photo, np.int32(photo.id)), xy=np.concatenate([picks.xy, [xy]]))
    changed = model.replace(**{kind: (*items[:row], items[row].replace(picks=more), *items[row + 1:])})
    return changed, Held(kind, id_, len(picks.photo))


def inside(ground: MatchGround, pointer: Pointer) -> Array:
    """Where on the photograph a pointer is; UserError beside it."""
    place = ground.place(pointer)
    if not ground.inside(place):
        raise UserError("Picks lie on the picture; click inside of it.")
    return place


class MovePick:
    """A pick in the hand; cameras and model follow it.

    model : as it is at the press, with the pick. new : the pick was made by this press.
    """

    def __init__(self, params: PickParams, ground: MatchGround, pointer: Pointer, model: Photomodel, held: Held,
                 *, new: bool) -> None:
        self.ground, self.speed, self.held, self.new = ground, params.speed, held, new
        self.model = self.last = model
        self.pressed, self.start = np.array([pointer.x, pointer.y]), ground.place(pointer)
        self.origin = place_of(model, held)
        self.moved = False

    @property
    def step(self) -> str | None:
        """What the stroke turned out to be."""
        return None if self.new else "Move pick" if self.moved else "Select points"

    def extend(self, matter: Marks, pointers: tuple[Pointer, ...]) -> Marks:
        """The model with the pick where the hand is, solved again."""
        last = pointers[-1]
        self.moved = self.moved or bool(np.linalg.norm([last.x, last.y] - self.pressed) > STILL)
        self.at = self.origin + self.speed * (self.ground.place(last) - self.start) if self.moved else self.origin
        if self.moved or self.new:
            self.last = self._solved(self.last)
        return self._marks(matter, self.last)

    def finish(self, matter: Marks) -> Marks:
        """The model solved from where it was at the press, so that every replay ends alike."""
        if self.moved or self.new:
            self.last = self._solved(self.model)
        return self._marks(matter, self.last)

    def overlays(self) -> Overlays:
        """Nothing: the marks themselves are drawn."""
        return ()

    def _solved(self, model: Photomodel) -> Photomodel:
        from core.match.photomodel.solve import live  # the solver, which is large

        return live(moved(model, self.held, self.at))

    def _marks(self, matter: Marks, model: Photomodel) -> Marks:
        return self.ground.marks._replace(photomodels=with_model(self.ground.marks.photomodels, model))


def ring_about(ground: MatchGround, pointer: Pointer, kind: Kind) -> Overlays:
    """A ring about the pick that a press would take hold of."""
    held = pick_near(ground, pointer, kind)
    out: list[Overlay] = []
    if held is not None:
        x, y = ground.in_view(place_of(working_model(ground.marks.photomodels), held))[0]
        out.append(Circle(float(x), float(y), REACH, "accent"))
    return tuple(out)
