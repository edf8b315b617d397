"""A line to type into that says below itself, in words, what is wrong with what was typed."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QPoint, Qt, Signal
from PySide6.QtGui import QFocusEvent, QKeyEvent
from PySide6.QtWidgets import QLabel, QLineEdit, QWidget

from app.window.theme import look_of
from core.expression import ExpressionError


class MathEdit(QLineEdit):
    """A line edit that offers its text on Enter and keeps it when it is refused.

    entered : Enter, with the text. left : Tab or a click elsewhere, with the text. given_up : Esc.
    """

    entered = Signal(str)
    left = Signal(str)
    given_up = Signal()

    def __init__(self, text: str, name: str, parent: QWidget) -> None:
        super().__init__(text, parent)
        self.setAccessibleName(name)
        self.setTextMargins(-2, 0, -2, 0)  # so that the words stand where the bar has them
        self._note: QLabel | None = None
        self.textEdited.connect(lambda _: self.clear_fault())

    @property
    def fault(self) -> str:
        """What is wrong with the text, or ""."""
        return "" if self._note is None else self._note.text()

    def refuse(self, error: Exception) -> None:
        """Show what is wrong, with the cursor where it is."""
        self.clear_fault()
        message = error.message if isinstance(error, ExpressionError) else str(error)
        if isinstance(error, ExpressionError):
            self.setCursorPosition(min(error.column - 1, len(self.text())))
        note = QLabel(message[:1].upper() + message[1:], self.window())
        theme = look_of().theme
        note.setStyleSheet(
            f"background: {theme.field}; color: {theme.trouble_text}; border: 1px solid {theme.trouble};"
            f" border-radius: 5px; padding: 4px 8px;")
        note.setWordWrap(True)
        note.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._note = note
        self._place()
        note.show()
        note.raise_()
        self._mark(True)
        self.setAccessibleDescription(message)

    def clear_fault(self) -> None:
        """Take the note away."""
        note, self._note = self._note, None
        if note is not None:
            note.hide()
            note.deleteLater()
            self._mark(False)

    def _mark(self, faulty: bool) -> None:
        self.setProperty("fault", faulty)
        self.style().unpolish(self)
        self.style().polish(self)

    def _place(self) -> None:
        if self._note is None:
            return
        window = self.window()
        width = min(max(self.width(), 240), window.width())
        self._note.setFixedWidth(width)
        self._note.adjustSize()
        corner = self.mapTo(window, QPoint(self.width() - width, self.height() + 4))
        below = corner.y() + self._note.height() <= window.height()
        y = corner.y() if below else self.mapTo(window, QPoint(0, 0)).y() - 4 - self._note.height()
        self._note.move(max(0, corner.x()), max(0, y))

    def event(self, event: QEvent) -> bool:
        # a key that edits must not be taken by a hotkey of the window
        if event.type() == QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent) and (
            event.key() == Qt.Key.Key_Escape or (event.text() and event.text().isprintable())
        ):
            event.accept()
            return True
        return super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self.entered.emit(self.text())
        elif event.key() == Qt.Key.Key_Escape:
            self.clear_fault()
            self.given_up.emit()
        else:
            super().keyPressEvent(event)

    def focusOutEvent(self, event: QFocusEvent) -> None:
        super().focusOutEvent(event)
        if event.reason() not in (Qt.FocusReason.PopupFocusReason, Qt.FocusReason.ActiveWindowFocusReason):
            self.clear_fault()
            self.left.emit(self.text())

    def hideEvent(self, event: QEvent) -> None:
        self.clear_fault()
        super().hideEvent(event)
