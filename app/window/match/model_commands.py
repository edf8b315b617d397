"""Commands of models from photographs: walking, solving, what is known, what is built."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from app.window.ask_text import ask_text
from app.window.commands import Command, Window
from app.window.match.commands import frame_of, needs_plate
from core.document import Document
from core.errors import UserError
from tools import photomodel_edits as edits
from tools.match_edits import shown_plate
from tools.photomodel_edits import model_of, points_in_hand

if TYPE_CHECKING:
    from app.window.desk import Desk

_EDITS = "tools.photomodel_edits."
_SOLVE = "core.match.photomodel.solve.solved"


def needs_model(desk: Desk) -> str | None:
    """There must be a model of photographs."""
    return None if model_of(desk.document) is not None else edits.NO_MODEL


def needs_points(desk: Desk) -> str | None:
    """A point of the model must be in hand."""
    model = model_of(desk.document)
    if model is None:
        return edits.NO_MODEL
    return None if points_in_hand(model) else "No point is in hand: click one with Pick point; Shift adds."


def needs_parts(desk: Desk) -> str | None:
    """Something must be built."""
    model = model_of(desk.document)
    if model is None:
        return edits.NO_MODEL
    return None if model.parts else "Nothing is built yet: select points and build a polygon or a box of them."


def _edit(step: str, function: Callable[..., Document], *told: object, **named: object) -> Callable[[Window], None]:
    def run(window: Window) -> None:
        window.desk.edit(step, function, *told, **named)

    return run


def _asking(
    title: str, question: str, step: str, function: Callable[..., Document], kind: str, wrap: bool = True,
) -> Callable[[Window], None]:
    """A run that asks for a number and does an edit with it; `wrap` gives it as the value of a record."""

    def run(window: Window) -> None:
        def told(words: str) -> None:
            try:
                number = float(words.replace(",", "."))
            except ValueError:
                raise UserError(f"{words!r} is no number; give metres, such as 1.8.") from None
            window.desk.edit(step, function, kind, (number,) if wrap else number)

        ask_text(window, title, question, lambda words: window.desk.attempt(told, words))

    return run


def _next_point(window: Window) -> None:
    plate = shown_plate(window.desk.document)
    if plate is not None:
        window.desk.edit("Select points", edits.select_next_point, plate.id, frame_of(window.desk))


def _remove_pick(window: Window) -> None:
    plate = shown_plate(window.desk.document)
    if plate is not None:
        window.desk.edit("Remove pick", edits.remove_pick, plate.id, frame_of(window.desk))


def _command(
    name: str, label: str, tooltip: str, run: Callable[[Window], object], twin: str, undo: str | None,
    enabled: Callable[[Desk], str | None] = needs_points, words: str = "",
) -> Command:
    return Command(
        f"match.{name}", label, tooltip, run, twin, "document" if undo else "workspace", undo, enabled, scope="match",
        words=f"photomodel photogrammetry model photograph {words}")


def _build(kind: str, label: str, tooltip: str, words: str = "") -> Command:
    return _command(f"build_{kind}", label, tooltip, _edit(label, edits.add_part, kind), _EDITS + "add_part", label,
                    needs_model if kind in ("extrude", "bridge") else needs_points, f"build face {words}")


def _know(kind: str, label: str, tooltip: str, words: str = "") -> Command:
    return _command(f"know_{kind}", label, tooltip, _edit(label, edits.add_known, kind), _EDITS + "add_known", label,
                    words=f"constraint known {words}")


def _world(what: str, label: str, tooltip: str) -> Command:
    return _command(f"model_{what}", label, tooltip, _edit(label, edits.set_world, what), _EDITS + "set_world", label,
                    words="line up coordinate system world")


MODEL: tuple[Command, ...] = (
    _command("take_photographs", "Take photographs in",
             "Makes every still and every frame of short plates a photograph of the model.",
             _edit("Take photographs in", edits.take_photographs), _EDITS + "take_photographs", "Take photographs in",
             needs_plate, "stills add"),
    _command("next_photo", "Next photograph",
             "Looks at the photograph in which the point in hand should be picked next, or the next one.",
             lambda w: w.match.model.walk(1), _EDITS + "walk", None, needs_model, "walk"),
    _command("previous_photo", "Photograph before", "Looks at the photograph before; the point in hand stays in hand.",
             lambda w: w.match.model.walk(-1), _EDITS + "walk", None, needs_model, "walk"),
    _command("next_point", "Next point to pick here",
             "Takes the next point in hand that is not picked in this photograph yet.", _next_point,
             _EDITS + "select_next_point", "Select points", needs_model, "select"),
    _command("no_point", "Let go of points", "Takes no point in hand, so that the next click picks a new one.",
             _edit("Select points", edits.select_points, ()), _EDITS + "select_points", "Select points",
             words="deselect none new"),
    _command("solve_model", "Solve photomodel",
             "Finds where the photographs were taken and where the points are, from what is picked.",
             lambda w: w.match.model.solve(), _SOLVE, "Solve photomodel", needs_model, "structure camera reconstruct"),
    _command("solve_model_again", "Solve photomodel anew", "Solves from the picks alone and forgets where things were.",
             lambda w: w.match.model.solve(again=True), _SOLVE, "Solve photomodel", needs_model, "reset structure"),
    _command("find_focal", "Find focal lengths", "Lets solves look for the focal lengths of the photographs too.",
             _edit("Find focal lengths", edits.set_focal, find=True), _EDITS + "set_focal", "Find focal lengths",
             needs_model, "free lens"),
    _command("keep_focal", "Keep focal lengths", "Holds the focal lengths of the photographs where they are now.",
             _edit("Keep focal lengths", edits.set_focal, find=False), _EDITS + "set_focal", "Keep focal lengths",
             needs_model, "fix lens"),
    _command("remove_pick", "Remove pick here", "Takes the picks of the points in hand out of this photograph.",
             _remove_pick, _EDITS + "remove_pick", "Remove pick"),
    _command("delete_points", "Delete points", "Takes the points in hand out of the model, with what stands on them.",
             _edit("Delete points", edits.delete_points), _EDITS + "delete_points", "Delete points"),
    _build("polygon", "Build polygon", "Makes a face of the points in hand, in their order around it.", "face"),
    _build("box", "Build box", "Makes a box of a corner in hand and the ends of its three edges.", "cube"),
    _command("build_extrude", "Build extrusion…",
             "Extrudes the points in hand, or the part built last, by a height along its normal.",
             _asking("Extrude", "How far along the normal, in the unit of the model", "Build extrusion",
                     edits.add_part, "extrude"), _EDITS + "add_part", "Build extrusion", needs_model, "build height"),
    _build("lathe", "Build lathe", "Turns a profile about an axis: select its two points, then those of the profile.",
           "revolve round"),
    _build("mirror", "Build mirror image",
           "Mirrors the part built last in the plane of three points, or between two.", "symmetry"),
    _build("bridge", "Build bridge", "Joins the outlines of the two parts that were built last by faces.", "loft"),
    _command("delete_part", "Delete last part", "Takes away the part of the model that was built last.",
             _edit("Delete last part", edits.delete_last_part), _EDITS + "delete_last_part", "Delete last part",
             needs_parts, "remove build"),
    _command("know_distance", "Known distance…", "Says how far the two points in hand are apart; the solve holds it.",
             _asking("Known distance", "How far the two points are apart, in metres", "Known distance",
                     edits.add_known, "distance"), _EDITS + "add_known", "Known distance", words="constraint length"),
    _know("right", "Known right angle", "Holds the way from point 1 to 2 square to that from point 3 to 4.",
          "perpendicular 90"),
    _know("parallel", "Known parallel", "Holds the way from point 1 to 2 parallel to that from point 3 to 4."),
    _know("equal", "Known equal lengths", "Holds the way from point 1 to 2 as long as that from point 3 to 4."),
    _know("plane", "Known plane", "Holds the four points in hand or more on one plane.", "flat"),
    _know("line", "Known line", "Holds the three points in hand or more on one straight line.", "straight"),
    _know("symmetric", "Known symmetry", "Holds pairs of points in hand, one after its mirror image, symmetric.",
          "mirror pair"),
    _command("forget_known", "Forget what is known", "Lets go of all that is known of the points in hand alone.",
             _edit("Forget what is known", edits.forget_known), _EDITS + "forget_known", "Forget what is known",
             words="constraint delete"),
    _world("origin", "Model origin", "Puts the origin of the model's world at the point in hand."),
    _world("axis", "Model x axis", "Turns the model: x leads from the first point in hand to the second."),
    _world("plane", "Model ground", "Levels the model at the three points in hand or more, y up."),
    _command("model_distance", "Model scale…", "Scales the whole model so that two points in hand are so far apart.",
             _asking("Model scale", "How far the two points are apart, in metres", "Model scale", edits.set_world,
                     "distance", wrap=False), _EDITS + "set_world", "Model scale", words="size line up"),
    _command("model_to_scene", "Model into the scene",
             "Puts what is built into the scene as a mesh, in place of what was put there before.",
             _edit("Model into the scene", edits.model_to_scene), _EDITS + "model_to_scene", "Model into the scene",
             needs_parts, "mesh geometry"),
)

MODEL_FILES: tuple[Command, ...] = (
    Command("file.export_model", "Export model…",
            "Writes what is built on photographs as a mesh with UVs, and the photographs projected onto it.",
            lambda w: w.match.model.ask_export(), "app.photomodel_file.write_model", "file", enabled=needs_parts,
            icon="export", words="photomodel mesh texture obj usd gltf save"),
)
