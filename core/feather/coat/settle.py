"""Settling feathers one after another, from the lowest up, until none passes through what lies below it.

Only feathers that exact tests found crossing are touched. Each is lifted a little (and bent back by as much), rolled,
and shortened as the last resort, the smallest change first. In a frame of an animation it is lifted by GIVE at most, so
that it is not seen to jump, whatever comes to block it; out of the skin it is lifted as far as it must. A feather may
not lie on the root of one that has still to come to rest above it.
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
GIVE = float(np.radians(1.35))  # moves no point of a vane by more than 1 % of its length while BENT_BACK holds
GIVE_STEPS = 4
SKIN_LIFT = float(np.radians(2.5))  # a step out of the skin, as many as SKIN_STEPS; then as many that shrink
SKIN_STEPS = 12
GONE = 1e-6  # of its length: what is left of a feather whose root lies in a fold of the skin


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


@njit(cache=True, nogil=True)
def _out_of_skin(  # type: ignore[no-untyped-def]
    way, base, own_vane, root, frame, nodes, children, corners, bent_back, trial, vane, own, stack, s, t
):
    """Pose a feather `way` steps along its way out of the skin, first lifted, then shrunk; True when it is clear."""
    shrunk = max(1.0 - max(way - SKIN_STEPS, 0.0) / SKIN_STEPS, GONE)
    _changed(base, min(way, SKIN_STEPS) * SKIN_LIFT, 0.0, shrunk, bent_back, trial)
    pose_vane(own_vane, trial, root, frame, vane)
    strip_boxes(vane, own)
    return not vane_meets_skin(vane, own, nodes, children, corners, stack, s, t)


@njit(cache=True, nogil=True)
def _follow(  # type: ignore[no-untyped-def]
    base, own_vane, root, frame, nodes, children, corners, bent_back, vanes, boxes, lower, upper, trial, vane, own,
    stack, s, t,
):
    """Pose a blocked feather for a frame of an animation, into trial, vane and own: lifted by the least up to GIVE
    that clears it, left as it is where none does; then out of the skin by the least lift, or length, that does it."""
    lift, last = 0.0, -3
    for step in range(1, GIVE_STEPS + HALVINGS + 1):
        if step <= GIVE_STEPS:
            tried = GIVE * step / GIVE_STEPS
        elif lift == 0.0:
            break
        else:
            tried = lift - GIVE / GIVE_STEPS * 0.5 ** (step - GIVE_STEPS)
        if step <= GIVE_STEPS and lift > 0.0:
            continue
        _changed(base, tried, 0.0, 1.0, bent_back, trial)
        pose_vane(own_vane, trial, root, frame, vane)
        strip_boxes(vane, own)
        last = _blocked(vane, own, vanes, boxes, lower, upper, last, nodes, children, corners, stack, s, t)
        if last == -1:
            lift = tried
    _changed(base, lift, 0.0, 1.0, bent_back, trial)
    base[:] = trial
    low = high = 0.0
    while not _out_of_skin(
        high, base, own_vane, root, frame, nodes, children, corners, bent_back, trial, vane, own, stack, s, t
    ):
        if high == 2 * SKIN_STEPS:
            return
        low, high = high, high + 1.0
    if high == 0.0:
        return
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if _out_of_skin(
            middle, base, own_vane, root, frame, nodes, children, corners, bent_back, trial, vane, own, stack, s, t
        ):
            high = middle
        else:
            low = middle
    _out_of_skin(high, base, own_vane, root, frame, nodes, children, corners, bent_back, trial, vane, own, stack, s, t)


@njit(
    types.void(
        I32_1D, types.Array(types.float64, 1, "C", readonly=True), I32_1D, I32_1D,
        F32_4D, F32_2D, F32_3D, F32_2D, I32_2D, F32_2D, types.boolean, types.float64,
        types.boolean[::1], types.boolean[::1], types.float64[:, ::1], types.float32[:, :, :, ::1],
        types.float32[:, :, ::1],
    ),
    cache=True, nogil=True,
)
def settle_rows(  # type: ignore[no-untyped-def]
    order, rank, start, other, own_vanes, roots, frames, nodes, children, corners, at_rest, bent_back, suspect,
    moved, poses, vanes, boxes
):
    """Settle the rows of `order` (n,) int32, lowest first.

    bent_back : share of an added lift that is taken back by bending the feather down; 0 keeps shapes as they are.
    at_rest : with as much change as it takes; False for a frame of an animation, which lifts by no more than GIVE.
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
        if not at_rest:
            _follow(
                base, own_vanes[i], roots[i], frames[i], nodes, children, corners, bent_back, vanes, boxes, lower,
                upper, trial, vane, own, stack, s, t,
            )
            poses[i] = trial
            vanes[i] = vane
            boxes[i] = own
            moved[i] = True
            continue
        found = in_skin = False
        for a in range(len(LENGTHS)):
            longer, shorter = LENGTHS[max(a - 1, 0)], LENGTHS[a]
            for b in range(len(LIFTS)):
                lift = LIFTS[b]
                for c in range(len(ROLLS) if b % 2 == 0 else 1):
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
                    # the least that clears, of the lift or of what is cut off: keys are moved smoothly, too
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
