"""A bar of one sentence and what can be done about it: it waits for an answer and blocks nothing."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QEvent, QRectF, QSize, Qt, QUrl, Signal
from PySide6.QtGui import QDesktopServices, QGuiApplication, QPainter, QPaintEvent
from PySide6.QtWidgets import QHBoxLayout, QLabel, QPushButton, QSizePolicy, QWidget

from app.window.icons import IconButton, paint_icon
from app.window.theme import look_of


class NoticeBar(QWidget):
    """An icon, a sentence, buttons and a cross; hidden until :meth:`tell`.

    closed : the cross was clicked.
    """

    closed = Signal()

    def __init__(self, icon: str = "warning", parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._icon = icon
        self.sentence = QLabel()
        self.sentence.setWordWrap(True)
        self.sentence.setTextFormat(Qt.TextFormat.PlainText)
        self.sentence.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.sentence.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        self.close_button = IconButton("close", "Closes this message; nothing is lost by it.")
        self.close_button.clicked.connect(self._close)
        self.buttons: dict[str, QPushButton] = {}
        self._line = QHBoxLayout(self)
        self._line.addWidget(self.sentence, 1)
        self._line.addWidget(self.close_button)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Maximum)
        self._measure()
        self.hide()

    def button(self, label: str, tooltip: str, run: Callable[[], object]) -> QPushButton:
        """Add a button, to the right of the others."""
        made = QPushButton(label)
        made.setToolTip(tooltip)
        made.clicked.connect(lambda: run())
        self._line.insertWidget(self._line.count() - 1, made)
        self.buttons[label] = made
        return made

    def tell(self, sentence: str) -> None:
        """Show it with this sentence."""
        self._measure()
        self.sentence.setText(sentence)
        self.show()

    def paintEvent(self, event: QPaintEvent) -> None:
        look = look_of()
        painter = QPainter(self)
        painter.fillRect(self.rect(), look.theme.colour("accent_ground"))
        side = float(look.icon)
        place = QRectF(look.gap + look.grid, (self.height() - side) / 2, side, side)
        paint_icon(painter, self._icon, place, look.theme.colour("accent"))

    def sizeHint(self) -> QSize:
        look = look_of()
        return super().sizeHint().expandedTo(QSize(0, look.row + 2 * look.grid))

    def changeEvent(self, event: QEvent) -> None:
        if event.type() in (QEvent.Type.FontChange, QEvent.Type.StyleChange):
            self._measure()
        super().changeEvent(event)

    def _measure(self) -> None:
        look = look_of()
        self._line.setContentsMargins(2 * look.gap + look.icon, look.grid, look.gap, look.grid)
        self._line.setSpacing(look.gap)

    def _close(self) -> None:
        self.hide()
        self.closed.emit()


def open_folder(folder: object) -> bool:
    """Show a folder in the file browser of the system."""
    return QDesktopServices.openUrl(QUrl.fromLocalFile(str(folder)))


def copy_text(text: str) -> None:
    """Put a text on the clipboard."""
    QGuiApplication.clipboard().setText(text)
