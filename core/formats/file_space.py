"""The space of a file: its unit and up axis, and the way from there to metres with Y up and back."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.units import METRES_PER_UNIT


def metres_of(unit: str | float) -> float:
    """Metres of one unit, given by name (m, cm, mm, in, ft) or as a number.

    Raises
    ------
    UserError
        For an unknown name, or a number that is not above zero.
    """
    if isinstance(unit, str):
        if unit not in METRES_PER_UNIT:
            raise UserError(f"The unit {unit} is not known; use one of {', '.join(METRES_PER_UNIT)}.")
        return METRES_PER_UNIT[unit]
    if not (np.isfinite(unit) and unit > 0):
        raise UserError(f"A unit of {unit} metres makes no sense; it must be above zero.")
    return float(unit)


def axis_of(up: str) -> str:
    """The up axis as "y" or "z"; anything else is refused."""
    if up.lower() not in ("y", "z"):
        raise UserError(f"The up axis {up} is not known; use y or z.")
    return up.lower()


def to_metres_y_up(points: NDArray[Any], metres_per_unit: float, up: str) -> NDArray[np.float32]:
    """(N, 3) points of a file as float32 metres, Y up. Z up turns by -90 degrees about X: (x, z, -y)."""
    if up == "z":
        points = np.stack([points[:, 0], points[:, 2], -points[:, 1]], axis=1)
    return scaled(points, metres_per_unit)


def from_metres_y_up(points: NDArray[Any], metres_per_unit: float, up: str) -> NDArray[np.float32]:
    """(N, 3) float32 metres, Y up, as points of a file. Z up turns by 90 degrees about X: (x, -z, y)."""
    if up == "z":
        points = np.stack([points[:, 0], -points[:, 2], points[:, 1]], axis=1)
    return scaled(points, metres_per_unit, divide=True)


def scaled(values: NDArray[Any], factor: float, divide: bool = False) -> NDArray[np.float32]:
    """`values` times (or over) `factor`, rounded once to float32; untouched to the bit when it is 1."""
    if factor == 1.0:
        return np.ascontiguousarray(values, np.float32)
    wide = np.asarray(values, np.float64)
    return (wide / factor if divide else wide * factor).astype(np.float32)
