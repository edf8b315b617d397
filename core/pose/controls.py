"""Which degrees of freedom a pose space reads of the controls of a rig, as an artist picks them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Literal

import numpy as np

from core.errors import UserError
from core.pose.pose import Pose, Vector, rest_rotations
from core.pose.pose_space import Dof, DofKind, Falloff
from core.pose.rig import Control, Rig, resting_numbers
from core.pose.skeleton import Skeleton
from core.transform import Array, normalized

ROTATION_FALLOFF = math.pi / 3
TRANSLATION_FALLOFF = 0.1  # metres
NOISE = 1e-6  # radians, metres and units: what samples of clips in single precision miss rest by


def twist_axes(skeleton: Skeleton) -> Array:
    """Unit axes (J, 3), each in the space of its joint, about which the joints twist: towards the farthest child.

    A joint without children goes on as it came from its parent; a lone joint twists about x.
    """
    turn = rest_rotations(skeleton)
    axes = np.tile([1.0, 0.0, 0.0], (len(skeleton.names), 1))
    offsets = skeleton.rest[:, :3, 3]
    for joint, parent in enumerate(skeleton.parents):
        children = np.flatnonzero(skeleton.parents == joint)
        lengths = np.linalg.norm(offsets[children], axis=1)
        if lengths.max(initial=0.0) > 1e-12:
            towards = skeleton.rest[joint, :3, :3] @ offsets[children[np.argmax(lengths)]]
        elif parent >= 0 and np.linalg.norm(offsets[joint]) > 1e-12:
            towards = offsets[joint]
        else:
            continue
        axes[joint] = normalized(turn[joint].T @ towards)
    return axes


def side_of(axis: Sequence[float]) -> Vector:
    """The direction across `axis` from which swing is counted: of x, y and z the one farthest from it, made square."""
    a = normalized(axis)
    side = np.eye(3)[np.argmin(np.round(np.abs(a), 9))]
    x, y, z = map(float, normalized(side - a * (a @ side)))
    return x, y, z


def rotation_dof(
    skeleton: Skeleton, joint: str, kind: Literal["swing", "twist", "swing-twist", "x", "y", "z"] = "swing-twist",
    falloff: Falloff = (ROTATION_FALLOFF,), axis: Sequence[float] | None = None,
) -> Dof:
    """What is read of the rotation of a joint; "x", "y" or "z" is the twist about that axis alone.

    Parameters
    ----------
    axis : of the twist, in the space of the joint; towards the child when None.

    Raises
    ------
    UserError
        When there is no such joint.
    """
    _check_joint(skeleton, joint)
    read: DofKind = "twist" if kind in ("x", "y", "z") else kind  # type: ignore[assignment]
    if kind in ("x", "y", "z"):
        axis = np.eye(3)["xyz".index(kind)].tolist()
    elif axis is None:
        axis = twist_axes(skeleton)[skeleton.names.index(joint)].tolist()
    x, y, z = map(float, normalized(axis))
    return Dof(control=joint, kind=read, axis=(x, y, z), side=side_of((x, y, z)), falloff=falloff)


def translation_dof(joint: str, falloff: Falloff = (TRANSLATION_FALLOFF,)) -> Dof:
    """What is read of the movement of a joint in its parent."""
    return Dof(control=joint, kind="translation", falloff=falloff)


def number_dof(control: Control, falloff: float | None = None) -> Dof:
    """What is read of an abstract control; it reaches half its range unless said otherwise."""
    reach = 0.5 * (control.high - control.low) if falloff is None else falloff
    return Dof(control=control.name, kind="number", falloff=(reach,), rest=control.rest)


def dofs_of(rig: Rig, poses: Iterable[Pose], falloffs: dict[str, float] | None = None) -> tuple[Dof, ...]:
    """What to read so that these poses differ from rest: swing and twist of turned joints, places, numbers.

    Parameters
    ----------
    falloffs : by control, radians or units, where they are not the usual ones.

    Raises
    ------
    UserError
        When a pose names a control that the rig does not have.
    """
    given, poses = falloffs or {}, list(poses)
    controls = {control.name: control for control in rig.controls}
    found: list[Dof] = []
    for joint in sorted({j for pose in poses for j in pose.rotations}):
        found.append(rotation_dof(rig.skeleton, joint, falloff=(given.get(joint, ROTATION_FALLOFF),)))
    for joint in sorted({j for pose in poses for j in pose.translations}):
        _check_joint(rig.skeleton, joint)
        found.append(translation_dof(joint, (given.get(joint, TRANSLATION_FALLOFF),)))
    for name in sorted({n for pose in poses for n in pose.numbers}):
        if name not in controls:
            raise UserError(f"There is no control {name!r}; choose one of {', '.join(sorted(controls)[:20])}.")
        found.append(number_dof(controls[name], given.get(name)))
    return tuple(found)


def rests(rig: Rig) -> dict[str, float]:
    """Where the abstract controls rest that do not rest at 0."""
    return {name: at for name, at in resting_numbers(rig).items() if at != 0.0}


def without_noise(rig: Rig, pose: Pose) -> Pose:
    """The pose in which controls that miss rest only by the rounding of a clip's samples are at rest."""
    at = resting_numbers(rig)
    quiet: Pose = pose.replace(
        rotations={j: q for j, q in pose.rotations.items() if 2.0 * math.hypot(*q[:3]) > NOISE},
        translations={j: t for j, t in pose.translations.items() if math.hypot(*t) > NOISE},
        numbers={n: v for n, v in pose.numbers.items() if abs(v - at.get(n, 0.0)) > NOISE})
    return quiet


def _check_joint(skeleton: Skeleton, joint: str) -> None:
    if joint not in skeleton.names:
        raise UserError(f"There is no joint {joint!r}; choose one of {', '.join(skeleton.names[:20])}.")
