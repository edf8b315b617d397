"""Barbs: a few numbers each along the shaft, expanded to curves on demand.

What splits, gaps, fraying, wear and noise do to a barb is settled once, when barbs are condensed, into ten bytes:
where it ends on the outline, how much of it there is, from where and how far it strays, how bright it is. 10,000
feathers of 600 barbs are 60 MB.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from core.feather.attributes import NAMES, column
from core.feather.noise import noise1, signed
from core.feather.surface import (
    END,
    LENGTH,
    NODES,
    ROW,
    START,
    along_barb,
    edge_of_share,
    flat_to_feather,
    root_of_edge,
    shaft_table,
    share_of_edge,
    vane_width,
)
from core.workers import serial_ranges

COUNT, SPACING_NOISE, LENGTH_NOISE = column("barbCount*"), column("barbSpacingNoise*"), column("barbLengthNoise*")
ANGLE_NOISE, LIFT_NOISE, MISSING = column("barbAngleNoise*"), column("barbLiftNoise*"), column("barbMissing*")
BRIGHTNESS, CLUMP, CLUMP_COUNT = column("barbBrightnessNoise*"), column("barbClump*"), column("barbClumpCount*")
TIP_CURL, WAVE, WAVE_COUNT = column("barbTipCurl*"), column("barbWave*"), column("barbWaveCount*")
SPLITS, SPLIT_DEPTH, SPLIT_WIDTH = column("splitCount*"), column("splitDepth*"), column("splitWidth*")
SPLIT_START, SPLIT_END, SPLIT_REACH = column("splitStart*"), column("splitEnd*"), column("splitReach*")
SPLIT_NOISE, SPLIT_LIFT = column("splitNoise*"), column("splitLift*")
GAPS, GAP_LENGTH, GAP_DEPTH = column("gapCount*"), column("gapLength*"), column("gapDepth*")
FRAY_TIP, FRAY_EDGE, FRAY_LENGTH = column("frayTip*"), column("frayEdge*"), column("frayLength*")
WEAR_EDGE, WEAR_TIP, WEAR_COUNT = column("wearEdge*"), column("wearTip*"), column("wearCount*")
INSET = column("shaftTipInset")
MOST_BARBS = 2000  # of a side
SAMPLES = 96  # of the way from edge to root, inverted to set barbs evenly along the shaft
STRAY = 16384.0  # steps of a shaft length, of what is stored as 16 bits with sign: up to two lengths
GONE = 0.02  # of its length: a barb shorter than that is left out


class Barbs(NamedTuple):
    """The condensed barbs of n feathers, flat; those of feather i are rows ``starts[i]`` .. ``starts[i + 1]``.

    starts : (n + 1,) int64. place : (B,) uint16, where it ends on the outline, share of the vane. length : (B,) uint16,
    share of its way to the outline. stray, lift : (B,) int16, how far its end strays along the feather and out of it.
    free : (B,) uint8, from which share of its way it strays. tone : (B,) uint8, its brightness, 128 for plain; the
    lowest bit is its side, 0 left, 1 right. Within a side barbs go from base to tip.
    """

    starts: NDArray[np.int64]
    place: NDArray[np.uint16]
    length: NDArray[np.uint16]
    stray: NDArray[np.int16]
    lift: NDArray[np.int16]
    free: NDArray[np.uint8]
    tone: NDArray[np.uint8]

    @property
    def nbytes(self) -> int:
        """Bytes of all columns."""
        return sum(column.nbytes for column in self)


class BarbCurves(NamedTuple):
    """Barbs expanded: points (B, P, 3) float32, metres, feather's frame; sides (B,) intp; places (B, P, 2) float32, `u`
    base to tip and `s` shaft to edge; flat (B, P, 2) float32, across and along in the flat vane, in shaft lengths."""

    points: NDArray[np.float32]
    sides: NDArray[np.intp]
    places: NDArray[np.float32]
    flat: NDArray[np.float32]

LONGS, WORDS, SIGNED, BYTES = (
    types.Array(kind, 1, "C", readonly=True) for kind in (types.int64, types.uint16, types.int16, types.uint8))


@njit(cache=True)
def places_of_barbs(a, side, count, seed, out):  # type: ignore[no-untyped-def]
    """Write shares (count,) of the outline where barbs end that stand evenly along the shaft, but for their noise."""
    roots = np.empty(SAMPLES)
    highest = -1.0
    for k in range(SAMPLES):
        share = 0.5 - 0.5 * math.cos(math.pi * k / (SAMPLES - 1))
        edge = edge_of_share(a, side, share)
        highest = max(highest, root_of_edge(a, side, edge, vane_width(a, side, edge), np.float64(a[INSET])))
        roots[k] = highest + 1e-9 * k
    at = 0
    for b in range(count):
        even = (b + 0.5 + 0.5 * a[SPACING_NOISE + side] * signed(b, seed + 20 + side)) / count
        wanted = roots[0] + (roots[SAMPLES - 1] - roots[0]) * even
        while at > 0 and roots[at] > wanted:
            at -= 1
        while at < SAMPLES - 2 and roots[at + 1] < wanted:
            at += 1
        f = at + (wanted - roots[at]) / (roots[at + 1] - roots[at])
        out[b] = 0.5 - 0.5 * math.cos(math.pi * min(max(f, 0.0), SAMPLES - 1.0) / (SAMPLES - 1))


@njit(cache=True, inline="always")
def _opening(a, side, split, seed):  # type: ignore[no-untyped-def]
    """Where, how deep and how wide one split of the vane is."""
    n = a[SPLIT_NOISE + side]
    low, high = a[SPLIT_START + side], max(a[SPLIT_END + side], a[SPLIT_START + side])
    key = 977 * (side + 1) + split
    even = (split + 0.5 + 0.45 * n * signed(key, seed + 30)) / max(round(a[SPLITS + side]), 1.0)
    depth = a[SPLIT_DEPTH + side] * (1.0 + 0.6 * n * signed(key, seed + 31))
    width = a[SPLIT_WIDTH + side] * (1.0 + 0.8 * n * signed(key, seed + 32))
    return low + (high - low) * even, min(max(depth, 0.0), 1.0), width


@njit(cache=True)
def condense_feather(a, seed, place, length, stray, lift, free, tone):  # type: ignore[no-untyped-def]
    """Write the barbs of one feather and return how many there are."""
    places = np.empty(MOST_BARBS)
    n = 0
    for side in range(2):
        count = min(round(a[COUNT + side]), MOST_BARBS)
        places_of_barbs(a, side, count, seed, places)
        extent = max(a[END + side] - a[START + side], 1e-3)
        for b in range(count):
            u = places[b]
            key = 65536 * side + b
            if a[MISSING + side] > 0.0 and 0.5 + 0.5 * signed(key, seed + 40) < a[MISSING + side]:
                continue
            whole = 1.0 + a[LENGTH_NOISE + side] * signed(key, seed + 41)
            off = a[ANGLE_NOISE + side] * signed(key, seed + 42)
            up = a[LIFT_NOISE + side] * signed(key, seed + 43)
            from_where = 0.15
            if a[CLUMP + side] > 0.0:  # ends draw to the middle of their bundle
                bundle = u * a[CLUMP_COUNT + side]
                off += a[CLUMP + side] * (math.floor(bundle) + 0.5 - bundle) / a[CLUMP_COUNT + side] * extent
            for split in range(round(a[SPLITS + side])):
                at, depth, width = _opening(a, side, split, seed)
                apart = (u - at) * extent
                fade = math.exp(-abs(apart) / a[SPLIT_REACH + side])
                sign = 1.0 if apart >= 0.0 else -1.0
                off += 0.5 * width * sign * fade
                up += a[SPLIT_LIFT + side] * (fade if sign > 0.0 else 0.0) * 0.5
                from_where = max(from_where, (1.0 - depth) * fade)
            for gap in range(round(a[GAPS + side])):
                middle = 0.5 + 0.5 * signed(gap + 50 * side, seed + 44)
                half = 0.5 * a[GAP_LENGTH + side] / extent
                if abs(u - middle) < half:
                    whole *= 1.0 - a[GAP_DEPTH + side] * (0.75 + 0.25 * signed(key, seed + 45))
            tip = max((u - 0.75) / 0.25, 0.0)
            fray = a[FRAY_EDGE + side] + a[FRAY_TIP + side] * tip * tip
            if fray > 0.0:
                lost = 0.5 + 0.5 * signed(key, seed + 46)
                whole *= 1.0 - min(fray, 1.0) * a[FRAY_LENGTH + side] * lost * lost
                off += 0.25 * fray * a[FRAY_LENGTH + side] * noise1(0.31 * b, seed + 47 + side)
                up += 0.12 * fray * a[FRAY_LENGTH + side] * noise1(0.23 * b, seed + 49 + side)
            if a[WEAR_EDGE + side] > 0.0:
                bite = noise1(u * a[WEAR_COUNT + side], seed + 51 + side)
                whole *= 1.0 - 0.45 * a[WEAR_EDGE + side] * max(0.35 + bite, 0.0)
            if a[WEAR_TIP + side] > 0.0:
                worn = max((u - 1.0 + 0.35 * a[WEAR_TIP + side]) / 0.35, 0.0)
                whole *= max(1.0 - 1.6 * worn * (1.0 + 0.3 * noise1(0.4 * b, seed + 53)), 0.0)
            if whole < GONE:
                continue
            place[n] = np.uint16(min(max(u, 0.0), 1.0) * 65535.0)
            length[n] = np.uint16(min(whole, 1.999) * 32767.0)
            stray[n] = np.int16(min(max(off, -1.9), 1.9) * STRAY)
            lift[n] = np.int16(min(max(up, -1.9), 1.9) * STRAY)
            free[n] = np.uint8(min(max(from_where, 0.0), 0.99) * 255.0)
            bright = 128.0 + 63.0 * a[BRIGHTNESS + side] * (signed(key, seed + 48) + 0.5 * noise1(0.15 * b, seed + 55))
            tone[n] = np.uint8((int(min(max(bright, 0.0), 255.0)) & 0xFE) | side)
            n += 1
    return n


@njit(
    types.void(
        types.Array(types.float32, 2, "C", readonly=True), LONGS, LONGS, types.int64, types.int64, types.uint16[::1],
        types.uint16[::1], types.int16[::1], types.int16[::1], types.uint8[::1], types.uint8[::1], types.int64[::1],
    ), cache=True, nogil=True,
)
def _condense(values, seeds, starts, start, stop, place, length, stray, lift, free, tone, found):  # type: ignore[no-untyped-def]
    for i in range(start, stop):
        k, e = starts[i], starts[i + 1]
        found[i] = condense_feather(
            values[i], np.int64(seeds[i]), place[k:e], length[k:e], stray[k:e], lift[k:e], free[k:e], tone[k:e]
        )


def condense(values: NDArray[np.float32], seeds: NDArray[Any], ranges: Any = serial_ranges) -> Barbs:
    """The barbs of n feathers: values (n, K) float32, all attributes; seeds (n,) integers, the feathers' ids."""
    table = _whole(values)
    counts = np.minimum(np.rint(table[:, COUNT : COUNT + 2]), MOST_BARBS).sum(axis=1).astype(np.int64)
    starts = np.concatenate([[0], np.cumsum(counts)])
    kinds = (np.uint16, np.uint16, np.int16, np.int16, np.uint8, np.uint8)
    columns = [np.zeros(int(starts[-1]), kind) for kind in kinds]
    found = np.zeros(len(table), np.int64)
    keys = np.ascontiguousarray(seeds, np.int64)
    call: Any = _condense  # numba's types know no unpacked arguments
    ranges(len(table), lambda a, b: call(table, keys, starts, a, b, *columns, found), grain=64)
    kept = np.arange(int(starts[-1])) - np.repeat(starts[:-1], counts) < np.repeat(found, counts)
    if not kept.all():
        columns = [values[kept] for values in columns]
    return Barbs(np.concatenate([[0], np.cumsum(found)]), *columns)  # type: ignore[arg-type]


@njit(
    types.void(
        ROW, WORDS, WORDS, SIGNED, SIGNED, BYTES, BYTES, types.float32[:, :, ::1], types.float32[:, :, ::1],
        types.float32[:, :, ::1],
    ), cache=True, nogil=True,
)
def _expand(a, place, length, stray, lift, free, tone, points, places, flat):  # type: ignore[no-untyped-def]
    table = np.empty((NODES, 12))
    shaft_table(a, table)
    steps, scale = points.shape[1], np.float64(a[LENGTH])
    for b in range(len(place)):
        side = int(tone[b]) & 1
        edge = edge_of_share(a, side, place[b] / 65535.0)
        wide = vane_width(a, side, edge)
        root = root_of_edge(a, side, edge, wide, np.float64(a[INSET]))
        begin, reach = free[b] / 255.0, length[b] / 32767.0
        for k in range(steps):
            s = reach * k / (steps - 1)
            x, y = wide * s, along_barb(a, side, root, edge, s)
            part = max(s - begin, 0.0) / (1.0 - begin)
            y += stray[b] / STRAY * part * part
            if a[WAVE + side] > 0.0:
                y += a[WAVE + side] * s * math.sin(2.0 * math.pi * (a[WAVE_COUNT + side] * s + 0.05 * b))
            p0, p1, p2 = flat_to_feather(a, table, side, wide, x, y)
            p2 += lift[b] / STRAY * part * part + a[TIP_CURL + side] * wide * s * s * s
            points[b, k, 0], points[b, k, 1], points[b, k, 2] = scale * p0, scale * p1, scale * p2
            places[b, k, 0], places[b, k, 1] = share_of_edge(a, side, y), s
            flat[b, k, 0], flat[b, k, 1] = (2.0 * side - 1.0) * x, y


def expand(values: NDArray[np.float32], barbs: Barbs, feather: int, points: int = 9) -> BarbCurves:
    """The barbs of one feather as curves of `points` points: values (K,) float32, its attributes."""
    rows = slice(int(barbs.starts[feather]), int(barbs.starts[feather + 1]))
    count = rows.stop - rows.start
    out = np.empty((count, points, 3), np.float32)
    places, flat = np.empty((count, points, 2), np.float32), np.empty((count, points, 2), np.float32)
    parts = [values[rows] for values in barbs[1:]]
    call: Any = _expand
    call(_whole(values[None])[0], *parts, out, places, flat)
    return BarbCurves(out, (barbs.tone[rows] & 1).astype(np.intp), places, flat)


def _whole(values: NDArray[np.float32]) -> NDArray[np.float32]:
    if values.ndim != 2 or values.shape[1] != len(NAMES):
        raise ValueError(f"barbs need a table of all {len(NAMES)} attributes, not {values.shape}")
    return np.ascontiguousarray(values, np.float32)
