"""Who took which frame: a shot, photographs by themselves, witness cameras; and all of them seen as by one camera.

The solver knows one lens. Pictures of other cameras are brought to it beforehand: their distortion is taken out, their
centre and focal length become those of the lens, and they are bent as it bends. What is left of a focal length that was
only guessed is a column of its frames, tied together by a stiff quadratic cost.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.match.lens import bent
from core.match.solve.bundle import smooth_zoom
from core.match.solve.state import FOCAL, K1, Array, Flags, Observations, Rows, bearings, start_lens

TIED = 1e-5  # of a focal length, between frames of one camera
FROM_WIDTH = 1.0  # the focal length over the width of a picture, where nobody knows


class Camera(NamedTuple):
    """A camera by its pictures. size : width, height in pixels. focal : in pixels, or None while nobody knows.

    found : whether the focal length is to be found, from `focal` if that is given. k1, k2 : what bends its pictures.
    centre : in pixels, the middle where None.
    """

    size: tuple[int, int]
    focal: float | None = None
    found: bool = False
    k1: float = 0.0
    k2: float = 0.0
    centre: tuple[float, float] | None = None
    bends: bool = False

    def lens(self, focal: float) -> Array:
        """Its row of numbers (6,) at a focal length, see `core/match/lens.py`."""
        lens = start_lens(focal, *self.size)
        lens[K1 : K1 + 2] = self.k1, self.k2
        if self.centre is not None:
            lens[4:6] = self.centre
        return lens


class Views(NamedTuple):
    """alone : (F,) photographs without neighbours in time. camera : (F,) int32 rows of `cameras`, the first is the
    shot's. bend : (L,) the lens of the first, as far as it is known to bend."""

    alone: Flags
    camera: Rows
    cameras: tuple[Camera, ...]
    bend: Array | None = None


def one_shot(frames: int, camera: Camera) -> Views:
    """All frames of one shot."""
    return Views(np.zeros(frames, bool), np.zeros(frames, np.int32), (camera,))


def check(views: Views) -> None:
    """Raise UserError when a camera is none."""
    for camera in views.cameras:
        if camera.focal is not None and not (np.isfinite(camera.focal) and camera.focal > 0.0):
            raise UserError(f"A focal length of {camera.focal} pixels is none; give it in pixels, above 0.")
        if not np.isfinite([camera.k1, camera.k2, *(camera.centre or (0.0, 0.0))]).all():
            raise UserError("A camera has a distortion or a centre that is not a number.")


def guessed(camera: Camera) -> float:
    """Its focal length in pixels, or a usual one."""
    return camera.focal or FROM_WIDTH * max(camera.size)


def as_one(
    observations: Observations, views: Views, focal: float, pace: Array | None = None
) -> tuple[Observations, Array]:
    """Observations as the first camera would have them at `focal` pixels, and how many pixels of its own picture one of
    those is in each frame, (F,).

    pace : (F,) over its focal length that of each frame, where it is thought to zoom.
    """
    main = views.cameras[0]
    pixel = np.ones(len(views.camera))
    xy, root = observations.xy.copy(), observations.root.copy()
    ours = start_lens(focal, *main.size) if views.bend is None else views.bend.copy()
    ours[FOCAL] = np.log(focal)
    middle = ours[4:6]
    for row, camera in enumerate(views.cameras):
        own = focal if row == 0 else guessed(camera)
        rows = views.camera[observations.frame] == row
        if row or camera.k1 or camera.k2 or camera.centre is not None:
            there = bent(ours, 0.0, np.ascontiguousarray(bearings(camera.lens(own), 0.0, xy[rows])[:, :2]))
            xy[rows] = np.where(np.isfinite(there), there, 1e6)
        root[rows] *= own / focal
        pixel[views.camera == row] = own / focal
    if pace is not None:
        share = pace[observations.frame, None]
        xy, root, pixel = middle + (xy - middle) / share, root * share, pixel * pace
    return observations._replace(xy=np.ascontiguousarray(xy), root=np.ascontiguousarray(root)), pixel


def ties(views: Views, rows: NDArray, frames: Rows, *, zoom: bool) -> Array | None:
    """(n, n) quadratic cost on the focal lengths of frames `rows` (n,), numbered `frames`; None when none may change.

    zoom : that of the shot changes from frame to frame.
    """
    if len(views.cameras) == 1:
        return smooth_zoom(frames) if zoom else None
    found = [camera.found or camera.focal is None for camera in views.cameras]
    if not (zoom or any(found)):
        return None
    matrix = np.zeros((len(rows), len(rows)))
    for row in range(len(views.cameras)):
        own = np.flatnonzero(views.camera[rows] == row)
        if not len(own):
            continue
        at = np.ix_(own, own)
        if row == 0 and zoom and len(own) > 2:
            matrix[at] += smooth_zoom(frames[own])
            continue
        matrix[at] += np.eye(len(own)) / TIED**2
        if found[row]:
            matrix[at] -= 1.0 / (len(own) * TIED**2)  # only their differences are held
    matrix[np.diag_indices(len(rows))] += 1e-6
    return matrix
