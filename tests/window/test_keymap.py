"""Keymaps: true presets without conflicts, changes that last, files that do not stop a start."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.window import keymap as keymaps
from app.window.all_commands import all_commands
from app.window.keymap import Gesture, Keymap, gesture, normal
from core.errors import UserError
from tools.registry import Registry

TABLE = {command.name: command for command in all_commands(Registry(()))}
SCOPES = {name: command.scope for name, command in TABLE.items()}


@pytest.mark.parametrize("name", keymaps.PRESETS)
def test_a_preset_has_no_conflict_and_names_only_commands(name: str) -> None:
    keymap = keymaps.preset(name)
    assert keymaps.conflicts(keymap, SCOPES) == ()
    assert set(keymap.keys) <= set(TABLE)
    assert set(keymap.navigate) >= {"orbit", "tumble", "pan", "dolly"}
    assert set(keymap.brush) == {"size", "strength", "radial", "picture"}


@pytest.mark.parametrize(("name", "command", "key"), [
    # as their own manuals have it
    ("blender", "view.frame_selected", "Num+."), ("blender", "view.frame_all", "Home"),
    ("blender", "edit.redo", "Ctrl+Shift+Z"), ("blender", "view.hide", "H"), ("blender", "view.unhide_all", "Alt+H"),
    ("maya", "view.frame_selected", "F"), ("maya", "view.frame_all", "A"), ("maya", "edit.undo", "Z"),
    ("maya", "frame.play", "Alt+V"), ("maya", "view.wire", "4"),
    ("houdini", "view.frame_all", "Space+H"), ("houdini", "view.frame_selected", "Space+G"),
    ("houdini", "frame.play", "Up"), ("houdini", "frame.next", "Right"),
])
def test_presets_are_true_to_their_programs(name: str, command: str, key: str) -> None:
    assert key in keymaps.preset(name).of(command)


@pytest.mark.parametrize(("name", "pressed", "action"), [
    ("blender", Gesture("MMB"), "orbit"), ("blender", Gesture("MMB", ("Shift",)), "pan"),
    ("blender", Gesture("MMB", ("Ctrl",)), "dolly"), ("blender", Gesture("LMB", ("Alt",)), None),
    ("maya", Gesture("LMB", ("Alt",)), "orbit"), ("maya", Gesture("MMB", ("Alt",)), "pan"),
    ("maya", Gesture("RMB", ("Alt",)), "dolly"), ("maya", Gesture("MMB"), None),
    ("houdini", Gesture("LMB", (), "Space"), "orbit"), ("houdini", Gesture("LMB", ("Alt",)), "orbit"),
    ("houdini", Gesture("MMB", (), "Space"), "pan"), ("houdini", Gesture("RMB", (), "Space"), "dolly"),
])
def test_the_camera_moves_as_in_their_programs(name: str, pressed: Gesture, action: str | None) -> None:
    assert keymaps.preset(name).navigation(pressed) == action


def test_the_brush_is_sized_as_in_their_programs() -> None:
    assert keymaps.preset("blender").brushing(Gesture(key="F")) == "size"
    assert keymaps.preset("blender").brushing(Gesture("", ("Shift",), "F")) == "strength"
    assert keymaps.preset("maya").brushing(Gesture("LMB", (), "B")) == "size"
    assert keymaps.preset("maya").held_keys() == {"B", "M"}
    assert keymaps.preset("houdini").held_keys() == {"Space"}
    assert keymaps.preset("houdini").with_space("H") == "view.frame_all"
    assert keymaps.preset("houdini").with_space("J") is None


@pytest.mark.parametrize(("written", "once"), [
    ("Shift+Ctrl+z", "Ctrl+Shift+Z"), ("Delete", "Del"), ("Num+1", "Num+1"), ("Space+g", "Space+G"), ("?", "?")])
def test_a_key_is_written_in_one_way(written: str, once: str) -> None:
    assert normal(written) == once


@pytest.mark.parametrize("text", ["", "Ctrl", "Ctrl+K, Ctrl+C", "Nonsense", "LMB"])
def test_what_is_no_key_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="not a key"):
        normal(text)


@pytest.mark.parametrize("text", ["", "Alt", "Alt+Alt+LMB", "A+B+LMB", "LMB+Alt"])
def test_what_is_no_gesture_is_refused(text: str) -> None:
    with pytest.raises(ValueError):
        gesture(text)


def small(**parts: object) -> Keymap:
    return Keymap(**{"name": "t", "navigate": {}, "brush": {}, "keys": {}, **parts})


@pytest.mark.parametrize(("keymap", "keys", "names"), [
    (small(keys={"a": ("Ctrl+Z",), "b": ("Ctrl+Z",)}), "Ctrl+Z", ("a", "b")),
    (small(keys={"a": ("Del",), "view": ("Del",)}), "Del", ("a", "view")),
    (small(keys={"view": ("F",)}, brush={"size": ("F",)}), "F", ("view", "size")),
    (small(keys={"view": ("B",)}, brush={"size": ("B+LMB",)}), "B", ("view", "held B")),
    (small(keys={"view": ("Space+G",)}, brush={"radial": ("Space",)}), "Space", ("radial", "held Space")),
    (small(navigate={"orbit": ("Alt+LMB",), "pan": ("Alt+LMB",)}), "Alt+LMB", ("orbit", "pan")),
    (small(navigate={"orbit": ("Shift+LMB",)}), "Shift+LMB", ("stroke", "orbit")),
    (small(navigate={"dolly": ("Wheel",)}, brush={"size": ("Wheel",)}), "Wheel", ("dolly", "size")),
])
def test_one_key_with_two_meanings_is_found(keymap: Keymap, keys: str, names: tuple[str, ...]) -> None:
    scopes: dict[str, keymaps.Scope] = {"view": "viewport", "tree": "outliner"}
    assert keymaps.conflicts(keymap, scopes) == (keymaps.Conflict(keys, names),)


def test_one_key_may_mean_two_things_in_two_places() -> None:
    keymap = small(keys={"view": ("Del",), "tree": ("Del",)})
    assert keymaps.conflicts(keymap, {"view": "viewport", "tree": "outliner"}) == ()
    assert len(keymaps.conflicts(keymap, {"view": "viewport", "tree": "everywhere"})) == 1


def test_changes_are_kept_for_each_preset(tmp_path: Path) -> None:
    changed = keymaps.preset("maya").assigned("edit.undo", ("Ctrl+U",)).assigned("frame.play", ())
    keymaps.save(changed, "maya", tmp_path)
    again, trouble = keymaps.load("maya", tmp_path)
    assert trouble is None
    assert again.of("edit.undo") == ("Ctrl+U",)
    assert again.of("frame.play") == ()
    assert again.keys == changed.keys
    assert keymaps.load("blender", tmp_path).keymap.keys == keymaps.preset("blender").keys
    keymaps.save(keymaps.preset("blender").assigned("view.hide", ("J",)), "blender", tmp_path)
    assert keymaps.load("maya", tmp_path).keymap.of("edit.undo") == ("Ctrl+U",)


@pytest.mark.parametrize("content", [
    b"{", b"\xff\xfe", b"[]", b'{"changes": {"maya": {"edit.undo": [7]}}}', b'{"changes": {}, "evil": 1}',
    b'{"changes": {"maya": {"edit.undo": ["no such key"]}}}', b"[" * 100_000, b"", b"0" * (2 << 20)])
def test_a_broken_file_of_changes_is_put_aside_and_said(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "keymap.json").write_bytes(content)
    keymap, trouble = keymaps.load("maya", tmp_path)
    assert keymap.keys == keymaps.preset("maya").keys
    assert trouble is not None
    assert "keymap.json" in trouble
    assert (tmp_path / "keymap.json.broken").read_bytes() == content
    assert keymaps.load("maya", tmp_path).trouble is None


def test_a_keymap_file_is_decoded_strictly() -> None:
    with pytest.raises(ValueError, match="navigate"):
        keymaps.decode(b'{"name": "x", "navigate": {"orbit": 3}, "brush": {}, "keys": {}}')
    with pytest.raises(ValueError, match="colour"):
        keymaps.decode(b'{"name": "x", "navigate": {}, "brush": {}, "keys": {}, "colour": 1}')
    with pytest.raises(ValueError, match="is written"):
        keymaps.decode(b'{"name": "x", "navigate": {}, "brush": {}, "keys": {"a": ["Shift+Ctrl+Z"]}}')
    with pytest.raises(UserError, match="blender"):
        keymaps.preset("softimage")
