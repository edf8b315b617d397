"""Taking a vertex out of an intrinsic triangulation, carrying tracked points along.

The star of the vertex is made flat by scaling its spokes (a discrete conformal change at that vertex only: Gillespie,
Springborn & Crane, Discrete Conformal Equivalence of Polyhedral Surfaces, 2021), laid out around the vertex, and its
hole filled again with the Delaunay triangulation of the ring (Devillers, On Deletion in Delaunay Triangulations, 2002:
clip the ear whose lifted plane lies lowest over the vertex). Points go straight to their new triangle. Where the star
cannot be made flat the angles are shared out evenly: no longer conformal, still continuous.
"""

from __future__ import annotations

from math import atan2, cos, exp, hypot, pi, sin
from typing import Any, NamedTuple

import numpy as np
from numba import njit, types

from core.mesh.intrinsic_flips import (
    F1,
    F2,
    FREE,
    I1,
    NET,
    area,
    enqueue,
    flip,
    legalise,
    put_point,
    touch,
)

LARGEST_RING = 2048


class Ring(NamedTuple):
    """Room to work on one star, so that kernels allocate nothing; all rows are spokes of the vertex.

    spoke : half-edges leaving the vertex, counter-clockwise. inner, outer : lengths of spoke and ring edge.
    x, y : ring vertex laid flat, the vertex at the origin. after, before : the polygon that is left, as a linked list.
    mate : the half-edge across the polygon edge that starts here; -1 - j where that is ring edge j itself.
    slot : the new half-edge of ring edge i, once there. end : ring vertex. lift : order of ears.
    corner : (R, 3) new triangles as ring rows. affine : (R, 6) position to weights of a new triangle.
    """

    spoke: np.ndarray
    after: np.ndarray
    before: np.ndarray
    mate: np.ndarray
    slot: np.ndarray
    end: np.ndarray
    inner: np.ndarray
    outer: np.ndarray
    span: np.ndarray
    x: np.ndarray
    y: np.ndarray
    lift: np.ndarray
    corner: np.ndarray
    affine: np.ndarray


RING: Any = types.NamedTuple(  # type: ignore[no-untyped-call]
    (I1,) * 6 + (F1,) * 6 + (types.Array(types.int32, 2, "C"), F2), Ring
)


def make_ring() -> Ring:
    """Working room for :func:`remove_vertex`."""
    n = LARGEST_RING
    whole, real = [np.empty(n, np.int32) for _ in range(6)], [np.empty(n) for _ in range(6)]
    return Ring._make([*whole, *real, np.empty((n, 3), np.int32), np.empty((n, 6))])


@njit(types.int64(NET, RING, types.int64, types.int64), cache=True, nogil=True)
def _collect(net, ring, v, cap):  # type: ignore[no-untyped-def]
    """Gather the star of `v`; its degree, or -1 when that exceeds `cap`."""
    start = net.first[v]
    h = start
    d = 0
    while True:
        if d >= cap:
            return -1
        f, k = h // 3, h % 3
        n, p = 3 * f + (k + 1) % 3, 3 * f + (k + 2) % 3
        ring.spoke[d] = h
        ring.inner[d] = net.length[h]
        ring.outer[d] = net.length[n]
        ring.end[d] = net.origin[n]
        d += 1
        h = net.twin[p]
        if h == start:
            return d


@njit(types.int64(NET, RING, types.int64, types.int64), cache=True, nogil=True)
def _open_star(net, ring, v, cap):  # type: ignore[no-untyped-def]
    """Flip until the star of `v` is a disc with at least three spokes; its degree, or -1 when it will not."""
    for _ in range(24):
        d = _collect(net, ring, v, cap)
        if d < 0:
            return -1
        loops = 0
        flipped = False
        for i in range(d):
            if ring.end[i] == v:
                loops += 1
                if not flipped:
                    flipped = flip(net, ring.spoke[i])
        if loops == 0:
            if d >= 3:
                return d
            for i in range(d):
                h = ring.spoke[i]
                if not flipped:
                    flipped = flip(net, h - h % 3 + (h + 1) % 3)
        if not flipped:
            return -1
    return -1


@njit(types.float64(RING, types.int64, types.float64), cache=True, nogil=True)
def _angles(ring, d, scale):  # type: ignore[no-untyped-def]
    """Write the angle of every triangle around the vertex, spokes scaled; their sum, or -1 where one cannot close."""
    total = 0.0
    for i in range(d):
        j = i + 1 if i + 1 < d else 0
        a, b, c = ring.inner[i] * scale, ring.inner[j] * scale, ring.outer[i]
        twice = 4.0 * area(a, b, c)
        if twice <= 1e-9 * max(a * b, c * c):
            return -1.0
        ring.span[i] = atan2(twice, a * a + b * b - c * c)
        total += ring.span[i]
    return total


@njit(types.float64(RING, types.int64), cache=True, nogil=True)
def _flatten(ring, d):  # type: ignore[no-untyped-def]
    """Scale of the spokes that makes the angles around the vertex sum to 2 pi, or -1. Newton with halved steps."""
    u = 0.0
    total = _angles(ring, d, 1.0)
    if total < 0.0:
        return -1.0
    for _ in range(40):
        off = total - 2.0 * pi
        if abs(off) < 1e-12:
            break
        scale = exp(0.5 * u)
        slope = 0.0
        for i in range(d):
            j = i + 1 if i + 1 < d else 0
            slope += ring.outer[i] ** 2 / (2.0 * area(ring.inner[i] * scale, ring.inner[j] * scale, ring.outer[i]))
        step = min(1.0, max(-1.0, off / (0.5 * slope)))
        tried = -1.0
        for _half in range(8):
            tried = _angles(ring, d, exp(0.5 * (u + step)))
            if tried > 0.0:
                break
            step *= 0.5
        if tried < 0.0:
            return -1.0
        u += step
        total = tried
    return exp(0.5 * u) if abs(total - 2.0 * pi) < 1e-7 else -1.0


@njit(types.boolean(NET, RING, types.int64), cache=True, nogil=True)
def _ease(net, ring, d):  # type: ignore[no-untyped-def]
    """One flip that helps a star become flat: the edge that scaling would make non-Delaunay first.

    Shrinking spokes (a cone tip) press the vertex against its ring: the ring edge opposite the widest angle goes.
    Growing spokes (a saddle) leave a triangle behind: its longer spoke goes.
    """
    total, wide, skew = 0.0, 0, 0
    for i in range(d):
        j = i + 1 if i + 1 < d else 0
        a, b, c = ring.inner[i], ring.inner[j], ring.outer[i]
        total += atan2(4.0 * area(a, b, c), a * a + b * b - c * c)
        aw, bw, cw = ring.inner[wide], ring.inner[wide + 1 if wide + 1 < d else 0], ring.outer[wide]
        if c * (aw + bw) > cw * (a + b):
            wide = i
        ak, bk, ck = ring.inner[skew], ring.inner[skew + 1 if skew + 1 < d else 0], ring.outer[skew]
        if abs(a - b) * ck > abs(ak - bk) * c:
            skew = i
    if total < 2.0 * pi:
        h = ring.spoke[wide]
        return flip(net, h - h % 3 + (h + 1) % 3)
    j = skew + 1 if skew + 1 < d else 0
    return flip(net, ring.spoke[skew] if ring.inner[skew] > ring.inner[j] else ring.spoke[j])


@njit(types.void(RING, types.int64, types.float64), cache=True, nogil=True)
def _place(ring, d, scale):  # type: ignore[no-untyped-def]
    """Positions of the ring from spoke lengths and ``ring.span``, angles scaled to a full turn."""
    total = 0.0
    for i in range(d):
        total += ring.span[i]
    turn = 2.0 * pi / total
    angle = 0.0
    for i in range(d):
        ring.x[i] = ring.inner[i] * scale * cos(angle)
        ring.y[i] = ring.inner[i] * scale * sin(angle)
        angle += ring.span[i] * turn


@njit(types.boolean(RING, types.int64), cache=True, nogil=True)
def _place_unflattened(ring, d):  # type: ignore[no-untyped-def]
    """Lay out a star that cannot be made flat, sharing its angles out; False when two would be too wide."""
    total, wide = 0.0, 0
    for i in range(d):
        j = i + 1 if i + 1 < d else 0
        a, b, c = ring.inner[i], ring.inner[j], ring.outer[i]
        ring.span[i] = max(1e-3, atan2(4.0 * area(a, b, c), a * a + b * b - c * c))
        total += ring.span[i]
        if ring.span[i] > ring.span[wide]:
            wide = i
    widest = 0.95 * pi
    if ring.span[wide] * 2.0 * pi > widest * total:  # the vertex would lie outside its ring
        rest = total - ring.span[wide]
        for i in range(d):
            ring.span[i] = widest if i == wide else ring.span[i] * (2.0 * pi - widest) / rest
            if ring.span[i] > widest:
                return False
    _place(ring, d, 1.0)
    return True


@njit(types.float64(RING, types.int64, types.int64, types.int64, types.float64), cache=True, nogil=True)
def _lift(ring, i, j, k, sliver):  # type: ignore[no-untyped-def]
    """Height over the vertex of the plane of ear i, j, k on the paraboloid; infinite where thinner than `sliver`."""
    ax, ay, bx, by, cx, cy = ring.x[i], ring.y[i], ring.x[j], ring.y[j], ring.x[k], ring.y[k]
    e = (bx - ax) ** 2 + (by - ay) ** 2 + (cx - bx) ** 2 + (cy - by) ** 2
    turn = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    if turn <= sliver * e:
        return np.inf
    up = (ax * ax + ay * ay) * (bx * cy - by * cx) - (bx * bx + by * by) * (ax * cy - ay * cx)
    up += (cx * cx + cy * cy) * (ax * by - ay * bx)
    return up / turn


@njit(types.boolean(RING, types.int64, types.float64), cache=True, nogil=True)
def _fill(ring, d, sliver):  # type: ignore[no-untyped-def]
    """Triangulate the ring polygon into ``ring.corner``; False when no positive triangulation is found."""
    for i in range(d):
        ring.after[i] = i + 1 if i + 1 < d else 0
        ring.before[i] = i - 1 if i > 0 else d - 1
    for i in range(d):
        ring.lift[i] = _lift(ring, ring.before[i], i, ring.after[i], sliver)
    at = 0
    for n in range(d - 3):
        best = -1
        i = at
        for _ in range(d - n):
            if ring.lift[i] < np.inf and (best < 0 or ring.lift[i] < ring.lift[best]):
                best = i
            i = ring.after[i]
        if best < 0:
            return False
        a, c = ring.before[best], ring.after[best]
        ring.corner[n, 0], ring.corner[n, 1], ring.corner[n, 2] = a, best, c
        ring.after[a] = c
        ring.before[c] = a
        ring.lift[a] = _lift(ring, ring.before[a], a, c, sliver)
        ring.lift[c] = _lift(ring, a, c, ring.after[c], sliver)
        at = a
    a, c = ring.before[at], ring.after[at]
    ring.corner[d - 3, 0], ring.corner[d - 3, 1], ring.corner[d - 3, 2] = a, at, c
    return _lift(ring, a, at, c, sliver) < np.inf


@njit(types.boolean(RING, types.int64), cache=True, nogil=True)
def _closes(ring, d):  # type: ignore[no-untyped-def]
    """True when every new triangle closes with the lengths it will have."""
    for n in range(d - 2):
        a, b, c = 0.0, 0.0, 0.0
        for m in range(3):
            i, j = ring.corner[n, m], ring.corner[n, (m + 1) % 3]
            if j == i + 1 or (i == d - 1 and j == 0):
                side = ring.outer[i]
            else:
                side = hypot(ring.x[i] - ring.x[j], ring.y[i] - ring.y[j])
            a, b, c = b, c, side
        if area(a, b, c) <= 1e-9 * max(a, b, c) ** 2:
            return False
    return True


@njit(types.void(NET, RING, types.int64, types.int64, types.float64, types.float64), cache=True, nogil=True)
def _relocate(net, ring, p, d, x, y):  # type: ignore[no-untyped-def]
    """Hang point `p` at position (x, y) of the layout into the new triangle it lies in (new faces use old spokes')."""
    best, w0, w1 = -1, 0.0, 0.0
    least = -np.inf
    for n in range(d - 2):
        b = ring.affine[n, 0] + ring.affine[n, 1] * x + ring.affine[n, 2] * y
        c = ring.affine[n, 3] + ring.affine[n, 4] * x + ring.affine[n, 5] * y
        low = min(b, c, 1.0 - b - c)
        if low > least:
            least = low
            best, w0, w1 = n, b, c
            if low >= 0.0:
                break
    put_point(net, p, ring.spoke[best] // 3, 1.0 - w0 - w1, w0, w1)


@njit(types.void(NET, RING, types.int64, types.int64), cache=True, nogil=True)
def _move_points(net, ring, d, point):  # type: ignore[no-untyped-def]
    """Carry the points of the star, and the vertex itself as `point`, into the new triangles."""
    for n in range(d - 2):
        i, j, k = ring.corner[n, 0], ring.corner[n, 1], ring.corner[n, 2]
        ax, ay = ring.x[i], ring.y[i]
        bx, by, cx, cy = ring.x[j] - ax, ring.y[j] - ay, ring.x[k] - ax, ring.y[k] - ay
        inverse = 1.0 / (bx * cy - by * cx)
        ring.affine[n, 1], ring.affine[n, 2] = cy * inverse, -cx * inverse
        ring.affine[n, 4], ring.affine[n, 5] = -by * inverse, bx * inverse
        ring.affine[n, 0] = -(ring.affine[n, 1] * ax + ring.affine[n, 2] * ay)
        ring.affine[n, 3] = -(ring.affine[n, 4] * ax + ring.affine[n, 5] * ay)
    # lists first: the new triangles use the faces the points hang on now
    for i in range(d):
        f = ring.spoke[i] // 3
        ring.slot[i] = net.head[f]
        net.head[f] = -1
    for i in range(d):
        j = i + 1 if i + 1 < d else 0
        k = ring.spoke[i] % 3
        p = ring.slot[i]
        while p >= 0:
            following = net.follow[p]
            a, b = net.bary[p, (k + 1) % 3], net.bary[p, (k + 2) % 3]
            _relocate(net, ring, p, d, a * ring.x[i] + b * ring.x[j], a * ring.y[i] + b * ring.y[j])
            p = following
    if point >= 0:
        _relocate(net, ring, point, d, 0.0, 0.0)


@njit(types.void(NET, RING, types.int64), cache=True, nogil=True)
def _rewire(net, ring, d):  # type: ignore[no-untyped-def]
    """Write the new triangles into the faces of the star and free two of them."""
    for i in range(d):
        h = ring.spoke[i]
        ring.mate[i] = net.twin[h - h % 3 + (h + 1) % 3]
        ring.slot[i] = -1
    for i in range(d):  # a ring edge glued to another ring edge
        h = ring.mate[i]
        for j in range(d):
            s = ring.spoke[j]
            if h == s - s % 3 + (s + 1) % 3:
                ring.mate[i] = -1 - j
                break
    for i in range(d):
        ring.lift[i] = ring.outer[i]  # from here on the length of the polygon edge that starts here
    for n in range(d - 2):
        f = ring.spoke[n] // 3
        touch(net, f)
        for m in range(3):
            i, j = ring.corner[n, m], ring.corner[n, (m + 1) % 3]
            e = 3 * f + m
            net.origin[e] = ring.end[i]
            net.first[ring.end[i]] = e
            if m == 2 and n < d - 3:  # the ear's base: a new diagonal, an edge of the polygon that is left
                net.length[e] = hypot(ring.x[i] - ring.x[j], ring.y[i] - ring.y[j])
                ring.mate[j] = e
                ring.lift[j] = net.length[e]
                continue
            net.length[e] = ring.lift[i]
            other = ring.mate[i]
            if other < 0:
                ring.slot[i] = e
                other = ring.slot[-1 - other]
                if other < 0:
                    continue
            net.twin[e] = other
            net.twin[other] = e
    for n in range(d - 2, d):
        f = ring.spoke[n] // 3
        net.origin[3 * f] = -1
        net.origin[3 * f + 1] = -1
        net.origin[3 * f + 2] = -1
        net.free[net.tally[FREE]] = f
        net.tally[FREE] += 1


@njit(
    types.boolean(NET, RING, types.int64, types.int64, types.int64, types.boolean), cache=True, nogil=True
)
def remove_vertex(net, ring, v, point, cap, forgiving):  # type: ignore[no-untyped-def]
    """Take vertex `v` out, restore Delaunay, and hang `point` (-1: none) where it was; False when it must wait.

    `cap` bounds its degree; `forgiving` allows layouts that squeeze angles.
    """
    d, scale = -1, -1.0
    for _ in range(12):
        d = _open_star(net, ring, v, min(cap, LARGEST_RING))
        if d < 3:
            break
        scale = _flatten(ring, d)
        if scale > 0.0 or not _ease(net, ring, d):
            break
    done = d >= 3
    if done:
        if scale > 0.0:
            _place(ring, d, scale)
        else:
            done = forgiving and _place_unflattened(ring, d)
        # lengths cannot tell the height of a thin triangle: 1e-16 of them is 1e-12 of it at 1e-4
        done = done and (_fill(ring, d, 1e-4) or (forgiving and _fill(ring, d, 1e-8))) and _closes(ring, d)
    if done:
        _move_points(net, ring, d, point)
        _rewire(net, ring, d)
        net.first[v] = -1
        for n in range(d - 2):
            f = ring.spoke[n] // 3
            for k in range(3):
                enqueue(net, 3 * f + k)
    else:
        d = max(0, _collect(net, ring, v, LARGEST_RING))
        for i in range(d):
            f = ring.spoke[i] // 3
            for k in range(3):
                enqueue(net, 3 * f + k)
    legalise(net, 2000)
    return done


@njit(types.int64(NET, RING, I1, types.int64), cache=True, nogil=True)
def remove_vertices(net, ring, order, points):  # type: ignore[no-untyped-def]
    """Take out the vertices of `order`, in eight passes with a rising cap on degree.

    Vertex v becomes tracked point ``points + v``. Those that would not go stay at the front of `order`;
    returns how many.
    """
    left = len(order)
    for attempt in range(8):
        kept = 0
        for i in range(left):
            v = order[i]
            if not remove_vertex(net, ring, v, points + v, 16 << attempt, attempt >= 3):
                order[kept] = v
                kept += 1
        left = kept
        if left == 0:
            break
    return left
