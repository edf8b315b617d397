"""Inverse kinematics: turns of the joints of a chain that bring its end to a place.

Two bones in closed form, by the law of cosines, the bend in the plane of a pole; longer chains by FABRIK (Aristidou and
Lasenby 2011), which keeps the lengths of the bones and moves every joint as little as it must. Joints then turn the
shortest way to where their children went: what they are twisted stays as it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from core.errors import UserError
from core.pose.pose import Pose, local_of_pose, pose_of_local
from core.pose.rotation import polar_rotation
from core.pose.skeleton import Skeleton
from core.pose.skinning import object_matrices
from core.transform import Array, normalized

NEAR = 1e-7  # of the length of a chain: how near its end comes where it can
MOST_ROUNDS = 256
STRAIGHT = 1e-6  # of the length of a chain: how far its joints may be off a line that has no bend


def chain_to(skeleton: Skeleton, end: str, bones: int) -> tuple[str, ...]:
    """The joints of a chain of so many bones (or as many as there are) that ends at `end`, root first.

    Raises
    ------
    UserError
        When there is no such joint, or nothing above it.
    """
    if end not in skeleton.names:
        raise UserError(f"There is no joint {end!r}; choose one of {', '.join(skeleton.names[:20])}.")
    joints = [skeleton.names.index(end)]
    while len(joints) <= bones and skeleton.parents[joints[-1]] >= 0:
        joints.append(int(skeleton.parents[joints[-1]]))
    if len(joints) < 2:
        raise UserError(f"{end} has no joint above it that could bring it anywhere; take one farther down.")
    return tuple(skeleton.names[j] for j in reversed(joints))


def solved_ik(
    skeleton: Skeleton, pose: Pose, chain: Sequence[str], goal: ArrayLike, pole: ArrayLike | None = None,
    keep_end: bool = True,
) -> Pose:
    """The pose with the end of a chain at `goal`, or as near as its bones reach.

    Parameters
    ----------
    chain : joints, each the parent of the next; three of them are solved in closed form.
    goal : (3,), object space, metres.
    pole : (3,), object space: the first bend points that way; as it is bent now when None.
    keep_end : the last joint keeps its rotation in object space (a foot stays flat); else it goes along.

    Raises
    ------
    UserError
        When these joints are no chain.
    """
    joints = [skeleton.names.index(name) for name in chain if name in skeleton.names]
    if len(joints) != len(chain) or len(joints) < 2 or any(
            skeleton.parents[b] != a for a, b in pairwise(joints)):
        raise UserError("Inverse kinematics needs joints of which each is the parent of the next.")
    local = local_of_pose(skeleton, pose)
    world = object_matrices(skeleton, local)
    places = world[joints, :3, 3]
    target = np.asarray(goal, np.float64)
    up = None if pole is None else np.asarray(pole, np.float64)
    found = two_bones(places, target, up) if len(joints) == 3 else fabrik(places, target, up)
    end_turn = polar_rotation(world[joints[-1], :3, :3])
    for place, (joint, child) in enumerate(pairwise(joints)):
        world = object_matrices(skeleton, local)
        turn = turn_between(world[child, :3, 3] - world[joint, :3, 3], found[place + 1] - world[joint, :3, 3])
        _turn(skeleton, local, world, joint, turn)
    if keep_end:
        world = object_matrices(skeleton, local)
        _turn(skeleton, local, world, joints[-1], end_turn @ polar_rotation(world[joints[-1], :3, :3]).T)
    numbers = dict(pose.numbers)
    return pose_of_local(skeleton, local, pose.name, numbers)


def turned_joint(skeleton: Skeleton, local: Array, joint: int, turn: Array) -> Array:
    """Matrices (J, 4, 4) parent_from_joint with one joint turned about its origin by `turn` (3, 3) of object space."""
    out = np.array(local, np.float64)
    _turn(skeleton, out, object_matrices(skeleton, out), joint, np.asarray(turn, np.float64))
    return out


def _turn(skeleton: Skeleton, local: Array, world: Array, joint: int, turn: Array) -> None:
    parent = skeleton.parents[joint]
    above = np.eye(3) if parent < 0 else polar_rotation(world[parent, :3, :3])
    local[joint, :3, :3] = above.T @ turn @ above @ local[joint, :3, :3]


def two_bones(places: Array, goal: Array, pole: Array | None = None) -> Array:
    """Places (3, 3) of root, middle and end with the end at `goal`, or on the way to it where it is out of reach."""
    root, middle, end = places
    upper, lower = float(np.linalg.norm(middle - root)), float(np.linalg.norm(end - middle))
    way, length = goal - root, float(np.linalg.norm(goal - root))
    if length < 1e-12:
        way, length = end - root, 0.0
    along = normalized(way) if np.linalg.norm(way) > 1e-12 else np.array([1.0, 0.0, 0.0])
    reach = min(max(length, abs(upper - lower)), upper + lower)
    bend = _across(along, (middle if pole is None else pole) - root, middle - root)
    down = (upper**2 + reach**2 - lower**2) / (2.0 * reach) if reach > 1e-12 else 0.0
    off = np.sqrt(max(upper**2 - down**2, 0.0))
    return np.array([root, root + down * along + off * bend, root + reach * along])


def fabrik(places: Array, goal: Array, pole: Array | None = None) -> Array:
    """Places (N, 3) of a chain with its end at `goal`, the bones as long as they were; straight where out of reach."""
    lengths = np.linalg.norm(np.diff(places, axis=0), axis=1)
    whole = float(lengths.sum())
    out, root = np.array(places, np.float64), places[0].copy()
    way = goal - root
    if np.linalg.norm(way) >= whole - NEAR * whole:
        along = normalized(way)
        return root + np.concatenate([[0.0], np.cumsum(lengths)])[:, None] * along
    _unstraightened(out, goal, pole, whole)
    for _ in range(MOST_ROUNDS):
        if np.linalg.norm(out[-1] - goal) <= NEAR * whole:
            break
        out[-1] = goal
        for i in range(len(out) - 2, -1, -1):
            out[i] = out[i + 1] + lengths[i] * _unit(out[i] - out[i + 1])
        out[0] = root
        for i in range(1, len(out)):
            out[i] = out[i - 1] + lengths[i - 1] * _unit(out[i] - out[i - 1])
    return out


def _unstraightened(places: Array, goal: Array, pole: Array | None, whole: float) -> None:
    """Bend a chain that lies on the line to its goal, in place: nothing would ever bend it."""
    along = _unit(goal - places[0])
    off = places - places[0] - np.outer((places - places[0]) @ along, along)
    if pole is not None or np.linalg.norm(off, axis=1).max() < STRAIGHT * whole:
        bend = _across(along, (pole if pole is not None else places[1]) - places[0], places[1] - places[0])
        inner = slice(1, len(places) - 1)
        if pole is not None:  # the joints keep how far they are off the line, in the plane of the pole
            size = np.maximum(np.linalg.norm(off[inner], axis=1), 0.05 * whole)
            places[inner] += size[:, None] * bend - off[inner]
        else:
            places[inner] += 0.05 * whole * bend


def _across(along: Array, towards: Array, instead: Array) -> Array:
    """Unit direction across `along`: towards one place, else another, else any."""
    for wish in (towards, instead, np.eye(3)[int(np.argmin(np.abs(along)))]):
        bend = wish - along * (along @ wish)
        size = float(np.linalg.norm(bend))
        if size > STRAIGHT * max(float(np.linalg.norm(wish)), 1e-12):
            return np.asarray(bend / size, np.float64)
    raise AssertionError("one of three axes is across any direction")


def _unit(vector: Array) -> Array:
    length = float(np.linalg.norm(vector))
    return vector / length if length > 1e-300 else np.array([1.0, 0.0, 0.0])


def turn_between(a: Array, b: Array) -> Array:
    """The shortest rotation (3, 3) that carries the direction of `a` (3,) to that of `b` (3,)."""
    u, v = _unit(np.asarray(a, np.float64)), _unit(np.asarray(b, np.float64))
    cosine = float(u @ v)
    if cosine < -1.0 + 1e-12:  # half a turn about anything across
        axis = _across(u, np.eye(3)[int(np.argmin(np.abs(u)))], np.eye(3)[0])
        return 2.0 * np.outer(axis, axis) - np.eye(3)
    cross = np.cross(u, v)
    skew = np.array([[0.0, -cross[2], cross[1]], [cross[2], 0.0, -cross[0]], [-cross[1], cross[0], 0.0]])
    turn: Array = np.eye(3) + skew + skew @ skew / (1.0 + cosine)
    return turn
