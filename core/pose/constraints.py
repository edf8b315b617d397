"""Constraints of a rig: what a joint may do, and what it does because of another. They act while a pose is made.

A pose that is held, keyed or sculpted at has them in it already: nothing else of the program needs to know of them.
"""

from __future__ import annotations

import math

import numpy as np

from core.pose.ik import turn_between, turned_joint
from core.pose.pose import SAME, Pose, Quaternion, local_of_pose, pose_of_local
from core.pose.rig import Constraint
from core.pose.rotation import euler_from_quaternion, polar_rotation, quaternion_from_euler
from core.pose.skeleton import Skeleton
from core.pose.skinning import object_matrices
from core.transform import Array, matrix_from_quaternion, normalized, quaternion_about, quaternion_from_matrix


def constrained(skeleton: Skeleton, constraints: tuple[Constraint, ...], pose: Pose) -> Pose:
    """The pose with all constraints done, in their order; those of joints the skeleton lacks are passed over."""
    for one in constraints:
        if one.joint in skeleton.names and (one.target is None or one.target in skeleton.names):
            pose = _limited(one, pose) if one.kind == "limit" else _following(skeleton, one, pose)
    return pose


def _limited(one: Constraint, pose: Pose) -> Pose:
    q = pose.rotations.get(one.joint, (0.0, 0.0, 0.0, 1.0))
    angles = euler_from_quaternion(q)
    held = np.clip(angles, one.low, one.high)
    if np.abs(held - angles).max() < SAME:
        return pose
    x, y, z, w = map(float, quaternion_from_euler(np.degrees(held)))
    rotations: dict[str, Quaternion] = {**pose.rotations, one.joint: (x, y, z, w)}
    limited: Pose = pose.replace(rotations=rotations)
    return limited


def _following(skeleton: Skeleton, one: Constraint, pose: Pose) -> Pose:
    """The pose with one joint led: from where its parent leaves it at rest, so that doing it twice is doing it once."""
    joint, target = skeleton.names.index(one.joint), skeleton.names.index(one.target or "")
    if one.weight == 0.0 or _below(skeleton, target, joint):
        return pose  # what hangs from the joint goes where the joint goes
    local = local_of_pose(skeleton, _let_go(one, pose))
    now, then = object_matrices(skeleton, local), object_matrices(skeleton, skeleton.rest)
    if one.kind == "point":
        parent = int(skeleton.parents[joint])
        missing = now[target, :3, 3] + then[joint, :3, 3] - then[target, :3, 3] - now[joint, :3, 3]
        above = np.eye(3) if parent < 0 else now[parent, :3, :3]
        local[joint, :3, 3] += np.linalg.solve(above, one.weight * missing)
    else:
        if one.kind == "aim":
            pointing = polar_rotation(now[joint, :3, :3]) @ normalized(one.axis)
            turn = turn_between(pointing, now[target, :3, 3] - now[joint, :3, 3])
        else:
            wanted = polar_rotation(now[target, :3, :3]) @ polar_rotation(then[target, :3, :3]).T \
                @ polar_rotation(then[joint, :3, :3])
            turn = wanted @ polar_rotation(now[joint, :3, :3]).T
        local = turned_joint(skeleton, local, joint, partly(turn, one.weight))
    return pose_of_local(skeleton, local, pose.name, dict(pose.numbers))


def _let_go(one: Constraint, pose: Pose) -> Pose:
    """The pose without what the constraint decides; of an aim the joint keeps its twist about the axis."""
    if one.kind == "point":
        free: Pose = pose.replace(translations={j: t for j, t in pose.translations.items() if j != one.joint})
        return free
    rotations = {j: q for j, q in pose.rotations.items() if j != one.joint}
    if one.kind == "aim" and one.joint in pose.rotations:
        axis = normalized(one.axis)
        q = pose.rotations[one.joint]
        x, y, z = map(float, axis * float(axis @ q[:3]))
        if math.hypot(x, y, z, q[3]) > 1e-9:
            rotations[one.joint] = (x, y, z, q[3])
    free = pose.replace(rotations=rotations)
    return free


def partly(turn: Array, share: float) -> Array:
    """A rotation (3, 3) about the same axis by a share of its angle."""
    if share == 1.0:
        return turn
    q = quaternion_from_matrix(turn)
    q = -q if q[3] < 0.0 else q
    length = float(np.linalg.norm(q[:3]))
    if length < 1e-12:
        return np.eye(3)
    angle = 2.0 * math.atan2(length, float(q[3]))
    return np.asarray(matrix_from_quaternion(quaternion_about(q[:3] / length, share * angle)), np.float64)


def _below(skeleton: Skeleton, joint: int, root: int) -> bool:
    while joint >= 0:
        if joint == root:
            return True
        joint = int(skeleton.parents[joint])
    return False
