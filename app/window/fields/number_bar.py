"""The number field of the whole program: a bar that is dragged, typed into with mathematics, stepped and reset."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from PySide6.QtCore import QPointF, QRectF, Qt, QTimer
from PySide6.QtGui import QFocusEvent, QKeyEvent, QMouseEvent, QPainter, QPaintEvent, QResizeEvent, QWheelEvent
from PySide6.QtWidgets import QWidget

from app.window.fields.field_widget import FieldWidget
from app.window.fields.math_edit import MathEdit
from app.window.fields.number_text import editable, held, read, scale_of, shown
from app.window.theme import look_of
from core.expression import ExpressionError
from core.field import Field

FINE = 0.1  # of the way of the hand, with Shift
DRAG_STARTS = 3.0  # pixels; a shaking click is no edit
WHEEL_RESTS = 400  # milliseconds without another notch make the step final
_STARTS_TYPING = set("0123456789.-+(")
_STEPS = {Qt.Key.Key_Left: -1, Qt.Key.Key_Down: -1, Qt.Key.Key_Right: 1, Qt.Key.Key_Up: 1}


class NumberBar(FieldWidget):
    """A number with its place in the soft range.

    Drag: change; Shift: fine; Ctrl: in steps. Wheel and arrow keys: one step, when it has the focus. Double click,
    Enter or a digit: type, with mathematics and units. Esc: as it was.

    Parameters
    ----------
    unit : of lengths, as panels show them. whole : the number is an integer.
    """

    def __init__(
        self, known: Field, value: float, default: float | None = None, unit: str = "m", whole: bool = False,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(known, value, default, parent)
        self.whole = whole
        self.scale = scale_of(known, unit, whole)
        self.line: MathEdit | None = None
        self.gathered = False
        self._press: QPointF | None = None
        self._last_x = 0.0
        self._free = 0.0  # the value of the drag before steps and rounding
        self._rest = QTimer(self)
        self._rest.setSingleShot(True)
        self._rest.setInterval(WHEEL_RESTS)
        self._rest.timeout.connect(self.finish)
        self.setCursor(Qt.CursorShape.SizeHorCursor)
        self.value_shown()

    def set_unit(self, unit: str) -> None:
        """Show lengths in another unit."""
        self.scale = scale_of(self.known, unit, self.whole)
        self.value_shown()

    def set_value(self, value: Any) -> None:
        if value != self._value or type(value) is not type(self._value):
            super().set_value(value)

    @property
    def soft(self) -> tuple[float, float]:
        """Range of the bar; one around the value when the field names none."""
        if self.known.soft is not None:
            return self.known.soft
        reach = max(abs(float(self._value)), 1.0) if not self._open else max(abs(float(self._start)), 1.0)
        low, high = -reach if self.known.hard is None or self.known.hard[0] < 0 else 0.0, 2.0 * reach
        return low, high

    @property
    def step(self) -> float:
        """What Ctrl snaps to."""
        if self.known.step is not None:
            return self.known.step
        low, high = self.soft
        step = (high - low) / 10.0
        return max(round(step), 1) if self.whole else step

    @property
    def nudge(self) -> float:
        """What one arrow key or one notch of the wheel does: a hundredth of the bar."""
        low, high = self.soft
        small = (high - low) / 100.0
        return max(round(small), 1) if self.whole else small

    def words(self) -> str:
        return shown(float(self._value), self.scale)

    def words_of(self, value: Any) -> str:
        return shown(float(value), self.scale)

    def limits(self) -> str:
        if self.known.hard is None:
            return ""
        return f" From {self.words_of(self.known.hard[0])} to {self.words_of(self.known.hard[1])}."

    def gestures(self) -> str:
        return "Drag (Shift fine, Ctrl steps, down first: several) · double-click to type · right button: reset, copy"

    def clipboard_text(self) -> str:
        unit = "deg" if self.scale.unit == "°" else self.scale.unit
        return f"{editable(float(self._value), self.scale)} {unit}".strip()

    def from_text(self, text: str) -> float:
        return held(read(text, self.known, self.scale), self.known, self.whole)

    def start_typing(self, text: str | None = None) -> None:
        """Open the line edit, with `text` or the whole value selected."""
        self.finish()
        if self.line is None:
            start = editable(float(self._value), self.scale) if text is None else text
            self.line = MathEdit(start, self.known.label, self)
            self.line.setAlignment(Qt.AlignmentFlag.AlignRight)
            self.line.setCursor(Qt.CursorShape.IBeamCursor)
            self.line.entered.connect(self._typed)
            self.line.left.connect(self._left)
            self.line.given_up.connect(lambda: self._close_line(True))
            self.line.setGeometry(self.rect())
            QWidget.setTabOrder(self, self.line)  # so that Tab goes on from here
            self.line.show()
            self.line.setFocus(Qt.FocusReason.OtherFocusReason)
            if text is None:
                self.line.selectAll()

    def _typed(self, text: str) -> None:
        if self.line is None:
            return
        if text.strip() != editable(float(self._value), self.scale):
            try:
                value = self.from_text(text)
            except ExpressionError as error:
                self.line.refuse(error)
                return
            self._close_line(True)
            self.enter(value)
        else:
            self._close_line(True)

    def _left(self, text: str) -> None:
        """Clicking elsewhere takes what can be understood; what cannot is given up."""
        if self.line is not None:
            self._close_line(False)
            if text.strip() != editable(float(self._value), self.scale):
                with suppress(ExpressionError):
                    self.enter(self.from_text(text))

    def _close_line(self, focus: bool) -> None:
        line, self.line = self.line, None
        if line is not None:
            line.hide()
            line.deleteLater()
            if focus:
                self.setFocus(Qt.FocusReason.OtherFocusReason)
            self.update()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() != Qt.MouseButton.LeftButton:
            event.ignore()
            return
        self.finish()
        self._press, self._last_x = event.position(), event.position().x()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self._press is None or not event.buttons() & Qt.MouseButton.LeftButton:
            return
        x = event.position().x()
        if not self._open:
            if abs(x - self._press.x()) < DRAG_STARTS:
                return
            self.begin()
        held_keys = event.modifiers()
        way = FINE if held_keys & Qt.KeyboardModifier.ShiftModifier else 1.0
        share, self._last_x = (x - self._last_x) / max(self.width() - 2, 1), x
        self.slide(share * way, bool(held_keys & Qt.KeyboardModifier.ControlModifier))

    def begin(self) -> None:
        if not self._open:
            self._free = float(self._value)
        super().begin()

    def slide(self, share: float, steps: bool = False) -> None:
        """Go on by a share of the bar, within its soft range or to where the edit began; `steps` snaps."""
        low, high = self.soft
        start = float(self._start)
        self._free = min(max(self._free + share * (high - low), min(low, start)), max(high, start))
        value = self._free
        if steps:
            value = min(max(round(value / self.step) * self.step, low), high)
        self.preview(self.made(value))

    def let_go(self) -> None:
        """Forget the press: what the hand does now is not for this bar alone."""
        self._press = None

    def set_gathered(self, gathered: bool) -> None:
        """Show that the hand holds this bar with others."""
        if gathered != self.gathered:
            self.gathered = gathered
            self.update()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton:
            self._press = None
            self.finish()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton:
            self._press = None
            self.start_typing()

    def wheelEvent(self, event: QWheelEvent) -> None:
        notches = event.angleDelta().y() / 120.0
        if not self.hasFocus() or notches == 0.0 or self._press is not None:
            event.ignore()  # the panel scrolls
            return
        self._nudge(notches, event.modifiers())
        self._rest.start()
        event.accept()

    def takes(self, event: QKeyEvent) -> bool:
        plain = not event.modifiers() & (Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.AltModifier)
        typed = plain and bool(event.text()) and event.text() in _STARTS_TYPING
        steps = event.key() in _STEPS or event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter)
        return typed or steps or (self._open and event.key() == Qt.Key.Key_Escape) or super().takes(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        key = event.key()
        if self._open and key == Qt.Key.Key_Escape:
            self._press = None
            self.cancel()
        elif key in (Qt.Key.Key_Return, Qt.Key.Key_Enter, Qt.Key.Key_F2):
            self.start_typing()
        elif key in _STEPS and self._press is None:
            self._nudge(_STEPS[Qt.Key(key)], event.modifiers())
        elif event.text() and event.text() in _STARTS_TYPING:
            self.start_typing(event.text())
        else:
            super().keyPressEvent(event)

    def keyReleaseEvent(self, event: QKeyEvent) -> None:
        if event.key() in _STEPS and not event.isAutoRepeat() and self._press is None:
            self.finish()
        else:
            super().keyReleaseEvent(event)

    def _nudge(self, count: float, modifiers: Qt.KeyboardModifier) -> None:
        if not self._open:
            self.begin()
        if modifiers & Qt.KeyboardModifier.ControlModifier:
            self._free += count * self.step
        else:
            self._free += count * self.nudge * (FINE if modifiers & Qt.KeyboardModifier.ShiftModifier else 1.0)
        low, high = self.known.hard or self.soft
        self._free = min(max(self._free, low), high)
        self.preview(self.made(self._free))

    def made(self, value: float) -> float:
        """A number of the hand as it is stored: without the noise of its arithmetic."""
        return held(float(f"{value:.7g}"), self.known, self.whole)

    def focusOutEvent(self, event: QFocusEvent) -> None:
        self._rest.stop()
        super().focusOutEvent(event)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        if self.line is not None:
            self.line.setGeometry(self.rect())

    def paintEvent(self, event: QPaintEvent) -> None:
        look = look_of()
        painter = QPainter(self)
        inside = self.frame(painter, look)
        low, high = self.soft
        part = min(max((float(self._value) - low) / ((high - low) or 1.0), 0.0), 1.0)
        if part > 0.0 and self.known.soft is not None:
            busy = self._open or (self.underMouse() and self.isEnabled())
            paint_fill(painter, inside, part, look.theme.colour("fill_hover" if busy else "fill",
                                                                1.0 if self.isEnabled() else 0.35))
        if self.gathered:
            painter.setPen(look.theme.colour("accent"))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawRoundedRect(QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5), 4.5, 4.5)
        painter.setPen(self.ink(look))
        painter.drawText(inside.adjusted(8, 0, -7, 0), Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter,
                         self.words())


def paint_fill(painter: QPainter, inside: QRectF, part: float, colour: Any) -> None:
    """The filled part of a bar, rounded like the bar on its left."""
    painter.save()
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(colour)
    painter.setClipRect(QRectF(inside.left(), inside.top(), inside.width() * part, inside.height()))
    painter.drawRoundedRect(inside, 4.0, 4.0)
    painter.restore()
