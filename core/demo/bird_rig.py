"""Joints of the demo bird, its skin, and two seconds in which it opens its wings and folds them again."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.curve import Curve, Key, curve_at
from core.demo.shape import Shape
from core.pose.rig import Rig
from core.pose.skeleton import Clip, Skeleton, SkinWeights
from core.transform import normalized, quaternion_about, quaternion_product, translation

Array = NDArray[np.float64]

FIRST_FRAME, FRAMES = 1001, 48
_INFLUENCES = 4
_TRUNK = [
    ("hips", -1, (0.0, 0.0520, -0.0190)),
    ("chest", 0, (0.0, 0.0630, 0.0020)),
    ("neck", 1, (0.0, 0.0765, 0.0200)),
    ("head", 2, (0.0, 0.0850, 0.0270)),
    ("tail", 0, (0.0, 0.0400, -0.0420)),
]
PITCH = np.radians(38.0)
BODY_AXES = np.array([[1.0, 0.0, 0.0], [0.0, np.sin(PITCH), np.cos(PITCH)], [0.0, np.cos(PITCH), -np.sin(PITCH)]])
WING_JOINTS = ("humerus", "forearm", "hand")

# directions of the bones of the left wing when it is folded: out, forward, up of the body; and where its top faces
_FOLDED = {
    "humerus": ((0.26, -0.95, -0.16), (0.86, 0.05, 0.50)),
    "forearm": ((0.10, 0.985, -0.12), (0.93, -0.10, 0.36)),
    "hand": ((-0.12, -0.98, 0.14), (0.95, -0.12, 0.30)),
}
_FOLD = {1001: 1.0, 1009: 1.0, 1020: 0.0, 1028: 0.0, 1041: 1.0, 1048: 1.0}
_RAISE = {1001: 0.0, 1009: 0.0, 1020: 26.0, 1028: 20.0, 1036: 0.0, 1048: 0.0}  # degrees, both wings
_YAW = {1001: 0.0, 1006: 32.0, 1011: 30.0, 1020: 0.0, 1034: -8.0, 1041: -36.0, 1044: -34.0, 1048: 0.0}
_NOD = {1001: 0.0, 1008: 6.0, 1020: -10.0, 1030: 4.0, 1040: 0.0, 1048: 0.0}
_TAIL = {1001: 0.0, 1014: 0.0, 1022: -14.0, 1034: 6.0, 1048: 0.0}


def bird_rig(shape: Shape, shoulder: Array, elbow: Array, wrist: Array, end: Array) -> Rig:
    """Skeleton, skin and clip of the bird; at rest it stands as modelled, its wings open.

    shoulder, elbow, wrist, end : (3,) of the left (+x) wing, metres.
    """
    named = [(name, parent, np.array(place)) for name, parent, place in _TRUNK]
    for side, sign in (("left", 1.0), ("right", -1.0)):
        first = len(named)
        for k, (name, place) in enumerate(zip(WING_JOINTS, (shoulder, elbow, wrist), strict=True)):
            named.append((f"{name}_{side}", 1 if k == 0 else first + k - 1, place * (sign, 1.0, 1.0)))
    names = tuple(name for name, _, _ in named)
    parents = np.array([parent for _, parent, _ in named], np.int32)
    places = np.array([place for _, _, place in named])
    offsets = places - np.where(parents[:, None] >= 0, places[parents], 0.0)
    skeleton = Skeleton(
        names=names, parents=parents, rest=np.stack([translation(offset) for offset in offsets]),
        bind=np.stack([translation(place) for place in places]),
    )
    bones = {"humerus": elbow - shoulder, "forearm": wrist - elbow, "hand": end - wrist}
    return Rig(skeleton=skeleton, skin=_skin(shape, names), clip=_clip(names, offsets, bones))


def _skin(shape: Shape, names: tuple[str, ...]) -> SkinWeights:
    x = shape.mesh.points[:, 0]
    columns = []
    for name in names:
        own = name.removesuffix("_left").removesuffix("_right")
        column = shape.weights[:, shape.joints.index(own)]
        if own != name:
            column = column * ((x > 0.0) if name.endswith("_left") else (x < 0.0))
        columns.append(column)
    weights = np.stack(columns, axis=1)
    strongest = np.argsort(-weights, axis=1, kind="stable")[:, :_INFLUENCES]
    kept = np.take_along_axis(weights, strongest, axis=1)
    return SkinWeights(
        joints=strongest.astype(np.int32), weights=(kept / kept.sum(axis=1, keepdims=True)).astype(np.float32))


def _clip(names: tuple[str, ...], offsets: Array, bones: dict[str, Array]) -> Clip:
    frames = np.arange(FIRST_FRAME, FIRST_FRAME + FRAMES)
    fold, lift, yaw, nod, tail = (_at(keys, frames) for keys in (_FOLD, _RAISE, _YAW, _NOD, _TAIL))
    rotations = np.tile(np.array([0.0, 0.0, 0.0, 1.0]), (FRAMES, len(names), 1))
    for name, part in (("neck", 0.4), ("head", 0.6)):
        turn = quaternion_about((0.0, 1.0, 0.0), part * np.radians(yaw))
        rotations[:, names.index(name)] = quaternion_product(
            turn, quaternion_about((1.0, 0.0, 0.0), -part * np.radians(nod)))
    rotations[:, names.index("tail")] = quaternion_about((1.0, 0.0, 0.0), -np.radians(tail))
    parent = np.eye(3)
    for name in WING_JOINTS:
        along, top = (np.array(v) @ BODY_AXES for v in _FOLDED[name])
        world = _frame(along, top) @ _frame(bones[name], BODY_AXES[2]).T
        axis, angle = _axis_angle(parent.T @ world)
        parent = world
        turns = quaternion_about(axis, fold * angle)
        if name == "humerus":  # raised about the body's own axis while it is open
            turns = quaternion_product(quaternion_about(BODY_AXES[1], np.radians(lift)), turns)
        rotations[:, names.index(f"{name}_left")] = turns
        rotations[:, names.index(f"{name}_right")] = turns * np.array([1.0, -1.0, -1.0, 1.0])  # across x = 0
    return Clip(
        name="opening the wings", start=float(FIRST_FRAME), frames_per_second=24.0,
        translations=np.tile(offsets, (FRAMES, 1, 1)).astype(np.float32), rotations=rotations.astype(np.float32),
        scales=np.ones((FRAMES, len(names), 3), np.float32),
    )


def _frame(along: Array, top: Array) -> Array:
    """Columns along, top made square to it, and what is square to both."""
    a = normalized(along)
    t = normalized(top - a * (top @ a))
    return np.stack([a, t, np.cross(a, t)], axis=1)


def _axis_angle(turn: Array) -> tuple[Array, float]:
    """Axis (3,) and angle in 0 .. pi of a rotation (3, 3)."""
    spin = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    return normalized(spin), float(np.arctan2(np.linalg.norm(spin), np.trace(turn) - 1.0))


def _at(keys: dict[int, float], frames: NDArray[np.int64]) -> Array:
    return curve_at(Curve(keys=tuple(Key(frame=float(f), value=v) for f, v in keys.items())), frames)
