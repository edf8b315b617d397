"""The craft of matchmoving: strokes change tracks, planes and masks of a plate, on the plate as it is looked at."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from core.camera import clip_from_world
from core.document import Document
from core.errors import UserError
from core.groom.region import View
from core.image.plate import Plate
from core.image.plate_view import pixels_per_pixel, plate_points, plate_size, view_points
from core.match.outline import Mask
from core.match.photomodel.records import Photomodel
from core.match.track import PlaneTrack, Track
from tools.craft import Work
from tools.ground import Ground, Pointer, Sight
from tools.match_edits import place_at, shown_plate
from tools.tool import Tool

Array = NDArray[np.float64]
REACH = 10.0  # pixels of the view from a track that a press takes hold of it
FIELDS = ("tracks", "track_selection", "planes", "masks", "photomodels")


class Marks(NamedTuple):
    """What strokes change: all that is marked on plates, and which tracks are selected, the active one last."""

    tracks: tuple[Track, ...]
    selection: tuple[int, ...]
    planes: tuple[PlaneTrack, ...]
    masks: tuple[Mask, ...]
    photomodels: tuple[Photomodel, ...]


@dataclass(frozen=True, kw_only=True)
class MatchGround(Ground):
    """What a stroke of matchmoving works on. frame : as the files of the plate count."""

    plate: Plate
    frame: int
    marks: Marks

    @property
    def scale(self) -> float:
        """Pixels of the view for one of the plate."""
        return pixels_per_pixel(self.sight.camera, self.sight.height)

    def place(self, pointer: Pointer) -> Array:
        """Where on the plate (2,) a pointer is."""
        _, width, height = self.sight
        found: Array = plate_points(
            self.sight.camera, self.plate.pixel_aspect, (pointer.x, pointer.y), width, height)[0]
        return found

    def inside(self, place: Array) -> bool:
        """True for a place on the picture, its outermost pixels whole."""
        wide, tall = plate_size(self.plate)
        return bool(-0.5 <= place[0] <= wide - 0.5 and -0.5 <= place[1] <= tall - 0.5)

    def in_view(self, points: ArrayLike) -> Array:
        """Pixels (N, 2) of the view that show places (N, 2) of the plate."""
        _, width, height = self.sight
        return view_points(self.sight.camera, self.plate.pixel_aspect, points, width, height)


class MatchCraft:
    """Strokes on a plate."""

    name = "match"
    label = "Match"
    first = "track_point"
    edits = ("marks",)

    def __init__(self) -> None:
        self._known: tuple[tuple[Any, ...], tuple[MatchGround, ...]] | None = None

    def grounds(self, session: Work, sight: Sight, tool: Tool[Any]) -> tuple[MatchGround, ...]:
        """The plate that is shown; UserError when there is none or it is locked."""
        document = session.history.current
        plate = shown_plate(document)
        if plate is None:
            raise UserError("There is no plate to track; open one from the File menu, or drop its folder here.")
        if plate.locked:
            raise UserError(f"{plate.name} is locked; unlock it to track on it.")
        frame = round(session.workspace.frame) - plate.offset
        key = document, frame, sight
        if self._known is None or self._known[0][0] is not document or self._known[0][1:] != key[1:]:
            sharp = View(clip_from_world(sight.camera, sight.width, sight.height), sight.width, sight.height)
            self._known = key, (
                MatchGround(sight, sharp, document.unit, plate=plate, frame=frame, marks=_marks(document)),)
        return self._known[1]

    def matter(self, tool: Tool[Any], ground: MatchGround) -> Marks:
        """All marks."""
        return ground.marks

    def shown(self, document: Document, tool: Tool[Any], ground: MatchGround, matter: Marks) -> Document:
        """The document with these marks."""
        if all(new is old for new, old in zip(matter, _marks(document), strict=True)):
            return document
        changed: Document = document.replace(**dict(zip(FIELDS, matter, strict=True)))
        return changed

    def document(self, document: Document, tool: Tool[Any], ground: MatchGround, matter: Marks) -> Document:
        """As :meth:`shown`."""
        return self.shown(document, tool, ground, matter)

    def place(self, session: Work, ground: MatchGround) -> dict[str, Any]:
        """The frame."""
        return {"frame": session.workspace.frame}

    def ready(self, tool: Tool[Any], ground: MatchGround) -> bool:
        """Nothing here is slow to make."""
        return True

    def wait(self, ground: MatchGround) -> None:
        """Nothing to wait for."""

    def preparation(self, session: Work) -> Callable[[], object] | None:
        """Nothing to prepare."""
        return None


def track_near(ground: MatchGround, pointer: Pointer) -> Track | None:
    """The track of the plate shown that is nearest to a pointer, within reach; selected ones first."""
    best: tuple[bool, float] | None = None
    found: Track | None = None
    for track in ground.marks.tracks:
        place = place_at(track, ground.frame) if track.plate_id == ground.plate.id and not track.hidden else None
        if place is None:
            continue
        x, y = ground.in_view(place)[0]
        away = float(np.hypot(x - pointer.x, y - pointer.y))
        rank = (track.id not in ground.marks.selection, away)
        if away <= REACH and (best is None or rank < best):
            best, found = rank, track
    return found


def _marks(document: Document) -> Marks:
    return Marks(*(getattr(document, name) for name in FIELDS))
