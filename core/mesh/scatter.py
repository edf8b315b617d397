"""Roots scattered over a skin, progressive and even: sleeping darts.

Darts of a shrinking radius are thrown at the skin. A candidate that lies too near an accepted root sleeps until the
radius has become smaller than its distance, so that few are tested twice; every level of the radius adds about 16 % of
roots, shuffled among themselves. The row of a root is its rank and its stable id: any prefix is an even coat, and a
larger count begins with exactly the roots of a smaller one.
(After McCool and Fiume, "Hierarchical Poisson disk sampling distributions", 1992; sleeping is ours.)
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.mesh.even_subset import Candidates, even_subset
from core.mesh.morton import morton_codes
from core.mesh.normals import face_areas, face_normals
from core.mesh.scatter_kernels import draw_candidates, interpolate, shuffled
from core.random import rand
from core.workers import Workers, serial_ranges

DensityCall = Callable[[NDArray[np.int32], NDArray[np.float32]], NDArray[np.float32]]
Density = NDArray[np.float32] | DensityCall

CANDIDATES_PER_ROOT = 3.0
MAX_STRETCH = 16.0  # where the density is below 1/256 the spacing grows no more
FIRST_BATCH = 64


class Scatter(NamedTuple):
    """N places on T triangles in progressive, even order: the row is the rank and the stable id.

    triangle : (N,) int32.
    barycentric : (N, 3) float32, summing to 1.
    """

    triangle: NDArray[np.int32]
    barycentric: NDArray[np.float32]


def scatter(
    points: NDArray[np.float32],
    triangles: NDArray[np.int32],
    count: int,
    seed: int = 0,
    density: Density | None = None,
    candidates: float = CANDIDATES_PER_ROOT,
    workers: Workers | None = None,
) -> Scatter:
    """Exactly `count` places on `triangles` (T, 3) int32 of `points` (V, 3) float32.

    Parameters
    ----------
    seed : another seed, another coat; the same one gives the same bits.
    density : 0 .. 1, where and how thickly: (V,) float32 per vertex, or a function of candidates
        ``(triangle (M,) int32, barycentric (M, 3) float32) -> (M,)``, such as a look into an image. The local spacing
        goes with density^-1/2; where it is 0 nothing stands.
    candidates : darts thrown per root; more are slower and more even (2: quick, 5: best). It belongs to the
        identity of the result like the seed.

    Raises
    ------
    UserError
        There is no face to stand on, or the density is zero everywhere.
    """
    if count < 0:
        raise UserError(f"A scatter needs a count of 0 or more, not {count}.")
    if count == 0:
        return Scatter(np.empty(0, np.int32), np.empty((0, 3), np.float32))
    seed &= 0xFFFFFFFF
    ground = _Ground(points, triangles, density)
    if not ground.area > 0.0:
        return _complete(ground, Scatter(np.empty(0, np.int32), np.empty((0, 3), np.float32)), count, seed)

    wanted = 1.25 * candidates * 1.35 * count / ground.share + 4096
    most = max(60.0 * count, 4e6)
    while True:
        total = int(min(wanted, most))
        drawn = _draw(ground, total, seed, density, workers)
        chosen, levels, dry = even_subset(drawn, float(np.sqrt(ground.area)), float(candidates), count, workers)
        if len(chosen) >= count or not dry or total >= most:
            break
        wanted = 2.0 * total
    order = shuffled(chosen, levels, seed)[:count]
    rows = chosen[order]
    barycentric = np.empty((len(rows), 3), np.float32)
    interpolate(rows.astype(np.uint32), seed, barycentric)
    found = Scatter(ground.faces[drawn.triangle[rows]], barycentric)
    return found if len(rows) == count else _complete(ground, found, count, seed)


def count_for_density(
    points: NDArray[np.float32],
    triangles: NDArray[np.int32],
    per_square_metre: float,
    density: Density | None = None,
) -> int:
    """How many roots make `per_square_metre` where the density is 1 (and in proportion where it is less)."""
    ground = _Ground(points, triangles, density)
    return round(per_square_metre * ground.area)


class _Ground:
    """The faces that can be stood on, in Morton order, with the proposal that candidates are drawn from."""

    def __init__(self, points: NDArray[np.float32], triangles: NDArray[np.int32], density: Density | None) -> None:
        if not len(triangles):
            raise UserError("Nothing can be scattered on this mesh: it has no faces.")
        areas = face_areas(points, triangles)
        areas[~np.isfinite(areas)] = 0.0
        top, mean = self._face_density(triangles, density)
        if not top.any():
            raise UserError("Nothing can be scattered: the density is zero everywhere; paint some of the skin first.")
        order = np.flatnonzero(top > 0)
        corners = points[triangles[order]].astype(np.float64)
        finite = np.isfinite(corners).all((1, 2))
        order, corners = order[finite], corners[finite]
        if not len(order):
            raise UserError("Nothing can be scattered: no face of the mesh has finite coordinates.")
        rows = corners.reshape(-1, 9)  # numpy is slow at minima of three
        low, high = rows.min(0).reshape(3, 3).min(0), rows.max(0).reshape(3, 3).max(0)
        middles = (corners[:, 0] + corners[:, 1] + corners[:, 2]) / 3.0
        by_place = np.argsort(morton_codes(middles, low, high), kind="stable")
        self.faces = order[by_place].astype(np.int32)
        # relative to the middle, so that float32 places keep their digits far from the origin
        self.corners = np.ascontiguousarray((corners[by_place] - (low + high) / 2).reshape(-1, 9), np.float32)
        self.normals = np.ascontiguousarray(face_normals(points, triangles)[self.faces])
        self.vertices = np.ascontiguousarray(triangles[self.faces], np.int32)
        self.top = top[self.faces]
        weights = areas[self.faces] * self.top
        self.cumulative = np.cumsum(weights)
        # what the roots see as area, and the share of the candidates that will pass the density
        self.area = float((areas[self.faces] * mean[self.faces]).sum())
        self.share = min(1.0, max(1e-3, self.area / self.cumulative[-1])) if self.cumulative[-1] > 0 else 1.0

    @staticmethod
    def _face_density(
        triangles: NDArray[np.int32], density: Density | None
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """The highest and the mean density of each face (estimated from 16 places where it is a function)."""
        count = len(triangles)
        if density is None:
            return np.ones(count, np.float32), np.ones(count, np.float32)
        if callable(density):
            grid = np.array([(i, j, 3 - i - j) for i in range(4) for j in range(4 - i)], np.float64)
            fine = np.array([(i, j, 2 - i - j) for i in range(3) for j in range(3 - i)], np.float64)
            places = np.concatenate([grid * 0.97 / 3 + 0.01, (fine + 1 / 3) / 3]).astype(np.float32)
            values = np.clip(
                density(
                    np.repeat(np.arange(count, dtype=np.int32), len(places)), np.tile(places, (count, 1))
                ).reshape(count, -1),
                0.0, 1.0,
            )
            top, mean = values.max(1), values.mean(1)
            # detail between the samples is found too, if by fewer candidates
            return np.maximum(top, 0.05 * top.max()).astype(np.float32), mean.astype(np.float32)
        corner = np.clip(np.asarray(density, np.float32), 0.0, 1.0)[triangles]
        return corner.max(1), corner.mean(1)


def _draw(
    ground: _Ground, total: int, seed: int, density: Density | None, workers: Workers | None
) -> Candidates:
    """Draw whole batches until `total` candidates; each is stratified over the faces and in their order."""
    ends = [FIRST_BATCH]
    while ends[-1] < total:
        ends.append(ends[-1] + max(FIRST_BATCH, int(0.16 * ends[-1])))
    batches = np.array(ends, np.int64)
    triangle = np.empty(ends[-1], np.int32)
    places = np.empty((ends[-1], 3), np.float32)

    def rows(start: int, stop: int) -> None:
        draw_candidates(ground.cumulative, ground.corners, batches, seed, triangle, places, start, stop)

    (serial_ranges if workers is None else workers.ranges)(ends[-1], rows, 65536)
    stretch = np.ones(len(triangle), np.float32)
    if density is not None:
        barycentric = np.empty((len(triangle), 3), np.float32)
        keys = np.arange(len(triangle), dtype=np.uint32)
        interpolate(keys, seed, barycentric)
        if callable(density):
            values = np.clip(density(ground.faces[triangle], barycentric), 0.0, 1.0)
        else:
            at_corners = np.clip(np.asarray(density, np.float32), 0.0, 1.0)[ground.vertices[triangle]]
            values = (at_corners * barycentric).sum(1)
        passed = rand(keys, seed + 3) * ground.top[triangle] < values
        stretch = np.where(passed, 1.0 / np.sqrt(np.maximum(values, MAX_STRETCH**-2)), 0.0).astype(np.float32)
    return Candidates(triangle, places, stretch, ground.normals, batches)


def _complete(ground: _Ground, found: Scatter, count: int, seed: int) -> Scatter:
    """Fill up to `count` where no even place is left (faces without area, a density of a few pixels)."""
    missing = count - len(found.triangle)
    keys = np.arange(len(found.triangle), count)
    if len(found.triangle):
        rows = (rand(keys, seed + 4) * len(found.triangle)).astype(np.intp)
        more = Scatter(found.triangle[rows], found.barycentric[rows])
    else:
        rows = (rand(keys, seed + 4) * len(ground.faces)).astype(np.intp)
        barycentric = np.empty((missing, 3), np.float32)
        interpolate(keys.astype(np.uint32), seed, barycentric)
        more = Scatter(ground.faces[rows], barycentric)
    return Scatter(
        np.concatenate([found.triangle, more.triangle]), np.concatenate([found.barycentric, more.barycentric])
    )
