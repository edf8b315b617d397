"""At a start: work that a killed program left behind is offered in a bar. Nothing waits for it, nothing is deleted."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from PySide6.QtWidgets import QWidget

from app.window.notice import NoticeBar, open_folder
from core.errors import UserError
from core.formats.journal import LOCK, SUFFIXES, remove_journal, state_folder
from core.formats.recovery import abandoned, recover
from tools.session import Session

if TYPE_CHECKING:
    from app.window.desk import Desk
    from app.window.jobs import Asked, Progress

TRASH = "trash"
MOST_TRASH = 20  # journals kept in the trash


class Lost(NamedTuple):
    """Work that can be had back. step : the last one. time : of that step. project : its file, or None."""

    token: str
    step: str
    time: float
    project: str | None


class RecoveryBar(NoticeBar):
    """Offers what can be recovered, newest first: Recover, Show folder, Discard, Later."""

    def __init__(
        self, desk: Desk, folder: Path | None = None, open_it: Callable[[object], object] = open_folder,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__("history", parent)
        self._desk = desk
        self._folder = folder or state_folder()
        self._lost: list[Lost] = []
        self.button("Recover", "Opens the work as it was after its last step; the present document stays recoverable.",
                    self.recover)
        self.button("Show folder", "Shows the folder where autosaves lie on this machine.",
                    lambda: open_it(self._folder))
        self.button("Discard", "Puts this work into the folder “trash” beside the autosaves and asks no more.",
                    self.discard)
        self.close_button.hide()
        self.button("Later", "Leaves the work where it is; the next start offers it again.", self.hide)

    @property
    def lost(self) -> tuple[Lost, ...]:
        """What is offered, newest first."""
        return tuple(self._lost)

    def look(self) -> None:
        """Look for work to recover beside the window, and show it."""
        self._desk.jobs.start("Look for lost work", lambda progress, cancelled: find_lost(self._folder, progress),
                              self._found, lambda error: None, self)

    def recover(self) -> None:
        """Open what is offered first."""
        if not self._lost:
            return
        lost, desk = self._lost[0], self._desk
        self.hide()

        def work(progress: Progress, cancelled: Asked) -> Session | None:
            session = Session.recover(self._folder, lost.token)
            if session is not None and cancelled():
                session.close()
                return None
            return session

        def done(session: Session | None) -> None:
            self._lost = [other for other in self._lost if other.token != lost.token]
            if session is None:
                self._show()
                raise UserError("This work could not be read any more; its files are left in the folder as they are.")
            session.tools = desk.session.tools
            desk.replace_session(session)
            desk.said.emit(f"Recovered as it was after “{lost.step}”." if lost.step else "Recovered.")
            self._show()

        def failed(error: Exception) -> None:
            self._show()
            desk.said.emit("Recovery was cancelled; the work is left as it is.")

        desk.jobs.start(f"Recover {_title(lost)}", work, done, failed)

    def discard(self) -> None:
        """Put what is offered first into the trash."""
        if self._lost:
            put_aside(self._folder, self._lost.pop(0).token)
        self._show()

    def _found(self, lost: list[Lost]) -> None:
        self._lost = lost
        self._show()

    def _show(self) -> None:
        if not self._lost:
            self.hide()
            return
        first, others = self._lost[0], len(self._lost) - 1
        last = f", last step “{first.step}”" if first.step else ""
        more = f" {others} more after this." if others else ""
        self.tell(f"Unsaved work on {_title(first)} was found: {_when(first.time)}{last}.{more}")


def find_lost(folder: Path, progress: Progress = lambda fraction: None) -> list[Lost]:
    """What can be recovered, newest first. Journals that are in their project file are removed, broken ones put aside.

    Never raises for the sake of a file.
    """
    found = []
    tokens = abandoned(folder)
    for number, token in enumerate(tokens):
        progress(number / len(tokens))
        state = recover(folder, token)
        if state is None:
            put_aside(folder, token)
        elif state.saved:
            remove_journal(folder, token)
        else:
            found.append(Lost(token, state.name, state.time, state.project))
    return sorted(found, key=lambda lost: -lost.time)


def put_aside(folder: Path, token: str) -> None:
    """Move a journal into the trash beside it; the oldest there go when there are many."""
    trash = folder / TRASH
    with suppress(OSError):
        trash.mkdir(exist_ok=True)
        for suffix in SUFFIXES:
            with suppress(FileNotFoundError):
                os.replace(folder / (token + suffix), trash / (token + suffix))
        with suppress(FileNotFoundError):
            os.unlink(folder / (token + LOCK))
        for old in abandoned(trash)[MOST_TRASH:]:
            remove_journal(trash, old)


def _title(lost: Lost) -> str:
    return "a document without a name" if lost.project is None else Path(lost.project).name


def _when(moment: float) -> str:
    then, now = time.localtime(moment), time.localtime()
    clock = time.strftime("%H:%M", then)
    return f"today at {clock}" if then[:3] == now[:3] else f"{time.strftime('%d %B %Y', then)} at {clock}"
