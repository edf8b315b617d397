"""Curves over a grid of frames and values, whose keys and handles a hand drags, alone or many at once."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import numpy as np
from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QKeyEvent, QMouseEvent, QPainter, QPaintEvent, QPen, QPolygonF, QWheelEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.window.fields.number_text import Scale, shown
from app.window.pose.graph import line_colour
from app.window.theme import Look, look_of, text_font
from core.curve import Curve, curve_at
from core.curve_edit import handles_of, moved_keys, scaled_keys, set_keys, with_handle, with_key
from core.errors import UserError

REACH = 7.0  # pixels within which a key or handle is caught
FAR = 1e7  # frames, the most that are shown
ROOM = 14.0  # pixels between the selected keys and the box around them
GRIP = 4.0  # pixels: half a side of what the box is pulled by
STILL = 3.0  # pixels a press may wander and still be a click
PLAIN = Scale("", 1.0, 2)
Side = Literal["arrive", "leave"]
SIDES: tuple[Side, ...] = ("arrive", "leave")
EDGES = ("left", "right", "top", "bottom")
Selected = dict[str, frozenset[int]]


class Shown(NamedTuple):
    """A curve in the view: at the height (value - offset) / size, in one of the colours of lines (None: of text)."""

    curve: Curve
    colour: int | None = None
    offset: float = 0.0
    size: float = 1.0


class Grab(NamedTuple):
    """What a press caught: a key or a side of its handles, by name of the curve and place, or an edge of the box."""

    kind: str
    name: str = ""
    place: int = 0


class CurveView(QWidget):
    """Drag keys (Ctrl: whole frames or not, Shift: one direction), handles (Alt breaks them), the box around several
    keys to scale them; a drag over nothing selects what is in it, a double click sets a key. Wheel and middle button
    move about.

    edited : (name of the step, {name: Curve}, final). Esc gives the very curves there were before.
    picked_changed : other keys are selected. scrubbed : the frame under a drag along the numbers below.
    """

    edited = Signal(str, object, bool)
    picked_changed = Signal()
    scrubbed = Signal(float)

    def __init__(self, scale: Scale = PLAIN, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._scale, self._frame = scale, 0.0
        self._shown: dict[str, Shown] = {}
        self.picked: Selected = {}
        self.snaps = False
        self.labels = True  # whether heights are numbers that mean something
        self.scrubs = False
        self._view = (0.0, 100.0, 0.0, 1.0)
        self._start: dict[str, Shown] | None = None
        self._start_picked: Selected = {}
        self._grab: Grab | None = None
        self._from, self._box = QPointF(), QRectF()
        self._band: QRectF | None = None
        self._pan: QPointF | None = None
        self._lines: dict[str, tuple[object, QPolygonF]] = {}
        self.setMouseTracking(True)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setAccessibleName("Curves")

    @property
    def editing(self) -> bool:
        """True while something is dragged."""
        return self._start is not None

    def curves(self) -> dict[str, Curve]:
        """The curves shown, by name."""
        return {name: one.curve for name, one in self._shown.items()}

    def set_shown(self, curves: dict[str, Shown]) -> None:
        """Show curves from outside; while a hand drags the hand's stay."""
        if self.editing:
            return
        self._shown = dict(curves)
        self.picked = {name: kept for name, places in self.picked.items() if name in curves and (
            kept := frozenset(i for i in places if i < len(curves[name].curve.keys)))}
        self.update()

    def pick(self, picked: Selected) -> None:
        """Select just these keys."""
        self.picked = {name: places for name, places in picked.items() if places and name in self._shown}
        self.update()

    def set_frame(self, frame: float) -> None:
        """Show where the time is."""
        if frame != self._frame:
            self._frame = frame
            self.update()

    def show_keys(self, only: Selected | None = None) -> None:
        """Fit some keys (all when none are given) into the view."""
        only = {name: places for name, places in (only or {}).items() if places} or {
            name: frozenset(range(len(one.curve.keys))) for name, one in self._shown.items()}
        if not only:
            return
        frames = [self._shown[name].curve.keys[i].frame for name, places in only.items() for i in places]
        first, last = min(frames), max(frames)
        if last - first < 1e-3:
            first, last = first - 10.0, last + 10.0
        heights = [np.zeros(0)]
        for name, places in only.items():
            one = self._shown[name]
            keys = [one.curve.keys[i].value for i in places]
            heights.append((np.concatenate([curve_at(one.curve, np.linspace(first, last, 64)), keys])
                            - one.offset) / one.size)
        values = np.concatenate(heights)
        low, high = float(values.min()), float(values.max())
        if high - low < 1e-9 * max(1.0, abs(high)):
            reach = max(abs(high) * 0.5, 0.5 * self._scale.factor)
            low, high = low - reach, high + reach
        over, up = 0.08 * (last - first), 0.15 * (high - low)
        self._view = (first - over, last + over, low - up, high + up)
        self.update()

    def place_of(self, frame: float, value: float, name: str = "") -> QPointF:
        """Where a frame and value of a curve are on the widget, in pixels."""
        first, last, low, high = self._view
        area = self.area()
        one = self._shown.get(name)
        height = value if one is None else (value - one.offset) / one.size
        return QPointF(area.left() + (frame - first) / (last - first) * area.width(),
                       area.bottom() - (height - low) / (high - low) * area.height())

    def at(self, point: QPointF, name: str = "") -> tuple[float, float]:
        """Frame and value of a curve under a point of the widget."""
        first, last, low, high = self._view
        area = self.area()
        height = low + (area.bottom() - point.y()) / area.height() * (high - low)
        one = self._shown.get(name)
        return (first + (point.x() - area.left()) / area.width() * (last - first),
                height if one is None else one.offset + height * one.size)

    def handle_place(self, place: int, side: Side, name: str = "") -> QPointF:
        """Where the end of a handle is on the widget."""
        return self._handle_ends(name)[SIDES.index(side)][place]

    def box(self) -> QRectF:
        """Around the selected keys, in pixels; empty when fewer than two are selected."""
        points = [self._key_place(name, i) for name, places in self.picked.items() for i in places]
        if len(points) < 2:
            return QRectF()
        left, right = min(p.x() for p in points), max(p.x() for p in points)
        top, bottom = min(p.y() for p in points), max(p.y() for p in points)
        return QRectF(left, top, right - left, bottom - top).adjusted(-ROOM, -ROOM, ROOM, ROOM)

    def area(self) -> QRectF:
        """Where the curves are; below it stand the numbers of frames."""
        return QRectF(self.rect()).adjusted(1, 1, -1, -1.0 - look_of().small - 4)

    def sizeHint(self) -> QSize:
        look = look_of()
        return QSize(look.text * 20, look.row * 6)

    # -- the hand --------------------------------------------------------------------------------------------

    def mousePressEvent(self, event: QMouseEvent) -> None:
        point = event.position()
        if event.button() == Qt.MouseButton.MiddleButton:
            self._pan = point
        elif event.button() == Qt.MouseButton.LeftButton:
            self._from = point
            if self.scrubs and point.y() > self.area().bottom():
                self._grab = Grab("scrub")
                self._scrub(point)
                return
            self._grab = self._under(point) or Grab("band")
            held = event.modifiers()
            if self._grab.kind == "key":
                self._press_key(self._grab, bool(held & Qt.KeyboardModifier.ShiftModifier))
            elif self._grab.kind == "band" and not held & Qt.KeyboardModifier.ShiftModifier:
                self._pick({})
            if self._grab.kind != "band":
                self._start, self._start_picked, self._box = dict(self._shown), dict(self.picked), self.box()
            self.update()

    def _press_key(self, grab: Grab, further: bool) -> None:
        places = self.picked.get(grab.name, frozenset())
        if further:
            self._pick({**self.picked, grab.name: places | {grab.place}})
        elif grab.place not in places:
            self._pick({grab.name: frozenset({grab.place})})

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        point = event.position()
        if self._pan is not None:
            self._slide(point - self._pan)
            self._pan = point
        elif self._grab is None:
            self._show_cursor(point)
        elif self._grab.kind == "scrub":
            self._scrub(point)
        elif self._grab.kind == "band":
            way = point - self._from
            if self._band is not None or math.hypot(way.x(), way.y()) > STILL:
                self._band = QRectF(self._from, point).normalized()
                self.update()
        elif self._start is not None:
            self._drag(self._start, self._grab, point, event.modifiers())

    def _drag(self, start: dict[str, Shown], grab: Grab, point: QPointF, held: Qt.KeyboardModifier) -> None:
        try:
            if grab.kind == "key":
                self._move(start, grab, point, held)
            elif grab.kind in EDGES:
                self._stretch(start, grab.kind, point, held)
            else:
                self._turn(start, grab, point, bool(held & Qt.KeyboardModifier.AltModifier))
        except UserError:
            return  # on top of another key; it goes on when the hand does
        self.update()
        self.edited.emit(self._step(grab), self._changed(start), False)

    def _move(self, start: dict[str, Shown], grab: Grab, point: QPointF, held: Qt.KeyboardModifier) -> None:
        key, way = start[grab.name].curve.keys[grab.place], point - self._from
        (frame0, value0), (frame, value) = self.at(self._from, grab.name), self.at(point, grab.name)
        frames, rise = frame - frame0, (value - value0) / start[grab.name].size
        if held & Qt.KeyboardModifier.ShiftModifier:
            frames, rise = (frames, 0.0) if abs(way.x()) >= abs(way.y()) else (0.0, rise)
        if self._snapping(held):
            frames = round(key.frame + frames) - key.frame if abs(way.x()) > STILL else 0.0
        self._put({name: moved_keys(start[name].curve, places, frames, rise * start[name].size)
                   for name, places in self._start_picked.items()})

    def _stretch(self, start: dict[str, Shown], edge: str, point: QPointF, held: Qt.KeyboardModifier) -> None:
        """Scale the selected keys; the opposite side of the box stays."""
        inner = self._box.adjusted(ROOM, ROOM, -ROOM, -ROOM)
        way = point - self._from
        pivot = QPointF(inner.right() if edge == "left" else inner.left(),
                        inner.top() if edge == "bottom" else inner.bottom())
        wide, tall = inner.width(), inner.height()
        slower = {"left": (wide - way.x()) / wide if wide else 1.0, "right": (wide + way.x()) / wide if wide else 1.0}
        higher = {"top": (tall - way.y()) / tall if tall else 1.0, "bottom": (tall + way.y()) / tall if tall else 1.0}
        made = {}
        for name, places in self._start_picked.items():
            curve, now = scaled_keys(
                start[name].curve, places, self.at(pivot, name), (slower.get(edge, 1.0), higher.get(edge, 1.0)))
            if self._snapping(held) and edge in slower:
                curve, now = _whole(curve, now)
            made[name] = curve, now
        self._put(made)

    def _turn(self, start: dict[str, Shown], grab: Grab, point: QPointF, broken: bool) -> None:
        key = start[grab.name].curve.keys[grab.place]
        frame, value = self.at(point, grab.name)
        side: Side = "arrive" if grab.kind == "arrive" else "leave"
        self._put({grab.name: (with_handle(
            start[grab.name].curve, grab.place, side, (frame - key.frame, value - key.value), broken),
            self._start_picked.get(grab.name, frozenset()))}, also=True)

    def _put(self, made: dict[str, tuple[Curve, frozenset[int]]], also: bool = False) -> None:
        assert self._start is not None
        self._shown = {**self._start, **{name: self._start[name]._replace(curve=curve)
                                         for name, (curve, _) in made.items()}}
        self.picked = {**(self.picked if also else {}), **{name: places for name, (_, places) in made.items()}}

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.MiddleButton:
            self._pan = None
            return
        grab, self._grab = self._grab, None
        if self._band is not None:
            band, self._band = self._band, None
            inside = {name: frozenset(i for i in range(len(one.curve.keys)) if band.contains(self._key_place(name, i)))
                      for name, one in self._shown.items()}
            self._pick({name: places | self.picked.get(name, frozenset()) for name, places in inside.items()})
        elif self._start is not None and grab is not None:
            start, self._start = self._start, None
            changed = self._changed(start)
            if changed:
                self.edited.emit(self._step(grab), changed, True)
        self.update()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        point = event.position()
        if event.button() != Qt.MouseButton.LeftButton or self._under(point) is not None or not self._shown:
            return
        name = min(self._shown, key=lambda one: abs(point.y() - self._curve_height(one, point)))
        frame, value = self.at(point, name)
        frame = float(round(frame))
        made = with_key(self._shown[name].curve, frame, value)
        self._shown = {**self._shown, name: self._shown[name]._replace(curve=made)}
        self._pick({name: frozenset(i for i, key in enumerate(made.keys) if key.frame == frame)})
        self.edited.emit("Insert keys", {name: made}, True)

    def wheelEvent(self, event: QWheelEvent) -> None:
        scale = 0.85 ** ((event.angleDelta().y() or event.angleDelta().x()) / 120.0)
        held = event.modifiers()
        wide = 1.0 if held & Qt.KeyboardModifier.ShiftModifier else scale
        tall = 1.0 if held & Qt.KeyboardModifier.ControlModifier else scale
        frame, height = self.at(event.position(), "\0")  # no curve: plain heights
        first, last, low, high = self._view
        if 1e-3 < (last - first) * wide < FAR and 1e-12 < (high - low) * tall < 1e12:
            self._view = (frame + (first - frame) * wide, frame + (last - frame) * wide,
                          height + (low - height) * tall, height + (high - height) * tall)
            self.update()
        event.accept()

    def event(self, event: QEvent) -> bool:
        if (event.type() == QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent)
                and event.key() == Qt.Key.Key_Escape and self._grab is not None):
            event.accept()
            return True
        return super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() != Qt.Key.Key_Escape or not self.give_up():
            super().keyPressEvent(event)

    def give_up(self) -> bool:
        """Put back what there was before the drag; False when nothing is dragged."""
        if self._start is None:
            banded, self._grab, self._band = self._band is not None, None, None
            self.update()
            return banded
        start, grab, self._start, self._grab = self._start, self._grab, None, None
        changed = self._changed(start)
        self._shown, self.picked = start, self._start_picked
        self.update()
        if changed and grab is not None:
            self.edited.emit(self._step(grab), {name: start[name].curve for name in changed}, True)
        return True

    def _pick(self, picked: Selected) -> None:
        self.pick(picked)
        self.picked_changed.emit()

    def _snapping(self, held: Qt.KeyboardModifier) -> bool:
        return self.snaps != bool(held & Qt.KeyboardModifier.ControlModifier)

    def _scrub(self, point: QPointF) -> None:
        self.scrubbed.emit(float(round(self.at(point)[0])))

    def _slide(self, way: QPointF) -> None:
        first, last, low, high = self._view
        area = self.area()
        frames, rise = way.x() / area.width() * (last - first), way.y() / area.height() * (high - low)
        self._view = (first - frames, last - frames, low + rise, high + rise)
        self.update()

    def _changed(self, start: dict[str, Shown]) -> dict[str, Curve]:
        return {name: one.curve for name, one in self._shown.items() if one.curve is not start[name].curve}

    @staticmethod
    def _step(grab: Grab) -> str:
        return "Move keys" if grab.kind == "key" else "Scale keys" if grab.kind in EDGES else "Turn handle"

    # -- what is where ---------------------------------------------------------------------------------------

    def _key_place(self, name: str, place: int) -> QPointF:
        key = self._shown[name].curve.keys[place]
        return self.place_of(key.frame, key.value, name)

    def _curve_height(self, name: str, point: QPointF) -> float:
        frame = self.at(point)[0]
        return self.place_of(frame, float(curve_at(self._shown[name].curve, frame)), name).y()

    def _handle_ends(self, name: str) -> tuple[list[QPointF], list[QPointF]]:
        """Where the handles before and after every key of a curve end, in pixels."""
        curve = self._shown[name].curve
        before, after = ([self.place_of(key.frame + h[0], key.value + h[1], name)
                          for key, h in zip(curve.keys, side, strict=True)] for side in handles_of(curve))
        return before, after

    def _grips(self) -> dict[str, QPointF]:
        """Middles of the sides of the box by which the selected keys are scaled."""
        box = self.box()
        found = {}
        if box.width() > 2 * ROOM + 1.0:
            found |= {"left": QPointF(box.left(), box.center().y()), "right": QPointF(box.right(), box.center().y())}
        if box.height() > 2 * ROOM + 1.0:
            found |= {"top": QPointF(box.center().x(), box.top()), "bottom": QPointF(box.center().x(), box.bottom())}
        return found

    def _under(self, point: QPointF) -> Grab | None:
        """What is caught at a point."""
        found: list[tuple[float, Grab]] = [(math.inf, Grab(""))]
        for name, places in self.picked.items():
            for side, ends in zip(SIDES, self._handle_ends(name), strict=True):
                found += [(_distance(ends[i], point), Grab(side, name, i)) for i in places]
        for name, one in self._shown.items():
            found += [(_distance(self._key_place(name, i), point) - 2.0, Grab("key", name, i))
                      for i in range(len(one.curve.keys))]
        found += [(_distance(place, point), Grab(edge)) for edge, place in self._grips().items()]
        distance, grab = min(found)
        return grab if distance <= REACH else None

    def _show_cursor(self, point: QPointF) -> None:
        grab = self._under(point)
        kind = "" if grab is None else grab.kind
        shape = (Qt.CursorShape.SizeHorCursor if kind in ("left", "right")
                 else Qt.CursorShape.SizeVerCursor if kind in ("top", "bottom")
                 else Qt.CursorShape.PointingHandCursor if kind else Qt.CursorShape.ArrowCursor)
        if self.cursor().shape() != shape:
            self.setCursor(shape)

    # -- the picture -----------------------------------------------------------------------------------------

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
        for name, one in self._shown.items():
            painter.setPen(QPen(self._colour(one), 2.0 if self.picked.get(name) else 1.4))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawPolyline(self._line(name, one))
        self._paint_time(painter, look)
        self._paint_keys(painter, look)
        self._paint_box(painter, look)

    def _colour(self, one: Shown) -> QColor:
        return look_of().theme.colour("text") if one.colour is None else line_colour(one.colour + 1)

    def _line(self, name: str, one: Shown) -> QPolygonF:
        """A curve across the view; made again only when curve, view or size are others."""
        known = (one.curve, one.offset, one.size, self._view, self.size())
        if name not in self._lines or self._lines[name][0] != known:
            first, last, low, high = self._view
            area = self.area()
            frames = np.linspace(first, last, max(int(self.width()), 2))
            heights = (curve_at(one.curve, frames) - one.offset) / one.size
            y = np.clip(area.bottom() - (heights - low) / (high - low) * area.height(), -1e6, 1e6)
            x = np.linspace(area.left(), area.right(), len(frames))
            self._lines[name] = known, QPolygonF([QPointF(*at) for at in zip(x.tolist(), y.tolist(), strict=True)])
        return self._lines[name][1]

    def _paint_time(self, painter: QPainter, look: Look) -> None:
        x = self.place_of(self._frame, 0.0, "\0").x()
        painter.setPen(QPen(look.theme.colour("accent"), 1.0))
        painter.drawLine(QPointF(x, 1), QPointF(x, self.height() - 1))

    def _paint_keys(self, painter: QPainter, look: Look) -> None:
        theme = look.theme
        for name, one in self._shown.items():
            picked = self.picked.get(name, frozenset())
            ends = self._handle_ends(name) if picked else ([], [])
            for i in range(len(one.curve.keys)):
                centre = self._key_place(name, i)
                if i in picked:
                    painter.setPen(QPen(theme.colour("dim"), 1.0))
                    painter.setBrush(theme.colour("field"))
                    for side in ends:
                        painter.drawLine(centre, side[i])
                        painter.drawEllipse(side[i], 3.0, 3.0)
                painter.setPen(QPen(theme.colour("field"), 1.0))
                painter.setBrush(theme.colour("accent") if i in picked else self._colour(one))
                painter.drawPolygon(diamond(centre, 5.0))

    def _paint_box(self, painter: QPainter, look: Look) -> None:
        theme = look.theme
        grips = self._grips()
        if grips:
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.setPen(QPen(theme.colour("dim"), 1.0, Qt.PenStyle.DotLine))
            painter.drawRect(self.box())
            painter.setPen(QPen(theme.colour("dim"), 1.0))
            painter.setBrush(theme.colour("field"))
            for place in grips.values():
                painter.drawRect(QRectF(place.x() - GRIP, place.y() - GRIP, 2 * GRIP, 2 * GRIP))
        if self._band is not None:
            paint_band(painter, self._band)

    def _paint_grid(self, painter: QPainter, look: Look) -> None:
        first, last, low, high = self._view
        area = self.area()
        painter.setFont(text_font(look, look.small))
        line, words = look.theme.colour("line", 0.6), look.theme.colour("dim")
        for frame in _ticks(first, last, area.width() / 56.0, 1.0):
            x = self.place_of(frame, low, "\0").x()
            painter.setPen(line)
            painter.drawLine(QPointF(x, area.top()), QPointF(x, area.bottom()))
            if not 20.0 < x < self.width() - 20.0:
                continue  # its number would be cut off
            painter.setPen(words)
            painter.drawText(QRectF(x - 30, area.bottom(), 60, look.small + 4), Qt.AlignmentFlag.AlignCenter,
                             f"{frame:g}")
        factor = self._scale.factor
        for value in _ticks(low / factor, high / factor, area.height() / 36.0, 0.0):
            y = self.place_of(first, value * factor, "\0").y()
            painter.setPen(line)
            painter.drawLine(QPointF(area.left(), y), QPointF(area.right(), y))
            if y < area.top() + look.small + 2 or not self.labels:
                continue
            painter.setPen(words)
            painter.drawText(QPointF(area.left() + 4, y - 2), shown(value * factor, self._scale, unit=False))


def diamond(centre: QPointF, reach: float) -> QPolygonF:
    """The mark of a key."""
    return QPolygonF([centre + QPointF(*d) for d in ((0, -reach), (reach, 0), (0, reach), (-reach, 0))])


def paint_band(painter: QPainter, band: QRectF) -> None:
    """The frame of a selection that is dragged."""
    theme = look_of().theme
    painter.setPen(QPen(theme.colour("accent"), 1.0))
    painter.setBrush(theme.colour("accent", 0.12))
    painter.drawRect(band)


def _whole(curve: Curve, places: frozenset[int]) -> tuple[Curve, frozenset[int]]:
    """The curve with some keys on whole frames; UserError when two meet there."""
    for place in sorted(places):
        curve, _ = set_keys(curve, {place}, frame=float(round(curve.keys[place].frame)))
    return curve, places


def _ticks(low: float, high: float, most: float, least_step: float) -> list[float]:
    """Round numbers between two, at most about so many, 1, 2 or 5 times a power of ten apart."""
    rough = max((high - low) / max(most, 1.0), 1e-12)
    power = 10.0 ** math.floor(math.log10(rough))
    step = max(next(power * m for m in (1.0, 2.0, 5.0, 10.0) if power * m >= rough * (1 - 1e-9)), least_step)
    return [i * step for i in range(math.ceil(low / step), math.floor(high / step) + 1)]


def _distance(a: QPointF, b: QPointF) -> float:
    return math.hypot(a.x() - b.x(), a.y() - b.y())
