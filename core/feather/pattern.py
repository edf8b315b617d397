"""The colours of a vane: ground, bars, spots, streak, mottles, fringe and band at the tip, from the attributes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from core.feather.attributes import column
from core.feather.noise import noise1, noise2, signed
from core.feather.surface import ROW, smoothstep

BASE, MIDDLE, TIP = column("colorBaseRed"), column("colorMiddleRed"), column("colorTipRed")
INNER_COLOR, EDGE_COLOR, BAND_COLOR = column("colorInnerRed"), column("colorEdgeRed"), column("colorTipBandRed")
BAR_COLOR, SPOT_COLOR, STREAK_COLOR = column("colorBarRed"), column("colorSpotRed"), column("colorStreakRed")
BASE_AT, TIP_AT, NOISE = column("colorBasePosition"), column("colorTipPosition"), column("colorNoise")
INNER, INNER_WIDTH = column("colorInner*"), column("colorInnerWidth*")
EDGE, EDGE_WIDTH, EDGE_SOFT = column("edgeStrength*"), column("edgeWidth*"), column("edgeSoftness")
BAND, BAND_WIDTH, BAND_SOFT = column("tipBandStrength"), column("tipBandWidth"), column("tipBandSoftness")
BAND_CURVE = column("tipBandCurve")
BAR, BAR_COUNT, BAR_WIDTH, BAR_SOFT = (
    column("barStrength*"), column("barCount"), column("barWidth"), column("barSoftness")
)
BAR_ANGLE, BAR_PHASE, BAR_WAVER = column("barAngle*"), column("barPhase*"), column("barWaver")
BAR_START, BAR_END, BAR_EDGE = column("barStart"), column("barEnd"), column("barEdge*")
SPOT, SPOT_COUNT, SPOT_ACROSS = column("spotStrength*"), column("spotCount"), column("spotAcross*")
SPOT_SIZE, SPOT_LENGTH, SPOT_SOFT = column("spotSize"), column("spotLength"), column("spotSoftness")
SPOT_WAVER, SPOT_START, SPOT_END = column("spotWaver"), column("spotStart"), column("spotEnd")
STREAK, STREAK_WIDTH = column("streakStrength"), column("streakWidth*")
STREAK_SOFT, STREAK_TAPER = column("streakSoftness"), column("streakTaper")
MOTTLE, MOTTLE_SCALE, MOTTLE_SHARP = column("mottleStrength"), column("mottleScale"), column("mottleSharpness")
ROWS = types.Array(types.float32, 2, "C", readonly=True)
SIDES = types.Array(types.int8, 1, "C", readonly=True)


@njit(cache=True, inline="always")
def _mix(color, a, first, amount):  # type: ignore[no-untyped-def]
    for k in range(3):
        color[k] += (a[first + k] - color[k]) * amount


@njit(cache=True, inline="always")
def _within(x, low, high, soft):  # type: ignore[no-untyped-def]
    return smoothstep((x - low) / soft + 0.5) * smoothstep((high - x) / soft + 0.5)


@njit(cache=True)
def vane_color(a, side, u, s, seed, color):  # type: ignore[no-untyped-def]
    """Write the linear colour (3,) at `u` 0 base .. 1 tip and `s` 0 shaft .. 1 edge of a side of feather `seed`."""
    for k in range(3):
        color[k] = a[BASE + k]
    _mix(color, a, MIDDLE, smoothstep(u / max(2.0 * a[BASE_AT], 1e-3)))
    _mix(color, a, TIP, smoothstep((u - a[BASE_AT]) / max(a[TIP_AT] - a[BASE_AT], 1e-3)) if u > a[BASE_AT] else 0.0)
    inner = a[INNER + side]
    if inner > 0.0:
        _mix(color, a, INNER_COLOR, inner * (1.0 - smoothstep((s / a[INNER_WIDTH + side] - 0.6) / 0.8)))
    if a[MOTTLE] > 0.0:
        scale = a[MOTTLE_SCALE]
        n = 0.7 * noise2(s * 0.3 / scale, u / scale, seed) + 0.3 * noise2(s * 0.7 / scale, 2.3 * u / scale, seed + 1)
        _mix(color, a, BAR_COLOR, a[MOTTLE] * smoothstep(0.5 + n / (1.02 - a[MOTTLE_SHARP])))
    if a[BAR + side] > 0.0 and a[BAR_COUNT] > 0.0:
        at = a[BAR_COUNT] * (u - 0.25 * a[BAR_ANGLE + side] * s) + a[BAR_PHASE + side]
        at += a[BAR_WAVER] * (noise1(s * 4.0 + 31.0 * side, seed + 2) + 0.6 * noise1(at, seed + 3))
        off = abs(at - math.floor(at) - 0.5) * 2.0  # 0 in the middle of a bar, 1 between two
        there = smoothstep((a[BAR_WIDTH] - off) / max(2.0 * a[BAR_SOFT], 1e-3) + 0.5)
        there *= _within(u, a[BAR_START], a[BAR_END], 0.04) * smoothstep((a[BAR_EDGE + side] - s) / 0.12 + 0.8)
        _mix(color, a, BAR_COLOR, a[BAR + side] * there)
    if a[SPOT + side] > 0.0 and a[SPOT_COUNT] > 0.0:
        across = max(1.0, round(a[SPOT_ACROSS + side]))
        row = a[SPOT_COUNT] * u + (0.5 * side if across > 1.0 else 0.0)
        at = math.floor(row)
        lane = s * across + (0.5 if int(at) % 2 == 1 and across > 1.0 else 0.0)
        key = 64 * int(at) + math.floor(lane) + 100003 * side
        dx = lane - math.floor(lane) - 0.5 - 0.3 * a[SPOT_WAVER] * signed(key, seed + 4)
        dy = (row - at - 0.5 - 0.3 * a[SPOT_WAVER] * signed(key, seed + 5)) / a[SPOT_LENGTH]
        size = a[SPOT_SIZE] * (1.0 + 0.5 * a[SPOT_WAVER] * signed(key, seed + 6))
        there = smoothstep((size - math.sqrt(dx * dx + dy * dy)) / max(a[SPOT_SOFT], 1e-3) + 0.5)
        _mix(color, a, SPOT_COLOR, a[SPOT + side] * there * _within(u, a[SPOT_START], a[SPOT_END], 0.02))
    if a[STREAK] > 0.0:
        wide = a[STREAK_WIDTH + side] * (1.0 - a[STREAK_TAPER] * u)
        _mix(color, a, STREAK_COLOR, a[STREAK] * smoothstep((wide - s) / a[STREAK_SOFT] + 0.5))
    if a[EDGE + side] > 0.0:
        inside = min(1.0 - s, 3.0 * (1.0 - u))
        _mix(color, a, EDGE_COLOR, a[EDGE + side] * smoothstep((a[EDGE_WIDTH + side] - inside) / a[EDGE_SOFT] + 0.5))
    if a[BAND] > 0.0:
        at = u + 0.3 * a[BAND_CURVE] * s * s
        _mix(color, a, BAND_COLOR, a[BAND] * smoothstep((at - 1.0 + a[BAND_WIDTH]) / a[BAND_SOFT] + 0.5))
    bright = 1.0 + a[NOISE] * signed(11, seed)
    for k in range(3):
        color[k] = min(max(color[k] * bright, 0.0), 1.0)


@njit(types.void(ROW, SIDES, ROWS, types.int64, types.float32[:, ::1]), cache=True, nogil=True)
def _colors(a, sides, places, seed, out):  # type: ignore[no-untyped-def]
    color = np.empty(3)
    for i in range(len(places)):
        vane_color(a, int(sides[i]), np.float64(places[i, 0]), np.float64(places[i, 1]), seed, color)
        for k in range(3):
            out[i, k] = color[k]


def vane_colors(
    values: NDArray[np.float32], sides: NDArray[Any], places: NDArray[np.float32], seed: int
) -> NDArray[np.float32]:
    """Linear colours (N, 3) of places (N, 2), `u` base to tip and `s` shaft to edge, on sides (N,) 0 left, 1 right."""
    out = np.empty((len(places), 3), np.float32)
    _colors(
        np.ascontiguousarray(values, np.float32), np.asarray(sides, np.int8), np.ascontiguousarray(places, np.float32),
        seed, out,
    )
    return out
