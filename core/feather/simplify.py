"""Which points a line of points cannot do without."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit, types
from numpy.typing import NDArray


@njit(
    types.void(types.Array(types.float64, 2, "C", readonly=True), types.float64, types.boolean[::1]),
    cache=True, nogil=True,
)
def _keep(line, tolerance, kept):  # type: ignore[no-untyped-def]
    stack = np.empty((len(line) + 1, 2), np.int64)
    stack[0, 0], stack[0, 1] = 0, len(line) - 1
    depth = 1
    size = line.shape[1]
    while depth > 0:
        depth -= 1
        first, last = stack[depth, 0], stack[depth, 1]
        along2 = 0.0
        for k in range(size):
            along2 += (line[last, k] - line[first, k]) ** 2
        worst, at = tolerance * tolerance, -1
        for i in range(first + 1, last):
            dot = off2 = 0.0
            for k in range(size):
                dot += (line[i, k] - line[first, k]) * (line[last, k] - line[first, k])
            f = min(max(dot / along2, 0.0), 1.0) if along2 > 0.0 else 0.0
            for k in range(size):
                off2 += (line[i, k] - line[first, k] - f * (line[last, k] - line[first, k])) ** 2
            if off2 > worst:
                worst, at = off2, i
        if at > 0:
            kept[at] = True
            stack[depth, 0], stack[depth, 1] = first, at
            stack[depth + 1, 0], stack[depth + 1, 1] = at, last
            depth += 2


def kept_of_line(line: NDArray[np.float64], tolerance: float) -> NDArray[Any]:
    """Mask (N,) of the points of a line (N, K) that no more than `tolerance` from it may be left out
    (Douglas and Peucker 1973)."""
    kept = np.zeros(len(line), bool)
    if len(line):
        kept[[0, -1]] = True
        _keep(np.ascontiguousarray(line, np.float64), tolerance, kept)
    return kept
