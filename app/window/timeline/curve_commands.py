"""Commands on the keys of curves: in the curve panel and in the row of keys below the timeline."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from app.window.commands import Command, Window
from app.window.timeline.curve_editor import TANGENTS
from core.curve import Tangent

if TYPE_CHECKING:
    from app.window.desk import Desk

_WORKSPACE = "core.workspace.Workspace"
_ABOUT: dict[Tangent, tuple[str, str, str, str]] = {  # name, icon, tooltip, words
    "smooth": ("auto", "tangent-auto",
               "Lets the curve run smoothly through the selected keys and never overshoot.", "smooth spline"),
    "linear": ("linear", "tangent-linear", "Aims the selected keys straight at their neighbours.", "straight"),
    "step": ("constant", "tangent-constant",
             "Holds the value of each selected key until the next one.", "step stepped hold"),
    "aligned": ("aligned", "tangent-aligned",
                "Gives the selected keys two handles that always turn as one.", "bezier unify"),
    "free": ("free", "tangent-free",
             "Gives the selected keys two handles that turn one without the other.", "bezier break"),
}


def _needs_selection(desk: Desk) -> str | None:
    return desk.keys.needs_selection()


def _needs_curves(desk: Desk) -> str | None:
    return desk.keys.needs_curves()


def _needs_clip(desk: Desk) -> str | None:
    return desk.keys.needs_clip()


def _turn(kind: Tangent) -> Callable[[Window], None]:
    return lambda window: window.desk.keys.turn(kind)


def _tangent(kind: Tangent) -> Command:
    name, icon, tooltip, words = _ABOUT[kind]
    return Command(
        f"curves.{name}", TANGENTS[kind], tooltip, _turn(kind), "core.curve_edit.with_tangents", "document", "Tangents",
        _needs_selection, icon=icon, scope="curves", words=f"{words} interpolation handle keys")


CURVES: tuple[Command, ...] = (
    Command(
        "curves.insert", "Insert keys", "Sets a key on the present frame of every curve that is shown.",
        lambda w: w.desk.keys.insert(), "core.curve_edit.with_key", "document", "Insert keys", _needs_curves,
        icon="key", scope="curves", words="add keyframe animate"),
    Command(
        "curves.delete", "Delete keys", "Takes the selected keys away; the last of a curve leaves a plain number.",
        lambda w: w.desk.keys.delete(), "core.curve_edit.without_keys", "document", "Delete keys", _needs_selection,
        icon="delete", scope="curves", words="remove keyframe"),
    Command(
        "curves.copy", "Copy keys", "Remembers the selected keys, to be pasted at another frame or curve.",
        lambda w: w.desk.keys.copy(), "core.curve.Key", "window", enabled=_needs_selection, icon="copy",
        scope="curves", words="keyframe clipboard"),
    Command(
        "curves.paste", "Paste keys", "Puts the copied keys in, the first of them on the present frame.",
        lambda w: w.desk.keys.paste(), "core.curve_edit.pasted_keys", "document", "Paste keys", _needs_clip,
        icon="paste", scope="curves", words="keyframe clipboard"),
    *map(_tangent, TANGENTS),
    Command(
        "curves.snap_keys", "Snap keys to frames", "Moves every selected key to the whole frame nearest to it.",
        lambda w: w.desk.keys.snap(), "core.curve_edit.snapped_keys", "document", "Snap keys", _needs_selection,
        scope="curves", words="round whole"),
    Command(
        "curves.select_all", "Select all keys", "Selects every key of all the curves that are shown.",
        lambda w: w.desk.keys.select_all(), "tools.keyed.keyed_values", "window", enabled=_needs_curves,
        scope="curves"),
    Command(
        "curves.select_none", "Deselect all keys", "Lets go of all keys, so that no command changes them.",
        lambda w: w.desk.keys.select({}), "tools.keyed.keyed_values", "window", enabled=_needs_selection,
        scope="curves", words="none"),
    Command(
        "curves.frame_all", "Show all curves", "Moves and scales the curve panel until all its keys are seen.",
        lambda w: w.desk.keys.shown.emit("all"), "tools.keyed.keyed_values", "window", enabled=_needs_curves,
        icon="frame-all", scope="curves", words="fit home zoom frame"),
    Command(
        "curves.frame_selected", "Show selected keys", "Moves and scales the curve panel to the selected keys.",
        lambda w: w.desk.keys.shown.emit("selected"), "tools.keyed.keyed_values", "window",
        enabled=_needs_selection, icon="frame-selected", scope="curves", words="fit zoom frame"),
    Command(
        "curves.next", "Next key", "Goes to the next frame on which a curve that is shown has a key.",
        lambda w: w.desk.keys.go(1), _WORKSPACE, enabled=_needs_curves, scope="curves", repeats=True,
        words="jump keyframe forward"),
    Command(
        "curves.previous", "Previous key", "Goes back to the frame of the key before on the curves that are shown.",
        lambda w: w.desk.keys.go(-1), _WORKSPACE, enabled=_needs_curves, scope="curves", repeats=True,
        words="jump keyframe back"),
    Command(
        "curves.snap", "Snap while dragging", "Lets dragged keys land on whole frames; Ctrl does the opposite.",
        lambda w: w.desk.keys.switch("snaps"), "core.curve_edit.snapped_keys", "window",
        checked=lambda desk: desk.keys.snaps, icon="snap", scope="curves", words="magnet whole frames keys"),
    Command(
        "curves.normalize", "Every curve full height",
        "Draws every curve as high as the panel, so that small and large values are seen together.",
        lambda w: w.desk.keys.switch("normalized"), "tools.keyed.keyed_values", "window",
        checked=lambda desk: desk.keys.normalized, icon="normalize", scope="curves", words="normalise normalize fit"),
)
