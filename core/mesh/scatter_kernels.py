"""Kernels of the scatter: drawing stratified candidates, and choosing an even subset level by level."""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from core.random import rand1

F32_1D = types.Array(types.float32, 1, "C", readonly=True)
F32_2D = types.Array(types.float32, 2, "C", readonly=True)
F64_1D = types.Array(types.float64, 1, "C", readonly=True)
I32_1D = types.Array(types.int32, 1, "C", readonly=True)
I64_1D = types.Array(types.int64, 1, "C", readonly=True)
U32_1D = types.Array(types.uint32, 1, "C", readonly=True)

SHRINK = 0.93  # of the radius from level to level: 16 % more roots each
FIRST_RADIUS = 0.5  # of the root of the area
MAX_LEVELS = 300  # 0.93^300 is beyond what float32 places can tell apart
REBUILD_LEVELS = 4
OCTAVES = 5  # of the stretch: 1, 2, 4, 8, 16
SAME_SIDE = 0.2  # least cosine between the normals of two roots that keep their distance


@njit(cache=True, inline="always")
def _weights(key, seed):  # type: ignore[no-untyped-def]
    """Uniform barycentric weights of a candidate (the square root of Turk, "Generating random points", 1990)."""
    root = math.sqrt(rand1(key, np.uint32(seed + 1)))
    v = rand1(key, np.uint32(seed + 2))
    return 1.0 - root, root * (1.0 - v), root * v


@njit(types.void(U32_1D, types.int64, types.float32[:, ::1]), cache=True, nogil=True)
def interpolate(keys, seed, barycentric):  # type: ignore[no-untyped-def]
    """Write the barycentric weights of candidates `keys`."""
    for i in range(len(keys)):
        a, b, c = _weights(keys[i], seed)
        barycentric[i, 0], barycentric[i, 1], barycentric[i, 2] = a, b, c


@njit(
    types.void(
        F64_1D, F32_2D, I64_1D, types.int64, types.int32[::1], types.float32[:, ::1], types.int64, types.int64
    ),
    cache=True, nogil=True,
)
def draw_candidates(cumulative, corners, ends, seed, triangle, places, start, stop):  # type: ignore[no-untyped-def]
    """Candidates start .. stop: the i-th of a batch of m lies at (i + random) / m of the cumulative area."""
    last = len(cumulative) - 1
    batch = np.searchsorted(ends, start, side="right")
    t = -1
    for i in range(start, stop):
        if i >= ends[batch]:
            batch += 1
            t = -1
        first = ends[batch - 1] if batch > 0 else 0
        share = (i - first + rand1(np.uint32(i), np.uint32(seed))) / (ends[batch] - first)
        target = share * cumulative[last]
        if t < 0:
            t = min(last, np.searchsorted(cumulative, target, side="right"))
        while t < last and cumulative[t] <= target:
            t += 1
        a, b, c = _weights(np.uint32(i), seed)
        triangle[i] = t
        for k in range(3):
            places[i, k] = a * corners[t, k] + b * corners[t, 3 + k] + c * corners[t, 6 + k]


def shuffle_key(chosen: NDArray[np.int64], levels: NDArray[np.int64], seed: int) -> NDArray[np.uint64]:
    """Keys that sort roots by level, at random within each; no two are equal (the hash permutes its 32 bits)."""
    keys = np.empty(len(chosen), np.uint64)
    _shuffle_key(chosen, levels, seed, keys)
    return keys


@njit(types.void(I64_1D, I64_1D, types.int64, types.uint64[::1]), cache=True, nogil=True)
def _shuffle_key(chosen, levels, seed, keys):  # type: ignore[no-untyped-def]
    for i in range(len(chosen)):
        number = np.uint64(rand1(np.uint32(chosen[i]), np.uint32(seed + 5)) * 4294967296.0)
        keys[i] = (np.uint64(levels[i]) << np.uint64(32)) | number


@njit(cache=True, inline="always")
def _bucket(octave, i, j, k, mask):  # type: ignore[no-untyped-def]
    """Bucket of a cell (Teschner et al., "Optimized Spatial Hashing", 2003)."""
    return ((i * 73856093) ^ (j * 19349663) ^ (k * 83492791) ^ (octave * 1640531513)) & mask


@njit(cache=True, inline="always")
def _insert(heads, links, roots, octaves, row, cell, mask):  # type: ignore[no-untyped-def]
    octave = octaves[row]
    scale = 1.0 / (cell * (1 << octave))
    b = _bucket(
        octave,
        math.floor(roots[row, 0] * scale), math.floor(roots[row, 1] * scale),
        math.floor(roots[row, 2] * scale), mask,
    )
    links[row] = heads[b]
    heads[b] = row


@njit(cache=True)
def _nearest(heads, links, roots, counts, cell, mask, radius, x, y, z, stretch, nx, ny, nz):  # type: ignore[no-untyped-def]
    """Smallest distance over stretch to a root on the same side of the skin, if below `radius` (else infinite).

    Two roots of different stretch keep the distance of the smaller one, so that a ball never leaves 8 cells.
    """
    best = radius
    found = False
    for octave in range(OCTAVES):
        if counts[octave] == 0:
            continue
        reach = radius * min(stretch, np.float64(1 << octave))
        scale = 1.0 / (cell * (1 << octave))
        i0, i1 = math.floor((x - reach) * scale), math.floor((x + reach) * scale)
        j0, j1 = math.floor((y - reach) * scale), math.floor((y + reach) * scale)
        k0, k1 = math.floor((z - reach) * scale), math.floor((z + reach) * scale)
        for i in range(i0, i1 + 1):
            for j in range(j0, j1 + 1):
                for k in range(k0, k1 + 1):
                    row = heads[_bucket(octave, i, j, k, mask)]
                    while row >= 0:
                        dx, dy, dz = roots[row, 0] - x, roots[row, 1] - y, roots[row, 2] - z
                        limit = best * min(stretch, roots[row, 6])
                        d2 = dx * dx + dy * dy + dz * dz
                        if d2 < limit * limit and (
                            nx * roots[row, 3] + ny * roots[row, 4] + nz * roots[row, 5] > SAME_SIDE
                        ):
                            best = math.sqrt(d2) / min(stretch, roots[row, 6])
                            found = True
                        row = links[row]
    return best if found else np.inf


@njit(
    types.Tuple((types.int64[::1], types.int64[::1], types.boolean))(  # type: ignore[no-untyped-call]
        I32_1D, F32_2D, F32_1D, F32_2D, I64_1D, types.float64, types.float64, types.int64
    ),
    cache=True, nogil=True,
)
def even_subset(triangle, places, stretch, normals, ends, size, per_root, count):  # type: ignore[no-untyped-def]
    """Choose at least `count` candidates, level by level; the last level is finished.

    Returns the candidates chosen, the level of each, and whether the candidates ran out before.
    """
    total = len(triangle)
    room = min(total, int(1.3 * count) + 1024)
    chosen = np.empty(room, np.int64)
    levels = np.empty(room, np.int64)
    roots = np.empty((room, 8), np.float32)
    octaves = np.empty(room, np.int64)
    links = np.empty(room, np.int32)
    counts = np.zeros(OCTAVES, np.int64)
    buckets = 64
    while buckets < room:
        buckets *= 2
    heads = np.empty(buckets, np.int32)
    mask = 63
    sleepers = np.full(MAX_LEVELS + 1, -1, np.int32)  # first candidate to wake at each level
    next_sleeper = np.empty(total, np.int32)
    accepted, seen, batch = 0, 0, 0
    cell = 0.0
    dry = False
    for level in range(MAX_LEVELS):
        if accepted >= count or dry:
            break
        radius = FIRST_RADIUS * size * SHRINK**level
        if level % REBUILD_LEVELS == 0:
            cell = 2.0 * radius
            while mask + 1 < buckets and mask < 2 * accepted:
                mask = 2 * mask + 1
            heads[: mask + 1] = -1
            for row in range(accepted):
                _insert(heads, links, roots, octaves, row, cell, mask)
        candidate = sleepers[level]
        first, last = 0, 0
        while True:
            # first those who wake at this level, then whole batches of newcomers
            if candidate < 0:
                if first == last:
                    if seen >= 1.25 * per_root * accepted and seen > 0:
                        break
                    if batch == len(ends):
                        dry = True
                        break
                    first = ends[batch - 1] if batch > 0 else 0
                    last = ends[batch]
                    batch += 1
                c = first
                first += 1
                if stretch[c] == 0.0:
                    continue
                seen += 1
            else:
                c = candidate
                candidate = next_sleeper[c]
            x, y, z = np.float64(places[c, 0]), np.float64(places[c, 1]), np.float64(places[c, 2])
            t, s = triangle[c], np.float64(stretch[c])
            nx, ny, nz = np.float64(normals[t, 0]), np.float64(normals[t, 1]), np.float64(normals[t, 2])
            near = _nearest(heads, links, roots, counts, cell, mask, radius, x, y, z, s, nx, ny, nz)
            if near == np.inf:
                if accepted == room:
                    grown = np.empty((2 * room, 8), np.float32)
                    grown[:room] = roots
                    roots = grown
                    chosen = np.append(chosen, np.empty(room, np.int64))
                    levels = np.append(levels, np.empty(room, np.int64))
                    octaves = np.append(octaves, np.empty(room, np.int64))
                    links = np.append(links, np.empty(room, np.int32))
                    room *= 2
                octave = 0
                while octave < OCTAVES - 1 and s > (1 << octave):
                    octave += 1
                roots[accepted, 0], roots[accepted, 1], roots[accepted, 2] = x, y, z
                roots[accepted, 3], roots[accepted, 4], roots[accepted, 5] = nx, ny, nz
                roots[accepted, 6] = s
                octaves[accepted] = octave
                counts[octave] += 1
                chosen[accepted], levels[accepted] = c, level
                _insert(heads, links, roots, octaves, accepted, cell, mask)
                accepted += 1
            elif near > 0.0:
                wake = int(math.log(near / (FIRST_RADIUS * size)) / math.log(SHRINK)) + 1
                wake = max(wake, level + 1)
                if wake < MAX_LEVELS:
                    next_sleeper[c] = sleepers[wake]
                    sleepers[wake] = c
    return chosen[:accepted].copy(), levels[:accepted].copy(), dry
