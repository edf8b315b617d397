"""Strands on the screen: every point in pixels, and the box around each strand."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from core.groom.region import View

FAR = 1e9  # pixels, where points behind the eye are put


def _array(dtype: Any, dims: int, readonly: bool = False) -> Any:
    return types.Array(dtype, dims, "C", readonly=readonly)


@njit(
    types.void(
        _array(types.float32, 3, True), _array(types.float64, 2, True), types.float64, types.float64,
        _array(types.float64, 3), _array(types.float64, 2), _array(types.float64, 2),
    ),
    cache=True, nogil=True, error_model="numpy",
)
def _project(points: Any, m: Any, width: float, height: float, pixels: Any, low: Any, high: Any) -> None:
    for i in range(points.shape[0]):
        low_x = low_y = FAR
        high_x = high_y = -FAR
        for k in range(points.shape[1]):
            x, y, z = np.float64(points[i, k, 0]), np.float64(points[i, k, 1]), np.float64(points[i, k, 2])
            w = m[3, 0] * x + m[3, 1] * y + m[3, 2] * z + m[3, 3]
            u = v = FAR
            if w > 0.0:
                per = 1.0 / max(w, 1e-12)
                u = 0.5 * width * (1.0 + (m[0, 0] * x + m[0, 1] * y + m[0, 2] * z + m[0, 3]) * per) - 0.5
                v = 0.5 * height * (1.0 - (m[1, 0] * x + m[1, 1] * y + m[1, 2] * z + m[1, 3]) * per) - 0.5
            pixels[i, k, 0], pixels[i, k, 1] = u, v
            low_x, low_y = min(low_x, u), min(low_y, v)
            high_x, high_y = max(high_x, u), max(high_y, v)
        low[i, 0], low[i, 1], high[i, 0], high[i, 1] = low_x, low_y, high_x, high_y


def project_strands(
    points: NDArray[np.float32], view: View
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Pixels (G, P, 2) of strands (G, P, 3) in object space, and the lowest and highest (G, 2) of each.

    Points behind the eye are :data:`FAR` away in both directions. As :meth:`View.pixels`, thirty times as fast.
    """
    p = np.ascontiguousarray(points, np.float32)
    m = np.ascontiguousarray(view.clip_from_object, np.float64)
    pixels = np.empty((*p.shape[:2], 2))
    low, high = np.empty((len(p), 2)), np.empty((len(p), 2))
    _project(p, m, float(view.width), float(view.height), pixels, low, high)
    return pixels, low, high
