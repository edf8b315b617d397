"""The real window: pointer to picture in a comb stroke, refinement at rest, stalls, start, idle, memory.

Runs on the display there is, else on an Xvfb of its own. The demo animal with 2,500 guides shown and 100,000 hairs; a
view of 1600 x 1000 pixels.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from core.errors import UserError
from tests.bench.bench import Row
from tests.display import ensure_display

TITLE = "Window"
HAIRS, GUIDES = 100_000, 2_500
SIZE = (1600, 1000)
MOVES = 240
EVERY_MS = 16
LONGEST_STALL = 100.0  # ms
ASKING = {  # commands that open a dialog, leave, or change this machine
    "file.new", "file.quit", "window.safe_mode", "window.full_screen",
}
BLANK = """
import os, time
from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QApplication
from app.cli import main
def look():
    made = [w for w in QApplication.topLevelWidgets() if hasattr(w, "doors")]
    if made and made[0].doors.isVisible():
        print(time.time() - float(os.environ["STARTED"]), flush=True)
        os._exit(0)
def watched(self):
    timer = QTimer(self, interval=10)
    timer.timeout.connect(look)
    timer.start()
    return begin()
begin, QApplication.exec = QApplication.exec, watched
main(["window"])
"""


def run() -> list[Row]:
    """Rows of the table."""
    reason = ensure_display()
    if reason is not None:
        raise UserError(reason)
    with tempfile.TemporaryDirectory() as folder:
        os.environ["FILOPLUME_STATE"] = str(Path(folder) / "journals")
        os.environ["FILOPLUME_SETTINGS"] = str(Path(folder) / "settings")
        rows = [_start_time()]
        with _Bench() as bench:
            rows += bench.stroke()
            rows += bench.rest()
            rows += [bench.idle(), *bench.tour(), *bench.commands()]
        rows.append(_memory())
    return rows


def _start_time() -> Row:
    """Seconds from the command to the window with its doors, with a warm cache: of kernels, and of Python's own."""
    seconds = []
    own = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    for _ in range(3):
        done = subprocess.run(
            [sys.executable, "-c", BLANK], capture_output=True, text=True, timeout=300, check=True,
            env={**own, "STARTED": str(time.time())})
        seconds.append(float(done.stdout.split()[-1]))
    return Row("start to usable window (second start)", round(float(np.median(seconds[1:])), 2), "s", 3.0)


class _Bench:
    """A window with the demo in it."""

    def __enter__(self) -> _Bench:
        from PySide6.QtCore import QCoreApplication, Qt
        from PySide6.QtWidgets import QApplication

        from app.window.garbage import Garbage
        from app.window.main import MainWindow, fresh_workspace
        from app.window.memory import keep_freed_memory
        from app.window.settings import Settings
        from app.window.theme import apply, load_theme
        from core.demo import demo_document
        from core.evaluator import Evaluator
        from core.formats.journal import Journal
        from tools.session import Session

        QCoreApplication.setAttribute(Qt.ApplicationAttribute.AA_CompressHighFrequencyEvents, False)
        application = QApplication.instance() or QApplication(["bench"])
        assert isinstance(application, QApplication)
        keep_freed_memory()  # this and the collector as the program's start does
        self.garbage = Garbage(application)
        apply(application, load_theme("dark"))
        evaluator = Evaluator()
        document = demo_document(evaluator, HAIRS, GUIDES)
        workspace = fresh_workspace()
        workspace = workspace.replace(view=workspace.view.replace(guides=True), frame=float(document.first_frame))
        self.window = MainWindow(
            Session(document, workspace, journal=Journal(), evaluator=evaluator), Settings())
        self.view = self.window.viewport
        self.window.show()
        self.until(self.view.isExposed)
        grow = self.window.size() - self.view.size()
        self.window.resize(SIZE[0] + grow.width(), SIZE[1] + grow.height())
        self.until(lambda: self.window.settled, 120)
        return self

    def __exit__(self, *_: object) -> None:
        self.window.close()
        self.garbage.stop()

    def until(self, true: Callable[[], bool], seconds: float = 30.0) -> None:
        from PySide6.QtTest import QTest

        end = time.monotonic() + seconds
        while not true():
            if time.monotonic() > end:
                raise UserError("the window did not come to what was waited for")
            QTest.qWait(2)

    def stroke(self) -> list[Row]:
        """Moves of the mouse at 60 Hz; from posting each to the swap of the first picture that shows it."""
        from PySide6.QtCore import QCoreApplication, QEvent, QPointF, Qt, QTimer
        from PySide6.QtGui import QMouseEvent

        view, left = self.view, Qt.MouseButton.LeftButton
        posted: list[float] = []
        waiting: list[float] = []
        found: list[float] = []
        frame, draw = view.gestures.frame, view.picture.draw  # type: ignore[union-attr]
        shown: list[int] = []

        def gathered() -> None:
            waiting.extend(posted)
            posted.clear()
            frame()

        def drawn() -> None:
            draw()
            shown.append(view.picture.shown)  # type: ignore[union-attr]

        def painted() -> None:
            now = time.perf_counter()
            found.extend(now - then for then in waiting)
            waiting.clear()

        def send(kind: QEvent.Type, x: float, y: float) -> None:
            where = QPointF(x, y)
            button = Qt.MouseButton.NoButton if kind == QEvent.Type.MouseMove else left
            buttons = Qt.MouseButton.NoButton if kind == QEvent.Type.MouseButtonRelease else left
            QCoreApplication.postEvent(view, QMouseEvent(
                kind, where, QPointF(view.mapToGlobal(where)), button, buttons, Qt.KeyboardModifier.NoModifier))

        view.gestures.frame = gathered  # type: ignore[method-assign]
        view.picture.draw = drawn  # type: ignore[method-assign,union-attr]
        view.painted.connect(painted)
        count = 0
        x, y = 0.52 * view.width(), 0.45 * view.height()
        send(QEvent.Type.MouseButtonPress, x, y)
        timer = QTimer()

        def move() -> None:
            nonlocal count
            count += 1
            along = 90.0 * np.sin(count / 14.0)
            posted.append(time.perf_counter())
            send(QEvent.Type.MouseMove, x + along, y - 0.4 * along)
            if count == MOVES:
                timer.stop()
                send(QEvent.Type.MouseButtonRelease, x + along, y - 0.4 * along)

        timer.timeout.connect(move)
        timer.start(EVERY_MS)
        self.until(lambda: count == MOVES and not self.window.desk.session.stroking, 60)
        view.painted.disconnect(painted)
        view.gestures.frame, view.picture.draw = frame, draw  # type: ignore[method-assign,union-attr]
        late = 1e3 * np.array(found[20:])
        return [
            Row("pointer to picture, comb stroke, median", round(float(np.median(late)), 1), "ms", 33.0),
            Row("pointer to picture, comb stroke, 95 %", round(float(np.percentile(late, 95)), 1), "ms", 50.0),
            Row("hairs evaluated while the hand moves", view.picture.density.drawn, "hairs",  # type: ignore[union-attr]
                3000, True),
            Row("hairs drawn on the near side", int(np.median(shown)), "hairs"),
        ]

    def rest(self) -> list[Row]:
        """From the release to all hairs and to the finished picture."""
        self.until(lambda: self.window.settled, 120)
        full: list[float] = []
        begin = time.perf_counter()
        self.window.desk.session.undo()
        view = self.view
        before = view.refined_frames

        def look() -> bool:
            if view.refined_frames > before and not full:
                full.append(time.perf_counter() - begin)
            return self.window.settled

        self.until(look, 120)
        done = time.perf_counter() - begin
        return [
            Row("all hairs at rest after a step", round(full[0] if full else done, 2), "s", 2.0),
            Row("finished picture at rest", round(done, 2), "s", 5.0),
        ]

    def idle(self) -> Row:
        """CPU of five seconds in which nothing happens."""
        from PySide6.QtTest import QTest

        QTest.qWait(500)
        before, frames = time.process_time(), self.view.frames
        QTest.qWait(5000)
        spent = 1e3 * (time.process_time() - before)
        assert self.view.frames == frames
        return Row("CPU of 5 s at rest (the measuring itself included)", round(spent, 0), "ms", 100.0)

    def tour(self) -> list[Row]:
        """A session by hand: every part of it, and the longest time the event loop did not come round meanwhile."""
        from PySide6.QtTest import QTest

        window, folder = self.window, Path(os.environ["FILOPLUME_STATE"]).parent
        run = window.commands.run

        def stroke(tool: str) -> Callable[[], None]:
            def go() -> None:
                run(f"tool.{tool}")
                self._drag()
            return go

        def save() -> None:
            window.desk.session.save(folder / "tour.fplume")
            window.show_saved()

        parts: list[tuple[str, Callable[[], object]]] = [
            *((name, stroke(name)) for name in ("plant", "comb", "clone", "hairspray")),
            ("undo", lambda: run("edit.undo")), ("redo", lambda: run("edit.redo")), ("save", save),
            ("comb again", stroke("comb")),
            ("open", lambda: window.open_file(folder / "tour.fplume")),
            ("comb after opening", stroke("comb")),
        ]
        with _Beat() as beat:
            for name, go in parts:
                beat.during = name
                go()
                QTest.qWait(100)
                self.until(lambda: self.window.settled, 60)
        return beat.rows("tour by hand")

    def _drag(self) -> None:
        """A short drag over the animal, by real mouse events."""
        from PySide6.QtCore import QPoint, Qt
        from PySide6.QtTest import QTest

        view, left = self.view, Qt.MouseButton.LeftButton
        x, y = round(0.52 * view.width()), round(0.45 * view.height())
        QTest.mousePress(view, left, Qt.KeyboardModifier.NoModifier, QPoint(x, y))
        for step in range(12):
            QTest.mouseMove(view, QPoint(x + 6 * step, y - 2 * step))
            QTest.qWait(EVERY_MS)
        QTest.mouseRelease(view, left, Qt.KeyboardModifier.NoModifier, QPoint(x + 70, y - 24))

    def commands(self) -> list[Row]:
        """Every command of the palette that asks nothing, once, each when what the last caused is done."""
        from PySide6.QtTest import QTest
        from PySide6.QtWidgets import QApplication

        with _Beat() as beat:
            for command in list(self.window.commands):
                if command.name in ASKING or command.label.endswith("…"):
                    continue
                beat.during = command.name
                self.window.commands.run(command.name)
                QTest.qWait(120)
                if self.window.playing:
                    self.window.toggle_playback()
                for popup in (QApplication.activePopupWidget(), QApplication.activeModalWidget()):
                    if popup is not None:
                        popup.close()
                self.until(lambda: self.window.settled, 60)
        return beat.rows("all commands")


class _Beat:
    """How long the event loop did not come round, and what was going on then."""

    def __init__(self) -> None:
        from PySide6.QtCore import QTimer

        self.during = ""
        self.worst: dict[str, float] = {}
        self._last = time.perf_counter()
        self._timer = QTimer()
        self._timer.timeout.connect(self._come_round)

    def __enter__(self) -> _Beat:
        self._last = time.perf_counter()
        self._timer.start(2)
        return self

    def __exit__(self, *_: object) -> None:
        self._timer.stop()

    def _come_round(self) -> None:
        now = time.perf_counter()
        self.worst[self.during] = max(self.worst.get(self.during, 0.0), 1e3 * (now - self._last))
        self._last = now

    def rows(self, what: str) -> list[Row]:
        """The longest of all, and whatever else was too long."""
        found = sorted(((late, name) for name, late in self.worst.items()), reverse=True)
        late = [(f"  {name}", late) for late, name in found[1:] if late > LONGEST_STALL]
        first = (f"longest stall, {what}: {len(found)} things ({found[0][1]})", found[0][0])
        return [Row(name, round(ms, 0), "ms", LONGEST_STALL) for name, ms in (first, *late)]


def _memory() -> Row:
    """Growth of a process of its own over 200 windows opened and closed, the first 50 not counted."""
    done = subprocess.run(
        [sys.executable, "-c", "from tests.bench import window; print(window.growth_of_windows())"],
        capture_output=True, text=True, timeout=600, check=True)
    return Row("memory of 150 windows opened and closed", float(done.stdout.split()[-1]), "MB", 20.0)


def growth_of_windows() -> float:
    """Megabytes that 150 windows leave behind in this process, after 50 others; collected as the program does."""
    from PySide6.QtCore import QEvent
    from PySide6.QtTest import QTest
    from PySide6.QtWidgets import QApplication

    from app.window.garbage import Garbage
    from app.window.main import MainWindow, fresh_workspace
    from app.window.memory import keep_freed_memory
    from app.window.settings import Settings
    from tests.documents import small_document
    from tools.session import Session

    keep_freed_memory()
    application = QApplication(["bench"])
    garbage = Garbage(application)
    sizes: list[float] = []
    for number in range(200):
        window = MainWindow(Session(small_document(), fresh_workspace()), Settings())
        window.show()
        while not window.viewport.isExposed():
            QTest.qWait(2)
        window.close()
        QTest.qWait(1)
        QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
        garbage.look()
        if number >= 45 and (number < 55 or number >= 190):  # ten each, as the heap breathes
            sizes.append(_resident())
    garbage.stop()
    return round(float(np.median(sizes[10:]) - np.median(sizes[:10])), 1)


def _resident() -> float:
    """Megabytes of this process now."""
    pages = Path("/proc/self/statm")
    if pages.exists():
        return int(pages.read_text().split()[1]) * resource.getpagesize() / 1e6
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
