"""The comb's kernel: grip and lay, in joint angles, one strand at a time.

Per step of the ring from a to b (at most 0.12 of its radius):
1. *Contact*: the point of the strand deepest under the ring, picked anew each step, so hair slips through it.
2. *Grip*: the contact follows the pointer across the strand (not along it), by the least-squares turns of the joints
   from the root to the contact; what lies beyond is carried rigidly.
3. *Lay*: segments under the ring turn toward the stroke, by a step-exact law without overshoot.
4. *Bend limit*: no joint folds beyond the limit (combing against the hair rolls it over instead).
5. *Collision*: see core/groom/collide.py. A strand that cannot be brought out stays as it was.
Lengths are exact by construction: only directions are changed.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from core.falloff import falloff1
from core.groom.chain import first_free, read_chain, rebuild_chain, write_chain
from core.groom.collide import F32_2D, F32_3D, F64_1D, LEAST_GRADIENT, collide_chain
from core.mesh.distance_field import sample_gradient

STEP = 0.12  # of the radius
SPREAD = 0.43  # compliance of joints outside the ring
CARRY = 0.9  # how much of the lay goes on beyond the ring, from joint to joint
TRAIL = 1.0  # how much less hair is laid behind the ring's centre, which would have it lag in the curves of a stroke
STIFFNESS = 0.02  # regularises the 3 x 3 system of the grip
MAX_TURN = 0.5  # radians a segment may turn by the grip in one step
f64 = types.float64


@njit(cache=True, nogil=True, error_model="numpy")
def _turn(q, j, hx, hy, hz):  # type: ignore[no-untyped-def]
    """Rotate q[j] by the rotation vector h, |h| up to MAX_TURN (Cayley form: exact length, no trigonometry)."""
    hx, hy, hz = 0.5 * hx, 0.5 * hy, 0.5 * hz
    cx, cy, cz = hy * q[j, 2] - hz * q[j, 1], hz * q[j, 0] - hx * q[j, 2], hx * q[j, 1] - hy * q[j, 0]
    s = 2.0 / (1.0 + hx * hx + hy * hy + hz * hz)
    q[j, 0] += s * (cx + hy * cz - hz * cy)
    q[j, 1] += s * (cy + hz * cx - hx * cz)
    q[j, 2] += s * (cz + hx * cy - hy * cx)


@njit(cache=True, nogil=True, error_model="numpy")
def _grip(x, q, w, arcs, freedom, dx, dy, dz, turn):  # type: ignore[no-untyped-def]
    """Turn the joints so that the contact moves by (dx, dy, dz), less its part along the strand."""
    joints = q.shape[0]
    # one contact: the lobe of weights around the largest (a strand may cross the ring twice)
    top = 1
    for i in range(2, joints + 1):
        if w[i] > w[top]:
            top = i
    low, high = top, top
    while low > 1 and w[low - 1] > 0.0:
        low -= 1
    while high < joints and w[high + 1] > 0.0:
        high += 1
    total = arc = tx = ty = tz = 0.0
    for i in range(low, high + 1):
        total += w[i]
        arc += w[i] * arcs[i]
        tx += w[i] * q[i - 1, 0]
        ty += w[i] * q[i - 1, 1]
        tz += w[i] * q[i - 1, 2]
    arc /= total
    k = 0
    while k < joints - 1 and arcs[k + 1] < arc:
        k += 1
    cx = x[k, 0] + (arc - arcs[k]) * q[k, 0]
    cy = x[k, 1] + (arc - arcs[k]) * q[k, 1]
    cz = x[k, 2] + (arc - arcs[k]) * q[k, 2]
    size = tx * tx + ty * ty + tz * tz
    if size > 1e-20:
        along = (dx * tx + dy * ty + dz * tz) / size
        dx, dy, dz = dx - along * tx, dy - along * ty, dz - along * tz
    xx = yy = zz = xy = xz = yz = 0.0
    for j in range(k + 1):
        c = (w[j] + SPREAD) * freedom[j]
        rx, ry, rz = cx - x[j, 0], cy - x[j, 1], cz - x[j, 2]
        xx += c * (ry * ry + rz * rz)
        yy += c * (rx * rx + rz * rz)
        zz += c * (rx * rx + ry * ry)
        xy -= c * rx * ry
        xz -= c * rx * rz
        yz -= c * ry * rz
    add = STIFFNESS * (xx + yy + zz) / 3.0
    if add <= 0.0:
        return
    xx, yy, zz = xx + add, yy + add, zz + add
    a, b, e = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    det = xx * a + xy * b + xz * e
    f, g, h = xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy
    lx = (a * dx + b * dy + e * dz) / det
    ly = (b * dx + f * dy + g * dz) / det
    lz = (e * dx + g * dy + h * dz) / det
    sx = sy = sz = 0.0
    for j in range(joints):
        if j <= k:
            c = (w[j] + SPREAD) * freedom[j]
            rx, ry, rz = cx - x[j, 0], cy - x[j, 1], cz - x[j, 2]
            sx += c * (ry * lz - rz * ly)
            sy += c * (rz * lx - rx * lz)
            sz += c * (rx * ly - ry * lx)
        turned = math.sqrt(sx * sx + sy * sy + sz * sz)
        if turned > 0.0:
            cap = turn * (MAX_TURN / turned if turned > MAX_TURN else 1.0)
            _turn(q, j, cap * sx, cap * sy, cap * sz)


@njit(cache=True, nogil=True, error_model="numpy")
def _lay(q, j, vx, vy, vz, nx, ny, nz, rate):  # type: ignore[no-untyped-def]
    """Turn q[j] toward the unit vector v: the tangent of half the angle shrinks by exp(-rate)."""
    c = q[j, 0] * vx + q[j, 1] * vy + q[j, 2] * vz
    ex, ey, ez = q[j, 0] - c * vx, q[j, 1] - c * vy, q[j, 2] - c * vz
    s = math.sqrt(ex * ex + ey * ey + ez * ez)
    if s < 1e-6:
        if c > 0.0:
            return
        # exactly against the stroke: over the top, away from the skin
        d = nx * vx + ny * vy + nz * vz
        ex, ey, ez = nx - d * vx, ny - d * vy, nz - d * vz
        s = math.sqrt(ex * ex + ey * ey + ez * ez)
        if s < 1e-6:
            return
        c, size = -1.0 + 1e-6, 1.4e-3
        half = size / (1.0 + c)
    else:
        half = s / max(1.0 + c, 1e-9)
    half *= math.exp(-rate)
    size = 1.0 / (1.0 + half * half)
    along, across = (1.0 - half * half) * size, 2.0 * half * size / s
    q[j, 0], q[j, 1], q[j, 2] = along * vx + across * ex, along * vy + across * ey, along * vz + across * ez


@njit(cache=True, nogil=True, error_model="numpy")
def _normal_near(x, i, frames, row, collides, values, origin, cell):  # type: ignore[no-untyped-def]
    """Distance and normal (d, nx, ny, nz) of the skin nearest to x[i]; far from it none and that of the root."""
    if collides:
        gap, nx, ny, nz = sample_gradient(values, origin, cell, x[i, 0], x[i, 1], x[i, 2])
        size = math.sqrt(nx * nx + ny * ny + nz * nz)
        if size >= LEAST_GRADIENT:
            return gap, nx / size, ny / size, nz / size
    return 1e30, np.float64(frames[row, 2, 0]), np.float64(frames[row, 2, 1]), np.float64(frames[row, 2, 2])


@njit(cache=True, nogil=True, error_model="numpy")
def _limit_bends(q, first, limits):  # type: ignore[no-untyped-def]
    """Open every joint from segment `first` on that is folded more than its limit (a cosine), root to tip."""
    for j in range(max(1, first), q.shape[0]):
        px, py, pz = q[j - 1, 0], q[j - 1, 1], q[j - 1, 2]
        c = q[j, 0] * px + q[j, 1] * py + q[j, 2] * pz
        limit = limits[j]
        if c >= limit:
            continue
        ex, ey, ez = q[j, 0] - c * px, q[j, 1] - c * py, q[j, 2] - c * pz
        s = math.sqrt(ex * ex + ey * ey + ez * ez)
        if s < 1e-9:  # folded flat: the last direction square to it decides
            q[j, 0], q[j, 1], q[j, 2] = px, py, pz
            continue
        across = math.sqrt(1.0 - limit * limit) / s
        q[j, 0], q[j, 1], q[j, 2] = limit * px + across * ex, limit * py + across * ey, limit * pz + across * ez


@njit(
    types.void(
        types.int64, types.int64, types.float32[:, :, ::1], F32_2D, F32_3D,
        types.Array(types.float32, 1, "C", readonly=True), types.float64[:, ::1], types.float64[:, ::1], f64, f64,
        types.float64[:, ::1], f64, f64, f64, types.int64, f64, f64, f64, f64, F32_3D, F64_1D, f64, f64,
        types.boolean[::1],
    ),
    cache=True, nogil=True, error_model="numpy",
)
def comb_rows(  # type: ignore[no-untyped-def]
    start, stop, points, hold, frames, reach, clip, basis, width, height, path, radius, grip, lay, shape, flat,
    tip_first, lift, max_bend, values, origin, cell, clearance, touched,
):
    """Comb rows start .. stop of `points` (G, P, 3) in place; `touched` (G,) tells which were changed.

    reach : (G,) strength per strand, 0 leaves it out. path : (K, 2) pixels. radius : pixels.
    clip, basis, width, height : see core/groom/region.py View. values, origin, cell : field, empty for none.
    shape, flat : of the ring's weights, see core.falloff.falloff1.
    max_bend : radians per joint. clearance : fraction of the strand's length. The rest: see core/groom/comb.py.
    """
    count = points.shape[1]
    joints = count - 1
    x, q, lengths = np.empty((count, 3)), np.empty((joints, 3)), np.empty(joints)
    old_x, old_q = np.empty((count, 3)), np.empty((joints, 3))
    arcs, w, ahead = np.zeros(count), np.zeros(count), np.zeros(count)
    freedom, limits = np.empty(joints), np.empty(joints)
    screen = np.empty((count, 2))
    bend_cosine = math.cos(max_bend)
    sin_lift, tan_lift = math.sin(lift), math.tan(lift)
    collides = values.shape[0] > 1
    low_x, high_x = path[:, 0].min() - radius, path[:, 0].max() + radius
    low_y, high_y = path[:, 1].min() - radius, path[:, 1].max() + radius
    for row in range(start, stop):
        strength = np.float64(reach[row])
        if strength <= 0.0:
            continue
        loaded = False
        changed = False
        first, quantum, total = 0, 0.0, 0.0
        stale = True  # the strand moved since it was projected
        left = right = top = bottom = 0.0
        for piece in range(path.shape[0] - 1):
            way_x, way_y = path[piece + 1, 0] - path[piece, 0], path[piece + 1, 1] - path[piece, 1]
            way = math.sqrt(way_x * way_x + way_y * way_y)
            if way <= 1e-9 * radius:
                continue
            steps = max(1, math.ceil(way / (STEP * radius) - 1e-6))
            step_x, step_y = way_x / steps, way_y / steps
            for step in range(steps):
                if stale:
                    left = top = np.inf
                    right = bottom = -np.inf
                    for i in range(count):
                        if loaded:
                            px, py, pz = x[i, 0], x[i, 1], x[i, 2]
                        else:
                            px, py, pz = (
                                np.float64(points[row, i, 0]), np.float64(points[row, i, 1]),
                                np.float64(points[row, i, 2]),
                            )
                        depth = clip[3, 0] * px + clip[3, 1] * py + clip[3, 2] * pz + clip[3, 3]
                        if depth <= 1e-9:  # behind the eye
                            screen[i, 0] = screen[i, 1] = 1e30
                            continue
                        screen[i, 0] = 0.5 * width - 0.5 + 0.5 * width * (
                            clip[0, 0] * px + clip[0, 1] * py + clip[0, 2] * pz + clip[0, 3]) / depth
                        screen[i, 1] = 0.5 * height - 0.5 - 0.5 * height * (
                            clip[1, 0] * px + clip[1, 1] * py + clip[1, 2] * pz + clip[1, 3]) / depth
                        left, right = min(left, screen[i, 0]), max(right, screen[i, 0])
                        top, bottom = min(top, screen[i, 1]), max(bottom, screen[i, 1])
                    stale = False
                if right < low_x or left > high_x or bottom < low_y or top > high_y:
                    break
                ax, ay = path[piece, 0] + step * step_x, path[piece, 1] + step * step_y
                if (
                    right < min(ax, ax + step_x) - radius or left > max(ax, ax + step_x) + radius
                    or bottom < min(ay, ay + step_y) - radius or top > max(ay, ay + step_y) + radius
                ):
                    continue
                # weights of the points under the ring
                strongest = 0.0
                step_2 = step_x * step_x + step_y * step_y
                for i in range(1, count):
                    sx, sy = screen[i, 0] - ax, screen[i, 1] - ay
                    t = min(max((sx * step_x + sy * step_y) / step_2, 0.0), 1.0)
                    sx, sy = sx - t * step_x, sy - t * step_y
                    d2 = sx * sx + sy * sy
                    w[i] = ahead[i] = 0.0
                    if d2 < radius * radius:
                        w[i] = falloff1(shape, math.sqrt(d2) / radius, flat)
                        along = (sx * step_x + sy * step_y) / math.sqrt(step_2) / radius
                        ahead[i] = max(0.0, 1.0 + TRAIL * min(along, 0.0))
                        strongest = max(strongest, w[i])
                if strongest <= 0.0:
                    continue
                if not loaded:
                    first = first_free(hold, row, freedom)
                    if first == joints:
                        break
                    quantum = read_chain(points, row, x, q, lengths)
                    for j in range(joints):
                        arcs[j + 1] = arcs[j] + lengths[j]
                    total = arcs[joints]
                    if total <= 0.0:
                        break
                    loaded = True
                strongest = 0.0
                mean_w, depth = 0.0, 0.0
                for i in range(1, count):
                    w[i] *= freedom[i - 1] * (1.0 - tip_first * (1.0 - arcs[i] / total))
                    strongest = max(strongest, w[i])
                    mean_w += w[i]
                    depth += w[i] * (clip[3, 0] * x[i, 0] + clip[3, 1] * x[i, 1] + clip[3, 2] * x[i, 2] + clip[3, 3])
                if strongest <= 1e-6:
                    continue
                depth /= mean_w
                old_x[:], old_q[:] = x, q
                for j in range(1, joints):
                    c = q[j, 0] * q[j - 1, 0] + q[j, 1] * q[j - 1, 1] + q[j, 2] * q[j - 1, 2]
                    limits[j] = max(-1.0, min(bend_cosine, c))
                # motion of the pointer at the depth of the contact
                mx, my = 2.0 * step_x / width * depth, -2.0 * step_y / height * depth
                dx = basis[0, 0] * mx + basis[0, 1] * my
                dy = basis[1, 0] * mx + basis[1, 1] * my
                dz = basis[2, 0] * mx + basis[2, 1] * my
                size = math.sqrt(dx * dx + dy * dy + dz * dz)
                ux, uy, uz = dx / size, dy / size, dz / size
                if grip > 0.0:
                    m = min(1.0, grip * strength) * strongest
                    if sin_lift > 0.0:  # the ring rises as it goes, or its pull would press down what lift raises
                        top = 1
                        for i in range(2, count):
                            if w[i] > w[top]:
                                top = i
                        nx, ny, nz = _normal_near(x, top, frames, row, collides, values, origin, cell)[1:]
                        rise = (size * tan_lift) - (dx * nx + dy * ny + dz * nz)
                        if rise > 0.0:
                            dx, dy, dz = dx + rise * nx, dy + rise * ny, dz + rise * nz
                    _grip(x, q, w, arcs, freedom, m * dx, m * dy, m * dz, 1.0)
                if lay > 0.0:
                    rate = lay * strength * math.sqrt(step_2) / radius
                    carried = 0.0
                    for j in range(joints):
                        carried = max(0.5 * (w[j] * ahead[j] + w[j + 1] * ahead[j + 1]), CARRY * carried)
                        if carried <= 0.0 or freedom[j] <= 0.0:
                            continue
                        gap, nx, ny, nz = _normal_near(x, j, frames, row, collides, values, origin, cell)
                        # into the skin no further than the rest of the strand can sink
                        rise = ux * nx + uy * ny + uz * nz
                        wanted = max(rise, -max(gap, 0.0) / (total - arcs[j] + 1e-12))
                        if sin_lift > 0.0:
                            wanted = max(wanted, sin_lift)
                        vx, vy, vz = ux, uy, uz
                        if wanted > rise:
                            vx, vy, vz = ux - rise * nx, uy - rise * ny, uz - rise * nz
                            size = math.sqrt(vx * vx + vy * vy + vz * vz)
                            if size < 1e-3:  # straight into the skin: no way along it to lay
                                continue
                            keep = math.sqrt(max(0.0, 1.0 - wanted * wanted)) / size
                            vx, vy, vz = keep * vx + wanted * nx, keep * vy + wanted * ny, keep * vz + wanted * nz
                        _lay(q, j, vx, vy, vz, nx, ny, nz, rate * carried)
                _limit_bends(q, first, limits)
                for j in range(first, joints):
                    size = 1.0 / math.sqrt(q[j, 0] * q[j, 0] + q[j, 1] * q[j, 1] + q[j, 2] * q[j, 2])
                    q[j, 0], q[j, 1], q[j, 2] = size * q[j, 0], size * q[j, 1], size * q[j, 2]
                rebuild_chain(x, q, lengths, first)
                if collides:
                    room = clearance * total
                    low = collide_chain(x, q, lengths, first, values, origin, cell, room, True)
                    if low < -0.02 * room and low < collide_chain(
                        old_x, old_q, lengths, first, values, origin, cell, room, False
                    ):
                        x[:], q[:] = old_x, old_q
                        continue
                stale = changed = True
        if changed:
            touched[row] = True
            write_chain(points, row, x, lengths, first, quantum)
