"""Commands of meshes and grooms: what the scene panel does, by name."""

from __future__ import annotations

from typing import TYPE_CHECKING

from app.window.commands import Command, Window
from tools.document_edits import add_empty_groom, remove_groom, set_groom_hidden, set_groom_locked, set_mesh_locked
from tools.scene import active_mesh

if TYPE_CHECKING:
    from app.window.desk import Desk


def _needs_mesh(desk: Desk) -> str | None:
    return None if desk.session.document.meshes else "There is no mesh yet: open or import one first."


def _needs_groom(desk: Desk) -> str | None:
    return None if desk.groom is not None else "There is no groom yet: add one to a mesh first."


def _add_groom(window: Window) -> None:
    desk = window.desk
    mesh = active_mesh(desk.document, desk.workspace)
    if mesh is not None and desk.edit("Add groom", add_empty_groom, mesh.id):
        desk.set_workspace(groom=desk.document.grooms[-1].id)


def _remove_groom(window: Window) -> None:
    groom = window.desk.groom
    if groom is not None and window.desk.edit("Remove groom", remove_groom, groom.id):
        window.desk.set_workspace(groom=None)


def _lock(window: Window) -> None:
    mesh = active_mesh(window.desk.document, window.desk.workspace)
    if mesh is not None:
        window.desk.edit("Lock", set_mesh_locked, mesh.id, not mesh.locked)


def _is_locked(desk: Desk) -> bool:
    mesh = active_mesh(desk.document, desk.workspace)
    return mesh is not None and mesh.locked


def _hide_groom(window: Window) -> None:
    groom = window.desk.groom
    if groom is not None:
        window.desk.edit("Show groom" if groom.hidden else "Hide groom", set_groom_hidden, groom.id, not groom.hidden)


def _lock_groom(window: Window) -> None:
    groom = window.desk.groom
    if groom is not None:
        step = "Unlock groom" if groom.locked else "Lock groom"
        window.desk.edit(step, set_groom_locked, groom.id, not groom.locked)


def _is_groom_hidden(desk: Desk) -> bool:
    return desk.groom is not None and desk.groom.hidden


def _is_groom_locked(desk: Desk) -> bool:
    return desk.groom is not None and desk.groom.locked


SCENE: tuple[Command, ...] = (
    Command(
        "scene.add_groom", "Add a groom", "Adds an empty groom to the active mesh, to plant guides in it.",
        _add_groom, "tools.document_edits.add_empty_groom", "document", "Add groom", _needs_mesh, icon="plus",
        words="new coat hair fur create"),
    Command(
        "scene.remove_groom", "Remove the groom", "Takes the active groom with all its guides out of the scene.",
        _remove_groom, "tools.document_edits.remove_groom", "document", "Remove groom", _needs_groom, icon="minus",
        words="delete coat hair fur"),
    Command(
        "scene.lock", "Lock the mesh", "Keeps every tool off the active mesh and its grooms until it is unlocked.",
        _lock, "tools.document_edits.set_mesh_locked", "document", "Lock", _needs_mesh, _is_locked, "lock",
        words="unlock protect"),
    Command(
        "scene.hide_groom", "Hide the groom", "Leaves the active groom out of the view and exports; again shows it.",
        _hide_groom, "tools.document_edits.set_groom_hidden", "document", "Hide groom", _needs_groom,
        _is_groom_hidden, "eye-off", words="show coat hair fur invisible"),
    Command(
        "scene.lock_groom", "Lock the groom", "Keeps every tool and action off the active groom until it is unlocked.",
        _lock_groom, "tools.document_edits.set_groom_locked", "document", "Lock groom", _needs_groom,
        _is_groom_locked, "lock", words="unlock coat hair fur protect"),
)
