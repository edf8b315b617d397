"""How the commands of a category stand in its menu: in parts with lines between, long ones in menus of their own."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple


class Part(NamedTuple):
    """Commands in a row, from `first` up to the first of another part. title : of a menu of their own, or ""."""

    first: str
    title: str = ""


# parts in the order of the menu; what no part begins with stands where the order of the commands puts it
PARTS: dict[str, tuple[Part, ...]] = {
    "file": (
        Part("new"), Part("save"), Part("import_mesh"), Part("open_plate"), Part("screenshot"), Part("quit")),
    "scene": (Part("add_groom"), Part("lock")),
    "view": (
        Part("frame_all"), Part("front", "From a side"), Part("projection"), Part("store_1", "Bookmarks"),
        Part("shaded", "Shading"), Part("wire_overlay"), Part("isolate"), Part("background", "Pictures"),
        Part("denser"), Part("heat_plain", "Colours of the pose"), Part("single", "Compare methods")),
    "frame": (Part("play"), Part("begin_here")),
    "curves": (Part("insert"), Part("auto"), Part("snap_keys"), Part("select_all"), Part("frame_all"), Part("snap")),
    "tool": (
        Part("plant", "Groom tools"), Part("shaft", "Feather tools"), Part("rotate", "Pose tools"),
        Part("track_point", "Match tools"), Part("larger"), Part("symmetry")),
    "groom": (
        Part("select_all"), Part("freeze_selected"), Part("delete_selected"), Part("spray_selected"), Part("mirror")),
    "pose": (
        Part("mirror_pose"), Part("key_pose"), Part("store_pose"), Part("import_sculpt", "Sculpts"),
        Part("add_dial", "Controls"), Part("limit_joint", "Joints"), Part("mirror_weights", "Skin weights"),
        Part("clear_mask", "Mask")),
    "match": (
        Part("forward"), Part("features", "Features, planes, flow"), Part("solve"), Part("cube", "Solved camera"),
        Part("delete_shapes"),
        Part("key", "Keys of tracks"), Part("delete", "Selected tracks"), Part("select_all"), Part("next_key"),
        Part("nudge_left", "Nudge"), Part("next_plate"),
        Part("take_photographs", "Model of photographs"), Part("build_polygon", "Build on points"),
        Part("know_distance", "Known of points"), Part("model_origin", "World of the model")),
    "window": (
        Part("craft_groom"), Part("shelf", "Panels"), Part("palette"), Part("theme"), Part("preferences"),
        Part("reset_layout")),
}


class Row(NamedTuple):
    """Commands that stand together in a menu. title : of a menu of their own, or ""."""

    title: str
    names: tuple[str, ...]


def rows_of(category: str, names: Sequence[str]) -> list[Row]:
    """The parts of a menu, with `names` ("view.front") of a category in the order of the commands."""
    parts = PARTS.get(category, ())
    titles = {f"{category}.{part.first}": part.title for part in parts}
    found: dict[str, list[str]] = {}
    at = ""
    for name in names:
        at = name if name in titles else at
        found.setdefault(at, []).append(name)
    order = ["", *titles]
    return [Row(titles.get(first, ""), tuple(found[first])) for first in order if first in found]
