"""Track pattern: what a track is followed by. Its corners and its place are dragged, or another shape is drawn."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.match.track import Track, TrackSettings
from core.overlay import Circle, Overlays
from core.record import freeze
from tools.ground import Pointer
from tools.match.box import LARGEST, SMALLEST
from tools.match.craft import Marks, MatchGround
from tools.match.drawn_shape import ShapeParams, Way
from tools.match.point import SQUARE
from tools.match_edits import place_at, with_track
from tools.tool import Stroke, Tool

Array = NDArray[np.float64]
REACH = 9.0  # pixels of the view


class _Shaping:
    """What strokes of this tool share: a track whose pattern is changed at a key, and nothing else of it."""

    def __init__(self, ground: MatchGround, track: Track, pointer: Pointer) -> None:
        self.ground, self.track = ground, track
        self.start = ground.place(pointer)
        place = place_at(track, ground.frame)
        assert place is not None  # active_track looked
        self.place = place

    @property
    def step(self) -> str | None:
        """The name of the tool."""
        return None

    def extend(self, matter: Marks, pointers: tuple[Pointer, ...]) -> Marks:
        """The track with its pattern where the hand has it."""
        by = self.ground.place(pointers[-1]) - self.start
        return self._made(self.changed(by)) if by.any() else matter

    def finish(self, matter: Marks) -> Marks:
        """The marks as they are."""
        return matter

    def overlays(self) -> Overlays:
        """Nothing: the marks themselves are drawn."""
        return ()

    def changed(self, by: Array) -> Track:
        """The track after the hand went so far, in pixels of the plate."""
        return self.track

    def _made(self, track: Track) -> Marks:
        marks = self.ground.marks
        return marks._replace(tracks=with_track(marks.tracks, track))


class MoveCorner(_Shaping):
    """One point of the outline in the hand."""

    def __init__(self, ground: MatchGround, track: Track, pointer: Pointer, corner: int) -> None:
        super().__init__(ground, track, pointer)
        self.corner = corner

    def changed(self, by: Array) -> Track:
        """The track with the outline through the hand; its middle stays where it is."""
        shape = shape_of(self.track).copy()
        shape[self.corner] += by
        return shaped(self.track, shape, self.track.offset, self.track.shape_smooth)


class MovePattern(_Shaping):
    """The pattern in the hand, away from the point it stands for."""

    def changed(self, by: Array) -> Track:
        """The track with its pattern beside it."""
        x, y = map(float, np.asarray(self.track.offset) + by)
        moved: Track = self.track.replace(offset=(x, y))
        return moved


class DrawPattern(_Shaping):
    """The way of the hand, closed at the release: the new outline."""

    def __init__(self, params: ShapeParams, ground: MatchGround, track: Track, pointer: Pointer) -> None:
        super().__init__(ground, track, pointer)
        self.params, self.way = params, Way(params, ground, pointer, "accent")

    def extend(self, matter: Marks, pointers: tuple[Pointer, ...]) -> Marks:
        """Nothing is made before the release."""
        self.way.extend(pointers)
        return matter

    def finish(self, matter: Marks) -> Marks:
        """The track with a pattern of that shape, beside its point where it was drawn there."""
        points = self.way.outline()
        if points is None or self.way.span < SMALLEST:
            raise UserError(f"Draw around what the track should be followed by, {SMALLEST} pixels or larger.")
        middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
        x, y = map(float, middle - self.place)
        return self._made(shaped(self.track, points - middle, (x, y), self.params.smooth))

    def overlays(self) -> Overlays:
        """The way so far."""
        return self.way.overlays()


class TrackPattern(Tool[ShapeParams]):
    """Shapes the pattern of the active track."""

    name = "track_pattern"
    label = "Track pattern"
    icon = "lasso"
    order = 216
    tooltip = "Shapes what the selected track is followed by: drag its corners, drag it aside, or draw another shape."
    hint = "Drag a corner: shape the pattern   Drag inside: beside the point   Drag outside: draw around a new shape"
    step = "Track pattern"
    craft = "match"
    edits = "marks"
    Params = ShapeParams

    def begin(self, ground: MatchGround, pointer: Pointer) -> Stroke[Marks]:
        """A corner, the pattern, or a new shape in the hand."""
        track = active_track(ground)
        corner = corner_near(ground, track, pointer)
        if corner is not None:
            return MoveCorner(ground, track, pointer, corner)
        outline = outline_of(ground, track).astype(np.float32).reshape(-1, 1, 2)
        x, y = map(float, ground.place(pointer))
        if cv2.pointPolygonTest(outline, (x, y), False) >= 0:
            return MovePattern(ground, track, pointer)
        return DrawPattern(self.params, ground, track, pointer)

    def hover(self, ground: MatchGround, pointer: Pointer) -> Overlays:
        """The corners of the pattern; that in reach larger."""
        try:
            track = active_track(ground)
        except UserError:
            return ()
        near = corner_near(ground, track, pointer)
        return tuple(Circle(float(x), float(y), 6.0 if number == near else 3.0, "accent")
                     for number, (x, y) in enumerate(ground.in_view(outline_of(ground, track))))


def active_track(ground: MatchGround) -> Track:
    """The active track, which is free and has a key on the frame shown; UserError otherwise."""
    by_id = {track.id: track for track in ground.marks.tracks if track.plate_id == ground.plate.id}
    chosen = [by_id[i] for i in ground.marks.selection if i in by_id]
    if not chosen:
        raise UserError("No track is selected; click one with Track point first, then shape its pattern.")
    track = chosen[-1]
    if track.locked:
        raise UserError(f"Track {track.name} is locked; unlock it first.")
    if ground.frame not in track.keys[:, 0] or place_at(track, ground.frame) is None:
        raise UserError(f"Track {track.name} has no key here, where its pattern could be cut; go to a key, or key it.")
    return track


def shape_of(track: Track) -> Array:
    """The outline (P, 2) of the pattern about its middle."""
    if track.shape is not None:
        return track.shape
    square: Array = 0.5 * (track.settings or TrackSettings()).pattern * SQUARE
    return square


def shaped(track: Track, shape: Array, offset: tuple[float, float], smooth: bool) -> Track:
    """The track with another outline, and a pattern as large as that."""
    settings = track.settings or TrackSettings()
    side = int(np.clip(np.ceil(2.0 * np.abs(shape).max()), SMALLEST, LARGEST)) | 1
    made: Track = track.replace(
        shape=freeze(np.ascontiguousarray(shape)), offset=offset, shape_smooth=smooth,
        settings=settings.replace(pattern=min(side, LARGEST)))
    return made


def outline_of(ground: MatchGround, track: Track) -> Array:
    """The outline (P, 2) on the plate."""
    place = place_at(track, ground.frame)
    assert place is not None
    there: Array = place + np.asarray(track.offset) + shape_of(track)
    return there


def corner_near(ground: MatchGround, track: Track, pointer: Pointer) -> int | None:
    """The number of the point of the outline nearest to a pointer, within reach."""
    at = ground.in_view(outline_of(ground, track)) - [pointer.x, pointer.y]
    away = np.hypot(at[:, 0], at[:, 1])
    return int(away.argmin()) if away.min() <= REACH else None
