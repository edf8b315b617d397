"""The start of the window: a frame on the screen at once, the rest behind it; every trouble is one sentence.

After an update (and the first time) the kernels are compiled by a child process, so that the frame stays alive, says
how far that is, and already takes what is to be opened.
"""

from __future__ import annotations

import gc
import importlib
import os
import sys
import traceback
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from PySide6.QtCore import QMessageLogContext, QProcess, Qt, QTimer, QtMsgType, qInstallMessageHandler
from PySide6.QtGui import QCloseEvent
from PySide6.QtWidgets import QApplication, QLabel, QProgressBar, QPushButton, QVBoxLayout, QWidget

from app.display import has_display
from app.window.garbage import Garbage
from app.window.memory import keep_freed_memory
from app.window.settings import LoadedSettings, load_settings
from app.window.theme import apply, load_theme, look_of
from core.errors import UserError
from core.formats.plate_file import is_plate
from core.kernel_cache import kernels_compiled

if TYPE_CHECKING:
    from app.window.main import MainWindow

NO_DISPLAY = (
    "The window needs a display, and there is none here; start it on a desktop, or use a command that needs no window "
    "(filoplume --help lists them)."
)
NO_PLUGIN = (
    "No window can be opened on this display. Either it cannot be reached, or libraries are missing: "
    "sudo apt install libxcb-cursor0 libxkbcommon-x11-0 libxcb-icccm4 libxcb-keysyms1 libxcb-shape0 libegl1."
)
DEMO = "demo"


class Wish(NamedTuple):
    """What the command line asks of the window.

    file : to open, or None. demo : open the demo animal. size : of the window in pixels, or None.
    screenshot : where to save a picture of the window before leaving, or None. after : a script to run before that.
    safe : start without a studio's own tools.
    """

    file: Path | None = None
    demo: bool = False
    size: tuple[int, int] | None = None
    screenshot: Path | None = None
    after: Path | None = None
    safe: bool = False


def run(wish: Wish) -> int:
    """Open the window and stay until it is closed; the exit code.

    Raises
    ------
    UserError
        There is no display, or the picture asked for could not be made.
    """
    for path, what in ((wish.file, "file"), (wish.after, "script")):
        if path is not None and not (path.is_file() or is_plate(path)):
            raise UserError(f"there is no {what} {path}")
    if not has_display():
        raise UserError(NO_DISPLAY)
    keep_freed_memory()
    qInstallMessageHandler(_qt_says)
    # every sample of mouse and pen is wanted: they are gathered for each picture, not thrown away
    QApplication.setAttribute(Qt.ApplicationAttribute.AA_CompressHighFrequencyEvents, False)
    QApplication.setAttribute(Qt.ApplicationAttribute.AA_CompressTabletEvents, False)
    QApplication.setHighDpiScaleFactorRoundingPolicy(Qt.HighDpiScaleFactorRoundingPolicy.PassThrough)
    application = QApplication(["filoplume"])
    application.setApplicationName("filoplume")
    application.setDesktopFileName("filoplume")
    loaded = load_settings()
    apply(application, load_theme(loaded.settings.theme), loaded.settings.text_size)
    frame = StartFrame(wish, loaded)
    frame.show()
    garbage = Garbage(application)
    code = application.exec()
    garbage.stop()
    reason = frame.failed
    frame.deleteLater()
    if reason:
        raise UserError(reason)
    return code


class StartFrame(QWidget):
    """What is seen before the window is there. It takes what is to be opened, and can be closed.

    window : the main window, once it is there. failed : why the picture that was asked for could not be made, or "".
    """

    def __init__(self, wish: Wish, loaded: LoadedSettings) -> None:
        super().__init__()
        self._wish, self._loaded = wish, loaded
        self.window_made: MainWindow | None = None
        self.failed = ""
        self._child: QProcess | None = None
        self.setWindowTitle("filoplume")
        self.resize(*(wish.size or (1600, 1000)))
        self.words, self.bar = QLabel("Starting…"), QProgressBar()
        self.words.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self.bar.setTextVisible(False)
        self.bar.setFixedSize(280, look_of().grid + 2)
        self.bar.hide()
        self.choice = QPushButton("Open the demo animal when ready")
        self.choice.setToolTip("The demo opens as soon as this is done; you may close the window at any time.")
        self.choice.setCheckable(True)
        self.choice.setVisible(False)
        column = QVBoxLayout(self)
        column.addStretch(1)
        for widget in (self.words, self.bar, self.choice):
            column.addWidget(widget, 0, Qt.AlignmentFlag.AlignHCenter)
        column.addStretch(1)
        QTimer.singleShot(0, self._begin)

    def closeEvent(self, event: QCloseEvent) -> None:
        """Leave: nothing has begun that needs an end."""
        if self._child is not None:
            self._child.kill()
            self._child.waitForFinished(2000)
        event.accept()

    def _begin(self) -> None:
        if kernels_compiled():
            # the frame is painted before the libraries are loaded
            QTimer.singleShot(30, self._open)
            return
        self.words.setText("Compiling for this computer. It happens once after an update and takes about a minute.")
        self.bar.setRange(0, 0)
        self.bar.show()
        self.choice.setVisible(self._wish.file is None and not self._wish.demo and self._wish.screenshot is None)
        self._child = QProcess(self)
        self._child.setProcessChannelMode(QProcess.ProcessChannelMode.MergedChannels)
        self._child.readyReadStandardOutput.connect(self._progress)
        self._child.finished.connect(lambda code, status: self._open())
        self._child.errorOccurred.connect(self._no_child)
        self._child.start(sys.executable, ["-m", "app.compile_kernels"])

    def _no_child(self, error: QProcess.ProcessError) -> None:
        if error == QProcess.ProcessError.FailedToStart:
            self._open()

    def _progress(self) -> None:
        if self._child is None:
            return
        for line in self._child.readAllStandardOutput().data().decode().splitlines():
            done, _, whole = line.partition(" ")
            if done.isdigit() and whole.isdigit():
                self.bar.setRange(0, int(whole))
                self.bar.setValue(int(done))

    def _open(self) -> None:
        if not self.isVisible():
            return
        self._child = None
        wish = self._wish._replace(demo=self._wish.demo or self.choice.isChecked())
        try:
            window = open_window(wish, self._loaded)
        except Exception as error:  # a window that cannot be made must not leave this one waiting for ever
            self._give_up(error)
            return
        self.window_made = window
        if wish.screenshot is not None:
            from app.window.screenshot import Photographer

            window.photographer = Photographer(window, wish.screenshot, wish.after, lambda: self._photographed(window))
        elif wish.after is not None:
            self._after(window, wish.after)
        self.hide()

    def _give_up(self, error: Exception) -> None:
        self.failed = f"The window could not be opened ({type(error).__name__}: {error})."
        if not isinstance(error, UserError):
            os.write(2, traceback.format_exc().encode())
        self.close()

    def _after(self, window: MainWindow, script: Path) -> None:
        from app.window.screenshot import run_script

        window.when_settled(lambda: window.desk.attempt(run_script, script, window))

    def _photographed(self, window: MainWindow) -> None:
        assert window.photographer is not None
        self.failed = window.photographer.failed
        window.close_unasked()


def open_window(wish: Wish, loaded: LoadedSettings) -> MainWindow:
    """Make the window, show it, begin to open what was wished for."""
    from app.window.main import MainWindow
    from core.formats.journal import Journal
    from tools.registry import Registry
    from tools.session import Session

    registry = Registry(folders=()) if wish.safe else Registry(folders=_plugin_folders(loaded))
    window = MainWindow(Session(journal=Journal(), tools=registry), loaded.settings)
    if wish.size is not None:
        window.resize(*wish.size)
    window.show()
    if loaded.trouble:
        window.desk.error(UserError(loaded.trouble))
    if wish.file is not None:
        window.desk.attempt(window.opening.open, wish.file)
    elif wish.demo:
        window.opening.open_demo()
    if wish.screenshot is None:
        window.offer_lost_work()
    window.desk.session_replaced.connect(gc.collect)  # what hung on the old document goes with it
    # what draws comes with every kernel of a coat: it is loaded while the artist looks where to begin
    window.desk.jobs.start(
        "Loading", lambda progress, cancelled: importlib.import_module("app.window.live_picture"), lambda module: None)
    return window


def _plugin_folders(loaded: LoadedSettings) -> tuple[Path, ...] | None:
    """Folders of a studio's own tools: those of the environment and that of the preferences."""
    from tools.registry import PLUGINS

    own = loaded.settings.plugin_folder
    if not own:
        return None
    return (*(Path(part) for part in os.environ.get(PLUGINS, "").split(os.pathsep) if part), Path(own))


def _qt_says(kind: QtMsgType, context: QMessageLogContext, message: str) -> None:
    """Qt's own words go to standard error; what would end in an abort becomes one sentence."""
    if kind == QtMsgType.QtFatalMsg:
        words = NO_PLUGIN if "platform plugin" in message or "display" in message else message
        os.write(2, f"filoplume: {words}\n".encode())
        os._exit(1)
    if "platform plugin" in message or "xcb-cursor" in message or "could not connect to display" in message:
        return  # said in the sentence above
    os.write(2, f"qt: {message}\n".encode())


