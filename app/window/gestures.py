"""What the hand does over the viewport: strokes, moves of the camera, the brush's size and strength, the radial menu.

Each press begins one thing that moves, ends or is cancelled. Samples are gathered and handed on once for a picture.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable
from typing import Literal, Protocol

from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QKeySequence
from PySide6.QtWidgets import QWidget

from app.window.commands import Commands
from app.window.desk import FAILED, Desk
from app.window.hotkeys import Hotkeys
from app.window.keymap import Gesture, normal
from app.window.navigation import CameraDrag, Eye
from app.window.picture_drag import PictureDrag, PinnedPictures
from app.window.radial import Entry, RadialMenu
from core.errors import UserError
from core.overlay import Label, Overlays
from tools.ground import Pointer, Sight
from tools.ring import BrushParams, RingParams

# up, right, down, left, then between; see app.window.radial
RADIAL = (
    "tool.comb", "tool.smooth", "tool.length", "tool.select", "edit.redo", "tool.plant", "tool.hairspray", "edit.undo",
)
DIGITS = "0123456789.-"


class Drag(Protocol):
    """Something between press and release."""

    def move(self, x: float, y: float) -> None: ...
    def frame(self) -> None: ...
    def end(self) -> None: ...
    def cancel(self) -> None: ...


class StrokeDrag:
    """A stroke of the tool in the hand."""

    def __init__(self, desk: Desk, sight: Sight, pointer: Pointer) -> None:
        self._desk, self.sight, self.pointer = desk, sight, pointer
        self._batch: list[Pointer] = []
        self.going = guarded(desk, lambda: desk.session.hand.press(sight, pointer)) is not FAILED

    def add(self, pointer: Pointer) -> None:
        """A sample of the mouse or the pen."""
        self._batch.append(pointer)
        self.pointer = pointer

    def move(self, x: float, y: float) -> None:
        """The hand is there now (without pressure: samples come by :meth:`add`)."""
        self.add(self.pointer._replace(x=x, y=y))

    def frame(self) -> None:
        """Hand everything since the last picture to the tool at once."""
        batch, self._batch = tuple(self._batch), []
        if batch and self.going:
            self.going = guarded(self._desk, lambda: self._desk.session.hand.move(batch)) is not FAILED
            if not self.going:
                self._desk.stroke_ended.emit()

    def end(self) -> None:
        """The release: one step of history."""
        self.frame()
        if self.going:
            self.going = False
            guarded(self._desk, self._desk.end_stroke)

    def cancel(self) -> None:
        """Give the stroke up."""
        self._batch = []
        if self.going:
            self.going = False
            guarded(self._desk, lambda: self._desk.end_stroke(cancel=True))


class BrushDrag:
    """The brush's size or strength by the hand: sideways, or typed as a number.

    typed : what was typed so far.
    """

    def __init__(self, desk: Desk, what: Literal["size", "strength"], x: float, y: float, ratio: float) -> None:
        self._desk, self.what, self._ratio = desk, what, ratio
        self._tool = desk.session.tool
        self.x, self.y = x, y
        self._next: float | None = None
        self.typed = ""
        self._value = float(getattr(self._tool.params, what))

    def move(self, x: float, y: float) -> None:
        """The hand is there now."""
        self._next = x

    def frame(self) -> None:
        """Take the value the hand stands for."""
        if self._next is None or self.typed:
            return
        pulled = (self._next - self.x) / self._ratio
        self._next = None
        start = float(getattr(self._tool.params, self.what))
        self._set(start + pulled * self._ratio if self.what == "size" else start + pulled / 200.0)

    def type(self, text: str) -> None:
        """A key of a number; backspace is "\\b"."""
        self.typed = self.typed[:-1] if text == "\b" else self.typed + text
        try:
            self._set(float(self.typed))
        except ValueError:
            return

    def end(self) -> None:
        """The value stays."""
        self.frame()

    def cancel(self) -> None:
        """The value from before."""
        self._set(float(getattr(self._tool.params, self.what)))

    def overlays(self) -> Overlays:
        """The value in words beside the ring."""
        typed = f" [{self.typed}]" if self.typed else ""
        if self.what == "size":
            words = f"Size {self._value:.0f}{typed}"
        else:
            words = f"Strength {self._value:.2f}{typed}"
        return (Label(self.x + 12.0 * self._ratio, self.y - 12.0 * self._ratio, words, "accent"),)

    def _set(self, value: float) -> None:
        least, most = (1.0, 4000.0) if self.what == "size" else (0.0, 1.0)
        self._value = min(max(value, least), most)
        self._desk.choose(self._tool.name, **{self.what: self._value})


class Gestures:
    """What presses, keys and the wheel begin.

    drag : what goes on between press and release, or None. held : the key held down that changes what a press does.
    radial : the menu while it is open.
    """

    def __init__(self, desk: Desk, eye: Eye, hotkeys: Hotkeys, commands: Commands, window: QWidget) -> None:
        self.desk, self.eye, self.hotkeys, self.commands, self._window = desk, eye, hotkeys, commands, window
        self.drag: Drag | None = None
        self.held = ""
        self._button: str | None = None  # that ends the drag; None when a click does
        self.radial: RadialMenu | None = None
        self.pictures = PinnedPictures(desk, eye.size, lambda path: None)

    @property
    def stroke(self) -> StrokeDrag | None:
        """The stroke that goes on."""
        return self.drag if isinstance(self.drag, StrokeDrag) else None

    def press(self, button: str, modifiers: tuple[str, ...], pointer: Pointer, on_screen: QPoint) -> None:
        """A button or the pen goes down."""
        if self.drag is not None:
            if self._button is None:  # a gesture begun by a key ends with a click
                self.finish(cancel=button == "RMB")
            elif button == "RMB" and self.stroke is None:
                self.finish(cancel=True)
            return
        gesture, keymap = Gesture(button, modifiers, self.held), self.hotkeys.keymap
        move, brush = keymap.navigation(gesture), keymap.brushing(gesture)
        if move is not None:
            self._begin(CameraDrag(self.eye, move, pointer.x, pointer.y), button)
        elif brush == "radial":
            self.open_radial(on_screen)
        elif brush == "picture":
            row = self.pictures.at(pointer.x, pointer.y)
            if row is None:
                self.desk.said.emit("There is no pinned picture under the pointer.")
            else:
                self._begin(PictureDrag(self.pictures, row, pointer.x, pointer.y, self.eye.ratio()), button)
        elif brush is not None:
            self._begin_brush(brush, pointer, button)
        elif button == "LMB" and not self.held and not set(modifiers) - {"Shift", "Ctrl"}:
            width, height = self.eye.size()
            stroke = StrokeDrag(self.desk, Sight(self.eye.camera, width, height), pointer)
            if stroke.going:
                self._begin(stroke, button)

    def move(self, pointer: Pointer) -> None:
        """The hand moved."""
        if self.stroke is not None:
            self.stroke.add(pointer)
        elif self.drag is not None:
            self.drag.move(pointer.x, pointer.y)

    def release(self, button: str) -> None:
        """A button or the pen goes up."""
        if self.drag is not None and button == self._button:
            self.finish()

    def frame(self) -> None:
        """Before a picture: hand on what was gathered."""
        if self.drag is not None:
            self.drag.frame()
            if isinstance(self.drag, StrokeDrag) and not self.drag.going:
                self.drag = None

    def finish(self, cancel: bool = False) -> None:
        """End what goes on, or give it up."""
        drag, self.drag = self.drag, None
        if drag is not None:
            if cancel:
                drag.cancel()
            else:
                drag.end()

    def wheel(self, notches: float, modifiers: tuple[str, ...], pointer: Pointer) -> None:
        """The wheel turned, away from the hand is positive."""
        if self.drag is not None:
            return
        gesture, keymap = Gesture("Wheel", modifiers, self.held), self.hotkeys.keymap
        move, brush = keymap.navigation(gesture), keymap.brushing(gesture)
        if move is not None:
            self.eye.wheel(move, notches, pointer.x, pointer.y)
        elif brush == "picture":
            self.pictures.wheel(notches, pointer.x, pointer.y)
        elif brush in ("size", "strength"):
            step = {"size": ("tool.larger", "tool.smaller"), "strength": ("tool.stronger", "tool.weaker")}[brush]
            self.commands.run(step[0] if notches > 0 else step[1])

    def takes(self, key: Qt.Key) -> bool:
        """True when this key belongs to what goes on here, whatever hotkey it is elsewhere."""
        dragging = self.drag is not None and key == Qt.Key.Key_Escape
        return dragging or bool(self.held) or isinstance(self.drag, BrushDrag)

    def key(self, key: Qt.Key, text: str, modifiers: tuple[str, ...], pointer: Pointer, on_screen: QPoint) -> bool:
        """A key goes down over the viewport. True when it did something here."""
        if self.drag is not None:
            return self._key_in_drag(key, text)
        if key == Qt.Key.Key_Escape:
            return False
        if self.held == "Space" and self.hotkeys.press_with_space(key):
            return True
        try:
            name = normal(_key_name(key))
        except ValueError:
            return False
        keymap = self.hotkeys.keymap
        brush = keymap.brushing(Gesture("", modifiers, name))
        if name in keymap.held_keys():
            self.held = name
        if brush == "radial":
            self.held = ""
            self.open_radial(on_screen)
        elif brush is not None:
            self._begin_brush(brush, pointer, None)
        return brush is not None or bool(self.held)

    def key_up(self, key: Qt.Key) -> None:
        """A key goes up."""
        if self.held and _key_name(key) == self.held:
            self.held = ""

    def leave(self) -> None:
        """The window lost the keyboard: no key is held any more. What a button holds goes on until it is released."""
        self.held = ""

    def all_up(self) -> None:
        """No button is down: a release that never came is made up for."""
        if self.drag is not None and self._button is not None:
            self.finish()

    def overlays(self) -> Overlays:
        """What goes on, drawn."""
        return self.drag.overlays() if isinstance(self.drag, BrushDrag | PictureDrag) else ()

    def doing(self) -> str:
        """What goes on and how it ends, for the status line; empty while nothing does."""
        drag = self.drag
        if isinstance(drag, StrokeDrag):
            return f"{self.desk.session.tool.label}: let go to keep it   Esc: give the stroke up"
        if isinstance(drag, CameraDrag):
            return f"{drag.words}   Let go: stay there   Esc: look as before"
        if isinstance(drag, PictureDrag):
            return f"{'Drag: larger or smaller' if drag.scales else 'Drag: move the picture'}   Esc: put it back"
        if isinstance(drag, BrushDrag):
            end = "Click or Enter: keep" if self._button is None else "Let go: keep"
            return f"Sideways: {drag.what}   Type a number   {end}   Esc or right button: as before"
        if self.held:
            return self._held_words()
        return ""

    def _held_words(self) -> str:
        """What the buttons do while a key is held."""
        keymap = self.hotkeys.keymap
        parts = [
            f"{text.removeprefix(self.held + '+')}: {action}"
            for action, gestures in (*keymap.navigate.items(), *keymap.brush.items()) for text in gestures
            if text.startswith(f"{self.held}+")]
        parts += [
            f"{text.removeprefix(self.held + '+')}: {self.commands[name].label.lower()}"
            for name, keys in keymap.keys.items() if name in self.commands
            for text in keys if text.startswith(f"{self.held}+")]
        return f"{self.held} held   " + "   ".join(parts[:8])

    def open_radial(self, place: QPoint) -> None:
        """The radial menu at a place of the screen."""
        entries = [
            Entry(name, self.commands[name].label, self.commands[name].icon, self.commands.reason(name))
            if name in self.commands else None
            for name in RADIAL
        ]
        self.radial = RadialMenu(self._window, entries)
        self.radial.chosen.connect(self.commands.run)
        self.radial.destroyed.connect(self._radial_gone)
        self.radial.open_at(place)

    def _radial_gone(self) -> None:
        self.radial = None

    def _key_in_drag(self, key: Qt.Key, text: str) -> bool:
        if key == Qt.Key.Key_Escape:
            self.finish(cancel=True)
        elif not isinstance(self.drag, BrushDrag):
            return False
        elif key in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self.finish()
        elif key == Qt.Key.Key_Backspace:
            self.drag.type("\b")
        elif text and text in DIGITS:
            self.drag.type(text)
        return True

    def _begin(self, drag: Drag, button: str | None) -> None:
        self.drag, self._button = drag, button

    def _begin_brush(self, what: str, pointer: Pointer, button: str | None) -> None:
        if not isinstance(self.desk.session.tool.params, RingParams if what == "size" else BrushParams):
            self.desk.said.emit(f"{self.desk.session.tool.label} has no ring.")
            return
        kind: Literal["size", "strength"] = "size" if what == "size" else "strength"
        self._begin(BrushDrag(self.desk, kind, pointer.x, pointer.y, self.eye.ratio()), button)


def guarded(desk: Desk, call: Callable[[], object]) -> object:
    """Call a tool; FAILED with the reason said when it raises, whatever it raises: no stroke may hang."""
    try:
        return call()
    except UserError as error:
        desk.error(error)
    except Exception as error:  # a tool may be a studio's own
        label = desk.session.tool.label
        desk.error(UserError(f"{label} did not work ({error}); the stroke was given up."), traceback.format_exc())
    desk.session.hand.cancel()
    return FAILED


def _key_name(key: Qt.Key) -> str:
    return QKeySequence(key).toString(QKeySequence.SequenceFormat.PortableText)
