"""What a groom sees of the binding: guides as sites of its skin, kept up to date as guides are planted and deleted."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.groom.children import Children
from core.groom.guides import Guides
from core.mesh.intrinsic import Binding, Rebound, SurfaceSites
from core.mesh.mesh import Mesh, Triangles
from core.mesh.roots import Roots
from core.workers import Workers

MOST_EDITS = 64  # guides changed at once beyond which everything is bound anew
DRIFT = 0.5  # edits over guides beyond which likewise: each leaves a triangulation a little off the best


def triangle_places(
    mesh: Mesh, triangles: Triangles, roots: Roots
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """Where roots lie on the triangulation: triangle (N,) int32 and weights of its corners (N, 3) float64.

    A root whose three corners are no triangle of its face (a quad cut along the other diagonal) goes to the triangle
    it lies over.
    """
    n = len(roots.faces)
    triangle, bary = np.zeros(n, np.int32), np.zeros((n, 3))
    best = np.full(n, -np.inf)
    by_face = np.argsort(triangles.faces, kind="stable")
    starts = np.searchsorted(triangles.faces[by_face], np.arange(len(mesh.counts) + 1))
    own = starts[roots.faces + 1] - starts[roots.faces]
    corner = mesh.starts[roots.faces][:, None] + roots.corners
    place = np.einsum("nk,nkc->nc", roots.weights.astype(np.float64), mesh.points[mesh.corners[corner]])
    for k in range(int(own.max()) if n else 0):
        rows = np.flatnonzero((own > k) & (best < 0.0))
        if not len(rows):
            break
        candidate = by_face[starts[roots.faces[rows]] + k]
        its = triangles.corners[candidate]
        match = its[:, :, None] == corner[rows][:, None, :]  # (n, corner of triangle, corner of root)
        exact = match.any(axis=2).all(axis=1)
        weights = np.einsum("nij,nj->ni", match, roots.weights[rows].astype(np.float64))
        other = ~exact
        weights[other] = _weights_in(place[rows[other]], mesh.points[mesh.corners[its[other]]].astype(np.float64))
        worth = np.where(exact, np.inf, np.minimum(weights.min(axis=1), -1e-12))
        better = worth > best[rows]
        rows = rows[better]
        triangle[rows], bary[rows], best[rows] = candidate[better], weights[better], worth[better]
    bary = np.clip(bary, 0.0, None)
    total = bary.sum(axis=1, keepdims=True)
    return triangle, np.where(total > 0.0, bary / np.where(total > 0.0, total, 1.0), 1.0 / 3.0)


def _weights_in(place: NDArray[np.float64], corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Barycentric weights (N, 3) of places (N, 3) dropped onto triangles (N, 3, 3)."""
    u, v, w = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], place - corners[:, 0]
    uu, uv, vv = (u * u).sum(1), (u * v).sum(1), (v * v).sum(1)
    wu, wv = (w * u).sum(1), (w * v).sum(1)
    det = uu * vv - uv * uv
    det = np.where(det > 0.0, det, np.inf)
    b, c = (vv * wu - uv * wv) / det, (uu * wv - uv * wu) / det
    return np.stack([1.0 - b - c, b, c], axis=1)


class CoatBinding:
    """The binding of one coat, kept as its guides change. Mutable; owned by an evaluator.

    Parameters
    ----------
    mesh, triangles : the skin at rest; bindings do not change with the pose.
    triangle, barycentric : (N,) int32 and (N, 3), places of the children in rank order.
    """

    def __init__(
        self, mesh: Mesh, triangles: Triangles, guides: Guides, triangle: NDArray[np.int32],
        barycentric: NDArray[np.float32], seed: int = 0, workers: Workers | None = None,
    ) -> None:
        self._mesh, self._triangles, self._seed, self._workers = mesh, triangles, seed, workers
        self._places = triangle, barycentric
        self._bind(guides)

    def _bind(self, guides: Guides) -> None:
        sites = triangle_places(self._mesh, self._triangles, guides.roots)
        self._sites = SurfaceSites(
            self._mesh.points, self._triangles.vertices, *sites, *self._places, seed=self._seed,
            workers=self._workers,
        )
        self._ids, self._roots = guides.ids, guides.roots

    def binding(self) -> Binding:
        """The binding as it stands."""
        return self._sites.binding()

    def serves(self, guides: Guides) -> bool:
        """True when the binding is that of these very roots."""
        return guides.ids is self._ids and guides.roots is self._roots

    @property
    def edited(self) -> bool:
        """True when guides were planted or deleted since everything was bound: a little off what binding anew gives."""
        return self._sites.edits > 0

    def edits_to(self, guides: Guides) -> int | None:
        """How many guides must be added and taken away to serve these; None when only binding anew will do."""
        gone, kept, new = self._difference(guides)
        count = len(gone) + len(new)
        stays = (
            count <= MOST_EDITS
            and len(kept) > 0
            and self._sites.edits + count <= max(MOST_EDITS, DRIFT * len(guides.ids))
            and np.array_equal(self._ids[kept], guides.ids[: len(kept)])
            and _same_roots(self._roots, kept, guides.roots)
        )
        if not stays or (count and self._sites.must_rebuild(gone, self._places_of(guides, new)[0])):
            return None
        return count

    def update(self, guides: Guides, children: Children) -> NDArray[np.int32]:
        """Follow planted, deleted and re-rooted guides; the rows of `children` to evaluate again.

        New guides stand after the old ones, deleted ones leave the rest in order, as every kernel of the groom does
        it; anything else, or very much at once, binds everything anew. Under a millisecond for one guide.
        """
        if self.serves(guides):
            return np.zeros(0, np.int32)
        if self.edits_to(guides) is None:
            self._bind(guides)
            return self.rebind_all(children)
        gone, _, new = self._difference(guides)
        rows = [np.zeros(0, np.int32)]
        for row in gone[::-1]:
            rebound = self._sites.remove_site(int(row))
            children.guide_removed(int(row))
            rows.append(children.rebind(rebound))
        if len(new):
            triangle, bary = self._places_of(guides, new)
            for t, b in zip(triangle, bary, strict=True):
                rows.append(children.rebind(self._sites.add_site(int(t), b)))
        self._ids, self._roots = guides.ids, guides.roots
        return np.unique(np.concatenate(rows)).astype(np.int32)

    def rebind_all(self, children: Children) -> NDArray[np.int32]:
        """Give this binding to all `children`; their rows."""
        bound = self.binding()
        return children.rebind(Rebound(np.arange(len(children), dtype=np.int32), bound.sites, bound.weights))

    def _places_of(self, guides: Guides, rows: NDArray[np.intp]) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        return triangle_places(self._mesh, self._triangles, guides.roots.take(rows))

    def _difference(
        self, guides: Guides
    ) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
        """Rows that are gone, rows that were kept, and rows of `guides` that are new."""
        gone = np.flatnonzero(~np.isin(self._ids, guides.ids))
        kept = np.delete(np.arange(len(self._ids)), gone)
        return gone, kept, np.arange(len(kept), len(guides.ids))


def _same_roots(old: Roots, kept: NDArray[np.intp], new: Roots) -> bool:
    n = len(kept)
    return (
        np.array_equal(old.faces[kept], new.faces[:n])
        and np.array_equal(old.corners[kept], new.corners[:n])
        and np.array_equal(old.weights[kept], new.weights[:n])
    )
