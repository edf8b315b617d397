"""Edits of the abstract controls and the constraints of a rig. Pure functions for ``Session.edit`` and for scripts.

A control is a dial (a number with a range), a joint whose movement is the number (a switch), or a piece of the mesh
whose movement is the number. Two dials make a pad.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from core.document import Document, MeshObject, with_mesh
from core.errors import UserError
from core.pose.edit_layers import refresh
from core.pose.pose import Pose, Vector
from core.pose.pose_space import Correctives
from core.pose.rig import Constraint, ConstraintKind, Control, Rig, control_names
from core.record import freeze
from tools.pose_edits import hold_pose, rigged, set_constraints

PIECE = 0.5  # of the mask, from which a vertex belongs to the piece that is made a control


def add_control(document: Document, mesh_id: int, control: Control) -> Document:
    """The document with one more abstract control; UserError when its name is taken or it names what is not there."""
    item, rig = rigged(document, mesh_id)
    return with_mesh(document, item.replace(rig=_with_controls(rig, (*rig.controls, control))))


def add_joint_control(
    document: Document, mesh_id: int, name: str, joint: str, axis: Vector = (0.0, 1.0, 0.0), travel: float = 1.0,
    low: float = 0.0, high: float = 1.0,
) -> Document:
    """The document with a joint, most often an isolated one, as a switch: moved by `travel` along `axis` it reads 1."""
    return add_control(document, mesh_id, _control(
        name=name, kind="joint", joint=joint, axis=axis, travel=travel, low=low, high=high, rest=_at_rest(low, high)))


def add_geometry_control(
    document: Document, mesh_id: int, name: str, vertices: Sequence[int], axis: Vector = (0.0, 1.0, 0.0),
    travel: float = 1.0, low: float = 0.0, high: float = 1.0,
) -> Document:
    """The document with a piece of the mesh as a control: its number is how far the piece has moved along `axis`.

    Parameters
    ----------
    vertices : of the piece. travel : metres that raise the number by 1.
    """
    piece = freeze(np.unique(np.asarray(vertices, np.int64)).astype(np.int32))
    return add_control(document, mesh_id, _control(
        name=name, kind="geometry", vertices=piece, axis=axis, travel=travel, low=low, high=high,
        rest=_at_rest(low, high)))


def add_masked_control(
    document: Document, mesh_id: int, name: str, axis: Vector = (0.0, 1.0, 0.0), travel: float = 1.0
) -> Document:
    """As :func:`add_geometry_control`, of the piece that the mask covers."""
    item, _ = rigged(document, mesh_id)
    piece = [] if item.mask is None else np.flatnonzero(item.mask >= PIECE).tolist()
    if not piece:
        raise UserError("Nothing is masked; paint the mask over the piece of geometry that should be the control.")
    return add_geometry_control(document, mesh_id, name, piece, axis, travel)


def add_dial(
    document: Document, mesh_id: int, name: str, low: float = 0.0, high: float = 1.0, rest: float = 0.0
) -> Document:
    """The document with a dial: a number of its own with a range."""
    return add_control(document, mesh_id, _control(name=name, low=low, high=high, rest=rest))


def add_pad(document: Document, mesh_id: int, across: str, up: str, reach: float = 1.0) -> Document:
    """The document with a two-dimensional pad: two dials from -reach to reach that rest in the middle."""
    for name in (across, up):
        document = add_dial(document, mesh_id, name, -reach, reach)
    return document


def edit_control(document: Document, mesh_id: int, control: str, **changes: Any) -> Document:
    """The document with fields of a control changed: name, rest, low, high, axis, travel. Sculpts are met as before.

    Poses, clips and spaces that read it know it by its new name. The range of a shape of the rig may change, its name
    may not.
    """
    item, rig = rigged(document, mesh_id)
    old, name = _named(rig, control), control
    if rig.shapes is not None and name in rig.shapes.names and changes.get("name", name) != name:
        raise UserError(f"{name!r} is a shape of the rig's file and keeps its name; make a dial beside it instead.")
    try:
        new: Control = old.replace(**changes)
    except (ValueError, TypeError) as error:
        raise UserError(f"This cannot be set: {error}.") from error
    rig = _with_controls(rig, tuple(new if one is old else one for one in rig.controls))
    changed: MeshObject = item.replace(rig=rig)
    if new.name != name:
        changed = _renamed(changed, rig, name, new.name)
    if changed.correctives is not None and _reads(changed.correctives, new.name):
        layers = tuple(layer.replace(space=layer.space.replace(dofs=tuple(
            dof.replace(rest=new.rest) if dof.control == new.name else dof for dof in layer.space.dofs)))
            for layer in changed.correctives.layers)
        assert changed.rig is not None
        made = refresh(item.mesh.points, changed.rig, changed.correctives.replace(layers=layers))
        changed = changed.replace(correctives=made.correctives)
    return with_mesh(document, changed)


def change_control(
    document: Document, mesh_id: int, name: str, to: str = "", low: float = 0.0, high: float = 0.0, rest: float = 0.0
) -> Document:
    """As :func:`edit_control`, of name, range and rest; an empty name and an empty range stay as they are."""
    changes: dict[str, Any] = {} if low == high else {"low": low, "high": high, "rest": rest}
    return edit_control(document, mesh_id, name, name=to.strip() or name, **changes)


def remove_control(document: Document, mesh_id: int, name: str) -> Document:
    """The document without an abstract control; poses forget it.

    Raises
    ------
    UserError
        It is a shape of the rig's file, or sculpts are read by it (they are named).
    """
    item, rig = rigged(document, mesh_id)
    gone = _named(rig, name)
    if rig.shapes is not None and name in rig.shapes.names:
        raise UserError(f"{name!r} is a shape of the rig's file, which cannot be deleted here.")
    if item.correctives is not None and _reads(item.correctives, name):
        poses = [s.name for layer in item.correctives.layers if name in layer.space.controls
                 for s in layer.space.samples]
        raise UserError(f"The sculpts {', '.join(poses[:10])} are read by {name!r}; delete these poses first.")

    def without(pose: Pose) -> Pose:
        kept: Pose = pose.replace(numbers={n: v for n, v in pose.numbers.items() if n != name})
        return kept

    clips = {}
    for clip in (*rig.clips, *(() if rig.clip is None else (rig.clip,))):
        keep = [i for i, n in enumerate(clip.number_names) if n != name]
        if len(keep) < len(clip.number_names):
            assert clip.numbers is not None
            numbers = freeze(np.ascontiguousarray(clip.numbers[:, keep])) if keep else None
            clips[clip.name] = clip.replace(
                number_names=tuple(clip.number_names[i] for i in keep), numbers=numbers)
    rig = rig.replace(
        controls=tuple(one for one in rig.controls if one is not gone),
        clip=None if rig.clip is None else clips.get(rig.clip.name, rig.clip),
        clips=tuple(clips.get(clip.name, clip) for clip in rig.clips))
    return with_mesh(document, item.replace(
        rig=rig, pose=None if item.pose is None else without(item.pose), library=tuple(map(without, item.library))))


def limit_joint(
    document: Document, mesh_id: int, joint: str, low: Vector, high: Vector
) -> Document:
    """The document in which a joint turns within XYZ angles, radians from rest, when it is posed by hand."""
    return _constrained(document, mesh_id, {"joint": joint, "kind": "limit", "low": low, "high": high})


def constrain_joint(
    document: Document, mesh_id: int, joint: str, target: str, kind: ConstraintKind, weight: float = 1.0,
    axis: Vector = (1.0, 0.0, 0.0),
) -> Document:
    """The document in which a joint aims at another, follows its place, or turns along with it when it is posed."""
    return _constrained(document, mesh_id, {
        "joint": joint, "kind": kind, "target": target, "weight": weight, "axis": axis})


def edit_constraint(document: Document, mesh_id: int, at: int, **changes: Any) -> Document:
    """The document with fields of the constraint number `at` of the rig changed: low, high, weight, axis."""
    _, rig = rigged(document, mesh_id)
    try:
        made = _constraint_at(rig, at).replace(**changes)
    except (ValueError, TypeError) as error:
        raise UserError(f"This cannot be set: {error}.") from error
    return _with_constraints(document, mesh_id, (*rig.constraints[:at], made, *rig.constraints[at + 1 :]))


def remove_constraint(document: Document, mesh_id: int, at: int) -> Document:
    """The document without the constraint number `at` of the rig."""
    _, rig = rigged(document, mesh_id)
    gone = _constraint_at(rig, at)
    return set_constraints(document, mesh_id, tuple(one for one in rig.constraints if one is not gone))


def free_control_name(rig: Rig, base: str) -> str:
    """A name for a control that none has: `base`, or with a number after it."""
    taken = set(control_names(rig))
    return next(n for n in (base, *(f"{base} {i}" for i in range(2, len(taken) + 3))) if n not in taken)


def free_joints(document: Document, mesh_id: int, joints: Sequence[str]) -> Document:
    """The document without the constraints of some joints."""
    _, rig = rigged(document, mesh_id)
    kept = tuple(one for one in rig.constraints if one.joint not in joints)
    return document if kept == rig.constraints else set_constraints(document, mesh_id, kept)


def _constrained(document: Document, mesh_id: int, fields: dict[str, Any]) -> Document:
    """The document with a constraint in place of the one of its joint and kind; a pose that is held obeys it at once.

    Where the joint cannot be led, for it carries the target, the document is refused.
    """
    _, rig = rigged(document, mesh_id)
    try:
        one = Constraint(**fields)
    except ValueError as error:
        raise UserError(f"This cannot be set: {error}.") from error
    above = one.target
    while above is not None and above in rig.skeleton.names:
        if above == one.joint:
            raise UserError(f"{one.joint!r} carries {one.target!r} and cannot be led by it; choose another target.")
        parent = int(rig.skeleton.parents[rig.skeleton.names.index(above)])
        above = None if parent < 0 else rig.skeleton.names[parent]
    others = [c for c in rig.constraints if (c.joint, c.kind) != (one.joint, one.kind)]
    return _with_constraints(document, mesh_id, (*others, one))


def _with_constraints(document: Document, mesh_id: int, constraints: tuple[Constraint, ...]) -> Document:
    """The document with these constraints, which a pose that is held obeys at once."""
    pose = rigged(document, mesh_id)[0].pose
    document = set_constraints(document, mesh_id, constraints)
    return document if pose is None else hold_pose(document, mesh_id, pose)


def _constraint_at(rig: Rig, at: int) -> Constraint:
    if not 0 <= at < len(rig.constraints):
        raise UserError(f"There is no constraint {at}; the rig has {len(rig.constraints)}.")
    return rig.constraints[at]


def _control(**fields: Any) -> Control:
    try:
        return Control(**fields)
    except (ValueError, TypeError) as error:
        raise UserError(f"This control cannot be made: {error}.") from error


def _with_controls(rig: Rig, controls: tuple[Control, ...]) -> Rig:
    try:
        made: Rig = rig.replace(controls=controls)
    except ValueError as error:
        raise UserError(f"This control cannot be made: {error}.") from error
    return made


def _named(rig: Rig, name: str) -> Control:
    for control in rig.controls:
        if control.name == name:
            return control
    known = ", ".join(control.name for control in rig.controls[:20])
    raise UserError(f"There is no control {name!r}; " + (f"choose one of {known}." if known else "this rig has none."))


def _at_rest(low: float, high: float) -> float:
    return min(max(0.0, low), high)


def _reads(correctives: Correctives, name: str) -> bool:
    return any(name in layer.space.controls for layer in correctives.layers)


def _renamed(item: MeshObject, rig: Rig, name: str, to: str) -> MeshObject:
    """The mesh in which poses, clips and spaces call a control by another name."""
    def named(table: dict[str, Any]) -> dict[str, Any]:
        return {to if n == name else n: v for n, v in table.items()}

    def pose(one: Pose) -> Pose:
        other: Pose = one.replace(numbers=named(one.numbers))
        return other

    def clip(one: Any) -> Any:
        return one.replace(number_names=tuple(to if n == name else n for n in one.number_names))

    correctives = item.correctives
    if correctives is not None:
        layers = []
        for layer in correctives.layers:
            space = layer.space.replace(
                dofs=tuple(d.replace(control=to) if d.control == name else d for d in layer.space.dofs),
                samples=tuple(s.replace(pose=pose(s.pose), falloffs=named(s.falloffs)) for s in layer.space.samples),
                anchors=tuple(map(pose, layer.space.anchors)), rest_falloffs=named(layer.space.rest_falloffs))
            layers.append(layer.replace(space=space))
        correctives = correctives.replace(layers=tuple(layers))
    renamed: MeshObject = item.replace(
        rig=rig.replace(clip=None if rig.clip is None else clip(rig.clip), clips=tuple(map(clip, rig.clips))),
        correctives=correctives, pose=None if item.pose is None else pose(item.pose),
        library=tuple(map(pose, item.library)))
    return renamed
