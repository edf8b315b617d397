"""A laid coat as curves: the shafts, or the shafts with all their barbs, expanded a few feathers at a time.

A barb is expanded in its feather's own frame and carried by the laid vane: the vane's grid runs along the ways of
barbs (``core.feather.vane``), so a barb's end names a row and its way out a column. What sets it apart from that
place of the grid at rest (its own root, stray, lift) turns with the shaft. Feathers bent by hand, of wings and of
tails take the same way, as only their laid vanes differ. Attributes are those of the type a feather wears; its
outline is the laid one.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from core.feather.attributes import COLUMNS, column
from core.feather.barbs import Barbs, condense, expand
from core.feather.coat.coat import FeatherCoat
from core.feather.coat.picture import VARIANTS, mirrored
from core.feather.coat.winged import Laid
from core.feather.coat.worn import parts_of, worn_preset, worn_values
from core.feather.pattern import vane_colors
from core.feather.vane import vane_grids

Floats = NDArray[np.float32]
CHUNK = 128  # feathers expanded at once
BARB_POINTS = 5  # of a barb
LEFT, SHAFT, RIGHT = -1, 0, 1


class FeatherCurves(NamedTuple):
    """Curves of some feathers of one type; feather by feather, the shaft first, then barbs from base to tip.

    kind : the preset they wear. counts : (S,) int32, points of each. points : (P, 3) float32, metres, root first.
    widths : (P,) float32, diameters in metres. colors : (P, 3) float32, linear. feathers : (S,) int32, ids.
    rows : (S,) int32, of the feather in the laid coat. barbs : (S,) int32, number on its side from the base, -1 for a
    shaft. sides : (S,) int32, -1 left, 0 shaft, 1 right. st : (P, 2) float32, across (0 left edge, 0.5 shaft, 1 right
    edge) and base to tip.
    """

    kind: str
    counts: NDArray[np.int32]
    points: Floats
    widths: Floats
    colors: Floats
    feathers: NDArray[np.int32]
    rows: NDArray[np.int32]
    barbs: NDArray[np.int32]
    sides: NDArray[np.int32]
    st: Floats


class BarbedFeather(NamedTuple):
    """One laid feather with its barbs.

    barbs : (B, P, 3) float32, metres. sides : (B,) int32, -1 or 1. numbers : (B,) int32, within their side.
    widths : (B, P) float32. colors : (B, P, 3) float32. st : (B, P, 2) float32. along : (B,) float64, rows of the
    grid as a share, where barbs end.
    """

    barbs: Floats
    sides: NDArray[np.int32]
    numbers: NDArray[np.int32]
    widths: Floats
    colors: Floats
    st: Floats
    along: NDArray[np.float64]


def kinds_of(laid: Laid, coat: FeatherCoat) -> tuple[list[str], NDArray[np.int32]]:
    """The presets a coat's feathers wear, sorted, and for every row of the coat (N,) int32 which of them."""
    parts = [worn_preset(coat, part) for part in parts_of(coat)]
    names = sorted(set(parts))
    of_part = np.array([names.index(name) for name in parts], np.int32)
    return names, of_part[laid.bed.tract.astype(np.intp)]


def coat_curves(
    laid: Laid, coat: FeatherCoat, barbs: bool, most: int | None = None, points: int = BARB_POINTS, chunk: int = CHUNK
) -> Iterator[FeatherCurves]:
    """The feathers shown as curves, type by type, at most `chunk` feathers at once, so that memory stays bounded.

    Parameters
    ----------
    barbs : with them, or the shafts alone. most : barbs a side kept, evenly and wider by what is left out; None keeps
        all. points : of a barb, at least 2.
    """
    names, kinds = kinds_of(laid, coat)
    shown = np.flatnonzero(laid.shown)
    for number, name in enumerate(names):
        values = worn_values(coat, name)
        rows = shown[kinds[shown] == number]
        for first in range(0, len(rows), chunk):
            some = rows[first : first + chunk]
            feathers = barbed(laid, some, values, most, points) if barbs else None
            yield _joined(name, laid, some, values, feathers)


def barbed(
    laid: Laid, rows: NDArray[np.intp], values: Floats, most: int | None, points: int
) -> list[BarbedFeather]:
    """The barbs of feathers of one type as they lie: rows (n,) of the coat, values (K,) of the type."""
    unit = values.copy()
    unit[COLUMNS["shaftLength"]] = 1.0
    shape = laid.layered.vanes.shape[1:3]
    own = vane_grids(unit[None], *shape)[0].astype(np.float64)
    lengths = _lengths(laid.layered.vanes[rows])
    whole = float(_lengths(own[None].astype(np.float32))[0])
    condensed = condense(np.tile(unit, (len(rows), 1)), laid.ids[rows])
    flipped = mirrored(laid.feathers.own)[rows]
    return [
        _one(unit, own, laid.layered.vanes[row].astype(np.float64), condensed, k, float(lengths[k]) / whole,
             bool(flipped[k]), int(laid.ids[row]), most, points)
        for k, row in enumerate(rows)
    ]


def _one(
    unit: Floats, own: NDArray[np.float64], vane: NDArray[np.float64], condensed: Barbs, number: int, scale: float,
    flipped: bool, feather: int, most: int | None, points: int,
) -> BarbedFeather:
    curves = expand(unit, condensed, number, points)
    begin, end = int(condensed.starts[number]), int(condensed.starts[number + 1])
    sides = curves.sides
    counts = np.array([(sides == 0).sum(), (sides == 1).sum()])
    numbers = np.concatenate([np.arange(counts[0]), np.arange(counts[1])]).astype(np.int32)
    wider = np.ones(2)
    kept = np.arange(end - begin)
    if most is not None and counts.max(initial=0) > most:
        wider = np.maximum(counts / max(most, 1), 1.0)
        chosen = [np.unique(np.floor((np.arange(min(most, n)) + 0.5) * n / min(most, n)).astype(np.intp))
                  if min(most, n) else np.zeros(0, np.intp) for n in counts]
        kept = np.concatenate([chosen[0], counts[0] + chosen[1]])
    sides, numbers = sides[kept], numbers[kept]
    share = condensed.place[begin:end][kept].astype(np.float64) / 65535.0
    along: NDArray[np.float64] = np.arccos(np.clip(1.0 - 2.0 * share, -1.0, 1.0)) / np.pi
    out = curves.places[kept, :, 1].astype(np.float64)
    sign = 2.0 * sides - 1.0
    across = 0.5 + 0.5 * sign[:, None] * np.clip(out, 0.0, 1.0)
    up = spline(len(own), along)
    over = spline(own.shape[1], np.asarray(across, np.float64).reshape(-1)).reshape(*across.shape, own.shape[1])
    mirror = np.array([-1.0 if flipped else 1.0, 1.0, 1.0])
    rest = np.einsum("bpc,bcx->bpx", over, np.einsum("br,rcx->bcx", up, own))
    apart = (curves.points[kept] - rest) * mirror * scale
    turns = np.einsum("br,rxy->bxy", _linear(len(own), along), _turns(own * mirror, vane))
    laid = np.einsum("bpc,bcx->bpx", over, np.einsum("br,rcx->bcx", up, vane))
    made = laid + np.einsum("bxy,bpy->bpx", turns, apart)
    tones = (condensed.tone[begin:end][kept] & 0xFE).astype(np.float32) / 128.0
    colors = vane_colors(
        unit, np.repeat(sides, points), curves.places[kept].reshape(-1, 2), feather % VARIANTS)
    taper = 1.0 - unit[column("barbTaper*") + sides][:, None] * np.linspace(0.0, 1.0, points)
    size = float(_lengths(vane[None].astype(np.float32))[0])
    widths = 2.0 * size * (unit[column("barbRadius*") + sides] * wider[sides])[:, None] * taper
    st = np.stack([across, curves.places[kept, :, 0].astype(np.float64)], axis=-1)
    return BarbedFeather(
        made.astype(np.float32), sign.astype(np.int32), numbers, widths.astype(np.float32),
        (colors.reshape(*out.shape, 3) * tones[:, None, None]).astype(np.float32), st.astype(np.float32), along)


def shaft_looks(values: Floats, rows: int) -> tuple[Floats, Floats]:
    """Of a shaft of `rows` points: radii (rows,) in shaft lengths, and colours (rows, 3), from root to tip."""
    share = np.linspace(0.0, 1.0, rows)
    radii = values[COLUMNS["shaftRadius"]] * (1.0 - share) + values[COLUMNS["shaftRadiusTip"]] * share
    root, tip = (values[COLUMNS[name] : COLUMNS[name] + 3] for name in ("shaftColorRootRed", "shaftColorTipRed"))
    return radii.astype(np.float32), ((1.0 - share)[:, None] * root + share[:, None] * tip).astype(np.float32)


def shaft_frames(vane: NDArray[np.float64]) -> NDArray[np.float64]:
    """Frames (R, 3, 3) of the rows of a vane (R, C, 3): columns right (across), along, out."""
    along = np.gradient(vane[:, vane.shape[1] // 2], axis=0)
    across = vane[:, -1] - vane[:, 0]
    across[-1] = across[-2]  # all columns meet in the tip
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-30)
    across -= (across * along).sum(axis=1, keepdims=True) * along
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-30)
    return np.stack([across, along, np.cross(across, along)], axis=2)


def spline(given: int, places: NDArray[np.float64]) -> NDArray[np.float64]:
    """(P, given): what samples at `places` (P,) in 0 .. 1 make of values at even steps along a natural cubic."""
    return np.asarray(CubicSpline(np.linspace(0.0, 1.0, given), np.eye(given), bc_type="natural")(places))


def _linear(given: int, places: NDArray[np.float64]) -> NDArray[np.float64]:
    at = np.clip(places, 0.0, 1.0) * (given - 1)
    return np.asarray(np.maximum(1.0 - np.abs(at[:, None] - np.arange(given)), 0.0))


def _turns(own: NDArray[np.float64], vane: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotations (R, 3, 3) of the rows of a vane from its own frame to where it lies."""
    return np.asarray(shaft_frames(vane) @ np.swapaxes(shaft_frames(own), 1, 2))


def _lengths(vanes: Floats) -> NDArray[np.float64]:
    shafts = vanes[:, :, vanes.shape[2] // 2].astype(np.float64)
    return np.asarray(np.linalg.norm(np.diff(shafts, axis=1), axis=2).sum(axis=1))


def _joined(
    kind: str, laid: Laid, rows: NDArray[np.intp], values: Floats, feathers: list[BarbedFeather] | None
) -> FeatherCurves:
    vanes = laid.layered.vanes[rows]
    shafts = vanes[:, :, vanes.shape[2] // 2]
    many = shafts.shape[1]
    radii, colors = shaft_looks(values, many)
    widths = (2.0 * _lengths(vanes)[:, None] * radii).astype(np.float32)
    share = (0.5 - 0.5 * np.cos(np.pi * np.linspace(0.0, 1.0, many))).astype(np.float32)
    st = np.stack([np.full(many, 0.5, np.float32), share], axis=1)
    parts: list[tuple[NDArray[np.generic], ...]] = []
    for k, row in enumerate(rows):
        parts.append((
            np.array([many]), shafts[k], widths[k], colors, np.array([row]), np.array([-1]), np.array([SHAFT]), st))
        if feathers is not None and len(feathers[k].sides):
            one = feathers[k]
            count, points = one.barbs.shape[:2]
            parts.append((
                np.full(count, points), one.barbs.reshape(-1, 3), one.widths.reshape(-1), one.colors.reshape(-1, 3),
                np.full(count, row), one.numbers, one.sides, one.st.reshape(-1, 2)))
    counts, places, wide, tint, of, numbers, sides, across = (
        np.concatenate([part[k] for part in parts]) for k in range(8))
    at = of.astype(np.int32)
    return FeatherCurves(
        kind, counts.astype(np.int32), places.astype(np.float32), wide.astype(np.float32), tint.astype(np.float32),
        laid.ids[at], at, numbers.astype(np.int32), sides.astype(np.int32), across.astype(np.float32))
