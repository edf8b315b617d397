"""The row of keys below the ruler of the timeline: all curves at once, moved in time by the hand."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QKeyEvent, QMouseEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.window.hotkeys import at_curves
from app.window.theme import look_of
from app.window.timeline.curve_view import REACH, STILL, diamond, paint_band
from app.window.timeline.keys_at_hand import KeysAtHand
from app.window.timeline.time_scale import TimeScale
from core.curve import Curve
from core.curve_edit import moved_keys
from core.errors import UserError
from tools.keyed import Keyed

SAME = 1e-3  # frames: keys that stand as one


class DopeRow(QWidget):
    """A diamond on every frame that has keys of the shown curves; hidden when there is none.

    Click selects all keys of a frame (Shift: more), a drag moves the selected ones, over nothing it selects what is in
    it. Double click goes there.
    """

    def __init__(self, keys: KeysAtHand, scale: TimeScale, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._keys, self._scale = keys, scale
        self._frames: tuple[float, ...] = ()
        self._start: tuple[Keyed, ...] | None = None
        self._start_selected: dict[str, frozenset[int]] = {}
        self._grabbed, self._from = 0.0, QPointF()
        self._moved: dict[str, Curve] = {}
        self._band: QRectF | None = None
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setAccessibleName("Keys")
        self.setToolTip("Keys of all shown curves. Click selects those of a frame, a drag moves them in time; "
                        "drag over nothing to select several, double-click to go there.")
        at_curves(self)
        keys.changed.connect(self.read)
        self.read()

    def read(self) -> None:
        """Read the keys anew."""
        self._frames = tuple(sorted({key.frame for keyed in self._keys.curves for key in keyed.curve.keys}))
        self.setVisible(bool(self._frames))
        self.update()

    def sizeHint(self) -> QSize:
        look = look_of()
        return QSize(40 * look.text, look.text + 2)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() != Qt.MouseButton.LeftButton:
            return
        self._from = event.position()
        frame = self._under(event.position().x())
        further = bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier)
        if frame is None:
            self._band = QRectF(self._from, self._from)
            if not further:
                self._keys.select({})
            return
        here = self._within(frame - SAME, frame + SAME)
        if further or not any(places & self._keys.selected.get(name, frozenset()) for name, places in here.items()):
            self._keys.select(self._with(here) if further else here)
        self._start, self._start_selected, self._grabbed = self._keys.all, dict(self._keys.selected), frame
        self._moved = {}

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        point = event.position()
        if self._band is not None:
            self._band = QRectF(self._from, point).normalized()
            self.update()
        elif self._start is not None and (self._moved or abs(point.x() - self._from.x()) > STILL):
            frames = self._scale.frame_along(point.x()) - self._scale.frame_along(self._from.x())
            if self._keys.snaps != bool(event.modifiers() & Qt.KeyboardModifier.ControlModifier):
                frames = round(self._grabbed + frames) - self._grabbed
            try:
                made = {keyed.address: moved_keys(keyed.curve, self._start_selected[keyed.address], frames, 0.0)
                        for keyed in self._start if keyed.address in self._start_selected}
            except UserError:
                return  # on top of another key; it goes on when the hand does
            self._moved = {address: curve for address, (curve, _) in made.items()}
            self._keys.preview(self._moved, {address: places for address, (_, places) in made.items()})

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        if self._band is not None:
            band, self._band = self._band, None
            if band.width() > STILL:
                self._keys.select(self._with(self._within(
                    self._scale.frame_along(band.left()), self._scale.frame_along(band.right()))))
            self.update()
        elif self._start is not None:
            self._start = None
            if self._moved:
                self._keys.commit("Move keys", self._moved, self._keys.selected)

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        frame = self._under(event.position().x())
        if frame is not None:
            self._scale.go(frame)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Escape and self._start is not None:
            self._start, self._band = None, None
            self._keys.commit("Move keys", {}, self._start_selected)
        else:
            super().keyPressEvent(event)

    def paintEvent(self, event: QPaintEvent) -> None:
        look = look_of()
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        middle = 0.5 * self.height()
        left, span = self._scale.extent()
        painter.fillRect(QRectF(left, middle - 0.5, span, 1.0), look.theme.colour("line"))
        selected = {keyed.curve.keys[i].frame for keyed in self._keys.curves
                    for i in self._keys.selected.get(keyed.address, ())}
        painter.setPen(Qt.PenStyle.NoPen)
        drawn = -1e9
        for frame in self._frames:
            x = self._scale.x_of(frame) + 0.5
            if left - 1 <= x <= left + span + 1 and (x - drawn >= 1.0 or frame in selected):
                drawn = x
                painter.setBrush(look.theme.colour("accent" if frame in selected else "text"))
                painter.drawPolygon(diamond(QPointF(x, middle), 4.5))
        if self._band is not None:
            paint_band(painter, QRectF(self._band.left(), 1, self._band.width(), self.height() - 2))
        if self.hasFocus():
            painter.setPen(look.theme.colour("accent", 0.5))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawRoundedRect(QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5), 5, 5)

    def _under(self, x: float) -> float | None:
        """The frame with keys nearest to a place, when it is within reach."""
        near = min(self._frames, key=lambda frame: abs(self._scale.x_of(frame) - x), default=None)
        return near if near is not None and abs(self._scale.x_of(near) - x) <= REACH else None

    def _within(self, first: float, last: float) -> dict[str, frozenset[int]]:
        return {keyed.address: frozenset(i for i, key in enumerate(keyed.curve.keys) if first <= key.frame <= last)
                for keyed in self._keys.curves}

    def _with(self, further: dict[str, frozenset[int]]) -> dict[str, frozenset[int]]:
        have = self._keys.selected
        return {name: places | have.get(name, frozenset()) for name, places in {**have, **further}.items()}
