"""Intrinsic Delaunay flips and vertex insertion, carrying tracked points along.

An intrinsic triangulation knows edge lengths and gluing only. Tracked points (the future children) hang in a linked
list from their face with barycentric coordinates. Every operation is affine on each triangle and agrees on shared
edges, so the map from the skin to the changed triangulation stays continuous.
After Sharp, Soliman & Crane, Navigating Intrinsic Triangulations, SIGGRAPH 2019.
"""

from __future__ import annotations

from math import hypot, sqrt
from typing import Any, NamedTuple

import numpy as np
from numba import njit, types


class Net(NamedTuple):
    """The triangulation as flat arrays that kernels change in place; capacities may exceed use.

    origin, twin : (3 F,) int32; half-edge 3 f + k leaves corner k of face f; origin is -1 in unused faces.
    length : (3 F,) float64.
    first : (V,) int32, one half-edge leaving each vertex, -1 when it is not in the triangulation.
    head, follow, home : first point of each face (F,), point after each point (N,), its face (N,); -1: none.
    bary : (N, 3) float64, weights of the corners of the home face.
    queued, stack : (3 F,) half-edges waiting for the Delaunay test.
    changed, touched : (F,) faces changed since they were last gathered, as flags and as a list.
    free : (F,) unused faces.
    tally : (4,) int64: unused faces, touched faces, waiting half-edges, flips done.
    """

    origin: np.ndarray
    twin: np.ndarray
    length: np.ndarray
    first: np.ndarray
    head: np.ndarray
    follow: np.ndarray
    home: np.ndarray
    bary: np.ndarray
    queued: np.ndarray
    stack: np.ndarray
    changed: np.ndarray
    touched: np.ndarray
    free: np.ndarray
    tally: np.ndarray


I1 = types.Array(types.int32, 1, "C")
F1 = types.Array(types.float64, 1, "C")
F2 = types.Array(types.float64, 2, "C")
B1 = types.Array(types.uint8, 1, "C")
L1 = types.Array(types.int64, 1, "C")
NET: Any = types.NamedTuple(  # type: ignore[no-untyped-call]
    (I1, I1, F1, I1, I1, I1, I1, F2, B1, I1, B1, I1, I1, L1), Net
)

FREE, TOUCHED, WAITING, FLIPS = 0, 1, 2, 3
CLAMP = 2e-5  # a new vertex keeps this share of its triangle from every edge


@njit(types.float64(types.float64, types.float64, types.float64), cache=True, nogil=True, error_model="numpy")
def area(a, b, c):  # type: ignore[no-untyped-def]
    """Area of a triangle from its edge lengths (Heron), zero when they do not close."""
    s = (a + b + c) * (b + c - a) * (c + a - b) * (a + b - c)
    return 0.25 * sqrt(s) if s > 0.0 else 0.0


@njit(types.void(NET, types.int64), cache=True, nogil=True, error_model="numpy")
def touch(net, f):  # type: ignore[no-untyped-def]
    """Note that the points of face `f` moved."""
    if net.changed[f] == 0:
        net.changed[f] = 1
        net.touched[net.tally[TOUCHED]] = f
        net.tally[TOUCHED] += 1


@njit(types.void(NET, types.int64), cache=True, nogil=True, error_model="numpy")
def enqueue(net, h):  # type: ignore[no-untyped-def]
    """Put half-edge `h` on the list of edges to be tested."""
    if net.queued[h] == 0:
        net.queued[h] = 1
        net.stack[net.tally[WAITING]] = h
        net.tally[WAITING] += 1


@njit(
    types.void(NET, types.int64, types.int64, types.float64, types.float64, types.float64),
    cache=True, nogil=True, error_model="numpy",
)
def put_point(net, p, f, b0, b1, b2):  # type: ignore[no-untyped-def]
    """Hang point `p` into face `f`, weights clamped to the triangle."""
    b0 = max(b0, 0.0)
    b1 = max(b1, 0.0)
    b2 = max(b2, 0.0)
    s = b0 + b1 + b2
    if s > 0.0:
        s = 1.0 / s
    else:
        b0 = b1 = b2 = 1.0
        s = 1.0 / 3.0
    net.bary[p, 0] = b0 * s
    net.bary[p, 1] = b1 * s
    net.bary[p, 2] = b2 * s
    net.home[p] = f
    net.follow[p] = net.head[f]
    net.head[f] = p


@njit(types.float64(NET, types.int64), cache=True, nogil=True, error_model="numpy")
def cotangent(net, h):  # type: ignore[no-untyped-def]
    """Cotangent of the angle opposite half-edge `h` in its face."""
    f, k = h // 3, h % 3
    c = net.length[h]
    a = net.length[3 * f + (k + 1) % 3]
    b = net.length[3 * f + (k + 2) % 3]
    return (a * a + b * b - c * c) / max(4.0 * area(a, b, c), 1e-14 * c * c)


@njit(types.boolean(NET, types.int64), cache=True, nogil=True, error_model="numpy")
def flip(net, h):  # type: ignore[no-untyped-def]
    """Exchange the diagonal of the two triangles at `h`; False where they do not form a convex quad."""
    t = net.twin[h]
    f, g = h // 3, t // 3
    if f == g:
        return False
    hk, tk = h % 3, t % 3
    hn, hp = 3 * f + (hk + 1) % 3, 3 * f + (hk + 2) % 3
    tn, tp = 3 * g + (tk + 1) % 3, 3 * g + (tk + 2) % 3
    length = net.length
    # quad a, d, b, c: edge a-b along x, c above, d below
    l = length[h]
    bc, ca, ad, db = length[hn], length[hp], length[tn], length[tp]
    if l <= 0.0:
        return False
    cx = (l * l + ca * ca - bc * bc) / (2.0 * l)
    cy = 2.0 * area(l, bc, ca) / l
    dx = (l * l + ad * ad - db * db) / (2.0 * l)
    dy = -2.0 * area(l, ad, db) / l
    if cy - dy <= 0.0:
        return False
    cross = (cx * -dy + dx * cy) / (cy - dy)
    if not (cross > 0.0 and cross < l):
        return False
    diagonal = sqrt((cx - dx) * (cx - dx) + (cy - dy) * (cy - dy))
    if ca + ad <= diagonal or bc + db <= diagonal:
        return False

    a, b = net.origin[h], net.origin[t]
    c, d = net.origin[hp], net.origin[tp]
    # slots turn by one: hn <- hp <- tn <- tp <- hn
    twin = net.twin
    old_hn, old_hp, old_tn, old_tp = twin[hn], twin[hp], twin[tn], twin[tp]
    for which in range(4):
        if which == 0:
            other, new = old_hp, hn
        elif which == 1:
            other, new = old_tn, hp
        elif which == 2:
            other, new = old_tp, tn
        else:
            other, new = old_hn, tp
        if other == hp:
            other = hn
        elif other == tn:
            other = hp
        elif other == tp:
            other = tn
        elif other == hn:
            other = tp
        twin[new] = other
        twin[other] = new
    length[h] = diagonal
    length[t] = diagonal
    length[hn], length[hp], length[tn], length[tp] = ca, ad, db, bc
    net.origin[h], net.origin[hn], net.origin[hp] = d, c, a
    net.origin[t], net.origin[tn], net.origin[tp] = c, d, b
    net.first[a], net.first[b], net.first[c], net.first[d] = hp, tp, hn, tn
    net.tally[FLIPS] += 1
    touch(net, f)
    touch(net, g)

    # the points: lay flat, see on which side of c-d they fall
    ex, ey = cx - dx, cy - dy
    left = 1.0 / max(ex * -dy + ey * dx, 1e-300)  # twice the area of d, c, a (a at the origin)
    right = 1.0 / max(ey * (l - dx) + ex * dy, 1e-300)  # of c, d, b
    points_f, points_g = net.head[f], net.head[g]
    net.head[f] = -1
    net.head[g] = -1
    for side in range(2):
        p = points_f if side == 0 else points_g
        while p >= 0:
            following = net.follow[p]
            if side == 0:
                wb, wc, wd = net.bary[p, (hk + 1) % 3], net.bary[p, (hk + 2) % 3], 0.0
            else:
                wb, wc, wd = net.bary[p, tk], 0.0, net.bary[p, (tk + 2) % 3]
            x = wb * l + wc * cx + wd * dx
            y = wc * cy + wd * dy
            off = ex * (y - dy) - ey * (x - dx)  # > 0 on the side of a
            if off >= 0.0:  # d, c, a sit at h, hn, hp
                wa = off * left
                wc = (y * dx - x * dy) * left
                face, k, w0, w1, w2 = f, hk, 1.0 - wa - wc, wc, wa
            else:  # c, d, b sit at t, tn, tp
                wb = -off * right
                wc = ((l - dx) * (y - dy) + dy * (x - dx)) * right
                face, k, w0, w1, w2 = g, tk, wc, 1.0 - wb - wc, wb
            if k == 0:
                put_point(net, p, face, w0, w1, w2)
            elif k == 1:
                put_point(net, p, face, w2, w0, w1)
            else:
                put_point(net, p, face, w1, w2, w0)
            p = following
    return True


@njit(types.void(NET, types.int64), cache=True, nogil=True, error_model="numpy")
def legalise(net, cap):  # type: ignore[no-untyped-def]
    """Flip waiting edges until the triangulation is Delaunay there (at most `cap` flips, then give up)."""
    while net.tally[WAITING] > 0:
        net.tally[WAITING] -= 1
        h = net.stack[net.tally[WAITING]]
        net.queued[h] = 0
        if cap <= 0 or net.origin[h] < 0:
            continue
        t = net.twin[h]
        if cotangent(net, h) + cotangent(net, t) < -1e-9 and flip(net, h):
            cap -= 1
            f, g = 3 * (h // 3), 3 * (t // 3)
            for k in range(3):
                if f + k != h:
                    enqueue(net, f + k)
                if g + k != t:
                    enqueue(net, g + k)


@njit(types.void(NET), cache=True, nogil=True, error_model="numpy")
def legalise_all(net):  # type: ignore[no-untyped-def]
    """Make the whole triangulation Delaunay."""
    edges = len(net.origin)
    for h in range(edges):
        if net.origin[h] >= 0 and h < net.twin[h]:
            enqueue(net, h)
    legalise(net, 20 * edges)


@njit(types.void(NET, types.int64, types.int64), cache=True, nogil=True, error_model="numpy")
def _move_edge(net, old, new):  # type: ignore[no-untyped-def]
    """Half-edge `old` goes to slot `new`, with its length and its twin."""
    other = net.twin[old]
    net.twin[new] = other
    net.twin[other] = new
    net.length[new] = net.length[old]
    net.origin[new] = net.origin[old]


@njit(
    types.boolean(NET, types.int64, types.int64, types.float64, types.float64, types.float64),
    cache=True, nogil=True, error_model="numpy",
)
def insert_vertex(net, v, f, w0, w1, w2):  # type: ignore[no-untyped-def]
    """Put vertex `v` into face `f` at weights w, then restore Delaunay; False when no face is left for it."""
    if net.tally[FREE] < 2:
        return False
    w0, w1, w2 = max(w0, CLAMP), max(w1, CLAMP), max(w2, CLAMP)
    s = 1.0 / (w0 + w1 + w2)
    w0, w1, w2 = w0 * s, w1 * s, w2 * s
    net.tally[FREE] -= 2
    f1, f2 = net.free[net.tally[FREE]], net.free[net.tally[FREE] + 1]
    e = 3 * f
    l01, l12, l20 = net.length[e], net.length[e + 1], net.length[e + 2]
    o0, o1, o2 = net.origin[e], net.origin[e + 1], net.origin[e + 2]
    # laid flat: corner 0 at the origin, corner 1 along x
    cx = (l01 * l01 + l20 * l20 - l12 * l12) / (2.0 * l01)
    cy = 2.0 * area(l01, l12, l20) / l01
    x, y = w1 * l01 + w2 * cx, w2 * cy
    d0, d1, d2 = hypot(x, y), hypot(x - l01, y), hypot(x - cx, y - cy)
    _move_edge(net, e + 1, 3 * f1)
    _move_edge(net, e + 2, 3 * f2)
    for i in range(3):
        face = f if i == 0 else (f1 if i == 1 else f2)
        after = f1 if i == 0 else (f2 if i == 1 else f)
        far = o1 if i == 0 else (o2 if i == 1 else o0)
        net.origin[3 * face + 1] = far
        net.origin[3 * face + 2] = v
        net.length[3 * face + 1] = d1 if i == 0 else (d2 if i == 1 else d0)
        net.length[3 * face + 2] = d0 if i == 0 else (d1 if i == 1 else d2)
        net.twin[3 * face + 1] = 3 * after + 2
        net.twin[3 * after + 2] = 3 * face + 1
        net.first[far] = 3 * after
        touch(net, face)
    net.first[v] = e + 2
    p = net.head[f]
    net.head[f] = -1
    net.head[f1] = -1
    net.head[f2] = -1
    while p >= 0:
        following = net.follow[p]
        b0, b1, b2w = net.bary[p, 0], net.bary[p, 1], net.bary[p, 2]
        m0, m1, m2 = b0 / w0, b1 / w1, b2w / w2
        if m2 <= m0 and m2 <= m1:
            put_point(net, p, f, b0 - m2 * w0, b1 - m2 * w1, m2)
        elif m0 <= m1:
            put_point(net, p, f1, b1 - m0 * w1, b2w - m0 * w2, m0)
        else:
            put_point(net, p, f2, b2w - m1 * w2, b0 - m1 * w0, m1)
        p = following
    enqueue(net, e)
    enqueue(net, 3 * f1)
    enqueue(net, 3 * f2)
    legalise(net, 10000)
    return True


@njit(types.void(NET, types.int64), cache=True, nogil=True, error_model="numpy")
def unhang(net, p):  # type: ignore[no-untyped-def]
    """Take point `p` out of its face's list (its weights stay)."""
    f = net.home[p]
    if f < 0:
        return
    at = net.head[f]
    if at == p:
        net.head[f] = net.follow[p]
    else:
        while at >= 0 and net.follow[at] != p:
            at = net.follow[at]
        if at >= 0:
            net.follow[at] = net.follow[p]
    net.home[p] = -1
