"""Keys to commands, in the part of the window where the hand is; and the actions that menus and buttons show."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import QObject, Qt
from PySide6.QtGui import QAction, QKeySequence, QShortcut
from PySide6.QtWidgets import (
    QAbstractItemView,
    QAbstractSpinBox,
    QApplication,
    QComboBox,
    QLineEdit,
    QPlainTextEdit,
    QTextEdit,
    QWidget,
)

from app.window.commands import CRAFT_SCOPES, Command, Commands, Scope
from app.window.icons import icon, icon_names
from app.window.keymap import HELD, Keymap

_CURVES = "filoplume_curves"  # property of widgets that show the keys of curves
# widgets that read keys themselves: while one has the focus, only keys that work everywhere do
_READS_KEYS = (QLineEdit, QPlainTextEdit, QTextEdit, QAbstractSpinBox, QComboBox, QAbstractItemView)


class Hotkeys(QObject):
    """The hotkeys of one main window.

    Parameters
    ----------
    window : the main window; its floating panels are served too.
    outliner : the widget within which keys of the outliner work; None before there is one.
    """

    def __init__(self, window: QWidget, commands: Commands, keymap: Keymap, outliner: QWidget | None = None) -> None:
        super().__init__(window)
        self._window, self._commands, self._outliner = window, commands, outliner
        self._shortcuts: dict[str, tuple[QShortcut, dict[Scope, str]]] = {}
        self._actions: dict[str, QAction] = {}
        self.keymap = keymap
        self.set_keymap(keymap)
        application = QApplication.instance()
        assert isinstance(application, QApplication)
        application.focusChanged.connect(self._follow_focus)
        application.focusWindowChanged.connect(self._follow_focus)  # the viewport is a window and no widget

    def set_keymap(self, keymap: Keymap) -> None:
        """Use another keymap from now on."""
        for shortcut, _ in self._shortcuts.values():
            shortcut.setParent(None)
            shortcut.deleteLater()
        self.keymap, self._shortcuts = keymap, {}
        for name, keys in keymap.keys.items():
            for text in keys if name in self._commands else ():
                if not text.startswith(HELD):  # the viewport hands these to press_with_space
                    self._claim(text, self._commands[name])
        for name, action in self._actions.items():
            action.setText(self._text(name))
        self._follow_focus()

    def scope(self) -> Scope | None:
        """Where the hand is: over the viewport, in the outliner, at curves, or (None) where keys are read otherwise."""
        focus = QApplication.focusWidget()
        if focus is None:
            return "viewport"
        if _at_curves(focus):
            return None if isinstance(focus, QLineEdit) else "curves"
        if self._outliner is not None and (focus is self._outliner or self._outliner.isAncestorOf(focus)):
            return None if isinstance(focus, QLineEdit) else "outliner"
        return None if isinstance(focus, _READS_KEYS) else "viewport"

    def press_with_space(self, key: Qt.Key) -> bool:
        """A key pressed over the viewport while Space is held there. True when it was a command's."""
        name = self.keymap.with_space(QKeySequence(key).toString(QKeySequence.SequenceFormat.PortableText))
        return name is not None and name in self._commands and (self._commands.run(name) or True)

    def action(self, name: str) -> QAction:
        """What a menu or a button shows of a command; the same one every time. It shows the hotkey and runs it."""
        if name not in self._actions:
            command = self._commands[name]
            action = QAction(self._text(name), self)
            action.setToolTip(command.tooltip)
            action.setStatusTip(command.tooltip)
            action.setCheckable(command.checked is not None)
            action.setMenuRole(QAction.MenuRole.NoRole)
            if command.icon in icon_names():
                action.setIcon(icon(command.icon))
            action.triggered.connect(partial(self._trigger, name))
            self._actions[name] = action
        return self._actions[name]

    def take_look(self) -> None:
        """Draw the icons in the colours of the theme, which may have changed."""
        for name, action in self._actions.items():
            if self._commands[name].icon in icon_names():
                action.setIcon(icon(self._commands[name].icon or ""))

    def refresh(self) -> None:
        """Bring what the actions show in step with the document: what can run, what is on. Called before a menu."""
        desk = self._commands.desk
        for name, action in self._actions.items():
            command = self._commands[name]
            reason = command.enabled(desk)
            action.setEnabled(reason is None)
            action.setToolTip(command.tooltip if reason is None else f"{command.tooltip} Now: {reason}")
            if command.checked is not None:
                action.setChecked(command.checked(desk))

    def _claim(self, text: str, command: Command) -> None:
        if text not in self._shortcuts:
            shortcut = QShortcut(QKeySequence(text), self._window)
            shortcut.activated.connect(partial(self._pressed, text))
            self._shortcuts[text] = (shortcut, {})
        shortcut, owners = self._shortcuts[text]
        shortcut.setAutoRepeat(command.repeats)
        owners[command.scope] = command.name

    def _pressed(self, text: str) -> None:
        _, owners = self._shortcuts[text]
        scope = self.scope()
        craft = self._commands.desk.workspace.craft
        places = [place for place in _searched(scope) if place not in CRAFT_SCOPES or place == craft]
        name = next((owners[place] for place in places if place in owners), None)
        if name is not None:
            self._commands.run(name)

    def _trigger(self, name: str) -> None:
        self._commands.run(name)
        self.refresh()  # a tick that Qt set although the command could not run is taken back

    def _follow_focus(self, *_: object) -> None:
        scope = self.scope()
        for shortcut, owners in self._shortcuts.values():
            shortcut.setEnabled(not owners.keys().isdisjoint(_searched(scope)))

    def _text(self, name: str) -> str:
        key = self.keymap.shown(name)
        label = self._commands[name].label.replace("&", "&&")
        return f"{label}\t{key}" if key else label


def at_curves(widget: QWidget) -> None:
    """Make a widget and what is in it a place where the hotkeys of curves work."""
    widget.setProperty(_CURVES, True)


def _at_curves(widget: QWidget | None) -> bool:
    while widget is not None and not widget.property(_CURVES):
        widget = widget.parentWidget()
    return widget is not None


def _searched(scope: Scope | None) -> tuple[Scope, ...]:
    """Whose keys count in a place, the first before the others: what curves do not read goes to the view."""
    if scope is None:
        return ("everywhere",)
    view: tuple[Scope, ...] = (*CRAFT_SCOPES, "viewport") if scope in ("viewport", "curves") else ()
    return (*(() if scope == "viewport" else (scope,)), *view, "everywhere")


def tooltip(command: Command, keymap: Keymap, reason: str | None = None) -> str:
    """What hovering says: label and hotkey, the teaching sentence, and why it cannot run now."""
    key = keymap.shown(command.name)
    lines = [f"{command.label}   {key}" if key else command.label, command.tooltip]
    return "\n".join([*lines, reason] if reason else lines)
