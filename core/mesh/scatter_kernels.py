"""Kernels of the scatter: drawing stratified candidates, and choosing an even subset level by level."""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from core.random import rand1

F32_1D = types.Array(types.float32, 1, "C", readonly=True)
F32_2D = types.Array(types.float32, 2, "C", readonly=True)
F64_1D = types.Array(types.float64, 1, "C", readonly=True)
I32_1D = types.Array(types.int32, 1, "C", readonly=True)
I64_1D = types.Array(types.int64, 1, "C", readonly=True)
U16_1D = types.Array(types.uint16, 1, "C", readonly=True)
U32_1D = types.Array(types.uint32, 1, "C", readonly=True)

SHRINK = 0.93  # of the radius from level to level: 16 % more roots each
LOG_SHRINK = math.log(SHRINK)
FIRST_RADIUS = 0.5  # of the root of the area
MAX_LEVELS = 300  # 0.93^300 is beyond what float32 places can tell apart
NEVER = 65535  # level at which nothing wakes
ENOUGH = 0.75  # of the radius: nearer than this the search for the very nearest root ends
BLOCK = 64  # cells hashed together
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


@njit(
    types.int64[::1](I64_1D, I64_1D, types.int64), cache=True, nogil=True, error_model="numpy"
)
def shuffled(chosen, levels, seed):  # type: ignore[no-untyped-def]
    """Order that sorts roots by level, at random within each: a radix sort (the hash permutes its 32 bits)."""
    count = len(chosen)
    number = np.empty(count, np.uint32)
    for i in range(count):
        number[i] = np.uint32(rand1(np.uint32(chosen[i]), np.uint32(seed + 5)) * 4294967296.0)
    order, other = np.empty(count, np.int64), np.arange(count)
    for digit in range(3):
        ends = np.zeros(65537, np.int64)
        for i in range(count):
            ends[(levels[i] if digit == 2 else (number[i] >> np.uint32(16 * digit)) & 65535) + 1] += 1
        for d in range(65536):
            ends[d + 1] += ends[d]
        for k in range(count):
            i = other[k]
            d = levels[i] if digit == 2 else (number[i] >> np.uint32(16 * digit)) & 65535
            order[ends[d]] = i
            ends[d] += 1
        order, other = other, order
    return other


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


@njit(
    types.void(F32_2D, types.int64, types.int64, types.float64, types.int64, types.int32[::1]),
    cache=True, nogil=True, error_model="numpy",
)
def find_buckets(roots, start, stop, cell, mask, buckets):  # type: ignore[no-untyped-def]
    """Write the buckets of roots start .. stop."""
    for row in range(start, stop):
        buckets[row] = _bucket_of(roots[row, 0], roots[row, 1], roots[row, 2], _octave(roots[row, 3]), cell, mask)


@njit(
    types.void(
        F32_2D, I32_1D, I32_1D, types.int64, types.int64, types.int64, types.int32[::1], types.float32[:, ::1],
        types.int32[::1]
    ),
    cache=True, nogil=True, error_model="numpy",
)
def fill_buckets(roots, faces, buckets, count, start, stop, firsts, grid, grid_faces):  # type: ignore[no-untyped-def]
    """Put the roots of buckets start .. stop into memory bucket after bucket; ``firsts[b + 1]`` is where b ends."""
    at = 0
    for b in range(start, stop):
        firsts[b + 1] = 0
    for row in range(count):
        b = buckets[row]
        if b < start:
            at += 1
        elif b < stop:
            firsts[b + 1] += 1
    for b in range(start, stop):
        size = firsts[b + 1]
        firsts[b + 1] = at
        at += size
    for row in range(count):
        b = buckets[row]
        if start <= b < stop:
            at = firsts[b + 1]
            firsts[b + 1] += 1
            grid[at, 0], grid[at, 1], grid[at, 2], grid[at, 3] = (
                roots[row, 0], roots[row, 1], roots[row, 2], roots[row, 3]
            )
            grid_faces[at] = faces[row]


@njit(cache=True, inline="always")
def _none_within(roots, start, stop, x, y, z, limit):  # type: ignore[no-untyped-def]
    """Whether no root of these rows is nearer than the root of `limit`; counted, so that eight are done at a time."""
    found = np.int32(0)
    for row in range(np.uintp(start), np.uintp(stop)):
        dx, dy, dz = roots[row, 0] - x, roots[row, 1] - y, roots[row, 2] - z
        found += np.int32(dx * dx + dy * dy + dz * dz < limit)
    return found == 0


@njit(cache=True, inline="always")
def _wake(near, size, level):  # type: ignore[no-untyped-def]
    """The level at which the radius has become smaller than the distance whose square is `near`."""
    if near <= 0.0:
        return NEVER
    near *= 1.0 + 1e-5  # too early does no harm; too late would, by the last digit of the distance
    wake = max(level + 1, int(math.log(near / (FIRST_RADIUS * size) ** 2) * (0.5 / LOG_SHRINK)) + 1)
    return wake if wake < MAX_LEVELS else NEVER


@njit(
    types.int64(U16_1D, types.int64, types.int64, types.int32[::1]), cache=True, nogil=True, error_model="numpy"
)
def waking(wake, end, level, active):  # type: ignore[no-untyped-def]
    """Write the candidates before `end` that are to be tested at `level`, in order; returns how many."""
    found = 0
    for c in range(end):
        active[found] = c
        found += wake[c] == level
    return found


@njit(
    types.int64(F32_1D, types.int64, types.int64, types.int64, types.uint16[::1], types.int32[::1], types.int64),
    cache=True, nogil=True, error_model="numpy",
)
def arriving(stretch, begin, end, level, wake, active, found):  # type: ignore[no-untyped-def]
    """Append candidates begin .. end, but those that are none, to the `found` active ones, to be tested at `level`;
    returns how many are active now."""
    for c in range(begin, end):
        active[found] = c
        if stretch[c] > 0.0:
            wake[c] = level
            found += 1
    return found


@njit(
    types.int64(
        types.boolean, types.int32[::1], types.int64, types.int64, I32_1D, F32_2D, F32_1D, F32_2D,
        types.float32[:, ::1], types.int32[::1], types.int32[::1], types.int32[::1], types.int64[::1], types.float64,
        types.int64, types.float64, types.float64, types.float64, types.int64, types.uint16[::1], types.int64[::1],
        types.int64[::1], types.int64
    ),
    cache=True, nogil=True, error_model="numpy",
)
def test_candidates(  # type: ignore[no-untyped-def]
    accepting, active, start, stop, triangle, places, stretch, normals, roots, faces, firsts, links, counts, cell,
    mask, radius, last_radius, size, level, wake, chosen, levels, accepted
):
    """Put to sleep those of candidates ``active[start:stop]`` that are awake and lie too near a root.

    accepting : make a root of every other one. Roots of a bucket are chained by `firsts` and `links`, which end and
        are left empty with -1. Otherwise they lie from ``firsts[b]`` to ``firsts[b + 1]`` and are only read, so that
        any number of threads can do this at once.

    When a root is clearly near, or nearer than the `last_radius` that is going to be asked for, no nearer one is looked
    for: that changes when a candidate is tested, never what becomes a root. Two roots of different
    stretch keep the distance of the smaller one, so that a ball never leaves 8 cells. Returns how many roots there
    are. (One function, for calls with arrays cost as much as the search. Rows are unsigned: for signed ones
    numba asks at every access whether they count from the end.)
    """
    limit = np.float32(radius * radius)
    enough = np.float32(max(ENOUGH * radius, last_radius) ** 2)
    before = accepted
    for at in range(start, stop):
        c = np.uintp(active[at])
        if wake[c] != level:
            continue
        x, y, z, own, t = places[c, 0], places[c, 1], places[c, 2], stretch[c], triangle[c]
        best = limit  # square of the smallest distance over stretch to a root on the same side of the skin
        for octave in range(OCTAVES):
            if counts[octave] == 0 or best < enough:
                continue
            reach = radius * min(np.float64(own), np.float64(1 << octave))
            scale = 1.0 / (cell * (1 << octave))
            fx, fy, fz = x * scale, y * scale, z * scale
            i0, j0, k0 = math.floor(fx), math.floor(fy), math.floor(fz)
            fx, fy, fz = fx - i0, fy - j0, fz - k0
            # the ball reaches over one side of its own cell at most on every axis
            edge = reach * scale
            di = -1 if fx < edge else (1 if fx > 1.0 - edge else 0)
            dj = -1 if fy < edge else (1 if fy > 1.0 - edge else 0)
            dk = -1 if fz < edge else (1 if fz > 1.0 - edge else 0)
            # squares of the distances to those sides
            side = np.float64(cell * (1 << octave))
            sx = ((fx if di < 0 else 1.0 - fx) * side) ** 2
            sy = ((fy if dj < 0 else 1.0 - fy) * side) ** 2
            sz = ((fz if dk < 0 else 1.0 - fz) * side) ** 2
            widest = min(own, np.float32(1 << octave)) ** 2
            for corner in range(8):
                if (corner & 1 and di == 0) or (corner & 2 and dj == 0) or (corner & 4 and dk == 0):
                    continue
                away = sx * (corner & 1) + sy * (corner >> 1 & 1) + sz * (corner >> 2)
                if away > best * widest:
                    continue
                i, j, k = i0 + di * (corner & 1), j0 + dj * (corner >> 1 & 1), k0 + dk * (corner >> 2)
                b = np.uintp(_bucket(octave, i, j, k, mask))
                row, end = firsts[b], np.int32(-1) if accepting else firsts[b + np.uintp(1)]
                if not accepting and _none_within(roots, row, end, x, y, z, best * widest):
                    continue
                while row != end:
                    r = np.uintp(row)
                    dx, dy, dz = roots[r, 0] - x, roots[r, 1] - y, roots[r, 2] - z
                    d2 = dx * dx + dy * dy + dz * dz
                    both = min(own, roots[r, 3])
                    both *= both
                    if d2 < best * both:
                        u = faces[r]
                        facing = np.float32(1.0)
                        if u != t:
                            facing = (
                                normals[u, 0] * normals[t, 0] + normals[u, 1] * normals[t, 1]
                                + normals[u, 2] * normals[t, 2]
                            )
                        if facing > SAME_SIDE:
                            best = d2 / both
                            if best < enough:
                                break  # it sleeps long anyway; waking a little early does no harm
                    row = links[r] if accepting else row + np.int32(1)
                if best < enough:
                    break
        if best < limit:
            wake[c] = _wake(best, size, level)
        elif accepting:
            wake[c] = NEVER
            octave = _octave(own)
            counts[octave] += 1
            chosen[accepted], levels[accepted], faces[accepted] = c, level, t
            roots[accepted, 0], roots[accepted, 1], roots[accepted, 2], roots[accepted, 3] = x, y, z, own
            b = _bucket_of(x, y, z, octave, cell, mask)
            links[accepted] = firsts[b]
            firsts[b] = accepted
            accepted += 1
    for row in range(before, accepted):
        firsts[_bucket_of(roots[row, 0], roots[row, 1], roots[row, 2], _octave(roots[row, 3]), cell, mask)] = -1
    return accepted
