"""The last line of the window: what mouse and keys do now, what was said, what goes on."""

from __future__ import annotations

from typing import Literal

from PySide6.QtCore import QSize, Qt, QTimer
from PySide6.QtGui import QFontMetrics, QGuiApplication, QResizeEvent
from PySide6.QtWidgets import QHBoxLayout, QLabel, QPushButton, QSizePolicy, QWidget

from app.window.desk import Desk
from app.window.hotkeys import Hotkeys
from app.window.jobs import JobsBar
from app.window.keymap import Keymap
from app.window.theme import look_of
from core.workspace import Workspace
from tools.match_edits import shown_plate
from tools.ring import BrushParams, RingParams

SAID_MS = 6000  # how long something said stays, before the hint comes back
FAILED_MS = 20000
ACTIONS = (("orbit", "turn"), ("pan", "slide"), ("dolly", "nearer"))
GAP = "   "  # between two hints
WORDS = {"LMB": "Left button", "MMB": "Middle button", "RMB": "Right button", "Wheel": "Wheel"}


class HintLabel(QLabel):
    """A line of hints that shows as many whole ones as fit; the tooltip has all of them."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._whole = ""
        self.setTextFormat(Qt.TextFormat.PlainText)
        self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)

    def show_words(self, words: str) -> None:
        """Show a sentence, or hints with :data:`GAP` between them."""
        self._whole = words
        self._fit()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._fit()

    def _fit(self) -> None:
        shown = fitting(self._whole, self.fontMetrics(), self.width())
        if shown != self.text():
            self.setText(shown)
        self.setToolTip("" if shown == self._whole else self._whole)


class StatusLine(QWidget):
    """Hint or news at the left, jobs at the right; an error can be copied with its details."""

    def __init__(self, desk: Desk, hotkeys: Hotkeys, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._desk, self._hotkeys = desk, hotkeys
        self.words = HintLabel()
        self.copy = QPushButton("Copy details")
        self.copy.setToolTip("Copies the whole message, to send it to whoever looks after the program.")
        self.copy.clicked.connect(self._copy)
        self.copy.hide()
        self._details = self._doing = ""
        self._failed = False
        self._until = QTimer(self, singleShot=True)
        self._until.timeout.connect(self.show_hint)
        line = QHBoxLayout(self)
        line.setContentsMargins(12, 0, 12, 4)
        line.setSpacing(8)
        line.addWidget(self.words, 1)
        line.addWidget(self.copy)
        line.addWidget(JobsBar(desk.jobs, self))
        desk.said.connect(self.say)
        desk.failed.connect(self.fail)
        desk.workspace_changed.connect(self._workspace_changed)
        desk.session_replaced.connect(self.show_hint)
        desk.jobs.changed.connect(self._jobs_changed)
        self.show_hint()

    def minimumSizeHint(self) -> QSize:
        """As high as with a button: the picture above keeps its size when one comes or goes."""
        margins = self.contentsMargins() + self.layout().contentsMargins()
        return super().minimumSizeHint().expandedTo(
            QSize(0, self.copy.sizeHint().height() + margins.top() + margins.bottom()))

    def say(self, sentence: str) -> None:
        """Show a sentence for a while."""
        self._failed = False
        self._show(sentence, "text", SAID_MS)

    def fail(self, sentence: str, details: str) -> None:
        """Show what went wrong, long enough to be read."""
        self._details = f"{sentence}\n\n{details}".rstrip()
        self._show(sentence, "trouble_text", FAILED_MS)
        self._failed = True
        self.copy.show()

    def show_doing(self, words: str) -> None:
        """Say what goes on under the hand, over everything but what failed; empty when it has ended."""
        self._doing = words
        if not self._until.isActive() or (words and not self._failed):
            self.show_hint()

    def show_hint(self) -> None:
        """Say what mouse and keys do now."""
        self._until.stop()
        self._failed = False
        self.copy.hide()
        self._paint("text" if self._doing else "dim")
        self.words.show_words(self._doing or hint(self._desk, self._hotkeys.keymap))

    def _show(self, sentence: str, colour: str, milliseconds: int) -> None:
        self.copy.hide()
        self._paint(colour)
        self.words.show_words(sentence)
        self._until.start(milliseconds)

    def _paint(self, colour: str) -> None:
        palette = self.words.palette()
        palette.setColor(self.words.foregroundRole(), look_of().theme.colour(colour))
        self.words.setPalette(palette)

    def _workspace_changed(self, old: Workspace, new: Workspace) -> None:
        if old.tool != new.tool:
            self.show_hint()

    def _jobs_changed(self) -> None:
        if not self._until.isActive() and not (self._desk.document.meshes or self._desk.document.plates):
            self.show_hint()

    def _copy(self) -> None:
        QGuiApplication.clipboard().setText(self._details)


def hint(desk: Desk, keymap: Keymap) -> str:
    """What mouse and keys do now, in one line."""
    empty = not (desk.document.meshes or desk.document.plates)
    if empty and desk.jobs.running:
        return f"{desk.jobs.running[0].name}: this takes a moment. Cancel at the right ends it."
    if empty:
        return "Open a mesh, a plate or a project, or drop a file here."
    parts = [desk.session.tool.hint] if desk.document.grooms or desk.session.tool.craft != "groom" else []
    tool = desk.session.tool
    brushes: list[Literal["size", "strength"]] = ["size"] if isinstance(tool.params, RingParams) else []
    brushes += ["strength"] if isinstance(tool.params, BrushParams) else []
    flat = tool.craft == "match" and shown_plate(desk.document) is not None
    parts += [f"{_written(keys)}: {brush}" for brush in brushes if (keys := keymap.brush.get(brush))]
    parts += [f"{_written(keys)}: {words}" for action, words in ACTIONS
              if not (flat and action == "orbit") and (keys := keymap.navigate.get(action))]  # type: ignore[call-overload]
    if radial := keymap.brush.get("radial"):
        parts.append(f"{_written(radial)}: menu")
    return GAP.join(parts)


def fitting(words: str, metrics: QFontMetrics, width: int) -> str:
    """As many whole hints, else as many whole words, as `width` pixels hold; "…" stands for the rest."""
    for gap in (GAP, " "):
        parts = words.split(gap)
        for count in range(len(parts), 0, -1):
            shown = gap.join(parts[:count]) + ("" if count == len(parts) else f"{gap}…")
            if metrics.horizontalAdvance(shown) <= width:
                return shown
    return metrics.elidedText(words, Qt.TextElideMode.ElideRight, width)


def _written(keys: tuple[str, ...]) -> str:
    first = keys[0]
    for name, words in WORDS.items():
        first = first.replace(name, words)
    return first
