"""Edits of sculpted poses and their layers. Pure functions for ``Session.edit`` and for scripts.

``session.edit("Delete pose", remove_pose, 1, "bent")`` is one named step. What an edit disturbs is made again: every
other sculpt stays what it was, whatever layer it lies in.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from core.document import Document, MeshObject, find_mesh, with_mesh
from core.errors import UserError
from core.formats.pose_json import read_sculpt
from core.pose import edit_layers
from core.pose.clip import onto_skeleton, resampled
from core.pose.controls import rotation_dof
from core.pose.corrective import as_kind
from core.pose.layers import space_dofs
from core.pose.pose import SAME, Pose
from core.pose.pose_space import REST_NAME, Correctives, Dof, Falloff, PoseLayer, Way
from core.pose.rig import Constraint, Rig, all_clips
from core.pose.synthesis import evaluate

NOTHING = Correctives()
ROUNDED = 1e-6  # radians and metres: what samples of clips in single precision miss rest by
Reading = Literal["swing", "twist", "swing-twist", "x", "y", "z"]


def add_sculpt(
    document: Document, mesh_id: int, pose: Pose, target: NDArray[Any] | None = None,
    falloffs: Mapping[str, Falloff] | None = None, dofs: Sequence[Dof] | None = None, **options: Any,
) -> Document:
    """The document with a sculpt at a pose, or anew where the pose has the name of one.

    Parameters
    ----------
    target : (V, 3), the surface as sculpted, object space; as the layers give it when None.
    dofs : what a new space reads of the controls. options : other fields of a new space.

    Raises
    ------
    Refusal
        Naming the poses it cannot be told apart from.
    """
    item, rig = _rigged(document, mesh_id)
    have = item.correctives or NOTHING
    surface = evaluate(item.mesh.points, rig, have, pose) if target is None else target
    made = edit_layers.add_sculpt(item.mesh.points, rig, have, pose, surface, falloffs, dofs, **options)
    return with_mesh(document, item.replace(correctives=made.correctives))


def import_sculpt(document: Document, mesh_id: int, pose: Pose, path: str | Path) -> Document:
    """The document with a sculpt made by another program at a pose: a file with the vertices of the rig's file.

    Raises
    ------
    UserError
        When the file is missing, damaged, or has another number of vertices; or as :func:`add_sculpt`.
    """
    _, rig = _rigged(document, mesh_id)
    return add_sculpt(document, mesh_id, pose, read_sculpt(Path(path), rig, f"pose {pose.name!r}"))


def remove_pose(document: Document, mesh_id: int, name: str) -> Document:
    """The document without a sculpted pose; a layer without poses goes as well."""
    at, _ = _place(document, mesh_id, name)
    return _changed(document, mesh_id, edit_layers.without_pose(_correctives(document, mesh_id), name), at)


def merge_poses(document: Document, mesh_id: int, names: Sequence[str]) -> Document:
    """The document with poses of one layer as one, at the first of them, their sculpts averaged."""
    at = min(_place(document, mesh_id, name)[0] for name in names)
    return _changed(document, mesh_id, edit_layers.merged_poses(_correctives(document, mesh_id), names), at)


def move_pose(document: Document, mesh_id: int, name: str, pose: Pose) -> Document:
    """The document with a sculpt at another pose of the same controls; its corrections stay what they are."""
    item, rig = _rigged(document, mesh_id)
    at, _ = _place(document, mesh_id, name)
    moved = edit_layers.moved_pose(item.mesh.points, rig, _correctives(document, mesh_id), name, pose)
    return _changed(document, mesh_id, moved, at)


def rename_pose(document: Document, mesh_id: int, name: str, to: str) -> Document:
    """The document with another name for a sculpted pose; UserError when it is taken."""
    item, _ = _rigged(document, mesh_id)
    renamed = edit_layers.renamed_pose(_correctives(document, mesh_id), name, to)
    return with_mesh(document, item.replace(correctives=renamed))


def rename_layer(document: Document, mesh_id: int, name: str, to: str) -> Document:
    """The document with another name for a layer; UserError when it is taken."""
    layers = _correctives(document, mesh_id).layers
    named = to.strip()
    if not named or not named.isprintable() or len(named) > 255:
        raise UserError("A layer needs a name of letters, at most 255.")
    if any(layer.name == named for layer in layers if layer.name != name):
        raise UserError(f"There is a layer {named!r} already; choose another name.")
    return _with_layer(document, mesh_id, _layer(document, mesh_id, name)[0], name=named)


def set_layer_enabled(document: Document, mesh_id: int, name: str, enabled: bool) -> Document:
    """The document with a layer switched on or off; what lies above it keeps its corrections, not its surfaces."""
    return _with_layer(document, mesh_id, _layer(document, mesh_id, name)[0], enabled=enabled)


def set_space(document: Document, mesh_id: int, layer: str, **changes: Any) -> Document:
    """The document with fields of the space of a layer changed: kernel, normalise, affine, clamp, weighted, ...

    Raises
    ------
    UserError
        A value is out of its range (the sentence names the field). Refusal names poses that then cannot be told apart.
    """
    at, found = _layer(document, mesh_id, layer)
    try:
        space = found.space.replace(**changes)
    except (ValueError, TypeError) as error:
        raise UserError(f"This cannot be set: {error}.") from error
    return _changed(document, mesh_id, _with(document, mesh_id, at, space=space), at)


def set_falloff(document: Document, mesh_id: int, name: str, control: str, falloff: Falloff | None) -> Document:
    """The document with the reach of a pose along a control: radians, metres or units; as all others when None."""
    at, k = _place(document, mesh_id, name)
    space = _correctives(document, mesh_id).layers[at].space
    own = {c: f for c, f in space.samples[k].falloffs.items() if c != control}
    sample = space.samples[k].replace(falloffs=own if falloff is None else {**own, control: falloff})
    samples = (*space.samples[:k], sample, *space.samples[k + 1 :])
    return set_space(document, mesh_id, _correctives(document, mesh_id).layers[at].name, samples=samples)


def set_reading(document: Document, mesh_id: int, layer: str, joint: str, reading: Reading) -> Document:
    """The document with a layer that reads swing, twist, both, or the turn about one axis of a joint."""
    _, rig = _rigged(document, mesh_id)
    found = _layer(document, mesh_id, layer)[1]
    if joint not in found.space.controls:
        raise UserError(f"The layer {layer!r} does not read {joint!r}; it reads {', '.join(found.space.controls)}.")
    picked = [d for d in found.space.dofs if d.control != joint or d.kind == "translation"]
    mine = rotation_dof(rig.skeleton, joint, reading)
    if any(set(s.falloffs.get(joint, ())) and len(s.falloffs[joint]) > 1 for s in found.space.samples):
        raise UserError(f"Poses have falloffs per axis for {joint!r}; set them to one number first.")
    dofs = space_dofs(rig, [s.pose for s in found.space.samples], found.space.controls, [*picked, mine])
    return set_space(document, mesh_id, layer, dofs=tuple(sorted(dofs, key=lambda d: (d.control, d.kind))))


def set_way(document: Document, mesh_id: int, way: Way) -> Document:
    """The document with all layers interpolated in another way: the pose space, or plain shapes to compare with."""
    item, _ = _rigged(document, mesh_id)
    return with_mesh(document, item.replace(correctives=as_kind(_correctives(document, mesh_id), way)))


def hold_pose(document: Document, mesh_id: int, pose: Pose | None) -> Document:
    """The document with a mesh held in a pose; None for the clip at the frame again.

    Joints that are at rest but for the rounding of a clip's samples are at rest.
    """
    item, _ = _rigged(document, mesh_id)
    if pose is not None:
        pose = pose.replace(
            rotations={j: q for j, q in pose.rotations.items() if 2.0 * math.hypot(*q[:3]) > ROUNDED},
            translations={j: t for j, t in pose.translations.items() if math.hypot(*t) > ROUNDED})
    return with_mesh(document, item.replace(pose=pose))


def select_joints(document: Document, mesh_id: int, names: Sequence[str]) -> Document:
    """The document with joints of a mesh selected, the active one last; UserError when there is no such joint."""
    item, rig = _rigged(document, mesh_id)
    for name in names:
        if name not in rig.skeleton.names:
            raise UserError(f"There is no joint {name!r}; choose one of {', '.join(rig.skeleton.names[:20])}.")
    return with_mesh(document, item.replace(joint_selection=tuple(dict.fromkeys(names))))


def keep_pose(document: Document, mesh_id: int, pose: Pose) -> Document:
    """The document with a pose in the library; it takes the place of the one of its name."""
    item, _ = _rigged(document, mesh_id)
    others = tuple(known for known in item.library if known.name != pose.name)
    return with_mesh(document, item.replace(library=(*others, pose)))


def forget_pose(document: Document, mesh_id: int, name: str) -> Document:
    """The document without a pose of the library; UserError when there is none of that name."""
    item, _ = _rigged(document, mesh_id)
    others = tuple(known for known in item.library if known.name != name)
    if len(others) == len(item.library):
        raise UserError(f"The library has no pose {name!r}; choose one from its list.")
    return with_mesh(document, item.replace(library=others))


def add_rig(document: Document, item: MeshObject) -> Document:
    """The document with a mesh and its rig, under an id of its own; its clip sets the times of an empty document."""
    added = item.replace(id=1 + max((known.id for known in document.meshes), default=0))
    times: dict[str, Any] = {}
    if not document.meshes and item.rig is not None and item.rig.clip is not None:
        clip = item.rig.clip
        times = {"first_frame": math.floor(clip.start), "last_frame": math.ceil(clip.end),
                 "fps": clip.frames_per_second}
    changed: Document = document.replace(meshes=(*document.meshes, added), **times)
    return changed


def play_clip_file(document: Document, mesh_id: int, source: Rig) -> Document:
    """The document with a mesh playing the clip of another rig with joints of the same names, in no pose held."""
    item, rig = _rigged(document, mesh_id)
    if source.clip is None:
        raise UserError("That file has no motion; choose one with a clip.")
    clip = onto_skeleton(source.clip, source.skeleton, rig.skeleton)
    clip = resampled(clip, document.fps, float(document.first_frame))
    played = rig.replace(clip=clip, clips=all_clips(rig))
    last = max(document.last_frame, math.ceil(clip.end))
    changed: Document = with_mesh(document, item.replace(rig=played, pose=None)).replace(last_frame=last)
    return changed


def set_constraints(document: Document, mesh_id: int, constraints: Sequence[Constraint]) -> Document:
    """The document with other constraints of the joints of a rig; poses already made stay as they are."""
    item, rig = _rigged(document, mesh_id)
    try:
        return with_mesh(document, item.replace(rig=rig.replace(constraints=tuple(constraints))))
    except ValueError as error:
        raise UserError(f"This cannot be set: {error}.") from error


# what these share


def _rigged(document: Document, mesh_id: int) -> tuple[MeshObject, Rig]:
    item = find_mesh(document, mesh_id)
    if item.rig is None:
        raise UserError(f"{item.name} has no rig; import one with a skeleton or blend shapes.")
    return item, item.rig


def _correctives(document: Document, mesh_id: int) -> Correctives:
    return _rigged(document, mesh_id)[0].correctives or NOTHING


def _place(document: Document, mesh_id: int, name: str) -> tuple[int, int]:
    return edit_layers.place_of(_correctives(document, mesh_id), name)


def _layer(document: Document, mesh_id: int, name: str) -> tuple[int, PoseLayer]:
    for at, layer in enumerate(_correctives(document, mesh_id).layers):
        if layer.name == name:
            return at, layer
    raise UserError(f"There is no layer {name!r}; choose one from the list of layers.")


def _with(document: Document, mesh_id: int, at: int, **changes: Any) -> Correctives:
    have = _correctives(document, mesh_id)
    layers = (*have.layers[:at], have.layers[at].replace(**changes), *have.layers[at + 1 :])
    changed: Correctives = have.replace(layers=layers)
    return changed


def _with_layer(document: Document, mesh_id: int, at: int, **changes: Any) -> Document:
    item = find_mesh(document, mesh_id)
    return with_mesh(document, item.replace(correctives=_with(document, mesh_id, at, **changes)))


def _changed(document: Document, mesh_id: int, correctives: Correctives, first: int) -> Document:
    """The document with correctives of which layers `first` and on are extracted anew, their sculpts held."""
    item, rig = _rigged(document, mesh_id)
    made = edit_layers.refresh(item.mesh.points, rig, correctives, first, item.correctives)
    return with_mesh(document, item.replace(correctives=made.correctives))



def sculpt_name(correctives: Correctives | None, pose: Pose) -> str:
    """The name under which a sculpt at a pose is kept: that of the pose sculpted there, else a free one."""
    samples = [] if correctives is None else [s.pose for layer in correctives.layers for s in layer.space.samples]
    for known in samples:
        if same_pose(known, pose):
            return known.name
    taken = {known.name for known in samples} | {REST_NAME}
    base = pose.name[:200]
    return next(n for n in (base, *(f"{base} {i}" for i in range(2, len(taken) + 3))) if n not in taken)


def same_pose(one: Pose, other: Pose) -> bool:
    """True when two poses put every control in the same place, whatever their names are."""
    def differs(a: Mapping[str, Any], b: Mapping[str, Any], rest: Any) -> bool:
        both = a.keys() | b.keys()
        return any(np.abs(np.subtract(a.get(c, rest), b.get(c, rest))).max() > SAME for c in both)

    turned = (0.0, 0.0, 0.0, 1.0)
    return not (
        differs(one.rotations, other.rotations, turned) or differs(one.numbers, other.numbers, 0.0)
        or differs(one.translations, other.translations, (0.0, 0.0, 0.0)))
