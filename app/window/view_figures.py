"""The figures in the corner of the view: what is shown, and how long a dab and a picture take."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from app.window.desk import Desk
from app.window.stopwatch import Stopwatch
from viewport.view import HudLine

if TYPE_CHECKING:
    from app.window.live_picture import LivePicture

EVERY = 0.25  # seconds between new figures


class ViewFigures:
    """Lines for the corner, made anew a few times a second.

    drawing, dabbing : how long a moving picture and the work of the hand for it take. driver : what draws, in words.
    """

    def __init__(self, desk: Desk) -> None:
        self.drawing, self.dabbing = Stopwatch(), Stopwatch()
        self.driver = ""
        self._desk = desk
        self._made = 0.0
        self._lines: list[HudLine] = []

    def forget(self) -> None:
        """Make them anew for the next picture."""
        self._lines = []

    def lines(self, picture: LivePicture) -> list[HudLine]:
        """The lines for this picture."""
        now = time.monotonic()
        if not self._lines or now - self._made >= EVERY:
            self._made, self._lines = now, self._fresh(picture)
        return self._lines

    def _fresh(self, picture: LivePicture) -> list[HudLine]:
        grooms = self._desk.document.grooms
        lines: list[HudLine] = []
        if grooms:
            guides = sum(len(groom.guides) for groom in grooms)
            lines += [(self._desk.session.tool.label, "accent"), f"guides {guides:,}"]
        if picture.total:
            shown = picture.total if picture.settled else min(picture.shown, picture.total)
            lines.append(f"hairs {picture.total:,}" if shown == picture.total else
                         f"hairs {shown:,} of {picture.total:,}")
        lines += _of_feathers(self._desk)
        if picture.settled:  # what the last moving picture took says nothing about this one
            lines.append("finished")
        else:
            dab = f"dab {self.dabbing.ms:.0f} ms · " if self.dabbing.ms else ""
            state = "growing" if picture.growing else "refining"
            lines.append(f"{dab}draw {self.drawing.ms:.0f} ms · {state}")
        lines.append(self.driver)
        return lines + [(trouble, "trouble") for trouble in picture.troubles]


def _of_feathers(desk: Desk) -> list[HudLine]:
    """How many feathers lie on the animals, and what of them still crosses."""
    found = [desk.session.plumages.last(coat.id) for coat in desk.document.feathers if not coat.hidden]
    lying = [one for one in found if one is not None]
    if not lying:
        return []
    lines: list[HudLine] = [f"feathers {sum(int(one.laid.shown.sum()) for one in lying):,}"]
    crossing, inside = sum(len(one.left.first) for one in lying), sum(len(one.left.skin) for one in lying)
    words = [f"{crossing:,} crossing"] * bool(crossing) + [f"{inside:,} in the skin"] * bool(inside)
    return lines + ([(" · ".join(words), "trouble")] if words else [])
