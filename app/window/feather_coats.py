"""What the window does to coats of feathers. Their edits come with kernels, so they are loaded when first asked for."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import QObject
from PySide6.QtWidgets import QWidget

from app.window.ask_text import ask_text
from app.window.commands import Command, Window
from app.window.desk import Desk
from app.window.jobs import Asked, Progress
from app.window.window_commands import shown_panels
from core.document import MeshObject, feathers_of, find_mesh
from core.errors import UserError
from core.evaluator import Evaluator
from core.feather.coat.coat import FeatherCoat
from core.feather.presets import bird_names, load_bird
from tools.scene import active_mesh

if TYPE_CHECKING:
    from app.feather_frames import Figures, Form
    from core.feather.coat.dress import Dressed

FEATHERS = 4_000  # of a first coat
MOST_CROSSINGS = 200  # that are looked at, the worst


def dress_with_feathers(desk: Desk, item: MeshObject, bird: str, owner: QObject | None = None) -> None:
    """Lay a first coat of a bird's feathers on a mesh, with keys to comb, beside the window."""
    evaluator = desk.session.evaluator

    def work(progress: Progress, cancelled: Asked) -> Dressed:
        import tools.feather_edits  # noqa: F401 - with its kernels, so that the window need not wait for them
        from core.feather.coat.dress import dress_feathers

        return dress_feathers(item.mesh, evaluator, FEATHERS, bird, mesh_id=item.id, rig=item.rig)

    def put(dressed: Dressed) -> None:
        from tools.feather_edits import with_dressed

        if all(other.mesh is not item.mesh for other in desk.document.meshes):
            raise UserError(f"The mesh {item.name} was changed meanwhile; dress it again.")
        if desk.edit("Dress with feathers", with_dressed, dressed):
            desk.set_workspace(groom=desk.document.grooms[-1].id)

    desk.jobs.start(f"Dress {item.name} with feathers", work, put, owner=owner)


def _dress(window: Window) -> None:
    mesh = active_mesh(window.desk.document, window.desk.workspace)
    if mesh is not None:
        dress_with_feathers(window.desk, mesh, bird_names()[0])


def _hide(window: Window) -> None:
    from tools.feather_edits import set_feathers

    coat = feathers_of(window.desk.document, window.desk.groom)
    if coat is not None:
        step = "Show feathers" if coat.hidden else "Hide feathers"
        window.desk.edit(step, set_feathers, coat.id, hidden=not coat.hidden)


def _remove(window: Window) -> None:
    from tools.feather_edits import remove_feathers

    coat = feathers_of(window.desk.document, window.desk.groom)
    if coat is not None:
        window.desk.edit("Remove feathers", remove_feathers, coat.id)


def _add_wings(window: Window) -> None:
    from tools.wing_edits import add_wings

    coat = feathers_of(window.desk.document, window.desk.groom)
    if coat is not None:
        window.desk.edit("Feathers of the wings", add_wings, coat.id)


def _remove_wings(window: Window) -> None:
    from tools.wing_edits import remove_wings

    coat = feathers_of(window.desk.document, window.desk.groom)
    if coat is not None:
        window.desk.edit("Remove the wings", remove_wings, coat.id)


def _draw_tract(window: Window) -> None:
    from tools.feather_edits import tract_of_keys

    desk = window.desk
    coat, groom = feathers_of(desk.document, desk.groom), desk.groom
    if coat is None or groom is None:
        return
    keys = groom.guides.ids[groom.guides.selected].tolist()
    parts = ", ".join(name for name in load_bird(coat.preset).feathers if name != "body")
    ask_text(
        window, "Tract along the selected keys", f"Its name. {parts} wear feathers of their own:",
        lambda name: desk.edit("Tract along keys", tract_of_keys, coat.id, keys, name.strip() or "tract"))


def _remove_tract(window: Window) -> None:
    from tools.feather_edits import remove_tract

    coat = feathers_of(window.desk.document, window.desk.groom)
    if coat is not None and coat.tracts:
        window.desk.edit("Remove tract", remove_tract, coat.id, coat.tracts[-1].name)


def _give_back(window: Window) -> None:
    from tools.feather_edits import demote_all

    desk = window.desk
    coat = _coat(desk)
    if coat is not None:
        desk.edit("Give feathers back", demote_all, coat.id)


def _remove_flow(window: Window) -> None:
    from tools.feather_edits import remove_strokes

    desk = window.desk
    coat = _coat(desk)
    if coat is not None:
        desk.edit("Remove direction", remove_strokes, coat.id)


def _next_crossing(window: Window) -> None:
    desk = window.desk
    coat = _coat(desk)
    lying = None if coat is None else desk.session.plumages.last(coat.id)
    if lying is None or not len(lying.left.first):
        desk.said.emit("No feathers cross." if lying is not None else "The feathers are still being laid.")
        return
    frames = lying.laid.feathers.frames
    pairs = np.stack([lying.left.first, lying.left.second], axis=1)
    cameras = [window.view_of(lying.laid.layered.vanes[pair], frames[pair[0], 2]) for pair in pairs[:MOST_CROSSINGS]]
    now = desk.workspace.cameras[0].world_from_camera if desk.workspace.cameras else None
    at = next((k for k, camera in enumerate(cameras) if np.array_equal(camera.world_from_camera, now)), -1)
    number = (at + 1) % len(cameras)
    window.look(cameras[number])
    first, second = lying.laid.ids[pairs[number]]
    desk.said.emit(
        f"Crossing {number + 1} of {len(pairs):,}: feathers {first} and {second}. The Shaft tool moves them.")


def _draw_direction(window: Window) -> None:
    from tools.feather_edits import strokes_of_keys

    desk = window.desk
    coat, groom = feathers_of(desk.document, desk.groom), desk.groom
    if coat is not None and groom is not None:
        keys = groom.guides.ids[groom.guides.selected].tolist()
        desk.edit("Direction along keys", strokes_of_keys, coat.id, keys)


def _edit_feather(window: Window) -> None:
    if "feather" not in shown_panels(window.desk.workspace.panels):
        window.toggle_panel("feather")


def _coat(desk: Desk) -> FeatherCoat | None:
    """The coat whose keys are at hand, or the only one there is."""
    coats = desk.document.feathers
    coat = feathers_of(desk.document, desk.groom)
    return coats[0] if coat is None and len(coats) == 1 else coat


def _needs_mesh(desk: Desk) -> str | None:
    return None if desk.session.document.meshes else "There is no mesh yet: open or import one first."


def _needs_feathers(desk: Desk) -> str | None:
    if feathers_of(desk.document, desk.groom) is not None:
        return None
    return "No feathers are chosen: dress a mesh with feathers, or choose their keys in the scene."


def _needs_taken(desk: Desk) -> str | None:
    coat = _coat(desk)
    return None if coat is not None and coat.proxies else "No feather was taken over by hand: the Shaft tool does it."


def _needs_strokes(desk: Desk) -> str | None:
    coat = _coat(desk)
    return None if coat is not None and coat.strokes else "Nothing was drawn: the Flow tool does it."


def _needs_selected(desk: Desk) -> str | None:
    if (why := _needs_feathers(desk)) is not None:
        return why
    chosen = desk.groom is not None and bool(desk.groom.guides.selected.any())
    return None if chosen else "No keys are selected: choose some with the select tool or the lasso."


def _needs_tract(desk: Desk) -> str | None:
    coat = feathers_of(desk.document, desk.groom)
    return None if coat is not None and coat.tracts else "There is no tract: draw one along selected keys first."


def _needs_rig(desk: Desk) -> str | None:
    coat = feathers_of(desk.document, desk.groom)
    if coat is None:
        return _needs_feathers(desk)
    if find_mesh(desk.document, coat.mesh_id).rig is not None:
        return None
    return "The mesh has no rig: wings stand on joints called humerus, forearm and hand."


def _needs_wings(desk: Desk) -> str | None:
    coat = feathers_of(desk.document, desk.groom)
    return None if coat is not None and coat.wings else "These feathers have no wings."


def _are_hidden(desk: Desk) -> bool:
    coat = feathers_of(desk.document, desk.groom)
    return coat is not None and coat.hidden


def _export(form: Form) -> Callable[[Window], None]:
    """What asks for a file and writes the coat at hand to it, as it lies at the frame that is shown."""
    def run(window: Window) -> None:
        from app.window.files.opening import choose_file, filter_of

        desk = window.desk
        choose_file(
            window if isinstance(window, QWidget) else None, "Export feathers",
            [filter_of("OpenUSD", (".usdc", ".usda", ".usd"))],
            lambda path: desk.attempt(lambda path: export_feathers(desk, path, form), path), ".usdc")

    return run


def export_feathers(desk: Desk, path: Path, form: Form) -> None:
    """Write the coat whose keys are at hand beside the window, as it lies at the frame that is shown."""
    coat, document, frame = _coat(desk), desk.session.history.current, float(desk.workspace.frame)
    if coat is None:
        raise UserError(_needs_feathers(desk) or "There are no feathers.")

    def write(progress: Progress, cancelled: Asked) -> Figures:
        from app.feather_frames import write_coat  # with every kernel of a coat

        evaluator = Evaluator()
        try:
            return write_coat(path, document, coat, form, evaluator, frame)
        finally:
            evaluator.close()

    def tell(found: Figures) -> None:
        left = found["crossings"]
        desk.said.emit(f"{found['feathers']:,} feathers are in {path}; {left} of their pairs cross.")

    desk.jobs.start(f"Write {path.name}", write, tell)


def _export_command(name: str, form: Form, label: str, what: str, words: str) -> Command:
    return Command(
        f"feathers.{name}", label, f"Writes the feathers at the frame that is shown to OpenUSD: {what}.",
        _export(form), "app.feather_frames.write_coat", "file", None, _needs_feathers, icon="export",
        words=f"write save usd bird plumage renderer {words}")


EXPORTS: tuple[Command, ...] = (
    _export_command("export", "instances", "Export feathers…", "instances of shapes, with materials and ids", "points"),
    _export_command("export_meshes", "meshes", "Export feathers as meshes…", "every feather in its own shape", "mesh"),
    _export_command("export_nurbs", "nurbs", "Export feathers as NURBS…", "a patch for every vane", "patches surfaces"),
    _export_command("export_shafts", "shafts", "Export shafts as curves…", "curves of all shafts, with widths", "hair"),
    _export_command("export_barbs", "barbs", "Export barbs as curves…", "curves of all shafts and all barbs", "hair"),
    _export_command(
        "export_condensed", "condensed", "Export condensed feathers…", "shafts that carry arrays of barbs", "Houdini"),
)
FEATHER_COATS: tuple[Command, ...] = (
    *EXPORTS,
    Command(
        "feathers.dress", "Dress with feathers",
        "Lays a first coat of feathers on the active mesh, with keys that you comb like guides.",
        _dress, "tools.feather_edits.add_feathers", "document", "Dress with feathers", _needs_mesh,
        icon="plus", words="bird plumage coat wing new create"),
    Command(
        "feathers.hide", "Hide the feathers",
        "Leaves the feathers of the active keys out of the view and exports; again shows them.",
        _hide, "tools.feather_edits.set_feathers", "document", "Hide feathers", _needs_feathers,
        _are_hidden, "eye-off", words="show bird plumage invisible"),
    Command(
        "feathers.remove", "Remove the feathers",
        "Takes the feathers off the active mesh and leaves the groom of their keys.",
        _remove, "tools.feather_edits.remove_feathers", "document", "Remove feathers", _needs_feathers,
        icon="minus", words="delete bird plumage coat"),
    Command(
        "feathers.edit", "Edit the feather",
        "Opens the editor of one feather beside the coat: outline, dials and every attribute.",
        _edit_feather, "tools.feather_edits.set_attributes", enabled=_needs_feathers,
        icon="feather", words="editor attributes shape outline barbs dials"),
    Command(
        "feathers.wings", "Feathers of the wings",
        "Gives a rig quills, coverts and tail feathers on its joints called humerus, forearm, hand and tail.",
        _add_wings, "tools.wing_edits.add_wings", "document", "Feathers of the wings", _needs_rig,
        words="primaries secondaries tertials coverts remiges rectrices tail bird fold flight"),
    Command(
        "feathers.remove_wings", "Remove the feathers of the wings",
        "Takes the feathers of wings and tail away and leaves those of the skin as they are.",
        _remove_wings, "tools.wing_edits.remove_wings", "document", "Remove the wings", _needs_wings,
        words="delete primaries coverts tail flight"),
    Command(
        "feathers.tract", "Tract along selected keys",
        "Makes a band of skin from selected key to key, which placements may keep to.",
        _draw_tract, "tools.feather_edits.tract_of_keys", "document", "Tract along keys", _needs_selected,
        words="pteryla band region wing tail back part"),
    Command(
        "feathers.remove_tract", "Remove the last tract",
        "Takes the last drawn tract away; feathers that kept to it are set everywhere.",
        _remove_tract, "tools.feather_edits.remove_tract", "document", "Remove tract", _needs_tract,
        words="delete pteryla band region"),
    Command(
        "feathers.direction", "Direction along selected keys",
        "Lets all feathers follow strokes along the selected keys, instead of every single key.",
        _draw_direction, "tools.feather_edits.strokes_of_keys", "document", "Direction along keys", _needs_selected,
        words="orientation stroke flow comb"),
    Command(
        "feathers.remove_direction", "Remove the direction strokes",
        "Takes all direction strokes away; feathers lie along their keys again, or with the flow of the body.",
        _remove_flow, "tools.feather_edits.remove_strokes", "document", "Remove direction", _needs_strokes,
        words="orientation flow comb clear"),
    Command(
        "feathers.give_back", "Give all feathers back",
        "Makes every feather that was taken over by hand procedural again, as its keys lay it.",
        _give_back, "tools.feather_edits.demote_all", "document", "Give feathers back", _needs_taken,
        words="proxy demote hand animated release"),
    Command(
        "feathers.next_crossing", "Look at the next crossing",
        "Turns the view to the next pair of feathers that still pass through each other, the worst first.",
        _next_crossing, "core.feather.coat.layering.crossings", "workspace", None, _needs_feathers,
        words="intersection penetration worst report layering"),
)
