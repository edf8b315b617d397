"""The keymap editor: every command with its keys; press another key to change it, conflicts are said at once."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QEvent, QSortFilterProxyModel, Qt, Signal
from PySide6.QtGui import QKeyEvent, QKeySequence, QStandardItem, QStandardItemModel
from PySide6.QtWidgets import (
    QDialog,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QLineEdit,
    QPushButton,
    QTableView,
    QVBoxLayout,
    QWidget,
)

from app.window import keymap as keymaps
from app.window.commands import Commands, Scope
from app.window.fields.combo import Combo
from app.window.files.opening import choose_file
from app.window.keymap import Keymap, normal, shown
from app.window.settings import write_whole
from app.window.theme import look_of
from core.errors import UserError

_MODIFIER_KEYS = {
    Qt.Key.Key_Control, Qt.Key.Key_Shift, Qt.Key.Key_Alt, Qt.Key.Key_Meta, Qt.Key.Key_AltGr, Qt.Key.Key_unknown,
    Qt.Key.Key_Super_L, Qt.Key.Key_Super_R}
KEYMAPS = "Keymaps (*.json)"
WHERE = {
    "everywhere": "everywhere", "viewport": "over the view", "outliner": "in the scene panel",
    "curves": "at keys and curves", "groom": "over the view, grooming", "feather": "over the view, feathering",
    "pose": "over the view, posing",
    "match": "over the view, tracking"}


class KeyCapture(QLineEdit):
    """A field that takes the next key pressed, with its modifiers, as a whole. Esc leaves it."""

    captured = Signal(str)
    left = Signal()

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.setReadOnly(True)
        self.setAccessibleName("New hotkey")
        self.setPlaceholderText("Press a key…")

    def event(self, event: QEvent) -> bool:
        """Keys that are hotkeys of the window, and Tab, are captured too."""
        if event.type() == QEvent.Type.ShortcutOverride:
            event.accept()
            return True
        if event.type() == QEvent.Type.KeyPress and isinstance(event, QKeyEvent):
            self._take(event)
            return True
        return super().event(event)

    def _take(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Escape and not event.modifiers():
            self.left.emit()
        elif Qt.Key(event.key()) not in _MODIFIER_KEYS and not event.isAutoRepeat():
            text = QKeySequence(event.keyCombination()).toString(QKeySequence.SequenceFormat.PortableText)
            try:
                self.captured.emit(normal(text))
            except ValueError:  # a key that no keymap can name
                self.left.emit()


class KeymapEditor(QDialog):
    """A window beside the main one; every change is emitted at once and kept in the settings folder.

    changed : the new Keymap. preset_chosen : another preset by name. failed : a UserError to show.
    """

    changed = Signal(object)
    preset_chosen = Signal(str)
    failed = Signal(object)

    def __init__(
        self, parent: QWidget | None, commands: Commands, keymap: Keymap, preset: str, folder: Path | None = None,
    ) -> None:
        super().__init__(parent)
        self.setWindowTitle("Hotkeys")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self._commands, self._folder = commands, folder
        self.keymap, self._preset = keymap, preset
        self._wanted: tuple[str, str] | None = None  # a command and the key it waits for
        self.search = QLineEdit(self)
        self.search.setClearButtonEnabled(True)
        self.search.setPlaceholderText("Find by command, category or key…")
        self.presets = Combo(self)
        self.presets.addItems([keymaps.preset(name).name for name in keymaps.PRESETS])
        self.presets.setCurrentIndex(keymaps.PRESETS.index(preset))
        self._model = QStandardItemModel(0, 4, self)
        self._model.setHorizontalHeaderLabels(["Command", "Category", "Hotkey", "Works"])
        self._shown = QSortFilterProxyModel(self)
        self._shown.setSourceModel(self._model)
        self._shown.setFilterKeyColumn(-1)
        self._shown.setFilterCaseSensitivity(Qt.CaseSensitivity.CaseInsensitive)
        self.table = QTableView(self)
        self.table.setModel(self._shown)
        self.table.setSelectionBehavior(QTableView.SelectionBehavior.SelectRows)
        self.table.setSelectionMode(QTableView.SelectionMode.SingleSelection)
        self.table.setEditTriggers(QTableView.EditTrigger.NoEditTriggers)
        self.table.setShowGrid(False)
        self.table.verticalHeader().hide()
        self.table.horizontalHeader().setDefaultAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
        self.table.horizontalHeader().setSectionResizeMode(0, QHeaderView.ResizeMode.Stretch)
        for column in (1, 2, 3):
            self.table.horizontalHeader().setSectionResizeMode(column, QHeaderView.ResizeMode.ResizeToContents)
        self.capture = KeyCapture(self)
        self.message = QLabel(self)
        self.message.setWordWrap(True)
        self.take_over = QPushButton("Take it over", self)
        self.cancel = QPushButton("Cancel", self)
        self.clear = QPushButton("No hotkey", self)
        self.reset_one = QPushButton("Reset", self)
        self.reset_all = QPushButton("Reset all", self)
        self._import = QPushButton("Import…", self)
        self._export = QPushButton("Export…", self)
        for button in self.findChildren(QPushButton):
            button.setAutoDefault(False)  # Return in the search line must not press one
        self._lay_out()
        self.search.textChanged.connect(self._shown.setFilterFixedString)
        self.presets.activated.connect(lambda i: self.preset_chosen.emit(keymaps.PRESETS[i]))
        self.table.selectionModel().currentRowChanged.connect(lambda *_: self._row_chosen())
        self.table.activated.connect(lambda *_: self.capture.setFocus())
        self.capture.captured.connect(self.press)
        self.capture.left.connect(self._leave)
        self.take_over.clicked.connect(self._take_over)
        self.cancel.clicked.connect(self._leave)
        self.clear.clicked.connect(lambda: self._assign(self.current(), ()))
        self.reset_one.clicked.connect(self._reset_one)
        self.reset_all.clicked.connect(lambda: self._use(keymaps.preset(self._preset)))
        self._import.clicked.connect(self._ask_import)
        self._export.clicked.connect(self._ask_export)
        self._fill()
        self.table.selectRow(0)
        self._leave()

    def show_keymap(self, keymap: Keymap, preset: str) -> None:
        """Show another keymap, because the preset was changed."""
        self.keymap, self._preset = keymap, preset
        self.presets.setCurrentIndex(keymaps.PRESETS.index(preset))
        self._fill()
        self._leave()

    def current(self) -> str | None:
        """Name of the command in the chosen row."""
        index = self.table.currentIndex()
        if not index.isValid():
            return None
        return str(self._shown.index(index.row(), 0).data(Qt.ItemDataRole.UserRole))

    def choose(self, name: str) -> None:
        """Choose the row of a command."""
        for row in range(self._shown.rowCount()):
            if self._shown.index(row, 0).data(Qt.ItemDataRole.UserRole) == name:
                self.table.selectRow(row)
                self.table.scrollTo(self._shown.index(row, 0))

    def press(self, key: str) -> None:
        """Give the chosen command a key; when that is taken, say by what and wait for the answer."""
        name = self.current()
        if name is None:
            return
        owners = self.owners(name, key)
        self.capture.setText(shown(key))
        if not owners:
            self._assign(name, (key,))
            return
        self._wanted = (name, key)
        gestures = [owner for owner in owners if owner not in self._commands]
        labels = ", ".join(self._commands[o].label if o in self._commands else f"the {o} gesture" for o in owners)
        self.message.setText(
            f"{shown(key)} is {labels} already."
            + (" Choose another key: gestures of a preset stay." if gestures else ""))
        self.take_over.setVisible(not gestures)
        self.cancel.show()
        (self.cancel if gestures else self.take_over).setFocus()

    def owners(self, name: str, key: str) -> tuple[str, ...]:
        """What else a key would mean if the command had it: names of commands, or of gestures."""
        wanted = self.keymap.assigned(name, (key,))
        found = [c for c in keymaps.conflicts(wanted, self._scopes()) if name in c.names and c.keys == key]
        return tuple(dict.fromkeys(other for c in found for other in c.names if other != name))

    def import_from(self, path: Path) -> None:
        """Use the keymap of a file; UserError when it is none or means two things with one key."""
        try:
            keymap = keymaps.decode(path.read_bytes())
        except (OSError, ValueError) as error:
            raise UserError(f"{path.name} is not a keymap of this program: {error}.") from error
        twice = keymaps.conflicts(keymap, self._scopes())
        if twice:
            raise UserError(f"{path.name} has two meanings for {twice[0].keys} ({' and '.join(twice[0].names)}).")
        self._use(keymap)

    def export_to(self, path: Path) -> None:
        """Write the keymap to a file; UserError when the disk refuses."""
        write_whole(path, self.keymap)

    def _scopes(self) -> dict[str, Scope]:
        return {command.name: command.scope for command in self._commands}

    def _assign(self, name: str | None, keys: tuple[str, ...]) -> None:
        if name is not None:
            self._use(self.keymap.assigned(name, keys))

    def _take_over(self) -> None:
        if self._wanted is None:
            return
        name, key = self._wanted
        keymap = self.keymap
        for other in self.owners(name, key):
            keymap = keymap.assigned(other, tuple(k for k in keymap.of(other) if k != key))
        self._use(keymap.assigned(name, (key,)))

    def _reset_one(self) -> None:
        name = self.current()
        if name is None:
            return
        usual = keymaps.preset(self._preset).of(name)
        taken = [(key, owner) for key in usual for owner in self.owners(name, key)]
        if taken:
            key, owner = taken[0]
            self._leave()
            self.message.setText(f"{shown(key)} is {self._commands[owner].label} now: change that first.")
        else:
            self._assign(name, usual)

    def _use(self, keymap: Keymap) -> None:
        try:
            keymaps.save(keymap, self._preset, self._folder)
        except UserError as error:  # it works until the program ends, but could not be kept
            self.failed.emit(error)
        self.keymap = keymap
        self._fill()
        self._leave()
        self.changed.emit(keymap)

    def _leave(self) -> None:
        self._wanted = None
        self.take_over.hide()
        self.cancel.hide()
        self.message.setText("Choose a command, then press the key it should have.")
        self._row_chosen()
        self.table.setFocus()

    def _row_chosen(self) -> None:
        name = self.current()
        self.capture.setText("" if name is None else self.keymap.shown(name))

    def _fill(self) -> None:
        chosen = self.current()
        self._model.setRowCount(0)
        for command in self._commands:
            keys = "   ".join(shown(key) for key in self.keymap.of(command.name))
            row = [QStandardItem(text) for text in (command.label, command.category, keys, WHERE[command.scope])]
            row[0].setData(command.name, Qt.ItemDataRole.UserRole)
            row[0].setToolTip(command.tooltip)
            self._model.appendRow(row)
        self.choose(chosen or "")

    def _ask_import(self) -> None:
        choose_file(self, "Import hotkeys", [KEYMAPS], lambda path: self._attempt(self.import_from, path))

    def _ask_export(self) -> None:
        choose_file(self, "Export hotkeys", [KEYMAPS], lambda path: self._attempt(self.export_to, path), ".json")

    def _attempt(self, work: Callable[[Path], object], path: Path) -> None:
        try:
            work(path)
        except UserError as error:
            self.failed.emit(error)

    def _lay_out(self) -> None:
        top, keys, low, layout = QHBoxLayout(), QHBoxLayout(), QHBoxLayout(), QVBoxLayout(self)
        top.addWidget(self.search, 1)
        top.addWidget(self.presets)
        for widget in (self.capture, self.take_over, self.cancel):
            keys.addWidget(widget)
        for widget in (self.clear, self.reset_one, self.reset_all):
            low.addWidget(widget)
        low.addStretch(1)
        for widget in (self._import, self._export):
            low.addWidget(widget)
        for part in (top, self.table, self.message, keys, low):
            layout.addWidget(part) if isinstance(part, QWidget) else layout.addLayout(part)
        self.resize(57 * look_of().text, 47 * look_of().text)
