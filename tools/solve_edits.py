"""Solving a plate of the document, and edits of what was solved. Pure functions: values in, values out."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from core.document import Document
from core.errors import UserError
from core.image.plate import Plate
from core.image.plate_view import plate_size
from core.match.line_up import as_before
from core.match.solved import Advice, SolvedCamera, SolveSettings, cube_edges, frozen
from core.match.track import Track


def tracks_to_solve(document: Document, plate_id: int) -> tuple[Track, ...]:
    """Tracks of a plate that are not hidden."""
    return tuple(t for t in document.tracks if t.plate_id == plate_id and not t.hidden and len(t.frames))


def solved_of(document: Document, plate_id: int) -> SolvedCamera | None:
    """The solved camera of a plate, or None."""
    return next((one for one in document.solves if one.plate_id == plate_id), None)


def solved_camera(
    plate: Plate, tracks: tuple[Track, ...], settings: SolveSettings,
    progress: Callable[[str], None] = lambda words: None,
) -> SolvedCamera:
    """Solve a plate from its tracks.

    Raises
    ------
    UserError
        There is no camera to be trusted; the message says why.
    """
    from core.match.solve.observed import observations_of
    from core.match.solve.report import helpful, report  # large; the start of the window does without
    from core.match.solve.shot import shot_of
    from core.match.solve.solution import Options
    from core.match.solve.solve import solve

    names = [track.name for track in tracks]
    observations, frames = observations_of(tracks)
    bent = settings.lens != "none"
    options = Options(
        settings.focal or None, settings.free_focal, settings.zoom, bent, settings.nodal,
        settings.lens if bent else "brown",
    )
    found = solve(observations, frames, len(tracks), plate_size(plate), options, progress)
    told = report(found, names, progress=progress)
    shot = shot_of(found, names)
    held, known = np.flatnonzero(found.held), np.flatnonzero(found.known)
    advice = [
        Advice(words=_fix_words(fix.kind, told.rms_px, fix.rms_px, names, frames, fix.row),
               track_id=tracks[fix.row].id if fix.kind == "track" else 0,
               frame=int(frames[fix.row]) if fix.kind == "frame" else None, without=fix.rms_px)
        for fix in helpful(told.fixes, told.by_frame, told.by_track)
    ]
    seen = np.bincount(observations.track, minlength=len(tracks))
    advice += [
        Advice(words=f"{names[row]} does not fit the camera and was left out", track_id=tracks[row].id)
        for row in np.flatnonzero(~found.held & (seen >= 2))[:20]
    ]
    return SolvedCamera(
        id=1, plate_id=plate.id, size=found.size, kind=told.kind, lens=frozen(shot.lens),
        frames=frozen(shot.frames, np.int32), rotation=frozen(shot.rotation), translation=frozen(shot.translation),
        focal=frozen(shot.focal), points=frozen(shot.points),
        track_ids=frozen([tracks[row].id for row in held], np.int32),
        errors=frozen(np.nan_to_num(told.by_track[held])), by_frame=frozen(np.nan_to_num(told.by_frame[known])),
        rms=told.rms_px, median=told.median_px, p95=told.p95_px, focal_sigma=told.focal_sigma_px,
        warnings=told.warnings, advice=tuple(advice), settings=settings,
        spread=frozen(np.nan_to_num(told.point_sigma[held])),
    )


def _fix_words(kind: str, now: float, then: float, names: list[str], frames: np.ndarray, row: int) -> str:
    what = f"Track {names[row]}" if kind == "track" else f"Frame {frames[row]}"
    return f"{what}: without it the rest falls from {now:.3f} to {then:.3f} px"


def put_solve(document: Document, solved: SolvedCamera) -> Document:
    """The document with a solved camera in place of that of the same plate; its world and test cubes stay."""
    before = solved_of(document, solved.plate_id)
    if before is None:
        fresh = max((one.id for one in document.solves), default=0) + 1
        changed: Document = document.replace(solves=(*document.solves, solved.replace(id=fresh)))
        return changed
    cubes = tuple(i for i in before.cubes if i in solved.track_ids)
    return replace_solve(document, as_before(solved, before).replace(id=before.id, cubes=cubes))


def replace_solve(document: Document, solved: SolvedCamera) -> Document:
    """The document with a solved camera in place of that of its id."""
    changed: Document = document.replace(
        solves=tuple(solved if one.id == solved.id else one for one in document.solves))
    return changed


def turn_cube(document: Document, track_id: int) -> Document:
    """The document with a test cube at the point of a track, or without the one there."""
    track = next((t for t in document.tracks if t.id == track_id), None)
    solved = None if track is None else solved_of(document, track.plate_id)
    if solved is None:
        raise UserError("There is no solved camera yet: solve it first.")
    cube_edges(solved, track_id)
    there = track_id in solved.cubes
    cubes = tuple(i for i in solved.cubes if i != track_id) if there else (*solved.cubes, track_id)
    return replace_solve(document, solved.replace(cubes=cubes))


def forget_solve(document: Document, plate_id: int) -> Document:
    """The document without the solved camera of a plate."""
    changed: Document = document.replace(solves=tuple(one for one in document.solves if one.plate_id != plate_id))
    return changed
