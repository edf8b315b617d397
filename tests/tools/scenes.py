"""A ball of fur to work on with a hand, symmetric across X = 0; it can bend."""

from __future__ import annotations

import functools

import numpy as np

from core.camera import Camera, look_at
from core.document import Document, MeshObject
from core.evaluator import Evaluator
from core.groom.groom import Groom, Map
from core.groom.guides import Guides
from core.groom.mirror import mirror
from core.groom.rows import no_guides, take_rows
from core.pose.rig import Rig
from core.pose.skeleton import Clip, Skeleton, SkinWeights
from core.record import freeze
from core.workspace import Workspace
from tests.core.groom.small_grooms import ball, fur
from tools.ground import Pointer, Sight
from tools.session import Session

SIZE = 400
EVALUATOR = Evaluator()
BENT = 1010.0  # a frame at which the ball is bent


def sight(direction=(0.0, 0.0, -1.0), distance=6.0, orthographic=False) -> Sight:
    """The ball from `distance` metres, by default from +z; from there its picture is about 130 pixels in radius."""
    d = np.asarray(direction, np.float64)
    eye = -distance * d / np.linalg.norm(d)
    return Sight(Camera(world_from_camera=look_at(eye, np.zeros(3)), orthographic=orthographic, height=3.6), SIZE, SIZE)


def pointers(places, **more) -> tuple[Pointer, ...]:
    return tuple(Pointer(float(x), float(y), time=0.01 * i, **more) for i, (x, y) in enumerate(places))


def line(start, end, count=12, **more) -> tuple[Pointer, ...]:
    return pointers(np.linspace(start, end, count), **more)


@functools.cache
def symmetric_fur(count: int = 500) -> Guides:
    guides = fur(count)
    away = np.abs(guides.points[:, 0, 0]) > 0.05
    return mirror(take_rows(guides, away), ball().skin)


@functools.cache
def rig() -> Rig:
    """The upper half of the ball nods and turns."""
    points = ball().skin.mesh.points
    t = np.clip(points[:, 1] + 0.5, 0.0, 1.0).astype(np.float32)
    frames = 20
    angle = np.linspace(0.0, 1.2, frames)
    rotations = np.zeros((frames, 2, 4), np.float32)
    rotations[:, 0, 3] = 1.0
    axis = np.array([0.6, 0.3, 0.8]) / np.linalg.norm([0.6, 0.3, 0.8])
    rotations[:, 1, :3] = np.sin(0.5 * angle)[:, None] * axis
    rotations[:, 1, 3] = np.cos(0.5 * angle)
    eye = np.tile(np.eye(4), (2, 1, 1))
    skeleton = Skeleton(names=("base", "top"), parents=np.array([-1, 0], np.int32), rest=eye, bind=eye)
    skin = SkinWeights(
        joints=np.tile(np.array([0, 1], np.int32), (len(points), 1)), weights=np.stack([1.0 - t, t], axis=1))
    clip = Clip(
        start=1001.0, translations=np.zeros((frames, 2, 3), np.float32), rotations=rotations,
        scales=np.ones((frames, 2, 3), np.float32))
    return Rig(skeleton=skeleton, skin=skin, clip=clip)


def document(guides: Guides | None = None, **changes) -> Document:
    mesh = ball().skin.mesh
    half = Map(name="half", values=freeze((mesh.points[:, 1] > 0.0).astype(np.float32)))
    groom = Groom(
        id=1, name="coat", mesh_id=1, guides=symmetric_fur() if guides is None else guides, maps=(half,))
    item = MeshObject(id=1, name="ball", mesh=mesh, rig=rig())
    return Document(meshes=(item.replace(**changes),), grooms=(groom,))


def session(guides: Guides | None = None, workspace: Workspace | None = None) -> Session:
    """A session whose derived data all tests share."""
    return Session(document(guides), workspace, evaluator=EVALUATOR)


def empty() -> Guides:
    return no_guides(12)


def guides_of(session: Session) -> Guides:
    return session.document.grooms[0].guides


def steps(history) -> list[tuple]:
    """Every state of a history, first to last."""
    return [history.jump(i) for i in range(len(history.names))]


