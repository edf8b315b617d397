"""An even subset of candidates, level by level of a shrinking radius: sleeping darts (see :mod:`core.mesh.scatter`)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.mesh.scatter_kernels import (
    BLOCK,
    FIRST_RADIUS,
    LOG_SHRINK,
    MAX_LEVELS,
    NEVER,
    OCTAVES,
    SHRINK,
    arriving,
    fill_buckets,
    find_buckets,
    test_candidates,
    waking,
)
from core.workers import Workers, serial_ranges

CELL = 4.0  # size of a cell over the radius; at least 2
CELL_OF_NEW = 8.0  # the same for the few roots of one level
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

    At every level those who wake, then batches of newcomers, are tested against the roots there are, on all threads;
    those who pass are tested against each other, one after the other. So the result does not depend on threads.
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
        # room for all candidates costs no memory where nothing is written
        self.chosen, self.levels = np.empty(total, np.int64), np.empty(total, np.int64)
        # of each root its place and stretch, in order of acceptance; the grid has them in order of buckets
        self._roots, self._faces = np.empty((total, 4), np.float32), np.empty(total, np.int32)
        self._grid, self._grid_faces = np.empty_like(self._roots), np.empty_like(self._faces)
        self._buckets, self._links = np.empty_like(self._faces), np.empty_like(self._faces)
        self.wake = np.full(total, NEVER, np.uint16)
        self.active = np.empty(total + 1, np.int32)
        self._counts, self._new_counts = np.zeros(OCTAVES, np.int64), np.zeros(OCTAVES, np.int64)
        self._mask = 0
        self._firsts, self._new_firsts = np.zeros(BLOCK + 1, np.int32), np.full(BLOCK, -1, np.int32)

    def throw(self, woken: int, count: int, level: int, last: int) -> None:
        """Make roots of the first `count` of the active candidates where they fit; the rest sleeps, most of them for
        good when they lie too near for the level `last`. The first `woken` have slept before."""
        radius = FIRST_RADIUS * self._size * SHRINK**level
        cell = CELL * radius
        self._build_grid(cell)
        known = self._candidates[:4]
        last_radius = FIRST_RADIUS * self._size * SHRINK**last
        at = radius, last_radius, self._size, level, self.wake, self.chosen, self.levels, self.accepted

        def test(start: int, stop: int) -> None:
            # the same share of both, for those who slept fit more often, which takes a longer search to say
            for begin, size in ((0, woken), (woken, count - woken)):
                test_candidates(
                    False, self.active, begin + size * start // count, begin + size * stop // count, *known,
                    self._grid, self._grid_faces, self._firsts, self._links, self._counts, cell, self._mask, *at,
                )

        self._ranges(count, test, GRAIN)
        self._new_counts[:] = 0
        self.accepted = test_candidates(
            True, self.active, 0, count, *known, self._roots, self._faces, self._new_firsts, self._links,
            self._new_counts, CELL_OF_NEW * radius, self._mask >> 2, *at,
        )
        self._counts += self._new_counts

    def _build_grid(self, cell: float) -> None:
        n = self.accepted
        while BUCKETS_PER_ROOT * n > BLOCK * (self._mask + 1):
            self._mask = 2 * self._mask + 1
        count = BLOCK * (self._mask + 1)
        if len(self._new_firsts) < count:
            self._firsts, self._new_firsts = np.zeros(count + 1, np.int32), np.full(count, -1, np.int32)
        self._ranges(
            n, lambda a, b: find_buckets(self._roots, a, b, cell, self._mask, self._buckets), GRAIN
        )
        self._ranges(
            count,
            lambda a, b: fill_buckets(
                self._roots, self._faces, self._buckets, n, a, b, self._firsts, self._grid, self._grid_faces
            ),
            GRAIN,
        )
