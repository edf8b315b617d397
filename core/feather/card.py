"""The card: a bent sheet with a picture of a feather's barbs and their cover, its quill, and what stands off."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit, types
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator
from scipy.spatial import cKDTree

from core.feather.coloring import vane_mesh
from core.feather.pieces import FeatherMesh, Floats, grid_triangles, joined, unit
from core.feather.surface import LENGTH, NODES, ROW, edge_of_share, flat_to_feather, shaft_table, vane_width

TEXELS = 512  # along the feather: a texel is a fifth of a percent of its length
SAMPLES = 2  # on a side of a texel, while its picture is taken
ROWS, COLUMNS = 25, 9
NEAREST = 24  # vertices that say where a corner of the sheet lies
SWATCHES, SWATCH = 8, 4  # tones of what stands off the sheet, and texels of a side of each
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


class FlatPicture(NamedTuple):
    """A picture of a feather lying flat, over `FeatherMesh.flat` from `corner` with `extent`, in shaft lengths.

    picture : (H, W, 4) uint8, sRGB and opacity, the first row at the root.
    """

    picture: NDArray[np.uint8]
    corner: tuple[float, float]
    extent: tuple[float, float]


def flat_picture(fine: FeatherMesh) -> FlatPicture:
    """What `fine` looks like lying flat."""
    low = fine.flat.min(axis=0).astype(np.float64) - 2.0 / TEXELS
    wide, high = (int(np.ceil(v)) for v in (fine.flat.max(axis=0) + 2.0 / TEXELS - low) * TEXELS)
    sums = np.zeros((high * SAMPLES, wide * SAMPLES, 4))
    _rasterize(fine.flat, fine.colors, fine.opacity, fine.triangles, low[0], low[1], TEXELS * SAMPLES, sums)
    small = sums.reshape(high, SAMPLES, wide, SAMPLES, 4).mean(axis=(1, 3))
    cover = small[..., 3:]
    picture = np.concatenate([_shown(small[..., :3] / np.maximum(cover, 1e-6)), cover], axis=-1)
    corner, extent = (float(low[0]), float(low[1])), (wide / TEXELS, high / TEXELS)
    return FlatPicture(np.asarray(np.clip(picture * 255.0 + 0.5, 0.0, 255.0), np.uint8), corner, extent)


def card_of(values: Floats, shown: FeatherMesh, quill: FeatherMesh, standing: FeatherMesh | None) -> FeatherMesh:
    """The card of a feather.

    shown : its barbs and its quill, whose picture the card bears. quill : coarse, as a solid. standing : what a sheet
    cannot show, as down that stands off it; it keeps its form, and takes its tones from swatches beside the picture.
    """
    seen, parts = flat_picture(shown), [quill]
    if len(shown.points) > len(quill.points):
        parts = [_sheet(values, shown, seen), quill]
    if standing is not None:
        seen, flat = _with_swatches(seen, standing)
        parts.insert(0, standing._replace(flat=flat))
    parts = [part._replace(opacity=np.ones(len(part.points), np.float32)) for part in parts]
    return joined(parts)._replace(picture=seen.picture, corner=seen.corner, extent=seen.extent)


def _sheet(values: Floats, shown: FeatherMesh, seen: FlatPicture) -> FeatherMesh:
    """A grid bent as the feather is, drawn to where the barbs really lie."""
    (left, low), (wide, high) = seen.corner, seen.extent
    across = np.unique(np.concatenate([np.linspace(left, left + wide, COLUMNS), [0.0]]))
    along = np.linspace(low, low + high, ROWS)
    widths = np.array([_widest(values, 0), _widest(values, 1)])
    flat = np.stack(np.meshgrid(across, along), axis=-1)
    sides = (flat[..., 0] >= 0.0).astype(np.intp)
    grid = np.empty((ROWS, len(across), 3))
    _bend(values, across, along, widths, grid)
    near, index = cKDTree(shown.flat).query(flat.reshape(-1, 2), NEAREST)
    bent = _at(grid, flat, shown.flat)
    close = np.exp(-0.5 * (near / max(wide / COLUMNS, high / ROWS)) ** 2)
    off = ((shown.points - bent)[index] * close[..., None]).sum(axis=1) / (close.sum(axis=1) + 1e-3)[:, None]
    grid += off.reshape(grid.shape)
    up, right = (np.asarray(np.gradient(grid, axis=axis)) for axis in (0, 1))
    normals, fibres = unit(np.cross(right, up)), unit(right * np.sign(across)[None, :, None] + 0.8 * up)
    places = np.stack([np.clip(flat[..., 1], 0.0, 1.0), np.clip(np.abs(flat[..., 0]) / widths[sides], 0.0, 1.0)], -1)
    rows = [np.ascontiguousarray(v.reshape(-1, v.shape[-1]), np.float32) for v in (grid, normals, fibres, places, flat)]
    count = len(rows[0])
    return vane_mesh(
        values, 0, rows[0], rows[1], rows[2], grid_triangles(ROWS, len(across)), sides.reshape(-1), rows[3], rows[4],
        np.ones(count, np.float32), np.zeros(count, np.int32),
    )


def _at(grid: NDArray[Any], flat: NDArray[Any], places: Floats) -> NDArray[Any]:
    """Points (N, 3) of a sheet (R, C, 3), whose corners lie at `flat` (R, C, 2), at `places` (N, 2)."""
    between = RegularGridInterpolator((flat[:, 0, 1], flat[0, :, 0]), grid, bounds_error=False, fill_value=None)
    return np.asarray(between(places[:, ::-1].astype(np.float64)))


def _with_swatches(seen: FlatPicture, standing: FeatherMesh) -> tuple[FlatPicture, Floats]:
    """The picture with a row of swatches above it, and where in it the vertices of `standing` find theirs, (V, 2)."""
    light = standing.colors.sum(axis=1)
    low, high = float(light.min()), float(light.max())
    which = np.minimum(((light - low) / max(high - low, 1e-9) * SWATCHES).astype(int), SWATCHES - 1)
    old = seen.picture
    picture = np.zeros((len(old) + 2 * SWATCH, max(old.shape[1], SWATCHES * SWATCH), 4), np.uint8)
    picture[: len(old), : old.shape[1]] = old
    for k in range(SWATCHES):
        mine = which == k
        if mine.any():
            swatch = np.append(_shown(standing.colors[mine].mean(axis=0)), standing.opacity[mine].mean())
            picture[len(old) + SWATCH :, k * SWATCH : (k + 1) * SWATCH] = np.clip(swatch * 255.0 + 0.5, 1.0, 255.0)
    middle = np.stack([(which + 0.5) * SWATCH, np.full(len(which), len(old) + 1.5 * SWATCH)], axis=1)
    extent = (picture.shape[1] / TEXELS, len(picture) / TEXELS)
    return FlatPicture(picture, seen.corner, extent), np.asarray(middle / TEXELS + seen.corner, np.float32)


def _shown(linear: NDArray[Any]) -> NDArray[Any]:
    """Linear light as sRGB, 0 .. 1."""
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 1e-9) ** (1.0 / 2.4) - 0.055)
