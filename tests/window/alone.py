"""A hand at a real window without pytest: for programs that make pictures."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication
from pytestqt.qt_compat import qt_api
from pytestqt.qtbot import QtBot

from app.window.main import MainWindow, fresh_workspace
from app.window.settings import Settings
from app.window.theme import apply, load_theme
from core.document import Document
from core.formats.journal import Journal
from tests.window.hand import Hand
from tools.session import Session


def application() -> QApplication:
    """The application of this process, made as the program makes it."""
    present = QApplication.instance()
    if isinstance(present, QApplication):
        return present
    QApplication.setAttribute(Qt.ApplicationAttribute.AA_CompressHighFrequencyEvents, False)
    QApplication.setHighDpiScaleFactorRoundingPolicy(Qt.HighDpiScaleFactorRoundingPolicy.PassThrough)
    return QApplication(["filoplume"])


def hand_at(
    document: Document | None, size: tuple[int, int], settings: Settings | None = None, folder: Path | None = None,
    managed: bool = True,
) -> Hand:
    """A hand at a window of its own.

    Parameters
    ----------
    size : of the window. folder : of preferences; None for the usual one. managed : False keeps window managers off,
        which change sizes at broken scales; such a window has no keyboard.
    """
    settings = settings or Settings()
    qt_api.set_qt_api("pyside6")
    apply(application(), load_theme(settings.theme), settings.text_size)
    window = MainWindow(Session(document, fresh_workspace(), journal=Journal()), settings, folder)
    if not managed:
        window.setWindowFlag(Qt.WindowType.X11BypassWindowManagerHint)
    window.top.clock = lambda: 0.0  # pictures do not tell how long they took
    window.resize(*size)
    window.show()
    bot = QtBot(None)  # type: ignore[arg-type] # it only waits here, for which it needs no test
    bot.waitExposed(window)
    hand = Hand(window, bot)
    if document is not None and document.meshes:
        hand.until(lambda: window.viewport.isExposed())
        hand.rest()
    return hand
