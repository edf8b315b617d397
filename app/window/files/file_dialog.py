"""The dialog that chooses files: Qt's own (those of systems have hung), in our icons and colours."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QFileInfo, QObject, QSize, Qt
from PySide6.QtGui import QAbstractFileIconProvider, QIcon, QKeyEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QComboBox,
    QFileDialog,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QLineEdit,
    QToolButton,
    QTreeView,
    QWidget,
)

from app.window.icons import icon, icon_pixmap
from app.window.theme import look_of

# name of a button within Qt's dialog -> our icon and what it does
BUTTONS = {
    "backButton": ("chevron-left", "Goes back to the folder shown before this one."),
    "forwardButton": ("chevron-right", "Goes forward to the folder you came back from."),
    "toParentButton": ("chevron-up", "Goes up to the folder that holds this one."),
    "newFolderButton": ("plus", "Makes a new folder within the one that is shown."),
    "listModeButton": ("grid", "Shows names alone, in as many columns as fit."),
    "detailModeButton": ("outliner", "Shows size, kind and date beside every name."),
}


class FileDialog(QFileDialog):
    """Return takes the name that was typed, whether or not a list of completions is open."""

    def __init__(self, parent: QWidget | None, title: str) -> None:
        super().__init__(parent, title)
        self.setOption(QFileDialog.Option.DontUseNativeDialog)
        self._icons = Icons()  # the dialog does not keep it alive
        self.setIconProvider(self._icons)
        look = look_of()
        self.resize(look.text * 68, look.text * 42)
        for name, (picture, tooltip) in BUTTONS.items():
            button = self.findChild(QToolButton, name)
            if button is not None:
                button.setIcon(icon(picture))
                button.setIconSize(QSize(look.icon, look.icon))
                button.setToolTip(tooltip)
        for combo in self.findChildren(QComboBox):
            _put_chevron(combo)
        for tree in self.findChildren(QTreeView):
            tree.header().setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
            tree.header().setSectionResizeMode(0, QHeaderView.ResizeMode.Stretch)
            tree.setAlternatingRowColors(False)
        self._line = self.findChild(QLineEdit, "fileNameEdit")
        self._list: QAbstractItemView | None = None
        completer = None if self._line is None else self._line.completer()
        if completer is not None:
            self._list = completer.popup()
        if self._list is not None:
            self._list.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if (
            watched is self._list and self._list is not None and isinstance(event, QKeyEvent)
            and event.type() == QEvent.Type.KeyPress and event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter)
            and not self._list.currentIndex().isValid()
        ):
            self._list.hide()
            self.accept()
            return True
        return super().eventFilter(watched, event)


class Icons(QAbstractFileIconProvider):
    """Folders, places and files as our own icons, drawn once: the dialog asks for one for every file it lists."""

    def __init__(self) -> None:
        super().__init__()
        self._folder, self._file = icon("folder"), icon("file")

    def icon(self, what: QAbstractFileIconProvider.IconType | QFileInfo) -> QIcon:
        kinds = QAbstractFileIconProvider.IconType
        folder = what.isDir() if isinstance(what, QFileInfo) else what in (
            kinds.Folder, kinds.Desktop, kinds.Computer, kinds.Drive, kinds.Network)
        return self._folder if folder else self._file


def _put_chevron(combo: QComboBox) -> None:
    """The arrow that the style sheet leaves out, over a list that Qt itself has made."""
    look = look_of()
    combo.setObjectName(combo.objectName() or "combo")
    combo.setStyleSheet("QComboBox::drop-down { border: none; } QComboBox::down-arrow { image: none; }")
    arrow = QLabel()
    ratio = combo.devicePixelRatioF()
    arrow.setPixmap(icon_pixmap("chevron-down", look.text, look.theme.colour("dim"), ratio))
    arrow.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
    line = QHBoxLayout(combo)
    line.setContentsMargins(0, 0, look.grid, 0)
    line.addStretch(1)
    line.addWidget(arrow)
