"""A laid coat in Houdini's condensed form of feathers: polylines of shafts, whose points carry their barbs as arrays.

The layout is that which SideFX's public scene indices expand (HoudiniUsdBridge, ``HD_HairDeformUtils``): every point
of a shaft has one barb a side of the same number of points; ``P_barbl`` and ``P_barbr`` are kept relative to the point
of the shaft, in the frame that the quaternion ``barborient`` turns to object space; all others (``width_barbl``,
``uv_barbl``, ``Cd_barbl``) are plain values. Barbs of a shaft are paired from base to tip; where a side
has fewer, and at root and tip, a barb has no length.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from core.feather.coat.coat import FeatherCoat
from core.feather.coat.curves import (
    BARB_POINTS,
    CHUNK,
    LEFT,
    RIGHT,
    BarbedFeather,
    barbed,
    kinds_of,
    shaft_frames,
    shaft_looks,
    spline,
)
from core.feather.coat.winged import Laid
from core.feather.coat.worn import worn_values

Floats = NDArray[np.float32]


class CondensedFeathers(NamedTuple):
    """Some feathers of one type: S shafts of P points together, M points to a barb.

    kind : the preset they wear. counts : (S,) int32. points : (P, 3) float32, metres. widths : (P,) float32, diameters.
    colors : (P, 3) float32, linear. st : (P, 2) float32. orients : (P, 4) float32, quaternions w, x, y, z of right,
    along, out. feathers, rows : (S,) int32, ids and rows of the laid coat. barbs, barb_widths, barb_st, barb_colors :
    left and right, (P, M, 3), (P, M), (P, M, 2) and (P, M, 3) float32, points of barbs in the frames of `orients`.
    """

    kind: str
    counts: NDArray[np.int32]
    points: Floats
    widths: Floats
    colors: Floats
    st: Floats
    orients: Floats
    feathers: NDArray[np.int32]
    rows: NDArray[np.int32]
    barbs: tuple[Floats, Floats]
    barb_widths: tuple[Floats, Floats]
    barb_st: tuple[Floats, Floats]
    barb_colors: tuple[Floats, Floats]


def coat_condensed(
    laid: Laid, coat: FeatherCoat, most: int | None = None, points: int = BARB_POINTS, chunk: int = CHUNK
) -> Iterator[CondensedFeathers]:
    """The feathers shown, condensed, type by type and at most `chunk` at once; parameters as of ``coat_curves``."""
    names, kinds = kinds_of(laid, coat)
    shown = np.flatnonzero(laid.shown)
    for number, name in enumerate(names):
        values = worn_values(coat, name)
        rows = shown[kinds[shown] == number]
        for first in range(0, len(rows), chunk):
            some = rows[first : first + chunk]
            feathers = barbed(laid, some, values, most, points)
            made = [
                _one(feather, laid.layered.vanes[row].astype(np.float64), values)
                for feather, row in zip(feathers, some, strict=True)
            ]
            points_of = [len(one[0]) for one in made]
            c = [np.concatenate(column).astype(np.float32) for column in zip(*made, strict=True)]
            yield CondensedFeathers(
                name, np.array(points_of, np.int32), c[0], c[1], c[2], c[3], c[4], laid.ids[some],
                some.astype(np.int32), (c[5], c[6]), (c[7], c[8]), (c[9], c[10]), (c[11], c[12]))


def _one(feather: BarbedFeather, vane: NDArray[np.float64], values: Floats) -> tuple[NDArray[np.float64], ...]:
    """Columns of one feather: points, widths, colors, st, orients, then of barbs left and right."""
    many = feather.barbs.shape[1]
    sides = [np.flatnonzero(feather.sides == side) for side in (LEFT, RIGHT)]
    pairs = max(len(rows) for rows in sides)
    sums, found = np.zeros(pairs), np.zeros(pairs)
    for rows in sides:
        sums[: len(rows)] += feather.along[rows]
        found[: len(rows)] += 1.0
    along = np.concatenate([[0.0], sums / np.maximum(found, 1.0), [1.0]])
    shaft = spline(len(vane), along) @ vane[:, vane.shape[1] // 2]
    turns = _turns(vane, along)
    x, y, z, w = Rotation.from_matrix(turns).as_quat().T
    radii, colors = shaft_looks(values, len(along))
    length = np.linalg.norm(np.diff(vane[:, vane.shape[1] // 2], axis=0), axis=1).sum()
    st = np.stack([np.full(len(along), 0.5), 0.5 - 0.5 * np.cos(np.pi * along)], axis=1)
    of_barbs: list[list[NDArray[np.float64]]] = [[], [], [], []]
    for rows in sides:
        part = slice(1, 1 + len(rows))
        away = np.zeros((len(along), many, 3))
        away[part] = np.einsum("bxy,bpx->bpy", turns[part], feather.barbs[rows] - shaft[part, None])
        widths = np.zeros((len(along), many))
        widths[part] = feather.widths[rows]
        places = np.repeat(st[:, None], many, axis=1)
        places[part] = feather.st[rows]
        tints = np.repeat(colors[:, None].astype(np.float64), many, axis=1)
        tints[part] = feather.colors[rows]
        for kept, made in zip(of_barbs, (away, widths, places, tints), strict=True):
            kept.append(made)
    return (
        shaft, 2.0 * length * radii, colors, st, np.stack([w, x, y, z], axis=1),
        *(made for both in of_barbs for made in both))


def _turns(vane: NDArray[np.float64], along: NDArray[np.float64]) -> NDArray[np.float64]:
    """Frames (P, 3, 3) at places along a vane's rows, columns right, along, out, orthonormal."""
    frames = shaft_frames(vane)
    at = np.clip(along, 0.0, 1.0) * (len(vane) - 1)
    low = np.minimum(at.astype(np.intp), len(vane) - 2)
    share = (at - low)[:, None, None]
    mixed = (1.0 - share) * frames[low] + share * frames[low + 1]
    u, _, v = np.linalg.svd(mixed)
    return np.asarray(u @ v)
