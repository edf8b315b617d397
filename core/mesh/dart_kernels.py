"""Kernels of the sleeping darts: roots in a grid of cells, candidates tested against them and against each other."""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types
from numba.cpython.unsafe.numbers import trailing_zeros

F32_1D = types.Array(types.float32, 1, "C", readonly=True)
F32_2D = types.Array(types.float32, 2, "C", readonly=True)
I32_1D = types.Array(types.int32, 1, "C", readonly=True)
I64_1D = types.Array(types.int64, 1, "C", readonly=True)
U16_1D = types.Array(types.uint16, 1, "C", readonly=True)

SHRINK = 0.93  # of the radius from level to level: 16 % more roots each
LOG_SHRINK = math.log(SHRINK)
FIRST_RADIUS = 0.5  # of the root of the area
MAX_LEVELS = 300  # 0.93^300 is beyond what float32 places can tell apart
NEVER = 65535  # level at which nothing wakes
ENOUGH = 0.75  # of the radius: nearer than this the search for the very nearest root ends
BLOCK = 64  # cells hashed together
OCTAVES = 5  # of the stretch: 1, 2, 4, 8, 16
SAME_SIDE = 0.2  # least cosine between the normals of two roots that keep their distance
AT_ONCE = 32  # rows of a bucket looked at together; what is read beyond its end


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
        F32_2D, I32_1D, I32_1D, types.int64, types.int64, types.int64, types.int32[::1], types.float32[::1],
        types.float32[::1], types.float32[::1], types.float32[::1], types.int32[::1], types.int32[::1]
    ),
    cache=True, nogil=True, error_model="numpy",
)
def fill_buckets(points, faces, buckets, count, start, stop, firsts, xs, ys, zs, stretches, sides, rows):  # type: ignore[no-untyped-def]
    """Put the points of buckets start .. stop into memory bucket after bucket; ``firsts[b + 1]`` is where b ends."""
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
            slot = np.uintp(firsts[b + 1])
            firsts[b + 1] += 1
            xs[slot], ys[slot], zs[slot] = points[row, 0], points[row, 1], points[row, 2]
            stretches[slot], sides[slot], rows[slot] = points[row, 3], faces[row], row


@njit(cache=True, inline="always")
def _near_rows(xs, ys, zs, start, count, x, y, z, limit):  # type: ignore[no-untyped-def]
    """Bits of those of up to 32 rows that are nearer than the root of `limit`.

    In steps of eight, which the compiler does at once: rows up to the next multiple of eight are read too.
    """
    bits = np.uint64(0)
    for k in range((count + np.uint32(7)) & np.uint32(0xFFFFFFF8)):
        row = start + np.uintp(k)
        dx, dy, dz = xs[row] - x, ys[row] - y, zs[row] - z
        bits |= np.uint64(dx * dx + dy * dy + dz * dz < limit) << np.uint64(k)
    return bits & ((np.uint64(1) << np.uint64(count)) - np.uint64(1))


@njit(cache=True, inline="always")
def _nearest(  # type: ignore[no-untyped-def]
    x, y, z, own, t, before, normals, points, xs, ys, zs, stretches, sides, rows, firsts, counts, cell, mask, radius,
    enough
):
    """The nearest point of a grid that forbids a root at (x, y, z) on face `t` with stretch `own`: any, or where
    `before` >= 0 one of the points ``0 .. before`` that keeps a distance still.

    Returns the square of its distance over stretch and its row; the square of `radius` and -1 when there is none. The
    search ends where one nearer than the root of `enough` is found.

    Two of different stretch keep the distance of the smaller one, so that a ball never leaves 8 cells. (Inlined, for
    calls with arrays cost as much as the search. Rows are unsigned: for signed ones numba asks at every access whether
    they count from the end.)
    """
    best = np.float32(radius * radius)
    found = np.int32(-1)
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
            at, end = np.uintp(firsts[b]), np.uintp(firsts[b + np.uintp(1)])
            while at < end and best >= enough:
                size = np.uint32(min(end - at, np.uintp(AT_ONCE)))
                bits = _near_rows(xs, ys, zs, at, size, x, y, z, best * widest)
                first = at
                at += np.uintp(AT_ONCE)
                while bits != 0:
                    r = first + np.uintp(trailing_zeros(bits))  # type: ignore[call-arg]
                    bits &= bits - np.uint64(1)
                    dx, dy, dz = xs[r] - x, ys[r] - y, zs[r] - z
                    both = min(own, stretches[r])
                    both *= both
                    d2 = dx * dx + dy * dy + dz * dz
                    if d2 >= best * both:
                        continue
                    if before >= 0 and (rows[r] >= before or points[rows[r], 3] == 0.0):
                        continue
                    u = sides[r]
                    facing = np.float32(1.0)
                    if u != t:
                        facing = (
                            normals[u, 0] * normals[t, 0] + normals[u, 1] * normals[t, 1]
                            + normals[u, 2] * normals[t, 2]
                        )
                    if facing > SAME_SIDE:
                        best, found = d2 / both, rows[r]
                        if best < enough:
                            break
            if best < enough:
                break
    return best, found


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


GRID = (
    F32_2D, F32_2D, F32_1D, F32_1D, F32_1D, F32_1D, I32_1D, I32_1D, I32_1D, I64_1D, types.float64, types.int64
)  # normals, then what :func:`_nearest` asks of a grid, from points to mask


@njit(
    types.void(
        I32_1D, types.int64, types.int64, I32_1D, F32_2D, F32_1D, *GRID, types.float64, types.float64, types.float64,
        types.int64, types.uint16[::1]
    ),
    cache=True, nogil=True, error_model="numpy",
)
def put_to_sleep(  # type: ignore[no-untyped-def]
    active, start, stop, triangle, places, stretch, normals, points, xs, ys, zs, stretches, sides, rows, firsts,
    counts, cell, mask, radius, last_radius, size, level, wake
):
    """Put to sleep those of candidates ``active[start:stop]`` that lie too near a root of the grid.

    When a root is clearly near, or nearer than the `last_radius` that is going to be asked for, no nearer one is looked
    for: that changes when a candidate is tested, never what becomes a root.
    """
    limit = np.float32(radius * radius)
    enough = np.float32(max(ENOUGH * radius, last_radius) ** 2)
    for at in range(start, stop):
        c = np.uintp(active[at])
        best, _ = _nearest(
            places[c, 0], places[c, 1], places[c, 2], stretch[c], triangle[c], -1, normals, points, xs, ys, zs,
            stretches, sides, rows, firsts, counts, cell, mask, radius, enough,
        )
        if best < limit:
            wake[c] = _wake(best, size, level)


@njit(
    types.int64(types.int32[::1], types.int64, F32_1D, U16_1D, types.int64, types.int64[::1]),
    cache=True, nogil=True, error_model="numpy",
)
def awake(active, count, stretch, wake, level, counts):  # type: ignore[no-untyped-def]
    """Bring those of the `count` active candidates that were not put to sleep to the front, in order; returns how many.
    `counts` is how many there are of each octave."""
    counts[:] = 0
    n = 0
    for at in range(count):
        c = np.uintp(active[at])
        if wake[c] == level:
            active[n] = active[at]
            counts[_octave(stretch[c])] += 1
            n += 1
    return n


@njit(
    types.void(
        I32_1D, types.int64, types.int64, I32_1D, F32_2D, F32_1D, types.float32[:, ::1], types.int32[::1]
    ),
    cache=True, nogil=True, error_model="numpy",
)
def gather_active(active, start, stop, triangle, places, stretch, points, faces):  # type: ignore[no-untyped-def]
    """Write place and stretch, and the face, of the active candidates start .. stop."""
    for s in range(start, stop):
        c = np.uintp(active[s])
        points[s, 0], points[s, 1], points[s, 2], points[s, 3] = places[c, 0], places[c, 1], places[c, 2], stretch[c]
        faces[s] = triangle[c]


@njit(
    types.void(types.int64, types.int64, I32_1D, *GRID, types.float64, types.int32[::1], types.float32[::1]),
    cache=True, nogil=True, error_model="numpy",
)
def find_rivals(  # type: ignore[no-untyped-def]
    start, stop, faces, normals, points, xs, ys, zs, stretches, sides, rows, firsts, counts, cell, mask, radius, rival,
    gap
):
    """For points start .. stop of the grid, one that comes before it and lies too near (-1: none), and the square of
    the distance over stretch."""
    for s in range(start, stop):
        gap[s], rival[s] = _nearest(
            points[s, 0], points[s, 1], points[s, 2], points[s, 3], faces[s], s, normals, points, xs, ys, zs,
            stretches, sides, rows, firsts, counts, cell, mask, radius, np.float32((ENOUGH * radius) ** 2),
        )


@njit(
    types.int64(
        I32_1D, types.int64, I32_1D, F32_2D, types.float32[:, ::1], *GRID[2:], types.float64, types.float64,
        types.int64, I32_1D, F32_1D, types.uint16[::1], types.float32[:, ::1], types.int32[::1], types.int64[::1],
        types.int64[::1], types.int64[::1], types.int64
    ),
    cache=True, nogil=True, error_model="numpy",
)
def settle(  # type: ignore[no-untyped-def]
    active, total, faces, normals, points, xs, ys, zs, stretches, sides, rows, firsts, counts, cell, mask, radius,
    size, level, rival, gap, wake, roots, root_faces, octaves, chosen, levels, accepted
):
    """Make roots of the first `total` active candidates, the points of the grid, one after the other where they fit;
    put the others to sleep. `octaves` counts the roots of each. Returns how many roots there are.

    Who has no rival fits, who has one that is a root does not; only who has one that is none looks again.
    """
    limit = np.float32(radius * radius)
    for s in range(total):
        c = np.uintp(active[s])
        x, y, z, own, t = points[s, 0], points[s, 1], points[s, 2], points[s, 3], faces[s]
        best = gap[s]
        if rival[s] >= 0 and points[rival[s], 3] == 0.0:
            best, _ = _nearest(
                x, y, z, own, t, s, normals, points, xs, ys, zs, stretches, sides, rows, firsts, counts, cell, mask,
                radius, np.float32((ENOUGH * radius) ** 2),
            )
        if best < limit:
            wake[c] = _wake(best, size, level)
            points[s, 3] = 0.0  # keeps no distance
            continue
        wake[c] = NEVER
        chosen[accepted], levels[accepted], root_faces[accepted] = c, level, t
        roots[accepted, 0], roots[accepted, 1], roots[accepted, 2], roots[accepted, 3] = x, y, z, own
        octaves[_octave(own)] += 1
        accepted += 1
    return accepted
