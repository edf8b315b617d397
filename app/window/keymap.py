"""Keymaps: which keys run which commands, and which buttons move the camera. Presets are JSON; changes are kept apart.

A key is one key with modifiers ("Ctrl+Shift+Z"), or a key pressed while Space is held ("Space+H"). A gesture is a
mouse button or the wheel with modifiers and perhaps a held key ("Alt+LMB", "Space+MMB", "B+LMB"), or a key alone that
begins a gesture which the next click ends ("F").
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal, NamedTuple

import msgspec
from PySide6.QtGui import QKeySequence

from app.window.commands import CRAFT_SCOPES, Scope
from app.window.settings import read_strictly, settings_folder, write_whole
from core.errors import UserError
from core.record import Record

PRESETS = ("blender", "maya", "houdini")
MODIFIERS = ("Ctrl", "Alt", "Shift", "Meta")  # in the order Qt writes them down
BUTTONS = ("LMB", "MMB", "RMB", "Wheel")
HELD = "Space+"
FILE = "keymap.json"

Navigation = Literal["orbit", "tumble", "pan", "dolly", "zoom"]
Brush = Literal["size", "strength", "radial", "picture"]
Keys = tuple[str, ...]


class Gesture(NamedTuple):
    """`button` with `modifiers` (in the order of MODIFIERS) while `key` is held; or a `key` alone, without button."""

    button: str = ""
    modifiers: tuple[str, ...] = ()
    key: str = ""


class Conflict(NamedTuple):
    """A key or gesture that means more than one thing in one place; `names` of commands or gestures."""

    keys: str
    names: tuple[str, ...]


class Keymap(Record):
    """One keymap.

    navigate : gestures that move the camera; "orbit" turns as preferred, "tumble" the other way. brush : gestures of
    the brush's size and strength, the radial menu, and of pictures pinned to the view.
    keys : keys of commands by name; a command that is not named has none.
    """

    name: str
    navigate: dict[Navigation, Keys]
    brush: dict[Brush, Keys]
    keys: dict[str, Keys]

    def __post_init__(self) -> None:
        for gestures in (*self.navigate.values(), *self.brush.values()):
            for text in gestures:
                gesture(text)
        for keys in self.keys.values():
            for text in keys:
                if normal(text) != text:
                    raise ValueError(f"{text!r} is written {normal(text)!r}")

    def of(self, name: str) -> Keys:
        """Keys of a command, the one to show first; empty when it has none."""
        return self.keys.get(name, ())

    def shown(self, name: str) -> str:
        """The first key of a command as this system writes it, or an empty string."""
        keys = self.of(name)
        return shown(keys[0]) if keys else ""

    def assigned(self, name: str, keys: Keys) -> Keymap:
        """This keymap with these keys for a command."""
        changed: Keymap = self.replace(keys={**self.keys, name: tuple(normal(text) for text in keys)})
        return changed

    def navigation(self, pressed: Gesture) -> Navigation | None:
        """How this gesture moves the camera, or None."""
        for action, gestures in self.navigate.items():
            if any(gesture(text) == pressed for text in gestures):
                return action
        return None

    def brushing(self, pressed: Gesture) -> Brush | None:
        """What this gesture does to the brush, or None."""
        for action, gestures in self.brush.items():
            if any(gesture(text) == pressed for text in gestures):
                return action
        return None

    def held_keys(self) -> frozenset[str]:
        """Keys that do something only while they are held, so that a press alone is not a command."""
        mouse = (gesture(t) for g in (*self.navigate.values(), *self.brush.values()) for t in g)
        held = {one.key for one in mouse if one.button and one.key}
        return frozenset(held | {"Space" for keys in self.keys.values() for text in keys if text.startswith(HELD)})

    def with_space(self, key: str) -> str | None:
        """The command of a key pressed while Space is held, or None."""
        return next((name for name, keys in self.keys.items() if HELD + key in keys), None)


def normal(text: str) -> str:
    """The one way to write a key down.

    Raises
    ------
    ValueError
        It is not one key with modifiers.
    """
    if text.startswith(HELD):
        return HELD + normal(text.removeprefix(HELD))
    sequence = QKeySequence.fromString(text, QKeySequence.SequenceFormat.PortableText)
    written = sequence.toString(QKeySequence.SequenceFormat.PortableText)
    if sequence.count() != 1 or not written or sequence[0].key().value in (0, 0x01FFFFFF):
        raise ValueError(f"{text!r} is not a key")
    return written


def shown(text: str) -> str:
    """A key as this system writes it."""
    if text.startswith(HELD):
        return HELD + shown(text.removeprefix(HELD))
    return QKeySequence(text).toString(QKeySequence.SequenceFormat.NativeText)


def gesture(text: str) -> Gesture:
    """Read a gesture; ValueError when it is none."""
    *before, last = text.split("+")
    button = last if last in BUTTONS else ""
    parts = before if button else [*before, last]
    modifiers = tuple(m for m in MODIFIERS if m in parts)
    keys = [part for part in parts if part not in MODIFIERS]
    if len(keys) > 1 or (not keys and not button) or len(set(parts)) != len(parts):
        raise ValueError(f"{text!r} is not a gesture")
    return Gesture(button, modifiers, normal(keys[0]) if keys else "")


def conflicts(keymap: Keymap, scopes: Mapping[str, Scope]) -> tuple[Conflict, ...]:
    """Keys and gestures that mean two things in one place. `scopes` : where the keys of each command work."""
    claims: dict[str, list[tuple[str, Scope]]] = {}
    for name, keys in keymap.keys.items():
        for text in keys:
            claims.setdefault(text, []).append((name, scopes.get(name, "everywhere")))
    buttons: dict[Gesture, list[str]] = {
        Gesture("LMB"): ["stroke"], Gesture("LMB", ("Shift",)): ["stroke"], Gesture("LMB", ("Ctrl",)): ["stroke"]}
    held: set[str] = set()
    for action, gestures in (*keymap.navigate.items(), *keymap.brush.items()):
        for text in gestures:
            one = gesture(text)
            if one.button:
                buttons.setdefault(one, []).append(action)
                held |= {one.key} if one.key else set()
            else:
                claims.setdefault("+".join((*one.modifiers, one.key)), []).append((action, "viewport"))
    if any(text.startswith(HELD) for text in claims):
        held.add("Space")
    for key in sorted(held):
        claims.setdefault(key, []).append((f"held {key}", "viewport"))
    found = [Conflict(_written(one), tuple(names)) for one, names in buttons.items() if len(names) > 1]
    for text, owners in claims.items():
        names = tuple(name for i, (name, scope) in enumerate(owners) if _meets(scope, owners[:i] + owners[i + 1 :]))
        if len(names) > 1:
            found.append(Conflict(text, names))
    return tuple(found)


def _meets(scope: Scope, others: Iterable[tuple[str, Scope]]) -> bool:
    def meets(other: Scope) -> bool:
        in_view = "viewport" in (scope, other) and (scope in CRAFT_SCOPES or other in CRAFT_SCOPES)
        return "everywhere" in (scope, other) or scope == other or in_view

    return any(meets(other) for _, other in others)


def _written(one: Gesture) -> str:
    return "+".join(part for part in (*one.modifiers, one.key, one.button) if part)


def decode(data: bytes) -> Keymap:
    """A keymap from its JSON; ValueError that names the offending field."""
    return msgspec.json.decode(data, type=Keymap)  # msgspec's errors are ValueErrors


def preset(name: str) -> Keymap:
    """A keymap that comes with the program; UserError when there is none of that name."""
    if name not in PRESETS:
        raise UserError(f"There is no keymap {name!r}; choose one of {', '.join(PRESETS)}.")
    return decode((files("resources") / "keymaps" / f"{name}.json").read_bytes())


class Changes(Record):
    """What the artist changed, for each preset: keys by command."""

    changes: dict[str, dict[str, Keys]] = {}  # noqa: RUF012 (msgspec makes a new one each time)


class LoadedKeymap(NamedTuple):
    """`trouble` says in words what was wrong with the artist's file and where it was put aside, or is None."""

    keymap: Keymap
    trouble: str | None


def load(name: str, folder: Path | None = None) -> LoadedKeymap:
    """A preset with the artist's changes. A broken file of changes is put aside and said; it never stops a start."""
    base = preset(name if name in PRESETS else PRESETS[0])
    changes, trouble = read_strictly((folder or settings_folder()) / FILE, Changes, _checked)
    return LoadedKeymap(with_changes(base, changes.changes.get(name, {})), trouble)


def save(keymap: Keymap, name: str, folder: Path | None = None) -> None:
    """Keep how `keymap` differs from the preset it was made from; UserError when that cannot be written."""
    path = (folder or settings_folder()) / FILE
    known, _ = read_strictly(path, Changes, _checked)
    base = preset(name)
    mine = {n: keys for n, keys in keymap.keys.items() if keys != base.of(n)}
    mine |= {n: () for n, keys in base.keys.items() if keys and n not in keymap.keys}
    write_whole(path, known.replace(changes={**known.changes, name: mine}))


def with_changes(base: Keymap, changes: Mapping[str, Keys]) -> Keymap:
    """A preset with changes; the changed command has its keys alone where both want them."""
    changed: Keymap = base.replace(keys={**base.keys, **changes})
    return changed


def _checked(changes: Any) -> None:
    for commands in changes.changes.values():
        for keys in commands.values():
            for text in keys:
                normal(text)
