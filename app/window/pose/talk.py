"""Who disturbs whom: a table of how far each sculpt moves the surface at the poses of the others."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QMouseEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QSizePolicy, QToolTip, QWidget

from app.window.theme import look_of
from core.transform import Array

LEAST = 1e-6  # metres: what is less is rounding
TALL, WIDE = 22.0, 76.0  # most of a cell, pixels


class TalkTable(QWidget):
    """Rows are poses, columns the sculpts that are felt there. picked : the pose of the row that was clicked."""

    picked = Signal(str)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.names: tuple[str, ...] = ()
        self.table: Array = np.zeros((0, 0))
        self.words = ""
        self._under: tuple[int, int] | None = None
        self.setMouseTracking(True)
        self.setMinimumSize(140, 90)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setAccessibleName("Cross-talk of sculpts")

    def sizeHint(self) -> QSize:
        return QSize(320, 150)

    def show_table(self, names: tuple[str, ...], table: Array) -> None:
        """Show metres (N, N): entry (i, j) is how far the sculpt j moves the surface at the pose i."""
        self.names, self.table, self.words, self._under = names, table, "", None
        self.update()

    def show_words(self, words: str) -> None:
        """A sentence in the place of the table."""
        self.names, self.table, self.words = (), np.zeros((0, 0)), words
        self.update()

    def cell(self, row: int, column: int) -> QRectF:
        """Where an entry is; column -1 has the names of the rows, row -1 the numbers of the columns."""
        look, count = look_of(), max(len(self.names), 1)
        metrics, area = self.fontMetrics(), QRectF(self.rect()).adjusted(8, 6, -8, -(look.small + 8))
        names = min(max((metrics.horizontalAdvance(f"{k + 1} {n}") for k, n in enumerate(self.names)), default=0) + 10,
                    0.4 * area.width())
        tall = min(area.height() / (count + 1), TALL)
        wide = min((area.width() - names) / count, WIDE)
        left = area.left() + (names + column * wide if column >= 0 else 0.0)
        return QRectF(left, area.top() + (row + 1) * tall, wide if column >= 0 else names, tall)

    def said(self, row: int, column: int) -> str:
        """An entry in words."""
        pose, sculpt, metres = self.names[row], self.names[column], float(self.table[row, column])
        if row == column:
            return f"{pose}: click to hold this pose."
        if metres < LEAST:
            return f"{sculpt} is silent at the pose {pose}."
        return f"At the pose {pose} the sculpt {sculpt} moves the surface by {_length(metres)}. Click to hold it."

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        self._under = self._at(event.position())
        self.setCursor(Qt.CursorShape.ArrowCursor if self._under is None else Qt.CursorShape.PointingHandCursor)
        self.update()

    def leaveEvent(self, event: QEvent) -> None:
        self._under = None
        self.update()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        found = self._at(event.position())
        if found is not None and event.button() == Qt.MouseButton.LeftButton:
            self.picked.emit(self.names[found[0]])

    def event(self, event: QEvent) -> bool:
        if event.type() == QEvent.Type.ToolTip:
            found = self._at(QPointF(event.pos()))  # type: ignore[attr-defined]
            words = "Rows are poses, columns the sculpts that are felt there though they were made elsewhere."
            if found is not None:
                words = self.said(found[0], max(found[1], 0) if found[1] >= 0 else found[0])
            QToolTip.showText(event.globalPos(), words, self)  # type: ignore[attr-defined]
            return True
        return super().event(event)

    def paintEvent(self, event: QPaintEvent) -> None:
        look, painter = look_of(), QPainter(self)
        theme = look.theme
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(theme.colour("field"))
        painter.drawRoundedRect(QRectF(self.rect()), 5.0, 5.0)
        middle = Qt.AlignmentFlag.AlignCenter
        if not self.names:
            painter.setPen(theme.colour("dim"))
            painter.drawText(QRectF(self.rect()).adjusted(12, 8, -12, -8),
                             int(middle | Qt.TextFlag.TextWordWrap), self.words)
            return
        most = max(float(self.table.max(initial=0.0)), LEAST)
        metrics = painter.fontMetrics()
        for i, name in enumerate(self.names):
            lit = self._under is not None and i in (self._under[0], self._under[1])
            painter.setPen(theme.colour("text" if lit else "dim"))
            painter.drawText(self.cell(-1, i), middle, str(i + 1))
            box = self.cell(i, -1)
            painter.drawText(box, Qt.AlignmentFlag.AlignVCenter, metrics.elidedText(
                f"{i + 1} {name}", Qt.TextElideMode.ElideRight, round(box.width() - 6)))
            for j in range(len(self.names)):
                self._draw_cell(painter, i, j, most)
        painter.setPen(theme.colour("dim"))
        below = QRectF(self.rect()).adjusted(8, 0, -8, -4)
        told = f"at the pose of the row the sculpt of the column moves up to {_length(most)}" if most > LEAST else \
            "no sculpt is felt at the pose of another"
        painter.drawText(below, Qt.AlignmentFlag.AlignBottom | Qt.AlignmentFlag.AlignLeft,
                         metrics.elidedText(told, Qt.TextElideMode.ElideRight, round(below.width())))

    def _draw_cell(self, painter: QPainter, i: int, j: int, most: float) -> None:
        theme, box = look_of().theme, self.cell(i, j).adjusted(1, 1, -1, -1)
        metres, own = float(self.table[i, j]), i == j
        share = min(metres / most, 1.0) if metres >= LEAST else 0.0
        painter.setPen(QPen(theme.colour("accent"), 1.5) if self._under == (i, j) else Qt.PenStyle.NoPen)
        painter.setBrush(theme.colour("fill", 0.4) if own else theme.colour("trouble", 0.12 + 0.78 * share)
                         if share > 0.0 else theme.colour("panel"))
        painter.drawRoundedRect(box, 3.0, 3.0)
        words = "own" if own else _length(metres) if share > 0.0 else "0"
        if painter.fontMetrics().horizontalAdvance(words) <= box.width() - 4:
            painter.setPen(theme.colour("text" if share > 0.0 else "dim"))
            painter.drawText(box, Qt.AlignmentFlag.AlignCenter, words)

    def _at(self, place: QPointF) -> tuple[int, int] | None:
        """The row and column at a place, column -1 on a name."""
        for i in range(len(self.names)):
            for j in range(-1, len(self.names)):
                if self.cell(i, j).contains(place):
                    return i, j
        return None


def _length(metres: float) -> str:
    for unit, scale in (("m", 1.0), ("cm", 1e-2), ("mm", 1e-3)):
        if metres >= scale:
            return f"{metres / scale:.2g} {unit}"
    return f"{metres * 1e6:.2g} µm"
