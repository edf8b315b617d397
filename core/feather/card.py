"""The card: one bent sheet under a whole feather, with a picture of its barbs and how much they cover."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from core.feather.coloring import vane_mesh
from core.feather.pieces import FeatherMesh, Floats, grid_triangles, unit
from core.feather.surface import LENGTH, NODES, ROW, edge_of_share, flat_to_feather, shaft_table, vane_width

TEXELS = 512  # along the feather: a texel is a fifth of a percent of its length
SAMPLES = 2  # on a side of a texel, while its picture is taken
ROWS, COLUMNS = 25, 9
PLACES = types.Array(types.float32, 2, "C", readonly=True)


@njit(
    types.void(
        PLACES, PLACES, ROW, types.Array(types.int32, 2, "C", readonly=True), types.float64, types.float64, types.int64,
        types.float64[:, :, ::1],
    ), cache=True, nogil=True,
)
def _rasterize(flat, colors, opacity, triangles, corner_x, corner_y, scale, sums):  # type: ignore[no-untyped-def]
    """Triangles in the flat feather into (H, W, 4): sums of colour times cover, and cover; later ones lie over."""
    high, wide = sums.shape[:2]
    for t in range(len(triangles)):
        i, j, k = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        x0, y0 = (flat[i, 0] - corner_x) * scale, (flat[i, 1] - corner_y) * scale
        x1, y1 = (flat[j, 0] - corner_x) * scale, (flat[j, 1] - corner_y) * scale
        x2, y2 = (flat[k, 0] - corner_x) * scale, (flat[k, 1] - corner_y) * scale
        area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        if abs(area) < 1e-12:
            continue
        for y in range(max(int(np.floor(min(y0, y1, y2))), 0), min(int(np.ceil(max(y0, y1, y2))) + 1, high)):
            for x in range(max(int(np.floor(min(x0, x1, x2))), 0), min(int(np.ceil(max(x0, x1, x2))) + 1, wide)):
                px, py = x + 0.5, y + 0.5
                b = ((px - x0) * (y2 - y0) - (x2 - x0) * (py - y0)) / area
                c = ((x1 - x0) * (py - y0) - (px - x0) * (y1 - y0)) / area
                if b < 0.0 or c < 0.0 or b + c > 1.0:
                    continue
                cover = opacity[i]
                for n in range(3):
                    value = colors[i, n] * (1.0 - b - c) + colors[j, n] * b + colors[k, n] * c
                    sums[y, x, n] = sums[y, x, n] * (1.0 - cover) + value * cover
                sums[y, x, 3] = sums[y, x, 3] * (1.0 - cover) + cover


@njit(
    types.void(ROW, types.float64[::1], types.float64[::1], types.float64[::1], types.float64[:, :, ::1]),
    cache=True, nogil=True,
)
def _bend(a, across, along, widths, out):  # type: ignore[no-untyped-def]
    table = np.empty((NODES, 12))
    shaft_table(a, table)
    scale = np.float64(a[LENGTH])
    for r in range(len(along)):
        for c in range(len(across)):
            side = 0 if across[c] < 0.0 else 1
            p0, p1, p2 = flat_to_feather(a, table, side, widths[side], abs(across[c]), along[r])
            out[r, c, 0], out[r, c, 1], out[r, c, 2] = scale * p0, scale * p1, scale * p2


@njit(types.float64(ROW, types.int64), cache=True, nogil=True)
def _widest(a, side):  # type: ignore[no-untyped-def]
    wide = 1e-4
    for k in range(64):
        wide = max(wide, vane_width(a, side, edge_of_share(a, side, k / 63.0)))
    return wide


def card_of(values: Floats, fine: FeatherMesh) -> FeatherMesh:
    """The card of a feather of which `fine` is the level of barbs."""
    low = fine.flat.min(axis=0).astype(np.float64) - 2.0 / TEXELS
    extent = fine.flat.max(axis=0) + 2.0 / TEXELS - low
    picture = _picture(fine, low, extent)
    across = np.unique(np.concatenate([np.linspace(low[0], low[0] + extent[0], COLUMNS), [0.0]]))
    along = np.linspace(low[1], low[1] + extent[1], ROWS)
    widths = np.array([_widest(values, 0), _widest(values, 1)])
    grid = np.empty((ROWS, len(across), 3))
    _bend(values, across, along, widths, grid)
    up, right = (np.asarray(np.gradient(grid, axis=axis)) for axis in (0, 1))
    normals, fibres = unit(np.cross(right, up)), unit(right * np.sign(across)[None, :, None] + 0.8 * up)
    flat = np.stack(np.meshgrid(across, along), axis=-1)
    sides = (flat[..., 0] >= 0.0).astype(np.intp)
    places = np.stack([np.clip(flat[..., 1], 0.0, 1.0), np.clip(np.abs(flat[..., 0]) / widths[sides], 0.0, 1.0)], -1)
    rows = [np.ascontiguousarray(v.reshape(-1, v.shape[-1]), np.float32) for v in (grid, normals, fibres, places, flat)]
    count = len(rows[0])
    mesh = vane_mesh(
        values, 0, rows[0], rows[1], rows[2], grid_triangles(ROWS, len(across)), sides.reshape(-1), rows[3], rows[4],
        np.ones(count, np.float32), np.zeros(count, np.int32),
    )
    return mesh._replace(
        picture=picture, corner=(float(low[0]), float(low[1])), extent=(float(extent[0]), float(extent[1])),
        opacity=np.ones(count, np.float32),
    )


def _picture(fine: FeatherMesh, low: NDArray[Any], extent: NDArray[Any]) -> NDArray[np.uint8]:
    scale = TEXELS * SAMPLES
    high, wide = (int(np.ceil(extent[k] * TEXELS)) * SAMPLES for k in (1, 0))
    sums = np.zeros((high, wide, 4))
    _rasterize(fine.flat, fine.colors, fine.opacity, fine.triangles, low[0], low[1], scale, sums)
    small = sums.reshape(high // SAMPLES, SAMPLES, wide // SAMPLES, SAMPLES, 4).mean(axis=(1, 3))
    cover = small[..., 3:]
    linear = small[..., :3] / np.maximum(cover, 1e-6)
    shown = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 1e-9) ** (1.0 / 2.4) - 0.055)
    return np.asarray(np.clip(np.concatenate([shown, cover], axis=-1) * 255.0 + 0.5, 0.0, 255.0), np.uint8)
