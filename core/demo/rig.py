"""Joints of the demo animal, its skin, and two seconds in which it looks about."""

from __future__ import annotations

import numpy as np

from core.curve import Curve, Key, curve_at
from core.demo.shape import Shape
from core.pose.rig import Rig
from core.pose.skeleton import Clip, Skeleton, SkinWeights
from core.transform import quaternion_about, quaternion_product, translation

FIRST_FRAME, FRAMES = 1001, 48
_INFLUENCES = 4

# name, parent, place in object space (metres)
_JOINTS = [
    ("hips", -1, (0.0, 0.180, -0.090)),
    ("spine", 0, (0.0, 0.180, 0.000)),
    ("chest", 1, (0.0, 0.182, 0.080)),
    ("neck", 2, (0.0, 0.215, 0.135)),
    ("head", 3, (0.0, 0.268, 0.162)),
    ("tail1", 0, (0.0, 0.200, -0.175)),
    ("tail2", 5, (0.0, 0.222, -0.275)),
    ("tail3", 6, (0.0, 0.280, -0.345)),
]

# degrees at frames: to the animal's left and right, up and down, and tilted
_YAW = {1001: 0.0, 1005: 0.0, 1014: 46.0, 1020: 48.0, 1034: -46.0, 1039: -44.0, 1048: 0.0}
_NOD = {1001: 0.0, 1010: 5.0, 1017: -6.0, 1027: 6.0, 1036: -8.0, 1048: 0.0}
_TILT = {1001: 0.0, 1013: 0.0, 1019: 12.0, 1026: 0.0, 1033: -4.0, 1039: -10.0, 1048: 0.0}
_SWISH = {1001: 0.0, 1008: 14.0, 1019: -14.0, 1030: 14.0, 1041: -12.0, 1048: 0.0}


def rig(animal: Shape) -> Rig:
    """Skeleton, skin and clip of the animal; at the first frame it stands as modelled."""
    names = tuple(name for name, _, _ in _JOINTS)
    parents = [parent for _, parent, _ in _JOINTS]
    places = np.array([place for _, _, place in _JOINTS])
    offsets = places - np.where(np.array(parents)[:, None] >= 0, places[parents], 0.0)
    skeleton = Skeleton(
        names=names, parents=np.array(parents, np.int32),
        rest=np.stack([translation(offset) for offset in offsets]),
        bind=np.stack([translation(place) for place in places]),
    )
    weights = animal.weights[:, [animal.joints.index(name) for name in names]]
    strongest = np.argsort(-weights, axis=1, kind="stable")[:, :_INFLUENCES]
    kept = np.take_along_axis(weights, strongest, axis=1)
    skin = SkinWeights(
        joints=strongest.astype(np.int32),
        weights=(kept / kept.sum(axis=1, keepdims=True)).astype(np.float32),
    )
    return Rig(skeleton=skeleton, skin=skin, clip=_looking_about(names, offsets))


def _looking_about(names: tuple[str, ...], offsets: np.ndarray) -> Clip:
    frames = np.arange(FIRST_FRAME, FIRST_FRAME + FRAMES)
    yaw, nod, tilt = (np.radians(_at(keys, frames)) for keys in (_YAW, _NOD, _TILT))
    rotations = np.tile(np.array([0.0, 0.0, 0.0, 1.0]), (FRAMES, len(names), 1))
    for name, share in (("chest", 0.12), ("neck", 0.33), ("head", 0.55)):
        turn = quaternion_about((0.0, 1.0, 0.0), share * yaw)
        lean = quaternion_product(quaternion_about((1.0, 0.0, 0.0), -share * nod),
                                  quaternion_about((0.0, 0.0, 1.0), share * tilt))
        rotations[:, names.index(name)] = quaternion_product(turn, lean)
    for delay, name in enumerate(("tail1", "tail2", "tail3")):  # the tip follows the root
        swish = np.radians(_at(_SWISH, frames - 2 * delay)) * np.interp(frames, [1042, 1048], [1.0, 0.0])
        rotations[:, names.index(name)] = quaternion_about((0.0, 1.0, 0.0), (1.0 + 0.3 * delay) * swish)
    return Clip(
        name="looking about", start=float(FIRST_FRAME), frames_per_second=24.0,
        translations=np.tile(offsets, (FRAMES, 1, 1)).astype(np.float32),
        rotations=rotations.astype(np.float32),
        scales=np.ones((FRAMES, len(names), 3), np.float32),
    )


def _at(keys: dict[int, float], frames: np.ndarray) -> np.ndarray:
    return curve_at(Curve(keys=tuple(Key(frame=float(f), value=v) for f, v in keys.items())), frames)
