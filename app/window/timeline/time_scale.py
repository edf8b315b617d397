"""Where frames stand along the timeline."""

from __future__ import annotations

from PySide6.QtWidgets import QWidget

from app.window.desk import Desk
from app.window.theme import look_of


class TimeScale:
    """The frames of the document spread over the width of a widget; what stands below it uses the same."""

    def __init__(self, desk: Desk, widget: QWidget) -> None:
        self._desk, self._widget = desk, widget

    def extent(self) -> tuple[float, float]:
        """Where the first frame stands and how far from it the last, in pixels."""
        margin = 2.0 * look_of().text
        return margin, max(1.0, self._widget.width() - 2.0 * margin)

    def x_of(self, frame: float) -> float:
        """Where a frame stands, in pixels; frames outside the timeline lie outside the widget."""
        document = self._desk.document
        left, span = self.extent()
        return left + span * (frame - document.first_frame) / max(1, document.last_frame - document.first_frame)

    def frame_along(self, x: float) -> float:
        """The frame at a place, whole or not, inside the timeline or not."""
        document = self._desk.document
        left, span = self.extent()
        return document.first_frame + (x - left) / span * max(1, document.last_frame - document.first_frame)

    def frame_at(self, x: float) -> int:
        """The whole frame of the timeline nearest to a place."""
        document = self._desk.document
        frames = document.last_frame - document.first_frame
        left, span = self.extent()
        return document.first_frame + round(min(max((x - left) / span, 0.0), 1.0) * frames)

    def go(self, frame: float) -> None:
        """Go to a frame, or to the end of the timeline it lies beyond."""
        document = self._desk.document
        self._desk.set_workspace(frame=float(min(max(frame, document.first_frame), document.last_frame)))
