"""A solved camera as it stands in space: its path, what it sees on a frame, how sure its points are and how far off.

The world is that of the artist here, y up; a record of a solve is y down.
"""

from __future__ import annotations

import numpy as np

from core.match.solved import Array, SolvedCamera, object_size, pixels_of, row_of_frame
from core.match.track import Track

UP = np.array([1.0, -1.0, -1.0])  # of the world of a solve
CELLS, SIDES = 5, 11  # of the ground to each side of the origin; points along a line, so that a lens may bend it
GOOD, POOR = 1.5, 2.5  # of the median error of the points


def points_up(solved: SolvedCamera) -> Array:
    """(P, 3) the points."""
    return np.asarray(solved.points * UP)


def path_up(solved: SolvedCamera) -> Array:
    """(F, 3) where the camera stands on every frame."""
    return np.asarray(-np.einsum("fji,fj->fi", solved.rotation, solved.translation) * UP)


def from_behind(solved: SolvedCamera) -> Array:
    """(3,) a way to look at all of it: as the camera does in the middle, but from its side and from above."""
    x, _, z = solved.rotation[len(solved.rotation) // 2, 2] * UP
    return np.array([0.75 * x - 0.65 * z, -0.6, 0.75 * z + 0.65 * x])


def frustum_up(solved: SolvedCamera, frame: int) -> Array | None:
    """(5, 3) where the camera stands, and the corners of its picture, left top first, clockwise; None without one.

    The corners are straightened: where the lens bends, they lie where a pinhole would see them.
    """
    from core.match.lens import straightened  # of the solver, which is large
    from core.match.solve.state import FOCAL

    row = row_of_frame(solved, frame)
    if row is None:
        return None
    wide, tall = solved.size
    corners = np.array([[-0.5, -0.5], [wide - 0.5, -0.5], [wide - 0.5, tall - 0.5], [-0.5, tall - 0.5]])
    flat = straightened(solved.lens, float(np.log(solved.focal[row]) - solved.lens[FOCAL]), corners)
    if not np.isfinite(flat).all():  # wider than a pinhole sees
        return None
    ahead = 3.0 * object_size(solved)
    seen = np.vstack([np.zeros(3), ahead * np.column_stack([flat, np.ones(4)])])
    return np.asarray((seen - solved.translation[row]) @ solved.rotation[row] * UP)


def ground_lines(solved: SolvedCamera) -> Array:
    """(N, SIDES, 3) lines of a grid at the height zero about the origin, in the world of the solve."""
    step = 0.5 * object_size(solved)
    at, along = step * np.arange(-CELLS, CELLS + 1), step * np.linspace(-CELLS, CELLS, SIDES)
    one = np.zeros((len(at), SIDES, 3))
    one[..., 0], one[..., 2] = at[:, None], along
    return np.concatenate([one, one[..., ::-1]])


def grades(errors: Array) -> np.ndarray:
    """(P,) int: 0 good, 1 middling, 2 far off, by the median of the errors (P,)."""
    typical = float(np.median(errors)) if len(errors) else 0.0
    return (errors > GOOD * typical).astype(int) + (errors > POOR * typical)


def spreads_up(solved: SolvedCamera) -> Array:
    """(P, 3, 3) covariance of the points in metres squared; (0, 3, 3) of a solve that was not asked."""
    return np.asarray(solved.spread * UP[:, None] * UP)


def sigma_of(solved: SolvedCamera, row: int) -> float:
    """Standard deviation in metres of a point along the axis it is known worst on; 0 where that was not asked."""
    if not len(solved.spread):
        return 0.0
    return float(np.sqrt(max(float(np.linalg.eigvalsh(solved.spread[row])[-1]), 0.0)))


def misses(solved: SolvedCamera, track: Track) -> tuple[np.ndarray, Array]:
    """Frames (N,) on which a track is seen and the camera solved, and by how many pixels (N,) the point misses it."""
    at = np.flatnonzero(solved.track_ids == track.id)
    frames = np.intersect1d(track.frames, solved.frames)
    if not len(at):
        return frames[:0], np.zeros(0)
    told = [pixels_of(solved, int(frame), solved.points[at]) for frame in frames]
    xy = np.array([np.full(2, np.nan) if one is None else one[0] for one in told]).reshape(-1, 2)
    return frames, np.linalg.norm(xy - track.points[np.searchsorted(track.frames, frames)], axis=1)
