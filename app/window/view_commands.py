"""Commands of the view and of time."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from app.window.commands import Command, Window, is_on, switch
from tools.document_edits import set_document, set_mesh_hidden
from tools.scene import active_mesh, anything_hidden, ghosted, isolated, show_all, stored_bookmark

if TYPE_CHECKING:
    from app.window.desk import Desk

DENSER = 1.5
SHADING_WORDS = {
    "shaded": ("Shaded", "Shows meshes lit from the camera's side, the usual way to groom."),
    "matcap": ("Clay", "Shows meshes like clay in a studio, to judge form; again goes back."),
    "wire": ("Wireframe", "Shows only the edges of meshes, to see through them; again goes back."),
    "lines": ("Flat with lines", "Shows meshes in one flat colour with their edges; again goes back."),
}
SIDES = {
    "front": "Looks at the animal from the front, straight along its own axis.",
    "back": "Looks at the animal from behind, straight along its own axis.",
    "left": "Looks at the left side of the animal, straight along its own axis.",
    "right": "Looks at the right side of the animal, straight along its own axis.",
    "top": "Looks down at the animal from straight above its back.",
    "bottom": "Looks up at the animal from straight below its belly.",
}
_TURNED = "core.navigate.turned_to"
_OPTIONS = "core.workspace.ViewOptions"
_WORKSPACE = "core.workspace.Workspace"


def _needs_something(desk: Desk) -> str | None:
    mesh = active_mesh(desk.session.document, desk.session.workspace)
    return None if mesh is not None else "There is nothing in the scene yet: open or import a mesh first."


def _needs_hidden(desk: Desk) -> str | None:
    hidden = anything_hidden(desk.session.document)
    view = desk.session.workspace.view
    return None if hidden or view.isolated or view.ghosted else "Nothing is hidden."


def _needs_view(desk: Desk) -> str | None:
    return None if desk.session.workspace.cameras else "There is no view to keep yet: open or import a mesh first."


def _look_from(side: str) -> Callable[[Window], None]:
    return lambda window: window.look_from(side)


def _shade(shading: str) -> Callable[[Window], None]:
    def run(window: Window) -> None:
        view = window.desk.session.workspace.view
        window.desk.set_workspace(view=view.replace(shading="shaded" if view.shading == shading else shading))

    return run


def _shades(shading: str) -> Callable[[Desk], bool]:
    return lambda desk: desk.session.workspace.view.shading == shading


def _store(name: str) -> Callable[[Window], None]:
    def run(window: Window) -> None:
        stored = stored_bookmark(window.desk.session.workspace, name)
        window.desk.set_workspace(bookmarks=stored.bookmarks)
        window.desk.said.emit(f"View {name} is kept.")

    return run


def _recall(name: str) -> Callable[[Window], None]:
    return lambda window: window.look(window.desk.session.workspace.bookmarks[name])


def _is_stored(name: str) -> Callable[[Desk], str | None]:
    def enabled(desk: Desk) -> str | None:
        return None if name in desk.session.workspace.bookmarks else f"No view is kept under {name} yet."

    return enabled


def _isolate(window: Window) -> None:
    session = window.desk.session
    window.desk.set_workspace(view=isolated(session.document, session.workspace).view)


def _ghost(window: Window) -> None:
    session = window.desk.session
    window.desk.set_workspace(view=ghosted(session.document, session.workspace).view)


def _is_ghosted(desk: Desk) -> bool:
    mesh = active_mesh(desk.session.document, desk.session.workspace)
    return mesh is not None and mesh.id in desk.session.workspace.view.ghosted


def _hide(window: Window) -> None:
    mesh = active_mesh(window.desk.session.document, window.desk.session.workspace)
    if mesh is not None:
        window.desk.edit("Hide", set_mesh_hidden, mesh.id, True)


def _unhide(window: Window) -> None:
    window.desk.edit("Show all", show_all)
    view = window.desk.session.workspace.view
    window.desk.set_workspace(view=view.replace(isolated=(), ghosted=()))


def _has_gate(desk: Desk) -> bool:
    view = desk.session.workspace.view
    return view.gate is not None and view.gate_shown


def _no_background(window: Window) -> None:
    window.desk.set_workspace(view=window.desk.session.workspace.view.replace(background=None, references=()))


def _has_images(desk: Desk) -> str | None:
    view = desk.session.workspace.view
    return None if view.background or view.references else "There are no pictures in the view."


def _step(frames: int) -> Callable[[Window], None]:
    def run(window: Window) -> None:
        document, frame = window.desk.session.document, round(window.desk.session.workspace.frame) + frames
        window.desk.set_workspace(frame=float(min(max(frame, document.first_frame), document.last_frame)))

    return run


VIEW: tuple[Command, ...] = (
    Command(
        "view.frame_all", "Frame all", "Moves the camera so that everything shown fits the view.",
        lambda w: w.frame_all(), "core.navigate.frame", icon="frame-all", scope="viewport",
        words="home fit zoom everything"),
    Command(
        "view.frame_selected", "Frame selected", "Moves the camera so that the selected guides fill the view.",
        lambda w: w.frame_selected(), "core.navigate.frame", icon="frame-selected", scope="viewport",
        words="focus fit zoom"),
    *(
        Command(
            f"view.{side}", f"{side.capitalize()} view", tooltip, _look_from(side), _TURNED, scope="viewport",
            icon="view", words="camera look from")
        for side, tooltip in SIDES.items()
    ),
    Command(
        "view.three_quarter", "Three-quarter view", "Looks at the animal from the front, a little aside and above.",
        _look_from("three-quarter"), _TURNED, scope="viewport", icon="view", words="camera look perspective home"),
    Command(
        "view.projection", "Perspective / orthographic",
        "Switches between a lens and parallel lines; what you look at keeps its size.",
        lambda w: w.toggle_projection(), "core.navigate.with_projection", scope="viewport", icon="perspective",
        words="ortho parallel lens",
        checked=lambda desk: bool(desk.session.workspace.cameras) and desk.session.workspace.cameras[0].orthographic),
    Command(
        "view.camera_from_file", "Camera from a file…",
        "Looks through a camera of USD, Alembic or glTF at this frame; all of its picture is seen.",
        lambda w: w.camera_from_file(), "core.formats.camera_file.read_cameras", enabled=_needs_something,
        icon="camera", words="shot match import lens layout"),
    Command(
        "view.gate", "Film gate",
        "Darkens what the film camera does not take and gives playblasts its shape; without a camera's own it is 16:9.",
        lambda w: w.toggle_gate(), "core.gate.gate_of", enabled=_needs_view, checked=_has_gate, scope="viewport",
        words="camera frame mask aspect letterbox resolution"),
    Command(
        "view.safe_areas", "Safe areas", "Draws where action and titles are safe on every screen inside the film gate.",
        switch("safe_areas"), _OPTIONS, checked=is_on("safe_areas"), scope="viewport",
        words="title action gate camera"),
    *(
        Command(
            f"view.store_{n}", f"Keep view {n}", f"Keeps how you look now as view {n}, saved with the project.",
            _store(str(n)), "tools.scene.stored_bookmark", enabled=_needs_view, scope="viewport",
            icon="bookmark", words="bookmark camera store")
        for n in range(1, 10)
    ),
    *(
        Command(
            f"view.recall_{n}", f"Go to view {n}", f"Looks again the way you did when you kept view {n}.",
            _recall(str(n)), _WORKSPACE, enabled=_is_stored(str(n)), scope="viewport", words="bookmark camera recall")
        for n in range(1, 10)
    ),
    *(
        Command(
            f"view.{name}", label, tooltip, _shade(name), _OPTIONS, checked=_shades(name), scope="viewport",
            icon=None if name == "lines" else name, words="shading display mode")
        for name, (label, tooltip) in SHADING_WORDS.items()
    ),
    Command(
        "view.wire_overlay", "Wire overlay", "Draws the edges of meshes over their surface, to see the layout.",
        switch("wire"), _OPTIONS, checked=is_on("wire"), scope="viewport", icon="wire", words="edges wireframe lines"),
    Command(
        "view.grid", "Grid", "Draws the ground at height 0; one square is one metre or a tenth.",
        switch("grid"), _OPTIONS, checked=is_on("grid"), scope="viewport", icon="grid", words="floor ground"),
    Command(
        "view.axes", "Axes", "Draws where X, Y and Z point in the corner of the view.",
        switch("axes"), _OPTIONS, checked=is_on("axes"), scope="viewport", icon="axes", words="orientation gizmo"),
    Command(
        "view.hud", "Figures in the view", "Writes tool, counts and milliseconds into the corner of the picture.",
        switch("hud"), _OPTIONS, checked=is_on("hud"), scope="viewport", icon="hud",
        words="hud statistics stats counts"),
    Command(
        "view.hair", "Hair", "Shows the hairs of the coat; off shows the bare skin, which is faster.",
        switch("hair"), _OPTIONS, checked=is_on("hair"), icon="hair", scope="viewport", words="children fur coat"),
    Command(
        "view.guides", "Guides", "Shows the guides that tools shape, coloured by what state they are in.",
        switch("guides"), _OPTIONS, checked=is_on("guides"), icon="guides", scope="viewport", words="curves show"),
    Command(
        "view.isolate", "Isolate", "Shows only the active mesh with its grooms; again shows everything.",
        _isolate, "tools.scene.isolated", enabled=_needs_something, scope="viewport", icon="isolate",
        checked=lambda desk: bool(desk.session.workspace.view.isolated), words="solo local view alone"),
    Command(
        "view.ghost", "Ghost", "Shows the active mesh translucent, so that you see what lies behind.",
        _ghost, "tools.scene.ghosted", enabled=_needs_something, checked=_is_ghosted, scope="viewport",
        icon="ghost", words="xray x-ray transparent"),
    Command(
        "view.hide", "Hide", "Hides the active mesh and its grooms, in the project too.",
        _hide, "tools.document_edits.set_mesh_hidden", "document", undo="Hide", enabled=_needs_something,
        scope="viewport", icon="eye-off", words="invisible"),
    Command(
        "view.unhide_all", "Show all", "Shows every hidden, isolated or ghosted mesh and groom the way it was.",
        _unhide, "tools.scene.show_all", "document", undo="Show all", enabled=_needs_hidden, scope="viewport",
        icon="eye", words="unhide reveal visible"),
    Command(
        "view.background", "Background image…", "Puts a picture behind everything in the view, fitted to its height.",
        lambda w: w.choose_background(), _OPTIONS, icon="image", words="plate photo image"),
    Command(
        "view.pin_reference", "Pin a reference…", "Pins a picture to the view that stays put while you turn.",
        lambda w: w.pin_reference(), "core.workspace.Reference", icon="image", words="image photo picture"),
    Command(
        "view.pictures", "Pictures in the view…",
        "Moves, sizes and fades pinned references by numbers, or takes single ones out.",
        lambda w: w.show_pictures(), "core.workspace.Reference", "window", icon="image",
        words="image photo reference background opacity place"),
    Command(
        "view.no_pictures", "Remove pictures", "Takes the background and every pinned reference out of the view.",
        _no_background, _OPTIONS, enabled=_has_images, words="background reference clear image"),
    Command(
        "view.denser", "More hair while working", "Draws half as many hairs more while your hand moves.",
        lambda w: w.scale_density(DENSER), "viewport.density.DensityController", scope="viewport",
        words="density up quality"),
    Command(
        "view.sparser", "Less hair while working", "Draws a third fewer hairs while your hand moves, for speed.",
        lambda w: w.scale_density(1.0 / DENSER), "viewport.density.DensityController", scope="viewport",
        words="density down faster"),
)

def _begin_here(window: Window) -> None:
    document, frame = window.desk.session.document, round(window.desk.session.workspace.frame)
    window.desk.edit("Frame range", set_document, first_frame=frame, last_frame=max(frame, document.last_frame))


def _end_here(window: Window) -> None:
    document, frame = window.desk.session.document, round(window.desk.session.workspace.frame)
    window.desk.edit("Frame range", set_document, first_frame=min(frame, document.first_frame), last_frame=frame)


def _needs_frames(desk: Desk) -> str | None:
    return None if desk.session.document.plates else _needs_something(desk)


FRAME: tuple[Command, ...] = (
    Command(
        "frame.play", "Play / pause", "Plays the frames of the timeline in a loop, at the project's rate.",
        lambda w: w.toggle_playback(), _WORKSPACE, "window", enabled=_needs_frames, icon="play", scope="viewport",
        words="animation stop start"),
    Command(
        "frame.next", "Next frame", "Goes one frame on, at most to the last of the timeline.",
        _step(1), _WORKSPACE, icon="next", scope="viewport", repeats=True, words="step forward time"),
    Command(
        "frame.previous", "Previous frame", "Goes one frame back, at most to the first of the timeline.",
        _step(-1), _WORKSPACE, icon="previous", scope="viewport", repeats=True, words="step back time"),
    Command(
        "frame.first", "First frame", "Goes to the first frame of the timeline, where playback begins.",
        lambda w: w.desk.set_workspace(frame=float(w.desk.session.document.first_frame)), _WORKSPACE, icon="first",
        scope="viewport", words="start beginning time"),
    Command(
        "frame.last", "Last frame", "Goes to the last frame of the timeline, where playback ends.",
        lambda w: w.desk.set_workspace(frame=float(w.desk.session.document.last_frame)), _WORKSPACE, icon="last",
        scope="viewport", words="end time"),
    Command(
        "frame.begin_here", "Begin the range here", "Makes this frame the first one that the timeline plays.",
        _begin_here, "tools.document_edits.set_document", "document", "Frame range", icon="first", scope="viewport",
        words="in point start playback crop"),
    Command(
        "frame.end_here", "End the range here", "Makes this frame the last one that the timeline plays.",
        _end_here, "tools.document_edits.set_document", "document", "Frame range", icon="last", scope="viewport",
        words="out point stop playback crop"),
)
