"""Plate ruler: how far two places of the plate are apart, in pixels."""

from __future__ import annotations

import numpy as np

from core.overlay import Label, Marker, Overlays, Polyline
from core.record import Record
from tools.ground import Pointer
from tools.match.craft import Marks, MatchGround, track_near
from tools.match_edits import place_at
from tools.tool import Stroke, Tool


class RulerParams(Record):
    """The ruler has no settings."""


class Measuring:
    """A line from the press to the hand; nothing is changed."""

    def __init__(self, ground: MatchGround, pointer: Pointer) -> None:
        self.ground = ground
        self.start = self.end = ground.place(pointer)

    def extend(self, matter: Marks, pointers: tuple[Pointer, ...]) -> Marks:
        """The end is where the hand is."""
        self.end = self.ground.place(pointers[-1])
        return matter

    def finish(self, matter: Marks) -> Marks:
        """Nothing is changed."""
        return matter

    def overlays(self) -> Overlays:
        """The line and its length."""
        ends = self.ground.in_view(np.array([self.start, self.end]))
        by = self.end - self.start
        turned = np.degrees(np.arctan2(-by[1], by[0]))
        words = f"{np.hypot(*by):.2f} px   x {by[0]:+.2f}   y {by[1]:+.2f}   {turned:.1f}°"
        x, y = (float(v) for v in ends[1])
        return (Polyline(ends, "accent"), *(Marker(float(a), float(b)) for a, b in ends),
                Label(x + 12.0, y - 12.0, words, "plain", True))


class Ruler(Tool[RulerParams]):
    """Measures on the plate."""

    name = "ruler"
    label = "Plate ruler"
    icon = "measure"
    order = 215
    tooltip = "Measures how far two places of the plate are apart, and over a track how fast it moves there."
    hint = "Drag: measure in pixels of the plate   Over a track: its motion from the frame before"
    step = "Measure"
    craft = "match"
    edits = "marks"
    Params = RulerParams

    def begin(self, ground: MatchGround, pointer: Pointer) -> Stroke[Marks]:
        """A line that is drawn."""
        return Measuring(ground, pointer)

    def hover(self, ground: MatchGround, pointer: Pointer) -> Overlays:
        """The motion of the track at the pointer from the frame before."""
        track = track_near(ground, pointer)
        now = None if track is None else place_at(track, ground.frame)
        before = None if track is None else place_at(track, ground.frame - 1)
        if track is None or now is None or before is None:
            return ()
        by = now - before
        words = f"{track.name}: {np.hypot(*by):.2f} px a frame   x {by[0]:+.2f}   y {by[1]:+.2f}"
        return (Polyline(ground.in_view(np.array([before, now])), "accent"),
                Label(pointer.x + 14.0, pointer.y - 14.0, words, "plain", True))
