"""The history: every step by name, newest at the top; a click goes there."""

from __future__ import annotations

from typing import Any

from PySide6.QtCore import QAbstractListModel, QModelIndex, QPersistentModelIndex, QSize, Qt, QTimer
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QAbstractItemView, QLabel, QListView, QVBoxLayout, QWidget

from app.window.desk import Desk
from app.window.theme import look_of

REST = 250  # ms without a change before the memory is counted, which walks over every array
Index = QModelIndex | QPersistentModelIndex


class Steps(QAbstractListModel):
    """The names of the steps, newest first; `cursor` is the place of the current one, counted from the oldest."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.names: tuple[str, ...] = ()
        self.cursor = 0

    def show(self, names: tuple[str, ...], cursor: int) -> None:
        """Show these; rows that stay are left alone."""
        same = 0
        while same < min(len(names), len(self.names)) and names[same] == self.names[same]:
            same += 1
        if len(self.names) > same:
            self.beginRemoveRows(QModelIndex(), 0, len(self.names) - same - 1)
            self.names = self.names[:same]
            self.endRemoveRows()
        if len(names) > same:
            self.beginInsertRows(QModelIndex(), 0, len(names) - same - 1)
            self.names = names
            self.endInsertRows()
        if cursor != self.cursor:
            self.cursor = cursor
            self.dataChanged.emit(self.index(0), self.index(len(names) - 1))

    def place(self, row: int) -> int:
        """The place in the history a row stands for, and the other way round."""
        return len(self.names) - 1 - row

    def rowCount(self, parent: Index = QModelIndex()) -> int:
        return 0 if parent.isValid() else len(self.names)

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        place = self.place(index.row())
        if role == Qt.ItemDataRole.DisplayRole:
            return self.names[place]
        if role == Qt.ItemDataRole.ForegroundRole:
            return QColor(look_of().theme.colour("dim" if place > self.cursor else "text"))
        if role == Qt.ItemDataRole.SizeHintRole:
            return QSize(0, look_of().row - look_of().grid)
        if role == Qt.ItemDataRole.ToolTipRole:
            if place == self.cursor:
                return "The document is as it was after this step."
            return f"Click to go {'forward' if place > self.cursor else 'back'} to how it was after this step."
        return None


class HistoryPanel(QWidget):
    """The list of steps with the memory they take; up and down, or a click, go to a step."""

    def __init__(self, desk: Desk, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._desk = desk
        self._showing = False
        self.steps = Steps(self)
        self.list = QListView()
        self.list.setModel(self.steps)
        self.list.setUniformItemSizes(True)
        self.list.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.list.setVerticalScrollMode(QAbstractItemView.ScrollMode.ScrollPerPixel)
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.list.setTextElideMode(Qt.TextElideMode.ElideRight)
        self.list.setAccessibleName("History")
        self.foot = QLabel()
        self.foot.setToolTip("Steps that undo remembers, and the memory they take; the limit is in the preferences.")
        self.foot.setIndent(4)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(4)
        column.addWidget(self.list, 1)
        column.addWidget(self.foot)
        self._count = QTimer(self, singleShot=True, interval=REST)
        self._count.timeout.connect(self._count_bytes)
        self.list.selectionModel().currentChanged.connect(self._chosen)
        desk.changed.connect(self.refresh)
        desk.stroke_ended.connect(self.refresh)
        desk.session_replaced.connect(self.refresh)
        self.refresh()

    def sizeHint(self) -> QSize:
        look = look_of()
        return QSize(20 * look.text, 8 * look.row)

    def refresh(self) -> None:
        """Show the history as it is; nothing while a stroke goes on."""
        if self._desk.session.stroking:
            return
        history = self._desk.session.history
        self._showing = True
        try:
            self.steps.show(history.names, history.cursor)
            current = self.steps.index(self.steps.place(history.cursor))
            self.list.setCurrentIndex(current)
            self.list.scrollTo(current)
        finally:
            self._showing = False
        self._count.start()

    def _chosen(self, index: QModelIndex) -> None:
        if not self._showing and index.isValid():
            self._desk.session.jump(self.steps.place(index.row()))

    def _count_bytes(self) -> None:
        if self._desk.session.stroking:
            self._count.start()
            return
        history = self._desk.session.history
        steps = len(history.names) - 1
        self.foot.setText(f"{steps:,} {'step' if steps == 1 else 'steps'} · {in_bytes(history.bytes)}")
        self.foot.setStyleSheet(f"color: {look_of().theme.dim}")


def in_bytes(count: int) -> str:
    """A number of bytes in words: 900 B, 12 kB, 3.4 MB, 1.2 GB."""
    for unit, size in (("GB", 1 << 30), ("MB", 1 << 20), ("kB", 1 << 10)):
        if count >= size:
            amount = count / size
            return f"{amount:.1f} {unit}" if amount < 10 else f"{amount:,.0f} {unit}"
    return f"{count} B"
