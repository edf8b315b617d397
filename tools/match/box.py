"""Track box: a rectangle drawn around a feature is the pattern of a new track."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.match.track import TrackSettings, keyed_track
from core.overlay import Overlays, Polyline
from tools.ground import Pointer
from tools.match.craft import Marks, MatchGround
from tools.match_edits import free_track, with_track
from tools.tool import Stroke, Tool

SMALLEST, LARGEST = 7, 201  # pixels of the plate


class BoxParams(TrackSettings):
    """Settings of Track box: those of the tracks it makes; the pattern is as large as the box."""


class DrawBox:
    """A rectangle from the press to the hand."""

    def __init__(self, params: BoxParams, ground: MatchGround, pointer: Pointer) -> None:
        self.ground, self.params = ground, params
        self.start = self.end = ground.place(pointer)

    def extend(self, matter: Marks, pointers: tuple[Pointer, ...]) -> Marks:
        """Nothing is made before the release."""
        self.end = self.ground.place(pointers[-1])
        return matter

    def finish(self, matter: Marks) -> Marks:
        """A track with a square pattern about the middle of the box, as large as its longer side."""
        middle = 0.5 * (self.start + self.end)
        side = float(np.abs(self.end - self.start).max())
        if side < SMALLEST:
            raise UserError(f"Draw the box around the feature, {SMALLEST} pixels of the plate or larger.")
        if not self.ground.inside(middle):
            raise UserError("Tracks begin on the picture; draw the box inside of it.")
        pattern = min(round(side) | 1, LARGEST)
        told = {name: getattr(self.params, name) for name in TrackSettings.__struct_fields__}
        number = free_track(matter.tracks)
        key = np.array([[float(self.ground.frame), *middle]])
        made = keyed_track(number, f"track_{number:02d}", key, self.ground.plate.id).replace(
            settings=TrackSettings(**{**told, "pattern": pattern}))
        return matter._replace(tracks=with_track(matter.tracks, made), selection=(number,))

    def overlays(self) -> Overlays:
        """The box."""
        (left, top), (right, bottom) = self.start, self.end
        corners: NDArray[np.float64] = np.array([[left, top], [right, top], [right, bottom], [left, bottom]])
        return (Polyline(self.ground.in_view(corners), "accent", 1.5, closed=True),)


class TrackBox(Tool[BoxParams]):
    """Places tracks by their patterns."""

    name = "track_box"
    label = "Track box"
    icon = "track-box"
    order = 211
    tooltip = "Draws the box of a pattern around a feature and places a track in its middle, as large as that."
    hint = "Drag: draw a box around a feature"
    step = "Track box"
    craft = "match"
    edits = "marks"
    Params = BoxParams

    def begin(self, ground: MatchGround, pointer: Pointer) -> Stroke[Marks]:
        """A box that is drawn."""
        return DrawBox(self.params, ground, pointer)
