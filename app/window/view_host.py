"""Where the viewport lives: in the main window, or floating in a window of its own on another screen."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, Qt, Signal
from PySide6.QtGui import QCloseEvent
from PySide6.QtWidgets import QLabel, QVBoxLayout, QWidget

from app.window.viewport_widget import Viewport


class ViewHost(QWidget):
    """The viewport's place in the main window; :meth:`float_out` and :meth:`dock` move the viewport itself.

    The native window is only reparented, so that its OpenGL context and everything in it stays.
    """

    moved = Signal()

    def __init__(self, viewport: Viewport, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.viewport = viewport
        self.container = QWidget.createWindowContainer(viewport, self)
        self.container.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.container.setMinimumSize(160, 120)
        self.container.setAcceptDrops(True)
        self.container.installEventFilter(self)
        self.trouble = QLabel()
        self.trouble.setWordWrap(True)
        self.trouble.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self.trouble.hide()
        self._floating: _Floating | None = None
        self._inside = QVBoxLayout(self)
        self._inside.setContentsMargins(0, 0, 0, 0)
        self._inside.addWidget(self.container, 1)
        self._inside.addWidget(self.trouble, 1)

    @property
    def floating(self) -> bool:
        """True while the viewport is in a window of its own."""
        return self._floating is not None

    @property
    def shows_picture(self) -> bool:
        """True when the viewport is on the screen, wherever."""
        return self.viewport.isExposed()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """The container has its new size before the viewport, which the window system resizes, hears of it."""
        if event.type() == QEvent.Type.Resize:
            self.viewport.await_size()
        return super().eventFilter(watched, event)

    def float_out(self) -> None:
        """Give the viewport a window of its own; closing that brings it back."""
        if self._floating is None and self.trouble.isHidden():
            self._floating = _Floating(self)
            self._floating.resize(self.container.size())
            self._floating.take(self.container)
            self._floating.show()
            self.moved.emit()

    def dock(self) -> None:
        """Bring the viewport back into the main window."""
        floating, self._floating = self._floating, None
        if floating is not None:
            self._inside.insertWidget(0, self.container, 1)
            self.container.show()
            floating.close()
            self.moved.emit()

    def show_trouble(self, sentence: str) -> None:
        """A sentence in place of the picture that cannot be drawn."""
        self.dock()
        self.container.hide()
        self.trouble.setText(sentence)
        self.trouble.show()


class _Floating(QWidget):
    """The window of a floating viewport."""

    def __init__(self, host: ViewHost) -> None:
        super().__init__(host, Qt.WindowType.Window)
        self._host = host
        self.setWindowTitle("View – filoplume")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self._inside = QVBoxLayout(self)
        self._inside.setContentsMargins(0, 0, 0, 0)

    def take(self, container: QWidget) -> None:
        """Hold the viewport's container."""
        self._inside.addWidget(container)
        container.show()

    def closeEvent(self, event: QCloseEvent) -> None:
        """The viewport goes back to the main window."""
        self._host.dock()
        event.accept()
