"""Children: the hairs of a coat, bound to guides and evaluated into one large buffer.

A :class:`Children` is mutable and owned by an evaluator; nothing of it is ever in a document. Unbaked, a child costs
40 bytes: triangle 4, its weights 8, three guides 12, their weights 8, id 4, length 4. Points (12 P) are extra.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.groom import children_kernels as kernels
from core.groom.children_shape import clump_profile, frizz_waves, shape_children
from core.mesh.intrinsic import Binding, Rebound
from core.workers import Workers, serial_ranges

Ranges = Callable[..., None]
BLOCK = 2048  # children shaped while they are still in the cache


Number = float | NDArray[np.float32]  # the same for all children, or (N,), one for each row


class Shape(NamedTuple):
    """What is done to children after interpolation, see :mod:`core.groom.children_shape`; zero does nothing."""

    clump: Number = 0.0
    frizz: Number = 0.0
    seed: int = 0


class Traits(NamedTuple):
    """What the values of a coat came to at one frame: numbers, or columns in the order of the rows of children.

    density : share of the children shown, 0 .. 1. width_root, width_tip : diameters, metres.
    """

    shape: Shape = Shape()
    density: Number = 1.0
    width_root: Number = 8e-5
    width_tip: Number = 2e-5


class Baked(NamedTuple):
    """Curves in rank order: points (n, P, 3) float32, ids (n,) int32, root_uvs (n, 2) float32, the rows of guides each
    was grown from (n, 3) int32 and their weights (n, 3) float32."""

    points: NDArray[np.float32]
    ids: NDArray[np.int32]
    root_uvs: NDArray[np.float32]
    sites: NDArray[np.int32]
    weights: NDArray[np.float32]


class Children:
    """Columns of N children of P points, rows sorted by triangle of guides.

    ids : (N,) int32, stable id and rank: any prefix by id is an even coat.
    triangle, bary : (N,) int32 and (N, 2) float32, where they stand on the skin; the third weight is 1 - sum.
    sites, weights : (N, 3) int32 rows of guides and (N, 2) float32; the third weight is 1 - sum.
    length : (N,) float32, factor on the interpolated curve.
    traits : what the coat says about them; :func:`core.groom.coat_values.set_coat` writes it and the length.
    points : (N, 3, P) float32, written by :func:`evaluate`; made at first use.

    Parameters
    ----------
    triangle, barycentric : (N,) and (N, 3), places in rank order, as scattered.
    binding : of those places.
    triangles : (T, 3) int32. triangle_uvs : (T, 3, 2) float32 or None.
    ranges : threads, to sort the rows with.
    """

    def __init__(
        self, triangle: NDArray[np.int32], barycentric: NDArray[np.float32], binding: Binding,
        triangles: NDArray[np.int32], triangle_uvs: NDArray[np.float32] | None = None, count: int = 16,
        ranges: Ranges = serial_ranges,
    ) -> None:
        n = len(binding.order)
        self.ids = binding.order.astype(np.int32)
        self.triangle, self.bary = np.empty(n, np.int32), np.empty((n, 2), np.float32)
        self.sites, self.weights = np.empty((n, 3), np.int32), np.empty((n, 2), np.float32)
        places = np.ascontiguousarray(triangle, np.int32), np.ascontiguousarray(barycentric, np.float32)
        ranges(n, lambda start, stop: kernels.take_places(
            self.ids, *places, binding.sites, binding.weights, start, stop, self.triangle, self.bary, self.sites,
            self.weights,
        ), 16384)
        self.length = np.ones(n, np.float32)
        self.traits = Traits()
        self.count = count
        self.triangles = np.ascontiguousarray(triangles, np.int32)
        self.triangle_uvs = triangle_uvs
        self.skin_points: NDArray[np.float32] | None = None
        self.skin_normals: NDArray[np.float32] | None = None
        # how far each is from its nearest guide, of which roots and up to which reach; see core.groom.reach
        self.near: tuple[object, float, NDArray[np.float32]] | None = None
        self.footing: tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.float32]] | None = None  # likewise
        self._points: NDArray[np.float32] | None = None
        self._prepared = np.empty((0, 4, count), np.float32)
        self._row_of: NDArray[np.int32] | None = None
        self._guides = int(self.sites.max()) + 1 if n else 0  # at least so many are needed

    def __len__(self) -> int:
        return len(self.ids)

    @property
    def points(self) -> NDArray[np.float32]:
        """(N, 3, P) float32, the evaluated curves."""
        if self._points is None:
            self._points = np.zeros((len(self), 3, self.count), np.float32)
        return self._points

    @property
    def bytes_unbaked(self) -> int:
        """Bytes of all columns but the points."""
        columns = (self.ids, self.triangle, self.bary, self.sites, self.weights, self.length)
        return sum(c.nbytes for c in columns + self.traits[1:] + self.traits.shape[:2] if isinstance(c, np.ndarray))

    @property
    def row_of(self) -> NDArray[np.int32]:
        """(N,) int32, the row of every id; made at first use."""
        if self._row_of is None:
            self._row_of = np.empty(len(self), np.int32)
            self._row_of[self.ids] = np.arange(len(self), dtype=np.int32)
        return self._row_of

    def rebind(self, rebound: Rebound) -> NDArray[np.int32]:
        """Take over changed bindings; the rows to be evaluated again. Rows keep their place, ids their row."""
        rows = self.row_of[rebound.rows]
        self.near = None
        self.sites[rows] = rebound.sites
        before = self._guides if len(rows) < len(self) else 0
        self._guides = max(before, int(rebound.sites.max()) + 1 if len(rows) else 0)
        self.weights[rows] = rebound.weights[:, :2]
        return rows

    def guide_removed(self, row: int) -> None:
        """Guides after `row` moved up by one; call it before :meth:`rebind`."""
        kernels.lower_sites(self.sites, row)
        self._guides -= self._guides > row

    def rows_of(self, moved: NDArray[np.bool_], ranges: Ranges = serial_ranges) -> NDArray[np.int32]:
        """Rows that hang on any of the guides of the mask (G,), ascending."""
        rows = np.empty(len(self), np.int32)
        parts: list[tuple[int, int]] = []
        mask = np.ascontiguousarray(moved).view(np.uint8)

        def scan(start: int, stop: int) -> None:
            parts.append((start, kernels.rows_of_guides(self.sites, mask, start, stop, rows)))

        ranges(len(self), scan, 32768)
        parts.sort()
        return parts_joined(rows, parts)

    def roots(self, ranges: Ranges = serial_ranges) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Where the children stand on the skin as it is now and their unit normals, (N, 3) float32 each."""
        root, normal = np.empty((len(self), 3), np.float32), np.empty((len(self), 3), np.float32)
        skin_points, skin_normals = self._skin()
        ranges(len(self), lambda start, stop: kernels.child_roots(
            skin_points, skin_normals, self.triangles, self.triangle, self.bary, start, stop, root, normal
        ), 16384)
        return root, normal

    def shown(self, density: Number = 1.0) -> NDArray[np.int32]:
        """Rows of the children with rank below `density` times their number, in rank order.

        With a density for each row a child is kept by its own, so that none pops while another changes.
        """
        if isinstance(density, np.ndarray):
            return self.row_of[np.sort(self.ids[self.ids < density.astype(np.float64) * len(self) - 1e-9])]
        return self.row_of[: int(np.ceil(np.clip(density, 0.0, 1.0) * len(self) - 1e-9))]

    def baked(self, density: Number = 1.0, ranges: Ranges = serial_ranges) -> Baked:
        """The evaluated children :meth:`shown` at that density, in rank order."""
        rows = np.ascontiguousarray(self.shown(density))
        points = np.empty((len(rows), self.count, 3), np.float32)
        source = self.points
        ranges(len(rows), lambda start, stop: kernels.bake_rows(source, rows, start, stop, points))
        uvs = self.root_uvs(rows)
        if uvs is None:
            uvs = np.zeros((len(rows), 2), np.float32)
        return Baked(points, self.ids[rows], uvs, self.sites[rows], _third(self.weights[rows]))

    def barycentric(self) -> NDArray[np.float32]:
        """Weights (N, 3) of the corners of the triangle each stands on."""
        return _third(self.bary)

    def root_uvs(self, rows: NDArray[np.int32] | slice = slice(None)) -> NDArray[np.float32] | None:
        """Where the children of these rows stand by UV, (n, 2) float32; None when the skin has no UVs."""
        if self.triangle_uvs is None:
            return None
        uvs = np.einsum("nk,nkc->nc", _third(self.bary[rows]), self.triangle_uvs[self.triangle[rows]])
        return np.asarray(uvs, np.float32)

    def _skin(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        if self.skin_points is None or self.skin_normals is None:
            raise ValueError("update_roots must say where the skin is before children are evaluated")
        return self.skin_points, self.skin_normals


def parts_joined(rows: NDArray[np.int32], parts: list[tuple[int, int]]) -> NDArray[np.int32]:
    """The filled pieces (start, count) of `rows`, one after another."""
    if len(parts) == 1:
        return rows[parts[0][0] : parts[0][0] + parts[0][1]]
    return np.concatenate([rows[:0], *(rows[start : start + count] for start, count in parts)])


def _third(two: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.concatenate([two, 1.0 - two.sum(axis=1, keepdims=True, dtype=np.float32)], axis=1)


def _column(number: Number, count: int) -> NDArray[np.float32]:
    """A number for kernels: (1,) float32 when it is the same for all, else (count,)."""
    if not isinstance(number, np.ndarray):
        return np.full(1, number, np.float32)
    if number.shape != (count,):
        raise ValueError(f"{count} children need one number for all or {count} of them, not {number.shape}")
    return np.ascontiguousarray(number, np.float32)


def update_roots(children: Children, points: NDArray[np.float32], normals: NDArray[np.float32]) -> None:
    """Say where the skin is: vertices (V, 3) float32 and their smooth unit normals. Evaluate all children next."""
    children.skin_points = np.ascontiguousarray(points, np.float32)
    children.skin_normals = np.ascontiguousarray(normals, np.float32)


def moved_guides(
    old: NDArray[np.float32], new: NDArray[np.float32], ranges: Ranges = serial_ranges
) -> NDArray[np.bool_]:
    """Which rows of two (G, P, 3) float32 arrays differ in any bit, (G,) bool."""
    if old.shape != new.shape:
        raise ValueError("moved_guides compares guides of the same number and points")
    out = np.zeros(len(new), np.uint8)
    if old is not new and len(new):
        before = np.ascontiguousarray(old).reshape(len(old), -1).view(np.uint32)
        after = np.ascontiguousarray(new).reshape(len(new), -1).view(np.uint32)
        ranges(len(new), lambda start, stop: kernels.differ(before, after, start, stop, out), 1024)
    return out.view(np.bool_)


def evaluate(
    children: Children, guide_points: NDArray[np.float32], guide_normals: NDArray[np.float32],
    workers: Workers | None = None, moved: NDArray[np.bool_] | None = None, rows: NDArray[np.int32] | None = None,
    shape: Shape = Shape(),  # noqa: B008 a named tuple cannot be changed
) -> NDArray[np.int32] | None:
    """Write the curves of the children into ``children.points``.

    Parameters
    ----------
    guide_points : (G, P, 3) float32, on the skin given to :func:`update_roots`.
    guide_normals : (G, 3) float32, unit normals of the skin at the roots of the guides.
    moved : (G,) bool, guides that differ from the last evaluation: only their children are touched.
    rows : (n,) int32, only these children (beside those of `moved`).

    Returns
    -------
    The rows that were written, None when all were.
    """
    ranges: Ranges = serial_ranges if workers is None else workers.ranges
    guide_points = np.ascontiguousarray(guide_points, np.float32)
    guide_normals = np.ascontiguousarray(guide_normals, np.float32)
    skin_points, skin_normals = children._skin()
    guides = len(guide_points)
    if guide_points.shape[1:] != (children.count, 3):
        raise ValueError(f"these children need guides of {children.count} points")
    if guides < children._guides:
        raise ValueError("children are bound to a guide that is not there")
    some = moved is not None or rows is not None
    fresh = children._prepared.shape[0] != guides
    if fresh:
        children._prepared = np.empty((guides, 4, children.count), np.float32)
    prepared = children._prepared
    mask = np.ones(guides, np.uint8) if moved is None or fresh else np.ascontiguousarray(moved).view(np.uint8)
    ranges(guides, lambda a, b: kernels.prepare_guides(guide_points, guide_normals, mask, a, b, prepared), 512)

    wanted = np.zeros(1, np.int32)
    count = len(children)
    if some:
        wanted = np.empty(0, np.int32) if moved is None else children.rows_of(moved, ranges)
        if rows is not None:
            wanted = rows if moved is None else np.union1d(wanted, rows)
        wanted = np.ascontiguousarray(wanted, np.int32)
        count = len(wanted)
    grow = kernels.grow_16 if children.count == 16 else kernels.grow_any
    out = children.points
    clump, frizz = _column(shape.clump, len(children)), _column(shape.frizz, len(children))
    shaped = bool((clump > 0.0).any() or (frizz > 0.0).any())
    if shaped:
        profile, waves = clump_profile(children.count), frizz_waves(children.count, shape.seed)
        guide_roots = np.ascontiguousarray(guide_points[:, 0])

    def part(start: int, stop: int) -> None:
        step = BLOCK if shaped else stop - start
        for a in range(start, stop, step):
            b = min(a + step, stop)
            grow(
                prepared, guide_normals, children.triangles, skin_points, skin_normals, children.triangle,
                children.bary, children.sites, children.weights, children.length, wanted, some, a, b, out,
            )
            if shaped:
                shape_children(
                    prepared, children.ids, guide_roots, children.length, children.sites, children.weights, profile,
                    waves, guide_normals, clump, frizz, shape.seed, wanted, some, a, b, out,
                )

    ranges(count, part)
    return wanted if some else None
