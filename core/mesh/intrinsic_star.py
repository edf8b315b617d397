"""The star of a vertex laid flat, and its ring triangulated: the plane geometry of taking a vertex out.

Scaling all spokes is a discrete conformal change at one vertex (Gillespie, Springborn & Crane, Discrete Conformal
Equivalence of Polyhedral Surfaces, 2021). The hole is filled by clipping the ear whose lifted plane is lowest over the
vertex, which gives the Delaunay triangulation (Devillers, On Deletion in Delaunay Triangulations, 2002).
"""

from __future__ import annotations

from math import atan2, cos, exp, hypot, pi, sin
from typing import Any, NamedTuple

import numpy as np
from numba import njit, types

from core.mesh.intrinsic_flips import F1, F2, I1, area

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


@njit(types.float64(RING, types.int64, types.float64), cache=True, nogil=True, error_model="numpy")
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


@njit(types.float64(RING, types.int64), cache=True, nogil=True, error_model="numpy")
def flatten(ring, d):  # type: ignore[no-untyped-def]
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


@njit(types.void(RING, types.int64, types.float64), cache=True, nogil=True, error_model="numpy")
def place(ring, d, scale):  # type: ignore[no-untyped-def]
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


@njit(types.boolean(RING, types.int64), cache=True, nogil=True, error_model="numpy")
def place_unflattened(ring, d):  # type: ignore[no-untyped-def]
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
    place(ring, d, 1.0)
    return True


@njit(
    types.float64(RING, types.int64, types.int64, types.int64, types.float64),
    cache=True, nogil=True, error_model="numpy",
)
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


@njit(types.boolean(RING, types.int64, types.float64), cache=True, nogil=True, error_model="numpy")
def fill(ring, d, sliver):  # type: ignore[no-untyped-def]
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


@njit(types.boolean(RING, types.int64), cache=True, nogil=True, error_model="numpy")
def closes(ring, d):  # type: ignore[no-untyped-def]
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
