"""Records of a model made from photographs: who took them, what was picked in them, what is known, what is built."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np

from core.errors import UserError
from core.field import field
from core.match.solve.constraints import KINDS
from core.record import Record, column, number, text

FARTHEST = 1e7  # pixels, or units of the scene
MOST_ID = 2**31 - 1


class Photo(Record):
    """A photograph, or a frame of a plate. Pixel centres at whole numbers, origin top left, y down.

    id : stable, unique among the photographs of a model. plate_id : of the document's plates, 0 for none.
    camera : photographs of the same number share a focal length.
    focal_px : as it is known or found, None while nobody knows. centre : in pixels, or None for the middle.
    rotation : (3, 3) float64, camera_from_world, x right, y down, looking along +z; None until it is solved.
    translation : ``x_camera = rotation X + translation``.
    """

    id: int
    name: str
    width: int
    height: int
    plate_id: int = 0
    frame: int = 1
    camera: int = 1
    focal_px: float | None = None
    find_focal: Annotated[bool, field(
        "Find the focal length", "Looks for it too, from the one given where there is one.",
    )] = False
    k1: float = 0.0
    k2: float = 0.0
    centre: tuple[float, float] | None = None
    rotation: np.ndarray | None = None
    translation: tuple[float, float, float] | None = None
    locked: bool = False

    def __post_init__(self) -> None:
        text(self, "name")
        number(self, "id", "plate_id", "camera", least=0, most=MOST_ID)
        number(self, "frame", least=-MOST_ID, most=MOST_ID)
        number(self, "width", "height", least=1, most=1 << 16)
        number(self, "k1", "k2", least=-100.0, most=100.0)
        if self.focal_px is not None:
            number(self, "focal_px", least=1.0, most=FARTHEST)
        if self.centre is not None:
            number(self, "centre", least=-FARTHEST, most=FARTHEST)
        if (self.rotation is None) != (self.translation is None):
            raise ValueError(f"Photo {self.name!r} must have both rotation and translation, or neither")
        if self.rotation is not None and self.translation is not None:
            column(self, "rotation", np.float64, (3, 3))
            number(self, "translation")


class Picked(Record):
    """What was picked in photographs: photo (N,) int32 their ids, xy (N, 2) float64 pixels."""

    photo: np.ndarray
    xy: np.ndarray

    def __post_init__(self) -> None:
        column(self, "photo", np.int32, (None,))
        column(self, "xy", np.float64, (len(self.photo), 2))
        if len(self.xy) and np.abs(self.xy).max() > FARTHEST:
            raise ValueError(f"Picked.xy holds a place {FARTHEST:g} pixels away or more")


NOTHING = Picked(photo=np.zeros(0, np.int32), xy=np.zeros((0, 2)))


class ModelPoint(Record):
    """A point of the model. place : in the world, None until it is solved. picks : one for each photograph at most.

    sigma : pixels, how well it can be picked.
    """

    id: int
    name: str
    picks: Picked = NOTHING
    place: tuple[float, float, float] | None = None
    sigma: Annotated[float, field(
        "Sharpness", "How well the point can be picked, as a standard deviation.", "px",
        soft=(0.2, 5.0), hard=(0.01, 1000.0), step=0.1,
    )] = 1.0

    def __post_init__(self) -> None:
        text(self, "name")
        number(self, "id", least=0, most=MOST_ID)
        number(self, "sigma", least=0.01, most=1000.0)
        if self.place is not None:
            number(self, "place")
        if len(np.unique(self.picks.photo)) != len(self.picks.photo):
            raise ValueError(f"ModelPoint {self.name!r} is picked twice in one photograph")


class ModelLine(Record):
    """A straight edge between two points of the model, picked anywhere along it."""

    id: int
    name: str
    points: tuple[int, int]
    picks: Picked = NOTHING
    sigma: float = 1.0

    def __post_init__(self) -> None:
        text(self, "name")
        number(self, "id", "points", least=0, most=MOST_ID)
        number(self, "sigma", least=0.01, most=1000.0)
        if self.points[0] == self.points[1]:
            raise ValueError(f"ModelLine {self.name!r} needs two different points")


class ModelCircle(Record):
    """A circle picked along its outline. centre, normal, radius : in the world, None until it is solved.

    points : of the model, that lie on it too.
    """

    id: int
    name: str
    picks: Picked = NOTHING
    points: tuple[int, ...] = ()
    centre: tuple[float, float, float] | None = None
    normal: tuple[float, float, float] | None = None
    radius: float | None = None
    sigma: float = 1.0

    def __post_init__(self) -> None:
        text(self, "name")
        number(self, "id", "points", least=0, most=MOST_ID)
        number(self, "sigma", least=0.01, most=1000.0)
        if not (self.centre is None) == (self.normal is None) == (self.radius is None):
            raise ValueError(f"ModelCircle {self.name!r} must be solved as a whole or not at all")


class Known(Record):
    """What is known of points: see ``core.match.solve.constraints.KINDS``. points : ids. sigma : 0 is hard."""

    kind: str
    points: tuple[int, ...]
    value: tuple[float, ...] = ()
    sigma: float = 0.0

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise ValueError(f"Known.kind must be one of {', '.join(KINDS)}, not {self.kind!r}")
        number(self, "points", least=0, most=MOST_ID)
        number(self, "value")
        number(self, "sigma", least=0.0)


class WorldFrame(Record):
    """Where the world is, by ids of points: origin; axis, two points along +x; plane, the ground, +y above it;
    distance between two points, as long as `length`."""

    origin: int | None = None
    axis: tuple[int, int] | None = None
    plane: tuple[int, ...] | None = None
    distance: tuple[int, int] | None = None
    length: float = 1.0

    def __post_init__(self) -> None:
        number(self, "length", least=1e-9, most=1e9)


PARTS = ("polygon", "box", "extrude", "lathe", "mirror", "bridge")


class Part(Record):
    """A piece of the model built upon points, so it follows when they are solved again.

    kind : "polygon" around its points; "box" from a corner and the ends of its edges (the third may be a height in
        `value`); "extrude" of a polygon by a height along its normal; "lathe" of the profile `points[2:]` around the
        axis `points[:2]`, `value` holds segments; "mirror" of the parts `parts` in the plane of three points, or in the
        one between two points; "bridge" between the outlines of two parts.
    points : ids of points. parts : ids of parts. value : numbers, as the kind says.
    """

    id: int
    name: str
    kind: str
    points: tuple[int, ...] = ()
    parts: tuple[int, ...] = ()
    value: tuple[float, ...] = ()
    hidden: bool = False

    def __post_init__(self) -> None:
        text(self, "name")
        number(self, "id", "points", "parts", least=0, most=MOST_ID)
        number(self, "value", least=-FARTHEST, most=FARTHEST)
        if self.kind not in PARTS:
            raise ValueError(f"Part.kind must be one of {', '.join(PARTS)}, not {self.kind!r}")


class Photomodel(Record):
    """Photographs, what was picked in them and what is built; ids are unique among their kind.

    selection : ids of the points in hand, the active one last; ids of points that are gone mean nothing.
    """

    id: int
    name: str
    photos: tuple[Photo, ...] = ()
    points: tuple[ModelPoint, ...] = ()
    lines: tuple[ModelLine, ...] = ()
    circles: tuple[ModelCircle, ...] = ()
    known: tuple[Known, ...] = ()
    frame: WorldFrame = WorldFrame()
    parts: tuple[Part, ...] = ()
    hidden: bool = False
    locked: bool = False
    selection: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        text(self, "name")
        number(self, "id", "selection", least=0, most=MOST_ID)
        for kind in ("photos", "points", "lines", "circles", "parts"):
            items = getattr(self, kind)
            if len({item.id for item in items}) != len(items):
                raise ValueError(f"Photomodel.{kind} holds two of the same id")
        photos, points = {photo.id for photo in self.photos}, {point.id for point in self.points}
        things = [(item.name, item.picks) for items in (self.points, self.lines, self.circles) for item in items]
        for name, picks in things:
            if not set(picks.photo.tolist()) <= photos:
                raise ValueError(f"Photomodel: {name!r} is picked in a photograph that is not there")
        named: list[tuple[int, ...]] = [line.points for line in self.lines]
        named += [circle.points for circle in self.circles]
        named += [known.points for known in self.known]
        named += [part.points for part in self.parts]
        frame = self.frame
        if frame.origin is not None:
            named.append((frame.origin,))
        named += [part for part in (frame.axis, frame.plane, frame.distance) if part is not None]
        if not {id_ for ids in named for id_ in ids} <= points:
            raise ValueError("Photomodel names a point that is not there")
        before: set[int] = set()
        for part in self.parts:
            if not set(part.parts) <= before:
                raise ValueError(f"Photomodel: the part {part.name!r} builds on one that does not come before it")
            before.add(part.id)


def picked(photo: list[int], xy: list[tuple[float, float]]) -> Picked:
    """Picks from lists."""
    return Picked(photo=np.array(photo, np.int32), xy=np.array(xy, np.float64).reshape(-1, 2))


def with_pick(picks: Picked, photo: int, xy: tuple[float, float]) -> Picked:
    """Picks with the one of a photograph in place of what it had."""
    at = np.flatnonzero(picks.photo == photo)
    if not len(at):
        return Picked(photo=np.append(picks.photo, np.int32(photo)), xy=np.concatenate([picks.xy, [xy]]))
    places = picks.xy.copy()
    places[at[0]] = xy
    return picks.replace(xy=places)


def find(items: tuple[Any, ...], id_: int) -> int:
    """The row of an id; UserError when there is none."""
    for row, item in enumerate(items):
        if item.id == id_:
            return row
    raise UserError(f"There is nothing of id {id_} in this model; choose one of {[item.id for item in items]}.")


def moved_pick(model: Photomodel, point: int, photo: int, xy: tuple[float, float]) -> Photomodel:
    """The model with the pick of a point in a photograph moved, or made."""
    row = find(model.points, point)
    find(model.photos, photo)
    changed = model.points[row].replace(picks=with_pick(model.points[row].picks, photo, xy))
    return model.replace(points=(*model.points[:row], changed, *model.points[row + 1 :]))
