"""Track point: a click places a track, a drag moves one."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.field import field
from core.match.edits import key_track
from core.match.track import Track, TrackSettings, keyed_track
from core.overlay import Circle, Overlays, Polyline
from tools.ground import Pointer
from tools.match.craft import REACH, Marks, MatchGround, track_near
from tools.match_edits import free_track, place_at, selected_with, with_track
from tools.tool import Stroke, Tool, Turn

STILL = 2.0  # pixels of the view that a hand may shake in a click


class PointParams(TrackSettings):
    """Settings of Track point: those of the tracks it places, and how a drag moves them."""

    speed: Annotated[float, field(
        "Speed", "How far a track goes for the way of the hand; 0.1 to place it within a pixel.", "",
        (0.1, 1.0), (0.01, 1.0), step=0.1)] = 1.0
    adds: Annotated[bool, field(
        "Add to selection", "A click on a track selects it beside those that are selected, or lets it go.")] = False

    def track_settings(self) -> TrackSettings:
        """What the tracks are followed with."""
        return TrackSettings(**{name: getattr(self, name) for name in TrackSettings.__struct_fields__})


class PlacePoint:
    """A press takes hold of the nearest track, or makes a new one; the drag moves it, a click selects it."""

    def __init__(self, params: PointParams, ground: MatchGround, pointer: Pointer) -> None:
        self.ground, self.params = ground, params
        self.start = ground.place(pointer)
        self.pressed = np.array([pointer.x, pointer.y])
        self.moved = False
        held = track_near(ground, pointer)
        self.new = held is None
        if held is None:
            if not ground.inside(self.start):
                raise UserError("Tracks begin on the picture; click inside of it.")
            number = free_track(ground.marks.tracks)
            key = np.array([[float(ground.frame), *self.start]])
            held = keyed_track(number, f"track_{number:02d}", key, ground.plate.id).replace(
                settings=params.track_settings())
        elif held.locked:
            raise UserError(f"Track {held.name} is locked; unlock it to move it.")
        self.held: Track = held
        origin = place_at(held, ground.frame)
        self.origin: NDArray[np.float64] = self.start if origin is None else origin

    @property
    def step(self) -> str | None:
        """What the stroke turned out to be."""
        return None if self.new else "Move track" if self.moved else "Select track"

    def extend(self, matter: Marks, pointers: tuple[Pointer, ...]) -> Marks:
        """The marks with the track where the hand is."""
        last = pointers[-1]
        way = np.linalg.norm(np.array([last.x, last.y]) - self.pressed)
        self.moved = self.moved or bool(way > STILL)
        marks = self.ground.marks
        selection = marks.selection
        if self.new or self.moved or not self.params.adds:
            chosen = (self.held.id,) if self.new or self.held.id not in selection else (
                *(i for i in selection if i != self.held.id), self.held.id)
            chosen = chosen if self.moved or self.new else (self.held.id,)
        else:
            chosen = selected_with(selection, self.held.id)
        if not (self.new or self.moved):
            return marks if chosen == selection else marks._replace(selection=chosen)
        point = self.origin
        if self.moved:
            point = self.origin + self.params.speed * (self.ground.place(last) - self.start)
        track = key_track(self.held, self.ground.frame, (float(point[0]), float(point[1])))
        return marks._replace(tracks=with_track(marks.tracks, track), selection=chosen)

    def finish(self, matter: Marks) -> Marks:
        """The marks as they are."""
        return matter

    def overlays(self) -> Overlays:
        """Nothing: the marks themselves are drawn."""
        return ()


class TrackPoint(Tool[PointParams]):
    """Places and moves tracks."""

    name = "track_point"
    label = "Track point"
    icon = "match"
    order = 210
    tooltip = "Places a track with its pattern and search boxes by a click; drag one to move it, which sets a key."
    hint = "Click: place or select a track   Drag: move it   Shift: add to the selection   Ctrl: a tenth as far"
    step = "Track point"
    craft = "match"
    edits = "marks"
    with_shift = Turn("track_point", {"adds": True})
    with_ctrl = Turn("track_point", {"speed": 0.1})
    Params = PointParams

    def begin(self, ground: MatchGround, pointer: Pointer) -> Stroke[Marks]:
        """A track in the hand."""
        return PlacePoint(self.params, ground, pointer)

    def hover(self, ground: MatchGround, pointer: Pointer) -> Overlays:
        """The track that a press would take hold of, or the boxes of a new one."""
        near = track_near(ground, pointer)
        place = None if near is None else place_at(near, ground.frame)
        if place is not None:
            x, y = ground.in_view(place)[0]
            return (Circle(float(x), float(y), REACH, "accent"),)
        place = ground.place(pointer)
        if not ground.inside(place):
            return ()
        pattern = 0.5 * self.params.pattern
        return (
            Polyline(ground.in_view(place + pattern * SQUARE), "accent", 1.0, closed=True),
            Polyline(ground.in_view(place + (pattern + self.params.search) * SQUARE), "faint", 1.0, closed=True,
                     dashed=True))


SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
