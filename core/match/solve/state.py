"""What a solve works on: observations and unknowns as plain arrays.

Cameras here are those of the solver's literature: x right, y down, looking along +z; ``x_camera = R X + t``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.match.lens import bent, start_lens, straightened

__all__ = ["start_lens"]

Array = NDArray[np.float64]
Rows = NDArray[np.int32]
Flags = NDArray[np.bool_]

# columns of a frame's unknowns and of those all frames share
ROTATION, TRANSLATION, FRAME_FOCAL = slice(0, 3), slice(3, 6), 6
FRAME_COLUMNS = 7
FOCAL, K1, K2, ASPECT, CENTRE_X, CENTRE_Y = range(6)
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
    lens : (L,) float64, first the logarithm of the focal length in pixels, k1, k2, logarithm of the pixels' height
        over width, centre x and y in pixels; what follows, and what k1 and k2 are, says its model (core/match/lens.py).
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
    return bent(state.lens, state.focal[frame], flat), depth


def bearings(lens: Array, focal: Array | float, xy: Array) -> Array:
    """Directions (N, 3) with z 1 of pixels (N, 2); `focal` (N,) is the logarithm of each frame's zoom. Where the lens
    sees nothing it counts as one that does not bend."""
    flat = straightened(lens, focal, xy)
    lost = np.isnan(flat[:, 0])
    if lost.any():
        scale = np.exp(lens[FOCAL] + np.broadcast_to(focal, len(xy)))[lost, None] * [1.0, np.exp(lens[ASPECT])]
        flat[lost] = (xy[lost] - lens[[CENTRE_X, CENTRE_Y]]) / scale
    return np.concatenate([flat, np.ones((len(flat), 1))], axis=1)


def whitened(observations: Observations, error: Array) -> Array:
    """Errors (N, 2) in pixels as multiples of what was foretold."""
    root = observations.root
    return np.stack([root[:, 0] * error[:, 0] + root[:, 1] * error[:, 1], root[:, 2] * error[:, 1]], axis=1)


def residuals(state: State, observations: Observations) -> Array:
    """(N, 2) float64, whitened reprojection errors; those behind a camera count as far off."""
    xy, depth = projected(state, observations.frame, state.points[observations.track])
    error = whitened(observations, xy - observations.xy)
    return np.where(((depth > 1e-9) & np.isfinite(xy[:, 0]))[:, None], error, 1e4)
