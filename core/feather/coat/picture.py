"""A laid coat as it is drawn: every vane refined from its coarse grid, in the colours of what its place wears."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from core.feather.coat.coat import FeatherCoat
from core.feather.coat.winged import Laid
from core.feather.coat.worn import parts_of, worn_preset, worn_values
from core.feather.coloring import vane_mesh
from core.feather.pieces import FeatherMesh, Floats, grid_triangles, joined, unit
from core.feather.presets import load_preset
from core.random import rand

ROWS, COLUMNS = 19, 9  # of a vane as it is drawn: enough for bars and for the curve of an outline
VARIANTS = 16  # of the colours of one preset; neighbours by id never have the same
STREAKS = 0.3  # by which barbs differ in brightness
LOOSE = 0.45  # of the way from shaft to edge, and of the length at the tip: where barbs begin to come loose
ROUND = 0.45  # of a normal at the edge of a firm vane, outward
FIRM, FIRM_LOOSE = ("remex", "rectrix"), 0.93  # kinds of feathers that are closed almost to their edges


def coat_meshes(laid: Laid, coat: FeatherCoat, grid: tuple[int, int] = (ROWS, COLUMNS)) -> tuple[FeatherMesh, ...]:
    """The feathers shown as triangles in space, metres: one mesh for each preset the parts of the bird wear.

    grid : rows and columns of a vane, an odd number of columns.
    """
    return tuple(
        _worn(laid, rows, worn_values(coat, name), grid, FIRM_LOOSE if load_preset(name).kind in FIRM else LOOSE)
        for name, rows in rows_of_meshes(laid, coat))


def rows_of_meshes(laid: Laid, coat: FeatherCoat) -> list[tuple[str, NDArray[np.intp]]]:
    """For each mesh of :func:`coat_meshes` the preset its feathers wear, and their rows, in the order of vertices."""
    names = np.array([worn_preset(coat, part) for part in parts_of(coat)])
    shown = np.flatnonzero(laid.shown)
    rows = shown[np.argsort(laid.ids[shown] % VARIANTS, kind="stable")]
    wears = names[laid.bed.tract[rows].astype(np.intp)]
    turned = mirrored(laid.feathers.own)[rows]
    groups = [(str(name), rows[(wears == name) & (turned == side)]) for name in np.unique(wears) for side in (0, 1)]
    return [group for group in groups if len(group[1])]


def mirrored(own: Floats) -> NDArray[np.bool_]:
    """Which of the vanes (N, R, C, 3) have their left edge on the right, as those of the left wing."""
    middle = own.shape[1] // 2
    return np.asarray(own[:, middle, 0, 0] > own[:, middle, -1, 0])


def _worn(
    laid: Laid, rows: NDArray[np.intp], values: Floats, grid: tuple[int, int], loose: float
) -> FeatherMesh:
    """Feathers of one preset; feathers of a variant share the seed of their pattern."""
    variant = laid.ids[rows] % VARIANTS
    return joined([
        _alike(laid, rows[variant == seed], values, int(seed), grid, loose) for seed in np.unique(variant)
    ])


def _alike(
    laid: Laid, rows: NDArray[np.intp], values: Floats, seed: int, size: tuple[int, int], loose: float
) -> FeatherMesh:
    down, wide = size
    coarse = laid.layered.vanes[rows].astype(np.float64)
    up, across = _spline(coarse.shape[1], down), _spline(coarse.shape[2], wide)
    grid = np.einsum("ar,nrcx,bc->nabx", up, coarse, across, optimize=True)
    own = np.einsum("ar,rcx,bc->abx", up, laid.feathers.own[rows].mean(axis=0, dtype=np.float64), across)
    turned = own[own.shape[0] // 2, 0, 0] > 0.0  # a mirrored vane has the same pattern, and its upper side is up
    own[..., 0] *= -1.0 if turned else 1.0
    outward = np.gradient(grid, axis=2)
    outward[:, :, : wide // 2] *= -1.0
    along = np.gradient(grid, axis=1)
    normals = np.cross(np.gradient(grid, axis=2), along)
    normals *= np.sign(np.einsum("nabx,nx->nab", normals, laid.feathers.frames[rows][:, 2]))[..., None]
    share = np.abs(np.linspace(-1.0, 1.0, wide))
    if loose == FIRM_LOOSE:  # a quill lies flat in the wing, and still takes the light as a vane that is a little round
        normals = unit(normals) + ROUND * share[:, None] * unit(outward)
    count, vertices = len(rows), down * wide
    side = np.repeat((np.arange(wide) >= wide // 2)[None], down, axis=0).astype(np.intp).reshape(-1)
    place = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(own[:, wide // 2], axis=0), axis=1))])
    places = np.stack(np.meshgrid(place / place[-1], share, indexing="ij"), axis=-1).reshape(vertices, 2)
    barbs = np.repeat(np.arange(down), wide)
    chance = rand(np.arange(count)[:, None] * down + barbs, seed + 90)
    made = vane_mesh(
        values, seed, _flat(grid), _flat(unit(normals)), _flat(unit(outward)), _triangles(count, size, bool(turned)),
        np.tile(side, count), _flat(np.tile(places, (count, 1, 1))),
        _flat(np.tile(own[None, ..., :2], (count, 1, 1, 1))),
        (1.0 + STREAKS * (chance - 0.5)).reshape(-1).astype(np.float32), np.tile(barbs, count).astype(np.int32),
    )
    return made._replace(opacity=made.opacity * _closed(places, chance, loose))


def _closed(places: NDArray[np.float64], chance: NDArray[np.float64], loose: float) -> Floats:
    """How closed vanes are (N * size,): less towards edge and tip, where barbs stand apart, each by its own chance."""
    towards = np.maximum(places[:, 1], (places[:, 0] - loose) / (1.0 - loose))
    apart = np.clip((towards - loose) / (1.0 - loose), 0.0, 1.0) ** 1.5
    return np.asarray(1.0 - apart * (0.55 + 0.45 * chance), np.float32).reshape(-1)


def _spline(given: int, wanted: int) -> NDArray[np.float64]:
    """(wanted, given): what samples at even steps make of values at even steps along a natural cubic."""
    ends = np.linspace(0.0, 1.0, given)
    return np.asarray(CubicSpline(ends, np.eye(given), bc_type="natural")(np.linspace(0.0, 1.0, wanted)))


def _triangles(count: int, size: tuple[int, int], turned: bool) -> NDArray[np.int32]:
    one = grid_triangles(*size)[:, ::-1] if turned else grid_triangles(*size)
    first = np.arange(count, dtype=np.int64)[:, None, None] * (size[0] * size[1])
    return np.asarray((one + first).reshape(-1, 3), np.int32)


def _flat(values: NDArray[np.float64]) -> Floats:
    return np.ascontiguousarray(values.reshape(-1, values.shape[-1]), np.float32)
