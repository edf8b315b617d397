"""Places in the order of a space-filling curve, so that neighbours in memory are neighbours in space."""

from __future__ import annotations

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

F64_1D = types.Array(types.float64, 1, "C", readonly=True)
MORTON_BITS = 10  # of each axis, at most


def morton_codes(
    places: NDArray[np.floating], low: NDArray[np.float64], high: NDArray[np.float64], bits: int = MORTON_BITS
) -> NDArray[np.uint32]:
    """(N,) uint32: the cells of `places` (N, 3) along the curve, 2^bits of them along the box's longest side.

    Places beyond the box from `low` to `high` count to the cells at its border, those that are not finite to any.
    (G. M. Morton, "A computer oriented geodetic data base", 1966.)
    """
    cells = (1 << min(bits, MORTON_BITS)) - 1
    size = max(float((high - low).max()), 1e-30)
    codes = np.empty(len(places), np.uint32)
    _codes(np.ascontiguousarray(places), np.ascontiguousarray(low, np.float64), size, float(cells), codes)
    return codes


@njit(cache=True, inline="always")
def _spread(cell):  # type: ignore[no-untyped-def]
    """Ten bits with two empty ones after each."""
    cell = (cell | (cell << np.uint32(16))) & np.uint32(0x030000FF)
    cell = (cell | (cell << np.uint32(8))) & np.uint32(0x0300F00F)
    cell = (cell | (cell << np.uint32(4))) & np.uint32(0x030C30C3)
    return (cell | (cell << np.uint32(2))) & np.uint32(0x09249249)


@njit(
    [
        types.void(
            types.Array(real, 2, "C", readonly=True), F64_1D, types.float64, types.float64, types.uint32[::1]
        )
        for real in (types.float32, types.float64)
    ],
    cache=True, nogil=True, error_model="numpy",
)
def _codes(places, low, size, cells, codes):  # type: ignore[no-untyped-def]
    for i in range(len(places)):
        code = np.uint32(0)
        for axis in range(3):
            along = (places[i, axis] - low[axis]) / size * cells
            cell = np.uint32(min(along, cells)) if along > 0.0 else np.uint32(0)
            code |= _spread(cell) << np.uint32(axis)
        codes[i] = code
