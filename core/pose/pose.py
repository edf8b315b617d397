"""A pose: what the artist moved away from rest, each joint relative to its own rest and never to the world."""

from __future__ import annotations

import math

import msgspec
import numpy as np
from numpy.typing import ArrayLike

from core.pose.rotation import polar_rotation, relative
from core.pose.skeleton import Skeleton
from core.record import Record, text
from core.transform import Array, matrix_from_quaternion, quaternion_from_matrix

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
SAME = 1e-9  # radians, metres or units below which a control has not moved


class Pose(Record):
    """Only what differs from rest; a control that is not named is at rest.

    rotations : by joint, quaternion (x, y, z, w) of q_rest^-1 * q_local; normalised.
    translations : by joint, metres in the space of its parent, added to its place at rest.
    numbers : by abstract control, its value (what rests at another number than 0 says so in its ``Control``).

    The dictionaries are copied on the way in and must not be written to.
    """

    name: str = "pose"
    rotations: dict[str, Quaternion] = msgspec.field(default_factory=dict)
    translations: dict[str, Vector] = msgspec.field(default_factory=dict)
    numbers: dict[str, float] = msgspec.field(default_factory=dict)

    def __post_init__(self) -> None:
        text(self, "name")
        for field in ("rotations", "translations", "numbers"):
            values = getattr(self, field)
            for control, value in values.items():
                parts = (value,) if field == "numbers" else value
                if not control or not all(isinstance(v, int | float) and math.isfinite(v) for v in parts):
                    raise ValueError(f"Pose.{field} of {control!r} must be finite numbers, not {value!r}")
        unit = {}
        for joint, (x, y, z, w) in self.rotations.items():
            length = math.hypot(x, y, z, w)
            if length < 1e-12:
                raise ValueError(f"Pose.rotations of {joint!r} is a quaternion of length 0")
            close = abs(length - 1.0) < 1e-15
            unit[joint] = (x, y, z, w) if close else (x / length, y / length, z / length, w / length)
        msgspec.structs.force_setattr(self, "rotations", unit)
        msgspec.structs.force_setattr(self, "translations", dict(self.translations))
        msgspec.structs.force_setattr(self, "numbers", dict(self.numbers))


REST = Pose(name="rest")


def moved_controls(pose: Pose, rests: dict[str, float] | None = None) -> tuple[str, ...]:
    """Names of the controls that differ from rest, sorted.

    Parameters
    ----------
    rests : where abstract controls rest that do not rest at 0.
    """
    at = rests or {}
    turned = {j for j, q in pose.rotations.items() if 2.0 * math.hypot(*q[:3]) > SAME}
    slid = {j for j, t in pose.translations.items() if math.hypot(*t) > SAME}
    dialled = {n for n, v in pose.numbers.items() if abs(v - at.get(n, 0.0)) > SAME}
    return tuple(sorted(turned | slid | dialled))


def rest_rotations(skeleton: Skeleton) -> Array:
    """Rotations (J, 3, 3) of the joints at rest in their parents, without scale or shear."""
    return polar_rotation(skeleton.rest[:, :3, :3])


def local_of_pose(skeleton: Skeleton, pose: Pose) -> Array:
    """Matrices (J, 4, 4) parent_from_joint of a pose; names that are not joints are passed over."""
    local = np.array(skeleton.rest, np.float64)
    place = {name: j for j, name in enumerate(skeleton.names)}
    turned = [(place[name], q) for name, q in pose.rotations.items() if name in place]
    if turned:
        joints = [j for j, _ in turned]
        rest = polar_rotation(local[joints, :3, :3])
        # conjugated with the rest rotation, scale and shear of the rest stay what they are
        turn = rest @ matrix_from_quaternion([q for _, q in turned]) @ np.swapaxes(rest, 1, 2)
        local[joints, :3, :3] = turn @ local[joints, :3, :3]
    for name, offset in pose.translations.items():
        if name in place:
            local[place[name], :3, 3] += offset
    return local


def pose_of_local(
    skeleton: Skeleton, local: ArrayLike, name: str = "pose", numbers: dict[str, float] | None = None
) -> Pose:
    """The pose of matrices (J, 4, 4) parent_from_joint: what differs from rest. Scales are not part of a pose."""
    m = np.asarray(local, np.float64)
    rest = quaternion_from_matrix(rest_rotations(skeleton))
    turned = relative(rest, quaternion_from_matrix(polar_rotation(m[:, :3, :3])))
    slid = m[:, :3, 3] - skeleton.rest[:, :3, 3]
    rotations: dict[str, Quaternion] = {}
    translations: dict[str, Vector] = {}
    for j, joint in enumerate(skeleton.names):
        if np.linalg.norm(turned[j, :3]) > SAME:
            x, y, z, w = map(float, turned[j])
            rotations[joint] = (x, y, z, w)
        if np.linalg.norm(slid[j]) > SAME:
            tx, ty, tz = map(float, slid[j])
            translations[joint] = (tx, ty, tz)
    return Pose(name=name, rotations=rotations, translations=translations, numbers=numbers or {})

