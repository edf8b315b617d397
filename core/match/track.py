"""Records of 2D tracks: one point of the scene, or one flat piece of it, seen in a plate frame by frame."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from core.field import field
from core.record import Record, column, number, text

MODELS = {"translation": 2, "similarity": 4, "affine": 6, "homography": 8}


class TrackSettings(Record):
    """How patterns are followed."""

    pattern: Annotated[
        int,
        field(
            "Pattern",
            "Side of the square that is followed; larger is steadier, smaller bends less with the surface.",
            "px",
            soft=(9, 61),
            hard=(7, 201),
            step=2,
        ),
    ] = 21
    search: Annotated[
        int,
        field(
            "Search",
            "How far from the place foretold the pattern is looked for when it is not found at once.",
            "px",
            soft=(5, 100),
            hard=(2, 500),
            step=1,
        ),
    ] = 30
    model: Annotated[
        str,
        field(
            "Model",
            "How the pattern may change: move; turn and grow; shear; lean in perspective. Auto takes what pays.",
            choices=("auto", *MODELS),
        ),
    ] = "auto"
    blur: Annotated[
        bool,
        field(
            "Motion blur",
            "Blurs the pattern like the frame it is compared with, from the motion and the shutter.",
        ),
    ] = False
    shutter: Annotated[
        float,
        field(
            "Shutter",
            "Part of a frame's time the shutter is open; 0.5 is the 180 degrees of film.",
            "frames",
            soft=(0.0, 1.0),
            hard=(0.0, 2.0),
            step=0.05,
        ),
    ] = 0.5
    least_score: Annotated[
        float,
        field(
            "Least score",
            "A frame whose likeness to the key falls under this is not kept.",
            soft=(0.3, 0.95),
            hard=(0.0, 1.0),
            step=0.05,
        ),
    ] = 0.5
    patience: Annotated[
        int,
        field(
            "Patience",
            "How many frames a pattern may be out of sight before its track ends.",
            "frames",
            soft=(0, 48),
            hard=(0, 1000),
            step=1,
        ),
    ] = 16

    def __post_init__(self) -> None:
        number(self, "pattern", least=7, most=201)
        number(self, "search", least=2, most=500)
        number(self, "shutter", least=0.0, most=2.0)
        number(self, "least_score", least=0.0, most=1.0)
        number(self, "patience", least=0, most=1000)
        if self.model != "auto" and self.model not in MODELS:
            raise ValueError(f"TrackSettings.model must be auto or one of {', '.join(MODELS)}, not {self.model!r}")


FARTHEST = 1e5  # pixels from a point to its pattern


class Track(Record):
    """One point through a plate. Pixels, centres at whole numbers, origin top left, y down; frames as files count them.

    id : stable, unique among the tracks of a document.
    keys : (K, 3) float64 frame, x, y set by a hand or by the finder of features, frames rising.
    frames : (F,) int32 rising; the frames where the point was seen, keys among them.
    points : (F, 2) float64.
    covariance : (F, 3) float64 xx, xy, yy of the whole error against the keys, px^2.
    own : (F, 3) float64, of the frame's own error: independent from frame to frame. What all frames share, the noise
        in the template, stands on the frame of the key instead, so a solver takes these as they are.
    score : (F,) float64, 0 to 1, likeness to the template.
    settings : how this one is followed, or None for the settings of whoever follows it.
    offset : pixels from the point to the middle of its pattern at the key, for a point that is hard to see itself.
    shape : (P, 2) float64, the closed outline of the pattern around its middle, or None for the whole square;
        shape_smooth makes it a curve.
    """

    id: int
    name: str
    keys: np.ndarray
    frames: np.ndarray
    points: np.ndarray
    covariance: np.ndarray
    own: np.ndarray
    score: np.ndarray
    plate_id: int = 0
    settings: TrackSettings | None = None
    offset: tuple[float, float] = (0.0, 0.0)
    shape: np.ndarray | None = None
    shape_smooth: bool = False
    hidden: bool = False
    locked: bool = False

    def __post_init__(self) -> None:
        text(self, "name")
        number(self, "id", "plate_id", least=0, most=2**31 - 1)
        number(self, "offset", least=-FARTHEST, most=FARTHEST)
        if self.shape is not None:
            column(self, "shape", np.float64, (None, 2))
            if len(self.shape) < 3 or np.abs(self.shape).max() > FARTHEST:
                raise ValueError(f"Track.shape must have 3 points or more, none {FARTHEST:g} pixels away")
        column(self, "keys", np.float64, (None, 3))
        column(self, "frames", np.int32, (None,))
        count = len(self.frames)
        column(self, "points", np.float64, (count, 2))
        column(self, "covariance", np.float64, (count, 3))
        column(self, "own", np.float64, (count, 3))
        column(self, "score", np.float64, (count,))
        for name, frames in (("keys", self.keys[:, 0]), ("frames", self.frames)):
            if (np.diff(frames) <= 0).any():
                raise ValueError(f"Track.{name} must rise from frame to frame")


HAND = 1e-6  # px^2: the variance of a key against itself


def keyed_track(track_id: int, name: str, keys: NDArray[np.float64], plate_id: int = 0) -> Track:
    """A track that has only its keys (K, 3) frame, x, y; of two keys on one frame the later one counts."""
    _, last = np.unique(keys[::-1, 0], return_index=True)
    keys = np.ascontiguousarray(keys[len(keys) - 1 - last], np.float64)
    sure = np.tile([HAND, 0.0, HAND], (len(keys), 1))
    return Track(
        id=track_id,
        name=name,
        keys=keys,
        frames=keys[:, 0].astype(np.int32),
        points=np.ascontiguousarray(keys[:, 1:]),
        covariance=sure,
        own=sure,
        score=np.ones(len(keys)),
        plate_id=plate_id,
    )


def errors_of(track: Track) -> NDArray[np.float64]:
    """(F,) the standard deviation in pixels that a track itself foretells on each of its frames."""
    error: NDArray[np.float64] = np.sqrt(np.maximum(0.5 * (track.covariance[:, 0] + track.covariance[:, 2]), 0.0))
    return error


def badness_of(track: Track) -> NDArray[np.float64]:
    """(F,) what tracks and their frames are ranked by: the error in pixels, and what is missing of the likeness."""
    bad: NDArray[np.float64] = errors_of(track) + (1.0 - track.score)
    return bad


def gaps_of(track: Track) -> list[tuple[int, int]]:
    """The frames before and after every stretch in which a track was not seen."""
    places = np.flatnonzero(np.diff(track.frames) > 1)
    return [(int(track.frames[k]), int(track.frames[k + 1])) for k in places]


class PlaneTrack(Record):
    """A flat piece of the scene through a plate, each frame as a whole: a corner pin. Pixels and frames as of a track.

    key_frame : where it was drawn. outline : (P, 2) float64, P >= 3, the closed shape that is followed, at the key;
        smooth makes it a curve. corners : (4, 2) float64, what is pinned, at the key.
    frames : (F,) int32 rising; where it was seen, the key among them once it was followed.
    homographies : (F, 3, 3) float64, pixels of the frame from pixels of the key.
    error : (F,) float64, pixels, standard deviation foretold of a corner of the box around the outline, the worst one.
    score : (F,) float64, 0 to 1, likeness to the key.
    """

    id: int
    name: str
    key_frame: int
    outline: np.ndarray
    corners: np.ndarray
    frames: np.ndarray
    homographies: np.ndarray
    error: np.ndarray
    score: np.ndarray
    plate_id: int = 0
    smooth: bool = False
    settings: TrackSettings | None = None
    hidden: bool = False
    locked: bool = False

    def __post_init__(self) -> None:
        text(self, "name")
        number(self, "id", "plate_id", least=0, most=2**31 - 1)
        number(self, "key_frame", least=-(2**31), most=2**31 - 1)
        column(self, "outline", np.float64, (None, 2))
        if len(self.outline) < 3:
            raise ValueError("PlaneTrack.outline must have 3 points or more")
        column(self, "corners", np.float64, (4, 2))
        column(self, "frames", np.int32, (None,))
        count = len(self.frames)
        column(self, "homographies", np.float64, (count, 3, 3))
        column(self, "error", np.float64, (count,))
        column(self, "score", np.float64, (count,))
        if (np.diff(self.frames) <= 0).any():
            raise ValueError("PlaneTrack.frames must rise from frame to frame")


def drawn_plane(
    plane_id: int, name: str, frame: int, outline: NDArray[np.float64], plate_id: int = 0, *, smooth: bool = False
) -> PlaneTrack:
    """A plane that has only its outline (P, 2) at a frame. Four points are the corners, else their upright box is."""
    outline = np.ascontiguousarray(outline, np.float64)
    (left, top), (right, bottom) = outline.min(axis=0), outline.max(axis=0)
    box = np.array([[left, top], [right, top], [right, bottom], [left, bottom]])
    return PlaneTrack(
        id=plane_id,
        name=name,
        key_frame=frame,
        outline=outline,
        corners=outline if len(outline) == 4 else box,
        frames=np.array([frame], np.int32),
        homographies=np.eye(3)[None],
        error=np.zeros(1),
        score=np.ones(1),
        plate_id=plate_id,
        smooth=smooth,
    )


def carried_points(plane: PlaneTrack, frame: int, points: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Where points (N, 2) of the key lie in a frame, on the plane; None where the plane is not seen."""
    at = int(np.searchsorted(plane.frames, frame))
    if at == len(plane.frames) or plane.frames[at] != frame:
        return None
    matrix = plane.homographies[at]
    there = points @ matrix[:, :2].T + matrix[:, 2]
    return np.asarray(there[:, :2] / there[:, 2:])
