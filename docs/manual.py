"""The parts of the manual made from the program itself: ``make pictures`` writes them, a test compares."""

from __future__ import annotations

import re
from typing import get_args

from app.window.keymap import PRESETS, Brush, Keymap, Navigation, preset
from docs.first_groom import chapter
from tools.registry import Registry

WORDS = {"LMB": "left button", "MMB": "middle button", "RMB": "right button", "Wheel": "wheel"}
MOVES = {
    "orbit": "turn", "tumble": "turn the other way (turntable or free)", "pan": "slide", "dolly": "nearer, farther",
    "zoom": "change the lens",
}
BRUSH = {
    "size": "size of the ring", "strength": "strength", "radial": "radial menu",
    "picture": "move or size a pinned picture",
}


def parts() -> dict[str, str]:
    """What stands between the marks of each name."""
    maps = [preset(name) for name in PRESETS]
    return {"first groom": chapter(), "tools": tools_table(maps), "navigation": navigation_table(maps)}


def tools_table(keymaps: list[Keymap]) -> str:
    """Every tool of the house with its keys."""
    rows = [["tool", *(k.name for k in keymaps), "what it does", "the hand"]]
    for tool in Registry(folders=()):
        if tool.craft != "groom":
            continue  # each craft has a manual of its own
        keys = [_keys(k.of(f"tool.{tool.name}")) for k in keymaps]
        rows.append([f"**{tool.label}**", *keys, tool.tooltip, re.sub(" {2,}", "; ", tool.hint)])
    return _table(rows)


def navigation_table(keymaps: list[Keymap]) -> str:
    """How each keymap moves the camera and sets the brush."""
    rows = [["", *(k.name for k in keymaps)]]
    for move in get_args(Navigation):
        rows.append([MOVES[move], *(_gestures(k.navigate.get(move, ())) for k in keymaps)])
    for brush in get_args(Brush):
        rows.append([BRUSH[brush], *(_gestures(k.brush.get(brush, ())) for k in keymaps)])
    for name, words in (("view.frame_all", "see everything"), ("view.frame_selected", "see what is selected"),
                        ("view.right", "from the right"), ("view.top", "from above"), ("edit.undo", "undo"),
                        ("tool.symmetry", "symmetry X"), ("window.palette", "find a command")):
        rows.append([words, *(_keys(k.of(name)) for k in keymaps)])
    return _table(rows)


def written(text: str) -> str:
    """The manual with its made parts made anew; ValueError when one has lost its marks."""
    for name, part in parts().items():
        begin, end = f"<!-- {name}: made by make pictures -->", f"<!-- end of {name} -->"
        if text.count(begin) != 1 or text.count(end) != 1:
            raise ValueError(f"docs/groom.md has lost the marks of {name}")
        before, rest = text.split(begin)
        text = f"{before}{begin}\n{part}\n{end}{rest.split(end)[1]}"
    return text


def _keys(keys: tuple[str, ...]) -> str:
    return ", ".join(f"`{key}`" for key in keys) if keys else "–"


def _gestures(gestures: tuple[str, ...]) -> str:
    def spoken(text: str) -> str:
        return " + ".join(WORDS.get(part, part) for part in text.split("+"))

    return ", ".join(spoken(text) for text in gestures) if gestures else "–"


def _table(rows: list[list[str]]) -> str:
    head, *body = [[cell.replace("|", "\\|") for cell in row] for row in rows]
    lines = [head, ["---"] * len(head), *body]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
