"""A studio's own tools that could not be used: named in a bar and in the palette, and left out."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtWidgets import QWidget

from app.window.commands import Command
from app.window.notice import NoticeBar, copy_text
from tools.registry import Registry, Trouble

if TYPE_CHECKING:
    from app.window.desk import Desk


class PluginBar(NoticeBar):
    """Names the files that were left out, until it is closed."""

    def __init__(self, troubles: Sequence[Trouble], parent: QWidget | None = None) -> None:
        super().__init__(parent=parent)
        self._troubles = tuple(troubles)
        self.button("Copy details", "Copies every file that was left out and why, for whoever wrote it.", self._copy)
        if self._troubles:
            self.tell(sentence(self._troubles))

    def _copy(self) -> None:
        copy_text("\n".join(f"{trouble.file}: {trouble.reason}" for trouble in self._troubles))


def sentence(troubles: Sequence[Trouble]) -> str:
    """What was left out, in one sentence; the first reason stands for all."""
    names = ", ".join(Path(trouble.file).name for trouble in troubles[:4])
    more = f" and {len(troubles) - 4} more" if len(troubles) > 4 else ""
    return f"Plug-ins left out: {names}{more}. {troubles[0].reason.rstrip('.')}."


def trouble_commands(registry: Registry) -> tuple[Command, ...]:
    """Rows of the palette that never run, and say why: one for each file that was left out."""

    def never(reason: str, desk: Desk) -> str:
        return reason

    return tuple(
        Command(
            f"trouble.plugin_{row}", f"{Path(trouble.file).name[:40]} left out",
            f"This plug-in could not be used: {trouble.file}: {trouble.reason}.", lambda window: None,
            "tools.registry.Registry", "window", enabled=partial(never, trouble.reason), icon="warning",
            words="plugin trouble broken error")
        for row, trouble in enumerate(registry.troubles)
    )
