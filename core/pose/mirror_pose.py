"""Poses, pose spaces and layers of one side for the other. Mirrored twice they are what they were.

The mirror is a plane of object space across one axis. Joints may have any frames: what is mirrored is the rotation in
object space at rest, so it is right for every skeleton whose joints lie in mirrored places.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.pose.pose import Pose, Quaternion, Vector
from core.pose.pose_space import Dof, Falloff, PoseLayer, PoseSample, PoseSpace
from core.pose.rig import Rig
from core.pose.rotation import polar_rotation
from core.pose.skeleton import Skeleton
from core.pose.skinning import object_matrices
from core.record import freeze
from core.transform import Array, matrix_from_quaternion, quaternion_from_matrix

_SIDE = re.compile(  # a word of its own or a part of a camel's name, but never a part of "bright"
    r"(?<![A-Za-z])(?:left|right)(?![a-z])|(?:Left|Right)(?![a-z])|(?<![A-Z])(?:LEFT|RIGHT)(?![A-Z])"
    r"|(?<![A-Za-z])[LRlr](?![A-Za-z])")
_OTHER = {"left": "right", "right": "left", "l": "r", "r": "l"}
SAME_PLACE = 1e-3  # of the skeleton's size


class Mirror(NamedTuple):
    """Which joint is whose counterpart, and across what.

    partners : (J,) int64, a joint of the middle is its own.
    across : 0, 1 or 2, the axis of object space that changes sign.
    turns : (J, 3, 3), rest rotation of each joint in object space. parents : (J, 3, 3), rest matrix of its parent.
    controls : names of the abstract controls there are; one whose counterpart is not among them is its own. None for
        whatever their names say.
    """

    skeleton: Skeleton
    partners: NDArray[np.int64]
    across: int
    turns: Array
    parents: Array
    controls: tuple[str, ...] | None = None


def mirrored_name(name: str) -> str:
    """The name on the other side: left and right, L and R standing alone, in whatever case; others stay."""

    def swap(found: re.Match[str]) -> str:
        word = found.group()
        other = _OTHER[word.lower()]
        return other.upper() if word.isupper() else other.capitalize() if word[0].isupper() else other

    return _SIDE.sub(swap, name)


def mirror_of(skeleton: Skeleton, by: Literal["names", "place"] = "names", across: int = 0) -> Mirror:
    """The mirror of a skeleton, whose joints find each other by their names or by their places at rest."""
    rest = object_matrices(skeleton, skeleton.rest)
    partners = _by_names(skeleton) if by == "names" else _by_place(rest[:, :3, 3], across)
    partners = np.where(partners[partners] == np.arange(len(partners)), partners, np.arange(len(partners)))
    parents = np.array([np.eye(3) if p < 0 else rest[p, :3, :3] for p in skeleton.parents]).reshape(-1, 3, 3)
    return Mirror(skeleton, partners, across, polar_rotation(rest[:, :3, :3]), parents)


def mirror_of_rig(rig: Rig) -> Mirror:
    """The mirror of a rig: by the names of its joints, by their places where no name knows a side."""
    mirror = mirror_of(rig.skeleton)
    if (mirror.partners == np.arange(len(mirror.partners))).all():
        mirror = mirror_of(rig.skeleton, "place")
    return mirror._replace(controls=tuple(control.name for control in rig.controls))


def mirrored_control(mirror: Mirror, name: str) -> str:
    """The abstract control of the other side."""
    other = mirrored_name(name)
    return other if mirror.controls is None or other in mirror.controls else name


def mirrored_pose(pose: Pose, mirror: Mirror) -> Pose:
    """The pose of the other side: every joint and control does what its counterpart did."""
    place = {name: j for j, name in enumerate(mirror.skeleton.names)}
    rotations: dict[str, Quaternion] = {}
    for name, q in pose.rotations.items():
        other, turn, _ = _maps(mirror, place, name)
        x, y, z, w = map(float, quaternion_from_matrix(turn @ matrix_from_quaternion(q) @ turn.T))
        rotations[other] = (x, y, z, w)
    translations: dict[str, Vector] = {}
    for name, offset in pose.translations.items():
        other, _, move = _maps(mirror, place, name)
        x, y, z = map(float, move @ np.array(offset))
        translations[other] = (x, y, z)
    numbers = {mirrored_control(mirror, name): value for name, value in pose.numbers.items()}
    return Pose(name=mirrored_name(pose.name), rotations=rotations, translations=translations, numbers=numbers)


def with_other_side(mirror: Mirror, pose: Pose, joints: Iterable[str]) -> Pose:
    """The pose with the partners of `joints` posed as their mirror image; joints of the middle stay."""
    place = {name: j for j, name in enumerate(mirror.skeleton.names)}
    sided = {n for n in joints if n in place and int(mirror.partners[place[n]]) != place[n]}
    partners = {mirror.skeleton.names[int(mirror.partners[place[n]])] for n in sided}
    image = mirrored_pose(Pose(
        rotations={n: q for n, q in pose.rotations.items() if n in sided},
        translations={n: t for n, t in pose.translations.items() if n in sided}), mirror)
    both: Pose = pose.replace(
        rotations={**{n: q for n, q in pose.rotations.items() if n not in partners}, **image.rotations},
        translations={**{n: t for n, t in pose.translations.items() if n not in partners}, **image.translations})
    return both


def mirrored_space(space: PoseSpace, mirror: Mirror) -> PoseSpace:
    """The space of the other side: distances between its poses are those between the poses it is made of."""
    place = {name: j for j, name in enumerate(mirror.skeleton.names)}
    by_control = {dof.control: dof for dof in space.dofs}

    def falloffs(own: dict[str, Falloff]) -> dict[str, Falloff]:
        return {
            _other_name(mirror, place, name): _falloff(mirror, place, by_control[name], falloff)
            for name, falloff in own.items()
        }

    dofs = []
    for dof in space.dofs:
        axis, side = np.array(dof.axis), np.array(dof.side)
        if dof.control in place:
            _, turn, _ = _maps(mirror, place, dof.control)
            axis, side = turn @ axis, turn @ side
        (ax, ay, az), (sx, sy, sz) = map(float, axis), map(float, side)
        dofs.append(dof.replace(
            control=_other_name(mirror, place, dof.control), axis=(ax, ay, az), side=(sx, sy, sz),
            falloff=_falloff(mirror, place, dof, dof.falloff)))
    changed: PoseSpace = space.replace(
        dofs=tuple(dofs),
        samples=tuple(
            PoseSample(pose=mirrored_pose(s.pose, mirror), falloffs=falloffs(s.falloffs)) for s in space.samples),
        anchors=tuple(mirrored_pose(pose, mirror) for pose in space.anchors),
        rest_falloffs=falloffs(space.rest_falloffs))
    return changed


def mirrored_layer(layer: PoseLayer, mirror: Mirror, vertex_partners: NDArray[np.integer]) -> PoseLayer:
    """The layer of the other side.

    Parameters
    ----------
    vertex_partners : (V,) the counterpart of every vertex, -1 where there is none; such vertices are left out.
    """
    partner = np.asarray(vertex_partners)[layer.vertices]
    keep = partner >= 0
    flip = np.ones(3, np.float32)
    flip[mirror.across] = -1.0
    changed: PoseLayer = layer.replace(
        name=mirrored_name(layer.name), space=mirrored_space(layer.space, mirror),
        vertices=freeze(partner[keep].astype(np.int32)), moved=freeze(layer.moved[:, keep]),
        after=freeze(layer.after[keep]), deltas=freeze(layer.deltas[:, keep] * flip),
        targets=freeze(layer.targets[:, keep] * flip))
    return changed


def _maps(mirror: Mirror, place: dict[str, int], name: str) -> tuple[str, Array, Array]:
    """Counterpart of a joint, and what carries directions in its frame, and in its parent's, to those of the other."""
    flip = np.eye(3)
    flip[mirror.across, mirror.across] = -1.0
    if name not in place:
        return mirrored_control(mirror, name), flip, flip
    j = place[name]
    p = int(mirror.partners[j])
    turn = mirror.turns[p].T @ flip @ mirror.turns[j]
    return mirror.skeleton.names[p], turn, np.linalg.inv(mirror.parents[p]) @ flip @ mirror.parents[j]


def _other_name(mirror: Mirror, place: dict[str, int], name: str) -> str:
    return _maps(mirror, place, name)[0]


def _falloff(mirror: Mirror, place: dict[str, int], dof: Dof, falloff: Falloff) -> Falloff:
    if dof.kind != "translation" or len(falloff) == 1:
        return falloff
    _, _, move = _maps(mirror, place, dof.control)
    x, y, z = (falloff[int(i)] for i in np.abs(move).argmax(axis=1))
    return x, y, z


def _by_names(skeleton: Skeleton) -> NDArray[np.int64]:
    place = {name: j for j, name in enumerate(skeleton.names)}
    return np.array([place.get(mirrored_name(name), j) for j, name in enumerate(skeleton.names)], np.int64)


def _by_place(places: Array, across: int) -> NDArray[np.int64]:
    """Joints in mirrored places; of several in one place the first goes with the first, and so on."""
    other = places.copy()
    other[:, across] *= -1.0
    near = SAME_PLACE * max(float(np.linalg.norm(np.ptp(places, axis=0))), 1e-12)
    out = np.arange(len(places))
    for j in range(len(places)):
        together = np.flatnonzero(np.linalg.norm(places - places[j], axis=1) <= near)
        there = np.flatnonzero(np.linalg.norm(places - other[j], axis=1) <= near)
        rank = int(np.flatnonzero(together == j)[0])
        if rank < len(there):
            out[j] = there[rank]
    return out.astype(np.int64)
