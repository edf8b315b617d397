"""The coarse vane: a small grid of points for each of many feathers, for layering, instancing and the card."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from core.feather.attributes import SHAPE_NAMES
from core.feather.surface import (
    LENGTH,
    NODES,
    along_barb,
    edge_of_share,
    flat_to_feather,
    on_shaft,
    root_of_edge,
    shaft_table,
    vane_width,
)
from core.workers import serial_ranges

Ranges = Callable[..., None]
SHAPE_COLUMNS = {name: column for column, name in enumerate(SHAPE_NAMES)}
FOOT = 0.012  # half the width of the grid at the root, in shaft lengths: a calamus, so that no triangle there is empty
TABLE = types.Array(types.float32, 2, "C", readonly=True)


def vane_grids(
    values: NDArray[np.float32], rows: int = 8, columns: int = 5, ranges: Ranges = serial_ranges
) -> NDArray[np.float32]:
    """The coarse vanes of n feathers as grids in their own frames (x right, y along the shaft, z away from the skin).

    Parameters
    ----------
    values : (n, k) float32, k at least ``len(SHAPE_NAMES)``: the attributes that shape a feather, in the columns of
        ``SHAPE_COLUMNS`` (the first of every table of attributes). For shapes of length 1 set ``shaftLength`` to 1.
    rows : at least 3; the first one is the root in the skin, the last one the tip, where all columns meet; between
        they lie closer towards both ends.
    columns : odd, at least 3, from the left edge over the shaft to the right edge; along a row lies the way of a barb.

    Returns
    -------
    (n, rows, columns, 3) float32, in the unit of ``shaftLength``.
    """
    if values.ndim != 2 or values.shape[1] < len(SHAPE_NAMES):
        raise ValueError(f"vane_grids needs a table with at least {len(SHAPE_NAMES)} columns, not {values.shape}")
    if rows < 3 or columns < 3 or columns % 2 == 0:
        raise ValueError("vane_grids needs at least 3 rows, and 3, 5, 7 ... columns")
    table = np.ascontiguousarray(values, np.float32)
    out = np.empty((len(table), rows, columns, 3), np.float32)
    ranges(len(table), lambda start, stop: _grids(table, start, stop, out), grain=256)
    return out


@njit(
    types.void(TABLE, types.int64, types.int64, types.float32[:, :, :, ::1]), cache=True, nogil=True
)
def _grids(values: Any, start: int, stop: int, out: Any) -> None:
    shaft = np.empty((NODES, 12))
    rows, columns = out.shape[1], out.shape[2]
    middle = columns // 2
    for i in range(start, stop):
        a = values[i]
        shaft_table(a, shaft)
        length = np.float64(a[LENGTH])
        for c in range(columns):
            out[i, 0, c, 0], out[i, 0, c, 1], out[i, 0, c, 2] = on_shaft(shaft, 0.0, FOOT * (c - middle) / middle, 0.0)
        for r in range(1, rows):
            share = 0.5 - 0.5 * math.cos(math.pi * r / (rows - 1))
            left, right = edge_of_share(a, 0, share), edge_of_share(a, 1, share)
            wide_left, wide_right = vane_width(a, 0, left), vane_width(a, 1, right)
            root = 0.5 * (
                root_of_edge(a, 0, left, wide_left, 0.0) + root_of_edge(a, 1, right, wide_right, 0.0)
            )  # one for both sides, so that one column runs along the shaft
            for c in range(columns):
                side = 0 if c < middle else 1
                edge, wide = (left, wide_left) if side == 0 else (right, wide_right)
                s = abs(c - middle) / middle
                y = along_barb(a, side, root, edge, s)
                out[i, r, c, 0], out[i, r, c, 1], out[i, r, c, 2] = flat_to_feather(a, shaft, side, wide, wide * s, y)
        for r in range(rows):
            for c in range(columns):
                for k in range(3):
                    out[i, r, c, k] *= length
