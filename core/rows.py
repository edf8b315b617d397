"""Which rows of an array changed, compared as bits, and the change packed so that it serves both ways."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit, types
from numpy.typing import NDArray


def _signature(word: Any) -> Any:
    rows = types.Array(word, 2, "C", readonly=True)
    return types.void(rows, rows, types.Array(types.boolean, 1, "C"))


@njit([_signature(types.uint64), _signature(types.uint32), _signature(types.uint8)], cache=True, nogil=True)
def _mark(old: Any, new: Any, changed: Any) -> None:
    # One OR over the row and a single branch: an early way out would cost the vector instructions.
    for i in range(old.shape[0]):
        bits = old[i, 0] ^ old[i, 0]
        for k in range(old.shape[1]):
            bits |= old[i, k] ^ new[i, k]
        changed[i] = bits != 0


def bytes_of_rows(array: NDArray[Any]) -> NDArray[np.uint8]:
    """A C-contiguous (N, ...) array seen as (N, bytes of a row) uint8, sharing memory."""
    n = array.shape[0]
    width = array.nbytes // n if n else 0
    return array.reshape(-1).view(np.uint8).reshape(n, width)


def changed_rows(old: NDArray[Any], new: NDArray[Any]) -> NDArray[np.int32]:
    """Rows whose bits differ (so -0 differs from 0, and a NaN equals itself).

    Parameters
    ----------
    old, new : (N, ...) of the same shape and dtype.

    Returns
    -------
    (K,) int32, ascending.

    Raises
    ------
    ValueError
        When shape or dtype differ.
    """
    if old.shape != new.shape or old.dtype != new.dtype or old.ndim == 0:
        raise ValueError("changed_rows compares two arrays of the same shape and dtype")
    if old is new or old.size == 0:
        return np.empty(0, np.int32)
    a, b = bytes_of_rows(np.ascontiguousarray(old)), bytes_of_rows(np.ascontiguousarray(new))
    width = a.shape[1]
    word: Any = np.uint64 if width % 8 == 0 else np.uint32 if width % 4 == 0 else np.uint8
    a, b = a.view(word), b.view(word)
    if not (a.flags.aligned and b.flags.aligned):
        return np.flatnonzero((a != b).any(axis=1)).astype(np.int32)
    changed = np.empty(len(a), np.bool_)
    _mark(a, b, changed)
    return np.flatnonzero(changed).astype(np.int32)


class RowChange(NamedTuple):
    """`bits` (K, bytes of a row) uint8 = old XOR new of the rows (K,) int32; the same record leads either way."""

    rows: NDArray[np.int32]
    bits: NDArray[np.uint8]

    @property
    def nbytes(self) -> int:
        return self.rows.nbytes + self.bits.nbytes


def row_change(old: NDArray[Any], new: NDArray[Any]) -> RowChange:
    """The packed difference of two arrays of the same shape and dtype."""
    rows = changed_rows(old, new)
    if not len(rows):
        return RowChange(rows, np.empty((0, 0), np.uint8))
    a, b = bytes_of_rows(np.ascontiguousarray(old)), bytes_of_rows(np.ascontiguousarray(new))
    return RowChange(rows, a[rows] ^ b[rows])


def flip_rows(array: NDArray[Any], change: RowChange) -> None:
    """Turn `array` (writable, C-contiguous) from old into new or from new into old, in place."""
    if len(change.rows):
        bytes_of_rows(array)[change.rows] ^= change.bits
