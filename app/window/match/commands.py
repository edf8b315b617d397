"""Commands of matchmoving: following tracks, editing them, and how the plate is looked at."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from app.window.ask_text import ask_text
from app.window.commands import Command, Window
from core.document import Document
from core.errors import UserError
from core.match.follow import Way
from tools import line_up_edits, match_edits
from tools.match_edits import selected_tracks, shown_plate
from tools.plate_edits import show_next_plate
from tools.solve_edits import forget_solve, solved_of, tracks_to_solve, turn_cube

if TYPE_CHECKING:
    from app.window.desk import Desk

NO_PLATE = "There is no plate yet: open one from the File menu, or drop its folder on the window."
_TRACKING = "core.match.tracker.Tracking"
_VIEW = "core.image.plate_view.plate_camera"
FEATURES = 60


def needs_plate(desk: Desk) -> str | None:
    """A plate must be in view."""
    return None if shown_plate(desk.document) is not None else NO_PLATE


def needs_track(desk: Desk) -> str | None:
    """A track must be selected."""
    if shown_plate(desk.document) is None:
        return NO_PLATE
    return None if selected_tracks(desk.document) else "No track is selected: click one or place one."


def needs_two(desk: Desk) -> str | None:
    """Two tracks must be selected."""
    return None if len(selected_tracks(desk.document)) > 1 else "Select two tracks or more; Shift adds."


def needs_plates(desk: Desk) -> str | None:
    """Another plate must be there than that in view."""
    return None if len(desk.document.plates) > 1 else "There is no other plate: open one from the File menu."


def needs_tracks(desk: Desk) -> str | None:
    """The plate in view must have tracks."""
    plate = shown_plate(desk.document)
    if plate is None:
        return NO_PLATE
    return None if tracks_to_solve(desk.document, plate.id) else "This plate has no tracks yet: place some first."


def needs_solved_plate(desk: Desk) -> str | None:
    """The plate in view must have a solved camera."""
    plate = shown_plate(desk.document)
    if plate is None:
        return NO_PLATE
    return None if solved_of(desk.document, plate.id) is not None else "The camera is not solved yet: solve it first."


def needs_solve(desk: Desk) -> str | None:
    """A track must be selected, and the camera of its plate solved."""
    return needs_track(desk) or needs_solved_plate(desk)


def needs_two_solved(desk: Desk) -> str | None:
    """Two tracks must be selected, and the camera of their plate solved."""
    return needs_two(desk) or needs_solved_plate(desk)


def frame_of(desk: Desk) -> int:
    """The frame of the desk as the files of the plate in view count."""
    plate = shown_plate(desk.document)
    return round(desk.workspace.frame) - (0 if plate is None else plate.offset)


def chosen(desk: Desk) -> tuple[int, ...]:
    """Ids of the selected tracks."""
    return tuple(track.id for track in selected_tracks(desk.document))


def _plate_id(desk: Desk) -> int:
    plate = shown_plate(desk.document)
    return 0 if plate is None else plate.id


def _follow(way: Way, everything: bool = False) -> Callable[[Window], None]:
    return lambda window: window.match.tracking.track(way, everything=everything)


def _edit(
    step: str, function: Callable[..., Document], *, at_frame: bool = False, **told: Any
) -> Callable[[Window], None]:
    """A run that does an edit to the selected tracks, on the frame of the desk where that matters."""

    def run(window: Window) -> None:
        desk = window.desk
        desk.edit(step, function, chosen(desk), *((frame_of(desk),) if at_frame else ()), **told)

    return run


def _turn(step: str, field: str) -> Callable[[Window], None]:
    """A run that turns something of the selected tracks on, or off when all have it on."""

    def run(window: Window) -> None:
        tracks = selected_tracks(window.desk.document)
        on = not all(getattr(track, field) for track in tracks)
        window.desk.edit(step, match_edits.set_tracks, tuple(t.id for t in tracks), **{field: on})

    return run


def _show_all(window: Window) -> None:
    hidden = tuple(t.id for t in window.desk.document.tracks if t.hidden)
    window.desk.edit("Show all tracks", match_edits.set_tracks, hidden, hidden=False)


def _select(which: Callable[[Desk], tuple[int, ...]], step: str) -> Callable[[Window], None]:
    return lambda window: window.desk.edit(step, match_edits.select_tracks, which(window.desk))


def _all_ids(desk: Desk) -> tuple[int, ...]:
    plate = shown_plate(desk.document)
    return tuple(t.id for t in desk.document.tracks if plate is not None and t.plate_id == plate.id and not t.hidden)


def _go_to_key(direction: int) -> Callable[[Window], None]:
    def run(window: Window) -> None:
        desk, now = window.desk, frame_of(window.desk)
        keys = sorted({int(f) for t in selected_tracks(desk.document) for f in t.keys[:, 0]
                       if (int(f) - now) * direction > 0}, key=lambda f: abs(f - now))
        if keys:
            desk.set_workspace(frame=desk.workspace.frame + keys[0] - now)

    return run


def _nudge(x: float, y: float) -> Callable[[Window], None]:
    return _edit("Nudge", match_edits.nudge, at_frame=True, x=x, y=y)


def _still(window: Window) -> None:
    tracks, eye = selected_tracks(window.desk.document), window.match.eye
    eye.hold_still(None if eye.still is not None or not tracks else tracks[-1].id)


def _ask_distance(window: Window) -> None:
    tracks = chosen(window.desk)

    def measured(words: str) -> None:
        try:
            length = float(words.replace(",", "."))
        except ValueError:
            raise UserError(f"{words!r} is no length; give metres as a number, such as 1.8.") from None
        window.desk.edit("Set distance", line_up_edits.set_distance, tracks, length)

    ask_text(window, "Set distance", "How far the two tracks are apart, in metres",
             lambda words: window.desk.attempt(measured, words))


def _scene_over(window: Window, opacity: float) -> None:
    view = window.desk.workspace.view
    window.desk.set_workspace(view=view.replace(over_plate=0.0 if view.over_plate == opacity else opacity))


def _command(
    name: str, label: str, tooltip: str, run: Callable[[Window], object], twin: str, undo: str | None = None,
    enabled: Callable[[Desk], str | None] = needs_track, words: str = "", icon: str | None = None,
    repeats: bool = False,
) -> Command:
    return Command(
        f"match.{name}", label, tooltip, run, twin, "document" if undo else "workspace", undo, enabled,
        scope="match", words=f"track matchmove {words}", icon=icon, repeats=repeats)


def _edits(name: str) -> str:
    return f"tools.match_edits.{name}"


MATCH: tuple[Command, ...] = (
    _command("forward", "Track forward", "Follows the selected tracks from this frame to the end of the plate.",
             _follow("forward"), _TRACKING, "Track forward", words="follow pattern"),
    _command("backward", "Track backward", "Follows the selected tracks from this frame to the start of the plate.",
             _follow("backward"), _TRACKING, "Track backward", words="follow pattern"),
    _command("next", "Track one frame on", "Follows the selected tracks to the next frame and goes there.",
             _follow("next"), _TRACKING, "Track one frame on", words="step forward"),
    _command("previous", "Track one frame back", "Follows the selected tracks to the frame before and goes there.",
             _follow("previous"), _TRACKING, "Track one frame back", words="step backward"),
    _command("between", "Track between keys", "Follows the selected tracks between the keys about this frame.",
             _follow("between"), _TRACKING, "Track between keys", words="refine keys"),
    _command("both", "Track both ways", "Follows the selected tracks from all their keys through the whole plate.",
             _follow("both"), _TRACKING, "Track both ways", words="whole forward backward"),
    _command("all", "Track everything", "Follows all tracks that are not locked or hidden through the whole plate.",
             _follow("both", True), _TRACKING, "Track both ways", needs_plate, "whole all"),
    _command("features", "Automatic features", f"Finds {FEATURES} corners, well spread, and follows them.",
             lambda w: w.match.tracking.find(FEATURES), _TRACKING, "Automatic features", needs_plate, "auto detect"),
    _command("planes", "Track planes", "Follows every plane that is not locked or hidden through the whole plate.",
             lambda w: w.match.tracking.track_planes(), "core.match.plane_tracker.plane_steps", "Track planes",
             needs_plate, "corner pin planar"),
    _command("fill", "Fill gaps by flow", "Carries the selected tracks by optical flow where they are not seen.",
             lambda w: w.match.tracking.fill_gaps(), "core.match.fill.fill_gaps", "Fill gaps", words="occlusion"),
    _command("slow_motion", "Slow motion", "Makes the frames between frames by optical flow, for plates played slower.",
             lambda w: w.match.slow.make(), "core.match.retime.frame_between", enabled=needs_plate,
             words="retime speed interpolate preview"),
    _command("solve", "Solve camera", "Finds the camera of the plate and where the points are, from the tracks shown.",
             lambda w: w.match.solving.solve(), "core.match.solve.solve.solve", "Solve camera", needs_tracks,
             "matchmove 3d camera reconstruct calibrate"),
    _command("cube", "Cube at track", "Stands a test cube on the point of the track, or takes it away.",
             lambda w: w.desk.edit("Test cube", turn_cube, chosen(w.desk)[-1]), "tools.solve_edits.turn_cube",
             "Test cube", needs_solve, "test object box insert"),
    _command("scene", "Scene over the plate",
             "Shows meshes, hair and feathers of the document through the solved camera and lens; again hides them.",
             lambda w: _scene_over(w, 1.0), "core.match.through.through_lens", enabled=needs_solved_plate,
             words="overlay coat feathers model camera composite see through"),
    _command("half_scene", "Half see-through scene",
             "Shows the document's meshes, hair and feathers over the plate at half their opacity; again hides them.",
             lambda w: _scene_over(w, 0.5), "core.match.through.through_lens", enabled=needs_solved_plate,
             words="overlay transparent opacity composite"),
    _command("origin", "Origin at track", "Puts the origin of the solved world at the point of the active track.",
             lambda w: w.desk.edit("Set origin", line_up_edits.set_origin, chosen(w.desk)[-1]),
             "tools.line_up_edits.set_origin", "Set origin", needs_solve, "line up coordinate system zero"),
    _command("axis", "X axis along tracks", "Turns the solved world: x leads from the first track to the second.",
             _edit("Set axis", line_up_edits.set_axis), "tools.line_up_edits.set_axis", "Set axis", needs_two_solved,
             "line up coordinate system orient"),
    _command("ground", "Ground through tracks", "Levels the solved world at three selected tracks or more, y up.",
             _edit("Set ground", line_up_edits.set_ground), "tools.line_up_edits.set_ground", "Set ground",
             needs_two_solved, "line up coordinate system floor plane level"),
    _command("distance", "Distance between tracks…", "Scales the solved world so that two tracks are so far apart.",
             _ask_distance, "tools.line_up_edits.set_distance", "Set distance", needs_two_solved,
             "line up coordinate system scale size metres"),
    _command("forget_line_up", "Forget the line-up", "Leaves the solved world where it is, held by no track any more.",
             lambda w: w.desk.edit("Forget the line-up", line_up_edits.forget_line_up, _plate_id(w.desk)),
             "tools.line_up_edits.forget_line_up", "Forget the line-up", needs_solved_plate, "coordinate system free"),
    _command("forget_solve", "Forget the solve", "Takes the solved camera of the plate away; tracks stay.",
             lambda w: w.desk.edit("Forget the solve", forget_solve, _plate_id(w.desk)),
             "tools.solve_edits.forget_solve", "Forget the solve", needs_solved_plate, "camera remove"),
    _command("delete_shapes", "Delete all planes and masks here",
             "Takes all planes and masks seen here out; the list of them deletes single ones.",
             lambda w: w.desk.edit("Delete shapes", match_edits.delete_shapes, frame_of(w.desk)),
             _edits("delete_shapes"), "Delete shapes", needs_plate, "roto remove"),
    _command("key", "Key here", "Makes the place of the selected tracks on this frame a key, with a new pattern.",
             _edit("Key track", match_edits.key, at_frame=True), _edits("key"), "Key track", words="re-key pattern"),
    _command("remove_key", "Remove key", "Takes the key of the selected tracks on this frame away; the point stays.",
             _edit("Remove key", match_edits.remove_keys, at_frame=True), _edits("remove_keys"), "Remove key"),
    _command("clear_after", "Forget after here", "Takes away what the selected tracks have after this frame.",
             _edit("Forget after", match_edits.clear, at_frame=True, after=True), _edits("clear"), "Forget after",
             words="clear trim"),
    _command("clear_before", "Forget before here", "Takes away what the selected tracks have before this frame.",
             _edit("Forget before", match_edits.clear, at_frame=True, after=False), _edits("clear"), "Forget before",
             words="clear trim"),
    _command("split", "Split track", "Cuts the selected tracks in two before this frame.",
             _edit("Split track", match_edits.split, at_frame=True), _edits("split"), "Split track", words="cut"),
    _command("join", "Join tracks", "Makes one track of the selected ones, which follow one and the same point.",
             _edit("Join tracks", match_edits.join), _edits("join"), "Join tracks", needs_two, "merge"),
    _command("average", "Average tracks", "Adds a track of the mean of the selected ones, weighted by certainty.",
             _edit("Average tracks", match_edits.average), _edits("average"), "Average tracks", needs_two, "mean"),
    _command("smooth", "Smooth track", "Takes jitter out of the selected tracks over five frames; keys stay.",
             _edit("Smooth track", match_edits.smooth), _edits("smooth"), "Smooth track", words="filter jitter"),
    _command("delete", "Delete tracks", "Takes the selected tracks out of the document; undo brings them back.",
             _edit("Delete tracks", match_edits.delete_tracks), _edits("delete_tracks"), "Delete tracks",
             words="remove", icon="delete"),
    _command("lock", "Lock tracks", "Keeps every tool off the selected tracks, or lets tools at them again.",
             _turn("Lock tracks", "locked"), _edits("set_tracks"), "Lock tracks", words="unlock", icon="lock"),
    _command("hide", "Hide tracks", "Leaves the selected tracks out of view and exports, or back in.",
             _turn("Hide tracks", "hidden"), _edits("set_tracks"), "Hide tracks", words="disable enable",
             icon="eye-off"),
    _command("show_all", "Show all tracks", "Brings every hidden track back into view and exports.",
             _show_all, _edits("set_tracks"), "Show all tracks", needs_plate, "unhide enable", "eye"),
    _command("select_all", "Select all tracks", "Selects every track of the plate that is not hidden.",
             _select(_all_ids, "Select tracks"), _edits("select_tracks"), "Select tracks", needs_plate),
    _command("select_none", "Select no track", "Lets go of every selected track, so that nothing is selected.",
             _select(lambda desk: (), "Select tracks"), _edits("select_tracks"), "Select tracks", needs_track,
             "deselect"),
    _command("next_key", "To the next key", "Goes to the next frame on which a selected track has a key.",
             _go_to_key(1), "core.workspace.Workspace", words="jump"),
    _command("previous_key", "To the key before", "Goes to the frame before this that has a key of a selected track.",
             _go_to_key(-1), "core.workspace.Workspace", words="jump"),
    _command("nudge_left", "Nudge left", "Moves the selected tracks a tenth of a pixel to the left on this frame.",
             _nudge(-0.1, 0.0), _edits("nudge"), "Nudge", words="sub-pixel", repeats=True),
    _command("nudge_right", "Nudge right", "Moves the selected tracks a tenth of a pixel to the right on this frame.",
             _nudge(0.1, 0.0), _edits("nudge"), "Nudge", words="sub-pixel", repeats=True),
    _command("nudge_up", "Nudge up", "Moves the selected tracks a tenth of a pixel up on this frame.",
             _nudge(0.0, -0.1), _edits("nudge"), "Nudge", words="sub-pixel", repeats=True),
    _command("nudge_down", "Nudge down", "Moves the selected tracks a tenth of a pixel down on this frame.",
             _nudge(0.0, 0.1), _edits("nudge"), "Nudge", words="sub-pixel", repeats=True),
    _command("next_plate", "Next plate", "Brings the next plate of the document into view, the first after the last.",
             lambda w: w.desk.edit("Show plate", show_next_plate), "tools.plate_edits.show_next_plate", "Show plate",
             needs_plates, "switch witness camera show"),
    _command("still", "Hold still at track", "Holds the picture still at the active track, so that slips are seen.",
             _still, _VIEW, enabled=needs_plate, words="stabilise stabilize lock view"),
    _command("natural", "One to one", "Shows one pixel of the plate on one pixel of the screen.",
             lambda w: w.match.eye.natural(), _VIEW, enabled=needs_plate, words="zoom 100 percent"),
)

PLATE_FILES: tuple[Command, ...] = (
    Command("file.open_plate", "Open plate…", "Opens a sequence of frames or a movie to track; choose one frame.",
            lambda w: w.match.doors.ask_plate(), "tools.match_edits.add_plate", "document", undo="Open plate",
            icon="image", words="footage movie sequence background matchmove"),
    Command("file.import_tracks", "Import tracks…", "Adds tracks of 3DEqualizer, Nuke, PFTrack, Boujou, SynthEyes, "
            "mmSolver or JSON to the plate.", lambda w: w.match.doors.ask_import(), "tools.match_edits.add_tracks",
            "document", undo="Import tracks", enabled=needs_plate, icon="import", words="2d load points"),
    Command("file.export_tracks", "Export tracks…", "Writes the tracks of the plate; its suffix names the program.",
            lambda w: w.match.doors.ask_export(), "core.formats.track_file.write_tracks", "file", enabled=needs_plate,
            icon="export", words="2d save points nuke 3de blender"),
    Command("file.export_camera", "Export camera…", "Writes the solved camera; its suffix names the program.",
            lambda w: w.match.doors.ask_export_camera(), "core.formats.shot_file.write_shot", "file",
            enabled=needs_solved_plate, icon="export", words="3d save solve usd nuke maya blender colmap matchmove"),
    Command("file.export_lens_maps", "Export lens maps…", "Writes STMaps that take the bend of the solved lens out of "
            "the plate, and put it back.", lambda w: w.match.doors.ask_lens_maps(),
            "core.formats.stmap_file.write_stmap", "file", enabled=needs_solved_plate, icon="export",
            words="stmap undistort redistort exr distortion overscan"),
    Command("file.check_movie", "Movie of the solve…", "Writes the plate with points, ground, test cubes and "
            "the scene over it as a movie, to judge the solve by.", lambda w: w.match.doors.ask_check_movie(),
            "app.movie.write_movie", "file", enabled=needs_solved_plate, icon="playblast",
            words="qc quality overlay playblast mp4 matchmove check"),
)
