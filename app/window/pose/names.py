"""A list of names as high as what is in it."""

from __future__ import annotations

from PySide6.QtCore import QSize, Qt
from PySide6.QtWidgets import QTreeWidget

from app.window.theme import look_of

MOST_ROWS = 12


class Names(QTreeWidget):
    """A list as high as what is in it, up to twelve rows."""

    def __init__(self, what: str) -> None:
        super().__init__()
        self.setHeaderHidden(True)
        self.setRootIsDecorated(False)
        self.setIndentation(look_of().gap + 4)
        self.setSelectionMode(QTreeWidget.SelectionMode.ExtendedSelection)
        self.setAccessibleName(what)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)

    def sizeHint(self) -> QSize:
        rows = sum(1 + self.topLevelItem(i).childCount() for i in range(self.topLevelItemCount()))
        return QSize(180, min(max(rows, 1), MOST_ROWS) * (look_of().row + 1) + 4)

    minimumSizeHint = sizeHint
