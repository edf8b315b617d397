"""Binding points of a skin to sites on it: barycentric weights in the intrinsic Delaunay triangulation of the sites.

The sites (roots of guides) are inserted into the intrinsic triangulation of the skin, then every vertex of the mesh is
taken out while the bound points (roots of children) are carried along. What is left is a triangulation whose corners
are sites only; a point's triangle and weights there are its binding. It is continuous over the skin, exact at sites,
and cannot leak between parts that are near but not connected, because nothing but the surface is ever looked at.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit, types
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from core.mesh.halfedge import Manifold, manifold
from core.mesh.intrinsic_flips import (
    FREE,
    I1,
    NET,
    TOUCHED,
    Net,
    insert_vertex,
    legalise_all,
    unhang,
)
from core.mesh.intrinsic_points import (
    HELPER,
    PHANTOM,
    SITE,
    find_place,
    gather_points,
    hang_again,
    hang_points,
    label_helpers,
    read_changed,
    read_faces,
    sort_points,
)
from core.mesh.intrinsic_removal import remove_vertex, remove_vertices
from core.mesh.intrinsic_star import LARGEST_RING, make_ring
from core.random import rand
from core.workers import Workers, serial_ranges

FEWEST = 4  # a piece of skin needs this many vertices that stay
HELPERS = 6  # or else keeps this many of the mesh's own
WORTH_A_PART = 32_768  # points for which the triangulation is worth making once more
MOST_PARTS = 4
SPARE = 256  # sites that can be added before arrays grow


class Binding(NamedTuple):
    """Three sites and weights for every bound point, in the order the points were given.

    sites : (N, 3) int32, rows of sites; one that stands twice has all its weight in its first place.
    weights : (N, 3) float32, >= 0, summing to 1.
    order : (N,) int32, points sorted by triangle of sites: rows stored so are quick to evaluate.
    helped : points bound through a mesh vertex that could not be taken out (continuous, but coarser).
    nearest : points on pieces of the skin without any site: bound to the nearest site in space.
    """

    sites: NDArray[np.int32]
    weights: NDArray[np.float32]
    order: NDArray[np.int32]
    helped: int
    nearest: int


class Rebound(NamedTuple):
    """Points whose binding changed: rows (n,) int32, sites (n, 3) int32, weights (n, 3) float32."""

    rows: NDArray[np.int32]
    sites: NDArray[np.int32]
    weights: NDArray[np.float32]


@njit(types.int64(NET, I1, types.int64), cache=True, nogil=True, error_model="numpy")
def _insert_sites(net, vertices, base):  # type: ignore[no-untyped-def]
    """Make vertices of the tracked points ``base + v``; returns how many found a place."""
    done = 0
    for i in range(len(vertices)):
        v = vertices[i]
        f = net.home[base + v]
        if f < 0:
            continue
        unhang(net, base + v)
        b = net.bary[base + v]
        if insert_vertex(net, v, f, b[0], b[1], b[2]):
            done += 1
    return done


def bind(
    points: ArrayLike, triangles: ArrayLike, site_triangle: ArrayLike, site_barycentric: ArrayLike,
    tracked_triangle: ArrayLike, tracked_barycentric: ArrayLike, seed: int = 0, workers: Workers | None = None,
) -> Binding:
    """Bind tracked points of a skin to sites on it; see :class:`SurfaceSites` for the parameters."""
    return SurfaceSites(
        points, triangles, site_triangle, site_barycentric, tracked_triangle, tracked_barycentric, seed, workers
    ).binding()


class SurfaceSites:
    """The triangulation of the sites, kept so that one site can be added or taken away in well under a millisecond.

    Many points are shared out among threads, each of which carries its own through a triangulation of its own; what
    happens to the triangulation and to a point does not depend on other points, so neither does the result.

    Mutable and owned by an evaluator. Costs about 32 bytes for every tracked point while it is kept.

    Parameters
    ----------
    points : (V, 3) float, metres; any units serve.
    triangles : (T, 3) int; cracks are welded, non-manifold edges cut, see :mod:`core.mesh.halfedge`.
    site_triangle, site_barycentric : (G,) int and (G, 3) float, at least one site.
    tracked_triangle, tracked_barycentric : (N,) int and (N, 3) float.
    seed : order in which mesh vertices are taken out.
    workers : threads to share the points out to.
    """

    def __init__(
        self, points: ArrayLike, triangles: ArrayLike, site_triangle: ArrayLike, site_barycentric: ArrayLike,
        tracked_triangle: ArrayLike, tracked_barycentric: ArrayLike, seed: int = 0, workers: Workers | None = None,
    ) -> None:
        self._points = np.ascontiguousarray(points, np.float64).reshape(-1, 3)
        self._triangles = np.ascontiguousarray(triangles, np.int32).reshape(-1, 3)
        self._seed = seed
        self._threads, self._ranges = (1, serial_ranges) if workers is None else (workers.threads, workers.ranges)
        self._site_triangle = np.array(site_triangle, np.int32).reshape(-1)
        self._site_bary = np.array(site_barycentric, np.float64).reshape(-1, 3)
        self._tracked_triangle = np.ascontiguousarray(tracked_triangle, np.int32).reshape(-1)
        self._tracked_bary = np.ascontiguousarray(tracked_barycentric, np.float64).reshape(-1, 3)
        self._ring = make_ring()
        self._build()

    @property
    def sites(self) -> int:
        """How many sites there are."""
        return len(self._site_triangle)

    # -- building -----------------------------------------------------------------------------------------

    def _build(self) -> None:
        if self.sites == 0 or len(self._triangles) == 0:
            raise ValueError("binding needs at least one site and one triangle")
        spacing = np.sqrt(_surface_area(self._points, self._triangles) / self.sites)
        self._skin = skin = manifold(self._points, self._triangles, fill=2.0 * float(spacing))
        self.edits = 0
        few = len(self._triangles) <= 1 << 16  # numpy sorts 16 bits by radix, several times as fast
        keys = self._tracked_triangle.astype(np.uint16) if few else self._tracked_triangle
        given = np.argsort(keys, kind="stable").astype(np.int32)
        self._given = given  # inner point -> row as given; neighbours on the skin lie together
        self._count = len(given)
        home, bary = self._on_skin(self._site_triangle, self._site_bary)
        nets = self._allocate(skin, self._count)
        self._net = nets[0]
        self._vertex = np.arange(skin.vertices, skin.vertices + self.sites, dtype=np.int32)
        self._used_vertices = skin.vertices + self.sites
        self._kind[self._vertex] = SITE
        self._label[self._vertex] = np.arange(self.sites, dtype=np.int32)
        self._place_tracked()
        leaving = self._leaving(skin, home)
        orders = [leaving.copy() for _ in nets]
        stuck = [0] * len(nets)

        def lay_out(start: int, stop: int) -> None:
            for part in range(start, stop):
                net, own = nets[part], self._count + part * len(self._kind)
                hang_again(net, self._count * part // len(nets), self._count * (part + 1) // len(nets))
                hang_points(net, home, bary, own + skin.vertices)
                legalise_all(net)
                _insert_sites(net, self._vertex, own)
                stuck[part] = remove_vertices(net, make_ring(), orders[part], own)

        self._ranges(len(nets), lay_out, 1)
        self._kind[orders[0][: stuck[0]]] = HELPER
        if len(nets) > 1:
            self._unite()
        self._net.changed[:] = 0
        self._net.tally[TOUCHED] = 0
        self._nearest_site: cKDTree | None = None
        self._relabel()

    def _allocate(self, skin: Manifold, count: int) -> list[Net]:
        """The triangulation of the skin, once for every part of the points; the parts share the rows of points."""
        used = len(skin.origin) // 3
        room = self.sites + SPARE
        faces, vertices = used + 2 * room, skin.vertices + room
        origin = np.full(3 * faces, -1, np.int32)
        twin = np.full(3 * faces, -1, np.int32)
        length = np.zeros(3 * faces)
        origin[: 3 * used], twin[: 3 * used], length[: 3 * used] = skin.origin, skin.twin, skin.length
        first = np.full(vertices, -1, np.int32)
        first[skin.origin] = np.arange(3 * used, dtype=np.int32)
        free = np.zeros(faces, np.int32)
        free[: 2 * room] = np.arange(faces - 1, used - 1, -1)
        tally = np.zeros(4, np.int64)
        tally[FREE] = 2 * room
        parts = max(1, min(self._threads, MOST_PARTS, count // WORTH_A_PART))
        tracked = count + parts * vertices  # every part carries the vertices too
        first_part = Net(
            origin, twin, length, first, np.full(faces, -1, np.int32), np.full(tracked, -1, np.int32),
            np.full(tracked, -1, np.int32), np.zeros((tracked, 3)), np.zeros(3 * faces, np.uint8),
            np.empty(3 * faces, np.int32), np.ones(faces, np.uint8), np.empty(faces, np.int32), free, tally,
        )
        self._kind = np.zeros(vertices, np.uint8)
        self._label = np.full(vertices, -1, np.int32)
        self._piece = np.zeros(vertices, np.int32)
        self._piece[: skin.vertices] = skin.component
        shared = first_part.follow, first_part.home, first_part.bary
        return [first_part] + [
            Net(*(array if any(array is s for s in shared) else array.copy() for array in first_part))
            for _ in range(1, parts)
        ]

    def _place_tracked(self) -> None:
        """Write face and weights of the tracked points, in inner order."""
        skin, net, given = self._skin, self._net, self._given
        self._ranges(self._count, lambda start, stop: gather_points(
            given, self._tracked_triangle, self._tracked_bary, skin.face, skin.flipped, start, stop, net.home, net.bary
        ), 8192)
        lost = np.flatnonzero(net.home[: self._count] < 0)
        if len(lost):
            net.home[lost], net.bary[lost] = self._on_skin(
                self._tracked_triangle[given[lost]], self._tracked_bary[given[lost]]
            )

    def _unite(self) -> None:
        """One net of all points, where several carried some each."""
        kept = self._count + len(self._kind)
        net = self._net
        self._net = net = net._replace(follow=net.follow[:kept], home=net.home[:kept], bary=net.bary[:kept])
        net.head[:] = -1
        hang_again(net, 0, kept)

    def _on_skin(
        self, triangle: NDArray[np.int32], bary: NDArray[np.float64]
    ) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        """Face and weights on the manifold; a place on a triangle that was left out goes to the nearest corner."""
        skin = self._skin
        face = skin.face[triangle]
        bary = np.clip(np.nan_to_num(bary), 0.0, None)
        total = bary.sum(axis=1, keepdims=True)
        bary = np.where(total > 0.0, bary / np.where(total > 0.0, total, 1.0), 1.0 / 3.0)
        lost = np.flatnonzero(face < 0)
        live = np.flatnonzero(skin.face >= 0)
        if len(lost) and len(live):
            corners = np.nan_to_num(self._points[self._triangles[live]]).reshape(-1, 3)
            place = np.einsum("nk,nkc->nc", bary[lost], np.nan_to_num(self._points[self._triangles[triangle[lost]]]))
            near = cKDTree(corners).query(place)[1]
            triangle = triangle.copy()
            triangle[lost] = live[near // 3]
            face[lost] = skin.face[triangle[lost]]
            bary[lost] = np.eye(3)[near % 3]
        turned = skin.flipped[triangle] == 1
        bary[turned] = bary[turned][:, [0, 2, 1]]
        return face.astype(np.int32), np.ascontiguousarray(bary)

    def _leaving(self, skin: Manifold, site_face: NDArray[np.int32]) -> NDArray[np.int32]:
        """Every vertex of the mesh, in the seeded order they are taken out, but those a piece needs to stay a surface,
        which become helpers."""
        mesh = np.arange(skin.vertices)
        loop = skin.vertices - len(skin.loops)
        phantom = (mesh >= loop) & ~np.concatenate([np.zeros(loop, bool), skin.filled])
        self._kind[: skin.vertices][phantom] = PHANTOM
        placed = site_face >= 0  # all of them, unless every triangle is degenerate
        site_piece = skin.component[self._net_vertex(site_face[placed])]
        sites = np.bincount(site_piece, minlength=skin.components)
        stay = sites + np.bincount(skin.component[phantom], minlength=skin.components)
        self._sites_on = sites
        self._piece[self._vertex[placed]] = site_piece
        # flat vertices first: taking them out is exact, and what curvature there is then moves no further than needed
        curved = np.abs(_angle_defect(skin)) > 1e-9
        order = mesh[np.argsort(rand(mesh, self._seed) + curved, kind="stable")]
        order = order[~phantom[order]]
        piece = skin.component[order]
        few = np.flatnonzero((stay < FEWEST) | (sites == 0))
        keep = np.zeros(len(order), bool)
        for c in few:
            mine = np.flatnonzero(piece == c)
            keep[mine if sites[c] == 0 else mine[-HELPERS:]] = True
        self._kind[order[keep]] = HELPER
        self._stay = stay + np.bincount(skin.component[order[keep]], minlength=skin.components)
        return np.ascontiguousarray(order[~keep], np.int32)

    def _net_vertex(self, face: NDArray[np.int32]) -> NDArray[np.int32]:
        """A mesh vertex of each face of the manifold as it was."""
        return self._skin.origin[3 * face]

    # -- one site more or less ----------------------------------------------------------------------------

    def add_site(self, triangle: int, barycentric: ArrayLike) -> Rebound:
        """Insert a site as the last row; the points whose binding changed.

        On a piece of skin that had no site everything is built anew.
        """
        bary = np.array(barycentric, np.float64).reshape(1, 3)
        tri = np.array([triangle], np.int32)
        self._site_triangle = np.concatenate([self._site_triangle, tri])
        self._site_bary = np.concatenate([self._site_bary, bary])
        self._nearest_site = None
        face, weights = self._on_skin(tri, bary)
        if face[0] < 0:
            return self._rebuild()
        piece = int(self._skin.component[self._net_vertex(face)[0]])
        if self._sites_on[piece] == 0:
            return self._rebuild()
        if self._used_vertices == len(self._kind) or self._net.tally[FREE] < 2:
            self._grow()
        net, v = self._net, self._used_vertices
        corners = self._skin.origin[3 * int(face[0]) : 3 * int(face[0]) + 3]
        out = np.empty(3)
        anchor, anchor_weights = self._anchor(int(triangle), weights[0])
        f = find_place(net, self._count, corners, weights[0], anchor, anchor_weights, out)
        if f < 0 or not insert_vertex(net, v, f, out[0], out[1], out[2]):
            return self._rebuild()
        self._used_vertices += 1
        self._vertex = np.append(self._vertex, np.int32(v))
        self._kind[v] = SITE
        self._label[v] = self.sites - 1
        self._piece[v] = piece
        self._sites_on[piece] += 1
        self._stay[piece] += 1
        self.edits += 1
        return self._changes()

    def _anchor(self, triangle: int, weights: NDArray[np.float64]) -> tuple[int, NDArray[np.float64]]:
        """The tracked point of that triangle nearest to the place, and its weights in the face; -1 where none is."""
        start, stop = np.searchsorted(self._tracked_triangle, [triangle, triangle + 1], sorter=self._given)
        if start == stop or self._skin.face[triangle] < 0:
            return -1, weights
        bary = self._tracked_bary[self._given[start:stop]]
        if self._skin.flipped[triangle]:
            bary = bary[:, [0, 2, 1]]
        best = int(((bary - weights) ** 2).sum(axis=1).argmin())
        return int(start) + best, np.ascontiguousarray(bary[best])

    def remove_site(self, row: int) -> Rebound:
        """Take a site away; the points whose binding changed. Rows after it count one less from now on, here and in
        what is returned: whoever stores sites of other points must lower those above `row` likewise."""
        if self.sites < 2:
            raise ValueError("the last site cannot be taken away")
        v = int(self._vertex[row])
        self._vertex = np.delete(self._vertex, row)
        self._site_triangle = np.delete(self._site_triangle, row)
        self._site_bary = np.delete(self._site_bary, row, axis=0)
        self._nearest_site = None
        piece = int(self._piece[v])
        if self._net.first[v] < 0 or self._sites_on[piece] == 1:
            return self._rebuild()
        self._label[self._label > row] -= 1
        self._sites_on[piece] -= 1
        few = self._stay[piece] <= FEWEST
        if not few and remove_vertex(self._net, self._ring, v, self._count + v, LARGEST_RING, True):
            self._kind[v] = 0
            self._label[v] = -1
            self._stay[piece] -= 1
        else:  # it stays as a helper with its neighbour's label
            self._kind[v] = HELPER
            self._label[v] = -2
        self.edits += 1
        return self._changes()

    def must_rebuild(self, removed: NDArray[np.integer], added_triangles: NDArray[np.int32]) -> bool:
        """True when taking these rows away and then adding sites on these triangles cannot be done one by one, because
        a piece of skin loses its last site or gets its first: everything is built anew then, which takes its time."""
        vertex, face = self._vertex[removed], self._skin.face[added_triangles]
        if (self._net.first[vertex] < 0).any() or (face < 0).any():
            return True
        left = self._sites_on.copy()
        np.subtract.at(left, self._piece[vertex], 1)
        touched = np.concatenate([self._piece[vertex], self._skin.component[self._net_vertex(face)]])
        return bool((left[touched] < 1).any())

    def _rebuild(self) -> Rebound:
        self._build()
        bound = self.binding()
        return Rebound(np.arange(self._count, dtype=np.int32), bound.sites, bound.weights)

    def _grow(self) -> None:
        """Room for as many sites again."""
        room = self.sites + SPARE
        net = self._net
        faces = len(net.head)

        def more(array: NDArray, count: int, fill: int = 0) -> NDArray:
            return np.concatenate([array, np.full((count, *array.shape[1:]), fill, array.dtype)])

        free = more(net.free, 2 * room)
        unused = int(net.tally[FREE])
        free[unused : unused + 2 * room] = np.arange(faces + 2 * room - 1, faces - 1, -1)
        net.tally[FREE] += 2 * room
        self._net = Net(
            more(net.origin, 6 * room, -1), more(net.twin, 6 * room, -1), more(net.length, 6 * room),
            more(net.first, room, -1), more(net.head, 2 * room, -1), more(net.follow, room, -1),
            more(net.home, room, -1), more(net.bary, room), more(net.queued, 6 * room), more(net.stack, 6 * room),
            more(net.changed, 2 * room), more(net.touched, 2 * room), free, net.tally,
        )
        self._kind, self._label = more(self._kind, room), more(self._label, room, -1)
        self._piece = more(self._piece, room)

    # -- reading ------------------------------------------------------------------------------------------

    def _relabel(self) -> None:
        label_helpers(self._net, self._kind, self._label, np.empty(len(self._kind)))

    def binding(self) -> Binding:
        """The binding of every tracked point as it stands."""
        n = self._count
        sites = np.empty((n, 3), np.int32)
        weights = np.empty((n, 3), np.float32)
        order = np.empty(n, np.int32)
        trouble = np.zeros(n, np.uint8)
        net, given = self._net, self._given
        ends, points = np.empty(len(net.head) + 2, np.int32), np.empty(n, np.int32)
        sort_points(net.home, n, ends, points)
        self._ranges(len(net.head) + 1, lambda start, stop: read_faces(
            net, self._kind, self._label, given, ends, points, start, stop, order, sites, weights, trouble
        ), 1024)
        lost = np.flatnonzero(trouble == 2)
        if len(lost):
            sites[lost] = self._nearest(lost)[:, None]
        return Binding(sites, weights, order, int((trouble == 1).sum()), len(lost))

    def _nearest(self, rows: NDArray) -> NDArray[np.int32]:
        """The site nearest in space to each of the given tracked points."""

        def place(triangle: NDArray[np.int32], bary: NDArray[np.float64]) -> NDArray[np.float64]:
            return np.einsum("nk,nkc->nc", bary, np.nan_to_num(self._points[self._triangles[triangle]]))

        if self._nearest_site is None:
            self._nearest_site = cKDTree(place(self._site_triangle, self._site_bary))
        found = self._nearest_site.query(place(self._tracked_triangle[rows], self._tracked_bary[rows]))[1]
        return np.asarray(found, np.int32)

    def _changes(self) -> Rebound:
        n = self._count
        if (self._kind[: self._used_vertices] > SITE).any():
            self._relabel()
        rows = np.empty(n, np.int32)
        sites = np.empty((n, 3), np.int32)
        weights = np.empty((n, 3), np.float32)
        trouble = np.empty(n, np.uint8)
        found = read_changed(
            self._net, self._kind, self._label, self._given, n, rows, sites, weights, trouble
        )
        lost = np.flatnonzero(trouble[:found] == 2)
        if len(lost):
            sites[lost] = self._nearest(rows[lost])[:, None]
        return Rebound(rows[:found].copy(), sites[:found].copy(), weights[:found].copy())


def _angle_defect(skin: Manifold) -> NDArray[np.float64]:
    """2 pi less the angles around each vertex, (vertices,)."""
    a = skin.length.reshape(-1, 3)
    b, c = np.roll(a, -1, axis=1), np.roll(a, -2, axis=1)  # the side across from each corner is b
    four = np.sqrt(np.maximum((a + b + c) * (b + c - a) * (c + a - b) * (a + b - c), 0.0))
    angle = np.arctan2(four, a * a + c * c - b * b)
    return np.asarray(2.0 * np.pi - np.bincount(skin.origin, angle.ravel(), minlength=skin.vertices))


def _surface_area(points: NDArray[np.float64], triangles: NDArray[np.int32]) -> float:
    corners = points[triangles]
    double = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return 0.5 * float(np.nansum(double))
