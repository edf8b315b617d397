"""The top of the window: its name, the menus, the craft, the file with its state, and where commands are found."""

from __future__ import annotations

import time
from collections.abc import Callable

from PySide6.QtCore import QPoint, QRectF, QSize, Qt, QTimer
from PySide6.QtGui import QKeySequence, QPainter, QPaintEvent
from PySide6.QtWidgets import QButtonGroup, QHBoxLayout, QLabel, QMenu, QSizePolicy, QToolButton, QWidget

from app.window.commands import Commands
from app.window.desk import Desk
from app.window.hotkeys import Hotkeys
from app.window.icons import paint_icon
from app.window.menus import rows_of
from app.window.theme import look_of, text_font

LITTLE = 5.0  # seconds between two words about the autosave
LOOK_AGAIN = 400  # ms after a change, when the autosave has had its time
ABOUT = {
    "File": "file", "Edit": "edit", "View": "view", "Tools": "tool", "Groom": "groom", "Pose": "pose",
    "Match": "match", "Time": "frame", "Curves": "curves", "Window": "window",
}


class TopBar(QWidget):
    """One line: filoplume, menus, craft, file, palette."""

    def __init__(self, desk: Desk, commands: Commands, hotkeys: Hotkeys, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._desk, self._commands, self._hotkeys = desk, commands, hotkeys
        self.setObjectName("top_bar")
        self.name = QLabel("filoplume")
        self.menu_button = QToolButton()
        self.menu_button.setText("Menu")
        self.menu_button.setShortcut(QKeySequence("F10"))
        self.menu_button.setToolTip("Every command by category. F10 opens it, arrow keys walk through it.")
        self.menu_button.setAccessibleName("Menu")
        self.menu_button.clicked.connect(self.open_menu)
        self.crafts = CraftSwitch(desk)
        self.file = QLabel()
        self.palette_field = FindField(lambda: commands.run("window.palette"), hotkeys)
        self.clock = time.monotonic
        self._again = QTimer(self, singleShot=True)
        self._again.timeout.connect(self.refresh)
        line = QHBoxLayout(self)
        line.setContentsMargins(12, 4, 8, 4)
        line.setSpacing(12)
        for widget in (self.name, self.menu_button, self.crafts):
            line.addWidget(widget)
        line.addStretch(1)
        line.addWidget(self.file)
        line.addWidget(self.palette_field)
        desk.changed.connect(lambda old, new: None if desk.session.stroking else self._soon())
        desk.stroke_ended.connect(self._soon)
        desk.session_replaced.connect(self.refresh)
        self.take_look()
        self.refresh()

    def refresh(self) -> None:
        """Say which file this is and whether the work is safe."""
        session = self._desk.session
        name = "Not saved yet" if session.path is None else session.path.name
        if not (session.document.meshes or session.document.plates) and session.path is None:
            name = ""
        trouble, written = session.autosave_error, session.autosaved
        state = ""
        if name and session.saved and session.path:
            state = "saved"
        elif name and trouble:
            state = "autosave fails"
        elif name and written is not None:
            past = max(self.clock() - written, 0.0)
            state = ago(past)
            self._again.start(LOOK_AGAIN + round(1e3 * (LITTLE if past < 60.0 else 60.0)))  # when it is another
        self.file.setText(f"{name}  •  {state}" if state else name)
        self.file.setToolTip(
            str(trouble) if trouble else
            f"{session.path or 'This document has no file yet: Save gives it one.'} "
            "Every step is written to the journal at once, so that a crash loses nothing.")

    def take_look(self) -> None:
        """Take the colours and sizes of the theme."""
        look = look_of()
        self.name.setFont(_bold(text_font(look, look.text + 1)))
        self.name.setStyleSheet(f"color: {look.theme.accent}")
        self.crafts.take_look()
        self.file.setStyleSheet(f"color: {look.theme.dim}")
        self.file.setFont(text_font(look, look.small))

    def menu(self) -> QMenu:
        """All commands by category."""
        menu, looked = QMenu(self), set()
        for title, category in ABOUT.items():
            names = [c.name for c in self._commands if c.name.split(".")[0] == category]
            if names:
                part = menu.addMenu(f"&{title}")
                self._fill(part, category, names)
                looked.add(category)
        rest = [c.name for c in self._commands if c.name.split(".")[0] not in looked]
        if rest:
            part = menu.addMenu("&More")
            for name in rest:
                part.addAction(self._hotkeys.action(name))
        self._hotkeys.refresh()
        return menu

    def _fill(self, menu: QMenu, category: str, names: list[str]) -> None:
        """Put the commands of a category into its menu, in parts."""
        menu.setToolTipsVisible(True)
        apart = False
        for title, part in rows_of(category, names):
            if menu.actions() and not (title and apart):
                menu.addSeparator()
            to = menu.addMenu(title) if title else menu
            to.setToolTipsVisible(True)
            for name in part:
                to.addAction(self._hotkeys.action(name))
            apart = bool(title)

    def open_menu(self) -> None:
        """Open the menus below their button."""
        menu = self.menu()
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        menu.popup(self.menu_button.mapToGlobal(QPoint(0, self.menu_button.height())))
        menu.setActiveAction(menu.actions()[0])

    def _soon(self) -> None:
        self._again.start(LOOK_AGAIN)


class CraftSwitch(QWidget):
    """The crafts there are, as words side by side; the active one in the accent colour."""

    def __init__(self, desk: Desk) -> None:
        super().__init__()
        self._desk = desk
        self.buttons: dict[str, QToolButton] = {}
        self._group = QButtonGroup(self)
        line = QHBoxLayout(self)
        line.setContentsMargins(0, 0, 0, 0)
        line.setSpacing(2)
        for name, craft in desk.session.tools.crafts.items():
            button = self.buttons[name] = QToolButton()
            button.setText(craft.label)
            button.setCheckable(True)
            button.setAccessibleName(f"{craft.label} craft")
            button.setToolTip(f"{craft.label}: its tools and panels work on the same document; nothing is lost.")
            button.clicked.connect(lambda _=False, name=name: desk.set_craft(name))
            self._group.addButton(button)
            line.addWidget(button)
        desk.workspace_changed.connect(lambda old, new: self.refresh())
        desk.session_replaced.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Show which craft is active."""
        self.buttons[self._desk.session.tool.craft].setChecked(True)

    def take_look(self) -> None:
        """Take the colours and sizes of the theme."""
        look = look_of()
        self.setStyleSheet(
            f"QToolButton {{ color: {look.theme.dim}; background: transparent; border: none; border-radius: 5px; "
            f"padding: {look.grid}px {2 * look.gap}px }}"
            f"QToolButton:hover {{ color: {look.theme.text} }}"
            f"QToolButton:checked {{ color: {look.theme.accent}; background: {look.theme.accent_ground} }}")


class FindField(QWidget):
    """Looks like a field to type in; a click opens the palette, where typing happens."""

    def __init__(self, open_palette: Callable[[], object], hotkeys: Hotkeys) -> None:
        super().__init__()
        self._open, self._hotkeys = open_palette, hotkeys
        self.setCursor(Qt.CursorShape.IBeamCursor)
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self.setToolTip("Finds every command by words, with its hotkey.")
        self.setAccessibleName("Find a command")

    def sizeHint(self) -> QSize:
        look = look_of()
        return QSize(18 * look.text, look.row)

    def mousePressEvent(self, event: object) -> None:
        self._open()

    def paintEvent(self, event: QPaintEvent) -> None:
        look, painter = look_of(), QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(look.theme.colour("line"))
        painter.setBrush(look.theme.colour("field"))
        painter.drawRoundedRect(QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5), 5.0, 5.0)
        side = float(look.text + 2)
        paint_icon(painter, "search", QRectF(8.0, (self.height() - side) / 2, side, side), look.theme.colour("dim"))
        painter.setPen(look.theme.colour("dim"))
        inside = self.rect().adjusted(round(side) + 16, 0, -8, 0)
        painter.drawText(inside, Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignLeft, "Find a command…")
        painter.drawText(inside, Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignRight,
                         self._hotkeys.keymap.shown("window.palette"))


def ago(seconds: float) -> str:
    """How long ago the work was autosaved, in steps that do not fidget."""
    if seconds < LITTLE:
        return "autosaved"
    if seconds < 60.0:
        return f"autosaved {seconds // LITTLE * LITTLE:.0f} s ago"
    return f"autosaved {seconds // 60.0:.0f} min ago"


def _bold(font: object) -> object:
    font.setBold(True)  # type: ignore[attr-defined]
    return font
