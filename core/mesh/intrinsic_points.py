"""Tracked points of an intrinsic triangulation: hanging them up, reading their binding, finding a new place."""

from __future__ import annotations

import numpy as np
from numba import njit, types

from core.mesh.intrinsic_flips import B1, F1, F2, I1, NET, TOUCHED, area, touch

_RI1 = types.Array(types.int32, 1, "C", readonly=True)
_I2 = types.Array(types.int32, 2, "C")
_S2 = types.Array(types.float32, 2, "C")
_RF2 = types.Array(types.float64, 2, "C", readonly=True)
_RB1 = types.Array(types.uint8, 1, "C", readonly=True)

SITE, PHANTOM, HELPER = 1, 2, 3  # what a vertex that stays is


@njit(types.void(NET, I1, F2, types.int64), cache=True, nogil=True, error_model="numpy")
def hang_points(net, face, bary, start):  # type: ignore[no-untyped-def]
    """Hang points ``start ..`` into their faces (-1: none)."""
    for i in range(len(face) - 1, -1, -1):  # backwards, so that lists run forwards
        p, f = start + i, face[i]
        net.home[p] = f
        net.bary[p, 0], net.bary[p, 1], net.bary[p, 2] = bary[i, 0], bary[i, 1], bary[i, 2]
        if f >= 0:
            net.follow[p] = net.head[f]
            net.head[f] = p


@njit(
    types.void(_RI1, _RI1, _RF2, _RI1, _RB1, types.int64, types.int64, I1, F2), cache=True, nogil=True,
    error_model="numpy",
)
def gather_points(given, triangle, bary, face, flipped, start, stop, home, out):  # type: ignore[no-untyped-def]
    """Write face and weights on the manifold of points start .. stop, which are rows `given` of `triangle` and `bary`.

    face, flipped : (T,) of the triangles.
    """
    for p in range(start, stop):
        t = triangle[given[p]]
        home[p] = face[t]
        total = 0.0
        for k in range(3):
            w = bary[given[p], k]
            out[p, k] = min(w, 1.7e308) if w > 0.0 else 0.0
            total += out[p, k]
        for k in range(3):
            out[p, k] = out[p, k] / total if total > 0.0 else 1.0 / 3.0
        if flipped[t] == 1:
            out[p, 1], out[p, 2] = out[p, 2], out[p, 1]


@njit(types.void(NET, types.int64, types.int64), cache=True, nogil=True, error_model="numpy")
def hang_again(net, start, stop):  # type: ignore[no-untyped-def]
    """Hang points start .. stop into their homes, where they have one."""
    for p in range(stop - 1, start - 1, -1):  # backwards, so that lists run forwards
        f = net.home[p]
        if f >= 0:
            net.follow[p] = net.head[f]
            net.head[f] = p


@njit(types.boolean(NET, B1, I1, F1), cache=True, nogil=True, error_model="numpy")
def label_helpers(net, kind, label, distance):  # type: ignore[no-untyped-def]
    """Give vertices that are no sites the site nearest along edges; True when a helper's changed.

    Points of the faces around such a helper are noted as moved.
    """
    vertices = len(kind)
    before = label.copy()
    for v in range(vertices):
        distance[v] = 0.0 if kind[v] == SITE else np.inf
        if kind[v] != SITE:
            label[v] = -1
    for _ in range(64):
        better = False
        for h in range(len(net.origin)):
            v = net.origin[h]
            if v < 0:
                continue
            w = net.origin[net.twin[h]]
            if distance[v] + net.length[h] < distance[w]:
                distance[w] = distance[v] + net.length[h]
                label[w] = label[v]
                better = True
        if not better:
            break
    other = False
    for h in range(len(net.origin)):
        v = net.origin[h]
        if v >= 0 and kind[v] == HELPER and label[v] != before[v]:
            touch(net, h // 3)
            other = True
    return other


@njit(types.boolean(NET, B1, I1, types.int64, I1, I1), cache=True, nogil=True, error_model="numpy")
def _name_corners(net, kind, label, f, name, place):  # type: ignore[no-untyped-def]
    """The up to three sites of face `f`, and which of them each corner is (-1: none); True where a helper is one.

    Phantoms are dropped, corners that are one site named once.
    """
    name[:] = -1
    place[:] = -1
    used, helper = 0, False
    for phantoms in range(2):
        for k in range(3):
            v = net.origin[3 * f + k]
            s = label[v]
            if s < 0 or (kind[v] == PHANTOM) != (phantoms == 1) or (phantoms == 1 and used > 0 and name[0] >= 0):
                continue
            helper = helper or kind[v] == HELPER
            for m in range(3):
                if name[m] < 0:
                    name[m] = s
                    used += 1
                if name[m] == s:
                    place[k] = m
                    break
    return helper


@njit(
    types.void(NET, types.int64, types.int64, I1, I1, types.boolean, _I2, _S2, B1),
    cache=True, nogil=True, error_model="numpy",
)
def _read_point(net, p, row, name, place, helper, sites, weights, trouble):  # type: ignore[no-untyped-def]
    """Write the binding of point `p` to `row`. `trouble`: 1 bound through a helper, 2 to nothing."""
    w0, w1, w2 = 0.0, 0.0, 0.0
    for k in range(3):
        w = net.bary[p, k]
        if place[k] == 0:
            w0 += w
        elif place[k] == 1:
            w1 += w
        elif place[k] == 2:
            w2 += w
    total = w0 + w1 + w2
    if total < 1e-12:
        w0, w1, w2, total = 1.0, 0.0, 0.0, 1.0
    sites[row, 0] = max(name[0], 0)
    sites[row, 1] = max(name[1] if name[1] >= 0 else name[0], 0)
    sites[row, 2] = max(name[2] if name[2] >= 0 else name[0], 0)
    weights[row, 0], weights[row, 1], weights[row, 2] = w0 / total, w1 / total, w2 / total
    trouble[row] = 2 if name[0] < 0 else (1 if helper else 0)


@njit(types.void(I1, types.int64, I1, I1), cache=True, nogil=True, error_model="numpy")
def sort_points(home, count, ends, points):  # type: ignore[no-untyped-def]
    """Points 0 .. count face after face, those without one last; the ones of face f lie before ``ends[f + 1]``."""
    faces = len(ends) - 2
    ends[:] = 0
    for p in range(count):
        ends[(home[p] if home[p] >= 0 else faces) + 1] += 1
    at = 0
    for f in range(faces + 1):
        size = ends[f + 1]
        ends[f + 1] = at
        at += size
    for p in range(count):
        f = home[p] if home[p] >= 0 else faces
        points[ends[f + 1]] = p
        ends[f + 1] += 1


@njit(
    types.void(NET, B1, I1, _RI1, I1, I1, types.int64, types.int64, I1, _I2, _S2, B1),
    cache=True, nogil=True, error_model="numpy",
)
def read_faces(net, kind, label, given, ends, points, start, stop, order, sites, weights, trouble):  # type: ignore[no-untyped-def]
    """Write the binding of points of the faces start .. stop to the rows they were given in, and their rows to
    `order`, sorted by face. One face more than there are is that of points that have none."""
    name, place = np.empty(3, np.int32), np.empty(3, np.int32)
    for f in range(start, stop):
        if ends[f] == ends[f + 1]:
            continue
        helper = False
        if f < len(net.head):
            helper = _name_corners(net, kind, label, f, name, place)
        else:
            name[:] = -1
            place[:] = -1
        for at in range(ends[f], ends[f + 1]):
            row = given[points[at]]
            order[at] = row
            _read_point(net, points[at], row, name, place, helper, sites, weights, trouble)


@njit(types.int64(NET, B1, I1, _RI1, types.int64, I1, _I2, _S2, B1), cache=True, nogil=True, error_model="numpy")
def read_changed(net, kind, label, given, count, rows, sites, weights, trouble):  # type: ignore[no-untyped-def]
    """The same for the points of touched faces only, packed, and forget those faces; returns how many."""
    name, place = np.empty(3, np.int32), np.empty(3, np.int32)
    at = 0
    for i in range(net.tally[TOUCHED]):
        f = net.touched[i]
        net.changed[f] = 0
        if net.head[f] < 0:
            continue
        helper = _name_corners(net, kind, label, f, name, place)
        p = net.head[f]
        while p >= 0:
            if p < count:
                rows[at] = given[p]
                _read_point(net, p, at, name, place, helper, sites, weights, trouble)
                at += 1
            p = net.follow[p]
    net.tally[TOUCHED] = 0
    return at


@njit(types.int64(NET, types.int64, I1, F1, types.int64, F1, F1), cache=True, nogil=True, error_model="numpy")
def find_place(net, base, corners, weights, anchor, anchor_weights, out):  # type: ignore[no-untyped-def]
    """Where a place on a mesh triangle lies now: unfold faces until its corners' places are found, then blend.

    Parameters
    ----------
    base : the tracked point of vertex v is ``base + v``.
    corners, weights : (3,) the vertices of the mesh triangle and their weights.
    anchor, anchor_weights : a tracked point of the same mesh triangle near the place (-1: none); the blend of the
        corners is corrected by how far it is off there.
    out : (3,) written with the weights in the face.

    Returns the face, -1 where there is none.
    """
    reach = 96
    face = np.empty(reach, np.int32)
    flat = np.empty((reach, 6))
    at_face = np.empty(3, np.int32)
    at = np.zeros((3, 3))
    pos = np.zeros((3, 2))
    known = np.zeros(3, np.uint8)
    lead = 0
    for k in range(3):
        v = corners[k]
        if net.first[v] >= 0:
            at_face[k] = net.first[v] // 3
            at[k, net.first[v] % 3] = 1.0
        else:
            at_face[k] = net.home[base + v]
            at[k] = net.bary[base + v]
        if weights[k] > weights[lead]:
            lead = k
    if at_face[lead] < 0:
        return -1
    e = 3 * at_face[lead]
    face[0] = at_face[lead]
    l01, l12, l20 = net.length[e], net.length[e + 1], net.length[e + 2]
    flat[0] = 0.0
    flat[0, 2] = l01
    flat[0, 4] = (l01 * l01 + l20 * l20 - l12 * l12) / (2.0 * l01)
    flat[0, 5] = 2.0 * area(l01, l12, l20) / l01
    used, i, missing = 1, 0, 3
    while i < used and missing > 0:
        f = face[i]
        for k in range(3):
            if not known[k] and at_face[k] == f:
                known[k] = 1
                missing -= 1
                for m in range(3):
                    pos[k, 0] += at[k, m] * flat[i, 2 * m]
                    pos[k, 1] += at[k, m] * flat[i, 2 * m + 1]
        for k in range(3):
            t = net.twin[3 * f + k]
            g, tk = t // 3, t % 3
            seen = used >= reach
            for j in range(used):
                seen = seen or face[j] == g
            if seen:
                continue
            # g's edge t runs from b to a; its third corner lies on the far side
            k1 = (k + 1) % 3
            ax, ay, bx, by = flat[i, 2 * k], flat[i, 2 * k + 1], flat[i, 2 * k1], flat[i, 2 * k1 + 1]
            n, q = (tk + 1) % 3, (tk + 2) % 3
            l, ad, db = net.length[t], net.length[3 * g + n], net.length[3 * g + q]
            along = (l * l + ad * ad - db * db) / (2.0 * l * l)
            off = -2.0 * area(l, ad, db) / (l * l)
            dx, dy = bx - ax, by - ay
            face[used] = g
            flat[used, 2 * tk], flat[used, 2 * tk + 1] = bx, by
            flat[used, 2 * n], flat[used, 2 * n + 1] = ax, ay
            flat[used, 2 * q], flat[used, 2 * q + 1] = ax + along * dx - off * dy, ay + along * dy + off * dx
            used += 1
        i += 1
    x, y, total = 0.0, 0.0, 0.0
    for k in range(3):
        if known[k]:
            x += weights[k] * pos[k, 0]
            y += weights[k] * pos[k, 1]
            total += weights[k]
    x /= total
    y /= total
    if anchor >= 0 and missing == 0:
        for j in range(used):
            if face[j] == net.home[anchor]:
                for m in range(3):
                    x += net.bary[anchor, m] * flat[j, 2 * m] - anchor_weights[m] * pos[m, 0]
                    y += net.bary[anchor, m] * flat[j, 2 * m + 1] - anchor_weights[m] * pos[m, 1]
                break
    best, least = 0, -np.inf
    for j in range(used):
        ax, ay = flat[j, 0], flat[j, 1]
        ux, uy, vx, vy = flat[j, 2] - ax, flat[j, 3] - ay, flat[j, 4] - ax, flat[j, 5] - ay
        double = max(ux * vy - uy * vx, 1e-300)
        b = ((x - ax) * vy - (y - ay) * vx) / double
        c = (ux * (y - ay) - uy * (x - ax)) / double
        low = min(b, c, 1.0 - b - c)
        if low > least:
            best, least = j, low
            out[0], out[1], out[2] = 1.0 - b - c, b, c
    return face[best]
