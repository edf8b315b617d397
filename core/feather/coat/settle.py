"""Settling feathers one after another, from the lowest up, until none passes through what lies below it.

Only feathers that exact tests found crossing are touched. Each is lifted a little (and bent back by as much), rolled,
and shortened as the last resort, the smallest change first; the lift that clears is then found by halving, so that it
follows a smooth motion smoothly. A feather may not lie on the root of one that has still to come to rest above it.
(Rotating feathers about their roots until they are clear: US7098911, expired; the order: Liu et al. 2015.)
"""

from __future__ import annotations

import numpy as np
from numba import njit, types

from core.feather.coat.crossing import (
    I32_1D,
    boxes_apart,
    load_cell,
    strip_boxes,
    triangles_meet,
    vane_meets_skin,
    vanes_meet,
)
from core.feather.coat.posing import BEND, F32_2D, F32_3D, F32_4D, LENGTH, LIFT, ROLL, pose_vane
from core.mesh.bvh import I32_2D
from core.mesh.bvh_kernels import STACK_SIZE

LIFTS = np.radians([0.0, 1.0, 2.0, 3.5, 5.0, 7.0, 9.5, 12.5, 16.0])
ROLLS = np.radians([0.0, 4.0, -4.0])
LENGTHS = np.array([1.0, 0.87, 0.75, 0.64, 0.54, 0.45, 0.36, 0.28, 0.2, 0.1, 0.04, 0.01, 1e-3])
BENT_BACK = 1.2  # of an added lift, taken back along the feather so that its tip does not stand out
HALVINGS = 5


@njit(cache=True, nogil=True)
def _meets_root(vane, boxes, other, other_boxes, s, t):  # type: ignore[no-untyped-def]
    """True when a vane passes through the first strip of another."""
    rows = vane.shape[0]
    if boxes_apart(boxes[rows - 1], other_boxes[0]):
        return False
    for i in range(rows - 1):
        if boxes_apart(boxes[i], other_boxes[0]):
            continue
        for p in range(2 * (vane.shape[1] - 1)):
            load_cell(vane, i, p >> 1, p & 1, s)
            for q in range(2 * (other.shape[1] - 1)):
                load_cell(other, 0, q >> 1, q & 1, t)
                if triangles_meet(s, t):
                    return True
    return False


@njit(cache=True, nogil=True)
def _blocked(  # type: ignore[no-untyped-def]
    vane, own, vanes, boxes, below, above, last, nodes, children, corners, stack, s, t
):
    """What stops a feather with this vane: the place in `below` (or, beyond those, in `above`, or -2 for the skin);
    -1 when nothing does. `last`: what stopped it before, looked at first."""
    if last == -2:
        if vane_meets_skin(vane, own, nodes, children, corners, stack, s, t):
            return -2
    elif 0 <= last < len(below) and vanes_meet(vane, vanes[below[last]], own, boxes[below[last]], s, t):
        return last
    for k in range(len(below)):
        if k != last and vanes_meet(vane, vanes[below[k]], own, boxes[below[k]], s, t):
            return k
    for k in range(len(above)):
        if _meets_root(vane, own, vanes[above[k]], boxes[above[k]], s, t):
            return len(below) + k
    if last != -2 and vane_meets_skin(vane, own, nodes, children, corners, stack, s, t):
        return -2
    return -1


@njit(cache=True, inline="always")
def _changed(base, lift, roll, length, bent_back, out):  # type: ignore[no-untyped-def]
    out[:] = base
    out[LENGTH] = base[LENGTH] * length
    out[LIFT] = base[LIFT] + lift
    out[ROLL] = base[ROLL] + roll
    out[BEND] = base[BEND] + bent_back * lift / max(out[LENGTH], 1e-30)


@njit(
    types.void(
        I32_1D, types.Array(types.float64, 1, "C", readonly=True), I32_1D, I32_1D,
        F32_4D, F32_2D, F32_3D, F32_2D, I32_2D, F32_2D, types.boolean, types.float64,
        types.Array(types.float64, 1, "C", readonly=True), types.Array(types.float64, 1, "C", readonly=True),
        types.boolean[::1], types.boolean[::1], types.float64[:, ::1], types.float32[:, :, :, ::1],
        types.float32[:, :, ::1],
    ),
    cache=True, nogil=True,
)
def settle_rows(  # type: ignore[no-untyped-def]
    order, rank, start, other, own_vanes, roots, frames, nodes, children, corners, may_roll, bent_back, most,
    shortest, suspect, moved, poses, vanes, boxes
):
    """Settle the rows of `order` (n,) int32, lowest first.

    bent_back : share of an added lift that is taken back by bending the feather down; 0 keeps shapes as they are.
    may_roll : at rest; in a frame of an animation a roll would be seen as a jump.
    most : (N,) float64, radians a feather may be lifted by. shortest : (N,) float64, the least factor on its length for
        the sake of other feathers; to stay out of the skin it shrinks as far as it must.
    suspect : (N,) bool, found crossing (or to be looked at); moved : (N,) bool, written where a pose was changed.
    poses, vanes, boxes : as they are, written where they change.
    """
    s, t = np.empty((3, 3)), np.empty((3, 3))
    stack = np.empty(STACK_SIZE, np.int32)
    base = np.empty(poses.shape[1])
    trial = np.empty(poses.shape[1])
    best = np.empty(poses.shape[1])
    vane = np.empty(vanes.shape[1:], np.float32)
    own = np.empty(boxes.shape[1:], np.float32)
    for turn in range(len(order)):
        i = order[turn]
        count = start[i + 1] - start[i]
        below = np.empty(count, np.int32)
        above = np.empty(count, np.int32)
        n_below = n_above = 0
        look = suspect[i]
        for k in range(start[i], start[i + 1]):
            j = other[k]
            if rank[j] > rank[i] or (rank[j] == rank[i] and j > i):
                below[n_below] = j
                n_below += 1
                look = look or moved[j]
            else:
                above[n_above] = j
                n_above += 1
        if not look:
            continue
        lower, upper = below[:n_below], above[:n_above]
        last = _blocked(
            vanes[i], boxes[i], vanes, boxes, lower, upper, -3, nodes, children, corners, stack, s, t
        )
        if last == -1:
            continue
        base[:] = poses[i]
        found = in_skin = False
        for a in range(len(LENGTHS)):
            longer = LENGTHS[max(a - 1, 0)]
            shorter = LENGTHS[a]
            if longer > shortest[i]:
                shorter = max(shorter, shortest[i])
            elif a > 0:
                if not in_skin:
                    break
                lower, upper = below[:0], above[:0]  # only the skin counts now
                last = -3
            for b in range(len(LIFTS)):
                if b > 0 and LIFTS[b - 1] >= most[i]:
                    break
                lift = min(LIFTS[b], most[i])
                for c in range(len(ROLLS) if may_roll and b % 2 == 0 else 1):
                    _changed(base, lift, ROLLS[c], shorter, bent_back, trial)
                    pose_vane(own_vanes[i], trial, roots[i], frames[i], vane)
                    strip_boxes(vane, own)
                    last = _blocked(
                        vane, own, vanes, boxes, lower, upper, last, nodes, children, corners, stack, s, t
                    )
                    if last != -1:
                        continue
                    found = True
                    best[:] = trial
                    # the least that clears follows a smooth motion smoothly: of the lift, or of what is cut off
                    if c == 0 and (a > 0 or b > 0):
                        low, high = 0.0, 1.0
                        hit = -3
                        for _ in range(HALVINGS):
                            middle = 0.5 * (low + high)
                            if b > 0:
                                _changed(
                                    base, LIFTS[b - 1] + middle * (lift - LIFTS[b - 1]), 0.0, shorter, bent_back, trial
                                )
                            else:
                                _changed(base, lift, 0.0, longer + middle * (shorter - longer), bent_back, trial)
                            pose_vane(own_vanes[i], trial, roots[i], frames[i], vane)
                            strip_boxes(vane, own)
                            hit = _blocked(
                                vane, own, vanes, boxes, lower, upper, hit, nodes, children, corners, stack, s, t
                            )
                            if hit == -1:
                                high = middle
                                best[:] = trial
                            else:
                                low = middle
                    break
                if found:
                    break
            if found:
                break
            _changed(base, 0.0, 0.0, shorter, bent_back, trial)
            pose_vane(own_vanes[i], trial, roots[i], frames[i], vane)
            strip_boxes(vane, own)
            in_skin = vane_meets_skin(vane, own, nodes, children, corners, stack, s, t)
        if not found:
            # where it would cross others it stays as it is, unless it is in the skin: then it gives way to that
            best[:] = trial
            if not in_skin and not vane_meets_skin(vanes[i], boxes[i], nodes, children, corners, stack, s, t):
                continue
        poses[i] = best
        pose_vane(own_vanes[i], best, roots[i], frames[i], vanes[i])
        strip_boxes(vanes[i], boxes[i])
        moved[i] = True


@njit(
    types.void(
        F32_4D, F32_2D, F32_3D, F32_2D, I32_2D, F32_2D, types.float64, I32_1D, types.int64, types.int64,
        types.float64[:, ::1],
    ),
    cache=True, nogil=True,
)
def rise_rows(own_vanes, roots, frames, nodes, children, corners, bent_back, rows, start, stop, poses):  # type: ignore[no-untyped-def]
    """Lift each of `rows` by the least that takes it out of the skin, shortened where no lift does."""
    s, t = np.empty((3, 3)), np.empty((3, 3))
    stack = np.empty(STACK_SIZE, np.int32)
    trial, best = np.empty(poses.shape[1]), np.empty(poses.shape[1])
    vane = np.empty(own_vanes.shape[1:], np.float32)
    own = np.empty((own_vanes.shape[1], 6), np.float32)
    for k in range(start, stop):
        i = rows[k]
        done = False
        for a in range(len(LENGTHS)):
            for b in range(len(LIFTS)):
                low, high = (LIFTS[b - 1] if b else 0.0), LIFTS[b]
                for halving in range(HALVINGS + 1):
                    lift = high if halving == 0 else 0.5 * (low + high)
                    _changed(poses[i], lift, 0.0, LENGTHS[a], bent_back, trial)
                    pose_vane(own_vanes[i], trial, roots[i], frames[i], vane)
                    strip_boxes(vane, own)
                    if not vane_meets_skin(vane, own, nodes, children, corners, stack, s, t):
                        done = True
                        high = lift
                        best[:] = trial
                        if b == 0:
                            break
                    elif halving == 0:
                        break
                    else:
                        low = lift
                if done:
                    break
            if done:
                break
        poses[i] = best if done else trial
