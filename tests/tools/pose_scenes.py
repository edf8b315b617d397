"""A small rig with two sides: a strip of skin along x, arms to the left and the right, and a lid on its own."""

from __future__ import annotations

import functools

import numpy as np

from core.document import Document, MeshObject
from core.evaluator import Evaluator
from core.mesh.mesh import Mesh
from core.pose.pose import Pose
from core.pose.rig import Control, Rig
from core.pose.rotation import quaternion_from_euler
from core.pose.skeleton import Skeleton, SkinWeights
from core.record import freeze
from core.workspace import Workspace
from tools.session import Session

ACROSS, DOWN = 17, 4  # vertices
EVALUATOR = Evaluator()
JOINTS = ("root", "arm_L", "arm_R", "lid")


@functools.cache
def strip() -> Mesh:
    """17 x 4 vertices, x from -1 to 1, quads, mirror-symmetric in places and in how they are joined."""
    x, y = np.meshgrid(np.linspace(-1.0, 1.0, ACROSS), np.linspace(-0.2, 0.2, DOWN), indexing="ij")
    points = np.stack([x, y, 0.05 * np.cos(2.0 * x) * np.cos(4.0 * y)], axis=-1).reshape(-1, 3).astype(np.float32)
    at = np.arange(ACROSS * DOWN, dtype=np.int32).reshape(ACROSS, DOWN)
    quads = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], axis=-1).reshape(-1, 4)
    return Mesh(
        points=freeze(points), counts=freeze(np.full(len(quads), 4, np.int32)), corners=freeze(quads.ravel().copy()),
        parts=freeze(np.zeros(len(quads), np.int32)), part_names=("strip",))


@functools.cache
def rig() -> Rig:
    """Arms bend at x = 0.2 and -0.2; the lid moves nothing; "smile_L" and "smile_R" are dials."""
    rest = np.tile(np.eye(4), (4, 1, 1))
    rest[1, 0, 3], rest[2, 0, 3], rest[3, 1, 3] = 0.2, -0.2, 0.5
    skeleton = Skeleton(
        names=JOINTS, parents=freeze(np.array([-1, 0, 0, 0], np.int32)), rest=freeze(rest), bind=freeze(rest.copy()))
    x = strip().points[:, 0].astype(np.float64)
    left, right = (np.clip((side * x + 0.1) / 0.6, 0.0, 1.0) for side in (1.0, -1.0))
    table = np.stack([np.maximum(1.0 - left - right, 0.0), left, right], axis=1)
    table /= table.sum(axis=1, keepdims=True)
    skin = SkinWeights(
        joints=freeze(np.tile(np.arange(3, dtype=np.int32), (len(x), 1))), weights=freeze(table.astype(np.float32)))
    controls = (Control(name="smile_L"), Control(name="smile_R"))
    return Rig(skeleton=skeleton, skin=skin, controls=controls)


def turned(name: str = "pose", numbers: dict[str, float] | None = None, **degrees) -> Pose:
    """A pose of joints turned by XYZ degrees."""
    rotations = {j: tuple(map(float, quaternion_from_euler(d))) for j, d in degrees.items()}
    return Pose(name=name, rotations=rotations, numbers=numbers or {})


def document(**fields) -> Document:
    """The strip with its rig, id 1."""
    item = MeshObject(id=1, name="strip", mesh=strip(), rig=rig())
    return Document(last_frame=1024, meshes=(item.replace(**fields),))


def session(frame: float = 1001.0, **fields) -> Session:
    """A session of the pose craft on it."""
    return Session(document(**fields), Workspace(mesh=1, craft="pose", frame=frame), evaluator=EVALUATOR)


def item(s: Session) -> MeshObject:
    """The mesh as it is now."""
    return s.document.meshes[0]
