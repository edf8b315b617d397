"""Where the world of a solved camera lies, said with tracks by hand, and kept when the camera is solved again."""

from __future__ import annotations

import numpy as np

from core.match.solved import LineUp, SolvedCamera, frozen

LOST = (
    "Too few tracks are those of the solve before: the world begins anew and is no longer lined up. Say again where it "
    "lies."
)
LET_GO = (
    "A track that says where the world lies has no place in this solve: the world stays about where it was. Say it "
    "again."
)


def lined_up(solved: SolvedCamera, line_up: LineUp) -> SolvedCamera:
    """The solve in the world that is said: a similarity, which moves no point in the picture.

    Tracks the solve does not hold say nothing. The world of the artist is y up, that of a solve y down.

    Raises
    ------
    UserError
        Points of an axis or of a distance lie at one place, those of the ground on one line.
    """
    from core.match.solve.coordinates import Frame, to_frame  # of the solver, which is large
    from core.match.solve.shot import FLIP

    row = {int(track): k for k, track in enumerate(solved.track_ids)}

    def rows(tracks: tuple[int, ...]) -> tuple[int, ...] | None:
        return tuple(row[track] for track in tracks) if tracks and all(track in row for track in tracks) else None

    ends, ground, measured = rows(line_up.axis), rows(line_up.ground), rows(line_up.distance)
    points = solved.points @ FLIP
    centres = -np.einsum("fji,fj->fi", solved.rotation, solved.translation) @ FLIP
    frame = Frame(
        row.get(line_up.origin), None if ends is None else (ends[0], ends[1]), ground,
        None if measured is None else (measured[0], measured[1], line_up.length),
    )
    scale, turn, shift = to_frame(frame, points, centres.mean(axis=0) - points.mean(axis=0))
    return _moved(solved.replace(line_up=line_up), scale, FLIP @ turn @ FLIP, shift @ FLIP)


def as_before(solved: SolvedCamera, before: SolvedCamera) -> SolvedCamera:
    """A new solve laid onto the points it shares with the one before, and lined up as that was.

    Where that cannot be, wholly or in part, a warning says so.
    """
    from core.errors import UserError
    from core.match.solve.coordinates import onto

    _, ours, theirs = np.intersect1d(solved.track_ids, before.track_ids, return_indices=True)
    try:
        scale, turn, shift = onto(solved.points[ours], before.points[theirs])
        placed = lined_up(_moved(solved, scale, turn, shift), before.line_up)
    except UserError:  # too little is shared, or the ground is no plane any more: the world begins anew
        return _warned(solved, LOST) if before.line_up.said else solved
    missing = set(before.line_up.tracks) - {int(track) for track in solved.track_ids}
    return _warned(placed, LET_GO) if missing else placed


def _warned(solved: SolvedCamera, words: str) -> SolvedCamera:
    warned: SolvedCamera = solved.replace(warnings=(*solved.warnings, words))
    return warned


def _moved(solved: SolvedCamera, scale: float, turn: np.ndarray, shift: np.ndarray) -> SolvedCamera:
    """The solve with points and cameras at ``scale * turn @ X + shift``."""
    rotation = solved.rotation @ turn.T
    moved: SolvedCamera = solved.replace(
        rotation=frozen(rotation), translation=frozen(scale * solved.translation - rotation @ shift),
        points=frozen(scale * solved.points @ turn.T + shift),
        spread=frozen(scale**2 * turn @ solved.spread @ turn.T))
    return moved
