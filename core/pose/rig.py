"""A rig: skeleton, skin, blend shapes, clips and controls as one record."""

from __future__ import annotations

import math
from typing import Literal, get_args

import numpy as np

from core.errors import UserError
from core.pose.blend_shapes import BlendShapes
from core.pose.skeleton import Clip, Skeleton, SkinWeights
from core.record import Record, column, number, text

ConstraintKind = Literal["limit", "aim", "point", "orient"]


class Control(Record):
    """An abstract control: a named number. Joints are controls too, by their own names.

    kind : "number", a dial; "geometry", the number is how far the piece `vertices` has moved along `axis`;
        "joint", how far the origin of `joint` has.
    rest, low, high : where it rests and the range of its dial; it may be set beyond.
    vertices : (N,) int32 of the mesh, of kind "geometry".
    joint : of kind "joint", for example an isolated bone that serves as a switch.
    axis : direction of the movement, object space. travel : metres that raise the number by 1.
    """

    name: str
    kind: Literal["number", "geometry", "joint"] = "number"
    rest: float = 0.0
    low: float = 0.0
    high: float = 1.0
    vertices: np.ndarray | None = None
    joint: str | None = None
    axis: tuple[float, float, float] = (0.0, 1.0, 0.0)
    travel: float = 1.0

    def __post_init__(self) -> None:
        text(self, "name")
        number(self, "rest", "low", "high", least=-1e9, most=1e9)
        number(self, "axis", least=-1e9, most=1e9)
        number(self, "travel", least=1e-9, most=1e9)
        if not self.low <= self.rest <= self.high or self.low == self.high:
            raise ValueError(f"Control {self.name!r} must rest within a range from low to high")
        if self.kind != "number" and not any(self.axis):
            raise ValueError(f"Control {self.name!r} needs an axis to move along")
        if (self.kind == "geometry") != (self.vertices is not None) or (self.kind == "joint") != (
            self.joint is not None
        ):
            raise ValueError(f"Control {self.name!r} must name what moves it: vertices or a joint, as its kind says")
        if self.vertices is not None:
            column(self, "vertices", np.int32, (None,))
            if not len(self.vertices) or self.vertices.min() < 0:
                raise ValueError(f"Control {self.name!r} must name at least one vertex")


class Constraint(Record):
    """One constraint of a joint.

    kind : "limit" keeps its XYZ angles within `low` .. `high`, radians relative to rest; "aim" turns it so that its
        own `axis` points at the origin of `target`; "point" moves its origin to where `target` is, as far from it as
        at rest; "orient" turns it in object space as `target` is turned from its rest.
    weight : how much of it is done, 0 .. 1: of the way from where the parent carries the joint at rest to where the
        target wants it (0 leaves the joint free); a limit always holds whole.
    """

    joint: str
    kind: ConstraintKind
    target: str | None = None
    axis: tuple[float, float, float] = (1.0, 0.0, 0.0)
    low: tuple[float, float, float] = (-math.pi, -math.pi / 2, -math.pi)
    high: tuple[float, float, float] = (math.pi, math.pi / 2, math.pi)
    weight: float = 1.0

    def __post_init__(self) -> None:
        text(self, "joint")
        if self.kind not in get_args(ConstraintKind):
            raise ValueError(f"Constraint.kind must be one of {', '.join(get_args(ConstraintKind))}")
        number(self, "axis", "low", "high", least=-1e6, most=1e6)
        number(self, "weight", least=0.0, most=1.0)
        if (self.kind == "limit") != (self.target is None) or self.target == self.joint:
            raise ValueError(f"Constraint of {self.joint!r} must name another joint as target, or none for a limit")
        if any(a > b for a, b in zip(self.low, self.high, strict=True)):
            raise ValueError(f"Constraint of {self.joint!r} has a lowest angle above its highest")
        if not any(self.axis):
            raise ValueError(f"Constraint of {self.joint!r} needs an axis")


class Rig(Record):
    """What moves a mesh: first its blend shapes, then its skeleton.

    skin : one row for each vertex of the mesh.
    clip : the motion that plays, or None. clips : further ones it may play; names are unique among all of them.
    shapes : blend shapes; the number of a control of the same name is their weight.
    skinning : "linear" blend, or "dual-quaternion" (Kavan et al. 2008), which keeps volume in a twist; "mixed" where
        both meet in one mesh. dual : (V,) bool, of a mixed one, the vertices skinned by dual quaternions; else None.
    controls : abstract controls, one for each shape first; names are unique among themselves and the joints.
    constraints : what joints may do, and do because of others, while a pose is made by hand; in this order.
    file_vertices : (W,) int32, vertex of the mesh for each vertex of the file it was read from, None when they are the
        same: seams split by UVs are welded in the mesh, and results for other programs are ``points[file_vertices]``.
    """

    skeleton: Skeleton
    skin: SkinWeights
    clip: Clip | None = None
    clips: tuple[Clip, ...] = ()
    shapes: BlendShapes | None = None
    skinning: Literal["linear", "dual-quaternion", "mixed"] = "linear"
    dual: np.ndarray | None = None
    controls: tuple[Control, ...] = ()
    constraints: tuple[Constraint, ...] = ()
    file_vertices: np.ndarray | None = None

    def __post_init__(self) -> None:
        joints, vertices = len(self.skeleton.names), len(self.skin.joints)
        if self.skin.joints.size and not (self.skin.joints.min() >= 0 and self.skin.joints.max() < joints):
            raise ValueError("SkinWeights.joints names a joint the skeleton does not have")
        clips = all_clips(self)
        if any(clip.translations.shape[1] != joints for clip in clips):
            raise ValueError("Clip has another number of joints than the skeleton")
        if len({clip.name for clip in clips}) != len(clips):
            raise ValueError("Rig.clips must have names that differ")
        names = control_names(self)
        if len(set(names)) != len(names):
            raise ValueError("Rig.controls must have names that differ from each other and from those of the joints")
        if self.shapes is not None:
            missing = set(self.shapes.names) - {control.name for control in self.controls}
            if missing:
                raise ValueError(f"Rig.controls lacks the shape {min(missing)!r}")
            if len(self.shapes.vertices) and self.shapes.vertices.max() >= vertices:
                raise ValueError("BlendShapes.vertices names a vertex the skin does not have")
        for control in self.controls:
            if control.vertices is not None and control.vertices.max() >= vertices:
                raise ValueError(f"Control {control.name!r} names a vertex the skin does not have")
            if control.joint is not None and control.joint not in self.skeleton.names:
                raise ValueError(f"Control {control.name!r} names a joint the skeleton does not have")
        for one in self.constraints:
            if not {one.joint, one.target or one.joint} <= set(self.skeleton.names):
                raise ValueError(f"Rig.constraints name a joint that the skeleton does not have: {one.joint!r}")
        if (self.skinning == "mixed") != (self.dual is not None):
            raise ValueError("Rig.dual must say which vertices dual quaternions skin, of mixed skinning only")
        if self.dual is not None:
            column(self, "dual", np.bool_, (vertices,))
        if self.file_vertices is not None:
            column(self, "file_vertices", np.int32, (None,))
            if self.file_vertices.size and not (self.file_vertices.min() >= 0 and self.file_vertices.max() < vertices):
                raise ValueError("Rig.file_vertices names a vertex the skin does not have")


def all_clips(rig: Rig) -> tuple[Clip, ...]:
    """The clip that plays, if any, and the others."""
    return rig.clips if rig.clip is None else (rig.clip, *rig.clips)


def clip_named(rig: Rig, name: str) -> Clip:
    """The clip of that name; UserError when there is none."""
    clips = all_clips(rig)
    for clip in clips:
        if clip.name == name:
            return clip
    known = ", ".join(clip.name for clip in clips[:20])
    raise UserError(f"There is no clip {name!r}; " + (f"choose one of {known}." if known else "this rig has none."))


def playing(rig: Rig, name: str | None) -> Rig:
    """The rig with the clip of that name playing, or none."""
    if name is None:
        return rig.replace(clip=None, clips=all_clips(rig))
    clip = clip_named(rig, name)
    return rig.replace(clip=clip, clips=tuple(other for other in all_clips(rig) if other is not clip))


def control_names(rig: Rig) -> tuple[str, ...]:
    """Names of all that can be set in a pose: joints, then abstract controls."""
    return (*rig.skeleton.names, *(control.name for control in rig.controls))


def resting_numbers(rig: Rig) -> dict[str, float]:
    """The numbers of all abstract controls at rest."""
    return {control.name: control.rest for control in rig.controls}
