"""The hairs of one groom while it is edited: only what an edit touched is made again, the rest later, in slices.

What is owed to a hair is counted: it may have to be evaluated and settled, settled only, or nothing. While a hand moves
only the hairs on the screen are evaluated; :meth:`LiveCoat.catch_up` pays the rest. When nothing is owed any more and
the binding is not an edited one, the hairs are those of :func:`core.groom.grow.grow` to the bit.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.evaluator import Evaluator
from core.groom.binding import CoatBinding
from core.groom.children import Children, Number, evaluate, moved_guides, update_roots
from core.groom.coat_values import set_coat
from core.groom.collision import Collision, settle_rows
from core.groom.groom import COAT_VALUES, Groom, Map
from core.groom.grow import scattered
from core.groom.guides import Guides
from core.groom.resample import with_point_count
from core.groom.rows import take_rows
from core.mesh.mesh import Mesh
from core.mesh.scatter import Scatter
from core.mesh.skin import Posed, skin_at_rest
from core.mesh.surface import root_normals, strands_on_deformed
from core.value import Constant, Formula, Value, names_used

NOTHING, SETTLE, EVALUATE = np.uint8(0), np.uint8(1), np.uint8(2)
MOST_AT_ONCE = 12  # guides planted or deleted at once that are followed; more are bound anew in the background
NO_ROWS = np.zeros(0, np.int32)


def places_of(groom: Groom, mesh: Mesh, evaluator: Evaluator) -> Scatter:
    """Where the hairs of a groom stand, remembered by the evaluator; slow the first time."""
    return evaluator.get(
        scattered, mesh, _density_map(groom), count=groom.coat.count, seed=groom.coat.seed, evaluator=evaluator
    )


def bind_coat(groom: Groom, mesh: Mesh, evaluator: Evaluator) -> CoatBinding:
    """The hairs of a groom bound to its guides; slow. For :meth:`LiveCoat.take_binding`."""
    places = places_of(groom, mesh, evaluator)
    triangles = skin_at_rest(mesh, evaluator).triangles
    return CoatBinding(
        mesh, triangles, groom.guides, places.triangle, places.barycentric, groom.coat.seed, evaluator.workers
    )


class LiveCoat:
    """The hairs of one groom that follow the document. Mutable; made on any thread, from then on used on one.

    Making one scatters, binds and evaluates (half a second for 200,000 hairs): do it in the background.

    mesh : what it grows on, at rest. guides : those the hairs hang on now, as the document has them.
    children : the hairs; their rows keep their places. normals : (N, 3) float32 of the skin at their roots.
    guide_points : (G, P, 3) float32, the guides on the skin in its pose, with as many points as the hairs have.
    guide_normals : (G, 3) float32 of the skin at their roots.
    order : (M,) int32, rows of the hairs shown at the density of the coat, any first part of it an even coat.
    trouble : why the values of the coat cannot be evaluated (the hairs stay as they were), or None.

    Parameters
    ----------
    posed : where the skin is; at rest when None.
    rows_shown : so many hairs, in their order, are evaluated at once; all when None.

    Raises
    ------
    UserError
        The groom has no guides, or its hairs cannot be scattered.
    """

    def __init__(
        self, groom: Groom, mesh: Mesh, evaluator: Evaluator, frame: float, posed: Posed | None = None,
        rows_shown: int | None = None,
    ) -> None:
        if len(groom.guides) == 0:
            raise UserError("this groom has no guides; plant some before hair can grow")
        rest = skin_at_rest(mesh, evaluator)
        self.mesh, self._skin, self._workers, self._evaluator = mesh, rest, evaluator.workers, evaluator
        self._key = _growth_key(groom)
        self._at_rest = Posed(rest.points, rest.normals)
        places = places_of(groom, mesh, evaluator)
        self._binding = bind_coat(groom, mesh, evaluator)
        uvs = None if mesh.uvs is None else mesh.uvs[rest.triangles.corners]
        self.children = Children(
            *places, self._binding.binding(), rest.triangles.vertices, uvs, groom.coat.points, evaluator.workers.ranges
        )
        n = len(self.children)
        self._owed = np.full(n, EVALUATE, np.uint8)
        self._shown = np.ones(n, np.bool_)
        self.order = self.children.row_of
        self.normals = np.zeros((n, 3), np.float32)
        self.guides = groom.guides
        self._rest_points = _fitted(groom.guides, self.children.count)
        self._groom: Groom | None = None
        self._frame = frame
        self.trouble: UserError | None = None
        self._behind = False
        self._posed = self._at_rest
        self._stand()
        self.follow(groom, frame, posed, rows_shown)

    # -- what the document says --------------------------------------------------------------------------

    def needs_growth(self, groom: Groom, mesh: Mesh) -> bool:
        """True when these hairs cannot follow: others must be grown, and until then these may stay."""
        return mesh is not self.mesh or any(
            a is not b and a != b for a, b in zip(self._key, _growth_key(groom), strict=True)
        )

    def needs_binding(self, stroking: bool = False) -> bool:
        """True when :func:`bind_coat` is asked for: at once when so many guides came and went that the hairs had to
        stay behind, and at rest after any planting and deleting."""
        return self._behind or (self._binding.edited and not stroking)

    def follow(
        self, groom: Groom, frame: float, posed: Posed | None = None, rows_shown: int | None = None
    ) -> NDArray[np.int32]:
        """Follow the document; the rows of hairs that were written, ascending.

        Parameters
        ----------
        posed : where the skin is at the frame; at rest when None. Told from the last by the identity of its points.
        rows_shown : only so many of :attr:`order` are evaluated now, the others owed; all of them when None.
        """
        if posed is None or posed.points is self._at_rest.points:
            posed = self._at_rest
        if posed.points is not self._posed.points:
            self._posed = posed
            self._stand()
        self._follow_guides(groom.guides)
        self._follow_values(groom, frame)
        shown = self.order if rows_shown is None else self.order[: max(rows_shown, 0)]
        rows = np.sort(shown[self._owed[shown] == EVALUATE])
        self._evaluate(rows)
        self._owed[rows] = SETTLE
        return rows

    def take_binding(self, binding: CoatBinding, guides: Guides) -> None:
        """Hang the hairs on `binding`, made for `guides`; :meth:`follow` what happened since, next."""
        old = self.children.sites.copy(), self.children.weights.copy()
        binding.rebind_all(self.children)
        new = self.children.sites, self.children.weights
        changed = np.zeros(len(self.children), np.bool_)
        for before, after in zip(old, new, strict=True):
            changed |= (before != after).any(axis=1)
        kept = np.intersect1d(self.guides.ids, guides.ids, return_indices=True)[1:]
        if len(kept[0]) != len(guides) or not np.array_equal(*kept):  # the same row is another guide now
            changed[:] = True
        self._binding, self._behind = binding, False
        self._owed[changed] = EVALUATE
        self._hang_on(guides)

    def catch_up(self, most: int, skin: Collision | None = None) -> NDArray[np.int32]:
        """Do what is owed to at most so many of the hairs shown; their rows, ascending. Empty when nothing is.

        skin : to settle the hairs on, of the very pose last followed; without it they are only evaluated.
        """
        rows = self._waiting(skin)[:most]
        stale = rows[self._owed[rows] == EVALUATE]
        self._evaluate(stale)
        self._owed[stale] = SETTLE
        if self._settles(skin):
            assert skin is not None
            settle_rows(self.children.points, rows, skin, self._workers)
            self._owed[rows] = NOTHING
        return rows

    def owing(self, skin: Collision | None = None) -> int:
        """How many of the hairs shown :meth:`catch_up` has still to look at."""
        return len(self._waiting(skin))

    @property
    def unsettled(self) -> bool:
        """True when hairs shown have not been settled on the skin as it is."""
        return bool((self._shown & (self._owed > NOTHING)).any())

    # -- how ---------------------------------------------------------------------------------------------

    def _settles(self, skin: Collision | None) -> bool:
        return skin is not None and skin.points is self._posed.points

    def _waiting(self, skin: Collision | None) -> NDArray[np.int32]:
        least = NOTHING if self._settles(skin) else SETTLE
        return np.flatnonzero(self._shown & (self._owed > least)).astype(np.int32)

    def _evaluate(self, rows: NDArray[np.int32]) -> None:
        if len(rows):
            everything = len(rows) == len(self.children)
            evaluate(
                self.children, self.guide_points, self.guide_normals, self._workers,
                rows=None if everything else rows, shape=self.children.traits.shape,
            )

    def _stand(self) -> None:
        """Put guides and roots of hairs on the skin as it is now."""
        update_roots(self.children, *self._posed)
        self.normals = self.children.roots(self._workers.ranges)[1]
        self._stand_guides()
        self._owed[:] = EVALUATE

    def _stand_guides(self, moved: NDArray[np.bool_] | None = None) -> None:
        """Guides on the skin as it is now; `moved` (G,) says which differ where only their points do."""
        roots, at_rest, points, normals = self.guides.roots, self._rest_points, *self._posed
        if moved is None:
            at = (None, None) if self._posed is self._at_rest else (points, normals)
            self.guide_normals = root_normals(self.mesh, roots, *at)
        if self._posed is self._at_rest:
            self.guide_points = at_rest
        elif moved is None:
            self.guide_points = strands_on_deformed(self.mesh, roots, at_rest, points, normals)
        elif moved.any():
            rows = np.flatnonzero(moved)
            self.guide_points = self.guide_points.copy()
            self.guide_points[rows] = strands_on_deformed(
                self.mesh, roots.take(rows), at_rest[rows], points, normals
            )

    def _follow_guides(self, guides: Guides) -> None:
        if guides is self.guides:
            return
        if not self._binding.serves(guides):
            edits = self._binding.edits_to(guides)
            self._behind = edits is None or edits > MOST_AT_ONCE
            if self._behind:
                return
            self._owed[self._binding.update(guides, self.children)] = EVALUATE
        self._behind = False
        self._hang_on(guides)

    def _hang_on(self, guides: Guides) -> None:
        """Take over guides the binding serves already."""
        old, self.guides = self.guides, guides
        count, ranges = self.children.count, self._workers.ranges
        if old.ids is guides.ids and old.roots is guides.roots and old.points.shape == guides.points.shape:
            moved = moved_guides(old.points, guides.points, ranges)
            if guides.points.shape[1] == count:
                self._rest_points = guides.points
            elif moved.any():
                self._rest_points = self._rest_points.copy()
                self._rest_points[moved] = _fitted(take_rows(guides, moved), count)
            self._stand_guides(moved)
        else:
            before, self._rest_points = self._rest_points, _fitted(guides, count)
            moved = np.ones(len(guides), np.bool_)
            _, was, now = np.intersect1d(old.ids, guides.ids, return_indices=True)
            moved[now] = moved_guides(before[was], self._rest_points[now], ranges)
            self._stand_guides()
        if moved.any():
            self._owed[self.children.rows_of(moved, self._workers.ranges)] = EVALUATE

    def _reaches_alike(self, reach: float) -> bool:
        """True when the distances to the guides are those the hairs were last thinned out by, or none count."""
        near = self.children.near
        return reach == 0.0 or (near is not None and near[0] is self.guides.roots)

    def _follow_values(self, groom: Groom, frame: float) -> None:
        before = self._groom
        alike = before is not None and _same_values(before, groom) and self._reaches_alike(groom.coat.reach)
        if alike and (frame == self._frame or not _animated(groom)):
            return
        self._groom, self._frame = groom, frame
        children = self.children
        length, traits = children.length, children.traits
        try:
            bound = groom if groom.guides is self.guides else groom.replace(guides=self.guides)
            set_coat(children, bound, self.mesh, self._skin, frame, self._evaluator)
            self.trouble = None
        except UserError as error:
            self.trouble = error
        changed = children.length != length
        was, now = traits.shape, children.traits.shape
        for a, b in ((was.clump, now.clump), (was.frizz, now.frizz)):
            changed |= np.asarray(np.not_equal(a, b))
        if was.seed != now.seed:
            changed[:] = True
        self._owed[changed] = EVALUATE
        if not _same(traits.density, children.traits.density):
            self.order = np.ascontiguousarray(children.shown(children.traits.density))
            self._shown[:] = False
            self._shown[self.order] = True


def _density_map(groom: Groom) -> Map | None:
    return None if groom.coat.density_map is None else groom.map(groom.coat.density_map)


def _growth_key(groom: Groom) -> tuple[object, ...]:
    coat = groom.coat
    return coat.count, coat.seed, coat.points, _density_map(groom)


def _fitted(guides: Guides, count: int) -> NDArray[np.float32]:
    """The points of guides, (G, count, 3)."""
    return guides.points if guides.points.shape[1] == count else with_point_count(guides, count).points


def _same_values(a: Groom, b: Groom) -> bool:
    """True when no hair can be another, whatever else of the coats differs."""
    return a.maps is b.maps and all(
        getattr(a.coat, name) is getattr(b.coat, name) or getattr(a.coat, name) == getattr(b.coat, name)
        for name in (*COAT_VALUES, "seed", "length_map", "reach")
    )


def _animated(groom: Groom) -> bool:
    """True when hairs may be others at another frame."""
    values: list[Value] = [getattr(groom.coat, name) for name in COAT_VALUES]
    return any(
        "frame" in names_used(value) if isinstance(value.base, Formula) else not isinstance(value.base, Constant)
        for value in values
    )


def _same(a: Number, b: Number) -> bool:
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return np.shape(a) == np.shape(b) and bool(np.array_equal(a, b))
    return a == b
