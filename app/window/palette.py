"""The palette: every command by words, with its hotkey, without the mouse."""

from __future__ import annotations

from PySide6.QtCore import (
    QAbstractListModel,
    QEvent,
    QModelIndex,
    QObject,
    QPersistentModelIndex,
    QRect,
    QRectF,
    QSize,
    Qt,
)
from PySide6.QtGui import QKeyEvent, QPainter
from PySide6.QtWidgets import (
    QFrame,
    QLabel,
    QLineEdit,
    QListView,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QVBoxLayout,
    QWidget,
)

from app.window.commands import Command, Commands
from app.window.icons import icon_names, paint_icon
from app.window.keymap import Keymap
from app.window.theme import look_of

WIDTH, ROWS = 560, 12
REASON = Qt.ItemDataRole.UserRole
KEY = Qt.ItemDataRole.UserRole + 1
CATEGORY = Qt.ItemDataRole.UserRole + 2
ICON = Qt.ItemDataRole.UserRole + 3

_Index = QModelIndex | QPersistentModelIndex


class Palette(QFrame):
    """A popup with a line to type in and the commands found below it.

    Arrow keys choose, Return runs, Esc leaves. What cannot run now is dim and says why.
    """

    def __init__(self, parent: QWidget, commands: Commands, keymap: Keymap) -> None:
        super().__init__(parent, Qt.WindowType.Popup | Qt.WindowType.FramelessWindowHint)
        self.setObjectName("palette")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self._commands = commands
        self.line = QLineEdit(self)
        self.line.setPlaceholderText("Find a command by words…")
        self.line.setAccessibleName("Find a command")
        self.list = QListView(self)
        self.list.setUniformItemSizes(True)
        self.list.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.model = FoundCommands(commands, keymap)
        self.list.setModel(self.model)
        self.list.setItemDelegate(_Row(self.list))
        self.nothing = QLabel("No command fits these words. Try fewer, or others for the same thing.")
        self.nothing.setAlignment(Qt.AlignmentFlag.AlignHCenter)
        self.nothing.setWordWrap(True)
        inside = QVBoxLayout(self.list)
        inside.addWidget(self.nothing)
        inside.addStretch(1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(8, 8, 8, 8)
        layout.setSpacing(8)
        layout.addWidget(self.line)
        layout.addWidget(self.list)
        self.line.textChanged.connect(self.look_up)
        self.line.installEventFilter(self)
        self.list.clicked.connect(lambda index: self._run(index.row()))
        self.setFocusProxy(self.line)
        self.look_up("")

    def open_over(self, window: QWidget) -> None:
        """Show the palette in the upper middle of a window, ready to type."""
        row = self.list.sizeHintForRow(0)
        width = min(round(WIDTH * max(row, 24) / 24), max(window.width() - 40, 200))
        self.resize(width, min(self.line.sizeHint().height() + ROWS * row + 28, max(window.height() - 40, 100)))
        corner = window.mapToGlobal(window.rect().topLeft())
        self.move(corner.x() + (window.width() - width) // 2, corner.y() + window.height() // 8)
        self.show()
        self.activateWindow()
        self.line.setFocus()

    def look_up(self, words: str) -> None:
        """List the commands that fit the words, best first."""
        self.model.find(words)
        self.nothing.setVisible(not self.model.rowCount())
        if self.model.rowCount():
            self.list.setCurrentIndex(self.model.index(0))
            self.list.scrollToTop()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Keys that move through the list or leave it; all others are typed."""
        if watched is self.line and event.type() == QEvent.Type.KeyPress and isinstance(event, QKeyEvent):
            steps = {
                Qt.Key.Key_Down: 1, Qt.Key.Key_Up: -1, Qt.Key.Key_PageDown: ROWS - 1, Qt.Key.Key_PageUp: 1 - ROWS}
            key = Qt.Key(event.key())
            if key in steps:
                self._step(steps[key])
                return True
            if key in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
                self._run(self.list.currentIndex().row())
                return True
            if key == Qt.Key.Key_Escape:
                self.close()
                return True
        return super().eventFilter(watched, event)

    def _step(self, rows: int) -> None:
        count = self.model.rowCount()
        if count:
            row = self.list.currentIndex().row() + rows
            row = row % count if abs(rows) == 1 else min(max(row, 0), count - 1)
            self.list.setCurrentIndex(self.model.index(row))

    def _run(self, row: int) -> None:
        if not 0 <= row < self.model.rowCount():
            return
        command = self.model.found[row]
        if self._commands.reason(command.name) is None:
            self.close()  # before it runs: the command may open a window of its own
            self._commands.run(command.name)


class FoundCommands(QAbstractListModel):
    """The commands found, best first."""

    def __init__(self, commands: Commands, keymap: Keymap) -> None:
        super().__init__()
        self._commands, self._keymap = commands, keymap
        self.found: list[Command] = []

    def find(self, words: str) -> None:
        """List the commands that fit the words."""
        self.beginResetModel()
        self.found = self._commands.find(words)
        self.endResetModel()

    def rowCount(self, parent: _Index = QModelIndex()) -> int:
        """How many were found."""
        return 0 if parent.isValid() else len(self.found)

    def data(self, index: _Index, role: int = Qt.ItemDataRole.DisplayRole) -> str | None:
        """Words of one row."""
        command = self.found[index.row()]
        if role == Qt.ItemDataRole.DisplayRole:
            return command.label
        if role == REASON:
            return self._commands.reason(command.name)
        if role == ICON:
            return command.icon
        if role == KEY:
            return self._keymap.shown(command.name)
        if role == CATEGORY:
            return command.category
        if role in (Qt.ItemDataRole.ToolTipRole, Qt.ItemDataRole.AccessibleDescriptionRole):
            return command.tooltip
        return None


class _Row(QStyledItemDelegate):
    """Label, then dim the reason it cannot run or its category; the hotkey at the right."""

    def sizeHint(self, option: QStyleOptionViewItem, index: _Index) -> QSize:
        return QSize(100, look_of().row + 4)

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: _Index) -> None:
        reason, theme = index.data(REASON), look_of().theme
        text, dim = theme.colour("text"), theme.colour("dim")
        side = look_of().icon
        area = option.rect.adjusted(16 + side, 0, -8, 0)
        painter.save()
        if option.state & QStyle.StateFlag.State_Selected:
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(theme.colour("accent_ground"))
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            painter.drawRoundedRect(option.rect.adjusted(0, 1, 0, -1), 5.0, 5.0)
            text = theme.colour("accent")
        metrics, key, label, name = option.fontMetrics, index.data(KEY), index.data(), index.data(ICON)
        if name in icon_names():
            top = option.rect.center().y() - side / 2 + 0.5
            paint_icon(painter, name, QRectF(option.rect.left() + 8, round(top), side, side), dim if reason else text)
        middle = Qt.AlignmentFlag.AlignVCenter
        painter.setPen(dim)
        painter.drawText(area, middle | Qt.AlignmentFlag.AlignRight, key)
        painter.setPen(dim if reason else text)
        painter.drawText(area, middle | Qt.AlignmentFlag.AlignLeft, label)
        left = area.left() + metrics.horizontalAdvance(label) + 12
        rest = QRect(left, area.top(), area.right() - left - metrics.horizontalAdvance(key) - 12, area.height())
        painter.setPen(dim)
        words = metrics.elidedText(reason or index.data(CATEGORY), Qt.TextElideMode.ElideRight, max(rest.width(), 0))
        painter.drawText(rest, middle | Qt.AlignmentFlag.AlignLeft, words)
        painter.restore()
