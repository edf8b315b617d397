"""Pictures pinned to the view, by hand: dragged, made larger at their lower right corner or with the wheel."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from app.window.desk import Desk
from core.overlay import Overlays, Polyline
from core.workspace import Reference

CORNER = 24.0  # pixels of Qt's that scale instead of moving
NARROWEST, WIDEST = 0.02, 4.0  # of the view's width
INSIDE = 0.03  # of the view that a picture always covers, so that it can be grasped again
NOTCH = 1.1  # times as wide for a notch of the wheel

Shape = Callable[[str], tuple[int, int] | None]
"""Height and width in pixels of the picture of a path, None when it cannot be shown."""


class PinnedPictures:
    """The references of a desk as boxes in a view.

    Parameters
    ----------
    size : of the view in pixels of the framebuffer. shape : of pictures.
    """

    def __init__(self, desk: Desk, size: Callable[[], tuple[int, int]], shape: Shape) -> None:
        self.desk, self.size, self.shape = desk, size, shape

    def box(self, reference: Reference) -> tuple[float, float, float, float] | None:
        """Left, top, right, bottom in pixels of the framebuffer; None when the picture cannot be shown."""
        (width, height), shape = self.size(), self.shape(reference.path)
        if shape is None:
            return None
        left, top, wide = reference.x * width, reference.y * height, reference.width * width
        return left, top, left + wide, top + wide * shape[0] / shape[1]

    def at(self, x: float, y: float) -> int | None:
        """The row of the uppermost picture under a pixel."""
        references = self.desk.workspace.view.references
        for row in reversed(range(len(references))):
            box = self.box(references[row])
            if box is not None and box[0] <= x <= box[2] and box[1] <= y <= box[3]:
                return row
        return None

    def put(self, row: int, reference: Reference) -> None:
        """Put another reference in the place of one, kept where a hand can reach it."""
        width, height = self.size()
        shape = self.shape(reference.path) or (1, 1)
        wide = min(max(reference.width, NARROWEST), WIDEST)
        tall = wide * width * shape[0] / shape[1] / height
        kept = reference.replace(
            width=wide, x=min(max(reference.x, INSIDE - wide), 1.0 - INSIDE),
            y=min(max(reference.y, INSIDE - tall), 1.0 - INSIDE))
        view = self.desk.workspace.view
        references = (*view.references[:row], kept, *view.references[row + 1:])
        self.desk.set_workspace(view=view.replace(references=references))

    def wheel(self, notches: float, x: float, y: float) -> bool:
        """Make the picture under a pixel larger or smaller about it; False when there is none."""
        row = self.at(x, y)
        if row is None:
            return False
        (width, height), old = self.size(), self.desk.workspace.view.references[row]
        wide = min(max(old.width * NOTCH**notches, NARROWEST), WIDEST)
        more = wide / old.width
        self.put(row, old.replace(
            width=wide, x=x / width + more * (old.x - x / width), y=y / height + more * (old.y - y / height)))
        return True


class PictureDrag:
    """A pinned picture in the hand, from press to release."""

    def __init__(self, pictures: PinnedPictures, row: int, x: float, y: float, ratio: float) -> None:
        self._pictures, self._row = pictures, row
        self._start = self._next = (x, y)
        self._before = pictures.desk.workspace.view.references[row]
        box = pictures.box(self._before)
        assert box is not None
        near = min(CORNER * ratio, 0.4 * (box[2] - box[0]), 0.4 * (box[3] - box[1]))
        self.scales = box[2] - x < near and box[3] - y < near

    def move(self, x: float, y: float) -> None:
        """The hand is there now."""
        self._next = (x, y)

    def frame(self) -> None:
        """Follow the hand."""
        if self._row >= len(self._pictures.desk.workspace.view.references):  # taken out of the view meanwhile
            return
        width, height = self._pictures.size()
        across, down = (self._next[0] - self._start[0]) / width, (self._next[1] - self._start[1]) / height
        old = self._before
        moved = old.replace(width=max(old.width + across, NARROWEST)) if self.scales else old.replace(
            x=old.x + across, y=old.y + down)
        self._pictures.put(self._row, moved)

    def end(self) -> None:
        """It stays there."""
        self.frame()

    def cancel(self) -> None:
        """It goes back to where it was."""
        self._next = self._start
        self.frame()

    def overlays(self) -> Overlays:
        """A frame about the picture in the hand."""
        references = self._pictures.desk.workspace.view.references
        box = self._pictures.box(references[self._row]) if self._row < len(references) else None
        if box is None:
            return ()
        left, top, right, bottom = box
        corners = np.array([(left, top), (right, top), (right, bottom), (left, bottom)])
        return (Polyline(corners, "accent", closed=True),)
