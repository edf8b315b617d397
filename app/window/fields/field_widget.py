"""What all fields of panels share: a value, an edit that is a preview until it is final, a menu, a teaching tooltip."""

from __future__ import annotations

import html
from typing import Any

from PySide6.QtCore import QEvent, QPoint, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QContextMenuEvent, QFocusEvent, QGuiApplication, QKeyEvent, QKeySequence, QPainter
from PySide6.QtWidgets import QMenu, QSizePolicy, QToolTip, QWidget

from app.window.icons import icon
from app.window.theme import Look, look_of
from core.errors import UserError
from core.field import Field


class FieldWidget(QWidget):
    """Base of the bars. A subclass paints itself and calls `begin`, `preview`, `finish` and `cancel`.

    edited : (value, final). Any number of previews with False, then one with True, which is one step of undo. When an
        edit is taken back (Esc) the final value is the very one there was before, so that ``is`` tells.
    key_asked, expression_asked : from the menu, only when `animatable`.
    """

    edited = Signal(object, bool)
    key_asked = Signal()
    expression_asked = Signal()
    focused = Signal(bool)

    def __init__(self, known: Field, value: Any, default: Any = None, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.known, self.default = known, default
        self.animatable = False
        self._value = value
        self._start: Any = None
        self._open = self._sent = False
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setAccessibleName(known.label)
        self.setAttribute(Qt.WidgetAttribute.WA_Hover)

    @property
    def editing(self) -> bool:
        """True between the first preview and its end."""
        return self._open

    def value(self) -> Any:
        """The value as it is stored."""
        return self._value

    def set_value(self, value: Any) -> None:
        """Show a value from outside; while a hand is editing the hand's value stays."""
        if self._open or value is self._value:
            return
        self._value = value
        self.value_shown()

    def value_shown(self) -> None:
        """Repaint and tell a screen reader after the value has changed."""
        self.setAccessibleDescription(self.words())
        self.setToolTip(self.teaching())
        self.update()

    def words(self) -> str:
        """The value in words, as it is shown."""
        return str(self._value)

    def clipboard_text(self) -> str:
        """The value as Copy gives it."""
        return self.words()

    def from_text(self, text: str) -> Any:
        """The value a text means; UserError in words when it means none."""
        raise NotImplementedError

    def begin(self) -> None:
        """An edit starts: remember what Esc brings back."""
        if not self._open:
            self._open, self._sent, self._start = True, False, self._value

    def preview(self, value: Any) -> None:
        """Show a value while the hand moves."""
        self.begin()
        if value != self._value:
            self._value, self._sent = value, True
            self.value_shown()
            self.edited.emit(value, False)

    def finish(self) -> None:
        """The edit is over: its value is final. Nothing is sent when nothing was previewed."""
        if self._open:
            self._open = False
            if self._value == self._start:
                self._value = self._start
            if self._sent:
                self.edited.emit(self._value, True)

    def cancel(self) -> None:
        """Put the value back that was there before the edit."""
        if self._open:
            self._value = self._start
            self.value_shown()
            self.finish()

    def enter(self, value: Any) -> None:
        """One edit without previews: typed, pasted, reset."""
        self.cancel()
        if value != self._value:
            self._value = value
            self.value_shown()
            self.edited.emit(value, True)

    def teaching(self) -> str:
        """The tooltip: what it is, what it does, how it is edited."""
        lines = [f"<b>{html.escape(self.known.label)}</b> &nbsp; {html.escape(self.words())}",
                 html.escape(self.known.tooltip)]
        if self.default is not None:
            lines.append(f"Usually {html.escape(self.words_of(self.default))}.{html.escape(self.limits())}")
        lines.append(f"<span style='color:{look_of().theme.dim}'>{html.escape(self.gestures())}</span>")
        return "<p style='white-space:normal'>" + "<br>".join(lines) + "</p>"

    def words_of(self, value: Any) -> str:
        """Any value of this field in words."""
        return str(value)

    def limits(self) -> str:
        """What may be typed, in words that follow a sentence, or ""."""
        return ""

    def gestures(self) -> str:
        """How it is edited, in a few words."""
        return "Right button: reset, copy, paste"

    def menu(self) -> QMenu:
        """The menu of the right button."""
        menu = QMenu(self)
        reset = menu.addAction(icon("reset"), "Reset")
        if self.default is not None:
            reset.setText(f"Reset to {self.words_of(self.default)}")
        reset.setEnabled(self.default is not None and self.default != self._value)
        reset.triggered.connect(lambda: self.enter(self.default))
        menu.addSeparator()
        copy = menu.addAction(icon("copy"), "Copy")
        copy.setShortcut(QKeySequence.StandardKey.Copy)
        copy.triggered.connect(self.copy)
        paste = menu.addAction("Paste")
        paste.setShortcut(QKeySequence.StandardKey.Paste)
        paste.setEnabled(bool(QGuiApplication.clipboard().text()))
        paste.triggered.connect(self.paste)
        if self.animatable:
            menu.addSeparator()
            menu.addAction(icon("key"), "Key here").triggered.connect(self.key_asked)
            menu.addAction(icon("expression"), "Expression…").triggered.connect(self.expression_asked)
        return menu

    def copy(self) -> None:
        """Put the value on the clipboard."""
        QGuiApplication.clipboard().setText(self.clipboard_text())

    def paste(self) -> None:
        """Take the value from the clipboard; what it does not understand leaves it as it is."""
        try:
            self.enter(self.from_text(QGuiApplication.clipboard().text()))
        except UserError as error:
            self.refused(error)

    def refused(self, error: UserError) -> None:
        """What was pasted could not be understood: say so in the tooltip's place, change nothing."""
        QToolTip.showText(self.mapToGlobal(QPoint(0, self.height())), str(error), self)

    def takes(self, event: QKeyEvent) -> bool:
        """Whether a key edits this field, so that no hotkey of the window may take it."""
        return event.matches(QKeySequence.StandardKey.Copy) or event.matches(QKeySequence.StandardKey.Paste)

    def event(self, event: QEvent) -> bool:
        if event.type() == QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent) and self.takes(event):
            event.accept()
            return True
        return super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.matches(QKeySequence.StandardKey.Copy):
            self.copy()
        elif event.matches(QKeySequence.StandardKey.Paste):
            self.paste()
        else:
            super().keyPressEvent(event)

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        menu = self.menu()
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        menu.popup(event.globalPos())

    def sizeHint(self) -> QSize:
        look = look_of()
        return QSize(look.label, look.row)

    def minimumSizeHint(self) -> QSize:
        look = look_of()
        return QSize(look.text * 4, look.row)

    def changeEvent(self, event: QEvent) -> None:
        if event.type() in (QEvent.Type.FontChange, QEvent.Type.StyleChange):
            self.updateGeometry()
        if event.type() == QEvent.Type.EnabledChange:
            self.cancel()
        super().changeEvent(event)

    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        self.focused.emit(True)

    def focusOutEvent(self, event: QFocusEvent) -> None:
        self.finish()
        super().focusOutEvent(event)
        self.focused.emit(False)

    def frame(self, painter: QPainter, look: Look) -> QRectF:
        """Paint the ground and frame of the bar; where its inside is."""
        area = QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        line = "accent" if self.hasFocus() else "dim" if self.underMouse() and self.isEnabled() else "line"
        painter.setPen(look.theme.colour(line, 0.6 if line == "dim" else 1.0))
        painter.setBrush(look.theme.colour("field"))
        painter.drawRoundedRect(area, 4.5, 4.5)
        return area.adjusted(0.5, 0.5, -0.5, -0.5)

    def ink(self, look: Look, name: str = "text") -> QColor:
        """The colour of words, faint when disabled."""
        return look.theme.colour(name if self.isEnabled() else "dim", 1.0 if self.isEnabled() else 0.6)
