"""A solved camera as a document keeps it: path, lens, points of tracks, and what the solve says of itself.

Documents are read without the solver, which is large; it is loaded where it is asked.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.field import field
from core.record import Record, column, freeze, number, text

if TYPE_CHECKING:
    from core.match.solve.shot import Shot

Array = NDArray[np.float64]
LENSES = ("none", "brown", "brown5", "fisheye", "radial4", "anamorphic4")
LEAST_COLUMNS, MOST_COLUMNS = 6, 18  # of a lens
LONGEST = 2000  # letters of a warning
UNASKED = freeze(np.zeros((0, 3, 3)))


class SolveSettings(Record):
    """What the solver is told."""

    focal: Annotated[float, field(
        "Focal length", "The focal length in pixels, where it is known; at 0 it is found from the tracks.", "px",
        soft=(0.0, 5000.0), hard=(0.0, 1e7), step=1.0,
    )] = 0.0
    free_focal: Annotated[bool, field(
        "Find it too", "The focal length given is only where the search begins; a better one is found.")] = False
    lens: Annotated[str, field(
        "Lens", "Which bend of the lens is found: none, Brown of two or five numbers, fisheye, or of 3DEqualizer.",
        choices=LENSES,
    )] = "none"
    zoom: Annotated[bool, field("Zooms", "The focal length changes over the shot and is found on every frame.")] = False
    nodal: Annotated[bool, field("Only turns", "The camera stands on a tripod: it turns and does not move.")] = False
    again: Annotated[bool, field(
        "Solve after edits", "Solves again in the background whenever a track was changed, hidden or shown.")] = False

    def __post_init__(self) -> None:
        number(self, "focal", least=0.0, most=1e7)
        if self.lens not in LENSES:
            raise ValueError(f"SolveSettings.lens must be one of {', '.join(LENSES)}")


class Advice(Record):
    """What to mend next. track_id : the track it is of, 0 for none; frame : where to look, None for nowhere.

    without : RMS in pixels that is foretold of the rest without it, 0 where that was not asked.
    """

    words: str
    track_id: int = 0
    frame: int | None = None
    without: float = 0.0

    def __post_init__(self) -> None:
        text(self, "words", longest=LONGEST)
        number(self, "track_id", least=0, most=2**31 - 1)
        number(self, "without", least=0.0, most=1e9)


class LineUp(Record):
    """What is said of the world of a solve, by ids of tracks; 0 and () where nothing is said.

    origin : at the origin. axis : two, along +x. ground : three or more, level. distance : two, `length` metres apart.
    """

    origin: int = 0
    axis: tuple[int, ...] = ()
    ground: tuple[int, ...] = ()
    distance: tuple[int, ...] = ()
    length: float = 1.0

    def __post_init__(self) -> None:
        number(self, "origin", least=0, most=2**31 - 1)
        number(self, "length", least=1e-9, most=1e9)
        if len(self.axis) not in (0, 2) or len(self.distance) not in (0, 2) or len(self.ground) in (1, 2):
            raise ValueError("LineUp must name two tracks of an axis and of a distance, three of the ground or more")

    @property
    def said(self) -> bool:
        """Whether anything is said."""
        return bool(self.tracks)

    @property
    def tracks(self) -> tuple[int, ...]:
        """Ids of the tracks that say it."""
        origin = (self.origin,) if self.origin else ()
        return (*origin, *self.axis, *self.ground, *self.distance)


class SolvedCamera(Record):
    """A camera of a plate, and where its tracks are.

    size : pixels of the plate. lens (L,), frames (F,) int32 rising, rotation (F, 3, 3), translation (F, 3), focal (F,),
    points (P, 3) : those of a `Shot`. track_ids (P,) int32. errors (P,) and by_frame (F,) : RMS in pixels.
    kind : free, planar or nodal. cubes : ids of tracks a test cube stands at. line_up : what holds the world.
    spread (P, 3, 3) : covariance of the points in their world, zero where there is none; (0, 3, 3) was not asked.
    """

    id: int
    plate_id: int
    size: tuple[int, int]
    kind: str
    lens: np.ndarray
    frames: np.ndarray
    rotation: np.ndarray
    translation: np.ndarray
    focal: np.ndarray
    points: np.ndarray
    track_ids: np.ndarray
    errors: np.ndarray
    by_frame: np.ndarray
    rms: float
    median: float
    p95: float
    focal_sigma: float
    warnings: tuple[str, ...] = ()
    advice: tuple[Advice, ...] = ()
    cubes: tuple[int, ...] = ()
    settings: SolveSettings = SolveSettings()
    line_up: LineUp = LineUp()
    spread: np.ndarray = UNASKED

    def __post_init__(self) -> None:
        number(self, "id", "plate_id", least=0, most=2**31 - 1)
        number(self, "rms", "median", "p95", "focal_sigma", least=0.0, most=1e9)
        if min(self.size) < 1:
            raise ValueError("SolvedCamera.size must be a width and a height in pixels")
        for words in self.warnings:
            if len(words) > LONGEST:
                raise ValueError("SolvedCamera.warnings are too long")
        column(self, "lens", np.float64, (None,))
        if not LEAST_COLUMNS <= len(self.lens) <= MOST_COLUMNS:
            raise ValueError("SolvedCamera.lens is of no model")
        column(self, "frames", np.int32, (None,))
        count = len(self.frames)
        if not count or (np.diff(self.frames) <= 0).any():
            raise ValueError("SolvedCamera.frames must hold a frame or more that rise")
        column(self, "rotation", np.float64, (count, 3, 3))
        column(self, "translation", np.float64, (count, 3))
        column(self, "focal", np.float64, (count,))
        column(self, "by_frame", np.float64, (count,))
        if (self.focal <= 0.0).any():
            raise ValueError("SolvedCamera.focal must be above 0")
        column(self, "points", np.float64, (None, 3))
        column(self, "track_ids", np.int32, (len(self.points),))
        column(self, "errors", np.float64, (len(self.points),))
        column(self, "spread", np.float64, (len(self.points) if len(self.spread) else 0, 3, 3))


def shot_of_record(solved: SolvedCamera, names: dict[int, str] | None = None) -> Shot:
    """The shot of a record; `names` of its tracks by their ids."""
    from core.match.solve.shot import Shot

    names = names or {}
    return Shot(
        solved.size, solved.frames, solved.rotation, solved.translation, solved.focal, solved.lens, solved.points,
        tuple(names.get(int(i), f"track{i}") for i in solved.track_ids),
    )


def row_of_frame(solved: SolvedCamera, frame: int) -> int | None:
    """The row of a frame that has a camera."""
    row = int(np.searchsorted(solved.frames, frame))
    return row if row < len(solved.frames) and solved.frames[row] == frame else None


def pixels_of(solved: SolvedCamera, frame: int, points: Array) -> Array | None:
    """(N, 2) where points of the solve's world are seen on the plate, NaN behind the camera; None without a camera."""
    row = row_of_frame(solved, frame)
    if row is None:
        return None
    ahead = (points @ solved.rotation[row].T + solved.translation[row])[:, 2] > 1e-9
    found = np.full((len(points), 2), np.nan)
    if ahead.any():
        found[ahead] = shot_of_record(solved).pixels(row, points[ahead])
    return found


def cube_edges(solved: SolvedCamera, track_id: int, sides: int = 8) -> Array:
    """(12, sides, 3) edges of a cube that stands on the point of a track, a twelfth of the middle distance high.

    Raises
    ------
    UserError
        The solve holds no such point.
    """
    at = np.flatnonzero(solved.track_ids == track_id)
    if not len(at):
        raise UserError("The track has no place in space: solve again, or choose one that the solve holds.")
    half = 0.5 * object_size(solved)
    corner = np.array([[x, y, z] for x in (-1, 1) for y in (-2, 0) for z in (-1, 1)], np.float64) * half
    pairs = [(a, b) for a in range(8) for b in range(a + 1, 8) if bin(a ^ b).count("1") == 1]
    along = np.linspace(0.0, 1.0, sides)[None, :, None]
    a, b = (corner[[pair[k] for pair in pairs]][:, None, :] for k in (0, 1))
    return np.asarray(solved.points[at[0]] + a + (b - a) * along)


def object_size(solved: SolvedCamera) -> float:
    """How large a test object is: a twelfth of the middle distance of points from the cameras."""
    centres = -np.einsum("fji,fj->fi", solved.rotation, solved.translation)
    return float(np.median(np.linalg.norm(solved.points - centres.mean(axis=0), axis=1))) / 12.0


def world_axes(solved: SolvedCamera, sides: int = 8) -> Array:
    """(3, sides, 3) x, y and z of the artist's world, y up, from its origin, as long as two test objects."""
    ways = np.diag([1.0, -1.0, -1.0])  # the world of a solve is y down
    return np.asarray(2.0 * object_size(solved) * ways[:, None, :] * np.linspace(0.0, 1.0, sides)[None, :, None])


def frozen(values: object, dtype: type = np.float64) -> np.ndarray:
    """A fresh read-only copy for a record."""
    return freeze(np.array(values, dtype))
