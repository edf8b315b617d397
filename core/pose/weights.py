"""Painting and keeping skin weights: every function gives a skin whose rows sum to 1 again.

A locked joint keeps its weight at every vertex; what is left is shared by the others in the proportions they had.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_matrix
from scipy.spatial import cKDTree

from core.errors import UserError
from core.pose.skeleton import SkinWeights
from core.record import freeze

TINY = 1e-8  # weights below it are none
ROWS = 4096  # vertices handled at once as a table of all joints
Mode = Literal["add", "replace", "scale"]


def no_skin(vertices: int) -> SkinWeights:
    """The skin of vertices that no joint moves."""
    return SkinWeights(joints=np.zeros((vertices, 0), np.int32), weights=np.zeros((vertices, 0), np.float32))


def compacted(joints: ArrayLike, weights: ArrayLike) -> SkinWeights:
    """A skin of rows (V, K): each joint once, strongest first, no more columns than are needed, rows summing to 1.

    Raises
    ------
    UserError
        When a vertex has no weight at all.
    """
    j, w = np.array(joints, np.int64), np.array(weights, np.float64)
    if not j.shape[1]:
        return no_skin(len(j))
    w = np.where(np.isfinite(w) & (w > 0.0), w, 0.0)
    order = np.argsort(j, axis=1, kind="stable")
    j, w = np.take_along_axis(j, order, 1), np.take_along_axis(w, order, 1)
    for column in range(j.shape[1] - 1, 0, -1):  # the same joint twice: its weights are added up
        same = j[:, column] == j[:, column - 1]
        w[same, column - 1] += w[same, column]
        w[same, column] = 0.0
    order = np.argsort(-w, axis=1, kind="stable")
    j, w = np.take_along_axis(j, order, 1), np.take_along_axis(w, order, 1)
    total = w.sum(axis=1, keepdims=True)
    if (total <= 0.0).any():
        raise UserError("A vertex has no weights; give it to a joint.")
    w = w / total
    wide = max(int((w > TINY).sum(axis=1).max(initial=1)), 1)
    w = w[:, :wide]
    w = np.where(w > TINY, w, 0.0) / w.sum(axis=1, keepdims=True)
    j = np.where(w > 0.0, j[:, :wide], j[:, :1])
    return SkinWeights(joints=freeze(j.astype(np.int32)), weights=freeze(w.astype(np.float32)))


def weights_of(skin: SkinWeights, joint: int) -> NDArray[np.float32]:
    """The weight (V,) float32 of one joint at every vertex."""
    return np.where(skin.joints == joint, skin.weights, np.float32(0)).sum(axis=1, dtype=np.float32)


def painted(
    skin: SkinWeights, joint: int, amounts: ArrayLike, value: float = 1.0, mode: Mode = "replace",
    locked: ArrayLike = (),
) -> SkinWeights:
    """One joint painted: its weight moves by `amounts` towards what the mode asks for, the others make room.

    Parameters
    ----------
    amounts : (V,) 0 .. 1, strength of the brush times its falloff; rows of 0 stay as they are to the bit.
    value : in "replace" the weight that is painted, in "add" what is added (or taken), in "scale" the factor.
    locked : joints that keep their weights; a locked `joint` is not painted.
    """
    share = np.clip(np.asarray(amounts, np.float64), 0.0, 1.0)
    keep = np.unique(np.asarray(locked, np.int64))
    if joint in keep:
        return skin
    joints = max(_joints(skin), joint + 1)

    def change(rows: NDArray[np.int64], table: NDArray[np.float64]) -> NDArray[np.float64]:
        was = table[:, joint]
        want = value if mode == "replace" else was + value if mode == "add" else was * value
        free = 1.0 - table[:, keep[keep < joints]].sum(axis=1)
        table[:, joint] = np.clip(was + share[rows] * (want - was), 0.0, np.maximum(free, 0.0))
        return _filled(table, np.append(keep, joint))

    return _changed(skin, np.flatnonzero(share > 0.0), joints, change)


def smoothed(
    skin: SkinWeights, edges: ArrayLike, amounts: ArrayLike, locked: ArrayLike = (), joint: int | None = None
) -> SkinWeights:
    """Weights moved by `amounts` (V,) towards the mean of the neighbours along `edges` (E, 2).

    Parameters
    ----------
    joint : the only joint that is smoothed, the others make room; None for all joints.
    """
    share = np.clip(np.asarray(amounts, np.float64), 0.0, 1.0)
    keep = np.unique(np.asarray(locked, np.int64))
    ends = np.asarray(edges, np.int64).reshape(-1, 2)
    count = len(skin.joints)
    both = np.concatenate([ends, ends[:, ::-1]])
    near = csr_matrix((np.ones(len(both)), (both[:, 0], both[:, 1])), shape=(count, count))
    near.data[:] = 1.0  # an edge that is named twice counts once
    joints = max(_joints(skin), 0 if joint is None else joint + 1)
    whole = csr_matrix(
        (skin.weights.ravel().astype(np.float64),
         (np.repeat(np.arange(count), skin.joints.shape[1]), skin.joints.ravel())), shape=(count, joints),
    )

    def change(rows: NDArray[np.int64], table: NDArray[np.float64]) -> NDArray[np.float64]:
        around = near[rows]
        number = np.asarray(around.sum(axis=1))
        mean = np.where(number > 0, (around @ whole).toarray() / np.maximum(number, 1), table)
        moved = table + share[rows, None] * (mean - table)
        if joint is not None:
            held = table.copy()
            free = 1.0 - held[:, [k for k in keep if k < joints and k != joint]].sum(axis=1)
            held[:, joint] = np.clip(moved[:, joint], 0.0, np.maximum(free, 0.0))
            return held if joint in keep else _filled(held, np.append(keep, joint), mean)
        fixed = keep[keep < joints]
        moved[:, fixed] = table[:, fixed]
        return _filled(moved, keep, table)

    return _changed(skin, np.flatnonzero(share > 0.0), joints, change)


def normalized_weights(skin: SkinWeights, joints: ArrayLike, weights: ArrayLike, locked: ArrayLike = ()) -> SkinWeights:
    """The skin with rows that need not sum to 1 brought to it; locked joints keep what they have in `weights`.

    Parameters
    ----------
    joints, weights : (V, K) as edited; `skin` stands where a row has nothing left.
    """
    j, w = np.asarray(joints, np.int64), np.array(weights, np.float64)
    w = np.where(np.isfinite(w) & (w > 0.0), w, 0.0)
    bare = w.sum(axis=1) <= TINY
    keep = np.unique(np.asarray(locked, np.int64))
    mine = np.isin(j, keep)
    held = np.where(mine, w, 0.0).sum(axis=1)
    rest = np.where(mine, 0.0, w).sum(axis=1)
    factor = np.where(rest > TINY, np.maximum(1.0 - held, 0.0) / np.maximum(rest, TINY), 1.0)
    w = np.where(mine, w, w * factor[:, None])
    wide = max(j.shape[1], skin.joints.shape[1])
    j, w = _padded(j, wide), _padded(w, wide)
    j[bare], w[bare] = _padded(skin.joints, wide)[bare], _padded(skin.weights, wide)[bare]
    return compacted(j, w)


def limited(skin: SkinWeights, influences: int, locked: ArrayLike = ()) -> SkinWeights:
    """At most `influences` joints at each vertex: the strongest stay, locked ones first of all."""
    if influences < 1:
        raise UserError("A vertex needs at least one joint; limit to 1 or more.")
    if skin.joints.shape[1] <= influences:
        return skin
    over = np.flatnonzero((skin.weights > 0.0).sum(axis=1) > influences)
    keep = np.unique(np.asarray(locked, np.int64))

    def change(rows: NDArray[np.int64], table: NDArray[np.float64]) -> NDArray[np.float64]:
        rank = table.copy()
        held = keep[keep < rank.shape[1]]
        rank[:, held] += np.where(rank[:, held] > 0.0, 2.0, 0.0)
        weakest = np.argsort(-rank, axis=1, kind="stable")[:, influences:]
        was = table.copy()
        np.put_along_axis(table, weakest, 0.0, axis=1)
        free = np.setdiff1d(np.arange(table.shape[1]), keep)
        lost = (table[:, free].sum(axis=1) <= TINY) & (was[:, free].sum(axis=1) > TINY)
        if lost.any():
            raise UserError("More joints are locked than a vertex may keep; unlock some, or allow more joints.")
        return _filled(table, keep)

    changed = _changed(skin, over, _joints(skin), change)
    return compacted(changed.joints, changed.weights)


def pruned(skin: SkinWeights, least: float, locked: ArrayLike = ()) -> SkinWeights:
    """Without weights below `least`; the strongest of the free joints of a vertex and locked ones stay."""
    small = (skin.weights > 0.0) & (skin.weights < least) & ~np.isin(skin.joints, np.asarray(locked, np.int64))
    keep = np.unique(np.asarray(locked, np.int64))

    def change(rows: NDArray[np.int64], table: NDArray[np.float64]) -> NDArray[np.float64]:
        free = table.copy()
        free[:, keep[keep < table.shape[1]]] = -1.0
        gone = (table < least) & (free >= 0.0)
        gone[np.arange(len(table)), free.argmax(axis=1)] = False
        table[gone] = 0.0
        return _filled(table, keep)

    changed = _changed(skin, np.flatnonzero(small.any(axis=1)), _joints(skin), change)
    return compacted(changed.joints, changed.weights)


def mirrored(
    skin: SkinWeights, points: ArrayLike, joint_map: ArrayLike, axis: int = 0,
    source: Literal["positive", "negative"] = "positive", reach: float | None = None,
) -> tuple[SkinWeights, NDArray[np.int64]]:
    """One side's weights on the other: each vertex takes those of the vertex nearest to its mirror image.

    Parameters
    ----------
    points : (V, 3) at rest, object space, mirrored where `axis` is 0.
    joint_map : (J,) the joint on the other side of each; itself for one in the middle.
    source : the side that is copied; vertices in the middle become symmetric.
    reach : metres beyond which a vertex has no partner, None for 1 % of the diagonal.

    Returns
    -------
    The skin, and the vertices that found no partner, which keep their weights.
    """
    p = np.asarray(points, np.float64)
    table = np.asarray(joint_map, np.int64)
    if len(table) < _joints(skin):
        raise UserError("The map of mirrored joints does not name every joint of the skin.")
    size = float(np.linalg.norm(np.ptp(p, axis=0))) if len(p) else 0.0
    reach = 0.01 * size if reach is None else reach
    middle = np.abs(p[:, axis]) <= 1e-5 * size
    sign = 1.0 if source == "positive" else -1.0
    target = np.flatnonzero(middle | (sign * p[:, axis] < 0.0))
    image = p[target].copy()
    image[:, axis] *= -1.0
    far, partner = cKDTree(p).query(image) if len(p) else (np.zeros(0), np.zeros(0, np.int64))
    found = far <= reach
    rows, partner = target[found], np.asarray(partner, np.int64)[found]
    wide = skin.joints.shape[1]
    joints, weights = _padded(skin.joints, 2 * wide), _padded(skin.weights, 2 * wide)
    joints[rows, :wide], weights[rows, :wide] = table[skin.joints[partner]], skin.weights[partner]
    here = np.flatnonzero(middle[rows])  # half of itself and half of its image
    joints[rows[here], wide:], weights[rows[here], wide:] = skin.joints[rows[here]], skin.weights[rows[here]]
    return compacted(joints, weights), target[~found]


def _joints(skin: SkinWeights) -> int:
    return int(skin.joints.max(initial=-1)) + 1


def _padded(rows: NDArray, columns: int) -> NDArray:
    out = np.pad(rows, ((0, 0), (0, columns - rows.shape[1])))
    return out.astype(np.float64 if rows.dtype.kind == "f" else np.int64)


def _filled(
    table: NDArray[np.float64], held: NDArray[np.int64], instead: NDArray[np.float64] | None = None
) -> NDArray[np.float64]:
    """Rows brought to a sum of 1 by the joints that are not `held`.

    Where those have no weight they take that of the table `instead`; where they have none there either, the last of the
    held joints takes what is missing.
    """
    is_held = np.zeros(table.shape[1], np.bool_)
    is_held[held[held < table.shape[1]]] = True
    fixed = table[:, is_held].sum(axis=1)
    free = table[:, ~is_held].sum(axis=1)
    if instead is not None:
        bare = free <= TINY
        table[np.ix_(bare, ~is_held)] = instead[np.ix_(bare, ~is_held)]
        free = table[:, ~is_held].sum(axis=1)
    factor = np.where(free > TINY, np.maximum(1.0 - fixed, 0.0) / np.maximum(free, TINY), 0.0)
    table[:, ~is_held] *= factor[:, None]
    missing = 1.0 - table.sum(axis=1)
    alone = np.abs(missing) > TINY
    if alone.any() and len(held):
        last = int(held[-1])
        table[alone, last] = np.maximum(table[alone, last] + missing[alone], 0.0)
    total = table.sum(axis=1, keepdims=True)
    return np.where(total > TINY, table / np.maximum(total, TINY), table)


def _changed(
    skin: SkinWeights, rows: NDArray[np.int64], joints: int,
    change: Callable[[NDArray[np.int64], NDArray[np.float64]], NDArray[np.float64]],
) -> SkinWeights:
    """The skin with `rows` passed, some at a time, through ``change(rows, table (n, joints)) -> table``."""
    if not len(rows) or not joints:
        return skin
    parts: list[tuple[NDArray[np.int64], SkinWeights]] = []
    for start in range(0, len(rows), ROWS):
        some = rows[start : start + ROWS]
        table = np.zeros((len(some), joints))
        np.add.at(table, (np.arange(len(some))[:, None], skin.joints[some]), skin.weights[some].astype(np.float64))
        after = change(some, table)
        wide = max(int((after > TINY).sum(axis=1).max()), 1)
        order = np.argsort(-after, axis=1, kind="stable")[:, :wide]
        parts.append((some, compacted(order, np.take_along_axis(after, order, 1))))
    wide = max([skin.joints.shape[1], *(part.joints.shape[1] for _, part in parts)])
    out_joints = np.pad(skin.joints, ((0, 0), (0, wide - skin.joints.shape[1])))
    out_weights = np.pad(skin.weights, ((0, 0), (0, wide - skin.weights.shape[1])))
    for some, part in parts:
        pad = ((0, 0), (0, wide - part.joints.shape[1]))
        out_joints[some], out_weights[some] = np.pad(part.joints, pad), np.pad(part.weights, pad)
    return SkinWeights(joints=freeze(out_joints), weights=freeze(out_weights))
