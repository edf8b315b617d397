"""The coarse outline of a contour feather, for coats whose preset says no more than how long and wide feathers are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

ROWS, COLUMNS = 9, 5
CALAMUS = 0.04  # of the length, bare


def coarse_vanes(half_width: NDArray[np.float64], rows: int = ROWS, columns: int = COLUMNS) -> NDArray[np.float32]:
    """Vanes (N, rows, columns, 3) float32 at length 1 of half widths (N,), in their own frames: x right, y along."""
    s = np.linspace(CALAMUS, 1.0, rows)
    width = np.minimum(1.0, np.sqrt(s / 0.3)) * np.sqrt(np.clip(1.0 - ((s - 0.45) / 0.56) ** 2, 0.0, 1.0))
    out = np.zeros((len(half_width), rows, columns, 3), np.float32)
    out[..., 0] = half_width[:, None, None] * np.maximum(width, 0.03)[None, :, None] * np.linspace(-1.0, 1.0, columns)
    out[..., 1] = s[None, :, None]
    return out
