"""The shelf of tools at the left: one drawn icon each, the active one in the accent colour."""

from __future__ import annotations

import html
from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QEvent, QSize, Qt, Signal
from PySide6.QtGui import QPainter, QPaintEvent, QResizeEvent
from PySide6.QtWidgets import QMenu, QSizePolicy, QWidget

from app.window.desk import Desk
from app.window.icons import IconButton, icon, icon_names
from app.window.theme import look_of
from core.workspace import Workspace
from tools.tool import Tool

GAP = 12  # pixels between groups of tools
EDGE = 8


class Shelf(QWidget):
    """A column of buttons; what does not fit a low window is in the menu of the last one.

    chosen : the name of the tool that was clicked.

    Parameters
    ----------
    hotkey : gives the key of a tool by its name, or "".
    """

    chosen = Signal(str)

    def __init__(self, desk: Desk, hotkey: Callable[[str], str] = lambda name: "", parent: QWidget | None = None,
                 ) -> None:
        super().__init__(parent)
        self.desk, self._hotkey = desk, hotkey
        self.buttons: dict[str, IconButton] = {}
        self.more = IconButton("more", "Tools that do not fit here.", self)
        self.more.clicked.connect(self._pop_up)
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Expanding)
        desk.session_replaced.connect(self.rebuild)
        desk.workspace_changed.connect(self._workspace_changed)
        self.rebuild()

    def rebuild(self) -> None:
        """Make the buttons anew: another registry, text size or keymap."""
        for button in self.buttons.values():
            button.hide()
            button.deleteLater()
        look, known = look_of(), icon_names()
        self.buttons = {}
        for tool in self._tools():
            button = IconButton(tool.icon if tool.icon in known else "more", tool.label, self, look.shelf)
            button.setCheckable(True)
            button.setToolTip(self.teaching(tool))
            button.clicked.connect(lambda _=False, name=tool.name: self._choose(name))
            button.show()
            self.buttons[tool.name] = button
        self._show_active()
        self._arrange()

    def teaching(self, tool: type[Tool[Any]]) -> str:
        """The tooltip of a tool: name, hotkey, one sentence."""
        key = self._hotkey(tool.name)
        shown = f" &nbsp; <span style='color:{look_of().theme.accent}'>{html.escape(key)}</span>" if key else ""
        return (f"<p style='white-space:normal'><b>{html.escape(tool.label)}</b>{shown}<br>"
                f"{html.escape(tool.tooltip)}</p>")

    @property
    def overflow(self) -> tuple[str, ...]:
        """Names of the tools that are in the menu."""
        return tuple(name for name, button in self.buttons.items() if button.isHidden())

    def sizeHint(self) -> QSize:
        look = look_of()
        return QSize(look.shelf + 2 * 4, (look.shelf + 4) * max(len(self.buttons), 1) + 2 * EDGE)

    def minimumSizeHint(self) -> QSize:
        look = look_of()
        return QSize(look.shelf + 2 * 4, 2 * (look.shelf + 4) + 2 * EDGE)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._arrange()

    def changeEvent(self, event: QEvent) -> None:
        if event.type() == QEvent.Type.FontChange and self.buttons:
            self.rebuild()
            self.updateGeometry()
        super().changeEvent(event)

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        theme = look_of().theme
        painter.fillRect(self.rect(), theme.colour("panel"))
        painter.fillRect(self.width() - 1, 0, 1, self.height(), theme.colour("line"))

    def menu(self) -> QMenu:
        """The tools that do not fit."""
        menu = QMenu(self)
        for name in self.overflow:
            tool = self.desk.session.tools.tools[name]
            action = menu.addAction(icon(tool.icon) if tool.icon in icon_names() else icon("more"), tool.label)
            action.setCheckable(True)
            action.setChecked(name == self.desk.session.tool.name)
            action.triggered.connect(lambda _=False, chosen=name: self._choose(chosen))
        return menu

    def _pop_up(self) -> None:
        menu = self.menu()
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        menu.popup(self.more.mapToGlobal(self.more.rect().topRight()))

    def _choose(self, name: str) -> None:
        self.desk.choose(name)
        self._show_active()  # a click on the active one must not put it out
        self.chosen.emit(name)

    def _workspace_changed(self, old: Workspace, new: Workspace) -> None:
        if old.craft != new.craft:
            self.rebuild()
            self.updateGeometry()
        elif old.tool != new.tool:
            self._show_active()
            self._arrange()

    def _tools(self) -> tuple[type[Tool[Any]], ...]:
        """Those of the craft."""
        return self.desk.session.tools.of(self.desk.session.tool.craft)

    def _show_active(self) -> None:
        active = self.desk.session.tool.name
        for name, button in self.buttons.items():
            button.setChecked(name == active)
        self.more.setChecked(False)

    def _arrange(self) -> None:
        """Place as many buttons as fit, groups a little apart; the active one always has a place."""
        look = look_of()
        side, tools = look.shelf, self._tools()
        x, y, group = (self.width() - side) // 2, EDGE, None
        places: list[tuple[str, int]] = []
        for tool in tools:
            if group is not None and tool.order // 10 != group:
                y += GAP - 4
            group = tool.order // 10
            places.append((tool.name, y))
            y += side + 4
        room = self.height() - EDGE
        fits = [(name, top) for name, top in places if top + side <= room]
        if len(fits) < len(places):
            fits = [(name, top) for name, top in fits if top + 2 * side + 4 <= room]
            active = self.desk.session.tool.name
            if fits and active not in [name for name, _ in fits]:
                fits[-1] = (active, fits[-1][1])
        seen = dict(fits)
        for name, button in self.buttons.items():
            button.setVisible(name in seen)
            if name in seen:
                button.setGeometry(x, seen[name], side, side)
        self.more.setVisible(len(fits) < len(places))
        if fits and len(fits) < len(places):
            self.more.setGeometry(x, fits[-1][1] + side + 4, side, side)
