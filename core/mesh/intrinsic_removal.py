"""Taking a vertex out of an intrinsic triangulation, carrying tracked points along.

The star of the vertex is made flat and its hole filled again (see :mod:`core.mesh.intrinsic_star`); points go straight
to their new triangle. Where the star cannot be made flat the angles are shared out evenly: no longer conformal, still
continuous.
"""

from __future__ import annotations

from math import atan2, hypot, pi

import numpy as np
from numba import njit, types

from core.mesh.intrinsic_flips import FREE, I1, NET, area, enqueue, flip, legalise, put_point, touch
from core.mesh.intrinsic_star import LARGEST_RING, RING, closes, fill, flatten, place, place_unflattened


@njit(types.int64(NET, RING, types.int64, types.int64), cache=True, nogil=True, error_model="numpy")
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


@njit(types.int64(NET, RING, types.int64, types.int64), cache=True, nogil=True, error_model="numpy")
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


@njit(types.boolean(NET, RING, types.int64), cache=True, nogil=True, error_model="numpy")
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


@njit(
    types.void(NET, RING, types.int64, types.int64, types.float64, types.float64),
    cache=True, nogil=True, error_model="numpy",
)
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


@njit(types.void(NET, RING, types.int64, types.int64), cache=True, nogil=True, error_model="numpy")
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


@njit(types.void(NET, RING, types.int64), cache=True, nogil=True, error_model="numpy")
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
    types.boolean(NET, RING, types.int64, types.int64, types.int64, types.boolean),
    cache=True, nogil=True, error_model="numpy",
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
        scale = flatten(ring, d)
        if scale > 0.0 or not _ease(net, ring, d):
            break
    done = d >= 3
    if done:
        if scale > 0.0:
            place(ring, d, scale)
        else:
            done = forgiving and place_unflattened(ring, d)
        # lengths cannot tell the height of a thin triangle: 1e-16 of them is 1e-12 of it at 1e-4
        done = done and (fill(ring, d, 1e-4) or (forgiving and fill(ring, d, 1e-8))) and closes(ring, d)
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


@njit(types.int64(NET, RING, I1, types.int64), cache=True, nogil=True, error_model="numpy")
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
