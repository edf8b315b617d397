"""Lining a solved camera up with the world by its tracks: origin, axis, ground, distance. Values in, values out."""

from __future__ import annotations

from typing import Any

from core.document import Document
from core.errors import UserError
from core.match.line_up import lined_up
from core.match.solved import LineUp
from tools.solve_edits import replace_solve, solved_of

SHORTEST, LONGEST = 1e-9, 1e9  # metres


def set_origin(document: Document, track_id: int) -> Document:
    """The document with the point of a track at the origin of its solved world."""
    return _said(document, (track_id,), origin=track_id)


def set_axis(document: Document, tracks: tuple[int, ...]) -> Document:
    """The document with the way from the first of two tracks to the second along +x; level, where a ground is set."""
    _count(tracks, 2, 2, "The axis needs two tracks: select where it begins, then where it leads.")
    return _said(document, tracks, axis=tracks)


def set_ground(document: Document, tracks: tuple[int, ...]) -> Document:
    """The document with the plane of three tracks or more level, the cameras above it."""
    _count(tracks, 3, None, "The ground needs three tracks or more that are not on one line.")
    if not _solved(document, tracks).line_up.origin:
        return _said(document, tracks, ground=tracks, origin=tracks[0])  # at the height of the ground, at least
    return _said(document, tracks, ground=tracks)


def set_distance(document: Document, tracks: tuple[int, ...], length: float) -> Document:
    """The document with its solved world so large that two tracks are `length` metres apart."""
    _count(tracks, 2, 2, "The distance needs two tracks: select its two ends.")
    if not SHORTEST <= length <= LONGEST:
        raise UserError("The distance must be a length above 0, in metres.")
    return _said(document, tracks, distance=tracks, length=length)


def forget_line_up(document: Document, plate_id: int) -> Document:
    """The document whose solved world stays where it is, and is held there by no track any more."""
    solved = solved_of(document, plate_id)
    if solved is None:
        raise UserError("There is no solved camera yet: solve it first.")
    return replace_solve(document, solved.replace(line_up=LineUp()))


def _said(document: Document, tracks: tuple[int, ...], **more: Any) -> Document:
    solved = _solved(document, tracks)
    return replace_solve(document, lined_up(solved, solved.line_up.replace(**more)))


def _solved(document: Document, tracks: tuple[int, ...]) -> Any:
    plates = {track.plate_id for track in document.tracks if track.id in tracks}
    solved = solved_of(document, plates.pop()) if len(plates) == 1 else None
    if solved is None:
        raise UserError("There is no solved camera of these tracks yet: solve it first.")
    if not set(tracks) <= set(solved.track_ids.tolist()):
        raise UserError("A track has no place in space: solve again, or choose those that the solve holds.")
    return solved


def _count(tracks: tuple[int, ...], least: int, most: int | None, words: str) -> None:
    if len(set(tracks)) < least or (most is not None and len(tracks) > most):
        raise UserError(words)
