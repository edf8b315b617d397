"""Lenses: their models, what is found of each, and pixels with and without their bend.

A lens is one row of float64. Its first six columns are those of `core/match/solve/state.py`: logarithm of the focal
length in pixels, two first coefficients, logarithm of the pixels' height over width, centre x and y in pixels (whole
numbers at pixel centres, y down). The other columns, and how many there are, belong to the model:

brown : k1, k2 of r^2 and r^4, of coordinates over depth.
brown5 : the same; p1, p2 of a lens out of line with its others; k3 of r^6: the five numbers of OpenCV.
fisheye : k1 to k4 of the 3rd, 5th, 7th and 9th power of the angle; it sees less than a half turn.
radial4 : c2, c4; the unit, pixels of half the diagonal; u1, v1, u3, v3; the bend of a cylinder as two numbers a, b,
    the logarithm of its stretch along twice the angle. y down, where 3DEqualizer has it up.
anamorphic4 : cx02, cy02; the unit; cx22, cy22, cx04, cy04, cx24, cy24, cx44, cy44; turn of the lens in radians (y
    down); squeeze in x and y.

Those of 3DEqualizer are of coordinates over the unit and say where a bent place lies on the straight picture.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.match.lens_kernels import ANAMORPHIC4, BROWN, BROWN5, FISHEYE, RADIAL4, UNIT, bend, straighten

Array = NDArray[np.float64]


class LensModel(NamedTuple):
    """name : as a person types it. columns : length of its row. first : what keyframes alone may tell.
    found : what all frames tell, the focal length not among them. names : of the columns from the seventh on."""

    name: str
    columns: int
    first: tuple[int, ...]
    found: tuple[int, ...]
    names: tuple[str, ...]


MODELS = (
    LensModel("brown", BROWN, (1,), (1, 2), ()),
    LensModel("brown5", BROWN5, (1,), (1, 2, 6, 7, 8), ("p1", "p2", "k3")),
    LensModel("fisheye", FISHEYE, (1,), (1, 2, 6, 7), ("k3", "k4")),
    LensModel("radial4", RADIAL4, (1,), (1, 2, 7, 8, 9, 10), (
        "unit", "u1", "v1", "u3", "v3", "cylinder a", "cylinder b")),
    LensModel("anamorphic4", ANAMORPHIC4, (1, 2), (1, 2, *range(7, 15)), (
        "unit", "cx22", "cy22", "cx04", "cy04", "cx24", "cy24", "cx44", "cy44", "turn", "squeeze x", "squeeze y")),
)
FIRST_NAMES = {
    "brown": ("k1", "k2"), "brown5": ("k1", "k2"), "fisheye": ("k1", "k2"), "radial4": ("c2", "c4"),
    "anamorphic4": ("cx02", "cy02"),
}  # fmt: skip


def model_named(name: str) -> LensModel:
    """The model of a name.

    Raises
    ------
    UserError
        There is no such model.
    """
    for model in MODELS:
        if model.name == name:
            return model
    raise UserError(f"There is no lens model {name}; use one of {', '.join(model.name for model in MODELS)}.")


def model_of(lens: Array) -> LensModel:
    """The model a row of numbers is of."""
    return next(model for model in MODELS if model.columns == len(lens))


def start_lens(focal: float, width: int, height: int, model: str = "brown") -> Array:
    """A lens (L,) that does not bend, its centre in the middle of the picture; a fisheye keeps the angle instead."""
    lens = np.zeros(model_named(model).columns)
    lens[0], lens[4], lens[5] = np.log(focal), 0.5 * (width - 1), 0.5 * (height - 1)
    if len(lens) >= RADIAL4:
        lens[UNIT] = 0.5 * float(np.hypot(width, height))
    if len(lens) == ANAMORPHIC4:
        lens[16:18] = 1.0
    return lens


def coefficients(lens: Array) -> dict[str, float]:
    """The numbers of a lens by name, without the focal length, the pixels' shape and the centre."""
    model = model_of(lens)
    first = dict(zip(FIRST_NAMES[model.name], map(float, lens[1:3]), strict=True))
    return first | dict(zip(model.names, map(float, lens[6:]), strict=True))


def bent(lens: Array, focal: Array | float, flat: Array) -> Array:
    """Pixels (N, 2) of places over depth (N, 2), NaN where the lens leads nowhere; `focal` is the logarithm of each
    frame's zoom, (N,) or one."""
    xy = np.empty((len(flat), 2))
    bend(lens, _each(focal, len(flat)), np.ascontiguousarray(flat), xy)
    return xy


def straightened(lens: Array, focal: Array | float, xy: Array) -> Array:
    """Places over depth (N, 2) of pixels (N, 2), NaN where nothing is seen; the inverse of :func:`bent`."""
    flat = np.empty((len(xy), 2))
    straighten(lens, _each(focal, len(xy)), np.ascontiguousarray(xy, np.float64), flat)
    return flat


def _each(focal: Array | float, count: int) -> Array:
    return np.ascontiguousarray(np.broadcast_to(np.asarray(focal, np.float64), count))
