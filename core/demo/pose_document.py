"""The demo of pose space: an arm whose joints are repaired by sculpts, and a face on two axes of emotion."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from core.camera import frame_points
from core.demo.arm import arm
from core.demo.arm_sculpts import arm_sculpts
from core.demo.face import face
from core.document import Document, MeshObject
from core.falloff import smoothstep
from core.groom.dress import Stage, no_stages
from core.pose.clip import clip_of_matrices
from core.pose.layers import build
from core.pose.pose import Pose, local_of_pose
from core.pose.rig import Rig
from core.pose.rotation import quaternion_from_euler
from core.pose.skeleton import Clip
from core.pose.synthesis import evaluate_at, prepare
from core.transform import Array, translation
from core.workspace import Workspace

FIRST, FRAMES = 1001, 96
FACE_AT = (0.95, 0.02, 0.0)  # metres; beside the hand


def pose_document(stage: Stage = no_stages) -> Document:
    """The arm (mesh 1) with sculpts for elbow, forearm and shoulder; the face (mesh 2) with four expressions.

    Both play a clip of 96 frames from 1001: the arm bends, twists and rises, the face goes round its dial.
    """
    with stage("arm"):
        model = arm()
        limb = model.rig.replace(clip=_arm_clip(model.rig))
        corrections = build(model.mesh.points, limb, arm_sculpts(model)).correctives
        first = MeshObject(id=1, name="arm", mesh=model.mesh, rig=limb, correctives=corrections)
    with stage("face"):
        head = face()
        mesh = head.mesh.replace(points=(head.mesh.points + FACE_AT).astype(np.float32))
        offset = translation(FACE_AT)
        skeleton = head.rig.skeleton.replace(
            rest=offset @ head.rig.skeleton.rest, bind=offset @ head.rig.skeleton.bind)
        rig = head.rig.replace(skeleton=skeleton)
        rig = rig.replace(clip=_face_clip(rig))
        sculpts = [s._replace(target=s.target + FACE_AT) for s in head.sculpts if s.target is not None]
        expressions = build(mesh.points, rig, sculpts).correctives
        second = MeshObject(id=2, name="face", mesh=mesh, rig=rig, correctives=expressions)
    return Document(first_frame=FIRST, last_frame=FIRST + FRAMES - 1, fps=24.0, meshes=(first, second))


def pose_workspace(document: Document) -> Workspace:
    """Where the demo opens: the craft of posing, with arm and face seen from the front through all of their clip."""
    seen = [
        evaluate_at(item.mesh.points, item.rig, prepare(item.correctives, item.rig), FIRST + frame)
        for item in document.meshes if item.rig is not None for frame in _ARM
    ]
    camera = frame_points(np.concatenate(seen), (-0.25, -0.15, -1.0), aspect=0.9)
    return Workspace(craft="pose", tool="grab", cameras=(camera,))


# frames: degrees of elbow about z, wrist about x, shoulder about z; the face: valence, arousal
_ARM = {
    0: (0, 0, 0), 20: (115, 0, 0), 32: (60, 150, 0), 48: (0, 150, 0), 64: (0, 0, 72), 78: (90, 80, 40), 95: (0, 0, 0),
}
_FACE = {0: (0, 0), 16: (1, 1), 36: (1, -1), 56: (-1, -1), 76: (-1, 1), 95: (0, 0)}


def _eased(keys: Mapping[int, tuple[float, ...]]) -> Array:
    """Values (FRAMES, N) of keys by frame, easing in and out of each."""
    at, values = np.array(list(keys)), np.array(list(keys.values()), np.float64)
    frames = np.arange(FRAMES)
    low = np.clip(np.searchsorted(at, frames, side="right") - 1, 0, len(at) - 2)
    share = smoothstep(at[low], at[low + 1], frames)[:, None]
    return np.asarray((1.0 - share) * values[low] + share * values[low + 1], np.float64)


def _arm_clip(rig: Rig) -> Clip:
    local = []
    for elbow, wrist, shoulder in _eased(_ARM):
        angles = {"elbow": (0.0, 0.0, elbow), "wrist": (wrist, 0.0, 0.0), "shoulder": (0.0, 0.0, shoulder)}
        turns = {joint: quaternion_from_euler(degrees).tolist() for joint, degrees in angles.items()}
        pose = Pose(rotations={joint: (x, y, z, w) for joint, (x, y, z, w) in turns.items()})
        local.append(local_of_pose(rig.skeleton, pose))
    return clip_of_matrices("bend, twist, raise", FIRST, 24.0, np.array(local))


def _face_clip(rig: Rig) -> Clip:
    still = np.repeat(rig.skeleton.rest[None], FRAMES, axis=0)
    return clip_of_matrices("round the dial", FIRST, 24.0, still, ("valence", "arousal"), _eased(_FACE))
