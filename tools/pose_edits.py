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
from core.formats.sculpt_topology import check_topology
from core.leaves import same_bits
from core.pose import edit_layers
from core.pose.carry import carried_surface, mirrored_surface
from core.pose.clip import onto_skeleton, resampled
from core.pose.constraints import constrained
from core.pose.controls import NOISE, rotation_dof, without_noise
from core.pose.corrective import as_kind
from core.pose.layers import space_dofs, with_rest_falloffs
from core.pose.mirror_pose import mirror_of_rig, mirrored_space
from core.pose.pose import Pose
from core.pose.pose_space import REST_NAME, Correctives, Dof, Falloff, PoseLayer, Way
from core.pose.refusal import Refusal
from core.pose.rig import Constraint, Rig, all_clips
from core.pose.sculpt.symmetry import opposites_by_axis, opposites_by_topology
from core.pose.synthesis import evaluate

NOTHING = Correctives()
Reading = Literal["swing", "twist", "swing-twist", "x", "y", "z"]
Twins = Literal["refuse", "merge", "delete"]
SPACE_OPTIONS = ("kernel", "kernel_version", "normalise", "affine", "clamp", "smoothing", "table", "weighted")


def add_sculpt(
    document: Document, mesh_id: int, pose: Pose, target: NDArray[Any] | None = None,
    falloffs: Mapping[str, Falloff] | None = None, dofs: Sequence[Dof] | None = None, *, twins: Twins = "refuse",
    **options: Any,
) -> Document:
    """The document with a sculpt at a pose, or anew where the pose has the name of one.

    Parameters
    ----------
    target : (V, 3), the surface as sculpted, object space; as the layers give it when None.
    dofs : what a new space reads of the controls. options : other fields of a new space.
    twins : what becomes of sculpts from which the pose cannot be told apart. They are named in a refusal; or "merge":
        the new sculpt joins them at their pose, averaged; or "delete": they are deleted for it.

    Raises
    ------
    Refusal
        Naming the poses it cannot be told apart from.
    """
    item, rig = rigged(document, mesh_id)
    have = item.correctives or NOTHING
    pose = without_noise(rig, pose)
    surface = evaluate(item.mesh.points, rig, have, pose) if target is None else target
    try:
        made = edit_layers.add_sculpt(item.mesh.points, rig, have, pose, surface, falloffs, dofs, **options)
    except Refusal as refusal:
        others = [name for name in refusal.poses if name not in (pose.name, REST_NAME)]
        if twins == "refuse" or not others or refusal.reason == "coplanar":
            refusal.sculpt = pose, surface
            raise
        if twins == "delete":
            for name in others:
                document = remove_pose(document, mesh_id, name)
            return add_sculpt(document, mesh_id, pose, surface, falloffs, dofs, twins=twins, **options)
        return _merged_into(document, mesh_id, others[0], pose, surface)
    return with_mesh(document, item.replace(correctives=made.correctives))


def add_sculpt_as_seen(document: Document, mesh_id: int, pose: Pose, twins: Twins = "refuse") -> Document:
    """The document with a pose made a sample, its surface as the layers give it; `twins` as of :func:`add_sculpt`."""
    return add_sculpt(document, mesh_id, pose, twins=twins)


def import_sculpt(document: Document, mesh_id: int, pose: Pose, path: str | Path) -> Document:
    """The document with a sculpt made by another program at a pose: a file with the vertices of the rig's file.

    Raises
    ------
    UserError
        When the file is missing, damaged, or has other vertices or faces (the sentence says how many, which face is
        the first that differs, and what to do); or as :func:`add_sculpt`. Nothing is changed then.
    """
    item, rig = rigged(document, mesh_id)
    path = Path(path)
    target = read_sculpt(path, rig, f"pose {pose.name!r}")
    check_topology(path, item.mesh, rig)
    return add_sculpt(document, mesh_id, pose, target)


def restore_sculpt(
    document: Document, mesh_id: int, pose: Pose, towards: str = "", amount: float = 1.0
) -> Document:
    """The document with the surface at a pose brought back by `amount` to the skin alone, or to another pose's shape.

    What the mask covers stays.

    Parameters
    ----------
    towards : a sculpted pose or one of the library, whose corrections are carried to this one; "" for the skin alone.
    """
    item, rig = rigged(document, mesh_id)
    have, points = item.correctives or NOTHING, item.mesh.points
    pose = without_noise(rig, pose)
    if towards:
        goal = carried_surface(points, rig, have, pose_named(item, towards), pose)
    else:
        goal = evaluate(points, rig, None, pose)
    now = evaluate(points, rig, have, pose)
    share = np.full(len(points), amount, np.float32) if item.mask is None else amount * (1.0 - item.mask)
    surface = (now + share[:, None] * (goal - now)).astype(np.float32)
    if np.array_equal(surface, now):
        return document
    return add_sculpt(document, mesh_id, pose.replace(name=sculpt_name(have, pose)), surface)


def mirror_sculpt(
    document: Document, mesh_id: int, name: str, way: Literal["topology", "axis"] = "topology",
    source: Literal["+X", "-X"] = "+X",
) -> Document:
    """The document with a sculpt on the other side as well: at the mirrored pose, its image across X = 0.

    A sculpt at a pose that is its own image becomes symmetric: the side `source` of it is copied.

    Parameters
    ----------
    way : how opposite vertices are found: by how polygons are joined, or by where they are at rest.

    Raises
    ------
    UserError
        There is no such pose, or by topology the mesh is not connected alike on both sides.
    """
    item, rig = rigged(document, mesh_id)
    have, points = _correctives(document, mesh_id), item.mesh.points
    at, k = _place(document, mesh_id, name)
    space, mirror = have.layers[at].space, mirror_of_rig(rig)
    opposites = opposites_by_topology(item.mesh) if way == "topology" else opposites_by_axis(points)
    sample = space.samples[k]
    other, surface = mirrored_surface(
        points, rig, have, sample.pose, mirror, opposites, 1 if source == "+X" else -1)
    if other is sample.pose:
        return add_sculpt(document, mesh_id, other, surface, sample.falloffs)
    image = mirrored_space(space.replace(samples=(sample,), anchors=()), mirror)
    options = {field: getattr(space, field) for field in SPACE_OPTIONS}
    named = other.replace(name=sculpt_name(have, other))
    return add_sculpt(document, mesh_id, named, surface, image.samples[0].falloffs, image.dofs, **options)


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
    item, rig = rigged(document, mesh_id)
    at, _ = _place(document, mesh_id, name)
    there = without_noise(rig, pose).replace(name=name)
    moved = edit_layers.moved_pose(item.mesh.points, rig, _correctives(document, mesh_id), name, there)
    return _changed(document, mesh_id, moved, at)


def rename_pose(document: Document, mesh_id: int, name: str, to: str) -> Document:
    """The document with another name for a sculpted pose; UserError when it is taken."""
    item, _ = rigged(document, mesh_id)
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
    if falloff is not None and control not in space.controls:
        raise UserError(f"The layer of {name!r} does not read {control!r}; it reads {', '.join(space.controls)}.")
    own = {c: f for c, f in space.samples[k].falloffs.items() if c != control}
    sample = space.samples[k].replace(falloffs=own if falloff is None else {**own, control: falloff})
    changed = with_rest_falloffs(space.replace(samples=(*space.samples[:k], sample, *space.samples[k + 1 :])))
    return set_space(
        document, mesh_id, _correctives(document, mesh_id).layers[at].name, samples=changed.samples,
        rest_falloffs=changed.rest_falloffs)


def set_reading(document: Document, mesh_id: int, layer: str, joint: str, reading: Reading) -> Document:
    """The document with a layer that reads swing, twist, both, or the turn about one axis of a joint."""
    _, rig = rigged(document, mesh_id)
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
    item, _ = rigged(document, mesh_id)
    return with_mesh(document, item.replace(correctives=as_kind(_correctives(document, mesh_id), way)))


def hold_pose(document: Document, mesh_id: int, pose: Pose | None) -> Document:
    """The document with a mesh held in a pose, constraints of the rig done; None for the clip at the frame again.

    Joints that are at rest but for the rounding of a clip's samples are at rest.
    """
    item, rig = rigged(document, mesh_id)
    if pose is not None:
        pose = without_noise(rig, constrained(rig.skeleton, rig.constraints, pose))
    return document if same_bits(pose, item.pose) else with_mesh(document, item.replace(pose=pose))


def select_joints(document: Document, mesh_id: int, names: Sequence[str]) -> Document:
    """The document with joints of a mesh selected, the active one last; UserError when there is no such joint."""
    item, rig = rigged(document, mesh_id)
    check_joints(rig, names)
    wanted = tuple(dict.fromkeys(names))
    return document if wanted == item.joint_selection else with_mesh(document, item.replace(joint_selection=wanted))


def keep_pose(document: Document, mesh_id: int, pose: Pose) -> Document:
    """The document with a pose in the library; it takes the place of the one of its name."""
    item, _ = rigged(document, mesh_id)
    known = [one.name for one in item.library]
    library = tuple(pose if one.name == pose.name else one for one in item.library)
    library = library if pose.name in known else (*library, pose)
    return document if same_bits(library, item.library) else with_mesh(document, item.replace(library=library))


def forget_pose(document: Document, mesh_id: int, name: str) -> Document:
    """The document without a pose of the library; UserError when there is none of that name."""
    item, _ = rigged(document, mesh_id)
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
    item, rig = rigged(document, mesh_id)
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
    item, rig = rigged(document, mesh_id)
    try:
        return with_mesh(document, item.replace(rig=rig.replace(constraints=tuple(constraints))))
    except ValueError as error:
        raise UserError(f"This cannot be set: {error}.") from error


# what these share


def rigged(document: Document, mesh_id: int) -> tuple[MeshObject, Rig]:
    """A mesh and its rig; UserError when it has none."""
    item = find_mesh(document, mesh_id)
    if item.rig is None:
        raise UserError(f"{item.name} has no rig; import one with a skeleton or blend shapes.")
    return item, item.rig


def check_joints(rig: Rig, names: Sequence[str]) -> None:
    """UserError when one of them is no joint of the rig."""
    for name in names:
        if name not in rig.skeleton.names:
            raise UserError(f"There is no joint {name!r}; choose one of {', '.join(rig.skeleton.names[:20])}.")


def _correctives(document: Document, mesh_id: int) -> Correctives:
    return rigged(document, mesh_id)[0].correctives or NOTHING


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
    item, rig = rigged(document, mesh_id)
    made = edit_layers.refresh(item.mesh.points, rig, correctives, first, item.correctives)
    return with_mesh(document, item.replace(correctives=made.correctives))


def _merged_into(document: Document, mesh_id: int, name: str, pose: Pose, surface: NDArray[Any]) -> Document:
    """The document with the sculpt of that name averaged with a surface sculpted at (nearly) the same pose."""
    item, rig = rigged(document, mesh_id)
    have, points = _correctives(document, mesh_id), item.mesh.points
    at, k = _place(document, mesh_id, name)
    there = have.layers[at].space.samples[k]
    now = evaluate(points, rig, have, there.pose)
    added = np.asarray(surface) - evaluate(points, rig, None, pose) + evaluate(points, rig, None, there.pose)
    return add_sculpt(document, mesh_id, there.pose, (0.5 * (now + added)).astype(np.float32), there.falloffs)


def pose_named(item: MeshObject, name: str) -> Pose:
    """A sculpted pose or one of the library; UserError when there is none of that name."""
    samples = [s.pose for layer in (item.correctives or NOTHING).layers for s in layer.space.samples]
    for pose in (*samples, *item.library):
        if pose.name == name:
            return pose
    raise UserError(f"There is no pose {name!r}; choose a sculpted one, or one of the library.")


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
    """True when two poses put every control in the same place but for the rounding of clips, whatever their names."""
    def differs(a: Mapping[str, Any], b: Mapping[str, Any], rest: Any) -> bool:
        both = a.keys() | b.keys()
        return any(np.abs(np.subtract(a.get(c, rest), b.get(c, rest))).max() > NOISE for c in both)

    turned = (0.0, 0.0, 0.0, 1.0)
    return not (
        differs(one.rotations, other.rotations, turned) or differs(one.numbers, other.numbers, 0.0)
        or differs(one.translations, other.translations, (0.0, 0.0, 0.0)))
