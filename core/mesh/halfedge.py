"""Half-edges of any triangle soup, made a closed oriented manifold: the start of an intrinsic triangulation.

Half-edge ``3 * f + k`` of face ``f`` runs from corner ``k`` to corner ``k + 1``. Trouble is cut, never refused:
an edge of more than two faces is open, a vertex of several fans becomes several vertices, an orientation that
does not close (a Moebius strip) is cut, a triangle that names one place twice is left out, and every loop of
open edges is closed by a cone of *phantom* triangles, so later code never meets a border.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

_I1 = types.Array(types.int32, 1, "C")
_I2 = types.Array(types.int32, 2, "C", readonly=True)
_F2 = types.Array(types.float64, 2, "C", readonly=True)
_F1 = types.Array(types.float64, 1, "C")
_B1 = types.Array(types.uint8, 1, "C")

STAND_OFF = 4.0  # of a phantom, over the longest loop that is bridged; with less, fewer border triangles are Delaunay's


class Manifold(NamedTuple):
    """A closed oriented manifold of triangles, with what is needed to find the soup's triangles again.

    origin, twin : (3 F,) int32 of each half-edge.
    length : (3 F,) float64, equal on twins; every face keeps the strict triangle inequality.
    corner_vertex : (T, 3) int32, the vertex (fan) of each corner of the soup's triangles, -1 where left out.
    face : (T,) int32, the face of each of the soup's triangles, -1 where left out.
    flipped : (T,) uint8, 1 where corners 1 and 2 of the face are those of the soup's triangle exchanged.
    vertices : number of vertices, phantoms included and last.
    loops : (L,) float64, length of each open loop; vertex ``vertices - L + i`` is the phantom of loop i.
    filled : (L,) bool, loops so short that the phantom faces are taken for skin (small holes).
    component : (vertices,) int32, connected piece of each vertex.
    components : number of pieces.
    """

    origin: NDArray[np.int32]
    twin: NDArray[np.int32]
    length: NDArray[np.float64]
    corner_vertex: NDArray[np.int32]
    face: NDArray[np.int32]
    flipped: NDArray[np.uint8]
    vertices: int
    loops: NDArray[np.float64]
    filled: NDArray[np.bool_]
    component: NDArray[np.int32]
    components: int


def weld(points: NDArray[np.float64]) -> NDArray[np.int32]:
    """The lowest vertex at the same place (to the bit) as each vertex of (V, 3) `points`, (V,) int32."""
    if len(points) == 0:
        return np.zeros(0, np.int32)
    clean = points + 0.0  # -0 and 0 are one place
    order = np.lexsort((clean[:, 2], clean[:, 1], clean[:, 0]))
    ranked = clean[order]
    starts = np.ones(len(order), bool)
    starts[1:] = (ranked[1:] != ranked[:-1]).any(axis=1)
    lowest = np.minimum.reduceat(order, np.flatnonzero(starts))
    out = np.empty(len(order), np.int32)
    out[order] = lowest[np.cumsum(starts) - 1]
    return out


@njit(types.void(_I2, types.int64, _B1, _I1, _I1), cache=True, nogil=True)
def _pair(tri, vertices, live, mate, work):  # type: ignore[no-untyped-def]
    """The other half-edge of every edge that has exactly two, else -1. Two passes of a counting sort."""
    count = np.zeros(vertices + 1, np.int32)
    edges = 3 * len(tri)
    for key in range(2):  # stable: by the larger end, then by the smaller
        count[:] = 0
        for e in range(edges):
            t, k = e // 3, e % 3
            a, b = tri[t, k], tri[t, (k + 1) % 3]
            count[(max(a, b) if key == 0 else min(a, b)) + 1] += 1
        for v in range(vertices):
            count[v + 1] += count[v]
        for i in range(edges):
            e = i if key == 0 else mate[i]
            t, k = e // 3, e % 3
            a, b = tri[t, k], tri[t, (k + 1) % 3]
            v = max(a, b) if key == 0 else min(a, b)
            if key == 0:
                mate[count[v]] = e
            else:
                work[count[v]] = e
            count[v] += 1
    for e in range(edges):
        mate[e] = -1
    i = 0
    while i < edges:
        t, k = work[i] // 3, work[i] % 3
        a, b = tri[t, k], tri[t, (k + 1) % 3]
        lo, hi = min(a, b), max(a, b)
        j = i
        found = 0
        first, second = -1, -1
        while j < edges:
            t, k = work[j] // 3, work[j] % 3
            a, b = tri[t, k], tri[t, (k + 1) % 3]
            if min(a, b) != lo or max(a, b) != hi:
                break
            if live[t]:
                found += 1
                if found == 1:
                    first = work[j]
                elif found == 2:
                    second = work[j]
            j += 1
        if found == 2 and first // 3 != second // 3:
            mate[first] = second
            mate[second] = first
        i = j


@njit(types.void(_I2, _B1, _I1, _B1, _I1), cache=True, nogil=True)
def _orient(tri, live, mate, flipped, stack):  # type: ignore[no-untyped-def]
    """Turn faces so that neighbours agree; where that cannot be, the edge is cut."""
    n = len(tri)
    seen = np.zeros(n, np.uint8)
    for seed in range(n):
        if seen[seed] or not live[seed]:
            continue
        seen[seed] = 1
        stack[0] = seed
        depth = 1
        while depth > 0:
            depth -= 1
            t = stack[depth]
            for k in range(3):
                other = mate[3 * t + k]
                if other < 0:
                    continue
                o, m = other // 3, other % 3
                same = tri[t, k] == tri[o, m]  # both run the same way as written
                want = flipped[t] ^ (1 if same else 0)
                if seen[o]:
                    if flipped[o] != want:
                        mate[3 * t + k] = -1
                        mate[other] = -1
                else:
                    seen[o] = 1
                    flipped[o] = want
                    stack[depth] = o
                    depth += 1


@njit(types.int64(_I1, _I1, types.int64), cache=True, nogil=True)
def _fans(twin, vertex, edges):  # type: ignore[no-untyped-def]
    """Number the fans of faces around each corner; returns how many. `vertex` is the origin of half-edges."""
    found = 0
    for e in range(edges):
        vertex[e] = -1
    for e in range(edges):
        if vertex[e] >= 0:
            continue
        h = e
        closed = False
        while True:
            vertex[h] = found
            h = twin[h - h % 3 + (h + 2) % 3]
            if h < 0:
                break
            if h == e:
                closed = True
                break
        h = e
        while not closed:
            t = twin[h]
            if t < 0:
                break
            h = t - t % 3 + (t + 1) % 3
            vertex[h] = found
        found += 1
    return found


@njit(types.int64(_I1, _I1, _F1, _F1, types.int64, types.int64, types.float64), cache=True, nogil=True)
def _close(twin, origin, length, loops, edges, vertices, fill):  # type: ignore[no-untyped-def]
    """Close every loop of open edges with a cone of phantom faces; returns how many loops."""
    used = edges
    found = 0
    for e in range(edges):
        if twin[e] >= 0:
            continue
        apex = vertices + found
        start = used
        b = e
        total, longest = 0.0, 0.0
        while True:
            nxt = b - b % 3 + (b + 1) % 3
            origin[used] = origin[nxt]
            origin[used + 1] = origin[b]
            origin[used + 2] = apex
            length[used] = length[b]
            total += length[b]
            longest = max(longest, length[b])
            used += 3
            end = nxt
            while twin[end] >= 0 and twin[end] < edges:
                t = twin[end]
                end = t - t % 3 + (t + 1) % 3
            twin[b] = used - 3
            twin[used - 3] = b
            if end == e or twin[end] >= edges:  # back at the start
                break
            b = end
        spoke = total
        if total <= fill:  # about the flat cap of a round hole
            spoke = max(total / 6.0, 0.55 * longest)
        elif fill > 0.0:  # near enough that Delaunay triangles along the border are not much longer
            spoke = min(total, max(STAND_OFF * fill, longest))
        n = (used - start) // 3
        for i in range(n):
            mine = start + 3 * i
            after = start + 3 * ((i + 1) % n)
            twin[mine + 2] = after + 1  # apex -> far end of this edge, and the next triangle's way back
            twin[after + 1] = mine + 2
            length[mine + 1] = spoke
            length[mine + 2] = spoke
        loops[found] = total
        found += 1
    return found


@njit(types.int64(_I1, _I1, _I1, _I1, types.int64), cache=True, nogil=True)
def _components(origin, twin, component, stack, edges):  # type: ignore[no-untyped-def]
    faces = edges // 3
    seen = np.zeros(faces, np.uint8)
    found = 0
    for f in range(faces):
        if seen[f]:
            continue
        seen[f] = 1
        stack[0] = f
        depth = 1
        while depth > 0:
            depth -= 1
            g = stack[depth]
            for k in range(3):
                component[origin[3 * g + k]] = found
                o = twin[3 * g + k] // 3
                if not seen[o]:
                    seen[o] = 1
                    stack[depth] = o
                    depth += 1
        found += 1
    return found


def manifold(points: NDArray[np.float64], triangles: NDArray[np.int32], fill: float = 0.0) -> Manifold:
    """Closed oriented manifold of a triangle soup.

    Parameters
    ----------
    points : (V, 3) float64; vertices at one place are welded.
    triangles : (T, 3) int32.
    fill : loops of open edges up to this long are holes to be bridged. The phantom of a longer one stands off by some
        times as much, so that no sliver runs along the border from site to far site. 0: none is bridged, and phantoms
        stand off by the length of their loop.
    """
    finite: NDArray[np.bool_] = np.asarray(np.isfinite(points).all(axis=1))
    tri = np.ascontiguousarray(weld(np.where(finite[:, None], points, 0.0))[triangles], np.int32)
    count = len(tri)
    live = (
        (tri[:, 0] != tri[:, 1]) & (tri[:, 1] != tri[:, 2]) & (tri[:, 2] != tri[:, 0]) & finite[tri].all(axis=1)
    ).astype(np.uint8)
    mate = np.empty(3 * count, np.int32)
    work = np.empty(3 * count, np.int32)
    _pair(tri, len(points), live, mate, work)
    flipped = np.zeros(count, np.uint8)
    _orient(tri, live, mate, flipped, work)

    kept = np.flatnonzero(live)
    face = np.full(count, -1, np.int32)
    face[kept] = np.arange(len(kept), dtype=np.int32)
    turned = flipped[kept] == 1
    corners = tri[kept]
    corners[turned] = corners[turned][:, [0, 2, 1]]
    edges = 3 * len(kept)
    # where half-edge (t, k) of the soup went: a turned face runs its edges backwards
    slot = 3 * face[:, None].astype(np.int64) + np.where(flipped[:, None] == 1, [[2, 1, 0]], [[0, 1, 2]])
    twin = np.full(edges, -1, np.int32)
    mates = mate.reshape(-1, 3)[kept]
    twin[slot[kept].ravel()] = np.where(mates >= 0, slot.ravel()[mates], -1).ravel()

    open_edges = int((twin < 0).sum())
    origin = np.empty(edges + 3 * open_edges, np.int32)
    twin = np.concatenate([twin, np.full(3 * open_edges, -1, np.int32)])
    length = np.empty(edges + 3 * open_edges)
    fans = _fans(twin, origin, edges)
    length[:edges] = _lengths(points[corners])
    loops = np.empty(open_edges)
    found = _close(twin, origin, length, loops, edges, fans, fill)

    corner_vertex = np.full((count, 3), -1, np.int32)
    at = origin[:edges].reshape(-1, 3).copy()
    at[turned] = at[turned][:, [0, 2, 1]]
    corner_vertex[kept] = at
    component = np.empty(fans + found, np.int32)
    pieces = _components(origin, twin, component, np.empty(max(1, len(origin) // 3), np.int32), len(origin))
    return Manifold(
        origin, twin, length, corner_vertex, face, flipped, fans + found, loops[:found].copy(), loops[:found] <= fill,
        component, pieces,
    )


def _lengths(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Edge lengths (3 F,) of corner positions (F, 3, 3), mollified so that no triangle is degenerate.

    Adding one small constant to all lengths keeps them symmetric (Sharp & Crane, A Laplacian for Nonmanifold
    Triangle Meshes, 2020, section 4.5).
    """
    if len(corners) == 0:
        return np.zeros(0)
    length = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    slack = length.sum(axis=1, keepdims=True) - 2.0 * length
    short = 1e-5 * float(length.mean()) - float(slack.min())
    if short > 0.0:
        length += short
    return length.ravel()
