"""A small graph of lines: axes in words, names at the lines, marks where something breaks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.window.theme import look_of
from core.transform import Array

HUES = (36, 205, 130, 330, 265, 85, 180, 15)  # of lines, one after the other


class Line(NamedTuple):
    """A line: its name and its points x, y (N,)."""

    name: str
    x: Array
    y: Array


class Graph(QWidget):
    """Draws lines. pointed : the x of a place that was clicked."""

    pointed = Signal(float)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.lines: list[Line] = []
        self.marks: list[tuple[float, str]] = []
        self.words = self.across = self.up = ""
        self.at: float | None = None
        self._known: tuple[list[Line], tuple[float, float, float, float]] | None = None
        self.setMinimumSize(140, 90)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setAccessibleName("Graph")
        self.setToolTip("Weights over the frames of a clip, or the motion of a point on a way. Click goes there.")

    def sizeHint(self) -> QSize:
        return QSize(320, 150)

    def show_lines(
        self, lines: Sequence[Line], across: str, up: str, at: float | None = None,
        marks: Sequence[tuple[float, str]] = (),
    ) -> None:
        """Draw lines; `marks` are (x, word) of trouble."""
        self.lines, self.across, self.up, self.words = list(lines), across, up, ""
        self.at, self.marks = at, list(marks)
        self.update()

    def show_words(self, words: str) -> None:
        """A sentence in the place of lines."""
        self.lines, self.marks, self.words = [], [], words
        self.update()

    def mark(self, at: float) -> None:
        """Where the playhead is."""
        self.at = at
        self.update()

    @property
    def area(self) -> QRectF:
        """Where the lines are."""
        small = look_of().small
        return QRectF(self.rect()).adjusted(4 * small + 4, small + 6, -6, -(small + 8))

    def mousePressEvent(self, event: QMouseEvent) -> None:
        self._point(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if event.buttons() & Qt.MouseButton.LeftButton:
            self._point(event)

    def paintEvent(self, event: QPaintEvent) -> None:
        look, painter = look_of(), QPainter(self)
        theme = look.theme
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(theme.colour("field"))
        painter.drawRoundedRect(QRectF(self.rect()), 5.0, 5.0)
        font = painter.font()
        font.setPixelSize(look.small)
        painter.setFont(font)
        painter.setPen(theme.colour("dim"))
        if not self.lines:
            painter.drawText(QRectF(self.rect()).adjusted(12, 8, -12, -8),
                             int(Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap), self.words)
            return
        area, (low_x, high_x, low, high) = self.area, self._range()
        for value in (low, 0.5 * (low + high), high):
            y = self._pixel(low_x, value).y()
            painter.setPen(theme.colour("line"))
            painter.drawLine(QPointF(area.left(), y), QPointF(area.right(), y))
            painter.setPen(theme.colour("dim"))
            words = f"{value:.0f}" if abs(value) >= 10.0 else f"{value:.2g}"
            painter.drawText(QRectF(0, y - 8, area.left() - 4, 16),
                             Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter, words)
        below = QRectF(area.left(), area.bottom() + 2, area.width(), look.small + 5)
        painter.drawText(below, Qt.AlignmentFlag.AlignLeft, f"{round(low_x, 1):g}")
        painter.drawText(below, Qt.AlignmentFlag.AlignRight, f"{round(high_x, 1):g}")
        painter.drawText(below, Qt.AlignmentFlag.AlignHCenter, f"{self.up} / {self.across}")
        left = area.left()
        for k, line in enumerate(self.lines):
            painter.setPen(QPen(line_colour(k), 1.6))
            painter.drawPolyline(QPolygonF([self._pixel(x, y) for x, y in zip(line.x, line.y, strict=True)]))
            room = painter.fontMetrics().horizontalAdvance(line.name) + 10
            if left + room < area.right() + 10:
                painter.drawText(QPointF(left, look.small + 2), line.name)
            left += room
        for x, word in self.marks:
            top = self._pixel(x, high)
            painter.setPen(QPen(theme.colour("trouble"), 1.5, Qt.PenStyle.DashLine))
            painter.drawLine(top, self._pixel(x, low))
            painter.setPen(theme.colour("trouble_text"))
            painter.drawText(QPointF(top.x() + 4, top.y() + look.small), word)
        if self.at is not None and low_x <= self.at <= high_x:
            painter.setPen(QPen(theme.colour("accent"), 1.0))
            painter.drawLine(self._pixel(self.at, low), self._pixel(self.at, high))

    def _range(self) -> tuple[float, float, float, float]:
        if self._known is not None and self._known[0] is self.lines:
            return self._known[1]
        xs, ys = np.concatenate([line.x for line in self.lines]), np.concatenate([line.y for line in self.lines])
        low, high = min(float(ys.min()), 0.0), max(float(ys.max()), 1e-9)
        low = low if low < -1e-3 * high else 0.0  # rounding is no negative weight
        found = float(xs.min()), float(max(xs.max(), xs.min() + 1e-9)), low, high
        self._known = self.lines, found
        return found

    def _pixel(self, x: float, y: float) -> QPointF:
        area, (low_x, high_x, low, high) = self.area, self._range()
        return QPointF(area.left() + (x - low_x) / (high_x - low_x) * area.width(),
                       area.bottom() - (y - low) / (high - low) * area.height())

    def _point(self, event: QMouseEvent) -> None:
        if self.lines and self.area.width() > 0:
            low, high = self._range()[:2]
            part = (event.position().x() - self.area.left()) / self.area.width()
            self.pointed.emit(low + min(max(part, 0.0), 1.0) * (high - low))


def line_colour(k: int) -> QColor:
    """The colour of one of many lines, on the ground of the theme."""
    dark = look_of().theme.colour("panel").lightness() < 128
    return QColor.fromHsl(HUES[k % len(HUES)], 150, 165 if dark else 95)
