"""Edits of the pose a mesh is held in, of its library and its clip. Pure functions for ``Session.edit`` and scripts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from core.document import Document, with_mesh
from core.errors import UserError
from core.pose.clip import check_frames
from core.pose.controls import rests, without_noise
from core.pose.keying import keyed, still_clip, with_moved_key, without_key
from core.pose.mirror_pose import mirror_of_rig, mirrored_pose, with_other_side
from core.pose.pose import REST, Pose
from core.pose.pose_map import mixed_pose
from core.pose.rig import all_clips
from core.pose.synthesis import pose_at
from tools.pose_edits import check_joints, hold_pose, pose_named, rigged, same_pose


def shown_pose(document: Document, mesh_id: int, frame: float) -> Pose:
    """The pose a mesh is seen in: the one that is held, else that of the clip at the frame without its rounding."""
    item, rig = rigged(document, mesh_id)
    return item.pose if item.pose is not None else without_noise(rig, pose_at(rig, frame))


def mirror_pose(
    document: Document, mesh_id: int, pose: Pose, what: Literal["whole pose", "selected joints"] = "whole pose"
) -> Document:
    """The document held in the image of a pose across X = 0, or with the selected joints copied to their partners."""
    item, rig = rigged(document, mesh_id)
    mirror = mirror_of_rig(rig)
    if what == "whole pose":
        return hold_pose(document, mesh_id, mirrored_pose(pose, mirror))
    if not item.joint_selection:
        raise UserError("No joint is selected; select the joints that should be copied to the other side.")
    return hold_pose(document, mesh_id, with_other_side(mirror, pose, item.joint_selection))


def reset_pose(document: Document, mesh_id: int, pose: Pose, joints: Sequence[str] | None = None) -> Document:
    """The document held at rest, or in a pose with some joints at rest; abstract controls rest with all joints."""
    _, rig = rigged(document, mesh_id)
    if joints is None:
        return hold_pose(document, mesh_id, REST)
    if not joints:
        raise UserError("No joint is selected; click a joint, or the skin it moves.")
    check_joints(rig, joints)
    kept: dict[str, Any] = {field: {name: value for name, value in getattr(pose, field).items() if name not in joints}
                            for field in ("rotations", "translations")}
    return hold_pose(document, mesh_id, pose.replace(**kept))


def apply_pose(document: Document, mesh_id: int, pose: Pose, name: str, amount: float = 1.0) -> Document:
    """The document held in a pose of the library or a sculpted one, or on the way there from `pose` by `amount`."""
    item, rig = rigged(document, mesh_id)
    to = pose_named(item, name)
    if amount == 1.0:
        return hold_pose(document, mesh_id, to)
    at = rests(rig)
    whole = [one.replace(numbers={**{n: at.get(n, 0.0) for n in {*pose.numbers, *to.numbers}}, **one.numbers})
             for one in (pose, to)]
    return hold_pose(document, mesh_id, mixed_pose(whole, np.array([1.0 - amount, amount]), pose.name))


def key_pose(document: Document, mesh_id: int, pose: Pose, frame: float) -> Document:
    """The document with a pose keyed in the clip at a frame, where it is let go of; a rig without a clip gets one.

    The clip comes to the pose from the keys before and after (see ``core.pose.keying``).
    """
    item, rig = rigged(document, mesh_id)
    clip = rig.clip
    if clip is None:
        count = document.last_frame - document.first_frame + 1
        names = {one.name for one in all_clips(rig)}
        name = next(n for n in ("keys", *(f"keys {i}" for i in range(2, len(names) + 3))) if n not in names)
        check_frames(name, count, len(rig.skeleton.names))
        clip = still_clip(rig.skeleton, float(document.first_frame), count, document.fps, name)
    clip = keyed(clip, rig, pose, frame)
    return with_mesh(document, item.replace(rig=rig.replace(clip=clip), pose=None))


def delete_pose_keys(document: Document, mesh_id: int, frames: Sequence[float]) -> Document:
    """The document without the keys of poses on some frames of the clip (see ``core.pose.keying.without_key``).

    Raises
    ------
    UserError
        None of the frames has a key.
    """
    item, rig = rigged(document, mesh_id)
    clip = rig.clip
    for frame in frames if clip is not None else ():
        assert clip is not None
        clip = without_key(clip, frame)
    if clip is None or clip is rig.clip:
        raise UserError("No pose is keyed on this frame; go to a key of the timeline.")
    return with_mesh(document, item.replace(rig=rig.replace(clip=clip)))


def move_pose_keys(document: Document, mesh_id: int, frames: Sequence[float], by: float) -> Document:
    """The document with keys of poses on some frames of the clip moved by whole frames.

    Raises
    ------
    UserError
        A key that is not moved is in the way.
    """
    item, rig = rigged(document, mesh_id)
    clip, step = rig.clip, round(by)
    if clip is None or not step:
        return document
    mine = {round(frame) for frame in frames}
    others = {round(clip.start + key) for key in clip.keys} - mine
    if any(frame + step in others for frame in mine):
        raise UserError("Another key is in the way; delete it first, or move the key elsewhere.")
    for frame in sorted(mine, reverse=step > 0):
        clip = with_moved_key(clip, rig, frame, frame + step)
    return with_mesh(document, item.replace(rig=rig.replace(clip=clip)))


def held_in_library(document: Document, mesh_id: int, pose: Pose) -> str | None:
    """The name under which the library has a pose, None when it has not."""
    item, _ = rigged(document, mesh_id)
    return next((known.name for known in item.library if same_pose(known, pose)), None)
