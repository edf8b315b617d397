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
REBUILD_LEVELS = 2
ENOUGH = 0.75  # of the radius: nearer than this the search for the very nearest root ends
BUCKETS_PER_ROOT = 2
OCTAVES = 5  # of the stretch: 1, 2, 4, 8, 16
SAME_SIDE = 0.2  # least cosine between the normals of two roots that keep their distance


@njit(cache=True, inline="always")
def _weights(key, seed):  # type: ignore[no-untyped-def]
    """Uniform barycentric weights of a candidate (the square root of Turk, "Generating random points", 1990)."""
    root = math.sqrt(rand1(key, np.uint32(seed + 1)))
    v = rand1(key, np.uint32(seed + 2))
    return 1.0 - root, root * (1.0 - v), root * v


@njit(types.void(U32_1D, types.int64, types.float32[:, ::1]), cache=True, nogil=True, error_model="numpy")
def interpolate(keys, seed, barycentric):  # type: ignore[no-untyped-def]
    """Write the barycentric weights of candidates `keys`."""
    for i in range(len(keys)):
        a, b, c = _weights(keys[i], seed)
        barycentric[i, 0], barycentric[i, 1], barycentric[i, 2] = a, b, c


@njit(
    types.void(
        F64_1D, F32_2D, I64_1D, types.int64, types.int32[::1], types.float32[:, ::1], types.int64, types.int64
    ),
    cache=True, nogil=True, error_model="numpy",
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


@njit(types.void(I64_1D, I64_1D, types.int64, types.uint64[::1]), cache=True, nogil=True, error_model="numpy")
def _shuffle_key(chosen, levels, seed, keys):  # type: ignore[no-untyped-def]
    for i in range(len(chosen)):
        number = np.uint64(rand1(np.uint32(chosen[i]), np.uint32(seed + 5)) * 4294967296.0)
        keys[i] = (np.uint64(levels[i]) << np.uint64(32)) | number


@njit(cache=True, inline="always")
def _bucket(octave, i, j, k, mask):  # type: ignore[no-untyped-def]
    """Bucket of a cell: blocks of 4 x 4 x 4 cells are hashed, so that neighbours share lines of the cache."""
    block = ((i >> 2) * 73856093) ^ ((j >> 2) * 19349663) ^ ((k >> 2) * 83492791) ^ (octave * 1640531513)
    return ((block & mask) << 6) | ((i & 3) << 4) | ((j & 3) << 2) | (k & 3)


@njit(cache=True, inline="always")
def _octave(stretch):  # type: ignore[no-untyped-def]
    octave = 0
    while octave < OCTAVES - 1 and stretch > (1 << octave):
        octave += 1
    return octave


@njit(cache=True, inline="always")
def _bucket_of(x, y, z, octave, cell, mask):  # type: ignore[no-untyped-def]
    scale = 1.0 / (cell * (1 << octave))
    return _bucket(octave, math.floor(x * scale), math.floor(y * scale), math.floor(z * scale), mask)


@njit(cache=True, nogil=True, error_model="numpy")
def _rebuild(old, grid, accepted, cell, mask, heads):  # type: ignore[no-untyped-def]
    """Move all roots to cells of a new size, in memory bucket after bucket."""
    starts = np.zeros(64 * (mask + 1) + 1, np.int32)
    buckets = np.empty(accepted, np.int32)
    for row in range(accepted):
        b = _bucket_of(
            np.float64(old[row, 0]), np.float64(old[row, 1]), np.float64(old[row, 2]), _octave(old[row, 5]), cell, mask
        )
        buckets[row] = b
        starts[b + 1] += 1
    for b in range(64 * (mask + 1)):
        starts[b + 1] += starts[b]
        heads[b] = -1
    links = grid.view(np.int32)
    for row in range(accepted):
        b = buckets[row]
        at = starts[b]
        starts[b] += 1
        for k in range(6):
            grid[at, k] = old[row, k]
        links[at, 3] = heads[b]
        heads[b] = at


@njit(cache=True, nogil=True, error_model="numpy")
def _nearest(heads, grid, normals, counts, cell, mask, radius, x, y, z, own, t):  # type: ignore[no-untyped-def]
    """Smallest distance over stretch to a root on the same side of the skin, if below `radius` (else infinite).

    When one is clearly near it is returned without looking for a nearer one. Two roots of different stretch keep the
    distance of the smaller one, so that a ball never leaves 8 cells.
    """
    best = np.inf
    limit = radius * own
    limit2 = limit * limit
    links = grid.view(np.int32)
    for octave in range(OCTAVES):
        if counts[octave] == 0:
            continue
        reach = radius * min(own, np.float64(1 << octave))
        scale = 1.0 / (cell * (1 << octave))
        fx, fy, fz = x * scale, y * scale, z * scale
        i0, j0, k0 = math.floor(fx), math.floor(fy), math.floor(fz)
        fx, fy, fz = fx - i0, fy - j0, fz - k0
        # the ball reaches over one side of its own cell at most on every axis
        edge = reach * scale
        di = -1 if fx < edge else (1 if fx > 1.0 - edge else 0)
        dj = -1 if fy < edge else (1 if fy > 1.0 - edge else 0)
        dk = -1 if fz < edge else (1 if fz > 1.0 - edge else 0)
        for corner in range(8):
            if (corner & 1 and di == 0) or (corner & 2 and dj == 0) or (corner & 4 and dk == 0):
                continue
            i, j, k = i0 + di * (corner & 1), j0 + dj * (corner >> 1 & 1), k0 + dk * (corner >> 2)
            row = heads[_bucket(octave, i, j, k, mask)]
            while row >= 0:
                dx, dy, dz = grid[row, 0] - x, grid[row, 1] - y, grid[row, 2] - z
                d2 = dx * dx + dy * dy + dz * dz
                if d2 < limit2:
                    u = links[row, 4]
                    facing = np.float32(1.0)
                    if u != t:
                        facing = (
                            normals[u, 0] * normals[t, 0] + normals[u, 1] * normals[t, 1]
                            + normals[u, 2] * normals[t, 2]
                        )
                    distance = math.sqrt(d2) / min(own, np.float64(grid[row, 5]))
                    if facing > SAME_SIDE and distance < min(best, radius):
                        best = distance
                        limit2 = (best * own) ** 2
                row = links[row, 3]
            if best < ENOUGH * radius:
                return best  # it sleeps long anyway; waking a little early does no harm
    return best


@njit(  # type: ignore[call-overload]
    types.Tuple((types.int64[::1], types.int64[::1], types.boolean))(  # type: ignore[no-untyped-call]
        I32_1D, F32_2D, F32_1D, F32_2D, I64_1D, types.float64, types.float64, types.int64
    ),
    cache=True, nogil=True, error_model="numpy",
)
def even_subset(triangle, places, stretch, normals, ends, size, per_root, count):  # type: ignore[no-untyped-def]
    """Choose at least `count` candidates, level by level; the last level is finished.

    Returns the candidates chosen, the level of each, and whether the candidates ran out before.
    """
    total = len(triangle)
    room = min(total, int(1.3 * count) + 1024)
    chosen = np.empty(room, np.int64)
    levels = np.empty(room, np.int64)
    # of each root its place, then as bits of int32 the next root of its bucket and its triangle, then its stretch
    grid = np.empty((room, 6), np.float32)
    spare = np.empty((room, 6), np.float32)
    counts = np.zeros(OCTAVES, np.int64)
    heads = np.full(64, -1, np.int32)
    mask = 0
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
            while BUCKETS_PER_ROOT * accepted > 64 * (mask + 1):
                mask = 2 * mask + 1
            if len(heads) < 64 * (mask + 1):
                heads = np.empty(64 * (mask + 1), np.int32)
            grid, spare = spare, grid
            _rebuild(spare, grid, accepted, cell, mask, heads)
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
            near = _nearest(
                heads, grid, normals, counts, cell, mask, radius, x, y, z, np.float64(stretch[c]), triangle[c]
            )
            if near == np.inf:
                if accepted == room:
                    spare = np.empty((2 * room, 6), np.float32)
                    spare[:room] = grid
                    grid, spare = spare, np.empty((2 * room, 6), np.float32)
                    chosen = np.append(chosen, np.empty(room, np.int64))
                    levels = np.append(levels, np.empty(room, np.int64))
                    room *= 2
                octave = _octave(stretch[c])
                counts[octave] += 1
                chosen[accepted], levels[accepted] = c, level
                grid[accepted, 0], grid[accepted, 1], grid[accepted, 2], grid[accepted, 5] = x, y, z, stretch[c]
                b = _bucket_of(x, y, z, octave, cell, mask)
                links = grid.view(np.int32)
                links[accepted, 3], links[accepted, 4] = heads[b], triangle[c]
                heads[b] = accepted
                accepted += 1
            elif near > 0.0:
                wake = max(level + 1, int(math.log(near / (FIRST_RADIUS * size)) / math.log(SHRINK)) + 1)
                if wake < MAX_LEVELS:
                    next_sleeper[c] = sleepers[wake]
                    sleepers[wake] = c
    return chosen[:accepted].copy(), levels[:accepted].copy(), dry
