"""Nudge: selected tracks follow the hand a tenth as far, wherever it drags."""

from __future__ import annotations

from typing import Annotated

from core.errors import UserError
from core.field import field
from core.match.edits import key_track
from core.overlay import Overlays
from core.record import Record
from tools.ground import Pointer
from tools.match.craft import Marks, MatchGround
from tools.match_edits import place_at, with_track
from tools.tool import Stroke, Tool


class NudgeParams(Record):
    """Settings of Nudge."""

    speed: Annotated[float, field(
        "Speed", "How far tracks go for the way of the hand; 0.1 is a tenth as far.", "",
        (0.01, 1.0), (0.001, 1.0), step=0.01)] = 0.1


class NudgeTracks:
    """The selected tracks that are seen on the frame, moved together."""

    def __init__(self, params: NudgeParams, ground: MatchGround, pointer: Pointer) -> None:
        self.ground, self.speed, self.start = ground, params.speed, ground.place(pointer)
        chosen = [t for t in ground.marks.tracks if t.id in ground.marks.selection]
        self.held = [(t, place) for t in chosen if (place := place_at(t, ground.frame)) is not None]
        if not self.held:
            raise UserError("No selected track is seen on this frame; select one with Track point first.")
        locked = next((t.name for t, _ in self.held if t.locked), None)
        if locked is not None:
            raise UserError(f"Track {locked} is locked; unlock it to move it.")

    def extend(self, matter: Marks, pointers: tuple[Pointer, ...]) -> Marks:
        """The tracks where the hand has brought them, which are keys."""
        by = self.speed * (self.ground.place(pointers[-1]) - self.start)
        if not by.any():
            return matter
        tracks = self.ground.marks.tracks
        for track, place in self.held:
            moved = key_track(track, self.ground.frame, (float(place[0] + by[0]), float(place[1] + by[1])))
            tracks = with_track(tracks, moved)
        return self.ground.marks._replace(tracks=tracks)

    def finish(self, matter: Marks) -> Marks:
        """The tracks as they are."""
        return matter

    def overlays(self) -> Overlays:
        """Nothing: the marks themselves are drawn."""
        return ()


class Nudge(Tool[NudgeParams]):
    """Moves tracks by parts of pixels."""

    name = "nudge"
    label = "Nudge"
    icon = "move"
    order = 214
    tooltip = "Moves the selected tracks by parts of a pixel, a tenth as far as the hand, which sets a key."
    hint = "Drag anywhere: move the selected tracks a tenth as far"
    step = "Nudge"
    craft = "match"
    edits = "marks"
    Params = NudgeParams

    def begin(self, ground: MatchGround, pointer: Pointer) -> Stroke[Marks]:
        """Tracks in the hand."""
        return NudgeTracks(self.params, ground, pointer)
