"""Where a rig puts points of its mesh: what :mod:`core.match.fit_rig` asks of a rig.

Numbers are called ``joint.rx``, ``.ry``, ``.rz`` (radians, about x first, then y, then z, axes of the joint's rest),
``joint.tx``, ``.ty``, ``.tz`` (metres in the parent), or by the name of an abstract control.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.match.fit_rig import Parameter, Places
from core.match.solve.state import Array
from core.pose.pose import Pose, local_of_pose
from core.pose.rig import Rig
from core.pose.rotation import euler_from_quaternion, quaternion_from_euler
from core.pose.skeleton import SkinWeights
from core.pose.skinning import deformed
from core.transform import transform_points

TURNS, SHIFTS = ("rx", "ry", "rz"), ("tx", "ty", "tz")


def rig_parameter(rig: Rig, name: str, **more: float | bool) -> Parameter:
    """A number of a rig as a parameter, within the limits the rig itself sets; `more` as :class:`Parameter` has it.

    Raises
    ------
    UserError
        The rig has no such number.
    """
    joint, _, channel = name.rpartition(".")
    if channel in (*TURNS, *SHIFTS) and joint in rig.skeleton.names:
        low, high = -np.inf, np.inf
        for one in rig.constraints:
            if one.joint == joint and one.kind == "limit" and channel in TURNS:
                low, high = one.low[TURNS.index(channel)], one.high[TURNS.index(channel)]
        return Parameter(name, **{"low": low, "high": high, **more})  # type: ignore[arg-type]
    for control in rig.controls:
        if control.name == name and control.kind == "number":
            return Parameter(name, **{"rest": control.rest, **more})  # type: ignore[arg-type]
    raise UserError(f"The rig has no number {name!r}; name a joint with .rx .. .tz, or one of its controls.")


def rig_places(
    rig: Rig, mesh_points: NDArray[np.float32], vertices: NDArray[np.int32], names: Sequence[str],
    poses: Sequence[Pose], world_from_object: Array,
) -> Places:
    """The function that gives the places of some vertices in the world of the solver.

    Parameters
    ----------
    names : of the numbers, in the order they are given in.
    poses : of each frame, what the numbers are put upon (a joint that is named keeps its other channels).
    world_from_object : (F, 4, 4).
    """
    for name in names:
        rig_parameter(rig, name)
    small = rig
    points = np.ascontiguousarray(mesh_points, np.float32)
    picked = np.asarray(vertices, np.int32)
    if rig.shapes is None:  # only what was picked is moved
        points = np.ascontiguousarray(points[picked])
        skin = SkinWeights(joints=rig.skin.joints[picked], weights=rig.skin.weights[picked])
        controls = tuple(control for control in rig.controls if control.vertices is None)
        dual = None if rig.dual is None else rig.dual[picked]
        small = rig.replace(skin=skin, dual=dual, controls=controls, file_vertices=None)
        picked = np.arange(len(picked), dtype=np.int32)

    def places(frame: int, values: Array) -> Array:
        pose = posed(poses[frame], names, values)
        moved = deformed(points, small, local_of_pose(small.skeleton, pose), pose.numbers)
        return transform_points(world_from_object[frame], moved[picked].astype(np.float64))

    return places


def posed(pose: Pose, names: Sequence[str], values: Array) -> Pose:
    """A pose with numbers set."""
    rotations, translations, numbers = dict(pose.rotations), dict(pose.translations), dict(pose.numbers)
    turned = list(dict.fromkeys(name[:-3] for name in names if name.rpartition(".")[2] in TURNS))
    if turned:  # all joints in one go: this runs for every difference of every frame
        angles = euler_from_quaternion([pose.rotations.get(joint, (0.0, 0.0, 0.0, 1.0)) for joint in turned])
    for name, value in zip(names, values, strict=True):
        joint, _, channel = name.rpartition(".")
        if channel in TURNS:
            angles[turned.index(joint), TURNS.index(channel)] = value
        elif channel in SHIFTS:
            at = list(translations.get(joint, (0.0, 0.0, 0.0)))
            at[SHIFTS.index(channel)] = float(value)
            translations[joint] = (at[0], at[1], at[2])
        else:
            numbers[name] = float(value)
    if turned:
        for joint, (x, y, z, w) in zip(turned, quaternion_from_euler(np.degrees(angles)).tolist(), strict=True):
            rotations[joint] = (x, y, z, w)
    return Pose(name=pose.name, rotations=rotations, translations=translations, numbers=numbers)
