"""How the strength of a brush fades from its centre to its rim.

Distances are fractions of the radius: 0 at the centre, 1 at the rim, beyond it every falloff is 0.
Each shape exists once, as a scalar numba function which kernels call and which :func:`falloff` maps over arrays.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

Shape = Literal["smooth", "flat", "linear", "sharp", "constant"]
SHAPES: tuple[Shape, ...] = ("smooth", "flat", "linear", "sharp", "constant")


@njit("float64(float64, float64, float64)", cache=True, nogil=True, inline="always")
def smoothstep1(low: float, high: float, x: float) -> float:
    """0 below `low`, 1 above `high`, 3s^2 - 2s^3 between (kernel form); a step when low = high."""
    if x <= low < high:
        return 0.0
    if x >= high:
        return 1.0
    if high <= low:
        return 0.0
    s = (x - low) / (high - low)
    return s * s * (3.0 - 2.0 * s)


@njit("float64(int64, float64, float64)", cache=True, nogil=True)
def falloff1(shape: int, distance: float, flat: float) -> float:
    """Weight 0 .. 1 at one distance (kernel form).

    Parameters
    ----------
    shape : index into :data:`SHAPES`.
    distance : over the radius, >= 0.
    flat : of the shape "flat" only: the fraction of the radius within which the weight is 1.
    """
    if distance >= 1.0 or not distance >= 0.0:  # the second test also sends NaN to 0
        return 0.0
    if shape == 0:
        return 1.0 - distance * distance * (3.0 - 2.0 * distance)
    if shape == 1:
        return 1.0 - smoothstep1(flat, 1.0, distance)
    if shape == 2:
        return 1.0 - distance
    if shape == 3:
        return (1.0 - distance) * (1.0 - distance)
    return 1.0


@njit("void(int64, float64[::1], float64, float64[::1])", cache=True, nogil=True)
def _falloffs(shape: int, distances: np.ndarray, flat: float, out: np.ndarray) -> None:
    for i in range(distances.shape[0]):
        out[i] = falloff1(shape, distances[i], flat)


def falloff(distances: ArrayLike, shape: Shape = "smooth", flat: float = 0.25) -> NDArray[np.float64]:
    """Brush weights 0 .. 1, float64, in the shape of `distances` (fractions of the radius, >= 0).

    "smooth" is 1 - smoothstep; "flat" is 1 up to the fraction `flat` and smooth from there to the rim (the comb's
    falloff); "linear" is 1 - d; "sharp" is (1 - d)^2; "constant" is 1 inside the rim.
    """
    d = np.asarray(distances, np.float64)
    out = np.empty(d.size)
    _falloffs(SHAPES.index(shape), np.array(d, order="C").ravel(), flat, out)
    return out.reshape(d.shape)


def smoothstep(low: ArrayLike, high: ArrayLike, x: ArrayLike) -> NDArray[np.float64]:
    """0 below `low`, 1 above `high`, 3s^2 - 2s^3 between, float64; where low >= high a step at `high`."""
    lo, hi, v = (np.asarray(a, np.float64) for a in (low, high, x))
    width = hi - lo
    good = width > 0.0
    s = np.clip((v - lo) / np.where(good, width, 1.0), 0.0, 1.0)
    return np.where(good, s * s * (3.0 - 2.0 * s), np.where(v >= hi, 1.0, 0.0))
