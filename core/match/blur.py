"""Motion blur: a pattern that moves while the shutter is open is compared with a template blurred alike."""

from __future__ import annotations

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from core.match.template import Templates, spline_coefficients

SHORTEST = 0.7  # pixels of a line that is worth blurring for
LONGEST = 16.0
TAPS = 7


def motion_lines(warp: NDArray[np.float64], moved: NDArray[np.float64]) -> NDArray[np.float64]:
    """Lines (N, 2) in template pixels that points moving by `moved` (N, 2) in the frame are smeared over."""
    return np.einsum("nij,nj->ni", warp[:, 2:6].reshape(-1, 2, 2), moved)


def blurred(
    templates: Templates, rows: NDArray[np.int64], now: NDArray[np.float64], key: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Coefficients of all templates, those of `rows` smeared by what `now` exceeds the smear `key` they were cut with.

    A line of length L has the covariance L^2 / 12 along it; what `now` (M, 2) has more than `key` (M, 2) is put on as
    a line along its greatest axis. A frame sharper than its key is compared as it is.
    """
    more = now[:, :, None] * now[:, None] - key[:, :, None] * key[:, None]
    values, vectors = np.linalg.eigh(more)
    length = np.sqrt(np.maximum(values[:, 1], 0.0))
    wanted = np.flatnonzero(length > SHORTEST)
    if not len(wanted):
        return templates.coefficients
    lines = np.ascontiguousarray(vectors[wanted, :, 1] * np.minimum(length[wanted], LONGEST)[:, None])
    patches = np.empty((len(wanted), *templates.coefficients.shape[1:]))
    smear(templates.coefficients, np.ascontiguousarray(rows[wanted]), lines, patches)
    out = templates.coefficients.copy()
    out[rows[wanted]] = spline_coefficients(patches)
    return out


F32_4D = types.Array(types.float32, 4, "C", readonly=True)
I64_1D = types.Array(types.int64, 1, "C", readonly=True)
f64 = types.float64


@njit(types.void(F32_4D, I64_1D, f64[:, ::1], f64[:, :, :, ::1]), cache=True, nogil=True, error_model="numpy")
def smear(coefs, rows, lines, out):  # type: ignore[no-untyped-def]
    """Values of the splines `coefs` (N, S, S, C) of `rows` at their grid, averaged along `lines` (M, 2), into `out`.

    All taps together are one stencil on the coefficients, the same at every point of the grid.
    """
    side, channels = coefs.shape[1], coefs.shape[3]
    reach = int(LONGEST) // 2 + 2
    stencil = np.zeros((2 * reach + 1, 2 * reach + 1))
    wx, wy = np.empty(4), np.empty(4)
    for k in range(len(rows)):
        stencil[:] = 0.0
        for tap in range(TAPS):
            along = (tap + 0.5) / TAPS - 0.5
            x, y = along * lines[k, 0], along * lines[k, 1]
            i, j = int(np.floor(x)), int(np.floor(y))
            for w, t in ((wx, x - i), (wy, y - j)):
                w[0], w[3] = (1.0 - t) ** 3 / 6.0, t**3 / 6.0
                w[1] = (4.0 - 6.0 * t * t + 3.0 * t**3) / 6.0
                w[2] = 1.0 - w[0] - w[1] - w[3]
            for q in range(4):
                for p in range(4):
                    stencil[reach + j + q - 1, reach + i + p - 1] += wy[q] * wx[p] / TAPS
        out[k] = 0.0
        for q in range(2 * reach + 1):
            for p in range(2 * reach + 1):
                weight = stencil[q, p]
                if weight == 0.0:
                    continue
                for y in range(side):
                    row = min(max(y + q - reach, 0), side - 1)
                    for x in range(side):
                        column = min(max(x + p - reach, 0), side - 1)
                        for c in range(channels):
                            out[k, y, x, c] += weight * coefs[rows[k], row, column, c]
