"""Commands of files, of undo and of macros."""

from __future__ import annotations

from typing import TYPE_CHECKING

from app.window.commands import Command

if TYPE_CHECKING:
    from app.window.desk import Desk


def _needs_mesh(desk: Desk) -> str | None:
    return None if desk.session.document.meshes else "There is no mesh yet: open or import one first."


def _needs_groom(desk: Desk) -> str | None:
    return None if desk.session.document.grooms else "There is no groom yet: import a mesh and groom it first."


def _can_save(desk: Desk) -> str | None:
    if desk.session.saved and desk.session.path is not None:
        return "Everything is in the file already."
    return None


def _can_undo(desk: Desk) -> str | None:
    return None if desk.session.history.undo_name else "There is nothing to undo."


def _can_redo(desk: Desk) -> str | None:
    return None if desk.session.history.redo_name else "There is nothing to redo."


def _recording(desk: Desk) -> str | None:
    return None if desk.session.recording is not None else "Nothing is recorded: begin with Record a macro."


def _not_recording(desk: Desk) -> str | None:
    return None if desk.session.recording is None else "A macro is being recorded: save or forget it first."


FILE: tuple[Command, ...] = (
    Command(
        "file.new", "New", "Begins an empty document; the present one stays in its file and in recovery.",
        lambda w: w.new_document(), "tools.session.Session", "file", icon="file-new", words="empty start clear"),
    Command(
        "file.open", "Open…", "Opens a project (.filo) or a mesh, chosen in a file window.",
        lambda w: w.open_file(), "tools.session.Session.open", "file", icon="file-open", words="load project"),
    Command(
        "file.open_recent", "Open recent…", "Lists the files you had open last; choose one to open it again.",
        lambda w: w.show_recent(), "tools.session.Session.open", "file", icon="recent", words="last history files"),
    Command(
        "file.demo_bird", "Open the demo bird", "Opens the bird of the demo without a feather, to be dressed by hand.",
        lambda w: w.open_bare_bird(), "core.demo.bird_document.bare_bird_document", "file",
        words="goldfinch finch feathers wing example"),
    Command(
        "file.save", "Save", "Saves the project to its file; the version before is kept beside it.",
        lambda w: w.save(), "tools.session.Session.save", "file", enabled=_can_save, icon="save", words="write store"),
    Command(
        "file.save_as", "Save as…", "Saves the project under a new name and goes on in that file.",
        lambda w: w.save_as(), "tools.session.Session.save", "file", icon="save", words="write rename"),
    Command(
        "file.save_copy", "Save a copy…", "Saves the project to another file while you go on in the present one.",
        lambda w: w.save_copy(), "core.formats.project.write_project", "file", words="backup duplicate version"),
    Command(
        "file.import_mesh", "Import mesh…",
        "Adds an animal or any mesh (OBJ, PLY, glTF, STL, USD, Alembic) to the document.",
        lambda w: w.import_mesh(), "tools.document_edits.import_mesh", "document", undo="Import mesh",
        icon="import", words="load model animal geometry add"),
    Command(
        "file.reload_mesh", "Reload mesh", "Reads the mesh file again and moves the groom onto its new shape.",
        lambda w: w.reload_mesh(), "tools.document_edits.reload_mesh", "document", undo="Reload mesh",
        enabled=_needs_mesh, icon="reload", words="update refresh geometry changed"),
    Command(
        "file.export_coat", "Export coat…", "Writes guides and hairs to USD, Alembic or .hair for a renderer.",
        lambda w: w.export_coat(), "core.formats.curve_file.write_groom", "file", enabled=_needs_groom,
        icon="export", words="write hair curves publish deliver"),
    Command(
        "file.screenshot", "Save a picture…", "Saves what the viewport shows now as a PNG of the same size.",
        lambda w: w.save_screenshot(), "viewport.picture.render_png", "file", icon="image",
        words="screenshot image render png"),
    Command(
        "file.playblast", "Playblast…", "Plays the frames once and saves them as numbered pictures or a movie.",
        lambda w: w.make_playblast(), "viewport.picture.render_png", "file", enabled=_needs_mesh, icon="playblast",
        words="movie video render animation sequence mp4"),
    Command(
        "file.quit", "Quit", "Leaves the program; work that was not saved can be recovered at the next start.",
        lambda w: w.close(), "tools.session.Session.close", "window", icon="quit", words="exit close leave"),
)

EDIT: tuple[Command, ...] = (
    Command(
        "edit.undo", "Undo", "Takes the last step back: a stroke, an import, a changed number.",
        lambda w: w.desk.session.undo(), "tools.session.Session.undo", "history", enabled=_can_undo, icon="undo",
        words="back revert", repeats=True),
    Command(
        "edit.redo", "Redo", "Brings back the step that was undone last, until something new is made.",
        lambda w: w.desk.session.redo(), "tools.session.Session.redo", "history", enabled=_can_redo, icon="redo",
        words="again forward repeat", repeats=True),
    Command(
        "edit.revert", "Undo everything", "Goes back to the first step that is remembered; redo leads forward again.",
        lambda w: w.desk.session.jump(0), "tools.session.Session.jump", "history", enabled=_can_undo,
        words="revert first beginning history"),
)

MACRO: tuple[Command, ...] = (
    Command(
        "macro.record", "Record a macro", "Notes every stroke, action and edit from now on, to do them again later.",
        lambda w: w.desk.session.record(), "tools.session.Session.record", "window", enabled=_not_recording,
        icon="record", words="script start repeat automate", checked=lambda desk: desk.session.recording is not None),
    Command(
        "macro.save", "Save the macro…", "Ends the recording and writes it as a Python script you can read.",
        lambda w: w.save_macro(), "tools.macro.Macro.save", "file", enabled=_recording, icon="save",
        words="script stop end recording"),
    Command(
        "macro.discard", "Forget the macro", "Ends the recording without keeping it; what was done stays done.",
        lambda w: w.desk.session.stop_recording(), "tools.session.Session.stop_recording", "window",
        enabled=_recording, icon="stop", words="script stop cancel recording"),
    Command(
        "macro.play", "Play a macro…", "Does again what a macro says; each of its strokes can be undone.",
        lambda w: w.play_macro(), "tools.macro.play", "history", icon="play", words="script run repeat batch"),
)
