"""A pad for two dials at once: their range as a field, sculpts as dots on it, the pose as a dot in the hand."""

from __future__ import annotations

import math

import numpy as np
from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QMouseEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QSizePolicy, QToolTip, QWidget

from app.window.theme import look_of
from core.pose.pose import Pose
from core.pose.rig import Control

NEAR = 10.0  # pixels within which a dot is meant


class DialPad(QWidget):
    """Two dials. moved : (x, y, final), in their units. Ctrl holds the other dial where it is."""

    moved = Signal(float, float, bool)

    def __init__(self, across: Control, up: Control, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.across, self.up = across, up
        self.at = across.rest, up.rest
        self.poses: tuple[Pose, ...] = ()
        self._dragged: tuple[float, float] | None = None  # where the drag began
        self.setMouseTracking(True)
        self.setCursor(Qt.CursorShape.CrossCursor)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.setAccessibleName(f"Pad of {across.name} and {up.name}")

    def sizeHint(self) -> QSize:
        return QSize(200, 14 * look_of().text)

    @property
    def dragging(self) -> bool:
        """True while the dot is in the hand."""
        return self._dragged is not None

    def show_pose(self, pose: Pose, poses: tuple[Pose, ...]) -> None:
        """Put the dot where a pose is, and small ones where sculpts are."""
        self.at, self.poses = self._of(pose), poses
        self.update()

    @property
    def area(self) -> QRectF:
        """Where the range of both dials is."""
        small = look_of().small
        return QRectF(self.rect()).adjusted(10, 8, -10, -(small + 8))

    def to_pixel(self, x: float, y: float) -> QPointF:
        """Where two values are."""
        area, (u, v) = self.area, (_share(self.across, x), _share(self.up, y))
        return QPointF(area.left() + u * area.width(), area.bottom() - v * area.height())

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton:
            self._dragged = self.at
            self._move(event, False)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self._dragged is not None:
            self._move(event, False)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        if self._dragged is not None and event.button() == Qt.MouseButton.LeftButton:
            self._move(event, True)

    def event(self, event: QEvent) -> bool:
        if event.type() == QEvent.Type.ToolTip:
            near = self._near(QPointF(event.pos()))  # type: ignore[attr-defined]
            words = f"{self.across.name} goes to the right, {self.up.name} up. Drag the dot; Ctrl keeps one dial " \
                "where it is. Dots are sculpts: a click there is just that pose."
            QToolTip.showText(event.globalPos(), near.name if near else words, self)  # type: ignore[attr-defined]
            return True
        return super().event(event)

    def paintEvent(self, event: QPaintEvent) -> None:
        look, painter = look_of(), QPainter(self)
        theme, area = look.theme, self.area
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(theme.colour("field"))
        painter.drawRoundedRect(QRectF(self.rect()), 5.0, 5.0)
        rest = self.to_pixel(self.across.rest, self.up.rest)
        painter.setPen(QPen(theme.colour("line"), 1.0))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawRect(area)
        painter.drawLine(QPointF(rest.x(), area.top()), QPointF(rest.x(), area.bottom()))
        painter.drawLine(QPointF(area.left(), rest.y()), QPointF(area.right(), rest.y()))
        font = painter.font()
        font.setPixelSize(look.small)
        painter.setFont(font)
        metrics = painter.fontMetrics()
        for pose in self.poses:
            place = self.to_pixel(*self._of(pose))
            painter.setPen(QPen(theme.colour("ground"), 1.0))
            painter.setBrush(theme.colour("text"))
            painter.drawEllipse(place, 3.5, 3.5)
            wide = metrics.horizontalAdvance(pose.name)
            left = place.x() + 7 if place.x() + 9 + wide < area.right() else place.x() - 7 - wide
            painter.setPen(theme.colour("dim"))
            painter.drawText(QPointF(left, min(max(place.y() + 4, area.top() + look.small), area.bottom() - 3)),
                             pose.name)
        dot = self.to_pixel(*self.at)
        painter.setPen(QPen(theme.colour("text"), 1.5))
        painter.setBrush(theme.colour("accent"))
        painter.drawEllipse(dot, 6.0, 6.0)
        painter.setPen(theme.colour("dim"))
        below = QRectF(area.left(), area.bottom() + 3, area.width(), look.small + 4)
        painter.drawText(below, Qt.AlignmentFlag.AlignLeft, f"→ {self.across.name} {self.at[0]:.2f}")
        painter.drawText(below, Qt.AlignmentFlag.AlignRight, f"↑ {self.up.name} {self.at[1]:.2f}")

    def _of(self, pose: Pose) -> tuple[float, float]:
        return (float(pose.numbers.get(self.across.name, self.across.rest)),
                float(pose.numbers.get(self.up.name, self.up.rest)))

    def _near(self, place: QPointF) -> Pose | None:
        """The sculpt whose dot is meant by a place."""
        gaps = [math.hypot((p := self.to_pixel(*self._of(pose))).x() - place.x(), p.y() - place.y())
                for pose in self.poses]
        return self.poses[int(np.argmin(gaps))] if gaps and min(gaps) < NEAR else None

    def _move(self, event: QMouseEvent, final: bool) -> None:
        assert self._dragged is not None
        area, place = self.area, event.position()
        near = self._near(place)
        if near is not None:
            x, y = self._of(near)
        else:
            x = _value(self.across, (place.x() - area.left()) / max(area.width(), 1.0))
            y = _value(self.up, (area.bottom() - place.y()) / max(area.height(), 1.0))
        if event.modifiers() & Qt.KeyboardModifier.ControlModifier:  # along the way the hand went most
            start, along = self.to_pixel(*self._dragged), self.to_pixel(x, y)
            if abs(along.x() - start.x()) >= abs(along.y() - start.y()):
                y = self._dragged[1]
            else:
                x = self._dragged[0]
        self.at = x, y
        if final:
            self._dragged = None
        self.update()
        self.moved.emit(x, y, final)


def _share(control: Control, value: float) -> float:
    return min(max((value - control.low) / max(control.high - control.low, 1e-12), 0.0), 1.0)


def _value(control: Control, share: float) -> float:
    return control.low + min(max(share, 0.0), 1.0) * (control.high - control.low)
