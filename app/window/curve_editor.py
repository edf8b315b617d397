"""A small editor of a keyed curve: keys and their handles are dragged over a grid of frames and values."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import (
    QContextMenuEvent,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QPolygonF,
    QWheelEvent,
)
from PySide6.QtWidgets import QMenu, QSizePolicy, QWidget

from app.window.number_text import Scale, shown
from app.window.theme import Look, look_of, text_font
from core.curve import Curve, Tangent, curve_at
from core.curve_edit import handle_of, moved_keys, with_handle, with_key, with_tangents, without_keys
from core.errors import UserError

REACH = 7.0  # pixels within which a key or handle is caught
TANGENTS: tuple[Tangent, ...] = ("smooth", "linear", "step", "free")
Side = Literal["arrive", "leave"]
_SIDES: tuple[Side, ...] = ("arrive", "leave")
_PLAIN = Scale("", 1.0, 2)


class CurveEditor(QWidget):
    """Drag keys (Ctrl: whole frames, Shift: one direction) and handles (Alt breaks them); double click sets a key,
    Delete takes it away; wheel and middle button move about; F or Home shows what is selected or all.

    edited : (Curve, final). Esc gives the very curve there was before.
    """

    edited = Signal(object, bool)

    def __init__(
        self, curve: Curve, scale: Scale = _PLAIN, frame: float | None = None, parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._curve, self._scale, self._frame = curve, scale, frame
        self.selected: frozenset[int] = frozenset()
        self._start: Curve | None = None
        self._start_selected = self.selected
        self._grab: tuple[str, int] | None = None
        self._from = QPointF()
        self._pan: QPointF | None = None
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setAccessibleName("Curve")
        self.setToolTip("Drag keys and handles; double-click sets a key, Delete takes it away, "
                        "the right button turns tangents, F shows all of it.")
        self.show_all()

    @property
    def editing(self) -> bool:
        """True while something is dragged."""
        return self._start is not None

    def curve(self) -> Curve:
        """The curve shown."""
        return self._curve

    def set_curve(self, curve: Curve) -> None:
        """Show a curve from outside; while a hand drags the hand's stays."""
        if curve is not self._curve and not self.editing:
            self._curve = curve
            self.selected = frozenset(i for i in self.selected if i < len(curve.keys))
            self.update()

    def set_frame(self, frame: float) -> None:
        """Show where the time is."""
        self._frame = frame
        self.update()

    def show_all(self, places: frozenset[int] = frozenset()) -> None:
        """Fit some keys (all when none are given) into the view."""
        keys = [self._curve.keys[i] for i in sorted(places)] or list(self._curve.keys)
        frames = [key.frame for key in keys]
        first, last = min(frames), max(frames)
        if last - first < 1e-3:
            first, last = first - 10.0, last + 10.0
        values = np.concatenate([curve_at(self._curve, np.linspace(first, last, 64)), [key.value for key in keys]])
        low, high = float(values.min()), float(values.max())
        if high - low < 1e-9 * max(1.0, abs(high)):
            reach = max(abs(high) * 0.5, 0.5 * self._scale.factor)
            low, high = low - reach, high + reach
        over, up = 0.08 * (last - first), 0.15 * (high - low)
        self._view = (first - over, last + over, low - up, high + up)
        self.update()

    def place_of(self, frame: float, value: float) -> QPointF:
        """Where a frame and value are on the widget, in pixels."""
        first, last, low, high = self._view
        area = self._area()
        return QPointF(area.left() + (frame - first) / (last - first) * area.width(),
                       area.bottom() - (value - low) / (high - low) * area.height())

    def at(self, point: QPointF) -> tuple[float, float]:
        """Frame and value under a point of the widget."""
        first, last, low, high = self._view
        area = self._area()
        return (first + (point.x() - area.left()) / area.width() * (last - first),
                low + (area.bottom() - point.y()) / area.height() * (high - low))

    def handle_place(self, place: int, side: Side) -> QPointF:
        """Where the end of a handle is on the widget."""
        key = self._curve.keys[place]
        frames, value = handle_of(self._curve, place, side)
        return self.place_of(key.frame + frames, key.value + value)

    def sizeHint(self) -> QSize:
        look = look_of()
        return QSize(look.text * 20, look.row * 6)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        point = event.position()
        if event.button() == Qt.MouseButton.MiddleButton:
            self._pan = point
        elif event.button() == Qt.MouseButton.LeftButton:
            self._grab = self._under(point)
            if self._grab is None:
                self.selected = frozenset()
            elif self._grab[0] == "key":
                one = frozenset({self._grab[1]})
                shift = bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier)
                if shift:
                    self.selected = self.selected | one
                elif not one <= self.selected:
                    self.selected = one
            if self._grab is not None:
                self._start, self._start_selected, self._from = self._curve, self.selected, point
            self.update()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        point = event.position()
        if self._pan is not None:
            (f0, v0), (f1, v1) = self.at(self._pan), self.at(point)
            first, last, low, high = self._view
            self._view = (first + f0 - f1, last + f0 - f1, low + v0 - v1, high + v0 - v1)
            self._pan = point
            self.update()
        elif self._grab is not None and self._start is not None:
            self._drag(self._start, *self._grab, point, event.modifiers())

    def _drag(self, start: Curve, kind: str, place: int, point: QPointF, held: Qt.KeyboardModifier) -> None:
        key = start.keys[place]
        frame, value = self.at(point)
        if kind == "key":
            frame0, value0 = self.at(self._from)
            way = point - self._from
            frames, rise = frame - frame0, value - value0
            if held & Qt.KeyboardModifier.ShiftModifier:
                frames, rise = (frames, 0.0) if abs(way.x()) >= abs(way.y()) else (0.0, rise)
            if held & Qt.KeyboardModifier.ControlModifier:
                frames = round(key.frame + frames) - key.frame
            try:
                self._curve, self.selected = moved_keys(start, self._start_selected, frames, rise)
            except UserError:
                return  # on top of another key; it goes on when the hand does
        else:
            side: Side = "arrive" if kind == "arrive" else "leave"
            broken = bool(held & Qt.KeyboardModifier.AltModifier)
            self._curve = with_handle(start, place, side, (frame - key.frame, value - key.value), broken)
        self.update()
        self.edited.emit(self._curve, False)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.MiddleButton:
            self._pan = None
        elif self._start is not None:
            start, self._start, self._grab = self._start, None, None
            if self._curve is not start:
                self.edited.emit(self._curve, True)

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton and self._under(event.position()) is None:
            frame, value = self.at(event.position())
            made = with_key(self._curve, float(round(frame)), value)
            self._commit(made)
            self.selected = frozenset(i for i, key in enumerate(made.keys) if key.frame == float(round(frame)))

    def wheelEvent(self, event: QWheelEvent) -> None:
        if not self.hasFocus():
            event.ignore()  # the panel scrolls
            return
        scale = 0.85 ** (event.angleDelta().y() / 120.0)
        frame, value = self.at(event.position())
        first, last, low, high = self._view
        if 1e-3 < (last - first) * scale < 1e7:
            self._view = (frame + (first - frame) * scale, frame + (last - frame) * scale,
                          value + (low - value) * scale, value + (high - value) * scale)
            self.update()

    def event(self, event: QEvent) -> bool:
        if event.type() == QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent) and event.key() in (
            Qt.Key.Key_Delete, Qt.Key.Key_Backspace, Qt.Key.Key_F, Qt.Key.Key_Home, Qt.Key.Key_Escape,
        ):
            event.accept()
            return True
        return super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        key = event.key()
        if key in (Qt.Key.Key_Delete, Qt.Key.Key_Backspace):
            self.delete_selected()
        elif key == Qt.Key.Key_F:
            self.show_all(self.selected)
        elif key == Qt.Key.Key_Home:
            self.show_all()
        elif key == Qt.Key.Key_Escape and self._start is not None:
            start, self._start, self._grab = self._start, None, None
            changed = self._curve is not start
            self._curve, self.selected = start, self._start_selected
            self.update()
            if changed:
                self.edited.emit(start, True)
        else:
            super().keyPressEvent(event)

    def delete_selected(self) -> None:
        """Take the selected keys away; one always stays."""
        left = without_keys(self._curve, self.selected)
        if self.selected and left is not None:
            self.selected = frozenset()
            self._commit(left)

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        menu = QMenu(self)
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        places = self.selected or frozenset(range(len(self._curve.keys)))
        for kind in TANGENTS:
            action = menu.addAction(f"{kind.capitalize()} tangents")
            action.triggered.connect(lambda _=False, wanted=kind: self._commit(
                with_tangents(self._curve, places, wanted)))
        menu.addSeparator()
        delete = menu.addAction("Delete keys")
        delete.setEnabled(0 < len(self.selected) < len(self._curve.keys))
        delete.triggered.connect(self.delete_selected)
        menu.addAction("Show all").triggered.connect(lambda: self.show_all())
        menu.popup(event.globalPos())

    def _commit(self, curve: Curve) -> None:
        self._curve = curve
        self.update()
        self.edited.emit(curve, True)

    def _under(self, point: QPointF) -> tuple[str, int] | None:
        """What is caught at a point: ("key" or a side of its handles, its place)."""
        found: list[tuple[float, str, int]] = []
        for i in self.selected:
            found += [(_distance(self.handle_place(i, side), point), side, i) for side in _SIDES]
        found += [(_distance(self.place_of(k.frame, k.value), point) - 2.0, "key", i)
                  for i, k in enumerate(self._curve.keys)]
        distance, kind, place = min(found)
        return (kind, place) if distance <= REACH else None

    def _area(self) -> QRectF:
        look = look_of()
        return QRectF(self.rect()).adjusted(1, 1, -1, -1.0 - look.small - 4)

    def paintEvent(self, event: QPaintEvent) -> None:
        look = look_of()
        theme = look.theme
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(theme.colour("accent" if self.hasFocus() else "line"))
        painter.setBrush(theme.colour("field"))
        painter.drawRoundedRect(QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5), 4.5, 4.5)
        self._paint_grid(painter, look)
        painter.setClipRect(self.rect().adjusted(1, 1, -1, -1))
        first, last, _, _ = self._view
        frames = np.linspace(first, last, max(int(self.width()), 2))
        points = [self.place_of(float(f), float(v)) for f, v in zip(frames, curve_at(self._curve, frames), strict=True)]
        painter.setPen(QPen(theme.colour("text"), 1.5))
        painter.drawPolyline(QPolygonF(points))
        if self._frame is not None:
            x = self.place_of(self._frame, 0.0).x()
            painter.setPen(QPen(theme.colour("accent"), 1.0))
            painter.drawLine(QPointF(x, 1), QPointF(x, self.height() - 1))
        for i, key in enumerate(self._curve.keys):
            centre = self.place_of(key.frame, key.value)
            if i in self.selected:
                painter.setPen(QPen(theme.colour("dim"), 1.0))
                painter.setBrush(theme.colour("field"))
                for side in _SIDES:
                    end = self.handle_place(i, side)
                    painter.drawLine(centre, end)
                    painter.drawEllipse(end, 3.0, 3.0)
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(theme.colour("accent" if i in self.selected else "text"))
            painter.drawPolygon(QPolygonF([centre + QPointF(*d) for d in ((0, -4.5), (4.5, 0), (0, 4.5), (-4.5, 0))]))

    def _paint_grid(self, painter: QPainter, look: Look) -> None:
        first, last, low, high = self._view
        area = self._area()
        painter.setFont(text_font(look, look.small))
        line, words = look.theme.colour("line", 0.6), look.theme.colour("dim")
        for frame in _ticks(first, last, area.width() / 56.0, 1.0):
            x = self.place_of(frame, low).x()
            painter.setPen(line)
            painter.drawLine(QPointF(x, area.top()), QPointF(x, area.bottom()))
            if not 20.0 < x < self.width() - 20.0:
                continue  # its number would be cut off
            painter.setPen(words)
            painter.drawText(QRectF(x - 30, area.bottom(), 60, look.small + 4), Qt.AlignmentFlag.AlignCenter,
                             f"{frame:g}")
        factor = self._scale.factor
        for value in _ticks(low / factor, high / factor, area.height() / 36.0, 0.0):
            y = self.place_of(first, value * factor).y()
            painter.setPen(line)
            painter.drawLine(QPointF(area.left(), y), QPointF(area.right(), y))
            if y < area.top() + look.small + 2:
                continue
            painter.setPen(words)
            painter.drawText(QPointF(area.left() + 4, y - 2), shown(value * factor, self._scale, unit=False))


def _ticks(low: float, high: float, most: float, least_step: float) -> list[float]:
    """Round numbers between two, at most about so many, 1, 2 or 5 times a power of ten apart."""
    rough = max((high - low) / max(most, 1.0), 1e-12)
    power = 10.0 ** math.floor(math.log10(rough))
    step = max(next(power * m for m in (1.0, 2.0, 5.0, 10.0) if power * m >= rough * (1 - 1e-9)), least_step)
    return [i * step for i in range(math.ceil(low / step), math.floor(high / step) + 1)]


def _distance(a: QPointF, b: QPointF) -> float:
    return math.hypot(a.x() - b.x(), a.y() - b.y())
