"""Actions of the pose craft: what is done to a whole mesh with a rig at once, by ``Session.act(name, **params)``.

Each is an edit of the document, called with what is held, selected and shown; a macro writes down that call.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from core.document import Document, MeshObject, find_mesh
from core.errors import UserError
from core.pose.controls import rests
from core.pose.embedding import coordinates
from core.pose.pose import Pose, moved_controls
from core.pose.pose_space import PoseSample, PoseSpace
from core.pose.rig import Rig
from core.record import Record
from tools import control_edits, pose_edits, posing_edits, skin_edits
from tools.action import NoParams, params_of
from tools.pose import action_params as told
from tools.pose_edits import rigged, same_pose, sculpt_name


@dataclass(frozen=True)
class Scene:
    """What an action may ask of the mesh it is done to: its rig, what is selected, and the pose that is shown."""

    document: Document
    item: MeshObject
    rig: Rig
    frame: float

    @cached_property
    def pose(self) -> Pose:
        """The pose that is shown, held or of the clip."""
        return posing_edits.shown_pose(self.document, self.item.id, self.frame)

    @property
    def selection(self) -> tuple[str, ...]:
        """Selected joints, the active one last; UserError when there is none."""
        found = tuple(n for n in self.item.joint_selection if n in self.rig.skeleton.names)
        if not found:
            raise UserError("No joint is selected; click a joint, or the skin it moves.")
        return found

    @property
    def samples(self) -> list[tuple[PoseSpace, PoseSample]]:
        """All sculpted poses with their spaces."""
        layers = () if self.item.correctives is None else self.item.correctives.layers
        return [(layer.space, sample) for layer in layers for sample in layer.space.samples]

    def to_sculpt_at(self, name: str) -> Pose:
        """The pose that is shown under the name of the sculpt there, or a free one; UserError at rest."""
        if not moved_controls(self.pose, rests(self.rig)):
            raise UserError("A corrective needs a pose away from rest: turn a joint or move a control first.")
        named = self.pose.replace(name=name.strip()[:200] or self.pose.name)
        return named.replace(name=sculpt_name(self.item.correctives, named))

    def sculpt(self, name: str) -> str:
        """The sculpted pose of that name, or where it is empty the one that is shown; UserError without one."""
        if name:
            return name
        for _, sample in self.samples:
            if same_pose(sample.pose, self.pose):
                return sample.name
        raise UserError("There is no sculpt at the pose that is shown; click one in the list of poses, or name it.")

    def nearest(self, among: PoseSpace | None = None, but: str | None = None) -> str:
        """The sculpted pose nearest to the one that is shown, as its space measures; UserError without one."""
        far = {sample.name: float(np.linalg.norm(coordinates(sample.pose, space) - coordinates(self.pose, space)))
               for space, sample in self.samples if (among is None or space is among) and sample.name != but}
        if not far:
            raise UserError("There is no other sculpted pose; sculpt at one first.")
        return min(far, key=lambda name: far[name])

    def control(self, name: str) -> str:
        """The abstract control of that name, or where it is empty the last that is no shape of the rig's file."""
        shapes = () if self.rig.shapes is None else self.rig.shapes.names
        found = [control.name for control in self.rig.controls if control.name not in shapes]
        if not name and not found:
            raise UserError("The rig has no control of its own; add a dial first.")
        return name or found[-1]

    def pair(self, one: str, other: str) -> tuple[str, str]:
        """Two sculpted poses of a layer: `other`, or where it is empty the nearest, then `one`."""
        name = self.sculpt(one)
        space = next((space for space, sample in self.samples if sample.name == name), None)
        return (other or self.nearest(space, name)), name


class PoseAction(NamedTuple):
    """One thing that is done to the active mesh with a rig.

    name, label, icon : id, words, file in resources/icons without suffix or None. tooltip : what it does and when.
    step : name of the undo step. edit : ``edit(document, mesh_id, *arguments)``, the same for scripts.
    arguments : of the edit, from what the mesh is like and the parameters.
    Params : what it can be told. asks : one of them that a window asks for (a file, a name).
    """

    name: str
    label: str
    tooltip: str
    step: str
    edit: Callable[..., Document]
    arguments: Callable[[Scene, Any], tuple[Any, ...]] = lambda scene, params: ()
    Params: type[Record] = NoParams
    icon: str | None = None
    asks: str | None = None

    def make(self, params: dict[str, Any]) -> Record:
        """Its parameters from plain values; UserError naming the one that is not as it should be."""
        return params_of(self.label, self.Params, params)


def scene_of(document: Document, mesh_id: int, frame: float) -> Scene:
    """The mesh an action is to be done to; UserError when it has no rig, or a lock or an eye keeps tools off."""
    item = find_mesh(document, mesh_id)
    if item.locked or item.hidden:
        word, done = ("locked", "unlock") if item.locked else ("hidden", "show")
        raise UserError(f"{item.name} is {word}; {done} it in the scene panel to work on it.")
    return Scene(document, item, rigged(document, mesh_id)[1], frame)


# -- what edits are called with -----------------------------------------------------------------------------


def _file(scene: Scene, params: told.FileParams) -> tuple[Any, ...]:
    if not params.file:
        raise UserError("Which file? Give the path of an OBJ or USD file with the sculpt.")
    stem = params.file.replace("\\", "/").rsplit("/", 1)[-1].rsplit(".", 1)[0]
    return scene.to_sculpt_at(params.name or stem), params.file


def _moved(scene: Scene, params: told.MoveParams) -> tuple[Any, ...]:
    name = params.pose or scene.nearest()
    return name, scene.to_sculpt_at("").replace(name=name)


def _stored(scene: Scene, params: told.NameParams) -> tuple[Any, ...]:
    taken = {pose.name for pose in scene.item.library}
    name = params.name.strip()[:200] or next(n for n in (f"pose {i}" for i in range(1, len(taken) + 2))
                                             if n not in taken)
    return (scene.pose.replace(name=name),)


def _applied(scene: Scene, params: told.ApplyParams) -> tuple[Any, ...]:
    names = [pose.name for pose in scene.item.library]
    if not params.name and not names:
        raise UserError("The library has no pose yet; store one first.")
    held = posing_edits.held_in_library(scene.document, scene.item.id, scene.pose)
    name = params.name or names[(names.index(held) + 1) % len(names) if held is not None else 0]
    return scene.pose, name, params.amount


def _forgotten(scene: Scene, params: told.ForgetParams) -> tuple[Any, ...]:
    name = params.name or posing_edits.held_in_library(scene.document, scene.item.id, scene.pose)
    if name is None:
        raise UserError("The pose that is shown is none of the library; name the one to delete.")
    return (name,)


def _smoothed(scene: Scene, params: told.SmoothParams) -> tuple[Any, ...]:
    return params.amount, params.passes, scene.selection[-1] if params.joints == "active" else None


def _unlocked(scene: Scene, params: NoParams) -> tuple[Any, ...]:
    return scene.item.joint_selection or scene.item.locked_joints, False


def _mask(how: skin_edits.MaskEdit) -> Callable[[Scene, Any], tuple[Any, ...]]:
    return lambda scene, params: (how, getattr(params, "times", 1))


def _led(scene: Scene, params: told.ConstrainParams) -> tuple[Any, ...]:
    if len(scene.selection) != 2:
        raise UserError("Select two joints: first the one that leads, then with Shift the one that should follow.")
    target, joint = scene.selection
    return joint, target, params.kind, params.weight, told.AXES[params.axis]


_TABLE: tuple[PoseAction, ...] = (
    PoseAction(
        "import_sculpt", "Import sculpt", "Takes the sculpt of an OBJ or USD file for the pose that is shown.",
        "Import sculpt", pose_edits.import_sculpt, _file, told.FileParams, "import", asks="file"),
    PoseAction(
        "add_sculpt", "Add sculpt here", "Makes the pose that is shown a sample of pose space, as the surface looks.",
        "Add sculpt", pose_edits.add_sculpt_as_seen,
        lambda s, p: (s.to_sculpt_at(p.name), p.twins), told.AddParams, "plus"),
    PoseAction(
        "restore_sculpt", "Restore sculpt", "Brings the surface at this pose back to the skin, or to another's shape.",
        "Restore sculpt", pose_edits.restore_sculpt,
        lambda s, p: (s.to_sculpt_at(""), p.towards, p.amount), told.RestoreParams, "restore"),
    PoseAction(
        "mirror_sculpt", "Mirror sculpt", "Puts the sculpt at this pose on the other side too, at the mirrored pose.",
        "Mirror sculpt", pose_edits.mirror_sculpt,
        lambda s, p: (s.sculpt(p.pose), p.way, p.source), told.MirrorSculptParams, "symmetry"),
    PoseAction(
        "merge_poses", "Merge poses", "Makes one of this sculpted pose and the nearest of its layer, averaged.",
        "Merge poses", pose_edits.merge_poses, lambda s, p: (s.pair(p.pose, p.into),), told.PairParams, "group"),
    PoseAction(
        "delete_pose", "Delete pose", "Deletes the sculpt at the pose that is shown; the other sculpts stay.",
        "Delete pose", pose_edits.remove_pose, lambda s, p: (s.sculpt(p.pose),), told.PoseParams, "delete"),
    PoseAction(
        "move_pose", "Move pose here", "Moves the nearest sculpt to the pose that is shown; its correction stays.",
        "Move pose", pose_edits.move_pose, _moved, told.MoveParams, "move"),
    PoseAction(
        "mirror_pose", "Mirror pose", "Turns the pose that is shown into its image on the other side.",
        "Mirror pose", posing_edits.mirror_pose, lambda s, p: (s.pose, p.what), told.MirrorPoseParams, "symmetry"),
    PoseAction(
        "reset_pose", "Reset pose", "Puts every joint back to rest, and every dial with them.", "Reset pose",
        posing_edits.reset_pose, lambda s, p: (s.pose,), icon="reset"),
    PoseAction(
        "reset_joints", "Reset selected joints", "Puts the selected joints back to rest and leaves the others alone.",
        "Reset joints", posing_edits.reset_pose, lambda s, p: (s.pose, s.selection), icon="reset"),
    PoseAction(
        "follow_clip", "Follow the clip", "Lets go of the pose that is held, so that the clip moves the rig again.",
        "Follow the clip", pose_edits.hold_pose, lambda s, p: (None,), icon="play"),
    PoseAction(
        "key_pose", "Key pose", "Keys the pose that is shown in the clip at this frame, eased to the keys beside it.",
        "Key pose", posing_edits.key_pose, lambda s, p: (s.pose, s.frame), icon="key-set"),
    PoseAction(
        "delete_pose_key", "Delete pose key", "Takes the key of the pose on this frame out of the clip.",
        "Delete pose key", posing_edits.delete_pose_keys, lambda s, p: ((s.frame,),), icon="delete"),
    PoseAction(
        "store_pose", "Store pose", "Keeps the pose that is shown in the library, to come back to later.",
        "Store pose", pose_edits.keep_pose, _stored, told.NameParams, "bookmark"),
    PoseAction(
        "apply_pose", "Apply pose", "Holds a pose of the library; without a name the next one, again and again.",
        "Apply pose", posing_edits.apply_pose, _applied, told.ApplyParams, "pose"),
    PoseAction(
        "forget_pose", "Delete stored pose", "Deletes the pose that is shown from the library; sculpts stay.",
        "Delete stored pose", pose_edits.forget_pose, _forgotten, told.ForgetParams, "delete"),
    PoseAction(
        "mirror_weights", "Mirror weights", "Copies the skin weights of one side of the mesh to the other.",
        "Mirror weights", skin_edits.mirror_weights, lambda s, p: (p.source,), told.SourceParams, "symmetry"),
    PoseAction(
        "smooth_weights", "Smooth weights", "Evens skin weights out between neighbours; locked joints keep theirs.",
        "Smooth weights", skin_edits.smooth_weights, _smoothed, told.SmoothParams, "smooth"),
    PoseAction(
        "normalise_weights", "Normalise weights", "Makes the skin weights of every vertex sum to 1, each joint once.",
        "Normalise weights", skin_edits.normalise_weights),
    PoseAction(
        "limit_influences", "Limit influences", "Keeps the strongest joints of every vertex, 4 unless told otherwise.",
        "Limit influences", skin_edits.limit_influences, lambda s, p: (p.influences,), told.LimitParams),
    PoseAction(
        "prune_weights", "Prune weights", "Drops skin weights below one percent and shares them out to the others.",
        "Prune weights", skin_edits.prune_weights, lambda s, p: (p.least,), told.PruneParams),
    PoseAction(
        "lock_joints", "Lock joint weights", "Locks the weights of the selected joints, so that no brush changes them.",
        "Lock weights", skin_edits.lock_joints, lambda s, p: (s.selection, True), icon="lock"),
    PoseAction(
        "unlock_joints", "Unlock joint weights", "Unlocks the weights of the selected joints, or of all without any.",
        "Unlock weights", skin_edits.lock_joints, _unlocked, icon="unlock"),
    PoseAction(
        "clear_mask", "Clear mask", "Takes the whole mask away, so that brushes reach all of the surface.",
        "Clear mask", skin_edits.edit_mask, _mask("clear"), icon="mask"),
    PoseAction(
        "invert_mask", "Invert mask", "Protects what is free from sculpt brushes and frees what is protected.",
        "Invert mask", skin_edits.edit_mask, _mask("invert"), icon="invert"),
    PoseAction(
        "grow_mask", "Grow mask", "Makes the mask reach one ring of neighbours farther than it did.",
        "Grow mask", skin_edits.edit_mask, _mask("grow"), told.TimesParams, "grow"),
    PoseAction(
        "shrink_mask", "Shrink mask", "Takes one ring of neighbours away from the rim of the mask.",
        "Shrink mask", skin_edits.edit_mask, _mask("shrink"), told.TimesParams, "shrink"),
    PoseAction(
        "blur_mask", "Blur mask", "Softens the border of the mask, so that brushes fade into it.",
        "Blur mask", skin_edits.edit_mask, _mask("blur"), told.TimesParams, "smooth"),
    PoseAction(
        "add_dial", "Add dial", "Gives the rig a dial: a named number with a range, for sculpts to read.",
        "Add dial", control_edits.add_dial, lambda s, p: (p.name, p.low, p.high, p.rest), told.DialParams, "plus",
        asks="name"),
    PoseAction(
        "add_pad", "Add pad", "Gives the rig two dials that make a pad, such as valence and arousal.",
        "Add pad", control_edits.add_pad, lambda s, p: (p.across, p.up, p.reach), told.PadParams, "plus"),
    PoseAction(
        "add_joint_control", "Add joint switch", "Makes the movement of the active joint a number for sculpts to read.",
        "Add switch", control_edits.add_joint_control,
        lambda s, p: (p.name, s.selection[-1], told.AXES[p.axis], p.travel), told.MovedParams, "plus", asks="name"),
    PoseAction(
        "add_geometry_control", "Add geometry control", "Makes the movement of what is masked a number for sculpts.",
        "Add geometry control", control_edits.add_masked_control,
        lambda s, p: (p.name, told.AXES[p.axis], p.travel), told.MovedParams, "plus", asks="name"),
    PoseAction(
        "edit_control", "Edit control", "Gives an abstract control another name, range or place at rest.",
        "Edit control", control_edits.change_control,
        lambda s, p: (s.control(p.name), p.to, p.low, p.high, p.rest), told.EditControlParams, asks="to"),
    PoseAction(
        "delete_control", "Delete control", "Deletes an abstract control that no sculpt reads; poses forget it.",
        "Delete control", control_edits.remove_control, lambda s, p: (s.control(p.name),), told.ControlParams,
        "delete"),
    PoseAction(
        "limit_joint", "Limit joint", "Keeps the angles of the active joint within a range, 45 degrees either way.",
        "Limit joint", control_edits.limit_joint,
        lambda s, p: (s.selection[-1], (p.low,) * 3, (p.high,) * 3), told.AngleParams),
    PoseAction(
        "constrain_joint", "Constrain joint", "Lets the active joint aim at, follow or turn with the one before it.",
        "Constrain joint", control_edits.constrain_joint, _led, told.ConstrainParams),
    PoseAction(
        "free_joints", "Free joints", "Takes limits and constraints of the selected joints away; their pose stays.",
        "Free joints", control_edits.free_joints, lambda s, p: (s.selection,)),
)

ACTIONS: dict[str, PoseAction] = {action.name: action for action in _TABLE}
