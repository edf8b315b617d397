"""The feather as it looks: turned by hand, lit as in the view."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QSize, Qt, QTimer
from PySide6.QtGui import QColor, QImage, QMouseEvent, QPainter, QPaintEvent, QResizeEvent, QWheelEvent
from PySide6.QtWidgets import QWidget

from app.window.theme import look_of
from core.camera import Camera, frame_points
from core.feather.pieces import FeatherMesh
from viewport.scene import Scene

BEHIND = ((0.30, 0.30, 0.30), (0.22, 0.22, 0.22))  # display RGB, top and bottom
USUAL = (0.5, 0.45)  # radians, how far it is turned about its shaft and tilted
TURN = 0.01  # radians a pixel
NEARER = 1.15  # for a notch of the wheel

COARSE = 2  # pixels for one while a hand turns it

SLICE = 0.012  # seconds of drawing, before the window has its turn

Draw = Callable[[Scene, Camera, tuple[int, int]], Iterator["NDArray[np.uint8] | None"]]


class SolidView(QWidget):
    """Drag: turn. Wheel: nearer. Double click: as at first.

    Parameters
    ----------
    draw : draws a scene in short slices; the last item is (height, width, 3) uint8 sRGB.
    """

    def __init__(self, draw: Draw, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._draw = draw
        self.mesh: FeatherMesh | None = None
        self.turned, self.tilted = USUAL
        self.zoom = 1.0
        self._image: QImage | None = None
        self._steps: Iterator[NDArray[np.uint8] | None] | None = None
        self._slices = QTimer(self)
        self._slices.timeout.connect(self._on)
        self._last: QPointF | None = None
        self.setMinimumSize(120, 160)
        self.setCursor(Qt.CursorShape.OpenHandCursor)
        self.setToolTip("The feather as it looks. Drag turns it, the wheel comes nearer, a double click resets.")
        self.setAccessibleName("Feather in space")

    def sizeHint(self) -> QSize:
        return QSize(18 * look_of().text, 32 * look_of().text)

    def show_mesh(self, mesh: FeatherMesh | None) -> None:
        """Show another feather, or none."""
        self.mesh = mesh
        self._again()

    def _again(self) -> None:
        """Draw anew, a little at a time; the picture there is stays until then."""
        self._steps = None
        if self.mesh is None:
            self._image = None
            self._slices.stop()
            self.update()
            return
        ratio = self.devicePixelRatioF() / (1 if self._last is None else COARSE)
        wide, high = max(round(self.width() * ratio), 1), max(round(self.height() * ratio), 1)
        scene = Scene(feathers=(self.mesh,), background=BEHIND)
        self._steps = self._draw(scene, self.camera(wide / high), (wide, high))
        self._slices.start(0)

    def _on(self) -> None:
        """One slice of drawing."""
        start = time.perf_counter()
        while self._steps is not None and time.perf_counter() - start < SLICE:
            try:
                seen = next(self._steps)
            except StopIteration:
                self._steps = None
                break
            if seen is not None:
                high, wide = seen.shape[:2]
                self._image = QImage(seen.tobytes(), wide, high, 3 * wide, QImage.Format.Format_RGB888).copy()
                self.update()
        if self._steps is None:
            self._slices.stop()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton:
            self._last = event.position()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self._last is not None:
            way, self._last = event.position() - self._last, event.position()
            self.turned += TURN * way.x()
            self.tilted = min(max(self.tilted - TURN * way.y(), -1.5), 1.5)
            self._again()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        self._last = None
        self._again()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        (self.turned, self.tilted), self.zoom = USUAL, 1.0
        self._again()

    def wheelEvent(self, event: QWheelEvent) -> None:
        self.zoom = min(max(self.zoom * NEARER ** (event.angleDelta().y() / 120.0), 0.5), 20.0)
        self._again()

    def resizeEvent(self, event: QResizeEvent) -> None:
        self._again()
        super().resizeEvent(event)

    def camera(self, aspect: float) -> Camera:
        """Where it is seen from."""
        assert self.mesh is not None
        flat = np.cos(self.tilted)
        towards = (-np.sin(self.turned) * flat, np.sin(self.tilted), -np.cos(self.turned) * flat)
        points = self.mesh.points
        middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
        return frame_points(middle + (points - middle) / np.float32(self.zoom), towards, aspect)

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.fillRect(self.rect(), QColor(66, 66, 66))
        if self._image is not None:
            painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
            painter.drawImage(self.rect(), self._image)
