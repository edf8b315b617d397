"""Maps between a plate as the lens bent it and the straight picture of a pinhole, with room for its bulging corners."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.match.lens import bent, straightened

Array = NDArray[np.float64]
MOST_PIXELS = 1 << 27
ROWS = 256  # worked on at once
TINY = 1e-6  # pixels
MOST_OVERSCAN = 1.0  # of the plate on every side; a wider lens is cut there


class Canvas(NamedTuple):
    """The straight picture: size (w, h) in pixels, left and top are those it has beyond the plate."""

    size: tuple[int, int]
    left: int
    top: int


def canvas(lens: Array, size: tuple[int, int], overscan: float | None = None) -> Canvas:
    """A straight picture about the plate of `size` that holds every pixel of it.

    overscan : part of the plate's size on every side; None for as much as the lens needs. A lens that sees very wide
        is cut at once the plate's size on every side.

    Raises
    ------
    UserError
        The picture would have more than 2^27 pixels.
    """
    width, height = size
    if overscan is None:
        xy = straight_pixels(lens, _border(width, height))
        xy = xy[np.isfinite(xy[:, 0])]
        if not len(xy):
            raise UserError("The lens leads no pixel of the plate anywhere; check its numbers.")
        out = np.concatenate([-xy.min(axis=0), xy.max(axis=0) - np.array([width - 1, height - 1])])
        most = np.array([width, height, width, height]) * MOST_OVERSCAN
        x, y = (max(0, int(np.ceil(np.minimum(out, most)[k::2].max() - TINY))) for k in (0, 1))
        x, y = x + (x > 0), y + (y > 0)
    else:
        x, y = round(overscan * width), round(overscan * height)
    if (width + 2 * x) * (height + 2 * y) > MOST_PIXELS:
        raise UserError("The straight picture would be too large; ask for less overscan.")
    return Canvas((width + 2 * x, height + 2 * y), x, y)


def straight_pixels(lens: Array, xy: Array) -> Array:
    """Pixels (N, 2) of the plate on the straight picture, counted as the plate's are; NaN where there is nothing."""
    flat = straightened(lens, 0.0, xy)
    return np.asarray(flat * _scale(lens) + lens[4:6])


def bent_pixels(lens: Array, xy: Array) -> Array:
    """Pixels (N, 2) of the straight picture on the plate; NaN where the lens leads nowhere."""
    return bent(lens, 0.0, np.asarray((xy - lens[4:6]) / _scale(lens)))


def undistort_map(lens: Array, size: tuple[int, int], room: Canvas) -> NDArray[np.float32]:
    """(h, w, 2) float32 for every pixel of the straight picture: where to look on the plate, as parts of its width
    and height from its lower left corner (an STMap). Where the lens leads nowhere it looks outside, at -1."""
    return _map(room.size, lambda xy: bent_pixels(lens, xy - np.array([room.left, room.top])), size)


def redistort_map(lens: Array, size: tuple[int, int], room: Canvas) -> NDArray[np.float32]:
    """(H, W, 2) float32 for every pixel of the plate: where to look on the straight picture, as its parts."""
    return _map(size, lambda xy: straight_pixels(lens, xy) + np.array([room.left, room.top]), room.size)


def _map(size, there, into) -> NDArray[np.float32]:  # type: ignore[no-untyped-def]
    width, height = size
    found = np.empty((height, width, 2), np.float32)
    for top in range(0, height, ROWS):
        y, x = np.mgrid[top : min(top + ROWS, height), 0:width].astype(np.float64)
        xy = there(np.stack([x.ravel(), y.ravel()], axis=1))
        unit = np.stack([(xy[:, 0] + 0.5) / into[0], 1.0 - (xy[:, 1] + 0.5) / into[1]], axis=1)
        found[top : top + ROWS] = np.nan_to_num(unit, nan=-1.0).reshape(*x.shape, 2)
    return found


def _scale(lens: Array) -> Array:
    return np.exp(lens[0]) * np.array([1.0, np.exp(lens[3])])


def _border(width: int, height: int) -> Array:
    x, y = np.linspace(0, width - 1, 65), np.linspace(0, height - 1, 65)
    sides = [np.stack(np.broadcast_arrays(x, v), axis=1) for v in (0.0, height - 1.0)]
    sides += [np.stack(np.broadcast_arrays(v, y), axis=1) for v in (0.0, width - 1.0)]
    return np.concatenate(sides)
