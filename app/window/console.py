"""The Python console: the open document at hand, every edit an undo step, a runaway loop can be stopped."""

from __future__ import annotations

import code
import io
import rlcompleter
import signal
import sys
import threading
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from types import CodeType, FrameType
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QKeyEvent, QTextCharFormat, QTextCursor, QTextFormat
from PySide6.QtWidgets import QApplication, QPlainTextEdit, QVBoxLayout, QWidget

import core
import tools
from app.window.theme import code_font, look_of
from core.document import Document
from core.errors import UserError

if TYPE_CHECKING:
    from app.window.desk import Desk

FILE = "<console>"
MOST_LINES = 5000
TROUBLE = QTextFormat.Property.UserProperty  # of text that is red
MOST_COMPLETIONS = 200
PATIENCE = 0.3  # seconds a line may take before the window is kept alive beside it
BEAT = 0.05
STEP = "Console"
WELCOME = (
    "document, session, core and tools are at hand. An assignment to document is a step that can be undone, and so "
    "is session.edit(name, function). Shift+Return begins another line, Tab completes, Esc stops what runs."
)


class Console(QWidget):
    """What was said above, what is typed below."""

    def __init__(self, desk: Desk, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._desk = desk
        self.names: dict[str, Any] = {"__name__": "__console__", "core": core, "tools": tools}
        self._interpreter = _Interpreter(self)
        self.history: list[str] = []
        self._place = 0
        self.output = QPlainTextEdit(self)
        self.output.setReadOnly(True)
        self.output.setMaximumBlockCount(MOST_LINES)
        self.output.setAccessibleName("Console output")
        self.input = QPlainTextEdit(self)
        self.input.setPlaceholderText("Python…")
        self.input.setAccessibleName("Console input")
        self.input.setTabChangesFocus(False)
        self.input.installEventFilter(self)
        for part in (self.output, self.input):
            part.setLineWrapMode(QPlainTextEdit.LineWrapMode.WidgetWidth)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(4, 4, 4, 4)
        layout.setSpacing(4)
        layout.addWidget(self.output, 1)
        layout.addWidget(self.input)
        self.setFocusProxy(self.input)
        self._take_look()
        self.say(WELCOME + "\n")

    def changeEvent(self, event: QEvent) -> None:
        """Another theme or size of text."""
        if event.type() == QEvent.Type.StyleChange:
            self._take_look()
        super().changeEvent(event)

    def say(self, text: str, trouble: bool = False) -> None:
        """Add words to the output, red for trouble."""
        cursor = QTextCursor(self.output.document())
        cursor.movePosition(QTextCursor.MoveOperation.End)
        cursor.insertText(text, _trouble() if trouble else QTextCharFormat())
        self.output.verticalScrollBar().setValue(self.output.verticalScrollBar().maximum())

    def run(self, source: str) -> bool:
        """Run Python. False when it is only the beginning of something, which waits for its further lines."""
        compiled = self._interpreter.compiled(source)
        if compiled is None:
            return False
        self.say("\n".join(f"{'>>>' if i == 0 else '...'} {line}" for i, line in enumerate(source.split("\n"))) + "\n")
        self.history.append(source)
        self._place = len(self.history)
        if isinstance(compiled, CodeType):
            out, errors = _Writer(self, False), _Writer(self, True)
            with self._at_hand(), redirect_stdout(out), redirect_stderr(errors):
                shown = self.names["document"]
                with _stoppable():
                    self._interpreter.runcode(compiled)
                mine = self.names.get("document")
                if isinstance(mine, Document) and mine is not shown and mine is not self._desk.session.document:
                    self._desk.session.commit(STEP, mine)
        return True

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Return runs, Up and Down go through what was typed, Tab completes."""
        if watched is self.input and event.type() == QEvent.Type.KeyPress and isinstance(event, QKeyEvent):
            return self._key(event) or super().eventFilter(watched, event)
        return super().eventFilter(watched, event)

    def _key(self, event: QKeyEvent) -> bool:
        key, cursor = event.key(), self.input.textCursor()
        if key in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and not event.modifiers() & Qt.KeyboardModifier.ShiftModifier:
            if not cursor.atEnd():  # amidst several lines
                return False
            source = self.input.toPlainText()
            if not source.strip() or self.run(source):
                self.input.clear()
            else:
                cursor.insertText("\n" + _indent(source))
            return True
        if key == Qt.Key.Key_Up and cursor.blockNumber() == 0:
            return self._recall(-1)
        if key == Qt.Key.Key_Down and cursor.blockNumber() == self.input.blockCount() - 1:
            return self._recall(1)
        if key == Qt.Key.Key_Tab:
            self._complete(cursor)
            return True
        return False

    def _take_look(self) -> None:
        for part in (self.output, self.input):
            part.setFont(code_font(look_of()))
        self.input.setFixedHeight(5 * self.input.fontMetrics().lineSpacing() + 12)
        cursor, block = QTextCursor(self.output.document()), self.output.document().begin()
        while block.isValid():  # what is not red follows the palette by itself
            for piece in block:
                fragment = piece.fragment()
                if fragment.charFormat().hasProperty(TROUBLE):
                    cursor.setPosition(fragment.position())
                    cursor.setPosition(
                        fragment.position() + fragment.length(), QTextCursor.MoveMode.KeepAnchor)
                    cursor.setCharFormat(_trouble())
            block = block.next()

    @contextmanager
    def _at_hand(self) -> Iterator[None]:
        """The session and its document by name, only meanwhile: a name left behind would keep an old one alive."""
        self.names |= {"session": self._desk.session, "document": self._desk.session.document}
        before, sys.displayhook = sys.displayhook, _show  # Python's own keeps the last value as _
        try:
            yield
        finally:
            sys.displayhook = before
            self.names.pop("session", None)
            self.names.pop("document", None)

    def _recall(self, step: int) -> bool:
        place = self._place + step
        if not 0 <= place <= len(self.history):
            return True
        self._place = place
        self.input.setPlainText(self.history[place] if place < len(self.history) else "")
        self.input.moveCursor(QTextCursor.MoveOperation.End)
        return True

    def _complete(self, cursor: QTextCursor) -> None:
        line = cursor.block().text()[: cursor.positionInBlock()]
        word = _last_word(line)
        if not word:
            cursor.insertText("    ")
            return
        found: list[str] = []
        with self._at_hand():
            completer = rlcompleter.Completer(self.names)
            while len(found) < MOST_COMPLETIONS and (match := completer.complete(word, len(found))) is not None:
                found.append(match)
        common = _common_start(found)
        if len(common) > len(word):
            cursor.insertText(common.removeprefix(word))
        elif len(found) > 1:
            self.say("   ".join(match.rpartition(".")[2] for match in found) + "\n")


def _trouble() -> QTextCharFormat:
    shape = QTextCharFormat()
    shape.setForeground(look_of().theme.colour("trouble_text"))
    shape.setProperty(TROUBLE, True)
    return shape


def _show(value: object) -> None:
    if value is not None:
        print(repr(value))


class _Interpreter(code.InteractiveInterpreter):
    """Python's own, which says errors in the console."""

    def __init__(self, console: Console) -> None:
        super().__init__(console.names)
        self._console = console

    def compiled(self, source: str) -> CodeType | bool | None:
        """The code to run; None when more lines are needed; False when it is wrong, which was said."""
        lines = source.split("\n")
        if len(lines) > 1 and lines[-1].strip() and lines[-1][0] in " \t":
            return None  # a block goes on until an empty line or one that stands out ends it
        try:
            return self.compile(source.rstrip() + "\n" * (len(lines) > 1), FILE, "exec" if len(lines) > 1 else "single")
        except (OverflowError, SyntaxError, ValueError) as error:
            self._console.say(source + "\n")
            self.write("".join(traceback.format_exception_only(error)))
            return False

    def showtraceback(self) -> None:
        """Errors meant for a person are one sentence; others come with the lines below what was typed.

        Python's own would hand them to sys.excepthook, which is for faults of the program.
        """
        error = sys.exception()
        if isinstance(error, UserError | KeyboardInterrupt):
            self.write(f"{str(error) or 'Stopped.'}\n")
        elif error is not None:
            trace = error.__traceback__
            self.write("".join(traceback.format_exception(error.with_traceback(trace and trace.tb_next))))

    def write(self, data: str) -> None:
        """Errors and tracebacks."""
        self._console.say(data, trouble=True)


class _Writer(io.TextIOBase):
    """A file that writes into the console."""

    def __init__(self, console: Console, trouble: bool) -> None:
        self._console, self._trouble = console, trouble

    def write(self, text: str) -> int:
        self._console.say(text, self._trouble)
        return len(text)


class _OnlyStop(QObject):
    """Keeps input from the window while a line runs, except Esc and Ctrl-C, which stop it."""

    _INPUT = {  # noqa: RUF012 (never changed)
        QEvent.Type.MouseButtonPress, QEvent.Type.MouseButtonRelease, QEvent.Type.MouseButtonDblClick,
        QEvent.Type.MouseMove, QEvent.Type.Wheel, QEvent.Type.TabletPress, QEvent.Type.TabletMove,
        QEvent.Type.TabletRelease, QEvent.Type.KeyPress, QEvent.Type.KeyRelease, QEvent.Type.ShortcutOverride,
        QEvent.Type.Shortcut, QEvent.Type.Close, QEvent.Type.ContextMenu, QEvent.Type.Drop,
    }

    def __init__(self) -> None:
        super().__init__()
        self.stopped = False

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Swallow input."""
        if event.type() not in self._INPUT:
            return False
        if event.type() in (QEvent.Type.KeyPress, QEvent.Type.ShortcutOverride) and isinstance(event, QKeyEvent):
            control = event.modifiers() & Qt.KeyboardModifier.ControlModifier
            self.stopped |= event.key() == Qt.Key.Key_Escape or bool(control and event.key() == Qt.Key.Key_C)
        if event.type() == QEvent.Type.Close:
            event.ignore()
        return True


@contextmanager
def _stoppable() -> Iterator[None]:
    """Keep the window alive beside long Python code, and raise KeyboardInterrupt in it on Esc or Ctrl-C.

    A thread beats; at each beat a signal handler runs on the main thread between two instructions of Python, where it
    serves the events that wait. Only while the typed code itself (or a library it called) is at work, never in the
    midst of our own session or widgets. A single long call into C is stopped only when it returns.
    """
    if threading.current_thread() is not threading.main_thread() or not hasattr(signal, "pthread_kill"):
        yield
        return
    application, only_stop, over = QApplication.instance(), _OnlyStop(), threading.Event()
    main = threading.get_ident()

    def beat(_: int, frame: FrameType | None) -> None:
        if not over.is_set() and application is not None and _in_typed_code(frame):
            application.installEventFilter(only_stop)
            try:
                application.processEvents()
            finally:
                application.removeEventFilter(only_stop)
            if only_stop.stopped:
                only_stop.stopped = False
                raise KeyboardInterrupt

    def beats() -> None:
        wait = PATIENCE
        while not over.wait(wait):
            signal.pthread_kill(main, signal.SIGVTALRM)
            wait = BEAT

    signal.signal(signal.SIGVTALRM, beat)
    thread = threading.Thread(target=beats, name="console", daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()
        signal.signal(signal.SIGVTALRM, _too_late)


def _too_late(_: int, frame: FrameType | None) -> None:
    """Takes a beat that was under way when the line ended; the system's own answer would be to end the program."""


def _in_typed_code(frame: FrameType | None) -> bool:
    """True when no part of the window, the session or a file lies between the typed code and where Python is now."""
    while frame is not None and frame.f_code.co_filename != FILE:
        if str(frame.f_globals.get("__name__")).startswith(("app.", "tools.", "core.history", "core.formats")):
            return False
        frame = frame.f_back
    return frame is not None


def _indent(source: str) -> str:
    last = source.rsplit("\n", maxsplit=1)[-1]
    white = last[: len(last) - len(last.lstrip())]
    return white + ("    " if last.rstrip().endswith(":") else "")


def _last_word(line: str) -> str:
    start = len(line)
    while start and (line[start - 1].isalnum() or line[start - 1] in "_."):
        start -= 1
    return line[start:]


def _common_start(words: list[str]) -> str:
    first, last = min(words, default=""), max(words, default="")
    same = next((i for i, (a, b) in enumerate(zip(first, last)) if a != b), min(len(first), len(last)))
    return first[:same]
