"""An outline or a barb drawn by hand as attributes of the feather: least squares over its own form."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from core.errors import UserError
from core.feather.attributes import limits
from core.feather.surface import (
    ASYMMETRY,
    BARB_BASE,
    BARB_CURVE,
    BARB_MIDDLE,
    BARB_TIP,
    BASE_FULLNESS,
    EDGE_WAVE,
    END,
    NOTCH_DEPTH,
    NOTCH_LENGTH,
    NOTCH_POSITION,
    START,
    TAPER,
    TIP_FULLNESS,
    WIDEST,
    WIDTH,
    vane_width,
)

SAMPLES = 64  # of an outline, along the shaft
AT_SHAFT = 0.15  # of the widest: a line that ends closer to the shaft says where the vane begins or ends
PLAIN = (WIDTH, WIDEST, BASE_FULLNESS, TIP_FULLNESS)
NOTCHED = (*PLAIN, NOTCH_POSITION, NOTCH_DEPTH, NOTCH_LENGTH)
ANGLES = (BARB_BASE, BARB_MIDDLE, BARB_TIP)
NOTCH_PAYS = 0.7  # of the error without a notch: only what is clearly better is one


def outline_of(values: NDArray[Any], side: int, samples: int = SAMPLES) -> NDArray[np.float64]:
    """The outline of a side (0 left, 1 right), (samples, 2): away from the shaft and along it, in shaft lengths."""
    a = np.ascontiguousarray(values, np.float32)
    share = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, samples))
    along = a[START + side] + max(float(a[END + side] - a[START + side]), 1e-3) * share
    return np.stack([_widths(a, side, along), along], axis=1)


def fitted_outline(values: NDArray[Any], side: int, line: NDArray[Any]) -> NDArray[np.float32]:
    """Attributes (K,) with the outline of a side as it was drawn.

    Where the line does not reach, the outline stays. Where it comes down to the shaft the vane begins or ends.

    Parameters
    ----------
    line : (N, 2), away from the shaft (any sign) and along it, in shaft lengths, in any order.

    Raises
    ------
    UserError
        The line has no length along the shaft.
    """
    drawn = np.asarray(line, np.float64)
    drawn = np.stack([np.abs(drawn[:, 0]), drawn[:, 1]], axis=1)[np.argsort(drawn[:, 1], kind="stable")]
    if len(drawn) < 2 or drawn[-1, 1] - drawn[0, 1] < 0.02:
        raise UserError("This line is too short for an outline; draw it along the edge of the vane.")
    a = np.array(values, np.float32)
    low, high = limits()
    close = AT_SHAFT * float(drawn[:, 0].max())
    if drawn[0, 0] <= close:
        a[START + side] = np.clip(drawn[0, 1], low[START + side], high[START + side])
    if drawn[-1, 0] <= close:
        a[END + side] = np.clip(drawn[-1, 1], low[END + side], high[END + side])
    a[EDGE_WAVE + side] = 0.0
    old = outline_of(a, side)
    inside = (old[:, 1] >= drawn[0, 1]) & (old[:, 1] <= drawn[-1, 1])
    wanted = np.where(inside, np.interp(old[:, 1], drawn[:, 1], drawn[:, 0]), old[:, 0])
    plain = a.copy()
    plain[NOTCH_DEPTH + side] = 0.0
    best, error = _least(plain, side, PLAIN, old[:, 1], wanted)
    for place in (0.35, 0.6, 0.8):
        start = best.copy()
        start[NOTCH_POSITION + side], start[NOTCH_DEPTH + side], start[NOTCH_LENGTH + side] = place, 0.2, 0.1
        notched, left = _least(start, side, NOTCHED, old[:, 1], wanted)
        if left < NOTCH_PAYS * error:
            best, error = notched, left
    return best


def _least(
    a: NDArray[np.float32], side: int, names: tuple[int, ...], along: NDArray[np.float64], wanted: NDArray[np.float64]
) -> tuple[NDArray[np.float32], float]:
    """The attributes with those of `names` fitted, and the error left (root mean square, shaft lengths)."""
    columns = [name + side for name in names]
    low, high = (limit[columns].astype(np.float64) for limit in limits())
    trial = a.copy()

    def off(x: NDArray[np.float64]) -> NDArray[np.float64]:
        trial[columns] = x
        return _widths(trial, side, along) - wanted

    start = a[columns].astype(np.float64)
    usual = (1.0 + (2.0 * side - 1.0) * a[ASYMMETRY]) * (1.0 - 0.5 * a[TAPER])
    start[0] = max(float(wanted.max()), 1e-3) / max(usual, 0.1)
    start = np.clip(start, low + 1e-6, high - 1e-6)
    found = least_squares(off, start, bounds=(low, high), x_scale=high - low, diff_step=1e-3, max_nfev=40)
    out = a.copy()
    out[columns] = np.clip(found.x, low, high)
    return out, float(np.sqrt(np.mean(found.fun**2)))


def _widths(a: NDArray[np.float32], side: int, along: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.array([vane_width(a, side, edge) for edge in along])


def fitted_barb(values: NDArray[Any], side: int, line: NDArray[Any]) -> NDArray[np.float32]:
    """Attributes (K,) with the barbs of a side running as one that was drawn.

    Elsewhere they change as little as can be.

    Parameters
    ----------
    line : (N, 2), away from the shaft (any sign) and along it, in shaft lengths, from the shaft to the edge.

    Raises
    ------
    UserError
        The line does not lead from the shaft towards the edge.
    """
    drawn = np.stack([np.abs(np.asarray(line, np.float64)[:, 0]), np.asarray(line, np.float64)[:, 1]], axis=1)
    drawn = drawn[np.argsort(drawn[:, 0], kind="stable")]
    wide = float(drawn[-1, 0] - drawn[0, 0]) if len(drawn) > 2 else 0.0
    if wide < 0.005:
        raise UserError("This line is too short for a barb; draw it from the shaft to the edge of the vane.")
    a = np.array(values, np.float32)
    low, high = limits()
    edge = float(drawn[-1, 1])
    u = float(np.clip((edge - a[START + side]) / max(float(a[END + side] - a[START + side]), 1e-3), 0.0, 1.0))
    wanted = float(np.arctan2(wide, max(edge - drawn[0, 1], 1e-4)))
    columns, weights = [name + side for name in ANGLES], np.array([(1.0 - u) ** 2, 2.0 * u * (1.0 - u), u * u])
    missing = wanted - float(weights @ a[columns])
    a[columns] = np.clip(a[columns] + weights * missing / float(weights @ weights), low[columns], high[columns])
    share, rise = (drawn[:, 0] - drawn[0, 0]) / wide, max(edge - float(drawn[0, 1]), 1e-4)
    bow = share * share - share  # `along_barb` is a straight line and this, times the curve of the barb
    curve = float(((drawn[:, 1] - drawn[0, 1]) / rise - share) @ bow) / max(float(bow @ bow), 1e-9)
    a[BARB_CURVE + side] = np.clip(curve, low[BARB_CURVE + side], high[BARB_CURVE + side])
    return a
