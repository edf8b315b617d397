"""Feathers as another program takes them: rigid instances of a few hundred shapes, or every one its own mesh.

A shape is quantised in what a feather is bent, cupped and twisted by over its length, and in its outline; the error of
that is measured on the vanes. As neighbours lie close, the quantised feathers are settled once more, turned and scaled
but not reshaped, and what crosses is counted on exactly what is written. Feathers that a hand has bent are no shape of
any other: each is a prototype of its own, exactly as it lies.
"""

from __future__ import annotations

from typing import NamedTuple
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from core.feather.coat.crossing import vane_boxes
from core.feather.coat.layering import Crossings, Feathers, Layered, crossings, layer
from core.feather.coat.posing import BEND, CUP, LENGTH, LIFT, POSE, ROLL, TWIST, pose_vanes
from core.feather.coat.wing import WING_IDS
from core.feather.coat.winged import Laid
from core.workers import Workers

STEPS = np.array([0.08, 0.12, 0.10])  # radians over the length of a feather, of bend, cup and twist
BY_HAND = 1 << 30  # first of the bins of a feather that is bent by hand; then its id and what its shape comes to
BENT = 1e-3  # of its length: a vane that lies farther from where its pose has it was bent by hand
OUTLINE_STEP = 0.03  # of what an outline reaches to either side, and its tip out of the middle, in lengths


class Instances(NamedTuple):
    """N feathers of one frame as rigid copies of prototypes.

    ids : (N,) int32. keys : (N, 7) int32, the bins of bend, cup, twist and outline, naming a prototype.
    positions : (N, 3) float32. turns : (N, 4) float32, quaternions w, x, y, z. scales : (N,) float32, metres.
    prototypes : bins -> its vane (``BY_HAND``, id, hash: of one bent by hand), (R, C, 3) float32 at length 1.
    error : the largest distance of a vane from what it stands for, over its length. left : what crosses, on these;
    coarse : the same for a reader that only knows turns of 16 bits.
    vanes : (N, R, C, 3) float32, what another program makes of it.
    """

    ids: NDArray[np.int32]
    keys: NDArray[np.int32]
    positions: NDArray[np.float32]
    turns: NDArray[np.float32]
    scales: NDArray[np.float32]
    prototypes: dict[tuple[int, ...], NDArray[np.float32]]
    error: float
    left: Crossings
    coarse: Crossings
    vanes: NDArray[np.float32]


def shown_rows(laid: Laid) -> NDArray[np.int32]:
    """Rows of the feathers of the skin that are written."""
    return np.flatnonzero(laid.shown & (laid.ids < WING_IDS)).astype(np.int32)


def wing_rows(laid: Laid) -> NDArray[np.int32]:
    """Rows of the feathers of wings, which are written as they are and never settled again."""
    return np.flatnonzero(laid.ids >= WING_IDS).astype(np.int32)


def crossing_wings(laid: Laid, vanes: NDArray[np.float32], workers: Workers) -> tuple[int, int]:
    """How many pairs cross of a feather of a wing and one of the skin (`vanes`, as written), and of two of wings."""
    rows = wing_rows(laid)
    both = np.concatenate([vanes, laid.layered.vanes[rows]])
    boxes, none = vane_boxes(both, workers.ranges), np.zeros(0, np.int32)
    found = crossings(Layered(np.zeros((len(both), POSE)), both, boxes, none, none), laid.skin.bvh, workers)
    first, second = found.first >= len(vanes), found.second >= len(vanes)
    return int((first != second).sum()), int((first & second).sum())


def left_crossing(laid: Laid, workers: Workers) -> Crossings:
    """What crosses among the feathers shown, as meshes of their own; rows are those of the feathers shown."""
    rows = shown_rows(laid)
    kept = Layered(
        laid.layered.poses[rows], laid.layered.vanes[rows], laid.layered.boxes[rows], laid.layered.first,
        laid.layered.second,
    )
    return crossings(kept, laid.skin.bvh, workers)


class _Rigid(NamedTuple):
    """Feathers as rigid copies before they settle: bins (B, 7) of shapes, `which` of them each is, poses (N, 6).

    vanes : (B, R, C, 3) float32, of the shapes. feathers : those of the copies. by_hand : (N,) bool, bent ones.
    """

    bins: NDArray[np.int32]
    which: NDArray[np.int64]
    vanes: NDArray[np.float32]
    feathers: Feathers
    poses: NDArray[np.float64]
    by_hand: NDArray[np.bool_]


def added_at_rest(rest: Laid, workers: Workers) -> NDArray[np.float64]:
    """What settling the copies at rest adds to lift and roll and makes of length, (N, 3), by rows of the bed.

    Every frame begins from it, so that a frame need only lift what newly crosses.
    """
    rows = shown_rows(rest)
    rigid = _rigid(rest, rows, workers)
    settled = _settled(rigid, rigid.poses, rest, workers, True).poses
    added = np.tile([0.0, 0.0, 1.0], (len(rest.ids), 1))
    added[rows, :2] = settled[:, [LIFT, ROLL]] - rigid.poses[:, [LIFT, ROLL]]
    added[rows, 2] = settled[:, LENGTH] / rigid.poses[:, LENGTH]
    return added


def instances(laid: Laid, workers: Workers, added: NDArray[np.float64] | None = None) -> Instances:
    """The feathers shown as instances of quantised shapes.

    added : for a frame of an animation, ``added_at_rest``: feathers are then only lifted beyond it, and by little, so
        that nothing jumps from frame to frame. None where the coat is written once.
    """
    rows = shown_rows(laid)
    own = laid.feathers.own[rows]
    rigid = _rigid(laid, rows, workers)
    bins, which, vanes = rigid.bins, rigid.which, rigid.vanes
    procedural = np.flatnonzero(~rigid.by_hand)
    error = _error(own[procedural], _turning(laid, rows)[procedural], vanes, which[procedural], workers)
    poses = rigid.poses.copy()
    if added is not None:
        poses[:, [LIFT, ROLL]] += added[rows, :2]
        poses[:, LENGTH] *= added[rows, 2]
    settled = _settled(rigid, poses, laid, workers, added is None)
    settled.poses[rigid.by_hand] = rigid.poses[rigid.by_hand]  # these lie where the hand has put them
    feathers = rigid.feathers
    turns = quaternions(feathers.frames, settled.poses).astype(np.float32)
    scales = settled.poses[:, LENGTH].astype(np.float32)
    written = _instanced(feathers.own, feathers.roots, turns, scales)
    rounded = _instanced(feathers.own, feathers.roots, turns.astype(np.float16), scales)
    left, coarse = (
        crossings(settled._replace(vanes=v, boxes=vane_boxes(v, workers.ranges)), laid.skin.bvh, workers)
        for v in (written, rounded)
    )
    return Instances(
        laid.ids[rows], bins[which], feathers.roots, turns, scales,
        {tuple(int(v) for v in bins[k]): vanes[k] for k in np.unique(which)}, error, left, coarse, written,
    )


def _turning(laid: Laid, rows: NDArray[np.int32]) -> NDArray[np.float64]:
    """Radians (N, 3) that the feathers of `rows` are bent, cupped and twisted by over their length."""
    poses = laid.layered.poses[rows]
    return np.asarray(poses[:, [BEND, CUP, TWIST]] * poses[:, LENGTH, None])


def _rigid(laid: Laid, rows: NDArray[np.int32], workers: Workers) -> _Rigid:
    own, poses = laid.feathers.own[rows], laid.layered.poses[rows]
    middle = own.shape[2] // 2
    outline = np.column_stack([
        own[..., 0].min(axis=(1, 2), initial=0.0), own[..., 0].max(axis=(1, 2), initial=0.0), own[:, -1, middle, 0],
        own[:, -1, middle, 2],
    ])
    keys = np.column_stack([
        np.round(_turning(laid, rows) / STEPS), np.round(outline / OUTLINE_STEP)]).astype(np.int32)
    bins, first, which = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    which = which.reshape(-1)
    shapes = np.zeros((len(bins), POSE))
    shapes[:, [BEND, CUP, TWIST]] = bins[:, :3] * STEPS
    shapes[:, LENGTH] = 1.0
    outlines = np.ascontiguousarray(own[first])
    upright = np.broadcast_to(np.eye(3, dtype=np.float32), (len(bins), 3, 3)).copy()
    vanes = pose_vanes(outlines, shapes, np.zeros((len(bins), 3), np.float32), upright, ranges=workers.ranges)
    rigid = np.zeros((len(rows), POSE))
    rigid[:, [LIFT, ROLL, LENGTH]] = poses[:, [LIFT, ROLL, LENGTH]]
    by_hand = _bent(laid, rows, workers)
    if by_hand.any():
        hand = np.flatnonzero(by_hand)
        rigid[hand, LIFT] = rigid[hand, ROLL] = 0.0
        lying = laid.layered.vanes[rows[hand]].astype(np.float64) - laid.feathers.roots[rows[hand], None, None]
        shaped = np.einsum("nrcx,nyx->nrcy", lying, laid.feathers.frames[rows[hand]].astype(np.float64))
        shaped = (shaped / rigid[hand, LENGTH][:, None, None, None]).astype(np.float32)
        which = which.copy()
        which[hand] = len(bins) + np.arange(len(hand))
        named = [[BY_HAND, laid.ids[rows[k]], crc32(shape.tobytes()) >> 1, 0, 0, 0, 0]
                 for k, shape in zip(hand, shaped, strict=True)]
        bins = np.concatenate([bins, np.array(named, np.int32)])
        vanes = np.concatenate([vanes, shaped])
    feathers = Feathers(
        np.ascontiguousarray(vanes[which]), np.ascontiguousarray(laid.feathers.roots[rows]),
        np.ascontiguousarray(laid.feathers.frames[rows]), np.ascontiguousarray(laid.feathers.rank[rows]),
    )
    return _Rigid(bins, which, vanes, feathers, rigid, by_hand)


def _bent(laid: Laid, rows: NDArray[np.int32], workers: Workers) -> NDArray[np.bool_]:
    """Which feathers (N,) do not lie as their poses have them: those whose shafts a hand has bent."""
    f = laid.feathers
    posed = pose_vanes(
        np.ascontiguousarray(f.own[rows]), laid.layered.poses[rows], np.ascontiguousarray(f.roots[rows]),
        np.ascontiguousarray(f.frames[rows]), ranges=workers.ranges)
    apart = np.linalg.norm(posed - laid.layered.vanes[rows], axis=-1).max(axis=(1, 2), initial=0.0)
    return np.asarray(apart > BENT * laid.layered.poses[rows, LENGTH])


def _settled(
    rigid: _Rigid, poses: NDArray[np.float64], laid: Laid, workers: Workers, at_rest: bool
) -> Layered:
    near = np.full((len(poses), 1), -1, np.int32)  # nobody follows: each has its place already
    return layer(
        rigid.feathers, poses, near, laid.skin.bvh, workers, bent_back=0.0, at_rest=at_rest)


def _error(
    own: NDArray[np.float32], turning: NDArray[np.float64], vanes: NDArray[np.float32], which: NDArray[np.int64],
    workers: Workers,
) -> float:
    """The largest distance between the vanes and their prototypes, both at length 1."""
    if not len(own):
        return 0.0
    exact = np.zeros((len(own), POSE))
    exact[:, [BEND, CUP, TWIST]] = turning
    exact[:, LENGTH] = 1.0
    upright = np.broadcast_to(np.eye(3, dtype=np.float32), (len(own), 3, 3)).copy()
    true = pose_vanes(own, exact, np.zeros((len(own), 3), np.float32), upright, ranges=workers.ranges)
    return float(np.linalg.norm(true - vanes[which], axis=-1).max())


def quaternions(frames: NDArray[np.float32], poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit quaternions (N, 4), w first, that take a vane in its own frame to its lift and roll on the skin."""
    f = frames.astype(np.float64)
    cl, sl = np.cos(poses[:, LIFT]), np.sin(poses[:, LIFT])
    cr, sr = np.cos(poses[:, ROLL]), np.sin(poses[:, ROLL])
    zero, one = np.zeros(len(f)), np.ones(len(f))
    roll = np.stack([np.stack([cr, zero, -sr], -1), np.stack([zero, one, zero], -1), np.stack([sr, zero, cr], -1)], 1)
    lift = np.stack([np.stack([one, zero, zero], -1), np.stack([zero, cl, -sl], -1), np.stack([zero, sl, cl], -1)], 1)
    m = np.swapaxes(f, 1, 2) @ lift @ roll
    # the largest of the four squares first (Shepperd, "Quaternion from rotation matrix", 1978)
    trace = m[:, 0, 0] + m[:, 1, 1] + m[:, 2, 2]
    squares = np.stack([trace, m[:, 0, 0], m[:, 1, 1], m[:, 2, 2]], axis=1)
    cases = np.empty((4, len(f), 4))
    cases[0] = np.stack(
        [1.0 + trace, m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]], axis=1)
    cases[1] = np.stack(
        [m[:, 2, 1] - m[:, 1, 2], 1.0 + 2.0 * m[:, 0, 0] - trace, m[:, 0, 1] + m[:, 1, 0], m[:, 0, 2] + m[:, 2, 0]], 1)
    cases[2] = np.stack(
        [m[:, 0, 2] - m[:, 2, 0], m[:, 0, 1] + m[:, 1, 0], 1.0 + 2.0 * m[:, 1, 1] - trace, m[:, 1, 2] + m[:, 2, 1]], 1)
    cases[3] = np.stack(
        [m[:, 1, 0] - m[:, 0, 1], m[:, 0, 2] + m[:, 2, 0], m[:, 1, 2] + m[:, 2, 1], 1.0 + 2.0 * m[:, 2, 2] - trace], 1)
    found = cases[np.argmax(squares, axis=1), np.arange(len(f))] if len(f) else np.zeros((0, 4))
    return np.asarray(found / np.maximum(np.linalg.norm(found, axis=1, keepdims=True), 1e-30))


def _instanced(
    own: NDArray[np.float32], positions: NDArray[np.float32], turns: NDArray[np.floating], scales: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Vanes as a reader of the file places them: its turns are made unit again, as OpenUSD does."""
    q = turns.astype(np.float64)
    q /= np.maximum(np.linalg.norm(q, axis=1, keepdims=True), 1e-30)
    w, v = q[:, 0, None, None, None], q[:, None, None, 1:]
    p = own.astype(np.float64) * scales[:, None, None, None]
    cross = np.cross(np.broadcast_to(v, p.shape), p)
    turned = p + 2.0 * (w * cross + np.cross(np.broadcast_to(v, p.shape), cross))
    return (turned + positions[:, None, None, :]).astype(np.float32)
