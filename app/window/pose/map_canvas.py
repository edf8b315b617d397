"""The map of pose space as it is drawn: sculpts in a plane, how far each reaches, and the pose as a dot in the hand."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QImage,
    QMouseEvent,
    QPainter,
    QPainterPath,
    QPaintEvent,
    QPen,
    QPolygonF,
    QResizeEvent,
)
from PySide6.QtWidgets import QSizePolicy, QToolTip, QWidget

from app.window.theme import look_of
from core.pose.pose import REST
from core.pose.pose_map import Axis, falloff_ring, places, spread_out
from core.pose.pose_space import PoseSpace
from core.transform import Array

NEAR = 12.0  # pixels within which a dot is meant


class Chart(NamedTuple):
    """What is drawn: places of rest and of the samples, the rims of their falloffs, and the part of the plane shown."""

    space: PoseSpace
    axes: tuple[Axis, Axis] | None
    spots: Array
    rims: tuple[Array, ...]
    low: Array
    high: Array


def chart_of(space: PoseSpace, axes: tuple[Axis, Axis] | None) -> Chart:
    """The chart of a space over two axes, or of all its poses by distance."""
    poses = [REST, *(s.pose for s in space.samples)]
    if axes is None:
        spots, rims = spread_out(space), ()
    else:
        spots = places(axes, poses)
        rims = tuple(falloff_ring(space, k - 1 if k else None, axes) for k in range(len(poses)))
    low, high = spots.min(axis=0), spots.max(axis=0)
    if axes is None:
        reach = np.full(2, 0.5 * float(np.max(high - low)) or 1.0)
    else:
        reach = np.array([axis.dof.falloff[0] for axis in axes])
    margin = np.maximum(0.35 * reach, 0.25 * (high - low))
    middle, half = 0.5 * (low + high), np.maximum(0.5 * (high - low) + margin, 0.6 * reach)
    if axes is None or all(axis.dof.kind not in ("number", "translation") for axis in axes):
        half = np.full(2, half.max())  # angles look alike in both directions
    return Chart(space, axes, spots, rims, middle - half, middle + half)


class MapCanvas(QWidget):
    """Draws a chart. moved : (place, final), the dot in the hand. picked : a sample was clicked, its place or -1."""

    moved = Signal(float, float, bool)
    picked = Signal(int)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.chart: Chart | None = None
        self.dot: Array | None = None
        self.chosen: int | None = None
        self.words = ""
        self._heat: tuple[NDArray[np.float32], QImage, str] | None = None
        self._dragged = False
        self.setMouseTracking(True)
        self.setMinimumSize(160, 140)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.setAccessibleName("Map of pose space")

    def sizeHint(self) -> QSize:
        return QSize(380, 380)

    def set_heat(self, values: NDArray[np.float32] | None) -> None:
        """Paint weights (rows from below, columns) behind, or nothing."""
        self._heat = None if values is None else (values, heat_image(values), look_of().theme.name)
        self.update()

    @property
    def area(self) -> QRectF:
        """Where the plane is."""
        look = look_of()
        return QRectF(self.rect()).adjusted(look.gap, look.gap, -look.gap, -(look.row + 2))

    def to_pixel(self, place: Array) -> QPointF:
        """Where a place of the plane is on the widget."""
        assert self.chart is not None
        area, part = self.area, (np.asarray(place) - self.chart.low) / (self.chart.high - self.chart.low)
        return QPointF(area.left() + part[0] * area.width(), area.bottom() - part[1] * area.height())

    def to_place(self, pixel: QPointF) -> Array:
        """The place of the plane at a pixel, held within the map."""
        assert self.chart is not None
        area = self.area
        part = np.clip([
            (pixel.x() - area.left()) / max(area.width(), 1.0),
            (area.bottom() - pixel.y()) / max(area.height(), 1.0)], 0.0, 1.0)
        return np.asarray(self.chart.low + part * (self.chart.high - self.chart.low), np.float64)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if self.chart is None or event.button() != Qt.MouseButton.LeftButton:
            return
        near = self._near(event.position())
        if near is not None and not self._on_dot(event.position()):
            self.picked.emit(near)
            return
        self._dragged = True
        self._move(event.position(), False)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self._dragged:
            self._move(event.position(), False)
            return
        near = None if self.chart is None else self._near(event.position())
        grab = near is not None or self._on_dot(event.position())
        self.setCursor(Qt.CursorShape.PointingHandCursor if grab else Qt.CursorShape.CrossCursor)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        if self._dragged and event.button() == Qt.MouseButton.LeftButton:
            self._dragged = False
            self._move(event.position(), True)

    def event(self, event: QEvent) -> bool:
        if event.type() == QEvent.Type.ToolTip and self.chart is not None:
            near = self._near(QPointF(event.pos()))  # type: ignore[attr-defined]
            name = "" if near is None else self._name(near)
            QToolTip.showText(
                event.globalPos(),  # type: ignore[attr-defined]
                f"{name}: click to hold this pose." if name else
                "Drag the dot: the model follows. Click a pose to hold it. Rims: one falloff away from a sculpt.",
                self)
            return True
        return super().event(event)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        look, painter = look_of(), QPainter(self)
        theme, area = look.theme, self.area
        painter.fillRect(self.rect(), theme.colour("panel"))
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        clip = QPainterPath()
        clip.addRoundedRect(area, 5.0, 5.0)
        painter.fillPath(clip, theme.colour("field"))
        if self.chart is None:
            painter.setPen(theme.colour("dim"))
            painter.drawText(area.adjusted(16, 16, -16, -16),
                             int(Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap), self.words)
            return
        painter.setClipPath(clip)
        if self._heat is not None:
            if self._heat[2] != theme.name:
                self._heat = (self._heat[0], heat_image(self._heat[0]), theme.name)
            painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
            painter.drawImage(area, self._heat[1])
        self._draw_axes(painter)
        for k, rim in enumerate(self.chart.rims):
            colour = theme.colour("accent" if k == self.chosen else "dim", 0.9 if k == self.chosen else 0.55)
            painter.setPen(QPen(colour, 1.5 if k == self.chosen else 1.0))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawPolygon(QPolygonF([self.to_pixel(place) for place in rim]))
        self._draw_poses(painter)
        if self.dot is not None:
            middle = self.to_pixel(np.clip(self.dot, self.chart.low, self.chart.high))
            painter.setPen(QPen(theme.colour("ground"), 4.0))
            painter.setBrush(theme.colour("accent"))
            painter.drawEllipse(middle, 7.0, 7.0)
            painter.setPen(QPen(theme.colour("text"), 1.5))
            painter.drawEllipse(middle, 7.0, 7.0)
        painter.setClipping(False)
        painter.setPen(theme.colour("dim"))
        self._draw_legend(painter)

    def _draw_axes(self, painter: QPainter) -> None:
        assert self.chart is not None
        rest, area = self.to_pixel(self.chart.spots[0]), self.area
        painter.setPen(QPen(look_of().theme.colour("line"), 1.0))
        painter.drawLine(QPointF(rest.x(), area.top()), QPointF(rest.x(), area.bottom()))
        painter.drawLine(QPointF(area.left(), rest.y()), QPointF(area.right(), rest.y()))

    def _draw_poses(self, painter: QPainter) -> None:
        assert self.chart is not None
        theme, taken = look_of().theme, list[QRectF]()
        for k, spot in enumerate(self.chart.spots):
            middle, chosen = self.to_pixel(spot), k == self.chosen
            painter.setPen(QPen(theme.colour("ground"), 1.0))
            painter.setBrush(theme.colour("accent" if chosen else "text"))
            painter.drawEllipse(middle, 4.0, 4.0)
            name, metrics = self._name(k), painter.fontMetrics()
            box = QRectF(middle.x() + 9, middle.y() - metrics.height() - 1, metrics.horizontalAdvance(name) + 8,
                         metrics.height())
            if box.right() > self.area.right() - 4:
                box.moveRight(middle.x() - 9)
            while any(box.intersects(other) for other in taken) and box.bottom() < self.area.bottom():
                box.translate(0.0, box.height())
            taken.append(box)
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(theme.colour("panel", 0.8))
            painter.drawRoundedRect(box, 3.0, 3.0)
            painter.setPen(theme.colour("accent" if chosen else "text"))
            painter.drawText(box, Qt.AlignmentFlag.AlignCenter, name)

    def _draw_legend(self, painter: QPainter) -> None:
        """Below the map: what the axes run over, in the units of the controls."""
        assert self.chart is not None
        look, area = look_of(), self.area
        below = QRectF(area.left(), area.bottom() + 2, area.width(), look.row)
        if self.chart.axes is None:
            words = "distances in falloffs"
        else:
            words = "   ".join(
                f"{arrow} {_shown(axis, low)} … {_shown(axis, high)}"
                for arrow, axis, low, high in zip("→↑", self.chart.axes, self.chart.low, self.chart.high, strict=True))
        metrics, side = painter.fontMetrics(), 54.0
        room = below.width() - (side + 60 if self._heat is not None else 0)
        painter.drawText(below, Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter,
                         metrics.elidedText(words, Qt.TextElideMode.ElideRight, round(room)))
        if self._heat is None:
            return
        bar = QRectF(below.right() - side - 12, below.center().y() - 4, side, 8)
        ramp = heat_image(np.linspace(-0.25, 1.0, 32, dtype=np.float32)[None, :])
        painter.drawImage(bar, ramp)
        painter.drawText(QRectF(bar.left() - 34, below.top(), 30, below.height()),
                         Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter, "−¼")
        painter.drawText(QRectF(bar.right() + 4, below.top(), 12, below.height()),
                         Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter, "1")

    def _name(self, k: int) -> str:
        assert self.chart is not None
        return "rest" if k == 0 else self.chart.space.samples[k - 1].name

    def _near(self, pixel: QPointF) -> int | None:
        assert self.chart is not None
        gaps = [math.hypot((p := self.to_pixel(spot)).x() - pixel.x(), p.y() - pixel.y()) for spot in self.chart.spots]
        best = int(np.argmin(gaps))
        return best if gaps[best] < NEAR else None

    def _on_dot(self, pixel: QPointF) -> bool:
        if self.chart is None or self.dot is None:
            return False
        spot = self.to_pixel(np.clip(self.dot, self.chart.low, self.chart.high))
        return math.hypot(spot.x() - pixel.x(), spot.y() - pixel.y()) < NEAR

    def _move(self, pixel: QPointF, final: bool) -> None:
        self.dot = self.to_place(pixel)
        self.update()
        self.moved.emit(float(self.dot[0]), float(self.dot[1]), final)


def heat_image(values: NDArray[np.float32]) -> QImage:
    """Weights (rows from below, columns) as colours of the theme: 0 the ground, 1 the accent, negative the trouble."""
    theme = look_of().theme
    ground, high, low = (np.array(QColor(getattr(theme, name)).getRgb()[:3], np.float64)
                         for name in ("field", "accent", "trouble"))
    share = np.clip(values, -0.25, 1.0)[::-1, :, None]
    up, down = np.maximum(share, 0.0) * 0.75, np.maximum(-4.0 * share, 0.0) * 0.75
    colours = ground + up * (high - ground) + down * (low - ground)
    pixels = np.ascontiguousarray(np.clip(colours, 0, 255), np.uint8)
    height, width = pixels.shape[:2]
    return QImage(pixels.tobytes(), width, height, 3 * width, QImage.Format.Format_RGB888).copy()


def _shown(axis: Axis, value: float) -> str:
    if axis.part == "number":
        return f"{value:.2g}"
    return f"{100.0 * value:.1f} cm" if axis.dof.kind == "translation" else f"{math.degrees(value):.0f}°"
