"""An even subset of candidates, level by level of a shrinking radius: sleeping darts (see :mod:`core.mesh.scatter`)."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.mesh.dart_kernels import (
    AT_ONCE,
    BLOCK,
    FIRST_RADIUS,
    LOG_SHRINK,
    MAX_LEVELS,
    NEVER,
    OCTAVES,
    SHRINK,
    arriving,
    awake,
    fill_buckets,
    find_buckets,
    find_rivals,
    gather_active,
    put_to_sleep,
    settle,
    waking,
)
from core.workers import Workers, serial_ranges

CELL = 4.0  # size of a cell over the radius; at least 2
CELL_OF_NEW = 4.0  # the same for the few candidates of one level that are left
BUCKETS_PER_ROOT = 1
GRAIN = 4096  # candidates worth a thread


class Candidates(NamedTuple):
    """M candidates in batches, each in the order of the faces.

    triangle : (M,) int32, rows of `normals`. places : (M, 3) float32.
    stretch : (M,) float32, factor on the distance kept; 0: not a candidate.
    normals : (T, 3) float32. ends : (B,) int64, where batches end.
    """

    triangle: NDArray[np.int32]
    places: NDArray[np.float32]
    stretch: NDArray[np.float32]
    normals: NDArray[np.float32]
    ends: NDArray[np.int64]


class Subset(NamedTuple):
    """chosen : (N,) int64 candidates. levels : (N,) int64, the level of each, rising. dry : candidates ran out."""

    chosen: NDArray[np.int64]
    levels: NDArray[np.int64]
    dry: bool


def even_subset(
    candidates: Candidates, size: float, per_root: float, count: int, workers: Workers | None = None
) -> Subset:
    """Choose at least `count` candidates; the last level is finished. `size` is the square root of the area.

    At every level those who wake, then batches of newcomers, are tested against the roots there are; those who pass are
    tested against each other. That is done on all threads; then those who pass become roots one after the other,
    unless one before them is too near. So the result does not depend on threads.
    """
    darts = _Darts(candidates, size, workers)
    ends = candidates.ends
    seen, batch, end, dry = 0, 0, 0, False
    for level in range(MAX_LEVELS):
        if darts.accepted >= count or dry:
            break
        found = woken = waking(darts.wake, end, level, darts.active)
        # as many as the roots of this level will ask for
        while seen == 0 or seen < 1.25 * per_root * darts.accepted / SHRINK**2:
            if batch == len(ends):
                dry = True
                break
            begin, end = end, int(ends[batch])
            batch += 1
            before = found
            found = arriving(candidates.stretch, begin, end, level, darts.wake, darts.active, found)
            seen += found - before
        darts.throw(woken, found, level, _last_level(level, darts.accepted, count))
    n = darts.accepted
    return Subset(darts.chosen[:n].copy(), darts.levels[:n].copy(), dry)


def _last_level(level: int, accepted: int, count: int) -> int:
    """The level that will bring the roots to `count`, as each has SHRINK^-2 times the roots of the one before."""
    missing = count / max(1, accepted)
    return level + max(0, math.ceil(math.log(missing) / (-2.0 * LOG_SHRINK)) - 1)


class _Cells(NamedTuple):
    """The points of a grid as kernels take them.

    points : (room, 4) float32, place and stretch in the order they came.
    x, y, z, stretch, sides, rows : the same bucket after bucket, with face and row; those of bucket b lie from
        ``firsts[b]`` to ``firsts[b + 1]``.
    counts : how many there are of each octave of the stretch. cell : size. mask : of the hash.
    """

    points: NDArray[np.float32]
    x: NDArray[np.float32]
    y: NDArray[np.float32]
    z: NDArray[np.float32]
    stretch: NDArray[np.float32]
    sides: NDArray[np.int32]
    rows: NDArray[np.int32]
    firsts: NDArray[np.int32]
    counts: NDArray[np.int64]
    cell: float
    mask: int


class _Grid:
    """Points that are sorted into cells anew at every level.

    points, faces, counts : (room, 4) and (room,), to be written; see :class:`_Cells`.
    """

    def __init__(self, room: int, ranges: Callable[..., None]) -> None:
        self._ranges = ranges
        # room for all candidates costs no memory where nothing is written
        self.points, self.faces = np.empty((room, 4), np.float32), np.empty(room, np.int32)
        self.counts = np.zeros(OCTAVES, np.int64)
        x, y, z, stretch = (np.empty(room + AT_ONCE, np.float32) for _ in range(4))
        self._sorted = x, y, z, stretch, np.empty(room, np.int32), np.empty(room, np.int32)
        self._buckets = np.empty(room, np.int32)
        self._mask, self._firsts = 0, np.zeros(BLOCK + 1, np.int32)

    def cells(self, n: int, cell: float) -> _Cells:
        """The first `n` points, sorted into cells of this size."""
        while BUCKETS_PER_ROOT * n > BLOCK * (self._mask + 1):
            self._mask = 2 * self._mask + 1
        count = BLOCK * (self._mask + 1)
        if len(self._firsts) <= count:
            self._firsts = np.zeros(count + 1, np.int32)
        self._ranges(n, lambda a, b: find_buckets(self.points, a, b, cell, self._mask, self._buckets), GRAIN)
        self._ranges(
            count,
            lambda a, b: fill_buckets(self.points, self.faces, self._buckets, n, a, b, self._firsts, *self._sorted),
            GRAIN,
        )
        return _Cells(self.points, *self._sorted, self._firsts, self.counts, cell, self._mask)


class _Darts:
    """Roots in a grid of cells, and the candidates that sleep.

    accepted, chosen, levels : how many roots, the candidate and the level of each.
    wake : (M,) uint16, the level at which a candidate is to be tested.
    active : (M + 1,) int32, room for the candidates tested at once.
    """

    def __init__(self, candidates: Candidates, size: float, workers: Workers | None) -> None:
        self._candidates, self._size = candidates, size
        self._ranges = serial_ranges if workers is None else workers.ranges
        total = len(candidates.triangle)
        self.accepted = 0
        self.chosen, self.levels = np.empty(total, np.int64), np.empty(total, np.int64)
        self._roots, self._left = _Grid(total, self._ranges), _Grid(total, self._ranges)
        self._rival, self._gap = np.empty(total, np.int32), np.empty(total, np.float32)
        self.wake = np.full(total, NEVER, np.uint16)
        self.active = np.empty(total + 1, np.int32)

    def throw(self, woken: int, count: int, level: int, last: int) -> None:
        """Make roots of the first `count` of the active candidates where they fit; the rest sleeps, most of them for
        good when they lie too near for the level `last`. The first `woken` have slept before."""
        radius = FIRST_RADIUS * self._size * SHRINK**level
        last_radius = FIRST_RADIUS * self._size * SHRINK**last
        triangle, places, stretch, normals = self._candidates[:4]
        roots, left = self._roots, self._left
        known = roots.cells(self.accepted, CELL * radius)

        def test(start: int, stop: int) -> None:
            # the same share of both, for those who slept fit more often, which takes a longer search to say
            for begin, size in ((0, woken), (woken, count - woken)):
                put_to_sleep(
                    self.active, begin + size * start // count, begin + size * stop // count, triangle, places, stretch,
                    normals, *known, radius, last_radius, self._size, level, self.wake,
                )

        self._ranges(count, test, GRAIN)
        total = awake(self.active, count, stretch, self.wake, level, left.counts)
        self._ranges(
            total,
            lambda a, b: gather_active(self.active, a, b, triangle, places, stretch, left.points, left.faces),
            GRAIN,
        )
        new = left.cells(total, CELL_OF_NEW * radius)
        self._ranges(
            total, lambda a, b: find_rivals(a, b, left.faces, normals, *new, radius, self._rival, self._gap), GRAIN // 4
        )
        self.accepted = settle(
            self.active, total, left.faces, normals, *new, radius, self._size, level, self._rival, self._gap, self.wake,
            roots.points, roots.faces, roots.counts, self.chosen, self.levels, self.accepted,
        )
