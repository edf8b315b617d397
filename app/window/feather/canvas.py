"""The flat feather: its picture, its outline, and lines drawn by hand over it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QImage, QKeyEvent, QMouseEvent, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QWidget

from app.window.theme import look_of

LOW, HIGH = -0.06, 1.12  # of the shaft, at least seen
REACH = 0.3  # to each side of it
APART = 2.0  # pixels between two points of a drawn line


class FlatFeather(NamedTuple):
    """A feather laid flat, in shaft lengths: across and along.

    picture : (H, W, 4) uint8 sRGB with opacity, row 0 at the skin, over `extent` from `corner`. outlines : of left and
    right side, (N, 2), away from the shaft and along it.
    """

    picture: NDArray[np.uint8]
    corner: tuple[float, float]
    extent: tuple[float, float]
    outlines: tuple[NDArray[np.float64], NDArray[np.float64]]


class FlatCanvas(QWidget):
    """Shows a flat feather, root below; a line drawn by hand is handed on when the hand lets go.

    drawn : (side 0 left or 1 right, points (N, 2) in shaft lengths).
    """

    drawn = Signal(int, object)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.feather: FlatFeather | None = None
        self.other: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None
        self.words = ""
        self._image = QImage()
        self._line: list[QPointF] = []
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.setCursor(Qt.CursorShape.CrossCursor)
        self.setMinimumSize(120, 160)
        self.setAccessibleName("Flat feather")

    def sizeHint(self) -> QSize:
        return QSize(18 * look_of().text, 32 * look_of().text)

    def show_feather(self, feather: FlatFeather | None) -> None:
        """Show another feather, or none."""
        self.feather = feather
        if feather is not None:
            upright = np.ascontiguousarray(feather.picture[::-1])
            high, wide = upright.shape[:2]
            self._image = QImage(upright.tobytes(), wide, high, 4 * wide, QImage.Format.Format_RGBA8888).copy()
        self.update()

    def compare(self, outlines: tuple[NDArray[np.float64], NDArray[np.float64]] | None) -> None:
        """Show the outline of another feather over this one, or none."""
        self.other = outlines
        self.update()

    # -- places ------------------------------------------------------------------------------------------

    def _frame(self) -> tuple[float, float, float]:
        """Pixels of a shaft length, and where the root is."""
        reach, low, high = REACH, LOW, HIGH
        if self.feather is not None:
            (x, y), (w, h) = self.feather.corner, self.feather.extent
            reach, low, high = max(reach, -x, x + w), min(low, y), max(high, y + h)
        scale = max(min((self.width() - 16) / (2.0 * reach), (self.height() - 16) / (high - low)), 1.0)
        return scale, 0.5 * self.width(), 0.5 * self.height() + 0.5 * (low + high) * scale

    def at(self, across: float, along: float) -> QPointF:
        """The pixel of a place of the flat feather."""
        scale, x, y = self._frame()
        return QPointF(x + scale * across, y - scale * along)

    def place(self, point: QPointF) -> tuple[float, float]:
        """The place of the flat feather at a pixel."""
        scale, x, y = self._frame()
        return (point.x() - x) / scale, (y - point.y()) / scale

    # -- the hand ----------------------------------------------------------------------------------------

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton and self.feather is not None:
            self._line = [event.position()]
            self.update()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self._line and (event.position() - self._line[-1]).manhattanLength() >= APART:
            self._line.append(event.position())
            self.update()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        line, self._line = self._line, []
        self.update()
        if event.button() == Qt.MouseButton.LeftButton and len(line) > 2:
            points = np.array([self.place(point) for point in line])
            side = int(np.median(points[:, 0]) > 0.0)
            self.drawn.emit(side, points)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Escape and self._line:
            self._line = []
            self.update()
        else:
            super().keyPressEvent(event)

    # -- the picture -------------------------------------------------------------------------------------

    def paintEvent(self, event: QPaintEvent) -> None:
        look, painter = look_of(), QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        painter.fillRect(self.rect(), QColor(118, 118, 118))  # middle grey: colours of feathers are judged on it
        if self.feather is None:
            painter.setPen(QColor(24, 24, 24))
            painter.drawText(QRectF(self.rect()).adjusted(12, 12, -12, -12),
                             Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap, self.words)
            return
        (x, y), (w, h) = self.feather.corner, self.feather.extent
        painter.drawImage(QRectF(self.at(x, y + h), self.at(x + w, y)), self._image)
        if self.other is not None:
            self._outline(painter, self.other, QPen(QColor(240, 240, 240), 1.4, Qt.PenStyle.DashLine))
        self._outline(painter, self.feather.outlines, QPen(look.theme.colour("accent"), 1.4))
        if self._line:
            painter.setPen(QPen(QColor(255, 255, 255), 2.0))
            painter.drawPolyline(QPolygonF(self._line))

    def _outline(
        self, painter: QPainter, sides: tuple[NDArray[np.float64], NDArray[np.float64]], pen: QPen
    ) -> None:
        painter.setPen(pen)
        for side, line in enumerate(sides):
            sign = 2 * side - 1
            painter.drawPolyline(QPolygonF([self.at(sign * across, along) for across, along in line]))
