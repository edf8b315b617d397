"""A narrow band of signed distances on a grid: collisions in a few nanoseconds a point."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from core.mesh.bvh import closest_on_triangle, closest_one, new_stack
from core.mesh.signed_distance import SignedSkin, build_signed_skin, is_inside
from core.workers import Workers, serial_ranges

F32_2D = types.Array(types.float32, 2, "C", readonly=True)
F32_3D = types.Array(types.float32, 3, "C", readonly=True)
I32_2D = types.Array(types.int32, 2, "C", readonly=True)
F64_1D = types.Array(types.float64, 1, "C", readonly=True)

DEFAULT_RESOLUTION = 200
DEFAULT_BAND_CELLS = 5
MAX_CELLS = 24_000_000  # 96 MB of float32
BLOCK = 6  # cells to a side of the blocks that are skipped whole


class DistanceField(NamedTuple):
    """Signed distances in metres at the grid points ``origin + cell * (i, j, k)``, negative inside.

    origin : (3,) float64, object space.
    cell : spacing of the grid.
    band : values are clamped to -band .. band; beyond it only the side is known.
    values : (nx, ny, nz) float32.
    """

    origin: NDArray[np.float64]
    cell: float
    band: float
    values: NDArray[np.float32]


def build_distance_field(
    points: NDArray[np.float32],
    triangles: NDArray[np.int32],
    cell: float | None = None,
    band: float | None = None,
    workers: Workers | None = None,
    skin: SignedSkin | None = None,
) -> DistanceField:
    """Sample the signed distance of `triangles` (T, 3) int32 over `points` (V, 3) float32.

    Parameters
    ----------
    cell : spacing in metres; the default is a 200th of the longest side of the bounding box. It is enlarged where the
        grid would take more than 96 MB.
    band : in metres; the default is 5 cells.
    skin : the prepared triangles, where the caller has them.

    Notes
    -----
    The sign follows `core.mesh.signed_distance`. An empty mesh gives a field that is +band everywhere.
    """
    used = points[np.unique(triangles)] if len(triangles) else np.zeros((0, 3), np.float32)
    used = used[np.isfinite(used).all(1)].astype(np.float64)
    if not len(used):
        band = 1.0 if band is None else band
        return DistanceField(np.zeros(3), 1.0, band, np.full((2, 2, 2), band, np.float32))
    low, high = used.min(0), used.max(0)
    longest = max(float((high - low).max()), 1e-6)
    if cell is None:
        cell = longest / DEFAULT_RESOLUTION
    fixed_band = band
    while True:
        band = DEFAULT_BAND_CELLS * cell if fixed_band is None else fixed_band
        padding = band + 1.5 * cell
        dims = np.ceil((high - low + 2 * padding) / cell).astype(np.int64) + 1
        if float(dims[0]) * float(dims[1]) * float(dims[2]) <= MAX_CELLS:
            break
        cell *= 1.1
    origin = low - padding
    if skin is None:
        skin = build_signed_skin(points, triangles)
    values = np.empty(tuple(int(n) for n in dims), np.float32)
    bvh = skin.bvh
    grid_band, grid_cell = float(band), float(cell)

    def columns(start: int, stop: int) -> None:
        _fill(
            bvh.boxes, bvh.children, bvh.corners, bvh.blocks, skin.pseudo, origin, grid_cell, grid_band,
            values, start, stop,
        )

    blocks = -(-values.shape[0] // BLOCK) * -(-values.shape[1] // BLOCK)
    (serial_ranges if workers is None else workers.ranges)(blocks, columns, 1)
    return DistanceField(origin, grid_cell, grid_band, values)


@njit(cache=True, nogil=True, error_model="numpy")
def _signed_from(boxes, children, corners, blocks, pseudo, origin, cell, i, j, k, guess, stack, keys):  # type: ignore[no-untyped-def]
    """Signed distance at a grid point and the slot of its closest triangle, starting from that of a neighbour."""
    x = np.float32(origin[0] + cell * i)
    y = np.float32(origin[1] + cell * j)
    z = np.float32(origin[2] + cell * k)
    limit2 = closest_on_triangle(corners, guess, np.float64(x), np.float64(y), np.float64(z))[0]
    limit2 = limit2 * (1.0 + 1e-6) + 1e-30 if math.isfinite(limit2) else np.inf
    slot, d2, b0, b1, b2 = closest_one(boxes, children, corners, blocks, x, y, z, limit2, stack, keys)
    if slot < 0:
        return np.inf, guess
    d = math.sqrt(d2)
    return (-d if is_inside(corners, pseudo, slot, b0, b1, b2, x, y, z) else d), slot


@njit(
    types.void(
        F32_2D, I32_2D, F32_2D, F32_3D, F32_3D, F64_1D, types.float64, types.float64, types.float32[:, :, ::1],
        types.int64, types.int64,
    ),
    cache=True, nogil=True, error_model="numpy",
)
def _fill(boxes, children, corners, blocks, pseudo, origin, cell, band, values, start, stop):  # type: ignore[no-untyped-def]
    """Fill the columns of blocks start .. stop, a column running along z."""
    nx, ny, nz = values.shape
    across = (ny + BLOCK - 1) // BLOCK
    stack, keys = new_stack()
    half = 0.5 * (BLOCK - 1)
    reach = half * math.sqrt(3.0) * cell * 1.001  # from the middle of a block to its farthest grid point
    slot = 0
    for column in range(start, stop):
        i0, j0 = (column // across) * BLOCK, (column % across) * BLOCK
        for k0 in range(0, nz, BLOCK):
            middle, slot = _signed_from(
                boxes, children, corners, blocks, pseudo, origin, cell, i0 + half, j0 + half, k0 + half, slot,
                stack, keys,
            )
            far = abs(middle) > band + reach
            fill = math.copysign(band, middle)
            for i in range(i0, min(nx, i0 + BLOCK)):
                for j in range(j0, min(ny, j0 + BLOCK)):
                    for k in range(k0, min(nz, k0 + BLOCK)):
                        d = fill
                        if not far:
                            d, slot = _signed_from(
                                boxes, children, corners, blocks, pseudo, origin, cell, i, j, k, slot, stack, keys
                            )
                        values[i, j, k] = min(max(d, -band), band)


@njit(cache=True, nogil=True, error_model="numpy")
def _locate(values, origin, cell, x, y, z):  # type: ignore[no-untyped-def]
    """The grid cell around a point and the place in it, held to the grid; a point that is not finite goes to 0."""
    nx, ny, nz = values.shape
    scale = 1.0 / cell
    fx, fy, fz = (x - origin[0]) * scale, (y - origin[1]) * scale, (z - origin[2]) * scale
    fx = min(fx, nx - 1.0) if fx > 0.0 else 0.0
    fy = min(fy, ny - 1.0) if fy > 0.0 else 0.0
    fz = min(fz, nz - 1.0) if fz > 0.0 else 0.0
    i, j, k = min(int(fx), nx - 2), min(int(fy), ny - 2), min(int(fz), nz - 2)
    return i, j, k, fx - i, fy - j, fz - k


@njit(cache=True, nogil=True, error_model="numpy")
def sample_field(values, origin, cell, x, y, z):  # type: ignore[no-untyped-def]
    """Trilinear signed distance at a point (kernel form); outside the grid that of the grid's border."""
    i, j, k, u, v, w = _locate(values, origin, cell, x, y, z)
    a00 = values[i, j, k] + w * (values[i, j, k + 1] - values[i, j, k])
    a01 = values[i, j + 1, k] + w * (values[i, j + 1, k + 1] - values[i, j + 1, k])
    a10 = values[i + 1, j, k] + w * (values[i + 1, j, k + 1] - values[i + 1, j, k])
    a11 = values[i + 1, j + 1, k] + w * (values[i + 1, j + 1, k + 1] - values[i + 1, j + 1, k])
    a0, a1 = a00 + v * (a01 - a00), a10 + v * (a11 - a10)
    return a0 + u * (a1 - a0)


@njit(cache=True, nogil=True, error_model="numpy")
def sample_gradient(values, origin, cell, x, y, z):  # type: ignore[no-untyped-def]
    """Value and gradient (value, gx, gy, gz) of `sample_field` (kernel form).

    The gradient points outwards; its length is near 1 within the band, 0 where the value is clamped.
    """
    i, j, k, u, v, w = _locate(values, origin, cell, x, y, z)
    c000, c001 = np.float64(values[i, j, k]), np.float64(values[i, j, k + 1])
    c010, c011 = np.float64(values[i, j + 1, k]), np.float64(values[i, j + 1, k + 1])
    c100, c101 = np.float64(values[i + 1, j, k]), np.float64(values[i + 1, j, k + 1])
    c110, c111 = np.float64(values[i + 1, j + 1, k]), np.float64(values[i + 1, j + 1, k + 1])
    a00, a01 = c000 + w * (c001 - c000), c010 + w * (c011 - c010)
    a10, a11 = c100 + w * (c101 - c100), c110 + w * (c111 - c110)
    a0, a1 = a00 + v * (a01 - a00), a10 + v * (a11 - a10)
    b0, b1 = c001 - c000 + v * (c011 - c010 - c001 + c000), c101 - c100 + v * (c111 - c110 - c101 + c100)
    gy = a01 - a00 + u * (a11 - a10 - a01 + a00)
    gz = b0 + u * (b1 - b0)
    scale = 1.0 / cell
    return a0 + u * (a1 - a0), (a1 - a0) * scale, gy * scale, gz * scale


def sample_points(field: DistanceField, queries: NDArray[np.float32]) -> NDArray[np.float32]:
    """Signed distances (N,) float32 of `queries` (N, 3) float32 read from the field."""
    out = np.empty(len(queries), np.float32)
    _sample_rows(field.values, field.origin, field.cell, np.ascontiguousarray(queries, np.float32), out)
    return out


@njit(types.void(F32_3D, F64_1D, types.float64, F32_2D, types.float32[::1]), cache=True, nogil=True)
def _sample_rows(values, origin, cell, queries, out):  # type: ignore[no-untyped-def]
    for i in range(len(queries)):
        out[i] = sample_field(values, origin, cell, queries[i, 0], queries[i, 1], queries[i, 2])
