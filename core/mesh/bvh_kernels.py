"""Walking a bounding volume hierarchy, one query at a time (numba functions other kernels call)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

LANES = 8  # triangles of a leaf, tested together
STACK_SIZE = 64


@njit(cache=True, inline="always", error_model="numpy")
def new_stack():  # type: ignore[no-untyped-def]
    """Room for one traversal at a time: nodes (64,) int32 and their keys (64,) float64 (make it once per kernel)."""
    return np.empty(STACK_SIZE, np.int32), np.empty(STACK_SIZE, np.float64)


@njit(cache=True, nogil=True, error_model="numpy")
def closest_on_triangle(corners, slot, qx, qy, qz):  # type: ignore[no-untyped-def]
    """Closest point of the triangle in a slot to q: squared distance and barycentric (kernel form).

    Ericson, "Real-Time Collision Detection" 5.1.5, by Voronoi regions; degenerate triangles fall to their edges.
    """
    ax, ay, az = np.float64(corners[slot, 0]), np.float64(corners[slot, 1]), np.float64(corners[slot, 2])
    abx, aby, abz = corners[slot, 3] - ax, corners[slot, 4] - ay, corners[slot, 5] - az
    acx, acy, acz = corners[slot, 6] - ax, corners[slot, 7] - ay, corners[slot, 8] - az
    px, py, pz = qx - ax, qy - ay, qz - az
    bb = abx * abx + aby * aby + abz * abz
    cc = acx * acx + acy * acy + acz * acz
    bc = abx * acx + aby * acy + abz * acz
    d1 = abx * px + aby * py + abz * pz
    d2 = acx * px + acy * py + acz * pz
    d3, d4 = d1 - bb, d2 - bc  # the same products from b
    d5, d6 = d1 - bc, d2 - cc  # and from c
    if d1 <= 0.0 and d2 <= 0.0:
        v, w = 0.0, 0.0
    elif d3 >= 0.0 and d4 <= d3:
        v, w = 1.0, 0.0
    elif d6 >= 0.0 and d5 <= d6:
        v, w = 0.0, 1.0
    else:
        vc = d1 * d4 - d3 * d2
        vb = d5 * d2 - d1 * d6
        va = d3 * d6 - d5 * d4
        if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
            v, w = d1 / bb if bb > 0.0 else 0.0, 0.0
        elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
            v, w = 0.0, d2 / cc if cc > 0.0 else 0.0
        elif va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
            length = (d4 - d3) + (d5 - d6)
            w = (d4 - d3) / length if length > 0.0 else 0.0
            v = 1.0 - w
        else:
            scale = 1.0 / (va + vb + vc)
            v, w = vb * scale, vc * scale
    x = px - v * abx - w * acx
    y = py - v * aby - w * acy
    z = pz - v * abz - w * acz
    return x * x + y * y + z * z, 1.0 - v - w, v, w


@njit(cache=True, inline="always", error_model="numpy")
def _box_distance2(boxes, node, at, x, y, z):  # type: ignore[no-untyped-def]
    dx = max(boxes[node, at] - x, x - boxes[node, at + 3], np.float32(0.0))
    dy = max(boxes[node, at + 1] - y, y - boxes[node, at + 4], np.float32(0.0))
    dz = max(boxes[node, at + 2] - z, z - boxes[node, at + 5], np.float32(0.0))
    return dx * dx + dy * dy + dz * dz


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"nnan", "nsz"})
def _lanes_within(blocks, leaf, x, y, z, bound):  # type: ignore[no-untyped-def]
    """Bits of the triangles of a leaf that may lie within squared distance `bound`: float32, never missing one.

    No branches: the compiler turns the loop into one pass over all lanes. Distances to the plane and to the three edges
    come from dot products alone; what they may be wrong by grows with the offset and, in the plane, with 1 / sin^2 of
    the angle between the edges.
    """
    zero, one, tiny = np.float32(0.0), np.float32(1.0), np.float32(1e-37)
    bits = np.int32(0)
    for k in range(LANES):
        ax, ay, az = blocks[leaf, 0, k], blocks[leaf, 1, k], blocks[leaf, 2, k]
        px, py, pz = x - ax, y - ay, z - az
        ux, uy, uz = blocks[leaf, 3, k] - ax, blocks[leaf, 4, k] - ay, blocks[leaf, 5, k] - az
        vx, vy, vz = blocks[leaf, 6, k] - ax, blocks[leaf, 7, k] - ay, blocks[leaf, 8, k] - az
        uu, vv, uv = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, ux * vx + uy * vy + uz * vz
        pu, pv, pp = ux * px + uy * py + uz * pz, vx * px + vy * py + vz * pz, px * px + py * py + pz * pz
        # edges a-b, a-c, b-c
        e = pu / (uu if uu > tiny else tiny)
        e = e if e > zero else zero
        e = e if e < one else one
        d = pp - e * (pu + pu - e * uu)
        e = pv / (vv if vv > tiny else tiny)
        e = e if e > zero else zero
        e = e if e < one else one
        other = pp - e * (pv + pv - e * vv)
        d = d if d < other else other
        ww, pw = uu + vv - uv - uv, (pv - pu) + (uu - uv)
        e = pw / (ww if ww > tiny else tiny)
        e = e if e > zero else zero
        e = e if e < one else one
        other = (pp - pu - pu + uu) - e * (pw + pw - e * ww)
        d = d if d < other else other
        # the plane, where the foot lies within
        det = uu * vv - uv * uv
        inverse = one / (det if det > tiny else tiny)
        s, t = vv * pu - uv * pv, uu * pv - uv * pu
        least = s if s < t else t
        rest = det - s - t
        least = least if least < rest else rest
        other = pp - (s * inverse) * pu - (t * inverse) * pv
        other = other if other > zero else zero
        d = other if least > zero else d
        blur = uu * vv * inverse
        blur = blur if blur < np.float32(1e6) else np.float32(1e6)
        size = pp if pp > uu else uu
        blur = (np.float32(10.0) + blur) * np.float32(4e-7) * size
        bits = bits | ((np.int32(1) << np.int32(k)) if d - blur <= bound else np.int32(0))
    return bits


@njit(cache=True, nogil=True, error_model="numpy")
def closest_one(boxes, children, corners, blocks, x, y, z, limit2, stack, keys):  # type: ignore[no-untyped-def]
    """Closest point of the skin to (x, y, z) float32 (kernel form).

    Returns (slot, squared distance, three barycentric weights); slot is -1 when nothing is nearer than sqrt(limit2),
    else ``bvh.order[slot]`` is the triangle. `stack`, `keys` come from `new_stack()`.
    """
    best, slot = limit2, -1
    b0 = b1 = b2 = 0.0
    qx, qy, qz = np.float64(x), np.float64(y), np.float64(z)
    node, top = 0, 0
    while True:
        near = _box_distance2(boxes, node, 0, x, y, z)
        far = _box_distance2(boxes, node, 6, x, y, z)
        near_child, far_child = children[node, 0], children[node, 1]
        if far < near:
            near, far = far, near
            near_child, far_child = far_child, near_child
        # float32 distances of boxes are off by a few units in the last place; never prune by that much
        node = -1
        for which in range(2):
            child = near_child if which == 0 else far_child
            d2 = np.float64(near if which == 0 else far) * 0.999999
            if d2 < best:
                if child >= 0:
                    if node < 0:
                        node = child
                    else:
                        stack[top] = child
                        keys[top] = d2
                        top += 1
                else:
                    leaf = ~child >> 4
                    bits = _lanes_within(blocks, leaf, x, y, z, np.float32(best * 1.000001))
                    s = leaf * LANES
                    while bits != 0:
                        while bits & 1 == 0:
                            bits >>= 1
                            s += 1
                        bits >>= 1
                        d, u, v, w = closest_on_triangle(corners, s, qx, qy, qz)
                        s += 1
                        if d < best:
                            best, slot, b0, b1, b2 = d, s - 1, u, v, w
                            if bits != 0:
                                again = _lanes_within(blocks, leaf, x, y, z, np.float32(best * 1.000001))
                                bits &= again >> np.int32(s - leaf * LANES)
        while node < 0:
            if top == 0:
                return slot, best, b0, b1, b2
            top -= 1
            if keys[top] < best:
                node = stack[top]


@njit(cache=True, inline="always", error_model="numpy")
def _box_entry(boxes, node, at, ox, oy, oz, ix, iy, iz, limit):  # type: ignore[no-untyped-def]
    """Where the ray enters the box, or a negative number when it misses it before `limit`."""
    x0, x1 = (boxes[node, at] - ox) * ix, (boxes[node, at + 3] - ox) * ix
    y0, y1 = (boxes[node, at + 1] - oy) * iy, (boxes[node, at + 4] - oy) * iy
    z0, z1 = (boxes[node, at + 2] - oz) * iz, (boxes[node, at + 5] - oz) * iz
    enter = max(min(x0, x1), min(y0, y1), min(z0, z1), 0.0)
    leave = min(max(x0, x1), max(y0, y1), max(z0, z1), limit)
    # widened by rounding (Ize, "Robust BVH Ray Traversal", 2013)
    return enter if enter <= leave * (1.0 + 1e-14) + 1e-300 and boxes[node, at] <= boxes[node, at + 3] else -1.0


@njit(cache=True, inline="always", error_model="numpy")
def _ray_on_triangle(corners, slot, ox, oy, oz, kx, ky, kz, sx, sy, sz):  # type: ignore[no-untyped-def]
    """Distance (negative: missed) and barycentric of a ray meeting the triangle, either side.

    Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", 2013: sheared so that the ray is the z axis; the
    edge functions of two triangles sharing an edge are the same number with opposite signs, so no ray slips between.
    """
    ax, ay = corners[slot, kx] - ox, corners[slot, ky] - oy
    bx, by = corners[slot, 3 + kx] - ox, corners[slot, 3 + ky] - oy
    cx, cy = corners[slot, 6 + kx] - ox, corners[slot, 6 + ky] - oy
    az, bz, cz = corners[slot, kz] - oz, corners[slot, 3 + kz] - oz, corners[slot, 6 + kz] - oz
    ax, ay = ax - sx * az, ay - sy * az
    bx, by = bx - sx * bz, by - sy * bz
    cx, cy = cx - sx * cz, cy - sy * cz
    u, v, w = cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax
    if (u < 0.0 or v < 0.0 or w < 0.0) and (u > 0.0 or v > 0.0 or w > 0.0):
        return -1.0, 0.0, 0.0, 0.0
    det = u + v + w
    if det == 0.0 or not math.isfinite(det):
        return -1.0, 0.0, 0.0, 0.0
    u, v, w = u / det, v / det, w / det
    return (u * az + v * bz + w * cz) * sz, u, v, w


@njit(cache=True, nogil=True, error_model="numpy")
def ray_one(boxes, children, corners, ox, oy, oz, dx, dy, dz, limit, any_hit, stack, keys):  # type: ignore[no-untyped-def]
    """The first triangle (with `any_hit` whichever comes first) on o + t d, 0 <= t <= limit (kernel form).

    Returns (slot or -1, t, three barycentric weights). `stack`, `keys` come from `new_stack()`.
    """
    slot, best = -1, limit
    b0 = b1 = b2 = 0.0
    # the axis along which the ray runs most becomes z; no winding is kept, both sides are hit alike
    if abs(dx) >= abs(dy) and abs(dx) >= abs(dz):
        kx, ky, kz = 1, 2, 0
        px, py, pz, ex, ey, ez = oy, oz, ox, dy, dz, dx
    elif abs(dy) >= abs(dz):
        kx, ky, kz = 2, 0, 1
        px, py, pz, ex, ey, ez = oz, ox, oy, dz, dx, dy
    else:
        kx, ky, kz = 0, 1, 2
        px, py, pz, ex, ey, ez = ox, oy, oz, dx, dy, dz
    if not (abs(ez) > 0.0 and math.isfinite(ox + oy + oz + dx + dy + dz)):
        return slot, best, b0, b1, b2
    sx, sy, sz = ex / ez, ey / ez, 1.0 / ez
    ix = 1.0 / dx if abs(dx) > 1e-200 else 1e200
    iy = 1.0 / dy if abs(dy) > 1e-200 else 1e200
    iz = 1.0 / dz if abs(dz) > 1e-200 else 1e200
    node, top = 0, 0
    while True:
        near = _box_entry(boxes, node, 0, ox, oy, oz, ix, iy, iz, best)
        far = _box_entry(boxes, node, 6, ox, oy, oz, ix, iy, iz, best)
        near_child, far_child = children[node, 0], children[node, 1]
        if far < near:
            near, far = far, near
            near_child, far_child = far_child, near_child
        node = -1
        for which in range(2):
            child = near_child if which == 0 else far_child
            entry = near if which == 0 else far
            if 0.0 <= entry <= best:
                if child >= 0:
                    if node < 0:
                        node = child
                    else:
                        stack[top] = child
                        keys[top] = entry
                        top += 1
                else:
                    first = (~child >> 4) * LANES
                    for s in range(first, first + (~child & 15)):
                        t, u, v, w = _ray_on_triangle(corners, s, px, py, pz, kx, ky, kz, sx, sy, sz)
                        if 0.0 <= t <= best and (slot < 0 or t < best):
                            slot, best, b0, b1, b2 = s, t, u, v, w
                            if any_hit:
                                return slot, best, b0, b1, b2
        while node < 0:
            if top == 0:
                return slot, best, b0, b1, b2
            top -= 1
            if keys[top] <= best:
                node = stack[top]


@njit(cache=True, nogil=True, error_model="numpy")
def any_hit_segment(boxes, children, corners, ax, ay, az, bx, by, bz, stack, keys):  # type: ignore[no-untyped-def]
    """True when the segment from a to b meets the skin (kernel form)."""
    found = ray_one(boxes, children, corners, ax, ay, az, bx - ax, by - ay, bz - az, 1.0, True, stack, keys)
    return found[0] >= 0
