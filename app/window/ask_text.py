"""Asks the artist for a few words."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from PySide6.QtWidgets import QInputDialog, QWidget


def ask_text(parent: Any, title: str, label: str, done: Callable[[str], object]) -> None:
    """Open a dialog over a window that calls `done` with the words when they are accepted; nothing waits for it."""
    dialog = QInputDialog(parent if isinstance(parent, QWidget) else None)
    dialog.setWindowTitle(title)
    dialog.setLabelText(label)
    dialog.textValueSelected.connect(done)
    dialog.finished.connect(dialog.deleteLater)
    dialog.open()
