"""Which vertex is opposite which: by place, or by the way the mesh is connected; and sculpting on both sides."""

from __future__ import annotations

import numpy as np
from numba import njit
from numba.core.types import Array, boolean, int32, int64
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from core.errors import UserError
from core.mesh.edges import Edges, next_corner
from core.mesh.mesh import Mesh
from core.pose.sculpt.ring import Ring

Opposites = NDArray[np.int32]
SEEDS = 64  # edges tried for each piece of a mesh before it is called unsymmetric


def opposites_by_axis(points: NDArray[np.float32], axis: int = 0, tolerance: float = 1e-4) -> Opposites:
    """The opposite (V,) int32 of every vertex across a plane of coordinates (itself on it), -1 where there is none.

    Parameters
    ----------
    points : (V, 3) at rest. axis : 0, 1, 2, the coordinate that changes sign.
    tolerance : as a share of the diagonal of the box. Pairs hold both ways or not at all.
    """
    if not len(points):
        return np.zeros(0, np.int32)
    diagonal = float(np.linalg.norm(np.ptp(points.astype(np.float64), axis=0)))
    distances, found = cKDTree(points).query(reflected(points, axis))
    pairs = np.asarray(found, np.int64)
    own = np.arange(len(points))
    good = (distances <= tolerance * diagonal) & (pairs[pairs] == own)
    return np.where(good, pairs, -1).astype(np.int32)


def opposites_by_topology(mesh: Mesh, axis: int = 0) -> Opposites:
    """The opposite (V,) int32 of every vertex, found by walking the polygons on both sides at once.

    Only where to begin is taken from the places of the vertices: from the edges that come nearest to their reflection
    across the plane of `axis`. From there faces, corners and edges are matched one by one, in opposite turns, so the
    shape itself may be as unsymmetric as a smile or a broken nose.

    Raises
    ------
    UserError
        When a piece of the mesh is not connected symmetrically.
    """
    after = next_corner(mesh.counts).astype(np.int32)
    before = np.empty_like(after)
    before[after] = np.arange(len(after), dtype=np.int32)
    twin = _twins(mesh)
    corners = mesh.corners
    image = np.full(len(corners), -1, np.int32)
    vertex = np.full(len(mesh.points), -1, np.int32)
    for mine, other in _seeds(mesh, axis, after):
        if image[mine] < 0 and image[other] < 0:
            _walk(after, before, twin, corners, mine, other, image, vertex)
    loose = np.ones(len(mesh.points), np.bool_)
    loose[corners] = False
    vertex[loose] = np.flatnonzero(loose)
    missing = int((vertex < 0).sum())
    if missing:
        raise UserError(
            f"{missing} of {len(vertex)} vertices have no opposite, because the mesh is not connected alike on "
            "both sides; mirror by axis instead, or make the polygons symmetric."
        )
    return vertex


def reflected(vectors: ArrayLike, axis: int = 0) -> NDArray[np.float64]:
    """Points or vectors (..., 3) across the plane where the coordinate `axis` is 0."""
    sign = np.ones(3)
    sign[axis] = -1.0
    return np.asarray(vectors, np.float64) * sign


def mirrored_ring(ring: Ring, opposites: Opposites, axis: int = 0) -> Ring:
    """The ring on the other side: the opposites of its sites with their weights, however the body is posed.

    Brushes that go along normals use it as it is; a movement of Grab goes through :func:`reflected`. Sites without an
    opposite are left out.
    """
    there = opposites[ring.sites]
    found = there >= 0
    order = np.argsort(there[found], kind="stable")
    return Ring(
        there[found][order].astype(np.int32), ring.weights[found][order], reflected(ring.centre, axis), ring.radius
    )


def mirrored_offsets(offsets: NDArray[np.float32], opposites: Opposites, axis: int = 0) -> NDArray[np.float32]:
    """Offsets (V, 3) of vertices at rest, carried to the other side; 0 where a vertex has no opposite."""
    out = reflected(offsets[np.maximum(opposites, 0)], axis)
    out[opposites < 0] = 0.0
    return out.astype(np.float32)


def symmetrised_offsets(
    offsets: NDArray[np.float32], opposites: Opposites, points: NDArray[np.float32], axis: int = 0, keep: int = 1
) -> NDArray[np.float32]:
    """Offsets (V, 3) made symmetric: the side where `axis` has the sign `keep` is copied to the other.

    points : (V, 3) at rest, which say on which side a vertex lies. Vertices on the plane stay on it.
    """
    out = offsets.copy()
    other = (points[:, axis] * keep < 0.0) & (opposites >= 0)
    out[other] = mirrored_offsets(offsets, opposites, axis)[other]
    out[opposites == np.arange(len(opposites)), axis] = 0.0
    return out


def _twins(mesh: Mesh) -> NDArray[np.int32]:
    """The corner whose edge is the same, run the other way, (C,) int32; -1 on borders and where more than two meet."""
    edges = Edges.of(mesh.counts, mesh.corners, len(mesh.points))
    first = np.searchsorted(edges.group, np.flatnonzero(edges.uses == 2))
    a, b = edges.order[first], edges.order[first + 1]
    fits = edges.forward[first] != edges.forward[first + 1]
    out = np.full(len(mesh.corners), -1, np.int32)
    out[a[fits]], out[b[fits]] = b[fits], a[fits]
    return out


def _seeds(mesh: Mesh, axis: int, after: NDArray[np.int32]) -> list[tuple[int, int]]:
    """Pairs of corners whose edges reflect into each other, best first, some for every piece of the mesh."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    tails, heads = mesh.corners.astype(np.int64), mesh.corners[after].astype(np.int64)
    wide = np.int64(len(mesh.points))
    distances, found = cKDTree(mesh.points).query(reflected(mesh.points, axis))
    nearest = np.asarray(found, np.int64)
    keys = tails * wide + heads
    order = np.argsort(keys)
    wanted = nearest[heads] * wide + nearest[tails]  # the reflection runs backwards
    place = np.minimum(np.searchsorted(keys[order], wanted), len(keys) - 1)
    there = order[place]
    hits = np.flatnonzero(keys[there] == wanted)
    graph = coo_matrix((np.ones(len(tails), np.int8), (tails, heads)), shape=(len(mesh.points),) * 2)
    piece = connected_components(graph, directed=False)[1][tails]
    error = (distances[tails] + distances[heads])[hits]
    hits = hits[np.lexsort((error, piece[hits]))]
    rank = np.arange(len(hits)) - np.searchsorted(piece[hits], piece[hits])
    return [(int(mine), int(there[mine])) for mine in hits[rank < SEEDS]]


_CORNERS = Array(int32, 1, "C", readonly=True)


@njit(
    boolean(_CORNERS, _CORNERS, _CORNERS, _CORNERS, int64, int64, int32[::1], int32[::1]), cache=True, nogil=True
)
def _walk(
    after: np.ndarray, before: np.ndarray, twin: np.ndarray, corners: np.ndarray, mine: int, other: int,
    image: np.ndarray, vertex: np.ndarray,
) -> bool:
    """Match everything that can be reached; leaves `image` and `vertex` as they were when something does not fit.

    The edge of a corner a -> b is matched with one that runs from the opposite of b to the opposite of a.
    """
    done = [(mine, other)]
    done.pop()
    stack = [(mine, other)]
    named = [mine]
    named.pop()
    fits = True
    while fits and stack:
        h, g = stack.pop()
        if image[h] >= 0 or image[g] >= 0:
            fits = image[h] == g and image[g] == h
            continue
        image[h], image[g] = g, h
        done.append((h, g))
        for one, two in ((corners[h], corners[after[g]]), (corners[after[h]], corners[g])):
            if vertex[one] < 0 and vertex[two] < 0:
                vertex[one], vertex[two] = two, one
                named.append(int64(one))
                named.append(int64(two))
            elif vertex[one] != two or vertex[two] != one:
                fits = False
        stack.append((int64(after[h]), int64(before[g])))
        if (twin[h] < 0) != (twin[g] < 0):
            fits = False
        elif twin[h] >= 0:
            stack.append((int64(twin[h]), int64(twin[g])))
    if not fits:
        for h, g in done:
            image[h], image[g] = -1, -1
        for v in named:
            vertex[v] = -1
    return fits
