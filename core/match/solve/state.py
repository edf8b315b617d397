"""What a solve works on: observations and unknowns as plain arrays.

Cameras here are those of the solver's literature: x right, y down, looking along +z; ``x_camera = R X + t``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Rows = NDArray[np.int32]
Flags = NDArray[np.bool_]

# columns of a frame's unknowns and of those all frames share
ROTATION, TRANSLATION, FRAME_FOCAL = slice(0, 3), slice(3, 6), 6
FRAME_COLUMNS = 7
FOCAL, K1, K2, ASPECT, CENTRE_X, CENTRE_Y = range(6)
LENS_COLUMNS = 6
LENS_NAMES = ("focal length", "distortion k1", "distortion k2", "pixel aspect", "centre x", "centre y")


class Observations(NamedTuple):
    """N places where a track was seen, sorted by frame.

    frame, track : (N,) int32, rows of the frames and of the points. xy : (N, 2) float64, pixels.
    root : (N, 3) float64, xx, xy, yy of the upper triangle of a root of the inverse covariance: it whitens residuals.
    """

    frame: Rows
    track: Rows
    xy: Array
    root: Array

    def take(self, rows: NDArray) -> Observations:
        """Those of some rows, or of a mask."""
        return Observations(*(np.ascontiguousarray(column[rows]) for column in self))


class State(NamedTuple):
    """Unknowns of F frames and P points.

    rotation : (F, 3, 3) float64 camera_from_world. translation : (F, 3). points : (P, 3) in world.
    focal : (F,) float64, logarithm of the focal length over that of the lens, 0 unless the lens zooms.
    lens : (6,) float64: logarithm of the focal length in pixels, k1, k2 (Brown, of coordinates over depth), logarithm
        of the pixels' height over width, centre x and y in pixels.
    """

    rotation: Array
    translation: Array
    points: Array
    focal: Array
    lens: Array

    def centres(self) -> Array:
        """(F, 3) where the cameras stand, in world."""
        return -np.einsum("fji,fj->fi", self.rotation, self.translation)


def projected(state: State, frame: NDArray, points: Array) -> tuple[Array, Array]:
    """Pixels (N, 2) and depths (N,) of points (N, 3) seen in frames (N,)."""
    seen = np.einsum("nij,nj->ni", state.rotation[frame], points) + state.translation[frame]
    depth = seen[:, 2]
    flat = seen[:, :2] / np.where(np.abs(depth) < 1e-12, 1e-12, depth)[:, None]
    square = (flat**2).sum(axis=1)
    bent = flat * (1.0 + state.lens[K1] * square + state.lens[K2] * square**2)[:, None]
    scale = np.exp(state.lens[FOCAL] + state.focal[frame])
    stretch = np.exp(state.lens[ASPECT])
    return np.stack([
        scale * bent[:, 0] + state.lens[CENTRE_X], scale * stretch * bent[:, 1] + state.lens[CENTRE_Y],
    ], axis=1), depth


def bearings(lens: Array, focal: Array | float, xy: Array) -> Array:
    """Directions (N, 3) with z 1 of pixels (N, 2); `focal` (N,) is the logarithm of each frame's zoom."""
    scale = np.exp(lens[FOCAL] + np.asarray(focal))
    x = (xy[:, 0] - lens[CENTRE_X]) / scale
    y = (xy[:, 1] - lens[CENTRE_Y]) / (scale * np.exp(lens[ASPECT]))
    flat = bent = np.stack([x, y], axis=1)
    if lens[K1] or lens[K2]:
        for _ in range(12):  # fixed point: distortion of a lens is small
            square = (flat**2).sum(axis=1)
            flat = bent / np.maximum(1.0 + lens[K1] * square + lens[K2] * square**2, 0.1)[:, None]
    return np.concatenate([flat, np.ones((len(flat), 1))], axis=1)


def whitened(observations: Observations, error: Array) -> Array:
    """Errors (N, 2) in pixels as multiples of what was foretold."""
    root = observations.root
    return np.stack([root[:, 0] * error[:, 0] + root[:, 1] * error[:, 1], root[:, 2] * error[:, 1]], axis=1)


def residuals(state: State, observations: Observations) -> Array:
    """(N, 2) float64, whitened reprojection errors; those behind a camera count as far off."""
    xy, depth = projected(state, observations.frame, state.points[observations.track])
    error = whitened(observations, xy - observations.xy)
    return np.where((depth > 1e-9)[:, None], error, 1e4)


def start_lens(focal: float, width: int, height: int) -> Array:
    """A lens without distortion, its centre in the middle of the picture."""
    return np.array([np.log(focal), 0.0, 0.0, 0.0, 0.5 * (width - 1), 0.5 * (height - 1)])
