"""Fields that are not numbers: on or off, one of a few words, a line of text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from PySide6.QtCore import QPoint, QRectF, QSignalBlocker, Qt
from PySide6.QtGui import QFontMetricsF, QKeyEvent, QMouseEvent, QPainter, QPaintEvent, QResizeEvent
from PySide6.QtWidgets import QLineEdit, QMenu, QWidget

from app.window.fields.field_widget import FieldWidget
from app.window.fields.number_bar import paint_fill
from app.window.icons import paint_icon
from app.window.theme import look_of
from core.errors import UserError
from core.field import Field

SEGMENTS = 4  # up to so many words stand side by side, when there is room
_BACK, _ON = (Qt.Key.Key_Left, Qt.Key.Key_Up), (Qt.Key.Key_Right, Qt.Key.Key_Down)
_PRESSES = (Qt.Key.Key_Space, Qt.Key.Key_Return, Qt.Key.Key_Enter)


class SwitchBar(FieldWidget):
    """On or off: a click or Space turns it over."""

    def __init__(self, known: Field, value: bool, default: bool | None = None, parent: QWidget | None = None) -> None:
        super().__init__(known, value, default, parent)
        self.value_shown()

    def words(self) -> str:
        return self.words_of(self._value)

    def words_of(self, value: Any) -> str:
        return "on" if value else "off"

    def from_text(self, text: str) -> bool:
        word = text.strip().lower()
        if word not in ("on", "off", "1", "0", "true", "false", "yes", "no"):
            raise UserError(f"{self.known.label} is on or off; {word[:40]!r} is neither.")
        return word in ("on", "1", "true", "yes")

    def gestures(self) -> str:
        return "Click or Space: on or off · right button for more"

    def takes(self, event: QKeyEvent) -> bool:
        return event.key() in _PRESSES or super().takes(event)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton:
            self.enter(not self._value)

    mouseDoubleClickEvent = mousePressEvent

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in _PRESSES:
            self.enter(not self._value)
        else:
            super().keyPressEvent(event)

    def paintEvent(self, event: QPaintEvent) -> None:
        look = look_of()
        painter = QPainter(self)
        inside = self.frame(painter, look)
        if self._value:
            busy = self.underMouse() and self.isEnabled()
            paint_fill(painter, inside, 1.0, look.theme.colour("fill_hover" if busy else "fill",
                                                               1.0 if self.isEnabled() else 0.35))
        painter.setPen(self.ink(look, "text" if self._value else "dim"))
        painter.drawText(inside.adjusted(8, 0, -7, 0), Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter,
                         self.words())


class ChoiceBar(FieldWidget):
    """One of some words: side by side while they fit, else in a menu. Arrow keys go through them.

    Parameters
    ----------
    choices : the values; `names` what is shown for each (the values themselves by default). `value` may be one that
        is not among them (a map that was taken away): it is shown in the colour of trouble.
    """

    def __init__(
        self, known: Field, value: Any, default: Any = None, choices: Sequence[Any] = (),
        names: Sequence[str] | None = None, parent: QWidget | None = None,
    ) -> None:
        super().__init__(known, value, default, parent)
        self.set_choices(choices or known.choices, names)

    def set_choices(self, choices: Sequence[Any], names: Sequence[str] | None = None) -> None:
        """Offer other values."""
        self.choices = tuple(choices)
        self.names = tuple(names) if names is not None else tuple(str(c).replace("_", " ") for c in choices)
        self.value_shown()

    def words(self) -> str:
        return self.words_of(self._value)

    def words_of(self, value: Any) -> str:
        return self.names[self.choices.index(value)] if value in self.choices else str(value)

    def from_text(self, text: str) -> Any:
        word = text.strip()
        for choice, name in zip(self.choices, self.names, strict=True):
            if word.lower() == name.lower():
                return choice
        raise UserError(f"{self.known.label} is one of {', '.join(self.names)}; {word[:40]!r} is not.")

    def gestures(self) -> str:
        return "Click to choose, arrow keys for the next · right button for more"

    def takes(self, event: QKeyEvent) -> bool:
        return event.key() in (*_BACK, *_ON, *_PRESSES) or super().takes(event)

    @property
    def segmented(self) -> bool:
        """True while all words fit side by side."""
        if not 1 < len(self.choices) <= SEGMENTS:
            return False
        metrics = QFontMetricsF(self.font())
        widest = max(metrics.horizontalAdvance(name) for name in self.names)
        return (widest + 10.0) * len(self.choices) <= self.width()

    def pop_up(self) -> QMenu:
        """Open the menu of words."""
        menu = QMenu(self)
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        for choice, name in zip(self.choices, self.names, strict=True):
            action = menu.addAction(name)
            action.setCheckable(True)
            action.setChecked(choice == self._value)
            action.triggered.connect(lambda _=False, chosen=choice: self.enter(chosen))
        menu.setMinimumWidth(self.width())
        menu.popup(self.mapToGlobal(QPoint(0, self.height() + 2)))
        return menu

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton and self.choices:
            if self.segmented:
                place = int(event.position().x() / self.width() * len(self.choices))
                self.enter(self.choices[min(max(place, 0), len(self.choices) - 1)])
            else:
                self.pop_up()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in (*_BACK, *_ON) and self.choices:
            at = self.choices.index(self._value) if self._value in self.choices else -1
            self.enter(self.choices[min(max(at + (1 if event.key() in _ON else -1), 0), len(self.choices) - 1)])
        elif event.key() in _PRESSES and not self.segmented:
            self.pop_up()
        else:
            super().keyPressEvent(event)

    def paintEvent(self, event: QPaintEvent) -> None:
        look = look_of()
        painter = QPainter(self)
        inside = self.frame(painter, look)
        centre = Qt.AlignmentFlag.AlignCenter
        if self.segmented:
            width = inside.width() / len(self.choices)
            for i, (choice, name) in enumerate(zip(self.choices, self.names, strict=True)):
                part = QRectF(inside.left() + i * width, inside.top(), width, inside.height())
                if choice == self._value:
                    painter.setPen(Qt.PenStyle.NoPen)
                    painter.setBrush(look.theme.colour("fill", 1.0 if self.isEnabled() else 0.35))
                    painter.drawRoundedRect(part, 4.0, 4.0)
                painter.setPen(self.ink(look, "text" if choice == self._value else "dim"))
                painter.drawText(part, centre, name)
            return
        known = self._value in self.choices
        side = float(look.text)
        painter.setPen(self.ink(look, "text" if known else "trouble_text"))
        room = inside.adjusted(8, 0, -side - 10, 0)
        words = painter.fontMetrics().elidedText(self.words(), Qt.TextElideMode.ElideRight, int(room.width()))
        painter.drawText(room, Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter, words)
        paint_icon(painter, "chevron-down", QRectF(
            inside.right() - side - 5, inside.center().y() - side / 2, side, side), self.ink(look, "dim"))


class TextField(FieldWidget):
    """A line of text; Enter or leaving it makes it final, Esc puts it back."""

    def __init__(self, known: Field, value: str, default: str | None = None, parent: QWidget | None = None) -> None:
        super().__init__(known, value, default, parent)
        self.line = QLineEdit(value, self)
        self.line.setAccessibleName(known.label)
        self.line.editingFinished.connect(lambda: self.enter(self.line.text()))
        self.setFocusProxy(self.line)
        self.value_shown()

    def value_shown(self) -> None:
        with QSignalBlocker(self.line):
            self.line.setText(self._value)
        super().value_shown()

    def from_text(self, text: str) -> str:
        return text

    def gestures(self) -> str:
        return "Enter keeps it, Esc puts it back"

    def resizeEvent(self, event: QResizeEvent) -> None:
        self.line.setGeometry(self.rect())
        super().resizeEvent(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Escape:
            self.value_shown()
        else:
            super().keyPressEvent(event)
