"""Pictures of the window: the GL picture read from its framebuffer, put where it lies among the widgets."""

from __future__ import annotations

import runpy
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QPoint, QTimer
from PySide6.QtGui import QImage, QPainter, QPixmap
from PySide6.QtWidgets import QApplication, QWidget

from app.window.viewport_widget import Viewport
from core.errors import UserError

if TYPE_CHECKING:
    from app.window.main import MainWindow

LOOK_EVERY = 50  # ms between two looks whether everything has settled
CALM_LOOKS = 4  # in a row before it counts
LONGEST = 180.0  # seconds, then the picture is taken as it is


def view_image(viewport: Viewport) -> QImage:
    """What the viewport shows now."""
    return viewport.grabFramebuffer().convertToFormat(QImage.Format.Format_RGB32)


def window_image(window: MainWindow) -> QImage:
    """The whole window as it is on the screen, with whatever of its own lies over it."""
    ratio = window.devicePixelRatio()
    picture = QPixmap(window.size() * ratio)
    picture.setDevicePixelRatio(ratio)
    window.render(picture)
    painter = QPainter(picture)
    container = window.view.container
    if container.isVisible() and not window.view.floating:
        image = view_image(window.viewport)
        image.setDevicePixelRatio(ratio)
        painter.drawImage(container.mapTo(window, QPoint(0, 0)), image)
    for over in _windows_over(window):
        painter.drawPixmap(over.mapToGlobal(QPoint(0, 0)) - window.mapToGlobal(QPoint(0, 0)), over.grab())
    painter.end()
    return picture.toImage()


def _windows_over(window: QWidget) -> list[QWidget]:
    """Popups and dialogs of the window that are open, lowest first."""
    return [w for w in QApplication.topLevelWidgets() if w is not window and w.isVisible() and w.isWindow()]


class Photographer:
    """Waits until the window has settled, runs a script if there is one, saves the picture, and quits.

    exit_code : for the program, 1 when the script or the saving failed. failed : the reason in words.
    """

    def __init__(self, window: MainWindow, path: Path, after: Path | None, finish: Callable[[], object]) -> None:
        self._window, self._path, self._after, self._finish = window, path, after, finish
        self.failed = ""
        self._calm = 0
        self._looks = 0
        self._timer = QTimer(window, interval=LOOK_EVERY)
        self._timer.timeout.connect(self._look)
        self._timer.start()

    def _look(self) -> None:
        self._looks += 1
        self._calm = self._calm + 1 if self._window.settled else 0
        if self._calm < CALM_LOOKS and self._looks * LOOK_EVERY < 1e3 * LONGEST:
            return
        self._calm = self._looks = 0
        try:
            if self._after is not None:
                script, self._after = self._after, None
                run_script(script, self._window)
                return  # and wait again for what it has changed
            if not window_image(self._window).save(str(self._path)):
                raise UserError(f"{self._path} could not be written; choose another folder.")
        except Exception as error:
            self.failed = str(error)
        self._timer.stop()
        self._finish()


def run_script(script: Path, window: MainWindow) -> None:
    """Run a script with `window`, `desk` and `session` at hand. UserError with its line when it fails."""
    names = {"window": window, "desk": window.desk, "session": window.desk.session}
    try:
        runpy.run_path(str(script), names, "__main__")
    except UserError:
        raise
    except OSError as error:
        raise UserError(f"The script {script} cannot be read ({error.strerror}).") from error
    except Exception as error:
        lines = [f.lineno for f in traceback.extract_tb(sys.exc_info()[2]) if f.filename == str(script)]
        where = f" on line {lines[-1]}" if lines else ""
        raise UserError(f"{script.name} stopped{where}: {type(error).__name__}: {error}") from error
