"""Layering a coat: a smooth base, exact tests, settling what crosses; the static part is kept apart from a frame's.

At rest feathers are raised out of the skin together with their neighbours, settled in the growth order, and what that
added to each pose is kept by feather. A frame of an animation begins from the rest's additions, never from another
frame's, and only lifts what newly crosses, by so little that no feather is seen to jump.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.feather.coat.crossing import (
    crossing_pairs,
    neighbour_rows,
    skin_crossings,
    touching_boxes,
    vane_boxes,
)
from core.feather.coat.ground import smoothed
from core.feather.coat.posing import BEND, LENGTH, LIFT, pose_vanes
from core.feather.coat.settle import BENT_BACK, rise_rows, settle_rows
from core.mesh.bvh import Bvh
from core.workers import Workers

MARGIN = 0.1  # of its length, by which a feather's box is widened: what it may come to touch while it settles


class Feathers(NamedTuple):
    """N feathers as layering sees them.

    own : (N, R, C, 3) float32, vanes in their own frames at length 1. roots : (N, 3) float32. frames : (N, 3, 3).
    rank : (N,) float64, the lower lies over the higher.
    """

    own: NDArray[np.float32]
    roots: NDArray[np.float32]
    frames: NDArray[np.float32]
    rank: NDArray[np.float64]


class Layered(NamedTuple):
    """A coat that has settled: poses (N, 6) float64, vanes (N, R, C, 3), boxes (N, R, 6), and the pairs looked at."""

    poses: NDArray[np.float64]
    vanes: NDArray[np.float32]
    boxes: NDArray[np.float32]
    first: NDArray[np.int32]
    second: NDArray[np.int32]


class Crossings(NamedTuple):
    """What still passes through what: rows of feathers.

    first, second : (P,) int32, pairs that cross, the worst first. depth : (P,) int32, how many pairs of strips of the
    two meet. pairs : how many pairs of feathers were close enough to test. skin : (K,) int32, feathers in the skin.
    """

    first: NDArray[np.int32]
    second: NDArray[np.int32]
    depth: NDArray[np.int32]
    pairs: int
    skin: NDArray[np.int32]


def layer(
    feathers: Feathers, base: NDArray[np.float64], near: NDArray[np.int32], bvh: Bvh, workers: Workers,
    bent_back: float = BENT_BACK, at_rest: bool = True,
) -> Layered:
    """Settle a whole coat from its base poses (N, 6).

    near : (N, K) int32, neighbours on the skin, see ``ground``. bvh : the skin in the same pose.
    bent_back : share of an added lift that is bent back; 0 where shapes are given, as those of prototypes are.
    at_rest : with as much change as it takes; False for a frame of an animation, see ``settle_rows``.
    """
    poses = raised(feathers, base, near, bvh, workers, bent_back) if at_rest else base.copy()
    vanes = pose_vanes(feathers.own, poses, feathers.roots, feathers.frames, ranges=workers.ranges)
    boxes = vane_boxes(vanes, workers.ranges)
    first, second = touching_boxes(_widened(boxes, poses))
    laid = Layered(poses, vanes, boxes, first, second)
    suspects = np.zeros(len(poses), np.bool_)
    meet = crossing_pairs(vanes, boxes, first, second, workers.ranges)
    suspects[first[meet]] = True
    suspects[second[meet]] = True
    suspects |= skin_crossings(vanes, boxes, bvh, ranges=workers.ranges)
    _settle(feathers, laid, suspects, bvh, bent_back, at_rest)
    return laid


def layer_again(
    feathers: Feathers, before: Layered, base: NDArray[np.float64], changed: NDArray[np.int32], bvh: Bvh,
    workers: Workers,
) -> Layered:
    """The coat after the base poses (or frames) of the rows `changed` (n,) int32 became others; the rest stay.

    Feathers over those that changed follow where they must.
    """
    poses, vanes, boxes = before.poses.copy(), before.vanes.copy(), before.boxes.copy()
    poses[changed] = base[changed]
    pose_vanes(feathers.own, poses, feathers.roots, feathers.frames, vanes, changed, workers.ranges)
    boxes[changed] = vane_boxes(vanes[changed])
    mine = np.zeros(len(poses), np.bool_)
    mine[changed] = True
    kept = ~(mine[before.first] | mine[before.second])
    fresh_first, fresh_second = _pairs_of(changed, mine, _widened(boxes, poses))
    first = np.concatenate([before.first[kept], fresh_first])
    second = np.concatenate([before.second[kept], fresh_second])
    laid = Layered(poses, vanes, boxes, first, second)
    suspects = np.zeros(len(poses), np.bool_)
    meet = crossing_pairs(vanes, boxes, fresh_first, fresh_second, workers.ranges)
    suspects[fresh_first[meet]] = True
    suspects[fresh_second[meet]] = True
    suspects[changed] |= skin_crossings(vanes, boxes, bvh, changed, workers.ranges)
    _settle(feathers, laid, suspects, bvh, BENT_BACK)
    return laid


def layer_around(
    feathers: Feathers, laid: Layered, pinned: NDArray[np.int32], bvh: Bvh, workers: Workers, at_rest: bool = True,
) -> Layered:
    """The coat after the vanes of the rows `pinned` (n,) int32 were put elsewhere by hand: others make way.

    at_rest : with as much change as it takes; False for a frame of an animation, see ``settle_rows``.
    """
    rank = feathers.rank.copy()
    rank[pinned] = np.inf  # they lie where they lie, all others over them
    boxes = laid.boxes.copy()
    boxes[pinned] = vane_boxes(laid.vanes[pinned])
    vanes, poses = laid.vanes.copy(), laid.poses.copy()
    mine = np.zeros(len(poses), np.bool_)
    mine[pinned] = True
    kept = ~(mine[laid.first] | mine[laid.second])
    first, second = _pairs_of(pinned, mine, _widened(boxes, poses))
    suspects = np.zeros(len(poses), np.bool_)
    meet = crossing_pairs(vanes, boxes, first, second, workers.ranges)
    suspects[first[meet]] = True
    suspects[second[meet]] = True
    suspects[pinned] = False
    moved = laid._replace(
        poses=poses, vanes=vanes, boxes=boxes, first=np.concatenate([laid.first[kept], first]),
        second=np.concatenate([laid.second[kept], second]),
    )
    _settle(feathers._replace(rank=rank), moved, suspects, bvh, BENT_BACK, at_rest)
    return moved


def raised(
    feathers: Feathers, base: NDArray[np.float64], near: NDArray[np.int32], bvh: Bvh, workers: Workers,
    bent_back: float = BENT_BACK,
) -> NDArray[np.float64]:
    """Poses out of the skin: each by the least lift that does it, and their neighbours smoothly with them."""
    vanes = pose_vanes(feathers.own, base, feathers.roots, feathers.frames, ranges=workers.ranges)
    inside = skin_crossings(vanes, vane_boxes(vanes, workers.ranges), bvh, ranges=workers.ranges)
    rows = np.flatnonzero(inside).astype(np.int32)
    poses = base.copy()
    if not len(rows):
        return poses
    workers.ranges(
        len(rows),
        lambda start, stop: rise_rows(
            feathers.own, feathers.roots, feathers.frames, bvh.boxes, bvh.children, bvh.corners, bent_back,
            rows, start, stop, poses,
        ),
        16,
    )
    added = poses[:, LIFT] - base[:, LIFT]
    around = smoothed(added[:, None], near, 3, workers.ranges)[:, 0]
    more = np.maximum(around - added, 0.0)
    poses[:, LIFT] += more
    poses[:, BEND] += bent_back * more / np.maximum(poses[:, LENGTH], 1e-30)
    return poses


def crossings(laid: Layered, bvh: Bvh, workers: Workers) -> Crossings:
    """Exactly what still crosses in a coat, triangle against triangle; pairs are found anew."""
    first, second = touching_boxes(np.ascontiguousarray(laid.boxes[:, -1]))
    meet = crossing_pairs(laid.vanes, laid.boxes, first, second, workers.ranges)
    skin = np.flatnonzero(skin_crossings(laid.vanes, laid.boxes, bvh, ranges=workers.ranges)).astype(np.int32)
    a, b = first[meet], second[meet]
    depth = _depths(laid, a, b)
    order = np.argsort(-depth, kind="stable")
    return Crossings(a[order], b[order], depth[order], len(first), skin)


def _depths(laid: Layered, first: NDArray[np.int32], second: NDArray[np.int32]) -> NDArray[np.int32]:
    """How many pairs of strips of each pair of vanes meet, (P,) int32: leftovers are few, so strips are cut out."""
    rows = laid.vanes.shape[1]
    depth = np.zeros(len(first), np.int32)
    for p, (i, j) in enumerate(zip(first, second, strict=True)):
        strips = np.concatenate([_strips(laid.vanes[i]), _strips(laid.vanes[j])])
        a, b = np.divmod(np.arange((rows - 1) ** 2, dtype=np.int32), np.int32(rows - 1))
        depth[p] = crossing_pairs(strips, vane_boxes(strips), a, b + np.int32(rows - 1)).sum()
    return depth


def _strips(vane: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.ascontiguousarray(np.stack([vane[:-1], vane[1:]], axis=1))


def _widened(boxes: NDArray[np.float32], poses: NDArray[np.float64]) -> NDArray[np.float32]:
    whole = boxes[:, -1].copy()
    margin = (MARGIN * poses[:, LENGTH]).astype(np.float32)[:, None]
    whole[:, :3] -= margin
    whole[:, 3:] += margin
    return np.ascontiguousarray(whole)


def _pairs_of(
    changed: NDArray[np.int32], mine: NDArray[np.bool_], boxes: NDArray[np.float32]
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Pairs that one of the rows `changed` is in, of boxes (N, 6)."""
    low, high = boxes[changed, :3].min(axis=0, initial=np.inf), boxes[changed, 3:].max(axis=0, initial=-np.inf)
    around = np.flatnonzero((boxes[:, 3:] >= low).all(axis=1) & (boxes[:, :3] <= high).all(axis=1)).astype(np.int32)
    a, b = touching_boxes(np.ascontiguousarray(boxes[around]))
    a, b = around[a], around[b]
    wanted = mine[a] | mine[b]
    return a[wanted], b[wanted]


def _settle(
    feathers: Feathers, laid: Layered, suspects: NDArray[np.bool_], bvh: Bvh, bent_back: float,
    at_rest: bool = True,
) -> None:
    if not suspects.any():
        return
    rows = neighbour_rows(len(suspects), laid.first, laid.second)
    order = np.ascontiguousarray(np.lexsort((np.arange(len(suspects)), feathers.rank))[::-1], np.int32)
    moved = np.zeros(len(suspects), np.bool_)
    settle_rows(
        order, feathers.rank, rows.start, rows.other, feathers.own, feathers.roots, feathers.frames, bvh.boxes,
        bvh.children, bvh.corners, at_rest, bent_back, suspects, moved, laid.poses, laid.vanes, laid.boxes,
    )
