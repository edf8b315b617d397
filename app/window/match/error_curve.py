"""The error of a solve over its frames: a curve in the panel; a press goes to the frame."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QMouseEvent, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.window.theme import look_of, text_font
from core.match.solved import SolvedCamera

HEIGHT = 5  # texts
FAR_OFF = 1.5  # of the middle error: such frames are marked


class ErrorCurve(QWidget):
    """RMS of every solved frame, in pixels from zero; frames far above the middle in the colour of trouble.

    chosen : (frame as the files of the plate count) under a press or a drag.
    """

    chosen = Signal(int)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._solved: SolvedCamera | None = None
        self._frame = 0
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setAccessibleName("Error of frames")
        self.setToolTip("How far the points are off on every frame, RMS in pixels. A click goes to the frame.")

    def show_solve(self, solved: SolvedCamera | None, frame: int) -> None:
        """Show the errors of a solve, with a line at a frame."""
        if solved is not self._solved or frame != self._frame:
            self._solved, self._frame = solved, frame
            self.update()

    def sizeHint(self) -> QSize:
        look = look_of()
        return QSize(20 * look.text, HEIGHT * look.text)

    def frame_at(self, x: float) -> int:
        """The solved frame nearest to a pixel across."""
        assert self._solved is not None
        frames = self._solved.frames
        return int(frames[np.argmin(np.abs(self._across(frames) - x))])

    def mousePressEvent(self, event: QMouseEvent) -> None:
        self._choose(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        self._choose(event)

    def paintEvent(self, event: QPaintEvent) -> None:
        solved, look = self._solved, look_of()
        if solved is None:
            return
        theme = look.theme
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        ground = QRectF(self.rect())
        painter.fillRect(ground, theme.colour("field"))
        top = float(solved.by_frame.max()) or 1.0
        inner = ground.height() - look.small - look.grid
        across, down = self._across(solved.frames), ground.bottom() - inner * solved.by_frame / top
        painter.setPen(QPen(theme.colour("hover"), 1.0))
        now = float(self._across(np.array([self._frame]))[0])
        painter.drawLine(QPointF(now, ground.top()), QPointF(now, ground.bottom()))
        painter.setPen(QPen(theme.colour("accent"), 1.5))
        painter.drawPolyline(QPolygonF([QPointF(x, y) for x, y in zip(across.tolist(), down.tolist(), strict=True)]))
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(theme.colour("trouble"))
        for row in np.flatnonzero(solved.by_frame > FAR_OFF * np.median(solved.by_frame)):
            painter.drawEllipse(QPointF(float(across[row]), float(down[row])), 2.5, 2.5)
        painter.setPen(theme.colour("dim"))
        painter.setFont(text_font(look, look.small))
        room = ground.adjusted(look.grid, 0, -look.grid, 0)
        worst = int(solved.frames[np.argmax(solved.by_frame)])
        painter.drawText(room, Qt.AlignmentFlag.AlignTop | Qt.AlignmentFlag.AlignLeft, "RMS of frames")
        painter.drawText(room, Qt.AlignmentFlag.AlignTop | Qt.AlignmentFlag.AlignRight,
                         f"most {top:.2f} px on frame {worst}")
        painter.end()

    def _choose(self, event: QMouseEvent) -> None:
        if self._solved is not None and event.buttons() & Qt.MouseButton.LeftButton:
            self.chosen.emit(self.frame_at(event.position().x()))

    def _across(self, frames: np.ndarray) -> np.ndarray:
        assert self._solved is not None
        first, last = int(self._solved.frames[0]), int(self._solved.frames[-1])
        edge = float(look_of().grid)
        return np.asarray(edge + (self.width() - 2.0 * edge) * (frames - first) / max(1, last - first))
