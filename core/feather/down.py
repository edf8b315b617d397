"""Down: loose, curled hairs at the base of the vanes and of the afterfeather, made from their numbers on demand."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from core.feather.attributes import column
from core.feather.noise import noise1, signed
from core.feather.surface import LENGTH, NODES, ROW, on_shaft, shaft_table

DENSITY, HAIR_LENGTH = column("downHairDensityVane*"), column("downHairLengthVane*")
LENGTH_NOISE, HAIR_START = column("downHairLengthNoiseVane*"), column("downHairStartVane*")
HAIR_END, ANGLE, ANGLE_NOISE = (
    column("downHairEndVane*"), column("downHairAngleVane*"), column("downHairAngleNoiseVane*")
)
LIFT, CURL, CURL_COUNT = column("downHairLiftVane*"), column("downHairCurlVane*"), column("downHairCurlCountVane*")
DROOP = column("downHairDroopVane*")
AFTER_LENGTH, AFTER_WIDTH = column("afterfeatherLength"), column("afterfeatherWidth")
AFTER_HAIRS, AFTER_ANGLE, AFTER_CURL = (
    column("afterfeatherHairs"), column("afterfeatherAngle"), column("afterfeatherCurl")
)
AFTER_FROM = 0.05  # where on the shaft the afterfeather begins


class Down(NamedTuple):
    """H hairs. points : (H, P, 3) float32, metres, feather's frame; flat : (H, P, 2) float32, in the flat feather, in
    shaft lengths; sides : (H,) intp."""

    points: NDArray[np.float32]
    flat: NDArray[np.float32]
    sides: NDArray[np.intp]


@njit(cache=True)
def _hair(a, table, key, seed, side, root, drop, length, curl, points, flat):  # type: ignore[no-untyped-def]
    angle = a[ANGLE + side] + a[ANGLE_NOISE + side] * signed(key, seed + 61)
    tilt = a[LIFT + side] * signed(key, seed + 62)
    length *= 1.0 + a[LENGTH_NOISE + side] * signed(key, seed + 63)
    turn, phase = a[CURL_COUNT + side] * (1.0 + 0.3 * signed(key, seed + 64)), math.pi * signed(key, seed + 65)
    sign, scale = 2.0 * side - 1.0, np.float64(a[LENGTH])
    for k in range(len(points)):
        s = k / (len(points) - 1)
        bent = angle - 0.35 * s * angle + 0.6 * a[ANGLE_NOISE + side] * s * noise1(2.0 * s + key, seed + 66)
        off = curl * length * s * math.sin(2.0 * math.pi * turn * s + phase)
        rise = curl * length * s * math.cos(2.0 * math.pi * turn * s + phase)
        reach = length * s
        x = reach * math.sin(bent) * math.cos(tilt) + off * math.cos(bent)
        y = reach * math.cos(bent) - off * math.sin(bent)
        z = reach * math.sin(tilt) + rise - a[DROOP + side] * length * s * s - drop * root
        p0, p1, p2 = on_shaft(table, root + y, sign * x, z)
        points[k, 0], points[k, 1], points[k, 2] = scale * p0, scale * p1, scale * p2
        flat[k, 0], flat[k, 1] = sign * x, root + y


@njit(
    types.void(
        ROW, types.int64, types.int64[::1], types.float32[:, :, ::1], types.float32[:, :, ::1], types.int64[::1]
    ), cache=True, nogil=True,
)
def _down(a, seed, counts, points, flat, sides):  # type: ignore[no-untyped-def]
    table = np.empty((NODES, 12))
    shaft_table(a, table)
    h = 0
    for side in range(2):
        low, high = np.float64(a[HAIR_START + side]), max(a[HAIR_END + side], a[HAIR_START + side])
        for i in range(counts[side]):
            key = 131072 * side + i
            at = (i + 0.5 + 0.5 * signed(key, seed + 60)) / counts[side]
            length = a[HAIR_LENGTH + side] * (1.0 - 0.25 * abs(2.0 * at - 1.0))
            _hair(a, table, key, seed, side, low + (high - low) * at, 0.0, length, a[CURL + side], points[h], flat[h])
            sides[h] = side
            h += 1
    for i in range(counts[2]):
        key, side = 524288 + i, i % 2
        at = (i + 0.5) / counts[2]
        length = a[AFTER_WIDTH] * math.sqrt(max(1.0 - at * at, 0.05))
        root = AFTER_FROM + a[AFTER_LENGTH] * at
        _hair(a, table, key, seed, side, root, math.tan(a[AFTER_ANGLE]), length, a[AFTER_CURL], points[h], flat[h])
        sides[h] = side
        h += 1


def down_hairs(values: NDArray[Any], seed: int, points: int = 12) -> Down:
    """The down of one feather, values (K,) float32: of both vanes, then of the afterfeather."""
    a = np.ascontiguousarray(values, np.float32)
    after = round(float(a[AFTER_HAIRS])) if a[AFTER_LENGTH] > 0.0 else 0
    counts = np.array([round(float(a[DENSITY])), round(float(a[DENSITY + 1])), after], np.int64)
    total = int(counts.sum())
    out = Down(
        np.empty((total, points, 3), np.float32), np.empty((total, points, 2), np.float32), np.empty(total, np.intp)
    )
    _down(a, seed, counts, *out)
    return out
