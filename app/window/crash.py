"""When we are at fault: a report in a folder of this machine, a sentence in the window. Nothing is ever sent.

A report holds the traceback, versions, what OpenGL says of itself and the names of the last commands; never anything of
the document. Faults of native code leave theirs by faulthandler in a file that is kept open while the program runs;
the next start makes a report of it.
"""

from __future__ import annotations

import faulthandler
import fcntl
import hashlib
import importlib.metadata
import os
import platform
import shutil
import sys
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import IO, Any

import PySide6
from PySide6.QtCore import QObject, Signal, qVersion
from PySide6.QtWidgets import QWidget

from app.window.notice import NoticeBar, copy_text, open_folder
from core.formats.journal import state_folder

LAST_COMMANDS = 200
MOST_REPORTS = 20  # of one run; what fails sixty times a second fills no disk
MOST_KEPT = 50  # folders
LONGEST_MESSAGE = 500  # characters of an exception's own words
LARGEST_RUN = 4 << 20  # bytes of a run's file that are read
REPORT, TOLD, RUN = "report.txt", "told", "run-"
_FATAL = ("Fatal Python error", "Windows fatal exception")
_LIBRARIES = ("filoplume", "PySide6_Essentials", "moderngl", "numpy", "numba", "scipy", "usd-core", "msgspec", "av")


def crash_folder() -> Path:
    """Where reports of this person lie: beside the journals."""
    folder = state_folder()
    return (folder if os.environ.get("FILOPLUME_STATE") else folder.parent) / "crashes"


class CrashWatch(QObject):
    """Catches what nobody caught, on any thread, from :meth:`install` to :meth:`close`. One for a program.

    happened : a report was written (sentence, folder); arrives on the thread of the window.
    """

    happened = Signal(str, str)

    def __init__(self, folder: Path | None = None, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.folder = folder or crash_folder()
        self.commands: deque[str] = deque(maxlen=LAST_COMMANDS)
        self.gl = "not started"
        self._run: IO[bytes] | None = None
        self._seen: set[str] = set()
        self._lock = threading.Lock()
        self._before: tuple[Any, Any] | None = None

    def install(self) -> None:
        """Begin to watch. A folder that cannot be written is no reason not to start."""
        if self._before is not None:
            return
        self._before = sys.excepthook, threading.excepthook
        sys.excepthook = self._caught
        threading.excepthook = self._caught_in_thread
        with suppress(OSError):
            self.folder.mkdir(parents=True, exist_ok=True)
            self._run = open(self.folder / f"{RUN}{os.getpid()}-{time.time_ns():x}.txt", "wb", 0)  # noqa: SIM115
            with suppress(OSError):  # a file system without locks
                fcntl.flock(self._run, fcntl.LOCK_EX | fcntl.LOCK_NB)
            self._run.write(versions().encode())
            faulthandler.enable(self._run)

    def close(self) -> None:
        """Stop watching; a run that ends well leaves nothing."""
        if self._before is None:
            return
        sys.excepthook, threading.excepthook = self._before
        self._before = None
        if self._run is not None:
            faulthandler.disable()
            with suppress(OSError):
                Path(self._run.name).unlink(missing_ok=True)
                self._run.close()
            self._run = None

    def note(self, command: str) -> None:
        """A command was run: its name stands in the next report."""
        self.commands.append(command)
        self._write_run(f"command {command}\n")

    def note_gl(self, words: str) -> None:
        """What OpenGL says of itself: vendor, renderer, version."""
        self.gl = words
        self._write_run(f"OpenGL {words}\n")

    def last_run(self) -> str | None:
        """The folder of the newest crash the artist has not been told of, also of one that took the program with it.

        Asked once at a start; all of them count as told then.
        """
        found = ""
        with suppress(OSError):
            for file in sorted(self.folder.glob(f"{RUN}*.txt")):
                self._autopsy(file)
            for folder in sorted(path.parent for path in self.folder.glob(f"*/{REPORT}")):
                if not (folder / TOLD).exists():
                    found = str(folder)
                    (folder / TOLD).touch()
        return found or None

    def report(self, error: BaseException, where: str = "") -> str | None:
        """Write a report of an error; its folder, or None when there is one of it already, or the disk refuses."""
        text = _traceback(error)
        key = hashlib.sha256("".join(traceback.format_tb(error.__traceback__)).encode()).hexdigest()
        with self._lock:
            if key in self._seen or len(self._seen) >= MOST_REPORTS:
                return None
            self._seen.add(key)
            number = len(self._seen)
        parts = [versions() + f"OpenGL {self.gl}", "last commands, oldest first:", *self.commands, "",
                 f"on the thread {where or threading.current_thread().name}:", text]
        return self._write(f"{time.strftime('%Y%m%d-%H%M%S')}-{os.getpid()}-{number}", "\n".join(parts))

    def _caught(self, kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        if issubclass(kind, KeyboardInterrupt):
            sys.__excepthook__(kind, error, trace)
            return
        folder = self.report(error.with_traceback(trace))
        if folder is not None:
            sys.__excepthook__(kind, error, trace)  # for who started it in a terminal
            self.happened.emit(sentence(error), folder)

    def _caught_in_thread(self, args: Any) -> None:
        if args.exc_value is not None and args.exc_type is not SystemExit:
            self._caught(args.exc_type, args.exc_value, args.exc_traceback)

    def _write(self, name: str, text: str) -> str | None:
        folder = self.folder / name
        try:
            folder.mkdir(parents=True, exist_ok=True)
            (folder / REPORT).write_text(_without_home(text), "utf-8")
            for old in sorted(path.parent for path in self.folder.glob(f"*/{REPORT}"))[:-MOST_KEPT]:
                shutil.rmtree(old, ignore_errors=True)
        except OSError:
            return None
        return str(folder)

    def _write_run(self, text: str) -> None:
        if self._run is not None:
            with suppress(OSError):
                self._run.write(text.encode())

    def _autopsy(self, file: Path) -> None:
        """Write a report of a run that has ended, if it died of a fault; its file is removed."""
        with open(file, "rb") as run:
            try:
                fcntl.flock(run, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                return  # it runs
            run.seek(max(0, file.stat().st_size - LARGEST_RUN))
            lines = run.read().decode("utf-8", "replace").splitlines()
        commands = [line for line in lines if line.startswith("command ")]
        rest = [line for line in lines if not line.startswith("command ")]
        if any(line.startswith(_FATAL) for line in rest):
            text = "\n".join([*rest, "", "last commands, oldest first:", *commands[-LAST_COMMANDS:]])
            self._write(f"{time.strftime('%Y%m%d-%H%M%S')}-{file.stem}", text)
        file.unlink(missing_ok=True)


class CrashBar(NoticeBar):
    """One sentence on what went wrong, its details to copy and the folder of its report."""

    def __init__(
        self, watch: CrashWatch, open_it: Callable[[object], object] = open_folder, parent: QWidget | None = None
    ) -> None:
        super().__init__("warning", parent)
        self._folder = ""
        self.button("Copy details", "Copies the report, to paste it where you tell us about it.", self._copy)
        self.button("Open folder", "Shows the folder of the report on this machine.", lambda: open_it(self._folder))
        watch.happened.connect(self.tell_of)

    def tell_of(self, words: str, folder: str) -> None:
        """Show it for the report in a folder."""
        self._folder = folder
        self.tell(words)
        with suppress(OSError):
            (Path(folder) / TOLD).touch()

    def tell_of_last_run(self, watch: CrashWatch) -> None:
        """Mention what the last run died of, if it did."""
        folder = watch.last_run()
        if folder is not None:
            self.tell_of("Filoplume ended by a fault of its own the last time; a report of it lies on this machine.",
                         folder)

    def _copy(self) -> None:
        with suppress(OSError):
            copy_text((Path(self._folder) / REPORT).read_text("utf-8"))


def sentence(error: BaseException) -> str:
    """What the window says of an error that is our fault."""
    words = str(error).strip().splitlines()
    reason = f"{type(error).__name__}{': ' + words[0][:120] if words else ''}"
    return f"Something went wrong that is our fault ({reason}). Your work is safe; go on, and save soon."


def versions() -> str:
    """The versions of what matters, a line each."""
    lines = [f"Python {platform.python_version()}", f"system {platform.platform()}",
             f"Qt {qVersion()}, PySide {PySide6.__version__}"]
    for name in _LIBRARIES:
        with suppress(importlib.metadata.PackageNotFoundError):
            lines.append(f"{name} {importlib.metadata.version(name)}")
    return "\n".join(lines) + "\n"


def _traceback(error: BaseException) -> str:
    lines = []
    for line in "".join(traceback.format_exception(error)).splitlines():
        lines.append(line if len(line) <= LONGEST_MESSAGE else line[:LONGEST_MESSAGE] + "…")
    return "\n".join(lines)


def _without_home(text: str) -> str:
    home = os.path.expanduser("~")
    return text if len(home) < 4 else text.replace(home, "~")
