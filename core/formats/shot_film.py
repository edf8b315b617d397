"""The film of a camera, as OpenUSD and Alembic have it: focal length, apertures and their offsets in millimetres."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.match.lens import MODELS, start_lens
from core.match.solve.shot import Shot, shot_from_up
from core.match.solve.state import ASPECT, CENTRE_X, CENTRE_Y, FOCAL

FILM = 36.0  # across
WIDTH = 1920  # of the plate, where a file does not say
Z_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
Array = NDArray[np.float64]


def film_of(shot: Shot) -> Array:
    """(F, 5) focal length, aperture across and down, offset to the right and up of every frame."""
    width, height = shot.size
    pixel = FILM / width
    right, below = shot.off_centre
    film = np.empty((len(shot.frames), 5))
    film[:, 0] = shot.focal * pixel
    film[:, 1:] = FILM, FILM * height / width / shot.stretch, -right * pixel, below * pixel / shot.stretch
    return film


def shot_of_film(
    size: tuple[int, int], frames: NDArray[np.int32], world: Array, film: Array, points: Array, names: tuple[str, ...],
    up: str, lens: Array | None = None,
) -> Shot:
    """The shot of a camera path: world (F, 4, 4) world_from_camera, film (F, 5), points (P, 3), `up` y or z.

    size : of the plate, (0, 0) where the file does not say. lens : of `core/match/lens.py`, where it does.
    """
    if up == "z":
        world, points = Z_UP @ world, points @ Z_UP[:3, :3].T
    width, height = size
    if not width:
        width, height = WIDTH, max(1, round(WIDTH * float(film[0, 2] / film[0, 1])))
    pixel = film[:, 1] / width
    focal = film[:, 0] / pixel
    if lens is None or len(lens) not in {model.columns for model in MODELS} or not np.isfinite(lens).all():
        lens = start_lens(float(focal[0]), width, height)
        stretch = height * pixel[0] / film[0, 2]
        lens[ASPECT] = np.log(stretch)
        lens[CENTRE_X] -= film[0, 3] / pixel[0]
        lens[CENTRE_Y] += film[0, 4] / pixel[0] * stretch
    lens[FOCAL] = np.log(focal[0])
    return shot_from_up((width, height), frames.astype(np.int32), world, focal, points, names, lens)
